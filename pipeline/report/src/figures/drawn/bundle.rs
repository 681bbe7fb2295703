//! Figs. 1 and 2 of [Khajenejad], and all set methods for nonlinear systems on one example.

use super::{Context, Drawn, cz::area, no_run};
use crate::document::{Block, Cell, Kind, Shape, Table};
use crate::figures::Drawing;
use crate::source::FirstRun;
use crate::svg::{Axis, Colour, Marker, Panel, Series};
use std::collections::BTreeMap;
use zonobench_lab::illustrate;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Score, Set};
use zonobench_sets::{ConstrainedZonotope, Matrix};

/// (estimator, label, colour) of the paper's five methods, and LIFT.
const SHOWN: [(&str, &str, Colour); 6] = [
    ("rrsr", "RRSR", Colour::Blue),
    ("d-rrsr", "D-RRSR", Colour::Vermilion),
    ("d-zb", "D-ZB", Colour::Green),
    ("d-cz", "D-CZ", Colour::Orange),
    ("comb", "COMB", Colour::Purple),
    ("lift", "LIFT", Colour::Grey),
];

/// The last k that is drawn.
const LAST: i32 = 4;

/// The projection of a set on its first two components.
fn shadow(set: &Set) -> Option<Vec<[f64; 2]>> {
    let (center, g) = (set.center.as_ref()?, set.generators.as_ref()?);
    let columns = g.len() / center.len();
    let plane = Matrix::from_fn(2, columns, |i, j| g[i * columns + j]);
    let b = set.b.clone().unwrap_or_default();
    let a = set.a.clone().unwrap_or_default();
    let a = Matrix::from_fn(b.len(), columns, |i, j| a[i * columns + j]);
    ConstrainedZonotope::new(center[..2].to_vec(), plane, a, b)
        .and_then(|set| set.vertices())
        .ok()
}

/// Sampled states of a step, as the paper draws them.
const DOTS: usize = 150;

/// The first two components of sampled states by k, as the paper draws them.
fn cloud(of: &Context, run: &FirstRun) -> Vec<Vec<[f64; 2]>> {
    let Some(experiment) = of.published() else {
        return Vec::new();
    };
    let measured = |name: &str, k: i32| run.measured.get(name)?.get(&k).copied();
    let states = illustrate::cloud(experiment, &measured, LAST.min(run.last()), DOTS);
    let pairs = |states: &Vec<Vec<f64>>| states.iter().map(|x| [x[0], x[1]]).collect();
    states.iter().map(pairs).collect()
}

/// Fig. 1.
pub fn first_example(of: &Context) -> Result<Drawn, Error> {
    by_step(of, ["x1", "x2"], "")
}

/// Fig. 2.
pub fn second_example(of: &Context) -> Result<Drawn, Error> {
    by_step(of, ["sx", "sy"], "m")
}

fn by_step(of: &Context, axes: [&str; 2], unit: &str) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    Ok(Some(updated_sets(of, &run, &of.sets()?, axes, unit)))
}

/// A panel a step.
fn updated_sets(
    of: &Context,
    run: &FirstRun,
    sets: &[Set],
    [x, y]: [&str; 2],
    unit: &str,
) -> Result<Drawing, String> {
    let dots = cloud(of, run);
    let shadows: BTreeMap<(&str, i32), Vec<[f64; 2]>> = sets
        .iter()
        .filter(|set| &*set.phase == "updated")
        .filter_map(|set| Some(((&*set.estimator, set.k), shadow(set)?)))
        .collect();
    let end = LAST.min(run.last());
    let mut panels = Vec::new();
    for k in 0..=end {
        let mut series = Vec::new();
        for (estimator, label, colour) in SHOWN {
            let Some(vertices) = shadows.get(&(estimator, k)) else {
                return Err(format!("the lake holds no set of {estimator} at k = {k}"));
            };
            series.push(Series::Polygon {
                label: label.to_owned(),
                colour,
                filled: estimator == "lift",
                vertices: vertices.clone(),
            });
        }
        let sampled = dots.get(k as usize).cloned();
        series.extend(sampled.map(|dots| marks("sampled states", Marker::Dot, dots)));
        if let (Some(&x), Some(&y)) = (run.state(x).get(&k), run.state(y).get(&k)) {
            series.push(marks("true state", Marker::Cross, vec![[x, y]]));
        }
        panels.push(Panel {
            title: format!("k = {k}"),
            x: Axis::new(x, unit),
            y: Axis::new(y, unit),
            series,
            equal: false,
        });
    }
    let areas = SHOWN.iter().filter_map(|(estimator, label, _)| {
        let vertices = shadows.get(&(*estimator, end))?;
        Some(format!("{label} {}", four_digits(area(vertices))))
    });
    let areas: Vec<String> = areas.collect();
    let facts = [
        ("dots", DOTS.to_string()),
        ("end", end.to_string()),
        ("areas", areas.join(", ")),
    ];
    Ok(Drawing {
        svg: of.spec.figure(3, panels).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(
            run,
            &[
                (
                    "estimator, k, center, generators, a, b",
                    "sets",
                    "phase = 'updated'",
                ),
                ("k, component, value", "truth", ""),
                ("k, component, value", "measurements", ""),
            ],
        ),
    })
}

