//! compare: each printed number beside what was reproduced, with a verdict and its reason.
//!
//! The grammar of cells and claims stands in `experiments/README.md`, the verdicts in the documentation of
//! the table `comparison`. Derived numbers (ratios of scores) have the spread of a paired bootstrap.

use crate::papers::Paper;
use crate::published::{Cell, Comparison as Claim, Published, half_unit};
use crate::score::{Subject, by_subject};
use crate::statistics::{mean_sd, paired_offsets, prediction_offsets};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::de::DeValue;
use zonobench_lab::experiment::MetricSpec;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{self, Comparison, Complexity, Metric, TimingComparison};
use zonobench_lake::table;
use zonobench_lake::table::metadata;

/// A finding that begins so says why a number that differs could not come out: the paper leaves out what it
/// depends on.
const NOT_REPRODUCIBLE: &str = "Not reproducible:";

/// Which numbers a comparison is made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// The published experiments.
    Full,
    /// A smoke run with few runs and steps: its numbers are compared with nothing.
    Quick,
}

/// What a paper's comparison depends on.
pub fn input(
    paper: &Paper,
    metrics: &BTreeMap<&str, &str>,
    claims: &str,
    complexity: Option<&str>,
    scale: Scale,
) -> Value {
    let texts: Vec<&str> = paper.texts.iter().map(|(_, text)| *text).collect();
    json!({
        "published": paper.published,
        "cells": paper.cells,
        "experiments": texts,
        "metrics": metrics,
        "claims": claims,
        "complexity": complexity,
        "quick": scale == Scale::Quick,
    })
}

/// What was found of a paper's claims apart from its experiments.
pub struct Ledgers {
    /// Its numbered claims.
    pub claims: Vec<rows::Claim>,
    /// Its claims about cost.
    pub complexity: Vec<Complexity>,
}

/// Writes `published.parquet` and `comparison.parquet`; `metrics` has the metrics file of every experiment.
pub fn make(
    paper: &Paper,
    metrics: &BTreeMap<&str, PathBuf>,
    ledgers: Ledgers,
    scale: Scale,
    dir: &Path,
) -> Result<(), Error> {
    let mut scores = BTreeMap::new();
    for (experiment, path) in metrics {
        scores.insert(
            (*experiment).to_owned(),
            by_subject(table::read::<Metric>(path)?),
        );
    }
    let results = Results {
        paper,
        scores,
        ledgers,
    };
    let published = paper.published.iter().map(|p| rows::Published {
        table: p.table.as_str().into(),
        row: p.row.as_str().into(),
        column: p.column.as_str().into(),
        printed: p.printed.as_str().into(),
        value: p.value(),
        unit: if p.unit.is_empty() { "1" } else { &p.unit }.into(),
        kind: p.kind.as_str().into(),
        runs: p.runs.map(|n| n as i64),
    });
    let meta = metadata("compare", None);
    table::write(&dir.join("published.parquet"), published, &meta)?;
    let mut comparisons = Vec::new();
    for p in paper.published.iter().filter(|p| p.kind != "timing") {
        let cells: Vec<&Cell> = paper.cells.iter().filter(|c| p.is(c)).collect();
        if cells.is_empty() {
            comparisons.push(unmapped(p));
        }
        comparisons.extend(cells.into_iter().map(|cell| results.compare(p, cell)));
    }
    if scale == Scale::Quick {
        for c in &mut comparisons {
            c.verdict = "quick".into();
            c.reason =
                "a smoke run with few runs and steps: its numbers are compared with nothing".into();
        }
    }
    table::write(&dir.join("comparison.parquet"), comparisons, &meta)?;
    Ok(())
}

fn row(p: &Published, reading: &str, verdict: &str, reason: String) -> Comparison {
    Comparison {
        table: p.table.as_str().into(),
        row: p.row.as_str().into(),
        column: p.column.as_str().into(),
        reading: reading.into(),
        published: p.printed.as_str().into(),
        reproduced: None,
        interval_lo: None,
        interval_hi: None,
        rel_diff: None,
        verdict: verdict.into(),
        reason: reason.into(),
    }
}

fn unmapped(p: &Published) -> Comparison {
    if p.kind == "lost" {
        row(p, "as-written", "lost_in_source", p.reason.clone())
    } else {
        row(
            p,
            "as-written",
            "error",
            "no result is mapped to this cell".to_owned(),
        )
    }
}

