//! The unscented Kalman filter in its scaled form.

use super::innovation::gain;
use super::kalman::{Gaussian, Innovated};
use super::moments::Model;
use crate::error::before;
use crate::estimator::{Estimator, Measurement, Phase};
use crate::{EstimationError, Problem};
use serde::{Deserialize, Serialize};
use zonobench_sets::covariance::Scaled;
use zonobench_sets::number::Function;
use zonobench_sets::{List, Matrix};

const KIND: &str = "ukf";

/// The settings of [`Ukf`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UkfSettings {
    /// α > 0: how far the points are spread.
    #[serde(default = "one")]
    pub alpha: f64,
    /// β ≥ 0: what is known of the fourth moment; 2 for a Gaussian.
    #[serde(default = "two")]
    pub beta: f64,
    /// κ > −(n + n_w) and > −(n + n_v).
    #[serde(default)]
    pub kappa: f64,
    /// Whether differences of components in rad are taken in (−π, π].
    #[serde(default)]
    pub wrap: bool,
}

fn one() -> f64 {
    1.0
}

fn two() -> f64 {
    2.0
}

/// The unscented Kalman filter, Julier's scaled form on the state with its noise.
///
/// Of an argument a ~ (ā, A) of L numbers the points are a_0 = ā and ā ± γ s_j, s_j the columns of a factor of A,
/// γ = α √(L + κ). With their images z_i and d_i = z_i − z_0 the image's mean and covariance are z̄ = z_0 + δ and
/// Z = Σ_{i ≥ 1} W d_i d_iᵀ + (β − α²) δ δᵀ with W = 1/(2 γ²), δ = Σ_{i ≥ 1} W d_i. That is the scaled form, with the weights
/// λ/(L + λ) and λ/(L + λ) + 1 − α² + β of the center for λ = α² (L + κ) − L, whose large terms have cancelled; for
/// α² ≤ β it is positive semidefinite.
///
/// predict: a = (x, w), z = f(k−1, x, u, w); update: a = (x, v) about the prediction, z = h(k, x, u, v), K = P_xz S⁻¹ with S = Z,
/// x̂ = x̂⁻ + K (y − z̄), P = Σ W (e_i − K d_i)(e_i − K d_i)ᵀ + (β − α²) K δ (K δ)ᵀ, e_i = x_i − x̂⁻: Joseph's form in
/// points, symmetric by construction.
///
/// Defaults: α = 1, β = 2, κ = 0. A small α, such as the usual 10⁻³, costs digits, as z_i − z_0 loses those that both
/// share and is divided by α². Moments, missing components, `wrap` and singular S are as in [`Ekf`](super::Ekf); a
/// covariance that is not positive semidefinite, which only α² > β allows, is [`EstimationError::Singular`]
/// in a prediction and the status `singular` in an update. On a linear system it is the Kalman filter.
///
/// The updated belief has read y_0 … y_k. No set, so never guaranteed.
///
/// Source: [Julier2002, Sec. 3].
#[derive(Clone, Debug)]
pub struct Ukf {
    model: Model,
    settings: UkfSettings,
    /// Factors of the covariances of w and v.
    w: Matrix,
    v: Matrix,
}

/// The images of a set of points, as deviations from that of the center.
struct Images {
    /// z_0.
    center: List<f64>,
    /// δ, so that z_0 + δ is the mean.
    shift: List<f64>,
    /// √W d_i, a column each.
    deviations: Matrix,
}

impl Ukf {
    /// Fails where a setting is out of range or a part of the problem has no moments.
    pub fn new(settings: &UkfSettings, problem: &Problem) -> Result<Self, EstimationError> {
        let refuse = |key, expected: String, got: f64| {
            Err(EstimationError::setting(KIND, key, expected, got))
        };
        let UkfSettings {
            alpha, beta, kappa, ..
        } = *settings;
        if !(alpha > 0.0 && alpha.is_finite()) {
            return refuse("alpha", "above 0".into(), alpha);
        }
        if !(beta >= 0.0 && beta.is_finite()) {
            return refuse("beta", "at least 0".into(), beta);
        }
        let model = Model::new(KIND, problem, settings.wrap)?;
        let least = model.n() + model.w.mean.len().min(model.v.mean.len());
        if !(kappa > -(least as f64) && kappa.is_finite()) {
            return refuse("kappa", format!("above {}", -(least as f64)), kappa);
        }
        Ok(Self {
            settings: settings.clone(),
            w: Scaled::new(&model.w.covariance).factor(),
            v: Scaled::new(&model.v.covariance).factor(),
            model,
        })
    }

    /// γ for L numbers.
    fn spread(&self, l: usize) -> f64 {
        self.settings.alpha * (l as f64 + self.settings.kappa).sqrt()
    }

    /// β − α², the weight of δ δᵀ.
    fn excess(&self) -> f64 {
        self.settings.beta - self.settings.alpha * self.settings.alpha
    }

