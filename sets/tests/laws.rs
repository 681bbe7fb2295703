//! Every set against the laws of supports, hulls, maps and sums, by random examples.
//!
//! A set enters by implementing `Set` (and `Mapped` where it has maps and sums) and by one line at the
//! end. Tolerances are relative to the size of the numbers at hand: the laws hold in exact arithmetic,
//! and the sets account for rounding from one side only.

use proptest::collection::vec;
use proptest::prelude::*;
use std::fmt::Debug;
use zonobench_sets::{
    Containment, Ellipsoid, Interval, IntervalMatrix, IntervalVector, Matrix, Reduction, Zonotope,
    ZonotopicGaussian,
};

/// Rounding of sums of at most 40 products of numbers below 10³.
const SLACK: f64 = 1e-9;

/// A compact convex set.
trait Set: Clone + Debug {
    /// n.
    fn dim(&self) -> usize;
    /// max { dᵀx }.
    fn support(&self, d: &[f64]) -> f64;
    /// The smallest box around it.
    fn hull(&self) -> IntervalVector;
    /// A member, chosen by numbers from [−1, 1].
    fn member(&self, choice: &[f64]) -> Vec<f64>;
    /// False only if `x` is said to lie outside.
    fn may_contain(&self, x: &[f64]) -> bool;
}

