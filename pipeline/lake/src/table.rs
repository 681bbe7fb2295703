//! Rows to Parquet and back.
//!
//! A table is a Rust struct whose fields are its columns (see [`crate::rows`]). Files are written so
//! that the same rows give the same bytes: fixed writer properties, no writer version, no clock. Every
//! column carries its unit and description in the Arrow field's metadata. NaN is refused: null means
//! "not applicable" and ±∞ "unbounded".

use crate::decoded::until_damaged;
use crate::error::Error;
use arrow_array::builder::{
    BooleanBuilder, Float64Builder, Int32Builder, Int64Builder, ListBuilder, StringBuilder,
};
use arrow_array::cast::AsArray;
use arrow_array::types::{ArrowPrimitiveType, Float64Type, Int32Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::{
    ArrowSchemaConverter, ArrowWriter, ProjectionMask, add_encoded_arrow_schema_to_metadata,
};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, PageIndexPolicy, ParquetMetaDataReader, SortingColumn};
use parquet::file::page_index::column_index::ColumnIndexMetaData;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// A shared string: names repeat in every row.
pub type Name = Arc<str>;

/// The version of the tables' schemas: patch for texts, minor for a new nullable column, major for the rest.
pub const SCHEMA_VERSION: &str = "1.0.1";

const ROW_GROUP: usize = 131_072;

/// One column of a table: its name, its type, what it holds.
#[derive(Clone, Debug)]
pub struct ColumnInfo {
    /// Column name.
    pub name: &'static str,
    /// Arrow type.
    pub data_type: DataType,
    /// True if null is allowed.
    pub nullable: bool,
    /// UCUM unit code; `state` where the unit is the component's own (see `variables`).
    pub unit: &'static str,
    /// What the column holds.
    pub description: &'static str,
}

/// A value that can stand in a column.
pub trait Cell: Sized {
    /// The builder of its column.
    type Builder: Default;
    /// True if null is allowed.
    const NULLABLE: bool;
    /// Arrow type.
    fn data_type() -> DataType;
    /// Appends the value.
    fn append(&self, builder: &mut Self::Builder);
    /// The finished column.
    fn finish(builder: &mut Self::Builder) -> ArrayRef;
    /// Reads a column back; None if it has another type.
    fn read(array: &dyn Array) -> Option<Vec<Self>>;
    /// True if the value is (or holds) NaN.
    fn is_nan(&self) -> bool {
        false
    }
}

macro_rules! cell {
    ($type:ty, $builder:ty, $arrow:expr, $append:expr, $read:expr) => {
        impl Cell for $type {
            type Builder = $builder;
            const NULLABLE: bool = false;
            fn data_type() -> DataType {
                $arrow
            }
            fn append(&self, builder: &mut Self::Builder) {
                builder.append_value($append(self));
            }
            fn finish(builder: &mut Self::Builder) -> ArrayRef {
                Arc::new(builder.finish())
            }
            fn read(array: &dyn Array) -> Option<Vec<Self>> {
                let mut value = $read(array)?;
                Some((0..array.len()).map(|i| value(i)).collect())
            }
        }
        impl Cell for Option<$type> {
            type Builder = $builder;
            const NULLABLE: bool = true;
            fn data_type() -> DataType {
                $arrow
            }
            fn append(&self, builder: &mut Self::Builder) {
                builder.append_option(self.as_ref().map($append));
            }
            fn finish(builder: &mut Self::Builder) -> ArrayRef {
                Arc::new(builder.finish())
            }
            fn read(array: &dyn Array) -> Option<Vec<Self>> {
                let mut value = $read(array)?;
                let at = |i| array.is_valid(i).then(|| value(i));
                Some((0..array.len()).map(at).collect())
            }
        }
    };
}

fn as_text(name: &Name) -> &str {
    name
}

/// The names of a column: those that repeat within a few rows share their text.
fn names(array: &dyn Array) -> Option<impl FnMut(usize) -> Name> {
    let array = array.as_string_opt::<i32>()?;
    let mut recent: Vec<Name> = Vec::new();
    Some(move |i| {
        let text = array.value(i);
        if let Some(name) = recent.iter().find(|name| &***name == text) {
            return name.clone();
        }
        let name = Name::from(text);
        if recent.len() < 16 {
            recent.push(name.clone());
        }
        name
    })
}

fn integers<T: ArrowPrimitiveType>(array: &dyn Array) -> Option<impl FnMut(usize) -> T::Native> {
    let array = array.as_primitive_opt::<T>()?;
    Some(|i| array.value(i))
}

