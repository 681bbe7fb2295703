//! The law of units: dividing components by powers of two changes no dimensionless result, bit for bit.
//!
//! Every set is made twice, once as it is and once with its components divided by units between 2⁻⁴⁰ and 2⁴⁰ (and its
//! constraints, which have the units of measurements, by others), and asked the same questions. A power of two changes
//! no rounding, so that answers are equal and not merely close. Only what pays for underflow, 2⁻¹⁰²² at a time, has no
//! unit: numbers below 2⁻⁹⁰⁰ count as equal.

use zonobench_sets::covariance::Scaled;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::reduction::{combastel, girard, parallel, scott, yang_scott};
use zonobench_sets::units::of_set;
use zonobench_sets::{
    ConstrainedZonotope, Containment, Ellipsoid, Interval, IntervalVector, Matrix, Polytope,
    Zonotope, ZonotopicGaussian, strip,
};

/// Below this, numbers are what underflow may have cost.
const UNDERFLOW: f64 = 1.2e-271; // 2⁻⁹⁰⁰

struct Draws(u64);

impl Draws {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    fn signed(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.signed()).collect()
    }
    /// Some entries are 0 and some columns parallel to an axis, as in the sets of filters.
    fn matrix(&mut self, n: usize, p: usize) -> Matrix {
        Matrix::from_fn(n, p, |_, _| {
            if self.bits().is_multiple_of(4) {
                0.0
            } else {
                self.signed()
            }
        })
    }
    /// Powers of two between 2⁻⁴⁰ and 2⁴⁰, none nearer to 1 than 2^±10 but for 1 itself.
    fn units(&mut self, n: usize) -> Vec<f64> {
        let mut one = || {
            let e = (self.bits() % 32) as i32 + 10;
            match self.bits() % 5 {
                0 => 1.0,
                1 | 2 => libm::scalbn(1.0, e.min(40)),
                _ => libm::scalbn(1.0, -e.min(40)),
            }
        };
        (0..n).map(|_| one()).collect()
    }
}

fn same(a: f64, b: f64) -> bool {
    a == b || (a.abs() < UNDERFLOW && b.abs() < UNDERFLOW) || (a.is_nan() && b.is_nan())
}

#[track_caller]
fn equal(what: &str, a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len(), "{what}");
    assert!(
        a.iter().zip(b).all(|(&a, &b)| same(a, b)),
        "{what}: {a:?} {b:?}"
    );
}

fn divided(x: &[f64], units: &[f64]) -> Vec<f64> {
    x.iter().zip(units).map(|(x, u)| x / u).collect()
}

fn multiplied(x: &[f64], units: &[f64]) -> Vec<f64> {
    x.iter().zip(units).map(|(x, u)| x * u).collect()
}

fn rows(m: &Matrix, units: &[f64]) -> Matrix {
    Matrix::from_fn(m.rows(), m.cols(), |i, j| m[(i, j)] / units[i])
}

/// The matrix in the first units again.
#[track_caller]
fn equal_rows(what: &str, here: &Matrix, there: &Matrix, units: &[f64]) {
    assert_eq!(
        (here.rows(), here.cols()),
        (there.rows(), there.cols()),
        "{what}"
    );
    equal(what, rows(here, units).as_slice(), there.as_slice());
}

#[track_caller]
fn equal_boxes(what: &str, here: &IntervalVector, there: &IntervalVector, units: &[f64]) {
    equal(what, &divided(&here.lower(), units), &there.lower());
    equal(what, &divided(&here.upper(), units), &there.upper());
}

#[track_caller]
fn equal_zonotopes(what: &str, here: &Zonotope, there: &Zonotope, units: &[f64]) {
    equal(what, &divided(here.c(), units), there.c());
    equal(what, &divided(here.r(), units), there.r());
    equal_rows(what, here.g(), there.g(), units);
}

fn in_units(z: &Zonotope, units: &[f64]) -> Zonotope {
    Zonotope::with_rounding(
        divided(z.c(), units),
        rows(z.g(), units),
        divided(z.r(), units),
    )
    .unwrap()
}

