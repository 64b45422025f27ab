//! Features of a picture beside its colours, for denoisers and for finding faults: what each pixel shows.
//!
//! Depth and normal are means over the very samples that make the colour: the camera ray of each is met with the scene once more, so
//! that the renderers pay nothing where no feature is asked for. Object and path hash cannot be averaged: they are those of the ray
//! through the centres of the pixel and of the lens, which needs no random number. Sums are made pixel by pixel in the order of
//! samples and passes, so threads change no bit.

use super::antialias::pattern::CENTER;
use super::settings::Settings;
use super::whitted::Whitted;
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use crate::scene::Scene;
use crate::scene::options::Aov;
use glam::DVec3;
use rayon::prelude::*;

/// The first hits of a pixel's samples.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    samples: f64,
    /// Those that met something.
    met: f64,
    depth: f64,
    normal: DVec3,
}

/// What stands behind a pixel's centre.
#[derive(Clone, Copy, Debug)]
struct Center {
    object: Option<usize>,
    hash: u64,
}

/// What photon mapping gathered for a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Gathered {
    /// Mean radius of its hit points in the last pass in which it had any.
    radius: f64,
    /// Photons of all passes.
    photons: u64,
}

/// What a hit point gathered in a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathering {
    pub(super) pixel: usize,
    pub(super) radius: f64,
    pub(super) photons: u64,
}

/// The features that the settings ask for.
#[derive(Clone, Debug)]
pub struct Features {
    wanted: Vec<Aov>,
    width: usize,
    /// Each of the next by pixel, row by row from the top; empty if nothing that is wanted needs it.
    seen: Vec<Seen>,
    centers: Vec<Center>,
    gathered: Vec<Gathered>,
}

/// A channel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name in the file.
    pub name: &'static str,
    /// Its values, row by row from the top.
    pub values: Values,
}

/// The values of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers.
    Float(Vec<f32>),
    /// Bits.
    Whole(Vec<u32>),
}

