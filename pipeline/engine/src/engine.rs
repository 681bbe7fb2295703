//! The DAG: which stage results an experiment needs, in which order, and what is published of them.
//!
//! Experiments, estimators and runs are spread over the threads; results are put in order by index, so
//! that neither the number of threads nor their timing leaves a trace in a hashed file.

use crate::code;
use crate::parts;
use crate::progress::Progress;
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zonobench_attack::Own;
use zonobench_estimation::simulate::simulate as simulated;
use zonobench_estimation::{AnyEstimator, Estimator as _};
use zonobench_evidence::{attack, claims, count};
use zonobench_lab::experiment::EstimatorSpec;
use zonobench_lab::stage::ending::{self, Ending};
use zonobench_lab::stage::estimate::Job;
use zonobench_lab::stage::{Experiment, Recordings, estimate, reduce, simulate, trace};
use zonobench_lake::error::Error;
use zonobench_lake::lake::{self, Publication, paper_table_path, table_path, trace_path};
use zonobench_lake::rows;
use zonobench_lake::store::{Artifact, Status, Store, Target};
use zonobench_lake::table;
use zonobench_verdicts::papers::Paper;
use zonobench_verdicts::{compare, score};

/// An experiment with all its results.
pub struct Finished {
    /// The experiment.
    pub experiment: Arc<Experiment>,
    simulation: Artifact,
    estimates: Vec<Artifact>,
    /// The runs that an estimator ended without a belief, for a reason that is no result.
    pub failures: Vec<Ending>,
    traces: Vec<(String, Artifact)>,
    metrics: Artifact,
    scores: Artifact,
    /// Results made now.
    pub made: usize,
    /// Results found in the store.
    pub found: usize,
}

fn target(experiment: &Experiment, stage: &'static str, estimator: Option<usize>) -> Target {
    Target {
        paper: experiment.paper.clone(),
        experiment: experiment.id.clone(),
        stage,
        estimator: estimator.map(|i| experiment.estimators[i].id.clone()),
    }
}

/// Runs (or finds) every stage of `experiment`.
pub fn run(
    store: &Store,
    experiment: &Arc<Experiment>,
    progress: &Progress,
) -> Result<Finished, Error> {
    let count =
        |made: bool, tally: &mut (usize, usize)| if made { tally.0 += 1 } else { tally.1 += 1 };
    let mut tally = (0, 0);
    let name = experiment.name();
    let (simulation, made) = store.run(
        &target(experiment, "simulate", None),
        code::of(zonobench_lab::stage::CRATE),
        &simulate::input(experiment),
        |dir| simulate::make(experiment, dir, &|n| progress.advance(&name, "simulate", n)),
    )?;
    if !made {
        progress.advance(&name, "simulate", experiment.runs as u64);
    }
    count(made, &mut tally);
    let recordings = std::sync::OnceLock::new();
    let recordings = || -> Result<&Recordings, Error> {
        if let Some(r) = recordings.get() {
            return Ok(r);
        }
        let read = Recordings::read(&experiment.problem, &simulation)?;
        Ok(recordings.get_or_init(|| read))
    };
    let estimates: Vec<(Artifact, bool)> = (0..experiment.estimators.len())
        .into_par_iter()
        .map(|i| {
            let input = estimate::input(experiment, i, &simulation.content);
            let what = format!("estimate {}", experiment.estimators[i].id);
            let result = store.run(
                &target(experiment, "estimate", Some(i)),
                code::of(zonobench_lab::stage::CRATE),
                &input,
                |dir| {
                    estimate::make(&Job::of(experiment, i), recordings()?, dir, &|n| {
                        progress.advance(&name, &what, n)
                    })
                    .map(drop)
                },
            )?;
            if !result.1 {
                progress.advance(&name, &what, experiment.runs as u64);
            }
            Ok(result)
        })
        .collect::<Result<_, Error>>()?;
    estimates
        .iter()
        .for_each(|(_, made)| count(*made, &mut tally));
    let estimates: Vec<Artifact> = estimates
        .into_iter()
        .map(|(artifact, _)| artifact)
        .collect();
    let mut failures = Vec::new();
    for path in estimates.iter().filter_map(|a| a.path(ending::FILE)) {
        failures.extend(ending::read(&path)?);
    }
    let mut traces = Vec::new();
    if experiment.output.traces {
        for (i, estimates) in estimates.iter().enumerate() {
            let input = trace::input(experiment, i, &simulation.content, &estimates.content);
            let (artifact, made) = store.run(
                &target(experiment, "trace", Some(i)),
                code::of(zonobench_lab::stage::CRATE),
                &input,
                |dir| trace::make(experiment, i, recordings()?, estimates, dir),
            )?;
            count(made, &mut tally);
            traces.push((experiment.estimators[i].id.clone(), artifact));
        }
    }
    let contents: Vec<String> = estimates.iter().map(|a| a.content.clone()).collect();
    let input = reduce::input(experiment, &simulation.content, &contents);
    let (metrics, made) = store.run(
        &target(experiment, "reduce", None),
        code::of(zonobench_lab::stage::CRATE),
        &input,
        |dir| reduce::make(experiment, recordings()?, &estimates, dir),
    )?;
    count(made, &mut tally);
    let input = score::input(&metrics.content);
    let (scores, made) = store.run(
        &target(experiment, "score", None),
        code::of(zonobench_verdicts::CRATE),
        &input,
        |dir| score::make(&file(&metrics, "metrics.parquet")?, dir),
    )?;
    count(made, &mut tally);
    progress.finish(&name, tally.0, tally.1);
    Ok(Finished {
        experiment: experiment.clone(),
        simulation,
        estimates,
        failures,
        traces,
        metrics,
        scores,
        made: tally.0,
        found: tally.1,
    })
}

