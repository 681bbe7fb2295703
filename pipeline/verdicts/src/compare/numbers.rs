//! Reproduced numbers: what a cell is mapped to, with its spread, and the verdict on a printed number.

use super::interval;
use super::parameter::parameter;
use super::{Results, Row};
use crate::published::{Cell, Comparand, Kind, Pair, Published, Score, Tolerance, half_unit};
use crate::statistics::{
    mean_offsets, mean_sd, paired_mean_offsets, paired_offsets, prediction_offsets,
};
use crate::verdict::Verdict;
use std::cmp::Reverse;
use zonobench_lake::digits::four_digits;

/// A reproduced number with its spread.
pub struct Number {
    /// The number itself: of the mean over the runs.
    pub value: f64,
    /// What each run gives by itself.
    pub of_runs: Vec<f64>,
    /// Where a paper's number over its own runs lies with 99 %, relative to ours.
    pub prediction: (f64, f64),
    /// Where the true mean lies with 99 %, relative to ours; None where there is no spread to tell.
    pub mean: Option<(f64, f64)>,
    /// The standard deviation of a run.
    pub sd: Option<f64>,
    /// Whose spread the prediction is of, if not of these runs.
    pub spread: Option<String>,
}

impl Number {
    fn exactly(value: f64) -> Self {
        Self {
            value,
            of_runs: vec![value],
            prediction: (0.0, 0.0),
            mean: None,
            sd: None,
            spread: None,
        }
    }

    /// The mean of `values`, where the paper's is one of `runs` and ours of `ours`.
    fn of_mean(values: Vec<f64>, runs: usize, ours: Option<usize>) -> Option<Self> {
        let (value, sd) = mean_sd(&values)?;
        Some(Self {
            value,
            prediction: prediction_offsets(&values, runs, ours.unwrap_or(values.len())),
            mean: mean_offsets(&values),
            sd: (values.len() > 1).then_some(sd),
            of_runs: values,
            spread: None,
        })
    }

    /// `statistic` of the means of `pairs`.
    fn of_pairs(
        pairs: &[(f64, f64)],
        runs: usize,
        ours: Option<usize>,
        statistic: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let n = pairs.len() as f64;
        let (a, b) = (pairs.iter()).fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
        Self {
            value: statistic(a / n, b / n),
            of_runs: pairs.iter().map(|(x, y)| statistic(*x, *y)).collect(),
            prediction: paired_offsets(pairs, runs, ours.unwrap_or(pairs.len()), &statistic),
            mean: paired_mean_offsets(pairs, &statistic),
            sd: None,
            spread: None,
        }
    }

    /// Our runs.
    pub fn n(&self) -> usize {
        self.of_runs.len()
    }

    /// Where a repetition of the paper's experiment would print its number.
    fn interval(&self, p: &Published) -> Option<(f64, f64)> {
        let half = half_unit(&p.printed);
        (p.kind == Kind::MonteCarlo).then_some((
            self.value + self.prediction.0 - half,
            self.value + self.prediction.1 + half,
        ))
    }
}

