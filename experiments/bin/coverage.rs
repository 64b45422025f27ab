//! Runs the experiment `coverage`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("coverage")
}
