//! The page of a paper: what it says, its tables cell by cell, its figures, how to run it again. A name of the
//! user's own has a page too, with the scores of its experiments.

use super::front::{SMOKE_RUN, in_double_quotes};
use super::markup::{
    badge, blocks, class, code, commands, escaped, inline, label, place, row, scrolling, table,
};
use super::{Page, heading};
use crate::about::{self, Drawing, Figure};
use crate::model::{self, unit};
use crate::source::{Held, Source};
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Score;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::judged::{self, Judged};
use zonobench_verdicts::papers::Paper;

/// The page of `held`.
pub fn page(source: &Source, held: &Held, figures: &[Figure]) -> Result<Page, Error> {
    let about = about::find(&held.name);
    let mut body = match about::reference(&held.name) {
        Some(work) => format!(
            "<h1>{}: {}</h1>\n<p class=\"muted\">{} Key <code>{}</code> in <code>references.bib</code>.</p>\n",
            escaped(&held.name),
            escaped(&work.title),
            escaped(&work.citation),
            escaped(&work.key)
        ),
        None => format!("<h1>{}</h1>\n", escaped(&held.name)),
    };
    if held.is_quick() {
        body += SMOKE_RUN;
    }
    body += &contents(held, figures);
    if let Some(about) = about {
        body += &heading(2, &place(&held.name, "says"), "What the paper says");
        body += &blocks(about.says);
    }
    if !held.comparisons.is_empty() {
        body += &tables(held);
    }
    if !figures.is_empty() {
        body += &heading(2, &place(&held.name, "figures"), "Figures");
        for figure in figures {
            body += &figure_section(held, figure);
        }
        body += &blocks(about.map_or("", |about| about.not_drawn));
    }
    body += &experiments(source, held)?;
    Ok(Page {
        place: place(&held.name, ""),
        name: held.name.clone(),
        body,
    })
}

fn contents(held: &Held, figures: &[Figure]) -> String {
    let item = |name: &str, text: &str| {
        format!(
            "<li><a href=\"#{}\">{}</a></li>",
            place(&held.name, name),
            escaped(text)
        )
    };
    let mut items: Vec<String> = held.tables().iter().map(|t| item(t, t)).collect();
    items.extend(figures.iter().map(|f| {
        // A figure may stand among the tables too, with its printed numbers.
        let text = if f.name.starts_with("Fig") {
            format!("{}, redrawn", f.name)
        } else {
            format!("{}: {}", f.name, f.title)
        };
        item(&drawing(f), &text)
    }));
    items.push(item("again", "Run it again"));
    format!(
        "<nav class=\"contents\" aria-label=\"On the page of {}\"><ul>{}</ul></nav>\n",
        escaped(&held.name),
        items.concat()
    )
}

/// A figure may have printed numbers too: its picture has another place than their table.
fn drawing(figure: &Figure) -> String {
    format!("drawing {}", figure.name)
}

fn tables(held: &Held) -> String {
    let mut out = heading(2, &place(&held.name, "tables"), "Tables and claims");
    for name in held.tables() {
        let cells: Vec<&Judged> = held
            .comparisons
            .iter()
            .filter(|c| &*c.table == name)
            .collect();
        out += &heading(3, &place(&held.name, name), &escaped(name));
        for (subject, counts) in judged::counts_by_subject(cells.iter().copied()) {
            let counted: Vec<String> = counts
                .iter()
                .map(|(verdict, n)| format!("{n} {}", badge(*verdict)))
                .collect();
            out += &format!("<p>{}: {}</p>\n", subject.name(), counted.join(" "));
        }
        let exact = model::exact_rows(&cells);
        let (parameters, others): (Vec<&Judged>, Vec<&Judged>) =
            cells.into_iter().partition(|c| exact.contains(&*c.row));
        if let Some(grid) = model::grid(name, &others) {
            out += &laid_out(held, name, &grid);
        }
        if !others.is_empty() {
            out += &full(held, name, &others);
        }
        if !parameters.is_empty() {
            let rows: Vec<String> = parameters
                .iter()
                .map(|c| {
                    row(&[
                        label(&c.row),
                        label(&c.column),
                        escaped(&c.published),
                        number(held, c),
                        badge(c.verdict),
                    ])
                })
                .collect();
            out += &format!(
                "<details><summary>{} parameters, transcribed</summary>{}</details>\n",
                parameters.len(),
                table(
                    "cells",
                    &format!("{name}: parameters"),
                    &["row", "column", "published", "ours", "verdict"],
                    &rows.concat()
                )
            );
        }
        out += &behind_table(held, name);
    }
    out
}

