//! Polytopes of a bounded number of facets contain what they stand for, and are as large as they say.

#![allow(clippy::disallowed_methods)] // powers of two and square roots of draws

use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{
    ConstrainedZonotope, Containment, FacetBound, Interval, IntervalVector, Polytope, Slab,
};

/// SplitMix64.
struct Draws(u64);

impl Draws {
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn unit(&mut self, n: usize) -> Vec<f64> {
        let raw: Vec<f64> = (0..n).map(|_| self.signed()).collect();
        let size = raw.iter().map(|x| x * x).sum::<f64>().sqrt();
        raw.iter().map(|x| x / size).collect()
    }
}

fn cube(n: usize, r: f64) -> IntervalVector {
    IntervalVector::new(vec![Interval::from_center_radius(0.0, r); n])
}

/// The cube [−1, 1]ⁿ cut by `count` slabs about the unit ball, each with `beside` others that are turned by 1e-5.
fn about_a_ball(n: usize, count: usize, beside: usize, draws: &mut Draws) -> Polytope {
    let mut slabs = Vec::new();
    for _ in 0..count {
        let normal = draws.unit(n);
        for i in 0..=beside {
            let turn = if i == 0 { 0.0 } else { 1e-5 };
            let normal = normal.iter().map(|a| a + turn * draws.signed()).collect();
            slabs.push(Slab {
                normal,
                range: Interval::from_center_radius(0.0, 0.8 + 1e-7 * draws.signed()),
            });
        }
    }
    Polytope::new(cube(n, 1.0), slabs).unwrap()
}

const NO_BOUND: FacetBound = FacetBound {
    most: 10_000,
    kept: 10_000,
};

#[test]
fn cutting_and_sweeping_find_the_same_body_where_facets_are_far_apart() {
    let mut draws = Draws(1);
    let mut lp = LinearProgram::new();
    for n in [2, 3] {
        for count in [0, 1, 2, 5, 9] {
            let polytope = about_a_ball(n, count, 0, &mut draws);
            let swept = polytope.simplified(&mut lp).unwrap();
            // Too many facets for 0, so that the box is cut; none goes.
            let bound = FacetBound { most: 0, kept: 9 };
            let cut = polytope.simplified_at_most(bound, &mut lp).unwrap();
            let (a, b) = (swept.volume().unwrap(), cut.volume().unwrap());
            assert!((a - b).abs() <= 1e-9 * a, "{n} {count}: {a} {b}");
            // The same programs after others: within their rounding.
            for (x, y) in swept.hull().iter().zip(cut.hull()) {
                assert!((x.lo() - y.lo()).abs().max((x.hi() - y.hi()).abs()) <= 1e-13);
            }
            assert_eq!(swept.vertices().len(), cut.vertices().len(), "{n} {count}");
            let as_ever = polytope.simplified_at_most(NO_BOUND, &mut lp).unwrap();
            assert_eq!(as_ever, swept);
        }
    }
}

#[test]
fn facets_that_are_nearly_parallel_do_not_lead_the_vertices_astray() {
    let mut draws = Draws(2);
    let mut lp = LinearProgram::new();
    for count in [6, 10, 14] {
        let polytope = about_a_ball(3, count, 12, &mut draws);
        let bound = FacetBound {
            most: 128,
            kept: 32,
        };
        let few = polytope.simplified_at_most(bound, &mut lp).unwrap();
        // The turned slabs cut off 1e-5 at most.
        let alone: Vec<Slab> = polytope.slabs().iter().step_by(13).cloned().collect();
        let alone = Polytope::new(cube(3, 1.0), alone).unwrap();
        let volume = alone.simplified(&mut lp).unwrap().volume().unwrap();
        let own = few.volume().unwrap();
        assert!(
            (own - volume).abs() <= 1e-4 * volume,
            "{count}: {own} {volume}"
        );
        assert!(few.vertices().len() <= 600 && few.slabs().len() <= 131);
    }
}

