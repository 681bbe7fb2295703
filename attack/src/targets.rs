//! What is attacked: a kind of estimator on a family of problems.

use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::systems::Linear;
use zonobench_estimation::{AnySystem, EstimatorSettings, Problem, Uncertain};
use zonobench_sets::Matrix;

/// An estimator and the problems it is attacked on.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The paper whose estimator it is.
    pub paper: &'static str,
    /// The name in the tables.
    pub name: &'static str,
    /// The family of problems.
    pub system: &'static str,
    /// Whether the estimator is called guaranteed, in which case none may be lost.
    pub guaranteed: bool,
    /// The last step of a run.
    pub steps: usize,
    /// The share of the bounds that is used, 1 − 10⁻⁹ and not the 1 − 10⁻¹² of an experiment's noise: in units from
    /// 10⁻⁴ to 10⁴ a measurement of a state far from 0 is rounded by up to 10⁻¹⁰ of the bounds of its noise. In twelve dimensions a
    /// truth that is within 10⁻⁹ of a corner is left undecided at the price of a linear program, so there it is 1 − 10⁻⁶. A set
    /// that is too small by less than the rest is not seen to lose anything.
    pub(crate) inside: f64,
    /// Runs of every attack in the default campaign.
    pub runs: u64,
    /// The settings, as JSON.
    pub(crate) settings: &'static str,
    /// The problem of a run.
    pub(crate) problem: fn(u64, u64) -> Problem,
    /// u_k for every k.
    pub(crate) input: &'static [f64],
}

impl Target {
    /// Targets of one system share their problems and differ in nothing but the estimator.
    pub(crate) fn seed(&self) -> u64 {
        seed_of(self.system)
    }
}

/// The seed of a family of problems.
fn seed_of(system: &str) -> u64 {
    // FNV-1a, shifted to leave room for the attack.
    let hash = system.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    });
    hash << 8
}

/// One problem of a user's own, and a guaranteed estimator of it.
#[derive(Clone, Debug)]
pub struct Own {
    /// What the problem is called.
    pub system: String,
    /// What the estimator is called.
    pub estimator: String,
    /// Its settings.
    pub settings: EstimatorSettings,
    /// What it is told.
    pub problem: Problem,
    /// u_0 … u_N; N is the last step.
    pub inputs: Vec<Vec<f64>>,
}

impl Own {
    /// Problems of one name see the same noise.
    pub(crate) fn seed(&self) -> u64 {
        seed_of(&self.system)
    }
}

const LINEAR: Target = Target {
    paper: "box",
    name: "",
    system: "linear",
    guaranteed: true,
    steps: 100,
    inside: 1.0 - 1e-9,
    runs: 40,
    settings: "",
    problem: linear,
    input: &[],
};

const RAIMONDO: Target = Target {
    paper: "cz",
    system: "raimondo",
    problem: raimondo,
    runs: 6,
    ..LINEAR
};

const BUNDLE: Target = Target {
    paper: "bundle",
    ..RAIMONDO
};

const VEHICLE: Target = Target {
    paper: "inzsmf",
    system: "vehicle-se2",
    steps: 500,
    problem: vehicle,
    input: &[0.4, 8.0],
    runs: 6,
    ..LINEAR
};

/// The unicycle of [Khajenejad, Sec. V-B], whose circle stays before its landmarks.
const UNICYCLE: Target = Target {
    system: "unicycle",
    steps: 4,
    runs: 2,
    problem: unicycle,
    ..BUNDLE
};

/// The quadrotor of [Rego2020, Sec. 5.2] near hover: a second, in which it cannot turn over.
const QUADROTOR: Target = Target {
    paper: "cz",
    system: "quadrotor",
    inside: 1.0 - 1e-6,
    runs: 2,
    problem: quadrotor,
    input: &[7.0, 0.4, -0.3, 0.2],
    ..LINEAR
};

/// A vehicle that circles around a radar, which measures its distance and its azimuth: a turn and a half, in which the azimuth jumps
/// where the set lies across the negative axis, and the set may reach the radar.
const RADAR: Target = Target {
    paper: "cz",
    system: "radar",
    steps: 200,
    runs: 4,
    problem: radar,
    ..LINEAR
};

const ZMV: &str = r#"{"kind": "zmv", "generators": 12}"#;
const ZFO: &str = r#"{"kind": "zfo", "generators": 12}"#;
const CZMV: &str = r#"{"kind": "czmv", "generators": 12, "constraints": 3}"#;
const CZFO: &str = r#"{"kind": "czfo", "generators": 12, "constraints": 3, "expansion": "lean"}"#;
const CZMV_TWICE: &str = r#"{"kind": "czmv", "generators": 12, "constraints": 3,
    "measurement": {"passes": 2}}"#;
