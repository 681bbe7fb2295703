//! What the filters that know nothing but mean and covariance take from a problem: its system, the moments of
//! what it assumes, and which components are angles.
//!
//! `ekf`, `ukf` and `particle` share it, so that all three read a problem alike.

use super::linear_output::check_measurement;
use crate::error::finite_vector;
use crate::estimator::Measurement;
use crate::system::{AnySystem, System};
use crate::{EstimationError, Problem, Uncertain};
use zonobench_sets::number::{Function, Real};
use zonobench_sets::se2::wrap;
use zonobench_sets::{List, Matrix};

/// The mean and the covariance of an uncertain vector.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// The mean.
    pub mean: List<f64>,
    /// The covariance, positive semidefinite.
    pub covariance: Matrix,
    /// Where they are from: `covariance`, `uniform` or `none`.
    pub source: &'static str,
}

impl Moments {
    /// m and Σ where a covariance is given; c and G Gᵀ/3 of a set alone, the moments of c + G ξ with ξ uniform in
    /// [−1, 1]^p; else c, or m, and no spread.
    ///
    /// Fails for a set with constraints, whose moments are not computed, and where G Gᵀ overflows.
    fn new(
        kind: &'static str,
        key: &'static str,
        part: &Uncertain,
    ) -> Result<Self, EstimationError> {
        let set = part.generators.as_ref().filter(|_| !part.has_gaussian());
        let Some(g) = set else {
            return Ok(Self {
                mean: part.gaussian_mean().into(),
                covariance: part.covariance_matrix(),
                source: match part.has_gaussian() {
                    true => "covariance",
                    false => "none",
                },
            });
        };
        if part.constraints.is_some() {
            let expected = "given beside a set with constraints, whose moments are not computed";
            return Err(EstimationError::setting(kind, key, expected, "nothing"));
        }
        let covariance = g.gram().divide(3.0);
        if !covariance.is_finite() {
            let expected = "given beside a set whose variances are beyond 1.8e308";
            return Err(EstimationError::setting(kind, key, expected, "nothing"));
        }
        Ok(Self {
            mean: part.center.as_slice().into(),
            covariance,
            source: "uniform",
        })
    }

    /// These and those of parameters that are independent of them, uniform in [−1, 1].
    fn and_parameters(mut self, n: usize) -> Self {
        let (before, after) = (self.mean.len(), self.mean.len() + n);
        self.mean.resize(after, 0.0);
        self.covariance = Matrix::from_fn(after, after, |i, j| {
            if i < before && j < before {
                self.covariance[(i, j)]
            } else {
                f64::from(u8::from(i == j)) / 3.0
            }
        });
        self
    }
}

/// A problem in mean and covariance.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub kind: &'static str,
    pub system: AnySystem,
    pub prior: Moments,
    /// Of w, and of δ after it.
    pub w: Moments,
    pub v: Moments,
    n_u: usize,
    n_y: usize,
    /// Components of the state and of the measurement whose differences are taken in (−π, π].
    pub angles_x: List<bool>,
    pub angles_y: List<bool>,
}

impl Model {
    /// `wrap` makes the differences of components in rad those of angles.
    ///
    /// Fails where a part has no moments, as [`Moments::new`] says.
    pub fn new(kind: &'static str, problem: &Problem, wrap: bool) -> Result<Self, EstimationError> {
        let variables = problem.system.variables();
        let w = Moments::new(kind, "noise.w.covariance", &problem.w)?;
        let angles = |list: &[crate::system::Variable]| {
            list.iter().map(|v| wrap && v.unit == "rad").collect()
        };
        Ok(Self {
            kind,
            prior: Moments::new(kind, "prior.covariance", &problem.prior)?,
            w: w.and_parameters(problem.system.n_delta()),
            v: Moments::new(kind, "noise.v.covariance", &problem.v)?,
            n_u: variables.u.len(),
            n_y: variables.y.len(),
            angles_x: angles(&variables.x),
            angles_y: angles(&variables.y),
            system: problem.system.clone(),
        })
    }

    /// n.
    pub fn n(&self) -> usize {
        self.prior.mean.len()
    }

    /// The length of y.
    pub fn n_y(&self) -> usize {
        self.n_y
    }

    /// Where the moments of each part are from, for the table of estimators.
    pub fn sources(&self) -> Vec<(&'static str, &'static str)> {
        vec![
            ("prior", self.prior.source),
            ("w", self.w.source),
            ("v", self.v.source),
        ]
    }

    /// Fails where `u` has the wrong length or a number that is not finite.
    pub fn check_input(&self, u: &[f64]) -> Result<(), EstimationError> {
        finite_vector("input u", u, self.n_u)
    }

    /// The components that were measured. Fails where `u` or `y` is not what it must be.
    pub fn measured(&self, u: &[f64], y: Measurement) -> Result<List<usize>, EstimationError> {
        self.check_input(u)?;
        check_measurement(y, self.n_y)?;
        Ok((0..y.len()).filter(|&i| y[i].is_some()).collect())
    }

    /// (x, w) ↦ f(k, x, u, w).
    pub fn motion<'a>(&'a self, k: usize, u: &'a [f64]) -> Motion<'a> {
        Motion { model: self, k, u }
    }

    /// (x, v) ↦ h(k, x, u, v).
    pub fn output<'a>(&'a self, k: usize, u: &'a [f64]) -> Output<'a> {
        Output { model: self, k, u }
    }

    /// a − b of component `i` of the state.
    pub fn difference_x(&self, i: usize, a: f64, b: f64) -> f64 {
        difference(self.angles_x[i], a, b)
    }

    /// a − b of component `i` of the measurement.
    pub fn difference_y(&self, i: usize, a: f64, b: f64) -> f64 {
        difference(self.angles_y[i], a, b)
    }

    /// Fails where `numbers` holds a NaN: the equations are not defined there.
    pub fn defined(
        &self,
        k: usize,
        what: &str,
        mut numbers: impl Iterator<Item = f64>,
    ) -> Result<(), EstimationError> {
        if numbers.any(f64::is_nan) {
            return Err(EstimationError::Refused {
                k,
                kind: self.kind,
                reason: format!("{what} is not defined at the estimate"),
            });
        }
        Ok(())
    }
}

/// a − b, in (−π, π] of an angle.
pub(super) fn difference(angle: bool, a: f64, b: f64) -> f64 {
    match angle {
        true => wrap(a - b),
        false => a - b,
    }
}

/// (x, w) ↦ f(k, x, u, w), a function of n + n_w numbers.
pub(super) struct Motion<'a> {
    model: &'a Model,
    k: usize,
    u: &'a [f64],
}

impl Function for Motion<'_> {
    fn inputs(&self) -> usize {
        self.model.n() + self.model.w.mean.len()
    }
    fn outputs(&self) -> usize {
        self.model.n()
    }
    fn evaluate<S: Real>(&self, z: &[S], next: &mut [S]) {
        let (x, w) = z.split_at(self.model.n());
        self.model.system.f(self.k, x, self.u, w, next);
    }
}

/// (x, v) ↦ h(k, x, u, v), a function of n + n_v numbers.
pub(super) struct Output<'a> {
    model: &'a Model,
    k: usize,
    u: &'a [f64],
}

impl Function for Output<'_> {
    fn inputs(&self) -> usize {
        self.model.n() + self.model.v.mean.len()
    }
    fn outputs(&self) -> usize {
        self.model.n_y()
    }
    fn evaluate<S: Real>(&self, z: &[S], y: &mut [S]) {
        let (x, v) = z.split_at(self.model.n());
        self.model.system.h(self.k, x, self.u, v, y);
    }
}
