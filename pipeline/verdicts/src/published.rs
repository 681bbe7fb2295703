//! What the papers print: `published.csv` and `cells.csv`.
//!
//! The grammar stands in `experiments/README.md`. A printed number is kept as text; its value and the size
//! of its last printed digit are read from that text.

use serde::{Deserialize, Serialize};
use zonobench_lake::error::Error;

/// Kinds of printed numbers.
pub const KINDS: &[&str] = &[
    "exact",
    "rounded",
    "monte_carlo",
    "timing",
    "claim",
    "lost",
    "figure",
];

/// A row of `published.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// One of [`KINDS`].
    pub kind: String,
    /// Runs that the number is a mean of.
    pub runs: Option<usize>,
    /// An absolute difference, or a claim's comparison.
    pub tolerance: String,
    /// Why this tolerance, what the paper says, what is damaged.
    pub reason: String,
}

/// A row of `cells.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Table, figure or section.
    pub table: String,
    /// Row label.
    pub row: String,
    /// Column label.
    pub column: String,
    /// `as-written` or another reading's name.
    pub reading: String,
    /// Experiment id.
    pub experiment: String,
    /// Estimator id.
    pub estimator: String,
    /// Metric, or a derived one.
    pub metric: String,
    /// Component, or the path of a parameter.
    pub component: String,
    /// The estimator compared with, for derived metrics.
    pub over: String,
    /// The reason's text, with places for numbers.
    pub finding: String,
}

/// What must be true of a claim's score.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Comparison {
    /// `>= x`
    AtLeast(f64),
    /// `<= x`
    AtMost(f64),
    /// `> x`
    Above(f64),
    /// `< x`
    Below(f64),
    /// `== x`
    Equal(f64),
    /// `a..b`, both ends included
    Between(f64, f64),
}

/// The sign of a comparison with one number, and what makes it.
type Sign = (&'static str, fn(f64) -> Comparison);

impl Comparison {
    /// Parses `>=`, `<=`, `>`, `<`, `==` with a number, or `a..b`.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let simple: [Sign; 5] = [
            (">=", Self::AtLeast),
            ("<=", Self::AtMost),
            ("==", Self::Equal),
            (">", Self::Above),
            ("<", Self::Below),
        ];
        for (sign, make) in simple {
            if let Some(rest) = text.strip_prefix(sign) {
                return number(rest).map(make);
            }
        }
        let (a, b) = text.split_once("..")?;
        Some(Self::Between(number(a)?, number(b)?))
            .filter(|c| matches!(c, Self::Between(a, b) if a <= b))
    }

    /// Whether it is true of `x`.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Self::AtLeast(a) => x >= a,
            Self::AtMost(a) => x <= a,
            Self::Above(a) => x > a,
            Self::Below(a) => x < a,
            Self::Equal(a) => x == a,
            Self::Between(a, b) => a <= x && x <= b,
        }
    }
}

/// The value of a printed number: a number, a product, or a quotient of two products, where everything
/// right of the one slash is the divisor.
pub fn value(printed: &str) -> Option<f64> {
    let product = |t: &str| {
        t.split('*').try_fold(1.0, |p, factor| {
            Some(p * factor.trim().parse::<f64>().ok()?)
        })
    };
    let value = match printed.split_once('/') {
        None => product(printed)?,
        Some((over, under)) => product(over)? / product(under)?,
    };
    value.is_finite().then_some(value)
}

/// Half a unit of the last printed digit of a plain decimal number; 0 for anything else.
pub fn half_unit(printed: &str) -> f64 {
    let digits = printed.trim().trim_start_matches(['-', '+']);
    if digits.is_empty() || !digits.chars().all(|c| c.is_ascii_digit() || c == '.') {
        return 0.0;
    }
    let decimals = digits.split_once('.').map_or(0, |(_, d)| d.len());
    0.5 * (0..decimals).fold(1.0, |unit, _| unit / 10.0)
}

impl Published {
    /// The printed number, for kinds that have one.
    pub fn value(&self) -> Option<f64> {
        if matches!(self.kind.as_str(), "claim" | "lost") {
            None
        } else {
            value(&self.printed)
        }
    }

