//! The published experiments, embedded in the binary.

use crate::published::{Cell, Published, read_cells, read_published};
use std::sync::Arc;
use zonobench_lab::experiment::Experiment;
use zonobench_lake::error::Error;

/// (path below `experiments/`, text).
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/experiment_files.rs"));

/// A paper: its experiments and what it prints.
pub struct Paper {
    /// Its folder.
    pub name: String,
    /// Its experiments, in order of file name.
    pub experiments: Vec<Arc<Experiment>>,
    /// The text of each experiment file, with the ids of the experiments that it gives.
    pub texts: Vec<(Vec<String>, &'static str)>,
    /// What it prints.
    pub published: Vec<Published>,
    /// Where each printed number is reproduced.
    pub cells: Vec<Cell>,
}

/// The folders of the papers, in order.
pub fn names() -> Vec<&'static str> {
    let mut names: Vec<&str> = FILES
        .iter()
        .filter_map(|(path, _)| path.split_once('/'))
        .map(|(paper, _)| paper)
        .collect();
    names.dedup();
    names
}

/// The papers named (all if none), each checked.
pub fn load(wanted: &[String]) -> Result<Vec<Paper>, Error> {
    let known = names();
    if let Some(unknown) = wanted.iter().find(|w| !known.contains(&w.as_str())) {
        return Err(Error::Unknown {
            what: "paper",
            got: unknown.clone(),
            expected: format!("papers: {}", known.join(", ")),
        });
    }
    let chosen = |name: &&&str| wanted.is_empty() || wanted.iter().any(|w| w == **name);
    known.iter().filter(chosen).map(|name| one(name)).collect()
}

fn one(name: &str) -> Result<Paper, Error> {
    let files = FILES.iter().filter_map(|(path, text)| {
        let (paper, file) = path.split_once('/')?;
        (paper == name).then_some((file, path, text))
    });
    let mut paper = Paper {
        name: name.to_owned(),
        experiments: Vec::new(),
        texts: Vec::new(),
        published: Vec::new(),
        cells: Vec::new(),
    };
    let mut cells = None;
    for (file, path, text) in files {
        let path = format!("experiments/{path}");
        match file {
            "published.csv" => paper.published = read_published(&path, text)?,
            "cells.csv" => cells = Some((path, text)),
            _ if file.ends_with(".toml") => {
                let experiments = Experiment::parse(&path, text)
                    .map_err(|fault| Error::Input(Box::new(fault)))?;
                paper
                    .texts
                    .push((experiments.iter().map(|e| e.id.clone()).collect(), text));
                paper
                    .experiments
                    .extend(experiments.into_iter().map(Arc::new));
            }
            _ => {}
        }
    }
    if let Some((path, text)) = cells {
        paper.cells = read_cells(&path, text, &paper.published)?;
    }
    Ok(paper)
}

impl Paper {
    /// The paper with every experiment made quick.
    pub fn quick(mut self) -> Self {
        self.experiments = self
            .experiments
            .iter()
            .map(|e| Arc::new(e.quick()))
            .collect();
        self
    }

    /// The text of the file that gives experiment `id`.
    pub fn text(&self, id: &str) -> Option<&'static str> {
        self.texts
            .iter()
            .find(|(ids, _)| ids.iter().any(|i| i == id))
            .map(|(_, text)| *text)
    }

    /// The path below `experiments/` of the file that gives experiment `id`.
    pub fn file(&self, id: &str) -> Option<&'static str> {
        let text = self.text(id)?;
        FILES
            .iter()
            .find(|(_, t)| *t == text)
            .map(|(path, _)| *path)
    }
}
