//! Yang and Scott's Method 4 (Chisci's rule): absorb generators into a parallelotope, cheapest first.
//!
//! A block T of n independent generators spans a parallelotope. Any other generator g = T ρ can be absorbed
//! by stretching T's edges by 1 + |ρ_i|, which adds volume in proportion to Π(1 + |ρ_i|) − 1 − Σ|ρ_i|; the
//! one of the least increase goes first. Absorbing several stretches edge i by 1 + Σ_k |ρ_ik| in all.
//!
//! Source: X. Yang, J. K. Scott, "A comparison of zonotope order reduction techniques", Automatica 2018,
//! Method 4, after L. Chisci, A. Garulli, G. Zappa, Automatica 1996; used in [Rego2020, Sec. 5].

use super::girard;
use crate::matrix::abs_sum;
use crate::rounding::{ETA, U, gamma, up};
use crate::{List, Matrix, SetError, Zonotope, ops};

/// Encloses `z` in a zonotope of at most `generators` generators, [T', rest].
///
/// T is the invertible block that Gauss–Jordan elimination picks (see `independent_block`); generators
/// are absorbed in the order above, computed with ρ scaled by the stretch so far; of equal increases the
/// one of lower index goes first. With the order chosen, T' = fl(T diag σ), σ_i ≥ 1 + Σ_k |ρ_ik|, and
///
/// r' = ⌈r + u |T'| 1 + Σ_k (|fl(g_k − T ρ_k)| + γ_{n+1}(|g_k| + |T| |ρ_k|))⌉ over the generators absorbed:
/// g_k = T ρ_k + remainder holds for whatever ρ_k was computed. The rest keeps its order.
///
/// The block depends on the components' units, because I stands beside G in the elimination; with the block given, the
/// rest does not.
///
/// Contains `z`; `z` itself if p ≤ `generators`. Without an invertible block the reduction is Girard's.
/// Fails with `Range` if `generators` < n.
pub fn reduce(z: &Zonotope, generators: usize) -> Result<Zonotope, SetError> {
    const OP: &str = "Yang and Scott's reduction";
    let (n, p) = (z.dim(), z.generators());
    if generators < n {
        return Err(SetError::Range {
            op: OP,
            what: "number of generators",
            expected: "at least the dimension",
            got: generators as f64,
        });
    }
    if p <= generators {
        return Ok(z.clone());
    }
    let _stage = ops::stage(ops::Stage::Reduction);
    let Some((block, others, rho)) = independent_block(z.g()) else {
        return girard::reduce(z, generators);
    };
    let absorbed = absorption_order(&rho, p - generators);
    let t = z.g().select_columns(&block);
    let mut stretch = List::filled(1.0, n);
    let mut r = List::from(z.r());
    let mut gone = List::filled(false, others.len());
    let mut coordinates = List::filled(0.0, n);
    for &k in &absorbed {
        gone[k] = true;
        for i in 0..n {
            coordinates[i] = rho[(i, k)];
            stretch[i] += coordinates[i].abs();
        }
        for (i, r) in r.iter_mut().enumerate() {
            let g = z.g()[(i, others[k])];
            let (mut remainder, mut size) = (g, g.abs());
            for (&t, &x) in t.row(i).iter().zip(&coordinates) {
                remainder -= t * x;
                size += t.abs() * x.abs();
            }
            *r += remainder.abs() + gamma(n + 1) * size + ETA;
        }
    }
    ops::count(
        (2 * n + 1) * n * absorbed.len() + n * n,
        (2 * n + 4) * n * absorbed.len(),
    );
    // Each stretch is a sum of absorbed + 1 terms.
    let stretch: List<f64> = stretch.iter().map(|&s| up(s, absorbed.len())).collect();
    let kept: List<usize> = (0..others.len())
        .filter(|&k| !gone[k])
        .map(|k| others[k])
        .collect();
    let mut g = Matrix::zeros(n, n + kept.len());
    for (i, r) in r.iter_mut().enumerate() {
        let source = z.g().row(i);
        let target = g.row_mut(i);
        for (x, (&t, &s)) in target.iter_mut().zip(t.row(i).iter().zip(&stretch)) {
            *x = t * s;
        }
        for (x, &k) in target[n..].iter_mut().zip(&kept) {
            *x = source[k];
        }
        // 3 operations and the sum over k a row, its summands computed in 2n + 3.
        *r = up(*r + U * abs_sum(&target[..n]), absorbed.len() + 3 * n + 8);
    }
    Zonotope::checked(OP, List::from(z.c()), g, r)
}

