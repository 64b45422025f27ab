//! The exact oracle: closed forms, planted answers, multiplicities, joints, ranges and extreme input.

use glam::DVec3;
use photolathe::experiments::cup::random_ray;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::exact::{certified, crossings};
use photolathe::numeric::rng::{Purpose, Stream};

fn profile(pieces: &[([f64; 4], [f64; 4])]) -> Profile {
    let piece = |&(radius, height): &([f64; 4], [f64; 4])| Piece { radius, height };
    Profile::new(pieces.iter().map(piece).collect()).unwrap()
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    Ray::new(DVec3::from(origin), DVec3::from(direction))
}

fn times(profile: &Profile, ray: &Ray) -> Vec<f64> {
    crossings(profile, ray).iter().map(|c| c.t).collect()
}

fn multiplicities(profile: &Profile, ray: &Ray) -> Vec<u32> {
    let found = certified(profile, ray);
    found.iter().map(|c| c.multiplicity).collect()
}

fn random_vector(stream: &mut Stream, size: f64) -> DVec3 {
    DVec3::from_array([0; 3].map(|_| stream.range(-size, size)))
}

/// Value of a cubic with these control values.
fn bezier(c: [f64; 4], u: f64) -> f64 {
    let v = 1.0 - u;
    c[0] * v * v * v + 3.0 * c[1] * v * v * u + 3.0 * c[2] * v * u * u + c[3] * u * u * u
}

/// Compares the oracle with the quadric a t² + 2 b t + c = 0 cut to 0 < h < 3, on rays whose answer is not within 1e-6 of a
/// change.
fn agrees_with_quadric(
    profile: &Profile,
    seed: u64,
    coefficients: impl Fn(DVec3, DVec3) -> [f64; 3],
) {
    let mut hits = 0;
    for index in 0..6000 {
        let mut stream = Stream::new(seed, Purpose::Test, index);
        let origin = random_vector(&mut stream, 6.0);
        let ray = Ray::new(origin, random_vector(&mut stream, 1.0));
        let [a, b, c] = coefficients(ray.origin, ray.direction);
        let root = (b * b - a * c).sqrt();
        let mut all = vec![(-b - root) / a, (-b + root) / a];
        all.retain(|t| t.is_finite());
        all.sort_by(f64::total_cmp);
        let height = |t: f64| ray.at(t).y;
        let near_change = |&t: &f64| {
            let y = height(t);
            y.abs().min((y - 3.0).abs()).min(t.abs()) < 1e-6
        };
        if (b * b - a * c).abs() < 1e-6 || all.iter().any(near_change) {
            continue;
        }
        all.retain(|&t| t > 0.0 && 0.0 < height(t) && height(t) < 3.0);
        let found = times(profile, &ray);
        assert_eq!(found.len(), all.len(), "ray {index}");
        for (f, e) in found.iter().zip(&all) {
            assert!((f - e).abs() < 1e-8 * (1.0 + e.abs()), "ray {index}");
            hits += 1;
        }
    }
    assert!(hits > 300, "only {hits} hits");
}

#[test]
fn a_straight_upright_piece_is_the_cylinder() {
    let cylinder = profile(&[([2.0; 4], [0.0, 1.0, 2.0, 3.0])]);
    let flat = |p: DVec3, q: DVec3| p.x * q.x + p.z * q.z;
    agrees_with_quadric(&cylinder, 1, |o, d| {
        [flat(d, d), flat(o, d), flat(o, o) - 4.0]
    });
}

#[test]
fn a_straight_slanted_piece_is_the_cone_of_one_nappe() {
    let cone = profile(&[([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0])]);
    let form = |p: DVec3, q: DVec3| p.x * q.x + p.z * q.z - p.y * q.y;
    agrees_with_quadric(&cone, 2, |o, d| [form(d, d), form(o, d), form(o, o)]);
}

