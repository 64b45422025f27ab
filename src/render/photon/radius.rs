//! How the gather radius shrinks from pass to pass: rules as data, and pure functions of their numbers.
//!
//! Every rule multiplies the **square** of a first radius by a `shrink` in [0, 1]. With α in (0, 1], M photons in a pass and N
//! kept so far:
//!
//! ```text
//! local      N' = N + α M,  r'² = r² (N + α M) / (N + M)      Hachisuka, Ogaki and Jensen 2008; per pixel: Hachisuka and Jensen 2009
//! global     r²_{i+1} = r²_i (i + α) / (i + 1),  i = 1, 2, …  Knaus and Zwicker 2011
//! constant   r'² = r²
//! geometric  r' = 0.95 r                                      the original course report's; a negative control
//! ```
//!
//! Under the geometric rule the variance of the mean over n passes is V₁ Σ 0.95^(−2i) / n²: it falls until about the 25th pass and
//! then grows for ever. The report's program hid that by a slip: as the radius shrank by 0.95 it raised the worth of a photon by
//! 1/0.95, where the area asks for 1/0.95² (`geometric-as-coded`). Pass i is then 0.95^i times too dark, i = 0, 1, …, and the mean
//! over n passes tends to black as (1 − 0.95ⁿ)/(0.05 n). (That program weighted its passes by 1/i and used another kernel; here
//! passes weigh the same and the kernel is the one in force.)

use crate::scene::options::Rule;

/// Radius statistics of one hit point (or of one pixel, if its hit points change from pass to pass).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Square of the radius over the square of the first one.
    pub shrink: f64,
    /// Photons kept: Σ α M. An f64, so that it neither wraps nor overflows.
    pub kept: f64,
}

impl Default for Statistics {
    fn default() -> Self {
        Self {
            shrink: 1.0,
            kept: 0.0,
        }
    }
}

impl Statistics {
    /// The statistics after a pass that found `photons`. Without photons nothing changes.
    #[must_use]
    pub fn after(self, photons: f64, alpha: f64) -> Self {
        if photons == 0.0 {
            return self;
        }
        let kept = self.kept + alpha * photons;
        Self {
            shrink: self.shrink * (kept / (self.kept + photons)),
            kept,
        }
    }
}

/// r²_{i+1} / r²_i of the global schedule, i = 1, 2, ….
pub fn global_step(i: u64, alpha: f64) -> f64 {
    (i as f64 + alpha) / (i as f64 + 1.0)
}

/// Factor on the radius in every pass of the geometric rule.
pub const GEOMETRIC: f64 = 0.95;

impl Rule {
    /// What takes the place of r² in the area that flux is divided by: r² itself, but under `geometric-as-coded`.
    pub fn divisor(self, first_squared: f64, squared: f64) -> f64 {
        match self {
            Self::GeometricAsCoded => first_squared.sqrt() * squared.sqrt(),
            Self::Local | Self::Global | Self::Constant | Self::Geometric => squared,
        }
    }
}

/// The shrink of every pass under a rule that does not look at photons, computed pass after pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    rule: Rule,
    alpha: f64,
    pass: u64,
    shrink: f64,
}

impl Schedule {
    /// A schedule before pass 0.
    pub fn new(rule: Rule, alpha: f64) -> Self {
        Self {
            rule,
            alpha,
            pass: 0,
            shrink: 1.0,
        }
    }

