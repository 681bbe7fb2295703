//! Measurements that are not linear, taken in by their mean value form: nothing is lost, what cannot be expanded is left out, and
//! a second look is no wider.

use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise, simulate};
use zonobench_estimation::systems::equations::{Motion, Source, Texts};
use zonobench_estimation::systems::{Equations, Unicycle};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimationError, Estimator, Inputs, Problem,
    System, Truth, Uncertain, track,
};
use zonobench_sets::{Containment, Interval, Matrix};

const ZMV: &str = r#"{"kind": "zmv", "generators": 12}"#;
const ZFO: &str = r#"{"kind": "zfo", "generators": 12}"#;
const CZMV: &str = r#"{"kind": "czmv", "generators": 12, "constraints": 3}"#;
const CZFO: &str = r#"{"kind": "czfo", "generators": 12, "constraints": 3, "expansion": "lean"}"#;

/// The same settings with another look at every measurement.
fn twice(settings: &str) -> String {
    settings.replace('}', r#", "measurement": {"passes": 2}}"#)
}

/// The four, with one pass and with two.
fn all() -> Vec<String> {
    let once = [ZMV, ZFO, CZMV, CZFO];
    once.iter()
        .map(|s| (*s).to_owned())
        .chain(once.iter().map(|s| twice(s)))
        .collect()
}

fn texts(pairs: &[(&str, &str)]) -> Texts {
    pairs
        .iter()
        .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
        .collect()
}

/// States `x`, noises `w` and `v`; of each step the input `u`.
fn equations(
    x: &str,
    w: &str,
    v: &str,
    next: &[(&str, &str)],
    output: &[(&str, &str)],
) -> Equations {
    let named = |names: &str| {
        names
            .split_whitespace()
            .map(|name| (name.to_owned(), "1".to_owned()))
            .collect()
    };
    let y: Vec<&str> = output.iter().map(|(name, _)| *name).collect();
    Equations::new(Source {
        x: named(x),
        u: Vec::new(),
        w: named(w),
        y: named(&y.join(" ")),
        v: named(v),
        parameters: Vec::new(),
        definitions: Texts::new(),
        motion: Motion::Next(texts(next)),
        output: texts(output),
        period: Some(0.1),
    })
    .unwrap_or_else(|fault| panic!("{fault}"))
}

fn box_of(bounds: &[(f64, f64)]) -> Uncertain {
    let (lower, upper): (Vec<f64>, Vec<f64>) = bounds.iter().copied().unzip();
    Uncertain::from_box(&lower, &upper).unwrap()
}

fn around(center: &[f64], radius: &[f64]) -> Uncertain {
    let both = center.iter().zip(radius);
    box_of(&both.map(|(c, r)| (c - r, c + r)).collect::<Vec<_>>())
}

fn filter(settings: &str, problem: &Problem) -> AnyEstimator {
    AnyEstimator::new(&serde_json::from_str(settings).unwrap(), problem).unwrap()
}

/// x in [1, 3] seen as y = x² + v with |v| ≤ 0.1.
fn square() -> Problem {
    Problem {
        system: AnySystem::Equations(equations(
            "x",
            "w",
            "v",
            &[("x", "x + w")],
            &[("y", "x^2 + v")],
        )),
        prior: box_of(&[(1.0, 3.0)]),
        w: box_of(&[(-0.1, 0.1)]),
        v: box_of(&[(-0.1, 0.1)]),
    }
}

#[test]
fn the_strip_of_a_square_by_hand() {
    let hull = |settings: &str| {
        let filter = filter(settings, &square());
        let updated = filter
            .update(0, &filter.prior(), &[], &[Some(4.0)])
            .unwrap();
        let hull = updated.interval_hull().unwrap();
        (hull[0].lo(), hull[0].hi())
    };
    // J = [2, 6] over [1, 3] and h(2) = 4: 4 (x − 2) = ±2·1 ± 0.1.
    let once = 2.1 / 4.0;
    // Over 2 ± 0.525: J = 4 ± 1.05, 4 (x − 2) = ±1.05·0.525 ± 0.1.
    let again = (1.05 * 0.525 + 0.1) / 4.0;
    for settings in [ZMV, ZFO, CZMV, CZFO] {
        for (settings, radius) in [(settings.to_owned(), once), (twice(settings), again)] {
            let (lo, hi) = hull(&settings);
            // Rounding and nothing else.
            assert!((lo - (2.0 - radius)).abs() < 1e-12, "{settings}: {lo}");
            assert!((hi - (2.0 + radius)).abs() < 1e-12, "{settings}: {hi}");
        }
    }
}

#[test]
fn a_measurement_that_no_state_of_the_set_has_is_inconsistent() {
    for settings in all() {
        let filter = filter(&settings, &square());
        for y in [-5.0, 12.0, -1e300] {
            let updated = filter.update(3, &filter.prior(), &[], &[Some(y)]);
            let error = updated.map(|_| ()).unwrap_err();
            assert_eq!(
                error,
                EstimationError::Inconsistent { k: 3 },
                "{settings}: {y}"
            );
        }
    }
}

#[test]
fn passes_are_one_or_two() {
    for passes in [0, 3] {
        let settings = ZMV.replace(
            '}',
            &format!(r#", "measurement": {{"passes": {passes}}}}}"#),
        );
        let settings = serde_json::from_str(&settings).unwrap();
        let error = AnyEstimator::new(&settings, &square()).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("zmv: `measurement.passes` must be 1 or 2, got {passes}")
        );
    }
}

/// Points with few digits, so that y is the exact value of h: no bound is given away, every corner is tried, and the noise's center
/// is not 0.
#[test]
fn no_corner_of_the_state_and_the_noise_is_lost() {
    let system = AnySystem::Equations(equations(
        "a b",
        "w1 w2",
        "v1 v2",
        &[("a", "a + w1"), ("b", "b + w2")],
        &[
            ("y1", "a^2 - b*v1 + v2"),
            ("y2", "a*b + abs(a) + v2^2"),
            ("y3", "max(a, 2*b) - v1*v2"),
        ],
    ));
    let mut draws = Draws::new(11, Purpose::X0, 0);
    let mut judged = 0;
    for case in 0..60 {
        // Multiples of 2⁻⁸ up to 4, and widths from 2⁻⁸ to 2: every product of three of them is a f64.
        let mut draw = |i: usize| (draws.uniform(case, i, 0) * 1024.0).round() / 256.0;
        let center: Vec<f64> = (0..4).map(&mut draw).collect();
        let scale = [1.0, 0.25, 1.0 / 64.0][case % 3];
        let radius: Vec<f64> = (4..8)
            .map(|i| ((draw(i).abs() * scale * 128.0).round() + 1.0) / 256.0)
            .collect();
        let problem = Problem {
            system: system.clone(),
            prior: around(&center[..2], &radius[..2]),
            w: box_of(&[(-0.1, 0.1); 2]),
            v: around(&center[2..], &radius[2..]),
        };
        let filters: Vec<AnyEstimator> = all().iter().map(|s| filter(s, &problem)).collect();
        for corner in 0..16 {
            let sign = |i: usize| if corner >> i & 1 == 1 { 1.0 } else { -1.0 };
            let z: Vec<f64> = (0..4).map(|i| center[i] + sign(i) * radius[i]).collect();
            let (x, v) = z.split_at(2);
            let mut y = [0.0; 3];
            system.h(0, x, &[], v, &mut y);
            let of = |mask: usize| -> Vec<Option<f64>> {
                (0..3)
                    .map(|i| (mask >> i & 1 == 1).then_some(y[i]))
                    .collect()
            };
            for (filter, settings) in filters.iter().zip(all()) {
                for mask in [0b111, 1 + corner % 7] {
                    let updated = filter.update(0, &filter.prior(), &[], &of(mask));
                    let updated = updated.unwrap_or_else(|e| panic!("{case}: {settings}: {e}"));
                    let at = [Interval::point(x[0]), Interval::point(x[1])];
                    assert_ne!(
                        updated.contains(&at),
                        Containment::Outside,
                        "{case}: {settings}"
                    );
                    assert!(
                        updated.interval_hull().unwrap().contains(x),
                        "{case}: {settings}"
                    );
                    judged += 1;
                }
            }
        }
    }
    assert_eq!(judged, 60 * 16 * 8 * 2);
}

/// A unicycle that circles around a beacon, 0.05 rad a step: its azimuth jumps by 2π once a turn.
fn around_a_beacon() -> Problem {
    let quarter = core::f64::consts::FRAC_PI_2;
    Problem {
        system: AnySystem::Equations(equations(
            "px py theta",
            "w1 w2 w3",
            "v1 v2",
            &[
                ("px", "px + 0.2*cos(theta) + w1"),
                ("py", "py + 0.2*sin(theta) + w2"),
                ("theta", "theta + 0.05 + w3"),
            ],
            &[
                ("range", "hypot(px, py) + v1"),
                ("azimuth", "atan2(py, px) + v2"),
            ],
        )),
        prior: around(&[4.0, 0.0, quarter], &[0.3, 0.3, 0.1]),
        w: around(&[0.0; 3], &[0.005, 0.005, 0.002]),
        v: around(&[0.01, -0.005], &[0.05, 0.02]),
    }
}

/// A pendulum whose distance from a point is measured.
fn pendulum() -> Problem {
    Problem {
        system: AnySystem::Equations(equations(
            "phi omega",
            "w1 w2",
            "v",
            &[
                ("phi", "phi + 0.05*omega + w1"),
                ("omega", "omega - 0.05*(9.81*sin(phi) + 0.3*omega) + w2"),
            ],
            &[("range", "hypot(2 - sin(phi), cos(phi)) + v")],
        )),
        prior: around(&[0.3, 0.0], &[0.1, 0.1]),
        w: around(&[0.0; 2], &[0.0005, 0.002]),
        v: around(&[0.0], &[0.01]),
    }
}

/// The landmarks of the unicycle in Rust, ahead of it for thirty steps.
fn landmarks() -> Problem {
    Problem {
        system: AnySystem::Unicycle(
            Unicycle::new(1.0, 0.3, 0.15, vec![[5.0, 15.0], [15.0, 15.0]]).unwrap(),
        ),
        prior: around(&[0.1, 0.2, 0.3], &[0.05, 0.05, 0.1]),
        w: box_of(&[(-0.06, 0.04), (-0.04, 0.02), (-0.08, 0.04)]),
        v: box_of(&[(-0.01, 0.01), (-0.01, 0.02), (-0.02, 0.01), (-0.03, 0.02)]),
    }
}

/// What a track of some runs was.
#[derive(Debug, Default)]
struct Seen {
    /// Beliefs that were judged.
    judged: usize,
    /// Measured components that were left out.
    left_out: usize,
    /// The sum of the radii of updated sets.
    radius: f64,
}

fn judge(
    settings: &str,
    problem: &Problem,
    law: Law,
    runs: u64,
    steps: usize,
    missing: bool,
) -> Seen {
    let drawn = |of: &Uncertain| {
        Noise::Drawn(Drawn {
            law,
            of: of.clone(),
            truncate: false,
        })
    };
    let truth = Truth {
        x0: InitialState::Drawn(problem.prior.clone()),
        w: drawn(&problem.w),
        v: drawn(&problem.v),
        delta: None,
    };
    let estimator = filter(settings, problem);
    assert!(estimator.guaranteed());
    let mut seen = Seen::default();
    for run in 0..runs {
        let inputs = Inputs::Constant(vec![]);
        let one = simulate(&problem.system, &truth, &inputs, 5, run, steps).unwrap();
        let measured = |(k, y): (usize, &Vec<f64>)| {
            let there = |i: usize| !(missing && (k + i).is_multiple_of(3));
            let both = y.iter().enumerate();
            both.map(|(i, &y)| there(i).then_some(y)).collect()
        };
        let y: Vec<Vec<Option<f64>>> = one.y.iter().enumerate().map(measured).collect();
        for step in track(&estimator, steps, &one.u, &y) {
            let place = format!("{settings}, run {run}, k = {}", step.k);
            let updated: AnyBelief = step.updated.unwrap_or_else(|e| panic!("{place}: {e}"));
            let enclosed = one.x[step.k].iter().zip(&one.rounding[step.k]);
            let x: Vec<Interval> = enclosed
                .map(|(&x, &r)| Interval::from_center_radius(x, r))
                .collect();
            seen.left_out += updated.left_out().len();
            seen.radius += updated.size().radius.unwrap();
            for belief in step.predicted.iter().chain([&updated]) {
                assert_ne!(belief.contains(&x), Containment::Outside, "{place}");
                seen.judged += 1;
            }
        }
    }
    seen
}

#[test]
fn the_state_is_not_lost_under_noise_on_vertices() {
    for (problem, steps) in [
        (around_a_beacon(), 130),
        (pendulum(), 60),
        (landmarks(), 10),
    ] {
        for settings in all() {
            for missing in [false, true] {
                let seen = judge(&settings, &problem, Law::Vertices, 2, steps, missing);
                assert_eq!(seen.judged, 2 * 2 * (steps + 1), "{settings}");
            }
        }
    }
}

/// The azimuth jumps where the set crosses the negative axis: there the range alone is read, and the filter goes on.
#[test]
fn an_azimuth_is_left_out_where_it_jumps_and_only_there() {
    for settings in all() {
        let seen = judge(&settings, &around_a_beacon(), Law::Vertices, 6, 130, false);
        // Six runs of one turn with steps of 0.2 m, and a set about a quarter of that lies across the axis.
        assert!((1..30).contains(&seen.left_out), "{settings}: {seen:?}");
        let seen = judge(&settings, &pendulum(), Law::Vertices, 2, 60, false);
        assert_eq!(seen.left_out, 0, "{settings}");
    }
}

#[test]
fn a_set_that_reaches_the_sensor_leaves_the_azimuth_out() {
    let mut problem = around_a_beacon();
    problem.prior = box_of(&[(-1.0, 1.0), (-0.5, 1.0), (0.0, 0.1)]);
    for settings in all() {
        let filter = filter(&settings, &problem);
        let before = filter.prior();
        let after = filter.update(0, &before, &[], &[None, Some(3.0)]).unwrap();
        assert_eq!(after.left_out(), [1], "{settings}");
        let at = [-0.5, -0.5 * libm::tan(3.0), 0.05].map(Interval::point);
        assert_ne!(after.contains(&at), Containment::Outside, "{settings}");
        let after = filter.update(0, &before, &[], &[None, None]).unwrap();
        assert_eq!(after.interval_hull(), before.interval_hull(), "{settings}");
        assert!(after.left_out().is_empty());
    }
}

/// Distances that are f64s exactly, from a sensor that lies in the set, and the noise on its ends.
#[test]
fn a_hull_around_a_sensor_is_narrowed_and_loses_nobody() {
    let system = AnySystem::Equations(equations(
        "px py",
        "w1 w2",
        "v",
        &[("px", "px + w1"), ("py", "py + w2")],
        &[("range", "sqrt(px^2 + py^2) + v")],
    ));
    for width in [6.0, 40.0, 1e6, 1e15] {
        let problem = Problem {
            system: system.clone(),
            prior: box_of(&[(-width, 0.75 * width), (-0.875 * width, width)]),
            w: box_of(&[(-0.1, 0.1); 2]),
            v: box_of(&[(-0.0625, 0.0625)]),
        };
        for (x, v) in [
            ([3.0, 4.0], 0.0625),
            ([-4.0, 3.0], -0.0625),
            ([0.0, -5.0], 0.0625),
        ] {
            for settings in all() {
                let filter = filter(&settings, &problem);
                let updated = filter
                    .update(0, &filter.prior(), &[], &[Some(5.0 + v)])
                    .unwrap();
                let hull = updated.interval_hull().unwrap();
                assert!(hull.contains(&x), "{settings}: {hull:?}");
                assert_eq!(updated.left_out(), [0], "{settings}");
                // Slices of a sixteenth of 2 (5 + 0.125) and less are not cut off.
                let tight = settings.contains("cz") && width < 100.0;
                assert!(
                    !tight || hull.iter().all(|side| side.mag() < 6.0),
                    "{settings}: {hull:?}"
                );
            }
        }
        let filter = filter(CZMV, &problem);
        let updated = filter.update(1, &filter.prior(), &[], &[Some(-1.0)]);
        assert_eq!(
            updated.map(|_| ()).unwrap_err(),
            EstimationError::Inconsistent { k: 1 }
        );
    }
}

#[test]
fn a_second_look_is_tighter() {
    for (problem, steps) in [(around_a_beacon(), 130), (pendulum(), 60)] {
        for settings in [ZMV, CZMV] {
            let once = judge(settings, &problem, Law::Vertices, 2, steps, false).radius;
            let again = judge(&twice(settings), &problem, Law::Vertices, 2, steps, false).radius;
            println!("{settings}: {once} {again}");
            // Reduced to as many generators afterwards, so not tighter by law.
            assert!(again < once, "{settings}: {once} {again}");
        }
    }
}

/// x and |x| agree right of 0, where every derivative of both is 1: what is linear over one box is not over every one.
#[test]
fn a_measurement_that_is_linear_near_zero_alone_is_not_taken_for_linear() {
    for (output, x) in [
        ("max(x, -2) + v", -5.0),
        ("min(x, 2) + v", 5.0),
        ("abs(x + 2) + v", -5.0),
    ] {
        let system = equations("x", "w", "v", &[("x", "x + w")], &[("y", output)]);
        let problem = Problem {
            system: AnySystem::Equations(system),
            prior: box_of(&[(-6.0, 6.0)]),
            w: box_of(&[(-0.1, 0.1)]),
            v: box_of(&[(-0.125, 0.125)]),
        };
        let mut y = [0.0];
        problem.system.h(0, &[x], &[], &[0.0], &mut y);
        for settings in all() {
            let filter = filter(&settings, &problem);
            let updated = filter
                .update(0, &filter.prior(), &[], &[Some(y[0])])
                .unwrap();
            assert!(
                updated.interval_hull().unwrap().contains(&[x]),
                "{settings}: {output}"
            );
        }
    }
}

/// The rows share one noise: with v in both, y1 − y2 holds none.
#[test]
fn rows_of_a_constrained_zonotope_share_their_noise() {
    let system = equations(
        "a b",
        "w",
        "v",
        &[("a", "a + w"), ("b", "b")],
        &[("y1", "0.1*0.3*a + v"), ("y2", "0.1*0.3*b + v")],
    );
    let problem = Problem {
        system: AnySystem::Equations(system),
        prior: Uncertain::zonotope(vec![0.0; 2], Matrix::diagonal(&[100.0, 0.25])),
        w: box_of(&[(-0.1, 0.1)]),
        v: box_of(&[(-1.0, 1.0)]),
    };
    let width = |settings: &str| {
        let filter = filter(settings, &problem);
        let y = [Some(0.0), Some(0.0)];
        let updated = filter.update(0, &filter.prior(), &[], &y).unwrap();
        updated.interval_hull().unwrap()[0].width()
    };
    // |a − b| = 0 against |a| ≤ 1/0.03; both but for rounding.
    assert!((width(CZMV) - 0.5).abs() < 1e-9, "{}", width(CZMV));
    assert!((width(ZMV) - 2.0 / 0.03).abs() < 1e-9, "{}", width(ZMV));
}

/// The same vehicle from behind the jump to before it, so that the bundle's filters, which end there, are not in its way.
fn along_an_arc() -> Problem {
    let azimuth: f64 = -2.5;
    let heading = azimuth + core::f64::consts::FRAC_PI_2;
    let start = [4.0 * libm::cos(azimuth), 4.0 * libm::sin(azimuth), heading];
    Problem {
        prior: around(&start, &[0.3, 0.3, 0.1]),
        ..around_a_beacon()
    }
}

/// Prints a table; `cargo test -p zonobench-estimation --test nonlinear_measurements -- --ignored --nocapture`.
#[test]
#[ignore = "minutes"]
fn nobody_is_lost_in_200_runs_of_200_steps() {
    for (name, problem) in [("beacon", around_a_beacon()), ("pendulum", pendulum())] {
        for settings in all() {
            for law in [Law::Vertices, Law::Uniform] {
                let seen = judge(&settings, &problem, law, 200, 200, false);
                println!("{name}: {settings}: {seen:?}");
                assert_eq!(seen.judged, 2 * 200 * 201);
            }
        }
    }
}

/// Prints a table.
#[test]
#[ignore = "a minute"]
fn radii_beside_those_of_the_bundle() {
    let others = [
        r#"{"kind": "lift"}"#,
        r#"{"kind": "d-rrsr"}"#,
        r#"{"kind": "rrsr"}"#,
    ];
    let (runs, steps) = (10, 95);
    for (name, problem) in [("arc", along_an_arc()), ("pendulum", pendulum())] {
        let settings = others.iter().map(|s| (*s).to_owned());
        for settings in all().into_iter().chain(settings) {
            let seen = judge(&settings, &problem, Law::Vertices, runs, steps, false);
            let mean = seen.radius / (runs as f64 * (steps as f64 + 1.0));
            println!(
                "{name}: {settings}: mean radius {mean:.4}, {} left out",
                seen.left_out
            );
        }
    }
}
