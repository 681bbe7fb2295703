//! One step (predict, update, reduce_order) of each estimator at the sizes that the papers use, and how
//! it grows with φ and n. Run by hand: `cargo bench -p zonobench-estimation`.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use zonobench_estimation::systems::{Form, Linear, Lpv, Quadrotor, VanDerPol, VehicleSe2};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Estimator, EstimatorSettings, Problem, Uncertain,
};
use zonobench_sets::Matrix;

fn m<const N: usize>(rows: &[[f64; N]]) -> Matrix {
    Matrix::from_rows(rows).expect("rows of one length")
}

fn both(n: usize, g: Matrix, p: Matrix) -> Uncertain {
    Uncertain {
        covariance: Some(p),
        ..Uncertain::zonotope(vec![0.0; n], g)
    }
}

/// A stable system of n states and one measurement, with noise of both kinds.
fn linear(n: usize) -> Problem {
    let a = Matrix::from_fn(n, n, |i, j| match j as isize - i as isize {
        0 => 0.9 - 0.05 * i as f64,
        1 => 1.0,
        _ => 0.0,
    });
    let c = Matrix::from_fn(1, n, |_, j| if j == 0 { -22.0 } else { 1.0 });
    let part = |dim: usize, r: f64| Uncertain {
        covariance: Some(Matrix::identity(dim).scale(0.12 * r)),
        ..Uncertain::from_box(&vec![-r; dim], &vec![r; dim]).expect("ordered bounds")
    };
    Problem {
        system: AnySystem::Linear(Linear::new(a, None, c, None).expect("shapes fit")),
        prior: part(n, 10.0),
        w: part(n, 1.0),
        v: part(1, 1.0),
    }
}

fn lpv() -> Problem {
    let system = Lpv::new(
        m(&[[0.0, -0.5], [1.0, 1.0]]),
        vec![m(&[[0.0, 0.0], [0.0, 0.3]])],
        None,
        m(&[[-2.0, 1.0]]),
    );
    let l = m(&[[-0.12, 0.0], [0.02, 0.0]]);
    Problem {
        system: AnySystem::Lpv(system.expect("shapes fit")),
        prior: both(
            2,
            Matrix::identity(2).scale(0.1),
            Matrix::identity(2).scale(8e-4),
        ),
        w: both(2, l.scale(0.5), l.gram().scale(1.0 / 36.0)),
        v: both(1, m(&[[0.1]]), m(&[[0.01 / 9.0]])),
    }
}

fn van_der_pol() -> Problem {
    Problem {
        system: AnySystem::VanDerPol(VanDerPol::new(0.1).expect("a positive period")),
        prior: both(
            2,
            Matrix::identity(2).scale(0.5),
            Matrix::identity(2).scale(0.02),
        ),
        w: Uncertain::zonotope(vec![0.0; 2], m(&[[0.0, 0.0], [0.15, 0.0]])),
        v: Uncertain::gaussian(vec![0.0], m(&[[0.04]])),
    }
}

fn estimator(json: &str, problem: &Problem) -> AnyEstimator {
    let settings: EstimatorSettings = serde_json::from_str(json).expect("valid settings");
    AnyEstimator::new(&settings, problem).expect("a valid problem")
}

fn step(e: &AnyEstimator, k: usize, belief: AnyBelief) -> AnyBelief {
    let reduced = e.reduce_order(k, belief).expect("reducible");
    let predicted = e.predict(k + 1, &reduced, &[]).expect("predictable");
    e.update(k + 1, &predicted, &[], &[Some(0.0)])
        .expect("consistent")
}

/// One step from a copy of a belief that has reached its largest order, as in a loop: what it makes is dropped before
/// the next.
fn bench(c: &mut Criterion, group: &str, id: impl ToString, warm: usize, e: &AnyEstimator) {
    let belief = (0..warm).fold(e.prior(), |belief, k| step(e, k, belief));
    c.benchmark_group(group)
        .bench_function(BenchmarkId::from_parameter(id.to_string()), |b| {
            b.iter(|| black_box(step(e, warm, belief.clone())));
        });
}

/// The vehicle of [Li, Sec. IV].
fn vehicle() -> Problem {
    let zonotope = |r: &[f64]| Uncertain::zonotope(vec![0.0; r.len()], Matrix::diagonal(r));
    Problem {
        system: AnySystem::VehicleSe2(
            VehicleSe2::new(0.01, Form::Euler).expect("a positive period"),
        ),
        prior: zonotope(&[0.1, 0.5, 0.5]),
        w: zonotope(&[0.1; 3]),
        v: zonotope(&[1.0; 2]),
    }
}

