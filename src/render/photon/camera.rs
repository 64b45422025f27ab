//! Camera paths: from a pixel through specular events to hit points, the places where light is gathered.

use super::evenly::{self, Choice};
use super::parts::joined;
use crate::geometry::hit::{Hit, Side};
use crate::geometry::ray::Ray;
use crate::numeric::clock::ThreadClock;
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use crate::render::scatter::{Interface, Lobes, reflect};
use crate::scene::{Rgb, Scene};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// The first radius of a hit point is this many times the side of a pixel at the length of its camera path, if no radius is
/// given: the kernel blurs little more than the pixel itself does. At 3 bias rules the error of caustics, at 1 noise
/// (experiment `time_to_error`).
pub const PIXELS_PER_RADIUS: f64 = 1.5;
/// No radius falls below this many bounds of the hit's error: within them, photons do not lie where they say.
const LEAST_IN_ERRORS: f64 = 64.0;
/// Branches of less weight than this go on by roulette.
const LEAST_WEIGHT: f64 = 0.01;
/// Of new samples each pass, branches at dielectrics with less than this share of their path go on by roulette, and do not branch
/// again. A lamp in a faint reflection then comes more often at a quarter of its brightness, not seldom at all of it, and glass
/// seldom makes more than two hit points of a sample.
const LEAST_SHARE: f64 = 0.25;
/// Specular events before roulette begins whatever the weight, and the chance to pass each further one.
const LONG_CHAIN: u32 = 32;
const CHAIN_SURVIVAL: f64 = 0.75;
/// Pixels of one task. Fixed, so that the order of hit points never depends on threads.
const CHUNK: usize = 512;
/// Camera paths of a task that are under way together: their rays ask the scene at once. Changes no byte.
const WAVE: usize = 256;

/// A place where light is gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitPoint {
    /// Where.
    pub point: DVec3,
    /// Unit normal on the side from which the camera sees it.
    pub normal: DVec3,
    /// Factor from irradiance to the pixel's radiance: the weight of the camera path times reflectance/π, over the number of
    /// the pixel's samples.
    pub weight: Rgb,
    /// Square of the first radius.
    pub first_radius_squared: f64,
    /// Least square of any radius.
    pub least_radius_squared: f64,
    /// Pixel, row by row from the top.
    pub pixel: u32,
    /// Object it lies on.
    pub object: u32,
    /// Specular events before.
    pub events: u32,
}

/// The hit points of a picture, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Hit points in the order of their pixels.
    pub hit_points: Vec<HitPoint>,
    /// Emission seen by each pixel, directly or through specular events.
    pub emission: Vec<Rgb>,
    /// Work done.
    pub work: Work,
    /// CPU seconds that they took; on several threads a little else may be among them.
    pub seconds: f64,
}

/// What decides the camera samples.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Samples per pixel.
    pub spp: u32,
    /// Seed.
    pub seed: u64,
    /// The pass: each has random numbers of its own.
    pub pass: u64,
    /// First radius; `None` takes [`PIXELS_PER_RADIUS`].
    pub radius: Option<f64>,
    /// Most scattering events.
    pub max_depth: Option<u32>,
    /// Whether both branches of a dielectric are always followed. Samples that stay for all passes must, or their choices would
    /// stay as noise; new samples follow faint branches by chance.
    pub split: bool,
}

