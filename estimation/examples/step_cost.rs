//! What a step of the constrained zonotope filters costs, and how that grows.
//!
//! The quadrotor of [Rego2020, Sec. 5.2] flies its helix, the system of Sec. 5.1 and chains of n states take noise;
//! each filter is given the inputs and measurements. A line a filter: the time of a prediction and of an update with its
//! reduction, mean and least, and of both together for 99.9 % of the steps; the largest set before it is
//! reduced; eliminations, linear programs, pivots and operations of a step by the tally; the mean radius.
//!
//! `cargo run -p zonobench-estimation --example step_cost -- [STEPS] [NAME ...]` shows the filters whose names begin
//! with one of those given, all but those of choice C4 without; `growth` shows how a step grows with n, n_g and n_c.

use std::error::Error;
use std::time::{Duration, Instant};
use zonobench_estimation::controller::Controller;
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::systems::{Linear, Quadrotor, Raimondo};
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, Estimator, Inputs, Problem, Trajectory, Truth, Uncertain,
    simulate,
};
use zonobench_sets::{Matrix, ops};

fn centered(half: &[f64]) -> Result<Uncertain, Box<dyn Error>> {
    let minus: Vec<f64> = half.iter().map(|x| -x).collect();
    Ok(Uncertain::from_box(&minus, half)?)
}

/// X_0, W and V of [Rego2020, Sec. 5.2].
fn problem() -> Result<Problem, Box<dyn Error>> {
    let pi = std::f64::consts::PI;
    let mut prior = vec![2.0, 2.0, 2.0, 1.0, 1.0, 1.0, pi / 6.0, pi / 6.0, pi / 2.0];
    prior.extend([pi / 12.0; 3]);
    let mut v = vec![0.15, 0.15, 0.51];
    v.extend([2.618e-3; 3]);
    v.extend([16.558e-3; 3]);
    Ok(Problem {
        system: AnySystem::Quadrotor(Quadrotor::published()),
        prior: centered(&prior)?,
        w: centered(&[1.0; 3])?,
        v: centered(&v)?,
    })
}

/// [Rego2020, Sec. 5.1]: the prior of Eq. (26), noises of 0.4.
fn two_states() -> Result<Problem, Box<dyn Error>> {
    let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]])?;
    Ok(Problem {
        system: AnySystem::Raimondo(Raimondo::default()),
        prior: Uncertain::zonotope(vec![0.5; 2], g),
        w: centered(&[0.4; 2])?,
        v: centered(&[0.4; 2])?,
    })
}

/// Steps from `x0` without an input.
fn walk(problem: &Problem, x0: &[f64], steps: usize) -> Result<Trajectory, Box<dyn Error>> {
    let truth = Truth {
        x0: InitialState::Point(x0.to_vec()),
        w: drawn(&problem.w),
        v: drawn(&problem.v),
        delta: None,
    };
    Ok(simulate(
        &problem.system,
        &truth,
        &Inputs::Constant(Vec::new()),
        1,
        0,
        steps,
    )?)
}

fn drawn(of: &Uncertain) -> Noise {
    Noise::Drawn(Drawn {
        law: Law::Uniform,
        of: of.clone(),
        truncate: false,
    })
}

fn flight(problem: &Problem, steps: usize) -> Result<Trajectory, Box<dyn Error>> {
    let mut x0 = vec![0.0; 12];
    (x0[0], x0[2], x0[8]) = (0.5, 1.0, std::f64::consts::FRAC_PI_3);
    let truth = Truth {
        x0: InitialState::Point(x0),
        w: drawn(&problem.w),
        v: drawn(&problem.v),
        delta: None,
    };
    let inputs = Inputs::Controller(Controller::FeedbackLinearising);
    Ok(simulate(&problem.system, &truth, &inputs, 1, 0, steps)?)
}

/// A chain of `n` states x_i⁺ = 0.5 x_i + 0.2 x_{i+1} + w_i of which the first is measured.
fn chain(n: usize) -> Result<Problem, Box<dyn Error>> {
    let a = Matrix::from_fn(n, n, |i, j| match j {
        _ if j == i => 0.5,
        _ if j == i + 1 => 0.2,
        _ => 0.0,
    });
    let c = Matrix::from_fn(1, n, |_, j| if j == 0 { 1.0 } else { 0.0 });
    Ok(Problem {
        system: AnySystem::Linear(Linear::new(a, None, c, None)?),
        prior: centered(&vec![1.0; n])?,
        w: centered(&vec![0.1; n])?,
        v: centered(&[0.1])?,
    })
}

