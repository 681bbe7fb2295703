//! Systems from the literature, written as equations: every guaranteed estimator that takes one holds the state in every step,
//! with noise on the vertices of its boxes.

use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise, simulate};
use zonobench_estimation::system::System;
use zonobench_estimation::systems::Equations;
use zonobench_estimation::systems::equations::{Method, Motion, Named, Source, Texts};
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings, Inputs,
    Problem, Truth, Uncertain, track,
};
use zonobench_sets::{Containment, Interval};

/// A system, and half-widths around the middle of its prior and of its noises.
struct Case {
    name: &'static str,
    source: Source,
    middle: Vec<f64>,
    prior: f64,
    w: f64,
    v: f64,
}

fn names(text: &str) -> Named {
    text.split_whitespace()
        .map(|name| (name.to_owned(), "1".to_owned()))
        .collect()
}

fn texts(pairs: &[(&str, &str)]) -> Texts {
    pairs
        .iter()
        .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
        .collect()
}

fn parameters(pairs: &[(&str, f64)]) -> Vec<(String, f64)> {
    pairs
        .iter()
        .map(|(name, value)| ((*name).to_owned(), *value))
        .collect()
}

/// x⁺ for `next`, one noise a state w1 …, outputs with noises v1 ….
fn source(
    x: &str,
    values: &[(&str, f64)],
    lets: &[(&str, &str)],
    next: &[(&str, &str)],
    output: &[(&str, &str)],
) -> Source {
    let numbered = |prefix: &str, n: usize| {
        names(&(1..=n).map(|i| format!("{prefix}{i} ")).collect::<String>())
    };
    let outputs: Vec<String> = output.iter().map(|(name, _)| (*name).to_owned()).collect();
    Source {
        x: names(x),
        u: Named::new(),
        w: numbered("w", next.len()),
        y: names(&outputs.join(" ")),
        v: numbered("v", output.len()),
        parameters: parameters(values),
        definitions: texts(lets),
        motion: Motion::Next(texts(next)),
        output: texts(output),
        period: Some(0.1),
    }
}

fn with_rate(mut source: Source, method: Method, substeps: usize, period: f64) -> Source {
    let Motion::Next(equations) = source.motion else {
        panic!("it has next")
    };
    source.motion = Motion::Rate {
        equations,
        method,
        substeps,
    };
    source.period = Some(period);
    source
}

