//! What a covariance is, whatever the units of its components.
//!
//! Variances of components with units of their own may differ by any factor, so nothing here compares them: Σ is divided
//! by powers of two at or below the standard deviations first, which is exact and makes of it the correlation matrix up
//! to factors below 4. Nothing is rounded outward: these belong to probabilities.

use crate::units::power_below;
use crate::{List, Matrix};

/// How far Σ may be from symmetric and from positive semidefinite, once its components are divided by powers of two
/// near their standard deviations: room for a covariance that was computed as a product, and no more.
pub const TOLERANCE: f64 = 1e-12;

/// Why a matrix is no covariance. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A variance is negative.
    Negative {
        /// Its component.
        i: usize,
    },
    /// Σ_ij and Σ_ji differ.
    Asymmetric {
        /// i.
        i: usize,
        /// j < i.
        j: usize,
    },
    /// |Σ_ij| is greater than √(Σ_ii Σ_jj).
    Correlation {
        /// i.
        i: usize,
        /// j < i.
        j: usize,
    },
    /// The correlation matrix has a negative eigenvalue, or none that is a number.
    Eigenvalue {
        /// The eigenvalue.
        value: f64,
    },
}

/// Σ = diag(u) R diag(u) with powers of two u and 1 ≤ R_ii < 4, or Σ_ii = 0, u_i = 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaled {
    /// u.
    pub units: List<f64>,
    /// R, n × n, symmetric if Σ is.
    pub matrix: Matrix,
}

impl Scaled {
    /// From a square Σ; a variance that is not positive has the unit 1.
    pub fn new(sigma: &Matrix) -> Self {
        let unit = |i: usize| power_below(sigma[(i, i)].max(0.0).sqrt());
        let units: List<f64> = (0..sigma.rows()).map(unit).collect();
        let matrix = Matrix::from_fn(sigma.rows(), sigma.cols(), |i, j| {
            sigma[(i, j)] / units[i] / units[j]
        });
        Self { units, matrix }
    }

    /// Whether Σ is symmetric and positive semidefinite within [`TOLERANCE`]; the first fault if not.
    ///
    /// A component of variance 0 has no covariance with any other. The eigenvalue told is that of the correlation
    /// matrix.
    pub fn check(&self) -> Result<(), Fault> {
        let (r, n) = (&self.matrix, self.matrix.rows());
        for i in 0..n {
            // Also where it is NaN.
            if r[(i, i)] < 0.0 || r[(i, i)].is_nan() {
                return Err(Fault::Negative { i });
            }
            for j in 0..i {
                let (a, b) = (r[(i, j)], r[(j, i)]);
                if a != b && ((a - b).abs() > 4.0 * TOLERANCE || r[(i, i)] * r[(j, j)] == 0.0) {
                    return Err(Fault::Asymmetric { i, j });
                }
                let most = (r[(i, i)] * r[(j, j)]).sqrt() * (1.0 + TOLERANCE);
                if a.abs().max(b.abs()) > most || (a + b).is_nan() {
                    return Err(Fault::Correlation { i, j });
                }
            }
        }
        let smallest_of = |m: &Matrix| m.symmetric_eigen().0.into_iter().fold(f64::INFINITY, least);
        if n > 1 {
            let smallest = smallest_of(r);
            if smallest.is_nan() || smallest < -4.0 * TOLERANCE * n as f64 {
                let deviation = |i: usize| {
                    if r[(i, i)] > 0.0 {
                        r[(i, i)].sqrt()
                    } else {
                        1.0
                    }
                };
                let value = smallest_of(&Matrix::from_fn(n, n, |i, j| {
                    r[(i, j)] / deviation(i) / deviation(j)
                }));
                return Err(Fault::Eigenvalue { value });
            }
        }
        Ok(())
    }