/// The SQL behind a table.
fn behind_table(held: &Held, name: &str) -> String {
    let sql = format!(
        "SELECT \"row\", \"column\", reading, published, reproduced, interval_lo, interval_hi, verdict, reason FROM comparison \
         WHERE paper = '{}' AND \"table\" = '{}'",
        held.name,
        name.replace('\'', "''")
    );
    let lines = format!(
        "zonobench tables {} {name:?}\nzonobench query \"{}\"",
        held.name,
        in_double_quotes(&sql)
    );
    format!(
        "<details><summary>The query behind {}</summary>{}</details>\n",
        escaped(name),
        commands(&lines)
    )
}

/// A table as the paper lays it out.
fn laid_out(held: &Held, name: &str, grid: &model::Grid) -> String {
    let rows: Vec<String> = grid
        .rows
        .iter()
        .map(|line| {
            let first = if line.reading == "as-written" {
                label(line.row)
            } else {
                format!("<span class=\"reading\">↳ {}, {}</span>", label(line.row), escaped(line.reading))
            };
            let cells: Vec<String> = line
                .cells
                .iter()
                .map(|cell| {
                    cell.map_or_else(
                        || "<td></td>".to_owned(),
                        |c| {
                            let printed = if c.published.is_empty() { "lost" } else { &c.published };
                            let ours = c
                                .reproduced
                                .map(|x| format!(" → {}", with_unit(&four_digits(x), unit(held, c))))
                                .unwrap_or_default();
                            format!(
                                "<td class=\"count {}\">{}{ours} <span role=\"img\" aria-label=\"{}\">{}</span></td>",
                                class(c.verdict),
                                escaped(printed),
                                escaped(&c.verdict.name().replace('_', " ")),
                                c.verdict.mark()
                            )
                        },
                    )
                })
                .collect();
            format!("<tr><th scope=\"row\">{first}</th>{}</tr>\n", cells.concat())
        })
        .collect();
    let columns: Vec<String> = grid.columns.iter().map(|c| label(c)).collect();
    let mut header = vec!["row"];
    header.extend(columns.iter().map(String::as_str));
    table(
        "grid",
        &format!("{name} as the paper lays it out, published → reproduced"),
        &header,
        &rows.concat(),
    )
}

/// A table cell by cell; a body holds a cell under all its readings, so that sorting keeps them together.
fn full(held: &Held, name: &str, cells: &[&Judged]) -> String {
    // Claims have no interval.
    let intervals = cells.iter().any(|c| c.interval.is_some());
    let mut header = vec![
        "row",
        "column",
        "published",
        "reproduced",
        "interval",
        "verdict",
        "reason",
    ];
    if !intervals {
        header.retain(|name| *name != "interval");
    }
    let mut bodies = String::new();
    for (i, c) in cells.iter().enumerate() {
        let written = c.is_as_written();
        if written || i == 0 {
            bodies += if i == 0 { "<tbody>" } else { "</tbody><tbody>" };
        }
        let (row, column) = if written {
            (label(&c.row), label(&c.column))
        } else {
            (
                format!("<span class=\"reading\">↳ {}</span>", label(&c.row)),
                format!("<em>{}</em>", escaped(c.reading.name())),
            )
        };
        let interval = c
            .interval
            .map_or_else(String::new, |(lo, hi)| interval(lo, hi));
        bodies += &format!(
            "<tr><th scope=\"row\">{row}</th><td>{column}</td><td{}>{}</td><td class=\"number\">{}</td>{}\
             <td>{}</td><td class=\"why\">{}</td></tr>\n",
            // Claims are words, which may break.
            if c.published.chars().count() < 20 {
                " class=\"number\""
            } else {
                ""
            },
            with_unit(&c.published, unit(held, c)),
            number(held, c),
            if intervals {
                format!("<td class=\"number\">{interval}</td>")
            } else {
                String::new()
            },
            badge(c.verdict),
            escaped(&c.reason)
        );
    }
    bodies += "</tbody>";
    table(
        "cells sortable filtered",
        &format!("{name}, cell by cell"),
        &header,
        &bodies,
    )
}

