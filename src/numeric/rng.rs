//! Keyed random numbers: a pure function of (seed, stream, index, dimension), never of thread, tile or time.
//!
//! The generator is Philox4x32-10 (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011):
//! a keyed bijection of a 128-bit counter. The key is the seed; the counter holds the index (64 bits), the stream
//! (32 bits) and the block of dimensions (32 bits). Each block gives two doubles of 53 random bits.

use super::simd::{Kernel, Lanes, Vectors};

const MULTIPLIER: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
const ROUNDS: usize = 10;

/// What a random number is for. Streams never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// Camera samples and the paths that start from them.
    Camera = 1,
    /// Photons.
    Photon = 2,
    /// Starts of the Newton solver.
    Newton = 3,
    /// Rays, points and other inputs of experiments.
    Experiment = 4,
    /// Inputs of tests.
    Test = 5,
    /// Ways of camera paths through dielectrics, where they step from pass to pass.
    Choice = 6,
    /// What the samples of a pixel share: orders of cells and scramblings.
    Pattern = 7,
}

/// The Philox4x32-10 bijection of `counter` under `key`.
#[inline(always)]
pub fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..ROUNDS {
        let a = u64::from(MULTIPLIER[0]) * u64::from(counter[0]);
        let b = u64::from(MULTIPLIER[1]) * u64::from(counter[2]);
        counter = [
            (b >> 32) as u32 ^ counter[1] ^ key[0],
            b as u32,
            (a >> 32) as u32 ^ counter[3] ^ key[1],
            a as u32,
        ];
        key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
    }
    counter
}

/// A cursor over the dimensions of one (seed, stream, index).
#[derive(Clone, Debug)]
pub struct Stream {
    key: [u32; 2],
    counter: [u32; 4],
    spare: Option<u64>,
}

impl Stream {
    /// The stream of `index` (a pixel's sample, a photon, a ray ...) for one purpose.
    pub fn new(seed: u64, purpose: Purpose, index: u64) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            counter: [index as u32, (index >> 32) as u32, purpose as u32, 0],
            spare: None,
        }
    }

    /// The next 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        if let Some(bits) = self.spare.take() {
            return bits;
        }
        let [first, second] = pair(self.counter, self.key);
        self.counter[3] = self.counter[3].wrapping_add(1);
        self.spare = Some(second);
        first
    }

    /// The next number, uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn uniform(&mut self) -> f64 {
        fraction(self.next_u64())
    }

    /// The next two numbers, uniform in [0, 1)².
    pub fn uniform2(&mut self) -> [f64; 2] {
        [self.uniform(), self.uniform()]
    }

    /// Passes over the next two numbers: for nothing, where they are a block.
    pub fn skip2(&mut self) {
        if self.spare.is_none() {
            self.counter[3] = self.counter[3].wrapping_add(1);
        } else {
            self.uniform2();
        }
    }

    /// The next number, uniform in [low, high) up to rounding.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

