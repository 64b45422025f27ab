//! Exact arithmetic: roots against planted ones, and the two routes (Descartes with branches, Sturm with Tarski's queries) against
//! each other on rays of every family.

#[path = "solver/aim.rs"]
mod aim;
#[path = "solver/profiles.rs"]
mod profiles;

use aim::{all_rays, rays};
use glam::DVec3;
use num_bigint::BigInt;
use num_traits::Zero;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::exact::{Certified, Tally, certified, equations, recount};
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::lab::families::Family;
use photolathe::numeric::exact::{Branches, Dyadic, Polynomial, Root, Sturm};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;
use profiles::random_profile;
use std::rc::Rc;

/// Number of distinct roots in [0, 1] by Sturm's theorem.
fn sturm_count(polynomial: &Polynomial) -> usize {
    let zero = Dyadic::new(BigInt::zero(), 0);
    let one = Dyadic::new(BigInt::from(1), 0);
    let ends = [&zero, &one].map(|at| usize::from(is_root(polynomial, at)));
    // Moved outward until the ends are no roots: no root of a polynomial that is zero at an end lies within 2^-400 of it here.
    let near = [&zero, &one].map(|at| is_root(polynomial, at));
    let hair = |at: &Dyadic, sign: i32| at.plus(&Dyadic::new(BigInt::from(sign), -400));
    let low = if near[0] { hair(&zero, 1) } else { zero };
    let high = if near[1] { hair(&one, -1) } else { one };
    ends[0] + ends[1] + Sturm::new(polynomial).between(&low, &high) as usize
}

fn is_root(polynomial: &Polynomial, at: &Dyadic) -> bool {
    let bits = (-at.exponent).max(0) as u64;
    polynomial
        .scaled_value(&at.at(-(bits as i64)), bits)
        .is_zero()
}

/// Sturm's count inside a root's isolating interval; an exact root is checked by its value.
fn sturm_isolates(polynomial: &Polynomial, root: &Root) -> bool {
    let [low, high] = root.interval();
    if low == high {
        return is_root(polynomial, &low);
    }
    // The ends may be other roots, known exactly.
    let ends = [&low, &high].map(|at| is_root(polynomial, at));
    if ends.contains(&true) {
        return true;
    }
    Sturm::new(polynomial).between(&low, &high) == 1
}

fn product(factors: &[Vec<i64>]) -> Polynomial {
    let mut result = vec![BigInt::from(1)];
    for factor in factors {
        let mut next = vec![BigInt::zero(); result.len() + factor.len() - 1];
        for (i, a) in result.iter().enumerate() {
            for (j, &b) in factor.iter().enumerate() {
                next[i + j] += a * b;
            }
        }
        result = next;
    }
    Polynomial::new(result)
}

/// Random products of linear factors (some repeated, some a hair apart, some outside) and of a factor without real roots.
#[test]
fn descartes_and_sturm_agree_on_random_and_clustered_polynomials() {
    for index in 0..3000 {
        let mut stream = Stream::new(8, Purpose::Test, index);
        let mut whole = |low: f64, high: f64| stream.range(low, high + 1.0).floor() as i64;
        let scale = [3, 7, 64, 1 << 20, 1_000_003][whole(0.0, 4.0) as usize];
        let mut numerators = vec![whole(-1.0, scale as f64 + 1.0)];
        for _ in 0..whole(0.0, 5.0) {
            let last = numerators[numerators.len() - 1];
            numerators.push(match whole(0.0, 3.0) {
                0 => last,
                1 => last + 1,
                _ => whole(-1.0, scale as f64 + 1.0),
            });
        }
        let mut factors: Vec<Vec<i64>> = numerators.iter().map(|n| vec![-n, scale]).collect();
        if whole(0.0, 2.0) == 0 {
            factors.push(vec![whole(1.0, 9.0), 1, 3]);
        }
        let polynomial = product(&factors);
        numerators.retain(|n| (0..=scale).contains(n));
        let total = numerators.len() as u32;
        numerators.sort_unstable();
        numerators.dedup();
        let mut roots = polynomial.roots();
        assert_eq!(roots.len(), numerators.len(), "polynomial {index}");
        assert_eq!(roots.len(), sturm_count(&polynomial), "polynomial {index}");
        assert_eq!(roots.iter().map(|r| r.multiplicity()).sum::<u32>(), total);
        let mut values: Vec<f64> = roots.iter_mut().map(|r| r.to_f64()).collect();
        values.sort_by(f64::total_cmp);
        for (value, numerator) in values.iter().zip(numerators) {
            assert!((value - numerator as f64 / scale as f64).abs() < 1e-15);
        }
    }
}

