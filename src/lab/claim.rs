//! Claims: what was predicted, what was measured, and the verdict.
//!
//! A claim about an estimate gets two looks: where the first rejects at [`FIRST_LOOK`], the lab runs the experiment again with fresh
//! random numbers and that decides, at [`SECOND_LOOK`]. A single look rejects at [`CLAIM_LEVEL`].
//!
//! The kinds. *Exact*: a count of failures that must be 0. *Null*: a value without bias, tested at [`CLAIM_LEVEL`] and, with
//! a margin, proved equivalent by two one-sided tests (Schuirmann 1987) at [`PROOF_LEVEL`]. *Family*: many such values at once,
//! corrected for their number (Holm 1979). *Law*: a slope or constant of a fit,
//! with the precision that it must be known to. A claim names the least effort that decides it: below, its verdict is "not
//! run"; from there on an inconclusive one fails the run, so that a growing variance cannot hide.

use super::experiment::Effort;
use crate::numeric::statistics::{
    Moments, binomial_interval, holm_smallest, student_quantile, two_sided_student,
    zero_failures_bound,
};
use serde::{Deserialize, Serialize};

/// Family-wise rate of false alarms over a whole run of all experiments.
pub const FAMILY_LEVEL: f64 = 1e-6;
/// Level of one claim: the family's, shared by at most 250 claims (Bonferroni).
pub const CLAIM_LEVEL: f64 = FAMILY_LEVEL / 250.0;
/// Level at which the first look at a claim raises doubt.
pub const FIRST_LOOK: f64 = 1e-3;
/// Level at which a second look, with fresh random numbers, rejects: what the first leaves of [`CLAIM_LEVEL`], as a false alarm
/// needs both.
pub const SECOND_LOOK: f64 = CLAIM_LEVEL / FIRST_LOOK;
/// Level of each one-sided test of an equivalence: the rate of false *proofs*.
pub const PROOF_LEVEL: f64 = 0.01;
/// Confidence of the intervals shown.
pub const SHOWN_CONFIDENCE: f64 = 0.95;
/// Power that the smallest detectable effect refers to.
const POWER: f64 = 0.9;
/// Degrees of freedom that stand for infinitely many: Student's law is then the normal law to seven digits.
const MANY: f64 = 1e6;

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

impl Verdict {
    /// The word for tables and pages.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Inconclusive => "inconclusive",
            Self::NotRun => "not run",
        }
    }
}

/// How far a measurement is from its prediction (or margin), for the two looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Doubt {
    /// Not beyond [`FIRST_LOOK`], or no statistics: counts, ranges, claims that are not run.
    #[default]
    None,
    /// Beyond [`FIRST_LOOK`]: fresh random numbers decide.
    First,
    /// Beyond [`SECOND_LOOK`] too.
    Second,
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
    /// Whether the measurement asks for a second look.
    #[serde(skip)]
    pub doubt: Doubt,
}

/// What a claim is about, and when it is decided.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// Experiment it belongs to.
    pub experiment: &'a str,
    /// Short name, unique in the experiment.
    pub claim: &'a str,
    /// The statement in one sentence.
    pub statement: &'a str,
    /// Least effort that decides the claim.
    pub decided_at: Effort,
    /// Effort of this run.
    pub effort: Effort,
}

/// A measured value: a mean, its standard error, and what they rest on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error, > 0, or 0 if it is exact.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error; infinite if it is known.
    pub freedom: f64,
    /// Number of independent observations.
    pub n: u64,
}

impl Estimate {
    /// The mean of independent replicates, by Student's law.
    pub fn of(replicates: &Moments) -> Self {
        Self {
            value: replicates.mean(),
            standard_error: replicates.standard_error(),
            freedom: replicates.count() as f64 - 1.0,
            n: replicates.count(),
        }
    }

    /// A value whose standard error is known, not estimated.
    pub fn known(value: f64, standard_error: f64, n: u64) -> Self {
        Self {
            value,
            standard_error,
            freedom: f64::INFINITY,
            n,
        }
    }

    /// Half-width of the interval whose two tails hold `tails` together.
    fn half_width(&self, tails: f64) -> f64 {
        if self.standard_error == 0.0 {
            return 0.0;
        }
        student_quantile(1.0 - 0.5 * tails, self.freedom.min(MANY)) * self.standard_error
    }

    /// Doubt about a value that is this far from where it may be.
    fn doubt(&self, excess: f64) -> Doubt {
        if excess > self.half_width(SECOND_LOOK) {
            Doubt::Second
        } else if excess > self.half_width(FIRST_LOOK) {
            Doubt::First
        } else {
            Doubt::None
        }
    }

