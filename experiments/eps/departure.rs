//! Rays that leave the cup at one offset after another.

use super::{LEAST_COSINE, ON_THE_SHEET, Setting};
use crate::experiments::cup::random_ray;
use crate::geometry::hit::Hit;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::{Revolution, Solver};
use crate::numeric::rng::Stream;
use crate::numeric::work::Work;
use glam::DVec3;
use std::f64::consts::TAU;

/// A point of the cup from which a ray leaves.
pub(super) struct Departure {
    pub(super) hit: Hit,
    /// The point that the start is off from.
    pub(super) point: DVec3,
    /// Unit normal on the side of the ray.
    pub(super) normal: DVec3,
    pub(super) direction: DVec3,
    pub(super) cosine: f64,
}

/// Hits of random rays, each with a random direction on a random side; rays that miss give none.
pub(super) fn departure(
    surface: &Revolution,
    setting: &Setting,
    stream: &mut Stream,
    work: &mut Work,
) -> Option<Departure> {
    let ray = random_ray(stream);
    let hit = surface.hit(&ray, surface.nearest(&ray, &setting.solver, work)?);
    let normal = if stream.uniform() < 0.5 {
        hit.normal
    } else {
        -hit.normal
    };
    let cosine = stream.range(LEAST_COSINE, 1.0);
    let (sin, cos) = libm::sincos(TAU * stream.uniform());
    let (tangent, other) = normal.any_orthonormal_pair();
    let across = (1.0 - cosine * cosine).sqrt();
    Some(Departure {
        hit,
        point: if setting.point == "ray" {
            ray.at(hit.t)
        } else {
            hit.point
        },
        normal,
        direction: cosine * normal + across * (cos * tangent + sin * other),
        cosine,
    })
}

impl Departure {
    /// The certified start.
    pub(super) fn certified(&self, surface: &Revolution, work: &mut Work) -> Ray {
        let side = self.hit.side_met(-self.direction);
        surface.leave(&self.hit, side, self.direction, work)
    }

    pub(super) fn leave(&self, offset: f64) -> Ray {
        Ray::new(self.point + offset * self.normal, self.direction)
    }

    /// Whether the ray meets the piece it leaves within `reach` of the tangent plane.
    pub(super) fn meets_itself(
        &self,
        ray: &Ray,
        reach: f64,
        surface: &Revolution,
        solver: &Solver,
        work: &mut Work,
    ) -> bool {
        let near = ray.until(reach / self.cosine);
        let crossing = surface.nearest(&near, solver, work);
        crossing.is_some_and(|c| c.piece == self.hit.piece)
    }

    /// Whether another sheet lies between the surface's point and a start at this offset.
    pub(super) fn jumps_a_wall(&self, offset: f64, surface: &Revolution, work: &mut Work) -> bool {
        let mut path = Ray::new(self.hit.point, self.normal);
        path.t_min = ON_THE_SHEET;
        path.t_max = offset;
        surface.nearest(&path, &Solver::Bernstein, work).is_some()
    }
}
