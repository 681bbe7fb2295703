//! A unicycle with constant speed and turn rate that sees the distance and the bearing of landmarks.

use crate::EstimationError;
use crate::system::{System, Variable, Variables};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::Real;
use zonobench_sets::{Interval, IntervalVector};

/// s_x⁺ = s_x + T₀ φ_ω cos θ + w₁, s_y⁺ = s_y + T₀ φ_ω sin θ + w₂, θ⁺ = θ + T₀ φ_θ + w₃, and for every
/// landmark (L_x, L_y) two measurements: d = √((L_x − s_x)² + (L_y − s_y)²) + v and
/// φ = θ − arctan((L_y − s_y)/(L_x − s_x)) + v.
///
/// Defined where L_x ≠ s_x for every landmark; φ is the bearing where L_x > s_x.
///
/// Source: [Khajenejad, Sec. V-B], after Chen and Hu 2018; the landmarks are not printed there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys")]
pub struct Unicycle {
    /// T₀ in s.
    pub(crate) t0: f64,
    /// φ_ω, the speed in m/s.
    pub(crate) phi_omega: f64,
    /// φ_θ, the turn rate in rad/s.
    pub(crate) phi_theta: f64,
    /// (L_x, L_y) in m.
    pub(crate) landmarks: Vec<[f64; 2]>,
}

/// What stands in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    t0: f64,
    phi_omega: f64,
    phi_theta: f64,
    landmarks: Vec<[f64; 2]>,
}

impl TryFrom<Keys> for Unicycle {
    type Error = EstimationError;
    fn try_from(keys: Keys) -> Result<Self, EstimationError> {
        Self::new(keys.t0, keys.phi_omega, keys.phi_theta, keys.landmarks)
    }
}

impl Unicycle {
    /// The unicycle with period `t0` > 0 in s, speed φ_ω, turn rate φ_θ and at least one landmark; all finite.
    pub fn new(
        t0: f64,
        phi_omega: f64,
        phi_theta: f64,
        landmarks: Vec<[f64; 2]>,
    ) -> Result<Self, EstimationError> {
        let fault = |key, expected: &str, got: String| {
            Err(EstimationError::setting("unicycle", key, expected, got))
        };
        if !(t0 > 0.0 && t0.is_finite()) {
            return fault("t0", "positive and finite", t0.to_string());
        }
        for (key, value) in [("phi_omega", phi_omega), ("phi_theta", phi_theta)] {
            if !value.is_finite() {
                return fault(key, "finite", value.to_string());
            }
        }
        if landmarks.is_empty() {
            return fault("landmarks", "at least one pair [x, y]", "none".into());
        }
        if let Some([x, y]) = landmarks.iter().find(|l| l.iter().any(|c| !c.is_finite())) {
            return fault("landmarks", "finite numbers", format!("[{x}, {y}]"));
        }
        Ok(Self {
            t0,
            phi_omega,
            phi_theta,
            landmarks,
        })
    }

    /// The landmark whose abscissa a box of states reaches, where the measurement is not defined.
    fn reached(&self, x: &IntervalVector) -> Option<(usize, Interval)> {
        let ahead = |(i, l): (usize, &[f64; 2])| (i, Interval::point(l[0]) - x[0]);
        let landmarks = self.landmarks.iter().enumerate();
        landmarks.map(ahead).find(|(_, a)| a.contains(0.0))
    }
}

impl System for Unicycle {
    fn variables(&self) -> Variables {
        let y = (1..=self.landmarks.len()).flat_map(|i| {
            [
                Variable::new(format!("d{i}"), "m"),
                Variable::new(format!("phi{i}"), "rad"),
            ]
        });
        let y: Vec<Variable> = y.collect();
        let v = y.iter().enumerate();
        let v = v.map(|(i, y)| Variable::new(format!("v{}", i + 1), y.unit.clone()));
        Variables {
            x: vec![
                Variable::new("sx", "m"),
                Variable::new("sy", "m"),
                Variable::new("theta", "rad"),
            ],
            u: Vec::new(),
            w: vec![
                Variable::new("w1", "m"),
                Variable::new("w2", "m"),
                Variable::new("w3", "rad"),
            ],
            v: v.collect(),
            y,
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], w: &[S], next: &mut [S]) {
        let way = S::constant(self.phi_omega) * self.t0;
        let turn = S::constant(self.phi_theta) * self.t0;
        next[0] = x[0] + way * x[2].cos() + w[0];
        next[1] = x[1] + way * x[2].sin() + w[1];
        next[2] = x[2] + turn + w[2];
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        for (i, l) in self.landmarks.iter().enumerate() {
            let (a, b) = (-x[0] + l[0], -x[1] + l[1]);
            y[2 * i] = (a.sqr() + b.sqr()).sqrt() + v[2 * i];
            y[2 * i + 1] = x[2] - (b / a).atan() + v[2 * i + 1];
        }
    }

    fn kind(&self) -> &'static str {
        "unicycle"
    }

    fn period(&self) -> Option<f64> {
        Some(self.t0)
    }

    fn measures_input(&self) -> bool {
        false
    }

    fn domain_fault(&self, over: &IntervalVector) -> Option<String> {
        self.reached(over).map(|(i, a)| {
            format!(
                "the set reaches the abscissa of landmark {}: its distance ahead is in [{}, {}], and the \
                 bearing is not defined at 0",
                i + 1,
                a.lo(),
                a.hi()
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unicycle() -> Unicycle {
        Unicycle::new(1.0, 0.3, 0.15, vec![[5.0, 15.0], [15.0, 15.0]]).unwrap()
    }

    #[test]
    fn a_step_and_a_look_by_hand() {
        let system = unicycle();
        let mut next = [0.0; 3];
        system.f(0, &[0.1, 0.2, 0.0], &[], &[0.0, 0.0, 0.5], &mut next);
        assert!((next[0] - 0.4).abs() < 1e-15 && next[1] == 0.2 && (next[2] - 0.65).abs() < 1e-15);
        // 3, 4, 5 and 12, 5, 13 from (2, 11) to (5, 15) and from (3, 10) to (15, 15).
        let mut y = [0.0; 4];
        system.h(0, &[2.0, 11.0, 1.0], &[], &[0.0; 4], &mut y);
        assert!((y[0] - 5.0).abs() < 1e-15 && (y[1] - (1.0 - libm::atan(4.0 / 3.0))).abs() < 1e-15);
        system.h(0, &[3.0, 10.0, 1.0], &[], &[0.0; 4], &mut y);
        assert!((y[2] - 13.0).abs() < 1e-15);
    }

    #[test]
    fn a_box_that_reaches_a_landmark_is_told() {
        let over = |hi| IntervalVector::from_bounds(&[0.0; 3], &[hi, 1.0, 1.0]).unwrap();
        assert!(unicycle().reached(&over(4.9)).is_none());
        assert_eq!(unicycle().reached(&over(5.5)).unwrap().0, 0);
    }

    #[test]
    fn bad_parameters_are_refused_with_their_key() {
        let message = |l| Unicycle::new(1.0, 0.3, 0.1, l).unwrap_err().to_string();
        assert!(message(vec![]).contains("landmarks"));
        assert!(message(vec![[f64::NAN, 1.0]]).contains("finite"));
        assert!(Unicycle::new(0.0, 0.3, 0.1, vec![[1.0, 1.0]]).is_err());
    }
}
