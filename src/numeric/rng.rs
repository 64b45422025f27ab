//! Keyed random numbers: a pure function of (seed, stream, index, dimension), never of thread, tile or time.
//!
//! The generator is Philox4x32-10 (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011):
//! a keyed bijection of a 128-bit counter. The key is the seed; the counter holds the index (64 bits), the stream
//! (32 bits) and the block of dimensions (32 bits). Each block gives two doubles of 53 random bits.

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
        let words = philox(self.counter, self.key);
        self.counter[3] = self.counter[3].wrapping_add(1);
        self.spare = Some(u64::from(words[3]) << 32 | u64::from(words[2]));
        u64::from(words[1]) << 32 | u64::from(words[0])
    }

    /// The next number, uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// The next two numbers, uniform in [0, 1)².
    pub fn uniform2(&mut self) -> [f64; 2] {
        [self.uniform(), self.uniform()]
    }

    /// The next number, uniform in [low, high) up to rounding.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
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
