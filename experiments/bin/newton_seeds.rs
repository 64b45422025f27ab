//! Runs the experiment `newton_seeds`.

fn main() {}
