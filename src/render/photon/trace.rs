//! Photon paths from the lights, and the energy they leave behind.
//!
//! Photons are stored at every diffuse surface they reach, the first included (Jensen 1996), and go on by Russian roulette that
//! keeps the mean (Arvo and Kirk 1990). Mirrors and dielectrics pass them on; at a dielectric one of the two ways is chosen with
//! its Fresnel share. Photons carry flux, so no index of refraction scales them. Aimed photons ([`aim`](crate::scene::aim)) carry little: at
//! their first diffuse surface so few of them go on that those carry as much as others.

use super::arrivals::{Arrival, Arrivals};
use super::bounce::{self, Bounces, Face};
use super::parts::joined;
use crate::geometry::hit::{Crossing, Hit, Side};
use crate::geometry::ray::Ray;
use crate::index::curve;
use crate::numeric::clock::ThreadClock;
use crate::numeric::rng::{Ahead, Heads, Purpose, Stream};
use crate::numeric::simd::Vectors;
use crate::numeric::work::Work;
use crate::render::scatter::{Interface, Lobes, reflect};
use crate::scene::sampling::cosine_hemisphere;
use crate::scene::{Rgb, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Photons traced by one task: a thirty-second of a batch of 50 000, so that threads end together; smaller ones fill the lanes badly.
/// Fixed, so that the order of photons never depends on threads.
const CHUNK: u64 = 1563;
/// Photons of a task that are under way together: their rays ask the scene at once. Enough to fill vector registers, few enough
/// for the nearer caches. Changes no byte.
const WAVE: usize = 256;
/// Photons stored of a path, about: memory for so many is asked for at once.
const STORED: usize = 2;
/// No photon survives a surface more surely than this, so that paths end in a room that absorbs nothing: after 200 events in
/// the mean. At reflectances below it changes nothing.
pub(super) const SUREST: f64 = 0.995;
/// Dielectric interfaces met in a row before roulette begins there, and the chance to pass each further one. Light trapped by
/// total reflection would go on for ever.
const LONG_CHAIN: u32 = 64;
const CHAIN_SURVIVAL: f64 = 0.9;

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
    pub arrivals: Arrivals,
    /// Where the energy went.
    pub energy: Energy,
    /// Work done.
    pub work: Work,
    /// CPU seconds that it took; on several threads a little else may be among them.
    pub seconds: f64,
}

impl Photons {
    /// Puts the photons in the order of a Hilbert curve, those of one cell in the order of their paths.
    pub fn sort_along_curve(&mut self) {
        let order = curve::order(&self.points);
        self.points = order
            .par_iter()
            .map(|&from| self.points[from as usize])
            .collect();
        self.arrivals.reorder(&order);
    }
}

/// Traces `count` photons from index `first` on. A path with more than `max_depth` scattering events, the one towards the camera
/// included, is cut.
///
/// Photon i draws from the stream (`seed`, photon, i) alone, and chunks join in order: the same bytes on any number of threads.
pub fn trace(scene: &Scene, seed: u64, first: u64, count: u64, max_depth: Option<u32>) -> Photons {
    trace_by(&Tracer::new(scene, seed, max_depth), first, count)
}

fn trace_by(tracer: &Tracer, first: u64, count: u64) -> Photons {
    let chunks: Vec<Photons> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let clock = ThreadClock::start();
            let start = chunk * CHUNK;
            let photons = tracer.trace(first.wrapping_add(start), CHUNK.min(count - start));
            Photons {
                seconds: clock.seconds(),
                ..photons
            }
        })
        .collect();
    let clock = ThreadClock::start();
    let points: Vec<&[DVec3]> = chunks.iter().map(|chunk| &*chunk.points).collect();
    let arrivals: Vec<&Arrivals> = chunks.iter().map(|chunk| &chunk.arrivals).collect();
    let mut all = Photons {
        points: joined(&points, |_, point| point),
        arrivals: tracer.none.join(&arrivals),
        ..Photons::default()
    };
    for chunk in &chunks {
        all.energy += chunk.energy;
        all.work += chunk.work;
        all.seconds += chunk.seconds;
    }
    all.seconds += clock.seconds();
    all
}

