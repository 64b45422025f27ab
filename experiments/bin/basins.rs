//! Runs the experiment `basins`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("basins")
}
