//! Recorded measurements and inputs, from CSV or Parquet.
//!
//! The columns are `k` and one for each component, by the system's names or by numbers (`y1`, `y2`, …
//! or `u1`, …), in any order. k ascends; a k that is left out, or an empty cell (null), means that
//! nothing was measured there. Everything else that a file can hold is refused with its line and column.
//!
//! A file is read as it comes, from a pipe as well: what is held in memory follows its rows, and its limits
//! hold for what was read, not for what the file system says.

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Decimal32Type, Decimal64Type, Decimal128Type, Decimal256Type, Float16Type, Float32Type,
    Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{Array, RecordBatch};
use arrow_schema::{DataType, Schema};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::errors::ParquetError;
use parquet::file::metadata::FileMetaData;
use std::borrow::Cow;
use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;
use zonobench_lake::Error;
use zonobench_lake::bad_input::{BadInput, listed, nearest, shown};
use zonobench_lake::decoded::{unless_damaged, until_damaged};

/// The most steps that a recording may span.
pub const MOST_STEPS: usize = 10_000_000;

/// The most bytes that are read of a CSV file, or of Parquet that comes through a pipe.
pub const MOST_BYTES: u64 = 1 << 30;

/// The most bytes of a line of CSV.
const LONGEST_LINE: usize = 1 << 20;

/// How many steps in a row may have no row, unless more are asked for: each of them is a prediction.
pub const LONGEST_GAP: usize = 100_000;

/// What was recorded: at some steps a value or none for each component.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    names: Vec<String>,
    /// The k that have a row, ascending.
    steps: Vec<usize>,
    /// The rows one after the other; None where a component has no value.
    values: Vec<Option<f64>>,
}

impl Recording {
    /// The last k that has a row.
    pub fn last(&self) -> usize {
        *self.steps.last().expect("a recording has a row")
    }

    /// The row of step k; None where it has none.
    pub fn row(&self, k: usize) -> Option<&[Option<f64>]> {
        let at = self.steps.binary_search(&k).ok()?;
        let n = self.names.len();
        Some(&self.values[at * n..(at + 1) * n])
    }

    /// The values of the first `steps` steps; what is missing is named.
    pub fn complete(&self, steps: usize) -> Result<Vec<Vec<f64>>, String> {
        if self.last() + 1 < steps {
            return Err(format!(
                "expected values for k = 0 to {}, got k up to {}",
                steps - 1,
                self.last()
            ));
        }
        let value = |k: usize, i: usize| {
            let value = self.row(k).and_then(|row| row[i]);
            value.ok_or_else(|| {
                let name = &self.names[i];
                format!("expected a value of {name} at k = {k}, got none")
            })
        };
        (0..steps)
            .map(|k| (0..self.names.len()).map(|i| value(k, i)).collect())
            .collect()
    }
}

/// Reads the file at `path`: Parquet if its name ends in `.parquet` or its content begins as such, else CSV.
///
/// `names` are the components, `prefix` is what numbered columns start with (`y`, `u`, `w`, `v`); at most
/// `longest_gap` steps in a row may have no row.
pub fn read(
    path: &Path,
    names: &[&str],
    prefix: &str,
    longest_gap: usize,
) -> Result<Recording, BadInput> {
    let file = path.display().to_string();
    let parquet = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    let expected = if parquet { "Parquet" } else { "CSV" };
    let unreadable = |error: std::io::Error| {
        BadInput::file(&file, format!("expected a {expected} file, got: {error}"))
    };
    let mut opened = File::open(path).map_err(unreadable)?;
    let mut head = Vec::new();
    opened
        .by_ref()
        .take(PARQUET.len() as u64)
        .read_to_end(&mut head)
        .map_err(unreadable)?;
    let rows = Rows::new(names, longest_gap);
    if head == PARQUET {
        let opened = seekable(opened, &head)
            .map_err(unreadable)?
            .ok_or_else(|| BadInput::file(&file, too_large(MOST_BYTES)))?;
        read_parquet(&file, opened, rows, prefix)
    } else if parquet {
        let got = match head.is_empty() {
            true => "an empty file".to_owned(),
            false => format!(
                "a file that begins with {}, not with \"PAR1\"",
                shown(&String::from_utf8_lossy(&head))
            ),
        };
        let fault = format!("expected a Parquet file, got {got}");
        Err(BadInput::file(&file, fault))
    } else {
        parse_csv(
            &file,
            Cursor::new(head).chain(opened),
            MOST_BYTES,
            rows,
            prefix,
        )
    }
}

/// What a Parquet file begins with.
const PARQUET: &[u8] = b"PAR1";

fn too_large(most: u64) -> String {
    format!("expected at most {most} bytes, got more")
}

/// `file` where it can be read from any place; a copy of it where it is a pipe, of which `head` was read, and
/// None where that is too long.
fn seekable(mut file: File, head: &[u8]) -> std::io::Result<Option<File>> {
    if file.metadata()?.is_file() {
        file.rewind()?;
        return Ok(Some(file));
    }
    let mut copy = tempfile::tempfile()?;
    let length = std::io::copy(&mut head.chain(file).take(MOST_BYTES + 1), &mut copy)?;
    copy.rewind()?;
    Ok((length <= MOST_BYTES).then_some(copy))
}

/// Measurements for `track`.
pub fn measurements(path: &Path, names: &[&str], longest_gap: usize) -> Result<Recording, Error> {
    Ok(read(path, names, "y", longest_gap)?)
}

/// Inputs for `track`.
pub fn inputs(path: &Path, names: &[&str]) -> Result<Recording, Error> {
    Ok(read(path, names, "u", MOST_STEPS)?)
}

/// One row of inputs for every k from 0 to `last`; what is missing is named.
///
/// Where the measurement does not hold the input (`held` is false), u of the last k is read by nothing: it is
/// zeros where the file has none.
pub fn inputs_to(recording: &Recording, last: usize, held: bool) -> Result<Vec<Vec<f64>>, String> {
    let mut rows = recording.complete(last + usize::from(held))?;
    if !held {
        let missing = vec![None; recording.names.len()];
        let row = recording.row(last).unwrap_or(&missing);
        rows.push(row.iter().map(|u| u.unwrap_or(0.0)).collect());
    }
    Ok(rows)
}

/// Which column holds k, and which each component.
struct Columns {
    k: usize,
    components: Vec<usize>,
}

