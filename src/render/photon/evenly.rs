//! Numbers of camera paths that step evenly from pass to pass: Kronecker sequences. Each is uniform in every pass by itself, and any
//! number of passes covers the unit interval, or square, far more evenly than chance would.

use crate::numeric::rng::{Purpose, Stream};

/// Steps of the two places in a pixel, in 2⁻⁶⁴: 1/g and 1/g² with g³ = g + 1, the sequence R₂ (Roberts 2018).
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];
/// Step of the number that chooses the way: 1/φ, φ the golden ratio, so that it keeps no pace with the places.
const CHOICE_STEP: u64 = 0x9E37_79B9_7F4A_7C15;
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
        // 1/g, 1/g² and 1/φ to the last digit, with g³ = g + 1 and φ² = φ + 1.
        let share = |step: u64| step as f64 / (1_u128 << 64) as f64;
        let g: f64 = 1.324_717_957_244_746;
        assert!((share(STEPS[0]) * g - 1.0).abs() < 1e-15);
        assert!((share(STEPS[1]) * g * g - 1.0).abs() < 1e-15);
        assert!((share(CHOICE_STEP) * 0.5 * (1.0 + 5.0_f64.sqrt()) - 1.0).abs() < 1e-15);
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