fn booleans(array: &dyn Array) -> Option<impl FnMut(usize) -> bool> {
    let array = array.as_boolean_opt()?;
    Some(|i| array.value(i))
}

cell!(Name, StringBuilder, DataType::Utf8, as_text, names);
cell!(
    i32,
    Int32Builder,
    DataType::Int32,
    |x: &i32| *x,
    integers::<Int32Type>
);
cell!(
    i64,
    Int64Builder,
    DataType::Int64,
    |x: &i64| *x,
    integers::<Int64Type>
);
cell!(
    bool,
    BooleanBuilder,
    DataType::Boolean,
    |x: &bool| *x,
    booleans
);

impl Cell for f64 {
    type Builder = Float64Builder;
    const NULLABLE: bool = false;
    fn data_type() -> DataType {
        DataType::Float64
    }
    fn append(&self, builder: &mut Self::Builder) {
        builder.append_value(*self);
    }
    fn finish(builder: &mut Self::Builder) -> ArrayRef {
        Arc::new(builder.finish())
    }
    fn read(array: &dyn Array) -> Option<Vec<Self>> {
        let array = array.as_primitive_opt::<Float64Type>()?;
        Some(array.values().to_vec())
    }
    fn is_nan(&self) -> bool {
        f64::is_nan(*self)
    }
}

impl Cell for Option<f64> {
    type Builder = Float64Builder;
    const NULLABLE: bool = true;
    fn data_type() -> DataType {
        DataType::Float64
    }
    fn append(&self, builder: &mut Self::Builder) {
        builder.append_option(*self);
    }
    fn finish(builder: &mut Self::Builder) -> ArrayRef {
        Arc::new(builder.finish())
    }
    fn read(array: &dyn Array) -> Option<Vec<Self>> {
        Some(array.as_primitive_opt::<Float64Type>()?.iter().collect())
    }
    fn is_nan(&self) -> bool {
        self.is_some_and(f64::is_nan)
    }
}

impl Cell for Option<Vec<f64>> {
    type Builder = ListBuilder<Float64Builder>;
    const NULLABLE: bool = true;
    fn data_type() -> DataType {
        DataType::List(Arc::new(Field::new("item", DataType::Float64, true)))
    }
    fn append(&self, builder: &mut Self::Builder) {
        match self {
            None => builder.append_null(),
            Some(values) => {
                builder.values().append_slice(values);
                builder.append(true);
            }
        }
    }
    fn finish(builder: &mut Self::Builder) -> ArrayRef {
        Arc::new(builder.finish())
    }
    fn read(array: &dyn Array) -> Option<Vec<Self>> {
        let array = array.as_list_opt::<i32>()?;
        let values = array.values().as_primitive_opt::<Float64Type>()?.values();
        let list = |i: usize| {
            let ends = array.value_offsets();
            array
                .is_valid(i)
                .then(|| values[ends[i] as usize..ends[i + 1] as usize].to_vec())
        };
        Some((0..array.len()).map(list).collect())
    }
    fn is_nan(&self) -> bool {
        self.as_ref().is_some_and(|v| v.iter().any(|x| x.is_nan()))
    }
}

/// A row of a table.
pub trait Row: Sized + Send {
    /// Table name, also its folder in the lake.
    const TABLE: &'static str;
    /// What a row is.
    const DESCRIPTION: &'static str;
    /// How many leading columns the rows are sorted by.
    const SORTED_BY: usize;
    /// The columns, in order.
    fn columns() -> Vec<ColumnInfo>;
    /// The rows as columns; the name of a column that holds NaN is an error.
    fn to_columns(rows: &[Self]) -> Result<Vec<ArrayRef>, &'static str>;
    /// The rows of `columns`; the name of a column of another type is an error.
    fn from_columns(columns: &[ArrayRef]) -> Result<impl Iterator<Item = Self>, &'static str>;
}

