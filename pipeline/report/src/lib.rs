//! The reports, rendered from what the lake holds: Markdown with SVG, and one HTML file.
//!
//! A front page (`README.md`: the verdicts of all tables, the findings, the legend) and a page a paper
//! with its tables and figures. What is particular to a paper, what it says and what its figures show,
//! is in `about.md` and `figures.toml` of its folder in `experiments/`. An experiment of a user's own has a
//! page with pictures and its scores.
//!
//! `source` reads the lake, `model` finds what there is to say, `pages` says it in a `document`, and `render` writes that
//! as Markdown and as HTML: the same content twice.
//!
//! The same lake gives the same Markdown: no time, host or path of this machine is on a page. Measured times
//! come from the recorded `timings.csv`, `step-times.csv` and `peers.csv` beside the pages alone, never from the lake; so do
//! the counts of the long campaign, from `attack.csv`.

mod bibliography;
mod document;
mod figures;
mod model;
mod pages;
mod render;
mod source;
mod step_times;
mod svg;
mod timings;

#[cfg(test)]
mod tests;

pub use pages::dossier;

use document::Page;
use figures::Figure;
use pages::peers::{self, PeerRow};
use serde_json::{Map, Value, json};
use source::{Held, Source};
use std::path::Path;
use timings::RecordedTime;
use zonobench_engine::long_campaign::{self, RecordedAttack};
use zonobench_lake::error::Error;

/// Where the HTML page lies below the folder of the reports.
pub const HTML: &str = "html/index.html";

/// What was measured once, on a machine that the file names, and is kept beside the pages.
#[derive(Default)]
struct Recordings {
    /// `timings.csv`: the median step of every estimator.
    times: Vec<RecordedTime>,
    /// `step-times.csv`: the distribution of single steps, and where the time goes.
    steps: Vec<step_times::Recorded>,
    /// `peers.csv`: other tools on the same sets.
    peers: Vec<PeerRow>,
    /// `attack.csv`: the counts of the long campaign.
    attacks: Vec<RecordedAttack>,
}

impl Recordings {
    /// What lies in `folder`; a file that is not there is empty.
    fn read(folder: &Path) -> Result<Self, Error> {
        Ok(Self {
            times: timings::read(&folder.join("timings.csv"))?,
            steps: step_times::read(&folder.join(step_times::FILE))?,
            peers: peers::read(&folder.join("peers.csv"))?,
            attacks: long_campaign::read(&folder.join(pages::ATTACKS))?,
        })
    }
}

/// Writes the reports of everything that `lake` holds into `out`; returns the number of files.
///
/// Recorded times are read from the CSV files in `out`. Files that are already as they should
/// be are left alone, and so is everything else in `out`.
pub fn write(lake: &Path, out: &Path) -> Result<usize, Error> {
    let source = Source::open(lake)?;
    let papers = drawn(&source)?;
    let document = pages::all(&source, &papers, &Recordings::read(out)?)?;
    let mut pages = render::markdown::files(&document);
    pages.insert(HTML.to_owned(), html(&document, &papers));
    for (name, text) in &pages {
        let path = out.join(name);
        if std::fs::read(&path).is_ok_and(|old| old == text.as_bytes()) {
            continue;
        }
        let folder = path.parent().expect("a page lies in a folder");
        std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
        std::fs::write(&path, text).map_err(|e| Error::io("write", &path, e))?;
    }
    Ok(pages.len())
}

/// What the lake holds of each paper, and its figures.
fn drawn(source: &Source) -> Result<Vec<(Held, Vec<Figure>)>, Error> {
    let of = |held: Held| {
        let figures = match figures::papers::figures(source, &held)? {
            Some(figures) => figures,
            None => figures::of_own(source, &held.name, &held.experiments)?,
        };
        Ok((held, figures))
    };
    source.papers()?.into_iter().map(of).collect()
}

/// The HTML file of a document.
fn html(document: &[Page], papers: &[(Held, Vec<Figure>)]) -> String {
    render::html::file(document, &experiments(papers))
}

/// What the script says about the run behind a number: file, seed, runs and steps by `paper/experiment`.
fn experiments(papers: &[(Held, Vec<Figure>)]) -> Value {
    let mut all = Map::new();
    for paper in papers.iter().filter_map(|(held, _)| held.paper.as_ref()) {
        for e in &paper.experiments {
            let run = json!([paper.file(&e.id), e.seed, e.runs, e.steps]);
            all.insert(e.name(), run);
        }
    }
    Value::Object(all)
}
