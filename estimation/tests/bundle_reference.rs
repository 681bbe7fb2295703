//! The polytopic filters against worked cases of an independent double-precision implementation.

use serde_json::Value;
use zonobench_estimation::estimators::PolytopeBelief;
use zonobench_estimation::systems::{QuotientForm, Raimondo, Unicycle};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings,
    Problem, Uncertain,
};
use zonobench_sets::Matrix;

/// The cases are printed with 12 decimals.
const TOLERANCE: f64 = 1e-7;

fn read(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn vector(v: &Value) -> Vec<f64> {
    let entries = v.as_array().unwrap().iter();
    entries.map(|x| x.as_f64().unwrap()).collect()
}

fn raimondo(prior: Uncertain) -> Problem {
    let noise = |r: f64| Uncertain::from_box(&[-r; 2], &[r; 2]).unwrap();
    Problem {
        system: AnySystem::Raimondo(Raimondo {
            form: QuotientForm::Expanded,
            ..Raimondo::default()
        }),
        prior,
        w: noise(0.1),
        v: noise(0.4),
    }
}

fn x0() -> Uncertain {
    let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]]).unwrap();
    Uncertain::zonotope(vec![0.5, 0.5], g)
}

fn estimator(settings: &str, problem: &Problem) -> AnyEstimator {
    let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
    AnyEstimator::new(&settings, problem).unwrap()
}

fn polytope(belief: &AnyBelief) -> &PolytopeBelief {
    match belief {
        AnyBelief::PolytopeBelief(belief) => belief,
        other => panic!("{other:?}"),
    }
}

/// Hull, volume and vertices.
fn compare(name: &str, belief: &AnyBelief, expected: &Value) {
    let outline = polytope(belief).outline().unwrap();
    let hull = belief.interval_hull().unwrap();
    let close = |a: f64, b: f64| (a - b).abs() <= TOLERANCE * b.abs().max(1.0);
    for (got, key) in [(hull.lower(), "hull_lo"), (hull.upper(), "hull_hi")] {
        let wanted = vector(&expected[key]);
        assert!(
            got.iter().zip(&wanted).all(|(a, b)| close(*a, *b)),
            "{name} {key}: {got:?} {wanted:?}"
        );
    }
    let volume = expected["volume"].as_f64().unwrap();
    assert!(
        close(outline.volume().unwrap(), volume),
        "{name}: {:?} {volume}",
        outline.volume()
    );
    let wanted: Vec<Vec<f64>> = expected["vertices"]
        .as_array()
        .unwrap()
        .iter()
        .map(vector)
        .collect();
    let found = outline.vertices();
    assert_eq!(found.len(), wanted.len(), "{name}: {found:?}");
    for v in &wanted {
        let near = found
            .iter()
            .any(|p| p.iter().zip(v).all(|(a, b)| close(*a, *b)));
        assert!(near, "{name}: no vertex at {v:?} among {found:?}");
    }
}

#[test]
fn the_first_update_is_exact_for_every_method() {
    let case = read(include_str!("reference/bundle_ex1_k0_update.json"));
    let y: Vec<Option<f64>> = vector(&case["y0"]).into_iter().map(Some).collect();
    for kind in ["rrsr", "d-rrsr", "d-zb", "d-cz", "comb", "comb+", "lift"] {
        let e = estimator(&format!(r#"{{"kind": "{kind}"}}"#), &raimondo(x0()));
        let prior = e.prior();
        compare(kind, &prior, &case["X0"]);
        compare(
            kind,
            &e.update(0, &prior, &[], &y).unwrap(),
            &case["updated"],
        );
    }
}

#[test]
fn one_step_of_every_method_is_that_of_the_reference() {
    let case = read(include_str!("reference/bundle_ex1_propagate.json"));
    let methods = [
        ("RRSR", r#"{"kind": "rrsr"}"#),
        ("D-RRSR", r#"{"kind": "d-rrsr"}"#),
        ("D-ZB", r#"{"kind": "d-zb"}"#),
        ("D-CZ", r#"{"kind": "d-cz"}"#),
        ("D-ZB/all", r#"{"kind": "d-zb", "choose": "all"}"#),
        ("D-CZ/all", r#"{"kind": "d-cz", "choose": "all"}"#),
        (
            "D-ZB+",
            r#"{"kind": "d-zb", "vectors": "signed", "jacobian": "decomposition"}"#,
        ),
        (
            "D-CZ+",
            r#"{"kind": "d-cz", "vectors": "signed", "jacobian": "decomposition"}"#,
        ),
        ("COMB", r#"{"kind": "comb"}"#),
        ("COMB+", r#"{"kind": "comb+"}"#),
        ("LIFT0", r#"{"kind": "lift"}"#),
    ];
    for (name, settings) in methods {
        let e = estimator(settings, &raimondo(x0()));
        let updated = e
            .update(0, &e.prior(), &[], &[Some(0.97), Some(-0.13)])
            .unwrap();
        let predicted = e.predict(1, &updated, &[]).unwrap();
        compare(name, &predicted, &case["propagated"][name]);
    }
}

fn unicycle(lower: [f64; 3], upper: [f64; 3]) -> Problem {
    let landmarks = vec![[5.0, 15.0], [15.0, 15.0]];
    Problem {
        system: AnySystem::Unicycle(Unicycle::new(1.0, 0.3, 0.15, landmarks).unwrap()),
        prior: Uncertain::from_box(&lower, &upper).unwrap(),
        w: Uncertain::from_box(&[-0.06, -0.04, -0.08], &[0.04, 0.02, 0.04]).unwrap(),
        v: Uncertain::from_box(&[-0.01, -0.01, -0.02, -0.03], &[0.01, 0.02, 0.01, 0.02]).unwrap(),
    }
}

const KINDS: [&str; 7] = ["rrsr", "d-rrsr", "d-zb", "d-cz", "comb", "comb+", "lift"];

#[test]
fn bad_inputs_have_their_own_errors() {
    let cases = read(include_str!("reference/bundle_bad_inputs.json"));
    assert_eq!(cases.as_array().unwrap().len(), 4);
    for kind in KINDS {
        let settings = format!(r#"{{"kind": "{kind}"}}"#);
        let pole = Uncertain::from_box(&[-4.2, 0.0], &[-3.8, 1.0]).unwrap();
        let e = estimator(&settings, &raimondo(pole));
        let refused = e.predict(1, &e.prior(), &[]).unwrap_err();
        assert!(
            refused.to_string().contains("4 + x1 may be 0"),
            "{kind}: {refused}"
        );

        let e = estimator(&settings, &raimondo(x0()));
        let far = e
            .update(0, &e.prior(), &[], &[Some(5.0), Some(5.0)])
            .unwrap_err();
        assert_eq!(far, EstimationError::Inconsistent { k: 0 }, "{kind}");

        // The abscissa of the landmark within the box, and the landmark itself.
        for box_y in [[0.0, 1.0], [14.0, 16.0]] {
            let e = estimator(
                &settings,
                &unicycle([4.5, box_y[0], 0.0], [5.5, box_y[1], 0.1]),
            );
            let y = [Some(1.0), Some(0.0), Some(1.0), Some(0.0)];
            let refused = e.update(0, &e.prior(), &[], &y).unwrap_err();
            assert!(
                refused.to_string().contains("landmark 1"),
                "{kind}: {refused}"
            );
        }
    }
}