/// The zonotope, sometimes with a rounding box.
fn zonotope(draws: &mut Draws, n: usize, p: usize) -> Zonotope {
    let r = if draws.bits().is_multiple_of(2) {
        0.0
    } else {
        0.125
    };
    Zonotope::with_rounding(draws.vector(n), draws.matrix(n, p), vec![r; n]).unwrap()
}

/// A set with a point well inside, and the same in other units, its rows too.
fn constrained(
    draws: &mut Draws,
    n: usize,
    p: usize,
    q: usize,
    units: &[f64],
) -> (ConstrainedZonotope, ConstrainedZonotope) {
    let z = zonotope(draws, n, p);
    let a = draws.matrix(q, p);
    let inside: Vec<f64> = draws.vector(p).iter().map(|x| 0.5 * x).collect();
    let b = a.mul_vec(&inside).into_vec();
    let delta: Vec<f64> = (0..q)
        .map(|i| if i % 2 == 0 { 0.0 } else { 0.125 })
        .collect();
    let of_rows = draws.units(q);
    let there = ConstrainedZonotope::with_slack(
        in_units(&z, units),
        rows(&a, &of_rows),
        divided(&b, &of_rows),
        divided(&delta, &of_rows),
    );
    (
        ConstrainedZonotope::with_slack(z, a, b, delta).unwrap(),
        there.unwrap(),
    )
}

fn points(x: &[f64]) -> Vec<Interval> {
    x.iter().map(|&x| Interval::point(x)).collect()
}

fn volume(v: Option<f64>, units: &[f64]) -> Vec<f64> {
    v.iter()
        .map(|v| v / units.iter().product::<f64>())
        .collect()
}

fn planar(v: Vec<[f64; 2]>, units: &[f64]) -> Vec<f64> {
    v.iter().flat_map(|v| divided(v, units)).collect()
}

#[test]
fn a_box_in_other_units_is_the_same() {
    let mut draws = Draws(1);
    for n in 1..=4 {
        for _ in 0..50 {
            let units = draws.units(n);
            let (mid, rad) = (draws.vector(n), draws.vector(n));
            let rad: Vec<f64> = rad.iter().map(|r| r.abs()).collect();
            let make = |u: &[f64]| {
                IntervalVector::from_center_radius(&divided(&mid, u), &divided(&rad, u)).unwrap()
            };
            let (here, there) = (make(&vec![1.0; n]), make(&units));
            equal_boxes("sides", &here, &there, &units);
            equal("middle", &divided(&here.mid(), &units), &there.mid());
            equal("widths", &divided(&here.widths(), &units), &there.widths());
            let volume_of = |x: &IntervalVector| Polytope::from_box(x).volume();
            equal(
                "volume",
                &volume(volume_of(&here), &units),
                &volume(volume_of(&there), &vec![1.0; n]),
            );
        }
    }
}

