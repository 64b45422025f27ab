//! Bounding volumes: axis-aligned box and the cylinder around a profile.

use glam::DVec3;

/// Axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner of least coordinates.
    pub min: DVec3,
    /// Corner of greatest coordinates.
    pub max: DVec3,
}