fn with_unit(number: &str, unit: &str) -> String {
    if number.is_empty() || unit.is_empty() {
        escaped(number)
    } else {
        format!("{}\u{a0}{}", escaped(number), escaped(unit))
    }
}

/// Our number: what the script shows of it, all digits and the run, is in its attributes.
fn number(held: &Held, c: &Judged) -> String {
    let Some(ours) = c.reproduced else {
        return String::new();
    };
    let mut attributes = format!(" data-exact=\"{ours}\"");
    if let Some((lo, hi)) = c.interval {
        attributes += &format!(" data-interval=\"{lo} to {hi}\"");
    }
    if let Some(cell) = model::mapped(held, c) {
        attributes += &format!(
            " data-experiment=\"{}/{}\"",
            escaped(&held.name),
            escaped(&cell.comparand.experiments().join("+"))
        );
        for (name, value) in cell.comparand.labels() {
            attributes += &format!(" data-{name}=\"{}\"", escaped(&value));
        }
    }
    format!(
        "<button type=\"button\" class=\"exact\"{attributes}>{}</button>",
        four_digits(ours)
    )
}

fn figure_section(held: &Held, figure: &Figure) -> String {
    let mut out = heading(
        3,
        &place(&held.name, &drawing(figure)),
        &format!("{}: {}", escaped(figure.name), escaped(&figure.title)),
    );
    match &figure.drawing {
        Err(why) => out += &format!("<p>Not drawn: {}.</p>\n", escaped(why)),
        Ok(Drawing { svg, caption, data }) => {
            let files: Vec<String> = data
                .files
                .iter()
                .map(|f| format!("<li>{}</li>", code(f)))
                .collect();
            let queries: Vec<String> = data
                .sql
                .iter()
                .map(|sql| format!("zonobench query \"{}\"", in_double_quotes(sql)))
                .collect();
            out += &format!(
                "<figure>{}<figcaption><p><em>Experiment {}, seed {}, run 0.</em> {}</p></figcaption></figure>\n\
                 <details><summary>The data behind {}</summary><p>Files below the lake:</p><ul>{}</ul>{}</details>\n",
                scrolling(&format!("{}: {}", figure.name, figure.title), svg),
                code(&data.experiment),
                escaped(&data.seed),
                inline(caption),
                escaped(figure.name),
                files.concat(),
                commands(&queries.join("\n"))
            );
        }
    }
    out
}

/// The experiments: those of a published paper with their files, others with their scores.
fn experiments(source: &Source, held: &Held) -> Result<String, Error> {
    let compared = !held.comparisons.is_empty();
    let published = |id: &String| {
        held.paper
            .as_ref()
            .is_some_and(|p| p.experiments.iter().any(|e| e.id == *id))
    };
    let (ours, own): (Vec<&String>, Vec<&String>) = held
        .experiments
        .iter()
        .partition(|id| compared && published(id));
    let mut out = heading(2, &place(&held.name, "again"), "Run it again");
    if let Some(paper) = held.paper.as_ref().filter(|_| compared) {
        let one = ours.first().and_then(|id| paper.file(id)).map_or_else(String::new, |file| {
            format!("\nzonobench run experiments/{file} --lake lake-one     # one experiment by itself")
        });
        out += &commands(&format!(
            "zonobench reproduce-all --paper {name}     # all of it{one}\n\
             zonobench query \"SELECT * FROM scores WHERE paper = '{name}'\"",
            name = held.name
        ));
        out += &files(paper, &ours);
    }
    if own.is_empty() {
        return Ok(out);
    }
    if !compared {
        out += "<p>The experiments of this lake and their scores: the mean over the runs, its spread and the 95 % interval of \
                the mean. <code>zonobench run FILE.toml</code> runs one again.</p>\n";
    }
    for id in own {
        out += &own_experiment(source, &held.name, id)?;
    }
    Ok(out)
}

