//! The polytopic filters never lose the truth, whatever the noise within its bounds, and LIFT is within all
//! others.

mod draws;

use draws::Draws;
use zonobench_estimation::estimators::PolytopeBelief;
use zonobench_estimation::systems::{Form, Linear, QuotientForm, Raimondo, Unicycle, VehicleSe2};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings,
    Problem, System, Uncertain, track,
};
use zonobench_sets::{Containment, Interval, Matrix};

/// Every kind and the variants that have their own code.
const METHODS: [&str; 12] = [
    r#"{"kind": "rrsr"}"#,
    r#"{"kind": "d-rrsr"}"#,
    r#"{"kind": "d-zb"}"#,
    r#"{"kind": "d-zb", "vectors": "signed", "jacobian": "decomposition"}"#,
    r#"{"kind": "d-cz"}"#,
    r#"{"kind": "d-cz", "choose": "all"}"#,
    r#"{"kind": "comb"}"#,
    r#"{"kind": "comb+"}"#,
    r#"{"kind": "lift"}"#,
    r#"{"kind": "lift", "start": "hull"}"#,
    r#"{"kind": "lift", "carry": "hull"}"#,
    r#"{"kind": "lift", "vectors": "paper", "choose": "argmin", "jacobian": "natural"}"#,
];

fn raimondo() -> Problem {
    let noise = |r: f64| Uncertain::from_box(&[-r; 2], &[r; 2]).unwrap();
    let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.1, 0.1, 0.0]]).unwrap();
    Problem {
        system: AnySystem::Raimondo(Raimondo {
            form: QuotientForm::Expanded,
            ..Raimondo::default()
        }),
        prior: Uncertain::zonotope(vec![0.5, 0.5], g),
        w: noise(0.1),
        v: noise(0.4),
    }
}

fn unicycle() -> Problem {
    let landmarks = vec![[5.0, 15.0], [15.0, 15.0]];
    Problem {
        system: AnySystem::Unicycle(Unicycle::new(1.0, 0.3, 0.15, landmarks).unwrap()),
        prior: Uncertain::from_box(&[0.05, 0.145, 0.8], &[0.15, 0.255, 1.2]).unwrap(),
        w: Uncertain::from_box(&[-0.06, -0.04, -0.08], &[0.04, 0.02, 0.04]).unwrap(),
        v: Uncertain::from_box(&[-0.01, -0.01, -0.02, -0.03], &[0.01, 0.02, 0.01, 0.02]).unwrap(),
    }
}

/// A number within the part's bounds, just inside them: room for the rounding of the trajectory.
fn drawn(part: &Uncertain, draws: &mut Draws, vertices: bool) -> Vec<f64> {
    let g = part.generator_matrix();
    let xi: Vec<f64> = (0..g.cols())
        .map(|_| {
            let inside = 1.0 - 1e-12;
            match vertices {
                true if draws.chance(0.5) => inside,
                true => -inside,
                false => inside * draws.signed(),
            }
        })
        .collect();
    let offset = g.mul_vec(&xi);
    part.center.iter().zip(offset).map(|(c, o)| c + o).collect()
}

/// The same input in every step.
fn input(problem: &Problem) -> Vec<f64> {
    let inputs = problem.system.variables().u.len();
    vec![0.7; inputs]
}

type Run = (Vec<Vec<f64>>, Vec<Vec<Option<f64>>>);

fn simulate(problem: &Problem, steps: usize, draws: &mut Draws, vertices: bool) -> Run {
    let variables = problem.system.variables();
    let mut x = drawn(&problem.prior, draws, vertices);
    let u = input(problem);
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for k in 0..=steps {
        let (mut y, mut next) = (vec![0.0; variables.y.len()], vec![0.0; variables.x.len()]);
        let (w, v) = (
            drawn(&problem.w, draws, vertices),
            drawn(&problem.v, draws, vertices),
        );
        problem.system.h(k, &x, &u, &v, &mut y);
        problem.system.f(k, &x, &u, &w, &mut next);
        xs.push(x);
        ys.push(y.into_iter().map(Some).collect());
        x = next;
    }
    (xs, ys)
}

