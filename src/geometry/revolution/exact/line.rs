//! The ray and a piece in whole numbers, and the t of a root in u.

use super::{Piece, Placement, Ray};
use crate::numeric::exact::{Branches, Dyadic, Polynomial, Root, sign};
use glam::DVec3;
use num_bigint::BigInt;
use num_traits::Zero;
use std::cmp::Ordering;
use std::rc::Rc;

/// Rays with d_y² below 2⁻ⁿ (d_x² + d_z²) are solved by branches.
const NEARLY_LEVEL_BITS: u64 = 16;

/// Radius and height of a piece in units of 2^length.
pub(super) struct Curve {
    pub(super) radius: Polynomial,
    pub(super) height: Polynomial,
}

impl Curve {
    pub(super) fn new(line: &Line, piece: &Piece) -> Self {
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

    pub(super) fn is_degenerate(&self) -> bool {
        self.radius.is_zero() || (self.radius.degree() == 0 && self.height.degree() == 0)
    }
}

/// The ray in whole numbers: the origin in units of 2^length, the direction in units of 2^speed.
pub(super) struct Line {
    length: i64,
    speed: i64,
    /// Factor of the profile.
    scale: Dyadic,
    origin: [BigInt; 3],
    direction: [BigInt; 3],
    /// d_x and d_z in units of 2^flat_speed, the greatest that both are whole in.
    flat: [BigInt; 2],
    flat_speed: i64,
    pub(super) low: Option<Dyadic>,
    pub(super) high: Option<Dyadic>,
}

impl Line {
    pub(super) fn new(pieces: &[Piece], ray: &Ray) -> Self {
        let one = Dyadic::from_f64(1.0);
        Self::from_parts(pieces, one, whole(ray.origin), whole(ray.direction), ray)
    }

    /// The ray of the world in the frame of a placed profile, not rounded.
    pub(super) fn placed(pieces: &[Piece], placement: &Placement, ray: &Ray) -> Self {
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
        let flat_speed = least_exponent([&direction[0], &direction[2]].into_iter());
        let limit = |t: f64| t.is_finite().then(|| Dyadic::from_f64(t));
        Self {
            length,
            speed,
            scale,
            origin: origin.map(|x| x.at(length)),
            flat: [&direction[0], &direction[2]].map(|x| x.at(flat_speed)),
            flat_speed,
            direction: direction.map(|x| x.at(speed)),
            low: limit(ray.t_min),
            high: limit(ray.t_max),
        }
    }

    pub(super) fn is_level(&self) -> bool {
        self.direction[1].is_zero()
    }

