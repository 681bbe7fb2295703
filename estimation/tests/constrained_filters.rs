//! The four filters on the nonlinear example: the truth is never lost, and the ratios of their radii are
//! those of independent runs.

mod draws;

use draws::Draws;
use zonobench_estimation::systems::Raimondo;
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings, Problem,
    System, Uncertain, track,
};
use zonobench_sets::{Containment, Interval, Matrix};

fn problem() -> Problem {
    let noise = || Uncertain::from_box(&[-0.4; 2], &[0.4; 2]).unwrap();
    let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]]).unwrap();
    Problem {
        system: AnySystem::Raimondo(Raimondo::default()),
        prior: Uncertain::zonotope(vec![0.5, 0.5], g),
        w: noise(),
        v: noise(),
    }
}

/// An f64 trajectory is an exact one: its noise is by definition what f leaves, and 0.4 (1 − 10⁻¹²) leaves
/// room for the rounding.
fn simulate(
    steps: usize,
    draws: &mut Draws,
    vertices: bool,
) -> (Vec<[f64; 2]>, Vec<Vec<Option<f64>>>) {
    let system = Raimondo::default();
    let mut noise = || {
        let size = 0.4 * (1.0 - 1e-12);
        [0, 1].map(|_| match vertices {
            true if draws.chance(0.5) => size,
            true => -size,
            false => size * draws.signed(),
        })
    };
    let mut x = [0.8, 0.65];
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for k in 0..=steps {
        let (mut y, mut next) = ([0.0; 2], [0.0; 2]);
        system.h(k, &x, &[], &noise(), &mut y);
        system.f(k, &x, &[], &noise(), &mut next);
        xs.push(x);
        ys.push(y.map(Some).to_vec());
        x = next;
    }
    (xs, ys)
}

/// The radii of the updated sets; every one must hold the truth.
fn radii(settings: &str, xs: &[[f64; 2]], ys: &[Vec<Option<f64>>]) -> Vec<f64> {
    let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
    let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
    assert!(estimator.guaranteed());
    let steps = track(&estimator, xs.len() - 1, &[], ys);
    steps
        .map(|step| {
            let (k, belief) = (step.k, step.updated.unwrap());
            let hull = belief.interval_hull().unwrap();
            assert!(
                hull.contains(&xs[k]),
                "{settings:?} at {k}: {hull:?} {:?}",
                xs[k]
            );
            let x = xs[k].map(Interval::point);
            assert_ne!(
                belief.contains(&x),
                Containment::Outside,
                "{settings:?} at {k}"
            );
            belief.size().radius.unwrap()
        })
        .collect()
}

/// The mean over k of the ratio of radii, in per cent.
fn ratio(a: &[f64], b: &[f64]) -> f64 {
    100.0 * a.iter().zip(b).map(|(a, b)| a / b).sum::<f64>() / a.len() as f64
}

const ZMV: &str = r#"{"kind": "zmv", "generators": 20}"#;
const CZMV: &str = r#"{"kind": "czmv", "generators": 20, "constraints": 5, "h": "c2"}"#;

