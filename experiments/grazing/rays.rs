//! Rays that touch a surface of revolution, tilted or moved from tangency.

use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::{Placement, Revolution, Solver};
use crate::numeric::rng::Stream;
use crate::numeric::work::Work;
use glam::DVec3;
use std::f64::consts::TAU;

/// How a ray differs from a tangent one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    /// Turned about the point of tangency by an angle: it enters there, and leaves after 2 tan δ/κ.
    Tilt,
    /// Moved into the surface: it stays inside over 2 √(2 d/κ).
    Inward,
    /// Moved off the surface: no crossing here.
    Outward,
}

impl Family {
    /// All of them, in the order of the table.
    pub(super) const ALL: [Self; 3] = [Self::Tilt, Self::Inward, Self::Outward];

    /// The name in the table.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Tilt => "tilt",
            Self::Inward => "inward",
            Self::Outward => "outward",
        }
    }

    /// The family of a name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }
}

/// A tangent of a surface at a point where the surface bends away from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Graze {
    point: DVec3,
    /// Unit normal on the tangent's side.
    normal: DVec3,
    /// Unit direction.
    direction: DVec3,
    /// Normal curvature along the direction, > 0: away from the tangent.
    curvature: f64,
    /// From the ray's origin to the point.
    distance: f64,
}

/// Curvatures looked at: flatter directions are nearly lines of the surface, sharper ones are radii below a fifth.
const CURVATURES: (f64, f64) = (0.2, 5.0);
/// Distances of the ray's origin from the point of tangency.
const DISTANCES: (f64, f64) = (0.1, 1.0);
/// Nothing may stand before the point on a parallel this far off the tangent.
const CLEAR: f64 = 1e-3;
/// Stations nearer to the ends of a piece could put the second crossing on the next piece.
const INNER: (f64, f64) = (0.05, 0.95);

impl Graze {
    /// A random tangent of the surface, from whichever side is hollow, with a free view of the point of tangency.
    pub(super) fn random(surface: &Revolution, stream: &mut Stream) -> Self {
        loop {
            if let Some(graze) = Self::candidate(surface.profile(), stream)
                && graze.sees_its_point(surface)
            {
                return graze;
            }
        }
    }

    fn candidate(profile: &Profile, stream: &mut Stream) -> Option<Self> {
        let pieces = profile.pieces();
        let choice = (stream.uniform() * pieces.len() as f64) as usize;
        let u = stream.range(INNER.0, INNER.1);
        let theta = TAU * stream.uniform();
        let turn = TAU * stream.uniform();
        let distance = stream.range(DISTANCES.0, DISTANCES.1);
        let frame = Frame::at(&pieces[choice], u, theta)?;
        let (sin, cos) = libm::sincos(turn);
        // Euler's formula.
        let curvature = cos * cos * frame.along_profile + sin * sin * frame.around_axis;
        let size = curvature.abs();
        (CURVATURES.0 <= size && size <= CURVATURES.1).then(|| Self {
            point: frame.point,
            normal: curvature.signum() * frame.normal,
            direction: (cos * frame.along + sin * frame.around).normalize(),
            curvature: size,
            distance,
        })
    }

    fn sees_its_point(&self, surface: &Revolution) -> bool {
        let parallel = self.ray(Family::Outward, CLEAR).until(self.distance);
        let nearest = surface.nearest(&parallel, &Solver::Bernstein, &mut Work::default());
        nearest.is_none()
    }

    /// The ray at an angle or distance from tangency.
    pub(super) fn ray(&self, family: Family, tilt: f64) -> Ray {
        let (point, direction) = match family {
            Family::Tilt => {
                let (sin, cos) = libm::sincos(tilt);
                (self.point, cos * self.direction - sin * self.normal)
            }
            Family::Inward => (self.point - tilt * self.normal, self.direction),
            Family::Outward => (self.point + tilt * self.normal, self.direction),
        };
        Ray::new(point - self.distance * direction, direction)
    }

    /// The predicted distance of the crossings at a small angle or distance from tangency; NaN where there are none.
    pub(super) fn chord(&self, family: Family, tilt: f64) -> f64 {
        match family {
            _ if tilt == 0.0 => f64::NAN,
            Family::Tilt => 2.0 * libm::tan(tilt) / self.curvature,
            Family::Inward => 2.0 * self.blur(tilt),
            Family::Outward => f64::NAN,
        }
    }

    /// The t that a residual of `accuracy` leaves uncertain at tangency: √(2 accuracy/κ).
    pub(super) fn blur(&self, accuracy: f64) -> f64 {
        (2.0 * accuracy / self.curvature).sqrt()
    }
}

/// A point of a revolved piece with its principal directions and curvatures, positive where the surface bends away from the normal.
struct Frame {
    point: DVec3,
    normal: DVec3,
    along: DVec3,
    around: DVec3,
    along_profile: f64,
    around_axis: f64,
}

/// Nearer to the axis, or slower, the principal curvatures are not to be trusted.
const REGULAR: f64 = 1e-3;

impl Frame {
    fn at(piece: &Piece, u: f64, theta: f64) -> Option<Self> {
        let station = piece.at(u);
        let (r, h) = (station.radius_slope, station.height_slope);
        let speed = libm::hypot(r, h);
        if station.radius < REGULAR || speed < REGULAR {
            return None;
        }
        let (sin, cos) = libm::sincos(theta);
        let outward = DVec3::new(sin, 0.0, cos);
        let (bend_r, bend_h) = (second(&piece.radius, u), second(&piece.height, u));
        Some(Self {
            point: station.radius * outward + station.height * DVec3::Y,
            normal: (h * outward - r * DVec3::Y) / speed,
            along: (r * outward + h * DVec3::Y) / speed,
            around: DVec3::new(cos, 0.0, -sin),
            along_profile: (r * bend_h - h * bend_r) / (speed * speed * speed),
            around_axis: h / (speed * station.radius),
        })
    }
}

/// Second derivative of a cubic.
fn second(c: &[f64; 4], u: f64) -> f64 {
    let (first, last) = (c[2] - 2.0 * c[1] + c[0], c[3] - 2.0 * c[2] + c[1]);
    6.0 * ((1.0 - u) * first + u * last)
}

/// The cup or the hourglass.
pub(super) fn surface(name: &str) -> Option<Revolution> {
    let profile = match name {
        "cup" => Profile::cup(),
        "hourglass" => Profile::hourglass(),
        _ => return None,
    };
    Some(Revolution::new(profile, Placement::identity()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::revolution::exact;
    use crate::numeric::rng::Purpose;

    /// Exact arithmetic sees the chords that the curvatures predict: within 1 % at a tilt or depth of 1e-6.
    #[test]
    fn the_roots_are_as_far_apart_as_the_curvature_says() {
        for name in ["cup", "hourglass"] {
            let surface = surface(name).unwrap();
            for index in 0..40 {
                let mut stream = Stream::new(5, Purpose::Test, index);
                let graze = Graze::random(&surface, &mut stream);
                let tilt = 1e-6;
                for family in [Family::Tilt, Family::Inward] {
                    let chord = graze.chord(family, tilt);
                    let found = exact::crossings(surface.profile(), &graze.ray(family, tilt));
                    let seen = found[1].t - found[0].t;
                    assert!(
                        (seen / chord - 1.0).abs() < 0.01,
                        "{name} {family:?} {seen}"
                    );
                    assert!((found[0].t - graze.distance).abs() < 2.0 * chord);
                }
            }
        }
    }
}
