//! The printed tables of a paper, beside what was reproduced: as the paper lays them out, cell by cell, and the times.

use super::query;
use crate::document::prose::prose;
use crate::document::{
    Block, Cell, Inline, Kind, Line, Ours, Row, Shape, Table, code, emphasis, joined, label, line,
    link_page,
};
use crate::model::{self, unit};
use crate::source::Held;
use crate::timings::{self, RecordedTime};
use std::collections::BTreeSet;
use zonobench_lake::digits::four_digits;
use zonobench_lake::rows::Published;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::judged::{self, Judged};
use zonobench_verdicts::papers::Paper;
use zonobench_verdicts::published::{Comparand, Time};

/// The verdicts of a paper's tables and each table in full.
pub fn tables(held: &Held) -> Vec<Block> {
    let mut out = vec![
        Block::heading(2, "Tables and claims"),
        Block::Para(line![
            prose(
                "Published beside reproduced. An interval is where a mean of as many runs as the paper's lies with 99 %. The "
            ),
            link_page("legend", "legend"),
            " ",
            prose(
                "says what a verdict means. The first line of a cell is the paper as it is \
                 written, with the corrections that its README in `experiments/` lists; lines with ↳ are other readings with \
                 a name. **They are not the paper's equations**: they show what reaches the printed number, or what a claim turns into."
            ),
        ]),
    ];
    for name in held.tables() {
        out.extend(of_table(held, name));
    }
    out
}

fn of_table(held: &Held, name: &str) -> Vec<Block> {
    let cells = held.comparisons.iter().filter(|c| &*c.table == name);
    let cells: Vec<&Judged> = cells.collect();
    let command = format!("zonobench tables {} {name:?}", held.name);
    let mut out = vec![
        Block::heading(3, name),
        Block::Para(line![counted(&cells), ". ", code(command)]),
    ];
    let exact = model::exact_rows(&cells);
    let (parameters, others): (Vec<&Judged>, Vec<&Judged>) =
        cells.into_iter().partition(|c| exact.contains(&*c.row));
    if let Some(grid) = model::grid(name, &others) {
        out.push(Block::Para(line![
            "As the paper lays it out, published → reproduced:"
        ]));
        out.push(Block::Table(laid_out(held, name, &grid)));
        out.push(Block::Para(line!["Cell by cell:"]));
    }
    if !others.is_empty() {
        out.push(Block::Table(full(held, name, &others)));
    }
    if !parameters.is_empty() {
        out.push(Block::Details {
            summary: line![format!("{} parameters, transcribed", parameters.len())],
            inside: vec![Block::Table(transcribed(held, name, &parameters))],
        });
    }
    out
}

/// `numbers: 3 ✓ within_ci, 1 ✗ differs; claims: 2 ✓ holds`.
fn counted(cells: &[&Judged]) -> Line {
    let all = judged::counts_by_subject(cells.iter().copied());
    let subjects = all.into_iter().map(|(subject, counts)| {
        let each =
            (counts.iter()).map(|(verdict, n)| line![format!("{n} "), Inline::Badge(*verdict)]);
        line![subject.name(), ": ", joined(each, ", ")]
    });
    joined(subjects, "; ")
}

/// A table of numbers in the paper's own layout.
fn laid_out(held: &Held, name: &str, grid: &model::Grid) -> Table {
    let row = |line: &model::GridRow| {
        let first = match line.reading {
            "as-written" => line![label(line.row)],
            reading => line![
                Inline::Repeated(line![label(line.row)]),
                "↳ ",
                emphasis(reading)
            ],
        };
        let cells = line.cells.iter().map(|cell| {
            cell.map_or_else(Cell::default, |c| {
                let printed = match &*c.published {
                    "" => "lost",
                    printed => printed,
                };
                let ours = (c.reproduced)
                    .map(|ours| format!(" → {}", with_unit(&four_digits(ours), unit(held, c))));
                Cell {
                    line: line![printed, ours, "\u{a0}", Inline::Mark(c.verdict)],
                    tone: Some(c.verdict.tone()),
                }
            })
        });
        [Cell::from(first)].into_iter().chain(cells).collect()
    };
    let labels: Vec<String> = grid.columns.iter().map(|c| label(c)).collect();
    let mut columns = vec![("row", Shape::Words)];
    columns.extend(labels.iter().map(|c| (c.as_str(), Shape::Number)));
    Table::new(
        Kind::Grid,
        format!("{name} as the paper lays it out, published → reproduced"),
        &columns,
        grid.rows.iter().map(row).collect(),
    )
}

/// A table cell by cell; a body holds a cell under all its readings, so that sorting keeps them together.
fn full(held: &Held, name: &str, cells: &[&Judged]) -> Table {
    let columns = [
        ("row", Shape::Words),
        ("column", Shape::Words),
        ("published", Shape::Number),
        ("reproduced", Shape::Number),
        ("interval", Shape::Number),
        ("verdict", Shape::Words),
        ("reason", Shape::Why),
    ];
    let mut bodies: Vec<Vec<Row>> = Vec::new();
    for c in cells {
        let (row, column) = match c.is_as_written() {
            true => (line![label(&c.row)], line![label(&c.column)]),
            false => (
                line![Inline::Repeated(line![label(&c.row)])],
                line!["↳ ", emphasis(c.reading.name())],
            ),
        };
        let interval = c.interval.map(|(lo, hi)| interval(lo, hi));
        let row = Row {
            cells: vec![
                row.into(),
                column.into(),
                with_unit(&c.published, unit(held, c)).into(),
                ours(held, c).into(),
                interval.into(),
                Inline::Badge(c.verdict).into(),
                (&*c.reason).into(),
            ],
            whole: false,
        };
        match bodies.last_mut().filter(|_| !c.is_as_written()) {
            Some(body) => body.push(row),
            None => bodies.push(vec![row]),
        }
    }
    let caption = format!("{name}, cell by cell");
    let mut table = Table::new(Kind::Cells, caption, &columns, Vec::new());
    table.bodies = bodies;
    // Claims have no interval.
    table.without_empty(&["interval"])
}

