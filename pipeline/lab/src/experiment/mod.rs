//! Experiments: what stands in an `experiment.toml`, checked down to the last shape.
//!
//! A file is parsed into a tree that knows its lines (`tree`), sweeps and cases turn it into several
//! (`variants`), and each is read, key by key (`reader`, `parts`, [`metric`]). Everything that can
//! be known to be wrong is found here, before anything runs: the estimators are made once, so that a
//! setting out of range or an unobservable pair is shown at its line.

mod equations;
pub mod metric;
mod parts;
mod reader;
mod tree;
mod unit;
mod variants;

use crate::command::{self, CommandSettings};
use crate::recorded;
use reader::{Field, Table, deserialize};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use tree::{Node, Source};
use zonobench_estimation::estimator::KINDS;
use zonobench_estimation::system::System;
use zonobench_estimation::{
    AnyEstimator, AnySystem, EstimationError, EstimatorSettings, Inputs, Problem, Truth, Uncertain,
};
use zonobench_lake::Error;
use zonobench_lake::bad_input::{BadInput, listed, nearest, shortened};

pub use metric::{METRICS, MetricInfo, MetricSpec};

/// The version of the files that this program reads.
pub const SCHEMA: i64 = 1;

/// The most runs and the last step that a file may ask for.
const MOST: i64 = 1_000_000;

/// The longest id: it becomes part of the names of folders and files.
const LONGEST_ID: usize = 120;

/// One experiment. Its serialized form is canonical: it has what decides the results, and nothing else.
#[derive(Clone, Debug, Serialize)]
pub struct Experiment {
    /// The paper, or a name of the user's own.
    pub paper: String,
    /// The name within the paper.
    pub id: String,
    /// What it shows, in a line.
    pub title: Option<String>,
    /// What it shows, at length.
    pub description: Option<String>,
    /// The seed of all its random numbers.
    pub seed: u64,
    /// The number of runs, at least 1.
    pub runs: usize,
    /// The last k; k = 0 is the start.
    pub steps: usize,
    /// What the estimators are told, unless they have their own.
    pub problem: Problem,
    /// How the data are made.
    pub truth: Truth,
    /// What drives the system.
    pub inputs: Inputs,
    /// The estimators, with ids that differ.
    pub estimators: Vec<EstimatorSpec>,
    /// What the runs are folded into.
    pub metrics: Vec<MetricSpec>,
    /// What goes to the lake besides.
    pub output: Output,
}

/// How an estimator is made.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Method {
    /// One of this program's own.
    BuiltIn(EstimatorSettings),
    /// A program of the user's own.
    Command(CommandSettings),
}

impl Method {
    /// The settings of an estimator of this program's own.
    pub fn built_in(&self) -> Option<&EstimatorSettings> {
        match self {
            Self::BuiltIn(settings) => Some(settings),
            Self::Command(_) => None,
        }
    }

    /// The value of `kind`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::BuiltIn(settings) => settings.kind(),
            Self::Command(settings) => settings.kind,
        }
    }
}

/// An estimator of an experiment.
#[derive(Clone, Debug, Serialize)]
pub struct EstimatorSpec {
    /// Its name in every output.
    pub id: String,
    /// Its kind and settings.
    pub settings: Method,
    /// What it is told: its own prior and noises where it has them, else those of the experiment.
    pub problem: Problem,
}

/// `[output]`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Output {
    /// Steps at which the sets of run 0 go to the lake, ascending.
    pub sets: Vec<usize>,
    /// Whether run 0 is written as a trace.
    pub traces: bool,
    /// Whether of estimators that report updated beliefs only those are kept and judged: a predicted set
    /// may be far larger than what is left of it after the reduction.
    pub updated_only: bool,
}

/// What `track` needs of a file: estimators, what they are told, what is wanted of them; no truth.
#[derive(Clone, Debug, Serialize)]
pub struct Tracking {
    /// The paper, or a name of the user's own.
    pub paper: String,
    /// The name within the paper.
    pub id: String,
    /// What the estimators are told, unless they have their own.
    pub problem: Problem,
    /// The estimators, with ids that differ.
    pub estimators: Vec<EstimatorSpec>,
    /// The metrics.
    pub metrics: Vec<MetricSpec>,
    /// What is kept besides the estimates.
    pub output: Output,
}

