//! Figs. 1 to 3 of [Rego2020].

use super::{Context, Drawn, no_run};
use crate::figures::Drawing;
use crate::source::FirstRun;
use crate::svg::{Axis, Colour, Marker, Panel, Series};
use std::collections::BTreeMap;
use zonobench_lab::experiment::Experiment;
use zonobench_lab::illustrate;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Set;
use zonobench_sets::Zonotope;

/// X_0 of an experiment, its constraints left out.
fn prior(experiment: &Experiment) -> Result<Zonotope, String> {
    let prior = &experiment.problem.prior;
    Zonotope::new(prior.center.clone(), prior.generator_matrix()).map_err(|e| e.to_string())
}

/// Outlines of the updated sets of run 0, by estimator and step.
struct Sets(BTreeMap<(String, i32), Vec<[f64; 2]>>);

impl Sets {
    fn read(of: &Context) -> Result<Self, Error> {
        let updated = of.sets()?.into_iter();
        let updated = updated.filter(|set| &*set.phase == "updated");
        let outline = |set: Set| {
            let pairs = set.vertices?;
            let vertices = pairs.chunks_exact(2).map(|v| [v[0], v[1]]).collect();
            Some(((set.estimator.to_string(), set.k), vertices))
        };
        Ok(Self(updated.filter_map(outline).collect()))
    }

    fn get(&self, estimator: &str, k: i32) -> Result<&[[f64; 2]], String> {
        let found = self.0.get(&(estimator.to_owned(), k));
        found
            .map(Vec::as_slice)
            .ok_or_else(|| format!("the lake holds no set of {estimator} at k = {k}"))
    }
}

fn polygon(label: &str, colour: Colour, filled: bool, vertices: &[[f64; 2]]) -> Series {
    Series::Polygon {
        label: label.to_owned(),
        colour,
        filled,
        vertices: vertices.to_vec(),
    }
}

fn dots(label: &str, points: Vec<[f64; 2]>) -> Series {
    Series::Points {
        label: label.to_owned(),
        colour: Colour::Black,
        marker: Marker::Dot,
        points,
    }
}

/// f(x, 0) of Eq. (23).
fn next(experiment: &Experiment, x: [f64; 2]) -> [f64; 2] {
    let to = illustrate::next(experiment, 0, &x);
    [to[0], to[1]]
}

/// Twice the signed area summed over the edges, halved.
pub fn area(vertices: &[[f64; 2]]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    let twice: f64 = (vertices.iter().zip(next))
        .map(|(p, q)| p[0] * q[1] - q[0] * p[1])
        .sum();
    0.5 * twice
}

/// (x1, x2) panel.
fn plane(title: &str, series: Vec<Series>) -> Panel {
    Panel {
        title: title.to_owned(),
        x: Axis::new("x1", ""),
        y: Axis::new("x2", ""),
        series,
        equal: false,
    }
}

/// Draws with run 0, the sets and the published experiment.
fn with(
    of: &Context,
    draw: fn(&Context, &FirstRun, &Sets, &Experiment) -> Result<Drawing, String>,
) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    let sets = Sets::read(of)?;
    Ok(Some(match of.published() {
        Some(experiment) => draw(of, &run, &sets, experiment),
        None => Err("X_0 and V are not known".to_owned()),
    }))
}

/// Fig. 1.
pub fn one_step(of: &Context) -> Result<Drawn, Error> {
    with(of, one_step_of)
}

/// Fig. 2.
pub fn first_update(of: &Context) -> Result<Drawn, Error> {
    with(of, first_update_of)
}

/// Fig. 3.
pub fn four_steps(of: &Context) -> Result<Drawn, Error> {
    with(of, four_steps_of)
}

/// (choice, colour, label) of Fig. 1.
const CHOICES: [(&str, Colour, &str); 4] = [
    ("c3", Colour::Orange, "C3"),
    ("c1", Colour::Green, "C1"),
    ("c2", Colour::Vermilion, "C2"),
    ("c4", Colour::Blue, "C4"),
];

fn one_step_of(
    of: &Context,
    run: &FirstRun,
    sets: &Sets,
    experiment: &Experiment,
) -> Result<Drawing, String> {
    const SAMPLES: usize = 14;
    let center = &experiment.problem.prior.center;
    let start = sets.get("czmv-c1", 0)?;
    let [a, b, c] = start else {
        return Err(format!("X_0 has {} vertices, not three", start.len()));
    };
    let steps = (0..=SAMPLES).flat_map(|i| (0..=SAMPLES - i).map(move |j| (i, j)));
    let inside = steps.map(|(i, j)| {
        let (s, t) = (i as f64 / SAMPLES as f64, j as f64 / SAMPLES as f64);
        [0, 1].map(|d| a[d] + s * (b[d] - a[d]) + t * (c[d] - a[d]))
    });
    let images: Vec<[f64; 2]> = inside.map(|x| next(experiment, x)).collect();
    let mut first = vec![polygon("X_0", Colour::Grey, true, start)];
    first.push(Series::Points {
        label: "center of X_0".to_owned(),
        colour: Colour::Black,
        marker: Marker::Cross,
        points: vec![[center[0], center[1]]],
    });
    let mut panels = vec![plane("X_0", first)];
    let mut areas = Vec::new();
    for (method, title) in [("czmv", "Theorem 2"), ("czfo", "Theorem 3")] {
        let mut series = Vec::new();
        for (choice, colour, label) in CHOICES {
            let set = sets.get(&format!("{method}-{choice}"), 1)?;
            series.push(polygon(label, colour, false, set));
            areas.push((label, area(set)));
        }
        series.push(dots("f of points of X_0", images.clone()));
        panels.push(plane(title, series));
    }
    let list = |areas: &[(&str, f64)]| {
        let texts = areas
            .iter()
            .map(|(c, a)| format!("{c} {}", four_digits(*a)));
        texts.collect::<Vec<_>>().join(", ")
    };
    let xb = area(sets.get("czfo-xb", 1)?);
    let raw = area(sets.get("czfo-c4-raw", 1)?);
    let facts = [
        ("theorem-2", list(&areas[..4])),
        ("theorem-3", list(&areas[4..])),
        ("raw", four_digits(raw)),
        ("xb", four_digits(xb)),
    ];
    Ok(Drawing {
        svg: of.spec.figure(3, panels).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(
            run,
            &[("estimator, k, vertices", "sets", "phase = 'updated'")],
        ),
    })
}

