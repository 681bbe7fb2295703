//! The bits of everything that the estimators compute, as one number a pair of system and estimator.
//!
//! Sums and products have a fixed order, nothing is fused and elementary functions are libm's, so these
//! numbers are the same whatever the optimiser does and whichever instructions it may use. Kinds are run on
//! every system that they take, on noise addressed by (seed, step, component); a missing measurement and the
//! text of an error count as well.

use std::fmt::Write;
use zonobench_estimation::estimator::{KINDS, Shape, Size};
use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::simulate::{InitialState, Inputs, Noise, Truth};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, AnySystem, Belief, Problem, System, Uncertain, simulate, track,
};
use zonobench_sets::{IntervalVector, Matrix};

/// FNV-1a, 64 bits.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn count(&mut self, n: usize) {
        self.bytes(&(n as u64).to_le_bytes());
    }

    fn optional<T>(&mut self, x: Option<T>, hash: impl FnOnce(&mut Self, T)) {
        self.bytes(&[u8::from(x.is_some())]);
        if let Some(x) = x {
            hash(self, x);
        }
    }

    fn number(&mut self, x: f64) {
        // The sign and the payload of a NaN are the processor's choice.
        let bits = if x.is_nan() { u64::MAX } else { x.to_bits() };
        self.bytes(&bits.to_le_bytes());
    }

    fn numbers(&mut self, x: &[f64]) {
        self.count(x.len());
        x.iter().for_each(|&x| self.number(x));
    }

    fn matrix(&mut self, m: &Matrix) {
        self.count(m.cols());
        self.numbers(m.as_slice());
    }

    fn sides(&mut self, sides: &IntervalVector) {
        self.numbers(&sides.lower());
        self.numbers(&sides.upper());
    }

    fn belief(&mut self, belief: &AnyBelief) {
        self.numbers(&belief.center());
        self.optional(belief.interval_hull(), |h, x| h.sides(&x));
        self.optional(belief.covariance(), Self::matrix);
        self.optional(belief.volume(), Self::number);
        let Size {
            n_generators,
            n_constraints,
            trace_ggt,
            radius,
            volume,
            lp_count,
            pivots,
            // What they did is in the bits of the set.
            unfinished: _,
            fallbacks: _,
        } = belief.size();
        self.optional(n_generators, Self::count);
        self.optional(n_constraints, Self::count);
        for x in [trace_ggt, radius, volume] {
            self.optional(x, Self::number);
        }
        self.count(lp_count);
        self.count(pivots);
        let Shape {
            kind,
            center,
            generators,
            constraints,
            covariance,
            bounds,
        } = belief.shape();
        self.bytes(kind.as_bytes());
        self.numbers(&center);
        self.optional(generators, |h, x| h.matrix(&x));
        self.optional(constraints, |h, (a, b)| {
            h.matrix(&a);
            h.numbers(&b);
        });
        self.optional(covariance, |h, x| h.matrix(&x));
        self.optional(bounds, |h, x| h.sides(&x));
        for (name, x) in belief.extras() {
            self.bytes(name.as_bytes());
            self.number(x);
        }
    }
}

/// A system with the half-widths of its first state and noises, and the inputs.
struct Setting {
    name: &'static str,
    system: &'static str,
    center: &'static [f64],
    prior: &'static [f64],
    w: &'static [f64],
    v: &'static [f64],
    u: &'static [f64],
    steps: usize,
}

