//! What the mixed filters promise: their covariance bounds, their gain is optimal, their confidence
//! boxes hold, and without uncertainty they are the filters that they extend.

mod draws;

use draws::Draws;
use zonobench_estimation::estimators::{
    EzgkfSettings, EzgkpSettings, Form, Gain, KalmanSettings, MixedBelief, covariance_bound,
};
use zonobench_estimation::systems::{Linear, Lpv, VanDerPol};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, Estimator, EstimatorSettings, Problem, System,
    Uncertain, track,
};
use zonobench_sets::Matrix;

fn settings(phi: usize, eta: f64, alpha: f64) -> EzgkfSettings {
    EzgkfSettings {
        phi,
        eta,
        alpha,
        gain: Gain::Optimal,
        overbars: true,
        merge_parallel: false,
        scale: Default::default(),
    }
}

fn both(center: Vec<f64>, g: Matrix, p: Matrix) -> Uncertain {
    Uncertain {
        covariance: Some(p),
        ..Uncertain::zonotope(center, g)
    }
}

fn m<const N: usize>(rows: &[[f64; N]]) -> Matrix {
    Matrix::from_rows(rows).unwrap()
}

/// The paper's LPV example.
fn lpv() -> Problem {
    let system = Lpv::new(
        m(&[[0.0, -0.5], [1.0, 1.0]]),
        vec![m(&[[0.0, 0.0], [0.0, 0.3]])],
        None,
        m(&[[-2.0, 1.0]]),
    );
    let l = m(&[[-0.12, 0.0], [0.02, 0.0]]);
    Problem {
        system: AnySystem::Lpv(system.unwrap()),
        prior: both(
            vec![0.0; 2],
            Matrix::identity(2).scale(0.1),
            Matrix::identity(2).scale(0.04 / 47.316),
        ),
        w: both(vec![0.0; 2], l.scale(0.5), l.gram().scale(1.0 / 36.0)),
        v: both(vec![0.0], m(&[[0.1]]), m(&[[0.01 / 9.0]])),
    }
}

/// A random linear problem with both kinds of noise.
fn linear(draws: &mut Draws, n: usize, ny: usize) -> Problem {
    let system = Linear::new(
        draws.matrix(n, n).scale(0.7),
        Some(draws.matrix(n, 1)),
        draws.matrix(ny, n),
        Some(draws.matrix(ny, 1)),
    );
    let mut part = |dim: usize| {
        both(
            vec![0.0; dim],
            draws.matrix(dim, dim + 1),
            draws.covariance(dim),
        )
    };
    Problem {
        prior: part(n),
        w: part(n),
        v: part(ny),
        system: AnySystem::Linear(system.unwrap()),
    }
}

