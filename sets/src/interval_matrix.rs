//! Matrices of intervals, and the derivatives of a function over a box.
//!
//! A product contains the exact products of all matrices taken from its factors. Where an exact
//! matrix is meant but only its computation is known (a power, the product of a gain and an
//! observation matrix), it is carried as a matrix of intervals.

use crate::interval_vector::same_dimension;
use crate::number::{self, Function};
use crate::{Interval, IntervalVector, List, Matrix, SetError, ops};
use std::fmt;
use std::ops::{Index, IndexMut, Range};

/// A matrix of intervals, stored by rows. Entries may be unbounded where a bound overflowed.
#[derive(Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct IntervalMatrix {
    rows: usize,
    cols: usize,
    data: List<Interval>,
}

impl IntervalMatrix {
    /// The `rows` × `cols` matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self {
            rows,
            cols,
            data: List::filled(Interval::ZERO, rows * cols),
        }
    }

    /// The identity of size `n`.
    pub fn identity(n: usize) -> Self {
        Self::from_fn(n, n, |i, j| {
            if i == j {
                Interval::ONE
            } else {
                Interval::ZERO
            }
        })
    }

    /// The `rows` × `cols` matrix whose entry (i, j) is `f(i, j)`.
    pub fn from_fn(rows: usize, cols: usize, mut f: impl FnMut(usize, usize) -> Interval) -> Self {
        let mut data = List::with_capacity(rows * cols);
        for i in 0..rows {
            for j in 0..cols {
                data.push(f(i, j));
            }
        }
        Self { rows, cols, data }
    }

    /// { M : lower ≤ M ≤ upper }, entrywise.
    ///
    /// Fails with `Dimension` if the shapes differ, `NotFinite` at a NaN or infinite bound, `Reversed`
    /// where lower > upper (the component counts row after row).
    pub fn from_bounds(lower: &Matrix, upper: &Matrix) -> Result<Self, SetError> {
        same_dimension("interval matrix rows", lower.rows(), upper.rows())?;
        same_dimension("interval matrix columns", lower.cols(), upper.cols())?;
        let sides = IntervalVector::from_bounds(lower.as_slice(), upper.as_slice())?;
        Ok(Self {
            rows: lower.rows(),
            cols: lower.cols(),
            data: sides.into_sides().into(),
        })
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
    pub fn row(&self, i: usize) -> &[Interval] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// All entries, row after row.
    #[inline]
    pub fn as_slice(&self) -> &[Interval] {
        &self.data
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self[(j, i)])
    }

    /// [A₁, A₂, …]: the blocks side by side; all must have the same number of rows.
    pub fn hcat(blocks: &[&Self]) -> Self {
        let rows = blocks.first().map_or(0, |b| b.rows);
        let cols = blocks.iter().map(|b| b.cols).sum();
        let mut data = List::with_capacity(rows * cols);
        for i in 0..rows {
            for b in blocks {
                assert_eq!(b.rows, rows, "hcat: blocks have as many rows as the first");
                data.extend_from_slice(b.row(i));
            }
        }
        Self { rows, cols, data }
    }

    /// [A₁; A₂; …]: the blocks below each other; all must have the same number of columns.
    pub fn vcat(blocks: &[&Self]) -> Self {
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
            rows: blocks.iter().map(|b| b.rows).sum(),
            cols,
            data,
        }
    }

    /// The columns with these indices, in this order.
    pub fn select_columns(&self, indices: &[usize]) -> Self {
        Self::from_fn(self.rows, indices.len(), |i, j| self[(i, indices[j])])
    }

    /// Contains every product A B.
    pub fn mul(&self, b: &Self) -> Self {
        assert_eq!(self.cols, b.rows, "product: inner dimensions agree");
        self.product(b.cols, |k| b.row(k).iter().copied())
    }

    /// Contains every product A M with the f64 matrix M.
    pub fn mul_matrix(&self, m: &Matrix) -> Self {
        assert_eq!(self.cols, m.rows(), "product: inner dimensions agree");
        self.product(m.cols(), |k| m.row(k).iter().map(|&x| Interval::point(x)))
    }

    /// Contains every product M A with the f64 matrix M on the left.
    pub fn left_mul(&self, m: &Matrix) -> Self {
        Self::from(m).mul(self)
    }

    fn product<I: Iterator<Item = Interval>>(&self, cols: usize, row: impl Fn(usize) -> I) -> Self {
        ops::count_of(|| {
            products(
                self.data.iter().filter(|&&a| a != Interval::ZERO).count() * cols,
                self.rows * cols,
            )
        });
        let mut out = Self::zeros(self.rows, cols);
        for i in 0..self.rows {
            let target = &mut out.data[i * cols..(i + 1) * cols];
            for (k, &a) in self.row(i).iter().enumerate() {
                // 0·x = 0 and 0 + x = x are exact: an entry that is exactly zero contributes nothing.
                if a != Interval::ZERO {
                    for (t, x) in target.iter_mut().zip(row(k)) {
                        *t = *t + a * x;
                    }
                }
            }
        }
        out
    }

    /// Contains every product A x.
    pub fn mul_vec(&self, x: &IntervalVector) -> IntervalVector {
        assert_eq!(self.cols, x.dim(), "matrix times box: dimensions agree");
        ops::count_of(|| products(self.data.len(), self.rows));
        let entry = |i| {
            self.row(i)
                .iter()
                .zip(x)
                .fold(Interval::ZERO, |s, (&a, &x)| s + a * x)
        };
        (0..self.rows).map(entry).collect()
    }

    /// Contains every sum A + B.
    pub fn add(&self, b: &Self) -> Self {
        self.zip(b, |x, y| x + y)
    }

    /// Contains every difference A − B.
    pub fn sub(&self, b: &Self) -> Self {
        self.zip(b, |x, y| x - y)
    }

    /// Contains every s A.
    pub fn scale(&self, s: Interval) -> Self {
        ops::count(4 * self.data.len(), 0);
        Self {
            rows: self.rows,
            cols: self.cols,
            data: self.data.iter().map(|&x| s * x).collect(),
        }
    }

    /// The smallest matrix of intervals containing both, exact.
    pub fn hull(&self, b: &Self) -> Self {
        assert_eq!(
            (self.rows, self.cols),
            (b.rows, b.cols),
            "hull: shapes agree"
        );
        let data = self
            .data
            .iter()
            .zip(&b.data)
            .map(|(x, y)| x.hull(y))
            .collect();
        Self {
            rows: self.rows,
            cols: self.cols,
            data,
        }
    }

    /// Contains every Aᵏ, by repeated products Aᵏ = Aᵏ⁻¹ A; the identity for k = 0.
    pub fn power(&self, k: usize) -> Self {
        assert_eq!(self.rows, self.cols, "power: the matrix is square");
        match k {
            0 => Self::identity(self.rows),
            _ => (1..k).fold(self.clone(), |power, _| power.mul(self)),
        }
    }

    /// I, A, A², …, Aᵏ.
    pub fn powers(&self, k: usize) -> Vec<Self> {
        assert_eq!(self.rows, self.cols, "powers: the matrix is square");
        let mut powers = vec![Self::identity(self.rows)];
        for i in 0..k {
            powers.push(if i == 0 {
                self.clone()
            } else {
                powers[i].mul(self)
            });
        }
        powers
    }

    fn zip(&self, b: &Self, f: impl Fn(Interval, Interval) -> Interval) -> Self {
        assert_eq!(
            (self.rows, self.cols),
            (b.rows, b.cols),
            "entrywise: shapes agree"
        );
        ops::count(0, 2 * self.data.len());
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

    fn entries(&self, f: impl Fn(Interval) -> f64) -> Matrix {
        Matrix::from_fn(self.rows, self.cols, |i, j| f(self[(i, j)]))
    }

    /// The lower bounds.
    pub fn lower(&self) -> Matrix {
        self.entries(Interval::lo)
    }

    /// The upper bounds.
    pub fn upper(&self) -> Matrix {
        self.entries(Interval::hi)
    }

    /// A matrix inside, near the middle.
    pub fn mid(&self) -> Matrix {
        self.entries(Interval::mid)
    }

    /// Upper bounds on the distances from [`IntervalMatrix::mid`], entrywise.
    pub fn rad(&self) -> Matrix {
        self.entries(Interval::rad)
    }

    /// max |M|, entrywise, exact.
    pub fn mag(&self) -> Matrix {
        self.entries(Interval::mag)
    }

    /// Upper bounds on the row sums of max |M|.
    pub fn abs_row_sums(&self) -> List<f64> {
        let sum = |i| {
            self.row(i)
                .iter()
                .fold(Interval::ZERO, |s, x| s + Interval::point(x.mag()))
                .hi()
        };
        (0..self.rows).map(sum).collect()
    }

    /// An upper bound on max ‖M‖∞, the largest absolute row sum.
    pub fn norm_inf(&self) -> f64 {
        self.abs_row_sums().iter().copied().fold(0.0, f64::max)
    }

    /// True if the f64 matrix `m` lies inside; false if it has another shape.
    pub fn contains(&self, m: &Matrix) -> bool {
        (self.rows, self.cols) == (m.rows(), m.cols())
            && self
                .data
                .iter()
                .zip(m.as_slice())
                .all(|(a, &x)| a.contains(x))
    }

    /// True if all bounds are finite.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|x| x.is_finite())
    }

    /// The matrix itself if it is finite, else the error `Domain` of the operation `op`.
    pub fn finite(self, op: &'static str) -> Result<Self, SetError> {
        for entry in &self.data {
            entry.finite(op)?;
        }
        Ok(self)
    }
}

