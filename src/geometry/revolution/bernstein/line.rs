//! A ray in the scaled frame of a prepared profile: coefficients, values, and what a root gives.

use super::{Padded, Prepared, PreparedPiece, Root, Undecided};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::cubic;
use glam::DVec3;

/// A ray scaled by powers of two, which change no bits: its greatest direction component is in [1, 2), lengths are in units of
/// the profile's size, heights are centred.
pub(super) struct Line {
    pub(super) o: DVec3,
    pub(super) d: DVec3,
    /// q₀ = (o_x d_y − o_y d_x, o_z d_y − o_y d_z).
    q: [f64; 2],
    /// A = d_x² + d_z².
    pub(super) across: f64,
    /// D = d_y².
    along: f64,
    /// B = q₀·(d_x, d_z).
    b: f64,
    /// K = |q₀|².
    k: f64,
    /// Bound of the error of a coefficient fᵢ.
    pub(super) error: f64,
    /// |o_x| + |o_y| + |o_z|.
    pub(super) reach: f64,
    /// Greatest control radius and height of the profile.
    pub(super) size: [f64; 2],
    /// Heights of the ray inside its range and the bounding cylinder, widened.
    heights: [f64; 2],
    /// t is the product of the scaled t with both.
    unit: [f64; 2],
    /// The range, scaled.
    range: [f64; 2],
}

/// Origins farther than this many sizes are left to the exact solver (squares of squares must not overflow).
const FAR: f64 = 1e30;

/// A ray nearer to perpendicular than this (d_y² against d_x² + d_z²) is solved by branches.
const NEARLY_LEVEL: f64 = 1e-4;

/// Below this, f is a square to within rounding.
const LEVEL: f64 = 1e-10;

impl Line {
    #[inline]
    pub(super) fn new(
        prepared: &Prepared,
        ray: &Ray,
        interval: (f64, f64),
    ) -> Result<Self, Undecided> {
        let speed = exponent(ray.direction.abs().max_element());
        let [s1, s2] = halves(-speed);
        let [l1, l2] = halves(-prepared.exponent);
        let power = prepared.exponent - speed;
        let d = ray.direction * s1 * s2;
        let mut o = ray.origin;
        o.y -= prepared.middle;
        let o = o * l1 * l2;
        let reach = o.x.abs() + o.y.abs() + o.z.abs();
        let near = reach < FAR;
        if !near || power.abs() > 2000 {
            return Err(Undecided);
        }
        let unit = halves(power);
        let [t1, t2] = halves(-power);
        let q = [o.x * d.y - o.y * d.x, o.z * d.y - o.y * d.z];
        let (across, along) = (d.x * d.x + d.z * d.z, d.y * d.y);
        let k = q[0] * q[0] + q[1] * q[1];
        let [r, h] = [prepared.radius, prepared.height];
        // |q| is at most this on the profile. Each coefficient is a sum of four terms of fewer than 14 roundings each, of size
        // D r² + |q|² in all; q₀ itself is off by at most three roundings of |o| |d|, |d| < 4.
        let most = k.sqrt() + h * across.sqrt();
        let error = 32.0 * f64::EPSILON * (along * r * r + most * most)
            + 32.0 * f64::EPSILON * most * reach
            + 1e-290;
        let low = interval.0.max(ray.t_min) * t1 * t2;
        let high = interval.1.min(ray.t_max) * t1 * t2;
        Ok(Self {
            o,
            d,
            q,
            across,
            along,
            b: q[0] * d.x + q[1] * d.z,
            k,
            error,
            reach,
            size: [r, h],
            heights: height_range(o.y, d.y, low, high),
            unit,
            range: [ray.t_min * t1 * t2, ray.t_max * t1 * t2],
        })
    }

    pub(super) fn climbs(&self) -> bool {
        self.d.y > 0.0
    }

    pub(super) fn is_nearly_level(&self) -> bool {
        self.along < NEARLY_LEVEL * self.across
    }

    pub(super) fn is_level(&self) -> bool {
        self.along < LEVEL * self.across
    }

