//! Methods compared on the same draws: by paired differences, never by bare means.
//!
//! All estimators of an experiment see the same runs. Two of them are compared run by run: the ratio of their means has
//! an interval that comes from the pairs, in which what both share, a hard run or an easy one, cancels. Intervals of
//! each mean alone overlap where the pairs leave no doubt.

use crate::statistics::{mean_offsets, mean_sd, paired_mean_offsets};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::lake::{files_of, path_keys, read_manifest};
use zonobench_lake::rows::Metric;
use zonobench_lake::table;

/// Values that agree to nine digits are equal: two forms of one filter differ by rounding, and always to the same side.
const EQUAL: f64 = 1e-9;

/// What the pairs say of two means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Order {
    /// The first mean is the smaller one.
    #[serde(rename = "less")]
    Less,
    /// The first mean is the greater one.
    #[serde(rename = "more")]
    More,
    /// The 99 % interval of the ratio holds 1, or both are equal in every run, to nine digits.
    #[serde(rename = "no difference")]
    NoDifference,
    /// Fewer than two runs have both values, or the pairs have no spread: they say nothing of other runs.
    #[serde(rename = "undecided")]
    Undecided,
}

impl Order {
    /// As it is printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Less => "less",
            Self::More => "more",
            Self::NoDifference => "no difference",
            Self::Undecided => "undecided",
        }
    }
}

/// The ratio of two means over the same runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paired {
    /// Runs in which both have a value.
    pub runs: usize,
    /// The mean of the first over that of the second; None where that is not a positive number.
    pub ratio: Option<f64>,
    /// The 99 % interval of the true ratio; None where the runs say nothing of it.
    pub interval: Option<(f64, f64)>,
    /// What follows.
    pub order: Order,
}

/// Compares two methods by the pairs (first, second) of the runs that both have.
///
/// The interval is that of the jackknife's pseudo-values of the ratio ([`paired_mean_offsets`]). Where a mean is not
/// positive, so that a ratio says nothing, the order is that of the interval of the mean difference.
pub fn paired(pairs: &[(f64, f64)]) -> Paired {
    let runs = pairs.len();
    let of = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> { pairs.iter().map(pick).collect() };
    let mean = |values: &[f64]| mean_sd(values).map_or(f64::NAN, |(mean, _)| mean);
    let (x, y) = (mean(&of(|p| p.0)), mean(&of(|p| p.1)));
    let ratio = Some(x / y).filter(|r| x > 0.0 && y > 0.0 && r.is_finite());
    let decided = |lo: f64, hi: f64, equal: f64| match (hi < equal, lo > equal) {
        (true, _) => Order::Less,
        (_, true) => Order::More,
        _ => Order::NoDifference,
    };
    let same = |&(a, b): &(f64, f64)| (a - b).abs() <= EQUAL * a.abs().max(b.abs());
    if runs > 1 && pairs.iter().all(same) {
        return Paired {
            runs,
            ratio,
            interval: None,
            order: Order::NoDifference,
        };
    }
    let finite = |(lo, hi): &(f64, f64)| lo.is_finite() && hi.is_finite();
    let interval = ratio.and_then(|ratio| {
        let (lo, hi) = paired_mean_offsets(pairs, |x, y| x / y)?;
        Some((ratio + lo, ratio + hi)).filter(finite)
    });
    let order = match (interval, ratio) {
        (Some((lo, hi)), _) => decided(lo, hi, 1.0),
        (None, Some(_)) => Order::Undecided,
        (None, None) => {
            let differences = of(|p| p.0 - p.1);
            let offsets = mean_offsets(&differences).filter(finite);
            offsets.map_or(Order::Undecided, |(lo, hi)| {
                let difference = mean(&differences);
                decided(difference + lo, difference + hi, 0.0)
            })
        }
    };
    Paired {
        runs,
        ratio,
        interval,
        order,
    }
}

