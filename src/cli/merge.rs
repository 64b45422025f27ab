//! `photolathe merge`: the parts of a render in, its picture out.

use super::pictures;
use super::render::positive;
use crate::image::part::{Merged, Part};
use crate::image::picture::Picture;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Join the parts of a render that were made by `render --pass-range`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  photolathe render scenes/cup.toml --integrator pppm --pass-range 0..40 -o a.part
  photolathe render scenes/cup.toml --integrator pppm --pass-range 40..64 -o b.part
  photolathe merge a.part b.part -o cup.exr

The picture has the bytes of `render --passes 64`, for any parts in any order that hold every pass from 0 on once. Parts of other
scenes, settings, seeds or programs (by their sources, not by the version's number alone), passes held twice, and missing passes are
refused.")]
pub struct MergeArgs {
    /// Files written by `render --pass-range`.
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,
    /// Where to write, .exr or .png by extension; may be repeated.
    #[arg(short, long = "out", value_name = "OUT", required = true)]
    pub out: Vec<PathBuf>,
    /// Factor on radiance for PNG: pixel = sRGB(exposure × radiance).
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub exposure: f64,
}

/// Runs `merge`.
pub fn run(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    pictures::check_names(&args.out)?;
    let mut merged = Merged::default();
    for path in &args.parts {
        merged
            .add(Part::read(path)?, &path.display().to_string())
            .map_err(anyhow::Error::msg)?;
    }
    let whole = merged.finish().map_err(anyhow::Error::msg)?;
    let picture = Picture::of_film(&whole.film).described(&whole.origin, whole.passes.end);
    eprintln!("photolathe: joined {} passes", whole.passes.end);
    pictures::write(&picture, args.exposure, &args.out)?;
    pictures::check_colours(&picture)?;
    pictures::check_samples(&whole.film)?;
    Ok(ExitCode::SUCCESS)
}
