//! Recorded measurements and inputs, from CSV or Parquet.
//!
//! The columns are `k` and one for each component, by the system's names or by numbers (`y1`, `y2`, …
//! or `u1`, …), in any order. k ascends; a k that is left out, or an empty cell (null), means that
//! nothing was measured there. Everything else that a file can hold is refused with its line and column.

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, RecordBatch};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs::File;
use std::path::Path;
use zonobench_lake::Error;
use zonobench_lake::bad_input::{BadInput, listed, nearest};
use zonobench_lake::decoded::until_damaged;

/// The most steps that a recording may span.
pub const MOST_STEPS: usize = 10_000_000;

/// The largest CSV file that is read.
pub const MOST_BYTES: u64 = 1 << 30;

/// What was recorded: for every k from 0 to the last, one value or none for each component.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// `rows[k][i]`; None where component i has no value at k.
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
            return Err(format!(
                "expected values for k = 0 to {}, got k up to {}",
                steps - 1,
                self.last()
            ));
        }
        self.rows[..steps]
            .iter()
            .enumerate()
            .map(|(k, row)| {
                row.iter()
                    .zip(&self.names)
                    .map(|(value, name)| {
                        value.ok_or_else(|| {
                            format!("expected a value of {name} at k = {k}, got none")
                        })
                    })
                    .collect()
            })
            .collect()
    }
}

/// Reads the file at `path`: Parquet if its name ends in `.parquet`, else CSV.
///
/// `names` are the components, `prefix` is what numbered columns start with (`y`, `u`, `w`, `v`).
pub fn read(path: &Path, names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    let parquet = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    if parquet {
        read_parquet(path, names, prefix)
    } else {
        read_csv(path, names, prefix)
    }
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
        let expected = match names
            .iter()
            .zip(&numbered)
            .all(|(name, number)| name == number)
        {
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
                    let hint = nearest(column, known)
                        .map_or(String::new(), |near| format!("; did you mean {near:?}?"));
                    return Err(format!(
                        "column {}: expected the columns {expected}, got {column:?}{hint}",
                        at + 1
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
            return Err(format!(
                "column k: expected a step from 0 to {}, got {k}",
                MOST_STEPS - 1
            ));
        }
        let k = k as usize;
        if next > 0 && k + 1 == next {
            return Err(format!("column k: expected ascending steps, got {k} again"));
        }
        if k < next {
            return Err(format!(
                "column k: expected ascending steps, got {k} after {}",
                next - 1
            ));
        }
        self.rows.resize(k, vec![None; self.n]);
        self.rows.push(row);
        Ok(())
    }
}

fn read_csv(path: &Path, names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    let file = path.display().to_string();
    let unreadable =
        |error: std::io::Error| BadInput::file(&file, format!("expected a CSV file, got: {error}"));
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    if length > MOST_BYTES {
        return Err(BadInput::file(
            &file,
            format!("expected at most {MOST_BYTES} bytes, got {length}"),
        ));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    parse_csv(&file, &bytes, names, prefix)
}

fn parse_csv(
    file: &str,
    bytes: &[u8],
    names: &[&str],
    prefix: &str,
) -> Result<Recording, BadInput> {
    // Spreadsheets put a byte-order mark before UTF-8.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(BadInput::file(
            file,
            "expected a header and at least one row, got an empty file",
        ));
    }
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(bytes);
    let mut columns: Option<(Columns, Vec<String>)> = None;
    let mut rows = Rows {
        rows: Vec::new(),
        n: names.len(),
    };
    let mut record = csv::StringRecord::new();
    loop {
        let line = reader.position().line() as usize;
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => {
                let line = error
                    .position()
                    .map_or(line, |position| position.line() as usize);
                return Err(BadInput::line(
                    file,
                    line,
                    "expected UTF-8 text, got other bytes",
                ));
            }
        }
        let line = record
            .position()
            .map_or(line, |position| position.line() as usize);
        let at_line = |fault: String| BadInput::line(file, line, fault);
        let Some((columns, header)) = &columns else {
            let header: Vec<String> = record.iter().map(str::to_owned).collect();
            columns = Some((
                Columns::find(&header, names, prefix).map_err(at_line)?,
                header,
            ));
            continue;
        };
        if record.len() != header.len() {
            return Err(at_line(format!(
                "expected {} cells, as in the header, got {}",
                header.len(),
                record.len()
            )));
        }
        let k = &record[columns.k];
        let k = k
            .parse::<i64>()
            .map_err(|_| at_line(format!("column k: expected an integer, got {k:?}")))?;
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
        Ok(_) => Err(format!(
            "column {column}: expected a finite number or an empty cell, got {text:?}"
        )),
        Err(_) => Err(format!(
            "column {column}: expected a number or an empty cell, got {text:?}"
        )),
    }
}

