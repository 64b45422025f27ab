//! Many rays at once, and every instruction set, against one ray with the portable instructions.

use super::aim::rays;
use super::compare::ours;
use clap::ValueEnum as _;
use glam::DVec3;
use photolathe::geometry::hit::Crossing;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::bernstein::{Answer, Prepared, Undecided};
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::geometry::specimens::Specimen;
use photolathe::lab::families::{Family, Target};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::simd::Vectors;
use photolathe::numeric::work::Work;

/// A crossing as bits, so that NaN and −0 count.
fn bits(found: Option<Crossing>) -> Option<(u64, u32, u64)> {
    found.map(|c| (c.t.to_bits(), c.piece, c.u.to_bits()))
}

/// Rays of the families that fit in turn, so that lanes hold unlike neighbours; half of them with a range that may cut their hits
/// off.
fn mixed(shape: &Revolution, count: u64) -> Vec<Ray> {
    let target = Target::new(shape);
    let families: Vec<Family> = (Family::value_variants().iter().copied())
        .filter(|&family| target.fits(family).is_ok())
        .collect();
    let turns = families.len() as u64;
    let ranged = |i: u64| {
        let family = families[(i % turns) as usize];
        let ray = target.ray(family, &mut family.stream(77, i / turns)).ok()?;
        let mut s = Stream::new(77, Purpose::Test, i);
        if s.uniform() < 0.5 {
            return Some(ray);
        }
        let t_min = s.range(-1.0, 12.0);
        Some(Ray {
            t_min,
            t_max: t_min + s.range(0.0, 12.0),
            ..ray
        })
    };
    (0..count).filter_map(ranged).collect()
}

/// Rays for which the batch gives other bits than the ray alone.
fn differences(shape: &Revolution, rays: &[Ray]) -> usize {
    let mut found = vec![None; rays.len()];
    shape.nearest_many(rays, &Solver::Bernstein, &mut found, &mut Work::default());
    let differs =
        |(ray, found): &(&Ray, &Option<Crossing>)| bits(ours(shape, ray)) != bits(**found);
    rays.iter().zip(&found).filter(differs).count()
}

/// A profile of random pieces with folds, loops and points on the axis.
fn random_profile(index: u64, pieces: usize) -> Profile {
    let mut s = Stream::new(78, Purpose::Test, index);
    let mut control = || {
        let value = s.range(-1.0, 3.0);
        if s.uniform() < 0.3 {
            value.round()
        } else {
            value
        }
    };
    let mut last = [control().abs(), control()];
    let mut list = Vec::new();
    for _ in 0..pieces {
        let [a, b, c] = [0; 3].map(|_| [control(), control()]);
        list.push(Piece::new([last, a, b, c]));
        last = c;
    }
    Profile::new(list).expect("each piece starts where the last one ended")
}

#[test]
fn a_batch_gives_the_bits_of_each_ray_alone() {
    let placement = Placement::new(DVec3::new(3.0, -2.0, 5.0), DVec3::ONE, 40.0, 2.5);
    for profile in [Profile::cup(), Profile::hourglass()] {
        let here = Revolution::new(profile.clone(), Placement::identity());
        let rays = mixed(&here, 13_000);
        assert_eq!(differences(&here, &rays), 0);
        let there = Revolution::new(profile, placement);
        let moved = |ray: &Ray| Ray {
            origin: placement.point_to_world(ray.origin),
            direction: placement.scale * (placement.rotation * ray.direction),
            ..*ray
        };
        let rays: Vec<Ray> = rays.iter().take(4_000).map(moved).collect();
        assert_eq!(differences(&there, &rays), 0);
    }
}

#[test]
fn a_batch_on_any_profile_gives_the_bits_of_each_ray_alone() {
    for index in 0..150 {
        // 70 pieces are more than are looked at in lanes.
        let pieces = if index == 0 {
            70
        } else {
            1 + index as usize % 12
        };
        let shape = Revolution::new(random_profile(index, pieces), Placement::identity());
        let rays = mixed(&shape, 130);
        assert_eq!(differences(&shape, &rays), 0, "profile {index}");
    }
}

