//! Reads suites and answers. What is wrong in a file is told with its line and column.

use super::Asked;
use anyhow::{Context as _, bail};
use glam::DVec3;
use std::path::Path;

/// A CSV file whose columns are found by name.
struct Table {
    name: String,
    reader: csv::Reader<std::fs::File>,
    headers: csv::StringRecord,
    record: csv::StringRecord,
}

impl Table {
    fn open(path: &Path) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        let file = std::fs::File::open(path).with_context(|| format!("{name}: cannot open"))?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(file);
        let headers = reader
            .headers()
            .with_context(|| format!("{name}: cannot read the header"))?
            .clone();
        Ok(Self {
            name,
            reader,
            headers,
            record: csv::StringRecord::new(),
        })
    }

    fn find(&self, column: &str) -> Option<usize> {
        self.headers.iter().position(|header| header == column)
    }

    fn need(&self, column: &str, expected: &str) -> anyhow::Result<usize> {
        self.find(column).with_context(|| {
            format!(
                "{}:1: column `{column}` is missing: expected {expected}",
                self.name
            )
        })
    }

    fn next(&mut self) -> anyhow::Result<bool> {
        let name = &self.name;
        self.reader
            .read_record(&mut self.record)
            .with_context(|| name.clone())
    }

    fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }

    fn fault(&self, column: usize, expected: &str) -> anyhow::Error {
        let line = self.record.position().map_or(0, csv::Position::line);
        anyhow::anyhow!(
            "{}:{line}: field {} (`{}`) is `{}`: expected {expected}",
            self.name,
            column + 1,
            self.headers.get(column).unwrap_or(""),
            self.text(column)
        )
    }

    /// A number that is not NaN.
    fn number(&self, column: usize, expected: &str) -> anyhow::Result<f64> {
        let number: Option<f64> = self.text(column).parse().ok();
        number
            .filter(|x| !x.is_nan())
            .ok_or_else(|| self.fault(column, expected))
    }

    fn flag(&self, column: usize) -> anyhow::Result<bool> {
        match self.text(column) {
            "1" => Ok(true),
            "0" => Ok(false),
            _ => Err(self.fault(column, "0 or 1")),
        }
    }
}

const OF_A_SUITE: &str = "a file written by `photolathe rays`";

/// Reads a suite: its name and its rays.
///
/// # Errors
/// A file that cannot be read or is not a suite.
pub fn read_suite(path: &Path) -> anyhow::Result<(String, Vec<Asked>)> {
    let mut table = Table::open(path)?;
    let need = |column: &str| table.need(column, OF_A_SUITE);
    let [ox, oy, oz, dx, dy, dz] = ["ox", "oy", "oz", "dx", "dy", "dz"].map(need);
    let (origin, direction) = ([ox?, oy?, oz?], [dx?, dy?, dz?]);
    let (ray, family, hit, t) = (
        need("ray")?,
        need("family")?,
        need("true_hit")?,
        need("true_t")?,
    );
    let (cosine, scale, margin) = (need("cosine")?, need("scale")?, need("margin")?);
    let suite_column = need("suite")?;
    let (mut suite, mut asked) = (String::new(), Vec::new());
    while table.next()? {
        let vector = |columns: [usize; 3]| -> anyhow::Result<DVec3> {
            let [x, y, z] = columns.map(|column| table.number(column, "a number"));
            Ok(DVec3::new(x?, y?, z?))
        };
        let nearest = if table.flag(hit)? {
            Some((
                table.number(t, "a number")?,
                table.number(cosine, "a number")?,
            ))
        } else {
            None
        };
        let number = table.text(ray).parse();
        if number != Ok(asked.len() as u64) {
            return Err(table.fault(ray, &format!("{}, the number of the row", asked.len())));
        }
        if suite.is_empty() {
            table.text(suite_column).clone_into(&mut suite);
        } else if suite != table.text(suite_column) {
            return Err(table.fault(
                suite_column,
                &format!("`{suite}` as above: one suite a file"),
            ));
        }
        asked.push(Asked {
            number: asked.len() as u64,
            family: table.text(family).to_owned(),
            distance: vector(origin)?.length(),
            speed: vector(direction)?.length(),
            nearest,
            scale: table.number(scale, "a number")?,
            margin: table.number(margin, "a number")?,
        });
    }
    if asked.is_empty() {
        bail!("{}: no rays", table.name);
    }
    Ok((suite, asked))
}

const OF_ANSWERS: &str = "columns hit,t (others are ignored), and optionally ray";

/// Reads the answers to `count` rays: t, or `None` for a miss.
///
/// With a column `ray` the rows may come in any order, several for one ray: the least t counts, and a ray without a row is a miss.
/// Without it there is a row for each ray, in order.
///
/// # Errors
/// A file that cannot be read, a missing column, a hit that is not 0 or 1, a t that is not a finite number, or another number of
/// rows.
pub fn read_answers(path: &Path, count: usize) -> anyhow::Result<Vec<Option<f64>>> {
    let mut table = Table::open(path)?;
    let (hit, t) = (table.need("hit", OF_ANSWERS)?, table.need("t", OF_ANSWERS)?);
    let ray = table.find("ray");
    let mut answers: Vec<Option<f64>> = vec![None; count];
    let mut rows = 0;
    while table.next()? {
        let place = match ray {
            None => rows,
            Some(column) => {
                let number = table.text(column).parse().ok();
                let expected = || format!("a ray from 0 to {}", count - 1);
                number
                    .filter(|&number| number < count)
                    .ok_or_else(|| table.fault(column, &expected()))?
            }
        };
        rows += 1;
        if place >= count {
            continue;
        }
        if table.flag(hit)? {
            let found = table.number(t, "a finite number")?;
            if !found.is_finite() {
                return Err(table.fault(t, "a finite number"));
            }
            answers[place] = Some(answers[place].map_or(found, |least| least.min(found)));
        }
    }
    if ray.is_none() && rows != count {
        bail!(
            "{}: {rows} rows: expected {count}, one for each ray of the suite, or a column `ray`",
            table.name
        );
    }
    Ok(answers)
}
