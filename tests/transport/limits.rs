//! Depth limits, and lamps that hide each other.

use super::{assert_mean, by, floor_with, outcome, path};
use photolathe::scene::Rgb;
use photolathe::scene::options::Integrator;

/// A floor that glows is seen at every depth; what it scatters is one event.
#[test]
fn at_depth_zero_emission_alone_is_seen() {
    let light = "[[point_light]]\nposition = [0, 3, 0]\nintensity = [9, 9, 9]\n";
    let text = floor_with(light)
        .replace("0.6] }", "0.6] }\nemission = { radiance = [2, 2, 2] }")
        .replace("[[plane]]\npoint", "[[disc]]\nradius = 9\ncenter");
    for (depth, expected) in [("0", 2.0), ("1", 2.0 + 0.6 / std::f64::consts::PI)] {
        let overrides = [("render.max_depth", depth)];
        let mean = outcome(&text, by(Integrator::Whitted, 1), &overrides)
            .film
            .mean()
            .x;
        assert!((mean - expected).abs() < 1e-4, "{depth} {mean}");
    }
}

/// Two discs above a point of the floor. The lower covers sin² = ½ of what the point sees, the upper sin² = .8 but for that: the floor
/// gets π (8 · ½ + 2 · .3). They have unlike powers, and paths meet either often by themselves, so that their weights count.
#[test]
fn large_lamps_of_unlike_power_light_a_floor_by_their_visible_parts() {
    let lamp = |height: u32, radius: u32, kind: &str| {
        format!(
            "[[disc]]\ncenter = [0, {height}, 0]\nnormal = [0, -1, 0]\nradius = {radius}\nmaterial = \"{kind}\"\n"
        )
    };
    let dim = "[material.dim]\nemission = { radiance = [2, 2, 2] }\n";
    let text = floor_with(&[dim, &lamp(2, 2, "lamp"), &lamp(3, 6, "dim")].concat())
        .replace("radiance = [5, 5, 5]", "radiance = [8, 8, 8]")
        .replace("eye = [3, 2, 0]", "eye = [3, 1, 0]");
    let film = path(&text, 20_000, &[("render.max_depth", "1")]);
    assert_mean(&film, Rgb::splat(0.6 * (4.0 + 0.6)), 0.02);
}