/// n columns T of `g` that are independent, the other columns, and T⁻¹ times them.
///
/// Gauss–Jordan elimination on [G, I]: the pivot of a row is its entry of largest |·| among the columns of
/// G, and the next row is the one whose 1-norm is smallest beside its pivot. The columns of T stand
/// in the order of the pivots. `None` if a row has no pivot above rounding left.
fn independent_block(g: &Matrix) -> Option<(List<usize>, List<usize>, Matrix)> {
    let (n, p) = (g.rows(), g.cols());
    let mut m = Matrix::from_fn(n, p + n, |i, j| match j < p {
        true => g[(i, j)],
        false => f64::from(u8::from(i == j - p)),
    });
    let floor: List<f64> = (0..n).map(|i| 1e-12 * abs_sum(g.row(i))).collect();
    let mut block = List::with_capacity(n);
    let mut pivot_rows: List<usize> = List::with_capacity(n);
    let mut pivot_row = List::filled(0.0, p + n);
    for _ in 0..n {
        let mut best: Option<(f64, usize, usize)> = None;
        for i in (0..n).filter(|i| !pivot_rows.contains(i)) {
            let row = m.row(i);
            ops::compared(p);
            ops::count(1, p + n - 1);
            let (j, largest) = largest(&row[..p]);
            let ratio = abs_sum(row) / largest;
            if largest > floor[i] && best.is_none_or(|(b, ..)| ratio < b) {
                best = Some((ratio, i, j));
            }
        }
        let (_, i, j) = best?;
        block.push(j);
        pivot_rows.push(i);
        let inverse = 1.0 / m[(i, j)];
        m.row_mut(i).iter_mut().for_each(|x| *x *= inverse);
        pivot_row.copy_from_slice(m.row(i));
        ops::count(p + n + 1, 0);
        for k in (0..n).filter(|&k| k != i) {
            let factor = m[(k, j)];
            if factor != 0.0 {
                ops::count(p + n, p + n);
                m.row_mut(k)
                    .iter_mut()
                    .zip(&pivot_row)
                    .for_each(|(x, p)| *x -= factor * p);
                m[(k, j)] = 0.0;
            }
        }
    }
    let others: List<usize> = (0..p).filter(|j| !block.contains(j)).collect();
    let rho = Matrix::from_fn(n, others.len(), |i, k| m[(pivot_rows[i], others[k])]);
    rho.is_finite().then_some((block, others, rho))
}

/// The index and absolute value of the entry of largest |·|, the first of equals.
pub(super) fn largest(row: &[f64]) -> (usize, f64) {
    let mut lanes = [0.0; 4];
    let four = row.chunks_exact(4);
    let rest = four.remainder();
    for row in four {
        for k in 0..4 {
            let x = row[k].abs();
            lanes[k] = if x > lanes[k] { x } else { lanes[k] };
        }
    }
    for (lane, x) in lanes.iter_mut().zip(rest) {
        *lane = lane.max(x.abs());
    }
    let greatest = lanes.iter().fold(0.0, |best: f64, &x| best.max(x));
    let at = row.iter().position(|x| x.abs() == greatest);
    (at.unwrap_or(0), greatest)
}

/// Which `count` columns of ρ are absorbed, in order: always the one of least Π(1 + R_i) − 1 − Σ R_i,
/// R = |ρ| divided by the stretch so far.
fn absorption_order(rho: &Matrix, count: usize) -> List<usize> {
    let (n, p) = (rho.rows(), rho.cols());
    let mut left: List<usize> = (0..p).collect();
    let mut ratio = rho.abs();
    let (mut product, mut sum) = (List::filled(0.0, p), List::filled(0.0, p));
    let mut order = List::with_capacity(count);
    for _ in 0..count {
        let len = left.len();
        product[..len].fill(1.0);
        sum[..len].fill(0.0);
        for i in 0..n {
            for ((f, s), &r) in product
                .iter_mut()
                .zip(sum.iter_mut())
                .zip(&ratio.row(i)[..len])
            {
                *f *= 1.0 + r;
                *s += r;
            }
        }
        ops::count(n * (2 * len - 1), 2 * (n + 1) * len + n - len);
        ops::compared(len);
        let mut best = (f64::INFINITY, 0);
        for k in 0..len {
            let increase = product[k] - 1.0 - sum[k];
            if increase < best.0 {
                best = (increase, k);
            }
        }
        let k = best.1;
        order.push(left.remove(k));
        for i in 0..n {
            let row = &mut ratio.row_mut(i)[..len];
            let shrink = 1.0 / (1.0 + row[k]);
            row.copy_within(k + 1.., k);
            row[..len - 1].iter_mut().for_each(|r| *r *= shrink);
        }
    }
    order
}
