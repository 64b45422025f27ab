//! The hard cases of the thin lens, D1 to D7 of docs/CASES.md.

use super::{SIZE, description, film_points, forward, lens_points, ours, pinhole_ray};
use glam::{DVec2, DVec3};
use photolathe::render::driver::render_unwatched;
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::scene::camera::{Camera, CameraDescription};
use photolathe::scene::file::parse;
use photolathe::scene::options::{Integrator, RenderTable};
use photolathe::scene::sampling::uniform_disc;
use std::path::Path;

/// A camera at the origin that looks along −z, on one pixel so narrow that only the lens spreads its rays.
const HEAD: &str = r#"
background = [1, 1, 1]
[camera]
eye = [0, 0, 0]
target = [0, 0, -1]
vertical_fov_deg = 0.001
lens_radius = 0.5
focus_distance = 6
[film]
width = 1
height = 1
[material.black]
diffuse = { reflectance = [0, 0, 0] }
"#;

fn film(body: &str, sets: &[(&str, &str)], spp: u32) -> Film {
    let sets: Vec<_> = sets
        .iter()
        .map(|&(key, value)| (key.to_owned(), value.to_owned()))
        .collect();
    let text = format!("{HEAD}{body}");
    let scene = parse(&text, "lens", Path::new(""), &sets).expect("a valid scene");
    let settings = Settings::resolve(&RenderTable {
        integrator: Some(Integrator::Path),
        spp: Some(spp),
        seed: Some(3),
        threads: Some(1),
        ..RenderTable::default()
    });
    render_unwatched(&scene, &settings)
        .expect("it renders")
        .film
}

/// Whether a share of n independent samples is the expected one, within 6 standard errors.
fn is_share(film: &Film, expected: f64) -> bool {
    let pixel = &film.pixels()[0];
    let error = (expected * (1.0 - expected) / pixel.count()).sqrt();
    film.bad_samples() == 0 && (pixel.mean().x - expected).abs() <= 6.0 * error
}

fn refused(key: &str, value: &str) -> String {
    let text = HEAD.replace(&format!("\n{key} = "), &format!("\n{key} = {value} # "));
    let error = parse(&text, "lens", Path::new(""), &[]).expect_err("it is refused");
    error.to_string()
}

#[test]
fn d1_without_aperture_the_picture_is_that_of_a_pinhole_to_the_bit() {
    let ball = "[[sphere]]\ncenter = [0, 0, -4]\nradius = 1\nmaterial = \"black\"\n";
    let wide = [
        ("film.width", "24"),
        ("film.height", "16"),
        ("camera.vertical_fov_deg", "40"),
    ];
    let with = |lens: &[(&str, &str)]| film(ball, &[&wide, lens].concat(), 3);
    let pinhole = with(&[("camera.lens_radius", "0")]);
    for focus in ["0.5", "6", "1e30", "inf"] {
        let closed = [
            ("camera.lens_radius", "0.0"),
            ("camera.focus_distance", focus),
        ];
        assert_eq!(pinhole, with(&closed));
    }
    assert_ne!(pinhole, with(&[("camera.lens_radius", "0.01")]));
}

#[test]
fn d2_focused_at_infinity_the_rays_of_a_film_point_are_parallel_and_blur_is_the_lens_at_any_depth()
{
    let far = CameraDescription {
        focus_distance: f64::INFINITY,
        ..description()
    };
    for place in film_points() {
        let middle = pinhole_ray(place);
        let mut widest = 0.0_f64;
        for lens in lens_points() {
            let ray = ours(&far, place, lens);
            assert_eq!(ray.direction, middle.direction);
            let offset = ray.origin - far.eye;
            assert!(offset.dot(forward()).abs() < 1e-14);
            widest = widest.max(offset.length());
        }
        assert!(widest <= far.lens_radius * (1.0 + 1e-14) && widest > 0.93 * far.lens_radius);
    }
    // An edge at any depth is as wide: a black half plane from x = .25 on hides ½ − (½ √¾ + asin ½)/π of a lens of radius ½.
    let share = 0.5 + (0.5 * 0.75_f64.sqrt() + libm::asin(0.5)) / std::f64::consts::PI;
    for depth in ["-0.1", "-10", "-1000"] {
        let wall = format!(
            "[[quad]]\ncorner = [0.25, -50, {depth}]\nedge_u = [100, 0, 0]\nedge_v = [0, 100, 0]\nmaterial = \"black\"\n"
        );
        let film = film(&wall, &[("camera.focus_distance", "inf")], 20_000);
        assert!(
            is_share(&film, share),
            "{depth}: {}",
            film.pixels()[0].mean().x
        );
    }
    // A distance of 10³⁰ is the same to rounding, and no number overflows.
    let distant = CameraDescription {
        focus_distance: 1e30,
        ..description()
    };
    let place = DVec2::new(10.0, 40.0);
    for lens in lens_points() {
        let difference = ours(&distant, place, lens).direction - ours(&far, place, lens).direction;
        assert!(difference.length() < 1e-15);
    }
}

