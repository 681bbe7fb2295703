//! Order reduction: enclosing a zonotope in one of fewer generators.
//!
//! One method, one paper, one file. All of them keep some generators as they are and put the rest into
//! a box; they differ in the key by which a generator is worth keeping. That common part is here.
//! These keys are norms over the components of a generator, as are the block of [`yang_scott`] and the scores of [`scott`]:
//! by their definitions they add lengths to angles, and which generators are kept depends on the components' units. Where
//! it should not, reduce in units of the state ([`Zonotope::divided_by`]; the setting `scale` of the estimators), or by
//! [`girard::reduce_scaled`]. [`parallel`] compares no components.
//!
//! Each method has two faces: `reduce` for sets, sound under rounding, and `reduce_columns` for bare
//! generator matrices, rounded to nearest, for filters that guarantee nothing.

pub mod combastel;
pub mod girard;
pub mod parallel;
pub mod scott;
pub mod yang_scott;

use crate::matrix::abs_sum;
use crate::{List, Matrix, SetError, Zonotope, ops, rounding};

/// The methods that reduce a zonotope to a number of generators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reduction {
    /// Keeps the longest generators, [`combastel`].
    Combastel,
    /// Keeps the generators of greatest ‖g‖₁ − ‖g‖∞, [`girard`].
    Girard,
}

impl Reduction {
    /// A zonotope of at most `generators` generators that contains `z`; `z` itself if it has no more.
    ///
    /// Fails with `Range` if `generators` < n.
    pub fn reduce_order(self, z: &Zonotope, generators: usize) -> Result<Zonotope, SetError> {
        match self {
            Self::Combastel => combastel::reduce(z, generators),
            Self::Girard => girard::reduce(z, generators),
        }
    }

    /// The same on a bare matrix, rounded to nearest: exactly `columns` columns if `g` has more, else
    /// `g`. `columns` ≥ rows is the caller's duty.
    pub fn reduce_columns(self, g: &Matrix, columns: usize) -> Matrix {
        match self {
            Self::Combastel => combastel::reduce_columns(g, columns),
            Self::Girard => girard::reduce_columns(g, columns),
        }
    }
}

/// Which `keep` entries are greatest; of equal keys, those of lower index.
///
/// Keys are nonnegative, so their bit patterns have their order: selecting on integers takes time
/// linear in the number of keys and gives the same answer for any input, NaN included.
fn greatest(keys: &[f64], keep: usize) -> List<bool> {
    if keep == 0 || keep >= keys.len() {
        return List::filled(keep != 0, keys.len());
    }
    let mut bits: List<u64> = keys.iter().map(|key| key.to_bits()).collect();
    let cut = bits.len() - keep;
    let mut compared = 0;
    let (_, &mut least_kept, above) = bits.select_nth_unstable_by(cut, |a, b| {
        compared += 1;
        a.cmp(b)
    });
    ops::compared(compared);
    let ties = 1 + above.iter().filter(|&&b| b == least_kept).count();
    let mut kept: List<bool> = keys.iter().map(|key| key.to_bits() > least_kept).collect();
    let tied = |&(_, key): &(&mut bool, &f64)| key.to_bits() == least_kept;
    for (k, _) in kept.iter_mut().zip(keys).filter(tied).take(ties) {
        *k = true;
    }
    kept
}

/// [K, diag(b)] with K the columns of `g` that are `kept`, in their order, and b_i = `side`(i, s_i) for
/// s_i the sum of |g_ij| over the others, computed with at most p/8 + 4 additions in a row.
fn box_the_rest(g: &Matrix, kept: &[bool], side: impl Fn(usize, f64) -> f64) -> Matrix {
    let (n, p) = (g.rows(), g.cols());
    // Which columns are kept is unpredictable, so the index is always written and the end moves or not.
    let mut indices = List::filled(0, p);
    let mut count = 0;
    for (j, &k) in kept.iter().enumerate() {
        indices[count] = j;
        count += usize::from(k);
    }
    indices.truncate(count);
    let mut out = Matrix::zeros(n, indices.len() + n);
    let mut rest = List::filled(0.0, p);
    for i in 0..n {
        let row = g.row(i);
        for ((r, &x), &k) in rest.iter_mut().zip(row).zip(kept) {
            *r = if k { 0.0 } else { x };
        }
        let target = out.row_mut(i);
        for (t, &j) in target.iter_mut().zip(&indices) {
            *t = row[j];
        }
        target[indices.len() + i] = side(i, abs_sum(&rest));
    }
    ops::count(0, n * (p - indices.len()).saturating_sub(1));
    out
}

/// The reduction by `key` of a bare matrix.
fn reduce_columns_by(g: &Matrix, columns: usize, key: impl Fn(&Matrix) -> List<f64>) -> Matrix {
    assert!(
        columns >= g.rows(),
        "a reduction to {columns} columns is asked of a matrix of {} rows: settings are checked before",
        g.rows()
    );
    if g.cols() <= columns {
        return g.clone();
    }
    let _stage = ops::stage(ops::Stage::Reduction);
    let kept = greatest(&key(g), columns - g.rows());
    box_the_rest(g, &kept, |_, sum| sum)
}

/// The reduction by `key` of a zonotope: the box takes ⌈row sums⌉ and r.
fn reduce_by(
    z: &Zonotope,
    generators: usize,
    op: &'static str,
    key: impl Fn(&Matrix) -> List<f64>,
) -> Result<Zonotope, SetError> {
    let (n, p) = (z.dim(), z.generators());
    if generators < n {
        return Err(SetError::Range {
            op,
            what: "number of generators",
            expected: "at least the dimension",
            got: generators as f64,
        });
    }
    if p <= generators {
        return Ok(z.clone());
    }
    let _stage = ops::stage(ops::Stage::Reduction);
    let kept = greatest(&key(z.g()), generators - n);
    let depth = p / 8 + 5;
    let g = box_the_rest(z.g(), &kept, |i, sum| rounding::up(sum + z.r()[i], depth));
    Zonotope::checked(op, z.c(), g, List::filled(0.0, n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_equal_keys_the_first_are_kept() {
        assert_eq!(
            greatest(&[1.0, 2.0, 1.0, 3.0, 1.0], 3),
            [true, true, false, true, false]
        );
        assert_eq!(greatest(&[0.0; 4], 2), [true, true, false, false]);
        assert_eq!(greatest(&[1.0, 2.0], 0), [false, false]);
        assert_eq!(greatest(&[1.0, 2.0], 2), [true, true]);
    }

    #[test]
    fn selection_agrees_with_a_stable_sort() {
        // Keys from a small range, so that ties are many.
        let keys: Vec<f64> = (0..500u32).map(|j| f64::from(j * j % 37)).collect();
        let mut sorted: Vec<usize> = (0..keys.len()).collect();
        sorted.sort_by(|&a, &b| keys[b].total_cmp(&keys[a]));
        for keep in [1, 7, 100, 499] {
            let kept = greatest(&keys, keep);
            let mut expected = vec![false; keys.len()];
            sorted[..keep].iter().for_each(|&j| expected[j] = true);
            assert_eq!(kept, expected);
        }
    }
}