fn smallest_eigenvalue(m: &Matrix) -> f64 {
    m.symmetric_eigen()
        .0
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn with_overbars_the_covariance_bounds_every_delta_and_without_it_does_not() {
    let mut draws = Draws::new(11);
    let (mut with, mut without) = (0, 0);
    for _ in 0..1000 {
        let (n, d) = (2 + draws.below(3), 1 + draws.below(3));
        let a0 = draws.matrix(n, n);
        let a: Vec<Matrix> = (0..d).map(|_| draws.matrix(n, n)).collect();
        let (p, q) = (draws.covariance(n), draws.covariance(n));
        let at_delta = a
            .iter()
            .fold(a0.clone(), |sum, a| sum.add(&a.scale(draws.signed())));
        let exact = at_delta.mul(&p).mul_transpose(&at_delta).add(&q);
        for (overbars, violations) in [(true, &mut with), (false, &mut without)] {
            let bound = covariance_bound(&a0, &a, &p, &q, overbars);
            // Sums of some n² d² products of entries below 10.
            *violations += usize::from(smallest_eigenvalue(&bound.sub(&exact)) < -1e-12);
        }
    }
    assert_eq!(with, 0);
    assert!(without > 500, "{without} of 1000");
}

#[test]
fn without_overbars_the_covariance_is_the_one_at_delta_one() {
    let mut draws = Draws::new(12);
    let (a0, a) = (draws.matrix(3, 3), [draws.matrix(3, 3), draws.matrix(3, 3)]);
    let (p, q) = (draws.covariance(3), draws.covariance(3));
    let sum = a0.add(&a[0]).add(&a[1]);
    let expected = sum.mul(&p).mul_transpose(&sum).add(&q);
    let got = covariance_bound(&a0, &a, &p, &q, false);
    assert!(
        got.sub(&expected)
            .as_slice()
            .iter()
            .all(|x| x.abs() < 1e-13)
    );
}

/// J(K) = (1 − η) tr(G₊ G₊ᵀ) + η tr(P₊) for the gain `k`.
fn cost(problem: &Problem, predicted: &MixedBelief, k: &Matrix, eta: f64) -> f64 {
    let c = problem.system.quasi_lpv().unwrap().output_matrix();
    let (g, p) = (predicted.state.g(), predicted.state.p());
    let t = Matrix::identity(g.rows()).sub(&k.mul(&c));
    let g = Matrix::hcat(&[&t.mul(g), &k.mul(&problem.v.generator_matrix())]).gram();
    let p = t
        .mul(p)
        .mul_transpose(&t)
        .add(&k.mul(&problem.v.covariance_matrix()).mul_transpose(k));
    let trace = |m: &Matrix| (0..m.rows()).map(|i| m[(i, i)]).sum::<f64>();
    (1.0 - eta) * trace(&g) + eta * trace(&p)
}

/// The gain that the filter used: it moves the center by K times a measurement that is a unit vector.
fn gain_of(filter: &AnyEstimator, predicted: &AnyBelief, ny: usize) -> Matrix {
    let center = |y: Vec<Option<f64>>| filter.update(1, predicted, &[0.0], &y).unwrap().center();
    let zero = center(vec![Some(0.0); ny]);
    let columns: Vec<Matrix> = (0..ny)
        .map(|l| {
            let unit = center((0..ny).map(|i| Some(f64::from(u8::from(i == l)))).collect());
            Matrix::column(
                &unit
                    .iter()
                    .zip(&zero)
                    .map(|(u, z)| u - z)
                    .collect::<Vec<_>>(),
            )
        })
        .collect();
    Matrix::hcat(&columns.iter().collect::<Vec<_>>())
}

#[test]
fn a_gain_off_by_d_costs_the_trace_of_d_s_d_transposed_more() {
    let mut draws = Draws::new(13);
    for _ in 0..40 {
        let (n, ny, eta) = (1 + draws.below(3), 1 + draws.below(2), draws.unit());
        let problem = linear(&mut draws, n, ny);
        let settings = EstimatorSettings::Ezgkf(settings(50, eta, 0.01));
        let filter = AnyEstimator::new(&settings, &problem).unwrap();
        let predicted = filter.predict(1, &filter.prior(), &[0.0]).unwrap();
        let k = gain_of(&filter, &predicted, ny);
        let AnyBelief::MixedBelief(predicted) = predicted else {
            panic!("a mixed belief")
        };
        // S, from the definitions. [dePaula, Eqs. (30)-(32)]
        let c = problem.system.quasi_lpv().unwrap().output_matrix();
        let (g, p) = (predicted.state.g(), predicted.state.p());
        let pzg = g.gram().scale(1.0 - eta).add(&p.scale(eta));
        let (gv, r) = (problem.v.generator_matrix(), problem.v.covariance_matrix());
        let s = c
            .mul(&pzg)
            .mul_transpose(&c)
            .add(&gv.gram().scale(1.0 - eta))
            .add(&r.scale(eta));
        let best = cost(&problem, &predicted, &k, eta);
        for size in [1e-3, 0.1, 1.0] {
            let d = draws.matrix(n, ny).scale(size);
            let difference = cost(&problem, &predicted, &k.add(&d), eta) - best;
            let dsd = d.mul(&s).mul_transpose(&d);
            let expected: f64 = (0..n).map(|i| dsd[(i, i)]).sum();
            // The gain itself is known to rounding only, which enters linearly with D.
            let slack = 1e-11 * (1.0 + best) * (1.0 + size);
            assert!(
                (difference - expected).abs() < slack,
                "{difference} and {expected}"
            );
        }
    }
}

#[test]
fn the_unsquared_gain_costs_more() {
    let problem = lpv();
    let optimal = settings(200, 0.5, 0.0027);
    let unsquared = EzgkfSettings {
        gain: Gain::Unsquared,
        ..optimal.clone()
    };
    let [best, worse] = [optimal, unsquared].map(|s| {
        let filter = AnyEstimator::new(&EstimatorSettings::Ezgkf(s), &problem).unwrap();
        let predicted = filter.predict(1, &filter.prior(), &[]).unwrap();
        let center = |y: f64| {
            filter
                .update(1, &predicted, &[], &[Some(y)])
                .unwrap()
                .center()
        };
        let (one, zero) = (center(1.0), center(0.0));
        let k = Matrix::column(&[one[0] - zero[0], one[1] - zero[1]]);
        let AnyBelief::MixedBelief(predicted) = predicted else {
            panic!("a mixed belief")
        };
        cost(&problem, &predicted, &k, 0.5)
    });
    assert!(worse > best * 1.01, "{worse} and {best}");
}

#[test]
fn with_eta_one_and_no_delta_the_filter_is_the_kalman_filter() {
    let mut draws = Draws::new(14);
    for _ in 0..20 {
        let (n, ny) = (1 + draws.below(3), 1 + draws.below(2));
        let problem = linear(&mut draws, n, ny);
        let filter =
            AnyEstimator::new(&EstimatorSettings::Ezgkf(settings(60, 1.0, 0.01)), &problem);
        let kalman = AnyEstimator::new(&EstimatorSettings::Kalman(KalmanSettings {}), &problem);
        let (filter, kalman) = (filter.unwrap(), kalman.unwrap());
        let (mut mixed, mut gaussian) = (filter.prior(), kalman.prior());
        for k in 1..20 {
            let u = [draws.signed()];
            let y: Vec<Option<f64>> = (0..ny)
                .map(|_| (!draws.chance(0.2)).then(|| draws.signed()))
                .collect();
            mixed = filter
                .predict(k, &filter.reduce_order(k - 1, mixed).unwrap(), &u)
                .unwrap();
            mixed = filter.update(k, &mixed, &u, &y).unwrap();
            gaussian = kalman
                .update(k, &kalman.predict(k, &gaussian, &u).unwrap(), &u, &y)
                .unwrap();
            let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(close(&mixed.center(), &gaussian.center()));
            let p = |b: &AnyBelief| b.covariance().unwrap().as_slice().to_vec();
            assert!(close(&p(&mixed), &p(&gaussian)));
        }
    }
}

#[test]
fn with_eta_zero_and_no_delta_the_covariance_does_not_move_the_center() {
    let mut draws = Draws::new(15);
    let problem = linear(&mut draws, 3, 2);
    let other = Problem {
        prior: Uncertain {
            covariance: Some(Matrix::identity(3)),
            ..problem.prior.clone()
        },
        w: Uncertain {
            covariance: None,
            ..problem.w.clone()
        },
        ..problem.clone()
    };
    let y: Vec<Vec<Option<f64>>> = (0..10).map(|_| vec![Some(draws.signed()); 2]).collect();
    let u = vec![vec![0.5]; 10];
    let run = |problem: &Problem| {
        let settings = EstimatorSettings::Ezgkf(settings(40, 0.0, 0.01));
        let filter = AnyEstimator::new(&settings, problem).unwrap();
        let steps = track(&filter, 9, &u, &y);
        steps
            .map(|s| s.updated.unwrap().center())
            .collect::<Vec<_>>()
    };
    assert_eq!(run(&problem), run(&other));
}

#[test]
fn without_delta_the_interval_matrix_form_and_the_predictor_forms_agree() {
    let mut draws = Draws::new(16);
    let problem = linear(&mut draws, 2, 1);
    let y: Vec<Vec<Option<f64>>> = (0..15).map(|_| vec![Some(draws.signed())]).collect();
    let u: Vec<Vec<f64>> = (0..15).map(|_| vec![draws.signed()]).collect();
    let run = |settings: EstimatorSettings| {
        let filter = AnyEstimator::new(&settings, &problem).unwrap();
        let hulls = track(&filter, 14, &u, &y).map(|s| s.updated.unwrap().interval_hull().unwrap());
        hulls
            .flat_map(|h| [h.lower(), h.upper()].concat())
            .collect::<Vec<f64>>()
    };
    let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-11);
    let base = settings(1000, 0.5, 0.01);
    let filter = run(EstimatorSettings::Ezgkf(base.clone()));
    assert!(close(&filter, &run(EstimatorSettings::EzgkfM(base))));
    let predictor = |form| {
        run(EstimatorSettings::Ezgkp(EzgkpSettings {
            phi: 1000,
            eta: 0.5,
            alpha: 0.01,
            gain: Gain::Optimal,
            overbars: true,
            merge_parallel: false,
            scale: Default::default(),
            form,
        }))
    };
    assert!(close(&predictor(Form::Ak), &predictor(Form::Direct)));
}

