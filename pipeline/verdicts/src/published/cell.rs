//! A row of `cells.csv`: under one reading of the paper, what a printed number or claim is compared with.

use super::finding::Finding;
use crate::verdict::one_of;
use std::fmt;

/// Which reading of the paper.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Its equations, with the corrections that its README lists; the only one that is counted.
    AsWritten,
    /// Another one, by its name.
    Named(String),
}

impl Reading {
    /// From its name.
    pub fn of(name: &str) -> Self {
        match name {
            "as-written" => Self::AsWritten,
            name => Self::Named(name.to_owned()),
        }
    }

    /// Its name in the lake.
    pub fn name(&self) -> &str {
        match self {
            Self::AsWritten => "as-written",
            Self::Named(name) => name,
        }
    }

    /// Whether it is the paper as written.
    pub fn is_as_written(&self) -> bool {
        *self == Self::AsWritten
    }
}

impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A score: a metric of an estimator, averaged over several experiments run by run.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Experiment ids.
    pub experiments: Vec<String>,
    /// Estimator id.
    pub estimator: String,
    /// The metric's `id`.
    pub metric: String,
    /// Component; empty for a metric that has none.
    pub component: String,
    /// Which estimator the metric itself compares with; empty for whichever it is.
    pub over: String,
}

impl Score {
    /// From `EXPERIMENT:ESTIMATOR:METRIC[:COMPONENT]`; the experiment `.` stands for those of the cell.
    pub fn of_place(text: &str) -> Option<Self> {
        let parts: Vec<&str> = text.split(':').collect();
        let (&[experiment, estimator, metric], component) = match &parts[..] {
            [.., component] if parts.len() == 4 => (parts.first_chunk()?, *component),
            _ if parts.len() == 3 => (parts.first_chunk()?, ""),
            _ => return None,
        };
        let experiments = match experiment {
            "." => Vec::new(),
            one => vec![one.to_owned()],
        };
        (!estimator.is_empty() && !metric.is_empty()).then(|| Self {
            experiments,
            estimator: estimator.to_owned(),
            metric: metric.to_owned(),
            component: component.to_owned(),
            over: String::new(),
        })
    }
}

/// A score beside that of another estimator in the same experiments and component.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// The score.
    pub of: Score,
    /// The other estimator.
    pub over: String,
    /// Its metric.
    pub over_metric: String,
}

/// A part of a step whose time is told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// From x_{k−1} to x_k.
    Predict,
    /// With y_k.
    Update,
    /// Reducing generators and constraints, within either.
    Reduce,
}

impl Phase {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Predict, Self::Update, Self::Reduce];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Predict => "predict",
            Self::Update => "update",
            Self::Reduce => "reduce",
        }
    }

    /// The phase of that name. Fails with what there is.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|p| p.name() == name);
        found.ok_or_else(|| one_of(name, &Self::ALL.map(Self::name)))
    }
}

/// The mean time of a step, or of one part of it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Time {
    /// Experiment ids: the mean of their times.
    pub experiments: Vec<String>,
    /// Estimator id.
    pub estimator: String,
    /// The part of a step; None for all of it.
    pub phase: Option<Phase>,
}

/// What a printed number or claim is compared with.
#[derive(Clone, Debug, PartialEq)]
pub enum Comparand {
    /// `M`: a score.
    Metric(Score),
    /// `ratio(M)`: a score over another.
    Ratio(Pair),
    /// `percent(M)`: 100 times the ratio.
    Percent(Pair),
    /// `drop(M)`: 100 less that.
    Drop(Pair),
    /// `wins(M)`: the share of runs in which the score is below the other.
    Wins(Pair),
    /// `gain(M)`: by how much more the score is below the other than it is in other experiments.
    Gain(Pair, Vec<String>),
    /// `parameter`: what an experiment's file holds at a path.
    Parameter {
        /// Experiment id.
        experiment: String,
        /// Keys joined by dots, `[i]` from 0.
        path: String,
    },
    /// `timing`: a time, or its ratio to another.
    Timing {
        /// The time.
        of: Time,
        /// What it is divided by.
        over: Option<Time>,
    },
    /// `complexity`: the verdict of a claim about cost.
    Complexity(String),
    /// `claims`: the verdict of a claim of the ledger.
    Claims(String),
}

