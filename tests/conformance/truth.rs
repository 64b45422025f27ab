//! The truth of a suite against closed forms and against itself.

use glam::DVec3;
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, exact};
use photolathe::geometry::specimens::Specimen;
use photolathe::lab::families::Family;
use photolathe::lab::suite::{Suite, all_crossings};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::scene::{Scene, file};
use std::path::Path;

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(name);
    file::load(&path, &[]).expect("the scene is valid")
}

fn random(index: u64) -> Ray {
    let mut s = Stream::new(3, Purpose::Test, index);
    let vector =
        |s: &mut Stream, size: f64| DVec3::from_array([0; 3].map(|_| s.range(-size, size)));
    Ray::new(vector(&mut s, 6.0), vector(&mut s, 1.0))
}

#[test]
fn brackets_are_neighbours_and_hold_t() {
    let profile = Profile::cup();
    let mut met = 0;
    for index in 0..400 {
        for certain in exact::certified(&profile, &random(index)) {
            let (low, high) = (certain.t_low, certain.t_high);
            assert!(high == low || high == low.next_up());
            assert!((low..=high).contains(&certain.t));
            met += 1;
        }
    }
    assert!(met > 60, "{met}");
    // The paraboloid's point (0, 3/4, 3/2) at t = 4, a float.
    let bowl = photolathe::geometry::profile::Piece {
        radius: [0.0, 1.0, 2.0, 3.0],
        height: [0.0, 0.0, 1.0, 3.0],
    };
    let bowl = Profile::new(vec![bowl]).expect("one piece");
    let direction = DVec3::new(0.0, -0.5, 0.25);
    let ray = Ray::new(DVec3::new(0.0, 0.75, 1.5) - 4.0 * direction, direction);
    let found = exact::certified(&bowl, &ray);
    assert!(
        found
            .iter()
            .any(|certain| (certain.t_low, certain.t_high) == (4.0, 4.0))
    );
}

/// Where the change of frame is exact in floats, a placed surface has the crossings of the profile with the changed ray.
#[test]
fn a_placed_surface_has_the_crossings_of_its_own_frame() {
    let profile = Profile::cup();
    let placements = [
        Placement::identity(),
        Placement::new(DVec3::new(4.0, -8.0, 0.5), DVec3::Z, 90.0, 2.0),
        Placement::new(DVec3::ZERO, DVec3::X, 180.0, 0.25),
    ];
    for placement in placements {
        for index in 0..100 {
            // Coordinates of 20 bits: moved and scaled without rounding.
            let round = |v: DVec3| (v * 1048576.0).round() / 1048576.0;
            let ray = random(index);
            let world = Ray::new(
                round(ray.origin * placement.scale + placement.translate),
                round(ray.direction),
            );
            let local = placement.ray_to_local(&world);
            let placed = exact::certified_placed(&profile, &placement, &world);
            assert_eq!(placed, exact::certified(&profile, &local), "{index}");
        }
    }
}

/// 1.1 − 0.1 is 1 in floats, so that a ray there seems to touch a wall of radius 1; the stored numbers are more than 1 apart.
#[test]
fn a_rounded_frame_would_change_answers_that_an_exact_one_keeps() {
    let profile = Specimen::ThinWall(1e-3).profile();
    let placement = Placement {
        translate: DVec3::new(0.1, 0.0, 0.0),
        ..Placement::identity()
    };
    let at = |x: f64| Ray::new(DVec3::new(x, 0.25, -5.0), DVec3::Z);
    let met = |x: f64| exact::certified_placed(&profile, &placement, &at(x)).len();
    assert_eq!((met(1.1), met(1.1_f64.next_down())), (0, 2));
    let rounded = placement.ray_to_local(&at(1.1));
    assert_eq!(exact::certified(&profile, &rounded).len(), 1);
}

#[test]
fn the_truth_of_a_whole_scene_is_what_intersect_finds() {
    for name in ["cup.toml", "hourglass.toml", "gallery.toml"] {
        let scene = scene(name);
        let suite = Suite::new(&scene, 2).expect("a surface of revolution");
        let mut hits = 0;
        for index in 0..100 {
            let ray = suite.ray(Family::Inside, index).expect("it fits");
            let found = scene.intersect(&ray, &mut Default::default());
            let truth = all_crossings(&scene, &ray);
            assert_eq!(
                found.map(|hit| hit.object),
                truth.first().map(|met| met.object),
                "{name} {index}"
            );
            if let (Some(hit), Some(met)) = (found, truth.first()) {
                assert!(
                    (hit.t - met.t).abs() < 1e-12 * (1.0 + met.t),
                    "{name} {index}"
                );
                assert_eq!(hit.piece, met.piece);
                hits += 1;
            }
        }
        assert!(hits > 60, "{name} {hits}");
    }
}

#[test]
fn margins_tell_hard_rays_from_easy_ones() {
    let scene = scene("hard/cup.toml");
    let suite = Suite::new(&scene, 1).expect("a surface of revolution");
    let share = |family| {
        let truths = (0..60).map(|index| suite.truth(&suite.ray(family, index).expect("it fits")));
        truths
            .filter(|truth| truth.margin <= 1e-5 * truth.scale)
            .count()
    };
    assert!(share(Family::Random) <= 1);
    assert!(share(Family::Tangents) > 15);
    // A ray one unit above the rim's plane has nothing near; the axis is as firm as any.
    let firm = suite.truth(&Ray::new(DVec3::new(-9.0, 3.2, 0.0), DVec3::X));
    assert!(firm.nearest.is_none() && firm.margin == f64::INFINITY);
    let axis = suite.truth(&Ray::new(DVec3::new(0.0, 5.0, 0.0), -DVec3::Y));
    assert!(axis.margin == f64::INFINITY && axis.second_t == Some(4.96));
    // Level, 1e-7 below the top of the rim (2.15): it must vanish when moved by that, and not by a tenth.
    let graze = suite.truth(&Ray::new(DVec3::new(-9.0, 2.15 - 1e-7, 0.0), DVec3::X));
    assert!(graze.nearest.is_some());
    assert!((1e-7..4e-7).contains(&graze.margin), "{}", graze.margin);
    // Past the foot at the distance of rounding, then well inside the cup.
    let past = suite.truth(&Ray::new(
        DVec3::new(-4.686934983076962, -5.787980368399172, -4.125688295581435),
        DVec3::new(0.5833552988814875, 0.7657771346765442, 0.2707064374437229),
    ));
    assert!(past.margin < 1e-13, "{}", past.margin);
}
