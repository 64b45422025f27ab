//! The hard cases N21 to N40: straight pieces, joints, ranges, scales and bad numbers.

use super::aim::rays;
use super::cases::{agrees, agrees_everywhere, cup};
use super::compare::{all, meets, ours, paraboloid, ray, revolve, same, specimen, truth};
use glam::DVec3;
use photolathe::geometry::hit::Crossing;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::geometry::specimens::{Specimen, line, piece};
use photolathe::lab::families::Family;
use photolathe::numeric::work::Work;

/// Crossings of a quadric a t² + 2 b t + c = 0 that lie between two heights.
fn quadric(ray: &Ray, a: f64, b: f64, c: f64, heights: [f64; 2]) -> Vec<f64> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return Vec::new();
    }
    let q = -(b + b.signum() * discriminant.sqrt());
    let mut ts = vec![q / a, c / q];
    ts.retain(|&t| t > 0.0 && (heights[0]..=heights[1]).contains(&ray.at(t).y));
    ts.sort_by(f64::total_cmp);
    ts
}

#[test]
fn n21_n22_straight_pieces_are_cylinders_and_cones() {
    let wall = revolve(vec![line([2.0, -3.0], [2.0, 3.0])]);
    let cone = revolve(vec![line([1.0, 0.0], [4.0, 6.0])]);
    for r in rays(&wall, Family::Random, 500) {
        let (o, d) = (r.origin, r.direction);
        let a = d.x * d.x + d.z * d.z;
        let b = o.x * d.x + o.z * d.z;
        let c = o.x * o.x + o.z * o.z - 4.0;
        meets(&wall, &r, &quadric(&r, a, b, c, [-3.0, 3.0]));
        // r = 1 + h/2 on the cone.
        let (k, rise) = (1.0 + 0.5 * o.y, 0.5 * d.y);
        let (a, b, c) = (a - rise * rise, b - k * rise, c + 4.0 - k * k);
        meets(&cone, &r, &quadric(&r, a, b, c, [0.0, 6.0]));
    }
}

#[test]
fn n23_a_flat_piece_is_an_annulus() {
    let annulus = revolve(vec![line([1.0, 2.0], [4.0, 2.0])]);
    for r in rays(&cup(), Family::Random, 500) {
        let t = (2.0 - r.origin.y) / r.direction.y;
        let radius = libm::hypot(r.at(t).x, r.at(t).z);
        let hit = t > 0.0 && (1.0..=4.0).contains(&radius);
        let expected: &[f64] = if hit { &[t] } else { &[] };
        meets(&annulus, &r, expected);
    }
}

#[test]
fn n24_each_fold_of_a_folded_line_is_met_at_the_same_place() {
    let folded = specimen(Specimen::Fold);
    let ts: Vec<f64> = all(&folded, &ray([-3.0, 0.5, 0.0], [1.0, 0.015_625, 0.0]))
        .iter()
        .map(|c| c.t)
        .collect();
    assert_eq!(ts.len(), 6);
    assert!(ts[..3].iter().all(|t| (t - 2.0).abs() < 1e-14));
    assert!(ts[3..].iter().all(|t| (t - 4.0).abs() < 1e-14));
    agrees_everywhere(&folded, 20);
}

#[test]
fn n25_ends_of_zero_speed_lose_no_hit() {
    let still = revolve(vec![
        Piece::new([[0.0, 0.0], [0.0, 0.0], [2.0, 1.0], [2.0, 2.0]]),
        Piece::new([[2.0, 2.0], [2.0, 2.0], [1.0, 3.0], [1.0, 3.0]]),
    ]);
    agrees_everywhere(&still, 30);
}

#[test]
fn n26_raised_degrees_keep_their_closed_forms() {
    for r in rays(&paraboloid(), Family::Random, 500) {
        let (o, d) = (r.origin, r.direction);
        let a = d.x * d.x + d.z * d.z;
        let b = o.x * d.x + o.z * d.z - 0.5 * d.y;
        let c = o.x * o.x + o.z * o.z - o.y;
        meets(&paraboloid(), &r, &quadric(&r, a, b, c, [0.0, 9.0]));
    }
}