/// A reproduced number with its spread.
struct Number {
    value: f64,
    /// Where a paper's number over its own runs lies with 99 %, relative to ours.
    offsets: (f64, f64),
    n: usize,
    sd: Option<f64>,
    /// Whose spread the offsets are of, if not of these runs.
    spread: Option<String>,
}

struct Results<'a> {
    paper: &'a Paper,
    scores: BTreeMap<String, Vec<(Subject, Vec<f64>)>>,
    ledgers: Ledgers,
}

impl Results<'_> {
    /// The values over runs; of several experiments joined by `+` their mean, run by run.
    fn values(
        &self,
        experiments: &str,
        estimator: &str,
        metric: &str,
        component: &str,
    ) -> Option<Vec<f64>> {
        let of = |experiment: &str| {
            let all = self.scores.get(experiment.trim())?;
            let is = |((e, m, c, _), _): &&(Subject, Vec<f64>)| {
                &**e == estimator && &**m == metric && c.as_deref().unwrap_or("") == component
            };
            all.iter().find(is).map(|(_, values)| values)
        };
        let all: Vec<&Vec<f64>> = experiments.split('+').map(of).collect::<Option<_>>()?;
        let runs = all.first()?.len();
        if runs == 0 || all.iter().any(|values| values.len() != runs) {
            return None;
        }
        let mean = |run| all.iter().map(|values| values[run]).sum::<f64>() / all.len() as f64;
        Some((0..runs).map(mean).collect())
    }

    /// What is mapped to the cell, its offsets for our mean over `ours` runs, all there are unless given.
    fn number(&self, p: &Published, cell: &Cell, ours: Option<usize>) -> Option<Number> {
        let runs = p.runs.unwrap_or(1);
        let exactly = |value| Number {
            value,
            offsets: (0.0, 0.0),
            n: 1,
            sd: None,
            spread: None,
        };
        if cell.metric == "parameter" {
            let text = self.paper.text(&cell.experiment)?;
            return parameter(text, &cell.component).map(exactly);
        }
        let of = |estimator: &str, metric: &str| {
            self.values(&cell.experiment, estimator, metric, &cell.component)
        };
        let Some((derived, metric)) = cell
            .metric
            .strip_suffix(')')
            .and_then(|m| m.split_once('('))
        else {
            let values = of(&cell.estimator, &cell.metric)?;
            let (value, sd) = mean_sd(&values)?;
            let sd = (values.len() > 1).then_some(sd);
            return Some(Number {
                value,
                offsets: prediction_offsets(&values, runs, ours.unwrap_or(values.len())),
                n: values.len(),
                sd,
                spread: None,
            });
        };
        let (over, over_metric) = cell.over.split_once(':').unwrap_or((&cell.over, metric));
        let a = of(&cell.estimator, metric)?;
        let b = match of(over, over_metric) {
            Some(b) => b,
            None if self.is_over(&cell.experiment, over_metric, over) => vec![1.0; a.len()],
            None => return None,
        };
        if a.len() != b.len() {
            return None;
        }
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let pairs: Vec<(f64, f64)> = a.iter().copied().zip(b.iter().copied()).collect();
        let statistic: Box<dyn Fn(f64, f64) -> f64> = match derived {
            "ratio" => Box::new(|x, y| x / y),
            "percent" => Box::new(|x, y| 100.0 * (x / y)),
            "drop" => Box::new(|x, y| 100.0 - 100.0 * (x / y)),
            "wins" => {
                let wins: Vec<f64> = pairs
                    .iter()
                    .map(|(x, y)| f64::from(u8::from(x < y)))
                    .collect();
                let (value, sd) = mean_sd(&wins)?;
                let offsets = prediction_offsets(&wins, runs, ours.unwrap_or(wins.len()));
                return Some(Number {
                    value,
                    offsets,
                    n: wins.len(),
                    sd: Some(sd),
                    spread: None,
                });
            }
            _ => return None,
        };
        let value = statistic(mean(&a), mean(&b));
        let offsets = paired_offsets(&pairs, runs, ours.unwrap_or(pairs.len()), &statistic);
        Some(Number {
            value,
            offsets,
            n: pairs.len(),
            sd: None,
            spread: None,
        })
    }

    /// The spread for a number of one run, which has none: that of the other reading of the cell with the most runs, the
    /// first of equals, as offsets of what one run gives.
    fn lent(&self, p: &Published, cell: &Cell) -> Option<((f64, f64), String)> {
        let others = (self.paper.cells.iter()).filter(|c| p.is(c) && c.reading != cell.reading);
        let numbers = others.filter_map(|c| Some((c, self.number(p, c, Some(1))?)));
        let most = numbers
            .filter(|(_, number)| number.n > 1)
            .min_by_key(|(_, number)| std::cmp::Reverse(number.n));
        most.map(|(c, number)| {
            let spread = format!(
                "the spread of {} runs of the reading {}",
                number.n, c.reading
            );
            (number.offsets, spread)
        })
    }

    /// Whether the metric is itself a ratio to this estimator in all of the experiments: then the estimator's
    /// own, which is not kept, is 1.
    fn is_over(&self, experiments: &str, metric: &str, estimator: &str) -> bool {
        experiments.split('+').all(|id| {
            let found = self.paper.experiments.iter().find(|e| e.id == id.trim());
            found.is_some_and(|e| {
                let is = |m: &&MetricSpec| m.id == metric;
                let spec = e.metrics.iter().find(is);
                spec.is_some_and(|m| m.over.as_deref() == Some(estimator))
            })
        })
    }

    /// The verdict of the ledger on the claim that a cell names.
    fn claim(&self, p: &Published, cell: &Cell) -> Comparison {
        let Some(claim) = self
            .ledgers
            .claims
            .iter()
            .find(|c| *c.claim == cell.component)
        else {
            let reason = format!("no claim {:?} in the ledger", cell.component);
            return row(p, &cell.reading, "error", reason);
        };
        let mut reason = format!(
            "{} of {} exact trials of the claim lost",
            claim.lost, claim.trials
        );
        for part in [&claim.counterexample, &claim.consequence] {
            if !part.is_empty() {
                reason += &format!("; {part}");
            }
        }
        row(p, &cell.reading, &claim.verdict, reason)
    }

    fn compare(&self, p: &Published, cell: &Cell) -> Comparison {
        if cell.metric == "complexity" {
            return self.counted(p, cell);
        }
        if cell.metric == "claims" {
            return self.claim(p, cell);
        }
        if cell.metric == "timing" {
            return row(p, &cell.reading, "lost_in_source", cell.finding.clone());
        }
        let Some(mut number) = self.number(p, cell, None) else {
            let reason = format!(
                "no result: experiment {}, estimator {}, metric {} {}",
                cell.experiment, cell.estimator, cell.metric, cell.component
            );
            return row(p, &cell.reading, "error", reason);
        };
        if number.n == 1
            && p.kind == "monte_carlo"
            && let Some((offsets, spread)) = self.lent(p, cell)
        {
            (number.offsets, number.spread) = (offsets, Some(spread));
        }
        let ours = number.value;
        let published = p.value();
        let half = half_unit(&p.printed);
        let interval = (p.kind == "monte_carlo").then_some((
            ours + number.offsets.0 - half,
            ours + number.offsets.1 + half,
        ));
        let rel_diff = published.filter(|v| *v != 0.0).map(|v| (ours - v) / v);
        let tolerance = p.tolerance.parse::<f64>().ok();
        let close = published
            .zip(tolerance)
            .is_some_and(|(v, t)| (ours - v).abs() <= t);
        let verdict = match (p.kind.as_str(), published) {
            ("claim", _) => match Claim::parse(&p.tolerance) {
                Some(claim) if claim.holds(ours) => "holds",
                Some(_) => "does_not_hold",
                None => "error",
            },
            ("lost", _) => "lost_in_source",
            (_, Some(v)) if p.kind == "exact" && ours == v => "exact",
            // One rounding of the decimal on either side.
            (_, Some(v)) if p.kind == "rounded" && (ours - v).abs() <= half * (1.0 + 1e-12) => {
                "within_rounding"
            }
            (_, Some(v)) if interval.is_some_and(|(lo, hi)| lo <= v && v <= hi) => "within_ci",
            (_, Some(_)) if close => "within_tolerance",
            _ if cell.finding.starts_with(NOT_REPRODUCIBLE) => "not_reproducible",
            _ => "differs",
        };
        let explained = matches!(
            verdict,
            "differs" | "does_not_hold" | "not_reproducible" | "lost_in_source" | "error"
        );
        let reason = if explained && !cell.finding.is_empty() {
            self.fill(&cell.finding, p, cell, &number, interval, rel_diff)
        } else {
            automatic(verdict, p, &number, interval)
        };
        Comparison {
            reproduced: Some(ours),
            interval_lo: interval.map(|i| i.0),
            interval_hi: interval.map(|i| i.1),
            rel_diff,
            ..row(p, &cell.reading, verdict, reason)
        }
    }

    /// The verdict of the claim about cost that `cell` names.
    fn counted(&self, p: &Published, cell: &Cell) -> Comparison {
        let claim = self
            .ledgers
            .complexity
            .iter()
            .find(|r| r.sweep_variable.is_none() && *r.claim == *cell.component);
        let Some(claim) = claim else {
            let reason = format!("no claim {} was counted", cell.component);
            return row(p, &cell.reading, "error", reason);
        };
        let reason = match cell.finding.is_empty() {
            true => claim.reason.to_string(),
            false => format!("{}: {}", cell.finding, claim.reason),
        };
        row(p, &cell.reading, &claim.verdict, reason)
    }

    /// Puts measured numbers into the places of a finding.
    fn fill(
        &self,
        finding: &str,
        p: &Published,
        cell: &Cell,
        number: &Number,
        interval: Option<(f64, f64)>,
        rel_diff: Option<f64>,
    ) -> String {
        let show = |x: Option<f64>| x.map_or_else(|| "(no value)".to_owned(), four_digits);
        let mut out = String::new();
        let mut rest = finding;
        while let Some((before, after)) = rest.split_once('{') {
            out += before;
            let Some((place, tail)) = after.split_once('}') else {
                rest = after;
                out.push('{');
                continue;
            };
            rest = tail;
            match place {
                "reproduced" => out += &four_digits(number.value),
                "published" => out += &p.printed,
                "lo" => out += &show(interval.map(|i| i.0)),
                "hi" => out += &show(interval.map(|i| i.1)),
                "rel_diff" => out += &show(rel_diff.map(|d| 100.0 * d)),
                "n" => out += &number.n.to_string(),
                "sd" => out += &show(number.sd),
                "spread" => out += number.spread.as_deref().unwrap_or("(no spread)"),
                _ => match place.strip_prefix("score:") {
                    Some(subject) => out += &show(self.score(subject, &cell.experiment)),
                    // Not a place: the braces of a set in the text.
                    None => out += &format!("{{{place}}}"),
                },
            }
        }
        out + rest
    }

    fn score(&self, subject: &str, here: &str) -> Option<f64> {
        let mut parts = subject.split(':');
        let (experiment, estimator, metric) = (parts.next()?, parts.next()?, parts.next()?);
        let experiment = if experiment == "." { here } else { experiment };
        let values = self.values(experiment, estimator, metric, parts.next().unwrap_or(""))?;
        mean_sd(&values).map(|(mean, _)| mean)
    }
}