/// One step of a filter of the vehicle, from a belief of its largest order.
fn vehicles(c: &mut Criterion) {
    let poles = r#""gain": {"longitudinal": 0.98, "lateral": [0.95, 0.98]}"#;
    for (id, settings) in [
        ("zsmf 30", r#""kind": "zsmf", "generators": 30"#.to_owned()),
        ("inzsmf 30", r#""kind": "inzsmf", "generators": 30"#.to_owned()),
        ("zsmf 30 poles", format!(r#""kind": "zsmf", "generators": 30, {poles}"#)),
        ("inzsmf 30 poles", format!(r#""kind": "inzsmf", "generators": 30, {poles}"#)),
        (
            "inzsmf 120 girard",
            r#""kind": "inzsmf", "generators": 120, "reduction": "girard""#.to_owned(),
        ),
        (
            "inzsmf 120 girard enclosed",
            r#""kind": "inzsmf", "generators": 120, "reduction": "girard", "remainder": "enclosed""#.to_owned(),
        ),
    ] {
        let e = estimator(&format!("{{{settings}}}"), &vehicle());
        let step = |k: usize, belief: AnyBelief| {
            let reduced = e.reduce_order(k, belief).expect("reducible");
            let predicted = e.predict(k + 1, &reduced, &[0.4, 8.0]).expect("predictable");
            let way = 0.08 * (k + 1) as f64;
            e.update(k + 1, &predicted, &[0.4, 8.0], &[Some(way), Some(0.0)])
                .expect("consistent")
        };
        let belief = (0..40).fold(e.prior(), |belief, k| step(k, belief));
        c.benchmark_group("vehicle")
            .bench_function(BenchmarkId::from_parameter(id), |b| {
                b.iter(|| black_box(step(40, belief.clone())));
            });
    }
}

/// The filters that everybody knows, on the quadrotor of twelve states.
fn baselines(c: &mut Criterion) {
    let part =
        |n: usize, r: f64| Uncertain::from_box(&vec![-r; n], &vec![r; n]).expect("ordered bounds");
    let problem = Problem {
        system: AnySystem::Quadrotor(Quadrotor::published()),
        prior: part(12, 0.1),
        w: part(3, 1.0),
        v: part(9, 0.01),
    };
    for settings in [
        r#"{"kind": "ekf"}"#,
        r#"{"kind": "ukf"}"#,
        r#"{"kind": "particle", "particles": 1000}"#,
    ] {
        let e = estimator(settings, &problem);
        let step = |k: usize, belief: AnyBelief| {
            let predicted = e
                .predict(k + 1, &belief, &[9.81, 0.0, 0.0, 0.0])
                .expect("predictable");
            e.update(k + 1, &predicted, &[9.81, 0.0, 0.0, 0.0], &[Some(0.0); 9])
                .expect("consistent")
        };
        let belief = (0..5).fold(e.prior(), |belief, k| step(k, belief));
        c.benchmark_group("quadrotor")
            .bench_function(BenchmarkId::from_parameter(e.kind()), |b| {
                b.iter(|| black_box(step(5, belief.clone())));
            });
    }
}

fn mixed(kind: &str, phi: usize) -> String {
    format!(r#"{{"kind": "{kind}", "phi": {phi}, "eta": 0.5, "alpha": 0.0027}}"#)
}

fn steps(c: &mut Criterion) {
    for n in [1, 2, 3, 6] {
        let problem = linear(n);
        bench(
            c,
            "kalman n",
            n,
            20,
            &estimator(r#"{"kind": "kalman"}"#, &problem),
        );
        bench(
            c,
            "box-state-est n",
            n,
            20,
            &estimator(r#"{"kind": "box-state-est"}"#, &problem),
        );
    }
    for phi in [20, 100, 500] {
        bench(
            c,
            "ezgkf van-der-pol phi",
            phi,
            30,
            &estimator(&mixed("ezgkf", phi), &van_der_pol()),
        );
    }
    for phi in [500, 1000, 2000, 4000, 8000] {
        bench(
            c,
            "ezgkf lpv phi",
            phi,
            30,
            &estimator(&mixed("ezgkf", phi), &lpv()),
        );
    }
    bench(
        c,
        "ezgkp lpv phi",
        4000,
        30,
        &estimator(&mixed("ezgkp", 4000), &lpv()),
    );
    bench(
        c,
        "ezgkf-m lpv phi",
        4000,
        40,
        &estimator(&mixed("ezgkf-m", 4000), &lpv()),
    );
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(30)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(1500));
    targets = steps, vehicles, baselines
}
criterion_main!(benches);
