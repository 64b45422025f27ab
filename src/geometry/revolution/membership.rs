//! Is a point inside the solid that a revolved profile encloses?
//!
//! In the half-plane of (ρ, y), ρ² = x² + z², a point is inside if the half-line of its own height, from it outwards, crosses the
//! profile |r| an odd number of times: where h(u) passes y with r(u)² > ρ². "Passes" is a change of h ≥ y, so that joints, turning
//! points and level parts at the height itself need no care, and an open profile counts as closed by level discs from its ends
//! to the axis. Where the profile encloses a region twice, that region is outside.
//!
//! Values are compared in f64 with a margin above all rounding; a point within the margin of the profile is decided in dyadic
//! numbers (see [`crate::numeric::exact`]), which also tell the points that lie on the surface.

use super::Revolution;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::numeric::exact::{Dyadic, Polynomial, Root};
use glam::DVec3;
use num_bigint::BigInt;

/// Where a point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Membership {
    /// Inside.
    Inside,
    /// Outside.
    Outside,
    /// On the surface.
    On,
}

/// Halvings after which f64 gives up: the control polygon is then flatter than the margin.
const DEPTH: u32 = 48;
/// A halving costs at most three roundings (of ε/2) of the greatest control value, [`DEPTH`] of them 72 ε; the distance from the
/// axis costs 2 more.
const MARGIN: f64 = 80.0 * f64::EPSILON;
/// Radii whose squares neither overflow nor vanish.
const ORDINARY: std::ops::Range<f64> = 1e-100..1e100;

impl Revolution {
    /// Where a world point lies: exactly so for the point's image in the profile's frame, as rounded on the way there for every ray
    /// that starts at this point.
    pub fn membership(&self, point: DVec3) -> Membership {
        let local = self.placement.ray_to_local(&Ray::new(point, DVec3::Y));
        membership(&self.profile, local.origin)
    }
}

/// Where a point of the profile's own frame lies. A point that is not finite is outside.
pub fn membership(profile: &Profile, point: DVec3) -> Membership {
    if !point.is_finite() {
        return Membership::Outside;
    }
    by_floats(profile, point).unwrap_or_else(|| exactly(profile, point))
}

fn of_parity(odd: bool) -> Membership {
    if odd {
        Membership::Inside
    } else {
        Membership::Outside
    }
}

/// The answer, if the point is not within the margin of the profile.
fn by_floats(profile: &Profile, point: DVec3) -> Option<Membership> {
    let (radius, height) = profile.control_size();
    if !ORDINARY.contains(&radius) {
        return None;
    }
    let search = Search {
        distance: (point.x * point.x + point.z * point.z).sqrt(),
        height: point.y,
        margins: [MARGIN * radius, MARGIN * height],
    };
    let mut odd = false;
    for piece in profile.pieces() {
        odd ^= search.crosses(piece.radius, piece.height, DEPTH)?;
    }
    Some(of_parity(odd))
}

struct Search {
    distance: f64,
    height: f64,
    /// Of radii and heights.
    margins: [f64; 2],
}

impl Search {
    /// Whether the half-line crosses this arc an odd number of times.
    fn crosses(&self, radius: [f64; 4], height: [f64; 4], depth: u32) -> Option<bool> {
        let [across, along] = self.margins;
        let above = height.iter().all(|h| h - self.height > along);
        let below = height.iter().all(|h| self.height - h > along);
        let inner = (radius.iter()).all(|r| self.distance - r.abs() > across);
        if above || below || inner {
            return Some(false);
        }
        let outer = |side: f64| radius.iter().all(|r| side * r - self.distance > across);
        if outer(1.0) || outer(-1.0) {
            // The end of an arc is, to the bit, the start of the next one: what rounding does to it cancels.
            return Some((height[0] >= self.height) != (height[3] >= self.height));
        }
        let rest = depth.checked_sub(1)?;
        let ([r0, r1], [h0, h1]) = (halves(radius), halves(height));
        Some(self.crosses(r0, h0, rest)? ^ self.crosses(r1, h1, rest)?)
    }
}

fn halves([a, b, c, d]: [f64; 4]) -> [[f64; 4]; 2] {
    let mean = |x: f64, y: f64| 0.5 * x + 0.5 * y;
    let (ab, bc, cd) = (mean(a, b), mean(b, c), mean(c, d));
    let (abc, bcd) = (mean(ab, bc), mean(bc, cd));
    let middle = mean(abc, bcd);
    [[a, ab, abc, middle], [middle, bcd, cd, d]]
}

/// The answer in dyadic numbers, for every finite point.
fn exactly(profile: &Profile, point: DVec3) -> Membership {
    let controls = (profile.pieces().iter()).flat_map(|p| p.radius.iter().chain(&p.height));
    let coordinates = point.to_array();
    let exponents = (controls.chain(&coordinates).filter(|v| **v != 0.0))
        .map(|&v| Dyadic::from_f64(v).exponent);
    let unit = exponents.min().unwrap_or(0);
    let whole = |v: f64| Dyadic::from_f64(v).at(unit);
    let [x, y, z] = coordinates.map(whole);
    let square = &x * &x + &z * &z;
    let mut odd = false;
    for piece in profile.pieces().iter().filter(|piece| !piece.on_axis()) {
        let rise = Polynomial::cubic(&piece.height.map(whole)).affine(&BigInt::from(1), &-&y);
        let excess = Polynomial::cubic(&piece.radius.map(whole))
            .squared()
            .affine(&BigInt::from(1), &-&square);
        if rise.is_zero() {
            if excess.is_zero() || !excess.roots().is_empty() {
                return Membership::On;
            }
            continue;
        }
        for mut root in rise.roots() {
            match root.sign_of(&excess) {
                0 => return Membership::On,
                1 => odd ^= passes(piece, point.y, &root),
                _ => {}
            }
        }
    }
    of_parity(odd)
}

/// Whether h ≥ y changes at this root of h = y.
fn passes(piece: &Piece, y: f64, root: &Root) -> bool {
    // Next to an end, the first control value that is not y tells the side.
    let is_below = |h: Option<&f64>| h.is_some_and(|&h| h < y);
    let mut others = piece.height.iter().filter(|&&h| h != y);
    if root.is(0) {
        is_below(others.next())
    } else if root.is(1) {
        is_below(others.next_back())
    } else {
        root.multiplicity() % 2 == 1
    }
}
