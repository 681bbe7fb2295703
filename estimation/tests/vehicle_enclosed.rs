//! The InZSMF with an enclosed remainder: the truth, known to rounding, never leaves its sets under noise
//! that keeps to the bounds.

use core::f64::consts::FRAC_PI_2;
use zonobench_estimation::estimator::Containment;
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::systems::{Form, VehicleSe2};
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimationError, EstimatorSettings, Inputs, Problem,
    Trajectory, Truth, Uncertain, simulate, track,
};
use zonobench_sets::{Interval, Matrix};

const STEPS: usize = 400;

fn problem(form: Form, start: [f64; 3]) -> Problem {
    Problem {
        system: AnySystem::VehicleSe2(VehicleSe2::new(0.01, form).unwrap()),
        prior: Uncertain::zonotope(vec![FRAC_PI_2, 0.0, 0.0], Matrix::diagonal(&start)),
        w: Uncertain::from_box(&[-0.1; 3], &[0.1; 3]).unwrap(),
        v: Uncertain::from_box(&[-1.0; 2], &[1.0; 2]).unwrap(),
    }
}

fn estimator(json: &str, problem: &Problem) -> AnyEstimator {
    let settings: EstimatorSettings = serde_json::from_str(json).unwrap();
    AnyEstimator::new(&settings, problem).unwrap()
}

fn vertices(of: &Uncertain) -> Noise {
    Noise::Drawn(Drawn {
        law: Law::Vertices,
        of: of.clone(),
        truncate: false,
    })
}

/// Noise given step by step, as a share of its bound; the last 10⁻¹² of it pays for the simulation's rounding.
fn given(bound: f64, rows: impl Iterator<Item = Vec<f64>>) -> Noise {
    let inside = bound * (1.0 - 1e-12);
    Noise::Data(
        rows.map(|row| row.iter().map(|x| inside * x).collect())
            .collect(),
    )
}

/// v across the direction of travel, as far as the box lets it, with the sign of `wave`.
fn lateral(wave: impl Fn(usize) -> f64) -> Noise {
    given(
        1.0,
        (0..=STEPS).map(|k| {
            let theta = FRAC_PI_2 + 0.004 * k as f64;
            let q = [-libm::sin(theta), libm::cos(theta)];
            let most = q[0].abs().max(q[1].abs());
            q.map(|x| wave(k) * x / most).to_vec()
        }),
    )
}

/// (name, w, v) of the attacks.
fn attacks(problem: &Problem) -> Vec<(&'static str, Noise, Noise)> {
    let constant =
        |n: usize, bound: f64, sign: f64| given(bound, (0..=STEPS).map(|_| vec![sign; n]));
    let square = |period: usize| move |k: usize| if k % period < period / 2 { 1.0 } else { -1.0 };
    vec![
        (
            "random vertices",
            vertices(&problem.w),
            vertices(&problem.v),
        ),
        ("constant v", vertices(&problem.w), constant(2, 1.0, 1.0)),
        (
            "constant w and v",
            constant(3, 0.1, 1.0),
            constant(2, 1.0, -1.0),
        ),
        (
            "lateral square 200",
            constant(3, 0.1, -1.0),
            lateral(square(200)),
        ),
        (
            "lateral square 60",
            vertices(&problem.w),
            lateral(square(60)),
        ),
        ("lateral bias", constant(3, 0.1, 1.0), lateral(|_| 1.0)),
    ]
}

fn run(problem: &Problem, x0: [f64; 3], w: Noise, v: Noise, u: Inputs) -> Trajectory {
    let truth = Truth {
        x0: InitialState::Point(x0.to_vec()),
        w,
        v,
        delta: None,
    };
    simulate(&problem.system, &truth, &u, 7, 0, STEPS).unwrap()
}

/// Means over the steps.
#[derive(Debug, Default)]
struct Means {
    /// Width of the heading, in rad.
    heading: f64,
    /// Area of the position, in m².
    area: f64,
    /// Share of the steps with the truth proved to be inside.
    inside: f64,
}