/// The files of published experiments and what is in them.
fn files(paper: &Paper, ids: &[&String]) -> String {
    let rows = ids.iter().filter_map(|id| {
        let e = paper.experiments.iter().find(|e| e.id == ***id)?;
        let estimators: Vec<String> = e.estimators.iter().map(|e| escaped(&e.id)).collect();
        Some(row(&[
            code(id),
            code(&format!(
                "experiments/{}",
                paper.file(id).unwrap_or_default()
            )),
            escaped(e.title.as_deref().unwrap_or_default()),
            e.seed.to_string(),
            e.runs.to_string(),
            format!("0 … {}", e.steps),
            estimators.join(", "),
        ]))
    });
    let rows: Vec<String> = rows.collect();
    table(
        "sortable filtered",
        &format!("Experiments of {}", paper.name),
        &[
            "experiment",
            "file",
            "what it shows",
            "seed",
            "runs",
            "k",
            "estimators",
        ],
        &rows.concat(),
    )
}

/// An experiment of the user's own: its estimators and scores.
fn own_experiment(source: &Source, paper: &str, id: &str) -> Result<String, Error> {
    let mut out = heading(3, &place(paper, &format!("experiment {id}")), &escaped(id));
    if let Some(seed) = source.seed(paper, id)? {
        out += &format!("<p>Seed {}.</p>\n", escaped(&seed));
    }
    let estimators: Vec<String> = source
        .estimators(paper, id)?
        .iter()
        .map(|e| {
            row(&[
                escaped(&e.estimator),
                escaped(&e.kind),
                if e.guaranteed { "guaranteed" } else { "" }.to_owned(),
                escaped(&e.reads),
                code(&e.settings),
            ])
        })
        .collect();
    if !estimators.is_empty() {
        out += &table(
            "",
            &format!("Estimators of {id}"),
            &["estimator", "kind", "its sets", "reads", "settings"],
            &estimators.concat(),
        );
    }
    let scores: Vec<String> = source.scores(paper, id)?.iter().map(score).collect();
    if scores.is_empty() {
        out += "<p>It has no metric.</p>\n";
    } else {
        out += &table(
            "sortable filtered",
            &format!("Scores of {id}"),
            &[
                "estimator",
                "metric",
                "component",
                "over",
                "runs",
                "mean",
                "sd",
                "95 % of the mean",
            ],
            &scores.concat(),
        );
    }
    out += &commands(&format!(
        "zonobench query \"SELECT * FROM scores WHERE paper = '{paper}' AND experiment = '{id}'\""
    ));
    Ok(out)
}

fn score(s: &Score) -> String {
    let digits = |x: Option<f64>| x.map(four_digits).unwrap_or_default();
    let name =
        |n: &Option<zonobench_lake::table::Name>| n.as_deref().map(escaped).unwrap_or_default();
    let interval = match (s.ci_lo, s.ci_hi) {
        (Some(lo), Some(hi)) => format!("[{}, {}]", four_digits(lo), four_digits(hi)),
        _ => String::new(),
    };
    row(&[
        escaped(&s.estimator),
        escaped(&s.metric),
        name(&s.component),
        name(&s.over),
        s.n_runs.to_string(),
        digits(s.mean),
        digits(s.sd),
        interval,
    ])
}
