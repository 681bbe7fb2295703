//! bundle: Figs. 1 and 2 of [Khajenejad], and all set methods for nonlinear systems on one example.

use super::{About, Data, Drawing, Figure};
use crate::document::{Block, Cell, Kind, Shape, Table};
use crate::source::{FirstRun, Source};
use crate::svg::{self, Axis, Colour, Marker, Panel, Series};
use std::collections::BTreeMap;
use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::{Problem, System as _};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Score, Set};
use zonobench_sets::{ConstrainedZonotope, Matrix};
use zonobench_verdicts::papers::Paper;

pub const ABOUT: About = About {
    folder: "bundle",
    says: "A nonlinear system with bounded noises whose state is kept in a **polytope**, written as a bundle of \
           zonotopes or as a constrained zonotope. Every row of the dynamics is split into a linear part and a \
           remainder that is monotone in each variable, so that its bounds over a box are its values at corners: \
           **D-ZB** does so over the rotated boxes of a bundle, **D-CZ** over the hull. **RRSR** is the mean value \
           extension of [Rego2020], **D-RRSR** bounds its Jacobian by decomposition, and **COMB** intersects all four.\n\n\
           As written, all vectors of every row are taken and the sets intersected. In the text at hand the corners of the \
           corollary that bounds the remainder are exchanged; with them restored the first column of both tables comes \
           out, Table I as areas of hulls, Table II with half-widths of X_0 that are fitted to it, since they are not \
           printed. The later columns of Table II rest on landmarks and draws that are not printed either, and do not look \
           like means of independent runs. **LIFT**, which is not in the paper, imposes every relation of every method on \
           one and the same state and projects once.",
    not_drawn: "",
    draw,
};

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

fn draw(source: &Source, paper: Option<&Paper>) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    let examples = [
        (
            "Fig. 1",
            "Example I, the updated sets",
            "ex1",
            "x1",
            "x2",
            "",
        ),
        (
            "Fig. 2",
            "Example II, the updated sets in the plane of the position",
            "ex2_iid",
            "sx",
            "sy",
            "m",
        ),
    ];
    for (name, title, experiment, x, y, unit) in examples {
        let Some(run) = source.first_run("bundle", experiment)? else {
            continue;
        };
        let sets = source.sets("bundle", experiment)?;
        let found = paper.and_then(|p| p.experiments.iter().find(|e| e.id == experiment));
        let dots = found.map_or_else(Vec::new, |e| cloud(&run, &e.problem));
        figures.push(Figure {
            experiment: None,
            name: name.into(),
            title: title.to_owned(),
            drawing: updated_sets(experiment, title, &run, &sets, &dots, [x, y], unit),
        });
    }
    if let Some(run) = source.first_run("bundle", "ranking")? {
        let scores = source.scores("bundle", "ranking")?;
        figures.push(Figure {
            experiment: None,
            name: "Not in the paper".into(),
            title: "All set methods on the same system and noise".to_owned(),
            drawing: ranking(&run, &scores),
        });
    }
    Ok(figures)
}

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

fn area(vertices: &[[f64; 2]]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    let twice: f64 = (vertices.iter().zip(next))
        .map(|(p, q)| p[0] * q[1] - q[0] * p[1])
        .sum();
    0.5 * twice
}

/// Sampled states of a step, as the paper draws them.
const DOTS: usize = 150;

/// Of at most this many draws a step those are kept that agree with what was measured.
const TRIES: usize = 20_000;

/// The seed of the samples.
const SEED: u64 = 1;

/// The first two components of sampled states by k: states of X_0 and noises of W, drawn uniformly and put through the
/// dynamics, that agree with every measurement of run 0 so far.
fn cloud(run: &FirstRun, problem: &Problem) -> Vec<Vec<[f64; 2]>> {
    let (Some(w), Some(v)) = (&problem.w.bounds, &problem.v.bounds) else {
        return Vec::new();
    };
    let variables = problem.system.variables();
    let names = variables.y;
    let agrees = |k: i32, x: &[f64]| {
        let mut y = vec![0.0; names.len()];
        let silent = vec![0.0; variables.v.len()];
        problem.system.h(k as usize, x, &[], &silent, &mut y);
        names.iter().zip(&y).zip(v.iter()).all(|((name, y), v)| {
            let seen = run.measured.get(&name.name).and_then(|seen| seen.get(&k));
            seen.is_none_or(|seen| v.contains(seen - y))
        })
    };
    let g = problem.prior.generator_matrix();
    let mut first = Draws::new(SEED, Purpose::X0, 0);
    let start = |j: usize| -> Vec<f64> {
        let xi: Vec<f64> = (0..g.cols()).map(|i| first.uniform(j, i, 0)).collect();
        let moved = g.mul_vec(&xi);
        let center = &problem.prior.center;
        center.iter().zip(&moved).map(|(c, d)| c + d).collect()
    };
    let mut states: Vec<Vec<f64>> = (0..TRIES)
        .map(start)
        .filter(|x| agrees(0, x))
        .take(DOTS)
        .collect();
    let mut all = Vec::new();
    for k in 0..=LAST.min(run.last()) {
        if k > 0 {
            let mut draws = Draws::new(SEED, Purpose::W, k as u64);
            let next = |j: usize| {
                let x = states.get(j % states.len().max(1))?;
                let noise = w.iter().enumerate();
                let noise: Vec<f64> = noise
                    .map(|(i, w)| w.mid() + w.rad() * draws.uniform(j, i, 0))
                    .collect();
                let mut to = vec![0.0; x.len()];
                problem.system.f(k as usize - 1, x, &[], &noise, &mut to);
                Some(to)
            };
            states = (0..TRIES)
                .filter_map(next)
                .filter(|x| agrees(k, x))
                .take(DOTS)
                .collect();
        }
        all.push(states.iter().map(|x| [x[0], x[1]]).collect());
    }
    all
}

