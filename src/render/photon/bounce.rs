//! Photons at flat diffuse surfaces, where most of them go: many side by side in vector lanes.
//!
//! Each lane computes what [`trace`](super::trace) would for its photon alone, so nothing but the speed and the order in which the
//! audit of energy is added up depends on it.

use super::trace::{Energy, Flight, SUREST};
use crate::geometry::hit::{OFFSET_IN_ERRORS, Side};
use crate::geometry::planar::{flat_point, tangents};
use crate::geometry::ray::Ray;
use crate::numeric::rng::Streams;
use crate::numeric::simd::{Kernel, Lanes};
use crate::scene::material::Pattern;
use crate::scene::sampling::{above_disc, concentric, on_disc};
use crate::scene::{Object, Rgb, Scene};
use glam::DVec3;

/// Photons that are taken together: some full vector registers, few enough for the nearest cache.
pub(super) const WIDTH: usize = 32;

/// One number for each photon.
type Column = [f64; WIDTH];
type Columns = [Column; 3];

const ZERO: Column = [0.0; WIDTH];

/// One side of a flat object that reflects diffusely, everywhere the same, and does nothing else.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// A point of its plane.
    anchor: DVec3,
    /// The object's unit normal, on whichever side.
    normal: DVec3,
    side: Side,
    tangents: (DVec3, DVec3),
    reflectance: Rgb,
    /// Share of the photons that are reflected.
    survival: f64,
}

impl Face {
    /// Front and back of each object that has such.
    pub(super) fn all(scene: &Scene) -> Vec<Option<[Self; 2]>> {
        let each = scene.objects.iter().map(|object| Self::of(scene, object));
        each.collect()
    }

    fn of(scene: &Scene, object: &Object) -> Option<[Self; 2]> {
        let (anchor, normal) = object.shape.flat()?;
        let material = &scene.materials[object.material];
        let plain = material.dielectric.is_none() && material.mirror.is_none();
        let reflectance = match &material.diffuse {
            Some(Pattern::Constant(color)) if plain && *color != Rgb::ZERO => *color,
            _ => return None,
        };
        let most = reflectance.max_element();
        Some([Side::Front, Side::Back].map(|side| Self {
            anchor,
            normal,
            side,
            tangents: tangents(side.sign() * normal),
            reflectance,
            // As `trace` rounds it where nothing is mirrored.
            survival: most.min(SUREST) * most / most,
        }))
    }

    /// The unit normal on the side.
    pub(super) fn facing(&self) -> DVec3 {
        self.side.sign() * self.normal
    }

    pub(super) fn is_back(&self) -> bool {
        self.side == Side::Back
    }

    /// The one of both sides on which a ray along `direction` arrives.
    #[inline(always)]
    pub(super) fn met(both: &[Self; 2], direction: DVec3) -> &Self {
        &both[usize::from(both[0].normal.dot(direction) > 0.0)]
    }
}

/// Photons that have met faces, and what becomes of them.
pub(super) struct Bounces {
    origin: Columns,
    direction: Columns,
    t: Column,
    flux: Columns,
    worth: Column,
    anchor: Columns,
    normal: Columns,
    sign: Column,
    tangents: [Columns; 2],
    reflectance: Columns,
    survival: Column,
    streams: Streams<WIDTH>,
    count: usize,
    point: Columns,
    start: Columns,
    /// Flux of those that go on; 0 of the others.
    left: Columns,
    radius: Column,
    angle: Column,
    /// What was absorbed and what roulette took so far, over all photons of a lane.
    absorbed: Columns,
    roulette: Columns,
}

impl Bounces {
    /// None yet.
    pub(super) fn none() -> Self {
        Self {
            origin: [ZERO; 3],
            direction: [ZERO; 3],
            t: ZERO,
            flux: [ZERO; 3],
            worth: ZERO,
            anchor: [ZERO; 3],
            normal: [ZERO; 3],
            sign: ZERO,
            tangents: [[ZERO; 3]; 2],
            reflectance: [ZERO; 3],
            survival: ZERO,
            streams: Streams::BLANK,
            count: 0,
            point: [ZERO; 3],
            start: [ZERO; 3],
            left: [ZERO; 3],
            radius: ZERO,
            angle: ZERO,
            absorbed: [ZERO; 3],
            roulette: [ZERO; 3],
        }
    }

    /// Forgets the photons, not what became of their energy.
    pub(super) fn clear(&mut self) {
        self.count = 0;
        // The lanes that stay without a photon carry nothing.
        self.flux = [ZERO; 3];
        self.worth = ZERO;
    }

