//! Reductions and strips against worked cases of an independent double-precision implementation.

use serde_json::Value;
use zonobench_sets::reduction::{scott, yang_scott};
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope, strip};

/// The reference rounds to nearest in other orders; its cases have entries below 20.
const TOLERANCE: f64 = 1e-12;

fn reference(name: &str) -> Value {
    let text = match name {
        "reduce" => include_str!("reference/cz_reduce.json"),
        _ => include_str!("reference/cz_strip.json"),
    };
    serde_json::from_str(text).unwrap()
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

fn near(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TOLERANCE)
}

#[test]
fn method_4_absorbs_the_generators_of_the_reference() {
    for case in reference("reduce")["generator_reduction"]
        .as_array()
        .unwrap()
    {
        let g = matrix(&case["G"], 0);
        let expected = matrix(&case["out"], 0);
        let z = Zonotope::new(vec![0.0; g.rows()], g).unwrap();
        let reduced = yang_scott::reduce(&z, case["target"].as_u64().unwrap() as usize).unwrap();
        assert!(
            near(reduced.g().as_slice(), expected.as_slice()),
            "{:?}\n{expected:?}",
            reduced.g()
        );
        assert!(reduced.r().iter().all(|&r| r < 1e-13));
    }
}

#[test]
fn ranges_hulls_and_eliminations_are_those_of_the_reference() {
    for case in reference("reduce")["constraint_elimination"]
        .as_array()
        .unwrap()
    {
        let x = set(&case["X"]);
        let side = |v: &Value| (vector(&v["lo"]), vector(&v["hi"]));
        let ranges = scott::coordinate_bounds(&x).unwrap();
        let (lo, hi): (Vec<f64>, Vec<f64>) = ranges.iter().map(|e| (e.lo(), e.hi())).unzip();
        assert!(
            near(&lo, &vector(&case["alg1_E"][0])) && near(&hi, &vector(&case["alg1_E"][1])),
            "{ranges:?}"
        );
        let hull = x.interval_hull().unwrap();
        let (lo, hi) = side(&case["hull"]);
        assert!(
            near(&hull.lower(), &lo) && near(&hull.upper(), &hi),
            "{hull:?}"
        );
        let free = scott::eliminate_constraints(&x, 0).unwrap();
        let expected = set(&case["Xbar"]);
        assert!(
            near(free.c(), expected.c()),
            "{:?} {:?}",
            free.c(),
            expected.c()
        );
        assert!(
            near(free.g().as_slice(), expected.g().as_slice()),
            "{:?}\n{:?}",
            free.g(),
            expected.g()
        );
        let (lo, hi) = side(&case["Xbar_hull"]);
        let hull = free.interval_hull().unwrap();
        assert!(
            near(&hull.lower(), &lo) && near(&hull.upper(), &hi),
            "{hull:?}"
        );
    }
}

#[test]
fn strips_give_the_zonotopes_of_the_reference() {
    for case in reference("strip").as_array().unwrap() {
        let z = Zonotope::new(vector(&case["c"]), matrix(&case["G"], 0)).unwrap();
        let (y, s) = (case["y"].as_f64().unwrap(), case["s"].as_f64().unwrap());
        let cut = strip::intersect(&z, &vector(&case["a"]), y, s).unwrap();
        let expected = set(&case["out"]);
        assert!(
            near(cut.c(), expected.c()),
            "{:?} {:?}",
            cut.c(),
            expected.c()
        );
        assert!(
            near(cut.g().as_slice(), expected.g().as_slice()),
            "{:?}\n{:?}",
            cut.g(),
            expected.g()
        );
    }
}
