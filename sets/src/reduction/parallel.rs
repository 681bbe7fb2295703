//! Merging parallel generators: fewer of them for the same set.
//!
//! {g ξ₁ + λ g ξ₂} = {(1 + |λ|) g ζ}, so parallel generators are one. A filter whose gain depends on
//! tr(G Gᵀ) sees the difference: the trace underweights many short generators that are parallel, and
//! the prediction with an interval matrix makes such lists [dePaula, Prop. 1].

use crate::rounding::{U, gamma, up};
use crate::{List, Matrix, SetError, Zonotope, ops, units};

/// Encloses `z` with generators merged that are parallel up to `tolerance`.
///
/// Rows are taken in units of their own, the powers of two at or below their greatest entries, so that the units of the
/// components do not matter; what follows is about the rows in these units.
///
/// A generator's direction is q = g / g_m with m the first row of greatest |g|, so q_m = 1. Generators
/// of the same m whose directions differ by at most `tolerance` in every row are merged into S q, with
/// S = Σ_j |g_jm| and q the direction of one of them. g_j = g_jm q + e_j holds for any q, so the rounding
/// box takes ⌈Σ_j |e_j|⌉ and the rounding of S q: r grows by at most `tolerance` · S and some u · S.
/// A merged generator stands where the first of its members stood; zero generators go.
///
/// Tolerance 0 merges those with the same rounded direction, all exactly parallel ones among them.
/// Contains `z`. Fails with `Range` if `tolerance` is negative or NaN, `NotFinite` on overflow.
pub fn merge(z: &Zonotope, tolerance: f64) -> Result<Zonotope, SetError> {
    const OP: &str = "merging of parallel generators";
    if tolerance.is_nan() || tolerance < 0.0 {
        return Err(SetError::Range {
            op: OP,
            what: "tolerance",
            expected: "nonnegative",
            got: tolerance,
        });
    }
    let largest = |i: usize| z.g().row(i).iter().fold(0.0_f64, |l, x| l.max(x.abs()));
    let largest: List<f64> = (0..z.dim()).map(largest).collect();
    let units = units::of_set(z.c(), &largest);
    let scaled = z.divided_by(&units)?;
    let (g, remainder) = merged(scaled.g(), tolerance);
    let r: List<f64> = scaled
        .r()
        .iter()
        .zip(&remainder)
        .map(|(&r, &e)| if e == 0.0 { r } else { up(r + e, 1) })
        .collect();
    Zonotope::checked(OP, scaled.c(), g, r)?.multiplied_by(&units)
}

/// The columns of [`merge`] of a bare matrix; the remainder, at most `tolerance` · S and rounding, is lost.
pub fn merge_columns(g: &Matrix, tolerance: f64) -> Matrix {
    let units = units::of_rows(g);
    let (merged, _) = merged(&units::divided_rows(g, &units), tolerance);
    units::multiplied_rows(&merged, &units)
}

/// The merged columns and the remainder of each row, rounded up.
fn merged(g: &Matrix, tolerance: f64) -> (Matrix, Vec<f64>) {
    let n = g.rows();
    let groups = groups(g, tolerance);
    let mut out = Matrix::zeros(n, groups.len());
    let mut remainder = vec![0.0; n];
    for (column, group) in groups.iter().enumerate() {
        if let [j] = group.members[..] {
            for i in 0..n {
                out[(i, column)] = g[(i, j)];
            }
            continue;
        }
        let (m, s) = (group.pivot, group.members.len());
        let length: f64 = group.members.iter().map(|&j| g[(m, j)].abs()).sum();
        ops::count(n * (s + 1), (n + 1) * s);
        for i in 0..n {
            let q = group.direction[i];
            let merged = length * q;
            out[(i, column)] = merged;
            // S is off by γ_s S, and S q by one more rounding.
            let own = gamma(s + 1) * merged.abs();
            let left: f64 = group
                .members
                .iter()
                .filter(|_| i != m)
                .map(|&j| {
                    let along = g[(m, j)] * q;
                    let e = g[(i, j)] - along;
                    e.abs() + U * (e.abs() + along.abs())
                })
                .sum();
            remainder[i] = up(remainder[i] + left + own, s + 6);
        }
    }
    (out, remainder)
}

/// Generators to be merged: row of the greatest entry, direction, members in ascending order.
struct Group {
    pivot: usize,
    direction: Vec<f64>,
    members: Vec<usize>,
}

