//! InZSMF: the invariant zonotopic set-membership filter on SE(2).

use super::inzsmf_enclosed::Enclosed;
use super::pose_zonotope::{Coordinates, PoseZonotope, product};
use super::vehicle_filter::{
    Innovation, PoseGain, PoseReduction, Remainder, Side, Transient, Transition, VehicleFilter,
    VehicleFilterSettings,
};
use crate::estimator::{Estimator, Measurement, Phase};
use crate::{EstimationError, Problem, System};
use zonobench_sets::Matrix;
use zonobench_sets::se2::{Matrix3, Se2, ad, rotate};

const KIND: &str = "inzsmf";

/// The InZSMF of a vehicle. With the left-invariant error ε = log(X̂⁻¹ X) and z = R(θ̂)ᵀ (y − x̂):
///
/// A = Ad_{exp(−δu)} (or I − δ ad_u), C = \[0, I\], D_w = δ I,
/// X̂⁺ = X̂ exp(δu) exp(L z), H⁺ = \[(A − L C) H̄, δ H_w, −L R(θ̂)ᵀ H_v\].
///
/// With the right-invariant error ε = log(X X̂⁻¹) and z = y − x̂, A = I, C = [J x̂, I], D_w = δ Ad of the
/// predicted pose, X̂⁺ = exp(L z) X̂ exp(δu): here C depends on the estimate, whatever innovation is chosen
/// ([Li, Remark 5] says otherwise), and the pair (A, C) at one estimate does not observe the heading, so that
/// there is no pole gain.
///
/// The belief at k has read y_0 … y_{k−1}; H is reduced at the beginning of a step, and reported before. A
/// component of y that is missing is left out of z and C, both in the world's axes; with the pole gain the
/// step is then one without y.
///
/// With `remainder = "dropped"` not guaranteed: [Li, Theorem 3.1] drops terms of second order, without which
/// the truth can leave the set in one step. With `remainder = "enclosed"` the set is proved to hold the truth,
/// for the system as it is sampled (either form): see [`Enclosed`].
///
/// Source: [Li, Eqs. (7), (10), (20), Algorithms 1 and 2].
#[derive(Clone, Debug)]
pub struct Inzsmf {
    filter: VehicleFilter,
    enclosed: Option<Enclosed>,
}

impl Inzsmf {
    /// Fails where a setting is out of range or does not go with another, and where the system is no vehicle
    /// or the sets are not centered zonotopes.
    pub fn new<Y: System>(
        settings: &VehicleFilterSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        let refuse = |key, expected: &str, got: &str| {
            Err(EstimationError::setting(KIND, key, expected, got))
        };
        if settings.side == Side::Right && matches!(settings.gain, PoseGain::Poles(_)) {
            let expected = "\"f-radius\" with side = \"right\", where the heading is not observable at one estimate";
            return refuse("gain", expected, "poles");
        }
        let enclosed = settings.remainder == Remainder::Enclosed;
        if enclosed {
            if settings.reduction == PoseReduction::PaperTables {
                let expected = "\"outer\" or \"girard\" with remainder = \"enclosed\"";
                return refuse(
                    "reduction",
                    expected,
                    "\"paper-tables\", which encloses nothing",
                );
            }
            if settings.side == Side::Right {
                return refuse(
                    "side",
                    "\"left\" with remainder = \"enclosed\"",
                    "\"right\"",
                );
            }
            if settings.transition == Transition::FirstOrder {
                let expected = "\"exact\" with remainder = \"enclosed\"";
                return refuse(
                    "transition",
                    expected,
                    "\"first-order\", which drops a term",
                );
            }
            if settings.transient == Transient::InitialUpdate {
                let expected = "\"printed\" or \"lag\" with remainder = \"enclosed\"";
                return refuse("transient", expected, "\"initial-update\"");
            }
        }
        let coordinates = match settings.side {
            Side::Left => Coordinates::Left,
            Side::Right => Coordinates::Right,
        };
        let mut filter = VehicleFilter::new(KIND, *settings, problem, coordinates)?;
        let enclosed = if enclosed {
            Some(Enclosed::new(&mut filter)?)
        } else {
            None
        };
        Ok(Self { filter, enclosed })
    }

