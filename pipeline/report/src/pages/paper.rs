//! The page of a paper: what it says, its tables and figures, how to run it again. A name of the user's own
//! has a page too, with the pictures and scores of its experiments.

use super::{complexity, experiments, ledger, place, printed, smoke_run};
use crate::Recordings;
use crate::bibliography;
use crate::document::prose::prose;
use crate::document::{
    Block, Inline, Line, Page, Picture, anchor, code, emphasis, joined, line, link_here, link_page,
};
use crate::figures::{Drawing, Figure, papers};
use crate::source::{Held, Source};
use crate::step_times::{self, StepTimes};
use zonobench_lake::error::Error;

/// The page of `held`.
pub fn page(
    source: &Source,
    held: &Held,
    figures: &[Figure],
    recorded: &Recordings,
) -> Result<Page, Error> {
    let about = papers::about(&held.name)?;
    let work = bibliography::reference(&held.name);
    let back = link_page("overview", "All results");
    let mut blocks = vec![Block::Para(match &work {
        Some(work) => line![
            &work.citation,
            " Key ",
            code(&work.key),
            " in ",
            code("references.bib"),
            ". · ",
            back
        ],
        None => line![back],
    })];
    if held.is_quick() {
        blocks.push(smoke_run());
    }
    blocks.push(contents(held, figures));
    if let Some(about) = &about {
        blocks.push(Block::heading(2, "What the paper says"));
        blocks.extend(about.says.clone());
    }
    if !held.comparisons.is_empty() {
        blocks.extend(printed::tables(held));
        blocks.extend(printed::times(held, &recorded.times));
    }
    if let Some(steps) = StepTimes::of(&recorded.steps, &held.name) {
        blocks.extend(real_time(&steps));
    }
    blocks.extend(ledger::claims(held));
    blocks.extend(ledger::attacks(&held.attacks));
    if !held.comparisons.is_empty() && !figures.is_empty() {
        blocks.push(Block::heading(2, "Figures"));
        blocks.extend(figures.iter().flat_map(|f| figure(f, 3)));
        blocks.extend(about.map(|about| about.not_drawn).unwrap_or_default());
    }
    blocks.extend(complexity::section(
        &held.name,
        &source.complexity(&held.name)?,
    ));
    blocks.extend(experiments::section(source, held, figures)?);
    let title = work.map(|work| format!(": {}", work.title));
    Ok(Page {
        place: place(&held.name),
        name: held.name.clone(),
        file: Some(format!("{}/README.md", held.name)),
        title: line![&held.name, title],
        blocks,
    })
}

fn contents(held: &Held, figures: &[Figure]) -> Block {
    let here = |text: &str| line![link_here(&anchor(text), text)];
    let group = |name: &str, links: Vec<Line>| {
        (!links.is_empty()).then(|| line![name, joined(links, " · ")])
    };
    let tables = held.tables().into_iter().map(here).collect();
    let drawn = |f: &Figure| line![link_here(&drawing(f), &f.name)];
    let mut groups = Vec::new();
    groups.extend(group("Tables and claims: ", tables));
    if !held.claims.is_empty() {
        groups.push(here(ledger::CLAIMS));
    }
    if !held.comparisons.is_empty() {
        groups.extend(group("Figures: ", figures.iter().map(drawn).collect()));
        groups.push(here(experiments::AGAIN));
    } else {
        let own = held.experiments.iter();
        let own = own.map(|id| line![link_here(&anchor(&format!("experiment {id}")), id)]);
        groups.extend(group("Experiments: ", own.collect()));
    }
    Block::Contents(groups)
}

/// A figure may have printed numbers too: its picture has another place than their table.
fn drawing(figure: &Figure) -> String {
    format!("drawing-{}", anchor(&figure.name))
}

/// Ids of experiments are names of folders, and may differ in what an anchor leaves out.
fn file(figure: &Figure) -> String {
    match figure.experiment {
        Some(_) => format!("{}.svg", figure.name),
        None => format!("{}.svg", anchor(&figure.name)),
    }
}

/// The picture of a figure, what is to be seen, and where the data are; or why it is not drawn.
pub fn figure(figure: &Figure, level: usize) -> Vec<Block> {
    let title = match figure.experiment {
        // It stands below the name of its experiment.
        Some(_) => line![&figure.title],
        None => line![&figure.name, ": ", &figure.title],
    };
    let mut out = vec![Block::Heading {
        level,
        anchor: drawing(figure),
        text: title,
    }];
    let Drawing {
        svg,
        caption,
        below,
        data,
    } = match &figure.drawing {
        Ok(drawing) => drawing,
        Err(why) => {
            out.push(Block::Para(line![format!("Not drawn: {why}.")]));
            return out;
        }
    };
    let seed = line![
        "Experiment ",
        code(&data.experiment),
        format!(", seed {}, run 0.", data.seed)
    ];
    out.push(Block::Picture(Picture {
        file: file(figure),
        title: format!("{}: {}", figure.name, figure.title),
        svg: svg.clone(),
        caption: line![emphasis(seed), " ", prose(caption)],
    }));
    out.extend(below.clone());
    let files = data
        .files
        .iter()
        .map(|file| line![Inline::Code(file.clone())]);
    let queries = data.sql.iter().map(|sql| super::query(sql));
    out.push(Block::Details {
        summary: line!["Where the data are"],
        inside: vec![
            Block::Para(line!["Files below the lake:"]),
            Block::list(files),
            Block::Commands(queries.collect::<Vec<_>>().join("\n")),
        ],
    });
    out
}

/// The recorded times of single steps: a histogram, the quantiles, and where the time goes.
fn real_time(steps: &StepTimes) -> Vec<Block> {
    let mut out = vec![
        Block::heading(3, "Real time"),
        Block::Para(prose(&steps.words())),
        Block::Picture(Picture {
            file: step_times::PICTURE.to_owned(),
            title: "How long a step takes".to_owned(),
            svg: steps.picture(),
            caption: Line::new(),
        }),
    ];
    out.extend(steps.tables().into_iter().map(Block::Table));
    out
}
