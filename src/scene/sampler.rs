//! The numbers that a camera sample is made of: place in the pixel, place on the lens, points on lights, directions, roulette.
//!
//! Each is uniform in [0, 1) or [0, 1)², and the numbers of one sample are independent of each other. What a [`Sampler`] chooses is how the
//! samples of one pixel lie relative to each other. Numbers are a function of the seed, the pixel, the sample and of how many were
//! asked for before: neither threads nor tiles enter.
//!
//! - *Independent*: not at all.
//! - *Stratified*: with n samples planned, each number (or pair) falls into a cell of its own of a grid of n (or nearly n) cells, in an
//!   order that is random for every number, so that numbers are independent of each other. A pair of a number of samples that is not a
//!   product of near equals leaves a few cells out, at random. Samples beyond the plan begin a new grid.
//! - *Sobol*: pairs are the first two dimensions of Sobol's sequence (1967), a (0, 2)-sequence in base 2, single numbers the first,
//!   under the nested uniform scrambling of Owen (1995) in the form of a hash by Laine and Karras, with the order of samples scrambled
//!   anew for each number (Burley, "Practical hash-based Owen scrambling", 2020). The first n samples are the same whatever is planned.
//!   Each 2¹⁶ samples begin a new scrambling. Bits below 2⁻¹⁶ are random, as Owen's would be: the points of 2¹⁶ differ above.
//!
//! Every number of one sample alone is uniform for any count of samples, so means are unbiased, powers of two or not.

use super::options::Sampler;
use crate::numeric::rng::{Purpose, Stream, mix};
use sobol_burley::parts::{owen_scramble_rev, sobol_rev};

/// Samples of one scrambling of Sobol's sequence.
const SOBOL_LENGTH: u64 = 1 << 16;
/// Most cells of a grid.
const MOST_CELLS: u32 = 1 << 16;
/// Cells where the number of samples is not known beforehand.
const CELLS_OF_AN_OPEN_PLAN: u32 = 64;

const TWO_TO_MINUS_37: f64 = 1.0 / (1_u64 << 37) as f64;
const TWO_TO_MINUS_16: f64 = 1.0 / (1_u64 << 16) as f64;

/// Where the numbers of a pixel's samples come from.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    sampler: Sampler,
    seed: u64,
    /// Cells of a grid of single numbers.
    cells: u32,
}

impl Source {
    /// A source for pixels of which `planned` samples will be taken; `u32::MAX`: nobody knows how many.
    pub fn new(sampler: Sampler, seed: u64, planned: u32) -> Self {
        let cells = match planned {
            u32::MAX => CELLS_OF_AN_OPEN_PLAN,
            _ => planned.clamp(1, MOST_CELLS),
        };
        Self {
            sampler,
            seed,
            cells,
        }
    }

    /// The numbers of a sample of one pixel. `key` gives each sample of each pixel a key that no other has.
    pub fn draws(&self, sample: u64, key: impl Fn(u64) -> u64) -> Draws {
        let own = Stream::new(self.seed, Purpose::Camera, key(sample));
        let round = match self.sampler {
            Sampler::Independent => return Draws { own, spread: None },
            Sampler::Stratified => u64::from(self.cells),
            Sampler::Sobol => SOBOL_LENGTH,
        };
        let spread = Spread {
            shared: Stream::new(self.seed, Purpose::Pattern, key(sample / round)),
            // Both are at most 2¹⁶.
            within: (sample % round) as u32,
            cells: (self.sampler == Sampler::Stratified).then_some(self.cells),
        };
        Draws {
            own,
            spread: Some(spread),
        }
    }
}

/// A cursor over the numbers of one sample.
#[derive(Clone, Debug)]
pub struct Draws {
    /// Random numbers of this sample alone.
    own: Stream,
    /// How they are spread over the samples of the pixel; `None` if they are independent.
    spread: Option<Spread>,
}

