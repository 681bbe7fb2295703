//! Figs. 1 to 9 of [MeslemRamdani].

use super::{Context, Drawn, no_run};
use crate::figures::{Data, Drawing, at_steps};
use crate::source::{FirstRun, Instant, Trail};
use crate::svg::{self, Axis, Colour, Marker, Panel, Series, ellipse, rectangle};
use std::collections::BTreeMap;
use zonobench_lab::illustrate;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_sets::ellipsoid::chi_square_isf;

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

/// Figs. 1 and 2 explain what an estimator gives, at no step that they name: here at this one, with the states of so many
/// runs.
const EXPLAINED_AT: i32 = 39;
const SAMPLES: i32 = 50;

/// The instants of Figs. 5 and 9.
const INSTANTS: [i32; 6] = [0, 4, 9, 39, 79, 119];

/// Fig. 1: the errors of so many runs about the estimate of run 0.
pub fn ellipse_with_states(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    let instants = of.instants(KALMAN, EXPLAINED_AT, SAMPLES)?;
    Ok(Some(around_ellipse(of, &run, &instants)))
}

/// Fig. 2: the states of so many runs, each at its place in its own box.
pub fn box_with_states(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    let instants = of.instants(BOX, EXPLAINED_AT, SAMPLES)?;
    Ok(Some(around_box(of, &run, &instants)))
}

/// The picture of Figs. 1 and 2: a set, the estimate in it and possible states, in the paper's colours but for the
/// magenta.
fn explained(
    of: &Context,
    run: &FirstRun,
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
    of.spec.figure(1, vec![panel])
}

/// What the figure was drawn from: one step of the first runs.
fn of_the_first_runs(of: &Context, run: &FirstRun, queries: &[(&str, &str, &str)]) -> Data {
    let mut data = of.data(run, queries);
    for sql in &mut data.sql {
        *sql = sql.replace(" AND run = 0", &format!(" AND run < {SAMPLES}"));
    }
    data
}

/// Two numbers of two components.
fn pair(x: &[f64]) -> Option<[f64; 2]> {
    x.try_into().ok()
}

