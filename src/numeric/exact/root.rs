//! A real root in [0, 1], known by an interval that can be narrowed for ever.

use super::branches::Branches;
use super::dyadic::Dyadic;
use super::fixed::{Fixed, PLACE_BITS, Step};
use super::modular::certainly_coprime;
use super::polynomial::Polynomial;
use super::row::Isolated;
use super::sign;
use num_bigint::BigInt;
use num_traits::{One, Signed, Zero};
use std::rc::Rc;

/// Values taken at a root carry this many correct leading bits: nineteen more than an f64 holds.
const VALUE_BITS: u64 = 72;
/// A value still undecided on an interval this narrow (2⁻ⁿ) is tested for being exactly zero, once.
const ZERO_TEST_BITS: u64 = 128;

/// Bits that a guess in 128 bits is told to less than it seems to be right to, so that it mostly is.
const SPARE_BITS: i32 = 2;
/// A guess of fewer bits is none.
const LEAST_STRIDE: i32 = 8;
/// Steps towards such a guess; a few suffice but where the equation is very crooked.
const FLOAT_STEPS: u32 = 40;

/// A polynomial, and the same in 128 bits.
#[derive(Debug)]
pub(super) struct Factor {
    pub(super) whole: Polynomial,
    pub(super) fixed: Option<Fixed>,
}

impl Factor {
    pub(super) fn new(whole: Polynomial) -> Self {
        let fixed = Fixed::new(&whole);
        Self { whole, fixed }
    }

    /// The sign at `numerator` / 2^`bits`.
    pub(super) fn sign_at(&self, numerator: &BigInt, bits: u64) -> i32 {
        let quick = || (self.fixed.as_ref()?).sign_at(Fixed::place(numerator, bits)?);
        quick().unwrap_or_else(|| sign(&self.whole.scaled_value(numerator, bits)))
    }
}

/// What is zero at a root.
#[derive(Clone, Debug)]
pub(super) enum Equation {
    /// A polynomial with one simple root in the interval.
    Polynomial(Rc<Factor>),
    /// The branch w = σ √(a s), σ = ±1, strictly monotone in the interval.
    Branch(Rc<Branches>, i32),
}

impl Equation {
    /// The sign at `numerator` / 2^`bits`.
    pub(super) fn sign_at(&self, numerator: &BigInt, bits: u64) -> i32 {
        match self {
            Self::Polynomial(factor) => factor.sign_at(numerator, bits),
            Self::Branch(pair, branch) => pair.sign_at(*branch, numerator, bits),
        }
    }

    /// The polynomial that is zero at the root.
    fn polynomial(&self) -> &Polynomial {
        match self {
            Self::Polynomial(factor) => &factor.whole,
            Self::Branch(pair, _) => pair.polynomial(),
        }
    }

    /// The value at a place, about and up to scale.
    fn value(&self, place: u128) -> Option<f64> {
        match self {
            Self::Polynomial(factor) => Some(factor.fixed.as_ref()?.value(place) as f64),
            Self::Branch(pair, branch) => pair.value(*branch, place),
        }
    }

