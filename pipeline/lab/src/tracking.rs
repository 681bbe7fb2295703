//! `track`: estimators on recorded data, without a simulation and without a truth.

use crate::experiment::{Output, Tracking};
use crate::recorded;
use crate::stage::estimate::{Job, describe, make};
use crate::stage::{Recordings, metadata};
use std::fs;
use std::path::{Path, PathBuf};
use zonobench_estimation::System as _;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Belief, Estimate, EstimatorInfo};
use zonobench_lake::table;

/// What was written for one combination of a file's sweep and cases.
pub struct Tracked {
    /// Its name.
    pub id: String,
    /// The folder.
    pub out: PathBuf,
    /// The last step.
    pub steps: usize,
    /// (estimator, k) of measurements that contradict the model.
    pub inconsistent: Vec<(String, i32)>,
}

/// Runs the estimators of `file` on recorded measurements (and inputs) and writes `estimates.parquet`,
/// `beliefs.parquet` and `estimators.parquet` into `out`, or into a folder of it for each combination where
/// the file gives several.
///
/// Fails on a wrong file, and on a system with inputs without a recording of them.
pub fn track(
    file: &Path,
    measurements: &Path,
    inputs: Option<&Path>,
    out: &Path,
) -> Result<Vec<Tracked>, Error> {
    let trackings = Tracking::load(file)?;
    let several = trackings.len() > 1;
    trackings
        .iter()
        .map(|tracking| {
            let folder = if several {
                out.join(&tracking.id)
            } else {
                out.to_owned()
            };
            one(tracking, measurements, inputs, &folder)
        })
        .collect()
}

fn one(
    tracking: &Tracking,
    measurements: &Path,
    inputs: Option<&Path>,
    out: &Path,
) -> Result<Tracked, Error> {
    let variables = tracking.problem.system.variables();
    let names = |list: &'_ [zonobench_estimation::system::Variable]| -> Vec<String> {
        list.iter().map(|v| v.name.clone()).collect()
    };
    let (y_names, u_names) = (names(&variables.y), names(&variables.u));
    let y_refs: Vec<&str> = y_names.iter().map(String::as_str).collect();
    let u_refs: Vec<&str> = u_names.iter().map(String::as_str).collect();
    let y = recorded::measurements(measurements, &y_refs)?;
    let steps = y.last();
    let u = match (inputs, u_refs.is_empty()) {
        (Some(path), false) => recorded::inputs(path, &u_refs, steps)?,
        (None, true) => Vec::new(),
        (Some(path), true) => {
            return Err(Error::Refused {
                what: "--inputs".to_owned(),
                expected: "no file, because the system has no inputs".to_owned(),
                got: path.display().to_string(),
            });
        }
        (None, false) => {
            return Err(Error::Refused {
                what: "--inputs".to_owned(),
                expected: format!(
                    "a file with the columns k, {}, because the system has inputs",
                    u_refs.join(", ")
                ),
                got: "none".to_owned(),
            });
        }
    };
    let recordings = Recordings::recorded(u, y.rows);
    fs::create_dir_all(out).map_err(|e| Error::io("create", out, e))?;
    let draft = tempfile::tempdir_in(out).map_err(|e| Error::io("write into", out, e))?;
    let output = Output::default();
    let (mut infos, mut estimates, mut beliefs) = (Vec::new(), Vec::new(), Vec::new());
    for (i, spec) in tracking.estimators.iter().enumerate() {
        let job = Job {
            name: format!("{}/{}", tracking.paper, tracking.id),
            spec,
            steps,
            output: &output,
            volumes: false,
            extras: false,
            seed: None,
            admissible: true,
        };
        let folder = draft.path().join(i.to_string());
        fs::create_dir_all(&folder).map_err(|e| Error::io("create", &folder, e))?;
        infos.push(describe(&job)?);
        make(&job, &recordings, &folder, &|_| {})?;
        estimates.push(folder.join("estimates.parquet"));
        beliefs.push(folder.join("beliefs.parquet"));
    }
    let meta = metadata("track", None);
    let place = |name: &str| (draft.path().join(name), out.join(name));
    let (from, to) = place("estimates.parquet");
    table::concatenate::<Estimate>(&from, &estimates, &meta)?;
    fs::rename(&from, &to).map_err(|e| Error::io("write", &to, e))?;
    let mut inconsistent = Vec::new();
    table::for_each::<Estimate>(&to, |row| {
        let place = (row.estimator.to_string(), row.k);
        if &*row.status == "inconsistent" && inconsistent.last() != Some(&place) {
            inconsistent.push(place);
        }
    })?;
    let (from, to) = place("beliefs.parquet");
    table::concatenate::<Belief>(&from, &beliefs, &meta)?;
    fs::rename(&from, &to).map_err(|e| Error::io("write", &to, e))?;
    let (from, to) = place("estimators.parquet");
    table::write::<EstimatorInfo>(&from, infos, &meta)?;
    fs::rename(&from, &to).map_err(|e| Error::io("write", &to, e))?;
    Ok(Tracked {
        id: tracking.id.clone(),
        out: out.to_owned(),
        steps,
        inconsistent,
    })
}
