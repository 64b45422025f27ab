//! Claims: what was predicted, what was measured, and the verdict.

use super::experiment::Effort;
use serde::{Deserialize, Serialize};

/// The verdict of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The measurement agrees with the prediction.
    Pass,
    /// It does not.
    Fail,
    /// The measurement cannot tell.
    Inconclusive,
    /// The effort was below the one that decides this claim.
    #[serde(rename = "not run")]
    NotRun,
}

/// One checked statement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// Experiment it belongs to.
    pub experiment: String,
    /// Short name, unique in the experiment.
    pub claim: String,
    /// The statement in one sentence.
    pub statement: String,
    /// Predicted value.
    pub predicted: f64,
    /// Measured value.
    pub measured: f64,
    /// Lower end of the interval of the measurement.
    pub ci_low: f64,
    /// Upper end of the interval of the measurement.
    pub ci_high: f64,
    /// Number of independent observations.
    pub n: u64,
    /// Smallest deviation from the prediction that this measurement would have seen.
    pub detectable: f64,
    /// Least effort that decides the claim.
    pub effort: Effort,
    /// The verdict.
    pub verdict: Verdict,
}
