//! Runs the experiment `newton_seeds`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("newton_seeds")
}
