//! What is inside a surface of revolution.

use super::support::{line, placed, polygon};
use glam::DVec3;
use photolathe::geometry::hit::Crossing;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::membership::{Membership, membership};
use photolathe::geometry::revolution::{Solver, exact};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;
use photolathe::scene::sampling::uniform_sphere;

/// Outside, on, or inside by the sign of a function that is negative inside.
fn by_sign(value: f64) -> Membership {
    if value == 0.0 {
        Membership::On
    } else if value < 0.0 {
        Membership::Inside
    } else {
        Membership::Outside
    }
}

/// Numbers around `x`: a neighbour on either side, and farther ones.
fn around(x: f64) -> [f64; 7] {
    [
        x - 0.5,
        x - 1e-14,
        x.next_down(),
        x,
        x.next_up(),
        x + 1e-14,
        x + 0.5,
    ]
}

#[test]
fn a_point_of_a_cylinder_is_known_to_the_last_bit() {
    let cylinder = polygon(&[[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]]);
    let heights = around(0.0).into_iter().chain(around(3.0)).chain([1.0, 2.0]);
    for y in heights {
        for x in around(2.0).into_iter().chain([0.0, 1e-300, 0.7]) {
            let expected = by_sign((x - 2.0).max(-y).max(y - 3.0));
            for point in [DVec3::new(x, y, 0.0), DVec3::new(0.0, y, -x)] {
                assert_eq!(membership(&cylinder, point), expected, "{point}");
            }
        }
    }
}

#[test]
fn a_point_of_a_cone_is_known_to_the_last_bit() {
    // r = h, from the tip up to the lid at 1: (3, 4, 5)/8 is on it.
    let cone = polygon(&[[0.0, 0.0], [3.0, 3.0], [0.0, 3.0]]);
    for y in around(0.625).into_iter().chain([0.0, -0.1, 1e-300]) {
        let point = DVec3::new(0.375, y, -0.5);
        assert_eq!(membership(&cone, point), by_sign(0.625 - y), "{y}");
    }
    for (y, expected) in [
        (0.0, Membership::On),
        (f64::MIN_POSITIVE, Membership::Inside),
        (-f64::MIN_POSITIVE, Membership::Outside),
        (3.0, Membership::On),
    ] {
        assert_eq!(membership(&cone, DVec3::new(0.0, y, 0.0)), expected, "{y}");
    }
}

/// h = r², closed by a lid at 9: inside is x² + z² < y < 9, and for coordinates of few bits that is exact in f64.
#[test]
fn a_point_of_a_paraboloid_is_known_to_the_last_bit() {
    let bowl = Piece {
        radius: [0.0, 1.0, 2.0, 3.0],
        height: [0.0, 0.0, 3.0, 9.0],
    };
    let profile = Profile::new(vec![bowl, line([3.0, 9.0], [0.0, 9.0])]).unwrap();
    let mut stream = Stream::new(1, Purpose::Experiment, 0);
    for _ in 0..300 {
        let coordinate = |u: f64| (u * 2048.0).floor() / 1024.0 - 1.0;
        let [x, z] = stream.uniform2().map(coordinate);
        let square = x * x + z * z;
        for y in [square, square.next_up(), square.next_down(), square + 1e-15] {
            let found = membership(&profile, DVec3::new(x, y, z));
            assert_eq!(found, by_sign(square - y), "{x} {y} {z}");
        }
    }
}

/// Parity of the exact oracle's crossings along a ray without special position.
fn by_crossings(profile: &Profile, point: DVec3) -> Membership {
    let ray = Ray::new(point, DVec3::new(0.371, 0.283, -0.617));
    let solid = placed(profile.clone());
    let count = solid.crossings(&ray, &Solver::Exact, &mut Work::default());
    if count.len() % 2 == 1 {
        Membership::Inside
    } else {
        Membership::Outside
    }
}

/// A closed profile that cuts itself, runs through the axis to negative radii and back, and has level tangents.
fn knotted() -> Profile {
    let points = [
        [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [-1.0, 1.0]],
        [[-1.0, 1.0], [-2.0, 0.5], [2.0, 0.5], [1.0, 1.5]],
        [[1.0, 1.5], [0.5, 2.0], [-2.0, 3.0], [0.0, 3.0]],
    ];
    Profile::new(points.map(Piece::new).to_vec()).unwrap()
}

