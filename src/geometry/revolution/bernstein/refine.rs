//! Refinement of isolated roots.
//!
//! Nearly all roots are found by a fixed number of steps without branches ([`refine`]), which many rays can take side by side; a
//! test of convergence sends the others to [`search`], which always ends.

use super::isolate::Bracket;
use super::line::{Aim, COARSE, clamped};
use super::{Cubics, Root};
use crate::numeric::polynomial::cubic;

/// A root after the fixed number of steps.
#[derive(Clone, Copy)]
pub(super) struct Refined {
    pub(super) root: Root,
    /// Size of the last step.
    pub(super) change: f64,
    /// Whether the steps converged to the root in the bracket.
    pub(super) sure: bool,
}

/// Steps of [`refine`], counted as work.
pub(super) const STEPS: u64 = 3;

/// Steps that shrink by this factor converge to a simple root: near a close pair they only halve.
const QUADRATIC: f64 = 0.05;

/// A polish this small needs no other: the error left is of the order of its square, divided by the distance to the nearest other
/// root.
const SETTLED: f64 = 1e-11;

/// The greatest step to come that can be left out.
const FORETOLD: f64 = 1e-17;

/// The root in a bracket: two steps of third order on f(u), then one of Newton's on both equations. For rays that are not nearly
/// level. `slope` has the sign of f′ at the root: the steps may also end at a root just beyond an end, put on it by rounding (that of
/// the next piece, for a ray through the joint), but there f′ has the other sign.
#[inline(always)]
pub(super) fn refine(curve: &Cubics, aim: &Aim, bracket: &Bracket) -> Refined {
    let (guess, slope) = (bracket.guess(), bracket.slope());
    let bracket = [bracket.low, bracket.high];
    let (u, first, _) = householder(curve, aim, bracket, guess);
    let (u, second, slope_there) = householder(curve, aim, bracket, u);
    let (h, _) = cubic(&curve.height, u);
    let t = (h - aim.o.y) * aim.rise;
    let (root, change) = aim.newton(curve, u, t);
    let converges = (change < QUADRATIC * second) | (second < QUADRATIC * first);
    Refined {
        root,
        change,
        sure: converges
            & (change < SETTLED)
            & inside(bracket, root.u)
            & (slope * slope_there > 0.0),
    }
}

/// A root that the fixed steps did not reach.
#[inline(never)]
pub(super) fn refine_more(
    curve: &Cubics,
    aim: &Aim,
    bracket: &Bracket,
    first: &Refined,
    steps: &mut u64,
) -> Root {
    *steps += 1;
    let (root, change) = aim.newton(curve, first.root.u, first.root.t);
    let converges = change < QUADRATIC * first.change;
    // The step to come is foretold from the last two, if these were steps of convergence at all.
    let near = first.change < COARSE;
    let settled = near && change * change * change < FORETOLD * (first.change * first.change);
    let slope = aim.derivatives(curve, root.u)[1];
    let rightly = inside([bracket.low, bracket.high], root.u) && slope * bracket.slope() > 0.0;
    if converges && settled && rightly {
        return root;
    }
    find(curve, aim, bracket, steps)
}

/// The root in a bracket, whatever the ray.
#[cold]
pub(super) fn find(curve: &Cubics, aim: &Aim, bracket: &Bracket, steps: &mut u64) -> Root {
    let u = search(bracket, steps, |u| aim.value(curve, u));
    aim.root_at(curve, u)
}

#[inline(always)]
fn inside([low, high]: [f64; 2], u: f64) -> bool {
    (u >= low) & (u <= high)
}

/// One step of Householder's method of third order (fourfold the digits), kept inside the bracket, with its size and the slope where it
/// began.
#[inline(always)]
fn householder(curve: &Cubics, aim: &Aim, [low, high]: [f64; 2], u: f64) -> (f64, f64, f64) {
    let [f, f1, f2, f3] = aim.derivatives(curve, u);
    let square = f1 * f1;
    let step =
        f * (square - 0.5 * (f * f2)) / (f1 * (square - f * f2) + (f * f) * f3 * (1.0 / 6.0));
    let next = clamped(u - step, low, high);
    (next, (next - u).abs(), f1)
}

/// A step this short ends the search: Newton's error after it is of the order of its square, and the polish that follows squares
/// it again, as often as it takes.
const SHORT: f64 = 1e-7;

/// Steps after which every second one is a bisection, so that the search ends whatever the polynomial.
const PATIENCE: u32 = 10;

/// The root in a bracket, by Newton's method kept inside it; `f` gives value and slope.
pub(super) fn search(bracket: &Bracket, steps: &mut u64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (mut low, mut high) = (bracket.low, bracket.high);
    let mut u = bracket.guess();
    let mut last = 1.0;
    for step in 0..120 {
        *steps += 1;
        let (value, slope) = f(u);
        if (value > 0.0) == bracket.falls() {
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
