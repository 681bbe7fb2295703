//! The front page: every table's verdicts at a glance; the findings; how to read a verdict.

use super::lake_tables::Measured;
use super::markup::{badge, blocks, class, code, commands, escaped, label, place, row, table};
use super::{Page, heading, link, title};
use crate::model;
use crate::source::Held;
use zonobench_lake::digits::four_digits;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::judged::{self, Judged, Subject};
use zonobench_verdicts::verdict::Verdict;

/// The front page.
pub fn overview(papers: &[&Held], measured: &Measured) -> Page {
    let compared: Vec<&Held> = papers
        .iter()
        .copied()
        .filter(|p| !p.comparisons.is_empty())
        .collect();
    let quick = compared.iter().any(|p| p.is_quick());
    let mut body = "<h1>What the papers print, and what comes out</h1>\n".to_owned();
    if quick {
        body += SMOKE_RUN;
    }
    if compared.is_empty() {
        body += "<p>This lake holds no published paper; <code>zonobench reproduce-all</code> makes them.</p>\n";
    } else {
        body += &introduction(&compared, quick);
        body += &matrix(&compared);
    }
    body += &missing(papers, measured);
    let own: Vec<&Held> = papers
        .iter()
        .copied()
        .filter(|p| p.comparisons.is_empty())
        .collect();
    if !own.is_empty() {
        body += &heading(2, "own", "Experiments compared with no printed number");
        let list: Vec<String> = own
            .iter()
            .map(|p| {
                format!(
                    "<li>{}: {}</li>",
                    link(&p.name, "", &p.name),
                    escaped(&p.experiments.join(", "))
                )
            })
            .collect();
        body += &format!("<ul>{}</ul>\n", list.concat());
    }
    body += &heading(2, "again", "Run it again");
    body += &commands(
        "cargo reproduce-all          # every experiment, the lake, these pages; nothing is computed twice\n\
         zonobench tables             # the tables in the terminal: zonobench tables [PAPER [TABLE]]\n\
         zonobench verify             # rehashes every file of the lake; checks that no guaranteed set lost the truth\n\
         zonobench report             # these pages alone",
    );
    Page {
        place: "overview".to_owned(),
        name: "Overview".to_owned(),
        body,
    }
}

/// What a page says first where its numbers are those of a smoke run.
pub const SMOKE_RUN: &str = "<p class=\"notice\"><strong>A smoke run</strong> (<code>reproduce-all --quick</code>): every \
                             method and every table with few runs and steps. Its numbers are compared with nothing; \
                             <code>reproduce-all</code> makes those that are.</p>\n";

fn introduction(papers: &[&Held], quick: bool) -> String {
    let mut out = format!(
        "<p>What {} paper{} on state estimation with zonotopes and boxes print{}, beside what comes out when it is run as it is \
         written.</p>\n",
        papers.len(),
        if papers.len() == 1 { "" } else { "s" },
        if papers.len() == 1 { "s" } else { "" }
    );
    if !quick {
        for tally in model::tallies(papers) {
            let parts: Vec<String> = (tally.parts.iter())
                .map(|p| {
                    format!(
                        "<li class=\"{}\"><b>{}</b> {}</li>",
                        class(p.like),
                        p.n,
                        p.what
                    )
                })
                .collect();
            out += &format!(
                "<p><b>{}</b> {}</p><ul class=\"tallies\">{}</ul>\n",
                tally.all,
                tally.subject.name(),
                parts.concat()
            );
        }
        out += "<p>Numbers were computed, parameters copied from the paper into the experiments; neither is summed with the other, \
                nor with the claims in words. Every one that does not come out is among the <a href=\"#findings\">findings</a>, \
                with its reason and a command that shows it. <a href=\"#reading\">How to read a verdict</a>.</p>\n";
    }
    out
}