#[test]
fn fewer_facets_hold_the_polytope_and_those_that_cut_most_are_kept() {
    let mut draws = Draws(3);
    let mut lp = LinearProgram::new();
    for n in [2, 3] {
        let polytope = about_a_ball(n, 20, 1, &mut draws)
            .simplified(&mut lp)
            .unwrap();
        let mut last = f64::INFINITY;
        for most in [1, 2, 4, 8, 16, 64] {
            let few = polytope.thinned(most);
            let inclined = |s: &&Slab| s.normal.iter().filter(|a| **a != 0.0).count() > 1;
            assert!(few.slabs().iter().filter(inclined).count() <= most);
            assert_eq!(few.hull(), polytope.hull());
            for v in polytope.vertices() {
                let v: Vec<Interval> = v.iter().map(|&x| Interval::point(x)).collect();
                // A vertex is rounded: it is inside, or on the boundary within rounding.
                let near = few.slabs().iter().all(|s| {
                    let at = s.product(&v);
                    at.lo() <= s.range.hi() + 1e-9 && at.hi() >= s.range.lo() - 1e-9
                });
                assert!(near || few.contains(&v) != Containment::Outside);
            }
            let volume = few.volume().unwrap();
            assert!(
                volume <= last * (1.0 + 1e-12),
                "{n} {most}: {volume} {last}"
            );
            last = volume;
        }
        let whole = polytope.volume().unwrap();
        assert!((last - whole).abs() <= 1e-6 * whole, "{n}: {last} {whole}");
    }
}

#[test]
fn other_units_keep_the_same_facets() {
    let mut draws = Draws(4);
    let polytope = about_a_ball(3, 30, 0, &mut draws);
    for power in [20, 40] {
        let scale = [2.0_f64.powi(power), 1.0, 2.0_f64.powi(-power)];
        let sides = polytope.hull().iter().zip(scale).map(|(x, s)| *x * s);
        let hull = IntervalVector::new(sides.collect::<Vec<_>>());
        let slabs = polytope.slabs().iter().map(|slab| Slab {
            normal: slab.normal.iter().zip(scale).map(|(a, s)| a / s).collect(),
            range: slab.range,
        });
        let scaled = Polytope::new(hull, slabs.collect()).unwrap();
        for most in [3, 8, 20] {
            let [own, other] = [&polytope, &scaled].map(|p| p.thinned(most));
            let ranges = |p: &Polytope| p.slabs().iter().map(|s| s.range).collect::<Vec<_>>();
            assert_eq!(ranges(&own), ranges(&other));
            assert_eq!(own.vertices().len(), other.vertices().len());
        }
    }
}

#[test]
fn flat_sets_and_points_have_polytopes_too() {
    let mut lp = LinearProgram::new();
    let bound = FacetBound { most: 8, kept: 2 };
    for sides in [[1.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]] {
        let hull: IntervalVector = sides
            .iter()
            .map(|&r| Interval::from_center_radius(1.0, r))
            .collect();
        let normals = [[1.0, 2.0, 3.0], [1.0, -1.0, 0.5], [0.5, 0.5, -2.0]];
        let slabs = normals.map(|a| Slab {
            normal: a.to_vec(),
            range: Interval::from_center_radius(a.iter().sum(), 0.5),
        });
        let polytope = Polytope::new(hull, slabs.to_vec()).unwrap();
        let few = polytope.thinned(2);
        assert!(few.slabs().len() <= 2);
        let swept = polytope.simplified_at_most(bound, &mut lp).unwrap();
        let center = [Interval::point(1.0); 3];
        assert_ne!(few.contains(&center), Containment::Outside);
        assert_ne!(swept.contains(&center), Containment::Outside);
        assert!(few.volume().unwrap() <= 1e-12 && swept.volume().unwrap() <= 1e-12);
    }
}

#[test]
fn an_empty_polytope_is_said_to_be_empty() {
    let slab = |lo, hi| Slab {
        normal: vec![1.0, 1.0, 1.0],
        range: Interval::new(lo, hi).unwrap(),
    };
    let polytope = Polytope::new(cube(3, 1.0), vec![slab(-1.0, -0.5), slab(0.5, 1.0)]).unwrap();
    let bound = FacetBound { most: 1, kept: 1 };
    let mut lp = LinearProgram::new();
    assert!(polytope.simplified_at_most(bound, &mut lp).is_err());
    let set = ConstrainedZonotope::from_box(&cube(3, 1.0)).unwrap();
    let whole = Polytope::enclosing_at_most(&set, None, bound, &mut lp).unwrap();
    assert!((whole.volume().unwrap() - 8.0).abs() <= 1e-12);
}
