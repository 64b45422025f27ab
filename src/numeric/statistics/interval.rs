//! Exact intervals and quantiles.

use statrs::distribution::{Beta, ContinuousCDF, Gamma, Normal, StudentsT};

/// Interval of a rate after `hits` in `trials` (Clopper and Pearson 1934): covers the true rate with at least `confidence`.
/// (0, 1) without trials.
pub fn binomial_interval(hits: u64, trials: u64, confidence: f64) -> (f64, f64) {
    let tail = (1.0 - confidence) / 2.0;
    let (k, n) = (hits as f64, trials as f64);
    let low = if hits == 0 {
        0.0
    } else {
        beta_quantile(k, n - k + 1.0, tail)
    };
    let high = if hits >= trials {
        1.0
    } else {
        beta_quantile(k + 1.0, n - k, 1.0 - tail)
    };
    (low, high)
}

/// The x with P(X ≤ x) = p for a Beta law, by bisection over the floats from 0 to 1; NaN for parameters that are not positive.
///
/// `Beta::inverse_cdf` does not return for some parameters in the millions (statrs 0.19: a = 1, b = 8·10⁶).
fn beta_quantile(a: f64, b: f64, p: f64) -> f64 {
    let Ok(law) = Beta::new(a, b) else {
        return f64::NAN;
    };
    // The bits of floats that are not negative are in the order of their values.
    let (mut low, mut high) = (0.0_f64.to_bits(), 1.0_f64.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if law.cdf(f64::from_bits(middle)) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::from_bits(high)
}

/// Interval of the expectation of a Poisson count (Garwood 1936).
pub fn poisson_interval(count: u64, confidence: f64) -> (f64, f64) {
    let tail = (1.0 - confidence) / 2.0;
    let quantile =
        |shape: f64, p: f64| Gamma::new(shape, 1.0).map_or(f64::NAN, |law| law.inverse_cdf(p));
    let low = if count == 0 {
        0.0
    } else {
        quantile(count as f64, tail)
    };
    (low, quantile(count as f64 + 1.0, 1.0 - tail))
}

/// Upper bound, at `confidence`, of a rate that showed no failure in `trials`: 1 − (1 − confidence)^(1/trials). At 95 % about
/// 3/trials, the rule of three. 1 without trials.
pub fn zero_failures_bound(trials: u64, confidence: f64) -> f64 {
    if trials == 0 {
        return 1.0;
    }
    -libm::expm1(libm::log1p(-confidence) / trials as f64)
}

/// The x with P(T ≤ x) = p for Student's T; NaN if `freedom` is not positive.
pub fn student_quantile(p: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |law| law.inverse_cdf(p))
}

/// The x with P(Z ≤ x) = p for a standard normal Z.
pub fn normal_quantile(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p)
}
