//! What there is to aim at on a profile, and rays that do, in the profile's own frame.

use super::aim::{inside, level, pick, quarter, sign, small, sphere};
use super::towards;
use crate::geometry::bounds::Cylinder;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::cubic_extrema;
use crate::numeric::rng::Stream;
use glam::{DVec2, DVec3};

/// A circle of the surface: (radius, height).
pub(super) type Circle = [f64; 2];

/// Chords by which a piece is searched for crossings and near sheets: only what is aimed at depends on it, never a truth.
const CHORDS: usize = 48;
/// Slower than this share of the control speed the profile stands still.
const STILL: f64 = 1e-6;
/// Sine of the least angle of a corner.
const CORNER: f64 = 1e-6;
/// Widest gap of a thin wall, in sizes.
const WALL: f64 = 0.02;

/// A profile's places to aim at.
#[derive(Clone, Debug)]
pub(super) struct Features {
    profile: Profile,
    /// The bounding cylinder.
    pub(super) cylinder: Cylinder,
    /// The greater of the bounding cylinder's radius and height.
    pub(super) size: f64,
    /// Ends of pieces.
    pub(super) joints: Vec<Circle>,
    /// Joints at a corner.
    pub(super) kinks: Vec<Circle>,
    /// Ends on the axis.
    pub(super) caps: Vec<Circle>,
    /// Circles in which the surface crosses itself.
    pub(super) loops: Vec<Circle>,
    /// Places inside pieces of speed 0.
    pub(super) cusps: Vec<Circle>,
    /// Places inside pieces at which radius or height turns.
    pub(super) turns: Vec<Circle>,
    /// Places of pieces without area, flat or upright, and ends of speed 0.
    pub(super) degenerate: Vec<Circle>,
    /// Opposite places of two near sheets.
    walls: Vec<[Circle; 2]>,
}

impl Features {
    pub(super) fn of(profile: &Profile) -> Self {
        let cylinder = Cylinder::of(profile);
        let size = cylinder.radius.max(cylinder.top - cylinder.bottom);
        let pieces = profile.pieces();
        let ends = || {
            pieces
                .iter()
                .flat_map(|piece| [piece.point(0), piece.point(3)])
        };
        let (cusps, turns) = turning_places(pieces);
        let chords = chords(pieces);
        Self {
            cylinder,
            size: if size > 0.0 { size } else { 1.0 },
            joints: distinct(ends()),
            kinks: kinks(pieces),
            caps: distinct(ends().filter(|end| end[0] == 0.0)),
            loops: self_crossings(&chords),
            cusps,
            turns,
            degenerate: degenerate_places(pieces),
            walls: near_sheets(&chords, WALL * size),
            profile: profile.clone(),
        }
    }

