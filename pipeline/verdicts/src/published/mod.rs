//! What the papers print and what it is compared with: `published.csv` and `cells.csv`.
//!
//! The grammar stands in `experiments/README.md`. It is parsed when the files are read, so that a mistake is
//! told with its file and line. A printed number is kept as text; its value and the size of its last printed
//! digit are read from that text.

mod asked;
mod cell;
mod finding;
mod printed;

pub use asked::{Asked, Comparison, Quantifier};
pub use cell::{Cell, Columns, Comparand, Pair, Phase, Reading, Score, Time};
pub use finding::{Finding, Piece, Place, Prefix};
pub use printed::{half_unit, value};

use crate::verdict::one_of;
use serde::Deserialize;
use std::collections::BTreeSet;
use zonobench_lake::error::Error;

/// What kind of thing is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number without an error.
    Exact,
    /// Right to half a unit of its last digit.
    Rounded,
    /// A mean over random runs.
    MonteCarlo,
    /// A time, or a statement about times.
    Timing,
    /// A statement that is true or false.
    Claim,
    /// Not in the text that we have.
    Lost,
    /// Read from a figure.
    Figure,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Exact,
        Self::Rounded,
        Self::MonteCarlo,
        Self::Timing,
        Self::Claim,
        Self::Lost,
        Self::Figure,
    ];

    /// As in `published.csv`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Rounded => "rounded",
            Self::MonteCarlo => "monte_carlo",
            Self::Timing => "timing",
            Self::Claim => "claim",
            Self::Lost => "lost",
            Self::Figure => "figure",
        }
    }

    /// The kind of that name. Fails with what there is.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|k| k.name() == name);
        found.ok_or_else(|| one_of(name, &Self::ALL.map(Self::name)))
    }
}

/// What the column `tolerance` says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// Nothing.
    None,
    /// Of a number: the difference that is let pass.
    Within(f64),
    /// Of a claim, or of a statement about times: what must be true.
    Asked(Asked),
}

/// A row of `published.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Table, figure or section.
    pub table: String,
    /// Row label.
    pub row: String,
    /// Column label.
    pub column: String,
    /// The text as printed.
    pub printed: String,
    /// UCUM unit code.
    pub unit: String,
    /// What kind of thing.
    pub kind: Kind,
    /// Runs that the number is a mean of.
    pub runs: Option<usize>,
    /// A tolerance, or a claim's comparison.
    pub tolerance: Tolerance,
    /// Why this tolerance, what the paper says, what is damaged.
    pub reason: String,
}

impl Published {
    /// The printed number, for kinds that have one.
    pub fn value(&self) -> Option<f64> {
        match self.kind {
            Kind::Claim | Kind::Lost => None,
            _ => value(&self.printed),
        }
    }

    /// What a claim asks for.
    pub fn asked(&self) -> Option<Asked> {
        match self.tolerance {
            Tolerance::Asked(asked) => Some(asked),
            _ => None,
        }
    }

    /// True for the cell that `cell` maps.
    pub fn is(&self, cell: &Cell) -> bool {
        self.table == cell.table && self.row == cell.row && self.column == cell.column
    }
}

/// `published.csv` as it stands in the file.
#[derive(Deserialize)]
struct PublishedRow {
    table: String,
    row: String,
    column: String,
    printed: String,
    unit: String,
    kind: String,
    runs: Option<usize>,
    tolerance: String,
    reason: String,
}

/// `cells.csv` as it stands in the file.
#[derive(Deserialize)]
struct CellRow {
    table: String,
    row: String,
    column: String,
    reading: String,
    experiment: String,
    estimator: String,
    metric: String,
    component: String,
    over: String,
    finding: String,
}

/// The rows of a CSV file with their lines.
fn read<T: for<'a> Deserialize<'a>>(file: &str, text: &str) -> Result<Vec<(u64, T)>, Error> {
    let syntax = |source| Error::CsvSyntax {
        file: file.to_owned(),
        source,
    };
    let mut reader = csv::ReaderBuilder::new().from_reader(text.as_bytes());
    let header = reader.headers().map_err(syntax)?.clone();
    let rows = reader.into_records().map(|record| {
        let record = record.map_err(syntax)?;
        let line = record.position().map_or(0, csv::Position::line);
        Ok((line, record.deserialize(Some(&header)).map_err(syntax)?))
    });
    rows.collect()
}

