//! A quantity over the steps, a curve an estimator.

use super::archetype::steps;
use super::{Data, Drawing, Quantity, Spec, Subject};
use crate::source::FirstRun;
use crate::svg::{Axis, Panel, Series};
use zonobench_lake::digits::four_digits;

/// Draws run 0.
pub fn draw(paper: &str, spec: &Spec, run: &FirstRun) -> Result<Drawing, String> {
    let shown = spec.shown(run);
    let mut means = Vec::new();
    let mut panel = |components: &[&(String, String)], label: String, unit: &str| {
        let mut series = Vec::new();
        for s in &spec.estimators {
            let points = curve(spec, run, s, components);
            if points.is_empty() {
                continue;
            }
            let mean = points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64;
            means.push(format!("{} of {} {}", label, s.label, four_digits(mean)));
            series.push(Series::Line {
                label: s.label.clone(),
                colour: s.colour,
                points,
            });
        }
        Panel {
            x: steps(),
            y: Axis {
                log: spec.log,
                ..Axis::new(&label, unit)
            },
            series,
            ..Panel::default()
        }
    };
    let mut panels: Vec<Panel> = match spec.quantity {
        Quantity::Radius => vec![panel(&shown, "radius".to_owned(), common_unit(&shown))],
        Quantity::HalfWidth | Quantity::Error => {
            let of = |of: &&(String, String)| {
                let what = match spec.quantity {
                    Quantity::Error => "error",
                    _ => "half-width",
                };
                panel(&[*of], format!("{what} in {}", of.0), &of.1)
            };
            shown.iter().map(of).collect()
        }
    };
    panels.retain(|panel| !panel.series.is_empty());
    if panels.is_empty() {
        return Err("no estimator gives this".to_owned());
    }
    let columns = if panels.len() > 3 { 2 } else { 1 };
    Ok(Drawing {
        svg: spec.picture(columns, panels),
        caption: spec.caption_with(&format!(
            "Means over the steps drawn: {}.",
            means.join(", ")
        )),
        below: Vec::new(),
        data: Data::of(
            paper,
            &spec.experiment,
            run,
            &[
                (
                    "estimator, k, component, center, lower, upper",
                    "estimates",
                    &spec.of_estimates(),
                ),
                ("k, component, value", "truth", &spec.of_truth()),
            ],
        ),
    })
}

/// (k, value) of one estimator; the largest of the components.
fn curve(
    spec: &Spec,
    run: &FirstRun,
    of: &Subject,
    components: &[&(String, String)],
) -> Vec<[f64; 2]> {
    let value = |component: &str, k: i32| {
        let trail = run.trail(&of.estimator, &of.phase, component);
        match spec.quantity {
            Quantity::Error => {
                let truth = run.state(component).get(&k)?;
                Some((trail.center.get(&k)? - truth).abs())
            }
            _ => Some(0.5 * (trail.upper.get(&k)? - trail.lower.get(&k)?)),
        }
    };
    let at = |k: i32| {
        let values = components.iter().map(|(name, _)| value(name, k));
        let values: Option<Vec<f64>> = values.collect();
        let largest = values?.into_iter().fold(0.0, f64::max);
        largest.is_finite().then_some([f64::from(k), largest])
    };
    let steps = (0..=run.last()).filter(|k| spec.sees(*k));
    steps.filter_map(at).collect()
}

/// The unit of all components; empty where they differ.
fn common_unit<'a>(components: &[&'a (String, String)]) -> &'a str {
    match components {
        [(_, first), rest @ ..] if rest.iter().all(|(_, unit)| unit == first) => first,
        _ => "",
    }
}
