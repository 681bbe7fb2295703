//! The lake: Parquet files by table, paper and experiment, and the manifest that vouches for them.
//!
//! A file of the lake is made from artifacts of the store; its manifest entry keeps the key of what it
//! was made from and the hash of what was written. At every run each file is hashed again: one that is
//! missing, changed or made from something else is rebuilt. The manifest is written last.

use crate::error::Error;
use crate::rows;
use crate::store::{hash_file, sync_dir, write_synced};
use crate::table::{self, ColumnInfo, Row, SCHEMA_VERSION};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// The manifest's file name.
pub const MANIFEST: &str = "MANIFEST.json";

/// A file that the manifest vouches for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Path below the lake, with `/`.
    pub path: String,
    /// Table name; `trace` for MCAP files, `catalog` for descriptions.
    pub table: String,
    /// Size in bytes.
    pub bytes: u64,
    /// BLAKE3 of the content.
    pub blake3: String,
    /// Rows of a table.
    pub rows: Option<u64>,
    /// Version of the table's schema.
    pub schema_version: Option<String>,
    /// Key of what it was made from.
    pub key: String,
}

#[derive(Default, Serialize, Deserialize)]
struct Manifest {
    zonobench: String,
    files: Vec<Entry>,
}

/// A file to publish: where, made from what, and how.
pub struct Publication<'a> {
    /// Path below the lake.
    pub path: String,
    /// Table name, or `trace`.
    pub table: &'static str,
    /// Key of what it is made from.
    pub key: String,
    /// Writes the file; returns the number of rows if it is a table.
    pub make: Box<dyn Fn(&Path) -> Result<Option<u64>, Error> + Send + Sync + 'a>,
}

/// The path of a table of one experiment.
pub fn table_path(table: &str, paper: &str, experiment: &str) -> String {
    format!("{table}/paper={paper}/experiment={experiment}/part-0.parquet")
}

/// The path of a table of one paper.
pub fn paper_table_path(table: &str, paper: &str) -> String {
    format!("{table}/paper={paper}/part-0.parquet")
}

/// The path of the trace of run 0 of one estimator.
pub fn trace_path(paper: &str, experiment: &str, estimator: &str) -> String {
    format!("traces/paper={paper}/experiment={experiment}/{estimator}_run0000.mcap")
}

/// The number of rows of a Parquet file, from its footer.
pub fn count_rows(path: &Path) -> Result<u64, Error> {
    let file = fs::File::open(path).map_err(|e| Error::io("open", path, e))?;
    let reader = parquet::file::serialized_reader::SerializedFileReader::new(file)
        .map_err(|e| Error::parquet(path, e))?;
    Ok(parquet::file::reader::FileReader::metadata(&reader)
        .file_metadata()
        .num_rows() as u64)
}

