//! ezgkf: Fig. 1 of [dePaula].

use super::{About, Data, Drawing, Figure};
use crate::source::{FirstRun, Source};
use crate::svg::{self, Axis, Colour, Marker, Panel, Series};
use std::ops::RangeInclusive;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_verdicts::papers::Paper;

pub const ABOUT: About = About {
    folder: "ezgkf",
    says: "A system whose uncertainties are the sum of an unknown-but-bounded part (an element of a zonotope) and a \
           Gaussian one, and whose matrix is A_0 + Σ δ_i A_i with |δ_i| ≤ 1, is followed by a belief that has both \
           parts too: a center, generators and a covariance. **EZGKF** forecasts all three (Proposition 1, 2), \
           chooses a gain that minimises a weighted sum of the size of the zonotope and of the covariance (Theorem 1), \
           and corrects with y_k; the confidence box is the interval hull of the sum of the zonotope and an \
           ellipsoid of probability 1 − α. **EZGKF-M** (Remark 3) takes the matrix as an interval matrix. Both are \
           compared with **EZGKP**, the predictor of earlier work that reads y_{k−1}; its equations are not in the paper, \
           and are rebuilt here.\n\n\
           Case study 1 (Section V-A) is a Van der Pol oscillator in quasi-LPV form, case study 2 (Section V-B) a \
           linear system with one uncertain entry. The paper finds that the filters have smaller errors and boxes \
           than the predictor, and expects them to be no slower.",
    not_drawn: "",
    draw,
};

/// The steps that the figure shows.
const WINDOW: RangeInclusive<i32> = 120..=180;

const EXPERIMENT: &str = "van-der-pol";

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

fn draw(source: &Source, _: Option<&Paper>) -> Result<Vec<Figure>, Error> {
    let Some(run) = source.first_run("ezgkf", EXPERIMENT)? else {
        return Ok(Vec::new());
    };
    let drawing = if run.last() < *WINDOW.end() {
        Err(format!(
            "it shows k = {} to {}, and this run ends at k = {}",
            WINDOW.start(),
            WINDOW.end(),
            run.last()
        ))
    } else {
        Ok(boxes(&run))
    };
    let title = "Confidence boxes and centers, Van der Pol oscillator".to_owned();
    Ok(vec![Figure {
        experiment: None,
        name: "Fig. 1".into(),
        title,
        drawing,
    }])
}

fn boxes(run: &FirstRun) -> Drawing {
    let panels = run.states.iter().map(|(name, unit)| {
        let mut series = Vec::new();
        for s in &SHOWN {
            let trail = run.trail(s.estimator, s.phase, name);
            let ends = |k| Some([f64::from(k), *trail.lower.get(&k)?, *trail.upper.get(&k)?]);
            let points: Vec<[f64; 3]> = WINDOW.filter_map(ends).collect();
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
            let center = &run.trail(s.estimator, s.phase, name).center;
            series.push(Series::Line {
                label: format!("{} center", s.label),
                colour: s.centers,
                points: center
                    .range(WINDOW)
                    .map(|(k, c)| [f64::from(*k), *c])
                    .collect(),
            });
        }
        series.push(Series::Points {
            label: "true state".to_owned(),
            colour: Colour::Black,
            marker: Marker::Dot,
            points: run
                .state(name)
                .range(WINDOW)
                .map(|(k, x)| [f64::from(*k), *x])
                .collect(),
        });
        Panel {
            x: Axis::new("step k", ""),
            y: Axis::new(name, unit),
            series,
            ..Panel::default()
        }
    });
    let figure = svg::Figure {
        title: "Van der Pol oscillator: confidence boxes of EZGKP and EZGKF".to_owned(),
        columns: 1,
        panels: panels.collect(),
        ..svg::Figure::default()
    };
    let measured = SHOWN.iter().map(|s| {
        let radii = run.states.iter().map(|(name, _)| {
            let trail = run.trail(s.estimator, s.phase, name);
            let widths: Vec<f64> = WINDOW
                .filter_map(|k| Some(trail.upper.get(&k)? - trail.lower.get(&k)?))
                .collect();
            format!(
                "{} in {name}",
                four_digits(widths.iter().sum::<f64>() / 2.0 / widths.len().max(1) as f64)
            )
        });
        let radii: Vec<String> = radii.collect();
        let inside = WINDOW
            .filter(|k| run.is_inside(s.estimator, s.phase, *k))
            .count();
        format!(
            "{} has a mean radius of {}, and holds the state at {inside} of {} steps",
            s.label,
            radii.join(" and "),
            WINDOW.count()
        )
    });
    let caption = format!(
        "In the paper: boxes of EZGKP blue and of EZGKF red, centers of EZGKP cyan and of EZGKF green, states black dots; \
         so here, with the boxes as bands. In this window {}.",
        measured.collect::<Vec<_>>().join("; ")
    );
    let condition = format!(
        "k BETWEEN {} AND {} AND ((estimator = 'ezgkp' AND phase = 'predicted') OR (estimator = 'ezgkf' AND phase = \
         'updated'))",
        WINDOW.start(),
        WINDOW.end()
    );
    let truth = format!("k BETWEEN {} AND {}", WINDOW.start(), WINDOW.end());
    let data = Data::of(
        "ezgkf",
        EXPERIMENT,
        run,
        &[
            ("k, component, value", "truth", &truth),
            (
                "estimator, k, component, center, lower, upper",
                "estimates",
                &condition,
            ),
        ],
    );
    Drawing {
        below: Vec::new(),
        svg: figure.to_svg(),
        caption,
        data,
    }
}