/// Contains f(x) and the Jacobian f'(x) for every x in the box.
///
/// Returns m intervals and an m × n matrix. Fails with `Dimension` if the box has not f's dimension, with
/// `Domain` if f or a derivative may be undefined somewhere in the box (or overflows).
pub fn jacobian_over<F: Function>(
    f: &F,
    x: &IntervalVector,
) -> Result<(IntervalVector, IntervalMatrix), SetError> {
    const OP: &str = "Jacobian over a box";
    same_dimension(OP, f.inputs(), x.dim())?;
    split(number::jacobian(f, x.as_slice()), OP)
}

/// As [`jacobian_over`], with the derivatives by the inputs of a range alone: an m × range matrix.
pub fn partial_jacobian_over<F: Function>(
    f: &F,
    x: &IntervalVector,
    inputs: Range<usize>,
) -> Result<(IntervalVector, IntervalMatrix), SetError> {
    const OP: &str = "Jacobian over a box";
    same_dimension(OP, f.inputs(), x.dim())?;
    split(number::partial_jacobian(f, x.as_slice(), inputs), OP)
}

/// Contains f(x), the Jacobian and the m matrices of second derivatives for every x in the box.
///
/// Fails as [`jacobian_over`] does.
pub fn hessian_over<F: Function>(
    f: &F,
    x: &IntervalVector,
) -> Result<(IntervalVector, IntervalMatrix, List<IntervalMatrix>), SetError> {
    const OP: &str = "Hessian over a box";
    same_dimension(OP, f.inputs(), x.dim())?;
    let n = f.inputs();
    let hessian = number::hessian(f, x.as_slice());
    let second = (0..f.outputs())
        .map(|q| {
            IntervalMatrix {
                rows: n,
                cols: n,
                data: List::from(hessian.output(q)),
            }
            .finite(OP)
        })
        .collect::<Result<_, _>>()?;
    let (value, jacobian) = split(hessian.jacobian, OP)?;
    Ok((value, jacobian, second))
}

