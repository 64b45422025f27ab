//! The path tracer: the reference that the other renderers are checked against.
//!
//! Kajiya, "The rendering equation" (1986), with next-event estimation, multiple importance sampling of light and material
//! (balance heuristic, Veach and Guibas 1995) and Russian roulette that keeps the mean. Paths have no length limit unless
//! the settings give one.

use super::features::Features;
use super::film::Film;
use super::scatter::{Interface, Lobes, reflect};
use super::settings::Settings;
use crate::geometry::hit::{Hit, Side};
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use crate::scene::light::{Emitter, Light};
use crate::scene::sampler::{Draws, Source};
use crate::scene::sampling::{cosine_density, cosine_hemisphere};
use crate::scene::{FilmSize, Rgb, Scene};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Scattering events before roulette begins: short paths carry most of the light.
const EVENTS_BEFORE_ROULETTE: u32 = 4;

/// Paths end with at least this probability per event once roulette plays, so that a room without absorption ends too.
const LEAST_DEATH: f64 = 0.01;

/// A path tracer between passes; a pass is one sample of every pixel.
pub struct PathTracer<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    source: Source,
    medium_of_eye: Option<usize>,
    offset: Option<f64>,
}

impl<'a> PathTracer<'a> {
    /// Prepares the first pass.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Self {
        let medium_of_eye = scene.medium_at(scene.camera.eye(), &mut Work::default());
        Self {
            scene,
            settings,
            source: Source::new(settings.sampler, settings.seed, settings.spp),
            medium_of_eye,
            offset: None,
        }
    }

    /// Starts every next ray `offset` (world units) off its surface instead of at a proven side of it: an object of study.
    #[must_use]
    pub fn leaving_at(self, offset: f64) -> Self {
        Self {
            offset: Some(offset),
            ..self
        }
    }

    /// Adds one sample to every pixel.
    pub fn pass(&self, pass: u64, film: &mut Film) -> Work {
        let size = film.size();
        let width = size.width as usize;
        let rows = film
            .pixels_mut()
            .par_chunks_mut(width)
            .enumerate()
            .map(|(y, row)| {
                let mut work = Work::default();
                for (x, pixel) in row.iter_mut().enumerate() {
                    let place = [x as u32, y as u32];
                    pixel.add(self.sample(size, place, pass, &mut work, &mut |_| {}));
                }
                work
            });
        rows.reduce(Work::default, |mut a, b| {
            a += b;
            a
        })
    }

    /// The sample of the pixel [x, y] in a pass, a pure function of these and the seed; `witness` hears every step of its path.
    pub fn sample(
        &self,
        size: FilmSize,
        [x, y]: [u32; 2],
        pass: u64,
        work: &mut Work,
        witness: &mut impl FnMut(&Step),
    ) -> Rgb {
        let (ray, mut draws) = self.first_ray(size, [x, y], pass);
        self.radiance(ray, &mut draws, work, witness)
    }

    /// The camera ray of that sample, and the random numbers that its path goes on with.
    fn first_ray(&self, size: FilmSize, [x, y]: [u32; 2], pass: u64) -> (Ray, Draws) {
        let [width, height] = [size.width, size.height].map(u64::from);
        let pixel = u64::from(y) * width + u64::from(x);
        let mut draws = self
            .source
            .draws(pass, |sample| sample * width * height + pixel);
        let place = DVec2::new(f64::from(x), f64::from(y)) + DVec2::from_array(draws.uniform2());
        let extent = DVec2::new(f64::from(size.width), f64::from(size.height));
        let ray = self.scene.camera.ray(place, extent, draws.uniform2());
        (ray, draws)
    }

    /// Tells the features of a pass.
    pub(super) fn tell(&self, pass: u64, features: &mut Features) -> Work {
        let size = self.scene.film;
        features.look(self.scene, |pixel, rays, _| {
            let pixel = pixel as u32;
            let place = [pixel % size.width, pixel / size.width];
            rays.push(self.first_ray(size, place, pass).0);
        })
    }

    /// One sample of the radiance that arrives at the ray's origin against its unit direction.
    fn radiance(
        &self,
        ray: Ray,
        draws: &mut Draws,
        work: &mut Work,
        witness: &mut impl FnMut(&Step),
    ) -> Rgb {
        work.camera_rays += 1;
        let mut walk = Walk {
            scene: self.scene,
            offset: self.offset,
            ray,
            medium: self.medium_of_eye,
            throughput: Rgb::ONE,
            index_squared: 1.0,
            scattered: None,
            radiance: Rgb::ZERO,
        };
        let mut events = 0;
        loop {
            let ray = walk.ray;
            let hit = walk.arrive(work);
            let event = match &hit {
                Some(hit) if self.settings.max_depth.is_none_or(|limit| events < limit) => {
                    walk.scatter(hit, draws, work)
                }
                _ => Event::End,
            };
            witness(&Step {
                ray,
                hit,
                event,
                radiance: walk.radiance,
            });
            if event == Event::End {
                break;
            }
            events += 1;
            if events >= EVENTS_BEFORE_ROULETTE && !walk.survives(draws) {
                break;
            }
            work.scattered_rays += 1;
        }
        walk.radiance
    }
}