/// Two estimators compared by one metric of one experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The paper.
    pub paper: String,
    /// The experiment.
    pub experiment: String,
    /// The metric.
    pub metric: String,
    /// The state component, of a metric that has one for each.
    pub component: Option<String>,
    /// The estimator that each step's value was divided by.
    pub over: Option<String>,
    /// The first estimator.
    pub estimator: String,
    /// The second.
    pub than: String,
    /// Runs in which both have a value.
    pub runs: usize,
    /// The mean of the first over that of the second.
    pub ratio: Option<f64>,
    /// The lower end of its 99 % interval.
    pub lo: Option<f64>,
    /// The upper end.
    pub hi: Option<f64>,
    /// What follows for the first.
    pub verdict: Order,
}

/// The estimators of one metric of one experiment, ranked, and the comparisons that say so.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// `paper/experiment`.
    pub name: String,
    /// `metric`, with component and reference.
    pub subject: String,
    /// Rank and estimator, ascending: one more than the number of estimators that are less than it.
    pub ranks: Vec<(usize, String)>,
    /// Every pair once, in the order of the file.
    pub pairs: Vec<Comparison>,
}

/// What to compare.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// `PAPER`, `PAPER/EXPERIMENT` or `EXPERIMENT`; all where there are none.
    pub experiments: Vec<String>,
    /// Only these metrics; all where there are none.
    pub metrics: Vec<String>,
    /// Only comparisons with this estimator.
    pub against: Option<String>,
}

/// Every ranking that is wanted, from the table `metrics` of the lake.
///
/// Fails where an experiment, a metric or an estimator that is asked for is not there.
pub fn rankings(lake: &Path, wanted: &Wanted) -> Result<Vec<Ranking>, Error> {
    let entries = read_manifest(lake)?;
    let mut files: Vec<(String, String, std::path::PathBuf)> = Vec::new();
    for path in files_of(lake, &entries, "metrics") {
        let below = path
            .strip_prefix(lake)
            .unwrap_or(&path)
            .to_string_lossy()
            .into_owned();
        let keys = path_keys(&below);
        if let (Some(paper), Some(experiment)) = (keys.paper, keys.experiment) {
            files.push((paper.to_owned(), experiment.to_owned(), path.clone()));
        }
    }
    files.sort();
    let is = |ask: &str, paper: &str, experiment: &str| {
        ask == paper || ask == experiment || ask.split_once('/') == Some((paper, experiment))
    };
    for ask in &wanted.experiments {
        if !files
            .iter()
            .any(|(paper, experiment, _)| is(ask, paper, experiment))
        {
            let known: Vec<String> = files.iter().map(|(p, e, _)| format!("{p}/{e}")).collect();
            return Err(unknown("experiment with metrics", ask, &known));
        }
    }
    files.retain(|(paper, experiment, _)| {
        wanted.experiments.is_empty()
            || wanted
                .experiments
                .iter()
                .any(|ask| is(ask, paper, experiment))
    });
    let (mut metrics, mut estimators) = (BTreeSet::new(), BTreeSet::new());
    let mut all = Vec::new();
    for (paper, experiment, path) in files {
        let rows = table::read::<Metric>(&path)?;
        metrics.extend(rows.iter().map(|r| r.metric.to_string()));
        estimators.extend(rows.iter().map(|r| r.estimator.to_string()));
        all.extend(of_experiment(&paper, &experiment, &rows, wanted));
    }
    for ask in &wanted.metrics {
        if !metrics.contains(ask) {
            return Err(unknown("metric", ask, &Vec::from_iter(metrics)));
        }
    }
    if let Some(ask) = wanted
        .against
        .as_ref()
        .filter(|ask| !estimators.contains(*ask))
    {
        return Err(unknown("estimator", ask, &Vec::from_iter(estimators)));
    }
    Ok(all)
}

fn unknown(what: &'static str, got: &str, known: &[String]) -> Error {
    Error::Unknown {
        what,
        got: got.to_owned(),
        expected: match known {
            [] => "one that the lake holds; it holds none".to_owned(),
            known => known.join(", "),
        },
    }
}

/// The values of one estimator by run.
type Values = Vec<(i32, f64)>;

