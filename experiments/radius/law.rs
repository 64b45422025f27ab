//! Below a lamp: the law of the photons, closed forms of a pass, and an estimate made of photons drawn from the law.
//!
//! Lengths are in units of the height of the lamp, irradiance in units of that straight below, so that E(d) = (1 + d²)^(−3/2). Of m
//! photons M ~ Binomial(m, p), p = ½ (1 − 1/√(1 + a)), fall within the squared radius a; s = d²/a of each has the density
//! (a/4p) (1 + a s)^(−3/2). The estimate is 4/(a m) Σ w(s).

use crate::numeric::rng::Stream;
use crate::render::photon::radius::{GEOMETRIC, Schedule, Statistics};
use crate::scene::options::{Kernel, Rule};

/// Mean and variance of a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reading {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

/// Places and weights on [−1, 1], by half (Gauss and Legendre, 8 points).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// ∫ f over [0, 1] in two panels: to rounding for f = polynomial × (1 + a s)^(−3/2), a ≤ 1.
pub(crate) fn integral(f: impl Fn(f64) -> f64) -> f64 {
    let panel = |middle: f64| {
        let pair =
            |&(x, weight): &(f64, f64)| weight * (f(middle - 0.25 * x) + f(middle + 0.25 * x));
        0.25 * GAUSS.iter().map(pair).sum::<f64>()
    };
    panel(0.25) + panel(0.75)
}

/// What a pass of `photons` reads at the squared radius `square` ≤ 1, to all digits.
pub(super) fn pass(kernel: Kernel, square: f64, photons: f64) -> Reading {
    let moment = |power: i32| {
        integral(|s| {
            let root = (1.0 + square * s).sqrt();
            kernel.weight(s).powi(power) / (root * root * root)
        })
    };
    // Of one photon: E v = ∫ w E ds and E v² = (4/a) ∫ w² E ds.
    let (mean, second) = match kernel {
        Kernel::Disc => {
            // ∫ (1 + a s)^(−3/2) ds, without cancellation.
            let root = (1.0 + square).sqrt();
            let mean = 2.0 / (root * (1.0 + root));
            (mean, mean)
        }
        Kernel::Epanechnikov | Kernel::FourthOrder => (moment(1), moment(2)),
    };
    Reading {
        mean,
        variance: (4.0 / square * second - mean * mean) / photons,
    }
}

/// r² of pass `pass` = 0, 1, … over that of the first, by the closed form and not by the schedule's recurrence.
pub(super) fn closed_shrink(rule: Rule, alpha: f64, pass: u64) -> f64 {
    let n = pass as f64 + 1.0;
    match rule {
        Rule::Local | Rule::Constant => 1.0,
        Rule::Global => {
            libm::exp(libm::lgamma(n + alpha) - libm::lgamma(n + 1.0)) / libm::tgamma(1.0 + alpha)
        }
        Rule::Geometric | Rule::GeometricAsCoded => libm::pow(GEOMETRIC, 2.0 * (n - 1.0)),
    }
}

/// One estimate: the rule's numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Method {
    pub(super) rule: Rule,
    pub(super) kernel: Kernel,
    pub(super) alpha: f64,
    /// First radius over the height of the lamp.
    pub(super) first: f64,
    pub(super) passes: u64,
    pub(super) photons: u64,
}

impl Method {
    /// Mean and variance of the mean over the passes under a rule that does not look at photons, in closed form.
    pub(super) fn predicted(&self) -> Reading {
        let first_squared = self.first * self.first;
        let n = self.passes as f64;
        let mut all = Reading::default();
        for index in 0..self.passes {
            let square = first_squared * closed_shrink(self.rule, self.alpha, index);
            // By the rule as coded, area is taken for more than it is.
            let gain = square / self.rule.divisor(first_squared, square);
            let one = pass(self.kernel, square, self.photons as f64);
            all.mean += gain * one.mean / n;
            all.variance += gain * gain * one.variance / (n * n);
        }
        all
    }

    /// r² of the last pass; of the local rule, if every pass found as many photons as it should in the mean.
    pub(super) fn predicted_last_square(&self) -> f64 {
        let first_squared = self.first * self.first;
        if self.rule != Rule::Local {
            return first_squared * closed_shrink(self.rule, self.alpha, self.passes - 1);
        }
        let last = (1..self.passes).fold(Statistics::default(), |statistics, _| {
            let inside = inside(first_squared * statistics.shrink);
            statistics.after(self.photons as f64 * inside, self.alpha)
        });
        first_squared * last.shrink
    }

