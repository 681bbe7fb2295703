//! Deterministic signals: periodic waves, constants and piecewise constants, as functions of the step.
//!
//! A component of a noise or an input is a list of terms that add up. With p the period (in steps), ψ
//! the phase (rad) and τ(k) = ((k mod p)/p + ψ/2π) mod 1 the fraction of the period that has passed:
//!
//! | kind | value, times `amplitude`, plus `offset` |
//! |---|---|
//! | `saw` | 2τ − 1: from −1 up to 1 |
//! | `sawdown` | 1 − 2τ: from 1 down to −1 |
//! | `square` | +1 for τ < 1/2, else −1 |
//! | `triangle` | 4τ − 1 for τ < 1/2, else 3 − 4τ: from −1 up to 1 and back |
//! | `sine`, `cosine` | sin θ, cos θ with θ = 2πτ, or θ = ω·k·dt + ψ where `omega` is given |
//! | `constant` | `value` (neither amplitude nor offset) |
//! | `pieces` | `value[i]`, where i is the number of entries of `at` that are ≤ k |
//!
//! `omega` is in radians per unit of time, and `dt` is the time a step takes; `dt` = 1 when it is not
//! given, so that ω is then in radians per step.

use crate::error::shortest;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// One term of a signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Signal {
    /// `amplitude` · (2τ − 1) + `offset`.
    Saw(Wave),
    /// `amplitude` · (1 − 2τ) + `offset`.
    Sawdown(Wave),
    /// `amplitude` · (+1 for τ < 1/2, else −1) + `offset`.
    Square(Wave),
    /// `amplitude` · (4τ − 1 for τ < 1/2, else 3 − 4τ) + `offset`.
    Triangle(Wave),
    /// `amplitude` · sin θ + `offset`.
    Sine(Oscillation),
    /// `amplitude` · cos θ + `offset`.
    Cosine(Oscillation),
    /// `value` at every step.
    Constant {
        /// The value.
        value: f64,
    },
    /// `value[i]`, i the number of entries of `at` that are ≤ k.
    Pieces {
        /// The steps at which the value changes, ascending.
        at: Vec<usize>,
        /// The values, one more than `at` has steps.
        value: Vec<f64>,
    },
}

/// The parameters of a periodic wave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// p > 0, in steps.
    pub period: f64,
    /// The factor; 1 if not given.
    #[serde(default = "one")]
    pub amplitude: f64,
    /// What is added; 0 if not given.
    #[serde(default)]
    pub offset: f64,
    /// ψ, in rad; 0 if not given.
    #[serde(default)]
    pub phase: f64,
}

/// The parameters of a sine or cosine: either `period`, or `omega` with an optional `dt`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Oscillation {
    /// p > 0, in steps.
    #[serde(default)]
    pub period: Option<f64>,
    /// ω, in rad per unit of time.
    #[serde(default)]
    pub omega: Option<f64>,
    /// The time a step takes; 1 if not given.
    #[serde(default)]
    pub dt: Option<f64>,
    /// The factor; 1 if not given.
    #[serde(default = "one")]
    pub amplitude: f64,
    /// What is added; 0 if not given.
    #[serde(default)]
    pub offset: f64,
    /// ψ, in rad; 0 if not given.
    #[serde(default)]
    pub phase: f64,
}

fn one() -> f64 {
    1.0
}

/// What is wrong with a signal.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: expected {expected}, got {got}")]
pub struct SignalError {
    /// The key.
    pub key: &'static str,
    /// What was expected.
    pub expected: &'static str,
    /// What came.
    pub got: String,
}

/// (kind, keys it accepts besides `kind`) of every signal.
pub const SIGNAL_KEYS: &[(&str, &[&str])] = &[
    ("saw", WAVE_KEYS),
    ("sawdown", WAVE_KEYS),
    ("square", WAVE_KEYS),
    ("triangle", WAVE_KEYS),
    ("sine", OSCILLATION_KEYS),
    ("cosine", OSCILLATION_KEYS),
    ("constant", &["value"]),
    ("pieces", &["at", "value"]),
];
const WAVE_KEYS: &[&str] = &["period", "amplitude", "offset", "phase"];
const OSCILLATION_KEYS: &[&str] = &["period", "omega", "dt", "amplitude", "offset", "phase"];