    /// A, and D_w H_w.
    fn model(&self, pose: &Se2, u: &[f64]) -> (Matrix3<f64>, Matrix) {
        let dt = self.filter.system.dt();
        let step = [dt * u[0], dt * u[1], 0.0];
        let identity = Se2::identity().adjoint();
        match self.filter.settings.side {
            Side::Left => {
                let a = match self.filter.settings.transition {
                    Transition::Exact => Se2::exp(step.map(|x| -x)).adjoint(),
                    Transition::FirstOrder => {
                        let ad = ad(step);
                        core::array::from_fn(|i| {
                            core::array::from_fn(|j| identity[i][j] - ad[i][j])
                        })
                    }
                };
                (a, self.filter.hw.scale(dt))
            }
            Side::Right => {
                let ahead = pose.compose(Se2::exp(step)).adjoint();
                (identity, product(&ahead, &self.filter.hw).scale(dt))
            }
        }
    }

    /// z and its model; None where nothing usable was measured.
    fn innovation(&self, belief: &PoseZonotope, y: Measurement) -> Option<Innovation> {
        let pose = &belief.pose;
        let (true, [Some(y1), Some(y2)]) = (self.filter.settings.side == Side::Left, y) else {
            return self.filter.world_innovation(pose, &belief.to_state(), y);
        };
        let back = |x: [f64; 2]| rotate(-pose.angle, x);
        let hv = &self.filter.hv;
        let (c, s) = (libm::cos(pose.angle), libm::sin(pose.angle));
        Some(Innovation {
            rows: vec![0, 1],
            z: back([y1 - pose.x[0], y2 - pose.x[1]]).to_vec(),
            c: Matrix::from_fn(2, 3, |i, j| f64::from(u8::from(j == i + 1))),
            hv: Matrix::from_fn(2, hv.cols(), |i, j| match i {
                0 => c * hv[(0, j)] + s * hv[(1, j)],
                _ => c * hv[(1, j)] - s * hv[(0, j)],
            }),
        })
    }

    /// X exp(ζ) or exp(ζ) X.
    fn moved(&self, pose: Se2, zeta: [f64; 3]) -> Se2 {
        match self.filter.settings.side {
            Side::Left => pose.compose(Se2::exp(zeta)),
            Side::Right => Se2::exp(zeta).compose(pose),
        }
    }
}

impl Estimator for Inzsmf {
    type Belief = PoseZonotope;

    fn prior(&self) -> PoseZonotope {
        self.filter.prior.clone()
    }

    fn predict(
        &self,
        k: usize,
        belief: &PoseZonotope,
        u_prev: &[f64],
    ) -> Result<PoseZonotope, EstimationError> {
        let filter = &self.filter;
        let y = belief.pending.as_deref().unwrap_or(&[None, None]);
        filter.check(u_prev, y)?;
        if let Some(enclosed) = &self.enclosed {
            return enclosed.step(filter, k, belief, u_prev, y);
        }
        let dt = filter.system.dt();
        let (a, noise) = self.model(&belief.pose, u_prev);
        let innovation = self.innovation(belief, y);
        let (step, p) = filter.advance(k, belief, &a, &noise, innovation.as_ref(), u_prev[1])?;
        let ahead = belief
            .pose
            .compose(Se2::exp([dt * u_prev[0], dt * u_prev[1], 0.0]));
        let error = filter.errors(k, step.generators)?;
        let next = self.moved(ahead, step.correction);
        Ok(PoseZonotope {
            earlier: Some(p),
            ..PoseZonotope::new(next, error, belief.coordinates)
        })
    }

    fn update(
        &self,
        k: usize,
        belief: &PoseZonotope,
        u: &[f64],
        y: Measurement,
    ) -> Result<PoseZonotope, EstimationError> {
        let filter = &self.filter;
        filter.check(u, y)?;
        if let Some(enclosed) = &self.enclosed {
            enclosed.check_consistency(k, belief, y)?;
        }
        let mut updated = PoseZonotope {
            pending: Some(y.to_vec()),
            ..belief.clone()
        };
        if k == 0
            && filter.settings.transient == Transient::InitialUpdate
            && let Some(innovation) = self.innovation(belief, y)
        {
            let (a, _) = self.model(&belief.pose, u);
            let step = filter.initial_update(belief, &a, &innovation, u[1])?;
            updated.pose = self.moved(belief.pose, step.correction);
            updated.error = filter.errors(k, step.generators)?;
        }
        Ok(updated)
    }

    fn reduce_order(
        &self,
        k: usize,
        belief: PoseZonotope,
    ) -> Result<PoseZonotope, EstimationError> {
        match &self.enclosed {
            Some(enclosed) => enclosed.reduce_order(&self.filter, k, belief),
            None => self.filter.reduce_order(k, belief),
        }
    }

    fn guaranteed(&self) -> bool {
        self.enclosed.is_some()
    }
    fn reads(&self) -> &'static str {
        "y_{k-1}"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Predicted
    }
}
