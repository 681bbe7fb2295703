//! Answers as text: a table for reading, CSV, JSON. Rows are written as they come.

use crate::sql::answer::{Answer, Value};
use std::io::{self, Write};

/// How a result is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Columns aligned for reading
    Table,
    /// Comma-separated values
    Csv,
    /// One JSON array of objects
    Json,
}

/// Rows that are aligned with each other; those that follow keep the widths, and widen where they must.
const ALIGNED: usize = 10_000;

/// Writes the parts of an answer in one format.
pub(crate) struct Printer<'a> {
    format: Format,
    out: &'a mut dyn Write,
    columns: Vec<String>,
    rows: usize,
    waiting: Vec<Vec<String>>,
    widths: Vec<u16>,
}

impl<'a> Printer<'a> {
    pub(crate) fn new(
        format: Format,
        columns: Vec<String>,
        out: &'a mut dyn Write,
    ) -> io::Result<Self> {
        let mut printer = Self {
            format,
            out,
            columns,
            rows: 0,
            waiting: Vec::new(),
            widths: Vec::new(),
        };
        match format {
            Format::Table => {}
            Format::Csv => {
                let header = printer.columns.clone();
                printer.record(header.iter().map(String::as_bytes))?;
            }
            Format::Json => printer.out.write_all(b"[")?,
        }
        Ok(printer)
    }

    /// Writes the rows of a part.
    pub(crate) fn part(&mut self, part: &Answer) -> io::Result<()> {
        for row in part.rows() {
            match self.format {
                Format::Table => {
                    let texts = row.iter().map(|v| v.text().into_owned()).collect();
                    self.waiting.push(texts);
                    if self.waiting.len() == ALIGNED {
                        self.flush_table()?;
                    }
                }
                Format::Csv => {
                    let texts: Vec<_> = row.iter().map(Value::text).collect();
                    self.record(texts.iter().map(|t| t.as_bytes()))?;
                }
                Format::Json => {
                    let mut text = if self.rows == 0 { "\n  {" } else { ",\n  {" }.to_owned();
                    for (i, (name, value)) in self.columns.iter().zip(&row).enumerate() {
                        let value = serde_json::to_string_pretty(&value.json())?;
                        text += if i == 0 { "\n    " } else { ",\n    " };
                        text += &serde_json::to_string(name)?;
                        text += ": ";
                        text += &value.replace('\n', "\n    ");
                    }
                    text += "\n  }";
                    self.out.write_all(text.as_bytes())?;
                }
            }
            self.rows += 1;
        }
        Ok(())
    }

    /// Writes what ends the text.
    pub(crate) fn end(mut self) -> io::Result<()> {
        match self.format {
            Format::Table => {
                if self.rows == 0 || !self.waiting.is_empty() {
                    self.flush_table()?;
                }
                writeln!(self.out, "{} rows", self.rows)?;
            }
            Format::Csv => {}
            Format::Json if self.rows == 0 => self.out.write_all(b"]\n")?,
            Format::Json => self.out.write_all(b"\n]\n")?,
        }
        self.out.flush()
    }

    fn record<'r>(&mut self, fields: impl Iterator<Item = &'r [u8]>) -> io::Result<()> {
        // A writer of its own for each record: rows go out as they come.
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(fields)?;
        let bytes = writer.into_inner().map_err(|e| e.into_error())?;
        self.out.write_all(&bytes)
    }

    fn flush_table(&mut self) -> io::Result<()> {
        let rows = std::mem::take(&mut self.waiting);
        let header = self.widths.is_empty().then_some(self.columns.as_slice());
        let text = block(header, rows, &mut self.widths);
        self.out.write_all(text.as_bytes())
    }
}

/// Rows below a header, aligned.
pub fn aligned(header: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    block(Some(header), rows.collect(), &mut Vec::new())
}

/// Rows aligned to at least `widths`, which become those of this block.
fn block(header: Option<&[String]>, rows: Vec<Vec<String>>, widths: &mut Vec<u16>) -> String {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    match header {
        Some(header) => table.set_header(header),
        // A line as wide as the blocks before it, which is not shown.
        None => table.set_header(widths.iter().map(|w| "·".repeat((*w).into()))),
    };
    for row in rows {
        table.add_row(row);
    }
    *widths = table.column_max_content_widths();
    table
        .lines()
        .skip(usize::from(header.is_none()))
        .map(|line| line.trim_end().to_owned() + "\n")
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_blocks_keep_the_columns_of_the_first() {
        let rows = |cells: [&str; 2]| vec![cells.map(str::to_owned).to_vec()];
        let mut widths = Vec::new();
        let header = ["a".to_owned(), "b".to_owned()];
        let first = block(Some(&header), rows(["long text", "x"]), &mut widths);
        let second = block(None, rows(["t", "y"]), &mut widths);
        let place = |text: &str, of: &str| text.lines().last().unwrap().rfind(of);
        assert_eq!(place(&first, "x"), place(&second, "y"), "{first}{second}");
    }
}
