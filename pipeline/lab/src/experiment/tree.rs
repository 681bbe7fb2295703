//! A TOML document as a tree whose every value knows its place in the text.
//!
//! Sweeps and cases change the tree before anything is read from it, so that a value is checked where
//! it is used and an error still points at the line where it was written.

use std::ops::Range;
use toml::de::{DeTable, DeValue};
use zonobench_lake::bad_input::{BadInput, brief, listed, nearest, shortened, shown};

/// A document's name and text.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file's name, as shown in errors.
    pub file: String,
    /// Its content.
    pub text: String,
}

impl Source {
    /// A fault at `span`.
    pub fn fault(&self, span: &Range<usize>, message: impl Into<String>) -> BadInput {
        BadInput::span(&self.file, &self.text, span.clone(), message)
    }
}

/// A float that is written longer is shown as Rust writes it.
const LONGEST_NUMBER: usize = 30;

/// A value and its place.
#[derive(Clone, Debug)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// Its bytes in the text.
    pub span: Range<usize>,
}

/// A TOML value; dates are refused, because nothing here has one.
#[derive(Clone, Debug)]
pub enum Value {
    /// A string.
    String(String),
    /// An integer.
    Integer(i64),
    /// A finite float.
    Float(f64),
    /// A boolean.
    Boolean(bool),
    /// An array.
    Array(Vec<Node>),
    /// A table, in the order of the text.
    Table(Vec<Entry>),
}

/// A key and its value.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Its bytes in the text.
    pub key_span: Range<usize>,
    /// The value.
    pub node: Node,
}

impl Node {
    /// Parses a document. Fails on a syntax error, a number that is NaN, infinite or out of range, and
    /// a date.
    pub fn parse(source: &Source) -> Result<Node, BadInput> {
        let document = DeTable::parse(&source.text).map_err(|error| {
            let message = error.message().lines().collect::<Vec<_>>().join("; ");
            source.fault(&error.span().unwrap_or(0..0), brief(&message))
        })?;
        let span = document.span();
        table(source, document.into_inner(), span, "")
    }

    /// The entries of a table; none of anything else.
    pub fn entries(&self) -> &[Entry] {
        match &self.value {
            Value::Table(entries) => entries,
            _ => &[],
        }
    }