/// Publishes `files` and writes the manifest. Entries for which `in_scope(paper, experiment)` holds and
/// that are not published any more are removed with their files; all others stay as they are.
/// Returns how many files were (re)built.
pub fn publish(
    lake: &Path,
    mut files: Vec<Publication<'_>>,
    in_scope: impl Fn(&str, Option<&str>) -> bool,
) -> Result<usize, Error> {
    files.sort_by(|a, b| a.path.cmp(&b.path));
    files.extend(catalog());
    let old: BTreeMap<String, Entry> = read_manifest(lake)
        .unwrap_or_default()
        .into_iter()
        .map(|e| (e.path.clone(), e))
        .collect();
    let tmp = lake.join(".cache").join("tmp");
    let built: Vec<(Entry, bool)> = files
        .par_iter()
        .enumerate()
        .map(|(i, file)| {
            let target = lake.join(&file.path);
            if let Some(entry) = old.get(&file.path)
                && entry.key == file.key
                && is_whole(&target, entry)
            {
                return Ok((entry.clone(), false));
            }
            let draft = tmp.join(format!("publish-{i}"));
            let rows = (file.make)(&draft)?;
            let (bytes, blake3) = hash_file(&draft)?;
            let parent = target.parent().expect("a lake file lies in a folder");
            fs::create_dir_all(parent).map_err(|e| Error::io("create", parent, e))?;
            fs::rename(&draft, &target).map_err(|e| Error::io("publish", &target, e))?;
            let entry = Entry {
                path: file.path.clone(),
                table: file.table.to_owned(),
                bytes,
                blake3,
                rows,
                schema_version: rows.map(|_| SCHEMA_VERSION.to_owned()),
                key: file.key.clone(),
            };
            Ok((entry, true))
        })
        .collect::<Result<_, Error>>()?;
    let published: BTreeSet<&str> = files.iter().map(|f| f.path.as_str()).collect();
    let mut entries: Vec<Entry> = built.iter().map(|(entry, _)| entry.clone()).collect();
    for (path, entry) in &old {
        if published.contains(path.as_str()) {
            continue;
        }
        let keys = path_keys(path);
        if keys
            .paper
            .is_none_or(|paper| in_scope(paper, keys.experiment))
        {
            let stale = lake.join(path);
            if stale.exists() {
                fs::remove_file(&stale).map_err(|e| Error::io("remove the stale", &stale, e))?;
            }
        } else {
            entries.push(entry.clone());
        }
    }
    entries.sort_by(|a, b| a.path.cmp(&b.path));
    let manifest = Manifest {
        zonobench: env!("CARGO_PKG_VERSION").to_owned(),
        files: entries,
    };
    let path = lake.join(MANIFEST);
    let text = serde_json::to_vec_pretty(&manifest).map_err(|e| Error::json(&path, e))?;
    if fs::read(&path).ok().as_deref() != Some(&text) {
        let draft = tmp.join("manifest");
        write_synced(&draft, &text)?;
        fs::rename(&draft, &path).map_err(|e| Error::io("publish", &path, e))?;
        sync_dir(lake)?;
    }
    Ok(built.iter().filter(|(_, fresh)| *fresh).count())
}

fn is_whole(path: &Path, entry: &Entry) -> bool {
    fs::symlink_metadata(path).is_ok_and(|m| m.is_file() && m.len() == entry.bytes)
        && hash_file(path).is_ok_and(|(_, hash)| hash == entry.blake3)
}

/// The Hive keys in a lake path.
pub(crate) struct PathKeys<'a> {
    pub(crate) paper: Option<&'a str>,
    pub(crate) experiment: Option<&'a str>,
}

pub(crate) fn path_keys(path: &str) -> PathKeys<'_> {
    let find = |key| path.split('/').find_map(|part| part.strip_prefix(key));
    PathKeys {
        paper: find("paper="),
        experiment: find("experiment="),
    }
}

/// The manifest's entries; paths that would leave the lake are refused.
pub fn read_manifest(lake: &Path) -> Result<Vec<Entry>, Error> {
    let path = lake.join(MANIFEST);
    let text = fs::read(&path).map_err(|e| {
        if e.kind() == std::io::ErrorKind::NotFound {
            Error::NoLake {
                path: lake.to_owned(),
            }
        } else {
            Error::io("read", &path, e)
        }
    })?;
    let manifest: Manifest = serde_json::from_slice(&text).map_err(|e| Error::json(&path, e))?;
    for entry in &manifest.files {
        if !Path::new(&entry.path)
            .components()
            .all(|c| matches!(c, Component::Normal(_)))
        {
            return Err(Error::Unknown {
                what: "lake path",
                got: entry.path.clone(),
                expected: "paths in a manifest stay inside the lake".to_owned(),
            });
        }
    }
    Ok(manifest.files)
}

/// A thing that `verify` found wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The file.
    pub path: String,
    /// What is wrong with it.
    pub what: String,
}

/// The tables that every paper's experiments fill, and how to check one's file.
type Check = fn(&Path) -> Result<u64, Error>;

fn check_table<R: Row>(path: &Path) -> Result<u64, Error> {
    let mut rows = 0;
    for batch in table::batches::<R>(path)? {
        rows += batch?.num_rows() as u64;
    }
    Ok(rows)
}

struct TableInfo {
    name: &'static str,
    description: &'static str,
    columns: Vec<ColumnInfo>,
    check: Check,
    hashed: bool,
}