#[test]
fn n27_a_root_shared_by_two_pieces_is_one_hit() {
    // The paraboloid cut at r = 1.5, h = 2.25: rays exactly at the joint.
    let cut = revolve(vec![
        piece([0.0, 0.5, 1.0, 1.5], [0.0, 0.0, 0.75, 2.25]),
        piece([1.5, 2.0, 2.5, 3.0], [2.25, 3.75, 6.0, 9.0]),
    ]);
    for d in [
        [1.0, 0.0, 0.0],
        [1.0, -1.0, 0.0],
        [0.0, -1.0, 0.0],
        [1.0, 0.5, 2.0],
        [1.0, 1e-9, 0.0],
    ] {
        for side in [-1.5, 1.5] {
            let through = ray([side - d[0], 2.25 - d[1], -d[2]], d);
            let expected = truth(&paraboloid(), &through);
            let ts: Vec<f64> = expected.iter().map(|c| c.t).collect();
            meets(&cut, &through, &ts);
        }
    }
    agrees(&cup(), &[Family::Joints], 500);
}

#[test]
fn n28_a_kinked_joint_has_no_gap_and_the_normal_of_one_piece() {
    let pieces = Profile::cup().pieces().to_vec();
    let kink = pieces[1].point(3);
    let slopes = [pieces[1].tangent(1.0), pieces[2].tangent(0.0)];
    let target = DVec3::new(0.6 * kink[0], kink[1], 0.8 * kink[0]);
    let mut at_kink = 0;
    for mut aimed in rays(&cup(), Family::Random, 500) {
        aimed.direction = target - aimed.origin;
        let (found, expected) = (all(&cup(), &aimed), truth(&cup(), &aimed));
        assert!(same(&cup(), &aimed, &found, &expected), "{aimed:?}");
        for crossing in found.into_iter().filter(|c| (c.t - 1.0).abs() < 1e-14) {
            let hit = cup().hit(&aimed, crossing);
            let off = slopes.map(|[r, h]| {
                let normal = DVec3::new(0.6 * h, -r, 0.8 * h).normalize();
                (hit.normal - normal).length()
            });
            assert!(off[0].min(off[1]) < 1e-12, "{off:?}");
            at_kink += 1;
        }
    }
    assert!(at_kink > 300, "{at_kink}");
}

/// A spindle much taller than wide, met exactly at its edge by rays that start nearby: seen from outside, whichever piece the
/// solver names.
#[test]
fn n28_the_edge_of_a_tall_spindle_is_met_from_outside() {
    let spindle = revolve(vec![
        line([0.0, -30.0], [3.0, 0.0]),
        line([3.0, 0.0], [0.0, 30.0]),
    ]);
    for slope in [2.0, -2.0, 0.5, -0.5, 8.0, -8.0] {
        let aimed = ray([3.25, slope, 0.0], [-0.25, -slope, 0.0]);
        let crossing = ours(&spindle, &aimed).expect("it meets the edge");
        assert!((crossing.t - 1.0).abs() < 1e-12, "{slope} {}", crossing.t);
        let normal = spindle.hit(&aimed, crossing).normal;
        assert!(normal.dot(aimed.direction) < 0.0, "{slope} {normal}");
    }
}

#[test]
fn n29_a_ray_that_leaves_a_hit_keeps_its_side_and_needs_no_exact_arithmetic() {
    let moved = Placement::new(DVec3::new(7.0, -3.0, 11.0), DVec3::ONE, 70.0, 0.45);
    for shape in [cup(), Revolution::new(Profile::cup(), moved)] {
        let mut work = Work::default();
        let mut rays_out = 0;
        let inside = rays(&cup(), Family::Inside, 3000);
        for (local, inside) in rays(&cup(), Family::Random, 3000).iter().zip(inside) {
            let p = shape.placement();
            let r = Ray::new(p.point_to_world(local.origin), p.rotation * local.direction);
            let Some(crossing) = shape.nearest(&r, &Solver::Bernstein, &mut work) else {
                continue;
            };
            let hit = shape.hit(&r, crossing);
            let other = p.rotation * inside.direction;
            for direction in [other, -other, r.direction] {
                let side = hit.side_met(-direction);
                let next = shape.leave(&hit, side, direction, &mut work);
                let count = shape.crossings(&next, &Solver::Bernstein, &mut work).len();
                let outside = hit.normal.dot(direction) > 0.0;
                assert_eq!(count % 2, usize::from(!outside), "{r:?} {direction}");
                rays_out += 1;
            }
        }
        assert!(rays_out > 5000);
        assert!(work.solver_fallbacks <= 2, "{}", work.solver_fallbacks);
    }
}

