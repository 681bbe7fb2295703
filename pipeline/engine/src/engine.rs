//! The walks over the graph: running it, planning it, drawing it.
//!
//! Experiments, estimators and runs are spread over the threads; results are put in order by index, so
//! that neither the number of threads nor their timing leaves a trace in a hashed file.

use crate::graph::{self, Done, Node, Work, file};
use crate::progress::Progress;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;
use zonobench_attack::Own;
use zonobench_estimation::simulate::simulate as simulated;
use zonobench_estimation::{AnyEstimator, Estimator as _};
use zonobench_evidence::{attack, count};
use zonobench_lab::experiment::EstimatorSpec;
use zonobench_lab::stage::Experiment;
use zonobench_lab::stage::ending::{self, Ending};
use zonobench_lake::error::Error;
use zonobench_lake::lake::Publication;
use zonobench_lake::rows;
use zonobench_lake::store::{Artifact, Status, Store, Target};
use zonobench_lake::table;
use zonobench_verdicts::compare;
use zonobench_verdicts::papers::Paper;

pub use crate::publish::{paper_publications, publications};
pub use crate::times::{write_timing_comparison, write_timings};

/// An experiment with all its results.
pub struct Finished {
    /// The experiment.
    pub experiment: Arc<Experiment>,
    pub(crate) simulation: Artifact,
    pub(crate) estimates: Vec<Artifact>,
    /// The runs that an estimator ended without a belief, for a reason that is no result.
    pub failures: Vec<Ending>,
    pub(crate) traces: Vec<Artifact>,
    pub(crate) metrics: Artifact,
    pub(crate) scores: Artifact,
    /// Results made now.
    pub made: usize,
    /// Results found in the store.
    pub found: usize,
}

/// What a paper's results are beside its experiments.
pub struct Compared<'a> {
    pub(crate) results: Vec<(Node<'a>, Artifact)>,
}

/// Makes (or finds) every node, each after what it needs, which is in `done` or among `nodes`; returns how many were
/// made. Nodes that need nothing of each other are made at once.
fn walk(store: &Store, nodes: &[Node], done: &mut Done, work: &Work) -> Result<usize, Error> {
    let mut made = 0;
    let mut open: Vec<Node> = nodes.to_vec();
    while !open.is_empty() {
        let is_ready = |node: &Node| node.needs().iter().all(|need| done.get(need).is_some());
        let (ready, later): (Vec<Node>, Vec<Node>) = open.into_iter().partition(is_ready);
        assert!(!ready.is_empty(), "what a node needs is in the graph");
        let results: Vec<(Artifact, bool)> = ready
            .par_iter()
            .map(|node| one(store, node, done, work))
            .collect::<Result<_, Error>>()?;
        for (node, (artifact, new)) in ready.iter().zip(results) {
            made += usize::from(new);
            done.add(node, artifact);
        }
        open = later;
    }
    Ok(made)
}

/// Makes (or finds) one node.
fn one(store: &Store, node: &Node, done: &Done, work: &Work) -> Result<(Artifact, bool), Error> {
    let input = node.input(done).expect("what it needs is there");
    let (artifact, made) = store.run(&node.target(), node.code(), &input, |dir| {
        node.make(done, work, dir)
    })?;
    if let (false, Some(progress), Some((name, what, all))) = (made, work.progress, node.told()) {
        progress.advance(&name, &what, all);
    }
    Ok((artifact, made))
}

/// Runs (or finds) every stage of `experiment`.
pub fn run(
    store: &Store,
    experiment: &Arc<Experiment>,
    progress: &Progress,
) -> Result<Finished, Error> {
    let nodes = graph::of_experiment(experiment);
    let mut done = Done::default();
    let made = walk(store, &nodes, &mut done, &Work::told(progress))?;
    let found = nodes.len() - made;
    progress.finish(&experiment.name(), made, found);
    let all = |wanted: fn(&Node) -> bool| -> Vec<Artifact> {
        let nodes = nodes.iter().filter(|node| wanted(node));
        nodes.filter_map(|node| done.get(node).cloned()).collect()
    };
    let the = |node: Node| done.get(&node).expect("every node was made").clone();
    let estimates = all(|node| matches!(node, Node::Estimate(..)));
    let mut failures = Vec::new();
    for path in estimates.iter().filter_map(|a| a.path(ending::FILE)) {
        failures.extend(ending::read(&path)?);
    }
    Ok(Finished {
        experiment: experiment.clone(),
        simulation: the(Node::Simulate(experiment)),
        estimates,
        failures,
        traces: all(|node| matches!(node, Node::Trace(..))),
        metrics: the(Node::Reduce(experiment)),
        scores: the(Node::Score(experiment)),
        made,
        found,
    })
}