fn file(artifact: &Artifact, name: &str) -> Result<PathBuf, Error> {
    artifact.path(name).ok_or_else(|| Error::Unknown {
        what: "file of a stage result",
        got: name.to_owned(),
        expected: "what the stage writes".to_owned(),
    })
}

/// The metrics of every experiment of a paper, by experiment id.
fn metrics_of<'a>(
    finished: &'a [Finished],
    paper: &str,
) -> Result<BTreeMap<&'a str, PathBuf>, Error> {
    finished
        .iter()
        .filter(|f| f.experiment.paper == paper)
        .map(|f| {
            Ok((
                f.experiment.id.as_str(),
                file(&f.metrics, "metrics.parquet")?,
            ))
        })
        .collect()
}

/// A result that belongs to a paper and to none of its experiments.
fn paper_target(paper: &str, stage: &'static str) -> Target {
    Target {
        paper: paper.to_owned(),
        experiment: "-".to_owned(),
        stage,
        estimator: None,
    }
}

/// Tries (or finds) a paper's numbered claims.
fn claims(store: &Store, paper: &str) -> Result<Artifact, Error> {
    let target = paper_target(paper, "claims");
    let (artifact, _) = store.run(
        &target,
        code::of(zonobench_evidence::CRATE),
        &claims::input(paper),
        |dir| claims::make(paper, dir),
    )?;
    Ok(artifact)
}

/// Runs (or finds) the counts of a paper's claims about cost, if it has any.
pub fn count(store: &Store, paper: &str) -> Result<Option<Artifact>, Error> {
    let Some(input) = count::input(paper) else {
        return Ok(None);
    };
    let target = paper_target(paper, "count");
    let (artifact, _) = store.run(
        &target,
        code::of(zonobench_evidence::CRATE),
        &input,
        |dir| count::make(paper, dir),
    )?;
    Ok(Some(artifact))
}

/// The rows of [`count()`].
pub fn counted(store: &Store, paper: &str) -> Result<Vec<rows::Complexity>, Error> {
    match count(store, paper)? {
        Some(artifact) => table::read(&file(&artifact, count::FILE)?),
        None => Ok(Vec::new()),
    }
}

fn attack_target(paper: &str, system: &str) -> Target {
    Target {
        paper: paper.to_owned(),
        experiment: system.to_owned(),
        stage: "attack",
        estimator: None,
    }
}

