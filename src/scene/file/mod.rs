//! The scene file: TOML text to a validated [`Scene`].
//!
//! The text is parsed into a document whose values know their place (`document`), read by typed accessors that know what
//! each key may hold (`table`), and built into a scene. Overrides change the document after the file by itself has been
//! found valid, and the result is validated again. Every violation is one [`SceneError`].

mod build;
mod document;
mod error;
mod material;
mod objects;
mod parameters;
mod table;

pub use error::{Override, SceneError};

use super::Scene;
use error::Source;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use table::Table;

/// Most bytes of a scene file.
pub const MAX_FILE_BYTES: u64 = 16 << 20;

/// Reads, validates and builds the scene of a file, then applies the overrides (validated in turn).
///
/// # Errors
/// A file that cannot be read, is larger than [`MAX_FILE_BYTES`] or is not UTF-8, and everything that [`parse`] refuses.
pub fn load(path: &Path, overrides: &[Override]) -> Result<Scene, SceneError> {
    let name = path.display().to_string();
    let text = read_text(path, &name)?;
    let directory = path.parent().unwrap_or(Path::new(""));
    parse(&text, &name, directory, overrides)
}

/// The same from text; `directory` is where relative paths start, `name` stands for the file in messages.
///
/// # Errors
/// Bad syntax, unknown keys, wrong types, values out of range, textures that cannot be read, and parts that do not fit
/// together: the first found, with its place.
pub fn parse(
    text: &str,
    name: &str,
    directory: &Path,
    overrides: &[Override],
) -> Result<Scene, SceneError> {
    let source = Source {
        name,
        text,
        overrides,
    };
    let mut root = document::read(&source)?;
    let mut scene = build::scene(&source, &root, directory)?;
    if !overrides.is_empty() {
        for index in 0..overrides.len() {
            document::apply(&mut root, &source, index)?;
        }
        scene = build::scene(&source, &root, directory)
            .map_err(|error| blame_overrides(error, overrides))?;
    }
    Ok(scene)
}

/// The error that something else was `expected` under a key of the top level, for who finds a good scene unfit for a purpose.
pub fn unfit(path: &Path, overrides: &[Override], key: &str, expected: &str) -> SceneError {
    let name = path.display().to_string();
    let text = match read_text(path, &name) {
        Ok(text) => text,
        Err(error) => return error,
    };
    let source = Source {
        name: &name,
        text: &text,
        overrides,
    };
    let fault = || {
        let mut root = document::read(&source)?;
        for index in 0..overrides.len() {
            document::apply(&mut root, &source, index)?;
        }
        let field = Table::root(&source, &root, &[])?.get(key);
        let field = field.map(|field| field.expected(expected));
        Ok(field.unwrap_or_else(|| SceneError(format!("{name}: {key}: expected {expected}"))))
    };
    fault().unwrap_or_else(|error| error)
}

/// The error with the overrides named: the file by itself was good.
fn blame_overrides(error: SceneError, overrides: &[Override]) -> SceneError {
    if error.0.starts_with("--set ") {
        return error;
    }
    let all: Vec<String> = overrides
        .iter()
        .map(|(key, value)| format!("--set {key}={value}"))
        .collect();
    SceneError(format!("{} (after {})", error.0, all.join(" ")))
}

fn read_text(path: &Path, name: &str) -> Result<String, SceneError> {
    let unreadable = |error: std::io::Error| {
        SceneError(format!("{name}: {error}: expected a readable scene file"))
    };
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneError(format!(
            "{name}: expected a scene file of at most {MAX_FILE_BYTES} bytes"
        )));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let text = String::from_utf8_lossy(&error.as_bytes()[..good]).into_owned();
        let source = Source {
            name,
            text: &text,
            overrides: &[],
        };
        let message = format!("byte {:#04x}: expected UTF-8 text", error.as_bytes()[good]);
        source.at(&error::Origin::File(good..good), &message)
    })
}
