//! Sweeps and cases: one document, several experiments.
//!
//! Both change the tree before anything is read from it. Each `[[case]]` gives one experiment with the
//! case's overrides, named `<id>_<case id>`. `[sweep]` gives one experiment for each combination of its
//! values, the last key varying fastest, named `<id>_<key><value>…` by the last part of each key, in the
//! order of the text. With both, every case is swept.
//!
//! An override is a dotted path in quotes, `"estimator.czmv.generators" = 8`, or nested tables; a
//! table inside `estimator.<id>` or `metric.<id>`, or two levels down elsewhere (`truth.w`), replaces
//! the one that was there, unless a dotted path goes further.

use super::tree::{Node, Source, Value};
use std::ops::Range;
use zonobench_lake::bad_input::{BadInput, shortened, shown};

/// The sections in which a nested override walks on to the `id` of an element.
const LISTS: [&str; 2] = ["estimator", "metric"];

/// Keys that a variant cannot change: they say what the file is.
const FIXED: [&str; 5] = ["schema", "paper", "id", "case", "sweep"];

/// The most experiments that one file may give.
const MOST: usize = 10_000;

/// One value for one path.
struct Override {
    path: Vec<String>,
    place: Range<usize>,
    value: Node,
}

/// The documents that `root` stands for, each with the suffix of its id: one without a suffix where
/// there is neither a sweep nor a case.
pub fn variants(source: &Source, mut root: Node) -> Result<Vec<(String, Node)>, BadInput> {
    let sweep = root.take("sweep");
    let cases = root.take("case");
    let mut all = vec![(String::new(), root)];
    if let Some(cases) = cases {
        let Value::Array(cases) = cases.node.value else {
            let message = format!(
                "case: expected [[case]] tables, got {}",
                cases.node.describe(source)
            );
            return Err(source.fault(&cases.node.span, message));
        };
        let (_, base) = all.remove(0);
        for mut case in cases {
            let id = case.take("id").ok_or_else(|| {
                source.fault(&case.span, "case.id: expected a string, got nothing")
            })?;
            let Value::String(name) = &id.node.value else {
                let message = format!(
                    "case.id: expected a string, got {}",
                    id.node.describe(source)
                );
                return Err(source.fault(&id.node.span, message));
            };
            check_suffix(source, "case.id", name, &id.node.span)?;
            let mut variant = base.clone();
            let mut overrides = Vec::new();
            collect(source, case, &mut Vec::new(), &mut overrides)?;
            for change in overrides {
                apply(source, &mut variant, &change)?;
            }
            all.push((format!("_{name}"), variant));
        }
    }
    if let Some(sweep) = sweep {
        for axis in axes(source, sweep.node)? {
            let mut swept = Vec::with_capacity(all.len() * axis.len());
            if all.len().saturating_mul(axis.len()) > MOST {
                let message = format!("sweep: expected at most {MOST} combinations, got more");
                return Err(source.fault(&sweep.key_span, message));
            }
            for (suffix, node) in &all {
                for (part, change) in &axis {
                    let mut variant = node.clone();
                    apply(source, &mut variant, change)?;
                    swept.push((format!("{suffix}_{part}"), variant));
                }
            }
            all = swept;
        }
    }
    Ok(all)
}

fn apply(source: &Source, root: &mut Node, change: &Override) -> Result<(), BadInput> {
    let path: Vec<&str> = change.path.iter().map(String::as_str).collect();
    root.set(source, &path, change.value.clone(), &change.place)
}