#[test]
fn merging_parallel_generators_keeps_the_forecast_box_and_makes_the_filter_tighter_here() {
    let problem = lpv();
    let y: Vec<Vec<Option<f64>>> = (0..41).map(|_| vec![Some(0.0)]).collect();
    let run = |merge_parallel| {
        let settings = EzgkfSettings {
            merge_parallel,
            ..settings(4000, 0.5, 0.0027)
        };
        let filter = AnyEstimator::new(&EstimatorSettings::Ezgkf(settings), &problem).unwrap();
        let last = track(&filter, 40, &[], &y).last().unwrap().updated.unwrap();
        let size = last.size();
        (size.n_generators.unwrap(), size.radius.unwrap())
    };
    let (many, wide) = run(false);
    let (few, narrow) = run(true);
    assert!(
        few < many / 10 && narrow < wide,
        "{few} of {many}, {narrow} of {wide}"
    );
}

/// Gaussian noise alone and a known A: the box c ± √(σ P_ii) holds x with at least 1 − α, and not
/// with so much more that a wrong σ would pass: each side alone holds with P(|N(0, 1)| ≤ √σ).
#[test]
fn confidence_boxes_hold_with_their_probability() {
    // (α, bounds on the rate): for n = 2, √σ = 1.5518 and 3.4393, so one side holds with 0.8793 and
    // 0.999417; two sides lie between the product and one side. Sampling error 3 sd at 40,000 draws.
    for (alpha, least, most) in [
        (0.3, 0.8793 * 0.8793 - 0.007, 0.8793 + 0.005),
        (0.0027, 0.9984, 1.0),
    ] {
        let mut draws = Draws::new(17);
        let (mut inside, mut total) = (0usize, 0usize);
        let system =
            Linear::new(m(&[[0.9, 0.3], [-0.2, 0.7]]), None, m(&[[1.0, 0.5]]), None).unwrap();
        let problem = Problem {
            system: AnySystem::Linear(system),
            prior: Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2)),
            w: Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2).scale(0.04)),
            v: Uncertain::gaussian(vec![0.0], m(&[[0.25]])),
        };
        let filter = AnyEstimator::new(
            &EstimatorSettings::Ezgkf(settings(10, 0.5, alpha)),
            &problem,
        )
        .unwrap();
        for _ in 0..2000 {
            let mut x = [draws.normal(), draws.normal()];
            let (mut truth, mut y) = (vec![x], vec![vec![None]]);
            for _ in 1..=20 {
                x = [
                    0.9 * x[0] + 0.3 * x[1] + 0.2 * draws.normal(),
                    -0.2 * x[0] + 0.7 * x[1] + 0.2 * draws.normal(),
                ];
                truth.push(x);
                y.push(vec![Some(x[0] + 0.5 * x[1] + 0.5 * draws.normal())]);
            }
            for step in track(&filter, 20, &[], &y) {
                let hull = step.updated.unwrap().interval_hull().unwrap();
                inside += usize::from(hull.contains(&truth[step.k]));
                total += 1;
            }
        }
        let rate = inside as f64 / total as f64;
        assert!(rate >= 1.0 - alpha, "alpha = {alpha}: {rate}");
        assert!(
            (least..=most).contains(&rate),
            "alpha = {alpha}: {rate} in [{least}, {most}]"
        );
    }
}