#[test]
fn a_parabola_is_the_paraboloid() {
    let bowl = profile(&[([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 3.0])]);
    let flat = |p: DVec3, q: DVec3| p.x * q.x + p.z * q.z;
    agrees_with_quadric(&bowl, 3, |o, d| {
        [flat(d, d), flat(o, d) - 1.5 * d.y, flat(o, o) - 3.0 * o.y]
    });
}

#[test]
fn a_straight_level_piece_is_the_annulus() {
    let annulus = profile(&[([1.0, 2.0, 3.0, 4.0], [0.5; 4])]);
    let mut hits = 0;
    for index in 0..2000 {
        let mut stream = Stream::new(4, Purpose::Test, index);
        let origin = random_vector(&mut stream, 4.0);
        let ray = Ray::new(origin, random_vector(&mut stream, 1.0));
        let t = (0.5 - ray.origin.y) / ray.direction.y;
        let p = ray.at(t);
        let rho = (p.x * p.x + p.z * p.z).sqrt();
        if (rho - 1.0).abs().min((rho - 4.0).abs()) < 1e-9 {
            continue;
        }
        let hit = t > 0.0 && 1.0 < rho && rho < 4.0;
        let found = times(&annulus, &ray);
        assert_eq!(found.len(), usize::from(hit), "ray {index}");
        if hit {
            assert!((found[0] - t).abs() <= 4.0 * f64::EPSILON * t.abs());
            hits += 1;
        }
    }
    assert!(hits > 200, "only {hits} hits");
}

/// Whole control values, a dyadic u and a dyadic direction make every number exact: the planted t must come back to the bit.
#[test]
fn planted_crossings_come_back_to_the_bit() {
    let mut planted = 0;
    for index in 0..3000 {
        let mut stream = Stream::new(5, Purpose::Test, index);
        let mut whole = |low: f64, high: f64| stream.range(low, high + 1.0).floor();
        let radius = [0; 4].map(|_| 64.0 * whole(-8.0, 8.0));
        let height = [0; 4].map(|_| 64.0 * whole(-8.0, 8.0));
        let u = whole(0.0, 16.0) / 16.0;
        let (r, h) = (bezier(radius, u), bezier(height, u));
        let points = [[0.0, h, r], [r, h, 0.0], [0.0, h, -r]];
        let point = DVec3::from(points[index as usize % 3]);
        let slope = if index % 5 == 0 {
            0.0
        } else {
            whole(-9.0, 9.0)
        };
        let direction = DVec3::new(whole(-9.0, 9.0), slope, whole(-9.0, 9.0));
        let t = whole(1.0, 7.0) / 4.0;
        let line = Ray::new(point - t * direction, direction);
        if !line.is_valid() || radius == [0.0; 4] || (slope == 0.0 && height == [h; 4]) {
            continue;
        }
        let closed = radius[0] == radius[3] && height[0] == height[3];
        let at_planted = |v: f64| (v - u).abs() < 1e-15 || (closed && u == 0.0 && v == 1.0);
        let found = crossings(&profile(&[(radius, height)]), &line);
        assert!(
            found.iter().any(|c| c.t == t && at_planted(c.u)) || found.is_empty(),
            "ray {index}: ({t}, {u}) is not among {found:?}"
        );
        planted += usize::from(!found.is_empty());
    }
    // The rays without any crossing run within their piece (a generator through the planted point).
    assert!(planted > 2900, "{planted}");
}

