//! Constrained zonotopes: every operation's rounding rule against exact rational points, the proved
//! answers, and small sets that can be checked on paper.

#![allow(clippy::disallowed_methods)] // the platform's functions stand here as a second opinion

mod rational;

use num_traits::{Signed, ToPrimitive, Zero};
use rational::{Q, Source, known, product, q, up};
use zonobench_sets::lp::Emptiness;
use zonobench_sets::{ConstrainedZonotope, Containment, Interval, Matrix, SetError, Zonotope};

/// x = c + G ξ + s with |ξ| ≤ 1, |A ξ − b| ≤ δ, |s| ≤ r, exactly.
fn holds(set: &ConstrainedZonotope, xi: &[Q], x: &[Q]) -> bool {
    let one = q(1.0);
    let rows = product(set.a(), xi);
    let offset = product(set.g(), xi);
    xi.len() == set.generators()
        && xi.iter().all(|x| x.abs() <= one)
        && (0..set.constraints()).all(|i| (&rows[i] - q(set.b()[i])).abs() <= q(set.delta()[i]))
        && (0..set.dim()).all(|i| (&x[i] - &offset[i] - q(set.c()[i])).abs() <= q(set.r()[i]))
}

#[test]
fn the_known_points_are_in_their_sets() {
    let mut s = Source(20);
    for _ in 0..20 {
        let k = known(&mut s, 3, 2, 6);
        assert!(holds(&k.set, &k.xi, &k.x));
    }
}

#[test]
fn maps_sums_products_and_folds_lose_no_point() {
    let mut s = Source(21);
    for _ in 0..150 {
        let (k, l) = (known(&mut s, 3, 2, 6), known(&mut s, 3, 1, 4));
        let scale = s.scale(4.0);
        let m = s.matrix(2, 3).scale(scale);
        let t = s.vector(2);
        let image: Vec<Q> = product(&m, &k.x)
            .iter()
            .zip(&t)
            .map(|(x, &t)| x + q(t))
            .collect();
        assert!(holds(&k.set.affine_map(&m, &t).unwrap(), &k.xi, &image));
        let both = [&k.xi[..], &l.xi].concat();
        let sum: Vec<Q> = k.x.iter().zip(&l.x).map(|(x, y)| x + y).collect();
        assert!(holds(&k.set.minkowski_sum(&l.set).unwrap(), &both, &sum));
        assert!(holds(
            &k.set.cartesian_product(&l.set),
            &both,
            &[&k.x[..], &l.x].concat()
        ));
        let folded = k.set.clone().fold();
        let mut xi = k.xi.clone();
        xi.extend(k.set.r().iter().filter(|r| **r != 0.0).map(|_| q(1.0)));
        for (row, (&b, &delta)) in product(k.set.a(), &k.xi)
            .iter()
            .zip(k.set.b().iter().zip(k.set.delta()))
        {
            if delta != 0.0 {
                xi.push((q(b) - row) / q(delta));
            }
        }
        assert!(holds(&folded, &xi, &k.x));
        assert!(folded.r().iter().chain(folded.delta()).all(|r| *r == 0.0));
    }
}