struct Tracer<'a> {
    scene: &'a Scene,
    vectors: Vectors,
    seed: u64,
    max_depth: Option<u32>,
    /// No arrivals, but ready for those of the scene.
    none: Arrivals,
    /// Sides of each object at which photons are taken in lanes.
    faces: Vec<Option<[Face; 2]>>,
    /// Whether any medium absorbs: only then it matters in which one a photon starts.
    absorbing: bool,
}

/// A photon under way.
pub(super) struct Flight {
    /// Number in the task.
    path: u32,
    pub(super) stream: Stream,
    pub(super) ray: Ray,
    pub(super) flux: Rgb,
    /// Share of the flux of an unaimed photon, at most 1: the chance to go on where aiming ends.
    pub(super) worth: f64,
    medium: Option<usize>,
    events: u32,
    /// Dielectric interfaces met in a row.
    pub(super) chain: u32,
}

/// What a task has traced, in the order of the waves.
#[derive(Default)]
struct Log {
    photons: Photons,
    /// Number in the task of the path of each stored photon.
    paths: Vec<u32>,
}

impl<'a> Tracer<'a> {
    fn new(scene: &'a Scene, seed: u64, max_depth: Option<u32>) -> Self {
        Self {
            scene,
            vectors: Vectors::best(),
            seed,
            max_depth,
            none: Arrivals::of(scene),
            faces: Face::all(scene),
            absorbing: scene.materials.iter().any(|material| {
                material
                    .dielectric
                    .is_some_and(|dielectric| dielectric.absorption != Rgb::ZERO)
            }),
        }
    }

    /// Traces a task: waves of photons, a new one in place of each that ends.
    fn trace(&self, first: u64, count: u64) -> Photons {
        let mut log = Log::default();
        log.photons.arrivals = self.none.emptied();
        let expected = STORED * count as usize;
        log.paths.reserve(expected);
        log.photons.points.reserve(expected);
        let stream = |path| Stream::new(self.seed, Purpose::Photon, first.wrapping_add(path));
        let (mut paths, mut heads) = (0..count, Heads::blank());
        let mut start = |log: &mut Log| {
            paths.find_map(|path| {
                let lane = path as usize % Heads::WIDTH;
                if lane == 0 {
                    heads.draw(self.vectors, |lane| stream(path + lane as u64));
                }
                let ahead = heads.ahead(lane, stream(path));
                self.start(path as u32, ahead, &mut log.photons)
            })
        };
        let mut wave: Vec<Flight> = std::iter::from_fn(|| start(&mut log)).take(WAVE).collect();
        let mut rays = Vec::with_capacity(WAVE);
        let (mut bounces, mut ended) = (Bounces::none(), Vec::with_capacity(WAVE));
        let mut plain = Vec::with_capacity(WAVE);
        while !wave.is_empty() {
            rays.clear();
            rays.extend(wave.iter().map(|flight| flight.ray));
            let nearest = self.scene.nearest_many(&rays, &mut log.photons.work);
            ended.clear();
            plain.clear();
            for (place, (flight, met)) in wave.iter_mut().zip(nearest).enumerate() {
                if let Some((object, Crossing { t, .. })) = met
                    && self.faces[object].is_some()
                    && !(self.absorbing && flight.medium.is_some())
                {
                    plain.push((place as u32, object as u32, t));
                    continue;
                }
                let hit = met.map(|(object, at)| self.scene.hit(&flight.ray, object, at));
                if !self.advance(flight, hit, &mut log) {
                    ended.push(place as u32);
                }
            }
            for plain in plain.chunks(bounce::WIDTH) {
                self.bounce_many(plain, &mut wave, &mut bounces, &mut ended, &mut log);
            }
            // From the back, so that what takes an empty place has been seen.
            ended.sort_unstable();
            for place in ended.iter().rev() {
                match start(&mut log) {
                    Some(next) => wave[*place as usize] = next,
                    None => drop(wave.swap_remove(*place as usize)),
                }
            }
        }
        log.photons.energy += bounces.energy();
        log.in_order(count as usize)
    }