/// Attacks (or finds attacked) what of a paper is called guaranteed, on every family of problems; publishes the counts.
pub fn attack(
    store: &Store,
    paper: &str,
    size: attack::Size,
    progress: &Progress,
) -> Result<Vec<Publication<'static>>, Error> {
    let one = |system: &'static str| {
        let target = attack_target(paper, system);
        let input = attack::input(paper, system, size);
        let name = format!("{paper}/{system}");
        let (artifact, made) = store.run(
            &target,
            code::of(zonobench_evidence::CRATE),
            &input,
            |dir| {
                attack::make(paper, system, size, dir, &|n| {
                    progress.advance(&name, "attack", n)
                })
            },
        )?;
        if !made {
            progress.advance(&name, "attack", attack::units(paper, system, size));
        }
        let path = table_path("attack", paper, system);
        copy(path, "attack", &artifact, attack::FILE)
    };
    attack::systems(paper).into_iter().map(one).collect()
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
        let made = AnyEstimator::new(&spec.settings, &spec.problem);
        let is_guaranteed = made.is_ok_and(|estimator| estimator.guaranteed());
        is_guaranteed.then(|| Own {
            system: e.name(),
            estimator: spec.id.clone(),
            settings: spec.settings.clone(),
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
    let (target, name) = (target(experiment, "attack", None), experiment.name());
    let (artifact, made) = store.run(
        &target,
        code::of(zonobench_evidence::CRATE),
        &attack::own_input(&owns, size),
        |dir| attack::make_own(&owns, size, dir, &|n| progress.advance(&name, "attack", n)),
    )?;
    if !made {
        progress.advance(&name, "attack", attack::own_units(&owns, size));
    }
    let path = table_path("attack", &experiment.paper, &experiment.id);
    copy(path, "attack", &artifact, attack::FILE)
}

/// Whether [`attack_own`] would run.
pub fn plan_own(store: &Store, experiment: &Experiment) -> Result<Planned, Error> {
    let target = target(experiment, "attack", None);
    let input = attack::own_input(&owns(experiment)?, attack::Size::Times(1));
    let status = store.status(&target, code::of(zonobench_evidence::CRATE), &input);
    Ok(Planned { target, status })
}

/// What would run of a paper apart from its experiments.
pub fn plan_paper(store: &Store, paper: &Paper) -> Vec<Planned> {
    let look = |stage, code: &str, input: &Value| {
        let target = paper_target(&paper.name, stage);
        let status = store.status(&target, code, input);
        Planned { target, status }
    };
    let mut planned = vec![look(
        "claims",
        code::of(zonobench_evidence::CRATE),
        &claims::input(&paper.name),
    )];
    if let Some(input) = count::input(&paper.name) {
        planned.push(look("count", code::of(zonobench_evidence::CRATE), &input));
    }
    planned.extend(attack::systems(&paper.name).into_iter().map(|system| {
        let target = attack_target(&paper.name, system);
        let input = attack::input(&paper.name, system, attack::Size::Times(1));
        let status = store.status(&target, code::of(zonobench_evidence::CRATE), &input);
        Planned { target, status }
    }));
    planned
}

/// What a paper's results are beside its experiments.
pub struct Compared {
    comparison: Artifact,
    claims: Artifact,
    complexity: Option<Artifact>,
}

/// Runs (or finds) a paper's claims and counts, and the comparison of its printed numbers with them and with
/// the results.
pub fn compare(
    store: &Store,
    paper: &Paper,
    finished: &[Finished],
    scale: compare::Scale,
) -> Result<Compared, Error> {
    let contents: BTreeMap<&str, &str> = finished
        .iter()
        .filter(|f| f.experiment.paper == paper.name)
        .map(|f| (f.experiment.id.as_str(), f.metrics.content.as_str()))
        .collect();
    let target = paper_target(&paper.name, "compare");
    let claims = claims(store, &paper.name)?;
    let complexity = count(store, &paper.name)?;
    let counts = complexity.as_ref().map(|a| a.content.as_str());
    let input = compare::input(paper, &contents, &claims.content, counts, scale);
    let metrics = metrics_of(finished, &paper.name)?;
    let (comparison, _) = store.run(
        &target,
        code::of(zonobench_verdicts::CRATE),
        &input,
        |dir| {
            let ledgers = compare::Ledgers {
                claims: table::read(&file(&claims, claims::FILE)?)?,
                complexity: match &complexity {
                    Some(artifact) => table::read(&file(artifact, count::FILE)?)?,
                    None => Vec::new(),
                },
            };
            compare::make(paper, &metrics, ledgers, scale, dir)
        },
    )?;
    Ok(Compared {
        comparison,
        claims,
        complexity,
    })
}

fn copy(
    path: String,
    table: &'static str,
    artifact: &Artifact,
    name: &str,
) -> Result<Publication<'static>, Error> {
    let source = file(artifact, name)?;
    Ok(Publication {
        path,
        table,
        key: format!("{}/{name}", artifact.content),
        make: Box::new(move |target| {
            std::fs::copy(&source, target).map_err(|e| Error::io("copy", &source, e))?;
            if table == "trace" {
                Ok(None)
            } else {
                lake::count_rows(target).map(Some)
            }
        }),
    })
}