    /// The polynomial whose roots are the crossings' u.
    pub(super) fn equation(&self, curve: &Curve) -> Polynomial {
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

    /// Whether the roots of the equation come in pairs.
    fn is_nearly_level(&self) -> bool {
        let [dx, dy, dz] = &self.direction;
        let across = dx * dx + dz * dz;
        !self.is_level() && (dy * dy).bits() + NEARLY_LEVEL_BITS < across.bits()
    }

    /// The roots in u, with their multiplicities.
    pub(super) fn roots(&self, curve: &Curve) -> Vec<Root> {
        if self.is_nearly_level()
            && let Some(roots) = self.branches(curve).roots()
        {
            return roots;
        }
        self.equation(curve).roots()
    }

    /// w² = d_y² s, both divided by the common power of two of d_x and d_z.
    fn branches(&self, curve: &Curve) -> Rc<Branches> {
        let [_, oy, _] = &self.origin;
        let [_, dy, _] = &self.direction;
        let (across, along, square) = self.quadratic(curve);
        let across = across << (self.flat_speed - self.speed) as u64;
        let middle = curve.height.affine(&across, &(along * dy - oy * &across));
        Rc::new(Branches::new(middle, square, dy * dy))
    }

    /// A, b and s of A t = −b ± √s, with the direction in units of 2^flat_speed.
    pub(super) fn quadratic(&self, curve: &Curve) -> (BigInt, BigInt, Polynomial) {
        let [ox, _, oz] = &self.origin;
        let [dx, dz] = &self.flat;
        let across = dx * dx + dz * dz;
        let cross = ox * dz - oz * dx;
        let square = curve.radius.squared().affine(&across, &-(&cross * &cross));
        (across, ox * dx + oz * dz, square)
    }

    /// Reports the crossings of one root in u that are in range.
    pub(super) fn resolve(
        &self,
        curve: &Curve,
        mut root: Root,
        piece: u32,
        found: &mut dyn FnMut(Solution),
    ) {
        for time in self.times(curve, &mut root) {
            let mut solution = Solution {
                piece,
                root: root.clone(),
                time,
            };
            let above = |limit: &Option<Dyadic>, solution: &mut Solution| {
                limit.as_ref().map(|limit| solution.sign_above(limit))
            };
            if above(&self.low, &mut solution).is_none_or(|s| s > 0)
                && above(&self.high, &mut solution).is_none_or(|s| s < 0)
            {
                found(solution);
            }
        }
    }

    /// The ways in which the ray passes the circle of a root in u.
    fn times(&self, curve: &Curve, root: &mut Root) -> Vec<Time> {
        if self.is_level() {
            let (_, _, square) = self.quadratic(curve);
            return match root.sign_of(&square) {
                0 => vec![self.on_branch(curve, 0)],
                1 => vec![self.on_branch(curve, -1), self.on_branch(curve, 1)],
                _ => Vec::new(),
            };
        }
        match root.branch() {
            Some(side) => vec![self.on_branch(curve, side * sign(&self.direction[1]))],
            None => vec![Time::Height {
                rise: self.rise(curve),
                length: self.length,
                climb: Dyadic::new(self.direction[1].clone(), self.speed),
            }],
        }
    }

    /// h − o_y.
    fn rise(&self, curve: &Curve) -> Polynomial {
        curve.height.affine(&BigInt::from(1), &-&self.origin[1])
    }

    /// A polynomial with the sign of (t − `limit`) d_y, t = (h − o_y)/d_y.
    pub(super) fn rise_above(&self, curve: &Curve, limit: &Dyadic) -> Polynomial {
        let climb = Dyadic::new(self.direction[1].clone(), self.speed);
        rise_above(&self.rise(curve), self.length, &climb, limit)
    }

    /// The sign of d_y.
    pub(super) fn climb(&self) -> i32 {
        sign(&self.direction[1])
    }

    fn on_branch(&self, curve: &Curve, branch: i32) -> Time {
        let [ox, _, oz] = &self.origin;
        let (across, along, square) = self.quadratic(curve);
        let (across, along, unit) = self.dyadic_quadratic(across, along);
        let circle = curve.radius.squared();
        Time::Branch(OnBranch {
            branch,
            across,
            along,
            unit,
            square,
            product: circle.affine(&BigInt::from(-1), &(ox * ox + oz * oz)),
            length: self.length,
        })
    }

    /// A and b as dyadic numbers, and the unit n of s: s counts 2^(2n).
    pub(super) fn dyadic_quadratic(&self, across: BigInt, along: BigInt) -> (Dyadic, Dyadic, i64) {
        let unit = self.length + self.flat_speed;
        (
            Dyadic::new(across, 2 * self.flat_speed),
            Dyadic::new(along, unit),
            unit,
        )
    }
}

fn rise_above(rise: &Polynomial, length: i64, climb: &Dyadic, limit: &Dyadic) -> Polynomial {
    let step = climb.times(limit);
    let unit = length.min(step.exponent);
    let scale = BigInt::from(1) << (length - unit) as u64;
    rise.affine(&scale, &-step.at(unit))
}

/// How t follows from u.
enum Time {
    /// t = (h − o_y)/d_y.
    Height {
        /// h − o_y in units of 2^length.
        rise: Polynomial,
        length: i64,
        /// d_y.
        climb: Dyadic,
    },
    /// A t = −b + σ √s.
    Branch(OnBranch),
}

struct OnBranch {
    /// σ; 0 where s = 0.
    branch: i32,
    across: Dyadic,
    along: Dyadic,
    /// s counts 2^(2 unit).
    unit: i64,
    square: Polynomial,
    /// A t t′, with t′ the other solution, in units of 2^(2 length).
    product: Polynomial,
    length: i64,
}

impl OnBranch {
    /// The sign of t − `limit`: that of σ √s − k with k = A limit + b.
    fn sign_above(&self, limit: &Dyadic, root: &mut Root) -> i32 {
        let k = self.across.times(limit).plus(&self.along);
        let sign_of_k = sign(&k.mantissa);
        if self.branch == 0 {
            return -sign_of_k;
        }
        if sign_of_k * self.branch < 0 {
            return self.branch;
        }
        self.branch * root.sign_of(&squares_apart(&self.square, self.unit, &k))
    }

