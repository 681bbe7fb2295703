//! Figs. 5 to 7 of [Rego2020]: the quadrotor.

use super::{Data, Drawing, Figure};
use crate::source::{FirstRun, Source};
use crate::svg::{self, Axis, Colour, Panel, Series};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;

/// The experiment that is drawn.
const FLIGHT: &str = "quadrotor-flight";

/// The flight of CZFO as printed: the same data, 40 generators, 12 constraints.
const PRINTED: &str = "quadrotor-full-12_g40";

/// Steps between two hulls of Fig. 5: one second.
const BETWEEN: i32 = 100;

/// Steps between two points of a curve.
const STRIDE: i32 = 5;

/// Δt in s.
const PERIOD: f64 = 0.01;

/// The figures of Example 2 that the lake has the data of.
pub fn figures(source: &Source) -> Result<Vec<Figure>, Error> {
    let Some(run) = source.first_run("cz", FLIGHT)? else {
        return Ok(Vec::new());
    };
    let figure = |name: &'static str, title: &str, drawing| Figure {
        experiment: None,
        name: name.into(),
        title: title.to_owned(),
        drawing,
    };
    let printed = source.first_run("cz", PRINTED)?;
    let taylor = printed.as_ref().map_or_else(
        || Err(format!("the lake holds no {PRINTED}")),
        |printed| {
            let shown = [("czfo-printed-12", "CZFO"), ("zfo", "ZFO")];
            Ok(radii(PRINTED, printed, shown))
        },
    );
    Ok(vec![
        figure("Fig. 5", "The flight and the hulls", Ok(flight(&run))),
        figure(
            "Fig. 6",
            "Radii of CZMV and ZMV",
            Ok(radii(FLIGHT, &run, [("czmv", "CZMV"), ("zmv", "ZMV")])),
        ),
        figure("Fig. 7", "Radii of CZFO and ZFO", taylor),
        figure(
            "Not in the paper",
            "Half-widths of each state",
            Ok(components(&run)),
        ),
    ])
}

/// (lower, upper) of a component of the updated set's hull.
fn side(run: &FirstRun, estimator: &str, component: &str, k: i32) -> Option<[f64; 2]> {
    let trail = run.trail(estimator, "updated", component);
    Some([*trail.lower.get(&k)?, *trail.upper.get(&k)?])
}

/// cos 30° and sin 30°, for the axonometric view: x to the lower right, y to the upper right, z upwards.
const COS: f64 = 0.866_025_403_784_438_6;
const SIN: f64 = 0.5;

/// A point of space in the plane of the picture.
fn seen([x, y, z]: [f64; 3]) -> [f64; 2] {
    [COS * (x + y), SIN * (y - x) + z]
}

/// The three faces of a box that are seen: from the front left, from the front right, and from above.
fn faces(ends: [[f64; 2]; 3]) -> [Vec<[f64; 2]>; 3] {
    let corner = |x: usize, y: usize, z: usize| seen([ends[0][x], ends[1][y], ends[2][z]]);
    [
        vec![
            corner(0, 0, 0),
            corner(1, 0, 0),
            corner(1, 0, 1),
            corner(0, 0, 1),
        ],
        vec![
            corner(1, 0, 0),
            corner(1, 1, 0),
            corner(1, 1, 1),
            corner(1, 0, 1),
        ],
        vec![
            corner(0, 0, 1),
            corner(1, 0, 1),
            corner(1, 1, 1),
            corner(0, 1, 1),
        ],
    ]
}

/// Fig. 5: the path in space with a hull a second, in an axonometric view.
fn flight(run: &FirstRun) -> Drawing {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let mut series = Vec::new();
    for (estimator, label, colour) in [
        ("zmv", "ZMV", Colour::Green),
        ("czmv", "CZMV", Colour::Vermilion),
    ] {
        // The first hull is the prior cut by one measurement, ten times as large.
        for k in (BETWEEN..=run.last()).step_by(BETWEEN as usize) {
            let ends = AXES.map(|axis| side(run, estimator, axis, k));
            let [Some(x), Some(y), Some(z)] = ends else {
                continue;
            };
            series.extend(faces([x, y, z]).map(|vertices| Series::Polygon {
                label: label.to_owned(),
                colour,
                filled: false,
                vertices,
            }));
        }
    }
    let [xs, ys, zs] = AXES.map(|axis| run.state(axis));
    let points = xs.iter().filter(|(k, _)| *k % STRIDE == 0);
    series.push(Series::Line {
        label: "true".to_owned(),
        colour: Colour::Black,
        points: points
            .filter_map(|(k, &x)| Some(seen([x, *ys.get(k)?, *zs.get(k)?])))
            .collect(),
    });
    // Half a metre along each axis, from a corner below the path.
    let origin = [-0.3, -0.3, 0.6];
    for axis in 0..3 {
        let mut end = origin;
        end[axis] += 0.5;
        series.push(Series::Dashes {
            label: "0.5 m along x, y, z".to_owned(),
            colour: Colour::Grey,
            points: vec![seen(origin), seen(end)],
        });
    }
    let figure = svg::Figure {
        title: "Path and interval hulls, one a second".to_owned(),
        columns: 1,
        panels: vec![Panel {
            title: "Axonometric: x to the lower right, y to the upper right, z upwards".to_owned(),
            x: Axis::new("(x + y) cos 30°", "m"),
            y: Axis::new("z + (y - x) sin 30°", "m"),
            series,
            equal: true,
        }],
        ..svg::Figure::default()
    };
    Drawing {
below: Vec::new(),
        svg: figure.to_svg(),
        caption: "In the paper: the path with the hulls of CZMV (red) and ZMV (green) in (x, y, z). Here: the same, after \
                  the first second, the three faces of each hull that are seen. The controller does not know the wind, so \
                  the path leaves the helix from 5 s to 15 s, by up to half a metre in each direction."
            .to_owned(),
        data: data(
            FLIGHT,
            run,
            "estimator IN ('czmv', 'zmv') AND component IN ('x', 'y', 'z')",
        ),
    }
}