/// How a camera path goes on from a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Not at all: it left the scene, was absorbed, or has reached its greatest depth.
    End,
    /// By diffuse reflection.
    Diffuse,
    /// By reflection at a mirror.
    Mirror,
    /// By reflection at a dielectric interface.
    Reflected,
    /// By refraction.
    Refracted,
}

/// A straight part of a camera path and the event at its end, as a witness hears of it.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The ray that was followed.
    pub ray: Ray,
    /// Where it ended; `None` outside the scene.
    pub hit: Option<Hit>,
    /// What happened there. Roulette may still end the path behind it.
    pub event: Event,
    /// What the path has gathered so far.
    pub radiance: Rgb,
}

/// The last diffuse scattering: what the chance of meeting a light by it depends on.
#[derive(Clone, Copy)]
struct Scattered {
    /// Where the ray started.
    from: DVec3,
    /// Density per solid angle of its direction.
    density: f64,
}

/// A camera path in the making.
struct Walk<'a> {
    scene: &'a Scene,
    offset: Option<f64>,
    ray: Ray,
    medium: Option<usize>,
    throughput: Rgb,
    /// Product of the radiance scales passed, divided out where roulette weighs the path.
    index_squared: f64,
    /// `None` after the camera or a specular event, when lights are met by the path alone.
    scattered: Option<Scattered>,
    radiance: Rgb,
}

