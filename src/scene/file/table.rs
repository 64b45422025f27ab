//! Typed, checked access to the tables and values of a document.

use super::document::{Entry, Node, Value};
use super::error::{Origin, SceneError, Source};
use crate::scene::Rgb;
use crate::scene::options::LARGEST;
use glam::DVec3;
use std::fmt;

/// Least distance of focus: its square is no denormal number.
const LEAST_DISTANCE: f64 = 1e-60;

/// Numbers that a key accepts.
#[derive(Clone, Copy, Debug)]
pub(super) enum Range {
    /// Every number.
    Any,
    /// Numbers above 0.
    Positive,
    /// Numbers from 0.
    NotNegative,
    /// From 0 to 1.
    Share,
    /// Above 0, up to 1.
    PositiveShare,
    /// Above 0, below this.
    Below(f64),
}

impl Range {
    fn contains(self, x: f64) -> bool {
        match self {
            Self::Any => true,
            Self::Positive => x > 0.0,
            Self::NotNegative => x >= 0.0,
            Self::Share => (0.0..=1.0).contains(&x),
            Self::PositiveShare => x > 0.0 && x <= 1.0,
            Self::Below(top) => x > 0.0 && x < top,
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Any => f.write_str("a number"),
            Self::Positive => f.write_str("a number > 0"),
            Self::NotNegative => f.write_str("a number ≥ 0"),
            Self::Share => f.write_str("a number from 0 to 1"),
            Self::PositiveShare => f.write_str("a number > 0 and ≤ 1"),
            Self::Below(top) => write!(f, "a number > 0 and < {top}"),
        }
    }
}

/// A value with the name it has in messages.
#[derive(Clone, Debug)]
pub(super) struct Field<'a> {
    source: &'a Source<'a>,
    label: String,
    node: &'a Node,
}

/// A table all of whose keys are known.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    source: &'a Source<'a>,
    /// The table as the file writes it: `[camera]`, `[[sphere]]`.
    header: String,
    origin: &'a Origin,
    entries: &'a [Entry],
}

impl<'a> Table<'a> {
    /// The whole document.
    pub(super) fn root(
        source: &'a Source<'a>,
        node: &'a Node,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        Field {
            source,
            label: "document".to_owned(),
            node,
        }
        .table("the file", known)
    }

    /// The value under `key`.
    pub(super) fn get(&self, key: &str) -> Option<Field<'a>> {
        let entry = self.entries.iter().find(|entry| entry.key == key)?;
        Some(self.field(entry))
    }

    /// The value under `key`, which must be there; `expected` describes it.
    pub(super) fn require(&self, key: &str, expected: &str) -> Result<Field<'a>, SceneError> {
        self.get(key)
            .ok_or_else(|| self.error(&format!("missing key {key}: expected {expected}")))
    }

    /// Every key and its value, in order.
    pub(super) fn fields(&self) -> impl Iterator<Item = (&'a str, Field<'a>)> {
        let table = self.clone();
        self.entries
            .iter()
            .map(move |entry| (entry.key.as_str(), table.field(entry)))
    }

    /// An error about the table itself.
    pub(super) fn error(&self, message: &str) -> SceneError {
        self.source
            .at(self.origin, &format!("{}: {message}", self.header))
    }

    fn field(&self, entry: &'a Entry) -> Field<'a> {
        Field {
            source: self.source,
            label: entry.key.clone(),
            node: &entry.node,
        }
    }
}

impl<'a> Field<'a> {
    /// The error that something else was expected here.
    pub(super) fn expected(&self, expected: &str) -> SceneError {
        self.source
            .about_value(&self.node.origin, &self.label, expected)
    }

    /// Whether an override put this value here.
    pub(super) fn overridden(&self) -> bool {
        matches!(self.node.origin, Origin::Set(..))
    }

