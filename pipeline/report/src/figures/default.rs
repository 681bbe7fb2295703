//! The figures that an experiment has without asking: its states in their tubes, its sets step by step, their sizes, and
//! its scores.

use super::archetype::drawn;
use super::{Archetype, Figure, Quantity, Spec, Subject};
use crate::source::Source;
use crate::svg::Colour;
use zonobench_lake::error::Error;

/// Steps of `sets-by-step`.
const PANELS: i32 = 6;

/// The figures of an experiment; what cannot be drawn of it is left out.
pub fn of_experiment(source: &Source, paper: &str, id: &str) -> Result<Vec<Figure>, Error> {
    let Some(run) = source.first_run(paper, id)? else {
        return Ok(Vec::new());
    };
    let infos = source.estimators(paper, id)?;
    let estimators = infos.iter().enumerate().map(|(i, info)| Subject {
        estimator: info.estimator.to_string(),
        label: info.estimator.to_string(),
        phase: info.reported_phase.to_string(),
        colour: Colour::nth(i),
        dashed: false,
        experiment: None,
    });
    let whole = Spec {
        name: String::new(),
        title: String::new(),
        heading: String::new(),
        kind: None,
        drawing: String::new(),
        panel: String::new(),
        unit: String::new(),
        every: 1,
        period: None,
        experiment: id.to_owned(),
        estimators: estimators.collect(),
        components: Vec::new(),
        quantity: Quantity::Radius,
        steps: spread(run.last()),
        window: None,
        log: false,
        caption: String::new(),
    };
    let kinds = [
        (
            Archetype::Tube,
            "states",
            "True state, estimates and enclosures",
        ),
        (Archetype::SetsByStep, "sets", "Sets by step"),
        (
            Archetype::Curves,
            "radius",
            "Half the longest edge of the hulls",
        ),
        (Archetype::Bars, "scores", "Scores with their intervals"),
    ];
    let mut figures = Vec::new();
    for (kind, name, title) in kinds {
        let spec = Spec {
            name: format!("{id}-{name}"),
            title: title.to_owned(),
            heading: format!("{id}: {title}"),
            kind: Some(kind),
            ..whole.clone()
        };
        // A state of one component has no plane, a point estimate no set: that is no failure.
        if let Some(Ok(drawing)) = drawn(source, paper, None, &spec)? {
            figures.push(Figure {
                name: spec.name,
                title: spec.title,
                experiment: Some(id.to_owned()),
                drawing: Ok(drawing),
            });
        }
    }
    Ok(figures)
}

/// [`PANELS`] steps from 0 to the last, evenly spread.
fn spread(last: i32) -> Vec<i32> {
    let mut steps: Vec<i32> = (0..PANELS).map(|i| last * i / (PANELS - 1)).collect();
    steps.dedup();
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(10), [0, 2, 4, 6, 8, 10]);
        assert_eq!(spread(2), [0, 1, 2]);
        assert_eq!(spread(0), [0]);
    }
}
