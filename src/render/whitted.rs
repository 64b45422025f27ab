//! Recursive ray tracing (Whitted, "An improved illumination model for shaded display", 1980): direct light at diffuse surfaces,
//! exact mirrors and dielectrics, no light scattered diffusely more than once.
//!
//! At a dielectric both branches are followed while they matter; below that, Russian roulette keeps the mean. Area lights are
//! sampled in up to 16 strata. The path hash covers the part without chance, so it has no noise.

mod tree;

use super::antialias::fingerprint::Fingerprint;
use super::antialias::mask::{contrast, mask};
use super::antialias::pattern::{CENTER, Place, ROOKS, grid};
use super::features::Features;
use super::film::{Film, Pixel};
use super::settings::Settings;
use crate::geometry::ray::Ray;
use crate::numeric::rng::mix;
use crate::numeric::work::Work;
use crate::scene::options::{Antialias, Resampling};
use crate::scene::sampler::{Draws, Source};
use crate::scene::{Rgb, Scene};
use glam::DVec2;
use rayon::prelude::*;

/// The lens point of a hash: its centre, so that the hash does not depend on lens noise.
const LENS_CENTER: [f64; 2] = [0.5, 0.5];

/// A Whitted renderer between passes.
pub struct Whitted<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    source: Source,
    medium_of_eye: Option<usize>,
    /// Pixels that are resampled; found by the first pass.
    resampled: Option<Vec<bool>>,
}

/// What a pixel shows before any resampling.
#[derive(Clone, Copy)]
struct First {
    radiance: Rgb,
    hash: u64,
    /// How much its samples deviate from each other, in the measure of [`contrast`]; 0 of a single one.
    deviation: f64,
}

