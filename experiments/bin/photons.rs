//! Runs the experiment `photons`.

fn main() {}
