//! One readable file per question, with its prediction.

pub mod cup;
pub mod eps;
pub mod newton_seeds;

use crate::lab::experiment::Experiment;

/// All experiments, in the order of the page.
pub const ALL: &[Experiment] = &[newton_seeds::EXPERIMENT, eps::EXPERIMENT];
