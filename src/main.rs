//! The `photolathe` command: see `src/cli/` for its subcommands.

use std::process::ExitCode;

fn main() -> ExitCode {
    photolathe::cli::main()
}