#[test]
fn a_zonotope_in_other_units_is_the_same() {
    let mut draws = Draws(2);
    let mut verdicts = [0; 3];
    for n in 1..=4 {
        for case in 0..80 {
            let units = draws.units(n);
            let one = vec![1.0; n];
            let p = n + case % 7;
            let here = zonotope(&mut draws, n, p);
            let there = in_units(&here, &units);
            let d = draws.vector(n);
            let e = multiplied(&d, &units);
            equal(
                "support",
                &[here.support(&d).unwrap()],
                &[there.support(&e).unwrap()],
            );
            let hulls = (
                here.interval_hull().unwrap(),
                there.interval_hull().unwrap(),
            );
            equal_boxes("hull", &hulls.0, &hulls.1, &units);
            equal(
                "volume",
                &volume(here.volume(), &units),
                &volume(there.volume(), &one),
            );
            if n == 2 {
                let (v, w) = (here.vertices().unwrap(), there.vertices().unwrap());
                equal("vertices", &planar(v, &units), &planar(w, &one));
            }
            equal_zonotopes("fold", &here.clone().fold(), &there.clone().fold(), &units);
            let m = draws.matrix(n, n);
            let m_there = Matrix::from_fn(n, n, |i, j| m[(i, j)] * units[j] / units[i]);
            let images = (
                here.linear_map(&m).unwrap(),
                there.linear_map(&m_there).unwrap(),
            );
            equal_zonotopes("map", &images.0, &images.1, &units);
            let sum = |z: &Zonotope, w: &Zonotope| z.minkowski_sum(w).unwrap();
            equal_zonotopes(
                "sum",
                &sum(&here, &images.0),
                &sum(&there, &images.1),
                &units,
            );
            let xi = draws.vector(p);
            for stretch in [0.5, 1.0, 1.5] {
                let x: Vec<f64> = (here.g().mul_vec(&xi).iter().zip(here.c()))
                    .map(|(o, c)| stretch * o + c)
                    .collect();
                let verdict = here.contains(&points(&x)).unwrap();
                assert_eq!(
                    verdict,
                    there.contains(&points(&divided(&x, &units))).unwrap(),
                    "n = {n}"
                );
                verdicts[verdict as usize] += 1;
            }
            // Methods that do not compare components, and those that do in units given.
            let generators = n + (p - n) / 2;
            let reduced = (
                girard::reduce_scaled(&here, generators).unwrap(),
                girard::reduce_scaled(&there, generators).unwrap(),
            );
            equal_zonotopes("Girard's reduction, scaled", &reduced.0, &reduced.1, &units);
            for method in [girard::reduce, combastel::reduce, yang_scott::reduce] {
                let in_prior = |z: &Zonotope| {
                    let own = of_set(z.c(), &z.radius());
                    let reduced = method(&z.divided_by(&own).unwrap(), generators).unwrap();
                    reduced.multiplied_by(&own).unwrap()
                };
                equal_zonotopes(
                    "reduction in units",
                    &in_prior(&here),
                    &in_prior(&there),
                    &units,
                );
            }
            let row = draws.vector(n);
            let y = here.c().iter().zip(&row).map(|(c, d)| c * d).sum::<f64>() + 0.1;
            let cut = |z: &Zonotope, d: &[f64]| strip::intersect(z, d, y, 0.25);
            match (cut(&here, &row), cut(&there, &multiplied(&row, &units))) {
                (Ok(a), Ok(b)) => equal_zonotopes("strip", &a, &b, &units),
                (a, b) => assert_eq!(a, b),
            }
        }
    }
    assert!(verdicts.iter().all(|&v| v > 20), "{verdicts:?}");
}

#[test]
fn parallel_generators_in_other_units_are_parallel() {
    let mut draws = Draws(3);
    let mut merged = 0;
    for _ in 0..200 {
        let units = draws.units(3);
        let g = draws.matrix(3, 4);
        let factors = draws.vector(4);
        let twice = Matrix::from_fn(3, 4, |i, j| {
            factors[j] * g[(i, j)] * (1.0 + 1e-13 * f64::from(u8::from(i == 1)))
        });
        let here = Zonotope::new(draws.vector(3), Matrix::hcat(&[&g, &twice])).unwrap();
        let there = in_units(&here, &units);
        let (a, b) = (
            parallel::merge(&here, 1e-12).unwrap(),
            parallel::merge(&there, 1e-12).unwrap(),
        );
        equal_zonotopes("merge", &a, &b, &units);
        merged += usize::from(a.generators() == 4);
    }
    assert!(merged > 100, "{merged}");
}

