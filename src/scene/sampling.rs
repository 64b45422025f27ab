//! Maps from the unit square to the distributions that rendering needs.

use crate::geometry::planar::tangents;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Uniform by area on the unit disc: the concentric map (Shirley and Chiu 1997). (½, ½) goes to the centre.
pub fn uniform_disc(u: [f64; 2]) -> DVec2 {
    let a = 2.0 * u[0] - 1.0;
    let b = 2.0 * u[1] - 1.0;
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    let (radius, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, 2.0 * FRAC_PI_4 - FRAC_PI_4 * (a / b))
    };
    let (sin, cos) = libm::sincos(angle);
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
    let disc = uniform_disc(u);
    let (s, t) = tangents(normal);
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
