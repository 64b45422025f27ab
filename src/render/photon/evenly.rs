//! Numbers of camera paths that step evenly from pass to pass: Kronecker sequences. Each is uniform in every pass by itself, and any
//! number of passes covers the unit interval, or square, far more evenly than chance would.

use crate::numeric::rng::{Purpose, Stream};

/// Steps of the two places in a pixel, in 2⁻⁶⁴: 1/g and 1/g² with g³ = g + 1, the sequence R₂ (Roberts 2018).
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];
/// Step of the number that chooses the way, .79285: it keeps no pace with the places. 1/φ, φ the golden ratio, is the most even by itself,
/// but 1/g − 2/g² − 1/φ = −1.0028, so what depends on x − 2 y and on the choice, as stripes seen in a reflection do, would hardly change
/// its phase in a hundred passes. Found by search: of stripes of every direction with at most two periods a pixel along each axis, seen with
/// probability .1 to .5, the square of the error is 1.25 times that of chance at worst, .11 in the geometric mean (with 1/φ: 8.9 at worst).
const CHOICE_STEP: u64 = 0xCAF8_37B4_A233_9C0F;
/// Choices made by that number; a choice uses some of its 53 bits up, five where glass reflects 4 %.
const CHOICES: u32 = 8;

/// The place in a pixel, or in a cell of it, that began at `start`.
pub(super) fn place(start: [f64; 2], pass: u64) -> [f64; 2] {
    [0, 1].map(|axis| moved(start[axis], pass, STEPS[axis]))
}

/// A number in [0, 1) moved on by so many steps, around the ends.
fn moved(start: f64, steps: u64, step: u64) -> f64 {
    // Multiples of 2⁻⁵³, so no rounding.
    let by = (steps.wrapping_mul(step) >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
    let place = start + by;
    if place < 1.0 { place } else { place - 1.0 }
}

/// A number that chooses the ways of a camera path at its dielectrics.
///
/// A choice takes the part of the unit interval in which the number lies, and stretches it to the whole again. So every way through
/// the glass is an interval of the first number, and comes as often as it should, not as chance has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    number: Number,
    made: u32,
}

/// Most paths meet no glass: only those that do draw a number.
#[derive(Clone, Copy, Debug)]
enum Number {
    /// Of this seed, sample and pass.
    Open(u64, u64, u64),
    Drawn(f64),
}

impl Choice {
    /// The number of a pass for a camera sample.
    pub(super) fn new(seed: u64, sample: u64, pass: u64) -> Self {
        Self {
            number: Number::Open(seed, sample, pass),
            made: 0,
        }
    }

