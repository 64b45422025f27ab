//! Runs the experiment `analytic`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("analytic")
}