/// Sends the camera samples of every pixel.
pub fn view(scene: &Scene, sampling: &Sampling) -> View {
    let pixels = scene.film.width as usize * scene.film.height as usize;
    let mut work = Work::default();
    let medium = scene.medium_at(scene.camera.eye(), &mut work);
    let chunks: Vec<View> = (0..pixels.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let clock = ThreadClock::start();
            let viewer = Viewer {
                scene,
                sampling,
                medium,
                first: chunk * CHUNK,
                log: Log::default(),
            };
            let view = viewer.view(CHUNK.min(pixels - chunk * CHUNK));
            View {
                seconds: clock.seconds(),
                ..view
            }
        })
        .collect();
    let clock = ThreadClock::start();
    let mut seconds = 0.0;
    for chunk in &chunks {
        work += chunk.work;
        seconds += chunk.seconds;
    }
    let hit_points: Vec<&[HitPoint]> = chunks.iter().map(|chunk| &*chunk.hit_points).collect();
    let emission: Vec<&[Rgb]> = chunks.iter().map(|chunk| &*chunk.emission).collect();
    let (hit_points, emission) = (
        joined(&hit_points, |_, hit_point| hit_point),
        joined(&emission, |_, radiance| radiance),
    );
    View {
        hit_points,
        emission,
        work,
        seconds: seconds + clock.seconds(),
    }
}

impl Sampling {
    /// Number of a pixel's sample among those of a pass.
    fn number(&self, pixel: usize, within: u32) -> u64 {
        (pixel as u64 * u64::from(self.spp)).wrapping_add(u64::from(within))
    }
}

/// Cells of the stratified jitter: the most nearly square grid of exactly `spp` cells.
fn strata(spp: u32) -> (u32, u32) {
    let mut columns = spp.isqrt().max(1);
    while !spp.is_multiple_of(columns) {
        columns -= 1;
    }
    (columns, spp / columns)
}

/// The camera ray of the sample `within` (from 0) of a pixel, and the random numbers that its path goes on with.
pub(crate) fn first_ray(
    scene: &Scene,
    sampling: &Sampling,
    pixel: usize,
    within: u32,
) -> (Ray, Stream) {
    let film = scene.film;
    let size = DVec2::new(f64::from(film.width), f64::from(film.height));
    let corner = DVec2::new(
        (pixel % film.width as usize) as f64,
        (pixel / film.width as usize) as f64,
    );
    let Sampling {
        spp, seed, pass, ..
    } = *sampling;
    let (columns, rows) = strata(spp);
    let cells = DVec2::new(f64::from(columns), f64::from(rows));
    let samples = u64::from(film.width) * u64::from(film.height) * u64::from(spp);
    let number = sampling.number(pixel, within);
    let mut stream = Stream::new(
        seed,
        Purpose::Camera,
        pass.wrapping_mul(samples).wrapping_add(number),
    );
    let cell = DVec2::new(f64::from(within % columns), f64::from(within / columns));
    // The stream's own place is not used but in the first pass, nor a place on the lens of a pinhole: but they move on.
    let place = if pass == 0 {
        stream.uniform2()
    } else {
        stream.skip2();
        evenly::place(Stream::new(seed, Purpose::Camera, number).uniform2(), pass)
    };
    let lens = if scene.camera.lens_radius() == 0.0 {
        stream.skip2();
        [0.5; 2]
    } else {
        stream.uniform2()
    };
    let jitter = (cell + DVec2::from_array(place)) / cells;
    let ray = scene.camera.ray(corner + jitter, size, lens);
    (ray, stream)
}

/// A task: the samples of some pixels.
struct Viewer<'a> {
    scene: &'a Scene,
    sampling: &'a Sampling,
    /// Medium at the eye.
    medium: Option<usize>,
    /// First pixel.
    first: usize,
    log: Log,
}

/// What a task has found, in the order of the waves.
#[derive(Default)]
struct Log {
    hit_points: Vec<HitPoint>,
    /// Number in the task of the sample of each.
    samples: Vec<u32>,
    /// Emission that samples saw.
    emission: Vec<(u32, Rgb)>,
    work: Work,
}

/// A camera path under way, with the branches of its sample that are still to follow. They are followed one after the other,
/// because they draw from one stream.
struct Walk {
    /// Number of the sample in the task.
    sample: u32,
    stream: Stream,
    choice: Choice,
    branch: Branch,
    open: Vec<Branch>,
}

/// A branch of a camera path.
#[derive(Clone, Copy)]
struct Branch {
    ray: Ray,
    weight: Rgb,
    /// What dielectrics left of it: the product of its shares there.
    share: f64,
    medium: Option<usize>,
    /// Length so far.
    length: f64,
    events: u32,
}

