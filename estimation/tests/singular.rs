//! Filters whose innovation has a singular covariance, or whose covariance leaves the numbers.

use zonobench_estimation::systems::Linear;
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimationError, Online, Problem, Uncertain,
};
use zonobench_sets::Matrix;

fn gaussian(mean: &[f64], covariance: Matrix) -> Uncertain {
    Uncertain {
        covariance: Some(covariance),
        mean: Some(mean.to_vec()),
        ..Uncertain::point(vec![0.0; mean.len()])
    }
}

fn linear(a: &[&[f64]], c: &[&[f64]]) -> AnySystem {
    let matrix = |rows| Matrix::from_rows(rows).unwrap();
    AnySystem::Linear(Linear::new(matrix(a), None, matrix(c), None).unwrap())
}

/// x_{k+1} = a x_k, y = x, nothing noisy, x_0 ~ N(0, p).
fn perfect_sensor(a: f64, p: f64) -> Problem {
    let zero = || gaussian(&[0.0], Matrix::zeros(1, 1));
    Problem {
        system: linear(&[&[a]], &[&[1.0]]),
        prior: gaussian(&[0.0], Matrix::diagonal(&[p])),
        w: zero(),
        v: zero(),
    }
}

fn filter(settings: &str, problem: &Problem) -> AnyEstimator {
    AnyEstimator::new(&serde_json::from_str(settings).unwrap(), problem).unwrap()
}

const KALMAN: &str = r#"{"kind": "kalman"}"#;
const MIXED: [&str; 3] = [
    r#"{"kind": "ezgkf", "phi": 9, "eta": 0.5, "alpha": 0.1}"#,
    r#"{"kind": "ezgkf-m", "phi": 9, "eta": 0.5, "alpha": 0.1}"#,
    r#"{"kind": "ezgkp", "phi": 9, "eta": 0.5, "alpha": 0.1}"#,
];

#[test]
fn a_perfect_sensor_of_a_constant_is_right_at_every_step() {
    for settings in [&[KALMAN][..], &MIXED].concat() {
        let mut online = Online::new(filter(settings, &perfect_sensor(1.0, 1.0)));
        for k in 0..6 {
            let belief = online.step(&[], &[Some(0.5)]).unwrap();
            // The predictor has read y_{k−1}, and ezgkf and ezgkf-m begin with y_1.
            if k > 1 || (k == 0 && settings == KALMAN) {
                assert_eq!(belief.center(), [0.5], "{settings} at {k}");
                assert_eq!(belief.covariance().unwrap(), &Matrix::zeros(1, 1));
            }
        }
    }
}

#[test]
fn a_measurement_that_a_known_state_rules_out_is_singular_and_not_believed() {
    for settings in [&[KALMAN][..], &MIXED].concat() {
        let mut online = Online::new(filter(settings, &perfect_sensor(1.0, 1.0)));
        for _ in 0..3 {
            online.step(&[], &[Some(0.5)]).unwrap();
        }
        // The predictor reads y_k when it predicts k + 1.
        let error = (0..2)
            .find_map(|_| online.step(&[], &[Some(0.75)]).err())
            .expect("0.75 after 0.5 of a constant");
        assert!(
            matches!(error, EstimationError::Singular { op: "gain", .. }),
            "{settings}: {error}"
        );
    }
}

#[test]
fn a_gap_under_an_unstable_system_ends_in_overflow_and_not_in_an_infinite_covariance() {
    for settings in [&[KALMAN][..], &MIXED].concat() {
        let mut online = Online::new(filter(settings, &perfect_sensor(1e10, 1.0)));
        let error = (0..60)
            .find_map(|_| match online.step(&[], &[None]) {
                Ok(belief) => {
                    assert!(belief.covariance().unwrap().is_finite());
                    assert!(belief.center()[0].is_finite());
                    None
                }
                Err(error) => Some(error),
            })
            .expect("10^20 to the power of 60 is no f64");
        assert!(
            matches!(error, EstimationError::Overflow { .. }),
            "{settings}: {error}"
        );
    }
}

#[test]
fn a_rotation_seen_without_noise_is_followed_for_a_thousand_steps() {
    let (c, s) = (0.6, 0.8);
    let problem = Problem {
        system: linear(
            &[&[c, -s], &[s, c]],
            &[&[1.0, 0.0], &[1.0, 1.0], &[0.0, 2.0]],
        ),
        prior: gaussian(&[0.0; 2], Matrix::identity(2)),
        w: gaussian(&[0.0; 2], Matrix::zeros(2, 2)),
        v: gaussian(&[0.0; 3], Matrix::zeros(3, 3)),
    };
    let mut x = [1.0, 0.25];
    let mut online = Online::new(filter(KALMAN, &problem));
    for k in 0..1000 {
        let y = [Some(x[0]), Some(x[0] + x[1]), Some(2.0 * x[1])];
        let belief = online.step(&[], &y).unwrap();
        for (a, b) in belief.center().iter().zip(&x) {
            // The measurements alone say x to their rounding.
            assert!((a - b).abs() < 1e-12, "{k}: {a} {b}");
        }
        x = [c * x[0] - s * x[1], s * x[0] + c * x[1]];
    }
}