fn info<R: Row>(hashed: bool) -> TableInfo {
    TableInfo {
        name: R::TABLE,
        description: R::DESCRIPTION.trim(),
        columns: R::columns(),
        check: check_table::<R>,
        hashed,
    }
}

fn tables() -> Vec<TableInfo> {
    vec![
        info::<rows::Variable>(true),
        info::<rows::Truth>(true),
        info::<rows::Measurement>(true),
        info::<rows::Input>(true),
        info::<rows::EstimatorInfo>(true),
        info::<rows::Estimate>(true),
        info::<rows::Belief>(true),
        info::<rows::Set>(true),
        info::<rows::Metric>(true),
        info::<rows::Score>(true),
        info::<rows::Published>(true),
        info::<rows::Comparison>(true),
        info::<rows::Timing>(false),
        info::<rows::TimingComparison>(false),
    ]
}

/// The names of all tables.
pub fn table_names() -> Vec<&'static str> {
    tables().into_iter().map(|t| t.name).collect()
}

/// Rehashes every file of the lake against its manifest, checks schemas and row counts, that no file is
/// unaccounted for, and that no guaranteed set lost the truth. Returns the number of files and what is wrong.
pub fn verify(lake: &Path) -> Result<(usize, Vec<Finding>), Error> {
    let entries = read_manifest(lake)?;
    let tables = tables();
    let mut findings: Vec<Finding> = entries
        .par_iter()
        .filter_map(|entry| {
            let path = lake.join(&entry.path);
            let what = if !path.is_file() {
                "is missing".to_owned()
            } else if !is_whole(&path, entry) {
                "does not have the content that the manifest vouches for".to_owned()
            } else if let Some(table) = tables.iter().find(|t| t.name == entry.table) {
                match (table.check)(&path) {
                    Ok(rows) if Some(rows) == entry.rows => return None,
                    Ok(rows) => format!("has {rows} rows, the manifest says {:?}", entry.rows),
                    Err(e) => e.to_string(),
                }
            } else {
                return None;
            };
            Some(Finding {
                path: entry.path.clone(),
                what,
            })
        })
        .collect();
    let known: BTreeSet<&str> = entries.iter().map(|e| e.path.as_str()).collect();
    for table in tables
        .iter()
        .filter(|t| t.hashed)
        .map(|t| t.name)
        .chain(["traces"])
    {
        let mut found = Vec::new();
        list(&lake.join(table), table, &mut found);
        for path in found {
            if !known.contains(path.as_str()) {
                findings.push(Finding {
                    path,
                    what: "is not in the manifest".to_owned(),
                });
            }
        }
    }
    if findings.is_empty() {
        findings.extend(violations(lake, &entries)?);
    }
    findings.sort_by(|a, b| a.path.cmp(&b.path));
    Ok((entries.len(), findings))
}

fn list(dir: &Path, relative: &str, out: &mut Vec<String>) {
    let Ok(entries) = fs::read_dir(dir) else {
        return;
    };
    for entry in entries.flatten() {
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        let below = format!("{relative}/{name}");
        if entry.path().is_dir() {
            list(&entry.path(), &below, out)
        } else {
            out.push(below)
        }
    }
}

/// Steps at which a set that is called guaranteed certainly lost the truth.
pub fn violations(lake: &Path, entries: &[Entry]) -> Result<Vec<Finding>, Error> {
    let mut findings = Vec::new();
    for entry in entries.iter().filter(|e| e.table == "beliefs") {
        let keys = path_keys(&entry.path);
        let (Some(paper), Some(experiment)) = (keys.paper, keys.experiment) else {
            continue;
        };
        let infos: Vec<rows::EstimatorInfo> =
            table::read(&lake.join(table_path("estimators", paper, experiment)))?;
        let guaranteed: BTreeSet<_> = infos
            .iter()
            .filter(|i| i.guaranteed)
            .map(|i| i.estimator.clone())
            .collect();
        if guaranteed.is_empty() {
            continue;
        }
        let mut lost = BTreeMap::<_, (usize, i32, i32)>::new();
        table::for_each::<rows::Belief>(&lake.join(&entry.path), |b| {
            if b.contains_truth == Some(false) && guaranteed.contains(&b.estimator) {
                lost.entry(b.estimator).or_insert((0, b.run, b.k)).0 += 1;
            }
        })?;
        for (estimator, (n, run, k)) in lost {
            findings.push(Finding {
                path: entry.path.clone(),
                what: format!(
                    "guarantee violated: {estimator} lost the truth at {n} steps, first at run {run}, k = {k}"
                ),
            });
        }
    }
    Ok(findings)
}

