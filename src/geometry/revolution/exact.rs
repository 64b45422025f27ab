//! The exact oracle: the degree-6 polynomial in dyadic rationals.
//!
//! Eliminating θ and t from o + t d = S(u, θ) leaves g(u) = |q|² − d_y² r² = 0 with
//! q = (o_x d_y + (h − o_y) d_x, o_z d_y + (h − o_y) d_z) and t = (h − o_y)/d_y; for d_y = 0 it leaves h(u) = o_y and a
//! quadratic in t. Every f64 is a dyadic rational, so both are solved without rounding (see [`crate::numeric::exact`]).
//! Near d_y = 0 the roots of g come in pairs d_y apart; they are the two branches of w² = d_y² s, with
//! w = A (h − o_y) + b d_y, s = A r² − (o_x d_z − o_z d_x)², A = d_x² + d_z², b = o_x d_x + o_z d_z and A t = −b ± √s.
//!
//! **Policy.** A tangency is one crossing, of multiplicity 2 or more. A point shared by two pieces, or by the end and the start of a
//! closed profile, is one crossing, told as the end of the earlier piece. Where the surface touches or crosses the axis, a ray
//! through that point meets it once there. A ray that runs within a piece (along a generator of a cone, inside the plane of a flat
//! disc) does not hit that piece; a piece without area (all of it one point, or on the axis) is never hit.

mod line;
mod recount;

use crate::geometry::hit::Crossing;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::Placement;
use crate::numeric::exact::Polynomial;
use line::{Curve, Line, Solution};
use num_bigint::BigInt;
use num_traits::Zero;
pub use recount::{Tally, recount};

/// A crossing whose t is certain to the last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certified {
    /// Greatest f64 ≤ the exact t.
    pub t_low: f64,
    /// Least f64 ≥ the exact t: `t_low` itself where the exact t is an f64, else its neighbour.
    pub t_high: f64,
    /// The nearer of the two, but for a tie to within 2⁻¹⁰ of their distance.
    pub t: f64,
    /// Piece of the profile.
    pub piece: u32,
    /// Parameter within the piece, within 2⁻⁵³.
    pub u: f64,
    /// Multiplicity of the root in u (times that in t where d_y = 0): 1 for a transversal crossing off the axis, 2 or more for a
    /// tangency.
    pub multiplicity: u32,
}

/// Every crossing inside the open range of a ray in the profile's own frame, by rising t; a tangency counts once, a point
/// shared by two pieces once. Whether a root is real, in the piece and in the range is decided exactly, and so is the order of crossings
/// of different pieces, of t not rounded, down to 2⁻¹²⁸ of a rounding; others at the same f64 stand by piece and u.
pub fn crossings(profile: &Profile, ray: &Ray) -> Vec<Crossing> {
    crossings_among(profile, ray, |_| true)
}

/// As [`crossings`], for a ray that is known to meet only the pieces (by number) that are `suspect`: faster, with the same answer.
pub fn crossings_among(
    profile: &Profile,
    ray: &Ray,
    suspect: impl Fn(u32) -> bool,
) -> Vec<Crossing> {
    if !ray.is_valid() {
        return Vec::new();
    }
    let line = Line::new(profile.pieces(), ray);
    let found = solve(profile.pieces(), &line, &suspect);
    let crossings = found.into_iter().map(|(t, mut solution)| Crossing {
        t,
        piece: solution.piece,
        u: solution.root.to_f64(),
    });
    crossings
        .filter(|crossing| crossing.t.is_finite())
        .collect()
}

/// As [`crossings`], with the neighbours of t and multiplicities, and with those beyond the greatest f64.
pub fn certified(profile: &Profile, ray: &Ray) -> Vec<Certified> {
    if !ray.is_valid() {
        return Vec::new();
    }
    certified_on(profile.pieces(), &Line::new(profile.pieces(), ray))
}

/// As [`certified`] for a ray of the world and a placed profile. The change of frame is not rounded: the surface is that
/// of the points x for which Rᵀ(x − T) lies on the profile scaled by s, with R, T and s as they are stored.
pub fn certified_placed(profile: &Profile, placement: &Placement, ray: &Ray) -> Vec<Certified> {
    if !ray.is_valid() {
        return Vec::new();
    }
    let line = Line::placed(profile.pieces(), placement, ray);
    certified_on(profile.pieces(), &line)
}

