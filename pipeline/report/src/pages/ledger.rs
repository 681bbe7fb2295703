//! A paper's numbered claims, tried in exact arithmetic: what holds, what does not with its counterexample, and apart from
//! both the remarks of ours.

use crate::document::{Block, Inline, Line, badge, code, line, strong};
use crate::document::{Kind, Shape, Table};
use crate::source::Held;
use zonobench_lake::digits::four_digits;
use zonobench_lake::rows::{Attack, Claim};
use zonobench_verdicts::verdict::Verdict;

/// The heading of the claims.
pub const CLAIMS: &str = "Theorems, propositions, remarks";

/// The claims of a paper; nothing where none was tried.
pub fn claims(held: &Held) -> Vec<Block> {
    if held.claims.is_empty() {
        return Vec::new();
    }
    let is = |verdict: Verdict| move |c: &&Claim| Verdict::parse(&c.verdict) == Ok(verdict);
    let (remarks, own): (Vec<&Claim>, Vec<&Claim>) =
        held.claims.iter().partition(is(Verdict::Remark));
    let number = own.len();
    let (holding, failing): (Vec<&Claim>, Vec<&Claim>) =
        own.into_iter().partition(is(Verdict::Holds));
    let mut first = line![
        "What the paper states, tried in exact rational arithmetic (",
        code(format!("zonobench claims {}", held.name)),
        format!("): {number} statements, each with a row in the tables above."),
    ];
    if !holding.is_empty() {
        let names: Vec<&str> = holding.iter().map(|c| &*c.claim).collect();
        first.push(Inline::Text(format!(
            " In every trial {} hold{}: {}. That is no proof.",
            holding.len(),
            if holding.len() == 1 { "s" } else { "" },
            names.join(", ")
        )));
    }
    let failing = failing.into_iter().map(|c| {
        let verdict = badge(&c.verdict);
        line![
            strong(&*c.claim),
            ", ",
            verdict,
            format!(": \"{}\".", c.statement),
            evidence(c)
        ]
    });
    let mut out = vec![Block::heading(2, CLAIMS), Block::Para(first)];
    out.push(Block::list(failing));
    if !remarks.is_empty() {
        out.push(Block::heading(3, "Remarks of ours"));
        out.push(Block::Para(line![
            "What we found beside the paper's statements. The paper does not say these things: they are charged to nobody, \
             and are in no count."
        ]));
        out.push(Block::list(remarks.into_iter().map(|c| {
            let statement = c.statement.trim_end_matches('.');
            line![strong(&*c.claim), format!(": {statement}."), evidence(c)]
        })));
    }
    out
}

/// The counterexample and what follows. How many of the drawn trials were lost measures who drew them.
fn evidence(c: &Claim) -> Line {
    let parts = [
        ("Counterexample", &c.counterexample),
        ("Consequence", &c.consequence),
    ];
    let shown = parts.iter().filter(|(_, part)| !part.is_empty());
    let text: String = shown
        .map(|(label, part)| format!(" {label}: {}.", part.trim_end_matches('.')))
        .collect();
    line![text]
}

/// The small campaign against the guarantees of a paper's methods; nothing where none was made.
pub fn attacks(rows: &[(String, Vec<Attack>)]) -> Vec<Block> {
    if rows.is_empty() {
        return Vec::new();
    }
    let columns = [
        ("system", Shape::Words),
        ("estimator", Shape::Words),
        ("attack", Shape::Words),
        ("guaranteed", Shape::Words),
        ("sets", Shape::Number),
        ("undecided", Shape::Number),
        ("lost", Shape::Number),
        ("of them called empty", Shape::Number),
        ("refused", Shape::Number),
        ("rate of losses below (95 %, sets as trials)", Shape::Number),
    ];
    let cells = rows.iter().flat_map(|(system, rows)| {
        rows.iter().map(move |row| {
            let guaranteed = if row.guaranteed { "yes" } else { "no" };
            let counts = [row.steps, row.undecided, row.lost, row.empty, row.refused];
            let mut cells = vec![
                system.into(),
                (&*row.estimator).into(),
                (&*row.attack).into(),
                guaranteed.into(),
            ];
            cells.extend(counts.map(|n| n.to_string().into()));
            cells.push(four_digits(row.rate_hi).into());
            cells
        })
    });
    let lost: i64 = (rows.iter().flat_map(|(_, rows)| rows))
        .filter(|row| row.guaranteed)
        .map(|row| row.lost)
        .sum();
    let number = rows.iter().map(|(_, rows)| rows.len()).sum::<usize>();
    vec![
        Block::heading(2, "Attacks on the guarantees"),
        Block::Para(line![
            "The small campaign of every ",
            code("reproduce-all"),
            ": noise, first states and sets chosen to drive the truth out of a set that is guaranteed to hold it. \
             Guaranteed sets that were lost: ",
            strong(lost.to_string()),
            "."
        ]),
        Block::Details {
            summary: line![format!("{number} attacks")],
            inside: vec![Block::Table(Table::new(
                Kind::Sortable,
                "Attacks",
                &columns,
                cells.collect(),
            ))],
        },
    ]
}