impl Walk<'_> {
    /// The next ray from a hit.
    fn leave(&self, hit: &Hit, side: Side, direction: DVec3, work: &mut Work) -> Ray {
        match self.offset {
            None => self.scene.leave(hit, side, direction, work),
            Some(offset) => leave_at(hit, side, direction, offset),
        }
    }

    /// Follows the ray to its hit and adds the light met there. `None` where the path has left the scene.
    fn arrive(&mut self, work: &mut Work) -> Option<Hit> {
        let Some(hit) = self.scene.intersect(&self.ray, work) else {
            self.radiance += self.throughput * self.scene.background;
            return None;
        };
        self.throughput *= self.scene.transmittance(self.medium, hit.t);
        if let Some(emission) = &self.scene.material(&hit).emission {
            let cos = -hit.normal.dot(self.ray.direction);
            let weight = self.scattered.map_or(1.0, |scattered| {
                self.weight_of_meeting(&hit, cos, scattered)
            });
            self.radiance += weight * self.throughput * emission.towards(cos);
        }
        Some(hit)
    }

    /// Balance heuristic for a light met by diffuse scattering, which next-event estimation could have chosen too.
    fn weight_of_meeting(&self, hit: &Hit, cos: f64, scattered: Scattered) -> f64 {
        let lights = &self.scene.lights;
        let Some((light, emitter)) = lights
            .of_object(hit.object)
            .zip(Emitter::of(&self.scene.objects[hit.object]))
        else {
            return 1.0;
        };
        let of_light =
            lights.probability(light) * emitter.density_towards(scattered.from, hit.t, cos);
        scattered.density / (scattered.density + of_light)
    }

    /// Adds light received directly and chooses the next direction.
    fn scatter(&mut self, hit: &Hit, draws: &mut Draws, work: &mut Work) -> Event {
        let direction = self.ray.direction;
        let lobes = Lobes::at(self.scene, hit, direction);
        if let Some(interface) = lobes.interface {
            return self.cross(hit, lobes.side, &interface, draws, work);
        }
        let diffuse = lobes.diffuse.max_element();
        let mirror = lobes.mirror.max_element();
        if diffuse + mirror <= 0.0 {
            return Event::End;
        }
        let share = diffuse / (diffuse + mirror);
        if diffuse > 0.0 {
            self.radiance += self.throughput * self.direct(hit, &lobes, share, draws, work);
        }
        let normal = hit.normal_on(lobes.side);
        if share == 1.0 || draws.uniform() < share {
            let next = cosine_hemisphere(normal, draws.uniform2());
            let density = share * cosine_density(next.dot(normal));
            self.throughput *= lobes.diffuse / share;
            self.ray = self.leave(hit, lobes.side, next, work);
            self.scattered = Some(Scattered {
                from: self.ray.origin,
                density,
            });
            Event::Diffuse
        } else {
            self.throughput *= lobes.mirror / (1.0 - share);
            let next = reflect(direction, normal);
            self.ray = self.leave(hit, lobes.side, next, work);
            self.scattered = None;
            Event::Mirror
        }
    }

    /// Reflects or refracts at random in proportion to the reflectance.
    fn cross(
        &mut self,
        hit: &Hit,
        side: Side,
        interface: &Interface,
        draws: &mut Draws,
        work: &mut Work,
    ) -> Event {
        let reflected = draws.uniform() < interface.reflectance;
        let (next, side, event) = match interface.refracted {
            Some(refracted) if !reflected => {
                self.throughput *= interface.radiance_scale;
                self.index_squared *= interface.radiance_scale;
                self.medium = interface.beyond;
                (refracted, side.other(), Event::Refracted)
            }
            _ => {
                let next = reflect(self.ray.direction, hit.normal);
                (next, side, Event::Reflected)
            }
        };
        self.ray = self.leave(hit, side, next, work);
        self.scattered = None;
        event
    }

    /// Radiance scattered from one light, chosen by power, with the weight of the balance heuristic. `share` is the
    /// probability that the path goes on diffusely.
    fn direct(
        &self,
        hit: &Hit,
        lobes: &Lobes,
        share: f64,
        draws: &mut Draws,
        work: &mut Work,
    ) -> Rgb {
        // Draw before any test, so that later numbers of the path do not depend on its outcome.
        let (choice, place) = (draws.uniform(), draws.uniform2());
        let normal = hit.normal_on(lobes.side);
        let from = self.leave(hit, lobes.side, normal, work).origin;
        let lights = &self.scene.lights;
        let Some(light) = lights.choose(choice) else {
            return Rgb::ZERO;
        };
        let Some((irradiance, incident)) =
            unoccluded(self.scene, &lights.all()[light], from, normal, place, work)
        else {
            return Rgb::ZERO;
        };
        let probability = lights.probability(light);
        let of_path = share * cosine_density(incident.direction.dot(normal));
        let weight = if incident.density.is_finite() {
            let of_light = probability * incident.density;
            of_light / (of_light + of_path)
        } else {
            1.0
        };
        weight / probability * lobes.diffuse / PI * irradiance
    }

    /// Russian roulette on the path's weight; survivors carry more, so the mean is kept.
    fn survives(&mut self, draws: &mut Draws) -> bool {
        let weight = self.throughput.max_element() / self.index_squared;
        let survival = weight.min(1.0 - LEAST_DEATH);
        if draws.uniform() >= survival {
            return false;
        }
        self.throughput /= survival;
        true
    }
}

/// The ray that leaves a hit on a side of it, started `offset` (world units) off the surface.
pub(crate) fn leave_at(hit: &Hit, side: Side, direction: DVec3, offset: f64) -> Ray {
    Ray::new(hit.point + side.sign() * offset * hit.normal, direction)
}

/// One sample of the irradiance from a light at a point `from` (just off its surface, on the side of the unit `normal`), if the
/// light faces it and nothing stands between.
pub(crate) fn unoccluded(
    scene: &Scene,
    light: &Light,
    from: DVec3,
    normal: DVec3,
    place: [f64; 2],
    work: &mut Work,
) -> Option<(Rgb, crate::scene::light::Incident)> {
    let incident = light.illuminate(from, place)?;
    let cos = incident.direction.dot(normal);
    if cos <= 0.0 {
        return None;
    }
    work.shadow_rays += 1;
    let shadow = Ray::new(from, incident.direction).until(incident.reach);
    let free = incident.reach <= 0.0 || !scene.occluded(&shadow, work);
    free.then_some((cos * incident.weight, incident))
}