    /// Puts in a photon that meets a face at parameter `t`. At most [`WIDTH`].
    #[inline(always)]
    pub(super) fn put(&mut self, flight: &Flight, t: f64, face: &Face) {
        let lane = self.count;
        self.count += 1;
        put(&mut self.origin, lane, flight.ray.origin);
        put(&mut self.direction, lane, flight.ray.direction);
        self.t[lane] = t;
        put(&mut self.flux, lane, flight.flux);
        self.worth[lane] = flight.worth;
        put(&mut self.anchor, lane, face.anchor);
        put(&mut self.normal, lane, face.normal);
        self.sign[lane] = face.side.sign();
        put(&mut self.tangents[0], lane, face.tangents.0);
        put(&mut self.tangents[1], lane, face.tangents.1);
        put(&mut self.reflectance, lane, face.reflectance);
        self.survival[lane] = face.survival;
        self.streams.put(lane, &flight.stream);
    }

    /// Where the photon of a lane lies.
    pub(super) fn point(&self, lane: usize) -> DVec3 {
        get(&self.point, lane)
    }

    /// Sends the photon of a lane on its further way; `false` if it has none.
    #[inline(always)]
    pub(super) fn send(&self, lane: usize, flight: &mut Flight) -> bool {
        let goes = self.goes(lane);
        if goes {
            flight.ray = Ray::new(get(&self.start, lane), get(&self.direction, lane));
            flight.flux = get(&self.left, lane);
            flight.worth = 1.0;
            flight.chain = 0;
            flight.stream = self.streams.get(lane);
        }
        goes
    }

    /// The energy that all photons so far have left.
    pub(super) fn energy(&self) -> Energy {
        let sum = |columns: &Columns| columns.map(|column| column.iter().sum());
        Energy {
            absorbed: DVec3::from_array(sum(&self.absorbed)),
            roulette: DVec3::from_array(sum(&self.roulette)),
            ..Energy::default()
        }
    }

    /// Whether roulette lets a photon go on: those that do have an angle.
    #[inline(always)]
    fn goes(&self, lane: usize) -> bool {
        !self.angle[lane].is_nan()
    }

    #[inline(always)]
    fn meet(&mut self) {
        let [choice, u, v] = self.streams.uniform3();
        for lane in 0..WIDTH {
            let ray = Ray::new(get(&self.origin, lane), get(&self.direction, lane));
            let normal = get(&self.normal, lane);
            let (point, error) = flat_point(&ray, self.t[lane], get(&self.anchor, lane), normal);
            put(&mut self.point, lane, point);
            let start = point + self.sign[lane] * OFFSET_IN_ERRORS * error * normal;
            put(&mut self.start, lane, start);
            let (flux, reflectance) = (get(&self.flux, lane), get(&self.reflectance, lane));
            let chance = self.worth[lane] * self.survival[lane];
            let goes = choice[lane] < chance;
            let going = flux * (reflectance / chance);
            let left = going.map(|flux| if goes { flux } else { 0.0 });
            put(&mut self.left, lane, left);
            let reflected = flux * reflectance;
            add(&mut self.absorbed, lane, flux - reflected);
            add(&mut self.roulette, lane, reflected - left);
            let (radius, angle) = concentric([u[lane], v[lane]]);
            self.radius[lane] = radius;
            self.angle[lane] = if goes { angle } else { f64::NAN };
        }
    }

    #[inline(always)]
    fn leave(&mut self, sines: &Column, cosines: &Column) {
        for lane in 0..WIDTH {
            let disc = on_disc(self.radius[lane], (sines[lane], cosines[lane]));
            let tangents = (get(&self.tangents[0], lane), get(&self.tangents[1], lane));
            let facing = self.sign[lane] * get(&self.normal, lane);
            put(
                &mut self.direction,
                lane,
                above_disc(disc, tangents, facing),
            );
        }
    }
}

impl Kernel for &mut Bounces {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        self.meet();
        let (mut sines, mut cosines) = (ZERO, ZERO);
        for lane in 0..self.count {
            if self.goes(lane) {
                (sines[lane], cosines[lane]) = libm::sincos(self.angle[lane]);
            }
        }
        self.leave(&sines, &cosines);
    }
}

#[inline(always)]
fn get(columns: &Columns, lane: usize) -> DVec3 {
    DVec3::new(columns[0][lane], columns[1][lane], columns[2][lane])
}

#[inline(always)]
fn put(columns: &mut Columns, lane: usize, vector: DVec3) {
    for axis in 0..3 {
        columns[axis][lane] = vector[axis];
    }
}

#[inline(always)]
fn add(columns: &mut Columns, lane: usize, vector: DVec3) {
    for axis in 0..3 {
        columns[axis][lane] += vector[axis];
    }
}
