//! score: the metrics over all runs: mean, spread, and a confidence interval of the mean.

use crate::statistics::{mean_sd, student_t};
use serde_json::{Value, json};
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Metric, Score};
use zonobench_lake::table::metadata;
use zonobench_lake::table::{self, Name};

/// What the scores depend on.
pub fn input(metrics: &str) -> Value {
    json!({ "metrics": metrics })
}

/// What a score is the score of: estimator, metric, component, over.
pub type Subject = (Name, Name, Option<Name>, Option<Name>);

/// Groups the metrics by subject, in order of first appearance, with the values in order of run.
pub fn by_subject(metrics: Vec<Metric>) -> Vec<(Subject, Vec<f64>)> {
    let mut groups: Vec<(Subject, Vec<f64>)> = Vec::new();
    let mut places = std::collections::HashMap::new();
    for m in metrics {
        let subject = (m.estimator, m.metric, m.component, m.over);
        let place = *places.entry(subject.clone()).or_insert_with(|| {
            groups.push((subject, Vec::new()));
            groups.len() - 1
        });
        groups[place].1.extend(m.value);
    }
    groups
}

/// Writes `scores.parquet`.
pub fn make(metrics: &Path, dir: &Path) -> Result<(), Error> {
    let scores =
        by_subject(table::read::<Metric>(metrics)?)
            .into_iter()
            .map(|(subject, values)| {
                let (estimator, metric, component, over) = subject;
                let spread = mean_sd(&values);
                let interval = spread.filter(|_| values.len() > 1).map(|(mean, sd)| {
                    let n = values.len();
                    let half = student_t(0.975, n - 1) * sd / (n as f64).sqrt();
                    (mean - half, mean + half)
                });
                Score {
                    estimator,
                    metric,
                    component,
                    over,
                    n_runs: values.len() as i64,
                    mean: spread.map(|(mean, _)| mean),
                    sd: spread.filter(|_| values.len() > 1).map(|(_, sd)| sd),
                    ci_lo: interval.map(|i| i.0),
                    ci_hi: interval.map(|i| i.1),
                }
            });
    table::write(
        &dir.join("scores.parquet"),
        scores,
        &metadata("score", None),
    )?;
    Ok(())
}