/// The descriptions of the lake that are files of it: a page for people, a data package for programs.
fn catalog() -> Vec<Publication<'static>> {
    let page = |text: String, path: &str| Publication {
        path: path.to_owned(),
        table: "catalog",
        key: blake3::hash(text.as_bytes()).to_hex().to_string(),
        make: Box::new(move |path| write_synced(path, text.as_bytes()).map(|()| None)),
    };
    vec![
        page(catalog_page(), "CATALOG.md"),
        page(data_package(), "datapackage.json"),
    ]
}

fn catalog_page() -> String {
    let mut text = String::from(
        "# The tables of this lake\n\n\
         Parquet, one file a paper and experiment: `<table>/paper=<p>/experiment=<e>/part-0.parquet` \
         (`published`, `comparison`, `timing_comparison`: by paper alone). `paper` and `experiment` are \
         read from the path. Units are UCUM codes; `state` means the unit of the named component, which \
         `variables` gives. Null means not applicable; NaN never occurs. `MANIFEST.json` vouches for \
         every file but the timings.\n",
    );
    for table in tables() {
        text += &format!("\n## {}\n\n{}", table.name, table.description);
        if !table.hashed {
            text += " (not vouched for by the manifest)";
        }
        text += "\n\n| column | type | null | unit | |\n|---|---|---|---|---|\n";
        for c in &table.columns {
            let null = if c.nullable { "yes" } else { "" };
            let kind = type_name(c);
            text += &format!(
                "| {} | {kind} | {null} | {} | {} |\n",
                c.name, c.unit, c.description
            );
        }
    }
    text
}

fn type_name(column: &ColumnInfo) -> &'static str {
    match column.data_type {
        arrow_schema::DataType::Utf8 => "string",
        arrow_schema::DataType::Boolean => "boolean",
        arrow_schema::DataType::Int32 | arrow_schema::DataType::Int64 => "integer",
        arrow_schema::DataType::List(_) => "list",
        _ => "number",
    }
}

fn data_package() -> String {
    let resources: Vec<serde_json::Value> = tables()
        .iter()
        .filter(|t| t.hashed)
        .map(|t| {
            let fields: Vec<_> = t
                .columns
                .iter()
                .map(|c| {
                    serde_json::json!({
                        "name": c.name, "type": type_name(c), "unit": c.unit, "description": c.description,
                        "constraints": { "required": !c.nullable },
                    })
                })
                .collect();
            serde_json::json!({
                "name": t.name.replace('_', "-"),
                "title": t.name,
                "description": t.description,
                "path": format!("{}/", t.name),
                "mediatype": "application/vnd.apache.parquet",
                "schema": { "fields": fields },
            })
        })
        .collect();
    let package = serde_json::json!({
        "$schema": "https://datapackage.org/profiles/2.0/datapackage.json",
        "name": "zonobench-lake",
        "version": SCHEMA_VERSION,
        "licenses": [{ "name": "MIT" }, { "name": "Apache-2.0" }],
        "resources": resources,
    });
    serde_json::to_string_pretty(&package).expect("strings and numbers have a JSON form")
}

/// The files of `table` in the lake, from the manifest (and from the folder for the unhashed ones).
pub fn files_of(lake: &Path, entries: &[Entry], table: &str) -> Vec<PathBuf> {
    let hashed = tables().iter().any(|t| t.name == table && t.hashed);
    if hashed {
        return entries
            .iter()
            .filter(|e| e.table == table)
            .map(|e| lake.join(&e.path))
            .collect();
    }
    let mut found = Vec::new();
    list(&lake.join(table), table, &mut found);
    found.sort();
    found
        .into_iter()
        .filter(|p| p.ends_with(".parquet"))
        .map(|p| lake.join(p))
        .collect()
}
