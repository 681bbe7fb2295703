//! What the sweeps put into the lake: the papers' numbered claims put to the test, the campaign against the
//! guarantees, the counted operations. Each is shown with the columns that it has.

use super::markup::{badge_named, escaped, place, row, scrolling, table};
use super::{Page, heading};
use crate::svg::{self, Axis, Colour, Marker, Panel, Series};
use std::path::Path;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_query::query::{self, Answer, Value};
use zonobench_verdicts::verdict::Verdict;

/// A table of the lake, the command that makes it, and what it is.
const TABLES: [(&str, &str, &str); 3] = [
    (
        "claims",
        "claims",
        "The papers' numbered claims put to the test, on hand-made, random and adversarial cases.",
    ),
    (
        "attack",
        "attack",
        "A campaign against the guarantees: every way we know to drive the truth out of a set that is guaranteed to hold it.",
    ),
    (
        "complexity",
        "count",
        "Operations that were counted, beside the formula that the paper prints.",
    ),
];

/// What the lake holds of these tables.
pub struct Measured {
    frames: [Option<Answer>; 3],
}

/// Reads the tables that there are.
pub fn read(lake: &Path) -> Result<Measured, Error> {
    let mut frames = [None, None, None];
    for (frame, (name, _, _)) in frames.iter_mut().zip(TABLES) {
        *frame = query::table(lake, name)?;
    }
    Ok(Measured { frames })
}

impl Measured {
    /// The tables that the lake does not hold, with the command that makes each.
    pub fn missing(&self) -> Vec<(&'static str, &'static str)> {
        let absent = self
            .frames
            .iter()
            .zip(TABLES)
            .filter(|(frame, _)| frame.is_none());
        absent
            .map(|(_, (name, command, _))| (name, command))
            .collect()
    }
}

/// A cell as text; empty where there is none.
fn text(frame: &Answer, column: &str, i: usize) -> String {
    match frame.value(column, i) {
        None => String::new(),
        Some(Value::Float(x)) => four_digits(x),
        Some(other) => other.text().into_owned(),
    }
}

fn number(frame: &Answer, column: &str, i: usize) -> Option<f64> {
    frame.value(column, i)?.number().filter(|x| x.is_finite())
}

/// The page of all three, each with a word where it is missing.
pub fn page(measured: &Measured) -> Page {
    let mut body = "<h1>Claims, attacks, operation counts</h1>\n".to_owned();
    for (frame, (name, command, what)) in measured.frames.iter().zip(TABLES) {
        body += &heading(2, name, name);
        body += &format!("<p>{}</p>\n", escaped(what));
        let Some(frame) = frame else {
            body += &format!(
                "<p class=\"notice\">Missing: this lake does not hold the table; <code>zonobench {command}</code> is what makes it.</p>\n"
            );
            continue;
        };
        if name == "complexity" {
            body += &counts(frame);
        }
        let all: Vec<usize> = (0..frame.len()).collect();
        if name == "claims" {
            let is_remark = |i: &usize| text(frame, "verdict", *i) == Verdict::Remark.name();
            let (remarks, own): (Vec<usize>, Vec<usize>) = all.into_iter().partition(is_remark);
            // How many of the drawn trials were lost measures who drew them.
            body += &whole("claims", frame, &own, &["trials", "lost"]);
            if !remarks.is_empty() {
                body += &heading(3, "remarks", "Remarks of ours");
                body += "<p>The papers do not say these things: they are charged to nobody, and are in no count.</p>\n";
                body += &whole("claims, remarks", frame, &remarks, &["trials", "lost"]);
            }
        } else {
            body += &whole(name, frame, &all, &[]);
        }
    }
    Page {
        place: place("", "claims attacks counts"),
        name: "Claims and counts".to_owned(),
        body,
    }
}

/// These rows, the path's keys first, without some columns.
fn whole(name: &str, frame: &Answer, rows: &[usize], without: &[&str]) -> String {
    let mut columns: Vec<String> = frame.columns().to_vec();
    columns.retain(|c| !without.contains(&c.as_str()));
    columns.sort_by_key(|c| match c.as_str() {
        "paper" => 0,
        "experiment" => 1,
        _ => 2,
    });
    let header: Vec<String> = columns
        .iter()
        .map(|c| escaped(c).replace('_', " "))
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let rows: Vec<String> = rows
        .iter()
        .map(|&i| {
            let cells: Vec<String> = columns
                .iter()
                .map(|c| match (c.as_str(), text(frame, c, i)) {
                    ("verdict", verdict) => badge_named(&verdict),
                    (_, text) => escaped(&text),
                })
                .collect();
            row(&cells)
        })
        .collect();
    table(
        "sortable filtered",
        &format!("Table {name}"),
        &header,
        &rows.concat(),
    )
}

/// A chart a paper, claim and sweep: what was counted and the printed formula, over the size that was swept.
fn counts(frame: &Answer) -> String {
    let mut claims: Vec<(String, String, Vec<usize>)> = Vec::new();
    for i in 0..frame.len() {
        let sweep = text(frame, "sweep_variable", i);
        // The row that has the verdict of the whole claim has no size.
        if sweep.is_empty() {
            continue;
        }
        let paper = text(frame, "paper", i);
        let claim = format!("{}, over {sweep}", text(frame, "claim", i));
        match claims
            .iter_mut()
            .find(|(p, c, _)| *p == paper && *c == claim)
        {
            Some((_, _, rows)) => rows.push(i),
            None => claims.push((paper, claim, vec![i])),
        }
    }
    let mut out = String::new();
    for (paper, claim, rows) in claims {
        let points = |column: &str| -> Vec<[f64; 2]> {
            let at = |i: &usize| Some([number(frame, "size", *i)?, number(frame, column, *i)?]);
            let mut points: Vec<[f64; 2]> = rows.iter().filter_map(at).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points
        };
        let (counted, formula) = (points("counted"), points("formula"));
        if counted.len() < 2 {
            continue;
        }
        let logarithmic = |label: &str| Axis {
            log: true,
            ..Axis::new(label, "")
        };
        let figure = svg::Figure {
            title: format!("{paper}: {claim}"),
            columns: 1,
            panels: vec![Panel {
                x: logarithmic(&text(frame, "sweep_variable", rows[0])),
                y: logarithmic("operations"),
                series: vec![
                    Series::Dashes {
                        label: "printed formula".to_owned(),
                        colour: Colour::Vermilion,
                        points: formula,
                    },
                    Series::Line {
                        label: "counted".to_owned(),
                        colour: Colour::Blue,
                        points: counted.clone(),
                    },
                    Series::Points {
                        label: "counted".to_owned(),
                        colour: Colour::Blue,
                        marker: Marker::Ring,
                        points: counted,
                    },
                ],
                ..Panel::default()
            }],
            ..svg::Figure::default()
        };
        out += &format!(
            "<details><summary>{}: {} {}</summary><figure>{}</figure></details>\n",
            escaped(&paper),
            escaped(&claim),
            badge_named(&text(frame, "verdict", rows[0])),
            scrolling(&claim, &figure.to_svg())
        );
    }
    out
}
