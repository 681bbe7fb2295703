//! What is said and drawn of a published paper: `about.md` and `figures.toml` in its folder.

use super::{Figure, Spec, archetype};
use crate::document::{Block, prose};
use crate::source::{Held, Source};
use serde::Deserialize;
use zonobench_lake::error::Error;

/// (paper, `about.md`, `figures.toml`).
const PAGES: &[(&str, &str, &str)] = include!(concat!(env!("OUT_DIR"), "/pages.rs"));

/// What a page says of a paper.
pub struct About {
    /// What the paper says
    pub says: Vec<Block>,
    /// Which of its figures are not drawn, and why
    pub not_drawn: Vec<Block>,
    figures: Vec<Spec>,
}

/// A `figures.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Figures {
    #[serde(default)]
    not_drawn: String,
    #[serde(default)]
    figure: Vec<Spec>,
}

/// What is known about the paper in `folder`; None if it is none of ours.
pub fn about(folder: &str) -> Result<Option<About>, Error> {
    let Some((_, says, figures)) = PAGES.iter().find(|(name, ..)| *name == folder) else {
        return Ok(None);
    };
    let read: Figures = toml::from_str(figures).map_err(|e| Error::Refused {
        what: format!("experiments/{folder}/figures.toml"),
        expected: "figures".to_owned(),
        got: e.to_string(),
    })?;
    Ok(Some(About {
        says: prose::blocks(says),
        not_drawn: prose::blocks(&read.not_drawn),
        figures: read.figure,
    }))
}

/// The figures of a paper that the lake holds the data of, in order; None if it is none of ours.
pub fn figures(source: &Source, held: &Held) -> Result<Option<Vec<Figure>>, Error> {
    let Some(about) = about(&held.name)? else {
        return Ok(None);
    };
    let mut figures = Vec::new();
    for spec in about.figures {
        let drawn = archetype::drawn(source, &held.name, held.paper.as_ref(), &spec)?;
        figures.extend(drawn.map(|drawing| Figure {
            name: spec.name,
            title: spec.title,
            experiment: None,
            drawing,
        }));
    }
    Ok(Some(figures))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::drawn;

    #[test]
    fn every_published_paper_has_a_summary_and_figures_of_its_experiments() {
        for paper in zonobench_verdicts::papers::load(&[]).unwrap() {
            let about = about(&paper.name).unwrap().expect(&paper.name);
            assert!(!about.says.is_empty() && !about.figures.is_empty());
            for spec in about.figures {
                let has = |id: &str| paper.experiments.iter().find(|e| e.id == id);
                let Some(experiment) = has(&spec.experiment) else {
                    panic!("{}: no experiment {}", spec.name, spec.experiment);
                };
                assert_eq!(
                    spec.kind.is_none(),
                    !spec.drawing.is_empty(),
                    "{}",
                    spec.name
                );
                if spec.kind.is_none() {
                    drawn::find(&spec.drawing).unwrap();
                }
                for s in &spec.estimators {
                    let own = s
                        .experiment
                        .as_deref()
                        .map_or(Some(experiment), has)
                        .unwrap();
                    assert!(own.estimators.iter().any(|e| e.id == s.estimator), "{s:?}");
                }
            }
        }
    }
}
