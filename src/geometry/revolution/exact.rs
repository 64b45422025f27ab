//! The exact oracle: the degree-6 polynomial in dyadic rationals.
//!
//! Eliminating θ and t from o + t d = S(u, θ) leaves g(u) = |q|² − d_y² r² = 0 with
//! q = (o_x d_y + (h − o_y) d_x, o_z d_y + (h − o_y) d_z) and t = (h − o_y)/d_y; for d_y = 0 it leaves h(u) = o_y and a
//! quadratic in t. Every f64 is a dyadic rational, so both are solved without rounding (see [`crate::numeric::exact`]).
//!
//! A ray that runs within a piece (along a generator of a cone, inside the plane of a flat disc) does not hit that piece; a
//! piece without area (all of it one point, or on the axis) is never hit.

use crate::geometry::hit::Crossing;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::Placement;
use crate::numeric::exact::{Dyadic, Polynomial, Root, bracket, sign};
use glam::DVec3;
use num_bigint::BigInt;
use num_traits::Zero;

/// A crossing with the multiplicity of its root: 1 for a transversal crossing off the axis, 2 or more for a tangency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CertainCrossing {
    /// The crossing; t is the f64 nearest to the exact value or its neighbour, u is within 2⁻⁵³.
    pub crossing: Crossing,
    /// Multiplicity of the root in u (times that in t where d_y = 0).
    pub multiplicity: u32,
    /// The exact t lies between these: neighbours, or the same number where it is one.
    pub bracket: [f64; 2],
}

/// Every crossing inside the open range of a ray in the profile's own frame, by rising t; a tangency counts once, a point
/// shared by two pieces once. Whether a root is real, in the piece and in the range is decided exactly.
pub fn crossings(profile: &Profile, ray: &Ray) -> Vec<Crossing> {
    let certain = certain_crossings(profile, ray);
    certain.into_iter().map(|c| c.crossing).collect()
}

/// As [`crossings`], with multiplicities.
pub fn certain_crossings(profile: &Profile, ray: &Ray) -> Vec<CertainCrossing> {
    if !ray.is_valid() {
        return Vec::new();
    }
    solve(profile.pieces(), &Line::new(profile.pieces(), ray))
}

/// As [`certain_crossings`] for a ray of the world and a placed profile. The change of frame is not rounded: the surface is that
/// of the points x for which Rᵀ(x − T) lies on the profile scaled by s, with R, T and s as they are stored.
pub fn placed_crossings(
    profile: &Profile,
    placement: &Placement,
    ray: &Ray,
) -> Vec<CertainCrossing> {
    if !ray.is_valid() {
        return Vec::new();
    }
    solve(
        profile.pieces(),
        &Line::placed(profile.pieces(), placement, ray),
    )
}

fn solve(pieces: &[Piece], line: &Line) -> Vec<CertainCrossing> {
    let mut found = Vec::new();
    let closed = is_closed(pieces);
    let mut joint_met = closed && ends_in_root(line, pieces);
    for (index, piece) in pieces.iter().enumerate() {
        let curve = Curve::new(line, piece);
        if curve.is_degenerate() {
            continue;
        }
        let equation = line.equation(&curve);
        let mut end_met = false;
        for mut root in equation.roots() {
            end_met |= root.is(1);
            if !(joint_met && root.is(0)) {
                line.resolve(&curve, &mut root, index as u32, &mut found);
            }
        }
        joint_met = end_met;
    }
    found.sort_by(|a, b| {
        let (a, b) = (a.crossing, b.crossing);
        (a.t.total_cmp(&b.t))
            .then(a.piece.cmp(&b.piece))
            .then(a.u.total_cmp(&b.u))
    });
    found
}

/// Whether the end of the chain is its start.
fn is_closed(pieces: &[Piece]) -> bool {
    match (pieces.first(), pieces.last()) {
        (Some(a), Some(b)) => a.radius[0] == b.radius[3] && a.height[0] == b.height[3],
        _ => false,
    }
}

/// Whether the line meets the end of the last piece that has an area.
fn ends_in_root(line: &Line, pieces: &[Piece]) -> bool {
    let mut curves = pieces.iter().rev().map(|piece| Curve::new(line, piece));
    curves
        .find(|curve| !curve.is_degenerate())
        .is_some_and(|curve| {
            let equation = line.equation(&curve);
            let end: BigInt = equation.coefficients().iter().sum();
            !equation.is_zero() && end.is_zero()
        })
}

/// Radius and height of a piece in units of 2^length.
struct Curve {
    radius: Polynomial,
    height: Polynomial,
}