impl Signal {
    /// The value at step `k`, by the formulas of this module.
    pub fn at(&self, k: usize) -> f64 {
        match self {
            Signal::Saw(w) => w.scaled(2.0 * w.fraction(k) - 1.0),
            Signal::Sawdown(w) => w.scaled(1.0 - 2.0 * w.fraction(k)),
            Signal::Square(w) => w.scaled(if w.fraction(k) < 0.5 { 1.0 } else { -1.0 }),
            Signal::Triangle(w) => {
                let t = w.fraction(k);
                w.scaled(if t < 0.5 {
                    4.0 * t - 1.0
                } else {
                    3.0 - 4.0 * t
                })
            }
            Signal::Sine(o) => o.amplitude * libm::sin(o.angle(k)) + o.offset,
            Signal::Cosine(o) => o.amplitude * libm::cos(o.angle(k)) + o.offset,
            Signal::Constant { value } => *value,
            Signal::Pieces { at, value } => value[at.iter().filter(|&&start| start <= k).count()],
        }
    }

    /// Checks the parameters: finite, a positive period, exactly one of period and omega, pieces that
    /// ascend with one value more than there are changes.
    pub fn validate(&self) -> Result<(), SignalError> {
        match self {
            Signal::Saw(w) | Signal::Sawdown(w) | Signal::Square(w) | Signal::Triangle(w) => {
                positive("period", w.period)?;
                finite("amplitude", w.amplitude)?;
                finite("offset", w.offset)?;
                finite("phase", w.phase)
            }
            Signal::Sine(o) | Signal::Cosine(o) => {
                match (o.period, o.omega) {
                    (Some(period), None) => positive("period", period)?,
                    (None, Some(omega)) => finite("omega", omega)?,
                    (Some(_), Some(_)) => {
                        return Err(error("omega", "either period or omega", "both"));
                    }
                    (None, None) => {
                        return Err(error("period", "either period or omega", "neither"));
                    }
                }
                match (o.dt, o.omega) {
                    (Some(_), None) => return Err(error("dt", "omega beside dt", "period")),
                    (Some(dt), _) => positive("dt", dt)?,
                    (None, _) => {}
                }
                finite("amplitude", o.amplitude)?;
                finite("offset", o.offset)?;
                finite("phase", o.phase)
            }
            Signal::Constant { value } => finite("value", *value),
            Signal::Pieces { at, value } => {
                if let Some(pair) = at.windows(2).find(|pair| pair[0] >= pair[1]) {
                    return Err(error(
                        "at",
                        "ascending steps",
                        format!("{} before {}", pair[0], pair[1]),
                    ));
                }
                if value.len() != at.len() + 1 {
                    let got = format!("{} values for {} changes", value.len(), at.len());
                    return Err(error("value", "one value more than there are changes", got));
                }
                value.iter().try_for_each(|&x| finite("value", x))
            }
        }
    }
}

fn error(key: &'static str, expected: &'static str, got: impl Into<String>) -> SignalError {
    SignalError {
        key,
        expected,
        got: got.into(),
    }
}

fn finite(key: &'static str, x: f64) -> Result<(), SignalError> {
    if x.is_finite() {
        Ok(())
    } else {
        Err(error(key, "a finite number", shortest(x)))
    }
}

fn positive(key: &'static str, x: f64) -> Result<(), SignalError> {
    if x.is_finite() && x > 0.0 {
        Ok(())
    } else {
        Err(error(key, "a positive number", shortest(x)))
    }
}

/// τ of a period at step `k`; the remainder and, without a phase, the quotient are correctly rounded.
fn fraction(k: usize, period: f64, phase: f64) -> f64 {
    let passed = (k as f64 % period) / period;
    if phase == 0.0 {
        return passed;
    }
    let shifted = passed + phase / (2.0 * PI);
    shifted - shifted.floor()
}

impl Wave {
    fn fraction(&self, k: usize) -> f64 {
        fraction(k, self.period, self.phase)
    }