fn certified_on(pieces: &[Piece], line: &Line) -> Vec<Certified> {
    let certify = |(t, mut solution): (f64, Solution)| {
        let (t_low, t_high) = solution.neighbours(t);
        Certified {
            t_low,
            t_high,
            t,
            piece: solution.piece,
            u: solution.root.to_f64(),
            multiplicity: solution.multiplicity(),
        }
    };
    let found = solve(pieces, line, &|_| true).into_iter();
    let mut found: Vec<Certified> = found.map(certify).collect();
    // Stable: only sheets of one piece move.
    found.sort_by(|a, b| (a.t_low.total_cmp(&b.t_low)).then(a.t_high.total_cmp(&b.t_high)));
    found
}

/// The polynomial of each piece whose roots in [0, 1] are the u of its crossings with the whole line, with the piece's index;
/// none for pieces without area.
pub fn equations(profile: &Profile, ray: &Ray) -> Vec<(u32, Polynomial)> {
    if !ray.is_valid() {
        return Vec::new();
    }
    let line = Line::new(profile.pieces(), ray);
    let pieces = (0..).zip(profile.pieces());
    pieces
        .map(|(index, piece)| (index, Curve::new(&line, piece)))
        .filter(|(_, curve)| !curve.is_degenerate())
        .map(|(index, curve)| (index, line.equation(&curve)))
        .collect()
}

/// Every crossing of suspect pieces in the range with its t, by rising t, then by piece and u.
fn solve(pieces: &[Piece], line: &Line, suspect: &dyn Fn(u32) -> bool) -> Vec<(f64, Solution)> {
    let mut found = Vec::new();
    let mut joint_met = is_closed(pieces) && ends_in_root(line, pieces);
    for (index, piece) in (0..).zip(pieces) {
        // One that is not met anywhere is not met at its end either.
        if !suspect(index) && !piece.on_axis() {
            joint_met = false;
            continue;
        }
        let curve = Curve::new(line, piece);
        if curve.is_degenerate() {
            continue;
        }
        let mut end_met = false;
        for root in line.roots(&curve) {
            end_met |= root.is(1);
            if !(joint_met && root.is(0)) {
                line.resolve(&curve, root, index, &mut |mut solution| {
                    found.push((solution.time(), solution));
                });
            }
        }
        joint_met = end_met;
    }
    put_in_order(&mut found);
    found
}

/// Sorts by rounded t first; what is then out of order stands next to its place. Sheets of one piece stand by u: where it folds they
/// may all lie in one another.
fn put_in_order(found: &mut [(f64, Solution)]) {
    // Stable: those of one piece stand by u.
    found.sort_by(|(a, first), (b, second)| a.total_cmp(b).then(first.piece.cmp(&second.piece)));
    for end in 1..found.len() {
        for place in (1..=end).rev() {
            let (before, after) = found.split_at_mut(place);
            let ((a, first), (b, second)) = (&mut before[place - 1], &mut after[0]);
            if first.piece == second.piece || first.order(*a, second, *b).is_le() {
                break;
            }
            found.swap(place - 1, place);
        }
    }
}

/// Whether the end of the chain is its start.
fn is_closed(pieces: &[Piece]) -> bool {
    match (pieces.first(), pieces.last()) {
        (Some(a), Some(b)) => a.radius[0] == b.radius[3] && a.height[0] == b.height[3],
        _ => false,
    }
}

/// Whether the line meets the end of the last piece that has an area.
fn ends_in_root(line: &Line, pieces: &[Piece]) -> bool {
    let mut curves = pieces.iter().rev().map(|piece| Curve::new(line, piece));
    curves
        .find(|curve| !curve.is_degenerate())
        .is_some_and(|curve| {
            let equation = line.equation(&curve);
            let end: BigInt = equation.coefficients().iter().sum();
            !equation.is_zero() && end.is_zero()
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Either form gives the same roots; but at d_y = 1e-300 those of the expanded polynomial are a thousand bisections apart.
    #[test]
    fn nearly_level_rays_are_solved_by_branches_and_no_others() {
        let cup = Profile::cup();
        let branches = |dy: f64| {
            let ray = Ray::new(DVec3::new(-9.0, 1.0, 0.3), DVec3::new(1.0, dy, 0.0));
            let line = Line::new(cup.pieces(), &ray);
            let curves = cup.pieces().iter().map(|piece| Curve::new(&line, piece));
            let roots: Vec<_> = curves.flat_map(|curve| line.roots(&curve)).collect();
            assert!(!roots.is_empty(), "{dy}");
            let all = roots.len();
            (
                all,
                roots.iter().filter(|root| root.branch().is_some()).count(),
            )
        };
        for dy in [1e-3, -1e-12, 1e-300] {
            let (all, by_branches) = branches(dy);
            assert_eq!(all, by_branches, "{dy}");
        }
        for dy in [0.0, 0.02, -0.1] {
            assert_eq!(branches(dy).1, 0, "{dy}");
        }
    }
}