    /// Two-sided p of a value that is this far (≥ 0) from where it may be.
    fn p(&self, excess: f64) -> f64 {
        if excess <= 0.0 {
            1.0
        } else if self.standard_error == 0.0 {
            0.0
        } else {
            two_sided_student(excess / self.standard_error, self.freedom.min(MANY))
        }
    }

    /// How far from 0 two one-sided tests at [`PROOF_LEVEL`] let the value be at most.
    pub fn proven_bound(&self) -> f64 {
        self.value.abs() + self.half_width(2.0 * PROOF_LEVEL)
    }

    /// Deviation that a two-sided test at `level` sees with the power that claims state.
    fn detectable(&self, level: f64) -> f64 {
        self.half_width(level) + self.half_width(2.0 * (1.0 - POWER))
    }
}

/// One of many differences that should be 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The difference.
    pub difference: Estimate,
    /// What is known to be different, ≥ 0, in the same unit.
    pub allowed: f64,
}

impl Claim {
    /// Exact: none of `n` checks may fail. Shows the rate of failures; without failures, rates above the upper end of the interval
    /// (the rule of three, 3/n) would have been seen with 95 % probability.
    pub fn exact(subject: Subject, failures: u64, n: u64) -> Self {
        let rate = if n == 0 {
            f64::NAN
        } else {
            failures as f64 / n as f64
        };
        let bound = zero_failures_bound(n, SHOWN_CONFIDENCE);
        let interval = if failures == 0 {
            (0.0, bound)
        } else {
            binomial_interval(failures, n, SHOWN_CONFIDENCE)
        };
        let verdict = match (failures, n) {
            (0, 0) => Verdict::Inconclusive,
            (0, _) => Verdict::Pass,
            _ => Verdict::Fail,
        };
        subject.claim((0.0, rate, interval), n, bound, verdict)
    }

    /// Null: the estimate has the predicted expectation. Fails if it differs at [`CLAIM_LEVEL`]; inconclusive if it could not have
    /// seen a deviation of `needed`.
    pub fn null(subject: Subject, estimate: Estimate, predicted: f64, needed: f64) -> Self {
        let deviation = (estimate.value - predicted).abs();
        let detectable = estimate.detectable(CLAIM_LEVEL);
        let verdict = if deviation.is_nan() || detectable.is_nan() {
            Verdict::Inconclusive
        } else if deviation > estimate.half_width(CLAIM_LEVEL) {
            Verdict::Fail
        } else if detectable > needed {
            Verdict::Inconclusive
        } else {
            Verdict::Pass
        };
        subject
            .estimated(&estimate, predicted, detectable, verdict)
            .doubted(estimate.doubt(deviation))
    }

    /// Null with a margin: the expectation lies within `margin` of the prediction. Passes if two one-sided tests at
    /// [`PROOF_LEVEL`] prove it (so a deviation of `margin` passes with at most that probability), fails if the deviation is
    /// larger than the margin at [`CLAIM_LEVEL`].
    pub fn equivalent(subject: Subject, estimate: Estimate, predicted: f64, margin: f64) -> Self {
        let deviation = (estimate.value - predicted).abs();
        let proof = estimate.half_width(2.0 * PROOF_LEVEL);
        let verdict = if deviation + proof <= margin {
            Verdict::Pass
        } else if deviation - estimate.half_width(CLAIM_LEVEL) > margin {
            Verdict::Fail
        } else {
            Verdict::Inconclusive
        };
        subject
            .estimated(&estimate, predicted, margin, verdict)
            .doubted(estimate.doubt(deviation - margin))
    }

    /// Family: none of many differences is larger than what is allowed to it. Fails if Holm's smallest corrected p (1979) is at most
    /// [`CLAIM_LEVEL`]; inconclusive if some comparison could not have seen a deviation of `needed`. Shows the difference with the
    /// smallest p, with an interval for it alone; `n` counts the comparisons, and `detectable` is that of the coarsest of them.
    pub fn family(subject: Subject, comparisons: &[Comparison], needed: f64) -> Self {
        let p = |one: &Comparison| one.difference.p(one.difference.value.abs() - one.allowed);
        let p_values: Vec<f64> = comparisons.iter().map(p).collect();
        let smallest = holm_smallest(&p_values);
        let level = CLAIM_LEVEL / comparisons.len().max(1) as f64;
        let detectable = comparisons
            .iter()
            .map(|one| one.allowed + one.difference.detectable(level))
            .fold(0.0, f64::max);
        let suspect = p_values.iter().zip(comparisons).min_by(|(a, x), (b, y)| {
            let size = |one: &Comparison| one.difference.value.abs();
            a.total_cmp(b).then(size(y).total_cmp(&size(x)))
        });
        let shown = suspect.map_or(Estimate::known(f64::NAN, f64::NAN, 0), |(_, one)| {
            Estimate {
                n: comparisons.len() as u64,
                ..one.difference
            }
        });
        let verdict = if smallest <= CLAIM_LEVEL {
            Verdict::Fail
        } else if comparisons.is_empty() || smallest.is_nan() || detectable > needed {
            Verdict::Inconclusive
        } else {
            Verdict::Pass
        };
        let doubt = match smallest {
            p if p <= SECOND_LOOK => Doubt::Second,
            p if p <= FIRST_LOOK => Doubt::First,
            _ => Doubt::None,
        };
        subject
            .estimated(&shown, 0.0, detectable, verdict)
            .doubted(doubt)
    }

