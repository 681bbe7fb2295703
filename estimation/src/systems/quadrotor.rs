//! A quadrotor that measures everything but its velocity, and forces of the wind that push it.

use crate::EstimationError;
use crate::controller::FeedbackLinearising;
use crate::system::{System, Variable, Variables, constant_output};
use serde::{Deserialize, Serialize};
use zonobench_sets::Matrix;
use zonobench_sets::number::Real;

/// State (x, y, z, u, v, w, φ, θ, ψ, p, q, r): position and velocity in the inertial frame, Euler angles, turn
/// rates in the body's; input (U₁, U₂, U₃, U₄): thrust in N, the differences of thrust in N that roll and pitch,
/// the torque in N m that yaws; noise d = (D_x, D_y, D_z), forces in N. By Euler's rule, x⁺ = x + Δt ẋ:
///
/// * (ẋ, ẏ, ż) = (u, v, w);
/// * u̇ = (cos ψ sin θ cos φ + sin ψ sin φ) U₁/m + D_x/m, v̇ = (sin ψ sin θ cos φ − cos ψ sin φ) U₁/m + D_y/m,
///   ẇ = −g + cos θ cos φ U₁/m + D_z/m;
/// * φ̇ = p + s tan θ, θ̇ = q cos φ − r sin φ, ψ̇ = s sec θ with s = q sin φ + r cos φ;
/// * ṗ = (I_yy − I_zz)/I_xx q r + l/I_xx U₂, q̇ = (I_zz − I_xx)/I_yy p r + l/I_yy U₃,
///   ṙ = (I_xx − I_yy)/I_zz p q + U₄/I_zz.
///
/// y is the state without (u, v, w), each component with its own noise. Defined where |θ| < π/2.
///
/// Source: [Rego2020, Eq. (27) and Table 4], after Mistler et al. The printed equation has "I/I_yz U₂" for
/// l/I_xx U₂ (the arm l is lost), and the printed state has θ where φ stands here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys")]
pub struct Quadrotor {
    /// m in kg.
    pub(crate) m: f64,
    /// l, from the center to a propeller, in m.
    pub(crate) l: f64,
    /// I_xx, I_yy, I_zz in kg m².
    pub(crate) inertia: [f64; 3],
    /// g in m/s².
    pub(crate) g: f64,
    /// Δt in s.
    pub(crate) dt: f64,
}

/// What stands in a file: m in kg, l in m, the moments of inertia in kg m², g in m/s², the period in s.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    m: f64,
    l: f64,
    inertia: [f64; 3],
    g: f64,
    dt: f64,
}

impl TryFrom<Keys> for Quadrotor {
    type Error = EstimationError;
    fn try_from(keys: Keys) -> Result<Self, EstimationError> {
        Self::new(keys.m, keys.l, keys.inertia, keys.g, keys.dt)
    }
}

/// The components that are measured, in the order of [Rego2020, Table 4].
const MEASURED: [usize; 9] = [0, 1, 2, 6, 7, 8, 9, 10, 11];

impl Quadrotor {
    /// The quadrotor of mass `m` in kg, arm `l` in m, moments of inertia (I_xx, I_yy, I_zz) in kg m²,
    /// gravity `g` in m/s² and period `dt` in s.
    ///
    /// Fails with `Setting` where one of them is not positive and finite.
    pub fn new(
        m: f64,
        l: f64,
        inertia: [f64; 3],
        g: f64,
        dt: f64,
    ) -> Result<Self, EstimationError> {
        let [ixx, iyy, izz] = inertia;
        for (key, value) in [
            ("m", m),
            ("l", l),
            ("ixx", ixx),
            ("iyy", iyy),
            ("izz", izz),
            ("g", g),
            ("dt", dt),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(EstimationError::setting(
                    "quadrotor",
                    key,
                    "positive and finite",
                    value,
                ));
            }
        }
        Ok(Self {
            m,
            l,
            inertia,
            g,
            dt,
        })
    }

    /// The vehicle of [Rego2020, Sec. 5.2]: 0.7 kg, 0.3 m, 1.2416 kg m² about every axis, 9.81 m/s², 0.01 s.
    pub fn published() -> Self {
        Self::new(0.7, 0.3, [1.2416; 3], 9.81, 0.01).expect("the parameters are positive")
    }

    /// Δt in s.
    pub fn dt(&self) -> f64 {
        self.dt
    }
}