/// A set with linear maps and Minkowski sums of its own kind.
trait Mapped: Set {
    fn linear_map(&self, m: &Matrix) -> Self;
    fn minkowski_sum(&self, y: &Self) -> Self;
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn points(x: &[f64]) -> Vec<Interval> {
    x.iter().map(|&x| Interval::point(x)).collect()
}

impl Set for Zonotope {
    fn dim(&self) -> usize {
        self.dim()
    }
    fn support(&self, d: &[f64]) -> f64 {
        self.support(d).unwrap()
    }
    fn hull(&self) -> IntervalVector {
        self.interval_hull().unwrap()
    }
    fn member(&self, choice: &[f64]) -> Vec<f64> {
        let moved = self.g().mul_vec(&choice[..self.generators()]);
        self.c().iter().zip(moved).map(|(c, g)| c + g).collect()
    }
    fn may_contain(&self, x: &[f64]) -> bool {
        // A member computed by rounding is off by less than this.
        let near = |x: f64| Interval::from_center_radius(x, SLACK);
        let x: Vec<Interval> = x.iter().map(|&x| near(x)).collect();
        self.contains(&x).unwrap() != Containment::Outside
    }
}

impl Mapped for Zonotope {
    fn linear_map(&self, m: &Matrix) -> Self {
        self.linear_map(m).unwrap()
    }
    fn minkowski_sum(&self, y: &Self) -> Self {
        self.minkowski_sum(y).unwrap()
    }
}

impl Set for IntervalVector {
    fn dim(&self) -> usize {
        self.dim()
    }
    fn support(&self, d: &[f64]) -> f64 {
        let sides = self.iter().zip(d);
        sides
            .map(|(side, d)| (d * side.lo()).max(d * side.hi()))
            .sum()
    }
    fn hull(&self) -> IntervalVector {
        self.clone()
    }
    fn member(&self, choice: &[f64]) -> Vec<f64> {
        let sides = self.iter().zip(choice);
        sides
            .map(|(side, t)| {
                (side.lo() + (0.5 + 0.5 * t) * (side.hi() - side.lo())).clamp(side.lo(), side.hi())
            })
            .collect()
    }
    fn may_contain(&self, x: &[f64]) -> bool {
        self.contains(x)
    }
}

impl Set for Ellipsoid {
    fn dim(&self) -> usize {
        self.dim()
    }
    fn support(&self, d: &[f64]) -> f64 {
        self.support(d).unwrap()
    }
    fn hull(&self) -> IntervalVector {
        self.interval_hull().unwrap()
    }
    fn member(&self, choice: &[f64]) -> Vec<f64> {
        let z = &choice[..self.dim()];
        let length = dot(z, z).sqrt().max(1.0);
        let scale = self.sigma().sqrt() / length;
        let moved = self.p().cholesky().unwrap().mul_vec(z);
        self.c()
            .iter()
            .zip(moved)
            .map(|(c, x)| c + scale * x)
            .collect()
    }
    fn may_contain(&self, x: &[f64]) -> bool {
        self.squared_distance(x).unwrap() <= self.sigma() * (1.0 + SLACK)
    }
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![8 => -10.0..10.0, 1 => Just(0.0), 1 => Just(1.0)]
}

fn matrix(rows: usize, cols: usize) -> impl Strategy<Value = Matrix> {
    vec(number(), rows * cols)
        .prop_map(move |v| Matrix::from_fn(rows, cols, |i, j| v[i * cols + j]))
}

fn zonotope(n: usize) -> impl Strategy<Value = Zonotope> {
    (0..12usize).prop_flat_map(move |p| {
        (vec(number(), n), matrix(n, p)).prop_map(|(c, g)| Zonotope::new(c, g).unwrap())
    })
}

fn interval_box(n: usize) -> impl Strategy<Value = IntervalVector> {
    (vec(number(), n), vec(0.0..5.0, n)).prop_map(|(lower, width)| {
        let upper: Vec<f64> = lower.iter().zip(width).map(|(l, w)| l + w).collect();
        IntervalVector::from_bounds(&lower, &upper).unwrap()
    })
}

/// A A ᵀ + I: positive definite with condition below 10⁴.
fn covariance(n: usize) -> impl Strategy<Value = Matrix> {
    matrix(n, n).prop_map(move |a| a.gram().add(&Matrix::identity(n)))
}

fn ellipsoid(n: usize) -> impl Strategy<Value = Ellipsoid> {
    (vec(number(), n), covariance(n), 0.1..20.0)
        .prop_map(|(c, p, sigma)| Ellipsoid::new(c, p, sigma).unwrap())
}

/// A number in [−1, 1], often at its ends.
fn choice() -> impl Strategy<Value = f64> {
    prop_oneof![2 => -1.0..1.0, 1 => Just(-1.0), 1 => Just(1.0)]
}

fn check_set(x: &impl Set, d: &[f64], e: &[f64], choice: &[f64]) -> Result<(), TestCaseError> {
    let n = x.dim();
    let member = x.member(choice);
    prop_assert!(dot(d, &member) <= x.support(d) + SLACK, "dᵀx ≤ ρ(d)");
    prop_assert!(x.may_contain(&member), "a member is never outside");
    for (side, &m) in x.hull().iter().zip(&member) {
        prop_assert!(
            side.lo() <= m + SLACK && m <= side.hi() + SLACK,
            "X ⊆ hull(X)"
        );
    }
    for (i, side) in x.hull().iter().enumerate() {
        let mut axis = vec![0.0; n];
        axis[i] = 1.0;
        prop_assert!((side.hi() - x.support(&axis)).abs() <= SLACK, "ρ(e_i)");
        axis[i] = -1.0;
        prop_assert!((side.lo() + x.support(&axis)).abs() <= SLACK, "−ρ(−e_i)");
    }
    let sum: Vec<f64> = d.iter().zip(e).map(|(d, e)| d + e).collect();
    prop_assert!(
        x.support(&sum) <= x.support(d) + x.support(e) + SLACK,
        "ρ is subadditive"
    );
    let scaled: Vec<f64> = d.iter().map(|d| 2.5 * d).collect();
    prop_assert!(
        (x.support(&scaled) - 2.5 * x.support(d)).abs() <= SLACK,
        "ρ(λ d) = λ ρ(d)"
    );
    let back: Vec<f64> = d.iter().map(|d| -d).collect();
    prop_assert!(
        x.support(d) + x.support(&back) >= -SLACK,
        "the width is nonnegative"
    );
    let beyond: Vec<f64> = x.hull().iter().map(|side| side.hi() + 1.0).collect();
    prop_assert!(!x.may_contain(&beyond), "beyond the hull is outside");
    Ok(())
}

fn check_mapped<S: Mapped>(
    x: &S,
    y: &S,
    m: &Matrix,
    d: &[f64],
    choice: &[f64],
) -> Result<(), TestCaseError> {
    let image = x.linear_map(m);
    let pulled = m.transpose().mul_vec(d);
    let scale = 1.0 + x.support(&pulled).abs();
    prop_assert!(
        (image.support(d) - x.support(&pulled)).abs() <= SLACK * scale,
        "ρ(M X, d) = ρ(X, Mᵀd)"
    );
    let member = x.member(choice);
    prop_assert!(image.may_contain(&m.mul_vec(&member)), "M x ∈ M X");
    let sum = x.minkowski_sum(y);
    let both = x.support(d) + y.support(d);
    prop_assert!(
        (sum.support(d) - both).abs() <= SLACK,
        "ρ(X ⊕ Y) = ρ(X) + ρ(Y)"
    );
    let total: Vec<f64> = member
        .iter()
        .zip(y.member(choice))
        .map(|(a, b)| a + b)
        .collect();
    prop_assert!(sum.may_contain(&total), "x + y ∈ X ⊕ Y");
    Ok(())
}

macro_rules! set_laws {
    ($($name:ident: $strategy:ident),*) => { $(
        proptest! {
            #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]
            #[test]
            fn $name((x, d, e) in (1..4usize).prop_flat_map(|n| ($strategy(n), vec(number(), n), vec(number(), n))),
                     t in vec(choice(), 12)) {
                check_set(&x, &d, &e, &t)?;
            }
        }
    )* };
}

macro_rules! map_laws {
    ($($name:ident: $strategy:ident),*) => { $(
        proptest! {
            #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]
            #[test]
            fn $name((x, y, m, d) in (1..4usize).prop_flat_map(|n| ($strategy(n), $strategy(n), matrix(n, n), vec(number(), n))),
                     t in vec(choice(), 12)) {
                check_mapped(&x, &y, &m, &d, &t)?;
            }
        }
    )* };
}

set_laws!(
    a_zonotope_obeys_the_laws_of_sets: zonotope,
    a_box_obeys_the_laws_of_sets: interval_box,
    an_ellipsoid_obeys_the_laws_of_sets: ellipsoid
);
map_laws!(a_zonotope_obeys_the_laws_of_maps_and_sums: zonotope);

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_reduced_zonotope_contains_the_original_and_has_its_hull(
        (z, d) in (1..4usize).prop_flat_map(|n| (zonotope(n), vec(number(), n))),
        extra in 0..8usize,
    ) {
        let n = z.dim();
        for method in [Reduction::Combastel, Reduction::Girard] {
            let reduced = method.reduce_order(&z, n + extra).unwrap();
            prop_assert!(reduced.generators() <= n + extra);
            prop_assert!(z.support(&d).unwrap() <= reduced.support(&d).unwrap() + SLACK);
            let hulls = (z.interval_hull().unwrap(), reduced.interval_hull().unwrap());
            for (a, b) in hulls.0.iter().zip(hulls.1.iter()) {
                prop_assert!((a.lo() - b.lo()).abs() < SLACK && (a.hi() - b.hi()).abs() < SLACK);
            }
            let columns = method.reduce_columns(z.g(), n + extra);
            prop_assert_eq!(columns.cols(), z.generators().min(n + extra));
            for (a, b) in columns.abs_row_sums().iter().zip(z.g().abs_row_sums()) {
                prop_assert!((a - b).abs() < SLACK);
            }
            if z.generators() <= n + extra {
                prop_assert_eq!(&reduced, &z);
            }
        }
    }