impl Results<'_> {
    /// The values over runs; of several experiments their mean, run by run.
    pub(super) fn values(&self, score: &Score) -> Option<Vec<f64>> {
        let of = |experiment: &String| {
            let held = self.scores.get(experiment)?;
            let found = held.iter().find(|((e, m, c, over), _)| {
                let over = over.as_deref().unwrap_or("");
                (score.over.is_empty() || *score.over == *over)
                    && **e == *score.estimator
                    && **m == *score.metric
                    && c.as_deref().unwrap_or("") == score.component
            });
            found.map(|(_, values)| values)
        };
        let all: Vec<&Vec<f64>> = score.experiments.iter().map(of).collect::<Option<_>>()?;
        let runs = all.first()?.len();
        if runs == 0 || all.iter().any(|values| values.len() != runs) {
            return None;
        }
        let mean =
            |run: usize| all.iter().map(|values| values[run]).sum::<f64>() / all.len() as f64;
        Some((0..runs).map(mean).collect())
    }

    /// What is mapped to the cell, its prediction for our mean over `ours` runs, all there are unless given; None where
    /// there is no such result, or none that is a number.
    pub(super) fn number(&self, p: &Published, cell: &Cell, ours: Option<usize>) -> Option<Number> {
        let runs = p.runs.unwrap_or(1);
        let pairs = |pair: &Pair, statistic: &dyn Fn(f64, f64) -> f64| {
            let pairs = self.pairs(pair)?;
            Some(Number::of_pairs(&pairs, runs, ours, statistic))
        };
        match &cell.comparand {
            Comparand::Metric(score) => Number::of_mean(self.values(score)?, runs, ours),
            Comparand::Ratio(pair) => pairs(pair, &|x, y| x / y),
            Comparand::Percent(pair) => pairs(pair, &|x, y| 100.0 * (x / y)),
            Comparand::Drop(pair) => pairs(pair, &|x, y| 100.0 - 100.0 * (x / y)),
            Comparand::Wins(pair) => {
                let won = |(x, y): &(f64, f64)| f64::from(u8::from(x < y));
                let wins = self.pairs(pair)?.iter().map(won).collect();
                Number::of_mean(wins, runs, ours)
            }
            Comparand::Gain(pair, than) => {
                let there = Pair {
                    of: Score {
                        experiments: than.clone(),
                        ..pair.of.clone()
                    },
                    ..pair.clone()
                };
                let (here, there) = (self.pairs(pair)?, self.pairs(&there)?);
                if here.len() != there.len() {
                    return None;
                }
                let below = |(x, y): &(f64, f64)| y - x;
                let gains = here.iter().zip(&there).map(|(a, b)| below(a) - below(b));
                Number::of_mean(gains.collect(), runs, ours)
            }
            Comparand::Parameter { experiment, path } => {
                let text = self.paper.text(experiment)?;
                parameter(text, path).ok().map(Number::exactly)
            }
            Comparand::Timing { .. } | Comparand::Complexity(_) | Comparand::Claims(_) => None,
        }
    }

    /// The two scores of a pair, run by run.
    fn pairs(&self, pair: &Pair) -> Option<Vec<(f64, f64)>> {
        let a = self.values(&pair.of)?;
        let over = Score {
            estimator: pair.over.clone(),
            metric: pair.over_metric.clone(),
            ..pair.of.clone()
        };
        let b = match self.values(&over) {
            Some(b) => b,
            None if self.is_over(&over) => vec![1.0; a.len()],
            None => return None,
        };
        (a.len() == b.len()).then(|| a.into_iter().zip(b).collect())
    }

    /// Whether the metric is itself a ratio to this estimator in all of the experiments: then the estimator's
    /// own, which is not kept, is 1.
    fn is_over(&self, over: &Score) -> bool {
        over.experiments.iter().all(|id| {
            let found = self.paper.experiments.iter().find(|e| e.id == *id);
            found.is_some_and(|e| {
                let spec = e.metrics.iter().find(|m| m.id == over.metric);
                spec.is_some_and(|m| m.over.as_deref() == Some(&over.estimator))
            })
        })
    }

    /// The spread for a number of one run, which has none: that of the other reading of the cell with the most runs, the
    /// first of equals, as offsets of what one run gives.
    fn lent(&self, p: &Published, cell: &Cell) -> Option<((f64, f64), String)> {
        let others = (self.paper.cells.iter()).filter(|c| p.is(c) && c.reading != cell.reading);
        let numbers = others.filter_map(|c| Some((c, self.number(p, c, Some(1))?)));
        let most = numbers
            .filter(|(_, number)| number.n() > 1)
            .min_by_key(|(_, number)| Reverse(number.n()));
        most.map(|(c, number)| {
            let spread = format!(
                "the spread of {} runs of the reading {}",
                number.n(),
                c.reading
            );
            (number.prediction, spread)
        })
    }

    /// A printed number beside ours.
    pub(super) fn compared(&self, p: &Published, cell: &Cell, mut number: Number) -> Row {
        if number.n() == 1
            && p.kind == Kind::MonteCarlo
            && let Some((offsets, spread)) = self.lent(p, cell)
        {
            (number.prediction, number.spread) = (offsets, Some(spread));
        }
        let ours = number.value;
        let bounds = number.interval(p);
        let plain = verdict(p, ours, bounds);
        let verdict = cell.finding.on(plain);
        let rel_diff = (p.value().filter(|v| *v != 0.0)).map(|v| (ours - v) / v);
        let reason = if cell.finding.is_shown(verdict) {
            self.fill(p, cell, &number, bounds, rel_diff)
        } else {
            reason(plain, p, &number, bounds)
        };
        Row {
            reproduced: Some(ours),
            interval: bounds,
            rel_diff,
            ..Row::of(p, &cell.reading, verdict, reason)
        }
    }
}

/// What a number is called beside the printed one.
fn verdict(p: &Published, ours: f64, bounds: Option<(f64, f64)>) -> Verdict {
    let Some(printed) = p.value() else {
        return Verdict::LostInSource;
    };
    // One rounding of the decimal on either side.
    let rounding = half_unit(&p.printed) * (1.0 + 1e-12);
    match p.kind {
        Kind::Exact if ours == printed => Verdict::Exact,
        Kind::Rounded if (ours - printed).abs() <= rounding => Verdict::WithinRounding,
        _ if bounds.is_some_and(|(lo, hi)| lo <= printed && printed <= hi) => Verdict::WithinCi,
        _ => match p.tolerance {
            Tolerance::Within(t) if (ours - printed).abs() <= t => Verdict::WithinTolerance,
            _ => Verdict::Differs,
        },
    }
}

/// The reason of a verdict on a number, where no finding says it.
fn reason(verdict: Verdict, p: &Published, number: &Number, bounds: Option<(f64, f64)>) -> String {
    let ours = four_digits(number.value);
    let over = match &number.spread {
        Some(spread) => format!("one run, with {spread}"),
        None => format!("{} runs", number.n()),
    };
    match (verdict, bounds, p.tolerance) {
        (Verdict::Exact, ..) => "the same number".to_owned(),
        (Verdict::WithinRounding, ..) => format!("{ours} rounds to it"),
        (Verdict::WithinTolerance, _, Tolerance::Within(t)) => {
            format!("{ours}, within {t} of it: {}", p.reason)
        }
        (Verdict::WithinCi, Some((lo, hi)), _) => format!(
            "{ours} over {over}: a mean of {} runs lies in {} with 99 %",
            p.runs.unwrap_or(1),
            interval(lo, hi)
        ),
        (Verdict::LostInSource, ..) => format!("the printed value is lost; ours is {ours}"),
        (_, Some((lo, hi)), _) => format!(
            "{ours} over {over}; the printed number is not in {}",
            interval(lo, hi)
        ),
        _ => format!("{ours} against {}", p.printed),
    }
}