fn finish(file: &str, rows: Rows, names: &[&str]) -> Result<Recording, BadInput> {
    if rows.rows.is_empty() {
        return Err(BadInput::file(
            file,
            "expected at least one row below the header, got none",
        ));
    }
    Ok(Recording {
        rows: rows.rows,
        names: names.iter().map(|&name| name.to_owned()).collect(),
    })
}

fn read_parquet(path: &Path, names: &[&str], prefix: &str) -> Result<Recording, BadInput> {
    let file = path.display().to_string();
    let refused = |error: &dyn std::fmt::Display| {
        BadInput::file(&file, format!("expected a Parquet file, got: {error}"))
    };
    let opened = File::open(path).map_err(|error| refused(&error))?;
    if opened.metadata().map_err(|error| refused(&error))?.len() == 0 {
        return Err(BadInput::file(
            &file,
            "expected a Parquet file, got an empty file",
        ));
    }
    let builder =
        ParquetRecordBatchReaderBuilder::try_new(opened).map_err(|error| refused(&error))?;
    let n_rows = builder.metadata().file_metadata().num_rows();
    if n_rows < 0 || n_rows as u64 > MOST_STEPS as u64 {
        return Err(BadInput::file(
            &file,
            format!("expected at most {MOST_STEPS} rows, got {n_rows}"),
        ));
    }
    let header: Vec<String> = builder
        .schema()
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    let columns =
        Columns::find(&header, names, prefix).map_err(|fault| BadInput::file(&file, fault))?;
    let reader = builder
        .with_batch_size(4096)
        .build()
        .map_err(|error| refused(&error))?;
    let mut rows = Rows {
        rows: Vec::new(),
        n: names.len(),
    };
    let mut row_number = 0;
    for batch in until_damaged(reader) {
        let batch = batch.map_err(|error| refused(&error))?;
        for i in 0..batch.num_rows() {
            row_number += 1;
            let at_row =
                |fault: String| BadInput::file(&file, format!("row {row_number}: {fault}"));
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
        Err(format!(
            "column {name}: expected a finite number or null, got {value}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{ArrayRef, Float64Array, Int64Array, StringArray};
    use parquet::arrow::ArrowWriter;
    use std::sync::Arc;

    fn csv(text: &str) -> Result<Recording, BadInput> {
        parse_csv("y.csv", text.as_bytes(), &["d1", "phi1"], "y")
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
        assert_eq!(csv(text).unwrap().rows, expected);
        assert_eq!(
            csv("k, y1, y2\n0, 1, 2\n1, , -3.5\n3, 4e-3,\n")
                .unwrap()
                .rows,
            expected
        );
        assert_eq!(
            csv("\u{feff}phi1,k,d1\r\n2,0,1\r\n-3.5,1,\r\n,3,0.004\r\n")
                .unwrap()
                .rows,
            expected
        );
        assert_eq!(
            csv("# a comment\nk,d1,phi1\n\n0,1,2\n1,,-3.5\n3,4e-3,\n")
                .unwrap()
                .rows,
            expected
        );
        assert_eq!(csv(text).unwrap().last(), 3);
        assert_eq!(csv("k,d1,phi1\n2,1,1\n").unwrap().rows.len(), 3);
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
        let bytes = parse_csv("y.csv", b"k,d1,phi1\n0,\xff,2\n", &["d1", "phi1"], "y").unwrap_err();
        assert_eq!(
            bytes.to_string(),
            "y.csv:2: expected UTF-8 text, got other bytes"
        );
        let missing = measurements(Path::new("/nonexistent/y.csv"), &["y1"]).unwrap_err();
        assert!(
            missing
                .to_string()
                .starts_with("/nonexistent/y.csv: expected a CSV file, got: No such file")
        );
        assert_eq!(missing.exit_code(), 2);
    }

    fn parquet(columns: Vec<(&str, ArrayRef)>) -> Result<Recording, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y.parquet");
        let batch = RecordBatch::try_from_iter_with_nullable(
            columns.into_iter().map(|(name, array)| (name, array, true)),
        )
        .unwrap();
        let mut writer =
            ArrowWriter::try_new(File::create(&path).unwrap(), batch.schema(), None).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        let prefix = format!("{}: ", path.display());
        read(&path, &["y1"], "y").map_err(|fault| fault.to_string().replace(&prefix, ""))
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
            recording.rows,
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
            "row 1: column y1: expected numbers, got Utf8"
        );
        assert_eq!(
            refused(vec![("k", text), ("y1", y(&[None]))]),
            "row 1: column k: expected integers, got Utf8"
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
            read(&path, &["y1"], "y")
                .unwrap_err()
                .to_string()
                .contains("expected a Parquet file, got: ")
        );
        std::fs::write(&path, "").unwrap();
        assert!(
            read(&path, &["y1"], "y")
                .unwrap_err()
                .to_string()
                .ends_with("expected a Parquet file, got an empty file")
        );
    }
}