/// √½ is a root of 2u² − 1; the other polynomial has its root 10⁻⁶⁰ away.
#[test]
fn the_sign_of_a_polynomial_at_a_root_is_exact() {
    let mut root = product(&[vec![-1, 0, 2]]).roots().remove(0);
    let shared = product(&[vec![-1, 0, 2], vec![5, 1, 1]]);
    assert_eq!(root.sign_of(&shared), 0);
    let big = BigInt::from(10).pow(60);
    let near = |shift: i32| Polynomial::new(vec![-&big + shift, BigInt::zero(), &big * 2]);
    assert_eq!(root.sign_of(&near(1)), 1);
    assert_eq!(root.sign_of(&near(-1)), -1);
    assert!((root.value_of(&near(1)).to_f64() - 1.0).abs() < 1e-15);
}

#[test]
fn quotients_and_roots_of_dyadic_numbers_round_to_nearest() {
    for index in 0..5000 {
        let mut stream = Stream::new(9, Purpose::Test, index);
        let a = stream.range(-1.0, 1.0) * libm::scalbn(1.0, (index % 200) as i32 - 100);
        let b = stream.range(0.5, 1.0);
        let (x, y) = (Dyadic::from_f64(a), Dyadic::from_f64(b));
        assert_eq!(x.over(&y), a / b);
        assert_eq!(x.to_f64(), a);
        assert_eq!(x.times(&x).sqrt().to_f64(), a.abs());
        assert_eq!(x.plus(&y).to_f64(), a + b);
        assert_eq!(y.sqrt().to_f64(), b.sqrt());
    }
}

/// w² = a s against the expanded polynomial: same roots, same multiplicities, whichever branches hold them.
#[test]
fn branches_have_the_roots_of_the_expanded_polynomial() {
    let mut parted = 0;
    for index in 0..400 {
        let mut stream = Stream::new(10, Purpose::Test, index);
        let mut whole = |size: f64| BigInt::from(stream.range(-size, size).round() as i64);
        let cubic = Polynomial::new((0..4).map(|_| whole(9.0) << 12).collect());
        let square = Polynomial::new((0..7).map(|_| whole(9.0)).collect());
        let factor = BigInt::from(index % 7 + 1);
        let pair = Rc::new(Branches::new(cubic, square, factor));
        let Some(mut found) = pair.roots() else {
            continue;
        };
        let mut expected = pair.polynomial().roots();
        parted += found.iter().filter(|r| r.branch().is_some()).count();
        let list = |roots: &mut Vec<Root>| {
            let mut list: Vec<(f64, u32)> = roots
                .iter_mut()
                .map(|r| (r.to_f64(), r.multiplicity()))
                .collect();
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
            list
        };
        let (found, expected) = (list(&mut found), list(&mut expected));
        assert_eq!(found.len(), expected.len(), "{index}");
        for (a, b) in found.iter().zip(&expected) {
            assert!((a.0 - b.0).abs() < 1e-15 && a.1 == b.1, "{index}");
        }
    }
    assert!(parted > 100, "{parted}");
}

fn tally(found: &[Certified], piece: u32) -> Tally {
    let of_piece = found.iter().filter(|c| c.piece == piece);
    Tally {
        piece,
        crossings: of_piece.clone().count() as u32,
        multiplicity: of_piece.map(|c| c.multiplicity).sum(),
    }
}

/// Asserts that both routes see the same crossings of every piece.
#[track_caller]
fn routes_agree(profile: &Profile, ray: &Ray, name: &str) -> usize {
    let found = certified(profile, ray);
    for expected in recount(profile, ray) {
        assert_eq!(
            tally(&found, expected.piece),
            expected,
            "{name}: {ray:?} {profile:?}"
        );
    }
    for pair in found.windows(2) {
        assert!(pair[0].t_low <= pair[1].t_low, "{name}");
    }
    for c in &found {
        assert!(c.t_low <= c.t && c.t <= c.t_high, "{name}");
        assert!(
            c.t_high == c.t_low || c.t_high == c.t_low.next_up(),
            "{name}"
        );
    }
    found.len()
}

fn in_place(profile: &Profile) -> Revolution {
    Revolution::new(profile.clone(), Placement::identity())
}