impl Columns {
    /// Fails on columns that are missing, there twice, or not known and not `ignored`.
    fn find(
        header: &[String],
        names: &[String],
        prefix: &str,
        ignored: impl Fn(usize, &str) -> bool,
    ) -> Result<Self, String> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let numbered: Vec<String> = (1..=names.len()).map(|i| format!("{prefix}{i}")).collect();
        let known = || ["k"].into_iter().chain(names.iter().copied());
        let expected = match names
            .iter()
            .zip(&numbered)
            .all(|(name, number)| name == number)
        {
            true => listed(known()),
            false => format!(
                "{} (or {} for the components)",
                listed(known()),
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
                _ if ignored(at, column) => continue,
                _ => {
                    let hint = match nearest(column, known()) {
                        Some(near) => format!("; did you mean {near:?}?"),
                        None if column.contains([';', '\t']) => {
                            "; cells are separated by commas".to_owned()
                        }
                        None => String::new(),
                    };
                    return Err(format!(
                        "column {}: expected the columns {expected}, got {}{hint}",
                        at + 1,
                        shown(column)
                    ));
                }
            };
            if place.replace(at).is_some() {
                return Err(format!(
                    "column {}: expected every column once, got {column:?} again",
                    at + 1
                ));
            }
        }
        let missing = |name: &str| format!("expected the columns {expected}, got no {name}");
        Ok(Self {
            k: k.ok_or_else(|| missing("k"))?,
            components: components
                .into_iter()
                .zip(&names)
                .map(|(at, name)| at.ok_or_else(|| missing(name)))
                .collect::<Result<_, _>>()?,
        })
    }
}

/// The rows as they come in, in ascending k.
struct Rows {
    recording: Recording,
    longest_gap: usize,
}

impl Rows {
    fn new(names: &[&str], longest_gap: usize) -> Self {
        Self {
            recording: Recording {
                names: names.iter().map(|&name| name.to_owned()).collect(),
                steps: Vec::new(),
                values: Vec::new(),
            },
            longest_gap,
        }
    }

    /// Appends the row of step k.
    fn push(
        &mut self,
        k: Number,
        row: impl IntoIterator<Item = Result<Option<f64>, String>>,
    ) -> Result<(), String> {
        let k = k.step()?;
        let before = self.recording.steps.last().copied();
        if before == Some(k) {
            return Err(format!("column k: expected ascending steps, got {k} again"));
        }
        if let Some(before) = before.filter(|&before| k < before) {
            return Err(format!(
                "column k: expected ascending steps, got {k} after {before}"
            ));
        }
        let gap = k - before.map_or(0, |before| before + 1);
        if gap > self.longest_gap {
            let after = before.map_or("before".to_owned(), |before| format!("from {before} to"));
            return Err(format!(
                "column k: expected at most {} steps in a row without a row, got {gap} {after} {k} (each of \
                 them is predicted; --longest-gap {gap} allows it)",
                self.longest_gap
            ));
        }
        self.recording.steps.push(k);
        for value in row {
            self.recording.values.push(value?);
        }
        Ok(())
    }

    fn finish(self, file: &str) -> Result<Recording, BadInput> {
        if self.recording.steps.is_empty() {
            return Err(BadInput::file(
                file,
                "expected at least one row below the header, got none",
            ));
        }
        Ok(self.recording)
    }
}

/// A number as a file holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    Integer(i128),
    Float(f64),
}

impl Number {
    /// The nearest f64.
    fn value(self) -> f64 {
        match self {
            Self::Integer(i) => i as f64,
            Self::Float(x) => x,
        }
    }

    /// As a step: a whole number, be it written as a float.
    fn step(self) -> Result<usize, String> {
        let whole = match self {
            Self::Integer(i) => Some(i),
            Self::Float(x) => (x.trunc() == x).then_some(x as i128),
        };
        let k = whole.ok_or_else(|| format!("column k: expected an integer, got {}", self))?;
        match usize::try_from(k) {
            Ok(k) if k < MOST_STEPS => Ok(k),
            _ => Err(format!(
                "column k: expected a step from 0 to {}, got {self}",
                MOST_STEPS - 1
            )),
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(i) => write!(f, "{i}"),
            Self::Float(x) => write!(f, "{x:?}"),
        }
    }
}

/// The lines of a text, as a person counts them: each ended by LF, CR LF or CR.
struct Lines<R> {
    reader: R,
    line: Vec<u8>,
    number: usize,
    read: u64,
    /// The most bytes that are read.
    most: u64,
    /// The last line ended with CR: an LF that follows belongs to it.
    after_cr: bool,
}

/// What is wrong with a file of lines, and in which line.
type LineFault = (Option<usize>, String);

impl<R: BufRead> Lines<R> {
    fn new(reader: R, most: u64) -> Self {
        Self {
            reader,
            most,
            line: Vec::new(),
            number: 0,
            read: 0,
            after_cr: false,
        }
    }

    /// The next line, without its end, and its number; None after the last one.
    fn next(&mut self) -> Result<Option<(usize, &[u8])>, LineFault> {
        self.line.clear();
        let mut any = false;
        loop {
            let buffer = match self.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => return Err((None, format!("expected a CSV file, got: {error}"))),
            };
            if buffer.is_empty() {
                self.number += usize::from(any);
                return Ok(any.then_some((self.number, &self.line)));
            }
            let skipped = usize::from(self.after_cr && buffer[0] == b'\n');
            self.after_cr = false;
            let rest = &buffer[skipped..];
            let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
            let part = &rest[..end.unwrap_or(rest.len())];
            any |= !rest.is_empty();
            let fits = self.line.len() + part.len() <= LONGEST_LINE;
            if fits {
                self.line.extend_from_slice(part);
            }
            self.after_cr = end.is_some_and(|end| rest[end] == b'\r');
            let used = skipped + part.len() + usize::from(end.is_some());
            self.reader.consume(used);
            self.read += used as u64;
            if !fits {
                let fault = format!(
                    "expected at most {LONGEST_LINE} bytes in a line ({} in the file), got more",
                    self.most
                );
                return Err((Some(self.number + 1), fault));
            }
            if self.read > self.most {
                return Err((None, too_large(self.most)));
            }
            if end.is_some() {
                self.number += 1;
                return Ok(Some((self.number, &self.line)));
            }
        }
    }
}

