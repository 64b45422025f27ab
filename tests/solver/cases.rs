//! The hard cases N1 to N20 that a ray can meet, each with its expected answer.

use super::aim::{all_rays, rays};
use super::compare::{all, meets, paraboloid, ray, revolve, same, specimen, truth};
use glam::DVec3;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, Revolution, exact};
use photolathe::geometry::specimens::{Specimen, line, piece};
use photolathe::lab::families::Family;

/// The reference cup in its own frame.
pub(crate) fn cup() -> Revolution {
    specimen(Specimen::Cup)
}

/// Asserts agreement with the oracle on rays of some families.
#[track_caller]
pub(crate) fn agrees(shape: &Revolution, families: &[Family], count: u64) {
    for &family in families {
        for ray in rays(shape, family, count) {
            agrees_on(shape, family, &ray);
        }
    }
}

/// Asserts agreement with the oracle on rays of every family that fits.
#[track_caller]
pub(crate) fn agrees_everywhere(shape: &Revolution, count: u64) {
    for (family, ray) in all_rays(shape, count) {
        agrees_on(shape, family, &ray);
    }
}

#[track_caller]
fn agrees_on(shape: &Revolution, family: Family, ray: &Ray) {
    let (found, expected) = (all(shape, ray), truth(shape, ray));
    assert!(
        same(shape, ray, &found, &expected),
        "{family:?} {ray:?}: {found:?} {expected:?}"
    );
}

#[test]
fn n1_a_ray_through_the_rim_meets_four_sheets_in_order() {
    let crossings = all(&cup(), &ray([-10.0, 2.1, 0.0], [1.0, 0.001, 0.0]));
    assert_eq!(crossings.len(), 4);
    assert!(crossings.windows(2).all(|pair| pair[0].t < pair[1].t));
    assert!(crossings.iter().all(|c| c.piece == 4));
}

#[test]
fn n2_an_exact_tangent_is_one_hit() {
    let wall = revolve(vec![line([1.0, -3.0], [1.0, 3.0])]);
    meets(&wall, &ray([1.0, 0.0, -5.0], [0.0, 0.125, 1.0]), &[5.0]);
    meets(
        &paraboloid(),
        &ray([-1.5, -1.75, 0.0], [1.0, 1.0, 0.0]),
        &[2.0],
    );
}

#[test]
fn n3_a_tangent_tilted_by_delta_has_two_hits_delta_apart() {
    for k in 3..=45 {
        let delta = libm::exp2(-f64::from(k));
        let slope = 1.0 + delta;
        let tilted = ray([-1.5, 0.25 - 2.0 * slope, 0.0], [1.0, slope, 0.0]);
        meets(&paraboloid(), &tilted, &[2.0, 2.0 + delta]);
        let away = ray([-1.5, 0.25 - 2.0 - delta, 0.0], [1.0, 1.0, 0.0]);
        meets(&paraboloid(), &away, &[]);
    }
}

#[test]
fn n4_a_tangent_at_an_inflection_is_one_hit() {
    // r = 4 + 3u, h = (u − ½)³ + 3 (u − ½): slope dh/dr = 1 at the inflection u = ½.
    let shape = revolve(vec![piece(
        [4.0, 5.0, 6.0, 7.0],
        [-1.625, -0.375, 0.375, 1.625],
    )]);
    meets(&shape, &ray([3.5, -2.0, 0.0], [1.0, 1.0, 0.0]), &[2.0]);
}

