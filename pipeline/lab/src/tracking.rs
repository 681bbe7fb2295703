//! `track`: estimators on recorded data, without a simulation and without a truth.

use crate::experiment::metric::needs_truth;
use crate::experiment::{MetricSpec, Tracking, allow_commands};
use crate::recorded::{self, Recording};
use crate::stage::ending::Ending;
use crate::stage::estimate::{Job, describe, extras, make, volumes};
use crate::stage::reduce::{self, Subject, Tables};
use crate::stage::{Recordings, metadata};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zonobench_estimation::System as _;
use zonobench_estimation::system::Variable;
use zonobench_lake::bad_input::BadInput;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Belief, Estimate, EstimatorInfo, Metric, Set};
use zonobench_lake::table::{self, Row};

/// What was recorded, and where.
pub struct Files<'a> {
    /// The measurements.
    pub measurements: &'a Path,
    /// The inputs, of a system that has any.
    pub inputs: Option<&'a Path>,
    /// The most steps in a row without a row of measurements.
    pub longest_gap: usize,
    /// Whether programs that the file names may be started.
    pub allow_commands: bool,
}

/// What was written for one combination of a file's sweep and cases.
pub struct Tracked {
    /// Its name.
    pub id: String,
    /// The folder.
    pub out: PathBuf,
    /// The last step.
    pub steps: usize,
    /// The estimators that ended early, and why.
    pub endings: Vec<Ending>,
    /// The metrics of the file that need a truth.
    pub left_out: Vec<String>,
    /// Whether the other metrics were left out, too: the recording is longer than [`MOST_FOLDED`].
    pub too_long: bool,
}

/// The last step up to which a recording's metrics are made: they hold every step in memory, some hundred bytes an
/// estimator, and estimates are written as they come.
pub const MOST_FOLDED: usize = 1_000_000;

/// Runs the estimators of `file` on recorded measurements (and inputs) and writes `estimates.parquet`,
/// `beliefs.parquet` and `estimators.parquet` into `out`, or into a folder of it for each combination where
/// the file gives several; with `[output] sets` also `sets.parquet`, and `metrics.parquet` with metrics that need no
/// truth.
///
/// An estimator that ends early takes nothing from the others. Fails on a wrong file, and on a system with
/// inputs without a recording of them.
pub fn track(file: &Path, files: &Files, out: &Path) -> Result<Vec<Tracked>, Error> {
    let mut trackings = Tracking::load(file)?;
    for tracking in &mut trackings {
        allow_commands(&mut tracking.estimators, files.allow_commands)?;
    }
    let several = trackings.len() > 1;
    let mut read = Reader {
        files,
        measurements: None,
        inputs: None,
    };
    trackings
        .iter()
        .map(|tracking| {
            let folder = if several {
                out.join(&tracking.id)
            } else {
                out.to_owned()
            };
            one(tracking, &mut read, &folder)
        })
        .collect()
}

/// A recording, and the components that it was read for.
type Kept = Option<(Vec<Variable>, Arc<Recording>)>;

/// The files, each read once for the combinations whose components have the same names: a pipe can be read
/// only once.
struct Reader<'a> {
    files: &'a Files<'a>,
    measurements: Kept,
    inputs: Kept,
}

fn names(variables: &[Variable]) -> Vec<&str> {
    variables.iter().map(|v| v.name.as_str()).collect()
}

impl Reader<'_> {
    fn measurements(&mut self, y: &[Variable]) -> Result<Arc<Recording>, Error> {
        let gap = self.files.longest_gap;
        once(&mut self.measurements, y, || {
            recorded::measurements(self.files.measurements, &names(y), gap)
        })
    }

    fn inputs(&mut self, path: &Path, u: &[Variable]) -> Result<Arc<Recording>, Error> {
        once(&mut self.inputs, u, || recorded::inputs(path, &names(u)))
    }
}

fn once(
    kept: &mut Kept,
    variables: &[Variable],
    read: impl FnOnce() -> Result<Recording, Error>,
) -> Result<Arc<Recording>, Error> {
    if let Some((of, recording)) = kept
        && of == variables
    {
        return Ok(recording.clone());
    }
    let recording = Arc::new(read()?);
    *kept = Some((variables.to_vec(), recording.clone()));
    Ok(recording)
}

/// The files with what an estimator is given.
fn recordings(tracking: &Tracking, read: &mut Reader) -> Result<Recordings, Error> {
    let system = &tracking.problem.system;
    let variables = system.variables();
    let refuse = |expected: String, got: String| {
        Err(Error::Refused {
            what: "--inputs".to_owned(),
            expected,
            got,
        })
    };
    let y = read.measurements(&variables.y)?;
    let u = match (read.files.inputs, variables.u.is_empty()) {
        (Some(path), false) => {
            let held = system.measures_input();
            let u = read.inputs(path, &variables.u)?;
            recorded::inputs_to(&u, y.last(), held)
                .map_err(|fault| BadInput::file(path.display().to_string(), fault))?
        }
        (None, true) => Vec::new(),
        (Some(path), true) => {
            let expected = "no file, because the system has no inputs".to_owned();
            return refuse(expected, path.display().to_string());
        }
        (None, false) => {
            let columns = names(&variables.u).join(", ");
            let expected =
                format!("a file with the columns k, {columns}, because the system has inputs");
            return refuse(expected, "none".to_owned());
        }
    };
    Ok(Recordings::recorded(u, y, variables.y.len()))
}