fn parse_csv(
    file: &str,
    bytes: impl Read,
    most: u64,
    mut rows: Rows,
    prefix: &str,
) -> Result<Recording, BadInput> {
    let mut lines = Lines::new(BufReader::with_capacity(1 << 16, bytes), most);
    let mut columns: Option<(Columns, Vec<String>)> = None;
    loop {
        let next = lines.next().map_err(|(line, fault)| match line {
            Some(line) => BadInput::line(file, line, fault),
            None => BadInput::file(file, fault),
        })?;
        let Some((line, bytes)) = next else { break };
        let at_line = |fault: String| BadInput::line(file, line, fault);
        // Spreadsheets put a byte-order mark before UTF-8.
        let mark: &[u8] = if line == 1 { b"\xef\xbb\xbf" } else { b"" };
        let text = std::str::from_utf8(bytes.strip_prefix(mark).unwrap_or(bytes))
            .map_err(|_| at_line(format!("expected UTF-8 text, got {}", no_text(bytes))))?
            .trim();
        if text.contains('\0') {
            return Err(at_line(format!(
                "expected UTF-8 text, got {}",
                no_text(bytes)
            )));
        }
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let Some((columns, header)) = &columns else {
            let header: Vec<String> = cells(text)
                .map_err(at_line)?
                .into_iter()
                .map(Cow::into_owned)
                .collect();
            // The first column of a table's row names has none itself.
            let ignored = |at, name: &str| at == 0 && name.is_empty();
            let names = &rows.recording.names;
            columns = Some((
                Columns::find(&header, names, prefix, ignored).map_err(at_line)?,
                header,
            ));
            continue;
        };
        let cells = cells(text).map_err(at_line)?;
        if cells.len() != header.len() {
            return Err(at_line(format!(
                "expected {} cells, as in the header, got {}",
                header.len(),
                cells.len()
            )));
        }
        let k = step(&cells[columns.k]).map_err(at_line)?;
        let row = columns.components.iter();
        rows.push(k, row.map(|&at| cell(&header[at], &cells[at])))
            .map_err(at_line)?;
    }
    if columns.is_none() {
        return Err(BadInput::file(
            file,
            "expected a header and at least one row, got an empty file",
        ));
    }
    rows.finish(file)
}

/// What a line that is no text in UTF-8 holds.
fn no_text(line: &[u8]) -> &'static str {
    match line {
        // The marks of UTF-16; without one, every other byte of plain letters is 0.
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "UTF-16",
        [first, 0, ..] | [0, first, ..] if *first != 0 => "UTF-16",
        _ if line.contains(&0) => "bytes that are 0",
        _ => "other bytes",
    }
}

/// The cells of a line, without quotes and the white space around them.
fn cells(line: &str) -> Result<Vec<Cow<'_, str>>, String> {
    if !line.contains('"') {
        return Ok(line.split(',').map(|cell| cell.trim().into()).collect());
    }
    let mut cells = Vec::new();
    let mut rest = line;
    loop {
        let start = rest.trim_start();
        let end = match start.strip_prefix('"') {
            None => {
                let end = start.find(',').unwrap_or(start.len());
                cells.push(start[..end].trim().into());
                &start[end..]
            }
            Some(mut quoted) => {
                let mut text = String::new();
                loop {
                    let Some((before, after)) = quoted.split_once('"') else {
                        let cell = shown(start);
                        return Err(format!("expected a closing quote in this line, got {cell}"));
                    };
                    text += before;
                    quoted = after;
                    // A quote that is doubled stands for itself.
                    match quoted.strip_prefix('"') {
                        Some(after) => (text, quoted) = (text + "\"", after),
                        None => break,
                    }
                }
                cells.push(text.trim().to_owned().into());
                let end = quoted.trim_start();
                if !end.is_empty() && !end.starts_with(',') {
                    let got = shown(end);
                    return Err(format!("expected a comma after a closing quote, got {got}"));
                }
                end
            }
        };
        match end.strip_prefix(',') {
            Some(next) => rest = next,
            None => return Ok(cells),
        }
    }
}

fn step(text: &str) -> Result<Number, String> {
    let integer = text.parse::<i128>().ok().map(Number::Integer);
    let float = || {
        text.parse::<f64>()
            .ok()
            .filter(|x| x.is_finite() && x.trunc() == *x)
    };
    integer
        .or_else(|| float().map(Number::Float))
        .ok_or_else(|| format!("column k: expected an integer, got {}", shown(text)))
}

fn cell(column: &str, text: &str) -> Result<Option<f64>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(Some(x)),
        Ok(_) => Err(format!(
            "column {column}: expected a finite number or an empty cell, got {}",
            shown(text)
        )),
        Err(_) => Err(format!(
            "column {column}: expected a number or an empty cell, got {}",
            shown(text)
        )),
    }
}

fn read_parquet(
    file: &str,
    opened: File,
    mut rows: Rows,
    prefix: &str,
) -> Result<Recording, BadInput> {
    let fault = |fault: String| BadInput::file(file, fault);
    let refused =
        |error: ParquetError| fault(format!("expected a Parquet file, got: {}", plain(error)));
    let builder = unless_damaged(|| ParquetRecordBatchReaderBuilder::try_new(opened));
    let builder = builder.map_err(refused)?;
    let metadata = builder.metadata().file_metadata();
    let n_rows = metadata.num_rows();
    if n_rows < 0 || n_rows as u64 > MOST_STEPS as u64 {
        return Err(fault(format!(
            "expected at most {MOST_STEPS} rows, got {n_rows}"
        )));
    }
    let schema = builder.schema().clone();
    let header: Vec<String> = schema.fields().iter().map(|f| f.name().clone()).collect();
    let index = index_columns(metadata);
    let ignored = |_, name: &str| index.iter().any(|index| index == name) || is_index(name);
    let columns = Columns::find(&header, &rows.recording.names, prefix, ignored).map_err(fault)?;
    check_types(&schema, &columns).map_err(fault)?;
    // Columns that are ignored are not decoded; the others come in the order of the file.
    let mut used: Vec<usize> = columns.components.clone();
    used.push(columns.k);
    used.sort_unstable();
    let place = |column: usize| used.binary_search(&column).expect("it is among them");
    let mask = ProjectionMask::roots(builder.parquet_schema(), used.iter().copied());
    let reader = builder
        .with_projection(mask)
        .with_batch_size(4096)
        .build()
        .map_err(refused)?;
    let mut before = 0;
    for batch in until_damaged(reader) {
        let batch = batch.map_err(refused)?;
        let steps = column(&batch, place(columns.k), "k").map_err(fault)?;
        let values: Vec<(&str, Vec<Option<Number>>)> = columns
            .components
            .iter()
            .map(|&at| Ok((&*header[at], column(&batch, place(at), &header[at])?)))
            .collect::<Result<_, String>>()
            .map_err(fault)?;
        for (i, k) in steps.into_iter().enumerate() {
            let at_row = |what: String| fault(format!("row {}: {what}", before + i + 1));
            let k = k.ok_or_else(|| at_row("column k: expected an integer, got null".into()))?;
            let row = values.iter();
            rows.push(k, row.map(|(name, values)| finite(name, values[i])))
                .map_err(at_row)?;
        }
        before += batch.num_rows();
    }
    rows.finish(file)
}

