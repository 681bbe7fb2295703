//! Two dimensions: vertices and area from the generators sorted by angle, and membership decided by the
//! half-spaces of the edges.
//!
//! A zonogon is walked around by its own generators: from its lowest vertex, 2 g for every generator g
//! in ascending angle of [0, π), and back by symmetry. Sorting makes everything here O(p log p).

use super::{Zonotope, same};
use crate::rounding::gamma;
use crate::{Containment, Interval, List, Matrix, SetError, units};

impl Zonotope {
    /// The vertices of a zonotope of the plane, counter-clockwise from the lowest (of two lowest, the
    /// left one).
    ///
    /// Parallel generators (to 4 units of rounding in the slope) share an edge, so there are 2 m vertices
    /// for m directions; a segment has 2 and a point 1. Rounded to nearest: vertices are for drawing and
    /// measuring, not a bound; r does not enter. Fails with `Dimension` unless n = 2.
    pub fn vertices(&self) -> Result<Vec<[f64; 2]>, SetError> {
        same("vertices", 2, self.dim())?;
        // In units of the rows no product of two components overflows or vanishes.
        let units = units::of_rows(&self.g);
        let scaled = upper_half(&units::divided_rows(&self.g, &units));
        let edges = edges(sorted(scaled, &[1.0, 1.0]));
        let [x, y] = [self.c[0], self.c[1]];
        if edges.is_empty() {
            return Ok(vec![[x, y]]);
        }
        let mut offset = edges
            .iter()
            .fold([0.0, 0.0], |o, e| [o[0] - e[0], o[1] - e[1]]);
        let mut offsets = Vec::with_capacity(edges.len());
        for e in &edges {
            offsets.push(offset);
            offset = [offset[0] + 2.0 * e[0], offset[1] + 2.0 * e[1]];
        }
        let own = |o: &[f64; 2]| [o[0] * units[0], o[1] * units[1]];
        let there = offsets.iter().map(own).map(|o| [x + o[0], y + o[1]]);
        let back = offsets.iter().map(own).map(|o| [x - o[0], y - o[1]]);
        Ok(there.chain(back).collect())
    }

    /// The area of ⟨c, G⟩ in the plane, 4 Σ_{i<j} |det(g_i, g_j)|, from the sums of the sorted generators.
    pub(super) fn area(&self) -> f64 {
        let units = units::of_rows(&self.g);
        let mut before = [0.0, 0.0];
        let mut area = 0.0;
        let scaled = upper_half(&units::divided_rows(&self.g, &units));
        for h in sorted(scaled, &[1.0, 1.0]) {
            area += (before[0] * h[1] - before[1] * h[0]).max(0.0);
            before = [before[0] + h[0], before[1] + h[1]];
        }
        units::times(4.0 * area, &units)
    }

    /// Whether the set contains c + o for every o in the box `offset`, n = 2.
    ///
    /// X − c is the intersection of |dᵀo| ≤ ρ(X − c, d) over the normals d of all generators, rounding
    /// box included; for a segment or a point the axes must be added, and they never harm. The
    /// normal (−g_y, g_x) is exact. A lower bound on ρ at it is dᵀv for any v = Σ ± g_k; with the
    /// generators sorted by angle the best v is a difference of prefix sums, so all lower bounds take
    /// O(p). An imprecise order makes them worse, never wrong. The upper bound is evaluated at
    /// the one normal that separates best.
    pub(super) fn contains_planar(&self, offset: &[Interval]) -> Containment {
        let folded = Matrix::hcat(&[&self.g, &super::box_columns(&self.r)]);
        let sorted = sorted(upper_half(&folded), &units::of_rows(&folded));
        let mut prefix = Vec::with_capacity(sorted.len() + 1);
        prefix.push([0.0, 0.0]);
        for (j, h) in sorted.iter().enumerate() {
            let [x, y]: [f64; 2] = prefix[j];
            prefix.push([x + h[0], y + h[1]]);
        }
        let total = prefix[sorted.len()];
        let radius = self.radius();
        // Three sums, each off by at most γ_p |G| 1 and below (1 + γ_p) |G| 1, and two subtractions.
        let off = 4.0 * gamma(sorted.len() + 4);
        let mut inside = (0..2).all(|i| offset[i].mag() <= self.least_radius(i));
        let mut best: Option<(f64, [f64; 2])> = None;
        for (j, h) in sorted.iter().enumerate() {
            let d = [-h[1], h[0]];
            let vertex = |i: usize| {
                let v = (total[i] - prefix[j + 1][i]) - prefix[j][i];
                Interval::from_center_radius(v, (off * radius[i]).next_up())
            };
            let least = (vertex(0) * d[0] + vertex(1) * d[1]).lo();
            let reach = (offset[0] * d[0] + offset[1] * d[1]).abs();
            inside &= reach.hi() <= least;
            // Beside the largest that reach can be in the set, whatever the units.
            let excess = (reach.lo() - least) / (d[0].abs() * radius[0] + d[1].abs() * radius[1]);
            if excess > best.map_or(0.0, |(e, _)| e) {
                best = Some((excess, d));
            }
        }
        if inside {
            return Containment::Inside;
        }
        let outside = best.is_some_and(|(_, d)| {
            let reach = (offset[0] * d[0] + offset[1] * d[1]).abs();
            let centered = Self {
                c: List::filled(0.0, 2),
                ..self.clone()
            };
            centered.support(&d).is_ok_and(|bound| reach.lo() > bound)
        });
        if outside {
            Containment::Outside
        } else {
            Containment::Undecided
        }
    }
}

