//! Lights, their shapes, and estimates with their errors.

use glam::DVec3;
use photolathe::geometry::planar::{Disc, Quad};
use photolathe::geometry::shape::Shape;
use photolathe::geometry::sphere::Sphere;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::scene::Rgb;
use photolathe::scene::light::{Emitter, Light};
use photolathe::scene::material::{Emission, Side};

pub(crate) const SIGMAS: f64 = 6.0;

pub(crate) fn stream(index: u64) -> Stream {
    Stream::new(11, Purpose::Test, index)
}

pub(crate) fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

pub(crate) fn sphere(center: DVec3, radius: f64) -> Sphere {
    Sphere { center, radius }
}

pub(crate) fn disc(center: DVec3, normal: DVec3, radius: f64) -> Disc {
    Disc {
        center,
        normal,
        radius,
    }
}

pub(crate) fn quad(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Quad {
    Quad::new(corner, edge_u, edge_v)
}

pub(crate) fn point_light(position: DVec3, intensity: Rgb) -> Light {
    Light::Point {
        position,
        intensity,
    }
}

pub(crate) fn beam(center: DVec3, direction: DVec3, radius: f64, irradiance: Rgb) -> Light {
    Light::Beam {
        center,
        direction,
        radius,
        irradiance,
    }
}

pub(crate) fn area(surface: Emitter, side: Side) -> Light {
    Light::Area {
        object: 0,
        surface,
        emission: Emission {
            radiance: Rgb::new(1.0, 2.0, 0.5),
            side,
        },
    }
}

pub(crate) fn shape(surface: &Emitter) -> Shape {
    match surface {
        Emitter::Quad(quad) => Shape::Quad(*quad),
        Emitter::Disc(disc) => Shape::Disc(*disc),
        Emitter::Sphere(sphere) => Shape::Sphere(*sphere),
    }
}

/// Mean and standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) mean: f64,
    pub(crate) error: f64,
}

pub(crate) fn estimate(count: usize, mut sample: impl FnMut() -> f64) -> Estimate {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..count {
        let x = sample();
        sum += x;
        squares += x * x;
    }
    let n = count as f64;
    let mean = sum / n;
    let variance = (squares / n - mean * mean).max(0.0);
    Estimate {
        mean,
        error: (variance / n).sqrt(),
    }
}

impl Estimate {
    /// Asserts agreement with an exact value; the rounding of the sums, and parts too rare to be
    /// drawn, have a floor.
    pub(crate) fn agrees_with(&self, exact: f64, what: &str) {
        let allowed = SIGMAS * self.error + 1e-8 * exact.abs();
        assert!(
            (self.mean - exact).abs() <= allowed,
            "{what}: {self:?}, expected {exact}"
        );
        assert!(
            self.error < 0.003 * exact.abs().max(1e-9),
            "{what}: too noisy: {self:?}"
        );
    }
}