#[test]
fn n30_a_ray_that_leaves_along_a_convex_wall_does_not_meet_it() {
    let wall = revolve(vec![line([1.0, -3.0], [1.0, 3.0])]);
    let arriving = ray([3.0, 0.25, 0.5], [-1.0, 0.0, 0.0]);
    let hit = wall.hit(&arriving, ours(&wall, &arriving).expect("a hit"));
    for tilt in [-1.0, -0.1, 0.0, 0.3] {
        let tangent = DVec3::new(-hit.normal.z, tilt, hit.normal.x);
        assert_eq!(all(&wall, &Ray::new(hit.offset(4.0), tangent)), Vec::new());
    }
}

#[test]
fn n31_rays_from_inside_cavity_and_axis_have_their_parity() {
    for (height, odd) in [
        (0.5, true),
        (1.29, true),
        (1.31, false),
        (0.01, false),
        (3.0, false),
    ] {
        for ray in rays(&cup(), Family::Inside, 50) {
            let from = Ray::new(DVec3::new(0.0, height, 0.0), ray.direction);
            assert_eq!(all(&cup(), &from).len() % 2 == 1, odd, "{height} {ray:?}");
        }
    }
}

#[test]
fn n32_n33_only_hits_inside_the_open_range_count() {
    let r = ray([-3.0, 0.25, 0.0], [1.0, 0.0, 0.0]);
    meets(&paraboloid(), &ray([4.0, 0.25, 0.0], [1.0, 0.0, 0.0]), &[]);
    let within = |t_min, t_max| Ray { t_min, t_max, ..r };
    meets(&paraboloid(), &within(2.5, 3.5), &[]);
    meets(&paraboloid(), &within(2.5_f64.next_down(), 3.5), &[2.5]);
    meets(&paraboloid(), &within(2.5, 3.5_f64.next_up()), &[3.5]);
    meets(&paraboloid(), &within(-10.0, f64::INFINITY), &[2.5, 3.5]);
}

#[test]
fn n34_scaling_by_powers_of_two_changes_no_bit_of_the_answer() {
    for power in [-900, -100, -27, 27, 100, 900] {
        let s = libm::scalbn(1.0, power);
        let pieces = Profile::cup().pieces().to_vec();
        let scaled = pieces
            .into_iter()
            .map(|p| piece(p.radius.map(|r| r * s), p.height.map(|h| h * s)))
            .collect();
        let scaled = revolve(scaled);
        for r in rays(&cup(), Family::Random, 300) {
            let far = Ray {
                origin: r.origin * s,
                ..r
            };
            let expected: Option<Crossing> = ours(&cup(), &r).map(|c| Crossing { t: c.t * s, ..c });
            assert_eq!(ours(&scaled, &far), expected);
        }
    }
}

#[test]
fn n34_a_centre_far_away_keeps_the_relative_answer() {
    let centre = DVec3::new(1e6, -1e6, 1e6);
    let moved = Placement::new(centre, DVec3::Y, 0.0, 1.0);
    let moved = Revolution::new(Profile::cup(), moved);
    for r in rays(&cup(), Family::Random, 300) {
        let there = Ray {
            origin: r.origin + centre,
            ..r
        };
        // The moved origin is rounded: compare with the ray that was really asked.
        let asked = Ray {
            origin: there.origin - centre,
            ..r
        };
        assert_eq!(ours(&moved, &there), ours(&cup(), &asked));
    }
    agrees(&cup(), &[Family::Far], 300);
}

