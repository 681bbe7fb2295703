//! The front page: every table's verdicts at a glance, the findings, the legend.

use crate::about;
use crate::markdown::{anchor, code, escaped, heading, table};
use crate::model::{self, TableFindings};
use crate::page::{interval, label, smoke_run};
use crate::source::Held;
use zonobench_lake::digits::four_digits;
use zonobench_verdicts::judged::{self, Judged};
use zonobench_verdicts::verdict::Verdict;

/// The front page.
pub fn page(papers: &[&Held]) -> String {
    let compared: Vec<&Held> = papers
        .iter()
        .copied()
        .filter(|p| !p.comparisons.is_empty())
        .collect();
    let own: Vec<&Held> = papers
        .iter()
        .copied()
        .filter(|p| p.comparisons.is_empty())
        .collect();
    let quick = compared.iter().any(|p| p.is_quick());
    let mut out = "# Results\n\n".to_owned();
    if quick {
        out += &smoke_run();
    }
    if !compared.is_empty() {
        out += &introduction(&compared, quick);
        out += &rerun();
        out += &matrix(&compared);
        out += &missing(papers);
        if !quick {
            out += &findings(&compared);
        }
        out += &heading(2, "Legend", "What a verdict means");
        out += &legend();
        out += "\nThe columns of the tables are those of the lake's table `comparison`; `CATALOG.md` in the lake describes it.\n\n";
    }
    if !own.is_empty() {
        out += &own_experiments(&own);
    }
    out += "These pages are made by `zonobench report` from what the lake holds, and are the same on every machine: no time \
            that was measured now is on them.\n";
    out
}

fn introduction(papers: &[&Held], quick: bool) -> String {
    let one = papers.len() == 1;
    let mut out = format!(
        "What {} paper{} on state estimation print{}, set beside what comes out when {} run as {} written",
        papers.len(),
        if one { "" } else { "s" },
        if one { "s" } else { "" },
        if one { "it is" } else { "they are" },
        if one { "it is" } else { "they are" },
    );
    if quick {
        return out + ".\n\n";
    }
    out += ". Numbers that were computed, parameters that were copied from the paper and claims in words are counted apart:\n\n";
    for tally in model::tallies(papers) {
        out += &format!(
            "- {}\n",
            tally.sentence(|part| format!("**{}** {}", part.n, part.what))
        );
    }
    let times: usize = papers.iter().map(|p| p.times()).sum();
    if times > 0 {
        out += &format!(
            "- {times} printed times and statements about times, which depend on the machine and are compared apart: `zonobench query \
             \"SELECT * FROM timing_comparison\"`\n"
        );
    }
    out += "\n[Every finding](#findings) has its reason and a command that shows it.\n\n";
    let pages: Vec<String> = papers
        .iter()
        .map(|p| {
            let title = about::reference(&p.name)
                .map(|work| format!(": {}", escaped(&work.title)))
                .unwrap_or_default();
            format!("- [{0}]({1}/README.md){title}", escaped(&p.name), p.name)
        })
        .collect();
    out + &pages.join("\n") + "\n\n"
}

fn rerun() -> String {
    heading(2, "Run it again", "Run it again")
        + "```sh\n\
           cargo reproduce-all          # every experiment, the lake, these pages; nothing is computed twice\n\
           zonobench tables             # the tables in the terminal: zonobench tables [PAPER [TABLE]]\n\
           zonobench verify             # rehashes every file of the lake; checks that no guaranteed set lost the truth\n\
           zonobench report             # these pages alone\n\
           ```\n\n\
           In a clone `cargo zonobench …` is the same as `zonobench …`.\n\n"
}

/// Tables by verdicts, numbers, parameters and claims apart.
fn matrix(papers: &[&Held]) -> String {
    let columns = judged::columns(papers.iter().flat_map(|p| &p.comparisons));
    let counts = |cells: &[&Judged]| -> Vec<String> {
        let of = |column| match judged::in_column(cells.iter().copied(), column) {
            0 => String::new(),
            n => n.to_string(),
        };
        columns.iter().map(|column| of(*column)).collect()
    };
    let mut rows = Vec::new();
    for paper in papers {
        let page = format!("{}/README.md", paper.name);
        let all: Vec<&Judged> = paper.comparisons.iter().collect();
        let name = escaped(&paper.name);
        let mut row = vec![format!("**[{name}]({page})**"), "**all**".to_owned()];
        row.extend(
            counts(&all)
                .into_iter()
                .map(|n| if n.is_empty() { n } else { format!("**{n}**") }),
        );
        rows.push(row);
        for title in paper.tables() {
            let cells: Vec<&Judged> = all.iter().copied().filter(|c| &*c.table == title).collect();
            let mut row = vec![
                name.clone(),
                format!("[{}]({page}#{})", unbroken(title), anchor(title)),
            ];
            row.extend(counts(&cells));
            rows.push(row);
        }
    }
    let mut header = vec!["paper".to_owned(), "table".to_owned()];
    // Spaces let the narrow columns break their names.
    header.extend(columns.iter().map(|(subject, verdict)| {
        format!("{}: {}", subject.name(), verdict.shown()).replace('_', " ")
    }));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    heading(2, "Verdicts", "Verdicts at a glance")
        + "Numbers, parameters and claims of each table by verdict, the paper as written ([what they mean](#legend)).\n\n"
        + &table(&header, &rows)
        + "\n"
}

