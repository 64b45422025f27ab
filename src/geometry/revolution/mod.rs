//! The surface of revolution of a piecewise cubic Bezier profile about its local +y axis.

pub mod bernstein;
mod clearance;
pub mod clipping;
mod edge;
pub mod exact;
mod leave;
pub mod membership;
pub mod newton;
mod placement;
mod solve;

use super::bounds::{Aabb, Bounding, Cylinder, Volume};
use super::hit::{Chart, Crossing, Hit};
use super::profile::{Piece, Profile};
use super::ray::Ray;
use super::sphere::Sphere;
use clearance::Clearance;
use clipping::ClippingSettings;
use glam::DVec3;
use newton::NewtonSettings;
pub use placement::Placement;
use std::sync::OnceLock;

/// How to solve ray = surface of revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// Roots of the degree-6 polynomial, isolated in Bernstein form: the default.
    Bernstein,
    /// Newton's method in (t, u, θ) from many starts: the original's method, an object of study.
    Newton(NewtonSettings),
    /// Bezier clipping in f64: the classical robust rival, without a net.
    Clipping(ClippingSettings),
    /// Exact arithmetic: slow, the oracle.
    Exact,
}

/// A placed surface of revolution.
#[derive(Clone, Debug)]
pub struct Revolution {
    profile: Profile,
    placement: Placement,
    cylinder: Cylinder,
    volume: Volume,
    /// Whether the placement changes nothing.
    in_place: bool,
    prepared: bernstein::Prepared,
    /// Bound of the distance of a computed surface point from the surface, world units.
    error: f64,
    /// Made when a ray first leaves the surface.
    clearance: OnceLock<Clearance>,
}

impl Revolution {
    /// Revolves and places a profile.
    pub fn new(profile: Profile, placement: Placement) -> Self {
        let cylinder = Cylinder::of(&profile);
        let error = point_error(&profile, &placement);
        Self {
            prepared: bernstein::Prepared::new(&profile),
            volume: Volume::Cylinder(cylinder),
            profile,
            in_place: placement == Placement::identity(),
            placement,
            cylinder,
            error,
            clearance: OnceLock::new(),
        }
    }

