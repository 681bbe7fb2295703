//! One hash for the numbers of each table of a lake, and one for all.
//!
//! What is hashed are the values, not the files: booleans, integers, floats and lists of them, column by column in the
//! order of the rows. Texts, compression and versions of libraries have no part in it, so these hashes compare
//! builds, machines and versions of this program. Times (`timings`) are left out.

use crate::decoded::until_damaged;
use crate::error::Error;
use crate::lake::{self, Entry};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type, Int64Type};
use arrow_array::{Array, ArrayRef};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

/// The numbers of one table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbers {
    /// The table, or `all`.
    pub table: String,
    /// Its rows, over all papers and experiments.
    pub rows: u64,
    /// BLAKE3 of the values, its first 32 digits.
    pub hash: String,
}

/// What stands for a value that is missing, and before one that is not.
const ABSENT: &[u8] = &[0];
const PRESENT: &[u8] = &[1];

/// The numbers of every hashed table of `lake` in the order of their names, and of all together.
///
/// Fails where the manifest or a table cannot be read.
pub fn of_lake(lake: &Path) -> Result<Vec<Numbers>, Error> {
    let mut entries = lake::read_manifest(lake)?;
    entries.retain(|entry| entry.rows.is_some());
    entries.sort_by(|a, b| a.path.cmp(&b.path));
    let hashes: Vec<(&Entry, u64, blake3::Hash)> = entries
        .par_iter()
        .map(|entry| of_file(&lake.join(&entry.path)).map(|(rows, hash)| (entry, rows, hash)))
        .collect::<Result<_, _>>()?;
    let mut tables: BTreeMap<&str, (u64, blake3::Hasher)> = BTreeMap::new();
    let mut all = (0, blake3::Hasher::new());
    for (entry, rows, hash) in hashes {
        let table = tables.entry(entry.table.as_str()).or_default();
        for (sum, hasher) in [table, &mut all] {
            *sum += rows;
            hasher.update(entry.path.as_bytes()).update(hash.as_bytes());
        }
    }
    let named = tables.into_iter().chain([("all", all)]);
    let numbers = |(table, (rows, hasher)): (&str, (u64, blake3::Hasher))| Numbers {
        table: table.to_owned(),
        rows,
        hash: hasher.finalize().to_hex()[..32].to_owned(),
    };
    Ok(named.map(numbers).collect())
}

/// A line for each of `numbers`.
pub fn text(numbers: &[Numbers]) -> String {
    let line = |n: &Numbers| format!("{}, {} rows: {}\n", n.table, n.rows, n.hash);
    numbers.iter().map(line).collect()
}

/// The rows of a Parquet file and the hash of its columns that hold numbers.
fn of_file(path: &Path) -> Result<(u64, blake3::Hash), Error> {
    let file = File::open(path).map_err(|e| Error::io("open", path, e))?;
    let reader = ParquetRecordBatchReaderBuilder::try_new(file)
        .and_then(|builder| builder.build())
        .map_err(|e| Error::parquet(path, e))?;
    // A hasher a column: where one batch ends and the next begins leaves no mark.
    let mut columns: BTreeMap<String, blake3::Hasher> = BTreeMap::new();
    let mut rows = 0;
    let mut bytes = Vec::new();
    for batch in until_damaged(reader) {
        let batch = batch.map_err(|e| Error::parquet(path, e))?;
        rows += batch.num_rows() as u64;
        for (field, column) in batch.schema_ref().fields().iter().zip(batch.columns()) {
            bytes.clear();
            if push(column, &mut bytes) {
                let hasher = columns.entry(field.name().clone()).or_default();
                hasher.update(&bytes);
            }
        }
    }
    let mut whole = blake3::Hasher::new();
    for (name, hasher) in columns {
        whole
            .update(name.as_bytes())
            .update(hasher.finalize().as_bytes());
    }
    Ok((rows, whole.finalize()))
}

/// Appends the values of a column, each of them marked as there or not; false where they are no numbers.
fn push(column: &ArrayRef, bytes: &mut Vec<u8>) -> bool {
    fn each<T>(
        values: impl Iterator<Item = Option<T>>,
        bytes: &mut Vec<u8>,
        le: impl Fn(T, &mut Vec<u8>),
    ) {
        for value in values {
            match value {
                None => bytes.extend(ABSENT),
                Some(value) => {
                    bytes.extend(PRESENT);
                    le(value, bytes);
                }
            }
        }
    }
    match column.data_type() {
        DataType::Boolean => each(column.as_boolean().iter(), bytes, |x, b| {
            b.push(u8::from(x))
        }),
        DataType::Int32 => each(column.as_primitive::<Int32Type>().iter(), bytes, |x, b| {
            b.extend(x.to_le_bytes());
        }),
        DataType::Int64 => each(column.as_primitive::<Int64Type>().iter(), bytes, |x, b| {
            b.extend(x.to_le_bytes());
        }),
        DataType::Float64 => each(
            column.as_primitive::<Float64Type>().iter(),
            bytes,
            |x, b| {
                // The sign and the payload of a NaN are the processor's choice.
                let bits = if x.is_nan() { u64::MAX } else { x.to_bits() };
                b.extend(bits.to_le_bytes());
            },
        ),
        DataType::List(inner) if !matches!(inner.data_type(), DataType::Utf8) => {
            each(column.as_list::<i32>().iter(), bytes, |values, b| {
                b.extend((values.len() as u64).to_le_bytes());
                push(&values, b);
            });
        }
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{BooleanArray, Float64Array, Int64Array, ListArray, StringArray};
    use std::sync::Arc;

    fn bytes(column: impl Array + 'static) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        push(&(Arc::new(column) as ArrayRef), &mut bytes).then_some(bytes)
    }

    #[test]
    fn a_column_is_the_sequence_of_its_values_however_it_is_cut() {
        let whole = bytes(Float64Array::from(vec![Some(1.5), None, Some(-0.0)])).unwrap();
        let mut parts = bytes(Float64Array::from(vec![Some(1.5), None])).unwrap();
        parts.extend(bytes(Float64Array::from(vec![-0.0])).unwrap());
        assert_eq!(whole, parts);
        assert_eq!(bytes(StringArray::from(vec!["a"])), None);
    }

    #[test]
    fn what_differs_is_told_apart() {
        let lists = |rows: Vec<Vec<f64>>| {
            let rows = rows
                .into_iter()
                .map(|r| Some(r.into_iter().map(Some).collect::<Vec<_>>()));
            bytes(ListArray::from_iter_primitive::<Float64Type, _, _>(rows)).unwrap()
        };
        assert_ne!(
            lists(vec![vec![1.0], vec![2.0]]),
            lists(vec![vec![1.0, 2.0], vec![]])
        );
        let floats = |x: f64| bytes(Float64Array::from(vec![x])).unwrap();
        assert_ne!(floats(0.0), floats(-0.0));
        assert_ne!(floats(1.0), floats(1.0_f64.next_up()));
        assert_eq!(floats(f64::NAN), floats(-f64::NAN));
        let integers = |x: Option<i64>| bytes(Int64Array::from(vec![x])).unwrap();
        assert_ne!(integers(Some(0)), integers(None));
        let booleans = |x: bool| bytes(BooleanArray::from(vec![x])).unwrap();
        assert_ne!(booleans(true), booleans(false));
    }
}
