//! The filters that everybody knows, `ekf`, `ukf` and `particle`: on a linear system they are the Kalman filter, and
//! their covariance is that of their error.

use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::system::System;
use zonobench_estimation::systems::equations::{Equations, Motion, Source};
use zonobench_estimation::systems::{Linear, Lpv};
use zonobench_estimation::track::Track;
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimationError, Estimator, Problem, Uncertain,
    track,
};
use zonobench_sets::Matrix;
use zonobench_sets::ellipsoid::{Ellipsoid, chi_square_isf};

fn m(rows: &[&[f64]]) -> Matrix {
    Matrix::from_rows(rows).unwrap()
}

fn filter(settings: &str, problem: &Problem) -> AnyEstimator {
    AnyEstimator::new(&serde_json::from_str(settings).unwrap(), problem).unwrap()
}

fn gaussian(mean: &[f64], covariance: Matrix) -> Uncertain {
    Uncertain::gaussian(mean.to_vec(), covariance)
}

/// Three states, two measurements, an input in both equations, correlated noises that are not centered.
fn linear() -> Problem {
    let system = Linear::new(
        m(&[&[0.9, 0.4, 0.0], &[-0.3, 0.8, 0.1], &[0.0, 0.2, 0.7]]),
        Some(m(&[&[1.0], &[0.5], &[0.0]])),
        m(&[&[1.0, 0.0, 0.5], &[0.5, 1.0, 0.0]]),
        Some(m(&[&[0.0], &[0.25]])),
    );
    Problem {
        system: AnySystem::Linear(system.unwrap()),
        prior: gaussian(
            &[1.0, -1.0, 0.5],
            m(&[&[4.0, 1.0, 0.0], &[1.0, 2.0, 0.5], &[0.0, 0.5, 1.0]]),
        ),
        w: gaussian(
            &[0.02, 0.0, -0.01],
            m(&[&[0.04, 0.01, 0.0], &[0.01, 0.02, 0.0], &[0.0, 0.0, 0.0025]]),
        ),
        v: gaussian(&[0.1, -0.05], m(&[&[0.09, 0.02], &[0.02, 0.04]])),
    }
}

/// A trajectory of `problem` with Gaussian noise: states, inputs, measurements.
type Course = (Vec<Vec<f64>>, Vec<Vec<f64>>, Vec<Vec<Option<f64>>>);

/// Simulated with the covariances given, which need not be those that a filter is told.
fn course(problem: &Problem, run: u64, steps: usize) -> Course {
    let drawn = |part: &Uncertain, purpose, k: usize| -> Vec<f64> {
        let n = part.dim();
        let mut draws = Draws::new(77, purpose, run);
        let g: Vec<f64> = (0..n).map(|i| draws.gaussian(k, i, 0)).collect();
        let mut x = part.gaussian_mean().to_vec();
        let factor = part.covariance_matrix().cholesky().unwrap();
        factor.add_mul_vec(&g, &mut x);
        x
    };
    let sizes = problem.system.variables();
    let mut x = drawn(&problem.prior, Purpose::X0Gaussian, 0);
    let (mut xs, mut us, mut ys) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..=steps {
        let u: Vec<f64> = (sizes.u.iter())
            .map(|_| if k % 5 < 3 { 1.0 } else { -0.5 })
            .collect();
        let mut y = vec![0.0; sizes.y.len()];
        let v = drawn(&problem.v, Purpose::VGaussian, k);
        problem.system.h(k, &x, &u, &v, &mut y);
        let w = drawn(&problem.w, Purpose::WGaussian, k);
        let mut next = vec![0.0; x.len()];
        problem.system.f(k, &x, &u, &w, &mut next);
        xs.push(std::mem::replace(&mut x, next));
        us.push(u);
        ys.push(y.into_iter().map(Some).collect());
    }
    (xs, us, ys)
}

