//! Which photons count at a hit point, what they are worth, and how they scatter.

use crate::scenes::*;
use glam::DVec3;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::render::film::Film;
use photolathe::render::photon::arrivals::{Arrival, Arrivals};
use photolathe::render::photon::camera::HitPoint;
use photolathe::render::photon::gather::{Gathered, accepts, gather, radiance};
use photolathe::render::photon::trace::trace;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::Rgb;
use photolathe::scene::light::Light;
use photolathe::scene::options::{Integrator, Rule};
use photolathe::scene::sampling::{cosine_hemisphere, uniform_sphere};
use std::f64::consts::PI;

/// E_est/E across the edge of a half plane under even light: f(x) = ½ + (x√(1 − x²) + asin x)/π, x = distance over radius.
#[test]
fn p8_at_an_edge_the_estimate_follows_the_covered_share_of_the_disc() {
    for x in [0.0_f64, 0.5, 0.9, 1.5] {
        let at = DVec3::new(-x * RADIUS - 1e-9, 0.0, 0.0);
        let half_plane = quad(DVec3::new(-2.0, 0.0, 1.0), 2.0 * DVec3::X, -2.0 * DVec3::Z);
        let scene = scene(
            1,
            camera(at + DVec3::Y, at, 1e-8),
            vec![(half_plane, diffuse(0.5))],
            vec![Light::Beam {
                center: 2.0 * DVec3::Y,
                direction: -DVec3::Y,
                radius: 1.0,
                irradiance: Rgb::ONE,
            }],
        );
        let settings = Settings {
            rule: Rule::Constant,
            ..settings(Integrator::Sppm, 5000, RADIUS)
        };
        let inner = x.min(1.0);
        let covered = 0.5 + (inner * (1.0 - inner * inner).sqrt() + libm::asin(inner)) / PI;
        assert_mean(
            &pass_means(&scene, &settings, 100),
            0.5 / PI * covered,
            0.05,
        );
    }
}

/// At the foot of a wall under slanting light, the share of the disc that lies beyond the wall is lost, as at an edge: photons on the wall
/// do not count on the floor. Under 45° both are lit alike; direct light only.
#[test]
fn p8_at_the_foot_of_a_wall_the_estimate_is_that_of_an_edge() {
    for x in [0.0_f64, 0.5, 0.9] {
        let at = DVec3::new(-x * RADIUS - 1e-9, 0.0, 0.0);
        let ground = quad(DVec3::new(-2.0, 0.0, 1.0), 2.0 * DVec3::X, -2.0 * DVec3::Z);
        let wall = quad(DVec3::new(0.0, 0.0, -1.0), 2.0 * DVec3::Y, 2.0 * DVec3::Z);
        let direction = DVec3::new(1.0, -1.0, 0.0).normalize();
        let scene = scene(
            1,
            camera(at + DVec3::Y, at, 1e-8),
            vec![(ground, diffuse(0.5)), (wall, diffuse(0.5))],
            vec![Light::Beam {
                center: -3.0 * direction,
                direction,
                radius: 1.0,
                irradiance: Rgb::ONE,
            }],
        );
        let settings = Settings {
            rule: Rule::Constant,
            max_depth: Some(1),
            ..settings(Integrator::Sppm, 5000, RADIUS)
        };
        let covered = 0.5 + (x * (1.0 - x * x).sqrt() + libm::asin(x)) / PI;
        let expected = 0.5 / PI * 0.5_f64.sqrt() * covered;
        assert_mean(&pass_means(&scene, &settings, 100), expected, 0.06);
    }
}

#[test]
fn p9_a_wall_lit_from_behind_stays_black_and_its_radius_as_it_was() {
    let wall = quad(DVec3::new(0.0, -1.0, 1.0), 2.0 * DVec3::Y, -2.0 * DVec3::Z);
    let scene = scene(
        8,
        camera(-3.0 * DVec3::X, DVec3::ZERO, 30.0),
        vec![(wall, diffuse(0.8))],
        vec![point_light(DVec3::X, 1.0)],
    );
    let settings = settings(Integrator::Ppm, 20_000, 0.5);
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let mut film = Film::new(scene.film);
    let work = mapper.pass(0, &mut film, &mut Phases::default());
    assert!(work.photons_stored > 1000 && !mapper.hit_points().is_empty());
    // Without the test of sides they would count.
    let photons = trace(&scene, settings.seed, 0, settings.photons, None).points;
    let near = |hit: &HitPoint| photons.iter().any(|p| p.distance(hit.point) < 0.5);
    assert!(mapper.hit_points().iter().any(near));
    assert_eq!(film.mean(), Rgb::ZERO);
    assert!(
        mapper
            .statistics()
            .iter()
            .all(|s| s.shrink == 1.0 && s.kept == 0.0)
    );
}

fn hit_point() -> HitPoint {
    HitPoint {
        point: DVec3::ZERO,
        normal: DVec3::Y,
        weight: Rgb::ONE,
        first_radius_squared: 1.0,
        least_radius_squared: 0.0,
        pixel: 0,
        object: 3,
        events: 1,
    }
}

