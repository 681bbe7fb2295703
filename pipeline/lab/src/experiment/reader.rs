//! Typed access to the tree: every refusal names the key, what was expected, and what came.

use super::tree::{Entry, Node, Source, Value};
use std::ops::Range;
use zonobench_lake::bad_input::{BadInput, brief, listed, nearest, shortened, shown};
use zonobench_sets::Matrix;

/// A table whose keys have been checked.
#[derive(Clone, Debug)]
pub struct Table<'a> {
    source: &'a Source,
    path: String,
    node: &'a Node,
    /// Whether its keys are known to be right.
    checked: bool,
}

/// A value under a key.
#[derive(Clone, Debug)]
pub struct Field<'a> {
    source: &'a Source,
    path: String,
    node: &'a Node,
}

impl<'a> Table<'a> {
    /// `node` as a table at `path`, all of whose keys are among `keys`.
    pub fn new(
        source: &'a Source,
        path: String,
        node: &'a Node,
        keys: &[&str],
    ) -> Result<Self, BadInput> {
        if !matches!(node.value, Value::Table(_)) {
            let message = format!("{path}: expected a table, got {}", node.describe(source));
            return Err(source.fault(&node.span, message));
        }
        let table = Self {
            source,
            path,
            node,
            checked: true,
        };
        table.only(keys)?;
        Ok(table)
    }

    /// Refuses keys that are not among `keys`.
    pub fn only(&self, keys: &[&str]) -> Result<(), BadInput> {
        match self
            .node
            .entries()
            .iter()
            .find(|entry| !keys.contains(&entry.key.as_str()))
        {
            None => Ok(()),
            Some(entry) => {
                let place = if self.path.is_empty() {
                    String::new()
                } else {
                    format!(" in {}", self.path)
                };
                let expected = match keys {
                    [] => "no key".into(),
                    keys => listed(keys.iter().copied()),
                };
                let message = format!(
                    "{}: unknown key{place}: expected {expected}, got {}",
                    self.at(&entry.key),
                    shown(&entry.key)
                );
                let fault = self.source.fault(&entry.key_span, message);
                Err(match nearest(&entry.key, keys.iter().copied()) {
                    Some(near) => fault.with_help(format!("did you mean {near:?}?")),
                    None => fault,
                })
            }
        }
    }

    fn at(&self, key: &str) -> String {
        let key = shortened(key);
        match self.path.as_str() {
            "" => key,
            path => format!("{path}.{key}"),
        }
    }

    /// The value of `key`.
    pub fn get(&self, key: &str) -> Option<Field<'a>> {
        let entry: &Entry = self.node.get(key)?;
        Some(Field {
            source: self.source,
            path: self.at(key),
            node: &entry.node,
        })
    }

    /// The value of `key`, which must be there; `expected` says what it is. Where a key that nobody has looked at yet
    /// is much like it, that one is shown.
    pub fn need(&self, key: &str, expected: &str) -> Result<Field<'a>, BadInput> {
        self.get(key).ok_or_else(|| {
            let message = format!("{}: expected {expected}, got nothing", self.at(key));
            let mut entries = self.node.entries().iter().filter(|_| !self.checked);
            match entries.find(|entry| nearest(&entry.key, [key]).is_some()) {
                None => self.source.fault(&self.node.span, message),
                Some(near) => self
                    .source
                    .fault(
                        &near.key_span,
                        format!("{message} by that name but {}", shown(&near.key)),
                    )
                    .with_help(format!("did you mean {key:?}?")),
            }
        })
    }

    /// A fault of `key`, at its value if it is there, else at the table.
    pub fn fault(&self, key: &str, fault: impl std::fmt::Display) -> BadInput {
        let span = self
            .node
            .get(key)
            .map_or(&self.node.span, |entry| &entry.node.span);
        self.source
            .fault(span, format!("{}: {fault}", self.at(key)))
    }

    /// A fault at `span`, with a message that names its key itself.
    pub fn fault_at(&self, span: &Range<usize>, message: impl Into<String>) -> BadInput {
        self.source.fault(span, message)
    }

    /// The keys that are there.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.node.entries().iter().map(|entry| entry.key.as_str())
    }

    /// The keys that are there with their values, in order.
    pub fn fields(&self) -> impl Iterator<Item = (&'a str, Field<'a>)> {
        self.node.entries().iter().map(|entry| {
            let field = Field {
                source: self.source,
                path: self.at(&entry.key),
                node: &entry.node,
            };
            (entry.key.as_str(), field)
        })
    }

    /// The same table under another path in messages: `estimator.czmv` for `estimator[2]`.
    pub fn renamed(self, path: String) -> Self {
        Self { path, ..self }
    }

    /// Where the table stands.
    pub fn span(&self) -> &'a Range<usize> {
        &self.node.span
    }

    /// The dotted path of the table.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The tree under it.
    pub fn node(&self) -> &'a Node {
        self.node
    }
}

