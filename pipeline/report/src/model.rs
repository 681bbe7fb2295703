//! What the pages say, before it is written as Markdown or as HTML: the findings of a paper, a table in the
//! paper's own layout, who is missing, how many cells have which verdict.

use crate::about;
use crate::source::Held;
use std::collections::BTreeSet;
use zonobench_lake::rows::Comparison;
use zonobench_query::tables::is_finding;
use zonobench_verdicts::published::Cell;
use zonobench_verdicts::verdict::{self, is_as_written};

/// A printed number or claim that does not come out as written.
pub struct Finding<'a> {
    /// The cell
    pub cell: &'a Comparison,
    /// What must be measured for a claim to hold, and the words that say so
    pub asked: Option<(&'a str, &'a str)>,
}

/// The findings of one table.
pub struct TableFindings<'a> {
    /// The table's title
    pub title: &'a str,
    /// What differs or does not hold
    pub decided: Vec<Finding<'a>>,
    /// What could not be decided, by its reason: cells that share one are one finding
    pub undecided: Vec<(&'a str, Vec<&'a Comparison>)>,
}

/// What differs, does not hold, or could not be decided, table by table.
pub fn findings(paper: &Held) -> Vec<TableFindings<'_>> {
    let found = |title: &str| -> Vec<&Comparison> {
        let cells = paper.comparisons.iter();
        cells
            .filter(|c| is_as_written(c) && is_finding(&c.verdict) && *c.table == *title)
            .collect()
    };
    let of_table = |title| {
        let (undecided, decided): (Vec<&Comparison>, Vec<&Comparison>) = found(title)
            .into_iter()
            .partition(|c| &*c.verdict == "not_reproducible");
        let mut by_reason: Vec<(&str, Vec<&Comparison>)> = Vec::new();
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
            asked: asked_for(paper, cell),
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

fn asked_for<'a>(paper: &'a Held, c: &Comparison) -> Option<(&'a str, &'a str)> {
    let published = &paper.paper.as_ref()?.published;
    let cell = published
        .iter()
        .find(|p| *p.table == *c.table && *p.row == *c.row && *p.column == *c.column)?;
    (cell.kind == "claim" && !cell.tolerance.is_empty()).then_some((&cell.tolerance, &cell.reason))
}

/// Claims that come out as written and turn under another reading: the cells of that reading.
pub fn turned(paper: &Held) -> Vec<&Comparison> {
    let same = |a: &Comparison, b: &Comparison| {
        a.table == b.table && a.row == b.row && a.column == b.column
    };
    paper
        .comparisons
        .iter()
        .filter(|c| !is_as_written(c) && matches!(&*c.verdict, "differs" | "does_not_hold"))
        .filter(|c| {
            let mut written = paper
                .comparisons
                .iter()
                .filter(|w| is_as_written(w) && same(w, c));
            written.any(|w| verdict::is_reproduced(&w.verdict))
        })
        .collect()
}

/// How many cells came out how, as written: (cells, what they do, the verdict that it is coloured by); what no
/// cell does is left out.
pub fn tallies(papers: &[&Held]) -> Vec<(usize, &'static str, &'static str)> {
    let count = |of: &dyn Fn(&str) -> bool| {
        let all = papers.iter().flat_map(|p| &p.comparisons);
        all.filter(|c| is_as_written(c) && of(&c.verdict)).count()
    };
    [
        (count(&verdict::is_reproduced), "are reproduced", "exact"),
        (count(&|v| v == "differs"), "differ", "differs"),
        (
            count(&|v| v == "does_not_hold"),
            "are claims that do not hold",
            "does_not_hold",
        ),
        (
            count(&|v| v == "not_reproducible"),
            "could not be decided",
            "not_reproducible",
        ),
        (
            count(&|v| v == "lost_in_source"),
            "are lost in the text that we have",
            "lost_in_source",
        ),
        (
            count(&|v| v == "error"),
            "are in error, by a fault of ours",
            "error",
        ),
    ]
    .into_iter()
    .filter(|(n, _, _)| *n > 0)
    .collect()
}

/// Papers of the bibliography that `papers` does not have, as their folders: those with experiments in this
/// version, and those without.
pub fn absent(papers: &[&Held]) -> [Vec<&'static str>; 2] {
    let known = zonobench_verdicts::papers::names();
    [true, false].map(|of_ours| {
        let folders = about::folders().into_iter();
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

/// The rows of a table all of whose cells are exact, as written: parameters, which need no attention.
pub fn exact_rows(cells: &[&Comparison]) -> BTreeSet<String> {
    let mut rows: BTreeSet<String> = cells.iter().map(|c| c.row.to_string()).collect();
    for c in cells {
        if &*c.verdict != "exact" || !is_as_written(c) {
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
    pub cells: Vec<Option<&'a Comparison>>,
}

/// The paper's own layout of a table, as written and under every reading that there is of most of its cells;
/// None for what is no such table.
pub fn grid<'a>(name: &str, cells: &[&'a Comparison]) -> Option<Grid<'a>> {
    let labels = |of: fn(&Comparison) -> &str| {
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
        .filter(|c| is_as_written(c) && c.reproduced.is_some())
        .count();
    let whole = rows.len() * columns.len();
    if !name.starts_with("Table") || rows.len() < 2 || columns.len() < 2 || 2 * numbers <= whole {
        return None;
    }
    let mut lines = Vec::new();
    for row in rows {
        for reading in labels(|c| &c.reading) {
            let of = |c: &&&'a Comparison| &*c.reading == reading;
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
pub fn unit<'a>(held: &'a Held, c: &Comparison) -> &'a str {
    let found = held
        .published
        .iter()
        .find(|p| p.table == c.table && p.row == c.row && p.column == c.column);
    found.map_or("", |p| if &*p.unit == "1" { "" } else { &p.unit })
}

/// Where a cell is reproduced, as `cells.csv` says.
pub fn mapped<'a>(held: &'a Held, c: &Comparison) -> Option<&'a Cell> {
    let cells = &held.paper.as_ref()?.cells;
    cells.iter().find(|m| {
        *m.table == *c.table
            && *m.row == *c.row
            && *m.column == *c.column
            && *m.reading == *c.reading
    })
}
