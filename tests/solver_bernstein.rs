//! The Bernstein solver against the exact one, closed forms and planted answers.

#[path = "solver/batch.rs"]
mod batch;
#[path = "solver/cases.rs"]
mod cases;
#[path = "solver/more_cases.rs"]
mod more_cases;
#[path = "solver/rays.rs"]
mod rays;
#[path = "solver/shapes.rs"]
mod shapes;

use glam::DVec3;
use photolathe::geometry::hit::Crossing;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::geometry::specimens::Specimen;
use photolathe::numeric::polynomial::cubic;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use rays::{FAMILIES, Family};
use shapes::{Nearest, all, ours, revolve, same, tolerance, truth};

fn profiles() -> [Revolution; 2] {
    [Profile::cup(), Profile::hourglass()].map(|p| Revolution::new(p, Placement::identity()))
}

/// Rays of a family for which an implementation misses, invents or confuses the nearest hit.
fn failures(nearest: Nearest, shape: &Revolution, family: Family, count: u64) -> u64 {
    let wrong = |i: &u64| {
        let ray = rays::ray(shape.profile(), family, *i);
        let found: Vec<Crossing> = nearest(shape, &ray).into_iter().collect();
        let expected: Vec<Crossing> = truth(shape, &ray).into_iter().take(1).collect();
        !same(shape, &ray, &found, &expected)
    };
    (0..count).filter(wrong).count() as u64
}

/// 0 of 20000 bounds the rate of failure by 1.5e-4 (95 % confidence); the experiments take more.
#[test]
fn no_random_ray_misses_invents_or_confuses_a_hit() {
    let [cup, _] = profiles();
    assert_eq!(failures(ours, &cup, Family::Random, 20_000), 0);
}

#[test]
fn no_hard_family_has_a_failure() {
    for shape in profiles() {
        for family in FAMILIES {
            assert_eq!(failures(ours, &shape, family, 200), 0, "{family:?}");
        }
    }
}

/// In the middle of a cap f ≤ 0 without rounding, so convexity decides.
#[test]
fn rays_near_the_axis_need_no_exact_arithmetic_at_caps() {
    for shape in profiles() {
        let mut work = Work::default();
        for i in 0..2_000 {
            let ray = rays::ray(shape.profile(), Family::NearAxis, i);
            shape.nearest(&ray, &Solver::Bernstein, &mut work);
        }
        assert_eq!(work.solver_fallbacks, 0);
        assert_eq!(failures(ours, &shape, Family::NearAxis, 600), 0);
    }
}

/// The exact solver is then asked only about pieces that the filter suspects: the same bits as about all.
#[test]
fn what_the_filter_cannot_decide_gets_the_bits_of_the_exact_solver() {
    let specimens = Specimen::ALL.map(|s| Revolution::new(s.profile(), Placement::identity()));
    let mut asked = 0;
    for shape in specimens {
        for family in [
            Family::LevelAtJoint,
            Family::Joint,
            Family::Grazing,
            Family::SurfaceStart,
        ] {
            for i in 0..40 {
                let ray = rays::ray(shape.profile(), family, i);
                let mut work = Work::default();
                let found = shape.crossings(&ray, &Solver::Bernstein, &mut work);
                if work.solver_fallbacks > 0 {
                    asked += 1;
                    assert_eq!(found, truth(&shape, &ray), "{family:?} {i}");
                }
            }
        }
    }
    assert!(asked > 500, "{asked}");
}

/// The original's bounding test: a ray parallel to the axis is rejected.
fn culls_parallel_rays(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    let parallel = ray.direction.x == 0.0 && ray.direction.z == 0.0;
    ours(shape, ray).filter(|_| !parallel)
}

/// Piece ends taken as strict.
fn drops_piece_ends(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    let inside = |c: &Crossing| c.u > 1e-12 && c.u < 1.0 - 1e-12;
    all(shape, ray).into_iter().find(inside)
}

/// The equation multiplied by d_y²: without branches a perpendicular ray has no answer.
fn divides_by_the_slope(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    ours(shape, ray).filter(|_| ray.direction.y.abs() > 1e-8)
}

/// The farther of two hits.
fn takes_the_last(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    all(shape, ray).pop()
}

/// An absolute tolerance at the start of the range.
fn starts_late(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    ours(
        shape,
        &Ray {
            t_min: 1e-2,
            ..*ray
        },
    )
}

/// Grazing hits lost to a discriminant compared with a tolerance.
fn loses_grazing_hits(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    let cosine = |c: &Crossing| shape.hit(ray, *c).normal.dot(ray.direction).abs();
    all(shape, ray).into_iter().find(|c| cosine(c) > 1e-3)
}

