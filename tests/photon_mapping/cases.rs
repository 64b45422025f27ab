//! Hard cases P2 to P15 of radii, counts and seeds.

use crate::scenes::*;
use glam::DVec3;
use photolathe::render::film::Film;
use photolathe::render::photon::gather::Gathered;
use photolathe::render::photon::radius::{Schedule, Statistics};
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::light::Light;
use photolathe::scene::material::Side;
use photolathe::scene::options::{Integrator, Rule};
use photolathe::scene::{FilmSize, Rgb, Scene};
use std::f64::consts::PI;

/// A beam so thin that every photon meets the floor at the one point that the camera sees. (At the origin there were no rounding, and so
/// no least radius.)
fn needle() -> Scene {
    let down = camera(DVec3::new(1.0, 0.5, 0.0), DVec3::X, 1e-200);
    let beam = Light::Beam {
        center: DVec3::X + DVec3::Y,
        direction: -DVec3::Y,
        radius: 1e-100,
        irradiance: Rgb::splat(1e200),
    };
    scene(1, down, vec![(floor(), diffuse(0.5))], vec![beam])
}

fn one_sample(integrator: Integrator, rule: Rule, alpha: f64, photons: u64) -> Settings {
    Settings {
        rule,
        alpha,
        spp: 1,
        ..settings(integrator, photons, RADIUS)
    }
}

/// Share of the photons that fall into the disc of radius r below a light at height 1.
fn share(square: f64) -> f64 {
    0.5 * (1.0 - 1.0 / (1.0 + square).sqrt())
}

/// Mean and variance of a pass at the nadir: (ρ/π) 4π M/(π r² m), M ~ Binomial(m, p).
fn nadir_pass(square: f64, photons: f64) -> (f64, f64) {
    let (p, each) = (share(square), 2.0 / (PI * square * photons));
    (each * photons * p, each * each * photons * p * (1.0 - p))
}

#[test]
fn p2_the_first_photon_takes_the_square_of_the_radius_to_alpha() {
    let scene = needle();
    for integrator in [Integrator::Ppm, Integrator::Sppm] {
        let settings = one_sample(integrator, Rule::Local, 0.7, 1);
        let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
        let mut film = Film::new(scene.film);
        mapper.pass(0, &mut film, &mut Phases::default());
        let expected = Statistics {
            shrink: 0.7,
            kept: 0.7,
        };
        assert_eq!(mapper.statistics(), [expected]);
        assert_eq!(mapper.radii_squared(), [RADIUS * RADIUS]);
        mapper.pass(1, &mut film, &mut Phases::default());
        assert_eq!(mapper.radii_squared(), [0.7 * (RADIUS * RADIUS)]);
    }
}

/// The passes' readings, mean of each.
fn readings(settings: &Settings, passes: u64) -> Vec<f64> {
    pass_means(&nadir(0.5), settings, passes)
}

/// Means over batches of so many readings.
fn batches(readings: &[f64], size: usize) -> Vec<f64> {
    let mean = |batch: &[f64]| batch.iter().sum::<f64>() / size as f64;
    readings.chunks_exact(size).map(mean).collect()
}

fn sample_variance(values: &[f64]) -> f64 {
    let (_, error) = mean_and_error(values);
    error * error * values.len() as f64
}

/// 100 means of 16 passes: sees a factor 1.85 in their variance; n^(−2/3) would be a factor 2.5.
#[test]
fn p3_alpha_one_keeps_radius_and_bias_and_its_variance_falls_with_the_passes() {
    let settings = one_sample(Integrator::Sppm, Rule::Local, 1.0, 1000);
    let scene = nadir(0.5);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    for pass in 0..20 {
        mapper.pass(pass, &mut film, &mut Phases::default());
    }
    assert_eq!(mapper.radii_squared(), [RADIUS * RADIUS]);
    let found = readings(&settings, 1600);
    let (mean, variance) = nadir_pass(RADIUS * RADIUS, 1000.0);
    assert_mean(&found, mean, 0.06);
    let truth = 0.5 / PI;
    let (measured, error) = mean_and_error(&found);
    assert!(truth - measured > 6.0 * error, "the bias is there");
    let ratio = sample_variance(&batches(&found, 16)) / (variance / 16.0);
    assert!(
        (ratio - 1.0).abs() < 6.0 * (2.0_f64 / 99.0).sqrt(),
        "{ratio}"
    );
}

