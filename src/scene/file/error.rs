//! Where a word of a scene stands, and the one error message about it.

use std::ops::Range;

/// A scene that is not right: one message that names file, line, column, the word, and what was expected.
///
/// The form is `scenes/x.toml:12:10: radius = -1: expected a number > 0`; lines and columns count from 1, columns in
/// characters. A value that came from an override is named by it: `--set sphere.0.radius=-1: expected a number > 0`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(pub String);

/// A change of one key: `--set film.width=64` is `("film.width", "64")`.
pub type Override = (String, String);

/// Where a part of the document came from: a range of bytes of the file, or of the value of an override.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// These bytes of the file.
    File(Range<usize>),
    /// These bytes of the value of the override with this index.
    Set(usize, Range<usize>),
}

/// The texts that a document was read from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<'a> {
    /// What stands for the file in messages.
    pub(super) name: &'a str,
    /// The file's text.
    pub(super) text: &'a str,
    /// The overrides, in order.
    pub(super) overrides: &'a [Override],
}

/// Longest piece of a scene shown in a message, in characters.
const LONGEST_WORD: usize = 48;

impl Source<'_> {
    /// The error about the value at `origin`, which is called `label`.
    pub(super) fn about_value(&self, origin: &Origin, label: &str, expected: &str) -> SceneError {
        let whole_override = matches!(origin, Origin::Set(index, range)
            if range.len() == self.overrides[*index].1.len());
        if whole_override {
            return self.at(origin, &format!("expected {expected}"));
        }
        let word = self.word(origin);
        self.at(origin, &format!("{label} = {word}: expected {expected}"))
    }

    /// An error of syntax in the file, in the words of the TOML parser.
    pub(super) fn syntax(&self, span: Range<usize>, message: &str) -> SceneError {
        let mut message = message.split_whitespace().collect::<Vec<_>>().join(" ");
        if message == "duplicate key" {
            message += ", expected each key once";
        }
        let rest = self.text.get(span.start..).unwrap_or_default();
        let word_end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let origin = Origin::File(span.start..span.end.max(span.start + word_end));
        let word = self.word(&origin);
        if !word.is_empty() {
            message = format!("{word}: {message}");
        }
        self.at(&origin, &message)
    }

    /// An error at `origin`.
    pub(super) fn at(&self, origin: &Origin, message: &str) -> SceneError {
        SceneError(match origin {
            Origin::File(range) => {
                let (line, column) = position(self.text, range.start);
                format!("{}:{line}:{column}: {message}", self.name)
            }
            Origin::Set(index, _) => {
                let (key, value) = &self.overrides[*index];
                format!("--set {key}={value}: {message}")
            }
        })
    }

    /// The text at `origin`, on one line and cut where it is long.
    fn word(&self, origin: &Origin) -> String {
        let (text, range) = match origin {
            Origin::File(range) => (self.text, range),
            Origin::Set(index, range) => (self.overrides[*index].1.as_str(), range),
        };
        let words = text.get(range.clone()).unwrap_or_default();
        let line = words.split_whitespace().collect::<Vec<_>>().join(" ");
        match line.char_indices().nth(LONGEST_WORD) {
            Some((end, _)) => format!("{} …", line[..end].trim_end()),
            None => line,
        }
    }
}

/// Line and column of a byte, from 1.
fn position(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    )
}
