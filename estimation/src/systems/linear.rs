//! Linear time-invariant systems.

use crate::EstimationError;
use crate::system::{
    Embedding, LinearParts, QuasiLpv, System, Variable, Variables, plus_row_times, row_times,
};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::Real;
use zonobench_sets::{IntervalVector, Matrix};

/// x⁺ = A x + B u + w, y = C x + D u + v, dimensionless.
///
/// w has as many components as x, v as many as y. Keys: `a`, `c`; `b` and `d` may be left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys")]
pub struct Linear {
    /// A, n × n.
    a: Matrix,
    /// B, n × p (n × 0 without inputs).
    b: Matrix,
    /// C, m × n.
    c: Matrix,
    /// D, m × p.
    d: Matrix,
}

/// What stands in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    a: Matrix,
    b: Option<Matrix>,
    c: Matrix,
    d: Option<Matrix>,
}

impl TryFrom<Keys> for Linear {
    type Error = EstimationError;
    fn try_from(keys: Keys) -> Result<Self, EstimationError> {
        Self::new(keys.a, keys.b, keys.c, keys.d)
    }
}

impl Linear {
    /// The system with these matrices; without `b` and `d` they are zero (p = 0 without both).
    ///
    /// Fails where shapes do not fit, a number is not finite, or there is no state or measurement.
    pub fn new(
        a: Matrix,
        b: Option<Matrix>,
        c: Matrix,
        d: Option<Matrix>,
    ) -> Result<Self, EstimationError> {
        let (n, m) = (a.rows(), c.rows());
        let p = b.as_ref().or(d.as_ref()).map_or(0, Matrix::cols);
        let b = b.unwrap_or_else(|| Matrix::zeros(n, p));
        let d = d.unwrap_or_else(|| Matrix::zeros(m, p));
        if n == 0 {
            return Err(EstimationError::setting(
                "linear",
                "a",
                "at least 1 x 1",
                "no rows",
            ));
        }
        if m == 0 {
            return Err(EstimationError::setting(
                "linear",
                "c",
                format!("at least 1 x {n}"),
                "no rows",
            ));
        }
        check("linear", "a", &a, n, n)?;
        check("linear", "b", &b, n, p)?;
        check("linear", "c", &c, m, n)?;
        check("linear", "d", &d, m, p)?;
        Ok(Self { a, b, c, d })
    }

    /// A, B, C, D.
    pub fn parts(&self) -> LinearParts {
        LinearParts {
            a: self.a.clone(),
            b: self.b.clone(),
            c: self.c.clone(),
            d: self.d.clone(),
        }
    }
}

/// Fails unless `m` is `rows` × `cols` and finite.
pub(super) fn check(
    kind: &'static str,
    key: &'static str,
    m: &Matrix,
    rows: usize,
    cols: usize,
) -> Result<(), EstimationError> {
    if (m.rows(), m.cols()) != (rows, cols) {
        let got = format!("{} x {}", m.rows(), m.cols());
        return Err(EstimationError::setting(
            kind,
            key,
            format!("{rows} x {cols}"),
            got,
        ));
    }
    match m.as_slice().iter().find(|x| !x.is_finite()) {
        Some(x) => Err(EstimationError::setting(kind, key, "finite numbers", x)),
        None => Ok(()),
    }
}

impl System for Linear {
    fn variables(&self) -> Variables {
        let (n, m) = (self.a.rows(), self.c.rows());
        Variables {
            x: Variable::numbered("x", n),
            u: Variable::numbered("u", self.b.cols()),
            w: Variable::numbered("w", n),
            y: Variable::numbered("y", m),
            v: Variable::numbered("v", m),
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
        for (i, next) in next.iter_mut().enumerate() {
            *next = plus_row_times(row_times(self.a.row(i), x), self.b.row(i), u) + w[i];
        }
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], u: &[f64], v: &[S], y: &mut [S]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = plus_row_times(row_times(self.c.row(i), x), self.d.row(i), u) + v[i];
        }
    }

    fn kind(&self) -> &'static str {
        "linear"
    }

    fn measures_input(&self) -> bool {
        self.d.as_slice().iter().any(|&d| d != 0.0)
    }

    fn linear_parts(&self) -> Option<LinearParts> {
        Some(self.parts())
    }

    fn quasi_lpv(&self) -> Option<&dyn QuasiLpv> {
        Some(self)
    }
}

impl QuasiLpv for Linear {
    /// A₀ = A, no A_i.
    fn embed(&self, _k: usize, _over: &IntervalVector) -> Result<Embedding, EstimationError> {
        Ok(Embedding {
            a0: self.a.clone(),
            a: Vec::new(),
        })
    }
    fn input_matrix(&self) -> Matrix {
        self.b.clone()
    }
    fn output_matrix(&self) -> Matrix {
        self.c.clone()
    }
    fn feedthrough(&self) -> Matrix {
        self.d.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn m(rows: &[&[f64]]) -> Matrix {
        Matrix::from_rows(rows).unwrap()
    }

    #[test]
    fn a_step_is_a_x_plus_b_u_plus_w() {
        let s = Linear::new(
            m(&[&[1.0, 2.0], &[0.0, 3.0]]),
            Some(m(&[&[1.0], &[-1.0]])),
            m(&[&[1.0, 1.0]]),
            Some(m(&[&[10.0]])),
        )
        .unwrap();
        let (mut next, mut y) = ([0.0; 2], [0.0]);
        s.f(0, &[1.0, 2.0], &[4.0], &[0.5, 0.25], &mut next);
        s.h(0, &[1.0, 2.0], &[4.0], &[0.125], &mut y);
        assert_eq!((next, y), ([9.5, 2.25], [43.125]));
    }

    #[test]
    fn shapes_that_do_not_fit_are_refused_by_key() {
        let error = Linear::new(m(&[&[1.0]]), None, m(&[&[1.0, 2.0]]), None).unwrap_err();
        assert_eq!(error.to_string(), "linear: `c` must be 1 x 1, got 1 x 2");
        let error = Linear::new(m(&[&[f64::NAN]]), None, m(&[&[1.0]]), None).unwrap_err();
        assert_eq!(
            error.to_string(),
            "linear: `a` must be finite numbers, got NaN"
        );
    }
}
