//! Bernstein coefficients in 128 bits, with a bound of their error: isolation where it is certain.

use super::fixed::DEGREE;

/// Halvings until the whole numbers are asked.
const DEPTH: u32 = 60;

/// Bernstein coefficients on an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    coefficients: [i128; DEGREE + 1],
    degree: usize,
    /// No coefficient is further from the true one.
    error: i128,
    /// So many of the first, and of the last, are known to be exactly zero.
    zeros: [usize; 2],
}

/// An interval [n, n + 1]/2^`bits` inside which the polynomial has one root, a simple one.
pub(super) struct Isolated {
    pub(super) numerator: u64,
    pub(super) bits: u32,
    /// Sign at the lower end, or beside it where the end is a root.
    pub(super) left: i32,
}

impl Row {
    /// The first `degree` + 1 of the coefficients, none of them known to be zero.
    pub(super) fn new(coefficients: [i128; DEGREE + 1], degree: usize, error: i128) -> Self {
        Self {
            coefficients,
            degree,
            error,
            zeros: [0; 2],
        }
    }

    /// The same, with so many exact zeros at either end.
    pub(super) fn with_zeros(mut self, zeros: [usize; 2]) -> Self {
        let n = self.degree;
        self.coefficients[..zeros[0]].fill(0);
        self.coefficients[n + 1 - zeros[1]..=n].fill(0);
        self.zeros = zeros;
        self
    }

    /// So many of the first and of the last coefficients are exactly zero.
    pub(super) fn zeros(&self) -> [usize; 2] {
        self.zeros
    }

    /// One less than their number.
    pub(super) fn degree(&self) -> usize {
        self.degree
    }

    /// The coefficients.
    pub(super) fn coefficients(&self) -> &[i128] {
        &self.coefficients[..=self.degree]
    }

    /// No coefficient is below this.
    pub(super) fn least(&self) -> i128 {
        let least = self.coefficients().iter().min();
        least.map_or(0, |c| c - self.error)
    }

    /// None is above this.
    pub(super) fn greatest(&self) -> i128 {
        let greatest = self.coefficients().iter().max();
        greatest.map_or(0, |c| c + self.error)
    }

    /// If all are surely of one sign, none is nearer to zero than this; else 0.
    pub(super) fn least_size(&self) -> i128 {
        self.least().max(-self.greatest()).max(0)
    }

    /// The differences of neighbours.
    pub(super) fn steps(&self) -> Self {
        let mut coefficients = [0; DEGREE + 1];
        for (to, pair) in coefficients.iter_mut().zip(self.coefficients().windows(2)) {
            *to = pair[1] - pair[0];
        }
        Self::new(coefficients, self.degree - 1, 2 * self.error)
    }

    /// No coefficient is further from the true one.
    #[cfg(test)]
    pub(super) fn error(&self) -> i128 {
        self.error
    }

    /// The sign of a coefficient, where certain.
    pub(super) fn sign(&self, i: usize) -> Option<i32> {
        let value = self.coefficients[i];
        (value.abs() > self.error).then_some(value.signum() as i32)
    }

    /// The sign at an end, 0 or 1, where certain: 0 for an exact zero.
    pub(super) fn sign_at_end(&self, end: usize) -> Option<i32> {
        if self.zeros[end] > 0 {
            return Some(0);
        }
        self.sign(end * self.degree)
    }

    /// The first sign that is not that of an exact zero, where certain.
    pub(super) fn first_sign(&self) -> Option<i32> {
        self.sign(self.zeros[0].min(self.degree))
    }

    /// Coefficients on the lower and the upper half.
    pub(super) fn halves(&self) -> [Self; 2] {
        let n = self.degree;
        let (mut left, mut right) = (*self, *self);
        let row = &mut right.coefficients;
        for step in 1..=n {
            left.coefficients[step - 1] = row[0];
            for i in 0..=n - step {
                row[i] = (row[i] + row[i + 1]) >> 1;
            }
        }
        left.coefficients[n] = row[0];
        // Each of n means is rounded by less than one.
        let error = self.error + n as i128;
        (left.error, right.error) = (error, error);
        (left.zeros[1], right.zeros[0]) = (0, 0);
        [left, right]
    }