const ZMV_TWICE: &str = r#"{"kind": "zmv", "generators": 12, "measurement": {"passes": 2}}"#;
const CZFO_PRINTED: &str = r#"{"kind": "czfo", "generators": 12, "constraints": 3, "h": "xb",
    "expansion": "lean", "remainder": "printed"}"#;
const ZMV_12: &str = r#"{"kind": "zmv", "generators": 30}"#;
const ZFO_12: &str = r#"{"kind": "zfo", "generators": 30}"#;
const CZMV_12: &str = r#"{"kind": "czmv", "generators": 30, "constraints": 6, "h": "c2"}"#;
const CZFO_12: &str = r#"{"kind": "czfo", "generators": 30, "constraints": 6, "h": "c3",
    "expansion": "lean"}"#;
const ENCLOSED: &str =
    r#"{"kind": "inzsmf", "generators": 120, "reduction": "girard", "remainder": "enclosed"}"#;

/// Everything that is attacked.
pub const TARGETS: &[Target] = &[
    Target {
        name: "box-state-est",
        settings: r#"{"kind": "box-state-est", "products": "stacked"}"#,
        runs: 500,
        ..LINEAR
    },
    Target {
        name: "box-state-est printed products",
        guaranteed: false,
        settings: r#"{"kind": "box-state-est", "products": "printed"}"#,
        runs: 500,
        ..LINEAR
    },
    Target {
        paper: "cz",
        name: "zmv",
        settings: ZMV,
        ..LINEAR
    },
    Target {
        paper: "cz",
        name: "zfo",
        settings: ZFO,
        ..LINEAR
    },
    Target {
        paper: "cz",
        name: "czmv",
        settings: CZMV,
        runs: 12,
        ..LINEAR
    },
    Target {
        paper: "cz",
        name: "czfo",
        settings: CZFO,
        runs: 6,
        ..LINEAR
    },
    Target {
        name: "zmv",
        settings: ZMV,
        runs: 40,
        ..RAIMONDO
    },
    Target {
        name: "zfo",
        settings: ZFO,
        runs: 40,
        ..RAIMONDO
    },
    Target {
        name: "czmv",
        settings: CZMV,
        runs: 12,
        ..RAIMONDO
    },
    Target {
        name: "czfo",
        settings: CZFO,
        ..RAIMONDO
    },
    Target {
        name: "zmv",
        settings: ZMV_12,
        ..QUADROTOR
    },
    Target {
        name: "zfo",
        settings: ZFO_12,
        ..QUADROTOR
    },
    Target {
        name: "czmv",
        settings: CZMV_12,
        ..QUADROTOR
    },
    Target {
        name: "czfo",
        settings: CZFO_12,
        runs: 1,
        ..QUADROTOR
    },
    Target {
        name: "zmv",
        settings: ZMV,
        ..RADAR
    },
    Target {
        name: "zmv two passes",
        settings: ZMV_TWICE,
        ..RADAR
    },
    Target {
        name: "zfo",
        settings: ZFO,
        ..RADAR
    },
    Target {
        name: "czmv",
        settings: CZMV,
        ..RADAR
    },
    Target {
        name: "czmv two passes",
        settings: CZMV_TWICE,
        ..RADAR
    },
    Target {
        name: "czfo",
        settings: CZFO,
        ..RADAR
    },
    Target {
        name: "czfo printed remainder",
        guaranteed: false,
        settings: CZFO_PRINTED,
        ..RAIMONDO
    },
    Target {
        name: "rrsr",
        settings: r#"{"kind": "rrsr"}"#,
        ..BUNDLE
    },
    Target {
        name: "d-rrsr",
        settings: r#"{"kind": "d-rrsr"}"#,
        ..BUNDLE
    },
    Target {
        name: "d-zb",
        settings: r#"{"kind": "d-zb"}"#,
        ..BUNDLE
    },
    Target {
        name: "d-cz",
        settings: r#"{"kind": "d-cz"}"#,
        ..BUNDLE
    },
    Target {
        name: "comb",
        settings: r#"{"kind": "comb"}"#,
        ..BUNDLE
    },
    Target {
        name: "comb+",
        settings: r#"{"kind": "comb+"}"#,
        ..BUNDLE
    },
    Target {
        name: "lift",
        settings: r#"{"kind": "lift"}"#,
        ..BUNDLE
    },
    Target {
        name: "rrsr",
        settings: r#"{"kind": "rrsr"}"#,
        ..UNICYCLE
    },
    Target {
        name: "d-rrsr",
        settings: r#"{"kind": "d-rrsr"}"#,
        ..UNICYCLE
    },
    Target {
        name: "d-zb",
        settings: r#"{"kind": "d-zb"}"#,
        ..UNICYCLE
    },
    Target {
        name: "d-cz",
        settings: r#"{"kind": "d-cz"}"#,
        ..UNICYCLE
    },
    Target {
        name: "comb",
        settings: r#"{"kind": "comb"}"#,
        ..UNICYCLE
    },
    Target {
        name: "comb+",
        settings: r#"{"kind": "comb+"}"#,
        ..UNICYCLE
    },
    Target {
        name: "lift",
        settings: r#"{"kind": "lift"}"#,
        ..UNICYCLE
    },
    Target {
        name: "inzsmf enclosed",
        settings: ENCLOSED,
        ..VEHICLE
    },
    Target {
        name: "inzsmf remainder dropped",
        guaranteed: false,
        settings: r#"{"kind": "inzsmf", "generators": 120, "reduction": "girard"}"#,
        ..VEHICLE
    },
    Target {
        name: "zsmf",
        guaranteed: false,
        settings: r#"{"kind": "zsmf", "generators": 30}"#,
        ..VEHICLE
    },
];