#[test]
fn a_batch_of_any_length_answers_every_ray() {
    let shape = Revolution::new(Profile::cup(), Placement::identity());
    for count in [0, 1, 7, 8, 9, 255, 256, 257, 700] {
        let rays = mixed(&shape, count);
        assert_eq!(differences(&shape, &rays), 0, "{count} rays");
    }
}

#[test]
fn rays_that_are_none_meet_nothing_in_a_batch_and_disturb_no_other() {
    let shape = Revolution::new(Profile::cup(), Placement::identity());
    let mut rays = mixed(&shape, 400);
    for (i, ray) in rays.iter_mut().enumerate() {
        match i % 11 {
            0 => ray.origin.x = f64::NAN,
            2 => ray.direction = DVec3::ZERO,
            4 => ray.direction.z = f64::INFINITY,
            6 => ray.t_max = ray.t_min,
            8 => ray.t_max = f64::NAN,
            _ => {}
        }
    }
    let mut found = vec![None; rays.len()];
    shape.nearest_many(&rays, &Solver::Bernstein, &mut found, &mut Work::default());
    for (ray, found) in rays.iter().zip(found) {
        assert!(ray.is_valid() || found.is_none(), "{ray:?}");
    }
    assert_eq!(differences(&shape, &rays), 0);
}

fn answers(prepared: &Prepared, rays: &[Ray]) -> Vec<Answer> {
    let (mut found, mut undecided) = (vec![None; rays.len()], Vec::new());
    prepared.nearest_many(rays, &mut found, &mut undecided, &mut Work::default());
    let mut answers: Vec<Answer> = found.into_iter().map(Ok).collect();
    for number in undecided {
        answers[number] = Err(Undecided);
    }
    answers
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    for profile in [Profile::cup(), Profile::hourglass(), random_profile(5, 9)] {
        let shape = Revolution::new(profile.clone(), Placement::identity());
        let rays = mixed(&shape, 13_000);
        let prepared = |vectors| Prepared::new(&profile).with_vectors(vectors);
        let plain = prepared(Vectors::portable());
        let alone = |prepared: &Prepared, ray: &Ray| prepared.nearest(ray, &mut Work::default());
        let expected: Vec<_> = rays
            .iter()
            .map(|ray| alone(&plain, ray).map(bits))
            .collect();
        for vectors in Vectors::all() {
            let prepared = prepared(vectors);
            let together = answers(&prepared, &rays);
            for ((ray, expected), together) in rays.iter().zip(&expected).zip(together) {
                assert_eq!(
                    alone(&prepared, ray).map(bits),
                    *expected,
                    "{vectors:?} {ray:?}"
                );
                assert_eq!(together.map(bits), *expected, "{vectors:?} {ray:?}");
            }
            let all = |prepared: &Prepared, ray| prepared.crossings(ray, &mut Work::default());
            for ray in &rays[..2_000] {
                assert_eq!(all(&prepared, ray), all(&plain, ray), "{vectors:?} {ray:?}");
            }
        }
    }
}

/// Of the rays whose crossing has a bound, those whose error of t or u exceeds it, and all ratios of error of t and bound.
fn beyond_bounds(
    shape: &Revolution,
    family: Family,
    count: u64,
    scale: f64,
) -> (usize, usize, Vec<f64>) {
    let (mut beyond, mut unbounded, mut ratios) = (0, 0, Vec::new());
    for ray in rays(shape, family, count) {
        let truth = shape.nearest(&ray, &Solver::Exact, &mut Work::default());
        let (Some(found), Some(truth)) = (ours(shape, &ray), truth) else {
            continue;
        };
        let bound = shape.certainty(&ray, &found);
        if bound.t == f64::INFINITY {
            unbounded += 1;
            continue;
        }
        let error = (found.t - truth.t).abs();
        beyond += usize::from(error > scale * bound.t);
        // A crossing at a joint may be told of either piece: u goes on through the joint.
        let way = f64::from(found.piece) + found.u - (f64::from(truth.piece) + truth.u);
        beyond += usize::from(way.abs() > scale * bound.u + 2e-16);
        let normals = [found, truth].map(|c| shape.hit(&ray, c).normal);
        let angle = (normals[0] - normals[1]).length();
        beyond += usize::from(angle > scale * bound.normal + 1e-15);
        ratios.push(error / bound.t);
    }
    ratios.sort_by(f64::total_cmp);
    (beyond, unbounded, ratios)
}

