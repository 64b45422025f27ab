//! Exact arithmetic: dyadic rationals, and the real roots in [0, 1] of polynomials with whole coefficients.
//!
//! Every finite f64 is a whole number times a power of two, so what is computed from f64 by +, − and × is exact here. Roots are
//! isolated by Descartes' rule in Bernstein form with bisection (Collins and Akritas 1976; Lane and Riesenfeld 1981), multiple
//! roots are split off by Yun's square-free decomposition (1976), and isolating intervals are narrowed by quadratic interval
//! refinement (Abbott 2006). All answers are certain; time grows with the exponent range of the input.

use num_bigint::{BigInt, Sign};
use num_traits::{One, Signed, Zero};
use std::rc::Rc;

/// Values taken at a root carry this many correct leading bits: eleven more than an f64 holds.
const VALUE_BITS: u64 = 64;
/// Bisection gives up at this depth and asks for the square-free factors: simple roots of ordinary input are apart long before.
const FIRST_DEPTH: u64 = 48;
/// A value still undecided on an interval this narrow (2⁻ⁿ) is tested for being exactly zero, once.
const ZERO_TEST_BITS: u64 = 160;

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

/// Sign of a whole number: −1, 0 or 1.
pub fn sign(value: &BigInt) -> i32 {
    match value.sign() {
        Sign::Minus => -1,
        Sign::NoSign => 0,
        Sign::Plus => 1,
    }
}

/// A polynomial with whole coefficients, lowest power first, without leading zeros: the zero polynomial has none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Polynomial {
    coefficients: Vec<BigInt>,
}

impl Polynomial {
    /// The polynomial with these coefficients, lowest power first.
    pub fn new(mut coefficients: Vec<BigInt>) -> Self {
        while coefficients.last().is_some_and(Zero::is_zero) {
            coefficients.pop();
        }
        Self { coefficients }
    }

    /// The cubic with these Bezier control values.
    pub fn cubic(p: &[BigInt; 4]) -> Self {
        Self::new(vec![
            p[0].clone(),
            (&p[1] - &p[0]) * 3,
            (&p[0] + &p[2] - &p[1] * 2) * 3,
            &p[3] - &p[0] + (&p[1] - &p[2]) * 3,
        ])
    }

    /// The coefficients, lowest power first.
    pub fn coefficients(&self) -> &[BigInt] {
        &self.coefficients
    }