/// Declares a table: a struct, its columns' units and descriptions, and both conversions.
macro_rules! table {
    ($(#[doc = $doc:literal])* $name:ident => $table:literal sorted by $sorted:literal
        { $($field:ident : $type:ty, $unit:literal, $text:literal;)* }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name { $(#[doc = $text] pub $field: $type,)* }
        impl $crate::table::Row for $name {
            const TABLE: &'static str = $table;
            const DESCRIPTION: &'static str = concat!($($doc),*);
            const SORTED_BY: usize = $sorted;
            fn columns() -> Vec<$crate::table::ColumnInfo> {
                vec![$($crate::table::ColumnInfo {
                    name: stringify!($field),
                    data_type: <$type as $crate::table::Cell>::data_type(),
                    nullable: <$type as $crate::table::Cell>::NULLABLE,
                    unit: $unit,
                    description: $text,
                },)*]
            }
            fn to_columns(rows: &[Self]) -> Result<Vec<arrow_array::ArrayRef>, &'static str> {
                Ok(vec![$({
                    let mut builder = <$type as $crate::table::Cell>::Builder::default();
                    for row in rows {
                        if $crate::table::Cell::is_nan(&row.$field) {
                            return Err(stringify!($field));
                        }
                        $crate::table::Cell::append(&row.$field, &mut builder);
                    }
                    <$type as $crate::table::Cell>::finish(&mut builder)
                },)*])
            }
            fn from_columns(
                columns: &[arrow_array::ArrayRef],
            ) -> Result<impl Iterator<Item = Self>, &'static str> {
                let mut columns = columns.iter();
                $(let mut $field = {
                    let column = columns.next().ok_or(stringify!($field))?;
                    let cells = <$type as $crate::table::Cell>::read(column);
                    cells.ok_or(stringify!($field))?.into_iter()
                };)*
                Ok(std::iter::from_fn(move || Some(Self { $($field: $field.next()?,)* })))
            }
        }
    };
}
pub(crate) use table;

/// The Arrow schema of a table, with unit and description in every field's metadata.
pub fn schema<R: Row>() -> SchemaRef {
    let fields: Vec<Field> = R::columns()
        .into_iter()
        .map(|c| {
            let metadata = [("unit", c.unit), ("description", c.description)];
            let metadata = metadata.map(|(k, v)| (k.to_owned(), v.to_owned()));
            Field::new(c.name, c.data_type, c.nullable).with_metadata(metadata.into())
        })
        .collect();
    Arc::new(Schema::new(fields))
}

/// Writes a table row batch by row batch; call [`TableWriter::close`] at the end.
pub struct TableWriter<R: Row> {
    writer: ArrowWriter<File>,
    schema: SchemaRef,
    buffer: Vec<R>,
    path: std::path::PathBuf,
    rows: usize,
}

impl<R: Row> TableWriter<R> {
    /// Creates `path`; `metadata` is added to the file's key-values under the prefix `zonobench.`.
    pub fn create(path: &Path, metadata: &BTreeMap<String, String>) -> Result<Self, Error> {
        let schema = schema::<R>();
        let file = File::create(path).map_err(|e| Error::io("create", path, e))?;
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties::<R>(metadata)))
            .map_err(|e| Error::parquet(path, e))?;
        Ok(Self {
            writer,
            schema,
            buffer: Vec::new(),
            path: path.to_owned(),
            rows: 0,
        })
    }

    /// Appends rows.
    pub fn push(&mut self, rows: impl IntoIterator<Item = R>) -> Result<(), Error> {
        for row in rows {
            self.buffer.push(row);
            if self.buffer.len() >= 16_384 {
                self.flush()?;
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        let columns = R::to_columns(&self.buffer).map_err(|column| Error::NotANumber {
            path: self.path.clone(),
            column: column.to_owned(),
        })?;
        self.rows += self.buffer.len();
        self.buffer.clear();
        let batch = RecordBatch::try_new(self.schema.clone(), columns)
            .map_err(|e| Error::parquet(&self.path, e.into()))?;
        self.writer
            .write(&batch)
            .map_err(|e| Error::parquet(&self.path, e))
    }

    /// Writes what is left and the footer, and syncs the file; returns the number of rows.
    pub fn close(mut self) -> Result<usize, Error> {
        if !self.buffer.is_empty() || self.rows == 0 {
            self.flush()?;
        }
        let mut file = self
            .writer
            .into_inner()
            .map_err(|e| Error::parquet(&self.path, e))?;
        file.flush()
            .and_then(|()| file.sync_all())
            .map_err(|e| Error::io("sync", &self.path, e))?;
        Ok(self.rows)
    }
}

fn properties<R: Row>(metadata: &BTreeMap<String, String>) -> WriterProperties {
    let mut key_values = vec![
        KeyValue::new("zonobench.table".to_owned(), R::TABLE.to_owned()),
        KeyValue::new(
            "zonobench.description".to_owned(),
            R::DESCRIPTION.trim().to_owned(),
        ),
        KeyValue::new(
            "zonobench.schema_version".to_owned(),
            SCHEMA_VERSION.to_owned(),
        ),
        KeyValue::new(
            "zonobench.license".to_owned(),
            "MIT OR Apache-2.0".to_owned(),
        ),
    ];
    key_values.extend(
        metadata
            .iter()
            .map(|(k, v)| KeyValue::new(format!("zonobench.{k}"), v.clone())),
    );
    let sorting = (0..R::SORTED_BY)
        .map(|i| SortingColumn {
            column_idx: i as i32,
            descending: false,
            nulls_first: false,
        })
        .collect();
    let mut builder = WriterProperties::builder()
        .set_created_by("zonobench".to_owned())
        .set_compression(Compression::ZSTD(
            ZstdLevel::try_new(3).expect("3 is a zstd level"),
        ))
        .set_statistics_enabled(EnabledStatistics::Page)
        .set_max_row_group_row_count(Some(ROW_GROUP))
        .set_sorting_columns((R::SORTED_BY > 0).then_some(sorting))
        .set_key_value_metadata(Some(key_values));
    for column in R::columns() {
        let path = match column.data_type {
            DataType::Float64 => ColumnPath::from(column.name),
            DataType::List(_) => ColumnPath::new(vec![
                column.name.to_owned(),
                "list".to_owned(),
                "item".to_owned(),
            ]),
            _ => continue,
        };
        // Noise-like doubles do not repeat: splitting the byte streams beats a dictionary.
        builder = builder
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path, Encoding::BYTE_STREAM_SPLIT);
    }
    builder.build()
}

