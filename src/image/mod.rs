//! Pictures and their parts in files, and differences between pictures.

pub mod exr;
pub mod file;
pub mod metrics;
pub mod part;
pub mod picture;
pub mod png;

use std::path::{Path, PathBuf};

/// Why a picture cannot be read, written or compared.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file system says no.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// The reason. Not the error's `source`: who prints those, too, would say it twice.
        reason: std::io::Error,
    },
    /// The file is not what it should be.
    #[error("{path}: {reason}")]
    Bad {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Two pictures that must have the same size have not.
    #[error("sizes differ: {a_width} x {a_height} against {b_width} x {b_height}")]
    Sizes {
        /// Width of the first.
        a_width: usize,
        /// Height of the first.
        a_height: usize,
        /// Width of the second.
        b_width: usize,
        /// Height of the second.
        b_height: usize,
    },
}

impl ImageError {
    pub(crate) fn bad(path: &Path, reason: impl ToString) -> Self {
        Self::Bad {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}