const SETS: (&str, &str, &str) = (
    "estimator, k, vertices",
    "sets",
    "phase = 'updated' AND estimator IN ('zmv', 'czmv')",
);

const MEASURED: (&str, &str, &str) = ("k, component, value", "measurements", "");

fn first_update_of(
    of: &Context,
    run: &FirstRun,
    sets: &Sets,
    experiment: &Experiment,
) -> Result<Drawing, String> {
    let v = experiment.problem.v.bounds.as_ref();
    let v = v.ok_or("V has no bounds")?;
    let outline = prior(experiment)?.vertices().map_err(|e| e.to_string())?;
    let (bravo, exact) = (sets.get("zmv", 0)?, sets.get("czmv", 0)?);
    let drawn = || outline.iter().chain(bravo);
    let end =
        |d: usize, pick: fn(f64, f64) -> f64, from: f64| drawn().map(|p| p[d]).fold(from, pick);
    let (low, high) = (
        [0, 1].map(|d| end(d, f64::min, f64::INFINITY) - 0.05),
        [0, 1].map(|d| end(d, f64::max, f64::NEG_INFINITY) + 0.05),
    );
    let y = |name: &str| {
        let found = run.measured.get(name).and_then(|y| y.get(&0).copied());
        found.ok_or_else(|| format!("{name} was not measured at k = 0"))
    };
    let (y1, y2) = (y("y1")?, y("y2")?);
    let mut series = vec![
        polygon("X_0", Colour::Grey, true, &outline),
        polygon("zonotope by Bravo's rule", Colour::Orange, true, bravo),
        polygon("exact intersection", Colour::Green, true, exact),
    ];
    let dashes = |points: Vec<[f64; 2]>| Series::Dashes {
        label: "measurement and its bounds".to_owned(),
        colour: Colour::Black,
        points,
    };
    for (v1, v2) in [(v[0].lo(), v[1].lo()), (v[0].hi(), v[1].hi())] {
        let x1 = y1 - v1;
        if low[0] <= x1 && x1 <= high[0] {
            series.push(dashes(vec![[x1, low[1]], [x1, high[1]]]));
        }
        // x2 = x1 + y2 − v2, within the picture.
        let offset = y2 - v2;
        let (from, to) = (low[0].max(low[1] - offset), high[0].min(high[1] - offset));
        if from < to {
            series.push(dashes(vec![[from, from + offset], [to, to + offset]]));
        }
    }
    let facts = [
        ("prior", four_digits(area(&outline))),
        ("bravo", four_digits(area(bravo))),
        ("exact", four_digits(area(exact))),
    ];
    Ok(Drawing {
        svg: of.spec.figure(1, vec![plane("k = 0", series)]).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(run, &[SETS, MEASURED]),
    })
}

fn four_steps_of(
    of: &Context,
    run: &FirstRun,
    sets: &Sets,
    experiment: &Experiment,
) -> Result<Drawing, String> {
    const GRID: usize = 8;
    let prior = prior(experiment)?;
    let measured = |name: &str, k: i32| run.measured.get(name)?.get(&k).copied();
    let consistent =
        |k, x: [f64; 2]| illustrate::agrees(experiment, &measured, k, &x) == Some(true);
    let p = prior.generators();
    let count = (GRID + 1).pow(p as u32);
    let starts = (0..count).map(|index| {
        let mut rest = index;
        let xi: Vec<f64> = (0..p)
            .map(|_| {
                let digit = rest % (GRID + 1);
                rest /= GRID + 1;
                2.0 * digit as f64 / GRID as f64 - 1.0
            })
            .collect();
        let moved = prior.g().mul_vec(&xi);
        [prior.c()[0] + moved[0], prior.c()[1] + moved[1]]
    });
    let mut points: Vec<[f64; 2]> = starts.filter(|&x| consistent(0, x)).collect();
    let mut panels = Vec::new();
    let mut areas = Vec::new();
    for k in 1..=4 {
        points = points.iter().map(|&x| next(experiment, x)).collect();
        points.retain(|&x| consistent(k, x));
        let (zmv, czmv) = (sets.get("zmv", k)?, sets.get("czmv", k)?);
        areas.push((k, area(czmv), area(zmv)));
        let series = vec![
            polygon("ZMV", Colour::Orange, true, zmv),
            polygon("CZMV", Colour::Green, true, czmv),
            dots("images of points of X_0", points.clone()),
        ];
        panels.push(plane(&format!("k = {k}"), series));
    }
    let texts: Vec<String> = areas
        .iter()
        .map(|(k, cz, z)| format!("k = {k}: {} and {}", four_digits(*cz), four_digits(*z)))
        .collect();
    let facts = [("areas", texts.join("; "))];
    Ok(Drawing {
        svg: of.spec.figure(2, panels).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(run, &[SETS, MEASURED]),
    })
}
