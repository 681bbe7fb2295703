//! The reports: Markdown and SVG, rendered from what the lake holds.
//!
//! A front page (`README.md`: the verdicts of all tables, the findings, the legend) and a page a paper
//! with its tables and figures. What is particular to a paper, what it says and what its figures show,
//! is a file of `about`; a new paper adds a file and a line there. An experiment of a user's own has a
//! page with its scores.
//!
//! The same lake gives the same bytes: no time, host or path of this machine is on a page. Measured times
//! come from the recorded `timings.csv` beside the pages alone, never from the lake.

mod about;
mod complexity;
mod front;
mod markdown;
mod page;
mod source;
mod timings;
mod verdict;

#[cfg(test)]
mod tests;

use crate::error::Error;
use source::Source;
use std::collections::BTreeMap;
use std::path::Path;
use timings::RecordedTime;

/// Writes the reports of everything that `lake` holds into `out`; returns the number of files.
///
/// Recorded times are read from `out/timings.csv` where it exists. Files that are already as they should
/// be are left alone, and so is everything else in `out`.
pub fn write(lake: &Path, out: &Path) -> Result<usize, Error> {
    let pages = render(lake, &timings::read(&out.join("timings.csv"))?)?;
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

/// Every file of the reports by its path, with `/`, below their folder.
fn render(lake: &Path, times: &[RecordedTime]) -> Result<BTreeMap<String, String>, Error> {
    let source = Source::open(lake)?;
    let papers = source.papers()?;
    let mut pages = BTreeMap::from([("README.md".to_owned(), front::page(&papers))]);
    for paper in &papers {
        for (name, text) in page::of(&source, paper, times)? {
            pages.insert(format!("{}/{name}", paper.name), text);
        }
    }
    Ok(pages)
}
