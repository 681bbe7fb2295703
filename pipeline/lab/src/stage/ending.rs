//! How an estimator's run ends before its last step: the status of its last rows, and the plain cause.
//!
//! One run that ends takes nothing from the other runs and estimators: their rows are written, and who asked
//! for them is told.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;
use zonobench_estimation::estimator::Size;
use zonobench_estimation::{AnyBelief, Belief as _, EstimationError};
use zonobench_lake::error::Error;

/// The file of a result that lists the endings that are failures; not there where there are none.
pub const FILE: &str = "failures.json";

/// The status of a step whose set was claimed to hold the state, by a program of the user's own, and does not.
pub const REFUTED: &str = "refuted";

/// A run that ended early.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ending {
    /// The estimator.
    pub estimator: String,
    /// The run.
    pub run: usize,
    /// The step without a belief.
    pub k: usize,
    /// The status of its row: `inconsistent`, `refused`, `diverged`, `singular`, `overflow` or `failed`; of a program of the
    /// user's own also `timeout`, and `refuted`, after which the run goes on.
    pub status: String,
    /// Why, in words, without step and estimator.
    pub cause: String,
}

impl Ending {
    /// By an error at step `k`.
    pub fn of(estimator: &str, run: usize, k: usize, error: &EstimationError) -> Self {
        Self {
            estimator: estimator.to_owned(),
            run,
            k: error.step().unwrap_or(k),
            status: status(error).to_owned(),
            cause: error.cause(),
        }
    }

    /// By numbers that are not finite any more.
    pub fn overflow(estimator: &str, run: usize, k: usize, what: &str) -> Self {
        Self {
            estimator: estimator.to_owned(),
            run,
            k,
            status: "overflow".to_owned(),
            cause: format!("{what} is no longer finite"),
        }
    }

    /// By a claim that the truth refutes at step `k`; the run goes on.
    pub fn refuted(estimator: &str, run: usize, k: usize) -> Self {
        Self {
            estimator: estimator.to_owned(),
            run,
            k,
            status: REFUTED.to_owned(),
            cause: "it claims a guarantee, and the true state is outside of its set".to_owned(),
        }
    }

    /// By sets that grow without end.
    pub fn diverged(estimator: &str, run: usize, k: usize, cause: String) -> Self {
        Self {
            estimator: estimator.to_owned(),
            run,
            k,
            status: "diverged".to_owned(),
            cause,
        }
    }

    /// Whether sets grew without end.
    pub fn is_divergence(&self) -> bool {
        self.status == "diverged"
    }

    /// Whether numbers were no longer finite.
    pub fn is_overflow(&self) -> bool {
        self.status == "overflow"
    }

    /// False for what an estimator may say as a result: that a measurement contradicts the model, or that what it
    /// could say is worth nothing.
    pub fn is_failure(&self) -> bool {
        !matches!(self.status.as_str(), "inconsistent" | "refused")
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (estimator, run, k) = (&self.estimator, self.run, self.k);
        write!(
            f,
            "{estimator}, run {run}, k = {k}: {}: {}",
            self.status, self.cause
        )
    }
}

/// The status of a row that an error ends.
fn status(error: &EstimationError) -> &'static str {
    match error {
        EstimationError::Inconsistent { .. } => "inconsistent",
        EstimationError::Refused { .. } => "refused",
        EstimationError::Singular { .. } => "singular",
        // What came in is finite: it is checked where it is read.
        EstimationError::Overflow { .. } | EstimationError::NotFinite { .. } => "overflow",
        _ => "failed",
    }
}

/// What of a belief is not finite where it should be: a bound may be infinite, a point estimate and a covariance not.
pub fn not_finite(belief: &AnyBelief) -> Option<&'static str> {
    let infinite = |x: &f64| !x.is_finite();
    if let Some(covariance) = belief.covariance()
        && covariance.as_slice().iter().any(infinite)
    {
        return Some("the covariance");
    }
    let center = belief.center();
    let lost = match belief.interval_hull() {
        None => center.iter().any(infinite),
        Some(hull) => {
            let mut sides = hull.iter().zip(&center);
            sides.any(|(side, c)| side.is_finite() && !c.is_finite())
        }
    };
    if lost {
        return Some("the estimate");
    }
    let Size {
        trace_ggt, radius, ..
    } = belief.size();
    let not_a_number = |x: Option<f64>| x.is_some_and(f64::is_nan);
    (not_a_number(trace_ggt) || not_a_number(radius)).then_some("the size of the set")
}

/// Writes the failures among `endings` into `dir`, if there are any.
pub fn write(dir: &Path, endings: &[Ending]) -> Result<(), Error> {
    let failures: Vec<&Ending> = endings.iter().filter(|e| e.is_failure()).collect();
    if failures.is_empty() {
        return Ok(());
    }
    let path = dir.join(FILE);
    let text = serde_json::to_vec_pretty(&failures).map_err(|e| Error::json(&path, e))?;
    std::fs::write(&path, text).map_err(|e| Error::io("write", &path, e))
}

/// The failures in the file at `path`.
pub fn read(path: &Path) -> Result<Vec<Ending>, Error> {
    let text = std::fs::read(path).map_err(|e| Error::io("read", path, e))?;
    serde_json::from_slice(&text).map_err(|e| Error::json(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zonobench_sets::SetError;

    #[test]
    fn an_error_is_a_status_and_a_cause_without_its_place() {
        let singular = EstimationError::Singular {
            k: 3,
            op: "gain",
            reason: "the matrix has no inverse".into(),
        };
        let ending = Ending::of("kf", 2, 7, &singular);
        assert_eq!(
            ending.to_string(),
            "kf, run 2, k = 3: singular: gain: the matrix has no inverse"
        );
        assert!(ending.is_failure());
        let inconsistent = Ending::of("box", 0, 4, &EstimationError::Inconsistent { k: 4 });
        assert_eq!(inconsistent.status, "inconsistent");
        assert!(!inconsistent.is_failure());
        let domain = EstimationError::Set {
            k: 3,
            op: "box",
            source: SetError::Domain {
                op: "box",
                lower: 0.0,
                upper: 1.0,
            },
        };
        let ending = Ending::of("czmv", 0, 3, &domain);
        let cause = "box: the argument [0, 1] leaves the domain";
        assert_eq!(
            (ending.status.as_str(), ending.cause.as_str()),
            ("failed", cause)
        );
        let large = EstimationError::NotFinite {
            what: "state",
            value: f64::INFINITY,
        };
        let ending = Ending::of("czmv", 0, 9, &large);
        assert_eq!((ending.k, ending.status.as_str()), (9, "overflow"));
    }

    #[test]
    fn failures_come_back_and_results_are_none() {
        let folder = tempfile::tempdir().unwrap();
        let inconsistent = Ending::of("box", 0, 4, &EstimationError::Inconsistent { k: 4 });
        write(folder.path(), std::slice::from_ref(&inconsistent)).unwrap();
        assert!(!folder.path().join(FILE).exists());
        let overflow = Ending::overflow("kf", 0, 4, "the covariance");
        write(folder.path(), &[inconsistent, overflow.clone()]).unwrap();
        assert_eq!(read(&folder.path().join(FILE)).unwrap(), [overflow]);
    }
}