#[test]
fn the_families_see_known_wrong_solvers() {
    let [cup, _] = profiles();
    let mutants: [(Nearest, Family); 6] = [
        (culls_parallel_rays, Family::Parallel),
        (drops_piece_ends, Family::Joint),
        (divides_by_the_slope, Family::NearlyLevel),
        (takes_the_last, Family::Random),
        (starts_late, Family::Inside),
        (loses_grazing_hits, Family::Grazing),
    ];
    for (mutant, family) in mutants {
        assert!(failures(mutant, &cup, family, 300) > 0, "{family:?}");
    }
}

/// With exact rays as the yardstick, f64 alone decides all but a few rays.
#[test]
fn ordinary_rays_need_no_exact_arithmetic() {
    for shape in profiles() {
        for family in [
            Family::Random,
            Family::Inside,
            Family::Level,
            Family::Parallel,
            Family::Meridian,
        ] {
            let mut work = Work::default();
            for i in 0..20_000 {
                let ray = rays::ray(shape.profile(), family, i);
                shape.nearest(&ray, &Solver::Bernstein, &mut work);
            }
            assert!(work.solver_fallbacks <= 1, "{family:?} {work:?}");
        }
    }
}

#[test]
fn a_line_from_outside_to_outside_crosses_a_solid_an_even_number_of_times() {
    for shape in profiles() {
        for i in 0..20_000 {
            let ray = rays::ray(shape.profile(), Family::Random, i);
            assert_eq!(all(&shape, &ray).len() % 2, 0, "{i}");
        }
    }
}

#[test]
fn the_line_backwards_gives_the_same_points() {
    for shape in profiles() {
        for i in 0..5_000 {
            let ray = rays::ray(shape.profile(), Family::Random, i);
            let far = 100.0;
            let back = Ray::new(ray.at(far), -ray.direction);
            let forth = all(&shape, &ray);
            let mut returned = all(&shape, &back);
            returned.reverse();
            // The new origin is rounded: grazing pairs may differ.
            if forth.len() != returned.len() {
                let gap = forth.iter().chain(&returned);
                assert!(gap.clone().any(|c| tolerance(&shape, &ray, c) > 1e-9));
                continue;
            }
            for (a, b) in forth.iter().zip(&returned) {
                let permitted = 20.0 * tolerance(&shape, &ray, a);
                assert!((a.t - (far - b.t)).abs() <= permitted, "{i} {a:?} {b:?}");
            }
        }
    }
}

/// Halves of a cubic by de Casteljau's scheme at ½: exact up to rounding.
fn halves(c: [f64; 4]) -> [[f64; 4]; 2] {
    let mid = |a: f64, b: f64| 0.5 * (a + b);
    let (ab, bc, cd) = (mid(c[0], c[1]), mid(c[1], c[2]), mid(c[2], c[3]));
    let (abc, bcd) = (mid(ab, bc), mid(bc, cd));
    let middle = mid(abc, bcd);
    [[c[0], ab, abc, middle], [middle, bcd, cd, c[3]]]
}

#[test]
fn a_profile_and_its_subdivision_have_the_same_hits() {
    for shape in profiles() {
        let cut: Vec<Piece> = (shape.profile().pieces().iter())
            .flat_map(|p| {
                let (r, h) = (halves(p.radius), halves(p.height));
                [0, 1].map(|k| shapes::piece(r[k], h[k]))
            })
            .collect();
        let cut = revolve(cut);
        for i in 0..5_000 {
            let ray = rays::ray(shape.profile(), Family::Random, i);
            let (a, b) = (all(&shape, &ray), all(&cut, &ray));
            assert!(same(&cut, &ray, &a, &b), "{i} {a:?} {b:?}");
        }
    }
}

#[test]
fn a_turn_about_the_axis_turns_theta_only() {
    for shape in profiles() {
        let turned = Placement::new(DVec3::ZERO, DVec3::Y, 90.0, 1.0);
        let turned = Revolution::new(shape.profile().clone(), turned);
        for i in 0..2_000 {
            let ray = rays::ray(shape.profile(), Family::Random, i);
            let (a, b) = (ours(&shape, &ray), ours(&turned, &ray));
            let found: Vec<Crossing> = b.into_iter().collect();
            let expected: Vec<Crossing> = a.into_iter().collect();
            assert!(same(&shape, &ray, &found, &expected));
            if let Some(crossing) = b {
                let (p, q) = (shape.hit(&ray, crossing), turned.hit(&ray, crossing));
                assert!((p.point - q.point).length() <= p.error + q.error);
            }
        }
    }
}

