//! The laws in the docs of `Estimator`, `Belief` and `System`, for every implementor; and the inputs
//! that each estimator refuses, by key.

mod draws;

use allocation_counter::measure;
use draws::Draws;
use zonobench_estimation::estimator::{Containment, KINDS, Phase};
use zonobench_estimation::estimators::BoxStateEst;
use zonobench_estimation::systems::{Form, Linear, Lpv, VanDerPol, VehicleSe2};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimationError, Estimator, EstimatorSettings,
    Online, Problem, System, Uncertain, track,
};
use zonobench_sets::{Interval, Matrix};

fn m<const N: usize>(rows: &[[f64; N]]) -> Matrix {
    Matrix::from_rows(rows).unwrap()
}

fn parse(json: &str) -> EstimatorSettings {
    serde_json::from_str(json).unwrap()
}

/// Every kind of estimator, with settings that differ from the defaults.
fn all() -> Vec<EstimatorSettings> {
    [
        r#"{"kind": "kalman"}"#,
        r#"{"kind": "ekf", "wrap": true}"#,
        r#"{"kind": "ukf", "alpha": 0.5, "beta": 1.5, "kappa": 1}"#,
        r#"{"kind": "particle", "particles": 100, "resample_below": 0.75, "seed": 3}"#,
        r#"{"kind": "box-state-est"}"#,
        r#"{"kind": "box-state-est", "products": "printed"}"#,
        r#"{"kind": "ezgkf", "phi": 12, "eta": 0.5, "alpha": 0.01}"#,
        r#"{"kind": "ezgkf", "phi": 12, "eta": 0.5, "alpha": 0.01, "merge_parallel": true}"#,
        r#"{"kind": "ezgkf-m", "phi": 12, "eta": 0.2, "alpha": 0.01, "overbars": false}"#,
        r#"{"kind": "ezgkp", "phi": 12, "eta": 0.7, "alpha": 0.01, "form": "ak"}"#,
        r#"{"kind": "ezgkp", "phi": 12, "eta": 0.7, "alpha": 0.01, "form": "direct"}"#,
        r#"{"kind": "zmv", "generators": 12}"#,
        r#"{"kind": "zfo", "generators": 12}"#,
        r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c1"}"#,
        r#"{"kind": "czfo", "generators": 12, "constraints": 3, "h": "xb", "expansion": "lean", "remainder": "symmetric"}"#,
        r#"{"kind": "rrsr"}"#,
        r#"{"kind": "d-rrsr"}"#,
        r#"{"kind": "d-zb"}"#,
        r#"{"kind": "d-cz"}"#,
        r#"{"kind": "comb"}"#,
        r#"{"kind": "comb+"}"#,
        r#"{"kind": "lift"}"#,
    ]
    .map(parse)
    .to_vec()
}

/// Two states, two measurements, one input, all noises both bounded and Gaussian.
fn problem() -> Problem {
    let system = Linear::new(
        m(&[[0.9, 0.4], [-0.3, 0.8]]),
        Some(m(&[[1.0], [0.5]])),
        m(&[[1.0, 0.0], [0.5, 1.0]]),
        Some(m(&[[0.0], [0.25]])),
    );
    let part = |radius: f64| Uncertain {
        covariance: Some(Matrix::identity(2).scale(radius * radius)),
        ..Uncertain::from_box(&[-radius; 2], &[radius; 2]).unwrap()
    };
    Problem {
        system: AnySystem::Linear(system.unwrap()),
        prior: part(2.0),
        w: part(0.1),
        v: part(0.2),
    }
}

/// Inputs and measurements that agree with [`problem`], now and then with a component missing.
fn data(steps: usize) -> (Vec<Vec<f64>>, Vec<Vec<Option<f64>>>) {
    let problem = problem();
    let mut draws = Draws::new(21);
    let mut x = [1.5, -1.0];
    let (mut inputs, mut measurements) = (Vec::new(), Vec::new());
    for k in 0..=steps {
        let u = [draws.signed()];
        let (mut y, mut next) = ([0.0; 2], [0.0; 2]);
        problem.system.h(
            k,
            &x,
            &u,
            &[0.19 * draws.signed(), 0.19 * draws.signed()],
            &mut y,
        );
        problem.system.f(
            k,
            &x,
            &u,
            &[0.09 * draws.signed(), 0.09 * draws.signed()],
            &mut next,
        );
        x = next;
        inputs.push(u.to_vec());
        measurements.push(y.map(|y| (!draws.chance(0.15)).then_some(y)).to_vec());
    }
    (inputs, measurements)
}

