//! The extended Kalman filter, which everybody knows and compares with.

use super::innovation::Innovation;
use super::kalman::{Gaussian, Innovated};
use super::linear_output::{complement, congruence};
use super::moments::Model;
use crate::error::before;
use crate::estimator::{Estimator, Measurement, Phase};
use crate::{EstimationError, Problem};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::{Jacobian, jacobian};
use zonobench_sets::{List, Matrix};

const KIND: &str = "ekf";

/// The settings of [`Ekf`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EkfSettings {
    /// Whether differences of measurements in rad are taken in (−π, π].
    #[serde(default)]
    pub wrap: bool,
}

/// The extended Kalman filter, linearised about its estimate by the system's own derivatives:
///
/// predict: x̂⁻ = f(k−1, x̂, u, w̄), P⁻ = F P Fᵀ + G Q Gᵀ with F = ∂f/∂x, G = ∂f/∂w at (x̂, w̄);
/// update: z = y − h(k, x̂⁻, u, v̄), S = H P⁻ Hᵀ + V R Vᵀ with H = ∂h/∂x, V = ∂h/∂v at (x̂⁻, v̄), K = P⁻ Hᵀ S⁻¹,
/// x̂ = x̂⁻ + K z, P = (I − K H) P⁻ (I − K H)ᵀ + K V R Vᵀ Kᵀ (Joseph's form, symmetric by construction).
///
/// w̄, Q and v̄, R are mean and covariance of the assumed noises; of a set alone they are those of c + G ξ with
/// uniform ξ, c and G Gᵀ/3, and the parameters δ of an `lpv` system are uniform in [−1, 1]. Components of y that were
/// not measured are left out. With `wrap`, z is taken in (−π, π] where a component's unit is rad; the estimates
/// themselves are not wrapped.
///
/// S may be singular, as in [`Kalman`](super::Kalman). Where it is not positive semidefinite, or calls the innovation
/// impossible, nothing is taken in: the belief is the prediction, with the status `singular`, and the run goes on.
/// Where f or h is not defined at the estimate, the filter refuses to go on. On a linear system it is the Kalman filter.
///
/// The updated belief has read y_0 … y_k. No set, so never guaranteed.
///
/// Source: [Jazwinski1970, Sec. 8.3].
#[derive(Clone, Debug)]
pub struct Ekf {
    model: Model,
}

impl Ekf {
    /// Fails where a part of the problem has no moments: a set with constraints without a covariance.
    pub fn new(settings: &EkfSettings, problem: &Problem) -> Result<Self, EstimationError> {
        Ok(Self {
            model: Model::new(KIND, problem, settings.wrap)?,
        })
    }
}

/// Columns `from` to `to` of rows `rows` of a Jacobian.
fn part(j: &Jacobian<f64>, rows: &[usize], from: usize, to: usize) -> Matrix {
    Matrix::from_fn(rows.len(), to - from, |i, l| j.get(rows[i], from + l))
}

impl Estimator for Ekf {
    type Belief = Gaussian;

    fn prior(&self) -> Gaussian {
        Gaussian::new(
            self.model.prior.mean.clone(),
            self.model.prior.covariance.clone(),
        )
    }

    fn predict(
        &self,
        k: usize,
        belief: &Gaussian,
        u_prev: &[f64],
    ) -> Result<Gaussian, EstimationError> {
        let model = &self.model;
        model.check_input(u_prev)?;
        let at = List::concat(&[&belief.mean, &model.w.mean]);
        let j = jacobian(&model.motion(before(k)?, u_prev), &at);
        let numbers = j.value.iter().chain(j.as_slice()).copied();
        model.defined(k, "f or its derivative", numbers)?;
        let n = model.n();
        let rows: List<usize> = (0..n).collect();
        let mut covariance = congruence(&part(&j, &rows, 0, n), &belief.covariance);
        covariance.add_assign(&congruence(
            &part(&j, &rows, n, at.len()),
            &model.w.covariance,
        ));
        Gaussian::new(j.value, covariance).finite(k, "predict")
    }

    fn update(
        &self,
        k: usize,
        belief: &Gaussian,
        u: &[f64],
        y: Measurement,
    ) -> Result<Gaussian, EstimationError> {
        let model = &self.model;
        let rows = model.measured(u, y)?;
        if rows.is_empty() {
            return Ok(belief.clone());
        }
        let at = List::concat(&[&belief.mean, &model.v.mean]);
        let j = jacobian(&model.output(k, u), &at);
        let numbers = rows.iter().flat_map(|&i| {
            let value = std::iter::once(j.value[i]);
            value.chain(j.row(i).iter().copied())
        });
        model.defined(k, "h or its derivative", numbers)?;
        let n = model.n();
        let (c, d) = (part(&j, &rows, 0, n), part(&j, &rows, n, at.len()));
        let (mut z, mut sizes) = (
            List::with_capacity(rows.len()),
            List::with_capacity(rows.len()),
        );
        let p0 = congruence(&c, &model.prior.covariance);
        for (place, (&i, y)) in rows.iter().zip(y.iter().flatten()).enumerate() {
            z.push(model.difference_y(i, *y, j.value[i]));
            let terms = c.row(place).iter().zip(&belief.mean);
            let spread: f64 = terms.map(|(c, x)| (c * x).abs()).sum();
            let allowed = p0[(place, place)].max(0.0).sqrt();
            sizes.push(y.abs() + j.value[i].abs() + spread + allowed);
        }
        let p = &belief.covariance;
        let r = congruence(&d, &model.v.covariance);
        let pct = p.mul_transpose(&c);
        let mut s = c.mul(&pct);
        s.add_assign(&r);
        let innovation = Innovation {
            c: &c,
            p,
            pct: &pct,
            r: &r,
            s: &s,
        };
        let gain = innovation.gain().map_err(EstimationError::at(k, "gain"));
        let gain = gain.and_then(|(gain, range)| match range {
            None => Ok((gain, Innovated::new(&s, &z))),
            Some(range) => range.check(k, "gain", &z, &sizes).map(|()| (gain, None)),
        });
        let (gain, innovated) = match gain {
            Err(EstimationError::Singular { .. }) => return Ok(belief.clone().singular()),
            gain => gain?,
        };
        let mut mean = belief.mean.clone();
        gain.add_mul_vec(&z, &mut mean);
        let mut covariance = congruence(&complement(&gain, &c), p);
        covariance.add_assign(&congruence(&gain, &r));
        Gaussian::new(mean, covariance)
            .after(innovated)
            .finite(k, "update")
    }

    fn guaranteed(&self) -> bool {
        false
    }
    fn reads(&self) -> &'static str {
        "y_0 to y_k"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Updated
    }
    fn readings(&self) -> Vec<(&'static str, &'static str)> {
        self.model.sources()
    }
}
