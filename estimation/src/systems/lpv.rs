//! Linear parameter-varying systems with parameters in [−1, 1].

use super::linear::check;
use crate::EstimationError;
use crate::system::{Embedding, QuasiLpv, System, Variable, Variables, plus_row_times, row_times};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::Real;
use zonobench_sets::{IntervalVector, Matrix};

/// x⁺ = (A₀ + Σ_i δ_i A_i) x + B u + w, y = C x + v with |δ_i| ≤ 1, dimensionless.
///
/// The process noise of `f` has n + d components: w1 … wn, then delta1 … deltad.
/// Keys: `a0`, `a` (the list A₁ … A_d), `c`; `b` may be left out.
///
/// Source: [dePaula, Eqs. (16), (17)].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys")]
pub struct Lpv {
    /// A₀, n × n.
    a0: Matrix,
    /// A₁ … A_d, each n × n.
    a: Vec<Matrix>,
    /// B, n × p (n × 0 without inputs).
    b: Matrix,
    /// C, m × n.
    c: Matrix,
}

/// What stands in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    a0: Matrix,
    a: Vec<Matrix>,
    b: Option<Matrix>,
    c: Matrix,
}

impl TryFrom<Keys> for Lpv {
    type Error = EstimationError;
    fn try_from(keys: Keys) -> Result<Self, EstimationError> {
        Self::new(keys.a0, keys.a, keys.b, keys.c)
    }
}

impl Lpv {
    /// The system with these matrices; without `b` there is no input. `a` may be empty.
    ///
    /// Fails where shapes do not fit, a number is not finite, or there is no state or measurement.
    pub fn new(
        a0: Matrix,
        a: Vec<Matrix>,
        b: Option<Matrix>,
        c: Matrix,
    ) -> Result<Self, EstimationError> {
        let n = a0.rows();
        let b = b.unwrap_or_else(|| Matrix::zeros(n, 0));
        if n == 0 {
            return Err(EstimationError::setting(
                "lpv",
                "a0",
                "at least 1 x 1",
                "no rows",
            ));
        }
        if c.rows() == 0 {
            return Err(EstimationError::setting(
                "lpv",
                "c",
                format!("at least 1 x {n}"),
                "no rows",
            ));
        }
        check("lpv", "a0", &a0, n, n)?;
        for a in &a {
            check("lpv", "a", a, n, n)?;
        }
        check("lpv", "b", &b, n, b.cols())?;
        check("lpv", "c", &c, c.rows(), n)?;
        Ok(Self { a0, a, b, c })
    }
}

impl System for Lpv {
    fn variables(&self) -> Variables {
        let (n, m) = (self.a0.rows(), self.c.rows());
        let mut w = Variable::numbered("w", n);
        w.extend(Variable::numbered("delta", self.n_delta()));
        Variables {
            x: Variable::numbered("x", n),
            u: Variable::numbered("u", self.b.cols()),
            w,
            y: Variable::numbered("y", m),
            v: Variable::numbered("v", m),
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
        let n = self.a0.rows();
        for (i, next) in next.iter_mut().enumerate() {
            let mut sum = row_times(self.a0.row(i), x);
            for (a, &delta) in self.a.iter().zip(&w[n..]) {
                if a.row(i).iter().any(|&m| m != 0.0) {
                    sum = sum + delta * row_times(a.row(i), x);
                }
            }
            *next = plus_row_times(sum, self.b.row(i), u) + w[i];
        }
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = row_times(self.c.row(i), x) + v[i];
        }
    }

    fn kind(&self) -> &'static str {
        "lpv"
    }

    fn n_delta(&self) -> usize {
        self.a.len()
    }

    fn measures_input(&self) -> bool {
        false
    }

    fn quasi_lpv(&self) -> Option<&dyn QuasiLpv> {
        Some(self)
    }
}

impl QuasiLpv for Lpv {
    /// The system's own matrices, whatever the box.
    fn embed(&self, _k: usize, _over: &IntervalVector) -> Result<Embedding, EstimationError> {
        Ok(Embedding {
            a0: self.a0.clone(),
            a: self.a.clone(),
        })
    }
    fn input_matrix(&self) -> Matrix {
        self.b.clone()
    }
    fn output_matrix(&self) -> Matrix {
        self.c.clone()
    }
    fn feedthrough(&self) -> Matrix {
        Matrix::zeros(self.c.rows(), self.b.cols())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delta_scales_its_matrix() {
        let m = |rows: &[[f64; 2]]| Matrix::from_rows(rows).unwrap();
        let s = Lpv::new(
            m(&[[0.0, -0.5], [1.0, 1.0]]),
            vec![m(&[[0.0, 0.0], [0.0, 0.25]])],
            None,
            m(&[[-2.0, 1.0]]),
        )
        .unwrap();
        let mut next = [0.0; 2];
        s.f(0, &[1.0, 2.0], &[], &[0.0, 0.5, -1.0], &mut next);
        assert_eq!(next, [-1.0, 3.0]); // x1 + x2 + 0.5 − 0.25·x2
        let mut y = [0.0];
        s.h(0, &[1.0, 2.0], &[], &[0.5], &mut y);
        assert_eq!(y, [0.5]);
    }
}
