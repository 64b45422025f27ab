//! A ray in the scaled frame of a prepared profile: coefficients, values, and what a root gives.

use super::{Cubics, Padded, Prepared, PreparedPiece, Root, Undecided};
use crate::geometry::bounds::Cylinder;
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::cubic;
use glam::DVec3;

/// A ray scaled by powers of two, which change no bits: its greatest direction component is in [1, 2), lengths are in units of
/// the profile's size, heights are centred.
#[derive(Clone, Copy)]
pub(super) struct Aim {
    pub(super) o: DVec3,
    pub(super) d: DVec3,
    /// q₀ = (o_x d_y − o_y d_x, o_z d_y − o_y d_z).
    pub(super) q: [f64; 2],
    /// A = d_x² + d_z².
    pub(super) across: f64,
    /// D = d_y².
    pub(super) along: f64,
    /// 1/d_y.
    pub(super) rise: f64,
    /// |o_x| + |o_y| + |o_z|.
    pub(super) reach: f64,
    /// 1/(1 + `reach`), the unit of changes of t.
    shrink: f64,
}

impl Aim {
    #[inline(always)]
    pub(super) fn new(o: DVec3, d: DVec3) -> Self {
        let reach = o.x.abs() + o.y.abs() + o.z.abs();
        Self {
            q: [o.x * d.y - o.y * d.x, o.z * d.y - o.y * d.z],
            across: d.x * d.x + d.z * d.z,
            along: d.y * d.y,
            rise: 1.0 / d.y,
            shrink: 1.0 / (1.0 + reach),
            o,
            d,
            reach,
        }
    }

    /// f, f′, f″ and f‴ at `u`, halved, from the two cubics: never from the expanded polynomial.
    #[inline(always)]
    pub(super) fn derivatives(&self, curve: &Cubics, u: f64) -> [f64; 4] {
        let [r, r1, r2, r3] = power(&curve.radius_powers, u);
        let [h, h1, h2, h3] = power(&curve.height_powers, u);
        let (dx, dz) = (self.d.x, self.d.z);
        let (qx, qz) = (self.q[0] + h * dx, self.q[1] + h * dz);
        let towards = qx * dx + qz * dz;
        [
            0.5 * (self.along * (r * r) - (qx * qx + qz * qz)),
            self.along * (r * r1) - towards * h1,
            self.along * (r1 * r1 + r * r2) - (self.across * (h1 * h1) + towards * h2),
            self.along * (3.0 * (r1 * r2) + r * r3)
                - (3.0 * self.across * (h1 * h2) + towards * h3),
        ]
    }

    /// f and f′ at `u`.
    pub(super) fn value(&self, curve: &Cubics, u: f64) -> (f64, f64) {
        let (r, r_slope) = cubic(&curve.radius, u);
        let (h, h_slope) = cubic(&curve.height, u);
        let qx = self.q[0] + h * self.d.x;
        let qz = self.q[1] + h * self.d.z;
        let value = self.along * (r * r) - (qx * qx + qz * qz);
        let slope = self.along * r * r_slope - (qx * self.d.x + qz * self.d.z) * h_slope;
        (value, 2.0 * slope)
    }

    /// The root at a refined `u`: t by the better-conditioned of the two formulas, then polished.
    pub(super) fn root_at(&self, curve: &Cubics, u: f64) -> Root {
        let (h, _) = cubic(&curve.height, u);
        let t = if self.along >= 0.01 * self.across {
            (h - self.o.y) / self.d.y
        } else {
            let (r, _) = cubic(&curve.radius, u);
            let half = self.half_chord_squared(r).max(0.0).sqrt() / self.across.sqrt();
            let b = self.q[0] * self.d.x + self.q[1] * self.d.z;
            let side = (b + h * self.across) * self.d.y;
            self.closest() + if side < 0.0 { -half } else { half }
        };
        self.polish(curve, u, t)
    }

