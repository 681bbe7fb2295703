//! Printed times, and what a paper says of times, beside ours. Nothing here is part of a hash.

use crate::papers::Paper;
use crate::published::{Cell, Comparand, Comparison, Kind, Phase, Published, Time};
use crate::statistics::mean_sd;
use crate::verdict::Verdict;
use std::collections::{BTreeMap, BTreeSet};
use zonobench_lake::digits::four_digits;
use zonobench_lake::rows::TimingComparison;

/// The mean time of a step, or of a part of it, in ns, of every run; by experiment, estimator and part.
pub type Times = BTreeMap<(String, String, Option<Phase>), Vec<f64>>;

/// A printed time, or a statement about times, with what was measured for it.
struct Measured<'a> {
    p: &'a Published,
    cell: &'a Cell,
    of: &'a Time,
    over: Option<&'a Time>,
    /// ms, or a ratio; None where no time was measured.
    value: Option<f64>,
}

/// Each printed time beside ours, the mean time of a step in ms.
///
/// A time is never better than `ordering_holds`: its rank among the printed times of its table's row is the
/// same as ours, or what is said of it is true of ours. A time that nothing is mapped to is in error.
pub fn timings(paper: &Paper, times: &Times) -> Vec<TimingComparison> {
    let measured: Vec<Measured> = paper
        .published
        .iter()
        .filter_map(|p| {
            let cell = (paper.cells.iter()).find(|c| p.is(c) && c.reading.is_as_written())?;
            let Comparand::Timing { of, over } = &cell.comparand else {
                return None;
            };
            let over = over.as_ref();
            let value = match over {
                None => ours(times, of),
                Some(over) => ours(times, of).zip(ours(times, over)).map(|(a, b)| a / b),
            };
            Some(Measured {
                p,
                cell,
                of,
                over,
                value,
            })
        })
        .collect();
    let printed = paper.published.iter().filter(|p| p.kind == Kind::Timing);
    printed
        .map(|p| {
            let found = measured.iter().find(|m| std::ptr::eq(m.p, p));
            let (verdict, reason) = match found {
                None => (Verdict::Error, "no time is mapped to this cell".to_owned()),
                Some(m) => judged(m, &measured),
            };
            TimingComparison {
                table: p.table.as_str().into(),
                row: p.row.as_str().into(),
                column: p.column.as_str().into(),
                published: p.printed.as_str().into(),
                reproduced_ms: found.and_then(|m| m.value),
                verdict: verdict.name().into(),
                reason: reason.into(),
            }
        })
        .collect()
}

/// The parts of steps that a paper's cells name, as keys of [`Times`].
pub fn parts(paper: &Paper) -> BTreeSet<(String, String, Phase)> {
    let timed = paper.cells.iter().filter_map(|cell| match &cell.comparand {
        Comparand::Timing { of, over } => Some(std::iter::once(of).chain(over)),
        _ => None,
    });
    let keys = |time: &Time| -> Vec<(String, String, Phase)> {
        let Some(phase) = time.phase else {
            return Vec::new();
        };
        let key = |id: &String| (id.clone(), time.estimator.clone(), phase);
        time.experiments.iter().map(key).collect()
    };
    timed.flatten().flat_map(keys).collect()
}

/// The mean over the experiments of the mean over the runs, in ms.
fn ours(times: &Times, time: &Time) -> Option<f64> {
    let of = |experiment: &String| {
        let key = (experiment.clone(), time.estimator.clone(), time.phase);
        mean_sd(times.get(&key)?).map(|(mean, _)| mean / 1e6)
    };
    let means: Vec<f64> = time.experiments.iter().map(of).collect::<Option<_>>()?;
    Some(means.iter().sum::<f64>() / means.len() as f64)
}

fn judged(m: &Measured, all: &[Measured]) -> (Verdict, String) {
    let Some(ours) = m.value else {
        let what = match m.of.phase {
            None => "no time was measured".to_owned(),
            Some(phase) => format!("the time of {} was not measured apart", phase.name()),
        };
        return (Verdict::Error, what);
    };
    let words = m.p.asked().map(|asked| asked.comparison);
    match (words, m.p.value()) {
        (Some(comparison), _) => in_words(m, comparison, ours),
        (None, None) => in_words(m, Comparison::Below(1.0), ours),
        (None, Some(printed)) => ranked(m, all, printed, ours),
    }
}