fn finite(name: &str, value: Option<Number>) -> Result<Option<f64>, String> {
    match value.map(Number::value) {
        Some(x) if !x.is_finite() => Err(format!(
            "column {name}: expected a finite number or null, got {x}"
        )),
        value => Ok(value),
    }
}

/// What a decoder says, without the names of the layers that it went through.
fn plain(error: ParquetError) -> String {
    let text = error.to_string();
    let layers = ["External: ", "Parquet argument error: ", "Parquet error: "];
    let mut rest = text.as_str();
    while let Some(inner) = layers.iter().find_map(|layer| rest.strip_prefix(layer)) {
        rest = inner;
    }
    if rest.contains("encrypt") {
        return "an encrypted one".to_owned();
    }
    rest.to_owned()
}

/// The columns that pandas wrote for the index of a table, by its note in the file.
fn index_columns(metadata: &FileMetaData) -> Vec<String> {
    let notes = metadata.key_value_metadata().into_iter().flatten();
    let note = notes
        .filter(|note| note.key == "pandas")
        .find_map(|note| note.value.as_deref());
    let note = note.and_then(|text| serde_json::from_str::<serde_json::Value>(text).ok());
    let columns = note
        .as_ref()
        .and_then(|note| note["index_columns"].as_array());
    let names = columns
        .into_iter()
        .flatten()
        .filter_map(|name| name.as_str());
    names.map(str::to_owned).collect()
}

/// Whether pandas gives this name to an index that has none.
fn is_index(name: &str) -> bool {
    name.strip_prefix("__index_level_")
        .and_then(|rest| rest.strip_suffix("__"))
        .is_some_and(|level| !level.is_empty() && level.bytes().all(|b| b.is_ascii_digit()))
}

/// Fails where a column that is read does not hold numbers.
fn check_types(schema: &Schema, columns: &Columns) -> Result<(), String> {
    let all = [(columns.k, "integers")].into_iter();
    let mut all = all.chain(columns.components.iter().map(|&at| (at, "numbers")));
    let wrong = all.find(|(at, _)| !is_numeric(schema.field(*at).data_type()));
    match wrong {
        None => Ok(()),
        Some((at, expected)) => {
            let field = schema.field(at);
            let got = type_name(field.data_type());
            let name = field.name();
            Err(format!("column {name}: expected {expected}, got {got}"))
        }
    }
}

fn is_numeric(data_type: &DataType) -> bool {
    match data_type {
        // A column of nulls alone: nothing was measured.
        DataType::Null => true,
        DataType::Dictionary(_, values) => is_numeric(values),
        other => other.is_numeric(),
    }
}

fn type_name(data_type: &DataType) -> String {
    let name = match data_type {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => "text",
        DataType::Boolean => "true and false",
        DataType::Timestamp(..) => "time stamps",
        DataType::Date32 | DataType::Date64 => "dates",
        DataType::Time32(_) | DataType::Time64(_) => "times of day",
        DataType::Duration(_) => "durations",
        DataType::Struct(_) => "structs",
        DataType::Map(..) => "maps",
        DataType::Binary | DataType::LargeBinary | DataType::BinaryView => "bytes",
        DataType::FixedSizeBinary(_) => "bytes",
        DataType::List(_) | DataType::LargeList(_) | DataType::FixedSizeList(..) => "lists",
        DataType::ListView(_) | DataType::LargeListView(_) => "lists",
        DataType::Dictionary(_, values) => return type_name(values),
        other => return other.to_string(),
    };
    name.to_owned()
}

/// The numbers of column `at` of a batch.
fn column(batch: &RecordBatch, at: usize, name: &str) -> Result<Vec<Option<Number>>, String> {
    let array = batch.column(at);
    numbers(array)
        .ok_or_else(|| format!("column {name}: expected numbers, got {}", array.data_type()))
}

