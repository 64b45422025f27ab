//! Isolation of the real roots in [0, 1] by Descartes' rule in Bernstein form.

use super::fixed::Fixed;
use super::modular::certainly_square_free;
use super::polynomial::Polynomial;
use super::root::{Equation, Factor, Root};
use super::row::Row;
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
        let whole = Rc::new(Factor::new(self.clone()));
        if let Some(roots) = isolate_fixed(&whole).or_else(|| isolate(&whole, None)) {
            return roots;
        }
        if certainly_square_free(self) {
            return isolate(&whole, Some(1)).unwrap_or_default();
        }
        let mut roots = Vec::new();
        for (factor, multiplicity) in self.square_free() {
            let factor = Rc::new(Factor::new(factor));
            roots.extend(isolate(&factor, Some(multiplicity)).unwrap_or_default());
        }
        roots
    }

    /// How many of the first and of the last Bernstein coefficients are zero, if that is plain from these, rounded.
    fn zeros_at_ends(&self, rounded: &Row) -> Option<[usize; 2]> {
        let whole = self.coefficients();
        let first = whole.iter().take_while(|c| c.is_zero()).count();
        let n = rounded.degree();
        if rounded.sign(n).is_some() {
            return Some([first, 0]);
        }
        let value: BigInt = whole.iter().sum();
        (value.is_zero() && n > 0 && rounded.sign(n - 1).is_some()).then_some([first, 1])
    }

    /// Bernstein coefficients of degree `n` in 128 bits, if it is plain which of the ends are zero.
    pub(super) fn row(&self, fixed: &Fixed, n: usize) -> Option<Row> {
        let row = fixed.row(n);
        Some(row.with_zeros(self.zeros_at_ends(&row)?))
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

/// Isolates the roots in 128 bits, where these tell them.
fn isolate_fixed(factor: &Rc<Factor>) -> Option<Vec<Root>> {
    let whole = &factor.whole;
    let row = whole.row(factor.fixed.as_ref()?, whole.degree())?;
    let equation = || Equation::Polynomial(Rc::clone(factor));
    let ends = [BigInt::zero(), BigInt::one()].into_iter().zip(row.zeros());
    let ends = ends.filter(|&(_, zeros)| zeros > 0);
    let ends = ends.map(|(end, zeros)| Root::exact(equation(), end, 0, zeros as u32));
    let inside = row.isolate()?;
    let inside = inside.iter().map(|root| Root::isolated(equation(), root));
    Some(ends.chain(inside).collect())
}

/// Isolates the roots. With a `multiplicity` the factor is square-free and bisection goes as deep as it must;
/// without, `None` is returned where roots are multiple or too close to tell soon.
fn isolate(factor: &Rc<Factor>, multiplicity: Option<u32>) -> Option<Vec<Root>> {
    let whole = factor.whole.bernstein();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    /// Products of lines, with pairs of roots down to 2⁻⁵⁰ apart and roots at the ends.
    #[test]
    fn roots_isolated_in_128_bits_are_those_of_the_whole_numbers() {
        let count = 1000;
        let mut told = 0;
        for index in 0..count {
            let mut stream = Stream::new(83, Purpose::Test, index);
            let line = |numerator: u64| {
                let root = BigInt::from(numerator);
                Polynomial::new(vec![-root, BigInt::from(1_u64 << 60)])
            };
            let (end, first) = (index % 7, stream.next_u64() >> 4);
            let second = first ^ (stream.next_u64() >> (4 + index % 50));
            let mut whole = line(first).times(&line(second));
            whole = whole.times(&line(stream.next_u64() >> 3));
            for (at, root) in [(0, 0), (1, 1 << 60)] {
                if end == at {
                    whole = whole.times(&line(root));
                }
            }
            let factor = Rc::new(Factor::new(whole));
            let exact = isolate(&factor, Some(1)).expect("square-free");
            let Some(quick) = isolate_fixed(&factor) else {
                continue;
            };
            told += 1;
            let list = |roots: Vec<Root>| {
                let mut list: Vec<f64> = roots.into_iter().map(|mut root| root.to_f64()).collect();
                list.sort_by(f64::total_cmp);
                list
            };
            let (quick, exact) = (list(quick), list(exact));
            assert_eq!(quick.len(), exact.len(), "{index}");
            for (a, b) in quick.iter().zip(&exact) {
                assert!((a - b).abs() < 1e-15, "{index}");
            }
        }
        assert!(told > count * 3 / 4, "{told}");
    }
}
