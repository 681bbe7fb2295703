//! What a lake holds, read for the pages.

use arrow_array::cast::AsArray;
use arrow_array::types::Int32Type;
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use zonobench_lake::error::Error;
use zonobench_lake::lake::{self, Entry, PathKeys};
use zonobench_lake::rows::{
    Attack, Belief, Claim, Comparison, Complexity, Estimate, EstimatorInfo, Measurement, Published,
    Score, Set, Timing, TimingComparison, Truth, Variable,
};
use zonobench_lake::table::{self, Row};
use zonobench_verdicts::judged::{self, Judged};
use zonobench_verdicts::papers::{self, Paper};
use zonobench_verdicts::published::Kind;
use zonobench_verdicts::verdict::Verdict;

/// A lake and its manifest.
pub struct Source {
    lake: PathBuf,
    entries: Vec<Entry>,
}

/// What a lake holds of a paper, or of a name of the user's own.
pub struct Held {
    /// Its folder
    pub name: String,
    /// The ids of its experiments, in order
    pub experiments: Vec<String>,
    /// The printed numbers beside ours; none where no comparison was made
    pub comparisons: Vec<Judged>,
    /// The numbered claims, tried
    pub claims: Vec<Claim>,
    /// The small campaign against its guarantees, by the system that was attacked
    pub attacks: Vec<(String, Vec<Attack>)>,
    /// The printed numbers
    pub published: Vec<Published>,
    /// The paper as published, if it is one that comes with this program
    pub paper: Option<Paper>,
}

impl Held {
    /// Whether the numbers are those of a smoke run.
    pub fn is_quick(&self) -> bool {
        self.comparisons.iter().any(|c| c.verdict == Verdict::Quick)
    }

    /// How many times it prints, and statements about times.
    pub fn times(&self) -> usize {
        self.published
            .iter()
            .filter(|p| &*p.kind == Kind::Timing.name())
            .count()
    }

    /// The titles of its tables, in order.
    pub fn tables(&self) -> Vec<&str> {
        let mut tables: Vec<&str> = Vec::new();
        for c in &self.comparisons {
            if !tables.contains(&&*c.table) {
                tables.push(&c.table);
            }
        }
        tables
    }
}

/// An estimate and its box over the steps of a run; what there is not is left out.
#[derive(Default)]
pub struct Trail {
    /// Point estimate by k
    pub center: BTreeMap<i32, f64>,
    /// Lower end by k
    pub lower: BTreeMap<i32, f64>,
    /// Upper end by k
    pub upper: BTreeMap<i32, f64>,
}

/// Run 0 of an experiment.
pub struct FirstRun {
    /// True state by component and k
    pub truth: BTreeMap<String, BTreeMap<i32, f64>>,
    /// Measured values by component and k
    pub measured: BTreeMap<String, BTreeMap<i32, f64>>,
    /// State components and their units, in order
    pub states: Vec<(String, String)>,
    /// The seed
    pub seed: String,
    trails: BTreeMap<[String; 3], Trail>,
    covariances: BTreeMap<[String; 2], BTreeMap<i32, Vec<f64>>>,
}

/// The true state at one step of one run, and what an estimator gives there, by component.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// The true state
    pub state: Vec<f64>,
    /// The point estimate
    pub center: Vec<f64>,
    /// The box of the estimate; empty if there is none
    pub lower: Vec<f64>,
    /// Its upper end
    pub upper: Vec<f64>,
}

impl FirstRun {
    /// What `estimator` gives for a component in a phase; empty if nothing.
    pub fn trail(&self, estimator: &str, phase: &str, component: &str) -> &Trail {
        static NOTHING: Trail = Trail {
            center: BTreeMap::new(),
            lower: BTreeMap::new(),
            upper: BTreeMap::new(),
        };
        self.trails
            .get(&[estimator, phase, component].map(str::to_owned))
            .unwrap_or(&NOTHING)
    }

