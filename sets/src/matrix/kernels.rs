//! The loops of products and factorisations, over any number.
//!
//! They run on f64; they are generic so that the test below can push numbers through them that count
//! their own operations, which holds the tally's figures against the loops themselves.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// What the loops need of a number.
pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + AddAssign
{
    /// A sum that has no term yet.
    const ZERO: Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn value(self) -> f64;
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
}

/// out = A B by rows, for A with rows of length `inner` and B with rows of length `cols`.
#[inline]
pub(super) fn product<T: Number>(inner: usize, a: &[T], cols: usize, b: &[T], out: &mut [T]) {
    if inner == 0 || cols == 0 {
        return;
    }
    for (row, target) in a.chunks_exact(inner).zip(out.chunks_exact_mut(cols)) {
        for (k, &m) in row.iter().enumerate() {
            let other = &b[k * cols..(k + 1) * cols];
            if k == 0 {
                for (t, &x) in target.iter_mut().zip(other) {
                    *t = m * x;
                }
            } else {
                for (t, &x) in target.iter_mut().zip(other) {
                    *t += m * x;
                }
            }
        }
    }
}

/// out = A Aᵀ for A of n rows of length `inner`.
#[inline]
pub(super) fn gram<T: Number>(inner: usize, a: &[T], n: usize, out: &mut [T]) {
    let row = |i: usize| &a[i * inner..(i + 1) * inner];
    for i in 0..n {
        for j in 0..=i {
            let s = dot(row(i), row(j));
            out[i * n + j] = s;
            out[j * n + i] = s;
        }
    }
}

/// Σ a_i b_i in ascending i.
#[inline]
pub(super) fn chain<T: Number>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::ZERO, |s, (&a, &b)| s + a * b)
}

