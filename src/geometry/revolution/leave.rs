//! Where the next ray starts: on the right side of the surface, with proof.

use super::clearance::{Arc, Clearance};
use super::edge::{AT_A_JOINT, neighbour};
use super::{Revolution, Solver};
use crate::geometry::hit::{Crossing, Hit, OFFSET_IN_ERRORS, Side};
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use glam::DVec3;

/// The standard offset keeps to its side if nothing else is nearer than this many bounds of the hit's error: four for the offset,
/// one for the hit, one for the rounding of the new origin; the rest is margin for the bounds that [`Clearance`] compares.
const REACH_IN_ERRORS: f64 = 16.0;

/// Distances, in bounds of the hit's error, at which a start is looked for: down to where roundings merge it with the surface (the
/// bound is some fifty of them), and up to what a picture cannot show.
const TRIED_IN_ERRORS: [f64; 7] = [OFFSET_IN_ERRORS, 1.0, 0.25, 0.0625, 0.015_625, 16.0, 64.0];

/// A crossing flatter than this (cosine to the normal) does not say from which side a probe arrives.
const LEAST_COSINE: f64 = 0.1;

/// Crossings of a probe nearer to each other than this share of the profile's size may come in the wrong order from f64.
const ORDER_IN_SIZES: f64 = 64.0 * f64::EPSILON;

/// Pieces that a walk along the profile passes before two points count as far apart.
const MOST_PIECES: usize = 4;

impl Revolution {
    /// The ray that leaves `hit` on a side, along `direction`.
    ///
    /// **What is proven.** Let p be its origin as the solvers see it: its image in the profile's frame, with the roundings on the
    /// way there. The exact surface has no point between p and the hit's own sheet, and p lies on that side of it. For a closed
    /// profile that does not cut itself this is membership: p is outside on the front, inside on the back. So a certified solver
    /// neither meets the sheet that the ray leaves nor skips another one.
    ///
    /// Where the profile is clear around the hit (`Clearance`), the hit's error bound proves it. Elsewhere (joints, cusps, the
    /// axis, thin walls) a probe decides: a short ray from the start back to the surface must meet this sheet first, from this
    /// side; the solver's exact arithmetic decides what its rounding cannot. If it does not, starts nearer and farther, along the
    /// normal, along the ray, and between the normals of a joint, are tried.
    ///
    /// What no start separates is counted in [`Work::unseparated`], and the standard start returned. Not promised: the side of
    /// other objects, and the side that `hit` was met on where the ray was tangent to within rounding.
    pub fn leave(&self, hit: &Hit, side: Side, direction: DVec3, work: &mut Work) -> Ray {
        Ray::new(self.start(hit, side, direction, work), direction)
    }

    fn start(&self, hit: &Hit, side: Side, direction: DVec3, work: &mut Work) -> DVec3 {
        let standard = hit.beside(side);
        if self.clearance().holds(hit.piece, hit.u) {
            return standard;
        }
        work.starts_tested += 1;
        let normal = hit.normal_on(side);
        let between = self.normal_of_joint(hit, side);
        let ways = [
            (normal, normal),
            (direction.normalize_or(normal), normal),
            (between, between),
        ];
        let tried = TRIED_IN_ERRORS.iter().flat_map(|&errors| {
            ways.map(|(way, away)| (hit.point + errors * hit.error * way, away))
        });
        for (start, away) in tried {
            if self.is_beside(hit, side, start, away, work) {
                return start;
            }
        }
        work.unseparated += 1;
        standard
    }

    fn clearance(&self) -> &Clearance {
        let reach = REACH_IN_ERRORS * self.error / self.placement.scale;
        self.clearance
            .get_or_init(|| Clearance::new(&self.profile, reach))
    }

    /// Whether a probe from `start` against the unit vector `away` meets the sheet of the hit first, from this side.
    fn is_beside(&self, hit: &Hit, side: Side, start: DVec3, away: DVec3, work: &mut Work) -> bool {
        let reach = 2.0 * (start - hit.point).length() + OFFSET_IN_ERRORS * hit.error;
        // A sheet that the start lies on is met at 0.
        let probe = Ray {
            t_min: -f64::MIN_POSITIVE,
            ..Ray::new(start, -away).until(reach)
        };
        let (radius, height) = self.profile.control_size();
        let in_doubt = ORDER_IN_SIZES * self.placement.scale * (radius + height);
        let mut met = self.crossings(&probe, &Solver::Bernstein, work);
        if matches!(*met, [first, second, ..] if second.t - first.t <= in_doubt) {
            met = self.crossings(&probe, &Solver::Exact, work);
        }
        match *met {
            [] => false,
            [first, second, ..] if second.t == first.t => false,
            [first, ..] => {
                first.t > 0.0
                    && self.arrives_on(side, &probe, first)
                    && self.is_same_sheet(hit, first, reach)
            }
        }
    }

    /// Whether the probe certainly arrives on a side of the sheet that it meets; at a joint, of both.
    fn arrives_on(&self, side: Side, probe: &Ray, crossing: Crossing) -> bool {
        let on_side = |crossing| {
            let normal = side.sign() * self.normal_at(probe, crossing);
            normal.dot(probe.direction) < -LEAST_COSINE
        };
        let near_end = crossing.u.min(1.0 - crossing.u) < AT_A_JOINT;
        let neighbour = neighbour(&self.profile, crossing.piece, crossing.u);
        on_side(crossing)
            && (!near_end
                || neighbour.is_none_or(|(piece, u)| {
                    on_side(Crossing {
                        piece,
                        u,
                        ..crossing
                    })
                }))
    }

    /// Whether the profile leads from the hit to a crossing without leaving their neighbourhood; `reach` bounds their distance in
    /// the world.
    fn is_same_sheet(&self, hit: &Hit, crossing: Crossing, reach: f64) -> bool {
        let near = 4.0 * reach / self.placement.scale;
        let station = self.profile.pieces()[hit.piece as usize].at(hit.u);
        let center = [station.radius, station.height];
        [0.0, 1.0].into_iter().any(|end| {
            let (mut piece, mut u) = (hit.piece, hit.u);
            for _ in 0..MOST_PIECES {
                let arc = Arc::of(&self.profile.pieces()[piece as usize]);
                let stays = |to: f64| arc.between([u, to]).distance_from(center) <= near;
                if piece == crossing.piece && stays(crossing.u) {
                    return true;
                }
                if !stays(end) {
                    return false;
                }
                match neighbour(&self.profile, piece, end) {
                    Some(next) => (piece, u) = next,
                    None => return false,
                }
            }
            false
        })
    }

    /// The unit vector between the hit's normal and that of the piece beyond the nearer end of its own.
    fn normal_of_joint(&self, hit: &Hit, side: Side) -> DVec3 {
        let normal = hit.normal_on(side);
        let Some((piece, u)) = neighbour(&self.profile, hit.piece, hit.u) else {
            return normal;
        };
        let at_hit = Ray::new(hit.point, normal);
        let crossing = Crossing { t: 0.0, piece, u };
        let other = side.sign() * self.normal_at(&at_hit, crossing);
        (normal + other).normalize_or(normal)
    }
}
