//! Bezier clipping (Sederberg and Nishita 1990; Nishita, Sederberg and Kakimoto 1990): the classical robust rival, as people write
//! it, in f64 and without exact arithmetic.
//!
//! The crossings with a piece are the zeros of f(u) = d_y² r² − |q|² of degree 6, q = (o_x, o_z) d_y + (h − o_y) (d_x, d_z). Its
//! graph (u, f(u)) is a planar Bezier curve with the control points (i/6, fᵢ), which lies in their convex hull; where the hull
//! does not meet the axis there is no root, and elsewhere the curve is clipped to the part of u where it does, again and again.
//! A part that shrinks by less than `LEAST_GAIN` may hold several roots and is halved. A part narrower than the tolerance is a
//! root, and t = (h − o_y)/d_y.
//!
//! **Known failures**, kept because they are what is studied. A level ray (d_y = 0) has no t and is always missed. Near level f
//! is almost −|q|², a square whose two roots lie d_y apart: below |d_y| ~ 10⁻⁸ they drown in rounding and are missed, invented or
//! confused, and t loses digits like ε/d_y. A tangency is noise: it gives none, one or two roots. A root on a joint is found by
//! one piece, both or none, because both round f differently. A root whose part ends at a bisection point may be told twice. Where
//! f is flat, the rounding of a clip may cut off a simple root: on the cup 1 ray in 20,000 loses a sheet at a tolerance of 10⁻⁶,
//! 4 at 10⁻¹², 6 at 10⁻¹⁴.

use crate::geometry::hit::Crossing;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::split;
use crate::numeric::work::Work;

/// Parameters of the clipping solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClippingSettings {
    /// A part of the piece this narrow in u is a root; roots of one piece nearer together than twice this are one.
    pub tolerance: f64,
}

impl Default for ClippingSettings {
    fn default() -> Self {
        Self { tolerance: 1e-12 }
    }
}

/// A clip that keeps more than this share of the part is followed by a bisection (Nishita, Sederberg and Kakimoto 1990: 80 %).
const LEAST_GAIN: f64 = 0.8;

/// Parts looked at for one piece at most: roots of a polynomial of degree 6 need fewer than a hundred, a piece on which f is all
/// noise would go on for ever.
const MOST_PARTS: u32 = 1000;

/// Every crossing found inside the open range of a ray in the profile's own frame, by rising t.
pub fn crossings(
    profile: &Profile,
    settings: &ClippingSettings,
    ray: &Ray,
    work: &mut Work,
) -> Vec<Crossing> {
    if !ray.is_valid() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (index, piece) in (0..).zip(profile.pieces()) {
        for u in roots(coefficients(piece, ray), settings, work) {
            let t = (piece.at(u).height - ray.origin.y) / ray.direction.y;
            if ray.contains(t) {
                found.push(Crossing { t, piece: index, u });
            }
        }
    }
    found.sort_by(|a, b| {
        (a.t.total_cmp(&b.t))
            .then(a.piece.cmp(&b.piece))
            .then(a.u.total_cmp(&b.u))
    });
    found
}

/// Bernstein coefficients of f.
fn coefficients(piece: &Piece, ray: &Ray) -> [f64; 7] {
    let (o, d) = (ray.origin, ray.direction);
    let flat =
        |o: f64, d: f64, along: f64| piece.height.map(|h| o * along + (h - ray.origin.y) * d);
    let x = square(&flat(o.x, d.x, d.y));
    let z = square(&flat(o.z, d.z, d.y));
    let r = square(&piece.radius.map(|r| r * d.y));
    std::array::from_fn(|i| r[i] - x[i] - z[i])
}

/// The square of a cubic.
fn square(c: &[f64; 4]) -> [f64; 7] {
    [
        c[0] * c[0],
        c[0] * c[1],
        (2.0 * c[0] * c[2] + 3.0 * c[1] * c[1]) / 5.0,
        (c[0] * c[3] + 9.0 * c[1] * c[2]) / 10.0,
        (2.0 * c[1] * c[3] + 3.0 * c[2] * c[2]) / 5.0,
        c[2] * c[3],
        c[3] * c[3],
    ]
}

/// The u of the roots, ascending.
fn roots(whole: [f64; 7], settings: &ClippingSettings, work: &mut Work) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    let mut stack = vec![(whole, 0.0, 1.0)];
    for _ in 0..MOST_PARTS {
        let Some((part, low, high)) = stack.pop() else {
            break;
        };
        work.solver_iterations += 1;
        let Some((a, b)) = hull_on_axis(&part) else {
            continue;
        };
        let width = high - low;
        let (from, to) = (low + a * width, low + b * width);
        if to - from <= settings.tolerance {
            let u = 0.5 * (from + to);
            if found
                .last()
                .is_none_or(|last| u - last > 2.0 * settings.tolerance)
            {
                found.push(u);
            }
            continue;
        }
        if b - a > LEAST_GAIN {
            let (left, right) = split(&part, 0.5);
            let middle = 0.5 * (low + high);
            stack.push((right, middle, high));
            stack.push((left, low, middle));
        } else {
            let (left, _) = split(&part, b);
            let (_, clipped) = split(&left, a / b);
            stack.push((clipped, from, to));
        }
    }
    found
}

/// The least and greatest abscissa, in [0, 1], at which the hull of the points (i/6, fᵢ) meets the axis.
///
/// The hull meets the axis between crossings of segments from points above to points below, and points on it.
fn hull_on_axis(f: &[f64; 7]) -> Option<(f64, f64)> {
    let mut ends: Option<(f64, f64)> = None;
    let mut take = |x: f64| {
        ends = Some(ends.map_or((x, x), |(low, high)| (low.min(x), high.max(x))));
    };
    let at = |i: usize| i as f64 / 6.0;
    for i in 0..7 {
        if f[i] == 0.0 {
            take(at(i));
        }
        for j in 0..i {
            if (f[i] < 0.0) != (f[j] < 0.0) && f[i] != 0.0 && f[j] != 0.0 {
                take(at(j) + (at(i) - at(j)) * f[j] / (f[j] - f[i]));
            }
        }
    }
    ends
}
