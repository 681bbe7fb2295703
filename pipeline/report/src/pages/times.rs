//! Who keeps up with the plant: the times of this lake, which depend on the machine that made it. No committed page has
//! them.

use crate::document::prose::prose;
use crate::document::{Block, Cell, Inline, Kind, Page, Shape, Table, badge, code, label, line};
use crate::source::{Held, Source};
use std::collections::BTreeMap;
use zonobench_lab::illustrate;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Timing;
use zonobench_verdicts::verdict::Tone;

/// How long steps of one estimator of one experiment took.
struct StepTime {
    /// Median over the runs of the median over the steps, in µs
    median: f64,
    /// 99.9 % of the steps of the run where that is longest take no longer, in µs
    p999: f64,
    /// The longest step of all runs, in µs
    longest: f64,
    /// Steps longer than the sampling period, over all runs
    late: i64,
    /// Steps timed
    steps: i64,
}

impl StepTime {
    /// Of the runs of one estimator.
    fn of(runs: &[&Timing]) -> Self {
        let most = |of: fn(&Timing) -> i64| runs.iter().map(|t| of(t)).max().unwrap_or(0);
        let mut medians: Vec<i64> = runs.iter().map(|t| t.median_ns).collect();
        medians.sort_unstable();
        let middle = (medians[(medians.len() - 1) / 2] + medians[medians.len() / 2]) as f64 / 2.0;
        Self {
            median: middle / 1e3,
            p999: most(|t| t.p999_ns) as f64 / 1e3,
            longest: most(|t| t.max_ns) as f64 / 1e3,
            late: runs.iter().filter_map(|t| t.late).sum(),
            steps: runs.iter().map(|t| t.steps).sum(),
        }
    }
}

/// The sampling period of an experiment's system in µs, where it has one.
fn period(held: &Held, experiment: &str) -> Option<f64> {
    let paper = held.paper.as_ref()?;
    let e = paper.experiments.iter().find(|e| e.id == experiment)?;
    illustrate::period(e).map(|seconds| 1e6 * seconds)
}

/// A row of the table before it is drawn: experiment, estimator, times, sampling period.
type Timed<'a> = (&'a Held, &'a str, String, StepTime);

/// Step times beside each other on a logarithmic scale, and beside the sampling period where there is one; None where the
/// lake holds none.
pub fn page(source: &Source, papers: &[&Held]) -> Result<Option<Page>, Error> {
    let mut timed: Vec<Timed> = Vec::new();
    for held in papers {
        for experiment in &held.experiments {
            let rows = source.timings(&held.name, experiment)?;
            let mut runs: BTreeMap<&str, Vec<&Timing>> = BTreeMap::new();
            for row in &rows {
                runs.entry(&row.estimator).or_default().push(row);
            }
            timed.extend(runs.into_iter().map(|(estimator, runs)| {
                (
                    *held,
                    experiment.as_str(),
                    estimator.to_owned(),
                    StepTime::of(&runs),
                )
            }));
        }
    }
    if timed.is_empty() {
        return Ok(None);
    }
    let mut blocks = vec![
        Block::Para(line![
            "Times of a step in this lake, measured on the machine that made it: they depend on it, and are part of no hash and \
             no verdict of the tables. The bar is the median of a step, the mark behind it the longest of all runs, both on one \
             logarithmic scale. A method runs in real time where its longest step is shorter than the sampling period."
        ]),
        Block::Table(table(&timed)),
        Block::Commands(super::query(
            "SELECT paper, experiment, estimator, MEDIAN(median_ns) / 1000 AS median_us FROM timings \
             GROUP BY paper, experiment, estimator ORDER BY median_us DESC",
        )),
    ];
    blocks.extend(printed(source, papers)?);
    Ok(Some(Page {
        place: "times".to_owned(),
        name: "Real time".to_owned(),
        file: None,
        title: line!["Does it keep up?"],
        blocks,
    }))
}

fn table(timed: &[Timed]) -> Table {
    let positive = || {
        let all = timed.iter().flat_map(|(.., t)| [t.median, t.longest]);
        all.filter(|x| *x > 0.0)
    };
    let low = positive().fold(f64::INFINITY, f64::min).min(1e9);
    let from = libm::floor(libm::log10(low));
    let to = libm::ceil(libm::log10(positive().fold(low, f64::max))).max(from + 1.0);
    let at = |us: f64| (100.0 * (libm::log10(us.max(low)) - from) / (to - from)).clamp(0.0, 100.0);
    let us = |us: f64| Cell::from(format!("{} µs", four_digits(us)));
    let rows = timed.iter().map(|(held, experiment, estimator, t)| {
        let period = period(held, experiment);
        let real = match period {
            None => Cell::default(),
            Some(p) if t.longest < p => toned(Tone::Good, "✓ yes".to_owned()),
            Some(_) => toned(Tone::Bad, format!("✗ {} of {} steps late", t.late, t.steps)),
        };
        vec![
            line![&held.name, " ", code(*experiment)].into(),
            estimator.into(),
            Inline::Scale([at(t.median), at(t.longest)]).into(),
            us(t.median),
            us(t.p999),
            us(t.longest),
            period.map_or_else(Cell::default, us),
            real,
        ]
    });
    let power = |exponent: f64| four_digits(libm::pow(10.0, exponent));
    let scale = format!("{} µs to {} µs, logarithmic", power(from), power(to));
    let columns = [
        ("experiment", Shape::Words),
        ("estimator", Shape::Words),
        (scale.as_str(), Shape::Drawn),
        ("median", Shape::Number),
        ("99.9 %", Shape::Number),
        ("longest", Shape::Number),
        ("sampling period", Shape::Number),
        ("in real time", Shape::Words),
    ];
    Table::new(Kind::Sortable, "Time of a step", &columns, rows.collect())
        .without_empty(&["sampling period", "in real time"])
}

fn toned(tone: Tone, words: String) -> Cell {
    Cell {
        line: line![words],
        tone: Some(tone),
    }
}

/// The printed times beside those of this lake.
fn printed(source: &Source, papers: &[&Held]) -> Result<Vec<Block>, Error> {
    let mut rows = Vec::new();
    for held in papers {
        for t in source.timing_comparisons(&held.name)? {
            rows.push(vec![
                format!("{} {}", held.name, t.table).into(),
                label(&t.row).into(),
                label(&t.column).into(),
                (&*t.published).into(),
                t.reproduced_ms.map(four_digits).into(),
                badge(&t.verdict).into(),
                (&*t.reason).into(),
            ]);
        }
    }
    if rows.is_empty() {
        return Ok(Vec::new());
    }
    let columns = [
        ("table", Shape::Words),
        ("row", Shape::Words),
        ("column", Shape::Words),
        ("published", Shape::Number),
        ("ours", Shape::Number),
        ("verdict", Shape::Words),
        ("reason", Shape::Why),
    ];
    Ok(vec![
        Block::heading(2, "Printed times beside ours"),
        Block::Para(prose(
            "Another machine and another program: at best the order of a column is the same. Ours is the mean over the runs \
             of the time of a step in ms, or a ratio where the paper prints one.",
        )),
        Block::Table(Table::new(Kind::Sortable, "Printed times", &columns, rows)),
    ])
}