/// The number in [0, 1) that 64 random bits stand for.
#[inline(always)]
fn fraction(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

/// The two halves of a block.
#[inline(always)]
fn pair(counter: [u32; 4], key: [u32; 2]) -> [u64; 2] {
    let words = philox(counter, key).map(u64::from);
    [words[1] << 32 | words[0], words[3] << 32 | words[2]]
}

/// Streams side by side, which draw in the lanes of vector registers the numbers that each would draw alone.
#[derive(Clone, Debug)]
pub struct Streams<const N: usize> {
    /// Words of 32 bits, in lanes as wide as their products.
    key: [[u64; N]; 2],
    counter: [[u64; N]; 4],
    /// The next bits, if all ones stand beside them; else nothing.
    spare: [u64; N],
    spared: [u64; N],
}

/// The lower half of a lane.
const WORD: u64 = u32::MAX as u64;

impl<const N: usize> Streams<N> {
    /// Streams that are to be put in.
    pub const BLANK: Self = Self {
        key: [[0; N]; 2],
        counter: [[0; N]; 4],
        spare: [0; N],
        spared: [0; N],
    };

    /// Puts a stream into a lane.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, stream: &Stream) {
        for (column, word) in self.key.iter_mut().zip(stream.key) {
            column[lane] = u64::from(word);
        }
        for (column, word) in self.counter.iter_mut().zip(stream.counter) {
            column[lane] = u64::from(word);
        }
        self.spare[lane] = stream.spare.unwrap_or(0);
        self.spared[lane] = u64::from(stream.spare.is_some()).wrapping_neg();
    }

    /// The stream of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Stream {
        Stream {
            key: [0, 1].map(|word| self.key[word][lane] as u32),
            counter: [0, 1, 2, 3].map(|word| self.counter[word][lane] as u32),
            spare: (self.spared[lane] != 0).then_some(self.spare[lane]),
        }
    }

    /// The next three numbers of each, uniform in [0, 1).
    #[inline(always)]
    pub fn uniform3(&mut self) -> [[f64; N]; 3] {
        let [first, second] = self.block();
        let [third, fourth] = self.block();
        let mut numbers = [[0.0; N]; 3];
        for lane in 0..N {
            // With a number to spare one block and a half are drawn, else two less one number.
            let (spared, spare) = (self.spared[lane], self.spare[lane]);
            let choose = |with: u64, without: u64| with & spared | without & !spared;
            numbers[0][lane] = fraction(choose(spare, first[lane]));
            numbers[1][lane] = fraction(choose(first[lane], second[lane]));
            numbers[2][lane] = fraction(choose(second[lane], third[lane]));
            self.counter[3][lane] = self.counter[3][lane].wrapping_add(spared) & WORD;
            self.spare[lane] = fourth[lane];
            self.spared[lane] = !spared;
        }
        numbers
    }

    /// The next block of each: [`pair`] in lanes, round by round.
    #[inline(always)]
    fn block(&mut self) -> [[u64; N]; 2] {
        let [mut key0, mut key1] = self.key;
        let [mut c0, mut c1, mut c2, mut c3] = self.counter;
        for _ in 0..ROUNDS {
            for lane in 0..N {
                let a = u64::from(MULTIPLIER[0]) * (c0[lane] & WORD);
                let b = u64::from(MULTIPLIER[1]) * (c2[lane] & WORD);
                c0[lane] = b >> 32 ^ c1[lane] ^ key0[lane];
                c1[lane] = b & WORD;
                c2[lane] = a >> 32 ^ c3[lane] ^ key1[lane];
                c3[lane] = a & WORD;
                key0[lane] = key0[lane].wrapping_add(u64::from(WEYL[0])) & WORD;
                key1[lane] = key1[lane].wrapping_add(u64::from(WEYL[1])) & WORD;
            }
        }
        let mut pairs = [[0; N]; 2];
        for lane in 0..N {
            pairs[0][lane] = c1[lane] << 32 | c0[lane];
            pairs[1][lane] = c3[lane] << 32 | c2[lane];
            self.counter[3][lane] = self.counter[3][lane].wrapping_add(1) & WORD;
        }
        pairs
    }
}

/// What draws numbers one by one.
pub trait Numbers {
    /// The next number, uniform in [0, 1).
    fn uniform(&mut self) -> f64;

    /// The next two numbers, uniform in [0, 1)².
    fn uniform2(&mut self) -> [f64; 2] {
        [self.uniform(), self.uniform()]
    }
}

impl Numbers for Stream {
    fn uniform(&mut self) -> f64 {
        Self::uniform(self)
    }
}

/// Numbers drawn ahead.
const AHEAD: usize = 6;

/// The first numbers of streams at their start, drawn side by side.
#[derive(Clone, Debug)]
pub struct Heads([[f64; Self::WIDTH]; AHEAD]);

impl Heads {
    /// Streams that draw together.
    pub const WIDTH: usize = 32;

    /// Of none yet.
    pub fn blank() -> Self {
        Self([[0.0; Self::WIDTH]; AHEAD])
    }

    /// Takes the streams of these lanes, which have drawn nothing.
    pub fn draw(&mut self, vectors: Vectors, stream: impl Fn(usize) -> Stream) {
        let mut streams = Streams::BLANK;
        for lane in 0..Self::WIDTH {
            streams.put(lane, &stream(lane));
        }
        vectors.run(Draw(self, streams));
    }

    /// The numbers of a stream that was taken into this lane.
    pub fn ahead(&self, lane: usize, stream: Stream) -> Ahead {
        Ahead {
            first: std::array::from_fn(|number| self.0[number][lane]),
            taken: 0,
            stream,
        }
    }
}

/// Draws the first numbers.
struct Draw<'a>(&'a mut Heads, Streams<{ Heads::WIDTH }>);

impl Kernel for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, _: L) {
        for numbers in self.0.0.as_chunks_mut().0 {
            *numbers = self.1.uniform3();
        }
    }
}

/// A stream whose first numbers have been drawn beside those of others.
#[derive(Clone, Debug)]
pub struct Ahead {
    first: [f64; AHEAD],
    taken: usize,
    /// At its start, until all of the first numbers are taken.
    stream: Stream,
}

impl Ahead {
    /// The stream after the numbers taken.
    pub fn stream(mut self) -> Stream {
        self.settle(self.taken.min(AHEAD));
        self.stream
    }

    /// Lets the stream pass so many numbers, if it is at its start.
    fn settle(&mut self, numbers: usize) {
        if self.stream.counter[3] == 0 && numbers > 0 {
            self.stream.counter[3] = numbers as u32 / 2;
            if numbers % 2 == 1 {
                self.stream.next_u64();
            }
        }
    }
}