    fn scaled(&self, value: f64) -> f64 {
        self.amplitude * value + self.offset
    }
}

impl Oscillation {
    fn angle(&self, k: usize) -> f64 {
        match (self.omega, self.period) {
            (Some(omega), _) => omega * (k as f64 * self.dt.unwrap_or(1.0)) + self.phase,
            (None, Some(period)) => 2.0 * PI * fraction(k, period, self.phase),
            // Refused by `validate`; a wave without a frequency stands still.
            (None, None) => self.phase,
        }
    }
}

/// The sum of the terms at step `k`, added in order; 0 without terms.
pub fn sum_at(terms: &[Signal], k: usize) -> f64 {
    terms.iter().fold(0.0, |s, term| s + term.at(k))
}

/// Which alternative each component takes in run `run`, where component i has `counts[i]` of them: the
/// digits of `run` in the mixed radix of the counts, the last component varying fastest. Runs beyond
/// the product of the counts start again from the first.
pub fn mixed_radix(run: u64, counts: &[usize]) -> Vec<usize> {
    let mut rest = run;
    let mut digits = vec![0; counts.len()];
    for (digit, &count) in digits.iter_mut().zip(counts).rev() {
        let count = count.max(1) as u64;
        *digit = (rest % count) as usize;
        rest /= count;
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(period: f64) -> Wave {
        Wave {
            period,
            amplitude: 1.0,
            offset: 0.0,
            phase: 0.0,
        }
    }

    fn oscillation(period: f64) -> Oscillation {
        Oscillation {
            period: Some(period),
            omega: None,
            dt: None,
            amplitude: 1.0,
            offset: 0.0,
            phase: 0.0,
        }
    }

    #[test]
    fn saw_and_sawdown_go_from_one_bound_to_the_other_in_a_period() {
        let (saw, down) = (Signal::Saw(wave(40.0)), Signal::Sawdown(wave(40.0)));
        for k in 0..120 {
            let expected = 2.0 * ((k % 40) as f64 / 40.0) - 1.0;
            assert_eq!(saw.at(k), expected);
            assert_eq!(down.at(k), -expected);
        }
    }

    #[test]
    fn a_square_is_up_in_the_first_half_of_its_period() {
        let square = Signal::Square(wave(40.0));
        for k in 0..120 {
            assert_eq!(square.at(k), if k % 40 < 20 { 1.0 } else { -1.0 });
        }
    }

    #[test]
    fn a_triangle_rises_and_falls() {
        let triangle = Signal::Triangle(wave(8.0));
        let values: Vec<f64> = (0..9).map(|k| triangle.at(k)).collect();
        assert_eq!(values, [-1.0, -0.5, 0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0]);
    }

    #[test]
    fn sine_and_cosine_follow_their_period_or_frequency() {
        for k in 0..100 {
            let angle = 2.0 * PI * ((k % 40) as f64 / 40.0);
            assert_eq!(Signal::Sine(oscillation(40.0)).at(k), libm::sin(angle));
            assert_eq!(Signal::Cosine(oscillation(40.0)).at(k), libm::cos(angle));
            let by_omega = Oscillation {
                period: None,
                omega: Some(2.0 * PI / 40.0),
                ..oscillation(1.0)
            };
            assert!((Signal::Sine(by_omega).at(k) - libm::sin(angle)).abs() < 1e-14);
        }
        let shifted = Signal::Sine(Oscillation {
            phase: PI / 2.0,
            ..oscillation(40.0)
        });
        assert!(
            (0..100)
                .all(|k| (shifted.at(k) - Signal::Cosine(oscillation(40.0)).at(k)).abs() < 1e-14)
        );
    }

    #[test]
    fn a_phase_shifts_a_wave_by_its_share_of_the_period() {
        let half = Signal::Square(Wave {
            phase: PI,
            ..wave(40.0)
        });
        assert!((0..80).all(|k| half.at(k) == Signal::Square(wave(40.0)).at(k + 20)));
    }

    #[test]
    fn amplitude_and_offset_scale_and_shift() {
        let saw = Signal::Saw(Wave {
            amplitude: 3.0,
            offset: 1.0,
            ..wave(4.0)
        });
        assert_eq!(
            (0..4).map(|k| saw.at(k)).collect::<Vec<_>>(),
            [-2.0, -0.5, 1.0, 2.5]
        );
    }

    #[test]
    fn pieces_change_at_their_steps() {
        let pieces = Signal::Pieces {
            at: vec![2, 5],
            value: vec![0.0, 0.5, -0.5],
        };
        assert_eq!(
            (0..7).map(|k| pieces.at(k)).collect::<Vec<_>>(),
            [0.0, 0.0, 0.5, 0.5, 0.5, -0.5, -0.5]
        );
    }

    #[test]
    fn the_terms_of_the_van_der_pol_disturbance_add_up() {
        // ts (sin(2 k ts) + b), b = 1/2 for 10 ≤ k ts < 20 and −1/2 for 20 ≤ k ts < 30.
        let ts = 0.1;
        let sine = Oscillation {
            period: None,
            omega: Some(2.0),
            dt: Some(ts),
            amplitude: ts,
            ..oscillation(1.0)
        };
        let terms = [
            Signal::Sine(sine),
            Signal::Pieces {
                at: vec![100, 200, 300],
                value: vec![0.0, 0.05, -0.05, 0.0],
            },
        ];
        for (k, b) in [
            (0, 0.0),
            (99, 0.0),
            (100, 0.5),
            (199, 0.5),
            (200, -0.5),
            (299, -0.5),
            (300, 0.0),
        ] {
            let expected = ts * (libm::sin(2.0 * k as f64 * ts) + b);
            assert!((sum_at(&terms, k) - expected).abs() < 1e-16, "{k}");
        }
    }

    #[test]
    fn runs_count_through_the_alternatives_with_the_last_component_fastest() {
        let runs: Vec<Vec<usize>> = (0..7).map(|r| mixed_radix(r, &[2, 1, 3])).collect();
        assert_eq!(runs[0], [0, 0, 0]);
        assert_eq!(runs[1], [0, 0, 1]);
        assert_eq!(runs[3], [1, 0, 0]);
        assert_eq!(runs[5], [1, 0, 2]);
        assert_eq!(runs[6], [0, 0, 0]);
        let all: std::collections::BTreeSet<_> =
            (0..1728).map(|r| mixed_radix(r, &[12, 12, 12])).collect();
        assert_eq!(all.len(), 1728);
    }

    #[test]
    fn a_bad_parameter_is_refused_with_its_key() {
        let message = |s: Signal| s.validate().unwrap_err().to_string();
        assert_eq!(
            message(Signal::Saw(wave(0.0))),
            "period: expected a positive number, got 0"
        );
        let both = Oscillation {
            omega: Some(1.0),
            ..oscillation(40.0)
        };
        assert_eq!(
            message(Signal::Sine(both)),
            "omega: expected either period or omega, got both"
        );
        let neither = Oscillation {
            period: None,
            ..oscillation(40.0)
        };
        assert_eq!(
            message(Signal::Cosine(neither)),
            "period: expected either period or omega, got neither"
        );
        let pieces = |at: &[usize], value: &[f64]| Signal::Pieces {
            at: at.to_vec(),
            value: value.to_vec(),
        };
        assert_eq!(
            message(pieces(&[5, 5], &[0.0; 3])),
            "at: expected ascending steps, got 5 before 5"
        );
        assert_eq!(
            message(pieces(&[5], &[0.0; 3])),
            "value: expected one value more than there are changes, got 3 values for 1 changes"
        );
        assert_eq!(
            message(Signal::Constant { value: f64::NAN }),
            "value: expected a finite number, got NaN"
        );
    }

    #[test]
    fn a_signal_is_read_back_as_it_was_written() {
        let text = r#"{"kind":"sine","omega":2.0,"amplitude":0.1}"#;
        let signal: Signal = serde_json::from_str(text).unwrap();
        let again: Signal = serde_json::from_str(&serde_json::to_string(&signal).unwrap()).unwrap();
        assert_eq!(signal, again);
        assert!(serde_json::from_str::<Signal>(r#"{"kind":"saw","period":4,"omega":1}"#).is_err());
    }
}