/// A fault of one line.
fn wrong(file: &str, line: u64, expected: impl Into<String>, got: impl Into<String>) -> Error {
    Error::Csv {
        file: file.to_owned(),
        line,
        expected: expected.into(),
        got: got.into(),
    }
}

/// Reads `published.csv`: kinds, numbers, tolerances and comparisons; no cell twice.
pub fn read_published(file: &str, text: &str) -> Result<Vec<Published>, Error> {
    let mut seen = BTreeSet::new();
    let mut rows = Vec::new();
    for (line, row) in read::<PublishedRow>(file, text)? {
        let wrong = |expected: String, got: &str| wrong(file, line, expected, got);
        let kind = Kind::parse(&row.kind)
            .map_err(|expected| wrong(format!("a kind, {expected}"), &row.kind))?;
        if !seen.insert([row.table.clone(), row.row.clone(), row.column.clone()]) {
            let got = format!("{}, {}, {} again", row.table, row.row, row.column);
            return Err(wrong("every cell once".to_owned(), &got));
        }
        let tolerance = tolerance_of(kind, &row.tolerance)
            .ok_or_else(|| wrong(expected_tolerance(kind).to_owned(), &row.tolerance))?;
        let row = Published {
            table: row.table,
            row: row.row,
            column: row.column,
            printed: row.printed,
            unit: row.unit,
            kind,
            runs: row.runs,
            tolerance,
            reason: row.reason,
        };
        let has_number = !matches!(kind, Kind::Claim | Kind::Lost | Kind::Timing);
        if has_number && row.value().is_none() {
            return Err(wrong("a printed number".to_owned(), &row.printed));
        }
        if kind == Kind::Timing && row.value().is_none() && row.asked().is_none() {
            let expected = format!(
                "a printed time, or in the column tolerance {}",
                Asked::EXPECTED
            );
            return Err(wrong(expected, &row.printed));
        }
        rows.push(row);
    }
    Ok(rows)
}

fn tolerance_of(kind: Kind, text: &str) -> Option<Tolerance> {
    if text.is_empty() {
        return Some(Tolerance::None);
    }
    match kind {
        Kind::Claim => Asked::parse(text).map(Tolerance::Asked),
        // A time is a mean: there are no runs to speak of.
        Kind::Timing => Asked::parse(text)
            .filter(|asked| asked.quantifier == Quantifier::Mean)
            .map(Tolerance::Asked),
        _ => {
            let within = text.parse::<f64>().ok()?;
            (within >= 0.0).then_some(Tolerance::Within(within))
        }
    }
}

fn expected_tolerance(kind: Kind) -> &'static str {
    match kind {
        Kind::Claim => Asked::EXPECTED,
        Kind::Timing => "a comparison such as <1 or <=0.01",
        _ => "an absolute difference",
    }
}

/// What a paper has that its cells can name.
pub struct Known<'a> {
    /// What it prints.
    pub published: &'a [Published],
    /// Whether an experiment has an estimator; fails with what there is.
    pub estimator: &'a dyn Fn(&str, &str) -> Result<(), String>,
    /// Whether the file of an experiment holds a number at a path; fails with what there is.
    pub parameter: &'a dyn Fn(&str, &str) -> Result<(), String>,
    /// Whether the ledger has a claim that a cell may name; fails with what there is.
    pub claim: &'a dyn Fn(&str) -> Result<(), String>,
}

/// Reads `cells.csv`, checking that every cell is a published one and that what it names is there.
pub fn read_cells(file: &str, text: &str, known: &Known<'_>) -> Result<Vec<Cell>, Error> {
    let mut cells: Vec<Cell> = Vec::new();
    let mut seen = BTreeSet::new();
    for (line, row) in read::<CellRow>(file, text)? {
        let fault = |(expected, got): (String, String)| wrong(file, line, expected, got);
        let place = format!("{}, {}, {}", row.table, row.row, row.column);
        if row.reading.is_empty() {
            return Err(fault(("a reading".to_owned(), "\"\"".to_owned())));
        }
        if !seen.insert((place.clone(), row.reading.clone())) {
            let expected = "every reading of a cell once".to_owned();
            return Err(fault((expected, format!("{place}, {} again", row.reading))));
        }
        let comparand = Comparand::parse(Columns {
            experiment: &row.experiment,
            estimator: &row.estimator,
            metric: &row.metric,
            component: &row.component,
            over: &row.over,
        });
        let cell = Cell {
            comparand: comparand.map_err(fault)?,
            finding: Finding::parse(&row.finding).map_err(fault)?,
            reading: Reading::of(&row.reading),
            table: row.table,
            row: row.row,
            column: row.column,
        };
        let Some(p) = known.published.iter().find(|p| p.is(&cell)) else {
            return Err(fault(("a cell of published.csv".to_owned(), place)));
        };
        fits(p, &cell.comparand).map_err(fault)?;
        named(&cell, known).map_err(fault)?;
        cells.push(cell);
    }
    Ok(cells)
}

