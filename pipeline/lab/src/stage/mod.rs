//! The stages of an experiment: simulate → estimate → reduce, and the traces beside them.
//!
//! Each is a function of an input that names everything it reads, and a folder to write into.

pub mod ending;
pub mod estimate;
pub mod reduce;
pub mod simulate;
pub mod trace;
#[cfg(test)]
mod units;

pub use crate::experiment::Experiment;
pub use zonobench_lake::table::metadata;

/// The crate that the stages of an experiment are in: its sources, and those of all that it stands on, are part of their
/// results' addresses.
pub const CRATE: &str = env!("CARGO_PKG_NAME");

use crate::recorded::Recording;
use std::sync::Arc;
use zonobench_estimation::track::Data;
use zonobench_estimation::{Problem, System as _};
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Input, Measurement, Truth};
use zonobench_lake::store::Artifact;
use zonobench_lake::table;
use zonobench_sets::Interval;

/// A state component over time: value and rounding radius.
type TruePoint = (f64, Option<f64>);

/// What was recorded: for each run and step the inputs and measurements, and the truth where there is one.
pub struct Recordings {
    /// `u[run][k][component]`.
    u: Vec<Vec<Vec<f64>>>,
    y: Measured,
    x: Vec<Vec<Vec<TruePoint>>>,
}

enum Measured {
    /// `y[run][k][component]`.
    Simulated(Vec<Vec<Vec<Option<f64>>>>),
    /// One run, of which only some steps have a measurement; and what stands for the others.
    Recorded(Arc<Recording>, Vec<Option<f64>>),
}

/// One run, as an estimator sees it.
pub struct Run<'a> {
    recordings: &'a Recordings,
    run: usize,
}

impl Data for Run<'_> {
    fn input(&self, k: usize) -> &[f64] {
        let run = self.recordings.u.get(self.run);
        run.and_then(|u| u.get(k)).map_or(&[], Vec::as_slice)
    }
    fn measurement(&self, k: usize) -> &[Option<f64>] {
        self.recordings.measurement(self.run, k).unwrap_or(&[])
    }
}

impl Recordings {
    /// Recorded data of one run, of m measured components, without a truth.
    pub fn recorded(u: Vec<Vec<f64>>, y: Arc<Recording>, m: usize) -> Self {
        Self {
            u: vec![u],
            y: Measured::Recorded(y, vec![None; m]),
            x: Vec::new(),
        }
    }

    /// The last step with a measurement of recorded data.
    pub fn last(&self) -> usize {
        match &self.y {
            Measured::Simulated(y) => y.iter().map(Vec::len).max().unwrap_or(1) - 1,
            Measured::Recorded(y, _) => y.last(),
        }
    }

    /// Inputs and measurements of one run.
    pub fn run(&self, run: usize) -> Run<'_> {
        Run {
            recordings: self,
            run,
        }
    }

    /// y_k of a run, with None for a component that was not measured; None after the last step.
    pub fn measurement(&self, run: usize, k: usize) -> Option<&[Option<f64>]> {
        match &self.y {
            Measured::Simulated(y) => y.get(run)?.get(k).map(Vec::as_slice),
            Measured::Recorded(y, missing) => {
                (run == 0 && k <= y.last()).then(|| y.row(k).unwrap_or(missing))
            }
        }
    }

    /// Reads the artifact of `simulate`.
    pub fn read(problem: &Problem, simulation: &Artifact) -> Result<Self, Error> {
        let variables = problem.system.variables();
        let path = |name: &str| {
            simulation.path(name).ok_or_else(|| Error::Unknown {
                what: "file of the simulation",
                got: name.to_owned(),
                expected: "truth.parquet, measurements.parquet, inputs.parquet".to_owned(),
            })
        };
        let mut x = Vec::new();
        table::for_each::<Truth>(&path("truth.parquet")?, |r| {
            put(&mut x, r.run, r.k, variables.x.len(), (r.value, r.rounding));
        })?;
        let mut y = Vec::new();
        table::for_each::<Measurement>(&path("measurements.parquet")?, |r| {
            put(&mut y, r.run, r.k, variables.y.len(), r.value);
        })?;
        if variables.y.is_empty() {
            // Nothing is measured, at as many steps as there are states.
            let steps = |run: &Vec<Vec<_>>| vec![Vec::new(); run.len()];
            y = x.iter().map(steps).collect();
        }
        let mut u: Vec<Vec<Vec<f64>>> = Vec::new();
        table::for_each::<Input>(&path("inputs.parquet")?, |r| {
            put(&mut u, r.run, r.k, variables.u.len(), r.value);
        })?;
        u.resize(y.len(), Vec::new());
        Ok(Self {
            u,
            y: Measured::Simulated(y),
            x,
        })
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        match &self.y {
            Measured::Simulated(y) => y.len(),
            Measured::Recorded(..) => 1,
        }
    }

    /// The true state at step `k` of `run` as computed.
    pub fn state(&self, run: usize, k: usize) -> Option<Vec<f64>> {
        self.x
            .get(run)?
            .get(k)
            .map(|x| x.iter().map(|(value, _)| *value).collect())
    }

    /// An enclosure of the true state at step `k` of `run`, where it is known to rounding.
    pub fn truth(&self, run: usize, k: usize) -> Option<Vec<Interval>> {
        self.x
            .get(run)?
            .get(k)?
            .iter()
            .map(|(value, rounding)| {
                let r = (*rounding)?;
                Interval::new((value - r).next_down(), (value + r).next_up()).ok()
            })
            .collect()
    }
}

/// Appends `value` to step `k` of `run`; rows come sorted by run, step and component.
fn put<T>(all: &mut Vec<Vec<Vec<T>>>, run: i32, k: i32, width: usize, value: T) {
    let (run, k) = (run as usize, k as usize);
    while all.len() <= run {
        all.push(Vec::new());
    }
    while all[run].len() <= k {
        all[run].push(Vec::with_capacity(width));
    }
    all[run][k].push(value);
}