    /// `f` of the points about (`x`, `noise`) with the factors of both covariances; `difference` subtracts components
    /// of the image.
    fn images<F: Function>(
        &self,
        f: &F,
        (x, factor_x): (&[f64], &Matrix),
        (noise, factor_noise): (&[f64], &Matrix),
        difference: impl Fn(usize, f64, f64) -> f64,
    ) -> Images {
        let (n, l, m) = (x.len(), x.len() + noise.len(), f.outputs());
        let spread = self.spread(l);
        let root = 1.0 / (2.0_f64.sqrt() * spread);
        let mut at: List<f64> = List::concat(&[x, noise]);
        let mut center = List::filled(0.0, m);
        f.evaluate(&at, &mut center);
        let mut image = List::filled(0.0, m);
        let mut deviations = Matrix::zeros(m, 2 * l);
        let mut shift = List::filled(0.0, m);
        for j in 0..l {
            for (side, sign) in [(0, spread), (1, -spread)] {
                let (offset, factor, column) = match j < n {
                    true => (0, factor_x, j),
                    false => (n, factor_noise, j - n),
                };
                let middle = if j < n { x } else { noise };
                for (i, middle) in middle.iter().enumerate() {
                    at[offset + i] = middle + sign * factor[(i, column)];
                }
                f.evaluate(&at, &mut image);
                for (i, middle) in middle.iter().enumerate() {
                    at[offset + i] = *middle;
                }
                for i in 0..m {
                    deviations[(i, 2 * j + side)] = root * difference(i, image[i], center[i]);
                }
            }
            // In pairs, so that what is odd cancels before anything is added.
            for (i, shift) in shift.iter_mut().enumerate() {
                *shift += root * (deviations[(i, 2 * j)] + deviations[(i, 2 * j + 1)]);
            }
        }
        Images {
            center,
            shift,
            deviations,
        }
    }

    /// Σ D Dᵀ + (β − α²) δ δᵀ of deviations D; None where that is not positive semidefinite.
    fn covariance(&self, deviations: &Matrix, shift: &[f64]) -> Option<Matrix> {
        let excess = self.excess();
        let mut p = deviations.gram();
        if excess != 0.0 {
            for i in 0..shift.len() {
                for j in 0..shift.len() {
                    p[(i, j)] += excess * (shift[i] * shift[j]);
                }
            }
        }
        (excess >= 0.0 || Scaled::new(&p).check().is_ok()).then_some(p)
    }
}

/// The rows `rows` of a matrix.
fn rows_of(m: &Matrix, rows: &[usize]) -> Matrix {
    Matrix::from_fn(rows.len(), m.cols(), |i, j| m[(rows[i], j)])
}

impl Estimator for Ukf {
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
        let factor = Scaled::new(&belief.covariance).factor();
        let images = self.images(
            &model.motion(before(k)?, u_prev),
            (&belief.mean, &factor),
            (&model.w.mean, &self.w),
            |i, a, b| model.difference_x(i, a, b),
        );
        let numbers = images.center.iter().chain(images.deviations.as_slice());
        model.defined(k, "f", numbers.copied())?;
        let mean = images.center.iter().zip(&images.shift).map(|(c, d)| c + d);
        let covariance = self.covariance(&images.deviations, &images.shift);
        let covariance = covariance.ok_or_else(|| EstimationError::Singular {
            k,
            op: "predict",
            reason: "the covariance of the points is not positive semidefinite; alpha^2 <= beta keeps it so".into(),
        })?;
        Gaussian::new(mean.collect(), covariance).finite(k, "predict")
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
        let n = model.n();
        let factor = Scaled::new(&belief.covariance).factor();
        let images = self.images(
            &model.output(k, u),
            (&belief.mean, &factor),
            (&model.v.mean, &self.v),
            |i, a, b| model.difference_y(i, a, b),
        );
        let dy = rows_of(&images.deviations, &rows);
        let numbers = rows.iter().map(|&i| images.center[i]);
        model.defined(k, "h", numbers.chain(dy.as_slice().iter().copied()))?;
        let shift: List<f64> = rows.iter().map(|&i| images.shift[i]).collect();
        // √W e_i: γ s_j times √W is s_j / √2, and noise does not move x.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let dx = Matrix::from_fn(n, dy.cols(), |i, j| match (j / 2 < n, j % 2) {
            (false, _) => 0.0,
            (true, 0) => half * factor[(i, j / 2)],
            (true, _) => -half * factor[(i, j / 2)],
        });
        let (mut z, mut sizes) = (
            List::with_capacity(rows.len()),
            List::with_capacity(rows.len()),
        );
        for ((&i, y), shift) in rows.iter().zip(y.iter().flatten()).zip(&shift) {
            let expected = images.center[i] + shift;
            z.push(model.difference_y(i, *y, expected));
            sizes.push(y.abs() + expected.abs() + images.center[i].abs());
        }
        let Some(s) = self.covariance(&dy, &shift) else {
            return Ok(belief.clone().singular());
        };
        // Each entry is a sum of as many squares as there are points, of differences of numbers that are rounded.
        let unit = (4 * dy.cols() + 8) as f64 * f64::EPSILON;
        let rounding = || {
            let row = |i: usize| unit * dy.row(i).iter().map(|d| d * d).sum::<f64>();
            (0..dy.rows()).map(row).collect()
        };
        let solved = gain(&dx.mul_transpose(&dy), &s, rounding)
            .map_err(EstimationError::at(k, "gain"))
            .and_then(|(gain, range)| match range {
                None => Ok((gain, Innovated::new(&s, &z))),
                Some(range) => range.check(k, "gain", &z, &sizes).map(|()| (gain, None)),
            });
        let (gain, innovated) = match solved {
            Err(EstimationError::Singular { .. }) => return Ok(belief.clone().singular()),
            solved => solved?,
        };
        let mut mean = belief.mean.clone();
        gain.add_mul_vec(&z, &mut mean);
        let left = dx.sub(&gain.mul(&dy));
        let Some(covariance) = self.covariance(&left, &gain.mul_vec(&shift)) else {
            return Ok(belief.clone().singular());
        };
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