    /// Square of the radius of pass `pass` = 0, 1, … over the square of the first; 1 under the local rule.
    pub fn shrink(&mut self, pass: u64) -> f64 {
        let step: fn(u64, f64) -> f64 = match self.rule {
            Rule::Local | Rule::Constant => return 1.0,
            Rule::Global => global_step,
            Rule::Geometric | Rule::GeometricAsCoded => |_, _| GEOMETRIC * GEOMETRIC,
        };
        if pass < self.pass {
            *self = Self::new(self.rule, self.alpha);
        }
        while self.pass < pass {
            self.pass += 1;
            self.shrink *= step(self.pass, self.alpha);
        }
        self.shrink
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use libm::{lgamma, tgamma};

    fn close(a: f64, b: f64, tolerance: f64) -> bool {
        (a - b).abs() <= tolerance * b.abs()
    }

    /// Γ(a)/Γ(b) for large close arguments, through the logarithm.
    fn gamma_ratio(a: f64, b: f64) -> f64 {
        libm::exp(lgamma(a) - lgamma(b))
    }

    #[test]
    fn the_global_schedule_has_its_closed_form() {
        for alpha in [0.5, 2.0 / 3.0, 0.7, 0.75] {
            let mut schedule = Schedule::new(Rule::Global, alpha);
            for n in [1_u64, 2, 3, 10, 50] {
                let x = n as f64;
                // r_n² = r_1² Γ(n + α) / (Γ(1 + α) Γ(n + 1)); the first pass has number 0.
                let closed = gamma_ratio(x + alpha, x + 1.0) / tgamma(1.0 + alpha);
                let got = schedule.shrink(n - 1);
                assert!(close(got, closed, 1e-12), "{alpha} {n}: {got} {closed}");
            }
            let asymptotic = libm::pow(1e5, alpha - 1.0) / tgamma(1.0 + alpha);
            assert!(close(schedule.shrink(99_999), asymptotic, 1e-5));
        }
    }

    #[test]
    fn a_schedule_may_be_asked_for_any_pass_in_any_order() {
        let in_order: Vec<f64> = {
            let mut schedule = Schedule::new(Rule::Global, 0.7);
            (0..9).map(|pass| schedule.shrink(pass)).collect()
        };
        let mut schedule = Schedule::new(Rule::Global, 0.7);
        for pass in [8, 3, 3, 5, 0, 1, 8] {
            assert_eq!(schedule.shrink(pass), in_order[pass as usize], "{pass}");
        }
        for rule in [Rule::Local, Rule::Constant] {
            assert_eq!(Schedule::new(rule, 0.7).shrink(5), 1.0);
        }
    }

    #[test]
    fn the_geometric_rules_shrink_the_radius_by_a_twentieth_whatever_alpha() {
        for rule in [Rule::Geometric, Rule::GeometricAsCoded] {
            let mut schedule = Schedule::new(rule, 0.7);
            for pass in [0, 1, 2, 79] {
                let expected = libm::pow(0.95, 2.0 * pass as f64);
                assert!(close(schedule.shrink(pass), expected, 1e-12), "{pass}");
            }
            // It ends among the least of numbers, and is never a NaN.
            assert!((0.0..1e-300).contains(&schedule.shrink(100_000)));
        }
    }

    /// M23, gain 1/0.95 for 1/0.95²: what an even density of photons reads pass by pass.
    #[test]
    fn only_as_coded_the_geometric_rule_reads_less_and_less_of_an_even_density() {
        let reads = |rule: Rule, pass| {
            let (first, mut schedule) = (0.04, Schedule::new(rule, 1.0));
            let squared = first * schedule.shrink(pass);
            // The flux found is in proportion to the disc.
            squared / rule.divisor(first, squared)
        };
        for pass in [0, 1, 10, 80] {
            for rule in [Rule::Local, Rule::Global, Rule::Constant, Rule::Geometric] {
                assert_eq!(reads(rule, pass), 1.0);
            }
            let dimmed = libm::pow(0.95, pass as f64);
            assert!(close(reads(Rule::GeometricAsCoded, pass), dimmed, 1e-12));
        }
    }

    /// Relative variance Σ r_1²/r_i² / n² of the mean over n passes, in units of that of one pass at the first radius.
    fn relative_variance(rule: Rule, passes: u64) -> f64 {
        let mut schedule = Schedule::new(rule, 2.0 / 3.0);
        let sum: f64 = (0..passes).map(|pass| schedule.shrink(pass).recip()).sum();
        sum / (passes as f64 * passes as f64)
    }

    #[test]
    fn p7_the_variance_of_the_geometric_rule_rises_after_a_minimum_and_others_fall() {
        let geometric = |passes| relative_variance(Rule::Geometric, passes);
        for passes in [10, 20, 40, 80, 160] {
            let (n, factor) = (passes as f64, libm::pow(0.95, -2.0));
            let closed = (libm::pow(factor, n) - 1.0) / (factor - 1.0) / (n * n);
            assert!(close(geometric(passes), closed, 1e-12));
        }
        let least = (1..200).min_by(|&a, &b| geometric(a).total_cmp(&geometric(b)));
        assert_eq!(least, Some(16));
        assert!(geometric(160) > 1e4 * geometric(80) / 20.0 && geometric(320) > 1e6);
        for rule in [Rule::Global, Rule::Constant] {
            assert!((2..200).all(|n| relative_variance(rule, n) < relative_variance(rule, n - 1)));
        }
    }

    #[test]
    fn the_variance_of_the_global_schedule_has_its_closed_form() {
        for alpha in [0.5, 2.0 / 3.0, 0.7, 0.75] {
            let mut schedule = Schedule::new(Rule::Global, alpha);
            let sum: f64 = (0..50).map(|pass| schedule.shrink(pass).recip()).sum();
            let closed = tgamma(1.0 + alpha) / (2.0 - alpha)
                * (gamma_ratio(52.0, 50.0 + alpha) - tgamma(alpha).recip());
            assert!(close(sum, closed, 1e-12), "{alpha}: {sum} {closed}");
        }
    }

    #[test]
    fn the_mean_square_radius_of_the_global_schedule_has_its_closed_form() {
        for alpha in [0.5, 2.0 / 3.0, 0.75] {
            let n = 50;
            let mut schedule = Schedule::new(Rule::Global, alpha);
            let mean = (0..n).map(|pass| schedule.shrink(pass)).sum::<f64>() / n as f64;
            let x = n as f64;
            let closed =
                (gamma_ratio(x + 1.0 + alpha, x + 1.0) / tgamma(1.0 + alpha) - 1.0) / (x * alpha);
            assert!(close(mean, closed, 1e-12), "{alpha}: {mean} {closed}");
        }
    }

    /// One photon a pass, whatever the radius: r² = Π (iα + α)/(iα + 1) over i < n = Γ(n + 1) Γ(1/α) / Γ(n + 1/α).
    #[test]
    fn the_local_rule_with_one_photon_a_pass_has_its_closed_form() {
        for alpha in [0.5, 2.0 / 3.0, 0.7, 0.9] {
            for n in [1, 2, 10, 40] {
                let got = (0..n).fold(Statistics::default(), |s, _| s.after(1.0, alpha));
                let x = f64::from(n);
                let closed = gamma_ratio(x + 1.0, x + 1.0 / alpha) * tgamma(1.0 / alpha);
                assert!(close(got.shrink, closed, 1e-12), "{alpha} {n}");
                assert!(close(got.kept, alpha * x, 1e-14));
            }
        }
    }

    /// Uniform density without noise: Γ(K + α)/(Γ(α) Γ(K + 1)) as tabulated at K = 10⁵.
    #[test]
    fn the_local_rule_with_photons_in_proportion_to_the_disc_falls_as_tabulated() {
        for (alpha, tabulated) in [
            (0.5, 0.001_784),
            (2.0 / 3.0, 0.015_91),
            (0.7, 0.024_36),
            (0.9, 0.2959),
        ] {
            let mut statistics = Statistics::default();
            for _ in 0..100_000 {
                statistics = statistics.after(statistics.shrink, alpha);
            }
            assert!(
                close(statistics.shrink, tabulated, 5e-4),
                "{alpha}: {}",
                statistics.shrink
            );
        }
    }

    #[test]
    fn p2_no_photon_changes_nothing_and_the_first_takes_the_square_to_alpha() {
        let start = Statistics {
            shrink: 0.3,
            kept: 7.25,
        };
        assert_eq!(start.after(0.0, 0.7), start);
        let first = Statistics::default().after(1.0, 0.7);
        assert_eq!((first.shrink, first.kept), (0.7, 0.7));
    }

    /// M32, N' = N + M, keeps too many photons: the property that ours has and it lacks.
    #[test]
    fn the_kept_photons_are_alpha_times_those_found() {
        let kept = |step: &dyn Fn(Statistics, f64) -> Statistics| {
            (1..=20)
                .fold(Statistics::default(), |s, m| step(s, f64::from(m)))
                .kept
        };
        assert!(close(kept(&|s, m| s.after(m, 0.7)), 0.7 * 210.0, 1e-14));
        let forgotten = |s: Statistics, m: f64| Statistics {
            kept: s.kept + m,
            ..s.after(m, 0.7)
        };
        assert!(!close(kept(&forgotten), 0.7 * 210.0, 1e-3));
    }

    #[test]
    fn p3_p14_alpha_one_keeps_the_radius_and_huge_counts_stay_finite() {
        let mut statistics = Statistics::default();
        for photons in [1.0, 3.0, 5e9, 1e18] {
            statistics = statistics.after(photons, 1.0);
            assert_eq!(statistics.shrink, 1.0);
        }
        let huge = Statistics {
            shrink: 1e-3,
            kept: 1e17,
        }
        .after(1e300, 0.5);
        assert!(huge.shrink > 4.9e-4 && huge.shrink < 5.1e-4 && huge.kept.is_finite());
    }
}
