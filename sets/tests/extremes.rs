//! Numbers at the ends of the f64: near overflow, near underflow, subnormal, halfway between two. What an adversary
//! found, and a bounded search for more of it against exact rational arithmetic.

mod rational;

use num_traits::{Signed, Zero};
use rational::{Q, has, q, qs};
use zonobench_sets::lp::{Emptiness, LinearProgram};
use zonobench_sets::number::Real;
use zonobench_sets::reduction::{combastel, girard, parallel, scott};
use zonobench_sets::rounding::{ETA, gamma};
use zonobench_sets::{
    ConstrainedZonotope, Containment, Interval, IntervalMatrix, IntervalVector, Matrix, Polytope,
    SetError, Slab, Zonotope,
};

const MAX: f64 = f64::MAX;
const TINY: f64 = f64::MIN_POSITIVE;

/// f64 that rounding rules go wrong at, the same every time.
struct Adversary(u64);

impl Adversary {
    fn bits(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 ^ (self.0 >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    /// ±2^e (1 + m 2⁻⁵²) with a mantissa that is nearly empty, nearly full or halfway.
    fn near(&mut self, e: i32) -> f64 {
        let mantissa = match self.below(6) {
            0 => 0,
            1 => 1 + self.below(3),
            2 => (1 << 52) - 1 - self.below(3),
            3 => (1 << 51) + self.below(2),
            _ => self.bits() >> 12,
        };
        let x = f64::from_bits(1023 << 52 | mantissa);
        let sign = if self.below(2) == 0 { 1.0 } else { -1.0 };
        sign * libm::ldexp(x, e)
    }

    /// Any finite number, those at the ends and near 1 above all.
    fn number(&mut self) -> f64 {
        loop {
            let x = match self.below(9) {
                0 => 0.0,
                1 => self.near(1023),
                2 => {
                    let e = -1022 - self.below(3) as i32;
                    self.near(e)
                }
                3 => f64::from_bits(self.below(1 << 53)),
                4 => -f64::from_bits(1 + self.below(4)),
                5 => f64::from_bits(self.bits()),
                6 => libm::ldexp(1.0, self.below(2046) as i32 - 1022),
                _ => {
                    let e = self.below(5) as i32 - 2;
                    self.near(e)
                }
            };
            if x.is_finite() {
                return x;
            }
        }
    }

    /// A number of the size 2^e, or smaller, or 0.
    fn of_size(&mut self, e: i32) -> f64 {
        match self.below(5) {
            0 => 0.0,
            1 => {
                let smaller = e - self.below(60) as i32;
                self.near(smaller.max(-1074))
            }
            _ => self.near(e),
        }
    }

    fn interval(&mut self) -> Interval {
        let a = self.number();
        let b = match self.below(3) {
            0 => a,
            1 => a.next_up(),
            _ => self.number(),
        };
        if !b.is_finite() {
            return Interval::point(a);
        }
        Interval::new(a.min(b), a.max(b)).unwrap()
    }
}

fn assert_holds(result: Interval, exact: &Q, case: impl Fn() -> String) {
    let above = result.lo() == f64::NEG_INFINITY || q(result.lo()) <= *exact;
    let below = result.hi() == f64::INFINITY || *exact <= q(result.hi());
    assert!(above && below, "{}: {result:?}", case());
    for bound in [result.lo(), result.hi()] {
        assert!(
            !bound.is_nan() && bound.to_bits() != (-0.0_f64).to_bits(),
            "{}: {result:?}",
            case()
        );
    }
}

#[test]
fn a_product_with_a_power_of_two_that_is_rounded_up_to_the_smallest_normal_number_is_outward() {
    let below = f64::from_bits(0x001F_FFFF_FFFF_FFFF);
    let exact = q(below) * q(0.5);
    for result in [
        Interval::point(below) * 0.5,
        Interval::point(below) / 2.0,
        0.5 * Interval::point(below),
        -(Interval::point(-below) * 0.5),
    ] {
        assert_holds(result, &exact, || "half".into());
    }
    let below_one = 1.0_f64.next_down();
    let exact = q(below_one) * q(TINY);
    assert_holds(Interval::point(below_one) * TINY, &exact, || "tiny".into());
}

#[test]
fn no_operation_on_intervals_leaves_out_an_exact_result_or_makes_a_negative_zero() {
    let mut draw = Adversary(7);
    for _ in 0..6000 {
        let (a, b, s) = (draw.interval(), draw.interval(), draw.number());
        let scale = s + 0.0;
        for x in [a.lo(), a.hi()] {
            let case = |op: &str| format!("{a:?} {op} {b:?}, {scale:e}");
            for y in [b.lo(), b.hi()] {
                let (x, y) = (q(x), q(y));
                assert_holds(a + b, &(&x + &y), || case("+"));
                assert_holds(a - b, &(&x - &y), || case("-"));
                assert_holds(a * b, &(&x * &y), || case("*"));
                if !y.is_zero() && !b.contains(0.0) {
                    assert_holds(a / b, &(&x / &y), || case("/"));
                }
            }
            let x = q(x);
            assert_holds(a * scale, &(&x * q(scale)), || case("* scale"));
            assert_holds(a + scale, &(&x + q(scale)), || case("+ scale"));
            if scale != 0.0 {
                assert_holds(a / scale, &(&x / q(scale)), || case("/ scale"));
            }
            assert_holds(a.sqr(), &(&x * &x), || case("sqr"));
            assert_holds(a.abs(), &x.abs(), || case("abs"));
            assert_holds(-a, &-x.clone(), || case("neg"));
            let around = Interval::from_center_radius(a.mid(), a.rad());
            assert_holds(around, &x, || case("mid and rad"));
            if a.lo() >= 0.0 {
                let root = a.sqrt();
                assert!(q(root.lo()) * q(root.lo()) <= x, "{a:?}");
                assert!(q(root.hi()) * q(root.hi()) >= x, "{a:?}");
            }
        }
        for set in [a.sin(), a.cos(), a.tan(), a.atan(), a.hull(&b), a.abs()] {
            for bound in [set.lo(), set.hi()] {
                assert!(!bound.is_nan() && bound.to_bits() != (-0.0_f64).to_bits());
            }
        }
        if let Some(both) = a.intersect(&b) {
            assert!(both.is_subset(a) && both.is_subset(b));
        }
    }
}

#[test]
fn a_zonotope_on_the_line_whose_radius_overflows_holds_no_more_than_it_does() {
    let ulp = MAX - MAX.next_down();
    let g = Matrix::from_rows(&[[MAX - 2.0 * ulp, 0.51 * ulp, 0.51 * ulp]]).unwrap();
    let z = Zonotope::with_rounding(vec![0.0], g, vec![0.5 * ulp]).unwrap();
    let verdict = z.contains(&[Interval::point(MAX)]).unwrap();
    assert_ne!(verdict, Containment::Inside);
}

/// The verdicts of both representations of a zonotope, against the exact answer.
fn judge(z: &Zonotope, x: &[f64], counts: &mut [usize; 2]) {
    let box_of: Vec<Interval> = x.iter().map(|&x| Interval::point(x)).collect();
    let cz = ConstrainedZonotope::from(z.clone());
    let inside = has(&cz, &qs(x));
    match z.contains(&box_of).unwrap() {
        Containment::Inside => assert!(inside, "{z:?} {x:?}"),
        Containment::Outside => assert!(!inside, "{z:?} {x:?}"),
        Containment::Undecided => counts[0] += 1,
    }
    // A constrained zonotope's `Inside` is up to the rounding of the check; its `Outside` is a proof.
    match cz.contains(&box_of) {
        Ok(Containment::Outside) => assert!(!inside, "{z:?} {x:?}"),
        Ok(_) => {}
        Err(error) => assert!(matches!(error, SetError::NotFinite { .. }), "{error}"),
    }
    if let Ok(hull) = cz.interval_hull() {
        assert!(!inside || hull.contains(x), "{z:?} {x:?} {hull:?}");
    }
    counts[1] += 1;
}

#[test]
fn verdicts_about_zonotopes_of_any_size_are_never_wrong() {
    let mut draw = Adversary(11);
    let mut counts = [0, 0];
    for trial in 0..1500 {
        let n = 1 + trial % 3;
        let p = draw.below(5) as usize;
        let e = [1023, 1020, 500, 0, -500, -1020, -1060][draw.below(7) as usize];
        let c: Vec<f64> = (0..n).map(|_| draw.of_size(e)).collect();
        let g = Matrix::from_fn(n, p, |_, _| draw.of_size(e));
        let r: Vec<f64> = (0..n).map(|_| draw.of_size(e - 40).abs()).collect();
        let Ok(z) = Zonotope::with_rounding(c.clone(), g.clone(), r.clone()) else {
            continue;
        };
        // A vertex, rounded, its neighbour, or anything of this size.
        let signs: Vec<f64> = (0..p)
            .map(|_| [-1.0, 1.0][draw.below(2) as usize])
            .collect();
        let x: Vec<f64> = (0..n)
            .map(|i| {
                let vertex = (0..p).fold(c[i], |x, j| x + g[(i, j)] * signs[j]);
                let x = match draw.below(4) {
                    0 => vertex,
                    1 => vertex + r[i],
                    2 => (vertex + r[i]).next_up(),
                    _ => draw.of_size(e),
                };
                if x.is_finite() { x } else { x.signum() * MAX }
            })
            .collect();
        judge(&z, &x, &mut counts);
    }
    assert!(counts[1] > 1000, "{counts:?}");
}

#[test]
fn a_point_set_is_asked_for_its_neighbours_at_any_size() {
    for x in [0.0, TINY, 1.0, 1e19, 1e20, 1e21, 1e36, 1e300, MAX] {
        for sign in [1.0, -1.0] {
            let c = sign * x;
            let set = ConstrainedZonotope::from(Zonotope::point(&[c]).unwrap());
            let at = |y: f64| set.contains(&[Interval::point(y)]).unwrap();
            assert_eq!(at(c), Containment::Inside, "{c:e}");
            // Nearer than 2 η is not told apart.
            if c.abs() < MAX && c.abs() >= 1.0 {
                assert_eq!(at(c.next_up()), Containment::Outside, "{c:e}");
                assert_eq!(at(c.next_down()), Containment::Outside, "{c:e}");
            }
        }
    }
}

#[test]
fn programs_without_rows_or_columns_are_answered() {
    let mut lp = LinearProgram::new();
    lp.load(&Matrix::zeros(0, 0), &[], &[]).unwrap();
    assert_eq!(lp.emptiness(), Emptiness::NonEmpty([].into()));
    assert_eq!(lp.maximize(&[]).unwrap().upper, 0.0);
    assert!(lp.maximize_by_interior_point(&[]).unwrap() <= 2.0 * ETA);
    lp.load(&Matrix::zeros(2, 0), &[0.0, 1e30], &[0.0, 1e30])
        .unwrap();
    assert_eq!(lp.emptiness(), Emptiness::NonEmpty([].into()));
    lp.load(&Matrix::zeros(2, 0), &[0.0, 1e30], &[0.0, 1e29])
        .unwrap();
    assert_eq!(lp.emptiness(), Emptiness::Empty);
    assert!(matches!(lp.maximize(&[]), Err(SetError::Empty { .. })));
    lp.load(&Matrix::zeros(0, 2), &[], &[]).unwrap();
    assert!(matches!(lp.emptiness(), Emptiness::NonEmpty(_)));
    assert!(lp.maximize(&[1.0, -2.0]).unwrap().upper >= 3.0);
    assert!(lp.maximize_by_interior_point(&[1.0, -2.0]).unwrap() >= 3.0);
    lp.load(&Matrix::zeros(1, 2), &[1e300], &[0.0]).unwrap();
    assert_eq!(lp.emptiness(), Emptiness::Empty);
}

#[test]
fn rows_whose_sizes_overflow_verify_no_point_that_misses_them() {
    let mut lp = LinearProgram::new();
    lp.load(&Matrix::column(&[1e308]), &[MAX], &[0.0]).unwrap();
    assert_eq!(lp.emptiness(), Emptiness::Empty);
    // The slack reaches, just.
    lp.load(&Matrix::column(&[1e308]), &[MAX], &[1e308])
        .unwrap();
    assert!(matches!(lp.emptiness(), Emptiness::NonEmpty(_)));
}

#[test]
fn programs_of_any_size_are_bounded_and_their_points_meet_the_rows() {
    let mut draw = Adversary(13);
    let (mut empty, mut points, mut open) = (0, 0, 0);
    for _ in 0..1200 {
        let (m, n) = (draw.below(4) as usize, draw.below(5) as usize);
        let sizes: Vec<i32> = (0..m)
            .map(|_| [1022, 400, 70, 0, 0, -300, -1030][draw.below(7) as usize])
            .collect();
        let a = Matrix::from_fn(m, n, |i, _| draw.of_size(sizes[i]));
        let b: Vec<f64> = sizes.iter().map(|&e| draw.of_size(e)).collect();
        let delta: Vec<f64> = sizes
            .iter()
            .map(|&e| {
                if draw.below(2) == 0 {
                    0.0
                } else {
                    draw.of_size(e).abs()
                }
            })
            .collect();
        let d: Vec<f64> = (0..n).map(|_| draw.of_size(0)).collect();
        let mut lp = LinearProgram::new();
        lp.load(&a, &b, &delta).unwrap();
        let exact = rational::maximum(&a, &b, &delta, &d);
        let case = || format!("{a:?} {b:?} {delta:?} {d:?}");
        match (lp.maximize(&d), &exact) {
            (Ok(found), Some(exact)) => assert!(q(found.upper) >= *exact, "{}", case()),
            (Ok(_), None) => {}
            (Err(SetError::Empty { .. }), None) => {}
            (Err(error), _) => panic!("{error}: {}", case()),
        }
        if let Ok(upper) = lp.maximize_by_interior_point(&d)
            && let Some(exact) = &exact
        {
            assert!(q(upper) >= *exact, "{}", case());
        }
        match lp.emptiness() {
            Emptiness::Empty => {
                empty += 1;
                assert!(exact.is_none(), "{}", case());
            }
            Emptiness::NonEmpty(xi) => {
                points += 1;
                for i in 0..m {
                    let row = a.row(i).iter().zip(&xi);
                    let value = row.fold(-q(b[i]), |s, (&a, &x)| s + q(a) * q(x)).abs();
                    let largest = a.row(i).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                    let size = a.row(i).iter().fold(q(b[i]).abs(), |s, &a| s + q(a).abs());
                    let unit = q(2.0) * q(ETA) * (q(1.0) + q(largest));
                    let sigma = q(2.0) * q(gamma(n + 2)) * size + unit;
                    assert!(value <= q(delta[i]) + sigma, "{}", case());
                }
            }
            Emptiness::Undecided { .. } => open += 1,
        }
    }
    assert!(empty > 100 && points > 100, "{empty} {points} {open}");
}

#[test]
fn a_polytope_is_asked_only_for_points_of_its_dimension() {
    let sides = IntervalVector::from_bounds(&[-1.0, -1.0], &[1.0, 1.0]).unwrap();
    let slab = Slab {
        normal: vec![1.0, 1.0],
        range: Interval::new(-1.0, 1.0).unwrap(),
    };
    for polytope in [
        Polytope::from_box(&sides),
        Polytope::new(sides.clone(), vec![slab]).unwrap(),
    ] {
        assert_eq!(polytope.contains(&[]), Containment::Undecided);
        assert_eq!(polytope.contains(&[Interval::ZERO]), Containment::Undecided);
        assert_eq!(polytope.contains(&[Interval::ZERO; 2]), Containment::Inside);
    }
}

#[test]
fn a_slab_of_infinite_range_is_a_half_space_or_nothing() {
    let set =
        ConstrainedZonotope::from(Zonotope::new(vec![1.0, 2.0], Matrix::identity(2)).unwrap());
    let upward = Interval::new(3.5, 4.0).unwrap() / Interval::new(0.0, 1.0).unwrap();
    assert!(upward.is_entire());
    // The half line [3.5, ∞) as a quotient gives it: 1 over [0⁺, 2/7].
    let half_line = Interval::ONE / Interval::new(f64::from_bits(1), 2.0 / 7.0).unwrap();
    assert!(half_line.lo() >= 3.4 && half_line.hi() == f64::INFINITY);
    let slab = |range| Slab {
        normal: vec![1.0, 1.0],
        range,
    };
    let cut = set
        .within(&[slab(half_line), slab(Interval::ENTIRE)])
        .unwrap();
    assert_eq!(cut.constraints(), 1);
    let at = |x: f64, y: f64| cut.contains(&[x, y].map(Interval::point)).unwrap();
    assert_eq!(at(1.9, 2.9), Containment::Inside);
    assert_eq!(at(0.5, 1.5), Containment::Outside);
    let beyond = Interval::ONE / Interval::new(f64::from_bits(1), 0.1).unwrap();
    assert!(matches!(
        set.within(&[slab(beyond)]),
        Err(SetError::Empty { .. })
    ));
}

/// A zonotope of the size 2^e and a vertex of it, exactly.
fn with_vertex(draw: &mut Adversary, n: usize, e: i32) -> Option<(Zonotope, Vec<Q>)> {
    let p = draw.below(5) as usize;
    let c: Vec<f64> = (0..n).map(|_| draw.of_size(e)).collect();
    let g = Matrix::from_fn(n, p, |_, _| draw.of_size(e));
    let r: Vec<f64> = (0..n).map(|_| draw.of_size(e - 45).abs()).collect();
    let mut x = qs(&c);
    for j in 0..p {
        let sign = draw.below(2) == 0;
        for (x, &g) in x.iter_mut().zip(&g.col(j)) {
            *x += if sign { q(g) } else { -q(g) };
        }
    }
    for (x, &r) in x.iter_mut().zip(&r) {
        *x += q(r);
    }
    Some((Zonotope::with_rounding(c, g, r).ok()?, x))
}

fn product(m: &Matrix, x: &[Q]) -> Vec<Q> {
    let row = |i: usize| m.row(i).iter().zip(x).map(|(&m, x)| q(m) * x);
    (0..m.rows())
        .map(|i| row(i).fold(Q::zero(), |s, t| s + t))
        .collect()
}

/// That the set, if there is one, holds `x`; one that is not finite is an error.
fn assert_kept(
    set: Result<ConstrainedZonotope, SetError>,
    x: &[Q],
    kept: &mut usize,
    case: impl Fn() -> String,
) {
    match set {
        Ok(set) => {
            assert!(has(&set, x), "{}: {set:?}", case());
            *kept += 1;
        }
        Err(SetError::NotFinite { .. }) => {}
        Err(error) => panic!("{}: {error}", case()),
    }
}

#[test]
fn operations_on_sets_of_any_size_lose_no_vertex() {
    let mut draw = Adversary(17);
    let mut kept = 0;
    let sizes = [1022, 1000, 520, 300, 0, -300, -520, -1000, -1022, -1070];
    for trial in 0..700 {
        let n = 1 + trial % 3;
        let e = sizes[draw.below(10) as usize];
        let Some((z, x)) = with_vertex(&mut draw, n, e) else {
            continue;
        };
        let case = |op: &str| format!("{op} of {z:?}");
        let cz = |z: Result<Zonotope, SetError>| z.map(ConstrainedZonotope::from);

        let em = sizes[draw.below(10) as usize];
        let m = Matrix::from_fn(n, n, |_, _| draw.of_size(em));
        let t: Vec<f64> = (0..n).map(|_| draw.of_size(e)).collect();
        let plus = |a: Vec<Q>, b: &[Q]| -> Vec<Q> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        let image = plus(product(&m, &x), &qs(&t));
        assert_kept(cz(z.affine_map(&m, &t)), &image, &mut kept, || {
            format!("{m:?} {t:?} {}", case("map"))
        });
        let wide = Matrix::from_fn(n, n, |i, j| m[(i, j)].next_up());
        if wide.is_finite() {
            let both = IntervalMatrix::from_fn(n, n, |i, j| {
                Interval::new(m[(i, j)], wide[(i, j)]).unwrap()
            });
            let corner = product(&wide, &x);
            assert_kept(cz(z.interval_map(&both)), &corner, &mut kept, || {
                format!("{both:?} {}", case("interval map"))
            });
        }
        if let Some((y, point)) = with_vertex(&mut draw, n, e) {
            let sum = plus(x.clone(), &point);
            assert_kept(cz(z.minkowski_sum(&y)), &sum, &mut kept, || {
                format!("{y:?} {}", case("sum"))
            });
        }
        let least = n + draw.below(2) as usize;
        for reduced in [
            combastel::reduce(&z, least),
            girard::reduce(&z, least),
            girard::reduce_scaled(&z, least),
            parallel::merge(&z, 1e-3),
            Ok(z.clone().fold()),
        ] {
            assert_kept(cz(reduced), &x, &mut kept, || case("reduction"));
        }

        let rows = 1 + draw.below(2) as usize;
        let ec = sizes[draw.below(10) as usize];
        let c = Matrix::from_fn(rows, n, |_, _| draw.of_size(ec));
        let k = Matrix::from_fn(n, rows, |_, _| draw.of_size(-ec.clamp(-1000, 1000)));
        if let Some((v, noise)) = with_vertex(&mut draw, rows, e) {
            let y: Vec<f64> = (0..rows).map(|_| draw.of_size(e)).collect();
            let cx = product(&c, &x);
            let innovation: Vec<Q> = (0..rows).map(|i| q(y[i]) - &cx[i] - &noise[i]).collect();
            let updated = plus(product(&k, &innovation), &x);
            assert_kept(cz(z.update(&k, &c, &y, &v)), &updated, &mut kept, || {
                format!("{k:?} {c:?} {y:?} {v:?} {}", case("update"))
            });
        }

        let d: Vec<f64> = c.row(0).to_vec();
        let along = product(&Matrix::from_rows(&[&d[..]]).unwrap(), &x)[0].abs();
        if along < q(MAX) {
            let set = ConstrainedZonotope::from(z.clone());
            let offset = rational::up(&along);
            if !offset.is_finite() || q(offset) < along {
                continue;
            }
            let cut = set.intersect_halfspace(&d, offset);
            assert_kept(cut.clone(), &x, &mut kept, || {
                format!("{d:?} {offset:e} {}", case("half-space"))
            });
            if let Ok(cut) = cut {
                let reduced = scott::reduce(&cut, n + 1, 0);
                assert_kept(reduced, &x, &mut kept, || {
                    format!("{d:?} {offset:e} {}", case("Scott's reduction"))
                });
            }
        }
    }
    assert!(kept > 3000, "{kept}");
}
