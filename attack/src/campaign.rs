//! One target, one attack, one run: who was lost.

use crate::adversary::{Attack, choose};
use crate::targets::{Own, Target};
use zonobench_estimation::estimator::Containment;
use zonobench_estimation::simulate::{InitialState, Inputs, Noise, SimulationError, Truth};
use zonobench_estimation::{
    AnyEstimator, Belief, EstimationError, Estimator, EstimatorSettings, Problem, System,
    Trajectory, simulate, track,
};
use zonobench_sets::{Interval, SetError};

/// A component of the state beyond which a run is given up: some systems diverge under constant noise.
const FAR: f64 = 1e6;

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Sets that were judged: predicted and updated ones.
    pub steps: u64,
    /// Sets that certainly do not hold the truth, or were called empty.
    pub lost: u64,
    /// Of the lost, those that were called empty.
    pub empty: u64,
    /// Sets of which neither is certain.
    pub undecided: u64,
    /// Runs that ended early without a set: refused, or the set reached where the model is not defined.
    pub refused: u64,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.lost += other.lost;
        self.empty += other.empty;
        self.undecided += other.undecided;
        self.refused += other.refused;
    }
}

impl Counts {
    fn judge(&mut self, belief: &impl Belief, truth: &[Interval]) {
        self.steps += 1;
        match belief.contains(truth) {
            Containment::Inside => {}
            Containment::Outside => self.lost += 1,
            Containment::Undecided => self.undecided += 1,
        }
    }
}

/// Run `run` of `attack` against `target`.
///
/// The problem, the noise and the first state depend on the three alone. Fails where the target's problem
/// cannot be simulated, its estimator not be made, or a step fails otherwise than by an empty set, a refusal or a set that
/// leaves the model's domain; the text says which.
pub fn attack(target: &Target, attack: Attack, run: u64) -> Result<Counts, String> {
    let settings = serde_json::from_str(target.settings)
        .map_err(|e| format!("{} on {}: settings: {e}", target.name, target.system))?;
    Battle {
        name: target.name,
        system: target.system,
        settings: &settings,
        problem: &(target.problem)(target.seed(), run),
        inputs: vec![target.input.to_vec(); target.steps + 1],
        inside: target.inside,
        seed: target.seed(),
    }
    .fought(attack, run)
}

/// Run `run` of `attack` against an estimator on a problem of a user's own; as [`attack()`].
pub fn attack_own(own: &Own, attack: Attack, run: u64) -> Result<Counts, String> {
    Battle {
        name: &own.estimator,
        system: &own.system,
        settings: &own.settings,
        problem: &own.problem,
        inputs: own.inputs.clone(),
        inside: INSIDE_OF_OWN,
        seed: own.seed(),
    }
    .fought(attack, run)
}

/// The share of the bounds that is used of problems that we do not know: room for the rounding of a measurement that is
/// 10⁶ times as large as its noise.
const INSIDE_OF_OWN: f64 = 1.0 - 1e-9;

/// An estimator, a problem, and what drives it.
struct Battle<'a> {
    name: &'a str,
    system: &'a str,
    settings: &'a EstimatorSettings,
    problem: &'a Problem,
    inputs: Vec<Vec<f64>>,
    inside: f64,
    seed: u64,
}

impl Battle<'_> {
    fn fought(self, attack: Attack, run: u64) -> Result<Counts, String> {
        let failed = |what: &str, e: &dyn std::fmt::Display| {
            let (name, system) = (self.name, self.system);
            format!(
                "{name} on {system}, {}, run {run}: {what}: {e}",
                attack.name()
            )
        };
        let estimator =
            AnyEstimator::new(self.settings, self.problem).map_err(|e| failed("estimator", &e))?;
        let at = (self.seed ^ (attack as u64 + 1), run);
        let how = (self.inputs, self.inside);
        run_of(&estimator, self.problem, how, attack, at).map_err(|(what, e)| failed(what, &e))
    }
}

