//! Lights: point lights, collimated beams, and emissive quads, discs and spheres.
//!
//! A light can be asked two things: light a point (next-event estimation), and emit a photon. Both describe the same light; a
//! test compares them.

use super::aim::{Aim, Law};
use super::material::{Emission, Side};
use super::sampling::{uniform_cone, uniform_disc, uniform_sphere};
use super::{Object, Rgb};
use crate::geometry::hit::OFFSET_IN_ERRORS;
use crate::geometry::planar::{Disc, Quad, tangents};
use crate::geometry::ray::Ray;
use crate::geometry::shape::Shape;
use crate::geometry::sphere::Sphere;
use crate::numeric::rng::Numbers;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A source of light.
#[derive(Clone, Debug)]
pub enum Light {
    /// Isotropic point of this intensity (W/sr).
    Point {
        /// Position.
        position: DVec3,
        /// Intensity.
        intensity: Rgb,
    },
    /// Parallel light through a disc.
    Beam {
        /// Centre of the disc.
        center: DVec3,
        /// Unit direction of the light.
        direction: DVec3,
        /// Radius of the disc.
        radius: f64,
        /// Irradiance on a plane across the beam.
        irradiance: Rgb,
    },
    /// An emissive object.
    Area {
        /// Index of the object.
        object: usize,
        /// Its surface.
        surface: Emitter,
        /// What it emits.
        emission: Emission,
    },
}

/// The surfaces that can emit.
#[derive(Clone, Copy, Debug)]
pub enum Emitter {
    /// Parallelogram.
    Quad(Quad),
    /// Disc.
    Disc(Disc),
    /// Sphere.
    Sphere(Sphere),
}

/// Light that may arrive at a point from one direction, before visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit direction towards the light.
    pub direction: DVec3,
    /// Distance to the light.
    pub distance: f64,
    /// The light arrives if the way is free up to this distance: just before the surface of an area light.
    pub reach: f64,
    /// Radiance over density per solid angle (for point lights and beams: the irradiance across the direction). Irradiance at a
    /// surface is its mean times the cosine there.
    pub weight: Rgb,
    /// Density per solid angle with which an area light was sampled; infinite for point lights and beams.
    pub density: f64,
    /// The emissive object, if any.
    pub object: Option<usize>,
}

/// A photon at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittedPhoton {
    /// Where it starts and goes; the direction is a unit vector.
    pub ray: Ray,
    /// Flux (W) of this photon if it stood for all the light alone: divide by the number of photons emitted.
    pub flux: Rgb,
    /// Share of the flux that it would carry if none were aimed: see [`aim`](super::aim).
    pub worth: f64,
    /// Index of the light it came from.
    pub light: usize,
}

/// A sampled direction from a point to an emitting surface.
struct Towards {
    /// Unit direction.
    direction: DVec3,
    /// Distance to the surface.
    distance: f64,
    /// Cosine at the surface between its normal and the way back.
    cos: f64,
    /// Density per solid angle.
    density: f64,
    /// Bound of the distance between the sampled point and the surface.
    error: f64,
}

/// All lights of a scene, with a distribution over them in proportion to their power: to their share of the power of each colour channel,
/// in the mean over the channels, so that no channel rests on a light that is hardly ever drawn.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    lights: Vec<Light>,
    /// Running sums of the probabilities, in multiples of [`GRAIN`]; the last is 1 if there is any power.
    cumulative: Vec<f64>,
    /// Flux of an unaimed photon of each: power over probability.
    fluxes: Vec<Rgb>,
    aim: Aim,
}

/// Uniform numbers are multiples of this: a light comes exactly as often as its probability says if that is one, too.
const GRAIN: f64 = 1.0 / (1_u64 << 53) as f64;

impl Lights {
    /// The lights, with their probabilities.
    pub fn new(lights: Vec<Light>) -> Self {
        let powers: Vec<Rgb> = lights.iter().map(Light::power).collect();
        let mut all = Self {
            cumulative: running_shares(&powers),
            lights,
            fluxes: Vec::new(),
            aim: Aim::default(),
        };
        let flux = |(number, power): (usize, &Rgb)| *power / all.probability(number);
        all.fluxes = powers.iter().enumerate().map(flux).collect();
        all
    }

    /// The same light, with some photons aimed. Lights know no aim of themselves.
    #[must_use]
    pub fn aimed(self, aim: Aim) -> Self {
        Self { aim, ..self }
    }

    /// The lights.
    pub fn all(&self) -> &[Light] {
        &self.lights
    }

    /// Whether no light has any power.
    pub fn dark(&self) -> bool {
        self.cumulative.last().is_none_or(|&last| last == 0.0)
    }

    /// Total power (W) per channel.
    pub fn power(&self) -> Rgb {
        self.lights.iter().map(Light::power).sum()
    }

    /// Probability with which [`Self::choose`] takes a light.
    pub fn probability(&self, light: usize) -> f64 {
        self.cumulative[light]
            - if light == 0 {
                0.0
            } else {
                self.cumulative[light - 1]
            }
    }