/// As α → 0 the global radius is r₁²/i and the variance of the mean over n passes V₁ (n + 1)/(2n): 200 means over 16 passes, seen
/// to a factor 1.6, where 1/n would be a factor 8.5.
#[test]
fn p4_without_alpha_the_radius_falls_to_nothing_and_the_variance_stays() {
    let passes = 16;
    let means: Vec<f64> = (0..200)
        .map(|seed| {
            let settings = Settings {
                seed,
                ..one_sample(Integrator::Sppm, Rule::Global, 1e-12, 500)
            };
            readings(&settings, passes).iter().sum::<f64>() / passes as f64
        })
        .collect();
    let expected: f64 = (1..=passes)
        .map(|i| nadir_pass(RADIUS * RADIUS / i as f64, 500.0).1 / (passes * passes) as f64)
        .sum();
    let (_, one) = nadir_pass(RADIUS * RADIUS, 500.0);
    assert!((expected / one / (17.0 / 32.0) - 1.0).abs() < 0.1);
    let ratio = sample_variance(&means) / expected;
    assert!(
        (ratio - 1.0).abs() < 6.0 * (2.0_f64 / 199.0).sqrt(),
        "{ratio}"
    );
}

#[test]
fn p4_a_local_radius_without_alpha_ends_at_its_floor_after_one_pass() {
    let scene = nadir(0.5);
    let settings = one_sample(Integrator::Ppm, Rule::Local, 1e-300, 1000);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    for pass in 0..3 {
        mapper.pass(pass, &mut film, &mut Phases::default());
        let least = mapper.hit_points()[0].least_radius_squared;
        let expected = if pass == 0 { RADIUS * RADIUS } else { least };
        assert_eq!(mapper.radii_squared(), [expected]);
    }
    assert!(film.bad_samples() == 0 && film.mean().x > 0.0);
}

/// One photon a pass with α = 1/1000 takes the square of the radius below the least f64; the floor is some errors of the hit point.
#[test]
fn p6_a_radius_that_underflows_stays_at_its_floor_and_the_picture_finite() {
    let scene = needle();
    let settings = one_sample(Integrator::Ppm, Rule::Local, 1e-3, 1);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    for pass in 0..1000 {
        mapper.pass(pass, &mut film, &mut Phases::default());
    }
    assert_eq!(mapper.statistics()[0].shrink, 0.0);
    assert_eq!(mapper.statistics()[0].kept.round(), 1.0);
    let least = mapper.hit_points()[0].least_radius_squared;
    assert!(least > 0.0);
    assert_eq!(mapper.radii_squared(), [least]);
    assert!(film.bad_samples() == 0 && film.mean().is_finite());
}

#[test]
fn p6_the_global_radius_is_far_from_underflow_after_many_passes() {
    let mut schedule = Schedule::new(Rule::Global, 0.5);
    let many = schedule.shrink(10_000_000);
    let closed = 1e7_f64.sqrt().recip() / libm::tgamma(1.5);
    assert!((many / closed - 1.0).abs() < 1e-6, "{many} {closed}");
    // So 10⁹ passes leave 3.6e-5 of the square.
    assert!(1e9_f64.sqrt().recip() / libm::tgamma(1.5) > 3e-5);
}

#[test]
fn p14_counts_beyond_32_bits_and_sums_beyond_53_stay_right() {
    let all = Gathered {
        photons: 3 << 33,
        ..Gathered::default()
    };
    let mut statistics = Statistics::default();
    let mut sum = 0.0;
    for _ in 0..100 {
        let before = statistics;
        statistics = statistics.after(all.photons as f64 * 1e6, 2.0 / 3.0);
        sum += 2.0 / 3.0 * all.photons as f64 * 1e6;
        assert!(statistics.shrink > 0.0 && statistics.shrink < before.shrink);
        assert!((statistics.kept / sum - 1.0).abs() < 1e-14);
    }
    assert!(sum > 1e18 && statistics.shrink > 0.05);
    // What is lost in rounding no longer changes the radius, nor does it grow.
    let last = statistics.after(1.0, 2.0 / 3.0);
    assert_eq!(last, statistics);
}

