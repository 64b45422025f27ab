//! Statistics: moments, tests of hypotheses, intervals, fits. Distributions come from `statrs`, the normal tail from `libm`.
//!
//! Every p-value is two-sided unless its name says otherwise. Levels, confidences and p-values are in [0, 1].

mod fit;
mod hypothesis;
mod interval;
mod survival;

pub use fit::{Fit, GeneralisedFit, fit_generalised, fit_line};
pub use hypothesis::{
    Test, chi_square, holm, holm_smallest, kolmogorov_smirnov, ks_uniform, student,
    two_sided_normal, two_sided_student, welch, z_test,
};
pub use interval::{
    binomial_interval, normal_quantile, poisson_interval, student_quantile, zero_failures_bound,
};
pub use survival::survival_exponent;

/// Running mean and variance of a sample (Welford 1962); parts join (Chan, Golub and LeVeque 1979).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// The moments of all values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        values.into_iter().fold(Self::default(), |mut all, x| {
            all.add(x);
            all
        })
    }

    /// Adds a value.
    pub fn add(&mut self, x: f64) {
        self.count += 1;
        let before = x - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (x - self.mean);
    }

    /// Adds the values of another part. The result depends on the order of joins in its last bits.
    pub fn join(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (mine, theirs) = (self.count as f64, other.count as f64);
        let all = mine + theirs;
        let step = other.mean - self.mean;
        self.mean += step * theirs / all;
        self.squares += other.squares + step * step * mine * theirs / all;
        self.count += other.count;
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased estimate of the variance; NaN below two values.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            return f64::NAN;
        }
        self.squares / (self.count - 1) as f64
    }

    /// Standard error of the mean; NaN below two values.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NIST StRD "NumAcc3": 1000000.2 once, then 1000000.1 and 1000000.3 alternating; mean 1000000.2, deviation 0.1.
    #[test]
    fn moments_survive_a_large_offset() {
        let values = (0..1001).map(|i| {
            if i == 0 {
                1_000_000.2
            } else {
                1_000_000.1 + 0.2 * f64::from(i % 2 == 0)
            }
        });
        let moments = Moments::of(values);
        assert!((moments.mean() - 1_000_000.2).abs() < 1e-8);
        assert!((moments.variance().sqrt() - 0.1).abs() < 1e-8);
    }

    #[test]
    fn joined_parts_equal_the_whole() {
        let values: Vec<f64> = (0..50).map(|i| libm::sin(f64::from(i)) + 3.0).collect();
        let mut joined = Moments::default();
        joined.join(&Moments::of(values[..13].iter().copied()));
        joined.join(&Moments::default());
        joined.join(&Moments::of(values[13..].iter().copied()));
        let whole = Moments::of(values);
        assert_eq!(joined.count(), whole.count());
        assert!((joined.mean() - whole.mean()).abs() < 1e-14);
        assert!((joined.variance() - whole.variance()).abs() < 1e-13);
    }

    #[test]
    fn one_value_has_no_variance_and_two_have_one() {
        assert!(Moments::of([2.0]).variance().is_nan());
        assert!(Moments::of([2.0]).standard_error().is_nan());
        let two = Moments::of([2.0, 6.0]);
        assert_eq!((two.variance(), two.standard_error()), (8.0, 2.0));
        assert_eq!((two.count(), two.mean()), (2, 4.0));
    }
}
