//! A TOML document whose every value knows where it came from, and the overrides that change it.
//!
//! The `toml` crate parses; its spanned tables are copied so that an override can put its own values among the file's and an
//! error can still name the word at fault, in the file or on the command line.

use super::error::{Origin, SceneError, Source};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and where it came from.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) origin: Origin,
    pub(super) value: Value,
}

/// A TOML value. Numbers that their type cannot hold are [`Value::Unfit`].
#[derive(Clone, Debug)]
pub(super) enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Array(Vec<Node>),
    Table(Vec<Entry>),
    /// A boolean, a date, or a number out of range: nothing that a scene can use.
    Unfit,
}

/// A key of a table, with its value.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) origin: Origin,
    pub(super) node: Node,
}

/// Reads the file's text.
pub(super) fn read(source: &Source) -> Result<Node, SceneError> {
    let root = DeTable::parse(source.text).map_err(|error| {
        let span = error.span().unwrap_or(0..0);
        source.syntax(span, error.message())
    })?;
    Ok(Node {
        origin: Origin::File(0..0),
        value: table(root.get_ref(), &Origin::File),
    })
}

fn node(spanned: &Spanned<DeValue>, origin: &dyn Fn(std::ops::Range<usize>) -> Origin) -> Node {
    let value = match spanned.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(digits) => i64::from_str_radix(digits.as_str(), digits.radix())
            .map_or(Value::Unfit, Value::Integer),
        DeValue::Float(digits) => digits.as_str().parse().map_or(Value::Unfit, Value::Float),
        DeValue::Boolean(_) | DeValue::Datetime(_) => Value::Unfit,
        DeValue::Array(items) => {
            Value::Array(items.iter().map(|item| node(item, origin)).collect())
        }
        DeValue::Table(entries) => table(entries, origin),
    };
    Node {
        origin: origin(spanned.span()),
        value,
    }
}

fn table(entries: &DeTable, origin: &dyn Fn(std::ops::Range<usize>) -> Origin) -> Value {
    let entries = entries.iter().map(|(key, value)| Entry {
        key: key.get_ref().to_string(),
        origin: origin(key.span()),
        node: node(value, origin),
    });
    Value::Table(entries.collect())
}

/// Puts the value of the override with this index at its path. Tables on the way are made as needed; whether their names
/// mean anything is for the validation that follows.
pub(super) fn apply(root: &mut Node, source: &Source, index: usize) -> Result<(), SceneError> {
    let (path, text) = &source.overrides[index];
    let whole = Origin::Set(index, 0..text.len());
    let bad_path = || {
        source.at(
            &whole,
            "expected a path like film.width or sphere.0.radius before the =",
        )
    };
    let keys = path_keys(path).ok_or_else(bad_path)?;
    let mut place = root;
    for key in keys {
        place = step(place, &key, &whole)
            .map_err(|expected| source.at(&whole, &format!("{key}: expected {expected}")))?;
    }
    *place = override_value(text, index);
    Ok(())
}

/// The keys of a dotted path; quoted keys are allowed.
fn path_keys(path: &str) -> Option<Vec<String>> {
    let line = format!("{path} = 0");
    let root = DeTable::parse(&line).ok()?;
    let mut keys = Vec::new();
    let mut table = root.get_ref();
    loop {
        let (key, value) = table.iter().next()?;
        if table.len() != 1 {
            return None;
        }
        keys.push(key.get_ref().to_string());
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            DeValue::Integer(_) if value.span().end == line.len() => return Some(keys),
            _ => return None,
        }
    }
}

/// The child of `place` under `key`; `Err` says what the key should have been.
fn step<'a>(place: &'a mut Node, key: &str, origin: &Origin) -> Result<&'a mut Node, String> {
    match &mut place.value {
        Value::Array(items) => {
            let count = items.len();
            let index = key.parse::<usize>().ok();
            index
                .and_then(|index| items.get_mut(index))
                .ok_or_else(|| match count {
                    0 => "no index: the list is empty".to_owned(),
                    _ => format!("an index from 0 to {}", count - 1),
                })
        }
        Value::Table(entries) => {
            let found = entries.iter().position(|entry| entry.key == key);
            let found = found.unwrap_or_else(|| {
                entries.push(Entry {
                    key: key.to_owned(),
                    origin: origin.clone(),
                    node: Node {
                        origin: origin.clone(),
                        value: Value::Table(Vec::new()),
                    },
                });
                entries.len() - 1
            });
            Ok(&mut entries[found].node)
        }
        _ => Err("nothing: what stands before it is neither a table nor a list".to_owned()),
    }
}

/// The value of an override: TOML if it is, else the text itself.
fn override_value(text: &str, index: usize) -> Node {
    let whole = Origin::Set(index, 0..text.len());
    match DeValue::parse(text) {
        Ok(value) => Node {
            origin: whole,
            ..node(&value, &|range| Origin::Set(index, range))
        },
        Err(_) => Node {
            origin: whole,
            value: Value::String(text.to_owned()),
        },
    }
}
