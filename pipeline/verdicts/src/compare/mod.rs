//! compare: each printed number beside what was reproduced, with a verdict and its reason.
//!
//! The grammar of cells and claims stands in `experiments/README.md`, the verdicts in [`crate::verdict`].
//! `numbers` is what a cell is mapped to and the verdict on a printed number, `claims` what is said in words and the
//! ledger's theorems, `timings` the times, `findings` the text of a reason.

mod claims;
mod findings;
mod numbers;
mod parameter;
mod timings;

pub use parameter::parameter;
pub use timings::{Times, parts, timings};

use crate::papers::Paper;
use crate::published::{Cell, Comparand, Kind, Published, Reading};
use crate::score::{Subject, by_subject};
use crate::verdict::Verdict;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{self, Comparison, Complexity, Metric};
use zonobench_lake::table;
use zonobench_lake::table::metadata;

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
        "published": paper.tables.published,
        "cells": paper.tables.cells,
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
        kind: p.kind.name().into(),
        runs: p.runs.map(|n| n as i64),
    });
    let meta = metadata("compare", None);
    table::write(&dir.join("published.parquet"), published, &meta)?;
    let mut comparisons = Vec::new();
    for p in paper.published.iter().filter(|p| p.kind != Kind::Timing) {
        let cells: Vec<&Cell> = paper.cells.iter().filter(|c| p.is(c)).collect();
        if cells.is_empty() {
            comparisons.push(unmapped(p).into());
        }
        comparisons.extend(
            cells
                .into_iter()
                .map(|cell| results.compare(p, cell).into()),
        );
    }
    if scale == Scale::Quick {
        for c in &mut comparisons {
            let c: &mut Comparison = c;
            c.verdict = Verdict::Quick.name().into();
            c.reason =
                "a smoke run with few runs and steps: its numbers are compared with nothing".into();
        }
    }
    table::write(&dir.join("comparison.parquet"), comparisons, &meta)?;
    Ok(())
}

/// `[lo, hi]`.
pub fn interval(lo: f64, hi: f64) -> String {
    format!("[{}, {}]", four_digits(lo), four_digits(hi))
}

/// A row of the table `comparison`.
pub(super) struct Row {
    at: [String; 3],
    published: String,
    reading: Reading,
    reproduced: Option<f64>,
    interval: Option<(f64, f64)>,
    rel_diff: Option<f64>,
    verdict: Verdict,
    reason: String,
}

impl Row {
    /// A row without a number.
    fn of(p: &Published, reading: &Reading, verdict: Verdict, reason: String) -> Self {
        Self {
            at: [p.table.clone(), p.row.clone(), p.column.clone()],
            published: p.printed.clone(),
            reading: reading.clone(),
            reproduced: None,
            interval: None,
            rel_diff: None,
            verdict,
            reason,
        }
    }
}

impl From<Row> for Comparison {
    fn from(row: Row) -> Self {
        let [table, line, column] = &row.at;
        Self {
            table: table.as_str().into(),
            row: line.as_str().into(),
            column: column.as_str().into(),
            reading: row.reading.name().into(),
            published: row.published.as_str().into(),
            reproduced: row.reproduced,
            interval_lo: row.interval.map(|i| i.0),
            interval_hi: row.interval.map(|i| i.1),
            rel_diff: row.rel_diff,
            verdict: row.verdict.name().into(),
            reason: row.reason.into(),
        }
    }
}

fn unmapped(p: &Published) -> Row {
    let (verdict, reason) = match p.kind {
        Kind::Lost => (Verdict::LostInSource, p.reason.clone()),
        _ => (
            Verdict::Error,
            "no result is mapped to this cell".to_owned(),
        ),
    };
    Row::of(p, &Reading::AsWritten, verdict, reason)
}

/// A paper with its results.
struct Results<'a> {
    paper: &'a Paper,
    scores: BTreeMap<String, Vec<(Subject, Vec<f64>)>>,
    ledgers: Ledgers,
}

