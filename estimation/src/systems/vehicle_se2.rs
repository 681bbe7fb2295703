//! A vehicle in the plane that is told its turn rate and its speed and measures its position.

use crate::EstimationError;
use crate::system::{System, Variable, Variables, constant_output};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::Real;
use zonobench_sets::se2::{Se2, rotate};
use zonobench_sets::{Interval, Matrix};

/// How the continuous equations [Li, Eq. (13)] are sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// Euler's rule, [Li, Eq. (14)].
    #[default]
    Euler,
    /// On the group, X⁺ = X exp(δ u) exp(δ w), [Li, Eq. (18)]. The paper calls both equal; they differ by
    /// δ² ω ν / 2 sideways in a step, which is 16 % of the noise there in the paper's example.
    Group,
}

/// State (θ, x₁, x₂), input (ω, ν), noise (w_θ, w_l, w_tr), y = (x₁, x₂) + v.
///
/// Every form is X⁺ = X G(u, w) with G(u, w) ∈ SE(2), so that a step does not depend on where the vehicle is:
/// G = (δ(ω + w_θ), δ(ν + w_l, w_tr)) by Euler's rule, and G = exp(δ(ω, ν, 0)) exp(δ w) on the group.
///
/// Source: [Li, Sec. IV].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys")]
pub struct VehicleSe2 {
    /// δ, the sampling period in s.
    pub(crate) dt: f64,
    /// How it is sampled.
    pub(crate) form: Form,
}

/// What stands in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    dt: f64,
    #[serde(default)]
    form: Form,
}

impl TryFrom<Keys> for VehicleSe2 {
    type Error = EstimationError;
    fn try_from(keys: Keys) -> Result<Self, EstimationError> {
        Self::new(keys.dt, keys.form)
    }
}

impl VehicleSe2 {
    /// The vehicle with sampling period `dt` in s, which must be positive and finite.
    pub fn new(dt: f64, form: Form) -> Result<Self, EstimationError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(EstimationError::setting(
                "vehicle-se2",
                "dt",
                "positive and finite",
                dt,
            ));
        }
        Ok(Self { dt, form })
    }

    /// δ in s.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// How it is sampled.
    pub fn form(&self) -> Form {
        self.form
    }

    /// An enclosure of G(u, 0), the motion in a step without noise; u = (ω, ν).
    ///
    /// On the group it holds both the exponential and the polynomial that [`System::f`] has in its place.
    pub fn motion(&self, u: &[f64]) -> Se2<Interval> {
        let [turn, way] = [u[0], u[1]].map(|x| Interval::point(x) * self.dt);
        match self.form {
            Form::Euler => Se2::new(turn, [way, Interval::ZERO]),
            Form::Group => {
                let exact = Se2::exp([turn, way, Interval::ZERO]);
                let model = exp(turn, [way, Interval::ZERO]);
                Se2::new(turn, [0, 1].map(|i| exact.x[i].hull(&model[i])))
            }
        }
    }
}

/// 1, −1/3!, 1/5!, … to the degree 28 in s: for |s| ≤ π the rest is below 2·10⁻¹⁹.
const SINC: [f64; 15] = {
    let mut c = [1.0; 15];
    let mut k = 1;
    while k < 15 {
        let m = 2.0 * k as f64;
        c[k] = -c[k - 1] / (m * (m + 1.0));
        k += 1;
    }
    c
};

/// sinc s as its Taylor polynomial, for every number: a model has no branch, not even at 0.
///
/// The polynomial with these f64 coefficients *is* the model: for |s| ≤ 1 it is within 0.2 u of sinc, which
/// whoever encloses the exponential itself has to add.
pub(crate) fn sinc<S: Real>(s: S) -> S {
    let square = s.sqr();
    let (last, rest) = SINC.split_last().expect("the polynomial has coefficients");
    rest.iter()
        .rev()
        .fold(S::constant(*last), |p, &c| p * square + c)
}

/// exp(s, x) = (s, V(s) x) by the polynomial.
fn exp<S: Real>(s: S, x: [S; 2]) -> [S; 2] {
    let half = s * 0.5;
    let (a, b) = (sinc(s), half * sinc(half).sqr());
    [a * x[0] - b * x[1], b * x[0] + a * x[1]]
}