#[test]
fn membership_is_the_parity_of_exact_crossings() {
    let mut stream = Stream::new(2, Purpose::Experiment, 0);
    for profile in [Profile::cup(), Profile::hourglass(), knotted()] {
        let (radius, height) = profile.control_size();
        let joints: Vec<f64> = profile.pieces().iter().map(|p| p.height[0]).collect();
        let mut inside = 0;
        for i in 0..400 {
            let [a, b] = stream.uniform2();
            let [c, _] = stream.uniform2();
            let level = joints[i % joints.len()];
            let y = if i.is_multiple_of(3) {
                level
            } else {
                1.3 * height * (2.0 * c - 1.0)
            };
            let point = DVec3::new(radius * (2.0 * a - 1.0), y, radius * (2.0 * b - 1.0));
            let found = membership(&profile, point);
            if found == Membership::On {
                assert!(
                    y.abs() == 1.0,
                    "only the level caps of the hourglass: {point}"
                );
                continue;
            }
            assert_eq!(found, by_crossings(&profile, point), "{point}");
            inside += usize::from(found == Membership::Inside);
        }
        assert!(inside > 10);
    }
}

#[test]
fn an_open_profile_counts_as_closed_by_level_discs() {
    let tube = polygon(&[[1.0, 0.0], [4.0, 6.0]]);
    for (x, y, expected) in [
        (0.5, 0.5, Membership::Inside),
        (1.4, 0.5, Membership::Outside),
        (0.0, 6.5, Membership::Outside),
        (0.0, -0.5, Membership::Outside),
        (2.5, 3.0, Membership::On),
    ] {
        assert_eq!(membership(&tube, DVec3::new(x, y, 0.0)), expected);
    }
}

#[test]
fn extreme_points_and_sizes_have_an_answer() {
    let sized = |s: f64| polygon(&[[0.0, 0.0], [s, 0.0], [s, s], [0.0, s]]);
    for s in [1e-300, 1e-160, 1.0, 1e160, 1e300] {
        let middle = DVec3::new(0.5 * s, 0.5 * s, 0.0);
        assert_eq!(membership(&sized(s), middle), Membership::Inside, "{s}");
        assert_eq!(membership(&sized(s), 3.0 * middle), Membership::Outside);
    }
    for bad in [DVec3::NAN, DVec3::INFINITY, DVec3::splat(f64::MAX)] {
        assert_eq!(membership(&sized(1.0), bad), Membership::Outside);
    }
}

/// Points a few roundings off the surface, on both sides and on it: along any line from a point inside, the exact solver counts an odd
/// number of crossings.
#[test]
fn within_rounding_of_the_surface_membership_is_the_parity_of_exact_crossings() {
    let mut stream = Stream::new(6, Purpose::Experiment, 0);
    let mut told = [0; 3];
    for profile in [Profile::cup(), Profile::hourglass()] {
        let shape = placed(profile);
        for _ in 0..400 {
            let away = uniform_sphere(stream.uniform2());
            let piece = (6.0 * stream.uniform()) as u32;
            let crossing = Crossing {
                t: 0.0,
                piece,
                u: stream.uniform(),
            };
            let hit = shape.hit(&Ray::new(away, away), crossing);
            let off = stream.range(-4.0, 4.0) * f64::EPSILON;
            let point = hit.point + off * hit.normal;
            let line = Ray::new(point, uniform_sphere(stream.uniform2()));
            let odd = exact::crossings(shape.profile(), &line).len() % 2 == 1;
            match shape.membership(point) {
                Membership::On => told[2] += 1,
                inside => {
                    assert_eq!(inside == Membership::Inside, odd, "{point} {inside:?}");
                    told[usize::from(odd)] += 1;
                }
            }
        }
    }
    assert!(told[0] > 200 && told[1] > 200, "{told:?}");
}

/// An arch from (3, 0) over (2, 3/4) to (1, 0): at the very height of its top, a half-line touches it and passes no wall.
#[test]
fn a_half_line_that_touches_the_top_of_an_arch_crosses_nothing() {
    let arch = Piece {
        radius: [3.0, 3.0, 1.0, 1.0],
        height: [0.0, 1.0, 1.0, 0.0],
    };
    let arch = Profile::new(vec![arch]).unwrap();
    let at = |x: f64, y: f64| membership(&arch, DVec3::new(x, y, 0.0));
    for x in [0.5, 2.0_f64.next_down(), 2.0_f64.next_up()] {
        assert_eq!(at(x, 0.75), Membership::Outside, "{x}");
    }
    assert_eq!(at(2.0, 0.75), Membership::On);
    assert_eq!(at(2.0, 0.75_f64.next_down()), Membership::Inside);
    assert_eq!(at(0.5, 0.5), Membership::Outside);
}

/// The squares of the radii vanish.
#[test]
fn a_rod_too_thin_for_squares_has_an_inside_and_an_outside() {
    let r = 1e-170;
    let rod = polygon(&[[0.0, 0.0], [r, 0.0], [r, 1.0], [0.0, 1.0]]);
    for (x, expected) in [(0.5, Membership::Inside), (2.0, Membership::Outside)] {
        let point = DVec3::new(x * r, 0.5, 0.0);
        assert_eq!(membership(&rod, point), expected, "{x}");
    }
}
