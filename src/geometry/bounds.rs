//! Bounding volumes: axis-aligned box, the cylinder around a profile, and its rivals.

mod volume;

use super::profile::{Piece, Profile};
use super::ray::Ray;
use crate::numeric::polynomial::{cubic, cubic_extrema};
use glam::DVec3;
pub use volume::{Bounding, Volume};

/// Axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner of least coordinates.
    pub min: DVec3,
    /// Corner of greatest coordinates.
    pub max: DVec3,
}

/// The solid cylinder about the y axis that holds a revolved profile, in the profile's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius, ≥ 0.
    pub radius: f64,
    /// Least height.
    pub bottom: f64,
    /// Greatest height.
    pub top: f64,
}

/// Least and greatest value of a cubic on [0, 1], widened by the rounding of its evaluation.
///
/// The value at a computed extremum differs from the true one by the square of the parameter's error, which is far below the
/// ten roundings of the coefficients' size that [`cubic`] may cost.
pub fn cubic_range(c: &[f64; 4]) -> (f64, f64) {
    let size = c.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let slack = 8.0 * f64::EPSILON * size + f64::from_bits(8);
    let mut ends = (c[0].min(c[3]), c[0].max(c[3]));
    // An extremum so near to an end that its parameter rounds to it is not among those below.
    let inner = (c[1].min(c[2]), c[1].max(c[2]));
    if inner.0 < ends.0 {
        ends.0 -= slack;
    }
    if inner.1 > ends.1 {
        ends.1 += slack;
    }
    cubic_extrema(c)
        .into_iter()
        .map(|u| cubic(c, u).0)
        .fold(ends, |(low, high), x| {
            (low.min(x - slack), high.max(x + slack))
        })
}

impl Cylinder {
    /// The tight cylinder of a profile: from the roots of r′ and h′, not from the control polygon.
    pub fn of(profile: &Profile) -> Self {
        let empty = Self {
            radius: 0.0,
            bottom: f64::INFINITY,
            top: f64::NEG_INFINITY,
        };
        profile.pieces().iter().fold(empty, |bound, piece| {
            let piece = Self::of_piece(piece);
            Self {
                radius: bound.radius.max(piece.radius),
                bottom: bound.bottom.min(piece.bottom),
                top: bound.top.max(piece.top),
            }
        })
    }

    /// The tight cylinder of one piece.
    pub fn of_piece(piece: &Piece) -> Self {
        let (inner, outer) = cubic_range(&piece.radius);
        let (bottom, top) = cubic_range(&piece.height);
        Self {
            // Where r < 0 the surface is that of |r|.
            radius: inner.abs().max(outer.abs()),
            bottom,
            top,
        }
    }

    /// An interval of t that holds every point the ray's line shares with the cylinder, or `None` if there is certainly none.
    ///
    /// Conservative: every bound is moved outward by more than its rounding, so no point of the closed cylinder is ever lost,
    /// whether the ray is parallel to the axis, touches the wall, starts inside, or comes from far away. The ray's range is not
    /// looked at.
    #[inline]
    pub fn interval(&self, ray: &Ray) -> Option<(f64, f64)> {
        let (o, d) = (ray.origin, ray.direction);
        let (low, high) = slab(self.bottom, self.top, o.y, d.y)?;
        let speed = length(d.x, d.z);
        if speed == 0.0 {
            let distance = length(o.x, o.z);
            return (distance <= self.radius * (1.0 + MARGIN)).then_some((low, high));
        }
        // Along the horizontal unit direction: nearest to the axis at arc length −o·e, at the distance |o × e|. Below the normal
        // numbers a length would have no digits left.
        let unit = if speed < TINY { 1.0 / TINY } else { 1.0 };
        let (x, z) = (d.x * unit, d.z * unit);
        let speed = length(x, z);
        let (x, z) = (x / speed, z / speed);
        let slack = MARGIN * (o.x.abs().max(o.z.abs()) + self.radius);
        let distance = (o.x * z - o.z * x).abs() - slack;
        let radius = self.radius + slack;
        if distance > radius {
            return None;
        }
        let near = distance.max(0.0);
        let half = length_of_leg(radius, near) * (1.0 + MARGIN) + slack;
        let middle = -(o.x * x + o.z * z);
        let at = |arc: f64| arc / speed * unit;
        let (enter, leave) = outward(at(middle - half), at(middle + half));
        let (low, high) = (low.max(enter), high.min(leave));
        // Not `low <= high`: a NaN from overflowing input must not cull.
        if high < low { None } else { Some((low, high)) }
    }
}

