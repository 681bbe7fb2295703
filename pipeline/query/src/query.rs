//! SQL over the lake, by polars: every lake table is a table name, with `paper` and `experiment` as columns.

use polars::prelude::{
    AnyValue, DataFrame, DataType, Field, LazyFrame, PlRefPath, PolarsError, ScanArgsParquet,
    UnionArgs, concat, lit,
};
use polars::sql::SQLContext;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zonobench_lake::error::Error;
use zonobench_lake::lake::{self, files_of, read_manifest, table_names};

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

/// The lake's tables as lazily scanned frames.
pub fn context(lake: &Path) -> Result<(SQLContext, Vec<&'static str>), Error> {
    let entries = read_manifest(lake)?;
    let context = SQLContext::new();
    let mut names = Vec::new();
    for name in table_names() {
        let files = files_of(lake, &entries, name);
        if !files.is_empty() {
            let frame = frame(lake, name, &files).map_err(|e| failure(&e, &names))?;
            context.register(name, frame);
            names.push(name);
        }
    }
    Ok((context, names))
}

/// The rows of `files`, which are what the lake has of `table`, and of no other file that lies among them.
fn frame(lake: &Path, table: &str, files: &[PathBuf]) -> Result<LazyFrame, PolarsError> {
    if lake::on_disk(lake, table) == files {
        return scan(&lake.join(table));
    }
    let one = |file: &PathBuf| {
        let mut arguments = ScanArgsParquet::default();
        arguments.hive_options.enabled = Some(false);
        let frame = LazyFrame::scan_parquet(PlRefPath::new(file.display().to_string()), arguments)?;
        let below = file.strip_prefix(lake).unwrap_or(file).to_string_lossy();
        let keys = lake::path_keys(&below);
        let key = |name: &str, value: Option<&str>| Some(lit(value?.to_owned()).alias(name));
        let columns: Vec<_> = [key("paper", keys.paper), key("experiment", keys.experiment)]
            .into_iter()
            .flatten()
            .collect();
        Ok(frame.with_columns(columns))
    };
    let frames: Vec<LazyFrame> = files.iter().map(one).collect::<Result<_, PolarsError>>()?;
    concat(frames, UnionArgs::default())
}

/// A Hive-partitioned folder of Parquet files; its keys are strings, whatever they look like.
fn scan(folder: &Path) -> Result<LazyFrame, PolarsError> {
    let by_paper = [
        "published",
        "comparison",
        "claims",
        "complexity",
        "timing_comparison",
    ];
    let paper_alone = folder
        .file_name()
        .is_some_and(|name| by_paper.iter().any(|t| name == *t));
    let keys: &[&str] = if paper_alone {
        &["paper"]
    } else {
        &["paper", "experiment"]
    };
    let mut arguments = ScanArgsParquet::default();
    arguments.hive_options.enabled = Some(true);
    arguments.hive_options.try_parse_dates = false;
    arguments.hive_options.schema = Some(Arc::new(
        keys.iter()
            .map(|k| Field::new((*k).into(), DataType::String))
            .collect(),
    ));
    LazyFrame::scan_parquet(PlRefPath::new(folder.display().to_string()), arguments)
}

fn failure(e: &PolarsError, tables: &[&str]) -> Error {
    Error::Query {
        message: e.to_string(),
        tables: tables.join(", "),
    }
}

/// The result of a query.
pub fn run(lake: &Path, sql: &str) -> Result<DataFrame, Error> {
    let (mut context, names) = context(lake)?;
    context
        .execute(sql)
        .and_then(LazyFrame::collect)
        .map_err(|e| failure(&e, &names))
}

/// A frame as text.
pub fn render(frame: &DataFrame, format: Format) -> String {
    let names: Vec<String> = frame
        .get_column_names()
        .iter()
        .map(|n| n.to_string())
        .collect();
    let columns = frame.columns();
    let cell = |i: usize, row: usize| columns[i].get(row).unwrap_or(AnyValue::Null);
    match format {
        Format::Json => {
            let rows: Vec<serde_json::Value> = (0..frame.height())
                .map(|row| {
                    let object: serde_json::Map<String, serde_json::Value> = names
                        .iter()
                        .enumerate()
                        .map(|(i, name)| (name.clone(), json(&cell(i, row))))
                        .collect();
                    object.into()
                })
                .collect();
            serde_json::to_string_pretty(&rows).expect("JSON values have a text form") + "\n"
        }
        Format::Csv => {
            let mut writer = csv::Writer::from_writer(Vec::new());
            let record = |fields: Vec<String>, writer: &mut csv::Writer<Vec<u8>>| {
                writer
                    .write_record(&fields)
                    .expect("writing to memory does not fail");
            };
            record(names.clone(), &mut writer);
            for row in 0..frame.height() {
                record(
                    (0..names.len()).map(|i| text(&cell(i, row))).collect(),
                    &mut writer,
                );
            }
            let bytes = writer
                .into_inner()
                .expect("writing to memory does not fail");
            String::from_utf8(bytes).expect("the fields are UTF-8")
        }
        Format::Table => {
            let rows = (0..frame.height())
                .map(|row| (0..names.len()).map(|i| text(&cell(i, row))).collect());
            let mut out = aligned(&names, rows);
            out += &format!("{} rows\n", frame.height());
            out
        }
    }
}

/// Rows below a header, aligned.
pub fn aligned(header: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(header.iter().map(|h| h.as_str()));
    for row in rows {
        table.add_row(row);
    }
    table
        .lines()
        .map(|line| line.trim_end().to_owned() + "\n")
        .collect()
}

fn text(value: &AnyValue) -> String {
    match value {
        AnyValue::Null => String::new(),
        AnyValue::List(series) => {
            let items: Vec<String> = series.iter().map(|v| text(&v)).collect();
            format!("[{}]", items.join(", "))
        }
        other => other.get_str().map_or_else(|| number(other), str::to_owned),
    }
}

/// Shortest text that reads back to the same number.
fn number(value: &AnyValue) -> String {
    match value {
        AnyValue::Float64(x) => x.to_string(),
        other => other.to_string(),
    }
}

fn json(value: &AnyValue) -> serde_json::Value {
    match value {
        AnyValue::Null => serde_json::Value::Null,
        AnyValue::Boolean(b) => (*b).into(),
        AnyValue::Float64(x) if x.is_finite() => (*x).into(),
        // JSON has no infinity.
        AnyValue::Float64(x) => x.to_string().into(),
        AnyValue::List(series) => series.iter().map(|v| json(&v)).collect::<Vec<_>>().into(),
        other => match (other.get_str(), other.extract::<i64>()) {
            (Some(s), _) => s.into(),
            (None, Some(i)) => i.into(),
            _ => other.to_string().into(),
        },
    }
}

/// One whole table of the lake as a lazy frame; None where the lake has no file of it.
pub fn table(lake: &Path, name: &str) -> Result<Option<LazyFrame>, Error> {
    let entries = read_manifest(lake)?;
    let files = files_of(lake, &entries, name);
    if files.is_empty() {
        return Ok(None);
    }
    frame(lake, name, &files)
        .map(Some)
        .map_err(|e| failure(&e, &[name]))
}
