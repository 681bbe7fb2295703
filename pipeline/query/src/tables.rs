//! The papers' tables: published beside reproduced, with interval, verdict and reason.

use crate::query;
use polars::prelude::{Column, DataFrame, PolarsResult};
use std::path::Path;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::lake::read_manifest;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::judged::{self, Judged, Subject, Tally};
use zonobench_verdicts::papers;
use zonobench_verdicts::verdict::Verdict;

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
pub fn comparisons(lake: &Path, paper: &str) -> Result<Vec<Judged>, Error> {
    let paper = papers::load(&[paper.to_owned()])?;
    let read = |paper| judged::read(lake, paper);
    Ok(paper
        .iter()
        .map(read)
        .collect::<Result<Vec<_>, _>>()?
        .concat())
}

/// What the cells of all papers came to: numbers, parameters and claims apart.
pub fn tallies(lake: &Path) -> Result<Vec<Tally>, Error> {
    let mut all = Vec::new();
    for paper in papers(lake)? {
        all.extend(comparisons(lake, &paper)?);
    }
    Ok(judged::tallies(all.iter()))
}

/// How often each triple of paper, table and column comes, in the order in which they come first.
fn count(keys: [Vec<String>; 3]) -> PolarsResult<Vec<([String; 3], usize)>> {
    let names = ["paper", "table", "column"];
    let height = keys[0].len();
    let columns = names
        .into_iter()
        .zip(&keys)
        .map(|(name, texts)| Column::new(name.into(), texts.as_slice()));
    let frame = DataFrame::new(height, columns.collect())?;
    if frame.height() == 0 {
        return Ok(Vec::new());
    }
    let groups = frame.group_by_stable(names)?;
    let of_group = groups.keys();
    let text = |column: usize, row: usize| -> PolarsResult<String> {
        Ok(of_group[column]
            .str()?
            .get(row)
            .unwrap_or_default()
            .to_owned())
    };
    let sizes = groups.get_groups().iter().map(|group| group.len());
    sizes
        .enumerate()
        .map(|(row, n)| Ok(([text(0, row)?, text(1, row)?, text(2, row)?], n)))
        .collect()
}

/// The matrix of verdicts as text: a line a table, a column a verdict of numbers, of parameters and of claims, and a line
/// of each paper's counts.
pub fn matrix_text(lake: &Path) -> Result<String, Error> {
    let label =
        |(subject, verdict): (Subject, Verdict)| format!("{}: {}", subject.name(), marked(verdict));
    let (mut all, mut lines, mut keys) =
        (Vec::new(), Vec::new(), [Vec::new(), Vec::new(), Vec::new()]);
    for paper in papers(lake)? {
        lines.push((paper.clone(), None));
        for c in comparisons(lake, &paper)? {
            let line = (paper.clone(), Some(c.table.to_string()));
            if !lines.contains(&line) {
                lines.push(line);
            }
            if c.is_as_written() {
                let key = [
                    paper.clone(),
                    c.table.to_string(),
                    label((c.subject, c.verdict)),
                ];
                keys.iter_mut()
                    .zip(key)
                    .for_each(|(column, text)| column.push(text));
            }
            all.push(c);
        }
    }
    let counted = count(keys).map_err(|e| Error::Query {
        message: e.to_string(),
        tables: "comparison".to_owned(),
    })?;
    let columns: Vec<String> = judged::columns(all.iter()).into_iter().map(label).collect();
    let rows = lines.iter().map(|(paper, table)| {
        let of = |column: &String| {
            let here = |([p, t, c], _): &&([String; 3], usize)| {
                p == paper && table.as_ref().is_none_or(|table| table == t) && c == column
            };
            match counted.iter().filter(here).map(|(_, n)| n).sum() {
                0 => "·".to_owned(),
                n => usize::to_string(&n),
            }
        };
        let name = table
            .as_ref()
            .map_or_else(|| paper.clone(), |table| format!("  {table}"));
        std::iter::once(name)
            .chain(columns.iter().map(of))
            .collect()
    });
    let header: Vec<String> = std::iter::once("paper, table".to_owned())
        .chain(columns.iter().cloned())
        .collect();
    Ok(query::aligned(&header, rows))
}

/// Mark and name.
fn marked(verdict: Verdict) -> String {
    format!("{} {verdict}", verdict.mark())
}

/// The width that reasons are wrapped to.
const WIDTH: usize = 110;

/// A table for reading: verdicts counted, a cell's other readings below it, the reasons as numbered notes.
fn readable(paper: &str, title: &str, rows: &[&Judged]) -> String {
    let counts: Vec<String> = judged::counts_by_subject(rows.iter().copied())
        .iter()
        .map(|(subject, counts)| {
            let each: Vec<String> = (counts.iter())
                .map(|(verdict, n)| format!("{n} {}", marked(*verdict)))
                .collect();
            format!("{}: {}", subject.name(), each.join(", "))
        })
        .collect();
    let mut out = format!("\n{paper}: {title}   {}\n\n", counts.join("; "));
    let mut notes: Vec<&str> = Vec::new();
    let mut last = "";
    let levels = |label: &str| label.replace('|', " · ");
    let mut lines = Vec::new();
    for c in rows {
        let mut line = cells(c).split_off(1);
        if c.is_as_written() {
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
            *shown = marked(c.verdict);
            if (c.verdict.is_finding() || !c.verdict.is_success()) && !c.reason.is_empty() {
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

fn cells(c: &Judged) -> Vec<String> {
    vec![
        c.table.to_string(),
        c.row.to_string(),
        c.column.to_string(),
        c.reading.to_string(),
        c.published.to_string(),
        c.reproduced.map(four_digits).unwrap_or_default(),
        c.interval
            .map_or_else(String::new, |(lo, hi)| interval(lo, hi)),
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
            let rows: Vec<&Judged> = all.iter().filter(|c| *c.table == **title).collect();
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

fn latex(paper: &str, title: &str, rows: &[&Judged]) -> String {
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
    use zonobench_verdicts::judged::Subject;
    use zonobench_verdicts::published::Reading;

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
        let cell = |reading: &str| Judged {
            table: "Table I".into(),
            row: "a|b".into(),
            column: "c".into(),
            reading: Reading::of(reading),
            published: "1.0".into(),
            reproduced: Some(2.0),
            interval: None,
            verdict: Verdict::Differs,
            reason: "twice as much".into(),
            subject: Subject::Number,
            asked: None,
        };
        let (written, other) = (cell("as-written"), cell("other"));
        let text = readable("p", "Table I", &[&written, &other]);
        assert!(
            text.contains("p: Table I   numbers: 1 ✗ differs\n"),
            "{text}"
        );
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
