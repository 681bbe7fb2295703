//! The page of a paper: what it says, its tables and figures, how to run it again. A name of the user's own
//! has a page too, with the scores of its experiments.

use crate::about::{self, Drawing, Figure};
use crate::complexity;
use crate::markdown::{anchor, code, details, escaped, heading, table};
use crate::model::{self, unit};
use crate::source::{Held, Source};
use crate::step_times::{self, Recorded, StepTimes};
use crate::timings::{self, RecordedTime};
use std::collections::BTreeSet;
use zonobench_lab::experiment::Experiment;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Claim, Published, Score};
use zonobench_verdicts::judged::{self, Judged};
use zonobench_verdicts::papers::Paper;
use zonobench_verdicts::published::{Cell, Comparand, Time};
use zonobench_verdicts::verdict::Verdict;

/// The page and the figures of `held`: (file name, text).
pub fn of(
    source: &Source,
    held: &Held,
    figures: &[Figure],
    times: &[RecordedTime],
    steps: &[Recorded],
) -> Result<Vec<(String, String)>, Error> {
    let about = about::find(&held.name);
    let mut page = title(held);
    if held.is_quick() {
        page += &smoke_run();
    }
    page += &contents(held, figures);
    if let Some(about) = about {
        page += &heading(2, "What the paper says", "What the paper says");
        page += &format!("{}\n\n", about.says);
    }
    if !held.comparisons.is_empty() {
        page += &tables(held);
        page += &times_of(held, times);
    }
    let steps = StepTimes::of(steps, &held.name);
    if let Some(steps) = &steps {
        page += &real_time(steps);
    }
    page += &claims(held);
    if !figures.is_empty() {
        page += &heading(2, "Figures", "Figures");
        for figure in figures {
            page += &figure_section(figure);
        }
        let not_drawn = about.map_or("", |about| about.not_drawn);
        if !not_drawn.is_empty() {
            page += &format!("{not_drawn}\n\n");
        }
    }
    let (counts, pictures) = complexity::section(&held.name, &source.complexity(&held.name)?);
    page += &counts;
    page += &experiments(source, held)?;
    let drawn = figures.iter().filter_map(|figure| {
        let drawing = figure.drawing.as_ref().ok()?;
        Some((file_name(figure), drawing.svg.clone()))
    });
    let recorded = steps.map(|steps| (step_times::PICTURE.to_owned(), steps.picture()));
    let mut files: Vec<(String, String)> = drawn.chain(pictures).chain(recorded).collect();
    files.push(("README.md".to_owned(), page.trim_end().to_owned() + "\n"));
    Ok(files)
}

/// What a page says first where its numbers are those of a smoke run.
pub fn smoke_run() -> String {
    "> **A smoke run** (`reproduce-all --quick`): every method and every table with few runs and steps. Its numbers are \
     compared with nothing; `reproduce-all` makes those that are.\n\n"
        .to_owned()
}

fn title(held: &Held) -> String {
    let back = "[All results](../README.md)";
    match about::reference(&held.name) {
        Some(work) => format!(
            "# {}: {}\n\n{} Key `{}` in `references.bib`. · {back}\n\n",
            escaped(&held.name),
            escaped(&work.title),
            escaped(&work.citation),
            work.key
        ),
        None => format!("# {}\n\n{back}\n\n", escaped(&held.name)),
    }
}

const CLAIMS: &str = "Theorems, propositions, remarks";

/// The ledger: what holds, what does not with its counterexample, and apart from both the remarks of ours.
fn claims(held: &Held) -> String {
    if held.claims.is_empty() {
        return String::new();
    }
    let of = |claim: &Claim| Verdict::parse(&claim.verdict);
    let (remarks, own): (Vec<&Claim>, Vec<&Claim>) =
        (held.claims.iter()).partition(|c| of(c) == Ok(Verdict::Remark));
    let (holding, failing): (Vec<&Claim>, Vec<&Claim>) =
        (own.iter()).partition(|c| of(c) == Ok(Verdict::Holds));
    let mut out = heading(2, CLAIMS, CLAIMS);
    out += &format!(
        "What the paper states, tried in exact rational arithmetic (`zonobench claims {}`): {} statements, each with a row in \
         the tables above.",
        held.name,
        own.len(),
    );
    if !holding.is_empty() {
        let names: Vec<String> = holding.iter().map(|c| escaped(&c.claim)).collect();
        out += &format!(
            " In every trial {} hold{}: {}. That is no proof.",
            holding.len(),
            if holding.len() == 1 { "s" } else { "" },
            names.join(", ")
        );
    }
    out += "\n\n";
    for c in failing {
        let verdict = of(c).map_or_else(|_| escaped(&c.verdict), Verdict::shown);
        out += &format!(
            "- **{}**, {verdict}: \"{}\".{}\n",
            escaped(&c.claim),
            escaped(&c.statement),
            evidence(c)
        );
    }
    out.push('\n');
    if !remarks.is_empty() {
        out += &heading(3, REMARKS, REMARKS);
        out += "What we found beside the paper's statements. The paper does not say these things: they are charged to nobody, \
                and are in no count.\n\n";
        for c in remarks {
            out += &format!(
                "- **{}**: {}.{}\n",
                escaped(&c.claim),
                escaped(c.statement.trim_end_matches('.')),
                evidence(c)
            );
        }
        out.push('\n');
    }
    out
}

