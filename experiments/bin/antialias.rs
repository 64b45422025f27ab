//! Runs the experiment `antialias`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("antialias")
}