/// The rankings of one experiment, in the order of its metrics.
fn of_experiment(paper: &str, experiment: &str, rows: &[Metric], wanted: &Wanted) -> Vec<Ranking> {
    type Subject = (String, Option<String>, Option<String>);
    let mut groups: Vec<(Subject, Vec<(String, Values)>)> = Vec::new();
    let names: BTreeSet<&str> = rows.iter().map(|r| &*r.metric).collect();
    // The bounds beside nees and nis are the same for all.
    let is_bound = |metric: &str| {
        let whole = metric.strip_suffix("_lo").or(metric.strip_suffix("_hi"));
        whole.is_some_and(|whole| names.contains(whole))
    };
    let text = |name: &Option<table::Name>| name.as_ref().map(|n| n.to_string());
    for row in rows {
        let asked = wanted.metrics.is_empty() || wanted.metrics.iter().any(|m| **m == *row.metric);
        if !asked || is_bound(&row.metric) {
            continue;
        }
        let subject = (
            row.metric.to_string(),
            text(&row.component),
            text(&row.over),
        );
        let place = groups.iter().position(|(s, _)| *s == subject);
        let place = place.unwrap_or_else(|| {
            groups.push((subject, Vec::new()));
            groups.len() - 1
        });
        let group = &mut groups[place].1;
        if group
            .last()
            .is_none_or(|(last, _)| **last != *row.estimator)
        {
            group.push((row.estimator.to_string(), Vec::new()));
        }
        let (_, values) = group.last_mut().expect("it was pushed");
        values.extend(row.value.map(|value| (row.run, value)));
    }
    let compared = |((metric, component, over), group): (Subject, Vec<(String, Values)>)| {
        let mut pairs = Vec::new();
        let mut less = vec![0; group.len()];
        for (i, (first, a)) in group.iter().enumerate() {
            for (j, (second, b)) in group.iter().enumerate().skip(i + 1) {
                if (wanted.against.as_ref()).is_some_and(|one| one != first && one != second) {
                    continue;
                }
                // With a reference, it is what the others are compared with.
                let swapped = wanted.against.as_ref() == Some(first);
                let both = match swapped {
                    true => paired(&joined(b, a)),
                    false => paired(&joined(a, b)),
                };
                let greater = match (both.order, swapped) {
                    (Order::Less, false) | (Order::More, true) => Some(j),
                    (Order::More, false) | (Order::Less, true) => Some(i),
                    _ => None,
                };
                greater.into_iter().for_each(|place| less[place] += 1);
                let (estimator, than) = if swapped {
                    (second, first)
                } else {
                    (first, second)
                };
                pairs.push(Comparison {
                    paper: paper.to_owned(),
                    experiment: experiment.to_owned(),
                    metric: metric.clone(),
                    component: component.clone(),
                    over: over.clone(),
                    estimator: estimator.clone(),
                    than: than.clone(),
                    runs: both.runs,
                    ratio: both.ratio,
                    lo: both.interval.map(|(lo, _)| lo),
                    hi: both.interval.map(|(_, hi)| hi),
                    verdict: both.order,
                });
            }
        }
        let mut ranks: Vec<(usize, String)> = (less.iter().zip(&group))
            .map(|(less, (id, _))| (less + 1, id.clone()))
            .collect();
        ranks.sort_by_key(|(rank, _)| *rank);
        let component = component.map_or_else(String::new, |c| format!(" of {c}"));
        let over = over.map_or_else(String::new, |o| format!(" over {o}"));
        Ranking {
            name: format!("{paper}/{experiment}"),
            subject: format!("{metric}{component}{over}"),
            ranks,
            pairs,
        }
    };
    let all = groups.into_iter().map(compared);
    all.filter(|ranking| !ranking.pairs.is_empty()).collect()
}

/// The values of the runs that both have.
fn joined(a: &Values, b: &Values) -> Vec<(f64, f64)> {
    let mut b = b.iter().peekable();
    let mut pairs = Vec::new();
    for (run, x) in a {
        while b.next_if(|(other, _)| other < run).is_some() {}
        if let Some((_, y)) = b.next_if(|(other, _)| other == run) {
            pairs.push((*x, *y));
        }
    }
    pairs
}

