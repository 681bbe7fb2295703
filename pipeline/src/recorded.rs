//! Recorded measurements and inputs, from CSV or Parquet.
//!
//! The columns are `k` and one for each component, by the system's names or by numbers (`y1`, `y2`, …
//! or `u1`, …), in any order. k ascends; a k that is left out, or an empty cell (null), means that
//! nothing was measured there. Everything else that a file can hold is refused with its line and column.

use crate::Error;
use crate::bad_input::{BadInput, listed, nearest};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, RecordBatch};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs::File;
use std::path::Path;

/// The most steps that a recording may span.
pub const MOST_STEPS: usize = 10_000_000;

/// The largest CSV file that is read.
pub const MOST_BYTES: u64 = 1 << 30;

/// What was recorded: for every k from 0 to the last, one value or none for each component.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// rows[k][i]; None where component i has no value at k.
    pub rows: Vec<Vec<Option<f64>>>,
    names: Vec<String>,
}

impl Recording {
    /// The last k.
    pub fn last(&self) -> usize {
        self.rows.len() - 1
    }

    /// The first `steps` rows without their options; what is missing is named.
    pub fn complete(&self, steps: usize) -> Result<Vec<Vec<f64>>, String> {
        if self.rows.len() < steps {
            return Err(format!("expected values for k = 0 to {}, got k up to {}", steps - 1, self.last()));
        }
        self.rows[..steps]
            .iter()
            .enumerate()
            .map(|(k, row)| {
                row.iter()
                    .zip(&self.names)
                    .map(|(value, name)| value.ok_or_else(|| format!("expected a value of {name} at k = {k}, got none")))
                    .collect()
            })
            .collect()
    }
}

/// Reads the file at `path`: Parquet if its name ends in `.parquet`, else CSV.
///
/// `names` are the components, `prefix` is what numbered columns start with (`y`, `u`, `w`, `v`).
pub fn read(path: &Path, names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    let parquet = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    if parquet { read_parquet(path, names, prefix) } else { read_csv(path, names, prefix) }
}

/// Measurements for `track`.
pub fn measurements(path: &Path, names: &[&str]) -> Result<Recording, Error> {
    Ok(read(path, names, "y")?)
}

/// Inputs for `track`: one complete row for every k from 0 to `last`.
pub fn inputs(path: &Path, names: &[&str], last: usize) -> Result<Vec<Vec<f64>>, Error> {
    let recording = read(path, names, "u")?;
    let rows = recording.complete(last + 1);
    Ok(rows.map_err(|fault| BadInput::file(path.display().to_string(), fault))?)
}

/// Which column holds k, and which each component.
struct Columns {
    k: usize,
    components: Vec<usize>,
}

impl Columns {
    /// Fails on columns that are missing, there twice, or not known.
    fn find(header: &[String], names: &[&str], prefix: &str) -> Result<Self, String> {
        let numbered: Vec<String> = (1..=names.len()).map(|i| format!("{prefix}{i}")).collect();
        let expected = match names.iter().zip(&numbered).all(|(name, number)| name == number) {
            true => listed(["k"].into_iter().chain(names.iter().copied())),
            false => format!(
                "{} (or {} for the components)",
                listed(["k"].into_iter().chain(names.iter().copied())),
                listed(numbered.iter().map(String::as_str))
            ),
        };
        let mut k = None;
        let mut components: Vec<Option<usize>> = vec![None; names.len()];
        for (at, column) in header.iter().enumerate() {
            let component = names
                .iter()
                .position(|name| name == column)
                .or_else(|| numbered.iter().position(|number| number == column));
            let place = match (column.as_str(), component) {
                (_, Some(i)) => &mut components[i],
                ("k", None) => &mut k,
                _ => {
                    let known = ["k"].into_iter().chain(names.iter().copied());
                    let hint = nearest(column, known).map_or(String::new(), |near| format!("; did you mean {near:?}?"));
                    return Err(format!("column {}: expected the columns {expected}, got {column:?}{hint}", at + 1));
                }
            };
            if place.replace(at).is_some() {
                return Err(format!("column {}: expected every column once, got {column:?} again", at + 1));
            }
        }
        let missing = |name: &str| format!("expected the columns {expected}, got no {name}");
        Ok(Self {
            k: k.ok_or_else(|| missing("k"))?,
            components: components
                .into_iter()
                .zip(names)
                .map(|(at, name)| at.ok_or_else(|| missing(name)))
                .collect::<Result<_, _>>()?,
        })
    }
}

/// The rows as they come in, in ascending k, gaps filled with nothing.
struct Rows {
    rows: Vec<Vec<Option<f64>>>,
    n: usize,
}

impl Rows {
    fn push(&mut self, k: i64, row: Vec<Option<f64>>) -> Result<(), String> {
        let next = self.rows.len();
        if k < 0 || k as u64 >= MOST_STEPS as u64 {
            return Err(format!("column k: expected a step from 0 to {}, got {k}", MOST_STEPS - 1));
        }
        let k = k as usize;
        if next > 0 && k + 1 == next {
            return Err(format!("column k: expected ascending steps, got {k} again"));
        }
        if k < next {
            return Err(format!("column k: expected ascending steps, got {k} after {}", next - 1));
        }
        self.rows.resize(k, vec![None; self.n]);
        self.rows.push(row);
        Ok(())
    }
}

