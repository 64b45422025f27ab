//! Runs the experiment `index`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("index")
}
