//! The Kalman filter, against which the set estimators are compared.

use super::innovation::Innovation;
use super::linear_output::{LinearOutput, complement, congruence};
use crate::error::finite_vector;
use crate::estimator::{Belief, Containment, Estimator, Extra, Measurement, Phase, Shape, Size};
use crate::{EstimationError, Problem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::{Interval, IntervalVector, List, Matrix};

const KIND: &str = "kalman";

/// The Kalman filter has no settings: it reads mean and covariance of the prior and of both noises.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KalmanSettings {}

/// How far a measurement was from what was expected, as the filter saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovated {
    /// zᵀ S⁻¹ z of the innovation z and its covariance S.
    pub squared: f64,
    /// The number of components measured.
    pub components: usize,
}

impl Innovated {
    /// zᵀ S⁻¹ z, or None where S has no Cholesky factor.
    pub(super) fn new(s: &Matrix, z: &[f64]) -> Option<Self> {
        let squared = match z {
            [z] => z * z / s[(0, 0)],
            z => {
                let solved = s.cholesky().ok()?.solve_by_factor(&Matrix::column(z));
                z.iter().zip(solved.as_slice()).map(|(z, w)| z * w).sum()
            }
        };
        Some(Self {
            squared,
            components: z.len(),
        })
    }
}

/// N(x̂, P). It has no set. Its extra numbers, after a measurement whose innovation has a regular covariance: `nis`,
/// zᵀ S⁻¹ z, and `nis_components`, the number of components measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// x̂.
    pub mean: List<f64>,
    /// P, n × n, symmetric.
    pub covariance: Matrix,
    /// What was measured last, beside what was expected.
    pub innovated: Option<Innovated>,
    /// True if the last measurement was not taken in, because its innovation has no covariance.
    pub singular: bool,
}

impl Gaussian {
    /// N(`mean`, `covariance`), before a measurement.
    pub fn new(mean: List<f64>, covariance: Matrix) -> Self {
        Self {
            mean,
            covariance,
            innovated: None,
            singular: false,
        }
    }

    /// After a measurement.
    pub(super) fn after(mut self, innovated: Option<Innovated>) -> Self {
        self.innovated = innovated;
        self
    }

    /// After a measurement that was not taken in.
    pub(super) fn singular(mut self) -> Self {
        self.singular = true;
        self
    }

    /// Itself, or `Overflow` at step `k`.
    pub(super) fn finite(self, k: usize, op: &'static str) -> Result<Self, EstimationError> {
        if self.mean.iter().all(|x| x.is_finite()) && self.covariance.is_finite() {
            Ok(self)
        } else {
            Err(EstimationError::Overflow { k, op })
        }
    }
}

impl Belief for Gaussian {
    fn center(&self) -> Vec<f64> {
        self.mean.to_vec()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        None
    }
    fn contains(&self, _x: &[Interval]) -> Containment {
        Containment::Undecided
    }
    fn covariance(&self) -> Option<&Matrix> {
        Some(&self.covariance)
    }
    fn size(&self) -> Size {
        Size::default()
    }
    fn shape(&self) -> Shape {
        Shape {
            kind: "gaussian",
            center: self.mean.to_vec(),
            covariance: Some(self.covariance.clone()),
            ..Shape::default()
        }
    }
    fn extras(&self) -> Vec<Extra> {
        extras(self.innovated)
    }
    fn status(&self) -> Option<&'static str> {
        self.singular.then_some("singular")
    }
}

/// What metrics may ask of a measurement.
pub(super) fn extras(innovated: Option<Innovated>) -> Vec<Extra> {
    let named = |i: Innovated| vec![("nis", i.squared), ("nis_components", i.components as f64)];
    innovated.map_or_else(Vec::new, named)
}

