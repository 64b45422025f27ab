//! Maps from the unit square to the distributions that rendering needs.

use crate::geometry::planar::tangents;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Uniform by area on the unit disc: the concentric map (Shirley and Chiu 1997). (½, ½) goes to the centre.
pub fn uniform_disc(u: [f64; 2]) -> DVec2 {
    let (radius, angle) = concentric(u);
    on_disc(radius, libm::sincos(angle))
}

/// Radius, of either sign, and angle of [`uniform_disc`]: without a branch, for vector lanes.
#[inline(always)]
pub(crate) fn concentric(u: [f64; 2]) -> (f64, f64) {
    let a = 2.0 * u[0] - 1.0;
    let b = 2.0 * u[1] - 1.0;
    let flat = a.abs() > b.abs();
    let (radius, other) = if flat { (a, b) } else { (b, a) };
    // Of the centre any angle.
    let turn = FRAC_PI_4 * (other / if radius == 0.0 { 1.0 } else { radius });
    let angle = if flat { turn } else { 2.0 * FRAC_PI_4 - turn };
    (radius, angle)
}

/// The point of a disc at a radius, and at an angle whose sine and cosine these are.
#[inline(always)]
pub(crate) fn on_disc(radius: f64, (sin, cos): (f64, f64)) -> DVec2 {
    radius * DVec2::new(cos, sin)
}

/// Uniform on the unit sphere.
pub fn uniform_sphere(u: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * u[1]);
    DVec3::new(r * cos, r * sin, z)
}

/// Cosine-weighted about the unit `normal` (Malley's method); density cosθ/π. Never exactly in the tangent plane.
pub fn cosine_hemisphere(normal: DVec3, u: [f64; 2]) -> DVec3 {
    above_disc(uniform_disc(u), tangents(normal), normal)
}

/// The direction of [`cosine_hemisphere`] whose foot is a point of the unit disc between these tangents.
#[inline(always)]
pub(crate) fn above_disc(disc: DVec2, (s, t): (DVec3, DVec3), normal: DVec3) -> DVec3 {
    let z = (1.0 - disc.length_squared()).max(f64::MIN_POSITIVE).sqrt();
    (disc.x * s + disc.y * t + z * normal).normalize()
}

/// Uniform in the cone about the unit `axis` whose half angle has the given 1 − cosine; density 1/(2π (1 − cosine)).
pub fn uniform_cone(axis: DVec3, one_minus_cos: f64, u: [f64; 2]) -> DVec3 {
    let drop = u[0] * one_minus_cos;
    let cos = 1.0 - drop;
    let sin = (drop * (1.0 + cos)).max(0.0).sqrt();
    let (s, t) = tangents(axis);
    let (across, along) = libm::sincos(TAU * u[1]);
    (sin * along * s + sin * across * t + cos * axis).normalize()
}

/// Density of [`cosine_hemisphere`] per solid angle for a direction at this cosine to the normal.
pub fn cosine_density(cos: f64) -> f64 {
    cos.max(0.0) / PI
}