/// Run `run` of `attack` against any estimator of any problem, under the inputs u_0 … u_N: N steps, noise within the share
/// 1 − 10⁻⁹ of its bounds.
///
/// The noise and the first state depend on the problem, the attack, `seed` and `run` alone. Fails where the problem cannot be
/// simulated, or a step fails otherwise than by an empty set, a refusal or a set that leaves the model's domain.
pub fn attack_on<E: Estimator, Y: System>(
    estimator: &E,
    problem: &Problem<Y>,
    inputs: Vec<Vec<f64>>,
    attack: Attack,
    (seed, run): (u64, u64),
) -> Result<Counts, String> {
    let counted = run_of(
        estimator,
        problem,
        (inputs, INSIDE_OF_OWN),
        attack,
        (seed, run),
    );
    counted.map_err(|(what, e)| format!("{}, run {run}: {what}: {e}", attack.name()))
}

fn run_of<E: Estimator, Y: System>(
    estimator: &E,
    problem: &Problem<Y>,
    (inputs, inside): (Vec<Vec<f64>>, f64),
    attack: Attack,
    (seed, run): (u64, u64),
) -> Result<Counts, (&'static str, String)> {
    let steps = inputs.len().saturating_sub(1);
    let choice = choose(
        attack,
        estimator,
        problem,
        &inputs,
        inside,
        (seed, run),
        steps,
    );
    let delta = Truth::assumed_delta(&problem.system);
    let truth = Truth {
        x0: InitialState::Point(choice.x0),
        w: Noise::Data(choice.w),
        v: Noise::Data(choice.v),
        delta,
    };
    let inputs = Inputs::Data(inputs);
    let simulated = |steps| simulate(&problem.system, &truth, &inputs, seed, run, steps);
    let data = match simulated(steps) {
        Err(SimulationError::Diverged { k, .. }) => simulated(k.saturating_sub(1)),
        other => other,
    };
    let data = data.map_err(|e| ("simulation", e.to_string()))?;
    // A state that leaves for infinity is followed as far as its sets mean something.
    let far = |x: &Vec<f64>| x.iter().any(|x| x.abs() > FAR);
    let end = data.x.iter().position(far).unwrap_or(data.x.len());
    judge(estimator, &data, end).map_err(|e| ("step", e.to_string()))
}

/// Tracks the data and judges every belief before step `end`.
fn judge<E: Estimator>(
    estimator: &E,
    data: &Trajectory,
    end: usize,
) -> Result<Counts, EstimationError> {
    let measured: Vec<Vec<Option<f64>>> = data
        .y
        .iter()
        .map(|y| y.iter().copied().map(Some).collect())
        .collect();
    let mut counts = Counts::default();
    for step in track(estimator, data.x.len() - 1, &data.u, &measured).take(end) {
        let truth = enclosed(&data.x[step.k], &data.rounding[step.k]);
        if let Some(belief) = &step.predicted {
            counts.judge(belief, &truth);
        }
        match &step.updated {
            Ok(belief) => {
                if !step
                    .predicted
                    .as_ref()
                    .is_some_and(|b| b.says_the_same(belief))
                {
                    counts.judge(belief, &truth);
                }
            }
            Err(EstimationError::Inconsistent { .. }) => {
                counts.steps += 1;
                counts.lost += 1;
                counts.empty += 1;
            }
            Err(EstimationError::Refused { .. }) => counts.refused += 1,
            // The set reached where the model is not defined, or beyond the numbers.
            Err(
                EstimationError::Overflow { .. }
                | EstimationError::Set {
                    source: SetError::Domain { .. },
                    ..
                },
            ) => counts.refused += 1,
            Err(other) => return Err(other.clone()),
        }
    }
    Ok(counts)
}

/// x ± rounding, as intervals.
fn enclosed(x: &[f64], rounding: &[f64]) -> Vec<Interval> {
    let side = |(x, r): (&f64, &f64)| {
        Interval::new((x - r).next_down(), (x + r).next_up()).unwrap_or(Interval::ENTIRE)
    };
    x.iter().zip(rounding).map(side).collect()
}