#[test]
fn d3_a_distance_of_focus_that_is_none_is_refused() {
    for value in ["0", "-0.0", "-6", "nan", "-inf", "1e-61", "1e61", "\"far\""] {
        let error = refused("focus_distance", value);
        assert!(error.contains("focus_distance"), "{value}: {error}");
    }
    for value in ["-0.1", "nan", "inf", "1e61"] {
        assert!(
            refused("lens_radius", value).contains("lens_radius"),
            "{value}"
        );
    }
    // Nearer than a millionth of the eye's coordinates its place is lost in their rounding.
    let far = |distance: &str| {
        let text = HEAD.replace("eye = [0, 0, 0]", "eye = [0, 0, 1e9]");
        let text = text.replace(
            "focus_distance = 6",
            &format!("focus_distance = {distance}"),
        );
        parse(&text, "lens", Path::new(""), &[]).map(|_| ())
    };
    assert!(
        far("100")
            .expect_err("it is refused")
            .to_string()
            .contains("at least")
    );
    assert!(far("1000").is_ok());
    // The nearest that is accepted still has a ray for every lens point, the centre too.
    for focus_distance in [1e-60, 1e60] {
        for lens_radius in [1e-60, 0.25, 1e60] {
            let camera = CameraDescription {
                eye: DVec3::ZERO,
                lens_radius,
                focus_distance,
                ..description()
            };
            for lens in lens_points().into_iter().chain([[0.5; 2], [0.0; 2]]) {
                let ray = Camera::new(&camera).ray(DVec2::new(3.0, 5.0), SIZE, lens);
                assert!(ray.is_valid(), "{focus_distance} {lens_radius}");
                assert!((ray.direction.length() - 1.0).abs() < 1e-12);
            }
        }
    }
}

/// Rays that start inside a ball about the middle of the lens see it from inside, the others do not meet it: focused at infinity, they
/// go away from it. A disc in the plane of the lens itself is not met, as the range of a ray is open at its start.
#[test]
fn d4_an_object_within_the_aperture_hides_the_share_of_the_lens_that_it_covers() {
    let far = [("camera.focus_distance", "inf")];
    let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 0.3\nmaterial = \"black\"\n";
    let seen = film(ball, &far, 20_000);
    assert!(is_share(&seen, 1.0 - 0.36), "{}", seen.pixels()[0].mean().x);
    let disc =
        "[[disc]]\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 0.3\nmaterial = \"black\"\n";
    for focus in ["inf", "6"] {
        let seen = film(disc, &[("camera.focus_distance", focus)], 1000);
        assert!(is_share(&seen, 1.0));
    }
    // Just before the lens it hides what it covers.
    let before = disc.replace("[0, 0, 0]", "[0, 0, -1e-9]");
    assert!(is_share(&film(&before, &far, 20_000), 1.0 - 0.36));
}

#[test]
fn d5_an_object_within_the_cone_of_a_wide_lens_hides_its_share_and_one_in_focus_stays_sharp() {
    let disc = |radius: f64, depth: f64| {
        format!(
            "[[disc]]\ncenter = [0, 0, {:?}]\nnormal = [0, 0, 1]\nradius = {radius:?}\nmaterial = \"black\"\n",
            -depth
        )
    };
    // A lens of 100 before a scene of 1: at depth s the cone has the radius 100 (1 − s/6).
    let wide = [("camera.lens_radius", "100")];
    for (radius, depth) in [(20.0, 3.0), (30.0, 2.0), (1.0, 5.9)] {
        let share = radius / (100.0 * (1.0 - depth / 6.0));
        let seen = film(&disc(radius, depth), &wide, 20_000);
        let expected = 1.0 - share * share;
        assert!(
            is_share(&seen, expected),
            "{radius} at {depth}: {}",
            seen.pixels()[0].mean().x
        );
    }
    // In the plane of focus the whole cone is one point: hidden by a disc about it however small, free beside it.
    assert!(is_share(&film(&disc(0.01, 6.0), &wide, 1000), 0.0));
    let beside = disc(0.01, 6.0).replace("[0, 0, -6.0]", "[0.011, 0, -6.0]");
    assert!(is_share(&film(&beside, &wide, 1000), 1.0));
}

#[test]
fn d6_a_corner_of_the_plane_of_focus_is_sharp() {
    // From the corner a step of a hundredth of a pixel decides for all rays alike, before and behind it not.
    let camera = Camera::new(&description());
    let [right, ..] = camera.frame();
    let corner = DVec2::ZERO;
    let focus = super::at_depth(&pinhole_ray(corner), description().focus_distance);
    let sides = |depth: f64| {
        let edge = super::at_depth(&pinhole_ray(DVec2::new(0.01, 0.0)), depth);
        let left = |lens| {
            (super::at_depth(&ours(&description(), corner, lens), depth) - edge).dot(right) < 0.0
        };
        lens_points().into_iter().filter(|&lens| left(lens)).count()
    };
    assert!((focus - description().eye).length() > 1.1 * description().focus_distance);
    assert_eq!(sides(description().focus_distance), lens_points().len());
    for depth in [5.0, 7.0] {
        assert!(
            (60..140).contains(&sides(depth)),
            "{depth}: {}",
            sides(depth)
        );
    }
}

#[test]
fn d7_the_middle_of_the_lens_square_is_the_centre_of_the_lens_and_nothing_jumps_there() {
    assert_eq!(uniform_disc([0.5, 0.5]), DVec2::ZERO);
    let step = f64::EPSILON;
    for x in [-step, 0.0, step] {
        for y in [-step, 0.0, step] {
            let at = uniform_disc([0.5 + x, 0.5 + y]);
            assert!(at.is_finite() && at.length() <= 4.0 * step, "{x} {y}: {at}");
        }
    }
    // The diagonals, where the map changes its form, and the corners are finite and continuous too.
    for (u, v) in [(0.0, 0.0), (0.25, 0.25), (0.75, 0.25), (0.25, 0.75)] {
        let here = uniform_disc([u, v]);
        for beside in [[u + step, v], [u, v + step]] {
            assert!((uniform_disc(beside) - here).length() < 1e-14);
        }
    }
    let ray = ours(&description(), DVec2::new(7.0, 9.0), [0.5; 2]);
    assert_eq!(ray.origin, description().eye);
    assert!((ray.direction - pinhole_ray(DVec2::new(7.0, 9.0)).direction).length() < 1e-15);
}
