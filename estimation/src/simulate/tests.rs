use super::*;
use crate::AnySystem;
use crate::Problem;
use crate::problem::Uncertain;
use crate::signal::{Oscillation, Signal};
use crate::systems::{Linear, Lpv, VanDerPol};
use zonobench_sets::Matrix;

fn matrix<const N: usize>(rows: &[[f64; N]]) -> Matrix {
    Matrix::from_rows(rows).unwrap()
}

fn tracked_point() -> AnySystem {
    AnySystem::Linear(
        Linear::new(
            matrix(&[[0.9, 1.0], [0.0, 0.8]]),
            None,
            matrix(&[[-22.0, 1.0]]),
            None,
        )
        .unwrap(),
    )
}

fn lpv() -> AnySystem {
    let (a0, a1) = (
        matrix(&[[0.0, -0.5], [1.0, 1.0]]),
        matrix(&[[0.0, 0.0], [0.0, 0.3]]),
    );
    AnySystem::Lpv(Lpv::new(a0, vec![a1], None, matrix(&[[-2.0, 1.0]])).unwrap())
}

fn unit_box(n: usize) -> Uncertain {
    Uncertain::from_box(&vec![-1.0; n], &vec![1.0; n]).unwrap()
}

fn drawn(law: Law, of: Uncertain) -> Noise {
    Noise::Drawn(Drawn {
        law,
        of,
        truncate: false,
    })
}

fn truth(w: Noise, v: Noise) -> Truth {
    Truth {
        x0: InitialState::Point(vec![5.0, 5.0]),
        w,
        v,
        delta: None,
    }
}

fn no_inputs() -> Inputs {
    Inputs::Constant(Vec::new())
}

fn message(truth: &Truth, system: &AnySystem) -> String {
    truth.validate(system, 10).unwrap_err().to_string()
}

#[test]
fn a_trajectory_follows_its_equations() {
    let t = truth(
        drawn(Law::Uniform, unit_box(2)),
        drawn(Law::Uniform, unit_box(1)),
    );
    let run = simulate(&tracked_point(), &t, &no_inputs(), 1, 0, 50).unwrap();
    assert_eq!(
        (
            run.x.len(),
            run.y.len(),
            run.u.len(),
            run.w.len(),
            run.v.len()
        ),
        (51, 51, 51, 50, 51)
    );
    assert_eq!(run.x[0], [5.0, 5.0]);
    for k in 0..50 {
        assert_eq!(
            run.x[k + 1][0],
            run.x[k][0] * 0.9 + run.x[k][1] * 1.0 + run.w[k][0]
        );
        assert_eq!(run.x[k + 1][1], run.x[k][1] * 0.8 + run.w[k][1]);
        assert_eq!(
            run.y[k][0],
            run.x[k][0] * -22.0 + run.x[k][1] * 1.0 + run.v[k][0]
        );
    }
    assert!(run.rounding.iter().flatten().all(|&r| r < 1e-13) && run.rounding[50][0] > 0.0);
}

#[test]
fn a_run_depends_on_its_number_and_seed_alone() {
    let t = truth(
        drawn(Law::Uniform, unit_box(2)),
        drawn(Law::Vertices, unit_box(1)),
    );
    let run = |seed, run| simulate(&tracked_point(), &t, &no_inputs(), seed, run, 30).unwrap();
    let third = run(7, 3);
    run(7, 2);
    assert_eq!(run(7, 3), third);
    assert_ne!(run(7, 4).w, third.w);
    assert_ne!(run(8, 3).w, third.w);
    let longer = simulate(&tracked_point(), &t, &no_inputs(), 7, 3, 60).unwrap();
    assert_eq!(longer.x[..31], third.x[..]);
}

#[test]
fn vertices_are_on_the_faces_but_for_the_margin() {
    let t = truth(
        drawn(Law::Vertices, unit_box(2)),
        drawn(Law::Zero, unit_box(1)),
    );
    let run = simulate(&tracked_point(), &t, &no_inputs(), 1, 0, 200).unwrap();
    assert!(run.w.iter().flatten().all(|w| w.abs() == INSIDE));
    let up = run.w.iter().flatten().filter(|&&w| w > 0.0).count();
    assert!((150..250).contains(&up), "{up} of 400");
    assert!(run.v.iter().flatten().all(|&v| v == 0.0));
}