impl Experiment {
    /// The experiments of a file: one, or as many as its sweep and cases give.
    ///
    /// Fails, with the line to blame, on everything that is wrong with the file.
    pub fn load(path: &Path) -> Result<Vec<Self>, Error> {
        let source = source(path)?;
        Ok(read_all(&source, path.parent(), experiment)?)
    }

    /// The experiments of a text that stands in no folder, and so cannot refer to other files; `file`
    /// is what errors call it.
    pub fn parse(file: &str, text: &str) -> Result<Vec<Self>, BadInput> {
        let source = Source {
            file: file.into(),
            text: text.into(),
        };
        read_all(&source, None, experiment)
    }

    /// What is right in a file and perhaps not meant: the first `most`, each at its place, and how many there are. None
    /// where the file cannot be read.
    pub fn warnings(path: &Path, most: usize) -> (Vec<BadInput>, usize) {
        let Ok(source) = source(path) else {
            return (Vec::new(), 0);
        };
        let Ok(root) = Node::parse(&source) else {
            return (Vec::new(), 0);
        };
        let any: Vec<&str> = root.entries().iter().map(|e| e.key.as_str()).collect();
        let table = Table::new(&source, String::new(), &root, &any);
        let system = table.ok().and_then(|table| table.get("system"));
        system.map_or((Vec::new(), 0), |system| equations::warnings(&system, most))
    }

    /// `paper/id`, for messages.
    pub fn name(&self) -> String {
        format!("{}/{}", self.paper, self.id)
    }

    /// The same experiment, smaller: at most [`QUICK_RUNS`] runs and [`QUICK_STEPS`] steps, but no
    /// fewer steps than a metric's `from` or `at` reaches, so that every estimator and every metric is
    /// still there. Steps of the output and of `to` are cut to those that are left.
    pub fn quick(&self) -> Self {
        let mut quick = self.clone();
        quick.runs = self.runs.min(QUICK_RUNS);
        let reached = self
            .metrics
            .iter()
            .flat_map(|m| m.at.iter().copied().chain([m.from]))
            .max();
        quick.steps = self.steps.min(QUICK_STEPS.max(reached.unwrap_or(0)));
        for metric in &mut quick.metrics {
            metric.to = metric.to.map(|to| to.min(quick.steps));
        }
        quick.output.sets.retain(|&k| k <= quick.steps);
        quick
    }
}

/// Allows the programs among `estimators` to be started, or refuses the first where the user has not asked for that.
pub fn allow_commands(estimators: &mut [EstimatorSpec], allow: bool) -> Result<(), Error> {
    for spec in estimators {
        if let Method::Command(settings) = &mut spec.settings {
            if !allow {
                return Err(command::not_allowed(&spec.id, settings));
            }
            settings.allowed = true;
        }
    }
    Ok(())
}

/// The runs of a quick experiment.
pub const QUICK_RUNS: usize = 4;
/// The last step of a quick experiment, unless a metric reaches further.
pub const QUICK_STEPS: usize = 30;

impl Tracking {
    /// The estimators of a file, once for each combination of its sweep and cases. Truth, inputs, runs and steps
    /// may be left out, and are not looked at.
    pub fn load(path: &Path) -> Result<Vec<Self>, Error> {
        let source = source(path)?;
        Ok(read_all(&source, path.parent(), tracking)?)
    }

    /// As [`Experiment::parse`].
    pub fn parse(file: &str, text: &str) -> Result<Vec<Self>, BadInput> {
        read_all(
            &Source {
                file: file.into(),
                text: text.into(),
            },
            None,
            tracking,
        )
    }
}

