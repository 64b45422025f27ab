//! Random places, directions and sizes.

use crate::geometry::bounds::Cylinder;
use crate::numeric::rng::Stream;
use glam::DVec3;
use std::f64::consts::TAU;

/// A uniform point of a cylinder.
pub(super) fn inside(cylinder: &Cylinder, s: &mut Stream) -> DVec3 {
    let radius = cylinder.radius * s.uniform().sqrt();
    let around = level(s);
    let height = s.range(cylinder.bottom, cylinder.top);
    radius * around + DVec3::Y * height
}

/// A uniform unit vector.
pub(super) fn sphere(s: &mut Stream) -> DVec3 {
    let y = s.range(-1.0, 1.0);
    (1.0 - y * y).sqrt() * level(s) + DVec3::Y * y
}

/// A uniform unit vector perpendicular to the axis.
pub(super) fn level(s: &mut Stream) -> DVec3 {
    let (sin, cos) = libm::sincos(TAU * s.uniform());
    DVec3::new(sin, 0.0, cos)
}

/// ±x or ±z.
pub(super) fn quarter(s: &mut Stream) -> DVec3 {
    [DVec3::X, DVec3::Z, -DVec3::X, -DVec3::Z][pick(4, s.uniform())]
}

/// 1 or −1.
pub(super) fn sign(s: &mut Stream) -> f64 {
    if s.uniform() < 0.5 { -1.0 } else { 1.0 }
}

/// ±10ᵉ for e uniform between the exponents.
pub(super) fn small(s: &mut Stream, least: f64, most: f64) -> f64 {
    sign(s) * libm::exp10(s.range(least, most))
}

/// One of `count` ≥ 1 places by a uniform number.
pub(super) fn pick(count: usize, uniform: f64) -> usize {
    ((uniform * count as f64) as usize).min(count - 1)
}