    /// Parameter of the point of the ray that is nearest to the axis.
    pub(super) fn closest(&self) -> f64 {
        -(self.o.x * self.d.x + self.o.z * self.d.z) / self.across
    }

    /// Squared distance of the ray from the axis.
    pub(super) fn axis_distance_squared(&self) -> f64 {
        let cross = self.o.x * self.d.z - self.o.z * self.d.x;
        cross * cross / self.across
    }

    /// r² − ρ²: the square of half the horizontal chord in a circle of radius r.
    fn half_chord_squared(&self, r: f64) -> f64 {
        let distance = self.axis_distance_squared().sqrt();
        (r.abs() - distance) * (r.abs() + distance)
    }

    /// Newton steps on both equations at once, |o + t d|² = r² across the axis and o_y + t d_y = h along it. Their matrix is
    /// regular wherever the ray is not tangent, for every direction, so t and u come out as exact as the ray allows.
    pub(super) fn polish(&self, curve: &Cubics, u: f64, t: f64) -> Root {
        let (mut root, mut change) = self.polish_once(curve, u, t);
        // The error left is of the order of the square of the change, divided by the distance to the nearest other root.
        for _ in 0..4 {
            if !(1e-11..COARSE).contains(&change) {
                break;
            }
            (root, change) = self.polish_once(curve, root.u, root.t);
        }
        root
    }

    /// One step. The root stays as it is where the step is too great for a polish: the ray is nearly tangent there, and the root as
    /// isolated is better.
    fn polish_once(&self, curve: &Cubics, u: f64, t: f64) -> (Root, f64) {
        let (root, change) = self.newton(curve, u, t);
        if change < COARSE {
            (root, change)
        } else {
            (Root { u, t, ..root }, change)
        }
    }

    /// One of Newton's steps on both equations, with its size (of t in units of the reach).
    #[inline(always)]
    pub(super) fn newton(&self, curve: &Cubics, u: f64, t: f64) -> (Root, f64) {
        let (r, r_slope) = cubic(&curve.radius, u);
        let (h, h_slope) = cubic(&curve.height, u);
        let (px, pz) = (self.o.x + t * self.d.x, self.o.z + t * self.d.z);
        let towards = px * self.d.x + pz * self.d.z;
        let across = 0.5 * (px * px + pz * pz - r * r);
        let along = self.o.y + t * self.d.y - h;
        let fall = r * r_slope;
        let determinant = 1.0 / (fall * self.d.y - towards * h_slope);
        let dt = (across * h_slope - fall * along) * determinant;
        let du = (self.d.y * across - towards * along) * determinant;
        let change = greater(du.abs(), dt.abs() * self.shrink);
        let scale = self.reach + 4.0 * t.abs() + 1.0;
        let sure = 8.0 * f64::EPSILON * scale * r.abs() * (h_slope.abs() + r_slope.abs());
        let root = Root {
            u: clamped(u + du, 0.0, 1.0),
            t: t + dt,
            // Along a wall this may be of any size, and no double root be near. A NaN is no bound.
            tolerance: lesser(f64::INFINITY, sure * determinant.abs()),
        };
        (root, change)
    }
}

/// A step of Newton's method this great says nothing of convergence.
pub(super) const COARSE: f64 = 1e-3;

/// A cubic and its derivatives at `u` from its powers.
#[inline(always)]
fn power([a, b, c, d]: &[f64; 4], u: f64) -> [f64; 4] {
    let (twice, triple) = (2.0 * c, 3.0 * d);
    [
        (a + b * u) + (u * u) * (c + d * u),
        b + u * (twice + triple * u),
        twice + 2.0 * triple * u,
        2.0 * triple,
    ]
}

/// The greater of two numbers; the first if one is NaN.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The lesser of two numbers; the first if one is NaN.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The number, or the limit beyond which it lies; the lower one for a NaN.
#[inline(always)]
pub(super) fn clamped(x: f64, low: f64, high: f64) -> f64 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

