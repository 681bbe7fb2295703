//! A filter whose sets are read for as long as one likes has sets of as many facets as it may: they do not grow
//! with the step, and the truth stays inside.

mod draws;

use draws::Draws;
use zonobench_estimation::systems::{Form, Linear, Unicycle, VehicleSe2};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimatorSettings, Problem, System, Uncertain,
    track,
};
use zonobench_sets::ops::{Kernel, tally};
use zonobench_sets::{Containment, Interval, Matrix};

/// Two landmarks, slow, and precise enough that facets outlive the measurements.
fn unicycle() -> Problem {
    let landmarks = vec![[5.0, 15.0], [15.0, 15.0]];
    let noise = |r: f64, n| Uncertain::from_box(&vec![-r; n], &vec![r; n]).unwrap();
    Problem {
        system: AnySystem::Unicycle(Unicycle::new(1.0, 0.0, 0.0, landmarks).unwrap()),
        prior: noise(0.1, 3),
        w: noise(1e-3, 3),
        v: noise(1e-2, 4),
    }
}

/// As [`unicycle`], turning about a circle.
fn circling() -> Problem {
    let landmarks = vec![[5.0, 15.0], [15.0, 15.0]];
    Problem {
        system: AnySystem::Unicycle(Unicycle::new(1.0, 0.3, 0.15, landmarks).unwrap()),
        ..unicycle()
    }
}

/// A point of the part, just inside; of its generators' ends where `vertices`.
fn drawn(part: &Uncertain, draws: &mut Draws, vertices: bool) -> Vec<f64> {
    let g = part.generator_matrix();
    let xi: Vec<f64> = (0..g.cols())
        .map(|_| {
            let x = draws.signed();
            (1.0 - 1e-12) * if vertices { x.signum() } else { x }
        })
        .collect();
    let offset = g.mul_vec(&xi);
    part.center.iter().zip(offset).map(|(c, o)| c + o).collect()
}

type Run = (Vec<Vec<f64>>, Vec<Vec<Option<f64>>>);