fn split(
    jacobian: number::Jacobian<Interval>,
    op: &'static str,
) -> Result<(IntervalVector, IntervalMatrix), SetError> {
    let (rows, cols) = (jacobian.outputs(), jacobian.inputs());
    let matrix = IntervalMatrix {
        rows,
        cols,
        data: List::from(jacobian.as_slice()),
    }
    .finite(op)?;
    Ok((IntervalVector::new(jacobian.value).finite(op)?, matrix))
}

impl From<&Matrix> for IntervalMatrix {
    /// The matrix whose entries are points.
    fn from(m: &Matrix) -> Self {
        let data = m.as_slice().iter().map(|&x| Interval::point(x)).collect();
        Self {
            rows: m.rows(),
            cols: m.cols(),
            data,
        }
    }
}

impl Index<(usize, usize)> for IntervalMatrix {
    type Output = Interval;
    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &Interval {
        &self.data[i * self.cols + j]
    }
}

impl IndexMut<(usize, usize)> for IntervalMatrix {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut Interval {
        &mut self.data[i * self.cols + j]
    }
}

impl fmt::Debug for IntervalMatrix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list()
            .entries((0..self.rows).map(|i| self.row(i)))
            .finish()
    }
}

/// Multiplications and additions of `terms` interval products that are summed to `sums`: a product of intervals
/// takes the four products of their bounds, a sum two additions.
fn products(terms: usize, sums: usize) -> (usize, usize) {
    (4 * terms, 2 * terms.saturating_sub(sums))
}

/// start + Σ_j m_j x_j in ascending j, where exact zeros of the row add nothing.
#[inline]
pub fn dot(start: Interval, row: &[Interval], x: &[Interval]) -> Interval {
    let zero = Interval::ZERO;
    let first = usize::from(start == zero);
    ops::count_of(|| products(row.iter().filter(|&&m| m != zero).count(), first));
    row.iter()
        .zip(x)
        .filter(|(m, _)| **m != zero)
        .fold(start, |sum, (&m, &x)| sum + m * x)
}

/// [`dot`] for a row of f64.
#[inline]
pub fn real_dot(start: Interval, row: &[f64], x: &[Interval]) -> Interval {
    let first = usize::from(start == Interval::ZERO);
    ops::count_of(|| products(row.iter().filter(|&&m| m != 0.0).count(), first));
    row.iter()
        .zip(x)
        .filter(|(m, _)| **m != 0.0)
        .fold(start, |sum, (&m, &x)| sum + x * m)
}
