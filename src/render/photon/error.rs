//! How far a photon-mapped picture may be from the truth, estimated pixel by pixel while it is made: bias and noise.
//!
//! After Hachisuka, Jarosz and Jensen 2010, with an estimate of the bias of our own.
//!
//! *Bias.* Photons that are denser towards the rim of the disc than at its middle betray that the disc reads too much. With
//! s = d²/r², a sum of flux w(s)/(π r² photons) has the expectation E ∫w ds + (r²/4) ∇²E ∫s w ds + O(r⁴) where the irradiance E is
//! smooth. The disc itself, w = 1, errs by (r²/8) ∇²E; so does w = 6 s − 3 ([`bias_weight`]), which reads nothing else. It is the
//! one of least variance (thrice the disc's) as it is a line in s, and for an even density its noise does not correlate with the
//! disc's. The photons at hand are enough: no second radius, no derivative of a kernel.
//!
//! *Noise.* Passes are independent, or (under a local rule) martingale differences about their expectation. So the readings less
//! their estimated biases have the truth as their mean, to O(r⁴), and Student's t over passes bounds the distance. This includes the
//! noise of the estimate of the bias itself.
//!
//! What it cannot know: edges and corners, where irradiance is not smooth over the disc; light that no photon has found yet.

use crate::numeric::statistics::student_quantile;
use crate::scene::Rgb;
use rayon::prelude::*;

/// Least square of a mean radiance with an estimate: squares of errors down to the rounding of the mean are normal numbers then.
const LEAST_SQUARE: f64 = f64::MIN_POSITIVE / (f64::EPSILON * f64::EPSILON);

/// Weight of a photon at s = d²/r² in the estimate of the disc's bias.
pub fn bias_weight(s: f64) -> f64 {
    6.0 * s - 3.0
}

/// Running moments of one pixel over the passes: of its reading and of the estimated bias of that, each the mean of the three
/// channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    count: f64,
    reading: f64,
    bias: f64,
    /// Sums of products of deviations from the means (Welford 1962).
    reading_squares: f64,
    products: f64,
    bias_squares: f64,
}

impl Tally {
    /// Adds a pass. What is not finite is left out, as the film does.
    pub fn add(&mut self, reading: f64, bias: f64) {
        if !(reading.is_finite() && bias.is_finite()) {
            return;
        }
        self.count += 1.0;
        let (x, b) = (reading - self.reading, bias - self.bias);
        self.reading += x / self.count;
        self.bias += b / self.count;
        self.reading_squares += x * (reading - self.reading);
        self.products += x * (bias - self.bias);
        self.bias_squares += b * (bias - self.bias);
    }

    /// Variance of a mean over the passes from its sum of squares; NaN before the second pass.
    fn variance(&self, squares: f64) -> f64 {
        if self.count < 2.0 {
            return f64::NAN;
        }
        squares / (self.count * (self.count - 1.0))
    }

    /// Mean reading: the pixel.
    pub fn reading(&self) -> f64 {
        self.reading
    }

    /// Estimated variance of the mean reading; NaN before the second pass.
    pub fn noise_squared(&self) -> f64 {
        self.variance(self.reading_squares)
    }

    /// Estimated square of the pixel's bias: the square of the mean estimate less what its own noise adds, so that the mean is
    /// right; may be negative. NaN before the second pass.
    pub fn bias_squared(&self) -> f64 {
        self.bias * self.bias - self.variance(self.bias_squares)
    }

    /// The interval that holds the truth with probability `confidence`, where irradiance is smooth over the disc. NaN before the
    /// second pass.
    pub fn interval(&self, confidence: f64) -> (f64, f64) {
        let squares = self.reading_squares - 2.0 * self.products + self.bias_squares;
        self.around(self.reading - self.bias, squares, confidence)
    }

    /// The interval of [`Self::interval`] as it were without bias: by noise alone.
    pub fn interval_by_noise(&self, confidence: f64) -> (f64, f64) {
        self.around(self.reading, self.reading_squares, confidence)
    }

