//! Methods in order: who is more accurate and tighter, over all experiments of a paper.

use super::{place, smoke_run};
use crate::document::{Block, Cell, Kind, Page, Shape, Table, line, link_page};
use crate::source::{Held, Source};
use crate::timings::RecordedTime;
use std::collections::BTreeMap;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows;

/// What a method came to over the comparisons that it took part in.
#[derive(Default)]
struct Tally {
    /// How often it was compared
    compared: usize,
    /// How often it was the best
    best: usize,
    /// Σ log (its mean / the least mean)
    logs: f64,
}

impl Tally {
    fn add(&mut self, ratio: f64) {
        self.compared += 1;
        self.best += usize::from(ratio <= 1.0);
        self.logs += libm::log(ratio);
    }

    fn ratio(&self) -> Option<f64> {
        (self.compared > 0).then(|| libm::exp(self.logs / self.compared as f64))
    }

    fn cells(&self) -> [Cell; 2] {
        let best = (self.compared > 0).then(|| format!("{} of {}", self.best, self.compared));
        [self.ratio().map(four_digits).into(), best.into()]
    }
}

#[derive(Default)]
struct Method {
    kind: String,
    /// In how many of its experiments its sets are guaranteed
    guaranteed: usize,
    experiments: usize,
    error: Tally,
    size: Tally,
}

impl Method {
    /// By error; those that were compared in size alone come after.
    fn key(&self) -> [f64; 2] {
        [&self.error, &self.size].map(|t| t.ratio().unwrap_or(f64::INFINITY))
    }
}

/// Whether a metric is an error (false) or a size, in an experiment that comes with this program or in one that does not.
fn is_size(held: &Held, experiment: &str, metric: &str) -> Option<bool> {
    let of_name = |name: &str| match name {
        "rmse" | "rmse_wrapped" | "rmse_norm" => Some(false),
        "radius" | "r_box" | "width" | "volume" | "area" | "box_area" | "projected_area" => {
            Some(true)
        }
        _ => None,
    };
    let published = held
        .paper
        .as_ref()
        .and_then(|p| p.experiments.iter().find(|e| e.id == experiment));
    match published {
        Some(e) => {
            let spec = e.metrics.iter().find(|m| m.id == metric)?;
            // One step, or another phase than the paper reports, is not what a method is judged by.
            (spec.at.is_empty() && spec.phase.is_none() && spec.over.is_none())
                .then(|| of_name(spec.name))
                .flatten()
        }
        None => of_name(metric),
    }
}

fn methods(source: &Source, held: &Held) -> Result<BTreeMap<String, Method>, Error> {
    let mut methods: BTreeMap<String, Method> = BTreeMap::new();
    for experiment in &held.experiments {
        for e in source.estimators(&held.name, experiment)? {
            let method = methods.entry(e.estimator.to_string()).or_default();
            method.guaranteed += usize::from(e.guaranteed);
            method.kind = e.kind.to_string();
            method.experiments += 1;
        }
        let scores = source.scores(&held.name, experiment)?;
        for ((metric, _), group) in comparable(&scores) {
            let Some(size) = is_size(held, experiment, metric).filter(|_| group.len() > 1) else {
                continue;
            };
            let least = group.iter().map(|(_, x)| *x).fold(f64::INFINITY, f64::min);
            for (estimator, mean) in group {
                let method = methods.entry(estimator.to_owned()).or_default();
                let tally = match size {
                    true => &mut method.size,
                    false => &mut method.error,
                };
                tally.add(mean / least);
            }
        }
    }
    Ok(methods)
}

/// Estimators and their means by metric and component.
type Comparable<'a> = BTreeMap<(&'a str, &'a str), Vec<(&'a str, f64)>>;

/// The positive means of an experiment that can be set beside each other.
fn comparable(scores: &[rows::Score]) -> Comparable<'_> {
    let mut groups = Comparable::new();
    for s in scores.iter().filter(|s| s.over.is_none()) {
        if let Some(mean) = s.mean.filter(|x| x.is_finite() && *x > 0.0) {
            let key = (&*s.metric, s.component.as_deref().unwrap_or_default());
            groups.entry(key).or_default().push((&s.estimator, mean));
        }
    }
    groups
}

/// The ranking of methods, a table a paper; None where nothing was set beside another.
pub fn page(
    source: &Source,
    papers: &[&Held],
    times: &[RecordedTime],
) -> Result<Option<Page>, Error> {
    let mut blocks = vec![Block::Para(line![
        "Over all experiments of a paper in this lake: an error (RMSE) or a size (radius, \
         width, area, volume) of one component is one comparison between the estimators of that experiment. A \
         method's number is the geometric mean of its mean over the least mean: 1 is the best everywhere, 2 is twice \
         the best. Estimators of different experiments are not the same problem; guarantees are not priced in: a \
         set that is not guaranteed may be small because it loses the truth. Times are the recorded ones."
    ])];
    if papers.iter().any(|p| p.is_quick()) {
        blocks.push(smoke_run());
    }
    let before = blocks.len();
    for held in papers {
        let methods = methods(source, held)?;
        let compared = methods
            .iter()
            .filter(|(_, m)| m.error.compared + m.size.compared > 0);
        let mut compared: Vec<(&String, &Method)> = compared.collect();
        if compared.is_empty() {
            continue;
        }
        compared.sort_by(|(_, a), (_, b)| {
            let ([error, size], [other, others]) = (a.key(), b.key());
            error.total_cmp(&other).then(size.total_cmp(&others))
        });
        blocks.push(Block::heading_at(
            2,
            &place(&held.name),
            link_page(&place(&held.name), &held.name),
        ));
        blocks.push(Block::Table(table(held, &compared, times)));
    }
    if blocks.len() == before {
        return Ok(None);
    }
    blocks.push(Block::Commands(super::query(
        "SELECT paper, experiment, metric, component, estimator, mean, ci_lo, ci_hi FROM scores \
         ORDER BY paper, experiment, metric, component, mean",
    )));
    Ok(Some(Page {
        place: "ranking".to_owned(),
        name: "Ranking".to_owned(),
        file: Some("ranking.md".to_owned()),
        title: line!["Methods in order"],
        blocks,
    }))
}

fn table(held: &Held, methods: &[(&String, &Method)], times: &[RecordedTime]) -> Table {
    let columns = [
        ("method", Shape::Words),
        ("place", Shape::Number),
        ("kind", Shape::Words),
        ("experiments with a guarantee", Shape::Number),
        ("error / least", Shape::Number),
        ("least error", Shape::Number),
        ("size / least", Shape::Number),
        ("least size", Shape::Number),
        ("median step", Shape::Number),
    ];
    let row = |(i, (name, m)): (usize, &(&String, &Method))| {
        let own = times
            .iter()
            .filter(|t| t.paper == held.name && t.estimator == **name);
        let mut own: Vec<f64> = own.map(|t| t.median_step_us).collect();
        own.sort_by(f64::total_cmp);
        let time = own
            .get(own.len() / 2)
            .map(|x| format!("{} µs", four_digits(*x)));
        let [error, best] = m.error.cells();
        let [size, tightest] = m.size.cells();
        vec![
            (*name).into(),
            (i + 1).to_string().into(),
            (&m.kind).into(),
            format!("{} of {}", m.guaranteed, m.experiments).into(),
            error,
            best,
            size,
            tightest,
            time.into(),
        ]
    };
    let rows = methods.iter().enumerate().map(row).collect();
    let caption = format!("Methods of {}", held.name);
    Table::new(Kind::Sortable, caption, &columns, rows).without_empty(&["median step"])
}
