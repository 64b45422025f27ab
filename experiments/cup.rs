//! The reference surface of the solver experiments: the six-piece cup, and random rays aimed at it.

use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::numeric::rng::Stream;
use glam::DVec3;
use std::f64::consts::TAU;

/// Control radii and heights of the cup: a solid that touches the axis at both ends, with a negative control radius, a kink of
/// 1.36° and pieces that are not monotone.
const PIECES: [Piece; 6] = [
    piece([0.0, 1.1, 1.2, 2.0], [0.04, 0.04, 0.0, 0.0]),
    piece([2.0, 2.2, 2.0, 1.9], [0.0, 0.0, 0.1, 0.15]),
    piece([1.9, 1.73, 0.4, 0.2], [0.15, 0.23, -0.2, 0.4]),
    piece([0.2, -0.1, 3.8, 3.8], [0.4, 1.3, 1.4, 2.0]),
    piece([3.8, 3.8, 3.6, 3.6], [2.0, 2.2, 2.2, 2.0]),
    piece([3.6, 3.6, 0.25, 0.0], [2.0, 1.9, 1.3, 1.3]),
];
/// Distance from which rays are aimed.
const DISTANCE: f64 = 10.0;
/// Greatest radius of the cup.
const RADIUS: f64 = 3.8;
/// Greatest control height of the cup.
const HEIGHT: f64 = 2.2;

const fn piece(radius: [f64; 4], height: [f64; 4]) -> Piece {
    Piece { radius, height }
}

/// The cup, in its own frame: base at height 0, rim near 2.15, greatest radius 3.8.
pub fn cup() -> Profile {
    Profile::new(PIECES.to_vec()).expect("the cup's pieces join exactly")
}

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