#[test]
fn a_constrained_zonotope_in_other_units_is_the_same() {
    let mut draws = Draws(4);
    let mut verdicts = [0; 3];
    for n in 1..=4 {
        for case in 0..40 {
            let units = draws.units(n);
            let one = vec![1.0; n];
            let (p, q) = (n + 2 + case % 6, 1 + case % 3);
            let (here, there) = constrained(&mut draws, n, p, q, &units);
            let d = draws.vector(n);
            let e = multiplied(&d, &units);
            equal(
                "support",
                &[here.support(&d).unwrap()],
                &[there.support(&e).unwrap()],
            );
            let hulls = (
                here.interval_hull().unwrap(),
                there.interval_hull().unwrap(),
            );
            equal_boxes("hull", &hulls.0, &hulls.1, &units);
            assert_eq!(here.emptiness(), there.emptiness());
            let volumes = (here.volume().unwrap(), there.volume().unwrap());
            equal(
                "volume",
                &volume(volumes.0, &units),
                &volume(volumes.1, &one),
            );
            if n == 2 {
                let (v, w) = (here.vertices().unwrap(), there.vertices().unwrap());
                equal("vertices", &planar(v, &units), &planar(w, &one));
            }
            equal(
                "support vector",
                &divided(&here.support_vector(&d).unwrap(), &units),
                &there.support_vector(&e).unwrap(),
            );
            for stretch in [0.0, 0.7, 1.0, 1.3] {
                let middle = hulls.0.mid();
                let corner = hulls.0.upper();
                let x: Vec<f64> = middle
                    .iter()
                    .zip(&corner)
                    .map(|(m, c)| m + stretch * (c - m))
                    .collect();
                let verdict = here.contains(&points(&x)).unwrap();
                assert_eq!(
                    verdict,
                    there.contains(&points(&divided(&x, &units))).unwrap()
                );
                verdicts[verdict as usize] += 1;
            }
            let pair =
                |f: &dyn Fn(&ConstrainedZonotope) -> ConstrainedZonotope| (f(&here), f(&there));
            // Rescaling, bounds and removal errors are about ξ and have no units.
            let rescaled = pair(&|x| scott::rescale(x).unwrap());
            equal_zonotopes(
                "rescaling",
                rescaled.0.zonotope(),
                rescaled.1.zonotope(),
                &units,
            );
            assert_eq!(
                scott::coordinate_bounds(&here).unwrap(),
                scott::coordinate_bounds(&there).unwrap()
            );
            let reduced = pair(&|x| {
                let own = of_set(x.c(), &x.zonotope().radius());
                let x = scott::reduce(&x.divided_by(&own).unwrap(), n + 1, q - 1).unwrap_or_else(
                    |_| scott::reduce(&x.divided_by(&own).unwrap(), n + q, q - 1).unwrap(),
                );
                x.multiplied_by(&own).unwrap()
            });
            equal_zonotopes(
                "Scott's reduction",
                reduced.0.zonotope(),
                reduced.1.zonotope(),
                &units,
            );
            // A measurement of every component, in units of its own.
            let (mut c, of_y) = (draws.matrix(2, n), draws.units(2));
            if case % 2 == 0 {
                c.row_mut(0).fill(0.0);
                c[(0, n - 1)] = 1.0;
            }
            let y = c.mul_vec(&hulls.0.mid()).into_vec();
            let joined = |x: &ConstrainedZonotope, c: &Matrix, y: &[f64], v: &[f64]| {
                let target = Zonotope::new(y.to_vec(), Matrix::diagonal(v)).unwrap();
                x.generalized_intersection(c, &target.into()).unwrap()
            };
            let c_there = Matrix::from_fn(2, n, |i, j| c[(i, j)] * units[j] / of_y[i]);
            let a = joined(&here, &c, &y, &[0.25, 0.25]);
            let b = joined(
                &there,
                &c_there,
                &divided(&y, &of_y),
                &divided(&[0.25, 0.25], &of_y),
            );
            let hulls = (a.interval_hull().unwrap(), b.interval_hull().unwrap());
            equal_boxes("hull of an intersection", &hulls.0, &hulls.1, &units);
        }
    }
    let decided = [Containment::Inside, Containment::Outside].map(|v| verdicts[v as usize]);
    assert!(decided.iter().all(|&v| v > 20), "{verdicts:?}");
}

