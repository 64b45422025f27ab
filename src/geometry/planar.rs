//! Flat shapes: quad (parallelogram), plane and disc.

use super::bounds::Aabb;
use super::hit::{Crossing, Hit};
use super::ray::Ray;
use glam::{DVec2, DVec3};

/// The parallelogram `corner + s edge_u + t edge_v`, s and t in [0, 1]; normal along `edge_u × edge_v`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Corner s = t = 0.
    pub corner: DVec3,
    /// Edge along s.
    pub edge_u: DVec3,
    /// Edge along t; not parallel to `edge_u`.
    pub edge_v: DVec3,
}

/// The infinite plane through `point`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane, where the texture coordinates are 0.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// A disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre.
    pub center: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Radius, > 0.
    pub radius: f64,
}

/// Parameter of the ray's crossing with the plane through `point`, if it lies inside the ray's open range.
/// A ray in or parallel to the plane has none. The normal may have any length.
fn plane_crossing(ray: &Ray, point: DVec3, normal: DVec3) -> Option<f64> {
    if !ray.is_valid() {
        return None;
    }
    let t = (point - ray.origin).dot(normal) / ray.direction.dot(normal);
    ray.contains(t).then_some(t)
}

fn flat_hit(ray: &Ray, crossing: Crossing, anchor: DVec3, normal: DVec3, st: DVec2) -> Hit {
    let on_ray = ray.at(crossing.t);
    let point = on_ray + (anchor - on_ray).dot(normal) * normal;
    // The projection leaves a distance of a few roundings of the coordinates it is computed from.
    let size = point.abs().max_element() + anchor.abs().max_element() + (point - anchor).length();
    let error = 8.0 * f64::EPSILON * size;
    Hit {
        t: crossing.t,
        point,
        normal,
        error,
        object: 0,
        piece: 0,
        u: st.x,
        theta: 0.0,
        st,
    }
}

fn crossing(t: f64) -> Crossing {
    Crossing {
        t,
        piece: 0,
        u: 0.0,
    }
}

impl Quad {
    /// Unit normal.
    pub fn normal(&self) -> DVec3 {
        self.edge_u.cross(self.edge_v).normalize()
    }

    /// Area.
    pub fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    /// The crossing inside the ray's open range; the border belongs to the quad.
    pub fn nearest(&self, ray: &Ray) -> Option<Crossing> {
        let t = plane_crossing(ray, self.corner, self.edge_u.cross(self.edge_v))?;
        let st = self.coordinates(ray.at(t));
        let inside = (0.0..=1.0).contains(&st.x) && (0.0..=1.0).contains(&st.y);
        inside.then(|| crossing(t))
    }

    fn coordinates(&self, point: DVec3) -> DVec2 {
        let across = self.edge_u.cross(self.edge_v);
        let from_corner = point - self.corner;
        let scale = across.length_squared();
        DVec2::new(
            from_corner.cross(self.edge_v).dot(across) / scale,
            self.edge_u.cross(from_corner).dot(across) / scale,
        )
    }

    /// The full hit of a crossing.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let st = self
            .coordinates(ray.at(crossing.t))
            .clamp(DVec2::ZERO, DVec2::ONE);
        flat_hit(ray, crossing, self.corner, self.normal(), st)
    }

    /// World bounds.
    pub fn bounds(&self) -> Aabb {
        let corners = [
            self.corner,
            self.corner + self.edge_u,
            self.corner + self.edge_v,
            self.corner + self.edge_u + self.edge_v,
        ];
        let min = corners
            .into_iter()
            .reduce(DVec3::min)
            .unwrap_or(self.corner);
        let max = corners
            .into_iter()
            .reduce(DVec3::max)
            .unwrap_or(self.corner);
        Aabb { min, max }
    }
}

impl Plane {
    /// The crossing inside the ray's open range.
    pub fn nearest(&self, ray: &Ray) -> Option<Crossing> {
        plane_crossing(ray, self.point, self.normal).map(crossing)
    }

    /// The full hit of a crossing. Texture coordinates are in world units along two fixed axes of the plane.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let mut hit = flat_hit(ray, crossing, self.point, self.normal, DVec2::ZERO);
        let (s_axis, t_axis) = tangents(self.normal);
        let from_point = hit.point - self.point;
        hit.st = DVec2::new(from_point.dot(s_axis), from_point.dot(t_axis));
        hit.u = hit.st.x;
        hit
    }
}

impl Disc {
    /// The crossing inside the ray's open range; the border belongs to the disc.
    pub fn nearest(&self, ray: &Ray) -> Option<Crossing> {
        let t = plane_crossing(ray, self.center, self.normal)?;
        let inside = (ray.at(t) - self.center).length_squared() <= self.radius * self.radius;
        inside.then(|| crossing(t))
    }

    /// The full hit of a crossing. Texture coordinates run over the bounding square.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let (s_axis, t_axis) = tangents(self.normal);
        let from_center = (ray.at(crossing.t) - self.center) / (2.0 * self.radius);
        let st = DVec2::new(0.5 + from_center.dot(s_axis), 0.5 + from_center.dot(t_axis));
        flat_hit(
            ray,
            crossing,
            self.center,
            self.normal,
            st.clamp(DVec2::ZERO, DVec2::ONE),
        )
    }

    /// World bounds.
    pub fn bounds(&self) -> Aabb {
        let n = self.normal;
        let reach = self.radius * (DVec3::ONE - n * n).max(DVec3::ZERO).map(f64::sqrt);
        Aabb {
            min: self.center - reach,
            max: self.center + reach,
        }
    }
}

/// Two unit vectors that make a right-handed frame (s, t, normal). For a normal along +y they are +x and −z: seen from above
/// with z towards the viewer, s runs right and t runs up.
pub fn tangents(normal: DVec3) -> (DVec3, DVec3) {
    let helper = if normal.y.abs() > 0.9 {
        DVec3::X
    } else {
        DVec3::Y
    };
    if normal.y.abs() > 0.9 {
        let s = (helper - normal * helper.dot(normal)).normalize();
        (s, normal.cross(s))
    } else {
        let s = helper.cross(normal).normalize();
        (s, normal.cross(s))
    }
}
