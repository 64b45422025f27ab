//! `path` and `whitted` against closed forms, and against each other; photons through a slab.
//!
//! Where chance plays, the mean over all pixels and samples must lie within 6 standard errors of the closed form (false alarm
//! 2e-9 a test) and the standard error must be small enough to see the stated relative effect.

mod glass;
mod limits;

use photolathe::render::driver::{Outcome, render_unwatched};
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::scene::options::{Antialias, Integrator, RenderTable, Rule};
use photolathe::scene::{Rgb, file};
use std::path::Path;

const FURNACE: &str = r#"
[camera]
eye = [0.2, 0.1, 0]
target = [1, 0, 0]
vertical_fov_deg = 60
[film]
width = 8
height = 8
[material.wall]
diffuse = { reflectance = [0.5, 0.5, 0.8] }
emission = { radiance = [1, 1, 1], side = "back" }
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "wall"
"#;

fn outcome(text: &str, table: RenderTable, overrides: &[(&str, &str)]) -> Outcome {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|&(key, value)| (key.to_owned(), value.to_owned()))
        .collect();
    let scene = file::parse(text, "scene", Path::new("."), &overrides).expect("the scene is valid");
    let settings = Settings::resolve(&table.or(&scene.render));
    render_unwatched(&scene, &settings).expect("the scene suits the integrator")
}

fn by(integrator: Integrator, spp: u32) -> RenderTable {
    RenderTable {
        integrator: Some(integrator),
        spp: Some(spp),
        aa: Some(Antialias::None),
        ..RenderTable::default()
    }
}

fn path(text: &str, spp: u32, overrides: &[(&str, &str)]) -> Film {
    outcome(text, by(Integrator::Path, spp), overrides).film
}

/// The mean of the picture is `expected`, and a relative error of `effect` would have been seen.
#[track_caller]
fn assert_mean(film: &Film, expected: Rgb, effect: f64) {
    assert_eq!(film.bad_samples(), 0);
    let n = film.pixels().len() as f64;
    let variance: Rgb = film
        .pixels()
        .iter()
        .map(|pixel| pixel.variance_of_mean())
        .sum::<Rgb>()
        / (n * n);
    let mean = film.mean();
    for channel in 0..3 {
        let (mean, expected, error) = (
            mean[channel],
            expected[channel],
            variance[channel].max(0.0).sqrt(),
        );
        let rounding = 1e-12 * expected.abs();
        assert!(
            (mean - expected).abs() <= 6.0 * error + rounding,
            "{mean} ± {error} against {expected}"
        );
        assert!(
            6.0 * error <= effect * expected.abs(),
            "an error of {error} cannot see {effect} of {expected}"
        );
    }
}

#[test]
fn a_furnace_glows_with_the_sum_of_all_bounces() {
    assert_mean(&path(FURNACE, 1000, &[]), Rgb::new(2.0, 2.0, 5.0), 0.02);
}

#[test]
fn a_furnace_with_limited_bounces_glows_with_the_partial_sum() {
    for depth in [0, 1, 2, 5] {
        let limit = depth.to_string();
        let film = path(FURNACE, 200, &[("render.max_depth", &limit)]);
        let sum = |rho: f64| (1.0 - rho.powi(depth + 1)) / (1.0 - rho);
        assert_mean(&film, Rgb::new(sum(0.5), sum(0.5), sum(0.8)), 0.03);
    }
}

#[test]
fn a_furnace_of_diffuse_mirrors_glows_as_their_sum_says() {
    let wall = "emission = ";
    let text = FURNACE
        .replace("[0.5, 0.5, 0.8]", "[0.3, 0.3, 0.3]")
        .replace(
            wall,
            "mirror = { reflectance = [0.2, 0.2, 0.5] }\nemission = ",
        );
    assert_mean(&path(&text, 1000, &[]), Rgb::new(2.0, 2.0, 5.0), 0.02);
}

#[test]
fn a_furnace_seen_from_the_side_that_does_not_emit_is_black() {
    assert_eq!(
        path(&FURNACE.replace("\"back\"", "\"front\""), 20, &[]).mean(),
        Rgb::ZERO
    );
    assert_mean(
        &path(&FURNACE.replace("\"back\"", "\"both\""), 1000, &[]),
        Rgb::new(2.0, 2.0, 5.0),
        0.02,
    );
}

