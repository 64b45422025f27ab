//! The ray.

use glam::DVec3;

/// The points `origin + t direction` with `t_min < t < t_max`.
///
/// `direction` need not be a unit vector; `t` is in units of `direction`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where t = 0.
    pub origin: DVec3,
    /// Change of the point for a change of 1 in t.
    pub direction: DVec3,
    /// Open lower end of the range of t.
    pub t_min: f64,
    /// Open upper end of the range of t; may be infinite.
    pub t_max: f64,
}

impl Ray {
    /// A ray with the range (0, ∞).
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f64::INFINITY,
        }
    }

    /// The same ray that ends before `t_max`.
    #[must_use]
    pub fn until(self, t_max: f64) -> Self {
        Self { t_max, ..self }
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    /// Whether `t` lies in the open range.
    pub fn contains(&self, t: f64) -> bool {
        self.t_min < t && t < self.t_max
    }

    /// Whether a shape may be asked about this ray: finite origin, finite non-zero direction, and a range that is not NaN.
    /// Every shape answers "no hit" to any other ray.
    pub fn is_valid(&self) -> bool {
        self.origin.is_finite()
            && self.direction.is_finite()
            && self.direction != DVec3::ZERO
            && self.t_min < self.t_max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_is_valid_if_something_lies_between_its_ends() {
        let ray = Ray::new(DVec3::ONE, DVec3::X);
        let between = |t_min, t_max| Ray {
            t_min,
            t_max,
            ..ray
        };
        assert!(ray.is_valid() && between(1.0, 2.0).is_valid());
        assert!(!between(2.0, 1.0).is_valid() && !between(1.0, 1.0).is_valid());
        assert_eq!(
            [0.5, 1.0, 1.5, 2.0, 2.5].map(|t| between(1.0, 2.0).contains(t)),
            [false, false, true, false, false]
        );
        assert_eq!(ray.until(3.0), between(0.0, 3.0));
        assert_eq!(ray.at(2.5), DVec3::new(3.5, 1.0, 1.0));
    }
}
