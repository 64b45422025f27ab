//! Progressive photon mapping: photon passes over hit points.
//!
//! One accumulator serves every variant. A pass emits photons, gathers them at the hit points within each one's present radius,
//! and adds one sample to every pixel. `ppm` keeps the hit points of its first pass (Hachisuka, Ogaki and Jensen 2008); `sppm`
//! and `pppm` make new ones each pass (Hachisuka and Jensen 2009, Knaus and Zwicker 2011). How radii shrink is a rule of its
//! own ([`radius`]), and so is how they count by their distance ([`kernel`]). All light, the direct one too, arrives by photons;
//! only emission seen directly or through specular events is added.
//!
//! A radius depends on earlier passes only, so a pass has exactly the bias of the kernel at that radius.

pub mod arrivals;
mod batches;
mod bounce;
pub mod camera;
pub mod error;
mod evenly;
pub mod gather;
pub mod kernel;
mod parts;
pub mod radius;
pub mod trace;

use super::driver::RenderError;
use super::features::{Features, Gathering};
use super::film::Film;
use super::settings::Settings;
use crate::index::choice::Index;
use crate::index::{BallIndex, Balls, IndexError};
use crate::numeric::clock::ProcessClock;
use crate::numeric::work::Work;
use crate::scene::options::{Integrator, Kernel, Rule};
use crate::scene::{Rgb, Scene};
use arrivals::{Arrival, Arrivals};
use batches::Batches;
use camera::{HitPoint, Sampling, View};
use error::Errors;
use gather::{Gathered, Site};
use glam::DVec3;
use radius::{Schedule, Statistics};
use rayon::prelude::*;
use trace::{Energy, Photons};

/// Pixels of one task that adds them up.
const PIXEL_RUN: usize = 1 << 11;
/// Most camera samples of a pass; their hit points take about 200 bytes each.
const MAX_SAMPLES: u64 = 1 << 26;

/// Bytes of the wide tree for a hit point (centre and radius, these again in f32, number, place, box, and its share of the boxes
/// above), and of a join for a photon.
const TREE_BYTES: usize = 86;
const JOIN_BYTES: usize = 14;

/// What is made of what a hit point gathered, given the square to divide by and the number of photons.
type Reading = fn(&HitPoint, &Gathered, f64, f64) -> Rgb;

/// A progressive photon mapper between passes.
#[derive(Debug)]
pub struct PhotonMapper<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    /// Hit points of the present pass.
    view: View,
    /// Square of the present radius of each.
    radii_squared: Vec<f64>,
    /// Radius statistics under the local rule: of each hit point if these stay, else of each pixel.
    statistics: Vec<Statistics>,
    schedule: Schedule,
    index: Option<Index>,
    energy: Energy,
    /// Most photons that lay in memory together.
    most_photons: usize,
    /// Photons that each hit point gathered in the last pass, where features ask for them.
    photons_found: Vec<u64>,
    /// Where the settings ask for them.
    errors: Option<Errors>,
}

/// CPU seconds of the process, all threads, in each phase of the passes so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phases {
    /// Camera paths and hit points.
    pub camera: f64,
    /// Photon tracing.
    pub trace: f64,
    /// Building the index, and what else the threads do beside the camera paths and the first photons.
    pub build: f64,
    /// Gathering.
    pub gather: f64,
}

impl Phases {
    /// The phases with their names.
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("camera", self.camera),
            ("trace", self.trace),
            ("build", self.build),
            ("gather", self.gather),
        ]
    }
}