    /// Whether the ray passes no height of the piece.
    #[inline]
    pub(super) fn misses_heights(&self, piece: &PreparedPiece) -> bool {
        piece.top < self.heights[0] || piece.bottom > self.heights[1]
    }

    /// Whether the ray meets every height of the piece only after this root.
    #[inline]
    pub(super) fn meets_later(&self, piece: &PreparedPiece, root: &Root) -> bool {
        if self.is_nearly_level() {
            return false;
        }
        let slack = 64.0 * f64::EPSILON * (self.reach + 1.0);
        if self.climbs() {
            piece.bottom > root.height + slack
        } else {
            piece.top < root.height - slack
        }
    }

    /// Bernstein coefficients of f on a piece.
    #[inline]
    pub(super) fn coefficients(&self, piece: &PreparedPiece) -> Padded {
        let twice_b = 2.0 * self.b;
        let mut c = [0.0; 8];
        for (i, c) in c.iter_mut().enumerate() {
            *c = self.along * piece.radius_squared[i]
                - self.across * piece.height_squared[i]
                - twice_b * piece.height_raised[i]
                - self.k;
        }
        c
    }

    /// f and f′ at `u`, from the two cubics: never from the expanded polynomial.
    #[inline]
    pub(super) fn value(&self, piece: &PreparedPiece, u: f64) -> (f64, f64) {
        let (r, r_slope) = cubic(&piece.radius, u);
        let (h, h_slope) = cubic(&piece.height, u);
        let qx = self.q[0] + h * self.d.x;
        let qz = self.q[1] + h * self.d.z;
        let value = self.along * (r * r) - (qx * qx + qz * qz);
        let slope = self.along * r * r_slope - (qx * self.d.x + qz * self.d.z) * h_slope;
        (value, 2.0 * slope)
    }

    /// The root at a refined `u`: t by the better-conditioned of the two formulas, then polished.
    #[inline]
    pub(super) fn root_at(&self, piece: &PreparedPiece, u: f64) -> Root {
        let (h, _) = cubic(&piece.height, u);
        let t = if self.along >= 0.01 * self.across {
            (h - self.o.y) / self.d.y
        } else {
            let (r, _) = cubic(&piece.radius, u);
            let half = self.half_chord_squared(r).max(0.0).sqrt() / self.across.sqrt();
            let side = (self.b + h * self.across) * self.d.y;
            self.closest() + if side < 0.0 { -half } else { half }
        };
        self.polish(piece, u, t)
    }

    /// Parameter of the point of the ray that is nearest to the axis.
    #[inline]
    pub(super) fn closest(&self) -> f64 {
        -(self.o.x * self.d.x + self.o.z * self.d.z) / self.across
    }

    /// Squared distance of the ray from the axis.
    #[inline]
    pub(super) fn axis_distance_squared(&self) -> f64 {
        let cross = self.o.x * self.d.z - self.o.z * self.d.x;
        cross * cross / self.across
    }

    /// r² − ρ²: the square of half the horizontal chord in a circle of radius r.
    #[inline]
    fn half_chord_squared(&self, r: f64) -> f64 {
        let distance = self.axis_distance_squared().sqrt();
        (r.abs() - distance) * (r.abs() + distance)
    }

    /// Newton steps on both equations at once, |o + t d|² = r² across the axis and o_y + t d_y = h along it. Their matrix is
    /// regular wherever the ray is not tangent, for every direction, so t and u come out as exact as the ray allows.
    #[inline]
    pub(super) fn polish(&self, piece: &PreparedPiece, u: f64, t: f64) -> Root {
        let (mut root, mut change) = self.polish_once(piece, u, t);
        // The error left is of the order of the square of the change, divided by the distance to the nearest other root.
        for _ in 0..4 {
            if !(1e-11..1e-3).contains(&change) {
                break;
            }
            (root, change) = self.polish_once(piece, root.u, root.t);
        }
        root
    }

