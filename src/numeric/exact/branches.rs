//! Roots of w² = a s by the sign of w.
//!
//! Where a is small the roots come in pairs √a apart, and bisection must go as deep as that to part them. Each pair is a root of
//! e₊ = w − √(a s) and one of e₋ = w + √(a s). On an interval where s > 0 and 4 s w′² > a s′² both are strictly monotone, so the
//! signs at its ends tell whether each has its one root there, and every sign of e± is decided by the signs of w and of w² − a s.

mod quick;

use super::fixed::{FLOAT_ERROR, Fixed, Step, VALUE_ERROR, slope, to_f64};
use super::isolate::{halves, leading_zeros, variations};
use super::polynomial::Polynomial;
use super::root::{Equation, Factor, Root};
use super::sign;
use num_bigint::BigInt;
use num_traits::{One, Signed, ToPrimitive, Zero};
use std::rc::Rc;

/// Bisection gives up at this depth: only roots within 2⁻⁹⁶ of a root of s, or of w′, are not parted by then.
const DEPTH: u64 = 96;

/// Above this depth parts are told apart by simpler tests than the coefficients of a s − w².
const VARIATIONS_FROM: u64 = 6;

/// More than what products of three rounded f64 are off by.
const ABOVE: f64 = 1.0 + 1e-12;

/// The cubic w, the s of degree 6 and the whole number a > 0 of w² = a s.
#[derive(Debug)]
pub struct Branches {
    middle: Factor,
    square: Factor,
    factor: BigInt,
    difference: Rc<Factor>,
}

/// w and s in Bernstein form on an interval, on common scale.
struct Part {
    middle: Vec<BigInt>,
    square: Vec<BigInt>,
    numerator: BigInt,
    bits: u64,
}

impl Branches {
    /// The equation w² = a s, for w of degree ≤ 3, s of degree ≤ 6 and a > 0.
    pub fn new(middle: Polynomial, square: Polynomial, factor: BigInt) -> Self {
        let minus_one = -BigInt::one();
        let zero = BigInt::zero();
        let difference =
            (square.affine(&factor, &zero)).plus(&middle.squared().affine(&minus_one, &zero));
        Self {
            middle: Factor::new(middle),
            square: Factor::new(square),
            factor,
            difference: Rc::new(Factor::new(difference)),
        }
    }

    /// w.
    pub fn middle(&self) -> &Polynomial {
        &self.middle.whole
    }

    /// a s − w².
    pub fn polynomial(&self) -> &Polynomial {
        &self.difference.whole
    }

    /// a within some roundings, if w and s are told in units; far below 1 more than that.
    fn scale(&self, middle: &Fixed, square: &Fixed) -> f64 {
        let shift = self.factor.bits().saturating_sub(64);
        let factor = (&self.factor >> shift).to_f64().unwrap_or(f64::INFINITY);
        let exponent = shift as i64 + square.exponent() - 2 * middle.exponent();
        libm::ldexp(factor, exponent.clamp(-900, 1100) as i32)
    }

    /// w − σ √(a s) in units of w at a place, about; and √(a s) and its derivative.
    fn excess(&self, branch: i32, place: u128) -> Option<[f64; 3]> {
        let (middle, square) = (self.middle.fixed.as_ref()?, self.square.fixed.as_ref()?);
        let scale = self.scale(middle, square);
        let root = (scale * square.value(place) as f64).max(0.0).sqrt();
        let climb = 0.5 * scale * slope(&square.to_floats(), to_f64(place)) / root;
        let excess = middle.value(place) - (f64::from(branch) * root) as i128;
        Some([excess as f64, root, climb])
    }

    /// w − σ √(a s) at a place, about and up to scale.
    pub(super) fn value(&self, branch: i32, place: u128) -> Option<f64> {
        Some(self.excess(branch, place)?[0])
    }

    /// The step of Newton's method from a place near a root of w = σ √(a s): by this, or by a s = w², whichever ends nearer.
    pub(super) fn newton(&self, branch: i32, place: u128) -> Option<Step> {
        let middle = self.middle.fixed.as_ref()?;
        let by_square = self.difference.fixed.as_ref()?.newton(place);
        let [excess, root, climb] = self.excess(branch, place)?;
        let slope = slope(&middle.to_floats(), to_f64(place)) - f64::from(branch) * climb;
        let change = -excess / slope;
        let error = VALUE_ERROR as f64 + FLOAT_ERROR * root + middle.after(change);
        let error = error / slope.abs();
        let by_root = Step { change, error };
        let nearer = by_root.error < by_square.error;
        Some(if nearer { by_root } else { by_square })
    }

    /// The sign of w − σ √(a s) where s ≥ 0.
    pub(super) fn sign_at(&self, branch: i32, numerator: &BigInt, bits: u64) -> i32 {
        let middle = self.middle.sign_at(numerator, bits);
        let difference = self.difference.sign_at(numerator, bits);
        sign_of_branch(branch, middle, difference)
    }

    /// The roots in [0, 1] with their multiplicities, or `None` where some cannot be told apart by branches.
    pub fn roots(self: &Rc<Self>) -> Option<Vec<Root>> {
        self.quick_roots().or_else(|| self.slow_roots())
    }

