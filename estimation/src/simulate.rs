//! The truth: trajectories, measurements and inputs, drawn for the estimators to be judged by.
//!
//! x_{k+1} = f(k, x_k, u_k, w_k) for k = 0 … N − 1 and y_k = h(k, x_k, u_k, v_k) for k = 0 … N, in f64.
//! A run depends on what is given here and on nothing else: not on other runs, estimators or threads.
//!
//! Noise that a set bounds is drawn inside it by a factor of [`INSIDE`] about its center, so that the
//! rounding of the simulation itself cannot push the truth out of what the estimators assume.

use crate::controller::{Controller, FeedbackLinearising};
use crate::problem::Uncertain;
use crate::random::{Draws, MAX_ATTEMPTS, MAX_COMPONENTS, MAX_STEPS, Purpose};
use crate::signal::{Oscillation, Signal, SignalError, mixed_radix, sum_at};
use crate::system::{AnySystem, System};
use crate::trajectory_error::trajectory_error;
use crate::{Problem, UncertainError};
use serde::{Deserialize, Serialize};
use zonobench_sets::Matrix;

/// The share of a bounded noise that is used: 1 − 10⁻¹².
///
/// The simulation rounds x_{k+1} and y_k by a few units in the last place; taken as noise, that is
/// below 10⁻¹² of a bound unless the state is a thousand times larger than the noise.
pub const INSIDE: f64 = 1.0 - 1e-12;

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
    #[error("run {run}: the state is no longer finite at step {k}")]
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

impl Truth {
    /// The truth of an experiment that says nothing about it: x_0 drawn from the prior, w and v uniform
    /// in their assumed sets, δ uniform.
    ///
    /// Fails with `Part` where a part is described by a covariance, alone or beside a set: there the
    /// experiment must say what the truth is.
    pub fn assumed(problem: &Problem) -> Result<Self, SimulationError> {
        Ok(Self {
            x0: Self::assumed_x0(problem)?,
            w: Self::assumed_noise("truth.w", &problem.w)?,
            v: Self::assumed_noise("truth.v", &problem.v)?,
            delta: Self::assumed_delta(&problem.system),
        })
    }