    /// The table here, written `header`. Every key must be in `known`, or any is taken if `known` is empty.
    pub(super) fn table(&self, header: &str, known: &[&str]) -> Result<Table<'a>, SceneError> {
        let Value::Table(entries) = &self.node.value else {
            return Err(self.expected(&format!("a table {header}")));
        };
        let unknown = entries
            .iter()
            .find(|entry| !known.is_empty() && !known.contains(&entry.key.as_str()));
        if let Some(entry) = unknown {
            let message = format!(
                "{}: unknown key in {header}: expected {}",
                entry.key,
                one_of(known)
            );
            return Err(self.source.at(&entry.origin, &message));
        }
        Ok(Table {
            source: self.source,
            header: header.to_owned(),
            origin: &self.node.origin,
            entries,
        })
    }

    /// The items of a list.
    pub(super) fn list(&self, expected: &str) -> Result<Vec<Field<'a>>, SceneError> {
        let Value::Array(items) = &self.node.value else {
            return Err(self.expected(expected));
        };
        let fields = items.iter().enumerate().map(|(index, node)| Field {
            source: self.source,
            label: format!("{}[{index}]", self.label),
            node,
        });
        Ok(fields.collect())
    }

    /// A list of exactly N items.
    pub(super) fn items<const N: usize>(
        &self,
        expected: &str,
    ) -> Result<[Field<'a>; N], SceneError> {
        let items = self.list(expected)?;
        items.try_into().map_err(|_| self.expected(expected))
    }

    /// A string.
    pub(super) fn string(&self, expected: &str) -> Result<&'a str, SceneError> {
        match &self.node.value {
            Value::String(text) => Ok(text),
            _ => Err(self.expected(expected)),
        }
    }

    /// One of these words.
    pub(super) fn word(&self, words: &[&str]) -> Result<usize, SceneError> {
        let expected = one_of(words);
        let text = self.string(&expected)?;
        words
            .iter()
            .position(|word| *word == text)
            .ok_or_else(|| self.expected(&expected))
    }

    /// A finite number in a range; integers count as numbers.
    pub(super) fn number(&self, range: Range) -> Result<f64, SceneError> {
        let x = match self.node.value {
            Value::Integer(x) => x as f64,
            Value::Float(x) => x,
            _ => return Err(self.expected(&range.to_string())),
        };
        if !x.is_finite() {
            return Err(self.expected("a finite number"));
        }
        if x.abs() > LARGEST {
            return Err(self.expected(&format!("{range}, of size at most {LARGEST:e}")));
        }
        if range.contains(x) {
            Ok(x)
        } else {
            Err(self.expected(&range.to_string()))
        }
    }

    /// A distance that may be infinite; it is neither so large nor so small that its square is out of range.
    pub(super) fn distance(&self) -> Result<f64, SceneError> {
        if matches!(self.node.value, Value::Float(f64::INFINITY)) {
            return Ok(f64::INFINITY);
        }
        let distance = self.number(Range::Positive)?;
        if distance < LEAST_DISTANCE {
            let expected = format!("a distance of at least {LEAST_DISTANCE:e}, or inf");
            return Err(self.expected(&expected));
        }
        Ok(distance)
    }

    /// An integer from `low` to `high`.
    pub(super) fn integer(&self, low: u64, high: u64) -> Result<u64, SceneError> {
        let found = match self.node.value {
            Value::Integer(x) => u64::try_from(x).ok().filter(|x| (low..=high).contains(x)),
            _ => None,
        };
        found.ok_or_else(|| {
            self.expected(&if high == u64::MAX {
                format!("an integer ≥ {low}")
            } else {
                format!("an integer from {low} to {high}")
            })
        })
    }

    /// Three numbers of a range.
    fn triple(&self, range: Range, expected: &str) -> Result<DVec3, SceneError> {
        let [x, y, z] = self.items(expected)?;
        Ok(DVec3::new(
            x.number(range)?,
            y.number(range)?,
            z.number(range)?,
        ))
    }

    /// A point.
    pub(super) fn point(&self) -> Result<DVec3, SceneError> {
        self.triple(Range::Any, "a point [x, y, z]")
    }

    /// A colour whose channels lie in `range`.
    pub(super) fn color(&self, range: Range) -> Result<Rgb, SceneError> {
        self.triple(range, "a colour [red, green, blue]")
    }

    /// A direction, made a unit vector.
    pub(super) fn direction(&self) -> Result<DVec3, SceneError> {
        let vector = self.triple(Range::Any, "a direction [x, y, z]")?;
        unit(vector).ok_or_else(|| self.expected("a direction other than [0, 0, 0]"))
    }
}

/// The unit vector along a finite vector; `None` for zero. Scaled first, so that no length over- or underflows.
pub(super) fn unit(vector: DVec3) -> Option<DVec3> {
    let largest = vector.abs().max_element();
    (largest > 0.0).then(|| (vector / largest).normalize())
}

/// "a", "a or b", "one of a, b, c".
pub(super) fn one_of(words: &[&str]) -> String {
    match words {
        [] => "nothing".to_owned(),
        [word] => (*word).to_owned(),
        [first, second] => format!("{first} or {second}"),
        _ => format!("one of {}", words.join(", ")),
    }
}
