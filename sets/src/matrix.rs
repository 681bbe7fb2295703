//! Dense real matrices with products in a fixed order.
//!
//! Stored by rows, because generators are many and states few: a row of G is long, and every kernel
//! here runs along it. Entry (i, j) of a product is Σ_k a_ik·b_kj summed in ascending k, one rounding
//! a product and one a sum, never fused, so the bits do not depend on the processor. This is the only
//! file that names nalgebra, which provides the factorizations. The loops stand in `kernels`.

mod kernels;

use crate::{List, SetError, ops};
use nalgebra::linalg::{SVD, SymmetricEigen};
use nalgebra::{DMatrix, Dyn};
use std::borrow::Borrow;
use std::fmt;
use std::ops::{Index, IndexMut};

/// A dense real matrix, stored by rows. Serialized as the list of its rows.
#[derive(Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "Vec<Vec<f64>>", into = "Vec<Vec<f64>>")]
pub struct Matrix {
    rows: usize,
    cols: usize,
    data: List<f64>,
}

impl Matrix {
    /// The `rows` × `cols` matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self {
            rows,
            cols,
            data: List::filled(0.0, rows * cols),
        }
    }

    /// The identity of size `n`.
    pub fn identity(n: usize) -> Self {
        Self::diagonal(&List::filled(1.0, n))
    }

    /// diag(d).
    pub fn diagonal(d: &[f64]) -> Self {
        let mut m = Self::zeros(d.len(), d.len());
        for (i, &x) in d.iter().enumerate() {
            m[(i, i)] = x;
        }
        m
    }

    /// The matrix with these rows; all must have the same length.
    pub fn from_rows<R: AsRef<[f64]>>(rows: &[R]) -> Result<Self, SetError> {
        let cols = rows.first().map_or(0, |r| r.as_ref().len());
        let mut data = List::with_capacity(rows.len() * cols);
        for row in rows {
            let row = row.as_ref();
            if row.len() != cols {
                return Err(SetError::Dimension {
                    op: "matrix rows",
                    expected: cols,
                    got: row.len(),
                });
            }
            data.extend_from_slice(row);
        }
        Ok(Self {
            rows: rows.len(),
            cols,
            data,
        })
    }

    /// The `rows` × `cols` matrix whose entry (i, j) is `f(i, j)`.
    pub fn from_fn(rows: usize, cols: usize, mut f: impl FnMut(usize, usize) -> f64) -> Self {
        let mut data = List::with_capacity(rows * cols);
        for i in 0..rows {
            for j in 0..cols {
                data.push(f(i, j));
            }
        }
        Self { rows, cols, data }
    }

    /// A column vector.
    pub fn column(v: &[f64]) -> Self {
        Self {
            rows: v.len(),
            cols: 1,
            data: List::from(v),
        }
    }

    /// Number of rows.
    #[inline]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[inline]
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Row `i`.
    #[inline]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// Row `i`, mutable.
    #[inline]
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// All entries, row after row.
    #[inline]
    pub fn as_slice(&self) -> &[f64] {
        &self.data
    }

    /// All entries, row after row, mutable.
    #[inline]
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Column `j`, copied.
    pub fn col(&self, j: usize) -> List<f64> {
        (0..self.rows).map(|i| self[(i, j)]).collect()
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self[(j, i)])
    }

    /// The columns with these indices, in this order.
    pub fn select_columns(&self, indices: &[usize]) -> Self {
        let mut data = List::with_capacity(self.rows * indices.len());
        for i in 0..self.rows {
            let row = self.row(i);
            data.extend(indices.iter().map(|&j| row[j]));
        }
        Self {
            rows: self.rows,
            cols: indices.len(),
            data,
        }
    }

    /// [M₁, M₂, …]: the blocks side by side; all must have the same number of rows.
    pub fn hcat<M: Borrow<Matrix>>(blocks: &[M]) -> Self {
        let blocks = || blocks.iter().map(Borrow::borrow);
        let rows = blocks().next().map_or(0, |b| b.rows);
        let cols = blocks().map(|b| b.cols).sum();
        let mut data = List::with_capacity(rows * cols);
        for i in 0..rows {
            for b in blocks() {
                assert_eq!(b.rows, rows, "hcat: blocks have as many rows as the first");
                data.extend_from_slice(b.row(i));
            }
        }
        Self { rows, cols, data }
    }

    /// [M₁; M₂; …]: the blocks below each other; all must have the same number of columns.
    pub fn vcat(blocks: &[&Matrix]) -> Self {
        let cols = blocks.first().map_or(0, |b| b.cols);
        let mut data = List::new();
        for b in blocks {
            assert_eq!(
                b.cols, cols,
                "vcat: blocks have as many columns as the first"
            );
            data.extend_from_slice(&b.data);
        }
        Self {
            rows: data
                .len()
                .checked_div(cols)
                .unwrap_or(blocks.iter().map(|b| b.rows).sum()),
            cols,
            data,
        }
    }

    /// The product M B, entry (i, j) = Σ_k m_ik b_kj in ascending k.
    pub fn mul(&self, b: &Matrix) -> Self {
        let mut out = Self::zeros(self.rows, b.cols);
        self.mul_into(b, &mut out);
        out
    }

    /// The product M B into `out`, which is resized.
    pub fn mul_into(&self, b: &Matrix, out: &mut Matrix) {
        assert_eq!(self.cols, b.rows, "product: inner dimensions agree");
        out.reset(self.rows, b.cols);
        ops::count(
            self.rows * b.cols * self.cols,
            self.rows * b.cols * self.cols.saturating_sub(1),
        );
        kernels::product(self.cols, &self.data, b.cols, &b.data, &mut out.data);
    }

    /// M Bᵀ, entry (i, j) = `dot`(row i of M, row j of B).
    pub fn mul_transpose(&self, b: &Matrix) -> Self {
        assert_eq!(
            self.cols, b.cols,
            "product with a transpose: inner dimensions agree"
        );
        ops::count(
            self.rows * b.rows * self.cols,
            self.rows * b.rows * self.cols.saturating_sub(1),
        );
        Self::from_fn(self.rows, b.rows, |i, j| dot(self.row(i), b.row(j)))
    }

    /// M += B.
    pub fn add_assign(&mut self, b: &Matrix) {
        ops::count(0, self.data.len());
        for (m, b) in self.data.iter_mut().zip(&b.data) {
            *m += b;
        }
    }

    /// (M + Mᵀ)/2 in place, for a square M.
    pub fn symmetrize(&mut self) {
        let n = self.rows;
        ops::count(n * n.saturating_sub(1) / 2, n * n.saturating_sub(1) / 2);
        for i in 0..n {
            for j in 0..i {
                let mean = mean(self[(i, j)], self[(j, i)]);
                self[(i, j)] = mean;
                self[(j, i)] = mean;
            }
        }
    }

    /// M Mᵀ, exactly symmetric.
    pub fn gram(&self) -> Self {
        let n = self.rows;
        ops::count(
            n * (n + 1) / 2 * self.cols,
            n * (n + 1) / 2 * self.cols.saturating_sub(1),
        );
        let mut out = Self::zeros(n, n);
        kernels::gram(self.cols, &self.data, n, &mut out.data);
        out
    }

    /// M v, entry i = Σ_k m_ik v_k in ascending k.
    pub fn mul_vec(&self, v: &[f64]) -> List<f64> {
        assert_eq!(self.cols, v.len(), "matrix times vector: dimensions agree");
        ops::count(
            self.rows * self.cols,
            self.rows * self.cols.saturating_sub(1),
        );
        (0..self.rows)
            .map(|i| kernels::chain(self.row(i), v))
            .collect()
    }

    /// t += M v, entry by entry in ascending k.
    pub fn add_mul_vec(&self, v: &[f64], t: &mut [f64]) {
        assert_eq!(self.cols, v.len(), "matrix times vector: dimensions agree");
        assert_eq!(self.rows, t.len(), "sum with a product: dimensions agree");
        ops::count(self.data.len(), self.data.len());
        for (i, t) in t.iter_mut().enumerate() {
            for (m, x) in self.row(i).iter().zip(v) {
                *t += m * x;
            }
        }
    }

    /// t −= M v, entry by entry in ascending k.
    pub fn sub_mul_vec(&self, v: &[f64], t: &mut [f64]) {
        assert_eq!(self.cols, v.len(), "matrix times vector: dimensions agree");
        assert_eq!(
            self.rows,
            t.len(),
            "difference with a product: dimensions agree"
        );
        ops::count(self.data.len(), self.data.len());
        for (i, t) in t.iter_mut().enumerate() {
            for (m, x) in self.row(i).iter().zip(v) {
                *t -= m * x;
            }
        }
    }

    /// M + B.
    pub fn add(&self, b: &Matrix) -> Self {
        self.zip(b, |x, y| x + y)
    }

    /// M − B.
    pub fn sub(&self, b: &Matrix) -> Self {
        self.zip(b, |x, y| x - y)
    }

    /// s M.
    pub fn scale(&self, s: f64) -> Self {
        ops::count(self.data.len(), 0);
        self.map(|x| s * x)
    }

    /// M / s.
    pub fn divide(&self, s: f64) -> Self {
        ops::count(self.data.len(), 0);
        self.map(|x| x / s)
    }

    /// |M|, entrywise.
    pub fn abs(&self) -> Self {
        self.map(f64::abs)
    }

    /// (M + Mᵀ)/2.
    pub fn symmetrized(&self) -> Self {
        ops::count(self.data.len(), self.data.len());
        Self::from_fn(self.rows, self.cols, |i, j| {
            mean(self[(i, j)], self[(j, i)])
        })
    }

    /// `f` of every entry.
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            rows: self.rows,
            cols: self.cols,
            data: self.data.iter().map(|&x| f(x)).collect(),
        }
    }

    fn zip(&self, b: &Matrix, f: impl Fn(f64, f64) -> f64) -> Self {
        assert_eq!(
            (self.rows, self.cols),
            (b.rows, b.cols),
            "entrywise: shapes agree"
        );
        ops::count(0, self.data.len());
        let data = self
            .data
            .iter()
            .zip(&b.data)
            .map(|(&x, &y)| f(x, y))
            .collect();
        Self {
            rows: self.rows,
            cols: self.cols,
            data,
        }
    }

    /// |M| 1: the row sums of absolute values, rounded to nearest.
    pub fn abs_row_sums(&self) -> List<f64> {
        ops::count(0, self.rows * self.cols.saturating_sub(1));
        (0..self.rows).map(|i| abs_sum(self.row(i))).collect()
    }

    /// True if every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|x| x.is_finite())
    }

    /// Makes this a `rows` × `cols` matrix of zeros without giving up its memory.
    pub fn reset(&mut self, rows: usize, cols: usize) {
        self.rows = rows;
        self.cols = cols;
        self.data.clear();
        self.data.resize(rows * cols, 0.0);
    }

    fn to_nalgebra(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.rows, self.cols, &self.data)
    }

    fn from_nalgebra(m: &DMatrix<f64>) -> Self {
        Self::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)])
    }

    /// M times 2^r_i by rows and 2^c_j by columns, without rounding but where an entry underflows to what is nothing beside
    /// the others, and the powers r and c.
    ///
    /// The powers minimise Σ (e_ij + r_i + c_j)² over the exponents e_ij of the entries that are not zero, up to
    /// their own rounding: another unit of a row or column is taken back, whatever the others are. Then the largest entry
    /// of each row is brought near 1, and that of each column.
    fn equilibrated(&self) -> (Self, Vec<i32>, Vec<i32>) {
        // Rows and columns in turns; with every entry not zero the first round ends it.
        const ROUNDS: usize = 30;
        let exponents: Vec<(usize, usize, f64)> = (0..self.rows)
            .flat_map(|i| (0..self.cols).map(move |j| (i, j)))
            .filter(|&at| self[at] != 0.0)
            .map(|(i, j)| (i, j, f64::from(exponent([self[(i, j)]].into_iter()))))
            .collect();
        let (mut r, mut c) = (vec![0.0; self.rows], vec![0.0; self.cols]);
        for _ in 0..ROUNDS {
            let mut sums = vec![(0.0, 0.0); self.rows];
            for &(i, j, e) in &exponents {
                sums[i] = (sums[i].0 + e + c[j], sums[i].1 + 1.0);
            }
            for (r, (sum, count)) in r.iter_mut().zip(sums) {
                *r = if count > 0.0 { -sum / count } else { 0.0 };
            }
            let mut sums = vec![(0.0, 0.0); self.cols];
            for &(i, j, e) in &exponents {
                sums[j] = (sums[j].0 + e + r[i], sums[j].1 + 1.0);
            }
            for (c, (sum, count)) in c.iter_mut().zip(sums) {
                *c = if count > 0.0 { -sum / count } else { 0.0 };
            }
        }
        let whole =
            |x: Vec<f64>| -> Vec<i32> { x.iter().map(|x| libm::round(*x) as i32).collect() };
        let (mut r, mut c) = (whole(r), whole(c));
        let moved = |i: usize, j: usize, r: i32, c: i32| {
            let e = exponent([self[(i, j)]].into_iter());
            (self[(i, j)] != 0.0).then_some(e + r + c)
        };
        for (i, r) in r.iter_mut().enumerate() {
            let largest = (0..self.cols).filter_map(|j| moved(i, j, *r, c[j])).max();
            *r -= largest.unwrap_or(0);
        }
        for (j, c) in c.iter_mut().enumerate() {
            let largest = (0..self.rows).filter_map(|i| moved(i, j, r[i], *c)).max();
            *c -= largest.unwrap_or(0);
        }
        let scaled = Self::from_fn(self.rows, self.cols, |i, j| {
            shifted(self[(i, j)], r[i] + c[j])
        });
        (scaled, r, c)
    }

    /// Whether every entry is 0 or between 2⁻²⁰⁰ and 2²⁰⁰: products of a few of them stay normal.
    fn is_moderate(&self) -> bool {
        const MOST: f64 = (1u128 << 100) as f64 * (1u128 << 100) as f64;
        let moderate = |x: &f64| *x == 0.0 || (1.0 / MOST..=MOST).contains(&x.abs());
        self.data.iter().all(moderate)
    }

    /// Eigenvalues λ and orthonormal eigenvectors V (columns) of the symmetric part, M = V diag(λ) Vᵀ.
    ///
    /// All are NaN where M is not finite: no comparison with them holds.
    pub fn symmetric_eigen(&self) -> (Vec<f64>, Matrix) {
        ops::decomposition(self.rows, self.cols);
        let n = self.rows;
        let failed = || (vec![f64::NAN; n], Self::from_fn(n, n, |_, _| f64::NAN));
        if n == 0 {
            return (Vec::new(), self.clone());
        }
        if !self.is_finite() {
            return failed();
        }
        let attempt = |m: &Self| {
            SymmetricEigen::try_new(m.to_nalgebra(), f64::EPSILON, MOST_ITERATIONS).filter(
                |eigen| {
                    let mut all = eigen.eigenvectors.iter().chain(eigen.eigenvalues.iter());
                    all.all(|x| x.is_finite())
                },
            )
        };
        let symmetric = self.symmetrized();
        let (found, e) = match symmetric.is_finite() && symmetric.largest_is_moderate() {
            true => (attempt(&symmetric), 0),
            false => (None, 0),
        };
        let (found, e) = match found {
            Some(found) => (Some(found), e),
            None => {
                let (scaled, e) = self.near_one();
                (attempt(&scaled.symmetrized()), e)
            }
        };
        let Some(eigen) = found else {
            return failed();
        };
        // An eigenvalue may overflow to an infinite one.
        let values = eigen.eigenvalues.iter().map(|&x| shifted(x, -e)).collect();
        (values, Self::from_nalgebra(&eigen.eigenvectors))
    }

    /// M times 2^e with its largest entry in [1, 2), and e. What is below 2⁻²⁰⁰ is 0: it moves no eigenvalue or singular value
    /// by a rounding of the largest one, and the iterations divide by its square.
    fn near_one(&self) -> (Self, i32) {
        let e = -exponent(self.data.iter().copied());
        let least = shifted(1.0, -200);
        let scaled = self.map(|x| {
            let x = shifted(x, e);
            if x.abs() < least { 0.0 } else { x }
        });
        (scaled, e)
    }

    /// Whether the largest entry is 0 or between 2⁻⁴⁰⁰ and 2⁴⁰⁰, so that squares stay normal.
    fn largest_is_moderate(&self) -> bool {
        let e = exponent(self.data.iter().copied());
        e.abs() <= 400
    }

    /// The singular value decomposition, of M times 2^e with the e returned. Fails with `NotFinite` or `Singular` where
    /// there is none.
    fn svd(&self, vectors: bool) -> Result<(Svd, i32), SetError> {
        const OP: &str = "singular value decomposition";
        ops::decomposition(self.rows, self.cols);
        if let Some(&value) = self.data.iter().find(|x| !x.is_finite()) {
            return Err(SetError::NotFinite { op: OP, value });
        }
        let attempt = |m: &Self| {
            let tolerance = f64::EPSILON * 5.0;
            SVD::try_new_unordered(
                m.to_nalgebra(),
                vectors,
                vectors,
                tolerance,
                MOST_ITERATIONS,
            )
            .filter(|svd| {
                let finite = |m: &Option<DMatrix<f64>>| {
                    m.as_ref().is_none_or(|m| m.iter().all(|x| x.is_finite()))
                };
                svd.singular_values.iter().all(|x| x.is_finite())
                    && finite(&svd.u)
                    && finite(&svd.v_t)
            })
        };
        if self.largest_is_moderate()
            && let Some(svd) = attempt(self)
        {
            return Ok((svd, 0));
        }
        let (scaled, e) = self.near_one();
        attempt(&scaled)
            .map(|svd| (svd, e))
            .ok_or(SetError::Singular { op: OP })
    }

    /// The singular values, largest first. Fails with `NotFinite`, or `Singular` where the iteration ends without them.
    pub fn singular_values(&self) -> Result<Vec<f64>, SetError> {
        if self.data.is_empty() {
            return Ok(Vec::new());
        }
        let (svd, e) = self.svd(false)?;
        let mut s: Vec<f64> = svd
            .singular_values
            .iter()
            .map(|&x| shifted(x, -e))
            .collect();
        s.sort_by(|a, b| b.total_cmp(a));
        Ok(s)
    }

    /// The rank: the number of singular values above `max(rows, cols) · ε · σ_max` of the matrix with rows and columns
    /// scaled by powers of two, which changes no rank, so that it does not depend on their units.
    ///
    /// Fails as [`Matrix::singular_values`].
    pub fn rank(&self) -> Result<usize, SetError> {
        // What is far below every rounding only leads the iteration astray.
        let least = shifted(1.0, -100);
        let (scaled, ..) = self.equilibrated();
        let scaled = scaled.map(|x| if x.abs() < least { 0.0 } else { x });
        let s = scaled.singular_values()?;
        let cut =
            s.first().copied().unwrap_or(0.0) * f64::EPSILON * self.rows.max(self.cols) as f64;
        Ok(s.iter().filter(|&&x| x > cut).count())
    }

    /// M⁻¹ by LU with partial pivoting, rounded to nearest (a heuristic where a guarantee is at stake).
    ///
    /// Fails with `Singular` also where M or M⁻¹ is not finite.
    pub fn inverse(&self) -> Result<Matrix, SetError> {
        const SINGULAR: SetError = SetError::Singular { op: "inverse" };
        assert_eq!(self.rows, self.cols, "inverse: the matrix is square");
        ops::decomposition(self.rows, self.cols);
        if !self.is_finite() {
            return Err(SINGULAR);
        }
        let inverse = match self.is_moderate() {
            true => Self::from_nalgebra(&self.to_nalgebra().try_inverse().ok_or(SINGULAR)?),
            false => {
                // (D_r M D_c)⁻¹ = D_c⁻¹ M⁻¹ D_r⁻¹
                let (scaled, rows, cols) = self.equilibrated();
                let inverse = scaled.to_nalgebra().try_inverse().ok_or(SINGULAR)?;
                Self::from_fn(self.rows, self.rows, |i, j| {
                    shifted(inverse[(i, j)], cols[i] + rows[j])
                })
            }
        };
        if inverse.is_finite() {
            Ok(inverse)
        } else {
            Err(SINGULAR)
        }
    }

    /// The lower triangular L with M = L Lᵀ, for a symmetric positive definite M (its lower triangle is read).
    ///
    /// Fails with `Singular` where a pivot is not above ε times its diagonal entry.
    pub fn cholesky(&self) -> Result<Matrix, SetError> {
        let n = self.rows;
        assert_eq!(n, self.cols, "Cholesky factor: the matrix is square");
        ops::count(n * (n + 1) * (n + 2) / 6, n * (n * n).saturating_sub(1) / 6);
        let mut l = Self::zeros(n, n);
        match kernels::cholesky(n, &self.data, &mut l.data) {
            true => Ok(l),
            false => Err(SetError::Singular {
                op: "Cholesky factor",
            }),
        }
    }

    /// X with M X = B, for a symmetric positive definite M, by its Cholesky factor.
    pub fn solve_positive_definite(&self, b: &Matrix) -> Result<Matrix, SetError> {
        Ok(self.cholesky()?.solve_by_factor(b))
    }

    /// X with L Lᵀ X = B, where this is the lower triangular L of [`Matrix::cholesky`].
    pub fn solve_by_factor(&self, b: &Matrix) -> Matrix {
        assert_eq!(self.rows, b.rows, "solve: as many equations as rows");
        let n = self.rows;
        ops::count(n * (n + 1) * b.cols, n * n.saturating_sub(1) * b.cols);
        let mut x = b.clone();
        kernels::solve(n, &self.data, b.cols, &mut x.data);
        x
    }

    /// M⁺, the Moore–Penrose inverse (Mᵀ M)⁻¹ Mᵀ of a matrix of full column rank, by SVD. Singular values below
    /// `max(rows, cols) · ε · σ_max` are taken for 0.
    ///
    /// Where that takes rank away, or the entries are far from 1, the columns are scaled by powers of two first, which
    /// M⁺ = D (M D)⁺ allows where the column rank is full. Fails with `NotFinite`, or `Singular` where the iteration ends
    /// without a result or M⁺ is not finite.
    pub fn pseudo_inverse(&self) -> Result<Matrix, SetError> {
        if self.data.is_empty() {
            return Ok(Self::zeros(self.cols, self.rows));
        }
        let scalable = self.cols <= self.rows;
        if self.is_moderate() || !scalable {
            let (inverse, full) = self.unscaled_pseudo_inverse()?;
            if full || !scalable {
                return Ok(inverse);
            }
        }
        let powers: Vec<i32> = (0..self.cols)
            .map(|j| -exponent((0..self.rows).map(|i| self[(i, j)])))
            .collect();
        let scaled = Self::from_fn(self.rows, self.cols, |i, j| {
            shifted(self[(i, j)], powers[j])
        });
        let (inverse, _) = scaled.unscaled_pseudo_inverse()?;
        let inverse = Self::from_fn(self.cols, self.rows, |i, j| {
            shifted(inverse[(i, j)], powers[i])
        });
        match inverse.is_finite() {
            true => Ok(inverse),
            false => Err(SetError::Singular {
                op: "pseudo-inverse",
            }),
        }
    }

    /// M⁺ without a scaling of columns, and whether all singular values counted.
    fn unscaled_pseudo_inverse(&self) -> Result<(Matrix, bool), SetError> {
        const SINGULAR: SetError = SetError::Singular {
            op: "pseudo-inverse",
        };
        let largest = self.singular_values()?.first().copied().unwrap_or(0.0);
        let (svd, e) = self.svd(true)?;
        let cut = shifted(largest, e) * f64::EPSILON * self.rows.max(self.cols) as f64;
        let full = svd.singular_values.iter().all(|&x| x > cut);
        let inverse = svd.pseudo_inverse(cut).map_err(|_| SINGULAR)?;
        // (2^e M)⁺ = 2⁻ᵉ M⁺
        let inverse = Self::from_nalgebra(&inverse).map(|x| shifted(x, e));
        match inverse.is_finite() {
            true => Ok((inverse, full)),
            false => Err(SINGULAR),
        }
    }
}

