//! Runs the experiment `time_to_error`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("time_to_error")
}