impl<'a> PhotonMapper<'a> {
    /// Prepares the first pass.
    ///
    /// # Errors
    /// A background that is not black (no photon can start there), α outside (0, 1], a radius that is not positive and finite,
    /// or more than 2²⁶ camera samples a pass.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Result<Self, RenderError> {
        let samples =
            u64::from(scene.film.width) * u64::from(scene.film.height) * u64::from(settings.spp);
        let fault = if scene.background != Rgb::ZERO {
            Some("photon mapping needs a black background: no photon can start from it".into())
        } else if !(settings.alpha > 0.0 && settings.alpha <= 1.0) {
            Some(format!("alpha must lie in (0, 1], not {}", settings.alpha))
        } else if settings
            .radius
            .is_some_and(|radius| !(radius > 0.0 && radius.is_finite()))
        {
            Some("the radius must be positive and finite".into())
        } else if settings.spp == 0 || samples > MAX_SAMPLES {
            Some(format!(
                "photon mapping takes 1 to {MAX_SAMPLES} camera samples a pass, not {samples}"
            ))
        } else {
            None
        };
        match fault {
            Some(fault) => Err(RenderError::Unsupported(fault)),
            None => Ok(Self {
                scene,
                settings,
                view: View::default(),
                radii_squared: Vec::new(),
                statistics: Vec::new(),
                schedule: Schedule::new(settings.rule, settings.alpha),
                index: None,
                energy: Energy::default(),
                most_photons: 0,
                photons_found: Vec::new(),
                errors: (settings.estimate_errors)
                    .then(|| Errors::new(scene.film.width as usize * scene.film.height as usize)),
            }),
        }
    }

    /// One pass: emits photons, gathers at the hit points, adds one sample to every pixel of `film`.
    ///
    /// Passes are numbered from 0 and made in order. Runs on the current rayon pool; the picture does not depend on its size.
    ///
    /// # Panics
    /// If `film` is not of the scene's size.
    pub fn pass(&mut self, pass: u64, film: &mut Film, phases: &mut Phases) -> Work {
        assert_eq!(film.size(), self.scene.film, "the film is the scene's");
        let mut work = Work::default();
        let clock = ProcessClock::start();
        let lit = !self.scene.lights.dark();
        let batches = Batches::new(self.scene, self.settings, pass);
        // Neither needs the other, so no thread waits for the last camera path, or for the steps of a build that one alone must do.
        let (camera, first) = rayon::join(
            || self.prepare(pass, lit, &mut work),
            || lit.then(|| batches.trace(0)).flatten(),
        );
        let trace = first.as_ref().map_or(0.0, |photons| photons.seconds);
        phases.camera += camera;
        phases.trace += trace;
        phases.build += (clock.seconds() - camera - trace).max(0.0);

        let gathered = match self.index.take() {
            Some(index) if lit => {
                let gathered = self.gather(&index, batches, first, phases, &mut work);
                self.index = Some(index);
                gathered
            }
            _ => vec![Gathered::default(); self.radii_squared.len()],
        };

        let clock = ProcessClock::start();
        self.add_to(film, &gathered);
        if (self.settings.aov.iter()).any(|aov| aov.needs_photons()) {
            self.photons_found = gathered.iter().map(|gathered| gathered.photons).collect();
        }
        self.shrink(&gathered);
        phases.gather += clock.seconds();
        work
    }

    /// What became of the light of all passes so far.
    pub fn energy(&self) -> &Energy {
        &self.energy
    }

    /// The estimated errors of the mean of all passes so far, if the settings ask for them.
    pub fn errors(&self) -> Option<&Errors> {
        self.errors.as_ref()
    }

    /// The hit points of the last pass.
    pub fn hit_points(&self) -> &[HitPoint] {
        &self.view.hit_points
    }

    /// Squares of the radii that these had in the last pass.
    pub fn radii_squared(&self) -> &[f64] {
        &self.radii_squared
    }

    /// Radius statistics after the last pass under the local rule: of each hit point for `ppm`, of each pixel otherwise.
    pub fn statistics(&self) -> &[Statistics] {
        &self.statistics
    }

    /// Bytes held at the fullest moment so far, while a batch of photons is gathered: hit points with their radii, sums and tree (the
    /// default one), emission and statistics of pixels, and the photons with what gathering them needs. Not counted: the film.
    pub fn peak_bytes(&self) -> usize {
        let hit_point = size_of::<HitPoint>() + size_of::<f64>() + TREE_BYTES;
        let photon = size_of::<DVec3>() + arrivals::BYTES + JOIN_BYTES;
        // Sums in the tree's order beside what is asked again and again, or beside the sums in the order of the hit points.
        let joining = size_of::<Gathered>() + size_of::<Site>();
        let joined = 2 * size_of::<Gathered>();
        let hit_points = self.view.hit_points.len();
        let gathering = hit_points * joining + self.most_photons * photon;
        hit_points * hit_point
            + self.view.emission.len() * size_of::<Rgb>()
            + self.statistics.len() * size_of::<Statistics>()
            + gathering.max(hit_points * joined)
    }

    fn fixed(&self) -> bool {
        self.settings.integrator == Integrator::Ppm
    }

    fn sampling(&self, pass: u64) -> Sampling {
        Sampling {
            spp: self.settings.spp,
            seed: self.settings.seed,
            pass: if self.fixed() { 0 } else { pass },
            radius: self.settings.radius,
            max_depth: self.settings.max_depth,
            split: self.fixed(),
        }
    }

    /// Tells the features of the pass just made.
    pub(super) fn tell(&self, pass: u64, features: &mut Features) -> Work {
        let found = self.photons_found.iter();
        let hit_points = self.view.hit_points.iter().zip(&self.radii_squared);
        features.gathered(
            hit_points
                .zip(found)
                .map(|((hit_point, radius_squared), &photons)| Gathering {
                    pixel: hit_point.pixel as usize,
                    radius: radius_squared.sqrt(),
                    photons,
                }),
        );
        if self.fixed() && pass > 0 {
            // The samples are those of the first pass.
            return Work::default();
        }
        let sampling = self.sampling(pass);
        features.look(self.scene, |pixel, rays, _| {
            let ray = |within| camera::first_ray(self.scene, &sampling, pixel, within).0;
            rays.extend((0..sampling.spp).map(ray));
        })
    }

    /// Makes hit points, radii and, where it is `lit`, the index of the pass. CPU seconds of the camera paths.
    fn prepare(&mut self, pass: u64, lit: bool, work: &mut Work) -> f64 {
        // Those of the first pass may stay.
        let renewed = !self.fixed() || self.view.emission.is_empty();
        if renewed {
            self.view = camera::view(self.scene, &self.sampling(pass));
            *work += self.view.work;
        }
        if self.statistics.is_empty() && self.settings.rule == Rule::Local {
            let regions = if self.fixed() {
                self.view.hit_points.len()
            } else {
                self.view.emission.len()
            };
            self.statistics = vec![Statistics::default(); regions];
        }
        self.radii_squared = self.squares_of(pass);
        if lit {
            self.index = Some(self.index(renewed));
        }
        if renewed { self.view.seconds } else { 0.0 }
    }

    /// Index of the statistics that a hit point belongs to.
    fn region(&self, hit_point: usize) -> usize {
        if self.fixed() {
            hit_point
        } else {
            self.view.hit_points[hit_point].pixel as usize
        }
    }

    fn squares_of(&mut self, pass: u64) -> Vec<f64> {
        let common = self.schedule.shrink(pass);
        self.view
            .hit_points
            .par_iter()
            .enumerate()
            .map(|(index, hit_point)| {
                let shrink = match self.settings.rule {
                    Rule::Local => self.statistics[self.region(index)].shrink,
                    _ => common,
                };
                (shrink * hit_point.first_radius_squared).max(hit_point.least_radius_squared)
            })
            .collect()
    }

    /// The index over the hit points: the old one with new radii where they stay.
    fn index(&mut self, renewed: bool) -> Index {
        let radii_squared = &self.radii_squared;
        let old = self.index.take().filter(|_| !renewed);
        let index = match old {
            Some(mut index) => index.set_radii_squared(radii_squared).map(|()| index),
            None => {
                let hit_points = self.view.hit_points.par_iter();
                let centers = hit_points.map(|hit| hit.point).collect();
                Balls::new(centers, radii_squared.clone())
                    .map(|balls| Index::new(self.settings.index, balls))
            }
        };
        index.unwrap_or_else(|fault: IndexError| panic!("hit points are finite: {fault}"))
    }

    fn gather(
        &mut self,
        index: &Index,
        batches: Batches,
        first: Option<Photons>,
        phases: &mut Phases,
        work: &mut Work,
    ) -> Vec<Gathered> {
        let Settings {
            max_depth,
            kernel,
            estimate_errors,
            ..
        } = *self.settings;
        let clock = ProcessClock::start();
        let hit_points = &self.view.hit_points;
        let none = Arrivals::of(self.scene);
        let sites: Vec<Site> = (hit_points.par_iter().zip(&self.radii_squared))
            .map(|(hit_point, &square)| Site::of(hit_point, square, &none, max_depth))
            .collect();
        let mut sums = index.answers();
        phases.gather += clock.seconds();
        let mut next = first;
        for batch in 0.. {
            let clock = ProcessClock::start();
            let Some(mut photons) = next.take().or_else(|| batches.trace(batch)) else {
                break;
            };
            phases.trace += clock.seconds();
            self.energy += photons.energy;
            *work += photons.work;
            self.most_photons = self.most_photons.max(photons.points.len());

            let clock = ProcessClock::start();
            // Neighbours side by side: what a hit point gathers then lies together.
            photons.sort_along_curve();
            let Photons {
                points, arrivals, ..
            } = photons;
            let gather = |item: usize, within: &[u32], sum: &mut Gathered| {
                let site = &sites[item];
                let share = |photon: u32| {
                    points[photon as usize].distance_squared(site.point) / site.radius_squared
                };
                let accepts =
                    |photon: &Arrival| gather::accepts(&hit_points[item], photon, max_depth);
                // The places of photons are read only where something depends on them.
                match (kernel, estimate_errors) {
                    (Kernel::Disc, false) => {
                        let look = |_| (1.0, None);
                        site.gather(within, &arrivals, sum, accepts, look);
                    }
                    (_, false) => {
                        let look = |photon| (kernel.weight(share(photon)), None);
                        site.gather(within, &arrivals, sum, accepts, look);
                    }
                    (_, true) => {
                        let look = |photon| {
                            let share = share(photon);
                            (kernel.weight(share), Some(share))
                        };
                        site.gather(within, &arrivals, sum, accepts, look);
                    }
                }
            };
            index.join_onto(&mut sums, &points, &gather, work);
            phases.gather += clock.seconds();
        }
        let clock = ProcessClock::start();
        drop(sites);
        let sums = sums.in_order();
        work.photons_gathered += sums
            .par_iter()
            .map(|sum: &Gathered| sum.photons)
            .sum::<u64>();
        phases.gather += clock.seconds();
        sums
    }

    /// Adds the pass's sample to every pixel: emission, and the hit points in their order.
    fn add_to(&mut self, film: &mut Film, gathered: &[Gathered]) {
        let emitted = self.settings.photons as f64;
        let rule = self.settings.rule;
        let gathered = self.view.hit_points.par_iter().zip(gathered);
        let gathered = gathered.zip(&self.radii_squared);
        let each = |of: Reading, share: f64| {
            let per_hit_point = gathered
                .clone()
                .map(|((hit_point, gathered), &radius_squared)| {
                    let square = rule.divisor(hit_point.first_radius_squared, radius_squared);
                    share * of(hit_point, gathered, square, emitted)
                });
            per_hit_point.collect::<Vec<Rgb>>()
        };
        // Hit points stand pixel by pixel, so runs of pixels can be added up apart.
        let hit_points = &self.view.hit_points;
        let add_up = |mut pixels: Vec<Rgb>, values: Vec<Rgb>| {
            let runs = pixels.par_chunks_mut(PIXEL_RUN).enumerate();
            runs.for_each(|(run, pixels)| {
                let before = |pixel: usize| {
                    hit_points.partition_point(|hit_point| (hit_point.pixel as usize) < pixel)
                };
                let first = run * PIXEL_RUN;
                let places = before(first)..before(first + pixels.len());
                for (hit_point, value) in hit_points[places.clone()].iter().zip(&values[places]) {
                    pixels[hit_point.pixel as usize - first] += *value;
                }
            });
            pixels
        };
        let samples = add_up(self.view.emission.clone(), each(gather::radiance, 1.0));
        if let Some(errors) = &mut self.errors {
            // What is gathered estimates the bias of the disc, (r²/8) ∇²E; the kernel's is (r²/4) ∫sw ∇²E.
            let share = 2.0 * self.settings.kernel.moment(1);
            let biases = add_up(vec![Rgb::ZERO; samples.len()], each(gather::bias, share));
            errors.add(&samples, &biases);
        }
        let pixels = film.pixels_mut().par_iter_mut();
        pixels
            .zip(samples)
            .for_each(|(pixel, sample)| pixel.add(sample));
    }

    /// Updates the statistics of the local rule.
    fn shrink(&mut self, gathered: &[Gathered]) {
        if self.settings.rule != Rule::Local {
            return;
        }
        let mut found = vec![0.0; self.statistics.len()];
        for (index, gathered) in gathered.iter().enumerate() {
            found[self.region(index)] += gathered.photons as f64;
        }
        let alpha = self.settings.alpha;
        let statistics = self.statistics.par_iter_mut().zip(found);
        statistics.for_each(|(statistics, photons)| *statistics = statistics.after(photons, alpha));
    }
}