    /// True for the cell that `cell` maps.
    pub fn is(&self, cell: &Cell) -> bool {
        self.table == cell.table && self.row == cell.row && self.column == cell.column
    }
}

fn read<T: for<'a> Deserialize<'a>>(file: &str, text: &str) -> Result<Vec<T>, Error> {
    let mut reader = csv::ReaderBuilder::new().from_reader(text.as_bytes());
    reader
        .deserialize()
        .map(|row| {
            row.map_err(|source| Error::CsvSyntax {
                file: file.to_owned(),
                source,
            })
        })
        .collect()
}

/// Reads `published.csv`, checking kinds, numbers and comparisons.
pub fn read_published(file: &str, text: &str) -> Result<Vec<Published>, Error> {
    let rows: Vec<Published> = read(file, text)?;
    for (i, row) in rows.iter().enumerate() {
        let wrong = |expected: &str, got: &str| Error::Csv {
            file: file.to_owned(),
            line: i as u64 + 2,
            expected: expected.to_owned(),
            got: got.to_owned(),
        };
        match row.kind.as_str() {
            kind if !KINDS.contains(&kind) => return Err(wrong(&KINDS.join(", "), kind)),
            "claim" => {
                if !row.tolerance.is_empty() && Comparison::parse(&row.tolerance).is_none() {
                    return Err(wrong(
                        "a comparison such as >=0.95 or 0.4..0.6",
                        &row.tolerance,
                    ));
                }
            }
            "lost" => {}
            _ => {
                if row.value().is_none() && row.kind != "timing" {
                    return Err(wrong("a printed number", &row.printed));
                }
                let absolute = row.tolerance.parse::<f64>().is_ok_and(|t| t >= 0.0);
                if row.kind != "timing" && !row.tolerance.is_empty() && !absolute {
                    return Err(wrong("an absolute difference", &row.tolerance));
                }
            }
        }
    }
    Ok(rows)
}

/// Reads `cells.csv`, checking that every cell is a published one.
pub fn read_cells(file: &str, text: &str, published: &[Published]) -> Result<Vec<Cell>, Error> {
    let cells: Vec<Cell> = read(file, text)?;
    for (i, cell) in cells.iter().enumerate() {
        if !published.iter().any(|p| p.is(cell)) {
            return Err(Error::Csv {
                file: file.to_owned(),
                line: i as u64 + 2,
                expected: "a cell of published.csv".to_owned(),
                got: format!("{}, {}, {}", cell.table, cell.row, cell.column),
            });
        }
    }
    Ok(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_numbers_have_values_and_units() {
        assert_eq!(value(".0437"), Some(0.0437));
        assert_eq!(value("1/4*2"), Some(0.125));
        assert_eq!(value("0.5*0.02*-6"), Some(0.5 * 0.02 * -6.0));
        assert_eq!(value("always"), None);
        assert_eq!(value("inf"), None);
        assert_eq!(half_unit(".600"), 0.5e-3);
        assert_eq!(half_unit("-12"), 0.5);
        assert_eq!(half_unit("1/4"), 0.0);
    }

    #[test]
    fn comparisons_are_read_and_decided() {
        assert_eq!(
            Comparison::parse(">= 0.95"),
            Some(Comparison::AtLeast(0.95))
        );
        assert_eq!(
            Comparison::parse("0.4..0.6"),
            Some(Comparison::Between(0.4, 0.6))
        );
        assert_eq!(Comparison::parse("0.6..0.4"), None);
        assert_eq!(Comparison::parse("about 1"), None);
        assert!(
            Comparison::Equal(1.0).holds(1.0) && !Comparison::Equal(1.0).holds(1.0_f64.next_down())
        );
        assert!(!Comparison::Below(1.0).holds(1.0) && Comparison::Between(0.0, 1.0).holds(1.0));
    }

    #[test]
    fn a_wrong_row_is_named_by_its_line() {
        let text =
            "table,row,column,printed,unit,kind,runs,tolerance,reason\nT,r,c,1.0,1,exakt,,,\n";
        let error = read_published("p.csv", text).unwrap_err().to_string();
        assert!(
            error.contains("p.csv, line 2") && error.contains("exakt"),
            "{error}"
        );
    }
}
