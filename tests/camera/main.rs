//! The pinhole and the thin lens. Properties are functions over an implementation: the project's camera passes, and the wrong
//! lenses seen in real programs fail.

mod cases;
mod samplers;

use glam::{DVec2, DVec3};
use photolathe::geometry::ray::Ray;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::scene::camera::{Camera, CameraDescription};
use photolathe::scene::sampling::{uniform_disc, uniform_sphere};
use std::f64::consts::{PI, TAU};

const SIZE: DVec2 = DVec2::new(64.0, 48.0);

type Lens = fn(&CameraDescription, DVec2, [f64; 2]) -> Ray;

fn ours(camera: &CameraDescription, film: DVec2, lens: [f64; 2]) -> Ray {
    Camera::new(camera).ray(film, SIZE, lens)
}

fn description() -> CameraDescription {
    CameraDescription {
        eye: DVec3::new(1.0, 2.0, 3.0),
        target: DVec3::new(-2.0, 1.0, -4.0),
        up: DVec3::Y,
        vertical_fov_deg: 40.0,
        lens_radius: 0.25,
        focus_distance: 6.0,
    }
}

fn forward() -> DVec3 {
    (description().target - description().eye).normalize()
}

fn pinhole_ray(film: DVec2) -> Ray {
    ours(
        &CameraDescription {
            lens_radius: 0.0,
            ..description()
        },
        film,
        [0.5, 0.5],
    )
}

/// Where a ray crosses the plane at this depth along the view axis.
fn at_depth(ray: &Ray, depth: f64) -> DVec3 {
    let t =
        (depth - (ray.origin - description().eye).dot(forward())) / ray.direction.dot(forward());
    ray.at(t)
}

fn film_points() -> [DVec2; 4] {
    [
        DVec2::new(32.0, 24.0),
        DVec2::new(0.0, 0.0),
        DVec2::new(63.9, 47.5),
        DVec2::new(10.25, 40.75),
    ]
}

fn lens_points() -> Vec<[f64; 2]> {
    let mut stream = Stream::new(5, Purpose::Test, 0);
    (0..200).map(|_| stream.uniform2()).collect()
}

/// All rays of one film point meet where its pinhole ray crosses the plane of focus, off the axis too.
fn meets_in_the_plane_of_focus(lens: Lens) -> bool {
    let distance = description().focus_distance;
    film_points().into_iter().all(|film| {
        let focus = at_depth(&pinhole_ray(film), distance);
        // Four roundings of coordinates as large as the way there.
        let tolerance = 16.0 * f64::EPSILON * (distance + description().eye.length());
        lens_points().iter().all(|&u| {
            (at_depth(&lens(&description(), film, u), distance) - focus).length() <= tolerance
        })
    })
}

/// At depth s the rays of one film point fill a disc of radius a |1 − s/s_f|, and no more.
fn blur_has_the_radius_of_a_thin_lens(lens: Lens) -> bool {
    let camera = description();
    [2.0, 5.0, 9.0, 30.0].into_iter().all(|depth| {
        let expected = camera.lens_radius * (1.0 - depth / camera.focus_distance).abs();
        let film = DVec2::new(20.0, 30.0);
        let center = at_depth(&pinhole_ray(film), depth);
        let distances = lens_points()
            .into_iter()
            .map(|u| (at_depth(&lens(&camera, film, u), depth) - center).length());
        let widest = distances.fold(0.0, f64::max);
        // 200 points of a disc: the widest lies beyond 93 % of the radius but for (0.93²)²⁰⁰ ≈ 2e-13 of all seeds.
        widest <= expected * (1.0 + 1e-12) && widest >= 0.93 * expected
    })
}