/// Iterations after which a decomposition is given up: beyond all that finite numbers of moderate size need.
const MOST_ITERATIONS: usize = 100_000;

type Svd = SVD<f64, Dyn, Dyn>;

/// The exponent e of the largest |x|, 2^e ≤ |x| < 2^(e+1), of finite numbers; 0 if all are zero.
fn exponent(entries: impl Iterator<Item = f64>) -> i32 {
    let of = |x: f64| {
        let bits = x.to_bits() & !(1 << 63);
        match bits >> 52 {
            // 2⁻¹⁰⁷⁴ times an integer.
            0 => -1011 - bits.leading_zeros() as i32,
            e => e as i32 - 1023,
        }
    };
    entries.filter(|x| *x != 0.0).map(of).max().unwrap_or(0)
}

/// (a + b)/2, finite where both are.
fn mean(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if sum.is_finite() {
        0.5 * sum
    } else {
        0.5 * a + 0.5 * b
    }
}

/// x 2^e, rounded once at most.
fn shifted(x: f64, e: i32) -> f64 {
    libm::ldexp(x, e)
}

impl TryFrom<Vec<Vec<f64>>> for Matrix {
    type Error = SetError;
    fn try_from(rows: Vec<Vec<f64>>) -> Result<Self, SetError> {
        Self::from_rows(&rows)
    }
}

