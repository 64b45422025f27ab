//! The hard cases G1 to G7 of glass and light. Those of a single face stand beside Fresnel's formula, in `render::scatter`.

use super::{assert_mean, by, outcome, path};
use photolathe::render::film::Film;
use photolathe::scene::Rgb;
use photolathe::scene::options::Integrator;

/// A ball and a cup-like cylinder of glass stand between the camera and a room with a mirror, a lamp and a checkered floor.
const BEHIND_GLASS: &str = r#"
background = [0.2, 0.3, 0.4]
[camera]
eye = [0, 1, 6]
target = [0, 0.7, 0]
vertical_fov_deg = 40
[film]
width = 16
height = 12
[material.glass]
dielectric = { ior = 1 }
[material.board]
diffuse = { checker = [[0.8, 0.8, 0.8], [0.2, 0.2, 0.3]], repeat = [0.5, 0.5] }
[material.chrome]
mirror = { reflectance = [0.9, 0.9, 0.9] }
[material.lamp]
emission = { radiance = [3, 2, 1], side = "both" }
[[sphere]]
center = [-1, 0.7, -1]
radius = 0.7
material = "chrome"
[[disc]]
center = [0, 3, 1]
normal = [0, -1, 0]
radius = 1.5
material = "lamp"
[[quad]]
corner = [0.4, 0, -2]
edge_u = [1.5, 0, 0]
edge_v = [0, 1.5, 0]
material = "lamp"
"#;
const FLOOR: &str = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = \"board\"\n";
const GLASS: &str = r#"
[[sphere]]
center = [-0.4, 0.9, 1.5]
radius = 0.6
material = "glass"
[[revolution]]
material = "glass"
profile = [
  [[0, 0.2], [0.2, 0.2], [0.4, 0.2], [0.6, 0.2]],
  [[0.6, 0.2], [0.6, 0.6], [0.6, 1], [0.6, 1.4]],
  [[0.6, 1.4], [0.4, 1.4], [0.2, 1.4], [0, 1.4]],
]
translate = [0.9, 0, 1.5]
"#;

/// G1. Without chance the pictures are the same but for the rounding of where rays start again.
#[test]
fn g1_glass_of_index_one_is_not_there() {
    let with = format!("{BEHIND_GLASS}{GLASS}");
    let [with, without] = [with.as_str(), BEHIND_GLASS]
        .map(|text| outcome(text, by(Integrator::Whitted, 1), &[]).film);
    for (a, b) in with.pixels().iter().zip(without.pixels()) {
        assert!((a.mean() - b.mean()).abs().max_element() < 1e-9);
    }
    // With light that paths must find through it: 6 standard errors of the difference see 3 %.
    let [with, without] = [
        format!("{BEHIND_GLASS}{FLOOR}{GLASS}"),
        format!("{BEHIND_GLASS}{FLOOR}"),
    ]
    .map(|text| path(&text, 1500, &[]));
    let [a, b] = [error(&with), error(&without)];
    let error = (a * a + b * b).map(f64::sqrt);
    let difference = (with.mean() - without.mean()).abs();
    assert!(difference.cmplt(6.0 * error).all(), "{difference} {error}");
    assert!((6.0 * error).cmplt(0.03 * without.mean()).all(), "{error}");
}

/// Standard error of a picture's mean.
fn error(film: &Film) -> Rgb {
    let n = film.pixels().len() as f64;
    let variance: Rgb = film.pixels().iter().map(|p| p.variance_of_mean()).sum();
    (variance / (n * n)).map(f64::sqrt)
}

/// A camera in a ball of glass looks along a chord that meets the wall at `sine` of the angle of incidence, for ever.
fn within_a_ball(sine: f64) -> String {
    format!(
        "background = [1, 1, 1]\n[camera]\neye = [{sine}, 0, 0]\ntarget = [{sine}, 1, 0]\nup = [0, 0, 1]\nvertical_fov_deg = 0.01\n\
         [film]\nwidth = 4\nheight = 4\n[material.glass]\ndielectric = {{ ior = 1.5 }}\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n"
    )
}

