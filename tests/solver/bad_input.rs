//! Case N36 and its like: what is no ray, or hardly one, gets no hit or a finite one, in bounded work, from every solver by every
//! entry.

use super::compare::specimen;
use glam::DVec3;
use photolathe::geometry::bounds::Bounding;
use photolathe::geometry::profile::{Piece, Profile, ProfileError};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::clipping::ClippingSettings;
use photolathe::geometry::revolution::newton::NewtonSettings;
use photolathe::geometry::revolution::{Placement, Revolution, Solver, exact};
use photolathe::geometry::specimens::{Specimen, line};
use photolathe::numeric::work::Work;
use photolathe::scene::file;
use std::path::Path;

/// The least positive number.
const TINY: f64 = f64::from_bits(1);

fn solvers() -> [Solver; 5] {
    [
        Solver::Bernstein,
        Solver::Newton(NewtonSettings::default()),
        Solver::Newton(NewtonSettings::original()),
        Solver::Clipping(ClippingSettings::default()),
        Solver::Exact,
    ]
}

/// The cup in its own frame, placed, behind another volume and behind none.
fn cups() -> Vec<Revolution> {
    let placement = Placement::new(DVec3::new(3.0, -2.0, 5.0), DVec3::ONE, 40.0, 2.5);
    let cup = specimen(Specimen::Cup);
    vec![
        cup.clone().bounded_by(Bounding::None),
        cup.clone().bounded_by(Bounding::Sphere),
        cup,
        Revolution::new(Profile::cup(), placement),
    ]
}

/// NaN and infinities in every place, no direction, and ranges that hold nothing.
fn no_rays() -> Vec<Ray> {
    let fine = Ray::new(DVec3::new(0.5, 5.0, 0.25), DVec3::new(0.01, -1.0, 0.02));
    let mut rays = vec![
        Ray::new(fine.origin, DVec3::ZERO),
        Ray::new(fine.origin, -DVec3::ZERO),
    ];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for axis in DVec3::AXES {
            let with = |v: DVec3| DVec3::select(axis.cmpgt(DVec3::ZERO), DVec3::splat(bad), v);
            rays.push(Ray::new(with(fine.origin), fine.direction));
            rays.push(Ray::new(fine.origin, with(fine.direction)));
        }
        rays.push(Ray::new(DVec3::splat(bad), DVec3::splat(bad)));
    }
    let ranges = [
        (f64::NAN, 9.0),
        (0.0, f64::NAN),
        (f64::NAN, f64::NAN),
        (9.0, 0.0),
        (3.0, 3.0),
        (f64::INFINITY, f64::INFINITY),
        (f64::INFINITY, 0.0),
        (0.0, f64::NEG_INFINITY),
        (TINY, TINY),
        (0.0, -TINY),
    ];
    let ranged = |(t_min, t_max)| Ray {
        t_min,
        t_max,
        ..fine
    };
    rays.extend(ranges.map(ranged));
    rays
}

#[test]
fn n36_rays_that_are_none_meet_nothing_by_any_solver_and_entry_without_work() {
    for shape in cups() {
        for solver in solvers() {
            let mut work = Work::default();
            let rays = no_rays();
            for ray in &rays {
                assert!(!ray.is_valid(), "{ray:?}");
                assert_eq!(shape.nearest(ray, &solver, &mut work), None, "{ray:?}");
                assert_eq!(shape.crossings(ray, &solver, &mut work), [], "{ray:?}");
            }
            let mut found = vec![None; rays.len()];
            shape.nearest_many(&rays, &solver, &mut found, &mut work);
            assert!(found.iter().all(Option::is_none), "{solver:?}");
            let done = work.solver_calls + work.solver_iterations + work.solver_fallbacks;
            assert_eq!(done, 0, "{solver:?} {work:?}");
        }
    }
}

#[test]
fn n36_rays_that_are_none_have_no_exact_crossing_and_no_equation() {
    let placement = Placement::new(DVec3::X, DVec3::Y, 30.0, 0.5);
    let cup = Profile::cup();
    for ray in no_rays() {
        assert_eq!(exact::crossings(&cup, &ray), []);
        assert_eq!(exact::certified(&cup, &ray), []);
        assert_eq!(exact::certified_placed(&cup, &placement, &ray), []);
        assert!(exact::equations(&cup, &ray).is_empty());
    }
}

/// Nearest, all, many, and whether anything is in the way: on all shapes of a scene.
#[test]
fn n36_rays_that_are_none_meet_and_hide_nothing_in_a_scene() {
    for solver in ["bernstein", "newton", "clipping", "exact"] {
        let set = [("render.solver".to_owned(), solver.to_owned())];
        for name in ["cup", "gallery"] {
            let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let scene = file::load(Path::new(&path), &set).expect("the scene is good");
            let mut work = Work::default();
            let rays = no_rays();
            for ray in &rays {
                assert!(scene.intersect(ray, &mut work).is_none(), "{ray:?}");
                assert!(scene.intersect_all(ray, &mut work).is_empty(), "{ray:?}");
                assert!(!scene.occluded(ray, &mut work), "{ray:?}");
            }
            let many = scene.intersect_many(&rays, &mut work);
            assert!(many.iter().all(Option::is_none));
            assert_eq!(work.solver_iterations + work.solver_fallbacks, 0);
        }
    }
}