    /// Range: a value with an interval (say, of a rate) lies in `low..=high`. Passes if the interval is inside, fails if it is
    /// outside. The prediction shown is the middle of the range; deviations of half its width would have been seen.
    pub fn in_range(
        subject: Subject,
        measured: f64,
        interval: (f64, f64),
        n: u64,
        range: (f64, f64),
    ) -> Self {
        let verdict = if range.0 <= interval.0 && interval.1 <= range.1 {
            Verdict::Pass
        } else if interval.1 < range.0 || range.1 < interval.0 {
            Verdict::Fail
        } else {
            Verdict::Inconclusive
        };
        let (middle, half) = (0.5 * (range.0 + range.1), 0.5 * (range.1 - range.0));
        subject.claim((middle, measured, interval), n, half, verdict)
    }

    /// Range of a share: `hits` of `n` independent trials, by the exact binomial interval.
    pub fn share_in_range(subject: Subject, hits: u64, n: u64, range: (f64, f64)) -> Self {
        let interval = binomial_interval(hits, n, SHOWN_CONFIDENCE);
        Self::in_range(subject, hits as f64 / n as f64, interval, n, range)
    }

    /// Law: a fitted slope or constant is the predicted one. Fails if the prediction is outside the interval of
    /// [`CLAIM_LEVEL`], inconclusive if the half-width of the 95 % interval exceeds `precision`.
    pub fn law(subject: Subject, estimate: Estimate, predicted: f64, precision: f64) -> Self {
        let deviation = (estimate.value - predicted).abs();
        let shown = estimate.half_width(1.0 - SHOWN_CONFIDENCE);
        let verdict = if deviation > estimate.half_width(CLAIM_LEVEL) {
            Verdict::Fail
        } else if shown <= precision && deviation.is_finite() {
            Verdict::Pass
        } else {
            Verdict::Inconclusive
        };
        let detectable = estimate.detectable(CLAIM_LEVEL);
        subject
            .estimated(&estimate, predicted, detectable, verdict)
            .doubted(estimate.doubt(deviation))
    }

    fn doubted(mut self, doubt: Doubt) -> Self {
        if self.verdict != Verdict::NotRun {
            self.doubt = doubt;
        }
        self
    }

    /// What holds after a second look: the measurement of fresh random numbers, which fails beyond [`SECOND_LOOK`]; without one,
    /// what the first look alone says at [`CLAIM_LEVEL`]. The statement says which.
    #[must_use]
    pub fn looked_at_again(&self, second: Option<&Self>) -> Self {
        let mut claim = second.unwrap_or(self).clone();
        claim.statement += match second {
            Some(_) => " (Second look: fresh random numbers, as the first rejected at .001.)",
            None => " (The first look rejected at .001, and there was no second.)",
        };
        if second.is_some_and(|second| second.doubt == Doubt::Second) {
            claim.verdict = Verdict::Fail;
        }
        claim
    }

    /// Whether the claim makes the run fail: it failed, or its effort should have decided it.
    pub fn fails_the_run(&self) -> bool {
        matches!(self.verdict, Verdict::Fail | Verdict::Inconclusive)
    }
}

impl Subject<'_> {
    fn estimated(
        self,
        estimate: &Estimate,
        predicted: f64,
        detectable: f64,
        verdict: Verdict,
    ) -> Claim {
        let half = estimate.half_width(1.0 - SHOWN_CONFIDENCE);
        let interval = (estimate.value - half, estimate.value + half);
        self.claim(
            (predicted, estimate.value, interval),
            estimate.n,
            detectable,
            verdict,
        )
    }

    fn claim(
        self,
        (predicted, measured, interval): (f64, f64, (f64, f64)),
        n: u64,
        detectable: f64,
        verdict: Verdict,
    ) -> Claim {
        Claim {
            experiment: self.experiment.to_owned(),
            claim: self.claim.to_owned(),
            statement: self.statement.to_owned(),
            predicted,
            measured,
            ci_low: interval.0,
            ci_high: interval.1,
            n,
            detectable,
            effort: self.decided_at,
            verdict: if self.effort < self.decided_at {
                Verdict::NotRun
            } else {
                verdict
            },
            doubt: Doubt::None,
        }
    }
}
