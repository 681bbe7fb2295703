//! The front page: what came out, every table's verdicts at a glance, what is missing; and what a verdict means.

use super::{FRONT, place, smoke_run};
use crate::bibliography;
use crate::document::prose::{blocks, prose};
use crate::document::{
    Block, Cell, Inline, Kind, Line, Page, Row, Shape, Table, anchor, joined, line, link_on,
    link_page,
};
use crate::model;
use crate::source::Held;
use zonobench_verdicts::judged::{self, Judged, Subject};
use zonobench_verdicts::verdict::{Tone, Verdict};

/// The front page; `further` are pages beside those of the papers.
pub fn page(papers: &[&Held], further: &[&Page]) -> Page {
    let (compared, own): (Vec<&Held>, Vec<&Held>) =
        papers.iter().partition(|p| !p.comparisons.is_empty());
    let quick = compared.iter().any(|p| p.is_quick());
    let mut blocks = Vec::new();
    if quick {
        blocks.push(smoke_run());
    }
    if !compared.is_empty() {
        blocks.extend(introduction(&compared, quick));
        blocks.extend(rerun());
        blocks.extend(matrix(&compared));
        blocks.extend(missing(papers));
    }
    if !own.is_empty() {
        blocks.extend(own_experiments(&own));
    }
    let further = further
        .iter()
        .map(|page| line![link_page(&page.place, page.title.clone())]);
    let further: Vec<Line> = further.collect();
    if !further.is_empty() {
        blocks.push(Block::Para(line!["Further: ", joined(further, " · "), "."]));
    }
    blocks.push(Block::Para(prose(
        "These pages are made by `zonobench report` from what the lake holds, and are the same on every machine: no time \
         that was measured now is on them.",
    )));
    Page {
        place: "overview".to_owned(),
        name: "Overview".to_owned(),
        file: Some(FRONT.to_owned()),
        title: line!["Results"],
        blocks,
    }
}

fn introduction(papers: &[&Held], quick: bool) -> Vec<Block> {
    let one = papers.len() == 1;
    let first = format!(
        "What {} paper{} on state estimation print{}, set beside what comes out when {} run as {} written.",
        papers.len(),
        if one { "" } else { "s" },
        if one { "s" } else { "" },
        if one { "it is" } else { "they are" },
        if one { "it is" } else { "they are" },
    );
    let mut out = Vec::new();
    if quick {
        out.push(Block::Para(line![first]));
    } else {
        out.push(Block::Para(line![
            first,
            " Numbers that were computed, parameters that were copied from the paper and claims in words are counted apart:"
        ]));
        out.push(Block::Tallies(model::tallies(papers)));
        let times: usize = papers.iter().map(|p| p.times()).sum();
        if times > 0 {
            out.push(Block::Para(prose(&format!(
                "{times} printed times and statements about times depend on the machine and are compared apart: `zonobench query \
                 \"SELECT * FROM timing_comparison\"`."
            ))));
        }
        out.push(Block::Para(line![
            link_page("findings", "Every finding"),
            " has its reason and a command that shows it."
        ]));
    }
    let paper = |p: &&Held| {
        let title = bibliography::reference(&p.name).map(|work| format!(": {}", work.title));
        line![link_page(&place(&p.name), &p.name), title]
    };
    out.push(Block::list(papers.iter().map(paper)));
    out
}

fn rerun() -> Vec<Block> {
    vec![
        Block::heading(2, "Run it again"),
        Block::Commands(
            "cargo reproduce-all          # every experiment, the lake, these pages; nothing is computed twice\n\
             zonobench tables             # the tables in the terminal: zonobench tables [PAPER [TABLE]]\n\
             zonobench verify             # rehashes every file of the lake; checks that no guaranteed set lost the truth\n\
             zonobench report             # these pages alone"
                .to_owned(),
        ),
        Block::Para(prose(
            "In a clone `cargo zonobench …` is the same as `zonobench …`.",
        )),
    ]
}

/// Tables by verdicts, numbers, parameters and claims apart.
fn matrix(papers: &[&Held]) -> Vec<Block> {
    let columns = judged::columns(papers.iter().flat_map(|p| &p.comparisons));
    let mut heads = vec![
        ("paper".to_owned(), Shape::Words),
        ("table".to_owned(), Shape::Words),
        ("numbers".to_owned(), Shape::Drawn),
        ("claims".to_owned(), Shape::Drawn),
    ];
    // Spaces let the narrow columns break their names.
    heads.extend(columns.iter().map(|(subject, verdict)| {
        let name = format!("{}: {}", subject.name(), verdict.shown()).replace('_', " ");
        (name, Shape::Number)
    }));
    let heads: Vec<(&str, Shape)> = heads.iter().map(|(name, s)| (name.as_str(), *s)).collect();
    let caption = "Numbers, parameters and claims of each table by verdict, the paper as written";
    let mut table = Table::new(Kind::Matrix, caption, &heads, Vec::new());
    table.bodies = papers.iter().map(|paper| rows(paper, &columns)).collect();
    vec![
        Block::heading_at(2, "verdicts", "Verdicts at a glance"),
        Block::Para(line![
            "Numbers, parameters and claims of each table by verdict, the paper as written (",
            link_page("legend", "what they mean"),
            ")."
        ]),
        Block::Table(table),
    ]
}

