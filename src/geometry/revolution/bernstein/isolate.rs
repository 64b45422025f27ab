//! Isolation of the roots of a polynomial of degree 6 on [0, 1], and their refinement.

use super::{Padded, Undecided};
use crate::numeric::polynomial::split;

/// An interval that holds exactly one root, a simple one, with a guess of it.
pub(super) struct Bracket {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) guess: f64,
    /// Whether the polynomial is positive at `low`.
    pub(super) falls: bool,
}

const ALL: u32 = 0x7f;
const ENDS: u32 = 0x41;

/// Halvings before two roots count as one: parameters are then 2⁻⁴⁰ apart.
const DEPTH: u32 = 40;

/// Reports a bracket for each root in (0, 1), by rising parameter. `error` bounds the error of each coefficient; a polynomial
/// whose roots such an error could make or unmake is undecided.
#[inline]
pub(super) fn isolate(
    c: &Padded,
    error: f64,
    found: &mut impl FnMut(Bracket) -> Result<(), Undecided>,
) -> Result<(), Undecided> {
    if one_signed(c, error) {
        return Ok(());
    }
    let [c @ .., _] = *c;
    isolate_between(c, [0.0, 1.0], error, found)
}

/// As [`isolate`], for the part of the piece between two parameters.
#[inline]
pub(super) fn isolate_between(
    c: [f64; 7],
    [low, high]: [f64; 2],
    error: f64,
    found: &mut impl FnMut(Bracket) -> Result<(), Undecided>,
) -> Result<(), Undecided> {
    let node = Node {
        c,
        low,
        high,
        error,
        depth: 0,
    };
    classify(node, found)
}

/// Whether all coefficients are certainly positive or all certainly negative. False if one is NaN.
#[inline]
fn one_signed(c: &Padded, error: f64) -> bool {
    let (mut above, mut below) = (true, true);
    for &x in c {
        above &= x > error;
        below &= x < -error;
    }
    above || below
}

/// Bits of the coefficients that are certainly positive, and of those certainly negative.
#[inline]
fn signs(c: &[f64; 7], error: f64) -> (u32, u32) {
    let (mut positive, mut negative) = (0, 0);
    for (i, &x) in c.iter().enumerate() {
        positive |= u32::from(x > error) << i;
        negative |= u32::from(x < -error) << i;
    }
    (positive, negative)
}

#[inline]
fn changes(positive: u32) -> u32 {
    ((positive ^ (positive >> 1)) & (ALL >> 1)).count_ones()
}

struct Node {
    c: [f64; 7],
    low: f64,
    high: f64,
    error: f64,
    depth: u32,
}

impl Node {
    /// The bracket of a node whose coefficients change sign once, guessed where the control polygon crosses zero.
    ///
    /// Not the secant of the end values: where the value at one end is almost 0 (the root of the neighbour piece), it would start
    /// there and stay.
    #[inline]
    fn bracket(&self, positive: u32) -> Bracket {
        let i = ((positive ^ (positive >> 1)) & (ALL >> 1)).trailing_zeros() as usize % 6;
        let (a, b) = (self.c[i], self.c[i + 1]);
        let share = (i as f64 + a / (a - b)) * (1.0 / 6.0);
        Bracket {
            low: self.low,
            high: self.high,
            guess: self.low + share * (self.high - self.low),
            falls: positive & 1 == 1,
        }
    }

    /// Where to cut: between two roots, if there are two. Ends of the same sign have between them a part of the other sign, most
    /// likely near the greatest coefficient of that sign. Deeper down halving is safer.
    #[inline]
    fn cut(&self) -> f64 {
        if self.depth > 3 || (self.c[0] > 0.0) != (self.c[6] > 0.0) {
            return 0.5;
        }
        let side = if self.c[0] > 0.0 { -1.0 } else { 1.0 };
        let (mut best, mut share) = (0.0, 0.5);
        for i in 1..6 {
            if side * self.c[i] > best {
                best = side * self.c[i];
                share = i as f64 / 6.0;
            }
        }
        share
    }

    /// A part of the node. Each coefficient comes of a chain of at most six corner cuts, each of which rounds three times by at
    /// most half an ulp of the greatest.
    #[inline]
    fn part(&self, c: [f64; 7], low: f64, high: f64, error: f64) -> Self {
        Self {
            c,
            low,
            high,
            error,
            depth: self.depth + 1,
        }
    }
}

fn divide(
    node: &Node,
    found: &mut impl FnMut(Bracket) -> Result<(), Undecided>,
) -> Result<(), Undecided> {
    if node.depth >= DEPTH {
        return Err(Undecided);
    }
    let size = node.c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let error = node.error + 9.0 * f64::EPSILON * size;
    let mut share = node.cut();
    let (mut left, mut right) = split(&node.c, share);
    // A value near 0 at the cut would leave the ends of both halves in doubt: cut elsewhere, once.
    if left[6].abs() <= error {
        share = 0.5 * share + 0.203_125;
        (left, right) = split(&node.c, share);
    }
    let middle = node.low + share * (node.high - node.low);
    classify(node.part(left, node.low, middle, error), found)?;
    classify(node.part(right, middle, node.high, error), found)
}

#[inline]
fn classify(
    node: Node,
    found: &mut impl FnMut(Bracket) -> Result<(), Undecided>,
) -> Result<(), Undecided> {
    let (positive, negative) = signs(&node.c, node.error);
    if positive == ALL || negative == ALL {
        Ok(())
    } else if (positive | negative) & ENDS != ENDS {
        Err(Undecided)
    } else if positive | negative == ALL && changes(positive) == 1 {
        found(node.bracket(positive))
    } else {
        divide(&node, found)
    }
}

/// A step this short ends the search: Newton's error after it is of the order of its square, and the polish that follows squares
/// it again, as often as it takes.
const SHORT: f64 = 1e-7;

/// And it must be this much shorter than the one before: near a close pair of roots the steps only halve.
const QUADRATIC: f64 = 0.05;

/// Steps after which every second one is a bisection, so that the search ends whatever the polynomial.
const PATIENCE: u32 = 10;

/// The root in a bracket, by Newton's method kept inside it; `f` gives value and slope.
#[inline]
pub(super) fn refine(bracket: &Bracket, steps: &mut u64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (mut low, mut high) = (bracket.low, bracket.high);
    let mut u = bracket.guess;
    let mut last = 1.0;
    for step in 0..120 {
        *steps += 1;
        let (value, slope) = f(u);
        if (value > 0.0) == bracket.falls {
            low = u;
        } else {
            high = u;
        }
        let next = u - value / slope;
        let patient = step < PATIENCE || step % 2 == 0;
        // A short bisection step says nothing of convergence: only a Newton step may end the search.
        if patient && next >= low && next <= high {
            let change = (next - u).abs();
            if change < SHORT && (change < QUADRATIC * last || change < f64::EPSILON) {
                return next;
            }
            (u, last) = (next, change);
        } else {
            u = 0.5 * (low + high);
            let width = high - low;
            if width < f64::EPSILON {
                return u;
            }
        }
    }
    u
}