#[test]
fn a_polytope_in_other_units_is_the_same() {
    let mut draws = Draws(5);
    for n in 1..=3 {
        for case in 0..30 {
            let units = draws.units(n);
            let one = vec![1.0; n];
            let p = n + 1 + case % 4;
            let (x, y) = constrained(&mut draws, n, p, 1, &units);
            let of_z = |x: &ConstrainedZonotope| Polytope::of_zonotope(x.zonotope()).unwrap();
            for make in [&of_z as &dyn Fn(&ConstrainedZonotope) -> Polytope, &|x| {
                Polytope::enclosing(x).unwrap()
            }] {
                let (here, there) = (make(&x), make(&y));
                equal_boxes("hull", here.hull(), there.hull(), &units);
                equal(
                    "volume",
                    &volume(here.volume(), &units),
                    &volume(there.volume(), &one),
                );
                assert_eq!(here.vertices().len(), there.vertices().len());
                for (v, w) in here.vertices().iter().zip(there.vertices()) {
                    equal("vertex", &divided(v, &units), w);
                }
                assert_eq!(here.slabs().len(), there.slabs().len());
                for (a, b) in here.slabs().iter().zip(there.slabs()) {
                    // One half-space has many normals: those of the facets have a unit of their own.
                    let normal = multiplied(&a.normal, &units);
                    let at = (0..n).find(|&i| normal[i] != 0.0).unwrap();
                    let f = b.normal[at] / normal[at];
                    let scaled: Vec<f64> = normal.iter().map(|x| f * x).collect();
                    equal("normal", &scaled, &b.normal);
                    equal(
                        "range",
                        &[f * a.range.lo(), f * a.range.hi()],
                        &[b.range.lo(), b.range.hi()],
                    );
                }
                let mut lp = LinearProgram::new();
                let frames = (
                    here.frames(&mut lp).unwrap(),
                    there.frames(&mut lp).unwrap(),
                );
                assert_eq!(frames.0.len(), frames.1.len());
                for (a, b) in frames.0.iter().zip(&frames.1) {
                    equal_boxes("hull of a frame", &a.hull(), &b.hull(), &units);
                }
                let point = here.hull().mid();
                let (a, b) = (points(&point), points(&divided(&point, &units)));
                assert_eq!(here.contains(&a), there.contains(&b));
            }
        }
    }
}

#[test]
fn gaussians_in_other_units_are_the_same() {
    let mut draws = Draws(6);
    for n in 1..=4 {
        for case in 0..50 {
            let units = draws.units(n);
            let root = draws.matrix(n, n + case % 2);
            let p = root.gram();
            let p_there = Matrix::from_fn(n, n, |i, j| p[(i, j)] / units[i] / units[j]);
            let (f, g) = (Scaled::new(&p).factor(), Scaled::new(&p_there).factor());
            equal_rows("factor", &f, &g, &units);
            let c = draws.vector(n);
            let make = |c: Vec<f64>, p: &Matrix| Ellipsoid::new(c, p.clone(), 2.0).unwrap();
            let (here, there) = (make(c.clone(), &p), make(divided(&c, &units), &p_there));
            let x: Vec<f64> = c.iter().zip(draws.vector(n)).map(|(c, d)| c + d).collect();
            let away = divided(&x, &units);
            equal(
                "distance",
                &[here.squared_distance(&x).unwrap()],
                &[there.squared_distance(&away).unwrap()],
            );
            assert_eq!(here.contains(&x).unwrap(), there.contains(&away).unwrap());
            let d = draws.vector(n);
            equal(
                "support",
                &[here.support(&d).unwrap()],
                &[there.support(&multiplied(&d, &units)).unwrap()],
            );
            equal_boxes(
                "hull",
                &here.interval_hull().unwrap(),
                &there.interval_hull().unwrap(),
                &units,
            );
            let around = here.interval_hull().unwrap();
            let around_there = there.interval_hull().unwrap();
            assert_eq!(
                here.is_inside(&around).unwrap(),
                there.is_inside(&around_there).unwrap()
            );
            if n == 2 {
                let (v, w) = (here.outline(12).unwrap(), there.outline(12).unwrap());
                equal("outline", &planar(v, &units), &planar(w, &[1.0, 1.0]));
            }
            let g = draws.matrix(n, 3);
            let a = ZonotopicGaussian::new(c.clone(), g.clone(), p.clone()).unwrap();
            let b = ZonotopicGaussian::new(divided(&c, &units), rows(&g, &units), p_there).unwrap();
            equal_boxes(
                "confidence box",
                &a.confidence_box(9.0).unwrap(),
                &b.confidence_box(9.0).unwrap(),
                &units,
            );
        }
    }
}