/// The numbers of a column of any width; None where it holds something else.
fn numbers(array: &dyn Array) -> Option<Vec<Option<Number>>> {
    macro_rules! each {
        ($type:ty, $number:expr) => {
            array
                .as_primitive::<$type>()
                .iter()
                .map(|x| x.map($number))
                .collect()
        };
    }
    let decimal = |digits: String, scale: i8| {
        // Through text, so that it is the nearest f64.
        let text = format!("{digits}e{}", -i32::from(scale));
        Number::Float(text.parse().expect("digits and an exponent are a number"))
    };
    Some(match array.data_type() {
        DataType::Null => vec![None; array.len()],
        DataType::Int8 => each!(Int8Type, |x| Number::Integer(x.into())),
        DataType::Int16 => each!(Int16Type, |x| Number::Integer(x.into())),
        DataType::Int32 => each!(Int32Type, |x| Number::Integer(x.into())),
        DataType::Int64 => each!(Int64Type, |x| Number::Integer(x.into())),
        DataType::UInt8 => each!(UInt8Type, |x| Number::Integer(x.into())),
        DataType::UInt16 => each!(UInt16Type, |x| Number::Integer(x.into())),
        DataType::UInt32 => each!(UInt32Type, |x| Number::Integer(x.into())),
        DataType::UInt64 => each!(UInt64Type, |x| Number::Integer(x.into())),
        DataType::Float16 => each!(Float16Type, |x| Number::Float(x.to_f64())),
        DataType::Float32 => each!(Float32Type, |x| Number::Float(x.into())),
        DataType::Float64 => each!(Float64Type, Number::Float),
        DataType::Decimal32(_, scale) => each!(Decimal32Type, |x| decimal(x.to_string(), *scale)),
        DataType::Decimal64(_, scale) => each!(Decimal64Type, |x| decimal(x.to_string(), *scale)),
        DataType::Decimal128(_, scale) => {
            each!(Decimal128Type, |x| decimal(x.to_string(), *scale))
        }
        DataType::Decimal256(_, scale) => {
            each!(Decimal256Type, |x| decimal(x.to_string(), *scale))
        }
        DataType::Dictionary(..) => {
            let dictionary = array.as_any_dictionary();
            let values = numbers(dictionary.values())?;
            if values.is_empty() {
                return Some(vec![None; array.len()]);
            }
            let keys = dictionary.normalized_keys().into_iter().enumerate();
            keys.map(|(i, key)| dictionary.keys().is_valid(i).then(|| values[key])?)
                .collect()
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{ArrayRef, Float64Array, Int64Array, StringArray};
    use parquet::arrow::ArrowWriter;
    use std::sync::Arc;

    fn bytes(bytes: &[u8]) -> Result<Recording, BadInput> {
        parse_csv(
            "y.csv",
            bytes,
            MOST_BYTES,
            Rows::new(&["d1", "phi1"], LONGEST_GAP),
            "y",
        )
    }

    fn csv(text: &str) -> Result<Recording, BadInput> {
        bytes(text.as_bytes())
    }

    /// Every step, those without a row as steps without a value.
    fn dense(recording: &Recording) -> Vec<Vec<Option<f64>>> {
        let missing = vec![None; recording.names.len()];
        let rows = (0..=recording.last()).map(|k| recording.row(k).unwrap_or(&missing));
        rows.map(<[_]>::to_vec).collect()
    }

    fn complaint(text: &str) -> String {
        csv(text).unwrap_err().to_string()
    }

    #[test]
    fn gaps_and_empty_cells_are_steps_without_a_measurement() {
        let expected = [
            vec![Some(1.0), Some(2.0)],
            vec![None, Some(-3.5)],
            vec![None, None],
            vec![Some(4e-3), None],
        ];
        let text = "k,d1,phi1\n0,1,2\n1,,-3.5\n3,4e-3,\n";
        assert_eq!(dense(&csv(text).unwrap()), expected);
        assert_eq!(
            dense(&csv("k, y1, y2\n0, 1, 2\n1, , -3.5\n3, 4e-3,\n").unwrap()),
            expected
        );
        assert_eq!(
            dense(&csv("\u{feff}phi1,k,d1\r\n2,0,1\r\n-3.5,1,\r\n,3,0.004\r\n").unwrap()),
            expected
        );
        assert_eq!(
            dense(&csv("# a comment\nk,d1,phi1\n\n0,1,2\n1,,-3.5\n3,4e-3,\n").unwrap()),
            expected
        );
        assert_eq!(csv(text).unwrap().last(), 3);
        assert_eq!(csv("k,d1,phi1\n2,1,1\n").unwrap().last(), 2);
    }

    #[test]
    fn complete_data_are_asked_for_by_name_and_step() {
        let recording = csv("k,d1,phi1\n0,1,2\n1,,3\n").unwrap();
        assert_eq!(recording.complete(1).unwrap(), [[1.0, 2.0]]);
        assert_eq!(
            recording.complete(2).unwrap_err(),
            "expected a value of d1 at k = 1, got none"
        );
        assert_eq!(
            recording.complete(5).unwrap_err(),
            "expected values for k = 0 to 4, got k up to 1"
        );
    }

    #[test]
    fn wrong_columns_are_refused() {
        let expected = "expected the columns k, d1, phi1 (or y1, y2 for the components)";
        assert_eq!(
            complaint("k,d1\n0,1\n"),
            format!("y.csv:1: {expected}, got no phi1")
        );
        assert_eq!(
            complaint("d1,phi1\n0,1\n"),
            format!("y.csv:1: {expected}, got no k")
        );
        assert_eq!(
            complaint("k,d1,phi1,w\n0,1,2,3\n"),
            format!("y.csv:1: column 4: {expected}, got \"w\"")
        );
        assert_eq!(
            complaint("k,d1,phi\n0,1,2\n"),
            format!("y.csv:1: column 3: {expected}, got \"phi\"; did you mean \"phi1\"?")
        );
        assert_eq!(
            complaint("k,d1,y1,phi1\n0,1,2,3\n"),
            "y.csv:1: column 3: expected every column once, got \"y1\" again"
        );
        assert_eq!(
            complaint("k,k,d1,phi1\n0,0,1,2\n"),
            "y.csv:1: column 2: expected every column once, got \"k\" again"
        );
    }

    #[test]
    fn wrong_cells_are_refused_with_their_line_and_column() {
        assert_eq!(
            complaint("k,d1,phi1\n0,1,2\n1,x,2\n"),
            "y.csv:3: column d1: expected a number or an empty cell, got \"x\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,1,NaN\n"),
            "y.csv:2: column phi1: expected a finite number or an empty cell, got \"NaN\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,inf,1\n"),
            "y.csv:2: column d1: expected a finite number or an empty cell, got \"inf\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n0.5,1,1\n"),
            "y.csv:2: column k: expected an integer, got \"0.5\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n,1,1\n"),
            "y.csv:2: column k: expected an integer, got \"\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n-1,1,1\n"),
            "y.csv:2: column k: expected a step from 0 to 9999999, got -1"
        );
        assert_eq!(
            complaint("k,d1,phi1\n99999999,1,1\n"),
            "y.csv:2: column k: expected a step from 0 to 9999999, got 99999999"
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,1\n"),
            "y.csv:2: expected 3 cells, as in the header, got 2"
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,1,2,3\n"),
            "y.csv:2: expected 3 cells, as in the header, got 4"
        );
    }

    #[test]
    fn steps_that_do_not_ascend_are_refused() {
        assert_eq!(
            complaint("k,d1,phi1\n0,1,2\n2,1,2\n1,1,2\n"),
            "y.csv:4: column k: expected ascending steps, got 1 after 2"
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,1,2\n0,1,2\n"),
            "y.csv:3: column k: expected ascending steps, got 0 again"
        );
    }

    #[test]
    fn files_without_data_are_refused() {
        assert_eq!(
            complaint(""),
            "y.csv: expected a header and at least one row, got an empty file"
        );
        assert_eq!(
            complaint(" \n\n"),
            "y.csv: expected a header and at least one row, got an empty file"
        );
        assert_eq!(
            complaint("k,d1,phi1\n"),
            "y.csv: expected at least one row below the header, got none"
        );
        let bytes = bytes(b"k,d1,phi1\n0,\xff,2\n").unwrap_err();
        assert_eq!(
            bytes.to_string(),
            "y.csv:2: expected UTF-8 text, got other bytes"
        );
        let missing = measurements(Path::new("/nonexistent/y.csv"), &["y1"], 0).unwrap_err();
        assert!(
            missing
                .to_string()
                .starts_with("/nonexistent/y.csv: expected a CSV file, got: No such file")
        );
        assert_eq!(missing.exit_code(), 2);
    }

    fn parquet(columns: Vec<(&str, ArrayRef)>) -> Result<Recording, String> {
        parquet_with(columns, Default::default())
    }

    fn parquet_with(
        columns: Vec<(&str, ArrayRef)>,
        properties: parquet::file::properties::WriterProperties,
    ) -> Result<Recording, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y.parquet");
        let batch = RecordBatch::try_from_iter_with_nullable(
            columns.into_iter().map(|(name, array)| (name, array, true)),
        )
        .unwrap();
        let mut writer = ArrowWriter::try_new(
            File::create(&path).unwrap(),
            batch.schema(),
            Some(properties),
        )
        .unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        let prefix = format!("{}: ", path.display());
        read(&path, &["y1"], "y", LONGEST_GAP)
            .map_err(|fault| fault.to_string().replace(&prefix, ""))
    }

    fn k(values: &[i64]) -> ArrayRef {
        Arc::new(Int64Array::from(values.to_vec()))
    }

    fn y(values: &[Option<f64>]) -> ArrayRef {
        Arc::new(Float64Array::from(values.to_vec()))
    }

    #[test]
    fn parquet_is_read_like_csv() {
        let recording = parquet(vec![
            ("y1", y(&[Some(1.5), None, Some(2.5)])),
            ("k", k(&[0, 1, 3])),
        ])
        .unwrap();
        assert_eq!(
            dense(&recording),
            [vec![Some(1.5)], vec![None], vec![None], vec![Some(2.5)]]
        );
        let refused = |columns| parquet(columns).unwrap_err();
        assert_eq!(
            refused(vec![("k", k(&[0]))]),
            "expected the columns k, y1, got no y1"
        );
        assert_eq!(
            refused(vec![
                ("k", k(&[0, 1])),
                ("y1", y(&[Some(1.0), Some(f64::NAN)]))
            ]),
            "row 2: column y1: expected a finite number or null, got NaN"
        );
        assert_eq!(
            refused(vec![("k", k(&[1, 0])), ("y1", y(&[None, None]))]),
            "row 2: column k: expected ascending steps, got 0 after 1"
        );
        let text: ArrayRef = Arc::new(StringArray::from(vec!["a"]));
        assert_eq!(
            refused(vec![("k", k(&[0])), ("y1", text.clone())]),
            "column y1: expected numbers, got text"
        );
        assert_eq!(
            refused(vec![("k", text), ("y1", y(&[None]))]),
            "column k: expected integers, got text"
        );
        assert_eq!(
            refused(vec![("k", k(&[])), ("y1", y(&[]))]),
            "expected at least one row below the header, got none"
        );
    }

    #[test]
    fn a_file_that_is_not_parquet_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y.parquet");
        std::fs::write(&path, "k,y1\n0,1\n").unwrap();
        assert!(
            read(&path, &["y1"], "y", LONGEST_GAP)
                .unwrap_err()
                .to_string()
                .ends_with("expected a Parquet file, got a file that begins with \"k,y1\", not with \"PAR1\"")
        );
        std::fs::write(&path, "").unwrap();
        assert!(
            read(&path, &["y1"], "y", LONGEST_GAP)
                .unwrap_err()
                .to_string()
                .ends_with("got an empty file")
        );
    }

    #[test]
    fn a_fault_is_in_the_line_that_a_person_counts() {
        let head = "y.csv:";
        for (text, line) in [
            ("k,d1,phi1\n0,1,2\n1,x,2\n", 3),
            ("k,d1,phi1\r\n0,1,2\r\n1,x,2\r\n", 3),
            ("k,d1,phi1\r0,1,2\r1,x,2", 3),
            ("\r\r\n\n\rk,d1,phi1\n0,1,2\r\n\r\n1,x,2\n", 8),
            ("# a\r# b\rk,d1,phi1\r\r1,x,2\r", 5),
            ("\u{feff}# a\r\nk,d1,phi1\r\n  # b\r\n \t\r\n1,x,2\r\n", 5),
            ("k,d1,phi1\n\"0\",\"1\",2\n\n1,\"x\",2\n", 4),
            ("\"k\",\"d1\",\"phi1\"\n0,1,2\n1,\"2,\n3,4,5\n", 3),
        ] {
            let said = complaint(text);
            assert!(
                said.starts_with(&format!("{head}{line}: ")),
                "{text:?}: {said}"
            );
        }
        let other = bytes(b"# a\r\nk,d1,phi1\r\n\r\n0,\xe9,1\r\n").unwrap_err();
        assert_eq!(
            other.to_string(),
            "y.csv:4: expected UTF-8 text, got other bytes"
        );
        // A line end that two reads tear apart is one.
        for size in 1..12 {
            let text: &[u8] = b"k,d1\r\n0,1\r\n\r\n1,x\r";
            let mut lines = Lines::new(BufReader::with_capacity(size, text), MOST_BYTES);
            let mut found = Vec::new();
            while let Some((line, text)) = lines.next().unwrap() {
                found.push((line, String::from_utf8(text.to_vec()).unwrap()));
            }
            let expected = [(1, "k,d1"), (2, "0,1"), (3, ""), (4, "1,x")];
            assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
        }
    }

    #[test]
    fn quotes_row_names_and_whole_floats_are_what_other_tools_write() {
        let expected = csv("k,d1,phi1\n0,1,2\n1,,3\n").unwrap();
        let written = "\"\",\"k\",\"d1\",\"phi1\"\n\"1\",0.0,1, \"2\" \n\"2\",1.0,\"\",3\n";
        assert_eq!(csv(written).unwrap(), expected);
        assert_eq!(
            complaint("k,d1,phi1\n0,\"1,2\n1,2,3\n"),
            "y.csv:2: expected a closing quote in this line, got \"\\\"1,2\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,\"1\"2,3\n"),
            "y.csv:2: expected a comma after a closing quote, got \"2,3\""
        );
        assert_eq!(
            complaint("k,d1,phi1\n0,\"a\"\"b\",3\n"),
            "y.csv:2: column d1: expected a number or an empty cell, got \"a\\\"b\""
        );
        assert_eq!(
            complaint("k;d1;phi1\n0;1;2\n"),
            "y.csv:1: column 1: expected the columns k, d1, phi1 (or y1, y2 for the components), \
             got \"k;d1;phi1\"; cells are separated by commas"
        );
    }

    #[test]
    fn what_is_no_text_in_utf_8_is_called_what_it_is() {
        let wide = |mark: &[u8], text: &str| {
            let units = text.encode_utf16().flat_map(u16::to_le_bytes);
            let all: Vec<u8> = mark.iter().copied().chain(units).collect();
            bytes(&all).unwrap_err().to_string()
        };
        let text = "k,d1,phi1\n0,1,2\n";
        let utf_16 = "y.csv:1: expected UTF-8 text, got UTF-16";
        assert_eq!(wide(b"\xff\xfe", text), utf_16);
        assert_eq!(wide(b"", text), utf_16);
        let said = |line: &[u8]| {
            let all = [b"k,d1,phi1\n".as_slice(), line, b"\n"].concat();
            bytes(&all).unwrap_err().to_string()
        };
        let at_2 = |got: &str| format!("y.csv:2: expected UTF-8 text, got {got}");
        assert_eq!(said(b"0,1\0,2"), at_2("bytes that are 0"));
        assert_eq!(said(b"0,1,2 \xb5m"), at_2("other bytes"));
    }

    #[test]
    fn a_long_value_is_not_repeated_and_a_longer_line_is_not_read() {
        let digits = "1".repeat(500_000);
        for text in [
            format!("k,d1,phi1\n0,{digits},1\n"),
            format!("k,d1,phi1\n{digits},1,1\n"),
            format!("k,d1,{digits}\n"),
            format!("k,d1,phi1\n0,\"{digits}\n"),
        ] {
            let said = complaint(&text);
            assert!(said.len() < 300 && said.contains("50000"), "{said}");
        }
        let said = complaint(&format!("k,d1,phi1\n0,{},1\n", digits.repeat(4)));
        assert_eq!(
            said,
            "y.csv:2: expected at most 1048576 bytes in a line (1073741824 in the file), got more"
        );
    }

    #[test]
    fn what_has_no_end_is_refused_at_the_limit() {
        let rows = Rows::new(&["d1"], LONGEST_GAP);
        /// The same text for ever.
        struct Endless(Vec<u8>);
        impl Read for Endless {
            fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
                let chunks = into.chunks_exact_mut(self.0.len());
                let n = chunks.map(|chunk| chunk.copy_from_slice(&self.0)).count();
                Ok(n * self.0.len())
            }
        }
        let fault =
            parse_csv("-", Endless(b"# nothing\n".to_vec()), 1 << 20, rows, "y").unwrap_err();
        assert_eq!(
            fault.to_string(),
            "-: expected at most 1048576 bytes, got more"
        );
    }

    #[test]
    fn a_long_gap_is_refused_unless_it_is_asked_for() {
        let text = "k,d1,phi1\n0,1,2\n100002,1,2\n";
        assert_eq!(
            complaint(text),
            "y.csv:3: column k: expected at most 100000 steps in a row without a row, got 100001 from 0 to \
             100002 (each of them is predicted; --longest-gap 100001 allows it)"
        );
        let rows = Rows::new(&["d1", "phi1"], 100_001);
        let recording = parse_csv("y.csv", text.as_bytes(), MOST_BYTES, rows, "y").unwrap();
        assert_eq!((recording.last(), recording.steps.len()), (100_002, 2));
        assert_eq!(recording.row(5), None);
        assert_eq!(recording.row(100_002), Some(&[Some(1.0), Some(2.0)][..]));
        assert!(csv("k,d1,phi1\n100000,1,2\n").is_ok());
        assert!(complaint("k,d1,phi1\n100001,1,2\n").contains("got 100001 before 100001"));
    }

    #[test]
    fn the_last_input_may_be_missing_where_nothing_reads_it() {
        let recording = csv("k,d1,phi1\n0,1,2\n1,3,4\n2,,5\n").unwrap();
        let rows = |last, held| inputs_to(&recording, last, held);
        let said = |last, held| rows(last, held).unwrap_err();
        assert_eq!(rows(1, true).unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
        assert_eq!(rows(2, false).unwrap()[2], [0.0, 5.0]);
        assert_eq!(said(2, true), "expected a value of d1 at k = 2, got none");
        assert_eq!(said(3, false), "expected a value of d1 at k = 2, got none");
        assert_eq!(
            said(4, false),
            "expected values for k = 0 to 3, got k up to 2"
        );
        let short = csv("k,d1,phi1\n0,1,2\n1,3,4\n").unwrap();
        let rows = inputs_to(&short, 2, false).unwrap();
        assert_eq!(rows, [[1.0, 2.0], [3.0, 4.0], [0.0, 0.0]]);
    }

    #[test]
    fn every_codec_is_read() {
        use parquet::basic::{BrotliLevel, Compression, GzipLevel, ZstdLevel};
        use parquet::file::properties::WriterProperties;
        let columns = || {
            vec![
                ("k", k(&[0, 1, 3])),
                ("y1", y(&[Some(1.5), None, Some(2.5)])),
            ]
        };
        let expected = parquet(columns()).unwrap();
        for codec in [
            Compression::UNCOMPRESSED,
            Compression::SNAPPY,
            Compression::GZIP(GzipLevel::default()),
            Compression::LZ4,
            Compression::LZ4_RAW,
            Compression::BROTLI(BrotliLevel::default()),
            Compression::ZSTD(ZstdLevel::default()),
        ] {
            let properties = WriterProperties::builder().set_compression(codec).build();
            let read = parquet_with(columns(), properties);
            assert_eq!(read.as_ref(), Ok(&expected), "{codec}");
        }
    }

    #[test]
    fn numbers_of_every_width_are_numbers() {
        use arrow_array::*;
        let expected = [vec![Some(2.0)], vec![None], vec![Some(3.0)]];
        macro_rules! array {
            ($type:ident, $($x:expr),*) => {
                Arc::new($type::from(vec![$($x),*])) as ArrayRef
            };
        }
        let decimals = |x: Vec<Option<i128>>| {
            Arc::new(
                Decimal128Array::from(x)
                    .with_precision_and_scale(20, 3)
                    .unwrap(),
            )
        };
        let keys = Int8Array::from(vec![Some(1), None, Some(0)]);
        let values: ArrayRef = Arc::new(Float64Array::from(vec![3.0, 2.0]));
        let ys: Vec<ArrayRef> = vec![
            array!(Int8Array, Some(2), None, Some(3)),
            array!(Int16Array, Some(2), None, Some(3)),
            array!(Int32Array, Some(2), None, Some(3)),
            array!(Int64Array, Some(2), None, Some(3)),
            array!(UInt8Array, Some(2), None, Some(3)),
            array!(UInt16Array, Some(2), None, Some(3)),
            array!(UInt32Array, Some(2), None, Some(3)),
            array!(UInt64Array, Some(2), None, Some(3)),
            array!(Float32Array, Some(2.0), None, Some(3.0)),
            // Half precision by its bits: 2 and 3.
            Arc::new(
                [Some(0x4000_u16), None, Some(0x4200)]
                    .into_iter()
                    .map(|bits| bits.map(<Float16Type as ArrowPrimitiveType>::Native::from_bits))
                    .collect::<Float16Array>(),
            ),
            decimals(vec![Some(2000), None, Some(3000)]),
            Arc::new(DictionaryArray::new(keys, values)),
        ];
        for y in ys {
            let kind = y.data_type().clone();
            let read = parquet(vec![("k", k(&[0, 1, 2])), ("y1", y)]).unwrap();
            assert_eq!(dense(&read), expected, "{kind}");
        }
        // A decimal is the nearest f64, as the text would be.
        let tenths = decimals(vec![Some(100), Some(-1), Some(12_345_678_901_234_567_891)]);
        let read = parquet(vec![("k", k(&[0, 1, 2])), ("y1", tenths)]).unwrap();
        let expected = [0.1, -0.001, 12_345_678_901_234_567.891].map(|x| vec![Some(x)]);
        assert_eq!(dense(&read), expected);
        let none: ArrayRef = Arc::new(NullArray::new(2));
        let read = parquet(vec![("k", k(&[0, 1])), ("y1", none.clone())]).unwrap();
        assert_eq!(
            dense(&read),
            [[None], [None]],
            "a column of nulls was never measured"
        );
        let ks: Vec<ArrayRef> = vec![
            array!(Int8Array, 0, 1),
            array!(UInt16Array, 0, 1),
            array!(UInt64Array, 0, 1),
            array!(Float64Array, 0.0, 1.0),
            decimals(vec![Some(0), Some(1000)]),
        ];
        for ks in ks {
            let kind = ks.data_type().clone();
            let read = parquet(vec![("k", ks), ("y1", y(&[Some(1.0), Some(2.0)]))]);
            assert_eq!(read.unwrap().steps, [0, 1], "{kind}");
        }
        let refused = |ks: ArrayRef| {
            parquet(vec![("k", ks), ("y1", y(&[Some(1.0), Some(2.0)]))]).unwrap_err()
        };
        assert_eq!(
            refused(array!(Float64Array, 0.0, 0.5)),
            "row 2: column k: expected an integer, got 0.5"
        );
        assert_eq!(
            refused(array!(UInt64Array, 0, u64::MAX)),
            "row 2: column k: expected a step from 0 to 9999999, got 18446744073709551615"
        );
        assert_eq!(
            refused(none),
            "row 1: column k: expected an integer, got null"
        );
        assert_eq!(
            refused(array!(BooleanArray, true, false)),
            "column k: expected integers, got true and false"
        );
        let bytes: [ArrayRef; 2] = [
            Arc::new(BinaryArray::from(vec![&b"1"[..], b"2"])),
            Arc::new(FixedSizeBinaryArray::try_from_iter([b"1", b"2"].into_iter()).unwrap()),
        ];
        for bytes in bytes {
            assert_eq!(refused(bytes), "column k: expected integers, got bytes");
        }
    }

    #[test]
    fn an_encrypted_file_is_called_so() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y.parquet");
        let mut file = std::fs::read("tests/recordings/duckdb.parquet").unwrap();
        let end = file.len();
        file[end - 1] = b'E';
        std::fs::write(&path, file).unwrap();
        let said = read(&path, &["y1"], "y", LONGEST_GAP).unwrap_err();
        let expected = "y.parquet: expected a Parquet file, got: an encrypted one";
        assert!(said.to_string().ends_with(expected), "{said}");
    }

    #[test]
    fn what_other_tools_write_is_read() {
        let folder = Path::new("tests/recordings");
        let y1 = [Some(1.5), Some(2.0), None, None, Some(-0.25)];
        let expected = y1.map(|y| vec![y]);
        let mut read_files = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path
                .extension()
                .is_some_and(|extension| extension == "parquet")
            {
                let recording = read(&path, &["y1"], "y", LONGEST_GAP).unwrap();
                assert_eq!(dense(&recording), expected, "{}", path.display());
                assert_eq!(recording.steps, [0, 1, 2, 4]);
                read_files += 1;
            }
        }
        assert_eq!(read_files, 5);
        // By its content, whatever it is called.
        let copy = tempfile::tempdir().unwrap();
        let path = copy.path().join("recording");
        std::fs::copy(folder.join("duckdb.parquet"), &path).unwrap();
        assert!(read(&path, &["y1"], "y", LONGEST_GAP).is_ok());
        // A column that is neither ours nor an index is refused.
        let columns = vec![("k", k(&[0])), ("y1", y(&[None])), ("index", k(&[0]))];
        assert!(parquet(columns).unwrap_err().contains("got \"index\""));
    }
}