fn source(path: &Path) -> Result<Source, BadInput> {
    let file = path.display().to_string();
    let fault = |fault: String| BadInput::file(&file, fault);
    let mut bytes = Vec::new();
    // From a pipe or a device as well, which do not say how much they hold.
    File::open(path)
        .and_then(|opened| opened.take(MOST_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|error| fault(format!("expected a TOML file, got: {error}")))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(fault(format!(
            "expected at most {MOST_BYTES} bytes, got more"
        )));
    }
    match String::from_utf8(bytes) {
        Ok(text) => Ok(Source { file, text }),
        Err(_) => Err(fault("expected UTF-8 text, got other bytes".to_owned())),
    }
}

/// The most bytes that are read of an experiment's file: a larger one takes longer than a second. Recordings are files of their
/// own.
const MOST_BYTES: u64 = 4 << 20;

/// What [`read_all`] reads from each variant: an experiment, or what `track` needs of one.
trait Named {
    fn id(&self) -> &str;
}

impl Named for Experiment {
    fn id(&self) -> &str {
        &self.id
    }
}

impl Named for Tracking {
    fn id(&self) -> &str {
        &self.id
    }
}

fn read_all<T: Named>(
    source: &Source,
    folder: Option<&Path>,
    read: impl Fn(&Table, &str, Option<&Path>) -> Result<T, BadInput>,
) -> Result<Vec<T>, BadInput> {
    if source.text.trim().is_empty() {
        return Err(BadInput::file(
            &source.file,
            "expected an experiment, got an empty file",
        ));
    }
    let root = Node::parse(source)?;
    check_schema(source, &root)?;
    let mut all = Vec::new();
    let mut ids = BTreeSet::new();
    for (suffix, node) in variants::variants(source, root)? {
        let table = Table::new(source, String::new(), &node, ROOT_KEYS)?;
        let one = read(&table, &suffix, folder)?;
        if !ids.insert(one.id().to_owned()) {
            let message = format!(
                "id: expected experiments with different names, got {} twice",
                one.id()
            );
            return Err(BadInput::file(&source.file, message));
        }
        all.push(one);
    }
    if all.is_empty() {
        return Err(BadInput::file(
            &source.file,
            "case: expected at least one case, got none",
        ));
    }
    Ok(all)
}

const ROOT_KEYS: &[&str] = &[
    "schema",
    "paper",
    "id",
    "title",
    "description",
    "seed",
    "runs",
    "steps",
    "system",
    "prior",
    "noise",
    "truth",
    "inputs",
    "estimator",
    "metric",
    "sweep",
    "case",
    "output",
];

/// First of all, because a file of another schema may have keys that this one does not know.
fn check_schema(source: &Source, root: &Node) -> Result<(), BadInput> {
    let any: Vec<&str> = root
        .entries()
        .iter()
        .map(|entry| entry.key.as_str())
        .collect();
    let table = Table::new(source, String::new(), root, &any)?;
    let field = table.need("schema", &format!("schema = {SCHEMA}"))?;
    let schema = field.integer(1..=i64::MAX, &format!("schema = {SCHEMA}"))?;
    if schema > SCHEMA {
        let message =
            format!("expected schema = {SCHEMA}, the newest that this program knows, got {schema}");
        return Err(field
            .fault(message)
            .with_help("the file is for a newer zonobench"));
    }
    Ok(())
}

/// A name that may become part of a path: `[a-z][a-z0-9_-]*`.
pub(crate) fn identifier(field: &Field) -> Result<String, BadInput> {
    let text = field.string()?;
    let mut characters = text.chars();
    let fits = characters.next().is_some_and(|c| c.is_ascii_lowercase())
        && characters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-');
    if !fits {
        return Err(field.expected("a lower-case letter, then lower-case letters, digits, _ and -"));
    }
    if text.len() > LONGEST_ID {
        return Err(field.fault(format!(
            "expected at most {LONGEST_ID} characters, got {}",
            text.len()
        )));
    }
    Ok(text.to_owned())
}

/// Names that in a path `key=name` are no text to DuckDB (`inf` and `epoch` are dates) or polars (`inf` is a number,
/// `true` a truth value).
const NO_TEXTS: [&str; 5] = ["inf", "infinity", "epoch", "true", "false"];

