//! The InZSMF with an enclosed remainder: the truth, known to rounding, never leaves its sets under noise
//! that keeps to the bounds.

use core::f64::consts::{FRAC_PI_2, PI};
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

/// Checks every step; the half-width of the heading and the area of the position, as means.
fn judge(
    name: &str,
    estimator: &AnyEstimator,
    t: &Trajectory,
) -> Result<[f64; 4], EstimationError> {
    let y: Vec<Vec<Option<f64>>> =
        t.y.iter()
            .map(|y| y.iter().copied().map(Some).collect())
            .collect();
    let mut sums = [0.0; 4];
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
        assert_ne!(
            belief.contains(&truth),
            Containment::Outside,
            "{name} at {}",
            step.k
        );
        let hull = belief.interval_hull().unwrap();
        for (side, x) in hull.iter().zip(&truth) {
            assert!(
                side.contains_interval(*x),
                "{name} at {}: {side:?} {x:?}",
                step.k
            );
        }
        let center = belief.center();
        assert!(hull.contains(&center), "{name}: {center:?}");
        let area = belief.extras()[2].1;
        let [h, x1, x2] = [hull[0].width(), hull[1].width(), hull[2].width()];
        for (s, x) in sums.iter_mut().zip([
            h,
            x1 * x2,
            area,
            f64::from(u8::from(belief.contains(&truth) == Containment::Inside)),
        ]) {
            *s += x / STEPS as f64;
        }
    }
    Ok(sums)
}

#[test]
fn the_truth_never_leaves_the_set() {
    for form in [Form::Euler, Form::Group] {
        let problem = problem(form, [0.1, 0.5, 0.5]);
        for settings in [
            r#""generators": 120, "reduction": "girard""#,
            r#""generators": 120, "reduction": "outer""#,
            r#""generators": 30, "reduction": "girard""#,
            r#""generators": 30, "reduction": "girard", "transient": "lag""#,
            r#""generators": 120, "reduction": "girard", "gain": {"longitudinal": 0.98, "lateral": [0.95, 0.98]}"#,
        ] {
            let json = format!(r#"{{"kind": "inzsmf", "remainder": "enclosed", {settings}}}"#);
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
                match judge(&name, &estimator, &t) {
                    Ok(m) => println!("{name}: {m:.3?}"),
                    Err(error) => println!("{name}: {error}"),
                }
            }
        }
    }
}

#[test]
fn from_the_papers_start() {
    for (form, settings) in [
        (Form::Euler, r#""generators": 30, "reduction": "outer""#),
        (Form::Euler, r#""generators": 60, "reduction": "outer""#),
        (Form::Euler, r#""generators": 120, "reduction": "outer""#),
        (Form::Euler, r#""generators": 400, "reduction": "outer""#),
        (Form::Euler, r#""generators": 30, "reduction": "girard""#),
        (Form::Euler, r#""generators": 60, "reduction": "girard""#),
        (Form::Euler, r#""generators": 120, "reduction": "girard""#),
        (Form::Euler, r#""generators": 400, "reduction": "girard""#),
    ] {
        for start in [[1.0, 1.0, 1.0], [0.1, 0.5, 0.5]] {
            let problem = problem(form, start);
            for remainder in ["enclosed", "dropped"] {
                let json =
                    format!(r#"{{"kind": "inzsmf", "remainder": "{remainder}", {settings}}}"#);
                let estimator = estimator(&json, &problem);
                let zero = Noise::Drawn(Drawn {
                    law: Law::Uniform,
                    of: problem.w.clone(),
                    truncate: false,
                });
                let v = Noise::Drawn(Drawn {
                    law: Law::Uniform,
                    of: problem.v.clone(),
                    truncate: false,
                });
                let t = run(
                    &problem,
                    [FRAC_PI_2, 0.0, 0.0],
                    zero,
                    v,
                    Inputs::Constant(vec![0.4, 8.0]),
                );
                match judge("uniform", &estimator, &t) {
                    Ok(m) => println!("{start:?} {remainder} {settings}: {m:.3?}"),
                    Err(error) => println!("{start:?} {remainder} {settings}: {error}"),
                }
            }
        }
    }
    let _ = PI;
}