impl Results<'_> {
    fn compare(&self, p: &Published, cell: &Cell) -> Row {
        match &cell.comparand {
            Comparand::Complexity(claim) => return self.counted(p, cell, claim),
            Comparand::Claims(claim) => return self.ledger(p, cell, claim),
            // The time itself is in no hashed table.
            Comparand::Timing { .. } => {
                return Row::of(p, &cell.reading, Verdict::LostInSource, self.text(cell));
            }
            _ => {}
        }
        let Some(number) = self.number(p, cell, None) else {
            let labels = cell.comparand.labels();
            let labels: Vec<String> = labels.iter().map(|(k, v)| format!("{k} {v}")).collect();
            let reason = format!(
                "no result: experiment {}, {}",
                cell.comparand.experiments().join("+"),
                labels.join(", ")
            );
            return Row::of(p, &cell.reading, Verdict::Error, reason);
        };
        match (p.kind, p.asked()) {
            (Kind::Claim, Some(asked)) => self.asked(p, cell, asked, number),
            (Kind::Claim, None) => {
                let reason = "a claim without a comparison".to_owned();
                Row::of(p, &cell.reading, Verdict::Error, reason)
            }
            _ => self.compared(p, cell, number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::published::{Known, Score, read_cells, read_published};

    /// A paper with these rows of `published.csv` and `cells.csv`.
    pub fn paper(published: &str, cells: &str) -> Paper {
        let header = "table,row,column,printed,unit,kind,runs,tolerance,reason\n";
        let published = read_published("p", &format!("{header}{published}")).unwrap();
        let known = Known {
            published: &published,
            estimator: &|_, _| Ok(()),
            parameter: &|_, _| Ok(()),
            claim: &|_| Ok(()),
        };
        let header =
            "table,row,column,reading,experiment,estimator,metric,component,over,finding\n";
        let cells = read_cells("c", &format!("{header}{cells}"), &known).unwrap();
        Paper {
            name: "p".to_owned(),
            experiments: Vec::new(),
            texts: Vec::new(),
            tables: Default::default(),
            published,
            cells,
        }
    }

    /// The results of experiments that have a metric `m` of an estimator `e`, and of `f` where there are two lists.
    fn results<'a>(
        paper: &'a Paper,
        held: &[(&str, &[&[f64]])],
        claims: Vec<rows::Claim>,
    ) -> Results<'a> {
        let scores = held.iter().map(|(experiment, values)| {
            let subjects = values.iter().zip(["e", "f"]).map(|(values, estimator)| {
                let subject: Subject = (estimator.into(), "m".into(), None, None);
                (subject, values.to_vec())
            });
            ((*experiment).to_owned(), subjects.collect())
        });
        Results {
            paper,
            scores: scores.collect(),
            ledgers: Ledgers {
                claims,
                complexity: Vec::new(),
            },
        }
    }

    /// Verdict and reason of the first cell.
    fn first(results: &Results) -> (Verdict, String) {
        let row = results.compare(&results.paper.published[0], &results.paper.cells[0]);
        (row.verdict, row.reason)
    }

    #[test]
    fn several_experiments_are_averaged_run_by_run() {
        let paper = paper("", "");
        let held: [(&str, &[&[f64]]); 3] = [
            ("a", &[&[1.0, 3.0]]),
            ("b", &[&[2.0, 6.0]]),
            ("c", &[&[1.0]]),
        ];
        let results = results(&paper, &held, Vec::new());
        let of = |experiments: &[&str]| {
            results.values(&Score {
                experiments: experiments.iter().map(|e| (*e).to_owned()).collect(),
                estimator: "e".to_owned(),
                metric: "m".to_owned(),
                component: String::new(),
                over: String::new(),
            })
        };
        assert_eq!(of(&["a"]), Some(vec![1.0, 3.0]));
        assert_eq!(of(&["a", "b"]), Some(vec![1.5, 4.5]));
        // Runs that do not pair, and an experiment that is not there.
        assert_eq!(of(&["a", "c"]), None);
        assert_eq!(of(&["a", "z"]), None);
    }

    #[test]
    fn a_gain_is_larger_where_an_estimator_is_further_below_the_other() {
        let held: [(&str, &[&[f64]]); 2] = [
            ("far", &[&[1.0, 2.0, 1.0], &[5.0, 6.5, 5.0]]),
            ("near", &[&[1.0, 2.0, 1.0], &[1.5, 2.0, 1.5]]),
        ];
        let verdict = |of: &str, than: &str| {
            let cells = format!("T,r,c,as-written,{of},e,gain(m),,{than}/f,{{reproduced}}\n");
            let paper = paper("T,r,c,words,1,claim,,>0,\n", &cells);
            first(&results(&paper, &held, Vec::new()))
        };
        assert_eq!(verdict("far", "near").0, Verdict::Holds);
        let (fails, reason) = verdict("near", "far");
        assert_eq!(fails, Verdict::DoesNotHold);
        // The mean of −3.5, −4.5 and −3.5.
        assert!(reason.contains("-3.833"), "{reason}");
    }

    #[test]
    fn a_number_of_one_run_is_lent_the_spread_of_another_reading() {
        let cells = "T,r,c,as-written,once,e,m,,,{reproduced} by {spread}: {lo} to {hi}\n\
                     T,r,c,few,seldom,e,m,,,\n\
                     T,r,c,lean,often,e,m,,,\n";
        let verdict = |printed: &str| {
            let paper = paper(&format!("T,r,c,{printed},1,monte_carlo,1,,\n"), cells);
            let held: [(&str, &[&[f64]]); 3] = [
                ("once", &[&[5.0]]),
                ("seldom", &[&[1.0, 100.0]]),
                ("often", &[&[1.0, 2.0, 3.0]]),
            ];
            first(&results(&paper, &held, Vec::new()))
        };
        // 5 ± t √2, t = 9.925 at 2 degrees of freedom.
        let spread = "the spread of 3 runs of the reading lean";
        let (inside, reason) = verdict("19.0");
        assert_eq!(inside, Verdict::WithinCi);
        assert!(reason.contains(spread), "{reason}");
        let (outside, reason) = verdict("19.2");
        assert_eq!(outside, Verdict::Differs);
        assert_eq!(reason, format!("5 by {spread}: -9.086 to 19.09"));
    }

    /// The verdict on a claim about `metric` of the runs, with a finding.
    fn claim(asked: &str, metric: &str, finding: &str, runs: &[&[f64]]) -> (Verdict, String) {
        let over = if metric == "m" { "" } else { "f" };
        let paper = paper(
            &format!("T,r,c,words,1,claim,,{asked},\n"),
            &format!("T,r,c,as-written,a,e,{metric},,{over},{finding}\n"),
        );
        first(&results(&paper, &[("a", runs)], Vec::new()))
    }

    #[test]
    fn a_claim_about_means_is_undecided_where_the_interval_holds_both_outcomes() {
        // 1 ± t · 0.1/√5 with t = 4.604: 0.794 to 1.206.
        let near = [0.9, 0.95, 1.0, 1.05, 1.1];
        let shifted: Vec<f64> = near.iter().map(|x| x - 0.5).collect();
        let (verdict, reason) = claim("<1.01", "m", "", &[&near]);
        assert_eq!(verdict, Verdict::Undecided);
        assert!(
            reason.contains("which holds both outcomes; asked for <1.01"),
            "{reason}"
        );
        assert_eq!(claim("<1.01", "m", "", &[&shifted]).0, Verdict::Holds);
        assert_eq!(claim(">1.01", "m", "", &[&shifted]).0, Verdict::DoesNotHold);
        // Both ends of the interval are outside, what is asked for is inside.
        assert_eq!(claim("1.05..1.06", "m", "", &[&near]).0, Verdict::Undecided);
        // Exactly is exactly; one run, or runs that are all the same, have no interval.
        assert_eq!(claim("==1", "m", "", &[&near[1..4]]).0, Verdict::Holds);
        assert_eq!(claim("<1", "m", "", &[&[1.1]]).0, Verdict::DoesNotHold);
        assert_eq!(claim("<1", "m", "", &[&[0.5, 0.5]]).0, Verdict::Holds);
    }

    #[test]
    fn runs_are_compared_in_pairs() {
        // The runs differ by far more than the methods do, which see the same noise.
        let of: Vec<f64> = (1..=8).map(f64::from).collect();
        let over: Vec<f64> = of.iter().map(|x| 1.01 * x + 0.001 * (x - 4.5)).collect();
        assert_eq!(claim("<1", "ratio(m)", "", &[&of, &over]).0, Verdict::Holds);
        let mixed: Vec<f64> = of.iter().rev().copied().collect();
        assert_eq!(
            claim("<1.01", "ratio(m)", "", &[&of, &mixed]).0,
            Verdict::Undecided
        );
    }

    #[test]
    fn existence_names_a_run_and_every_names_the_first_that_fails() {
        let runs: [&[f64]; 1] = [&[0.2, 0.7, 0.8]];
        let (verdict, reason) = claim("some >0.5", "m", "", &runs);
        assert_eq!(verdict, Verdict::Holds);
        assert!(
            reason.starts_with("run 1 gives 0.7, and 2 of 3 runs do so"),
            "{reason}"
        );
        let (verdict, reason) = claim("every >0.5", "m", "It varies.", &runs);
        assert_eq!(verdict, Verdict::DoesNotHold);
        assert_eq!(reason, "It varies; run 0 gives 0.2, and 1 of 3 runs fail");
        let (verdict, reason) = claim("some >0.9", "m", "", &runs);
        assert_eq!(verdict, Verdict::DoesNotHold);
        assert!(
            reason.starts_with("none of 3 runs does: 0.2 to 0.8"),
            "{reason}"
        );
        assert_eq!(claim("every >0.1", "m", "", &runs).0, Verdict::Holds);
    }

    #[test]
    fn a_prefix_decides_what_a_success_or_a_failure_is_called() {
        let runs: [&[f64]; 1] = [&[0.2, 0.2]];
        for (asked, finding, expected) in [
            (
                "<1",
                "Not reproducible: 0.1 to 3 were seen",
                Verdict::NotReproducible,
            ),
            (
                ">1",
                "Not reproducible: 0.1 to 3 were seen",
                Verdict::NotReproducible,
            ),
            ("<1", "Fitted: by x", Verdict::Fitted),
            (">1", "Slip: (3) corrects it", Verdict::Slip),
            (">1", "Damaged: a bar is lost", Verdict::LostInSource),
            (">1", "Fitted: by x", Verdict::DoesNotHold),
        ] {
            let (verdict, reason) = claim(asked, "m", finding, &runs);
            assert_eq!(verdict, expected, "{asked} {finding}");
            let text = finding.split_once(": ").unwrap().1;
            assert!(reason.starts_with(text), "{reason}");
        }
        let number = |printed: &str, finding: &str| {
            let paper = paper(
                &format!("T,r,c,{printed},1,monte_carlo,5,,\n"),
                &format!("T,r,c,as-written,a,e,m,,,{finding}\n"),
            );
            first(&results(&paper, &[("a", &runs)], Vec::new()))
        };
        let fitted = number(
            "0.2",
            "Fitted: T_0 is chosen so that {reproduced} comes out",
        );
        assert_eq!(fitted.0, Verdict::Fitted);
        assert_eq!(fitted.1, "T_0 is chosen so that 0.2 comes out");
        assert_eq!(
            number("0.2", "By accident: wide sets").0,
            Verdict::ByAccident
        );
        assert_eq!(number("0.9", "Fitted: by x").0, Verdict::Differs);
        assert_eq!(
            number("0.2", "Not reproducible: no seed").0,
            Verdict::WithinCi
        );
        assert_eq!(
            number("0.9", "Not reproducible: no seed").0,
            Verdict::NotReproducible
        );
    }

    #[test]
    fn a_claim_of_the_ledger_has_the_ledger_s_verdict_and_its_counterexample() {
        let paper = paper(
            "S,Lemma 1,claim,holds,1,claim,,,\n",
            "S,Lemma 1,claim,as-written,,,claims,lemma-1,,\n",
        );
        let of = |verdict: &str, counterexample: &str| {
            let claim = rows::Claim {
                claim: "lemma-1".into(),
                statement: "it is so".into(),
                verdict: verdict.into(),
                trials: 20,
                lost: i64::from(!counterexample.is_empty()),
                counterexample: counterexample.into(),
                consequence: "use (3).".into(),
            };
            first(&results(&paper, &[], vec![claim]))
        };
        assert_eq!(
            of("holds", ""),
            (
                Verdict::Holds,
                "none of 20 exact trials lost; use (3)".to_owned()
            )
        );
        let (verdict, reason) = of("does_not_hold", "at x = 1 it is 2");
        assert_eq!(verdict, Verdict::DoesNotHold);
        assert_eq!(reason, "at x = 1 it is 2; use (3)");
        assert_eq!(of("slip", "x").0, Verdict::Slip);
        assert_eq!(of("damaged", "x").0, Verdict::LostInSource);
        assert_eq!(of("remark", "x").0, Verdict::Error);
        assert_eq!(of("not_tested", "").0, Verdict::Error);
    }
}
