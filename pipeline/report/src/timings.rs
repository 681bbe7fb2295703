//! Recorded times: the committed `timings.csv`, the only times that a page shows.

use serde::Deserialize;
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::kept::read_kept;
use zonobench_verdicts::published::Time;

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

/// The time of one estimator and the processor; of several experiments the mean of their medians, as the paper averages,
/// where one processor recorded them all. Parts of a step are not recorded.
pub fn find<'a>(times: &'a [RecordedTime], paper: &str, wanted: &Time) -> Option<(f64, &'a str)> {
    if wanted.phase.is_some() {
        return None;
    }
    let of = |experiment: &String| {
        times.iter().find(|t| {
            t.paper == paper && t.experiment == *experiment && t.estimator == wanted.estimator
        })
    };
    let found: Vec<&RecordedTime> = wanted.experiments.iter().map(of).collect::<Option<_>>()?;
    let processor = found.first()?.processor.as_str();
    let sum: f64 = found.iter().map(|t| t.median_step_us).sum();
    (found.iter().all(|t| t.processor == processor)).then(|| (sum / found.len() as f64, processor))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(experiments: &str, estimator: &str) -> Time {
        Time {
            experiments: experiments.split('+').map(str::to_owned).collect(),
            estimator: estimator.to_owned(),
            phase: None,
        }
    }

    #[test]
    fn recorded_times_are_read_and_a_missing_file_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("timings.csv");
        assert_eq!(read(&path).unwrap(), []);
        let text =
            "paper,experiment,estimator,median_step_us,processor\nbox,a,kalman,0.5,\"CPU, fast\"\n";
        std::fs::write(&path, text).unwrap();
        let times = read(&path).unwrap();
        assert_eq!(
            find(&times, "box", &time("a", "kalman")),
            Some((0.5, "CPU, fast"))
        );
        assert_eq!(find(&times, "box", &time("a", "other")), None);
        let more = format!("{text}box,b,kalman,1.5,\"CPU, fast\"\nbox,c,kalman,1.5,another\n");
        std::fs::write(&path, more).unwrap();
        let times = read(&path).unwrap();
        assert_eq!(
            find(&times, "box", &time("a+b", "kalman")),
            Some((1.0, "CPU, fast"))
        );
        assert_eq!(find(&times, "box", &time("a+c", "kalman")), None);
        assert_eq!(find(&times, "box", &time("a+z", "kalman")), None);
        std::fs::write(&path, text.replace("0.5", "fast")).unwrap();
        assert!(read(&path).is_err());
    }
}
