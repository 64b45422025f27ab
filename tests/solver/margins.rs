//! Rays at the margins of the solver's bounds of error: each test is named after what a bound had once left out, and finds it again
//! where that is left out anew.

use super::compare::{all, ours, revolve, truth};
use glam::DVec3;
use photolathe::geometry::profile::Piece;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::Revolution;
use photolathe::numeric::rng::{Purpose, Stream};

/// A straight piece.
fn line(from: [f64; 2], to: [f64; 2]) -> Piece {
    let between = |i: usize| [0.0, 1.0, 2.0, 3.0].map(|k| from[i] + (to[i] - from[i]) * k / 3.0);
    let (mut radius, mut height) = (between(0), between(1));
    (radius[3], height[3]) = (to[0], to[1]);
    Piece { radius, height }
}

/// ±10ˣ, x uniform.
fn power(s: &mut Stream, low: f64, high: f64) -> f64 {
    let size = libm::exp10(s.range(low, high));
    if s.uniform() < 0.5 { -size } else { size }
}

fn around(radius: f64, height: f64, turn: f64) -> DVec3 {
    DVec3::new(radius * libm::cos(turn), height, radius * libm::sin(turn))
}

/// Asserts that as many crossings are found as there are, and a nearest one if there is any.
#[track_caller]
fn complete(shape: &Revolution, ray: &Ray) {
    let (found, expected) = (all(shape, ray), truth(shape, ray));
    assert_eq!(
        found.len(),
        expected.len(),
        "{ray:?} {found:?} {expected:?}"
    );
    assert_eq!(ours(shape, ray).is_some(), !expected.is_empty(), "{ray:?}");
}

/// For `count` random choices.
fn each(seed: u64, count: u64, test: impl Fn(&mut Stream)) {
    for index in 0..count {
        test(&mut Stream::new(seed, Purpose::Test, index));
    }
}

/// A joint's root belongs to one of its two pieces, by the sign of f; a neighbour solved by other arithmetic need not take it.
#[test]
fn nearly_level_rays_lose_nothing_at_joints() {
    each(91, 3000, |s| {
        let (base, r, up) = (s.range(-1.0, 1.0), s.range(0.3, 1.0), s.range(0.2, 1.0));
        let shape = revolve(vec![
            line([r * s.range(0.3, 1.7), base + up], [r, base]),
            line([r, base], [r * s.range(0.3, 1.7), base]),
        ]);
        let rim = r * (1.0 + power(s, -17.0, -5.0));
        let at = around(rim, base + power(s, -18.0, -9.0), s.range(0.0, 6.3));
        let mut d = around(1.0, 0.0, s.range(0.0, 6.3));
        d.y = power(s, -6.0, -2.9);
        complete(&shape, &Ray::new(at - d * s.range(0.5, 3.0), d));
    });
    let shape = revolve(vec![
        Piece {
            radius: [
                0.6627743978007296,
                0.5800654350331252,
                0.49735647226552093,
                0.41464750949791657,
            ],
            height: [
                0.5521660190019053,
                0.33140587152289147,
                0.11064572404387768,
                -0.11011442343513611,
            ],
        },
        Piece {
            radius: [
                0.41464750949791657,
                0.4364891070051045,
                0.45833070451229246,
                0.4801723020194804,
            ],
            height: [-0.11011442343513611; 4],
        },
    ]);
    let ray = Ray::new(
        DVec3::new(0.1184890710386643, -0.1102845296763708, 0.4081698638628585),
        DVec3::new(
            -0.33694998388947733,
            2.0297637996734237e-4,
            -0.9415225479811309,
        ),
    );
    complete(&shape, &ray);
}

/// Along a wall t is uncertain by far more than 10⁻⁷ though no root is double: a range may end anywhere there.
#[test]
fn rays_along_walls_end_where_their_range_does() {
    each(92, 600, |s| {
        let (r, climb, base) = (s.range(0.3, 1.5), s.range(0.5, 2.0), s.range(-1.0, 1.0));
        let end = if s.uniform() < 0.5 {
            r
        } else {
            s.range(0.3, 1.5)
        };
        let shape = revolve(vec![line([r, base], [end, base + climb])]);
        let (turn, share, aside) = (s.range(0.0, 6.3), s.range(0.1, 0.9), power(s, -14.0, -3.0));
        let at = around(r + (end - r) * share, base + climb * share, turn);
        let along = around(end - r, climb, turn);
        let normal = around(climb, r - end, turn);
        let d = (along + normal * aside) * s.range(0.3, 3.0);
        let ray = Ray::new(at - d * s.range(0.8, 4.0), d);
        complete(&shape, &ray);
        for crossing in truth(&shape, &ray) {
            let mut part = ray;
            part.t_max = crossing.t + power(s, -14.0, -1.5);
            complete(&shape, &part);
        }
    });
}

