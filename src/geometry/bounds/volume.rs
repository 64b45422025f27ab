//! Bounding volumes of a revolved profile, as a choice to be studied.

use super::{Cylinder, MARGIN, length_of_leg, outward, slab};
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use glam::DVec3;

/// What a ray is tested against before the solver is asked. All are conservative: none ever costs a crossing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bounding {
    /// Nothing: the solver sees every ray.
    None,
    /// The tight cylinder about the axis, from the roots of r′ and h′.
    #[default]
    Cylinder,
    /// The cylinder of the control points (convex hull property): no roots, but loose where control points lie far off the curve.
    Hull,
    /// The tight cylinders of the pieces, one by one: the interval reaches from the first to the last that is met.
    Pieces,
    /// The box around the tight cylinder, along the profile's own axes.
    Box,
    /// A sphere about the middle of the axis, through the farthest edge of the pieces' tight cylinders.
    Sphere,
}

impl Bounding {
    /// Names in scene files and on the command line, in the order of [`Bounding::ALL`].
    pub const NAMES: [&str; 6] = ["none", "cylinder", "hull", "pieces", "box", "sphere"];
    /// Every kind.
    pub const ALL: [Self; 6] = [
        Self::None,
        Self::Cylinder,
        Self::Hull,
        Self::Pieces,
        Self::Box,
        Self::Sphere,
    ];
}

/// A bounding volume in the profile's own frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Volume {
    /// All of space.
    Everything,
    /// One cylinder.
    Cylinder(Cylinder),
    /// The union of cylinders.
    Cylinders(Vec<Cylinder>),
    /// The box that fits a cylinder.
    Box(Cylinder),
    /// A ball.
    Ball {
        /// Height of its centre on the axis.
        middle: f64,
        /// Its radius.
        radius: f64,
    },
}

impl Volume {
    /// The volume of this kind around a profile.
    pub fn new(kind: Bounding, profile: &Profile) -> Self {
        match kind {
            Bounding::None => Self::Everything,
            Bounding::Cylinder => Self::Cylinder(Cylinder::of(profile)),
            Bounding::Hull => Self::Cylinder(hull(profile)),
            Bounding::Pieces => Self::Cylinders(pieces(profile)),
            Bounding::Box => Self::Box(Cylinder::of(profile)),
            Bounding::Sphere => ball(profile),
        }
    }

    /// An interval of t that holds every point the ray's line shares with the volume, or `None` if there is certainly none.
    /// Conservative, as [`Cylinder::interval`].
    #[inline]
    pub fn interval(&self, ray: &Ray) -> Option<(f64, f64)> {
        match self {
            Self::Everything => Some((f64::NEG_INFINITY, f64::INFINITY)),
            Self::Cylinder(cylinder) => cylinder.interval(ray),
            Self::Cylinders(cylinders) => (cylinders.iter())
                .filter_map(|cylinder| cylinder.interval(ray))
                .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))),
            Self::Box(cylinder) => box_interval(cylinder, ray),
            Self::Ball { middle, radius } => ball_interval(*middle, *radius, ray),
        }
    }

    /// How many primitive volumes one test looks at.
    #[inline]
    pub fn tests(&self) -> u64 {
        match self {
            Self::Everything => 0,
            Self::Cylinders(cylinders) => cylinders.len() as u64,
            Self::Cylinder(_) | Self::Box(_) | Self::Ball { .. } => 1,
        }
    }
}

/// The cylinder of the control points. The curve lies within their hull, so there is nothing to round.
fn hull(profile: &Profile) -> Cylinder {
    let heights = || profile.pieces().iter().flat_map(|piece| piece.height);
    Cylinder {
        radius: profile.control_size().0,
        bottom: heights().fold(f64::INFINITY, f64::min),
        top: heights().fold(f64::NEG_INFINITY, f64::max),
    }
}

fn pieces(profile: &Profile) -> Vec<Cylinder> {
    profile.pieces().iter().map(Cylinder::of_piece).collect()
}

fn ball(profile: &Profile) -> Volume {
    let whole = Cylinder::of(profile);
    let middle = 0.5 * whole.bottom + 0.5 * whole.top;
    let edge = |cylinder: &Cylinder| {
        let height = (cylinder.top - middle)
            .abs()
            .max((cylinder.bottom - middle).abs());
        libm::hypot(cylinder.radius, height)
    };
    let radius = pieces(profile).iter().map(edge).fold(0.0, f64::max);
    Volume::Ball {
        middle,
        radius: radius * (1.0 + MARGIN) + f64::MIN_POSITIVE,
    }
}

/// Three slabs (Kay and Kajiya 1986).
fn box_interval(cylinder: &Cylinder, ray: &Ray) -> Option<(f64, f64)> {
    let (o, d, r) = (ray.origin, ray.direction, cylinder.radius);
    let x = slab(-r, r, o.x, d.x)?;
    let y = slab(cylinder.bottom, cylinder.top, o.y, d.y)?;
    let z = slab(-r, r, o.z, d.z)?;
    let low = x.0.max(y.0).max(z.0);
    let high = x.1.min(y.1).min(z.1);
    // Not `low <= high`: a NaN from overflowing input must not cull.
    if high < low { None } else { Some((low, high)) }
}

/// The ray's line against a ball, by its distance from the centre.
fn ball_interval(middle: f64, radius: f64, ray: &Ray) -> Option<(f64, f64)> {
    let greatest = ray.direction.abs().max_element();
    let scaled = ray.direction / greatest;
    let length = scaled.length();
    let e = scaled / length;
    let from = ray.origin - DVec3::new(0.0, middle, 0.0);
    let cross = from.cross(e);
    let size = cross.abs().max_element();
    let distance = if size > 0.0 {
        (cross / size).length() * size
    } else {
        0.0
    };
    // e, the products and the sums cost fewer than 32 roundings of |from|.
    let slack = 4.0 * MARGIN * (from.abs().max_element() + radius);
    let (near, far) = ((distance - slack).max(0.0), radius + slack);
    if near > far {
        return None;
    }
    let half = length_of_leg(far, near) * (1.0 + MARGIN) + slack;
    let nearest = -from.dot(e);
    let at = |arc: f64| arc / length / greatest;
    Some(outward(at(nearest - half), at(nearest + half)))
}