/// Lens points are uniform by area: E[ρ²] = a²/2 and mean 0, each within 6 standard errors of 20 000 samples. It can see a
/// relative change of E[ρ²] of 2.5 %.
fn lens_is_filled_evenly(lens: Lens) -> bool {
    let n = 20_000;
    let camera = description();
    let mut stream = Stream::new(6, Purpose::Test, 0);
    let (mut mean, mut square) = (DVec3::ZERO, 0.0);
    for _ in 0..n {
        let offset = lens(&camera, DVec2::new(32.0, 24.0), stream.uniform2()).origin - camera.eye;
        mean += offset / f64::from(n);
        square += offset.length_squared() / f64::from(n);
    }
    let a2 = camera.lens_radius * camera.lens_radius;
    let error_of_square = a2 * (1.0 / 12.0 / f64::from(n)).sqrt();
    let error_of_mean = camera.lens_radius / (4.0 * f64::from(n)).sqrt();
    (square - a2 / 2.0).abs() <= 6.0 * error_of_square
        && mean.length() <= 6.0 * 2.0_f64.sqrt() * error_of_mean
}

/// The original's lens: the origin moves on a sphere's shell and the direction stays.
fn sphere_shell(camera: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let ray = pinhole_ray(film);
    Ray::new(
        ray.origin + camera.lens_radius * uniform_sphere(u),
        ray.direction,
    )
}

/// The origin moves on the lens but the direction stays.
fn not_aimed_again(camera: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    Ray::new(ours(camera, film, u).origin, pinhole_ray(film).direction)
}

/// Rays meet at the right distance along each ray: on a sphere, not a plane.
fn focus_on_a_sphere(camera: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let origin = ours(camera, film, u).origin;
    Ray::new(
        origin,
        (pinhole_ray(film).at(camera.focus_distance) - origin).normalize(),
    )
}

/// Polar lens samples without the square root: crowded at the centre.
fn without_square_root(camera: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let (right, up) = axes();
    let (radius, angle) = (camera.lens_radius * u[0], TAU * u[1]);
    let origin = camera.eye + radius * (libm::cos(angle) * right + libm::sin(angle) * up);
    let focus = at_depth(&pinhole_ray(film), camera.focus_distance);
    Ray::new(origin, (focus - origin).normalize())
}

fn axes() -> (DVec3, DVec3) {
    let right = forward().cross(DVec3::Y).normalize();
    (right, right.cross(forward()))
}

#[test]
fn the_thin_lens_focuses_on_a_plane() {
    assert!(meets_in_the_plane_of_focus(ours));
    assert!(!meets_in_the_plane_of_focus(sphere_shell));
    assert!(!meets_in_the_plane_of_focus(not_aimed_again));
    assert!(!meets_in_the_plane_of_focus(focus_on_a_sphere));
}

#[test]
fn the_blur_grows_as_a_thin_lens_says() {
    assert!(blur_has_the_radius_of_a_thin_lens(ours));
    assert!(!blur_has_the_radius_of_a_thin_lens(sphere_shell));
    assert!(!blur_has_the_radius_of_a_thin_lens(not_aimed_again));
}

#[test]
fn the_lens_is_filled_uniformly() {
    assert!(lens_is_filled_evenly(ours));
    assert!(!lens_is_filled_evenly(without_square_root));
    assert!(!lens_is_filled_evenly(sphere_shell));
}

#[test]
fn without_aperture_the_lens_point_does_not_matter() {
    let pinhole = CameraDescription {
        lens_radius: 0.0,
        ..description()
    };
    for film in film_points() {
        let through_center = ours(&pinhole, film, [0.5, 0.5]);
        assert!(
            lens_points()
                .iter()
                .all(|&u| ours(&pinhole, film, u) == through_center)
        );
        let opened = ours(&description(), film, [0.5, 0.5]);
        assert_eq!(
            opened.origin, through_center.origin,
            "(½, ½) is the centre of the lens"
        );
        assert!((opened.direction - through_center.direction).length() < 1e-15);
    }
}