const SETTINGS: [Setting; 8] = [
    Setting {
        name: "linear",
        system: r#"{"kind": "linear", "a": [[0.9, 0.3, 0.0], [-0.2, 0.8, 0.1], [0.0, 0.1, 0.7]],
            "b": [[0.3], [0.0], [1.1]], "c": [[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]}"#,
        center: &[0.1, -0.3, 2.0],
        prior: &[1.0, 0.7, 0.3],
        w: &[0.1, 0.03, 0.07],
        v: &[0.3, 0.11],
        u: &[0.7],
        steps: 4,
    },
    Setting {
        name: "lpv",
        system: r#"{"kind": "lpv", "a0": [[0.0, -0.5], [1.0, 1.0]], "a": [[[0.0, 0.0], [0.0, 0.3]]],
            "c": [[-2.0, 1.0]]}"#,
        center: &[0.3, -0.1],
        prior: &[0.3, 0.1],
        w: &[0.06, 0.01],
        v: &[0.1],
        u: &[],
        steps: 20,
    },
    Setting {
        name: "van-der-pol",
        system: r#"{"kind": "van-der-pol", "ts": 0.1}"#,
        center: &[0.7, 0.3],
        prior: &[0.3, 0.1],
        w: &[0.01, 0.03],
        v: &[0.1],
        u: &[],
        steps: 6,
    },
    Setting {
        name: "raimondo",
        system: r#"{"kind": "raimondo", "form": "tight"}"#,
        center: &[0.5, 0.5],
        prior: &[0.3, 0.1],
        w: &[0.11, 0.1],
        v: &[0.13, 0.2],
        u: &[],
        steps: 6,
    },
    Setting {
        name: "unicycle",
        system: r#"{"kind": "unicycle", "t0": 1.0, "phi_omega": 0.3, "phi_theta": 0.15,
            "landmarks": [[5.0, 15.0], [15.0, 15.0]]}"#,
        center: &[0.1, 0.2, 1.0],
        prior: &[0.05, 0.055, 0.2],
        w: &[0.05, 0.03, 0.06],
        v: &[0.01, 0.015, 0.02, 0.02],
        u: &[],
        steps: 1,
    },
    Setting {
        name: "quadrotor",
        system: r#"{"kind": "quadrotor", "m": 0.7, "l": 0.3, "inertia": [1.2, 1.3, 1.7],
            "g": 9.81, "dt": 0.01}"#,
        center: &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.2, 0.0, 0.0, 0.0],
        prior: &[
            0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.03, 0.03, 0.03,
        ],
        w: &[0.3, 0.3, 0.3],
        v: &[0.05; 9],
        u: &[6.9, 0.03, -0.02, 0.01],
        steps: 1,
    },
    Setting {
        name: "vehicle-se2 euler",
        system: r#"{"kind": "vehicle-se2", "dt": 0.01, "form": "euler"}"#,
        center: &[0.7, 0.0, 0.0],
        prior: &[0.1, 0.5, 0.5],
        w: &[0.1; 3],
        v: &[1.0; 2],
        u: &[0.4, 8.0],
        steps: 8,
    },
    Setting {
        name: "vehicle-se2 group",
        system: r#"{"kind": "vehicle-se2", "dt": 0.01, "form": "group"}"#,
        center: &[0.7, 0.0, 0.0],
        prior: &[0.1, 0.5, 0.5],
        w: &[0.1; 3],
        v: &[1.0; 2],
        u: &[0.4, 8.0],
        steps: 8,
    },
];

