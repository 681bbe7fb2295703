//! The operations that make new zonotopes, with the rounding each of them adds to r.
//!
//! Notation: fl(·) is what the floating-point code computes, ⌈·⌉ an upper bound on a nonnegative sum
//! (`rounding::up`), γ_k = k u / (1 − k u). A product of n terms is off by at most γ_n times the product
//! of the absolute values, plus less than η for all its underflows. |G ξ| ≤ |G| 1 turns an error of G
//! into an error of the set.

use super::{Zonotope, box_columns, same};
use crate::rounding::{ETA, U, gamma, up};
use crate::{IntervalMatrix, List, Matrix, SetError, ops};

impl Zonotope {
    /// Encloses { M x : x ∈ X }, M m × n. See [`Zonotope::affine_map`].
    pub fn linear_map(&self, m: &Matrix) -> Result<Self, SetError> {
        self.affine_map(m, &List::filled(0.0, m.rows()))
    }

    /// Encloses { M x + t : x ∈ X }, M m × n, t in ℝᵐ.
    ///
    /// c' = fl(M c + t), G' = fl(M G),
    /// r' = ⌈|M| r + γ_{n+1} (|M| |c| + |t|) + γ_n |M| (|G| 1)⌉.
    ///
    /// Fails with `Dimension` if shapes differ or m = 0, with `NotFinite` if M, t or the result is not
    /// finite.
    pub fn affine_map(&self, m: &Matrix, t: &[f64]) -> Result<Self, SetError> {
        const OP: &str = "affine map of a zonotope";
        let n = self.dim();
        same(OP, n, m.cols())?;
        same(OP, m.rows(), t.len())?;
        let mut c = m.mul_vec(&self.c);
        c.iter_mut().zip(t).for_each(|(c, t)| *c += t);
        let sums = self.abs_row_sums();
        // What |M| multiplies; η covers the underflow of γ · |c| under a large |M|.
        let carried: List<f64> = (0..n)
            .map(|k| self.r[k] + gamma(n + 1) * self.c[k].abs() + gamma(n) * sums[k] + ETA)
            .collect();
        let r: List<f64> = (0..m.rows())
            .map(|i| {
                up(
                    abs_dot(m.row(i), &carried) + gamma(n + 1) * t[i].abs(),
                    n + 6,
                )
            })
            .collect();
        Self::nonempty(OP, c, m.mul(&self.g), r)
    }

    /// Encloses { M x : M ∈ \[M\], x ∈ X }, \[M\] m × n. See [`Zonotope::interval_affine_map`].
    pub fn interval_map(&self, m: &IntervalMatrix) -> Result<Self, SetError> {
        self.interval_affine_map(m, &List::filled(0.0, m.rows()))
    }

    /// Zonotope inclusion: encloses { M x + t : M ∈ \[M\], x ∈ X }, \[M\] m × n, t in ℝᵐ.
    ///
    /// ⟨mid c + t, [mid G, diag(⌈rad (|c| + |G| 1 + r)⌉)]⟩ with mid an f64 matrix inside \[M\] and
    /// |M − mid| ≤ rad; the first part is the affine map by mid with its r. Rows of no radius add no
    /// column. Fails as [`Zonotope::affine_map`].
    ///
    /// Source: zonotope inclusion of T. Alamo, J. M. Bravo, E. F. Camacho, "Guaranteed state estimation
    /// by zonotopes", Automatica 2005; with |c| for an interval matrix that multiplies c too, as in
    /// [dePaula, Remark 3].
    pub fn interval_affine_map(&self, m: &IntervalMatrix, t: &[f64]) -> Result<Self, SetError> {
        const OP: &str = "interval map of a zonotope";
        let n = self.dim();
        same(OP, n, m.cols())?;
        let mut image = self.affine_map(&m.mid(), t)?;
        let radius = self.radius();
        let extent: List<f64> = (0..n).map(|k| self.c[k].abs() + radius[k]).collect();
        let rad = m.rad();
        let sides: List<f64> = (0..m.rows())
            .map(|i| match rad.row(i).iter().all(|&x| x == 0.0) {
                true => 0.0,
                false => up(abs_dot(rad.row(i), &extent), n + 1),
            })
            .collect();
        image.g = Matrix::hcat(&[&image.g, &box_columns(&sides)]);
        Self::checked(OP, image.c, image.g, image.r)
    }

