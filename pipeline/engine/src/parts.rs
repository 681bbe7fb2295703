//! How long the parts of a step take: prediction, update, and the reduction within either.
//!
//! The estimate stage times whole steps. Where a paper prints the time of a part, the steps of run 0 are made once more here with a
//! clock around each part, for a quarter of a second, and the part's share of that is its share of the mean step. Times are in no hash;
//! the shares are kept beside the stage's results, so that the same lake is not measured twice.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use zonobench_estimation::track::Data as _;
use zonobench_estimation::{AnyEstimator, Estimator};
use zonobench_lab::experiment::Method;
use zonobench_lab::stage::{Experiment, Recordings};
use zonobench_lake::error::Error;
use zonobench_sets::ops::{Stage, clocked};
use zonobench_verdicts::published::Phase;

/// How long the steps of one estimator are measured, and how many of them at least.
const BUDGET: Duration = Duration::from_millis(250);
const LEAST: usize = 5;

/// The parts' shares of a step.
pub type Shares = BTreeMap<Phase, f64>;

/// The shares of estimator `index`, from `kept` or measured and kept there; `recordings` are read only if need be.
pub fn shares(
    kept: &Path,
    experiment: &Experiment,
    index: usize,
    recordings: impl FnOnce() -> Result<Recordings, Error>,
) -> Result<Shares, Error> {
    let named = |shares: BTreeMap<String, f64>| -> Option<Shares> {
        let phase = |(name, share): (String, f64)| Some((Phase::parse(&name).ok()?, share));
        shares.into_iter().map(phase).collect()
    };
    let text = std::fs::read(kept).ok();
    let found = text.and_then(|text| serde_json::from_slice(&text).ok());
    if let Some(shares) = found.and_then(named) {
        return Ok(shares);
    }
    let shares = measured(experiment, index, &recordings()?)?;
    let names: BTreeMap<&str, f64> = shares.iter().map(|(phase, s)| (phase.name(), *s)).collect();
    let folder = kept.parent().expect("it lies in a folder");
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let text = serde_json::to_vec(&names).expect("names and numbers have a JSON form");
    std::fs::write(kept, text).map_err(|e| Error::io("write", kept, e))?;
    Ok(shares)
}

fn nanoseconds() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_nanos() as u64
}

/// Makes the steps of run 0 with a clock around their parts.
fn measured(
    experiment: &Experiment,
    index: usize,
    recordings: &Recordings,
) -> Result<Shares, Error> {
    let spec = &experiment.estimators[index];
    let failed = |source| Error::Estimator {
        experiment: experiment.name(),
        estimator: spec.id.clone(),
        source: Box::new(source),
    };
    let Method::BuiltIn(settings) = &spec.settings else {
        // A program has no parts to be timed.
        return Ok(Shares::new());
    };
    let estimator = AnyEstimator::new(settings, &spec.problem).map_err(failed)?;
    let run = recordings.run(0);
    let mut spent: BTreeMap<Phase, f64> = Phase::ALL.map(|phase| (phase, 0.0)).into();
    let mut whole = 0.0;
    // Runs one call; what of it is reduction counts as that too.
    let mut time = |phase: Phase, call: &mut dyn FnMut()| {
        let start = nanoseconds();
        let stages = clocked(nanoseconds, &mut *call).1;
        let all = (nanoseconds() - start) as f64;
        whole += all;
        *spent.entry(phase).or_default() += all;
        if phase != Phase::Reduce {
            *spent.entry(Phase::Reduce).or_default() += stages.of(Stage::Reduction) as f64;
        }
    };
    let begun = Instant::now();
    let mut belief = estimator.prior();
    for k in 0..=experiment.steps.min(recordings.last()) {
        if k > LEAST && begun.elapsed() > BUDGET {
            break;
        }
        let mut next = Ok(belief.clone());
        if k > 0 {
            time(Phase::Reduce, &mut || {
                next = estimator.reduce_order(k - 1, belief.clone())
            });
            let Ok(reduced) = next else { break };
            next = Ok(reduced.clone());
            time(Phase::Predict, &mut || {
                next = estimator.predict(k, &reduced, run.input(k - 1))
            });
        }
        let Ok(predicted) = next else { break };
        if k > 0 || estimator.uses_first_measurement() {
            let mut updated = Ok(predicted.clone());
            time(Phase::Update, &mut || {
                updated = estimator.update(k, &predicted, run.input(k), run.measurement(k))
            });
            // A contradiction ends the run, as everywhere.
            let Ok(updated) = updated else { break };
            belief = updated;
        } else {
            belief = predicted;
        }
    }
    let share = |(phase, part): (Phase, f64)| (whole > 0.0).then(|| (phase, part / whole));
    Ok(spent.into_iter().filter_map(share).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use zonobench_lab::recorded::{LONGEST_GAP, measurements};

    const FILE: &str = r#"
schema = 1
paper = "p"
id = "a"
seed = 1
runs = 1
steps = 30
[system]
kind = "linear"
a = [[0.9, 0.1], [0.0, 0.8]]
c = [[1.0, 0.0]]
[prior]
box = [[-1.0, 1.0], [-1.0, 1.0]]
[noise]
w = { box = [[-0.1, 0.1], [-0.1, 0.1]] }
v = { box = [[-0.1, 0.1]] }
[[estimator]]
id = "czmv"
kind = "czmv"
generators = 8
constraints = 2
h = "c2"
"#;

    #[test]
    fn the_parts_of_a_step_are_shares_of_it_and_are_measured_once() {
        let experiment = &Experiment::parse("a.toml", FILE).unwrap()[0];
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("y.csv");
        let rows: String = (0..31).map(|k| format!("{k},0\n")).collect();
        std::fs::write(&file, format!("k,y1\n{rows}")).unwrap();
        let recordings = || {
            let y = measurements(&file, &["y1"], LONGEST_GAP)?;
            Ok(Recordings::recorded(vec![Vec::new(); 31], Arc::new(y), 1))
        };
        let kept = folder.path().join("parts").join("a.json");
        let first = shares(&kept, experiment, 0, recordings).unwrap();
        let of = |phase| first[&phase];
        assert!(
            Phase::ALL
                .iter()
                .all(|phase| (0.0..=1.0).contains(&of(*phase))),
            "{first:?}"
        );
        // Prediction, update and the reduction between steps are the whole; reduction within the two counts twice.
        let sum = of(Phase::Predict) + of(Phase::Update);
        assert!(sum <= 1.0 + 1e-9 && sum > 0.0, "{first:?}");
        assert!(of(Phase::Reduce) > 0.0, "CZMV reduces: {first:?}");
        // The second time nothing is read.
        let again = shares(&kept, experiment, 0, || panic!("measured again"));
        assert_eq!(again.unwrap(), first);
    }
}