fn concatenated<R: table::Row>(
    experiment: &Experiment,
    parts: &[Artifact],
    name: &str,
) -> Result<Publication<'static>, Error> {
    let paths: Vec<PathBuf> = parts
        .iter()
        .map(|a| file(a, name))
        .collect::<Result<_, _>>()?;
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(part.content.as_bytes());
    }
    hasher.update(name.as_bytes());
    let meta = table::metadata("estimate", Some(experiment.seed));
    Ok(Publication {
        path: table_path(R::TABLE, &experiment.paper, &experiment.id),
        table: R::TABLE,
        key: hasher.finalize().to_hex().to_string(),
        make: Box::new(move |target| {
            Ok(Some(table::concatenate::<R>(target, &paths, &meta)? as u64))
        }),
    })
}

fn written<R>(path: String, stage: &str, rows: Vec<R>) -> Publication<'static>
where
    R: table::Row + Clone + Sync + std::fmt::Debug + 'static,
{
    let meta = table::metadata(stage, None);
    Publication {
        path,
        table: R::TABLE,
        // The rows themselves are the source.
        key: blake3::hash(format!("{rows:?}").as_bytes())
            .to_hex()
            .to_string(),
        make: Box::new(move |target| {
            Ok(Some(
                table::write(target, rows.iter().cloned(), &meta)? as u64
            ))
        }),
    }
}

/// The files of the lake that come from one experiment.
pub fn publications(finished: &Finished) -> Result<Vec<Publication<'static>>, Error> {
    let e = &finished.experiment;
    let path = |table: &str| table_path(table, &e.paper, &e.id);
    let infos = (0..e.estimators.len())
        .map(|i| estimate::describe(&Job::of(e, i)))
        .collect::<Result<Vec<_>, _>>()?;
    let mut files = vec![
        written(
            path("variables"),
            "simulate",
            estimate::variables(&e.problem),
        ),
        copy(
            path("truth"),
            "truth",
            &finished.simulation,
            "truth.parquet",
        )?,
        copy(
            path("measurements"),
            "measurements",
            &finished.simulation,
            "measurements.parquet",
        )?,
        copy(
            path("inputs"),
            "inputs",
            &finished.simulation,
            "inputs.parquet",
        )?,
        written(path("estimators"), "estimate", infos),
        concatenated::<rows::Estimate>(e, &finished.estimates, "estimates.parquet")?,
        concatenated::<rows::Belief>(e, &finished.estimates, "beliefs.parquet")?,
        concatenated::<rows::Set>(e, &finished.estimates, "sets.parquet")?,
        copy(
            path("metrics"),
            "metrics",
            &finished.metrics,
            "metrics.parquet",
        )?,
        copy(path("scores"), "scores", &finished.scores, "scores.parquet")?,
    ];
    for (estimator, artifact) in &finished.traces {
        files.push(copy(
            trace_path(&e.paper, &e.id, estimator),
            "trace",
            artifact,
            "trace.mcap",
        )?);
    }
    Ok(files)
}

