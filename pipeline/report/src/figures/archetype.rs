//! What the archetypes share: the window, the axis of steps, conditions of queries.

use super::drawn::{self, Context, Drawn};
use super::{Archetype, Spec, Subject, bars, curves, sets, tube};
use crate::source::{FirstRun, Source, Trail};
use crate::svg::{self, Axis};
use std::collections::BTreeMap;
use zonobench_lake::error::Error;
use zonobench_verdicts::papers::Paper;

/// Draws `spec` from the lake; None where the lake does not hold its experiment.
pub fn drawn(
    source: &Source,
    paper: &str,
    known: Option<&Paper>,
    spec: &Spec,
) -> Result<Drawn, Error> {
    let of = Context {
        source,
        paper,
        known,
        spec,
    };
    match spec.kind {
        Some(Archetype::Tube) => tube::draw(&of),
        Some(Archetype::Curves) => curves::draw(&of),
        Some(Archetype::SetsByStep) => sets::draw(&of),
        Some(Archetype::Bars) => bars::draw(&of),
        None => match drawn::find(&spec.drawing) {
            Ok(draw) => draw(&of),
            Err(why) => Ok(Some(Err(why))),
        },
    }
}

impl Spec {
    /// The components that are drawn, with their units.
    pub fn shown<'a>(&self, run: &'a FirstRun) -> Vec<&'a (String, String)> {
        let wanted = |name: &String| self.components.is_empty() || self.components.contains(name);
        run.states.iter().filter(|(name, _)| wanted(name)).collect()
    }

    /// Whether a step is drawn: in the window, and one of every so many.
    pub fn sees(&self, k: i32) -> bool {
        let inside = |[from, to]: [i32; 2]| (from..=to).contains(&k);
        k % self.every.max(1) == 0 && self.window.is_none_or(inside)
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

    /// The rows of the table `estimates`, or another with estimators and phases, that are drawn of these.
    pub fn of_estimates<'a>(&self, subjects: impl Iterator<Item = &'a Subject>) -> String {
        let of =
            subjects.map(|s| format!("(estimator = '{}' AND phase = '{}')", s.estimator, s.phase));
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

    /// These panels, so many in a row, below the heading.
    pub fn figure(&self, columns: usize, panels: Vec<svg::Panel>) -> svg::Figure {
        svg::Figure {
            title: self.heading().to_owned(),
            columns,
            panels,
            ..svg::Figure::default()
        }
    }

    /// The caption with what was measured in it.
    pub fn told(&self, facts: &[(&str, String)]) -> String {
        self.told_or("", facts)
    }

    /// The caption, or this one if there is none, with what was measured in it.
    pub fn told_or(&self, otherwise: &str, facts: &[(&str, String)]) -> String {
        let caption = match self.caption.as_str() {
            "" => otherwise,
            caption => caption,
        };
        let fill = |text: String, (name, value): &(&str, String)| {
            text.replace(&format!("{{{name}}}"), value)
        };
        facts.iter().fold(caption.trim().to_owned(), fill)
    }

    /// Why the run does not reach the window's end, if so.
    pub fn beyond(&self, run: &FirstRun) -> Option<String> {
        let [_, end] = self.window?;
        let last = run.last();
        (last < end)
            .then(|| format!("it shows steps to k = {end}, and this run ends at k = {last}"))
    }
}

/// The axis of steps.
pub fn steps() -> Axis {
    Axis::new("step k", "")
}

#[cfg(test)]
mod tests {
    use crate::figures::Spec;

    #[test]
    fn a_caption_says_what_was_measured() {
        let text = "name = 'n'\ntitle = 't'\nexperiment = 'e'\ndrawing = 'd'\ncaption = 'x_{k|k-1}: {n} of {all}'";
        let spec: Spec = toml::from_str(text).unwrap();
        let facts = [("n", "3".to_owned()), ("all", "4".to_owned())];
        assert_eq!(spec.told(&facts), "x_{k|k-1}: 3 of 4");
        assert!(toml::from_str::<Spec>(&text.replace("title", "titel")).is_err());
    }
}