#[test]
fn n36_control_points_that_are_no_numbers_are_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for place in 0..8 {
            let mut piece = Piece::new([[1.0, 0.0], [2.0, 1.0], [2.0, 2.0], [1.0, 3.0]]);
            if place < 4 {
                piece.radius[place] = bad;
            } else {
                piece.height[place - 4] = bad;
            }
            let refused = ProfileError::NotFinite {
                piece: 0,
                point: place % 4,
            };
            assert_eq!(Profile::new(vec![piece]), Err(refused));
        }
    }
}

/// Directions, origins and ranges with numbers below the normal ones.
fn denormal_rays() -> Vec<Ray> {
    let below = f64::MIN_POSITIVE / 4.0;
    let directions = [
        DVec3::new(TINY, 0.0, 0.0),
        DVec3::new(0.0, -TINY, 0.0),
        DVec3::new(TINY, -TINY, TINY),
        DVec3::new(below, -3.0 * below, TINY),
        DVec3::new(TINY, -1.0, 0.0),
        DVec3::new(1.0, TINY, 0.0),
        DVec3::new(1.0, -TINY, -0.0),
        DVec3::new(0.0, -f64::MIN_POSITIVE, TINY),
    ];
    let origins = [
        DVec3::new(TINY, 1.0, -TINY),
        DVec3::new(-0.0, 5.0, 0.0),
        DVec3::new(-9.0, 1.0, 0.25),
        DVec3::new(0.5, TINY, below),
    ];
    let ranges = [
        (0.0, f64::INFINITY),
        (-TINY, f64::INFINITY),
        (0.0, TINY),
        (f64::NEG_INFINITY, f64::INFINITY),
    ];
    let mut rays = Vec::new();
    for direction in directions {
        for origin in origins {
            rays.extend(ranges.map(|(t_min, t_max)| Ray {
                t_min,
                t_max,
                ..Ray::new(origin, direction)
            }));
        }
    }
    rays
}

/// The cup, a cup of denormal size, and a can of the least size that there is.
fn denormal_shapes() -> [Revolution; 3] {
    let mut small = Profile::cup().pieces().to_vec();
    for piece in &mut small {
        piece.radius = piece.radius.map(|r| r * 1e-310);
        piece.height = piece.height.map(|h| h * 1e-310);
    }
    let can = vec![line([3.0 * TINY, -3.0 * TINY], [3.0 * TINY, 3.0 * TINY])];
    let place = |pieces| {
        let profile = Profile::new(pieces).expect("the pieces join");
        Revolution::new(profile, Placement::identity())
    };
    [specimen(Specimen::Cup), place(small), place(can)]
}

/// Steps for one ray and six pieces: clipping's thousand parts a piece are the most that any solver may take.
const MOST_STEPS: u64 = 6 * 1000;

#[test]
fn n37_denormal_numbers_give_answers_in_bounded_work_by_every_solver_and_entry() {
    let rays = denormal_rays();
    for shape in denormal_shapes() {
        for solver in solvers() {
            let mut work = Work::default();
            let mut alone = Vec::new();
            for ray in &rays {
                let all = shape.crossings(ray, &solver, &mut work);
                assert!(all.len() as u64 <= MOST_STEPS, "{solver:?} {ray:?}");
                let nearest = shape.nearest(ray, &solver, &mut work);
                assert_eq!(nearest.is_some(), !all.is_empty(), "{solver:?} {ray:?}");
                for c in all.iter().chain(&nearest) {
                    assert!(
                        !c.t.is_nan() && (0.0..=1.0).contains(&c.u),
                        "{solver:?} {ray:?}"
                    );
                }
                alone.push(nearest);
            }
            let mut found = vec![None; rays.len()];
            shape.nearest_many(&rays, &solver, &mut found, &mut work);
            assert_eq!(found, alone, "{solver:?}");
            let bound = 3 * rays.len() as u64 * MOST_STEPS;
            assert!(work.solver_iterations <= bound, "{solver:?} {work:?}");
        }
    }
}

#[test]
fn n37_the_default_solver_meets_what_exact_arithmetic_meets_on_denormal_numbers() {
    for shape in denormal_shapes() {
        for ray in denormal_rays() {
            let count = |solver| shape.crossings(&ray, &solver, &mut Work::default()).len();
            assert_eq!(count(Solver::Bernstein), count(Solver::Exact), "{ray:?}");
        }
    }
}