    /// The same surface behind another bounding volume: the same hits at another cost.
    ///
    /// The default solver tests the tight cylinder by itself, faster than the general test does.
    #[must_use]
    pub fn bounded_by(self, kind: Bounding) -> Self {
        Self {
            volume: Volume::new(kind, &self.profile),
            prepared: self.prepared.culling(kind == Bounding::Cylinder),
            ..self
        }
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The placement.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// The bounding cylinder, in the profile's own frame.
    pub fn cylinder(&self) -> &Cylinder {
        &self.cylinder
    }

    /// The full hit of a crossing that this surface returned for this ray.
    ///
    /// The point is S(u, θ), placed, with θ from the ray's point: it lies on the surface to within [`Hit::error`] however wrong
    /// t is.
    /// At a sharp edge the crossing is given to the piece that the ray faces.
    pub fn hit(&self, ray: &Ray, crossing: Crossing) -> Hit {
        let crossing = self.faced(ray, crossing);
        let local = self.placement.ray_to_local(ray).at(crossing.t);
        let piece = &self.profile.pieces()[crossing.piece as usize];
        let (radius, height) = {
            let station = piece.at(crossing.u);
            (station.radius.abs(), station.height)
        };
        let (sin, cos) = meridian(local.x, local.z);
        let on_surface = DVec3::new(radius * sin, height, radius * cos);
        let pieces = self.profile.pieces().len() as f64;
        Hit {
            t: crossing.t,
            point: self.placement.point_to_world(on_surface),
            normal: self.placement.rotation * local_normal(piece, crossing.u, sin, cos),
            error: self.error,
            object: 0,
            piece: crossing.piece,
            u: crossing.u,
            chart: Chart::Round {
                sin,
                cos,
                t: (f64::from(crossing.piece) + crossing.u) / pieces,
            },
        }
    }

    /// The sphere around the bounding cylinder, in the world.
    pub fn bounding_sphere(&self) -> Sphere {
        let Cylinder {
            radius,
            bottom,
            top,
            ..
        } = self.cylinder;
        let middle = DVec3::new(0.0, 0.5 * (bottom + top), 0.0);
        Sphere {
            center: self.placement.point_to_world(middle),
            radius: self.placement.scale * libm::hypot(radius, 0.5 * (top - bottom)),
        }
    }

    /// World bounds.
    pub fn bounds(&self) -> Aabb {
        let axis = self.placement.rotation.y_axis;
        let half_height = 0.5 * (self.cylinder.top - self.cylinder.bottom);
        let middle = 0.5 * (self.cylinder.top + self.cylinder.bottom);
        let center = self.placement.point_to_world(DVec3::new(0.0, middle, 0.0));
        // A disc with unit normal n reaches √(1 − n²) of its radius along each axis.
        let disc = (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt);
        let reach = self.placement.scale * (half_height * axis.abs() + self.cylinder.radius * disc);
        // √(1 − n²) near n = 1 turns a rounding of n into its square root.
        let slack = self.placement.scale * self.cylinder.radius * 4.0 * f64::EPSILON.sqrt();
        let outward = reach + self.error + slack;
        Aabb {
            min: center - outward,
            max: center + outward,
        }
    }
}

/// Sine and cosine of the azimuth of (x, z); θ = 0 on the axis.
fn meridian(x: f64, z: f64) -> (f64, f64) {
    // Scaled, so that points 1e-200 off the axis keep their azimuth.
    let size = x.abs().max(z.abs());
    if size == 0.0 || !size.is_finite() {
        return (0.0, 1.0);
    }
    let (x, z) = (x / size, z / size);
    let length = (x * x + z * z).sqrt();
    (x / length, z / length)
}

/// The unit normal (h′ sin θ, −|r|′, h′ cos θ)/|P′| at `u`.
///
/// On the axis a cone has no normal; there it is parallel to the axis (the mean over θ), on the side of the cone's own normals.
/// Where the curve stands still, [`Piece::tangent`] stands for P′. A piece that is a single point has the normal +y.
fn local_normal(piece: &Piece, u: f64, sin: f64, cos: f64) -> DVec3 {
    let radius = piece.at(u).radius;
    let size = piece.radius.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
    let [radius_slope, height_slope] = piece.tangent(u);
    // r < 0: the surface is that of |r|. At r = 0 the side from which the piece comes, or to which it goes, decides.
    let side = if radius != 0.0 {
        radius
    } else if u >= 1.0 {
        first_nonzero(piece.radius.iter().rev())
    } else {
        first_nonzero(piece.radius.iter())
    };
    let radius_slope = if side < 0.0 {
        -radius_slope
    } else {
        radius_slope
    };
    let normal = if radius.abs() <= ON_AXIS * size && radius_slope != 0.0 {
        DVec3::new(0.0, -radius_slope, 0.0)
    } else {
        DVec3::new(height_slope * sin, -radius_slope, height_slope * cos)
    };
    // Scaled first: slopes of 1e-300 must not vanish when squared.
    let scale = normal.abs().max_element();
    if scale == 0.0 {
        return DVec3::Y;
    }
    (normal / scale).normalize()
}

/// A radius this small against the control radii is the rounding of its evaluation: the point is on the axis.
const ON_AXIS: f64 = 8.0 * f64::EPSILON;

/// The first value that is not zero, or zero.
fn first_nonzero<'a>(mut values: impl Iterator<Item = &'a f64>) -> f64 {
    values.find(|&&r| r != 0.0).copied().unwrap_or(0.0)
}

