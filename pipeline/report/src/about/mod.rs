//! What is particular to a paper: what it says and what its figures show, a file a paper.

mod r#box;
mod bundle;
mod cz;
mod ezgkf;
mod inzsmf;
mod quadrotor;

use crate::figures::{Data, Drawing, Figure, at_steps};
use crate::source::Source;
use zonobench_lake::error::Error;
use zonobench_verdicts::papers::Paper;

/// The papers that have a page of their own.
const PAPERS: &[About] = &[
    r#box::ABOUT,
    ezgkf::ABOUT,
    inzsmf::ABOUT,
    cz::ABOUT,
    bundle::ABOUT,
];

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_published_paper_has_a_summary() {
        for folder in zonobench_verdicts::papers::names() {
            assert!(find(folder).is_some(), "{folder}");
        }
    }
}
