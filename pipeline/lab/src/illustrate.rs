//! Numbers that a picture needs and no stage keeps: the equations of a system without noise, and states drawn at random
//! that agree with what was measured.

use crate::experiment::Experiment;
use zonobench_estimation::System as _;
use zonobench_estimation::random::{Draws, Purpose};

/// f(x, 0, 0) at step k, without input and noise.
pub fn next(experiment: &Experiment, k: usize, x: &[f64]) -> Vec<f64> {
    let system = &experiment.problem.system;
    let silent = vec![0.0; system.variables().w.len()];
    let mut to = vec![0.0; x.len()];
    system.f(k, x, &[], &silent, &mut to);
    to
}

/// h(x, 0, 0) at step k, without input and noise.
pub fn output(experiment: &Experiment, k: usize, x: &[f64]) -> Vec<f64> {
    let system = &experiment.problem.system;
    let variables = system.variables();
    let mut y = vec![0.0; variables.y.len()];
    system.h(k, x, &[], &vec![0.0; variables.v.len()], &mut y);
    y
}

/// The sampling period in s, where the system has one.
pub fn period(experiment: &Experiment) -> Option<f64> {
    experiment.problem.system.period()
}

/// The names of the states.
pub fn states(experiment: &Experiment) -> Vec<String> {
    let variables = experiment.problem.system.variables();
    variables.x.iter().map(|v| v.name.clone()).collect()
}

/// The names of what is measured.
pub fn outputs(experiment: &Experiment) -> Vec<String> {
    let variables = experiment.problem.system.variables();
    variables.y.iter().map(|v| v.name.clone()).collect()
}

/// What was measured of a run: (component, k) to its value, None where it was not.
pub type Measured<'a> = dyn Fn(&str, i32) -> Option<f64> + 'a;

/// Whether a state agrees with what was measured at step k: y − h(x) is in V. A component that was not measured agrees
/// with everything. None where V has no bounds.
pub fn agrees(experiment: &Experiment, measured: &Measured, k: i32, x: &[f64]) -> Option<bool> {
    let v = experiment.problem.v.bounds.as_ref()?;
    let y = output(experiment, k as usize, x);
    let names = outputs(experiment);
    let mut components = names.iter().zip(&y).zip(v.iter());
    Some(components.all(|((name, h), v)| measured(name, k).is_none_or(|y| v.contains(y - h))))
}

/// Of at most this many draws a step those are kept that agree with what was measured.
const TRIES: usize = 20_000;

/// The seed of the samples.
const SEED: u64 = 1;

/// At most `count` states a step, from k = 0 to `last`: states of X_0 and noises of W, drawn uniformly and put through the
/// dynamics, that agree with every measurement so far. Empty where a noise has no bounds.
pub fn cloud(
    experiment: &Experiment,
    measured: &Measured,
    last: i32,
    count: usize,
) -> Vec<Vec<Vec<f64>>> {
    let problem = &experiment.problem;
    let (Some(w), Some(_)) = (&problem.w.bounds, &problem.v.bounds) else {
        return Vec::new();
    };
    let kept = |k: i32, x: &Vec<f64>| agrees(experiment, measured, k, x) == Some(true);
    let g = problem.prior.generator_matrix();
    let mut first = Draws::new(SEED, Purpose::X0, 0);
    let start = |j: usize| -> Vec<f64> {
        let xi: Vec<f64> = (0..g.cols()).map(|i| first.uniform(j, i, 0)).collect();
        let moved = g.mul_vec(&xi);
        let center = &problem.prior.center;
        center.iter().zip(&moved).map(|(c, d)| c + d).collect()
    };
    let starts = (0..TRIES).map(start).filter(|x| kept(0, x));
    let mut states: Vec<Vec<f64>> = starts.take(count).collect();
    let mut all = vec![states.clone()];
    for k in 1..=last {
        let mut draws = Draws::new(SEED, Purpose::W, k as u64);
        let step = |j: usize| {
            let x = states.get(j % states.len().max(1))?;
            let noise = w.iter().enumerate();
            let noise: Vec<f64> = noise
                .map(|(i, w)| w.mid() + w.rad() * draws.uniform(j, i, 0))
                .collect();
            let mut to = vec![0.0; x.len()];
            problem.system.f(k as usize - 1, x, &[], &noise, &mut to);
            Some(to)
        };
        let steps = (0..TRIES).filter_map(step).filter(|x| kept(k, x));
        states = steps.take(count).collect();
        all.push(states.clone());
    }
    all
}
