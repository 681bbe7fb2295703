//! Every guaranteed estimator: the true state is in the set at every step, also under extreme noise.
//!
//! The truth is exact: states and measurements are rationals made from the same f64 matrices that the
//! estimator is given, so a single rounding that is not accounted for can be seen.

mod draws;

use draws::Draws;
use num_rational::BigRational;
use zonobench_estimation::estimators::{
    BoxStateEstSettings, Products, printed_width_bound, width_bound,
};
use zonobench_estimation::systems::Linear;
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings, Problem,
    System, Uncertain, track,
};
use zonobench_sets::{IntervalVector, Matrix};

/// The guaranteed estimators, one a line.
fn guaranteed() -> Vec<EstimatorSettings> {
    let parse = |json: &str| serde_json::from_str(json).unwrap();
    vec![
        box_state_est(Products::Stacked),
        parse(r#"{"kind": "zmv", "generators": 10}"#),
        parse(r#"{"kind": "zfo", "generators": 10}"#),
        parse(r#"{"kind": "czmv", "generators": 10, "constraints": 3}"#),
        parse(r#"{"kind": "czfo", "generators": 10, "constraints": 3, "expansion": "lean"}"#),
    ]
}

fn box_state_est(products: Products) -> EstimatorSettings {
    EstimatorSettings::BoxStateEst(BoxStateEstSettings {
        products,
        ..Default::default()
    })
}

fn exact(x: f64) -> BigRational {
    BigRational::from_float(x).expect("finite")
}

fn nearest(x: &BigRational) -> f64 {
    num_traits::ToPrimitive::to_f64(x).unwrap()
}

/// M x, exactly.
fn times(m: &Matrix, x: &[BigRational]) -> Vec<BigRational> {
    (0..m.rows())
        .map(|i| m.row(i).iter().zip(x).map(|(&m, x)| exact(m) * x).sum())
        .collect()
}

fn inside(sides: &IntervalVector, x: &[BigRational]) -> bool {
    sides
        .iter()
        .zip(x)
        .all(|(side, x)| exact(side.lo()) <= *x && *x <= exact(side.hi()))
}

/// How the noise is chosen.
#[derive(Clone, Copy, Debug)]
enum Noise {
    /// A new vertex of the box at every step.
    Vertices,
    /// All components jump from bound to bound together, every few steps.
    BangBang(usize),
    /// Anywhere.
    Uniform,
    /// One vertex throughout.
    Constant,
}

impl Noise {
    fn draw(self, k: usize, bounds: &IntervalVector, draws: &mut Draws) -> Vec<f64> {
        let end = |high: bool, i: usize| if high { bounds[i].hi() } else { bounds[i].lo() };
        (0..bounds.dim())
            .map(|i| match self {
                Self::Vertices => end(draws.chance(0.5), i),
                Self::BangBang(period) => end((k / period).is_multiple_of(2), i),
                Self::Constant => end(i % 2 == 0, i),
                Self::Uniform => {
                    let x = bounds[i].lo() + draws.unit() * (bounds[i].hi() - bounds[i].lo());
                    x.clamp(bounds[i].lo(), bounds[i].hi())
                }
            })
            .collect()
    }
}

/// An exact trajectory: x_k, u_k, and the f64 y_k with y_k − C x_k − D u_k ∈ [v] exactly.
struct Run {
    x: Vec<Vec<BigRational>>,
    u: Vec<Vec<f64>>,
    y: Vec<Vec<Option<f64>>>,
}

fn simulate(problem: &Problem, noise: Noise, steps: usize, draws: &mut Draws) -> Run {
    let parts = problem.system.linear_parts().unwrap();
    let (w, v) = (problem.w.box_hull(), problem.v.box_hull());
    let start = Noise::Vertices.draw(0, &problem.prior.box_hull(), draws);
    let mut x: Vec<BigRational> = start.into_iter().map(exact).collect();
    let mut run = Run {
        x: Vec::new(),
        u: Vec::new(),
        y: Vec::new(),
    };
    for k in 0..=steps {
        let u: Vec<f64> = (0..parts.b.cols()).map(|_| 3.0 * draws.signed()).collect();
        let u_exact: Vec<BigRational> = u.iter().map(|&u| exact(u)).collect();
        let mut y = times(&parts.c, &x);
        for (y, du) in y.iter_mut().zip(times(&parts.d, &u_exact)) {
            *y += du;
        }
        let drawn = noise.draw(k, &v, draws);
        let measured = y.iter().enumerate().map(|(i, y)| {
            let mut value = nearest(&(y + exact(drawn[i])));
            // The measured number is an f64: move it until its noise is in [v] exactly.
            while exact(value) - y > exact(v[i].hi()) {
                value = value.next_down();
            }
            while exact(value) - y < exact(v[i].lo()) {
                value = value.next_up();
            }
            assert!(
                exact(value) - y <= exact(v[i].hi()),
                "[v] holds an f64 measurement"
            );
            Some(value)
        });
        run.y.push(measured.collect());
        let mut next = times(&parts.a, &x);
        for (next, bu) in next.iter_mut().zip(times(&parts.b, &u_exact)) {
            *next += bu;
        }
        for (next, w) in next.iter_mut().zip(noise.draw(k, &w, draws)) {
            *next += exact(w);
        }
        run.x.push(std::mem::replace(&mut x, next));
        run.u.push(u);
    }
    run
}

/// A random observable system with random boxes: n = 1 … 3, n_y = 1, 2, with and without inputs.
fn problem(draws: &mut Draws, scale: f64) -> Problem {
    loop {
        let (n, ny, nu) = (1 + draws.below(3), 1 + draws.below(2), draws.below(3));
        let a = draws.matrix(n, n).scale(0.4 + 0.8 * draws.unit());
        let c = draws
            .matrix(ny, n)
            .scale(if draws.chance(0.3) { 30.0 } else { 1.0 });
        let system = Linear::new(
            a,
            Some(draws.matrix(n, nu).scale(scale)),
            c,
            Some(draws.matrix(ny, nu).scale(scale)),
        )
        .unwrap();
        let mut sides = |dim: usize, size: f64| {
            let bounds = (0..dim).map(|_| {
                let (center, radius) = (0.3 * size * draws.signed(), size * draws.unit());
                (center - radius, center + radius)
            });
            let (lower, upper): (Vec<f64>, Vec<f64>) = bounds.unzip();
            Uncertain::from_box(&lower, &upper).unwrap()
        };
        let problem = Problem {
            system: AnySystem::Linear(system),
            prior: sides(n, 5.0 * scale),
            w: sides(n, 0.2 * scale),
            v: sides(ny, scale),
        };
        match AnyEstimator::new(&box_state_est(Products::Stacked), &problem) {
            Ok(AnyEstimator::BoxStateEst(e)) if e.condition() < 1e7 => return problem,
            Ok(_) | Err(EstimationError::Unobservable { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// Steps at which the state was lost (or the set wrongly found empty), and the widest box for k ≥ n − 1.
fn lost(settings: &EstimatorSettings, problem: &Problem, run: &Run) -> (usize, f64) {
    let estimator = AnyEstimator::new(settings, problem).unwrap();
    let (mut lost, mut widest) = (0, 0.0_f64);
    let n = problem.prior.dim();
    for step in track(&estimator, run.x.len() - 1, &run.u, &run.y) {
        let predicted = step.predicted.unwrap().interval_hull().unwrap();
        lost += usize::from(!inside(&predicted, &run.x[step.k]));
        match step.updated {
            Ok(belief) => {
                let hull = belief.interval_hull().unwrap();
                lost += usize::from(!inside(&hull, &run.x[step.k]));
                if step.k + 1 >= n {
                    widest = hull.widths().into_iter().fold(widest, f64::max);
                }
            }
            Err(EstimationError::Inconsistent { .. }) => lost += 1,
            Err(error) => panic!("{error}"),
        }
    }
    (lost, widest)
}

#[test]
fn the_true_state_is_never_lost() {
    let mut draws = Draws::new(1);
    let kinds = [
        Noise::Vertices,
        Noise::BangBang(3),
        Noise::Uniform,
        Noise::Constant,
    ];
    for case in 0..160 {
        let scale = [1.0, 1.0, 1e-9, 1e9][case % 4];
        let problem = problem(&mut draws, scale);
        let noise = kinds[case / 4 % 4];
        let run = simulate(&problem, noise, 18, &mut draws);
        for settings in guaranteed() {
            let estimator = AnyEstimator::new(&settings, &problem).unwrap();
            assert!(estimator.guaranteed());
            let (lost, _) = lost(&settings, &problem, &run);
            assert_eq!(lost, 0, "case {case}: {noise:?}, {settings:?}, {problem:?}");
        }
    }
}

#[test]
fn the_true_state_is_not_lost_where_measurements_are_missing() {
    let mut draws = Draws::new(2);
    for case in 0..80 {
        let problem = problem(&mut draws, 1.0);
        let mut run = simulate(&problem, Noise::Vertices, 16, &mut draws);
        for y in run.y.iter_mut().flatten() {
            if draws.chance(0.25) {
                *y = None;
            }
        }
        for settings in guaranteed() {
            let (lost, _) = lost(&settings, &problem, &run);
            assert_eq!(lost, 0, "case {case}: {settings:?}, {problem:?}");
        }
    }
}

/// Widths shrink to the level of rounding here: nothing but the outward rounding is left. [v] has just
/// the room that an f64 measurement needs, |C x| being below 16.
#[test]
fn the_true_state_is_not_lost_without_noise() {
    let mut draws = Draws::new(3);
    for case in 0..60 {
        let drawn = problem(&mut draws, 1.0);
        let parts = drawn.system.linear_parts().unwrap();
        let (n, ny) = (parts.a.rows(), parts.c.rows());
        let system = Linear::new(parts.a.scale(0.5), None, parts.c.scale(0.03), None).unwrap();
        let problem = Problem {
            system: AnySystem::Linear(system),
            prior: Uncertain::from_box(&vec![-1.0; n], &vec![2.0; n]).unwrap(),
            w: Uncertain::point(vec![0.0; n]),
            v: Uncertain::from_box(&vec![-2e-15; ny], &vec![2e-15; ny]).unwrap(),
        };
        let run = simulate(&problem, Noise::Vertices, 25, &mut draws);
        for settings in guaranteed() {
            let (lost, _) = lost(&settings, &problem, &run);
            assert_eq!(lost, 0, "case {case}: {settings:?}, {problem:?}");
        }
    }
}

/// C A is what is left of a cancellation, so its rounding is 1e8 times larger than that of its entries:
/// an observer that takes the rounded O for O loses the state at once.
#[test]
fn the_true_state_is_not_lost_where_the_observability_matrix_cancels() {
    let mut draws = Draws::new(8);
    for case in 0..50 {
        let mut near = |x: f64, by: f64| x * (1.0 + by * draws.signed());
        let (a, c) = (near(1.0, 0.1), near(1.0, 0.1));
        let r = near(-a / c, 1e-8);
        let b = near(-r * a, 1e-8);
        let a = Matrix::from_rows(&[[a, -b], [c, -a]]).unwrap();
        let system = Linear::new(a, None, Matrix::from_rows(&[[1.0, r]]).unwrap(), None).unwrap();
        // C x_0 is small too, so that an f64 can tell y to 1e-23.
        let x0 = [1.0, -1.0 / r];
        let problem = Problem {
            system: AnySystem::Linear(system),
            prior: Uncertain::from_box(&x0.map(|x| x - 1e-9), &x0.map(|x| x + 1e-9)).unwrap(),
            w: Uncertain::point(vec![0.0; 2]),
            v: Uncertain::from_box(&[-1e-23], &[1e-23]).unwrap(),
        };
        let run = simulate(&problem, Noise::Vertices, 4, &mut draws);
        for settings in guaranteed() {
            let (lost, _) = lost(&settings, &problem, &run);
            assert_eq!(lost, 0, "case {case}: {settings:?}, {problem:?}");
        }
    }
}

#[test]
fn widths_stay_below_the_corrected_bound() {
    let mut draws = Draws::new(4);
    let mut above_printed = 0;
    for case in 0..150 {
        let problem = problem(&mut draws, 1.0);
        let run = simulate(&problem, Noise::Vertices, 8, &mut draws);
        let (_, widest) = lost(&box_state_est(Products::Stacked), &problem, &run);
        let parts = problem.system.linear_parts().unwrap();
        let largest = |u: &Uncertain| u.box_hull().widths().into_iter().fold(0.0, f64::max);
        let (v, w) = (largest(&problem.v), largest(&problem.w));
        let bound = width_bound(&parts.a, &parts.c).unwrap().width(v, w);
        // Rounding of boxes and of the bound, magnified by the inversion (condition below 1e7).
        assert!(
            widest <= bound * (1.0 + 1e-7),
            "case {case}: {widest} > {bound}, {problem:?}"
        );
        let printed = printed_width_bound(&parts.a, &parts.c).unwrap().width(v, w);
        above_printed += usize::from(widest > printed * (1.0 + 1e-7));
    }
    assert!(
        above_printed > 0,
        "the printed bound was exceeded in {above_printed} of 150"
    );
}

#[test]
fn the_printed_width_bound_is_exceeded_where_signs_cancel() {
    let m = |rows: &[[f64; 2]]| Matrix::from_rows(rows).unwrap();
    let (a, c) = (m(&[[0.9, -0.9], [0.0, 0.6]]), m(&[[-1.0, 2.0]]));
    let system = Linear::new(a.clone(), None, c.clone(), None).unwrap();
    let symmetric = |r: &[f64]| {
        let minus: Vec<f64> = r.iter().map(|x| -x).collect();
        Uncertain::from_box(&minus, r).unwrap()
    };
    let problem = Problem {
        system: AnySystem::Linear(system),
        prior: symmetric(&[1000.0, 1000.0]),
        w: symmetric(&[0.01, 0.01]),
        v: symmetric(&[1.0]),
    };
    let mut draws = Draws::new(5);
    let run = simulate(&problem, Noise::Vertices, 40, &mut draws);
    let (lost, widest) = lost(&box_state_est(Products::Stacked), &problem, &run);
    let printed = printed_width_bound(&a, &c).unwrap().width(2.0, 0.02);
    let corrected = width_bound(&a, &c).unwrap().width(2.0, 0.02);
    assert_eq!(lost, 0);
    assert!(
        printed < 2.0 && widest > 5.0 * printed,
        "{widest} against {printed}"
    );
    assert!(
        widest <= corrected && corrected < 37.0,
        "{widest} against {corrected}"
    );
}

#[test]
fn the_printed_products_lose_the_state_where_signs_alternate() {
    let n = 3;
    let minus_identity = Matrix::identity(n).scale(-1.0);
    let system = Linear::new(minus_identity, None, Matrix::identity(n), None).unwrap();
    let ones = |r: f64| Uncertain::from_box(&[-r; 3], &[r; 3]).unwrap();
    let problem = Problem {
        system: AnySystem::Linear(system),
        prior: ones(1.0),
        w: ones(1.0),
        v: ones(0.1),
    };
    let mut draws = Draws::new(6);
    // d alternates, so that d_{j+1} − d_j is as large as it can be; the sum M₂ 1 = I − I is zero.
    let run = simulate(&problem, Noise::BangBang(1), 20, &mut draws);
    assert_eq!(lost(&box_state_est(Products::Stacked), &problem, &run).0, 0);
    assert!(lost(&box_state_est(Products::Printed), &problem, &run).0 > 0);
    let printed = AnyEstimator::new(&box_state_est(Products::Printed), &problem).unwrap();
    assert!(!printed.guaranteed());
}

#[test]
fn a_measurement_that_contradicts_the_model_is_inconsistent_and_ends_the_track() {
    let mut draws = Draws::new(7);
    let problem = problem(&mut draws, 1.0);
    let mut run = simulate(&problem, Noise::Uniform, 20, &mut draws);
    for y in run.y[10].iter_mut().flatten() {
        *y += 1e6;
    }
    for settings in guaranteed() {
        let estimator = AnyEstimator::new(&settings, &problem).unwrap();
        let steps: Vec<_> = track(&estimator, 20, &run.u, &run.y).collect();
        let last = steps.last().unwrap();
        assert_eq!(
            last.updated.as_ref().unwrap_err(),
            &EstimationError::Inconsistent { k: last.k }
        );
        assert!((10..13).contains(&last.k), "{}", last.k);
        assert!(steps[..last.k].iter().all(|s| s.updated.is_ok()));
    }
}