impl System for Quadrotor {
    fn variables(&self) -> Variables {
        let named = |list: &[(&str, &'static str)]| {
            list.iter()
                .map(|&(name, unit)| Variable::new(name, unit))
                .collect::<Vec<_>>()
        };
        let x = named(&[
            ("x", "m"),
            ("y", "m"),
            ("z", "m"),
            ("u", "m/s"),
            ("v", "m/s"),
            ("w", "m/s"),
            ("phi", "rad"),
            ("theta", "rad"),
            ("psi", "rad"),
            ("p", "rad/s"),
            ("q", "rad/s"),
            ("r", "rad/s"),
        ]);
        let measured = |prefix: &str| {
            MEASURED
                .iter()
                .enumerate()
                .map(|(at, &i)| Variable::new(format!("{prefix}{}", at + 1), x[i].unit.clone()))
                .collect()
        };
        Variables {
            u: named(&[("u1", "N"), ("u2", "N"), ("u3", "N"), ("u4", "N.m")]),
            w: named(&[("d_x", "N"), ("d_y", "N"), ("d_z", "N")]),
            y: measured("y"),
            v: measured("v"),
            x,
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
        let (dt, m) = (self.dt, self.m);
        let [ixx, iyy, izz] = self.inertia;
        let [sin_phi, cos_phi] = [x[6].sin(), x[6].cos()];
        let [sin_theta, cos_theta] = [x[7].sin(), x[7].cos()];
        let [sin_psi, cos_psi] = [x[8].sin(), x[8].cos()];
        let (p, q, r) = (x[9], x[10], x[11]);
        let thrust = S::constant(u[0]) / m;
        let tilted = sin_theta * cos_phi;
        let turn = q * sin_phi + r * cos_phi;
        // Quotients of parameters round too, hence as numbers of S.
        let arm = S::constant(self.l);
        let ratio = |a: f64, b: f64, c: f64| (S::constant(a) - b) / c;
        let rates = [
            x[3],
            x[4],
            x[5],
            (cos_psi * tilted + sin_psi * sin_phi) * thrust + w[0] / m,
            (sin_psi * tilted - cos_psi * sin_phi) * thrust + w[1] / m,
            cos_theta * cos_phi * thrust - self.g + w[2] / m,
            p + turn * x[7].tan(),
            q * cos_phi - r * sin_phi,
            turn * cos_theta.recip(),
            q * r * ratio(iyy, izz, ixx) + S::constant(u[1]) * (arm / ixx),
            p * r * ratio(izz, ixx, iyy) + S::constant(u[2]) * (arm / iyy),
            p * q * ratio(ixx, iyy, izz) + S::constant(u[3]) / izz,
        ];
        for ((next, &x), rate) in next.iter_mut().zip(x).zip(rates) {
            *next = x + rate * dt;
        }
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        for ((y, &i), &v) in y.iter_mut().zip(&MEASURED).zip(v) {
            *y = x[i] + v;
        }
    }

    fn kind(&self) -> &'static str {
        "quadrotor"
    }

    fn period(&self) -> Option<f64> {
        Some(self.dt)
    }

    fn measures_input(&self) -> bool {
        false
    }

    fn linear_output(&self) -> Option<(Matrix, Matrix)> {
        constant_output(self)
    }

    fn feedback_linearising(&self) -> Option<FeedbackLinearising> {
        Some(FeedbackLinearising::new(self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::Dynamics;
    use zonobench_sets::interval_matrix::{hessian_over, jacobian_over};
    use zonobench_sets::number::Function;
    use zonobench_sets::{Interval, IntervalVector};

    /// Unequal moments, so that every term counts.
    fn uneven() -> Quadrotor {
        Quadrotor::new(0.7, 0.3, [1.0, 1.5, 1.75], 9.81, 0.01).unwrap()
    }

    const U: [f64; 4] = [6.5, 0.3, -0.2, 0.1];

    fn somewhere() -> Vec<f64> {
        let x = [
            0.5, 0.1, 1.2, 0.3, -0.2, 0.1, 0.12, -0.2, 1.0, 0.05, -0.08, 0.11,
        ];
        let d = [0.4, -0.7, 1.0];
        [&x[..], &d[..]].concat()
    }

    /// Quotients of parameters are rounded, and intervals take that rounding in: with p = q = r = 0 and Δt = 1 the
    /// turn rate after a step is u₂ l/I_xx, and with q = r = 1 the part (I_yy − I_zz)/I_xx is added.
    #[test]
    fn quotients_of_parameters_are_enclosed() {
        let q = |x: f64| num_rational::BigRational::from_float(x).expect("finite");
        let mut draws = crate::random::Draws::new(7, crate::random::Purpose::Delta, 0);
        for case in 0..300 {
            let mut uniform = |i: usize, lo: f64, hi: f64| {
                lo + (hi - lo) * 0.5 * (1.0 + draws.uniform(case, i, 0))
            };
            let (l, torque) = (uniform(0, 0.1, 1.0), uniform(1, 0.5, 1.0));
            let inertia = [2, 3, 4].map(|i| uniform(i, 0.5, 2.0));
            let vehicle = Quadrotor::new(0.7, l, inertia, 9.81, 1.0).unwrap();
            for rate in [0.0, 1.0] {
                let mut x = [Interval::ZERO; 12];
                (x[10], x[11]) = (Interval::point(rate), Interval::point(rate));
                let mut next = [Interval::ZERO; 12];
                let w = [Interval::ZERO; 3];
                vehicle.f(0, &x, &[0.0, torque, 0.0, 0.0], &w, &mut next);
                let [ixx, iyy, izz] = inertia.map(q);
                let exact = (q(rate) * (&iyy - &izz) + q(torque) * q(l)) / &ixx;
                assert!(
                    q(next[9].lo()) <= exact && exact <= q(next[9].hi()),
                    "{l} {inertia:?} {torque} {rate}: {:?}",
                    next[9]
                );
            }
        }
    }

    #[test]
    fn at_rest_the_thrust_carries_the_weight() {
        let vehicle = Quadrotor::published();
        let x: Vec<f64> = (0..12).map(|i| if i < 3 { 1.0 } else { 0.0 }).collect();
        let mut next = vec![0.0; 12];
        vehicle.f(0, &x, &[0.7 * 9.81, 0.0, 0.0, 0.0], &[0.0; 3], &mut next);
        assert!(next.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-15));
        // A roll by φ drives it to −y at ψ = 0, a pitch by θ to +x.
        let mut tilted = x.clone();
        (tilted[6], tilted[7]) = (0.1, 0.2);
        vehicle.f(0, &tilted, &[7.0, 0.0, 0.0, 0.0], &[0.0; 3], &mut next);
        let expected = [0.2_f64.sin() * 0.1_f64.cos(), -(0.1_f64.sin())];
        assert!((next[3] - 0.1 * expected[0]).abs() < 1e-15);
        assert!((next[4] - 0.1 * expected[1]).abs() < 1e-15);
    }

    #[test]
    fn a_turn_rate_about_the_body_axes_turns_the_matrix_by_it() {
        // With R = Rz(ψ) Ry(θ) Rx(φ), Ṙ = R [ω]: compare R(t + Δt) with R + Δt R [ω] at a small Δt.
        let dt = 1e-6;
        let vehicle = Quadrotor::new(0.7, 0.3, [1.2416; 3], 9.81, dt).unwrap();
        let z = somewhere();
        let mut next = vec![0.0; 12];
        vehicle.f(0, &z[..12], &U, &z[12..], &mut next);
        let rotation = |x: &[f64]| {
            let (sf, cf) = (x[6].sin(), x[6].cos());
            let (st, ct) = (x[7].sin(), x[7].cos());
            let (sp, cp) = (x[8].sin(), x[8].cos());
            [
                [cp * ct, cp * st * sf - sp * cf, cp * st * cf + sp * sf],
                [sp * ct, sp * st * sf + cp * cf, sp * st * cf - cp * sf],
                [-st, ct * sf, ct * cf],
            ]
        };
        let (before, after) = (rotation(&z), rotation(&next));
        let (p, q, r) = (z[9], z[10], z[11]);
        let skew = [[0.0, -r, q], [r, 0.0, -p], [-q, p, 0.0]];
        for i in 0..3 {
            for j in 0..3 {
                let turned: f64 = (0..3).map(|k| before[i][k] * skew[k][j]).sum();
                let rate = (after[i][j] - before[i][j]) / dt;
                // A second-order term of Δt and the cancellation in the difference.
                assert!(
                    (rate - turned).abs() < 1e-6,
                    "{i} {j}: {rate} against {turned}"
                );
            }
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let vehicle = uneven();
        let f = Dynamics::new(&vehicle, 0, &U);
        let z = somewhere();
        let at = |z: &[f64]| {
            let mut out = vec![0.0; 12];
            f.evaluate(z, &mut out);
            out
        };
        let point = IntervalVector::point(&z).unwrap();
        let (_, j) = jacobian_over(&f, &point).unwrap();
        let (_, _, h) = hessian_over(&f, &point).unwrap();
        let step = 1e-4;
        let moved = |changes: &[(usize, f64)]| {
            let mut z = z.clone();
            changes.iter().for_each(|&(i, by)| z[i] += by);
            at(&z)
        };
        for a in 0..15 {
            let (more, less) = (moved(&[(a, step)]), moved(&[(a, -step)]));
            for i in 0..12 {
                let difference = (more[i] - less[i]) / (2.0 * step);
                // O(step²) of third derivatives below 1.
                assert!((j[(i, a)].mid() - difference).abs() < 1e-8, "{i} {a}");
            }
            for b in 0..=a {
                let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
                    .map(|(s, t)| (s * t, moved(&[(a, s * step), (b, t * step)])));
                for i in 0..12 {
                    let sum: f64 = corners.iter().map(|(sign, f)| sign * f[i]).sum();
                    let difference = sum / (4.0 * step * step);
                    let found = h[i][(a, b)].mid();
                    // Rounding of f, 1e-16, over step² is 1e-8.
                    assert!(
                        (found - difference).abs() < 1e-6,
                        "{i} {a} {b}: {found} {difference}"
                    );
                }
            }
        }
    }

    #[test]
    fn enclosures_contain_values_and_a_pitch_of_a_right_angle_is_refused() {
        let vehicle = uneven();
        let f = Dynamics::new(&vehicle, 0, &U);
        let z = somewhere();
        let wide: IntervalVector = z
            .iter()
            .map(|&c| Interval::from_center_radius(c, 0.05))
            .collect();
        let (value, j) = jacobian_over(&f, &wide).unwrap();
        let mut state = 7_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            0.1 * (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.05
        };
        for _ in 0..200 {
            let inner: Vec<f64> = z.iter().map(|c| c + 0.99 * next()).collect();
            let mut image = vec![0.0; 12];
            f.evaluate(&inner, &mut image);
            assert!(value.iter().zip(&image).all(|(side, &x)| side.contains(x)));
            let (_, exact) = jacobian_over(&f, &IntervalVector::point(&inner).unwrap()).unwrap();
            let inside = |(wide, thin): (&Interval, &Interval)| wide.intersect(thin).is_some();
            assert!(j.as_slice().iter().zip(exact.as_slice()).all(inside));
        }
        let mut upright: Vec<Interval> = z.iter().map(|&c| Interval::point(c)).collect();
        upright[7] = Interval::new(1.5, 1.6).unwrap();
        assert!(jacobian_over(&f, &IntervalVector::new(upright)).is_err());
    }

    #[test]
    fn parameters_are_checked() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Quadrotor::new(bad, 0.3, [1.0; 3], 9.81, 0.01).is_err());
            assert!(Quadrotor::new(0.7, 0.3, [1.0, bad, 1.0], 9.81, 0.01).is_err());
            assert!(Quadrotor::new(0.7, 0.3, [1.0; 3], 9.81, bad).is_err());
        }
        let text = serde_json::to_string(&uneven()).unwrap();
        assert_eq!(serde_json::from_str::<Quadrotor>(&text).unwrap(), uneven());
    }
}
