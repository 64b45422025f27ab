//! Pinhole and thin-lens camera.
//!
//! The thin lens follows Cook, Porter and Carpenter, "Distributed ray tracing" (1984): a disc of `lens_radius` about the eye,
//! sampled uniformly by area; every ray of one film point aims at the same point of the plane of focus.

use super::sampling::uniform_disc;
use crate::geometry::ray::Ray;
use glam::{DVec2, DVec3};

/// Where the picture is taken from.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    tan_half_fov: f64,
    lens_radius: f64,
    focus_distance: f64,
}

/// The description of a camera, as in the scene file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraDescription {
    /// Centre of the lens.
    pub eye: DVec3,
    /// A point on the view axis.
    pub target: DVec3,
    /// Direction that is up in the picture; not parallel to the view axis.
    pub up: DVec3,
    /// Full vertical field of view, degrees, in (0, 180).
    pub vertical_fov_deg: f64,
    /// Radius of the lens, ≥ 0; 0 is a pinhole.
    pub lens_radius: f64,
    /// Distance of the plane of focus along the view axis, > 0; may be infinite.
    pub focus_distance: f64,
}

impl Camera {
    /// Sets the camera up. The description must be valid: the scene file's reader checks it.
    pub fn new(description: &CameraDescription) -> Self {
        let forward = (description.target - description.eye).normalize();
        let right = forward.cross(description.up).normalize();
        Self {
            eye: description.eye,
            right,
            up: right.cross(forward),
            forward,
            tan_half_fov: libm::tan(0.5 * description.vertical_fov_deg.to_radians()),
            lens_radius: description.lens_radius,
            focus_distance: description.focus_distance,
        }
    }

    /// The ray of a film point and a lens point.
    ///
    /// `film` is in pixels, x to the right from the left edge, y **down** from the top edge; `size` is the film's size in pixels.
    /// `lens` is in [0, 1)²; (½, ½) is the centre of the lens. The direction is a unit vector.
    pub fn ray(&self, film: DVec2, size: DVec2, lens: [f64; 2]) -> Ray {
        let x = (2.0 * film.x - size.x) / size.y * self.tan_half_fov;
        let y = (1.0 - 2.0 * film.y / size.y) * self.tan_half_fov;
        let through = self.forward + x * self.right + y * self.up;
        if self.lens_radius == 0.0 {
            return Ray::new(self.eye, through.normalize());
        }
        let disc = self.lens_radius * uniform_disc(lens);
        let origin = self.eye + disc.x * self.right + disc.y * self.up;
        if self.focus_distance == f64::INFINITY {
            return Ray::new(origin, through.normalize());
        }
        let focus = self.eye + self.focus_distance * through;
        Ray::new(origin, (focus - origin).normalize())
    }

    /// Centre of the lens.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Radius of the lens.
    pub fn lens_radius(&self) -> f64 {
        self.lens_radius
    }

    /// Distance of the plane of focus along the view axis; may be infinite.
    pub fn focus_distance(&self) -> f64 {
        self.focus_distance
    }

    /// The unit vectors to the right, up and forward of the picture.
    pub fn frame(&self) -> [DVec3; 3] {
        [self.right, self.up, self.forward]
    }

    /// Tangent of half the vertical field of view.
    pub fn tan_half_fov(&self) -> f64 {
        self.tan_half_fov
    }

    /// Side of a pixel on the plane at distance 1 from the eye, for a film of `height` pixels.
    pub fn pixel_size(&self, height: u32) -> f64 {
        2.0 * self.tan_half_fov / f64::from(height)
    }
}
