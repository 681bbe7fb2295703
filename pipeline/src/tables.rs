//! The papers' tables: published beside reproduced, with interval, verdict and reason.

use crate::error::Error;
use crate::lake::{paper_table_path, read_manifest};
use crate::query;
use crate::rows::{Comparison, TimingComparison};
use crate::stage::compare::four_digits;
use crate::table;
use polars::prelude::{Expr, IntoLazy, LazyFrame, col, len, lit};
use std::collections::BTreeMap;
use std::path::Path;

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

/// The matrix of verdicts as text: a line a table, with counts.
pub fn matrix_text(lake: &Path) -> Result<String, Error> {
    let mut tables: Vec<((String, String), BTreeMap<String, usize>)> = Vec::new();
    for (paper, table, verdict, cells) in matrix(lake)? {
        let key = (paper, table);
        match tables.iter_mut().find(|(k, _)| *k == key) {
            Some((_, counts)) => *counts.entry(verdict).or_default() += cells,
            None => tables.push((key, BTreeMap::from([(verdict, cells)]))),
        }
    }
    let header = ["paper", "table", "cells", "reproduced", "verdicts"].map(str::to_owned);
    let rows = tables.into_iter().map(|((paper, table), counts)| {
        let all: usize = counts.values().sum();
        let good: usize = counts
            .iter()
            .filter(|(v, _)| !is_finding(v) && *v != "lost_in_source")
            .map(|(_, n)| n)
            .sum();
        let list: Vec<String> = counts.iter().map(|(v, n)| format!("{n} {v}")).collect();
        vec![
            paper,
            table,
            all.to_string(),
            good.to_string(),
            list.join(", "),
        ]
    });
    Ok(query::aligned(&header, rows))
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
            expected: format!("papers: {}", papers.join(", ")),
        });
    }
    let mut out = String::new();
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
                Format::Table => {
                    out += &format!("\n{name}: {title}\n\n");
                    let header: Vec<String> = HEADER[1..].iter().map(|h| (*h).to_owned()).collect();
                    out += &query::aligned(&header, rows.iter().map(|c| cells(c).split_off(1)));
                    for c in rows.iter().filter(|c| is_finding(&c.verdict)) {
                        out +=
                            &format!("  {} | {} ({}): {}\n", c.row, c.column, c.reading, c.reason);
                    }
                }
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
    fn latex_escapes_what_tex_reads() {
        assert_eq!(tex("a_b & 5% <x>"), "a\\_b \\& 5\\% $<$x$>$");
    }
}