/// The overrides in a (nested) table.
fn collect(
    source: &Source,
    table: Node,
    path: &mut Vec<String>,
    into: &mut Vec<Override>,
) -> Result<(), BadInput> {
    let Value::Table(entries) = table.value else {
        let message = format!(
            "{}: expected a table, got {}",
            shortened(&path.join(".")),
            table.describe(source)
        );
        return Err(source.fault(&table.span, message));
    };
    for entry in entries {
        let depth = path.len();
        path.extend(entry.key.split('.').map(str::to_owned));
        changeable(source, path, &entry.key_span)?;
        // The level whose tables replace: below a section, or below an element of a list.
        let leaf = if LISTS.contains(&path[0].as_str()) {
            3
        } else {
            2
        };
        if path.len() < leaf && matches!(entry.node.value, Value::Table(_)) {
            collect(source, entry.node, path, into)?;
        } else {
            into.push(Override {
                path: path.clone(),
                place: entry.key_span,
                value: entry.node,
            });
        }
        path.truncate(depth);
    }
    Ok(())
}

fn changeable(source: &Source, path: &[String], place: &Range<usize>) -> Result<(), BadInput> {
    if FIXED.contains(&path[0].as_str()) {
        let message = format!(
            "{}: expected a key that a variant can change, got {:?}",
            shortened(&path.join(".")),
            path[0]
        );
        return Err(source.fault(place, message));
    }
    Ok(())
}

/// For each swept key, in the order of the text, its values with their part of the name.
fn axes(source: &Source, sweep: Node) -> Result<Vec<Vec<(String, Override)>>, BadInput> {
    let mut leaves = Vec::new();
    flatten(source, sweep, &mut Vec::new(), &mut leaves)?;
    leaves
        .into_iter()
        .map(|(path, place, values)| {
            let key = path.last().expect("a key has at least one part").clone();
            values
                .into_iter()
                .enumerate()
                .map(|(i, value)| {
                    let part = format!("{key}{}", value_name(&value, i));
                    check_suffix(
                        source,
                        &format!("sweep.{}", path.join(".")),
                        &part,
                        &value.span,
                    )?;
                    Ok((
                        part,
                        Override {
                            path: path.clone(),
                            place: place.clone(),
                            value,
                        },
                    ))
                })
                .collect()
        })
        .collect()
}

/// A swept key: its path, its place, its values.
type Axis = (Vec<String>, Range<usize>, Vec<Node>);

fn flatten(
    source: &Source,
    table: Node,
    path: &mut Vec<String>,
    into: &mut Vec<Axis>,
) -> Result<(), BadInput> {
    let Value::Table(entries) = table.value else {
        let message = format!("sweep: expected a table, got {}", table.describe(source));
        return Err(source.fault(&table.span, message));
    };
    for entry in entries {
        let depth = path.len();
        path.extend(entry.key.split('.').map(str::to_owned));
        changeable(source, path, &entry.key_span)?;
        match entry.node.value {
            Value::Table(_) => flatten(source, entry.node, path, into)?,
            Value::Array(values) if !values.is_empty() => {
                into.push((path.clone(), entry.key_span, values))
            }
            _ => {
                let message = format!(
                    "sweep.{}: expected an array of at least one value, got {}",
                    shortened(&path.join(".")),
                    entry.node.describe(source)
                );
                return Err(source.fault(&entry.node.span, message));
            }
        }
        path.truncate(depth);
    }
    Ok(())
}

/// How a value stands in a name: a number by its digits (`-` as `m`, `.` as `p`), a word as it is,
/// anything else by its place in the list, from 1.
fn value_name(value: &Node, index: usize) -> String {
    match &value.value {
        Value::Integer(i) => i.to_string().replace('-', "m"),
        Value::Float(x) => x.to_string().replace('-', "m").replace('.', "p"),
        Value::Boolean(b) => b.to_string(),
        Value::String(text) => text.clone(),
        Value::Array(_) | Value::Table(_) => (index + 1).to_string(),
    }
}

fn check_suffix(
    source: &Source,
    key: &str,
    text: &str,
    place: &Range<usize>,
) -> Result<(), BadInput> {
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
    if !text.is_empty() && text.chars().all(fits) {
        return Ok(());
    }
    let message = format!(
        "{}: expected lower-case letters, digits, _ and - (it becomes part of an id), got {}",
        shortened(key),
        shown(text)
    );
    Err(source.fault(place, message))
}
