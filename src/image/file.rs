//! Whole files, or none: written under a temporary name in the same directory, then renamed.

use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use tempfile::NamedTempFile;

/// Writes `bytes` to `path` so that no reader, and no crash, ever sees a part of them. Makes the directory if it is absent.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    stream_atomically(path, |file| file.write_all(bytes))
}

/// The same for what `write` writes into a file; where it fails, nothing is left behind.
pub fn stream_atomically<E: From<std::io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    let mut file = beside(path)?;
    write(file.as_file_mut())?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Whether a file could be written to `path` now: makes its directory if that is absent, and nothing else.
pub fn probe(path: &Path) -> std::io::Result<()> {
    if path.is_dir() {
        return Err(std::io::ErrorKind::IsADirectory.into());
    }
    beside(path).map(drop)
}

/// A temporary file in the directory of `path`, which is made if it is absent.
fn beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(directory)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".photolathe-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The usual mode of a new file (the process's mask applies), not the private one of a temporary file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory)
}
