//! The graph: every result that a stage makes, what it needs, what it is made from and how, and what the lake holds of it.
//!
//! It is stated here once. To run, to plan and to draw are walks over it (`engine`).

use crate::code;
use crate::progress::Progress;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use zonobench_attack::Own;
use zonobench_evidence::{attack, claims, count};
use zonobench_lab::stage::estimate::Job;
use zonobench_lab::stage::{Experiment, Recordings, estimate, reduce, simulate, trace};
use zonobench_lake::error::Error;
use zonobench_lake::store::{Artifact, Target};
use zonobench_lake::table;
use zonobench_verdicts::papers::Paper;
use zonobench_verdicts::{compare, score};

/// A result of a stage.
#[derive(Clone, Copy)]
pub enum Node<'a> {
    /// The drawn truth and measurements of an experiment.
    Simulate(&'a Experiment),
    /// What one of its estimators makes of them.
    Estimate(&'a Experiment, usize),
    /// That, to be looked at.
    Trace(&'a Experiment, usize),
    /// The metrics of every run.
    Reduce(&'a Experiment),
    /// The metrics over the runs.
    Score(&'a Experiment),
    /// A paper's numbered claims, tried.
    Claims(&'a str),
    /// Its claims about cost, counted.
    Count(&'a str),
    /// Its printed numbers, claims and costs beside ours.
    Compare(&'a Paper, compare::Scale),
    /// The attacks on what it calls guaranteed, on one family of problems.
    Attack(&'a str, &'static str, attack::Size),
    /// The attacks on the guaranteed estimators of an experiment, on its own problem.
    AttackOwn(&'a Experiment, &'a [Own], attack::Size),
}

/// The results of an experiment, each after what it needs.
pub fn of_experiment(experiment: &Experiment) -> Vec<Node<'_>> {
    let estimators = 0..experiment.estimators.len();
    let mut nodes = vec![Node::Simulate(experiment)];
    nodes.extend(estimators.clone().map(|i| Node::Estimate(experiment, i)));
    if experiment.output.traces {
        nodes.extend(estimators.map(|i| Node::Trace(experiment, i)));
    }
    nodes.extend([Node::Reduce(experiment), Node::Score(experiment)]);
    nodes
}

/// What a paper has beside its experiments and attacks, each after what it needs.
pub fn of_paper(paper: &Paper, scale: compare::Scale) -> Vec<Node<'_>> {
    let mut nodes = vec![Node::Claims(&paper.name)];
    nodes.extend(counted(&paper.name));
    nodes.push(Node::Compare(paper, scale));
    nodes
}

/// The counts of a paper, if it has claims about cost.
pub fn counted(paper: &str) -> Option<Node<'_>> {
    count::input(paper).map(|_| Node::Count(paper))
}

/// The attacks on a paper's methods.
pub fn attacks(paper: &str, size: attack::Size) -> Vec<Node<'_>> {
    let systems = attack::systems(paper).into_iter();
    systems
        .map(|system| Node::Attack(paper, system, size))
        .collect()
}

/// Results that there are, by what they are of.
#[derive(Default)]
pub struct Done(BTreeMap<Target, Artifact>);

impl Done {
    /// Adds a result.
    pub fn add(&mut self, node: &Node, artifact: Artifact) {
        self.0.insert(node.target(), artifact);
    }

    /// The result of a node, if it is there.
    pub fn get(&self, node: &Node) -> Option<&Artifact> {
        self.0.get(&node.target())
    }

    /// The hash of its content.
    fn content(&self, node: Node) -> Option<&str> {
        self.get(&node).map(|artifact| artifact.content.as_str())
    }

    /// The result of a node that another one needs.
    fn needed(&self, node: Node) -> &Artifact {
        self.get(&node)
            .expect("what a node needs is made before it")
    }
}

/// What the results of one experiment are made with.
#[derive(Default)]
pub struct Work<'a> {
    /// Where it is told how far the work is
    pub progress: Option<&'a Progress>,
    recordings: OnceLock<Recordings>,
}

impl<'a> Work<'a> {
    /// Work that is told of.
    pub fn told(progress: &'a Progress) -> Self {
        Self {
            progress: Some(progress),
            recordings: OnceLock::new(),
        }
    }

    /// What was simulated, read when it is first asked for.
    fn recordings(&self, of: &Experiment, done: &Done) -> Result<&Recordings, Error> {
        if let Some(read) = self.recordings.get() {
            return Ok(read);
        }
        let read = Recordings::read(&of.problem, done.needed(Node::Simulate(of)))?;
        Ok(self.recordings.get_or_init(|| read))
    }
}

impl<'a> Node<'a> {
    /// The results that it is made from.
    pub fn needs(&self) -> Vec<Node<'a>> {
        match *self {
            Node::Simulate(_) | Node::Claims(_) | Node::Count(_) => Vec::new(),
            Node::Attack(..) | Node::AttackOwn(..) => Vec::new(),
            Node::Estimate(e, _) => vec![Node::Simulate(e)],
            Node::Trace(e, i) => vec![Node::Simulate(e), Node::Estimate(e, i)],
            Node::Reduce(e) => {
                let estimates = (0..e.estimators.len()).map(|i| Node::Estimate(e, i));
                [Node::Simulate(e)].into_iter().chain(estimates).collect()
            }
            Node::Score(e) => vec![Node::Reduce(e)],
            Node::Compare(paper, _) => {
                let mut needs: Vec<Node> = (paper.experiments.iter())
                    .map(|e| Node::Reduce(e))
                    .collect();
                needs.push(Node::Claims(&paper.name));
                needs.extend(counted(&paper.name));
                needs
            }
        }
    }

    /// The stage that makes it.
    pub fn stage(&self) -> &'static str {
        match self {
            Node::Simulate(_) => "simulate",
            Node::Estimate(..) => "estimate",
            Node::Trace(..) => "trace",
            Node::Reduce(_) => "reduce",
            Node::Score(_) => "score",
            Node::Claims(_) => "claims",
            Node::Count(_) => "count",
            Node::Compare(..) => "compare",
            Node::Attack(..) | Node::AttackOwn(..) => "attack",
        }
    }

    /// What it is of.
    pub fn target(&self) -> Target {
        let (paper, experiment, estimator) = match *self {
            Node::Simulate(e) | Node::Reduce(e) | Node::Score(e) | Node::AttackOwn(e, ..) => {
                (&*e.paper, &*e.id, None)
            }
            Node::Estimate(e, i) | Node::Trace(e, i) => {
                (&*e.paper, &*e.id, Some(e.estimators[i].id.clone()))
            }
            Node::Claims(paper) | Node::Count(paper) => (paper, "-", None),
            Node::Compare(paper, _) => (&*paper.name, "-", None),
            Node::Attack(paper, system, _) => (paper, system, None),
        };
        Target {
            paper: paper.to_owned(),
            experiment: experiment.to_owned(),
            stage: self.stage(),
            estimator,
        }
    }

    /// The hash of the code that makes it.
    pub fn code(&self) -> &'static str {
        code::of(match self {
            Node::Simulate(_) | Node::Estimate(..) | Node::Trace(..) | Node::Reduce(_) => {
                zonobench_lab::stage::CRATE
            }
            Node::Score(_) | Node::Compare(..) => zonobench_verdicts::CRATE,
            Node::Claims(_) | Node::Count(_) | Node::Attack(..) | Node::AttackOwn(..) => {
                zonobench_evidence::CRATE
            }
        })
    }

    /// All that the result depends on beside the code; None where something that it needs is not there yet.
    pub fn input(&self, done: &Done) -> Option<Value> {
        Some(match *self {
            Node::Simulate(e) => simulate::input(e),
            Node::Estimate(e, i) => estimate::input(e, i, done.content(Node::Simulate(e))?),
            Node::Trace(e, i) => trace::input(
                e,
                i,
                done.content(Node::Simulate(e))?,
                done.content(Node::Estimate(e, i))?,
            ),
            Node::Reduce(e) => {
                let estimates = (0..e.estimators.len())
                    .map(|i| done.content(Node::Estimate(e, i)).map(str::to_owned));
                let estimates = estimates.collect::<Option<Vec<String>>>()?;
                reduce::input(e, done.content(Node::Simulate(e))?, &estimates)
            }
            Node::Score(e) => score::input(done.content(Node::Reduce(e))?),
            Node::Claims(paper) => claims::input(paper),
            Node::Count(paper) => count::input(paper)?,
            Node::Compare(paper, scale) => {
                let metrics = paper.experiments.iter();
                let metrics = metrics.map(|e| Some((&*e.id, done.content(Node::Reduce(e))?)));
                let metrics = metrics.collect::<Option<BTreeMap<&str, &str>>>()?;
                let counts = counted(&paper.name).map(|node| done.content(node));
                let claims = done.content(Node::Claims(&paper.name))?;
                compare::input(paper, &metrics, claims, counts.flatten(), scale)
            }
            Node::Attack(paper, system, size) => attack::input(paper, system, size),
            Node::AttackOwn(_, owns, size) => attack::own_input(owns, size),
        })
    }

    /// Makes it in `dir`.
    pub fn make(&self, done: &Done, work: &Work, dir: &Path) -> Result<(), Error> {
        let advance = |n: u64| {
            if let (Some(progress), Some((name, what, _))) = (work.progress, self.told()) {
                progress.advance(&name, &what, n);
            }
        };
        match *self {
            Node::Simulate(e) => simulate::make(e, dir, &advance),
            Node::Estimate(e, i) => {
                let recordings = work.recordings(e, done)?;
                estimate::make(&Job::of(e, i), recordings, dir, &advance).map(drop)
            }
            Node::Trace(e, i) => {
                let estimates = done.needed(Node::Estimate(e, i));
                trace::make(e, i, work.recordings(e, done)?, estimates, dir)
            }
            Node::Reduce(e) => {
                let estimates: Vec<Artifact> = (0..e.estimators.len())
                    .map(|i| done.needed(Node::Estimate(e, i)).clone())
                    .collect();
                reduce::make(e, work.recordings(e, done)?, &estimates, dir)
            }
            Node::Score(e) => {
                let metrics = done.needed(Node::Reduce(e));
                score::make(&file(metrics, "metrics.parquet")?, dir)
            }
            Node::Claims(paper) => claims::make(paper, dir),
            Node::Count(paper) => count::make(paper, dir),
            Node::Compare(paper, scale) => {
                let metrics = paper.experiments.iter().map(|e| {
                    let metrics = done.needed(Node::Reduce(e));
                    Ok((&*e.id, file(metrics, "metrics.parquet")?))
                });
                let metrics = metrics.collect::<Result<BTreeMap<&str, PathBuf>, Error>>()?;
                let claimed = done.needed(Node::Claims(&paper.name));
                let ledgers = compare::Ledgers {
                    claims: table::read(&file(claimed, claims::FILE)?)?,
                    complexity: match counted(&paper.name) {
                        Some(node) => table::read(&file(done.needed(node), count::FILE)?)?,
                        None => Vec::new(),
                    },
                };
                compare::make(paper, &metrics, ledgers, scale, dir)
            }
            Node::Attack(paper, system, size) => attack::make(paper, system, size, dir, &advance),
            Node::AttackOwn(_, owns, size) => attack::make_own(owns, size, dir, &advance),
        }
    }

    /// What is told of the work on it: of what, at what, and how much there is; None for what is soon done.
    pub fn told(&self) -> Option<(String, String, u64)> {
        match *self {
            Node::Simulate(e) => Some((e.name(), "simulate".to_owned(), e.runs as u64)),
            Node::Estimate(e, i) => {
                let what = format!("estimate {}", e.estimators[i].id);
                Some((e.name(), what, e.runs as u64))
            }
            Node::Attack(paper, system, size) => {
                let units = attack::units(paper, system, size);
                Some((format!("{paper}/{system}"), "attack".to_owned(), units))
            }
            Node::AttackOwn(e, owns, size) => {
                let units = attack::own_units(owns, size);
                Some((e.name(), "attack".to_owned(), units))
            }
            _ => None,
        }
    }

    /// The tables of the lake that are files of it: (table, file).
    pub fn publishes(&self) -> &'static [(&'static str, &'static str)] {
        match self {
            Node::Simulate(_) => &[
                ("truth", "truth.parquet"),
                ("measurements", "measurements.parquet"),
                ("inputs", "inputs.parquet"),
            ],
            // Those of all estimators are one file.
            Node::Estimate(..) => &[],
            Node::Trace(..) => &[("trace", "trace.mcap")],
            Node::Reduce(_) => &[("metrics", "metrics.parquet")],
            Node::Score(_) => &[("scores", "scores.parquet")],
            Node::Claims(_) => &[("claims", claims::FILE)],
            Node::Count(_) => &[("complexity", count::FILE)],
            Node::Compare(..) => &[
                ("published", "published.parquet"),
                ("comparison", "comparison.parquet"),
            ],
            Node::Attack(..) | Node::AttackOwn(..) => &[("attack", attack::FILE)],
        }
    }
}