impl Values {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Whole(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Features {
    /// Prepares what the settings ask for, so far as the integrator has it; `None` if that is nothing.
    pub(super) fn new(scene: &Scene, settings: &Settings, work: &mut Work) -> Option<Self> {
        let by_photons = settings.integrator.by_photons();
        let has = |aov: &&Aov| by_photons || !aov.needs_photons();
        let wanted: Vec<Aov> = settings.aov.iter().filter(has).copied().collect();
        if wanted.is_empty() {
            return None;
        }
        let pixels = scene.film.width as usize * scene.film.height as usize;
        let wants = |some: &[Aov]| some.iter().any(|aov| wanted.contains(aov));
        let count = |some: &[Aov]| if wants(some) { pixels } else { 0 };
        Some(Self {
            width: scene.film.width as usize,
            seen: vec![Seen::default(); count(&[Aov::Depth, Aov::Normal])],
            centers: centers(
                scene,
                settings,
                count(&[Aov::Object, Aov::PathHash]),
                wants(&[Aov::PathHash]),
                work,
            ),
            gathered: vec![Gathered::default(); count(&[Aov::Radius, Aov::Photons])],
            wanted,
        })
    }

    /// Adds the first hits of a pass. `rays` puts the camera rays of a pixel's samples into an empty list.
    pub(super) fn look(
        &mut self,
        scene: &Scene,
        rays: impl Fn(usize, &mut Vec<Ray>, &mut Work) + Sync,
    ) -> Work {
        let (eye, forward) = (scene.camera.eye(), scene.camera.frame()[2]);
        let width = self.width;
        let rows = self.seen.par_chunks_mut(width).enumerate();
        let works = rows.map(|(y, row)| {
            let mut work = Work::default();
            let mut list = Vec::new();
            for (seen, pixel) in row.iter_mut().zip(y * width..) {
                list.clear();
                rays(pixel, &mut list, &mut work);
                work.camera_rays += list.len() as u64;
                for ray in &list {
                    seen.samples += 1.0;
                    if let Some(hit) = scene.intersect(ray, &mut work) {
                        seen.met += 1.0;
                        seen.depth += (hit.point - eye).dot(forward);
                        seen.normal += hit.facing_normal(ray.direction);
                    }
                }
            }
            work
        });
        works.reduce(Work::default, |mut a, b| {
            a += b;
            a
        })
    }

    /// Adds what the hit points of a pass gathered.
    pub(super) fn gathered(&mut self, hit_points: impl Iterator<Item = Gathering>) {
        if self.gathered.is_empty() {
            return;
        }
        let mut radii = vec![(0.0, 0.0); self.gathered.len()];
        for hit_point in hit_points {
            let (sum, count) = &mut radii[hit_point.pixel];
            *sum += hit_point.radius;
            *count += 1.0;
            self.gathered[hit_point.pixel].photons += hit_point.photons;
        }
        for (gathered, (sum, count)) in self.gathered.iter_mut().zip(radii) {
            if count > 0.0 {
                gathered.radius = sum / count;
            }
        }
    }

    /// The channels:
    ///
    /// - depth, `Z`: distance of the first hit from the plane of the lens along the view axis, world units; mean over the samples
    ///   that meet something, +∞ where none does.
    /// - normal, `N.X`, `N.Y`, `N.Z`: unit normal of the first hit in world space, on the side seen; mean over all samples, those that
    ///   meet nothing counting as 0. Not made a unit vector again.
    /// - object, `object`: number of the object (from 0, in the order of [`Scene::objects`]) behind the centres of pixel and lens; −1
    ///   for none.
    /// - path hash, `path_hash.high` and `path_hash.low`: the two halves of the 64-bit hash by which antialiasing compares pixels, of
    ///   the path behind the same centres. A ray that meets nothing has a hash too, the same for all.
    /// - radius, `radius`: mean gather radius of the pixel's hit points in the last pass in which it had any, world units; 0 if it
    ///   never had.
    /// - photons, `photons`: photons gathered by its hit points, all passes together; 0 if it had none.
    pub fn channels(&self) -> Vec<Channel> {
        self.wanted
            .iter()
            .flat_map(|&aov| self.channels_of(aov))
            .collect()
    }

    fn channels_of(&self, aov: Aov) -> Vec<Channel> {
        let of_seen = |name, value: &dyn Fn(&Seen) -> f64| float(name, &self.seen, value);
        let of_gathered =
            |name, value: &dyn Fn(&Gathered) -> f64| float(name, &self.gathered, value);
        let half = |name, shift: u32| Channel {
            name,
            values: Values::Whole(
                (self.centers.iter())
                    .map(|center| (center.hash >> shift) as u32)
                    .collect(),
            ),
        };
        match aov {
            Aov::Depth => vec![of_seen("Z", &|seen| match seen.met {
                0.0 => f64::INFINITY,
                met => seen.depth / met,
            })],
            Aov::Normal => [("N.X", 0), ("N.Y", 1), ("N.Z", 2)]
                .map(|(name, axis)| {
                    of_seen(name, &|seen| seen.normal[axis] / seen.samples.max(1.0))
                })
                .to_vec(),
            Aov::Object => vec![float("object", &self.centers, &|center: &Center| {
                center.object.map_or(-1.0, |object| object as f64)
            })],
            Aov::PathHash => vec![half("path_hash.high", 32), half("path_hash.low", 0)],
            Aov::Radius => vec![of_gathered("radius", &|gathered| gathered.radius)],
            Aov::Photons => vec![of_gathered("photons", &|gathered| gathered.photons as f64)],
        }
    }
}

fn float<T>(name: &'static str, pixels: &[T], value: &dyn Fn(&T) -> f64) -> Channel {
    let values = pixels.iter().map(|pixel| value(pixel) as f32);
    Channel {
        name,
        values: Values::Float(values.collect()),
    }
}

/// What stands behind the centres of the first `count` pixels.
fn centers(
    scene: &Scene,
    settings: &Settings,
    count: usize,
    hashed: bool,
    work: &mut Work,
) -> Vec<Center> {
    let whitted = Whitted::new(scene, settings);
    let look = |index: usize| {
        let mut work = Work {
            camera_rays: 1,
            ..Work::default()
        };
        let hit = scene.intersect(&whitted.center_ray(index), &mut work);
        let hash = match hashed {
            true => (whitted.fingerprint(index, CENTER.offset, &mut work)).value(settings.hash),
            false => 0,
        };
        let object = hit.map(|hit| hit.object);
        (Center { object, hash }, work)
    };
    let found: Vec<(Center, Work)> = (0..count).into_par_iter().map(look).collect();
    for (_, more) in &found {
        *work += *more;
    }
    found.into_iter().map(|(center, _)| center).collect()
}
