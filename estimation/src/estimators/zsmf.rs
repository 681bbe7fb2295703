//! ZSMF: the zonotopic set-membership filter in the state space.

use super::pose_zonotope::{Coordinates, PoseZonotope};
use super::vehicle_filter::{
    Remainder, Side, Transient, Transition, VehicleFilter, VehicleFilterSettings,
};
use crate::estimator::{Estimator, Measurement, Phase};
use crate::{EstimationError, Problem, System};
use zonobench_sets::Matrix;
use zonobench_sets::se2::{Matrix3, Se2, rotate};

const KIND: &str = "zsmf";

/// The ZSMF of a vehicle, linearised at the estimate (θ̂, x̂), with z = y − x̂:
///
/// A = [1, 0, 0; −δν sin θ̂, 1, 0; δν cos θ̂, 0, 1], C = \[0, I\], D_w = δ diag(1, R(θ̂)),
/// (θ̂, x̂)⁺ = (θ̂ + δω, x̂ + δν (cos θ̂, sin θ̂)) + L z, H⁺ = \[(A − L C) H̄, D_w H_w, −L H_v\].
///
/// The belief at k has read y_0 … y_{k−1}; H is reduced at the beginning of a step, and reported before. A
/// component of y that is missing is left out of C; with the pole gain the step is then one without y.
/// Not guaranteed: the terms of higher order are dropped.
///
/// Source: [Li, Eq. (16), Algorithms 1 and 2].
#[derive(Clone, Debug)]
pub struct Zsmf {
    filter: VehicleFilter,
}

impl Zsmf {
    /// Fails where a setting is out of range or asks for what is InZSMF's, and where the system is no vehicle
    /// or the sets are not centered zonotopes.
    pub fn new<Y: System>(
        settings: &VehicleFilterSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        let own = [
            (
                "transition",
                settings.transition == Transition::Exact,
                "exact",
            ),
            (
                "remainder",
                settings.remainder == Remainder::Dropped,
                "dropped",
            ),
            ("side", settings.side == Side::Left, "left"),
        ];
        if let Some((key, _, only)) = own.iter().find(|(_, fits, _)| !fits) {
            let expected = format!("\"{only}\", because other values are for inzsmf");
            return Err(EstimationError::setting(
                KIND,
                key,
                expected,
                "another value",
            ));
        }
        let filter = VehicleFilter::new(KIND, *settings, problem, Coordinates::State)?;
        Ok(Self { filter })
    }

    /// A at `pose`, with the way δν.
    fn transition(pose: &Se2, way: f64) -> Matrix3<f64> {
        let [c, s] = rotate(pose.angle, [way, 0.0]);
        [[1.0, 0.0, 0.0], [-s, 1.0, 0.0], [c, 0.0, 1.0]]
    }
}

impl Estimator for Zsmf {
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
        let (dt, pose) = (filter.system.dt(), belief.pose);
        let [turn, way] = [dt * u_prev[0], dt * u_prev[1]];
        let a = Self::transition(&pose, way);
        let [c, s] = [dt * libm::cos(pose.angle), dt * libm::sin(pose.angle)];
        let hw = &filter.hw;
        let noise = Matrix::from_fn(3, hw.cols(), |i, j| match i {
            0 => dt * hw[(0, j)],
            1 => c * hw[(1, j)] - s * hw[(2, j)],
            _ => s * hw[(1, j)] + c * hw[(2, j)],
        });
        let innovation = filter.world_innovation(&pose, &belief.to_state(), y);
        let (step, p) = filter.advance(k, belief, &a, &noise, innovation.as_ref(), u_prev[1])?;
        let [l0, l1, l2] = step.correction;
        let moved = rotate(pose.angle, [way, 0.0]);
        let next = Se2::new(
            pose.angle + turn + l0,
            [pose.x[0] + moved[0] + l1, pose.x[1] + moved[1] + l2],
        );
        let error = filter.errors(k, step.generators)?;
        Ok(PoseZonotope {
            earlier: Some(p),
            ..PoseZonotope::new(next, error, Coordinates::State)
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
        let mut updated = PoseZonotope {
            pending: Some(y.to_vec()),
            ..belief.clone()
        };
        if k == 0
            && filter.settings.transient == Transient::InitialUpdate
            && let Some(innovation) = filter.world_innovation(&belief.pose, &belief.to_state(), y)
        {
            let a = Self::transition(&belief.pose, filter.system.dt() * u[1]);
            let step = filter.initial_update(belief, &a, &innovation, u[1])?;
            let [l0, l1, l2] = step.correction;
            updated.pose.angle += l0;
            updated.pose.x[0] += l1;
            updated.pose.x[1] += l2;
            updated.error = filter.errors(k, step.generators)?;
        }
        Ok(updated)
    }

    fn reduce_order(
        &self,
        k: usize,
        belief: PoseZonotope,
    ) -> Result<PoseZonotope, EstimationError> {
        self.filter.reduce_order(k, belief)
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