/// Only the photon on the same side of the same object counts, and only if the whole path is short enough.
fn wrong_photons_are_turned_away(
    accept: impl Fn(&HitPoint, &Arrival, Option<u32>) -> bool,
) -> bool {
    let right = Arrival {
        flux: Rgb::ONE,
        normal: DVec3::new(0.6, 0.8, 0.0),
        object: 3,
        events: 2,
    };
    let wrong = [
        Arrival {
            normal: -right.normal,
            ..right
        },
        Arrival {
            normal: DVec3::X,
            ..right
        },
        Arrival { object: 2, ..right },
        Arrival { events: 3, ..right },
    ];
    accept(&hit_point(), &right, Some(4))
        && !wrong
            .iter()
            .any(|photon| accept(&hit_point(), photon, Some(4)))
}

#[test]
fn photons_on_the_wrong_side_or_object_are_turned_away() {
    assert!(wrong_photons_are_turned_away(accepts));
    let any_side = |hit: &HitPoint, photon: &Arrival, _: Option<u32>| hit.object == photon.object;
    let any_object =
        |hit: &HitPoint, photon: &Arrival, _: Option<u32>| hit.normal.dot(photon.normal) > 0.0;
    assert!(!wrong_photons_are_turned_away(any_side));
    assert!(!wrong_photons_are_turned_away(any_object));
}

/// Under an even density, found photons grow with the disc and with the photons emitted; the estimate must not.
fn density_is_all_that_counts(estimate: impl Fn(&Gathered, f64, f64) -> Rgb) -> bool {
    let gathered = |photons: u64| Gathered {
        flux: Rgb::splat(photons as f64),
        bias_flux: Rgb::ZERO,
        photons,
    };
    let one = estimate(&gathered(10), 1.0, 1000.0).x;
    let wider = estimate(&gathered(40), 4.0, 1000.0).x;
    let more = estimate(&gathered(20), 1.0, 2000.0).x;
    (one - wider).abs() < 1e-15 && (one - more).abs() < 1e-15 && (one - 0.01 / PI).abs() < 1e-15
}

#[test]
fn the_estimate_divides_by_the_area_and_the_photons_emitted() {
    assert!(density_is_all_that_counts(|g, r2, n| radiance(
        &hit_point(),
        g,
        r2,
        n
    )));
    assert!(!density_is_all_that_counts(|g, _, n| g.flux / n));
    assert!(!density_is_all_that_counts(|g, r2, _| g.flux / (PI * r2)));
}

/// Light leaves a diffuse point of a sphere with a cosine exactly if it lands evenly on the sphere: mean chord² = 2R².
/// 10⁵ chords with a standard deviation of 2/√3: six errors are 0.022; a uniform hemisphere gives 4/3.
fn lands_evenly(chords_squared: &[f64]) -> bool {
    let n = chords_squared.len() as f64;
    (chords_squared.iter().sum::<f64>() / n - 2.0).abs() < 6.0 * (4.0_f64 / 3.0 / n).sqrt()
}

#[test]
fn diffuse_bounces_follow_the_cosine() {
    let lights = vec![point_light(DVec3::ZERO, 1.0)];
    let photons = trace(&room(diffuse(0.5), Vec::new(), lights), 3, 0, 100_000, None);
    let chords: Vec<f64> = (1..photons.points.len())
        .filter(|&i| photons.arrivals.get(i).events == photons.arrivals.get(i - 1).events + 1)
        .map(|i| photons.points[i].distance_squared(photons.points[i - 1]))
        .collect();
    assert!(chords.len() > 90_000);
    assert!(lands_evenly(&chords));
    let mut stream = Stream::new(1, Purpose::Test, 0);
    let mut leave = |direction: fn([f64; 2]) -> DVec3| -> Vec<f64> {
        (0..100_000)
            .map(|_| libm::pow(2.0 * direction(stream.uniform2()).y.abs(), 2.0))
            .collect()
    };
    assert!(lands_evenly(&leave(|u| cosine_hemisphere(DVec3::Y, u))));
    assert!(!lands_evenly(&leave(uniform_sphere)));
}

/// Flat surfaces, where one number stands for object and side, and others: the photons that count are those that [`accepts`] names.
#[test]
fn gathering_takes_the_photons_that_are_accepted_on_flat_and_other_surfaces() {
    let scene = nadir(0.5);
    for normal in [DVec3::Y, DVec3::new(0.6, 0.8, 0.0)] {
        let mut arrivals = Arrivals::of(&scene);
        let photons = [normal, -normal].into_iter().flat_map(|normal| {
            (0..6).map(move |events| Arrival {
                flux: Rgb::ONE,
                normal,
                object: 0,
                events,
            })
        });
        photons.for_each(|photon| arrivals.push(&photon));
        let within: Vec<u32> = (0..12).collect();
        for (events, depth) in [
            (0, None),
            (0, Some(3)),
            (1, Some(3)),
            (2, Some(3)),
            (4, Some(3)),
        ] {
            let hit_point = HitPoint {
                object: 0,
                events,
                ..hit_point()
            };
            let accepted = arrivals
                .iter()
                .filter(|one| accepts(&hit_point, one, depth));
            let none = Gathered::default();
            let found = gather(&hit_point, &within, &arrivals, depth, none, |_| (1.0, None));
            assert_eq!(found.photons, accepted.count() as u64, "{events} {depth:?}");
        }
    }
}