fn simulated(problem: &Problem, steps: usize, seed: u64, vertices: bool) -> Run {
    let variables = problem.system.variables();
    let mut draws = Draws::new(seed);
    let u = vec![0.7; variables.u.len()];
    let mut x = drawn(&problem.prior, &mut draws, vertices);
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for k in 0..=steps {
        let (mut y, mut next) = (vec![0.0; variables.y.len()], vec![0.0; x.len()]);
        let w = drawn(&problem.w, &mut draws, vertices);
        let v = drawn(&problem.v, &mut draws, vertices);
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

/// The largest numbers over a run: facets of a predicted or updated set, its constraints, and linear programs of a step
/// in all.
#[derive(Debug, Default, PartialEq)]
struct Most {
    facets: usize,
    constraints: usize,
    programs: u64,
    /// Σ over the steps.
    radii: f64,
}

/// Runs the filter; no set may be without the truth.
fn most(settings: &str, problem: &Problem, (xs, ys): &Run) -> Most {
    let e = estimator(settings, problem);
    let u = vec![vec![0.7; problem.system.variables().u.len()]; xs.len()];
    let mut most = Most::default();
    let mut steps = track(&e, xs.len() - 1, &u, ys);
    loop {
        let (step, counts) = tally(|| {
            let step = steps.next()?;
            for belief in step.predicted.iter().chain(&step.updated) {
                let AnyBelief::PolytopeBelief(belief) = belief else {
                    panic!("{belief:?}")
                };
                let x: Vec<Interval> = xs[step.k].iter().map(|&x| Interval::point(x)).collect();
                assert_ne!(
                    belief.contains(&x),
                    Containment::Outside,
                    "{settings} at {}",
                    step.k
                );
                assert!(belief.interval_hull().unwrap().contains(&xs[step.k]));
                let outline = belief.outline().unwrap();
                assert!(outline.volume().is_some());
                most.facets = most.facets.max(outline.slabs().len());
                most.constraints = most.constraints.max(belief.size().n_constraints.unwrap());
            }
            most.radii += step.updated.as_ref().unwrap().size().radius.unwrap();
            Some(step)
        });
        if step.is_none() {
            return most;
        }
        most.programs = most.programs.max(counts.kernel(Kernel::Program).programs);
    }
}

#[test]
fn facets_stay_as_few_as_they_may_be_over_a_thousand_steps_of_noise_on_vertices() {
    for (problem, settings, steps) in [
        (unicycle(), r#"{"kind": "d-zb"}"#, 1000),
        (unicycle(), r#"{"kind": "lift"}"#, 1000),
        (unicycle(), r#"{"kind": "comb"}"#, 1000),
        (circling(), r#"{"kind": "d-zb"}"#, 30),
    ] {
        let path = simulated(&problem, steps, 3, true);
        let most = most(settings, &problem, &path);
        // Six times the 32 that a step starts from, and the sides of the hull.
        assert!(most.facets <= 192 + 3, "{settings}: {most:?}");
        // And four strips from each of at most 24 frames and the three members over the hull.
        assert!(most.constraints <= 192 + 4 * 27, "{settings}: {most:?}");
        assert!(most.programs <= 6000, "{settings}: {most:?}");
    }
}

#[test]
fn a_step_does_not_cost_more_the_later_it_is() {
    let problem = unicycle();
    for settings in [
        r#"{"kind": "d-zb"}"#,
        r#"{"kind": "comb+"}"#,
        r#"{"kind": "rrsr"}"#,
    ] {
        let [short, long] = [30, 120]
            .map(|steps| most(settings, &problem, &simulated(&problem, steps, 5, false)).programs);
        assert!(long <= 2 * short, "{settings}: {short}, {long}");
    }
}

#[test]
fn the_facets_that_go_cost_little_and_fewer_cost_more() {
    let problem = unicycle();
    let path = simulated(&problem, 8, 3, false);
    for kind in ["d-zb", "comb", "lift"] {
        let [all, default, eight, two] = ["100000", "32", "8", "2"].map(|facets| {
            let settings = format!(r#"{{"kind": "{kind}", "facets": {facets}}}"#);
            most(&settings, &problem, &path).radii
        });
        // Either way: a bundle has the frames of the first 24 facets, and fewer are better ones.
        assert!(
            (default - all).abs() <= 1e-3 * all,
            "{kind}: {all} {default}"
        );
        assert!(default <= eight * (1.0 + 1e-3), "{kind}: {default} {eight}");
        assert!(eight <= two * (1.0 + 1e-3), "{kind}: {eight} {two}");
        assert!(two <= 1.5 * all, "{kind}: {all} {two}");
    }
}

#[test]
fn a_prior_of_a_million_metres_does_not_make_lift_slow() {
    let noise = |r: &[f64]| {
        let minus: Vec<f64> = r.iter().map(|x| -x).collect();
        Uncertain::from_box(&minus, r).unwrap()
    };
    let problem = Problem {
        system: AnySystem::VehicleSe2(VehicleSe2::new(0.1, Form::Euler).unwrap()),
        prior: noise(&[0.3, 1e6, 1e6]),
        w: noise(&[0.3, 1.0, 2.0]),
        v: noise(&[0.2, 0.2]),
    };
    let most = most(
        r#"{"kind": "lift"}"#,
        &problem,
        &simulated(&problem, 4, 7, true),
    );
    assert!(most.facets <= 195 && most.programs <= 3000, "{most:?}");
}

#[test]
fn a_bound_on_facets_without_a_meaning_is_refused() {
    let settings = [
        (r#"{"kind": "d-zb", "facets": 0}"#, "at least 1"),
        (
            r#"{"kind": "lift", "carry": "hull", "facets": 8}"#,
            "absent",
        ),
    ];
    for (settings, expected) in settings {
        let settings: EstimatorSettings = serde_json::from_str(settings).unwrap();
        let refused = AnyEstimator::new(&settings, &unicycle()).unwrap_err();
        assert!(refused.to_string().contains(expected), "{refused}");
    }
}

#[test]
fn on_a_linear_system_czfo_costs_what_czmv_does() {
    let a = Matrix::from_fn(4, 4, |i, j| {
        if i == j {
            0.8
        } else {
            0.1 * (i as f64 - j as f64)
        }
    });
    let c = Matrix::from_rows(&[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0]]).unwrap();
    let noise = |r: f64, n| Uncertain::from_box(&vec![-r; n], &vec![r; n]).unwrap();
    let problem = Problem {
        system: AnySystem::Linear(Linear::new(a, None, c, None).unwrap()),
        prior: noise(1.0, 4),
        w: noise(0.1, 4),
        v: noise(0.2, 2),
    };
    let (xs, ys) = simulated(&problem, 30, 6, true);
    let work = |settings: &str| {
        let e = estimator(settings, &problem);
        let (radii, counts) = tally(|| {
            let steps = track(&e, 30, &[], &ys);
            let radii = steps.map(|step| {
                let updated = step.updated.unwrap();
                let hull = updated.interval_hull().unwrap();
                assert!(hull.contains(&xs[step.k]), "{settings} at {}", step.k);
                updated.size().radius.unwrap()
            });
            radii.sum::<f64>()
        });
        (radii, counts.total())
    };
    let own = r#""generators": 20, "constraints": 5, "h": "c3""#;
    let (radius, czmv) = work(&format!(r#"{{"kind": "czmv", {own}}}"#));
    for expansion in ["full", "lean"] {
        let settings = format!(r#"{{"kind": "czfo", {own}, "expansion": "{expansion}"}}"#);
        let (same, czfo) = work(&settings);
        // Of a linear map both are the exact image.
        assert!((same - radius).abs() <= 1e-9 * radius, "{same} {radius}");
        assert!(czfo.arithmetic() <= 2 * czmv.arithmetic());
        assert!(czfo.programs <= 2 * czmv.programs);
    }
}