/// The columns of `cells.csv` that say what a cell is compared with, in their order.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    /// Experiment ids joined by `+`.
    pub experiment: &'a str,
    /// Estimator id.
    pub estimator: &'a str,
    /// Metric, a derived one, or what else is compared.
    pub metric: &'a str,
    /// Component, path, phase, or the name of a claim.
    pub component: &'a str,
    /// The estimator compared with.
    pub over: &'a str,
}

/// What was expected, and what came.
type Wrong = (String, String);

fn wrong<T>(expected: &str, got: impl fmt::Debug) -> Result<T, Wrong> {
    Err((expected.to_owned(), format!("{got:?}")))
}

fn filled(what: &str, text: &str) -> Result<String, Wrong> {
    match text {
        "" => wrong(what, text),
        text => Ok(text.to_owned()),
    }
}

fn empty(what: &str, text: &str) -> Result<(), Wrong> {
    match text {
        "" => Ok(()),
        text => wrong(&format!("nothing in the column {what}"), text),
    }
}

impl Comparand {
    /// Parses the columns. Fails with what was expected and what came.
    pub fn parse(columns: Columns<'_>) -> Result<Self, Wrong> {
        let Columns {
            experiment,
            estimator,
            metric,
            component,
            over,
        } = columns;
        match metric {
            "complexity" | "claims" => {
                empty("experiment", experiment)?;
                empty("estimator", estimator)?;
                empty("over", over)?;
                let claim = filled("the name of a claim in the column component", component)?;
                Ok(match metric {
                    "claims" => Self::Claims(claim),
                    _ => Self::Complexity(claim),
                })
            }
            "parameter" => {
                empty("estimator", estimator)?;
                empty("over", over)?;
                Ok(Self::Parameter {
                    experiment: filled("an experiment", experiment)?,
                    path: filled("a path in the column component", component)?,
                })
            }
            "timing" => Self::timing(columns),
            "" => wrong("a metric", metric),
            _ => Self::number(columns),
        }
    }

    fn timing(columns: Columns<'_>) -> Result<Self, Wrong> {
        let phase = |text: &str| match text {
            "" => Ok(None),
            text => Phase::parse(text)
                .map(Some)
                .map_err(|expected| (format!("a part of a step: {expected}"), format!("{text:?}"))),
        };
        let of = Time {
            experiments: experiments(columns.experiment)?,
            estimator: filled("an estimator", columns.estimator)?,
            phase: phase(columns.component)?,
        };
        if columns.over.is_empty() {
            return Ok(Self::Timing { of, over: None });
        }
        let (elsewhere, rest) = match columns.over.split_once('/') {
            Some((elsewhere, rest)) => (experiments(elsewhere)?, rest),
            None => (of.experiments.clone(), columns.over),
        };
        let (estimator, part) = rest.split_once(':').unwrap_or((rest, ""));
        let over = Time {
            experiments: elsewhere,
            estimator: filled("an estimator in the column over", estimator)?,
            phase: match part {
                // A part is compared with the same part, if nothing else is said.
                "" => of.phase,
                "step" => None,
                part => phase(part)?,
            },
        };
        Ok(Self::Timing {
            of,
            over: Some(over),
        })
    }