/// What is found on one piece near a joint may be a crossing of the other, which tells t better or worse.
#[test]
fn rays_along_a_wall_through_its_rim_meet_the_cap() {
    each(93, 3000, |s| {
        let (base, r, climb) = (s.range(-1.0, 1.0), s.range(0.5, 1.5), s.range(0.5, 2.0));
        let top = base + climb;
        let shape = revolve(vec![
            line([0.0, base], [r, base]),
            line([r, base], [r, top]),
            line([r, top], [0.0, top]),
        ]);
        let turn = s.range(0.0, 6.3);
        let d = DVec3::new(0.0, climb, 0.0) + around(climb * power(s, -13.0, -2.0), 0.0, turn);
        let height = if s.uniform() < 0.5 { base } else { top };
        let at = around(r * (1.0 + power(s, -17.0, -12.0)), height, turn);
        let ray = Ray::new(at - d * s.range(-1.5, 3.0), d);
        complete(&shape, &ray);
        let found = all(&shape, &ray);
        for (found, expected) in found.iter().zip(truth(&shape, &ray)) {
            let cosine = shape.hit(&ray, expected).normal.dot(ray.direction).abs();
            let size = ray.origin.length() + expected.t.abs() * d.length() + 3.0;
            let permitted = 200.0 * f64::EPSILON * size / cosine;
            assert!(
                (found.t - expected.t).abs() <= permitted,
                "{ray:?} {found:?} {expected:?}"
            );
        }
    });
}

/// The range of a ray may end between the two crossings that two pieces would give for one root at their joint.
#[test]
fn a_range_that_begins_at_a_joint_keeps_what_lies_beyond() {
    let shape = revolve(vec![
        Piece {
            radius: [
                0.1,
                0.5605500535080549,
                1.0211001070161099,
                1.4816501605241648,
            ],
            height: [0.15368544752496693; 4],
        },
        Piece {
            radius: [
                1.4816501605241648,
                1.5138933980221552,
                1.5461366355201456,
                1.578379873018136,
            ],
            height: [
                0.15368544752496693,
                0.3405194868986219,
                0.5273535262722768,
                0.7141875656459319,
            ],
        },
    ]);
    let mut ray = Ray::new(
        DVec3::new(-1.7886522324318788, 0.14752306952527214, 2.223144265175136),
        DVec3::new(
            0.7763853383846063,
            4.295723949196667e-3,
            -0.6302585234183036,
        ),
    );
    ray.t_min = 1.4345377106569424;
    complete(&shape, &ray);
}

/// From far away the rounding of q, squared, is all there is of a small hole.
#[test]
fn far_rays_meet_discs_beside_their_small_holes() {
    each(94, 1500, |s| {
        let reach = libm::exp10(s.range(7.0, 20.0));
        let hole = (reach * 1e-16 * libm::exp10(s.range(-1.0, 1.0))).min(0.5);
        let shape = revolve(vec![line([hole, 0.0], [1.0, 0.0])]);
        let d = around(1.0, s.range(0.1, 1.5), s.range(0.0, 6.3)) * s.range(0.5, 2.0);
        let beside = hole * libm::exp10(s.range(-0.5, 0.5));
        let at = around(beside, 0.0, s.range(0.0, 6.3));
        complete(&shape, &Ray::new(at - d * reach, d));
    });
}

/// From far away the rounding of the distance from the axis, squared, is all there is of a needle.
#[test]
fn far_level_rays_invent_nothing_at_needles() {
    each(95, 1500, |s| {
        let reach = libm::exp10(s.range(2.0, 13.0));
        let radius = (reach * 1e-16 * libm::exp10(s.range(-1.0, 1.0))).min(0.5);
        let shape = revolve(vec![line([radius, -1.0], [radius, 1.0])]);
        let mut d = around(1.0, 0.0, s.range(0.0, 6.3));
        d.y = power(s, -18.0, -3.5);
        let beside = radius * libm::exp10(s.range(-0.5, 0.5));
        let at = around(beside, s.range(-0.5, 0.5), s.range(0.0, 6.3));
        complete(&shape, &Ray::new(at - d * reach, d));
    });
}

/// Products of a steep ray's slope with a thin can's radius are below all numbers.
#[test]
fn nearly_upright_rays_meet_the_caps_of_thin_cans() {
    each(96, 4000, |s| {
        let radius = libm::exp10(s.range(-80.0, 0.0));
        let shape = revolve(vec![
            line([0.0, -1.0], [radius, -1.0]),
            line([radius, -1.0], [radius, 1.0]),
            line([radius, 1.0], [0.0, 1.0]),
        ]);
        let d = DVec3::new(power(s, -165.0, -90.0), 1.0, 0.0);
        let at = around(
            radius * s.range(0.0, 1.3),
            s.range(-3.0, 3.0),
            s.range(0.0, 6.3),
        );
        complete(&shape, &Ray::new(at, d));
    });
}

/// Ends that only centring makes the same are two.
#[test]
fn ends_a_hair_apart_are_not_joined() {
    each(97, 1500, |s| {
        let (gap, up) = (power(s, -30.0, -16.0), s.range(0.3, 2.0));
        let corners = [[1.3 + s.range(0.0, 0.7), up], [s.range(0.2, 0.9), 1.1 * up]];
        let shape = revolve(vec![
            line([1.0, 0.0], corners[0]),
            line(corners[0], corners[1]),
            line(corners[1], [1.0, gap]),
        ]);
        let turn = s.range(0.0, 6.3);
        let d = DVec3::new(libm::cos(turn), s.range(-1.0, 1.0), 0.3 * libm::sin(turn));
        let mut ray = Ray::new(DVec3::new(1.0, gap * s.range(-1.0, 2.0), 0.0), d);
        ray.t_min = -1.0;
        complete(&shape, &ray);
    });
}
