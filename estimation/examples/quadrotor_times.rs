//! How long a step of the quadrotor of twelve states takes at 100 Hz, and where the time goes.
//!
//! Writes CSV: `kind` is `period` (µs) or `steps`; `quantile`, whose `key` is the share of steps that take no longer
//! than `value` µs (1: the longest); `bin`, whose `value` steps took from `key` µs to ten to the 1/20 of that;
//! or `share`, the part of a step's time that the operation `key` takes. Times depend on the machine.
//!
//! Run with `cargo run -p zonobench-estimation --example quadrotor_times -- [FLIGHTS] [STEPS]`.

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_6, PI};
use std::hint::black_box;
use std::time::Instant;
use zonobench_estimation::controller::Controller;
use zonobench_estimation::propagation::Dynamics;
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::systems::Quadrotor;
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, Estimator, Inputs, Problem, Trajectory, Truth,
    Uncertain, simulate, track,
};
use zonobench_sets::interval_matrix::partial_jacobian_over;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::reduction::scott;
use zonobench_sets::{ConstrainedZonotope, IntervalVector, Matrix, Zonotope};

/// The sampling period in µs.
const PERIOD: f64 = 1e4;

/// The constrained filters keep so many generators and constraints.
const KEPT: (usize, usize) = (40, 12);

/// Bins a decade.
const BINS: f64 = 20.0;

const CZMV: &str = r#"{"kind": "czmv", "generators": 40, "constraints": 12, "h": "c2"}"#;