/// The errors about the estimate of run 0, whose covariance is that of every run.
fn around_ellipse(of: &Context, run: &FirstRun, instants: &[Instant]) -> Result<Drawing, String> {
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
    let facts = [
        ("runs", errors.len().to_string()),
        ("inside", inside.count().to_string()),
    ];
    let outline = ellipse(
        center,
        [[radius * p11, radius * p12], [radius * p21, radius * p22]],
    );
    let states = errors.iter().map(|e| [center[0] + e[0], center[1] + e[1]]);
    Ok(Drawing {
        svg: explained(
            of,
            run,
            outline,
            "confidence ellipse, p = 0.9",
            center,
            states.collect(),
        )
        .to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of_the_first_runs(
            of,
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

/// The states, each at its place in its own box.
fn around_box(of: &Context, run: &FirstRun, instants: &[Instant]) -> Result<Drawing, String> {
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
    let facts = [
        ("runs", places.len().to_string()),
        ("inside", inside.to_string()),
    ];
    let states = places.iter().map(|p| {
        [
            low[0] + p[0] * (high[0] - low[0]),
            low[1] + p[1] * (high[1] - low[1]),
        ]
    });
    Ok(Drawing {
        svg: explained(
            of,
            run,
            rectangle(low, high),
            "box of Box-State-Est",
            center,
            states.collect(),
        )
        .to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of_the_first_runs(
            of,
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
pub fn states(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
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
    let figure = of.spec.figure(1, panels.collect());
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
    let facts = [
        ("inside", inside.to_string()),
        ("steps", (run.last() + 1).to_string()),
        ("outside", at_steps(&outside)),
    ];
    Ok(Some(Ok(Drawing {
        svg: figure.to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(run, &[TRUTH, ESTIMATES]),
    })))
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
pub fn errors(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
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
    let figure = of.spec.figure(1, panels.collect());
    let measured = run.states.iter().map(|(name, _)| {
        let [kalman, midpoint, filtered] =
            [KALMAN, BOX, FILTERED].map(|of| four_digits(rms(&error(run, of, name))));
        format!("{name}: {kalman} and {midpoint} ({filtered} for the filtered estimate)")
    });
    let facts = [("errors", measured.collect::<Vec<_>>().join("; "))];
    Ok(Some(Ok(Drawing {
        svg: figure.to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(run, &[TRUTH, ESTIMATES]),
    })))
}

/// Figs. 5 and 9.
pub fn sets(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    Ok(Some(sets_of(of, &run)))
}

fn sets_of(of: &Context, run: &FirstRun) -> Result<Drawing, String> {
    if run.states.len() != 2 {
        return Err("the ellipses are drawn for two states".to_owned());
    }
    let radii = [0.99, 0.9]
        .map(|p| chi_square_isf(1.0 - p, 2).expect("0 < 1 - p < 1 and two degrees of freedom"));
    let sets: Vec<SetsAt> = INSTANTS
        .iter()
        .filter_map(|k| SetsAt::of(run, *k))
        .collect();
    if sets.is_empty() {
        return Err("the run has none of the steps that the figure shows".to_owned());
    }
    let within = radii.map(|radius| {
        let inside = sets.iter().filter(|at| at.is_ellipse_inside(radius));
        at_steps(&inside.map(|at| at.k).collect::<Vec<_>>())
    });
    let [wide, narrow] = within;
    let facts = [
        ("shown", sets.len().to_string()),
        ("wide", wide),
        ("narrow", narrow),
    ];
    let panels = sets.iter().map(|at| at.panel(run, radii)).collect();
    Ok(Drawing {
        svg: of.spec.figure(3, panels).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: of.data(run, &[TRUTH, ESTIMATES, COVARIANCES]),
    })
}

/// Box, estimate, covariance and state of one step.
struct SetsAt {
    k: i32,
    low: [f64; 2],
    high: [f64; 2],
    center: [f64; 2],
    covariance: [[f64; 2]; 2],
    state: [f64; 2],
}

impl SetsAt {
    fn of(run: &FirstRun, k: i32) -> Option<Self> {
        let both =
            |at: &dyn Fn(&str) -> Option<f64>| Some([at(&run.states[0].0)?, at(&run.states[1].0)?]);
        let corner = |end: fn(&Trail) -> &BTreeMap<i32, f64>, by: (&str, &str)| {
            both(&|name| end(run.trail(by.0, by.1, name)).get(&k).copied())
        };
        let &[p11, p12, p21, p22] = run.covariance(KALMAN.0, KALMAN.1, k)? else {
            return None;
        };
        Some(Self {
            k,
            low: corner(|t| &t.lower, BOX)?,
            high: corner(|t| &t.upper, BOX)?,
            center: corner(|t| &t.center, KALMAN)?,
            covariance: [[p11, p12], [p21, p22]],
            state: both(&|name| run.state(name).get(&k).copied())?,
        })
    }

    /// Whether the level set of this radius is in the box.
    fn is_ellipse_inside(&self, radius: f64) -> bool {
        (0..2).all(|i| {
            let reach = (radius * self.covariance[i][i]).sqrt();
            self.low[i] <= self.center[i] - reach && self.center[i] + reach <= self.high[i]
        })
    }

    fn panel(&self, run: &FirstRun, radii: [f64; 2]) -> Panel {
        let [wide, mut narrow] = radii.map(|radius| {
            let scaled = self.covariance.map(|row| row.map(|p| radius * p));
            ellipse(self.center, scaled)
        });
        narrow.extend(narrow.first().copied());
        // A dot in a ring is seen on an edge too.
        let state = |marker| Series::Points {
            label: "state".to_owned(),
            colour: Colour::Black,
            marker,
            points: vec![self.state],
        };
        let axis = |i: usize| {
            let (name, unit) = &run.states[i];
            Axis::new(name, unit)
        };
        Panel {
            title: format!("k = {}", self.k),
            x: axis(0),
            y: axis(1),
            series: vec![
                Series::Polygon {
                    label: "box of Box-State-Est".to_owned(),
                    colour: Colour::Blue,
                    filled: true,
                    vertices: rectangle(self.low, self.high),
                },
                Series::Polygon {
                    label: "Kalman ellipse, p = 0.99".to_owned(),
                    colour: Colour::Vermilion,
                    filled: false,
                    vertices: wide,
                },
                Series::Dashes {
                    label: "p = 0.9".to_owned(),
                    colour: Colour::Vermilion,
                    points: narrow,
                },
                state(Marker::Ring),
                state(Marker::Dot),
            ],
            equal: false,
        }
    }
}

/// Fig. 6: d_k = x_{k+1} − f(x_k, 0) and v_k = y_k − h(x_k, 0), from what the lake holds of x and y.
pub fn signals(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
    let Some(published) = of.published() else {
        let why = "the experiment is not one that comes with this program";
        return Ok(Some(Err(why.to_owned())));
    };
    let (states, outputs) = (
        illustrate::states(published),
        illustrate::outputs(published),
    );
    let at = |values: &BTreeMap<String, BTreeMap<i32, f64>>, names: &[String], k: i32| {
        let value = |name: &String| values.get(name)?.get(&k).copied();
        names.iter().map(value).collect::<Option<Vec<f64>>>()
    };
    let mut d = vec![Vec::new(); states.len()];
    let mut v = Vec::new();
    for k in 0..=run.last() {
        let Some(x) = at(&run.truth, &states, k) else {
            continue;
        };
        let step = f64::from(k);
        let next = illustrate::next(published, k as usize, &x);
        if let Some(after) = at(&run.truth, &states, k + 1) {
            for (signal, (after, next)) in d.iter_mut().zip(after.iter().zip(&next)) {
                signal.push([step, after - next]);
            }
        }
        let y = illustrate::output(published, k as usize, &x);
        if let Some(measured) = at(&run.measured, &outputs, k) {
            v.extend(measured.first().zip(y.first()).map(|(m, y)| [step, m - y]));
        }
    }
    let names = (1..=d.len()).map(|i| format!("d{i}"));
    let panels = names
        .chain(["v".to_owned()])
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
    let measurements = ("k, component, value", "measurements", "");
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(3, panels.collect()).to_svg(),
        caption: of.spec.told(&[]),
        below: Vec::new(),
        data: of.data(run, &[TRUTH, measurements]),
    })))
}
