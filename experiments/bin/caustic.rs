//! Runs the experiment `caustic`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("caustic")
}
