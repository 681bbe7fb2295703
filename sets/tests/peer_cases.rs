//! Cases out of the tests of other set libraries, read from the file that ZONOBENCH_PEER_CASES names.
//!
//! Where the variable is unset the test says that it is skipped. Cases of operations that this crate has
//! not are counted and named.

use serde_json::Value;
use zonobench_sets::lp::Emptiness;
use zonobench_sets::reduction::{girard, parallel};
use zonobench_sets::{
    ConstrainedZonotope, Containment, Interval, IntervalVector, Matrix, Zonotope,
};

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

fn zonotope(v: &Value) -> Zonotope {
    Zonotope::new(vector(&v["c"]), matrix(&v["G"], 0)).unwrap()
}

fn set(v: &Value) -> ConstrainedZonotope {
    let g = matrix(&v["G"], 0);
    let a = matrix(&v["A"], g.cols());
    ConstrainedZonotope::new(vector(&v["c"]), g, a, vector(&v["b"])).unwrap()
}

/// The directions of an object's keys "[1,0]", with their values.
fn by_direction(v: &Value) -> Vec<(Vec<f64>, &Value)> {
    let object = v.as_object().unwrap();
    object
        .iter()
        .map(|(key, value)| (vector(&serde_json::from_str(key).unwrap()), value))
        .collect()
}

fn near(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    for (x, y) in a.iter().zip(b) {
        assert!(
            (x - y).abs() <= tolerance * (1.0 + y.abs()),
            "{a:?} against {b:?}"
        );
    }
}

fn same_points(found: &[[f64; 2]], expected: &Value, tolerance: f64) {
    let expected: Vec<Vec<f64>> = expected.as_array().unwrap().iter().map(vector).collect();
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for e in &expected {
        assert!(
            found
                .iter()
                .any(|f| (f[0] - e[0]).abs() + (f[1] - e[1]).abs() <= tolerance),
            "{e:?} in {found:?}"
        );
    }
}

fn points(v: &Value) -> Vec<Vec<Interval>> {
    let lists = v
        .as_array()
        .map(|a| a.iter().map(vector).collect::<Vec<_>>())
        .unwrap_or_default();
    lists
        .iter()
        .map(|p| p.iter().map(|&x| Interval::point(x)).collect())
        .collect()
}

fn hull_is(hull: &IntervalVector, lo: &[f64], hi: &[f64], tolerance: f64) {
    near(&hull.lower(), lo, tolerance);
    near(&hull.upper(), hi, tolerance);
    assert!(
        hull.iter()
            .zip(lo.iter().zip(hi))
            .all(|(h, (lo, hi))| h.lo() <= *lo + tolerance && h.hi() >= *hi - tolerance)
    );
}

