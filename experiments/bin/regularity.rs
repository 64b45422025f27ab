//! Runs the experiment `regularity`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::experiment::main("regularity")
}