#[test]
fn on_a_linear_system_ekf_and_ukf_are_the_kalman_filter() {
    let problem = linear();
    let (_, u, mut y) = course(&problem, 0, 60);
    // Now and then a component is not measured, or none.
    for (k, y) in y.iter_mut().enumerate() {
        if k % 4 == 1 {
            y[k % 2] = None;
        }
        if k % 7 == 6 {
            *y = vec![None; 2];
        }
    }
    let kalman = filter(r#"{"kind": "kalman"}"#, &problem);
    for settings in [
        r#"{"kind": "ekf"}"#,
        r#"{"kind": "ekf", "wrap": true}"#,
        r#"{"kind": "ukf"}"#,
        r#"{"kind": "ukf", "alpha": 0.5, "beta": 1, "kappa": 2}"#,
        r#"{"kind": "ukf", "alpha": 1.5, "beta": 0, "kappa": -2}"#,
    ] {
        let ours = filter(settings, &problem);
        let steps = track(&kalman, 60, &u, &y).zip(track(&ours, 60, &u, &y));
        for (theirs, ours) in steps {
            let pairs = [
                (theirs.predicted.unwrap(), ours.predicted.unwrap()),
                (theirs.updated.unwrap(), ours.updated.unwrap()),
            ];
            for (a, b) in pairs {
                // Numbers below 10, of some hundred operations each.
                let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + a.abs());
                let (p, q) = (a.covariance().unwrap(), b.covariance().unwrap());
                let mut all = (a.center().into_iter().zip(b.center())).chain(
                    p.as_slice()
                        .iter()
                        .copied()
                        .zip(q.as_slice().iter().copied()),
                );
                assert!(all.all(|(a, b)| close(a, b)), "{settings}: {a:?} {b:?}");
                for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                    assert_eq!(q[(i, j)], q[(j, i)], "{settings}");
                }
                let (a, b) = (a.extras(), b.extras());
                assert_eq!(a.len(), b.len());
                for ((name, a), (same, b)) in a.iter().zip(&b) {
                    assert!(name == same && close(*a, *b), "{name} {a} {b}");
                }
            }
        }
    }
}

