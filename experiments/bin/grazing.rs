//! Runs the experiment `grazing`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("grazing")
}
