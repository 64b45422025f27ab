//! Ray families hold what they say, suites tell the truth, and grades count what was planted.

mod command;
mod families;
mod truth;
