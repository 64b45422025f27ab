//! Runs the experiment `photons`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("photons")
}
