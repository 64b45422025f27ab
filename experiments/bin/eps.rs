//! Runs the experiment `eps`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("eps")
}