/// Writes `rows` to `path`; see [`TableWriter`].
pub fn write<R: Row>(
    path: &Path,
    rows: impl IntoIterator<Item = R>,
    metadata: &BTreeMap<String, String>,
) -> Result<usize, Error> {
    let mut writer = TableWriter::create(path, metadata)?;
    writer.push(rows)?;
    writer.close()
}

/// Reads a table batch by batch, checking that its columns are this table's.
pub fn batches<R: Row>(
    path: &Path,
) -> Result<impl Iterator<Item = Result<RecordBatch, Error>>, Error> {
    let all: Vec<&str> = R::columns().iter().map(|c| c.name).collect();
    columns::<R>(path, &all)
}

/// As [`batches`] with the columns `names` alone, in the table's order: the others are not decoded.
pub fn columns<R: Row>(
    path: &Path,
    names: &[&str],
) -> Result<impl Iterator<Item = Result<RecordBatch, Error>> + use<R>, Error> {
    let file = File::open(path).map_err(|e| Error::io("open", path, e))?;
    let builder =
        ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| Error::parquet(path, e))?;
    check_columns::<R>(path, builder.schema())?;
    let mask = ProjectionMask::columns(builder.parquet_schema(), names.iter().copied());
    let reader = builder
        .with_projection(mask)
        .with_batch_size(16_384)
        .build()
        .map_err(|e| Error::parquet(path, e))?;
    let path = path.to_owned();
    Ok(until_damaged(reader).map(move |batch| batch.map_err(|e| Error::parquet(&path, e))))
}

/// Checks that a file's columns have this table's names and types, in order.
pub fn check_columns<R: Row>(path: &Path, found: &Schema) -> Result<(), Error> {
    let expected: Vec<_> = R::columns()
        .iter()
        .map(|c| format!("{} {}", c.name, c.data_type))
        .collect();
    let got: Vec<_> = found
        .fields()
        .iter()
        .map(|f| format!("{} {}", f.name(), f.data_type()))
        .collect();
    if expected == got {
        Ok(())
    } else {
        Err(Error::Schema {
            path: path.to_owned(),
            expected: expected.join(", "),
            got: got.join(", "),
        })
    }
}

/// Calls `f` with every row of a table, in order.
pub fn for_each<R: Row>(path: &Path, mut f: impl FnMut(R)) -> Result<(), Error> {
    for batch in batches::<R>(path)? {
        let batch = batch?;
        let rows = R::from_columns(batch.columns()).map_err(|column| Error::Schema {
            path: path.to_owned(),
            expected: format!("column {column} of table {}", R::TABLE),
            got: "another type".to_owned(),
        })?;
        rows.for_each(&mut f);
    }
    Ok(())
}

/// All rows of a table.
pub fn read<R: Row>(path: &Path) -> Result<Vec<R>, Error> {
    let mut rows = Vec::new();
    for_each(path, |row| rows.push(row))?;
    Ok(rows)
}

