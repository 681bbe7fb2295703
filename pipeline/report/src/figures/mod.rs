//! Figures: what is drawn of a lake, and from what.
//!
//! A figure is named by a [`Spec`], which a paper's `figures.toml` writes down and an experiment of a user's own gets by
//! itself. Most are one of the archetypes, which any experiment can be drawn with: `tube`, `curves`, `sets-by-step`,
//! `bars`. The rest is a function that is registered by its name.

mod archetype;
mod bars;
mod curves;
mod default;
mod drawn;
pub mod papers;
mod sets;
mod spec;
mod tube;

pub use default::of_experiment;
pub use spec::{Archetype, Quantity, Spec, Subject};

use crate::document::Block;
use crate::source::{FirstRun, Source};
use zonobench_lake::error::Error;
use zonobench_lake::lake;

/// A figure, or why there is none.
pub struct Figure {
    /// As the paper calls it
    pub name: String,
    /// What it shows
    pub title: String,
    /// The experiment of a user's own that it stands with
    pub experiment: Option<String>,
    /// The picture
    pub drawing: Result<Drawing, String>,
}

/// A figure that could be drawn.
pub struct Drawing {
    /// The picture
    pub svg: String,
    /// What is to be seen, in Markdown
    pub caption: String,
    /// What stands below it
    pub below: Vec<Block>,
    /// What it was drawn from
    pub data: Data,
}

/// What a figure was drawn from.
pub struct Data {
    /// `paper/experiment`
    pub experiment: String,
    /// Its seed
    pub seed: String,
    /// Paths of files below the lake
    pub files: Vec<String>,
    /// Queries that give what is drawn
    pub sql: Vec<String>,
}

impl Data {
    /// What was drawn from `tables` of an experiment, and the queries as `(columns, table, condition)`.
    pub fn of(
        paper: &str,
        experiment: &str,
        run: &FirstRun,
        queries: &[(&str, &str, &str)],
    ) -> Self {
        let mut files: Vec<String> = queries
            .iter()
            .map(|(_, table, _)| lake::table_path(table, paper, experiment))
            .collect();
        files.dedup();
        let sql = queries.iter().map(|(columns, table, condition)| {
            let and = if condition.is_empty() { "" } else { " AND " };
            format!(
                "SELECT {columns} FROM {table} WHERE paper = '{paper}' AND experiment = '{experiment}' AND run = 0{and}{condition} \
                 ORDER BY k"
            )
        });
        Self {
            experiment: format!("{paper}/{experiment}"),
            seed: run.seed.clone(),
            files,
            sql: sql.collect(),
        }
    }

    /// This and what else was drawn.
    pub fn joined(mut self, other: Self) -> Self {
        self.experiment = format!("{} and {}", self.experiment, other.experiment);
        self.files.extend(other.files);
        self.sql.extend(other.sql);
        self
    }
}

/// The figures that every experiment of a user's own has.
pub fn of_own(source: &Source, paper: &str, experiments: &[String]) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    for id in experiments {
        figures.extend(of_experiment(source, paper, id)?);
    }
    Ok(figures)
}

/// Steps in a sentence: `k = 1, 41 and 81`.
pub fn at_steps(steps: &[i32]) -> String {
    let texts: Vec<String> = steps.iter().map(i32::to_string).collect();
    match texts.as_slice() {
        [] => "none".to_owned(),
        [one] => format!("k = {one}"),
        [most @ .., last] => format!("k = {} and {last}", most.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_listed_as_in_a_sentence() {
        assert_eq!(at_steps(&[]), "none");
        assert_eq!(at_steps(&[7]), "k = 7");
        assert_eq!(at_steps(&[1, 41, 81]), "k = 1, 41 and 81");
    }
}
