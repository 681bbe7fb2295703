//! Sets through nonlinear dynamics: the worked step of an independent implementation, images of points that
//! are never lost, sizes, and the counterexample to the theorem as printed.

mod draws;

use draws::Draws;
use num_rational::BigRational;
use serde_json::Value;
use zonobench_estimation::propagation::{
    Choice, Dynamics, Expansion, Remainder, first_order, first_order_about, mean_value,
    zonotope_first_order, zonotope_mean_value,
};
use zonobench_estimation::systems::{Measured, QuotientForm, Raimondo};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{ConstrainedZonotope, Interval, IntervalVector, Matrix, Zonotope, strip};

/// The reference rounds to nearest; outward rounding and other orders move its numbers by some 1e-15.
const TOLERANCE: f64 = 1e-12;

const SYSTEM: Raimondo = Raimondo {
    form: QuotientForm::Tight,
    output: Measured::Both,
};

const CHOICES: [Choice; 6] = [
    Choice::C1,
    Choice::C2,
    Choice::C3,
    Choice::C4,
    Choice::Xb,
    Choice::C4xb,
];

fn cases() -> (Value, Vec<Value>) {
    let text = include_str!("reference/cz_ex1_onestep.json");
    let file: Value = serde_json::from_str(text).unwrap();
    let cases = file["cases"].as_array().unwrap().clone();
    (file, cases)
}

fn vector(v: &Value) -> Vec<f64> {
    v.as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

fn matrix(v: &Value, cols: usize) -> Matrix {
    let rows: Vec<Vec<f64>> = v.as_array().unwrap().iter().map(vector).collect();
    if rows.is_empty() {
        Matrix::zeros(0, cols)
    } else {
        Matrix::from_rows(&rows).unwrap()
    }
}

fn set(v: &Value) -> ConstrainedZonotope {
    let g = matrix(&v["G"], 0);
    let a = matrix(&v["A"], g.cols());
    ConstrainedZonotope::new(vector(&v["c"]), g, a, vector(&v["b"])).unwrap()
}

fn noise() -> Zonotope {
    Zonotope::new(vec![0.0; 2], Matrix::identity(2).scale(0.4)).unwrap()
}

fn near(a: &[f64], b: &[f64]) {
    assert!(
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TOLERANCE),
        "{a:?} against {b:?}"
    );
}

fn hull_is(x: &ConstrainedZonotope, expected: &Value) {
    let hull = x.interval_hull().unwrap();
    near(&hull.lower(), &vector(&expected["hull"]["lo"]));
    near(&hull.upper(), &vector(&expected["hull"]["hi"]));
    if let Some(ng) = expected.get("ng") {
        assert_eq!(x.generators() as u64, ng.as_u64().unwrap());
    }
    if let Some(nc) = expected.get("nc") {
        assert_eq!(x.constraints() as u64, nc.as_u64().unwrap());
    }
}

fn full(x: &ConstrainedZonotope, choice: Choice) -> ConstrainedZonotope {
    let f = Dynamics::new(&SYSTEM, 0, &[]);
    let hull = x.interval_hull().unwrap();
    let w = noise().into();
    let mut lp = LinearProgram::new();
    first_order(
        &f,
        x,
        &hull,
        &w,
        choice,
        Remainder::Symmetric,
        Expansion::Full,
        &mut lp,
    )
    .unwrap()
}

fn mean(x: &ConstrainedZonotope, choice: Choice) -> ConstrainedZonotope {
    let f = Dynamics::new(&SYSTEM, 0, &[]);
    let hull = x.interval_hull().unwrap();
    mean_value(
        &f,
        x,
        &hull,
        &noise().into(),
        choice,
        &mut LinearProgram::new(),
    )
    .unwrap()
}

/// x with both measurements y = C x + v.
fn updated(x: &ConstrainedZonotope, y: &[f64]) -> ConstrainedZonotope {
    let c = Matrix::from_rows(&[[1.0, 0.0], [-1.0, 1.0]]).unwrap();
    let v = Zonotope::new(y.to_vec(), Matrix::identity(2).scale(0.4)).unwrap();
    x.generalized_intersection(&c, &v.into()).unwrap()
}