    /// A light, with its probability. `None` if all is dark.
    pub fn choose(&self, u: f64) -> Option<usize> {
        if self.dark() {
            return None;
        }
        Some(
            self.cumulative
                .partition_point(|&sum| sum <= u)
                .min(self.lights.len() - 1),
        )
    }

    /// Index of the light that is this object.
    pub fn of_object(&self, object: usize) -> Option<usize> {
        self.lights
            .iter()
            .position(|light| matches!(light, Light::Area { object: o, .. } if *o == object))
    }

    /// Emits one photon: light, place and direction drawn from `stream`. `None` if all is dark.
    pub fn emit(&self, stream: &mut impl Numbers) -> Option<EmittedPhoton> {
        let light = self.choose(stream.uniform())?;
        let place = stream.uniform2();
        let direction = stream.uniform2();
        let (ray, worth) = self.lights[light].emit(place, direction, &self.aim, stream);
        Some(EmittedPhoton {
            ray,
            flux: worth * self.fluxes[light],
            worth,
            light,
        })
    }
}

/// Running sums of the shares that lights of such powers have of the power of a channel, in the mean over the channels with power. A
/// light with power has at least a grain.
fn running_shares(powers: &[Rgb]) -> Vec<f64> {
    let total: Rgb = powers.iter().sum();
    let lit = total.cmpgt(Rgb::ZERO);
    let channels = f64::from(lit.bitmask().count_ones());
    let mut left = powers.iter().filter(|&&power| power != Rgb::ZERO).count();
    let (mut sum, mut so_far) = (Rgb::ZERO, 0.0_f64);
    let next = |&power: &Rgb| {
        sum += power;
        if power != Rgb::ZERO {
            left -= 1;
            let share = Rgb::select(lit, sum / total, Rgb::ZERO).element_sum() / channels;
            // Rounding must leave room for those that follow, and the last one takes what is left.
            let most = 1.0 - left as f64 * GRAIN;
            let share = if left == 0 {
                1.0
            } else {
                (share / GRAIN).ceil() * GRAIN
            };
            so_far = share.max(so_far + GRAIN).min(most);
        }
        so_far
    };
    powers.iter().map(next).collect()
}

impl Light {
    /// Power (W) per channel: 4π I, irradiance × area, or π L × area × sides.
    pub fn power(&self) -> Rgb {
        match self {
            Self::Point { intensity, .. } => 4.0 * PI * *intensity,
            Self::Beam {
                radius, irradiance, ..
            } => PI * radius * radius * *irradiance,
            Self::Area {
                surface, emission, ..
            } => PI * surface.area() * emission.sides() * emission.radiance,
        }
    }

    /// The light that may arrive at `point`, sampled with `u`. `None` where none can.
    pub fn illuminate(&self, point: DVec3, u: [f64; 2]) -> Option<Incident> {
        match self {
            Self::Point {
                position,
                intensity,
            } => {
                let to_light = *position - point;
                let distance = to_light.length();
                if distance == 0.0 {
                    return None;
                }
                Some(Incident {
                    direction: to_light / distance,
                    distance,
                    reach: distance,
                    weight: *intensity / (distance * distance),
                    density: f64::INFINITY,
                    object: None,
                })
            }
            Self::Beam {
                center,
                direction,
                radius,
                irradiance,
            } => {
                let from_disc = point - *center;
                let along = from_disc.dot(*direction);
                let across = from_disc - along * *direction;
                (along > 0.0 && across.length_squared() <= radius * radius).then_some(Incident {
                    direction: -*direction,
                    distance: along,
                    reach: along,
                    weight: *irradiance,
                    density: f64::INFINITY,
                    object: None,
                })
            }
            Self::Area {
                object,
                surface,
                emission,
            } => {
                let Towards {
                    direction,
                    distance,
                    cos,
                    density,
                    error,
                } = surface.sample_towards(point, u)?;
                let radiance = emission.towards(cos);
                // A ray from here to there meets the surface within the error of the surface and the roundings of its own
                // way: of where it starts, and of its direction over the distance.
                let error = error + 4.0 * f64::EPSILON * (point.abs().max_element() + distance);
                (radiance != Rgb::ZERO && density > 0.0 && density.is_finite()).then(|| Incident {
                    direction,
                    distance,
                    reach: distance - OFFSET_IN_ERRORS * error / cos.abs(),
                    weight: radiance / density,
                    density,
                    object: Some(*object),
                })
            }
        }
    }

    /// The start of a photon, and what share of the flux of an unaimed one it carries.
    fn emit(
        &self,
        place: [f64; 2],
        direction: [f64; 2],
        aim: &Aim,
        stream: &mut impl Numbers,
    ) -> (Ray, f64) {
        let (start, law) = match self {
            Self::Point { position, .. } => (*position, Law::Isotropic),
            Self::Beam {
                center,
                direction: along,
                radius,
                ..
            } => {
                let disc = *radius * uniform_disc(place);
                let (s, t) = tangents(*along);
                return (Ray::new(*center + disc.x * s + disc.y * t, *along), 1.0);
            }
            Self::Area {
                surface, emission, ..
            } => {
                let (point, normal, error) = surface.sample_area(place);
                let front = match emission.side {
                    Side::Front => true,
                    Side::Back => false,
                    Side::Both => stream.uniform() < 0.5,
                };
                let outward = if front { normal } else { -normal };
                let start = point + OFFSET_IN_ERRORS * error * outward;
                (start, Law::Cosine(outward))
            }
        };
        let (direction, worth) = aim.direct(start, law, direction, stream);
        (Ray::new(start, direction), worth)
    }
}

