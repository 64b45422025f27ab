//! Numbers of camera paths that step evenly from pass to pass: Kronecker sequences. Each is uniform in every pass by itself, and any
//! number of passes covers the unit interval, or square, far more evenly than chance would.

use crate::numeric::rng::{Purpose, Stream};

/// Steps of the two places in a pixel, in 2⁻⁶⁴: 1/g and 1/g² with g³ = g + 1, the sequence R₂ (Roberts 2018).
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];
/// Step of the number that chooses the way, .633014: it keeps no pace with the places, and by itself is nearly as even as the golden ratio's.
/// That one, 1/φ, would not do: 1/g − 2/g² − 1/φ = −1.0028, so what depends on x − 2 y and on the choice, as stripes seen in a reflection
/// do, would hardly change its phase in a hundred passes. Found by search: no sum of h₀, h₁ and h₂ ≠ 0 steps of x, y and the choice,
/// |h| ≤ 24, comes closer to whole turns than .042/(h₀ h₁ h₂)², zeros left out (with 1/φ: .011).
const CHOICE_STEP: u64 = 0xA20D_349B_E8FF_327B;
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
        // 1/g and 1/g² to the last digit, with g³ = g + 1.
        let share = |step: u64| step as f64 / (1_u128 << 64) as f64;
        let g: f64 = 1.324_717_957_244_746;
        assert!((share(STEPS[0]) * g - 1.0).abs() < 1e-15);
        assert!((share(STEPS[1]) * g * g - 1.0).abs() < 1e-15);
    }

    /// How far h₀ steps in x, h₁ in y and h₂ of the choice are from whole turns.
    fn off_whole_turns(h: [i64; 3], choice_step: u64) -> f64 {
        let steps = [STEPS[0], STEPS[1], choice_step];
        let turned = h.iter().zip(steps).fold(0_u64, |turned, (&times, step)| {
            turned.wrapping_add((times as u64).wrapping_mul(step))
        });
        (turned as i64).unsigned_abs() as f64 / (1_u128 << 64) as f64
    }

    /// The least distance from whole turns times the squared order of the harmonic, the product of what is not 0: what a harmonic adds to the
    /// error before it turns, against chance, goes as the inverse.
    fn least_resonance(choice_step: u64) -> f64 {
        let order = |h: i64| h.abs().max(1) as f64;
        let pairs = (-24..=24).flat_map(|x| (-24..=24).map(move |y| (x, y)));
        let all = pairs.flat_map(|(x, y)| (1..=24).map(move |choice| [x, y, choice]));
        all.map(|h| {
            let order: f64 = h.map(order).iter().product();
            off_whole_turns(h, choice_step) * order * order
        })
        .fold(f64::INFINITY, f64::min)
    }

    const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

    #[test]
    fn the_choice_keeps_no_pace_with_the_place() {
        assert!(least_resonance(CHOICE_STEP) > 0.042);
        assert!(least_resonance(GOLDEN) < 0.012);
    }

    /// Mean square of the error of what a striped reflection, chosen half of the time, gives in so many passes, against that of as
    /// many independent ones; the worst of all stripes up to the third harmonic.
    fn worst_of_stripes(passes: u64, choice_step: u64) -> f64 {
        let stripes = (-3..=3).flat_map(|x| (0..=3).map(move |y| [f64::from(x), f64::from(y)]));
        let error = |stripe: [f64; 2]| {
            let mut stream = Stream::new(4, Purpose::Test, 0);
            let squares = (0..200).map(|_| {
                let (start, first) = (stream.uniform2(), stream.uniform());
                let seen = (0..passes).filter(|&pass| {
                    let [x, y] = place(start, pass);
                    let across = (stripe[0] * x + stripe[1] * y).rem_euclid(1.0);
                    across < 0.5 && moved(first, pass, choice_step) < 0.5
                });
                let share = seen.count() as f64 / passes as f64;
                (share - 0.25) * (share - 0.25)
            });
            squares.sum::<f64>() / 200.0 / (0.25 * 0.75 / passes as f64)
        };
        let worst = |worst: f64, stripe| worst.max(error(stripe));
        stripes
            .filter(|&stripe| stripe != [0.0; 2])
            .fold(0.0, worst)
    }

    #[test]
    fn no_stripes_in_a_reflection_are_seen_worse_than_by_chance() {
        for passes in [16, 64, 128, 256] {
            assert!(worst_of_stripes(passes, CHOICE_STEP) < 1.0, "{passes}");
        }
        assert!(worst_of_stripes(128, GOLDEN) > 2.0);
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