#[test]
fn the_true_state_stays_in_the_confidence_box_of_the_lpv_example() {
    let problem = lpv();
    for form in 0..3 {
        let settings = match form {
            0 => EstimatorSettings::Ezgkf(settings(100, 0.5, 0.0027)),
            1 => EstimatorSettings::EzgkfM(settings(100, 0.5, 0.0027)),
            _ => EstimatorSettings::Ezgkp(EzgkpSettings {
                phi: 100,
                eta: 0.5,
                alpha: 0.0027,
                gain: Gain::Optimal,
                overbars: true,
                merge_parallel: false,
                scale: Default::default(),
                form: Form::Ak,
            }),
        };
        let filter = AnyEstimator::new(&settings, &problem).unwrap();
        let mut draws = Draws::new(18);
        for _ in 0..50 {
            let mut x = [0.1, 0.1];
            let (mut truth, mut y) = (vec![x], Vec::new());
            for _ in 0..=40 {
                let v = 0.1 * draws.signed() + (0.01_f64 / 9.0).sqrt() * draws.normal();
                y.push(vec![Some(-2.0 * x[0] + x[1] + v)]);
                let w = 0.5 * draws.signed() + draws.normal() / 6.0;
                let delta = if draws.chance(0.5) { 0.3 } else { -0.3 };
                x = [
                    -0.5 * x[1] - 0.12 * w,
                    x[0] + (1.0 + delta) * x[1] + 0.02 * w,
                ];
                truth.push(x);
            }
            for step in track(&filter, 40, &[], &y) {
                let hull = step.updated.unwrap().interval_hull().unwrap();
                assert!(hull.contains(&truth[step.k]), "form {form}, k = {}", step.k);
            }
        }
    }
}

