//! Other tools on the same sets: the committed `peers.csv`, which `just bench --record` writes.
//!
//! What is said here is computed from its rows: ratios of medians, and how many hulls leave out a point that is in
//! their set exactly.

use crate::document::prose::prose;
use crate::document::{Block, Kind, Page, Picture, Shape, Table, line};
use crate::svg::Colour;
use crate::svg::bars::{Bar, Bars, Group};
use serde::Deserialize;
use std::path::Path;
use zonobench_lake::bad_input::BadInput;
use zonobench_lake::error::Error;

/// What one tool took for one operation on the sets of one size, and how its hulls came out.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PeerRow {
    /// Whose; ours is [`OURS`]
    pub tool: String,
    /// Its version
    pub version: String,
    /// What was asked
    pub operation: String,
    /// Dimension of the sets
    pub n: usize,
    /// Their generators
    pub generators: usize,
    /// Their constraints
    pub constraints: usize,
    /// How often all sets were gone through
    pub samples: usize,
    /// Shortest time of one operation in µs
    pub min_us: f64,
    /// Median
    pub median_us: f64,
    /// 10 % are below
    pub low_us: f64,
    /// 10 % are above
    pub high_us: f64,
    /// Hulls compared with the exact ones
    pub hulls: Option<usize>,
    /// Those that leave out a point of their set
    pub cut_off: Option<usize>,
    /// The greatest part of a set's width beyond its hull
    pub worst_cut: Option<f64>,
    /// The greatest part of a hull beyond its set, by the set's width
    pub excess: Option<f64>,
    /// What else is to be known
    pub remark: String,
    /// The processor's model
    pub processor: String,
}

/// Our rows' `tool`.
pub const OURS: &str = "zonobench";

/// The same steps of ours without bounds on their rounding.
const PLAIN: &str = "plain f64";

/// The ratio that a certified hull is to reach.
const WANTED: f64 = 20.0;

const COLUMNS: [&str; 17] = [
    "tool",
    "version",
    "operation",
    "n",
    "generators",
    "constraints",
    "samples",
    "min_us",
    "median_us",
    "low_us",
    "high_us",
    "hulls",
    "cut_off",
    "worst_cut",
    "excess",
    "remark",
    "processor",
];

/// The rows of `path`, none if there is no such file. A row that is not right is refused with its line.
pub fn read(path: &Path) -> Result<Vec<PeerRow>, Error> {
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(Error::io("read", path, e)),
    };
    let expected = format!("expected the columns {}", COLUMNS.join(", "));
    let refuse = |line: usize, got: String| {
        BadInput::line(
            path.display().to_string(),
            line,
            format!("{expected}, got {got}"),
        )
    };
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let header = reader
        .headers()
        .map_err(|e| refuse(1, e.to_string()))?
        .clone();
    if header != COLUMNS.to_vec() {
        return Err(refuse(1, header.iter().collect::<Vec<_>>().join(", ")).into());
    }
    let mut rows: Vec<PeerRow> = Vec::new();
    for record in reader.records() {
        let line = |p: Option<&csv::Position>| p.map_or(0, |p| p.line() as usize);
        let record = record.map_err(|e| refuse(line(e.position()), e.to_string()))?;
        let row: PeerRow = record
            .deserialize(Some(&header))
            .map_err(|e| refuse(line(record.position()), e.to_string()))?;
        if ![row.min_us, row.median_us, row.low_us, row.high_us]
            .iter()
            .all(|t| t.is_finite() && *t > 0.0)
        {
            return Err(refuse(
                line(record.position()),
                "a time that is not positive".to_owned(),
            )
            .into());
        }
        rows.push(row);
    }
    Ok(rows)
}

impl PeerRow {
    /// What was asked, and of what size.
    fn question(&self) -> (&str, [usize; 3]) {
        (&self.operation, [self.n, self.generators, self.constraints])
    }
}

/// n, n_g, n_c.
fn size([n, generators, constraints]: [usize; 3]) -> String {
    format!("n = {n}, n_g = {generators}, n_c = {constraints}")
}

/// A tool's row beside ours of the same question.
struct Ratio<'a> {
    row: &'a PeerRow,
    ours: &'a PeerRow,
}