    /// t without cancellation: the solution of greater size from −b ∓ √s, the other from the product of both.
    fn time(&self, root: &mut Root) -> f64 {
        if self.branch == 0 {
            return self.along.negated().over(&self.across);
        }
        let mut size = root.value_of(&self.square);
        size.exponent += 2 * self.unit;
        let far_branch = if sign(&self.along.mantissa) < 0 {
            1
        } else {
            -1
        };
        let distance = size.sqrt();
        let far = if far_branch > 0 {
            distance.plus(&self.along.negated())
        } else {
            distance.plus(&self.along).negated()
        };
        if self.branch == far_branch {
            return far.over(&self.across);
        }
        let mut value = root.value_of(&self.product);
        value.exponent += 2 * self.length;
        value.over(&far)
    }
}

/// Halvings after which two t count as one: they are the same, but for rays made to tell them apart.
const ALIKE: u32 = 128;

/// A root in u with one of its t.
pub(super) struct Solution {
    pub(super) piece: u32,
    pub(super) root: Root,
    time: Time,
}

impl Solution {
    /// Multiplicity in u times that in t.
    pub(super) fn multiplicity(&self) -> u32 {
        match &self.time {
            Time::Branch(OnBranch { branch: 0, .. }) => 2 * self.root.multiplicity(),
            _ => self.root.multiplicity(),
        }
    }

    /// t, rounded to the nearest f64 or, within 2⁻¹⁰ of half an ulp, to the other neighbour.
    pub(super) fn time(&mut self) -> f64 {
        match &self.time {
            Time::Height {
                rise,
                length,
                climb,
            } => {
                let mut value = self.root.value_of(rise);
                value.exponent += length;
                value.over(climb)
            }
            Time::Branch(on) => on.time(&mut self.root),
        }
    }

    /// The greatest f64 ≤ t and the least ≥ t, from a `near` one that is one of them.
    pub(super) fn neighbours(&mut self, near: f64) -> (f64, f64) {
        if !near.is_finite() {
            let (low, high) = (f64::MAX, f64::INFINITY);
            return if near > 0.0 {
                (low, high)
            } else {
                (-high, -low)
            };
        }
        match self.sign_above(&Dyadic::from_f64(near)) {
            0 => (near, near),
            1 => (near, near.next_up()),
            _ => (near.next_down(), near),
        }
    }

    /// Which of two solutions comes first, from a t of each that is one of its neighbours. What is as near as 2^-[`ALIKE`] of these is
    /// alike.
    pub(super) fn order(&mut self, own: f64, other: &mut Self, others: f64) -> Ordering {
        let (least, most) = (own.min(others), own.max(others));
        if least.next_up() < most || least.is_infinite() || most.is_infinite() {
            return own.total_cmp(&others);
        }
        let [mut low, mut high] = [least.next_down(), most.next_up()].map(Dyadic::from_f64);
        for _ in 0..ALIKE {
            let mut middle = low.plus(&high);
            middle.exponent -= 1;
            match [self.sign_above(&middle), other.sign_above(&middle)] {
                [0, 0] => break,
                [a, b] if a != b => return a.cmp(&b),
                [1, _] => low = middle,
                _ => high = middle,
            }
        }
        Ordering::Equal
    }

    /// The sign of t − `limit`.
    fn sign_above(&mut self, limit: &Dyadic) -> i32 {
        match &self.time {
            Time::Height {
                rise,
                length,
                climb,
            } => {
                let excess = rise_above(rise, *length, climb, limit);
                self.root.sign_of(&excess) * sign(&climb.mantissa)
            }
            Time::Branch(on) => on.sign_above(limit, &mut self.root),
        }
    }
}

/// A polynomial with the sign of s − k², s in units of 2^(2 unit).
pub(super) fn squares_apart(square: &Polynomial, unit: i64, k: &Dyadic) -> Polynomial {
    let k_unit = k.exponent.min(unit);
    let scale = BigInt::from(1) << (2 * (unit - k_unit)) as u64;
    let k = k.at(k_unit);
    square.affine(&scale, &-(&k * &k))
}

fn whole(v: DVec3) -> [Dyadic; 3] {
    v.to_array().map(Dyadic::from_f64)
}

fn dot(a: &[Dyadic; 3], b: &[Dyadic; 3]) -> Dyadic {
    let [x, y, z] = [0, 1, 2].map(|i| a[i].times(&b[i]));
    x.plus(&y).plus(&z)
}

/// The least exponent of the non-zero numbers, or 0.
fn least_exponent<'a>(values: impl Iterator<Item = &'a Dyadic>) -> i64 {
    let exponents = values.filter(|v| !v.mantissa.is_zero()).map(|v| v.exponent);
    exponents.min().unwrap_or(0)
}
