//! Rows of a CSV file that is kept in the repository beside the pages.

use crate::error::Error;
use serde::de::DeserializeOwned;
use std::path::Path;

/// The rows of `path`, none if there is no such file.
///
/// Fails, with the file and the line, where it cannot be read or a row is none.
pub fn read_kept<Row: DeserializeOwned>(path: &Path) -> Result<Vec<Row>, Error> {
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(Error::io("read", path, e)),
    };
    csv::Reader::from_reader(text.as_slice())
        .deserialize()
        .map(|row| {
            row.map_err(|source| Error::CsvSyntax {
                file: path.display().to_string(),
                source,
            })
        })
        .collect()
}
