//! What is refused, and that threads and indices change nothing.

use crate::scenes::*;
use clap::ValueEnum;
use glam::DVec3;
use photolathe::numeric::work::Work;
use photolathe::render::film::Film;
use photolathe::render::photon::trace::trace;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::options::{IndexName, Integrator};
use photolathe::scene::{FilmSize, Rgb, Scene};
use std::f64::consts::PI;

#[test]
fn settings_and_scenes_out_of_range_are_refused() {
    let scene = nadir(0.5);
    let good = settings(Integrator::Ppm, 10, RADIUS);
    let bad = [
        Settings {
            alpha: 0.0,
            ..good.clone()
        },
        Settings {
            alpha: 1.1,
            ..good.clone()
        },
        Settings {
            alpha: f64::NAN,
            ..good.clone()
        },
        Settings {
            radius: Some(0.0),
            ..good.clone()
        },
        Settings {
            radius: Some(f64::NAN),
            ..good.clone()
        },
        Settings {
            radius: Some(f64::INFINITY),
            ..good.clone()
        },
        Settings {
            spp: 0,
            ..good.clone()
        },
    ];
    for settings in bad {
        assert!(
            PhotonMapper::new(&scene, &settings).is_err(),
            "{settings:?}"
        );
    }
    let sky = Scene {
        background: Rgb::ONE,
        ..scene.clone()
    };
    assert!(PhotonMapper::new(&sky, &good).is_err());
    let film = FilmSize {
        width: 1 << 16,
        height: 1 << 16,
    };
    let large = |film| Scene {
        film,
        ..scene.clone()
    };
    assert!(PhotonMapper::new(&large(film), &good).is_err());
    // Four samples a pixel of 2¹² × 2¹² are the most.
    let most = FilmSize {
        width: 1 << 12,
        height: 1 << 12,
    };
    assert!(good.spp == 4 && PhotonMapper::new(&large(most), &good).is_ok());
    let beyond = FilmSize {
        height: most.height + 1,
        ..most
    };
    assert!(PhotonMapper::new(&large(beyond), &good).is_err());
}

#[test]
fn every_phase_of_a_pass_takes_time_and_has_its_name() {
    let settings = settings(Integrator::Ppm, 1000, RADIUS);
    let scene = nadir(0.5);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut phases = Phases::default();
    mapper.pass(0, &mut Film::new(scene.film), &mut phases);
    let Phases {
        camera,
        trace,
        build,
        gather,
    } = phases;
    assert!(
        [camera, trace, build, gather]
            .iter()
            .all(|&time| time > 0.0)
    );
    assert_eq!(
        phases.named(),
        [
            ("camera", camera),
            ("trace", trace),
            ("build", build),
            ("gather", gather)
        ]
    );
}

/// A pass traces its photons in batches; each photon counts once, whatever the batch.
#[test]
fn a_pass_of_more_photons_than_a_batch_gathers_each_once() {
    let scene = nadir(0.5);
    let photons = (1 << 18) + 50_000;
    let settings = Settings {
        spp: 1,
        ..settings(Integrator::Ppm, photons, RADIUS)
    };
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    let work = mapper.pass(0, &mut film, &mut Phases::default());
    let center = mapper.hit_points()[0].point;
    let all = trace(&scene, settings.seed, 0, photons, None);
    let within = |point: &&DVec3| (**point - center).length_squared() <= RADIUS * RADIUS;
    let found = all.points.iter().filter(within).count();
    assert!(found > 5000);
    assert_eq!(work.photons_gathered, found as u64);
    assert_eq!(work.photon_paths, photons);
    assert_eq!(work.photons_stored, all.points.len() as u64);
    // Each brings 4π W over the photons: radiance ρ/π Σ Φ/(π r² photons).
    let flux = found as f64 * 4.0 * PI / photons as f64;
    let expected = 0.5 / PI * flux / (PI * RADIUS * RADIUS);
    assert!((film.pixels()[0].mean().x / expected - 1.0).abs() < 1e-12);
}

#[test]
fn the_bytes_are_the_same_for_any_number_of_threads_and_any_index() {
    let scene = full_box(24);
    for integrator in [Integrator::Ppm, Integrator::Sppm, Integrator::Pppm] {
        let run = |threads, index| -> (Film, Work) {
            let settings = Settings {
                radius: None,
                index,
                ..settings(integrator, 5000, 1.0)
            };
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool");
            pool.install(|| {
                let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
                let mut film = Film::new(scene.film);
                let mut work = Work::default();
                for pass in 0..3 {
                    work += mapper.pass(pass, &mut film, &mut Phases::default());
                }
                (film, work)
            })
        };
        let scanned = run(1, IndexName::Linear).0;
        assert!(scanned.mean().min_element() > 0.0 && scanned.bad_samples() == 0);
        for &index in IndexName::value_variants() {
            let one = run(1, index);
            assert!(one.0 == scanned, "{integrator:?}, {index:?}");
            let more = [2, 3].map(|threads| run(threads, index));
            assert!(
                more.iter().all(|more| *more == one),
                "{integrator:?}, {index:?}"
            );
        }
    }
}