#[test]
fn n5_a_double_root_hides_none_of_four_simple_ones() {
    // r = 192 (u − ¼)² (u − ¾) + ¼ + 3u/8, h = 3u; the ray x = ¼ + y/8 touches at u = ¼, crosses at ¾, and crosses −r thrice.
    let shape = revolve(vec![piece(
        [-8.75, 19.375, -32.5, 27.625],
        [0.0, 1.0, 2.0, 3.0],
    )]);
    let tilted = ray([-0.75, -8.0, 0.0], [1.0, 8.0, 0.0]);
    let crossings = all(&shape, &tilted);
    assert!(same(&shape, &tilted, &crossings, &truth(&shape, &tilted)));
    assert_eq!(crossings.len(), 5);
    let certain = exact::certified(shape.profile(), &tilted);
    let mut multiplicities: Vec<u32> = certain.iter().map(|c| c.multiplicity).collect();
    multiplicities.sort_unstable();
    assert_eq!(multiplicities, [1, 1, 1, 1, 2]);
    for u in [0.25, 0.75] {
        let t = 1.0 + 3.0 * u / 8.0;
        assert!(crossings.iter().any(|c| (c.t - t).abs() < 1e-9));
    }
}

#[test]
fn n6_the_axis_meets_every_point_of_radius_zero() {
    let axis = ray([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]);
    meets(&cup(), &axis, &[3.7, 4.96]);
    for crossing in all(&cup(), &axis) {
        let hit = cup().hit(&axis, crossing);
        assert_eq!(hit.normal.y.abs(), 1.0);
        assert_eq!(hit.theta(), 0.0);
    }
    // Inside a piece: a tip that r crosses, and one that it touches.
    for inside in [Specimen::BothSigns, Specimen::Neck] {
        meets(&specimen(inside), &axis, &[3.5]);
    }
}

#[test]
fn n7_a_ray_parallel_to_the_axis_is_not_culled() {
    meets(
        &paraboloid(),
        &ray([0.3, 5.0, 0.4], [0.0, -1.0, 0.0]),
        &[4.75],
    );
    agrees(&cup(), &[Family::Axis], 200);
}

#[test]
fn n8_rays_close_to_the_axis_tend_to_the_axis() {
    for k in 3..=16 {
        let side = libm::exp10(-f64::from(k));
        let close = ray([side, 5.0, 0.0], [0.0, -1.0, 0.0]);
        meets(&paraboloid(), &close, &[5.0 - side * side]);
        let ts: Vec<f64> = all(&cup(), &close).iter().map(|c| c.t).collect();
        assert!((ts[0] - 3.7).abs() <= side + 1e-15 && (ts[1] - 4.96).abs() <= side + 1e-15);
    }
}

#[test]
fn n9_a_level_ray_meets_the_cubic_and_the_quadratic() {
    meets(
        &paraboloid(),
        &ray([-3.0, 0.25, 0.0], [1.0, 0.0, 0.0]),
        &[2.5, 3.5],
    );
    meets(
        &paraboloid(),
        &ray([-3.0, 0.25, 0.3], [1.0, 0.0, 0.0]),
        &[2.6, 3.4],
    );
    agrees(&cup(), &[Family::Horizontal], 200);
}

#[test]
fn n10_hits_are_continuous_as_the_ray_becomes_level() {
    for power in (1..=20).chain([50, 100, 150, 200, 250, 300]) {
        for sign in [-1.0, 1.0] {
            let k = sign * libm::exp10(-f64::from(power));
            // (t − 3)² = ¼ + k t.
            let middle = 3.0 + 0.5 * k;
            let square = 0.25 + k * (3.0 + 0.25 * k);
            let tilted = ray([-3.0, 0.25, 0.0], [1.0, k, 0.0]);
            if square > 0.0 {
                let half = square.sqrt();
                meets(&paraboloid(), &tilted, &[middle - half, middle + half]);
            } else {
                meets(&paraboloid(), &tilted, &[]);
            }
        }
    }
    agrees(&cup(), &[Family::NearHorizontal], 100);
}

#[test]
fn n11_a_level_ray_that_touches_a_crest_meets_it() {
    let crest = revolve(vec![piece([1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 1.0, 0.0])]);
    meets(
        &crest,
        &ray([-4.0, 0.75, 0.0], [1.0, 0.0, 0.0]),
        &[1.5, 6.5],
    );
    meets(
        &crest,
        &ray([-4.0, 0.75 + 1e-15, 0.0], [1.0, 0.0, 0.0]),
        &[],
    );
}

