//! box: Figs. 1 to 9 of [MeslemRamdani].

use super::{About, Data, Drawing, Figure, at_steps};
use crate::source::{FirstRun, Instant, Source, Trail};
use crate::svg::{self, Axis, Colour, Marker, Panel, Series, ellipse, rectangle};
use std::collections::BTreeMap;
use zonobench_estimation::System;
use zonobench_estimation::system::Variable;
use zonobench_lab::experiment::Experiment;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_sets::ellipsoid::chi_square_isf;
use zonobench_verdicts::papers::Paper;

pub const ABOUT: About = About {
    folder: "box",
    says: "Two ways to estimate the state of x_{k+1} = A x_k + B u_k + d_k, y_k = C x_k + D u_k + v_k are put beside \
           each other on one system with two states and one measurement. The **Kalman filter** is told the mean and \
           the covariance of x_0, d and v, and gives an estimate with a confidence ellipsoid. The interval estimator \
           **Box-State-Est** is told a box for each of them, and gives a box that is claimed to hold the state \
           (Proposition 1) and to be no wider than a bound (Eq. (17)); its estimate is the midpoint.\n\n\
           Scenario A (Section IV-A) draws Gaussian noise that stays in its box, scenario B (Section IV-B) takes \
           deterministic signals in the same boxes. The paper concludes that the two perform alike where the \
           statistics are known, that the box is better where only bounds are, and that the Kalman filter is the \
           less demanding one.",
    not_drawn: "",
    draw,
};

/// What the paper calls the Kalman estimate is the prediction x̂_{k|k−1}.
const KALMAN: (&str, &str) = ("kalman", "predicted");
const FILTERED: (&str, &str) = ("kalman", "updated");
const BOX: (&str, &str) = ("box-state-est", "updated");

const TRUTH: (&str, &str, &str) = ("k, component, value", "truth", "");
const ESTIMATES: (&str, &str, &str) = (
    "estimator, k, component, center, lower, upper",
    "estimates",
    "((estimator = 'kalman' AND phase = 'predicted') OR (estimator = 'box-state-est' AND phase = 'updated'))",
);
const COVARIANCES: (&str, &str, &str) = (
    "k, covariance",
    "beliefs",
    "estimator = 'kalman' AND phase = 'predicted' AND k IN (0, 4, 9, 39, 79, 119)",
);

/// Figs. 1 and 2 explain what an estimator gives, at no step that they name: here at this one of this experiment, with
/// the states of so many runs.
const EXPLAINED: &str = "scenario-a";
const EXPLAINED_AT: i32 = 39;
const SAMPLES: i32 = 50;

/// The instants of Figs. 5 and 9.
const INSTANTS: [i32; 6] = [0, 4, 9, 39, 79, 119];

fn draw(source: &Source, paper: Option<&Paper>) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    if let Some(run) = source.first_run("box", EXPLAINED)? {
        let at = |of| source.instants("box", EXPLAINED, of, EXPLAINED_AT, SAMPLES);
        figures.push(Figure {
            experiment: None,
            name: "Fig. 1".into(),
            title: "The estimate of the Kalman filter, with possible states".to_owned(),
            drawing: ellipse_with_states(&run, &at(KALMAN)?),
        });
        figures.push(Figure {
            experiment: None,
            name: "Fig. 2".into(),
            title: "The estimate of Box-State-Est, with possible states".to_owned(),
            drawing: box_with_states(&run, &at(BOX)?),
        });
    }
    for (experiment, scenario, names) in [
        ("scenario-a", "scenario A", ["Fig. 3", "Fig. 4", "Fig. 5"]),
        ("scenario-b", "scenario B", ["Fig. 7", "Fig. 8", "Fig. 9"]),
    ] {
        let Some(run) = source.first_run("box", experiment)? else {
            continue;
        };
        if experiment == "scenario-b" {
            let system = paper.and_then(|p| p.experiments.iter().find(|e| e.id == experiment));
            figures.push(signals(&run, experiment, system.map(|e| &**e)));
        }
        let data = |queries: &[_]| Data::of("box", experiment, &run, queries);
        figures.push(Figure {
            experiment: None,
            name: names[0].into(),
            title: format!("States and their estimates, {scenario}"),
            drawing: Ok(states(&run, scenario, data(&[TRUTH, ESTIMATES]))),
        });
        figures.push(Figure {
            experiment: None,
            name: names[1].into(),
            title: format!("Estimation errors, {scenario}"),
            drawing: Ok(errors(&run, scenario, data(&[TRUTH, ESTIMATES]))),
        });
        figures.push(Figure {
            experiment: None,
            name: names[2].into(),
            title: format!("Boxes and confidence ellipses, {scenario}"),
            drawing: sets(&run, scenario, data(&[TRUTH, ESTIMATES, COVARIANCES])),
        });
    }
    Ok(figures)
}

