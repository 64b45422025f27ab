//! Runs the experiment `lens`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("lens")
}
