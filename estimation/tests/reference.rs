//! Values from an independent implementation (numpy and scipy, double precision, no outward rounding),
//! kept as data in `tests/reference/`, against what `track` gives.
//!
//! The tolerance is 1e-9 absolute: outward rounding, another order of summation and another
//! eigenvalue routine move these numbers by at most about 1e-13.

use serde::Deserialize;
use zonobench_estimation::estimators::{
    BoxStateEstSettings, EzgkfSettings, EzgkpSettings, Form, Gain, KalmanSettings, Products,
    printed_width_bound, width_bound,
};
use zonobench_estimation::systems::{Linear, Lpv, VanDerPol};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, EstimatorSettings, Problem, Step, Uncertain, track,
};
use zonobench_sets::Matrix;

const TOLERANCE: f64 = 1e-9;

fn read<T: for<'a> Deserialize<'a>>(name: &str) -> T {
    let path = format!("{}/tests/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn assert_close(what: &str, k: usize, got: &[f64], expected: &[f64]) {
    assert_eq!(got.len(), expected.len(), "{what} at k = {k}");
    for (g, e) in got.iter().zip(expected) {
        assert!(
            (g - e).abs() <= TOLERANCE,
            "{what} at k = {k}: {got:?}, expected {expected:?}"
        );
    }
}

fn given(y: &[Vec<f64>]) -> Vec<Vec<Option<f64>>> {
    y.iter()
        .map(|y| y.iter().map(|&y| Some(y)).collect())
        .collect()
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Box1 {
    system: BoxSystem,
    d_box: [Vec<f64>; 2],
    v_box: [Vec<f64>; 2],
    x0_box: [Vec<f64>; 2],
    kf: BoxKalman,
    y: Vec<Vec<f64>>,
    expected: BoxExpected,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct BoxSystem {
    A: Matrix,
    C: Matrix,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct BoxKalman {
    xe: Vec<f64>,
    G0: Matrix,
    Gd: Matrix,
    Gv: Matrix,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct BoxExpected {
    beta_printed: [f64; 2],
    beta_corrected_tight: [f64; 2],
    box_lo: Vec<Vec<f64>>,
    box_hi: Vec<Vec<f64>>,
    pred_lo: Vec<Vec<f64>>,
    pred_hi: Vec<Vec<f64>>,
    xhat: Vec<Vec<f64>>,
    kf_x_pred: Vec<Vec<f64>>,
    kf_G_pred: Vec<Matrix>,
    kf_x_filt: Vec<Vec<f64>>,
    kf_G_filt: Vec<Matrix>,
}

fn run(settings: &EstimatorSettings, problem: &Problem, y: &[Vec<f64>]) -> Vec<Step<AnyBelief>> {
    let estimator = AnyEstimator::new(settings, problem).unwrap();
    let u = vec![
        vec![
            0.0;
            zonobench_estimation::System::variables(&problem.system)
                .u
                .len()
        ];
        y.len()
    ];
    track(&estimator, y.len() - 1, &u, &given(y)).collect()
}

fn scenario_a() -> (Box1, Problem) {
    let file: Box1 = read("box_scenario_a");
    let system = Linear::new(file.system.A.clone(), None, file.system.C.clone(), None).unwrap();
    let of = |b: &[Vec<f64>; 2]| Uncertain::from_box(&b[0], &b[1]).unwrap();
    let problem = Problem {
        system: AnySystem::Linear(system),
        prior: Uncertain {
            mean: Some(file.kf.xe.clone()),
            covariance: Some(file.kf.G0.clone()),
            ..of(&file.x0_box)
        },
        w: Uncertain {
            covariance: Some(file.kf.Gd.clone()),
            ..of(&file.d_box)
        },
        v: Uncertain {
            covariance: Some(file.kf.Gv.clone()),
            ..of(&file.v_box)
        },
    };
    (file, problem)
}

#[test]
fn box_state_est_gives_the_boxes_of_scenario_a() {
    let (file, problem) = scenario_a();
    // For n = 2 both readings of the products agree.
    for products in [Products::Stacked, Products::Printed] {
        let settings = EstimatorSettings::BoxStateEst(BoxStateEstSettings {
            products,
            ..Default::default()
        });
        let steps = run(&settings, &problem, &file.y);
        assert_eq!(steps.len(), 120);
        let mut widest: f64 = 0.0;
        for Step {
            k,
            predicted,
            updated,
        } in steps
        {
            let predicted = predicted.unwrap().interval_hull().unwrap();
            assert_close(
                "predicted lower",
                k,
                &predicted.lower(),
                &file.expected.pred_lo[k],
            );
            assert_close(
                "predicted upper",
                k,
                &predicted.upper(),
                &file.expected.pred_hi[k],
            );
            let updated = updated.unwrap();
            assert_close("center", k, &updated.center(), &file.expected.xhat[k]);
            let hull = updated.interval_hull().unwrap();
            assert_close("lower", k, &hull.lower(), &file.expected.box_lo[k]);
            assert_close("upper", k, &hull.upper(), &file.expected.box_hi[k]);
            if k >= 1 {
                widest = hull.widths().into_iter().fold(widest, f64::max);
            }
        }
        let (a, c) = (&file.system.A, &file.system.C);
        let bound = width_bound(a, c).unwrap().width(2.0, 2.0);
        assert!(
            widest <= bound + TOLERANCE && widest > bound - 1e-3,
            "{widest} of {bound}"
        );
    }
}

#[test]
fn the_width_bounds_are_those_of_scenario_a() {
    let (file, _) = scenario_a();
    let (a, c) = (&file.system.A, &file.system.C);
    let (corrected, printed) = (
        width_bound(a, c).unwrap(),
        printed_width_bound(a, c).unwrap(),
    );
    assert_close(
        "bound",
        0,
        &[corrected.of_v, corrected.of_d],
        &file.expected.beta_corrected_tight,
    );
    assert_close(
        "printed bound",
        0,
        &[printed.of_v, printed.of_d],
        &file.expected.beta_printed,
    );
}

#[test]
fn the_kalman_filter_gives_the_estimates_of_scenario_a() {
    let (file, problem) = scenario_a();
    for Step {
        k,
        predicted,
        updated,
    } in run(
        &EstimatorSettings::Kalman(KalmanSettings {}),
        &problem,
        &file.y,
    ) {
        let (predicted, updated) = (predicted.unwrap(), updated.unwrap());
        assert_close(
            "x predicted",
            k,
            &predicted.center(),
            &file.expected.kf_x_pred[k],
        );
        assert_close(
            "x updated",
            k,
            &updated.center(),
            &file.expected.kf_x_filt[k],
        );
        let p = |b: &AnyBelief| b.covariance().unwrap().as_slice().to_vec();
        assert_close(
            "P predicted",
            k,
            &p(&predicted),
            file.expected.kf_G_pred[k].as_slice(),
        );
        assert_close(
            "P updated",
            k,
            &p(&updated),
            file.expected.kf_G_filt[k].as_slice(),
        );
    }
}

#[derive(Deserialize)]
struct Mixed {
    system: MixedSystem,
    expected: std::collections::BTreeMap<String, Vec<MixedStep>>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct MixedSystem {
    model: String,
    A0: Option<Matrix>,
    Ai: Option<Vec<Matrix>>,
    Ts: Option<f64>,
    B: Matrix,
    C: Matrix,
    y: Vec<Vec<f64>>,
    c0: Vec<f64>,
    G0: Matrix,
    P0: Matrix,
    Gw: Matrix,
    Q: Matrix,
    Gv: Matrix,
    R: Matrix,
    eta: f64,
    alpha: f64,
    phi_g: usize,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct MixedStep {
    k: usize,
    c: Vec<f64>,
    lo: Vec<f64>,
    hi: Vec<f64>,
    P: Matrix,
    trGGt: f64,
    n_g: usize,
}

fn mixed_agrees(name: &str) {
    let file: Mixed = read(name);
    let s = &file.system;
    let system = match s.model.as_str() {
        "lpv" => AnySystem::Lpv(
            Lpv::new(
                s.A0.clone().unwrap(),
                s.Ai.clone().unwrap(),
                Some(s.B.clone()),
                s.C.clone(),
            )
            .unwrap(),
        ),
        "vdp" => AnySystem::VanDerPol(VanDerPol::new(s.Ts.unwrap()).unwrap()),
        other => panic!("{other}"),
    };
    let both = |center: Vec<f64>, g: &Matrix, p: &Matrix| Uncertain {
        covariance: Some(p.clone()),
        ..Uncertain::zonotope(center, g.clone())
    };
    let problem = Problem {
        system,
        prior: both(s.c0.clone(), &s.G0, &s.P0),
        w: both(vec![0.0; 2], &s.Gw, &s.Q),
        v: both(vec![0.0], &s.Gv, &s.R),
    };
    let filter = EzgkfSettings {
        phi: s.phi_g,
        eta: s.eta,
        alpha: s.alpha,
        gain: Gain::Optimal,
        overbars: true,
        merge_parallel: false,
        scale: Default::default(),
    };
    let predictor = |form| {
        EstimatorSettings::Ezgkp(EzgkpSettings {
            phi: s.phi_g,
            eta: s.eta,
            alpha: s.alpha,
            gain: Gain::Optimal,
            overbars: true,
            merge_parallel: false,
            scale: Default::default(),
            form,
        })
    };
    assert_eq!(file.expected.len(), 4);
    for (variant, expected) in &file.expected {
        let settings = match variant.as_str() {
            "EZGKF" => EstimatorSettings::Ezgkf(filter.clone()),
            "EZGKF-M" => EstimatorSettings::EzgkfM(filter.clone()),
            "EZGKP" => predictor(Form::Ak),
            "EZGKP_direct" => predictor(Form::Direct),
            other => panic!("{other}"),
        };
        let steps = run(&settings, &problem, &s.y);
        assert_eq!(steps.len(), expected.len());
        for (step, e) in steps.into_iter().zip(expected) {
            let what = |part: &str| format!("{name} {variant} {part}");
            assert_eq!(step.k, e.k);
            // The predictor's updated belief is its predicted one.
            let belief = step.updated.unwrap();
            assert_close(&what("c"), e.k, &belief.center(), &e.c);
            let hull = belief.interval_hull().unwrap();
            assert_close(&what("lower"), e.k, &hull.lower(), &e.lo);
            assert_close(&what("upper"), e.k, &hull.upper(), &e.hi);
            assert_close(
                &what("P"),
                e.k,
                belief.covariance().unwrap().as_slice(),
                e.P.as_slice(),
            );
            let size = belief.size();
            assert_close(&what("tr GG'"), e.k, &[size.trace_ggt.unwrap()], &[e.trGGt]);
            assert_eq!(
                size.n_generators,
                Some(e.n_g),
                "{} at k = {}",
                what("order"),
                e.k
            );
        }
    }
}

#[test]
fn the_mixed_filters_agree_on_the_lpv_system() {
    mixed_agrees("ezgkf_lpv_phi30");
}

#[test]
fn the_mixed_filters_agree_on_the_van_der_pol_oscillator() {
    mixed_agrees("ezgkf_vdp_phi12");
}
