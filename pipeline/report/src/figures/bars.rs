//! Scores with the 95 % intervals of their means, a bar an estimator, a group a metric.

use super::drawn::{Context, Drawn, no_run};
use super::{Data, Drawing, Spec};
use crate::source::FirstRun;
use crate::svg::Colour;
use crate::svg::bars::{Bar, Group};
use crate::svg::scores::Scores;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::lake;
use zonobench_lake::rows::Score;
use zonobench_verdicts::compare::interval;

/// Draws the scores.
pub fn draw(of: &Context) -> Result<Drawn, Error> {
    let Some(run) = of.run()? else {
        return no_run();
    };
    Ok(Some(bars(of, &run, &of.scores()?)))
}

fn bars(of: &Context, run: &FirstRun, scores: &[Score]) -> Result<Drawing, String> {
    let (paper, spec) = (of.paper, of.spec);
    let mut groups: Vec<Group> = Vec::new();
    for s in scores {
        let Some(bar) = bar(spec, s) else { continue };
        let mut label = s.metric.to_string();
        for (word, name) in [(" of ", &s.component), (" over ", &s.over)] {
            if let Some(name) = name.as_deref().filter(|name| !name.is_empty()) {
                label += &format!("{word}{name}");
            }
        }
        match groups.iter_mut().find(|g| g.label == label) {
            Some(group) => group.bars.push(bar),
            None => groups.push(Group {
                label,
                bars: vec![bar],
            }),
        }
    }
    if groups.is_empty() {
        return Err("it has no metric with a value".to_owned());
    }
    let path = lake::table_path("scores", paper, &spec.experiment);
    let picture = Scores {
        title: spec.heading().to_owned(),
        description: format!("Means of {} metrics, a bar an estimator.", groups.len()),
        groups,
    };
    Ok(Drawing {
        svg: picture.to_svg(),
        caption: spec.told_or(
            "Means over the runs; a line over the end of a bar is the 95 % interval of the mean. Every metric has its own scale, \
             from 0.",
            &[],
        ),
        below: Vec::new(),
        data: Data {
            experiment: format!("{paper}/{}", spec.experiment),
            seed: run.seed.clone(),
            files: vec![path],
            sql: vec![format!(
                "SELECT estimator, metric, component, over, mean, ci_lo, ci_hi FROM scores WHERE paper = '{paper}' AND \
                 experiment = '{}'",
                spec.experiment
            )],
        },
    })
}

fn bar(spec: &Spec, s: &Score) -> Option<Bar> {
    let value = s.mean.filter(|x| x.is_finite())?;
    let of = spec
        .estimators
        .iter()
        .find(|of| *of.estimator == *s.estimator);
    let ends = s
        .ci_lo
        .zip(s.ci_hi)
        .filter(|(lo, hi)| lo.is_finite() && hi.is_finite());
    let text = match ends {
        Some((lo, hi)) if lo < hi => format!("{} {}", four_digits(value), interval(lo, hi)),
        _ => four_digits(value),
    };
    Some(Bar {
        name: s.estimator.to_string(),
        value,
        ends: ends.map(|(lo, hi)| [lo, hi]),
        text,
        colour: of.map_or(Colour::Grey, |of| of.colour),
    })
}
