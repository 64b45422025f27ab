//! The other methods: the original as it was coded, and Bezier clipping. What they promise, and where they must fail.

use super::{crossings, find, settings, test_ray};
use glam::DVec3;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::clipping::{self, ClippingSettings};
use photolathe::geometry::revolution::newton::{NewtonSettings, StartPolicy};
use photolathe::geometry::revolution::{Solver, exact};
use photolathe::numeric::work::Work;
use photolathe::scene::file;
use std::path::Path;

/// A t farther than this from the true one is another sheet.
const SAME_SHEET: f64 = 1e-5;

/// Misses, phantoms and wrong sheets among the nearest crossings of a range of rays.
fn failures(nearest: impl Fn(&Ray) -> Option<f64>, rays: impl Iterator<Item = Ray>) -> [usize; 3] {
    let cup = Profile::cup();
    let mut failed = [0; 3];
    for ray in rays {
        let truth = exact::crossings(&cup, &ray).first().map(|c| c.t);
        match (nearest(&ray), truth) {
            (None, Some(_)) => failed[0] += 1,
            (Some(_), None) => failed[1] += 1,
            (Some(a), Some(b)) => failed[2] += usize::from((a - b).abs() > SAME_SHEET),
            (None, None) => {}
        }
    }
    failed
}

fn by_newton(settings: NewtonSettings) -> impl Fn(&Ray) -> Option<f64> {
    move |ray| find(&Profile::cup(), &settings, ray).first().copied()
}

/// Of 3000 rays (2300 hits or so) 30 starts fail on about 2 and the original on about 11: seeds are fixed, so nothing is left to
/// chance.
#[test]
fn the_original_as_coded_fails_several_times_as_often_as_its_description() {
    let total = |settings| {
        let [miss, phantom, wrong] = failures(by_newton(settings), (0..3000).map(test_ray));
        assert_eq!(phantom, 0);
        miss + wrong
    };
    let described = total(settings(30, StartPolicy::RandomU));
    let coded = total(NewtonSettings::original());
    assert!(coded >= 6 && coded >= 2 * described, "{coded} {described}");
}

#[test]
fn more_starts_of_the_original_never_move_the_first_crossing_away() {
    let cup = Profile::cup();
    for index in 0..100 {
        let ray = test_ray(index);
        let mut nearest = f64::INFINITY;
        for starts in [1, 2, 3, 10, 35, 70] {
            let more = NewtonSettings {
                starts,
                ..NewtonSettings::original()
            };
            let first = find(&cup, &more, &ray).first().copied();
            let first = first.unwrap_or(f64::INFINITY);
            assert!(first <= nearest, "ray {index}");
            nearest = first;
        }
    }
}

/// Work per ray of the same starts: damping leaves a linear law, so 10⁻¹⁰ takes several times the steps.
#[test]
fn the_default_takes_full_steps() {
    let cup = Profile::cup();
    let steps = |damping: f64| {
        let mut work = Work::default();
        let damped = NewtonSettings {
            damping,
            iterations: 100,
            ..settings(5, StartPolicy::SolveHeight)
        };
        for index in 0..200 {
            crossings(&cup, &damped, &test_ray(index), &mut work);
        }
        work.solver_iterations
    };
    let ours = steps(NewtonSettings::default().damping);
    assert_eq!(ours, steps(1.0));
    assert!(5 * ours < 3 * steps(0.7), "{ours} {}", steps(0.7));
}

fn by_clipping(ray: &Ray) -> Vec<f64> {
    let settings = ClippingSettings::default();
    let found = clipping::crossings(&Profile::cup(), &settings, ray, &mut Work::default());
    found.iter().map(|c| c.t).collect()
}

/// The rounding of a clip cuts off a simple root of about one ray in 5000: the method is not certain.
#[test]
fn clipping_finds_the_crossings_of_all_but_a_few_ordinary_rays() {
    let cup = Profile::cup();
    let (mut count, mut different) = (0, 0);
    for index in 0..4000 {
        let ray = test_ray(index);
        let (found, truth) = (by_clipping(&ray), exact::crossings(&cup, &ray));
        different += usize::from(found.len() != truth.len());
        for a in &found {
            assert!(truth.iter().any(|b| (a - b.t).abs() < 1e-7), "ray {index}");
        }
        count += found.len();
    }
    assert!(
        count > 5000 && (1..=8).contains(&different),
        "{count} {different}"
    );
}