fn automatic(
    verdict: &str,
    p: &Published,
    number: &Number,
    interval: Option<(f64, f64)>,
) -> String {
    let ours = four_digits(number.value);
    let over = match &number.spread {
        Some(spread) => format!("one run, with {spread}"),
        None => format!("{} runs", number.n),
    };
    match (verdict, interval) {
        ("exact", _) => "the same number".to_owned(),
        ("within_rounding", _) => format!("{ours} rounds to it"),
        ("within_tolerance", _) => format!("{ours}, within {} of it: {}", p.tolerance, p.reason),
        ("within_ci", Some((lo, hi))) => format!(
            "{ours} over {over}: a mean of {} runs lies in [{}, {}] with 99 %",
            p.runs.unwrap_or(1),
            four_digits(lo),
            four_digits(hi)
        ),
        ("holds" | "does_not_hold", _) => {
            format!(
                "measured {ours} over {} runs; asked for {}: {}",
                number.n, p.tolerance, p.reason
            )
        }
        ("lost_in_source", _) => format!("the printed value is lost; ours is {ours}"),
        ("error", _) => format!("{ours}: a claim without a comparison"),
        (_, Some((lo, hi))) => format!(
            "{ours} over {over}; the printed number is not in [{}, {}]",
            four_digits(lo),
            four_digits(hi)
        ),
        _ => format!("{ours} against {}", p.printed),
    }
}

