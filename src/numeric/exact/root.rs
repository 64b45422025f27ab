//! A real root in [0, 1], known by an interval that can be narrowed for ever.

use super::branches::Branches;
use super::dyadic::Dyadic;
use super::modular::certainly_coprime;
use super::polynomial::Polynomial;
use super::sign;
use num_bigint::BigInt;
use num_traits::{One, Signed, Zero};
use std::rc::Rc;

/// Values taken at a root carry this many correct leading bits: eleven more than an f64 holds.
const VALUE_BITS: u64 = 64;
/// A value still undecided on an interval this narrow (2⁻ⁿ) is tested for being exactly zero, once.
const ZERO_TEST_BITS: u64 = 160;

/// What is zero at a root.
#[derive(Clone, Debug)]
pub(super) enum Equation {
    /// A polynomial with one simple root in the interval.
    Polynomial(Rc<Polynomial>),
    /// The branch w = σ √(a s), σ = ±1, strictly monotone in the interval.
    Branch(Rc<Branches>, i32),
}

impl Equation {
    /// The sign at `numerator` / 2^`bits`.
    pub(super) fn sign_at(&self, numerator: &BigInt, bits: u64) -> i32 {
        match self {
            Self::Polynomial(factor) => sign(&factor.scaled_value(numerator, bits)),
            Self::Branch(pair, branch) => pair.sign_at(*branch, numerator, bits),
        }
    }

    /// The polynomial that is zero at the root.
    fn polynomial(&self) -> &Polynomial {
        match self {
            Self::Polynomial(factor) => factor,
            Self::Branch(pair, _) => pair.polynomial(),
        }
    }

    /// Sizes of the two end values of [n, n + 1]/2^`bits`, for a guess of where between them the root lies.
    fn end_sizes(&self, n: &BigInt, bits: u64) -> [BigInt; 2] {
        let at = |p: &Polynomial| [n, &(n + 1_u32)].map(|n| p.scaled_value(n, bits));
        let [low, high] = at(self.polynomial());
        let ends = match self {
            // Both branches between the ends: the mean of both, w, is the better guide.
            Self::Branch(pair, _) if sign(&low) * sign(&high) >= 0 => at(pair.middle()),
            _ => [low, high],
        };
        ends.map(|x| x.abs())
    }
}

/// A real root in [0, 1]: a dyadic number, or the only root of its equation inside an open interval.
#[derive(Clone, Debug)]
pub struct Root {
    pub(super) equation: Equation,
    pub(super) numerator: BigInt,
    pub(super) bits: u64,
    pub(super) exact: bool,
    /// Sign of the equation at the lower end.
    pub(super) left: i32,
    pub(super) multiplicity: u32,
    pub(super) stride: u64,
}

impl Root {
    /// How many roots coincide here.
    pub fn multiplicity(&self) -> u32 {
        self.multiplicity
    }

    /// The sign of w at a root of w = ±√(a s) that was isolated as the root of one branch.
    pub fn branch(&self) -> Option<i32> {
        match self.equation {
            Equation::Branch(_, branch) => Some(branch),
            Equation::Polynomial(_) => None,
        }
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

    /// Whether `polynomial` is exactly zero at the root: then, and only then, its common divisor with the equation is.
    fn is_root_of(&mut self, polynomial: &Polynomial) -> bool {
        if certainly_coprime(self.equation.polynomial(), polynomial) {
            return false;
        }
        let common = self.equation.polynomial().gcd(polynomial);
        if common.degree() == 0 {
            return false;
        }
        match self.equation.clone() {
            Equation::Polynomial(_) => self.changes_sign(&common, polynomial),
            Equation::Branch(pair, branch) => {
                let [low, high] = [0_u32, 1].map(|step| {
                    let end = &self.numerator + step;
                    Polynomial::new(vec![-end, BigInt::one() << self.bits])
                });
                let mut roots = common.roots().into_iter();
                // The two roots of the pair in the interval differ by the sign of w.
                roots.any(|mut root| {
                    root.sign_of(&low) > 0
                        && root.sign_of(&high) < 0
                        && root.sign_of(pair.middle()) == branch
                })
            }
        }
    }

    /// Whether a divisor of the equation changes sign in the interval, or `polynomial` is zero at the root now known exactly.
    fn changes_sign(&mut self, common: &Polynomial, polynomial: &Polynomial) -> bool {
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
    /// Points outside the interval or on its ends are told by their place, since the equation may be zero there too.
    fn side(&mut self, numerator: &BigInt, bits: u64) -> i32 {
        let shift = bits - self.bits;
        if numerator <= &(&self.numerator << shift) {
            return 1;
        }
        if numerator >= &((&self.numerator + 1_u32) << shift) {
            return -1;
        }
        match self.equation.sign_at(numerator, bits) {
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
        let [low, high] = self.equation.end_sizes(&self.numerator, self.bits);
        let total = &low + high;
        if total.is_zero() {
            return BigInt::one();
        }
        (low << self.stride) / total
    }
}
