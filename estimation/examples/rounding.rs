//! How much wider the sets of a filter are because they hold their rounding.
//!
//! `cargo run -p zonobench-estimation --example rounding`. On the two systems of [Rego2020, Sec. 5] each filter runs
//! twice over the same measurements: as it is, and with the rounding box r and the slack δ taken away from every
//! predicted and every updated set, which no guarantee allows. Printed are, over all steps and components, the
//! greatest part of a hull's width that is r and δ of the set itself; and of the widths of the two runs the greatest
//! and the mean relative difference. The runs of a constrained filter part where a slack that has become a generator
//! changes which one the reduction takes: their greatest difference is that of two reductions, of either sign.

use std::error::Error;
use zonobench_estimation::controller::Controller;
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::systems::{Quadrotor, Raimondo};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, Estimator, Inputs, Problem, Truth, Uncertain,
    simulate,
};
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

type Failure = Box<dyn Error>;

/// The belief without r and δ.
fn bare(belief: &AnyBelief) -> Result<AnyBelief, Failure> {
    let zonotope = |z: &Zonotope| Zonotope::new(z.c().to_vec(), z.g().clone());
    Ok(match belief {
        AnyBelief::ZonotopeBelief(b) => AnyBelief::ZonotopeBelief(zonotope(b.set())?.into()),
        AnyBelief::ConstrainedBelief(b) => {
            let z = zonotope(b.set().zonotope())?;
            let (a, b) = (b.set().a().clone(), b.set().b().to_vec());
            let set = ConstrainedZonotope::new(z.c().to_vec(), z.g().clone(), a, b)?;
            AnyBelief::ConstrainedBelief(set.into())
        }
        other => return Err(format!("no zonotope: {:?}", other.shape().kind).into()),
    })
}

fn widths(belief: &AnyBelief) -> Result<Vec<f64>, Failure> {
    let hull = belief.interval_hull().ok_or("expected a bounded set")?;
    Ok(hull.iter().map(|side| side.hi() - side.lo()).collect())
}

/// The greatest |a/b − 1| of two lists of widths, at least `most`.
fn compare(most: f64, a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(most, |m, (a, b)| m.max((a / b - 1.0).abs()))
}

fn run(problem: &Problem, settings: &str, u: &[Vec<f64>], y: &[Vec<f64>]) -> Result<(), Failure> {
    let e = AnyEstimator::new(&serde_json::from_str(settings)?, problem)?;
    let (mut whole, mut without) = (e.prior(), bare(&e.prior())?);
    let (mut share, mut all, mut sum, mut n) = (0.0, 0.0, 0.0, 0.0);
    for (k, y) in y.iter().enumerate() {
        let y: Vec<Option<f64>> = y.iter().copied().map(Some).collect();
        let (before, now) = (&u[k.max(1) - 1], &u[k]);
        if k > 0 {
            whole = e.predict(k, &e.reduce_order(k - 1, whole)?, before)?;
            without = bare(&e.predict(k, &e.reduce_order(k - 1, without)?, before)?)?;
            share = compare(share, &widths(&whole)?, &widths(&bare(&whole)?)?);
        }
        whole = e.update(k, &whole, now, &y)?;
        without = bare(&e.update(k, &without, now, &y)?)?;
        share = compare(share, &widths(&whole)?, &widths(&bare(&whole)?)?);
        all = compare(all, &widths(&whole)?, &widths(&without)?);
        for (a, b) in widths(&whole)?.iter().zip(&widths(&without)?) {
            (sum, n) = (sum + (a / b - 1.0), n + 1.0);
        }
    }
    println!(
        "{settings}: r and δ {share:.1e} of a width; runs differ by {all:.1e} at most, {:.1e} on average",
        sum / n
    );
    Ok(())
}

fn uniform(of: &Uncertain) -> Noise {
    Noise::Drawn(Drawn {
        law: Law::Uniform,
        of: of.clone(),
        truncate: false,
    })
}

fn centered(half: &[f64]) -> Result<Uncertain, Failure> {
    let minus: Vec<f64> = half.iter().map(|x| -x).collect();
    Ok(Uncertain::from_box(&minus, half)?)
}

fn main() -> Result<(), Failure> {
    let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]])?;
    let two_states = Problem {
        system: AnySystem::Raimondo(Raimondo::default()),
        prior: Uncertain::zonotope(vec![0.5, 0.5], g),
        w: centered(&[0.4; 2])?,
        v: centered(&[0.4; 2])?,
    };
    let truth = Truth {
        x0: InitialState::Point(vec![0.8, 0.65]),
        w: uniform(&two_states.w),
        v: uniform(&two_states.v),
        delta: None,
    };
    let path = simulate(
        &two_states.system,
        &truth,
        &Inputs::Constant(Vec::new()),
        20201,
        0,
        100,
    )?;
    println!("two states, 100 steps");
    for settings in [
        r#"{"kind": "zmv", "generators": 20}"#,
        r#"{"kind": "czmv", "generators": 20, "constraints": 5}"#,
    ] {
        run(&two_states, settings, &path.u, &path.y)?;
    }

    let pi = std::f64::consts::PI;
    let mut prior = vec![2.0, 2.0, 2.0, 1.0, 1.0, 1.0, pi / 6.0, pi / 6.0, pi / 2.0];
    prior.extend([pi / 12.0; 3]);
    let (angle, rate) = (2.618e-3, 16.558e-3);
    let quadrotor = Problem {
        system: AnySystem::Quadrotor(Quadrotor::published()),
        prior: centered(&prior)?,
        w: centered(&[1.0; 3])?,
        v: centered(&[0.15, 0.15, 0.51, angle, angle, angle, rate, rate, rate])?,
    };
    let mut x0 = vec![0.0; 12];
    (x0[0], x0[2], x0[8]) = (0.5, 1.0, pi / 3.0);
    let truth = Truth {
        x0: InitialState::Point(x0),
        w: uniform(&quadrotor.w),
        v: uniform(&quadrotor.v),
        delta: None,
    };
    let inputs = Inputs::Controller(Controller::FeedbackLinearising);
    let path = simulate(&quadrotor.system, &truth, &inputs, 1, 0, 100)?;
    println!("quadrotor, 100 steps");
    for settings in [
        r#"{"kind": "zmv", "generators": 40}"#,
        r#"{"kind": "czmv", "generators": 40, "constraints": 12}"#,
    ] {
        run(&quadrotor, settings, &path.u, &path.y)?;
    }
    Ok(())
}