    fn around(&self, center: f64, squares: f64, confidence: f64) -> (f64, f64) {
        // Rounding may take the square of a difference below 0.
        let error = self.variance(squares.max(0.0)).sqrt();
        if error.is_nan() {
            return (f64::NAN, f64::NAN);
        }
        let half = student_quantile(0.5 + 0.5 * confidence, self.count - 1.0) * error;
        (center - half, center + half)
    }
}

/// The estimated errors of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    tallies: Vec<Tally>,
}

/// The estimated error of a whole picture, as a share of its mean radiance; root mean squares over the pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// By chance: falls with more passes.
    pub noise: f64,
    /// By the radius: falls as it shrinks.
    pub bias: f64,
}

impl Summary {
    /// Both together.
    pub fn total(&self) -> f64 {
        libm::hypot(self.noise, self.bias)
    }
}

impl Errors {
    /// Of a picture of so many pixels, before its first pass.
    pub fn new(pixels: usize) -> Self {
        Self {
            tallies: vec![Tally::default(); pixels],
        }
    }

    /// Adds a pass: the reading and the estimated bias of every pixel.
    pub fn add(&mut self, readings: &[Rgb], biases: &[Rgb]) {
        let grey = |rgb: Rgb| rgb.element_sum() / 3.0;
        let passes = readings.par_iter().zip(biases);
        let tallies = self.tallies.par_iter_mut().zip(passes);
        tallies.for_each(|(tally, (reading, bias))| tally.add(grey(*reading), grey(*bias)));
    }

    /// The pixels, row by row from the top.
    pub fn tallies(&self) -> &[Tally] {
        &self.tallies
    }