/// The variance of means over 4 passes is a quarter of one pass's: 240 means, seen to a factor 1.6.
fn averages_its_noise_away(pass_number: impl Fn(u64) -> u64) -> bool {
    let scene = nadir(0.5);
    let settings = one_sample(Integrator::Sppm, Rule::Constant, 1.0, 500);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let read = |pass| {
        let mut film = Film::new(scene.film);
        mapper.pass(pass_number(pass), &mut film, &mut Phases::default());
        film.mean().x
    };
    let found: Vec<f64> = (0..960).map(read).collect();
    let (_, variance) = nadir_pass(RADIUS * RADIUS, 500.0);
    let ratio = sample_variance(&batches(&found, 4)) / (variance / 4.0);
    (ratio - 1.0).abs() < 6.0 * (2.0_f64 / 239.0).sqrt()
}

/// Also M26, and the trap of a seed that repeats after some passes.
#[test]
fn p15_passes_draw_photons_of_their_own_and_reseeded_passes_are_found_out() {
    assert!(averages_its_noise_away(|pass| pass));
    assert!(!averages_its_noise_away(|_| 0));
    assert!(!averages_its_noise_away(|pass| pass / 4));
}

/// Variance of the mean over n passes of the global rule over that of one pass, if that is as 1/r².
fn variance_of_the_mean(passes: u64, alpha: f64) -> f64 {
    let mut schedule = Schedule::new(Rule::Global, alpha);
    let sum: f64 = (0..passes).map(|pass| schedule.shrink(pass).recip()).sum();
    sum / (passes * passes) as f64
}

/// The trap of means over pixels: a pixel that jitters over the edge of a lamp has the variance 1/n, whatever the others do. The
/// median pixel shows the law, the mean over the pixels the lamp. 150 pictures; ln of the ratio to a standard score of 2 a pixel.
#[test]
fn the_edge_of_a_lamp_hides_the_law_of_the_variance_from_means_but_not_from_medians() {
    // A strip that covers half of the last pixel and little else.
    let lamp = quad(
        DVec3::new(0.88, 0.01, 0.15),
        0.2 * DVec3::X,
        -0.3 * DVec3::Z,
    );
    let scene = Scene {
        film: FilmSize {
            width: 9,
            height: 1,
        },
        ..scene(
            1,
            camera(DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, 4.2),
            vec![
                (floor(), diffuse(0.5)),
                (lamp, glowing(500.0, Side::Front, plain())),
            ],
            vec![point_light(2.0 * DVec3::Y, 100.0)],
        )
    };
    let pictures: Vec<[Vec<f64>; 2]> = (0..150)
        .map(|seed| {
            let settings = Settings {
                seed,
                ..one_sample(Integrator::Pppm, Rule::Global, 2.0 / 3.0, 100)
            };
            let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
            let mut film = Film::new(scene.film);
            [0..4, 4..32].map(|passes| {
                passes.for_each(|pass| {
                    mapper.pass(pass, &mut film, &mut Phases::default());
                });
                film.pixels().iter().map(|pixel| pixel.mean().x).collect()
            })
        })
        .collect();
    let variances = [0, 1].map(|level| {
        let of = |pixel: usize| {
            let values: Vec<f64> = pictures
                .iter()
                .map(|picture| picture[level][pixel])
                .collect();
            sample_variance(&values)
        };
        (0..9).map(of).collect::<Vec<f64>>()
    });
    let mut ratios: Vec<f64> = (0..9).map(|i| variances[0][i] / variances[1][i]).collect();
    ratios.sort_by(f64::total_cmp);
    let [early, late] = variances.map(|level| level.iter().sum::<f64>());
    let law = variance_of_the_mean(4, 2.0 / 3.0) / variance_of_the_mean(32, 2.0 / 3.0);
    let follows_the_law =
        |ratio: f64| libm::log(ratio / law).abs() < 2.0 * (4.0_f64 / 149.0).sqrt();
    assert!(follows_the_law(ratios[4]), "{} {law}", ratios[4]);
    assert!(!follows_the_law(early / late), "{} {law}", early / late);
}

/// The trap of a reference of its own: with α = 0.7, a run of a hundred times the passes still has a quarter of the bias. So bias is measured
/// against closed forms here.
#[test]
fn a_long_run_of_its_own_is_no_truth_for_the_bias() {
    let bias = |passes: u64| {
        let mut schedule = Schedule::new(Rule::Global, 0.7);
        (0..passes).map(|pass| schedule.shrink(pass)).sum::<f64>() / passes as f64
    };
    let kept = bias(6400) / bias(64);
    assert!((kept - 0.25).abs() < 0.03, "{kept}");
}
