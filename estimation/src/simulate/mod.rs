//! The truth: trajectories, measurements and inputs, drawn for the estimators to be judged by.
//!
//! x_{k+1} = f(k, x_k, u_k, w_k) for k = 0 … N − 1 and y_k = h(k, x_k, u_k, v_k) for k = 0 … N, in f64.
//! A run depends on what is given here and on nothing else: not on other runs, estimators or threads.
//!
//! Noise that a set bounds is drawn inside it by a factor of [`INSIDE`] about its center, so that the
//! rounding of the simulation itself cannot push the truth out of what the estimators assume.

mod check;
mod draw;
#[cfg(test)]
mod tests;
mod truth;

use crate::UncertainError;
use crate::random::{Draws, Purpose};
use crate::signal::{SignalError, mixed_radix};
use crate::system::System;
use draw::Source;
pub use truth::{DeltaLaw, Drawn, InitialState, Inputs, Law, Noise, Truth};

/// The share of a bounded noise that is used: 1 − 10⁻¹².
///
/// The simulation rounds x_{k+1} and y_k by a few units in the last place; taken as noise, that is
/// below 10⁻¹² of a bound unless the state is a thousand times larger than the noise.
pub const INSIDE: f64 = 1.0 - 1e-12;

/// What is wrong with a truth, or what went wrong when it was drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// A part of the truth is not what it must be.
    #[error("{part}: expected {expected}, got {got}")]
    Part {
        /// `truth.x0`, `truth.w`, `truth.v`, `truth.delta`, `inputs`.
        part: &'static str,
        /// What was expected.
        expected: String,
        /// What came.
        got: String,
    },
    /// A signal's parameter is not what it must be.
    #[error("{part}, component {component}: {source}")]
    Signal {
        /// As above.
        part: &'static str,
        /// The component, counted from 1.
        component: usize,
        /// The fault.
        source: SignalError,
    },
    /// A set or a covariance is not what it must be.
    #[error("{part}.{source}")]
    Uncertain {
        /// As above.
        part: &'static str,
        /// The fault.
        source: UncertainError,
    },
    /// No draw fell into the box.
    #[error("{part}, step {k}: none of {attempts} draws fell into the box")]
    Truncation {
        /// As above.
        part: &'static str,
        /// The step.
        k: usize,
        /// How often it was tried.
        attempts: usize,
    },
    /// The state is NaN or infinite.
    #[error("the state is no longer finite at step {k}")]
    Diverged {
        /// The run.
        run: u64,
        /// The step.
        k: usize,
    },
}

/// One run: the truth and what can be seen of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// x_k, k = 0 … N.
    pub x: Vec<Vec<f64>>,
    /// Radii, k = 0 … N: x_k ± radius encloses the exact trajectory of the f64 noise that was drawn.
    /// Infinite where no bound is known.
    pub rounding: Vec<Vec<f64>>,
    /// y_k, k = 0 … N.
    pub y: Vec<Vec<f64>>,
    /// u_k, k = 0 … N.
    pub u: Vec<Vec<f64>>,
    /// The process noise, with δ after it, k = 0 … N − 1.
    pub w: Vec<Vec<f64>>,
    /// The measurement noise, k = 0 … N.
    pub v: Vec<Vec<f64>>,
}

/// Run `run` of the experiment: x_0 … x_N, y_0 … y_N and u_0 … u_N with N = `steps`.
///
/// `truth` and `inputs` must have passed [`Truth::validate`] and [`Inputs::validate`] for this system
/// and this number of steps; they are checked again.
///
/// Fails where they do not fit, where a truncated law finds no draw in its box, and where the state
/// overflows.
pub fn simulate<Y: System>(
    system: &Y,
    truth: &Truth,
    inputs: &Inputs,
    seed: u64,
    run: u64,
    steps: usize,
) -> Result<Trajectory, SimulationError> {
    let variables = system.variables();
    truth.validate(system, steps)?;
    inputs.validate(system, steps)?;
    let (n, n_y, n_v) = (variables.x.len(), variables.y.len(), variables.v.len());
    let n_delta = system.n_delta();
    let n_w = variables.w.len() - n_delta;

    let choice = mixed_radix(run, &truth.counts());
    let (choice_w, choice_v) = choice.split_at(truth.w.counts().len());
    let mut w_source = Source::new(
        "truth.w",
        &truth.w,
        n_w,
        choice_w,
        [Purpose::W, Purpose::WGaussian],
        (seed, run),
    );
    let mut v_source = Source::new(
        "truth.v",
        &truth.v,
        n_v,
        choice_v,
        [Purpose::V, Purpose::VGaussian],
        (seed, run),
    );
    let mut delta_draws = Draws::new(seed, Purpose::Delta, run);

    let mut controller = match inputs {
        Inputs::Controller(controller) => controller.start(system),
        _ => None,
    };
    let mut state = first_state(&truth.x0, n, seed, run)?;
    let (mut x, mut y, mut u, mut w, mut v) = (vec![], vec![], vec![], vec![], vec![]);
    for k in 0..=steps {
        let (input, noise) = (inputs.at(k, &state, &mut controller), v_source.at(k)?);
        let mut measured = vec![0.0; n_y];
        system.h(k, &state, &input, &noise, &mut measured);
        if !state.iter().chain(&measured).all(|x| x.is_finite()) {
            return Err(SimulationError::Diverged { run, k });
        }
        let mut next = vec![0.0; n];
        if k < steps {
            let mut noise = w_source.at(k)?;
            if let Some(law) = &truth.delta {
                noise.extend(law.at(&mut delta_draws, k, n_delta));
            }
            system.f(k, &state, &input, &noise, &mut next);
            w.push(noise);
        }
        x.push(std::mem::replace(&mut state, next));
        y.push(measured);
        u.push(input);
        v.push(noise);
    }
    let rounding = system.trajectory_error(&x, &u, &w);
    Ok(Trajectory {
        x,
        rounding,
        y,
        u,
        w,
        v,
    })
}

fn first_state(
    x0: &InitialState,
    n: usize,
    seed: u64,
    run: u64,
) -> Result<Vec<f64>, SimulationError> {
    match x0 {
        InitialState::Point(x) => Ok(x.clone()),
        InitialState::Drawn(of) => {
            let law = if of.has_set() {
                Law::Uniform
            } else {
                Law::Gaussian
            };
            let noise = Noise::Drawn(Drawn {
                law,
                of: of.clone(),
                truncate: false,
            });
            let purposes = [Purpose::X0, Purpose::X0Gaussian];
            Source::new("truth.x0", &noise, n, &[], purposes, (seed, run)).at(0)
        }
    }
}
