//! Camera samples and hit points: where they lie, with which random numbers, and what they are given on the way.

use crate::scenes::*;
use glam::{DVec2, DVec3};
use photolathe::geometry::ray::Ray;
use photolathe::numeric::work::Work;
use photolathe::render::film::Film;
use photolathe::render::photon::camera::{HitPoint, PIXELS_PER_RADIUS, Sampling, View, view};
use photolathe::render::photon::trace::trace;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::material::{Material, Side};
use photolathe::scene::options::Integrator;
use photolathe::scene::{FilmSize, Rgb, Scene};
use std::f64::consts::PI;

/// A floor that fills the picture.
fn floor_scene(width: u32, height: u32) -> Scene {
    let camera = camera(DVec3::new(0.3, 4.0, 2.0), DVec3::new(0.0, 0.0, 0.5), 30.0);
    let floor = vec![(floor(), diffuse(0.5))];
    Scene {
        film: FilmSize { width, height },
        ..scene(1, camera, floor, vec![point_light(DVec3::Y, 1.0)])
    }
}

fn sampling(spp: u32) -> Sampling {
    Sampling {
        spp,
        seed: 3,
        pass: 0,
        radius: None,
        max_depth: None,
        split: true,
    }
}

/// Where a point is seen on the film, in pixels.
fn on_film(scene: &Scene, point: DVec3) -> DVec2 {
    let [right, up, forward] = scene.camera.frame();
    let offset = point - scene.camera.eye();
    let size = DVec2::new(f64::from(scene.film.width), f64::from(scene.film.height));
    let scale = 0.5 * size.y / (offset.dot(forward) * scene.camera.tan_half_fov());
    0.5 * size + scale * DVec2::new(offset.dot(right), -offset.dot(up))
}

/// Place of a hit point within its pixel.
fn within_pixel(scene: &Scene, hit_point: &HitPoint) -> DVec2 {
    let width = scene.film.width;
    let corner = DVec2::new(
        f64::from(hit_point.pixel % width),
        f64::from(hit_point.pixel / width),
    );
    on_film(scene, hit_point.point) - corner
}

/// Six samples a pixel lie in the cells of a grid of 2 × 3, one in each. 1200 pixels are several chunks of work.
#[test]
fn every_sample_falls_into_a_cell_of_its_own() {
    let scene = floor_scene(40, 30);
    let view = view(&scene, &sampling(6));
    assert_eq!(view.emission, vec![Rgb::ZERO; 1200]);
    assert_eq!((view.hit_points.len(), view.work.camera_rays), (7200, 7200));
    for (pixel, hit_points) in view.hit_points.chunks(6).enumerate() {
        let mut cells = [false; 6];
        for hit_point in hit_points {
            assert_eq!(hit_point.pixel, pixel as u32);
            let cell = (within_pixel(&scene, hit_point) * DVec2::new(2.0, 3.0)).floor();
            assert!(cell.cmpge(DVec2::ZERO).all() && cell.x < 2.0 && cell.y < 3.0);
            cells[(cell.x + 2.0 * cell.y) as usize] = true;
        }
        assert_eq!(cells, [true; 6], "pixel {pixel}");
    }
}

/// Whether two samples have the same place in their cells, to far more digits than chance allows.
fn some_share_their_numbers(scene: &Scene, views: &[Vec<HitPoint>]) -> bool {
    let mut places: Vec<DVec2> = views
        .iter()
        .flatten()
        .map(|hit_point| (within_pixel(scene, hit_point) * 2.0).fract_gl())
        .collect();
    places.sort_by(|a, b| a.x.total_cmp(&b.x));
    places
        .windows(2)
        .any(|pair| (pair[1] - pair[0]).abs().max_element() < 1e-9)
}

#[test]
fn no_two_camera_samples_share_their_random_numbers() {
    let scene = floor_scene(16, 12);
    let settings = Settings {
        spp: 4,
        radius: None,
        ..settings(Integrator::Sppm, 0, 1.0)
    };
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    let mut views = Vec::new();
    for pass in 0..3 {
        mapper.pass(pass, &mut film, &mut Phases::default());
        views.push(mapper.hit_points().to_vec());
    }
    assert_eq!(views.iter().map(Vec::len).sum::<usize>(), 3 * 16 * 12 * 4);
    assert!(!some_share_their_numbers(&scene, &views));
    views.push(views[0][..1].to_vec());
    assert!(some_share_their_numbers(&scene, &views));
}