/// The files of the lake that come from a paper's claims and its comparison.
pub fn paper_publications(
    paper: &Paper,
    compared: &Compared,
) -> Result<Vec<Publication<'static>>, Error> {
    let path = |table: &str| paper_table_path(table, &paper.name);
    let comparison = &compared.comparison;
    let mut files = vec![
        copy(
            path("published"),
            "published",
            comparison,
            "published.parquet",
        )?,
        copy(
            path("comparison"),
            "comparison",
            comparison,
            "comparison.parquet",
        )?,
        copy(path("claims"), "claims", &compared.claims, claims::FILE)?,
    ];
    if let Some(counts) = &compared.complexity {
        files.push(copy(path("complexity"), "complexity", counts, count::FILE)?);
    }
    Ok(files)
}

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

/// One line of a plan.
pub struct Planned {
    /// What.
    pub target: Target,
    /// Whether it would run, and why.
    pub status: Status,
}

/// What would run for `experiment`, without running or hashing anything.
pub fn plan(store: &Store, experiment: &Experiment) -> Vec<Planned> {
    let mut out = Vec::new();
    let mut look = |stage, index, code: &str, input: Option<Value>| -> Option<Artifact> {
        let target = target(experiment, stage, index);
        let Some(input) = input else {
            out.push(Planned {
                target,
                status: Status::Upstream,
            });
            return None;
        };
        let status = store.status(&target, code, &input);
        out.push(Planned { target, status });
        store.peek(stage, code, &input)
    };
    let simulation = look(
        "simulate",
        None,
        code::of(zonobench_lab::stage::CRATE),
        Some(simulate::input(experiment)),
    );
    let data = simulation.map(|a| a.content);
    let mut contents = Some(Vec::new());
    for i in 0..experiment.estimators.len() {
        let input = data.as_ref().map(|d| estimate::input(experiment, i, d));
        let estimates = look(
            "estimate",
            Some(i),
            code::of(zonobench_lab::stage::CRATE),
            input,
        )
        .map(|a| a.content);
        if experiment.output.traces {
            let input = data
                .as_ref()
                .zip(estimates.as_ref())
                .map(|(d, e)| trace::input(experiment, i, d, e));
            look(
                "trace",
                Some(i),
                code::of(zonobench_lab::stage::CRATE),
                input,
            );
        }
        contents = contents.zip(estimates).map(|(mut all, one)| {
            all.push(one);
            all
        });
    }
    let input = data
        .zip(contents)
        .map(|(d, c)| reduce::input(experiment, &d, &c));
    let metrics = look("reduce", None, code::of(zonobench_lab::stage::CRATE), input);
    look(
        "score",
        None,
        code::of(zonobench_verdicts::CRATE),
        metrics.map(|a| score::input(&a.content)),
    );
    out
}

/// What a paper has beside its experiments, as nodes of a Graphviz graph.
pub fn dot_paper(planned: &[Planned]) -> String {
    let node = |p: &Planned| {
        let style = if p.status == Status::Cached {
            "solid"
        } else {
            "bold"
        };
        let (target, stage, paper) = (&p.target, p.target.stage, &p.target.paper);
        format!("  \"{target}\" [label = \"{stage} of {paper}\", shape = box, style = {style}];\n")
    };
    planned.iter().map(node).collect()
}

/// The stages of an experiment as a cluster of a Graphviz graph; what would run is drawn bold.
pub fn dot(experiment: &Experiment, planned: &[Planned]) -> String {
    let name = experiment.name();
    let mut out = format!("  subgraph \"cluster_{name}\" {{\n    label = \"{name}\";\n");
    for p in planned {
        let label = match &p.target.estimator {
            Some(estimator) => format!("{}\\n{estimator}", p.target.stage),
            None => p.target.stage.to_owned(),
        };
        let style = if p.status == Status::Cached {
            "solid"
        } else {
            "bold"
        };
        out += &format!(
            "    \"{}\" [label = \"{label}\", shape = box, style = {style}];\n",
            p.target
        );
    }
    for e in &experiment.estimators {
        out += &format!(
            "    \"{name}/simulate\" -> \"{name}/estimate/{}\" -> \"{name}/reduce\";\n",
            e.id
        );
        if experiment.output.traces {
            out += &format!(
                "    \"{name}/estimate/{0}\" -> \"{name}/trace/{0}\";\n",
                e.id
            );
        }
    }
    out += &format!("    \"{name}/reduce\" -> \"{name}/score\";\n  }}\n");
    out
}
