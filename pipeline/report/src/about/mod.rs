//! What is particular to a paper: what it says and what its figures show, a file a paper.

mod r#box;
mod bundle;
mod cz;
mod ezgkf;
mod inzsmf;
mod quadrotor;

use crate::source::{FirstRun, Source};
use zonobench_lake::error::Error;
use zonobench_lake::lake;
use zonobench_verdicts::papers::Paper;

/// The papers that have a page of their own.
const PAPERS: &[About] = &[
    r#box::ABOUT,
    ezgkf::ABOUT,
    inzsmf::ABOUT,
    cz::ABOUT,
    bundle::ABOUT,
];

/// The bibliography, under the keys that the code cites.
const REFERENCES: &str = include_str!("../../../../references.bib");

/// A paper's summary and figures.
pub struct About {
    /// Its folder
    folder: &'static str,
    /// What it says, in Markdown
    pub says: &'static str,
    /// Which figures are not drawn, and why, in Markdown
    pub not_drawn: &'static str,
    /// Draws the others, in order
    draw: fn(&Source, Option<&Paper>) -> Result<Vec<Figure>, Error>,
}

/// A figure, or why there is none.
pub struct Figure {
    /// As the paper calls it
    pub name: &'static str,
    /// What it shows
    pub title: String,
    /// The picture
    pub drawing: Result<Drawing, String>,
}

/// A figure that could be drawn.
pub struct Drawing {
    /// The picture
    pub svg: String,
    /// What is to be seen, in Markdown
    pub caption: String,
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
    fn of(paper: &str, experiment: &str, run: &FirstRun, queries: &[(&str, &str, &str)]) -> Self {
        let mut files: Vec<String> = queries
            .iter()
            .map(|(_, table, _)| lake::table_path(table, paper, experiment))
            .collect();
        files.dedup();
        let sql = queries.iter().map(|(columns, table, condition)| {
            let condition = if condition.is_empty() { String::new() } else { format!(" AND {condition}") };
            format!(
                "SELECT {columns} FROM {table} WHERE paper = '{paper}' AND experiment = '{experiment}' AND run = 0{condition} ORDER BY k"
            )
        });
        Self {
            experiment: format!("{paper}/{experiment}"),
            seed: run.seed.clone(),
            files,
            sql: sql.collect(),
        }
    }
}

/// What is known about the paper in `folder`, if it is one of ours.
pub fn find(folder: &str) -> Option<&'static About> {
    PAPERS.iter().find(|about| about.folder == folder)
}

impl About {
    /// Its figures, drawn from the lake.
    pub fn figures(&self, source: &Source, paper: Option<&Paper>) -> Result<Vec<Figure>, Error> {
        (self.draw)(source, paper)
    }
}

/// A work of the bibliography.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The key that the code cites
    pub key: String,
    /// Its title
    pub title: String,
    /// Authors and where it appeared
    pub citation: String,
}

/// The work that is reproduced in `experiments/<folder>`.
pub fn reference(folder: &str) -> Option<Reference> {
    REFERENCES.split("\n@").find_map(|entry| {
        let field = |name: &str| {
            let line = entry
                .lines()
                .find(|line| line.split('=').next().is_some_and(|key| key.trim() == name))?;
            let value = line.split_once('=')?.1.trim().trim_end_matches(',');
            Some(value.replace(['{', '}'], ""))
        };
        let note = field("note")?;
        let (note, of) = note.rsplit_once("Folder experiments/")?;
        if of.trim() != folder {
            return None;
        }
        let authors: Vec<String> = field("author")?
            .split(" and ")
            .map(|name| match name.split_once(", ") {
                Some((last, first)) => format!("{first} {last}"),
                None => name.to_owned(),
            })
            .collect();
        let mut citation = authors.join(", ");
        if let Some(journal) = field("journal") {
            citation += &format!(". {journal}");
            citation += &field("volume").map(|v| format!(" {v}")).unwrap_or_default();
            citation += &field("pages").map(|p| format!(", {p}")).unwrap_or_default();
            citation += &field("year").map(|y| format!(" ({y})")).unwrap_or_default();
        }
        citation += &field("doi")
            .map(|doi| format!(". doi:{doi}"))
            .unwrap_or_default();
        citation += ".";
        if !note.trim().is_empty() {
            citation += &format!(" {}", note.trim());
        }
        Some(Reference {
            key: entry.split_once('{')?.1.split_once(',')?.0.to_owned(),
            title: field("title")?,
            citation,
        })
    })
}

/// The folders of the bibliography's papers, in order.
pub fn folders() -> Vec<&'static str> {
    let after = REFERENCES.split("Folder experiments/").skip(1);
    after
        .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric()).next())
        .collect()
}

/// Steps in a sentence: `k = 1, 41 and 81`.
fn at_steps(steps: &[i32]) -> String {
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
    fn every_published_paper_has_a_summary_and_a_reference() {
        for folder in zonobench_verdicts::papers::names() {
            assert!(find(folder).is_some(), "{folder}");
            assert!(reference(folder).is_some(), "{folder}");
        }
    }

    #[test]
    fn a_reference_reads_as_a_citation() {
        let found = reference("cz").unwrap();
        assert_eq!(found.key, "Rego2020");
        assert_eq!(
            found.citation,
            "Brenner S. Rego, Guilherme V. Raffo, Joseph K. Scott, Davide M. Raimondo. \
             Automatica 111, 108614 (2020). doi:10.1016/j.automatica.2019.108614."
        );
        assert_eq!(folders(), ["box", "ezgkf", "inzsmf", "cz", "bundle"]);
    }

    #[test]
    fn steps_are_listed_as_in_a_sentence() {
        assert_eq!(at_steps(&[]), "none");
        assert_eq!(at_steps(&[7]), "k = 7");
        assert_eq!(at_steps(&[1, 41, 81]), "k = 1, 41 and 81");
    }
}
