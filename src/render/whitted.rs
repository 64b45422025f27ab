//! Recursive ray tracing (Whitted, "An improved illumination model for shaded display", 1980): direct light at diffuse surfaces,
//! exact mirrors and dielectrics, no light scattered diffusely more than once.
//!
//! At a dielectric both branches are followed while they matter; below that, Russian roulette keeps the mean. Area lights are
//! sampled in up to 16 strata. The path hash covers the part without chance, so it has no noise.

use super::antialias::{CENTER, Event, GRID, Met, PathHash, mask};
use super::film::Film;
use super::path::unoccluded;
use super::scatter::{Lobes, reflect};
use super::settings::Settings;
use crate::geometry::hit::Hit;
use crate::geometry::ray::Ray;
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use crate::scene::light::Light;
use crate::scene::options::Antialias;
use crate::scene::{Rgb, Scene};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Strata per side of an area light's unit square for a branch that carries the whole pixel; a branch of weight w gets √w times
/// as many, so that shadow rays go where their noise would be seen.
const LIGHT_GRID: f64 = 4.0;

/// Branches of at least this weight are always followed; lighter ones play roulette for it.
const SURE_WEIGHT: f64 = 1.0 / 256.0;

/// Branches at least this deep play roulette whatever their weight.
const SURE_DEPTH: u32 = 24;

/// Greatest chance to go on in roulette, so that mirrors without loss end too.
const MOST_SURVIVAL: f64 = 0.98;

/// The lens point of a hash: its centre, so that the hash does not depend on lens noise.
const LENS_CENTER: [f64; 2] = [0.5, 0.5];

/// A Whitted renderer between passes.
pub struct Whitted<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    medium_of_eye: Option<usize>,
    /// Pixels sampled 3×3; found by the first pass.
    resampled: Option<Vec<bool>>,
}