/// A name that is a folder's of the lake: every reader takes it for the text that it is.
fn folder_name(field: &Field, name: &str) -> Result<(), BadInput> {
    if !NO_TEXTS.contains(&name) {
        return Ok(());
    }
    let message = format!(
        "expected a name that every reader of the lake takes for text, got \"{name}\", which DuckDB or polars \
         take for a number, a date or a truth value"
    );
    Err(field
        .fault(message)
        .with_help(format!("call it \"{name}_1\", for example")))
}

/// Ascending, different steps of at most `last`.
pub(crate) fn steps(field: &Field, last: usize) -> Result<Vec<usize>, BadInput> {
    let mut steps: Vec<usize> = Vec::new();
    for item in field.array("an array of steps")? {
        let k = item.step()?;
        if k > last {
            return Err(item.expected(format!("a step of at most {last}, the last one")));
        }
        if steps.last().is_some_and(|&before| before >= k) {
            return Err(item.expected("ascending steps"));
        }
        steps.push(k);
    }
    Ok(steps)
}

/// What an experiment is about: paper, id, problem, estimators.
struct Subject {
    paper: String,
    id: String,
    problem: Problem,
    estimators: Vec<EstimatorSpec>,
}

fn subject(root: &Table, suffix: &str, folder: Option<&Path>) -> Result<Subject, BadInput> {
    let name = "a name of lower-case letters, digits, _ and -";
    let field = root.need("paper", name)?;
    let paper = identifier(&field)?;
    folder_name(&field, &paper)?;
    let field = root.need("id", name)?;
    let id = format!("{}{suffix}", identifier(&field)?);
    if id.len() > LONGEST_ID {
        return Err(field.fault(format!(
            "expected at most {LONGEST_ID} characters with the part of the variant, got {}",
            id.len()
        )));
    }
    folder_name(&field, &id)?;
    let problem = problem(root)?;
    let estimators = estimators(root, &problem, folder)?;
    Ok(Subject {
        paper,
        id,
        problem,
        estimators,
    })
}

fn tracking(root: &Table, suffix: &str, folder: Option<&Path>) -> Result<Tracking, BadInput> {
    let Subject {
        paper,
        id,
        problem,
        estimators,
    } = subject(root, suffix, folder)?;
    // How many steps there are, the recording says.
    let metrics = metrics(root, &problem, &estimators, recorded::MOST_STEPS)?;
    let output = output(root, recorded::MOST_STEPS)?;
    Ok(Tracking {
        paper,
        id,
        problem,
        estimators,
        metrics,
        output,
    })
}

fn experiment(root: &Table, suffix: &str, folder: Option<&Path>) -> Result<Experiment, BadInput> {
    let Subject {
        paper,
        id,
        problem,
        estimators,
    } = subject(root, suffix, folder)?;
    let text = |key: &str| {
        root.get(key)
            .map(|field| field.string().map(str::to_owned))
            .transpose()
    };
    let seed = root
        .need("seed", "an integer")?
        .integer(0..=i64::MAX, "an integer of at least 0")? as u64;
    let range = format!("an integer from 1 to {MOST}");
    let field = root.need("runs", &range)?;
    let runs = field.integer(1..=MOST, &range)? as usize;
    let steps = root.need("steps", &range)?.integer(1..=MOST, &range)? as usize;
    let inputs = parts::inputs(
        root.get("inputs").as_ref(),
        root,
        &problem.system,
        steps,
        folder,
    )?;
    let truth = parts::truth(root.get("truth").as_ref(), root, &problem, steps, folder)?;
    if let Some(distinct) = truth.distinct_runs()
        && runs as u64 > distinct
    {
        let message = format!(
            "expected at most {distinct}, because nothing is drawn and runs would repeat, got {runs}"
        );
        return Err(field.fault(message));
    }
    let metrics = metrics(root, &problem, &estimators, steps)?;
    let output = output(root, steps)?;
    if output.traces {
        check_clock(root, &problem.system, steps)?;
    }
    Ok(Experiment {
        paper,
        id,
        title: text("title")?,
        description: text("description")?,
        seed,
        runs,
        steps,
        problem,
        truth,
        inputs,
        estimators,
        metrics,
        output,
    })
}