#[test]
fn one_step_is_that_of_the_reference() {
    let (file, cases) = cases();
    let f = Dynamics::new(&SYSTEM, 0, &[]);
    let y1 = vector(&file["y1"]);
    for case in &cases {
        let x = set(&case["X"]);
        hull_is(&x, case);
        let taylor = full(&x, Choice::C3);
        hull_is(&taylor, &case["FO_C3"]);
        hull_is(&updated(&taylor, &y1), &case["FO_C3_update_y1"]);
        if case.get("ZMV").is_none() {
            continue;
        }
        let expected = set(&case["MV_C1"]["Z"]);
        let found = mean(&x, Choice::C1);
        near(found.c(), expected.c());
        near(found.g().as_slice(), expected.g().as_slice());
        hull_is(&found, &case["MV_C1"]);
        let z = zonotope_mean_value(&f, x.zonotope(), &noise()).unwrap();
        let expected = set(&case["ZMV"]);
        near(z.c(), expected.c());
        near(z.g().as_slice(), expected.g().as_slice());
        let first = strip::intersect(&z, &[1.0, 0.0], y1[0], 0.4).unwrap();
        let both = strip::intersect(&first, &[-1.0, 1.0], y1[1], 0.4).unwrap();
        let expected = set(&case["ZMV_update_y1"]);
        near(both.c(), expected.c());
        near(both.g().as_slice(), expected.g().as_slice());
        hull_is(
            &zonotope_first_order(&f, x.zonotope(), &noise())
                .unwrap()
                .into(),
            &case["ZFO"],
        );
    }
}

#[test]
fn the_eight_enclosures_of_the_triangle_have_the_sizes_and_areas_found_before() {
    // [Rego2020, Fig. 1], without noise.
    let x = ConstrainedZonotope::new(
        vec![-1.0, 1.0],
        Matrix::from_rows(&[[0.2, 0.4, 0.2], [0.2, 0.0, -0.2]]).unwrap(),
        Matrix::from_rows(&[[2.0, 2.0, 2.0]]).unwrap(),
        vec![-3.0],
    );
    let x = x.unwrap();
    let f = Dynamics::new(&SYSTEM, 0, &[]);
    let hull = x.interval_hull().unwrap();
    let w = ConstrainedZonotope::point(&[0.0, 0.0]).unwrap();
    let mut lp = LinearProgram::new();
    let areas = [
        (Choice::C1, 4.843, 11.42),
        (Choice::C2, 3.539, 14.40),
        (Choice::C3, 6.276, 8.54),
        (Choice::C4, 4.843, 4.457),
    ];
    for (choice, by_mean, by_taylor) in areas {
        let image = mean_value(&f, &x, &hull, &w, choice, &mut lp).unwrap();
        assert_eq!((image.generators(), image.constraints()), (5, 1));
        let area = image.volume().unwrap().unwrap();
        assert!(
            (area - by_mean).abs() < 1e-3,
            "{choice:?}: mean value {area}"
        );
        let taylor = first_order(
            &f,
            &x,
            &hull,
            &w,
            choice,
            Remainder::Printed,
            Expansion::Full,
            &mut lp,
        )
        .unwrap();
        let area = taylor.volume().unwrap().unwrap();
        assert!(
            (area - by_taylor).abs() < 1e-2,
            "{choice:?}: first order {area}"
        );
        if choice == Choice::C4 {
            assert_eq!((taylor.generators(), taylor.constraints()), (29, 14));
        }
    }
    let taylor = first_order(
        &f,
        &x,
        &hull,
        &w,
        Choice::Xb,
        Remainder::Symmetric,
        Expansion::Full,
        &mut lp,
    )
    .unwrap();
    assert_eq!((taylor.generators(), taylor.constraints()), (22, 9));
    assert!((taylor.volume().unwrap().unwrap() - 1.395).abs() < 1e-3);
}

type Q = BigRational;

fn q(x: f64) -> Q {
    Q::from_float(x).unwrap()
}

/// f(x, w) of the system, exactly.
fn exact(x: &[Q], w: &[Q]) -> [Q; 2] {
    let quotient = &x[0] * &x[1] / (q(4.0) + &x[0]);
    [
        q(3.0) * &x[0] - &x[0] * &x[0] / q(7.0) - q(4.0) * &quotient + &w[0],
        q(3.0) * &quotient - q(2.0) * &x[1] + &w[1],
    ]
}

