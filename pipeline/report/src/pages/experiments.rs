//! The experiments of a page: those of a published paper with their files, others with their pictures and scores.

use super::{paper, printed, query};
use crate::document::prose::prose;
use crate::document::{Block, Cell, Kind, Shape, Table, anchor, code, line};
use crate::figures::Figure;
use crate::source::{Held, Source};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Score;
use zonobench_lake::table::Name;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::papers::Paper;

/// The heading over the commands of a published paper.
pub const AGAIN: &str = "Run it again";

/// What was run, and how it is run again.
pub fn section(source: &Source, held: &Held, figures: &[Figure]) -> Result<Vec<Block>, Error> {
    let compared = !held.comparisons.is_empty();
    let published = |id: &String| {
        let mut all = held.paper.iter().flat_map(|p| &p.experiments);
        compared && all.any(|e| e.id == *id)
    };
    let (ours, own): (Vec<&String>, Vec<&String>) =
        held.experiments.iter().partition(|id| published(id));
    let mut out = Vec::new();
    match held.paper.as_ref().filter(|_| compared) {
        Some(paper) => {
            out.push(Block::heading(2, AGAIN));
            out.push(Block::Commands(commands(held, paper, &ours)));
            out.push(Block::Table(files(paper, &ours)));
        }
        None => {
            out.push(Block::heading(2, "Experiments"));
            out.push(Block::Para(prose(
                "What this lake holds of each: pictures of run 0, and the scores, which are the mean over the runs, its spread \
                 and the 95 % interval of the mean. `zonobench run FILE.toml` runs one again.",
            )));
        }
    }
    for id in own {
        out.extend(own_experiment(source, &held.name, id, figures)?);
    }
    Ok(out)
}

fn commands(held: &Held, paper: &Paper, ours: &[&String]) -> String {
    let one = ours
        .first()
        .and_then(|id| paper.file(id))
        .map_or_else(String::new, |file| {
            format!(
                "\nzonobench run experiments/{file} --lake lake-one     # one experiment by itself"
            )
        });
    format!(
        "zonobench reproduce-all --paper {name}     # all of it{one}\n{}\n{}",
        query(&format!(
            "SELECT * FROM scores WHERE paper = '{}'",
            held.name
        )),
        printed::behind(held),
        name = held.name
    )
}

/// The files of published experiments and what is in them.
fn files(paper: &Paper, ids: &[&String]) -> Table {
    let columns = [
        ("experiment", Shape::Words),
        ("file", Shape::Words),
        ("what it shows", Shape::Words),
        ("seed", Shape::Number),
        ("runs", Shape::Number),
        ("k", Shape::Number),
        ("estimators", Shape::Why),
    ];
    let rows = ids.iter().filter_map(|id| {
        let e = paper.experiments.iter().find(|e| e.id == ***id)?;
        let file = paper.file(id).unwrap_or_default();
        let estimators: Vec<&str> = e.estimators.iter().map(|e| e.id.as_str()).collect();
        Some(vec![
            code(*id).into(),
            code(format!("experiments/{file}")).into(),
            e.title.as_deref().unwrap_or_default().into(),
            e.seed.to_string().into(),
            e.runs.to_string().into(),
            format!("0 … {}", e.steps).into(),
            estimators.join(", ").into(),
        ])
    });
    let caption = format!("Experiments of {}", paper.name);
    Table::new(Kind::Sortable, caption, &columns, rows.collect())
}

/// An experiment of the user's own: its estimators, pictures and scores.
fn own_experiment(
    source: &Source,
    paper: &str,
    id: &str,
    figures: &[Figure],
) -> Result<Vec<Block>, Error> {
    let name = format!("experiment {id}");
    let mut out = vec![Block::heading_at(3, &anchor(&name), id)];
    if let Some(seed) = source.seed(paper, id)? {
        out.push(Block::Para(line![format!("Seed {seed}.")]));
    }
    let columns = [
        ("estimator", Shape::Words),
        ("kind", Shape::Words),
        ("its sets", Shape::Words),
        ("reads", Shape::Words),
        ("settings", Shape::Why),
    ];
    let estimators = source.estimators(paper, id)?;
    let estimators = estimators.iter().map(|e| {
        let guaranteed = if e.guaranteed { "guaranteed" } else { "" };
        vec![
            (&*e.estimator).into(),
            (&*e.kind).into(),
            guaranteed.into(),
            (&*e.reads).into(),
            code(&*e.settings).into(),
        ]
    });
    let rows: Vec<Vec<Cell>> = estimators.collect();
    if !rows.is_empty() {
        let caption = format!("Estimators of {id}");
        out.push(Block::Table(Table::new(
            Kind::Plain,
            caption,
            &columns,
            rows,
        )));
    }
    let own = figures
        .iter()
        .filter(|f| f.experiment.as_deref() == Some(id));
    out.extend(own.flat_map(|f| paper::figure(f, 4)));
    let scores = source.scores(paper, id)?;
    match scores.as_slice() {
        [] => out.push(Block::Para(line!["It has no metric."])),
        scores => out.push(Block::Table(score_table(id, scores))),
    }
    out.push(Block::Commands(query(&format!(
        "SELECT * FROM scores WHERE paper = '{paper}' AND experiment = '{id}'"
    ))));
    Ok(out)
}

fn score_table(id: &str, scores: &[Score]) -> Table {
    let columns = [
        ("estimator", Shape::Words),
        ("metric", Shape::Words),
        ("component", Shape::Words),
        ("over", Shape::Words),
        ("runs", Shape::Number),
        ("mean", Shape::Number),
        ("sd", Shape::Number),
        ("95 % of the mean", Shape::Number),
    ];
    let number = |x: Option<f64>| Cell::from(x.map(four_digits));
    let name = |n: &Option<Name>| Cell::from(n.as_deref());
    let row = |s: &Score| {
        let of_mean = s.ci_lo.zip(s.ci_hi).map(|(lo, hi)| interval(lo, hi));
        vec![
            (&*s.estimator).into(),
            (&*s.metric).into(),
            name(&s.component),
            name(&s.over),
            s.n_runs.to_string().into(),
            number(s.mean),
            number(s.sd),
            of_mean.into(),
        ]
    };
    let caption = format!("Scores of {id}");
    Table::new(
        Kind::Sortable,
        caption,
        &columns,
        scores.iter().map(row).collect(),
    )
    .without_empty(&["over", "component"])
}