/// The ray, now and then with a range that ends at one of its crossings.
fn ranged(profile: &Profile, mut ray: Ray, index: u64) -> Ray {
    if index.is_multiple_of(3) {
        let whole = Ray {
            t_min: f64::NEG_INFINITY,
            ..ray
        };
        let found = certified(profile, &whole);
        if let Some(c) = found.get(index as usize % found.len().max(1)) {
            (ray.t_min, ray.t_max) = if index.is_multiple_of(2) {
                (c.t_low, f64::INFINITY)
            } else {
                (f64::NEG_INFINITY, c.t_high)
            };
        }
    }
    ray
}

#[test]
fn both_routes_count_the_same_crossings_of_every_family() {
    let mut crossings = 0;
    for profile in [Profile::cup(), Profile::hourglass()] {
        for (index, (family, ray)) in (0..).zip(all_rays(&in_place(&profile), 8)) {
            let ray = ranged(&profile, ray, index);
            crossings += routes_agree(&profile, &ray, &format!("{family:?} {index}"));
        }
    }
    assert!(crossings > 400, "{crossings}");
}

#[test]
fn both_routes_count_the_same_crossings_of_random_profiles() {
    let mut crossings = 0;
    for index in 0..20 {
        let profile = random_profile(index);
        for (family, ray) in all_rays(&in_place(&profile), 1) {
            let ray = ranged(&profile, ray, index);
            crossings += routes_agree(&profile, &ray, &format!("{family:?} {index}"));
        }
    }
    assert!(crossings > 300, "{crossings}");
}

/// Rays between points of a coarse grid on profiles of coarse control points: axis touches, joints, tangencies, rays within a piece.
#[test]
fn both_routes_count_the_same_crossings_of_degenerate_rays() {
    let (mut crossings, mut multiple) = (0, 0);
    for index in 0..600 {
        let profile = random_profile(index);
        let mut s = Stream::new(22, Purpose::Test, index);
        let mut grid = || DVec3::from_array([0; 3].map(|_| s.range(-8.0, 8.0).round() / 4.0));
        let pieces = profile.pieces();
        let joint = pieces[index as usize % pieces.len()].point(3);
        let from = DVec3::new(0.0, joint[1], joint[0]);
        let origin = if index % 2 == 0 {
            grid()
        } else {
            from - grid()
        };
        let mut ray = Ray::new(origin, from - origin);
        if index % 4 > 1 {
            ray.direction = grid();
        }
        match index % 5 {
            0 => ray.direction.y = 0.0,
            1 => (ray.origin.x, ray.direction.x) = (0.0, 0.0),
            2 => (ray.direction.x, ray.direction.z) = (0.0, 0.0),
            _ => {}
        }
        ray.t_min = f64::NEG_INFINITY;
        crossings += routes_agree(&profile, &ray, &format!("{index}"));
        multiple += certified(&profile, &ray)
            .iter()
            .filter(|c| c.multiplicity > 1)
            .count();
    }
    assert!(crossings > 800 && multiple > 30, "{crossings} {multiple}");
}

#[test]
fn both_routes_agree_on_rays_that_are_level_but_for_a_hair() {
    for (index, power) in (1..=20).chain([50, 100, 200, 300, 308]).enumerate() {
        for (name, profile) in [
            ("cup", Profile::cup()),
            ("random", random_profile(index as u64)),
        ] {
            for family in [Family::Horizontal, Family::HorizontalJoints] {
                let mut ray = rays(&in_place(&profile), family, index as u64 + 1)[index];
                ray.direction.y = libm::exp10(-f64::from(power));
                routes_agree(&profile, &ray, &format!("{name} {family:?} 1e-{power}"));
            }
        }
    }
}

/// Each isolating interval of the first route holds exactly one root by the second.
#[test]
fn sturm_counts_one_root_in_every_isolating_interval() {
    let mut intervals = 0;
    for index in 0..20 {
        let profile = if index % 2 == 0 {
            Profile::cup()
        } else {
            random_profile(index)
        };
        // Roots 1e-300 apart would need other borders in `sturm_count`.
        let apart = |(family, _): &(Family, Ray)| *family != Family::NearHorizontal;
        for (family, ray) in all_rays(&in_place(&profile), 1).into_iter().filter(apart) {
            for (piece, equation) in equations(&profile, &ray) {
                let roots = equation.roots();
                for root in &roots {
                    assert!(
                        sturm_isolates(&equation, root),
                        "{family:?} {index} {piece}"
                    );
                    intervals += 1;
                }
                if !equation.is_zero() {
                    assert_eq!(roots.len(), sturm_count(&equation), "{family:?} {index}");
                }
            }
        }
    }
    assert!(intervals > 250, "{intervals}");
}

