//! Kernels and rules in force in a pass.

use crate::scenes::*;
use photolathe::render::film::Film;
use photolathe::render::photon::error::Errors;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::Rgb;
use photolathe::scene::options::{Integrator, Kernel, Rule};
use std::f64::consts::PI;

fn one_hit_point(kernel: Kernel, rule: Rule, photons: u64, radius: f64) -> Settings {
    Settings {
        spp: 1,
        kernel,
        rule,
        ..settings(Integrator::Sppm, photons, radius)
    }
}

/// ∫ w(s) (1 + R² s)^(−3/2) ds: what a kernel of radius R reads straight below a light at height 1, of what is there.
fn kernel_mean(kernel: Kernel, radius: f64) -> f64 {
    let steps = 2000;
    let at = |i: u32| {
        let s = (f64::from(i) + 0.5) / f64::from(steps);
        kernel.weight(s) * libm::pow(1.0 + radius * radius * s, -1.5)
    };
    (0..steps).map(at).sum::<f64>() / f64::from(steps)
}

/// At R = 1 the kernels read .586, .686 and .931 of what is there: the test sees 8 %.
#[test]
fn every_kernel_reads_its_mean_at_the_nadir() {
    assert!((kernel_mean(Kernel::Disc, 1.0) - 0.585_79).abs() < 1e-5);
    for kernel in [Kernel::Disc, Kernel::Epanechnikov, Kernel::FourthOrder] {
        let settings = one_hit_point(kernel, Rule::Constant, 4000, 1.0);
        let means = pass_means(&nadir(0.5), &settings, 200);
        assert_mean(&means, 0.5 / PI * kernel_mean(kernel, 1.0), 0.08);
    }
}

/// On a sphere the photons within a chord r fill exactly π r², and so no radial kernel has a bias at any radius. Sees 9 %.
#[test]
fn p10_on_a_sphere_no_kernel_has_a_bias() {
    let scene = room(
        diffuse(0.5),
        Vec::new(),
        vec![point_light(glam::DVec3::ZERO, PI)],
    );
    for kernel in [Kernel::Epanechnikov, Kernel::FourthOrder] {
        let settings = one_hit_point(kernel, Rule::Constant, 2000, 0.5);
        assert_mean(&pass_means(&scene, &settings, 100), 1.0, 0.09);
    }
}

/// Local statistics count photons, not their weights: the radii are those of the disc.
#[test]
fn radii_do_not_depend_on_the_kernel() {
    let radii = |kernel| {
        let (scene, settings) = (nadir(0.5), one_hit_point(kernel, Rule::Local, 500, RADIUS));
        let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
        let mut film = Film::new(scene.film);
        (0..20)
            .map(|pass| {
                mapper.pass(pass, &mut film, &mut Phases::default());
                mapper.radii_squared()[0]
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(radii(Kernel::Disc), radii(Kernel::FourthOrder));
    assert!(radii(Kernel::Disc)[19] < 0.5 * RADIUS * RADIUS);
}

/// M23 in a picture: by the geometric rule as coded, pass 30 reads .95³⁰ = .21 of what it should. Sees a third of the dimmed value.
#[test]
fn as_coded_the_picture_dims_and_normalised_it_does_not() {
    let reads = |rule, expected: f64| {
        let settings = one_hit_point(Kernel::Disc, rule, 20_000, 0.5);
        let scene = nadir(0.5);
        let values: Vec<f64> = (0..60)
            .map(|replicate| {
                let settings = Settings {
                    seed: replicate,
                    ..settings.clone()
                };
                let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
                let mut film = Film::new(scene.film);
                mapper.pass(30, &mut film, &mut Phases::default());
                film.mean().x
            })
            .collect();
        assert_mean(&values, expected, 0.34);
    };
    let dimmed = libm::pow(0.95, 30.0);
    let mean = 0.5 / PI * kernel_mean(Kernel::Disc, 0.5 * dimmed);
    reads(Rule::Geometric, mean);
    reads(Rule::GeometricAsCoded, dimmed * mean);
}

/// The floor of the radius is a few bounds of the error of the hit: radii that would underflow end there, and the picture is finite.
#[test]
fn p6_a_radius_that_would_underflow_stays_at_its_floor() {
    let scene = nadir(0.5);
    let settings = one_hit_point(Kernel::Disc, Rule::Geometric, 100, RADIUS);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    mapper.pass(1_000_000, &mut film, &mut Phases::default());
    let floor = mapper.hit_points()[0].least_radius_squared;
    assert_eq!(mapper.radii_squared(), [floor]);
    assert!(floor > 0.0 && floor < 1e-20 && film.mean().is_finite());
}

/// The estimated bias is 2 ∫sw of what the disc's estimate reads: all, two thirds and nothing of ∫ (6 s − 3) E ds. Six errors of it
/// are .02.
#[test]
fn every_kernel_estimates_a_bias_of_its_own() {
    let read = {
        let at = |i: u32| {
            let s = (f64::from(i) + 0.5) / 2000.0;
            (6.0 * s - 3.0) * libm::pow(1.0 + s, -1.5)
        };
        (0..2000).map(at).sum::<f64>() / 2000.0
    };
    let scene = nadir(0.5);
    for (kernel, share) in [
        (Kernel::Disc, 1.0),
        (Kernel::Epanechnikov, 2.0 / 3.0),
        (Kernel::FourthOrder, 0.0),
    ] {
        let settings = Settings {
            estimate_errors: true,
            ..one_hit_point(kernel, Rule::Constant, 4000, 1.0)
        };
        let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
        let mut film = Film::new(scene.film);
        for pass in 0..200 {
            mapper.pass(pass, &mut film, &mut Phases::default());
        }
        let tally = mapper.errors().expect("as the settings ask").tallies()[0];
        let (low, high) = tally.interval(0.5);
        let bias = (tally.reading() - 0.5 * (low + high)) * PI / 0.5;
        assert!(
            (bias - share * read).abs() < 0.02,
            "{kernel:?} {bias} {read}"
        );
    }
}

#[test]
fn errors_are_those_of_the_mean_of_the_channels() {
    let mut errors = Errors::new(1);
    for pass in [1.0, 3.0] {
        errors.add(
            &[pass * Rgb::new(2.0, 0.0, 1.0)],
            &[Rgb::new(0.0, 0.0, 0.6)],
        );
    }
    let tally = errors.tallies()[0];
    assert_eq!((tally.reading(), tally.noise_squared()), (2.0, 1.0));
    assert!((tally.bias_squared() - 0.04).abs() < 1e-15);
}