    /// The step of Newton's method from a place near the root.
    fn newton(&self, place: u128) -> Option<Step> {
        match self {
            Self::Polynomial(factor) => Some(factor.fixed.as_ref()?.newton(place)),
            Self::Branch(pair, branch) => pair.newton(*branch, place),
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
    /// Bits by which the next guess is to narrow the interval; 0 before the first.
    pub(super) stride: u64,
}

impl Root {
    /// The root `numerator` / 2^`bits`.
    pub(super) fn exact(equation: Equation, numerator: BigInt, bits: u64, zeros: u32) -> Self {
        Self {
            equation,
            numerator,
            bits,
            exact: true,
            left: 0,
            multiplicity: zeros,
            stride: 0,
        }
    }

    /// A simple root.
    pub(super) fn isolated(equation: Equation, root: &Isolated) -> Self {
        Self {
            equation,
            numerator: root.numerator.into(),
            bits: root.bits.into(),
            exact: false,
            left: root.left,
            multiplicity: 1,
            stride: 0,
        }
    }

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

    /// The root, within 2⁻⁷².
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

    /// The value of `polynomial` at the root: zero exactly where it is zero, else within a factor 1 ± 2⁻⁷².
    pub fn value_of(&mut self, polynomial: &Polynomial) -> Dyadic {
        self.value_to(polynomial, VALUE_BITS)
            .unwrap_or_else(|| Dyadic::new(BigInt::zero(), 0))
    }

    /// The value within a factor 1 ± 2^−`accuracy`, or `None` where it is zero.
    fn value_to(&mut self, polynomial: &Polynomial, accuracy: u64) -> Option<Dyadic> {
        let fixed = Fixed::new(polynomial);
        let degree = polynomial.degree() as u64;
        let slope = polynomial.slope();
        let mut tested = false;
        loop {
            if !self.exact && self.bits < VALUE_BITS {
                self.refine();
                continue;
            }
            let quick = |fixed: &Fixed| {
                let place = Fixed::place(&self.numerator, self.bits)?;
                fixed.value_near(place, self.bits, accuracy)
            };
            if let Some((value, exponent)) = fixed.as_ref().filter(|_| !self.exact).and_then(quick)
            {
                return Some(Dyadic::new(value.into(), exponent));
            }
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

    /// Narrows the interval by 2^`stride` where a guess names the right part of it, and then doubles the stride; halves it
    /// otherwise. The first guess is made in 128 bits, the others by secants.
    fn refine(&mut self) {
        let first = (self.stride == 0).then(|| self.guess()).flatten();
        let (stride, place) = match first {
            Some(guess) => guess,
            None => {
                self.stride = self.stride.max(1);
                (self.stride, self.secant())
            }
        };
        let bits = self.bits + stride;
        let start: BigInt = &self.numerator << stride;
        let guess = &start + place;
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
            self.stride = 2 * stride;
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

    /// How many bits more of the root can be guessed at once, and in parts of 2^−(so many) of the interval where it lies.
    fn guess(&self) -> Option<(u64, BigInt)> {
        let bits = i32::try_from(self.bits).ok()?;
        let low = Fixed::place(&self.numerator, self.bits)?;
        let near = low + self.share(low)?;
        let step = self.equation.newton(near)?;
        let known = -libm::log2(step.error).ceil() as i32 - SPARE_BITS;
        let stride = known.min(PLACE_BITS as i32) - bits;
        if !(step.error > 0.0 && stride >= LEAST_STRIDE) {
            return None;
        }
        let change = libm::ldexp(step.change, PLACE_BITS as i32);
        let above = (near - low).checked_add_signed(change as i128)?;
        let unit = PLACE_BITS as i32 - bits - stride;
        Some((stride as u64, BigInt::from(above >> unit)))
    }

    /// How far up from the lower end the root lies, about.
    fn share(&self, low: u128) -> Option<u128> {
        let width = libm::ldexp(1.0, (PLACE_BITS - self.bits) as i32);
        let above = |share: f64| (share * width) as u128;
        let side = f64::from(self.left);
        let value = |share| Some(side * self.equation.value(low + above(share))?);
        between(|share| value(share).unwrap_or(f64::NAN)).map(above)
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

/// The zero in (0, 1) of a function that falls from positive to negative, by the Illinois method (Dowell and Jarratt 1971); `None`
/// where it does not.
fn between(f: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut low, mut high) = ((0.0, f(0.0)), (1.0, f(1.0)));
    if !(low.1 > 0.0 && high.1 < 0.0) {
        return None;
    }
    let mut last_side = 0;
    for _ in 0..FLOAT_STEPS {
        let middle = low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1));
        let (value, width) = (f(middle), high.0 - low.0);
        if value == 0.0 || width < f64::EPSILON {
            return Some(middle);
        }
        let side = if value > 0.0 { 1 } else { -1 };
        // An end that stays twice pulls less.
        if side > 0 {
            low = (middle, value);
            high.1 *= if side == last_side { 0.5 } else { 1.0 };
        } else {
            high = (middle, value);
            low.1 *= if side == last_side { 0.5 } else { 1.0 };
        }
        last_side = side;
    }
    Some(0.5 * (low.0 + high.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 u³ + 3 u − 1 has the one root .1745…
    #[test]
    fn the_first_guess_narrows_a_root_by_ninety_bits() {
        let coefficients = [-1, 3, 0, 100].map(BigInt::from).to_vec();
        let polynomial = Polynomial::new(coefficients);
        let mut roots = polynomial.roots();
        assert_eq!(roots.len(), 1);
        let before = roots[0].bits;
        roots[0].refine();
        assert!(roots[0].bits >= before + 90, "{}", roots[0].bits);
        let [low, high] = roots[0].interval();
        let excess = |end: &Dyadic| polynomial.scaled_value(&end.mantissa, -end.exponent as u64);
        assert!(excess(&low).is_negative() && excess(&high).is_positive());
    }

    /// As the branches of (10 u − 3)² = 1: .2 and .4.
    #[test]
    fn the_first_guess_narrows_a_root_of_a_branch_as_much() {
        let whole = |coefficients: &[i32]| {
            Polynomial::new(coefficients.iter().copied().map(BigInt::from).collect())
        };
        let pair = Branches::new(whole(&[-3, 10]), whole(&[1]), BigInt::one());
        let mut roots = Rc::new(pair).roots().expect("two branches");
        assert_eq!(roots.len(), 2);
        for root in &mut roots {
            let (before, branch) = (root.bits, root.branch());
            root.refine();
            assert!(root.bits >= before + 90, "{branch:?} {}", root.bits);
            let expected = 0.3 + 0.1 * f64::from(branch.expect("a branch"));
            assert!((root.to_f64() - expected).abs() < 1e-15);
        }
    }

    /// 2²⁰⁰ (2 u − 1)³ − u is so flat that 128 bits see nothing but rounding near its root: bisection must do.
    #[test]
    fn a_root_that_128_bits_cannot_see_is_narrowed_all_the_same() {
        let one = BigInt::one() << 200;
        let [cube, square, line] = [8, -12, 6].map(|c| &one * c);
        let polynomial = Polynomial::new(vec![-&one, line - 1, square, cube]);
        let mut roots = polynomial.roots();
        assert_eq!(roots.len(), 1);
        let value = roots[0].to_f64();
        // (2 u − 1)³ = 2⁻²⁰⁰ u, with u = ½ up to 2⁻⁶⁷.
        let expected = 0.5 + 0.5 * libm::cbrt(0.5 * libm::exp2(-200.0));
        assert!((value - expected).abs() < 1e-15, "{value} {expected}");
    }

    #[test]
    fn a_zero_is_found_between_signs_and_nowhere_else() {
        let zero = between(|x| 0.3 - x * x * x).expect("a zero");
        assert!((zero - libm::cbrt(0.3)).abs() < 1e-12);
        assert!(between(|x| x - 0.3).is_none());
        assert!(between(|_| f64::NAN).is_none());
    }
}
