//! Fig. 5 of [Rego2020], the quadrotor, and what the paper has not.

use super::{Context, Drawn, no_run};
use crate::figures::{Data, Drawing};
use crate::source::FirstRun;
use crate::svg::{Axis, Colour, Panel, Series};
use zonobench_lake::error::Error;

/// Steps between two hulls of Fig. 5: one second.
const BETWEEN: i32 = 100;

/// Steps between two points of a curve.
const STRIDE: i32 = 5;

/// Δt in s.
const PERIOD: f64 = 0.01;

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
pub fn flight(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
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
    let panel = Panel {
        title: "Axonometric: x to the lower right, y to the upper right, z upwards".to_owned(),
        x: Axis::new("(x + y) cos 30°", "m"),
        y: Axis::new("z + (y - x) sin 30°", "m"),
        series,
        equal: true,
    };
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(1, vec![panel]).to_svg(),
        caption: of.spec.told(&[]),
        below: Vec::new(),
        data: data(
            of,
            run,
            "estimator IN ('czmv', 'zmv') AND component IN ('x', 'y', 'z')",
        ),
    })))
}

/// The half-width of each component's hull, which spans five powers of ten.
pub fn components(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = &of.run()? else {
        return no_run();
    };
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
    let panels = vec![
        panel("Position", "m", ["x", "y", "z"]),
        panel("Velocity", "m/s", ["u", "v", "w"]),
        panel("Angles", "rad", ["phi", "theta", "psi"]),
        panel("Turn rates", "rad/s", ["p", "q", "r"]),
    ];
    Ok(Some(Ok(Drawing {
        svg: of.spec.figure(2, panels).to_svg(),
        caption: of.spec.told(&[]),
        below: Vec::new(),
        data: data(of, run, "estimator = 'czmv'"),
    })))
}

fn data(of: &Context, run: &FirstRun, condition: &str) -> Data {
    let condition = format!("phase = 'updated' AND {condition}");
    of.data(
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
