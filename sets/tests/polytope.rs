//! Polytopes: facets, vertices and volumes by hand, and that no conversion loses a point.

#[path = "../../estimation/tests/draws/mod.rs"]
mod draws;

use draws::Draws;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{
    ConstrainedZonotope, Containment, Interval, IntervalVector, Matrix, Polytope, SetError, Slab,
    Zonotope,
};

fn slab(normal: &[f64], lo: f64, hi: f64) -> Slab {
    Slab {
        normal: normal.to_vec(),
        range: Interval::new(lo, hi).unwrap(),
    }
}

fn unit_box(n: usize) -> IntervalVector {
    IntervalVector::new(vec![Interval::UNIT; n])
}

/// A polytope of `m` random slabs through a box of random sides; the origin is inside.
fn random(n: usize, m: usize, draws: &mut Draws) -> Polytope {
    let sides: Vec<f64> = (0..n).map(|_| 0.2 + 2.0 * draws.unit()).collect();
    let minus: Vec<f64> = sides.iter().map(|s| -s).collect();
    let hull = IntervalVector::from_bounds(&minus, &sides).unwrap();
    let slabs = (0..m)
        .map(|_| {
            let normal: Vec<f64> = (0..n).map(|_| draws.signed()).collect();
            slab(&normal, -0.1 - draws.unit(), 0.1 + draws.unit())
        })
        .collect();
    Polytope::new(hull, slabs).unwrap()
}

fn inside(p: &Polytope, draws: &mut Draws) -> Option<Vec<f64>> {
    (0..200).find_map(|_| {
        let x: Vec<f64> = p
            .hull()
            .iter()
            .map(|s| s.mid() + s.rad() * draws.signed())
            .collect();
        (p.contains(&points(&x)) == Containment::Inside).then_some(x)
    })
}

fn points(x: &[f64]) -> Vec<Interval> {
    x.iter().map(|&x| Interval::point(x)).collect()
}

#[test]
fn a_square_cut_at_a_corner_has_five_sides() {
    let cut = Polytope::new(unit_box(2), vec![slab(&[1.0, 1.0], -2.0, 1.0)]).unwrap();
    let p = cut.simplified(&mut LinearProgram::new()).unwrap();
    assert!((p.volume().unwrap() - 3.5).abs() < 1e-13);
    assert_eq!(p.vertices().len(), 5);
    // The slabs: two along axes and the cut.
    assert_eq!(p.slabs().len(), 3);
    let diagonal: Vec<&Slab> = p
        .slabs()
        .iter()
        .filter(|s| s.normal[0] * s.normal[1] != 0.0)
        .collect();
    assert_eq!(diagonal.len(), 1);
    let s = 0.5_f64.sqrt();
    assert!(
        (diagonal[0].normal[0] - s).abs() < 1e-12 && (diagonal[0].range.hi() - s).abs() < 1e-12
    );
}

#[test]
fn a_slab_that_does_not_touch_is_removed() {
    let p = Polytope::new(unit_box(2), vec![slab(&[1.0, 1.0], -3.0, 3.0)]).unwrap();
    let p = p.simplified(&mut LinearProgram::new()).unwrap();
    assert_eq!(p.slabs().len(), 2);
    assert_eq!(p.volume(), Polytope::from_box(&unit_box(2)).volume());
}

#[test]
fn a_cube_cut_at_a_corner_has_seven_faces() {
    let cut = Polytope::new(unit_box(3), vec![slab(&[1.0, 1.0, 1.0], -4.0, 2.0)]).unwrap();
    let p = cut.simplified(&mut LinearProgram::new()).unwrap();
    assert!((p.volume().unwrap() - (8.0 - 1.0 / 6.0)).abs() < 1e-12);
    assert_eq!((p.vertices().len(), p.slabs().len()), (10, 4));
}

#[test]
fn scales_apart_do_not_disturb_the_facets() {
    let hull = IntervalVector::from_bounds(&[-1e-6, -1e3, -1.0], &[1e-6, 1e3, 1.0]).unwrap();
    let cut = Polytope::new(hull, vec![slab(&[1e6, 1e-3, 1.0], -4.0, 2.0)]).unwrap();
    let p = cut.simplified(&mut LinearProgram::new()).unwrap();
    let expected = (8.0 - 1.0 / 6.0) * 1e-3;
    assert!((p.volume().unwrap() / expected - 1.0).abs() < 1e-11);
    assert_eq!(p.slabs().len(), 4);
}