    /// The covariance of `estimator` at step k, n × n by rows.
    pub fn covariance(&self, estimator: &str, phase: &str, k: i32) -> Option<&[f64]> {
        let all = self
            .covariances
            .get(&[estimator, phase].map(str::to_owned))?;
        all.get(&k).map(Vec::as_slice)
    }

    /// The true values of a component by k.
    pub fn state(&self, component: &str) -> &BTreeMap<i32, f64> {
        static NOTHING: BTreeMap<i32, f64> = BTreeMap::new();
        self.truth.get(component).unwrap_or(&NOTHING)
    }

    /// The last step.
    pub fn last(&self) -> i32 {
        let ends = self.truth.values().filter_map(|v| v.last_key_value());
        ends.map(|(k, _)| *k).max().unwrap_or(0)
    }

    /// Whether the true state is in the box of `estimator` at step k.
    pub fn is_inside(&self, estimator: &str, phase: &str, k: i32) -> bool {
        self.states.iter().all(|(name, _)| {
            let trail = self.trail(estimator, phase, name);
            let ends = (
                trail.lower.get(&k),
                self.state(name).get(&k),
                trail.upper.get(&k),
            );
            matches!(ends, (Some(lower), Some(x), Some(upper)) if lower <= x && x <= upper)
        })
    }
}

impl Source {
    /// Reads the manifest.
    pub fn open(lake: &Path) -> Result<Self, Error> {
        Ok(Self {
            lake: lake.to_owned(),
            entries: lake::read_manifest(lake)?,
        })
    }

    /// Everything that the lake holds, the published papers in their order, then the user's own.
    pub fn papers(&self) -> Result<Vec<Held>, Error> {
        let mut found: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for entry in &self.entries {
            let PathKeys { paper, experiment } = lake::path_keys(&entry.path);
            if let Some(paper) = paper {
                // What was attacked is a system, and no experiment.
                let experiment = experiment.filter(|_| entry.table != Attack::TABLE);
                found.entry(paper).or_default().extend(experiment);
            }
        }
        let known = papers::names();
        let mut names: Vec<&str> = found.keys().copied().collect();
        names.sort_by_key(|name| {
            (
                known.iter().position(|k| k == name).unwrap_or(known.len()),
                *name,
            )
        });
        names
            .into_iter()
            .map(|name| self.held(name, &found[name]))
            .collect()
    }

    fn held(&self, name: &str, experiments: &BTreeSet<&str>) -> Result<Held, Error> {
        let paper = if papers::names().contains(&name) {
            papers::load(&[name.to_owned()])?.pop()
        } else {
            None
        };
        let mut held = Held {
            name: name.to_owned(),
            experiments: experiments.iter().map(|e| (*e).to_owned()).collect(),
            comparisons: match &paper {
                Some(paper) => {
                    let path = self.lake.join(lake::paper_table_path("comparison", name));
                    judged::of(self.of_paper::<Comparison>(name)?, paper, &path)?
                }
                None => Vec::new(),
            },
            claims: self.of_paper(name)?,
            attacks: self.attacks(name)?,
            published: self.of_paper(name)?,
            paper,
        };
        if held.is_quick() {
            held.paper = held.paper.map(Paper::quick);
        }
        Ok(held)
    }

    fn of_paper<R: Row>(&self, paper: &str) -> Result<Vec<R>, Error> {
        self.read_if_there(&lake::paper_table_path(R::TABLE, paper))
    }

    fn of_experiment<R: Row>(&self, paper: &str, experiment: &str) -> Result<Vec<R>, Error> {
        self.read_if_there(&lake::table_path(R::TABLE, paper, experiment))
    }

    fn read_if_there<R: Row>(&self, path: &str) -> Result<Vec<R>, Error> {
        if self.entries.iter().any(|e| e.path == path) {
            table::read(&self.lake.join(path))
        } else {
            Ok(Vec::new())
        }
    }

