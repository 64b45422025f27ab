//! Random rays aimed at the six-piece cup, the reference surface of the solver experiments.

use crate::geometry::ray::Ray;
use crate::numeric::rng::Stream;
use glam::DVec3;
use std::f64::consts::TAU;

/// Distance from which rays are aimed.
const DISTANCE: f64 = 10.0;
/// Greatest radius of the cup.
const RADIUS: f64 = 3.8;
/// Greatest control height of the cup.
const HEIGHT: f64 = 2.2;

/// A ray from a uniform point of the sphere of radius 10 about the cup's middle towards a uniform point of its bounding cylinder.
pub fn random_ray(stream: &mut Stream) -> Ray {
    let y = stream.range(-1.0, 1.0);
    let (sin, cos) = libm::sincos(TAU * stream.uniform());
    let ring = (1.0 - y * y).sqrt();
    let middle = DVec3::new(0.0, HEIGHT / 2.0, 0.0);
    let origin = middle + DISTANCE * DVec3::new(ring * sin, y, ring * cos);
    let (sin, cos) = libm::sincos(TAU * stream.uniform());
    let radius = RADIUS * stream.uniform().sqrt();
    let target = DVec3::new(radius * sin, HEIGHT * stream.uniform(), radius * cos);
    Ray::new(origin, (target - origin).normalize())
}
