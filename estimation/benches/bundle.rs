//! A step (prediction and update) of the polytopic filters on their two examples; with the volume, which
//! needs all facets of the updated set, and with the hull alone.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;
use zonobench_estimation::systems::{QuotientForm, Raimondo, Unicycle};
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, Estimator, EstimatorSettings, Problem, System, Uncertain,
};
use zonobench_sets::Matrix;

fn raimondo() -> Problem {
    let noise = |r: f64| Uncertain::from_box(&[-r; 2], &[r; 2]).unwrap();
    let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]]).unwrap();
    Problem {
        system: AnySystem::Raimondo(Raimondo {
            form: QuotientForm::Expanded,
            ..Raimondo::default()
        }),
        prior: Uncertain::zonotope(vec![0.5, 0.5], g),
        w: noise(0.1),
        v: noise(0.4),
    }
}

fn unicycle() -> Problem {
    let landmarks = vec![[5.0, 15.0], [15.0, 15.0]];
    Problem {
        system: AnySystem::Unicycle(Unicycle::new(1.0, 0.3, 0.15, landmarks).unwrap()),
        prior: Uncertain::from_box(&[0.05, 0.145, 0.8], &[0.15, 0.255, 1.2]).unwrap(),
        w: Uncertain::from_box(&[-0.06, -0.04, -0.08], &[0.04, 0.02, 0.04]).unwrap(),
        v: Uncertain::from_box(&[-0.01, -0.01, -0.02, -0.03], &[0.01, 0.02, 0.01, 0.02]).unwrap(),
    }
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("bundle");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    for (example, problem, x0) in [
        ("ex1", raimondo(), vec![0.6, 0.55]),
        ("ex2", unicycle(), vec![0.1, 0.2, 1.0]),
    ] {
        for settings in [
            "rrsr",
            "d-rrsr",
            "d-zb",
            "d-cz",
            "comb",
            "comb+",
            "lift",
            "lift hull",
        ] {
            let (kind, hull) = match settings.split_once(' ') {
                Some((kind, _)) => (kind, true),
                None => (settings, false),
            };
            let carry = if hull { r#", "carry": "hull""# } else { "" };
            let text = format!(r#"{{"kind": "{kind}"{carry}}}"#);
            let read: EstimatorSettings = serde_json::from_str(&text).unwrap();
            let e = AnyEstimator::new(&read, &problem).unwrap();
            // Two steps without noise, so that the set is one of many.
            let variables = problem.system.variables();
            let (n_w, n_v) = (variables.w.len(), variables.v.len());
            let mut x = x0.clone();
            let look = |k: usize, x: &[f64]| {
                let mut y = vec![0.0; variables.y.len()];
                problem.system.h(k, x, &[], &vec![0.0; n_v], &mut y);
                y.into_iter().map(Some).collect::<Vec<_>>()
            };
            let mut belief = e.update(0, &e.prior(), &[], &look(0, &x)).unwrap();
            let mut y = Vec::new();
            for k in 1..=3 {
                let mut next = x.clone();
                problem.system.f(k - 1, &x, &[], &vec![0.0; n_w], &mut next);
                x = next;
                y = look(k, &x);
                if k < 3 {
                    let predicted = e.predict(k, &belief, &[]).unwrap();
                    belief = e.update(k, &predicted, &[], &y).unwrap();
                }
            }
            // The facets of the set that a step starts from belong to the step before.
            belief.volume();
            group.bench_function(format!("{example}/{settings}"), |b| {
                b.iter(|| {
                    let predicted = e.predict(3, black_box(&belief), &[]).unwrap();
                    let updated = e.update(3, &predicted, &[], &y).unwrap();
                    if hull {
                        black_box(updated.interval_hull());
                    } else {
                        black_box(updated.volume());
                    }
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
