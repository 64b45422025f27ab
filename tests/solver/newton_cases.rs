//! The hard cases that are Newton's own: tangents, joints, singular starts, turns, cycles, equal starts.

use super::{crossings, find, planted, settings, test_ray};
use glam::DVec3;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::newton::{NewtonSettings, StartPolicy, System};
use photolathe::geometry::revolution::{Placement, Revolution, exact};
use photolathe::lab::families::{Family, Target};
use photolathe::numeric::work::Work;
use std::f64::consts::TAU;

/// A barrel of radius 5/2 at height 3/2, where a ray in a direction between profile and circle touches it with curvature .87.
#[test]
fn n2_n3_newtons_error_is_its_tolerance_over_the_tilt_and_never_more_than_the_root_of_it() {
    let barrel = Profile::new(vec![Piece::new([
        [1.0, 0.0],
        [3.0, 1.0],
        [3.0, 2.0],
        [1.0, 3.0],
    ])]);
    let barrel = barrel.unwrap();
    let touch = DVec3::new(2.5, 1.5, 0.0);
    let curvature = 0.5 * (12.0 / 9.0 + 1.0 / 2.5);
    for tolerance in [1e-6, 1e-8, 1e-10] {
        let settings = NewtonSettings {
            tolerance,
            ..settings(100, StartPolicy::RandomU)
        };
        let residual = 6.0 * tolerance;
        let blur = (2.0 * residual / curvature).sqrt();
        for tilt in (1..=8).map(|k| libm::exp10(-f64::from(k))).chain([0.0]) {
            let direction = DVec3::new(-tilt, 1.0, 1.0).normalize();
            let ray = Ray::new(touch - 9.0 * direction, direction);
            let truth = exact::crossings(&barrel, &ray);
            let found = find(&barrel, &settings, &ray);
            assert!(found.len() <= 2, "{tolerance} {tilt} {found:?}");
            assert!(!found.is_empty(), "{tolerance} {tilt}");
            for t in found {
                let off = |near: f64| (t - near).abs();
                let error = truth.iter().map(|c| off(c.t)).fold(off(9.0), f64::min);
                let bound = 4.0 * blur.min(residual / tilt);
                assert!(error <= bound, "{tolerance} {tilt} {error} {bound}");
            }
        }
    }
}

/// Residuals within the tolerance leave u on either side of a joint: with strict ends some roots would belong to no piece.
#[test]
fn n27_a_root_at_a_joint_belongs_to_a_piece_in_spite_of_its_rounding() {
    let cup = Revolution::new(Profile::cup(), Placement::identity());
    let target = Target::new(&cup);
    let mut joints = 0;
    for index in 0..120 {
        let ray = target.ray(Family::Joints, &mut Family::Joints.stream(3, index));
        let ray = ray.expect("the cup has joints");
        let met = exact::certified(cup.profile(), &ray);
        let through = |c: &exact::Certified| c.t == 1.0 && c.multiplicity == 1;
        if !met.iter().any(through) {
            continue;
        }
        let found = find(cup.profile(), &settings(100, StartPolicy::RandomU), &ray);
        assert!(
            found.iter().any(|t| (t - 1.0).abs() < 1e-7),
            "{index} {found:?}"
        );
        joints += 1;
    }
    assert!(joints > 30, "{joints}");
}

/// θ counts turns from the start; the crossing does not.
#[test]
fn n40_a_start_a_million_turns_away_gives_the_same_crossing() {
    for index in 0..60 {
        let (piece, origin, direction, root) = planted(index);
        let system = System {
            piece: &piece,
            origin,
            direction,
        };
        let from = |turns: f64| {
            let start = root + DVec3::new(1e-3, 1e-4, 1e-3 + turns * TAU);
            system.solve(start, &settings(1, StartPolicy::RandomU), 1e-7, &mut 0)
        };
        let (here, far) = (from(0.0).unwrap(), from(1e6).unwrap());
        assert!(
            (here.x - far.x).abs() < 1e-5 && (here.y - far.y).abs() < 1e-5,
            "{index}"
        );
        let turns = (far.z - here.z) / TAU;
        assert!((turns - 1e6).abs() < 1e-3, "{index} {turns}");
    }
}

