//! Isolation of the real roots in [0, 1] by Descartes' rule in Bernstein form.

use super::modular::certainly_square_free;
use super::polynomial::Polynomial;
use super::root::{Equation, Root};
use super::sign;
use num_bigint::BigInt;
use num_traits::{One, Zero};
use std::rc::Rc;

/// Bisection gives up at this depth and asks whether roots are multiple: simple roots of ordinary input are apart long before.
const FIRST_DEPTH: u64 = 48;

impl Polynomial {
    /// The distinct real roots in [0, 1] with their multiplicities, in no special order. None for a constant.
    pub fn roots(&self) -> Vec<Root> {
        if self.degree() == 0 {
            return Vec::new();
        }
        let whole = Rc::new(self.clone());
        if let Some(roots) = isolate(&whole, None) {
            return roots;
        }
        if certainly_square_free(self) {
            return isolate(&whole, Some(1)).unwrap_or_default();
        }
        let mut roots = Vec::new();
        for (factor, multiplicity) in self.square_free() {
            roots.extend(isolate(&Rc::new(factor), Some(multiplicity)).unwrap_or_default());
        }
        roots
    }
}

/// Number of sign changes of a sequence, zeros left out.
pub(super) fn variations(coefficients: &[BigInt]) -> usize {
    let signs = coefficients.iter().map(sign).filter(|&s| s != 0);
    signs
        .fold((0, 0), |(last, count), s| {
            (s, count + usize::from(last * s < 0))
        })
        .1
}

/// Bernstein coefficients of both halves, times 2ⁿ.
pub(super) fn halves(mut row: Vec<BigInt>) -> (Vec<BigInt>, Vec<BigInt>) {
    let n = row.len() - 1;
    let (mut left, mut right) = (vec![&row[0] << n], vec![&row[n] << n]);
    for step in 1..=n {
        for i in 0..=n - step {
            let (low, high) = row.split_at_mut(i + 1);
            low[i] += &high[0];
        }
        left.push(&row[0] << (n - step));
        right.push(&row[n - step] << (n - step));
    }
    right.reverse();
    (left, right)
}

/// Multiplicity of the root at the end where the iteration starts.
pub(super) fn leading_zeros<'a>(coefficients: impl Iterator<Item = &'a BigInt>) -> u32 {
    coefficients.take_while(|c| c.is_zero()).count() as u32
}

/// Isolates the roots. With a `multiplicity` the factor is square-free and bisection goes as deep as it must;
/// without, `None` is returned where roots are multiple or too close to tell soon.
fn isolate(factor: &Rc<Polynomial>, multiplicity: Option<u32>) -> Option<Vec<Root>> {
    let whole = factor.bernstein();
    let mut roots = Vec::new();
    let mut add = |numerator: BigInt, bits, exact, left, zeros| {
        roots.push(Root {
            equation: Equation::Polynomial(Rc::clone(factor)),
            numerator,
            bits,
            exact,
            left,
            multiplicity: multiplicity.unwrap_or(zeros),
            stride: 0,
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