    /// Whether this is the zero polynomial.
    pub fn is_zero(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// The degree; 0 for the zero polynomial.
    pub fn degree(&self) -> usize {
        self.coefficients.len().saturating_sub(1)
    }

    /// `scale` times this, plus `constant`.
    #[must_use]
    pub fn affine(&self, scale: &BigInt, constant: &BigInt) -> Self {
        let mut result: Vec<BigInt> = self.coefficients.iter().map(|c| c * scale).collect();
        if result.is_empty() {
            result.push(BigInt::zero());
        }
        result[0] += constant;
        Self::new(result)
    }

    /// Sum.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let (long, short) = if self.coefficients.len() >= other.coefficients.len() {
            (self, other)
        } else {
            (other, self)
        };
        let mut result = long.coefficients.clone();
        for (a, b) in result.iter_mut().zip(&short.coefficients) {
            *a += b;
        }
        Self::new(result)
    }

    /// The square.
    #[must_use]
    pub fn squared(&self) -> Self {
        let c = &self.coefficients;
        let mut result = vec![BigInt::zero(); (2 * c.len()).saturating_sub(1)];
        for i in 0..c.len() {
            result[2 * i] += &c[i] * &c[i];
            for j in 0..i {
                result[i + j] += (&c[i] * &c[j]) << 1;
            }
        }
        Self::new(result)
    }

    /// The derivative.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let terms = self.coefficients.iter().enumerate().skip(1);
        Self::new(terms.map(|(i, c)| c * i).collect())
    }

    /// The value at `numerator` / 2^`bits`, times 2^(`bits` · degree).
    pub fn scaled_value(&self, numerator: &BigInt, bits: u64) -> BigInt {
        let mut value = BigInt::zero();
        for (i, c) in self.coefficients.iter().rev().enumerate() {
            value = value * numerator + (c << (bits * i as u64));
        }
        value
    }

    /// A bound of |derivative| on [0, 1].
    fn slope(&self) -> BigInt {
        let terms = self.coefficients.iter().enumerate();
        terms.map(|(i, c)| c.abs() * i).sum()
    }

    /// The polynomial divided by the common divisor of its coefficients.
    fn primitive(self) -> Self {
        let mut content = BigInt::zero();
        for c in &self.coefficients {
            content = common_divisor(content, c.abs());
            if content.is_one() {
                return self;
            }
        }
        let parts = self.coefficients.iter().map(|c| c / &content);
        Self::new(parts.collect())
    }

    /// A multiple, by a whole constant, of the remainder of division by `divisor`.
    fn pseudo_remainder(&self, divisor: &Self) -> Self {
        let mut rest = self.coefficients.clone();
        let Some(lead) = divisor.coefficients.last() else {
            return self.clone();
        };
        while rest.len() >= divisor.coefficients.len() {
            let Some(top) = rest.pop() else { break };
            rest.iter_mut().for_each(|c| *c *= lead);
            let offset = rest.len() + 1 - divisor.coefficients.len();
            for (i, d) in divisor.coefficients[..divisor.degree()].iter().enumerate() {
                rest[offset + i] -= d * &top;
            }
        }
        Self::new(rest)
    }

    /// The greatest common divisor, with coefficients that have no common divisor.
    #[must_use]
    pub fn gcd(&self, other: &Self) -> Self {
        let (mut a, mut b) = (self.clone().primitive(), other.clone().primitive());
        while !b.is_zero() {
            let rest = a.pseudo_remainder(&b).primitive();
            a = b;
            b = rest;
        }
        a.primitive()
    }

    /// The quotient by a primitive `divisor` that divides this exactly.
    fn divided_by(&self, divisor: &Self) -> Self {
        let mut rest = self.coefficients.clone();
        let steps = (rest.len() + 1).saturating_sub(divisor.coefficients.len());
        let mut quotient = vec![BigInt::zero(); steps];
        for k in (0..steps).rev() {
            quotient[k] = &rest[k + divisor.degree()] / &divisor.coefficients[divisor.degree()];
            for (i, d) in divisor.coefficients.iter().enumerate() {
                rest[k + i] -= d * &quotient[k];
            }
        }
        Self::new(quotient)
    }

    /// The square-free factors of degree ≥ 1 with their multiplicities (Yun's algorithm).
    pub fn square_free(&self) -> Vec<(Self, u32)> {
        let mut factors = Vec::new();
        let whole = self.clone().primitive();
        let slope = whole.derivative();
        let common = whole.gcd(&slope);
        let mut rest = whole.divided_by(&common);
        let mut other = slope.divided_by(&common);
        for multiplicity in 1.. {
            if rest.degree() == 0 {
                break;
            }
            let difference =
                other.plus(&rest.derivative().affine(&-BigInt::one(), &BigInt::zero()));
            let factor = rest.gcd(&difference);
            rest = rest.divided_by(&factor);
            other = difference.divided_by(&factor);
            if factor.degree() > 0 {
                factors.push((factor, multiplicity));
            }
        }
        factors
    }

    /// Bernstein coefficients on [0, 1], times a positive whole number.
    pub fn bernstein(&self) -> Vec<BigInt> {
        let n = self.degree();
        let row = |n: usize| {
            (1..=n).fold(vec![BigInt::one()], |mut row, k| {
                let next = &row[k - 1] * (n + 1 - k) / k;
                row.push(next);
                row
            })
        };
        let binomials = row(n);
        let multiple = binomials.iter().fold(BigInt::one(), |m, b| {
            &m * b / common_divisor(m.clone(), b.clone())
        });
        let weighted: Vec<BigInt> = (self.coefficients.iter().zip(&binomials))
            .map(|(c, b)| c * (&multiple / b))
            .collect();
        let column = |j: usize| row(j).iter().zip(&weighted).map(|(b, w)| b * w).sum();
        (0..=n).map(column).collect()
    }

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

fn common_divisor(mut a: BigInt, mut b: BigInt) -> BigInt {
    while !b.is_zero() {
        let rest = &a % &b;
        a = b;
        b = rest;
    }
    a
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