fn estimator(settings: &str, problem: &Problem) -> AnyEstimator {
    let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
    AnyEstimator::new(&settings, problem).unwrap()
}

/// The volumes of the updated sets; every set must hold the truth.
fn volumes(settings: &str, problem: &Problem, (xs, ys): &Run) -> Vec<f64> {
    let e = estimator(settings, problem);
    let u = vec![input(problem); xs.len()];
    let steps = track(&e, xs.len() - 1, &u, ys);
    let volumes: Vec<f64> = steps
        .map(|step| {
            let x: Vec<Interval> = xs[step.k].iter().map(|&x| Interval::point(x)).collect();
            let updated = step.updated.unwrap();
            for belief in [&updated, &step.predicted.unwrap()] {
                let hull = belief.interval_hull().unwrap();
                assert!(hull.contains(&xs[step.k]), "{settings} at {}", step.k);
                let verdict = belief.contains(&x);
                assert_ne!(verdict, Containment::Outside, "{settings} at {}", step.k);
                // The facets are those of the constrained zonotope.
                let AnyBelief::PolytopeBelief(polytope) = belief else {
                    panic!("{belief:?}")
                };
                let verdict = polytope.set().contains(&x).unwrap();
                assert_ne!(verdict, Containment::Outside, "{settings} at {}", step.k);
                assert!(belief.volume().is_some());
            }
            updated.volume().unwrap()
        })
        .collect();
    assert_eq!(volumes.len(), xs.len());
    assert!(volumes.iter().all(|v| v.is_finite()));
    volumes
}

fn nothing_is_lost(problem: &Problem, runs: usize) {
    let mut draws = Draws::new(41);
    for run in 0..runs {
        let path = simulate(problem, 4, &mut draws, run % 2 == 0);
        for settings in METHODS {
            volumes(settings, problem, &path);
        }
    }
}

#[test]
fn no_set_loses_the_truth_on_quotients() {
    nothing_is_lost(&raimondo(), 10);
}

#[test]
fn no_set_loses_the_truth_among_landmarks() {
    nothing_is_lost(&unicycle(), 4);
}

#[test]
fn lift_is_the_smallest_of_all() {
    let mut draws = Draws::new(42);
    for (problem, runs) in [(raimondo(), 12), (unicycle(), 3)] {
        for run in 0..runs {
            let path = simulate(&problem, 4, &mut draws, run % 2 == 0);
            let lift = volumes(METHODS[8], &problem, &path);
            for settings in &METHODS[..8] {
                let other = volumes(settings, &problem, &path);
                let within = lift
                    .iter()
                    .zip(&other)
                    .all(|(l, o)| *l <= o * (1.0 + 1e-9) + 1e-11);
                assert!(within, "{settings}: {lift:?} {other:?}");
            }
        }
    }
}

#[test]
fn a_step_from_the_same_set_is_contained_where_that_is_a_theorem() {
    // D-RRSR in RRSR; COMB in each of its members; LIFT in D-RRSR and D-CZ with its own vectors.
    let mut draws = Draws::new(43);
    let pairs = [
        (METHODS[1], METHODS[0]),
        (METHODS[6], METHODS[0]),
        (METHODS[6], METHODS[1]),
        (METHODS[6], METHODS[2]),
        (METHODS[6], METHODS[4]),
        (METHODS[8], METHODS[1]),
        (
            METHODS[8],
            r#"{"kind": "d-cz", "vectors": "signed", "jacobian": "decomposition"}"#,
        ),
        (METHODS[5], METHODS[4]),
    ];
    for problem in [raimondo(), unicycle()] {
        let path = simulate(&problem, 1, &mut draws, false);
        for (small, large) in pairs {
            let [small, large] = [small, large].map(|settings| {
                let e = estimator(settings, &problem);
                // The first update is that of a point's measurement; from there one prediction.
                track(&e, 1, &[], &path.1)
                    .nth(1)
                    .unwrap()
                    .predicted
                    .unwrap()
            });
            let AnyBelief::PolytopeBelief(small) = small else {
                panic!("{small:?}")
            };
            let AnyBelief::PolytopeBelief(large) = large else {
                panic!("{large:?}")
            };
            within(&small, &large, 1e-6);
        }
    }
}

