//! Isolation and refinement of the real roots in [0, 1].

use super::dyadic::Dyadic;
use super::polynomial::Polynomial;
use super::sign;
use num_bigint::BigInt;
use num_traits::{One, Signed, Zero};
use std::rc::Rc;

/// Values taken at a root carry this many correct leading bits: eleven more than an f64 holds.
const VALUE_BITS: u64 = 64;
/// Bisection gives up at this depth and asks for the square-free factors: simple roots of ordinary input are apart long before.
const FIRST_DEPTH: u64 = 48;
/// A value still undecided on an interval this narrow (2⁻ⁿ) is tested for being exactly zero, once.
const ZERO_TEST_BITS: u64 = 160;

impl Polynomial {
    /// The distinct real roots in [0, 1] with their multiplicities, in no special order. None for a constant.
    pub fn roots(&self) -> Vec<Root> {
        if self.degree() == 0 {
            return Vec::new();
        }
        if let Some(roots) = isolate(&Rc::new(self.clone()), None) {
            return roots;
        }
        let mut roots = Vec::new();
        for (factor, multiplicity) in self.square_free() {
            roots.extend(isolate(&Rc::new(factor), Some(multiplicity)).unwrap_or_default());
        }
        roots
    }
}

/// Number of sign changes of a sequence, zeros left out.
fn variations(coefficients: &[BigInt]) -> usize {
    let signs = coefficients.iter().map(sign).filter(|&s| s != 0);
    signs
        .fold((0, 0), |(last, count), s| {
            (s, count + usize::from(last * s < 0))
        })
        .1
}

/// Bernstein coefficients of both halves, times 2ⁿ.
fn halves(mut row: Vec<BigInt>) -> (Vec<BigInt>, Vec<BigInt>) {
    let n = row.len() - 1;
    let (mut left, mut right) = (vec![&row[0] << n], vec![&row[n] << n]);
    for step in 1..=n {
        for i in 0..=n - step {
            row[i] = &row[i] + &row[i + 1];
        }
        left.push(&row[0] << (n - step));
        right.push(&row[n - step] << (n - step));
    }
    right.reverse();
    (left, right)
}

fn leading_zeros<'a>(coefficients: impl Iterator<Item = &'a BigInt>) -> u32 {
    coefficients.take_while(|c| c.is_zero()).count() as u32
}

/// Isolates the roots. With a `multiplicity` the factor is square-free and bisection goes as deep as it must;
/// without, `None` is returned where roots are multiple or too close to tell soon.
fn isolate(factor: &Rc<Polynomial>, multiplicity: Option<u32>) -> Option<Vec<Root>> {
    let whole = factor.bernstein();
    let mut roots = Vec::new();
    let mut add = |numerator: BigInt, bits, exact, left, zeros| {
        roots.push(Root {
            factor: Rc::clone(factor),
            numerator,
            bits,
            exact,
            left,
            multiplicity: multiplicity.unwrap_or(zeros),
            stride: 1,
        });
    };
    for (numerator, zeros) in [
        (BigInt::zero(), leading_zeros(whole.iter())),
        (BigInt::one(), leading_zeros(whole.iter().rev())),
    ] {
        if zeros > 0 {
            add(numerator, 0, true, 0, zeros);
        }
    }
    let mut stack = vec![(whole, BigInt::zero(), 0)];
    while let Some((coefficients, numerator, bits)) = stack.pop() {
        match variations(&coefficients) {
            0 => {}
            1 => {
                let left = coefficients.iter().map(sign).find(|&s| s != 0);
                add(numerator, bits, false, left.unwrap_or(0), 1);
            }
            _ if multiplicity.is_none() && bits >= FIRST_DEPTH => return None,
            _ => {
                let (left, right) = halves(coefficients);
                let start: BigInt = numerator << 1;
                let middle = &start + 1_u32;
                let zeros = leading_zeros(right.iter());
                if zeros > 0 {
                    add(middle.clone(), bits + 1, true, 0, zeros);
                }
                stack.push((right, middle, bits + 1));
                stack.push((left, start, bits + 1));
            }
        }
    }
    Some(roots)
}

/// A real root in [0, 1] of a polynomial: a dyadic number, or the only root inside an open interval.
#[derive(Clone, Debug)]
pub struct Root {
    factor: Rc<Polynomial>,
    numerator: BigInt,
    bits: u64,
    exact: bool,
    left: i32,
    multiplicity: u32,
    stride: u64,
}

impl Root {
    /// How many roots coincide here.
    pub fn multiplicity(&self) -> u32 {
        self.multiplicity
    }

    /// Whether the root is exactly this whole number.
    pub fn is(&self, value: u32) -> bool {
        self.exact && self.numerator == BigInt::from(value) << self.bits
    }