/// Checks one case; false if this crate has not its operation.
fn check(case: &Value) -> bool {
    let (inputs, expected) = (&case["inputs"], &case["expected"]);
    // Outward rounding needs some units where the peer is exact.
    let tolerance = case["tolerance"].as_f64().unwrap().max(1e-12);
    let id = case["id"].as_str().unwrap();
    match id {
        "cora-cz-empty-01" => {
            assert_eq!(set(inputs).emptiness(), Emptiness::Empty);
            assert!(set(inputs).interval_hull().is_err());
        }
        "cora-cz-vertices-01" | "cora-cz-vertices-02" => {
            same_points(
                &set(inputs).vertices().unwrap(),
                &expected["vertices"],
                tolerance,
            );
        }
        "cora-cz-support-01" | "cora-cz-support-02" => {
            let x = set(inputs);
            for (d, value) in by_direction(&expected["support"]) {
                near(
                    &[x.support(&d).unwrap()],
                    &[value.as_f64().unwrap()],
                    tolerance,
                );
            }
            for (d, value) in by_direction(&expected["lower"]) {
                let minus: Vec<f64> = d.iter().map(|x| -x).collect();
                near(
                    &[-x.support(&minus).unwrap()],
                    &[value.as_f64().unwrap()],
                    tolerance,
                );
            }
            let sides: Vec<Vec<f64>> = expected["interval_hull"]
                .as_array()
                .unwrap()
                .iter()
                .map(vector)
                .collect();
            let (lo, hi): (Vec<f64>, Vec<f64>) = sides.iter().map(|s| (s[0], s[1])).unzip();
            hull_is(&x.interval_hull().unwrap(), &lo, &hi, tolerance);
        }
        "cora-cz-support-vector-01" => {
            for (d, point) in by_direction(&expected["points"]) {
                near(
                    &set(inputs).support_vector(&d).unwrap(),
                    &vector(point),
                    tolerance,
                );
            }
        }
        "cora-cz-intersection-01" => {
            let joined = set(&inputs["Z"])
                .generalized_intersection(&matrix(&inputs["R"], 2), &set(&inputs["Y"]));
            same_points(
                &joined.unwrap().vertices().unwrap(),
                &expected["vertices"],
                tolerance,
            );
        }
        "cora-cz-halfspace-01" => {
            let half = &inputs["halfspace"];
            let cut = set(&inputs["Z"])
                .intersect_halfspace(&vector(&half["a"]), half["b"].as_f64().unwrap());
            same_points(
                &cut.unwrap().vertices().unwrap(),
                &expected["vertices"],
                tolerance,
            );
        }
        "cora-cz-contains-01" | "cora-z-point-01" => {
            let x = if id.contains("cz") {
                set(inputs)
            } else {
                zonotope(inputs).into()
            };
            for p in points(&expected["inside"]) {
                assert_eq!(x.contains(&p).unwrap(), Containment::Inside, "{p:?}");
            }
            for p in points(&expected["outside"]) {
                assert_eq!(x.contains(&p).unwrap(), Containment::Outside, "{p:?}");
            }
        }
        "cora-cz-cartprod-01" | "cora-cz-cartprod-interval" => {
            let y = match inputs.get("Y") {
                Some(y) => set(y),
                None => {
                    let sides =
                        IntervalVector::from_bounds(&vector(&inputs["lo"]), &vector(&inputs["hi"]));
                    ConstrainedZonotope::from_box(&sides.unwrap()).unwrap()
                }
            };
            assert_eq!(set(&inputs["Z"]).cartesian_product(&y), set(expected));
        }
        "cora-z-hull-01" | "lazysets-z-hull" => {
            let hull = zonotope(inputs).interval_hull().unwrap();
            hull_is(
                &hull,
                &vector(&expected["lo"]),
                &vector(&expected["hi"]),
                tolerance,
            );
        }
        "cora-z-volume-01" | "lazysets-z-volume" => {
            let value = expected["volume"].as_f64().unwrap();
            near(&[zonotope(inputs).volume().unwrap()], &[value], tolerance);
            near(
                &[ConstrainedZonotope::from(zonotope(inputs))
                    .volume()
                    .unwrap()
                    .unwrap()],
                &[value],
                1e-8,
            );
        }
        "cora-z-support-01" => {
            for (d, value) in by_direction(&expected["support"]) {
                near(
                    &[zonotope(inputs).support(&d).unwrap()],
                    &[value.as_f64().unwrap()],
                    tolerance,
                );
            }
            for (d, point) in by_direction(&expected["points"]) {
                let x = ConstrainedZonotope::from(zonotope(inputs));
                near(&x.support_vector(&d).unwrap(), &vector(point), tolerance);
            }
        }
        "cora-z-and-1d" => {
            let results = expected["results"].as_array().unwrap();
            for (pair, result) in inputs["pairs"].as_array().unwrap().iter().zip(results) {
                let side = |k: usize| {
                    let v = vector(&pair[k]);
                    Zonotope::new(vec![v[0]], Matrix::column(&[v[1]])).unwrap()
                };
                let joined = ConstrainedZonotope::from(side(0))
                    .intersect(&side(1).into())
                    .unwrap();
                match result.as_str() {
                    Some(_) => assert_eq!(joined.emptiness(), Emptiness::Empty),
                    None => {
                        let v = vector(result);
                        hull_is(
                            &joined.interval_hull().unwrap(),
                            &[v[0] - v[1]],
                            &[v[0] + v[1]],
                            tolerance,
                        );
                    }
                }
            }
        }
        "cora-z-reduce-girard-1" | "cora-z-reduce-girard-3" => {
            let z = zonotope(inputs);
            let order = if id.ends_with('1') { 1 } else { 3 };
            let expected = match expected.get("G") {
                Some(g) => matrix(g, 0),
                None => Matrix::diagonal(&vector(&expected["G_diag"])),
            };
            let reduced = girard::reduce(&z, order * z.dim()).unwrap();
            let columns = |m: &Matrix| {
                let mut columns: Vec<Vec<f64>> =
                    (0..m.cols()).map(|j| m.col(j).into_vec()).collect();
                columns.sort_by(|a, b| {
                    a[0].total_cmp(&b[0])
                        .then(a[1].total_cmp(&b[1]))
                        .then(a[2].total_cmp(&b[2]))
                });
                columns.concat()
            };
            near(&columns(reduced.g()), &columns(&expected), tolerance);
        }
        "lazysets-z-linmap" => {
            let image = zonotope(&inputs["Z"])
                .linear_map(&matrix(&inputs["M"], 0))
                .unwrap();
            assert_eq!(
                (image.c(), image.g()),
                (zonotope(expected).c(), zonotope(expected).g())
            );
        }
        "lazysets-z-linmap-1d" => {
            let image = zonotope(&inputs["Z"])
                .linear_map(&matrix(&inputs["M"], 0))
                .unwrap();
            let merged = parallel::merge(&image, 0.0).unwrap();
            assert_eq!(
                (merged.c(), merged.g()),
                (zonotope(expected).c(), zonotope(expected).g())
            );
        }
        "lazysets-z-minksum" => {
            let sum = zonotope(inputs).minkowski_sum(&zonotope(inputs)).unwrap();
            assert_eq!(
                (sum.c(), sum.g()),
                (zonotope(expected).c(), zonotope(expected).g())
            );
        }
        "zonoopt-support-01" => {
            // The peer allows 5 %; the case holds a tight value beside it.
            let bound = set(inputs).support(&vector(&inputs["d"])).unwrap();
            near(
                &[bound],
                &[expected["support_highs"].as_f64().unwrap()],
                1e-9,
            );
        }
        "zonoopt-empty-i" => assert_eq!(set(inputs).emptiness(), Emptiness::Empty),
        "zeta-hull-x0" => {
            let hull = set(inputs).interval_hull().unwrap();
            hull_is(
                &hull,
                &vector(&expected["lo"]),
                &vector(&expected["hi"]),
                tolerance,
            );
        }
        _ => return false,
    }
    true
}

#[test]
fn cases_of_other_libraries_agree() {
    let Ok(path) = std::env::var("ZONOBENCH_PEER_CASES") else {
        println!("skipped: ZONOBENCH_PEER_CASES is not set");
        return;
    };
    let text = std::fs::read_to_string(&path)
        .unwrap_or_else(|e| panic!("ZONOBENCH_PEER_CASES={path}: {e}"));
    let file: Value = serde_json::from_str(&text).unwrap();
    let cases = file["cases"].as_array().unwrap();
    let (checked, without): (Vec<&Value>, Vec<&Value>) = cases.iter().partition(|case| check(case));
    let names: Vec<&str> = without
        .iter()
        .map(|case| case["id"].as_str().unwrap())
        .collect();
    println!(
        "{} of {} cases agree; no such operation here: {}",
        checked.len(),
        cases.len(),
        names.join(", ")
    );
    assert!(checked.len() >= 20);
}
