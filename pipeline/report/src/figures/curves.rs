//! A quantity over the steps, a curve an estimator.

use super::archetype::steps;
use super::drawn::{Context, Drawn, no_run};
use super::{Data, Drawing, Quantity, Spec, Subject};
use crate::source::FirstRun;
use crate::svg::{Axis, Panel, Series};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;

/// A component and its unit.
type Component = (String, String);

/// Draws run 0 of every experiment that an estimator is from; one that the lake does not hold has no curve.
pub fn draw(of: &Context) -> Result<Drawn, Error> {
    let Some(first) = of.run()? else {
        return no_run();
    };
    let mut runs = vec![(of.spec.experiment.clone(), first)];
    for id in of
        .spec
        .estimators
        .iter()
        .filter_map(|s| s.experiment.as_ref())
    {
        if runs.iter().all(|(known, _)| known != id) {
            runs.extend(of.run_of(id)?.map(|run| (id.clone(), run)));
        }
    }
    Ok(Some(match of.spec.beyond(&runs[0].1) {
        Some(why) => Err(why),
        None => Curves { of, runs }.draw(),
    }))
}

struct Curves<'a> {
    of: &'a Context<'a>,
    /// Runs by experiment, that of the figure first
    runs: Vec<(String, FirstRun)>,
}

impl Curves<'_> {
    fn draw(&self) -> Result<Drawing, String> {
        let spec = self.of.spec;
        let shown = spec.shown(&self.runs[0].1);
        let mut means = Vec::new();
        let mut panels: Vec<Panel> = match spec.quantity {
            Quantity::Radius => {
                let unit = match spec.unit.as_str() {
                    "" => common_unit(&shown),
                    unit => unit,
                };
                vec![self.panel(&shown, "radius", unit, &mut means)]
            }
            Quantity::HalfWidth | Quantity::Error => {
                let what = match spec.quantity {
                    Quantity::Error => "error",
                    _ => "half-width",
                };
                let of = |c: &&Component| {
                    self.panel(&[*c], &format!("{what} in {}", c.0), &c.1, &mut means)
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
            svg: spec.figure(columns, panels).to_svg(),
            caption: spec.told_or(
                "Means over the steps drawn: {means}.",
                &[("means", means.join(", "))],
            ),
            below: Vec::new(),
            data: self.data(),
        })
    }

    /// What was drawn of every experiment.
    fn data(&self) -> Data {
        let spec = self.of.spec;
        let of = |(id, run): &(String, FirstRun)| {
            let own = spec.estimators.iter();
            let own = own.filter(|s| s.experiment.as_ref().unwrap_or(&spec.experiment) == id);
            let (estimates, truth) = (spec.of_estimates(own), spec.of_truth());
            let mut queries = vec![(
                "estimator, k, component, center, lower, upper",
                "estimates",
                estimates.as_str(),
            )];
            if spec.quantity == Quantity::Error {
                queries.push(("k, component, value", "truth", &truth));
            }
            Data::of(self.of.paper, id, run, &queries)
        };
        let all = self.runs.iter().map(of).reduce(Data::joined);
        all.expect("there is the run of the figure")
    }

    fn panel(
        &self,
        components: &[&Component],
        label: &str,
        unit: &str,
        means: &mut Vec<String>,
    ) -> Panel {
        let spec = self.of.spec;
        let mut series = Vec::new();
        for s in &spec.estimators {
            let id = s.experiment.as_ref().unwrap_or(&spec.experiment);
            let Some((_, run)) = self.runs.iter().find(|(known, _)| known == id) else {
                continue;
            };
            let points = curve(spec, run, s, components);
            if points.is_empty() {
                continue;
            }
            let mean = points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64;
            let with = |unit: &str| match unit {
                "" | "1" => four_digits(mean),
                unit => format!("{} {unit}", four_digits(mean)),
            };
            means.push(match spec.quantity {
                Quantity::Radius => format!("{} {}", s.label, with(unit)),
                _ => format!("{label} of {} {}", s.label, with(unit)),
            });
            let (label, colour) = (s.label.clone(), s.colour);
            series.push(match s.dashed {
                true => Series::Dashes {
                    label,
                    colour,
                    points,
                },
                false => Series::Line {
                    label,
                    colour,
                    points,
                },
            });
        }
        Panel {
            title: spec.panel.clone(),
            x: match spec.period {
                Some(_) => Axis::new("t", "s"),
                None => steps(),
            },
            y: Axis {
                log: spec.log,
                ..Axis::new(label, unit)
            },
            series,
            ..Panel::default()
        }
    }
}

/// (k or time, value) of one estimator; the largest of the components.
fn curve(spec: &Spec, run: &FirstRun, of: &Subject, components: &[&Component]) -> Vec<[f64; 2]> {
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
        let x = f64::from(k) * spec.period.unwrap_or(1.0);
        largest.is_finite().then_some([x, largest])
    };
    let steps = (0..=run.last()).filter(|k| spec.sees(*k));
    steps.filter_map(at).collect()
}

/// The unit of all components; empty where they differ.
fn common_unit<'a>(components: &[&'a Component]) -> &'a str {
    match components {
        [(_, first), rest @ ..] if rest.iter().all(|(_, unit)| unit == first) => first,
        _ => "",
    }
}