#[test]
fn a_truncated_gaussian_stays_in_its_box_and_keeps_its_shape() {
    let of = Uncertain {
        mean: Some(vec![0.0; 2]),
        covariance: Some(matrix(&[[0.12, 0.0], [0.0, 0.12]])),
        ..unit_box(2)
    };
    let noise = Noise::Drawn(Drawn {
        law: Law::Gaussian,
        of: of.clone(),
        truncate: true,
    });
    let run = simulate(
        &tracked_point(),
        &truth(noise, drawn(Law::Zero, unit_box(1))),
        &no_inputs(),
        1,
        0,
        20_000,
    )
    .unwrap();
    let all: Vec<f64> = run.w.iter().flatten().copied().collect();
    assert!(all.iter().all(|w| w.abs() <= INSIDE));
    let free = simulate(
        &tracked_point(),
        &truth(drawn(Law::Gaussian, of), drawn(Law::Zero, unit_box(1))),
        &no_inputs(),
        1,
        0,
        20_000,
    )
    .unwrap();
    let outside = free.w.iter().flatten().filter(|w| w.abs() > 1.0).count() as f64 / 40_000.0;
    // P(|N(0, 0.12)| > 1) = 0.0038924; four standard errors.
    assert!(
        (outside - 0.003_892_4).abs() < 4.0 * (0.0039_f64 / 40_000.0).sqrt(),
        "{outside}"
    );
    // Draws that were inside at once are the same.
    let changed = all
        .iter()
        .zip(free.w.iter().flatten())
        .filter(|(a, b)| a != b)
        .count();
    assert_eq!(
        changed,
        free.w.iter().flatten().filter(|w| w.abs() > 1.0).count()
    );
    let variance = all.iter().map(|w| w * w).sum::<f64>() / all.len() as f64;
    assert!((0.110..0.122).contains(&variance), "{variance}");
}

#[test]
fn a_box_out_of_reach_is_an_error_and_not_a_loop() {
    let far = Uncertain {
        covariance: Some(matrix(&[[1e-6]])),
        mean: Some(vec![9.0]),
        ..unit_box(1)
    };
    let noise = Noise::Drawn(Drawn {
        law: Law::Gaussian,
        of: far,
        truncate: true,
    });
    let error = simulate(
        &tracked_point(),
        &truth(drawn(Law::Zero, unit_box(2)), noise),
        &no_inputs(),
        1,
        0,
        5,
    );
    assert_eq!(
        error.unwrap_err().to_string(),
        "truth.v, step 0: none of 65536 draws fell into the box"
    );
}

#[test]
fn mixed_noise_has_the_moments_of_the_sum() {
    // W = {L/2, 0}, Q = L Lᵀ/36 with L = 0.02 [[-6, 0], [1, 0]], a covariance of rank 1.
    let q = matrix(&[
        [0.0144 / 36.0, -0.0024 / 36.0],
        [-0.0024 / 36.0, 0.0004 / 36.0],
    ]);
    let of = Uncertain {
        covariance: Some(q),
        ..Uncertain::zonotope(vec![0.0; 2], matrix(&[[-0.06, 0.0], [0.01, 0.0]]))
    };
    let t = Truth {
        delta: Some(DeltaLaw::Zero),
        ..truth(drawn(Law::Mixed, of), drawn(Law::Zero, unit_box(1)))
    };
    let run = simulate(&lpv(), &t, &no_inputs(), 3, 0, 20_000).unwrap();
    let square = run.w.iter().map(|w| w[0] * w[0]).sum::<f64>() / 20_000.0;
    // Var = 0.06²/3 + 0.0144/36 = 0.0016.
    assert!((square / 0.0016 - 1.0).abs() < 0.04, "{square}");
    // Both parts lie along (−6, 1).
    assert!(
        run.w
            .iter()
            .all(|w| (w[0] + 6.0 * w[1]).abs() < 1e-15 && w[2] == 0.0)
    );
}

