//! Controllers: inputs that depend on the state, for the simulation of closed loops.

use crate::system::System;
use crate::systems::Quadrotor;
use serde::{Deserialize, Serialize};

/// Every controller there is, by its name in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Controller {
    /// [`FeedbackLinearising`], for a quadrotor.
    FeedbackLinearising,
}

impl Controller {
    /// Every controller with its name in a file.
    pub const NAMES: &'static [(&'static str, Controller)] =
        &[("feedback-linearising", Controller::FeedbackLinearising)];

    /// The controller at its start; None for a system that it cannot drive.
    pub fn start<Y: System>(self, system: &Y) -> Option<FeedbackLinearising> {
        match self {
            Self::FeedbackLinearising => system.feedback_linearising(),
        }
    }
}

/// λ in 1/s: every pole of the closed loop, four of the position and two of the heading.
const POLE: f64 = 4.0;

/// ψ_ref in rad.
const HEADING: f64 = std::f64::consts::FRAC_PI_3;

/// Feedback linearisation of a [`Quadrotor`] with dynamic extension along a vertical helix.
///
/// U₁ and its derivative are states of the controller, ζ and ξ, so that the fourth derivative of the
/// position and the second of ψ answer to (Ü₁, U₂, U₃, U₄). With R = R_z(ψ) R_y(θ) R_x(φ) of columns R₁, R₂, R₃:
///
/// * acceleration a = −g e₃ + ζ/m R₃, jerk = ξ/m R₃ + ζ/m (q R₁ − p R₂), without the forces, which it does not know;
/// * wanted snap v = ref⁗ + 4λ (ref‴ − jerk) + 6λ² (ref″ − a) + 4λ³ (ref′ − velocity) + λ⁴ (ref − position) and
///   ψ̈ = λ² (ψ_ref − ψ) − 2λ ψ̇, λ = 4/s; s = Rᵀ v;
/// * q̇ = (m s₁ − 2ξq)/ζ − p r, ṗ = −(m s₂ + 2ξp)/ζ + q r, Ü₁ = m s₃ + ζ (p² + q²),
///   ṙ = (cos θ (ψ̈ − ψ̇ θ̇ tan θ) − θ̇ φ̇ − q̇ sin φ)/cos φ;
/// * U₂ = (I_xx ṗ − (I_yy − I_zz) q r)/l, U₃ = (I_yy q̇ − (I_zz − I_xx) p r)/l, U₄ = I_zz ṙ − (I_xx − I_yy) p q.
///
/// ref = (½ cos t/2, ½ sin t/2, 1 + t/10), ψ_ref = π/3. It starts from ζ = m g, ξ = 0 and goes on by Euler's rule.
/// A constant force d, taken for acceleration that is missing, leaves an offset of 6 d/(m λ²).
///
/// Source: reference trajectory of [Rego2020, Sec. 5.2]; the law is that of Mistler et al. 2001, whose gains
/// the paper does not give. λ is ours.
#[derive(Clone, Debug)]
pub struct FeedbackLinearising {
    vehicle: Quadrotor,
    /// ζ = U₁ in N.
    thrust: f64,
    /// ξ in N/s.
    thrust_rate: f64,
}

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl FeedbackLinearising {
    /// The controller in hover.
    pub(crate) fn new(vehicle: &Quadrotor) -> Self {
        Self {
            thrust: vehicle.m * vehicle.g,
            thrust_rate: 0.0,
            vehicle: vehicle.clone(),
        }
    }

    /// The reference position and its first four derivatives at the time `t` in s.
    pub fn reference(t: f64) -> [[f64; 3]; 5] {
        let (sin, cos) = (libm::sin(0.5 * t), libm::cos(0.5 * t));
        [
            [0.5 * cos, 0.5 * sin, 1.0 + t / 10.0],
            [-0.25 * sin, 0.25 * cos, 0.1],
            [-0.125 * cos, -0.125 * sin, 0.0],
            [0.0625 * sin, -0.0625 * cos, 0.0],
            [0.03125 * cos, 0.03125 * sin, 0.0],
        ]
    }

    /// u_k at the state `x` of 12 components; then the controller is at k + 1.
    pub fn step(&mut self, k: usize, x: &[f64]) -> Vec<f64> {
        let Quadrotor {
            m,
            l,
            inertia: [ixx, iyy, izz],
            g,
            dt,
        } = self.vehicle;
        let (zeta, xi) = (self.thrust, self.thrust_rate);
        let (sin_phi, cos_phi) = (libm::sin(x[6]), libm::cos(x[6]));
        let (sin_theta, cos_theta) = (libm::sin(x[7]), libm::cos(x[7]));
        let (sin_psi, cos_psi) = (libm::sin(x[8]), libm::cos(x[8]));
        let tan_theta = sin_theta / cos_theta;
        let (p, q, r) = (x[9], x[10], x[11]);
        let r1 = [cos_psi * cos_theta, sin_psi * cos_theta, -sin_theta];
        let r2 = [
            cos_psi * sin_theta * sin_phi - sin_psi * cos_phi,
            sin_psi * sin_theta * sin_phi + cos_psi * cos_phi,
            cos_theta * sin_phi,
        ];
        let r3 = [
            cos_psi * sin_theta * cos_phi + sin_psi * sin_phi,
            sin_psi * sin_theta * cos_phi - cos_psi * sin_phi,
            cos_theta * cos_phi,
        ];
        let wanted = Self::reference(k as f64 * dt);
        let snap: Vector = std::array::from_fn(|i| {
            let gravity = if i == 2 { g } else { 0.0 };
            let acceleration = zeta / m * r3[i] - gravity;
            let jerk = xi / m * r3[i] + zeta / m * (q * r1[i] - p * r2[i]);
            let [position, velocity] = [x[i], x[3 + i]];
            let power = |n: i32| (0..n).fold(1.0, |product, _| product * POLE);
            wanted[4][i]
                + 4.0 * POLE * (wanted[3][i] - jerk)
                + 6.0 * power(2) * (wanted[2][i] - acceleration)
                + 4.0 * power(3) * (wanted[1][i] - velocity)
                + power(4) * (wanted[0][i] - position)
        });
        let s = [dot(r1, snap), dot(r2, snap), dot(r3, snap)];
        let turn = q * sin_phi + r * cos_phi;
        let phi_rate = p + turn * tan_theta;
        let theta_rate = q * cos_phi - r * sin_phi;
        let psi_rate = turn / cos_theta;
        let heading = POLE * POLE * (HEADING - x[8]) - 2.0 * POLE * psi_rate;
        let p_rate = -(m * s[1] + 2.0 * xi * p) / zeta + q * r;
        let q_rate = (m * s[0] - 2.0 * xi * q) / zeta - p * r;
        let r_rate = (cos_theta * (heading - psi_rate * theta_rate * tan_theta)
            - theta_rate * phi_rate
            - q_rate * sin_phi)
            / cos_phi;
        let thrust_acceleration = m * s[2] + zeta * (p * p + q * q);
        self.thrust = zeta + dt * xi;
        self.thrust_rate = xi + dt * thrust_acceleration;
        vec![
            zeta,
            (ixx * p_rate - (iyy - izz) * q * r) / l,
            (iyy * q_rate - (izz - ixx) * p * r) / l,
            izz * r_rate - (ixx - iyy) * p * q,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::System;

    /// x_0 … x_N and u_0 … u_N under the forces `d`.
    fn fly(steps: usize, d: impl Fn(usize) -> [f64; 3]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let vehicle = Quadrotor::published();
        let mut controller = FeedbackLinearising::new(&vehicle);
        let mut x = vec![0.0; 12];
        (x[0], x[2], x[8]) = (0.5, 1.0, HEADING);
        let (mut states, mut inputs) = (vec![x.clone()], Vec::new());
        for k in 0..steps {
            let u = controller.step(k, &x);
            let mut next = vec![0.0; 12];
            vehicle.f(k, &x, &u, &d(k), &mut next);
            x = next;
            states.push(x.clone());
            inputs.push(u);
        }
        (states, inputs)
    }

    fn off(k: usize, x: &[f64]) -> f64 {
        let wanted = FeedbackLinearising::reference(k as f64 * 0.01)[0];
        (0..3).fold(0.0, |m: f64, i| m.max((x[i] - wanted[i]).abs()))
    }

    #[test]
    fn the_helix_is_followed_and_a_force_leaves_the_offset_of_the_law() {
        let on = |k: usize, from: usize| f64::from(u8::from((from..1500).contains(&k)));
        let (x, u) = fly(2000, |k| [on(k, 500), on(k, 800), on(k, 1000)]);
        // After the start, which is at rest, and before the first force: what sampling by Euler's rule leaves.
        let tracking = (400..=500).map(|k| off(k, &x[k])).fold(0.0, f64::max);
        assert!(tracking < 6e-4, "{tracking}");
        // At rest λ⁴ e = 6 λ² d/m: the law takes d/m for acceleration that is missing.
        let offset = 6.0 / (0.7 * 16.0);
        let wanted = FeedbackLinearising::reference(14.99)[0];
        for (found, wanted) in x[1499].iter().zip(wanted) {
            assert!(
                ((found - wanted).abs() - offset).abs() < 0.01,
                "{found} {wanted}"
            );
        }
        let tilt = x.iter().map(|x| x[7].abs()).fold(0.0, f64::max);
        assert!(tilt < 0.25, "{tilt}");
        let thrust = u.iter().map(|u| u[0]);
        assert!(thrust.clone().all(|t| t > 5.0 && t < 8.0));
        assert!(x.iter().all(|x| (x[8] - HEADING).abs() < 0.05));
        // The start and the forces go: back on the helix.
        assert!(off(2000, &x[2000]) < 2e-3);
    }

    #[test]
    fn the_reference_is_differentiated_right() {
        let step = 1e-4;
        for t in [0.0, 1.3, 17.0] {
            let [more, less, at] = [t + step, t - step, t].map(FeedbackLinearising::reference);
            for order in 0..4 {
                for i in 0..3 {
                    let difference = (more[order][i] - less[order][i]) / (2.0 * step);
                    assert!((difference - at[order + 1][i]).abs() < 1e-8);
                }
            }
        }
    }
}
