//! Tables: rows of values, as tidy CSV whose floats parse back to the same bits.

use serde::de::value::{Error, MapDeserializer};
use serde::de::{DeserializeOwned, Deserializer, IntoDeserializer, Visitor};
use serde::{Deserialize, Serialize};

/// A value of a table or a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Stored", into = "Stored")]
pub enum Value {
    /// Whole number.
    Integer(i64),
    /// Number.
    Number(f64),
    /// Text.
    Text(String),
}

/// The JSON form of a value. JSON has no NaN and no infinity: they are stored as an object.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Stored {
    Integer(i64),
    Number(f64),
    NotFinite { number: String },
    Text(String),
}

impl From<Value> for Stored {
    fn from(value: Value) -> Self {
        match value {
            Value::Integer(integer) => Self::Integer(integer),
            Value::Number(number) if number.is_finite() => Self::Number(number),
            Value::Number(number) => Self::NotFinite {
                number: number.to_string(),
            },
            Value::Text(text) => Self::Text(text),
        }
    }
}

impl From<Stored> for Value {
    fn from(stored: Stored) -> Self {
        match stored {
            Stored::Integer(integer) => Self::Integer(integer),
            Stored::Number(number) => Self::Number(number),
            Stored::NotFinite { number } => Self::Number(number.parse().unwrap_or(f64::NAN)),
            Stored::Text(text) => Self::Text(text),
        }
    }
}

impl Value {
    /// The number; `None` for text.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(integer) => Some(*integer as f64),
            Self::Number(number) => Some(*number),
            Self::Text(_) => None,
        }
    }

    /// The text of a table cell; a float in the shortest form that parses back to the same bits.
    pub fn to_cell(&self) -> String {
        match self {
            Self::Integer(integer) => integer.to_string(),
            Self::Number(number) => format!("{number:?}"),
            Self::Text(text) => text.clone(),
        }
    }
}

macro_rules! whole {
    ($($kind:ty),*) => {$(
        impl From<$kind> for Value {
            /// Saturates at the ends of 64-bit signed integers.
            fn from(integer: $kind) -> Self {
                Self::Integer(i64::try_from(integer).unwrap_or(i64::MAX))
            }
        }
    )*};
}
whole!(i32, i64, u32, u64, usize);

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

/// What a field of a struct reads of a cell: text as it is, and NaN where a number is asked for and there is text.
struct Cell<'a>(&'a Value);

impl<'de> Deserializer<'de> for Cell<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Value::Integer(integer) => visitor.visit_i64(*integer),
            Value::Number(number) => visitor.visit_f64(*number),
            Value::Text(text) => visitor.visit_str(text),
        }
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f64(self.0.number().unwrap_or(f64::NAN))
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_string(self.0.to_cell())
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str bytes byte_buf option unit unit_struct newtype_struct seq tuple
        tuple_struct map struct enum identifier ignored_any
    }
}

impl<'de> IntoDeserializer<'de> for Cell<'_> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// Whether a column holds times, which differ from run to run.
pub fn is_time_column(name: &str) -> bool {
    ["_s", "_ms", "_ns"]
        .iter()
        .any(|ending| name.ends_with(ending))
        || name.starts_with("ns_per_")
        || name == "seconds"
}

/// Whether two rows of these columns are equal, times aside; numbers by their bits.
pub fn same_row(columns: &[impl AsRef<str>], a: &[Value], b: &[Value]) -> bool {
    let same = |a: &Value, b: &Value| match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.to_bits() == b.to_bits(),
        _ => a == b,
    };
    let cells = columns.iter().zip(a.iter().zip(b));
    a.len() == b.len()
        && cells
            .filter(|(name, _)| !is_time_column(name.as_ref()))
            .all(|(_, (a, b))| same(a, b))
}

/// The rows of all runs, in the order of the plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Column names.
    pub columns: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<Value>>,
}

impl Table {
    /// Position of a column.
    ///
    /// # Panics
    /// If there is none of the name: a mistake in the experiment.
    pub fn column(&self, name: &str) -> usize {
        let found = self.columns.iter().position(|column| column == name);
        found.unwrap_or_else(|| panic!("no column {name}"))
    }