fn transcribed(held: &Held, name: &str, cells: &[&Judged]) -> Table {
    let columns = [
        ("row", Shape::Words),
        ("column", Shape::Words),
        ("published", Shape::Number),
        ("ours", Shape::Number),
        ("verdict", Shape::Words),
    ];
    let row = |c: &&Judged| {
        vec![
            label(&c.row).into(),
            label(&c.column).into(),
            (&*c.published).into(),
            ours(held, c).into(),
            Inline::Badge(c.verdict).into(),
        ]
    };
    Table::new(
        Kind::Cells,
        format!("{name}: parameters"),
        &columns,
        cells.iter().map(row).collect(),
    )
}

fn with_unit(number: &str, unit: &str) -> String {
    match (number, unit) {
        ("", _) | (_, "") => number.to_owned(),
        _ => format!("{number}\u{a0}{unit}"),
    }
}

/// Our number, with what names its score.
fn ours(held: &Held, c: &Judged) -> Option<Inline> {
    let mut run = Vec::new();
    if let Some(cell) = model::mapped(held, c) {
        let experiments = cell.comparand.experiments().join("+");
        run.push((
            "experiment".to_owned(),
            format!("{}/{experiments}", held.name),
        ));
        let labels = cell.comparand.labels().into_iter();
        run.extend(labels.map(|(name, value)| (name.to_owned(), value)));
    }
    Some(Inline::Ours(Ours {
        exact: c.reproduced?,
        interval: c.interval,
        run,
    }))
}

/// The printed times beside the recorded ones.
pub fn times(held: &Held, times: &[RecordedTime]) -> Vec<Block> {
    let printed = held.published.iter().filter(|p| &*p.kind == "timing");
    let printed: Vec<&Published> = printed.collect();
    if printed.is_empty() {
        return Vec::new();
    }
    let mut processors = BTreeSet::new();
    let rows = printed.iter().map(|p| {
        let unit = if &*p.unit == "1" { "" } else { &p.unit };
        let (place, shown) = (
            format!("{}, {}, {}", p.table, label(&p.row), label(&p.column)),
            format!("{} {unit}", p.printed),
        );
        let recorded = recorded(held, p, times, &mut processors);
        let reason = held.paper.as_ref().and_then(|paper| reason(paper, p));
        vec![
            place.into(),
            shown.trim().into(),
            recorded.unwrap_or_else(|| "not recorded".to_owned()).into(),
            reason.into(),
        ]
    });
    let rows: Vec<Vec<Cell>> = rows.collect();
    let columns = [
        ("cell", Shape::Words),
        ("published", Shape::Number),
        ("recorded, a step", Shape::Number),
        ("what the paper says of it", Shape::Why),
    ];
    let on = match processors.into_iter().collect::<Vec<_>>().as_slice() {
        [] => prose(" (`just record-timings` writes it)."),
        some => line![format!(", on {}.", some.join(", "))],
    };
    vec![
        Block::heading(3, "Times"),
        Block::Para(line![
            "A time depends on the machine and the program: it is compared with nothing here. Ours is the median time of \
             a step from the recorded ",
            code("timings.csv"),
            on
        ]),
        Block::Table(Table::new(Kind::Sortable, "Times", &columns, rows)),
    ]
}

/// What was recorded of a printed time; `processors` learns where.
fn recorded<'a>(
    held: &Held,
    p: &Published,
    times: &'a [RecordedTime],
    processors: &mut BTreeSet<&'a str>,
) -> Option<String> {
    let cells = &held.paper.as_ref()?.cells;
    let (time, over) = cells.iter().find_map(|c| {
        let here = *c.table == *p.table && *c.row == *p.row && *c.column == *p.column;
        match &c.comparand {
            Comparand::Timing { of, over } if here => Some((of, over.as_ref())),
            _ => None,
        }
    })?;
    let of = |time: &Time| timings::find(times, &held.name, time);
    let (recorded, processor) = of(time)?;
    processors.insert(processor);
    let Some(over) = over else {
        return Some(format!("{} µs", four_digits(recorded)));
    };
    let ratio = four_digits(recorded / of(over)?.0);
    Some(format!("{ratio} of the time of {}", over.estimator))
}

/// What `published.csv` says about a printed number.
fn reason<'a>(paper: &'a Paper, p: &Published) -> Option<&'a str> {
    let found = paper
        .published
        .iter()
        .find(|q| *q.table == *p.table && *q.row == *p.row && *q.column == *p.column);
    found.map(|q| q.reason.as_str())
}

/// The SQL behind the tables of a paper.
pub fn behind(held: &Held) -> String {
    query(&format!(
        "SELECT \"table\", \"row\", \"column\", reading, published, reproduced, interval_lo, interval_hi, verdict, reason FROM \
         comparison WHERE paper = '{}'",
        held.name
    ))
}