    #[test]
    fn an_update_contains_every_state_that_agrees_with_the_measurement(
        (x, v, k, c) in (1..4usize, 1..3usize)
            .prop_flat_map(|(n, q)| (zonotope(n), zonotope(q), matrix(n, q), matrix(q, n))),
        t in vec(choice(), 12),
        s in vec(choice(), 12),
    ) {
        let (state, noise) = (x.member(&t), v.member(&s));
        let y: Vec<f64> = c.mul_vec(&state).iter().zip(&noise).map(|(a, b)| a + b).collect();
        let updated = x.update(&k, &c, &y, &v).unwrap();
        prop_assert!(updated.may_contain(&state));
        prop_assert_eq!(updated.generators(), x.generators() + v.generators());
    }

    #[test]
    fn an_interval_map_contains_the_images_under_its_matrices(
        (x, a, b) in (1..4usize).prop_flat_map(|n| (zonotope(n), matrix(n, n), matrix(n, n))),
        t in vec(choice(), 12),
        share in 0.0..1.0,
    ) {
        let n = x.dim();
        let bound = |f: fn(f64, f64) -> f64| Matrix::from_fn(n, n, |i, j| f(a[(i, j)], b[(i, j)]));
        let m = IntervalMatrix::from_bounds(&bound(f64::min), &bound(f64::max)).unwrap();
        let one = Matrix::from_fn(n, n, |i, j| a[(i, j)] + share * (b[(i, j)] - a[(i, j)]));
        let image = x.interval_map(&m).unwrap();
        prop_assert!(image.may_contain(&one.mul_vec(&x.member(&t))));
    }

    #[test]
    fn the_area_is_that_of_the_polygon_and_members_lie_in_it(z in zonotope(2), t in vec(choice(), 12)) {
        let v = z.vertices().unwrap();
        let edges = (0..v.len()).map(|i| (v[i], v[(i + 1) % v.len()]));
        let shoelace: f64 = edges.clone().map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum();
        let area = z.volume().unwrap();
        prop_assert!((shoelace - area).abs() <= SLACK * (1.0 + area));
        let x = z.member(&t);
        for (a, b) in edges {
            let left = (b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0]);
            prop_assert!(left >= -SLACK * (1.0 + area), "the polygon turns left around x");
        }
    }

    #[test]
    fn a_box_is_a_zonotope(x in (1..4usize).prop_flat_map(interval_box), t in vec(choice(), 12)) {
        let z = Zonotope::from_box(&x).unwrap();
        let member = Set::member(&x, &t);
        prop_assert!(z.interval_hull().unwrap().contains_box(&x));
        prop_assert_ne!(z.contains(&points(&member)).unwrap(), Containment::Outside);
    }

    #[test]
    fn the_confidence_box_is_the_hull_of_zonotope_plus_ellipsoid(
        (z, p) in (1..4usize).prop_flat_map(|n| (zonotope(n), covariance(n))),
        sigma in 0.1..20.0,
    ) {
        let n = z.dim();
        let x = ZonotopicGaussian::new(z.c().to_vec(), z.g().clone(), p.clone()).unwrap();
        let ellipsoid = Ellipsoid::new(vec![0.0; n], p, sigma).unwrap();
        for (i, side) in x.confidence_box(sigma).unwrap().iter().enumerate() {
            let mut d = vec![0.0; n];
            d[i] = 1.0;
            let support = z.support(&d).unwrap() + ellipsoid.support(&d).unwrap();
            prop_assert!((side.hi() - support).abs() < SLACK);
        }
    }
}
