//! Reductions and strips under rounding: a point that is exactly in the set is exactly in the result.

#![allow(clippy::disallowed_methods)] // the platform's functions stand here as a second opinion

mod rational;

use num_traits::{Signed, ToPrimitive, Zero};
use rational::{Q, Source, has, known, product, q, qs, up};
use zonobench_sets::reduction::{scott, yang_scott};
use zonobench_sets::{ConstrainedZonotope, Matrix, SetError, Zonotope, strip};

/// A generic set has no exact point of f64 coordinates; the known one may be off its rows by half a unit.
#[test]
fn rescaling_and_elimination_lose_no_point() {
    let mut s = Source(30);
    for _ in 0..30 {
        let k = known(&mut s, 2, 3, 7);
        assert!(has(&k.set, &k.x));
        assert!(has(&scott::rescale(&k.set).unwrap(), &k.x));
        for constraints in [2, 1, 0] {
            let reduced = scott::eliminate_constraints(&k.set, constraints).unwrap();
            assert!(
                reduced.constraints() <= constraints && reduced.generators() < k.set.generators()
            );
            assert!(has(&reduced, &k.x));
        }
    }
}

#[test]
fn coordinate_bounds_hold_the_known_coordinates() {
    let mut s = Source(31);
    for _ in 0..300 {
        let k = known(&mut s, 1, 3, 6);
        let bounds = scott::coordinate_bounds(&k.set).unwrap();
        assert!(
            bounds
                .iter()
                .zip(&k.xi)
                .all(|(e, x)| q(e.lo()) <= *x && *x <= q(e.hi()))
        );
    }
}

#[test]
fn lifted_reduction_loses_no_point() {
    let mut s = Source(32);
    for _ in 0..30 {
        let k = known(&mut s, 2, 2, 9);
        for generators in [8, 6, 4] {
            let reduced = scott::reduce_generators(&k.set, generators).unwrap();
            assert!(reduced.generators() <= generators && reduced.constraints() == 2);
            assert!(has(&reduced, &k.x));
        }
        let both = scott::reduce(&k.set, 5, 1).unwrap();
        assert!(both.generators() <= 5 && both.constraints() <= 1 && has(&both, &k.x));
    }
}

/// ρ(d) of ⟨c, G, r⟩, exactly.
fn support(z: &Zonotope, d: &[f64]) -> Q {
    let row = Matrix::from_rows(&[d]).unwrap();
    let along = product(&z.g().transpose(), &qs(d));
    let center = product(&row, &qs(z.c()))[0].clone();
    let sides = d
        .iter()
        .zip(z.r())
        .fold(Q::zero(), |s, (&d, &r)| s + q(d).abs() * q(r));
    along.iter().fold(center + sides, |s, x| s + x.abs())
}

#[test]
fn method_4_contains_the_zonotope_in_every_direction() {
    let mut s = Source(33);
    for case in 0..300 {
        let n = 1 + s.below(4);
        let p = n + 1 + s.below(8);
        // Every third case has a dependent row, so that there is no block.
        let mut g = s.matrix(n, p);
        for i in 0..n {
            let f = s.scale(5.0);
            g.row_mut(i).iter_mut().for_each(|x| *x *= f);
        }
        if case % 3 == 0 && n > 1 {
            let first = g.row(0).to_vec();
            g.row_mut(1).copy_from_slice(&first);
        }
        let z = Zonotope::with_rounding(s.vector(n), g, vec![1e-17; n]).unwrap();
        let reduced = yang_scott::reduce(&z, n + s.below(p - n)).unwrap();
        for _ in 0..6 {
            let d = s.vector(n);
            assert!(
                support(&z, &d) <= support(&reduced, &d),
                "{z:?} {reduced:?}"
            );
        }
        for i in 0..n {
            let mut d = vec![0.0; n];
            d[i] = 1.0;
            assert!(support(&z, &d) <= support(&reduced, &d));
        }
    }
}