#[test]
fn mean_value_filters_have_the_ratio_found_by_an_independent_implementation() {
    let mut ratios = Vec::new();
    for seed in 1..=6 {
        let (xs, ys) = simulate(100, &mut Draws::new(seed), false);
        let zmv = radii(ZMV, &xs, &ys);
        let zfo = radii(r#"{"kind": "zfo", "generators": 20}"#, &xs, &ys);
        let czmv = radii(CZMV, &xs, &ys);
        println!(
            "{seed}: czmv/zmv {:.2} zfo/zmv {:.2}",
            ratio(&czmv, &zmv),
            ratio(&zfo, &zmv)
        );
        ratios.push((ratio(&czmv, &zmv), ratio(&zfo, &zmv)));
    }
    let mean = |f: fn(&(f64, f64)) -> f64| ratios.iter().map(f).sum::<f64>() / ratios.len() as f64;
    // There: 51.72 with a standard deviation of 0.62 over five seeds, and 94.29 with 0.16.
    let (czmv, zfo) = (mean(|r| r.0), mean(|r| r.1));
    assert!((czmv - 51.72).abs() < 1.2, "CZMV/ZMV {czmv}");
    assert!((zfo - 94.29).abs() < 0.4, "ZFO/ZMV {zfo}");
}

#[test]
fn first_order_filters_hold_the_truth_and_compare_as_found_before() {
    let (xs, ys) = simulate(100, &mut Draws::new(1), false);
    let zfo = radii(r#"{"kind": "zfo", "generators": 20}"#, &xs, &ys);
    let run = |extra: &str, constraints: usize| {
        let settings = format!(
            r#"{{"kind": "czfo", "generators": 20, "constraints": {constraints}, {extra}}}"#
        );
        let r = ratio(&radii(&settings, &xs, &ys), &zfo);
        println!("{extra}, {constraints}: {r:.2} % of ZFO");
        r
    };
    // There, means over four or five seeds and standard deviations: C4 at one constraint 60.41 and 1.37,
    // XB 58.27 and 0.80, XB at three 54.79 and 0.69.
    let (c4, xb, xb3) = (
        run(r#""h": "c4""#, 1),
        run(r#""h": "xb""#, 1),
        run(r#""h": "xb""#, 3),
    );
    assert!((c4 - 60.41).abs() < 3.0 && (xb - 58.27).abs() < 3.0 && (xb3 - 54.79).abs() < 2.0);
    // Without the products of constraints the sets rewritten around the center lose next to nothing.
    let lean = run(r#""h": "xb", "expansion": "lean""#, 3);
    assert!((lean - xb3).abs() < 0.5, "{lean} {xb3}");
}

#[test]
fn vertex_noise_loses_no_truth() {
    for seed in 11..=13 {
        let (xs, ys) = simulate(40, &mut Draws::new(seed), true);
        for settings in [
            ZMV,
            CZMV,
            r#"{"kind": "zfo", "generators": 8}"#,
            r#"{"kind": "czmv", "generators": 8, "constraints": 1, "h": "c1"}"#,
            r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c3"}"#,
            r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c4"}"#,
            r#"{"kind": "czfo", "generators": 8, "constraints": 1, "h": "c3", "expansion": "lean"}"#,
            r#"{"kind": "czfo", "generators": 8, "constraints": 1, "h": "xb"}"#,
        ] {
            radii(settings, &xs, &ys);
        }
    }
}

#[test]
fn a_measurement_that_contradicts_the_bounds_is_inconsistent() {
    let (_, mut ys) = simulate(5, &mut Draws::new(8), false);
    ys[3] = vec![Some(50.0), Some(0.0)];
    for settings in [
        ZMV,
        CZMV,
        r#"{"kind": "czfo", "generators": 20, "constraints": 2, "expansion": "lean"}"#,
    ] {
        let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        let last = track(&estimator, 5, &[], &ys).last().unwrap();
        assert_eq!(last.k, 3);
        assert_eq!(
            last.updated.unwrap_err(),
            EstimationError::Inconsistent { k: 3 }
        );
    }
}

#[test]
fn too_few_generators_and_nonlinear_measurements_are_refused() {
    let refuse = |settings: &str, problem: &Problem| {
        let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
        AnyEstimator::new(&settings, problem)
            .unwrap_err()
            .to_string()
    };
    let message = refuse(
        r#"{"kind": "czmv", "generators": 6, "constraints": 5}"#,
        &problem(),
    );
    assert_eq!(
        message,
        "czmv: `generators` must be at least n + constraints = 7, got 6"
    );
    let message = refuse(r#"{"kind": "zmv", "generators": 1}"#, &problem());
    assert_eq!(
        message,
        "zmv: `generators` must be at least the dimension 2, got 1"
    );
    let gaussian = Problem {
        w: Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2)),
        ..problem()
    };
    assert!(refuse(ZMV, &gaussian).contains("noise.w"));
}
