//! Photon paths from the lights, and the energy they leave behind.
//!
//! Photons are stored at every diffuse surface they reach, the first included (Jensen 1996), and go on by Russian roulette that
//! keeps the mean (Arvo and Kirk 1990). Mirrors and dielectrics pass them on; at a dielectric one of the two ways is chosen with
//! its Fresnel share. Photons carry flux, so no index of refraction scales them.

use crate::geometry::hit::{Hit, Side};
use crate::geometry::ray::Ray;
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use crate::render::scatter::{Interface, Lobes, reflect};
use crate::scene::sampling::cosine_hemisphere;
use crate::scene::{Rgb, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Photons traced by one task. Fixed, so that the order of photons never depends on threads.
const CHUNK: u64 = 2048;
/// No photon survives a surface more surely than this, so that paths end in a room that absorbs nothing: after 200 events in
/// the mean. At reflectances below it changes nothing.
const SUREST: f64 = 0.995;
/// Dielectric interfaces met in a row before roulette begins there, and the chance to pass each further one. Light trapped by
/// total reflection would go on for ever.
const LONG_CHAIN: u32 = 64;
const CHAIN_SURVIVAL: f64 = 0.9;

/// A photon stored at a diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Flux (W) it brings, if it stood for all the light alone: divide by the number of photons emitted.
    pub flux: Rgb,
    /// Unit normal on the side from which it came.
    pub normal: DVec3,
    /// Object it lies on.
    pub object: u32,
    /// Scattering events before.
    pub events: u32,
}

/// What became of the light, in W times the number of photons: emitted = absorbed + escaped + roulette + cut, to rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Left the lights.
    pub emitted: Rgb,
    /// Absorbed by surfaces and media: the expected share at every event.
    pub absorbed: Rgb,
    /// Left the scene.
    pub escaped: Rgb,
    /// Taken by roulette, less what it gave to the survivors: 0 in the mean.
    pub roulette: Rgb,
    /// Still under way at the depth limit.
    pub cut: Rgb,
}

impl AddAssign for Energy {
    fn add_assign(&mut self, other: Self) {
        self.emitted += other.emitted;
        self.absorbed += other.absorbed;
        self.escaped += other.escaped;
        self.roulette += other.roulette;
        self.cut += other.cut;
    }
}

/// Photons in the order of their paths, with what tracing them took.
#[derive(Clone, Debug, Default)]
pub struct Photons {
    /// Where each lies.
    pub points: Vec<DVec3>,
    /// The rest of each.
    pub arrivals: Vec<Arrival>,
    /// Where the energy went.
    pub energy: Energy,
    /// Work done.
    pub work: Work,
}

impl Photons {
    fn append(&mut self, mut other: Self) {
        self.points.append(&mut other.points);
        self.arrivals.append(&mut other.arrivals);
        self.energy += other.energy;
        self.work += other.work;
    }
}

/// Traces `count` photons from index `first` on. A path with more than `max_depth` scattering events, the one towards the camera
/// included, is cut.
///
/// Photon i draws from the stream (`seed`, photon, i) alone, and chunks join in order: the same bytes on any number of threads.
pub fn trace(scene: &Scene, seed: u64, first: u64, count: u64, max_depth: Option<u32>) -> Photons {
    let tracer = Tracer {
        scene,
        seed,
        max_depth,
        absorbing: scene.materials.iter().any(|material| {
            material
                .dielectric
                .is_some_and(|dielectric| dielectric.absorption != Rgb::ZERO)
        }),
    };
    let chunks: Vec<Photons> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let start = chunk * CHUNK;
            let mut traced = Photons::default();
            for photon in start..count.min(start + CHUNK) {
                tracer.trace(first.wrapping_add(photon), &mut traced);
            }
            traced
        })
        .collect();
    let stored = chunks.iter().map(|chunk| chunk.points.len()).sum();
    let mut all = Photons {
        points: Vec::with_capacity(stored),
        arrivals: Vec::with_capacity(stored),
        ..Photons::default()
    };
    chunks.into_iter().for_each(|chunk| all.append(chunk));
    all
}

struct Tracer<'a> {
    scene: &'a Scene,
    seed: u64,
    max_depth: Option<u32>,
    /// Whether any medium absorbs: only then it matters in which one a photon starts.
    absorbing: bool,
}

/// A photon under way.
struct Flight {
    ray: Ray,
    flux: Rgb,
    medium: Option<usize>,
    events: u32,
    /// Dielectric interfaces met in a row.
    chain: u32,
}