    /// An estimate from photons drawn from their law.
    pub(super) fn estimate(&self, stream: &mut Stream) -> Estimated {
        let first_squared = self.first * self.first;
        let photons = self.photons as f64;
        let mut schedule = Schedule::new(self.rule, self.alpha);
        let mut statistics = Statistics::default();
        let (mut sum, mut expected) = (0.0, Reading::default());
        let mut square = first_squared;
        for index in 0..self.passes {
            let shrink = match self.rule {
                Rule::Local => statistics.shrink,
                _ => schedule.shrink(index),
            };
            square = first_squared * shrink;
            let inside = inside(square);
            let found = binomial(self.photons, inside, stream);
            let weights = match self.kernel {
                Kernel::Disc => found as f64,
                kernel => (0..found)
                    .map(|_| kernel.weight(place(square, inside, stream.uniform())))
                    .sum(),
            };
            sum += 4.0 * weights / (self.rule.divisor(first_squared, square) * photons);
            if self.rule == Rule::Local {
                let one = pass(self.kernel, square, photons);
                expected.mean += one.mean;
                expected.variance += one.variance;
                statistics = statistics.after(found as f64, self.alpha);
            }
        }
        let n = self.passes as f64;
        Estimated {
            value: sum / n,
            given_radii: Reading {
                mean: expected.mean / n,
                variance: expected.variance / (n * n),
            },
            last_square: square,
        }
    }
}

/// An estimate, and what it should read given the radii that it had (of the local rule only).
pub(super) struct Estimated {
    pub(super) value: f64,
    pub(super) given_radii: Reading,
    pub(super) last_square: f64,
}

/// The share p of photons within a squared radius: ½ (1 − 1/√(1 + a)), without cancellation.
fn inside(square: f64) -> f64 {
    let root = (1.0 + square).sqrt();
    0.5 * square / (root * (1.0 + root))
}

/// s = d²/a of a photon inside: the height of its direction is uniform.
fn place(square: f64, inside: f64, uniform: f64) -> f64 {
    let height = 1.0 - 2.0 * inside * uniform;
    (1.0 / (height * height) - 1.0) / square
}

/// A number of successes in `trials` of probability `p` in (0, 1), by inversion: in groups, so that no probability underflows.
pub(crate) fn binomial(trials: u64, p: f64, stream: &mut Stream) -> u64 {
    let group = ((300.0 / p) as u64).max(1);
    let groups = trials / group;
    let whole: u64 = (0..groups).map(|_| inverted(group, p, stream)).sum();
    whole + inverted(trials - groups * group, p, stream)
}

fn inverted(trials: u64, p: f64, stream: &mut Stream) -> u64 {
    let (n, odds) = (trials as f64, p / (1.0 - p));
    let mut probability = libm::exp(n * libm::log1p(-p));
    let mut rest = stream.uniform();
    let mut count = 0;
    while rest >= probability && count < trials {
        rest -= probability;
        probability *= odds * (n - count as f64) / (count as f64 + 1.0);
        count += 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Purpose;
    use crate::numeric::statistics::Moments;

    #[test]
    fn a_pass_has_its_closed_forms() {
        for (radius, tabulated) in [(0.1, 0.992_56), (0.3, 0.937_19), (1.0, 0.585_79)] {
            let mean = pass(Kernel::Disc, radius * radius, 1.0).mean;
            assert!((mean - tabulated).abs() < 5e-6);
            // The quadrature agrees with the closed form where there is one.
            let by_rule = integral(|s| libm::pow(1.0 + radius * radius * s, -1.5));
            assert!((mean - by_rule).abs() < 1e-14, "{radius}: {mean} {by_rule}");
        }
        // (r²/4) ∫sw ∇²E + (r⁴/64) ∫s²w ∇⁴E with E = 1 − (3/2) d² + (15/8) d⁴ − …: ∇²E = −6, ∇⁴E = 120.
        for kernel in [Kernel::Disc, Kernel::Epanechnikov, Kernel::FourthOrder] {
            let a = 1e-3;
            let bias = pass(kernel, a, 1.0).mean - 1.0;
            let expected = -1.5 * a * kernel.moment(1) + 1.875 * a * a * kernel.moment(2);
            assert!(
                (bias - expected).abs() < 3e-9 * 10.0,
                "{kernel:?} {bias} {expected}"
            );
        }
    }

    /// Moments of 2·10⁴ draws within six errors.
    #[test]
    fn drawn_photons_follow_the_law() {
        let mut stream = Stream::new(1, Purpose::Test, 0);
        let n = 20_000;
        let within = |moments: Moments, mean: f64, variance: f64| {
            let error = (variance / f64::from(n)).sqrt();
            assert!(
                (moments.mean() - mean).abs() < 6.0 * error,
                "{}",
                moments.mean()
            );
            assert!((moments.variance() / variance - 1.0).abs() < 0.1);
        };
        let found = |_| binomial(500, 0.02, &mut stream) as f64;
        within(Moments::of((0..n).map(found)), 10.0, 9.8);
        for kernel in [Kernel::Disc, Kernel::Epanechnikov, Kernel::FourthOrder] {
            let method = Method {
                rule: Rule::Constant,
                kernel,
                alpha: 1.0,
                first: 0.7,
                passes: 1,
                photons: 100,
            };
            let values = (0..n).map(|_| method.estimate(&mut stream).value);
            let predicted = method.predicted();
            within(Moments::of(values), predicted.mean, predicted.variance);
        }
    }
}