/// Groups of columns of the same direction, in the order of their first members.
///
/// Columns are sorted by pivot and direction, so those near a column follow it as long as their first
/// row stays within the tolerance.
fn groups(g: &Matrix, tolerance: f64) -> Vec<Group> {
    let directed: Vec<(usize, usize, Vec<f64>)> = {
        let mut directed: Vec<_> = (0..g.cols()).filter_map(|j| direction(g, j)).collect();
        let mut compared = 0;
        directed.sort_by(|(j, m, q), (k, l, p)| {
            compared += 1;
            let by_direction = || q.iter().zip(p).map(|(a, b)| a.total_cmp(b));
            m.cmp(l)
                .then_with(|| by_direction().find(|o| o.is_ne()).unwrap_or(j.cmp(k)))
        });
        ops::compared(compared);
        directed
    };
    let mut taken = vec![false; directed.len()];
    let mut groups = Vec::new();
    for start in 0..directed.len() {
        if taken[start] {
            continue;
        }
        let (_, pivot, direction) = &directed[start];
        let first_row = usize::from(*pivot == 0 && direction.len() > 1);
        let mut members = Vec::new();
        for (at, (j, m, q)) in directed.iter().enumerate().skip(start) {
            if m != pivot || q[first_row] - direction[first_row] > tolerance {
                break;
            }
            let near = q
                .iter()
                .zip(direction)
                .all(|(a, b)| (a - b).abs() <= tolerance);
            if near && !taken[at] {
                taken[at] = true;
                members.push(*j);
            }
        }
        members.sort_unstable();
        groups.push(Group {
            pivot: *pivot,
            direction: direction.clone(),
            members,
        });
    }
    groups.sort_by_key(|group| group.members[0]);
    groups
}

/// (j, m, g_j / g_mj) with m the first row of greatest |g_j|; `None` for a zero column.
fn direction(g: &Matrix, j: usize) -> Option<(usize, usize, Vec<f64>)> {
    let m = (0..g.rows()).fold(0, |m, i| match g[(i, j)].abs() > g[(m, j)].abs() {
        true => i,
        false => m,
    });
    // Adding 0 turns −0 into 0, so that equal directions have equal bits.
    (g[(m, j)] != 0.0).then(|| {
        let q = (0..g.rows()).map(|i| g[(i, j)] / g[(m, j)] + 0.0);
        (j, m, q.collect())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallel_columns_become_one_where_the_first_of_them_stood() {
        let g = Matrix::from_rows(&[
            [1.0, 1.0, -2.0, 0.0, 0.0, 0.0],
            [0.0, 2.0, -4.0, 3.0, 0.0, -1.0],
        ])
        .unwrap();
        let expected = Matrix::from_rows(&[[1.0, 3.0, 0.0], [0.0, 6.0, 4.0]]).unwrap();
        assert_eq!(merge_columns(&g, 0.0), expected);
    }

    #[test]
    fn columns_that_are_parallel_only_before_rounding_need_a_tolerance() {
        let g = Matrix::from_rows(&[[1.0, 3.0], [0.1, 0.1 * 3.0]]).unwrap();
        assert_eq!(merge_columns(&g, 0.0).cols(), 2, "0.1 · 3 ≠ 0.3");
        let z = Zonotope::new(vec![0.0; 2], g).unwrap();
        let merged = merge(&z, 1e-12).unwrap();
        assert_eq!(merged.generators(), 1);
        assert!(merged.r().iter().all(|&r| r < 1e-14));
    }

    #[test]
    fn what_two_directions_differ_by_goes_to_the_box() {
        // In units of the rows, 2 and 4, the directions are (1, 0), (1, ⅛), (0, 1).
        let g = Matrix::from_rows(&[[2.0, 2.0, 0.0], [0.0, 0.5, 4.0]]).unwrap();
        let z = Zonotope::new(vec![0.0; 2], g).unwrap();
        assert_eq!(merge(&z, 0.1).unwrap().generators(), 3);
        let merged = merge(&z, 0.25).unwrap();
        assert_eq!(
            merged.g(),
            &Matrix::from_rows(&[[4.0, 0.0], [0.0, 4.0]]).unwrap()
        );
        assert!(merged.r()[1] >= 0.5 && merged.r()[1] < 0.5 + 1e-14);
        assert!(merge(&z, -1.0).is_err());
        assert!(merge(&z, f64::NAN).is_err());
    }

    #[test]
    fn columns_apart_in_a_later_row_only_are_not_merged() {
        let g = Matrix::from_rows(&[[1.0, 1.0, 1.0], [0.5, 0.5, 0.5], [0.1, -0.7, 0.1]]).unwrap();
        assert_eq!(merge_columns(&g, 1e-9).cols(), 2);
    }
}