impl Ratio<'_> {
    /// Of the medians.
    fn median(&self) -> f64 {
        self.row.median_us / self.ours.median_us
    }

    /// From the 10 % to the 90 % samples of both.
    fn spread(&self) -> [f64; 2] {
        [
            self.row.low_us / self.ours.high_us,
            self.row.high_us / self.ours.low_us,
        ]
    }

    fn shown(&self) -> String {
        let [low, high] = self.spread();
        format!(
            "{} [{}, {}]",
            digits(self.median()),
            digits(low),
            digits(high)
        )
    }
}

/// The other tools' rows of `operation`, smallest sets first, each beside ours.
fn ratios<'a>(rows: &'a [PeerRow], operation: &'a str) -> Vec<Ratio<'a>> {
    let ours = |row: &PeerRow| {
        rows.iter()
            .find(|o| o.tool == OURS && o.question() == row.question())
    };
    let others = rows
        .iter()
        .filter(|r| r.operation == operation && r.tool != OURS && r.tool != PLAIN);
    let mut found: Vec<Ratio> = others
        .filter_map(|row| {
            Some(Ratio {
                row,
                ours: ours(row)?,
            })
        })
        .collect();
    found.sort_by_key(|r| r.row.question().1);
    found
}

/// The operations in the order of the file that another tool was asked for, too.
fn operations(rows: &[PeerRow]) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for row in rows {
        let name = row.operation.as_str();
        if !all.contains(&name) && !ratios(rows, name).is_empty() {
            all.push(name);
        }
    }
    all
}

/// Three digits of a ratio or a time.
fn digits(x: f64) -> String {
    match x {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x if x >= 1.0 => format!("{x:.2}"),
        x => format!("{x:.3}"),
    }
}

/// How the hulls of a row came out.
fn cut(row: &PeerRow) -> String {
    match (row.hulls, row.cut_off, row.worst_cut) {
        (Some(hulls), Some(0), _) => format!("0 of {hulls}"),
        (Some(hulls), Some(cut), Some(worst)) => {
            format!("{cut} of {hulls}, by up to {worst:.1e} of the width")
        }
        _ => String::new(),
    }
}

/// The statement about the certified hull: above or below [`WANTED`] against every tool at every size.
fn verdict(rows: &[PeerRow]) -> String {
    let found = ratios(rows, "interval hull");
    let Some(least) = found.iter().map(Ratio::median).reduce(f64::min) else {
        return "No other tool's hulls are recorded.".to_owned();
    };
    let below: Vec<String> = found
        .iter()
        .filter(|r| r.median() < WANTED)
        .map(|r| {
            format!(
                "{} at {} ({})",
                r.row.tool,
                size(r.row.question().1),
                r.shown()
            )
        })
        .collect();
    if below.is_empty() {
        return format!(
            "The certified hull takes less than a {WANTED}th of the time of every tool at every size; the least ratio is {}.",
            digits(least)
        );
    }
    format!(
        "The certified hull takes less than a {WANTED}th of the time of every tool, except of {}.",
        below.join("; ")
    )
}

/// What certifying and rounding cost, a sentence a size.
fn cost(rows: &[PeerRow]) -> Vec<String> {
    let of = |tool: &str, operation: &str, like: &PeerRow| {
        rows.iter()
            .find(|r| {
                r.tool == tool && r.operation == operation && r.question().1 == like.question().1
            })
            .map(|r| r.median_us)
    };
    let mut out = Vec::new();
    for row in rows {
        let share = match (row.tool.as_str(), row.operation.as_str()) {
            (OURS, "certificates of a hull") => of(OURS, "interval hull", row).map(|whole| {
                format!("the certificates are {:.1} % of a hull", 100.0 * row.median_us / whole)
            }),
            (PLAIN, operation) => of(OURS, operation, row).map(|ours| {
                format!("a {operation} with its rounding takes {:.0} % longer than in plain f64 ({} µs, {} µs)",
                    100.0 * (ours / row.median_us - 1.0), digits(ours), digits(row.median_us))
            }),
            _ => None,
        };
        out.extend(share.map(|share| format!("{}: {share}", size(row.question().1))));
    }
    out
}

/// The processors of the rows.
fn processors(rows: &[PeerRow]) -> String {
    let mut all: Vec<&str> = rows.iter().map(|r| r.processor.as_str()).collect();
    all.sort_unstable();
    all.dedup();
    all.join(", ")
}