/// Figs. 1 and 2: a panel a step.
fn updated_sets(
    experiment: &str,
    title: &str,
    run: &FirstRun,
    sets: &[Set],
    dots: &[Vec<[f64; 2]>],
    [x, y]: [&str; 2],
    unit: &str,
) -> Result<Drawing, String> {
    let shadows: BTreeMap<(&str, i32), Vec<[f64; 2]>> = sets
        .iter()
        .filter(|set| &*set.phase == "updated")
        .filter_map(|set| Some(((&*set.estimator, set.k), shadow(set)?)))
        .collect();
    let (xs, ys) = (run.state(x), run.state(y));
    let mut panels = Vec::new();
    let mut last = Vec::new();
    for k in 0..=LAST.min(run.last()) {
        let mut series = Vec::new();
        for (estimator, label, colour) in SHOWN {
            let Some(vertices) = shadows.get(&(estimator, k)) else {
                return Err(format!("the lake holds no set of {estimator} at k = {k}"));
            };
            last.push((label, k, area(vertices)));
            series.push(Series::Polygon {
                label: label.to_owned(),
                colour,
                filled: estimator == "lift",
                vertices: vertices.clone(),
            });
        }
        if let Some(points) = dots.get(k as usize) {
            series.push(Series::Points {
                label: "sampled states".to_owned(),
                colour: Colour::Black,
                marker: Marker::Dot,
                points: points.clone(),
            });
        }
        if let (Some(&x), Some(&y)) = (xs.get(&k), ys.get(&k)) {
            series.push(Series::Points {
                label: "true state".to_owned(),
                colour: Colour::Black,
                marker: Marker::Cross,
                points: vec![[x, y]],
            });
        }
        panels.push(Panel {
            title: format!("k = {k}"),
            x: Axis::new(x, unit),
            y: Axis::new(y, unit),
            series,
            equal: false,
        });
    }
    let end = last.iter().map(|(_, k, _)| *k).max().unwrap_or(0);
    let areas = last.iter().filter(|(_, k, _)| *k == end);
    let areas: Vec<String> = areas
        .map(|(label, _, area)| format!("{label} {}", four_digits(*area)))
        .collect();
    let figure = svg::Figure {
        title: title.to_owned(),
        columns: 3,
        panels,
        ..svg::Figure::default()
    };
    Ok(Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption: format!(
            "In the paper: the updated sets of the five methods at k = 0 to 4 in one run whose seed is not printed, \
             with dots for states and noises that were sampled uniformly and put through the dynamics. Here run 0 and up to \
             {DOTS} such states a step that agree with all measurements so far, the true state as a cross, and LIFT. Areas of \
             what is drawn at k = {end}: {}.",
            areas.join(", ")
        ),
        data: Data::of(
            "bundle",
            experiment,
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
fn ranking(run: &FirstRun, scores: &[Score]) -> Result<Drawing, String> {
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
        ("", Shape::Number),
        ("method", Shape::Words),
        ("area", Shape::Number),
        ("radius", Shape::Number),
        ("share of states certainly inside", Shape::Number),
    ];
    let table = Table::new(Kind::Sortable, "Mean sizes", &columns, lines.collect());
    let drawn = [
        ("zmv", "ZMV", Colour::Blue),
        ("czmv", "CZMV", Colour::Vermilion),
        ("czfo-lean", "CZFO, lean", Colour::Orange),
        ("d-rrsr", "D-RRSR", Colour::Purple),
        ("comb-plus", "COMB+", Colour::Green),
        ("lift", "LIFT", Colour::Black),
    ];
    let panels = ["x1", "x2"].map(|component| Panel {
        title: format!("width in {component}"),
        x: Axis::new("step k", ""),
        y: Axis::new("width", ""),
        series: drawn
            .iter()
            .map(|(estimator, label, colour)| {
                let trail = run.trail(estimator, "updated", component);
                let width =
                    |(k, upper): (&i32, &f64)| Some([f64::from(*k), upper - trail.lower.get(k)?]);
                Series::Line {
                    label: (*label).to_owned(),
                    colour: *colour,
                    points: trail.upper.iter().filter_map(width).collect(),
                }
            })
            .collect(),
        ..Panel::default()
    });
    let figure = svg::Figure {
        title: "All set methods on the same system and noise".to_owned(),
        columns: 2,
        panels: panels.into(),
        ..svg::Figure::default()
    };
    Ok(Drawing {
        below: vec![Block::Table(table)],
        svg: figure.to_svg(),
        caption: format!(
            "The system of Example I with its derivatives in their tightest form, |w| ≤ 0.1, |v| ≤ 0.4, the same draws \
             for all; 20 generators for ZMV, ZFO, CZMV and CZFO, 5 constraints for the latter two. The table has means \
             over the runs of the mean over k ≥ 1; drawn are widths of hulls in run 0. Times are in `timings`."
        ),
        data: Data::of(
            "bundle",
            "ranking",
            run,
            &[(
                "estimator, k, component, lower, upper",
                "estimates",
                "phase = 'updated'",
            )],
        ),
    })
}