#[test]
fn the_van_der_pol_oscillator_is_tracked_over_500_steps() {
    let problem = Problem {
        system: AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap()),
        prior: both(
            vec![0.0; 2],
            Matrix::identity(2).scale(0.5),
            Matrix::identity(2).scale(0.25 / 11.829),
        ),
        w: Uncertain::zonotope(vec![0.0; 2], m(&[[0.0, 0.0], [0.15, 0.0]])),
        v: Uncertain::gaussian(vec![0.0], m(&[[0.04]])),
    };
    let filter = AnyEstimator::new(
        &EstimatorSettings::Ezgkf(settings(100, 0.5, 0.0027)),
        &problem,
    )
    .unwrap();
    let mut draws = Draws::new(19);
    let (mut x, mut truth, mut y) = ([1.0, 1.0], Vec::new(), Vec::new());
    for _ in 0..=500 {
        truth.push(x);
        y.push(vec![Some(x[0] + x[1] + 0.2 * draws.normal())]);
        let w = if draws.chance(0.5) { 0.15 } else { -0.15 };
        x = [
            x[0] + 0.1 * x[1],
            -0.1 * x[0] + (1.1 - 0.1 * x[0] * x[0]) * x[1] + w,
        ];
    }
    let mut outside = 0;
    for step in track(&filter, 500, &[], &y).skip(1) {
        let hull = step.updated.unwrap().interval_hull().unwrap();
        outside += usize::from(!hull.contains(&truth[step.k]));
        assert!(hull.widths().iter().all(|&w| w < 4.0));
    }
    assert_eq!(outside, 0);
}