/// A set with one constraint that the point of coordinates `xi` satisfies exactly, and that point.
fn with_point(draws: &mut Draws, size: f64) -> (ConstrainedZonotope, Vec<Q>) {
    let dyadic = |x: f64| (x * 256.0).round() / 256.0;
    let xi: Vec<f64> = (0..4)
        .map(|_| {
            if draws.chance(0.5) {
                1.0
            } else {
                dyadic(draws.signed())
            }
        })
        .collect();
    let g = Matrix::from_fn(2, 4, |_, _| dyadic(size * draws.signed()));
    let a = Matrix::from_fn(1, 4, |_, _| dyadic(draws.signed()));
    let c: Vec<f64> = (0..2).map(|_| dyadic(1.0 + draws.signed())).collect();
    let b = a.mul_vec(&xi);
    let x = g
        .mul_vec(&xi)
        .iter()
        .zip(&c)
        .map(|(o, c)| q(*o) + q(*c))
        .collect();
    (ConstrainedZonotope::new(c, g, a, b).unwrap(), x)
}

#[test]
fn no_image_of_a_point_is_lost() {
    let mut draws = Draws::new(40);
    let f = Dynamics::new(&SYSTEM, 0, &[]);
    let directions: Vec<[f64; 2]> = (0..8)
        .map(|i| {
            [[1.0, 0.0], [0.7, 0.7], [0.0, 1.0], [-0.3, 0.9]][i % 4]
                .map(|x: f64| if i < 4 { x } else { -x })
        })
        .collect();
    let mut lp = LinearProgram::new();
    for case in 0..40 {
        let (x, point) = with_point(&mut draws, [0.3, 0.05, 1e-6][case % 3]);
        let w_value = [0.4 * if draws.chance(0.5) { 1.0 } else { -1.0 }, 0.1];
        let image = exact(&point, &w_value.map(q));
        let hull = x.interval_hull().unwrap();
        let w: ConstrainedZonotope = noise().into();
        for choice in CHOICES {
            let mut sets = vec![mean_value(&f, &x, &hull, &w, choice, &mut lp).unwrap()];
            for expansion in [Expansion::Full, Expansion::Lean] {
                let set = first_order(
                    &f,
                    &x,
                    &hull,
                    &w,
                    choice,
                    Remainder::Symmetric,
                    expansion,
                    &mut lp,
                );
                sets.push(set.unwrap());
            }
            for set in sets {
                for (d, bound) in directions.iter().zip(set.supports(&directions).unwrap()) {
                    assert!(
                        q(d[0]) * &image[0] + q(d[1]) * &image[1] <= q(bound),
                        "{choice:?}"
                    );
                }
            }
        }
        let z = x.zonotope();
        for set in [
            zonotope_mean_value(&f, z, &noise()),
            zonotope_first_order(&f, z, &noise()),
        ] {
            let set = set.unwrap();
            for d in &directions {
                assert!(q(d[0]) * &image[0] + q(d[1]) * &image[1] <= q(set.support(d).unwrap()));
            }
        }
    }
}

/// η(z) = z₁ z₂.
struct Product;

impl Function for Product {
    fn inputs(&self) -> usize {
        2
    }
    fn outputs(&self) -> usize {
        1
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        y[0] = x[0] * x[1];
    }
}

/// η(z) = 2⁻¹⁰⁰⁰ z₁ z₂.
struct Faint;

impl Function for Faint {
    fn inputs(&self) -> usize {
        2
    }
    fn outputs(&self) -> usize {
        1
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        y[0] = x[0] * x[1] * libm::exp2(-1000.0);
    }
}

#[test]
fn a_product_that_underflows_before_a_huge_generator_is_charged() {
    // Q g₂ = 2⁻¹⁰⁷⁶ is computed as 0, and g₁ = 2²⁰⁰ multiplies it: the image of ξ = (1, 1) is 2⁻⁸⁷⁶.
    let sizes = [200.0, -76.0].map(libm::exp2);
    let z: ConstrainedZonotope = Zonotope::new(vec![0.0; 2], Matrix::diagonal(&sizes))
        .unwrap()
        .into();
    let over = z.interval_hull().unwrap();
    for expansion in [Expansion::Full, Expansion::Lean] {
        let set = first_order_about(
            &Faint,
            &z,
            &over,
            &[0.0, 0.0],
            Remainder::Symmetric,
            expansion,
        );
        let bound = set.unwrap().support(&[1.0]).unwrap();
        assert!(bound >= libm::exp2(-876.0), "{bound:e}");
    }
}