/// Runs (or finds) a paper's claims and counts, and the comparison of its printed numbers with them and with
/// the results.
pub fn compare<'a>(
    store: &Store,
    paper: &'a Paper,
    finished: &[Finished],
    scale: compare::Scale,
) -> Result<Compared<'a>, Error> {
    let mut done = Done::default();
    for f in finished {
        done.add(&Node::Reduce(&f.experiment), f.metrics.clone());
    }
    let nodes = graph::of_paper(paper, scale);
    walk(store, &nodes, &mut done, &Work::default())?;
    let result = |node: Node<'a>| Some((node, done.get(&node)?.clone()));
    Ok(Compared {
        results: nodes.iter().filter_map(|node| result(*node)).collect(),
    })
}

/// The rows of a paper's counts, made or found; none where it has no claims about cost.
pub fn counted(store: &Store, paper: &str) -> Result<Vec<rows::Complexity>, Error> {
    match graph::counted(paper) {
        Some(node) => {
            let (artifact, _) = one(store, &node, &Done::default(), &Work::default())?;
            table::read(&file(&artifact, count::FILE)?)
        }
        None => Ok(Vec::new()),
    }
}

/// Attacks (or finds attacked) what of a paper is called guaranteed, on every family of problems; publishes the counts.
pub fn attack(
    store: &Store,
    paper: &str,
    size: attack::Size,
    progress: &Progress,
) -> Result<Vec<Publication<'static>>, Error> {
    let mut files = Vec::new();
    for node in graph::attacks(paper, size) {
        let (artifact, _) = one(store, &node, &Done::default(), &Work::told(progress))?;
        files.extend(crate::publish::of_node(&node, &artifact)?);
    }
    Ok(files)
}

/// The guaranteed estimators of an experiment, to be attacked on its problem under its inputs.
pub fn owns(experiment: &Experiment) -> Result<Vec<Own>, Error> {
    let e = experiment;
    let driven = simulated(&e.problem.system, &e.truth, &e.inputs, e.seed, 0, e.steps);
    let inputs = driven
        .map_err(|source| Error::Simulation {
            experiment: e.name(),
            run: 0,
            source: Box::new(source),
        })?
        .u;
    let own = |spec: &EstimatorSpec| {
        let settings = spec.settings.built_in()?;
        let made = AnyEstimator::new(settings, &spec.problem);
        let is_guaranteed = made.is_ok_and(|estimator| estimator.guaranteed());
        is_guaranteed.then(|| Own {
            system: e.name(),
            estimator: spec.id.clone(),
            settings: settings.clone(),
            problem: spec.problem.clone(),
            inputs: inputs.clone(),
        })
    };
    Ok(e.estimators.iter().filter_map(own).collect())
}

/// How many units [`attack_own`] runs.
pub fn own_units(experiment: &Experiment, size: attack::Size) -> Result<u64, Error> {
    Ok(attack::own_units(&owns(experiment)?, size))
}

/// Attacks (or finds attacked) the guaranteed estimators of an experiment on its own problem.
pub fn attack_own(
    store: &Store,
    experiment: &Experiment,
    size: attack::Size,
    progress: &Progress,
) -> Result<Publication<'static>, Error> {
    let owns = owns(experiment)?;
    let node = Node::AttackOwn(experiment, &owns, size);
    let (artifact, _) = one(store, &node, &Done::default(), &Work::told(progress))?;
    let mut files = crate::publish::of_node(&node, &artifact)?;
    Ok(files.pop().expect("an attack is one table"))
}

