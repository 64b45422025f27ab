//! Where a surface of revolution stands.

use crate::geometry::ray::Ray;
use glam::{DMat3, DVec3};

/// Where the surface stands: scale, then rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Translation.
    pub translate: DVec3,
    /// Rotation (orthonormal).
    pub rotation: DMat3,
    /// Uniform scale, > 0.
    pub scale: f64,
}

impl Placement {
    /// The profile's own frame.
    pub fn identity() -> Self {
        Self {
            translate: DVec3::ZERO,
            rotation: DMat3::IDENTITY,
            scale: 1.0,
        }
    }

    /// Scaled, then turned by `degrees` about `axis` (of any length, right-handed), then translated.
    ///
    /// An axis without a direction (zero or not finite) turns nothing. Multiples of 90 degrees about a coordinate axis are exact.
    pub fn new(translate: DVec3, axis: DVec3, degrees: f64, scale: f64) -> Self {
        Self {
            translate,
            rotation: rotation(axis, degrees),
            scale,
        }
    }

    /// The ray in the profile's own frame: the same t.
    #[inline]
    pub fn ray_to_local(&self, ray: &Ray) -> Ray {
        let inverse = 1.0 / self.scale;
        let turned = |v: DVec3| {
            let r = &self.rotation;
            inverse * DVec3::new(r.x_axis.dot(v), r.y_axis.dot(v), r.z_axis.dot(v))
        };
        Ray {
            origin: turned(ray.origin - self.translate),
            direction: turned(ray.direction),
            ..*ray
        }
    }

    /// A point of the profile's own frame in the world.
    pub fn point_to_world(&self, point: DVec3) -> DVec3 {
        self.translate + self.scale * (self.rotation * point)
    }
}

/// Rotation by Rodrigues' formula R = cos φ I + sin φ [k]× + (1 − cos φ) k kᵀ.
fn rotation(axis: DVec3, degrees: f64) -> DMat3 {
    let size = axis.abs().max_element();
    if !(size > 0.0 && axis.is_finite() && degrees.is_finite()) {
        return DMat3::IDENTITY;
    }
    let k = (axis / size).normalize();
    let (sin, cos) = sin_cos_degrees(degrees);
    let column = |e: DVec3| cos * e + sin * k.cross(e) + (1.0 - cos) * k.dot(e) * k;
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// Sine and cosine of an angle in degrees; exact at multiples of 90.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    // Both remainders are exact: the angle is reduced to [−45, 45] and a number of quarter turns.
    let turn = degrees % 360.0;
    let quarters = (turn / 90.0).round();
    let angle = (turn - 90.0 * quarters).to_radians();
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    match (quarters as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_exact() {
        for (degrees, expected) in [
            (90.0, DVec3::Z),
            (180.0, -DVec3::Y),
            (-90.0, -DVec3::Z),
            (450.0, DVec3::Z),
            (360.0, DVec3::Y),
        ] {
            let placement = Placement::new(DVec3::ZERO, 3.0 * DVec3::X, degrees, 1.0);
            assert_eq!(placement.rotation * DVec3::Y, expected);
        }
    }

    #[test]
    fn a_rotation_is_orthonormal_right_handed_and_keeps_its_axis() {
        let axis = DVec3::new(1.0, -2.0, 0.5);
        let r = Placement::new(DVec3::ZERO, axis, 37.0, 1.0).rotation;
        let identity = (r.transpose() * r - DMat3::IDENTITY).to_cols_array();
        assert!(identity.iter().all(|x| x.abs() < 1e-15));
        assert!((r.determinant() - 1.0).abs() < 1e-15);
        assert!((r * axis - axis).abs().max_element() < 1e-15);
        let turned = Placement::new(DVec3::ZERO, DVec3::Y, 30.0, 1.0).rotation * DVec3::Z;
        assert!((turned - DVec3::new(0.5, 0.0, libm::sqrt(0.75))).length() < 1e-15);
    }

    #[test]
    fn a_turn_of_any_number_of_degrees_has_its_sine_and_cosine() {
        for degrees in (-800..800).step_by(7).map(f64::from) {
            let (sin, cos) = sin_cos_degrees(degrees);
            let angle = degrees.to_radians();
            assert!((sin - libm::sin(angle)).abs() < 1e-14, "sin {degrees}°");
            assert!((cos - libm::cos(angle)).abs() < 1e-14, "cos {degrees}°");
        }
    }

    #[test]
    fn a_ray_and_its_image_meet_at_the_same_parameter() {
        let placement = Placement::new(DVec3::new(1.0, 2.0, 3.0), DVec3::ONE, 70.0, 4.0);
        let ray = Ray::new(DVec3::new(-5.0, 0.5, 2.0), DVec3::new(1.0, 2.0, -0.5));
        let local = placement.ray_to_local(&ray);
        for t in [0.0, 1.5, 20.0] {
            let there = placement.point_to_world(local.at(t));
            assert!((there - ray.at(t)).length() < 1e-13);
        }
        assert_eq!(Placement::identity().ray_to_local(&ray), ray);
    }

    #[test]
    fn an_axis_without_direction_turns_nothing() {
        for axis in [DVec3::ZERO, DVec3::NAN, DVec3::new(f64::INFINITY, 0.0, 0.0)] {
            let placement = Placement::new(DVec3::ZERO, axis, 30.0, 1.0);
            assert_eq!(placement.rotation, DMat3::IDENTITY);
        }
    }
}