impl Curve {
    fn new(line: &Line, piece: &Piece) -> Self {
        let whole = |values: &[f64; 4]| {
            Polynomial::cubic(
                &values.map(|v| Dyadic::from_f64(v).times(&line.scale).at(line.length)),
            )
        };
        Self {
            radius: whole(&piece.radius),
            height: whole(&piece.height),
        }
    }

    fn is_degenerate(&self) -> bool {
        self.radius.is_zero() || (self.radius.degree() == 0 && self.height.degree() == 0)
    }
}

/// The ray in whole numbers: the origin in units of 2^length, the direction in units of 2^speed.
struct Line {
    length: i64,
    speed: i64,
    /// Factor of the profile.
    scale: Dyadic,
    origin: [BigInt; 3],
    direction: [BigInt; 3],
    low: Option<Dyadic>,
    high: Option<Dyadic>,
}

impl Line {
    fn new(pieces: &[Piece], ray: &Ray) -> Self {
        let whole = |v: DVec3| v.to_array().map(Dyadic::from_f64);
        let one = Dyadic::from_f64(1.0);
        Self::from_parts(pieces, one, whole(ray.origin), whole(ray.direction), ray)
    }

    fn placed(pieces: &[Piece], placement: &Placement, ray: &Ray) -> Self {
        let whole = |v: DVec3| v.to_array().map(Dyadic::from_f64);
        let [from, to] = [whole(ray.origin), whole(placement.translate)];
        let offset = [0, 1, 2].map(|i| from[i].plus(&to[i].negated()));
        let direction = whole(ray.direction);
        let r = &placement.rotation;
        let axes = [r.x_axis, r.y_axis, r.z_axis].map(whole);
        let turned = |v: &[Dyadic; 3]| axes.each_ref().map(|axis| dot(axis, v));
        let scale = Dyadic::from_f64(placement.scale);
        Self::from_parts(pieces, scale, turned(&offset), turned(&direction), ray)
    }

    fn from_parts(
        pieces: &[Piece],
        scale: Dyadic,
        origin: [Dyadic; 3],
        direction: [Dyadic; 3],
        ray: &Ray,
    ) -> Self {
        let controls = pieces.iter().flat_map(|p| p.radius.iter().chain(&p.height));
        let controls: Vec<Dyadic> = controls
            .map(|&v| Dyadic::from_f64(v).times(&scale))
            .collect();
        let length = least_exponent(origin.iter().chain(&controls));
        let speed = least_exponent(direction.iter());
        let limit = |t: f64| t.is_finite().then(|| Dyadic::from_f64(t));
        Self {
            length,
            speed,
            scale,
            origin: origin.map(|x| x.at(length)),
            direction: direction.map(|x| x.at(speed)),
            low: limit(ray.t_min),
            high: limit(ray.t_max),
        }
    }

    fn is_level(&self) -> bool {
        self.direction[1].is_zero()
    }

    /// The polynomial whose roots are the crossings' u.
    fn equation(&self, curve: &Curve) -> Polynomial {
        let [ox, oy, oz] = &self.origin;
        let [dx, dy, dz] = &self.direction;
        let one = BigInt::from(1);
        if self.is_level() {
            return curve.height.affine(&one, &-oy);
        }
        let qx = curve.height.affine(dx, &(ox * dy - oy * dx));
        let qz = curve.height.affine(dz, &(oz * dy - oy * dz));
        let radius = curve.radius.squared();
        qx.squared()
            .plus(&qz.squared())
            .plus(&radius.affine(&-(dy * dy), &BigInt::zero()))
    }

    /// Adds the crossings of one root in u.
    fn resolve(
        &self,
        curve: &Curve,
        root: &mut Root,
        piece: u32,
        found: &mut Vec<CertainCrossing>,
    ) {
        let times = if self.is_level() {
            self.level_times(curve, root)
        } else {
            self.sloping_time(curve, root).into_iter().collect()
        };
        for (t, bracket, factor) in times {
            let u = root.to_f64();
            found.push(CertainCrossing {
                crossing: Crossing { t, piece, u },
                multiplicity: root.multiplicity() * factor,
                bracket,
            });
        }
    }

    /// t = (h − o_y)/d_y, where it is in range.
    fn sloping_time(&self, curve: &Curve, root: &mut Root) -> Option<Time> {
        let dy = Dyadic::new(self.direction[1].clone(), self.speed);
        let rise = curve.height.affine(&BigInt::from(1), &-&self.origin[1]);
        let sign_above = |root: &mut Root, limit: &Dyadic| {
            let step = dy.times(limit);
            let unit = self.length.min(step.exponent);
            let scale = BigInt::from(1) << (self.length - unit) as u64;
            let excess = rise.affine(&scale, &-step.at(unit));
            root.sign_of(&excess) * sign(&dy.mantissa)
        };
        let mut above =
            |limit: &Option<Dyadic>| limit.as_ref().map(|limit| sign_above(root, limit));
        let inside =
            above(&self.low).is_none_or(|s| s > 0) && above(&self.high).is_none_or(|s| s < 0);
        inside.then(|| {
            let mut value = root.value_of(&rise);
            value.exponent += self.length;
            let t = value.over(&dy);
            (t, bracket(t, |limit| sign_above(root, limit)), 1)
        })
    }