/// The readings of every kind: what its file would have beside `kind`.
fn readings(kind: &str, n: usize) -> Vec<String> {
    let some = |list: &[&str]| list.iter().map(|s| (*s).to_owned()).collect();
    match kind {
        "ezgkf" | "ezgkf-m" | "ezgkp" => {
            vec![format!(r#""phi": {}, "eta": 0.5, "alpha": 0.01"#, 8 * n)]
        }
        "zmv" | "zfo" => vec![format!(r#""generators": {}"#, 3 * n)],
        "czmv" => vec![format!(r#""generators": {}, "constraints": 2"#, 3 * n)],
        "czfo" => vec![format!(
            r#""generators": {}, "constraints": 2, "expansion": "{}""#,
            3 * n,
            if n > 3 { "lean" } else { "full" }
        )],
        "zsmf" => some(&[r#""generators": 30"#]),
        "inzsmf" => some(&[
            r#""generators": 30"#,
            r#""generators": 60, "reduction": "girard", "remainder": "enclosed""#,
        ]),
        _ => some(&[""]),
    }
}

/// A set with a covariance beside it, for the kinds that need one.
fn uncertain(center: &[f64], radius: &[f64]) -> Uncertain {
    let deviations: Vec<f64> = radius.iter().map(|r| r * r / 9.0).collect();
    Uncertain {
        covariance: Some(Matrix::diagonal(&deviations)),
        ..Uncertain::zonotope(center.to_vec(), Matrix::diagonal(radius))
    }
}

impl Setting {
    fn problem(&self, with_covariance: bool) -> Result<Problem, String> {
        let system: AnySystem = serde_json::from_str(self.system).map_err(|e| e.to_string())?;
        let part = |center: &[f64], radius: &[f64]| match with_covariance {
            true => uncertain(center, radius),
            false => Uncertain::zonotope(center.to_vec(), Matrix::diagonal(radius)),
        };
        let zero = |like: &[f64]| vec![0.0; like.len()];
        Problem::new(
            system,
            part(self.center, self.prior),
            part(&zero(self.w), self.w),
            part(&zero(self.v), self.v),
        )
        .map_err(|e| e.to_string())
    }

    /// Noise well inside its box at every step.
    fn noise(&self, purpose: Purpose, radius: &[f64], rows: usize) -> Vec<Vec<f64>> {
        let mut draws = Draws::new(17, purpose, 0);
        (0..rows)
            .map(|k| {
                let one = |(i, r): (usize, &f64)| 0.75 * r * draws.uniform(k, i, 0);
                radius.iter().enumerate().map(one).collect()
            })
            .collect()
    }

    /// The lines of this system: its name, a kind with its reading, and the number.
    fn lines(&self) -> Result<Vec<String>, String> {
        let problem = self.problem(false)?;
        let shift = &self.noise(Purpose::X0, self.prior, 1)[0];
        let x0 = self.center.iter().zip(shift).map(|(c, s)| c + s).collect();
        let truth = Truth {
            x0: InitialState::Point(x0),
            w: Noise::Data(self.noise(Purpose::W, self.w, self.steps)),
            v: Noise::Data(self.noise(Purpose::V, self.v, self.steps + 1)),
            delta: Truth::assumed_delta(&problem.system),
        };
        let inputs = Inputs::Constant(self.u.to_vec());
        let data = simulate(&problem.system, &truth, &inputs, 17, 0, self.steps)
            .map_err(|e| e.to_string())?;
        let mut hash = Hash::new();
        for rows in [&data.x, &data.y, &data.rounding] {
            rows.iter().for_each(|row| hash.numbers(row));
        }
        let mut lines = vec![format!("{}, data: {:016x}", self.name, hash.0)];
        let measured: Vec<Vec<Option<f64>>> = data
            .y
            .iter()
            .enumerate()
            .map(|(k, y)| {
                let seen = |(i, &y): (usize, &f64)| ((k + i) % 7 != 3).then_some(y);
                y.iter().enumerate().map(seen).collect()
            })
            .collect();
        let n = problem.system.variables().x.len();
        for info in KINDS {
            for reading in readings(info.kind, n) {
                let comma = if reading.is_empty() { "" } else { ", " };
                let text = format!(r#"{{"kind": "{}"{comma}{reading}}}"#, info.kind);
                let settings = serde_json::from_str(&text).map_err(|e| format!("{text}: {e}"))?;
                // Sets alone where that is enough; a kind that does not take the system has no line.
                let made = [false, true].into_iter().find_map(|with_covariance| {
                    let problem = self.problem(with_covariance).ok()?;
                    AnyEstimator::new(&settings, &problem).ok()
                });
                let Some(estimator) = made else { continue };
                let mut hash = Hash::new();
                let mut steps = 0;
                for step in track(&estimator, self.steps, &data.u, &measured) {
                    hash.optional(step.predicted.as_ref(), Hash::belief);
                    match &step.updated {
                        Ok(belief) => {
                            steps += 1;
                            hash.belief(belief);
                        }
                        Err(error) => hash.bytes(error.to_string().as_bytes()),
                    }
                }
                let mut line = format!("{}, {}", self.name, info.kind);
                if !reading.is_empty() {
                    let _ = write!(line, " ({})", reading.replace('"', ""));
                }
                lines.push(format!("{line}, {steps} sets: {:016x}", hash.0));
            }
        }
        Ok(lines)
    }
}

/// One line a system and estimator, and the number of all of them at the end.
///
/// Fails with a text that says which system could not be simulated.
pub fn bits() -> Result<String, String> {
    let mut text = String::new();
    for setting in &SETTINGS {
        let lines = setting
            .lines()
            .map_err(|e| format!("{}: {e}", setting.name))?;
        for line in lines {
            text += &line;
            text.push('\n');
        }
    }
    let mut hash = Hash::new();
    hash.bytes(text.as_bytes());
    let _ = writeln!(text, "all: {:016x}", hash.0);
    Ok(text)
}