/// The picture of Figs. 1 and 2: a set, the estimate in it and possible states, in the paper's colours but for the
/// magenta.
fn explained(
    run: &FirstRun,
    title: &str,
    set: Vec<[f64; 2]>,
    set_label: &str,
    center: [f64; 2],
    states: Vec<[f64; 2]>,
) -> svg::Figure {
    let axis = |i: usize| {
        let (name, unit) = &run.states[i];
        Axis::new(name, unit)
    };
    let marks = |label: &str, colour, marker, points| Series::Points {
        label: label.to_owned(),
        colour,
        marker,
        points,
    };
    let panel = Panel {
        x: axis(0),
        y: axis(1),
        series: vec![
            Series::Polygon {
                label: set_label.to_owned(),
                colour: Colour::Purple,
                filled: true,
                vertices: set,
            },
            marks("possible states", Colour::Blue, Marker::Dot, states),
            marks("estimate", Colour::Vermilion, Marker::Cross, vec![center]),
        ],
        ..Panel::default()
    };
    svg::Figure {
        title: title.to_owned(),
        columns: 1,
        panels: vec![panel],
        ..svg::Figure::default()
    }
}

/// What the figure was drawn from: one step of the first runs.
fn of_the_first_runs(run: &FirstRun, queries: &[(&str, &str, &str)]) -> Data {
    let mut data = Data::of("box", EXPLAINED, run, queries);
    for sql in &mut data.sql {
        *sql = sql.replace(" AND run = 0", &format!(" AND run < {SAMPLES}"));
    }
    data
}

/// Two numbers of two components.
fn pair(x: &[f64]) -> Option<[f64; 2]> {
    x.try_into().ok()
}

