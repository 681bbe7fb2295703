//! Girard's reduction: keep the generators that a box would enclose worst, box the rest.
//!
//! Source: A. Girard, "Reachability of uncertain linear systems using zonotopes", HSCC 2005.

use super::{reduce_by, reduce_columns_by};
use crate::{Matrix, SetError, Zonotope, ops};

/// Encloses `z` in a zonotope of at most `generators` generators.
///
/// Keeps the `generators` − n columns of greatest ‖g‖₁ − ‖g‖∞ as K, in their order, and boxes the
/// rest, L: ⟨c, G, r⟩ ⊆ ⟨c, [K, diag(⌈|L| 1 + r⌉)], 0⟩. The key is 0 for a column along an axis, which a
/// box encloses exactly. Of equal keys those of lower index are kept.
///
/// Contains `z`; `z` itself, r included, if p ≤ `generators`. The interval hull is that of `z` up to
/// rounding. Fails with `Range` if `generators` < n.
pub fn reduce(z: &Zonotope, generators: usize) -> Result<Zonotope, SetError> {
    reduce_by(z, generators, "Girard's reduction", distances_from_axes)
}

/// [K, diag(|L| 1)] of exactly `columns` columns, rounded to nearest; `g` itself if p ≤ `columns`.
///
/// K and L are those of [`reduce`]. `columns` ≥ n is the caller's duty.
pub fn reduce_columns(g: &Matrix, columns: usize) -> Matrix {
    reduce_columns_by(g, columns, distances_from_axes)
}

/// ‖g_j‖₁ − ‖g_j‖∞ of every column, summed in ascending row.
fn distances_from_axes(g: &Matrix) -> Vec<f64> {
    ops::count(0, g.rows() * g.cols());
    let mut sums = vec![0.0; g.cols()];
    let mut maxima = vec![0.0_f64; g.cols()];
    for i in 0..g.rows() {
        for ((sum, max), &x) in sums.iter_mut().zip(&mut maxima).zip(g.row(i)) {
            *sum += x.abs();
            *max = max.max(x.abs());
        }
    }
    sums.iter()
        .zip(&maxima)
        .map(|(sum, max)| sum - max)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_column_along_an_axis_goes_before_a_short_diagonal_one() {
        let g = Matrix::from_rows(&[[9.0, 1.0, 0.25], [0.0, 1.0, 0.5]]).unwrap();
        let expected = Matrix::from_rows(&[[1.0, 9.25, 0.0], [1.0, 0.0, 0.5]]).unwrap();
        // p = 3 is not above 3, so one more column along an axis forces the choice.
        let g = Matrix::hcat(&[&g, &Matrix::column(&[0.0, 0.0])]);
        assert_eq!(reduce_columns(&g, 3), expected);
    }
}
