//! The closed set of shapes.

use super::bounds::{Aabb, Bounding};
use super::hit::{Crossing, Hit, OFFSET_IN_ERRORS, Side};
use super::planar::{Disc, Plane, Quad};
use super::ray::Ray;
use super::revolution::membership::Membership;
use super::revolution::{Revolution, Solver};
use super::sphere::Sphere;
use crate::numeric::work::Work;
use glam::DVec3;

/// A surface that rays can meet.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "few, not moved once loaded")]
pub enum Shape {
    /// Surface of revolution of a piecewise cubic Bezier profile.
    Revolution(Revolution),
    /// Sphere.
    Sphere(Sphere),
    /// Parallelogram.
    Quad(Quad),
    /// Infinite plane.
    Plane(Plane),
    /// Disc.
    Disc(Disc),
}

impl Shape {
    /// The nearest crossing inside the ray's open range, or `None`. `solver` matters to revolution surfaces only.
    pub fn nearest(&self, ray: &Ray, solver: &Solver, work: &mut Work) -> Option<Crossing> {
        work.surface_tests += 1;
        match self {
            Self::Revolution(shape) => shape.nearest(ray, solver, work),
            Self::Sphere(shape) => shape.nearest(ray),
            Self::Quad(shape) => shape.nearest(ray),
            Self::Plane(shape) => shape.nearest(ray),
            Self::Disc(shape) => shape.nearest(ray),
        }
    }

    /// The nearest crossing of each ray, to the bit as [`Shape::nearest`] gives it.
    ///
    /// # Panics
    /// If `found` is shorter than `rays`.
    pub fn nearest_many(
        &self,
        rays: &[Ray],
        solver: &Solver,
        found: &mut [Option<Crossing>],
        work: &mut Work,
    ) {
        if let Self::Revolution(shape) = self {
            work.surface_tests += rays.len() as u64;
            return shape.nearest_many(rays, solver, found, work);
        }
        for (ray, found) in rays.iter().zip(&mut found[..rays.len()]) {
            *found = self.nearest(ray, solver, work);
        }
    }

    /// A point of its plane, and the unit normal, if the shape is flat.
    pub fn flat(&self) -> Option<(DVec3, DVec3)> {
        match self {
            Self::Quad(quad) => Some((quad.corner, quad.normal())),
            Self::Plane(plane) => Some((plane.point, plane.normal)),
            Self::Disc(disc) => Some((disc.center, disc.normal)),
            Self::Sphere(_) | Self::Revolution(_) => None,
        }
    }

    /// Every crossing inside the ray's open range, by rising t. A tangency counts once.
    pub fn crossings(&self, ray: &Ray, solver: &Solver, work: &mut Work) -> Vec<Crossing> {
        work.surface_tests += 1;
        match self {
            Self::Revolution(shape) => shape.crossings(ray, solver, work),
            Self::Sphere(shape) => shape.crossings(ray),
            Self::Quad(shape) => shape.nearest(ray).into_iter().collect(),
            Self::Plane(shape) => shape.nearest(ray).into_iter().collect(),
            Self::Disc(shape) => shape.nearest(ray).into_iter().collect(),
        }
    }

    /// The full hit of a crossing that this shape returned for this ray.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        match self {
            Self::Revolution(shape) => shape.hit(ray, crossing),
            Self::Sphere(shape) => shape.hit(ray, crossing),
            Self::Quad(shape) => shape.hit(ray, crossing),
            Self::Plane(shape) => shape.hit(ray, crossing),
            Self::Disc(shape) => shape.hit(ray, crossing),
        }
    }

    /// The ray that leaves a hit of this shape on a side of it, along `direction`.
    ///
    /// It starts on that side, next to the hit's own sheet, with proof: see [`Revolution::leave`]; for the other shapes the bound
    /// of the hit's error is the proof. What cannot be separated (a sphere or a wall thinner than the rounding of its place) is
    /// counted in [`Work::unseparated`]. Not promised: that another object nearer than some bounds of the error is not jumped.
    pub fn leave(&self, hit: &Hit, side: Side, direction: DVec3, work: &mut Work) -> Ray {
        let start = match self {
            Self::Revolution(shape) => return shape.leave(hit, side, direction, work),
            Self::Sphere(shape) => {
                let depth = 2.0 * OFFSET_IN_ERRORS * hit.error;
                work.unseparated += u64::from(side == Side::Back && depth >= shape.radius);
                hit.beside(side)
            }
            Self::Quad(_) | Self::Plane(_) | Self::Disc(_) => hit.beside(side),
        };
        Ray::new(start, direction)
    }

    /// Whether a point lies inside: of a sphere, or of what a revolved profile encloses (see
    /// [`membership`](super::revolution::membership)). A point on the surface is not inside; other shapes have no inside.
    pub fn contains(&self, point: DVec3) -> bool {
        match self {
            Self::Revolution(shape) => shape.membership(point) == Membership::Inside,
            Self::Sphere(shape) => (point - shape.center).length() < shape.radius,
            Self::Quad(_) | Self::Plane(_) | Self::Disc(_) => false,
        }
    }

    /// The same shape behind another bounding volume, which matters to revolution surfaces only.
    #[must_use]
    pub fn bounded_by(self, kind: Bounding) -> Self {
        match self {
            Self::Revolution(shape) => Self::Revolution(shape.bounded_by(kind)),
            other => other,
        }
    }

    /// World bounds, or `None` for a shape without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        match self {
            Self::Revolution(shape) => Some(shape.bounds()),
            Self::Sphere(shape) => Some(shape.bounds()),
            Self::Quad(shape) => Some(shape.bounds()),
            Self::Plane(_) => None,
            Self::Disc(shape) => Some(shape.bounds()),
        }
    }
}
