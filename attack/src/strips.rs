//! Intersections that are barely not empty and barely empty.

use crate::campaign::Counts;
use crate::hulls::Source;
use zonobench_sets::{ConstrainedZonotope, Matrix, SetError, Zonotope};

/// The margins 2⁻³ … 2⁻⁵⁰, about 10⁻¹ to 10⁻¹⁵, relative to the extent of the set.
pub const MARGINS: [i32; 6] = [3, 10, 20, 30, 40, 50];

/// Cuts the `sets` zonotopes from number `first` on with a half-space that leaves a sliver, and beside it one that leaves nothing.
///
/// With s the support in a direction of small integers, the first half-space reaches down to s − m and
/// the second to s + m, m = 2^−`margin`; both are exact in f64. Lost is a sliver that is called empty or
/// whose hull cuts off the vertex that it holds; undecided is a nothing that is not called empty.
pub fn near_empty(margin: i32, first: u64, sets: u64) -> Counts {
    let m = f64::from_bits(((1023 - i64::from(margin)) as u64) << 52);
    let mut counts = Counts::default();
    for i in first..first + sets {
        let mut s = Source(((margin as u64) << 40) | i);
        let (n, p) = (s.size(1, 4), s.size(4, 12));
        // Multiples of 2⁻⁶ and a support below 2: s ± m has at most 52 bits behind the point.
        let g = Matrix::from_fn(n, p, |_, _| (s.below(3) as f64 - 1.0) / 64.0);
        let d: Vec<f64> = (0..n).map(|_| s.below(3) as f64 - 1.0).collect();
        let slope: Vec<f64> = (0..p)
            .map(|j| (0..n).map(|i| d[i] * g[(i, j)]).sum())
            .collect();
        let support: f64 = slope.iter().map(|x: &f64| x.abs()).sum();
        let xi: Vec<f64> = slope
            .iter()
            .map(|&x| if x < 0.0 { -1.0 } else { 1.0 })
            .collect();
        let vertex = g.mul_vec(&xi);
        let zonotope = Zonotope::new(vec![0.0; n], g).expect("the shapes fit");
        let set = ConstrainedZonotope::from(zonotope);
        let down: Vec<f64> = d.iter().map(|d| -d).collect();
        let sliver = set
            .intersect_halfspace(&down, -(support - m))
            .expect("the shapes fit");
        counts.steps += 1;
        let hull = sliver.interval_hull();
        counts.empty += u64::from(matches!(hull, Err(SetError::Empty { .. })));
        let holds = hull.is_ok_and(|hull| {
            hull.iter()
                .zip(&vertex)
                .all(|(side, &x)| side.lo() <= x && x <= side.hi())
        });
        counts.lost += u64::from(!holds);
        let nothing = set.intersect_halfspace(&down, -(support + m));
        counts.steps += 1;
        counts.undecided += u64::from(nothing.is_ok_and(|set| set.interval_hull().is_ok()));
    }
    counts
}
