//! EZGKF: the extended zonotopic and Gaussian Kalman filter.

use super::mixed::{Gain, MixedBelief, MixedModel, MixedSettings};
use super::scale::Scale;
use crate::estimator::{Estimator, Measurement, Phase};
use crate::{AnySystem, EstimationError, Problem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::{List, Matrix};

/// Settings of `ezgkf` and `ezgkf-m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EzgkfSettings {
    /// φ, the number of generators kept between steps; at least n.
    pub phi: usize,
    /// η in [0, 1]: the weight of the Gaussian part in the gain; 0 is a zonotopic filter.
    pub eta: f64,
    /// α in (0, 1): the confidence box is made for the probability 1 − α.
    pub alpha: f64,
    /// Which R^zg enters the gain.
    #[serde(default)]
    pub gain: Gain,
    /// Whether Eq. (26) has its overbars, without which it bounds nothing; true unless given.
    #[serde(default = "with_overbars")]
    pub overbars: bool,
    /// Whether parallel generators are merged before the gain: the same set with fewer generators,
    /// hence another weight tr(G Gᵀ) and another gain. Not in the paper; false unless given.
    #[serde(default)]
    pub merge_parallel: bool,
    /// In which units generators are compared when the order is reduced, and |M| of Eq. (26) is taken; those of the state unless given.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
}

pub(super) fn with_overbars() -> bool {
    true
}

impl EzgkfSettings {
    /// φ, η and α, and else what is the default.
    pub fn new(phi: usize, eta: f64, alpha: f64) -> Self {
        Self {
            phi,
            eta,
            alpha,
            gain: Gain::default(),
            overbars: with_overbars(),
            merge_parallel: false,
            scale: Scale::default(),
        }
    }

    pub(super) fn mixed(&self) -> MixedSettings {
        MixedSettings {
            phi: self.phi,
            eta: self.eta,
            alpha: self.alpha,
            gain: self.gain,
            overbars: self.overbars,
            merge_parallel: self.merge_parallel,
            scale: self.scale,
        }
    }
}

/// The EZGKF of a quasi-LPV system x⁺ = (A₀ + Σ δ_i A_i) x + B u + w, y = C x + D u + v, where
/// w = zʷ + gʷ with zʷ ∈ Gʷ [−1, 1]^{n_gw}, gʷ ~ N(0, Q), and v likewise with Gᵛ, R:
///
/// predict: G_r of order φ, c = A₀ c + B u, G = [A₀ G_r, Gʷ, A₁ [c, G_r], …, A_d [c, G_r]],
/// P by [`covariance_bound`](super::covariance_bound);
/// update: K by Theorem 1, T = I − K C, c = T c + K y, G = [T G, −K Gᵛ], P = T P Tᵀ + K R Kᵀ.
///
/// A₀ and A_i are those over the confidence box of the belief at k − 1. The belief at k = 0 is the
/// prior: y_0 is not used. The belief at k has read y_1 … y_k and is reported before its reduction.
/// Means of w and v, where given, are added to the center and taken off y.
///
/// Not guaranteed: its box holds with a probability, on the assumption that δ does not depend on the
/// state, and rounding is plain. Correlated w and v (Remark 4) are not offered: a problem has no
/// cross-covariance.
///
/// Source: [dePaula, Algorithm 1].
#[derive(Clone, Debug)]
pub struct Ezgkf<Y = AnySystem> {
    model: MixedModel<Y>,
}

impl<Y: System> Ezgkf<Y> {
    /// Fails where a setting is out of range, the system or the system has no quasi-LPV form.
    pub fn new(settings: &EzgkfSettings, problem: &Problem<Y>) -> Result<Self, EstimationError> {
        Ok(Self {
            model: MixedModel::new("ezgkf", settings.mixed(), problem)?,
        })
    }
}

impl<Y: System> Estimator for Ezgkf<Y> {
    type Belief = MixedBelief;

    fn prior(&self) -> MixedBelief {
        self.model.prior.clone()
    }

    fn predict(
        &self,
        k: usize,
        belief: &MixedBelief,
        u_prev: &[f64],
    ) -> Result<MixedBelief, EstimationError> {
        let model = &self.model;
        let form = model.embed(k, belief)?;
        let (c, g) = (belief.state.c(), belief.state.g());
        // Eq. (22)
        let center = model.forecast_center(&form.a0, c, u_prev)?;
        // Eq. (25)
        let generators = forecast_generators(&form.a0, &form.a, c, g, &model.gw);
        // Eq. (26)
        let covariance = model.forecast_covariance(&form.a0, &form.a, belief.state.p());
        MixedBelief::new(center, generators, covariance, belief.quantile).finite(k, "predict")
    }

    fn update(
        &self,
        k: usize,
        belief: &MixedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<MixedBelief, EstimationError> {
        let corrected = self.model.correct(k, belief, u, y)?;
        Ok(corrected.map_or_else(|| belief.clone(), |c| c.belief))
    }

    fn reduce_order(&self, _k: usize, belief: MixedBelief) -> Result<MixedBelief, EstimationError> {
        Ok(self.model.reduce_order(belief))
    }

    fn guaranteed(&self) -> bool {
        false
    }
    fn reads(&self) -> &'static str {
        "y_k"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Updated
    }
    fn uses_first_measurement(&self) -> bool {
        false
    }
}

/// [A₀ G, Gʷ, A₁ [c, G], …, A_d [c, G]], n × (p + n_gw + d (1 + p)).
pub(super) fn forecast_generators(
    a0: &Matrix,
    a: &[Matrix],
    c: &[f64],
    g: &Matrix,
    gw: &Matrix,
) -> Matrix {
    let mut blocks = List::from([a0.mul(g), gw.clone()]);
    for a in a {
        blocks.push(a.mul(&Matrix::column(c)));
        blocks.push(a.mul(g));
    }
    Matrix::hcat(&blocks)
}