/// G3. (That no light comes to do so from outside is a test of experiment `fresnel`.)
#[test]
fn g3_a_path_reflected_totally_for_ever_ends_and_is_dark() {
    let text = within_a_ball(0.9);
    for limit in [1, 30, 300] {
        let limited = [("render.max_depth", &*limit.to_string())].map(|(k, v)| (k, v.to_owned()));
        let limited = limited
            .each_ref()
            .map(|(key, value)| (*key, value.as_str()));
        for integrator in [Integrator::Path, Integrator::Whitted] {
            let done = outcome(&text, by(integrator, 2), &limited);
            assert_eq!(done.film.mean(), Rgb::ZERO);
            assert_eq!(done.film.bad_samples(), 0);
            assert!(done.work.scattered_rays <= limit * done.work.camera_rays);
        }
    }
    // Without limit roulette ends it, after a hundred events on average.
    let done = outcome(&text, by(Integrator::Path, 20), &[]);
    assert_eq!(done.film.mean(), Rgb::ZERO);
    let events = done.work.scattered_rays as f64 / done.work.camera_rays as f64;
    assert!((80.0..120.0).contains(&events), "{events}");
    // Just inside the critical angle it comes out.
    let bright = outcome(&within_a_ball(0.66), by(Integrator::Path, 20), &[]);
    assert!(bright.film.mean().x > 1.0);
}

/// Balls and cylinders of glass in even surroundings, which show none of it where every way in has its way out.
fn in_even_light(glass: &str) -> String {
    format!(
        "background = [1, 1, 1]\n[camera]\neye = [0, 0.5, 5]\ntarget = [0, 0.5, 0]\nvertical_fov_deg = 20\n\
         [film]\nwidth = 8\nheight = 8\n[material.glass]\ndielectric = {{ ior = 1.5 }}\n{glass}"
    )
}

fn ball(center: &str, radius: f64) -> String {
    format!("[[sphere]]\ncenter = {center}\nradius = {radius:?}\nmaterial = \"glass\"\n")
}

/// G6. Glass in glass is not modelled: light of finite strength in bounded work is all that is promised. Where faces
/// come in pairs, in and out, the surroundings keep their radiance all the same.
#[test]
fn g6_nested_and_coincident_faces_give_finite_light_in_bounded_work() {
    let cylinder = |from: f64| {
        let to = from + 0.5;
        format!(
            "[[revolution]]\nmaterial = \"glass\"\nprofile = [\n[[0, {from:?}], [0.3, {from:?}], [0.6, {from:?}], [0.9, {from:?}]],\n\
             [[0.9, {from:?}], [0.9, {from:?}], [0.9, {to:?}], [0.9, {to:?}]],\n[[0.9, {to:?}], [0.6, {to:?}], [0.3, {to:?}], [0, {to:?}]]]\n"
        )
    };
    let origin = "[0, 0.5, 0]";
    let twice = ball(origin, 0.8) + &ball(origin, 0.8);
    let nested = ball(origin, 0.8) + &ball(origin, 0.5);
    let touching = ball("[-0.5, 0.5, 0]", 0.5) + &ball("[0.5, 0.5, 0]", 0.5);
    let stacked = cylinder(0.0) + &cylinder(0.5);
    let overlapping = ball(origin, 0.7) + &cylinder(0.2);
    for (glass, kept) in [
        (twice, true),
        (nested, true),
        (touching, true),
        (stacked, false),
        (overlapping, false),
    ] {
        let text = in_even_light(&glass);
        for table in [by(Integrator::Path, 100), by(Integrator::Whitted, 1)] {
            let integrator = table.integrator;
            let done = outcome(&text, table, &[]);
            let mean = done.film.mean().x;
            assert_eq!(done.film.bad_samples(), 0);
            assert!(done.work.scattered_rays <= 2000 * done.work.camera_rays);
            // Four ways out without a way in would each raise it by the square of the index.
            assert!(
                (0.0..1.5_f64.powi(8)).contains(&mean),
                "{integrator:?}: {mean}"
            );
            if kept && integrator == Some(Integrator::Path) {
                assert!((mean - 1.0).abs() < 2e-3, "{glass}: {mean}");
            }
        }
    }
}

/// G7. A wall is lit by a point light that lies exactly in the floor as by any other; the floor itself gets nothing of it.
#[test]
fn g7_a_point_light_exactly_on_a_floor_lights_the_wall() {
    let text = r#"
[camera]
eye = [2, 1, 0]
target = [0, 1, 0]
vertical_fov_deg = 0.001
[film]
width = 2
height = 2
[material.wall]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[material.black]
diffuse = { reflectance = [0, 0, 0] }
[[plane]]
point = [0, 0, 0]
normal = [1, 0, 0]
material = "wall"
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "black"
[[point_light]]
position = [1, 0, 0.5]
intensity = [2, 2, 2]
"#;
    // cosθ = 1/d, d² = 1 + 1 + ¼.
    let expected = 0.5 / std::f64::consts::PI * 2.0 / libm::pow(2.25, 1.5);
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let mean = outcome(text, by(integrator, 1), &[]).film.mean().x;
        assert!((mean / expected - 1.0).abs() < 1e-4, "{mean} {expected}");
        let floor = [
            ("camera.target", "[0.7, 0, 0]"),
            ("material.black.diffuse.reflectance", "[1, 1, 1]"),
        ];
        let black_wall = ("material.wall.diffuse.reflectance", "[0, 0, 0]");
        let floor = outcome(text, by(integrator, 4), &[floor[0], floor[1], black_wall]);
        assert_eq!(floor.film.mean(), Rgb::ZERO);
    }
}

