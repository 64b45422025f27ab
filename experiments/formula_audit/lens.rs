//! The thin lens.

use super::{Fault, Trial, compare};
use crate::geometry::ray::Ray;
use crate::scene::camera::{Camera, CameraDescription};
use crate::scene::sampling::uniform_sphere;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

const FOCUS: &str = "all rays of a film point meet in the plane of focus, off the axis too";
const UNIFORM: &str = "origins lie in the plane of the lens, uniform by area: mean ρ² = a²/2";

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "direction not aimed again",
        number: "M16",
        component: "thin lens",
        quantity: "blur in the plane of focus, in lens radii",
        hides_where: "blur at twice the distance of focus",
        property: FOCUS,
        examine: |trial| {
            compare(
                ours as Lens,
                not_aimed_again,
                |f| blur(trial, f, CENTER, LENS.focus_distance),
                |f| blur(trial, f, CENTER, 2.0 * LENS.focus_distance),
                |f| is_sharp(trial, f),
            )
        },
    },
    Fault {
        name: "lens offset of the wrong sign",
        number: "",
        component: "thin lens",
        quantity: "blur in the plane of focus, in lens radii",
        hides_where: "the centre of the lens",
        property: FOCUS,
        examine: |trial| {
            let pinhole = |f: Lens| f(&LENS, CENTER, [0.5; 2]).direction.x;
            compare(
                ours as Lens,
                of_the_wrong_sign,
                |f| blur(trial, f, CENTER, LENS.focus_distance),
                pinhole,
                |f| is_sharp(trial, f),
            )
        },
    },
    Fault {
        name: "sphere's shell for the lens",
        number: "M17",
        component: "thin lens",
        quantity: "mean |distance| of origins from the lens's plane, in lens radii",
        hides_where: "the plane of focus, which stays sharp",
        property: UNIFORM,
        examine: |trial| {
            compare(
                ours as Lens,
                sphere_shell,
                |f| off_the_plane(trial, f),
                |f| blur(trial, f, CENTER, LENS.focus_distance),
                |f| is_uniform(trial, f),
            )
        },
    },
    Fault {
        name: "no square root in the disc",
        number: "M18",
        component: "thin lens",
        quantity: "mean ρ² of origins, in squared lens radii",
        hides_where: "the plane of focus, which stays sharp",
        property: UNIFORM,
        examine: |trial| {
            compare(
                ours as Lens,
                without_square_root,
                |f| mean_square(trial, f),
                |f| blur(trial, f, CENTER, LENS.focus_distance),
                |f| is_uniform(trial, f),
            )
        },
    },
    Fault {
        name: "focus on a sphere",
        number: "M19",
        component: "thin lens",
        quantity: "blur in the plane of focus at a corner, in lens radii",
        hides_where: "the middle of the film",
        property: FOCUS,
        examine: |trial| {
            compare(
                ours as Lens,
                focus_on_a_sphere,
                |f| blur(trial, f, CORNER, LENS.focus_distance),
                |f| blur(trial, f, CENTER, LENS.focus_distance),
                |f| is_sharp(trial, f),
            )
        },
    },
];

/// The ray of a film point and a lens point.
type Lens = fn(&CameraDescription, DVec2, [f64; 2]) -> Ray;

const SIZE: DVec2 = DVec2::new(64.0, 48.0);
const CENTER: DVec2 = DVec2::new(32.0, 24.0);
const CORNER: DVec2 = DVec2::ZERO;
/// Looks along −z from the origin.
const LENS: CameraDescription = CameraDescription {
    eye: DVec3::ZERO,
    target: DVec3::NEG_Z,
    up: DVec3::Y,
    vertical_fov_deg: 60.0,
    lens_radius: 0.25,
    focus_distance: 6.0,
};

fn ours(lens: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    Camera::new(lens).ray(film, SIZE, u)
}

