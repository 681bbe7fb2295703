//! Girard's reduction: keep the generators that a box would enclose worst, box the rest.
//!
//! Source: A. Girard, "Reachability of uncertain linear systems using zonotopes", HSCC 2005.

use super::{reduce_by, reduce_columns_by};
use crate::{List, Matrix, SetError, Zonotope, ops};

/// Encloses `z` in a zonotope of at most `generators` generators.
///
/// Keeps the `generators` − n columns of greatest ‖g‖₁ − ‖g‖∞ as K, in their order, and boxes the
/// rest, L: ⟨c, G, r⟩ ⊆ ⟨c, [K, diag(⌈|L| 1 + r⌉)], 0⟩. The key is 0 for a column along an axis, which a
/// box encloses exactly. Of equal keys those of lower index are kept. The key depends on the components' units:
/// [`reduce_scaled`].
///
/// Contains `z`; `z` itself, r included, if p ≤ `generators`. The interval hull is that of `z` up to
/// rounding. Fails with `Range` if `generators` < n.
pub fn reduce(z: &Zonotope, generators: usize) -> Result<Zonotope, SetError> {
    reduce_by(z, generators, "Girard's reduction", distances_from_axes)
}

/// As [`reduce`], with every row measured in units of its half-width |G|_i 1: the key is
/// Σ_i |g_i|/h_i − max_i |g_i|/h_i.
///
/// Which generators are kept then does not depend on the units of the components, rad and m for instance.
/// Not in the source.
pub fn reduce_scaled(z: &Zonotope, generators: usize) -> Result<Zonotope, SetError> {
    reduce_by(z, generators, "Girard's reduction", scaled_distances)
}

/// As [`reduce_columns`], with the key of [`reduce_scaled`].
pub fn reduce_columns_scaled(g: &Matrix, columns: usize) -> Matrix {
    reduce_columns_by(g, columns, scaled_distances)
}

/// [K, diag(|L| 1)] of exactly `columns` columns, rounded to nearest; `g` itself if p ≤ `columns`.
///
/// K and L are those of [`reduce`]. `columns` ≥ n is the caller's duty.
pub fn reduce_columns(g: &Matrix, columns: usize) -> Matrix {
    reduce_columns_by(g, columns, distances_from_axes)
}

/// ‖g_j‖₁ − ‖g_j‖∞ of every column, summed in ascending row.
fn distances_from_axes(g: &Matrix) -> List<f64> {
    ops::count(0, g.rows() * g.cols());
    distances(g, |_, x| x.abs())
}

/// The same of diag(|G| 1)⁻¹ G. A row of zeros stays one.
fn scaled_distances(g: &Matrix) -> List<f64> {
    ops::count(g.rows() * g.cols() + g.rows(), g.rows() * g.cols());
    let units: List<f64> = g
        .abs_row_sums()
        .iter()
        .map(|&h| if h > 0.0 { 1.0 / h } else { 0.0 })
        .collect();
    distances(g, |i, x| x.abs() * units[i])
}

fn distances(g: &Matrix, length: impl Fn(usize, f64) -> f64) -> List<f64> {
    let mut sums = List::filled(0.0, g.cols());
    let mut maxima = List::filled(0.0_f64, g.cols());
    for i in 0..g.rows() {
        for ((sum, max), &x) in sums.iter_mut().zip(&mut maxima).zip(g.row(i)) {
            let x = length(i, x);
            *sum += x;
            *max = max.max(x);
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
    fn the_scaled_choice_does_not_depend_on_the_units() {
        let g = Matrix::from_fn(3, 12, |i, j| ((7 * i + 5 * j * j + j) % 11) as f64 - 5.0);
        let units = [0.25, 8.0, 1024.0];
        let other = Matrix::from_fn(3, 12, |i, j| units[i] * g[(i, j)]);
        let (a, b) = (
            reduce_columns_scaled(&g, 6),
            reduce_columns_scaled(&other, 6),
        );
        for j in 0..6 {
            for (i, unit) in units.iter().enumerate() {
                assert_eq!(b[(i, j)], unit * a[(i, j)]);
            }
        }
        assert_ne!(reduce_columns(&g, 6), a, "here the units matter");
    }

    #[test]
    fn a_long_column_along_an_axis_goes_before_a_short_diagonal_one() {
        let g = Matrix::from_rows(&[[9.0, 1.0, 0.25], [0.0, 1.0, 0.5]]).unwrap();
        let expected = Matrix::from_rows(&[[1.0, 9.25, 0.0], [1.0, 0.0, 0.5]]).unwrap();
        // p = 3 is not above 3, so one more column along an axis forces the choice.
        let g = Matrix::hcat(&[&g, &Matrix::column(&[0.0, 0.0])]);
        assert_eq!(reduce_columns(&g, 3), expected);
    }
}