/// L with A = L Lᵀ, n × n, from the lower triangle of A; false where a pivot is not above ε times its entry.
#[inline]
pub(super) fn cholesky<T: Number>(n: usize, a: &[T], l: &mut [T]) -> bool {
    for j in 0..n {
        for i in j..n {
            let s = (0..j).fold(a[i * n + j], |s, k| s - l[i * n + k] * l[j * n + k]);
            if i > j {
                l[i * n + j] = s / l[j * n + j];
            } else if s.value() > f64::EPSILON * a[j * n + j].value() && s.value().is_finite() {
                l[j * n + j] = s.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

/// X ← (L Lᵀ)⁻¹ X for X of n rows of length `cols`.
#[inline]
pub(super) fn solve<T: Number>(n: usize, l: &[T], cols: usize, x: &mut [T]) {
    // Row by row of X, so that its columns do not wait for each other's quotients.
    let eliminate = |x: &mut [T], i: usize, k: usize, factor: T| {
        let (low, high) = x.split_at_mut(i.max(k) * cols);
        let (from, to) = match k < i {
            true => (&low[k * cols..][..cols], &mut high[..cols]),
            false => (&high[..cols], &mut low[i * cols..][..cols]),
        };
        for (to, &from) in to.iter_mut().zip(from) {
            *to = *to - factor * from;
        }
    };
    for i in 0..n {
        (0..i).for_each(|k| eliminate(x, i, k, l[i * n + k]));
        x[i * cols..][..cols]
            .iter_mut()
            .for_each(|x| *x = *x / l[i * n + i]);
    }
    for i in (0..n).rev() {
        (i + 1..n).for_each(|k| eliminate(x, i, k, l[k * n + i]));
        x[i * cols..][..cols]
            .iter_mut()
            .for_each(|x| *x = *x / l[i * n + i]);
    }
}

/// Σ a_i b_i in eight interleaved lanes, added up as a fixed tree.
#[inline]
pub(super) fn dot<T: Number>(a: &[T], b: &[T]) -> T {
    let mut lanes = [T::ZERO; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let (a_rest, b_rest) = (a8.remainder(), b8.remainder());
    for (x, y) in a8.zip(b8) {
        for i in 0..8 {
            lanes[i] += x[i] * y[i];
        }
    }
    for (i, (&x, &y)) in a_rest.iter().zip(b_rest).enumerate() {
        lanes[i] += x * y;
    }
    tree(lanes)
}

/// Σ |a_i| in eight interleaved lanes, added up as a fixed tree.
#[inline]
pub(super) fn abs_sum<T: Number>(a: &[T]) -> T {
    let mut lanes = [T::ZERO; 8];
    let a8 = a.chunks_exact(8);
    let rest = a8.remainder();
    for x in a8 {
        for i in 0..8 {
            lanes[i] += x[i].abs();
        }
    }
    for (i, x) in rest.iter().enumerate() {
        lanes[i] += x.abs();
    }
    tree(lanes)
}

#[inline]
fn tree<T: Number>(l: [T; 8]) -> T {
    ((l[0] + l[1]) + (l[2] + l[3])) + ((l[4] + l[5]) + (l[6] + l[7]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Matrix, ops};
    use std::cell::Cell;

    thread_local! {
        static DONE: Cell<(u64, u64)> = const { Cell::new((0, 0)) };
    }

    /// A number that counts the operations on it: (multiplications, divisions and roots; additions). `Empty`
    /// is a sum without a term, to which the first term is moved.
    #[derive(Clone, Copy)]
    enum Counting {
        Empty,
        Value(f64),
    }

    fn did(multiplications: u64, additions: u64) {
        DONE.with(|d| {
            let (m, a) = d.get();
            d.set((m + multiplications, a + additions));
        });
    }

    fn summed(a: Counting, b: Counting, f: fn(f64, f64) -> f64) -> Counting {
        match (a, b) {
            (Counting::Empty, b) => b,
            (a, Counting::Empty) => a,
            (Counting::Value(a), Counting::Value(b)) => {
                did(0, 1);
                Counting::Value(f(a, b))
            }
        }
    }

    impl Add for Counting {
        type Output = Self;
        fn add(self, b: Self) -> Self {
            summed(self, b, |a, b| a + b)
        }
    }
    impl AddAssign for Counting {
        fn add_assign(&mut self, b: Self) {
            *self = *self + b;
        }
    }
    impl Sub for Counting {
        type Output = Self;
        fn sub(self, b: Self) -> Self {
            summed(self, b, |a, b| a - b)
        }
    }
    impl Mul for Counting {
        type Output = Self;
        fn mul(self, b: Self) -> Self {
            did(1, 0);
            Self::Value(self.value() * b.value())
        }
    }
    impl Div for Counting {
        type Output = Self;
        fn div(self, b: Self) -> Self {
            did(1, 0);
            Self::Value(self.value() / b.value())
        }
    }
    impl Number for Counting {
        const ZERO: Self = Self::Empty;
        fn abs(self) -> Self {
            Self::Value(self.value().abs())
        }
        fn sqrt(self) -> Self {
            did(1, 0);
            Self::Value(self.value().sqrt())
        }
        fn value(self) -> f64 {
            match self {
                Self::Empty => 0.0,
                Self::Value(x) => x,
            }
        }
    }

    fn counting(m: &Matrix) -> Vec<Counting> {
        m.as_slice().iter().map(|&x| Counting::Value(x)).collect()
    }

    /// What `loops` did on counting numbers is what the tally says of `whole`.
    fn agree(what: &str, whole: impl FnOnce(), loops: impl FnOnce()) {
        let ((), tally) = ops::tally(whole);
        DONE.set((0, 0));
        loops();
        let total = tally.total();
        assert_eq!(
            (total.multiplications, total.additions),
            DONE.get(),
            "{what}"
        );
    }

    #[test]
    fn the_tally_is_what_a_counting_number_counts_in_the_same_loops() {
        let entry = |i: usize, j: usize| ((i * 7 + j * 5 + 3) % 11) as f64 - 4.5;
        for n in 1..12 {
            for p in [1, 2, 3, 7, 8, 9, 17, 40] {
                let (g, h) = (Matrix::from_fn(n, p, entry), Matrix::from_fn(p, 5, entry));
                let (ng, nh) = (counting(&g), counting(&h));
                let empty = |len| vec![Counting::Empty; len];
                agree(
                    "product",
                    || drop(g.mul(&h)),
                    || product(p, &ng, 5, &nh, &mut empty(n * 5)),
                );
                agree(
                    "gram",
                    || drop(g.gram()),
                    || gram(p, &ng, n, &mut empty(n * n)),
                );
                agree(
                    "product with a transpose",
                    || drop(g.mul_transpose(&g)),
                    || {
                        for i in 0..n {
                            for j in 0..n {
                                dot(&ng[i * p..(i + 1) * p], &ng[j * p..(j + 1) * p]);
                            }
                        }
                    },
                );
                agree(
                    "matrix times vector",
                    || drop(g.mul_vec(&h.col(0))),
                    || {
                        for i in 0..n {
                            chain(&ng[i * p..(i + 1) * p], &nh[..p]);
                        }
                    },
                );
                agree(
                    "row sums",
                    || drop(g.abs_row_sums()),
                    || {
                        for i in 0..n {
                            abs_sum(&ng[i * p..(i + 1) * p]);
                        }
                    },
                );
            }
            let mut s = Matrix::from_fn(n, n, entry).gram();
            for i in 0..n {
                s[(i, i)] += 1.0;
            }
            let right = Matrix::from_fn(n, 3, entry);
            agree(
                "Cholesky factor and solution",
                || drop(s.solve_positive_definite(&right)),
                || {
                    let mut l = vec![Counting::Empty; n * n];
                    assert!(cholesky(n, &counting(&s), &mut l));
                    solve(n, &l, 3, &mut counting(&right));
                },
            );
        }
    }

    #[test]
    fn an_operation_more_would_show() {
        let g = Matrix::identity(2);
        let ((), tally) = ops::tally(|| {
            let _ = g.mul(&g);
        });
        let mut out = vec![Counting::Empty; 4];
        DONE.set((0, 0));
        product(2, &counting(&g), 2, &counting(&g), &mut out);
        let one_more = out[1];
        out[0] += one_more;
        assert_ne!(tally.total().additions, DONE.get().1);
    }
}
