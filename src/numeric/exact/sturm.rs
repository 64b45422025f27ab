//! Counting roots by Sturm's theorem: the second route, which shares no root finding with the first.

use super::polynomial::Polynomial;
use super::{Dyadic, sign};
use num_bigint::BigInt;
use num_traits::One;

/// The signed remainder sequence of f and f′ g mod f.
///
/// With V(x) the number of sign changes of the sequence at x, V(a) − V(b) is the sum of sign g over the distinct roots of f in
/// (a, b), if f is zero at neither end (Sturm 1829 for g = 1; Tarski 1951; Basu, Pollack and Roy 2006, theorem 2.73).
#[derive(Clone, Debug)]
pub struct Sturm {
    chain: Vec<Polynomial>,
}

impl Sturm {
    /// The sequence that counts roots of `polynomial`.
    pub fn new(polynomial: &Polynomial) -> Self {
        Self::weighted(polynomial, &Polynomial::new(vec![BigInt::one()]))
    }

    /// The sequence that sums the signs of `weight` over the roots of `polynomial`.
    pub fn weighted(polynomial: &Polynomial, weight: &Polynomial) -> Self {
        let next = polynomial.derivative().times(weight);
        Self {
            chain: polynomial.remainders(&next.pseudo_remainder(polynomial), -1),
        }
    }

    /// The sum of the signs over the distinct roots in the open interval; the polynomial must not be zero at its ends.
    pub fn between(&self, low: &Dyadic, high: &Dyadic) -> i64 {
        self.changes(low) - self.changes(high)
    }

    /// The last of the sequence: for the plain one, the common divisor of the polynomial and its derivative, up to a constant.
    pub fn common(&self) -> Option<&Polynomial> {
        self.chain.last()
    }

    fn changes(&self, at: &Dyadic) -> i64 {
        let bits = u64::try_from(-at.exponent.min(0)).unwrap_or(0);
        let numerator = at.at(-(bits as i64));
        let signs = self.chain.iter();
        let signs = signs.map(|p| sign(&p.scaled_value(&numerator, bits)));
        signs
            .filter(|&s| s != 0)
            .fold((0, 0), |(last, count), s| {
                (s, count + i64::from(last * s < 0))
            })
            .1
    }
}