    /// The value of `key` in a table.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|entry| entry.key == key)
    }

    /// Takes the value of `key` out of a table.
    pub fn take(&mut self, key: &str) -> Option<Entry> {
        match &mut self.value {
            Value::Table(entries) => {
                let at = entries.iter().position(|entry| entry.key == key)?;
                Some(entries.remove(at))
            }
            _ => None,
        }
    }

    /// What the value is, for "got …"; a float as it is written in `source`, so that it is seen to be one.
    pub fn describe(&self, source: &Source) -> String {
        match &self.value {
            Value::String(text) => shown(text),
            Value::Integer(i) => i.to_string(),
            Value::Float(x) => {
                let written = source.text.get(self.span.clone()).unwrap_or_default();
                match written.len() < LONGEST_NUMBER && written.parse() == Ok(*x) {
                    true => written.to_owned(),
                    false => format!("{x:?}"),
                }
            }
            Value::Boolean(b) => b.to_string(),
            Value::Array(items) if items.len() == 1 => "an array of 1 value".into(),
            Value::Array(items) => format!("an array of {} values", items.len()),
            Value::Table(_) => "a table".into(),
        }
    }

    /// The same value as JSON, for types that read themselves.
    pub fn to_json(&self) -> serde_json::Value {
        match &self.value {
            Value::String(text) => text.as_str().into(),
            Value::Integer(i) => (*i).into(),
            Value::Float(x) => (*x).into(),
            Value::Boolean(b) => (*b).into(),
            Value::Array(items) => items.iter().map(Node::to_json).collect(),
            Value::Table(entries) => {
                let pairs = entries
                    .iter()
                    .map(|entry| (entry.key.clone(), entry.node.to_json()));
                serde_json::Value::Object(pairs.collect())
            }
        }
    }

    /// Puts `new` where `path` leads, making tables that are missing on the way.
    ///
    /// In an array of tables (`estimator`, `metric`) a step is the `id` of one of them, or its `name`
    /// where it has no `id`. `place` is where the path stands in the text.
    pub fn set(
        &mut self,
        source: &Source,
        path: &[&str],
        new: Node,
        place: &Range<usize>,
    ) -> Result<(), BadInput> {
        let full = shortened(&path.join("."));
        let mut here = self;
        for (i, step) in path.iter().enumerate() {
            let walked = shortened(&path[..i].join("."));
            let found = here.describe(source);
            here = match &mut here.value {
                Value::Table(entries) => {
                    let at = match entries.iter().position(|entry| entry.key == *step) {
                        Some(at) => at,
                        None => {
                            let empty = Node {
                                value: Value::Table(Vec::new()),
                                span: place.clone(),
                            };
                            entries.push(Entry {
                                key: (*step).into(),
                                key_span: place.clone(),
                                node: empty,
                            });
                            entries.len() - 1
                        }
                    };
                    &mut entries[at].node
                }
                Value::Array(items) => {
                    let names: Vec<&str> = items.iter().filter_map(Node::name).collect();
                    match items.iter().position(|item| item.name() == Some(step)) {
                        Some(at) => &mut items[at],
                        None => {
                            let message = format!(
                                "{full}: expected an id of {walked} ({}), got {}",
                                listed(names.iter().copied()),
                                shown(step)
                            );
                            let fault = source.fault(place, message);
                            return Err(match nearest(step, names) {
                                Some(near) => fault.with_help(format!("did you mean {near:?}?")),
                                None => fault,
                            });
                        }
                    }
                }
                _ => {
                    let message = format!("{full}: expected {walked} to be a table, got {found}");
                    return Err(source.fault(place, message));
                }
            };
        }
        *here = new;
        Ok(())
    }

    /// The `id` of a table, or its `name`.
    fn name(&self) -> Option<&str> {
        let entry = self.get("id").or_else(|| self.get("name"))?;
        match &entry.node.value {
            Value::String(text) => Some(text),
            _ => None,
        }
    }
}

fn table(
    source: &Source,
    table: DeTable,
    span: Range<usize>,
    path: &str,
) -> Result<Node, BadInput> {
    let mut entries = Vec::with_capacity(table.len());
    for (key, value) in table {
        let (key_span, key) = (key.span(), key.into_inner().into_owned());
        let path = match path {
            "" => shortened(&key),
            path => format!("{path}.{}", shortened(&key)),
        };
        let value_span = value.span();
        let node = node(source, value.into_inner(), value_span, &path)?;
        entries.push(Entry {
            key,
            key_span,
            node,
        });
    }
    // The parser sorts keys by name; a sweep runs in the order of the text.
    entries.sort_by_key(|entry| entry.key_span.start);
    Ok(Node {
        value: Value::Table(entries),
        span,
    })
}

fn node(source: &Source, value: DeValue, span: Range<usize>, path: &str) -> Result<Node, BadInput> {
    let value = match value {
        DeValue::String(text) => Value::String(text.into_owned()),
        DeValue::Boolean(b) => Value::Boolean(b),
        DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(i) => Value::Integer(i),
            Err(_) => {
                let got = shortened(integer.as_str());
                let message = format!("{path}: expected an integer of at most 63 bits, got {got}");
                return Err(source.fault(&span, message));
            }
        },
        DeValue::Float(float) => match float.as_str().parse::<f64>() {
            Ok(x) if x.is_finite() => Value::Float(x),
            _ => {
                let got = shortened(float.as_str());
                let message = format!("{path}: expected a finite number, got {got}");
                return Err(source.fault(&span, message));
            }
        },
        DeValue::Datetime(date) => {
            let message = format!(
                "{path}: expected a number, a string, an array or a table, got the date {date}"
            );
            return Err(source.fault(&span, message));
        }
        DeValue::Array(items) => {
            let items = items.into_iter().enumerate().map(|(i, item)| {
                let item_span = item.span();
                node(
                    source,
                    item.into_inner(),
                    item_span,
                    &format!("{path}[{}]", i + 1),
                )
            });
            Value::Array(items.collect::<Result<_, _>>()?)
        }
        DeValue::Table(entries) => return table(source, entries, span, path),
    };
    Ok(Node { value, span })
}
