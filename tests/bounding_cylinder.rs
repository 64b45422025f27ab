//! Bounding volumes: cases B1 to B8 of the cylinder, and that no volume ever culls a crossing.

#[path = "solver/aim.rs"]
mod aim;
#[path = "solver/profiles.rs"]
mod profiles;
#[path = "solver/volumes.rs"]
mod volumes;

use aim::{all_rays, rays};
use glam::DVec3;
use photolathe::geometry::bounds::{Bounding, Cylinder, Volume};
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, Revolution, Solver, exact};
use photolathe::geometry::specimens::line;
use photolathe::lab::families::Family;
use photolathe::numeric::work::Work;

/// An implementation of the cylinder test, for a cylinder that fits the profile.
type Interval = fn(&Profile, &Ray) -> Option<(f64, f64)>;

fn ours(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    Cylinder::of(profile).interval(ray)
}

fn in_place(profile: &Profile) -> Revolution {
    Revolution::new(profile.clone(), Placement::identity())
}

/// Rays whose exact crossings the implementation culls or leaves outside its interval.
fn lost(interval: Interval, profile: &Profile, count: u64) -> u64 {
    let mut lost = 0;
    for (_, ray) in all_rays(&in_place(profile), count) {
        let crossings = exact::crossings(profile, &ray);
        let kept = match interval(profile, &ray) {
            Some((low, high)) => crossings.iter().all(|c| low <= c.t && c.t <= high),
            None => crossings.is_empty(),
        };
        lost += u64::from(!kept);
    }
    lost
}

/// A waist of negative control radius that reaches farther than any positive one.
fn reversed() -> Profile {
    let piece = Piece {
        radius: [0.5, -3.0, -3.0, 0.5],
        height: [0.0, 1.0, 2.0, 3.0],
    };
    Profile::new(vec![piece]).expect("one piece joins")
}

#[test]
fn no_crossing_is_culled() {
    for profile in [Profile::cup(), Profile::hourglass(), reversed()] {
        assert_eq!(lost(ours, &profile, 60), 0);
    }
}

/// The original's discriminant test.
fn culls_parallel(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let across = ray.direction.x * ray.direction.x + ray.direction.z * ray.direction.z;
    ours(profile, ray).filter(|_| across > 0.0)
}

/// The original's radius: the greatest r, not the greatest |r|.
fn forgets_negative_radii(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let radii = profile.pieces().iter().flat_map(|piece| piece.radius);
    let radius = radii.fold(0.0, f64::max);
    Cylinder {
        radius,
        ..Cylinder::of(profile)
    }
    .interval(ray)
}

/// The original's inner cylinder: a ray that passes within the least control radius is culled.
fn culls_the_inner_cylinder(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let radii = profile.pieces().iter().flat_map(|piece| piece.radius);
    let inner = radii.fold(f64::INFINITY, f64::min);
    let across = libm::hypot(ray.direction.x, ray.direction.z);
    let cross = ray.origin.x * ray.direction.z - ray.origin.z * ray.direction.x;
    ours(profile, ray).filter(|_| cross.abs() > inner.abs() * across)
}

/// A bound from the ends of the pieces alone.
fn samples_the_ends(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let ends = || {
        profile
            .pieces()
            .iter()
            .flat_map(|p| [p.point(0), p.point(3)])
    };
    let fit = |k: usize| move |size: f64, point: [f64; 2]| size.max(point[k]);
    Cylinder {
        radius: ends().fold(0.0, fit(0)),
        bottom: ends().map(|p| p[1]).fold(f64::INFINITY, f64::min),
        top: ends().fold(f64::NEG_INFINITY, fit(1)),
    }
    .interval(ray)
}

#[test]
fn the_test_sees_known_wrong_cylinders() {
    assert!(lost(culls_parallel, &Profile::cup(), 30) > 0);
    assert!(lost(forgets_negative_radii, &reversed(), 30) > 0);
    assert!(lost(culls_the_inner_cylinder, &Profile::cup(), 30) > 0);
    assert!(lost(samples_the_ends, &Profile::cup(), 100) > 0);
}

const UNIT: Cylinder = Cylinder {
    radius: 1.0,
    bottom: -1.0,
    top: 1.0,
};

