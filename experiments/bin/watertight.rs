//! Runs the experiment `watertight`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("watertight")
}
