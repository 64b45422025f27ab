//! Sums that do not depend on the order of their terms, nor on how these are split into parts.
//!
//! A term's binary digits are cut into limbs of 30 bits at fixed places of the number line; limbs at the same place add up as
//! integers, without rounding (the fixed-point accumulator of Kulisch 1971). Only the three places at the top of the largest
//! term are kept, as in the binned sums of Demmel and Nguyen (2013): they are a function of the set of terms, so the sum is one
//! too. What falls below is cut off term by term: less than 2⁻⁵² of the largest term for each.

/// Bits of a limb. A term adds less than 2³⁰ to each, so 64 bits take 2³³ terms.
const BITS: i32 = 30;
/// Limbs kept: as many as a double can touch.
const LIMBS: usize = 3;
/// Places of the lowest limbs of doubles, from the least subnormal number to the largest number.
const PLACES: std::ops::RangeInclusive<i16> = -36..=32;
/// Place of a sum without terms: below that of every double.
const EMPTY: i16 = i16::MIN;

/// `N` sums, each of at most 2³³ finite doubles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sums<const N: usize> {
    /// Integers at the places p, p + 1, …, in units of 2^(30 p).
    limbs: [[i64; LIMBS]; N],
    /// The lowest place p of each.
    places: [i16; N],
}

impl<const N: usize> Default for Sums<N> {
    fn default() -> Self {
        Self {
            limbs: [[0; LIMBS]; N],
            places: [EMPTY; N],
        }
    }
}

impl<const N: usize> Sums<N> {
    /// Number of bytes of the sums in a file.
    pub const BYTES: usize = N * (8 * LIMBS + 2);

    /// Adds a term, which must be finite, to sum `index`.
    pub fn add(&mut self, index: usize, term: f64) {
        if term != 0.0 {
            let (limbs, place) = cut(term);
            self.join_one(index, limbs, place);
        }
    }

    /// Adds the terms of another part.
    pub fn join(&mut self, other: &Self) {
        for index in 0..N {
            self.join_one(index, other.limbs[index], other.places[index]);
        }
    }

    fn join_one(&mut self, index: usize, mut limbs: [i64; LIMBS], mut place: i16) {
        if place > self.places[index] {
            std::mem::swap(&mut limbs, &mut self.limbs[index]);
            std::mem::swap(&mut place, &mut self.places[index]);
        }
        let above = (i32::from(self.places[index]) - i32::from(place)) as usize;
        for (limb, more) in self.limbs[index].iter_mut().zip(limbs.iter().skip(above)) {
            *limb = limb.wrapping_add(*more);
        }
    }

    /// Sum `index` as a double, and the small rest that the double leaves; infinite if it is out of range.
    pub fn value(&self, index: usize) -> (f64, f64) {
        let place = i32::from(self.places[index]);
        let limbs = self.limbs[index].iter().enumerate().rev();
        let mut sum = (0.0, 0.0);
        for (position, &limb) in limbs.filter(|(_, limb)| **limb != 0) {
            // A limb has up to 63 bits: each half is exact as a double.
            for half in [limb >> 32 << 32, limb & 0xFFFF_FFFF] {
                let term = libm::ldexp(half as f64, BITS * (place + position as i32));
                let (total, rest) = two_sum(sum.0, term);
                sum = two_sum(total, sum.1 + rest);
            }
        }
        sum
    }

    /// The sums as bytes, appended to a file.
    pub fn write(&self, out: &mut Vec<u8>) {
        for limb in self.limbs.as_flattened() {
            out.extend(limb.to_le_bytes());
        }
        for place in self.places {
            out.extend(place.to_le_bytes());
        }
    }

    /// The sums of [`Self::BYTES`] bytes; `None` if they are no sums.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != Self::BYTES {
            return None;
        }
        let (limbs, places) = bytes.split_at(8 * LIMBS * N);
        let mut limbs = limbs.as_chunks().0.iter().map(|&b| i64::from_le_bytes(b));
        let mut places = places.as_chunks().0.iter().map(|&b| i16::from_le_bytes(b));
        let mut sums = Self::default();
        for limb in sums.limbs.as_flattened_mut() {
            *limb = limbs.next()?;
        }
        for place in &mut sums.places {
            *place = places
                .next()
                .filter(|place| *place == EMPTY || PLACES.contains(place))?;
        }
        Some(sums)
    }
}

/// The limbs of a finite double that is not 0, and the place of the lowest.
fn cut(term: f64) -> ([i64; LIMBS], i16) {
    const MASK: u64 = (1 << BITS) - 1;
    let bits = term.to_bits();
    let biased = bits >> 52 & 0x7FF;
    let fraction = bits & ((1 << 52) - 1);
    // |term| = mantissa · 2^(exponent − 1080); subnormal numbers have no hidden bit.
    let (mantissa, exponent) = match biased {
        0 => (fraction, 6),
        _ => (fraction | 1 << 52, biased + 5),
    };
    let (place, shift) = (exponent / BITS as u64, exponent % BITS as u64);
    let above = mantissa >> (BITS as u64 - shift);
    let limbs = [mantissa << shift & MASK, above & MASK, above >> BITS];
    // 0 or −1: the two's complement of a negative term's limbs.
    let sign = bits as i64 >> 63;
    (
        limbs.map(|limb| (limb as i64 ^ sign) - sign),
        place as i16 + PLACES.start(),
    )
}