/// E = (I/R²)(1 + ρ/(1−ρ)) everywhere for a light at the centre, so L = 1 for I = π, ρ = ½, R = 1.
#[test]
fn an_integrating_sphere_is_evenly_bright() {
    let pi = std::f64::consts::PI;
    let text = FURNACE
        .replace("emission = { radiance = [1, 1, 1], side = \"back\" }", "")
        .replace("[0.5, 0.5, 0.8]", "[0.5, 0.5, 0.5]")
        + &format!("[[point_light]]\nposition = [0, 0, 0]\nintensity = [{pi}, {pi}, {pi}]\n");
    assert_mean(&path(&text, 1000, &[]), Rgb::ONE, 0.01);
}

/// A camera that looks down at one point of a diffuse floor, with room for a light.
const FLOOR: &str = r#"
[camera]
eye = [3, 2, 0]
target = [0, 0, 0]
vertical_fov_deg = 0.001
[film]
width = 2
height = 2
[material.floor]
diffuse = { reflectance = [0.6, 0.6, 0.6] }
[material.lamp]
emission = { radiance = [5, 5, 5] }
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "floor"
"#;

fn floor_with(light: &str) -> String {
    format!("{FLOOR}{light}")
}

#[test]
fn a_point_light_over_a_floor_follows_the_cosine_and_the_square_of_the_distance() {
    let text = floor_with("[[point_light]]\nposition = [1, 2, 2]\nintensity = [7, 7, 7]\n");
    let expected = 0.6 / std::f64::consts::PI * 7.0 * 2.0 / 27.0;
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let mean = outcome(&text, by(integrator, 1), &[]).film.mean().x;
        // The camera's field of 0.001 degrees spans 6e-5 of the floor.
        assert!(
            (mean / expected - 1.0).abs() < 1e-4,
            "{mean} against {expected}"
        );
    }
}

#[test]
fn a_beam_lights_its_disc_and_nothing_else() {
    let beam = |center: &str| {
        format!(
            "[[beam]]\ncenter = {center}\ndirection = [0, -3, 4]\nradius = 0.5\nirradiance = [2, 2, 2]\n"
        )
    };
    let on = outcome(
        &floor_with(&beam("[0, 3, -4]")),
        by(Integrator::Path, 1),
        &[],
    )
    .film
    .mean()
    .x;
    assert!((on / (0.6 / std::f64::consts::PI * 2.0 * 0.6) - 1.0).abs() < 1e-12);
    let off = outcome(
        &floor_with(&beam("[0.6, 3, -4]")),
        by(Integrator::Path, 1),
        &[],
    )
    .film
    .mean();
    assert_eq!(off, Rgb::ZERO);
}

/// E = π L R²/(R² + h²) under the axis of a disc; a square gives the sum over its edges (Lambert).
#[test]
fn area_lights_give_the_irradiance_of_their_shape() {
    let pi = std::f64::consts::PI;
    let disc =
        "[[disc]]\ncenter = [0, 2, 0]\nnormal = [0, -1, 0]\nradius = 1\nmaterial = \"lamp\"\n";
    let radiance = 0.6 / pi * pi * 5.0 * 1.0 / (1.0 + 4.0);
    let (a, h) = (1.0_f64, 2.0_f64);
    let slant = (a * a + h * h).sqrt();
    let square_form = 4.0 * 5.0 * a / slant * libm::atan(a / slant);
    let square = "[[quad]]\ncorner = [-1, 2, -1]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, 2]\nmaterial = \"lamp\"\n";
    let ball = "[[sphere]]\ncenter = [0, 3, 0]\nradius = 1\nmaterial = \"lamp\"\n";
    for (light, expected) in [
        (disc, radiance),
        (square, 0.6 / pi * square_form),
        (ball, 0.6 * 5.0 / 9.0),
    ] {
        assert_mean(
            &path(&floor_with(light), 20_000, &[]),
            Rgb::splat(expected),
            0.01,
        );
        let whitted = outcome(&floor_with(light), by(Integrator::Whitted, 1000), &[]).film;
        assert_mean(&whitted, Rgb::splat(expected), 0.01);
    }
}

/// A camera inside a lossless ball of index n in surroundings of radiance 1 reads n².
#[test]
fn radiance_inside_glass_is_larger_by_the_index_squared() {
    let text = r#"
background = [1, 1, 1]
[camera]
eye = [0.1, 0, 0]
target = [1, 0, 0]
vertical_fov_deg = 40
[film]
width = 4
height = 4
[material.glass]
dielectric = { ior = 1.5 }
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "glass"
"#;
    assert_mean(&path(text, 2000, &[]), Rgb::splat(2.25), 0.01);
    let whitted = outcome(text, by(Integrator::Whitted, 1), &[]).film.mean().x;
    assert!((whitted / 2.25 - 1.0).abs() < 1e-3, "{whitted}");
}