#[test]
fn a_tangency_is_one_crossing_of_multiplicity_two_and_its_neighbours_are_none_and_two() {
    let barrel = profile(&[([1.0, 3.0, 3.0, 1.0], [0.0, 1.0, 2.0, 3.0])]);
    let down = |rho: f64| ray([rho, 5.0, 0.0], [0.0, -1.0, 0.0]);
    assert_eq!(multiplicities(&barrel, &down(2.5)), [2]);
    assert_eq!(times(&barrel, &down(2.5)), [3.5]);
    assert_eq!(multiplicities(&barrel, &down(2.5_f64.next_down())), [1, 1]);
    assert!(crossings(&barrel, &down(2.5_f64.next_up())).is_empty());
    let across = |x: f64| ray([x, 1.5, -9.0], [0.0, 0.0, 1.0]);
    assert_eq!(multiplicities(&barrel, &across(2.5)), [2]);
    assert_eq!(times(&barrel, &across(2.5)), [9.0]);
    let inside = across(2.5_f64.next_down());
    assert_eq!(multiplicities(&barrel, &inside), [1, 1]);
    assert!(crossings(&barrel, &across(2.5_f64.next_up())).is_empty());
}

/// The double root u = 1/3 is not dyadic, so only the square-free decomposition can end.
#[test]
fn a_tangency_at_a_parameter_that_is_not_dyadic_is_recognised() {
    let waist = profile(&[([4.0, -2.0, 1.0, 13.0], [0.0, 1.0, 2.0, 3.0])]);
    let down = |rho: f64| ray([0.0, 5.0, rho], [0.0, -2.0, 0.0]);
    assert_eq!(multiplicities(&waist, &down(1.0)), [2]);
    assert_eq!(times(&waist, &down(1.0)), [2.0]);
    assert!((crossings(&waist, &down(1.0))[0].u - 1.0 / 3.0).abs() < 1e-16);
    assert_eq!(multiplicities(&waist, &down(1.0_f64.next_up())), [1, 1]);
    assert!(crossings(&waist, &down(1.0_f64.next_down())).is_empty());
}

#[test]
fn a_ray_along_an_inflection_meets_it_once_with_multiplicity_three() {
    let wave = profile(&[([1.0, 3.0, 1.0, 3.0], [0.0, 1.0, 2.0, 3.0])]);
    for rho in [2.0, 2.0_f64.next_up(), 2.0_f64.next_down()] {
        let found = multiplicities(&wave, &ray([rho, 5.0, 0.0], [0.0, -1.0, 0.0]));
        assert_eq!(found, [if rho == 2.0 { 3 } else { 1 }]);
    }
}

#[test]
fn the_axis_meets_the_cup_at_its_two_caps() {
    let found = crossings(&Profile::cup(), &ray([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]));
    let expected = [(5.0 - 1.3, 5, 1.0), (5.0 - 0.04, 0, 0.0)];
    assert_eq!(found.len(), 2);
    for (crossing, (t, piece, u)) in found.iter().zip(expected) {
        assert!((crossing.t - t).abs() <= f64::EPSILON * 4.0);
        assert_eq!((crossing.piece, crossing.u), (piece, u));
    }
}

#[test]
fn a_point_shared_by_two_pieces_counts_once() {
    let chain = profile(&[
        ([1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 2.0, 3.0]),
        ([4.0; 4], [3.0, 4.0, 5.0, 6.0]),
    ]);
    let directions = [
        [-1.0, 0.0, 0.0],
        [-1.0, 0.25, 0.0],
        [-1.0, -0.25, 0.5],
        [-0.5, 1.0, 0.0],
    ];
    for direction in directions {
        let mut aimed = ray([4.0, 3.0, 0.0], direction);
        aimed.origin -= 2.0 * aimed.direction;
        aimed.t_max = 2.5;
        assert_eq!(times(&chain, &aimed), [2.0], "{direction:?}");
    }
}

/// The end of the last piece is the start of the first, or of the same piece.
#[test]
fn the_joint_of_a_closed_profile_counts_once() {
    let ring = profile(&[
        ([2.0, 2.0, 4.0, 4.0], [0.0, 1.0, 1.0, 0.0]),
        ([4.0, 4.0, 2.0, 2.0], [0.0, -1.0, -1.0, 0.0]),
    ]);
    let drop = profile(&[([2.0, 6.0, 6.0, 2.0], [0.0, 3.0, -3.0, 0.0])]);
    for surface in [ring, drop] {
        let mut aimed = ray([2.0, 0.0, 0.0], [1.0, 0.125, 0.0]);
        aimed.origin -= aimed.direction;
        aimed.t_max = 1.25;
        assert_eq!(times(&surface, &aimed), [1.0]);
        aimed.t_min = f64::NEG_INFINITY;
        aimed.t_max = f64::INFINITY;
        assert_eq!(times(&surface, &aimed).len() % 2, 0);
    }
}