/// Every vertex of `small` satisfies every slab of `large`, within `slack` of its width.
fn within(small: &PolytopeBelief, large: &PolytopeBelief, slack: f64) {
    for v in small.outline().unwrap().vertices() {
        let v: Vec<Interval> = v.iter().map(|&x| Interval::point(x)).collect();
        for slab in large.outline().unwrap().slabs() {
            let at = slab.product(&v);
            let room = slack * slab.range.width();
            assert!(at.lo() <= slab.range.hi() + room && at.hi() >= slab.range.lo() - room);
        }
    }
}

fn four_states() -> Problem {
    let a = Matrix::from_fn(4, 4, |i, j| {
        if i == j {
            0.8
        } else {
            0.1 * (i as f64 - j as f64)
        }
    });
    let c = Matrix::from_rows(&[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0]]).unwrap();
    Problem {
        system: AnySystem::Linear(Linear::new(a, None, c, None).unwrap()),
        prior: Uncertain::from_box(&[-1.0; 4], &[1.0; 4]).unwrap(),
        w: Uncertain::from_box(&[-0.1; 4], &[0.1; 4]).unwrap(),
        v: Uncertain::from_box(&[-0.2; 2], &[0.2; 2]).unwrap(),
    }
}

#[test]
fn above_three_states_lift_has_hulls_and_no_volume_and_the_others_say_why_not() {
    let problem = four_states();
    let mut draws = Draws::new(44);
    for run in 0..6 {
        let (xs, ys) = simulate(&problem, 8, &mut draws, run % 2 == 0);
        let e = estimator(METHODS[8], &problem);
        for step in track(&e, 8, &[], &ys) {
            let belief = step.updated.unwrap();
            assert!(belief.interval_hull().unwrap().contains(&xs[step.k]));
            assert_eq!(belief.volume(), None);
        }
    }
    for settings in METHODS[..8]
        .iter()
        .chain([&r#"{"kind": "lift", "carry": "facets"}"#])
    {
        let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
        let refused = AnyEstimator::new(&settings, &problem).unwrap_err();
        assert!(
            matches!(
                refused,
                EstimationError::Unsupported {
                    what: "more than three states",
                    ..
                }
            ),
            "{refused}"
        );
    }
}

#[test]
fn settings_that_mean_nothing_are_refused() {
    for (settings, key) in [
        (r#"{"kind": "rrsr", "choose": "all"}"#, "choose"),
        (r#"{"kind": "d-zb", "carry": "hull"}"#, "carry"),
    ] {
        let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
        let refused = AnyEstimator::new(&settings, &raimondo())
            .unwrap_err()
            .to_string();
        assert!(refused.contains(key), "{refused}");
    }
    for bad in [
        r#"{"kind": "lift", "vectors": "printed"}"#,
        r#"{"kind": "lift", "start": "box"}"#,
        r#"{"kind": "lift", "generators": 3}"#,
    ] {
        assert!(
            serde_json::from_str::<EstimatorSettings>(bad).is_err(),
            "{bad}"
        );
    }
}

#[test]
fn what_was_not_measured_changes_nothing_and_one_component_is_enough() {
    let problem = unicycle();
    for settings in METHODS {
        let e = estimator(settings, &problem);
        let nothing = vec![vec![None; 4]];
        let step = track(&e, 0, &[], &nothing).next().unwrap();
        let (before, after) = (step.predicted.unwrap(), step.updated.unwrap());
        let [volume, same] = [&before, &after].map(|b| b.volume().unwrap());
        assert!((volume - same).abs() <= 1e-12 * volume, "{settings}");
        let one = vec![vec![Some(15.6), None, None, None]];
        let step = track(&e, 0, &[], &one).next().unwrap();
        let smaller = step.updated.unwrap().volume().unwrap();
        assert!(smaller < before.volume().unwrap(), "{settings}");
    }
}

/// Zonotopes of more generators than components, in no direction of an axis.
fn with_inclined_noise(problem: Problem) -> Problem {
    let inclined = |part: &Uncertain| {
        let hull = part.box_hull().widths();
        let n = hull.len();
        let g = Matrix::from_fn(n, n + 2, |i, j| {
            let turned = libm::cos(1.3 * (i + 1) as f64 * (j + 1) as f64);
            0.5 * hull[i] * turned / (n + 2) as f64
        });
        Uncertain::zonotope(part.center.clone(), g)
    };
    Problem {
        w: inclined(&problem.w),
        v: inclined(&problem.v),
        ..problem
    }
}

/// The noise is turned by the heading: it is not merely added.
fn vehicle() -> Problem {
    let w = Uncertain::from_box(&[-0.3, -1.0, -2.0], &[0.3, 1.0, 2.0]).unwrap();
    with_inclined_noise(Problem {
        system: AnySystem::VehicleSe2(VehicleSe2::new(0.1, Form::Euler).unwrap()),
        prior: Uncertain::from_box(&[0.3, -0.2, -0.2], &[0.6, 0.2, 0.2]).unwrap(),
        w,
        v: Uncertain::from_box(&[-0.2; 2], &[0.2; 2]).unwrap(),
    })
}

#[test]
fn a_known_process_noise_that_turns_with_the_heading_is_taken_for_what_it_is() {
    let mut draws = Draws::new(46);
    let problem = Problem {
        w: Uncertain::point(vec![0.05, 0.5, -0.25]),
        ..vehicle()
    };
    let path = simulate(&problem, 3, &mut draws, true);
    for settings in METHODS {
        volumes(settings, &problem, &path);
    }
}

#[test]
fn a_belief_judges_its_set_and_not_its_outline() {
    // The prior is a square in a plane of space, of which no facet of its outline is the plane's edge.
    let g = Matrix::from_rows(&[[1.0, 1.0], [1.0, -1.0], [0.0, 0.0]]).unwrap();
    let problem = Problem {
        prior: Uncertain::zonotope(vec![0.0; 3], g),
        ..unicycle()
    };
    for settings in METHODS {
        let belief = estimator(settings, &problem).prior();
        let at = |x: [f64; 3]| belief.contains(&x.map(Interval::point));
        assert_eq!(at([1.9, 1.9, 0.0]), Containment::Outside, "{settings}");
        assert_eq!(at([0.5, 0.5, 0.0]), Containment::Inside, "{settings}");
    }
}

#[test]
fn noises_of_any_shape_lose_no_truth_and_are_not_taken_for_their_boxes() {
    let mut draws = Draws::new(45);
    for (problem, runs, added) in [
        (with_inclined_noise(raimondo()), 3, true),
        (with_inclined_noise(unicycle()), 1, true),
        (vehicle(), 2, false),
    ] {
        let boxed = |part: &Uncertain| {
            let hull = part.box_hull();
            Uncertain::from_box(&hull.lower(), &hull.upper()).unwrap()
        };
        let wide = Problem {
            w: boxed(&problem.w),
            v: boxed(&problem.v),
            ..problem.clone()
        };
        for run in 0..runs {
            let path = simulate(&problem, 3, &mut draws, run % 2 == 0);
            for settings in METHODS {
                // In the coordinates of five generators there are too many vectors to combine.
                if !added && settings.contains("d-cz") && settings.contains("all") {
                    continue;
                }
                let own: f64 = volumes(settings, &problem, &path).iter().sum();
                if added {
                    let of_box: f64 = volumes(settings, &wide, &path).iter().sum();
                    assert!(own < 0.99 * of_box, "{settings}: {own} {of_box}");
                }
            }
        }
    }
}