fn problem(root: &Table) -> Result<Problem, BadInput> {
    let system = parts::system(&root.need("system", "a table")?)?;
    let variables = system.variables();
    let n_w = variables.w.len() - system.n_delta();
    let prior = parts::uncertain(&root.need("prior", "a table")?, variables.x.len())?;
    let noise = root
        .need("noise", "a table with w and v")?
        .table(&["w", "v"])?;
    let w = parts::uncertain(
        &noise.need("w", "a table, {} where there is no such noise")?,
        n_w,
    )?;
    let v = parts::uncertain(
        &noise.need("v", "a table, {} where there is no such noise")?,
        variables.v.len(),
    )?;
    Problem::new(system, prior, w, v)
        .map_err(|fault| parts::at_path(root, fault.part, &fault.source.to_string()))
}

fn estimators(
    root: &Table,
    problem: &Problem,
    folder: Option<&Path>,
) -> Result<Vec<EstimatorSpec>, BadInput> {
    let list = root.need("estimator", "[[estimator]] tables")?;
    let mut all: Vec<EstimatorSpec> = Vec::new();
    for field in list.array("[[estimator]] tables")? {
        let spec = estimator(root, &field, problem, folder)?;
        if all.iter().any(|other| other.id == spec.id) {
            let table = field.any_table()?;
            return Err(table.fault(
                "id",
                format!("expected an id of its own, got {:?} again", spec.id),
            ));
        }
        all.push(spec);
    }
    if all.is_empty() {
        return Err(list.fault("expected at least one estimator, got none"));
    }
    Ok(all)
}

fn estimator(
    root: &Table,
    field: &Field,
    problem: &Problem,
    folder: Option<&Path>,
) -> Result<EstimatorSpec, BadInput> {
    let table = field.any_table()?;
    let id = identifier(&table.need("id", "a name")?)?;
    let table = table.renamed(format!("estimator.{id}"));
    let kinds = KINDS.iter().map(|info| info.kind);
    let kinds: Vec<&'static str> = kinds.chain([command::KIND]).collect();
    let kind_field = table.need(
        "kind",
        &format!("a kind of estimator ({})", listed(kinds.iter().copied())),
    )?;
    let kind = kind_field.one_of(&kinds)?;
    let info = KINDS.iter().find(|info| info.kind == kind);
    let keys = info.map_or(command::KEYS, |info| info.keys);
    let own = ["id", "kind", "prior", "noise"];
    if let Err(fault) = table.only(&[&own[..], keys].concat()) {
        return Err(elsewhere(&table, keys, &own, kind, fault));
    }
    let variables = problem.system.variables();
    let n_w = variables.w.len() - problem.system.n_delta();
    let noise = table
        .get("noise")
        .map(|field| field.table(&["w", "v"]))
        .transpose()?;
    let own_or = |field: Option<Field>, n: usize, shared: &Uncertain| match field {
        Some(field) => parts::uncertain(&field, n),
        None => Ok(shared.clone()),
    };
    let noise = |key: &str| noise.as_ref().and_then(|noise| noise.get(key));
    let told = Problem {
        system: problem.system.clone(),
        prior: own_or(table.get("prior"), variables.x.len(), &problem.prior)?,
        w: own_or(noise("w"), n_w, &problem.w)?,
        v: own_or(noise("v"), variables.v.len(), &problem.v)?,
    };
    let settings = match info {
        None => Method::Command(parts::command(&table, folder)?),
        Some(_) => {
            let settings = deserialize(&table, &["id", "prior", "noise"])?;
            AnyEstimator::new(&settings, &told).map_err(|error| refused(root, &table, &error))?;
            Method::BuiltIn(settings)
        }
    };
    Ok(EstimatorSpec {
        id,
        settings,
        problem: told,
    })
}

