//! Problems with numbers at the ends of the f64: no estimator panics, and none that is guaranteed loses a truth that is
//! known exactly.

mod draws;

use draws::Draws;
use num_rational::BigRational;
use zonobench_estimation::systems::{
    Form, Linear, Quadrotor, QuotientForm, Raimondo, Unicycle, VanDerPol, VehicleSe2,
};
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimationError, Problem, System, Uncertain, track,
};
use zonobench_sets::interval_matrix::jacobian_over;
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{Containment, Interval, IntervalVector, Matrix};

fn boxed(lower: &[f64], upper: &[f64]) -> Uncertain {
    Uncertain::from_box(lower, upper).unwrap()
}

fn linear(a: Matrix, c: Matrix, prior: Uncertain, w: f64, v: f64) -> Problem {
    let (n, m) = (a.rows(), c.rows());
    Problem {
        system: AnySystem::Linear(Linear::new(a, None, c, None).unwrap()),
        prior,
        w: boxed(&vec![-w; n], &vec![w; n]),
        v: boxed(&vec![-v; m], &vec![v; m]),
    }
}

fn estimator(json: &str, problem: &Problem) -> Result<AnyEstimator, EstimationError> {
    AnyEstimator::new(&serde_json::from_str(json).unwrap(), problem)
}

const BOX: &str = r#"{"kind": "box-state-est"}"#;

#[test]
fn a_state_halved_to_just_below_the_smallest_normal_number_is_not_lost() {
    let start = f64::from_bits(0x001F_FFFF_FFFF_FFFF);
    let one = |x: f64| Matrix::diagonal(&[x]);
    let problem = linear(one(0.5), one(1.0), boxed(&[start], &[start]), 0.0, 1.0);
    let exact = |x: f64| BigRational::from_float(x).unwrap();
    let mut x = exact(start);
    let filter = estimator(BOX, &problem).unwrap();
    for step in track(&filter, 1, &[], &[vec![Some(0.0)], vec![Some(0.0)]]) {
        let hull = step.updated.unwrap().interval_hull().unwrap();
        assert!(
            exact(hull[0].lo()) <= x && x <= exact(hull[0].hi()),
            "{hull:?}"
        );
        x *= exact(0.5);
    }
}

#[test]
fn a_pair_whose_observability_matrix_has_no_singular_values_is_refused_and_ends_no_process() {
    let m = |rows: &[&[f64]]| Matrix::from_rows(rows).unwrap();
    let a = m(&[
        &[0.01, 0.0, 0.0, 0.0],
        &[1e-30, 0.0, 0.0, 0.0],
        &[0.0, 1e-47, 0.0, 0.0],
        &[0.0, 0.0, 0.0, 1e53],
    ]);
    let c = m(&[
        &[1e30, 0.0, 0.0, 0.0],
        &[0.0, 1e5, 0.0, 1e50],
        &[0.0, 1e19, 0.0, 0.0],
    ]);
    let unit = boxed(&[-1.0; 4], &[1.0; 4]);
    // x3 is not measured and moves nothing that is.
    let error = estimator(BOX, &linear(a, c, unit, 0.1, 0.1)).unwrap_err();
    assert!(
        matches!(error, EstimationError::Unobservable { rank: 3, n: 4, .. }),
        "{error}"
    );
}

/// Zero, or a power of ten of any size.
fn sparse(draws: &mut Draws, rows: usize, cols: usize, reach: f64) -> Matrix {
    Matrix::from_fn(rows, cols, |_, _| {
        if draws.chance(0.6) {
            0.0
        } else {
            draws.signed().signum() * libm::pow(10.0, (reach * draws.signed()).trunc())
        }
    })
}

#[test]
fn sparse_pairs_of_any_size_end_in_boxes_that_hold_the_truth_or_in_an_error() {
    let mut draws = Draws::new(77);
    let (mut made, mut refused) = (0, 0);
    for trial in 0..20_000 {
        let (n, m) = (1 + draws.below(4), 1 + draws.below(3));
        let reach = [3.0, 60.0, 150.0][trial % 3];
        let (a, c) = (
            sparse(&mut draws, n, n, reach),
            sparse(&mut draws, m, n, reach),
        );
        let problem = linear(a, c, boxed(&vec![-1.0; n], &vec![1.0; n]), 0.0, 1e-3);
        let Ok(filter) = estimator(BOX, &problem) else {
            refused += 1;
            continue;
        };
        made += 1;
        // x = 0 and y = 0 for good.
        let y = vec![vec![Some(0.0); m]; n + 2];
        for step in track(&filter, n + 1, &[], &y) {
            match step.updated {
                Ok(belief) => {
                    let zero = vec![Interval::ZERO; n];
                    assert_eq!(belief.contains(&zero), Containment::Inside, "{problem:?}");
                }
                Err(error) => {
                    assert!(
                        !matches!(error, EstimationError::Inconsistent { .. }),
                        "{problem:?}"
                    );
                    break;
                }
            }
        }
    }
    assert!(made > 2000 && refused > 2000, "{made} {refused}");
}