/// Whether [`attack_own`] would run.
pub fn plan_own(store: &Store, experiment: &Experiment) -> Result<Planned, Error> {
    let owns = owns(experiment)?;
    let node = Node::AttackOwn(experiment, &owns, attack::Size::Times(1));
    let mut planned = look(store, &[node], &mut Done::default());
    Ok(planned.pop().expect("a node is one line"))
}

/// One line of a plan.
pub struct Planned {
    /// What.
    pub target: Target,
    /// Whether it would run, and why.
    pub status: Status,
}

/// What would run of these nodes, without running or hashing anything; `done` learns what is there.
fn look(store: &Store, nodes: &[Node], done: &mut Done) -> Vec<Planned> {
    let mut planned = Vec::new();
    for node in nodes {
        let target = node.target();
        let status = match node.input(done) {
            Some(input) => {
                if let Some(artifact) = store.peek(node.stage(), node.code(), &input) {
                    done.add(node, artifact);
                }
                store.status(&target, node.code(), &input)
            }
            None => Status::Upstream,
        };
        planned.push(Planned { target, status });
    }
    planned
}

/// What would run for `experiment`, without running or hashing anything.
pub fn plan(store: &Store, experiment: &Experiment) -> Vec<Planned> {
    look(
        store,
        &graph::of_experiment(experiment),
        &mut Done::default(),
    )
}

/// The nodes of a paper apart from its experiments.
fn beside_experiments(paper: &Paper) -> Vec<Node<'_>> {
    let mut nodes = graph::of_paper(paper, compare::Scale::Full);
    nodes.extend(graph::attacks(&paper.name, attack::Size::Times(1)));
    nodes
}

/// What would run of a paper apart from its experiments.
pub fn plan_paper(store: &Store, paper: &Paper) -> Vec<Planned> {
    let mut done = Done::default();
    for experiment in &paper.experiments {
        look(store, &graph::of_experiment(experiment), &mut done);
    }
    look(store, &beside_experiments(paper), &mut done)
}

/// What a paper has beside its experiments, as nodes and edges of a Graphviz graph.
pub fn dot_paper(paper: &Paper, planned: &[Planned]) -> String {
    drawn("  ", planned, |stage, target| {
        format!("{stage} of {}", target.paper)
    }) + &edges("  ", &beside_experiments(paper))
}

/// Attacks on an experiment's own problem, as nodes of a Graphviz graph.
pub fn dot_own(planned: &[Planned]) -> String {
    drawn("  ", planned, |stage, target| {
        format!("{stage} of {}/{}", target.paper, target.experiment)
    })
}

/// The stages of an experiment as a cluster of a Graphviz graph; what would run is drawn bold.
pub fn dot(experiment: &Experiment, planned: &[Planned]) -> String {
    let name = experiment.name();
    let nodes = drawn("    ", planned, |stage, target| match &target.estimator {
        Some(estimator) => format!("{stage}\\n{estimator}"),
        None => stage.to_owned(),
    });
    let edges = edges("    ", &graph::of_experiment(experiment));
    format!("  subgraph \"cluster_{name}\" {{\n    label = \"{name}\";\n{nodes}{edges}  }}\n")
}

fn drawn(indent: &str, planned: &[Planned], label: impl Fn(&str, &Target) -> String) -> String {
    let node = |p: &Planned| {
        let (target, label) = (&p.target, label(p.target.stage, &p.target));
        let style = match p.status {
            Status::Cached => "solid",
            _ => "bold",
        };
        format!("{indent}\"{target}\" [label = \"{label}\", shape = box, style = {style}];\n")
    };
    planned.iter().map(node).collect()
}

/// An edge from what is needed to what needs it; one that follows from others is left out.
fn edges(indent: &str, nodes: &[Node]) -> String {
    let mut out = String::new();
    for node in nodes {
        let implied: BTreeSet<Target> = (node.needs().iter())
            .flat_map(Node::needs)
            .map(|need| need.target())
            .collect();
        let needs = node.needs().into_iter().map(|need| need.target());
        for need in needs.filter(|need| !implied.contains(need)) {
            out += &format!("{indent}\"{need}\" -> \"{}\";\n", node.target());
        }
    }
    out
}