const EYE: DVec3 = DVec3::new(5.0, 1.0, 7.0);

/// A camera at height 1 sees the floor directly, or by a mirror at height 2, on a path of length 3.
fn seen(upwards: bool) -> (Scene, View) {
    let target = EYE + if upwards { DVec3::Y } else { -DVec3::Y };
    let mirror = Material {
        mirror: Some(Rgb::splat(0.8)),
        ..plain()
    };
    let corner = EYE + DVec3::new(-1.0, 1.0, -1.0);
    let ceiling = quad(corner, 2.0 * DVec3::X, 2.0 * DVec3::Z);
    let scene = scene(
        1,
        camera(EYE, target, 0.01),
        vec![(floor(), diffuse(0.5)), (ceiling, mirror)],
        Vec::new(),
    );
    let view = view(&scene, &sampling(2));
    (scene, view)
}

#[test]
fn a_hit_point_knows_the_length_events_and_weight_of_its_path() {
    for (upwards, length, events, weight) in [(false, 1.0, 0, 1.0), (true, 3.0, 1, 0.8)] {
        let (scene, view) = seen(upwards);
        assert_eq!(view.hit_points.len(), 2);
        assert_eq!(view.work.scattered_rays, 2 * u64::from(events));
        let down = Ray::new(EYE, -DVec3::Y);
        let error = scene
            .intersect(&down, &mut Work::default())
            .map(|hit| hit.error);
        let least = 64.0 * error.expect("the floor lies below");
        for hit_point in &view.hit_points {
            assert_eq!((hit_point.events, hit_point.object), (events, 0));
            assert_eq!(hit_point.normal, DVec3::Y);
            let radius = PIXELS_PER_RADIUS * scene.camera.pixel_size(1) * length;
            assert!((hit_point.first_radius_squared / (radius * radius) - 1.0).abs() < 1e-6);
            // The error of a hit straight below: the two points differ by a picture of 10⁻⁴.
            assert!((hit_point.least_radius_squared / (least * least) - 1.0).abs() < 1e-3);
            let expected = weight * 0.5 / (2.0 * PI);
            assert!((hit_point.weight.x / expected - 1.0).abs() < 1e-14);
        }
    }
}

/// Specular events before roulette: 32 surely, then each further one with a chance of ¾, three in the mean (variance 12).
#[test]
fn camera_paths_between_perfect_mirrors_end_by_roulette_after_32_events() {
    let mirror = Material {
        mirror: Some(Rgb::ONE),
        ..plain()
    };
    let scene = Scene {
        film: FilmSize {
            width: 1,
            height: 1,
        },
        ..room(mirror, Vec::new(), Vec::new())
    };
    let paths = 2000;
    let events: Vec<u64> = (0..paths)
        .map(|pass| {
            let one = Sampling {
                pass,
                ..sampling(1)
            };
            view(&scene, &one).work.scattered_rays
        })
        .collect();
    assert_eq!(events.iter().min(), Some(&32));
    let mean = events.iter().sum::<u64>() as f64 / paths as f64;
    let sigma = (12.0 / paths as f64).sqrt();
    assert!((mean - 35.0).abs() < 6.0 * sigma, "{mean}");
}