/// Fig. 1: the errors of 50 runs about the estimate of run 0, whose covariance is that of every run.
fn ellipse_with_states(run: &FirstRun, instants: &[Instant]) -> Result<Drawing, String> {
    let nothing = || format!("the run does not reach k = {EXPLAINED_AT}");
    let level = 0.9;
    let first = instants.first().ok_or_else(nothing)?;
    let center = pair(&first.center).ok_or_else(nothing)?;
    let Some(&[p11, p12, p21, p22]) = run.covariance(KALMAN.0, KALMAN.1, EXPLAINED_AT) else {
        return Err(nothing());
    };
    let radius = chi_square_isf(1.0 - level, 2).expect("0 < 1 - p < 1 and two degrees of freedom");
    let errors: Vec<[f64; 2]> = instants
        .iter()
        .filter_map(|at| {
            Some([
                at.state.first()? - at.center.first()?,
                at.state.get(1)? - at.center.get(1)?,
            ])
        })
        .collect();
    let determinant = p11 * p22 - p12 * p21;
    let inside = errors
        .iter()
        .filter(|[a, b]| (p22 * a * a - (p12 + p21) * a * b + p11 * b * b) / determinant <= radius);
    let caption = format!(
        "In the paper: estimate a red cross, confidence ellipsoid of probability 0.9 magenta, some possible states blue \
         stars, at a step that it does not name. Here the prediction x̂_{{k|k−1}} of the Kalman filter at k = {EXPLAINED_AT} \
         of scenario A, and as possible states that estimate plus the errors of {} runs, whose covariance is the same: {} of \
         them are in the ellipse.",
        errors.len(),
        inside.count()
    );
    let outline = ellipse(
        center,
        [[radius * p11, radius * p12], [radius * p21, radius * p22]],
    );
    let states = errors.iter().map(|e| [center[0] + e[0], center[1] + e[1]]);
    let title = "Estimate and confidence ellipse of the Kalman filter";
    Ok(Drawing {
        below: Vec::new(),
        svg: explained(
            run,
            title,
            outline,
            "confidence ellipse, p = 0.9",
            center,
            states.collect(),
        )
        .to_svg(),
        caption,
        data: of_the_first_runs(
            run,
            &[
                ("run, component, value", "truth", "k = 39"),
                (
                    "run, component, center",
                    "estimates",
                    "k = 39 AND estimator = 'kalman' AND phase = 'predicted'",
                ),
                (
                    "run, covariance",
                    "beliefs",
                    "k = 39 AND estimator = 'kalman' AND phase = 'predicted'",
                ),
            ],
        ),
    })
}

/// Fig. 2: the states of 50 runs, each at its place in its own box.
fn box_with_states(run: &FirstRun, instants: &[Instant]) -> Result<Drawing, String> {
    let nothing = || format!("the run does not reach k = {EXPLAINED_AT}");
    let first = instants.first().ok_or_else(nothing)?;
    let (center, low, high) = pair(&first.center)
        .zip(pair(&first.lower).zip(pair(&first.upper)))
        .map(|(center, (low, high))| (center, low, high))
        .ok_or_else(nothing)?;
    // From 0 at the lower end to 1 at the upper one.
    let place = |at: &Instant, i: usize| {
        let (lower, upper) = (at.lower.get(i)?, at.upper.get(i)?);
        Some((at.state.get(i)? - lower) / (upper - lower))
    };
    let places: Vec<[f64; 2]> = instants
        .iter()
        .filter_map(|at| Some([place(at, 0)?, place(at, 1)?]))
        .collect();
    let inside = places
        .iter()
        .filter(|p| p.iter().all(|x| (0.0..=1.0).contains(x)))
        .count();
    let caption = format!(
        "In the paper: estimate a red cross, enclosure a magenta box, some possible states blue stars, at a step that it \
         does not name. Here [x_k] and its midpoint at k = {EXPLAINED_AT} of scenario A, and as possible states those of {} \
         runs, each at its place in its own box: {inside} of them are in it.",
        places.len()
    );
    let states = places.iter().map(|p| {
        [
            low[0] + p[0] * (high[0] - low[0]),
            low[1] + p[1] * (high[1] - low[1]),
        ]
    });
    let title = "Estimate and enclosure of Box-State-Est";
    Ok(Drawing {
        below: Vec::new(),
        svg: explained(
            run,
            title,
            rectangle(low, high),
            "box of Box-State-Est",
            center,
            states.collect(),
        )
        .to_svg(),
        caption,
        data: of_the_first_runs(
            run,
            &[
                ("run, component, value", "truth", "k = 39"),
                (
                    "run, component, center, lower, upper",
                    "estimates",
                    "k = 39 AND estimator = 'box-state-est' AND phase = 'updated'",
                ),
            ],
        ),
    })
}

fn points(values: &BTreeMap<i32, f64>) -> Vec<[f64; 2]> {
    values
        .iter()
        .map(|(k, value)| [f64::from(*k), *value])
        .collect()
}

fn steps() -> Axis {
    Axis::new("step k", "")
}

