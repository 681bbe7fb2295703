//! What a query gives: columns, rows, and values that print as they should.

use datafusion::arrow::array::cast::AsArray;
use datafusion::arrow::array::{Array, ArrayRef, RecordBatch};
use datafusion::arrow::datatypes::{
    DataType, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, SchemaRef,
    UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use datafusion::arrow::util::display::array_value_to_string;
use std::borrow::Cow;

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    /// Missing
    Null,
    /// A boolean
    Boolean(bool),
    /// An integer
    Integer(i64),
    /// A floating-point number
    Float(f64),
    /// A text
    Text(Cow<'a, str>),
    /// A list
    List(Vec<Value<'a>>),
}

impl Value<'_> {
    /// As text: empty for a missing value, numbers in the shortest form that reads back to the same number.
    pub fn text(&self) -> Cow<'_, str> {
        match self {
            Self::Null => Cow::Borrowed(""),
            Self::Boolean(b) => Cow::Borrowed(if *b { "true" } else { "false" }),
            Self::Integer(i) => Cow::Owned(i.to_string()),
            Self::Float(x) => Cow::Owned(shortest(*x)),
            Self::Text(s) => Cow::Borrowed(s),
            Self::List(items) => {
                let items: Vec<Cow<str>> = items.iter().map(Value::text).collect();
                Cow::Owned(format!("[{}]", items.join(", ")))
            }
        }
    }

    /// As JSON, which has no infinity: that is a string there.
    pub fn json(&self) -> serde_json::Value {
        match self {
            Self::Null => serde_json::Value::Null,
            Self::Boolean(b) => (*b).into(),
            Self::Integer(i) => (*i).into(),
            Self::Float(x) if x.is_finite() => (*x).into(),
            Self::Float(x) => shortest(*x).into(),
            Self::Text(s) => s.as_ref().into(),
            Self::List(items) => items.iter().map(Value::json).collect::<Vec<_>>().into(),
        }
    }

    /// As a number, where it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(i) => Some(*i as f64),
            Self::Float(x) => Some(*x),
            _ => None,
        }
    }
}

/// The shortest text that reads back to the same number: `1`, `0.001`, `1e-300`, `1.7e308`.
fn shortest(x: f64) -> String {
    if !x.is_finite() {
        return if x.is_nan() {
            "NaN".to_owned()
        } else {
            x.to_string()
        };
    }
    let text = serde_json::Value::from(x).to_string();
    text.strip_suffix(".0").unwrap_or(&text).replace("e+", "e")
}

/// Rows with named columns.
#[derive(Clone, Debug)]
pub struct Answer {
    columns: Vec<String>,
    batches: Vec<RecordBatch>,
}

impl Answer {
    pub(crate) fn new(schema: &SchemaRef, batches: Vec<RecordBatch>) -> Self {
        Self {
            columns: column_names(schema),
            batches,
        }
    }

    /// The columns' names, each once.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The number of rows.
    pub fn len(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }

    /// True if there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rows, in order.
    pub fn rows(&self) -> impl Iterator<Item = Vec<Value<'_>>> {
        self.batches.iter().flat_map(|batch| {
            (0..batch.num_rows()).map(|row| batch.columns().iter().map(|c| value(c, row)).collect())
        })
    }

    /// The value of a column in a row; None if there is no such column or row.
    pub fn value(&self, column: &str, mut row: usize) -> Option<Value<'_>> {
        let i = self.columns.iter().position(|c| c == column)?;
        for batch in &self.batches {
            if row < batch.num_rows() {
                return Some(value(batch.column(i), row));
            }
            row -= batch.num_rows();
        }
        None
    }
}

/// The names of columns; one that was there before gets a number: `k`, `k_1`.
fn column_names(schema: &SchemaRef) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for field in schema.fields() {
        let mut name = field.name().clone();
        let mut n = 0;
        while names.contains(&name) {
            n += 1;
            name = format!("{}_{n}", field.name());
        }
        names.push(name);
    }
    names
}

fn value(array: &ArrayRef, row: usize) -> Value<'_> {
    if array.is_null(row) {
        return Value::Null;
    }
    match array.data_type() {
        DataType::Null => Value::Null,
        DataType::Boolean => Value::Boolean(array.as_boolean().value(row)),
        DataType::Int8 => Value::Integer(array.as_primitive::<Int8Type>().value(row).into()),
        DataType::Int16 => Value::Integer(array.as_primitive::<Int16Type>().value(row).into()),
        DataType::Int32 => Value::Integer(array.as_primitive::<Int32Type>().value(row).into()),
        DataType::Int64 => Value::Integer(array.as_primitive::<Int64Type>().value(row)),
        DataType::UInt8 => Value::Integer(array.as_primitive::<UInt8Type>().value(row).into()),
        DataType::UInt16 => Value::Integer(array.as_primitive::<UInt16Type>().value(row).into()),
        DataType::UInt32 => Value::Integer(array.as_primitive::<UInt32Type>().value(row).into()),
        DataType::UInt64 => {
            let n = array.as_primitive::<UInt64Type>().value(row);
            i64::try_from(n).map_or_else(|_| Value::Text(n.to_string().into()), Value::Integer)
        }
        DataType::Float32 => Value::Float(array.as_primitive::<Float32Type>().value(row).into()),
        DataType::Float64 => Value::Float(array.as_primitive::<Float64Type>().value(row)),
        DataType::Utf8 => Value::Text(array.as_string::<i32>().value(row).into()),
        DataType::LargeUtf8 => Value::Text(array.as_string::<i64>().value(row).into()),
        DataType::Utf8View => Value::Text(array.as_string_view().value(row).into()),
        DataType::List(_) => items(&array.as_list::<i32>().value(row)),
        DataType::LargeList(_) => items(&array.as_list::<i64>().value(row)),
        DataType::FixedSizeList(_, _) => items(&array.as_fixed_size_list().value(row)),
        _ => Value::Text(array_value_to_string(array, row).unwrap_or_default().into()),
    }
}

fn items(list: &ArrayRef) -> Value<'static> {
    Value::List((0..list.len()).map(|i| owned(value(list, i))).collect())
}

fn owned(value: Value<'_>) -> Value<'static> {
    match value {
        Value::Null => Value::Null,
        Value::Boolean(b) => Value::Boolean(b),
        Value::Integer(i) => Value::Integer(i),
        Value::Float(x) => Value::Float(x),
        Value::Text(s) => Value::Text(Cow::Owned(s.into_owned())),
        Value::List(items) => Value::List(items.into_iter().map(owned).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_prints_in_its_shortest_form() {
        let texts = [
            (1.0, "1"),
            (0.001, "0.001"),
            (1e-300, "1e-300"),
            (1.7e308, "1.7e308"),
            (-2.5, "-2.5"),
            (0.1 + 0.2, "0.30000000000000004"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
            (f64::NAN, "NaN"),
        ];
        for (x, text) in texts {
            assert_eq!(shortest(x), text);
            assert!(x.is_nan() || text.parse::<f64>() == Ok(x));
        }
    }
}