    /// The attacks on what a paper calls guaranteed, system by system.
    fn attacks(&self, paper: &str) -> Result<Vec<(String, Vec<Attack>)>, Error> {
        let of = |entry: &Entry| {
            let keys = lake::path_keys(&entry.path);
            let system = keys.experiment.filter(|_| keys.paper == Some(paper))?;
            (entry.table == Attack::TABLE).then(|| system.to_owned())
        };
        let systems = self.entries.iter().filter_map(of);
        let read = |system: String| Ok((system.clone(), self.of_experiment(paper, &system)?));
        systems.map(read).collect()
    }

    /// How long the steps of an experiment took; not vouched for.
    pub fn timings(&self, paper: &str, experiment: &str) -> Result<Vec<Timing>, Error> {
        self.not_vouched_for(&lake::table_path(Timing::TABLE, paper, experiment))
    }

    /// The printed times of a paper beside those of this lake; not vouched for.
    pub fn timing_comparisons(&self, paper: &str) -> Result<Vec<TimingComparison>, Error> {
        self.not_vouched_for(&lake::paper_table_path(TimingComparison::TABLE, paper))
    }

    fn not_vouched_for<R: Row>(&self, path: &str) -> Result<Vec<R>, Error> {
        let path = self.lake.join(path);
        match path.exists() {
            true => table::read(&path),
            false => Ok(Vec::new()),
        }
    }

    /// The counts of a paper's claims about cost.
    pub fn complexity(&self, paper: &str) -> Result<Vec<Complexity>, Error> {
        self.of_paper(paper)
    }

    /// The scores of an experiment.
    pub fn scores(&self, paper: &str, experiment: &str) -> Result<Vec<Score>, Error> {
        self.of_experiment(paper, experiment)
    }

    /// The estimators of an experiment.
    pub fn estimators(&self, paper: &str, experiment: &str) -> Result<Vec<EstimatorInfo>, Error> {
        self.of_experiment(paper, experiment)
    }

    /// The sets that were kept of run 0 of an experiment.
    pub fn sets(&self, paper: &str, experiment: &str) -> Result<Vec<Set>, Error> {
        self.of_experiment(paper, experiment)
    }

    /// Run 0 of an experiment; None if the lake does not hold it.
    pub fn first_run(&self, paper: &str, experiment: &str) -> Result<Option<FirstRun>, Error> {
        let path = |table: &str| self.lake.join(lake::table_path(table, paper, experiment));
        let held = lake::table_path("estimates", paper, experiment);
        if !self.entries.iter().any(|e| e.path == held) {
            return Ok(None);
        }
        let variables: Vec<Variable> = self.of_experiment(paper, experiment)?;
        let mut run = FirstRun {
            truth: BTreeMap::new(),
            measured: BTreeMap::new(),
            states: variables
                .iter()
                .filter(|v| &*v.role == "x")
                .map(|v| (v.component.to_string(), v.unit.to_string()))
                .collect(),
            seed: seed(&path("truth"))?.unwrap_or_else(|| "unknown".to_owned()),
            trails: BTreeMap::new(),
            covariances: BTreeMap::new(),
        };
        for row in rows_of_runs::<Truth>(&path("truth"), 1)? {
            run.truth
                .entry(row.component.to_string())
                .or_default()
                .insert(row.k, row.value);
        }
        for row in rows_of_runs::<Measurement>(&path("measurements"), 1)? {
            let values = run.measured.entry(row.component.to_string()).or_default();
            values.extend(row.value.map(|value| (row.k, value)));
        }
        for row in rows_of_runs::<Estimate>(&path("estimates"), 1)? {
            let key = [row.estimator, row.phase, row.component].map(|name| name.to_string());
            let trail = run.trails.entry(key).or_default();
            trail.center.extend(row.center.map(|value| (row.k, value)));
            trail.lower.extend(row.lower.map(|value| (row.k, value)));
            trail.upper.extend(row.upper.map(|value| (row.k, value)));
        }
        for row in rows_of_runs::<Belief>(&path("beliefs"), 1)? {
            let key = [row.estimator, row.phase].map(|name| name.to_string());
            let covariances = run.covariances.entry(key).or_default();
            covariances.extend(row.covariance.map(|value| (row.k, value)));
        }
        Ok(Some(run))
    }