    /// The solutions t of a t² + 2 b t + c − r² = 0 in the plane h = o_y that are in range, each with its multiplicity.
    fn level_times(&self, curve: &Curve, root: &mut Root) -> Vec<Time> {
        let [ox, _, oz] = &self.origin;
        let [dx, _, dz] = &self.direction;
        let a = dx * dx + dz * dz;
        let b = ox * dx + oz * dz;
        let cross = ox * dz - oz * dx;
        let square = curve.radius.squared();
        let discriminant = square.affine(&a, &-(&cross * &cross));
        let size = root.sign_of(&discriminant);
        if size < 0 {
            return Vec::new();
        }
        let level = Level {
            line: self,
            a: Dyadic::new(a, 2 * self.speed),
            b: Dyadic::new(b, self.length + self.speed),
            discriminant: &discriminant,
        };
        let branches: &[i32] = if size == 0 { &[1] } else { &[-1, 1] };
        let inside = branches.iter().filter(|&&branch| {
            let above = |limit: &Option<Dyadic>, root: &mut Root| {
                (limit.as_ref()).map(|limit| level.sign_above(branch, limit, root))
            };
            above(&self.low, root).is_none_or(|s| s > 0)
                && above(&self.high, root).is_none_or(|s| s < 0)
        });
        let inside: Vec<i32> = inside.copied().collect();
        let product = square.affine(&BigInt::from(-1), &(ox * ox + oz * oz));
        let times = inside.into_iter();
        times
            .map(|branch| {
                let t = level.time(branch, &product, root);
                let bounds = bracket(t, |limit| level.sign_above(branch, limit, root));
                (t, bounds, if size == 0 { 2 } else { 1 })
            })
            .collect()
    }
}

/// The quadratic in t of a ray perpendicular to the axis: t = (−b ± √Δ)/a.
struct Level<'a> {
    line: &'a Line,
    a: Dyadic,
    b: Dyadic,
    discriminant: &'a Polynomial,
}

impl Level<'_> {
    /// Sign of t − `limit` on a branch: that of ±√Δ − k with k = a limit + b.
    fn sign_above(&self, branch: i32, limit: &Dyadic, root: &mut Root) -> i32 {
        let k = self.a.times(limit).plus(&self.b);
        if sign(&k.mantissa) * branch < 0 {
            return branch;
        }
        let unit = self.line.length + self.line.speed;
        let k_unit = k.exponent.min(unit);
        let scale = BigInt::from(1) << (2 * (unit - k_unit)) as u64;
        let k = k.at(k_unit);
        let excess = self.discriminant.affine(&scale, &-(&k * &k));
        branch * root.sign_of(&excess)
    }

    /// t on a branch, without cancellation: the root of greater size from −b ∓ √Δ, the other from the product of both.
    fn time(&self, branch: i32, product: &Polynomial, root: &mut Root) -> f64 {
        let mut delta = root.value_of(self.discriminant);
        if delta.mantissa.is_zero() {
            return self.b.negated().over(&self.a);
        }
        delta.exponent += 2 * (self.line.length + self.line.speed);
        let far_branch = if sign(&self.b.mantissa) < 0 { 1 } else { -1 };
        let distance = delta.sqrt();
        let far = if far_branch > 0 {
            distance.plus(&self.b.negated())
        } else {
            distance.plus(&self.b).negated()
        };
        if branch == far_branch {
            return far.over(&self.a);
        }
        let mut value = root.value_of(product);
        value.exponent += 2 * self.line.length;
        value.over(&far)
    }
}

/// A parameter t, the numbers next to it, and its multiplicity.
type Time = (f64, [f64; 2], u32);

fn dot(a: &[Dyadic; 3], b: &[Dyadic; 3]) -> Dyadic {
    let [x, y, z] = [0, 1, 2].map(|i| a[i].times(&b[i]));
    x.plus(&y).plus(&z)
}

/// The least exponent of the non-zero numbers, or 0.
fn least_exponent<'a>(values: impl Iterator<Item = &'a Dyadic>) -> i64 {
    let exponents = values.filter(|v| !v.mantissa.is_zero()).map(|v| v.exponent);
    exponents.min().unwrap_or(0)
}
