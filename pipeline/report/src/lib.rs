//! The reports, rendered from what the lake holds: Markdown with SVG, and one HTML file.
//!
//! A front page (`README.md`: the verdicts of all tables, the findings, the legend) and a page a paper
//! with its tables and figures. What is particular to a paper, what it says and what its figures show,
//! is a file of `about`; a new paper adds a file and a line there. An experiment of a user's own has a
//! page with its scores.
//!
//! `model` is what there is to say, `front` and `page` write it as Markdown, `html` as a page for a browser.
//!
//! The same lake gives the same Markdown: no time, host or path of this machine is on a page. Measured times
//! come from the recorded `timings.csv`, `step-times.csv` and `peers.csv` beside the pages alone, never from the lake; so do
//! the counts of the long campaign, from `attack.csv`.

mod about;
mod campaign;
mod complexity;
mod dossier;
mod front;
mod html;
mod markdown;
mod model;
mod page;
mod peers;
mod source;
mod step_times;
mod svg;
mod timings;

#[cfg(test)]
mod tests;

pub use dossier::dossier;

use about::Figure;
use peers::PeerRow;
use source::{Held, Source};
use std::collections::BTreeMap;
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
            attacks: long_campaign::read(&folder.join(campaign::FILE))?,
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
    let recorded = Recordings::read(out)?;
    let mut pages = render(&source, &papers, &recorded)?;
    let (own, page) = (
        HTML.to_owned(),
        html::render(lake, &source, &papers, &recorded)?,
    );
    pages.insert(own, page);
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
        let figures = match about::find(&held.name) {
            Some(about) => about.figures(source, held.paper.as_ref())?,
            None => Vec::new(),
        };
        Ok((held, figures))
    };
    source.papers()?.into_iter().map(of).collect()
}

/// Every file of the Markdown reports by its path, with `/`, below their folder.
fn render(
    source: &Source,
    papers: &[(Held, Vec<Figure>)],
    recorded: &Recordings,
) -> Result<BTreeMap<String, String>, Error> {
    let held: Vec<&Held> = papers.iter().map(|(held, _)| held).collect();
    let front = front::page(&held)
        + &campaign::section(&recorded.attacks)
        + &peers::pointer(&recorded.peers);
    let mut pages = BTreeMap::from([("README.md".to_owned(), front)]);
    if !recorded.peers.is_empty() {
        pages.insert("peers.md".to_owned(), peers::page(&recorded.peers));
        pages.insert(peers::CHART.to_owned(), peers::chart(&recorded.peers));
    }
    for (held, figures) in papers {
        for (name, text) in page::of(source, held, figures, &recorded.times, &recorded.steps)? {
            pages.insert(format!("{}/{name}", held.name), text);
        }
    }
    Ok(pages)
}