/// Checks that no step loses the truth; a component of y that is NaN is missing.
fn judge(name: &str, estimator: &AnyEstimator, t: &Trajectory) -> Result<Means, EstimationError> {
    let y: Vec<Vec<Option<f64>>> =
        t.y.iter()
            .map(|y| y.iter().map(|y| Some(*y).filter(|y| !y.is_nan())).collect())
            .collect();
    let mut means = Means::default();
    for step in track(estimator, STEPS, &t.u, &y) {
        let belief = step.updated?;
        let truth: Vec<Interval> = t.x[step.k]
            .iter()
            .zip(&t.rounding[step.k])
            .map(|(&x, &r)| Interval::from_center_radius(x, r))
            .collect();
        assert!(
            truth.iter().all(|x| x.width() < 1e-9),
            "{name}: the truth is known"
        );
        let verdict = belief.contains(&truth);
        assert_ne!(verdict, Containment::Outside, "{name} at {}", step.k);
        let hull = belief.interval_hull().unwrap();
        for (side, x) in hull.iter().zip(&truth) {
            assert!(
                side.contains_interval(*x),
                "{name} at {}: {side:?} {x:?}",
                step.k
            );
        }
        let share = 1.0 / (STEPS + 1) as f64;
        means.heading += share * hull[0].width();
        means.area += share * belief.extras()[1].1;
        means.inside += share * f64::from(u8::from(verdict == Containment::Inside));
    }
    Ok(means)
}

