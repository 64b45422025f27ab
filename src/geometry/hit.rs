//! Where a ray meets a surface.

use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A solution of ray = surface, before anything else is worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Ray parameter.
    pub t: f64,
    /// Piece of the profile (0 for shapes without pieces).
    pub piece: u32,
    /// Parameter within the piece, in [0, 1] (0 for shapes without a profile).
    pub u: f64,
}

/// Where on its surface a hit lies, as far as textures ask. Few hits are asked, and an angle costs an arcus tangent: so it is worked
/// out by [`Hit::theta`] and [`Hit::st`] only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Chart {
    /// On a planar shape: the texture coordinates (s, t).
    Flat(DVec2),
    /// On a sphere or revolution.
    Round {
        /// Sine of the azimuth.
        sin: f64,
        /// Cosine of the azimuth.
        cos: f64,
        /// The texture coordinate t.
        t: f64,
    },
}

/// A point of a surface met by a ray, with all that shading and the next ray need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// World point, put on the surface itself (not merely on the ray).
    pub point: DVec3,
    /// Unit geometric normal, on the surface's own side (outward for sphere and revolution); not turned towards the ray.
    pub normal: DVec3,
    /// Bound of the distance between `point` and the exact surface, world units.
    pub error: f64,
    /// Index of the object in the scene; a shape by itself says 0.
    pub object: usize,
    /// Piece of the profile (0 for shapes without pieces).
    pub piece: u32,
    /// Parameter within the piece, in [0, 1]; for other shapes the texture coordinate t of a sphere or s of a planar shape.
    pub u: f64,
    /// Place for textures.
    pub chart: Chart,
}

/// One side of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side to which the normal points.
    Front,
    /// The other side.
    Back,
}

impl Side {
    /// The side across the surface.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Front => Self::Back,
            Self::Back => Self::Front,
        }
    }

    /// 1 for the front, −1 for the back.
    pub fn sign(self) -> f64 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }
}

/// The start of a next ray stands off the surface by this many bounds of the hit's error: one for the hit itself, one for the
/// error of the same surface met again from nearby, and as much again for the rounding of the new origin.
/// Below two the ray may start on the wrong side (experiment `eps` shows the cliff).
pub const OFFSET_IN_ERRORS: f64 = 4.0;

impl Hit {
    /// Azimuth atan2(x, z) in [0, 2π) for revolution and sphere, 0 for planar shapes.
    pub fn theta(&self) -> f64 {
        match self.chart {
            Chart::Flat(_) => 0.0,
            Chart::Round { sin, cos, .. } => azimuth(sin, cos),
        }
    }

    /// Texture coordinates (s, t); see the scene file's description.
    pub fn st(&self) -> DVec2 {
        match self.chart {
            Chart::Flat(st) => st,
            Chart::Round { t, .. } => DVec2::new(self.theta() / TAU, t),
        }
    }

    /// The side on which a ray along `direction` arrives; the front for a ray in the tangent plane.
    pub fn side_met(&self, direction: DVec3) -> Side {
        if self.normal.dot(direction) > 0.0 {
            Side::Back
        } else {
            Side::Front
        }
    }

    /// The unit normal that points to a side.
    pub fn normal_on(&self, side: Side) -> DVec3 {
        side.sign() * self.normal
    }

    /// The normal on the side from which `direction` arrives.
    pub fn facing_normal(&self, direction: DVec3) -> DVec3 {
        self.normal_on(self.side_met(direction))
    }

    /// The point moved along the normal by `errors` times the hit's error.
    pub fn offset(&self, errors: f64) -> DVec3 {
        self.point + errors * self.error * self.normal
    }

    /// The point [`OFFSET_IN_ERRORS`] off the surface. It is on that side of the hit's own sheet wherever the sheet is flat over
    /// some bounds of the error; what else is near, and what a kink does, only the shape knows
    /// ([`Shape::leave`](super::shape::Shape::leave)).
    pub fn beside(&self, side: Side) -> DVec3 {
        self.offset(side.sign() * OFFSET_IN_ERRORS)
    }
}

/// atan2(x, z) in [0, 2π).
pub(crate) fn azimuth(x: f64, z: f64) -> f64 {
    let theta = libm::atan2(x, z);
    if theta >= 0.0 {
        return theta;
    }
    let turned = theta + TAU;
    if turned < TAU { turned } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A direction within the surface comes neither from behind nor from before: it counts as met from the front.
    #[test]
    fn sides_are_those_of_the_normal() {
        let hit = Hit {
            t: 3.0,
            point: DVec3::new(0.0, 2.0, 0.0),
            normal: DVec3::Y,
            error: 1e-3,
            object: 0,
            piece: 0,
            u: 0.0,
            chart: Chart::Flat(DVec2::ZERO),
        };
        for (direction, side) in [
            (DVec3::X, Side::Front),
            (DVec3::new(0.6, 0.8, 0.0), Side::Back),
            (DVec3::new(0.6, -0.8, 0.0), Side::Front),
        ] {
            assert_eq!(hit.side_met(direction), side);
            assert_eq!(hit.facing_normal(direction), side.sign() * DVec3::Y);
            let start = hit.beside(side);
            assert!((start.y - 2.0 - side.sign() * 4e-3).abs() < 1e-15);
            assert!((hit.beside(side.other()).y + start.y - 4.0).abs() < 1e-15);
        }
    }
}