/// The complaint about an unknown key, with a note where another kind of estimator has that key.
fn elsewhere(table: &Table, keys: &[&str], own: &[&str], kind: &str, fault: BadInput) -> BadInput {
    let unknown = table
        .keys()
        .find(|key| !own.contains(key) && !keys.contains(key));
    let Some(unknown) = unknown else { return fault };
    if nearest(unknown, keys.iter().copied()).is_some() {
        return fault;
    }
    let owners = KINDS
        .iter()
        .filter(|info| info.keys.contains(&unknown))
        .map(|info| info.kind);
    let owners: Vec<&str> = owners.collect();
    if owners.is_empty() {
        return fault;
    }
    let (unknown, owners) = (shortened(unknown), listed(owners));
    fault.with_help(format!("{kind} has no {unknown}; {owners} has"))
}

/// An estimator that cannot be made, shown at the setting or the part of the problem to blame.
fn refused(root: &Table, table: &Table, error: &EstimationError) -> BadInput {
    match error {
        EstimationError::Setting {
            kind,
            key,
            expected,
            got,
        } => {
            let fault = format!("expected {expected}, got {got}");
            let section = key.split('.').next().unwrap_or(key);
            match (key.contains('.'), table.get(section)) {
                (false, _) => table.fault(key, fault),
                (true, Some(_)) => parts::at_path(table, key, &fault),
                (true, None) => parts::at_path(root, key, &fault),
            }
            .with_help(format!("{} is of kind {kind}", table.path()))
        }
        EstimationError::Problem(fault) => {
            parts::at_path(root, fault.part, &fault.source.to_string())
        }
        other => table.fault("kind", other),
    }
}

fn metrics(
    root: &Table,
    problem: &Problem,
    estimators: &[EstimatorSpec],
    steps: usize,
) -> Result<Vec<MetricSpec>, BadInput> {
    let Some(list) = root.get("metric") else {
        return Ok(Vec::new());
    };
    let ids: Vec<&str> = estimators.iter().map(|e| e.id.as_str()).collect();
    let variables = problem.system.variables();
    let states: Vec<&str> = variables.x.iter().map(|v| v.name.as_str()).collect();
    let mut all: Vec<MetricSpec> = Vec::new();
    for field in list.array("[[metric]] tables")? {
        let spec = MetricSpec::read(&field, &ids, &states, steps)?;
        if all
            .iter()
            .any(|other| other.id == spec.id && other.over == spec.over)
        {
            let table = field.any_table()?;
            let key = if table.get("id").is_some() {
                "id"
            } else {
                "name"
            };
            return Err(table
                .fault(
                    key,
                    format!(
                        "expected a metric with an id of its own, got {:?} again",
                        spec.id
                    ),
                )
                .with_help("give one of them an id"));
        }
        all.push(spec);
    }
    Ok(all)
}

fn output(root: &Table, last: usize) -> Result<Output, BadInput> {
    let Some(field) = root.get("output") else {
        return Ok(Output::default());
    };
    let table = field.table(&["sets", "traces", "updated_only"])?;
    let flag = |key: &str| -> Result<bool, BadInput> {
        let field = table.get(key).map(|field| field.boolean());
        Ok(field.transpose()?.unwrap_or(false))
    };
    Ok(Output {
        sets: table
            .get("sets")
            .map(|field| steps(&field, last))
            .transpose()?
            .unwrap_or_default(),
        traces: flag("traces")?,
        updated_only: flag("updated_only")?,
    })
}

/// Fails where the stamps of a trace, whole nanoseconds, could not tell the steps apart or would run out.
fn check_clock(root: &Table, system: &AnySystem, steps: usize) -> Result<(), BadInput> {
    let Some((key, period)) = system.period_key().zip(system.period()) else {
        return Ok(());
    };
    let longest = zonobench_trace::LONGEST_S / steps as f64;
    let expected = if period < zonobench_trace::SHORTEST_S {
        format!("at least {:e} s", zonobench_trace::SHORTEST_S)
    } else if period > longest {
        format!("at most {longest:.3e} s for {steps} steps")
    } else {
        return Ok(());
    };
    let fault =
        format!("expected {expected} beside output.traces, whose clock counts ns, got {period:?}");
    let path = format!("system.{key}");
    Err(parts::at_path(root, &path, &fault)
        .with_help("leave out output.traces, or set it to false"))
}

#[cfg(test)]
mod tests;