/// The number that an experiment's file holds at `path`: keys joined by dots, `[i]` from 0, a list of tables
/// entered by `id` or `name`.
fn parameter(text: &str, path: &str) -> Option<f64> {
    let table = toml::de::DeTable::parse(text).ok()?;
    let mut at = DeValue::Table(table.into_inner());
    for part in path.replace('[', ".[").split('.') {
        at =
            match (part.strip_prefix('[').and_then(|p| p.strip_suffix(']')), at) {
                (Some(index), DeValue::Array(items)) => {
                    items.into_iter().nth(index.parse().ok()?)?.into_inner()
                }
                (None, DeValue::Table(mut table)) => table.remove(part)?.into_inner(),
                (None, DeValue::Array(items)) => items
                    .into_iter()
                    .map(|item| item.into_inner())
                    .find(|item| {
                        let key = |k| item.get(k).and_then(|v| v.as_ref().as_str());
                        key("id").or(key("name")) == Some(part)
                    })?,
                _ => return None,
            };
    }
    let number = at.as_float().map(|x| x.as_str().to_owned());
    number
        .or_else(|| at.as_integer().map(|i| i.as_str().to_owned()))?
        .replace('_', "")
        .parse()
        .ok()
}

/// Each printed time beside ours, the mean time of a step in ms; `times` has the mean time of a step in ns
/// of every run, by experiment and estimator.
///
/// A time is never better than `ordering_holds`: its rank among the printed times of its table's row is the
/// same as ours.
pub fn timings(
    paper: &Paper,
    times: &BTreeMap<(String, String), Vec<f64>>,
) -> Vec<TimingComparison> {
    let ours = |cell: &Cell, estimator: &str| {
        let of = |experiment: &str| {
            let values = times.get(&(experiment.trim().to_owned(), estimator.to_owned()))?;
            mean_sd(values).map(|(mean, _)| mean / 1e6)
        };
        let means: Vec<f64> = cell.experiment.split('+').map(of).collect::<Option<_>>()?;
        Some(means.iter().sum::<f64>() / means.len() as f64)
    };
    let measured: Vec<(&Published, &Cell, Option<f64>)> = paper
        .published
        .iter()
        .filter_map(|p| {
            let cell = paper
                .cells
                .iter()
                .find(|c| p.is(c) && c.metric == "timing")?;
            let mut value = ours(cell, &cell.estimator);
            if !cell.over.is_empty() {
                value = value.zip(ours(cell, &cell.over)).map(|(a, b)| a / b);
            }
            Some((p, cell, value))
        })
        .collect();
    measured
        .iter()
        .filter(|(p, _, _)| p.kind == "timing")
        .map(|(p, cell, value)| {
            let peers: Vec<(f64, f64)> = measured
                .iter()
                .filter(|(q, c, _)| {
                    q.table == p.table && q.row == p.row && q.unit == p.unit && c.over == cell.over
                })
                .filter_map(|(q, _, v)| Some((q.value()?, (*v)?)))
                .collect();
            let mine = value.map(|v| (p.value(), v));
            let (verdict, reason) = match mine {
                None => ("error", "no time was measured".to_owned()),
                Some((None, measured)) => in_words(p, cell, measured),
                Some(_) if peers.len() < 2 => (
                    "differs",
                    "a single printed time has no rank; another machine, another program"
                        .to_owned(),
                ),
                Some((Some(printed), measured)) => {
                    let same = peers.iter().all(|(theirs, ours)| {
                        (theirs < &printed) as i8 - (theirs > &printed) as i8 == 0
                            || (theirs < &printed) == (ours < &measured)
                    });
                    if same {
                        (
                            "ordering_holds",
                            "its rank among the printed times is the same".to_owned(),
                        )
                    } else {
                        (
                            "differs",
                            "the order of the measured times is another".to_owned(),
                        )
                    }
                }
            };
            TimingComparison {
                table: p.table.as_str().into(),
                row: p.row.as_str().into(),
                column: p.column.as_str().into(),
                published: p.printed.as_str().into(),
                reproduced_ms: *value,
                verdict: verdict.into(),
                reason: reason.into(),
            }
        })
        .collect()
}

