//! Branches isolated in 128 bits, where these tell them apart.

use super::{ABOVE, Branches, Root, sign_of_branch};
use crate::numeric::exact::root::Equation;
use crate::numeric::exact::row::{Isolated, Row};
use num_bigint::BigInt;
use num_traits::{One, Zero};
use std::rc::Rc;

/// Halvings until the whole numbers are asked.
const DEPTH: u32 = 60;
/// w, s and a s − w² in Bernstein form on an interval; w comes times 3 and s times 60.
struct Part {
    middle: Row,
    square: Row,
    difference: Row,
    numerator: u64,
    bits: u32,
}

impl Branches {
    /// As [`Branches::roots`]; `None` also where rounding hides something.
    pub(super) fn quick_roots(self: &Rc<Self>) -> Option<Vec<Root>> {
        let [middle, square, difference] =
            [&self.middle, &self.square, &self.difference].map(|f| f.fixed.as_ref());
        let (middle, square) = (middle?, square?);
        let scale = ABOVE * self.scale(middle, square);
        let whole = Part {
            middle: middle.row(3),
            square: square.row(6),
            difference: self.difference.whole.row(difference?, 6)?,
            numerator: 0,
            bits: 0,
        };
        let mut roots = Vec::new();
        if whole.is_clear(scale) {
            return Some(roots);
        }
        let ends = [BigInt::zero(), BigInt::one()];
        for (end, zeros) in ends.into_iter().zip(whole.difference.zeros()) {
            self.add_exact(&mut roots, end, 0, zeros as u32);
        }
        let mut stack = vec![whole];
        while let Some(part) = stack.pop() {
            if part.difference.variations() == Some(0) || part.is_clear(scale) {
                continue;
            }
            if part.is_monotone(scale) {
                self.add_parted(&mut roots, &part)?;
                continue;
            }
            if part.bits >= DEPTH {
                return None;
            }
            stack.extend(part.halves());
            // What is in doubt at the middle stays so in both halves.
            stack.last()?.difference.sign(0)?;
        }
        Some(roots)
    }

    fn add_parted(self: &Rc<Self>, roots: &mut Vec<Root>, part: &Part) -> Option<()> {
        for branch in [-1, 1] {
            let sign_at = |end| match part.difference.sign_at_end(end)? {
                1 => Some(-branch),
                difference => {
                    let middle = part.middle.sign_at_end(end)?;
                    Some(sign_of_branch(branch, middle, difference))
                }
            };
            let (left, right) = (sign_at(0)?, sign_at(1)?);
            if left * right < 0 {
                let place = Isolated {
                    numerator: part.numerator,
                    bits: part.bits,
                    left,
                };
                let equation = Equation::Branch(Rc::clone(self), branch);
                roots.push(Root::isolated(equation, &place));
            }
        }
        Some(())
    }
}

impl Part {
    /// Whether surely w² > a s on the whole part, by the least and greatest coefficients.
    fn is_clear(&self, scale: f64) -> bool {
        let most = self.square.greatest();
        if most < 0 {
            return true;
        }
        let least = self.middle.least_size() as f64;
        20.0 * least * least > 3.0 * scale * most as f64 * ABOVE
    }

    /// Whether surely s > 0 and both branches are strictly monotone (see [`super::Branches::is_monotone`]).
    fn is_monotone(&self, scale: f64) -> bool {
        let least = self.square.least();
        let (climbs, steps) = (self.middle.steps(), self.square.steps());
        let slope = climbs.least_size() as f64;
        let spread = steps.greatest().max(-steps.least()) as f64;
        20.0 * least as f64 * slope * slope > 3.0 * scale * spread * spread * ABOVE
    }

    /// The right half, then the left one on top.
    fn halves(&self) -> [Self; 2] {
        let rows = [&self.middle, &self.square, &self.difference].map(Row::halves);
        [1, 0].map(|i| Self {
            middle: rows[0][i],
            square: rows[1][i],
            difference: rows[2][i],
            numerator: 2 * self.numerator + i as u64,
            bits: self.bits + 1,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::exact::Polynomial;
    use crate::numeric::rng::{Purpose, Stream};

    /// The branches of random w² = a s, a s from 2⁻⁴⁰⁰ of w² to as much: the same roots, by the same branches, as by whole numbers.
    #[test]
    fn quick_and_slow_roots_are_the_same() {
        let (mut told, mut parted) = (0, 0);
        let count = 1000;
        for index in 0..count {
            let mut stream = Stream::new(82, Purpose::Test, index);
            // a s is about 2⁻²ⁿ of w².
            let n = if index % 2 == 0 {
                index % 200
            } else {
                index % 8
            };
            let mut whole = |up: u64| BigInt::from(stream.next_u64() as i64) << up;
            let mut cubic: Vec<BigInt> = (0..4).map(|_| whole(n + 20)).collect();
            let mut square: Vec<BigInt> = (0..7).map(|_| whole(60)).collect();
            let factor = BigInt::one() << 40_u32;
            if index % 5 == 0 {
                // A root at an end.
                let m = whole(0);
                square[0] = (&m * &m) << (2 * n);
                cubic[0] = m << (n + 20);
            }
            let [cubic, square] = [cubic, square].map(Polynomial::new);
            let pair = Rc::new(Branches::new(cubic, square, factor));
            let (Some(quick), Some(slow)) = (pair.quick_roots(), pair.slow_roots()) else {
                continue;
            };
            told += 1;
            let list = |roots: Vec<Root>| {
                let value = |mut root: Root| (root.to_f64(), root.branch(), root.multiplicity());
                let mut list: Vec<_> = roots.into_iter().map(value).collect();
                list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                list
            };
            let (quick, slow) = (list(quick), list(slow));
            assert_eq!(quick.len(), slow.len(), "{index}");
            for (a, b) in quick.iter().zip(&slow) {
                assert!((a.0 - b.0).abs() < 1e-15, "{index}");
                assert_eq!((a.1, a.2), (b.1, b.2), "{index}");
            }
            parted += quick.iter().filter(|root| root.1.is_some()).count();
        }
        assert!(told > count * 9 / 10 && parted > 250, "{told} {parted}");
    }
}