const REMARKS: &str = "Remarks of ours";

/// The counterexample and what follows. How many of the drawn trials were lost measures who drew them.
fn evidence(c: &Claim) -> String {
    let parts = [
        ("Counterexample", &c.counterexample),
        ("Consequence", &c.consequence),
    ];
    let shown = parts.iter().filter(|(_, part)| !part.is_empty());
    shown
        .map(|(label, part)| format!(" {label}: {}.", escaped(part.trim_end_matches('.'))))
        .collect()
}

fn contents(held: &Held, figures: &[Figure]) -> String {
    let link = |name: &str| format!("[{}](#{})", escaped(name), anchor(name));
    let mut parts = Vec::new();
    let tables: Vec<String> = held.tables().iter().map(|t| link(t)).collect();
    if !tables.is_empty() {
        parts.push(format!("Tables and claims: {}", tables.join(" · ")));
    }
    if !held.claims.is_empty() {
        parts.push(link(CLAIMS));
    }
    let figures: Vec<String> = figures
        .iter()
        .map(|f| format!("[{}](#{})", f.name, drawing_anchor(f)))
        .collect();
    if !figures.is_empty() {
        parts.push(format!("Figures: {}", figures.join(" · ")));
    }
    parts.push(link(experiments_heading(held)));
    parts.join("  \n") + "\n\n"
}

/// A row's or column's label; the levels of one are joined by `|` in `published.csv`.
pub fn label(text: &str) -> String {
    let levels: Vec<String> = text.split('|').map(escaped).collect();
    levels.join(" · ")
}

/// A figure may have printed numbers too: its picture has another place than their table.
fn drawing_anchor(figure: &Figure) -> String {
    format!("drawing-{}", anchor(figure.name))
}

fn file_name(figure: &Figure) -> String {
    format!("{}.svg", anchor(figure.name))
}

/// The verdicts of a paper's tables and each table in full.
fn tables(held: &Held) -> String {
    let mut out = heading(2, "Tables and claims", "Tables and claims");
    out += "Published beside reproduced. An interval is where a mean of as many runs as the paper's lies with 99 %. \
            The [legend](../README.md#legend) says what a verdict means. The first line of a cell is the paper as it is \
            written, with the corrections that its README in `experiments/` lists; lines with ↳ are other readings with \
            a name. **They are not the paper's equations**: they show what reaches the printed number, or what a claim turns into.\n\n";
    for name in held.tables() {
        let cells: Vec<&Judged> = held
            .comparisons
            .iter()
            .filter(|c| &*c.table == name)
            .collect();
        out += &heading(3, name, &escaped(name));
        out += &format!(
            "{}. {}\n\n",
            counted(&cells),
            code(&format!("zonobench tables {} {name:?}", held.name))
        );
        let exact = model::exact_rows(&cells);
        let (parameters, others): (Vec<&Judged>, Vec<&Judged>) =
            cells.into_iter().partition(|c| exact.contains(&*c.row));
        if let Some(grid) = grid(held, name, &others) {
            out += &format!(
                "As the paper lays it out, published → reproduced:\n\n{grid}\nCell by cell:\n\n"
            );
        }
        if !others.is_empty() {
            out += &full(held, &others);
            out.push('\n');
        }
        if !parameters.is_empty() {
            let rows: Vec<Vec<String>> = parameters
                .iter()
                .map(|c| {
                    vec![
                        label(&c.row),
                        label(&c.column),
                        escaped(&c.published),
                        ours(c),
                        c.verdict.shown(),
                    ]
                })
                .collect();
            let summary = format!("{} parameters, transcribed", parameters.len());
            let body = table(&["row", "column", "published", "ours", "verdict"], &rows);
            out += &details(&summary, &body);
            out.push('\n');
        }
    }
    out
}