#[test]
fn every_estimator_gives_the_same_beliefs_twice_and_of_the_right_dimension() {
    let (u, y) = data(30);
    for settings in all() {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        assert_eq!(estimator.prior().center().len(), 2);
        let run = || -> Vec<String> {
            let steps = track(&estimator, 30, &u, &y);
            steps
                .map(|s| format!("{:?} {:?}", s.predicted, s.updated))
                .collect()
        };
        let first = run();
        assert_eq!(first.len(), 31, "{settings:?}");
        assert_eq!(first, run());
        for step in track(&estimator, 30, &u, &y) {
            let belief = step.updated.unwrap();
            assert_eq!(belief.center().len(), 2);
            assert!(belief.center().iter().all(|x| x.is_finite()));
            let shape = belief.shape();
            assert!(shape.constraints.is_some() || shape.center == belief.center());
            match belief.interval_hull() {
                Some(hull) => {
                    assert!(hull.contains(&belief.center()));
                    let middle: Vec<Interval> =
                        belief.center().into_iter().map(Interval::point).collect();
                    assert_eq!(
                        belief.contains(&middle),
                        Containment::Inside,
                        "{settings:?} at {}: {:?} in {belief:?}",
                        step.k,
                        belief.center()
                    );
                    let far = [Interval::point(1e6), Interval::point(0.0)];
                    assert_eq!(belief.contains(&far), Containment::Outside);
                    let across = [hull[0] + Interval::UNIT, hull[1]];
                    assert_eq!(belief.contains(&across), Containment::Undecided);
                    let radius = hull.rad().into_iter().fold(0.0, f64::max);
                    assert!((belief.size().radius.unwrap() - radius).abs() < 1e-12);
                }
                None => assert_eq!(
                    belief.contains(&[Interval::UNIT; 2]),
                    Containment::Undecided
                ),
            }
        }
    }
}

#[test]
fn reducing_the_order_keeps_the_hull_and_the_number_asked_for() {
    let (u, y) = data(12);
    for settings in all() {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        for step in track(&estimator, 12, &u, &y) {
            let belief = step.updated.unwrap();
            let reduced = estimator.reduce_order(step.k, belief.clone()).unwrap();
            assert_eq!(reduced.center(), belief.center());
            assert!(reduced.size().n_generators.unwrap_or(0) <= 12);
            if let (Some(before), Some(after)) = (belief.interval_hull(), reduced.interval_hull()) {
                let pairs = before.iter().zip(after.iter());
                for (before, after) in pairs {
                    // Sums of at most 60 terms below 10.
                    assert!(after.lo() <= before.lo() + 1e-13 && after.hi() >= before.hi() - 1e-13);
                }
            }
        }
    }
}

#[test]
fn each_kind_says_its_name_and_its_settings() {
    let mut kinds: Vec<&str> = Vec::new();
    for settings in all() {
        let json = serde_json::to_value(&settings).unwrap();
        assert_eq!(json["kind"], settings.kind());
        assert_eq!(
            serde_json::from_value::<EstimatorSettings>(json.clone()).unwrap(),
            settings
        );
        let info = KINDS
            .iter()
            .find(|info| info.kind == settings.kind())
            .unwrap();
        let mut keys: Vec<&str> = json
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .filter(|k| *k != "kind")
            .collect();
        // `scale` and `measurement` are written where they are set alone.
        let mut known: Vec<&str> = info.keys.to_vec();
        known.retain(|key| !["scale", "measurement"].contains(key));
        keys.sort_unstable();
        known.sort_unstable();
        if known.contains(&"jacobian") {
            // A polytopic filter has those keys alone that mean something for it, and writes none that was not given.
            assert!(keys.iter().all(|key| known.contains(key)), "{}", info.kind);
        } else {
            assert_eq!(keys, known, "{}", info.kind);
        }
        kinds.push(info.kind);
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        assert_eq!(estimator.kind(), settings.kind());
        assert_eq!(estimator.warning(), None);
    }
    kinds.dedup();
    // These need a vehicle, and have the same laws in tests/vehicle.rs.
    let vehicles = ["zsmf", "inzsmf"];
    let mut known: Vec<&str> = KINDS.iter().map(|k| k.kind).collect();
    known.retain(|kind| !vehicles.contains(kind));
    assert_eq!(kinds, known);
}

