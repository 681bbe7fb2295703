//! inzsmf: Figs. 2 and 3 of [Li], and what its sets and guaranteed ones do under admissible noise.

use super::{About, Data, Drawing, Figure};
use crate::source::{FirstRun, Source};
use crate::svg::{self, Axis, Colour, Panel, Series};
use std::collections::BTreeMap;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_sets::se2::wrap;
use zonobench_verdicts::papers::Paper;

pub const ABOUT: About = About {
    folder: "inzsmf",
    says: "A vehicle in the plane knows its turn rate and its speed and measures its position; what is unknown is \
           bounded. **ZSMF** linearises at the estimate (θ̂, x̂) and keeps a zonotope of errors (θ − θ̂, x − x̂). \
           **InZSMF** takes the error on the group SE(2) instead, log(X̂⁻¹ X), whose motion does not depend on where \
           the vehicle is (Theorem 3.1). Both choose their gain by given poles (Algorithm 1) or by the least \
           F-radius (Algorithm 2), and both reduce the zonotope to 30 generators.\n\n\
           The paper finds that InZSMF is better in error and in area, up to 50 % from a bad initial estimate. \
           Its tables agree with a reduction that sums the dropped generators without absolute values, whose sets \
           enclose nothing, and with areas that are measured in different axes. What could be proved is \
           here too: an InZSMF that encloses what the linearisation drops.",
    not_drawn: "Fig. 1 explains how sets on the group and in its algebra belong together; it has no data to redraw.",
    draw,
};

/// Every how many steps a curve has a point.
const STRIDE: i32 = 4;

/// (estimator, label, colour) of the readings that the paper's figures show.
const SHOWN: [(&str, &str, Colour); 2] = [
    ("zsmf-tables", "ZSMF", Colour::Blue),
    ("inzsmf-tables", "InZSMF", Colour::Vermilion),
];

fn draw(source: &Source, _: Option<&Paper>) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    let (first, bad) = (run(source, "table-1_row1")?, run(source, "table-1_row6")?);
    if let (Some(first), Some(bad)) = (first, bad) {
        figures.push(Figure {
            experiment: None,
            name: "Fig. 2".into(),
            title: "From the true state, and from (0, 5, 5)".to_owned(),
            drawing: Ok(comparison(&first, &bad)),
        });
    }
    let (poles, radius) = (run(source, "table-2")?, run(source, "table-1_row7")?);
    if let (Some(poles), Some(radius)) = (poles, radius) {
        figures.push(Figure {
            experiment: None,
            name: "Fig. 3".into(),
            title: "Gains from poles and from the F-radius".to_owned(),
            drawing: Ok(gains(&poles, &radius)),
        });
    }
    if let Some(attack) = run(source, "attack_square")? {
        figures.push(Figure {
            experiment: None,
            name: "Not in the paper".into(),
            title: "Noise within its bounds".to_owned(),
            drawing: Ok(attacked(&attack)),
        });
    }
    Ok(figures)
}

fn run(source: &Source, experiment: &str) -> Result<Option<FirstRun>, Error> {
    source.first_run("inzsmf", experiment)
}

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