fn centered(radius: &[f64]) -> Uncertain {
    let lower: Vec<f64> = radius.iter().map(|r| -r).collect();
    Uncertain::from_box(&lower, radius).expect("the bounds are in order")
}

/// Random A, C and boxes; in every second run the states have units from 10⁻⁴ to 10⁴, and some states
/// have no noise.
fn linear(seed: u64, run: u64) -> Problem {
    let mut draws = Draws::new(seed, Purpose::Delta, run);
    let mut next = {
        let mut component = 0;
        move || {
            component += 1;
            draws.uniform(0, component, 0)
        }
    };
    let n = 2 + (1.5 * (1.0 + next())) as usize;
    let outputs = 1 + (1.0 + next()) as usize;
    let unit: Vec<f64> = (0..n)
        .map(|_| {
            let exponent = 4.0 * next();
            if run % 2 == 1 {
                libm::pow(10.0, exponent)
            } else {
                1.0
            }
        })
        .collect();
    let a = Matrix::from_fn(n, n, |i, j| {
        let coefficient = 1.6 / n as f64 * next() + if i == j { 0.4 } else { 0.0 };
        coefficient * unit[i] / unit[j]
    });
    let c = Matrix::from_fn(outputs, n, |_, j| next() / unit[j]);
    let w: Vec<f64> = unit
        .iter()
        .map(|u| {
            let share = next();
            if share < -0.6 {
                0.0
            } else {
                0.1 * u * (1.0 + share)
            }
        })
        .collect();
    let v: Vec<f64> = (0..outputs).map(|_| 0.05 + 0.25 * (1.0 + next())).collect();
    let system = Linear::new(a, None, c, None).expect("the shapes fit");
    Problem {
        system: AnySystem::Linear(system),
        prior: centered(&unit),
        w: centered(&w),
        v: centered(&v),
    }
}

fn named(json: &str) -> AnySystem {
    serde_json::from_str(json).expect("the system's parameters are its own")
}