#[derive(Clone, Debug)]
struct Spread {
    /// Random numbers that the samples of a round share: two for each draw.
    shared: Stream,
    /// The sample's number in its round.
    within: u32,
    /// Cells of a grid; `None`: Sobol's sequence.
    cells: Option<u32>,
}

impl Draws {
    /// The next number, uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        let jitter = self.own.uniform();
        match &mut self.spread {
            None => jitter,
            Some(spread) => spread.single(jitter),
        }
    }

    /// The next two numbers, uniform in [0, 1)².
    pub fn uniform2(&mut self) -> [f64; 2] {
        let jitter = self.own.uniform2();
        match &mut self.spread {
            None => jitter,
            Some(spread) => spread.pair(jitter),
        }
    }
}

impl Spread {
    fn single(&mut self, jitter: f64) -> f64 {
        let [order, scramble] = self.keys();
        match self.cells {
            Some(cells) => within(permuted(self.within, cells, order), cells, jitter),
            None => self.sobol(0, order as u32, scramble as u32, jitter),
        }
    }

    fn pair(&mut self, jitter: [f64; 2]) -> [f64; 2] {
        let [order, scramble] = self.keys();
        match self.cells {
            Some(cells) => {
                let [columns, rows] = grid(cells);
                let cell = permuted(self.within, columns * rows, order);
                [
                    within(cell % columns, columns, jitter[0]),
                    within(cell / columns, rows, jitter[1]),
                ]
            }
            None => {
                let scrambles = [scramble as u32, (scramble >> 32) as u32];
                [0, 1].map(|axis| self.sobol(axis, order as u32, scrambles[axis], jitter[axis]))
            }
        }
    }

    fn keys(&mut self) -> [u64; 2] {
        [self.shared.next_u64(), self.shared.next_u64()]
    }

    /// The sample's number in a dimension of Sobol's sequence. The functions of `sobol_burley` take and give words with their bits
    /// reversed.
    fn sobol(&self, dimension: usize, order: u32, scramble: u32, jitter: f64) -> f64 {
        let place = owen_scramble_rev(self.within.reverse_bits(), order);
        let scrambled = owen_scramble_rev(sobol_rev(place, dimension as u32), scramble);
        let cell = scrambled.reverse_bits() >> 16;
        // Multiples of 2⁻⁵³ below 1, so no rounding.
        let rest = (jitter / TWO_TO_MINUS_37).floor() * TWO_TO_MINUS_37;
        (f64::from(cell) + rest) * TWO_TO_MINUS_16
    }
}

/// Columns and rows of the grid of a pair: as few cells as a nearly square grid of at least so many has.
fn grid(cells: u32) -> [u32; 2] {
    let columns = (f64::from(cells).sqrt().round() as u32).max(1);
    [columns, cells.div_ceil(columns)]
}

/// A place in a cell of [0, 1).
fn within(cell: u32, cells: u32, jitter: f64) -> f64 {
    let place = (f64::from(cell) + jitter) / f64::from(cells);
    // The sum may have rounded up to the next cell.
    place.min(1.0_f64.next_down())
}

/// The place of `number` < `count` in a random order of `count` things that `key` decides. Over all keys every place is equally likely.
///
/// A bijection of the next power of two by xor, odd multiplication and shift, repeated until it falls below `count`, then a rotation.
fn permuted(number: u32, count: u32, key: u64) -> u32 {
    let mask = count.next_power_of_two() - 1;
    let shift = (mask.count_ones() / 2).max(1);
    let keys = [0, 1, 2, 3].map(|round| mix(&[key, round]) as u32);
    let mut place = number;
    loop {
        for key in keys {
            place = (place ^ key) & mask;
            place = place.wrapping_mul((key >> 16) << 1 | 1) & mask;
            place ^= place >> shift;
        }
        if place < count {
            break;
        }
    }
    let turn = (u64::from((mix(&[key, 4]) >> 32) as u32) * u64::from(count)) >> 32;
    ((u64::from(place) + turn) % u64::from(count)) as u32
}
