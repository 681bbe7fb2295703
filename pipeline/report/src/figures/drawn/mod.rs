//! Drawings that no archetype covers, by the names that `figures.toml` calls them.

mod r#box;
mod bundle;
mod cz;
mod ezgkf;
mod inzsmf;
mod quadrotor;

use super::{Data, Drawing, Spec};
use crate::source::{FirstRun, Instant, Source};
use zonobench_lab::experiment::Experiment;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Score, Set};
use zonobench_verdicts::papers::Paper;

/// A drawing, or why there is none; None where the lake does not hold what it is drawn from.
pub type Drawn = Option<Result<Drawing, String>>;

/// Draws what a [`Context`] asks for.
type Draw = fn(&Context) -> Result<Drawn, Error>;

const DRAWINGS: &[(&str, Draw)] = &[
    ("box/ellipse-with-states", r#box::ellipse_with_states),
    ("box/box-with-states", r#box::box_with_states),
    ("box/states", r#box::states),
    ("box/errors", r#box::errors),
    ("box/sets", r#box::sets),
    ("box/signals", r#box::signals),
    ("bundle/first-example", bundle::first_example),
    ("bundle/second-example", bundle::second_example),
    ("bundle/ranking", bundle::ranking),
    ("cz/one-step", cz::one_step),
    ("cz/first-update", cz::first_update),
    ("cz/four-steps", cz::four_steps),
    ("cz/flight", quadrotor::flight),
    ("cz/half-widths", quadrotor::components),
    ("ezgkf/boxes", ezgkf::boxes),
    ("inzsmf/comparison", inzsmf::comparison),
    ("inzsmf/gains", inzsmf::gains),
    ("inzsmf/attacked", inzsmf::attacked),
];

/// The drawing called `name`; fails with those that there are.
pub fn find(name: &str) -> Result<Draw, String> {
    let found = DRAWINGS.iter().find(|(known, _)| *known == name);
    found.map(|(_, draw)| *draw).ok_or_else(|| {
        let known: Vec<&str> = DRAWINGS.iter().map(|(known, _)| *known).collect();
        format!("expected a drawing: {}; got {name}", known.join(", "))
    })
}

/// What a drawing is made of.
pub struct Context<'a> {
    /// The lake
    pub source: &'a Source,
    /// The folder of the paper
    pub paper: &'a str,
    /// The paper as published, where it comes with this program
    pub known: Option<&'a Paper>,
    /// What is asked for
    pub spec: &'a Spec,
}

/// Where the lake does not hold the experiment.
pub fn no_run() -> Result<Drawn, Error> {
    Ok(None)
}

impl Context<'_> {
    /// Run 0 of the experiment.
    pub fn run(&self) -> Result<Option<FirstRun>, Error> {
        self.run_of(&self.spec.experiment)
    }

    /// Run 0 of another experiment of the paper.
    pub fn run_of(&self, experiment: &str) -> Result<Option<FirstRun>, Error> {
        self.source.first_run(self.paper, experiment)
    }

    /// The sets that were kept of run 0.
    pub fn sets(&self) -> Result<Vec<Set>, Error> {
        self.source.sets(self.paper, &self.spec.experiment)
    }

    /// The scores of the experiment.
    pub fn scores(&self) -> Result<Vec<Score>, Error> {
        self.source.scores(self.paper, &self.spec.experiment)
    }

    /// Step k of the first `count` runs, as (estimator, phase) sees it.
    pub fn instants(&self, of: (&str, &str), k: i32, count: i32) -> Result<Vec<Instant>, Error> {
        self.source
            .instants(self.paper, &self.spec.experiment, of, k, count)
    }

    /// The experiment as its file has it.
    pub fn published(&self) -> Option<&Experiment> {
        let all = self.known?.experiments.iter();
        let mut named = all.filter(|e| e.id == self.spec.experiment);
        named.next().map(|e| &**e)
    }

    /// What was drawn from the experiment.
    pub fn data(&self, run: &FirstRun, queries: &[(&str, &str, &str)]) -> Data {
        Data::of(self.paper, &self.spec.experiment, run, queries)
    }
}
