//! Runs the experiment `agreement`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("agreement")
}
