//! Families of rays, easy and hard, aimed at a revolved profile in its own frame.

use glam::DVec3;
use photolathe::geometry::bounds::Cylinder;
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::numeric::rng::{Purpose, Stream};
use std::f64::consts::TAU;

/// A kind of ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// From outside, aimed at a point of the bounding cylinder.
    Random,
    /// From a point inside the bounding cylinder, in any direction.
    Inside,
    /// Perpendicular to the axis.
    Level,
    /// Off perpendicular by 1e-1 to 1e-16.
    NearlyLevel,
    /// Perpendicular to the axis, at the height of a joint.
    LevelAtJoint,
    /// Parallel to the axis.
    Parallel,
    /// Off parallel by 1e-1 to 1e-16.
    NearlyParallel,
    /// Meeting the axis, or passing it at 1e-3 to 1e-16.
    NearAxis,
    /// Aimed at a joint.
    Joint,
    /// From 1e4 to 1e8 away.
    Far,
    /// Tangent, moved off the surface by 1e-1 to 1e-15 to either side.
    Grazing,
    /// From a point of the surface, in any direction.
    SurfaceStart,
    /// In a plane that holds the axis.
    Meridian,
}

/// Every family.
pub(crate) const FAMILIES: [Family; 13] = [
    Family::Random,
    Family::Inside,
    Family::Level,
    Family::NearlyLevel,
    Family::LevelAtJoint,
    Family::Parallel,
    Family::NearlyParallel,
    Family::NearAxis,
    Family::Joint,
    Family::Far,
    Family::Grazing,
    Family::SurfaceStart,
    Family::Meridian,
];

/// Ray `index` of a family. `size` is the profile's, so that a scaled profile gets the scaled rays.
pub(crate) fn ray(profile: &Profile, family: Family, index: u64) -> Ray {
    let mut s = Stream::new(family as u64, Purpose::Test, index);
    let cylinder = Cylinder::of(profile);
    let size = cylinder.radius.max(cylinder.top - cylinder.bottom);
    let target = inside(&cylinder, &mut s);
    let small = |s: &mut Stream, least: f64| sign(s) * libm::exp10(s.range(least, -1.0));
    match family {
        Family::Random => from_outside(&mut s, target, 3.0 * size),
        Family::Inside => Ray::new(target, sphere(&mut s)),
        Family::Level | Family::NearlyLevel => {
            let mut direction = level(&mut s);
            if family == Family::NearlyLevel {
                direction.y = small(&mut s, -16.0);
            }
            Ray::new(target - 3.0 * size * direction, direction)
        }
        Family::LevelAtJoint => {
            let joint = joint(profile, &mut s);
            let direction = level(&mut s);
            let mut origin = target - 3.0 * size * direction;
            origin.y = joint[1];
            Ray::new(origin, direction)
        }
        Family::Parallel | Family::NearlyParallel => {
            let mut direction = DVec3::new(0.0, sign(&mut s), 0.0);
            if family == Family::NearlyParallel {
                direction.x = small(&mut s, -16.0);
                direction.z = small(&mut s, -16.0);
            }
            Ray::new(target - 3.0 * size * direction, direction)
        }
        Family::NearAxis => {
            let side = if s.uniform() < 0.1 {
                0.0
            } else {
                small(&mut s, -16.0)
            };
            let on_axis = DVec3::new(side * size, target.y, 0.0);
            let around = s.uniform() < 0.5;
            let direction = if around { DVec3::Y } else { sphere(&mut s) };
            Ray::new(on_axis - 4.0 * size * direction, direction)
        }
        Family::Joint => {
            let [r, h] = joint(profile, &mut s);
            let theta = TAU * s.uniform();
            let aim = DVec3::new(r * libm::sin(theta), h, r * libm::cos(theta));
            from_outside(&mut s, aim, 3.0 * size)
        }
        Family::Far => {
            let distance = libm::exp10(s.range(4.0, 8.0));
            from_outside(&mut s, target, distance * size)
        }
        Family::Grazing => {
            let (point, normal) = on_surface(profile, &mut s);
            let across = normal.cross(sphere(&mut s)).normalize();
            let aim = point + small(&mut s, -15.0) * size * normal;
            Ray::new(aim - 2.0 * size * across, across)
        }
        Family::SurfaceStart => {
            let (point, _) = on_surface(profile, &mut s);
            Ray::new(point, sphere(&mut s))
        }
        Family::Meridian => {
            let theta = TAU * s.uniform();
            let tilt = TAU * s.uniform();
            let (sin, cos) = (libm::sin(tilt), libm::cos(tilt));
            let outward = DVec3::new(libm::sin(theta), 0.0, libm::cos(theta));
            let direction = cos * outward + sin * DVec3::Y;
            let start = DVec3::new(0.0, target.y, 0.0);
            Ray::new(start - 3.0 * size * direction, direction)
        }
    }
}

fn inside(cylinder: &Cylinder, s: &mut Stream) -> DVec3 {
    let r = cylinder.radius * s.uniform().sqrt();
    let theta = TAU * s.uniform();
    let height = s.range(cylinder.bottom, cylinder.top);
    DVec3::new(r * libm::sin(theta), height, r * libm::cos(theta))
}

fn from_outside(s: &mut Stream, target: DVec3, distance: f64) -> Ray {
    let origin = distance * sphere(s);
    Ray::new(origin, (target - origin).normalize())
}

fn sphere(s: &mut Stream) -> DVec3 {
    let y = s.range(-1.0, 1.0);
    let r = (1.0 - y * y).sqrt();
    let theta = TAU * s.uniform();
    DVec3::new(r * libm::sin(theta), y, r * libm::cos(theta))
}

fn level(s: &mut Stream) -> DVec3 {
    let theta = TAU * s.uniform();
    DVec3::new(libm::sin(theta), 0.0, libm::cos(theta))
}

fn sign(s: &mut Stream) -> f64 {
    if s.uniform() < 0.5 { -1.0 } else { 1.0 }
}

fn pick(count: usize, s: &mut Stream) -> usize {
    ((s.uniform() * count as f64) as usize).min(count - 1)
}

/// An end of a piece, both ends of the profile included.
fn joint(profile: &Profile, s: &mut Stream) -> [f64; 2] {
    let pieces = profile.pieces();
    let end = if s.uniform() < 0.5 { 0 } else { 3 };
    pieces[pick(pieces.len(), s)].point(end)
}

fn on_surface(profile: &Profile, s: &mut Stream) -> (DVec3, DVec3) {
    let pieces = profile.pieces();
    let at = pieces[pick(pieces.len(), s)].at(s.uniform());
    let theta = TAU * s.uniform();
    let (sin, cos) = (libm::sin(theta), libm::cos(theta));
    let normal = DVec3::new(
        at.height_slope * sin,
        -at.radius_slope,
        at.height_slope * cos,
    );
    let point = DVec3::new(at.radius * sin, at.height, at.radius * cos);
    (point, normal.normalize())
}