    /// The numbers of a column; NaN for text.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        let column = self.column(name);
        self.rows
            .iter()
            .map(|row| row[column].number().unwrap_or(f64::NAN))
            .collect()
    }

    /// The numbers of these columns, row by row; NaN for text.
    pub fn select<const N: usize>(&self, names: [&str; N]) -> Vec<[f64; N]> {
        let columns = names.map(|name| self.column(name));
        let number = |row: &[Value], column: usize| row[column].number().unwrap_or(f64::NAN);
        let rows = self.rows.iter();
        rows.map(|row| columns.map(|column| number(row, column)))
            .collect()
    }

    /// The rows as structs whose fields, `f64` or `String`, have the names of columns; columns without a field are left out.
    ///
    /// # Panics
    /// If a field has no column, or another type: a mistake in the experiment.
    pub fn read<Row: DeserializeOwned>(&self) -> Vec<Row> {
        let read = |row: &Vec<Value>| {
            let cells = row.iter().map(Cell);
            let named = self.columns.iter().map(String::as_str).zip(cells);
            Row::deserialize(MapDeserializer::new(named))
        };
        let rows = self.rows.iter().map(read);
        rows.map(|row| row.unwrap_or_else(|error| panic!("a row of the table: {error}")))
            .collect()
    }

    /// The rows whose column has this value.
    #[must_use]
    pub fn filter(&self, name: &str, value: &Value) -> Self {
        let column = self.column(name);
        Self {
            columns: self.columns.clone(),
            rows: self
                .rows
                .iter()
                .filter(|row| row[column] == *value)
                .cloned()
                .collect(),
        }
    }

    /// The different values of a column, in the order of their first rows.
    pub fn distinct(&self, name: &str) -> Vec<Value> {
        let column = self.column(name);
        let mut values: Vec<Value> = Vec::new();
        for row in &self.rows {
            if !values.contains(&row[column]) {
                values.push(row[column].clone());
            }
        }
        values
    }

    /// The table as CSV: a header line, then a line per row.
    pub fn to_csv(&self) -> Vec<u8> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let header = std::iter::once(self.columns.clone());
        let rows = self
            .rows
            .iter()
            .map(|row| row.iter().map(Value::to_cell).collect());
        for line in header.chain(rows) {
            writer
                .write_record(line)
                .expect("all rows have the length of the header");
        }
        writer.into_inner().expect("memory takes all bytes")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_parse_back_to_the_same_bits() {
        for x in [
            0.1,
            -0.0,
            1e300,
            5e-324,
            f64::MAX,
            f64::INFINITY,
            1.0,
            123_456_789.123,
        ] {
            let cell = Value::Number(x).to_cell();
            assert_eq!(
                cell.parse::<f64>().unwrap().to_bits(),
                x.to_bits(),
                "{cell}"
            );
        }
    }

    #[test]
    fn values_survive_json_also_when_not_finite() {
        for value in [
            1.into(),
            1.0.into(),
            f64::INFINITY.into(),
            (-0.0).into(),
            "NaN".into(),
            Value::Integer(i64::MIN),
        ] {
            let json = serde_json::to_string(&value).unwrap();
            assert_eq!(
                serde_json::from_str::<Value>(&json).unwrap(),
                value,
                "{json}"
            );
        }
        let json = serde_json::to_string(&Value::Number(f64::NAN)).unwrap();
        assert!(matches!(serde_json::from_str(&json), Ok(Value::Number(x)) if x.is_nan()));
    }

    #[test]
    fn csv_quotes_what_needs_quotes() {
        let table = Table {
            columns: vec!["a".to_owned(), "b".to_owned()],
            rows: vec![vec!["x, \"y\"".into(), 2.5.into()]],
        };
        assert_eq!(table.to_csv(), b"a,b\n\"x, \"\"y\"\"\",2.5\n");
        assert_eq!(table.filter("b", &2.5.into()).rows.len(), 1);
        assert_eq!(table.distinct("b"), [2.5.into()]);
    }

    #[test]
    fn rows_become_structs_by_the_names_of_columns() {
        #[derive(Debug, PartialEq, Deserialize)]
        struct Row {
            size: f64,
            name: String,
            count: f64,
        }
        let table = Table {
            columns: ["name", "other", "count", "size"]
                .map(String::from)
                .to_vec(),
            rows: vec![
                vec!["a".into(), "x".into(), 3.into(), 0.5.into()],
                vec![7.into(), 1.into(), "text".into(), f64::INFINITY.into()],
            ],
        };
        let rows: Vec<Row> = table.read();
        let first = Row {
            size: 0.5,
            name: "a".to_owned(),
            count: 3.0,
        };
        assert_eq!(rows[0], first);
        assert_eq!((rows[1].name.as_str(), rows[1].size), ("7", f64::INFINITY));
        assert!(rows[1].count.is_nan());
    }

    #[test]
    fn time_columns_are_known_by_their_names() {
        for name in ["render_s", "x_ms", "x_ns", "ns_per_ray", "seconds"] {
            assert!(is_time_column(name));
        }
        for name in ["starts", "misses", "s", "spans"] {
            assert!(!is_time_column(name));
        }
    }

    #[test]
    fn a_table_without_rows_has_a_header() {
        let table = Table {
            columns: vec!["a".to_owned()],
            rows: Vec::new(),
        };
        assert_eq!(table.to_csv(), b"a\n");
    }
}