/// The least that f32 loses: only the origin is rounded to it, and the answer is exact. An ulp of 10⁶ is 1/16 there.
#[test]
fn n34_in_f32_a_centre_far_away_loses_the_answer_that_f64_keeps() {
    let single = |v: DVec3| v.map(|x| f64::from(x as f32));
    let lost = |centre: f64, round: &dyn Fn(DVec3) -> DVec3| {
        let centre = DVec3::splat(centre);
        let changed = |r: &Ray| {
            let origin = round(r.origin + centre) - centre;
            let (a, b) = (ours(&cup(), r), ours(&cup(), &Ray { origin, ..*r }));
            match (a, b) {
                (Some(a), Some(b)) => (a.t - b.t).abs() > 1e-3,
                (a, b) => a.is_some() != b.is_some(),
            }
        };
        rays(&cup(), Family::Random, 300)
            .iter()
            .filter(|r| changed(r))
            .count()
    };
    assert_eq!(lost(1e6, &|v| v), 0);
    assert!(lost(0.0, &single) <= 1);
    assert!(lost(1e6, &single) > 150);
}

#[test]
fn n35_directions_of_any_length_give_the_same_points() {
    for length in [1e-20, 1e-3, 0.7, 3.0, 1e20, 1e150, 1e-150] {
        for r in rays(&cup(), Family::Random, 100) {
            let long = Ray {
                direction: r.direction * length,
                ..r
            };
            let (a, b) = (ours(&cup(), &r), ours(&cup(), &long));
            match (a, b) {
                (Some(a), Some(b)) => assert!((a.t - b.t * length).abs() <= 1e-11 * a.t),
                (a, b) => assert_eq!(a.is_some(), b.is_some()),
            }
        }
    }
}

#[test]
fn n37_denormal_and_negative_zero_numbers_are_numbers() {
    let tiny = f64::from_bits(1);
    let speck = revolve(vec![line(
        [3.0 * tiny, -3.0 * tiny],
        [3.0 * tiny, 3.0 * tiny],
    )]);
    meets(&speck, &ray([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), &[1.0, 1.0]);
    meets(&speck, &ray([-1.0, 1e-300, 0.0], [1.0, 0.0, 0.0]), &[]);
    let signed = ray([-0.0, 5.0, -0.0], [-0.0, -1.0, -0.0]);
    meets(&cup(), &signed, &[3.7, 4.96]);
    let slow = ray([0.3, 5.0, 0.4], [0.0, -f64::MIN_POSITIVE, tiny]);
    assert!(all(&paraboloid(), &slow).len() <= 2);
}

#[test]
fn n38_of_two_sheets_the_nearer_is_found_however_thin_the_wall() {
    for power in 3..=14 {
        let inner = 1.0 - libm::exp10(-f64::from(power));
        let tube = revolve(vec![
            line([1.0, -3.0], [1.0, 3.0]),
            line([1.0, 3.0], [inner, 3.0]),
            line([inner, 3.0], [inner, -3.0]),
        ]);
        for slope in [0.0, 0.125, 1e-9] {
            let r = ray([-2.0, -slope, 0.0], [1.0, slope, 0.0]);
            meets(&tube, &r, &[1.0, 2.0 - inner, 2.0 + inner, 3.0]);
            let from_inside = ray([0.0, 0.0, 0.0], [1.0, slope, 0.0]);
            meets(&tube, &from_inside, &[inner, 1.0]);
        }
    }
}

#[test]
fn n40_theta_is_in_one_turn_on_both_sides_of_zero() {
    for x in [-1e-3, -1e-17, -1e-300, -0.0, 0.0, 1e-300, 1e-17, 1e-3] {
        let r = ray([x, 1.0, 3.0], [0.0, 0.0, -1.0]);
        let crossings = all(&paraboloid(), &r);
        let hit = paraboloid().hit(&r, crossings[0]);
        assert!((0.0..std::f64::consts::TAU).contains(&hit.theta()));
        let from_zero = hit.theta().min(std::f64::consts::TAU - hit.theta());
        assert!((from_zero - x.abs()).abs() < 1e-6);
    }
}
