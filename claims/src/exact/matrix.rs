//! Small exact matrices.

use super::{Q, V, dot, q};
use num_traits::{One, Signed, Zero};

/// A matrix, by rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct M {
    rows: usize,
    cols: usize,
    at: Vec<Q>,
}

impl M {
    /// The matrix with the entry f(i, j).
    pub fn from_fn(rows: usize, cols: usize, mut f: impl FnMut(usize, usize) -> Q) -> Self {
        let mut at = Vec::with_capacity(rows * cols);
        for i in 0..rows {
            for j in 0..cols {
                at.push(f(i, j));
            }
        }
        Self { rows, cols, at }
    }

    /// The matrix of these whole numbers.
    pub fn ints(rows: &[&[i64]]) -> Self {
        Self::from_fn(rows.len(), rows.first().map_or(0, |r| r.len()), |i, j| {
            q(rows[i][j])
        })
    }

    /// The matrix of these rows.
    pub fn of_rows(cols: usize, rows: &[V]) -> Self {
        Self::from_fn(rows.len(), cols, |i, j| rows[i][j].clone())
    }

    /// A matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self::from_fn(rows, cols, |_, _| Q::zero())
    }

    /// The identity.
    pub fn identity(n: usize) -> Self {
        Self::from_fn(n, n, |i, j| if i == j { Q::one() } else { Q::zero() })
    }

    /// The matrix with `d` on its diagonal.
    pub fn diag(d: &[Q]) -> Self {
        Self::from_fn(d.len(), d.len(), |i, j| {
            if i == j { d[i].clone() } else { Q::zero() }
        })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> &[Q] {
        &self.at[i * self.cols..(i + 1) * self.cols]
    }

    /// Column `j`.
    pub fn col(&self, j: usize) -> V {
        (0..self.rows).map(|i| self[(i, j)].clone()).collect()
    }

    /// The product with a vector.
    pub fn apply(&self, x: &[Q]) -> V {
        (0..self.rows).map(|i| dot(self.row(i), x)).collect()
    }

    /// The product self · other.
    pub fn mul(&self, other: &M) -> M {
        let t = other.t();
        M::from_fn(self.rows, other.cols, |i, j| dot(self.row(i), t.row(j)))
    }

    /// self + other.
    pub fn add(&self, other: &M) -> M {
        M::from_fn(self.rows, self.cols, |i, j| &self[(i, j)] + &other[(i, j)])
    }

    /// self − other.
    pub fn sub(&self, other: &M) -> M {
        M::from_fn(self.rows, self.cols, |i, j| &self[(i, j)] - &other[(i, j)])
    }

    /// f · self.
    pub fn scale(&self, f: &Q) -> M {
        M::from_fn(self.rows, self.cols, |i, j| f * &self[(i, j)])
    }

    /// The transpose.
    pub fn t(&self) -> M {
        M::from_fn(self.cols, self.rows, |i, j| self[(j, i)].clone())
    }

    /// Absolute values, entry by entry.
    pub fn abs(&self) -> M {
        M::from_fn(self.rows, self.cols, |i, j| self[(i, j)].abs())
    }

    /// [self other].
    pub fn beside(&self, other: &M) -> M {
        M::from_fn(self.rows, self.cols + other.cols, |i, j| {
            if j < self.cols {
                self[(i, j)].clone()
            } else {
                other[(i, j - self.cols)].clone()
            }
        })
    }

    /// self over other.
    pub fn above(&self, other: &M) -> M {
        M {
            rows: self.rows + other.rows,
            cols: self.cols,
            at: [self.at.clone(), other.at.clone()].concat(),
        }
    }

    /// The block diagonal of self and other.
    pub fn block(&self, other: &M) -> M {
        self.beside(&M::zeros(self.rows, other.cols))
            .above(&M::zeros(other.rows, self.cols).beside(other))
    }

    /// Sum of the diagonal.
    pub fn trace(&self) -> Q {
        (0..self.rows).fold(Q::zero(), |s, i| s + &self[(i, i)])
    }

    /// Sum of |entries| of each row.
    pub fn row_sums(&self) -> V {
        (0..self.rows).map(|i| super::norm1(self.row(i))).collect()
    }

    /// The inverse; `None` if singular.
    pub fn inverse(&self) -> Option<M> {
        let n = self.rows;
        let mut w = self.beside(&M::identity(n));
        for j in 0..n {
            let p = (j..n).find(|&i| !w[(i, j)].is_zero())?;
            w.swap_rows(p, j);
            let f = w[(j, j)].recip();
            for k in 0..2 * n {
                w[(j, k)] *= &f;
            }
            for i in (0..n).filter(|&i| i != j) {
                let f = w[(i, j)].clone();
                if !f.is_zero() {
                    for k in 0..2 * n {
                        let s = &f * &w[(j, k)];
                        w[(i, k)] -= s;
                    }
                }
            }
        }
        Some(M::from_fn(n, n, |i, j| w[(i, n + j)].clone()))
    }

    /// The rank.
    pub fn rank(&self) -> usize {
        let mut w = self.clone();
        let mut rank = 0;
        for j in 0..w.cols {
            let Some(p) = (rank..w.rows).find(|&i| !w[(i, j)].is_zero()) else {
                continue;
            };
            w.swap_rows(p, rank);
            for i in rank + 1..w.rows {
                let f = &w[(i, j)] / &w[(rank, j)];
                for k in j..w.cols {
                    let s = &f * &w[(rank, k)];
                    w[(i, k)] -= s;
                }
            }
            rank += 1;
        }
        rank
    }

    /// Whether a symmetric matrix is positive semidefinite: symmetric elimination leaves no negative pivot,
    /// and a zero pivot only over a zero row.
    pub fn is_psd(&self) -> bool {
        let n = self.rows;
        let mut w = self.clone();
        for j in 0..n {
            if w[(j, j)].is_negative() {
                return false;
            }
            if w[(j, j)].is_zero() {
                if (j..n).any(|k| !w[(j, k)].is_zero()) {
                    return false;
                }
                continue;
            }
            for i in j + 1..n {
                let f = &w[(i, j)] / &w[(j, j)];
                for k in j..n {
                    let s = &f * &w[(j, k)];
                    w[(i, k)] -= s;
                }
            }
        }
        true
    }

    fn swap_rows(&mut self, a: usize, b: usize) {
        if a != b {
            for k in 0..self.cols {
                self.at.swap(a * self.cols + k, b * self.cols + k);
            }
        }
    }

    /// The matrix as text: [1 0; 0 1].
    pub fn text(&self) -> String {
        let rows: Vec<String> = (0..self.rows)
            .map(|i| {
                let row: Vec<String> = self.row(i).iter().map(Q::to_string).collect();
                row.join(" ")
            })
            .collect();
        format!("[{}]", rows.join("; "))
    }
}

impl std::ops::Index<(usize, usize)> for M {
    type Output = Q;

    fn index(&self, (i, j): (usize, usize)) -> &Q {
        &self.at[i * self.cols + j]
    }
}

impl std::ops::IndexMut<(usize, usize)> for M {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut Q {
        &mut self.at[i * self.cols + j]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::frac;

    #[test]
    fn inverse_rank_and_definiteness() {
        let a = M::ints(&[&[2, 1], &[1, 2]]);
        assert_eq!(a.mul(&a.inverse().unwrap()), M::identity(2));
        assert!(M::ints(&[&[1, 2], &[2, 4]]).inverse().is_none());
        assert_eq!(M::ints(&[&[1, 2, 3], &[2, 4, 6], &[0, 0, 1]]).rank(), 2);
        assert!(a.is_psd());
        assert!(M::ints(&[&[1, 1], &[1, 1]]).is_psd());
        assert!(M::ints(&[&[0, 0], &[0, 1]]).is_psd());
        assert!(!M::ints(&[&[0, 1], &[1, 1]]).is_psd());
        assert!(!M::ints(&[&[1, 2], &[2, 1]]).is_psd());
        assert_eq!(a.inverse().unwrap()[(0, 0)], frac(2, 3));
    }
}
