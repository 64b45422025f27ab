//! The scene file: TOML text to a validated [`Scene`].

use super::Scene;
use std::path::Path;

/// A scene file that is not right: one message that names file, line, column, the word, and what was expected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(pub String);

/// A change of one key: `--set film.width=64` is `("film.width", "64")`.
pub type Override = (String, String);

/// Reads, validates and builds the scene of a file, then applies the overrides (validated in turn).
pub fn load(path: &Path, overrides: &[Override]) -> Result<Scene, SceneError> {
    let _ = (path, overrides);
    todo!()
}

/// The same from text; `directory` is where relative paths start, `name` stands for the file in messages.
pub fn parse(
    text: &str,
    name: &str,
    directory: &Path,
    overrides: &[Override],
) -> Result<Scene, SceneError> {
    let _ = (text, name, directory, overrides);
    todo!()
}