#[test]
fn delta_follows_its_law_after_the_process_noise() {
    let with = |delta| {
        let of = Uncertain::zonotope(vec![0.0; 2], Matrix::zeros(2, 1));
        let t = Truth {
            delta: Some(delta),
            ..truth(drawn(Law::Uniform, of), drawn(Law::Zero, unit_box(1)))
        };
        let run = simulate(&lpv(), &t, &no_inputs(), 3, 1, 40).unwrap();
        run.w.iter().map(|w| w[2]).collect::<Vec<f64>>()
    };
    let uniform = with(DeltaLaw::Uniform);
    assert!(uniform.iter().all(|d| d.abs() < 1.0) && uniform[0] != uniform[1]);
    assert!(with(DeltaLaw::Sign).iter().all(|d| d.abs() == INSIDE));
    assert!(
        with(DeltaLaw::Constant { value: -0.5 })
            .iter()
            .all(|&d| d == -0.5 * INSIDE)
    );
    let wave = Oscillation {
        period: Some(8.0),
        omega: None,
        dt: None,
        amplitude: 1.0,
        offset: 0.0,
        phase: 0.0,
    };
    assert_eq!(with(DeltaLaw::Sine(wave))[2], INSIDE);
    let signals = vec![vec![Signal::Constant { value: -1.0 }]];
    assert!(
        with(DeltaLaw::Signals { terms: signals })
            .iter()
            .all(|&d| d == -INSIDE)
    );
}

#[test]
fn signals_are_drawn_towards_the_center_of_the_assumed_set() {
    let square = || {
        vec![Signal::Square(crate::signal::Wave {
            period: 4.0,
            amplitude: 1.0,
            offset: 0.0,
            phase: 0.0,
        })]
    };
    let w = Noise::Signals {
        terms: vec![square(), vec![]],
        about: Some(vec![0.0, 0.0]),
    };
    let run = simulate(
        &tracked_point(),
        &truth(w, drawn(Law::Zero, unit_box(1))),
        &no_inputs(),
        1,
        0,
        4,
    )
    .unwrap();
    let first: Vec<f64> = run.w.iter().map(|w| w[0]).collect();
    assert_eq!(first, [INSIDE, INSIDE, -INSIDE, -INSIDE]);
    assert!(run.w.iter().all(|w| w[1] == 0.0));
}

#[test]
fn alternatives_count_with_the_last_component_of_v_fastest() {
    let constant = |value| vec![Signal::Constant { value }];
    let family = |n| Noise::Alternatives {
        alternatives: (0..n)
            .map(|_| vec![constant(0.25), constant(0.5)])
            .collect(),
        about: None,
    };
    let t = truth(family(2), family(1));
    assert_eq!(t.distinct_runs(), Some(8));
    let run = |r| {
        let run = simulate(&tracked_point(), &t, &no_inputs(), 1, r, 1).unwrap();
        [run.w[0][0], run.w[0][1], run.v[0][0]]
    };
    assert_eq!(run(0), [0.25, 0.25, 0.25]);
    assert_eq!(run(1), [0.25, 0.25, 0.5]);
    assert_eq!(run(6), [0.5, 0.5, 0.25]);
    assert_eq!(run(8), run(0));
}

#[test]
fn the_first_state_is_drawn_in_the_prior() {
    let box_prior = InitialState::Drawn(Uncertain::from_box(&[-10.0, 2.0], &[10.0, 4.0]).unwrap());
    let gaussian = InitialState::Drawn(Uncertain::gaussian(
        vec![1.0, 2.0],
        matrix(&[[4.0, 0.0], [0.0, 0.0]]),
    ));
    let start = |x0: &InitialState, run| {
        let noise = |n| drawn(Law::Zero, unit_box(n));
        let t = Truth {
            x0: x0.clone(),
            ..truth(noise(2), noise(1))
        };
        simulate(&tracked_point(), &t, &no_inputs(), 1, run, 0)
            .unwrap()
            .x[0]
            .clone()
    };
    let states: Vec<Vec<f64>> = (0..2000).map(|r| start(&box_prior, r)).collect();
    assert!(
        states
            .iter()
            .all(|x| x[0].abs() <= 10.0 && (2.0..=4.0).contains(&x[1]))
    );
    let mean = states.iter().map(|x| x[1]).sum::<f64>() / 2000.0;
    assert!((mean - 3.0).abs() < 0.07, "{mean}");
    let states: Vec<Vec<f64>> = (0..2000).map(|r| start(&gaussian, r)).collect();
    assert!(states.iter().all(|x| x[1] == 2.0));
    let variance = states
        .iter()
        .map(|x| (x[0] - 1.0) * (x[0] - 1.0))
        .sum::<f64>()
        / 2000.0;
    assert!((variance - 4.0).abs() < 0.6, "{variance}");
}

