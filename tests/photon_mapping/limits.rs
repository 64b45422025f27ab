//! What is refused, and that threads change nothing.

use crate::scenes::*;
use photolathe::numeric::work::Work;
use photolathe::render::film::Film;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::options::Integrator;
use photolathe::scene::{FilmSize, Rgb, Scene};

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
    assert!(PhotonMapper::new(&Scene { film, ..scene }, &good).is_err());
}

#[test]
fn the_bytes_are_the_same_for_any_number_of_threads() {
    let scene = full_box(24);
    for integrator in [Integrator::Ppm, Integrator::Sppm, Integrator::Pppm] {
        let settings = Settings {
            radius: None,
            ..settings(integrator, 10_000, 1.0)
        };
        let run = |threads| -> (Film, Work) {
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
        let one = run(1);
        assert!(one.0.mean().min_element() > 0.0 && one.0.bad_samples() == 0);
        assert!(one == run(2) && one == run(3), "{integrator:?}");
    }
}