const FILTERS: [(&str, &str); 4] = [
    ("ZMV (40)", r#"{"kind": "zmv", "generators": 40}"#),
    ("ZFO (40)", r#"{"kind": "zfo", "generators": 40}"#),
    ("CZMV (40 12)", CZMV),
    (
        "CZFO lean (40 12)",
        r#"{"kind": "czfo", "generators": 40, "constraints": 12, "h": "c3", "expansion": "lean"}"#,
    ),
];

/// Half-widths of V [Rego2020, Table 4].
const V: [f64; 9] = [
    0.15, 0.15, 0.51, 2.618e-3, 2.618e-3, 2.618e-3, 16.558e-3, 16.558e-3, 16.558e-3,
];

/// X_0, W and V of [Rego2020, Sec. 5.2].
fn problem() -> Result<Problem, Box<dyn Error>> {
    let centered = |half: &[f64]| {
        let minus: Vec<f64> = half.iter().map(|x| -x).collect();
        Uncertain::from_box(&minus, half)
    };
    let mut prior = vec![
        2.0, 2.0, 2.0, 1.0, 1.0, 1.0, FRAC_PI_6, FRAC_PI_6, FRAC_PI_2,
    ];
    prior.extend([PI / 12.0; 3]);
    Ok(Problem {
        system: AnySystem::Quadrotor(Quadrotor::published()),
        prior: centered(&prior)?,
        w: centered(&[1.0; 3])?,
        v: centered(&V)?,
    })
}

/// A flight along the helix, the gusts on the vertices of W.
fn flight(problem: &Problem, run: u64, steps: usize) -> Result<Trajectory, Box<dyn Error>> {
    let mut x0 = vec![0.0; 12];
    (x0[0], x0[2], x0[8]) = (0.5, 1.0, FRAC_PI_3);
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
    Ok(simulate(
        &problem.system,
        &truth,
        &inputs,
        20204,
        run,
        steps,
    )?)
}

fn measured(t: &Trajectory) -> Vec<Vec<Option<f64>>> {
    let row = |y: &Vec<f64>| y.iter().map(|&y| Some(y)).collect();
    t.y.iter().map(row).collect()
}

fn line(estimator: &str, kind: &str, key: &str, value: f64) {
    println!("cz,{estimator},{kind},{key},{value}");
}

fn histogram(
    name: &str,
    settings: &str,
    problem: &Problem,
    flights: &[Trajectory],
) -> Result<(), Box<dyn Error>> {
    let estimator = AnyEstimator::new(&serde_json::from_str(settings)?, problem)?;
    let mut times = Vec::new();
    for t in flights {
        let y = measured(t);
        let mut steps = track(&estimator, t.u.len().min(y.len() - 1), &t.u, &y);
        loop {
            let start = Instant::now();
            let Some(step) = steps.next() else { break };
            times.push(start.elapsed().as_nanos() as f64 / 1e3);
            step.updated?;
        }
    }
    times.sort_by(f64::total_cmp);
    line(name, "period", "", PERIOD);
    line(name, "steps", "", times.len() as f64);
    for q in [0.5, 0.99, 0.999, 1.0] {
        let rank = libm::ceil(q * times.len() as f64) as usize;
        line(name, "quantile", &q.to_string(), times[rank - 1]);
    }
    let mut bins = BTreeMap::new();
    for time in &times {
        *bins
            .entry(libm::floor(BINS * libm::log10(*time)) as i64)
            .or_insert(0u64) += 1;
    }
    for (bin, count) in bins {
        let from = libm::pow(10.0, bin as f64 / BINS);
        line(name, "bin", &format!("{from:.4}"), count as f64);
    }
    Ok(())
}

/// The set of a belief, its rounding boxes left out: they change no operation's time.
fn set_of(belief: &AnyBelief) -> Result<ConstrainedZonotope, Box<dyn Error>> {
    let shape = belief.shape();
    let g = shape.generators.ok_or("a set with generators")?;
    let cols = g.cols();
    let (a, b) = shape
        .constraints
        .unwrap_or_else(|| (Matrix::zeros(0, cols), Vec::new()));
    Ok(ConstrainedZonotope::new(shape.center, g, a, b)?)
}

/// Times the operations of a step of CZMV one by one, on the sets of the flight, beside the step itself.
fn profile(problem: &Problem, t: &Trajectory) -> Result<(), Box<dyn Error>> {
    let system = Quadrotor::published();
    let estimator = AnyEstimator::new(&serde_json::from_str(CZMV)?, problem)?;
    // Positions, angles and rates are measured.
    let c = Matrix::from_fn(9, 12, |i, j| f64::from(j == if i < 3 { i } else { i + 3 }));
    let (w, y) = (
        IntervalVector::from_bounds(&[-1.0; 3], &[1.0; 3])?,
        measured(t),
    );
    let mut spent: BTreeMap<&str, f64> = BTreeMap::new();
    let mut total = 0.0;
    let mut belief = estimator.update(0, &estimator.prior(), &t.u[0], &y[0])?;
    for (k, y_k) in y.iter().enumerate().take(t.u.len()).skip(1) {
        let mut time = |name, operation: &mut dyn FnMut() -> Result<(), Box<dyn Error>>| {
            let start = Instant::now();
            operation()?;
            *spent.entry(name).or_default() += start.elapsed().as_secs_f64();
            Ok::<(), Box<dyn Error>>(())
        };
        let x = set_of(&belief)?;
        let hull = x.interval_hull()?;
        time("linear programs of the interval hull", &mut || {
            black_box(x.interval_hull_with(&mut LinearProgram::new())?);
            Ok(())
        })?;
        let f = Dynamics::new(&system, k - 1, &t.u[k - 1]);
        let over = IntervalVector::stack(&[&hull, &w]);
        time("Jacobian over the hull", &mut || {
            black_box(partial_jacobian_over(&f, &over, 0..12)?);
            Ok(())
        })?;
        time("elimination of constraints", &mut || {
            black_box(scott::eliminate_constraints(&x, 0)?);
            Ok(())
        })?;
        let start = Instant::now();
        let predicted = estimator.predict(k, &belief, &t.u[k - 1])?;
        total += start.elapsed().as_secs_f64();
        let seen = ConstrainedZonotope::from(Zonotope::new(t.y[k].clone(), Matrix::diagonal(&V))?);
        let joined = set_of(&predicted)?
            .generalized_intersection(&c, &seen)?
            .fold();
        let mut fewer = None;
        time("elimination of constraints", &mut || {
            fewer = Some(scott::eliminate_constraints(&joined, KEPT.1)?);
            Ok(())
        })?;
        let fewer = fewer.ok_or("a set without constraints")?;
        time("reduction of generators", &mut || {
            black_box(scott::reduce_generators(&fewer, KEPT.0)?);
            Ok(())
        })?;
        let start = Instant::now();
        belief = estimator.update(k, &predicted, &t.u[k], y_k)?;
        total += start.elapsed().as_secs_f64();
    }
    let mut rest = 1.0;
    for (name, seconds) in &spent {
        line("CZMV (40 12)", "share", name, seconds / total);
        rest -= seconds / total;
    }
    line("CZMV (40 12)", "share", "the rest", rest);
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<usize>());
    let flights = numbers.next().transpose()?.unwrap_or(5) as u64;
    let steps = numbers.next().transpose()?.unwrap_or(2000);
    if flights == 0 || steps == 0 {
        return Err("expected at least one flight of at least one step".into());
    }
    let problem = problem()?;
    let flights = (0..flights)
        .map(|run| flight(&problem, run, steps))
        .collect::<Result<Vec<_>, _>>()?;
    println!("paper,estimator,kind,key,value");
    for (name, settings) in FILTERS {
        histogram(name, settings, &problem, &flights)?;
    }
    profile(&problem, &flights[0])
}
