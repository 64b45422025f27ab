//! Flat shapes: quad (parallelogram), plane and disc.

use super::bounds::Aabb;
use super::hit::{Chart, Crossing, Hit};
use super::ray::Ray;
use glam::{DVec2, DVec3};

/// The parallelogram `corner + s edge_u + t edge_v`, s and t in [0, 1]; normal along `edge_u × edge_v`. Edges are between 1e-70 and
/// 1e70 long: products of four of them are numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Corner s = t = 0.
    pub corner: DVec3,
    /// Edge along s.
    pub edge_u: DVec3,
    /// Edge along t; not parallel to `edge_u`.
    pub edge_v: DVec3,
    /// Kept at unit length, so that shapes in one plane along the axes are met at the same t to the bit.
    normal: DVec3,
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
    /// Radius, between 1e-150 and 1e150: its square is a number.
    pub radius: f64,
}

/// Parameter of the ray's crossing with the plane through `point`, if it lies inside the ray's open range.
/// A ray in or parallel to the plane has none. The normal may have any length.
fn plane_crossing(ray: &Ray, point: DVec3, normal: DVec3) -> Option<f64> {
    if !ray.is_valid() {
        return None;
    }
    let t = plane_parameter(ray, point, normal);
    ray.contains(t).then_some(t)
}

/// As [`plane_crossing`], whatever the range; not finite if there is none.
#[inline(always)]
fn plane_parameter(ray: &Ray, point: DVec3, normal: DVec3) -> f64 {
    (point - ray.origin).dot(normal) / ray.direction.dot(normal)
}

/// The point of a flat shape that a ray meets at `t`, and the bound of its error. `anchor` is a point of the shape's plane.
#[inline(always)]
pub(crate) fn flat_point(ray: &Ray, t: f64, anchor: DVec3, normal: DVec3) -> (DVec3, f64) {
    let on_ray = ray.at(t);
    let point = on_ray + (anchor - on_ray).dot(normal) * normal;
    // The projection leaves a distance of a few roundings of the coordinates it is computed from.
    let size = point.abs().max_element() + anchor.abs().max_element() + (point - anchor).length();
    (point, 8.0 * f64::EPSILON * size)
}

fn flat_hit(ray: &Ray, crossing: Crossing, anchor: DVec3, normal: DVec3, st: DVec2) -> Hit {
    let (point, error) = flat_point(ray, crossing.t, anchor, normal);
    Hit {
        t: crossing.t,
        point,
        normal,
        error,
        object: 0,
        piece: 0,
        u: st.x,
        chart: Chart::Flat(st),
    }
}

/// a × b to within two roundings of each component, however nearly parallel they are (Kahan's difference of products with a fused
/// multiply-add).
fn cross(a: DVec3, b: DVec3) -> DVec3 {
    let minus = |p: f64, q: f64, r: f64, s: f64| {
        let product = r * s;
        libm::fma(p, q, -product) - libm::fma(r, s, -product)
    };
    DVec3::new(
        minus(a.y, b.z, a.z, b.y),
        minus(a.z, b.x, a.x, b.z),
        minus(a.x, b.y, a.y, b.x),
    )
}

fn crossing(t: f64) -> Crossing {
    Crossing {
        t,
        piece: 0,
        u: 0.0,
    }
}

impl Quad {
    /// The parallelogram at a corner along two edges, which are not parallel.
    pub fn new(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Self {
        Self {
            corner,
            edge_u,
            edge_v,
            normal: cross(edge_u, edge_v).normalize(),
        }
    }

    /// Unit normal.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// The same at another corner.
    #[must_use]
    pub fn moved_to(self, corner: DVec3) -> Self {
        Self { corner, ..self }
    }

    /// Area.
    pub fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    /// The crossing inside the ray's open range; the border belongs to the quad.
    pub fn nearest(&self, ray: &Ray) -> Option<Crossing> {
        let t = plane_crossing(ray, self.corner, self.normal)?;
        self.covers(ray.at(t)).then(|| crossing(t))
    }

    /// Parameter of the crossing with the plane, and whether it lies on the quad: without a branch, for vector lanes.
    #[inline(always)]
    pub(super) fn meet(&self, ray: &Ray) -> (f64, bool) {
        let t = plane_parameter(ray, self.corner, self.normal);
        (t, self.covers(ray.at(t)))
    }

    #[inline(always)]
    fn covers(&self, point: DVec3) -> bool {
        let (st, scale) = self.coordinates(point);
        (st.x >= 0.0) & (st.x <= scale) & (st.y >= 0.0) & (st.y <= scale)
    }

    /// Coordinates along the edges, and what to divide them by.
    #[inline(always)]
    fn coordinates(&self, point: DVec3) -> (DVec2, f64) {
        let across = self.edge_u.cross(self.edge_v);
        let from_corner = point - self.corner;
        let st = DVec2::new(
            from_corner.cross(self.edge_v).dot(across),
            self.edge_u.cross(from_corner).dot(across),
        );
        (st, across.length_squared())
    }

    /// The full hit of a crossing.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let (st, scale) = self.coordinates(ray.at(crossing.t));
        let st = (st / scale).clamp(DVec2::ZERO, DVec2::ONE);
        flat_hit(ray, crossing, self.corner, self.normal, st)
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

    /// As [`Quad::meet`].
    #[inline(always)]
    pub(super) fn meet(&self, ray: &Ray) -> (f64, bool) {
        (plane_parameter(ray, self.point, self.normal), true)
    }

    /// The full hit of a crossing. Texture coordinates are in world units along two fixed axes of the plane.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let mut hit = flat_hit(ray, crossing, self.point, self.normal, DVec2::ZERO);
        let (s_axis, t_axis) = tangents(self.normal);
        let from_point = hit.point - self.point;
        let st = DVec2::new(from_point.dot(s_axis), from_point.dot(t_axis));
        hit.chart = Chart::Flat(st);
        hit.u = st.x;
        hit
    }
}

