//! Fig. 1 of [dePaula].

use super::{Context, Drawn, no_run};
use crate::figures::{Drawing, Spec};
use crate::source::FirstRun;
use crate::svg::{Axis, Colour, Marker, Panel, Series};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;

struct Shown {
    estimator: &'static str,
    phase: &'static str,
    label: &'static str,
    boxes: Colour,
    centers: Colour,
}

/// In the paper's colours: boxes blue and red, centers cyan and green.
const SHOWN: [Shown; 2] = [
    Shown {
        estimator: "ezgkp",
        phase: "predicted",
        label: "EZGKP",
        boxes: Colour::Blue,
        centers: Colour::Sky,
    },
    Shown {
        estimator: "ezgkf",
        phase: "updated",
        label: "EZGKF",
        boxes: Colour::Vermilion,
        centers: Colour::Green,
    },
];

/// Fig. 1.
pub fn boxes(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    Ok(Some(match of.spec.beyond(&run) {
        Some(why) => Err(why),
        None => Ok(drawn(of, &run)),
    }))
}

fn drawn(of: &Context, run: &FirstRun) -> Drawing {
    let spec = of.spec;
    let panels = run.states.iter().map(|(name, unit)| Panel {
        x: Axis::new("step k", ""),
        y: Axis::new(name, unit),
        series: series(spec, run, name),
        ..Panel::default()
    });
    let measured = SHOWN.iter().map(|s| measured(spec, run, s));
    let facts = [("measured", measured.collect::<Vec<_>>().join("; "))];
    let truth = spec.of_truth();
    let estimates = format!(
        "{truth} AND ((estimator = 'ezgkp' AND phase = 'predicted') OR (estimator = 'ezgkf' AND phase = 'updated'))"
    );
    Drawing {
        svg: spec.figure(1, panels.collect()).to_svg(),
        caption: spec.told(&facts),
        below: Vec::new(),
        data: of.data(
            run,
            &[
                ("k, component, value", "truth", &truth),
                (
                    "estimator, k, component, center, lower, upper",
                    "estimates",
                    &estimates,
                ),
            ],
        ),
    }
}

/// Boxes at the bottom, then centers, then the state.
fn series(spec: &Spec, run: &FirstRun, component: &str) -> Vec<Series> {
    let mut series = Vec::new();
    for s in &SHOWN {
        let points = spec.ends(run.trail(s.estimator, s.phase, component));
        let label = format!("{} box", s.label);
        for end in [1, 2] {
            series.push(Series::Line {
                label: label.clone(),
                colour: s.boxes,
                points: points.iter().map(|p| [p[0], p[end]]).collect(),
            });
        }
        series.push(Series::Band {
            label,
            colour: s.boxes,
            points,
        });
    }
    for s in &SHOWN {
        series.push(Series::Line {
            label: format!("{} center", s.label),
            colour: s.centers,
            points: spec.points(&run.trail(s.estimator, s.phase, component).center),
        });
    }
    series.push(Series::Points {
        label: "true state".to_owned(),
        colour: Colour::Black,
        marker: Marker::Dot,
        points: spec.points(run.state(component)),
    });
    series
}

/// The mean radius of an estimator's boxes, and how often they hold the state.
fn measured(spec: &Spec, run: &FirstRun, s: &Shown) -> String {
    let radii = run.states.iter().map(|(name, _)| {
        let ends = spec.ends(run.trail(s.estimator, s.phase, name));
        let widths: f64 = ends.iter().map(|[_, lower, upper]| upper - lower).sum();
        let mean = widths / 2.0 / ends.len().max(1) as f64;
        format!("{} in {name}", four_digits(mean))
    });
    let radii: Vec<String> = radii.collect();
    let steps: Vec<i32> = (0..=run.last()).filter(|k| spec.sees(*k)).collect();
    let inside = steps
        .iter()
        .filter(|k| run.is_inside(s.estimator, s.phase, **k));
    format!(
        "{} has a mean radius of {}, and holds the state at {} of {} steps",
        s.label,
        radii.join(" and "),
        inside.count(),
        steps.len()
    )
}
