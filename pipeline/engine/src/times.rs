//! The times of a lake: how long steps took, and the printed times beside them. Nothing vouches for them.

use crate::engine::Finished;
use crate::graph::file;
use crate::parts;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use zonobench_lab::stage::Recordings;
use zonobench_lake::error::Error;
use zonobench_lake::lake::{paper_table_path, table_path};
use zonobench_lake::rows;
use zonobench_lake::table;
use zonobench_verdicts::compare;
use zonobench_verdicts::papers::Paper;

/// Writes the timings of one experiment into the lake; they are not vouched for.
pub fn write_timings(lake: &Path, finished: &Finished) -> Result<(), Error> {
    let e = &finished.experiment;
    let parts: Vec<PathBuf> = finished
        .estimates
        .iter()
        .map(|a| file(a, "timings.parquet"))
        .collect::<Result<_, _>>()?;
    let path = lake.join(table_path("timings", &e.paper, &e.id));
    // Stages that were found bring the times of the run that made them.
    if finished.made == 0 && path.exists() {
        return Ok(());
    }
    let parent = path.parent().expect("a lake file lies in a folder");
    std::fs::create_dir_all(parent).map_err(|source| Error::io("create", parent, source))?;
    let draft = lake
        .join(".cache")
        .join("tmp")
        .join(format!("timings-{}-{}", e.paper, e.id));
    table::concatenate::<rows::Timing>(&draft, &parts, &BTreeMap::new())?;
    std::fs::rename(&draft, &path).map_err(|source| Error::io("publish", &path, source))
}

/// Writes a paper's printed times beside ours; not vouched for.
pub fn write_timing_comparison(
    lake: &Path,
    paper: &Paper,
    finished: &[Finished],
) -> Result<(), Error> {
    let mut timings = compare::Times::new();
    for f in finished.iter().filter(|f| f.experiment.paper == paper.name) {
        for artifact in &f.estimates {
            for row in table::read::<rows::Timing>(&file(artifact, "timings.parquet")?)? {
                timings
                    .entry((f.experiment.id.clone(), row.estimator.to_string(), None))
                    .or_default()
                    .push(row.total_ns as f64 / row.steps.max(1) as f64);
            }
        }
    }
    for (experiment, estimator, phase) in compare::parts(paper) {
        let Some(f) = (finished.iter())
            .find(|f| f.experiment.paper == paper.name && f.experiment.id == experiment)
        else {
            continue;
        };
        let e = &f.experiment;
        let Some(i) = e.estimators.iter().position(|spec| spec.id == estimator) else {
            continue;
        };
        let kept = lake
            .join(".cache")
            .join("parts")
            .join(format!("{}.json", f.estimates[i].content));
        let recordings = || Recordings::read(&e.problem, &f.simulation);
        let shares = parts::shares(&kept, e, i, recordings)?;
        let whole = timings.get(&(experiment.clone(), estimator.clone(), None));
        if let (Some(share), Some(whole)) = (shares.get(&phase), whole) {
            let part: Vec<f64> = whole.iter().map(|ns| ns * share).collect();
            timings.insert((experiment, estimator, Some(phase)), part);
        }
    }
    let rows = compare::timings(paper, &timings);
    let path = lake.join(paper_table_path("timing_comparison", &paper.name));
    let parent = path.parent().expect("a lake file lies in a folder");
    std::fs::create_dir_all(parent).map_err(|e| Error::io("create", parent, e))?;
    let draft = lake
        .join(".cache")
        .join("tmp")
        .join(format!("timing-comparison-{}", paper.name));
    table::write(&draft, rows, &BTreeMap::new())?;
    std::fs::rename(&draft, &path).map_err(|e| Error::io("publish", &path, e))
}
