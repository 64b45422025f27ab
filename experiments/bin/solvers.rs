//! Runs the experiment `solvers`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("solvers")
}
