//! How the gather radius shrinks from pass to pass: rules as data, and pure functions of their numbers.
//!
//! Every rule multiplies the **square** of a first radius by a `shrink` in [0, 1]. With α in (0, 1], M photons in a pass and N
//! kept so far:
//!
//! ```text
//! local     N' = N + α M,  r'² = r² (N + α M) / (N + M)      Hachisuka, Ogaki and Jensen 2008; per pixel: Hachisuka and Jensen 2009
//! global    r²_{i+1} = r²_i (i + α) / (i + 1),  i = 1, 2, …  Knaus and Zwicker 2011
//! constant  r'² = r²
//! ```

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

    /// Square of the radius of pass `pass` = 0, 1, … over the square of the first; 1 under the other rules.
    pub fn shrink(&mut self, pass: u64) -> f64 {
        if self.rule != Rule::Global {
            return 1.0;
        }
        if pass < self.pass {
            *self = Self::new(self.rule, self.alpha);
        }
        while self.pass < pass {
            self.pass += 1;
            self.shrink *= global_step(self.pass, self.alpha);
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
    fn no_photon_changes_nothing_and_the_first_takes_the_square_to_alpha() {
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
    fn alpha_one_keeps_the_radius_and_huge_counts_stay_finite() {
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