/// From outside, a lossless ball in even surroundings cannot be seen at all.
#[test]
fn a_lossless_ball_in_even_surroundings_is_invisible() {
    let text = r#"
background = [1, 1, 1]
[camera]
eye = [0, 0, 5]
target = [0, 0, 0]
vertical_fov_deg = 30
[film]
width = 8
height = 8
[material.glass]
dielectric = { ior = 1.5 }
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "glass"
"#;
    // All paths carry 1 but the few that roulette touches, one in a thousand: far from normal, so no z.
    let mean = path(text, 200, &[]).mean().x;
    assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    let mean = outcome(text, by(Integrator::Whitted, 1), &[]).film.mean().x;
    assert!(
        (mean - 1.0).abs() < 2e-3,
        "{mean}: only the lightest branches are left to roulette"
    );
}

/// A slab of glass before an even lamp, seen from straight above.
const SLAB: &str = r#"
[camera]
eye = [0.3, 5, 0.2]
target = [0.3, 0, 0.2]
up = [0, 0, -1]
vertical_fov_deg = 0.01
[film]
width = 2
height = 2
[material.glass]
dielectric = { ior = 1.5, absorption = [0, 0.5, 2] }
[material.lamp]
emission = { radiance = [1, 1, 1], side = "front" }
[[revolution]]
material = "glass"
profile = [
  [[0, 0], [1, 0], [2, 0], [3, 0]],
  [[3, 0], [3, 0.25], [3, 0.5], [3, 0.75]],
  [[3, 0.75], [2, 0.75], [1, 0.75], [0, 0.75]],
]
[[disc]]
center = [0, -1, 0]
normal = [0, 1, 0]
radius = 50
material = "lamp"
"#;

/// Transmittance of the slab (n = 1.5, thickness ¾) by the formulas of Snell, Fresnel and Beer, all internal reflections summed:
/// T = (1−F)²τ/(1 − F²τ²).
fn slab_transmittance(cos: f64, sigma: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos * cos) / 2.25).sqrt();
    let s = (cos - 1.5 * cos_t) / (cos + 1.5 * cos_t);
    let p = (1.5 * cos - cos_t) / (1.5 * cos + cos_t);
    let f = 0.5 * (s * s + p * p);
    let tau = libm::exp(-sigma * 0.75 / cos_t);
    (1.0 - f) * (1.0 - f) * tau / (1.0 - f * f * tau * tau)
}

#[test]
fn a_slab_of_glass_lets_through_what_fresnel_and_beer_say() {
    let expected = Rgb::from_array([0.0, 0.5, 2.0].map(|sigma| slab_transmittance(1.0, sigma)));
    assert!((expected.x - 0.923_076_923).abs() < 1e-9);
    assert_mean(&path(SLAB, 20_000, &[]), expected, 0.05);
    // Two reflections inside weigh 0.0015, so roulette decides about them: 2000 passes.
    let whitted = outcome(SLAB, by(Integrator::Whitted, 2000), &[]).film;
    assert_mean(&whitted, expected, 0.01);
}

/// At 75 degrees a quarter is reflected, which a constant reflectance would miss.
#[test]
fn a_slab_seen_at_a_slant_follows_fresnel_too() {
    let cos = libm::cos(75_f64.to_radians());
    let expected = Rgb::from_array([0.0, 0.5, 2.0].map(|sigma| slab_transmittance(cos, sigma)));
    let eye = format!("[{}, 1.75, 0]", 1.0 * libm::tan(75_f64.to_radians()));
    let slanted = [
        ("camera.eye", eye.as_str()),
        ("camera.target", "[0, 0.75, 0]"),
    ];
    assert_mean(&path(SLAB, 20_000, &slanted), expected, 0.05);
    let whitted = outcome(SLAB, by(Integrator::Whitted, 2000), &slanted).film;
    assert_mean(&whitted, expected, 0.02);
}

/// A floor under a slab of glass (n = 1.5, thickness ¾) in a wide slanting beam, seen from below the slab.
const UNDER_A_SLAB: &str = r#"
[camera]
eye = [0, 2, 0]
target = [0, 0, 0]
up = [0, 0, -1]
vertical_fov_deg = 5
[film]
width = 1
height = 1
[material.floor]
diffuse = { reflectance = [1e-6, 1e-6, 1e-6] }
[material.glass]
dielectric = { ior = 1.5, absorption = [0, 0.5, 2] }
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "floor"
[[revolution]]
material = "glass"
profile = [
  [[0, 3], [3, 3], [6, 3], [9, 3]],
  [[9, 3], [9, 3.25], [9, 3.5], [9, 3.75]],
  [[9, 3.75], [6, 3.75], [3, 3.75], [0, 3.75]],
]
"#;