/// Rankings for reading: the ranks of each metric, and the pairs below.
pub fn text(rankings: &[Ranking]) -> String {
    let mut out = String::new();
    let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.4}"));
    for ranking in rankings {
        let _ = writeln!(out, "{}: {}", ranking.name, ranking.subject);
        let ranks = ranking
            .ranks
            .iter()
            .map(|(rank, id)| format!("{rank}. {id}"));
        let _ = writeln!(out, "  {}", ranks.collect::<Vec<_>>().join("   "));
        let rows: Vec<[String; 6]> = ranking
            .pairs
            .iter()
            .map(|p| {
                [
                    p.estimator.clone(),
                    p.than.clone(),
                    number(p.ratio),
                    match (p.lo, p.hi) {
                        (Some(lo), Some(hi)) => format!("[{lo:.4}, {hi:.4}]"),
                        _ => "-".to_owned(),
                    },
                    p.verdict.name().to_owned(),
                    p.runs.to_string(),
                ]
            })
            .collect();
        let header = [
            "estimator",
            "than",
            "ratio",
            "99 % interval",
            "verdict",
            "runs",
        ];
        let header = header.map(str::to_owned);
        let width = |i: usize| {
            let rows = rows.iter().chain([&header]);
            rows.map(|r| r[i].chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..6).map(width).collect();
        for row in [&header].into_iter().chain(&rows) {
            let cells = row
                .iter()
                .zip(&widths)
                .map(|(cell, &width)| format!("{cell:width$}"));
            let _ = writeln!(out, "  {}", cells.collect::<Vec<_>>().join("  ").trim_end());
        }
        out.push('\n');
    }
    out
}

/// One row a pair, as CSV.
pub fn csv(rankings: &[Ranking]) -> String {
    let mut csv = csv::Writer::from_writer(Vec::new());
    for pair in rankings.iter().flat_map(|r| &r.pairs) {
        csv.serialize(pair)
            .expect("a row of texts and numbers has a CSV form");
    }
    let bytes = csv.into_inner().expect("writing to memory does not fail");
    String::from_utf8(bytes).expect("names are UTF-8")
}