/// Figs. 3 and 7.
fn states(run: &FirstRun, scenario: &str, data: Data) -> Drawing {
    let panels = run.states.iter().map(|(name, unit)| {
        let kalman = run.trail(KALMAN.0, KALMAN.1, name);
        let estimate = run.trail(BOX.0, BOX.1, name);
        let (lower, upper) = (points(&estimate.lower), points(&estimate.upper));
        let band = lower
            .iter()
            .zip(&upper)
            .map(|(l, u)| [l[0], l[1], u[1]])
            .collect();
        let enclosure = "box of Box-State-Est";
        let line = |colour, label: &str, points| Series::Line {
            label: label.to_owned(),
            colour,
            points,
        };
        Panel {
            x: steps(),
            y: Axis::new(name, unit),
            series: vec![
                Series::Band {
                    label: enclosure.to_owned(),
                    colour: Colour::Grey,
                    points: band,
                },
                line(Colour::Black, enclosure, lower),
                line(Colour::Black, enclosure, upper),
                line(Colour::Blue, "state", points(run.state(name))),
                Series::Dashes {
                    label: "Kalman prediction".to_owned(),
                    colour: Colour::Vermilion,
                    points: points(&kalman.center),
                },
                Series::Points {
                    label: "midpoint of the box".to_owned(),
                    colour: Colour::Green,
                    marker: Marker::Dot,
                    points: points(&estimate.center),
                },
            ],
            ..Panel::default()
        }
    });
    let figure = svg::Figure {
        title: format!("States, Kalman prediction and box, {scenario}"),
        columns: 1,
        panels: panels.collect(),
        ..svg::Figure::default()
    };
    let all = 0..=run.last();
    let inside = all
        .clone()
        .filter(|k| run.is_inside(BOX.0, BOX.1, *k))
        .count();
    let outside: Vec<i32> = all
        .filter(|k| {
            run.states.iter().any(|(name, _)| {
                let estimate = run.trail(BOX.0, BOX.1, name);
                let center = run.trail(KALMAN.0, KALMAN.1, name).center.get(k);
                match (center, estimate.lower.get(k), estimate.upper.get(k)) {
                    (Some(c), Some(lower), Some(upper)) => c < lower || upper < c,
                    _ => false,
                }
            })
        })
        .collect();
    let caption = format!(
        "In the paper: states continuous blue, Kalman estimate dashed red, midpoint of the box dotted green, the box \
         bold black; so here. The Kalman estimate is the prediction x̂_{{k|k−1}}. The state is in the box at {inside} of \
         {} steps; steps at which the Kalman prediction is outside of the box: {}.",
        run.last() + 1,
        at_steps(&outside)
    );
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data,
    }
}

/// x − x̂ by k.
fn error(run: &FirstRun, (estimator, phase): (&str, &str), component: &str) -> BTreeMap<i32, f64> {
    let center = &run.trail(estimator, phase, component).center;
    let state = run.state(component);
    center
        .iter()
        .filter_map(|(k, c)| Some((*k, state.get(k)? - c)))
        .collect()
}

/// Root mean square of the errors from k = 1.
fn rms(errors: &BTreeMap<i32, f64>) -> f64 {
    let from_1: Vec<f64> = errors.range(1..).map(|(_, e)| e * e).collect();
    (from_1.iter().sum::<f64>() / from_1.len().max(1) as f64).sqrt()
}