/// `numbers: 3 ✓ within_ci, 1 ✗ differs; claims: 2 ✓ holds`.
fn counted(cells: &[&Judged]) -> String {
    let of = |(subject, counts): (judged::Subject, Vec<(Verdict, usize)>)| {
        let each = counts
            .iter()
            .map(|(verdict, n)| format!("{n} {}", verdict.shown()));
        format!(
            "{}: {}",
            subject.name(),
            each.collect::<Vec<_>>().join(", ")
        )
    };
    let all = judged::counts_by_subject(cells.iter().copied());
    all.into_iter().map(of).collect::<Vec<_>>().join("; ")
}

fn ours(c: &Judged) -> String {
    c.reproduced.map(four_digits).unwrap_or_default()
}

/// The interval of a comparison, empty if it has none.
pub fn interval(c: &Judged) -> String {
    match c.interval {
        Some((lo, hi)) => format!("\\[{}, {}\\]", four_digits(lo), four_digits(hi)),
        None => String::new(),
    }
}

/// A table of numbers in the paper's own layout; None for what is no such table.
fn grid(held: &Held, name: &str, cells: &[&Judged]) -> Option<String> {
    let grid = model::grid(name, cells)?;
    let lines = grid.rows.iter().map(|line| {
        let first = if line.reading == "as-written" {
            label(line.row)
        } else {
            format!("↳ *{}*", escaped(line.reading))
        };
        let values = line.cells.iter().map(|cell| {
            cell.map_or_else(String::new, |c| {
                let printed = if c.published.is_empty() {
                    "lost"
                } else {
                    &c.published
                };
                let mark = c.verdict.mark();
                match c.reproduced {
                    Some(ours) => {
                        let ours = with_unit(&four_digits(ours), unit(held, c));
                        format!("{} → {ours}\u{a0}{mark}", escaped(printed))
                    }
                    None => format!("{}\u{a0}{mark}", escaped(printed)),
                }
            })
        });
        [first].into_iter().chain(values).collect()
    });
    let lines: Vec<Vec<String>> = lines.collect();
    let header: Vec<String> = [String::new()]
        .into_iter()
        .chain(grid.columns.iter().map(|c| label(c)))
        .collect();
    Some(table(
        &header.iter().map(String::as_str).collect::<Vec<_>>(),
        &lines,
    ))
}

fn full(held: &Held, cells: &[&Judged]) -> String {
    // Claims have no interval.
    let intervals = cells.iter().any(|c| !interval(c).is_empty());
    let rows: Vec<Vec<String>> = cells
        .iter()
        .map(|c| {
            let (row, column) = if c.is_as_written() {
                (label(&c.row), label(&c.column))
            } else {
                (String::new(), format!("↳ *{}*", escaped(c.reading.name())))
            };
            let published = escaped(&c.published);
            let mut line = vec![row, column, with_unit(&published, unit(held, c)), ours(c)];
            line.extend(intervals.then(|| interval(c)));
            line.extend([c.verdict.shown(), escaped(&c.reason)]);
            line
        })
        .collect();
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
    table(&header, &rows)
}

fn with_unit(number: &str, unit: &str) -> String {
    if number.is_empty() || unit.is_empty() {
        number.to_owned()
    } else {
        format!("{number}\u{a0}{}", escaped(unit))
    }
}

