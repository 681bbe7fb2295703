//! Two lakes beside each other: which published cells, scores and claims moved, and which part of a key did it.

use serde_json::{Value as Json, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use zonobench_lake::causes;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_query::query::{self, Value};
use zonobench_verdicts::papers::{self, Paper};

/// What is compared: a table of the lake, the columns that name a row of it, and those that may move.
struct Compared {
    table: &'static str,
    one: &'static str,
    many: &'static str,
    names: &'static [&'static str],
    value: &'static str,
    interval: Option<[&'static str; 2]>,
    verdict: Option<&'static str>,
}

const COMPARED: [Compared; 3] = [
    Compared {
        table: "comparison",
        one: "published cell",
        many: "published cells",
        names: &["paper", "table", "row", "column", "reading"],
        value: "reproduced",
        interval: Some(["interval_lo", "interval_hi"]),
        verdict: Some("verdict"),
    },
    Compared {
        table: "scores",
        one: "score",
        many: "scores",
        names: &[
            "paper",
            "experiment",
            "estimator",
            "metric",
            "component",
            "over",
        ],
        value: "mean",
        interval: Some(["ci_lo", "ci_hi"]),
        verdict: None,
    },
    Compared {
        table: "claims",
        one: "claim",
        many: "claims",
        names: &["paper", "claim"],
        value: "lost",
        interval: None,
        verdict: Some("verdict"),
    },
];

/// What one lake says of a row.
#[derive(Clone, Debug, PartialEq)]
struct Side {
    value: Option<f64>,
    interval: Option<[f64; 2]>,
    verdict: String,
}

/// How a row moved, the gravest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Move {
    /// Another verdict.
    Verdict,
    /// To a number outside of the first lake's interval, or from one without interval.
    Beyond,
    /// To a number within the first lake's interval, or only its interval.
    Within,
    /// The second lake has it not.
    OnlyOld,
    /// The first lake has it not.
    OnlyNew,
}

impl Move {
    const ALL: [Self; 5] = [
        Self::Verdict,
        Self::Beyond,
        Self::Within,
        Self::OnlyOld,
        Self::OnlyNew,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Verdict => "verdict",
            Self::Beyond => "beyond",
            Self::Within => "within",
            Self::OnlyOld => "only_first",
            Self::OnlyNew => "only_second",
        }
    }

    fn says(self) -> &'static str {
        match self {
            Self::Verdict => "another verdict",
            Self::Beyond => "moved beyond its interval",
            Self::Within => "moved within its interval",
            Self::OnlyOld => "only in the first",
            Self::OnlyNew => "only in the second",
        }
    }

    /// None where nothing moved, bit for bit.
    fn between(old: &Side, new: &Side) -> Option<Self> {
        if old == new {
            return None;
        }
        if old.verdict != new.verdict {
            return Some(Self::Verdict);
        }
        if old.value == new.value {
            return Some(Self::Within);
        }
        let inside = |[lo, hi]: [f64; 2]| new.value.is_some_and(|x| lo <= x && x <= hi);
        Some(match old.interval {
            Some(interval) if inside(interval) => Self::Within,
            _ => Self::Beyond,
        })
    }
}

/// A row that moved.
struct Line {
    compared: &'static Compared,
    names: Vec<String>,
    old: Option<Side>,
    new: Option<Side>,
    moved: Move,
    causes: Vec<String>,
}

/// All that moved between two lakes.
pub struct Diff {
    lines: Vec<Line>,
    unchanged: BTreeMap<&'static str, usize>,
    remarks: Vec<String>,
}

/// How a difference is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// For reading in a terminal
    Table,
    /// For a pull request
    Markdown,
    /// Everything, for a program
    Json,
    /// A page of its own
    Html,
}

type Rows = BTreeMap<Vec<String>, Side>;