#[test]
fn a_strip_keeps_every_point_in_it() {
    let mut s = Source(34);
    let mut cut = 0;
    for _ in 0..300 {
        let k = known(&mut s, 3, 0, 6);
        let z = k.set.zonotope();
        let d: Vec<f64> = s
            .vector(3)
            .iter()
            .map(|x| x * [0.0, 1.0, 1.0, 1e-3][s.below(4)])
            .collect();
        let along =
            k.x.iter()
                .zip(&d)
                .fold(Q::zero(), |t, (x, &d)| t + x * q(d));
        let y = along.to_f64().unwrap() + 0.1 * z.radius()[0] * s.sym();
        let narrowed = strip::intersect(z, &d, y, up(&(&along - q(y)).abs())).unwrap();
        assert_eq!(narrowed.generators(), z.generators());
        cut += usize::from(narrowed != *z);
        assert!(has(&narrowed.into(), &k.x));
    }
    assert!(cut > 100, "{cut} strips changed the zonotope");
}

#[test]
fn a_strip_that_misses_is_empty_and_one_that_covers_changes_nothing() {
    let z = Zonotope::new(vec![0.0; 2], Matrix::identity(2)).unwrap();
    assert!(matches!(
        strip::intersect(&z, &[1.0, 1.0], 3.0, 0.5),
        Err(SetError::Empty { .. })
    ));
    assert_eq!(strip::intersect(&z, &[1.0, 1.0], 0.0, 5.0).unwrap(), z);
    assert_eq!(strip::intersect(&z, &[0.0, 0.0], 0.0, 1.0).unwrap(), z);
    assert!(matches!(
        strip::intersect(&z, &[1.0], 0.0, 1.0),
        Err(SetError::Dimension { .. })
    ));
    assert!(matches!(
        strip::intersect(&z, &[1.0, 0.0], 0.0, -1.0),
        Err(SetError::Range { .. })
    ));
}

#[test]
fn redundant_contradictory_and_vanishing_rows() {
    let g = Matrix::from_rows(&[[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]]).unwrap();
    let set = |rows: &[[f64; 3]], b: &[f64]| {
        ConstrainedZonotope::new(
            vec![0.0; 2],
            g.clone(),
            Matrix::from_rows(rows).unwrap(),
            b.to_vec(),
        )
        .unwrap()
    };
    // Twice the same row: it goes, and nothing else.
    let twice = set(&[[1.0, 1.0, 0.3], [3.0, 3.0, 0.9]], &[0.7, 2.1]);
    let reduced = scott::eliminate_constraints(&twice, 1).unwrap();
    assert_eq!((reduced.constraints(), reduced.generators()), (1, 3));
    let (a, b) = (
        twice.interval_hull().unwrap(),
        reduced.interval_hull().unwrap(),
    );
    assert!(
        a.iter()
            .zip(b.iter())
            .all(|(a, b)| (a.lo() - b.lo()).abs() + (a.hi() - b.hi()).abs() < 1e-12)
    );
    // The same row with another right side is proved empty.
    let none = set(&[[1.0, 1.0, 0.3], [3.0, 3.0, 0.9]], &[0.7, 2.2]);
    assert!(matches!(
        scott::eliminate_constraints(&none, 1),
        Err(SetError::Empty { .. })
    ));
    // A row that only one point of the box meets: rescaling fixes its coordinates, and their columns go.
    let corner = set(&[[1.0, 1.0, 0.0], [0.0, 0.0, 0.0]], &[2.0, 0.0]);
    let point = scott::eliminate_constraints(&corner, 0).unwrap();
    assert_eq!(point.constraints(), 0);
    let hull = point.interval_hull().unwrap();
    assert!(
        (hull[0].lo() - 0.5).abs() < 1e-12 && (hull[1].hi() - 1.5).abs() < 1e-12,
        "{hull:?}"
    );
    // Too few generators for the constraints that stay.
    assert!(matches!(
        scott::reduce(&twice, 2, 1),
        Err(SetError::Range { .. })
    ));
}

#[test]
fn thin_sets_keep_their_points_and_their_widths() {
    // Widths of 1e-5 beside 1, after strips that confine one direction ever more.
    let mut s = Source(35);
    let truth = [0.3, 0.2, -0.1];
    let mut x = ConstrainedZonotope::new(
        vec![0.0; 3],
        Matrix::identity(3),
        Matrix::zeros(0, 3),
        vec![],
    )
    .unwrap();
    for step in 0..120 {
        let d = [1.0, 1e-3 * s.normal(), 1e-3 * s.normal()];
        let y: f64 = d.iter().zip(&truth).map(|(d, t)| d * t).sum();
        x = x
            .intersect_strip(&d, y + 1e-5 * s.sym() * (1.0 - 1e-12), 1e-5)
            .unwrap();
        x = scott::reduce(&x.fold(), 14, 5).unwrap();
        let hull = x.interval_hull().unwrap();
        assert!(hull.contains(&truth), "{hull:?}");
        assert!(step % 60 != 59 || has(&x, &qs(&truth)));
    }
    let hull = x.interval_hull().unwrap();
    // The strips confine the first component, and the others a thousand times less.
    assert!(hull[0].width() < 1e-5 && hull[1].width() > 1e-4, "{hull:?}");
}