    /// Whether to take the first of two ways, whose probability this is. Late choices draw from `stream`.
    pub(super) fn first(&mut self, probability: f64, stream: &mut Stream) -> bool {
        if self.made >= CHOICES {
            return stream.uniform() < probability;
        }
        self.made += 1;
        let number = match self.number {
            Number::Open(seed, sample, pass) => {
                let start = Stream::new(seed, Purpose::Choice, sample).uniform();
                moved(start, pass, CHOICE_STEP)
            }
            Number::Drawn(number) => number,
        };
        let first = number < probability;
        self.number = Number::Drawn(if first {
            number / probability
        } else {
            (number - probability) / (1.0 - probability)
        });
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// 64 passes put one place in nearly every cell of 8 × 8, where independent ones would leave 23 empty; and the place stays in
    /// [0, 1) wherever it starts.
    #[test]
    fn places_of_successive_passes_cover_the_pixel_evenly() {
        for start in [[0.0, 0.0], [0.3, 0.9], [1.0 - f64::EPSILON; 2]] {
            let mut cells = [false; 64];
            for pass in 0..64 {
                let [x, y] = place(start, pass);
                assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                cells[(8.0 * x) as usize + 8 * (8.0 * y) as usize] = true;
            }
            let empty = cells.iter().filter(|&&cell| !cell).count();
            assert!(empty <= 12, "{empty}");
        }
        // 1/g and 1/g² to the last digit, with g³ = g + 1.
        let share = |step: u64| step as f64 / (1_u128 << 64) as f64;
        let g: f64 = 1.324_717_957_244_746;
        assert!((share(STEPS[0]) * g - 1.0).abs() < 1e-15);
        assert!((share(STEPS[1]) * g * g - 1.0).abs() < 1e-15);
    }

    const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

    /// |mean over the passes of exp(2πi turn)|², the turn of each being `step` more than that of the last.
    fn coherence(step: f64, passes: f64) -> f64 {
        let sin = |turn: f64| libm::sin(PI * turn);
        let ratio = sin(step * passes) / (passes * sin(step));
        ratio * ratio
    }

    /// Expected square of the error of the share of samples that show a stripe (half of the pixel, `step` apart from pass to pass) and are
    /// chosen with this probability, over that of as many independent ones: by the Fourier series of both.
    fn error_against_chance(step: f64, choice_step: f64, probability: f64, passes: f64) -> f64 {
        let stripe = |m: f64| (1.0 / (PI * m)) * (1.0 / (PI * m));
        let choice = |l: f64| {
            let amplitude = libm::sin(PI * l * probability) / (PI * l);
            amplitude * amplitude
        };
        let orders = || (1..=24).map(f64::from);
        let odd = || [1.0, 3.0, 5.0, 7.0].into_iter();
        let alone = orders().map(|l| 0.25 * choice(l) * coherence(l * choice_step, passes));
        let places =
            odd().map(|m| probability * probability * stripe(m) * coherence(m * step, passes));
        let joint = odd()
            .flat_map(|m| orders().map(move |l| (m, l)))
            .map(|(m, l)| {
                let both = coherence(m * step + l * choice_step, passes)
                    + coherence(m * step - l * choice_step, passes);
                stripe(m) * choice(l) * both
            });
        let square = 2.0 * (alone.sum::<f64>() + places.sum::<f64>() + joint.sum::<f64>());
        let chance = 0.5 * probability * (1.0 - 0.5 * probability) / passes;
        square / chance
    }

    /// The worst of all stripes with at most so many periods a pixel along each axis.
    fn worst_of_stripes(most: i32, choice_step: u64) -> f64 {
        let share = |step: u64| step as f64 / (1_u128 << 64) as f64;
        let directions = (-most..=most).flat_map(|h| (0..=most).map(move |k| (h, k)));
        let steps = directions
            .filter(|&(h, k)| (h, k) != (0, 0))
            .map(|(h, k)| f64::from(h) * share(STEPS[0]) + f64::from(k) * share(STEPS[1]));
        let errors = steps.flat_map(|step| {
            [0.1, 0.16, 0.25, 0.5]
                .into_iter()
                .flat_map(move |probability| {
                    [16.0, 32.0, 64.0, 128.0, 256.0, 512.0].map(|passes| {
                        error_against_chance(step, share(choice_step), probability, passes)
                    })
                })
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn stripes_seen_by_choice_come_hardly_less_evenly_than_by_chance() {
        assert!(worst_of_stripes(2, CHOICE_STEP) < 1.3);
        assert!(worst_of_stripes(4, CHOICE_STEP) < 6.5);
        assert!(worst_of_stripes(2, GOLDEN) > 8.0);
    }

    /// The expectation, found by trying it.
    #[test]
    fn the_expected_error_of_stripes_is_that_of_the_numbers() {
        let mut stream = Stream::new(4, Purpose::Test, 0);
        let (passes, tries) = (128, 4000);
        let share = |step: u64| step as f64 / (1_u128 << 64) as f64;
        for (choice_step, probability) in [(GOLDEN, 0.5), (CHOICE_STEP, 0.16)] {
            let squares = (0..tries).map(|_| {
                let (start, first) = (stream.uniform2(), stream.uniform());
                let seen = (0..passes).filter(|&pass| {
                    let [x, y] = place(start, pass);
                    let striped = (x - 2.0 * y).rem_euclid(1.0) < 0.5;
                    striped && moved(first, pass, choice_step) < probability
                });
                let error = seen.count() as f64 / passes as f64 - 0.5 * probability;
                error * error
            });
            let chance = 0.5 * probability * (1.0 - 0.5 * probability) / passes as f64;
            let found = squares.sum::<f64>() / f64::from(tries) / chance;
            let step = share(STEPS[0]) - 2.0 * share(STEPS[1]);
            let expected = error_against_chance(step, share(choice_step), probability, 128.0);
            // Six standard errors of a mean square; harmonics left out are of no pace, so they bring a part of what chance does.
            let most = 0.2 * expected + 0.15;
            assert!((found - expected).abs() < most, "{found} {expected}");
        }
    }

    /// The way taken, a bit for each of its choices: R, TR, TTR and TTT for shares 0.04, 0.3 and 0.5 of R.
    fn way(choice: &mut Choice, stream: &mut Stream) -> usize {
        let ways = [0.04, 0.3, 0.5];
        let reflected = ways.iter().position(|&share| choice.first(share, stream));
        reflected.unwrap_or(ways.len())
    }

    const SHARES: [f64; 4] = [0.04, 0.288, 0.336, 0.336];

    /// Over 200 passes every way comes as often as its share says to within 3 passes; independent choices would be off by 7 in the
    /// root mean square.
    #[test]
    fn every_way_through_the_glass_comes_as_often_as_it_should() {
        let mut stream = Stream::new(1, Purpose::Test, 0);
        for sample in 0..50 {
            let mut counts = [0_u32; 4];
            for pass in 0..200 {
                counts[way(&mut Choice::new(7, sample, pass), &mut stream)] += 1;
            }
            for (count, share) in counts.iter().zip(SHARES) {
                assert!(
                    (f64::from(*count) - 200.0 * share).abs() <= 3.0,
                    "{counts:?}"
                );
            }
        }
    }

    /// In any one pass the way is a matter of chance: 40 000 samples, six standard errors; sees 0.6 % of the samples.
    #[test]
    fn in_one_pass_every_way_has_its_probability() {
        let mut stream = Stream::new(2, Purpose::Test, 0);
        for pass in [0, 1, 77] {
            let mut counts = [0_u32; 4];
            for sample in 0..40_000 {
                counts[way(&mut Choice::new(3, sample, pass), &mut stream)] += 1;
            }
            for (count, share) in counts.iter().zip(SHARES) {
                let error = (share * (1.0 - share) / 40_000.0).sqrt();
                assert!((f64::from(*count) / 40_000.0 - share).abs() < 6.0 * error);
            }
        }
    }

    #[test]
    fn a_long_way_goes_on_with_numbers_of_its_stream() {
        let mut stream = Stream::new(3, Purpose::Test, 0);
        let mut choice = Choice::new(1, 2, 3);
        let firsts = (0..4000)
            .filter(|_| choice.first(0.25, &mut stream))
            .count();
        assert!(firsts.abs_diff(1000) < 165, "{firsts}");
    }
}