fn read(lake: &Path, compared: &Compared, remarks: &mut Vec<String>) -> Result<Rows, Error> {
    let Some(answer) = query::table(lake, compared.table)? else {
        remarks.push(format!(
            "{} has no table {}",
            lake.display(),
            compared.table
        ));
        return Ok(Rows::new());
    };
    let mut place = |column: &str| {
        let at = answer.columns().iter().position(|c| c == column);
        if at.is_none() {
            remarks.push(format!(
                "{} has no column {column} in {}",
                lake.display(),
                compared.table
            ));
        }
        at
    };
    let names: Vec<_> = compared.names.iter().map(|c| place(c)).collect();
    let value = place(compared.value);
    let interval = compared.interval.map(|ends| ends.map(&mut place));
    let verdict = compared.verdict.and_then(&mut place);
    let number = |row: &[Value<'_>], at: Option<usize>| row.get(at?)?.number();
    let text = |row: &[Value<'_>], at: Option<usize>| {
        at.and_then(|at| row.get(at))
            .map_or(String::new(), |v| v.text().into_owned())
    };
    Ok(answer
        .rows()
        .map(|row| {
            let ends = interval.map(|[lo, hi]| (number(&row, lo), number(&row, hi)));
            let side = Side {
                value: number(&row, value),
                interval: match ends {
                    Some((Some(lo), Some(hi))) => Some([lo, hi]),
                    _ => None,
                },
                verdict: text(&row, verdict),
            };
            (names.iter().map(|&at| text(&row, at)).collect(), side)
        })
        .collect())
}

/// Where the causes of a line are looked for: experiments, and the estimators that it is of.
fn places(
    compared: &Compared,
    names: &[String],
    papers: &[Paper],
) -> (Vec<String>, BTreeSet<String>) {
    let whole = "-".to_owned();
    match compared.table {
        "scores" => (
            vec![names[1].clone()],
            [&names[2], &names[5]].into_iter().cloned().collect(),
        ),
        "comparison" => {
            let cell = papers
                .iter()
                .filter(|paper| paper.name == names[0])
                .flat_map(|paper| &paper.cells)
                .find(|cell| {
                    [&cell.table, &cell.row, &cell.column]
                        .into_iter()
                        .eq(&names[1..4])
                        && cell.reading.name() == names[4]
                });
            let experiments = cell.map(|cell| cell.comparand.experiments().to_vec());
            let mut experiments = experiments.unwrap_or_default();
            experiments.push(whole);
            (experiments, BTreeSet::new())
        }
        _ => (vec![whole], BTreeSet::new()),
    }
}

/// Compares what two lakes say, row by row.
///
/// Fails where one is no lake. A table or a column that one of them lacks is told, and what has it is `only in` the other.
pub fn diff(old: &Path, new: &Path) -> Result<Diff, Error> {
    let papers = papers::load(&[])?;
    let mut found = Diff {
        lines: Vec::new(),
        unchanged: BTreeMap::new(),
        remarks: Vec::new(),
    };
    let mut known: BTreeMap<(String, String), Option<Vec<causes::Cause>>> = BTreeMap::new();
    for compared in &COMPARED {
        let mut then = read(old, compared, &mut found.remarks)?;
        let now = read(new, compared, &mut found.remarks)?;
        let mut same = 0;
        let mut sides: Vec<(Vec<String>, Option<Side>, Option<Side>)> = Vec::new();
        for (names, side) in now {
            let before = then.remove(&names);
            sides.push((names, before, Some(side)));
        }
        sides.extend(
            then.into_iter()
                .map(|(names, side)| (names, Some(side), None)),
        );
        for (names, then, now) in sides {
            let moved = match (&then, &now) {
                (Some(then), Some(now)) => match Move::between(then, now) {
                    Some(moved) => moved,
                    None => {
                        same += 1;
                        continue;
                    }
                },
                (Some(_), None) => Move::OnlyOld,
                _ => Move::OnlyNew,
            };
            let causes = if matches!(moved, Move::OnlyOld | Move::OnlyNew) {
                Vec::new()
            } else {
                why(compared, &names, &papers, |experiment| {
                    let key = (names[0].clone(), experiment.to_owned());
                    let found = known
                        .entry(key)
                        .or_insert_with(|| causes::between(old, new, &names[0], experiment));
                    found.clone()
                })
            };
            found.lines.push(Line {
                compared,
                names,
                old: then,
                new: now,
                moved,
                causes,
            });
        }
        found.unchanged.insert(compared.table, same);
    }
    // Rows come by table and names; a stable sort keeps that within a kind of move.
    found.lines.sort_by_key(|line| line.moved);
    Ok(found)
}

fn why(
    compared: &Compared,
    names: &[String],
    papers: &[Paper],
    mut between: impl FnMut(&str) -> Option<Vec<causes::Cause>>,
) -> Vec<String> {
    let (experiments, estimators) = places(compared, names, papers);
    let mut out = Vec::new();
    let mut code: BTreeSet<String> = BTreeSet::new();
    let mut remembered = false;
    for experiment in experiments {
        let Some(causes) = between(&experiment) else {
            continue;
        };
        remembered = true;
        for cause in causes {
            let elsewhere = |e: &str| !estimators.is_empty() && !estimators.contains(e);
            // No number comes from a trace, and a claim of the ledger only from its own stage.
            let other = cause.stage.starts_with("trace")
                || (compared.table == "claims" && cause.stage != "claims");
            if other || cause.estimator().is_some_and(elsewhere) {
                continue;
            }
            if cause.place == "code" {
                code.insert(cause.stage);
            } else if experiment == "-" {
                out.push(cause.to_string());
            } else {
                out.push(format!("{experiment}/{cause}"));
            }
        }
    }
    if !code.is_empty() {
        let stages: Vec<String> = code.into_iter().collect();
        out.push(format!("another code of {}", stages.join(", ")));
    }
    if !remembered {
        out.push("not known: one of the lakes does not remember how it was made".to_owned());
    }
    out
}

/// So many lines of a kind are shown, unless all are asked for.
const SHOWN: usize = 20;

impl Diff {
    /// True if a verdict is another one, or a number left its interval.
    pub fn moved_beyond(&self) -> bool {
        let grave = |line: &Line| matches!(line.moved, Move::Verdict | Move::Beyond);
        self.lines.iter().any(grave)
    }

    /// As text.
    pub fn render(&self, format: Format, all: bool) -> String {
        match format {
            Format::Table => self.text(all),
            Format::Markdown => self.markdown(all),
            Format::Json => self.json(),
            Format::Html => self.html(),
        }
    }

    fn count(&self, compared: &Compared, moved: Move) -> usize {
        let of = |line: &&Line| line.compared.table == compared.table && line.moved == moved;
        self.lines.iter().filter(of).count()
    }

    /// The lines of a kind of move, at most so many, and how many are left out.
    fn shown(&self, moved: Move, all: bool) -> (Vec<&Line>, usize) {
        let lines: Vec<&Line> = self.lines.iter().filter(|l| l.moved == moved).collect();
        let kept = if all {
            lines.len()
        } else {
            SHOWN.min(lines.len())
        };
        let left = lines.len() - kept;
        (lines.into_iter().take(kept).collect(), left)
    }

    fn summary(&self) -> Vec<String> {
        COMPARED
            .iter()
            .map(|compared| {
                let same = self.unchanged.get(compared.table).copied().unwrap_or(0);
                let noun = if same == 1 {
                    compared.one
                } else {
                    compared.many
                };
                let mut parts = vec![format!("{same} {noun} unchanged")];
                for moved in Move::ALL {
                    match self.count(compared, moved) {
                        0 => {}
                        n => parts.push(format!("{n} {}", moved.says())),
                    }
                }
                parts.join(", ")
            })
            .collect()
    }

    fn text(&self, all: bool) -> String {
        let mut out = String::new();
        for remark in &self.remarks {
            out += &format!("note: {remark}\n");
        }
        for moved in Move::ALL {
            let (lines, left) = self.shown(moved, all);
            if lines.is_empty() {
                continue;
            }
            out += &format!("{}\n", moved.says());
            let mut causes: &[String] = &[];
            for line in lines {
                out += &format!("  {}: {}\n", line.name(), line.change());
                // Lines in a row often have one cause: it is told under the first.
                if line.causes != causes {
                    causes = &line.causes;
                    for cause in causes {
                        out += &format!("      {cause}\n");
                    }
                }
            }
            if left > 0 {
                out += &format!("  and {left} more (--all shows them)\n");
            }
            out.push('\n');
        }
        for line in self.summary() {
            out += &format!("{line}\n");
        }
        out
    }

    fn markdown(&self, all: bool) -> String {
        let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
        let mut out = String::from("### What moved\n\n");
        for line in self.summary() {
            out += &format!("- {line}\n");
        }
        for remark in &self.remarks {
            out += &format!("- {remark}\n");
        }
        for moved in Move::ALL {
            let (lines, left) = self.shown(moved, all);
            if lines.is_empty() {
                continue;
            }
            let n = lines.len() + left;
            let open = if moved <= Move::Beyond { " open" } else { "" };
            out += &format!(
                "\n<details{open}><summary>{n} {}</summary>\n\n| what | change | cause |\n|---|---|---|\n",
                moved.says()
            );
            for line in lines {
                out += &format!(
                    "| {} | {} | {} |\n",
                    cell(&line.name()),
                    cell(&line.change()),
                    cell(&line.causes.join("; "))
                );
            }
            if left > 0 {
                out += &format!("\nand {left} more\n");
            }
            out += "\n</details>\n";
        }
        out
    }

    fn html(&self) -> String {
        let mut out = String::from(
            "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
             <title>What moved between two lakes</title>\n<style>:root{color-scheme:light dark}body{font:1rem/1.5 system-ui,sans-serif;\
             max-width:70rem;margin:2rem auto;padding:0 1rem}table{border-collapse:collapse;width:100%}th,td{text-align:left;\
             vertical-align:top;padding:.3rem .6rem;border-bottom:1px solid color-mix(in srgb,currentColor 25%,transparent);\
             overflow-wrap:anywhere}</style>\n<h1>What moved between two lakes</h1>\n<ul>\n",
        );
        for line in self.summary().iter().chain(&self.remarks) {
            out += &format!("<li>{}</li>\n", escaped(line));
        }
        out += "</ul>\n";
        for moved in Move::ALL {
            let (lines, _) = self.shown(moved, true);
            if lines.is_empty() {
                continue;
            }
            out += &format!(
                "<h2>{} {}</h2>\n<table><thead><tr><th scope=\"col\">what</th><th scope=\"col\">change</th>\
                 <th scope=\"col\">cause</th></tr></thead><tbody>\n",
                lines.len(),
                moved.says()
            );
            for line in lines {
                out += &format!(
                    "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td></tr>\n",
                    escaped(&line.name()),
                    escaped(&line.change()),
                    escaped(&line.causes.join("; "))
                );
            }
            out += "</tbody></table>\n";
        }
        out + "</html>\n"
    }

    fn json(&self) -> String {
        let side = |side: &Option<Side>| {
            side.as_ref().map_or(Json::Null, |side| {
                json!({
                    "value": side.value.map(number),
                    "interval": side.interval.map(|ends| ends.map(number)),
                    "verdict": (!side.verdict.is_empty()).then_some(&side.verdict),
                })
            })
        };
        let changes: Vec<Json> = self
            .lines
            .iter()
            .map(|line| {
                let names: BTreeMap<_, _> = line.compared.names.iter().zip(&line.names).collect();
                json!({
                    "table": line.compared.table,
                    "of": names,
                    "change": line.moved.name(),
                    "first": side(&line.old),
                    "second": side(&line.new),
                    "causes": line.causes,
                })
            })
            .collect();
        let value = json!({
            "moved_beyond": self.moved_beyond(),
            "unchanged": self.unchanged,
            "remarks": self.remarks,
            "changes": changes,
        });
        format!("{value:#}\n")
    }
}

/// A number; JSON has no infinity, so that is a text.
fn number(x: f64) -> Json {
    if x.is_finite() {
        x.into()
    } else {
        x.to_string().into()
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

impl Line {
    fn name(&self) -> String {
        let names: Vec<&str> = self
            .names
            .iter()
            .map(String::as_str)
            .filter(|name| !name.is_empty() && *name != "as-written")
            .collect();
        format!("{} {}", self.compared.one, names.join(" / "))
    }

    fn change(&self) -> String {
        match (&self.old, &self.new) {
            (Some(old), Some(new)) if old.verdict != new.verdict => {
                let numbers = if old.value == new.value {
                    String::new()
                } else {
                    format!(" ({} -> {})", shown(old.value), shown(new.value))
                };
                format!("{} -> {}{numbers}", old.verdict, new.verdict)
            }
            (Some(old), Some(new)) if old.value == new.value => format!(
                "{}, interval {} -> {}",
                shown(old.value),
                ends(old.interval),
                ends(new.interval)
            ),
            (Some(old), Some(new)) => {
                let relative = match (old.value, new.value) {
                    (Some(a), Some(b)) if a != 0.0 => {
                        format!(" ({:+.2} %)", 100.0 * (b - a) / a.abs())
                    }
                    _ => String::new(),
                };
                let (mut a, mut b) = (shown(old.value), shown(new.value));
                if a == b {
                    // Digits that people do not read moved: all of them are needed.
                    a = old.value.map_or(a, |x| x.to_string());
                    b = new.value.map_or(b, |x| x.to_string());
                }
                let interval = old
                    .interval
                    .map_or(String::new(), |i| format!(", was in {}", ends(Some(i))));
                format!("{a} -> {b}{relative}{interval}")
            }
            (Some(side), None) | (None, Some(side)) => {
                let verdict = if side.verdict.is_empty() {
                    String::new()
                } else {
                    format!(", {}", side.verdict)
                };
                format!("{}{verdict}", shown(side.value))
            }
            (None, None) => String::new(),
        }
    }
}

fn shown(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), four_digits)
}

fn ends(interval: Option<[f64; 2]>) -> String {
    interval.map_or("none".to_owned(), |[lo, hi]| {
        format!("[{}, {}]", four_digits(lo), four_digits(hi))
    })
}

#[cfg(test)]
mod tests {
    use super::{Move, Side};

    fn side(value: Option<f64>, interval: Option<[f64; 2]>, verdict: &str) -> Side {
        Side {
            value,
            interval,
            verdict: verdict.to_owned(),
        }
    }

    #[test]
    fn a_number_moves_within_or_beyond_the_first_interval() {
        let old = side(Some(1.0), Some([0.9, 1.1]), "holds");
        let to = |value, verdict| Move::between(&old, &side(value, Some([0.9, 1.1]), verdict));
        assert_eq!(to(Some(1.0), "holds"), None);
        assert_eq!(to(Some(1.1), "holds"), Some(Move::Within));
        assert_eq!(to(Some(1.2), "holds"), Some(Move::Beyond));
        assert_eq!(to(None, "holds"), Some(Move::Beyond));
        assert_eq!(to(Some(1.0), "differs"), Some(Move::Verdict));
        let wider = side(Some(1.0), Some([0.8, 1.1]), "holds");
        assert_eq!(Move::between(&old, &wider), Some(Move::Within));
    }

    #[test]
    fn a_number_without_interval_moves_beyond_by_any_bit() {
        let old = side(Some(1.0), None, "");
        let new = side(Some(1.0 + f64::EPSILON), None, "");
        assert_eq!(Move::between(&old, &new), Some(Move::Beyond));
    }
}
