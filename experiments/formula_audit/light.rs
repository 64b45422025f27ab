//! Diffuse directions, the cosine, and Fresnel's reflectance.

use super::{Fault, Trial, compare};
use crate::render::scatter::{fresnel, refract};
use crate::scene::sampling::{cosine_density, cosine_hemisphere, uniform_sphere};
use glam::DVec3;
use std::f64::consts::PI;

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "uniform for cosine-weighted directions",
        number: "M20",
        component: "diffuse reflection",
        quantity: "mean cosine of directions",
        hides_where: "share of directions above the surface",
        property: "cos² is uniform: its mean is ½",
        examine: |trial| {
            let below = |f: Direction| {
                let below = directions(trial, f).filter(|&cos| cos < 0.0);
                below.count() as f64
            };
            compare(
                cosine_hemisphere as Direction,
                uniform_hemisphere,
                |f| mean(directions(trial, f)),
                below,
                |f| {
                    // The variance of a uniform number is 1/12.
                    let error = (1.0 / 12.0 / trial.samples as f64).sqrt();
                    let squares = mean(directions(trial, f).map(|cos| cos * cos));
                    (squares - 0.5).abs() < 6.0 * error
                },
            )
        },
    },
    Fault {
        name: "cosine twice",
        number: "M21",
        component: "diffuse reflection",
        quantity: "irradiance under a uniform sky of radiance 1, over π",
        hides_where: "light along the normal",
        property: "irradiance under a uniform sky is πL",
        examine: |trial| {
            let sky = |f: Weight| mean(directions(trial, cosine_hemisphere).map(f)) / PI;
            compare(
                cosine_over_density as Weight,
                cosine_twice,
                sky,
                |f| f(1.0),
                // A sum of n terms errs by n roundings at most.
                |f| (sky(f) - 1.0).abs() < trial.samples as f64 * f64::EPSILON,
            )
        },
    },
    Fault {
        name: "constant shares for Fresnel's",
        number: "M30",
        component: "glass",
        quantity: "reflected share of diffuse light, n = 1.5",
        hides_where: "light along the normal",
        property: "grazing light is reflected wholly, and so is light beyond the critical angle",
        examine: |_| {
            compare(
                reflectance as Reflectance,
                constant,
                |f| hemispherical(f, 1.5),
                |f| f(1.0, 1.5),
                |f| f(0.0, 1.5) == 1.0 && (0..=7).all(|k| f(0.1 * f64::from(k), 1.0 / 1.5) == 1.0),
            )
        },
    },
];

/// A direction about a normal.
type Direction = fn(DVec3, [f64; 2]) -> DVec3;
/// Irradiance that a direction at a cosine stands for, sampled with the cosine, per radiance.
type Weight = fn(f64) -> f64;
/// Reflectance at a cosine for a relative index.
type Reflectance = fn(f64, f64) -> f64;

fn uniform_hemisphere(normal: DVec3, u: [f64; 2]) -> DVec3 {
    let direction = uniform_sphere(u);
    direction * direction.dot(normal).signum()
}

/// Cosines of directions about a normal.
fn directions(trial: &Trial, direction: Direction) -> impl Iterator<Item = f64> + use<> {
    let normal = DVec3::new(0.48, 0.6, -0.64);
    let mut stream = trial.stream(0);
    let draw = move |_| direction(normal, stream.uniform2()).dot(normal);
    (0..trial.samples).map(draw)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

fn cosine_over_density(cos: f64) -> f64 {
    cos / cosine_density(cos)
}

fn cosine_twice(cos: f64) -> f64 {
    cos * cosine_over_density(cos)
}

fn reflectance(cos: f64, eta: f64) -> f64 {
    let direction = DVec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0);
    refract(direction, DVec3::Y, eta).0
}

fn constant(_: f64, eta: f64) -> f64 {
    fresnel(1.0, eta).0
}

/// ∫ F(cos) d(cos²) by midpoints: .09178 for n = 1.5.
fn hemispherical(reflectance: Reflectance, eta: f64) -> f64 {
    let n = 2000;
    let middles = (0..n).map(|k| (f64::from(k) + 0.5) / f64::from(n));
    mean(middles.map(|square| reflectance(square.sqrt(), eta)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hemispherical_reflectance_is_as_tabulated() {
        assert!((hemispherical(reflectance, 1.5) - 0.091_78).abs() < 5e-5);
    }
}
