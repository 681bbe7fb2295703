//! ZSMF and InZSMF: values from an independent implementation (`tests/reference/inzsmf_*.json`), identities
//! between variants, and what is refused.

#![allow(clippy::disallowed_methods)] // the platform's functions stand here as a second opinion

use serde::Deserialize;
use std::collections::BTreeMap;
use zonobench_estimation::estimator::{Containment, KINDS, Phase};
use zonobench_estimation::estimators::{
    Coordinates, PoseZonotope, reduce_as_printed, reduce_without_absolute_values,
};
use zonobench_estimation::systems::{Form, VehicleSe2};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings,
    Problem, Uncertain, track,
};
use zonobench_sets::{Interval, Matrix, Se2};

fn parse(json: &str) -> EstimatorSettings {
    serde_json::from_str(json).unwrap()
}

fn read<T: for<'a> Deserialize<'a>>(name: &str) -> T {
    let path = format!("{}/tests/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The paper's vehicle, H_0 = diag(`start`).
fn problem(form: Form, estimate: [f64; 3], start: [f64; 3]) -> Problem {
    Problem {
        system: AnySystem::VehicleSe2(VehicleSe2::new(0.01, form).unwrap()),
        prior: Uncertain::zonotope(estimate.to_vec(), Matrix::diagonal(&start)),
        w: Uncertain::zonotope(vec![0.0; 3], Matrix::identity(3).scale(0.1)),
        v: Uncertain::zonotope(vec![0.0; 2], Matrix::identity(2)),
    }
}

fn pose(belief: &AnyBelief) -> &PoseZonotope {
    match belief {
        AnyBelief::PoseZonotope(belief) => belief,
        _ => panic!("a set of poses"),
    }
}

/// The predicted beliefs of k = 0 … N.
fn run(json: &str, problem: &Problem, u: &[Vec<f64>], y: &[[f64; 2]]) -> Vec<PoseZonotope> {
    let estimator = AnyEstimator::new(&parse(json), problem).unwrap();
    let y: Vec<Vec<Option<f64>>> = y.iter().map(|y| y.map(Some).to_vec()).collect();
    track(&estimator, y.len() - 1, u, &y)
        .map(|step| pose(&step.predicted.unwrap()).clone())
        .collect()
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Row7 {
    dt: f64,
    omega: Vec<f64>,
    speed: Vec<f64>,
    init_estimate: [f64; 3],
    H0: Matrix,
    Hw: Matrix,
    Hv: Matrix,
    order_s: usize,
    true_theta: Vec<f64>,
    true_x: Vec<[f64; 2]>,
    y: Vec<[f64; 2]>,
    expected: BTreeMap<String, Expected>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Expected {
    metrics_k1_to_N: BTreeMap<String, f64>,
    estimate: Vec<[f64; 3]>,
    halfwidth_method_frame: Vec<[f64; 3]>,
    trace_HHt: Vec<f64>,
    H_at: BTreeMap<usize, Matrix>,
}

fn assert_close(what: &str, got: f64, expected: f64) {
    assert!(
        (got - expected).abs() < 1e-8,
        "{what}: {got}, expected {expected}"
    );
}

/// The columns in an order of their own, to compare lists that are sorted differently.
fn sorted_columns(h: &Matrix) -> Vec<Vec<f64>> {
    let mut columns: Vec<Vec<f64>> = (0..h.cols()).map(|j| h.col(j).into_vec()).collect();
    let key = |c: &Vec<f64>| c.iter().map(|x| (x * 1e9).round()).collect::<Vec<f64>>();
    columns.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap());
    columns
}

#[test]
fn tracks_with_the_pole_gain_agree_with_the_reference() {
    let file: Row7 = read("inzsmf_pole_row7");
    let problem = Problem {
        system: AnySystem::VehicleSe2(VehicleSe2::new(file.dt, Form::Group).unwrap()),
        prior: Uncertain::zonotope(file.init_estimate.to_vec(), file.H0.clone()),
        w: Uncertain::zonotope(vec![0.0; 3], file.Hw.clone()),
        v: Uncertain::zonotope(vec![0.0; 2], file.Hv.clone()),
    };
    let u: Vec<Vec<f64>> = file
        .omega
        .iter()
        .zip(&file.speed)
        .map(|(o, v)| vec![*o, *v])
        .collect();
    assert_eq!(file.expected.len(), 4);
    for (name, expected) in &file.expected {
        let [method, _, reduction] = name.split('/').collect::<Vec<_>>()[..] else {
            panic!("{name}")
        };
        let kind = if method == "Z" { "zsmf" } else { "inzsmf" };
        let reduction = if reduction == "abs" {
            "outer"
        } else {
            "paper-tables"
        };
        let json = format!(
            r#"{{"kind": "{kind}", "generators": {}, "reduction": "{reduction}", "transition": "{}",
                 "gain": {{"longitudinal": 0.98, "lateral": [0.95, 0.98]}}}}"#,
            file.order_s,
            if kind == "zsmf" {
                "exact"
            } else {
                "first-order"
            },
        );
        let beliefs = run(&json, &problem, &u, &file.y);
        assert_eq!(beliefs.len(), 151);
        let mut sums = [0.0; 5];
        for (k, b) in beliefs.iter().enumerate() {
            let center = b.center();
            for (got, want) in center.iter().zip(expected.estimate[k]) {
                assert_close(&format!("{name}: estimate at {k}"), *got, want);
            }
            let [along, across] = b.body_half_widths();
            let state = b.state_generators().abs_row_sums();
            let halves = match kind {
                "zsmf" => [state[0], state[1], state[2]],
                _ => [state[0], along, across],
            };
            for (got, want) in halves.iter().zip(expected.halfwidth_method_frame[k]) {
                assert_close(&format!("{name}: half-width at {k}"), *got, want);
            }
            let trace = b.size().trace_ggt.unwrap();
            assert_close(
                &format!("{name}: trace at {k}"),
                trace,
                expected.trace_HHt[k],
            );
            if let Some(h) = expected.H_at.get(&k) {
                let (ours, theirs) = (sorted_columns(b.error.g()), sorted_columns(h));
                assert_eq!(ours.len(), theirs.len(), "{name}: columns at {k}");
                for (a, b) in ours.iter().flatten().zip(theirs.iter().flatten()) {
                    assert_close(&format!("{name}: H at {k}"), *a, *b);
                }
            }
            if k > 0 {
                let e = zonobench_sets::se2::wrap(center[0] - file.true_theta[k]);
                let [x, y] = [0, 1].map(|i| center[i + 1] - file.true_x[k][i]);
                sums[0] += e * e;
                sums[1] += x * x + y * y;
                sums[2] += 2.0 * state[0];
                sums[3] += 4.0 * state[1] * state[2];
                sums[4] += 4.0 * halves[1] * halves[2];
            }
        }
        let mean = sums.map(|s| s / 150.0);
        let metrics = &expected.metrics_k1_to_N;
        for (name, got) in [
            ("RMSE_theta", mean[0].sqrt()),
            ("RMSE_x", mean[1].sqrt()),
            ("AAR_theta", mean[2]),
            ("AAR_x_world", mean[3]),
            ("AAR_x_method_frame", mean[4]),
        ] {
            assert_close(name, got, metrics[name]);
        }
    }
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Reductions {
    reduce: Vec<ReductionCase>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct ReductionCase {
    H: Matrix,
    s: usize,
    abs: Matrix,
    published: Matrix,
}

#[test]
fn both_reductions_agree_with_the_reference() {
    let file: Reductions = read("inzsmf_reduce");
    assert_eq!(file.reduce.len(), 4);
    for case in file.reduce {
        for (ours, theirs) in [
            (reduce_as_printed(&case.H, case.s), &case.abs),
            (
                reduce_without_absolute_values(&case.H, case.s),
                &case.published,
            ),
        ] {
            assert_eq!((ours.rows(), ours.cols()), (theirs.rows(), theirs.cols()));
            let (a, b) = (sorted_columns(&ours), sorted_columns(theirs));
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                assert!((a - b).abs() < 1e-14);
            }
        }
    }
}

/// y of a vehicle that starts at (π/2, 0, 0), without noise, and the inputs.
fn lap(steps: usize, u: impl Fn(usize) -> [f64; 2]) -> (Vec<Vec<f64>>, Vec<[f64; 2]>) {
    use zonobench_estimation::System;
    let system = VehicleSe2::new(0.01, Form::Group).unwrap();
    let mut x = [core::f64::consts::FRAC_PI_2, 0.0, 0.0];
    let (mut inputs, mut y) = (Vec::new(), Vec::new());
    for k in 0..=steps {
        inputs.push(u(k).to_vec());
        y.push([x[1], x[2]]);
        let mut next = [0.0; 3];
        system.f(k, &x, &u(k), &[0.0; 3], &mut next);
        x = next;
    }
    (inputs, y)
}

#[test]
fn without_an_error_nothing_moves_the_estimate_from_the_truth() {
    // Speed and turn rate vary: A is made anew at every step.
    let (u, y) = lap(300, |k| {
        [0.4 * (0.05 * k as f64).sin(), 8.0 + (k % 7) as f64]
    });
    for json in [
        r#"{"kind": "inzsmf", "generators": 30}"#,
        r#"{"kind": "inzsmf", "generators": 30, "gain": {"longitudinal": 0.9, "lateral": [0.9, 0.8]}}"#,
        r#"{"kind": "inzsmf", "generators": 30, "side": "right"}"#,
        r#"{"kind": "inzsmf", "generators": 60, "remainder": "enclosed", "reduction": "girard"}"#,
    ] {
        let start = [core::f64::consts::FRAC_PI_2, 0.0, 0.0];
        let beliefs = run(json, &problem(Form::Group, start, [0.1, 0.5, 0.5]), &u, &y);
        for (b, y) in beliefs.iter().zip(&y) {
            assert!(
                (b.pose.x[0] - y[0]).abs() + (b.pose.x[1] - y[1]).abs() < 1e-12,
                "{json}"
            );
        }
    }
}

#[test]
fn poles_of_a_varying_speed_do_not_hold_the_set_and_the_f_radius_gain_does() {
    // The poles of each step are inside the unit circle; the product of a step at δν = 1 and one at δν = 3 has the
    // eigenvalue −4/3 (poles 0, 0). So a pole gain needs a steady speed, and a varying one the F-radius gain.
    let heading = |gain: &str, speed: fn(usize) -> f64| {
        let (u, y) = lap(60, |k| [0.0, speed(k)]);
        let json = format!(r#"{{"kind": "inzsmf", "generators": 60, "gain": {gain}}}"#);
        let start = [core::f64::consts::FRAC_PI_2, 0.0, 0.0];
        let beliefs = run(&json, &problem(Form::Group, start, [0.1, 0.5, 0.5]), &u, &y);
        let width = |k: usize| -> f64 {
            let g = beliefs[k].state_generators();
            g.row(0).iter().map(|x| x.abs()).sum()
        };
        width(60) / width(20)
    };
    let poles = r#"{"longitudinal": 0.5, "lateral": [0.0, 0.0]}"#;
    let varying = |k: usize| if k.is_multiple_of(2) { 100.0 } else { 300.0 };
    assert!(heading(poles, varying) > 100.0);
    assert!(heading(poles, |_| 200.0) < 2.0);
    assert!(heading(r#""f-radius""#, varying) < 2.0);
}

#[test]
fn the_alternative_innovation_gives_the_same_estimates() {
    // z = R' (y − x̂) with C = [0 I], or z = y − x̂ with C = [0 R]: the gains are L and L R', and L z the same.
    // A measurement whose components come one after the other takes the second way. [Li, Remark 6]
    use zonobench_estimation::estimators::f_radius_gain;
    let (c, s) = (0.3_f64.cos(), 0.3_f64.sin());
    let a = Se2::exp([-0.004, -0.08, 0.0]).adjoint();
    let p = [[0.3, 0.05, -0.1], [0.05, 1.0, 0.2], [-0.1, 0.2, 0.8]];
    let hv = Matrix::from_rows(&[[1.0, 0.2], [0.0, 0.5]]).unwrap();
    let back = Matrix::from_rows(&[[c, s], [-s, c]]).unwrap();
    let body = f_radius_gain(
        &a,
        &p,
        &Matrix::from_rows(&[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap(),
        &back.mul(&hv).gram(),
    );
    let world = f_radius_gain(
        &a,
        &p,
        &Matrix::from_rows(&[[0.0, c, -s], [0.0, s, c]]).unwrap(),
        &hv.gram(),
    );
    let (body, world) = (body.unwrap().mul(&back), world.unwrap());
    for (x, y) in body.as_slice().iter().zip(world.as_slice()) {
        assert!((x - y).abs() < 1e-15);
    }
}

#[test]
fn a_component_that_is_missing_is_left_out() {
    let start = [core::f64::consts::FRAC_PI_2, 0.1, 0.0];
    let problem = problem(Form::Group, start, [0.1, 0.5, 0.5]);
    let u = vec![vec![0.4, 8.0]; 20];
    for kind in ["zsmf", "inzsmf"] {
        let estimator = AnyEstimator::new(
            &parse(&format!(r#"{{"kind": "{kind}", "generators": 30}}"#)),
            &problem,
        );
        let estimator = estimator.unwrap();
        let last = |y: [Option<f64>; 2]| {
            let y = vec![y.to_vec(); 20];
            let last = track(&estimator, 19, &u, &y).last().unwrap();
            pose(&last.predicted.unwrap()).clone()
        };
        let trace = |y| last(y).size().trace_ggt.unwrap();
        let (both, one, none) = (
            trace([Some(0.0); 2]),
            trace([Some(0.0), None]),
            trace([None; 2]),
        );
        assert!(
            both < one && one < none,
            "{kind}: {both:?} {one:?} {none:?}"
        );
        // Without any measurement the heading gathers its noise: 0.1 + 19 · 0.001.
        let heading = last([None; 2]).state_generators().abs_row_sums()[0];
        assert!((heading - 0.119).abs() < 1e-12);
    }
}

/// Every setting of both kinds at least once, from a set that the enclosing filter can hold.
const VARIANTS: [&str; 10] = [
    r#"{"kind": "zsmf", "generators": 30}"#,
    r#"{"kind": "zsmf", "generators": 30, "reduction": "girard", "transient": "lag"}"#,
    r#"{"kind": "zsmf", "generators": 30, "gain": {"longitudinal": 0.9, "lateral": [0.8, 0.7]}}"#,
    r#"{"kind": "inzsmf", "generators": 30}"#,
    r#"{"kind": "inzsmf", "generators": 30, "reduction": "girard", "transient": "initial-update"}"#,
    r#"{"kind": "inzsmf", "generators": 30, "reduction": "paper-tables", "transition": "first-order"}"#,
    r#"{"kind": "inzsmf", "generators": 30, "side": "right"}"#,
    r#"{"kind": "inzsmf", "generators": 30, "gain": {"longitudinal": 0.9, "lateral": [0.8, 0.7]}}"#,
    r#"{"kind": "inzsmf", "generators": 120, "remainder": "enclosed"}"#,
    r#"{"kind": "inzsmf", "generators": 120, "remainder": "enclosed", "reduction": "girard", "transient": "lag"}"#,
];

#[test]
fn both_kinds_keep_the_laws_of_estimators_and_beliefs() {
    let start = [core::f64::consts::FRAC_PI_2, 0.1, -0.1];
    let problem = problem(Form::Group, start, [0.1, 0.5, 0.5]);
    let (u, y) = lap(60, |_| [0.4, 8.0]);
    let y: Vec<Vec<Option<f64>>> = y
        .iter()
        .enumerate()
        .map(|(k, y)| vec![Some(y[0] + 0.5), (k % 9 != 4).then_some(y[1])])
        .collect();
    for json in VARIANTS {
        let settings = parse(json);
        let written = serde_json::to_value(&settings).unwrap();
        assert_eq!(
            serde_json::from_value::<EstimatorSettings>(written.clone()).unwrap(),
            settings
        );
        let info = KINDS
            .iter()
            .find(|info| info.kind == settings.kind())
            .unwrap();
        // `scale` is written where it is set alone.
        let mut known = info.keys.to_vec();
        known.retain(|key| *key != "scale");
        known.push("kind");
        known.sort_unstable();
        let keys: Vec<&String> = written.as_object().unwrap().keys().collect();
        let mut keys: Vec<&str> = keys.into_iter().map(String::as_str).collect();
        keys.sort_unstable();
        assert_eq!(keys, known);

        let estimator = AnyEstimator::new(&settings, &problem).unwrap();
        assert_eq!(estimator.kind(), settings.kind());
        assert_eq!(estimator.guaranteed(), json.contains("enclosed"));
        assert_eq!(estimator.reported_phase(), Phase::Predicted);
        assert_eq!(estimator.prior().center(), start);
        let run = || {
            track(&estimator, 60, &u, &y)
                .map(|s| format!("{s:?}"))
                .collect::<Vec<_>>()
        };
        assert_eq!(run(), run());
        for step in track(&estimator, 60, &u, &y) {
            let (predicted, updated) = (step.predicted.unwrap(), step.updated.unwrap());
            let hull = updated.interval_hull().unwrap();
            let center = updated.center();
            assert!(hull.contains(&center), "{json}");
            let at = |x: &[f64]| x.iter().map(|&x| Interval::point(x)).collect::<Vec<_>>();
            assert_eq!(
                updated.contains(&at(&center)),
                Containment::Inside,
                "{json} at {}",
                step.k
            );
            let same = [center[0] - core::f64::consts::TAU, center[1], center[2]];
            assert_ne!(
                updated.contains(&at(&same)),
                Containment::Outside,
                "{json}: one turn less"
            );
            // Headings of half a turn and more have errors that are not looked at.
            let far = updated.contains(&at(&[center[0], 1e6, 0.0]));
            let half_turn = hull[0].width() >= core::f64::consts::TAU;
            assert_eq!(far == Containment::Outside, !half_turn, "{json}");
            let radius = hull.rad().into_iter().fold(0.0, f64::max);
            assert!(
                (updated.size().radius.unwrap() - radius).abs() < 1e-9,
                "{json}"
            );
            if step.k > 0 {
                assert_eq!(
                    predicted.interval_hull(),
                    updated.interval_hull(),
                    "y_k is kept for later"
                );
            }
            let reduced = estimator.reduce_order(step.k, updated.clone()).unwrap();
            assert_eq!(reduced.center(), center);
            let most = if json.contains("120") { 120 } else { 30 };
            assert!(reduced.size().n_generators.unwrap() <= most, "{json}");
            if !json.contains("paper-tables") {
                let after = reduced.interval_hull().unwrap();
                for (a, b) in after.iter().zip(hull.iter()) {
                    assert!(
                        a.lo() <= b.lo() + 1e-12 && a.hi() >= b.hi() - 1e-12,
                        "{json}"
                    );
                }
            }
        }
        let nothing = estimator
            .update(1, &estimator.prior(), &[0.4, 8.0], &[None, None])
            .unwrap();
        assert_eq!(nothing.interval_hull(), estimator.prior().interval_hull());
    }
}

#[test]
fn the_curved_set_lies_in_its_enclosure_and_not_in_the_first_order_hull() {
    use zonobench_sets::Zonotope;
    let pose = Se2::new(0.7, [3.0, -2.0]);
    let g = Matrix::from_rows(&[[0.8, 0.1, 0.0], [0.0, 1.0, -0.02], [0.0, 0.0, 0.1]]).unwrap();
    for coordinates in [
        Coordinates::State,
        Coordinates::Left,
        Coordinates::Right,
        Coordinates::Body,
    ] {
        let set = PoseZonotope::new(
            pose,
            Zonotope::new(vec![0.0; 3], g.clone()).unwrap(),
            coordinates,
        );
        let enclosure = set.enclosure().unwrap();
        let hull = set.interval_hull().unwrap();
        let mut left_the_hull = false;
        for corner in 0..8 {
            let xi: Vec<f64> = (0..3)
                .map(|j| if (corner >> j) & 1 == 0 { 1.0 } else { -1.0 })
                .collect();
            let e = g.mul_vec(&xi);
            let (e, x) = ([e[0], e[1], e[2]], pose);
            let x = match coordinates {
                Coordinates::State => Se2::new(x.angle + e[0], [x.x[0] + e[1], x.x[1] + e[2]]),
                Coordinates::Left => x.compose(Se2::exp(e)),
                Coordinates::Right => Se2::exp(e).compose(x),
                Coordinates::Body => x.compose(Se2::new(e[0], [e[1], e[2]])),
            };
            let point = [x.angle, x.x[0], x.x[1]];
            for (side, &x) in enclosure.iter().zip(&point) {
                assert!(
                    side.lo() - 1e-14 <= x && x <= side.hi() + 1e-14,
                    "{coordinates:?}"
                );
            }
            left_the_hull |= hull
                .iter()
                .zip(&point)
                .any(|(s, x)| x - s.hi() > 1e-3 || s.lo() - x > 1e-3);
            // A vertex, pulled in and pushed out.
            for (share, verdict) in [(0.999, Containment::Inside), (1.001, Containment::Outside)] {
                let e = e.map(|e| share * e);
                let x = match coordinates {
                    Coordinates::State => {
                        Se2::new(pose.angle + e[0], [pose.x[0] + e[1], pose.x[1] + e[2]])
                    }
                    Coordinates::Left => pose.compose(Se2::exp(e)),
                    Coordinates::Right => Se2::exp(e).compose(pose),
                    Coordinates::Body => pose.compose(Se2::new(e[0], [e[1], e[2]])),
                };
                let point = [x.angle, x.x[0], x.x[1]].map(Interval::point);
                assert_eq!(set.contains(&point), verdict, "{coordinates:?} {share}");
            }
        }
        let curved = matches!(coordinates, Coordinates::Left | Coordinates::Right);
        assert_eq!(left_the_hull, curved, "{coordinates:?}");
        // 4 Σ |det| of the projected generators; turning does not change it.
        let d = set.state_generators();
        let det = |i: usize, j: usize| (d[(1, i)] * d[(2, j)] - d[(1, j)] * d[(2, i)]).abs();
        let area = 4.0 * (det(0, 1) + det(0, 2) + det(1, 2));
        assert!((set.projected_area() - area).abs() < 1e-12);
    }
}

#[test]
fn dropping_the_remainder_loses_the_truth_in_one_step() {
    // u = w = v = 0, L = [0 1; 0 0; 0 0], H = diag(1/2, 1, 0): the heading's error can reach 1/2 + V₂₁ u₁ beyond
    // the set. Here with the filter's own gain: a set that is wide, a truth on its boundary, v and w zero.
    let start = [0.0; 3];
    let problem = problem(Form::Group, start, [1.0, 1.0, 1.0]);
    let settings = parse(r#"{"kind": "inzsmf", "generators": 400}"#);
    let estimator = AnyEstimator::new(&settings, &problem).unwrap();
    let mut lost = 0;
    for corner in 0..8 {
        let sign = |j: i32| {
            if (corner >> j) & 1 == 0 {
                0.999
            } else {
                -0.999
            }
        };
        let x0 = Se2::exp([sign(0), sign(1), sign(2)]);
        let inside = [x0.angle, x0.x[0], x0.x[1]].map(Interval::point);
        assert_eq!(estimator.prior().contains(&inside), Containment::Inside);
        // v = (1, 1): the measurement's bound.
        let y = vec![vec![Some(x0.x[0] + 0.999), Some(x0.x[1] + 0.999)]; 2];
        let last = track(&estimator, 1, &vec![vec![0.4, 8.0]; 2], &y)
            .last()
            .unwrap();
        let x1 = x0.compose(Se2::exp([0.004, 0.08, 0.0]));
        let x1 = [x1.angle, x1.x[0], x1.x[1]].map(Interval::point);
        lost += usize::from(last.predicted.unwrap().contains(&x1) == Containment::Outside);
    }
    assert!(lost > 0, "{lost}");
}

fn refusal(json: &str, problem: &Problem) -> String {
    AnyEstimator::new(&parse(json), problem)
        .unwrap_err()
        .to_string()
}

#[test]
fn settings_that_cannot_work_are_refused_by_key() {
    let ok = problem(Form::Euler, [0.0; 3], [0.1, 0.5, 0.5]);
    let check = |json: &str, expected: &str| {
        let error = refusal(json, &ok);
        assert!(error.contains(expected), "{error}");
    };
    check(
        r#"{"kind": "zsmf", "generators": 3}"#,
        "zsmf: `generators` must be at least 4",
    );
    let poles = |l: f64, a: f64, b: f64| {
        format!(
            r#"{{"kind": "inzsmf", "generators": 30, "gain": {{"longitudinal": {l}, "lateral": [{a}, {b}]}}}}"#
        )
    };
    check(
        &poles(1.0, 0.5, 0.6),
        "`gain` must be poles of magnitude below 1, got 1",
    );
    check(
        &poles(0.9, -1.5, 0.6),
        "poles of magnitude below 1, got -1.5",
    );
    check(&poles(0.9, 0.9, 0.9), "at most two are equal");
    let with = |rest: &str| format!(r#"{{"kind": "inzsmf", "generators": 30, {rest}}}"#);
    check(
        &with(r#""remainder": "enclosed", "reduction": "paper-tables""#),
        "`reduction` must be",
    );
    check(
        &with(r#""remainder": "enclosed", "side": "right""#),
        "`side` must be",
    );
    check(
        &with(r#""remainder": "enclosed", "transition": "first-order""#),
        "`transition` must be",
    );
    check(
        &with(r#""remainder": "enclosed", "transient": "initial-update""#),
        "`transient` must be",
    );
    check(
        &with(r#""side": "right", "gain": {"longitudinal": 0.9, "lateral": [0.8, 0.7]}"#),
        "`gain` must be",
    );
    check(
        r#"{"kind": "zsmf", "generators": 30, "remainder": "enclosed"}"#,
        "zsmf: `remainder` must be",
    );
    let unknown =
        serde_json::from_str::<EstimatorSettings>(r#"{"kind": "zsmf", "generators": 9, "x": 1}"#);
    assert!(
        unknown
            .unwrap_err()
            .to_string()
            .contains("unknown field `x`")
    );

    let json = r#"{"kind": "inzsmf", "generators": 30}"#;
    let off_center = Problem {
        w: Uncertain::from_box(&[0.0; 3], &[1.0; 3]).unwrap(),
        ..ok.clone()
    };
    assert!(refusal(json, &off_center).contains("`noise.w` must be centered at zero, got 0.5"));
    let gaussian = Problem {
        v: Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2)),
        ..ok.clone()
    };
    assert!(refusal(json, &gaussian).contains("`noise.v` must be a set"));
    let shape = Problem {
        prior: Uncertain::from_box(&[0.0; 2], &[1.0; 2]).unwrap(),
        ..ok.clone()
    };
    assert!(
        refusal(json, &shape).contains("prior.center"),
        "{}",
        refusal(json, &shape)
    );
}

#[test]
fn zero_speed_has_no_pole_gain_and_an_f_radius_gain() {
    let problem = problem(Form::Group, [0.0; 3], [0.1, 0.5, 0.5]);
    let poles = r#"{"kind": "inzsmf", "generators": 30, "gain": {"longitudinal": 0.9, "lateral": [0.8, 0.7]}}"#;
    let u: Vec<Vec<f64>> = (0..10)
        .map(|k| vec![0.4, if k == 5 { 0.0 } else { 8.0 }])
        .collect();
    let y = vec![vec![Some(0.0); 2]; 10];
    let estimator = AnyEstimator::new(&parse(poles), &problem).unwrap();
    let last = track(&estimator, 9, &u, &y).last().unwrap();
    assert_eq!(last.k, 6, "what came before is kept");
    let error = last.updated.unwrap_err();
    assert!(
        matches!(error, EstimationError::Refused { k: 6, .. }),
        "{error}"
    );
    assert!(
        error
            .to_string()
            .contains("at nu = 0 the heading is not observable")
    );
    let estimator =
        AnyEstimator::new(&parse(r#"{"kind": "zsmf", "generators": 30}"#), &problem).unwrap();
    assert!(track(&estimator, 9, &u, &y).all(|step| step.updated.is_ok()));
}

#[test]
fn a_singular_innovation_is_an_error_at_its_step() {
    let singular = Problem {
        prior: Uncertain::zonotope(vec![0.0; 3], Matrix::column(&[0.1, 0.0, 0.0])),
        w: Uncertain::zonotope(vec![0.0; 3], Matrix::column(&[0.0; 3])),
        v: Uncertain::zonotope(vec![0.0; 2], Matrix::column(&[1.0, 1.0])),
        ..problem(Form::Group, [0.0; 3], [0.1; 3])
    };
    let estimator =
        AnyEstimator::new(&parse(r#"{"kind": "zsmf", "generators": 30}"#), &singular).unwrap();
    let y = vec![vec![Some(0.0); 2]; 3];
    let last = track(&estimator, 2, &vec![vec![0.4, 8.0]; 3], &y)
        .last()
        .unwrap();
    let error = last.updated.unwrap_err();
    let at_1 = matches!(error, EstimationError::Singular { k: 1, .. });
    assert!(at_1, "{error}");
}

#[test]
fn wrong_inputs_and_measurements_are_errors_that_say_so() {
    let problem = problem(Form::Group, [0.0; 3], [0.1, 0.5, 0.5]);
    let estimator =
        AnyEstimator::new(&parse(r#"{"kind": "inzsmf", "generators": 30}"#), &problem).unwrap();
    let error = |u: Vec<f64>, y: Vec<Option<f64>>| {
        let last = track(&estimator, 1, &vec![u; 2], &vec![y; 2])
            .last()
            .unwrap();
        last.updated.unwrap_err().to_string()
    };
    let y = vec![Some(0.0); 2];
    assert_eq!(
        error(vec![0.4], y.clone()),
        "input u: expected dimension 2, got 1"
    );
    assert_eq!(
        error(vec![0.4, f64::NAN], y),
        "input u: expected finite numbers, got NaN"
    );
    assert_eq!(
        error(vec![0.4, 8.0], vec![None]),
        "measurement y: expected dimension 2, got 1"
    );
    let infinite = vec![Some(f64::INFINITY), None];
    assert_eq!(
        error(vec![0.4, 8.0], infinite),
        "measurement y: expected finite numbers, got inf"
    );
}