    /// The whole picture. `None` before the second pass, of a black picture, and where squares of its radiance leave the range of numbers.
    pub fn summary(&self) -> Option<Summary> {
        let sum = |of: fn(&Tally) -> f64| self.tallies.iter().map(of).sum::<f64>();
        let n = self.tallies.len() as f64;
        let mean = sum(Tally::reading) / n;
        if mean * mean < LEAST_SQUARE {
            return None;
        }
        // Not `max`, which would take 0 for the NaN of a single pass.
        let share = |square: f64| (if square < 0.0 { 0.0 } else { square } / n).sqrt() / mean;
        let summary = Summary {
            noise: share(sum(Tally::noise_squared)),
            bias: share(sum(Tally::bias_squared)),
        };
        summary.total().is_finite().then_some(summary)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    /// ∫ f over [0, 1] for polynomials up to degree 3 (Simpson).
    fn integral(f: impl Fn(f64) -> f64) -> f64 {
        (f(0.0) + 4.0 * f(0.5) + f(1.0)) / 6.0
    }

    /// Reads nothing of an even irradiance, and of its curvature as much as the disc.
    fn reads_the_bias_of_a_disc(weight: impl Fn(f64) -> f64) -> bool {
        integral(&weight).abs() < 1e-15
            && (integral(|s| s * weight(s)) - integral(|s| s)).abs() < 1e-15
    }

    #[test]
    fn the_weights_read_the_bias_of_a_disc_and_nothing_else() {
        assert!(reads_the_bias_of_a_disc(bias_weight));
        assert!(!reads_the_bias_of_a_disc(|s| 6.0 * s - 2.0));
        assert!(!reads_the_bias_of_a_disc(|s| 3.0 * s - 1.5));
        let variance = integral(|s| bias_weight(s) * bias_weight(s));
        assert!((variance - 3.0).abs() < 1e-15);
    }

    #[test]
    fn the_moments_are_those_of_all_passes_together() {
        let passes = [(1.0, 0.2), (3.0, -0.1), (2.0, 0.5), (6.0, 0.0)];
        let mut tally = Tally::default();
        for (reading, bias) in passes {
            tally.add(reading, bias);
            tally.add(f64::NAN, bias);
        }
        // Means 3 and .15; squares 14, 0.21; products 1·.2 + 3·−.1 + 2·.5 − 4·3·.15 = −.9.
        assert!((tally.noise_squared() - 14.0 / 12.0).abs() < 1e-15);
        assert!((tally.bias_squared() - (0.0225 - 0.21 / 12.0)).abs() < 1e-15);
        let (low, high) = tally.interval(0.5);
        assert!((0.5 * (low + high) - 2.85).abs() < 1e-15);
        let error = ((14.0 + 1.8 + 0.21) / 12.0_f64).sqrt();
        // Student's quartile at three degrees of freedom.
        assert!((0.5 * (high - low) / error - 0.764_892).abs() < 1e-6);
        let (low, high) = tally.interval_by_noise(0.5);
        assert!((0.5 * (low + high) - 3.0).abs() < 1e-15);
        assert!((0.5 * (high - low) - 0.764_892 * (14.0 / 12.0_f64).sqrt()).abs() < 1e-6);
    }

    /// 4000 pixels whose readings are off by 0.3 and whose estimates of it are noisy: intervals hold the truth as often as they say
    /// (six binomial errors: 0.05), intervals without bias almost never.
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        let mut stream = Stream::new(1, Purpose::Test, 0);
        let mut noise = || (0..12).map(|_| stream.uniform()).sum::<f64>() - 6.0;
        let mut errors = Errors::new(4000);
        for _ in 0..8 {
            let (readings, biases): (Vec<_>, Vec<_>) = (0..4000)
                .map(|_| (2.3 + 0.1 * noise(), 0.3 + 0.17 * noise()))
                .map(|(reading, bias)| (Rgb::splat(reading), Rgb::splat(bias)))
                .unzip();
            errors.add(&readings, &biases);
        }
        let share = |interval: &dyn Fn(&Tally) -> (f64, f64)| {
            let holds = |tally: &&Tally| (interval(tally).0..interval(tally).1).contains(&2.0);
            errors.tallies().iter().filter(holds).count() as f64 / 4000.0
        };
        for confidence in [0.5, 0.9] {
            assert!((share(&|tally| tally.interval(confidence)) - confidence).abs() < 0.05);
            assert!(share(&|tally| tally.interval_by_noise(confidence)) < 0.01);
        }
        let summary = errors.summary().expect("a picture with light");
        assert!((summary.noise * 2.3 / (0.1 / 8.0_f64.sqrt()) - 1.0).abs() < 0.05);
        assert!((summary.bias * 2.3 / 0.3 - 1.0).abs() < 0.02);
        assert!((summary.total() - libm::hypot(summary.noise, summary.bias)).abs() < 1e-15);
    }

    /// Neither "0 %" nor a wrong number.
    #[test]
    fn radiance_whose_square_is_out_of_range_has_no_estimate() {
        let estimate = |scale: f64| {
            let mut errors = Errors::new(1);
            for reading in [1.0, 1.5, 2.0] {
                errors.add(&[Rgb::splat(scale * reading)], &[Rgb::ZERO]);
            }
            errors.summary()
        };
        let noise = estimate(1.0).map(|summary| summary.noise);
        for scale in [1e-138, 1e150] {
            let scaled = estimate(scale).expect("in range").noise;
            assert!((scaled / noise.expect("an estimate") - 1.0).abs() < 1e-12);
        }
        for scale in [1e-300, 1e-160, 1e200] {
            assert_eq!(estimate(scale), None);
        }
    }

    #[test]
    fn one_pass_or_a_black_picture_has_no_estimate() {
        let mut errors = Errors::new(2);
        assert_eq!(errors.summary(), None);
        errors.add(&[Rgb::ONE; 2], &[Rgb::ZERO; 2]);
        assert_eq!(errors.summary(), None);
        assert!(errors.tallies()[0].interval(0.9).0.is_nan());
        let mut black = Errors::new(2);
        for _ in 0..3 {
            black.add(&[Rgb::ZERO; 2], &[Rgb::ZERO; 2]);
        }
        assert_eq!(black.summary(), None);
    }
}
