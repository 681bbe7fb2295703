//! The measurement equation y = C x + D u + v of the linear filters, restricted to what was measured.

use crate::error::finite_vector;
use crate::estimator::Measurement;
use crate::{EstimationError, Uncertain};
use std::borrow::Cow;
use zonobench_sets::{List, Matrix};

/// y = C x + D u + v with v = e + Gᵛ ξ + g, ‖ξ‖∞ ≤ 1, g ~ N(0, R).
#[derive(Clone, Debug)]
pub(super) struct LinearOutput {
    /// C, m × n.
    pub c: Matrix,
    /// D, m × p.
    pub d: Matrix,
    /// e, the mean of v.
    pub mean: List<f64>,
    /// Gᵛ, m × n_gv.
    pub generators: Matrix,
    /// R, m × m.
    pub covariance: Matrix,
}

impl LinearOutput {
    pub fn new(c: Matrix, d: Matrix, mean: List<f64>, v: &Uncertain) -> Self {
        Self {
            c,
            d,
            mean,
            generators: v.generator_matrix(),
            covariance: v.covariance_matrix(),
        }
    }

    /// The rows that were measured, and y − D u − e in them.
    ///
    /// Fails where `u` or `y` has the wrong length or a number that is not finite.
    pub fn observe(
        &self,
        u: &[f64],
        y: Measurement,
    ) -> Result<(Cow<'_, Self>, List<f64>), EstimationError> {
        finite_vector("input u", u, self.d.cols())?;
        check_measurement(y, self.c.rows())?;
        let value = |i: usize, y: f64| {
            let mut z = y;
            for (d, u) in self.d.row(i).iter().zip(u) {
                z -= d * u;
            }
            z - self.mean[i]
        };
        let z = y
            .iter()
            .enumerate()
            .filter_map(|(i, y)| y.map(|y| value(i, y)))
            .collect();
        if y.iter().all(Option::is_some) {
            return Ok((Cow::Borrowed(self), z));
        }
        let rows: List<usize> = (0..y.len()).filter(|&i| y[i].is_some()).collect();
        let select = |m: &Matrix| Matrix::from_fn(rows.len(), m.cols(), |i, j| m[(rows[i], j)]);
        Ok((
            Cow::Owned(Self {
                c: select(&self.c),
                d: select(&self.d),
                mean: rows.iter().map(|&i| self.mean[i]).collect(),
                generators: select(&self.generators),
                covariance: select(&self.covariance).select_columns(&rows),
            }),
            z,
        ))
    }
}

impl LinearOutput {
    /// The sizes of the numbers that each z_i − C_i x̂ is computed from: |z_i| + |e_i| + |C_i| |x̂| + |D_i| |u|, and
    /// the deviation √(C P₀ Cᵀ)_ii that the prior allowed. Of the rows that were measured.
    pub fn sizes(&self, x: &[f64], u: &[f64], z: &[f64], prior: &Matrix) -> List<f64> {
        let dot =
            |row: &[f64], v: &[f64]| -> f64 { row.iter().zip(v).map(|(a, b)| (a * b).abs()).sum() };
        let allowed = congruence(&self.c, prior);
        (0..z.len())
            .map(|i| {
                z[i].abs()
                    + self.mean[i].abs()
                    + dot(self.c.row(i), x)
                    + dot(self.d.row(i), u)
                    + allowed[(i, i)].max(0.0).sqrt()
            })
            .collect()
    }
}

/// Fails unless `y` has `m` components, all that are there finite.
pub(super) fn check_measurement(y: Measurement, m: usize) -> Result<(), EstimationError> {
    if y.len() != m {
        return Err(EstimationError::Dimension {
            what: "measurement y",
            expected: m,
            got: y.len(),
        });
    }
    match y.iter().flatten().find(|y| !y.is_finite()) {
        Some(&value) => Err(EstimationError::NotFinite {
            what: "measurement y",
            value,
        }),
        None => Ok(()),
    }
}

/// I − K C.
pub(super) fn complement(k: &Matrix, c: &Matrix) -> Matrix {
    Matrix::identity(k.rows()).sub(&k.mul(c))
}

/// M P Mᵀ, exactly symmetric.
pub(super) fn congruence(m: &Matrix, p: &Matrix) -> Matrix {
    let mut out = m.mul(p).mul_transpose(m);
    out.symmetrize();
    out
}