/// A title that is not broken between its words.
fn unbroken(title: &str) -> String {
    escaped(title).replace(' ', "\u{a0}")
}

/// Which papers are not here.
fn missing(papers: &[&Held]) -> String {
    let list = |folders: Vec<&str>| -> Vec<String> {
        let of = |folder| {
            let work = about::reference(folder).expect("the folder was read from this reference");
            format!("- {}: {}", escaped(folder), escaped(&work.title))
        };
        folders.into_iter().map(of).collect()
    };
    let mut out = String::new();
    let [not_run, not_there] = model::absent(papers).map(list);
    if !not_run.is_empty() {
        out += &format!(
            "Not in this lake, `zonobench reproduce-all` makes them:\n\n{}\n\n",
            not_run.join("\n")
        );
    }
    if !not_there.is_empty() {
        out += &format!(
            "In the bibliography, and without experiments in this version:\n\n{}\n\n",
            not_there.join("\n")
        );
    }
    out
}

/// What differs, does not hold, or could not be decided, paper by paper and table by table.
fn findings(papers: &[&Held]) -> String {
    let mut out = heading(2, "Findings", "Findings");
    out += "Every number and every claim, theorems among them, that does not come out as written or could not be decided: what is \
            printed, what was measured, why, and the command that shows it. `zonobench dossier PAPER` has those of one paper, \
            with what would change each.\n\n";
    for paper in papers {
        out += &format!("### {}\n\n", escaped(&paper.name));
        let found = model::findings(paper);
        if found.is_empty() {
            out += "None.\n\n";
        }
        for table in &found {
            out += &of_table(paper, table);
        }
        out += &turned(paper);
    }
    out
}

fn of_table(paper: &Held, table: &TableFindings) -> String {
    let title = table.title;
    let mut out = format!(
        "**[{}]({}/README.md#{})** {}\n\n",
        escaped(title),
        paper.name,
        anchor(title),
        code(&format!("zonobench tables {} {title:?}", paper.name))
    );
    for finding in &table.decided {
        let c = finding.cell;
        out += &format!("- {}", claim(c));
        if let Some(ours) = c.reproduced {
            out += &format!("; measured {}", four_digits(ours));
            let interval = interval(c);
            if !interval.is_empty() {
                out += &format!(" {interval}");
            }
        }
        out += &format!(": {}. {}", c.verdict.shown(), escaped(&c.reason));
        if let Some((asked, words)) = &finding.asked {
            out += &format!("  \n  Asked for {}: {}", code(asked), escaped(words));
        }
        out.push('\n');
    }
    for (reason, same) in &table.undecided {
        let claims: Vec<String> = same.iter().map(|c| format!("  - {}\n", claim(c))).collect();
        out += &format!(
            "- {}: {}\n{}",
            Verdict::NotReproducible.shown(),
            escaped(reason),
            claims.concat()
        );
    }
    out + "\n"
}

fn claim(c: &Judged) -> String {
    let column = if c.column.is_empty() {
        String::new()
    } else {
        format!(", {}", label(&c.column))
    };
    format!(
        "**{}**{column}: printed “{}”",
        label(&c.row),
        escaped(&c.published)
    )
}

/// Claims that come out as written and turn under another reading.
fn turned(paper: &Held) -> String {
    let lines: Vec<String> = model::turned(paper)
        .into_iter()
        .map(|c| {
            format!(
                "- {} ({}): holds as written, and {} *{}*: {}. {}\n",
                claim(c),
                escaped(&c.table),
                c.verdict.shown(),
                escaped(c.reading.name()),
                c.reproduced.map(four_digits).unwrap_or_default(),
                escaped(&c.reason)
            )
        })
        .collect();
    if lines.is_empty() {
        return String::new();
    }
    format!(
        "**As written, but not under another reading**\n\n{}\n",
        lines.concat()
    )
}

/// The user's own experiments.
fn own_experiments(own: &[&Held]) -> String {
    let mut out = heading(2, "Experiments", "Experiments");
    out +=
        "Experiments that are compared with no printed number; their scores are on their page.\n\n";
    for held in own {
        let list: Vec<String> = held
            .experiments
            .iter()
            .map(|id| {
                format!(
                    "[{}]({}/README.md#{})",
                    escaped(id),
                    held.name,
                    anchor(&format!("experiment {id}"))
                )
            })
            .collect();
        out += &format!(
            "- [{}]({}/README.md): {}\n",
            escaped(&held.name),
            held.name,
            list.join(", ")
        );
    }
    out + "\n"
}

/// The verdicts and their meanings as a table.
fn legend() -> String {
    let rows: Vec<Vec<String>> = Verdict::ALL
        .iter()
        .filter(|v| v.is_of_a_cell())
        .map(|v| vec![v.shown(), v.meaning().to_owned()])
        .collect();
    table(&["verdict", "meaning"], &rows)
}
