//! Runs the experiment `scaling`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("scaling")
}
