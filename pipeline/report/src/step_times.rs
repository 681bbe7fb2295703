//! How long steps took: the committed `step-times.csv` as a histogram and two tables.
//!
//! Written by `just record-timings` on a named processor; a page shows what is recorded and measures nothing.

use crate::document::{Cell, Kind, Shape, Table};
use crate::svg::{Axis, Colour, Figure, Panel, Series};
use serde::Deserialize;
use std::path::Path;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::kept::read_kept;

/// The file beside the pages.
pub const FILE: &str = "step-times.csv";

/// The picture beside a paper's page.
pub const PICTURE: &str = "step-times.svg";

/// Where a bin ends, by where it begins: twenty bins a decade.
fn end_of(from: f64) -> f64 {
    from * libm::pow(10.0, 0.05)
}

/// A recorded number of one estimator.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Recorded {
    /// Folder of the paper
    pub paper: String,
    /// Name of the estimator
    pub estimator: String,
    /// `period` (µs), `steps`, `quantile`, `bin` or `share`
    pub kind: String,
    /// The quantile, where the bin begins (µs), or the operation
    pub key: String,
    /// µs, a number of steps, or a part of the time of a step
    pub value: f64,
    /// The processor's model
    pub processor: String,
}

/// The rows of `path`, none if there is no such file.
pub fn read(path: &Path) -> Result<Vec<Recorded>, Error> {
    read_kept(path)
}

/// What is recorded of one paper.
pub struct StepTimes<'a> {
    rows: Vec<&'a Recorded>,
    /// The names of the estimators, in the file's order.
    estimators: Vec<&'a str>,
}

impl<'a> StepTimes<'a> {
    /// What `all` holds of `paper`; None where that is nothing.
    pub fn of(all: &'a [Recorded], paper: &str) -> Option<Self> {
        let rows: Vec<&Recorded> = all.iter().filter(|r| r.paper == paper).collect();
        let mut estimators: Vec<&str> = Vec::new();
        for r in &rows {
            if !estimators.contains(&r.estimator.as_str()) {
                estimators.push(&r.estimator);
            }
        }
        (!rows.is_empty()).then_some(Self { rows, estimators })
    }

    /// (key, value) of one estimator.
    fn pairs(&self, estimator: &str, kind: &str) -> impl Iterator<Item = (&str, f64)> {
        let own = self
            .rows
            .iter()
            .filter(move |r| r.estimator == estimator && r.kind == kind);
        own.map(|r| (r.key.as_str(), r.value))
    }

    /// Where it was recorded.
    pub fn processor(&self) -> &str {
        self.rows.first().map_or("", |r| &r.processor)
    }

    /// The sampling period in µs.
    fn period(&self) -> Option<f64> {
        let first = self.rows.iter().find(|r| r.kind == "period");
        first.map(|r| r.value)
    }

    /// What stands above the picture.
    pub fn words(&self) -> String {
        let period = self.period().map_or_else(String::new, |p| {
            format!(
                "; the dashed line is the sampling period, {} µs",
                four_digits(p)
            )
        });
        format!(
            "Times of single steps as `just record-timings` recorded them on {}, how many steps took how \
             long{period}. A time depends on the machine: it is compared with nothing.",
            self.processor()
        )
    }

    /// How many steps took how long, both axes logarithmic, and the sampling period.
    pub fn picture(&self) -> String {
        // Half a step stands for none.
        const NONE: f64 = 0.5;
        let mut most: f64 = 1.0;
        let mut series = Vec::new();
        for (i, estimator) in self.estimators.iter().enumerate() {
            let mut points: Vec<[f64; 2]> = Vec::new();
            for (from, count) in self.pairs(estimator, "bin") {
                let Ok(from) = from.parse::<f64>() else {
                    continue;
                };
                match points.last() {
                    // The bin before ends here, to the digits that are recorded.
                    Some([end, _]) if (end / from - 1.0).abs() < 1e-2 => {
                        points.pop();
                        points.pop();
                        let before = points.last().map_or(NONE, |p| p[1]);
                        points.extend([[from, before], [from, count]]);
                    }
                    _ => points.extend([[from, NONE], [from, count]]),
                }
                points.extend([[end_of(from), count], [end_of(from), NONE]]);
                most = most.max(count);
            }
            if !points.is_empty() {
                series.push(Series::Line {
                    label: (*estimator).to_owned(),
                    colour: Colour::nth(i),
                    points,
                });
            }
        }
        if let Some(period) = self.period() {
            series.push(Series::Dashes {
                label: "sampling period".to_owned(),
                colour: Colour::Black,
                points: vec![[period, NONE], [period, most]],
            });
        }
        let axis = |label: &str, unit: &str| Axis {
            log: true,
            ..Axis::new(label, unit)
        };
        Figure {
            title: "How long a step takes".to_owned(),
            columns: 1,
            panels: vec![Panel {
                x: axis("time of a step", "µs"),
                y: Axis {
                    min: Some(NONE),
                    ..axis("steps, 20 bins a decade", "")
                },
                series,
                ..Panel::default()
            }],
            ..Figure::default()
        }
        .to_svg()
    }