/// A file of a result.
pub fn file(artifact: &Artifact, name: &str) -> Result<PathBuf, Error> {
    artifact.path(name).ok_or_else(|| Error::Unknown {
        what: "file of a stage result",
        got: name.to_owned(),
        expected: "what the stage writes".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use zonobench_verdicts::papers;

    /// Every node of every paper, in order.
    fn with_all(check: impl Fn(&[Node])) {
        for paper in papers::load(&[]).unwrap() {
            let mut nodes: Vec<Node> = Vec::new();
            for e in &paper.experiments {
                nodes.extend(of_experiment(e));
            }
            nodes.extend(of_paper(&paper, compare::Scale::Full));
            nodes.extend(attacks(&paper.name, attack::Size::Times(1)));
            check(&nodes);
        }
    }

    #[test]
    fn what_a_node_needs_stands_before_it_and_no_target_stands_twice() {
        with_all(|nodes| {
            let mut before = BTreeSet::new();
            for node in nodes {
                assert!(
                    node.needs()
                        .iter()
                        .all(|need| before.contains(&need.target()))
                );
                assert!(before.insert(node.target()), "{}", node.target());
            }
        });
    }

    #[test]
    fn a_node_has_an_input_as_soon_as_it_needs_nothing_and_not_before() {
        with_all(|nodes| {
            for node in nodes {
                let ready = node.needs().is_empty();
                assert_eq!(
                    node.input(&Done::default()).is_some(),
                    ready,
                    "{}",
                    node.target()
                );
            }
        });
    }
}