/// The Kalman filter of a linear time-invariant system:
///
/// predict: x̂⁻ = A x̂ + B u + d_e, P⁻ = A P Aᵀ + Γ_d;
/// update: S = C P⁻ Cᵀ + Γ_v, K = P⁻ Cᵀ S⁻¹, x̂ = x̂⁻ + K (y − C x̂⁻ − D u − v_e), and
/// P = (I − K C) P⁻ (I − K C)ᵀ + K Γ_v Kᵀ (Joseph's form, symmetric by construction).
///
/// S may be singular: sensors without noise, a state without uncertainty. Then K = P⁻ Cᵀ S⁻ with a generalized
/// inverse, which attains the least error, too; for an innovation in the range of S all of them give the same x̂. One
/// outside of it, by more than half of its digits, has the probability zero: [`EstimationError::Singular`]. A mean or
/// covariance beyond the largest f64 is [`EstimationError::Overflow`].
///
/// Rows of y that were not measured are left out. The updated belief has read y_0 … y_k, the predicted
/// one y_0 … y_{k−1}. No set, so never guaranteed.
///
/// Source: [MeslemRamdani, Sec. II]. The paper reports the *prediction*, x̂_{k|k−1}.
#[derive(Clone, Debug)]
pub struct Kalman {
    a: Matrix,
    b: Matrix,
    output: LinearOutput,
    prior: Gaussian,
    w_mean: Vec<f64>,
    w_covariance: Matrix,
}

impl Kalman {
    /// Fails where the system is not linear or a covariance is missing.
    pub fn new<Y: System>(
        _settings: &KalmanSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        problem.validate()?;
        let Some(parts) = problem.system.linear_parts() else {
            return Err(EstimationError::Unsupported {
                kind: KIND,
                what: problem.system.kind(),
                reason: "it needs a system of kind linear".into(),
            });
        };
        let parts_with_covariance = [
            ("prior.covariance", &problem.prior),
            ("noise.w.covariance", &problem.w),
            ("noise.v.covariance", &problem.v),
        ];
        for (key, part) in parts_with_covariance {
            if !part.has_gaussian() {
                return Err(EstimationError::setting(KIND, key, "given", "nothing"));
            }
        }
        let prior = Gaussian::new(
            problem.prior.gaussian_mean().into(),
            problem.prior.covariance_matrix(),
        );
        let mean = problem.v.gaussian_mean().into();
        let output = LinearOutput::new(parts.c, parts.d, mean, &problem.v);
        Ok(Self {
            a: parts.a,
            b: parts.b,
            output,
            prior,
            w_mean: problem.w.gaussian_mean().to_vec(),
            w_covariance: problem.w.covariance_matrix(),
        })
    }
}

impl Estimator for Kalman {
    type Belief = Gaussian;

    fn prior(&self) -> Gaussian {
        self.prior.clone()
    }

    fn predict(
        &self,
        k: usize,
        belief: &Gaussian,
        u_prev: &[f64],
    ) -> Result<Gaussian, EstimationError> {
        finite_vector("input u", u_prev, self.b.cols())?;
        let mut mean = self.a.mul_vec(&belief.mean);
        self.b.add_mul_vec(u_prev, &mut mean);
        for (x, w) in mean.iter_mut().zip(&self.w_mean) {
            *x += w;
        }
        let mut covariance = congruence(&self.a, &belief.covariance);
        covariance.add_assign(&self.w_covariance);
        Gaussian::new(mean, covariance).finite(k, "predict")
    }

    fn update(
        &self,
        k: usize,
        belief: &Gaussian,
        u: &[f64],
        y: Measurement,
    ) -> Result<Gaussian, EstimationError> {
        let (output, z) = self.output.observe(u, y)?;
        if z.is_empty() {
            return Ok(belief.clone());
        }
        let p = &belief.covariance;
        let pct = p.mul_transpose(&output.c);
        let mut s = output.c.mul(&pct);
        s.add_assign(&output.covariance);
        let (gain, range) = Innovation {
            c: &output.c,
            p,
            pct: &pct,
            r: &output.covariance,
            s: &s,
        }
        .gain()
        .map_err(EstimationError::at(k, "gain"))?;
        let mut innovation = z.clone();
        output.c.sub_mul_vec(&belief.mean, &mut innovation);
        let innovated = match &range {
            None => Innovated::new(&s, &innovation),
            Some(range) => {
                let sizes = output.sizes(&belief.mean, u, &z, &self.prior.covariance);
                range.check(k, "gain", &innovation, &sizes)?;
                None
            }
        };
        let mut mean = belief.mean.clone();
        gain.add_mul_vec(&innovation, &mut mean);
        let mut covariance = congruence(&complement(&gain, &output.c), p);
        covariance.add_assign(&congruence(&gain, &output.covariance));
        Gaussian::new(mean, covariance)
            .after(innovated)
            .finite(k, "update")
    }

    fn guaranteed(&self) -> bool {
        false
    }
    fn reads(&self) -> &'static str {
        "y_{k-1} (predicted), y_k (updated)"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Predicted
    }
}