/// The nonzero columns, each with the sign that turns it into the angles [0, π).
fn upper_half(g: &Matrix) -> Vec<[f64; 2]> {
    let mut turned = Vec::with_capacity(g.cols());
    for (&x, &y) in g.row(0).iter().zip(g.row(1)) {
        if x != 0.0 || y != 0.0 {
            turned.push(match y > 0.0 || (y == 0.0 && x > 0.0) {
                true => [x, y],
                false => [-x, -y],
            });
        }
    }
    turned
}

/// Sorted by their angle in `units`. The key is a quotient rounded once (and a sum rounded once), hence monotone in the
/// angle: only generators of the same rounded slope can be out of order. Many would be in a set much longer than wide,
/// where all slopes are near 0: hence the units.
fn sorted(mut generators: Vec<[f64; 2]>, units: &[f64]) -> Vec<[f64; 2]> {
    // Up to so many, counting the keys before each one is faster than sorting them.
    const FEW: usize = 64;
    let key = |&[x, y]: &[f64; 2]| {
        let (x, y) = (x / units[0], y / units[1]);
        if x >= y {
            y / x
        } else if x > -y {
            2.0 - x / y
        } else {
            4.0 + y / x
        }
    };
    if generators.len() <= FEW {
        let keys: Vec<f64> = generators.iter().map(key).collect();
        let mut places = vec![[0.0; 2]; generators.len()];
        for (i, (&own, &g)) in keys.iter().zip(&generators).enumerate() {
            let equal_too = keys[..i].iter().filter(|&&k| k <= own).count();
            let below = keys[i + 1..].iter().filter(|&&k| k < own).count();
            places[equal_too + below] = g;
        }
        return places;
    }
    // Nonnegative numbers are ordered as their bits; adding 0 turns −0 into 0.
    generators.sort_by_cached_key(|g| (key(g) + 0.0).to_bits());
    generators
}

