//! `photolathe compare`: how far a picture is from a reference.

use crate::image::exr;
use crate::image::metrics::{Comparison, compare};
use crate::lab::contrast::Contrast;
use crate::lab::difference::Difference;
use crate::lab::page;
use anyhow::Context as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `compare`.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The picture
    a: PathBuf,
    /// The reference
    b: PathBuf,
    /// Writes a page with both pictures under a slider, their difference and the numbers
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Writes the difference as a picture: blue where A is darker, orange where it is brighter
    #[arg(long, value_name = "FILE.png")]
    diff: Option<PathBuf>,
}

/// Prints the comparison as JSON; an error if the pictures cannot be compared.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (a, b) = (exr::read(&args.a)?, exr::read(&args.b)?);
    let comparison = compare(&a, &b)
        .with_context(|| format!("{} against {}", args.a.display(), args.b.display()))?;
    say_what_json_cannot(&comparison);
    if let Some(path) = &args.diff {
        let bytes = Difference::of(&a, &b).png().map_err(anyhow::Error::msg)?;
        crate::image::file::write_atomically(path, &bytes)
            .with_context(|| path.display().to_string())?;
    }
    let json = serde_json::to_string_pretty(&comparison)?;
    if let Some(path) = &args.html {
        let pictures = Contrast {
            caption: String::new(),
            a: (args.a.display().to_string(), a),
            b: (args.b.display().to_string(), b),
            commands: Vec::new(),
        };
        let html = page::comparison(&pictures, &comparison)?;
        crate::image::file::write_atomically(path, html.as_bytes())
            .with_context(|| path.display().to_string())?;
    }
    writeln!(std::io::stdout(), "{json}")?;
    Ok(ExitCode::SUCCESS)
}

fn say_what_json_cannot(comparison: &Comparison) {
    if comparison.mse == 0.0 {
        eprintln!("psnr is infinite (no difference): null in the JSON");
    }
    if comparison.not_finite > 0 {
        eprintln!(
            "{} pixels are NaN or infinite; means and errors over them are null in the JSON",
            comparison.not_finite
        );
    }
}