/// G7. A lamp a billionth below a ceiling, and in its very plane, where the lamp wins the tie: what meets the lamp by chance finds it as
/// well as what aims at it.
#[test]
fn g7_a_lamp_in_or_just_below_a_ceiling_lights_the_floor_in_full() {
    let text = r#"
[camera]
eye = [0, 0.5, 0]
target = [0, 0, 0]
up = [0, 0, -1]
vertical_fov_deg = 0.001
[film]
width = 2
height = 2
[material.floor]
diffuse = { reflectance = [0.6, 0.6, 0.6] }
[material.black]
diffuse = { reflectance = [0, 0, 0] }
[material.lamp]
emission = { radiance = [5, 5, 5] }
[[disc]]
center = [0, 1, 0]
normal = [0, -1, 0]
radius = 1
material = "lamp"
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "floor"
[[plane]]
point = [3, 1, 4]
normal = [0, -1, 0]
material = "black"
"#;
    let expected = Rgb::splat(0.6 * 5.0 * 0.5);
    let below = [("disc.0.center", "[0, 0.999999999, 0]")];
    for place in [&below[..], &[]] {
        assert_mean(&path(text, 40_000, place), expected, 0.01);
        let whitted = outcome(text, by(Integrator::Whitted, 4000), place).film;
        assert_mean(&whitted, expected, 0.02);
    }
}

/// G7. Two lamps back to back, the first of which shines down: from below it is seen, and lights the floor in full (a disc of radius 1 at
/// distance 1: half of what an endless one would), whichever is listed last.
#[test]
fn g7_the_back_of_a_lamp_does_not_hide_the_lamp_in_its_plane() {
    let lamp = |normal: &str| {
        format!(
            "[[disc]]\ncenter = [0, 1, 0]\nnormal = {normal}\nradius = 1\nmaterial = \"lamp\"\n"
        )
    };
    let [down, up] = ["[0, -1, 0]", "[0, 1, 0]"].map(lamp);
    let room = "[camera]\neye = [0, 0.5, 0]\ntarget = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov_deg = 0.001\n\
                [film]\nwidth = 2\nheight = 2\n[material.floor]\ndiffuse = { reflectance = [0.5, 0.5, 0.5] }\n\
                [material.lamp]\nemission = { radiance = [1, 1, 1] }\n\
                [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = \"floor\"\n";
    let seen = [("camera.target", "[0, 1, 0]")];
    for lamps in [format!("{down}{up}"), format!("{up}{down}")] {
        let text = format!("{room}{lamps}");
        assert_mean(&path(&text, 40_000, &[]), Rgb::splat(0.25), 0.02);
        for integrator in [Integrator::Path, Integrator::Whitted, Integrator::Pppm] {
            let film = outcome(&text, by(integrator, 1), &seen).film;
            assert_eq!(film.mean(), Rgb::ONE, "{integrator:?}");
        }
    }
}

/// G7. The light of a lamp within glass is less by the index squared when it has left, and by what the face reflects.
#[test]
fn g7_a_lamp_within_glass_is_seen_dimmed_by_the_square_of_the_index() {
    let text = "[camera]\neye = [0, 0, 4]\ntarget = [0, 0, 0]\nvertical_fov_deg = 0.01\n[film]\nwidth = 4\nheight = 4\n\
                [material.glass]\ndielectric = { ior = 1.5 }\n[material.lamp]\nemission = { radiance = [1, 1, 1] }\n"
        .to_owned()
        + &ball("[0, 0, 0]", 1.0)
        + "[[sphere]]\ncenter = [0, 0, 0]\nradius = 0.5\nmaterial = \"lamp\"\n";
    assert_mean(&path(&text, 4000, &[]), Rgb::splat(0.96 / 2.25), 0.01);
    let whitted = outcome(&text, by(Integrator::Whitted, 1), &[])
        .film
        .mean()
        .x;
    assert!((whitted - 0.96 / 2.25).abs() < 1e-9, "{whitted}");
}
