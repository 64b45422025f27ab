//! The caustic of a glass ball in parallel light: light that arrives through glass only.

use crate::scenes::*;
use glam::DVec3;
use photolathe::experiments::caustic::prediction::{Ball, Way};
use photolathe::numeric::statistics::chi_square;
use photolathe::render::photon::trace::{Photons, trace};
use photolathe::scene::Rgb;
use photolathe::scene::light::Light;

const PHOTONS: u64 = 300_000;
/// Rings of the plane in which photons are counted.
const RINGS: [f64; 17] = [
    0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.3, 2.0,
];

/// The rings for a way; light that is reflected on its way spreads wide.
fn rings(way: Way) -> [f64; 17] {
    RINGS.map(|ring| {
        if way == Way::Through(0) {
            ring
        } else {
            4.0 * ring
        }
    })
}

/// Photons of a beam as wide as the ball, on a floor that reflects next to nothing.
fn photons(ball: &Ball) -> Photons {
    let ground = quad(
        DVec3::new(-9.0, -ball.plane, 9.0),
        18.0 * DVec3::X,
        -18.0 * DVec3::Z,
    );
    let scene = scene(
        1,
        camera(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO, 10.0),
        vec![
            (ground, diffuse(1e-9)),
            (sphere(DVec3::ZERO, 1.0), glass(ball.ior, 0.0)),
        ],
        vec![Light::Beam {
            center: 3.0 * DVec3::Y,
            direction: -DVec3::Y,
            radius: ball.beam,
            irradiance: Rgb::ONE,
        }],
    );
    trace(&scene, 6, 0, PHOTONS, None)
}

/// Whether the photons that came on a way lie in the rings as predicted, by χ² at 10⁻⁶. Rings that expect fewer than 10 photons, and
/// all that is not in a ring, are one bin.
fn lie_as_predicted(photons: &Photons, predicted: &Ball, way: Way) -> bool {
    let rings = rings(way);
    let on_way = photons.arrivals.iter().zip(&photons.points);
    let distances: Vec<f64> = on_way
        .filter(|(arrival, _)| arrival.events == way.events())
        .map(|(_, point)| libm::hypot(point.x, point.z))
        .collect();
    let (mut observed, mut expected) = (Vec::new(), Vec::new());
    for ring in rings.windows(2) {
        let share = predicted.share_between(way, ring[0], ring[1]);
        if share * PHOTONS as f64 >= 10.0 {
            expected.push(share * PHOTONS as f64);
            let within = distances.iter().filter(|&d| (ring[0]..ring[1]).contains(d));
            observed.push(within.count() as u64);
        }
    }
    observed.push(PHOTONS - observed.iter().sum::<u64>());
    expected.push(PHOTONS as f64 - expected.iter().sum::<f64>());
    assert!(expected.len() > 4);
    chi_square(&observed, &expected, 0).p > 1e-6
}

/// Behind the focus and before it, where the light has a fold and crosses the axis: straight through, after two inner reflections, and
/// reflected outside (F at grazing angles). A wrong index and a wrong plane are found out.
#[test]
fn p11_the_caustic_of_a_glass_ball_has_its_closed_form() {
    for plane in [2.0, 1.1] {
        let ball = Ball {
            ior: 1.5,
            beam: 1.0,
            plane,
        };
        let photons = photons(&ball);
        for way in [Way::Through(0), Way::Through(2), Way::Outside] {
            assert!(lie_as_predicted(&photons, &ball, way), "{plane} {way:?}");
        }
        let wrong = [
            Ball { ior: 1.51, ..ball },
            Ball {
                plane: 1.02 * plane,
                ..ball
            },
        ];
        for wrong in wrong {
            assert!(
                !lie_as_predicted(&photons, &wrong, Way::Through(0)),
                "{wrong:?}"
            );
        }
    }
}
