//! Figs. 2 and 3 of [Li], and what its sets and guaranteed ones do under admissible noise.

use super::{Context, Drawn, no_run};
use crate::figures::{Data, Drawing};
use crate::source::FirstRun;
use crate::svg::{Axis, Colour, Panel, Series};
use std::collections::BTreeMap;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_sets::se2::wrap;

/// Every how many steps a curve has a point.
const STRIDE: i32 = 4;

/// (estimator, label, colour) of the readings that the paper's figures show.
const SHOWN: [(&str, &str, Colour); 2] = [
    ("zsmf-tables", "ZSMF", Colour::Blue),
    ("inzsmf-tables", "InZSMF", Colour::Vermilion),
];

/// (k, value) every [`STRIDE`] steps.
fn thinned(values: impl Iterator<Item = (i32, f64)>) -> Vec<[f64; 2]> {
    values
        .filter(|(k, _)| k % STRIDE == 0)
        .map(|(k, x)| [f64::from(k), x])
        .collect()
}

/// The wrapped error of the heading by k.
fn heading_errors(run: &FirstRun, estimator: &str) -> BTreeMap<i32, f64> {
    let truth = run.state("theta");
    let trail = run.trail(estimator, "predicted", "theta");
    let error = |(k, c): (&i32, &f64)| Some((*k, wrap(c - truth.get(k)?)));
    trail.center.iter().filter_map(error).collect()
}

/// The squared error of the position by k.
fn position_errors(run: &FirstRun, estimator: &str) -> BTreeMap<i32, f64> {
    let [x, y] =
        ["x1", "x2"].map(|name| (run.trail(estimator, "predicted", name), run.state(name)));
    let square = |k: &i32| {
        let [dx, dy] = [&x, &y].map(|(trail, truth)| Some(trail.center.get(k)? - truth.get(k)?));
        let (dx, dy) = (dx?, dy?);
        Some((*k, dx * dx + dy * dy))
    };
    x.0.center.keys().filter_map(square).collect()
}

/// √(mean up to k of the squares), from k = 1.
fn running(squares: impl Iterator<Item = (i32, f64)>) -> Vec<[f64; 2]> {
    let (mut sum, mut count) = (0.0, 0.0);
    let means = squares.filter(|(k, _)| *k > 0).map(|(k, square)| {
        sum += square;
        count += 1.0;
        (k, f64::sqrt(sum / count))
    });
    thinned(means.collect::<Vec<_>>().into_iter())
}

fn trajectories(title: &str, run: &FirstRun, shown: &[(&str, &str, Colour)]) -> Panel {
    let mut series: Vec<Series> = shown
        .iter()
        .map(|(estimator, label, colour)| {
            let [x, y] = ["x1", "x2"].map(|name| &run.trail(estimator, "predicted", name).center);
            let points = x.iter().filter(|(k, _)| *k % STRIDE == 0);
            Series::Line {
                label: (*label).to_owned(),
                colour: *colour,
                points: points.filter_map(|(k, x)| Some([*x, *y.get(k)?])).collect(),
            }
        })
        .collect();
    let (x, y) = (run.state("x1"), run.state("x2"));
    let points = x.iter().filter(|(k, _)| *k % STRIDE == 0);
    series.push(Series::Dashes {
        label: "true state".to_owned(),
        colour: Colour::Black,
        points: points.filter_map(|(k, x)| Some([*x, *y.get(k)?])).collect(),
    });
    Panel {
        title: title.to_owned(),
        x: Axis::new("x1", "m"),
        y: Axis::new("x2", "m"),
        series,
        equal: true,
    }
}

/// The error of the heading and ± its half-width.
fn headings(title: &str, run: &FirstRun, shown: &[(&str, &str, Colour)]) -> Panel {
    let mut series = Vec::new();
    for (estimator, label, colour) in shown {
        let trail = run.trail(estimator, "predicted", "theta");
        let half = |(k, upper): (&i32, &f64)| Some((*k, 0.5 * (upper - trail.lower.get(k)?)));
        let halves: Vec<[f64; 2]> = thinned(trail.upper.iter().filter_map(half));
        series.push(Series::Band {
            label: format!("{label}, bounds"),
            colour: *colour,
            points: halves.iter().map(|p| [p[0], -p[1], p[1]]).collect(),
        });
    }
    for (estimator, label, colour) in shown {
        series.push(Series::Line {
            label: (*label).to_owned(),
            colour: *colour,
            points: thinned(heading_errors(run, estimator).into_iter()),
        });
    }
    Panel {
        title: title.to_owned(),
        x: Axis::new("step k", ""),
        y: Axis::new("error of theta", "rad"),
        series,
        ..Panel::default()
    }
}

fn running_panel(title: &str, unit: &str, run: &FirstRun, heading: bool) -> Panel {
    let series = SHOWN.iter().map(|(estimator, label, colour)| {
        let squares: BTreeMap<i32, f64> = if heading {
            heading_errors(run, estimator)
                .into_iter()
                .map(|(k, e)| (k, e * e))
                .collect()
        } else {
            position_errors(run, estimator)
        };
        Series::Line {
            label: (*label).to_owned(),
            colour: *colour,
            points: running(squares.into_iter()),
        }
    });
    Panel {
        title: title.to_owned(),
        x: Axis::new("step k", ""),
        y: Axis::new("RMSE up to k", unit),
        series: series.collect(),
        ..Panel::default()
    }
}