    /// The quantiles of every estimator beside the sampling period, and where the time of a step goes.
    pub fn tables(&self) -> Vec<Table> {
        let mut tables = vec![self.quantiles(), self.shares()];
        tables.retain(|table| table.bodies.iter().any(|rows| !rows.is_empty()));
        tables
    }

    fn quantiles(&self) -> Table {
        let row = |estimator: &&str| {
            let at = |wanted: f64| {
                let found = self
                    .pairs(estimator, "quantile")
                    .find(|(key, _)| key.parse() == Ok(wanted));
                found.map(|(_, value)| value)
            };
            let steps = self.pairs(estimator, "steps").next();
            let mut cells: Vec<Cell> = vec![
                (*estimator).into(),
                steps.map(|(_, n)| n.to_string()).into(),
            ];
            let quantiles = [0.5, 0.99, 0.999, 1.0].map(at);
            cells.extend(quantiles.map(|q| q.map(four_digits).into()));
            let share = (quantiles[2].zip(self.period()))
                .map(|(q, period)| format!("{} %", four_digits(100.0 * q / period)));
            cells.push(share.into());
            cells
        };
        let columns = [
            ("estimator (generators constraints)", Shape::Words),
            ("steps", Shape::Number),
            ("median, µs", Shape::Number),
            ("99 %, µs", Shape::Number),
            ("99.9 %, µs", Shape::Number),
            ("longest, µs", Shape::Number),
            ("99.9 % of the period", Shape::Number),
        ];
        let rows = self.estimators.iter().map(row).collect();
        Table::new(Kind::Plain, "Quantiles of the times", &columns, rows)
    }

    fn shares(&self) -> Table {
        let of = |estimator: &'a str| {
            let shares = self.pairs(estimator, "share");
            shares.map(move |(operation, share)| {
                let percent = format!("{} %", four_digits(100.0 * share));
                vec![estimator.into(), operation.into(), percent.into()]
            })
        };
        let columns = [
            ("estimator (generators constraints)", Shape::Words),
            ("operation", Shape::Words),
            ("of a step", Shape::Number),
        ];
        let rows = self.estimators.iter().flat_map(|&e| of(e)).collect();
        Table::new(Kind::Plain, "Where the time of a step goes", &columns, rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "paper,estimator,kind,key,value,processor\n\
        p,a,period,,10000,CPU\np,a,steps,,4,CPU\np,a,quantile,0.5,101,CPU\np,a,quantile,0.999,250,CPU\n\
        p,a,bin,100.0000,3,CPU\np,a,bin,112.2018,1,CPU\np,a,share,LP,0.75,CPU\n";

    #[test]
    fn what_is_recorded_is_drawn_and_listed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        assert_eq!(read(&path).unwrap(), []);
        std::fs::write(&path, TEXT).unwrap();
        let all = read(&path).unwrap();
        assert!(StepTimes::of(&all, "q").is_none());
        let times = StepTimes::of(&all, "p").unwrap();
        assert!(times.words().contains("on CPU") && times.words().contains("10000 µs"));
        let cells = |table: Table| -> Vec<Vec<Cell>> {
            let rows = table.bodies.into_iter().flatten();
            rows.map(|row| row.cells).collect()
        };
        let quantiles = cells(times.quantiles());
        assert_eq!(quantiles.len(), 1);
        assert_eq!(quantiles[0][1..4], ["4".into(), "101".into(), "".into()]);
        assert_eq!(quantiles[0][6], "2.5 %".into());
        let shares = cells(times.shares());
        assert_eq!(shares, [["a".into(), "LP".into(), "75 %".into()]]);
        assert!(times.picture().contains("sampling period"));
        std::fs::write(&path, TEXT.replace("0.75", "most")).unwrap();
        assert!(read(&path).is_err());
    }
}