const FILTERS: [&str; 16] = [
    r#"{"kind": "kalman"}"#,
    r#"{"kind": "ekf"}"#,
    r#"{"kind": "ukf"}"#,
    r#"{"kind": "particle", "particles": 20}"#,
    BOX,
    r#"{"kind": "ezgkf", "phi": 9, "eta": 0.5, "alpha": 0.1}"#,
    r#"{"kind": "ezgkf", "phi": 9, "eta": 1.0, "alpha": 0.1, "merge_parallel": true}"#,
    r#"{"kind": "ezgkf-m", "phi": 9, "eta": 0.0, "alpha": 0.1}"#,
    r#"{"kind": "ezgkp", "phi": 9, "eta": 0.5, "alpha": 0.1}"#,
    r#"{"kind": "zmv", "generators": 8}"#,
    r#"{"kind": "czmv", "generators": 8, "constraints": 2}"#,
    r#"{"kind": "czfo", "generators": 8, "constraints": 2, "h": "c3"}"#,
    r#"{"kind": "rrsr"}"#,
    r#"{"kind": "d-cz"}"#,
    r#"{"kind": "comb"}"#,
    r#"{"kind": "lift"}"#,
];

#[test]
fn no_filter_panics_on_numbers_of_any_size() {
    let mut draws = Draws::new(78);
    let mut steps = 0;
    for trial in 0..300 {
        let (n, m) = (1 + draws.below(2), 1 + draws.below(2));
        let reach = [3.0, 60.0, 150.0, 300.0][trial % 4];
        let size = |draws: &mut Draws| libm::pow(10.0, reach * draws.signed());
        let (a, c) = (
            sparse(&mut draws, n, n, reach),
            sparse(&mut draws, m, n, reach),
        );
        let (prior, w, v) = (size(&mut draws), size(&mut draws), size(&mut draws));
        let mut problem = linear(a, c, boxed(&vec![-prior; n], &vec![prior; n]), w, v);
        for (part, r) in [
            (&mut problem.prior, prior),
            (&mut problem.w, w),
            (&mut problem.v, v),
        ] {
            let n = part.center.len();
            let variance = if r * r < f64::INFINITY {
                r * r
            } else {
                f64::MAX
            };
            part.covariance = Some(Matrix::identity(n).scale(variance));
        }
        let y: Vec<Vec<Option<f64>>> = (0..6)
            .map(|_| {
                (0..m)
                    .map(|_| draws.chance(0.8).then(|| v * draws.signed()))
                    .collect()
            })
            .collect();
        for settings in FILTERS {
            let Ok(filter) = estimator(settings, &problem) else {
                continue;
            };
            for step in track(&filter, 5, &[], &y) {
                steps += 1;
                for belief in step.predicted.iter().chain(step.updated.as_ref().ok()) {
                    let numbers = [belief.center(), belief.shape().center].concat();
                    assert!(
                        numbers.iter().all(|x| x.is_finite()),
                        "{settings} {problem:?}"
                    );
                    if let Some(p) = belief.covariance() {
                        assert!(p.is_finite(), "{settings} {problem:?}");
                    }
                    let _ = belief.contains(&vec![Interval::ZERO; n]);
                    let _ = belief.contains(&vec![Interval::point(prior); n]);
                }
            }
        }
    }
    assert!(steps > 3000, "{steps}");
}

/// (x, v) ↦ h(k, x, u, v).
struct Output<'a> {
    system: &'a AnySystem,
    k: usize,
    u: &'a [f64],
    n: usize,
    n_v: usize,
    n_y: usize,
}

impl Function for Output<'_> {
    fn inputs(&self) -> usize {
        self.n + self.n_v
    }
    fn outputs(&self) -> usize {
        self.n_y
    }
    fn evaluate<S: Real>(&self, z: &[S], y: &mut [S]) {
        self.system.h(self.k, &z[..self.n], self.u, &z[self.n..], y);
    }
}

#[test]
fn the_derivatives_of_a_linear_measurement_are_the_same_at_every_step_and_input() {
    let landmarks = vec![[5.0, 15.0], [15.0, 15.0]];
    let m = |rows: &[&[f64]]| Matrix::from_rows(rows).unwrap();
    let systems = [
        AnySystem::Linear(
            Linear::new(
                m(&[&[0.9, 0.4], &[-0.3, 0.8]]),
                Some(m(&[&[1.0], &[0.5]])),
                m(&[&[1.0, 0.0], &[0.5, 1.0]]),
                Some(m(&[&[0.0], &[0.25]])),
            )
            .unwrap(),
        ),
        AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap()),
        AnySystem::Raimondo(Raimondo {
            form: QuotientForm::Expanded,
            ..Raimondo::default()
        }),
        AnySystem::VehicleSe2(VehicleSe2::new(0.01, Form::Group).unwrap()),
        AnySystem::Quadrotor(Quadrotor::new(0.7, 0.3, [1.2, 1.3, 1.7], 9.81, 0.01).unwrap()),
        AnySystem::Unicycle(Unicycle::new(1.0, 0.3, 0.15, landmarks).unwrap()),
    ];
    for system in systems {
        let variables = system.variables();
        let (n, n_v, n_y) = (variables.x.len(), variables.v.len(), variables.y.len());
        let over = IntervalVector::new(vec![Interval::UNIT; n + n_v]);
        let at = |k: usize, u: f64| {
            let u = vec![u; variables.u.len()];
            let output = Output {
                system: &system,
                k,
                u: &u,
                n,
                n_v,
                n_y,
            };
            jacobian_over(&output, &over).map(|(_, j)| j.as_slice().to_vec())
        };
        let Ok(first) = at(0, 0.0) else { continue };
        if first.iter().any(|e| !e.is_point()) {
            continue;
        }
        for (k, u) in [(1, 0.0), (7, 3.5), (1000, -1e6)] {
            assert_eq!(at(k, u).unwrap(), first, "{} at {k}, {u}", system.kind());
        }
    }
}
