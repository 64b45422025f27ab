//! Runs the experiment `dose`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("dose")
}