    /// x_0 drawn from the prior, which must be a set without constraints and without a covariance.
    pub fn assumed_x0(problem: &Problem) -> Result<InitialState, SimulationError> {
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
    pub fn assumed_delta(system: &AnySystem) -> Option<DeltaLaw> {
        (system.n_delta() > 0).then_some(DeltaLaw::Uniform)
    }

    /// Checks every part against the system and the number of steps, so that only a truncation that
    /// never succeeds or a state that diverges can fail later.
    pub fn validate(&self, system: &AnySystem, steps: usize) -> Result<(), SimulationError> {
        let variables = system.variables();
        let (n, n_delta) = (variables.x.len(), system.n_delta());
        match &self.x0 {
            InitialState::Point(x) => finite("truth.x0", x, n)?,
            InitialState::Drawn(of) => {
                let at = |source| SimulationError::Uncertain {
                    part: "truth.x0",
                    source,
                };
                of.validate(n).map_err(at)?;
                without_constraints("truth.x0", of)?;
                if !(of.has_set() || of.has_gaussian()) {
                    return Err(part_error(
                        "truth.x0",
                        "a prior that is a set or has a covariance",
                        "a point",
                    ));
                }
            }
        }
        self.w
            .validate("truth.w", variables.w.len() - n_delta, steps)?;
        self.v.validate("truth.v", variables.v.len(), steps + 1)?;
        match (&self.delta, n_delta) {
            (Some(_), 0) => {
                return Err(part_error(
                    "truth.delta",
                    "no delta: the system has none",
                    "a law",
                ));
            }
            (None, 1..) => return Err(part_error("truth.delta", "a law", "none")),
            (Some(law), _) => law.validate(n_delta, steps)?,
            (None, 0) => {}
        }
        if steps >= MAX_STEPS || variables.w.len().max(n) >= MAX_COMPONENTS {
            let expected = format!("fewer than {MAX_STEPS} steps and {MAX_COMPONENTS} components");
            return Err(part_error("truth", expected, format!("{steps} steps")));
        }
        Ok(())
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
    fn counts(&self) -> Vec<usize> {
        [&self.w, &self.v]
            .into_iter()
            .flat_map(Noise::counts)
            .collect()
    }
}

impl Noise {
    fn counts(&self) -> Vec<usize> {
        match self {
            Noise::Alternatives { alternatives, .. } => alternatives.iter().map(Vec::len).collect(),
            _ => Vec::new(),
        }
    }

    /// Checks the noise against its dimension `n` and the number of vectors that will be asked for.
    fn validate(
        &self,
        part: &'static str,
        n: usize,
        vectors: usize,
    ) -> Result<(), SimulationError> {
        let components = |got: usize| {
            let expected = format!("signals for {n} components");
            if got == n {
                Ok(())
            } else {
                Err(part_error(part, expected, got.to_string()))
            }
        };
        match self {
            Noise::Drawn(drawn) => drawn.validate(part, n),
            Noise::Signals { terms, .. } => {
                components(terms.len())?;
                check_terms(part, terms.iter().enumerate().map(|(i, t)| (i, &t[..])))
            }
            Noise::Alternatives { alternatives, .. } => {
                components(alternatives.len())?;
                if let Some(i) = alternatives.iter().position(Vec::is_empty) {
                    let expected = format!("an alternative for component {}", i + 1);
                    return Err(part_error(part, expected, "none"));
                }
                let all = alternatives.iter().enumerate();
                check_terms(
                    part,
                    all.flat_map(|(i, list)| list.iter().map(move |t| (i, &t[..]))),
                )
            }
            Noise::Data(rows) => check_data(part, rows, n, vectors),
        }
    }
}

impl Drawn {
    fn validate(&self, part: &'static str, n: usize) -> Result<(), SimulationError> {
        self.of
            .validate(n)
            .map_err(|source| SimulationError::Uncertain { part, source })?;
        let reads_set = matches!(self.law, Law::Uniform | Law::Vertices | Law::Mixed);
        if reads_set && !self.of.has_set() {
            return Err(part_error(part, "a box or generators for this law", "none"));
        }
        if reads_set {
            without_constraints(part, &self.of)?;
        }
        if matches!(self.law, Law::Gaussian | Law::Mixed) && !self.of.has_gaussian() {
            return Err(part_error(part, "a covariance for this law", "none"));
        }
        if self.truncate && self.law != Law::Gaussian {
            return Err(part_error(
                part,
                "the gaussian law beside truncate",
                "another law",
            ));
        }
        if self.truncate && self.of.bounds.is_none() {
            return Err(part_error(part, "a box to truncate to", "none"));
        }
        if self.of.generator_matrix().cols() >= MAX_COMPONENTS {
            let expected = format!("fewer than {MAX_COMPONENTS} generators");
            return Err(part_error(part, expected, "more"));
        }
        Ok(())
    }
}

impl DeltaLaw {
    /// The name of every law in a file; signals are given without one.
    pub const NAMES: &'static [&'static str] = &["uniform", "constant", "sign", "sine", "zero"];

    fn validate(&self, n: usize, steps: usize) -> Result<(), SimulationError> {
        let part = "truth.delta";
        match self {
            DeltaLaw::Signals { terms } => {
                if terms.len() != n {
                    let expected = format!("signals for {n} components");
                    return Err(part_error(part, expected, terms.len().to_string()));
                }
                check_terms(part, terms.iter().enumerate().map(|(i, t)| (i, &t[..])))?;
                for k in 0..steps {
                    if let Some(value) = terms.iter().map(|t| sum_at(t, k)).find(|d| d.abs() > 1.0)
                    {
                        let expected = "signals within [-1, 1]";
                        return Err(part_error(part, expected, format!("{value} at step {k}")));
                    }
                }
                Ok(())
            }
            DeltaLaw::Constant { value } if value.is_nan() || value.abs() > 1.0 => {
                Err(part_error(part, "a value in [-1, 1]", value.to_string()))
            }
            DeltaLaw::Sine(wave) => {
                let at = |source| SimulationError::Signal {
                    part,
                    component: 1,
                    source,
                };
                Signal::Sine(wave.clone()).validate().map_err(at)?;
                let largest = wave.amplitude.abs() + wave.offset.abs();
                if largest > 1.0 {
                    return Err(part_error(
                        part,
                        "a sine within [-1, 1]",
                        format!("up to {largest}"),
                    ));
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn at(&self, draws: &mut Draws, k: usize, n: usize) -> Vec<f64> {
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
    /// Checks the inputs against the system and the last step.
    pub fn validate(&self, system: &AnySystem, steps: usize) -> Result<(), SimulationError> {
        let n = system.variables().u.len();
        match self {
            Inputs::Constant(u) => finite("inputs", u, n),
            Inputs::Signals(terms) => {
                if terms.len() != n {
                    let expected = format!("signals for {n} components");
                    return Err(part_error("inputs", expected, terms.len().to_string()));
                }
                check_terms("inputs", terms.iter().enumerate().map(|(i, t)| (i, &t[..])))
            }
            Inputs::Data(rows) => check_data("inputs", rows, n, steps + 1),
            Inputs::Controller(controller) => match controller.start(system) {
                Some(_) => Ok(()),
                None => Err(part_error(
                    "inputs",
                    "a system that the controller can drive",
                    system.kind(),
                )),
            },
        }
    }

    /// u_k, asked for in ascending k, with the true x_k; the controller must be one that drives the system.
    fn at(&self, k: usize, x: &[f64], controller: &mut Option<FeedbackLinearising>) -> Vec<f64> {
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

fn part_error(
    part: &'static str,
    expected: impl Into<String>,
    got: impl Into<String>,
) -> SimulationError {
    SimulationError::Part {
        part,
        expected: expected.into(),
        got: got.into(),
    }
}

fn finite(part: &'static str, v: &[f64], n: usize) -> Result<(), SimulationError> {
    if v.len() != n {
        return Err(part_error(
            part,
            format!("{n} numbers"),
            v.len().to_string(),
        ));
    }
    match v.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(part_error(part, "finite numbers", x.to_string())),
        None => Ok(()),
    }
}

fn check_data(
    part: &'static str,
    rows: &[Vec<f64>],
    n: usize,
    vectors: usize,
) -> Result<(), SimulationError> {
    if rows.len() < vectors {
        return Err(part_error(
            part,
            format!("data for {vectors} steps"),
            rows.len().to_string(),
        ));
    }
    rows.iter().try_for_each(|row| finite(part, row, n))
}

fn check_terms<'a>(
    part: &'static str,
    components: impl Iterator<Item = (usize, &'a [Signal])>,
) -> Result<(), SimulationError> {
    for (i, terms) in components {
        for term in terms {
            term.validate().map_err(|source| SimulationError::Signal {
                part,
                component: i + 1,
                source,
            })?;
        }
    }
    Ok(())
}

fn unambiguous(part: &'static str, of: &Uncertain) -> Result<(), SimulationError> {
    match (of.has_set(), of.has_gaussian()) {
        (true, false) => Ok(()),
        (true, true) => {
            let expected = "it to be given: a set and a covariance are assumed, and the truth can follow either";
            Err(part_error(part, expected, "nothing"))
        }
        (false, true) => Err(part_error(
            part,
            "it to be given: only a covariance is assumed",
            "nothing",
        )),
        (false, false) => Err(part_error(
            part,
            "it to be given: no set is assumed",
            "nothing",
        )),
    }
}

fn without_constraints(part: &'static str, of: &Uncertain) -> Result<(), SimulationError> {
    match &of.constraints {
        Some(_) => Err(part_error(
            part,
            "a set without constraints to draw from",
            "constraints",
        )),
        None => Ok(()),
    }
}

/// F with F Fᵀ = Σ for a symmetric positive semidefinite Σ: Cholesky's factor, where a pivot that is
/// zero up to rounding gives a column of zeros.
fn semidefinite_factor(sigma: &Matrix) -> Matrix {
    let n = sigma.rows();
    let scale = (0..n).fold(0.0_f64, |m, i| m.max(sigma[(i, i)]));
    let cut = scale * n as f64 * 4.0 * f64::EPSILON;
    let mut factor = Matrix::zeros(n, n);
    for j in 0..n {
        let pivot = (0..j).fold(sigma[(j, j)], |s, k| s - factor[(j, k)] * factor[(j, k)]);
        if pivot <= cut {
            continue;
        }
        let root = pivot.sqrt();
        factor[(j, j)] = root;
        for i in j + 1..n {
            let rest = (0..j).fold(sigma[(i, j)], |s, k| s - factor[(i, k)] * factor[(j, k)]);
            factor[(i, j)] = rest / root;
        }
    }
    factor
}

/// What makes a noise vector at any step of one run.
struct Source<'a> {
    part: &'static str,
    noise: &'a Noise,
    n: usize,
    /// The terms of each component, where the noise is deterministic.
    terms: Vec<&'a [Signal]>,
    draws: Draws,
    gaussian: Draws,
    factor: Matrix,
    /// True if Σ is diagonal: then components can be redrawn one by one.
    independent: bool,
}

impl<'a> Source<'a> {
    fn new(
        part: &'static str,
        noise: &'a Noise,
        n: usize,
        choice: &[usize],
        purposes: [Purpose; 2],
        (seed, run): (u64, u64),
    ) -> Self {
        let terms = match noise {
            Noise::Signals { terms, .. } => terms.iter().map(|t| &t[..]).collect(),
            Noise::Alternatives { alternatives, .. } => alternatives
                .iter()
                .zip(choice)
                .map(|(list, &digit)| &list[digit][..])
                .collect(),
            Noise::Drawn(_) | Noise::Data(_) => Vec::new(),
        };
        let sigma = match noise {
            Noise::Drawn(drawn) => drawn.of.covariance_matrix(),
            _ => Matrix::zeros(0, 0),
        };
        let independent = (0..sigma.rows()).all(|i| (0..i).all(|j| sigma[(i, j)] == 0.0));
        Self {
            part,
            noise,
            n,
            terms,
            draws: Draws::new(seed, purposes[0], run),
            gaussian: Draws::new(seed, purposes[1], run),
            factor: semidefinite_factor(&sigma),
            independent,
        }
    }

    fn at(&mut self, k: usize) -> Result<Vec<f64>, SimulationError> {
        match self.noise {
            Noise::Drawn(drawn) => self.draw(drawn, k),
            Noise::Signals { about, .. } | Noise::Alternatives { about, .. } => {
                let value = self.terms.iter().map(|terms| sum_at(terms, k));
                Ok(match about {
                    Some(center) => value
                        .zip(center)
                        .map(|(s, c)| c + (s - c) * INSIDE)
                        .collect(),
                    None => value.collect(),
                })
            }
            Noise::Data(rows) => Ok(rows[k].clone()),
        }
    }

    fn draw(&mut self, drawn: &Drawn, k: usize) -> Result<Vec<f64>, SimulationError> {
        let of = &drawn.of;
        match drawn.law {
            Law::Zero => Ok(vec![0.0; self.n]),
            Law::Uniform => Ok(in_generators(of, &of.center, |j| {
                self.draws.uniform(k, j, 0)
            })),
            Law::Vertices => Ok(in_generators(of, &of.center, |j| self.draws.sign(k, j, 0))),
            Law::Mixed => {
                let g = self.normal(k, 0, &of.mixed_mean());
                Ok(in_generators(of, &g, |j| self.draws.uniform(k, j, 0)))
            }
            Law::Gaussian if drawn.truncate => self.truncated(of, k),
            Law::Gaussian => Ok(self.normal(k, 0, of.gaussian_mean())),
        }
    }

    /// `mean` + F g.
    fn normal(&mut self, k: usize, attempt: usize, mean: &[f64]) -> Vec<f64> {
        let g: Vec<f64> = (0..self.n)
            .map(|j| self.gaussian.gaussian(k, j, attempt))
            .collect();
        mean.iter()
            .enumerate()
            .map(|(i, m)| m + dot_in_order(self.factor.row(i), &g))
            .collect()
    }

    /// Drawn again until inside the box: one component at a time where they are independent (the law
    /// is then the same as that of redrawing the vector), else the whole vector.
    fn truncated(&mut self, of: &Uncertain, k: usize) -> Result<Vec<f64>, SimulationError> {
        let radius: Vec<f64> = of.generator_matrix().abs_row_sums();
        let inside = |i: usize, x: f64| (x - of.center[i]).abs() <= radius[i] * INSIDE;
        let mut vector: Vec<Option<f64>> = vec![None; self.n];
        for attempt in 0..MAX_ATTEMPTS {
            let draw = self.normal(k, attempt, of.gaussian_mean());
            if self.independent {
                for (i, x) in draw.into_iter().enumerate() {
                    vector[i] = vector[i].or(inside(i, x).then_some(x));
                }
            } else if draw.iter().enumerate().all(|(i, &x)| inside(i, x)) {
                vector = draw.into_iter().map(Some).collect();
            }
            if let Some(found) = vector.iter().copied().collect::<Option<Vec<f64>>>() {
                return Ok(found);
            }
        }
        Err(SimulationError::Truncation {
            part: self.part,
            k,
            attempts: MAX_ATTEMPTS,
        })
    }
}

/// `center` + G ξ with ξ_j = [`INSIDE`] · `xi`(j).
fn in_generators(of: &Uncertain, center: &[f64], mut xi: impl FnMut(usize) -> f64) -> Vec<f64> {
    let Some(g) = &of.generators else {
        return center.to_vec();
    };
    let xi: Vec<f64> = (0..g.cols()).map(|j| INSIDE * xi(j)).collect();
    center
        .iter()
        .enumerate()
        .map(|(i, c)| c + dot_in_order(g.row(i), &xi))
        .collect()
}

fn dot_in_order(row: &[f64], x: &[f64]) -> f64 {
    row.iter().zip(x).fold(0.0, |s, (a, x)| s + a * x)
}

/// Run `run` of the experiment: x_0 … x_N, y_0 … y_N and u_0 … u_N with N = `steps`.
///
/// `truth` and `inputs` must have passed [`Truth::validate`] and [`Inputs::validate`] for this system
/// and this number of steps; they are checked again.
///
/// Fails where they do not fit, where a truncated law finds no draw in its box, and where the state
/// overflows.
pub fn simulate(
    system: &AnySystem,
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
    let rounding = trajectory_error(system, &x, &u, &w);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::{Linear, Lpv, VanDerPol};

    fn matrix<const N: usize>(rows: &[[f64; N]]) -> Matrix {
        Matrix::from_rows(rows).unwrap()
    }

    fn tracked_point() -> AnySystem {
        AnySystem::Linear(
            Linear::new(
                matrix(&[[0.9, 1.0], [0.0, 0.8]]),
                None,
                matrix(&[[-22.0, 1.0]]),
                None,
            )
            .unwrap(),
        )
    }

    fn lpv() -> AnySystem {
        let (a0, a1) = (
            matrix(&[[0.0, -0.5], [1.0, 1.0]]),
            matrix(&[[0.0, 0.0], [0.0, 0.3]]),
        );
        AnySystem::Lpv(Lpv::new(a0, vec![a1], None, matrix(&[[-2.0, 1.0]])).unwrap())
    }

    fn unit_box(n: usize) -> Uncertain {
        Uncertain::from_box(&vec![-1.0; n], &vec![1.0; n]).unwrap()
    }

    fn drawn(law: Law, of: Uncertain) -> Noise {
        Noise::Drawn(Drawn {
            law,
            of,
            truncate: false,
        })
    }

    fn truth(w: Noise, v: Noise) -> Truth {
        Truth {
            x0: InitialState::Point(vec![5.0, 5.0]),
            w,
            v,
            delta: None,
        }
    }

    fn no_inputs() -> Inputs {
        Inputs::Constant(Vec::new())
    }

    fn message(truth: &Truth, system: &AnySystem) -> String {
        truth.validate(system, 10).unwrap_err().to_string()
    }

    #[test]
    fn a_trajectory_follows_its_equations() {
        let t = truth(
            drawn(Law::Uniform, unit_box(2)),
            drawn(Law::Uniform, unit_box(1)),
        );
        let run = simulate(&tracked_point(), &t, &no_inputs(), 1, 0, 50).unwrap();
        assert_eq!(
            (
                run.x.len(),
                run.y.len(),
                run.u.len(),
                run.w.len(),
                run.v.len()
            ),
            (51, 51, 51, 50, 51)
        );
        assert_eq!(run.x[0], [5.0, 5.0]);
        for k in 0..50 {
            assert_eq!(
                run.x[k + 1][0],
                run.x[k][0] * 0.9 + run.x[k][1] * 1.0 + run.w[k][0]
            );
            assert_eq!(run.x[k + 1][1], run.x[k][1] * 0.8 + run.w[k][1]);
            assert_eq!(
                run.y[k][0],
                run.x[k][0] * -22.0 + run.x[k][1] * 1.0 + run.v[k][0]
            );
        }
        assert!(run.rounding.iter().flatten().all(|&r| r < 1e-13) && run.rounding[50][0] > 0.0);
    }

    #[test]
    fn a_run_depends_on_its_number_and_seed_alone() {
        let t = truth(
            drawn(Law::Uniform, unit_box(2)),
            drawn(Law::Vertices, unit_box(1)),
        );
        let run = |seed, run| simulate(&tracked_point(), &t, &no_inputs(), seed, run, 30).unwrap();
        let third = run(7, 3);
        run(7, 2);
        assert_eq!(run(7, 3), third);
        assert_ne!(run(7, 4).w, third.w);
        assert_ne!(run(8, 3).w, third.w);
        let longer = simulate(&tracked_point(), &t, &no_inputs(), 7, 3, 60).unwrap();
        assert_eq!(longer.x[..31], third.x[..]);
    }

    #[test]
    fn vertices_are_on_the_faces_but_for_the_margin() {
        let t = truth(
            drawn(Law::Vertices, unit_box(2)),
            drawn(Law::Zero, unit_box(1)),
        );
        let run = simulate(&tracked_point(), &t, &no_inputs(), 1, 0, 200).unwrap();
        assert!(run.w.iter().flatten().all(|w| w.abs() == INSIDE));
        let up = run.w.iter().flatten().filter(|&&w| w > 0.0).count();
        assert!((150..250).contains(&up), "{up} of 400");
        assert!(run.v.iter().flatten().all(|&v| v == 0.0));
    }

    #[test]
    fn a_truncated_gaussian_stays_in_its_box_and_keeps_its_shape() {
        let of = Uncertain {
            mean: Some(vec![0.0; 2]),
            covariance: Some(matrix(&[[0.12, 0.0], [0.0, 0.12]])),
            ..unit_box(2)
        };
        let noise = Noise::Drawn(Drawn {
            law: Law::Gaussian,
            of: of.clone(),
            truncate: true,
        });
        let run = simulate(
            &tracked_point(),
            &truth(noise, drawn(Law::Zero, unit_box(1))),
            &no_inputs(),
            1,
            0,
            20_000,
        )
        .unwrap();
        let all: Vec<f64> = run.w.iter().flatten().copied().collect();
        assert!(all.iter().all(|w| w.abs() <= INSIDE));
        let free = simulate(
            &tracked_point(),
            &truth(drawn(Law::Gaussian, of), drawn(Law::Zero, unit_box(1))),
            &no_inputs(),
            1,
            0,
            20_000,
        )
        .unwrap();
        let outside = free.w.iter().flatten().filter(|w| w.abs() > 1.0).count() as f64 / 40_000.0;
        // P(|N(0, 0.12)| > 1) = 0.0038924; four standard errors.
        assert!(
            (outside - 0.003_892_4).abs() < 4.0 * (0.0039_f64 / 40_000.0).sqrt(),
            "{outside}"
        );
        // Draws that were inside at once are the same.
        let changed = all
            .iter()
            .zip(free.w.iter().flatten())
            .filter(|(a, b)| a != b)
            .count();
        assert_eq!(
            changed,
            free.w.iter().flatten().filter(|w| w.abs() > 1.0).count()
        );
        let variance = all.iter().map(|w| w * w).sum::<f64>() / all.len() as f64;
        assert!((0.110..0.122).contains(&variance), "{variance}");
    }

    #[test]
    fn a_box_out_of_reach_is_an_error_and_not_a_loop() {
        let far = Uncertain {
            covariance: Some(matrix(&[[1e-6]])),
            mean: Some(vec![9.0]),
            ..unit_box(1)
        };
        let noise = Noise::Drawn(Drawn {
            law: Law::Gaussian,
            of: far,
            truncate: true,
        });
        let error = simulate(
            &tracked_point(),
            &truth(drawn(Law::Zero, unit_box(2)), noise),
            &no_inputs(),
            1,
            0,
            5,
        );
        assert_eq!(
            error.unwrap_err().to_string(),
            "truth.v, step 0: none of 65536 draws fell into the box"
        );
    }

    #[test]
    fn mixed_noise_has_the_moments_of_the_sum() {
        // W = {L/2, 0}, Q = L Lᵀ/36 with L = 0.02 [[-6, 0], [1, 0]], a covariance of rank 1.
        let q = matrix(&[
            [0.0144 / 36.0, -0.0024 / 36.0],
            [-0.0024 / 36.0, 0.0004 / 36.0],
        ]);
        let of = Uncertain {
            covariance: Some(q),
            ..Uncertain::zonotope(vec![0.0; 2], matrix(&[[-0.06, 0.0], [0.01, 0.0]]))
        };
        let t = Truth {
            delta: Some(DeltaLaw::Zero),
            ..truth(drawn(Law::Mixed, of), drawn(Law::Zero, unit_box(1)))
        };
        let run = simulate(&lpv(), &t, &no_inputs(), 3, 0, 20_000).unwrap();
        let square = run.w.iter().map(|w| w[0] * w[0]).sum::<f64>() / 20_000.0;
        // Var = 0.06²/3 + 0.0144/36 = 0.0016.
        assert!((square / 0.0016 - 1.0).abs() < 0.04, "{square}");
        // Both parts lie along (−6, 1).
        assert!(
            run.w
                .iter()
                .all(|w| (w[0] + 6.0 * w[1]).abs() < 1e-15 && w[2] == 0.0)
        );
    }

    #[test]
    fn delta_follows_its_law_after_the_process_noise() {
        let with = |delta| {
            let of = Uncertain::zonotope(vec![0.0; 2], Matrix::zeros(2, 1));
            let t = Truth {
                delta: Some(delta),
                ..truth(drawn(Law::Uniform, of), drawn(Law::Zero, unit_box(1)))
            };
            let run = simulate(&lpv(), &t, &no_inputs(), 3, 1, 40).unwrap();
            run.w.iter().map(|w| w[2]).collect::<Vec<f64>>()
        };
        let uniform = with(DeltaLaw::Uniform);
        assert!(uniform.iter().all(|d| d.abs() < 1.0) && uniform[0] != uniform[1]);
        assert!(with(DeltaLaw::Sign).iter().all(|d| d.abs() == INSIDE));
        assert!(
            with(DeltaLaw::Constant { value: -0.5 })
                .iter()
                .all(|&d| d == -0.5 * INSIDE)
        );
        let wave = Oscillation {
            period: Some(8.0),
            omega: None,
            dt: None,
            amplitude: 1.0,
            offset: 0.0,
            phase: 0.0,
        };
        assert_eq!(with(DeltaLaw::Sine(wave))[2], INSIDE);
        let signals = vec![vec![Signal::Constant { value: -1.0 }]];
        assert!(
            with(DeltaLaw::Signals { terms: signals })
                .iter()
                .all(|&d| d == -INSIDE)
        );
    }

    #[test]
    fn signals_are_drawn_towards_the_center_of_the_assumed_set() {
        let square = || {
            vec![Signal::Square(crate::signal::Wave {
                period: 4.0,
                amplitude: 1.0,
                offset: 0.0,
                phase: 0.0,
            })]
        };
        let w = Noise::Signals {
            terms: vec![square(), vec![]],
            about: Some(vec![0.0, 0.0]),
        };
        let run = simulate(
            &tracked_point(),
            &truth(w, drawn(Law::Zero, unit_box(1))),
            &no_inputs(),
            1,
            0,
            4,
        )
        .unwrap();
        let first: Vec<f64> = run.w.iter().map(|w| w[0]).collect();
        assert_eq!(first, [INSIDE, INSIDE, -INSIDE, -INSIDE]);
        assert!(run.w.iter().all(|w| w[1] == 0.0));
    }

    #[test]
    fn alternatives_count_with_the_last_component_of_v_fastest() {
        let constant = |value| vec![Signal::Constant { value }];
        let family = |n| Noise::Alternatives {
            alternatives: (0..n)
                .map(|_| vec![constant(0.25), constant(0.5)])
                .collect(),
            about: None,
        };
        let t = truth(family(2), family(1));
        assert_eq!(t.distinct_runs(), Some(8));
        let run = |r| {
            let run = simulate(&tracked_point(), &t, &no_inputs(), 1, r, 1).unwrap();
            [run.w[0][0], run.w[0][1], run.v[0][0]]
        };
        assert_eq!(run(0), [0.25, 0.25, 0.25]);
        assert_eq!(run(1), [0.25, 0.25, 0.5]);
        assert_eq!(run(6), [0.5, 0.5, 0.25]);
        assert_eq!(run(8), run(0));
    }

    #[test]
    fn the_first_state_is_drawn_in_the_prior() {
        let box_prior =
            InitialState::Drawn(Uncertain::from_box(&[-10.0, 2.0], &[10.0, 4.0]).unwrap());
        let gaussian = InitialState::Drawn(Uncertain::gaussian(
            vec![1.0, 2.0],
            matrix(&[[4.0, 0.0], [0.0, 0.0]]),
        ));
        let start = |x0: &InitialState, run| {
            let noise = |n| drawn(Law::Zero, unit_box(n));
            let t = Truth {
                x0: x0.clone(),
                ..truth(noise(2), noise(1))
            };
            simulate(&tracked_point(), &t, &no_inputs(), 1, run, 0)
                .unwrap()
                .x[0]
                .clone()
        };
        let states: Vec<Vec<f64>> = (0..2000).map(|r| start(&box_prior, r)).collect();
        assert!(
            states
                .iter()
                .all(|x| x[0].abs() <= 10.0 && (2.0..=4.0).contains(&x[1]))
        );
        let mean = states.iter().map(|x| x[1]).sum::<f64>() / 2000.0;
        assert!((mean - 3.0).abs() < 0.07, "{mean}");
        let states: Vec<Vec<f64>> = (0..2000).map(|r| start(&gaussian, r)).collect();
        assert!(states.iter().all(|x| x[1] == 2.0));
        let variance = states
            .iter()
            .map(|x| (x[0] - 1.0) * (x[0] - 1.0))
            .sum::<f64>()
            / 2000.0;
        assert!((variance - 4.0).abs() < 0.6, "{variance}");
    }

    #[test]
    fn without_a_truth_the_assumed_sets_are_drawn_from_unless_a_covariance_stands_there() {
        let problem = |w: Uncertain| Problem {
            system: tracked_point(),
            prior: unit_box(2),
            w,
            v: unit_box(1),
        };
        assert_eq!(
            Truth::assumed(&problem(unit_box(2))).unwrap().w,
            drawn(Law::Uniform, unit_box(2))
        );
        let gaussian = Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2));
        assert_eq!(
            Truth::assumed(&problem(gaussian)).unwrap_err().to_string(),
            "truth.w: expected it to be given: only a covariance is assumed, got nothing"
        );
        let both = Uncertain {
            covariance: Some(Matrix::identity(2)),
            ..unit_box(2)
        };
        assert_eq!(
            Truth::assumed(&problem(both)).unwrap_err().to_string(),
            "truth.w: expected it to be given: a set and a covariance are assumed, and the truth can follow either, got nothing"
        );
    }

    #[test]
    fn a_truth_that_does_not_fit_is_refused() {
        let zero = |n| drawn(Law::Zero, unit_box(n));
        let point = || tracked_point();
        let short = Truth {
            x0: InitialState::Point(vec![1.0]),
            ..truth(zero(2), zero(1))
        };
        assert_eq!(
            message(&short, &point()),
            "truth.x0: expected 2 numbers, got 1"
        );
        let no_set = truth(
            drawn(
                Law::Uniform,
                Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2)),
            ),
            zero(1),
        );
        assert_eq!(
            message(&no_set, &point()),
            "truth.w: expected a box or generators for this law, got none"
        );
        let no_covariance = truth(drawn(Law::Mixed, unit_box(2)), zero(1));
        assert_eq!(
            message(&no_covariance, &point()),
            "truth.w: expected a covariance for this law, got none"
        );
        let data = truth(Noise::Data(vec![vec![0.0; 2]; 3]), zero(1));
        assert_eq!(
            message(&data, &point()),
            "truth.w: expected data for 10 steps, got 3"
        );
        let delta = Truth {
            delta: Some(DeltaLaw::Uniform),
            ..truth(zero(2), zero(1))
        };
        assert_eq!(
            message(&delta, &point()),
            "truth.delta: expected no delta: the system has none, got a law"
        );
        assert_eq!(
            message(&truth(zero(2), zero(1)), &lpv()),
            "truth.delta: expected a law, got none"
        );
        let large = Truth {
            delta: Some(DeltaLaw::Constant { value: 2.0 }),
            ..truth(zero(2), zero(1))
        };
        assert_eq!(
            message(&large, &lpv()),
            "truth.delta: expected a value in [-1, 1], got 2"
        );
        let signal = Noise::Signals {
            terms: vec![vec![], vec![Signal::Constant { value: f64::NAN }]],
            about: None,
        };
        assert_eq!(
            message(&truth(signal, zero(1)), &point()),
            "truth.w, component 2: value: expected a finite number, got NaN"
        );
    }

    #[test]
    fn a_state_that_overflows_is_an_error_with_its_step() {
        let system = AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap());
        let zero = |n| drawn(Law::Zero, unit_box(n));
        let t = Truth {
            x0: InitialState::Point(vec![1e3, 1e3]),
            ..truth(zero(2), zero(1))
        };
        let error = simulate(&system, &t, &no_inputs(), 1, 4, 100).unwrap_err();
        assert!(
            matches!(error, SimulationError::Diverged { run: 4, k: 1..20 }),
            "{error}"
        );
    }
}