#[test]
fn the_film_spans_the_field_of_view() {
    let camera = description();
    let half = 0.5 * camera.vertical_fov_deg.to_radians();
    let angle = |film| libm::acos(pinhole_ray(film).direction.dot(forward()));
    assert!((angle(DVec2::new(32.0, 0.0)) - half).abs() < 1e-12);
    assert!((angle(DVec2::new(32.0, 48.0)) - half).abs() < 1e-12);
    let (right, up) = axes();
    assert!(
        pinhole_ray(DVec2::new(64.0, 24.0)).direction.dot(right) > 0.0,
        "x grows to the right"
    );
    assert!(
        pinhole_ray(DVec2::new(32.0, 0.0)).direction.dot(up) > 0.0,
        "row 0 is the top"
    );
    let horizontal = 2.0 * libm::atan(libm::tan(half) * SIZE.x / SIZE.y);
    let across = pinhole_ray(DVec2::new(0.0, 24.0))
        .direction
        .dot(pinhole_ray(DVec2::new(64.0, 24.0)).direction);
    assert!(
        (libm::acos(across) - horizontal).abs() < 1e-12,
        "pixels are square"
    );
}

#[test]
fn a_camera_says_how_it_was_set_up() {
    let camera = Camera::new(&description());
    let (right, up) = axes();
    assert_eq!(camera.eye(), description().eye);
    assert_eq!(camera.lens_radius(), 0.25);
    assert_eq!(camera.focus_distance(), 6.0);
    for (ours, expected) in camera.frame().into_iter().zip([right, up, forward()]) {
        assert!((ours - expected).length() < 1e-15);
    }
    let tan = libm::tan(20.0_f64.to_radians());
    assert!((camera.tan_half_fov() - tan).abs() < 1e-15);
    // 48 pixels span the field: the picture's height at distance 1 is 2 tan 20°.
    assert!((camera.pixel_size(48) * 48.0 - 2.0 * tan).abs() < 1e-15);
}

#[test]
fn the_lens_is_filled_from_left_to_right_and_from_below() {
    let (right, up) = axes();
    let offset =
        |lens| ours(&description(), DVec2::new(20.0, 30.0), lens).origin - description().eye;
    for (lens, x, y) in [
        ([0.75, 0.5], 0.125, 0.0),
        ([0.25, 0.5], -0.125, 0.0),
        ([0.5, 0.75], 0.0, 0.125),
        ([0.5, 0.25], 0.0, -0.125),
    ] {
        assert!((offset(lens) - (x * right + y * up)).length() < 1e-14);
    }
}

/// A film point's place on the plane at distance 1 is linear in pixels: one pixel further is one pixel's side further.
#[test]
fn equal_steps_on_the_film_are_equal_steps_in_the_picture() {
    let (right, up) = axes();
    let side = Camera::new(&description()).pixel_size(48);
    let place = |x: f64, y: f64| {
        let offset = at_depth(&pinhole_ray(DVec2::new(x, y)), 1.0) - description().eye;
        DVec2::new(offset.dot(right), offset.dot(up))
    };
    for (x, y) in [(0.0, 0.0), (31.5, 7.25), (63.0, 47.0)] {
        let expected = DVec2::new(x - 32.0, 24.0 - y) * side;
        assert!((place(x, y) - expected).length() < 1e-14, "({x}, {y})");
    }
}

/// The concentric map sends equal areas to equal areas: chi-square over 8 rings of equal area × 8 sectors, 64 000 samples;
/// limit 63 + 6√126 (false alarm below 1e-6). It can see a cell off by 10 %.
#[test]
fn the_disc_map_keeps_areas() {
    let n = 64_000;
    let mut stream = Stream::new(7, Purpose::Test, 0);
    let mut counts = [0_u32; 64];
    for _ in 0..n {
        let p = uniform_disc(stream.uniform2());
        assert!(p.length() <= 1.0 + 1e-15);
        let ring = (p.length_squared() * 8.0).min(7.0) as usize;
        let sector = ((libm::atan2(p.y, p.x) + PI) / TAU * 8.0).min(7.0) as usize;
        counts[ring * 8 + sector] += 1;
    }
    let expected = f64::from(n) / 64.0;
    let chi2: f64 = counts
        .iter()
        .map(|&count| (f64::from(count) - expected).powi(2) / expected)
        .sum();
    assert!(chi2 < 63.0 + 6.0 * 126.0_f64.sqrt(), "chi² = {chi2}");
}
