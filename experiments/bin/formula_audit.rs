//! Runs the experiment `formula_audit`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("formula_audit")
}