/// Papers × tables by verdicts.
fn matrix(papers: &[&Held]) -> String {
    let columns = judged::columns(papers.iter().flat_map(|p| &p.comparisons));
    let counts = |cells: &[&Judged]| {
        let cells = || cells.iter().copied();
        let mut out = String::new();
        for subject in [Subject::Number, Subject::Claim] {
            let counts = judged::counts(cells().filter(|c| c.subject == subject));
            out += &format!("<td>{}</td>", bar(&counts));
        }
        for column in &columns {
            out += &match judged::in_column(cells(), *column) {
                0 => "<td class=\"zero\"></td>".to_owned(),
                n => format!("<td class=\"count {}\">{n}</td>", class(column.1)),
            };
        }
        out
    };
    let mut bodies = String::new();
    for paper in papers {
        let all: Vec<&Judged> = paper.comparisons.iter().collect();
        bodies += &format!(
            "<tbody><tr class=\"whole\"><th scope=\"rowgroup\">{} <span class=\"muted\">{}</span></th>{}</tr>\n",
            link(&paper.name, "", &paper.name),
            escaped(&title(&paper.name)),
            counts(&all)
        );
        for name in paper.tables() {
            let cells: Vec<&Judged> = all.iter().copied().filter(|c| &*c.table == name).collect();
            bodies += &format!(
                "<tr><th scope=\"row\" class=\"inner\">{}</th>{}</tr>\n",
                link(&paper.name, name, name),
                counts(&cells)
            );
        }
        bodies += "</tbody>";
    }
    let mut header = vec![
        "paper and table".to_owned(),
        "numbers".to_owned(),
        "claims".to_owned(),
    ];
    header.extend(columns.iter().map(|(subject, verdict)| {
        format!(
            "{} <span aria-hidden=\"true\">{}</span> {}",
            subject.name(),
            verdict.mark(),
            escaped(verdict.name()).replace('_', " ")
        )
    }));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    heading(2, "verdicts", "Verdicts at a glance")
        + &table(
            "matrix",
            "Numbers, parameters and claims of each table by verdict, the paper as written",
            &header,
            &bodies,
        )
}

/// Verdicts as shares of one bar; the counts beside it say the same in words.
fn bar(counts: &[(Verdict, usize)]) -> String {
    let sum: usize = counts.iter().map(|(_, n)| n).sum();
    let mut shares: Vec<(&str, usize)> = Vec::new();
    for (verdict, n) in counts {
        match shares.iter_mut().find(|(c, _)| *c == class(*verdict)) {
            Some((_, all)) => *all += n,
            None => shares.push((class(*verdict), *n)),
        }
    }
    let parts: Vec<String> = shares
        .iter()
        .map(|(class, n)| {
            let share = 100.0 * *n as f64 / sum.max(1) as f64;
            format!("<i class=\"{class}\" style=\"width:{share:.2}%\"></i>")
        })
        .collect();
    match sum {
        0 => String::new(),
        _ => format!(
            "<span class=\"bar\" aria-hidden=\"true\">{}</span>",
            parts.concat()
        ),
    }
}

/// What is not in this lake.
fn missing(papers: &[&Held], measured: &Measured) -> String {
    let [not_run, not_there] = model::absent(papers);
    let mut items: Vec<String> = Vec::new();
    let mut list = |folders: &[&str], why: &str| {
        for folder in folders {
            items.push(format!(
                "<li><b>{}</b>, {}: {why}</li>",
                escaped(folder),
                escaped(&title(folder))
            ));
        }
    };
    list(
        &not_run,
        "not in this lake; <code>zonobench reproduce-all</code> makes it",
    );
    list(
        &not_there,
        "in the bibliography, without experiments in this version",
    );
    for (table, command) in measured.missing() {
        items.push(format!(
            "<li>The table <code>{table}</code>: not in this lake; <code>zonobench {command}</code> is what makes it</li>"
        ));
    }
    if items.is_empty() {
        return String::new();
    }
    heading(2, "missing", "What is missing") + &format!("<ul>{}</ul>\n", items.concat())
}