/// Both the axis (r = 0) and a cusp (r′ = h′ = 0) make DF singular: such a start ends, and the next ones find the crossing.
#[test]
fn n39_a_singular_start_is_given_up_and_other_starts_find_the_crossing() {
    let pieces = [
        Piece::new([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]),
        Piece::new([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]),
    ];
    for (piece, u) in pieces.into_iter().zip([0.0, 0.5]) {
        let origin = DVec3::new(0.125, -0.0625, -9.0);
        let direction = DVec3::new(0.0, 0.0625, 1.0);
        let system = System {
            piece: &piece,
            origin,
            direction,
        };
        let mut iterations = 0;
        let start = DVec3::new(9.0, u, 0.0);
        let settings = settings(30, StartPolicy::RandomU);
        assert_eq!(system.solve(start, &settings, 1e-12, &mut iterations), None);
        assert_eq!(iterations, 1);
        let profile = Profile::new(vec![piece]).unwrap();
        let ray = Ray::new(origin, direction);
        let truth: Vec<f64> = exact::crossings(&profile, &ray)
            .iter()
            .map(|c| c.t)
            .collect();
        let found = find(&profile, &settings, &ray);
        assert!(!truth.is_empty() && found.len() == truth.len());
        for (a, b) in found.iter().zip(truth) {
            assert!((a - b).abs() < 1e-8);
        }
    }
}

/// r(u) = 10 + 3 (x³ − 2x + 2) with x = 4u − 2: along the axis Newton's u goes 1/2, 3/4, 1/2, ... for ever.
#[test]
fn n41_a_cycle_ends_at_the_cap_and_another_start_finds_the_crossing() {
    let piece = Piece {
        radius: [4.0, 44.0, -12.0, 28.0],
        height: [0.0, 1.0, 2.0, 3.0],
    };
    let system = System {
        piece: &piece,
        origin: DVec3::new(0.0, 5.0, 10.0),
        direction: DVec3::NEG_Y,
    };
    let settings = settings(30, StartPolicy::RandomU);
    for start in [0.5, 0.75] {
        let mut iterations = 0;
        let x = DVec3::new(3.0, start, 0.0);
        assert_eq!(system.solve(x, &settings, 1e-10, &mut iterations), None);
        assert_eq!(iterations, u64::from(settings.iterations));
    }
    let ray = Ray::new(system.origin, system.direction);
    let profile = Profile::new(vec![piece]).unwrap();
    let found = find(&profile, &settings, &ray);
    assert_eq!(found.len(), 1);
    assert!((found[0] - exact::crossings(&profile, &ray)[0].t).abs() < 1e-8);
}

/// Thirty equal starts are one start: the same root each time, and the nearer one missed.
#[test]
fn n42_equal_starts_give_one_root_and_miss_the_others() {
    let tube = Piece::new([[2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [2.0, 3.0]]);
    let system = System {
        piece: &tube,
        origin: DVec3::new(0.0, 1.5, -9.0),
        direction: DVec3::new(0.0, 0.015625, 1.0),
    };
    let settings = settings(30, StartPolicy::RandomU);
    let start = DVec3::new(10.0, 0.5, 0.0);
    let roots: Vec<_> = (0..30)
        .map(|_| system.solve(start, &settings, 1e-10, &mut 0))
        .collect();
    assert!(roots.iter().all(|root| *root == roots[0]));
    let root = roots[0].unwrap();
    assert!((root.x - 11.0).abs() < 1e-9, "{root}");
}

/// N18: two sheets of one piece at the same place are two crossings, however near in t.
#[test]
fn n18_both_sheets_are_met_where_a_profile_cuts_itself() {
    let lasso = Piece {
        radius: [8.0, 0.0, 0.0, 8.0],
        height: [0.0, 9.0, -6.0, 3.0],
    };
    let lasso = Profile::new(vec![lasso]).unwrap();
    // Where u (1 − u) = 1/16: h = 3/2 twice, r = 13/2.
    let crossing = DVec3::new(6.5, 1.5, 0.0);
    let direction = DVec3::new(-1.0, -0.3, 0.1);
    let ray = Ray::new(crossing - 9.0 * direction, direction);
    let at_it = |t: &&f64| (**t - 9.0).abs() < 1e-6;
    let found = find(&lasso, &settings(200, StartPolicy::RandomU), &ray);
    assert_eq!(found.iter().filter(at_it).count(), 2, "{found:?}");
}

/// The steps of one start for each piece tell which start it was. The first and the third piece are the same wall.
#[test]
fn rays_and_pieces_have_starts_of_their_own() {
    let points = [[1.0, 0.0], [3.0, 1.0], [2.0, 2.0], [2.5, 3.0]];
    let back = [points[3], points[2], points[1], points[0]];
    let wall = [points, back, points].map(Piece::new);
    let steps = |pieces: usize, ray: &Ray| {
        let profile = Profile::new(wall[..pieces].to_vec()).unwrap();
        let mut work = Work::default();
        crossings(&profile, &settings(1, StartPolicy::RandomU), ray, &mut work);
        work.solver_iterations
    };
    let (mut rays, mut pieces) = (0, 0);
    for index in 0..100 {
        let ray = test_ray(index);
        let mut beside = ray;
        beside.origin.x = beside.origin.x.next_up();
        rays += u32::from(steps(1, &ray) != steps(1, &beside));
        pieces += u32::from(steps(3, &ray) - steps(2, &ray) != steps(1, &ray));
    }
    assert!(rays > 50 && pieces > 50, "{rays} {pieces}");
}