    fn number(columns: Columns<'_>) -> Result<Self, Wrong> {
        let derived = columns.metric.split_once('(');
        let metric = match derived {
            None => columns.metric,
            Some((_, inside)) => match inside.strip_suffix(')') {
                Some(metric) if !metric.is_empty() => metric,
                _ => return wrong("a metric in brackets, such as ratio(rmse)", columns.metric),
            },
        };
        let of = Score {
            experiments: experiments(columns.experiment)?,
            estimator: filled("an estimator", columns.estimator)?,
            metric: metric.to_owned(),
            component: columns.component.to_owned(),
            over: String::new(),
        };
        let Some((derived, _)) = derived else {
            let over = columns.over.to_owned();
            return Ok(Self::Metric(Score { over, ..of }));
        };
        let make: fn(Pair, Vec<String>) -> Self = match derived {
            "ratio" => |pair, _| Self::Ratio(pair),
            "percent" => |pair, _| Self::Percent(pair),
            "drop" => |pair, _| Self::Drop(pair),
            "wins" => |pair, _| Self::Wins(pair),
            "gain" => Self::Gain,
            other => {
                let expected = one_of(other, &["ratio", "percent", "drop", "wins", "gain"]);
                return wrong(&format!("{expected} before the bracket"), other);
            }
        };
        let (than, over) = match columns.over.split_once('/') {
            Some((than, over)) if derived == "gain" => (experiments(than)?, over),
            None if derived == "gain" => {
                return wrong("EXPERIMENT/ESTIMATOR in the column over", columns.over);
            }
            _ => (Vec::new(), columns.over),
        };
        let (over, over_metric) = over.split_once(':').unwrap_or((over, metric));
        let pair = Pair {
            over: filled("an estimator in the column over", over)?,
            over_metric: filled("a metric after the colon", over_metric)?,
            of,
        };
        Ok(make(pair, than))
    }

    /// What the column `metric` calls it; of a score the word before its bracket, if any.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Metric(_) => "a score",
            Self::Ratio(_) => "ratio",
            Self::Percent(_) => "percent",
            Self::Drop(_) => "drop",
            Self::Wins(_) => "wins",
            Self::Gain(..) => "gain",
            Self::Parameter { .. } => "parameter",
            Self::Timing { .. } => "timing",
            Self::Complexity(_) => "complexity",
            Self::Claims(_) => "claims",
        }
    }

    /// Whether it is a number that was computed.
    pub fn is_score(&self) -> bool {
        matches!(self, Self::Metric(_)) || self.pair().is_some()
    }

    /// The two scores that it is made of, if it is made of two.
    pub fn pair(&self) -> Option<&Pair> {
        match self {
            Self::Ratio(pair) | Self::Percent(pair) | Self::Drop(pair) | Self::Wins(pair) => {
                Some(pair)
            }
            Self::Gain(pair, _) => Some(pair),
            _ => None,
        }
    }

    /// The experiments that it is of; none for what is of no experiment.
    pub fn experiments(&self) -> &[String] {
        match self {
            Self::Metric(score) => &score.experiments,
            Self::Ratio(pair) | Self::Percent(pair) | Self::Drop(pair) | Self::Wins(pair) => {
                &pair.of.experiments
            }
            Self::Gain(pair, _) => &pair.of.experiments,
            Self::Parameter { experiment, .. } => std::slice::from_ref(experiment),
            Self::Timing { of, .. } => &of.experiments,
            Self::Complexity(_) | Self::Claims(_) => &[],
        }
    }

    /// Where it is found, as (name, text) of the columns that say so.
    pub fn labels(&self) -> Vec<(&'static str, String)> {
        let score = |score: &Score, metric: String| {
            vec![
                ("estimator", score.estimator.clone()),
                ("metric", metric),
                ("component", score.component.clone()),
            ]
        };
        let pair = |name: &str, pair: &Pair| {
            let mut labels = score(&pair.of, format!("{name}({})", pair.of.metric));
            let over = match pair.over_metric == pair.of.metric {
                true => pair.over.clone(),
                false => format!("{}:{}", pair.over, pair.over_metric),
            };
            labels.push(("over", over));
            labels
        };
        let mut labels = match self {
            Self::Metric(of) => {
                let mut labels = score(of, of.metric.clone());
                labels.push(("over", of.over.clone()));
                labels
            }
            Self::Ratio(of) => pair("ratio", of),
            Self::Percent(of) => pair("percent", of),
            Self::Drop(of) => pair("drop", of),
            Self::Wins(of) => pair("wins", of),
            Self::Gain(of, than) => {
                let mut labels = pair("gain", of);
                labels.push(("than in", than.join("+")));
                labels
            }
            Self::Parameter { path, .. } => vec![("component", path.clone())],
            Self::Timing { of, over } => vec![
                ("estimator", of.estimator.clone()),
                ("component", of.phase.map_or("", Phase::name).to_owned()),
                (
                    "over",
                    over.as_ref().map_or("", |o| &o.estimator).to_owned(),
                ),
            ],
            Self::Complexity(claim) | Self::Claims(claim) => vec![("component", claim.clone())],
        };
        labels.retain(|(_, text)| !text.is_empty());
        labels
    }
}