    /// Step k of the first `count` runs of an experiment, as `(estimator, phase)` sees it; none if the lake does not
    /// hold it.
    pub fn instants(
        &self,
        paper: &str,
        experiment: &str,
        (estimator, phase): (&str, &str),
        k: i32,
        count: i32,
    ) -> Result<Vec<Instant>, Error> {
        let path = |table: &str| self.lake.join(lake::table_path(table, paper, experiment));
        let held = lake::table_path("estimates", paper, experiment);
        if !self.entries.iter().any(|e| e.path == held) {
            return Ok(Vec::new());
        }
        let mut found: BTreeMap<i32, Instant> = BTreeMap::new();
        let nothing = || Instant {
            state: Vec::new(),
            center: Vec::new(),
            lower: Vec::new(),
            upper: Vec::new(),
        };
        // The rows of a step are in the order of the components.
        for row in rows_of_runs::<Truth>(&path("truth"), count)? {
            if row.k == k {
                let at = found.entry(row.run).or_insert_with(nothing);
                at.state.push(row.value);
            }
        }
        for row in rows_of_runs::<Estimate>(&path("estimates"), count)? {
            if row.k == k && *row.estimator == *estimator && *row.phase == *phase {
                let at = found.entry(row.run).or_insert_with(nothing);
                at.center.extend(row.center);
                at.lower.extend(row.lower);
                at.upper.extend(row.upper);
            }
        }
        let whole = |at: &Instant| !at.state.is_empty() && at.state.len() == at.center.len();
        Ok(found.into_values().filter(whole).collect())
    }

    /// The seed of an experiment, as its file in the lake says.
    pub fn seed(&self, paper: &str, experiment: &str) -> Result<Option<String>, Error> {
        let path = lake::table_path("truth", paper, experiment);
        if self.entries.iter().any(|e| e.path == path) {
            seed(&self.lake.join(path))
        } else {
            Ok(None)
        }
    }
}

/// The seed in a file's key-values.
fn seed(path: &Path) -> Result<Option<String>, Error> {
    let file = File::open(path).map_err(|e| Error::io("open", path, e))?;
    let reader = SerializedFileReader::new(file).map_err(|e| Error::parquet(path, e))?;
    let values = reader.metadata().file_metadata().key_value_metadata();
    let found = values
        .into_iter()
        .flatten()
        .find(|v| v.key == "zonobench.seed_root");
    Ok(found.and_then(|v| v.value.clone()))
}

/// The rows of the first `count` runs of a table that has a column `run`. Of the many others only that column is
/// looked at.
fn rows_of_runs<R: Row>(path: &Path, count: i32) -> Result<Vec<R>, Error> {
    let failed = |column: &str| Error::Schema {
        path: path.to_owned(),
        expected: format!("column {column} of table {}", R::TABLE),
        got: "another type".to_owned(),
    };
    let column = R::columns()
        .iter()
        .position(|c| c.name == "run")
        .ok_or_else(|| failed("run"))?;
    let mut rows = Vec::new();
    for batch in table::batches::<R>(path)? {
        let batch = batch?;
        let runs = batch
            .column(column)
            .as_primitive_opt::<Int32Type>()
            .ok_or_else(|| failed("run"))?;
        let mut start = 0;
        for same in runs.values().chunk_by(|a, b| a == b) {
            if same[0] < count {
                let first = batch.slice(start, same.len());
                rows.extend(R::from_columns(first.columns()).map_err(failed)?);
            }
            start += same.len();
        }
    }
    Ok(rows)
}