impl Tracer<'_> {
    fn trace(&self, index: u64, out: &mut Photons) {
        let mut stream = Stream::new(self.seed, Purpose::Photon, index);
        let Some(start) = self.scene.lights.emit(&mut stream) else {
            return;
        };
        out.work.photon_paths += 1;
        out.energy.emitted += start.flux;
        let medium = if self.absorbing {
            self.scene.medium_at(start.ray.origin, &mut out.work)
        } else {
            None
        };
        let mut flight = Flight {
            ray: start.ray,
            flux: start.flux,
            medium,
            events: 0,
            chain: 0,
        };
        while self.advance(&mut flight, &mut stream, out) {}
    }

    /// One straight part of the path and the event at its end; `false` at the path's end.
    fn advance(&self, flight: &mut Flight, stream: &mut Stream, out: &mut Photons) -> bool {
        // The event that sends the photon's light to the camera counts too.
        if self.max_depth.is_some_and(|most| flight.events >= most) {
            out.energy.cut += flight.flux;
            return false;
        }
        out.work.photon_segments += 1;
        let Some(hit) = self.scene.intersect(&flight.ray, &mut out.work) else {
            out.energy.escaped += flight.flux;
            return false;
        };
        let arriving = flight.flux * self.scene.transmittance(flight.medium, hit.t);
        out.energy.absorbed += flight.flux - arriving;
        flight.flux = arriving;
        let direction = flight.ray.direction;
        let lobes = Lobes::at(self.scene, &hit, direction);
        if lobes.diffuse != Rgb::ZERO {
            out.work.photons_stored += 1;
            out.points.push(hit.point);
            out.arrivals.push(Arrival {
                flux: flight.flux,
                normal: hit.normal_on(lobes.side),
                object: hit.object as u32,
                events: flight.events,
            });
        }
        let scattered = match &lobes.interface {
            Some(interface) => cross(flight, &hit, lobes.side, interface, stream),
            None => bounce(flight, &hit, &lobes, stream),
        };
        let reflected = match lobes.interface {
            Some(_) => arriving,
            None => arriving * (lobes.diffuse + lobes.mirror),
        };
        out.energy.absorbed += arriving - reflected;
        let left = scattered.map_or(Rgb::ZERO, |_| flight.flux);
        out.energy.roulette += reflected - left;
        flight.events += 1;
        let Some((side, direction)) = scattered else {
            return false;
        };
        flight.ray = self.scene.leave(&hit, side, direction, &mut out.work);
        true
    }
}

/// Reflects or refracts at a dielectric that was met on `side`: the side and direction in which the photon leaves. `None` if
/// roulette ends the path.
fn cross(
    flight: &mut Flight,
    hit: &Hit,
    side: Side,
    interface: &Interface,
    stream: &mut Stream,
) -> Option<(Side, DVec3)> {
    flight.chain += 1;
    if flight.chain > LONG_CHAIN {
        if stream.uniform() >= CHAIN_SURVIVAL {
            return None;
        }
        flight.flux /= CHAIN_SURVIVAL;
    }
    Some(match interface.refracted {
        Some(refracted) if stream.uniform() >= interface.reflectance => {
            flight.medium = interface.beyond;
            (side.other(), refracted)
        }
        _ => (side, reflect(flight.ray.direction, hit.normal)),
    })
}

/// Reflects from a diffuse surface or mirror: the side and direction in which the photon leaves. `None` if roulette ends the path.
fn bounce(
    flight: &mut Flight,
    hit: &Hit,
    lobes: &Lobes,
    stream: &mut Stream,
) -> Option<(Side, DVec3)> {
    let survival = (lobes.diffuse + lobes.mirror).max_element().min(SUREST);
    let (diffuse, mirror) = (lobes.diffuse.max_element(), lobes.mirror.max_element());
    let chance = survival * diffuse / (diffuse + mirror);
    let choice = stream.uniform();
    // Also false where nothing is reflected and the chance is 0/0.
    let direction = if choice < chance {
        flight.flux *= lobes.diffuse / chance;
        cosine_hemisphere(hit.normal_on(lobes.side), stream.uniform2())
    } else if choice < survival {
        flight.flux *= lobes.mirror / (survival - chance);
        reflect(flight.ray.direction, hit.normal)
    } else {
        return None;
    };
    flight.chain = 0;
    Some((lobes.side, direction))
}