/// Under the local rule every hit point that stays (`ppm`), or every pixel whose hit points change (`sppm`), keeps the share α of the
/// photons that it found itself, and its own radius follows in the next pass.
#[test]
fn every_radius_shrinks_by_its_own_photons() {
    let scene = floor_scene(8, 6);
    for integrator in [Integrator::Ppm, Integrator::Sppm] {
        let settings = Settings {
            spp: 2,
            ..settings(integrator, 3000, RADIUS)
        };
        let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
        let mut film = Film::new(scene.film);
        mapper.pass(0, &mut film, &mut Phases::default());
        let first = mapper.hit_points().to_vec();
        assert_eq!(mapper.radii_squared(), vec![RADIUS * RADIUS; first.len()]);
        let fixed = integrator == Integrator::Ppm;
        let region = |index: usize, hit_points: &[HitPoint]| {
            if fixed {
                index
            } else {
                hit_points[index].pixel as usize
            }
        };
        let photons = trace(&scene, settings.seed, 0, settings.photons, None).points;
        let mut found = vec![0.0; if fixed { first.len() } else { 48 }];
        for (index, hit_point) in first.iter().enumerate() {
            let within = |p: &&DVec3| (**p - hit_point.point).length_squared() <= RADIUS * RADIUS;
            found[region(index, &first)] += photons.iter().filter(within).count() as f64;
        }
        assert!(found.iter().any(|&n| n > 20.0) && found.iter().any(|&n| n < 20.0));
        let before = mapper.statistics().to_vec();
        assert_eq!(before.len(), found.len());
        for (statistics, found) in before.iter().zip(&found) {
            assert!((statistics.kept - settings.alpha * found).abs() < 1e-9);
            assert_eq!(statistics.shrink < 1.0, *found > 0.0);
        }
        mapper.pass(1, &mut film, &mut Phases::default());
        let second = mapper.hit_points();
        assert_eq!(fixed, second == first);
        for (index, &square) in mapper.radii_squared().iter().enumerate() {
            let shrink = before[region(index, second)].shrink;
            assert_eq!(square, shrink * (RADIUS * RADIUS));
        }
    }
}

/// A glowing floor by way of a mirror is one event away: seen from a greatest depth of one on, as `path` sees it.
#[test]
fn emission_is_seen_through_no_more_events_than_the_greatest_depth() {
    let mirror = Material {
        mirror: Some(Rgb::splat(0.8)),
        ..plain()
    };
    let corner = EYE + DVec3::new(-1.0, 1.0, -1.0);
    let ceiling = quad(corner, 2.0 * DVec3::X, 2.0 * DVec3::Z);
    let lamp = glowing(5.0, Side::Both, plain());
    let scene = scene(
        1,
        camera(EYE, EYE + DVec3::Y, 0.01),
        vec![(floor(), lamp), (ceiling, mirror)],
        Vec::new(),
    );
    for (depth, seen) in [(Some(0), 0.0), (Some(1), 4.0), (Some(2), 4.0), (None, 4.0)] {
        let sampling = Sampling {
            max_depth: depth,
            ..sampling(2)
        };
        let emission = view(&scene, &sampling).emission[0];
        assert!(
            (emission - seen).abs().max_element() < 1e-12,
            "{depth:?} {emission}"
        );
    }
}

/// Through the middle of a glass ball, F = .04: the far side, what the front reflects, and what comes back from within, .96² · .04.
/// Samples that stay for all passes follow these whatever their numbers.
#[test]
fn samples_that_stay_follow_both_ways_however_faint() {
    let things = vec![(sphere(DVec3::ZERO, 0.2), glass(1.5, 0.0))];
    let room = room(diffuse(0.5), things, Vec::new());
    let scene = Scene {
        camera: camera(0.5 * DVec3::Z, DVec3::ZERO, 1e-3),
        ..room
    };
    for seed in 0..20 {
        let sampling = Sampling {
            seed,
            ..sampling(1)
        };
        for pixel in view(&scene, &sampling)
            .hit_points
            .chunk_by(|a, b| a.pixel == b.pixel)
        {
            let mut weights: Vec<f64> = pixel.iter().map(|hit| 2.0 * PI * hit.weight.x).collect();
            // What roulette leaves of lighter ones weighs .0216.
            weights.retain(|&weight| weight > 0.03);
            weights.sort_by(f64::total_cmp);
            let expected = [0.96 * 0.96 * 0.04, 0.04, 0.96 * 0.96];
            let right = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-4;
            assert_eq!(weights.len(), 3, "{weights:?}");
            assert!(weights.iter().zip(&expected).all(right), "{weights:?}");
        }
    }
}
