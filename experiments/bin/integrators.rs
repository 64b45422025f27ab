//! Runs the experiment `integrators`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("integrators")
}