fn czmv(generators: usize, constraints: usize) -> String {
    format!(r#"{{"kind": "czmv", "generators": {generators}, "constraints": {constraints}}}"#)
}

fn czfo(generators: usize, constraints: usize, rest: &str) -> String {
    format!(
        r#"{{"kind": "czfo", "generators": {generators}, "constraints": {constraints}, {rest}}}"#
    )
}

/// A filter's name and settings.
type Filter = (String, String);

/// The filters of the quadrotor, of the two states, and of what grows.
fn filters() -> [Vec<Filter>; 3] {
    let lean = r#""h": "c3", "expansion": "lean""#;
    let zmv = r#"{"kind": "zmv", "generators": 40}"#;
    let flying = vec![
        ("zmv-40".into(), zmv.into()),
        ("czmv-25-3".into(), czmv(25, 3)),
        ("czmv-40-12".into(), czmv(40, 12)),
        ("lean-40-12".into(), czfo(40, 12, lean)),
        ("full-25-3".into(), czfo(25, 3, r#""h": "c3""#)),
        ("full-40-12".into(), czfo(40, 12, r#""h": "c3""#)),
        ("c4-25-3".into(), czfo(25, 3, r#""h": "c4""#)),
        ("c4-40-12".into(), czfo(40, 12, r#""h": "c4""#)),
    ];
    let two = vec![
        ("two-czmv-20-5".into(), czmv(20, 5)),
        ("two-xb-20-5".into(), czfo(20, 5, r#""h": "xb""#)),
        ("two-c4-20-3".into(), czfo(20, 3, r#""h": "c4""#)),
        ("two-c4-20-5".into(), czfo(20, 5, r#""h": "c4""#)),
    ];
    let mut growing = Vec::new();
    for (generators, constraints) in [
        (40, 3),
        (40, 6),
        (40, 12),
        (40, 24),
        (60, 12),
        (80, 12),
        (160, 12),
    ] {
        let name = format!("growth {generators}-{constraints}");
        growing.push((name, czmv(generators, constraints)));
    }
    [flying, two, growing]
}

/// Runs a filter over the trajectory and prints its line.
fn show(
    name: &str,
    settings: &str,
    problem: &Problem,
    t: &Trajectory,
) -> Result<(), Box<dyn Error>> {
    let e = AnyEstimator::new(&serde_json::from_str(settings)?, problem)?;
    let steps = t.x.len() - 1;
    let (mut predict, mut update, mut both) = (Vec::new(), Vec::new(), Vec::new());
    let (mut radius, mut sizes) = (0.0, (0, 0));
    let mut counts = ops::Counts::default();
    let mut belief = e.prior();
    for k in 0..=steps {
        let u = &t.u[k.saturating_sub(1)];
        let y: Vec<Option<f64>> = t.y[k].iter().map(|&y| Some(y)).collect();
        let (done, tally) = ops::tally(|| -> Result<_, Box<dyn Error>> {
            let begun = Instant::now();
            let predicted = if k == 0 {
                belief.clone()
            } else {
                e.predict(k, &e.reduce_order(k - 1, belief.clone())?, u)?
            };
            let middle = Instant::now();
            let updated = e.update(k, &predicted, u, &y)?;
            Ok((predicted, updated, middle - begun, middle.elapsed()))
        });
        let (predicted, updated, first, second) = done?;
        belief = updated;
        radius += belief.size().radius.unwrap_or(f64::NAN);
        if k > 0 {
            let shape = predicted.shape();
            sizes.0 = sizes.0.max(shape.generators.map_or(0, |g| g.cols()));
            sizes.1 = sizes.1.max(shape.constraints.map_or(0, |(a, _)| a.rows()));
            predict.push(first);
            update.push(second);
            both.push(first + second);
            counts += tally.total();
        }
    }
    both.sort_unstable();
    let us = |t: Duration| t.as_secs_f64() * 1e6;
    let mean = |t: &[Duration]| us(t.iter().sum::<Duration>()) / t.len() as f64;
    let least = |t: &[Duration]| t.iter().min().map_or(0.0, |&t| us(t));
    let each = |c: u64| c as f64 / steps as f64;
    println!(
        "{name:14} {:10.1} {:10.1} {:10.1} {:10.1} {:10.1} {:5} {:4} {:7.1} {:6.1} {:6.1} {:8.3} {:.17}",
        mean(&predict),
        least(&predict),
        mean(&update),
        least(&update),
        us(both[(both.len() * 999).div_ceil(1000) - 1]),
        sizes.0,
        sizes.1,
        each(counts.eliminations),
        each(counts.programs),
        each(counts.pivots),
        each(counts.arithmetic()) * 1e-6,
        radius / (steps + 1) as f64,
    );
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let steps: usize = arguments.first().map_or(Ok(50), |a| a.parse())?;
    if steps == 0 {
        return Err("at least one step".into());
    }
    let wanted = |name: &str| match arguments.get(1..) {
        None | Some([]) => !name.contains("c4") && !name.starts_with("growth"),
        Some(names) => names.iter().any(|n| name.starts_with(n.as_str())),
    };
    println!(
        "{:14} {:>21} {:>21} {:>10} {:>10} {:>7} {:>6} {:>6} {:>8} mean radius",
        "us",
        "predict: mean, least",
        "update: mean, least",
        "99.9 %",
        "largest",
        "elim.",
        "LPs",
        "pivots",
        "Mop"
    );
    let [flying, two, growing] = filters();
    let (vehicle, small) = (problem()?, two_states()?);
    let (flown, walked) = (flight(&vehicle, steps)?, walk(&small, &[0.8, 0.65], steps)?);
    for (filters, problem, t) in [
        (flying, &vehicle, &flown),
        (two, &small, &walked),
        (growing, &vehicle, &flown),
    ] {
        for (name, settings) in filters.iter().filter(|(name, _)| wanted(name)) {
            show(name, settings, problem, t)?;
        }
    }
    for n in [2, 4, 8, 16] {
        let name = format!("growth n = {n}");
        if wanted(&name) {
            let problem = chain(n)?;
            show(
                &name,
                &czmv(3 * n + 12, 12),
                &problem,
                &walk(&problem, &vec![0.1; n], steps)?,
            )?;
        }
    }
    Ok(())
}
