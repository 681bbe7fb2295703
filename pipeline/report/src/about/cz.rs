//! cz: Figs. 1 to 4 of [Rego2020].

use super::{About, Data, Drawing, Figure};
use crate::source::{FirstRun, Source};
use crate::svg::{self, Axis, Colour, Marker, Panel, Series};
use std::collections::BTreeMap;
use zonobench_estimation::System as _;
use zonobench_estimation::systems::Raimondo;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Set;
use zonobench_sets::{IntervalVector, Zonotope};
use zonobench_verdicts::papers::Paper;

pub const ABOUT: About = About {
    folder: "cz",
    says: "A nonlinear system with bounded noise and linear measurements. The set that holds the state is a \
           **constrained zonotope**, a zonotope whose coordinates also satisfy linear equations: it can be cut by a \
           measurement exactly. The paper carries it through the dynamics by a mean value extension (Theorem 2, \
           **CZMV**) and by a first-order Taylor extension (Theorem 3, **CZFO**), and compares both with the same \
           extensions of plain zonotopes (**ZMV**, **ZFO**), which must enclose every cut.\n\n\
           What it prints of CZMV comes out. CZFO with choice C4 as written is wider than CZMV, not tighter: the \
           change of center doubles the generators, and the remainder grows with the square of their sum. Another \
           change of center, `xb`, which is not in the paper, gives the printed numbers, but not the paper's Fig. 1. \
           Theorem 3 as printed loses points where it is expanded about another point than the center; the code \
           takes the symmetric half Hessian there.\n\n\
           Example 2, a quadrotor of twelve states at 100 Hz, comes out over its whole flight, with the true state \
           proved to be in every set. CZFO flies there as printed, with three, six and twelve constraints, one flight each, \
           and in a lean form, which is not in the paper, over more flights.",
    not_drawn: "",
    draw,
};

fn draw(source: &Source, paper: Option<&Paper>) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    if let Some(run) = run(source, "one-step")? {
        let sets = Sets::read(source, "one-step")?;
        figures.push(Figure {
            experiment: None,
            name: "Fig. 1".into(),
            title: "One step from a triangle".to_owned(),
            drawing: one_step(&run, &sets, prior(paper, "one-step").as_ref()),
        });
    }
    if let Some(run) = run(source, "first-steps")? {
        let sets = Sets::read(source, "first-steps")?;
        let (prior, v) = (prior(paper, "first-steps"), noise(paper, "first-steps"));
        figures.push(Figure {
            experiment: None,
            name: "Fig. 2".into(),
            title: "The first update".to_owned(),
            drawing: first_update(&run, &sets, prior.as_ref().zip(v.as_ref())),
        });
        figures.push(Figure {
            experiment: None,
            name: "Fig. 3".into(),
            title: "Four steps without process noise".to_owned(),
            drawing: four_steps(&run, &sets, prior.as_ref().zip(v.as_ref())),
        });
    }
    if let Some(radii) = run(source, "radii_g20")? {
        let taylor = run(source, "taylor_g20")?;
        figures.push(Figure {
            experiment: None,
            name: "Fig. 4".into(),
            title: "Radii of the updated sets".to_owned(),
            drawing: Ok(radii_of(&radii, taylor.as_ref())),
        });
    }
    figures.extend(super::quadrotor::figures(source)?);
    Ok(figures)
}

fn run(source: &Source, experiment: &str) -> Result<Option<FirstRun>, Error> {
    source.first_run("cz", experiment)
}

/// X_0 of an experiment, its constraints left out.
fn prior(paper: Option<&Paper>, experiment: &str) -> Option<Zonotope> {
    let found = paper?.experiments.iter().find(|e| e.id == experiment)?;
    let prior = &found.problem.prior;
    Zonotope::new(prior.center.clone(), prior.generator_matrix()).ok()
}

/// V of an experiment.
fn noise(paper: Option<&Paper>, experiment: &str) -> Option<IntervalVector> {
    let found = paper?.experiments.iter().find(|e| e.id == experiment)?;
    found.problem.v.bounds.clone()
}

/// Outlines of the updated sets of run 0, by estimator and step.
struct Sets(BTreeMap<(String, i32), Vec<[f64; 2]>>);

