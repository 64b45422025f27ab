//! The law of nested failures.

/// Exponent b of failures ~ k^b from nested counts (k, failures), with its standard error.
///
/// Because the starts are nested, a ray that fails at k is one of those that failed at every smaller k, and the counts are a
/// chain of binomials with survival pⱼ = (kⱼ₊₁/kⱼ)^b. The likelihood's derivative falls in −b, so bisection finds its zero; the
/// standard error is 1/√(Fisher information), Σ fⱼ xⱼ² pⱼ/(1 − pⱼ) with xⱼ = ln(kⱼ₊₁/kⱼ).
pub fn survival_exponent(counts: &[(f64, f64)]) -> Option<(f64, f64)> {
    let steps: Vec<(f64, f64, f64)> = counts
        .windows(2)
        .filter(|w| w[0].1 > 0.0)
        .map(|w| (libm::log(w[1].0 / w[0].0), w[0].1, w[1].1))
        .collect();
    let lost: f64 = steps.iter().map(|s| s.1 - s.2).sum();
    let kept: f64 = steps.iter().map(|s| s.2).sum();
    if lost <= 0.0 || kept <= 0.0 {
        return None;
    }
    let score = |decay: f64| -> f64 {
        let term = |&(x, before, after): &(f64, f64, f64)| {
            let p = libm::exp(-decay * x);
            x * ((before - after) * p / (1.0 - p) - after)
        };
        steps.iter().map(term).sum()
    };
    let (mut low, mut high) = (1e-6, 100.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if score(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let information: f64 = steps
        .iter()
        .map(|&(x, before, _)| {
            let p = libm::exp(-low * x);
            before * x * x * p / (1.0 - p)
        })
        .sum();
    Some((-low, 1.0 / information.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected counts of a power law give its exponent back; those of an exponential law are far from it.
    #[test]
    fn nested_counts_of_a_power_law_give_its_exponent() {
        let levels = [10.0, 20.0, 30.0, 50.0, 100.0, 200.0];
        let power = levels.map(|k: f64| (k, 1e6 * libm::pow(k / 10.0, -1.7)));
        let (exponent, error) = survival_exponent(&power).unwrap();
        assert!((exponent + 1.7).abs() < 1e-9, "{exponent}");
        assert!(error > 0.0 && error < 0.01);
        let exponential = levels.map(|k: f64| (k, 1e6 * libm::exp(-0.1 * (k - 10.0))));
        let (exponent, error) = survival_exponent(&exponential).unwrap();
        assert!((exponent + 1.7).abs() > 20.0 * error, "{exponent}");
        assert!(survival_exponent(&[(10.0, 5.0), (20.0, 0.0)]).is_none());
        assert!(survival_exponent(&[]).is_none());
    }

    /// 25 of 100 survive a doubling: exponent −2, and by the binomial law an error of √((1 − p)/(100 p))/ln 2 with p = ¼.
    #[test]
    fn one_step_has_the_error_of_a_binomial_share() {
        let (exponent, error) = survival_exponent(&[(1.0, 100.0), (2.0, 25.0)]).unwrap();
        assert!((exponent + 2.0).abs() < 1e-9, "{exponent}");
        assert!((error * std::f64::consts::LN_2 - 0.03_f64.sqrt()).abs() < 1e-9);
        assert!(survival_exponent(&[(1.0, 100.0), (2.0, 100.0)]).is_none());
        // Where nothing is left to fail, nothing more is learnt.
        let some = survival_exponent(&[(1.0, 9.0), (2.0, 4.0), (4.0, 0.0)]);
        let more = survival_exponent(&[(1.0, 9.0), (2.0, 4.0), (4.0, 0.0), (8.0, 0.0)]);
        assert!(some.is_some() && some == more);
    }
}
