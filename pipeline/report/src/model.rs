//! What the pages say, before it is written as Markdown or as HTML: the findings of a paper, a table in the
//! paper's own layout, who is missing, how many cells have which verdict.

use crate::bibliography;
use crate::source::Held;
use std::collections::BTreeSet;
use zonobench_verdicts::judged::{self, Judged, Subject, Tally};
use zonobench_verdicts::published::Cell;
use zonobench_verdicts::verdict::Verdict;

/// A printed number or claim that does not come out as written.
pub struct Finding<'a> {
    /// The cell
    pub cell: &'a Judged,
    /// What must be measured for a claim to hold, and the words that say so
    pub asked: Option<(String, &'a str)>,
}

/// The findings of one table.
pub struct TableFindings<'a> {
    /// The table's title
    pub title: &'a str,
    /// What differs or does not hold
    pub decided: Vec<Finding<'a>>,
    /// What could not be decided, by its reason: cells that share one are one finding
    pub undecided: Vec<(&'a str, Vec<&'a Judged>)>,
}

/// What differs, does not hold, or could not be decided, table by table.
pub fn findings(paper: &Held) -> Vec<TableFindings<'_>> {
    let found = |title: &str| -> Vec<&Judged> {
        let cells = paper.comparisons.iter();
        cells
            .filter(|c| c.is_as_written() && c.verdict.is_finding() && *c.table == *title)
            .collect()
    };
    let of_table = |title| {
        let (undecided, decided): (Vec<&Judged>, Vec<&Judged>) = found(title)
            .into_iter()
            .partition(|c| c.verdict == Verdict::NotReproducible);
        let mut by_reason: Vec<(&str, Vec<&Judged>)> = Vec::new();
        for c in undecided {
            match by_reason
                .iter_mut()
                .find(|(reason, _)| *reason == &*c.reason)
            {
                Some((_, same)) => same.push(c),
                None => by_reason.push((&c.reason, vec![c])),
            }
        }
        let decided = decided.into_iter().map(|cell| Finding {
            cell,
            asked: (cell.asked.as_ref()).map(|(asked, words)| (asked.to_string(), words.as_str())),
        });
        TableFindings {
            title,
            decided: decided.collect(),
            undecided: by_reason,
        }
    };
    let tables = paper.tables().into_iter().map(of_table);
    tables
        .filter(|t| !t.decided.is_empty() || !t.undecided.is_empty())
        .collect()
}

/// Claims that come out as written and turn under another reading: the cells of that reading.
pub fn turned(paper: &Held) -> Vec<&Judged> {
    paper
        .comparisons
        .iter()
        .filter(|c| {
            !c.is_as_written() && matches!(c.verdict, Verdict::Differs | Verdict::DoesNotHold)
        })
        .filter(|c| {
            let mut written = paper
                .comparisons
                .iter()
                .filter(|w| w.is_as_written() && w.is_same_cell(c));
            written.any(|w| w.verdict.is_success())
        })
        .collect()
}

/// What the cells of the papers came to: numbers, parameters and claims apart.
pub fn tallies(papers: &[&Held]) -> Vec<Tally> {
    judged::tallies(papers.iter().flat_map(|p| &p.comparisons))
}

/// Papers of the bibliography that `papers` does not have, as their folders: those with experiments in this
/// version, and those without.
pub fn absent(papers: &[&Held]) -> [Vec<&'static str>; 2] {
    let known = zonobench_verdicts::papers::names();
    [true, false].map(|of_ours| {
        let folders = bibliography::folders().into_iter();
        folders
            .filter(|folder| {
                !papers
                    .iter()
                    .any(|p| p.name == *folder && !p.comparisons.is_empty())
            })
            .filter(|folder| known.contains(folder) == of_ours)
            .collect()
    })
}

/// The rows of a table all of whose cells are parameters that agree, as written: they need no attention.
pub fn exact_rows(cells: &[&Judged]) -> BTreeSet<String> {
    let mut rows: BTreeSet<String> = cells.iter().map(|c| c.row.to_string()).collect();
    for c in cells {
        if c.subject != Subject::Parameter || !c.verdict.is_success() || !c.is_as_written() {
            rows.remove(&*c.row);
        }
    }
    rows
}

/// A table of numbers in the paper's own layout.
pub struct Grid<'a> {
    /// The columns' labels
    pub columns: Vec<&'a str>,
    /// The rows
    pub rows: Vec<GridRow<'a>>,
}

/// A row of a [`Grid`] under one reading of the paper.
pub struct GridRow<'a> {
    /// The row's label
    pub row: &'a str,
    /// The reading
    pub reading: &'a str,
    /// A cell a column, None where there is none
    pub cells: Vec<Option<&'a Judged>>,
}

/// The paper's own layout of a table, as written and under every reading that there is of most of its cells;
/// None for what is no such table.
pub fn grid<'a>(name: &str, cells: &[&'a Judged]) -> Option<Grid<'a>> {
    let labels = |of: fn(&Judged) -> &str| {
        let mut labels: Vec<&'a str> = Vec::new();
        for label in cells.iter().map(|c| of(c)) {
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
        labels
    };
    let (rows, columns) = (labels(|c| &c.row), labels(|c| &c.column));
    let numbers = cells
        .iter()
        .filter(|c| c.is_as_written() && c.reproduced.is_some())
        .count();
    let whole = rows.len() * columns.len();
    if !name.starts_with("Table") || rows.len() < 2 || columns.len() < 2 || 2 * numbers <= whole {
        return None;
    }
    let mut lines = Vec::new();
    for row in rows {
        for reading in labels(|c| c.reading.name()) {
            let of = |c: &&&'a Judged| c.reading.name() == reading;
            if 2 * cells.iter().filter(of).count() <= whole {
                continue;
            }
            let at = |column: &&str| {
                let mut found = cells.iter().filter(of);
                found
                    .find(|c| &*c.row == row && &*c.column == *column)
                    .copied()
            };
            lines.push(GridRow {
                row,
                reading,
                cells: columns.iter().map(at).collect(),
            });
        }
    }
    Some(Grid {
        columns,
        rows: lines,
    })
}

/// The unit of a printed number; empty for a bare number.
pub fn unit<'a>(held: &'a Held, c: &Judged) -> &'a str {
    let found = held
        .published
        .iter()
        .find(|p| p.table == c.table && p.row == c.row && p.column == c.column);
    found.map_or("", |p| if &*p.unit == "1" { "" } else { &p.unit })
}

/// Where a cell is reproduced, as `cells.csv` says.
pub fn mapped<'a>(held: &'a Held, c: &Judged) -> Option<&'a Cell> {
    let cells = &held.paper.as_ref()?.cells;
    cells.iter().find(|m| {
        *m.table == *c.table && *m.row == *c.row && *m.column == *c.column && m.reading == c.reading
    })
}