/// Figs. 4 and 8.
fn errors(run: &FirstRun, scenario: &str, data: Data) -> Drawing {
    let panels = run.states.iter().map(|(name, unit)| Panel {
        x: steps(),
        y: Axis::new(&format!("error in {name}"), unit),
        series: vec![
            Series::Line {
                label: "state − Kalman prediction".to_owned(),
                colour: Colour::Vermilion,
                points: points(&error(run, KALMAN, name)),
            },
            Series::Dashes {
                label: "state − midpoint of the box".to_owned(),
                colour: Colour::Blue,
                points: points(&error(run, BOX, name)),
            },
        ],
        ..Panel::default()
    });
    let figure = svg::Figure {
        title: format!("Estimation errors, {scenario}"),
        columns: 1,
        panels: panels.collect(),
        ..svg::Figure::default()
    };
    let measured = run.states.iter().map(|(name, _)| {
        let [kalman, midpoint, filtered] =
            [KALMAN, BOX, FILTERED].map(|of| four_digits(rms(&error(run, of, name))));
        format!("{name}: {kalman} and {midpoint} ({filtered} for the filtered estimate)")
    });
    let caption = format!(
        "In the paper: Kalman continuous red, box dashed blue; so here. RMSE over k ≥ 1 of the Kalman prediction, which \
         has not used y_k, and of the midpoint, which has: {}. The filtered estimate x̂_{{k|k}}, which has used y_k too, is \
         not in the figure.",
        measured.collect::<Vec<_>>().join("; ")
    );
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data,
    }
}

/// Figs. 5 and 9.
fn sets(run: &FirstRun, scenario: &str, data: Data) -> Result<Drawing, String> {
    let [(first, first_unit), (second, second_unit)] = run.states.as_slice() else {
        return Err("the ellipses are drawn for two states".to_owned());
    };
    let levels = [0.99, 0.9];
    let radii = levels
        .map(|p| chi_square_isf(1.0 - p, 2).expect("0 < 1 - p < 1 and two degrees of freedom"));
    let mut within: [Vec<i32>; 2] = Default::default();
    let mut panels = Vec::new();
    for k in INSTANTS {
        let corner = |end: fn(&Trail) -> &BTreeMap<i32, f64>, of: (&str, &str)| {
            let at = |name: &str| end(run.trail(of.0, of.1, name)).get(&k).copied();
            Some([at(first)?, at(second)?])
        };
        let (Some(low), Some(high), Some(center), Some(&[p11, p12, p21, p22]), Some(x1), Some(x2)) = (
            corner(|t| &t.lower, BOX),
            corner(|t| &t.upper, BOX),
            corner(|t| &t.center, KALMAN),
            run.covariance(KALMAN.0, KALMAN.1, k),
            run.state(first).get(&k),
            run.state(second).get(&k),
        ) else {
            continue;
        };
        let outline = |radius: f64| {
            ellipse(
                center,
                [[radius * p11, radius * p12], [radius * p21, radius * p22]],
            )
        };
        for (radius, within) in radii.iter().zip(&mut within) {
            let reach = [(radius * p11).sqrt(), (radius * p22).sqrt()];
            if (0..2).all(|i| low[i] <= center[i] - reach[i] && center[i] + reach[i] <= high[i]) {
                within.push(k);
            }
        }
        // A dot in a ring is seen on an edge too.
        let state = |marker| Series::Points {
            label: "state".to_owned(),
            colour: Colour::Black,
            marker,
            points: vec![[*x1, *x2]],
        };
        let mut dashed = outline(radii[1]);
        dashed.extend(dashed.first().copied());
        panels.push(Panel {
            title: format!("k = {k}"),
            x: Axis::new(first, first_unit),
            y: Axis::new(second, second_unit),
            series: vec![
                Series::Polygon {
                    label: "box of Box-State-Est".to_owned(),
                    colour: Colour::Blue,
                    filled: true,
                    vertices: rectangle(low, high),
                },
                Series::Polygon {
                    label: "Kalman ellipse, p = 0.99".to_owned(),
                    colour: Colour::Vermilion,
                    filled: false,
                    vertices: outline(radii[0]),
                },
                Series::Dashes {
                    label: "p = 0.9".to_owned(),
                    colour: Colour::Vermilion,
                    points: dashed,
                },
                state(Marker::Ring),
                state(Marker::Dot),
            ],
            equal: false,
        });
    }
    let shown = panels.len();
    if shown == 0 {
        return Err("the run has none of the steps that the figure shows".to_owned());
    }
    let figure = svg::Figure {
        title: format!("Box and Kalman confidence ellipse at six instants, {scenario}"),
        columns: 3,
        panels,
        ..svg::Figure::default()
    };
    let caption = format!(
        "Ellipses of the Kalman prediction (x̂_{{k|k−1}}, G_{{k|k−1}}): the caption of the paper has p = 0.99, the text of \
         Section IV-A 0.9, so both are drawn. Axes differ from panel to panel. Of the {shown} ellipses inside their box: with \
         p = 0.99 {}; with p = 0.9 {}.",
        at_steps(&within[0]),
        at_steps(&within[1])
    );
    Ok(Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data,
    })
}

