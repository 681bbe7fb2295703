//! The report as one HTML file, which needs nothing beside it: pages as sections, figures inside, a script and
//! a style sheet of our own.
//!
//! Without the script all sections stand below each other and every number can be read. With it one page is
//! shown at a time, tables sort and filter, a number shows its run, and a search goes over every cell.
//!
//! Unlike the Markdown pages it shows the times of this lake, and is not committed.

mod front;
mod lake_tables;
pub mod markup;
mod methods;
mod paper;

use crate::Recordings;
use crate::about::{self, Figure};
use crate::campaign;
use crate::peers;
use crate::source::{Held, Source};
use markup::{escaped, place};
use serde_json::{Map, Value, json};
use std::path::Path;
use zonobench_lake::error::Error;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A page of the report: a section of the file.
struct Page {
    /// Where links lead
    place: String,
    /// Its name in the navigation
    name: String,
    /// What it says, from its `<h1>` on
    body: String,
}

/// The whole report of `lake`.
pub fn render(
    lake: &Path,
    source: &Source,
    papers: &[(Held, Vec<Figure>)],
    recorded: &Recordings,
) -> Result<String, Error> {
    let held: Vec<&Held> = papers.iter().map(|(held, _)| held).collect();
    let measured = lake_tables::read(lake)?;
    let mut pages = vec![front::overview(&held, &measured)];
    let compared: Vec<&Held> = held
        .iter()
        .copied()
        .filter(|p| !p.comparisons.is_empty())
        .collect();
    if !compared.is_empty() {
        pages.push(front::findings(&compared));
    }
    for (held, figures) in papers {
        pages.push(paper::page(source, held, figures)?);
    }
    let times = methods::times(lake)?;
    pages.push(methods::ranking(source, &held, &times)?);
    pages.push(methods::real_time(lake, &held, &times, &recorded.steps)?);
    if !recorded.peers.is_empty() {
        pages.push(Page {
            place: "peers".to_owned(),
            name: "Other tools".to_owned(),
            body: peers::html(&recorded.peers),
        });
    }
    if !recorded.attacks.is_empty() {
        pages.push(Page {
            place: "campaign".to_owned(),
            name: "Campaign".to_owned(),
            body: campaign::html(&recorded.attacks),
        });
    }
    pages.push(lake_tables::page(&measured));
    pages.push(front::how_to_read());
    Ok(document(&pages, &experiments(&held)))
}

/// What the script says about the run behind a number: file, seed, runs and steps by `paper/experiment`.
fn experiments(papers: &[&Held]) -> Value {
    let mut all = Map::new();
    for paper in papers.iter().filter_map(|held| held.paper.as_ref()) {
        for e in &paper.experiments {
            all.insert(
                e.name(),
                json!([paper.file(&e.id), e.seed, e.runs, e.steps]),
            );
        }
    }
    Value::Object(all)
}

fn document(pages: &[Page], experiments: &Value) -> String {
    let links: Vec<String> = pages
        .iter()
        .map(|p| format!("<li><a href=\"#{}\">{}</a></li>", p.place, escaped(&p.name)))
        .collect();
    let sections: Vec<String> = pages
        .iter()
        .map(|p| {
            format!(
                "<section class=\"page\" id=\"{}\" data-name=\"{}\" tabindex=\"-1\">\n{}</section>\n",
                p.place,
                escaped(&p.name),
                p.body
            )
        })
        .collect();
    // In a script element only `</` could end it early.
    let experiments = experiments.to_string().replace("</", "<\\/");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>zonobench: results</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <a class=\"skip\" href=\"#main\">Skip to the results</a>\n\
         <header><p class=\"brand\"><a href=\"#{}\">zonobench</a></p>\n\
         <nav aria-label=\"Pages\"><ul>{}</ul></nav>\n<div id=\"tools\"></div></header>\n\
         <main id=\"main\" tabindex=\"-1\">\n{}</main>\n\
         <footer><p>zonobench {}, rendered by <code>zonobench report</code> from the lake alone.</p></footer>\n\
         <script type=\"application/json\" id=\"experiments\">{experiments}</script>\n\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        pages.first().map_or("", |p| &p.place),
        links.concat(),
        sections.concat(),
        env!("CARGO_PKG_VERSION"),
    )
}

/// A heading that links lead to.
fn heading(level: usize, place: &str, text: &str) -> String {
    format!("<h{level} id=\"{place}\">{text}</h{level}>\n")
}

/// The title of a paper, or its bare name.
fn title(folder: &str) -> String {
    about::reference(folder).map_or_else(|| folder.to_owned(), |work| work.title)
}

/// A link to a paper's page or a place on it.
fn link(paper: &str, name: &str, text: &str) -> String {
    format!("<a href=\"#{}\">{}</a>", place(paper, name), escaped(text))
}