fn last_value(points: &[[f64; 2]]) -> String {
    points
        .last()
        .map_or_else(|| "nothing".to_owned(), |p| four_digits(p[1]))
}

fn data(of: &Context, experiment: &str, run: &FirstRun, estimators: &[&str]) -> Data {
    let list: Vec<String> = estimators.iter().map(|e| format!("'{e}'")).collect();
    let condition = format!("phase = 'predicted' AND estimator IN ({})", list.join(", "));
    Data::of(
        of.paper,
        experiment,
        run,
        &[
            ("k, component, value", "truth", ""),
            (
                "estimator, k, component, center, lower, upper",
                "estimates",
                &condition,
            ),
        ],
    )
}

/// The experiment of the second column or row of Figs. 2 and 3, which the first experiment is drawn with.
fn pair(of: &Context, second: &str) -> Result<Option<[FirstRun; 2]>, Error> {
    let runs = (of.run()?, of.run_of(second)?);
    Ok(match runs {
        (Some(first), Some(second)) => Some([first, second]),
        _ => None,
    })
}

/// Fig. 2.
pub fn comparison(of: &Context) -> Result<Drawn, Error> {
    const FROM_BAD: &str = "table-1_row6";
    let Some([first, bad]) = &pair(of, FROM_BAD)? else {
        return no_run();
    };
    let columns = [(first, "(pi/2, 0, 0)"), (bad, "(0, 5, 5)")];
    let mut panels = Vec::new();
    panels.extend(columns.map(|(run, from)| trajectories(&format!("from {from}"), run, &SHOWN)));
    panels.extend(columns.map(|(run, from)| headings(&format!("from {from}"), run, &SHOWN)));
    panels.extend(columns.map(|(run, _)| running_panel("heading", "rad", run, true)));
    panels.extend(columns.map(|(run, _)| running_panel("position", "m", run, false)));
    let end = |estimator: &str| last_value(&running(position_errors(bad, estimator).into_iter()));
    let facts = [
        ("zsmf", end("zsmf-tables")),
        ("inzsmf", end("inzsmf-tables")),
    ];
    let estimators = SHOWN.map(|(estimator, _, _)| estimator);
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(2, panels).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: Data::joined(
            data(of, &of.spec.experiment, first, &estimators),
            data(of, FROM_BAD, bad, &estimators),
        ),
    })))
}

/// Fig. 3.
pub fn gains(of: &Context) -> Result<Drawn, Error> {
    const BY_RADIUS: &str = "table-1_row7";
    let Some([poles, radius]) = &pair(of, BY_RADIUS)? else {
        return no_run();
    };
    let rows = [(poles, "poles"), (radius, "F-radius")];
    let panels = rows.iter().flat_map(|(run, gain)| {
        let title = format!("gain from {gain}");
        [
            trajectories(&title, run, &SHOWN),
            headings(&title, run, &SHOWN),
        ]
    });
    // When the error of InZSMF's heading is first small, and how far it then goes to the other side.
    let course = |run: &FirstRun| {
        let errors = heading_errors(run, "inzsmf-tables");
        let first = errors.get(&0).copied().unwrap_or(0.0);
        let reached = errors.iter().find(|(_, e)| e.abs() < 0.1);
        let beyond = errors.values().map(|e| -e * first.signum());
        format!(
            "below 0.1 rad first at k = {}, and goes {} rad to the other side",
            reached.map_or_else(|| "never".to_owned(), |(k, _)| k.to_string()),
            four_digits(beyond.fold(0.0, f64::max)),
        )
    };
    let facts = [("poles", course(poles)), ("radius", course(radius))];
    let estimators = SHOWN.map(|(estimator, _, _)| estimator);
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(2, panels.collect()).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: Data::joined(
            data(of, &of.spec.experiment, poles, &estimators),
            data(of, BY_RADIUS, radius, &estimators),
        ),
    })))
}

/// The published sets and the guaranteed ones under a square wave across the direction of travel.
pub fn attacked(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
    let (published, enclosed) = (
        [("inzsmf-tables", "InZSMF as published", Colour::Vermilion)],
        [(
            "enclosed",
            "InZSMF with its remainder enclosed",
            Colour::Green,
        )],
    );
    let panels = vec![
        headings("as published", run, &published),
        headings("remainder enclosed, 120 generators", run, &enclosed),
    ];
    let outside = |estimator: &str| {
        let trail = run.trail(estimator, "predicted", "theta");
        let errors = heading_errors(run, estimator);
        let lost = errors.iter().filter(|(k, e)| {
            let ends = (trail.lower.get(k), trail.upper.get(k));
            matches!(ends, (Some(lower), Some(upper)) if e.abs() > 0.5 * (upper - lower))
        });
        format!("{} of {}", lost.count(), errors.len())
    };
    let facts = [
        ("published", outside("inzsmf-tables")),
        ("enclosed", outside("enclosed")),
    ];
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(2, panels).to_svg(),
        caption: of.spec.told(&facts),
        below: Vec::new(),
        data: data(of, &of.spec.experiment, run, &["inzsmf-tables", "enclosed"]),
    })))
}