/// Sums of neighbouring parallel generators, the last and the first being neighbours too.
fn edges(sorted: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let parallel = |a: [f64; 2], b: [f64; 2]| {
        let (ab, ba) = (a[0] * b[1], a[1] * b[0]);
        (ab - ba).abs() <= 4.0 * f64::EPSILON * (ab.abs() + ba.abs())
    };
    let mut edges: Vec<[f64; 2]> = Vec::new();
    for h in sorted {
        match edges.last_mut() {
            Some(last) if parallel(*last, h) => *last = [last[0] + h[0], last[1] + h[1]],
            _ => edges.push(h),
        }
    }
    if let [first, .., last] = edges[..]
        && parallel(first, last)
    {
        // Near π the last one points against the first.
        edges[0] = [first[0] - last[0], first[1] - last[1]];
        edges.pop();
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hexagon_is_one_at_any_size() {
        for (s, t) in [
            (1.0, 1.0),
            (1e160, 1e160),
            (1e-170, 1e-170),
            (1e160, 1e-170),
            (1e3, 1e-3),
        ] {
            let z = zonotope([0.0, 0.0], &[&[s, 0.0, s], &[0.0, t, t]]);
            let v = z.vertices().unwrap();
            assert_eq!(v.len(), 6, "{s:e} {t:e}");
            assert!(
                v.contains(&[2.0 * s, 2.0 * t]) && v.contains(&[2.0 * s, 0.0]),
                "{v:?}"
            );
            if s * t > 0.0 && s * t < 1e300 {
                assert!((z.volume().unwrap() / (12.0 * (s * t)) - 1.0).abs() < 1e-15);
            }
        }
    }

    fn zonotope(c: [f64; 2], rows: &[&[f64]]) -> Zonotope {
        Zonotope::new(c.to_vec(), Matrix::from_rows(rows).unwrap()).unwrap()
    }

    /// The area of a polygon by the shoelace formula, positive if counter-clockwise.
    fn shoelace(v: &[[f64; 2]]) -> f64 {
        (0..v.len())
            .map(|i| (v[i], v[(i + 1) % v.len()]))
            .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
            .sum()
    }

    #[test]
    fn a_square_has_four_corners_counter_clockwise_from_the_lower_left() {
        let z = zonotope([1.0, 1.0], &[&[0.0, -1.0], &[1.0, 0.0]]);
        assert_eq!(
            z.vertices().unwrap(),
            [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
        );
        assert_eq!(z.volume(), Some(4.0));
    }

    #[test]
    fn a_hexagon_has_the_area_of_its_shoelace() {
        let z = zonotope([0.5, -2.0], &[&[1.0, 0.0, 1.0], &[0.0, 1.0, 1.0]]);
        let v = z.vertices().unwrap();
        assert_eq!(v.len(), 6);
        // 4 (|det(g1, g2)| + |det(g1, g3)| + |det(g2, g3)|) = 12
        assert_eq!(shoelace(&v), 12.0);
        assert_eq!(z.volume(), Some(12.0));
    }

    #[test]
    fn degenerate_zonogons_are_a_point_or_a_segment() {
        let point = zonotope([3.0, 4.0], &[&[0.0], &[0.0]]);
        assert_eq!(point.vertices().unwrap(), [[3.0, 4.0]]);
        let segment = zonotope([0.0, 0.0], &[&[1.0, -2.0, 0.1], &[3.0, -6.0, 0.1 * 3.0]]);
        let v = segment.vertices().unwrap();
        assert_eq!(v.len(), 2);
        assert!((v[1][0] - 3.1).abs() < 1e-15 && (v[1][1] - 9.3).abs() < 1e-14);
        assert_eq!(segment.volume().map(|x| x < 1e-14), Some(true));
        let flat = zonotope([0.0, 0.0], &[&[1.0, -2.0], &[0.0, -0.0]]);
        assert_eq!(flat.vertices().unwrap(), [[-3.0, 0.0], [3.0, 0.0]]);
        assert!(Zonotope::point(&[1.0]).unwrap().vertices().is_err());
    }

    #[test]
    fn parallel_generators_share_an_edge() {
        let z = zonotope(
            [0.0, 0.0],
            &[&[1.0, 0.0, -2.0, 0.0], &[1.0, 1.0, -2.0, 3.0]],
        );
        assert_eq!(z.vertices().unwrap().len(), 4);
    }

    #[test]
    fn corners_of_a_hexagon_cut_off_from_its_hull_are_outside() {
        let z = zonotope([0.0, 0.0], &[&[1.0, 0.0, 1.0], &[0.0, 1.0, 1.0]]);
        let at = |x: f64, y: f64| {
            z.contains(&[Interval::point(x), Interval::point(y)])
                .unwrap()
        };
        // The hull is [−2, 2]²; x − y ≤ 2 cuts two corners off.
        assert_eq!(at(1.9, 1.9), Containment::Inside);
        assert_eq!(at(1.9, -0.05), Containment::Inside);
        assert_eq!(at(1.9, -0.2), Containment::Outside);
        assert_eq!(at(-1.5, 1.5), Containment::Outside);
        assert_eq!(at(1.5, -0.5), Containment::Undecided);
        let wide = [Interval::new(-2.0, 2.0).unwrap(), Interval::point(0.0)];
        assert_eq!(z.contains(&wide).unwrap(), Containment::Undecided);
    }

    #[test]
    fn off_a_segment_is_outside_and_on_it_is_not() {
        let z = zonotope([0.0, 0.0], &[&[1.0], &[0.5]]);
        let at = |x: f64, y: f64| {
            z.contains(&[Interval::point(x), Interval::point(y)])
                .unwrap()
        };
        assert_eq!(at(0.5, 0.2), Containment::Outside);
        assert_ne!(at(0.5, 0.25), Containment::Outside);
        // A segment is all boundary.
        assert_eq!(at(0.0, 0.0), Containment::Undecided);
    }
}