#[test]
fn only_set_membership_filters_in_a_sound_reading_are_called_guaranteed() {
    for settings in all() {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        let stacked = settings == parse(r#"{"kind": "box-state-est"}"#);
        let nonlinear = !matches!(
            estimator.kind(),
            "kalman" | "ekf" | "ukf" | "particle" | "box-state-est" | "ezgkf" | "ezgkf-m" | "ezgkp"
        );
        assert_eq!(estimator.guaranteed(), stacked || nonlinear, "{settings:?}");
        let predicted = matches!(estimator.kind(), "kalman" | "ezgkp");
        assert_eq!(estimator.reported_phase() == Phase::Predicted, predicted);
    }
}

#[test]
fn a_filter_that_starts_with_y_1_reports_the_prior_at_0() {
    let (u, y) = data(1);
    for settings in all().into_iter().filter(|s| s.kind().starts_with("ezgk")) {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        let first = track(&estimator, 1, &u, &y).next().unwrap();
        assert_eq!(first.updated.unwrap().center(), estimator.prior().center());
    }
}

#[test]
fn nothing_measured_leaves_the_prediction_as_it_is() {
    for settings in all() {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        let predicted = estimator.predict(1, &estimator.prior(), &[0.5]).unwrap();
        let updated = estimator
            .update(1, &predicted, &[0.5], &[None, None])
            .unwrap();
        assert_eq!(updated.center(), predicted.center());
        assert_eq!(updated.interval_hull(), predicted.interval_hull());
    }
}

#[test]
fn wrong_inputs_and_measurements_are_errors_that_say_so() {
    for settings in all() {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        let prior = estimator.prior();
        let message = |e: Result<AnyBelief, EstimationError>| e.unwrap_err().to_string();
        assert_eq!(
            message(estimator.predict(1, &prior, &[])),
            "input u: expected dimension 1, got 0"
        );
        assert_eq!(
            message(estimator.predict(1, &prior, &[f64::NAN])),
            "input u: expected finite numbers, got NaN"
        );
        assert_eq!(
            message(estimator.update(0, &prior, &[0.0], &[Some(1.0)])),
            "measurement y: expected dimension 2, got 1"
        );
        assert_eq!(
            message(estimator.update(0, &prior, &[0.0], &[Some(1.0), Some(f64::INFINITY)])),
            "measurement y: expected finite numbers, got inf"
        );
    }
}

#[test]
fn nothing_comes_before_the_prior() {
    for settings in all() {
        let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
        let (inputs, _) = data(1);
        // A filter that does not ask for the step may answer; none may panic.
        if let Err(error) = estimator.predict(0, &estimator.prior(), &inputs[0]) {
            let expected = "predict: `k` must be 1 or more, got 0";
            assert_eq!(error.to_string(), expected, "{settings:?}");
        }
    }
}

#[test]
fn a_belief_of_another_estimator_is_refused() {
    let estimators: Vec<AnyEstimator> = all()
        .iter()
        .map(|s| AnyEstimator::new(s, &problem()).unwrap())
        .collect();
    let other = estimators.iter().find(|e| e.kind() == "particle").unwrap();
    let error = estimators[0]
        .predict(1, &other.prior(), &[0.0])
        .unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("kalman does not support a belief of another")
    );
}

