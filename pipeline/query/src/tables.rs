//! The papers' tables: published beside reproduced, with interval, verdict and reason.

use crate::query;
use polars::prelude::{Expr, IntoLazy, LazyFrame, col, len, lit};
use std::path::Path;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::lake::{paper_table_path, read_manifest};
use zonobench_lake::rows::{Comparison, TimingComparison};
use zonobench_lake::table;
use zonobench_verdicts::verdict;

/// How the tables are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Columns aligned for reading
    Table,
    /// Comma-separated values
    Csv,
    /// A LaTeX tabular for each table
    Latex,
}

/// The papers that the lake holds, in order.
pub fn papers(lake: &Path) -> Result<Vec<String>, Error> {
    let entries = read_manifest(lake)?;
    let mut papers: Vec<String> = entries
        .iter()
        .filter(|e| e.table == "comparison")
        .filter_map(|e| {
            e.path
                .split('/')
                .find_map(|part| part.strip_prefix("paper="))
        })
        .map(str::to_owned)
        .collect();
    papers.sort();
    papers.dedup();
    Ok(papers)
}

/// All comparisons of a paper, in the order of its published numbers.
pub fn comparisons(lake: &Path, paper: &str) -> Result<Vec<Comparison>, Error> {
    table::read(&lake.join(paper_table_path("comparison", paper)))
}

/// The timing comparisons of a paper, if any were made.
pub fn timing_comparisons(lake: &Path, paper: &str) -> Result<Vec<TimingComparison>, Error> {
    let path = lake.join(paper_table_path("timing_comparison", paper));
    if path.exists() {
        table::read(&path)
    } else {
        Ok(Vec::new())
    }
}

/// How many cells have which verdict, by paper and table: (paper, table, verdict, cells).
pub fn matrix(lake: &Path) -> Result<Vec<(String, String, String, usize)>, Error> {
    let Some(frame) = query::table(lake, "comparison")? else {
        return Ok(Vec::new());
    };
    let keys: [Expr; 3] = [col("paper"), col("table"), col("verdict")];
    let counted = frame
        .filter(col("reading").eq(lit("as-written")))
        .group_by_stable(keys)
        .agg([len().alias("cells")])
        .lazy();
    let frame = collect(counted)?;
    let text = |name: &str, row: usize| {
        frame
            .column(name)
            .ok()
            .and_then(|c| c.get(row).ok())
            .map(|v| v.get_str().map_or_else(|| v.to_string(), str::to_owned))
    };
    let mut rows = Vec::new();
    for row in 0..frame.height() {
        let get = |name| text(name, row).unwrap_or_default();
        rows.push((
            get("paper"),
            get("table"),
            get("verdict"),
            get("cells").parse().unwrap_or(0),
        ));
    }
    Ok(rows)
}

fn collect(frame: LazyFrame) -> Result<polars::prelude::DataFrame, Error> {
    frame.collect().map_err(|e| Error::Query {
        message: e.to_string(),
        tables: "comparison".to_owned(),
    })
}

/// The verdicts that a reader should look at first.
pub fn is_finding(verdict: &str) -> bool {
    matches!(
        verdict,
        "differs" | "does_not_hold" | "not_reproducible" | "error"
    )
}

/// The matrix of verdicts as text: a line a table, a column a verdict, and a line of each paper's sums.
pub fn matrix_text(lake: &Path) -> Result<String, Error> {
    let counted = matrix(lake)?;
    let mut verdicts: Vec<&str> = counted.iter().map(|(_, _, v, _)| v.as_str()).collect();
    verdicts.sort_by_key(|v| (verdict::rank(v), *v));
    verdicts.dedup();
    let mut lines: Vec<(&str, &str)> = Vec::new();
    for (paper, table, _, _) in &counted {
        if !lines.iter().any(|(p, _)| p == paper) {
            lines.push((paper, ""));
        }
        if !lines.contains(&(paper, table)) {
            lines.push((paper, table));
        }
    }
    let rows = lines.iter().map(|(paper, table)| {
        let of = |wanted: Option<&str>| -> usize {
            counted
                .iter()
                .filter(|(p, t, v, _)| {
                    p == paper && (table.is_empty() || t == table) && wanted.is_none_or(|w| w == v)
                })
                .map(|(_, _, _, n)| n)
                .sum()
        };
        let name = if table.is_empty() {
            (*paper).to_owned()
        } else {
            format!("  {table}")
        };
        let each = verdicts.iter().map(|v| match of(Some(v)) {
            0 => "·".to_owned(),
            n => n.to_string(),
        });
        [name, of(None).to_string()]
            .into_iter()
            .chain(each)
            .collect()
    });
    let header: Vec<String> = ["paper, table", "cells"]
        .map(str::to_owned)
        .into_iter()
        .chain(verdicts.iter().map(|v| marked(v)))
        .collect();
    Ok(query::aligned(&header, rows))
}