/// A ray against one prepared profile.
pub(super) struct Line {
    pub(super) aim: Aim,
    /// 2 B, B = q₀·(d_x, d_z).
    pub(super) twice_b: f64,
    /// K = |q₀|².
    pub(super) k: f64,
    /// Bound of the error of a coefficient fᵢ.
    pub(super) error: f64,
    /// Greatest control radius and height of the profile.
    pub(super) size: [f64; 2],
    /// Heights of the ray inside its range.
    pub(super) heights: [f64; 2],
    /// More than the error of a height.
    pub(super) slack: f64,
    /// Whether the ray certainly passes the cylinder by, inside its range.
    pub(super) outside: bool,
    pub(super) times: Times,
}

/// Origins farther than this many sizes are left to the exact solver (squares of squares must not overflow).
const FAR: f64 = 1e30;

/// More than the way from any origin to any surface.
const BEYOND: f64 = 1e100;

/// A ray nearer to perpendicular than this (d_y² against d_x² + d_z²) is solved by branches.
const NEARLY_LEVEL: f64 = 1e-6;

/// Below this, f is a square to within rounding.
const LEVEL: f64 = 1e-10;

impl Line {
    /// The ray in the frame of the profile, without branches, and whether that is so: no numbers too far apart for f64, and a ray that
    /// is valid.
    #[inline(always)]
    pub(super) fn new(prepared: &Prepared, ray: &Ray) -> (Self, bool) {
        let [x, y, z] = ray.direction.to_array().map(f64::abs);
        let greatest = greater(x, greater(y, z));
        let speed = exponent(greatest);
        let [s1, s2] = halves(-speed);
        let [l1, l2] = prepared.shrink;
        let power = prepared.exponent - speed;
        let d = ray.direction * s1 * s2;
        let mut o = ray.origin;
        o.y -= prepared.middle;
        let aim = Aim::new(o * l1 * l2, d);
        let fine = (aim.reach < FAR)
            & (power < 2000)
            & (power > -2000)
            & (greatest >= f64::MIN_POSITIVE)
            & (x + y + z < f64::INFINITY)
            & (ray.t_min < ray.t_max);
        let unit = halves(power);
        let [t1, t2] = halves(-power);
        let range = [ray.t_min * t1 * t2, ray.t_max * t1 * t2];
        let (q, along) = (aim.q, aim.along);
        let [r, h] = [prepared.radius, prepared.height];
        // |q| is at most this on the profile. Each coefficient is a sum of four terms of fewer than 14 roundings each, of size
        // D r² + |q|² in all; q₀ itself is off by at most three roundings of |o| |d|, |d| < 4.
        let rounding = 8.0 * f64::EPSILON * aim.reach;
        let most = q[0].abs() + q[1].abs() + h * (d.x.abs() + d.z.abs()) + rounding;
        let error = 32.0 * f64::EPSILON * (along * (r * r) + most * (most + aim.reach)) + 1e-290;
        let slack = 64.0 * f64::EPSILON * (aim.reach + 1.0);
        let (stretch, beside) = prepared.stretch(&aim, range);
        let [low, high] = height_range(aim.o.y, d.y, stretch);
        let Cylinder { bottom, top, .. } = prepared.cylinder;
        let outside = beside | (low > top + slack) | (high < bottom - slack);
        let line = Self {
            twice_b: 2.0 * (q[0] * d.x + q[1] * d.z),
            k: q[0] * q[0] + q[1] * q[1],
            error,
            size: [r, h],
            heights: height_range(aim.o.y, d.y, range),
            slack,
            outside,
            times: Times { unit, range },
            aim,
        };
        (line, fine)
    }

    #[inline(always)]
    pub(super) fn climbs(&self) -> bool {
        self.aim.d.y > 0.0
    }

    #[inline(always)]
    pub(super) fn is_nearly_level(&self) -> bool {
        self.aim.along < NEARLY_LEVEL * self.aim.across
    }

    pub(super) fn is_level(&self) -> bool {
        self.aim.along < LEVEL * self.aim.across
    }