impl Sets {
    fn read(source: &Source, experiment: &str) -> Result<Self, Error> {
        let updated = source.sets("cz", experiment)?.into_iter();
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
fn next(x: [f64; 2]) -> [f64; 2] {
    let mut to = [0.0; 2];
    Raimondo::default().f(0, &x, &[], &[0.0; 2], &mut to);
    to
}

/// Twice the signed area summed over the edges, halved.
fn area(vertices: &[[f64; 2]]) -> f64 {
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

fn data(experiment: &str, run: &FirstRun, queries: &[(&str, &str, &str)]) -> Data {
    Data::of("cz", experiment, run, queries)
}

/// (choice, colour, label) of Fig. 1.
const CHOICES: [(&str, Colour, &str); 4] = [
    ("c3", Colour::Orange, "C3"),
    ("c1", Colour::Green, "C1"),
    ("c2", Colour::Vermilion, "C2"),
    ("c4", Colour::Blue, "C4"),
];

/// Fig. 1.
fn one_step(run: &FirstRun, sets: &Sets, prior: Option<&Zonotope>) -> Result<Drawing, String> {
    const SAMPLES: usize = 14;
    let center = prior.ok_or("X_0 is not known")?.c();
    let start = sets.get("czmv-c1", 0)?;
    let [a, b, c] = start else {
        return Err(format!("X_0 has {} vertices, not three", start.len()));
    };
    let steps = (0..=SAMPLES).flat_map(|i| (0..=SAMPLES - i).map(move |j| (i, j)));
    let inside = steps.map(|(i, j)| {
        let (s, t) = (i as f64 / SAMPLES as f64, j as f64 / SAMPLES as f64);
        [0, 1].map(|d| a[d] + s * (b[d] - a[d]) + t * (c[d] - a[d]))
    });
    let images: Vec<[f64; 2]> = inside.map(next).collect();
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
    let figure = svg::Figure {
        title: "One step from a triangle whose center lies outside".to_owned(),
        columns: 3,
        panels,
        ..svg::Figure::default()
    };
    Ok(Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption: format!(
            "In the paper: X_0 and the enclosures of the set that one step of Eq. (23) leads to, by Theorem 2 and by \
             Theorem 3, for the four choices of h. Areas by Theorem 2: {}; C4 covers C1. By Theorem 3: {}, where C4 \
             is reduced to the size of the others ({} before). As in the paper C2 is the tightest of the former and \
             C4 of the latter; the recentring `xb`, not in the paper and not drawn, would give {}. The dots are \
             images of a grid in X_0.",
            list(&areas[..4]),
            list(&areas[4..]),
            four_digits(raw),
            four_digits(xb),
        ),
        data: data(
            "one-step",
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

/// What is known before the first measurement: X_0 and V.
type Known<'a> = Option<(&'a Zonotope, &'a IntervalVector)>;

/// Whether a state agrees with y_k; a component that was not measured agrees with everything.
fn agrees(run: &FirstRun, v: &IntervalVector, k: i32, x: [f64; 2]) -> bool {
    let outputs = [("y1", x[0]), ("y2", x[1] - x[0])];
    outputs.iter().zip(v.iter()).all(|((name, h), v)| {
        let y = run.measured.get(*name).and_then(|y| y.get(&k));
        y.is_none_or(|y| v.contains(y - h))
    })
}

/// Fig. 2.
fn first_update(run: &FirstRun, sets: &Sets, known: Known) -> Result<Drawing, String> {
    let (prior, v) = known.ok_or("X_0 and V are not known")?;
    let outline = prior.vertices().map_err(|e| e.to_string())?;
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
    let figure = svg::Figure {
        title: "X_0 and what y_0 leaves of it".to_owned(),
        columns: 1,
        panels: vec![plane("k = 0", series)],
        ..svg::Figure::default()
    };
    Ok(Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption: format!(
            "In the paper: X_0, the bounds of the first measurement (dashed), the zonotope that encloses their \
             intersection, and the intersection itself as a constrained zonotope. Areas {}, {} and {}. The seed of \
             the paper's measurement is not printed; this is run 0.",
            four_digits(area(&outline)),
            four_digits(area(bravo)),
            four_digits(area(exact)),
        ),
        data: data("first-steps", run, &[SETS, MEASURED]),
    })
}

/// Fig. 3.
fn four_steps(run: &FirstRun, sets: &Sets, known: Known) -> Result<Drawing, String> {
    const GRID: usize = 8;
    let (prior, v) = known.ok_or("X_0 and V are not known")?;
    let consistent = |k, x| agrees(run, v, k, x);
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
        points = points.iter().map(|&x| next(x)).collect();
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
    let figure = svg::Figure {
        title: "Four steps of CZMV and of ZMV".to_owned(),
        columns: 2,
        panels,
        ..svg::Figure::default()
    };
    let texts: Vec<String> = areas
        .iter()
        .map(|(k, cz, z)| format!("k = {k}: {} and {}", four_digits(*cz), four_digits(*z)))
        .collect();
    Ok(Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption: format!(
            "In the paper: the updated sets of the first four steps without process noise, and images of points of \
             X_0 that agree with the measurement. Here with all measurements up to k. Areas of CZMV and ZMV: {}.",
            texts.join("; ")
        ),
        data: data("first-steps", run, &[SETS, MEASURED]),
    })
}

/// max_i r_i by k.
fn radii(run: &FirstRun, estimator: &str) -> Vec<[f64; 2]> {
    let trails: Vec<_> = run
        .states
        .iter()
        .map(|(name, _)| run.trail(estimator, "updated", name))
        .collect();
    let largest = |k: i32| {
        let widths = trails
            .iter()
            .map(|t| Some(t.upper.get(&k)? - t.lower.get(&k)?));
        let widths: Option<Vec<f64>> = widths.collect();
        widths.map(|w| 0.5 * w.into_iter().fold(0.0, f64::max))
    };
    (0..=run.last())
        .filter_map(|k| Some([f64::from(k), largest(k)?]))
        .collect()
}

/// Fig. 4.
fn radii_of(run: &FirstRun, taylor: Option<&FirstRun>) -> Drawing {
    let mut shown = vec![
        (run, "zmv", "ZMV", Colour::Orange),
        (run, "zfo", "ZFO", Colour::Sky),
        (run, "czmv-5", "CZMV", Colour::Green),
    ];
    if let Some(taylor) = taylor {
        shown.push((taylor, "czfo-5", "CZFO", Colour::Blue));
    }
    shown.push((
        run,
        "czfo-xb-5",
        "CZFO with xb, not in the paper",
        Colour::Purple,
    ));
    let mut series = Vec::new();
    let mut means = Vec::new();
    for (run, estimator, label, colour) in shown {
        let points = radii(run, estimator);
        let mean = points.iter().map(|p| p[1]).sum::<f64>() / points.len().max(1) as f64;
        means.push(format!("{label} {}", four_digits(mean)));
        series.push(Series::Line {
            label: label.to_owned(),
            colour,
            points,
        });
    }
    let figure = svg::Figure {
        title: "Half the longest edge of the interval hull".to_owned(),
        columns: 1,
        panels: vec![Panel {
            title: "20 generators, 5 constraints".to_owned(),
            x: Axis::new("step k", ""),
            y: Axis::new("radius", ""),
            series,
            ..Panel::default()
        }],
        ..svg::Figure::default()
    };
    let condition = "phase = 'updated' AND estimator IN ('zmv', 'zfo', 'czmv-5', 'czfo-xb-5')";
    let mut from = data(
        "radii_g20",
        run,
        &[(
            "estimator, k, component, lower, upper",
            "estimates",
            condition,
        )],
    );
    if let Some(taylor) = taylor {
        let condition = "phase = 'updated' AND estimator = 'czfo-5'";
        let more = data(
            "taylor_g20",
            taylor,
            &[(
                "estimator, k, component, lower, upper",
                "estimates",
                condition,
            )],
        );
        from.experiment = format!("{} and {}", from.experiment, more.experiment);
        from.files.extend(more.files);
        from.sql.extend(more.sql);
    }
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption: format!(
            "In the paper: the radii of CZMV, ZMV, CZFO and ZFO over 100 steps with process noise. Run 0; means over \
             k: {}.",
            means.join(", ")
        ),
        data: from,
    }
}
