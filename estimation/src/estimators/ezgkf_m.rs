//! EZGKF-M: the EZGKF for a state matrix that is an interval matrix.

use super::EzgkfSettings;
use super::mixed::{MixedBelief, MixedModel};
use crate::estimator::{Estimator, Measurement, Phase};
use crate::{AnySystem, EstimationError, Problem, System};
use zonobench_sets::{List, Matrix};

/// The EZGKF with the forecast of its Remark 3: the state matrix is taken as an interval matrix of
/// radius ρ = Σ_i |A_i|, and
///
/// G = [A₀ G_r, diag(ρ |G_r| 1), Gʷ, diag(ρ |c|)],
///
/// so a step adds 2n + n_gw + n_gv generators. The rest is [`Ezgkf`](super::Ezgkf); the paper does not
/// say which covariance goes with it, and Eq. (26) with the affine A_i is used. Where each A_i has one
/// entry that is not zero, as in both of the paper's examples, the forecast set is that of the EZGKF;
/// the list of generators differs, and with it the gain. Not guaranteed. Reads y_1 … y_k.
///
/// Source: [dePaula, Remark 3].
#[derive(Clone, Debug)]
pub struct EzgkfM<Y = AnySystem> {
    model: MixedModel<Y>,
}

impl<Y: System> EzgkfM<Y> {
    /// Fails where a setting is out of range, the system or the system has no quasi-LPV form.
    pub fn new(settings: &EzgkfSettings, problem: &Problem<Y>) -> Result<Self, EstimationError> {
        Ok(Self {
            model: MixedModel::new("ezgkf-m", settings.mixed(), problem)?,
        })
    }
}

impl<Y: System> Estimator for EzgkfM<Y> {
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
        let mut rho = Matrix::zeros(c.len(), c.len());
        for a in &form.a {
            rho = rho.add(&a.abs());
        }
        let magnitudes: List<f64> = c.iter().map(|c| c.abs()).collect();
        let generators = Matrix::hcat(&[
            &form.a0.mul(g),
            &Matrix::diagonal(&rho.mul_vec(&g.abs_row_sums())),
            &model.gw,
            &Matrix::diagonal(&rho.mul_vec(&magnitudes)),
        ]);
        MixedBelief::new(
            model.forecast_center(&form.a0, c, u_prev)?,
            generators,
            model.forecast_covariance(&form.a0, &form.a, belief.state.p()),
            belief.quantile,
        )
        .finite(k, "predict")
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
