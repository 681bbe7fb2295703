//! The one error type of this crate.

use crate::ProblemError;
use zonobench_sets::SetError;
pub use zonobench_sets::error::shortest;

/// What can go wrong in a system or an estimator.
///
/// [`Inconsistent`](Self::Inconsistent) is a result of the mathematics: the measurement contradicts the
/// model or the bounds. Everything else is a fault of the input.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimationError {
    /// The measurement contradicts the model: the intersection is empty.
    #[error("k = {k}: the measurement contradicts the model (empty intersection)")]
    Inconsistent {
        /// The step.
        k: usize,
    },
    /// An operation on sets or matrices failed at a step.
    #[error("k = {k}, {}", during(op, source))]
    Set {
        /// The step.
        k: usize,
        /// What the estimator was doing.
        op: &'static str,
        /// The fault.
        source: SetError,
    },
    /// A matrix that must be inverted is singular, and what it stands for has no answer: a covariance of the
    /// innovation that calls a measurement impossible, say.
    #[error("k = {k}, {op}: {reason}")]
    Singular {
        /// The step.
        k: usize,
        /// What the estimator was doing.
        op: &'static str,
        /// What is missing.
        reason: String,
    },
    /// A number of the belief is beyond the largest f64, 1.8e308.
    #[error("k = {k}, {op}: a number is beyond 1.8e308")]
    Overflow {
        /// The step.
        k: usize,
        /// What the estimator was doing.
        op: &'static str,
    },
    /// The estimator does not go on, because what it would say is worth nothing: a result, not a fault of
    /// the input.
    #[error("k = {k}: {kind} refuses to go on: {reason}")]
    Refused {
        /// The step.
        k: usize,
        /// The kind of estimator.
        kind: &'static str,
        /// Why.
        reason: String,
    },
    /// A setting, or a part of the problem that a kind of estimator or system needs, is not what it must be.
    #[error("{kind}: `{key}` must be {expected}, got {got}")]
    Setting {
        /// The kind of estimator or system.
        kind: &'static str,
        /// The key.
        key: &'static str,
        /// What was expected.
        expected: String,
        /// What came.
        got: String,
    },
    /// This kind does not do what was asked of it.
    #[error("{kind} does not support {what}: {reason}")]
    Unsupported {
        /// The kind of estimator or system.
        kind: &'static str,
        /// What was asked.
        what: &'static str,
        /// Why not.
        reason: String,
    },
    /// A part of the problem is not what it must be.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// Shapes do not fit.
    #[error("{what}: expected dimension {expected}, got {got}")]
    Dimension {
        /// What has the wrong shape.
        what: &'static str,
        /// What was expected.
        expected: usize,
        /// What came.
        got: usize,
    },
    /// A coefficient, an input or a measurement is NaN or infinite.
    #[error("{what}: expected finite numbers, got {}", shortest(*.value))]
    NotFinite {
        /// What holds it.
        what: &'static str,
        /// The offending value.
        value: f64,
    },
    /// The observability matrix [C; CA; …; CAⁿ⁻¹] has not full column rank.
    #[error(
        "{kind}: the pair (A, C) must be observable, but [C; CA; ...] has rank {rank} instead of {n}"
    )]
    Unobservable {
        /// The kind of estimator.
        kind: &'static str,
        /// The rank found.
        rank: usize,
        /// The number of states.
        n: usize,
    },
}

/// "`op`: fault", once where the fault names the same operation.
fn during(op: &str, source: &SetError) -> String {
    let fault = source.to_string();
    let same = fault.strip_prefix(op).is_some_and(|f| f.starts_with(": "));
    if same {
        fault
    } else {
        format!("{op}: {fault}")
    }
}

impl EstimationError {
    /// The step that the error names.
    pub fn step(&self) -> Option<usize> {
        match self {
            Self::Inconsistent { k }
            | Self::Set { k, .. }
            | Self::Singular { k, .. }
            | Self::Overflow { k, .. }
            | Self::Refused { k, .. } => Some(*k),
            _ => None,
        }
    }

    /// What happened, without the step.
    pub fn cause(&self) -> String {
        let whole = self.to_string();
        let Some(k) = self.step() else { return whole };
        let cause = whole.strip_prefix(&format!("k = {k}"));
        cause
            .map_or(&*whole, |cause| cause.trim_start_matches([':', ',', ' ']))
            .to_owned()
    }

    /// For `map_err`: a fault of `op` at step `k`, where an empty intersection is [`Self::Inconsistent`], a
    /// computed number that is not finite [`Self::Overflow`], and a singular matrix [`Self::Singular`].
    pub fn at(k: usize, op: &'static str) -> impl Fn(SetError) -> Self {
        move |source| match source {
            SetError::Empty { .. } => Self::Inconsistent { k },
            SetError::NotFinite { .. } => Self::Overflow { k, op },
            SetError::Singular { op: of } => Self::Singular {
                k,
                op,
                reason: format!("the matrix of the {of} has no inverse"),
            },
            source => Self::Set { k, op, source },
        }
    }

    /// `key` of `kind` must be `expected`, but is `got`.
    pub fn setting(
        kind: &'static str,
        key: &'static str,
        expected: impl Into<String>,
        got: impl ToString,
    ) -> Self {
        Self::Setting {
            kind,
            key,
            expected: expected.into(),
            got: match got.to_string() {
                // A number without an exponent may have three hundred zeros.
                long if long.len() > 20 => long.parse().map_or(long, shortest),
                short => short,
            },
        }
    }
}

/// k − 1. Fails for k = 0: nothing comes before the prior.
pub(crate) fn before(k: usize) -> Result<usize, EstimationError> {
    k.checked_sub(1)
        .ok_or_else(|| EstimationError::setting("predict", "k", "1 or more", k))
}

/// Fails unless `v` has `n` entries, all finite.
pub(crate) fn finite_vector(
    what: &'static str,
    v: &[f64],
    n: usize,
) -> Result<(), EstimationError> {
    if v.len() != n {
        return Err(EstimationError::Dimension {
            what,
            expected: n,
            got: v.len(),
        });
    }
    match v.iter().find(|x| !x.is_finite()) {
        Some(&value) => Err(EstimationError::NotFinite { what, value }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_shown_short() {
        let got = |x: f64| EstimationError::setting("ezgkf", "eta", "in [0, 1]", x).to_string();
        assert_eq!(got(1e-300), "ezgkf: `eta` must be in [0, 1], got 1e-300");
        assert_eq!(got(1.5), "ezgkf: `eta` must be in [0, 1], got 1.5");
    }

    #[test]
    fn an_operation_is_named_once() {
        let error = |op| EstimationError::Set {
            k: 3,
            op,
            source: SetError::Range {
                op: "reduce",
                what: "order",
                expected: "at least 1",
                got: 0.0,
            },
        };
        let fault = "reduce: order must be at least 1, got 0";
        assert_eq!(error("reduce").to_string(), format!("k = 3, {fault}"));
        assert_eq!(
            error("predict").to_string(),
            format!("k = 3, predict: {fault}")
        );
        assert_eq!(error("reduce").cause(), fault);
        assert_eq!(error("reduce").step(), Some(3));
        let inconsistent = EstimationError::Inconsistent { k: 12 };
        assert_eq!(
            inconsistent.cause(),
            "the measurement contradicts the model (empty intersection)"
        );
    }
}
