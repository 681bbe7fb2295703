//! A filter in a control loop of 100 Hz: a deadline, a fallback, measurements that come seldom.
//!
//! The quadrotor of [Rego2020, Sec. 5.2] flies its helix. A thread runs CZMV; the loop gives it the inputs and
//! measurements and waits for its set until the deadline. ZMV, some times cheaper, has been run in the loop
//! before, so that there is a set that holds the state also where CZMV is late; CZMV catches up by
//! itself, as it is faster than the loop. The position is measured at every tenth step only.
//!
//! `cargo run -p zonobench-estimation --example online -- [STEPS] [DEADLINE_US] [--paced]`; with `--paced` the
//! loop waits for the next period as a real one would, otherwise it runs as fast as it can.

use std::error::Error;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};
use zonobench_estimation::controller::Controller;
use zonobench_estimation::estimator::Containment;
use zonobench_estimation::signal::Signal;
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::systems::Quadrotor;
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, Inputs, Online, Problem, Truth, Uncertain, simulate,
};
use zonobench_sets::Interval;

/// Δt of the loop.
const PERIOD: Duration = Duration::from_millis(10);

/// Every how many steps the position is measured.
const GPS: usize = 10;

fn centered(half: &[f64]) -> Result<Uncertain, Box<dyn Error>> {
    let minus: Vec<f64> = half.iter().map(|x| -x).collect();
    Ok(Uncertain::from_box(&minus, half)?)
}

/// What the filters are told: X_0, W and V of the paper.
fn problem() -> Result<Problem, Box<dyn Error>> {
    let pi = std::f64::consts::PI;
    let (sixth, twelfth) = (pi / 6.0, pi / 12.0);
    let prior = [
        2.0,
        2.0,
        2.0,
        1.0,
        1.0,
        1.0,
        sixth,
        sixth,
        pi / 2.0,
        twelfth,
        twelfth,
        twelfth,
    ];
    let (angle, rate) = (2.618e-3, 16.558e-3);
    Ok(Problem {
        system: AnySystem::Quadrotor(Quadrotor::published()),
        prior: centered(&prior)?,
        w: centered(&[1.0; 3])?,
        v: centered(&[0.15, 0.15, 0.51, angle, angle, angle, rate, rate, rate])?,
    })
}

/// What happens: 1 N on [5, 15), [8, 15), [10, 15) s, and noise of the sensors.
fn truth(problem: &Problem) -> Result<Truth, Box<dyn Error>> {
    let mut x0 = vec![0.0; 12];
    (x0[0], x0[2], x0[8]) = (0.5, 1.0, std::f64::consts::FRAC_PI_3);
    let gust = |from: usize| -> Result<Vec<Signal>, Box<dyn Error>> {
        let json = format!(r#"[{{"kind": "pieces", "at": [{from}, 1500], "value": [0, 1, 0]}}]"#);
        Ok(serde_json::from_str(&json)?)
    };
    Ok(Truth {
        x0: InitialState::Point(x0),
        w: Noise::Signals {
            terms: vec![gust(500)?, gust(800)?, gust(1000)?],
            about: Some(vec![0.0; 3]),
        },
        v: Noise::Drawn(Drawn {
            law: Law::Uniform,
            of: problem.v.clone(),
            truncate: false,
        }),
        delta: None,
    })
}

/// Inputs since the last step and measurements now.
type Data = (Vec<f64>, Vec<Option<f64>>);

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let paced = arguments.iter().any(|a| a == "--paced");
    let mut numbers = arguments.iter().filter_map(|a| a.parse::<u64>().ok());
    let steps = numbers.next().unwrap_or(2000) as usize;
    let deadline = Duration::from_micros(numbers.next().unwrap_or(8000));

    let problem = problem()?;
    let inputs = Inputs::Controller(Controller::FeedbackLinearising);
    let flight = simulate(&problem.system, &truth(&problem)?, &inputs, 1, 0, steps)?;
    let filter = |json: &str| -> Result<Online<AnyEstimator>, Box<dyn Error>> {
        let estimator = AnyEstimator::new(&serde_json::from_str(json)?, &problem)?;
        Ok(Online::new(estimator))
    };
    let mut fallback = filter(r#"{"kind": "zmv", "generators": 40}"#)?;
    let mut main = filter(r#"{"kind": "czmv", "generators": 40, "constraints": 12}"#)?;

    let (to_filter, data) = mpsc::channel::<Data>();
    let (to_loop, sets) = mpsc::channel();
    let worker = thread::spawn(move || {
        for (u, y) in data {
            let begun = Instant::now();
            let belief = main.step(&u, &y).cloned();
            if to_loop.send((main.k(), begun.elapsed(), belief)).is_err() {
                break;
            }
        }
    });

    let (mut times, mut late, mut outside, mut width) = (Vec::new(), 0, 0, 0.0);
    let start = Instant::now();
    for k in 0..=steps {
        let tick = Instant::now();
        let u = if k == 0 {
            &flight.u[0]
        } else {
            &flight.u[k - 1]
        };
        let measured = |i: usize| i > 2 || k % GPS == 0;
        let y = flight.y[k].iter().enumerate();
        let y: Vec<Option<f64>> = y.map(|(i, &y)| measured(i).then_some(y)).collect();
        to_filter.send((u.clone(), y.clone()))?;
        let mut belief = fallback.step(u, &y)?.clone();
        // Sets of earlier steps, which were late, arrive first.
        let in_time = loop {
            let left = deadline.saturating_sub(tick.elapsed());
            match sets.recv_timeout(left) {
                Ok((of, took, set)) => {
                    times.push(took);
                    if of == k {
                        belief = set?;
                        break true;
                    }
                }
                Err(_) => break false,
            }
        };
        late += usize::from(!in_time);
        // Here the controller would use `belief`. The example asks whether it holds the truth.
        let state = flight.x[k].iter().zip(&flight.rounding[k]);
        let state: Vec<Interval> = state
            .map(|(&x, &r)| Interval::from_center_radius(x, r))
            .collect();
        outside += usize::from(belief.contains(&state) != Containment::Inside);
        let hull = belief.interval_hull().ok_or("a set without a hull")?;
        width += hull.rad().into_iter().fold(0.0, f64::max);
        if paced {
            thread::sleep((PERIOD * (k as u32 + 1)).saturating_sub(start.elapsed()));
        }
    }
    drop(to_filter);
    times.extend(sets.iter().map(|(_, took, _)| took));
    worker.join().map_err(|_| "the filter's thread failed")?;

    times.sort_unstable();
    let us = |t: Duration| t.as_secs_f64() * 1e6;
    let mean = times.iter().map(|&t| us(t)).sum::<f64>() / times.len() as f64;
    let quantile = |q: f64| us(times[((times.len() - 1) as f64 * q) as usize]);
    println!(
        "{} steps, {late} past the deadline of {deadline:?}",
        steps + 1
    );
    println!(
        "a step of CZMV: mean {mean:.0} us, median {:.0}, 99.9 % {:.0}, longest {:.0}",
        quantile(0.5),
        quantile(0.999),
        quantile(1.0)
    );
    println!(
        "mean radius {:.3}; steps without the state proved inside: {outside}",
        width / (steps + 1) as f64
    );
    Ok(())
}
