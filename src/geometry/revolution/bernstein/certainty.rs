//! How far a crossing may be from the true one.
//!
//! With F(t, u) = (½(|o + t d|² − r²) across the axis, o_y + t d_y − h along it) and the Jacobian J of F, the true crossing is within
//! 2 |J⁻¹| (|F| + ε) of the computed one if J changes by less than a quarter that far around (Newton and Kantorovich), ε being the
//! rounding of F's own evaluation. A crossing that may lie beyond the end of its piece has the bounds of both pieces there.

use super::line::Line;
use super::{Cubics, Prepared};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::cubic;

/// Bounds of the distances of a crossing from the true crossing of the same ray in the profile's own frame; infinite where there is
/// none, as at a tangency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certainty {
    /// Bound of the error of t, in units of the ray's t.
    pub t: f64,
    /// Bound of the error of u. If the true crossing lies on the next piece, u is counted on through the joint.
    pub u: f64,
    /// Bound of the angle between the normal at the computed crossing and that at the true one, radians. It takes in the angle of a
    /// kink if the true crossing may lie beyond it.
    pub normal: f64,
}

impl Certainty {
    const NONE: Self = Self {
        t: f64::INFINITY,
        u: f64::INFINITY,
        normal: f64::INFINITY,
    };

    /// The bounds of a crossing near a joint on whose other side these others hold, the outline turning by `kink` there. None if it
    /// might lie beyond the next joint, too.
    fn through(&self, other: &Self, kink: f64) -> Self {
        if other.u >= 1.0 {
            return Self::NONE;
        }
        Self {
            t: self.t.max(other.t),
            // From the computed crossing to the joint, and on to the true one.
            u: self.u + other.u,
            normal: self.normal + kink + other.normal,
        }
    }
}

/// By what angle the outline turns from one piece to the next at the end (0 the start, 1 the end) of the first; π at most.
fn kink(curve: &Cubics, next: &Cubics, end: usize) -> f64 {
    let direction = |curve: &Cubics, u: f64| {
        let ([_, r1, _], [_, h1, _]) = (motion(&curve.radius, u), motion(&curve.height, u));
        [r1, h1]
    };
    let ends = [[0.0, 1.0], [1.0, 0.0]][end];
    let ([r1, h1], [r2, h2]) = (direction(curve, ends[0]), direction(next, ends[1]));
    libm::atan2((r1 * h2 - h1 * r2).abs(), r1 * r2 + h1 * h2)
}

impl Prepared {
    /// Bounds of the errors of a crossing of this profile with a ray in its own frame, found by whatever solver.
    ///
    /// The surface is taken as it is after scaling to the size 1 and centring, which moves heights by one rounding.
    pub fn certainty(&self, ray: &Ray, crossing: &Crossing) -> Certainty {
        let (line, fine) = Line::new(self, ray);
        let piece = self.pieces.iter().find(|p| p.index == crossing.piece);
        let (true, Some(piece)) = (fine, piece) else {
            return Certainty::NONE;
        };
        let [a, b] = line.times.unit;
        let t = crossing.t / a / b;
        let own = line.certainty(&piece.curve, t, crossing.u);
        let outside = [crossing.u - own.u < 0.0, crossing.u + own.u > 1.0];
        let scaled = [0, 1].into_iter().filter(|&end| outside[end]);
        let scaled = scaled.fold(own, |bound, end| {
            let next = piece.neighbours[end].map(|place| &self.pieces[place].curve);
            next.map_or(bound, |next| {
                let other = line.certainty(next, t, [1.0, 0.0][end]);
                bound.through(&other, kink(&piece.curve, next, end))
            })
        });
        Certainty {
            // One more rounding: that of the answer itself.
            t: scaled.t * a * b + f64::EPSILON * crossing.t.abs(),
            ..scaled
        }
    }
}

impl Line {
    fn certainty(&self, curve: &Cubics, t: f64, u: f64) -> Certainty {
        let aim = &self.aim;
        let ([r, r1, r2], [h, h1, h2]) = (motion(&curve.radius, u), motion(&curve.height, u));
        let (px, pz) = (aim.o.x + t * aim.d.x, aim.o.z + t * aim.d.z);
        let towards = px * aim.d.x + pz * aim.d.z;
        let distance = (px * px + pz * pz).sqrt();
        // Half an ulp for each product and sum, and for the centring of o_y; ten of those for a cubic, in ulps of its control values.
        let [width, height] = [&curve.radius, &curve.height].map(|c| c.map(f64::abs));
        let [width, height] = [width, height].map(|c| c.into_iter().fold(0.0, f64::max));
        let (sx, sz) = ((t * aim.d.x).abs(), (t * aim.d.z).abs());
        let off = 0.5 * f64::EPSILON * (sx + sz + px.abs() + pz.abs());
        let across = 0.5 * (px * px + pz * pz - r * r).abs()
            + distance * off
            + f64::EPSILON * (distance * distance + r * r + 5.0 * r.abs() * width);
        let along = (aim.o.y + t * aim.d.y - h).abs()
            + f64::EPSILON * (aim.o.y.abs() + (t * aim.d.y).abs() + 5.0 * height);
        let determinant = r * r1 * aim.d.y - towards * h1;
        let inverse = 2.0 / determinant.abs();
        let dt = (across * h1.abs() + (r * r1).abs() * along) * inverse;
        let du = (aim.d.y.abs() * across + towards.abs() * along) * inverse;
        let bend = (r1 * r1 + (r * r2).abs()) * aim.d.y.abs() + (towards * h2).abs();
        let change = du * bend + dt * aim.across * h1.abs() + du * dt * aim.across * h2.abs();
        let holds = change < 0.25 * determinant.abs();
        if !holds {
            return Certainty::NONE;
        }
        let speed = r1 * r1 + h1 * h1;
        let turn = (r1 * h2 - h1 * r2).abs() / speed * du;
        // The azimuth moves with the point; slopes come of 32 roundings of control differences, which are below 2.
        let azimuth = (dt * aim.across.sqrt() + 4.0 * off) / distance;
        Certainty {
            t: dt,
            u: du,
            normal: 2.0 * (turn + azimuth) + 64.0 * f64::EPSILON / speed.sqrt(),
        }
    }
}

/// A cubic with its first and second derivative.
fn motion(c: &[f64; 4], u: f64) -> [f64; 3] {
    let (value, slope) = cubic(c, u);
    let (first, last) = (c[2] - 2.0 * c[1] + c[0], c[3] - 2.0 * c[2] + c[1]);
    [value, slope, 6.0 * ((1.0 - u) * first + u * last)]
}