impl Disc {
    /// The crossing inside the ray's open range; the border belongs to the disc.
    pub fn nearest(&self, ray: &Ray) -> Option<Crossing> {
        let t = plane_crossing(ray, self.center, self.normal)?;
        self.covers(ray.at(t)).then(|| crossing(t))
    }

    /// As [`Quad::meet`].
    #[inline(always)]
    pub(super) fn meet(&self, ray: &Ray) -> (f64, bool) {
        let t = plane_parameter(ray, self.center, self.normal);
        (t, self.covers(ray.at(t)))
    }

    #[inline(always)]
    fn covers(&self, point: DVec3) -> bool {
        (point - self.center).length_squared() <= self.radius * self.radius
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    fn unit(stream: &mut Stream) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| stream.range(-1.0, 1.0))).normalize()
    }

    fn tilted_disc() -> Disc {
        Disc {
            center: DVec3::new(1.0, -2.0, 0.5),
            normal: DVec3::new(0.6, 0.8, 0.0),
            radius: 2.0,
        }
    }

    /// A disc with unit normal n reaches √(1 − n²) of its radius along each axis.
    #[test]
    fn bounds_are_tight_on_tilted_shapes() {
        let disc = tilted_disc();
        let reach = DVec3::new(1.6, 1.2, 2.0);
        assert!((disc.bounds().min - (disc.center - reach)).length() < 1e-14);
        assert!((disc.bounds().max - (disc.center + reach)).length() < 1e-14);
        let quad = Quad::new(
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(2.0, -1.0, 0.0),
            DVec3::new(-0.5, -1.0, -4.0),
        );
        assert_eq!(quad.bounds().min, DVec3::new(0.5, 0.0, -1.0));
        assert_eq!(quad.bounds().max, DVec3::new(3.0, 2.0, 3.0));
    }

    #[test]
    fn texture_coordinates_of_discs_and_planes_run_along_their_tangents() {
        let disc = tilted_disc();
        let plane = Plane {
            point: disc.center,
            normal: disc.normal,
        };
        let (s_axis, t_axis) = tangents(disc.normal);
        for (s, t) in [(0.0, 0.0), (1.0, 0.5), (-0.75, 1.25), (0.5, -1.5)] {
            let target = disc.center + s * s_axis + t * t_axis;
            let from = Ray::new(target + 3.0 * disc.normal, -disc.normal);
            let hit = disc.hit(&from, disc.nearest(&from).expect("a point of the disc"));
            let expected = DVec2::new(0.5 + s / 4.0, 0.5 + t / 4.0);
            assert!((hit.st() - expected).length() < 1e-14, "disc at ({s}, {t})");
            assert_eq!(hit.u, hit.st().x);
            let hit = plane.hit(&from, plane.nearest(&from).expect("a point of the plane"));
            assert!((hit.st() - DVec2::new(s, t)).length() < 1e-14, "plane");
            assert_eq!(hit.u, hit.st().x);
            assert!((hit.point - target).length() <= 1e-14 && (hit.t - 3.0).abs() < 1e-14);
        }
    }

    /// The point lies on the plane to within its error from however far the ray came, and the bound is that of a few roundings of
    /// the coordinates: not so wide that the next ray would start visibly off the surface.
    #[test]
    fn flat_hits_lie_on_their_plane_within_a_tight_bound() {
        let mut stream = Stream::new(5, Purpose::Test, 0);
        for _ in 0..5000 {
            let normal = unit(&mut stream);
            let anchor = unit(&mut stream) * libm::exp(stream.range(-3.0, 9.0));
            let (s, t) = tangents(normal);
            let reach = libm::exp(stream.range(-3.0, 9.0));
            let [a, b] = stream.uniform2();
            let target = anchor + reach * (a * s + b * t);
            let direction = unit(&mut stream);
            let from = Ray::new(
                target - libm::exp(stream.range(0.0, 18.0)) * direction,
                direction,
            );
            let plane = Plane {
                point: anchor,
                normal,
            };
            let Some(crossing) = plane.nearest(&from) else {
                continue;
            };
            let hit = plane.hit(&from, crossing);
            let off = (hit.point - anchor).dot(normal).abs();
            // The normal itself is a unit vector to a rounding only, and so is this measure.
            let measure = 2.0 * f64::EPSILON * (hit.point - anchor).length();
            assert!(off <= hit.error + measure, "{off} against {}", hit.error);
            let size = hit.point.length().max(anchor.length());
            let in_roundings = hit.error / (f64::EPSILON * size);
            assert!(
                (4.0..=32.0).contains(&in_roundings),
                "{in_roundings} roundings"
            );
        }
    }

    #[test]
    fn the_first_tangent_is_level_unless_the_normal_is_nearly_upright() {
        let steep = DVec3::new(0.3, 0.9, -0.1_f64.sqrt());
        for normal in [steep, steep * DVec3::new(1.0, -1.0, 1.0)] {
            assert_eq!(tangents(normal).0.y, 0.0, "at 0.9 it is still level");
        }
        let steeper = DVec3::new(0.3, 0.95, -0.1).normalize();
        let (s, t) = tangents(steeper);
        assert!(s.x > 0.9 && s.y != 0.0, "above, it is that of +x");
        assert!((s.cross(t) - steeper).length() < 1e-15);
    }
}
