//! Runs the experiment `bounds`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("bounds")
}