/// A row of all tables of a paper, and one of each.
fn rows(paper: &Held, columns: &[judged::Column]) -> Vec<Row> {
    let all: Vec<&Judged> = paper.comparisons.iter().collect();
    let page = place(&paper.name);
    let mut rows = vec![Row {
        cells: [link_page(&page, &paper.name).into(), "all".into()]
            .into_iter()
            .chain(counts(&all, columns))
            .collect(),
        whole: true,
    }];
    for title in paper.tables() {
        let cells: Vec<&Judged> = all.iter().copied().filter(|c| &*c.table == title).collect();
        // A title that is not broken between its words.
        let unbroken = title.replace(' ', "\u{a0}");
        let link = link_on(&page, &anchor(title), unbroken);
        rows.push(Row {
            cells: [Cell::from(&paper.name), link.into()]
                .into_iter()
                .chain(counts(&cells, columns))
                .collect(),
            whole: false,
        });
    }
    rows
}

/// Bars of the numbers and of the claims, then a count a column.
fn counts(cells: &[&Judged], columns: &[judged::Column]) -> Vec<Cell> {
    let bar = |subject: Subject| {
        let mut shares: Vec<(Tone, usize)> = Vec::new();
        for (verdict, n) in judged::counts(cells.iter().copied().filter(|c| c.subject == subject)) {
            match shares.iter_mut().find(|(tone, _)| *tone == verdict.tone()) {
                Some((_, all)) => *all += n,
                None => shares.push((verdict.tone(), n)),
            }
        }
        Cell::from(Inline::Bar(shares))
    };
    let mut out = vec![bar(Subject::Number), bar(Subject::Claim)];
    out.extend(columns.iter().map(|column| {
        match judged::in_column(cells.iter().copied(), *column) {
            0 => Cell::default(),
            n => Cell {
                line: line![n.to_string()],
                tone: Some(column.1.tone()),
            },
        }
    }));
    out
}

/// Which papers are not here.
fn missing(papers: &[&Held]) -> Vec<Block> {
    let list = |folders: Vec<&str>, words: &str| {
        let of = |folder: &str| line![folder, ": ", bibliography::title(folder)];
        let list = Block::list(folders.iter().map(|folder| of(folder)));
        match folders.is_empty() {
            true => Vec::new(),
            false => vec![Block::Para(prose(words)), list],
        }
    };
    let [not_run, not_there] = model::absent(papers);
    let mut out = list(
        not_run,
        "Not in this lake, `zonobench reproduce-all` makes them:",
    );
    out.extend(list(
        not_there,
        "In the bibliography, and without experiments in this version:",
    ));
    out
}

/// The user's own experiments.
fn own_experiments(own: &[&Held]) -> Vec<Block> {
    let paper = |held: &&Held| {
        let page = place(&held.name);
        let experiments = held
            .experiments
            .iter()
            .map(|id| line![link_on(&page, &anchor(&format!("experiment {id}")), id)]);
        line![
            link_page(&page, &held.name),
            ": ",
            joined(experiments, ", ")
        ]
    };
    vec![
        Block::heading(2, "Experiments compared with no printed number"),
        Block::Para(line!["Their pictures and scores are on their page."]),
        Block::list(own.iter().map(paper)),
    ]
}

/// What the verdicts mean.
pub fn legend() -> Page {
    let rows = Verdict::ALL.iter().filter(|v| v.is_of_a_cell());
    let rows = rows.map(|v| vec![Inline::Badge(*v).into(), v.meaning().into()]);
    let columns = [("verdict", Shape::Words), ("meaning", Shape::Words)];
    let mut all = blocks(
        "A row is a printed cell. Its first line is the paper as it is written, with the corrections that the paper's README in \
         `experiments/` lists. Lines with ↳ are **other readings** with a name: they are not the paper's equations, they show what \
         reaches the printed number, or what a claim turns into.\n\n\
         An interval is where a repetition of the paper's own experiment would print its number, with 99 % probability, given \
         ours: |difference| ≤ t √(sd²/runs of the paper + sd²/runs of ours), plus half a unit of the last printed digit. Of many \
         cells one in a hundred is outside by chance.\n\n\
         A claim in words is read as a comparison of a measured number, which stands beside it, and then holds or does not; where \
         the 99 % interval of the mean holds both outcomes it is undecided. A claim that something happens holds as soon as one \
         run shows it.",
    );
    all.push(Block::Table(Table::new(
        Kind::Plain,
        "Verdicts",
        &columns,
        rows.collect(),
    )));
    all.push(Block::Para(prose(
        "The columns of the tables are those of the lake's table `comparison`; `CATALOG.md` in the lake describes it.",
    )));
    Page {
        place: "legend".to_owned(),
        name: "How to read".to_owned(),
        file: Some(FRONT.to_owned()),
        title: line!["What a verdict means"],
        blocks: all,
    }
}
