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

/// Writes a file of the lake; returns the number of rows if it is a table.
type Make<'a> = dyn Fn(&Path) -> Result<Option<u64>, Error> + Send + Sync + 'a;

/// A file to publish: where, made from what, and how.
pub struct Publication<'a> {
    /// Path below the lake.
    pub path: String,
    /// Table name, or `trace`.
    pub table: &'static str,
    /// Key of what it is made from.
    pub key: String,
    /// Writes the file; returns the number of rows if it is a table.
    pub make: Box<Make<'a>>,
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
    // What is wrong with the old manifest is mended by writing it anew, from what can be trusted of it.
    let old: BTreeMap<String, Entry> = parse_manifest(lake)
        .unwrap_or_default()
        .into_iter()
        .filter(|entry| stays_inside(lake, &entry.path))
        .map(|entry| (entry.path.clone(), entry))
        .collect();
    let tmp = lake.join(".cache").join("tmp");
    let built: Vec<(Entry, bool)> = files
        .par_iter()
        .enumerate()
        .map(|(i, file)| {
            let target = lake.join(&file.path);
            let folder = Path::new(&file.path).parent().unwrap_or(Path::new(""));
            if !stays_inside(lake, folder) {
                return Err(outside(lake, &file.path));
            }
            if let Some(entry) = old.get(&file.path)
                && entry.key == file.key
                && entry.table == file.table
                && is_whole(&target, entry)
                && is_described(&target, entry)
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
    // Also what a killed run published before its manifest.
    let mut stale: BTreeSet<String> = tables_on_disk(lake, true)
        .into_iter()
        .filter(|path| !old.contains_key(path))
        .collect();
    // Times are not published here: they go with their experiment.
    let known: BTreeSet<_> = published.iter().map(|path| path_keys(path)).collect();
    let times = tables_on_disk(lake, false).into_iter();
    let inside = |path: &str| stays_inside(lake, Path::new(path).parent().unwrap_or(Path::new("")));
    stale.extend(times.filter(|path| !known.contains(&path_keys(path)) && inside(path)));
    for (path, entry) in &old {
        if published.contains(path.as_str()) {
            continue;
        }
        let keys = path_keys(path);
        if keys
            .paper
            .is_none_or(|paper| in_scope(paper, keys.experiment))
        {
            stale.insert(path.clone());
        } else {
            entries.push(entry.clone());
        }
    }
    for path in stale {
        let keys = path_keys(&path);
        let ours = keys
            .paper
            .is_none_or(|paper| in_scope(paper, keys.experiment));
        let file = lake.join(&path);
        if ours && !published.contains(path.as_str()) && file.exists() {
            fs::remove_file(&file).map_err(|e| Error::io("remove the stale", &file, e))?;
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

/// True if the entry's rows and schema are those of its file.
fn is_described(path: &Path, entry: &Entry) -> bool {
    let is_table = tables().iter().any(|t| t.name == entry.table);
    let rows = if is_table {
        count_rows(path).ok()
    } else {
        None
    };
    entry.rows == rows && entry.schema_version.as_deref() == rows.map(|_| SCHEMA_VERSION)
}

/// The Hive keys in a lake path.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub struct PathKeys<'a> {
    /// The paper.
    pub paper: Option<&'a str>,
    /// The experiment.
    pub experiment: Option<&'a str>,
}

/// The keys that stand in `path`, which is below the lake.
pub fn path_keys(path: &str) -> PathKeys<'_> {
    let find = |key| path.split('/').find_map(|part| part.strip_prefix(key));
    PathKeys {
        paper: find("paper="),
        experiment: find("experiment="),
    }
}

/// The manifest's entries; paths that would leave the lake are refused.
pub fn read_manifest(lake: &Path) -> Result<Vec<Entry>, Error> {
    let entries = parse_manifest(lake)?;
    match entries
        .iter()
        .find(|entry| !stays_inside(lake, &entry.path))
    {
        Some(entry) => Err(outside(lake, &entry.path)),
        None => Ok(entries),
    }
}

fn parse_manifest(lake: &Path) -> Result<Vec<Entry>, Error> {
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
    let manifest: Manifest =
        serde_json::from_slice(&text).map_err(|source| Error::Manifest { path, source })?;
    Ok(manifest.files)
}

/// True if `path` below the lake leads to no place outside it: neither by `..` or a root, nor by a symbolic link.
fn stays_inside(lake: &Path, path: impl AsRef<Path>) -> bool {
    let mut at = lake.to_owned();
    path.as_ref().components().all(|component| {
        at.push(component);
        matches!(component, Component::Normal(_))
            && !fs::symlink_metadata(&at).is_ok_and(|m| m.is_symlink())
    })
}

fn outside(lake: &Path, path: &str) -> Error {
    Error::Refused {
        what: lake.join(MANIFEST).display().to_string(),
        expected: "paths that stay in the lake, without symbolic links".to_owned(),
        got: path.to_owned(),
    }
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
        info::<rows::Attack>(true),
        info::<rows::Claim>(true),
        info::<rows::Complexity>(true),
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
                    Ok(rows) => {
                        let vouched = entry
                            .rows
                            .map_or_else(|| "nothing".to_owned(), |rows| rows.to_string());
                        format!("has {rows} rows, the manifest says {vouched}")
                    }
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
    for path in tables_on_disk(lake, true) {
        if !known.contains(path.as_str()) {
            findings.push(Finding {
                path,
                what: "is not in the manifest".to_owned(),
            });
        }
    }
    if findings.is_empty() {
        findings.extend(violations(lake, &entries)?);
    }
    findings.sort_by(|a, b| a.path.cmp(&b.path));
    Ok((entries.len(), findings))
}

/// The files that lie in the folders of the tables: of those that the manifest vouches for and of the traces, or of those
/// that it does not.
fn tables_on_disk(lake: &Path, hashed: bool) -> Vec<String> {
    let mut found = Vec::new();
    for table in tables()
        .iter()
        .filter(|t| t.hashed == hashed)
        .map(|t| t.name)
        .chain(hashed.then_some("traces"))
    {
        list(&lake.join(table), table, &mut found);
    }
    found
}

/// The files below `dir`, in no order; symbolic links are listed, not followed.
fn list(dir: &Path, relative: &str, out: &mut Vec<String>) {
    let Ok(entries) = fs::read_dir(dir) else {
        return;
    };
    for entry in entries.flatten() {
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        let below = format!("{relative}/{name}");
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder {
            list(&entry.path(), &below, out)
        } else {
            out.push(below)
        }
    }
}

/// What breaks a guarantee: steps at which a guaranteed set certainly lost the truth, and measurements that a
/// guaranteed estimator calls contradictory although the data keep to what it assumes. An empty set holds no
/// truth either.
pub fn violations(lake: &Path, entries: &[Entry]) -> Result<Vec<Finding>, Error> {
    let mut findings = Vec::new();
    for entry in entries.iter().filter(|e| e.table == "attack") {
        let rows = table::read::<rows::Attack>(&lake.join(&entry.path))?;
        let broken = rows.into_iter().filter(|r| r.guaranteed && r.lost > 0);
        findings.extend(broken.map(|r| Finding {
            path: entry.path.clone(),
            what: format!(
                "guarantee violated: {} under {} lost {} of {} sets",
                r.estimator, r.attack, r.lost, r.steps
            ),
        }));
    }
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
        let mut lost = Places::new();
        table::for_each::<rows::Belief>(&lake.join(&entry.path), |b| {
            if b.contains_truth == Some(false) && guaranteed.contains(&b.estimator) {
                note(&mut lost, b.estimator, b.run, b.k);
            }
        })?;
        let estimates = table_path("estimates", paper, experiment);
        let mut empty = Places::new();
        if may_differ(&lake.join(&estimates), "status", b"ok")? {
            table::for_each::<rows::Estimate>(&lake.join(&estimates), |e| {
                if &*e.status == "inconsistent" && guaranteed.contains(&e.estimator) {
                    note(&mut empty, e.estimator, e.run, e.k);
                }
            })?;
        }
        let what = "lost the truth";
        findings.extend(
            lost.into_iter()
                .map(|place| broken(&entry.path, what, place)),
        );
        let what = "called admissible data contradictory";
        findings.extend(
            empty
                .into_iter()
                .map(|place| broken(&estimates, what, place)),
        );
    }
    Ok(findings)
}

/// For each estimator the (run, k) of its broken guarantees.
type Places = BTreeMap<table::Name, BTreeSet<(i32, i32)>>;

fn note(places: &mut Places, estimator: table::Name, run: i32, k: i32) {
    places.entry(estimator).or_default().insert((run, k));
}

fn broken(
    path: &str,
    what: &str,
    (estimator, steps): (table::Name, BTreeSet<(i32, i32)>),
) -> Finding {
    let (run, k) = steps.first().copied().unwrap_or_default();
    let n = steps.len();
    Finding {
        path: path.to_owned(),
        what: format!(
            "guarantee violated: {estimator} {what} at {n} steps, first at run {run}, k = {k}"
        ),
    }
}

/// Where the simplex gave up, and where the interior-point solver was asked: what such sets are may depend on the
/// processor. One remark an estimator.
pub fn given_up(lake: &Path, entries: &[Entry]) -> Result<Vec<Finding>, Error> {
    let mut findings = Vec::new();
    let none = 0_i64.to_le_bytes();
    for entry in entries.iter().filter(|e| e.table == "beliefs") {
        let path = lake.join(&entry.path);
        if !may_differ(&path, "unfinished", &none)? && !may_differ(&path, "fallbacks", &none)? {
            continue;
        }
        let mut of = BTreeMap::<table::Name, (i64, i64)>::new();
        table::for_each::<rows::Belief>(&path, |b| {
            if b.unfinished != 0 || b.fallbacks != 0 {
                let sums = of.entry(b.estimator).or_default();
                *sums = (sums.0 + b.unfinished, sums.1 + b.fallbacks);
            }
        })?;
        findings.extend(of.into_iter().map(|(estimator, (unfinished, fallbacks))| Finding {
            path: entry.path.clone(),
            what: format!(
                "{estimator}: the simplex gave up on {unfinished} programs, the interior-point solver was asked {fallbacks} times"
            ),
        }));
    }
    Ok(findings)
}

/// Whether a column may hold anything but `value`, by the statistics in the file's footer.
fn may_differ(path: &Path, column: &str, value: &[u8]) -> Result<bool, Error> {
    let file = fs::File::open(path).map_err(|e| Error::io("open", path, e))?;
    let reader = parquet::file::serialized_reader::SerializedFileReader::new(file)
        .map_err(|e| Error::parquet(path, e))?;
    let metadata = parquet::file::reader::FileReader::metadata(&reader);
    Ok(metadata.row_groups().iter().any(|group| {
        let chunk = group
            .columns()
            .iter()
            .find(|c| c.column_path().string() == column);
        let Some(statistics) = chunk.and_then(|c| c.statistics()) else {
            return true;
        };
        [statistics.min_bytes_opt(), statistics.max_bytes_opt()] != [Some(value); 2]
    }))
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
    on_disk(lake, table)
}

/// The Parquet files that lie in the folder of `table`, sorted.
pub fn on_disk(lake: &Path, table: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    list(&lake.join(table), table, &mut found);
    found.retain(|path| path.ends_with(".parquet"));
    found.sort();
    found.into_iter().map(|path| lake.join(path)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{Belief, Estimate, EstimatorInfo};

    #[test]
    fn times_of_an_experiment_that_is_gone_go_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let lake = folder.path();
        fs::create_dir_all(lake.join(".cache").join("tmp")).unwrap();
        let times = |paper: &str, experiment: &str| {
            let path = lake.join(table_path("timings", paper, experiment));
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, "times").unwrap();
            path
        };
        let [kept, gone, other] = [times("p", "kept"), times("p", "gone"), times("q", "gone")];
        let file = Publication {
            path: table_path("scores", "p", "kept"),
            table: "scores",
            key: "key".to_owned(),
            make: Box::new(|path: &Path| {
                fs::write(path, "scores").unwrap();
                Ok(None)
            }),
        };
        publish(lake, vec![file], |paper, _| paper == "p").unwrap();
        assert!(kept.exists() && !gone.exists() && other.exists());
    }

    #[cfg(unix)]
    #[test]
    fn times_that_a_link_leads_to_are_not_the_lakes_to_remove() {
        let (folder, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let lake = folder.path();
        fs::create_dir_all(lake.join(".cache").join("tmp")).unwrap();
        std::os::unix::fs::symlink(elsewhere.path(), lake.join("timings")).unwrap();
        let path = lake.join(table_path("timings", "p", "gone"));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "times").unwrap();
        publish(lake, Vec::new(), |_, _| true).unwrap();
        assert!(path.exists());
    }

    /// A lake of one experiment with a guaranteed and another estimator, whose last step has this status
    /// and this verdict of the judge.
    /// A lake of one experiment, whose guaranteed estimator ends with `status` and `contains`.
    fn one_experiment(status: &str, contains: Option<bool>) -> (tempfile::TempDir, Entry) {
        let lake = tempfile::tempdir().unwrap();
        let place = |table: &str| {
            let path = lake.path().join(table_path(table, "p", "e"));
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            path
        };
        let meta = BTreeMap::new();
        let info = |estimator: &str, guaranteed| EstimatorInfo {
            estimator: estimator.into(),
            kind: "kind".into(),
            guaranteed,
            reads: "y_k".into(),
            reported_phase: "updated".into(),
            settings: "{}".into(),
        };
        let infos = [info("proved", true), info("other", false)];
        table::write(&place("estimators"), infos, &meta).unwrap();
        let estimate = |estimator: &str, k, status: &str| Estimate {
            estimator: estimator.into(),
            run: 3,
            k,
            phase: "updated".into(),
            component: "x1".into(),
            center: None,
            lower: None,
            upper: None,
            status: status.into(),
        };
        let both = ["proved", "other"];
        let estimates = both
            .iter()
            .flat_map(|e| [estimate(e, 0, "ok"), estimate(e, 1, status)]);
        table::write(&place("estimates"), estimates, &meta).unwrap();
        let beliefs = both.map(|estimator| Belief {
            estimator: estimator.into(),
            run: 3,
            k: 1,
            phase: "updated".into(),
            n_generators: None,
            n_constraints: None,
            trace_ggt: None,
            radius: None,
            volume: None,
            covariance: None,
            contains_truth: contains,
            lp_count: 0,
            pivots: 0,
            unfinished: i64::from(contains == Some(true)),
            fallbacks: 0,
        });
        table::write(&place("beliefs"), beliefs, &meta).unwrap();
        let entry = Entry {
            path: table_path("beliefs", "p", "e"),
            table: "beliefs".to_owned(),
            bytes: 0,
            blake3: String::new(),
            rows: None,
            schema_version: None,
            key: String::new(),
        };
        (lake, entry)
    }

    fn violations_of(status: &str, contains: Option<bool>) -> Vec<String> {
        let (lake, entry) = one_experiment(status, contains);
        let found = violations(lake.path(), &[entry]).unwrap();
        found.into_iter().map(|f| f.what).collect()
    }

    #[test]
    fn programs_that_were_given_up_are_told_by_estimator() {
        let told = |contains| {
            let (lake, entry) = one_experiment("ok", contains);
            let found = given_up(lake.path(), &[entry]).unwrap();
            found.into_iter().map(|f| f.what).collect::<Vec<_>>()
        };
        assert!(told(None).is_empty());
        let of = |estimator| {
            format!(
                "{estimator}: the simplex gave up on 1 programs, the interior-point solver was asked 0 times"
            )
        };
        assert_eq!(told(Some(true)), [of("other"), of("proved")]);
    }

    #[test]
    fn a_guaranteed_set_that_loses_the_truth_or_is_empty_is_a_violation() {
        assert!(violations_of("ok", Some(true)).is_empty());
        assert!(violations_of("ok", None).is_empty());
        assert!(violations_of("refused", None).is_empty());
        let lost = "guarantee violated: proved lost the truth at 1 steps, first at run 3, k = 1";
        assert_eq!(violations_of("ok", Some(false)), [lost]);
        let empty = "guarantee violated: proved called admissible data contradictory at 1 steps, \
                     first at run 3, k = 1";
        assert_eq!(violations_of("inconsistent", None), [empty]);
    }
}
