//! Pictures as outputs: their names, and what is said about them.

use crate::image::picture::Picture;
use crate::image::{exr, png};
use crate::render::film::Film;
use anyhow::bail;
use std::path::{Path, PathBuf};

/// Whether a path has this extension, in any case.
pub(super) fn is(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// Whether the name is that of a picture.
pub(super) fn is_picture(path: &Path) -> bool {
    is(path, "exr") || is(path, "png")
}

/// Refuses names that say no format.
pub(super) fn check_names(paths: &[PathBuf]) -> anyhow::Result<()> {
    match paths.iter().find(|path| !is_picture(path)) {
        Some(path) => bail!(
            "{}: expected a name that ends in .exr or .png",
            path.display()
        ),
        None => Ok(()),
    }
}

/// Writes a picture under each name, in the format that it says.
pub(super) fn write(picture: &Picture, exposure: f64, paths: &[PathBuf]) -> anyhow::Result<()> {
    for path in paths {
        if is(path, "exr") {
            exr::write(picture, path)?;
        } else {
            png::write(picture, exposure, path)?;
        }
        eprintln!("photolathe: wrote {}", path.display());
    }
    Ok(())
}

/// Fails if samples were not finite: the picture, already written, lacks them.
pub(super) fn check_samples(film: &Film) -> anyhow::Result<()> {
    let bad = film.bad_samples();
    if bad > 0 {
        bail!(
            "{bad} samples were NaN or infinite: the picture leaves them out and is not to be trusted"
        );
    }
    Ok(())
}