/// [Strogatz2015] for the oscillators and populations, [Bequette1998] for the reactor, [Plett2015] for the battery.
fn cases() -> Vec<Case> {
    vec![
        Case {
            name: "pendulum with drag, its distance from a point",
            source: source(
                "phi omega",
                &[("T", 0.02), ("drag", 0.1)],
                &[("a", "-9.81*sin(phi) - drag*omega")],
                &[("phi", "phi + T*omega + w1"), ("omega", "omega + T*a + w2")],
                &[("range", "hypot(2 - sin(phi), cos(phi)) + v1")],
            ),
            middle: vec![0.3, 0.0],
            prior: 0.05,
            w: 0.001,
            v: 0.01,
        },
        Case {
            name: "pendulum whose angle is measured",
            source: source(
                "phi omega",
                &[("T", 0.02), ("drag", 0.1)],
                &[("a", "-9.81*sin(phi) - drag*omega*abs(omega + 9)")],
                &[("phi", "phi + T*omega + w1"), ("omega", "omega + T*a + w2")],
                &[("angle", "0.7*phi + v1")],
            ),
            middle: vec![0.3, 0.0],
            prior: 0.05,
            w: 0.001,
            v: 0.01,
        },
        Case {
            name: "two tanks in a row",
            source: with_rate(
                source(
                    "h1 h2",
                    &[("c", 0.02)],
                    &[],
                    &[
                        ("h1", "0.03 - c*sqrt(h1) + w1"),
                        ("h2", "c*sqrt(h1) - c*sqrt(h2) + w2"),
                    ],
                    &[("y1", "h1 + v1"), ("y2", "h2 + v2")],
                ),
                Method::Rk4,
                1,
                1.0,
            ),
            middle: vec![1.5, 1.2],
            prior: 0.1,
            w: 0.001,
            v: 0.02,
        },
        Case {
            name: "Lotka and Volterra's prey and predators, in logarithms",
            source: with_rate(
                source(
                    "a b",
                    &[],
                    &[],
                    &[("a", "1 - 0.5*exp(b) + w1"), ("b", "0.4*exp(a) - 0.8 + w2")],
                    &[("prey", "a + v1")],
                ),
                Method::Heun,
                1,
                0.05,
            ),
            middle: vec![0.6, 0.6],
            prior: 0.05,
            w: 0.01,
            v: 0.02,
        },
        Case {
            name: "SIR epidemic",
            source: with_rate(
                source(
                    "s i",
                    &[("beta", 0.4), ("gamma", 0.1)],
                    &[("new", "beta*s*i")],
                    &[("s", "-new + w1"), ("i", "new - gamma*i + w2")],
                    &[("cases", "i + v1")],
                ),
                Method::Euler,
                2,
                0.5,
            ),
            middle: vec![0.9, 0.05],
            prior: 0.01,
            w: 0.0002,
            v: 0.003,
        },
        Case {
            name: "stirred tank reactor",
            source: source(
                "c T",
                &[("dt", 0.02)],
                &[("rate", "7.2*exp(10 - 10/T)*c*0.01")],
                &[
                    ("c", "c + dt*(1 - c - rate) + w1"),
                    ("T", "T + dt*(1 - T + 0.3*rate + 0.2*(0.9 - T)) + w2"),
                ],
                &[("temperature", "T + v1")],
            ),
            middle: vec![0.9, 0.95],
            prior: 0.02,
            w: 0.0005,
            v: 0.002,
        },
        Case {
            name: "Duffing's oscillator with a drive",
            source: source(
                "x s",
                &[("T", 0.05)],
                &[("a", "x - x^3 - 0.2*s + 0.3*cos(1.2*t)")],
                &[("x", "x + T*s + w1"), ("s", "s + T*a + w2")],
                &[("y", "x + v1")],
            ),
            middle: vec![1.0, 0.0],
            prior: 0.05,
            w: 0.002,
            v: 0.02,
        },
        Case {
            name: "Lorenz's flow",
            source: with_rate(
                source(
                    "x y z",
                    &[],
                    &[],
                    &[
                        ("x", "10*(y - x) + w1"),
                        ("y", "x*(28 - z) - y + w2"),
                        ("z", "x*y - 8/3*z + w3"),
                    ],
                    &[("a", "x + v1"), ("b", "z + v2")],
                ),
                Method::Rk4,
                1,
                0.01,
            ),
            middle: vec![-5.0, -6.0, 22.0],
            prior: 0.2,
            w: 0.05,
            v: 0.1,
        },
        Case {
            name: "battery: charge and a diffusion voltage, the voltage at the terminals",
            source: source(
                "z d",
                &[("T", 1.0)],
                &[("ocv", "3.5 + 0.3*z + 0.05*ln(z) - 0.04*ln(1 - z)")],
                &[("z", "z - T*0.0005 + w1"), ("d", "0.95*d + 0.05*0.02 + w2")],
                &[("volts", "ocv - d + v1")],
            ),
            middle: vec![0.7, 0.01],
            prior: 0.02,
            w: 0.0001,
            v: 0.005,
        },
        Case {
            name: "bicycle, range and bearing of a landmark",
            source: source(
                "px py theta",
                &[("T", 0.1), ("speed", 2.0), ("steer", 0.1)],
                &[("dx", "20 - px"), ("dy", "5 - py")],
                &[
                    ("px", "px + T*speed*cos(theta) + w1"),
                    ("py", "py + T*speed*sin(theta) + w2"),
                    ("theta", "theta + T*speed*tan(steer)/1.5 + w3"),
                ],
                &[
                    ("range", "hypot(dx, dy) + v1"),
                    ("bearing", "atan2(dy, dx) - theta + v2"),
                ],
            ),
            middle: vec![0.0, 0.0, 0.1],
            prior: 0.05,
            w: 0.002,
            v: 0.02,
        },
    ]
}

fn box_of(center: &[f64], radius: f64) -> Uncertain {
    let (lower, upper): (Vec<f64>, Vec<f64>) =
        center.iter().map(|c| (c - radius, c + radius)).unzip();
    Uncertain::from_box(&lower, &upper).unwrap()
}

fn at_vertices(of: &Uncertain) -> Noise {
    Noise::Drawn(Drawn {
        law: Law::Vertices,
        of: of.clone(),
        truncate: false,
    })
}

/// The guaranteed estimators.
const ESTIMATORS: [&str; 7] = [
    r#"{"kind": "zmv", "generators": 12}"#,
    r#"{"kind": "zfo", "generators": 12}"#,
    r#"{"kind": "czmv", "generators": 12, "constraints": 3}"#,
    r#"{"kind": "czfo", "generators": 12, "constraints": 3, "expansion": "lean"}"#,
    r#"{"kind": "lift"}"#,
    r#"{"kind": "d-rrsr"}"#,
    r#"{"kind": "rrsr"}"#,
];