#[test]
fn without_a_truth_the_assumed_sets_are_drawn_from_unless_a_covariance_stands_there() {
    let problem = |w: Uncertain| Problem {
        system: tracked_point(),
        prior: unit_box(2),
        w,
        v: unit_box(1),
    };
    assert_eq!(
        Truth::assumed(&problem(unit_box(2))).unwrap().w,
        drawn(Law::Uniform, unit_box(2))
    );
    let gaussian = Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2));
    assert_eq!(
        Truth::assumed(&problem(gaussian)).unwrap_err().to_string(),
        "truth.w: expected it to be given: only a covariance is assumed, got nothing"
    );
    let both = Uncertain {
        covariance: Some(Matrix::identity(2)),
        ..unit_box(2)
    };
    assert_eq!(
        Truth::assumed(&problem(both)).unwrap_err().to_string(),
        "truth.w: expected it to be given: a set and a covariance are assumed, and the truth can follow either, got nothing"
    );
}

#[test]
fn a_truth_that_does_not_fit_is_refused() {
    let zero = |n| drawn(Law::Zero, unit_box(n));
    let point = || tracked_point();
    let short = Truth {
        x0: InitialState::Point(vec![1.0]),
        ..truth(zero(2), zero(1))
    };
    assert_eq!(
        message(&short, &point()),
        "truth.x0: expected 2 numbers, got 1"
    );
    let no_set = truth(
        drawn(
            Law::Uniform,
            Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2)),
        ),
        zero(1),
    );
    assert_eq!(
        message(&no_set, &point()),
        "truth.w: expected a box or generators for this law, got none"
    );
    let no_covariance = truth(drawn(Law::Mixed, unit_box(2)), zero(1));
    assert_eq!(
        message(&no_covariance, &point()),
        "truth.w: expected a covariance for this law, got none"
    );
    let data = truth(Noise::Data(vec![vec![0.0; 2]; 3]), zero(1));
    assert_eq!(
        message(&data, &point()),
        "truth.w: expected data for 10 steps, got 3"
    );
    let delta = Truth {
        delta: Some(DeltaLaw::Uniform),
        ..truth(zero(2), zero(1))
    };
    assert_eq!(
        message(&delta, &point()),
        "truth.delta: expected no delta: the system has none, got a law"
    );
    assert_eq!(
        message(&truth(zero(2), zero(1)), &lpv()),
        "truth.delta: expected a law, got none"
    );
    let large = Truth {
        delta: Some(DeltaLaw::Constant { value: 2.0 }),
        ..truth(zero(2), zero(1))
    };
    assert_eq!(
        message(&large, &lpv()),
        "truth.delta: expected a value in [-1, 1], got 2"
    );
    let signal = Noise::Signals {
        terms: vec![vec![], vec![Signal::Constant { value: f64::NAN }]],
        about: None,
    };
    assert_eq!(
        message(&truth(signal, zero(1)), &point()),
        "truth.w, component 2: value: expected a finite number, got NaN"
    );
}

#[test]
fn a_state_that_overflows_is_an_error_with_its_step() {
    let system = AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap());
    let zero = |n| drawn(Law::Zero, unit_box(n));
    let t = Truth {
        x0: InitialState::Point(vec![1e3, 1e3]),
        ..truth(zero(2), zero(1))
    };
    let error = simulate(&system, &t, &no_inputs(), 1, 4, 100).unwrap_err();
    assert!(
        matches!(error, SimulationError::Diverged { run: 4, k: 1..20 }),
        "{error}"
    );
}