    /// One of several places, `None` of none.
    pub(super) fn one_of<'a, T>(&self, places: &'a [T], s: &mut Stream) -> Option<&'a T> {
        let choice = s.uniform();
        (!places.is_empty()).then(|| &places[pick(places.len(), choice)])
    }

    pub(super) fn random(&self, s: &mut Stream) -> Ray {
        let middle = 0.5 * (self.cylinder.bottom + self.cylinder.top);
        let origin = DVec3::Y * middle + 3.0 * self.size * sphere(s);
        let target = inside(&self.cylinder, s);
        Ray::new(origin, (target - origin).normalize())
    }

    /// A random point of the surface with its normal.
    pub(super) fn on_surface(&self, s: &mut Stream) -> (DVec3, DVec3) {
        let pieces = self.profile.pieces();
        let piece = &pieces[pick(pieces.len(), s.uniform())];
        let u = s.uniform();
        let (at, [radius_slope, height_slope]) = (piece.at(u), piece.tangent(u));
        let around = level(s);
        let normal = height_slope * around - DVec3::Y * radius_slope;
        let point = at.radius * around + DVec3::Y * at.height;
        (point, normal.try_normalize().unwrap_or(DVec3::Y))
    }

    /// A ray aimed at a circle: every other one from 3 sizes away at any azimuth, up to rounding, the others exactly.
    pub(super) fn at_circle(&self, circle: Circle, s: &mut Stream) -> Ray {
        if s.uniform() < 0.5 {
            let target = circle[0] * level(s) + DVec3::Y * circle[1];
            return towards(target, 3.0 * self.size, s);
        }
        self.exactly_at(circle, sphere(s), s)
    }

    /// A ray whose point at t = 1 is exactly on the circle, at one of the azimuths 0, 90, 180 and 270 degrees.
    ///
    /// The origin is the target plus `offset` sizes, rounded to the target's last places, so that their difference is a float.
    fn exactly_at(&self, circle: Circle, offset: DVec3, s: &mut Stream) -> Ray {
        let target = circle[0] * quarter(s) + DVec3::Y * circle[1];
        let mut offset = self.size * offset;
        loop {
            let origin = DVec3::from_array([0, 1, 2].map(|i| on_grid(target[i], offset[i])));
            let direction = target - origin;
            let exact = [0, 1, 2].map(|i| exact_difference(target[i], origin[i], direction[i]));
            if exact == [true; 3] && direction != DVec3::ZERO {
                return Ray::new(origin, direction);
            }
            if offset.abs().max_element() < f64::MIN_POSITIVE {
                return Ray::new(target - DVec3::Y, DVec3::Y);
            }
            offset *= 0.5;
        }
    }

    /// A ray to a circle: level in its plane, upright through it (one in four each), or as [`Self::at_circle`].
    pub(super) fn along(&self, circle: Circle, s: &mut Stream) -> Ray {
        let choice = s.uniform();
        let target = circle[0] * quarter(s) + DVec3::Y * circle[1];
        let direction = match choice {
            x if x < 0.25 => level(s),
            x if x < 0.5 => DVec3::Y * sign(s),
            _ => return self.at_circle(circle, s),
        };
        Ray::new(target - 3.0 * self.size * direction, direction)
    }

    pub(super) fn graze(&self, s: &mut Stream) -> Ray {
        let (point, normal) = self.on_surface(s);
        let across = across(normal, s);
        let aside = if s.uniform() < 0.25 {
            let ulps = 1.0 + (4.0 * s.uniform()).floor();
            sign(s) * ulps * f64::EPSILON * point.abs().max_element()
        } else {
            self.size * small(s, -16.0, -3.0)
        };
        let back = self.size * s.range(0.25, 3.0);
        Ray::new(point + aside * normal - back * across, across)
    }

    /// A ray tangent to a joint's circle in its own plane, exactly, or one tangent anywhere, up to rounding.
    pub(super) fn tangent(&self, s: &mut Stream) -> Option<Ray> {
        if s.uniform() < 0.5 {
            let (point, normal) = self.on_surface(s);
            let across = across(normal, s);
            return Some(Ray::new(point - 2.0 * self.size * across, across));
        }
        let rings: Vec<Circle> = self
            .joints
            .iter()
            .copied()
            .filter(|c| c[0] != 0.0)
            .collect();
        let [radius, height] = *self.one_of(&rings, s)?;
        let out = quarter(s);
        let direction = sign(s) * DVec3::new(out.z, 0.0, out.x);
        let touch = radius * out + DVec3::Y * height;
        Some(Ray::new(touch - 3.0 * self.size * direction, direction))
    }

    pub(super) fn through_wall(&self, s: &mut Stream) -> Option<Ray> {
        let [a, b] = *self.one_of(&self.walls, s)?;
        let share = s.uniform();
        let middle = [0, 1].map(|i| a[i] + share * (b[i] - a[i]));
        let point = middle[0] * level(s) + DVec3::Y * middle[1];
        if s.uniform() < 0.5 {
            return Some(towards(point, 3.0 * self.size, s));
        }
        Some(Ray::new(point, sphere(s)))
    }
}

/// A random unit vector perpendicular to a normal.
fn across(normal: DVec3, s: &mut Stream) -> DVec3 {
    let other = sphere(s);
    let across = normal.cross(other).try_normalize();
    across.unwrap_or_else(|| normal.any_orthonormal_vector())
}

/// `value` + `offset`, rounded to a multiple of the last place of `value`.
fn on_grid(value: f64, offset: f64) -> f64 {
    let ulp = value.abs().next_up() - value.abs();
    if value == 0.0 || offset.abs() / ulp > 4e15 {
        return value + offset;
    }
    value + (offset / ulp).round() * ulp
}

/// Whether a − b = d without rounding (Knuth's two-sum).
fn exact_difference(a: f64, b: f64, d: f64) -> bool {
    let b_again = a - d;
    let a_again = d + b_again;
    a - a_again == 0.0 && b_again - b == 0.0
}

fn distinct(places: impl Iterator<Item = Circle>) -> Vec<Circle> {
    let mut found = Vec::new();
    for place in places {
        if !found.contains(&place) {
            found.push(place);
        }
    }
    found
}

/// Joints at which the directions before and after differ; the joint of a closed ring is one.
fn kinks(pieces: &[Piece]) -> Vec<Circle> {
    let moving: Vec<&Piece> = (pieces.iter())
        .filter(|p| (1..4).any(|i| p.point(i) != p.point(0)))
        .collect();
    let pairs = moving.iter().zip(moving.iter().cycle().skip(1));
    let corners = pairs.filter(|(before, after)| {
        let unit = |v: [f64; 2]| DVec2::from_array(v).normalize_or_zero();
        let (a, b) = (unit(before.tangent(1.0)), unit(after.tangent(0.0)));
        before.point(3) == after.point(0) && (a.perp_dot(b).abs() > CORNER || a.dot(b) < 0.0)
    });
    distinct(corners.map(|(before, _)| before.point(3)))
}