/// Fig. 6: d_k = x_{k+1} − f(x_k, 0) and v_k = y_k − h(x_k, 0), from what the lake holds of x and y.
fn signals(run: &FirstRun, experiment: &str, published: Option<&Experiment>) -> Figure {
    let figure = |drawing| Figure {
        experiment: None,
        name: "Fig. 6".into(),
        title: "Disturbances and measurement noise, scenario B".to_owned(),
        drawing,
    };
    let Some(published) = published else {
        return figure(Err(
            "the experiment is not one that comes with this program".to_owned(),
        ));
    };
    let system = &published.problem.system;
    let variables = system.variables();
    let [n, n_w, n_v] = [&variables.x, &variables.w, &variables.v].map(Vec::len);
    let at = |values: &BTreeMap<String, BTreeMap<i32, f64>>, names: &[Variable], k: i32| {
        names
            .iter()
            .map(|v| values.get(&v.name)?.get(&k).copied())
            .collect::<Option<Vec<f64>>>()
    };
    let mut d = vec![Vec::new(); n];
    let mut v = Vec::new();
    for k in 0..=run.last() {
        let Some(x) = at(&run.truth, &variables.x, k) else {
            continue;
        };
        let step = f64::from(k);
        let mut next = vec![0.0; n];
        system.f(k as usize, &x, &[], &vec![0.0; n_w], &mut next);
        if let Some(after) = at(&run.truth, &variables.x, k + 1) {
            for (signal, (after, next)) in d.iter_mut().zip(after.iter().zip(&next)) {
                signal.push([step, after - next]);
            }
        }
        let mut y = vec![0.0; variables.y.len()];
        system.h(k as usize, &x, &[], &vec![0.0; n_v], &mut y);
        if let Some(measured) = at(&run.measured, &variables.y, k) {
            v.extend(measured.first().zip(y.first()).map(|(m, y)| [step, m - y]));
        }
    }
    let names = d
        .iter()
        .enumerate()
        .map(|(i, _)| format!("d{}", i + 1))
        .chain(["v".to_owned()]);
    let panels = names
        .zip(d.iter().chain([&v]))
        .enumerate()
        .map(|(i, (name, points))| Panel {
            x: steps(),
            y: Axis {
                min: Some(-1.2),
                max: Some(1.2),
                ..Axis::new(&name, "1")
            },
            series: vec![Series::Line {
                label: String::new(),
                colour: Colour::nth(i),
                points: points.clone(),
            }],
            ..Panel::default()
        });
    let drawn = svg::Figure {
        title: "State disturbances d and measurement noise v, scenario B".to_owned(),
        columns: 3,
        panels: panels.collect(),
        ..svg::Figure::default()
    };
    let measurements = ("k, component, value", "measurements", "");
    figure(Ok(Drawing {
below: Vec::new(),
        svg: drawn.to_svg(),
        caption: "The paper's signals are in its Fig. 6 alone, which the text at hand has not. These are chosen so that the \
                  Kalman estimate leaves the box at the steps that the paper names: d1 a saw, d2 and v a square, all of \
                  period 40. Computed from what was \
                  simulated: d_k = x_{k+1} − A x_k, v_k = y_k − C x_k."
            .to_owned(),
        data: Data::of("box", experiment, run, &[TRUTH, measurements]),
    }))
}