/// Photons through the slab, at normal incidence and at 60 degrees: E = E₀ cosθ T(θ). The beam is wide against the shifts of the inner
/// reflections; no light of the floor comes back, which the slab would reflect. Sees 4.5 %.
#[test]
fn photons_through_a_slab_lose_what_fresnel_and_beer_take() {
    for degrees in [0.0_f64, 60.0] {
        let (sin, cos) = (
            libm::sin(degrees.to_radians()),
            libm::cos(degrees.to_radians()),
        );
        // Refraction moves the beam by ¾ (tanθ − tanθ_t) back along x; where it is uniform a shift does not show.
        let center = format!("[{}, {}, 0]", -6.0 * sin / cos, 6.0);
        let text = format!(
            "{UNDER_A_SLAB}\n[[beam]]\ncenter = {center}\ndirection = [{sin}, {}, 0]\nradius = 1.2\nirradiance = [1, 1, 1]\n",
            -cos
        );
        let table = RenderTable {
            photons: Some(20_000),
            passes: Some(25),
            radius: Some(0.4),
            max_depth: Some(40),
            rule: Some(Rule::Constant),
            ..by(Integrator::Sppm, 1)
        };
        let film = outcome(&text, table, &[]).film;
        let through = [0.0, 0.5, 2.0].map(|sigma| slab_transmittance(cos, sigma));
        let expected = 1e-6 / std::f64::consts::PI * cos * Rgb::from_array(through);
        assert_mean(&film, expected, 0.045);
    }
}

/// A room with every material, for comparisons without a closed form.
const ROOM: &str = r#"
[camera]
eye = [0, 1, 5]
target = [0, 0.8, 0]
vertical_fov_deg = 40
lens_radius = 0.05
[film]
width = 24
height = 20
[material.grey]
diffuse = { reflectance = [0.6, 0.6, 0.6] }
[material.board]
diffuse = { checker = [[0.8, 0.8, 0.8], [0.2, 0.2, 0.3]] }
[material.satin]
diffuse = { reflectance = [0.4, 0.2, 0.2] }
mirror = { reflectance = [0.3, 0.3, 0.3] }
[material.glass]
dielectric = { ior = 1.5, absorption = [0.1, 0.2, 0.3] }
[material.lamp]
emission = { radiance = [6, 6, 6] }
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "board"
[[plane]]
point = [0, 0, -2]
normal = [0, 0, 1]
material = "grey"
[[sphere]]
center = [-0.8, 0.5, 0]
radius = 0.5
material = "satin"
[[sphere]]
center = [0.6, 0.5, 0.3]
radius = 0.5
material = "glass"
[[disc]]
center = [0, 3, 1]
normal = [0, -1, 0]
radius = 0.8
material = "lamp"
"#;

#[test]
fn the_same_seed_gives_the_same_bits_on_any_number_of_threads() {
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let film = |threads| {
            let table = RenderTable {
                threads: Some(threads),
                seed: Some(7),
                aa: None,
                ..by(integrator, 3)
            };
            outcome(ROOM, table, &[])
        };
        let one = film(1);
        for threads in [2, 3] {
            let other = film(threads);
            assert_eq!(one.film, other.film, "{integrator:?} on {threads} threads");
            assert_eq!(one.work, other.work);
        }
    }
}

#[test]
fn another_seed_gives_another_picture() {
    let film = |seed| {
        outcome(
            ROOM,
            RenderTable {
                seed: Some(seed),
                ..by(Integrator::Path, 1)
            },
            &[],
        )
        .film
    };
    assert_ne!(film(1), film(2));
}

#[test]
fn twice_the_light_gives_twice_the_picture() {
    let bright = ROOM.replace("[6, 6, 6]", "[12, 12, 12]");
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let (once, twice) = (
            outcome(ROOM, by(integrator, 4), &[]).film,
            outcome(&bright, by(integrator, 4), &[]).film,
        );
        for (a, b) in once.pixels().iter().zip(twice.pixels()) {
            // Each sample doubles to the bit; the film's sums cut off below 2⁻⁵² of the largest one, at places that do not double.
            let off = (2.0 * a.mean() - b.mean()).abs();
            assert!(off.cmple(f64::EPSILON * b.mean()).all());
        }
    }
}