/// Whether a printed thing of its kind can be compared with `comparand`.
fn fits(p: &Published, comparand: &Comparand) -> Result<(), (String, String)> {
    let is = match comparand {
        Comparand::Timing { .. } => matches!(p.kind, Kind::Timing | Kind::Lost),
        Comparand::Complexity(_) | Comparand::Claims(_) => p.kind == Kind::Claim,
        Comparand::Parameter { .. } => !matches!(p.kind, Kind::Timing | Kind::Claim | Kind::Lost),
        _ => p.kind != Kind::Timing,
    };
    let expected = match comparand {
        _ if !is => match p.kind {
            Kind::Timing => "for a time the metric timing",
            Kind::Claim => "for a claim a score, or the metric complexity or claims",
            Kind::Lost => "for what is lost a score, or the metric timing",
            _ => "for a number a score, or the metric parameter",
        },
        _ if p.kind == Kind::Claim && comparand.is_score() && p.asked().is_none() => {
            "for a claim compared with a score a comparison in published.csv"
        }
        Comparand::Complexity(_) | Comparand::Claims(_) if p.asked().is_some() => {
            "for a claim of the ledger no comparison in published.csv"
        }
        Comparand::Timing { over: None, .. }
            if p.kind == Kind::Timing && p.value().is_none() && p.asked().is_none() =>
        {
            "a printed time, or a comparison in published.csv"
        }
        _ => return Ok(()),
    };
    let got = format!("{} of kind {}", comparand.name(), p.kind.name());
    Err((expected.to_owned(), got))
}