impl Viewer<'_> {
    /// Views `pixels` pixels: waves of samples, a new one in place of each that ends.
    fn view(mut self, pixels: usize) -> View {
        let mut samples = 0..pixels as u32 * self.sampling.spp;
        let first = samples.by_ref().take(WAVE);
        let first = first.map(|sample| self.start(sample, Vec::new()));
        let mut wave: Vec<Walk> = first.collect();
        let mut rays = Vec::with_capacity(WAVE);
        while !wave.is_empty() {
            rays.clear();
            rays.extend(wave.iter().map(|walk| walk.branch.ray));
            let mut nearest = self.scene.nearest_many(&rays, &mut self.log.work);
            let mut place = 0;
            while let Some(walk) = wave.get_mut(place) {
                if let Some((object, at)) = nearest[place] {
                    let hit = self.scene.hit(&walk.branch.ray, object, at);
                    self.follow(walk, &hit);
                }
                if let Some(branch) = walk.open.pop() {
                    walk.branch = branch;
                    place += 1;
                } else if let Some(sample) = samples.next() {
                    *walk = self.start(sample, std::mem::take(&mut walk.open));
                    place += 1;
                } else {
                    wave.swap_remove(place);
                    nearest.swap_remove(place);
                }
            }
        }
        self.in_order(pixels)
    }

    /// The walk of a sample; `open` is empty memory.
    fn start(&mut self, sample: u32, open: Vec<Branch>) -> Walk {
        let spp = self.sampling.spp;
        let pixel = self.first + (sample / spp) as usize;
        let within = sample % spp;
        let (ray, stream) = first_ray(self.scene, self.sampling, pixel, within);
        let Sampling { seed, pass, .. } = *self.sampling;
        let number = self.sampling.number(pixel, within);
        self.log.work.camera_rays += 1;
        Walk {
            sample,
            stream,
            choice: Choice::new(seed, number, pass),
            branch: Branch {
                ray,
                weight: Rgb::ONE,
                share: 1.0,
                medium: self.medium,
                length: 0.0,
                events: 0,
            },
            open,
        }
    }

    /// What was found, sample by sample, each in the order of its path.
    fn in_order(self, pixels: usize) -> View {
        let Log {
            hit_points,
            samples,
            emission: mut seen,
            work,
        } = self.log;
        let mut order: Vec<u32> = (0..hit_points.len() as u32).collect();
        // Stable: those of one sample keep their order.
        order.sort_by_key(|&place| samples[place as usize]);
        seen.sort_by_key(|&(sample, _)| sample);
        let mut emission = vec![Rgb::ZERO; pixels];
        for (sample, radiance) in seen {
            emission[(sample / self.sampling.spp) as usize] += radiance;
        }
        View {
            hit_points: order
                .into_iter()
                .map(|place| hit_points[place as usize])
                .collect(),
            emission,
            work,
            seconds: 0.0,
        }
    }

    fn follow(&mut self, walk: &mut Walk, hit: &Hit) {
        let mut here = walk.branch;
        let direction = here.ray.direction;
        here.weight *= self.scene.transmittance(here.medium, hit.t);
        here.length += hit.t;
        if let Some(emission) = &self.scene.material(hit).emission {
            let radiance = emission.towards(-direction.dot(hit.normal));
            let radiance = here.weight * radiance / f64::from(self.sampling.spp);
            self.log.emission.push((walk.sample, radiance));
        }
        let lobes = Lobes::at(self.scene, hit, direction);
        // A further event, the diffuse one of a hit point included, must be within the limit.
        if self
            .sampling
            .max_depth
            .is_some_and(|most| here.events >= most)
        {
            return;
        }
        if lobes.diffuse != Rgb::ZERO {
            self.place(&here, hit, lobes.diffuse, walk.sample);
        }
        here.events += 1;
        if let Some(interface) = &lobes.interface {
            self.branch_at(here, hit, lobes.side, interface, walk);
        } else if lobes.mirror != Rgb::ZERO {
            here.weight *= lobes.mirror;
            here.ray = self.leave(hit, lobes.side, reflect(direction, hit.normal));
            self.send(here, walk);
        }
    }

    fn place(&mut self, here: &Branch, hit: &Hit, diffuse: Rgb, sample: u32) {
        let weight = here.weight * diffuse / (PI * f64::from(self.sampling.spp));
        if weight == Rgb::ZERO {
            return;
        }
        if !hit.point.is_finite() {
            // No index can hold it; the film counts the sample as bad.
            self.log.emission.push((sample, Rgb::NAN));
            return;
        }
        let least = LEAST_IN_ERRORS * hit.error;
        let pixel_size = self.scene.camera.pixel_size(self.scene.film.height);
        let radius = self
            .sampling
            .radius
            .unwrap_or(PIXELS_PER_RADIUS * pixel_size * here.length);
        let pixel = self.first as u32 + sample / self.sampling.spp;
        let hit_point = HitPoint {
            point: hit.point,
            normal: hit.facing_normal(here.ray.direction),
            weight,
            first_radius_squared: radius * radius,
            least_radius_squared: (least * least).max(f64::MIN_POSITIVE),
            pixel,
            object: hit.object as u32,
            events: here.events,
        };
        self.log.hit_points.push(hit_point);
        self.log.samples.push(sample);
    }

    fn leave(&mut self, hit: &Hit, side: Side, direction: DVec3) -> Ray {
        self.scene.leave(hit, side, direction, &mut self.log.work)
    }

    fn branch_at(
        &mut self,
        here: Branch,
        hit: &Hit,
        side: Side,
        interface: &Interface,
        walk: &mut Walk,
    ) {
        let reflected = Branch {
            ray: self.leave(hit, side, reflect(here.ray.direction, hit.normal)),
            ..here
        };
        let Some(direction) = interface.refracted else {
            self.send(reflected, walk);
            return;
        };
        let refracted = Branch {
            ray: self.leave(hit, side.other(), direction),
            weight: here.weight * interface.radiance_scale,
            medium: interface.beyond,
            ..here
        };
        let reflectance = interface.reflectance;
        let larger = here.share * reflectance.max(1.0 - reflectance);
        if !self.sampling.split && larger < LEAST_SHARE {
            let reflects = walk.choice.first(reflectance, &mut walk.stream);
            self.send(if reflects { reflected } else { refracted }, walk);
            return;
        }
        for (mut way, share) in [(reflected, reflectance), (refracted, 1.0 - reflectance)] {
            way.share *= share;
            way.weight *= share;
            if !self.sampling.split && way.share < LEAST_SHARE {
                let survival = way.share / LEAST_SHARE;
                if !walk.choice.first(survival, &mut walk.stream) {
                    continue;
                }
                way.weight /= survival;
                way.share = LEAST_SHARE;
            }
            self.send(way, walk);
        }
    }

    /// Keeps a branch, or ends it by roulette that keeps the mean if it is light or long.
    fn send(&mut self, mut branch: Branch, walk: &mut Walk) {
        let mut survival = (branch.weight.max_element() / LEAST_WEIGHT).min(1.0);
        if branch.events > LONG_CHAIN {
            survival *= CHAIN_SURVIVAL;
        }
        if survival < 1.0 {
            if walk.stream.uniform() >= survival {
                return;
            }
            branch.weight /= survival;
        }
        self.log.work.scattered_rays += 1;
        walk.open.push(branch);
    }
}

#[cfg(test)]
mod tests {
    use super::strata;

    #[test]
    fn strata_are_as_many_as_the_samples() {
        for (spp, expected) in [
            (1, (1, 1)),
            (2, (1, 2)),
            (4, (2, 2)),
            (7, (1, 7)),
            (12, (3, 4)),
            (16, (4, 4)),
        ] {
            assert_eq!(strata(spp), expected);
        }
    }
}