fn through_the_center(lens: &CameraDescription, film: DVec2) -> Ray {
    ours(lens, film, [0.5; 2])
}

/// The point of the plane of focus that a film point sees.
fn focus(lens: &CameraDescription, film: DVec2) -> DVec3 {
    at_depth(&through_the_center(lens, film), lens.focus_distance)
}

/// Where a ray crosses the plane at this depth.
fn at_depth(ray: &Ray, depth: f64) -> DVec3 {
    ray.at((depth + ray.origin.z) / -ray.direction.z)
}

fn aimed(origin: DVec3, at: DVec3) -> Ray {
    Ray::new(origin, (at - origin).normalize())
}

fn not_aimed_again(lens: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let direction = through_the_center(lens, film).direction;
    Ray::new(ours(lens, film, u).origin, direction)
}

/// Aims from the opposite point of the lens.
fn of_the_wrong_sign(lens: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let origin = ours(lens, film, u).origin;
    let opposite = 2.0 * lens.eye - origin;
    Ray::new(origin, aimed(opposite, focus(lens, film)).direction)
}

/// The original's origins, aimed rightly so that this fault stands alone.
fn sphere_shell(lens: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    aimed(
        lens.eye + lens.lens_radius * uniform_sphere(u),
        focus(lens, film),
    )
}

fn without_square_root(lens: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let (sin, cos) = libm::sincos(TAU * u[1]);
    let origin = lens.eye + lens.lens_radius * u[0] * DVec3::new(cos, sin, 0.0);
    aimed(origin, focus(lens, film))
}

/// All rays meet at the distance of focus along the ray, not along the axis.
fn focus_on_a_sphere(lens: &CameraDescription, film: DVec2, u: [f64; 2]) -> Ray {
    let at = through_the_center(lens, film).at(lens.focus_distance);
    aimed(ours(lens, film, u).origin, at)
}

fn lens_points(trial: &Trial, count: u64) -> impl Iterator<Item = [f64; 2]> + use<> {
    let mut stream = trial.stream(0);
    (0..count).map(move |_| stream.uniform2())
}

/// Greatest distance at this depth from the ray through the centre, in lens radii.
fn blur(trial: &Trial, lens: Lens, film: DVec2, depth: f64) -> f64 {
    let middle = at_depth(&through_the_center(&LENS, film), depth);
    let distance = |u| (at_depth(&lens(&LENS, film, u), depth) - middle).length();
    lens_points(trial, 1000).map(distance).fold(0.0, f64::max) / LENS.lens_radius
}

/// Four roundings of coordinates as large as the way there.
fn is_sharp(trial: &Trial, lens: Lens) -> bool {
    let films = [CENTER, CORNER, DVec2::new(10.25, 40.75)];
    films.iter().all(|&film| {
        let tolerance = 16.0 * f64::EPSILON * LENS.focus_distance / LENS.lens_radius;
        blur(trial, lens, film, LENS.focus_distance) <= tolerance
    })
}

fn off_the_plane(trial: &Trial, lens: Lens) -> f64 {
    let distance = |u| lens(&LENS, CENTER, u).origin.z.abs();
    lens_points(trial, 1000).map(distance).sum::<f64>() / 1000.0 / LENS.lens_radius
}

fn mean_square(trial: &Trial, lens: Lens) -> f64 {
    let square = |u| lens(&LENS, CENTER, u).origin.length_squared();
    let sum: f64 = lens_points(trial, trial.samples).map(square).sum();
    sum / trial.samples as f64 / (LENS.lens_radius * LENS.lens_radius)
}

/// ρ²/a² is uniform: its mean has the standard error √(1/12n).
fn is_uniform(trial: &Trial, lens: Lens) -> bool {
    let error = (1.0 / 12.0 / trial.samples as f64).sqrt();
    (mean_square(trial, lens) - 0.5).abs() < 6.0 * error && off_the_plane(trial, lens) == 0.0
}
