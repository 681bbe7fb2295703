//! The Van der Pol oscillator, sampled by Euler's rule.

use crate::EstimationError;
use crate::system::{Embedding, QuasiLpv, System, Variable, Variables};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::Real;
use zonobench_sets::{IntervalVector, Matrix};

/// x₁⁺ = x₁ + T x₂ + w₁, x₂⁺ = −T x₁ + (1 + T − T x₁²) x₂ + w₂, y = x₁ + x₂ + v.
///
/// Source: [dePaula, Sec. V-A].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys")]
pub struct VanDerPol {
    /// T, the sampling period in s.
    pub(crate) ts: f64,
}

/// What stands in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    pub(crate) ts: f64,
}

impl TryFrom<Keys> for VanDerPol {
    type Error = EstimationError;
    fn try_from(keys: Keys) -> Result<Self, EstimationError> {
        Self::new(keys.ts)
    }
}

impl VanDerPol {
    /// The oscillator with sampling period `ts` in s, which must be positive and finite.
    pub fn new(ts: f64) -> Result<Self, EstimationError> {
        if !(ts > 0.0 && ts.is_finite()) {
            return Err(EstimationError::setting(
                "van-der-pol",
                "ts",
                "positive and finite",
                ts,
            ));
        }
        Ok(Self { ts })
    }
}

impl System for VanDerPol {
    fn variables(&self) -> Variables {
        Variables {
            x: Variable::numbered("x", 2),
            u: Vec::new(),
            w: Variable::numbered("w", 2),
            y: Variable::numbered("y", 1),
            v: Variable::numbered("v", 1),
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], w: &[S], next: &mut [S]) {
        let ts = self.ts;
        next[0] = x[0] + x[1] * ts + w[0];
        // (1 + T − T x₁²) as 1 + T (1 − x₁²): x₁ once.
        let damping = S::constant(1.0) + (S::constant(1.0) - x[0].sqr()) * ts;
        next[1] = damping * x[1] - x[0] * ts + w[1];
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        y[0] = x[0] + x[1] + v[0];
    }

    fn kind(&self) -> &'static str {
        "van-der-pol"
    }

    fn period(&self) -> Option<f64> {
        Some(self.ts)
    }

    fn measures_input(&self) -> bool {
        false
    }

    fn quasi_lpv(&self) -> Option<&dyn QuasiLpv> {
        Some(self)
    }
}

impl QuasiLpv for VanDerPol {
    /// With \[z\] = \[x₁\]², A₀ = [1, T; −T, 1 + T − T mid z] and A₁ = [0, 0; 0, −T rad z].
    ///
    /// Source: [dePaula, Sec. V-A].
    fn embed(&self, k: usize, over: &IntervalVector) -> Result<Embedding, EstimationError> {
        let ts = self.ts;
        let z = over[0]
            .sqr()
            .finite("square of x1")
            .map_err(EstimationError::at(k, "embedding"))?;
        let mut a0 = Matrix::zeros(2, 2);
        a0[(0, 0)] = 1.0;
        a0[(0, 1)] = ts;
        a0[(1, 0)] = -ts;
        a0[(1, 1)] = 1.0 + ts - ts * z.mid();
        let mut a1 = Matrix::zeros(2, 2);
        a1[(1, 1)] = -ts * z.rad();
        Ok(Embedding { a0, a: vec![a1] })
    }
    fn input_matrix(&self) -> Matrix {
        Matrix::zeros(2, 0)
    }
    fn output_matrix(&self) -> Matrix {
        Matrix::from_fn(1, 2, |_, _| 1.0)
    }
    fn feedthrough(&self) -> Matrix {
        Matrix::zeros(1, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedding_holds_the_system_at_both_ends_of_its_box() {
        let s = VanDerPol::new(0.1).unwrap();
        let over = IntervalVector::from_bounds(&[-1.0, 0.0], &[2.0, 1.0]).unwrap();
        let e = s.embed(0, &over).unwrap();
        for x1 in [-1.0, 0.0, 1.5, 2.0] {
            let exact = 1.1 - 0.1 * x1 * x1;
            let (mid, rad) = (e.a0[(1, 1)], e.a[0][(1, 1)].abs());
            assert!(
                (exact - mid).abs() <= rad + 1e-15,
                "{x1}: {exact} in {mid} ± {rad}"
            );
        }
        // [x₁]² = [0, 4], not [−2, 4].
        assert!((e.a0[(1, 1)] - 0.9).abs() < 1e-14 && (e.a[0][(1, 1)] + 0.2).abs() < 1e-14);
    }

    #[test]
    fn one_step_is_eulers_rule() {
        let mut next = [0.0; 2];
        VanDerPol::new(0.5)
            .unwrap()
            .f(0, &[2.0, 1.0], &[], &[0.25, 0.125], &mut next);
        assert_eq!(next, [2.75, 1.0 + 0.5 - 2.0 - 1.0 + 0.125]);
    }
}