fn read_csv(path: &Path, names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    let file = path.display().to_string();
    let unreadable = |error: std::io::Error| BadInput::file(&file, format!("expected a CSV file, got: {error}"));
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    if length > MOST_BYTES {
        return Err(BadInput::file(&file, format!("expected at most {MOST_BYTES} bytes, got {length}")));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    parse_csv(&file, &bytes, names, prefix)
}

fn parse_csv(file: &str, bytes: &[u8], names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    // Spreadsheets put a byte-order mark before UTF-8.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(BadInput::file(file, "expected a header and at least one row, got an empty file"));
    }
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(bytes);
    let mut columns: Option<(Columns, Vec<String>)> = None;
    let mut rows = Rows { rows: Vec::new(), n: names.len() };
    let mut record = csv::StringRecord::new();
    loop {
        let line = reader.position().line() as usize;
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => {
                let line = error.position().map_or(line, |position| position.line() as usize);
                return Err(BadInput::line(file, line, "expected UTF-8 text, got other bytes"));
            }
        }
        let line = record.position().map_or(line, |position| position.line() as usize);
        let at_line = |fault: String| BadInput::line(file, line, fault);
        let Some((columns, header)) = &columns else {
            let header: Vec<String> = record.iter().map(str::to_owned).collect();
            columns = Some((Columns::find(&header, names, prefix).map_err(at_line)?, header));
            continue;
        };
        if record.len() != header.len() {
            return Err(at_line(format!("expected {} cells, as in the header, got {}", header.len(), record.len())));
        }
        let k = &record[columns.k];
        let k = k.parse::<i64>().map_err(|_| at_line(format!("column k: expected an integer, got {k:?}")))?;
        let row = columns
            .components
            .iter()
            .map(|&at| cell(&header[at], &record[at]))
            .collect::<Result<_, _>>()
            .map_err(at_line)?;
        rows.push(k, row).map_err(at_line)?;
    }
    finish(file, rows, names)
}

fn cell(column: &str, text: &str) -> Result<Option<f64>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(Some(x)),
        Ok(_) => Err(format!("column {column}: expected a finite number or an empty cell, got {text:?}")),
        Err(_) => Err(format!("column {column}: expected a number or an empty cell, got {text:?}")),
    }
}

fn finish(file: &str, rows: Rows, names: &[&str]) -> Result<Recording, BadInput> {
    if rows.rows.is_empty() {
        return Err(BadInput::file(file, "expected at least one row below the header, got none"));
    }
    Ok(Recording { rows: rows.rows, names: names.iter().map(|&name| name.to_owned()).collect() })
}

fn read_parquet(path: &Path, names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    let file = path.display().to_string();
    let refused = |error: &dyn std::fmt::Display| BadInput::file(&file, format!("expected a Parquet file, got: {error}"));
    let opened = File::open(path).map_err(|error| refused(&error))?;
    if opened.metadata().map_err(|error| refused(&error))?.len() == 0 {
        return Err(BadInput::file(&file, "expected a Parquet file, got an empty file"));
    }
    let builder = ParquetRecordBatchReaderBuilder::try_new(opened).map_err(|error| refused(&error))?;
    let n_rows = builder.metadata().file_metadata().num_rows();
    if n_rows < 0 || n_rows as u64 > MOST_STEPS as u64 {
        return Err(BadInput::file(&file, format!("expected at most {MOST_STEPS} rows, got {n_rows}")));
    }
    let header: Vec<String> = builder.schema().fields().iter().map(|field| field.name().clone()).collect();
    let columns = Columns::find(&header, names, prefix).map_err(|fault| BadInput::file(&file, fault))?;
    let reader = builder.with_batch_size(4096).build().map_err(|error| refused(&error))?;
    let mut rows = Rows { rows: Vec::new(), n: names.len() };
    let mut row_number = 0;
    for batch in reader {
        let batch = batch.map_err(|error| refused(&error))?;
        for i in 0..batch.num_rows() {
            row_number += 1;
            let at_row = |fault: String| BadInput::file(&file, format!("row {row_number}: {fault}"));
            let k = integer(&batch, columns.k, i).map_err(at_row)?;
            let row = columns
                .components
                .iter()
                .map(|&at| number(&batch, at, i, &header[at]))
                .collect::<Result<_, _>>()
                .map_err(at_row)?;
            rows.push(k, row).map_err(at_row)?;
        }
    }
    finish(&file, rows, names)
}

fn integer(batch: &RecordBatch, column: usize, i: usize) -> Result<i64, String> {
    let array = batch.column(column);
    if array.is_null(i) {
        return Err("column k: expected an integer, got null".into());
    }
    let value = match array.data_type() {
        DataType::Int64 => Some(array.as_primitive::<Int64Type>().value(i)),
        DataType::Int32 => Some(array.as_primitive::<Int32Type>().value(i).into()),
        DataType::UInt32 => Some(array.as_primitive::<UInt32Type>().value(i).into()),
        DataType::UInt64 => i64::try_from(array.as_primitive::<UInt64Type>().value(i)).ok(),
        other => return Err(format!("column k: expected integers, got {other}")),
    };
    value.ok_or_else(|| "column k: expected a step, got a larger integer".into())
}

fn number(batch: &RecordBatch, column: usize, i: usize, name: &str) -> Result<Option<f64>, String> {
    let array = batch.column(column);
    if array.is_null(i) {
        return Ok(None);
    }
    let value = match array.data_type() {
        DataType::Float64 => array.as_primitive::<Float64Type>().value(i),
        DataType::Float32 => array.as_primitive::<Float32Type>().value(i).into(),
        DataType::Int64 => array.as_primitive::<Int64Type>().value(i) as f64,
        DataType::Int32 => array.as_primitive::<Int32Type>().value(i).into(),
        other => return Err(format!("column {name}: expected numbers, got {other}")),
    };
    if value.is_finite() {
        Ok(Some(value))
    } else {
        Err(format!("column {name}: expected a finite number or null, got {value}"))
    }
}
