//! The published experiments, embedded in the binary.

use crate::compare::parameter;
use crate::published::{Cell, Known, Published, read_cells, read_published};
use crate::verdict::one_of;
use std::sync::Arc;
use zonobench_claims::Class;
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
    /// The texts that `published` and `cells` are read from.
    pub tables: Tables,
    /// What it prints.
    pub published: Vec<Published>,
    /// Where each printed number is reproduced.
    pub cells: Vec<Cell>,
}

/// The texts of a paper's tables.
#[derive(Clone, Copy, Default)]
pub struct Tables {
    /// `published.csv`
    pub published: &'static str,
    /// `cells.csv`
    pub cells: &'static str,
}

/// The folder of the gallery: systems from the literature as equations, which print nothing that we compare with.
pub const GALLERY: &str = "gallery";

/// The folders of the papers, in order.
pub fn names() -> Vec<&'static str> {
    let mut names: Vec<&str> = FILES
        .iter()
        .filter_map(|(path, _)| path.split_once('/'))
        .map(|(paper, _)| paper)
        .filter(|folder| *folder != GALLERY)
        .collect();
    names.dedup();
    names
}

/// The experiments of the gallery, in order of file name.
pub fn gallery() -> Result<Vec<Arc<Experiment>>, Error> {
    let of_gallery = |(path, _): &&(&str, &str)| {
        let folder = path.split_once('/').map(|(folder, _)| folder);
        folder == Some(GALLERY) && path.ends_with(".toml")
    };
    let mut experiments = Vec::new();
    for (path, text) in FILES.iter().filter(of_gallery) {
        let path = format!("experiments/{path}");
        let read = Experiment::parse(&path, text).map_err(|fault| Error::Input(Box::new(fault)))?;
        experiments.extend(read.into_iter().map(Arc::new));
    }
    Ok(experiments)
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
        tables: Tables::default(),
        published: Vec::new(),
        cells: Vec::new(),
    };
    let mut cells = None;
    for (file, path, text) in files {
        let path = format!("experiments/{path}");
        match file {
            "published.csv" => {
                paper.published = read_published(&path, text)?;
                paper.tables.published = text;
            }
            "cells.csv" => {
                paper.tables.cells = text;
                cells = Some(path);
            }
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
    if let Some(path) = cells {
        let known = Known {
            published: &paper.published,
            estimator: &|experiment, estimator| paper.has_estimator(experiment, estimator),
            parameter: &|experiment, path| {
                paper.experiment(experiment)?;
                let text = paper.text(experiment).unwrap_or_default();
                parameter(text, path).map(|_| ())
            },
            claim: &|claim| is_claim(name, claim),
        };
        paper.cells = read_cells(&path, paper.tables.cells, &known)?;
    }
    Ok(paper)
}

/// Whether the ledger has the claim `id` of a paper, and it is the paper's; fails with those that are.
fn is_claim(paper: &str, id: &str) -> Result<(), String> {
    let all = zonobench_claims::all();
    let own: Vec<&str> = (all.iter())
        .filter(|c| c.paper == paper && c.class != Class::Remark)
        .map(|c| c.id)
        .collect();
    match own.contains(&id) {
        true => Ok(()),
        false => Err(format!(
            "a claim of the ledger that is no remark of ours: {}",
            one_of(id, &own)
        )),
    }
}

impl Paper {
    /// The experiment `id`; fails with those that there are.
    fn experiment(&self, id: &str) -> Result<&Experiment, String> {
        let found = self.experiments.iter().find(|e| e.id == id);
        found.map(|e| &**e).ok_or_else(|| {
            let ids: Vec<&str> = self.experiments.iter().map(|e| e.id.as_str()).collect();
            format!("an experiment, {}", one_of(id, &ids))
        })
    }

    /// Whether the experiment has the estimator; fails with those that there are.
    fn has_estimator(&self, experiment: &str, estimator: &str) -> Result<(), String> {
        let e = self.experiment(experiment)?;
        let ids: Vec<&str> = e.estimators.iter().map(|e| e.id.as_str()).collect();
        match ids.contains(&estimator) {
            true => Ok(()),
            false => Err(format!(
                "an estimator of {experiment}, {}",
                one_of(estimator, &ids)
            )),
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::published::Comparand;

    #[test]
    fn every_paper_is_read() {
        let papers = load(&[]).unwrap();
        assert_eq!(papers.len(), names().len());
        for paper in papers {
            assert!(
                !paper.published.is_empty() && !paper.cells.is_empty(),
                "{}",
                paper.name
            );
        }
    }

    #[test]
    fn the_gallery_is_read_and_no_paper() {
        assert!(!names().contains(&GALLERY));
        let experiments = gallery().unwrap();
        assert!(experiments.len() >= 10);
        for e in experiments {
            assert_eq!(e.paper, GALLERY, "{}", e.id);
            assert!(e.title.is_some() && e.output.traces, "{}", e.id);
        }
    }

    #[test]
    fn every_claim_of_the_ledger_that_the_paper_makes_has_one_row() {
        let mut wrong = Vec::new();
        for paper in load(&[]).unwrap() {
            for claim in zonobench_claims::all()
                .iter()
                .filter(|c| c.paper == paper.name)
            {
                let rows = (paper.cells.iter())
                    .filter(|cell| cell.reading.is_as_written())
                    .filter(
                        |cell| matches!(&cell.comparand, Comparand::Claims(id) if id == claim.id),
                    )
                    .count();
                let wanted = usize::from(claim.class != Class::Remark);
                if rows != wanted {
                    wrong.push(format!(
                        "{} {} ({}): {rows} rows, expected {wanted}",
                        paper.name,
                        claim.id,
                        claim.class.name()
                    ));
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn no_number_is_compared_with_itself() {
        let mut wrong = Vec::new();
        for paper in load(&[]).unwrap() {
            for cell in &paper.cells {
                if let Some(pair) = cell.comparand.pair()
                    && (&pair.over, &pair.over_metric) == (&pair.of.estimator, &pair.of.metric)
                {
                    wrong.push(format!(
                        "{}: {}, {}, {}",
                        paper.name, cell.table, cell.row, cell.column
                    ));
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
