//! Polynomials in 128 bits: signs, values and isolated roots that are certain where they are told at all.
//!
//! Coefficients are rounded to whole multiples of one power of two, and every operation after that bounds what it rounds away. What
//! is nearer to zero than its bound is not told, and the caller asks the whole numbers; an interval in which the signs of
//! coefficients are not certain is halved further, which is always allowed.

use super::polynomial::Polynomial;
use super::row::Row;
use num_bigint::{BigInt, Sign};
use num_traits::ToPrimitive;

/// Greatest degree.
pub(super) const DEGREE: usize = 6;
/// Bits of the greatest coefficient: no sum of seven times 60 ([`BINOMIALS`]) overflows.
const BITS: i64 = 116;
/// Bound of the error of a value: the coefficients', and that of six products and sums.
pub(super) const VALUE_ERROR: u128 = 16;
/// A place x in [0, 1] is told as x · 2¹²⁷.
pub(super) const PLACE_BITS: u64 = 127;
/// What a value in f64 may be off by, over the sizes of its terms.
pub(super) const FLOAT_ERROR: f64 = 8.0 * f64::EPSILON;

/// A polynomial of degree ≤ 6, rounded.
#[derive(Clone, Debug)]
pub(super) struct Fixed {
    coefficients: [i128; DEGREE + 1],
    degree: usize,
    /// The coefficients count 2^exponent.
    exponent: i64,
}

/// A step towards a root.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) change: f64,
    /// About how far from the root it ends, and no proof.
    pub(super) error: f64,
}

impl Fixed {
    /// `None` for a degree above 6 and for zero.
    pub(super) fn new(polynomial: &Polynomial) -> Option<Self> {
        let whole = polynomial.coefficients();
        if whole.is_empty() || whole.len() > DEGREE + 1 {
            return None;
        }
        let most = whole.iter().map(BigInt::bits).max().unwrap_or(0);
        let exponent = i64::try_from(most).ok()? - BITS;
        let mut coefficients = [0; DEGREE + 1];
        for (to, from) in coefficients.iter_mut().zip(whole) {
            *to = leading(from, exponent);
        }
        Some(Self {
            coefficients,
            degree: whole.len() - 1,
            exponent,
        })
    }

    /// Values count 2^this.
    pub(super) fn exponent(&self) -> i64 {
        self.exponent
    }

    /// The place of `numerator`/2^`bits`.
    pub(super) fn place(numerator: &BigInt, bits: u64) -> Option<u128> {
        let shift = PLACE_BITS.checked_sub(bits)?;
        Some(numerator.to_u128()? << shift)
    }

    /// The value at a place, in units of 2^exponent, within [`VALUE_ERROR`].
    pub(super) fn value(&self, place: u128) -> i128 {
        let coefficients = self.coefficients[..=self.degree].iter().rev();
        coefficients.fold(0, |sum, c| product(sum, place) + c)
    }

    /// The sign at a place, where certain.
    pub(super) fn sign_at(&self, place: u128) -> Option<i32> {
        let value = self.value(place);
        (value.unsigned_abs() > VALUE_ERROR).then_some(value.signum() as i32)
    }

    /// The value on an interval of width 2^−`bits` up from a place within a factor 1 ± 2^−`accuracy`, as m · 2^e, if it is known
    /// that well.
    pub(super) fn value_near(&self, place: u128, bits: u64, accuracy: u64) -> Option<(i128, i64)> {
        let value = self.value(place);
        let terms = (0..).zip(&self.coefficients);
        let slope: u128 = terms.map(|(k, c)| k * (c.unsigned_abs() + 1)).sum();
        let error = VALUE_ERROR + (slope >> bits.min(127)) + 1;
        let enough = value.unsigned_abs() >> accuracy.min(127) > error;
        enough.then_some((value, self.exponent))
    }

    /// The coefficients in f64.
    pub(super) fn to_floats(&self) -> [f64; DEGREE + 1] {
        self.coefficients.map(|c| c as f64)
    }