    /// The events of photons at faces, each with its place in the wave, the object and the parameter. Lists the places of those that
    /// end.
    fn bounce_many(
        &self,
        met: &[(u32, u32, f64)],
        wave: &mut [Flight],
        bounces: &mut Bounces,
        ended: &mut Vec<u32>,
        log: &mut Log,
    ) {
        bounces.clear();
        let mut faces = [None; bounce::WIDTH];
        for (&(place, object, t), slot) in met.iter().zip(&mut faces) {
            let flight = &wave[place as usize];
            let face = self.faces[object as usize].as_ref();
            let face = face.map(|both| Face::met(both, flight.ray.direction));
            if let Some(face) = face {
                bounces.put(flight, t, face);
            }
            *slot = face;
        }
        self.vectors.run(&mut *bounces);
        for (lane, (&(place, object, _), face)) in met.iter().zip(faces).enumerate() {
            let Some(face) = face else { continue };
            let flight = &mut wave[place as usize];
            let out = &mut log.photons;
            out.work.photons_stored += 1;
            log.paths.push(flight.path);
            out.points.push(bounces.point(lane));
            out.arrivals
                .push_flat(flight.flux, object, face, flight.events);
            flight.events += 1;
            if !(bounces.send(lane, flight) && self.goes_on(flight, out)) {
                ended.push(place);
            }
        }
    }

    fn start(&self, path: u32, mut ahead: Ahead, out: &mut Photons) -> Option<Flight> {
        let start = self.scene.lights.emit(&mut ahead)?;
        out.work.photon_paths += 1;
        if start.worth == 0.0 {
            return None;
        }
        out.energy.emitted += start.flux;
        let medium = if self.absorbing {
            self.scene.medium_at(start.ray.origin, &mut out.work)
        } else {
            None
        };
        let flight = Flight {
            path,
            stream: ahead.stream(),
            ray: start.ray,
            flux: start.flux,
            worth: start.worth.min(1.0),
            medium,
            events: 0,
            chain: 0,
        };
        self.goes_on(&flight, out).then_some(flight)
    }

    /// Whether the photon may fly on within the depth limit. The event that sends its light to the camera counts too.
    fn goes_on(&self, flight: &Flight, out: &mut Photons) -> bool {
        let cut = self.max_depth.is_some_and(|most| flight.events >= most);
        if cut {
            out.energy.cut += flight.flux;
        } else {
            out.work.photon_segments += 1;
        }
        !cut
    }