/// Whether what a cell names is there.
fn named(cell: &Cell, known: &Known<'_>) -> Result<(), (String, String)> {
    let estimators = |experiments: &[String], estimator: &str| {
        experiments.iter().try_for_each(|experiment| {
            (known.estimator)(experiment, estimator)
                .map_err(|expected| (expected, format!("{experiment}, {estimator}")))
        })
    };
    match &cell.comparand {
        Comparand::Metric(score) => {
            estimators(&score.experiments, &score.estimator)?;
            match score.over.as_str() {
                "" => Ok(()),
                over => estimators(&score.experiments, over),
            }
        }
        Comparand::Ratio(pair)
        | Comparand::Percent(pair)
        | Comparand::Drop(pair)
        | Comparand::Wins(pair) => {
            estimators(&pair.of.experiments, &pair.of.estimator)?;
            estimators(&pair.of.experiments, &pair.over)
        }
        Comparand::Gain(pair, than) => {
            [&pair.of.experiments, than].into_iter().try_for_each(|of| {
                estimators(of, &pair.of.estimator)?;
                estimators(of, &pair.over)
            })
        }
        Comparand::Parameter { experiment, path } => (known.parameter)(experiment, path)
            .map_err(|expected| (expected, format!("{experiment}, {path}"))),
        Comparand::Timing { of, over } => {
            estimators(&of.experiments, &of.estimator)?;
            over.iter()
                .try_for_each(|over| estimators(&over.experiments, &over.estimator))
        }
        Comparand::Claims(claim) => {
            (known.claim)(claim).map_err(|expected| (expected, claim.clone()))
        }
        // The counts know their claims; one that is not counted is an error of the comparison.
        Comparand::Complexity(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "table,row,column,printed,unit,kind,runs,tolerance,reason\n";

    fn published(rows: &str) -> Result<Vec<Published>, String> {
        read_published("p.csv", &format!("{HEADER}{rows}")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_wrong_row_is_named_by_its_line_with_the_nearest_word() {
        // A reason of two lines comes first.
        let error =
            published("T,a,c,1.0,1,exact,,,\"two\nlines\"\nT,r,c,1.0,1,exakt,,,\n").unwrap_err();
        assert!(
            error.contains("p.csv, line 4") && error.contains("did you mean exact?"),
            "{error}"
        );
    }

    #[test]
    fn tolerances_are_read_as_their_kind_asks() {
        let row = |kind: &str, printed: &str, tolerance: &str| {
            published(&format!("T,r,c,{printed},1,{kind},,{tolerance},\n"))
                .map(|rows| rows[0].tolerance)
        };
        assert_eq!(row("exact", "1", "0.5"), Ok(Tolerance::Within(0.5)));
        assert!(row("exact", "1", "-0.5").is_err() && row("exact", "1", "<1").is_err());
        assert!(row("exact", "one", "").is_err());
        assert!(matches!(
            row("claim", "always", "every ==1"),
            Ok(Tolerance::Asked(_))
        ));
        assert!(
            row("claim", "always", "each ==1")
                .unwrap_err()
                .contains("`every`")
        );
        assert!(matches!(
            row("timing", "less demanding", "<1"),
            Ok(Tolerance::Asked(_))
        ));
        // A statement about times says what is asked for, and a time has no runs.
        assert!(row("timing", "less demanding", "").is_err());
        assert!(row("timing", "less demanding", "some <1").is_err());
        assert!(published("T,r,c,1,1,exact,,,\nT,r,c,2,1,exact,,,\n").is_err());
    }

    fn cells(rows: &str) -> Result<Vec<Cell>, String> {
        let published = published(
            "T,number,c,1.0,1,exact,,,\nT,claim,c,always,1,claim,,==1,\nT,theorem,c,holds,1,claim,,,\nT,time,c,1.0,ms,timing,,,\n",
        )
        .unwrap();
        let known = Known {
            published: &published,
            estimator: &|_, estimator| match estimator {
                "f" | "g" => Ok(()),
                other => Err(one_of(other, &["f", "g"])),
            },
            parameter: &|_, _| Ok(()),
            claim: &|claim| match claim {
                "lemma-1" => Ok(()),
                other => Err(one_of(other, &["lemma-1"])),
            },
        };
        let header =
            "table,row,column,reading,experiment,estimator,metric,component,over,finding\n";
        read_cells("c.csv", &format!("{header}{rows}"), &known).map_err(|e| e.to_string())
    }

    #[test]
    fn a_cell_is_compared_with_what_its_kind_can_be() {
        for fits in [
            "T,number,c,as-written,a,f,rmse,,,",
            "T,number,c,as-written,a,,parameter,steps,,",
            "T,claim,c,as-written,a,f,ratio(rmse),,g,",
            "T,theorem,c,as-written,,,claims,lemma-1,,",
            "T,time,c,as-written,a,f,timing,reduce,,",
        ] {
            assert!(cells(fits).is_ok(), "{fits}: {:?}", cells(fits));
        }
        for (row, told) in [
            (
                "T,nobody,c,as-written,a,f,rmse,,,",
                "a cell of published.csv",
            ),
            ("T,number,c,as-written,,,claims,lemma-1,,", "for a number"),
            ("T,number,c,as-written,a,f,timing,,,", "for a number"),
            ("T,time,c,as-written,a,f,rmse,,,", "the metric timing"),
            (
                "T,theorem,c,as-written,a,f,rmse,,,",
                "a comparison in published.csv",
            ),
            ("T,claim,c,as-written,,,claims,lemma-1,,", "no comparison"),
            ("T,claim,c,as-written,a,,parameter,steps,,", "for a claim"),
            (
                "T,theorem,c,as-written,,,claims,lema-1,,",
                "did you mean lemma-1?",
            ),
            ("T,number,c,as-written,a,ff,rmse,,,", "did you mean f?"),
            ("T,number,c,,a,f,rmse,,,", "a reading"),
        ] {
            let error = cells(row).unwrap_err();
            assert!(
                error.contains(told) && error.contains("c.csv, line 2"),
                "{error}"
            );
        }
        let twice = "T,number,c,as-written,a,f,rmse,,,\n".repeat(2);
        assert!(cells(&twice).unwrap_err().contains("line 3"));
    }
}