#[test]
fn n12_a_ray_inside_the_plane_of_a_disc_does_not_meet_it() {
    let disc = revolve(vec![line([0.0, 1.0], [3.0, 1.0])]);
    meets(&disc, &ray([-5.0, 1.0, 0.2], [1.0, 0.0, 0.0]), &[]);
    meets(
        &disc,
        &ray([-5.0, 1.0 - 5e-9, 0.0], [1.0, 1e-9, 0.0]),
        &[5.0],
    );
    // The wall's end at the cap's height is still met.
    let hourglass = Revolution::new(Profile::hourglass(), Placement::identity());
    meets(
        &hourglass,
        &ray([-2.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
        &[1.2, 2.8],
    );
}

#[test]
fn n13_a_smooth_cap_has_its_normal_along_the_axis() {
    let aimed = ray([-2.0, 3.3, 0.0], [1.0, -1.0, 0.0]);
    let first = Ray {
        t_max: 2.4,
        ..aimed
    };
    meets(&cup(), &first, &[2.0]);
    let cap = cup().hit(&aimed, all(&cup(), &aimed)[0]);
    assert!((cap.normal - DVec3::Y).length() < 1e-12);
}

#[test]
fn n14_the_tip_of_a_cone_is_hit_and_has_a_normal() {
    let cone = revolve(vec![line([0.0, 0.0], [3.0, 3.0])]);
    meets(&cone, &ray([0.0, -2.0, 0.0], [0.0, 1.0, 0.0]), &[2.0]);
    meets(&cone, &ray([-2.0, -1.0, 0.0], [2.0, 1.0, 0.0]), &[1.0]);
}

#[test]
fn n15_a_point_where_the_surface_touches_the_axis_is_one_hit() {
    let neck = specimen(Specimen::Neck);
    meets(&neck, &ray([-2.0, 1.0, 0.0], [1.0, 0.25, 0.0]), &[2.0]);
    meets(&neck, &ray([-2.0, 1.5, 0.0], [1.0, 0.0, 0.0]), &[2.0]);
}

#[test]
fn n16_negative_radii_give_the_surface_of_their_magnitude_once() {
    let both = specimen(Specimen::BothSigns);
    meets(&both, &ray([1.0, 5.0, 0.0], [0.0, -1.0, 0.0]), &[3.0, 4.0]);
    meets(&both, &ray([-4.0, 1.0, 0.0], [1.0, 0.0, 0.0]), &[3.0, 5.0]);
    agrees_everywhere(&both, 20);
}

#[test]
fn n17_a_cusp_is_hit_and_has_a_finite_normal() {
    let cusp = specimen(Specimen::Cusp);
    meets(&cusp, &ray([1.5, 2.0, 0.0], [0.0, -1.0, 0.0]), &[1.25]);
    agrees_everywhere(&cusp, 20);
}

#[test]
fn n18_a_profile_that_cuts_itself_keeps_parity() {
    let looped = specimen(Specimen::Loop);
    agrees(
        &looped,
        &[Family::Random, Family::Horizontal, Family::Grazes],
        100,
    );
    for ray in rays(&looped, Family::Random, 500) {
        assert_eq!(all(&looped, &ray).len() % 2, 0);
    }
}

#[test]
fn n19_n20_pieces_without_area_are_never_hit() {
    let circle = revolve(vec![Piece::new([[1.0, 0.5]; 4])]);
    let point = revolve(vec![Piece::new([[0.0, 0.5]; 4])]);
    let axis = revolve(vec![piece([0.0; 4], [0.0, 1.0, 2.0, 3.0])]);
    for shape in [circle, point, axis] {
        for d in [[1.0, 0.0, 0.0], [1.0, 0.25, 0.0], [0.0, 1.0, 0.0]] {
            for target in [[1.0, 0.5, 0.0], [0.0, 0.5, 0.0], [0.0, 1.0, 0.0]] {
                let o = [0, 1, 2].map(|i| target[i] - 2.0 * d[i]);
                meets(&shape, &ray(o, d), &[]);
            }
        }
    }
}