const ABOUT: &str = "Every tool gets the same sets, whose coefficients are short binary fractions. The points that a hull has to \
    hold are vertices solved for in rational numbers; they are in the set without any rounding, and two programs check \
    that. A cut is the part of the set's width that a hull leaves out. Times are medians of passes over all sets, on one \
    thread; in brackets is the spread of the ratio, from the 10 % to the 90 % samples of both. The other tools are \
    timed inside Python, around calls of compiled libraries; an empty call takes less than a µs. HiGHS runs a warm \
    simplex without presolve, clarabel one solver a set, both at their default tolerances; ZonoOpt at its default \
    tolerances and at 1e-8. ZonoOpt reduces constraints alone, so that its steps leave more generators than ours. Codac \
    has no constrained zonotope: only boxes of zonotopes and functions over boxes can be asked of it.";

/// The chart: other tools' times as multiples of ours.
fn chart(rows: &[PeerRow]) -> String {
    let mut tools: Vec<&str> = Vec::new();
    let mut groups: Vec<Group> = Vec::new();
    for operation in operations(rows) {
        for ratio in ratios(rows, operation) {
            let label = format!("{operation}, {}", size(ratio.row.question().1));
            let tool = ratio.row.tool.as_str();
            if !tools.contains(&tool) {
                tools.push(tool);
            }
            let bar = Bar {
                name: tool.to_owned(),
                value: ratio.median(),
                ends: Some(ratio.spread()),
                text: match ratio.row.cut_off {
                    Some(0) | None => format!("{} ×", digits(ratio.median())),
                    Some(_) => format!(
                        "{} ×, cuts off {}",
                        digits(ratio.median()),
                        short_cut(ratio.row)
                    ),
                },
                colour: Colour::nth(tools.iter().position(|t| *t == tool).unwrap_or(0)),
            };
            match groups.last_mut().filter(|g| g.label == label) {
                Some(group) => group.bars.push(bar),
                None => groups.push(Group {
                    label,
                    bars: vec![bar],
                }),
            }
        }
    }
    Bars {
        title: "Time of other tools, as a multiple of ours".to_owned(),
        description: verdict(rows),
        groups,
    }
    .to_svg()
}

fn short_cut(row: &PeerRow) -> String {
    format!("{} of {}", row.cut_off.unwrap_or(0), row.hulls.unwrap_or(0))
}

/// The name of the chart beside the page.
const CHART: &str = "peers.svg";

const HEADER: [(&str, Shape); 8] = [
    ("tool", Shape::Words),
    ("median, µs", Shape::Number),
    ("least, µs", Shape::Number),
    ("ratio", Shape::Number),
    ("hulls that cut off a point", Shape::Words),
    ("hull too wide by", Shape::Number),
    ("version", Shape::Words),
    ("remark", Shape::Why),
];

/// The cells of a row.
fn cells(row: &PeerRow, ratio: String) -> [String; 8] {
    [
        row.tool.clone(),
        digits(row.median_us),
        digits(row.min_us),
        ratio,
        cut(row),
        row.excess.map(|e| format!("{e:.1e}")).unwrap_or_default(),
        row.version.clone(),
        row.remark.clone(),
    ]
}

/// A table a question: its title, and the rows, ours first.
fn tables(rows: &[PeerRow]) -> Vec<(String, Vec<[String; 8]>)> {
    let mut out: Vec<(String, Vec<[String; 8]>)> = Vec::new();
    for operation in operations(rows) {
        for ratio in ratios(rows, operation) {
            let title = format!("{operation}, {}", size(ratio.row.question().1));
            if out.last().is_none_or(|(last, _)| *last != title) {
                out.push((title, vec![cells(ratio.ours, "1".to_owned())]));
            }
            if let Some((_, lines)) = out.last_mut() {
                lines.push(cells(ratio.row, ratio.shown()));
            }
        }
    }
    out
}

/// The page; None where nothing was recorded.
pub fn page(rows: &[PeerRow]) -> Option<Page> {
    if rows.is_empty() {
        return None;
    }
    let mut blocks = vec![
        Block::Para(line![verdict(rows), " ", ours_cut(rows)]),
        Block::Para(line![ABOUT]),
        Block::Para(prose(&format!(
            "Recorded on {}; `just bench` shows it on this machine.",
            processors(rows)
        ))),
        Block::Picture(Picture {
            file: CHART.to_owned(),
            title: verdict(rows),
            svg: chart(rows),
            caption: Vec::new(),
        }),
    ];
    for (title, lines) in tables(rows) {
        blocks.push(Block::heading(2, &title));
        let lines = lines.into_iter().map(|line| line.map(Into::into).to_vec());
        let table = Table::new(Kind::Sortable, title, &HEADER, lines.collect());
        blocks.push(Block::Table(table));
    }
    let cost = cost(rows);
    if !cost.is_empty() {
        blocks.push(Block::heading_at(
            2,
            "cost",
            "What certifying and rounding cost",
        ));
        blocks.push(Block::list(cost.into_iter().map(|cost| line![cost])));
    }
    Some(Page {
        place: "peers".to_owned(),
        name: "Other tools".to_owned(),
        file: Some("peers.md".to_owned()),
        title: line!["Beside other tools"],
        blocks,
    })
}

