//! The closed forms of a thin lens, and two lenses to hold against them.

use crate::geometry::ray::Ray;
use crate::scene::camera::{Camera, CameraDescription};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Radius of the lens of the scenes of this experiment.
pub(super) const APERTURE: f64 = 0.25;
/// Its distance of focus.
pub(super) const FOCUS: f64 = 6.0;
/// The film of [`CAMERA`], pixels.
pub(super) const FILM: DVec2 = DVec2::new(64.0, 48.0);

/// A camera without special position and a wide view, so that corners are far off the axis.
pub(super) const CAMERA: CameraDescription = CameraDescription {
    eye: DVec3::new(1.0, 2.0, 3.0),
    target: DVec3::new(-2.0, 1.0, -4.0),
    up: DVec3::Y,
    vertical_fov_deg: 60.0,
    lens_radius: APERTURE,
    focus_distance: FOCUS,
};

/// The ray of a film point and a lens point.
pub(super) type Lens = fn(&CameraDescription, DVec2, [f64; 2]) -> Ray;

/// The project's lens.
pub(super) fn thin(camera: &CameraDescription, film: DVec2, lens: [f64; 2]) -> Ray {
    Camera::new(camera).ray(film, FILM, lens)
}

/// The lens of the course project this testbed grew out of: the origin moves on a sphere's shell, by two angles each drawn
/// evenly, and the direction stays.
pub(super) fn original(camera: &CameraDescription, film: DVec2, lens: [f64; 2]) -> Ray {
    let ray = through_the_center(camera, film);
    let (around, down) = (libm::sincos(TAU * lens[0]), libm::sincos(PI * lens[1]));
    let offset = DVec3::new(around.1 * down.0, around.0 * down.0, down.1);
    Ray::new(ray.origin + camera.lens_radius * offset, ray.direction)
}

/// The ray through the centre of the lens.
pub(super) fn through_the_center(camera: &CameraDescription, film: DVec2) -> Ray {
    thin(camera, film, [0.5; 2])
}

/// Where a ray crosses the plane at this depth along the view axis.
pub(super) fn at_depth(camera: &CameraDescription, ray: &Ray, depth: f64) -> DVec3 {
    let forward = (camera.target - camera.eye).normalize();
    let before = depth - (ray.origin - camera.eye).dot(forward);
    ray.at(before / ray.direction.dot(forward))
}

/// Radius of blur on the plane of focus of what lies at this depth.
pub(super) fn blur(depth: f64) -> f64 {
    APERTURE * (depth - FOCUS).abs() / depth
}

/// Share of a uniform disc of radius 1 that lies on one side of a line `x` from its centre, the side with the centre for x > 0.
pub(super) fn share(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.5 + (x * (1.0 - x * x).sqrt() + libm::asin(x)) / PI
}

/// Places and weights of Gauss's rule with four points on [−½, ½] (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (-0.430_568_155_797_026_3, 0.173_927_422_568_726_93),
    (-0.169_990_521_792_428_13, 0.326_072_577_431_273_07),
    (0.169_990_521_792_428_13, 0.326_072_577_431_273_07),
    (0.430_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The mean of a smooth function over a square pixel of this side about a place.
pub(super) fn over_pixel(center: DVec2, side: f64, value: impl Fn(DVec2) -> f64) -> f64 {
    let mut mean = 0.0;
    for (x, along) in GAUSS {
        for (y, up) in GAUSS {
            mean += along * up * value(center + side * DVec2::new(x, y));
        }
    }
    mean
}

/// The mean of a smooth function over a disc of this radius: Simpson's rule in ρ² (64 steps), 64 places in angle.
pub(super) fn over_disc(center: DVec2, radius: f64, value: impl Fn(DVec2) -> f64) -> f64 {
    const STEPS: usize = 64;
    let ring = |step: usize| {
        let reach = radius * (step as f64 / STEPS as f64).sqrt();
        let at = |place: usize| {
            let (sin, cos) = libm::sincos(TAU * place as f64 / STEPS as f64);
            value(center + reach * DVec2::new(cos, sin))
        };
        (0..STEPS).map(at).sum::<f64>() / STEPS as f64
    };
    let weight = |step: usize| match step {
        0 | STEPS => 1.0,
        _ if step % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=STEPS).map(|step| weight(step) * ring(step)).sum();
    sum / (3.0 * STEPS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_forms_have_their_known_values() {
        assert!((share(0.5) - 0.804_499).abs() < 1e-6);
        assert_eq!((share(-2.0), share(0.0), share(3.0)), (0.0, 0.5, 1.0));
        assert_eq!((blur(FOCUS), blur(3.0)), (0.0, APERTURE));
        assert!((blur(1e9) - APERTURE).abs() < 1e-8);
    }

    #[test]
    fn the_rules_of_quadrature_are_right() {
        let center = DVec2::new(0.3, -0.2);
        let square = |p: DVec2| p.x * p.x + 3.0 * p.y;
        let pixel = over_pixel(center, 0.5, square);
        assert!((pixel - (0.09 + 0.25 / 12.0 - 0.6)).abs() < 1e-15);
        let disc = over_disc(center, 0.5, square);
        assert!((disc - (0.09 + 0.25 / 4.0 - 0.6)).abs() < 1e-15);
        // (h² + ρ²)^(−3/2) over a disc about its axis: 2/R² (1/h − 1/√(h² + R²)).
        let falling = |p: DVec2| 1.0 / libm::pow(1.0 + p.length_squared(), 1.5);
        let exact = 2.0 / 0.25 * (1.0 - 1.0 / 1.25_f64.sqrt());
        assert!((over_disc(DVec2::ZERO, 0.5, falling) - exact).abs() < 1e-10);
    }
}