    /// By whole numbers alone.
    fn slow_roots(self: &Rc<Self>) -> Option<Vec<Root>> {
        let whole = Part {
            middle: self.middle.whole.bernstein_of_degree(3),
            square: self.square.whole.bernstein_of_degree(6),
            numerator: BigInt::zero(),
            bits: 0,
        };
        let mut roots = Vec::new();
        if self.is_clear(&whole) {
            return Some(roots);
        }
        if [0, 1].iter().any(|&end| self.sign_at_end(&whole, end) == 0) {
            let ends = self.difference_of(&whole);
            let zeros = [leading_zeros(ends.iter()), leading_zeros(ends.iter().rev())];
            for (end, zeros) in (0_u32..).zip(zeros) {
                self.add_exact(&mut roots, BigInt::from(end), 0, zeros);
            }
        }
        let mut stack = vec![whole];
        while let Some(part) = stack.pop() {
            if self.is_clear(&part) {
                continue;
            }
            if self.is_monotone(&part) {
                self.add_branches(&mut roots, &part);
                continue;
            }
            if part.bits >= VARIATIONS_FROM && variations(&self.difference_of(&part)) == 0 {
                continue;
            }
            if part.bits >= DEPTH {
                return None;
            }
            let start: BigInt = part.numerator << 1;
            let middle = &start + 1_u32;
            let bits = part.bits + 1;
            let (w_left, w_right) = halves(part.middle);
            let (s_left, s_right) = halves(part.square);
            let right = Part {
                middle: w_right,
                square: s_right,
                numerator: middle.clone(),
                bits,
            };
            if self.sign_at_end(&right, 0) == 0 {
                let zeros = leading_zeros(self.difference_of(&right).iter());
                self.add_exact(&mut roots, middle, bits, zeros);
            }
            stack.push(right);
            stack.push(Part {
                middle: w_left,
                square: s_left,
                numerator: start,
                bits,
            });
        }
        Some(roots)
    }

    /// Whether w² > a s on the whole part, by the least and greatest coefficients.
    fn is_clear(&self, part: &Part) -> bool {
        let Some(most) = part.square.iter().max() else {
            return false;
        };
        if most.is_negative() {
            return true;
        }
        let first = sign(&part.middle[0]);
        if first == 0 || part.middle.iter().any(|w| sign(w) != first) {
            return false;
        }
        let least = part
            .middle
            .iter()
            .map(|w| w.abs())
            .min()
            .unwrap_or_default();
        &least * &least * 20_u32 > most * &self.factor * 3_u32
    }

    /// The sign of a s − w² at an end, 0 or 1, of a part.
    fn sign_at_end(&self, part: &Part, end: usize) -> i32 {
        let w = &part.middle[3 * end];
        sign(&(&part.square[6 * end] * &self.factor * 3_u32 - w * w * 20_u32))
    }

    /// Bernstein coefficients of a s − w², times 540: w comes times 3 and s times 60.
    fn difference_of(&self, part: &Part) -> Vec<BigInt> {
        const CHOOSE: [u32; 4] = [1, 3, 3, 1];
        const SHARE: [u32; 7] = [60, 10, 4, 3, 4, 10, 60];
        let w = &part.middle;
        let coefficient = |k: usize| -> BigInt {
            let pairs = k.saturating_sub(3)..=k.min(3);
            let square: BigInt = pairs
                .map(|i| &w[i] * &w[k - i] * (CHOOSE[i] * CHOOSE[k - i]))
                .sum();
            &part.square[k] * &self.factor * 9_u32 - square * SHARE[k]
        };
        (0..7).map(coefficient).collect()
    }

    /// Whether s > 0 and both branches are strictly monotone, by the least and greatest coefficients:
    /// |w′| ≥ 3 min |Δw| and |s′| ≤ 6 max |Δs|.
    fn is_monotone(&self, part: &Part) -> bool {
        let Some(least) = part.square.iter().min().filter(|s| s.is_positive()) else {
            return false;
        };
        let steps = |c: &[BigInt]| -> Vec<BigInt> { c.windows(2).map(|p| &p[1] - &p[0]).collect() };
        let climbs = steps(&part.middle);
        let signs: Vec<i32> = climbs.iter().map(sign).collect();
        if signs[0] == 0 || signs.iter().any(|&s| s != signs[0]) {
            return false;
        }
        let slope = climbs.iter().map(|d| d.abs()).min().unwrap_or_default();
        let spread = steps(&part.square)
            .iter()
            .map(|d| d.abs())
            .max()
            .unwrap_or_default();
        least * &slope * &slope * 20_u32 > &spread * &spread * &self.factor * 3_u32
    }

    fn add_branches(self: &Rc<Self>, roots: &mut Vec<Root>, part: &Part) {
        let signs = [0, 1].map(|end| (sign(&part.middle[3 * end]), self.sign_at_end(part, end)));
        for branch in [-1, 1] {
            let [left, right] =
                signs.map(|(middle, difference)| sign_of_branch(branch, middle, difference));
            if left * right < 0 {
                roots.push(Root {
                    equation: Equation::Branch(Rc::clone(self), branch),
                    numerator: part.numerator.clone(),
                    bits: part.bits,
                    exact: false,
                    left,
                    multiplicity: 1,
                    stride: 0,
                });
            }
        }
    }

    fn add_exact(&self, roots: &mut Vec<Root>, numerator: BigInt, bits: u64, zeros: u32) {
        if zeros > 0 {
            let equation = Equation::Polynomial(Rc::clone(&self.difference));
            roots.push(Root::exact(equation, numerator, bits, zeros));
        }
    }
}

/// The sign of w − σ √(a s) from those of w and of a s − w².
fn sign_of_branch(branch: i32, middle: i32, difference: i32) -> i32 {
    match difference {
        0 if middle == branch => 0,
        1 => -branch,
        _ => middle,
    }
}