fn marks(label: &str, marker: Marker, points: Vec<[f64; 2]>) -> Series {
    Series::Points {
        label: label.to_owned(),
        colour: Colour::Black,
        marker,
        points,
    }
}

/// Estimator and label of every method of the ranking.
const RANKED: [(&str, &str); 11] = [
    ("zmv", "ZMV"),
    ("zfo", "ZFO"),
    ("czmv", "CZMV"),
    ("czfo-lean", "CZFO, lean"),
    ("rrsr", "RRSR"),
    ("d-rrsr", "D-RRSR"),
    ("d-zb", "D-ZB"),
    ("d-cz", "D-CZ"),
    ("comb", "COMB"),
    ("comb-plus", "COMB+"),
    ("lift", "LIFT"),
];

/// The widths of all methods over k in run 0, and a table of their mean sizes.
pub fn ranking(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
    let panels = vec![widths(run, "x1"), widths(run, "x2")];
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(2, panels).to_svg(),
        caption: of.spec.told(&[]),
        below: vec![Block::Table(mean_sizes(&of.scores()?))],
        data: of.data(
            run,
            &[(
                "estimator, k, component, lower, upper",
                "estimates",
                "phase = 'updated'",
            )],
        ),
    })))
}

/// Means over the runs of the mean over k ≥ 1, the smallest area first.
fn mean_sizes(scores: &[Score]) -> Table {
    let score = |estimator: &str, metric: &str| {
        let found = scores.iter().find(|s| {
            &*s.estimator == estimator
                && &*s.metric == metric
                && s.component.as_deref().is_none_or(str::is_empty)
        });
        found.and_then(|s| s.mean)
    };
    let mut rows: Vec<(&str, [Option<f64>; 3])> = RANKED
        .iter()
        .map(|(id, label)| (*label, ["area", "radius", "contains"].map(|m| score(id, m))))
        .collect();
    rows.sort_by(|a, b| {
        let key = |row: &[Option<f64>; 3]| row[0].unwrap_or(f64::INFINITY);
        key(&a.1).total_cmp(&key(&b.1))
    });
    let show = |x: Option<f64>| Cell::from(x.map_or_else(|| "–".to_owned(), four_digits));
    let lines = rows.iter().enumerate();
    let lines = lines.map(|(i, (label, [area, radius, contains]))| {
        let place = (i + 1).to_string();
        vec![
            place.into(),
            (*label).into(),
            show(*area),
            show(*radius),
            show(*contains),
        ]
    });
    let columns = [
        ("place", Shape::Number),
        ("method", Shape::Words),
        ("area", Shape::Number),
        ("radius", Shape::Number),
        ("share of states certainly inside", Shape::Number),
    ];
    Table::new(Kind::Sortable, "Mean sizes", &columns, lines.collect())
}

/// Widths of the hulls in a component.
fn widths(run: &FirstRun, component: &str) -> Panel {
    let drawn = [
        ("zmv", "ZMV", Colour::Blue),
        ("czmv", "CZMV", Colour::Vermilion),
        ("czfo-lean", "CZFO, lean", Colour::Orange),
        ("d-rrsr", "D-RRSR", Colour::Purple),
        ("comb-plus", "COMB+", Colour::Green),
        ("lift", "LIFT", Colour::Black),
    ];
    let series = drawn.iter().map(|(estimator, label, colour)| {
        let trail = run.trail(estimator, "updated", component);
        let width = |(k, upper): (&i32, &f64)| Some([f64::from(*k), upper - trail.lower.get(k)?]);
        Series::Line {
            label: (*label).to_owned(),
            colour: *colour,
            points: trail.upper.iter().filter_map(width).collect(),
        }
    });
    Panel {
        title: format!("width in {component}"),
        x: Axis::new("step k", ""),
        y: Axis::new("width", ""),
        series: series.collect(),
        ..Panel::default()
    }
}