impl Emitter {
    /// The emitting form of a shape; `None` for shapes that cannot emit.
    pub fn of(object: &Object) -> Option<Self> {
        match &object.shape {
            Shape::Quad(quad) => Some(Self::Quad(*quad)),
            Shape::Disc(disc) => Some(Self::Disc(*disc)),
            Shape::Sphere(sphere) => Some(Self::Sphere(*sphere)),
            Shape::Revolution(_) | Shape::Plane(_) => None,
        }
    }

    /// Area of one side.
    pub fn area(&self) -> f64 {
        match self {
            Self::Quad(quad) => quad.area(),
            Self::Disc(disc) => PI * disc.radius * disc.radius,
            Self::Sphere(sphere) => 4.0 * PI * sphere.radius * sphere.radius,
        }
    }

    /// A point uniform by area, the normal there, and the bound of the point's distance from the surface.
    fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3, f64) {
        let (point, normal, size) = match self {
            Self::Quad(quad) => {
                let point = quad.corner + u[0] * quad.edge_u + u[1] * quad.edge_v;
                (
                    point,
                    quad.normal(),
                    quad.corner.abs() + quad.edge_u.abs() + quad.edge_v.abs(),
                )
            }
            Self::Disc(disc) => {
                let at = disc.radius * uniform_disc(u);
                let (s, t) = tangents(disc.normal);
                (
                    disc.center + at.x * s + at.y * t,
                    disc.normal,
                    disc.center.abs() + disc.radius,
                )
            }
            Self::Sphere(sphere) => {
                let normal = uniform_sphere(u);
                (
                    sphere.center + sphere.radius * normal,
                    normal,
                    sphere.center.abs() + sphere.radius,
                )
            }
        };
        (point, normal, 8.0 * f64::EPSILON * size.max_element())
    }

    /// A direction from `point` to the surface.
    fn sample_towards(&self, point: DVec3, u: [f64; 2]) -> Option<Towards> {
        if let Self::Sphere(sphere) = self
            && let Some(sample) = sample_cone_to_sphere(sphere, point, u)
        {
            return Some(sample);
        }
        let (at, normal, error) = self.sample_area(u);
        let to_light = at - point;
        let distance = to_light.length();
        if distance == 0.0 {
            return None;
        }
        let direction = to_light / distance;
        let cos = -normal.dot(direction);
        let density = distance * distance / (self.area() * cos.abs());
        Some(Towards {
            direction,
            distance,
            cos,
            density,
            error,
        })
    }

    /// Density per solid angle with which [`Light::illuminate`] samples the direction of a point `at` of the surface, seen from
    /// `point` at `distance` with cosine `cos` at the surface.
    pub fn density_towards(&self, point: DVec3, distance: f64, cos: f64) -> f64 {
        if let Self::Sphere(sphere) = self
            && let Some(one_minus_cos) = cone_of_sphere(sphere, point)
        {
            return 1.0 / (TAU * one_minus_cos);
        }
        distance * distance / (self.area() * cos.abs())
    }
}

/// 1 − cosine of the half angle under which a sphere is seen from outside; `None` from inside or the surface.
pub(super) fn cone_of_sphere(sphere: &Sphere, point: DVec3) -> Option<f64> {
    let distance_squared = (sphere.center - point).length_squared();
    let sin_squared = sphere.radius * sphere.radius / distance_squared;
    // Within a rounding of the surface the cone is a half space and the area form is as good.
    (sin_squared < 1.0 - 1e-9).then(|| sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
}

fn sample_cone_to_sphere(sphere: &Sphere, point: DVec3, u: [f64; 2]) -> Option<Towards> {
    let one_minus_cos = cone_of_sphere(sphere, point)?;
    let to_center = sphere.center - point;
    let direction = uniform_cone(to_center.normalize(), one_minus_cos, u);
    // A direction on the cone's rim may miss by rounding: take the closest approach then.
    let along = to_center.dot(direction);
    let closest = to_center - along * direction;
    let half_chord = (sphere.radius * sphere.radius - closest.length_squared())
        .max(0.0)
        .sqrt();
    let distance = along - half_chord;
    let normal = ((point + distance * direction) - sphere.center).normalize();
    let cos = -normal.dot(direction);
    let error = 8.0 * f64::EPSILON * (sphere.center.abs().max_element() + sphere.radius);
    Some(Towards {
        direction,
        distance,
        cos: cos.max(1e-12),
        density: 1.0 / (TAU * one_minus_cos),
        error,
    })
}