    /// The step of Newton's method from a place near a root.
    pub(super) fn newton(&self, place: u128) -> Step {
        let c = self.to_floats();
        let slope = slope(&c, to_f64(place));
        let change = -(self.value(place) as f64) / slope;
        let error = (VALUE_ERROR as f64 + self.after(change)) / slope.abs();
        Step { change, error }
    }

    /// About the value that is left after a step of Newton's method in f64, by the error of the slope and by the curvature.
    pub(super) fn after(&self, change: f64) -> f64 {
        let sizes = self.coefficients.iter().enumerate();
        let sizes = sizes.map(|(k, &c)| (k as f64, (c as f64).abs()));
        let terms = sizes.map(|(k, c)| k * c * (FLOAT_ERROR + 0.5 * (k - 1.0) * change.abs()));
        change.abs() * terms.sum::<f64>()
    }

    /// Bernstein coefficients of degree `n`, not below this one's, times a positive whole number.
    pub(super) fn row(&self, n: usize) -> Row {
        let (multiple, binomials) = BINOMIALS[n];
        let weighted = |k: usize| self.coefficients[k] * (multiple / binomials[k]);
        let mut coefficients = [0; DEGREE + 1];
        for (j, to) in coefficients.iter_mut().enumerate().take(n + 1) {
            *to = (0..=j).map(|k| weighted(k) * BINOMIALS[j].1[k]).sum();
        }
        Row::new(coefficients, n, multiple * (n as i128 + 1))
    }
}

/// C(n, k) by n and k, with their least common multiple by n.
const BINOMIALS: [(i128, [i128; DEGREE + 1]); DEGREE + 1] = [
    (1, [1, 0, 0, 0, 0, 0, 0]),
    (1, [1, 1, 0, 0, 0, 0, 0]),
    (2, [1, 2, 1, 0, 0, 0, 0]),
    (3, [1, 3, 3, 1, 0, 0, 0]),
    (12, [1, 4, 6, 4, 1, 0, 0]),
    (10, [1, 5, 10, 10, 5, 1, 0]),
    (60, [1, 6, 15, 20, 15, 6, 1]),
];

/// A place as a number.
pub(super) fn to_f64(place: u128) -> f64 {
    place as f64 * libm::ldexp(1.0, -(PLACE_BITS as i32))
}

/// The derivative of a polynomial with these coefficients, lowest power first.
pub(super) fn slope(coefficients: &[f64], at: f64) -> f64 {
    let terms = coefficients.iter().enumerate().skip(1).rev();
    terms.fold(0.0, |sum, (k, c)| sum * at + k as f64 * c)
}

/// `value` over 2^exponent, rounded towards zero; it must fit.
fn leading(value: &BigInt, exponent: i64) -> i128 {
    let size = value.magnitude();
    let size = if exponent <= 0 {
        size.to_u128().unwrap_or(0) << -exponent
    } else {
        let (skipped, shift) = ((exponent / 64) as usize, exponent % 64);
        let digits = size.iter_u64_digits().skip(skipped);
        (0..).zip(digits).fold(0, |sum, (i, digit)| {
            let up = 64 * i - shift;
            let digit = u128::from(digit);
            sum | if up < 0 { digit >> -up } else { digit << up }
        })
    } as i128;
    if value.sign() == Sign::Minus {
        -size
    } else {
        size
    }
}

