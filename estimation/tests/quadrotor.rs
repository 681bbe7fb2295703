//! The quadrotor of twelve states: thin sets, certified membership at every step.

use allocation_counter::measure;
use zonobench_estimation::controller::Controller;
use zonobench_estimation::estimator::{Containment, Phase};
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::systems::Quadrotor;
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, Estimator, Inputs, Online, Problem, Trajectory, Truth,
    Uncertain, simulate, track,
};
use zonobench_sets::Interval;

fn centered(half: &[f64]) -> Uncertain {
    let minus: Vec<f64> = half.iter().map(|x| -x).collect();
    Uncertain::from_box(&minus, half).unwrap()
}

/// X_0, W and V of [Rego2020, Sec. 5.2].
fn problem() -> Problem {
    let pi = std::f64::consts::PI;
    let mut prior = vec![2.0, 2.0, 2.0, 1.0, 1.0, 1.0, pi / 6.0, pi / 6.0, pi / 2.0];
    prior.extend([pi / 12.0; 3]);
    let mut v = vec![0.15, 0.15, 0.51];
    v.extend([2.618e-3; 3]);
    v.extend([16.558e-3; 3]);
    Problem {
        system: AnySystem::Quadrotor(Quadrotor::published()),
        prior: centered(&prior),
        w: centered(&[1.0; 3]),
        v: centered(&v),
    }
}

/// A flight with noise of vertices, the worst that is admissible.
fn flight(problem: &Problem, steps: usize) -> Trajectory {
    let mut x0 = vec![0.0; 12];
    (x0[0], x0[2], x0[8]) = (0.5, 1.0, std::f64::consts::FRAC_PI_3);
    let drawn = |of: &Uncertain, law| {
        Noise::Drawn(Drawn {
            law,
            of: of.clone(),
            truncate: false,
        })
    };
    let truth = Truth {
        x0: InitialState::Point(x0),
        w: drawn(&problem.w, Law::Vertices),
        v: drawn(&problem.v, Law::Uniform),
        delta: None,
    };
    let inputs = Inputs::Controller(Controller::FeedbackLinearising);
    simulate(&problem.system, &truth, &inputs, 11, 0, steps).unwrap()
}

#[test]
fn the_state_is_proved_inside_every_set_of_every_filter() {
    let (problem, steps) = (problem(), 150);
    let t = flight(&problem, steps);
    // The measured y of the position is missing now and then.
    let y: Vec<Vec<Option<f64>>> = (t.y.iter().enumerate())
        .map(|(k, y)| {
            let there = |i: usize| i > 2 || k % 4 != 3;
            (y.iter().enumerate())
                .map(|(i, &y)| there(i).then_some(y))
                .collect()
        })
        .collect();
    let mut radii = Vec::new();
    for settings in [
        r#"{"kind": "zmv", "generators": 40}"#,
        r#"{"kind": "zfo", "generators": 25}"#,
        r#"{"kind": "czmv", "generators": 40, "constraints": 12}"#,
        r#"{"kind": "czmv", "generators": 25, "constraints": 3}"#,
        r#"{"kind": "czfo", "generators": 40, "constraints": 12, "h": "c3", "expansion": "lean"}"#,
        r#"{"kind": "czfo", "generators": 25, "constraints": 3, "h": "c3"}"#,
    ] {
        let estimator =
            AnyEstimator::new(&serde_json::from_str(settings).unwrap(), &problem).unwrap();
        assert!(estimator.guaranteed() && estimator.reported_phase() == Phase::Updated);
        let mut radius = 0.0;
        for step in track(&estimator, steps, &t.u, &y) {
            let updated = step.updated.unwrap();
            let state = t.x[step.k].iter().zip(&t.rounding[step.k]);
            let state: Vec<Interval> = state
                .map(|(&x, &r)| Interval::from_center_radius(x, r))
                .collect();
            let verdict = updated.contains(&state);
            assert_eq!(verdict, Containment::Inside, "{settings} k = {}", step.k);
            radius += updated.size().radius.unwrap();
        }
        radii.push(radius / (steps + 1) as f64);
    }
    // Constrained zonotopes are smaller, and the filters of the same sets alike.
    assert!(radii[2] < 0.95 * radii[0], "{radii:?}");
    assert!((radii[4] / radii[2] - 1.0).abs() < 0.05, "{radii:?}");
    assert!((radii[5] / radii[3] - 1.0).abs() < 0.05, "{radii:?}");
}

/// Once its lists have found their sizes, a filter in a loop does not ask the allocator: 100 steps after 150.
#[test]
fn a_step_of_a_filter_in_a_loop_allocates_nothing() {
    const WARM: usize = 150;
    let problem = problem();
    let t = flight(&problem, WARM + 100);
    let czmv = r#"{"kind": "czmv", "generators": 40, "constraints": 12}"#;
    for (settings, every) in [
        (czmv, 1),
        (czmv, 10),
        (r#"{"kind": "czmv", "generators": 25, "constraints": 3}"#, 1),
        (r#"{"kind": "zmv", "generators": 40}"#, 1),
        (r#"{"kind": "zfo", "generators": 25}"#, 1),
        (
            r#"{"kind": "czfo", "generators": 40, "constraints": 12, "h": "c3", "expansion": "lean"}"#,
            1,
        ),
    ] {
        let settings_of = serde_json::from_str(settings).unwrap();
        let mut filter = Online::new(AnyEstimator::new(&settings_of, &problem).unwrap());
        let y: Vec<Vec<Option<f64>>> = (t.y.iter().enumerate())
            .map(|(k, y)| {
                let there = |i: usize| i > 2 || k % every == 0;
                (y.iter().enumerate())
                    .map(|(i, &y)| there(i).then_some(y))
                    .collect()
            })
            .collect();
        let mut fly = |steps: std::ops::RangeInclusive<usize>| {
            for k in steps {
                filter.step(&t.u[k.max(1) - 1], &y[k]).unwrap();
            }
        };
        fly(0..=WARM);
        let asked = measure(|| fly(WARM + 1..=WARM + 100));
        assert_eq!(asked.count_total, 0, "{settings}, {every}: {asked:?}");
    }
}

#[test]
fn lift_has_hulls_on_twelve_states_and_no_volume() {
    let (problem, steps) = (problem(), 12);
    let t = flight(&problem, steps);
    let y: Vec<Vec<Option<f64>>> =
        (t.y.iter().map(|y| y.iter().map(|&y| Some(y)).collect())).collect();
    let settings = r#"{"kind": "lift", "carry": "hull"}"#;
    let lift = AnyEstimator::new(&serde_json::from_str(settings).unwrap(), &problem).unwrap();
    for step in track(&lift, steps, &t.u, &y) {
        let updated = step.updated.unwrap();
        assert_eq!(updated.volume(), None);
        let state = t.x[step.k].iter().zip(&t.rounding[step.k]);
        let state: Vec<Interval> = state
            .map(|(&x, &r)| Interval::from_center_radius(x, r))
            .collect();
        // Rows that are affine but for rounding make the set too thin for a proof of membership.
        assert_ne!(updated.contains(&state), Containment::Outside, "{}", step.k);
        assert!(updated.interval_hull().unwrap().contains(&t.x[step.k]));
        // What is measured is known as well as it was measured, or better.
        let widths = updated.interval_hull().unwrap().widths();
        assert!(widths[0] <= 0.3 + 1e-12 && widths[6] <= 5.236e-3 + 1e-12);
    }
}
