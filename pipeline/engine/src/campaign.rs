//! The campaign against the guarantees on the terminal.

use crate::engine::{own_units, owns};
use crate::progress::Progress;
use std::sync::Arc;
use zonobench_evidence::attack::{self, Size};
use zonobench_lab::experiment::Experiment;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Attack;
use zonobench_verdicts::papers;

/// What a campaign found.
pub struct Found {
    /// A line a case, and the sum.
    pub text: String,
    /// Whether something guaranteed was lost.
    pub broken: bool,
}

/// Attacks what belongs to `paper`, or to the gallery (to all if none).
pub fn run(paper: Option<&str>, size: Size, progress: &Progress) -> Result<Found, Error> {
    let mut rows: Vec<(String, Attack)> = Vec::new();
    for (paper, system) in targets(paper)? {
        let name = format!("{paper}/{system}");
        let done = |n| progress.advance(&name, "attack", n);
        rows.extend(
            attack::count(paper, system, size, &done)?
                .into_iter()
                .map(|r| (system.to_owned(), r)),
        );
    }
    for experiment in gallery(paper)? {
        let name = experiment.name();
        let done = |n| progress.advance(&name, "attack", n);
        let counted = attack::count_own(&owns(&experiment)?, size, &done)?;
        rows.extend(counted.into_iter().map(|r| (experiment.id.clone(), r)));
    }
    progress.clear();
    Ok(Found {
        text: render(&rows),
        broken: rows.iter().any(|(_, r)| r.guaranteed && r.lost > 0),
    })
}

/// How many units [`run`] counts.
pub fn units(paper: Option<&str>, size: Size) -> Result<u64, Error> {
    let of_papers = targets(paper)?
        .into_iter()
        .map(|(p, system)| attack::units(p, system, size));
    let of_gallery = gallery(paper)?
        .iter()
        .map(|e| own_units(e, size))
        .collect::<Result<Vec<u64>, _>>()?;
    Ok(of_papers.chain(of_gallery).sum())
}

/// The experiments of the gallery, if they are wanted.
fn gallery(wanted: Option<&str>) -> Result<Vec<Arc<Experiment>>, Error> {
    match wanted.is_none_or(|w| w == papers::GALLERY) {
        true => papers::gallery(),
        false => Ok(Vec::new()),
    }
}

fn targets(wanted: Option<&str>) -> Result<Vec<(&'static str, &'static str)>, Error> {
    if let Some(wanted) = wanted.filter(|w| *w != papers::GALLERY) {
        papers::load(&[wanted.to_owned()])?;
    }
    let papers = papers::names()
        .into_iter()
        .filter(|p| wanted.is_none_or(|w| w == *p));
    let pairs = papers.flat_map(|p| attack::systems(p).into_iter().map(move |s| (p, s)));
    Ok(pairs.collect())
}

fn render(rows: &[(String, Attack)]) -> String {
    let width = |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0);
    let system = width(&mut rows.iter().map(|(s, _)| s.len())).max(6);
    let name = width(&mut rows.iter().map(|(_, r)| r.estimator.len())).max(9);
    let kind = width(&mut rows.iter().map(|(_, r)| r.attack.len())).max(6);
    let mut out = format!(
        "{:system$}  {:name$}  {:kind$}  {:>9}  {:>6}  {:>9}  {:>9}  {:>7}  guaranteed\n",
        "system", "estimator", "attack", "sets", "lost", "rate <", "undecided", "refused"
    );
    for (on, r) in rows {
        out += &format!(
            "{on:system$}  {:name$}  {:kind$}  {:9}  {:6}  {:9.1e}  {:9}  {:7}  {}\n",
            r.estimator,
            r.attack,
            r.steps,
            r.lost,
            r.rate_hi,
            r.undecided,
            r.refused,
            if r.guaranteed { "yes" } else { "no" },
        );
    }
    for (guaranteed, what) in [(true, "guaranteed"), (false, "not guaranteed")] {
        let of = || rows.iter().filter(|(_, r)| r.guaranteed == guaranteed);
        let sum = |value: fn(&Attack) -> i64| of().map(|(_, r)| value(r)).sum::<i64>();
        let (steps, lost) = (sum(|r| r.steps), sum(|r| r.lost));
        out += &format!("{what}: {lost} of {steps} sets lost\n");
    }
    out
}