impl<'a> Whitted<'a> {
    /// Prepares the first pass.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Self {
        let medium_of_eye = scene.medium_at(scene.camera.eye(), &mut Work::default());
        let pixels = scene.film.width as usize * scene.film.height as usize;
        let resampled = match settings.aa {
            Antialias::None => Some(vec![false; pixels]),
            Antialias::Uniform => Some(vec![true; pixels]),
            Antialias::PathHash => None,
        };
        Self {
            scene,
            settings,
            medium_of_eye,
            resampled,
        }
    }

    /// Adds the samples of one pass: one at the centre of each pixel, and eight more where antialiasing asks for them.
    pub fn pass(&mut self, pass: u64, film: &mut Film) -> Work {
        let width = film.size().width as usize;
        let hashing = self.resampled.is_none();
        let rows: Vec<(Vec<u64>, Work)> = film
            .pixels_mut()
            .par_chunks_mut(width)
            .enumerate()
            .map(|(y, row)| {
                let mut work = Work::default();
                let mut hashes = Vec::new();
                for (x, pixel) in row.iter_mut().enumerate() {
                    let index = y * width + x;
                    let (radiance, hash) = self.sample(pass, index, CENTER, &mut work);
                    pixel.add(radiance);
                    if hashing {
                        hashes.push(self.hash_through_lens_center(index, hash, &mut work));
                    }
                }
                (hashes, work)
            })
            .collect();
        let mut work = rows.iter().map(|row| row.1).fold(Work::default(), join);
        let hashes: Vec<u64> = rows.into_iter().flat_map(|row| row.0).collect();
        if hashing {
            self.resampled = Some(mask(&hashes, width));
        }
        let this = &*self;
        let resampled = this.resampled().unwrap_or_default();
        let rows = film
            .pixels_mut()
            .par_chunks_mut(width)
            .enumerate()
            .map(|(y, row)| {
                let mut work = Work::default();
                for (x, pixel) in row
                    .iter_mut()
                    .enumerate()
                    .filter(|(x, _)| resampled[y * width + x])
                {
                    for place in (0..GRID.len()).filter(|&place| place != CENTER) {
                        pixel.add(this.sample(pass, y * width + x, place, &mut work).0);
                    }
                }
                work
            });
        work += rows.reduce(Work::default, join);
        work
    }

    /// The pixels that are sampled 3×3; `None` before the first pass has found them.
    pub fn resampled(&self) -> Option<&[bool]> {
        self.resampled.as_deref()
    }

    /// One sample of a pixel at one place of the grid, and the hash of its path.
    fn sample(&self, pass: u64, index: usize, place: usize, work: &mut Work) -> (Rgb, u64) {
        let size = self.scene.film;
        let pixels = u64::from(size.width) * u64::from(size.height);
        let key = (pass * pixels + index as u64) * GRID.len() as u64 + place as u64;
        let mut stream = Stream::new(self.settings.seed, Purpose::Camera, key);
        let ray = self.camera_ray(index, place, stream.uniform2());
        let (radiance, hash) = self.tree(ray, Some(&mut stream), work);
        (radiance, hash.value())
    }

    /// The hash of a pixel's path through the centre of the lens, where noise of the lens cannot reach it.
    fn hash_through_lens_center(&self, index: usize, of_sample: u64, work: &mut Work) -> u64 {
        if self.scene.camera.lens_radius() == 0.0 {
            return of_sample;
        }
        self.tree(self.camera_ray(index, CENTER, LENS_CENTER), None, work)
            .1
            .value()
    }

    fn camera_ray(&self, index: usize, place: usize, lens: [f64; 2]) -> Ray {
        let size = self.scene.film;
        let width = size.width as usize;
        let corner = DVec2::new((index % width) as f64, (index / width) as f64);
        let extent = DVec2::new(f64::from(size.width), f64::from(size.height));
        self.scene
            .camera
            .ray(corner + DVec2::from_array(GRID[place]), extent, lens)
    }

    /// Walks the tree of reflections and refractions. Without a stream only the hash is made: no light, no roulette.
    fn tree(&self, ray: Ray, mut stream: Option<&mut Stream>, work: &mut Work) -> (Rgb, PathHash) {
        work.camera_rays += 1;
        let mut hash = PathHash::default();
        let mut radiance = Rgb::ZERO;
        let mut pending = vec![Branch {
            ray,
            weight: Rgb::ONE,
            scale: 1.0,
            depth: 0,
            medium: self.medium_of_eye,
            event: Event::Camera,
            sure: true,
        }];
        while let Some(branch) = pending.pop() {
            let hit = self.scene.intersect(&branch.ray, work);
            if branch.sure {
                hash.vertex(
                    branch.event,
                    branch.depth,
                    hit.as_ref().map(|hit| met(hit, &branch.ray)),
                );
            }
            let Some(hit) = hit else {
                radiance += branch.weight * self.scene.background;
                continue;
            };
            let weight = branch.weight * self.scene.transmittance(branch.medium, hit.t);
            let branch = Branch { weight, ..branch };
            let lobes = Lobes::at(self.scene, &hit, branch.ray.direction);
            if let Some(stream) = stream.as_deref_mut() {
                radiance += weight * self.local(&branch, &hit, &lobes, stream, work);
            }
            if self
                .settings
                .max_depth
                .is_none_or(|limit| branch.depth < limit)
            {
                let scattered = branch.scattered(self.scene, &hit, &lobes, work);
                for next in scattered.into_iter().flatten() {
                    pending.extend(next.admitted(stream.as_deref_mut()));
                    work.scattered_rays += 1;
                }
            }
        }
        (radiance, hash)
    }

    /// Emission and directly received light at a hit.
    fn local(
        &self,
        branch: &Branch,
        hit: &Hit,
        lobes: &Lobes,
        stream: &mut Stream,
        work: &mut Work,
    ) -> Rgb {
        let direction = branch.ray.direction;
        let emission = self.scene.material(hit).emission;
        let mut radiance = emission.map_or(Rgb::ZERO, |emission| {
            emission.towards(-hit.normal.dot(direction))
        });
        let scatters = self
            .settings
            .max_depth
            .is_none_or(|limit| branch.depth < limit);
        if scatters && lobes.diffuse != Rgb::ZERO {
            let normal = hit.normal_on(lobes.side);
            let from = self.scene.leave(hit, lobes.side, normal, work).origin;
            let strata = (LIGHT_GRID * branch.heaviness().sqrt())
                .ceil()
                .clamp(1.0, LIGHT_GRID);
            let lights = self.scene.lights.all();
            let irradiance: Rgb = lights
                .iter()
                .map(|light| self.irradiance(light, strata as u32, from, normal, stream, work))
                .sum();
            radiance += lobes.diffuse / PI * irradiance;
        }
        radiance
    }

    fn irradiance(
        &self,
        light: &Light,
        strata: u32,
        from: DVec3,
        normal: DVec3,
        stream: &mut Stream,
        work: &mut Work,
    ) -> Rgb {
        let strata = if matches!(light, Light::Area { .. }) {
            strata
        } else {
            1
        };
        let side = f64::from(strata);
        let mut sum = Rgb::ZERO;
        for row in 0..strata {
            for column in 0..strata {
                let [a, b] = stream.uniform2();
                let place = [(f64::from(column) + a) / side, (f64::from(row) + b) / side];
                let sample = unoccluded(self.scene, light, from, normal, place, work);
                sum += sample.map_or(Rgb::ZERO, |(irradiance, _)| irradiance);
            }
        }
        sum / (side * side)
    }
}