/// The printed times beside the recorded ones.
fn times_of(held: &Held, times: &[RecordedTime]) -> String {
    let printed: Vec<&Published> = held
        .published
        .iter()
        .filter(|p| &*p.kind == "timing")
        .collect();
    if printed.is_empty() {
        return String::new();
    }
    let cell = |p: &Published| {
        let cells = held.paper.as_ref().map_or(&[][..], |paper| &paper.cells);
        let timed = |c: &&Cell| matches!(c.comparand, Comparand::Timing { .. }) && is_of(p, c);
        match &cells.iter().find(timed)?.comparand {
            Comparand::Timing { of, over } => Some((of, over.as_ref())),
            _ => None,
        }
    };
    let mut processors = BTreeSet::new();
    let rows: Vec<Vec<String>> = printed
        .iter()
        .map(|p| {
            let recorded = cell(p).and_then(|(time, over)| {
                let of = |time: &Time| timings::find(times, &held.name, time);
                let (recorded, processor) = of(time)?;
                processors.insert(processor);
                let Some(over) = over else {
                    return Some(format!("{} µs", four_digits(recorded)));
                };
                let ratio = recorded / of(over)?.0;
                Some(format!(
                    "{} of the time of {}",
                    four_digits(ratio),
                    escaped(&over.estimator)
                ))
            });
            let unit = if &*p.unit == "1" { "" } else { &p.unit };
            let printed = format!("{} {unit}", p.printed);
            vec![
                format!(
                    "{}, {}, {}",
                    escaped(&p.table),
                    label(&p.row),
                    label(&p.column)
                ),
                escaped(printed.trim()),
                recorded.unwrap_or_else(|| "not recorded".to_owned()),
                held.paper
                    .as_ref()
                    .and_then(|paper| reason(paper, p))
                    .map(escaped)
                    .unwrap_or_default(),
            ]
        })
        .collect();
    let mut out = heading(3, "Times", "Times");
    out += "A time depends on the machine and the program: it is compared with nothing here. Ours is the median time of \
            a step from the recorded `timings.csv`";
    out += &match processors.into_iter().collect::<Vec<_>>().as_slice() {
        [] => " (`just record-timings` writes it).\n\n".to_owned(),
        some => format!(", on {}.\n\n", escaped(&some.join(", "))),
    };
    out + &table(
        &[
            "cell",
            "published",
            "recorded, a step",
            "what the paper says of it",
        ],
        &rows,
    ) + "\n"
}

/// The recorded times of single steps: a histogram, the quantiles, and where the time goes.
fn real_time(steps: &StepTimes) -> String {
    let mut out = heading(3, "Real time", "Real time");
    out += &format!("{}\n\n", escaped(&steps.words()));
    out += &format!("![How long a step takes]({})\n\n", step_times::PICTURE);
    for grid in [steps.quantiles(), steps.shares()] {
        let cells = |row: &Vec<String>| row.iter().map(|cell| escaped(cell)).collect();
        let rows: Vec<Vec<String>> = grid.rows.iter().map(cells).collect();
        if !rows.is_empty() {
            out += &format!("{}\n", table(&grid.header, &rows));
        }
    }
    out
}

fn is_of(p: &Published, c: &Cell) -> bool {
    *c.table == *p.table && *c.row == *p.row && *c.column == *p.column
}

/// What `published.csv` says about a printed number.
fn reason<'a>(paper: &'a Paper, p: &Published) -> Option<&'a str> {
    let found = paper
        .published
        .iter()
        .find(|q| *q.table == *p.table && *q.row == *p.row && *q.column == *p.column);
    found.map(|q| q.reason.as_str())
}

fn figure_section(figure: &Figure) -> String {
    let mut out = format!(
        "<a id=\"{}\"></a>\n\n### {}: {}\n\n",
        drawing_anchor(figure),
        figure.name,
        escaped(&figure.title)
    );
    match &figure.drawing {
        Err(why) => out += &format!("Not drawn: {}.\n\n", escaped(why)),
        Ok(Drawing { caption, data, .. }) => {
            let alternative = format!("{}: {}", figure.name, figure.title);
            out += &format!("![{}]({})\n\n", escaped(&alternative), file_name(figure));
            out += &format!(
                "*Experiment {}, seed {}, run 0.* {caption}\n\n",
                code(&data.experiment),
                escaped(&data.seed)
            );
            let files: Vec<String> = data
                .files
                .iter()
                .map(|f| format!("- {}", code(f)))
                .collect();
            let queries: Vec<String> = data
                .sql
                .iter()
                .map(|sql| format!("zonobench query \"{sql}\""))
                .collect();
            let body = format!(
                "Files below the lake:\n\n{}\n\n```sh\n{}\n```",
                files.join("\n"),
                queries.join("\n")
            );
            out += &details("Where the data are", &body);
            out.push('\n');
        }
    }
    out
}

fn experiments_heading(held: &Held) -> &'static str {
    if held.comparisons.is_empty() {
        "Experiments"
    } else {
        "Run it again"
    }
}