/// The neighbours of t are told apart by the exact polynomial: on a ray with whole numbers t itself is known.
#[test]
fn the_interval_of_t_is_a_point_where_t_is_a_float_and_an_ulp_elsewhere() {
    let bowl = Profile::new(vec![Piece {
        radius: [0.0, 1.0, 2.0, 3.0],
        height: [0.0, 0.0, 1.0, 3.0],
    }])
    .expect("one piece");
    let found = |d: [f64; 3]| {
        let direction = DVec3::from_array(d);
        certified(
            &bowl,
            &Ray::new(DVec3::new(0.0, 0.75, 1.5) - 4.0 * direction, direction),
        )
    };
    for d in [[0.0, -0.5, 0.0], [0.0, 0.0, 1.0]] {
        assert!(found(d).iter().any(|c| (c.t_low, c.t_high) == (4.0, 4.0)));
    }
    // h = r²/3 and r = 3 − t/3... at height ½: r = √1.5, irrational.
    let level = certified(&bowl, &Ray::new(DVec3::new(-3.0, 0.5, 0.0), DVec3::X));
    for (c, exact) in level
        .iter()
        .zip([3.0 - 1.5_f64.sqrt(), 3.0 + 1.5_f64.sqrt()])
    {
        assert_eq!(c.t_high, c.t_low.next_up());
        assert!((c.t - exact).abs() <= 4.0 * f64::EPSILON);
        let above = |t: f64| (t - 3.0) * (t - 3.0) - 1.5;
        assert!(above(c.t_low) * above(c.t_high) <= 1e-30);
    }
    assert_eq!(level.len(), 2);
}

/// What the two-branch form of the default solver is for: without it every ray nearer to level than some 1e-6 would be undecided
/// in f64, or worse. What is left is near a crest, where h′ = 0; and on flat pieces below 1e-154, where the square of t overflows.
#[test]
fn nearly_level_rays_are_decided_without_exact_arithmetic() {
    for (profile, most) in [(Profile::cup(), 0.05), (Profile::hourglass(), 0.02)] {
        let shape = in_place(&profile);
        let mut work = Work::default();
        let mut rays = rays(&shape, Family::NearHorizontal, 6000);
        rays.retain(|ray| ray.direction.y.abs() > 1e-150);
        for (index, ray) in rays.into_iter().enumerate() {
            let found = shape.nearest(&ray, &Solver::Bernstein, &mut work);
            if index % 20 == 0 {
                let truth = certified(shape.profile(), &ray);
                let pieces = [found.map(|c| c.piece), truth.first().map(|c| c.piece)];
                assert_eq!(pieces[0], pieces[1], "{index}");
            }
        }
        let share = work.solver_fallbacks as f64 / work.solver_calls as f64;
        assert!(share < most, "{share}");
    }
}

/// Steps a hit of the default solver.
fn steps_of(shape: &Revolution, rays: impl Iterator<Item = Ray>) -> f64 {
    let mut work = Work::default();
    let hits: usize = rays
        .map(|ray| shape.crossings(&ray, &Solver::Bernstein, &mut work).len())
        .sum();
    work.solver_iterations as f64 / hits as f64
}

/// Three steps are the least. From the control polygon it takes 3.2 a hit on random rays, and 6.0 on rays that pass a joint or the
/// tip of a cap by 1e-6 to 1e-12, where the value at that end is almost zero (tips are searched); from the secant of the end values 4.6 on
/// random rays, and 1.3 more than otherwise past joints.
#[test]
fn a_start_at_the_control_polygon_costs_few_steps_and_one_at_the_secant_would_not() {
    let shape = in_place(&Profile::cup());
    let random = steps_of(&shape, rays(&shape, Family::Random, 4000).into_iter());
    assert!(random < 3.5, "{random}");
    let past = |(index, mut ray): (usize, Ray)| {
        ray.origin.y += libm::exp10(-6.0 - (index % 7) as f64);
        ray
    };
    let joints = rays(&shape, Family::Joints, 4000).into_iter();
    let near = steps_of(&shape, joints.enumerate().map(past));
    assert!(near < 6.5, "{near}");
}

/// Newton's method on the two branches of a nearly level ray doubles its digits a step: 7.5 a hit, and 12 if damped by .7.
#[test]
fn the_branches_of_a_nearly_level_ray_cost_few_steps() {
    let shape = in_place(&Profile::cup());
    let tilted = |mut ray: Ray| {
        ray.direction.y = 5e-4;
        ray
    };
    let rays = rays(&shape, Family::Horizontal, 2000).into_iter();
    let steps = steps_of(&shape, rays.map(tilted));
    assert!(steps < 9.0, "{steps}");
}