    /// One step, with its size. The root stays as it is where the step is too great for a polish: the ray is nearly tangent there,
    /// and the root as isolated is better.
    #[inline]
    fn polish_once(&self, piece: &PreparedPiece, u: f64, t: f64) -> (Root, f64) {
        let (r, r_slope) = cubic(&piece.radius, u);
        let (h, h_slope) = cubic(&piece.height, u);
        let (px, pz) = (self.o.x + t * self.d.x, self.o.z + t * self.d.z);
        let towards = px * self.d.x + pz * self.d.z;
        let across = 0.5 * (px * px + pz * pz - r * r);
        let along = self.o.y + t * self.d.y - h;
        let fall = r * r_slope;
        let determinant = 1.0 / (fall * self.d.y - towards * h_slope);
        let dt = (across * h_slope - fall * along) * determinant;
        let du = (self.d.y * across - towards * along) * determinant;
        let change = du.abs().max(dt.abs());
        let (t, u) = if change < 1e-3 {
            (t + dt, (u + du).clamp(0.0, 1.0))
        } else {
            (t, u)
        };
        let scale = self.reach + 4.0 * t.abs() + 1.0;
        let sure = 8.0 * f64::EPSILON * scale * r.abs() * (h_slope.abs() + r_slope.abs());
        let root = Root {
            u,
            t,
            // At a tangency the error of t is the root of a rounding.
            tolerance: (sure * determinant.abs()).min(1e-7 * scale),
            height: h,
        };
        (root, change)
    }

    /// Where the ray meets the plane of a height: t, the distance from the axis there, and the error of its square, both against
    /// coefficients r². `None` for a ray in or parallel to the plane.
    pub(super) fn plane(&self, height: f64) -> Option<(f64, f64, f64)> {
        if self.d.y == 0.0 {
            return None;
        }
        let t = (height - self.o.y) / self.d.y;
        let (px, pz) = (self.o.x + t * self.d.x, self.o.z + t * self.d.z);
        let distance = (px * px + pz * pz).sqrt();
        let [r, _] = self.size;
        let scale = self.reach + 4.0 * t.abs() * self.across.sqrt();
        let error = f64::EPSILON * (32.0 * (r * r + distance * distance) + 16.0 * distance * scale);
        Some((t, distance, error + 1e-290))
    }

    pub(super) fn flat_root(&self, u: f64, t: f64, height: f64) -> Root {
        let tolerance = 4.0 * f64::EPSILON * ((self.reach + 1.0) / self.d.y.abs() + t.abs());
        Root {
            u,
            t,
            tolerance,
            height,
        }
    }

    /// Whether the root lies inside the open range.
    #[inline]
    pub(super) fn in_range(&self, root: &Root) -> Result<bool, Undecided> {
        let (above, below) = (root.t - self.range[0], self.range[1] - root.t);
        if above.abs() <= root.tolerance || below.abs() <= root.tolerance {
            return Err(Undecided);
        }
        Ok(above > 0.0 && below > 0.0)
    }

    pub(super) fn crossing(&self, piece: u32, root: &Root) -> Crossing {
        Crossing {
            t: root.t * self.unit[0] * self.unit[1],
            piece,
            u: root.u,
        }
    }
}

/// Heights between two parameters, widened by more than the rounding of both ends.
fn height_range(o: f64, d: f64, low: f64, high: f64) -> [f64; 2] {
    if d == 0.0 {
        let slack = 16.0 * f64::EPSILON * (o.abs() + 1.0);
        return [o - slack, o + slack];
    }
    let (a, b) = (o + low * d, o + high * d);
    let slack = |end: f64| 16.0 * f64::EPSILON * (o.abs() + end.abs() + 1.0);
    let (low, high) = (a.min(b), a.max(b));
    [low - slack(low), high + slack(high)]
}

/// The power of two e with 2ᵉ ≤ x < 2ᵉ⁺¹, for x > 0; 0 for x = 0.
#[inline]
pub(super) fn exponent(x: f64) -> i32 {
    let bits = (x.to_bits() >> 52) as i32 & 0x7ff;
    if bits > 0 {
        bits - 1023
    } else if x == 0.0 {
        0
    } else {
        libm::ilogb(x)
    }
}

/// Two powers of two whose product is 2ⁿ, for |n| ≤ 2040.
#[inline]
fn halves(n: i32) -> [f64; 2] {
    let first = n / 2;
    [first, n - first].map(|n| f64::from_bits(((n + 1023) as u64) << 52))
}