/// Everything that does not come out as written.
pub fn findings(papers: &[&Held]) -> Page {
    let mut body = "<h1>Findings</h1>\n<p>Every number and every claim, theorems among them, that does not come out as written or \
                    could not be decided: what is printed, what was measured, why, and the command that shows it.</p>\n"
        .to_owned();
    if papers.iter().any(|p| p.is_quick()) {
        body += SMOKE_RUN;
    }
    for paper in papers {
        body += &heading(2, &place(&paper.name, "findings"), &escaped(&paper.name));
        let mut rows = String::new();
        let mut n = 0;
        for found in model::findings(paper) {
            let shown = |c: &Judged, claims: String, asked: Option<(&str, &str)>| {
                let mut measured = c.reproduced.map(four_digits).unwrap_or_default();
                if let Some((lo, hi)) = c.interval {
                    measured += &format!(" <span class=\"muted\">{}</span>", interval(lo, hi));
                }
                let mut why = escaped(&c.reason);
                if let Some((asked, words)) = asked {
                    why += &format!(
                        "<br><span class=\"muted\">Asked for {}: {}</span>",
                        code(asked),
                        escaped(words)
                    );
                }
                row(&[
                    claims,
                    link(&paper.name, found.title, found.title),
                    measured,
                    badge(c.verdict),
                    why,
                    format!(
                        "<details><summary>command</summary>{}</details>",
                        code(&cell_query(&paper.name, c))
                    ),
                ])
            };
            for f in &found.decided {
                rows += &shown(
                    f.cell,
                    claim(f.cell),
                    f.asked
                        .as_ref()
                        .map(|(asked, words)| (asked.as_str(), *words)),
                );
                n += 1;
            }
            for (_, same) in &found.undecided {
                let claims: Vec<String> = same.iter().map(|c| claim(c)).collect();
                rows += &shown(same[0], claims.join("<br>"), None);
                n += same.len();
            }
        }
        if rows.is_empty() {
            body += "<p>None.</p>\n";
        } else {
            body += &table(
                "findings sortable filtered",
                &format!("{}: {n} findings", paper.name),
                &[
                    "claim, as printed",
                    "table",
                    "measured",
                    "verdict",
                    "why",
                    "show it",
                ],
                &rows,
            );
        }
        let turned: Vec<String> = model::turned(paper)
            .into_iter()
            .map(|c| {
                format!(
                    "<li>{} ({}): {} <em>{}</em>: {}. {}</li>",
                    claim(c),
                    escaped(&c.table),
                    badge(c.verdict),
                    escaped(c.reading.name()),
                    c.reproduced.map(four_digits).unwrap_or_default(),
                    escaped(&c.reason)
                )
            })
            .collect();
        if !turned.is_empty() {
            body += "<h3>Holds as written, but not under another reading</h3>\n";
            body += &format!("<ul>{}</ul>\n", turned.concat());
        }
    }
    Page {
        place: "findings".to_owned(),
        name: "Findings".to_owned(),
        body,
    }
}

fn claim(c: &Judged) -> String {
    let column = if c.column.is_empty() {
        String::new()
    } else {
        format!(", {}", label(&c.column))
    };
    format!(
        "<b>{}</b>{column}: printed “{}”",
        label(&c.row),
        escaped(&c.published)
    )
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
    format!("zonobench query \"{}\"", in_double_quotes(&sql))
}

/// `text` so that a POSIX shell reads it as it is between double quotes.
pub fn in_double_quotes(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if matches!(c, '"' | '\\' | '$' | '`') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// What the verdicts mean and how the page is used.
pub fn how_to_read() -> Page {
    let rows: Vec<String> = Verdict::ALL
        .iter()
        .filter(|v| v.is_of_a_cell())
        .map(|v| row(&[badge(*v), escaped(v.meaning())]))
        .collect();
    let mut body = "<h1>How to read a verdict</h1>\n".to_owned();
    body += &blocks(
        "A row is a printed cell. Its first line is the paper as it is written, with the corrections that the paper's README in \
         `experiments/` lists. Lines with ↳ are **other readings** with a name: they are not the paper's equations, they show what \
         reaches the printed number, or what a claim turns into.\n\n\
         An interval is where a repetition of the paper's own experiment would print its number, with 99 % probability, given \
         ours: |difference| ≤ t √(sd²/runs of the paper + sd²/runs of ours), plus half a unit of the last printed digit. Of many \
         cells one in a hundred is outside by chance.\n\n\
         A claim in words is read as a comparison of a measured number, which stands beside it, and then holds or does not; where \
         the 99 % interval of the mean holds both outcomes it is undecided. A claim that something happens holds as soon as one \
         run shows it.\n\n\
         Point at a reproduced number, or move to it with Tab, to see all its digits and its run. Click it, or press Enter, for the \
         commands that make it again. Click a column's name to sort by it.",
    );
    body += &table("", "Verdicts", &["verdict", "meaning"], &rows.concat());
    body += "<p>The columns are those of the lake's table <code>comparison</code>; <code>CATALOG.md</code> in the lake describes \
             every table.</p>\n";
    Page {
        place: "reading".to_owned(),
        name: "How to read".to_owned(),
        body,
    }
}
