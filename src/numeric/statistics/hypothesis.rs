//! Tests of hypotheses.

use super::Moments;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// The result of a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// The statistic: z, t, χ² or D.
    pub statistic: f64,
    /// Degrees of freedom; infinite where the statistic has none.
    pub freedom: f64,
    /// Probability of a statistic at least as extreme if the hypothesis holds. NaN if the data cannot say.
    pub p: f64,
}

/// Probability of |Z| ≥ |z| for a standard normal Z, accurate in the tails.
pub fn two_sided_normal(z: f64) -> f64 {
    libm::erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// Probability of |T| ≥ |t| for Student's T; NaN if `freedom` is not positive or `t` is NaN.
pub fn two_sided_student(t: f64, freedom: f64) -> f64 {
    if t.is_nan() {
        return f64::NAN;
    }
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |d| 2.0 * d.cdf(-t.abs()))
}

/// z of an estimate with a known standard error against the predicted value.
pub fn z_test(estimate: f64, standard_error: f64, predicted: f64) -> Test {
    let z = (estimate - predicted) / standard_error;
    Test {
        statistic: z,
        freedom: f64::INFINITY,
        p: two_sided_normal(z),
    }
}

/// Student's t of a sample against a predicted mean.
pub fn student(sample: &Moments, predicted: f64) -> Test {
    let t = (sample.mean() - predicted) / sample.standard_error();
    let freedom = sample.count() as f64 - 1.0;
    Test {
        statistic: t,
        freedom,
        p: two_sided_student(t, freedom),
    }
}

/// Welch's t of two samples that may differ in variance (Welch 1947).
pub fn welch(a: &Moments, b: &Moments) -> Test {
    let (va, vb) = (
        a.variance() / a.count() as f64,
        b.variance() / b.count() as f64,
    );
    let t = (a.mean() - b.mean()) / (va + vb).sqrt();
    let freedom = (va + vb) * (va + vb)
        / (va * va / (a.count() as f64 - 1.0) + vb * vb / (b.count() as f64 - 1.0));
    Test {
        statistic: t,
        freedom,
        p: two_sided_student(t, freedom),
    }
}

/// Pearson's χ² of counts against expected counts; `fitted` parameters were taken from the same data. The law of χ² is a
/// limit: join bins until each expects at least about 5. NaN p if lengths differ or an expected count is not positive.
pub fn chi_square(observed: &[u64], expected: &[f64], fitted: usize) -> Test {
    let valid = observed.len() == expected.len() && expected.iter().all(|&e| e > 0.0);
    let statistic: f64 = observed
        .iter()
        .zip(expected)
        .map(|(&o, &e)| (o as f64 - e) * (o as f64 - e) / e)
        .sum();
    let freedom = observed.len() as f64 - 1.0 - fitted as f64;
    let p = match ChiSquared::new(freedom) {
        Ok(law) if valid => law.sf(statistic),
        _ => f64::NAN,
    };
    Test {
        statistic,
        freedom,
        p,
    }
}

/// Kolmogorov-Smirnov test of a sample against a continuous distribution function. The p-value is Kolmogorov's limit at
/// Stephens' corrected statistic (1970), good to a few per cent of p from n = 5 on.
pub fn kolmogorov_smirnov(sample: &[f64], distribution: impl Fn(f64) -> f64) -> Test {
    let mut values: Vec<f64> = sample.iter().map(|&x| distribution(x)).collect();
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len() as f64;
    let steps = values.iter().enumerate();
    let statistic = steps.fold(0.0_f64, |d, (i, &f)| {
        // A NaN value must not vanish in the maximum.
        if f.is_nan() {
            return f64::NAN;
        }
        d.max(f - i as f64 / n).max((i + 1) as f64 / n - f)
    });
    let root = n.sqrt();
    Test {
        statistic,
        freedom: f64::INFINITY,
        p: kolmogorov_tail((root + 0.12 + 0.11 / root) * statistic),
    }
}

/// The same test of p-values against the uniform distribution.
pub fn ks_uniform(p_values: &[f64]) -> Test {
    kolmogorov_smirnov(p_values, |p| p)
}

/// 2 Σ (−1)^(k−1) exp(−2k²x²) (Kolmogorov 1933).
fn kolmogorov_tail(x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    // Below 0.2 the probability is 1 to all digits and the series converges slowly.
    if x < 0.2 {
        return 1.0;
    }
    let term = |k: i32| {
        let k = f64::from(k);
        libm::exp(-2.0 * k * k * x * x)
    };
    let sum: f64 = (1..=100)
        .map(|k| if k % 2 == 1 { term(k) } else { -term(k) })
        .sum();
    (2.0 * sum).clamp(0.0, 1.0)
}

/// Holm's corrected p-values (1979), in the order given: rejecting those ≤ α keeps the family-wise error at α.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_unstable_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut corrected = vec![0.0; p_values.len()];
    let mut running = 0.0_f64;
    for (rank, &index) in order.iter().enumerate() {
        let scaled = (p_values.len() - rank) as f64 * p_values[index];
        running = if scaled.is_nan() {
            f64::NAN
        } else {
            running.max(scaled.min(1.0))
        };
        corrected[index] = running;
    }
    corrected
}

/// The smallest of Holm's corrected p-values: that of the whole family. 1 for an empty family, NaN if any is.
pub fn holm_smallest(p_values: &[f64]) -> f64 {
    if p_values.iter().any(|p| p.is_nan()) {
        return f64::NAN;
    }
    let least = p_values.iter().copied().fold(1.0, f64::min);
    (least * p_values.len().max(1) as f64).min(1.0)
}