/// One object a pair, as a JSON array.
pub fn json(rankings: &[Ranking]) -> String {
    let pairs: Vec<&Comparison> = rankings.iter().flat_map(|r| &r.pairs).collect();
    serde_json::to_string_pretty(&pairs).expect("texts and numbers have a JSON form") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number in (0, 1) that looks random.
    fn noise(i: usize) -> f64 {
        let x = libm::sin(i as f64 * 12.9898) * 43_758.547;
        x - x.floor()
    }

    #[test]
    fn pairs_see_what_bare_means_do_not() {
        // Runs differ by a factor of ten, the methods by 2 % in each run.
        let pairs: Vec<(f64, f64)> = (0..50)
            .map(|i| {
                let hard = 1.0 + 9.0 * noise(i);
                (0.98 * hard * (1.0 + 0.01 * noise(i + 1000)), hard)
            })
            .collect();
        let found = paired(&pairs);
        assert_eq!(found.order, Order::Less);
        let (lo, hi) = found.interval.unwrap();
        assert!(lo < found.ratio.unwrap() && found.ratio.unwrap() < hi && hi < 1.0);
        // The interval of either mean alone is twenty times as long.
        let (low, high) = mean_offsets(&pairs.iter().map(|p| p.1).collect::<Vec<_>>()).unwrap();
        assert!((high - low) / 5.5 > 20.0 * (hi - lo));
        let turned: Vec<(f64, f64)> = pairs.iter().map(|&(a, b)| (b, a)).collect();
        assert_eq!(paired(&turned).order, Order::More);
    }

    #[test]
    fn means_that_differ_by_chance_are_no_difference() {
        let pairs: Vec<(f64, f64)> = (0..40)
            .map(|i| (1.0 + noise(i), 1.0 + noise(i + 500)))
            .collect();
        let found = paired(&pairs);
        assert_ne!(found.ratio, Some(1.0));
        assert_eq!(found.order, Order::NoDifference);
    }

    #[test]
    fn what_has_no_spread_decides_nothing_unless_it_is_equal() {
        assert_eq!(paired(&[(1.0, 2.0)]).order, Order::Undecided);
        assert_eq!(paired(&[(1.0, 2.0); 5]).order, Order::Undecided);
        assert_eq!(paired(&[(2.0, 2.0); 5]).order, Order::NoDifference);
        assert_eq!(paired(&[(0.0, 0.0); 5]).order, Order::NoDifference);
        let rounded: Vec<(f64, f64)> = (0..30)
            .map(|i| (noise(i), noise(i) * (1.0 + 1e-12 * noise(i + 9))))
            .collect();
        assert_eq!(paired(&rounded).order, Order::NoDifference);
        assert_eq!(paired(&[]).order, Order::Undecided);
    }

    #[test]
    fn a_mean_of_zero_is_compared_by_differences() {
        let pairs: Vec<(f64, f64)> = (0..40).map(|i| (0.0, 1.0 + noise(i))).collect();
        let found = paired(&pairs);
        assert_eq!((found.ratio, found.order), (None, Order::Less));
    }

    fn rows(values: &[(&str, f64)]) -> Vec<Metric> {
        let row = |id: &str, run: usize, value: Option<f64>| Metric {
            estimator: id.into(),
            run: run as i32,
            metric: "rmse".into(),
            component: Some("x1".into()),
            over: None,
            value,
        };
        let all = values.iter().flat_map(|&(id, size)| {
            (0..30).map(move |run| {
                // What all share, and a twentieth of each one's own; the last run of the second has no value.
                let own = noise(run + 100 * usize::from(id.as_bytes()[0]));
                let there = !(id == "b" && run == 29);
                row(
                    id,
                    run,
                    there.then(|| size * (1.0 + noise(run) + 0.05 * own)),
                )
            })
        });
        all.collect()
    }

    #[test]
    fn a_rank_counts_those_that_are_less_for_certain() {
        let rows = rows(&[("a", 1.0), ("b", 1.0), ("c", 0.5)]);
        let all = of_experiment("p", "e", &rows, &Wanted::default());
        assert_eq!(all.len(), 1);
        let ranks = [
            (1, "c".to_owned()),
            (2, "a".to_owned()),
            (2, "b".to_owned()),
        ];
        assert_eq!(all[0].ranks, ranks);
        let runs: Vec<usize> = all[0].pairs.iter().map(|p| p.runs).collect();
        assert_eq!(runs, [29, 30, 29]);
        let text = text(&all);
        assert!(
            text.starts_with("p/e: rmse of x1\n  1. c   2. a   2. b\n"),
            "{text}"
        );
        let against = Wanted {
            against: Some("a".into()),
            ..Wanted::default()
        };
        let all = of_experiment("p", "e", &rows, &against);
        let pairs: Vec<(&str, &str)> = all[0]
            .pairs
            .iter()
            .map(|p| (&*p.estimator, &*p.than))
            .collect();
        assert_eq!(pairs, [("b", "a"), ("c", "a")]);
        assert!(csv(&all).starts_with(
            "paper,experiment,metric,component,over,estimator,than,runs,ratio,lo,hi,verdict\n"
        ));
        let json: serde_json::Value = serde_json::from_str(&json(&all)).unwrap();
        assert_eq!(json[1]["verdict"], "less");
        assert_eq!(json[0]["over"], serde_json::Value::Null);
    }

    #[test]
    fn bounds_beside_a_metric_are_not_ranked() {
        let mut all = rows(&[("a", 1.0), ("b", 2.0)]);
        let bounds: Vec<Metric> = (all.iter().cloned())
            .map(|m| Metric {
                metric: "rmse_lo".into(),
                ..m
            })
            .collect();
        all.extend(bounds);
        assert_eq!(of_experiment("p", "e", &all, &Wanted::default()).len(), 1);
    }
}
