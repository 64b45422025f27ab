//! Polynomials with whole coefficients: arithmetic, common divisors, square-free factors, Bernstein form.

use num_bigint::BigInt;
use num_traits::{One, Signed, Zero};

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

    /// Product.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        let mut result = vec![BigInt::zero(); self.coefficients.len() + other.coefficients.len()];
        for (i, a) in self.coefficients.iter().enumerate() {
            for (j, b) in other.coefficients.iter().enumerate() {
                result[i + j] += a * b;
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
    pub(super) fn slope(&self) -> BigInt {
        let terms = self.coefficients.iter().enumerate();
        terms.map(|(i, c)| c.abs() * i).sum()
    }

    /// The polynomial divided by the common divisor of its coefficients.
    #[must_use]
    pub fn primitive(self) -> Self {
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

    /// A multiple, by a positive whole constant, of the remainder of division by `divisor`.
    #[must_use]
    pub fn pseudo_remainder(&self, divisor: &Self) -> Self {
        let mut rest = self.coefficients.clone();
        let Some(lead) = divisor.coefficients.last() else {
            return self.clone();
        };
        while rest.len() >= divisor.coefficients.len() {
            let Some(top) = rest.pop() else { break };
            let size = lead.abs();
            rest.iter_mut().for_each(|c| *c *= &size);
            let top = top * lead.signum();
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
        let (long, short) = if self.degree() >= other.degree() {
            (self, other)
        } else {
            (other, self)
        };
        let mut chain = long.remainders(short, 1);
        chain
            .pop()
            .unwrap_or_else(|| Self::new(Vec::new()))
            .primitive()
    }

    /// This, `next` (of no greater degree) and the remainders that follow, each times `sign` and a positive constant, up to the last
    /// one that is not zero. Divided as subresultants (Brown and Traub 1971), so that coefficients grow only linearly.
    pub(super) fn remainders(&self, next: &Self, sign: i32) -> Vec<Self> {
        let mut chain = vec![self.clone()];
        let (mut a, mut b) = (self.clone(), next.clone());
        let (mut size, mut psi) = (BigInt::one(), BigInt::one());
        while !b.is_zero() {
            let gap = (a.degree() - b.degree()) as u32;
            let rest = a.pseudo_remainder(&b);
            let divisor = &size * psi.pow(gap);
            let parts = rest.coefficients.iter().map(|c| c / &divisor * sign);
            let rest = Self::new(parts.collect());
            size = b.coefficients[b.degree()].abs();
            if gap > 0 {
                psi = size.pow(gap) / psi.pow(gap - 1);
            }
            chain.push(b.clone());
            a = b;
            b = rest;
        }
        chain
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
        self.bernstein_of_degree(self.degree())
    }

    /// Bernstein coefficients of degree `n`, not below this one's, times the least common multiple of the binomials C(n, k).
    pub(super) fn bernstein_of_degree(&self, n: usize) -> Vec<BigInt> {
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
}

fn common_divisor(mut a: BigInt, mut b: BigInt) -> BigInt {
    while !b.is_zero() {
        let rest = &a % &b;
        a = b;
        b = rest;
    }
    a
}