fn join(mut a: Work, b: Work) -> Work {
    a += b;
    a
}

fn met(hit: &Hit, ray: &Ray) -> Met {
    Met {
        object: hit.object,
        piece: hit.piece,
        front: hit.normal.dot(ray.direction) < 0.0,
    }
}

/// A ray still to be traced.
struct Branch {
    ray: Ray,
    /// Share of its radiance in the pixel.
    weight: Rgb,
    /// Product of the radiance scales within `weight`; roulette looks past it.
    scale: f64,
    depth: u32,
    medium: Option<usize>,
    event: Event,
    /// Whether chance had no part in it so far.
    sure: bool,
}

impl Branch {
    /// The specular branches at a hit, reflection last so that it is followed first.
    fn scattered(
        &self,
        scene: &Scene,
        hit: &Hit,
        lobes: &Lobes,
        work: &mut Work,
    ) -> [Option<Self>; 2] {
        let mut leave = |side, direction| scene.leave(hit, side, direction, work);
        let mirrored = reflect(self.ray.direction, hit.normal);
        let next = |event, ray, share: Rgb| Self {
            ray,
            weight: self.weight * share,
            scale: self.scale,
            depth: self.depth + 1,
            medium: self.medium,
            event,
            sure: self.sure,
        };
        match &lobes.interface {
            Some(interface) => {
                let refraction = interface.refracted.map(|direction| {
                    let share = (1.0 - interface.reflectance) * interface.radiance_scale;
                    Self {
                        medium: interface.beyond,
                        scale: self.scale * interface.radiance_scale,
                        ..next(
                            Event::Refract,
                            leave(lobes.side.other(), direction),
                            Rgb::splat(share),
                        )
                    }
                });
                let reflection = (interface.reflectance > 0.0).then(|| {
                    next(
                        Event::Reflect,
                        leave(lobes.side, mirrored),
                        Rgb::splat(interface.reflectance),
                    )
                });
                [refraction, reflection]
            }
            None if lobes.mirror != Rgb::ZERO => {
                let ray = leave(lobes.side, mirrored);
                [Some(next(Event::Mirror, ray, lobes.mirror)), None]
            }
            None => [None, None],
        }
    }

    /// Share of the pixel that the branch carries, the radiance scale of glass left out.
    fn heaviness(&self) -> f64 {
        self.weight.max_element() / self.scale
    }

    /// The branch as it is if heavy enough; else what roulette leaves of it (nothing without a stream).
    fn admitted(self, stream: Option<&mut Stream>) -> Option<Self> {
        let heaviness = self.heaviness();
        if heaviness >= SURE_WEIGHT && self.depth < SURE_DEPTH {
            return Some(self);
        }
        let survival = (heaviness / SURE_WEIGHT).min(MOST_SURVIVAL);
        (stream?.uniform() < survival).then(|| Self {
            weight: self.weight / survival,
            sure: false,
            ..self
        })
    }
}
