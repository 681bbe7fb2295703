//! What can go wrong with a query, in plain words.

use datafusion::common::{Column, DataFusionError, SchemaError};
use std::path::PathBuf;
use zonobench_lake::bad_input::shortened;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The statement: not SQL, of a kind that is not allowed, or of names and types that do not fit.
    #[error("{0}")]
    Statement(String),
    /// A file of a table cannot be read.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// The answer cannot be written to where it should go.
    #[error("cannot write: {0}")]
    Output(#[from] std::io::Error),
}

/// Names in a message: no more than a reader looks at.
const NAMES: usize = 40;

impl Fault {
    /// A statement that is refused.
    pub(crate) fn statement(message: impl Into<String>) -> Self {
        Self::Statement(brief(&message.into()))
    }

    /// What DataFusion says, in our words where we have some.
    pub(crate) fn of(error: DataFusionError) -> Self {
        match error {
            DataFusionError::External(inner) => match inner.downcast::<Self>() {
                Ok(fault) => *fault,
                Err(other) => Self::statement(other.to_string()),
            },
            DataFusionError::Context(_, inner) | DataFusionError::Diagnostic(_, inner) => {
                Self::of(*inner)
            }
            DataFusionError::Collection(mut all) if !all.is_empty() => Self::of(all.swap_remove(0)),
            DataFusionError::Shared(inner) => Self::statement(words(&inner)),
            DataFusionError::ArrowError(inner, _) => match *inner {
                datafusion::arrow::error::ArrowError::ExternalError(inner) => {
                    match inner.downcast::<DataFusionError>() {
                        Ok(inner) => Self::of(*inner),
                        Err(other) => Self::statement(other.to_string()),
                    }
                }
                other => Self::statement(other.to_string()),
            },
            other => Self::statement(words(&other)),
        }
    }
}

/// The message, of whose words a very long one, such as a name of the statement, is not repeated whole.
fn brief(message: &str) -> String {
    let words = message.split(' ').map(shortened);
    words.collect::<Vec<_>>().join(" ")
}

fn words(error: &DataFusionError) -> String {
    match error {
        DataFusionError::SQL(parse, _) => {
            let text = parse.to_string();
            let text = text.strip_prefix("sql parser error: ").unwrap_or(&text);
            format!("not SQL: {text}")
        }
        DataFusionError::SchemaError(schema, _) => names(schema),
        DataFusionError::Plan(text)
        | DataFusionError::Execution(text)
        | DataFusionError::Configuration(text) => first_line(text),
        DataFusionError::NotImplemented(text) => {
            format!("not supported: {}", first_line(text))
        }
        DataFusionError::ResourcesExhausted(_) => format!(
            "the statement needs more than the {} MB that a query may use; ask for less of it (WHERE, LIMIT, GROUP BY)",
            crate::sql::session::MEMORY >> 20
        ),
        DataFusionError::Internal(text) => match clock(text) {
            Some(function) => {
                format!("{function} is refused: a query gives the same rows whenever it is asked")
            }
            None => format!("this statement cannot be planned: {}", first_line(text)),
        },
        DataFusionError::Context(_, inner) | DataFusionError::Diagnostic(_, inner) => words(inner),
        DataFusionError::Shared(inner) => words(inner),
        other => other.strip_backtrace(),
    }
}

/// The function of the time of day that DataFusion says it cannot call: it puts a constant in its place before, if it is
/// given a clock.
fn clock(text: &str) -> Option<&str> {
    let (_, rest) = text.split_once("should not be called on a simplified ")?;
    rest.split_once(" function").map(|(name, _)| name)
}

fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or(text).to_owned()
}

fn names(error: &SchemaError) -> String {
    match error {
        SchemaError::FieldNotFound {
            field,
            valid_fields,
        } => missing_column(field, valid_fields),
        SchemaError::AmbiguousReference { field } => {
            format!(
                "the column `{}` is in more than one table; write `table.{}`",
                field.flat_name(),
                field.name()
            )
        }
        SchemaError::DuplicateQualifiedField { name, .. }
        | SchemaError::DuplicateUnqualifiedField { name } => {
            format!("two columns are called `{name}`; give one another name with AS")
        }
    }
}

/// No such column: the nearest that there is, and all of them.
fn missing_column(field: &Column, valid: &[Column]) -> String {
    let known: Vec<String> = valid.iter().map(|c| c.name().to_owned()).collect();
    let mut message = format!("no column `{}`", field.flat_name());
    if let Some(relation) = &field.relation
        && !valid.iter().any(|c| c.relation.as_ref() == Some(relation))
        && valid.iter().any(|c| c.name() == field.name())
    {
        let tables: Vec<String> = valid
            .iter()
            .filter_map(|c| c.relation.as_ref().map(ToString::to_string))
            .collect();
        return format!("{message}: no table `{relation}` here{}", list(&tables));
    }
    if let Some(nearest) = nearest(field.name(), known.iter().map(String::as_str)) {
        message += &format!("; did you mean `{nearest}`?");
    }
    message + &list(&known)
}

fn list(names: &[String]) -> String {
    let mut unique: Vec<&str> = Vec::new();
    for name in names {
        if !unique.contains(&name.as_str()) {
            unique.push(name);
        }
    }
    let more = if unique.len() > NAMES { ", …" } else { "" };
    unique.truncate(NAMES);
    if unique.is_empty() {
        String::new()
    } else {
        format!(" (there are: {}{more})", unique.join(", "))
    }
}

/// No such table: the nearest that there is.
pub(crate) fn missing_table(name: &str, known: &[&str]) -> Fault {
    let mut message = format!("no table `{name}`");
    if let Some(nearest) = nearest(name, known.iter().copied()) {
        message += &format!("; did you mean `{nearest}`?");
    }
    Fault::statement(message)
}

/// The name most like `name`, if one is like it.
fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    known
        .map(|k| (strsim::jaro_winkler(&name, &k.to_lowercase()), k))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k)
}