fn data(experiment: &str, run: &FirstRun, estimators: &[&str]) -> Data {
    let list: Vec<String> = estimators.iter().map(|e| format!("'{e}'")).collect();
    let condition = format!("phase = 'predicted' AND estimator IN ({})", list.join(", "));
    Data::of(
        "inzsmf",
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

/// `a` and what else was drawn from `b`.
fn joined(mut a: Data, b: Data) -> Data {
    a.experiment = format!("{} and {}", a.experiment, b.experiment);
    a.files.extend(b.files);
    a.sql.extend(b.sql);
    a
}

/// Fig. 2.
fn comparison(first: &FirstRun, bad: &FirstRun) -> Drawing {
    let columns = [(first, "(pi/2, 0, 0)"), (bad, "(0, 5, 5)")];
    let mut panels = Vec::new();
    panels.extend(columns.map(|(run, from)| trajectories(&format!("from {from}"), run, &SHOWN)));
    panels.extend(columns.map(|(run, from)| headings(&format!("from {from}"), run, &SHOWN)));
    panels.extend(columns.map(|(run, _)| running_panel("heading", "rad", run, true)));
    panels.extend(columns.map(|(run, _)| running_panel("position", "m", run, false)));
    let figure = svg::Figure {
        title: "ZSMF and InZSMF from a good and from a bad initial estimate".to_owned(),
        columns: 2,
        panels,
        ..svg::Figure::default()
    };
    let end = |estimator: &str| last_value(&running(position_errors(bad, estimator).into_iter()));
    let caption = format!(
        "In the paper: the left column from the true state, the right one from (0, 5, 5); trajectories, the error of \
         the heading and its bounds, and the RMSE of heading and position. Drawn is run 0 of the reading `paper-tables`, \
         which the paper's numbers follow from, with a point every {STRIDE} steps; the paper does not say whether its \
         RMSE is over the steps up to k or over its five runs, and here it is the former. The error of the heading is \
         wrapped: from (0, 5, 5) the estimate may settle a full turn away. At the end the RMSE of the position from \
         (0, 5, 5) is {} m for ZSMF and {} m for InZSMF in this run; the spread from run to run is as large as the \
         difference.",
        end("zsmf-tables"),
        end("inzsmf-tables"),
    );
    let estimators = SHOWN.map(|(estimator, _, _)| estimator);
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data: joined(
            data("table-1_row1", first, &estimators),
            data("table-1_row6", bad, &estimators),
        ),
    }
}

/// Fig. 3.
fn gains(poles: &FirstRun, radius: &FirstRun) -> Drawing {
    let rows = [(poles, "poles"), (radius, "F-radius")];
    let panels = rows.iter().flat_map(|(run, gain)| {
        let title = format!("gain from {gain}");
        [
            trajectories(&title, run, &SHOWN),
            headings(&title, run, &SHOWN),
        ]
    });
    let figure = svg::Figure {
        title: "Two gains, from (0, 5, -5)".to_owned(),
        columns: 2,
        panels: panels.collect(),
        ..svg::Figure::default()
    };
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
    let caption = format!(
        "In the paper: trajectories and errors of the heading from (0, 5, −5), with Algorithm 1 (above) and Algorithm 2; \
         the latter is said to converge faster, the former to overshoot less. Run 0 of the reading `paper-tables`, a \
         point every {STRIDE} steps. The error of InZSMF's heading is {} with poles, and {} with the F-radius gain.",
        course(poles),
        course(radius),
    );
    let estimators = SHOWN.map(|(estimator, _, _)| estimator);
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data: joined(
            data("table-2", poles, &estimators),
            data("table-1_row7", radius, &estimators),
        ),
    }
}

/// The published sets and the guaranteed ones under a square wave across the direction of travel.
fn attacked(run: &FirstRun) -> Drawing {
    let (published, enclosed) = (
        [("inzsmf-tables", "InZSMF as published", Colour::Vermilion)],
        [(
            "enclosed",
            "InZSMF with its remainder enclosed",
            Colour::Green,
        )],
    );
    let figure = svg::Figure {
        title: "The heading under a square wave of noise across the direction of travel".to_owned(),
        columns: 2,
        panels: vec![
            headings("as published", run, &published),
            headings("remainder enclosed, 120 generators", run, &enclosed),
        ],
        ..svg::Figure::default()
    };
    let outside = |estimator: &str| {
        let trail = run.trail(estimator, "predicted", "theta");
        let errors = heading_errors(run, estimator);
        let lost = errors.iter().filter(|(k, e)| {
            let ends = (trail.lower.get(k), trail.upper.get(k));
            matches!(ends, (Some(lower), Some(upper)) if e.abs() > 0.5 * (upper - lower))
        });
        format!("{} of {}", lost.count(), errors.len())
    };
    let caption = format!(
        "v is ±1 in each component across the direction of travel, its sign a square wave of 200 steps; w is on the \
         vertices of its box, and the initial estimate is exact. The heading leaves the published bounds at {} steps, \
         and those of the filter that encloses its remainder at {}.",
        outside("inzsmf-tables"),
        outside("enclosed"),
    );
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data: data("attack_square", run, &["inzsmf-tables", "enclosed"]),
    }
}