#[test]
fn the_printed_remainder_loses_half_of_an_image_and_the_symmetric_one_nothing() {
    let z = ConstrainedZonotope::new(
        vec![0.0, 1.0],
        Matrix::identity(2),
        Matrix::zeros(0, 2),
        vec![],
    )
    .unwrap();
    let over = IntervalVector::from_bounds(&[-1.0, 0.0], &[1.0, 2.0]).unwrap();
    let bounds = |remainder| {
        let set = first_order_about(&Product, &z, &over, &[0.0, 0.0], remainder, Expansion::Full)
            .unwrap();
        let hull = set.interval_hull().unwrap();
        (hull[0].lo(), hull[0].hi())
    };
    let (lo, hi) = bounds(Remainder::Printed);
    assert!(
        (lo + 1.0).abs() < 1e-12 && (hi - 1.0).abs() < 1e-12,
        "[{lo}, {hi}]"
    );
    // The truth is [−2, 2]: z = (±1, 2).
    let (lo, hi) = bounds(Remainder::Symmetric);
    assert!(lo <= -2.0 && hi >= 2.0, "[{lo}, {hi}]");
}

#[test]
fn a_domain_that_touches_the_pole_is_an_error() {
    let x = ConstrainedZonotope::new(
        vec![-3.5, 0.0],
        Matrix::identity(2),
        Matrix::zeros(0, 2),
        vec![],
    )
    .unwrap();
    let f = Dynamics::new(&SYSTEM, 0, &[]);
    let hull = x.interval_hull().unwrap();
    let mut lp = LinearProgram::new();
    let w = noise().into();
    assert!(mean_value(&f, &x, &hull, &w, Choice::C2, &mut lp).is_err());
    assert!(
        first_order(
            &f,
            &x,
            &hull,
            &w,
            Choice::C4,
            Remainder::Symmetric,
            Expansion::Full,
            &mut lp
        )
        .is_err()
    );
}

/// η(z) = (z, z³).
struct Cube;

impl Function for Cube {
    fn inputs(&self) -> usize {
        1
    }
    fn outputs(&self) -> usize {
        2
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        (y[0], y[1]) = (x[0], x[0] * x[0] * x[0]);
    }
}

/// About h = 0.9, far from the center, z³ has at z = −1 a curvature of 0.8 where the Hessian over [−13, 1] says −39
/// to 3: each of the terms in p = c − h must bring all of its width.
#[test]
fn terms_off_the_center_bring_their_width() {
    let z = ConstrainedZonotope::new(
        vec![0.0],
        Matrix::identity(1),
        Matrix::zeros(0, 1),
        Vec::new(),
    );
    let over: IntervalVector = [Interval::new(-13.0, 1.0).unwrap()].into_iter().collect();
    for expansion in [Expansion::Full, Expansion::Lean] {
        let z = z.clone().unwrap();
        let set = first_order_about(&Cube, &z, &over, &[0.9], Remainder::Symmetric, expansion);
        // The slope of the linear part is 34.83: along (−36, 1) the set is longest at z = −1, where it holds (−1, −1).
        let bound = set.unwrap().supports(&[[-36.0, 1.0]]).unwrap()[0];
        assert!(bound >= 35.0, "{expansion:?}: {bound}");
    }
}

/// A set that is nearly all rounding box: z³ reaches 1 although the one generator reaches 10⁻³.
#[test]
fn a_rounding_box_brings_its_second_order_terms() {
    let z = Zonotope::with_rounding([0.0], Matrix::diagonal(&[1e-3]), [1.0]).unwrap();
    let over: IntervalVector = [Interval::new(-1.001, 1.001).unwrap()]
        .into_iter()
        .collect();
    for expansion in [Expansion::Full, Expansion::Lean] {
        let z = z.clone().into();
        let set = first_order_about(&Cube, &z, &over, &[0.0], Remainder::Symmetric, expansion);
        let ends = set.unwrap().supports(&[[0.0, 1.0], [0.0, -1.0]]).unwrap();
        assert!(
            ends[0] >= 1.003 && ends[1] >= 1.003,
            "{expansion:?}: {ends:?}"
        );
    }
}