    /// The number of sign changes, exact zeros left out; `None` where it is not certain.
    pub(super) fn variations(&self) -> Option<usize> {
        let [first, last] = [
            self.zeros[0],
            self.degree + 1 - self.zeros[1].min(self.degree + 1),
        ];
        let mut before: Option<i32> = None;
        let (mut changes, mut doubts) = (0, 0);
        for i in first..last {
            let Some(sign) = self.sign(i) else {
                doubts += 1;
                continue;
            };
            let changed = before.is_some_and(|before| before != sign);
            // One doubt between unlike signs changes nothing; other doubts may hide two changes, one at an end one.
            if doubts > usize::from(changed) {
                return None;
            }
            changes += usize::from(changed);
            (before, doubts) = (Some(sign), 0);
        }
        (doubts == 0).then_some(changes)
    }

    /// The roots inside (0, 1); `None` where they are not told apart soon.
    pub(super) fn isolate(self) -> Option<Vec<Isolated>> {
        let mut roots = Vec::new();
        let mut stack = vec![(self, 0_u64, 0_u32)];
        while let Some((row, numerator, bits)) = stack.pop() {
            match row.variations() {
                Some(0) => {}
                Some(1) => roots.push(Isolated {
                    numerator,
                    bits,
                    left: row.first_sign()?,
                }),
                _ if bits >= DEPTH => return None,
                _ => {
                    let [left, right] = row.halves();
                    // What is in doubt at the middle stays so in both halves.
                    right.sign(0)?;
                    stack.push((right, 2 * numerator + 1, bits + 1));
                    stack.push((left, 2 * numerator, bits + 1));
                }
            }
        }
        Some(roots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(coefficients: &[i128], error: i128) -> Row {
        let mut all = [0; DEGREE + 1];
        all[..coefficients.len()].copy_from_slice(coefficients);
        Row::new(all, coefficients.len() - 1, error)
    }

    #[test]
    fn sign_changes_are_told_only_where_no_doubt_can_change_them() {
        let changes = |coefficients: &[i128]| row(coefficients, 5).variations();
        assert_eq!(changes(&[9, 7, 8]), Some(0));
        assert_eq!(changes(&[9, -7, 8, 6]), Some(2));
        assert_eq!(changes(&[9, 0, -8]), Some(1));
        assert_eq!(changes(&[9, 5, -8, -9]), Some(1));
        assert_eq!(changes(&[9, -5, 4, -8]), None);
        assert_eq!(changes(&[9, 0, 8]), None);
        assert_eq!(changes(&[0, 9, 8]), None);
        assert_eq!(changes(&[9, 8, 5]), None);
        let known = row(&[9, 9, -8, 3], 5).with_zeros([1, 1]);
        assert_eq!(known.variations(), Some(1));
        assert_eq!(known.first_sign(), Some(1));
        assert_eq!(known.sign_at_end(0), Some(0));
        assert_eq!(row(&[9, -8], 5).sign_at_end(1), Some(-1));
    }

    #[test]
    fn a_double_root_is_not_told_and_two_near_each_other_are() {
        assert!(row(&[1 << 40, -(1 << 40), 1 << 40], 1).isolate().is_none());
        let apart = row(&[1 << 40, -(1 << 40) - (1 << 20), 1 << 40], 1);
        let found = apart.isolate().expect("two roots");
        let signs: Vec<i32> = found.iter().map(|root| root.left).collect();
        assert_eq!(signs.len(), 2);
        assert!(signs.contains(&1) && signs.contains(&-1));
    }

    /// The coefficients of a line are its values.
    #[test]
    fn halves_hold_the_values_of_the_whole() {
        let whole = row(&[1 << 30, 3 << 30, 5 << 30], 2).with_zeros([0, 0]);
        let [left, right] = whole.halves();
        assert_eq!(left.coefficients(), [1 << 30, 2 << 30, 3 << 30]);
        assert_eq!(right.coefficients(), [3 << 30, 4 << 30, 5 << 30]);
        assert_eq!([left.error(), right.error()], [4, 4]);
        let ends = row(&[0, 7, 0], 2).with_zeros([1, 1]).halves();
        assert_eq!([ends[0].zeros(), ends[1].zeros()], [[1, 0], [0, 1]]);
    }

    #[test]
    fn bounds_allow_for_the_error() {
        let row = row(&[-20, -30, -40], 5);
        assert_eq!(
            (row.least(), row.greatest(), row.least_size()),
            (-45, -15, 15)
        );
        let steps = row.steps();
        assert_eq!(
            (steps.least(), steps.greatest(), steps.least_size()),
            (-20, 0, 0)
        );
    }
}
