//! Everything that does not come out as written, paper by paper and table by table.

use super::{FRONT, place, query};
use crate::document::prose::prose;
use crate::document::{
    Block, Finding, Findings, Inline, Line, Page, anchor, code, emphasis, label, line, link_on,
    strong,
};
use crate::model;
use crate::source::Held;
use zonobench_lake::digits::four_digits;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::judged::Judged;

/// The page of all papers that were compared.
pub fn page(papers: &[&Held]) -> Page {
    let mut blocks = vec![Block::Para(prose(
        "Every number and every claim, theorems among them, that does not come out as written or could not be decided: what is \
         printed, what was measured, why, and the command that shows it. `zonobench dossier PAPER` has those of one paper, \
         with what would change each.",
    ))];
    blocks.extend(papers.iter().flat_map(|paper| of_paper(paper)));
    Page {
        place: "findings".to_owned(),
        name: "Findings".to_owned(),
        file: Some(FRONT.to_owned()),
        title: line!["Findings"],
        blocks,
    }
}

fn of_paper(paper: &Held) -> Vec<Block> {
    let tables = model::findings(paper).into_iter().map(|table| {
        let link = link_on(&place(&paper.name), &anchor(table.title), table.title);
        let command = format!("zonobench tables {} {:?}", paper.name, table.title);
        let decided = table.decided.iter().map(|f| Finding {
            why: asked(line![&*f.cell.reason], f.asked.as_ref()),
            ..finding(paper, &[f.cell])
        });
        let undecided = table.undecided.iter().map(|(_, same)| finding(paper, same));
        (line![link], command, decided.chain(undecided).collect())
    });
    let mut out = vec![
        Block::heading_at(2, &anchor(&format!("findings {}", paper.name)), &paper.name),
        Block::Findings(Findings {
            caption: paper.name.clone(),
            tables: tables.collect(),
        }),
    ];
    let turned: Vec<Line> = model::turned(paper).into_iter().map(turned).collect();
    if !turned.is_empty() {
        out.push(Block::Para(line![strong(
            "Holds as written, but not under another reading"
        )]));
        out.push(Block::list(turned));
    }
    out
}

/// A finding of cells that share their reason.
fn finding(paper: &Held, cells: &[&Judged]) -> Finding {
    let first = cells[0];
    Finding {
        claims: cells.iter().map(|c| claim(c)).collect(),
        measured: measured(first),
        verdict: first.verdict,
        why: line![&*first.reason],
        query: cell_query(&paper.name, first),
    }
}

fn measured(c: &Judged) -> Line {
    let Some(ours) = c.reproduced else {
        return Line::new();
    };
    let interval = c.interval.map(|(lo, hi)| format!(" {}", interval(lo, hi)));
    line![four_digits(ours), interval]
}

/// The reason, and on a line of its own what must be measured for the claim to hold.
fn asked(reason: Line, asked: Option<&(String, &str)>) -> Line {
    match asked {
        Some((asked, words)) => {
            line![
                reason,
                Inline::Break,
                "Asked for ",
                code(asked),
                ": ",
                *words
            ]
        }
        None => reason,
    }
}

fn claim(c: &Judged) -> Line {
    let column = (!c.column.is_empty()).then(|| format!(", {}", label(&c.column)));
    line![
        strong(label(&c.row)),
        column,
        format!(": printed “{}”", c.published)
    ]
}

/// A claim that comes out as written and turns under another reading.
fn turned(c: &Judged) -> Line {
    line![
        claim(c),
        format!(" ({}): ", c.table),
        Inline::Badge(c.verdict),
        " ",
        emphasis(c.reading.name()),
        format!(
            ": {}. {}",
            c.reproduced.map(four_digits).unwrap_or_default(),
            c.reason
        )
    ]
}

/// The query that gives one cell, with all its readings.
fn cell_query(paper: &str, c: &Judged) -> String {
    let quoted = |text: &str| text.replace('\'', "''");
    let mut sql = format!(
        "SELECT reading, published, reproduced, interval_lo, interval_hi, verdict, reason FROM comparison WHERE paper = '{paper}' \
         AND \"table\" = '{}' AND \"row\" = '{}'",
        quoted(&c.table),
        quoted(&c.row)
    );
    if !c.column.is_empty() {
        sql += &format!(" AND \"column\" = '{}'", quoted(&c.column));
    }
    query(&sql)
}
