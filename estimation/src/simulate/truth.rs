//! What can be said of the truth: how x_0, w, v, δ and u are made.

use super::check::unambiguous;
use super::{INSIDE, SimulationError};
use crate::Problem;
use crate::controller::{Controller, FeedbackLinearising};
use crate::problem::Uncertain;
use crate::random::Draws;
use crate::signal::{Oscillation, Signal, sum_at};
use crate::system::System;
use serde::{Deserialize, Serialize};

/// How the data of an experiment are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// The first state.
    pub x0: InitialState,
    /// The process noise; of an `lpv` system without δ.
    pub w: Noise,
    /// The measurement noise.
    pub v: Noise,
    /// δ of an `lpv` system; None for every other.
    pub delta: Option<DeltaLaw>,
}

/// The true first state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialState {
    /// This state in every run.
    Point(Vec<f64>),
    /// Drawn anew in every run: uniform in the generators if there is a set, else Gaussian.
    Drawn(Uncertain),
}

/// How a noise vector is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Noise {
    /// Drawn anew at every step of every run.
    Drawn(Drawn),
    /// The same deterministic signal in every run.
    Signals {
        /// A list of terms for every component.
        terms: Vec<Vec<Signal>>,
        /// The center of the assumed set, where there is one: the signal is drawn towards it by
        /// [`INSIDE`].
        about: Option<Vec<f64>>,
    },
    /// A family of deterministic signals, one combination a run.
    ///
    /// Run r takes the alternatives given by the digits of r in the mixed radix of their counts: the
    /// components of w first, then those of v, the last component of v varying fastest.
    Alternatives {
        /// A list of alternatives, each a list of terms, for every component.
        alternatives: Vec<Vec<Vec<Signal>>>,
        /// As in `Signals`.
        about: Option<Vec<f64>>,
    },
    /// Given data, used as they are: row k is the vector at step k.
    Data(Vec<Vec<f64>>),
}

/// A law and what it is the law of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawn {
    /// The law.
    pub law: Law,
    /// The set and the Gaussian that the law reads.
    pub of: Uncertain,
    /// Draw again until the vector lies in the box; for the `gaussian` law alone.
    pub truncate: bool,
}

/// How a vector c + G ξ + g is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// c + G ξ with every ξ_j uniform in [−1, 1).
    Uniform,
    /// m + F g with F Fᵀ = Σ and g standard normal.
    Gaussian,
    /// c + G ξ + F g (+ m, where a mean is given): the sum of both.
    Mixed,
    /// c + G ξ with every ξ_j = ±1.
    Vertices,
    /// 0.
    Zero,
}

impl Law {
    /// Every law with its name in a file.
    pub const NAMES: &'static [(&'static str, Law)] = &[
        ("uniform", Law::Uniform),
        ("gaussian", Law::Gaussian),
        ("mixed", Law::Mixed),
        ("vertices", Law::Vertices),
        ("zero", Law::Zero),
    ];
}

/// How the parameters δ_i ∈ [−1, 1] of an `lpv` system are made. Bounds are approached to [`INSIDE`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "law", rename_all = "kebab-case", deny_unknown_fields)]
pub enum DeltaLaw {
    /// Every δ_i uniform in [−1, 1), anew at every step.
    Uniform,
    /// Every δ_i = `value` at every step.
    Constant {
        /// The value, in [−1, 1].
        value: f64,
    },
    /// Every δ_i = ±1 with equal chances, anew at every step.
    Sign,
    /// Every δ_i follows the same sine.
    Sine(Oscillation),
    /// δ = 0.
    Zero,
    /// δ_i follows its own signal.
    Signals {
        /// A list of terms for every component; the sums stay in [−1, 1].
        terms: Vec<Vec<Signal>>,
    },
}

/// What drives the system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inputs {
    /// The same vector at every step; empty where the system has no input.
    Constant(Vec<f64>),
    /// A list of terms for every component.
    Signals(Vec<Vec<Signal>>),
    /// Row k is u_k.
    Data(Vec<Vec<f64>>),
    /// u_k is what a controller makes of the true x_k: the loop is closed around the truth, so that all
    /// estimators see the same inputs.
    Controller(Controller),
}

