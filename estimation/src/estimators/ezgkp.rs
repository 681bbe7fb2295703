//! EZGKP: the predictor that the EZGKF is compared with.

use super::ezgkf::{forecast_generators, with_overbars};
use super::mixed::{Correction, Gain, MixedBelief, MixedModel, MixedSettings};
use super::scale::Scale;
use crate::estimator::{Estimator, Measurement, Phase};
use crate::system::Embedding;
use crate::{AnySystem, EstimationError, Problem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::Matrix;

/// How the gain meets the uncertain state matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// The gain of the prediction is A(δ) K: a correction, then a forecast of the corrected belief.
    #[default]
    Ak,
    /// The gain of the prediction is the constant L = A₀ K.
    Direct,
}

/// Settings of `ezgkp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EzgkpSettings {
    /// φ, the number of generators kept between steps; at least n.
    pub phi: usize,
    /// η in [0, 1]: the weight of the Gaussian part in the gain; 0 is a zonotopic predictor.
    pub eta: f64,
    /// α in (0, 1): the confidence box is made for the probability 1 − α.
    pub alpha: f64,
    /// Which R^zg enters the gain.
    #[serde(default)]
    pub gain: Gain,
    /// Whether Eq. (26) has its overbars, without which it bounds nothing; true unless given.
    #[serde(default = "with_overbars")]
    pub overbars: bool,
    /// Whether parallel generators are merged before the gain; false unless given.
    #[serde(default)]
    pub merge_parallel: bool,
    /// Which reading of the predictor.
    #[serde(default)]
    pub form: Form,
    /// In which units generators are compared when the order is reduced, and |M| of Eq. (26) is taken; those of the state unless given.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
}

impl EzgkpSettings {
    /// φ, η and α, and else what is the default.
    pub fn new(phi: usize, eta: f64, alpha: f64) -> Self {
        Self {
            phi,
            eta,
            alpha,
            gain: Gain::default(),
            overbars: with_overbars(),
            merge_parallel: false,
            form: Form::default(),
            scale: Scale::default(),
        }
    }
}

/// The predictor: its belief at k has read y_0 … y_{k−1}.
///
/// With the gain K of Theorem 1 for G_r (of order φ) and P, and T = I − K C:
///
/// * [`Form::Ak`]: c_u = T c + K y, G_u = [T G_r, −K Gᵛ], P_u = T P Tᵀ + K R Kᵀ at k − 1, then
///   c = A₀ c_u + B u, G = [A₀ G_u, Gʷ, A_i [c_u, G_u]], P by Eq. (26) of P_u;
/// * [`Form::Direct`]: L = A₀ K, F₀ = A₀ − L C, c = F₀ c + L y + B u,
///   G = [F₀ G_r, −L Gᵛ, Gʷ, A_i [c, G_r]], P by Eq. (26) with F₀ for A₀, plus L R Lᵀ.
///
/// `update` only stores y_k for the next prediction, so the updated belief is the predicted one. A₀ and
/// A_i are those over the confidence box of the belief at k − 1.
///
/// Its own paper was not at hand: both forms are reconstructions, and `ak` is the one whose products
/// appear in the complexity that \[dePaula\] prints for it. Not guaranteed.
///
/// Source: [dePaula, Table I and Sec. V], after the predictor cited there as \[8\].
#[derive(Clone, Debug)]
pub struct Ezgkp<Y = AnySystem> {
    model: MixedModel<Y>,
    form: Form,
}

impl<Y: System> Ezgkp<Y> {
    /// Fails where a setting is out of range, the system or the system has no quasi-LPV form.
    pub fn new(settings: &EzgkpSettings, problem: &Problem<Y>) -> Result<Self, EstimationError> {
        let mixed = MixedSettings {
            phi: settings.phi,
            eta: settings.eta,
            alpha: settings.alpha,
            gain: settings.gain,
            overbars: settings.overbars,
            merge_parallel: settings.merge_parallel,
            scale: settings.scale,
        };
        Ok(Self {
            model: MixedModel::new("ezgkp", mixed, problem)?,
            form: settings.form,
        })
    }

    /// The forecast of `belief`, in which y_{k−1} is already.
    fn forecast(
        &self,
        k: usize,
        embedding: &Embedding,
        belief: &MixedBelief,
        u_prev: &[f64],
    ) -> Result<MixedBelief, EstimationError> {
        let Embedding { a0, a } = embedding;
        let (c, g) = (belief.state.c(), belief.state.g());
        MixedBelief::new(
            self.model.forecast_center(a0, c, u_prev)?,
            forecast_generators(a0, a, c, g, &self.model.gw),
            self.model.forecast_covariance(a0, a, belief.state.p()),
            belief.quantile,
        )
        .finite(k, "predict")
    }

    /// The forecast of `belief` with the constant gain L = A₀ K.
    fn direct(
        &self,
        k: usize,
        embedding: &Embedding,
        belief: &MixedBelief,
        correction: &Correction,
        u_prev: &[f64],
    ) -> Result<MixedBelief, EstimationError> {
        let Embedding { a0, a } = embedding;
        let Correction {
            gain, output, z, ..
        } = correction;
        let (c, g) = (belief.state.c(), belief.state.g());
        let l = a0.mul(gain);
        let f0 = a0.sub(&l.mul(&output.c));
        let mut center = self.model.forecast_center(&f0, c, u_prev)?;
        for (x, lz) in center.iter_mut().zip(&l.mul_vec(z)) {
            *x += lz;
        }
        let noise = Matrix::hcat(&[&l.mul(&output.generators).scale(-1.0), &self.model.gw]);
        let krk = l.mul(&output.covariance).mul_transpose(&l).symmetrized();
        MixedBelief::new(
            center,
            forecast_generators(&f0, a, c, g, &noise),
            self.model
                .forecast_covariance(&f0, a, belief.state.p())
                .add(&krk),
            belief.quantile,
        )
        .finite(k, "predict")
    }
}

impl<Y: System> Estimator for Ezgkp<Y> {
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
        let embedding = self.model.embed(k, belief)?;
        let correction = match &belief.pending {
            Some(y) => self.model.correct(k, belief, u_prev, y)?,
            None => None,
        };
        match (correction, self.form) {
            (None, _) => self.forecast(k, &embedding, belief, u_prev),
            (Some(correction), Form::Ak) => {
                self.forecast(k, &embedding, &correction.belief, u_prev)
            }
            (Some(correction), Form::Direct) => {
                self.direct(k, &embedding, belief, &correction, u_prev)
            }
        }
    }

    fn update(
        &self,
        _k: usize,
        belief: &MixedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<MixedBelief, EstimationError> {
        self.model.output.observe(u, y)?;
        Ok(MixedBelief {
            pending: Some(y.into()),
            ..belief.clone()
        })
    }

    fn reduce_order(&self, _k: usize, belief: MixedBelief) -> Result<MixedBelief, EstimationError> {
        Ok(self.model.reduce_order(belief))
    }

    fn guaranteed(&self) -> bool {
        false
    }
    fn reads(&self) -> &'static str {
        "y_{k-1}"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Predicted
    }
}