/// Both rays were found by the experiment `solvers`: the crossing is told of one piece, but lies on the next, which the ray meets more
/// flatly.
#[test]
fn a_crossing_at_a_joint_has_the_bounds_of_both_pieces() {
    let rays = [
        (
            Specimen::ThinWall(1e-3),
            DVec3::new(-2.9938885980303622, 7.006040829783284, 6.505389219146556),
            DVec3::new(
                0.42767503218701647,
                -0.6117823144203649,
                -0.6654445631352743,
            ),
        ),
        (
            Specimen::Degenerate,
            DVec3::new(6.60628343049639, -14.540757733351704, -23.472353483297223),
            DVec3::new(-0.26740995680670643, 0.5846919244450567, 0.7659159669894415),
        ),
    ];
    for (specimen, origin, direction) in rays {
        let shape = Revolution::new(specimen.profile(), Placement::identity());
        let ray = Ray::new(origin, direction);
        let truth = shape.nearest(&ray, &Solver::Exact, &mut Work::default());
        let (found, truth) = (ours(&shape, &ray).unwrap(), truth.unwrap());
        let bound = shape.certainty(&ray, &found);
        let error = (found.t - truth.t).abs();
        assert!(error <= bound.t, "{specimen:?} {error} {bound:?}");
        assert!(bound.t < 1e-9, "{specimen:?} {bound:?}");
    }
}

#[test]
fn errors_of_t_u_and_normal_stay_within_their_bounds() {
    for profile in [Profile::cup(), Profile::hourglass()] {
        let shape = Revolution::new(profile, Placement::identity());
        for &family in Family::value_variants() {
            let (beyond, unbounded, ratios) = beyond_bounds(&shape, family, 150, 1.0);
            assert_eq!(beyond, 0, "{family:?}");
            let tame = matches!(family, Family::Random | Family::Inside | Family::Meridian);
            assert!(!tame || unbounded <= 3, "{family:?} {unbounded}");
            // Most hits have no error at all; the worst comes within a hundredth of its bound.
            assert!(!tame || ratios.last() > Some(&1e-2), "{family:?}");
        }
        // Bounds a hundred times as narrow would not hold.
        assert!(beyond_bounds(&shape, Family::Random, 300, 0.01).0 > 0);
    }
}

/// Where such a ray would meet the plane of a flat piece, squares overflow: once that sent every ray to exact arithmetic.
#[test]
fn rays_of_any_slope_pass_flat_pieces_without_exact_arithmetic() {
    for specimen in [Specimen::Hourglass, Specimen::Degenerate] {
        let shape = Revolution::new(specimen.profile(), Placement::identity());
        let prepared = Prepared::new(shape.profile());
        for exponent in [-3, -100, -155, -200, -300] {
            for (index, ray) in rays(&shape, Family::Horizontal, 40).iter().enumerate() {
                let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
                let slope = DVec3::Y * sign * libm::exp10(f64::from(exponent));
                let ray = Ray::new(ray.origin, ray.direction + slope);
                let answer = prepared.nearest(&ray, &mut Work::default());
                let found = answer.expect("an answer of the filter");
                let truth = shape.nearest(&ray, &Solver::Exact, &mut Work::default());
                assert_eq!(found.is_some(), truth.is_some(), "{specimen:?} {ray:?}");
            }
        }
    }
}

