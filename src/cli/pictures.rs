//! Pictures as outputs: their names, and what is said about them.

use crate::image::file::probe;
use crate::image::picture::Picture;
use crate::image::{exr, png};
use crate::render::film::Film;
use anyhow::{Context, bail};
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

/// Refuses files that could not be written, before work is put into them.
pub(super) fn check_places<'a>(paths: impl IntoIterator<Item = &'a Path>) -> anyhow::Result<()> {
    all(paths
        .into_iter()
        .map(|path| probe(path).with_context(|| path.display().to_string())))
}

/// Writes a picture under each name, in the format that it says; under the others, too, if one cannot be written.
pub(super) fn write(picture: &Picture, exposure: f64, paths: &[PathBuf]) -> anyhow::Result<()> {
    all(paths.iter().map(|path| {
        if is(path, "exr") {
            exr::write(picture, path)?;
        } else {
            png::write(picture, exposure, path)?;
        }
        eprintln!("photolathe: wrote {}", path.display());
        Ok(())
    }))
}

/// Does all that is given, and then tells every fault.
pub(super) fn all(tasks: impl IntoIterator<Item = anyhow::Result<()>>) -> anyhow::Result<()> {
    let faults: Vec<String> = tasks
        .into_iter()
        .filter_map(|task| Some(format!("{:#}", task.err()?)))
        .collect();
    if !faults.is_empty() {
        bail!(faults.join("; "));
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

/// Fails if colours became infinite when they were rounded: the picture, already written, shows them so.
pub(super) fn check_colours(picture: &Picture) -> anyhow::Result<()> {
    let infinite = picture.infinite();
    if infinite > 0 {
        bail!(
            "{infinite} pixels are brighter than {:.1e}, the most that a picture's numbers hold: they are infinite in it",
            f32::MAX
        );
    }
    Ok(())
}