/// Concatenates files of one table in the given order into `path`, row group by row group: the pages are
/// copied as they are. Returns the number of rows.
pub fn concatenate<R: Row>(
    path: &Path,
    parts: &[std::path::PathBuf],
    metadata: &BTreeMap<String, String>,
) -> Result<usize, Error> {
    let arrow = schema::<R>();
    let mut properties = properties::<R>(metadata);
    add_encoded_arrow_schema_to_metadata(&arrow, &mut properties);
    let parquet = ArrowSchemaConverter::new()
        .convert(&arrow)
        .map_err(|e| Error::parquet(path, e))?;
    let file = File::create(path).map_err(|e| Error::io("create", path, e))?;
    let mut writer =
        SerializedFileWriter::new(file, parquet.root_schema_ptr(), Arc::new(properties))
            .map_err(|e| Error::parquet(path, e))?;
    let mut rows = 0;
    for part in parts {
        let input = File::open(part).map_err(|e| Error::io("open", part, e))?;
        rows += append(&mut writer, &input).map_err(|e| Error::parquet(part, e))?;
    }
    let file = writer.into_inner().map_err(|e| Error::parquet(path, e))?;
    file.sync_all().map_err(|e| Error::io("sync", path, e))?;
    Ok(rows)
}

/// Appends the row groups of `input`; the writer checks that its columns are the same.
fn append(writer: &mut SerializedFileWriter<File>, input: &File) -> Result<usize, ParquetError> {
    let metadata = ParquetMetaDataReader::new()
        .with_page_index_policy(PageIndexPolicy::Optional)
        .parse_and_finish(input)?;
    let mut rows = 0;
    for (i, group) in metadata.row_groups().iter().enumerate() {
        let mut out = writer.next_row_group()?;
        for (j, column) in group.columns().iter().enumerate() {
            let pages = metadata.column_index().and_then(|of| of.get(i)?.get(j));
            let offsets = metadata.offset_index().and_then(|of| of.get(i)?.get(j));
            let closed = ColumnCloseResult {
                bytes_written: column.compressed_size() as u64,
                rows_written: group.num_rows() as u64,
                metadata: column.clone(),
                bloom_filter: None,
                column_index: pages
                    .filter(|p| !matches!(p, ColumnIndexMetaData::NONE))
                    .cloned(),
                offset_index: offsets.cloned(),
            };
            out.append_column(input, closed)?;
        }
        out.close()?;
        rows += group.num_rows() as usize;
    }
    Ok(rows)
}

/// The key-values that every file of a stage carries.
pub fn metadata(stage: &str, seed: Option<u64>) -> BTreeMap<String, String> {
    let mut map = BTreeMap::from([("stage".to_owned(), stage.to_owned())]);
    if let Some(seed) = seed {
        map.insert("seed_root".to_owned(), seed.to_string());
        map.insert(
            "rng".to_owned(),
            "ChaCha8 by counter (seed, purpose, run, step, component, attempt)".to_owned(),
        );
    }
    map
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{Score, Set};

    fn set(k: i32) -> Set {
        Set {
            estimator: "e".into(),
            run: 0,
            k,
            phase: "updated".into(),
            kind: "zonotope".into(),
            center: Some(vec![f64::from(k), -0.5]),
            generators: (k > 1).then(|| vec![1.0, f64::INFINITY]),
            a: None,
            b: Some(Vec::new()),
            vertices: None,
        }
    }

    #[test]
    fn rows_come_back_as_they_were_and_files_join() {
        let folder = tempfile::tempdir().unwrap();
        let meta = BTreeMap::from([("stage".to_owned(), "test".to_owned())]);
        let parts: Vec<_> = (0..3)
            .map(|i| folder.path().join(format!("{i}.parquet")))
            .collect();
        write(&parts[0], [set(0), set(1)], &meta).unwrap();
        write::<Set>(&parts[1], [], &meta).unwrap();
        write(&parts[2], [set(2)], &meta).unwrap();
        assert_eq!(read::<Set>(&parts[0]).unwrap(), [set(0), set(1)]);
        let joined = folder.path().join("joined.parquet");
        assert_eq!(concatenate::<Set>(&joined, &parts, &meta).unwrap(), 3);
        assert_eq!(read::<Set>(&joined).unwrap(), [set(0), set(1), set(2)]);
        let file = File::open(&joined).unwrap();
        let builder = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
        assert_eq!(
            builder
                .schema()
                .field(5)
                .metadata()
                .get("unit")
                .map(|u| &**u),
            Some("state")
        );
    }

    #[test]
    fn not_a_number_is_refused_and_so_is_another_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        let wrong = Set {
            center: Some(vec![f64::NAN]),
            ..set(0)
        };
        assert!(matches!(
            write(&path, [wrong], &BTreeMap::new()),
            Err(Error::NotANumber { .. })
        ));
        write(&path, [set(0)], &BTreeMap::new()).unwrap();
        assert!(matches!(read::<Score>(&path), Err(Error::Schema { .. })));
    }
}