    /// Encloses X ⊕ Y = { x + y : x ∈ X, y ∈ Y }.
    ///
    /// c' = fl(c_x + c_y), G' = [G_x, G_y], r' = ⌈r_x + r_y + u |c'|⌉. Fails with `Dimension`, or
    /// `NotFinite` on overflow.
    pub fn minkowski_sum(&self, y: &Self) -> Result<Self, SetError> {
        const OP: &str = "Minkowski sum of zonotopes";
        same(OP, self.dim(), y.dim())?;
        ops::count(0, self.dim());
        let c: List<f64> = self.c.iter().zip(&y.c).map(|(a, b)| a + b).collect();
        let r: List<f64> = (0..self.dim())
            // A sum with a zero term is exact.
            .map(|i| match self.c[i] == 0.0 || y.c[i] == 0.0 {
                true if self.r[i] == 0.0 || y.r[i] == 0.0 => self.r[i] + y.r[i],
                true => up(self.r[i] + y.r[i], 1),
                false => up(self.r[i] + y.r[i] + U * c[i].abs(), 3),
            })
            .collect();
        Self::checked(OP, c, Matrix::hcat(&[&self.g, &y.g]), r)
    }

    /// Encloses { x + t : x ∈ X }. Fails as [`Zonotope::minkowski_sum`].
    pub fn translate(&self, t: &[f64]) -> Result<Self, SetError> {
        same("translation of a zonotope", self.dim(), t.len())?;
        self.minkowski_sum(&Self::point(t)?)
    }

    /// X × Y = { (x, y) : x ∈ X, y ∈ Y }, exact.
    pub fn cartesian_product(&self, y: &Self) -> Self {
        let (n, p) = (self.dim(), self.generators());
        let g = Matrix::from_fn(n + y.dim(), p + y.generators(), |i, j| {
            match (i < n, j < p) {
                (true, true) => self.g[(i, j)],
                (false, false) => y.g[(i - n, j - p)],
                _ => 0.0,
            }
        });
        Self {
            c: List::concat(&[&self.c[..], &y.c]),
            g,
            r: List::concat(&[&self.r[..], &y.r]),
        }
    }

    /// Encloses { x + K (y − C x − v) : x ∈ X, v ∈ V }: the states of X corrected by a measurement.
    ///
    /// Every x that agrees with the measurement, y = C x + v for some v ∈ V, is in it, whatever the
    /// gain. K is n × q, C q × n, y in ℝ^q, V a zonotope in ℝ^q. With M = fl(I − K C),
    /// e = fl(y − C c − c_v):
    ///
    /// c' = fl(c + K e), G' = [fl(M G), −fl(K G_v)],
    /// r' = ⌈|M| r + γ_n |M| (|G| 1) + γ_{q+1} (I + |K| |C|)(|G| 1 + r) + |K| r_v + γ_q |K| (|G_v| 1)
    ///      + γ_{q+1} (|c| + |K| |e|) + |K| γ_{n+2} (|y| + |C| |c| + |c_v|)⌉.
    ///
    /// The third term is there because M is not I − K C; η 1ᵀ(|G| 1 + r) beside it where K C underflows. Fails with `Dimension` or `NotFinite`.
    pub fn update(&self, k: &Matrix, c: &Matrix, y: &[f64], v: &Self) -> Result<Self, SetError> {
        const OP: &str = "update of a zonotope by a gain";
        let (n, q) = (self.dim(), v.dim());
        for (expected, got) in [(n, k.rows()), (q, k.cols()), (q, c.rows()), (n, c.cols())] {
            same(OP, expected, got)?;
        }
        same(OP, q, y.len())?;
        let m = Matrix::identity(n).sub(&k.mul(c));
        let innovation: List<f64> = c
            .mul_vec(&self.c)
            .iter()
            .zip(y)
            .zip(&v.c)
            .map(|((predicted, y), c_v)| (y - predicted) - c_v)
            .collect();
        let correction = k.mul_vec(&innovation);
        let center: List<f64> = self.c.iter().zip(&correction).map(|(c, e)| c + e).collect();
        let g = Matrix::hcat(&[&m.mul(&self.g), &k.mul(&v.g).map(|x| -x)]);

        let sums = self.abs_row_sums();
        let sums_v = v.abs_row_sums();
        let abs_c: List<f64> = self.c.iter().map(|x| x.abs()).collect();
        let extent: List<f64> = (0..n).map(|i| sums[i] + self.r[i] + ETA).collect();
        // A product in K C that underflows is off by less than η/q, whatever K and C are, and x multiplies it.
        let underflow = ETA * extent.iter().sum::<f64>();
        let under_m: List<f64> = (0..n)
            .map(|i| self.r[i] + gamma(n) * sums[i] + ETA)
            .collect();
        let under_k: List<f64> = (0..q)
            .map(|i| {
                let row = c.row(i);
                gamma(q + 1) * (abs_dot(row, &extent) + innovation[i].abs())
                    + v.r[i]
                    + gamma(q) * sums_v[i]
                    + gamma(n + 2) * (y[i].abs() + abs_dot(row, &abs_c) + v.c[i].abs())
                    + ETA
            })
            .collect();
        let r: List<f64> = (0..n)
            .map(|i| {
                let own = gamma(q + 1) * (extent[i] + abs_c[i]);
                let bound = abs_dot(m.row(i), &under_m) + own + abs_dot(k.row(i), &under_k);
                up(bound + underflow, n + q + 12)
            })
            .collect();
        Self::checked(OP, center, g, r)
    }