/// A statement about times: a comparison of the ratio to `over` (below 1 if none is given), or of a time in s.
fn in_words(p: &Published, cell: &Cell, measured: f64) -> (&'static str, String) {
    let ratio = !cell.over.is_empty();
    let number = if ratio { measured } else { measured / 1e3 };
    let claim = Claim::parse(&p.tolerance).or(ratio.then_some(Claim::Below(1.0)));
    let of = if ratio {
        format!("times the time of {}", cell.over)
    } else {
        "s".to_owned()
    };
    match claim {
        Some(claim) if claim.holds(number) => {
            ("ordering_holds", format!("{} {of}", four_digits(number)))
        }
        Some(_) => (
            "differs",
            format!(
                "{} {of}; another machine, another program",
                four_digits(number)
            ),
        ),
        None => ("error", "a statement without a comparison".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_found_by_its_path() {
        let text = "steps = 40\n[noise]\nw = { covariance = [[1.0, 2.5], [3.0, 4.0]] }\n\
                    [[estimator]]\nid = \"f\"\nphi = 100\n[[metric]]\nname = \"rmse\"\nfrom = 4\n";
        assert_eq!(parameter(text, "steps"), Some(40.0));
        assert_eq!(parameter(text, "noise.w.covariance[0][1]"), Some(2.5));
        assert_eq!(parameter(text, "estimator.f.phi"), Some(100.0));
        assert_eq!(parameter(text, "metric.rmse.from"), Some(4.0));
        assert_eq!(parameter(text, "metric.rmse.to"), None);
    }

    #[test]
    fn several_experiments_are_averaged_run_by_run() {
        let paper = Paper {
            name: "p".to_owned(),
            experiments: Vec::new(),
            texts: Vec::new(),
            published: Vec::new(),
            cells: Vec::new(),
        };
        let held = |values: &[f64]| {
            let subject: Subject = ("e".into(), "m".into(), None, None);
            vec![(subject, values.to_vec())]
        };
        let scores = [
            ("a", held(&[1.0, 3.0])),
            ("b", held(&[2.0, 6.0])),
            ("c", held(&[1.0])),
        ];
        let scores = scores.map(|(id, values)| (id.to_owned(), values)).into();
        let results = Results {
            paper: &paper,
            scores,
            ledgers: Ledgers {
                claims: Vec::new(),
                complexity: Vec::new(),
            },
        };
        let of = |experiments: &str| results.values(experiments, "e", "m", "");
        assert_eq!(of("a"), Some(vec![1.0, 3.0]));
        assert_eq!(of("a+b"), Some(vec![1.5, 4.5]));
        // Runs that do not pair, and an experiment that is not there.
        assert_eq!(of("a+c"), None);
        assert_eq!(of("a+z"), None);
    }

    #[test]
    fn a_number_of_one_run_is_lent_the_spread_of_another_reading() {
        let cells = "table,row,column,reading,experiment,estimator,metric,component,over,finding\n\
                     T,r,c,as-written,once,e,m,,,{reproduced} by {spread}: {lo} to {hi}\n\
                     T,r,c,few,seldom,e,m,,,\n\
                     T,r,c,lean,often,e,m,,,\n";
        let published = "table,row,column,printed,unit,kind,runs,tolerance,reason\nT,r,c,PRINTED,1,monte_carlo,1,,\n";
        let verdict = |printed: &str| {
            let published = published.replace("PRINTED", printed);
            let paper = Paper {
                name: "p".to_owned(),
                experiments: Vec::new(),
                texts: Vec::new(),
                published: csv_rows(&published),
                cells: csv_rows(cells),
            };
            let held = |values: &[f64]| {
                let subject: Subject = ("e".into(), "m".into(), None, None);
                vec![(subject, values.to_vec())]
            };
            let scores = [
                ("once", held(&[5.0])),
                ("seldom", held(&[1.0, 100.0])),
                ("often", held(&[1.0, 2.0, 3.0])),
            ];
            let results = Results {
                paper: &paper,
                scores: scores.map(|(id, values)| (id.to_owned(), values)).into(),
                ledgers: Ledgers {
                    claims: Vec::new(),
                    complexity: Vec::new(),
                },
            };
            let row = results.compare(&paper.published[0], &paper.cells[0]);
            (row.verdict.to_string(), row.reason.to_string())
        };
        // 5 ± t √2, t = 9.925 at 2 degrees of freedom.
        let spread = "the spread of 3 runs of the reading lean";
        let (inside, reason) = verdict("19.0");
        assert_eq!(inside, "within_ci");
        assert!(reason.contains(spread), "{reason}");
        let (outside, reason) = verdict("19.2");
        assert_eq!(outside, "differs");
        assert_eq!(reason, format!("5 by {spread}: -9.086 to 19.09"));
    }

    fn csv_rows<T: serde::de::DeserializeOwned>(text: &str) -> Vec<T> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        reader.deserialize().collect::<Result<_, _>>().unwrap()
    }
}