    /// The event at the end of a straight part of the path; `false` at the path's end.
    fn advance(&self, flight: &mut Flight, hit: Option<Hit>, log: &mut Log) -> bool {
        let out = &mut log.photons;
        let Some(hit) = hit else {
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
            log.paths.push(flight.path);
            out.points.push(hit.point);
            out.arrivals.push(&Arrival {
                flux: flight.flux,
                normal: hit.normal_on(lobes.side),
                object: hit.object as u32,
                events: flight.events,
            });
        }
        let scattered = match &lobes.interface {
            Some(interface) => cross(flight, &hit, lobes.side, interface),
            None => bounce(flight, &hit, &lobes),
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
        self.goes_on(flight, out)
    }
}

impl Log {
    /// The photons in the order of their paths, those of a path in the order of its events: a stable counting sort.
    fn in_order(self, paths: usize) -> Photons {
        let mut next = vec![0_usize; paths + 1];
        for &path in &self.paths {
            next[path as usize + 1] += 1;
        }
        for path in 0..paths {
            next[path + 1] += next[path];
        }
        let mut order = vec![0; self.paths.len()];
        for (photon, &path) in (0..).zip(&self.paths) {
            let place = &mut next[path as usize];
            order[*place] = photon;
            *place += 1;
        }
        let mut photons = self.photons;
        photons.points = order
            .iter()
            .map(|&from| photons.points[from as usize])
            .collect();
        photons.arrivals.reorder(&order);
        photons
    }
}

/// Reflects or refracts at a dielectric that was met on `side`: the side and direction in which the photon leaves. `None` if
/// roulette ends the path.
fn cross(
    flight: &mut Flight,
    hit: &Hit,
    side: Side,
    interface: &Interface,
) -> Option<(Side, DVec3)> {
    flight.chain += 1;
    if flight.chain > LONG_CHAIN {
        if flight.stream.uniform() >= CHAIN_SURVIVAL {
            return None;
        }
        flight.flux /= CHAIN_SURVIVAL;
    }
    Some(match interface.refracted {
        Some(refracted) if flight.stream.uniform() >= interface.reflectance => {
            flight.medium = interface.beyond;
            (side.other(), refracted)
        }
        _ => (side, reflect(flight.ray.direction, hit.normal)),
    })
}

/// Reflects from a diffuse surface or mirror: the side and direction in which the photon leaves. `None` if roulette ends the path.
fn bounce(flight: &mut Flight, hit: &Hit, lobes: &Lobes) -> Option<(Side, DVec3)> {
    let survival = (lobes.diffuse + lobes.mirror).max_element().min(SUREST);
    let (diffuse, mirror) = (lobes.diffuse.max_element(), lobes.mirror.max_element());
    let diffuse = survival * diffuse / (diffuse + mirror);
    let chance = flight.worth * diffuse;
    let choice = flight.stream.uniform();
    // Also false where nothing is reflected and the chance is 0/0.
    let direction = if choice < chance {
        flight.flux *= lobes.diffuse / chance;
        flight.worth = 1.0;
        cosine_hemisphere(hit.normal_on(lobes.side), flight.stream.uniform2())
    } else if choice >= diffuse && choice < survival {
        flight.flux *= lobes.mirror / (survival - diffuse);
        reflect(flight.ray.direction, hit.normal)
    } else {
        return None;
    };
    flight.chain = 0;
    Some((lobes.side, direction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::file;
    use std::path::Path;

    /// Flat and round, plain, patterned, mirroring, absorbing and refracting surfaces, seen from both sides.
    const SCENE: &str = include_str!("trace/lanes.toml");

    #[test]
    fn photons_in_lanes_do_to_the_bit_what_they_do_alone() {
        let scene = file::parse(SCENE, "lanes", Path::new(""), &[]).expect("a scene");
        for depth in [None, Some(3)] {
            let mut alone = Tracer::new(&scene, 5, depth);
            assert!(alone.faces.iter().flatten().count() >= 3);
            alone.faces.fill(None);
            let expected = trace_by(&alone, 7, 5000);
            for vectors in Vectors::all() {
                let tracer = Tracer {
                    vectors,
                    ..Tracer::new(&scene, 5, depth)
                };
                let got = trace_by(&tracer, 7, 5000);
                assert_eq!(got.points, expected.points, "{vectors}");
                assert!(got.arrivals.iter().eq(expected.arrivals.iter()));
                assert_eq!(got.work, expected.work);
                let energies = [got.energy, expected.energy];
                let [a, b] = energies.map(|e| [e.absorbed, e.escaped, e.roulette, e.cut]);
                for (a, b) in a.into_iter().zip(b) {
                    let emitted = expected.energy.emitted;
                    assert!((a - b).abs().cmple(1e-12 * emitted).all(), "{a} {b}");
                }
            }
        }
    }
}