    /// As `checked`, for operations whose result may have no dimension left.
    fn nonempty(op: &'static str, c: List<f64>, g: Matrix, r: List<f64>) -> Result<Self, SetError> {
        if c.is_empty() {
            return Err(SetError::Dimension {
                op,
                expected: 1,
                got: 0,
            });
        }
        Self::checked(op, c, g, r)
    }
}

/// Σ_k |a_k| b_k for b ≥ 0, in ascending k: at most n roundings in a row.
fn abs_dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.abs() * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zonotope(c: &[f64], rows: &[&[f64]]) -> Zonotope {
        Zonotope::new(c.to_vec(), Matrix::from_rows(rows).unwrap()).unwrap()
    }

    #[test]
    fn a_map_moves_center_and_generators() {
        let z = zonotope(&[1.0, 2.0], &[&[1.0, 0.0], &[1.0, 3.0]]);
        let m = Matrix::from_rows(&[[1.0, 1.0], [0.0, 2.0], [1.0, 0.0]]).unwrap();
        let image = z.affine_map(&m, &[10.0, 0.0, 0.0]).unwrap();
        assert_eq!(image.c(), [13.0, 4.0, 1.0]);
        let expected = Matrix::from_rows(&[[2.0, 3.0], [2.0, 6.0], [1.0, 0.0]]).unwrap();
        assert_eq!(image.g(), &expected);
        assert!(image.r().iter().all(|&r| r > 0.0 && r < 2e-14));
        assert!(z.linear_map(&Matrix::zeros(0, 2)).is_err());
        assert!(z.linear_map(&Matrix::zeros(2, 3)).is_err());
    }

    #[test]
    fn a_sum_with_given_data_at_the_origin_costs_nothing() {
        let x = zonotope(&[1.0, 2.0], &[&[1.0], &[1.0]]);
        let w = zonotope(&[0.0, 0.0], &[&[0.5, 0.0], &[0.0, 0.5]]);
        let sum = x.minkowski_sum(&w).unwrap();
        assert_eq!(sum.c(), [1.0, 2.0]);
        assert_eq!(sum.r(), [0.0, 0.0]);
        assert_eq!(sum.generators(), 3);
    }

    #[test]
    fn a_product_stacks() {
        let z = zonotope(&[1.0], &[&[2.0]]).cartesian_product(&zonotope(&[3.0], &[&[4.0, 5.0]]));
        assert_eq!(z.c(), [1.0, 3.0]);
        let expected = Matrix::from_rows(&[[2.0, 0.0, 0.0], [0.0, 4.0, 5.0]]).unwrap();
        assert_eq!(z.g(), &expected);
    }

    #[test]
    fn an_interval_matrix_adds_its_radius_times_the_extent() {
        let z = zonotope(&[1.0, -2.0], &[&[1.0], &[0.5]]);
        let lower = Matrix::from_rows(&[[1.0, 0.0], [0.5, -1.0]]).unwrap();
        let upper = Matrix::from_rows(&[[1.0, 0.0], [1.5, 1.0]]).unwrap();
        let m = IntervalMatrix::from_bounds(&lower, &upper).unwrap();
        let image = z.interval_map(&m).unwrap();
        // mid = [1 0; 1 0], rad = [0 0; 0.5 1]: 0.5·(1 + 1) + 1·(2 + 0.5) = 3.5 in the second row only.
        assert_eq!(image.c(), [1.0, 1.0]);
        assert_eq!(image.g().row(0), [1.0, 0.0]);
        assert_eq!(image.g()[(1, 0)], 1.0);
        assert!((image.g()[(1, 1)] - 3.5).abs() < 1e-13 && image.g()[(1, 1)] >= 3.5);
    }

    #[test]
    fn an_update_by_half_of_the_innovation_meets_halfway() {
        let x = zonotope(&[0.0, 1.0], &[&[2.0, 0.0], &[0.0, 1.0]]);
        let v = zonotope(&[1.0], &[&[1.0]]);
        let k = Matrix::column(&[0.5, 0.0]);
        let c = Matrix::from_rows(&[[1.0, 0.0]]).unwrap();
        let updated = x.update(&k, &c, &[5.0], &v).unwrap();
        // e = 5 − 0 − 1 = 4; c' = (2, 1); M = diag(½, 1).
        assert_eq!(updated.c(), [2.0, 1.0]);
        let expected = Matrix::from_rows(&[[1.0, 0.0, -0.5], [0.0, 1.0, 0.0]]).unwrap();
        assert_eq!(updated.g(), &expected);
        assert!(x.update(&k, &c, &[], &v).is_err());
    }

    #[test]
    fn an_overflow_is_an_error() {
        let z = zonotope(&[1e300], &[&[1.0]]);
        let m = Matrix::column(&[1e300]);
        assert!(matches!(z.linear_map(&m), Err(SetError::NotFinite { .. })));
    }
}
