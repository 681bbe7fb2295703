//! How far the removal of a generator moves a constrained zonotope: the scores of Scott's elimination.
//!
//! The d that minimises ‖G d‖² + Σ_k w_k d_k² with A d = 0 and d_j = 1 is P e_j / P_jj, where
//! P = K⁻¹ − K⁻¹Aᵀ(A K⁻¹Aᵀ)⁻¹A K⁻¹ and K = diag w + GᵀG, w = 1 at first. An elimination changes w only: G d and
//! A d = 0 are the same for the coordinates that are left, and the one that went costs nothing any more,
//! w_j = 0; a coordinate rescaled by ρ has w_k/ρ². So P follows by
//!
//! P ← P − τ (P e_j)(P e_j)ᵀ,  τ = Δw_j / (1 + Δw_j P_jj),
//!
//! which takes P e_j, p (n + q + t) operations after t such steps, where a new P takes p (q² + n²).
//! Scores choose and prove nothing, so that P may be approximate.
//!
//! Source: Scott et al. 2016, Sec. 4.2; the block inverse and the rank-one steps are ours.

use super::super::yang_scott::largest;
use crate::matrix::dot;
use crate::{List, Matrix, ops};

/// Rank-one steps after which P is made anew, at least; half as many as P has terms where those are more.
const STEPS: usize = 32;

/// With no more constraints than this a new P is as cheap as a step, and rounds less.
const FEW: usize = 8;

/// A step that divides by less than this loses too many digits.
const SMALLEST: f64 = 1e-7;

/// P as I − Σ σ_k t_k t_kᵀ, with what the scores need of it. Everything is about the columns that are left.
#[derive(Clone, Debug)]
pub(super) struct Scores {
    /// The t_k and σ_k: n + q of the first P, then one a step.
    terms: List<(f64, List<f64>)>,
    /// G P, n rows.
    images: List<List<f64>>,
    /// P_jj.
    diagonal: List<f64>,
    /// By how much each coordinate was rescaled since P was made: ξ_j = … + s_j ζ_j.
    scale: List<f64>,
    /// Steps that may be made.
    limit: usize,
    /// Steps made.
    steps: usize,
    /// False after a step that lost too many digits.
    exact: bool,
}

impl Scores {
    /// P of the rows `g` and `a`; `None` if a factor breaks down.
    ///
    /// K⁻¹ = I − VᵀV for V = L⁻¹G, LLᵀ = I + GGᵀ, and P = I − VᵀV − WᵀW for W = N⁻¹A K⁻¹, NNᵀ = A K⁻¹Aᵀ: only an n × n
    /// and a q × q matrix are factored, and G P = (LLᵀ)⁻¹G − (G Wᵀ) W.
    pub(super) fn of(g: &[List<f64>], a: &[List<f64>]) -> Option<Self> {
        let (n, q) = (g.len(), a.len());
        let p = g.first().map_or(0, |row| row.len());
        // The rows at a common scale: P does not depend on it.
        let a: List<List<f64>> = a
            .iter()
            .map(|row| {
                let largest = largest(row).1;
                row.iter().map(|x| x / largest).collect()
            })
            .collect();
        let mut gram = Matrix::from_fn(n, n, |i, j| dot(&g[i], &g[j]));
        for i in 0..n {
            gram[(i, i)] += 1.0;
        }
        let l = cholesky(gram)?;
        let mut v = List::from(g);
        solve_lower(&l, &mut v);
        let mut w: List<List<f64>> = a.clone();
        for row in &mut w {
            let along: List<f64> = v.iter().map(|v| dot(row, v)).collect();
            for (&s, v) in along.iter().zip(&v) {
                row.iter_mut().zip(v).for_each(|(w, v)| *w -= s * v);
            }
        }
        // Of the symmetric A K⁻¹ Aᵀ the factor reads the lower half.
        let middle = Matrix::from_fn(q, q, |i, j| if j <= i { dot(&w[i], &a[j]) } else { 0.0 });
        solve_lower(&cholesky(middle)?, &mut w);
        let mut diagonal = List::filled(1.0, p);
        for row in v.iter().chain(&w) {
            diagonal.iter_mut().zip(row).for_each(|(d, x)| *d -= x * x);
        }
        // G P, row by row: Σ_k L⁻ᵀ_ik v_k − Σ_k (g_i · w_k) w_k.
        let mut images = v.clone();
        solve_lower_transposed(&l, &mut images);
        for (row, g) in images.iter_mut().zip(g) {
            for w in &w {
                let s = dot(g, w);
                row.iter_mut().zip(w).for_each(|(x, w)| *x -= s * w);
            }
        }
        // Beside the factors and solutions: A scaled, two Gram matrices, W and G P by 2 n q rows each.
        let (dots, rows) = (n * n + q * q, 4 * n * q);
        ops::count(
            p * (dots + rows + n + 2 * q),
            p * (dots + rows + n + q) - dots - rows / 2,
        );
        Some(Self {
            terms: (v.iter_mut().chain(&mut w))
                .map(|row| (1.0, std::mem::take(row)))
                .collect(),
            images,
            diagonal,
            scale: List::filled(1.0, p),
            limit: if q > FEW { STEPS.max((n + q) / 2) } else { 0 },
            steps: 0,
            exact: true,
        })
    }