/// The experiments: those of a published paper with their files, others with their scores.
fn experiments(source: &Source, held: &Held) -> Result<String, Error> {
    let name = experiments_heading(held);
    let mut out = heading(2, name, name);
    let published = |id: &String| {
        held.paper
            .as_ref()
            .is_some_and(|p| p.experiments.iter().any(|e| e.id == *id))
    };
    let compared = !held.comparisons.is_empty();
    let (ours, own): (Vec<&String>, Vec<&String>) = held
        .experiments
        .iter()
        .partition(|id| compared && published(id));
    if let Some(paper) = held.paper.as_ref().filter(|_| compared) {
        out += &format!(
            "```sh\nzonobench reproduce-all --paper {name}     # all of it\n{one}\
             zonobench query \"SELECT * FROM scores WHERE paper = '{name}'\"\n```\n\n",
            name = held.name,
            one = ours.first().and_then(|id| paper.file(id)).map_or_else(String::new, |file| format!(
                "zonobench run experiments/{file} --lake lake-one     # one experiment by itself\n"
            ))
        );
        out += &files(paper, &ours);
        out.push('\n');
    }
    if own.is_empty() {
        return Ok(out);
    }
    if !compared {
        out += "The experiments of this lake and their scores: the mean over the runs, its spread and the 95 % interval of the \
                mean. `zonobench run FILE.toml` runs one again.\n\n";
    }
    for id in own {
        out += &own_experiment(source, &held.name, id)?;
    }
    Ok(out)
}

/// The files of published experiments and what is in them.
fn files(paper: &Paper, ids: &[&String]) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut last = "";
    for id in ids {
        let Some(e) = paper.experiments.iter().find(|e| e.id == **id) else {
            continue;
        };
        let Experiment {
            title,
            seed,
            runs,
            steps,
            estimators,
            ..
        } = &**e;
        let file = paper.file(id).unwrap_or_default();
        let shown = if file == last {
            String::new()
        } else {
            code(&format!("experiments/{file}"))
        };
        last = file;
        let estimators: Vec<String> = estimators.iter().map(|e| escaped(&e.id)).collect();
        rows.push(vec![
            shown,
            code(id),
            escaped(title.as_deref().unwrap_or_default()),
            seed.to_string(),
            runs.to_string(),
            format!("0 … {steps}"),
            estimators.join(", "),
        ]);
    }
    table(
        &["file", "experiment", "", "seed", "runs", "k", "estimators"],
        &rows,
    )
}

/// An experiment of the user's own: its estimators and scores.
fn own_experiment(source: &Source, paper: &str, id: &str) -> Result<String, Error> {
    let mut out = heading(3, &format!("experiment {id}"), &escaped(id));
    if let Some(seed) = source.seed(paper, id)? {
        out += &format!("Seed {}.\n\n", escaped(&seed));
    }
    let estimators: Vec<Vec<String>> = source
        .estimators(paper, id)?
        .iter()
        .map(|e| {
            let guaranteed = if e.guaranteed { "guaranteed" } else { "" };
            vec![
                escaped(&e.estimator),
                escaped(&e.kind),
                guaranteed.to_owned(),
                escaped(&e.reads),
                code(&e.settings),
            ]
        })
        .collect();
    if !estimators.is_empty() {
        out += &table(
            &["estimator", "kind", "its sets", "reads", "settings"],
            &estimators,
        );
        out.push('\n');
    }
    let scores: Vec<Vec<String>> = source.scores(paper, id)?.iter().map(score).collect();
    if scores.is_empty() {
        out += "It has no metric.\n\n";
    } else {
        out += &table(
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
            &scores,
        );
        out.push('\n');
    }
    out += &format!(
        "{}\n\n",
        code(&format!(
            "zonobench query \"SELECT * FROM scores WHERE paper = '{paper}' AND experiment = '{id}'\""
        ))
    );
    Ok(out)
}

fn score(s: &Score) -> Vec<String> {
    let number = |x: Option<f64>| x.map(four_digits).unwrap_or_default();
    let name =
        |n: &Option<zonobench_lake::table::Name>| n.as_deref().map(escaped).unwrap_or_default();
    let interval = match (s.ci_lo, s.ci_hi) {
        (Some(lo), Some(hi)) => format!("\\[{}, {}\\]", four_digits(lo), four_digits(hi)),
        _ => String::new(),
    };
    vec![
        escaped(&s.estimator),
        escaped(&s.metric),
        name(&s.component),
        name(&s.over),
        s.n_runs.to_string(),
        number(s.mean),
        number(s.sd),
        interval,
    ]
}
