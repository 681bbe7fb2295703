//! SQL over the lake: every lake table is a table name, with `paper` and `experiment` as columns of text.

use crate::sql::{self, Fault, File, Table};
pub use crate::sql::{Answer, Format, Value, aligned};
use std::io::{ErrorKind, Write};
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::lake::{self, files_of, read_manifest, table_names};

/// The tables that the lake holds: the files that the manifest vouches for, and no other that lies among them.
fn tables(lake: &Path) -> Result<Vec<Table>, Error> {
    let entries = read_manifest(lake)?;
    let mut tables = Vec::new();
    for name in table_names() {
        let mut keys = vec!["paper".to_owned()];
        let mut files = Vec::new();
        for path in files_of(lake, &entries, name) {
            let below = path.strip_prefix(lake).unwrap_or(&path).to_string_lossy();
            let of_path = lake::path_keys(&below);
            if of_path.experiment.is_some() && keys.len() == 1 && files.is_empty() {
                keys.push("experiment".to_owned());
            }
            let values = [of_path.paper, of_path.experiment];
            let values: Vec<String> = values.into_iter().flatten().map(str::to_owned).collect();
            if values.len() != keys.len() {
                return Err(Error::Refused {
                    what: path.display().to_string(),
                    expected: format!("a path with {} alone", keys.join(" and ")),
                    got: below.into_owned(),
                });
            }
            files.push(File { path, keys: values });
        }
        // Paths have another order, with `lpv-delta/` before `lpv/`; rows in the order of their keys need no sort by them.
        files.sort_by(|a, b| (&a.keys, &a.path).cmp(&(&b.keys, &b.path)));
        if !files.is_empty() {
            tables.push(Table {
                name: name.to_owned(),
                keys,
                files,
            });
        }
    }
    Ok(tables)
}

fn failure(fault: Fault, tables: &[Table]) -> Error {
    match fault {
        Fault::File { path, message } => Error::Table { path, message },
        Fault::Output(e) => Error::io("write to", Path::new("the standard output"), e),
        Fault::Statement(message) => {
            let names: Vec<&str> = tables.iter().map(|t| t.name.as_str()).collect();
            Error::Query {
                message,
                tables: names.join(", "),
            }
        }
    }
}

/// The result of a query.
pub fn run(lake: &Path, statement: &str) -> Result<Answer, Error> {
    let tables = tables(lake)?;
    sql::run(tables.clone(), statement).map_err(|fault| failure(fault, &tables))
}

/// The result of a query as text.
pub fn text(lake: &Path, statement: &str, format: Format) -> Result<String, Error> {
    let mut text = Vec::new();
    write(lake, statement, format, &mut text)?;
    Ok(String::from_utf8(text).expect("what is printed is UTF-8"))
}

/// Writes the result of a query as it comes. A reader who has seen enough (`zonobench query … | head`) is no error.
pub fn write(
    lake: &Path,
    statement: &str,
    format: Format,
    out: &mut (dyn Write + Send),
) -> Result<(), Error> {
    let tables = tables(lake)?;
    match sql::print(tables.clone(), statement, format, out) {
        Err(Fault::Output(e)) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|fault| failure(fault, &tables)),
    }
}

/// One whole table of the lake; None where the lake has no file of it.
pub fn table(lake: &Path, name: &str) -> Result<Option<Answer>, Error> {
    let tables = tables(lake)?;
    if !tables.iter().any(|t| t.name == name) {
        return Ok(None);
    }
    let answer = sql::run(tables.clone(), &format!("SELECT * FROM {name}"));
    answer.map(Some).map_err(|fault| failure(fault, &tables))
}
