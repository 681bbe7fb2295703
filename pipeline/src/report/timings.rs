//! Recorded times: the committed `timings.csv`, the only times that a page shows.

use crate::error::Error;
use crate::kept::read_kept;
use serde::Deserialize;
use std::path::Path;

/// The median time of a step of one estimator on a named processor.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct RecordedTime {
    /// Folder of the paper
    pub paper: String,
    /// Experiment id
    pub experiment: String,
    /// Estimator id
    pub estimator: String,
    /// Median time of a step in µs
    pub median_step_us: f64,
    /// The processor's model
    pub processor: String,
}

/// The rows of `path`, none if there is no such file.
pub fn read(path: &Path) -> Result<Vec<RecordedTime>, Error> {
    read_kept(path)
}

/// The time of one estimator of one experiment.
pub fn find<'a>(
    times: &'a [RecordedTime],
    paper: &str,
    experiment: &str,
    estimator: &str,
) -> Option<&'a RecordedTime> {
    times
        .iter()
        .find(|t| t.paper == paper && t.experiment == experiment && t.estimator == estimator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recorded_times_are_read_and_a_missing_file_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("timings.csv");
        assert_eq!(read(&path).unwrap(), []);
        let text =
            "paper,experiment,estimator,median_step_us,processor\nbox,a,kalman,0.5,\"CPU, fast\"\n";
        std::fs::write(&path, text).unwrap();
        let times = read(&path).unwrap();
        let time = find(&times, "box", "a", "kalman").unwrap();
        assert_eq!(
            (time.median_step_us, time.processor.as_str()),
            (0.5, "CPU, fast")
        );
        assert_eq!(find(&times, "box", "a", "other"), None);
        std::fs::write(&path, text.replace("0.5", "fast")).unwrap();
        assert!(read(&path).is_err());
    }
}
