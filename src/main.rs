//! The `photolathe` command.

fn main() {}
