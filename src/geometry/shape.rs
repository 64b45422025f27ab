//! The closed set of shapes.

use super::bounds::{Aabb, Bounding};
use super::hit::{Crossing, Hit};
use super::planar::{Disc, Plane, Quad};
use super::ray::Ray;
use super::revolution::{Revolution, Solver};
use super::sphere::Sphere;
use crate::numeric::work::Work;

/// A surface that rays can meet.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a scene has few shapes and none is moved after loading"
)]
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
