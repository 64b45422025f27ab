//! The tree of reflections and refractions behind a camera ray: its radiance, and what it met.

use super::Whitted;
use crate::geometry::hit::Hit;
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use crate::render::antialias::fingerprint::{Event, Fingerprint, Met, Vertex};
use crate::render::path::unoccluded;
use crate::render::scatter::{Lobes, reflect};
use crate::scene::light::Light;
use crate::scene::sampler::Draws;
use crate::scene::{Rgb, Scene};
use glam::DVec3;
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

/// The point of a light whose visibility enters a hash.
const LIGHT_CENTER: [f64; 2] = [0.5, 0.5];

impl Whitted<'_> {
    /// Walks the tree of reflections and refractions. Without draws only the hash is made: no light, no roulette. `shading` adds
    /// lights and patterns to it, which may take shadow rays.
    pub(super) fn tree(
        &self,
        ray: Ray,
        mut draws: Option<&mut Draws>,
        shading: bool,
        work: &mut Work,
    ) -> (Rgb, Fingerprint) {
        work.camera_rays += 1;
        let mut fingerprint = Fingerprint::default();
        let mut radiance = Rgb::ZERO;
        let mut pending = vec![Branch {
            ray,
            weight: Rgb::ONE,
            scale: 1.0,
            depth: 0,
            medium: self.medium_of_eye,
            event: Event::Camera,
            left: None,
            sure: true,
        }];
        while let Some(branch) = pending.pop() {
            let hit = self.scene.intersect(&branch.ray, work);
            if branch.sure {
                fingerprint.vertex(&self.vertex(&branch, hit.as_ref()));
            }
            let Some(hit) = hit else {
                radiance += branch.weight * self.scene.background;
                continue;
            };
            let weight = branch.weight * self.scene.transmittance(branch.medium, hit.t);
            let branch = Branch { weight, ..branch };
            let lobes = Lobes::at(self.scene, &hit, branch.ray.direction);
            let print = (branch.sure && shading).then_some(&mut fingerprint);
            match draws.as_deref_mut() {
                Some(draws) => {
                    radiance += weight * self.local(&branch, &hit, &lobes, draws, print, work);
                }
                None => self.look_at_shading(&hit, &lobes, print, work),
            }
            if self
                .settings
                .max_depth
                .is_none_or(|limit| branch.depth < limit)
            {
                let scattered = branch.scattered(self.scene, &hit, &lobes, work);
                for next in scattered.into_iter().flatten() {
                    pending.extend(next.admitted(draws.as_deref_mut()));
                    work.scattered_rays += 1;
                }
            }
        }
        (radiance, fingerprint)
    }

    fn vertex(&self, branch: &Branch, hit: Option<&Hit>) -> Vertex {
        let emits = |hit: &Hit| self.scene.material(hit).emission.is_some();
        Vertex {
            event: branch.event,
            depth: branch.depth,
            met: hit.map(|hit| met(hit, &branch.ray)),
            left: branch.left,
            emits: hit.is_some_and(emits),
        }
    }

    /// Adds the visible lights and the cell of the pattern to a fingerprint, where no light is asked for.
    fn look_at_shading(
        &self,
        hit: &Hit,
        lobes: &Lobes,
        fingerprint: Option<&mut Fingerprint>,
        work: &mut Work,
    ) {
        if let Some(fingerprint) = fingerprint.filter(|_| lobes.diffuse != Rgb::ZERO) {
            let normal = hit.normal_on(lobes.side);
            let from = self.scene.leave(hit, lobes.side, normal, work).origin;
            for light in self.scene.lights.all() {
                fingerprint.light(self.sees(light, from, normal, work));
            }
            fingerprint.cell(self.cell(hit));
        }
    }

    /// Whether a light lights a point; of an area light, whether its middle does, which chance has no part in.
    fn sees(&self, light: &Light, from: DVec3, normal: DVec3, work: &mut Work) -> bool {
        unoccluded(self.scene, light, from, normal, LIGHT_CENTER, work).is_some()
    }

    /// The cell of the diffuse pattern at a hit.
    fn cell(&self, hit: &Hit) -> [i64; 2] {
        let diffuse = self.scene.material(hit).diffuse.as_ref();
        diffuse.map_or([0; 2], |pattern| pattern.cell(hit.st()))
    }

    /// Emission and directly received light at a hit; tells the fingerprint, if there is one, what the lights and the pattern do.
    fn local(
        &self,
        branch: &Branch,
        hit: &Hit,
        lobes: &Lobes,
        draws: &mut Draws,
        mut fingerprint: Option<&mut Fingerprint>,
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
            let mut irradiance = Rgb::ZERO;
            for light in self.scene.lights.all() {
                let received = self.irradiance(light, strata as u32, from, normal, draws, work);
                irradiance += received;
                if let Some(fingerprint) = fingerprint.as_deref_mut() {
                    // What comes from a point or a beam tells whether it is seen; an area light is asked again.
                    fingerprint.light(match light {
                        Light::Area { .. } => self.sees(light, from, normal, work),
                        _ => received != Rgb::ZERO,
                    });
                }
            }
            if let Some(fingerprint) = fingerprint {
                fingerprint.cell(self.cell(hit));
            }
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
        draws: &mut Draws,
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
                let [a, b] = draws.uniform2();
                let place = [(f64::from(column) + a) / side, (f64::from(row) + b) / side];
                let sample = unoccluded(self.scene, light, from, normal, place, work);
                sum += sample.map_or(Rgb::ZERO, |(irradiance, _)| irradiance);
            }
        }
        sum / (side * side)
    }
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
    /// The object at which that event happened.
    left: Option<usize>,
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
            left: Some(hit.object),
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

    /// The branch as it is if heavy enough; else what roulette leaves of it (nothing without draws).
    fn admitted(self, draws: Option<&mut Draws>) -> Option<Self> {
        let heaviness = self.heaviness();
        if heaviness >= SURE_WEIGHT && self.depth < SURE_DEPTH {
            return Some(self);
        }
        let survival = (heaviness / SURE_WEIGHT).min(MOST_SURVIVAL);
        (draws?.uniform() < survival).then(|| Self {
            weight: self.weight / survival,
            sure: false,
            ..self
        })
    }
}