/// Every quantity scales by powers of two: bounds of t are in units of the ray's t, those of u and of the normal have none.
#[test]
fn bounds_scale_with_the_surface_and_with_the_direction() {
    let cup = Profile::cup();
    let large = |piece: &Piece| Piece {
        radius: piece.radius.map(|r| 1024.0 * r),
        height: piece.height.map(|h| 1024.0 * h),
    };
    let large = Profile::new(cup.pieces().iter().map(large).collect()).unwrap();
    let [cup, large] = [cup, large].map(|p| Revolution::new(p, Placement::identity()));
    let mut bounded = 0;
    for ray in rays(&cup, Family::Random, 100) {
        let Some(found) = ours(&cup, &ray) else {
            continue;
        };
        let bound = cup.certainty(&ray, &found);
        let quick = Ray::new(ray.origin, 8.0 * ray.direction);
        let there = Ray::new(1024.0 * ray.origin, ray.direction);
        for (shape, ray, unit) in [(&cup, quick, 0.125), (&large, there, 1024.0)] {
            let t = found.t * unit;
            let scaled = shape.certainty(&ray, &Crossing { t, ..found });
            assert_eq!(scaled.t, bound.t * unit, "{unit} {ray:?}");
            assert_eq!((scaled.u, scaled.normal), (bound.u, bound.normal));
        }
        bounded += u32::from(bound.t < f64::INFINITY);
    }
    assert!(bounded > 50, "{bounded}");
}

/// The bound is no guess of the rounding: it is of the crossing that is asked about, however far that is off.
#[test]
fn a_crossing_that_was_moved_off_is_within_its_own_bounds() {
    let cup = Revolution::new(Profile::cup(), Placement::identity());
    let mut bounded = 0;
    for ray in rays(&cup, Family::Random, 200) {
        let Some(found) = ours(&cup, &ray) else {
            continue;
        };
        for off in [1e-3, -1e-3, 1e-6, -1e-6] {
            let t = found.t + off;
            let bound = cup.certainty(&ray, &Crossing { t, ..found });
            assert!(bound.t >= off.abs(), "{off} {bound:?} {ray:?}");
            bounded += u32::from(bound.t < 9.0 * off.abs());
        }
    }
    assert!(bounded > 200, "{bounded}");
}

/// A ray through the upper rim of a drum: whether the crossing is told of the wall or of the lid, the true one may be on the other.
#[test]
fn the_bound_of_a_normal_at_a_sharp_edge_takes_in_the_edge_from_both_sides() {
    let straight = |a: [f64; 2], b: [f64; 2]| {
        let at = |w: f64| [0, 1].map(|k| a[k] + w * (b[k] - a[k]));
        Piece::new([a, at(1.0 / 3.0), at(2.0 / 3.0), b])
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let drum = corners.windows(2).map(|pair| straight(pair[0], pair[1]));
    let drum = Profile::new(drum.collect()).unwrap();
    let drum = Revolution::new(drum, Placement::identity());
    let direction = DVec3::new(-1.0, -1.0, 0.2);
    let ray = Ray::new(DVec3::new(1.0, 1.0, 0.0) - 2.0 * direction, direction);
    for (piece, u) in [(1, 1.0), (2, 0.0)] {
        let bound = drum.certainty(&ray, &Crossing { t: 2.0, piece, u });
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(
            (quarter..quarter + 1e-9).contains(&bound.normal),
            "{bound:?}"
        );
    }
}

/// The first and the third piece are one wall: they meet every ray at the same t, and the one counts that the ray's order names first.
#[test]
fn of_coincident_pieces_a_batch_names_the_one_that_a_single_ray_does() {
    let points = [[1.0, 0.0], [3.0, 1.0], [2.0, 2.0], [2.5, 3.0]];
    let back = [points[3], points[2], points[1], points[0]];
    let profile = Profile::new([points, back, points].map(Piece::new).to_vec()).unwrap();
    let shape = Revolution::new(profile, Placement::identity());
    for family in [Family::Random, Family::Inside] {
        let rays = rays(&shape, family, 500);
        let mut found = vec![None; rays.len()];
        shape.nearest_many(&rays, &Solver::Bernstein, &mut found, &mut Work::default());
        for (ray, found) in rays.iter().zip(found) {
            assert_eq!(bits(found), bits(ours(&shape, ray)), "{ray:?}");
        }
    }
}