/// A printed time among those of its row: the same unit, the same part of a step, and a ratio to the same.
fn ranked(m: &Measured, all: &[Measured], printed: f64, ours: f64) -> (Verdict, String) {
    let peers: Vec<(f64, f64)> = all
        .iter()
        .filter(|other| {
            let (p, q) = (m.p, other.p);
            q.asked().is_none()
                && (&q.table, &q.row, &q.unit) == (&p.table, &p.row, &p.unit)
                && other.of.phase == m.of.phase
                && other.over == m.over
        })
        .filter_map(|other| Some((other.p.value()?, other.value?)))
        .collect();
    if peers.len() < 2 {
        let reason = "a single printed time has no rank; another machine, another program";
        return (Verdict::Differs, reason.to_owned());
    }
    let same = peers
        .iter()
        .all(|(theirs, other)| *theirs == printed || (*theirs < printed) == (*other < ours));
    match same {
        true => (
            Verdict::OrderingHolds,
            "its rank among the printed times is the same".to_owned(),
        ),
        false => (
            Verdict::Differs,
            "the order of the measured times is another".to_owned(),
        ),
    }
}

/// A statement about times: a comparison of the ratio to `over`, or of a time in s.
fn in_words(m: &Measured, comparison: Comparison, ours: f64) -> (Verdict, String) {
    let (number, unit) = match m.over {
        Some(over) => (ours, format!("times the time of {}", name(over))),
        None => (ours / 1e3, "s".to_owned()),
    };
    let told = format!("{} {unit}, asked for {comparison}", four_digits(number));
    let verdict = match comparison.holds(number) {
        true => Verdict::OrderingHolds,
        false => Verdict::Differs,
    };
    let verdict = m.cell.finding.on(verdict);
    match verdict {
        Verdict::OrderingHolds => (verdict, told),
        _ => (verdict, format!("{told}; another machine, another program")),
    }
}

fn name(time: &Time) -> String {
    match time.phase {
        None => time.estimator.clone(),
        Some(phase) => format!("{} in {}", phase.name(), time.estimator),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::paper;
    use super::*;

    /// The verdicts on rows of `published.csv` with cells (experiment, estimator, metric, component, over).
    fn verdicts(rows: &[(&str, &str)], times: &[(&str, Option<Phase>, f64)]) -> Vec<String> {
        let mut published = String::new();
        let mut cells = String::new();
        for (i, (row, cell)) in rows.iter().enumerate() {
            published += &format!("T,r,c{i},{row},\n");
            cells += &format!("T,r,c{i},as-written,{cell},\n");
        }
        let times = times.iter().map(|(estimator, phase, ns)| {
            let key = ("a".to_owned(), (*estimator).to_owned(), *phase);
            (key, vec![*ns])
        });
        timings(&paper(&published, &cells), &times.collect())
            .iter()
            .map(|row| format!("{}: {}", row.verdict, row.reason))
            .collect()
    }

    #[test]
    fn a_time_has_the_rank_of_its_peers() {
        let rows = [
            ("1.0,ms,timing,1,", "a,f,timing,,"),
            ("2.0,ms,timing,1,", "a,g,timing,,"),
            // Another part of the step is no peer.
            ("0.5,ms,timing,1,", "a,g,timing,reduce,"),
        ];
        let same = [
            ("f", None, 1e6),
            ("g", None, 3e6),
            ("g", Some(Phase::Reduce), 9e6),
        ];
        let told = verdicts(&rows, &same);
        assert!(
            told[..2].iter().all(|t| t.starts_with("ordering_holds")),
            "{told:?}"
        );
        assert!(
            told[2].starts_with("differs: a single printed time"),
            "{told:?}"
        );
        let other = [("f", None, 4e6), ("g", None, 3e6)];
        let told = verdicts(&rows, &other);
        assert!(
            told[..2].iter().all(|t| t.starts_with("differs")),
            "{told:?}"
        );
        assert_eq!(told[2], "error: the time of reduce was not measured apart");
    }

    #[test]
    fn what_is_said_of_times_is_a_comparison_of_a_ratio_or_of_seconds() {
        let rows = [
            ("less demanding,1,timing,1,<1", "a,f,timing,,g"),
            ("no more than 1 ms,s,timing,1,<=0.001", "a,f,timing,,"),
            (
                "mostly reduction,1,timing,1,>0.5",
                "a,g,timing,reduce,g:step",
            ),
        ];
        let times = [
            ("f", None, 2e6),
            ("g", None, 4e6),
            ("g", Some(Phase::Reduce), 3e6),
        ];
        assert_eq!(
            verdicts(&rows, &times),
            [
                "ordering_holds: 0.5 times the time of g, asked for <1",
                "differs: 0.002 s, asked for <=0.001; another machine, another program",
                "ordering_holds: 0.75 times the time of g, asked for >0.5",
            ]
        );
    }

    #[test]
    fn a_time_without_a_cell_is_in_error() {
        let told = timings(&paper("T,r,c,1.0,ms,timing,1,,\n", ""), &Times::new());
        assert_eq!(&*told[0].verdict, "error");
    }
}