/// A number times a place, towards zero.
fn product(a: i128, place: u128) -> i128 {
    const LOW: u128 = u64::MAX as u128;
    let size = a.unsigned_abs();
    let [[a1, a0], [b1, b0]] = [size, place].map(|x| [x >> 64, x & LOW]);
    let middle = a1 * b0 + ((a0 * b0) >> 64);
    let other = a0 * b1 + (middle & LOW);
    let high = a1 * b1 + (middle >> 64) + (other >> 64);
    let result = (high << 1 | (other >> 63 & 1)) as i128;
    if a < 0 { -result } else { result }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::exact::sign;
    use crate::numeric::rng::{Purpose, Stream};
    use num_traits::{One, Signed};

    /// A random polynomial, one in two so that it almost vanishes at `numerator` / 2^`bits`.
    fn polynomial(stream: &mut Stream, numerator: &BigInt, bits: u64) -> Polynomial {
        let mut whole = || {
            let digits = BigInt::from(stream.next_u64() as i64);
            (digits * stream.next_u64()) >> (128.0 * stream.uniform()) as u64
        };
        let mut random = |count: u64| Polynomial::new((0..count).map(|_| whole()).collect());
        let degree = (bits + numerator.bits()) % 6;
        if bits.is_multiple_of(2) {
            return random(degree + 2);
        }
        let line = Polynomial::new(vec![-numerator, BigInt::one() << bits]);
        let rest = random(degree + 1);
        line.times(&rest).plus(&random(1))
    }

    /// Values, signs and Bernstein coefficients lie within their bounds; and most are told.
    #[test]
    fn what_128_bits_tell_is_true() {
        let (mut signs, mut values) = (0, 0);
        let count = 3000;
        for index in 0..count {
            let mut stream = Stream::new(81, Purpose::Test, index);
            let bits = (120.0 * stream.uniform()) as u64;
            let numerator = (BigInt::from(stream.next_u64()) << bits) >> 64;
            let polynomial = polynomial(&mut stream, &numerator, bits);
            let Some(fixed) = Fixed::new(&polynomial) else {
                continue;
            };
            let place = Fixed::place(&numerator, bits).expect("a place");
            let n = polynomial.degree() as u64;
            // In units of 2^(exponent − common).
            let common = 130 + bits * n;
            let unit = |value: BigInt, exponent: i64| {
                value << (exponent + common as i64 - fixed.exponent()) as u64
            };
            let exact = polynomial.scaled_value(&numerator, bits);
            let true_value = unit(exact.clone(), -((bits * n) as i64));
            let told = BigInt::from(fixed.value(place)) << common;
            let bound = BigInt::from(VALUE_ERROR) << common;
            assert!((told - &true_value).abs() <= bound, "{index}");
            if let Some(told) = fixed.sign_at(place) {
                assert_eq!(told, sign(&exact), "{index}");
                signs += 1;
            }
            if let Some((value, exponent)) = fixed.value_near(place, bits, 20) {
                assert_eq!(exponent, fixed.exponent());
                let told = BigInt::from(value) << common;
                for step in 0..2 {
                    let end = polynomial.scaled_value(&(&numerator + step), bits);
                    let end = unit(end, -((bits * n) as i64));
                    assert!((end - &told).abs() << 20 <= told.abs(), "{index}");
                }
                values += 1;
            }
            let row = fixed.row(n as usize);
            for (told, exact) in row.coefficients().iter().zip(polynomial.bernstein()) {
                let error = (BigInt::from(*told) << common) - unit(exact, 0);
                assert!(
                    error.abs() <= BigInt::from(row.error()) << common,
                    "{index}"
                );
            }
        }
        assert!(signs > count / 2 && values > count / 8, "{signs} {values}");
    }

    #[test]
    fn products_with_a_place_are_cut_towards_zero() {
        let one = 1_u128 << PLACE_BITS;
        for a in [
            0,
            1,
            -1,
            i128::MAX >> 4,
            i128::MIN >> 4,
            -(1 << 64),
            (1 << 100) + 12345,
        ] {
            assert_eq!(product(a, one), a);
            assert_eq!(product(a, 0), 0);
            for share in [one / 3, one - 1, 1, 1 << 63, (1 << 64) + 1] {
                let exact: BigInt = (BigInt::from(a.unsigned_abs()) * share) >> PLACE_BITS;
                assert_eq!(
                    BigInt::from(product(a, share)),
                    exact * a.signum(),
                    "{a} {share}"
                );
            }
        }
    }
}
