//! trace: run 0 of one estimator as an MCAP file.

use crate::stage::estimate::{Job, describe};
use crate::stage::{Experiment, Recordings, metadata};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use zonobench_estimation::System as _;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Belief, Estimate, Set};
use zonobench_lake::store::Artifact;
use zonobench_lake::table;
use zonobench_trace::{MeasurementRow, Outline, Trace, TraceStep, TraceZonotope, write};

/// The most steps in a trace: of a longer run every second step is in it, or every third, and so on, so that
/// it stays small and plays at a rate that can be seen. Steps that are not `ok` and the last are always there.
const MOST_STEPS: usize = 400;

/// What a trace depends on.
pub fn input(experiment: &Experiment, index: usize, data: &str, estimates: &str) -> Value {
    json!({
        "paper": experiment.paper,
        "experiment": experiment.id,
        "seed": experiment.seed,
        "estimator": experiment.estimators[index],
        "system": experiment.problem.system,
        "v": experiment.problem.v,
        "data": data,
        "estimates": estimates,
    })
}

/// Writes `trace.mcap`.
pub fn make(
    experiment: &Experiment,
    index: usize,
    recordings: &Recordings,
    estimates: &Artifact,
    dir: &Path,
) -> Result<(), Error> {
    let info = describe(&Job::of(experiment, index))?;
    let path = |name: &str| {
        estimates.path(name).ok_or_else(|| Error::Unknown {
            what: "file of the estimates",
            got: name.to_owned(),
            expected: "estimates.parquet, beliefs.parquet, shapes.parquet".to_owned(),
        })
    };
    let variables = experiment.problem.system.variables();
    let n = variables.x.len();
    let mut steps: BTreeMap<usize, TraceStep> = BTreeMap::new();
    // Centers, lower and upper bounds of all components, by step.
    let mut centers: BTreeMap<usize, [Vec<f64>; 3]> = BTreeMap::new();
    table::for_each::<Estimate>(&path("estimates.parquet")?, |row| {
        let k = row.k as usize;
        if row.run != 0 {
            return;
        }
        let Some(center) = row.center else {
            // The run ended here, and the status says why.
            steps.entry(k).or_default().status = row.status.to_string();
            return;
        };
        if row.phase == info.reported_phase {
            steps.entry(k).or_default().status = row.status.to_string();
            let place = centers.entry(k).or_default();
            place[0].push(center);
            place[1].extend(row.lower);
            place[2].extend(row.upper);
        }
    })?;
    for (k, [center, lower, upper]) in centers {
        let step = steps.entry(k).or_default();
        let truth = recordings.state(0, k);
        if let Some(x) = &truth {
            let square: f64 = x.iter().zip(&center).map(|(x, c)| (x - c) * (x - c)).sum();
            step.metrics.push(("error".to_owned(), square.sqrt()));
        }
        step.lower = (lower.len() == n).then_some(lower);
        step.upper = (upper.len() == n).then_some(upper);
        step.center = center;
    }
    let (stride, last) = (
        steps.len().div_ceil(MOST_STEPS).max(1),
        steps.keys().max().copied(),
    );
    steps.retain(|k, step| k % stride == 0 || Some(*k) == last || step.status != "ok");
    for (k, step) in &mut steps {
        step.k = *k;
        step.truth = recordings.state(0, *k);
        step.measurement = recordings.measurement(0, *k).map(<[_]>::to_vec);
        if step.center.is_empty() {
            step.center = vec![f64::NAN; n];
        }
    }
    table::for_each::<Belief>(&path("beliefs.parquet")?, |row| {
        let Some(step) = steps.get_mut(&(row.k as usize)).filter(|_| row.run == 0) else {
            return;
        };
        if row.phase != info.reported_phase {
            return;
        }
        let mut push = |name: &str, value: Option<f64>| {
            step.metrics.extend(value.map(|v| (name.to_owned(), v)));
        };
        push("radius", row.radius);
        push("volume", row.volume);
        push("trace_ggt", row.trace_ggt);
        push("n_generators", row.n_generators.map(|n| n as f64));
        push("n_constraints", row.n_constraints.map(|n| n as f64));
        push(
            "contains_truth",
            row.contains_truth.map(|c| f64::from(u8::from(c))),
        );
    })?;
    table::for_each::<Set>(&path("shapes.parquet")?, |row| {
        let Some(step) = steps.get_mut(&(row.k as usize)) else {
            return;
        };
        if let Some(vertices) = row.vertices {
            let polygon = vertices.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
            step.outlines = vec![Outline {
                axes: (0, 1),
                polygon,
            }];
        }
        if let (Some(center), Some(generators)) = (row.center, row.generators)
            && n > 0
        {
            let m = generators.len() / n;
            step.zonotope = Some(TraceZonotope {
                center,
                generators,
                n,
                m,
            });
        }
    })?;
    let mut described = metadata("trace", Some(experiment.seed));
    described.insert("stride".to_owned(), stride.to_string());
    let trace = Trace {
        paper: experiment.paper.clone(),
        experiment: experiment.id.clone(),
        estimator: info.estimator.to_string(),
        kind: info.kind.to_string(),
        guaranteed: info.guaranteed,
        names: variables
            .x
            .iter()
            .map(|v| (v.name.clone(), v.unit.to_string()))
            .collect(),
        dt_s: experiment.problem.system.period().unwrap_or(1.0),
        metadata: described,
        params_json: serde_json::to_string_pretty(&experiment.estimators[index])
            .map_err(|e| Error::json(dir, e))?,
        layout_json: String::new(),
        measurement_rows: measurement_rows(experiment),
        steps: steps.into_values().collect(),
    };
    let out = dir.join("trace.mcap");
    let file = File::create(&out).map_err(|e| Error::io("create", &out, e))?;
    let mut writer = BufWriter::new(file);
    write(&trace, &mut writer).map_err(|e| Error::Trace {
        path: out.clone(),
        message: e.to_string(),
    })?;
    let file = writer
        .into_inner()
        .map_err(|e| Error::io("write", &out, e.into_error()))?;
    file.sync_all().map_err(|e| Error::io("sync", &out, e))
}

/// The strips y − [v] ∋ C x of a linear measurement with bounded noise.
fn measurement_rows(experiment: &Experiment) -> Vec<MeasurementRow> {
    let problem = &experiment.problem;
    let Some(parts) = problem.system.linear_parts() else {
        return Vec::new();
    };
    let Some(noise) = problem.v.has_set().then(|| problem.v.box_hull()) else {
        return Vec::new();
    };
    let names = problem.system.variables().y;
    names
        .iter()
        .enumerate()
        .map(|(i, y)| MeasurementRow {
            name: y.name.clone(),
            row: parts.c.row(i).to_vec(),
            noise: (noise[i].lo(), noise[i].hi()),
        })
        .collect()
}