/// Bound of the distance of `placement(S(u, θ))`, as computed, from the surface.
///
/// With half an ulp (ε/2) per operation and control sizes (R, H): a cubic by [`cubic`](crate::numeric::polynomial::cubic) costs at
/// most 10 of them, sin θ and cos θ 4, their product with r 1, so each local coordinate is within 7.5 ε of R or H; a row of the
/// rotation adds 3, the scale and the translation 1 each, over three coordinates a factor √3. That is below 16 ε s (R + H) + ε |T|;
/// rounding the frame of the next ray (o − T, the transposed rotation, 1/s) costs less again, and the sum is doubled.
fn point_error(profile: &Profile, placement: &Placement) -> f64 {
    let (radius, height) = profile.control_size();
    let moved = placement.translate.abs().max_element();
    f64::EPSILON * (32.0 * placement.scale * (radius + height) + 4.0 * moved)
        + 64.0 * (1.0 + placement.scale) * f64::MIN_POSITIVE * f64::EPSILON
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn close(a: DVec3, b: DVec3, tolerance: f64) -> bool {
        (a - b).abs().max_element() <= tolerance
    }

    #[test]
    fn the_normal_is_the_cross_product_of_the_tangents() {
        for profile in [Profile::cup(), Profile::hourglass()] {
            for (piece, u, theta) in [(0, 0.3, 0.4), (2, 0.7, 2.0), (3, 0.5, 4.0), (5, 0.2, 6.0)] {
                let piece = &profile.pieces()[piece];
                let station = piece.at(u);
                let (sin, cos) = (libm::sin(theta), libm::cos(theta));
                let along_u = DVec3::new(
                    station.radius_slope * sin,
                    station.height_slope,
                    station.radius_slope * cos,
                );
                let along_theta = station.radius * DVec3::new(cos, 0.0, -sin);
                let expected = along_theta.cross(along_u).normalize();
                assert!(close(local_normal(piece, u, sin, cos), expected, 1e-14));
            }
        }
    }

    #[test]
    fn a_negative_radius_gives_the_surface_of_its_magnitude() {
        let mirrored = |sign: f64| Piece {
            radius: [1.0, 1.5, 2.0, 1.0].map(|r| sign * r),
            height: [0.0, 0.5, 0.75, 2.0],
        };
        for u in [0.0, 0.3, 1.0] {
            let plus = local_normal(&mirrored(1.0), u, 0.6, 0.8);
            assert_eq!(plus, local_normal(&mirrored(-1.0), u, 0.6, 0.8));
        }
    }

    #[test]
    fn the_tip_of_a_cone_has_a_normal_along_the_axis() {
        let cone = Piece::new([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]);
        assert_eq!(local_normal(&cone, 0.0, 0.0, 1.0), -DVec3::Y);
        let cap = &Profile::cup().pieces()[5].clone();
        assert_eq!(local_normal(cap, 1.0, 0.0, 1.0), DVec3::Y);
        let point = Piece::new([[0.0, 1.0]; 4]);
        assert_eq!(local_normal(&point, 0.5, 0.0, 1.0), DVec3::Y);
    }

    #[test]
    fn a_hit_lies_on_the_surface_even_if_t_is_wrong() {
        let placement = Placement::new(
            DVec3::new(3.0, -2.0, 5.0),
            DVec3::new(1.0, 2.0, 3.0),
            40.0,
            2.5,
        );
        let cup = Revolution::new(Profile::cup(), placement);
        let ray = Ray::new(DVec3::new(20.0, 3.0, 4.0), DVec3::new(-1.0, -0.2, 0.1));
        let crossing = |t| Crossing {
            t,
            piece: 3,
            u: 0.25,
        };
        let expected = Profile::cup().pieces()[3].at(0.25);
        for t in [15.0, 16.0, 17.5] {
            let hit = cup.hit(&ray, crossing(t));
            let local = placement.rotation.transpose() * (hit.point - placement.translate)
                / placement.scale;
            let radius = libm::hypot(local.x, local.z);
            assert!((radius - expected.radius).abs() * placement.scale <= hit.error);
            assert!((local.y - expected.height).abs() * placement.scale <= hit.error);
            assert!((hit.normal.length() - 1.0).abs() < 4.0 * f64::EPSILON);
        }
    }

    /// A tube fills its bounding cylinder, so some point of its rims touches every face of the world bounds.
    #[test]
    fn world_bounds_touch_a_tube_on_every_side() {
        let wall = [0.0, 1.0, 2.0, 3.0].map(|h| [1.5, 0.5 * h - 0.2]);
        let profile = Profile::new(vec![Piece::new(wall)]).expect("one piece");
        let axis = DVec3::new(1.0, 2.0, 3.0);
        for placement in [
            Placement::identity(),
            Placement::new(DVec3::new(3.0, -2.0, 5.0), axis, 40.0, 2.5),
        ] {
            let tube = Revolution::new(profile.clone(), placement);
            let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for height in [-0.2, 1.3] {
                for turn in 0..720_u16 {
                    let theta = f64::from(turn).to_radians() / 2.0;
                    let rim = DVec3::new(1.5 * libm::sin(theta), height, 1.5 * libm::cos(theta));
                    let world = placement.point_to_world(rim);
                    (min, max) = (min.min(world), max.max(world));
                }
            }
            let bounds = tube.bounds();
            assert!(close(bounds.min, min, 1e-4) && close(bounds.max, max, 1e-4));
        }
    }

    #[test]
    fn texture_coordinates_are_azimuth_and_place_along_the_profile() {
        let hourglass = Revolution::new(Profile::hourglass(), Placement::identity());
        for (direction, s) in [
            (DVec3::Z, 0.0),
            (DVec3::X, 0.25),
            (-DVec3::Z, 0.5),
            (-DVec3::X, 0.75),
        ] {
            let ray = Ray::new(9.0 * direction, -direction);
            let crossing = Crossing {
                t: 8.8,
                piece: 2,
                u: 0.25,
            };
            let hit = hourglass.hit(&ray, crossing);
            assert!((hit.st() - DVec2::new(s, 2.25 / 6.0)).length() < 1e-15);
            assert!((hit.theta() - s * std::f64::consts::TAU).abs() < 1e-14);
            assert_eq!((hit.u, hit.piece, hit.t), (0.25, 2, 8.8));
        }
    }

    #[test]
    fn the_azimuth_survives_tiny_and_huge_distances_and_is_zero_on_the_axis() {
        for size in [1e-300, 1e-160, 1.0, 1e160, 1e300] {
            let (sin, cos) = meridian(3.0 * size, -4.0 * size);
            assert!((sin - 0.6).abs() < 1e-15 && (cos + 0.8).abs() < 1e-15);
        }
        for (x, z) in [(0.0, 0.0), (f64::INFINITY, 1.0), (0.0, f64::NEG_INFINITY)] {
            assert_eq!(meridian(x, z), (0.0, 1.0));
        }
    }

    /// Some tens of roundings of the size, the scaled one and that of the translation: not nothing, and not visible.
    #[test]
    fn the_error_of_a_point_grows_with_scale_and_translation() {
        for (scale, moved) in [
            (1.0, 0.0),
            (1e3, 0.0),
            (1e-3, 1.0),
            (1.0, 1e6),
            (7.0, 100.0),
        ] {
            let translate = DVec3::new(0.1 * moved, -moved, 0.0);
            let placement = Placement::new(translate, DVec3::Y, 0.0, scale);
            let cup = Revolution::new(Profile::cup(), placement);
            let (own, shift) = (scale * (3.8 + 2.2), moved);
            let least = f64::EPSILON * (16.0 * own + 2.0 * shift);
            let most = f64::EPSILON * (64.0 * own + 8.0 * shift);
            assert!((least..most).contains(&cup.error), "{scale} {moved}");
        }
        // Below the normal numbers roundings do not shrink with the profile.
        let dust = crate::geometry::specimens::line([0.0, 0.0], [3e-315, 3e-315]);
        let dust = Profile::new(vec![dust]).expect("a piece is a profile");
        let placement = Placement::new(DVec3::ZERO, DVec3::Y, 0.0, 1e300);
        let least = 16.0 * 1e300 * f64::from_bits(1);
        assert!(Revolution::new(dust, placement).error > least);
    }

    #[test]
    fn world_bounds_hold_the_surface() {
        let placement = Placement::new(
            DVec3::new(3.0, -2.0, 5.0),
            DVec3::new(1.0, 2.0, 3.0),
            40.0,
            2.5,
        );
        let turned = Placement::new(DVec3::ZERO, DVec3::Z, 90.0, 1.0);
        for placement in [Placement::identity(), placement, turned] {
            let cup = Revolution::new(Profile::cup(), placement);
            let bounds = cup.bounds();
            for k in 0..6_u8 {
                for step in 0..64_u8 {
                    let station = cup.profile().pieces()[usize::from(k)].at(f64::from(step) / 63.0);
                    for turn in 0..16_u8 {
                        let theta = f64::from(turn) * std::f64::consts::TAU / 16.0;
                        let local = DVec3::new(
                            station.radius * libm::sin(theta),
                            station.height,
                            station.radius * libm::cos(theta),
                        );
                        let world = placement.point_to_world(local);
                        assert!(world.cmpge(bounds.min).all() && world.cmple(bounds.max).all());
                    }
                }
            }
        }
    }
}
