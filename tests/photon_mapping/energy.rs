//! Where the light goes.

use crate::scenes::*;
use glam::DVec3;
use photolathe::render::photon::trace::{Energy, trace};
use photolathe::scene::Rgb;
use photolathe::scene::light::Light;

fn channel_sum(energy: &Energy) -> Rgb {
    energy.absorbed + energy.escaped + energy.roulette + energy.cut
}

/// Every loss is counted where it happens; roulette gives back what it takes (its mean is within 1 % of the emitted light).
#[test]
fn emitted_energy_is_absorbed_or_escapes_or_is_cut() {
    for depth in [None, Some(3)] {
        let energy = trace(&full_box(8), 9, 0, 50_000, depth).energy;
        let lost = (energy.emitted - channel_sum(&energy)).abs();
        assert!(lost.cmple(1e-12 * energy.emitted).all(), "{lost}");
        assert!(energy.roulette.abs().cmplt(0.01 * energy.emitted).all());
        assert!(energy.absorbed.min_element() > 0.0 && energy.escaped.min_element() > 0.0);
        assert_eq!(energy.cut == Rgb::ZERO, depth.is_none());
    }
}

/// A thin beam through the centre of an absorbing ball: T = (1 − F)²τ/(1 − F²τ²), with all its internal reflections.
#[test]
fn a_beam_through_a_ball_loses_what_fresnel_and_beer_take() {
    let scene = scene(
        1,
        camera(DVec3::new(0.0, 9.0, 9.0), DVec3::ZERO, 10.0),
        vec![
            (floor(), diffuse(0.001)),
            (sphere(2.0 * DVec3::Y, 1.0), glass(1.5, 0.2)),
        ],
        vec![Light::Beam {
            center: 5.0 * DVec3::Y,
            direction: -DVec3::Y,
            radius: 1e-4,
            irradiance: Rgb::ONE,
        }],
    );
    let n = 200_000;
    let photons = trace(&scene, 2, 0, n, Some(20));
    let arrived: f64 = photons.arrivals.iter().map(|photon| photon.flux.x).sum();
    let emitted = photons.energy.emitted.x;
    let (f, tau) = (0.04, libm::exp(-0.4));
    let expected = (1.0 - f) * (1.0 - f) * tau / (1.0 - f * f * tau * tau);
    let sigma = (0.08 / n as f64).sqrt();
    assert!(
        (arrived / emitted - expected).abs() < 6.0 * sigma,
        "{}",
        arrived / emitted
    );
}