impl From<Matrix> for Vec<Vec<f64>> {
    fn from(m: Matrix) -> Self {
        (0..m.rows).map(|i| m.row(i).to_vec()).collect()
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;
    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.data[i * self.cols + j]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.data[i * self.cols + j]
    }
}

impl fmt::Debug for Matrix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list()
            .entries((0..self.rows).map(|i| self.row(i)))
            .finish()
    }
}

/// Σ a_i b_i in eight interleaved lanes, added up as a fixed tree.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    kernels::dot(a, b)
}

/// Σ |a_i| in eight interleaved lanes, added up as a fixed tree. At most len/8 + 4 additions in a row.
#[inline]
pub fn abs_sum(a: &[f64]) -> f64 {
    kernels::abs_sum(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_is_the_sum_over_the_inner_index() {
        let a = Matrix::from_rows(&[[1.0, 2.0], [3.0, 4.0]]).unwrap();
        let b = Matrix::from_rows(&[[5.0], [6.0]]).unwrap();
        assert_eq!(a.mul(&b), Matrix::from_rows(&[[17.0], [39.0]]).unwrap());
        assert_eq!(a.mul_vec(&[5.0, 6.0]), [17.0, 39.0]);
        assert_eq!(a.mul_transpose(&b.transpose()), a.mul(&b));
        assert_eq!(a.gram(), a.mul(&a.transpose()));
    }

    #[test]
    fn a_positive_definite_system_is_solved_and_a_singular_one_refused() {
        let m = Matrix::from_rows(&[[4.0, 2.0], [2.0, 5.0]]).unwrap();
        let l = Matrix::from_rows(&[[2.0, 0.0], [1.0, 2.0]]).unwrap();
        assert_eq!(m.cholesky().unwrap(), l);
        let x = m
            .solve_positive_definite(&Matrix::column(&[8.0, 12.0]))
            .unwrap();
        assert_eq!(x, Matrix::column(&[1.0, 2.0]));
        let singular = Matrix::from_rows(&[[1.0, 1.0], [1.0, 1.0]]).unwrap();
        assert!(singular.cholesky().is_err());
        let empty = Matrix::zeros(0, 0);
        assert_eq!(empty.solve_positive_definite(&empty).unwrap(), empty);
    }

    #[test]
    fn a_matrix_is_written_as_its_rows() {
        let m = Matrix::from_rows(&[[1.0, 2.0], [3.0, 4.5]]).unwrap();
        assert_eq!(serde_json::to_string(&m).unwrap(), "[[1.0,2.0],[3.0,4.5]]");
        assert_eq!(
            serde_json::from_str::<Matrix>("[[1, 2], [3, 4.5]]").unwrap(),
            m
        );
        assert!(serde_json::from_str::<Matrix>("[[1], [3, 4]]").is_err());
        let empty = Matrix::zeros(2, 0);
        let text = serde_json::to_string(&empty).unwrap();
        assert_eq!(serde_json::from_str::<Matrix>(&text).unwrap(), empty);
    }

    #[test]
    fn lanes_give_the_same_sum_for_every_length() {
        for n in 0..40 {
            let v: Vec<f64> = (0..n).map(|i| i as f64 - 3.0).collect();
            assert_eq!(dot(&v, &v), v.iter().map(|x| x * x).sum::<f64>());
            assert_eq!(abs_sum(&v), v.iter().map(|x| x.abs()).sum::<f64>());
        }
    }

    #[test]
    fn decompositions_of_any_finite_matrix_end_in_finite_numbers_or_an_error() {
        let mut state = 0x5eed_u64;
        let mut bits = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            state ^ (state >> 29)
        };
        let ends = [
            f64::MAX,
            f64::MIN_POSITIVE,
            f64::from_bits(1),
            1.0,
            -1.0,
            0.0,
        ];
        for trial in 0..4000 {
            let (rows, cols) = (1 + (bits() % 9) as usize, 1 + (bits() % 5) as usize);
            let m = Matrix::from_fn(rows, cols, |_, _| match bits() % 4 {
                0 => ends[(bits() % 6) as usize],
                1 | 2 if trial % 2 == 0 => 0.0,
                _ => {
                    let x = f64::from_bits(bits());
                    if x.is_finite() { x } else { 1.0 }
                }
            });
            if let Ok(s) = m.singular_values() {
                assert!(s.iter().all(|x| !x.is_nan()), "{m:?}");
            }
            let _ = m.rank();
            if let Ok(i) = m.pseudo_inverse() {
                assert!(i.is_finite(), "{m:?}");
            }
            let square = Matrix::from_fn(cols, cols, |i, j| m[(i.min(j) % rows, i.max(j))]);
            let (values, vectors) = square.symmetric_eigen();
            assert_eq!((values.len(), vectors.rows()), (cols, cols));
            assert!(
                vectors.is_finite() && values.iter().all(|x| !x.is_nan()),
                "{square:?}"
            );
            if let Ok(i) = square.inverse() {
                assert!(i.is_finite(), "{square:?}");
            }
            if let Ok(x) = square.solve_positive_definite(&Matrix::identity(cols)) {
                assert_eq!(x.rows(), cols);
            }
        }
    }

    #[test]
    fn an_inverse_and_a_rank_do_not_depend_on_units() {
        let m = Matrix::from_rows(&[[2.0, 1.0, 0.0], [0.5, 1.0, 0.25], [0.0, 1.0, 3.0]]).unwrap();
        let inverse = m.inverse().unwrap();
        let (r, c) = ([-300, 500, 0], [400, -700, 10]);
        let scaled = Matrix::from_fn(3, 3, |i, j| shifted(m[(i, j)], r[i] + c[j]));
        assert_eq!(scaled.rank().unwrap(), 3);
        let back = scaled.inverse().unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let x = shifted(back[(i, j)], c[i] + r[j]);
                assert!((x - inverse[(i, j)]).abs() < 1e-14, "{x}");
            }
        }
        // Two columns of its own each, and what couples them is 2^-180 of them.
        let coupled =
            Matrix::from_rows(&[[1e28, 0.0], [1e-25, 1e103], [1e24, 0.0], [1e-29, 1e209]]);
        assert_eq!(coupled.unwrap().rank().unwrap(), 2);
        let twice = Matrix::from_rows(&[[1e-200, 1e200], [2e-200, 2e200]]).unwrap();
        assert_eq!(twice.rank().unwrap(), 1);
        assert!(Matrix::zeros(2, 0).pseudo_inverse().unwrap().cols() == 2);
        assert_eq!(Matrix::zeros(0, 3).rank().unwrap(), 0);
    }

    #[test]
    fn the_pseudo_inverse_is_a_left_inverse() {
        let a = Matrix::from_rows(&[[1.0, 2.0], [3.0, 4.0], [5.0, 7.0]]).unwrap();
        let i = a.pseudo_inverse().unwrap().mul(&a);
        assert!(
            i.sub(&Matrix::identity(2))
                .as_slice()
                .iter()
                .all(|x| x.abs() < 1e-13)
        );
    }
}