/// Coordinates of ±1 at which the set ends, as the generators have their signs: that point must be in what is left after
/// an elimination, whose coefficients are all rounded. Equal coefficients of opposite signs meet the constraint exactly
/// and narrow no range, so that nothing else is charged.
#[test]
fn an_elimination_keeps_the_end_of_the_set() {
    let mut s = Source(36);
    for _ in 0..2000 {
        let pairs = 1 + s.below(30);
        let (mut a, mut g) = (Vec::new(), Vec::new());
        for _ in 0..pairs {
            let coefficient = s.unit();
            a.extend([coefficient, coefficient]);
            g.extend([3.0 + s.unit(), -3.0 - s.unit()]);
        }
        let end: Q = g.iter().map(|&g| q(g).abs()).sum();
        let [a, g] = [a, g].map(|row| Matrix::from_rows(&[row]).unwrap());
        let x = ConstrainedZonotope::new(vec![0.0], g, a, vec![0.0]).unwrap();
        let reduced = scott::eliminate_constraints(&x, 0).unwrap();
        assert!(support(reduced.zonotope(), &[1.0]) >= end);
    }
}

/// In the plane a zonotope lies in another if it does so along the normals of the other's edges. Generators that are
/// all but parallel make a block T whose inverse is large, so that what T ρ misses of a generator is a long way in
/// the coordinates of T.
#[test]
fn method_4_contains_flat_zonotopes() {
    let mut s = Source(37);
    for _ in 0..1000 {
        let p = 4 + s.below(12);
        let (slope, thin) = (s.sym(), s.scale(10.0).abs().min(1.0));
        let g = Matrix::from_rows(&{
            let along: Vec<f64> = (0..p).map(|_| s.sym()).collect();
            let across = along.iter().map(|x| slope * x + thin * s.sym()).collect();
            [along.clone(), across]
        });
        let z = Zonotope::new(vec![s.sym(), s.sym()], g.unwrap()).unwrap();
        let reduced = yang_scott::reduce(&z, 2 + s.below(2)).unwrap();
        let edges = (0..reduced.generators()).map(|j| [-reduced.g()[(1, j)], reduced.g()[(0, j)]]);
        for d in edges.chain([[1.0, 0.0], [0.0, 1.0]]) {
            for d in [d, [-d[0], -d[1]]] {
                assert!(support(&z, &d) <= support(&reduced, &d), "{d:?} of {z:?}");
            }
        }
    }
}

/// A strip of no width through a set far from the origin: the rounding of dᵀc goes along λ into a component whose own
/// numbers are small.
#[test]
fn a_strip_charges_the_rounding_of_its_offset() {
    let mut s = Source(38);
    for _ in 0..200 {
        let c = [1e8 * (1.0 + s.sym()), 0.0];
        let z = Zonotope::new(c, Matrix::column(&[0.0, 1.0])).unwrap();
        let d = [0.1 * s.sym(), 1.0];
        let y = d[0] * c[0] + 0.5 * s.sym();
        let cut = strip::intersect(&z, &d, y, 0.0).unwrap();
        // x = (c_1, ξ) with dᵀx = y.
        let xi = q(y) - q(d[0]) * q(c[0]);
        assert!(has(&cut.into(), &[q(c[0]), xi]));
    }
}

/// ρ = hi − m is rounded, and then G ρ: a vertex of the set stays where both go down.
#[test]
fn a_set_written_around_another_center_keeps_its_vertices() {
    let mut s = Source(39);
    for _ in 0..2000 {
        let m = 0.02 * s.sym();
        // A product just above a power of two loses the most.
        let g = (1.0 + 1e-15 * s.below(8) as f64) / (1.0 + m.abs());
        let x = ConstrainedZonotope::from(Zonotope::new([0.0], Matrix::column(&[g])).unwrap());
        let around = scott::recentred(&x, &[m]).unwrap();
        for vertex in [g, -g] {
            assert!(has(&around, &[q(vertex)]), "{m:e} {g:e}");
        }
    }
}