/// Right: 4 − 0.9²/2 − 1.9²/2 in the plane; in space the cube less two corners of edge 2.5, each less three of 0.5.
#[test]
fn a_set_ten_orders_longer_than_wide_keeps_its_area_and_corners() {
    let set = |g: &[f64], b: f64, delta: f64| {
        let n = g.len();
        let z = Zonotope::new(vec![0.0; n], Matrix::diagonal(g)).unwrap();
        let a = Matrix::from_fn(1, n, |_, _| 1.0);
        ConstrainedZonotope::with_slack(z, a, vec![b], vec![delta]).unwrap()
    };
    for s in [
        [1e5, 1e-5],
        [1.0, 1.0],
        [1e160, 1e-170],
        [1e-170, 1e160],
        [1e150, 1e150],
    ] {
        let flat = set(&s, 0.5, 0.6);
        let area = flat.volume().unwrap().unwrap();
        assert!((area / (s[0] * s[1]) - 1.79).abs() < 1e-9, "{area:e}");
        assert_eq!(flat.vertices().unwrap().len(), 6);
        let polytope = Polytope::enclosing(&flat).unwrap();
        assert!((polytope.volume().unwrap() / (s[0] * s[1]) - 1.79).abs() < 1e-9);
        assert_eq!((polytope.vertices().len(), polytope.slabs().len()), (6, 3));
    }
    for s in [[1e5, 1e-5, 1.0], [1e160, 1e-170, 1e10]] {
        let solid = set(&s, 0.0, 0.5);
        let volume = solid.volume().unwrap().unwrap() / (s[0] * s[1] * s[2]);
        assert!((volume - 35.0 / 12.0).abs() < 1e-8, "{volume}");
    }
}

#[test]
fn hexagons_of_any_size_have_six_vertices() {
    for s in [1e160, 1e-170, 1.0] {
        let g = Matrix::from_rows(&[[s, 0.0, s], [0.0, s, s]]).unwrap();
        let z = Zonotope::new(vec![0.0; 2], g).unwrap();
        assert_eq!(z.vertices().unwrap().len(), 6);
        assert_eq!(
            ConstrainedZonotope::from(z.clone())
                .vertices()
                .unwrap()
                .len(),
            6,
            "{s:e}"
        );
        assert_eq!(
            Polytope::enclosing(&z.clone().into())
                .unwrap()
                .slabs()
                .len(),
            3
        );
        assert_eq!(Polytope::of_zonotope(&z).unwrap().slabs().len(), 1);
    }
}

/// The slab along (−0.001, 1000) is a facet though its normal is nearly an axis: area 12, not the box's 16.
#[test]
fn the_facets_of_a_zonotope_of_metres_and_milliradians_are_found() {
    let g = Matrix::from_rows(&[[1000.0, 0.0, 1000.0], [0.0, 0.001, 0.001]]).unwrap();
    let z = Zonotope::new(vec![0.0; 2], g).unwrap();
    let mut lp = LinearProgram::new();
    let found = Polytope::of_zonotope(&z).unwrap();
    assert_eq!(found.slabs().len(), 1);
    let area = found.simplified(&mut lp).unwrap().volume().unwrap();
    assert!((area - 12.0).abs() < 1e-9, "{area}");
    let enclosing = Polytope::enclosing(&z.into()).unwrap();
    assert!((enclosing.volume().unwrap() - 12.0).abs() < 1e-9);
    assert_eq!(enclosing.slabs().len(), 3);
}
