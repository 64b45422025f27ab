//! Vector instructions by choice at run time.
//!
//! Numeric code is written once, on plain numbers and arrays, in functions marked `#[inline(always)]`. [`Vectors::run`] compiles it
//! once for each instruction set and calls the version that was chosen. Rust never fuses or reorders floating-point operations, so
//! every choice gives the same bits.

use std::fmt;

#[cfg(target_arch = "x86_64")]
#[expect(
    unsafe_code,
    reason = "the only way to call code for instructions that not every processor has"
)]
mod x86;

/// Code that [`Vectors::run`] compiles for every instruction set.
pub trait Kernel {
    /// What it computes.
    type Output;

    /// The work itself. Must be `#[inline(always)]`, and so must what it calls, to be compiled for the chosen instructions.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// The few operations that compilers do not find by themselves.
pub trait Lanes: Copy {
    /// Bit i of the first mask says whether `values[i] > bound`, that of the second whether `values[i] < -bound`.
    fn beyond(self, values: &[f64; 8], bound: f64) -> (u32, u32);

    /// Bit i says whether `values[i] <= bound`.
    fn at_most(self, values: &[f32; 16], bound: f32) -> u32;

    /// The same; and writes `first + i` for every bit i that is set, in order, to the front of `out`, whose rest is left in any state.
    fn places_at_most(self, values: &[f32; 16], bound: f32, first: u32, out: &mut [u32; 16])
    -> u32;

    /// Writes `first + i` for every bit i of the sixteen that is set, in order, to the front of `out`; the rest of `out` is left in
    /// any state.
    fn places(self, bits: u32, first: u32, out: &mut [u32; 16]);

    /// Bit i says whether `low[k][i] <= most[k]` and `high[k][i] >= least[k]` on all three axes k: whether box i of sixteen and the
    /// box from `least` to `most` have a point in common. A box of NaN has none.
    fn overlaps(
        self,
        low: &[[f32; 16]; 3],
        high: &[[f32; 16]; 3],
        least: [f32; 3],
        most: [f32; 3],
    ) -> u32;
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Lanes for Portable {
    #[inline(always)]
    fn beyond(self, values: &[f64; 8], bound: f64) -> (u32, u32) {
        let (mut above, mut below) = (0, 0);
        for (i, &value) in values.iter().enumerate() {
            above |= u32::from(value > bound) << i;
            below |= u32::from(value < -bound) << i;
        }
        (above, below)
    }

    #[inline(always)]
    fn at_most(self, values: &[f32; 16], bound: f32) -> u32 {
        let bits = values.iter().enumerate();
        bits.fold(0, |mask, (i, &value)| mask | u32::from(value <= bound) << i)
    }

    #[inline(always)]
    fn overlaps(
        self,
        low: &[[f32; 16]; 3],
        high: &[[f32; 16]; 3],
        least: [f32; 3],
        most: [f32; 3],
    ) -> u32 {
        (0..16).fold(0, |mask, i| {
            let axes = (0..3).map(|k| (low[k][i] <= most[k]) & (high[k][i] >= least[k]));
            mask | u32::from(axes.fold(true, |all, one| all & one)) << i
        })
    }

    #[inline(always)]
    fn places_at_most(
        self,
        values: &[f32; 16],
        bound: f32,
        first: u32,
        out: &mut [u32; 16],
    ) -> u32 {
        let bits = self.at_most(values, bound);
        self.places(bits, first, out);
        bits
    }

    #[inline(always)]
    fn places(self, bits: u32, first: u32, out: &mut [u32; 16]) {
        let mut count = 0;
        for i in 0..16 {
            // Written always and kept if set: a branch would be mispredicted.
            out[count & 15] = first + i;
            count += (bits >> i & 1) as usize;
        }
    }
}

/// A set of vector instructions that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vectors(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// The name: `portable`, `avx2` or `avx512`.
impl fmt::Display for Vectors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Set::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => "avx512",
        })
    }
}

impl Vectors {
    /// What the compiler may assume of every processor of the target.
    pub fn portable() -> Self {
        Self(Set::Portable)
    }

    /// The widest set.
    pub fn best() -> Self {
        Self::all().next_back().unwrap_or(Self::portable())
    }