/// Half the longest edge of the hull over time.
fn radius(run: &FirstRun, estimator: &str) -> Vec<[f64; 2]> {
    let steps = (0..=run.last()).step_by(STRIDE as usize);
    let longest = |k: i32| {
        let halves = (run.states.iter())
            .map(|(name, _)| side(run, estimator, name, k).map(|[lo, hi]| 0.5 * (hi - lo)));
        let longest = halves.collect::<Option<Vec<f64>>>()?;
        Some([
            f64::from(k) * PERIOD,
            longest.into_iter().fold(0.0, f64::max),
        ])
    };
    steps.filter_map(longest).collect()
}

/// Figs. 6 and 7.
fn radii(experiment: &str, run: &FirstRun, shown: [(&str, &str); 2]) -> Drawing {
    let curves = shown.map(|(estimator, label)| (label, radius(run, estimator)));
    let mean =
        |points: &[[f64; 2]]| points.iter().map(|p| p[1]).sum::<f64>() / points.len().max(1) as f64;
    let means: Vec<String> = curves
        .iter()
        .map(|(label, points)| format!("{label} {} m/s", four_digits(mean(points))))
        .collect();
    let [(first, solid), (second, dashed)] = curves;
    let figure = svg::Figure {
        title: "Half the longest edge of the interval hull".to_owned(),
        columns: 1,
        panels: vec![Panel {
            title: "40 generators, 12 constraints".to_owned(),
            x: Axis::new("t", "s"),
            y: Axis::new("radius", "m/s"),
            series: vec![
                Series::Dashes {
                    label: second.to_owned(),
                    colour: Colour::Orange,
                    points: dashed,
                },
                Series::Line {
                    label: first.to_owned(),
                    colour: Colour::Green,
                    points: solid,
                },
            ],
            ..Panel::default()
        }],
        ..svg::Figure::default()
    };
    let condition = format!("estimator IN ('{}', '{}')", shown[0].0, shown[1].0);
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption: format!(
            "In the paper: the radii of the updated sets. The longest edge is that of the vertical velocity, which is \
             not measured. Means: {}.",
            means.join(", ")
        ),
        data: data(experiment, run, &condition),
    }
}

/// The half-width of each component's hull, which spans five powers of ten.
fn components(run: &FirstRun) -> Drawing {
    let panel = |title: &str, unit: &str, names: [&str; 3]| {
        let mut series = Vec::new();
        for (i, name) in names.into_iter().enumerate() {
            let half = |k: i32| {
                let [lo, hi] = side(run, "czmv", name, k)?;
                Some([f64::from(k) * PERIOD, 0.5 * (hi - lo)])
            };
            series.push(Series::Line {
                label: name.to_owned(),
                colour: Colour::nth(i),
                points: (0..=run.last())
                    .step_by(STRIDE as usize)
                    .filter_map(half)
                    .collect(),
            });
        }
        Panel {
            title: title.to_owned(),
            x: Axis::new("t", "s"),
            y: Axis {
                log: true,
                ..Axis::new("half-width", unit)
            },
            series,
            ..Panel::default()
        }
    };
    let figure = svg::Figure {
        title: "CZMV: half-widths of the hull".to_owned(),
        columns: 2,
        panels: vec![
            panel("Position", "m", ["x", "y", "z"]),
            panel("Velocity", "m/s", ["u", "v", "w"]),
            panel("Angles", "rad", ["phi", "theta", "psi"]),
            panel("Turn rates", "rad/s", ["p", "q", "r"]),
        ],
        ..svg::Figure::default()
    };
    Drawing {
below: Vec::new(),
        svg: figure.to_svg(),
        caption: "No noise drives the angles and turn rates, so their sets are what all measurements together leave: \
                  10⁻⁵ wide beside a velocity of 1. The linear programs scale their rows for that reason."
            .to_owned(),
        data: data(FLIGHT, run, "estimator = 'czmv'"),
    }
}

fn data(experiment: &str, run: &FirstRun, condition: &str) -> Data {
    let condition = format!("phase = 'updated' AND {condition}");
    Data::of(
        "cz",
        experiment,
        run,
        &[
            (
                "estimator, k, component, lower, upper",
                "estimates",
                &condition,
            ),
            ("k, component, value", "truth", ""),
        ],
    )
}