/// How our hulls came out, as a sentence.
fn ours_cut(rows: &[PeerRow]) -> String {
    let ours = || rows.iter().filter(|r| r.tool == OURS);
    let hulls: usize = ours().filter_map(|r| r.hulls).sum();
    let cut: usize = ours().filter_map(|r| r.cut_off).sum();
    format!("Of our {hulls} hulls {cut} cut off a point of their set.")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The committed rows.
    fn recorded() -> Vec<PeerRow> {
        read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/peers.csv")).unwrap()
    }

    #[test]
    fn the_committed_rows_are_shown() {
        let rows = recorded();
        let hulls = ratios(&rows, "interval hull");
        let tools: Vec<&str> = hulls.iter().map(|r| r.row.tool.as_str()).collect();
        for tool in ["clarabel", "HiGHS", "ZonoOpt", "ZonoOpt 1e-8"] {
            assert_eq!(
                tools.iter().filter(|t| **t == tool).count(),
                3,
                "{tool}: one a size"
            );
        }
        let pages = [page(&rows).unwrap()];
        let page = &crate::render::markdown::files(&pages)["peers.md"];
        let html = crate::render::html::file(&pages, &serde_json::Value::Null);
        for ratio in &hulls {
            let shown = crate::render::markdown::escaped(&ratio.shown());
            assert!(page.contains(&shown), "{page}");
            assert!(html.contains(&ratio.shown()));
        }
        for row in rows.iter().filter(|r| r.tool == OURS && r.hulls.is_some()) {
            assert_eq!(row.cut_off, Some(0), "a certified hull cuts off nothing");
        }
        assert!(page.contains("Of our 100 hulls 0 cut off a point of their set."));
        assert!(chart(&rows).contains("interval hull, n = 12, n_g = 40, n_c = 12"));
    }

    #[test]
    fn a_ratio_below_the_one_wanted_is_named() {
        let mut rows = recorded();
        rows.retain(|r| r.tool == OURS || r.tool == "HiGHS");
        for row in rows.iter_mut().filter(|r| r.tool == "HiGHS") {
            row.median_us = if row.n == 12 { 0.5 } else { 1e6 };
        }
        let said = verdict(&rows);
        assert!(
            said.contains("except of HiGHS at n = 12, n_g = 40, n_c = 12 (0.00"),
            "{said}"
        );
        assert!(!said.contains("n = 2"), "{said}");
        rows.iter_mut()
            .filter(|r| r.tool == "HiGHS")
            .for_each(|r| r.median_us = 1e6);
        assert!(verdict(&rows).contains("of every tool at every size; the least ratio is "));
    }

    #[test]
    fn a_bad_row_is_refused_with_its_line_and_the_columns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("peers.csv");
        assert_eq!(read(&path).unwrap(), []);
        let good = "a,1,interval hull,2,20,5,9,1,2,1,3,40,0,0.0,1e-14,,CPU\n";
        let complaint = |text: String| {
            std::fs::write(&path, text).unwrap();
            read(&path).unwrap_err().to_string()
        };
        let header = format!("{}\n", COLUMNS.join(","));
        std::fs::write(&path, format!("{header}{good}")).unwrap();
        assert_eq!(read(&path).unwrap()[0].cut_off, Some(0));
        for bad in [
            good.replace(",2,20,", ",two,20,"),
            good.replace(",CPU", ""),
            good.replace(",9,1,2", ",9,1,-2"),
        ] {
            let said = complaint(format!("{header}{good}{bad}"));
            assert!(
                said.contains("peers.csv:3: expected the columns tool, version, operation, n, "),
                "{said}"
            );
        }
        let said = complaint(header.replace("tool", "name"));
        assert!(
            said.contains("peers.csv:1: expected the columns tool, "),
            "{said}"
        );
    }
}