    /// Whether P is still good enough to choose by.
    pub(super) fn fresh(&self) -> bool {
        self.exact && self.steps < self.limit
    }

    /// True before the first step.
    #[cfg(test)]
    pub(super) fn is_new(&self) -> bool {
        self.steps == 0
    }

    /// ‖G P e_j‖₂ / P_jj in units of the rescaled coordinates, for every j.
    pub(super) fn moves(&self) -> List<f64> {
        let p = self.diagonal.len();
        let mut squares = List::filled(0.0, p);
        for row in &self.images {
            squares.iter_mut().zip(row).for_each(|(s, x)| *s += x * x);
        }
        ops::count(p * (self.images.len() + 2), p * self.images.len());
        squares
            .iter()
            .zip(&self.diagonal)
            .zip(&self.scale)
            .map(|((s, &d), &scale)| {
                if d > 0.0 {
                    s.sqrt() * scale / d
                } else {
                    f64::INFINITY
                }
            })
            .collect()
    }

    /// Coordinate `j` is rescaled by `by`: a known one, `by` = 0, is held at 0.
    pub(super) fn rescale(&mut self, j: usize, by: f64) {
        if !self.fresh() {
            return;
        }
        let weight = 1.0 / (self.scale[j] * self.scale[j]);
        self.step(j, weight * (1.0 / (by * by) - 1.0));
        self.scale[j] *= by;
    }

    /// Coordinate `j` goes, expressed by the others.
    pub(super) fn eliminate(&mut self, j: usize) {
        if self.fresh() {
            self.step(j, -1.0 / (self.scale[j] * self.scale[j]));
        }
        for (_, row) in &mut self.terms {
            row.remove(j);
        }
        for row in self
            .images
            .iter_mut()
            .chain([&mut self.diagonal, &mut self.scale])
        {
            row.remove(j);
        }
    }

    /// Only the columns `kept` are left.
    pub(super) fn keep(&mut self, kept: &[usize]) {
        let rows = self.terms.iter_mut().map(|(_, row)| row);
        let others = self
            .images
            .iter_mut()
            .chain([&mut self.diagonal, &mut self.scale]);
        rows.chain(others).for_each(|row| keep(row, kept));
    }

    /// w_j += `by`, which may be infinite.
    fn step(&mut self, j: usize, by: f64) {
        let mut column = List::filled(0.0, self.diagonal.len());
        column[j] = 1.0;
        let mut blocks = self.terms.chunks_exact(4);
        for block in blocks.by_ref() {
            let [(s0, t0), (s1, t1), (s2, t2), (s3, t3)] = block else {
                continue;
            };
            let (f0, f1, f2, f3) = (s0 * t0[j], s1 * t1[j], s2 * t2[j], s3 * t3[j]);
            for ((((x, a), b), c), d) in column.iter_mut().zip(t0).zip(t1).zip(t2).zip(t3) {
                *x -= (f0 * a + f1 * b) + (f2 * c + f3 * d);
            }
        }
        for (s, t) in blocks.remainder() {
            let f = s * t[j];
            column.iter_mut().zip(t).for_each(|(x, t)| *x -= f * t);
        }
        let own = self.diagonal[j];
        let divisor = if by.is_infinite() {
            own
        } else {
            1.0 + by * own
        };
        self.exact = divisor > SMALLEST;
        if !self.exact {
            return;
        }
        let tau = if by.is_infinite() { 1.0 } else { by } / divisor;
        for row in &mut self.images {
            let f = tau * row[j];
            row.iter_mut().zip(&column).for_each(|(g, x)| *g -= f * x);
        }
        self.diagonal
            .iter_mut()
            .zip(&column)
            .for_each(|(d, x)| *d -= tau * x * x);
        let (p, rows) = (column.len(), self.terms.len() + self.images.len());
        ops::count(p * (rows + 2) + rows + 2, p * (rows + 1) + 1);
        self.terms.push((tau, column));
        self.steps += 1;
    }
}

