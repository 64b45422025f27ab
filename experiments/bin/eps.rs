//! Runs the experiment `eps`.

fn main() {}
