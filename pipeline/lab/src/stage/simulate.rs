//! simulate: an experiment's truth, what is measured of it, and the known inputs.

use crate::stage::{Experiment, metadata};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use zonobench_estimation::system::Variable;
use zonobench_estimation::{System, Trajectory, simulate};
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Input, Measurement, Truth};
use zonobench_lake::table::{Name, TableWriter};

/// What the simulation depends on: neither the experiment's name nor any estimator.
pub fn input(experiment: &Experiment) -> Value {
    json!({
        "system": experiment.problem.system,
        "truth": experiment.truth,
        "inputs": experiment.inputs,
        "seed": experiment.seed,
        "runs": experiment.runs,
        "steps": experiment.steps,
    })
}

/// Writes `truth.parquet`, `measurements.parquet` and `inputs.parquet`.
pub fn make(experiment: &Experiment, dir: &Path, done: &(dyn Fn(u64) + Sync)) -> Result<(), Error> {
    let meta = metadata("simulate", Some(experiment.seed));
    let mut truth = TableWriter::create(&dir.join("truth.parquet"), &meta)?;
    let mut measurements = TableWriter::create(&dir.join("measurements.parquet"), &meta)?;
    let mut inputs = TableWriter::create(&dir.join("inputs.parquet"), &meta)?;
    let variables = experiment.problem.system.variables();
    let names = |list: &[Variable]| {
        list.iter()
            .map(|v| Name::from(v.name.as_str()))
            .collect::<Vec<_>>()
    };
    let (x_names, y_names, u_names) = (
        names(&variables.x),
        names(&variables.y),
        names(&variables.u),
    );
    let runs: Vec<usize> = (0..experiment.runs).collect();
    for chunk in runs.chunks(64) {
        let trajectories: Vec<Trajectory> = chunk
            .par_iter()
            .map(|&run| {
                let trajectory = simulate(
                    &experiment.problem.system,
                    &experiment.truth,
                    &experiment.inputs,
                    experiment.seed,
                    run as u64,
                    experiment.steps,
                );
                done(1);
                trajectory.map_err(|source| Error::Simulation {
                    experiment: experiment.name(),
                    run,
                    source: Box::new(source),
                })
            })
            .collect::<Result<_, _>>()?;
        for (&run, t) in chunk.iter().zip(&trajectories) {
            for k in 0..t.x.len() {
                let (run, step) = (run as i32, k as i32);
                truth.push(x_names.iter().enumerate().map(|(i, name)| Truth {
                    run,
                    k: step,
                    component: name.clone(),
                    value: t.x[k][i],
                    rounding: Some(t.rounding[k][i]).filter(|r| r.is_finite()),
                }))?;
                measurements.push(y_names.iter().zip(&t.y[k]).map(|(name, &y)| Measurement {
                    run,
                    k: step,
                    component: name.clone(),
                    value: Some(y),
                }))?;
                inputs.push(u_names.iter().zip(&t.u[k]).map(|(name, &u)| Input {
                    run,
                    k: step,
                    component: name.clone(),
                    value: u,
                }))?;
            }
        }
    }
    truth.close()?;
    measurements.close()?;
    inputs.close()?;
    Ok(())
}