impl System for VehicleSe2 {
    fn variables(&self) -> Variables {
        let named = |list: &[(&str, &'static str)]| {
            list.iter()
                .map(|&(name, unit)| Variable::new(name, unit))
                .collect()
        };
        Variables {
            x: named(&[("theta", "rad"), ("x1", "m"), ("x2", "m")]),
            u: named(&[("omega", "rad/s"), ("nu", "m/s")]),
            w: named(&[("w_theta", "rad/s"), ("w_l", "m/s"), ("w_tr", "m/s")]),
            y: named(&[("y1", "m"), ("y2", "m")]),
            v: named(&[("v1", "m"), ("v2", "m")]),
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
        let dt = self.dt;
        let (turn, way) = (S::constant(u[0]) * dt, S::constant(u[1]) * dt);
        let noise = [w[0] * dt, w[1] * dt, w[2] * dt];
        next[0] = x[0] + (turn + noise[0]);
        let moved = match self.form {
            // Eq. (14b), (14c)
            Form::Euler => rotate(x[0], [way + noise[1], noise[2]]),
            // Eq. (18)
            Form::Group => {
                let straight = rotate(x[0], exp(turn, [way, S::constant(0.0)]));
                let drift = rotate(x[0] + turn, exp(noise[0], [noise[1], noise[2]]));
                [straight[0] + drift[0], straight[1] + drift[1]]
            }
        };
        next[1] = x[1] + moved[0];
        next[2] = x[2] + moved[1];
    }

    /// Eq. (15).
    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        y[0] = x[1] + v[0];
        y[1] = x[2] + v[1];
    }

    fn kind(&self) -> &'static str {
        "vehicle-se2"
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

    fn as_vehicle(&self) -> Option<&VehicleSe2> {
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zonobench_sets::se2::versinc;

    const X: [f64; 3] = [0.7, 3.0, -2.0];
    const U: [f64; 2] = [0.4, 8.0];
    const W: [f64; 3] = [0.09, -0.05, 0.1];

    fn step(form: Form, dt: f64) -> [f64; 3] {
        let mut next = [0.0; 3];
        VehicleSe2::new(dt, form)
            .unwrap()
            .f(0, &X, &U, &W, &mut next);
        next
    }

    #[test]
    fn one_step_of_eulers_rule_is_the_printed_one() {
        let [theta, x1, x2] = step(Form::Euler, 0.01);
        let (c, s) = (0.7_f64.cos(), 0.7_f64.sin());
        assert!((theta - (0.7 + 0.01 * 0.49)).abs() < 1e-15);
        assert!((x1 - (3.0 + 0.01 * (c * 7.95 - s * 0.1))).abs() < 1e-15);
        assert!((x2 - (-2.0 + 0.01 * (s * 7.95 + c * 0.1))).abs() < 1e-15);
    }

    #[test]
    fn one_step_on_the_group_is_a_product_of_exponentials() {
        for dt in [0.01, 1.0, 3.0] {
            let u = Se2::exp([dt * 0.4, dt * 8.0, 0.0]);
            let expected = Se2::new(X[0], [X[1], X[2]])
                .compose(u)
                .compose(Se2::exp(W.map(|w| dt * w)));
            let [theta, x1, x2] = step(Form::Group, dt);
            assert!((theta - expected.angle).abs() < 1e-15 * 4.0);
            assert!((x1 - expected.x[0]).abs() < 1e-13 && (x2 - expected.x[1]).abs() < 1e-13);
        }
        // Sideways by δ² ω ν / 2.
        let apart = |dt: f64| {
            let [_, a1, a2] = step(Form::Group, dt);
            let [_, b1, b2] = step(Form::Euler, dt);
            (a1 - b1).hypot(a2 - b2)
        };
        assert!((apart(0.01) / (0.5 * 1e-4 * 0.4 * 8.0) - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_motion_without_noise_is_enclosed() {
        for form in [Form::Euler, Form::Group] {
            let system = VehicleSe2::new(0.01, form).unwrap();
            let mut next = [0.0; 3];
            system.f(0, &[0.0; 3], &U, &[0.0; 3], &mut next);
            let g = system.motion(&U);
            for (side, x) in [g.angle, g.x[0], g.x[1]].iter().zip(next) {
                assert!(
                    side.lo() - 1e-17 <= x && x <= side.hi() + 1e-17,
                    "{side:?} {x}"
                );
                assert!(side.width() < 1e-15);
            }
        }
    }

    #[test]
    fn versines_of_the_polynomial_agree() {
        for s in [0.0, 1e-8, -0.3, 3.1] {
            let [_, b] = exp(s, [1.0, 0.0]);
            assert!((b - versinc(s)).abs() < 1e-15, "{s}");
        }
    }

    #[test]
    fn a_period_must_be_positive() {
        let error = VehicleSe2::new(0.0, Form::Euler).unwrap_err();
        assert_eq!(
            error.to_string(),
            "vehicle-se2: `dt` must be positive and finite, got 0"
        );
        assert!(serde_json::from_str::<VehicleSe2>(r#"{"dt": -1.0}"#).is_err());
        assert!(serde_json::from_str::<VehicleSe2>(r#"{"dt": 1.0, "form": "rk4"}"#).is_err());
    }
}