fn experiments(text: &str) -> Result<Vec<String>, Wrong> {
    let ids: Vec<String> = text.split('+').map(|id| id.trim().to_owned()).collect();
    match ids.iter().all(|id| !id.is_empty()) {
        true => Ok(ids),
        false => wrong("experiments joined by +", text),
    }
}

/// A row of `cells.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Table, figure or section.
    pub table: String,
    /// Row label.
    pub row: String,
    /// Column label.
    pub column: String,
    /// Which reading of the paper.
    pub reading: Reading,
    /// What is compared.
    pub comparand: Comparand,
    /// The reason's text.
    pub finding: Finding,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(columns: [&str; 5]) -> Result<Comparand, Wrong> {
        let [experiment, estimator, metric, component, over] = columns;
        Comparand::parse(Columns {
            experiment,
            estimator,
            metric,
            component,
            over,
        })
    }

    #[test]
    fn what_is_compared_is_read_from_its_columns() {
        let Ok(Comparand::Metric(score)) = parse(["a + b", "f", "rmse", "x1", ""]) else {
            panic!("a score");
        };
        assert_eq!(score.experiments, ["a", "b"]);
        let Ok(Comparand::Drop(pair)) = parse(["a", "f", "drop(rmse)", "", "g:width"]) else {
            panic!("a drop");
        };
        assert_eq!(
            (pair.over.as_str(), pair.over_metric.as_str()),
            ("g", "width")
        );
        assert_eq!(pair.of.metric, "rmse");
        let Ok(Comparand::Gain(pair, than)) = parse(["a", "f", "gain(rmse)", "", "b+c/g"]) else {
            panic!("a gain");
        };
        assert_eq!(
            (pair.over.as_str(), pair.over_metric.as_str()),
            ("g", "rmse")
        );
        assert_eq!(than, ["b", "c"]);
        let (expected, got) = parse(["a", "f", "gain(rmse)", "", "g"]).unwrap_err();
        assert_eq!(
            (expected.as_str(), got.as_str()),
            ("EXPERIMENT/ESTIMATOR in the column over", "\"g\"")
        );
        assert_eq!(
            parse(["", "", "claims", "lemma-1", ""]),
            Ok(Comparand::Claims("lemma-1".to_owned()))
        );
    }

    #[test]
    fn a_time_is_of_a_step_or_of_a_part_of_it() {
        let Ok(Comparand::Timing { of, over }) = parse(["a", "f", "timing", "reduce", "g"]) else {
            panic!("a time");
        };
        assert_eq!(of.phase, Some(Phase::Reduce));
        assert_eq!(over.unwrap().phase, Some(Phase::Reduce));
        let Ok(Comparand::Timing { over, .. }) = parse(["a", "f", "timing", "reduce", "b/f:step"])
        else {
            panic!("a time over another");
        };
        let over = over.unwrap();
        assert_eq!((over.phase, over.experiments), (None, vec!["b".to_owned()]));
        let (expected, _) = parse(["a", "f", "timing", "reduction", ""]).unwrap_err();
        assert!(expected.contains("did you mean reduce?"), "{expected}");
    }

    #[test]
    fn what_does_not_fit_is_told() {
        for (columns, told) in [
            (["a", "f", "ration(rmse)", "", "g"], "did you mean ratio?"),
            (["a", "f", "ratio(rmse", "", "g"], "in brackets"),
            (["a", "f", "ratio(rmse)", "", ""], "in the column over"),
            (["a", "", "rmse", "", ""], "an estimator"),
            (["", "f", "rmse", "", ""], "experiments"),
            (
                ["a", "f", "parameter", "steps", ""],
                "nothing in the column estimator",
            ),
            (["", "", "claims", "", ""], "the name of a claim"),
            (["a", "f", "", "", ""], "a metric"),
        ] {
            let (expected, _) = parse(columns).unwrap_err();
            assert!(expected.contains(told), "{columns:?}: {expected}");
        }
    }
}