#[test]
fn nearest_is_the_first_of_all_crossings() {
    for shape in profiles() {
        for family in FAMILIES {
            for i in 0..100 {
                let ray = rays::ray(shape.profile(), family, i);
                let first: Vec<Crossing> = all(&shape, &ray).into_iter().take(1).collect();
                let nearest: Vec<Crossing> = ours(&shape, &ray).into_iter().collect();
                assert!(same(&shape, &ray, &nearest, &first), "{family:?} {i}");
            }
        }
    }
}

#[test]
fn the_point_of_a_hit_is_within_its_error_of_the_ray_and_the_surface() {
    for shape in profiles() {
        for i in 0..5_000 {
            let ray = rays::ray(shape.profile(), Family::Random, i);
            let Some(crossing) = ours(&shape, &ray) else {
                continue;
            };
            let hit = shape.hit(&ray, crossing);
            let piece = &shape.profile().pieces()[crossing.piece as usize];
            let r = cubic(&piece.radius, crossing.u).0.abs();
            let h = cubic(&piece.height, crossing.u).0;
            assert!((libm::hypot(hit.point.x, hit.point.z) - r).abs() <= hit.error);
            assert!((hit.point.y - h).abs() <= hit.error);
            let on_ray = ray.at(crossing.t);
            let permitted = 4.0 * tolerance(&shape, &ray, &crossing) + hit.error;
            let distance = (hit.point - on_ray).length();
            assert!(
                distance <= permitted,
                "{i} {distance:e} {permitted:e} {hit:?} {ray:?}"
            );
        }
    }
}

/// Control values biased to trouble: equal, zero, negative, tiny differences.
fn control() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0..3.0_f64,
        2 => (-4_i8..12).prop_map(|k| 0.25 * f64::from(k)),
        1 => Just(0.0),
        1 => (0_i8..4, 1.0..9.0_f64).prop_map(|(k, e)| f64::from(k) + libm::exp10(-2.0 * e)),
    ]
}

fn random_profile() -> impl Strategy<Value = Profile> {
    let point = [control(), control()];
    prop::collection::vec(prop::array::uniform3(point), 1..4).prop_map(|rest| {
        let mut last = [rest[0][0][1].abs(), -0.5];
        let mut pieces = Vec::new();
        for [a, b, c] in rest {
            pieces.push(Piece::new([last, a, b, c]));
            last = c;
        }
        Profile::new(pieces).expect("each piece starts where the last one ended")
    })
}

fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..Config::default()
    }
}

proptest! {
    #![proptest_config(config(800))]

    #[test]
    fn random_profiles_agree_with_the_oracle(
        profile in random_profile(),
        family in prop::sample::select(&FAMILIES[..]),
        index in 0..u64::MAX,
    ) {
        let shape = Revolution::new(profile, Placement::identity());
        let ray = rays::ray(shape.profile(), family, index);
        let (found, expected) = (all(&shape, &ray), truth(&shape, &ray));
        prop_assert!(same(&shape, &ray, &found, &expected), "{:?} {:?}", found, expected);
    }

    #[test]
    fn a_planted_point_is_never_missed(
        profile in random_profile(),
        place in (0..3_usize, 0.0..1.0_f64, 0.0..6.3_f64),
        index in 0..u64::MAX,
    ) {
        let (piece, u, theta) = place;
        let pieces = profile.pieces();
        let at = pieces[piece % pieces.len()].at(u);
        // A needle thinner than the rounding of the point is no target.
        prop_assume!(at.radius.abs() > 1e-6);
        let point = DVec3::new(
            at.radius * libm::sin(theta),
            at.height,
            at.radius * libm::cos(theta),
        );
        let mut s = Stream::new(9, Purpose::Test, index);
        let d = DVec3::new(s.range(-1.0, 1.0), s.range(-1.0, 1.0), s.range(-1.0, 1.0));
        let shape = Revolution::new(profile, Placement::identity());
        let ray = Ray::new(point - 4.0 * d, d);
        // The planted point is rounded, so a tangency may be a miss; otherwise t ≤ 4 within its error.
        let found = ours(&shape, &ray);
        let bound = |c: Crossing| c.t <= 4.0 + 1e-7;
        let planted = Crossing { t: 4.0, piece: (piece % shape.profile().pieces().len()) as u32, u };
        let steep = tolerance(&shape, &ray, &planted) < 1e-12;
        prop_assert!(found.is_some_and(bound) || !steep);
    }
}