/// The curve is symmetric about u = 1/2 in height 3/2 and passes that height three times, twice at one point.
#[test]
fn both_sheets_of_a_loop_count_where_they_cross() {
    let lasso = profile(&[([8.0, 0.0, 0.0, 8.0], [0.0, 9.0, -6.0, 3.0])]);
    let found = times(&lasso, &ray([-20.0, 1.5, 0.0], [1.0, 0.0, 0.0]));
    assert_eq!(found.len(), 6, "{found:?}");
    let pairs = found.windows(2).filter(|w| w[0] == w[1]).count();
    assert_eq!(pairs, 2, "{found:?}");
}

#[test]
fn a_ray_within_a_piece_and_a_piece_without_area_give_no_crossing() {
    let disc = profile(&[([0.0, 1.0, 2.0, 3.0], [1.0; 4])]);
    assert!(crossings(&disc, &ray([-9.0, 1.0, 0.0], [1.0, 0.0, 0.0])).is_empty());
    let cone = profile(&[([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0])]);
    assert!(crossings(&cone, &ray([-9.0, -9.0, 0.0], [1.0, 1.0, 0.0])).is_empty());
    let cylinder = profile(&[([3.0; 4], [0.0, 1.0, 2.0, 3.0])]);
    let along = ray([3.0, -9.0, 0.0], [0.0, 1.0, 0.0]);
    assert!(crossings(&cylinder, &along).is_empty());
    for radius in [0.0, 3.0] {
        let point = profile(&[([radius; 4], [1.0; 4])]);
        for aimed in [
            ray([-9.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
            ray([radius - 9.0, -8.0, 0.0], [1.0, 1.0, 0.0]),
        ] {
            assert!(crossings(&point, &aimed).is_empty());
        }
    }
    let segment = profile(&[([0.0; 4], [0.0, 1.0, 2.0, 3.0])]);
    assert!(crossings(&segment, &ray([-9.0, 1.0, 0.0], [1.0, 0.0, 0.0])).is_empty());
}

#[test]
fn a_ray_in_the_plane_of_a_lid_meets_the_edge_of_the_wall_below_it() {
    let can = profile(&[
        ([3.0; 4], [0.0, 1.0, 2.0, 3.0]),
        ([3.0, 2.0, 1.0, 0.0], [3.0; 4]),
    ]);
    let level = ray([-9.0, 3.0, 0.0], [1.0, 0.0, 0.0]);
    assert_eq!(times(&can, &level), [6.0, 12.0]);
}

/// The point (0, 3/4, 3/2) of h = r²/3 lies on each line at t = 4.
#[test]
fn the_range_is_open_at_both_ends_to_the_last_bit() {
    let bowl = profile(&[([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 3.0])]);
    for direction in [[0.0, -0.5, 0.0], [0.0, -0.5, 0.25], [0.0, 0.0, 1.0]] {
        let mut aimed = ray([0.0, 0.75, 1.5], direction);
        aimed.origin -= 4.0 * aimed.direction;
        let count = |t_min: f64, t_max: f64| {
            let cut = Ray {
                t_min,
                t_max,
                ..aimed
            };
            times(&bowl, &cut).iter().filter(|&&t| t == 4.0).count()
        };
        assert_eq!(count(0.0, 9.0), 1);
        assert_eq!(count(4.0, 9.0), 0);
        assert_eq!(count(4.0_f64.next_down(), 9.0), 1);
        assert_eq!(count(0.0, 4.0), 0);
        assert_eq!(count(0.0, 4.0_f64.next_up()), 1);
        assert_eq!(count(f64::NEG_INFINITY, f64::INFINITY), 1);
    }
}

#[test]
fn a_crossing_at_the_origin_has_t_zero_exactly() {
    let bowl = profile(&[([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 3.0])]);
    for direction in [[0.3, -0.5, 0.1], [0.3, 0.0, 0.1]] {
        let mut aimed = ray([0.0, 0.75, 1.5], direction);
        aimed.t_min = -1e-3;
        assert!(times(&bowl, &aimed).contains(&0.0));
        aimed.t_min = 0.0;
        assert!(!times(&bowl, &aimed).contains(&0.0));
    }
}

/// The polynomial's roots come in pairs as close as d_y; at 5e-324 they are told apart by two thousand bisections or so.
#[test]
fn nearly_level_rays_tend_to_the_level_ray() {
    let surface = Profile::cup();
    let aimed = |y: f64, dy: f64| times(&surface, &ray([-9.0, y, 0.3], [1.0, dy, 0.0]));
    for (y, count) in [(1.0, 2), (2.05, 4)] {
        let level = aimed(y, 0.0);
        assert_eq!(level.len(), count);
        for size in [1e-12, 1e-30, 1e-100, 1e-300, 5e-324] {
            for dy in [size, -size] {
                let found = aimed(y, dy);
                assert_eq!(found.len(), count, "y {y} dy {dy}");
                for (a, b) in found.iter().zip(&level) {
                    assert!((a - b).abs() < 1e-9, "y {y} dy {dy}");
                }
            }
        }
    }
}

#[test]
fn powers_of_two_scale_the_answer_to_the_bit() {
    let surface = Profile::cup();
    for power in [-900, -60, 60, 900] {
        let scale = libm::scalbn(1.0, power);
        let pieces = surface.pieces().iter().map(|p| Piece {
            radius: p.radius.map(|x| x * scale),
            height: p.height.map(|x| x * scale),
        });
        let scaled = Profile::new(pieces.collect()).unwrap();
        for index in 0..40 {
            let one = random_ray(&mut Stream::new(6, Purpose::Test, index));
            let other = Ray::new(one.origin * scale, one.direction);
            let expected: Vec<f64> = times(&surface, &one).iter().map(|t| t * scale).collect();
            assert_eq!(times(&scaled, &other), expected);
        }
    }
}

#[test]
fn rays_that_are_not_rays_have_no_crossing() {
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(crossings(&Profile::cup(), &ray([bad, 0.0, 0.0], [1.0, 0.0, 0.0])).is_empty());
        assert!(crossings(&Profile::cup(), &ray([0.0; 3], [1.0, bad, 0.0])).is_empty());
    }
    assert!(crossings(&Profile::cup(), &ray([0.0; 3], [0.0; 3])).is_empty());
}

/// The cup is a solid: a line crosses it an even number of times (multiplicities counted), and every crossing lies on it.
#[test]
fn random_rays_cross_the_cup_evenly_and_at_points_of_it() {
    let surface = Profile::cup();
    let mut hits = 0;
    for index in 0..1500 {
        let ray = random_ray(&mut Stream::new(7, Purpose::Test, index));
        let found = certified(&surface, &ray);
        let total: u32 = found.iter().map(|c| c.multiplicity).sum();
        assert_eq!(total % 2, 0, "ray {index}");
        for crossing in found.iter() {
            let piece = surface.pieces()[crossing.piece as usize];
            let p = ray.at(crossing.t);
            let rho = (p.x * p.x + p.z * p.z).sqrt();
            assert!((p.y - bezier(piece.height, crossing.u)).abs() < 1e-13);
            assert!((rho - bezier(piece.radius, crossing.u).abs()).abs() < 1e-12);
            hits += 1;
        }
    }
    assert!(hits > 1500, "only {hits} hits");
}