fn refusal(json: &str, problem: &Problem) -> String {
    match AnyEstimator::new(&parse(json), problem) {
        Ok(_) => panic!("{json} is accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn settings_out_of_range_are_refused_by_key() {
    for kind in ["ezgkf", "ezgkf-m", "ezgkp"] {
        let with = |phi: usize, eta: f64, alpha: f64| {
            let json = format!(
                r#"{{"kind": "{kind}", "phi": {phi}, "eta": {eta:?}, "alpha": {alpha:?}}}"#
            );
            refusal(&json, &problem())
        };
        assert_eq!(
            with(1, 0.5, 0.1),
            format!("{kind}: `phi` must be at least n = 2, got 1")
        );
        assert_eq!(
            with(9, 1.5, 0.1),
            format!("{kind}: `eta` must be in [0, 1], got 1.5")
        );
        assert_eq!(
            with(9, 0.5, 0.0),
            format!("{kind}: `alpha` must be in (0, 1), got 0")
        );
        assert_eq!(
            with(9, 0.5, 1.0),
            format!("{kind}: `alpha` must be in (0, 1), got 1")
        );
    }
    for (text, expected) in [
        (
            r#"{"kind": "ezgkf", "phi": 9, "eta": 0.5, "alpha": 0.1, "fi": 3}"#,
            "unknown field `fi`",
        ),
        (r#"{"kind": "kalman", "phi": 9}"#, "unknown field `phi`"),
        (
            r#"{"kind": "box-state-est", "products": "none"}"#,
            "unknown variant `none`",
        ),
        (
            r#"{"kind": "ezgkf", "eta": 0.5, "alpha": 0.1}"#,
            "missing field `phi`",
        ),
    ] {
        let error = serde_json::from_str::<EstimatorSettings>(text)
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_gain_exists_for_every_eta_and_needs_a_semidefinite_weight() {
    let ezgkf =
        |eta: f64| format!(r#"{{"kind": "ezgkf", "phi": 9, "eta": {eta:?}, "alpha": 0.1}}"#);
    let v = |v: Uncertain| Problem { v, ..problem() };
    let only_gaussian = v(Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2)));
    let only_set = v(Uncertain::from_box(&[-1.0; 2], &[1.0; 2]).unwrap());
    let known = v(Uncertain::point(vec![0.0; 2]));
    for eta in [0.0, 0.5, 1.0] {
        for problem in [&only_gaussian, &only_set, &known] {
            let filter = AnyEstimator::new(&parse(&ezgkf(eta)), problem).unwrap();
            let updated = filter.update(1, &filter.prior(), &[0.0], &[Some(0.1), Some(0.2)]);
            assert!(updated.unwrap().center().iter().all(|x| x.is_finite()));
        }
    }
    let wide = v(Uncertain::zonotope(
        vec![0.0; 2],
        m(&[[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]),
    ));
    let unsquared = r#"{"kind": "ezgkf", "phi": 9, "eta": 0.5, "alpha": 0.1, "gain": "unsquared"}"#;
    assert!(refusal(unsquared, &wide).starts_with("ezgkf: `noise.v.generators` must be symmetric"));
    let indefinite = v(Uncertain::zonotope(
        vec![0.0; 2],
        m(&[[0.0, 1.0], [1.0, 0.0]]),
    ));
    assert!(refusal(unsquared, &indefinite).starts_with("ezgkf: `eta` must be such that"));
}

#[test]
fn bounds_that_the_generators_do_not_reach_are_refused() {
    let prior = problem().prior;
    let widened = |hi: f64| {
        let mut prior = prior.clone();
        let bounds = prior.bounds.as_mut().unwrap();
        let (mut lower, mut upper) = (bounds.lower(), bounds.upper());
        lower[0] = lower[0].min(-hi);
        upper[0] = upper[0].max(hi);
        *bounds = zonobench_sets::IntervalVector::from_bounds(&lower, &upper).unwrap();
        Problem { prior, ..problem() }
    };
    assert!(problem().validate().is_ok());
    let text = serde_json::to_string(&widened(1e3)).unwrap();
    let read: Problem = serde_json::from_str(&text).unwrap();
    let error = read.validate().unwrap_err().to_string();
    assert!(error.contains("prior.box: expected bounds that"), "{error}");
    // Generators whose hull is the box, and which are not the box.
    let mut inclined = problem().prior;
    inclined.generators = Some(m(&[[0.5, 0.5], [0.5, 0.5]]));
    inclined.center = vec![0.0; 2];
    inclined.bounds =
        Some(zonobench_sets::IntervalVector::from_bounds(&[-1.0; 2], &[1.0; 2]).unwrap());
    let inclined = Problem {
        prior: inclined,
        ..problem()
    };
    assert!(inclined.validate().is_err());
}

#[test]
fn a_covariance_that_is_none_is_refused() {
    let with = |p: Matrix| {
        let prior = Uncertain {
            covariance: Some(p),
            ..problem().prior
        };
        refusal(r#"{"kind": "kalman"}"#, &Problem { prior, ..problem() })
    };
    let message = with(m(&[[1.0, 0.5], [0.0, 1.0]]));
    assert!(
        message.contains("prior") && message.contains("symmetric"),
        "{message}"
    );
    let message = with(m(&[[1.0, 2.0], [2.0, 1.0]]));
    assert!(
        message.contains("prior") && message.contains("semidefinite"),
        "{message}"
    );
    let none = Problem {
        w: Uncertain::point(vec![0.0; 2]),
        ..problem()
    };
    assert_eq!(
        refusal(r#"{"kind": "kalman"}"#, &none),
        "kalman: `noise.w.covariance` must be given, got nothing"
    );
}

#[test]
fn the_box_observer_needs_sets_and_an_observable_pair() {
    let json = r#"{"kind": "box-state-est"}"#;
    let w = Uncertain::gaussian(vec![0.0; 2], Matrix::identity(2));
    assert_eq!(
        refusal(json, &Problem { w, ..problem() }),
        "box-state-est: `noise.w.box` must be given (or generators), got only a covariance"
    );
    let system = Linear::new(
        Matrix::identity(2),
        None,
        m(&[[1.0, 1.0], [2.0, 2.0]]),
        None,
    )
    .unwrap();
    let error = AnyEstimator::new(
        &parse(json),
        &Problem {
            system: AnySystem::Linear(system),
            ..problem()
        },
    );
    let Err(EstimationError::Unobservable { rank, n, .. }) = error else {
        panic!("{error:?}")
    };
    assert_eq!((rank, n), (1, 2));
}

#[test]
fn a_system_that_is_not_linear_is_refused_by_the_linear_estimators() {
    let one = Uncertain::from_box(&[-1.0], &[1.0]).unwrap();
    let problem = Problem {
        system: AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap()),
        v: Uncertain {
            covariance: Some(Matrix::identity(1)),
            ..one
        },
        ..problem()
    };
    for json in [r#"{"kind": "kalman"}"#, r#"{"kind": "box-state-est"}"#] {
        assert!(refusal(json, &problem).contains("does not support van-der-pol"));
    }
}

#[test]
fn an_ill_conditioned_observability_matrix_is_warned_of() {
    let system = Linear::new(m(&[[1.0, 1e-9], [0.0, 0.5]]), None, m(&[[1.0, 0.0]]), None).unwrap();
    let problem = Problem {
        system: AnySystem::Linear(system),
        v: Uncertain::from_box(&[-1.0], &[1.0]).unwrap(),
        ..problem()
    };
    let estimator = AnyEstimator::new(&parse(r#"{"kind": "box-state-est"}"#), &problem).unwrap();
    assert!(estimator.warning().unwrap().contains("condition number"));
    let AnyEstimator::BoxStateEst(estimator) = estimator else {
        panic!("a box observer")
    };
    // O = [1, 0; 1, 1e-9]: σ_max ≈ √2 and σ_min ≈ 1e-9/√2.
    assert!((BoxStateEst::condition(&estimator) / 2e9 - 1.0).abs() < 1e-6);
}

#[test]
fn one_state_is_corrected_from_the_first_measurement() {
    // n = 1: [x_0] = (y_0 − [v]) ∩ [x_0]; then x_1 ∈ 0.5 [x_0] + [d] and so on.
    let system = Linear::new(m(&[[0.5]]), None, m(&[[2.0]]), None).unwrap();
    let side = |r: f64| Uncertain::from_box(&[-r], &[r]).unwrap();
    let problem = Problem {
        system: AnySystem::Linear(system),
        prior: side(10.0),
        w: side(0.25),
        v: side(1.0),
    };
    let estimator = AnyEstimator::new(&parse(r#"{"kind": "box-state-est"}"#), &problem).unwrap();
    let y = [vec![Some(4.0)], vec![Some(1.0)]];
    let hulls: Vec<_> = track(&estimator, 1, &[], &y)
        .map(|s| s.updated.unwrap().interval_hull().unwrap())
        .collect();
    let close = |side: Interval, lo: f64, hi: f64| {
        assert!(
            (side.lo() - lo).abs() < 1e-13 && (side.hi() - hi).abs() < 1e-13,
            "{side:?}"
        );
    };
    close(hulls[0][0], 1.5, 2.5);
    close(hulls[1][0], 0.5, 1.0); // ([0.75, 1.25] ± 0.25) ∩ [0, 1]
}

#[test]
fn systems_on_intervals_contain_their_values_at_points() {
    let systems = [
        problem().system,
        AnySystem::Lpv(
            Lpv::new(
                m(&[[0.0, -0.5], [1.0, 1.0]]),
                vec![m(&[[0.0, 0.0], [0.0, 0.3]]), m(&[[0.1, 0.0], [0.2, 0.0]])],
                Some(m(&[[1.0], [2.0]])),
                m(&[[-2.0, 1.0]]),
            )
            .unwrap(),
        ),
        AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap()),
        AnySystem::VehicleSe2(VehicleSe2::new(0.1, Form::Euler).unwrap()),
        AnySystem::VehicleSe2(VehicleSe2::new(0.1, Form::Group).unwrap()),
    ];
    let mut draws = Draws::new(22);
    for system in &systems {
        let json = serde_json::to_string(system).unwrap();
        assert_eq!(&serde_json::from_str::<AnySystem>(&json).unwrap(), system);
        assert!(
            json.starts_with(&format!(r#"{{"kind":"{}""#, system.kind())),
            "{json}"
        );
        let v = system.variables();
        assert_eq!(v.w.len(), v.x.len() + system.n_delta());
        for _ in 0..200 {
            let mut sides = |n: usize| -> Vec<Interval> {
                let side = |_| {
                    let (a, b) = (3.0 * draws.signed(), 3.0 * draws.signed());
                    Interval::new(a.min(b), a.max(b)).unwrap()
                };
                (0..n).map(side).collect()
            };
            let (x, w, noise) = (sides(v.x.len()), sides(v.w.len()), sides(v.v.len()));
            let u: Vec<f64> = v.u.iter().map(|_| draws.signed()).collect();
            let mut next = vec![Interval::ZERO; v.x.len()];
            let mut y = vec![Interval::ZERO; v.y.len()];
            system.f(0, &x, &u, &w, &mut next);
            system.h(0, &x, &u, &noise, &mut y);
            let mut point = |sides: &[Interval]| -> Vec<f64> {
                let at = |s: &Interval| (s.lo() + draws.unit() * (s.hi() - s.lo())).min(s.hi());
                sides.iter().map(at).collect()
            };
            let (px, pw, pv) = (point(&x), point(&w), point(&noise));
            let mut f = vec![0.0; v.x.len()];
            let mut h = vec![0.0; v.y.len()];
            system.f(0, &px, &u, &pw, &mut f);
            system.h(0, &px, &u, &pv, &mut h);
            assert!(
                next.iter().zip(&f).all(|(s, &x)| s.contains(x)),
                "{next:?} {f:?}"
            );
            assert!(y.iter().zip(&h).all(|(s, &x)| s.contains(x)), "{y:?} {h:?}");
        }
    }
    let unknown = serde_json::from_str::<AnySystem>(r#"{"kind": "van-der-pol", "ts": 1, "x": 1}"#);
    assert!(
        unknown
            .unwrap_err()
            .to_string()
            .contains("unknown field `x`")
    );
}

/// Once its lists have found their sizes, a filter in a loop asks the allocator for what nalgebra's inverse takes and
/// nothing else: 100 steps after 200.
#[test]
fn a_step_in_a_loop_allocates_nothing_but_an_inverse() {
    let (u, y) = data(300);
    for (settings, allowed) in [
        (r#"{"kind": "kalman"}"#, 0),
        (r#"{"kind": "ekf"}"#, 0),
        (r#"{"kind": "ukf"}"#, 0),
        (r#"{"kind": "zmv", "generators": 12}"#, 0),
        (r#"{"kind": "zfo", "generators": 12}"#, 0),
        (r#"{"kind": "czmv", "generators": 12, "constraints": 3}"#, 0),
        (
            r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c1"}"#,
            2,
        ),
        (
            r#"{"kind": "ezgkf", "phi": 12, "eta": 0.5, "alpha": 0.01}"#,
            3,
        ),
        (
            r#"{"kind": "ezgkf-m", "phi": 12, "eta": 0.2, "alpha": 0.01}"#,
            3,
        ),
        (
            r#"{"kind": "ezgkp", "phi": 12, "eta": 0.7, "alpha": 0.01}"#,
            3,
        ),
    ] {
        let mut online = Online::new(AnyEstimator::new(&parse(settings), &problem()).unwrap());
        let mut step = |k: usize| {
            if k > 0 {
                online.advance(&u[k - 1]).unwrap();
            }
            online.measure(&u[k], &y[k]).unwrap();
        };
        (0..=200).for_each(&mut step);
        let asked = measure(|| (201..=300).for_each(&mut step));
        assert!(asked.count_total <= 100 * allowed, "{settings}: {asked:?}");
    }
}
