//! Recorded times: the committed `timings.csv`, the only times that a page shows.

use serde::Deserialize;
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::kept::read_kept;

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

/// The time of one estimator and the processor; of several experiments joined by `+` the mean of their medians, as the
/// paper averages, where one processor recorded them all.
pub fn find<'a>(
    times: &'a [RecordedTime],
    paper: &str,
    experiments: &str,
    estimator: &str,
) -> Option<(f64, &'a str)> {
    let of = |experiment: &str| {
        let is = |t: &&RecordedTime| {
            t.paper == paper && t.experiment == experiment.trim() && t.estimator == estimator
        };
        times.iter().find(is)
    };
    let found: Vec<&RecordedTime> = experiments.split('+').map(of).collect::<Option<_>>()?;
    let processor = found.first()?.processor.as_str();
    let sum: f64 = found.iter().map(|t| t.median_step_us).sum();
    (found.iter().all(|t| t.processor == processor)).then(|| (sum / found.len() as f64, processor))
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
        assert_eq!(find(&times, "box", "a", "kalman"), Some((0.5, "CPU, fast")));
        assert_eq!(find(&times, "box", "a", "other"), None);
        let more = format!("{text}box,b,kalman,1.5,\"CPU, fast\"\nbox,c,kalman,1.5,another\n");
        std::fs::write(&path, more).unwrap();
        let times = read(&path).unwrap();
        assert_eq!(
            find(&times, "box", "a+b", "kalman"),
            Some((1.0, "CPU, fast"))
        );
        assert_eq!(find(&times, "box", "a+c", "kalman"), None);
        assert_eq!(find(&times, "box", "a+z", "kalman"), None);
        std::fs::write(&path, text.replace("0.5", "fast")).unwrap();
        assert!(read(&path).is_err());
    }
}
