//! What of the results the lake holds: its files, and how each is made of stage results.

use crate::engine::{Compared, Finished};
use crate::graph::{Node, file};
use std::path::PathBuf;
use zonobench_lab::stage::Experiment;
use zonobench_lab::stage::estimate::{self, Job};
use zonobench_lake::error::Error;
use zonobench_lake::lake::{self, Publication, paper_table_path, table_path, trace_path};
use zonobench_lake::rows;
use zonobench_lake::store::Artifact;
use zonobench_lake::table;

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

/// Where a table of a node lies in the lake.
fn path(node: &Node, table: &str) -> String {
    match node {
        Node::Trace(e, i) => trace_path(&e.paper, &e.id, &e.estimators[*i].id),
        Node::Claims(paper) | Node::Count(paper) => paper_table_path(table, paper),
        Node::Compare(paper, _) => paper_table_path(table, &paper.name),
        Node::Attack(paper, system, _) => table_path(table, paper, system),
        Node::Simulate(e)
        | Node::Estimate(e, _)
        | Node::Reduce(e)
        | Node::Score(e)
        | Node::AttackOwn(e, ..) => table_path(table, &e.paper, &e.id),
    }
}

/// The files of the lake that are files of a node's result.
pub fn of_node(node: &Node, artifact: &Artifact) -> Result<Vec<Publication<'static>>, Error> {
    let copied = node.publishes().iter();
    let copied = copied.map(|(table, name)| copy(path(node, table), table, artifact, name));
    copied.collect()
}

/// The files of the lake that come from one experiment.
pub fn publications(finished: &Finished) -> Result<Vec<Publication<'static>>, Error> {
    let e = &finished.experiment;
    let path = |table: &str| table_path(table, &e.paper, &e.id);
    let infos = (0..e.estimators.len()).map(|i| estimate::describe(&Job::of(e, i)));
    let infos = infos.collect::<Result<Vec<_>, _>>()?;
    let estimates = &finished.estimates;
    let variables = estimate::variables(&e.problem);
    let mut files = vec![written(path("variables"), "simulate", variables)];
    files.extend(of_node(&Node::Simulate(e), &finished.simulation)?);
    files.extend([
        written(path("estimators"), "estimate", infos),
        concatenated::<rows::Estimate>(e, estimates, "estimates.parquet")?,
        concatenated::<rows::Belief>(e, estimates, "beliefs.parquet")?,
        concatenated::<rows::Set>(e, estimates, "sets.parquet")?,
    ]);
    files.extend(of_node(&Node::Reduce(e), &finished.metrics)?);
    files.extend(of_node(&Node::Score(e), &finished.scores)?);
    for (i, artifact) in finished.traces.iter().enumerate() {
        files.extend(of_node(&Node::Trace(e, i), artifact)?);
    }
    Ok(files)
}

/// The files of the lake that come from a paper's claims and its comparison.
pub fn paper_publications(compared: &Compared) -> Result<Vec<Publication<'static>>, Error> {
    let all = compared.results.iter();
    let all: Vec<Vec<Publication>> = all
        .map(|(node, artifact)| of_node(node, artifact))
        .collect::<Result<_, _>>()?;
    Ok(all.into_iter().flatten().collect())
}
