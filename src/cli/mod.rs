//! The command line: one file per subcommand.
//!
//! Exit codes: 0 all is well, 1 a comparison or claim failed, 2 bad input or trouble. Data go to stdout, talk to stderr.

pub mod compare;
pub mod experiment;
pub mod export;
pub mod golden;
pub mod grade;
pub mod inspect;
pub mod intersect;
pub mod merge;
mod pictures;
pub mod rays;
mod remarks;
pub mod render;
pub mod report;
mod resources;
mod table;
pub mod verify;
pub mod watch;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Exit code of bad input and trouble.
pub const TROUBLE: u8 = 2;

/// A verification-focused research testbed for the algorithms of a small photon-mapping ray tracer.
#[derive(Debug, Parser)]
#[command(
    name = "photolathe",
    version,
    after_help = "\
Start with:
  photolathe verify                        all experiments at smoke effort, a table of claims, out/verify/index.html
  photolathe render scenes/cup.toml        the cup of glass by progressive photon mapping, out/cup.png and out/cup.exr
  photolathe inspect scenes/cup.toml       what the program understood of a scene

Exit codes: 0 fine, 1 a comparison or claim failed, 2 bad input or trouble."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene to EXR and PNG.
    Render(Box<render::RenderArgs>),
    /// Join the parts of a render made by render --pass-range.
    Merge(merge::MergeArgs),
    /// Intersect a list of rays with a scene.
    Intersect(intersect::IntersectArgs),
    /// Write families of rays with certified answers.
    Rays(rays::RaysArgs),
    /// Grade any program's answers to such rays.
    Grade(grade::GradeArgs),
    /// Show what the program understood of a scene, and draw a profile.
    Inspect(inspect::InspectArgs),
    /// Write a scene for Mitsuba or POV-Ray.
    Export(export::ExportArgs),
    /// Compare two pictures; the second is the reference.
    Compare(compare::Args),
    /// Run the experiments and show what was predicted and what was measured.
    Verify(verify::VerifyArgs),
    /// Join the results of shards into one page, or set two runs side by side.
    Report(report::ReportArgs),
    /// Check or accept golden pictures.
    Golden(golden::GoldenArgs),
}

/// Runs the command line and gives the exit code.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command {
        Command::Render(args) => render::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Intersect(args) => intersect::run(&args),
        Command::Rays(args) => rays::run(&args),
        Command::Grade(args) => grade::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Compare(args) => compare::run(args),
        Command::Verify(args) => verify::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Golden(args) => golden::run(&args),
    };
    result.unwrap_or_else(|error| {
        eprintln!("photolathe: {error:#}");
        ExitCode::from(TROUBLE)
    })
}

/// `--set KEY=VALUE` as a pair.
pub(crate) fn parse_override(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected KEY=VALUE, for example film.width=64".to_owned()),
    }
}