fn one(tracking: &Tracking, read: &mut Reader, out: &Path) -> Result<Tracked, Error> {
    let recordings = recordings(tracking, read)?;
    let steps = recordings.last();
    fs::create_dir_all(out).map_err(|e| Error::io("create", out, e))?;
    let draft = tempfile::tempdir_in(out).map_err(|e| Error::io("write into", out, e))?;
    let name = format!("{}/{}", tracking.paper, tracking.id);
    let endings = write(tracking, &recordings, steps, draft.path(), out)
        .map_err(|e| e.without_draft(draft.path(), out, &name))?;
    let (without, of_truth) = metrics(tracking);
    Ok(Tracked {
        id: tracking.id.clone(),
        out: out.to_owned(),
        steps,
        endings,
        left_out: of_truth.iter().map(|m| m.id.clone()).collect(),
        too_long: !without.is_empty() && steps > MOST_FOLDED,
    })
}

/// The metrics that need no truth, and those that do.
fn metrics(tracking: &Tracking) -> (Vec<&MetricSpec>, Vec<&MetricSpec>) {
    let all = tracking.metrics.iter();
    all.partition(|m| !needs_truth(m.name))
}

/// Runs the estimators in `draft`, and moves what they give to `out`.
fn write(
    tracking: &Tracking,
    recordings: &Recordings,
    steps: usize,
    draft: &Path,
    out: &Path,
) -> Result<Vec<Ending>, Error> {
    let (mut infos, mut folders, mut endings) = (Vec::new(), Vec::new(), Vec::new());
    for (i, spec) in tracking.estimators.iter().enumerate() {
        let job = Job {
            name: format!("{}/{}", tracking.paper, tracking.id),
            spec,
            steps,
            output: &tracking.output,
            volumes: volumes(&tracking.metrics),
            extras: extras(&tracking.metrics),
            seed: None,
            admissible: true,
        };
        let folder = draft.join(i.to_string());
        fs::create_dir_all(&folder).map_err(|e| Error::io("create", &folder, e))?;
        infos.push(describe(&job)?);
        endings.extend(make(&job, recordings, &folder, &|_| {})?);
        folders.push(folder);
    }
    joined::<Estimate>(&folders, draft, out)?;
    joined::<Belief>(&folders, draft, out)?;
    if tracking.output.sets.is_empty() {
        withdrawn::<Set>(out)?;
    } else {
        joined::<Set>(&folders, draft, out)?;
    }
    let (metrics, _) = metrics(tracking);
    if metrics.is_empty() || steps > MOST_FOLDED {
        withdrawn::<Metric>(out)?;
    } else {
        let subject = Subject {
            name: format!("{}/{}", tracking.paper, tracking.id),
            problem: &tracking.problem,
            estimators: &tracking.estimators,
            infos: infos.clone(),
            metrics,
            steps,
        };
        let tables = folders.iter().map(|folder| Tables {
            estimates: folder.join("estimates.parquet"),
            beliefs: folder.join("beliefs.parquet"),
            extras: folder.join("extras.parquet"),
        });
        let rows = reduce::values(&subject, recordings, &tables.collect::<Vec<_>>())?;
        written::<Metric>(rows, draft, out)?;
    }
    written::<EstimatorInfo>(infos, draft, out)?;
    Ok(endings)
}

/// The table of these rows.
fn written<R: Row>(rows: Vec<R>, draft: &Path, out: &Path) -> Result<(), Error> {
    let name = format!("{}.parquet", R::TABLE);
    table::write::<R>(&draft.join(&name), rows, &metadata("track", None))?;
    publish(&name, draft, out)
}

/// Removes a table that another run has left in `out`: it is not of these estimates.
fn withdrawn<R: Row>(out: &Path) -> Result<(), Error> {
    let path = out.join(format!("{}.parquet", R::TABLE));
    match fs::remove_file(&path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::io("remove", &path, error)),
        _ => Ok(()),
    }
}

/// One table of all estimators.
fn joined<R: Row>(folders: &[PathBuf], draft: &Path, out: &Path) -> Result<(), Error> {
    let name = format!("{}.parquet", R::TABLE);
    let parts: Vec<PathBuf> = folders.iter().map(|folder| folder.join(&name)).collect();
    table::concatenate::<R>(&draft.join(&name), &parts, &metadata("track", None))?;
    publish(&name, draft, out)
}

fn publish(name: &str, draft: &Path, out: &Path) -> Result<(), Error> {
    let to = out.join(name);
    fs::rename(draft.join(name), &to).map_err(|e| Error::io("write", &to, e))
}
