//! What the archetypes share: the window, the axis of steps, conditions of queries.

use super::{Archetype, Drawing, Spec, bars, curves, sets, tube};
use crate::source::{FirstRun, Source, Trail};
use crate::svg::{self, Axis};
use std::collections::BTreeMap;
use zonobench_lake::error::Error;

/// Draws `spec` from the lake; None where the lake does not hold its experiment.
pub fn drawn(
    source: &Source,
    paper: &str,
    spec: &Spec,
) -> Result<Option<Result<Drawing, String>>, Error> {
    let Some(run) = source.first_run(paper, &spec.experiment)? else {
        return Ok(None);
    };
    if let Some([_, end]) = spec.window
        && run.last() < end
    {
        return Ok(Some(Err(format!(
            "it shows steps to k = {end}, and this run ends at k = {}",
            run.last()
        ))));
    }
    Ok(Some(match spec.kind {
        Archetype::Tube => tube::draw(paper, spec, &run),
        Archetype::Curves => curves::draw(paper, spec, &run),
        Archetype::SetsByStep => {
            let sets = source.sets(paper, &spec.experiment)?;
            sets::draw(paper, spec, &run, &sets)
        }
        Archetype::Bars => {
            let scores = source.scores(paper, &spec.experiment)?;
            bars::draw(paper, spec, &run, &scores)
        }
    }))
}

impl Spec {
    /// The components that are drawn, with their units.
    pub fn shown<'a>(&self, run: &'a FirstRun) -> Vec<&'a (String, String)> {
        let wanted = |name: &String| self.components.is_empty() || self.components.contains(name);
        run.states.iter().filter(|(name, _)| wanted(name)).collect()
    }

    /// Whether a step is in the window.
    pub fn sees(&self, k: i32) -> bool {
        self.window
            .is_none_or(|[from, to]| (from..=to).contains(&k))
    }

    /// What stands above the picture.
    pub fn heading(&self) -> &str {
        match self.heading.as_str() {
            "" => &self.title,
            heading => heading,
        }
    }

    /// The rows of the table `truth` that are drawn.
    pub fn of_truth(&self) -> String {
        let window = |[from, to]: [i32; 2]| format!("k BETWEEN {from} AND {to}");
        self.window.map(window).unwrap_or_default()
    }

    /// The rows of the table `estimates`, or another with estimators and phases, that are drawn.
    pub fn of_estimates(&self) -> String {
        let of = self
            .estimators
            .iter()
            .map(|s| format!("(estimator = '{}' AND phase = '{}')", s.estimator, s.phase));
        let whose = format!("({})", of.collect::<Vec<_>>().join(" OR "));
        match self.of_truth().as_str() {
            "" => whose,
            window => format!("{window} AND {whose}"),
        }
    }

    /// (k, value) of the steps that are drawn.
    pub fn points(&self, values: &BTreeMap<i32, f64>) -> Vec<[f64; 2]> {
        let seen = values.iter().filter(|(k, _)| self.sees(**k));
        seen.map(|(k, value)| [f64::from(*k), *value]).collect()
    }

    /// (k, lower, upper) of the steps that are drawn.
    pub fn ends(&self, trail: &Trail) -> Vec<[f64; 3]> {
        let ends = |(k, lower): (&i32, &f64)| {
            let upper = *trail.upper.get(k)?;
            self.sees(*k).then_some([f64::from(*k), *lower, upper])
        };
        trail.lower.iter().filter_map(ends).collect()
    }

    /// The picture of these panels, so many in a row.
    pub fn picture(&self, columns: usize, panels: Vec<svg::Panel>) -> String {
        svg::Figure {
            title: self.heading().to_owned(),
            columns,
            panels,
            ..svg::Figure::default()
        }
        .to_svg()
    }

    /// The caption, and after it what was measured.
    pub fn caption_with(&self, measured: &str) -> String {
        format!("{} {measured}", self.caption).trim().to_owned()
    }
}

/// The axis of steps.
pub fn steps() -> Axis {
    Axis::new("step k", "")
}
