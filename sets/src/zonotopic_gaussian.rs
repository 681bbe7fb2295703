//! A zonotope with a Gaussian added: what the mixed set-membership and Kalman filters carry.

use crate::{Ellipsoid, IntervalVector, List, Matrix, SetError, ops};

/// x = c + G ξ + g with |ξ| ≤ 1 unknown and g ~ N(0, P).
///
/// It promises a probability, never a set: nothing here is rounded outward.
#[derive(Clone, Debug, PartialEq)]
pub struct ZonotopicGaussian {
    c: List<f64>,
    g: Matrix,
    p: Matrix,
}

impl ZonotopicGaussian {
    /// From c in ℝⁿ, G n × p, P n × n.
    ///
    /// P is taken as (P + Pᵀ)/2 and must be positive semidefinite up to rounding. Fails as
    /// [`Ellipsoid::new`], and with `Dimension` or `NotFinite` for G.
    pub fn new(c: impl Into<List<f64>>, g: Matrix, p: Matrix) -> Result<Self, SetError> {
        let c = c.into();
        const OP: &str = "zonotope with a Gaussian";
        if g.rows() != c.len() {
            return Err(SetError::Dimension {
                op: OP,
                expected: c.len(),
                got: g.rows(),
            });
        }
        if let Some(&value) = g.as_slice().iter().find(|x| !x.is_finite()) {
            return Err(SetError::NotFinite { op: OP, value });
        }
        let p = Ellipsoid::new(c.to_vec(), p, 1.0)?.p().clone();
        Ok(Self { c, g, p })
    }

    /// The same from parts that were computed from checked ones: shapes are asserted, P is neither
    /// made symmetric nor factored. For the inner loop of a filter.
    pub fn trusted(c: impl Into<List<f64>>, g: Matrix, p: Matrix) -> Self {
        let c = c.into();
        let n = c.len();
        assert_eq!(
            (g.rows(), p.rows(), p.cols()),
            (n, n, n),
            "zonotope with a Gaussian: c, G and P have the same dimension"
        );
        Self { c, g, p }
    }

    /// The same Gaussian and center with other generators, which have as many rows.
    pub fn with_generators(self, g: Matrix) -> Self {
        Self::trusted(self.c, g, self.p)
    }

    /// n.
    pub fn dim(&self) -> usize {
        self.c.len()
    }

    /// The number of generators.
    pub fn generators(&self) -> usize {
        self.g.cols()
    }

    /// The center c.
    pub fn c(&self) -> &[f64] {
        &self.c
    }

    /// The generators G, n × p.
    pub fn g(&self) -> &Matrix {
        &self.g
    }

    /// The covariance P, n × n, symmetric.
    pub fn p(&self) -> &Matrix {
        &self.p
    }

    /// Half-widths r_i = Σ_j |G_ij| + √(σ P_ii) of the confidence box.
    ///
    /// With σ = [`chi_square_isf`](crate::ellipsoid::chi_square_isf)(α, n) the box c ± r holds x with a
    /// probability of at least 1 − α: g lies in the ellipsoid of level σ with probability 1 − α, and the
    /// box contains the sum of ellipsoid and zonotope. Not a guaranteed set.
    ///
    /// Source: [dePaula, Eqs. (14), (15)].
    pub fn confidence_radius(&self, sigma: f64) -> Vec<f64> {
        let _stage = ops::stage(ops::Stage::Hull);
        ops::count(2 * self.dim(), self.dim());
        let sums = self.g.abs_row_sums();
        let deviation = |i: usize| (sigma * self.p[(i, i)].max(0.0)).sqrt();
        (0..self.dim()).map(|i| sums[i] + deviation(i)).collect()
    }

    /// The confidence box c ± r of [`ZonotopicGaussian::confidence_radius`].
    ///
    /// Fails with `NotFinite` if `sigma` is negative, not finite, or a bound overflows.
    pub fn confidence_box(&self, sigma: f64) -> Result<IntervalVector, SetError> {
        let radius = self.confidence_radius(sigma);
        let bounds = |sign: f64| -> Vec<f64> {
            let both = self.c.iter().zip(&radius);
            both.map(|(c, r)| c + sign * r).collect()
        };
        IntervalVector::from_bounds(&bounds(-1.0), &bounds(1.0))
    }

    /// tr(G Gᵀ) = Σ g_ij².
    pub fn trace_ggt(&self) -> f64 {
        (0..self.dim())
            .map(|i| crate::matrix::dot(self.g.row(i), self.g.row(i)))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_confidence_box_adds_row_sums_and_deviations() {
        let g = Matrix::from_rows(&[[1.0, -2.0], [0.0, 0.5]]).unwrap();
        let p = Matrix::from_rows(&[[4.0, 0.0], [0.0, 0.0]]).unwrap();
        let x = ZonotopicGaussian::new(vec![1.0, 0.0], g, p).unwrap();
        // r = (3 + √(9·4), 0.5 + 0)
        assert_eq!(x.confidence_radius(9.0), [9.0, 0.5]);
        let sides = x.confidence_box(9.0).unwrap();
        assert_eq!(sides.lower(), [-8.0, -0.5]);
        assert_eq!(sides.upper(), [10.0, 0.5]);
        assert!(x.confidence_box(-1.0).is_err());
        assert_eq!(x.trace_ggt(), 5.25);
    }

    #[test]
    fn a_covariance_with_a_negative_eigenvalue_is_refused() {
        let p = Matrix::from_rows(&[[1.0, 2.0], [2.0, 1.0]]).unwrap();
        assert!(ZonotopicGaussian::new(vec![0.0; 2], Matrix::zeros(2, 0), p).is_err());
        let g = Matrix::zeros(3, 1);
        assert!(ZonotopicGaussian::new(vec![0.0; 2], g, Matrix::identity(2)).is_err());
    }
}