fn marked(name: &str) -> String {
    format!("{} {name}", verdict::mark(name))
        .trim_start()
        .to_owned()
}

/// The width that reasons are wrapped to.
const WIDTH: usize = 110;

/// A table for reading: verdicts counted, a cell's other readings below it, the reasons as numbered notes.
fn readable(paper: &str, title: &str, rows: &[&Comparison]) -> String {
    let counts: Vec<String> = verdict::counts(rows.iter().copied())
        .iter()
        .map(|(name, n)| format!("{n} {}", marked(name)))
        .collect();
    let mut out = format!("\n{paper}: {title}   {}\n\n", counts.join(", "));
    let mut notes: Vec<&str> = Vec::new();
    let mut last = "";
    let levels = |label: &str| label.replace('|', " · ");
    let mut lines = Vec::new();
    for c in rows {
        let mut line = cells(c).split_off(1);
        if verdict::is_as_written(c) {
            line[0] = if last == &*c.row {
                String::new()
            } else {
                levels(&c.row)
            };
            line[1] = levels(&c.column);
            last = &c.row;
        } else {
            line[0] = String::new();
            line[1] = format!("  ↳ {}", c.reading);
        }
        line.remove(2);
        if let Some(shown) = line.last_mut() {
            *shown = marked(&c.verdict);
            if is_finding(&c.verdict) && !c.reason.is_empty() {
                let found = notes.iter().position(|note| *note == &*c.reason);
                let number = found.unwrap_or_else(|| {
                    notes.push(&c.reason);
                    notes.len() - 1
                });
                *shown += &format!(" [{}]", number + 1);
            }
        }
        lines.push(line);
    }
    let header: Vec<String> = HEADER[1..]
        .iter()
        .filter(|name| **name != "reading")
        .map(|name| (*name).to_owned())
        .collect();
    out += &query::aligned(&header, lines.into_iter());
    for (i, note) in notes.iter().enumerate() {
        out += &wrapped(&format!("  [{}] ", i + 1), note);
    }
    out
}

/// `text` in lines, the first behind `start`, the others below where it begins.
fn wrapped(start: &str, text: &str) -> String {
    let indent = " ".repeat(start.chars().count());
    let mut out = start.to_owned();
    let mut length = indent.len();
    let mut first = true;
    for word in text.split_whitespace() {
        let n = word.chars().count();
        if !first && length + 1 + n > WIDTH {
            out += &format!("\n{indent}{word}");
            length = indent.len() + n;
        } else {
            if !first {
                out.push(' ');
                length += 1;
            }
            out += word;
            length += n;
        }
        first = false;
    }
    out + "\n"
}

const HEADER: [&str; 8] = [
    "table",
    "row",
    "column",
    "reading",
    "published",
    "reproduced",
    "interval",
    "verdict",
];

fn cells(c: &Comparison) -> Vec<String> {
    let interval = match (c.interval_lo, c.interval_hi) {
        (Some(lo), Some(hi)) => format!("[{}, {}]", four_digits(lo), four_digits(hi)),
        _ => String::new(),
    };
    vec![
        c.table.to_string(),
        c.row.to_string(),
        c.column.to_string(),
        c.reading.to_string(),
        c.published.to_string(),
        c.reproduced.map(four_digits).unwrap_or_default(),
        interval,
        c.verdict.to_string(),
    ]
}