#[test]
fn intersections_lose_no_common_point() {
    let mut s = Source(22);
    for case in 0..200 {
        let k = known(&mut s, 3, 2, 6);
        let l = known(&mut s, 2, 1, 4);
        let scale = s.scale(3.0);
        let r = match case % 2 {
            0 => s.matrix(2, 3).scale(scale),
            _ => Matrix::from_rows(&[[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]).unwrap(),
        };
        // Move the second set so that R x is exactly its known point, up to its rounding box.
        let target = product(&r, &k.x);
        let shift: Vec<f64> = (0..2)
            .map(|i| (&target[i] - &l.x[i] + q(l.set.c()[i])).to_f64().unwrap())
            .collect();
        let rounding: Vec<f64> = (0..2)
            .map(|i| up(&((&target[i] - product(l.set.g(), &l.xi)[i].clone() - q(shift[i])).abs())))
            .collect();
        let z = Zonotope::with_rounding(shift, l.set.g().clone(), rounding).unwrap();
        let y = ConstrainedZonotope::with_slack(
            z,
            l.set.a().clone(),
            l.set.b().to_vec(),
            l.set.delta().to_vec(),
        );
        let y = y.unwrap();
        assert!(holds(&y, &l.xi, &target));
        let joined = k.set.generalized_intersection(&r, &y).unwrap();
        assert!(holds(&joined, &[&k.xi[..], &l.xi].concat(), &k.x));
        assert!(joined.interval_hull().is_ok());
    }
}

#[test]
fn strips_and_half_spaces_keep_what_is_in_them() {
    let mut s = Source(23);
    for _ in 0..200 {
        let k = known(&mut s, 3, 1, 5);
        let d = s.vector(3);
        let along =
            k.x.iter()
                .zip(&d)
                .fold(Q::zero(), |t, (x, &d)| t + x * q(d));
        let y = along.to_f64().unwrap() + 1e-3 * k.set.zonotope().radius()[0] * s.sym();
        let sigma = up(&(&along - q(y)).abs());
        let strip = k.set.intersect_strip(&d, y, sigma).unwrap();
        let zeta = (&along - q(y)) / q(sigma);
        assert!(holds(&strip, &[&k.xi[..], &[zeta]].concat(), &k.x));
        // The half-space through the point: its coordinate in the strip's generator is some ζ in [−1, 1].
        let half = k.set.intersect_halfspace(&d, up(&along)).unwrap();
        let row = half.constraints() - 1;
        let width = -q(half.a()[(row, k.set.generators())]);
        let rest = product(
            &half
                .a()
                .select_columns(&(0..k.set.generators()).collect::<Vec<_>>()),
            &k.xi,
        );
        let zeta = ((&rest[row] - q(half.b()[row])) / width)
            .max(q(-1.0))
            .min(q(1.0));
        assert!(holds(&half, &[&k.xi[..], &[zeta]].concat(), &k.x));
    }
}

#[test]
fn hulls_and_supports_never_cut_off_a_known_point() {
    let mut s = Source(24);
    for _ in 0..300 {
        let k = known(&mut s, 3, 2, 7);
        let hull = k.set.interval_hull().unwrap();
        let directions: Vec<Vec<f64>> = (0..4).map(|_| s.vector(3)).collect();
        for (side, x) in hull.iter().zip(&k.x) {
            assert!(q(side.lo()) <= *x && *x <= q(side.hi()));
        }
        for (d, bound) in directions.iter().zip(k.set.supports(&directions).unwrap()) {
            let along = k.x.iter().zip(d).fold(Q::zero(), |t, (x, &d)| t + x * q(d));
            assert!(along <= q(bound));
        }
        assert!(!matches!(k.set.emptiness(), Emptiness::Empty));
        let x: Vec<Interval> =
            k.x.iter()
                .map(|x| x.to_f64().unwrap())
                .map(|x| Interval::new(x.next_down(), x.next_up()).unwrap())
                .collect();
        assert_ne!(k.set.contains(&x).unwrap(), Containment::Outside);
    }
}

/// [Rego2020, Eq. (24)]: the triangle (−1.2, 1), (−1.5, 1.3), (−1.5, 0.7).
fn triangle() -> ConstrainedZonotope {
    ConstrainedZonotope::new(
        vec![-1.0, 1.0],
        Matrix::from_rows(&[[0.2, 0.4, 0.2], [0.2, 0.0, -0.2]]).unwrap(),
        Matrix::from_rows(&[[2.0, 2.0, 2.0]]).unwrap(),
        vec![-3.0],
    )
    .unwrap()
}

#[test]
fn the_triangle_of_the_paper_has_its_corners() {
    let set = triangle();
    let hull = set.interval_hull().unwrap();
    for (side, (lo, hi)) in hull.iter().zip([(-1.5, -1.2), (0.7, 1.3)]) {
        assert!(
            (side.lo() - lo).abs() < 1e-14 && (side.hi() - hi).abs() < 1e-14,
            "{side:?}"
        );
    }
    let mut corners = set.vertices().unwrap();
    assert_eq!(corners.len(), 3);
    corners.sort_by(|a, b| a[1].total_cmp(&b[1]));
    for (v, expected) in corners.iter().zip([[-1.5, 0.7], [-1.2, 1.0], [-1.5, 1.3]]) {
        assert!(
            (v[0] - expected[0]).abs() < 1e-14 && (v[1] - expected[1]).abs() < 1e-14,
            "{v:?}"
        );
    }
    // Base 0.6, height 0.3.
    assert!((set.volume().unwrap().unwrap() - 0.09).abs() < 1e-14);
    let at = |x: f64, y: f64| {
        set.contains(&[Interval::point(x), Interval::point(y)])
            .unwrap()
    };
    assert_eq!(at(-1.4, 1.0), Containment::Inside);
    assert_eq!(at(-1.0, 1.0), Containment::Outside);
    assert_eq!(at(-1.25, 1.1), Containment::Outside);
    assert_eq!(at(-1.25, 1.05 - 1e-9), Containment::Inside);
    assert_eq!(at(-1.25, 1.05 + 1e-9), Containment::Outside);
}

#[test]
fn a_cube_cut_at_a_corner_has_the_volume_of_what_is_left() {
    let cube = ConstrainedZonotope::new(
        vec![0.0; 3],
        Matrix::identity(3),
        Matrix::zeros(0, 3),
        vec![],
    )
    .unwrap();
    assert!((cube.volume().unwrap().unwrap() - 8.0).abs() < 1e-12);
    // x + y + z ≤ 2 cuts off a corner tetrahedron of volume 1/6.
    let cut = cube.intersect_halfspace(&[1.0; 3], 2.0).unwrap();
    assert!((cut.volume().unwrap().unwrap() - (8.0 - 1.0 / 6.0)).abs() < 1e-12);
    let flat = cube.intersect_strip(&[1.0, 0.0, 0.0], 0.5, 0.0).unwrap();
    assert!(flat.volume().unwrap().unwrap() < 1e-9);
    let gone = cube.intersect_halfspace(&[1.0; 3], -3.5);
    assert!(matches!(gone, Err(SetError::Empty { .. })));
}

#[test]
fn the_volume_of_a_zonotope_is_its_own() {
    let mut s = Source(25);
    for n in [2, 3] {
        let z = Zonotope::new(vec![0.5; n], s.matrix(n, 7)).unwrap();
        let volume = ConstrainedZonotope::from(z.clone())
            .volume()
            .unwrap()
            .unwrap();
        assert!(
            (volume / z.volume().unwrap() - 1.0).abs() < 1e-9,
            "{n}: {volume} {:?}",
            z.volume()
        );
    }
}

#[test]
fn segments_points_and_contradictions() {
    let g = Matrix::from_rows(&[[1.0, 1.0], [2.0, 2.0]]).unwrap();
    let segment = ConstrainedZonotope::new(vec![0.0; 2], g, Matrix::zeros(0, 2), vec![]).unwrap();
    assert_eq!(segment.vertices().unwrap().len(), 2);
    assert!(segment.volume().unwrap().unwrap() < 1e-12);
    let point = ConstrainedZonotope::point(&[3.0, -1.0]).unwrap();
    assert_eq!(point.vertices().unwrap(), [[3.0, -1.0]]);
    let far = ConstrainedZonotope::point(&[3.0, -1.0 + 1e-12]).unwrap();
    let none = point.intersect(&far).unwrap();
    assert_eq!(none.emptiness(), Emptiness::Empty);
    let far = ConstrainedZonotope::point(&[3.0, -1.0 + 1e-9]).unwrap();
    let none = point.intersect(&far).unwrap();
    assert!(matches!(none.interval_hull(), Err(SetError::Empty { .. })));
    assert!(matches!(none.vertices(), Err(SetError::Empty { .. })));
    assert!(
        point
            .intersect(&point)
            .unwrap()
            .interval_hull()
            .unwrap()
            .contains(&[3.0, -1.0])
    );
}

#[test]
fn bad_shapes_are_errors() {
    let g = Matrix::identity(2);
    let bad = ConstrainedZonotope::new(vec![0.0; 2], g.clone(), Matrix::zeros(1, 3), vec![0.0]);
    assert!(matches!(
        bad,
        Err(SetError::Dimension {
            expected: 2,
            got: 3,
            ..
        })
    ));
    let bad = ConstrainedZonotope::new(vec![0.0; 2], g.clone(), Matrix::zeros(1, 2), vec![]);
    assert!(matches!(bad, Err(SetError::Dimension { .. })));
    let bad = ConstrainedZonotope::new(vec![0.0; 2], g, Matrix::zeros(1, 2), vec![f64::NAN]);
    assert!(matches!(bad, Err(SetError::NotFinite { .. })));
    let set = triangle();
    assert!(set.support(&[1.0]).is_err() && set.contains(&[Interval::ENTIRE; 2]).is_err());
    assert!(set.intersect_strip(&[1.0, 0.0], 0.0, -1.0).is_err());
    assert!(
        set.generalized_intersection(&Matrix::identity(3), &set)
            .is_err()
    );
}

#[test]
fn a_box_around_a_point_is_found_inside_a_set_without_a_rounding_box() {
    // A thin parallelogram cut by x₁ + x₂ ∈ [−1, 1]/2: 10⁻⁵ beside 1, and the truth known to 10⁻¹².
    let g = Matrix::from_rows(&[[1.0, 0.5, 0.0], [1e-5, -1e-5, 0.0]]).unwrap();
    let a = Matrix::from_rows(&[[1.0, 1.0, -0.5]]).unwrap();
    let x = ConstrainedZonotope::new(vec![0.0; 2], g, a, vec![0.0]).unwrap();
    let around = |p: [f64; 2], r: f64| p.map(|c| Interval::from_center_radius(c, r));
    assert_eq!(
        x.contains(&around([0.1, 1e-6], 1e-12)).unwrap(),
        Containment::Inside
    );
    // On the boundary, where half of the box is outside; and out.
    assert_ne!(
        x.contains(&around([0.375, 0.0], 1e-9)).unwrap(),
        Containment::Inside
    );
    assert_eq!(
        x.contains(&around([0.1, 3e-5], 1e-12)).unwrap(),
        Containment::Outside
    );
}