#[test]
fn every_estimator_that_takes_a_system_of_equations_holds_its_state_under_vertex_noise() {
    let steps = 10;
    for case in cases() {
        let system =
            Equations::new(case.source).unwrap_or_else(|fault| panic!("{}: {fault}", case.name));
        let (n, m) = (case.middle.len(), system.variables().y.len());
        let prior = box_of(&case.middle, case.prior);
        let (w, v) = (box_of(&vec![0.0; n], case.w), box_of(&vec![0.0; m], case.v));
        let truth = Truth {
            x0: InitialState::Drawn(prior.clone()),
            w: at_vertices(&w),
            v: at_vertices(&v),
            delta: None,
        };
        let problem = Problem::new(AnySystem::Equations(system), prior, w, v).unwrap();
        let mut judged = 0;
        for json in ESTIMATORS {
            let settings: EstimatorSettings = serde_json::from_str(json).unwrap();
            let estimator = AnyEstimator::new(&settings, &problem)
                .unwrap_or_else(|error| panic!("{}: {json}: {error}", case.name));
            assert!(estimator.guaranteed(), "{json}");
            for run in 0..3 {
                let one = simulate(
                    &problem.system,
                    &truth,
                    &Inputs::Constant(vec![]),
                    7,
                    run,
                    steps,
                )
                .unwrap();
                let y: Vec<Vec<Option<f64>>> = one
                    .y
                    .iter()
                    .map(|y| y.iter().copied().map(Some).collect())
                    .collect();
                for step in track(&estimator, steps, &one.u, &y) {
                    let place = format!("{}: {json}, run {run}, k = {}", case.name, step.k);
                    let updated = match step.updated {
                        Ok(updated) => updated,
                        // Second derivatives do not exist over a kink; that is said, and nothing is claimed.
                        Err(EstimationError::Inconsistent { .. }) => {
                            panic!("{place}: called empty")
                        }
                        Err(_) => break,
                    };
                    let enclosed = one.x[step.k].iter().zip(&one.rounding[step.k]);
                    let x: Vec<Interval> = enclosed
                        .map(|(&x, &r)| Interval::from_center_radius(x, r))
                        .collect();
                    for belief in step.predicted.iter().chain([&updated]) {
                        assert_ne!(belief.contains(&x), Containment::Outside, "{place}");
                        judged += 1;
                    }
                }
            }
        }
        // Two sets a step of three runs: at least three of the estimators come to the end.
        assert!(judged >= 3 * 3 * 2 * steps, "{}: {judged} sets", case.name);
    }
}

#[test]
fn a_measurement_whose_coefficient_is_an_input_is_read_with_the_input_of_its_step() {
    // y = u x + v: at u = 0, where the derivative is taken first, y says nothing of x.
    let mut source = source("x", &[], &[], &[("x", "x/2 + w1")], &[("y", "u*x + v1")]);
    source.u = names("u");
    let one = |r: f64| Uncertain::from_box(&[-r], &[r]).unwrap();
    let problem = Problem {
        system: AnySystem::Equations(Equations::new(source).unwrap()),
        prior: one(1.0),
        w: one(0.1),
        v: one(0.01),
    };
    for kind in [
        r#"{"kind": "zmv", "generators": 8}"#,
        r#"{"kind": "czmv", "generators": 8, "constraints": 2}"#,
        r#"{"kind": "czfo", "generators": 8, "constraints": 2}"#,
    ] {
        let settings: EstimatorSettings = serde_json::from_str(kind).unwrap();
        let filter = AnyEstimator::new(&settings, &problem).unwrap();
        let mut x = 0.75;
        let (inputs, mut xs, mut ys) = ([2.0, -4.0, 0.0, 0.7], Vec::new(), Vec::new());
        for u in inputs {
            ys.push(vec![Some(u * x)]);
            xs.push(x);
            x /= 2.0;
        }
        let u: Vec<Vec<f64>> = inputs.iter().map(|&u| vec![u]).collect();
        for step in track(&filter, 3, &u, &ys) {
            match step.updated {
                Ok(belief) => {
                    let at = [Interval::point(xs[step.k])];
                    assert_ne!(belief.contains(&at), Containment::Outside, "{kind}");
                    let width = belief.interval_hull().unwrap()[0].width();
                    assert!(step.k > 0 || width < 0.011, "{kind}: {width}");
                }
                Err(error) => assert!(
                    matches!(error, EstimationError::Refused { .. }),
                    "{kind}: {error}"
                ),
            }
        }
    }
}