/// a + b and the rounding of it (Knuth 1969); no rest where the sum is infinite.
pub fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    let rest = (a - (sum - of_b)) + (b - of_b);
    (sum, if sum.is_finite() { rest } else { 0.0 })
}

/// a · b and the rounding of it, by a fused multiply-add.
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    /// Terms of very different size and both signs.
    fn terms(count: usize) -> Vec<f64> {
        let mut stream = Stream::new(7, Purpose::Test, 0);
        (0..count)
            .map(|_| {
                let exponent = stream.range(-60.0, 60.0) as i32;
                libm::ldexp(stream.range(-1.0, 1.0), exponent)
            })
            .collect()
    }

    fn sum(terms: impl IntoIterator<Item = f64>) -> Sums<1> {
        let mut sum = Sums::default();
        terms.into_iter().for_each(|term| sum.add(0, term));
        sum
    }

    /// The same for all orders and splits of the terms.
    fn depends_on_the_terms_only(sum: impl Fn(&[&[f64]]) -> Vec<u64>) -> bool {
        let terms = terms(300);
        let mut sorted = terms.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let backwards: Vec<f64> = sorted.iter().rev().copied().collect();
        let whole = sum(&[&terms]);
        sum(&[&sorted]) == whole
            && sum(&[&backwards]) == whole
            && (0..=300).all(|at| sum(&[&terms[..at], &terms[at..]]) == whole)
            && sum(&[&terms[200..], &[], &terms[..90], &terms[90..200]]) == whole
    }

    #[test]
    fn sums_depend_on_their_terms_only() {
        assert!(depends_on_the_terms_only(|parts| {
            let mut all = Sums::<1>::default();
            for part in parts {
                all.join(&sum(part.iter().copied()));
            }
            let (value, rest) = all.value(0);
            vec![value.to_bits(), rest.to_bits()]
        }));
        assert!(!depends_on_the_terms_only(|parts| {
            let sums = parts.iter().map(|part| part.iter().sum::<f64>());
            vec![sums.sum::<f64>().to_bits()]
        }));
    }

    #[test]
    fn sums_are_as_exact_as_they_say() {
        let terms = terms(1000);
        let exact: i128 = (terms.iter())
            .map(|term| libm::ldexp(*term, 50) as i128)
            .sum();
        let largest = terms
            .iter()
            .fold(0.0_f64, |most, term| most.max(term.abs()));
        let (value, _) = sum(terms).value(0);
        let exact = libm::ldexp(exact as f64, -50);
        assert!((value - exact).abs() <= 1001.0 * libm::ldexp(largest, -52));
        // Without cutting there is no error: 2⁵³ + 1 needs the rest.
        let two = sum([libm::ldexp(1.0, 53), 1.0, -0.0]);
        assert_eq!(two.value(0), (libm::ldexp(1.0, 53), 1.0));
        assert_eq!(sum([0.1, -0.1]).value(0), (0.0, 0.0));
    }

    #[test]
    fn the_ends_of_the_range_add_up() {
        let least = f64::from_bits(1);
        assert_eq!(
            sum([least, least, f64::MIN_POSITIVE]).value(0).0,
            f64::MIN_POSITIVE + 2.0 * least
        );
        assert_eq!(sum([f64::MAX]).value(0), (f64::MAX, 0.0));
        assert_eq!(
            sum([f64::MAX, f64::MAX, -f64::MAX]).value(0),
            (f64::MAX, 0.0)
        );
        assert_eq!(sum([f64::MAX, f64::MAX]).value(0).0, f64::INFINITY);
        assert_eq!(sum([]).value(0), (0.0, 0.0));
        for term in [least, -3.5, 1e300, -1e-300, 1.0 / 3.0] {
            assert_eq!(sum([term]).value(0), (term, 0.0));
            assert!(PLACES.contains(&cut(term).1));
        }
        assert_eq!(
            (cut(least).1, cut(f64::MAX).1),
            (*PLACES.start(), *PLACES.end())
        );
    }

    #[test]
    fn sums_come_back_from_their_bytes_and_other_bytes_are_refused() {
        let mut sums = Sums::<3>::default();
        sums.add(0, 0.3);
        sums.add(2, -7e30);
        let mut bytes = Vec::new();
        sums.write(&mut bytes);
        assert_eq!(bytes.len(), Sums::<3>::BYTES);
        assert_eq!(Sums::read(&bytes), Some(sums));
        assert_eq!(Sums::<3>::read(&bytes[1..]), None);
        let last = bytes.len() - 1;
        bytes[last] = 0x7F;
        assert_eq!(Sums::<3>::read(&bytes), None);
    }
}
