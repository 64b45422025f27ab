//! Photons aimed at glass and mirrors draw the picture that others draw.

use crate::scenes::*;
use glam::DVec3;
use photolathe::render::film::Film;
use photolathe::render::photon::trace::trace;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::aim::{AIMED, Aim};
use photolathe::scene::options::{Integrator, Rule};
use photolathe::scene::{Rgb, Scene};

/// The same scene with none of its photons aimed.
fn unaimed(scene: &Scene) -> Scene {
    Scene {
        lights: scene.lights.clone().aimed(Aim::default()),
        ..scene.clone()
    }
}

fn picture(scene: &Scene, passes: u64) -> Film {
    let settings = Settings {
        rule: Rule::Constant,
        ..settings(Integrator::Ppm, 4000, 0.2)
    };
    let mut mapper = PhotonMapper::new(scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    for pass in 0..passes {
        mapper.pass(pass, &mut film, &mut Phases::default());
    }
    film
}

/// 64 pixels with caustics of glass and mirror, same hit points and radii: six standard errors each, and of their mean, which sees
/// 2 %.
#[test]
fn the_mean_picture_is_the_same_with_and_without_aim() {
    let scene = full_box(8);
    let (aimed, plain) = (picture(&scene, 100), picture(&unaimed(&scene), 100));
    let (mut difference, mut variance, mut total) = (0.0, 0.0, 0.0);
    for (a, b) in aimed.pixels().iter().zip(plain.pixels()) {
        let apart = a.mean().x - b.mean().x;
        let square = a.variance_of_mean().x + b.variance_of_mean().x;
        assert!(apart.abs() <= 6.0 * square.sqrt(), "{apart} {square}");
        difference += apart;
        variance += square;
        total += b.mean().x;
    }
    let error = f64::sqrt(variance);
    assert!(6.0 * error < 0.02 * total, "blind: {error} of {total}");
    assert!(difference.abs() < 6.0 * error, "{difference} ± {error}");
}

/// What left the lights is their power in the mean. Variance of a photon's worth: at most 1/(1 − a) − 1, as its mean square is
/// Σ p₀²/p ≤ 1/(1 − a).
#[test]
fn aimed_photons_bring_the_power_of_the_lights() {
    let scene = full_box(8);
    let n = 100_000_u64;
    let energy = trace(&scene, 3, 0, n, Some(1)).energy;
    let power = scene.lights.power();
    let error = ((1.0 / (1.0 - AIMED) - 1.0) / n as f64).sqrt();
    let share = energy.emitted / (n as f64 * power);
    assert!(
        (share - Rgb::ONE).abs().max_element() < 6.0 * error,
        "{share}"
    );
    assert!(energy.emitted != n as f64 * power && 6.0 * error < 0.01);
}

/// A path is worth tracing only as far as it carries light: those of little worth go on from their first diffuse surface by
/// roulette, and who goes on carries as much as an unaimed photon. The walls reflect half, and half of the photons.
#[test]
fn only_on_its_first_diffuse_surface_a_photon_carries_less_than_others() {
    let ball = (sphere(DVec3::new(0.2, -0.3, 0.1), 0.2), glass(1.5, 0.0));
    let lights = vec![point_light(DVec3::new(-0.2, 0.5, 0.0), 1.0)];
    let scene = room(diffuse(0.5), vec![ball], lights);
    let power = scene.lights.power().x;
    let (mut light, mut heavy) = (0, 0);
    for path in 0..4000 {
        let photons = trace(&scene, 4, path, 1, None);
        let worths: Vec<f64> = photons.arrivals.iter().map(|p| p.flux.x / power).collect();
        let Some((first, others)) = worths.split_first() else {
            continue;
        };
        let expected = first.clamp(1.0, 1.0 / (1.0 - AIMED));
        for worth in others {
            assert!((worth - expected).abs() < 1e-6, "{worths:?}");
        }
        light += u32::from(*first < 0.5);
        heavy += u32::from(*first > 1.0);
    }
    assert!(light > 200 && heavy > 1000, "{light} {heavy}");
    // Nothing of this without aim: all worth one.
    let plain = trace(&unaimed(&scene), 4, 0, 1000, None);
    let error = |p: &f64| (p / power - 1.0).abs();
    assert!(plain.arrivals.iter().all(|p| error(&p.flux.x) < 1e-6));
}
