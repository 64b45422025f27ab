//! Which piece a ray meets at a sharp edge.
//!
//! A root within rounding of a joint may be reported on either piece. Where both face the ray, or both face away, either is as
//! good. Where the profile has a corner and only one faces the ray, the choice says from which side the surface is met, and a
//! wrong one would let a path through it.

use super::{Revolution, exact, local_normal, meridian};
use crate::geometry::hit::Crossing;
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use glam::DVec3;

/// A parameter this near to a joint may belong to either piece.
pub(super) const AT_A_JOINT: f64 = 1e-12;

/// Crossings this near to each other, in sizes of the problem, are the same one, or the two of a corner that the ray clips.
const NEAR_IN_SIZES: f64 = 1e-10;

/// So are those nearer to the joint than this on their piece: more than 1e-10 of a size at an end of speed 0.
const NEAR_IN_U: f64 = 1e-3;

impl Revolution {
    /// The unit normal at a crossing of a ray, as the piece has it that the crossing names.
    pub(super) fn normal_at(&self, ray: &Ray, crossing: Crossing) -> DVec3 {
        let local = self.placement.ray_to_local(ray).at(crossing.t);
        let (sin, cos) = meridian(local.x, local.z);
        let piece = &self.profile.pieces()[crossing.piece as usize];
        self.placement.rotation * local_normal(piece, crossing.u, sin, cos)
    }

    /// The crossing on the piece that says rightly from which side the ray arrives.
    #[inline]
    pub(super) fn faced(&self, ray: &Ray, crossing: Crossing) -> Crossing {
        if crossing.u.min(1.0 - crossing.u) < AT_A_JOINT {
            self.at_edge(ray, crossing)
        } else {
            crossing
        }
    }

    /// Of two pieces of which one faces the ray, the one that the ray meets at the crossing's t, exactly. One that meets both there
    /// clips the edge or touches it: a convex one from the front, a concave one from the back.
    #[cold]
    fn at_edge(&self, ray: &Ray, crossing: Crossing) -> Crossing {
        let Some((piece, u)) = neighbour(&self.profile, crossing.piece, crossing.u) else {
            return crossing;
        };
        let other = Crossing {
            piece,
            u,
            ..crossing
        };
        let faces = |crossing| self.normal_at(ray, crossing).dot(ray.direction) <= 0.0;
        if faces(crossing) == faces(other) {
            return crossing;
        }
        let local = self.placement.ray_to_local(ray);
        let (own, others) = (
            self.met_alone(&local, crossing),
            self.met_alone(&local, other),
        );
        let (Some(own), Some(others)) = (own, others) else {
            return others.filter(|_| own.is_none()).unwrap_or(crossing);
        };
        let off = |met: Crossing| (met.t - crossing.t).abs();
        // The crossing's own t is off by as much as the nearer one says, at least.
        let rounding = 4.0 * f64::EPSILON * self.time_in_sizes(&local);
        let told_apart = (own.t - others.t).abs() > 2.0 * off(own).min(off(others)) + rounding;
        let wants_other = if told_apart {
            off(others) < off(own)
        } else {
            faces(crossing) != self.is_convex(crossing, other)
        };
        if wants_other { other } else { crossing }
    }

    /// The exact crossing of a ray in the profile's frame with this piece by itself that is the same as the one given but for
    /// roundings, or the other one of a corner that the ray clips.
    fn met_alone(&self, local: &Ray, crossing: Crossing) -> Option<Crossing> {
        let piece = self.profile.pieces()[crossing.piece as usize];
        let alone = Profile::new(vec![piece]).ok()?;
        let near = NEAR_IN_SIZES * self.time_in_sizes(local);
        let off = |met: &Crossing| (met.t - crossing.t).abs();
        exact::crossings(&alone, local)
            .into_iter()
            .filter(|met| off(met) <= near && (met.u - crossing.u).abs() <= NEAR_IN_U)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .map(|met| Crossing {
                piece: crossing.piece,
                ..met
            })
    }

    /// Change of t over the size of the problem: the origin's distance and the profile's own size.
    fn time_in_sizes(&self, local: &Ray) -> f64 {
        let (radius, height) = self.profile.control_size();
        (local.origin.length() + radius + height) / local.direction.length()
    }

    /// Whether the two normals at a joint lean away from each other.
    fn is_convex(&self, crossing: Crossing, other: Crossing) -> bool {
        let (first, second) = if crossing.u < 0.5 {
            (other, crossing)
        } else {
            (crossing, other)
        };
        let normal = |crossing: Crossing| {
            let piece = &self.profile.pieces()[crossing.piece as usize];
            local_normal(piece, crossing.u, 0.0, 1.0)
        };
        let (a, b) = (normal(first), normal(second));
        a.z * b.y - a.y * b.z > 0.0
    }
}

/// The piece beyond the end that is nearer to `u`, and its parameter there.
pub(super) fn neighbour(profile: &Profile, piece: u32, u: f64) -> Option<(u32, f64)> {
    let pieces = profile.pieces();
    let last = pieces.len() as u32 - 1;
    let closed = pieces[0].point(0) == pieces[last as usize].point(3);
    match (u < 0.5, piece) {
        (true, 0) => closed.then_some((last, 1.0)),
        (true, _) => Some((piece - 1, 1.0)),
        (false, _) if piece == last => closed.then_some((0, 0.0)),
        (false, _) => Some((piece + 1, 0.0)),
    }
}