/// √(a² − b²) for a ≥ b ≥ 0 without cancellation or overflow.
#[inline]
fn length_of_leg(a: f64, b: f64) -> f64 {
    let product = (a - b).max(0.0) * (a + b);
    if product > 1.0 / MODERATE && product < MODERATE {
        product.sqrt()
    } else {
        (a - b).max(0.0).sqrt() * (a + b).sqrt()
    }
}

/// Squares up to this size neither overflow nor, above its inverse, lose digits to underflow.
const MODERATE: f64 = 1e280;

/// Speeds below this are scaled by its inverse, a power of two.
const TINY: f64 = f64::from_bits((1023 - 900) << 52);

/// Relative outward move of every bound: each is the result of fewer than 16 roundings.
const MARGIN: f64 = 16.0 * f64::EPSILON;

/// The interval of t where `bottom ≤ o + t d ≤ top`, moved outward.
#[inline]
fn slab(bottom: f64, top: f64, o: f64, d: f64) -> Option<(f64, f64)> {
    if d == 0.0 {
        return (bottom <= o && o <= top).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (a, b) = ((bottom - o) / d, (top - o) / d);
    Some(outward(a.min(b), a.max(b)))
}

/// Below the normal numbers roundings are absolute, hence the least normal number.
#[inline]
fn outward(low: f64, high: f64) -> (f64, f64) {
    let down = MARGIN * low.abs() + f64::MIN_POSITIVE;
    let up = MARGIN * high.abs() + f64::MIN_POSITIVE;
    (low - down, high + up)
}

/// √(x² + z²), to a few roundings, without over- or underflow.
#[inline]
fn length(x: f64, z: f64) -> f64 {
    let square = x * x + z * z;
    if square > 1.0 / MODERATE && square < MODERATE {
        square.sqrt()
    } else {
        libm::hypot(x, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By half the margin at least, so that the rounding of the sum takes nothing away, and by no more than twice of it.
    #[test]
    fn both_ends_of_an_interval_move_outward_by_some_roundings() {
        for (low, high) in [(1.0, 2.0), (-2.0, -1.0), (-1e300, 1e300), (0.0, 0.0)] {
            let (below, above) = outward(low, high);
            for (moved, end) in [(low - below, low), (above - high, high)] {
                let margin = MARGIN * f64::abs(end) + f64::MIN_POSITIVE;
                assert!((0.5 * margin..=2.0 * margin).contains(&moved), "{end}");
            }
        }
    }

    #[test]
    fn the_shorter_leg_of_a_triangle_keeps_its_digits() {
        for (hypotenuse, leg, other) in [(5.0, 3.0, 4.0), (13.0, 12.0, 5.0), (2.0, 2.0, 0.0)] {
            for scale in [1.0, 1e-170, 1e170] {
                let got = length_of_leg(scale * hypotenuse, scale * leg);
                assert!((got - scale * other).abs() <= 1e-14 * scale, "{scale}");
                let got = length(scale * leg, scale * other);
                assert!((got / (scale * hypotenuse) - 1.0).abs() <= 1e-15, "{scale}");
            }
        }
        assert_eq!(length(0.0, 0.0), 0.0);
    }
}