impl Truth {
    /// The truth of an experiment that says nothing about it: x_0 drawn from the prior, w and v uniform
    /// in their assumed sets, δ uniform.
    ///
    /// Fails with `Part` where a part is described by a covariance, alone or beside a set: there the
    /// experiment must say what the truth is.
    pub fn assumed<Y: System>(problem: &Problem<Y>) -> Result<Self, SimulationError> {
        Ok(Self {
            x0: Self::assumed_x0(problem)?,
            w: Self::assumed_noise("truth.w", &problem.w)?,
            v: Self::assumed_noise("truth.v", &problem.v)?,
            delta: Self::assumed_delta(&problem.system),
        })
    }

    /// x_0 drawn from the prior, which must be a set without constraints and without a covariance.
    pub fn assumed_x0<Y>(problem: &Problem<Y>) -> Result<InitialState, SimulationError> {
        unambiguous("truth.x0", &problem.prior)?;
        Ok(InitialState::Drawn(problem.prior.clone()))
    }

    /// Noise uniform in the assumed set, which must be given without a covariance.
    pub fn assumed_noise(part: &'static str, of: &Uncertain) -> Result<Noise, SimulationError> {
        unambiguous(part, of)?;
        Ok(Noise::Drawn(Drawn {
            law: Law::Uniform,
            of: of.clone(),
            truncate: false,
        }))
    }

    /// δ uniform for a system that has one.
    pub fn assumed_delta<Y: System>(system: &Y) -> Option<DeltaLaw> {
        (system.n_delta() > 0).then_some(DeltaLaw::Uniform)
    }

    /// The number of different runs: of deterministic noise, the number of combinations of
    /// alternatives; None where something is drawn.
    pub fn distinct_runs(&self) -> Option<u64> {
        let drawn = |noise: &Noise| matches!(noise, Noise::Drawn(d) if d.law != Law::Zero);
        let random_delta = matches!(self.delta, Some(DeltaLaw::Uniform | DeltaLaw::Sign));
        if matches!(self.x0, InitialState::Drawn(_))
            || drawn(&self.w)
            || drawn(&self.v)
            || random_delta
        {
            return None;
        }
        Some(self.counts().iter().map(|&c| c as u64).product())
    }

    /// The numbers of alternatives of w's components, then of v's.
    pub(super) fn counts(&self) -> Vec<usize> {
        [&self.w, &self.v]
            .into_iter()
            .flat_map(Noise::counts)
            .collect()
    }
}

impl Noise {
    pub(super) fn counts(&self) -> Vec<usize> {
        match self {
            Noise::Alternatives { alternatives, .. } => alternatives.iter().map(Vec::len).collect(),
            _ => Vec::new(),
        }
    }
}

impl DeltaLaw {
    /// The name of every law in a file; signals are given without one.
    pub const NAMES: &'static [&'static str] = &["uniform", "constant", "sign", "sine", "zero"];

    pub(super) fn at(&self, draws: &mut Draws, k: usize, n: usize) -> Vec<f64> {
        (0..n)
            .map(|i| match self {
                DeltaLaw::Uniform => INSIDE * draws.uniform(k, i, 0),
                DeltaLaw::Constant { value } => INSIDE * value,
                DeltaLaw::Sign => INSIDE * draws.sign(k, i, 0),
                DeltaLaw::Sine(wave) => INSIDE * Signal::Sine(wave.clone()).at(k),
                DeltaLaw::Zero => 0.0,
                DeltaLaw::Signals { terms } => INSIDE * sum_at(&terms[i], k),
            })
            .collect()
    }
}

impl Inputs {
    /// u_k, asked for in ascending k, with the true x_k; the controller must be one that drives the system.
    pub(super) fn at(
        &self,
        k: usize,
        x: &[f64],
        controller: &mut Option<FeedbackLinearising>,
    ) -> Vec<f64> {
        match self {
            Inputs::Constant(u) => u.clone(),
            Inputs::Signals(terms) => terms.iter().map(|t| sum_at(t, k)).collect(),
            Inputs::Data(rows) => rows[k].clone(),
            Inputs::Controller(_) => controller
                .as_mut()
                .map_or_else(Vec::new, |controller| controller.step(k, x)),
        }
    }
}