    /// Whether the ray passes no height of the piece inside its range.
    #[inline(always)]
    pub(super) fn misses_heights(&self, piece: &PreparedPiece) -> bool {
        let [low, high] = self.heights;
        (piece.top < low - self.slack) | (piece.bottom > high + self.slack)
    }

    /// Whether a crossing with the piece is certain to lie inside the ray's range.
    #[inline(always)]
    pub(super) fn holds(&self, piece: &PreparedPiece) -> bool {
        holds(self.heights, self.slack, piece)
    }

    /// Height after which the ray meets nothing.
    #[inline(always)]
    pub(super) fn end(&self) -> f64 {
        if self.climbs() {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        }
    }

    /// Height after which everything is certainly later than a root: the root's own, as its t tells it.
    #[inline(always)]
    pub(super) fn after(&self, root: &Root) -> f64 {
        let Aim { o, d, .. } = self.aim;
        let latest = o.y + (root.t + root.tolerance) * d.y;
        if self.climbs() {
            latest + self.slack
        } else {
            latest - self.slack
        }
    }

    /// The one of two heights that the ray meets first.
    #[inline(always)]
    pub(super) fn sooner(&self, a: f64, b: f64) -> f64 {
        if (b < a) == self.climbs() { b } else { a }
    }

    /// Whether the ray meets every height of the piece only after this one.
    #[inline(always)]
    pub(super) fn meets_after(&self, piece: &PreparedPiece, end: f64) -> bool {
        if self.climbs() {
            piece.bottom > end
        } else {
            piece.top < end
        }
    }

    /// Bernstein coefficients of f on a piece.
    #[inline(always)]
    pub(super) fn coefficients(&self, piece: &PreparedPiece) -> Padded {
        let mut c = [0.0; 8];
        for (i, c) in c.iter_mut().enumerate() {
            *c = self.aim.along * piece.radius_squared[i]
                - self.aim.across * piece.height_squared[i]
                - self.twice_b * piece.height_raised[i]
                - self.k;
        }
        c
    }

    /// Where the ray meets the plane of a height: t, the distance from the axis there, and the error of its square, both against
    /// coefficients r². `None` for a ray in or parallel to the plane.
    #[inline(always)]
    pub(super) fn plane(&self, height: f64) -> Option<(f64, f64, f64)> {
        let Aim {
            o,
            d,
            across,
            reach,
            ..
        } = self.aim;
        if d.y == 0.0 {
            return None;
        }
        let t = (height - o.y) / d.y;
        // A nearly level ray meets it beyond all sizes: where does not matter, but squares must not overflow.
        let near = clamped(t, -BEYOND, BEYOND);
        let (px, pz) = (o.x + near * d.x, o.z + near * d.z);
        let distance = (px * px + pz * pz).sqrt();
        let [r, _] = self.size;
        let scale = reach + 4.0 * near.abs() * across.sqrt();
        let error = f64::EPSILON * (32.0 * (r * r + distance * distance) + 16.0 * distance * scale);
        // Both heights were centred, with a rounding each: that moves t, the more the less the ray climbs.
        let noise = self.height_noise();
        let early = lesser(noise / d.y.abs(), BEYOND * (noise / (height - o.y).abs()));
        let aside = across.sqrt() * early;
        Some((
            t,
            distance,
            error + aside * (2.0 * distance + aside) + 1e-290,
        ))
    }

    /// More than the roundings of a height above the origin.
    #[inline(always)]
    fn height_noise(&self) -> f64 {
        4.0 * f64::EPSILON * (self.aim.reach + 1.0)
    }

    #[inline(always)]
    pub(super) fn flat_root(&self, u: f64, t: f64) -> Root {
        let tolerance = self.height_noise() / self.aim.d.y.abs() + 4.0 * f64::EPSILON * t.abs();
        Root { u, t, tolerance }
    }
}