#[test]
fn nothing_is_lost_on_the_way_to_facets_frames_and_back() {
    let mut draws = Draws::new(11);
    for trial in 0..60 {
        let n = 2 + trial % 2;
        let given = random(n, 1 + draws.below(5), &mut draws);
        let mut lp = LinearProgram::new();
        let p = given.simplified(&mut lp).unwrap();
        let set = p.to_constrained_zonotope().unwrap();
        let folded = set.clone().fold();
        let again = Polytope::enclosing(&folded).unwrap();
        let frames = p.frames(&mut lp).unwrap();
        let (volume, other) = (p.volume().unwrap(), again.volume().unwrap());
        assert!((volume - other).abs() <= 1e-9 * volume, "{volume} {other}");
        for _ in 0..20 {
            let Some(x) = inside(&given, &mut draws) else {
                continue;
            };
            assert_ne!(p.contains(&points(&x)), Containment::Outside);
            assert_ne!(again.contains(&points(&x)), Containment::Outside);
            assert_ne!(folded.contains(&points(&x)).unwrap(), Containment::Outside);
            for frame in &frames {
                let t = zonobench_sets::IntervalMatrix::from(frame.to())
                    .mul_vec(&IntervalVector::point(&x).unwrap());
                assert!(
                    t.iter()
                        .zip(frame.range())
                        .all(|(t, r)| t.intersect(r).is_some())
                );
                assert!(frame.hull().contains(&x));
            }
        }
        // The rotated boxes intersect in the polytope.
        let boxes = frames.iter().flat_map(|f| {
            (0..n).map(|i| Slab {
                normal: f.to().row(i).to_vec(),
                range: f.range()[i],
            })
        });
        let bundle = Polytope::new(p.hull().clone(), boxes.collect()).unwrap();
        let bundle = bundle.simplified(&mut lp).unwrap();
        assert!((bundle.volume().unwrap() - volume).abs() <= 1e-8 * volume);
        // Every vertex is in the polytope, within rounding.
        for v in p.vertices() {
            for s in p.slabs() {
                let at = s.product(&points(v));
                assert!(at.lo() <= s.range.hi() + 1e-9 && at.hi() >= s.range.lo() - 1e-9);
            }
        }
    }
}

#[test]
fn the_half_spaces_of_a_zonotope_hold_it_tightly() {
    let mut draws = Draws::new(12);
    for trial in 0..30 {
        let n = 2 + trial % 2;
        let z = Zonotope::new(vec![0.3; n], draws.matrix(n, n + 3)).unwrap();
        let p = Polytope::of_zonotope(&z).unwrap();
        let volume = p
            .simplified(&mut LinearProgram::new())
            .unwrap()
            .volume()
            .unwrap();
        assert!((volume / z.volume().unwrap() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn an_empty_intersection_is_empty_and_a_flat_one_has_no_volume() {
    let apart = vec![slab(&[1.0, 1.0], 0.5, 2.0), slab(&[1.0, 1.0], -2.0, 0.4)];
    let none = Polytope::new(unit_box(2), apart).unwrap();
    let found = none.simplified(&mut LinearProgram::new());
    assert!(matches!(found, Err(SetError::Empty { .. })), "{found:?}");
    for n in [2, 3] {
        let normal = vec![1.0; n];
        let flat = Polytope::new(unit_box(n), vec![slab(&normal, 0.25, 0.25)]).unwrap();
        let flat = flat.simplified(&mut LinearProgram::new()).unwrap();
        assert!(flat.volume().unwrap() < 1e-9);
        assert_ne!(
            flat.contains(&points(&{
                let mut x = vec![0.0; n];
                x[0] = 0.25;
                x
            })),
            Containment::Outside
        );
    }
}

#[test]
fn four_dimensions_are_refused() {
    let set = ConstrainedZonotope::from_box(&unit_box(4)).unwrap();
    let refused = Polytope::enclosing(&set);
    assert!(
        matches!(refused, Err(SetError::Range { .. })),
        "{refused:?}"
    );
    assert_eq!(Polytope::from_box(&unit_box(4)).volume(), None);
}

#[test]
fn slabs_cut_a_constrained_zonotope_without_new_generators() {
    let diamond = Zonotope::new(
        vec![0.0; 2],
        Matrix::from_rows(&[[1.0, 1.0], [1.0, -1.0]]).unwrap(),
    );
    let set = ConstrainedZonotope::from(diamond.unwrap());
    let cut = set.within(&[slab(&[1.0, 0.0], 0.0, 5.0)]).unwrap();
    assert_eq!((cut.generators(), cut.constraints()), (2, 1));
    assert!((cut.volume().unwrap().unwrap() - 4.0).abs() < 1e-12);
    assert!(set.within(&[slab(&[1.0], 0.0, 1.0)]).is_err());
}
