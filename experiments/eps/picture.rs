//! The cup of glass before a sky, traced with starts that stand off by a given length.

use crate::geometry::hit::{Hit, Side};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::{Revolution, Solver};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use crate::render::scatter::{reflect, refract};
use crate::scene::camera::{Camera, CameraDescription};
use glam::{DVec2, DVec3};

/// Index of refraction.
const GLASS: f64 = 1.5;
/// Longer paths are cut, and dark.
const MOST_EVENTS: usize = 24;
/// Least difference of radiance that an eye could see: one step of 256.
const SEEN: f64 = 1.0 / 256.0;

/// Where the next ray starts.
#[derive(Clone, Copy)]
pub(super) enum Start {
    /// At the proven point.
    Certified,
    /// This far along the normal from the point on the surface.
    Offset(f64),
}

/// Radiance of each pixel, and the rays that it took.
pub(super) struct Picture {
    radiance: Vec<f64>,
    pub(super) rays: u64,
}

impl Picture {
    /// Pixels.
    pub(super) fn pixels(&self) -> u64 {
        self.radiance.len() as u64
    }

    /// Pixels that look different.
    pub(super) fn changed(&self, reference: &Self) -> u64 {
        let pairs = self.radiance.iter().zip(&reference.radiance);
        pairs.filter(|(a, b)| (*a - *b).abs() > SEEN).count() as u64
    }
}

/// One path a pixel; the choices along it depend on the pixel alone, so that two pictures are paired.
pub(super) fn trace(
    cup: &Revolution,
    solver: &Solver,
    start: Start,
    width: u32,
    seed: u64,
    work: &mut Work,
) -> Picture {
    let camera = Camera::new(&CameraDescription {
        eye: DVec3::new(0.0, 6.0, 9.0),
        target: DVec3::new(0.0, 0.9, 0.0),
        up: DVec3::Y,
        vertical_fov_deg: 38.0,
        lens_radius: 0.0,
        focus_distance: 10.0,
    });
    let size = DVec2::new(f64::from(width), f64::from(width * 3 / 4));
    let mut picture = Picture {
        radiance: Vec::new(),
        rays: 0,
    };
    for y in 0..width * 3 / 4 {
        for x in 0..width {
            let index = u64::from(y * width + x);
            let mut stream = Stream::new(seed, Purpose::Camera, index);
            let place = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let mut path = Path {
                cup,
                solver,
                start,
                ray: camera.ray(place, size, [0.5, 0.5]),
            };
            let mut radiance = 0.0;
            for _ in 0..MOST_EVENTS {
                picture.rays += 1;
                if !path.advance(&mut stream, work) {
                    radiance = sky(path.ray.direction);
                    break;
                }
            }
            picture.radiance.push(radiance);
        }
    }
    picture
}

/// Radiance of a direction, 0.1 to 0.9, smooth and nowhere constant.
fn sky(direction: DVec3) -> f64 {
    0.5 + 0.3 * direction.y + 0.1 * direction.x * direction.z
}

struct Path<'a> {
    cup: &'a Revolution,
    solver: &'a Solver,
    start: Start,
    ray: Ray,
}

impl Path<'_> {
    /// The next event; `false` where the ray leaves. Reflects or refracts, half and half where both are open.
    fn advance(&mut self, stream: &mut Stream, work: &mut Work) -> bool {
        let Some(crossing) = self.cup.nearest(&self.ray, self.solver, work) else {
            return false;
        };
        let hit = self.cup.hit(&self.ray, crossing);
        let direction = self.ray.direction;
        let side = hit.side_met(direction);
        let eta = match side {
            Side::Front => GLASS,
            Side::Back => 1.0 / GLASS,
        };
        let normal = hit.normal_on(side);
        let (to, next) = match refract(direction, normal, eta).1 {
            Some(refracted) if stream.uniform() < 0.5 => (side.other(), refracted),
            _ => (side, reflect(direction, normal)),
        };
        self.ray = self.leave(&hit, to, next, work);
        true
    }

    fn leave(&self, hit: &Hit, side: Side, direction: DVec3, work: &mut Work) -> Ray {
        match self.start {
            Start::Certified => self.cup.leave(hit, side, direction, work),
            Start::Offset(offset) => Ray::new(hit.point + offset * hit.normal_on(side), direction),
        }
    }
}