/// The mean width of the heading and the mean area of the position over the steps, none of which lost the
/// truth.
fn attacked(form: Form, settings: &str) {
    let problem = problem(form, [0.1, 0.5, 0.5]);
    let json =
        format!(r#"{{"kind": "inzsmf", "remainder": "enclosed", "generators": 120, {settings}}}"#);
    let estimator = estimator(&json, &problem);
    for (i, (name, w, v)) in attacks(&problem).into_iter().enumerate() {
        let corner = |j: u32| if (i >> j) & 1 == 0 { 1.0 } else { -1.0 };
        let x0 = [
            FRAC_PI_2 + 0.0999 * corner(0),
            0.4999 * corner(1),
            0.4999 * corner(2),
        ];
        let t = run(&problem, x0, w, v, Inputs::Constant(vec![0.4, 8.0]));
        let name = format!("{form:?}, {settings}, {name}");
        let means = judge(&name, &estimator, &t).unwrap_or_else(|error| panic!("{name}: {error}"));
        // A position cannot be known better than its constant bias: 2 × 2.
        assert!(
            means.heading < 2.5 && (4.0..16.0).contains(&means.area),
            "{name}: {means:?}"
        );
        assert!(means.inside > 0.9, "{name}: {means:?}");
    }
}

#[test]
fn the_truth_never_leaves_the_set_of_the_euler_form() {
    attacked(Form::Euler, r#""reduction": "girard""#);
    attacked(Form::Euler, r#""reduction": "outer""#);
}

#[test]
fn the_truth_never_leaves_the_set_of_the_group_form() {
    attacked(Form::Group, r#""reduction": "girard", "transient": "lag""#);
}

#[test]
fn the_truth_never_leaves_the_set_with_poles() {
    attacked(
        Form::Group,
        r#""reduction": "girard", "gain": {"longitudinal": 0.98, "lateral": [0.95, 0.98]}"#,
    );
}

#[test]
fn the_truth_never_leaves_the_set_when_speed_and_turn_rate_vary_and_measurements_are_missing() {
    let problem = problem(Form::Euler, [0.1, 0.5, 0.5]);
    let json =
        r#"{"kind": "inzsmf", "remainder": "enclosed", "generators": 120, "reduction": "girard"}"#;
    let estimator = estimator(json, &problem);
    let u: Vec<Vec<f64>> = (0..=STEPS)
        .map(|k| {
            vec![
                libm::sin(0.05 * k as f64),
                8.0 + 4.0 * libm::cos(0.02 * k as f64),
            ]
        })
        .collect();
    let (w, v) = (vertices(&problem.w), vertices(&problem.v));
    let mut t = run(
        &problem,
        [FRAC_PI_2 - 0.0999, 0.4999, -0.4999],
        w,
        v,
        Inputs::Data(u),
    );
    judge("varying", &estimator, &t).unwrap();
    // A NaN stands for a component that is missing.
    for (k, y) in t.y.iter_mut().enumerate() {
        if k % 5 == 3 {
            y[k % 2] = f64::NAN;
        }
    }
    judge("missing", &estimator, &t).unwrap();
}

#[test]
fn a_set_whose_headings_reach_half_a_turn_is_refused() {
    for (start, generators) in [([1.0; 3], 120), ([0.1, 0.5, 0.5], 30)] {
        let problem = problem(Form::Euler, start);
        let json =
            format!(r#"{{"kind": "inzsmf", "remainder": "enclosed", "generators": {generators}}}"#);
        let estimator = estimator(&json, &problem);
        let (w, v) = (vertices(&problem.w), vertices(&problem.v));
        let t = run(
            &problem,
            [FRAC_PI_2, 0.0, 0.0],
            w,
            v,
            Inputs::Constant(vec![0.4, 8.0]),
        );
        let error = judge("refused", &estimator, &t).unwrap_err();
        assert!(
            matches!(error, EstimationError::Refused { k: 10.., .. }),
            "{error}"
        );
        assert!(error.to_string().contains("has reached pi"), "{error}");
    }
    let problem = problem(Form::Euler, [3.2, 0.5, 0.5]);
    let settings = r#"{"kind": "inzsmf", "remainder": "enclosed", "generators": 120}"#;
    let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
    let error = AnyEstimator::new(&settings, &problem).unwrap_err();
    assert!(
        matches!(error, EstimationError::Refused { k: 0, .. }),
        "{error}"
    );
}

#[test]
fn a_measurement_that_no_pose_agrees_with_is_inconsistent() {
    let problem = problem(Form::Euler, [0.1, 0.5, 0.5]);
    let json = r#"{"kind": "inzsmf", "remainder": "enclosed", "generators": 120}"#;
    let estimator = estimator(json, &problem);
    let at = |y: f64| {
        let y = vec![vec![Some(y), None]; 2];
        track(&estimator, 0, &[vec![0.4, 8.0]], &y)
            .next()
            .unwrap()
            .updated
    };
    assert!(at(1.499).is_ok(), "0.5 of the prior and 1 of the noise");
    assert!(matches!(
        at(1.501),
        Err(EstimationError::Inconsistent { k: 0 })
    ));
}

#[test]
fn a_gain_that_lags_ends_no_run_by_a_singular_innovation() {
    // v is small and exact in one direction, and the prior long and thin: C P C' + Q_v is singular to rounding.
    for (start, v) in [
        ([0.5, 1e3, 1e3], [1e-6, 1e-6]),
        ([1e-3, 1e6, 1e6], [1e-4, 0.0]),
        ([0.5, 0.0, 0.0], [0.0, 0.0]),
    ] {
        for form in [Form::Euler, Form::Group] {
            let problem = Problem {
                v: Uncertain::from_box(&v.map(|v: f64| -v), &v).unwrap(),
                w: Uncertain::from_box(&[-1e-9; 3], &[1e-9; 3]).unwrap(),
                ..problem(form, start)
            };
            let filter = estimator(
                r#"{"kind": "inzsmf", "generators": 60, "remainder": "enclosed", "transient": "lag"}"#,
                &problem,
            );
            let u = vec![vec![0.4, 8.0]; 60];
            let data = run_for(&problem, [FRAC_PI_2, 0.0, 0.0], &u, 59);
            let y: Vec<Vec<Option<f64>>> = data
                .y
                .iter()
                .map(|y| y.iter().copied().map(Some).collect())
                .collect();
            for step in track(&filter, 59, &u, &y) {
                match step.updated {
                    Ok(belief) => {
                        let x: Vec<Interval> = data.x[step.k]
                            .iter()
                            .zip(&data.rounding[step.k])
                            .map(|(&x, &r)| Interval::from_center_radius(x, r))
                            .collect();
                        assert_ne!(belief.contains(&x), Containment::Outside, "{start:?} {v:?}");
                    }
                    // Without noise y has no room for its own rounding.
                    Err(EstimationError::Inconsistent { .. }) if v[1] == 0.0 => break,
                    Err(EstimationError::Refused { .. }) => break,
                    Err(error) => panic!("{start:?} {v:?} {form:?}: {error}"),
                }
            }
        }
    }
}

fn run_for(problem: &Problem, x0: [f64; 3], u: &[Vec<f64>], steps: usize) -> Trajectory {
    let truth = Truth {
        x0: InitialState::Point(x0.to_vec()),
        w: given(1e-9, (0..steps).map(|_| vec![1.0; 3])),
        v: given(0.0, (0..=steps).map(|_| vec![0.0; 2])),
        delta: None,
    };
    simulate(
        &problem.system,
        &truth,
        &Inputs::Data(u.to_vec()),
        7,
        0,
        steps,
    )
    .unwrap()
}