fn ray(o: [f64; 3], d: [f64; 3]) -> Ray {
    Ray::new(DVec3::from_array(o), DVec3::from_array(d))
}

/// The interval holds [low, high] and is hardly wider.
#[track_caller]
fn spans(cylinder: &Cylinder, ray: &Ray, low: f64, high: f64, slack: f64) {
    let (enter, leave) = cylinder.interval(ray).expect("not culled");
    assert!(enter <= low && low - enter <= slack, "{enter} {low}");
    assert!(leave >= high && leave - high <= slack, "{leave} {high}");
}

#[test]
fn b1_rays_along_the_axis_pass_inside_and_on_the_wall() {
    for x in [0.0, 0.5, 1.0] {
        spans(
            &UNIT,
            &ray([x, -3.0, 0.0], [0.0, 1.0, 0.0]),
            2.0,
            4.0,
            1e-13,
        );
        spans(
            &UNIT,
            &ray([0.0, 3.0, -x], [0.0, -2.0, 0.0]),
            1.0,
            2.0,
            1e-13,
        );
    }
    let outside = ray([1.001, -3.0, 0.0], [0.0, 1.0, 0.0]);
    assert_eq!(UNIT.interval(&outside), None);
}

#[test]
fn b2_a_tangent_of_the_wall_is_kept() {
    spans(
        &UNIT,
        &ray([1.0, 0.0, -5.0], [0.0, 0.0, 1.0]),
        5.0,
        5.0,
        1e-6,
    );
    spans(
        &UNIT,
        &ray([-3.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
        2.0,
        4.0,
        1e-13,
    );
    assert_eq!(
        UNIT.interval(&ray([1.001, 0.0, -5.0], [0.0, 0.0, 1.0])),
        None
    );
}

#[test]
fn b3_rays_through_caps_and_wall_have_both_ends() {
    spans(
        &UNIT,
        &ray([-0.5, -2.0, 0.0], [0.25, 1.0, 0.0]),
        1.0,
        3.0,
        1e-13,
    );
    spans(
        &UNIT,
        &ray([0.0, -2.0, 0.0], [0.5, 1.0, 0.0]),
        1.0,
        2.0,
        1e-13,
    );
    assert_eq!(UNIT.interval(&ray([2.0, -2.0, 0.0], [1.0, 1.0, 0.0])), None);
}

#[test]
fn b4_the_interval_may_be_partly_or_wholly_behind_the_origin() {
    spans(&UNIT, &ray([0.0; 3], [1.0, 0.0, 0.0]), -1.0, 1.0, 1e-13);
    spans(
        &UNIT,
        &ray([5.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        -6.0,
        -4.0,
        1e-13,
    );
    let cup = Revolution::new(Profile::cup(), Placement::identity());
    let mut work = Work::default();
    let away = ray([9.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    assert_eq!(cup.nearest(&away, &Solver::Bernstein, &mut work), None);
    assert_eq!(work.solver_calls, 0);
}

#[test]
fn b5_a_disc_and_a_segment_are_cylinders() {
    let disc = Cylinder {
        bottom: 0.5,
        top: 0.5,
        ..UNIT
    };
    spans(
        &disc,
        &ray([0.25, 2.0, 0.0], [0.0, -1.0, 0.0]),
        1.5,
        1.5,
        1e-13,
    );
    spans(
        &disc,
        &ray([-2.0, 0.5, 0.0], [1.0, 0.0, 0.0]),
        1.0,
        3.0,
        1e-13,
    );
    let segment = Cylinder {
        radius: 0.0,
        ..UNIT
    };
    spans(
        &segment,
        &ray([-2.0, 0.0, 0.0], [1.0, 0.25, 0.0]),
        2.0,
        2.0,
        1e-13,
    );
    spans(
        &segment,
        &ray([0.0, 3.0, 0.0], [0.0, -1.0, 0.0]),
        2.0,
        4.0,
        1e-13,
    );
    assert_eq!(
        segment.interval(&ray([-2.0, 0.0, 0.1], [1.0, 0.0, 0.0])),
        None
    );
}

#[test]
fn b6_the_cylinder_fits_the_curve_not_its_control_points() {
    let loose = Cylinder::of(&reversed());
    // r = 0.5 − 10.5 u (1 − u) is −2.125 at ½.
    assert!((loose.radius - 2.125).abs() < 1e-13 && loose.radius >= 2.125);
    let cup = Cylinder::of(&Profile::cup());
    assert!((cup.top - 2.15).abs() < 1e-13 && cup.bottom <= 0.0 && cup.bottom > -1e-13);
    assert_eq!(cup.radius, 3.8);
}

#[test]
fn b7_there_is_no_inner_cull() {
    let through_the_axis = ray([-9.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    assert!(ours(&Profile::hourglass(), &through_the_axis).is_some());
}

#[test]
fn b8_a_far_origin_does_not_cull() {
    for power in 0..=16 {
        let far = libm::exp10(f64::from(power));
        for side in [0.0, 0.5, 1.0] {
            let level = ray([-far, 0.25, side], [1.0, 0.0, 0.0]);
            assert!(UNIT.interval(&level).is_some());
            let steep = ray([far, far, side], [-1.0, -1.0, 0.0]);
            assert!(UNIT.interval(&steep).is_some());
        }
    }
}

#[test]
fn directions_of_any_length_and_size_pass() {
    for power in (-300..=300).step_by(50) {
        let s = libm::exp10(f64::from(power));
        for d in [[1.0, 0.25, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.5]] {
            let aimed = ray([0, 1, 2].map(|i| -2.0 * d[i]), d.map(|x| x * s));
            let (low, high) = UNIT.interval(&aimed).expect("not culled");
            assert!(low * s <= 2.0 && high * s >= 2.0, "{power}");
        }
        let scaled = Cylinder {
            radius: s,
            bottom: -s,
            top: s,
        };
        for d in [[1.0, 0.25, 0.0], [0.0, -1.0, 0.0]] {
            let aimed = ray([0, 1, 2].map(|i| -2.0 * d[i] * s), d);
            let (low, high) = scaled.interval(&aimed).expect("not culled");
            assert!(low <= 2.0 * s && high >= 2.0 * s, "{power}");
        }
    }
    for k in -320..0 {
        let almost_parallel = ray([0.5, -3.0, 0.0], [libm::exp10(f64::from(k)), 1.0, 0.0]);
        assert!(UNIT.interval(&almost_parallel).is_some(), "{k}");
        let almost_level = ray([-3.0, 0.0, 0.0], [1.0, libm::exp10(f64::from(k)), 0.0]);
        assert!(UNIT.interval(&almost_level).is_some() || k > -2, "{k}");
    }
}

#[test]
fn the_cylinder_holds_the_surface() {
    for profile in [Profile::cup(), Profile::hourglass(), reversed()] {
        let cylinder = Cylinder::of(&profile);
        for piece in profile.pieces() {
            for step in 0..=10_000_u16 {
                let at = piece.at(f64::from(step) / 10_000.0);
                // The point itself is rounded.
                let slack = 8.0 * f64::EPSILON * (cylinder.radius + cylinder.top.abs());
                assert!(at.radius.abs() <= cylinder.radius + slack);
                assert!(at.height >= cylinder.bottom - slack && at.height <= cylinder.top + slack);
            }
        }
    }
}

/// Tightness: of rays aimed at three times the width of the hourglass, most misses never reach the solver.
#[test]
fn most_rays_that_pass_by_are_culled() {
    let profile = Profile::hourglass();
    let mut wide = profile.pieces().to_vec();
    for piece in &mut wide {
        piece.radius = piece.radius.map(|r| 3.0 * r);
    }
    let wide = Profile::new(wide).expect("the pieces still join");
    let (mut missed, mut culled) = (0, 0);
    for aimed in rays(&in_place(&wide), Family::Random, 2_000) {
        if exact::crossings(&profile, &aimed).is_empty() {
            missed += 1;
            culled += u32::from(ours(&profile, &aimed).is_none());
        }
    }
    assert!(4 * culled > 3 * missed, "{culled} of {missed}");
}

/// Its centre is the cylinder's, and the rims of the cylinder lie on it, wherever the surface stands.
#[test]
fn the_bounding_ball_passes_through_both_rims() {
    let axis = DVec3::new(1.0, -2.0, 0.5);
    for placement in [
        Placement::identity(),
        Placement::new(DVec3::new(3.0, -2.0, 5.0), axis, 70.0, 2.5),
    ] {
        for profile in [Profile::cup(), Profile::hourglass(), reversed()] {
            let Cylinder {
                radius,
                bottom,
                top,
            } = Cylinder::of(&profile);
            let ball = Revolution::new(profile, placement).bounding_sphere();
            for height in [bottom, top] {
                for theta in (0..12).map(|k| 0.5 * f64::from(k)) {
                    let (sin, cos) = libm::sincos(theta);
                    let rim = DVec3::new(radius * sin, height, radius * cos);
                    let distance = ball.center.distance(placement.point_to_world(rim));
                    assert!(
                        (distance / ball.radius - 1.0).abs() < 1e-14,
                        "{placement:?}"
                    );
                }
            }
        }
    }
}

/// A tube whose rims lie on every volume around it.
fn tube() -> Profile {
    let wall = Piece {
        radius: [1.0; 4],
        height: [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0],
    };
    Profile::new(vec![wall]).expect("one piece")
}

/// Rays that pass through the wall less than the rounding of their way below its rim, nearly within the tangent plane of the ball.
#[test]
fn rays_from_afar_through_a_rim_are_culled_by_no_volume() {
    let tube = tube();
    let mut met = 0;
    for k in 0..2000 {
        let (sin, cos) = libm::sincos(0.7 * f64::from(k));
        let out = DVec3::new(sin, 0.0, cos);
        let direction = (out - DVec3::Y).normalize();
        let below = libm::exp10(-9.0 - 0.003 * f64::from(k));
        let rim = out + (1.0 - below) * DVec3::Y;
        let ray = Ray::new(
            rim - libm::exp10(0.004 * f64::from(k)) * direction,
            direction,
        );
        let crossings = exact::crossings(&tube, &ray);
        met += crossings.len();
        for kind in Bounding::ALL {
            let interval = Volume::new(kind, &tube).interval(&ray);
            let holds = |t: f64| interval.is_some_and(|(low, high)| low <= t && t <= high);
            assert!(crossings.iter().all(|c| holds(c.t)), "{kind:?} {ray:?}");
        }
    }
    assert!(met > 500, "{met}");
}

/// An extremum whose parameter rounds to the end of its piece dips below the end's height: by less than any rounding, but a level ray
/// may pass there.
#[test]
fn a_level_ray_through_an_extremum_next_to_an_end_is_not_culled() {
    let piece = Piece {
        radius: [1.0; 4],
        height: [1.0, 1.0, -1e-17, 0.0],
    };
    let profile = Profile::new(vec![piece]).expect("a piece is a profile");
    let ray = Ray::new(DVec3::new(3.0, -5e-35, 0.0), DVec3::NEG_X);
    assert_eq!(exact::crossings(&profile, &ray).len(), 4);
    assert!(ours(&profile, &ray).is_some());
    for solver in [Solver::Bernstein, Solver::Exact] {
        let crossing = in_place(&profile).nearest(&ray, &solver, &mut Work::default());
        assert_eq!(crossing.map(|c| c.t), Some(2.0));
    }
}

/// Horizontal speeds below the normal numbers have a direction all the same.
#[test]
fn an_almost_upright_ray_is_culled_by_no_rounding_of_its_direction() {
    let can = [[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]];
    let pieces = can.windows(2).map(|ends| line(ends[0], ends[1]));
    let can = Profile::new(pieces.collect()).expect("the pieces join");
    for speed in [5e-324, 1.5e-323, 1e-310, 1e-290] {
        for z in [-speed, 0.0, speed] {
            let ray = Ray::new(DVec3::new(0.6, -5.0, -0.6), DVec3::new(speed, 1.0, z));
            for kind in Bounding::ALL {
                let bounded = in_place(&can).bounded_by(kind);
                let crossing = bounded.nearest(&ray, &Solver::Exact, &mut Work::default());
                assert_eq!(crossing.map(|c| c.t), Some(4.0), "{kind:?} {ray:?}");
            }
        }
    }
    let leaving = DVec3::new(1e-307, 1.0, 1e-307);
    assert_eq!(
        ours(&can, &Ray::new(DVec3::new(1.1, -5.0, 0.6), leaving)),
        None
    );
}