impl<'a> Field<'a> {
    /// "`path`: expected …, got …" at this value.
    pub fn expected(&self, expected: impl std::fmt::Display) -> BadInput {
        self.fault(format!("expected {expected}, got {}", self.describe()))
    }

    /// What the value is, for "got …".
    pub fn describe(&self) -> String {
        self.node.describe(self.source)
    }

    /// A fault at this value.
    pub fn fault(&self, fault: impl std::fmt::Display) -> BadInput {
        self.source
            .fault(&self.node.span, format!("{}: {fault}", self.path))
    }

    /// A fault in the bytes `range` of this string, or at the whole of it where it stands in the file in another form.
    pub fn fault_within(&self, range: Range<usize>, fault: impl std::fmt::Display) -> BadInput {
        let whole = &self.node.span;
        let place = match (&self.node.value, self.source.text.get(whole.clone())) {
            (Value::String(text), Some(written)) => written.find(text.as_str()).map(|offset| {
                let start = whole.start + offset;
                start + range.start..start + range.end.max(range.start + 1).min(text.len().max(1))
            }),
            _ => None,
        };
        let place = place.unwrap_or_else(|| whole.clone());
        self.source.fault(&place, format!("{}: {fault}", self.path))
    }

    /// A string.
    pub fn string(&self) -> Result<&'a str, BadInput> {
        match &self.node.value {
            Value::String(text) => Ok(text),
            _ => Err(self.expected("a string")),
        }
    }

    /// One of `names`, with a suggestion where it is none of them.
    pub fn one_of<'n>(&self, names: &[&'n str]) -> Result<&'n str, BadInput> {
        let text = self.string()?;
        names
            .iter()
            .copied()
            .find(|name| *name == text)
            .ok_or_else(|| {
                let fault = self.expected(listed(names.iter().copied()));
                match nearest(text, names.iter().copied()) {
                    Some(near) => fault.with_help(format!("did you mean {near:?}?")),
                    None => fault,
                }
            })
    }

    /// A boolean.
    pub fn boolean(&self) -> Result<bool, BadInput> {
        match self.node.value {
            Value::Boolean(b) => Ok(b),
            _ => Err(self.expected("true or false")),
        }
    }

    /// A finite number.
    pub fn number(&self) -> Result<f64, BadInput> {
        match self.node.value {
            Value::Float(x) => Ok(x),
            Value::Integer(i) => Ok(i as f64),
            _ => Err(self.expected("a number")),
        }
    }

    /// An integer in `range`; `expected` describes it.
    pub fn integer(
        &self,
        range: std::ops::RangeInclusive<i64>,
        expected: &str,
    ) -> Result<i64, BadInput> {
        match self.node.value {
            Value::Integer(i) if range.contains(&i) => Ok(i),
            Value::Float(_) => {
                let got = self.describe();
                Err(self.fault(format!("expected {expected}, got {got} (a float)")))
            }
            _ => Err(self.expected(expected)),
        }
    }

    /// A step number.
    pub fn step(&self) -> Result<usize, BadInput> {
        Ok(self.integer(0..=i64::from(i32::MAX), "a step, 0 or more")? as usize)
    }

    /// The elements of an array.
    pub fn array(&self, expected: &str) -> Result<Vec<Field<'a>>, BadInput> {
        match &self.node.value {
            Value::Array(items) => Ok(items
                .iter()
                .enumerate()
                .map(|(i, node)| Field {
                    source: self.source,
                    path: format!("{}[{}]", self.path, i + 1),
                    node,
                })
                .collect()),
            _ => Err(self.expected(expected)),
        }
    }

    /// A vector, of length `n` where that is known.
    pub fn vector(&self, n: Option<usize>) -> Result<Vec<f64>, BadInput> {
        let expected = match n {
            Some(n) => format!("an array of {n} numbers"),
            None => "an array of numbers".into(),
        };
        let items = self.array(&expected)?;
        if n.is_some_and(|n| items.len() != n) {
            return Err(self.expected(expected));
        }
        items.iter().map(Field::number).collect()
    }

    /// A matrix given by its rows. An empty array is a matrix of `rows` rows and no columns, where the
    /// number of rows is known.
    pub fn matrix(&self, rows: Option<usize>, columns: Option<usize>) -> Result<Matrix, BadInput> {
        let expected = match (rows, columns) {
            (Some(rows), Some(columns)) => format!("{rows} rows of {columns} numbers"),
            (Some(rows), None) => format!("{rows} rows of numbers"),
            (None, Some(columns)) => format!("rows of {columns} numbers"),
            (None, None) => "rows of numbers".into(),
        };
        let items = self.array(&expected)?;
        if items.is_empty() && columns.is_none_or(|columns| columns == 0) {
            return Ok(Matrix::zeros(rows.unwrap_or(0), 0));
        }
        if rows.is_some_and(|rows| items.len() != rows) {
            let got = if items.len() == 1 {
                "1 row".into()
            } else {
                format!("{} rows", items.len())
            };
            return Err(self.fault(format!("expected {expected}, got {got}")));
        }
        let mut data: Vec<Vec<f64>> = Vec::with_capacity(items.len());
        for row in &items {
            let width = columns.or(data.first().map(Vec::len));
            data.push(row.vector(width)?);
        }
        Matrix::from_rows(&data).map_err(|error| self.fault(error))
    }

    /// A table with these keys.
    pub fn table(&self, keys: &[&str]) -> Result<Table<'a>, BadInput> {
        Table::new(self.source, self.path.clone(), self.node, keys)
    }

    /// A table with any keys, to be checked once its kind is known.
    pub fn any_table(&self) -> Result<Table<'a>, BadInput> {
        match self.node.value {
            Value::Table(_) => Ok(Table {
                source: self.source,
                path: self.path.clone(),
                node: self.node,
                checked: false,
            }),
            _ => Err(self.expected("a table")),
        }
    }

    /// True if the value is a table.
    pub fn is_table(&self) -> bool {
        matches!(self.node.value, Value::Table(_))
    }

    /// True if the value is an array.
    pub fn is_array(&self) -> bool {
        matches!(self.node.value, Value::Array(_))
    }

    /// True if the value is a string.
    pub fn is_string(&self) -> bool {
        matches!(self.node.value, Value::String(_))
    }
}