    /// F with F Fᵀ = Σ up to rounding: Cholesky's factor, in which a pivot that is zero up to the rounding of its own
    /// row gives a column of zeros. A component of variance 0 has a row of zeros.
    ///
    /// Σ must have passed [`Scaled::check`].
    pub fn factor(&self) -> Matrix {
        let (r, n) = (&self.matrix, self.matrix.rows());
        let mut factor = Matrix::zeros(n, n);
        for j in 0..n {
            let pivot = (0..j).fold(r[(j, j)], |s, k| s - factor[(j, k)] * factor[(j, k)]);
            if pivot <= 4.0 * f64::EPSILON * n as f64 * r[(j, j)] {
                continue;
            }
            let root = pivot.sqrt();
            factor[(j, j)] = root;
            for i in j + 1..n {
                let rest = (0..j).fold(r[(i, j)], |s, k| s - factor[(i, k)] * factor[(j, k)]);
                factor[(i, j)] = rest / root;
            }
        }
        crate::units::multiplied_rows(&factor, &self.units)
    }
}

/// The lesser, NaN if either is.
fn least(a: f64, b: f64) -> f64 {
    if a.is_nan() || b >= a { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scaled(rows: &[&[f64]]) -> Scaled {
        Scaled::new(&Matrix::from_rows(rows).unwrap())
    }

    /// A correlation of 2 and a negative variance, beside a variance of 10⁶.
    #[test]
    fn a_fault_beside_a_large_variance_is_a_fault() {
        let large = 1e6;
        let two = scaled(&[&[large, 0.0, 0.0], &[0.0, 1e-8, 2e-8], &[0.0, 2e-8, 1e-8]]);
        assert_eq!(two.check(), Err(Fault::Correlation { i: 2, j: 1 }));
        let negative = scaled(&[&[large, 0.0], &[0.0, -2.96e-8]]);
        assert_eq!(negative.check(), Err(Fault::Negative { i: 1 }));
        let skew = scaled(&[&[large, 0.0, 0.0], &[0.0, 1e-8, 1e-9], &[0.0, 2e-9, 1e-8]]);
        assert_eq!(skew.check(), Err(Fault::Asymmetric { i: 2, j: 1 }));
        let none = scaled(&[&[large, 1e-3], &[1e-3, 0.0]]);
        assert_eq!(none.check(), Err(Fault::Correlation { i: 1, j: 0 }));
        // Each pair is possible, the three together are not: the eigenvalue of the correlations is 1 − 2 · 0.9.
        let s = [1e3, 1e-4, 1e-9];
        let sign = |i: usize, j: usize| if i == j { 1.0 } else { -0.9 };
        let three = Matrix::from_fn(3, 3, |i, j| sign(i, j) * s[i] * s[j]);
        match Scaled::new(&three).check() {
            Err(Fault::Eigenvalue { value }) => assert!((value + 0.8).abs() < 1e-12, "{value}"),
            other => panic!("{other:?}"),
        }
        let nan = Matrix::from_fn(2, 2, |i, j| if i == j { 1.0 } else { f64::NAN });
        assert!(Scaled::new(&nan).check().is_err());
    }

    #[test]
    fn a_computed_covariance_is_one_in_any_units() {
        for e in [-300, -40, 0, 40, 300] {
            let s = [1.0, libm::scalbn(1.0, e), libm::scalbn(1.0, -e)];
            let root = Matrix::from_fn(3, 2, |i, j| s[i] * ((5 * i + 3 * j) % 7) as f64 / 3.0);
            // Of rank 2, by products.
            let sigma = root.gram();
            assert_eq!(Scaled::new(&sigma).check(), Ok(()), "{e}");
        }
    }

    #[test]
    fn a_small_variance_beside_a_large_one_keeps_its_correlation() {
        let sigma = scaled(&[&[1e6, 5e-4], &[5e-4, 1e-12]]);
        let f = sigma.factor();
        let back = f.mul_transpose(&f);
        for (i, j, s) in [(0, 0, 1e6), (0, 1, 5e-4), (1, 1, 1e-12)] {
            assert!((back[(i, j)] / s - 1.0).abs() < 1e-15, "{back:?}");
        }
        let zero = scaled(&[&[0.0, 0.0], &[0.0, 1e-300]]).factor();
        assert_eq!(zero.row(0), [0.0, 0.0]);
        assert!((zero[(1, 1)] / 1e-150 - 1.0).abs() < 1e-15);
    }
}
