//! Combastel's reduction: keep the longest generators, box the rest.
//!
//! Source: C. Combastel, "A state bounding observer for uncertain non-linear continuous-time systems
//! based on zonotopes", CDC-ECC 2005, in the form that \[dePaula\] and [Li, Remark 1] use.

use super::{reduce_by, reduce_columns_by};
use crate::{List, Matrix, SetError, Zonotope, ops};

/// Encloses `z` in a zonotope of at most `generators` generators.
///
/// Keeps the `generators` − n columns of greatest ‖g‖₂ as K, in their order, and boxes the rest, L:
/// ⟨c, G, r⟩ ⊆ ⟨c, [K, diag(⌈|L| 1 + r⌉)], 0⟩. Of equally long columns those of lower index are kept. Which are long
/// depends on the components' units.
///
/// Contains `z`; `z` itself, r included, if p ≤ `generators`. The interval hull is that of `z` up to
/// rounding. Fails with `Range` if `generators` < n.
pub fn reduce(z: &Zonotope, generators: usize) -> Result<Zonotope, SetError> {
    reduce_by(z, generators, "Combastel's reduction", squared_lengths)
}

/// [K, diag(|L| 1)] of exactly `columns` columns, rounded to nearest; `g` itself if p ≤ `columns`.
///
/// K and L are those of [`reduce`]. The row sums of |G| are unchanged up to rounding. `columns` ≥ n is
/// the caller's duty.
pub fn reduce_columns(g: &Matrix, columns: usize) -> Matrix {
    reduce_columns_by(g, columns, squared_lengths)
}

/// ‖g_j‖₂² of every column, summed in ascending row.
fn squared_lengths(g: &Matrix) -> List<f64> {
    ops::count(g.rows() * g.cols(), g.rows().saturating_sub(1) * g.cols());
    let mut lengths = List::filled(0.0, g.cols());
    for i in 0..g.rows() {
        for (length, &x) in lengths.iter_mut().zip(g.row(i)) {
            *length += x * x;
        }
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_column_stays_and_the_others_become_a_box() {
        let g = Matrix::from_rows(&[[1.0, 3.0, -1.0, 0.5], [1.0, 4.0, 1.0, 0.0]]).unwrap();
        let expected = Matrix::from_rows(&[[3.0, 2.5, 0.0], [4.0, 0.0, 2.0]]).unwrap();
        assert_eq!(reduce_columns(&g, 3), expected);
        assert_eq!(reduce_columns(&g, 4), g);
        assert_eq!(
            reduce_columns(&g, 2),
            Matrix::diagonal(&[5.5, 6.0]),
            "with no column kept the box is the interval hull"
        );
    }

    #[test]
    fn kept_columns_stay_in_their_order_and_ties_go_to_the_lower_index() {
        let g = Matrix::from_rows(&[[1.0, -5.0, 2.0, 5.0, 2.0, -2.0]]).unwrap();
        let expected = Matrix::from_rows(&[[-5.0, 2.0, 5.0, 5.0]]).unwrap();
        assert_eq!(reduce_columns(&g, 4), expected);
    }

    #[test]
    fn the_box_takes_the_rounding_box_in() {
        let g = Matrix::from_rows(&[[8.0, 1.0, 1.0]]).unwrap();
        let z = Zonotope::with_rounding(vec![0.0], g, vec![0.5]).unwrap();
        let reduced = reduce(&z, 2).unwrap();
        assert_eq!(reduced.g()[(0, 0)], 8.0);
        assert!(reduced.g()[(0, 1)] >= 2.5 && reduced.g()[(0, 1)] < 2.5 + 1e-14);
        assert_eq!(reduced.r(), [0.0]);
        assert_eq!(reduce(&z, 3).unwrap(), z);
        assert!(matches!(reduce(&z, 0), Err(SetError::Range { .. })));
    }
}