/// The tables of a paper (or one of them) as text.
///
/// Fails where the lake has no such paper or table, naming those there are.
pub fn render(
    lake: &Path,
    paper: Option<&str>,
    wanted: Option<&str>,
    format: Format,
) -> Result<String, Error> {
    let papers = papers(lake)?;
    if let Some(paper) = paper
        && !papers.iter().any(|p| p == paper)
    {
        return Err(Error::Unknown {
            what: "paper in this lake",
            got: paper.to_owned(),
            expected: match &papers[..] {
                [] => "it has no paper; `zonobench reproduce-all` makes them".to_owned(),
                papers => format!("papers: {}", papers.join(", ")),
            },
        });
    }
    let mut out = match (&papers[..], format) {
        ([], Format::Table) => {
            "This lake has no paper; `zonobench reproduce-all` makes them.\n".to_owned()
        }
        _ => String::new(),
    };
    let mut known = Vec::new();
    let mut csv = csv::Writer::from_writer(Vec::new());
    let write = |csv: &mut csv::Writer<Vec<u8>>, fields: &[String]| {
        csv.write_record(fields)
            .expect("writing to memory does not fail");
    };
    if format == Format::Csv {
        let mut header: Vec<String> = vec!["paper".to_owned()];
        header.extend(HEADER.iter().map(|h| (*h).to_owned()));
        header.push("reason".to_owned());
        write(&mut csv, &header);
    }
    for name in papers
        .iter()
        .filter(|p| paper.is_none_or(|wanted| wanted == *p))
    {
        let all = comparisons(lake, name)?;
        let mut tables: Vec<&str> = Vec::new();
        for c in &all {
            if !tables.contains(&&*c.table) {
                tables.push(&c.table);
            }
        }
        known.extend(tables.iter().map(|t| format!("{name} {t:?}")));
        for title in tables
            .iter()
            .filter(|t| wanted.is_none_or(|w| w.eq_ignore_ascii_case(t)))
        {
            let rows: Vec<&Comparison> = all.iter().filter(|c| *c.table == **title).collect();
            match format {
                Format::Csv => {
                    for c in rows {
                        let mut fields = vec![name.clone()];
                        fields.extend(cells(c));
                        fields.push(c.reason.to_string());
                        write(&mut csv, &fields);
                    }
                }
                Format::Table => out += &readable(name, title, &rows),
                Format::Latex => out += &latex(name, title, &rows),
            }
        }
    }
    if format == Format::Csv {
        let bytes = csv.into_inner().expect("writing to memory does not fail");
        out = String::from_utf8(bytes).expect("the fields are UTF-8");
    }
    if let Some(wanted) = wanted
        && !known.iter().any(|k| {
            k.to_lowercase()
                .contains(&format!("{:?}", wanted.to_lowercase()))
        })
    {
        return Err(Error::Unknown {
            what: "table",
            got: wanted.to_owned(),
            expected: format!("tables: {}", known.join(", ")),
        });
    }
    Ok(out)
}

fn latex(paper: &str, title: &str, rows: &[&Comparison]) -> String {
    let mut out = format!("% {paper}: {title}\n\\begin{{tabular}}{{lllrrll}}\n");
    out += &HEADER[1..]
        .iter()
        .map(|h| tex(h))
        .collect::<Vec<_>>()
        .join(" & ");
    out += " \\\\\n\\hline\n";
    for c in rows {
        let fields: Vec<String> = cells(c)[1..].iter().map(|f| tex(f)).collect();
        out += &(fields.join(" & ") + " \\\\\n");
    }
    out + "\\end{tabular}\n\n"
}

fn tex(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                out.push('\\');
                out.push(c);
            }
            '\\' => out += "\\textbackslash{}",
            '^' => out += "\\textasciicircum{}",
            '~' => out += "\\textasciitilde{}",
            '<' => out += "$<$",
            '>' => out += "$>$",
            '|' => out += "$|$",
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_wrapped_below_where_they_begin() {
        assert_eq!(wrapped("  [1] ", "a few words"), "  [1] a few words\n");
        let long = wrapped("  [1] ", &"word ".repeat(40));
        assert!(long.lines().all(|l| l.chars().count() <= WIDTH), "{long}");
        assert!(
            long.lines().skip(1).all(|l| l.starts_with("      word")),
            "{long}"
        );
        assert_eq!(long.matches("word").count(), 40);
    }

    #[test]
    fn a_cell_s_readings_stand_below_it_and_reasons_once() {
        let cell = |reading: &str, verdict: &str| Comparison {
            table: "Table I".into(),
            row: "a|b".into(),
            column: "c".into(),
            reading: reading.into(),
            published: "1.0".into(),
            reproduced: Some(2.0),
            interval_lo: None,
            interval_hi: None,
            rel_diff: None,
            verdict: verdict.into(),
            reason: "twice as much".into(),
        };
        let (written, other) = (cell("as-written", "differs"), cell("other", "differs"));
        let text = readable("p", "Table I", &[&written, &other]);
        assert!(text.contains("p: Table I   1 ✗ differs\n"), "{text}");
        assert!(text.contains(" a · b  c "), "{text}");
        assert!(text.contains("↳ other"), "{text}");
        assert_eq!(text.matches("✗ differs [1]").count(), 2, "{text}");
        assert_eq!(text.matches("twice as much").count(), 1, "{text}");
    }

    #[test]
    fn latex_escapes_what_tex_reads() {
        assert_eq!(tex("a_b & 5% <x>"), "a\\_b \\& 5\\% $<$x$>$");
    }
}
