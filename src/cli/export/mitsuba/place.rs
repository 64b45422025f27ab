//! How Mitsuba's shapes lie in the world, and their texture coordinates in ours.

use super::words::to_world;
use crate::geometry::planar::{Disc, Quad, tangents};
use crate::geometry::shape::Shape;
use crate::geometry::sphere::Sphere;
use glam::{DVec2, DVec3};

/// Distance of the two faces of what emits on both sides, in sizes of the object.
pub(super) const FACES_APART: f64 = 1e-4;

/// Where texture coordinates of Mitsuba's shape stand against ours: ours = scale × theirs + offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coordinates {
    pub(super) scale: DVec2,
    pub(super) offset: DVec2,
}

impl Coordinates {
    /// The same.
    pub(super) const OURS: Self = Self {
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
    };
}

/// The two faces of what emits on both sides: the front moved forward, the back backward.
pub(super) fn faces_apart(shape: &Shape) -> [Shape; 2] {
    let moved = |way: f64| match shape {
        Shape::Quad(quad) => {
            let size = quad.edge_u.length().max(quad.edge_v.length());
            let corner = quad.corner + 0.5 * way * FACES_APART * size * quad.normal();
            Shape::Quad(quad.moved_to(corner))
        }
        Shape::Disc(disc) => {
            let center = disc.center + way * FACES_APART * disc.radius * disc.normal;
            Shape::Disc(Disc { center, ..*disc })
        }
        Shape::Sphere(sphere) => {
            let radius = sphere.radius * (1.0 + way * FACES_APART);
            Shape::Sphere(Sphere { radius, ..*sphere })
        }
        Shape::Plane(_) | Shape::Revolution(_) => shape.clone(),
    };
    [moved(1.0), moved(-1.0)]
}

pub(super) fn is_rectangle(quad: &Quad) -> bool {
    let across = quad.edge_u.normalize().dot(quad.edge_v.normalize());
    // What 32 bits cannot tell from a right angle.
    across.abs() <= f64::from(f32::EPSILON)
}

/// Their rectangle is [−1, 1]² with (u, v) = (0, 0) at (−1, −1).
pub(super) fn rectangle_place(quad: &Quad) -> (&'static str, String, Coordinates) {
    let (half_u, half_v) = (0.5 * quad.edge_u, 0.5 * quad.edge_v);
    let center = quad.corner + half_u + half_v;
    let columns = [half_u, half_v, quad.normal(), center];
    ("rectangle", to_world(columns), Coordinates::OURS)
}

/// Their poles are on the z axis, u runs from x to y, and v from the pole at +z: so z, x, y are our y, z, x, and v is 1 − t.
pub(super) fn sphere_place(sphere: &Sphere) -> (&'static str, String, Coordinates) {
    let r = sphere.radius;
    let columns = [r * DVec3::Z, r * DVec3::X, r * DVec3::Y, sphere.center];
    let coordinates = Coordinates {
        scale: DVec2::new(1.0, -1.0),
        offset: DVec2::new(0.0, 1.0),
    };
    ("sphere", to_world(columns), coordinates)
}

pub(super) fn disc_place(disc: &Disc) -> (&'static str, String, Coordinates) {
    let (s_axis, t_axis) = tangents(disc.normal);
    let columns = [
        disc.radius * s_axis,
        disc.radius * t_axis,
        disc.normal,
        disc.center,
    ];
    ("disk", to_world(columns), Coordinates::OURS)
}