impl Prepared {
    /// The part of a range inside the wall of the tight cylinder, widened by more than its rounding, and whether there is none.
    #[inline(always)]
    fn stretch(&self, aim: &Aim, [low, high]: [f64; 2]) -> ([f64; 2], bool) {
        let Aim {
            o,
            d,
            across,
            reach,
            ..
        } = *aim;
        let cross = o.x * d.z - o.z * d.x;
        let inverse = 1.0 / across;
        let radius = self.cylinder.radius + MARGIN * (self.cylinder.radius + reach);
        let square = across * (radius * radius) - cross * cross;
        // The root of a rounding, where the ray touches the wall; and the rounding of `middle`.
        let touch = MARGIN * (across * (radius * (radius + reach)));
        let shift = MARGIN * (reach + 1.0) * ((d.x.abs() + d.z.abs()) * inverse);
        // Below, the squares underflow.
        let tame = across * (radius * radius) > 1e-290;
        let half = if tame {
            (greater(0.0, square) + touch).sqrt() * inverse + shift
        } else {
            f64::INFINITY
        };
        let middle = -(o.x * d.x + o.z * d.z) * inverse;
        // A ray parallel to the axis makes NaN or infinities here, which change nothing.
        let (low, high) = (greater(low, middle - half), lesser(high, middle + half));
        let beside = (square < 0.0) & tame;
        ([low, high], beside | (low > high))
    }
}

/// More than the roundings of a bound.
const MARGIN: f64 = 16.0 * f64::EPSILON;

/// The range of a ray, scaled, and the way back.
#[derive(Clone, Copy)]
pub(super) struct Times {
    /// t is the product of the scaled t with both.
    pub(super) unit: [f64; 2],
    pub(super) range: [f64; 2],
}

impl Times {
    pub(super) const NONE: Self = Self {
        unit: [1.0; 2],
        range: [0.0; 2],
    };

    /// Whether the root lies inside the open range.
    #[inline(always)]
    pub(super) fn has(&self, root: &Root) -> Result<bool, Undecided> {
        let (above, below) = (root.t - self.range[0], self.range[1] - root.t);
        // A NaN is not clear.
        let clear = above.abs() > root.tolerance && below.abs() > root.tolerance;
        if !clear {
            return Err(Undecided);
        }
        Ok(above > 0.0 && below > 0.0)
    }

    /// # Errors
    /// Where t is more than a number can be, it may lie beyond any range.
    #[inline(always)]
    pub(super) fn crossing(&self, piece: u32, t: f64, u: f64) -> Result<Crossing, Undecided> {
        let t = t * self.unit[0] * self.unit[1];
        if t.abs() < f64::INFINITY {
            Ok(Crossing { t, piece, u })
        } else {
            Err(Undecided)
        }
    }
}

/// Whether all heights of a piece lie between two heights, by more than a slack.
#[inline(always)]
pub(super) fn holds([low, high]: [f64; 2], slack: f64, piece: &PreparedPiece) -> bool {
    (piece.bottom > low + slack) & (piece.top < high - slack)
}

/// Heights between two parameters. Far ones are of no interest, so their errors are not either.
#[inline(always)]
fn height_range(o: f64, d: f64, [low, high]: [f64; 2]) -> [f64; 2] {
    // The ends of a level ray may be infinite.
    let rise = |t: f64| if d == 0.0 { 0.0 } else { t * d };
    let (a, b) = (o + rise(low), o + rise(high));
    if a < b { [a, b] } else { [b, a] }
}

/// The power of two e with 2ᵉ ≤ x < 2ᵉ⁺¹, for x > 0; less than that for numbers below the normal ones.
#[inline(always)]
pub(super) fn exponent(x: f64) -> i64 {
    (x.to_bits() >> 52) as i64 - 1023
}

/// Two powers of two whose product is 2ⁿ, for |n| ≤ 2040.
#[inline(always)]
pub(super) fn halves(n: i64) -> [f64; 2] {
    // Half of n, rounded down, in numbers without sign.
    let first = ((n + 4096) as u64 >> 1) as i64 - 2048;
    [first, n - first].map(|n| f64::from_bits(((n + 1023) as u64) << 52))
}