    /// Every set that can be run here, by rising width.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> {
        let sets = [
            Some(Set::Portable),
            #[cfg(target_arch = "x86_64")]
            (has_avx2()).then_some(Set::Avx2),
            #[cfg(target_arch = "x86_64")]
            (has_avx2() && has_avx512()).then_some(Set::Avx512),
        ];
        sets.into_iter().flatten().map(Self)
    }

    /// Runs a kernel with these instructions.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => x86::avx2(kernel),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => x86::avx512(kernel),
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Beyond([f64; 8], f64);

    impl Kernel for Beyond {
        type Output = (u32, u32);

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> (u32, u32) {
            lanes.beyond(&self.0, self.1)
        }
    }

    #[test]
    fn every_set_gives_the_same_masks() {
        let values = [1.0, -1.0, 0.5, -0.5, f64::NAN, f64::INFINITY, -3.0, 0.0];
        for vectors in Vectors::all() {
            let masks = |bound| vectors.run(Beyond(values, bound));
            assert_eq!(masks(0.5), (0b0010_0001, 0b0100_0010), "{vectors}");
            assert_eq!(masks(0.0), (0b0010_0101, 0b0100_1010), "{vectors}");
            assert_eq!(masks(f64::NAN), (0, 0), "{vectors}");
        }
    }

    struct AtMost([f32; 16], f32);

    impl Kernel for AtMost {
        type Output = u32;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> u32 {
            lanes.at_most(&self.0, self.1)
        }
    }

    #[test]
    fn every_set_compares_alike_and_nothing_with_nan() {
        let mut values = [1.0; 16];
        values[1..5].copy_from_slice(&[-1.0, 0.5, 0.5_f32.next_up(), f32::NAN]);
        values[7..9].copy_from_slice(&[f32::INFINITY, -3.0]);
        values[15] = 0.0;
        for vectors in Vectors::all() {
            let at_most = |bound| vectors.run(AtMost(values, bound));
            assert_eq!(at_most(0.5), 0b1000_0001_0000_0110, "{vectors}");
            assert_eq!(at_most(f32::INFINITY), 0xffef, "{vectors}");
            assert_eq!(at_most(f32::NAN), 0, "{vectors}");
        }
    }

    type Axes = [[f32; 16]; 3];

    struct Overlaps<'a>(&'a Axes, &'a Axes, [f32; 3], [f32; 3]);

    impl Kernel for Overlaps<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> u32 {
            lanes.overlaps(self.0, self.1, self.2, self.3)
        }
    }

    /// Box i reaches from i to i + 1 on one axis and over everything on the others; box 15 is empty.
    #[test]
    fn boxes_that_touch_overlap_on_every_axis() {
        let everything = f32::INFINITY;
        for axis in 0..3 {
            let (mut low, mut high) = ([[-everything; 16]; 3], [[everything; 16]; 3]);
            for i in 0..16 {
                low[axis][i] = i as f32;
                high[axis][i] = i as f32 + 1.0;
            }
            (low[axis][15], high[axis][15]) = (f32::NAN, f32::NAN);
            for vectors in Vectors::all() {
                let overlaps = |least: f32, most: f32| {
                    let (mut from, mut to) = ([0.0; 3], [0.0; 3]);
                    (from[axis], to[axis]) = (least, most);
                    vectors.run(Overlaps(&low, &high, from, to))
                };
                assert_eq!(overlaps(3.0, 4.5), 0b1_1100, "{vectors}");
                assert_eq!(overlaps(3.5, 3.5), 0b1000, "{vectors}");
                assert_eq!(overlaps(-1.0, -0.5), 0, "{vectors}");
                assert_eq!(overlaps(14.5, 20.0), 0b100_0000_0000_0000, "{vectors}");
                assert_eq!(overlaps(f32::NAN, 4.5), 0, "{vectors}");
                assert_eq!(overlaps(-everything, everything), 0x7fff, "{vectors}");
            }
        }
    }

    struct PlacesAtMost<'a>([f32; 16], f32, &'a mut [u32; 16]);

    impl Kernel for PlacesAtMost<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> u32 {
            lanes.places_at_most(&self.0, self.1, 160, self.2)
        }
    }

    #[test]
    fn places_are_those_of_the_bits_in_order() {
        for vectors in Vectors::all() {
            for bits in [0, 1, 0x8000, 0b1010_0110, 0xffff, 0x7ffe] {
                let is_set = |i: &u32| bits >> i & 1 == 1;
                let values = std::array::from_fn(|i| match is_set(&(i as u32)) {
                    true => 1.0,
                    false => [1.0_f32.next_up(), f32::NAN][i % 2],
                });
                let mut out = [0; 16];
                assert_eq!(vectors.run(PlacesAtMost(values, 1.0, &mut out)), bits);
                let expected: Vec<u32> = (0..16).filter(is_set).collect();
                let found = out[..expected.len()].iter().map(|place| place - 160);
                assert_eq!(found.collect::<Vec<_>>(), expected, "{vectors}");
            }
        }
    }
}
