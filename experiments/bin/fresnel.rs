//! Runs the experiment `fresnel`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("fresnel")
}
