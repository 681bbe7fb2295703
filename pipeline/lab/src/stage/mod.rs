//! The stages of an experiment: simulate → estimate → reduce, and the traces beside them.
//!
pub mod estimate;
pub mod reduce;
pub mod simulate;
pub mod trace;

pub use crate::experiment::Experiment;
pub use zonobench_lake::table::metadata;

/// The crate that the stages of an experiment are in: its sources, and those of all that it stands on, are part of their
/// results' addresses.
pub const CRATE: &str = env!("CARGO_PKG_NAME");

use zonobench_estimation::{Problem, System as _};
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Input, Measurement, Truth};
use zonobench_lake::store::Artifact;
use zonobench_lake::table;
use zonobench_sets::Interval;

/// A state component over time: value and rounding radius.
type TruePoint = (f64, Option<f64>);

/// What was recorded: for each run and step the inputs and measurements, and the truth where there is one.
#[derive(Default)]
pub struct Recordings {
    /// `u[run][k][component]`.
    pub u: Vec<Vec<Vec<f64>>>,
    /// `y[run][k][component]`.
    pub y: Vec<Vec<Vec<Option<f64>>>>,
    x: Vec<Vec<Vec<TruePoint>>>,
}

impl Recordings {
    /// Recorded data of one run, without a truth.
    pub fn recorded(u: Vec<Vec<f64>>, y: Vec<Vec<Option<f64>>>) -> Self {
        Self {
            u: vec![u],
            y: vec![y],
            x: Vec::new(),
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
        Ok(Self { u, y, x })
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.y.len()
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
