//! The true state, estimates and their enclosures over the steps, a panel a component.

use super::archetype::steps;
use super::drawn::{Context, Drawn, no_run};
use super::{Drawing, Spec};
use crate::source::FirstRun;
use crate::svg::{Axis, Colour, Panel, Series};
use zonobench_lake::error::Error;

/// Draws run 0.
pub fn draw(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    Ok(Some(match of.spec.beyond(&run) {
        Some(why) => Err(why),
        None => tubes(of, &run),
    }))
}

fn tubes(of: &Context, run: &FirstRun) -> Result<Drawing, String> {
    let spec = of.spec;
    let shown = spec.shown(run);
    if shown.is_empty() {
        return Err("the system has none of these components".to_owned());
    }
    let panels = shown.iter().map(|(name, unit)| Panel {
        x: steps(),
        y: Axis::new(name, unit),
        series: series(spec, run, name),
        ..Panel::default()
    });
    let columns = if shown.len() > 3 { 2 } else { 1 };
    let inside = spec.estimators.iter().filter_map(|s| {
        let held = |k: &i32| {
            run.trail(&s.estimator, &s.phase, &shown[0].0)
                .lower
                .contains_key(k)
        };
        let steps: Vec<i32> = (0..=run.last())
            .filter(|k| spec.sees(*k))
            .filter(held)
            .collect();
        let inside = steps
            .iter()
            .filter(|k| run.is_inside(&s.estimator, &s.phase, **k));
        let words = format!("{} at {} of {}", s.label, inside.count(), steps.len());
        (!steps.is_empty()).then_some(words)
    });
    let inside: Vec<String> = inside.collect();
    let measured = match inside.as_slice() {
        [] => "No estimator of these has sets.".to_owned(),
        inside => format!(
            "Bands are interval hulls, lines in them estimates. Steps with every component of the state in its hull: {}.",
            inside.join(", ")
        ),
    };
    Ok(Drawing {
        svg: spec.figure(columns, panels.collect()).to_svg(),
        caption: spec.told_or("{measured}", &[("measured", measured)]),
        below: Vec::new(),
        data: of.data(
            run,
            &[
                ("k, component, value", "truth", &spec.of_truth()),
                (
                    "estimator, k, component, center, lower, upper",
                    "estimates",
                    &spec.of_estimates(spec.estimators.iter()),
                ),
            ],
        ),
    })
}

/// Enclosures at the bottom, then estimates, then the truth.
fn series(spec: &Spec, run: &FirstRun, component: &str) -> Vec<Series> {
    let mut series = Vec::new();
    for s in &spec.estimators {
        let points = spec.ends(run.trail(&s.estimator, &s.phase, component));
        if points.is_empty() {
            continue;
        }
        series.push(Series::Band {
            label: s.label.clone(),
            colour: s.colour,
            points,
        });
    }
    for s in &spec.estimators {
        series.push(Series::Line {
            label: s.label.clone(),
            colour: s.colour,
            points: spec.points(&run.trail(&s.estimator, &s.phase, component).center),
        });
    }
    series.push(Series::Dashes {
        label: "true state".to_owned(),
        colour: Colour::Black,
        points: spec.points(run.state(component)),
    });
    series
}