/// Reads `table`, without `kind` or the keys in `besides`, as the type that `kind` names in its serde
/// form, and points at the key that is to blame where it does not fit.
///
/// serde does not say which key was wrong. It is found by leaving keys out one by one: without the
/// culprit, the complaint is another one.
pub fn deserialize<T: serde::de::DeserializeOwned>(
    table: &Table,
    besides: &[&str],
) -> Result<T, BadInput> {
    let mut object = serde_json::Map::new();
    for entry in table.node.entries() {
        if !besides.contains(&entry.key.as_str()) {
            object.insert(entry.key.clone(), entry.node.to_json());
        }
    }
    let read = |object: &serde_json::Map<String, serde_json::Value>| {
        serde_json::from_value::<T>(serde_json::Value::Object(object.clone()))
            .map_err(|error| error.to_string())
    };
    read(&object).map_err(|complaint| {
        let culprit = object
            .keys()
            .filter(|key| *key != "kind" && *key != "law")
            .find(|key| {
                let mut without = object.clone();
                without.remove(*key);
                !read(&without).is_err_and(|other| other == complaint)
            });
        // "missing field `phi`" names its key itself, and every key left out adds a missing one.
        let missing = complaint
            .strip_prefix("missing field `")
            .and_then(|rest| rest.split('`').next());
        match (missing, culprit) {
            (Some(key), _) => table.fault(key, "expected a value, got nothing"),
            (None, Some(key)) => table
                .get(key)
                .map_or_else(|| table.fault(key, &complaint), |f| misread(&f, &complaint)),
            (None, None) => table.source.fault(
                &table.node.span,
                format!("{}: {}", table.path, brief(&complaint)),
            ),
        }
    })
}

/// serde's "invalid type: string "x", expected usize" as "expected an integer of at least 0, got "x"", at the value.
fn misread(field: &Field, complaint: &str) -> BadInput {
    let parts = ["invalid type: ", "invalid value: ", "unknown variant "]
        .iter()
        .find_map(|prefix| complaint.strip_prefix(prefix))
        .and_then(|rest| rest.rsplit_once(", expected "));
    let Some((got, expected)) = parts else {
        return field.fault(brief(complaint));
    };
    // Inside of an array or a table, only serde knows which value it was.
    let got = match field.node.value {
        Value::Array(_) | Value::Table(_) => match got {
            "map" => "a table".to_owned(),
            "sequence" => "an array".to_owned(),
            got => {
                let kinds = ["integer ", "floating point ", "boolean ", "string "];
                let bare = kinds.iter().find_map(|kind| got.strip_prefix(kind));
                shortened(&bare.unwrap_or(got).replace('`', ""))
            }
        },
        Value::Float(_) if matches!(expected, "usize" | "u64" | "u32") => {
            format!("{} (a float)", field.describe())
        }
        _ => field.describe(),
    };
    let names: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
    let expected = match expected {
        "usize" | "u64" | "u32" => "an integer of at least 0".to_owned(),
        "f64" => "a number".to_owned(),
        "a boolean" => "true or false".to_owned(),
        other => other.replace('`', "\""),
    };
    let fault = field.fault(format!("expected {expected}, got {got}"));
    let meant = match &field.node.value {
        Value::String(text) => nearest(text, names),
        _ => None,
    };
    match meant {
        Some(near) => fault.with_help(format!("did you mean {near:?}?")),
        None => fault,
    }
}