/// The entries of `row` at `kept`, which ascend.
pub(super) fn keep(row: &mut List<f64>, kept: &[usize]) {
    for (to, &from) in kept.iter().enumerate() {
        row[to] = row[from];
    }
    row.truncate(kept.len());
}

/// L with M = L Lᵀ; `None` if a pivot is not above rounding.
fn cholesky(mut m: Matrix) -> Option<Matrix> {
    let n = m.rows();
    ops::count(n * (n + 1) * (n + 2) / 6, n * (n * n - 1) / 6);
    for k in 0..n {
        let first = m[(k, k)];
        let pivot = first - (0..k).fold(0.0, |s, l| s + m[(k, l)] * m[(k, l)]);
        if pivot.is_nan() || pivot <= 1e-14 * first.abs() {
            return None;
        }
        let root = pivot.sqrt();
        m[(k, k)] = root;
        for i in k + 1..n {
            let rest = (0..k).fold(m[(i, k)], |s, l| s - m[(i, l)] * m[(k, l)]);
            m[(i, k)] = rest / root;
        }
    }
    Some(m)
}

/// The operations of a triangular system with the right sides `b`.
fn count_triangular(b: &[List<f64>]) {
    let (n, p) = (b.len(), b.first().map_or(0, |row| row.len()));
    ops::count(p * n * (n + 1) / 2 + n, p * n * n.saturating_sub(1) / 2);
}

/// B ← L⁻¹ B, by rows.
fn solve_lower(l: &Matrix, b: &mut [List<f64>]) {
    count_triangular(b);
    for i in 0..b.len() {
        let (done, rest) = b.split_at_mut(i);
        let row = &mut rest[0];
        for (k, other) in done.iter().enumerate() {
            let f = l[(i, k)];
            row.iter_mut().zip(other).for_each(|(x, y)| *x -= f * y);
        }
        let inverse = 1.0 / l[(i, i)];
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}

/// B ← L⁻ᵀ B, by rows.
fn solve_lower_transposed(l: &Matrix, b: &mut [List<f64>]) {
    count_triangular(b);
    for i in (0..b.len()).rev() {
        let (head, rest) = b.split_at_mut(i + 1);
        let row = &mut head[i];
        for (k, other) in rest.iter().enumerate() {
            let f = l[(i + 1 + k, i)];
            row.iter_mut().zip(other).for_each(|(x, y)| *x -= f * y);
        }
        let inverse = 1.0 / l[(i, i)];
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ConstrainedZonotope;

    fn rows(m: &Matrix) -> List<List<f64>> {
        (0..m.rows()).map(|i| List::from(m.row(i))).collect()
    }

    /// K = I + GᵀG, the saddle-point system [K Aᵀ e; A 0 0; eᵀ 0 0] solved outright.
    fn direct(x: &ConstrainedZonotope, j: usize) -> f64 {
        let (p, q) = (x.generators(), x.constraints());
        let gram = x.g().transpose().mul(x.g());
        let size = p + q + 1;
        let system = Matrix::from_fn(size, size, |r, c| {
            let (low, high) = (r.min(c), r.max(c));
            if high < p {
                gram[(r, c)] + f64::from(u8::from(r == c))
            } else if high < p + q {
                if low < p { x.a()[(high - p, low)] } else { 0.0 }
            } else {
                f64::from(u8::from(low == j))
            }
        });
        let mut right = vec![0.0; size];
        right[size - 1] = 1.0;
        let solution = system.inverse().unwrap().mul_vec(&right);
        let moved = x.g().mul_vec(&solution[..p]);
        dot(&moved, &moved).sqrt()
    }

    #[test]
    fn the_score_is_that_of_the_constrained_minimum() {
        let mut state = 1_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for (n, q, p) in [(2, 1, 3), (2, 5, 20), (3, 4, 9)] {
            let g = Matrix::from_fn(n, p, |_, _| next());
            let a = Matrix::from_fn(q, p, |_, _| next());
            let x = ConstrainedZonotope::new(vec![0.0; n], g, a, vec![0.0; q]).unwrap();
            let moves = Scores::of(&rows(x.g()), &rows(x.a())).unwrap().moves();
            for (j, found) in moves.iter().enumerate() {
                let expected = direct(&x, j);
                assert!(
                    (found - expected).abs() < 1e-9 * (1.0 + expected),
                    "{found} {expected}"
                );
            }
        }
    }
}