    /// The ends of the interval that holds the root; equal where the root is known exactly.
    pub fn interval(&self) -> [Dyadic; 2] {
        let exponent = -(self.bits as i64);
        let end = &self.numerator + u32::from(!self.exact);
        [
            Dyadic::new(self.numerator.clone(), exponent),
            Dyadic::new(end, exponent),
        ]
    }

    /// The root, within 2⁻⁶⁴.
    pub fn to_f64(&mut self) -> f64 {
        while !self.exact && self.bits < VALUE_BITS {
            self.refine();
        }
        Dyadic::new(self.numerator.clone(), -(self.bits as i64)).to_f64()
    }

    /// The sign of `polynomial` at the root, exactly.
    pub fn sign_of(&mut self, polynomial: &Polynomial) -> i32 {
        self.value_to(polynomial, 0)
            .map_or(0, |value| sign(&value.mantissa))
    }

    /// The value of `polynomial` at the root: zero exactly where it is zero, else within a factor 1 ± 2⁻⁶⁴.
    pub fn value_of(&mut self, polynomial: &Polynomial) -> Dyadic {
        self.value_to(polynomial, VALUE_BITS)
            .unwrap_or_else(|| Dyadic::new(BigInt::zero(), 0))
    }

    /// The value within a factor 1 ± 2^−`accuracy`, or `None` where it is zero.
    fn value_to(&mut self, polynomial: &Polynomial, accuracy: u64) -> Option<Dyadic> {
        let degree = polynomial.degree() as u64;
        let slope = polynomial.slope();
        let mut tested = false;
        loop {
            let value = polynomial.scaled_value(&self.numerator, self.bits);
            let found = if self.exact || slope.is_zero() {
                !value.is_zero()
            } else {
                value.abs() > &slope << (self.bits * (degree - 1) + accuracy)
            };
            if found {
                return Some(Dyadic::new(value, -((self.bits * degree) as i64)));
            }
            if self.exact || slope.is_zero() {
                return None;
            }
            if !tested && self.bits >= ZERO_TEST_BITS {
                tested = true;
                if self.is_root_of(polynomial) {
                    return None;
                }
            }
            self.refine();
        }
    }

    /// Whether `polynomial` is exactly zero at the root: then, and only then, its common divisor with the factor changes sign.
    fn is_root_of(&mut self, polynomial: &Polynomial) -> bool {
        let common = self.factor.gcd(polynomial);
        if common.degree() == 0 {
            return false;
        }
        while !self.exact {
            let low = common.scaled_value(&self.numerator, self.bits);
            let high = common.scaled_value(&(&self.numerator + 1_u32), self.bits);
            if !low.is_zero() && !high.is_zero() {
                return sign(&low) != sign(&high);
            }
            self.refine();
        }
        let value = polynomial.scaled_value(&self.numerator, self.bits);
        value.is_zero()
    }

    /// Narrows the interval by 2^`stride` where a secant guesses the right part of it, and then squares the stride; halves it
    /// otherwise.
    fn refine(&mut self) {
        let bits = self.bits + self.stride;
        let start: BigInt = &self.numerator << self.stride;
        let guess = &start + self.secant();
        let side = self.side(&guess, bits);
        let next = if side > 0 {
            &guess + 1_u32
        } else {
            &guess - 1_u32
        };
        if self.exact {
            return;
        }
        let other = self.side(&next, bits);
        if self.exact {
            return;
        }
        if side != other {
            self.numerator = if side > 0 { guess } else { next };
            self.bits = bits;
            self.stride *= 2;
        } else {
            self.stride = 1.max(self.stride / 2);
            self.halve();
        }
    }

    fn halve(&mut self) {
        let start: BigInt = &self.numerator << 1;
        let middle = &start + 1_u32;
        let bits = self.bits + 1;
        let side = self.side(&middle, bits);
        if !self.exact {
            self.numerator = if side > 0 { middle } else { start };
            self.bits = bits;
        }
    }

    /// 1 where the root lies above the point, −1 where below; a point that is the root becomes the exact root.
    /// Points outside the interval or on its ends are told by their place, since the factor may vanish there too.
    fn side(&mut self, numerator: &BigInt, bits: u64) -> i32 {
        let shift = bits - self.bits;
        if numerator <= &(&self.numerator << shift) {
            return 1;
        }
        if numerator >= &((&self.numerator + 1_u32) << shift) {
            return -1;
        }
        match sign(&self.factor.scaled_value(numerator, bits)) {
            0 => {
                self.numerator = numerator.clone();
                self.bits = bits;
                self.exact = true;
                0
            }
            s => s * self.left,
        }
    }

    /// The secant's root in parts of 2^−`stride` of the interval.
    fn secant(&self) -> BigInt {
        let low = self.factor.scaled_value(&self.numerator, self.bits).abs();
        let next = &self.numerator + 1_u32;
        let high = self.factor.scaled_value(&next, self.bits).abs();
        let total = &low + high;
        if total.is_zero() {
            return BigInt::one();
        }
        (low << self.stride) / total
    }
}
