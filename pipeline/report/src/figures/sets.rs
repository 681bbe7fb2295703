//! Sets in the plane of two components, a panel a step: outlines where the lake keeps them, else interval hulls.

use super::drawn::{Context, Drawn, no_run};
use super::{Drawing, Spec};
use crate::source::{FirstRun, Trail};
use crate::svg::{Axis, Colour, Marker, Panel, Series, rectangle};
use std::collections::BTreeMap;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Set;

/// Draws run 0.
pub fn draw(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    Ok(Some(planes(of, &run, &of.sets()?)))
}

fn planes(of: &Context, run: &FirstRun, sets: &[Set]) -> Result<Drawing, String> {
    let spec = of.spec;
    let shown = spec.shown(run);
    let [first, second, ..] = shown.as_slice() else {
        return Err("a state of one component has no plane".to_owned());
    };
    let plane = Plane {
        spec,
        run,
        axes: [first, second],
        outlines: match run.states.len() {
            2 => outlines(sets),
            _ => BTreeMap::new(),
        },
    };
    let panels: Vec<Panel> = spec.steps.iter().filter_map(|k| plane.panel(*k)).collect();
    if panels.is_empty() {
        return Err("no estimator has sets at these steps".to_owned());
    }
    let drawn = match plane.outlines.is_empty() {
        true => "interval hulls",
        false => "sets, and interval hulls where the lake keeps no outline",
    };
    let whose = spec.of_estimates(spec.estimators.iter());
    let mut queries = vec![
        ("k, component, value", "truth", ""),
        (
            "estimator, k, component, lower, upper",
            "estimates",
            whose.as_str(),
        ),
    ];
    if !plane.outlines.is_empty() {
        queries.push(("estimator, k, vertices", "sets", whose.as_str()));
    }
    let measured = format!(
        "Drawn are {drawn} in the plane of {} and {}; a cross is the true state. Axes differ from panel to panel.",
        first.0, second.0
    );
    Ok(Drawing {
        svg: spec.figure(panels.len().min(3), panels).to_svg(),
        caption: spec.told_or("{measured}", &[("measured", measured)]),
        below: Vec::new(),
        data: of.data(run, &queries),
    })
}

/// Outlines by estimator, phase and step.
type Outlines<'a> = BTreeMap<(&'a str, &'a str, i32), Vec<[f64; 2]>>;

fn outlines(sets: &[Set]) -> Outlines<'_> {
    let outline = |set: &'_ Set| -> Option<Vec<[f64; 2]>> {
        let pairs = set.vertices.as_ref()?.chunks_exact(2);
        Some(pairs.map(|v| [v[0], v[1]]).collect())
    };
    let keyed = sets
        .iter()
        .filter(|set| set.run == 0)
        .filter_map(|set| Some(((&*set.estimator, &*set.phase, set.k), outline(set)?)));
    keyed.collect()
}

struct Plane<'a> {
    spec: &'a Spec,
    run: &'a FirstRun,
    axes: [&'a (String, String); 2],
    outlines: Outlines<'a>,
}

impl Plane<'_> {
    /// The sets of step k; None where there is none.
    fn panel(&self, k: i32) -> Option<Panel> {
        let mut series: Vec<Series> = (self.spec.estimators.iter())
            .filter_map(|s| {
                let outline = self.outlines.get(&(&*s.estimator, &*s.phase, k)).cloned();
                Some(Series::Polygon {
                    label: s.label.clone(),
                    colour: s.colour,
                    filled: true,
                    vertices: outline.or_else(|| self.hull(&s.estimator, &s.phase, k))?,
                })
            })
            .collect();
        if series.is_empty() {
            return None;
        }
        let truth = self
            .axes
            .map(|(name, _)| self.run.state(name).get(&k).copied());
        if let [Some(x), Some(y)] = truth {
            series.push(Series::Points {
                label: "true state".to_owned(),
                colour: Colour::Black,
                marker: Marker::Cross,
                points: vec![[x, y]],
            });
        }
        let [x, y] = self.axes.map(|(name, unit)| Axis::new(name, unit));
        Some(Panel {
            title: format!("k = {k}"),
            x,
            y,
            series,
            equal: false,
        })
    }

    fn hull(&self, estimator: &str, phase: &str, k: i32) -> Option<Vec<[f64; 2]>> {
        let corner = |end: fn(&Trail) -> &BTreeMap<i32, f64>| {
            let at = |i: usize| {
                let trail = self.run.trail(estimator, phase, &self.axes[i].0);
                end(trail).get(&k).copied().filter(|x| x.is_finite())
            };
            Some([at(0)?, at(1)?])
        };
        Some(rectangle(corner(|t| &t.lower)?, corner(|t| &t.upper)?))
    }
}