/// Roots of h(u) = 3u and r(u) = 8 (u − ¼)(u − ½)(u − ¾) + c against a ray parallel to the axis at distance c.
#[test]
fn clipping_finds_planted_roots_near_the_ends_and_in_the_middle() {
    let cubic = |roots: [f64; 3]| {
        let [a, b, c] = roots;
        let (s, p, q) = (a + b + c, a * b + b * c + c * a, a * b * c);
        // 8 (u³ − s u² + p u − q) + 5 in Bernstein form.
        [
            5.0 - 8.0 * q,
            5.0 + 8.0 * (p / 3.0 - q),
            5.0 + 8.0 * ((2.0 * p - s) / 3.0 - q),
            5.0 + 8.0 * (1.0 - s + p - q),
        ]
    };
    for planted in [
        [0.25, 0.5, 0.75],
        [1e-6, 0.5, 1.0 - 1e-6],
        [0.3, 0.3001, 0.9],
    ] {
        let profile = Profile::new(vec![Piece {
            radius: cubic(planted),
            height: [0.0, 1.0, 2.0, 3.0],
        }])
        .expect("one piece");
        let ray = Ray::new(DVec3::new(5.0, -1.0, 0.0), DVec3::Y);
        let settings = ClippingSettings::default();
        let found = clipping::crossings(&profile, &settings, &ray, &mut Work::default());
        assert_eq!(found.len(), 3, "{planted:?} {found:?}");
        for (c, u) in found.iter().zip(planted) {
            assert!((c.u - u).abs() < 1e-9, "{planted:?}");
        }
    }
}

#[test]
fn clipping_misses_every_level_ray_and_loses_nearly_level_ones() {
    let level = |dy: f64| {
        move |index: u64| {
            let ray = test_ray(index);
            let origin = DVec3::new(ray.origin.x, 0.2 + 0.0018 * index as f64, ray.origin.z);
            let flat = DVec3::new(-ray.origin.x, 0.0, 0.3 - ray.origin.z).normalize();
            Ray::new(origin, flat + dy * DVec3::Y)
        }
    };
    let nearest = |ray: &Ray| by_clipping(ray).first().copied();
    let [miss, phantom, wrong] = failures(nearest, (0..1000).map(level(0.0)));
    assert!(
        miss > 700 && phantom == 0 && wrong == 0,
        "{miss} {phantom} {wrong}"
    );
    let hair = failures(nearest, (0..1000).map(level(1e-10)));
    assert!(hair.iter().sum::<usize>() > 100, "{hair:?}");
    let steep = failures(nearest, (0..1000).map(level(1e-2)));
    assert_eq!(steep, [0; 3]);
}

#[test]
fn clipping_ends_on_rays_that_are_none_and_on_tolerances_without_sense() {
    let bad = [
        Ray::new(DVec3::NAN, DVec3::Y),
        Ray::new(DVec3::ZERO, DVec3::ZERO),
        Ray::new(DVec3::splat(1e308), DVec3::splat(1e308)),
        Ray::new(DVec3::new(-9.0, 1.0, 0.0), DVec3::new(1.0, 5e-324, 0.0)),
    ];
    let disc = Profile::new(vec![Piece::new([
        [0.0, 1.0],
        [1.0, 1.0],
        [2.0, 1.0],
        [3.0, 1.0],
    ])]);
    let within = Ray::new(DVec3::new(-9.0, 1.0, 0.0), DVec3::X);
    for tolerance in [1e-300, 1e-12, 1.0, 1e60] {
        let settings = ClippingSettings { tolerance };
        let run = |profile: &Profile, ray: &Ray| {
            clipping::crossings(profile, &settings, ray, &mut Work::default())
        };
        for ray in &bad {
            assert!(run(&Profile::cup(), ray).iter().all(|c| c.t.is_finite()));
        }
        assert!(disc.iter().all(|disc| run(disc, &within).is_empty()));
        assert!(run(&Profile::cup(), &test_ray(1)).len() < 20);
    }
}

#[test]
fn overrides_choose_solver_policy_tolerance_and_volume() {
    let scene = |pairs: &[(&str, &str)]| {
        let pairs: Vec<(String, String)> = (pairs.iter())
            .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
            .collect();
        file::load(Path::new("scenes/cup.toml"), &pairs).expect("the scene is good")
    };
    let original = scene(&[("render.solver", "newton"), ("solver.policy", "original")]);
    assert_eq!(original.solver, Solver::Newton(NewtonSettings::original()));
    let clipped = scene(&[("render.solver", "clipping"), ("solver.tolerance", "1e-9")]);
    assert_eq!(
        clipped.solver,
        Solver::Clipping(ClippingSettings { tolerance: 1e-9 })
    );
    let tests = |name: &str| {
        let bounded = scene(&[("solver.bounds", name)]);
        let mut work = Work::default();
        let down = Ray::new(DVec3::new(0.5, 50.0, 0.5), DVec3::NEG_Y);
        for object in &bounded.objects {
            object.shape.nearest(&down, &bounded.solver, &mut work);
        }
        work.bounds_tests
    };
    assert_eq!(["none", "sphere", "pieces"].map(tests), [0, 1, 6]);
}
