//! Numbers m · 2^e with whole m and e.

use num_bigint::BigInt;
use num_traits::{One, Signed, Zero};

/// The number `mantissa` · 2^`exponent`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dyadic {
    /// Signed whole part.
    pub mantissa: BigInt,
    /// Power of two.
    pub exponent: i64,
}

impl Dyadic {
    /// A number from its parts.
    pub fn new(mantissa: BigInt, exponent: i64) -> Self {
        Self { mantissa, exponent }
    }

    /// The exact value of a finite `x`, with an odd mantissa (zero has exponent 0). Infinities and NaN give zero.
    pub fn from_f64(x: f64) -> Self {
        let bits = x.to_bits();
        let field = (bits >> 52 & 0x7ff) as i64;
        let fraction = bits & ((1 << 52) - 1);
        let (mantissa, exponent) = if field == 0 {
            (fraction, -1074)
        } else {
            (fraction | 1 << 52, field - 1075)
        };
        if !x.is_finite() || mantissa == 0 {
            return Self::new(BigInt::zero(), 0);
        }
        let zeros = mantissa.trailing_zeros();
        let magnitude = BigInt::from(mantissa >> zeros);
        let signed = if x < 0.0 { -magnitude } else { magnitude };
        Self::new(signed, exponent + i64::from(zeros))
    }

    /// The mantissa this number has at another exponent, which must not be greater than its own.
    pub fn at(&self, exponent: i64) -> BigInt {
        &self.mantissa << u64::try_from(self.exponent - exponent).unwrap_or(0)
    }

    /// Sum.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let exponent = self.exponent.min(other.exponent);
        Self::new(self.at(exponent) + other.at(exponent), exponent)
    }

    /// Product.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        Self::new(
            &self.mantissa * &other.mantissa,
            self.exponent + other.exponent,
        )
    }

    /// The opposite number.
    #[must_use]
    pub fn negated(&self) -> Self {
        Self::new(-&self.mantissa, self.exponent)
    }

    /// The square root, rounded down, with at least 80 correct bits. The number must not be negative.
    #[must_use]
    pub fn sqrt(&self) -> Self {
        let mut shift = 160_i64 - i64::try_from(self.mantissa.bits()).unwrap_or(160);
        shift = shift.max(0);
        shift += (self.exponent - shift) & 1;
        let scaled = self.at(self.exponent - shift);
        Self::new(scaled.sqrt(), (self.exponent - shift) / 2)
    }

    /// The quotient, rounded to the nearest f64 (twice where it is subnormal); the divisor must not be zero.
    pub fn over(&self, divisor: &Self) -> f64 {
        let shift = 70 + i64::try_from(divisor.mantissa.bits()).unwrap_or(0)
            - i64::try_from(self.mantissa.bits()).unwrap_or(0);
        let shift = shift.max(0);
        let numerator = self.mantissa.magnitude() << shift as u64;
        let quotient = &numerator / divisor.mantissa.magnitude();
        let inexact = &quotient * divisor.mantissa.magnitude() != numerator;
        // Seventy bits or more: keep 64 and a sticky bit, so that the conversion rounds as the exact quotient would.
        let excess = quotient.bits().saturating_sub(100);
        let kept = u128::try_from(&quotient >> excess).unwrap_or(0);
        let lost = inexact
            || quotient
                .trailing_zeros()
                .is_some_and(|zeros| zeros < excess);
        let rounded = (kept << 1 | u128::from(lost)) as f64;
        let exponent = self.exponent - divisor.exponent - shift + excess as i64 - 1;
        let size = libm::scalbn(rounded, exponent.clamp(-5000, 5000) as i32);
        if self.mantissa.is_negative() == divisor.mantissa.is_negative() {
            size
        } else {
            -size
        }
    }

    /// The nearest f64.
    pub fn to_f64(&self) -> f64 {
        self.over(&Self::new(BigInt::one(), 0))
    }
}