#[test]
fn a_small_alpha_costs_digits_and_no_more() {
    let problem = linear();
    let (_, u, y) = course(&problem, 0, 30);
    let last = |settings: &str| {
        let steps = track(&filter(settings, &problem), 30, &u, &y).last();
        steps.unwrap().updated.unwrap().center()
    };
    let exact = last(r#"{"kind": "kalman"}"#);
    let small = last(r#"{"kind": "ukf", "alpha": 1e-3}"#);
    let both = exact.iter().zip(&small);
    let off = both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // Images near 1 are rounded by 1e-16, and their sum in pairs is divided by 1e-6.
    assert!(1e-13 < off && off < 1e-8, "{off:e}");
}

/// The mean of 20 runs of 10⁴ particles over the same data, beside the Kalman filter: 3 standard errors of that mean, at
/// four steps and of three components.
#[test]
fn a_particle_filter_is_within_three_standard_errors_of_the_kalman_filter() {
    const RUNS: u64 = 20;
    let problem = linear();
    let (_, u, y) = course(&problem, 3, 9);
    let kalman = filter(r#"{"kind": "kalman"}"#, &problem);
    let exact: Vec<AnyBelief> = track(&kalman, 9, &u, &y)
        .map(|s| s.updated.unwrap())
        .collect();
    for settings in [
        r#"{"kind": "particle", "particles": 10000}"#,
        r#"{"kind": "particle", "particles": 10000, "resample_below": 1, "seed": 5}"#,
    ] {
        let ours = filter(settings, &problem);
        let runs: Vec<Vec<AnyBelief>> = (0..RUNS)
            .map(|run| {
                let steps = Track::new(&ours, 9, (u.as_slice(), y.as_slice())).of_run(run);
                steps.map(|s| s.updated.unwrap()).collect()
            })
            .collect();
        for k in [0, 3, 6, 9] {
            let p = exact[k].covariance().unwrap();
            for i in 0..3 {
                let errors: Vec<f64> = (runs.iter())
                    .map(|run| run[k].center()[i] - exact[k].center()[i])
                    .collect();
                let mean = errors.iter().sum::<f64>() / RUNS as f64;
                let squares: f64 = errors.iter().map(|e| (e - mean) * (e - mean)).sum();
                let sd = (squares / (RUNS - 1) as f64).sqrt();
                assert!(
                    mean.abs() <= 3.0 * sd / (RUNS as f64).sqrt(),
                    "{settings}, k = {k}, x{}: {mean} of {sd}",
                    i + 1
                );
                // So few particles are left by y_0 that they say less than N draws of the posterior, but by far
                // more than a guess.
                let posterior = p[(i, i)].sqrt();
                assert!(
                    sd < 0.25 * posterior,
                    "{settings}, k = {k}: {sd} of {posterior}"
                );
            }
        }
    }
}

/// The mean over `runs` of (x − x̂)ᵀ P⁻¹ (x − x̂) at the last step, and of the normalised innovation there.
fn consistency(settings: &str, told: &Problem, truth: &Problem, runs: u64) -> (f64, f64) {
    let ours = filter(settings, told);
    let (mut nees, mut nis) = (0.0, 0.0);
    for run in 0..runs {
        let (x, u, y) = course(truth, run, 20);
        let steps = Track::new(&ours, 20, (u.as_slice(), y.as_slice())).of_run(run);
        let last = steps.last().unwrap().updated.unwrap();
        let p = last.covariance().unwrap().clone();
        let ellipsoid = Ellipsoid::new(last.center(), p, 1.0).unwrap();
        nees += ellipsoid.squared_distance(&x[20]).unwrap();
        nis += last.extras()[0].1;
    }
    (nees / runs as f64, nis / runs as f64)
}

#[test]
fn a_consistent_filter_is_inside_its_bounds_and_one_with_a_tenth_of_the_noise_is_not() {
    const RUNS: u64 = 1000;
    let truth = linear();
    let mut tenth = truth.clone();
    for part in [&mut tenth.w, &mut tenth.v] {
        part.covariance = part.covariance.as_ref().map(|s| s.scale(0.1));
    }
    let bounds = |n: usize| {
        let of = |alpha| chi_square_isf(alpha, n * RUNS as usize).unwrap() / RUNS as f64;
        (of(0.975), of(0.025))
    };
    let ((lo, hi), (lo_y, hi_y)) = (bounds(3), bounds(2));
    for settings in [r#"{"kind": "ekf"}"#, r#"{"kind": "ukf"}"#] {
        let (nees, nis) = consistency(settings, &truth, &truth, RUNS);
        assert!(lo < nees && nees < hi, "{settings}: {nees}");
        assert!(lo_y < nis && nis < hi_y, "{settings}: {nis}");
        let (nees, nis) = consistency(settings, &tenth, &truth, RUNS);
        assert!(nees > hi && nis > hi_y, "{settings}: {nees} {nis}");
    }
}

/// One state, `next` for x⁺, and its measurement in `unit`.
fn equations(next: &str, output: &str, unit: &str) -> AnySystem {
    let named = |name: &str, unit: &str| vec![(name.to_owned(), unit.to_owned())];
    let source = Source {
        x: named("x", unit),
        u: Vec::new(),
        w: named("w", unit),
        y: named("y", unit),
        v: named("v", unit),
        parameters: Vec::new(),
        definitions: Vec::new(),
        motion: Motion::Next(vec![("x".to_owned(), next.to_owned())]),
        output: vec![("y".to_owned(), output.to_owned())],
        period: None,
    };
    AnySystem::Equations(Equations::new(source).unwrap())
}

fn one_state(system: AnySystem, prior: (f64, f64), w: f64, v: f64) -> Problem {
    let part = |mean: f64, variance: f64| gaussian(&[mean], m(&[&[variance]]));
    Problem {
        system,
        prior: part(prior.0, prior.1),
        w: part(0.0, w),
        v: part(0.0, v),
    }
}

const ALL: [&str; 3] = [
    r#"{"kind": "ekf", "wrap": true}"#,
    r#"{"kind": "ukf", "wrap": true}"#,
    r#"{"kind": "particle", "particles": 4000, "wrap": true}"#,
];

#[test]
fn angles_are_compared_on_the_circle_where_that_is_asked_for() {
    // A compass that says −3.1 of a heading near 3.1: 0.083 away, not 6.2.
    let problem = one_state(equations("x + w", "x + v", "rad"), (3.1, 0.01), 1e-4, 0.01);
    let expected = 3.1 + 0.5 * (std::f64::consts::TAU - 6.2);
    for settings in ALL {
        let update = |settings: &str| {
            let ours = filter(settings, &problem);
            ours.update(0, &ours.prior(), &[], &[Some(-3.1)]).unwrap()
        };
        let error = update(settings).center()[0] - expected;
        // Four thousand particles know a mean of deviation 0.07 to 0.002.
        assert!(error.abs() < 0.006, "{settings}: {error}");
        let straight = settings.replace("true", "false");
        let error = update(&straight).center()[0] - expected;
        assert!(error.abs() > 0.1, "{straight}: {error}");
    }
}

#[test]
fn the_mean_of_a_cloud_across_the_cut_of_the_circle_is_in_the_cloud() {
    // f takes headings back to (−π, π], so that a cloud about π falls apart into two.
    let next = "2 * atan(tan(x / 2)) + w";
    let problem = one_state(equations(next, "x + v", "rad"), (3.1, 0.01), 1e-6, 0.01);
    let ours = filter(ALL[2], &problem);
    let predicted = ours.predict(1, &ours.prior(), &[]).unwrap();
    let center = predicted.center()[0];
    let turn = (center - 3.1) / std::f64::consts::TAU;
    assert!((turn - turn.round()).abs() < 0.001, "{center}");
    let variance = predicted.covariance().unwrap()[(0, 0)];
    assert!((variance / 0.01 - 1.0).abs() < 0.1, "{variance}");
    let ukf = filter(ALL[1], &problem);
    let variance = ukf.predict(1, &ukf.prior(), &[]).unwrap();
    let variance = variance.covariance().unwrap()[(0, 0)];
    assert!((variance / 0.01 - 1.0).abs() < 0.1, "{variance}");
}

#[test]
fn the_unscented_moments_of_a_square_are_the_exact_ones() {
    // x ~ N(0, 1): the mean of x² is 1, its variance 2. The noise of x⁺ is known.
    let problem = one_state(equations("x^2 + 0 * w", "x + v", "1"), (0.0, 1.0), 0.0, 1.0);
    // L = 2 with w: κ = −1 makes L + κ = 1, and β = 2 is right for a Gaussian.
    let ours = filter(r#"{"kind": "ukf", "kappa": -1}"#, &problem);
    let predicted = ours.predict(1, &ours.prior(), &[]).unwrap();
    assert!((predicted.center()[0] - 1.0).abs() < 1e-14);
    assert!((predicted.covariance().unwrap()[(0, 0)] - 2.0).abs() < 1e-14);
    // The linearised filter takes the parabola for flat there.
    let ours = filter(r#"{"kind": "ekf"}"#, &problem);
    let predicted = ours.predict(1, &ours.prior(), &[]).unwrap();
    assert_eq!(predicted.center(), [0.0]);
    assert_eq!(predicted.covariance().unwrap()[(0, 0)], 0.0);
}

#[test]
fn a_measurement_without_a_covariance_is_left_out_and_the_run_goes_on() {
    // A constant that is seen without noise: 0.5, and then 0.75, which it cannot be.
    let problem = one_state(equations("x + w", "x + v", "1"), (0.0, 1.0), 0.0, 0.0);
    let y: Vec<Vec<Option<f64>>> = [0.5, 0.5, 0.75, 0.5].map(|y| vec![Some(y)]).to_vec();
    for settings in [r#"{"kind": "ekf"}"#, r#"{"kind": "ukf"}"#] {
        let ours = filter(settings, &problem);
        let beliefs: Vec<AnyBelief> = track(&ours, 3, &[], &y)
            .map(|s| s.updated.unwrap())
            .collect();
        let status: Vec<Option<&str>> = beliefs.iter().map(|b| b.status()).collect();
        assert_eq!(status, [None, None, Some("singular"), None], "{settings}");
        for belief in &beliefs {
            assert!((belief.center()[0] - 0.5).abs() < 1e-15, "{settings}");
        }
        assert_eq!(beliefs[2].extras(), []);
    }
    // A likelihood without a density weighs nothing.
    let ours = filter(r#"{"kind": "particle"}"#, &problem);
    for step in track(&ours, 3, &[], &y) {
        let (before, after) = (step.predicted.unwrap(), step.updated.unwrap());
        assert_eq!(after.status(), Some("singular"));
        assert_eq!(after.center(), before.center());
    }
}

#[test]
fn an_innovation_beyond_every_particle_is_left_out() {
    let problem = one_state(equations("x + w", "x + v", "1"), (0.0, 1.0), 1.0, 1e-4);
    let ours = filter(r#"{"kind": "particle"}"#, &problem);
    let updated = ours.update(0, &ours.prior(), &[], &[Some(1e200)]).unwrap();
    assert_eq!(updated.status(), Some("singular"));
    assert_eq!(updated.center(), ours.prior().center());
    // Far, but a number: the nearest particle has it all.
    let updated = ours.update(0, &ours.prior(), &[], &[Some(50.0)]).unwrap();
    let AnyBelief::ParticleBelief(updated) = updated else {
        panic!("particles")
    };
    assert!(updated.effective() < 1.1 && updated.status().is_none());
}

#[test]
fn a_system_that_is_not_defined_at_the_estimate_is_refused() {
    let problem = one_state(
        equations("sqrt(x) + w", "ln(x) + v", "1"),
        (-1.0, 1e-4),
        0.1,
        0.1,
    );
    for settings in ALL {
        let ours = filter(settings, &problem);
        let error = ours.predict(1, &ours.prior(), &[]).unwrap_err();
        assert!(
            matches!(error, EstimationError::Refused { k: 1, .. }),
            "{error}"
        );
        let error = ours
            .update(0, &ours.prior(), &[], &[Some(1.0)])
            .unwrap_err();
        assert!(
            matches!(error, EstimationError::Refused { k: 0, .. }),
            "{error}"
        );
    }
    // Some particles are where it is, and they go on.
    let problem = one_state(
        equations("sqrt(x) + w", "ln(x) + v", "1"),
        (0.1, 1.0),
        0.1,
        0.1,
    );
    let ours = filter(ALL[2], &problem);
    let predicted = ours.predict(1, &ours.prior(), &[]).unwrap();
    let updated = ours.update(1, &predicted, &[], &[Some(0.0)]).unwrap();
    assert!(updated.center()[0] > 0.5, "{:?}", updated.center());
}

#[test]
fn a_set_alone_stands_for_the_uniform_distribution_and_the_table_says_so() {
    let system = Lpv::new(
        m(&[&[0.0, -0.5], &[1.0, 1.0]]),
        vec![m(&[&[0.0, 0.0], &[0.0, 0.3]])],
        None,
        m(&[&[-2.0, 1.0]]),
    );
    let problem = Problem {
        system: AnySystem::Lpv(system.unwrap()),
        prior: Uncertain::from_box(&[1.0, -1.0], &[3.0, 5.0]).unwrap(),
        w: Uncertain::zonotope(vec![0.0; 2], m(&[&[0.3, 0.0, 0.6], &[0.0, 0.9, 0.0]])),
        v: Uncertain::gaussian(vec![0.0], m(&[&[0.01]])),
    };
    for settings in ALL {
        let ours = filter(settings, &problem);
        let sources = [("prior", "uniform"), ("w", "uniform"), ("v", "covariance")];
        assert_eq!(ours.readings(), sources);
        assert!(!ours.guaranteed());
    }
    let ours = filter(ALL[0], &problem);
    let prior = ours.prior();
    assert_eq!(prior.center(), [2.0, 2.0]);
    let p = prior.covariance().unwrap();
    assert_eq!((p[(0, 0)], p[(0, 1)], p[(1, 1)]), (1.0 / 3.0, 0.0, 3.0));
    // x⁺ = (A_0 + δ A_1) x + w about x̂ = (2, 2): A_0 P A_0ᵀ + (A_1 x̂)(A_1 x̂)ᵀ/3 + G Gᵀ/3.
    let predicted = ours.predict(1, &prior, &[]).unwrap();
    assert_eq!(predicted.center(), [-1.0, 4.0]);
    let q = predicted.covariance().unwrap();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-14;
    assert!(close(q[(0, 0)], 0.25 * 3.0 + (0.09 + 0.36) / 3.0), "{q:?}");
    assert!(
        close(q[(1, 1)], 1.0 / 3.0 + 3.0 + 0.36 / 3.0 + 0.81 / 3.0),
        "{q:?}"
    );
    let constrained = Problem {
        prior: Uncertain {
            constraints: Some((m(&[&[1.0, 1.0]]), vec![0.0])),
            ..Uncertain::zonotope(vec![0.0; 2], Matrix::identity(2))
        },
        ..problem
    };
    let settings = serde_json::from_str(r#"{"kind": "ukf"}"#).unwrap();
    let error = AnyEstimator::new(&settings, &constrained).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("ukf: `prior.covariance` must be given"),
        "{error}"
    );
}

#[test]
fn each_run_of_a_particle_filter_has_random_numbers_of_its_own() {
    let ours = filter(ALL[2], &linear());
    assert_eq!(ours.prior().center(), ours.prior_of_run(0).center());
    assert_ne!(ours.prior().center(), ours.prior_of_run(1).center());
    let other = filter(
        r#"{"kind": "particle", "particles": 4000, "seed": 1}"#,
        &linear(),
    );
    assert_ne!(ours.prior().center(), other.prior().center());
}

#[test]
fn settings_out_of_range_are_refused_by_key() {
    let refusal = |json: &str| {
        let settings = serde_json::from_str(json).unwrap();
        AnyEstimator::new(&settings, &linear())
            .unwrap_err()
            .to_string()
    };
    for (json, expected) in [
        (
            r#"{"kind": "ukf", "alpha": 0}"#,
            "ukf: `alpha` must be above 0, got 0",
        ),
        (
            r#"{"kind": "ukf", "beta": -1}"#,
            "ukf: `beta` must be at least 0, got -1",
        ),
        (
            r#"{"kind": "ukf", "kappa": -5}"#,
            "ukf: `kappa` must be above -5, got -5",
        ),
        (
            r#"{"kind": "particle", "particles": 1}"#,
            "particle: `particles` must be from 2 to 65536, got 1",
        ),
        (
            r#"{"kind": "particle", "resample_below": 1.5}"#,
            "particle: `resample_below` must be in [0, 1], got 1.5",
        ),
    ] {
        assert_eq!(refusal(json), expected);
    }
}
