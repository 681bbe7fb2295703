//! The pages, each built from what the lake holds.

mod campaign;
mod complexity;
mod dossier;
mod experiments;
mod findings;
mod ledger;
mod overview;
mod paper;
pub mod peers;
mod printed;
mod ranking;
mod times;

pub use campaign::FILE as ATTACKS;
pub use dossier::dossier;

use crate::Recordings;
use crate::document::{Block, Page};
use crate::figures::Figure;
use crate::source::{Held, Source};
use zonobench_lake::error::Error;

/// The Markdown file of the front pages.
const FRONT: &str = "README.md";

/// Every page, in the order of the navigation.
pub fn all(
    source: &Source,
    papers: &[(Held, Vec<Figure>)],
    recorded: &Recordings,
) -> Result<Vec<Page>, Error> {
    let held: Vec<&Held> = papers.iter().map(|(held, _)| held).collect();
    let compared: Vec<&Held> = (held.iter().copied())
        .filter(|p| !p.comparisons.is_empty())
        .collect();
    let ranking = ranking::page(source, &held, &recorded.times)?;
    let peers = peers::page(&recorded.peers);
    let campaign = campaign::page(&recorded.attacks);
    let further: Vec<&Page> = [&ranking, &campaign, &peers]
        .into_iter()
        .flatten()
        .collect();
    let mut pages = vec![overview::page(&held, &further)];
    if !compared.is_empty() {
        // The numbers of a smoke run are compared with nothing.
        if !compared.iter().any(|p| p.is_quick()) {
            pages.push(findings::page(&compared));
        }
        pages.push(overview::legend());
    }
    for (held, figures) in papers {
        pages.push(paper::page(source, held, figures, recorded)?);
    }
    pages.extend(ranking);
    pages.extend(times::page(source, &held)?);
    pages.extend(peers);
    pages.extend(campaign);
    Ok(pages)
}

/// The place of the page of a paper.
fn place(paper: &str) -> String {
    format!("paper-{}", crate::document::anchor(paper))
}

/// What a page says first where its numbers are those of a smoke run.
fn smoke_run() -> Block {
    Block::Notice(crate::document::prose::prose(
        "**A smoke run** (`reproduce-all --quick`): every method and every table with few runs and steps. Its numbers are \
         compared with nothing; `reproduce-all` makes those that are.",
    ))
}

/// `text` so that a POSIX shell reads it as it is between double quotes.
fn in_double_quotes(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if matches!(c, '"' | '\\' | '$' | '`') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// The command that runs a query.
fn query(sql: &str) -> String {
    format!("zonobench query \"{}\"", in_double_quotes(sql))
}
