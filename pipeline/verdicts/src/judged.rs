//! The comparisons of a lake, read for people: verdicts and readings as types, and what each cell counts as.

use crate::papers::Paper;
use crate::published::{Asked, Cell, Comparand, Kind, Published, Reading};
use crate::verdict::Verdict;
use std::collections::BTreeMap;
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::lake::paper_table_path;
use zonobench_lake::rows::Comparison;
use zonobench_lake::table::{self, Name};

/// What a cell counts as. The three are never summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// A number that was computed.
    Number,
    /// A number that was copied from the paper into an experiment's file.
    Parameter,
    /// A statement that is true or false.
    Claim,
}

/// A printed cell beside what was reproduced.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Table, figure or section.
    pub table: Name,
    /// Row label.
    pub row: Name,
    /// Column label.
    pub column: Name,
    /// Which reading of the paper.
    pub reading: Reading,
    /// The text as printed.
    pub published: Name,
    /// Our number.
    pub reproduced: Option<f64>,
    /// Where a repetition of the paper's experiment would print its number.
    pub interval: Option<(f64, f64)>,
    /// What came of it.
    pub verdict: Verdict,
    /// Why.
    pub reason: Name,
    /// What it counts as.
    pub subject: Subject,
    /// What a claim asks for, and the words that say so.
    pub asked: Option<(Asked, String)>,
}

impl Judged {
    /// Whether it is the paper as written, which alone is counted.
    pub fn is_as_written(&self) -> bool {
        self.reading.is_as_written()
    }

    /// Whether both are readings of one cell.
    pub fn is_same_cell(&self, other: &Self) -> bool {
        (&self.table, &self.row, &self.column) == (&other.table, &other.row, &other.column)
    }
}

/// All comparisons of `paper` in the lake, in the order of its published numbers.
///
/// Fails for a verdict that this program does not know: the lake is another version's.
pub fn read(lake: &Path, paper: &Paper) -> Result<Vec<Judged>, Error> {
    let path = lake.join(paper_table_path("comparison", &paper.name));
    let rows: Vec<Comparison> = table::read(&path)?;
    of(rows, paper, &path)
}

/// The comparisons of `paper`, read from the file `path`.
pub fn of(rows: Vec<Comparison>, paper: &Paper, path: &Path) -> Result<Vec<Judged>, Error> {
    type At<'a> = [&'a str; 3];
    let published: BTreeMap<At, &Published> = (paper.published.iter())
        .map(|p| ([p.table.as_str(), &p.row, &p.column], p))
        .collect();
    let cells: BTreeMap<(At, &str), &Cell> = (paper.cells.iter())
        .map(|c| (([c.table.as_str(), &c.row, &c.column], c.reading.name()), c))
        .collect();
    let judged = |row: Comparison| {
        let verdict = Verdict::parse(&row.verdict).map_err(|expected| Error::Refused {
            what: format!("{}: column verdict", path.display()),
            expected,
            got: row.verdict.to_string(),
        })?;
        let at: At = [&row.table, &row.row, &row.column];
        let p = published.get(&at);
        let cell = cells.get(&(at, &*row.reading));
        let subject = match (p.map(|p| p.kind), cell.map(|c| &c.comparand)) {
            (Some(Kind::Claim), _) => Subject::Claim,
            (_, Some(Comparand::Parameter { .. })) => Subject::Parameter,
            _ => Subject::Number,
        };
        Ok(Judged {
            subject,
            asked: p.and_then(|p| Some((p.asked()?, p.reason.clone()))),
            reading: Reading::of(&row.reading),
            interval: row.interval_lo.zip(row.interval_hi),
            verdict,
            table: row.table,
            row: row.row,
            column: row.column,
            published: row.published,
            reproduced: row.reproduced,
            reason: row.reason,
        })
    };
    rows.into_iter().map(judged).collect()
}

/// How many cells have which verdict, as written, in the order of the verdicts.
pub fn counts<'a>(cells: impl IntoIterator<Item = &'a Judged>) -> Vec<(Verdict, usize)> {
    let mut counts: BTreeMap<Verdict, usize> = BTreeMap::new();
    for c in cells.into_iter().filter(|c| c.is_as_written()) {
        *counts.entry(c.verdict).or_default() += 1;
    }
    counts.into_iter().collect()
}

/// [`counts`] of numbers, parameters and claims apart; a subject without cells is left out.
pub fn counts_by_subject<'a>(
    cells: impl Iterator<Item = &'a Judged> + Clone,
) -> Vec<(Subject, Vec<(Verdict, usize)>)> {
    let of = |subject| {
        (
            subject,
            counts(cells.clone().filter(|c| c.subject == subject)),
        )
    };
    let all = Subject::ALL.into_iter().map(of);
    all.filter(|(_, counts)| !counts.is_empty()).collect()
}

/// What the cells of some tables came to, as written, of one subject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tally {
    /// Numbers, parameters or claims.
    pub subject: Subject,
    /// How many there are.
    pub all: usize,
    /// How many came out so, and what they do; what none does is left out.
    pub parts: Vec<Part>,
}

