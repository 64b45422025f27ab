//! Runs the experiment `radius`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("radius")
}
