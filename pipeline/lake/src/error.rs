//! The pipeline's errors. Each names what was being done, to what, and what came instead.

use std::path::{Path, PathBuf};

/// What can go wrong in the pipeline.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum Error {
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A Parquet file cannot be written or read.
    #[error("{}: {source}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// Why.
        source: parquet::errors::ParquetError,
    },
    /// A column would hold NaN.
    #[error("{}: column {column} would hold NaN; null means \"not applicable\"", path.display())]
    NotANumber {
        /// The file being written.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// A file does not have its table's columns.
    #[error("{}: expected columns {expected}; got {got}", path.display())]
    Schema {
        /// The file.
        path: PathBuf,
        /// The table's columns.
        expected: String,
        /// The file's columns.
        got: String,
    },
    /// A JSON file of ours cannot be read or written.
    #[error("{}: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// The manifest of a lake is damaged.
    #[error("{}: expected a manifest, got: {source}", path.display())]
    #[diagnostic(help("`zonobench run` or `zonobench reproduce-all` on this lake writes it anew"))]
    Manifest {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// Another process works on this lake.
    #[error("the lake {} is in use by another zonobench; wait for it, or choose another with --lake", path.display())]
    Locked {
        /// The lake.
        path: PathBuf,
    },
    /// There is no lake yet.
    #[error("no lake at {}", path.display())]
    #[diagnostic(help("run `zonobench reproduce-all` first, or name another lake with --lake"))]
    NoLake {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// A SQL query failed.
    #[error("query: {message}")]
    #[diagnostic(help("table names: {tables}"))]
    Query {
        /// What the engine said.
        message: String,
        /// The tables there are.
        tables: String,
    },
    /// A file of the lake cannot be read.
    #[error("{}: {message}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// A name that does not exist.
    #[error("no {what} `{got}`")]
    #[diagnostic(help("{expected}"))]
    Unknown {
        /// What was named.
        what: &'static str,
        /// The name.
        got: String,
        /// What there is.
        expected: String,
    },
    /// What a command was given does not fit.
    #[error("{what}: expected {expected}, got {got}")]
    Refused {
        /// The argument, or the file and its part.
        what: String,
        /// What fits.
        expected: String,
        /// What came.
        got: String,
    },
    /// A line of one of the project's CSV files is wrong.
    #[error("{file}, line {line}: expected {expected}, got {got}")]
    Csv {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// What was expected.
        expected: String,
        /// What came.
        got: String,
    },
    /// A CSV file cannot be read at all.
    #[error("{file}: {source}")]
    CsvSyntax {
        /// The file.
        file: String,
        /// Why.
        source: csv::Error,
    },
    /// An estimator cannot be made for its problem (one that fails in a run is a row with a status, not this).
    #[error("{experiment}, {estimator}: {source}")]
    Estimator {
        /// The experiment.
        experiment: String,
        /// The estimator.
        estimator: String,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A simulation failed.
    #[error("{experiment}, simulation, run {run}: {source}")]
    Simulation {
        /// The experiment.
        experiment: String,
        /// The run.
        run: usize,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A case of the campaign against the guarantees cannot be run.
    #[error("attack: {0}")]
    Attack(String),
    /// A trace cannot be written.
    #[error("{}: {message}", path.display())]
    Trace {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// A figure cannot be drawn.
    #[error("figure {figure}: {message}")]
    Figure {
        /// Which figure.
        figure: String,
        /// Why.
        message: String,
    },
    /// A user's file is wrong; the diagnostic points at the place.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Input(Box<dyn miette::Diagnostic + Send + Sync>),
}

impl Error {
    /// An I/O error with what was tried and where.
    pub fn io(action: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            action,
            path: path.to_owned(),
            source,
        }
    }

    /// A Parquet error with its file; a full disk below it is shown as the I/O error that it is.
    pub fn parquet(path: &Path, source: parquet::errors::ParquetError) -> Self {
        match source {
            parquet::errors::ParquetError::External(cause) => match cause.downcast() {
                Ok(source) => Self::io("write", path, *source),
                Err(cause) => Self::Parquet {
                    path: path.to_owned(),
                    source: parquet::errors::ParquetError::External(cause),
                },
            },
            source => Self::Parquet {
                path: path.to_owned(),
                source,
            },
        }
    }

    /// A JSON error with its file.
    pub fn json(path: &Path, source: serde_json::Error) -> Self {
        Self::Json {
            path: path.to_owned(),
            source,
        }
    }

    /// The same error without the path of a draft, which is gone when it is read: a refusal of the system names
    /// `folder`, in which the draft lay, and every other error `what` was being made.
    pub fn without_draft(mut self, draft: &Path, folder: &Path, what: &str) -> Self {
        let (path, system) = match &mut self {
            Self::Io { path, .. } => (path, true),
            Self::Parquet { path, .. }
            | Self::NotANumber { path, .. }
            | Self::Schema { path, .. }
            | Self::Json { path, .. }
            | Self::Trace { path, .. } => (path, false),
            _ => return self,
        };
        if let Ok(inner) = path.strip_prefix(draft) {
            let name = inner.file_name().map(PathBuf::from);
            *path = match system {
                true => folder.to_owned(),
                false => Path::new(what).join(name.unwrap_or_default()),
            };
        }
        self
    }

    /// 2 for bad usage or bad input, 1 for everything else.
    pub fn exit_code(&self) -> i32 {
        match self {
            Self::Input(_) | Self::Unknown { .. } | Self::Refused { .. } => 2,
            Self::Query { .. } | Self::NoLake { .. } => 2,
            _ => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_in_a_draft_does_not_name_it() {
        let (draft, lake) = (Path::new("lake/.cache/tmp/3-ab"), Path::new("lake/.cache"));
        let full = || std::io::Error::other("no space left");
        let told = |error: Error| {
            error
                .without_draft(draft, lake, "mine/a/trace/kf")
                .to_string()
        };
        assert_eq!(
            told(Error::io("write", &draft.join("a.parquet"), full())),
            "cannot write lake/.cache: no space left"
        );
        let trace = Error::Trace {
            path: draft.join("trace.mcap"),
            message: "no steps".into(),
        };
        assert_eq!(told(trace), "mine/a/trace/kf/trace.mcap: no steps");
        assert_eq!(
            told(Error::io("open", Path::new("y.csv"), full())),
            "cannot open y.csv: no space left"
        );
    }
}