/// Some of a [`Tally`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// How many.
    pub n: usize,
    /// What they do: "reproduced", "do not hold".
    pub what: &'static str,
    /// The verdict that they are coloured by.
    pub like: Verdict,
}

impl Subject {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Number, Self::Parameter, Self::Claim];

    /// Its name, for several of them.
    pub fn name(self) -> &'static str {
        match self {
            Self::Number => "numbers",
            Self::Parameter => "parameters",
            Self::Claim => "claims",
        }
    }

    /// What cells of a verdict do, in the words of a sentence "12 numbers: 9 reproduced".
    pub fn outcome(self, verdict: Verdict) -> &'static str {
        match (verdict, self) {
            (v, Self::Number) if v.is_success() => "reproduced",
            (v, Self::Parameter) if v.is_success() => "transcribed",
            (v, Self::Claim) if v.is_success() => "hold",
            (Verdict::Fitted, _) => "fitted",
            (Verdict::ByAccident, _) => "agree by accident",
            (Verdict::Undecided, _) => "undecided",
            (Verdict::Differs, _) => "differ",
            (Verdict::DoesNotHold, _) => "do not hold",
            (Verdict::Slip, _) => "slips of the pen",
            (Verdict::NotReproducible, _) => "not reproducible",
            (Verdict::LostInSource, _) => "lost or damaged in our text",
            (Verdict::Quick, _) => "of a smoke run",
            _ => "in error, by a fault of ours",
        }
    }
}

/// Numbers, parameters and claims, each counted by itself; a subject without cells is left out.
pub fn tallies<'a>(cells: impl Iterator<Item = &'a Judged> + Clone) -> Vec<Tally> {
    let of = |(subject, counted): (Subject, Vec<(Verdict, usize)>)| {
        let mut parts: Vec<Part> = Vec::new();
        for (verdict, n) in &counted {
            let what = subject.outcome(*verdict);
            match parts.iter_mut().find(|part| part.what == what) {
                Some(part) => part.n += n,
                None => parts.push(Part {
                    n: *n,
                    what,
                    like: *verdict,
                }),
            }
        }
        Tally {
            subject,
            all: counted.iter().map(|(_, n)| n).sum(),
            parts,
        }
    };
    counts_by_subject(cells).into_iter().map(of).collect()
}

impl Tally {
    /// `12 numbers: 9 reproduced, 3 differ`, the parts written by `part`.
    pub fn sentence(&self, part: impl Fn(&Part) -> String) -> String {
        let parts: Vec<String> = self.parts.iter().map(part).collect();
        format!("{} {}: {}", self.all, self.subject.name(), parts.join(", "))
    }
}

/// A column of a table of verdicts: what the cells count as, and their verdict.
pub type Column = (Subject, Verdict);

/// The columns that the cells need, numbers first, then parameters, then claims.
pub fn columns<'a>(cells: impl Iterator<Item = &'a Judged>) -> Vec<Column> {
    let of = cells.filter(|c| c.is_as_written());
    let columns: std::collections::BTreeSet<Column> = of.map(|c| (c.subject, c.verdict)).collect();
    columns.into_iter().collect()
}

/// How many cells are of a column, as written.
pub fn in_column<'a>(cells: impl Iterator<Item = &'a Judged>, column: Column) -> usize {
    cells
        .filter(|c| c.is_as_written() && (c.subject, c.verdict) == column)
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(subject: Subject, verdict: Verdict, reading: &str) -> Judged {
        Judged {
            table: "T".into(),
            row: "r".into(),
            column: "c".into(),
            reading: Reading::of(reading),
            published: "1".into(),
            reproduced: None,
            interval: None,
            verdict,
            reason: "".into(),
            subject,
            asked: None,
        }
    }

    #[test]
    fn numbers_parameters_and_claims_are_counted_apart() {
        use Subject::{Claim, Number, Parameter};
        let cells = [
            cell(Number, Verdict::Exact, "as-written"),
            cell(Number, Verdict::WithinCi, "as-written"),
            cell(Number, Verdict::Fitted, "as-written"),
            cell(Number, Verdict::ByAccident, "as-written"),
            cell(Number, Verdict::WithinCi, "another"),
            cell(Parameter, Verdict::Exact, "as-written"),
            cell(Claim, Verdict::Holds, "as-written"),
            cell(Claim, Verdict::Slip, "as-written"),
            cell(Claim, Verdict::Undecided, "as-written"),
        ];
        let told: Vec<String> = (tallies(cells.iter()).iter())
            .map(|t| t.sentence(|part| format!("{} {}", part.n, part.what)))
            .collect();
        assert_eq!(
            told,
            [
                "4 numbers: 2 reproduced, 1 fitted, 1 agree by accident",
                "1 parameters: 1 transcribed",
                "3 claims: 1 hold, 1 undecided, 1 slips of the pen",
            ]
        );
        let columns = columns(cells.iter());
        assert_eq!(columns[0], (Number, Verdict::Exact));
        assert_eq!(in_column(cells.iter(), (Number, Verdict::WithinCi)), 1);
        let all: usize = columns.iter().map(|c| in_column(cells.iter(), *c)).sum();
        assert_eq!(all, 8);
    }
}
