//! Quick proofs that polynomials share no root, in arithmetic modulo a prime.
//!
//! A common divisor over the whole numbers stays one modulo a prime that does not divide a leading coefficient, so polynomials
//! that are coprime there are coprime. The converse may fail, which only costs time.

use super::polynomial::Polynomial;
use num_bigint::{BigInt, Sign};

/// The Mersenne prime 2⁶¹ − 1.
const PRIME: u64 = (1 << 61) - 1;

/// `true` only if the polynomials have no common divisor of degree ≥ 1.
pub(super) fn certainly_coprime(a: &Polynomial, b: &Polynomial) -> bool {
    let (a, b) = (residues(a), residues(b));
    // A leading coefficient that vanishes proves nothing.
    let whole = |p: &[u64]| p.last().is_some_and(|&lead| lead != 0);
    whole(&a) && whole(&b) && gcd_degree(a, b) == 0
}

/// `true` only if no root is multiple.
pub(super) fn certainly_square_free(polynomial: &Polynomial) -> bool {
    certainly_coprime(polynomial, &polynomial.derivative())
}

fn residues(polynomial: &Polynomial) -> Vec<u64> {
    let residue = |c: &BigInt| {
        let rest = u64::try_from(c.magnitude() % PRIME).unwrap_or(0);
        match c.sign() {
            Sign::Minus if rest > 0 => PRIME - rest,
            _ => rest,
        }
    };
    polynomial.coefficients().iter().map(residue).collect()
}

/// The product of two residues: 2⁶¹ is one more than the prime, so what is above is added to what is below.
fn multiply(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    let sum = (product as u64 & PRIME) + (product >> 61) as u64;
    if sum >= PRIME { sum - PRIME } else { sum }
}

/// a^(p − 2), by Fermat's little theorem.
fn inverse(a: u64) -> u64 {
    let (mut power, mut result, mut exponent) = (a, 1, PRIME - 2);
    while exponent > 0 {
        if exponent & 1 == 1 {
            result = multiply(result, power);
        }
        power = multiply(power, power);
        exponent >>= 1;
    }
    result
}

/// Degree of the greatest common divisor of polynomials whose last coefficients are not zero.
fn gcd_degree(mut a: Vec<u64>, mut b: Vec<u64>) -> usize {
    while let Some(&lead) = b.last() {
        let unit = inverse(lead);
        while a.len() >= b.len() {
            let quotient = multiply(a[a.len() - 1], unit);
            let offset = a.len() - b.len();
            for (x, &d) in a[offset..].iter_mut().zip(&b) {
                *x = (*x + PRIME - multiply(quotient, d)) % PRIME;
            }
            while a.last() == Some(&0) {
                a.pop();
            }
        }
        std::mem::swap(&mut a, &mut b);
    }
    a.len() - 1
}