impl Numbers for Ahead {
    fn uniform(&mut self) -> f64 {
        let next = self.first.get(self.taken).copied();
        self.taken += 1;
        next.unwrap_or_else(|| {
            self.settle(AHEAD);
            self.stream.uniform()
        })
    }
}

/// Mixes words into 64 bits (finaliser of SplitMix64, Steele, Lea and Flood 2014): a key or an index out of several numbers.
pub fn mix(words: &[u64]) -> u64 {
    words.iter().fold(0x9E37_79B9_7F4A_7C15, |state, &word| {
        let mut z = (state ^ word).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known answers published with Random123 (kat_vectors, philox4x32 10).
    #[test]
    fn philox_gives_the_published_answers() {
        assert_eq!(
            philox([0; 4], [0; 2]),
            [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]
        );
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox(
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0]
            ),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn numbers_passed_over_are_two() {
        for before in 0..4 {
            let mut stream = Stream::new(9, Purpose::Test, 1);
            for _ in 0..before {
                stream.next_u64();
            }
            let mut skipping = stream.clone();
            skipping.skip2();
            stream.uniform2();
            assert_eq!(
                [0; 3].map(|_| skipping.next_u64()),
                [0; 3].map(|_| stream.next_u64())
            );
        }
    }

    /// With and without a number to spare, and where the count of blocks begins anew.
    #[test]
    fn streams_side_by_side_draw_what_each_draws_alone() {
        let mut alone: [Stream; 8] = std::array::from_fn(|i| {
            let mut stream = Stream::new(3 << 40 | 5, Purpose::Test, (i as u64) << 30);
            stream.counter[3] = if i % 3 == 0 { u32::MAX - 1 } else { i as u32 };
            for _ in 0..i % 4 {
                stream.next_u64();
            }
            stream
        });
        let mut lanes = Streams::<8>::BLANK;
        for (lane, stream) in alone.iter().enumerate() {
            lanes.put(lane, stream);
        }
        for _ in 0..5 {
            let numbers = lanes.uniform3();
            for (lane, stream) in alone.iter_mut().enumerate() {
                for numbers in &numbers {
                    assert_eq!(numbers[lane], stream.uniform());
                }
                let mut next = lanes.get(lane);
                assert_eq!(next.next_u64(), stream.clone().next_u64());
            }
        }
    }

    #[test]
    fn numbers_drawn_ahead_are_those_of_the_stream() {
        let start = |i: usize| Stream::new(7, Purpose::Test, 1000 + i as u64);
        for vectors in Vectors::all() {
            let mut heads = Heads::blank();
            heads.draw(vectors, start);
            for i in 0..Heads::WIDTH {
                let (mut ahead, mut stream) = (heads.ahead(i, start(i)), start(i));
                for _ in 0..i {
                    assert_eq!(Numbers::uniform(&mut ahead), stream.uniform());
                }
                let mut after = ahead.stream();
                let bits = [0; 3].map(|_| after.next_u64());
                assert_eq!(bits, [0; 3].map(|_| stream.next_u64()), "{vectors} {i}");
            }
        }
    }

    #[test]
    fn streams_of_different_keys_differ() {
        let draw = |seed, purpose, index| Stream::new(seed, purpose, index).next_u64();
        let base = draw(1, Purpose::Camera, 5);
        assert_eq!(base, draw(1, Purpose::Camera, 5));
        for other in [
            draw(2, Purpose::Camera, 5),
            draw(1, Purpose::Photon, 5),
            draw(1, Purpose::Camera, 6),
        ] {
            assert_ne!(base, other);
        }
        assert_ne!(draw(1 << 32, Purpose::Test, 0), draw(1, Purpose::Test, 0));
        assert_ne!(draw(0, Purpose::Test, 1 << 32), draw(0, Purpose::Test, 0));
    }

    /// Mean and second moment of 10⁵ numbers within 6 standard errors (false alarm 4e-9 for this fixed seed).
    #[test]
    fn uniform_numbers_have_the_moments_of_the_unit_interval() {
        let n = 100_000;
        let mut stream = Stream::new(3, Purpose::Test, 0);
        let (mut first, mut second) = (0.0, 0.0);
        for _ in 0..n {
            let x = stream.uniform();
            assert!((0.0..1.0).contains(&x));
            first += x;
            second += x * x;
        }
        let n = f64::from(n);
        assert!((first / n - 0.5).abs() < 6.0 * (1.0 / 12.0 / n).sqrt());
        assert!((second / n - 1.0 / 3.0).abs() < 6.0 * (4.0 / 45.0 / n).sqrt());
    }
}
