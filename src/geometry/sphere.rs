//! The sphere.

use super::bounds::Aabb;
use super::hit::{Chart, Crossing, Hit};
use super::ray::Ray;
use glam::DVec3;

/// A sphere; normals point outward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: DVec3,
    /// Radius, > 0.
    pub radius: f64,
}

impl Sphere {
    /// The nearest crossing inside the ray's open range.
    pub fn nearest(&self, ray: &Ray) -> Option<Crossing> {
        let (near, far) = self.solve(ray)?;
        [near, far]
            .into_iter()
            .find(|&t| ray.contains(t))
            .map(crossing)
    }

    /// Every crossing inside the ray's open range, by rising t.
    pub fn crossings(&self, ray: &Ray) -> Vec<Crossing> {
        let Some((near, far)) = self.solve(ray) else {
            return Vec::new();
        };
        let both = if near == far {
            vec![near]
        } else {
            vec![near, far]
        };
        both.into_iter()
            .filter(|&t| ray.contains(t))
            .map(crossing)
            .collect()
    }

    /// Both roots, near ≤ far.
    fn solve(&self, ray: &Ray) -> Option<(f64, f64)> {
        if !ray.is_valid() {
            return None;
        }
        let approach = self.approach(ray);
        approach.meets().then(|| approach.roots())
    }

    /// Both roots, and whether there are any: without a branch, for vector lanes.
    #[inline(always)]
    pub(super) fn meet(&self, ray: &Ray) -> (f64, f64, bool) {
        let approach = self.approach(ray);
        let (near, far) = approach.roots();
        (near, far, approach.meets())
    }

    /// How a line passes the sphere.
    ///
    /// The discriminant is r² − |f − (f·d̂) d̂|² with f = o − c: the squared distance of the line from the centre is taken from
    /// the difference vector, not as a difference of squares, so a far origin costs no digits (Haines, Akenine-Möller, "Precision
    /// improvements for ray/sphere intersection", Ray Tracing Gems 2019, ch. 7).
    #[inline(always)]
    fn approach(&self, ray: &Ray) -> Approach {
        // A direction of any length: powers of two change no bits of the answer and keep |d|² from over- and underflow.
        let scale = power_of_two_near(ray.direction.abs().max_element());
        let d = ray.direction / scale;
        // The same for the squares of lengths.
        let size = power_of_two_near(self.radius);
        let f = (ray.origin - self.center) / size;
        let a = d.length_squared();
        let b = -f.dot(d);
        let closest = f + (b / a) * d;
        let r = self.radius / size;
        Approach {
            scale,
            size,
            a,
            b,
            below: (r - closest.length()) * (r + closest.length()),
            outside: (f.length() - r) * (f.length() + r),
        }
    }

    /// The full hit of a crossing.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let from_center = (ray.at(crossing.t) - self.center) / power_of_two_near(self.radius);
        // From so far away that t rounds to the centre, the ray comes from the other side of it.
        let normal = from_center.normalize_or(-ray.direction.normalize_or(DVec3::Y));
        let up = 0.5 + libm::asin(normal.y.clamp(-1.0, 1.0)) / std::f64::consts::PI;
        Hit {
            t: crossing.t,
            point: self.center + self.radius * normal,
            normal,
            error: self.error(),
            object: 0,
            piece: 0,
            u: up,
            chart: Chart::Round {
                sin: normal.x,
                cos: normal.z,
                t: up,
            },
        }
    }

    /// Bound of the distance of a computed surface point from the surface: normalising costs at most 4 roundings of the radius
    /// per component, adding the centre one of the sum.
    fn error(&self) -> f64 {
        8.0 * f64::EPSILON * (self.radius + self.center.abs().max_element())
    }

    /// World bounds.
    pub fn bounds(&self) -> Aabb {
        Aabb {
            min: self.center - self.radius,
            max: self.center + self.radius,
        }
    }
}

/// The equation a t² − 2 b t + `outside` = 0, in units of `size`/`scale`.
struct Approach {
    scale: f64,
    size: f64,
    a: f64,
    b: f64,
    /// r² less the squared distance of the line from the centre.
    below: f64,
    /// |o − c|² − r².
    outside: f64,
}

impl Approach {
    #[inline(always)]
    fn meets(&self) -> bool {
        // Not "at least 0": what is not a number has roots that are none, and no range holds them.
        (self.below >= 0.0) | self.below.is_nan()
    }

    /// Both roots, near ≤ far, without cancellation. Not numbers if there are none.
    #[inline(always)]
    fn roots(&self) -> (f64, f64) {
        let Self {
            scale,
            size,
            a,
            b,
            below,
            outside,
        } = *self;
        let q = b + b.signum() * (a * below).sqrt();
        let (t0, t1) = (outside / q, q / a);
        let tangent = b / a;
        let touches = below == 0.0;
        let near = if touches { tangent } else { t0.min(t1) };
        let far = if touches { tangent } else { t0.max(t1) };
        (near / scale * size, far / scale * size)
    }
}

fn crossing(t: f64) -> Crossing {
    Crossing {
        t,
        piece: 0,
        u: 0.0,
    }
}

/// The power of two at or below a positive finite number (its nearest normal one for a subnormal).
#[inline(always)]
fn power_of_two_near(x: f64) -> f64 {
    let bits = x.max(f64::MIN_POSITIVE).to_bits();
    f64::from_bits(bits & 0x7FF0_0000_0000_0000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn bounds_touch_the_sphere() {
        let sphere = Sphere {
            center: DVec3::new(1.0, 2.0, 3.0),
            radius: 0.5,
        };
        assert_eq!(sphere.bounds().min, DVec3::new(0.5, 1.5, 2.5));
        assert_eq!(sphere.bounds().max, DVec3::new(1.5, 2.5, 3.5));
    }

    /// Latitude and azimuth: t runs from pole to pole, s once around from +z over +x.
    #[test]
    fn texture_coordinates_of_a_sphere_are_latitude_and_azimuth() {
        let sphere = Sphere {
            center: DVec3::new(1.0, 2.0, 3.0),
            radius: 2.0,
        };
        for (outward, s, t) in [
            (DVec3::Z, 0.0, 0.5),
            (DVec3::X, 0.25, 0.5),
            (-DVec3::Z, 0.5, 0.5),
            (-DVec3::X, 0.75, 0.5),
            (DVec3::new(0.0, 0.5, 0.75_f64.sqrt()), 0.0, 0.5 + 1.0 / 6.0),
            (
                DVec3::new(-0.75_f64.sqrt(), -0.5, 0.0),
                0.75,
                0.5 - 1.0 / 6.0,
            ),
        ] {
            let from = Ray::new(sphere.center + 5.0 * outward, -outward);
            let hit = sphere.hit(&from, sphere.nearest(&from).expect("through the centre"));
            assert!(
                (hit.st() - DVec2::new(s, t)).length() < 1e-14,
                "{outward}: {}",
                hit.st()
            );
            assert!((hit.theta() - std::f64::consts::TAU * s).abs() < 1e-14);
            assert_eq!(hit.u, hit.st().y);
        }
        // Just before a full turn the azimuth rounds to 2π, which is not in [0, 2π).
        let unit = Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        };
        let nearly = Ray::new(DVec3::new(-1e-300, 0.0, 5.0), -DVec3::Z);
        let hit = unit.hit(&nearly, unit.nearest(&nearly).expect("through the centre"));
        assert!(hit.normal.x < 0.0 && hit.theta() == 0.0);
    }
}