impl<'a> Whitted<'a> {
    /// Prepares the first pass.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Self {
        let medium_of_eye = scene.medium_at(scene.camera.eye(), &mut Work::default());
        let pixels = scene.film.width as usize * scene.film.height as usize;
        let resampled = match settings.aa {
            Antialias::None => Some(vec![false; pixels]),
            Antialias::Uniform => Some(vec![true; pixels]),
            Antialias::PathHash | Antialias::Contrast | Antialias::Variance => None,
        };
        Self {
            scene,
            settings,
            source: Source::new(settings.sampler, settings.seed, settings.spp),
            medium_of_eye,
            resampled,
        }
    }

    /// Adds the samples of one pass: at the centre of each pixel, and where antialiasing asks for it at the places of its pattern.
    pub fn pass(&mut self, pass: u64, film: &mut Film) -> Work {
        let width = film.size().width as usize;
        let (firsts, mut work) = self.firsts(pass, width, film.pixels().len());
        if self.resampled.is_none() {
            let known: Vec<First> = firsts.iter().copied().flatten().collect();
            self.resampled = Some(self.marked(&known, width));
        }
        let this = &*self;
        let resampled = this.resampled().unwrap_or_default();
        let rows = film.pixels_mut().par_chunks_mut(width).enumerate();
        let works = rows.map(|(y, row)| {
            let mut work = Work::default();
            for (pixel, index) in row.iter_mut().zip(y * width..) {
                match (resampled[index], firsts[index]) {
                    (false, Some(first)) => pixel.add(first.radiance),
                    (_, first) => this.resample(pass, index, first, pixel, &mut work),
                }
            }
            work
        });
        work += works.reduce(Work::default, join);
        work
    }

    /// The pixels that are resampled; `None` before the first pass has found them.
    pub fn resampled(&self) -> Option<&[bool]> {
        self.resampled.as_deref()
    }

    /// The fingerprint of the path behind a place of a pixel, through the centre of the lens. Chance has no part in it.
    pub fn fingerprint(&self, index: usize, offset: DVec2, work: &mut Work) -> Fingerprint {
        let ray = self.camera_ray(index, offset, LENS_CENTER);
        self.tree(ray, None, self.settings.hash.sees_shading(), work)
            .1
    }

    /// One sample of a pixel at a place of it, for pictures finer than a pattern. A pure function of its arguments and the seed.
    pub fn sample(&self, pass: u64, index: usize, place: Place, work: &mut Work) -> Rgb {
        self.look(pass, index, place, false, work).radiance
    }

    /// The first look at every pixel; at none that is known to be resampled.
    fn firsts(&self, pass: u64, width: usize, pixels: usize) -> (Vec<Option<First>>, Work) {
        let known = self.resampled.as_deref();
        let rows = (0..pixels).into_par_iter().step_by(width).map(|start| {
            let mut work = Work::default();
            let first = |index: usize| {
                let wanted = known.is_none_or(|resampled| !resampled[index]);
                wanted.then(|| self.first(pass, index, &mut work))
            };
            let row: Vec<_> = (start..start + width).map(first).collect();
            (row, work)
        });
        let rows: Vec<(Vec<Option<First>>, Work)> = rows.collect();
        let work = rows.iter().map(|row| row.1).fold(Work::default(), join);
        (rows.into_iter().flat_map(|row| row.0).collect(), work)
    }

    fn first(&self, pass: u64, index: usize, work: &mut Work) -> First {
        if self.settings.aa != Antialias::Variance {
            let hashed = self.settings.aa == Antialias::PathHash && self.resampled.is_none();
            return self.look(pass, index, CENTER, hashed, work);
        }
        let looks: Vec<First> = grid(2)
            .into_iter()
            .map(|place| self.look(pass, index, place, false, work))
            .collect();
        let count = looks.len() as f64;
        let mean = looks.iter().map(|look| look.radiance).sum::<Rgb>() / count;
        let squares = looks.iter().map(|look| {
            let off = contrast(look.radiance, mean);
            off * off
        });
        First {
            radiance: mean,
            deviation: (squares.sum::<f64>() / (count - 1.0)).sqrt(),
            ..looks[0]
        }
    }

    /// The pixels of rows of `width` that want resampling, by what their first look shows.
    fn marked(&self, firsts: &[First], width: usize) -> Vec<bool> {
        let threshold = self.settings.threshold;
        match self.settings.aa {
            Antialias::Contrast => mask(firsts.len(), width, |a, b| {
                contrast(firsts[a].radiance, firsts[b].radiance) > threshold
            }),
            Antialias::Variance => firsts
                .iter()
                .map(|first| first.deviation > threshold)
                .collect(),
            _ => mask(firsts.len(), width, |a, b| {
                self.is_edge(&firsts[a], &firsts[b])
            }),
        }
    }

    /// Adds the samples of the pattern to a pixel.
    fn resample(
        &self,
        pass: u64,
        index: usize,
        first: Option<First>,
        pixel: &mut Pixel,
        work: &mut Work,
    ) {
        // The centre is known where the first look was there.
        let center = first.filter(|_| self.settings.aa != Antialias::Variance);
        let hashed = self.hashes_again();
        let mut look = |place: Place| match center {
            Some(center) if place == CENTER => center,
            _ => self.look(pass, index, place, hashed, work),
        };
        let Some(side) = self.side() else {
            return self.resample_twice(&mut look, pixel);
        };
        let (middle, others): (Vec<_>, Vec<_>) =
            grid(side).into_iter().partition(|place| *place == CENTER);
        for place in middle.into_iter().chain(others) {
            pixel.add(look(place).radiance);
        }
    }

    /// Adds four samples, and the other twelve of the 4×4 grid where these and the centre do not all agree.
    fn resample_twice(&self, look: &mut impl FnMut(Place) -> First, pixel: &mut Pixel) {
        let places = grid(4);
        let (firsts, differ) = self.look_at_four(look);
        for first in firsts {
            pixel.add(first.radiance);
        }
        if differ {
            for (index, &place) in places.iter().enumerate() {
                if !ROOKS.contains(&index) {
                    pixel.add(look(place).radiance);
                }
            }
        }
    }

    /// The first four looks of adaptive resampling, and whether any of them differs from the centre.
    fn look_at_four(&self, look: &mut impl FnMut(Place) -> First) -> ([First; 4], bool) {
        let places = grid(4);
        let firsts = ROOKS.map(|place| look(places[place]));
        let center = look(CENTER);
        let differs = |first: &First| {
            if self.by_colour() {
                contrast(first.radiance, center.radiance) > self.settings.threshold
            } else {
                self.is_edge(first, &center)
            }
        };
        (firsts, firsts.iter().any(differs))
    }

    /// The places of the samples that a pass adds to a pixel, once the first pass is made.
    fn places(&self, pass: u64, index: usize, work: &mut Work) -> Vec<Place> {
        let resampled = self.resampled().is_some_and(|resampled| resampled[index]);
        match self.side() {
            _ if !resampled && self.settings.aa == Antialias::Variance => grid(2),
            _ if !resampled => vec![CENTER],
            Some(side) => grid(side),
            None => {
                let hashed = self.hashes_again();
                let mut look = |place| self.look(pass, index, place, hashed, work);
                let (_, differ) = self.look_at_four(&mut look);
                let places = grid(4);
                match differ {
                    true => places,
                    false => ROOKS.map(|place| places[place]).to_vec(),
                }
            }
        }
    }

    /// Whether two samples have unlike paths and colours so far apart that the threshold lets them count.
    fn is_edge(&self, a: &First, b: &First) -> bool {
        a.hash != b.hash && contrast(a.radiance, b.radiance) >= self.settings.threshold
    }

    /// Tells the features of the pass just made.
    pub(super) fn tell(&self, pass: u64, features: &mut Features) -> Work {
        features.look(self.scene, |pixel, rays, work| {
            let places = self.places(pass, pixel, work).into_iter();
            rays.extend(places.map(|place| self.first_ray(pass, pixel, place).0));
        })
    }

    /// Cells along a side of the grid by which pixels are resampled; `None` if that depends on the pixel.
    fn side(&self) -> Option<usize> {
        match self.settings.pattern {
            Resampling::Two => Some(2),
            Resampling::Three => Some(3),
            Resampling::Four => Some(4),
            Resampling::Adaptive => None,
        }
    }

    /// Whether the hashes of a resampled pixel's samples are compared too.
    fn hashes_again(&self) -> bool {
        self.settings.pattern == Resampling::Adaptive && !self.by_colour()
    }

    /// Whether colours are compared, and no hashes.
    fn by_colour(&self) -> bool {
        matches!(self.settings.aa, Antialias::Contrast | Antialias::Variance)
    }

    /// One sample of a pixel. Its hash is right only if `hashed` asks for it, as it may take rays of its own.
    fn look(&self, pass: u64, index: usize, place: Place, hashed: bool, work: &mut Work) -> First {
        let (ray, mut draws) = self.first_ray(pass, index, place);
        let through_lens = hashed && self.scene.camera.lens_radius() > 0.0;
        let shading = hashed && !through_lens && self.settings.hash.sees_shading();
        let (radiance, of_sample) = self.tree(ray, Some(&mut draws), shading, work);
        let fingerprint = if through_lens {
            self.fingerprint(index, place.offset, work)
        } else {
            of_sample
        };
        First {
            radiance,
            hash: fingerprint.value(self.settings.hash),
            deviation: 0.0,
        }
    }

    /// The camera ray of a sample, and the random numbers that its paths go on with.
    fn first_ray(&self, pass: u64, index: usize, place: Place) -> (Ray, Draws) {
        let mut draws = self
            .source
            .draws(pass, |sample| self.key(sample, index, place));
        let ray = self.camera_ray(index, place.offset, draws.uniform2());
        (ray, draws)
    }

    /// The ray through the centres of a pixel and of the lens.
    pub(super) fn center_ray(&self, index: usize) -> Ray {
        self.camera_ray(index, CENTER.offset, LENS_CENTER)
    }

    /// Index of the random numbers of a sample: those of the 3×3 grid in one range, the others mixed over all.
    fn key(&self, pass: u64, index: usize, place: Place) -> u64 {
        let size = self.scene.film;
        let pixels = u64::from(size.width) * u64::from(size.height);
        let sample = pass * pixels + index as u64;
        if place.number < 9 {
            sample * 9 + place.number
        } else {
            mix(&[sample, place.number])
        }
    }

    fn camera_ray(&self, index: usize, offset: DVec2, lens: [f64; 2]) -> Ray {
        let size = self.scene.film;
        let width = size.width as usize;
        let corner = DVec2::new((index % width) as f64, (index / width) as f64);
        let extent = DVec2::new(f64::from(size.width), f64::from(size.height));
        self.scene.camera.ray(corner + offset, extent, lens)
    }
}

fn join(mut a: Work, b: Work) -> Work {
    a += b;
    a
}