/// The system of [Rego2020, Eq. (23)] from a box, with a tenth to a half of the noise of ±0.4: more of it
/// on a vertex for good drives the state away.
fn raimondo(seed: u64, run: u64) -> Problem {
    let mut draws = Draws::new(seed, Purpose::Delta, run);
    let mut share = |i| 0.1 + 0.2 * (1.0 + draws.uniform(0, i, 0));
    let noise = |share: f64| vec![0.4 * share; 2];
    Problem {
        system: named(r#"{"kind": "raimondo", "form": "tight"}"#),
        prior: Uncertain::from_box(&[0.1, 0.3], &[0.9, 0.7]).expect("the bounds are in order"),
        w: centered(&noise(share(0))),
        v: centered(&noise(share(1))),
    }
}

/// The vehicle of [Li, Sec. IV] from a start that the enclosing filter can hold.
fn vehicle(_seed: u64, _run: u64) -> Problem {
    let quarter = core::f64::consts::FRAC_PI_2;
    let prior = Uncertain::zonotope(vec![quarter, 0.0, 0.0], Matrix::diagonal(&[0.1, 0.5, 0.5]));
    Problem {
        system: named(r#"{"kind": "vehicle-se2", "dt": 0.01, "form": "euler"}"#),
        prior,
        w: centered(&[0.1; 3]),
        v: centered(&[1.0; 2]),
    }
}

/// The unicycle of [Khajenejad, Sec. V-B] from a heading anywhere, with half to all of the noise printed.
fn unicycle(seed: u64, run: u64) -> Problem {
    let mut draws = Draws::new(seed, Purpose::Delta, run);
    let mut draw = |i| draws.uniform(0, i, 0);
    let heading = core::f64::consts::PI * draw(0);
    let (w, v) = (0.75 + 0.25 * draw(1), 0.75 + 0.25 * draw(2));
    let within = |share: f64, bounds: &[[f64; 2]]| {
        let [lower, upper] =
            [0, 1].map(|end| bounds.iter().map(|b| share * b[end]).collect::<Vec<f64>>());
        Uncertain::from_box(&lower, &upper).expect("the bounds are in order")
    };
    let prior = [[0.05, 0.15], [0.145, 0.255], [heading - 0.2, heading + 0.2]];
    Problem {
        system: named(
            r#"{"kind": "unicycle", "t0": 1.0, "phi_omega": 0.3, "phi_theta": 0.15,
                "landmarks": [[5.0, 15.0], [15.0, 15.0]]}"#,
        ),
        prior: within(1.0, &prior),
        w: within(w, &[[-0.06, 0.04], [-0.04, 0.02], [-0.08, 0.04]]),
        v: within(
            v,
            &[[-0.01, 0.01], [-0.01, 0.02], [-0.02, 0.01], [-0.03, 0.02]],
        ),
    }
}

/// A vehicle of constant speed on a circle of 4 m around a radar, from anywhere on it, with half to all of its noise.
fn radar(seed: u64, run: u64) -> Problem {
    let mut draws = Draws::new(seed, Purpose::Delta, run);
    let mut draw = |i| draws.uniform(0, i, 0);
    let azimuth = core::f64::consts::PI * draw(0);
    let (w, v) = (0.75 + 0.25 * draw(1), 0.75 + 0.25 * draw(2));
    let heading = azimuth + core::f64::consts::FRAC_PI_2;
    let start = [4.0 * libm::cos(azimuth), 4.0 * libm::sin(azimuth), heading];
    let around = |radius: [f64; 3]| {
        let ends = [-1.0, 1.0].map(|s| [0, 1, 2].map(|i| start[i] + s * radius[i]));
        Uncertain::from_box(&ends[0], &ends[1]).expect("the bounds are in order")
    };
    Problem {
        system: named(
            r#"{"kind": "equations",
                "x": [["px", "m"], ["py", "m"], ["theta", "rad"]], "u": [],
                "w": [["wx", "m"], ["wy", "m"], ["wt", "rad"]],
                "y": [["range", "m"], ["azimuth", "rad"]], "v": [["vr", "m"], ["va", "rad"]],
                "parameters": [["way", 0.2], ["turn", 0.05]], "definitions": [],
                "motion": {"next": [["px", "px + way*cos(theta) + wx"], ["py", "py + way*sin(theta) + wy"],
                    ["theta", "theta + turn + wt"]]},
                "output": [["range", "hypot(px, py) + vr"], ["azimuth", "atan2(py, px) + va"]],
                "period": 0.1}"#,
        ),
        prior: around([0.3, 0.3, 0.1]),
        w: centered(&[0.005 * w, 0.005 * w, 0.002 * w]),
        v: centered(&[0.05 * v, 0.02 * v]),
    }
}

/// The quadrotor of [Rego2020, Sec. 5.2] with half to all of its noise, from smaller angles and turn rates than
/// printed: at most 0.2 + 0.1 t + 0.05 t² rad of roll and pitch, were they alone.
fn quadrotor(seed: u64, run: u64) -> Problem {
    let mut draws = Draws::new(seed, Purpose::Delta, run);
    let mut share = |i| 0.75 + 0.25 * draws.uniform(0, i, 0);
    let (w, v) = (share(0), share(1));
    let prior = [2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 0.2, 0.2, 1.0, 0.1, 0.1, 0.1];
    let measured = [
        0.15, 0.15, 0.51, 2.618e-3, 2.618e-3, 2.618e-3, 16.558e-3, 16.558e-3, 16.558e-3,
    ];
    Problem {
        system: named(
            r#"{"kind": "quadrotor", "m": 0.7, "l": 0.3, "inertia": [1.2416, 1.2416, 1.2416],
                "g": 9.81, "dt": 0.01}"#,
        ),
        prior: centered(&prior),
        w: centered(&[w; 3]),
        v: centered(&measured.map(|m| v * m)),
    }
}