/// Where the profile stands still, and where radius or height turns.
fn turning_places(pieces: &[Piece]) -> (Vec<Circle>, Vec<Circle>) {
    let (mut still, mut turns) = (Vec::new(), Vec::new());
    for piece in pieces {
        let steps = |c: &[f64; 4]| (0..3).map(|i| (c[i + 1] - c[i]).abs()).fold(0.0, f64::max);
        let speed = steps(&piece.radius).max(steps(&piece.height));
        let places = [&piece.radius, &piece.height].map(cubic_extrema);
        for u in places.into_iter().flatten() {
            let at = piece.at(u);
            let slope = at.radius_slope.abs().max(at.height_slope.abs());
            turns.push([at.radius, at.height]);
            if slope <= STILL * speed {
                still.push([at.radius, at.height]);
            }
        }
    }
    (distinct(still.into_iter()), distinct(turns.into_iter()))
}

/// Places of pieces that are a point, on the axis, flat or upright, and ends of zero speed.
fn degenerate_places(pieces: &[Piece]) -> Vec<Circle> {
    let mut places = Vec::new();
    for piece in pieces {
        if piece.is_flat() || piece.radius.iter().all(|&r| r == piece.radius[0]) {
            let middle = piece.at(0.5);
            places.extend([
                piece.point(0),
                [middle.radius, middle.height],
                piece.point(3),
            ]);
        }
        if piece.point(0) == piece.point(1) {
            places.push(piece.point(0));
        }
        if piece.point(2) == piece.point(3) {
            places.push(piece.point(3));
        }
    }
    distinct(places.into_iter())
}

/// A short straight part of the outline of the surface of |r|.
#[derive(Clone, Copy, Debug)]
struct Chord {
    from: DVec2,
    to: DVec2,
    /// Length of the outline before it.
    start: f64,
}

fn chords(pieces: &[Piece]) -> Vec<Chord> {
    let mut length = 0.0;
    let mut chords = Vec::new();
    for piece in pieces.iter().filter(|piece| !piece.on_axis()) {
        let at = |k: usize| {
            let station = piece.at(k as f64 / CHORDS as f64);
            DVec2::new(station.radius.abs(), station.height)
        };
        for k in 0..CHORDS {
            let (from, to) = (at(k), at(k + 1));
            if from != to {
                chords.push(Chord {
                    from,
                    to,
                    start: length,
                });
                length += from.distance(to);
            }
        }
    }
    chords
}

/// Where chords that are not neighbours cross transversally.
fn self_crossings(chords: &[Chord]) -> Vec<Circle> {
    let mut found = Vec::new();
    for (i, a) in chords.iter().enumerate() {
        for b in chords.iter().skip(i + 2) {
            let (p, q, r) = (a.to - a.from, b.to - b.from, b.from - a.from);
            let area = p.perp_dot(q);
            if area.abs() <= CORNER * p.length() * q.length() {
                continue;
            }
            let (x, y) = (r.perp_dot(q) / area, r.perp_dot(p) / area);
            // Open: chords that share an end do not cross.
            let open = |v: f64| v > 1e-9 && v < 1.0 - 1e-9;
            if open(x) && open(y) {
                let at = a.from + x * p;
                found.push(at.to_array());
            }
        }
    }
    found
}

/// Middles of chords with the nearest point of a nearly parallel chord elsewhere on the outline, closer than `gap`.
fn near_sheets(chords: &[Chord], gap: f64) -> Vec<[Circle; 2]> {
    let mut found = Vec::new();
    for (i, a) in chords.iter().enumerate() {
        let middle = 0.5 * (a.from + a.to);
        for b in &chords[..i] {
            let (p, q) = (a.to - a.from, b.to - b.from);
            let share = (middle - b.from).dot(q) / q.length_squared();
            let opposite = b.from + share.clamp(0.0, 1.0) * q;
            let distance = middle.distance(opposite);
            let parallel = p.perp_dot(q).abs() < 0.1 * p.length() * q.length();
            // Four times as far along the outline as across: another sheet, not the same one further on.
            let elsewhere = a.start - b.start > 4.0 * distance + 2.0 * (p.length() + q.length());
            if distance > 0.0 && distance < gap && parallel && elsewhere {
                found.push([middle.to_array(), opposite.to_array()]);
            }
        }
    }
    found
}
