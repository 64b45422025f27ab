//! A light asked two ways, lit points and emitted photons, is one light, and both agree with closed forms.
//!
//! Statistical tests use fixed seeds and fail beyond 6 standard errors: a false alarm of 2e-9 each. What they can see is 6
//! standard errors: at most 2 % of an irradiance, 12 % of a flux by photons.

mod aim;
mod support;

use glam::DVec3;
use photolathe::geometry::planar::Quad;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::Solver;
use photolathe::geometry::shape::Shape;
use photolathe::numeric::work::Work;
use photolathe::scene::Rgb;
use photolathe::scene::light::{Emitter, Light, Lights};
use photolathe::scene::material::Side;
use std::f64::consts::PI;
use support::{
    Estimate, SIGMAS, area, beam, disc, estimate, point_light, quad, shape, sphere, stream, v,
};

/// Irradiance of the first channel at a point, by next-event estimation; the light's own surface may be in the way.
fn irradiance(light: &Light, point: DVec3, normal: DVec3, count: usize) -> Estimate {
    let own = match light {
        Light::Area { surface, .. } => Some(shape(surface)),
        Light::Point { .. } | Light::Beam { .. } => None,
    };
    let mut numbers = stream(1);
    estimate(count, || {
        let Some(incident) = light.illuminate(point, numbers.uniform2()) else {
            return 0.0;
        };
        let way = Ray::new(point, incident.direction).until(incident.reach);
        let blocked = own.as_ref().is_some_and(|shape| {
            shape
                .nearest(&way, &Solver::Bernstein, &mut Work::default())
                .is_some()
        });
        if blocked {
            0.0
        } else {
            incident.weight.x * normal.dot(incident.direction).max(0.0)
        }
    })
}

/// Irradiance by Lambert's formula (1760): (L/2) Σ Θ_i Γ_i·n over the edges of a polygon wholly above the receiver's plane.
fn polygon_irradiance(corners: &[DVec3], point: DVec3, normal: DVec3) -> f64 {
    let towards: Vec<DVec3> = corners
        .iter()
        .map(|corner| (*corner - point).normalize())
        .collect();
    let sum: f64 = (0..towards.len())
        .map(|i| {
            let (a, b) = (towards[i], towards[(i + 1) % towards.len()]);
            libm::acos(a.dot(b)) * a.cross(b).normalize().dot(normal)
        })
        .sum();
    0.5 * sum.abs()
}

fn lamp_quad() -> Quad {
    // Normal along edge_u × edge_v = -y.
    quad(v(-0.7, 2.0, -0.4), v(1.5, 0.0, 0.2), v(0.1, 0.0, 1.1))
}

#[test]
fn a_quad_lights_as_lamberts_polygon() {
    let quad = lamp_quad();
    assert!(quad.normal().y < 0.0);
    let corners = [
        quad.corner,
        quad.corner + quad.edge_u,
        quad.corner + quad.edge_u + quad.edge_v,
        quad.corner + quad.edge_v,
    ];
    for (point, normal) in [
        (DVec3::ZERO, DVec3::Y),
        (v(1.5, 0.5, -1.0), DVec3::Y),
        (v(3.0, 1.0, 0.0), v(-0.8, 0.6, 0.0)),
    ] {
        let exact = polygon_irradiance(&corners, point, normal);
        irradiance(
            &area(Emitter::Quad(quad), Side::Front),
            point,
            normal,
            400_000,
        )
        .agrees_with(exact, "front");
        irradiance(
            &area(Emitter::Quad(quad), Side::Both),
            point,
            normal,
            400_000,
        )
        .agrees_with(exact, "both");
        let behind = irradiance(&area(Emitter::Quad(quad), Side::Back), point, normal, 1000);
        assert_eq!(behind.mean, 0.0);
    }
}

#[test]
fn a_disc_lights_its_axis_by_the_closed_form() {
    let disc = disc(v(1.0, 3.0, -2.0), DVec3::NEG_Y, 1.3);
    for height in [0.5, 1.0, 5.0] {
        let point = disc.center - height * DVec3::Y;
        let exact = PI * disc.radius.powi(2) / (disc.radius.powi(2) + height * height);
        let count = 400_000;
        irradiance(
            &area(Emitter::Disc(disc), Side::Front),
            point,
            DVec3::Y,
            count,
        )
        .agrees_with(exact, &format!("height {height}"));
        let above = disc.center + height * DVec3::Y;
        irradiance(
            &area(Emitter::Disc(disc), Side::Back),
            above,
            DVec3::NEG_Y,
            count,
        )
        .agrees_with(exact, &format!("behind, height {height}"));
        let dark = irradiance(
            &area(Emitter::Disc(disc), Side::Front),
            above,
            DVec3::NEG_Y,
            1000,
        );
        assert_eq!(dark.mean, 0.0);
    }
}

#[test]
fn a_sphere_lights_from_outside_by_the_closed_form() {
    let sphere = sphere(v(-1.0, 2.0, 0.5), 0.8);
    let light = area(Emitter::Sphere(sphere), Side::Front);
    let towards = v(0.6, 0.0, 0.8);
    for distance in [0.801, 1.0, 4.0, 1000.0] {
        let point = sphere.center - distance * towards;
        let exact = PI * (sphere.radius / distance).powi(2);
        irradiance(&light, point, towards, 400_000)
            .agrees_with(exact, &format!("distance {distance}"));
    }
    // Tilted by 60 degrees, still wholly above the receiver.
    let point = sphere.center - 4.0 * towards;
    let tilted = 0.5 * towards + 0.75_f64.sqrt() * DVec3::Y;
    irradiance(&light, point, tilted, 400_000).agrees_with(0.5 * PI * 0.04, "tilted");
    let dark = irradiance(
        &area(Emitter::Sphere(sphere), Side::Back),
        point,
        towards,
        1000,
    );
    assert_eq!(dark.mean, 0.0);
}

/// Inside a sphere of uniform inward radiance every direction has it: E = π L for any point and normal.
#[test]
fn a_sphere_lights_its_inside_uniformly() {
    let sphere = sphere(v(5.0, 0.0, 1.0), 2.0);
    for side in [Side::Back, Side::Both] {
        let light = area(Emitter::Sphere(sphere), side);
        for (offset, normal) in [
            (DVec3::ZERO, DVec3::Y),
            (v(0.9, -0.4, 0.3), v(0.6, 0.0, 0.8)),
            (v(0.0, -1.9, 0.0), DVec3::Y),
            (v(0.0, -1.999_999_999, 0.0), DVec3::Y),
        ] {
            irradiance(&light, sphere.center + offset, normal, 2_000_000)
                .agrees_with(PI, &format!("{side:?} at {offset}"));
        }
    }
    let dark = area(Emitter::Sphere(sphere), Side::Front);
    assert_eq!(irradiance(&dark, sphere.center, DVec3::Y, 1000).mean, 0.0);
}

#[test]
fn points_and_beams_light_exactly() {
    let point = point_light(v(0.0, 3.0, 4.0), Rgb::splat(50.0));
    let incident = point.illuminate(DVec3::ZERO, [0.3, 0.4]).unwrap();
    assert_eq!(incident.weight, Rgb::splat(2.0));
    assert_eq!((incident.distance, incident.reach), (5.0, 5.0));
    assert_eq!(incident.direction, v(0.0, 0.6, 0.8));
    assert!(point.illuminate(v(0.0, 3.0, 4.0), [0.5, 0.5]).is_none());

    let beam = beam(v(0.0, 5.0, 0.0), DVec3::NEG_Y, 2.0, Rgb::splat(3.0));
    let lit = |x: f64, y: f64| beam.illuminate(v(x, y, 0.0), [0.5, 0.5]);
    assert_eq!(lit(1.9, 0.0).unwrap().weight, Rgb::splat(3.0));
    assert_eq!(lit(1.9, 0.0).unwrap().direction, DVec3::Y);
    assert_eq!(lit(1.9, 1.0).unwrap().reach, 4.0);
    assert!(lit(2.0, 1.0).is_some() && lit(2.1, 1.0).is_none());
    assert!(lit(0.0, 5.5).is_none(), "behind the disc");
}

#[test]
fn powers_are_those_of_the_closed_forms() {
    let close = |found: Rgb, expected: Rgb| {
        assert!(
            (found - expected).length() < 1e-12 * expected.length(),
            "{found} {expected}"
        )
    };
    let radiance = Rgb::new(1.0, 2.0, 0.5);
    let disc = disc(DVec3::ZERO, DVec3::X, 3.0);
    close(
        area(Emitter::Disc(disc), Side::Front).power(),
        9.0 * PI * PI * radiance,
    );
    close(
        area(Emitter::Disc(disc), Side::Both).power(),
        18.0 * PI * PI * radiance,
    );
    let sphere = sphere(DVec3::ZERO, 0.5);
    close(
        area(Emitter::Sphere(sphere), Side::Back).power(),
        PI * PI * radiance,
    );
    let quad = quad(DVec3::ZERO, v(2.0, 0.0, 0.0), v(5.0, 3.0, 0.0));
    close(
        area(Emitter::Quad(quad), Side::Front).power(),
        6.0 * PI * radiance,
    );
    let point = point_light(DVec3::ZERO, radiance);
    close(point.power(), 4.0 * PI * radiance);
    let beam = beam(DVec3::ZERO, DVec3::X, 2.0, radiance);
    close(beam.power(), 4.0 * PI * radiance);
}

/// Flux of the first channel through the front of a receiver, by photons; the light's own surface may be in the way.
fn photon_flux(lights: &Lights, receiver: &Quad, count: usize) -> Estimate {
    let shapes: Vec<Shape> = lights
        .all()
        .iter()
        .filter_map(|light| match light {
            Light::Area { surface, .. } => Some(shape(surface)),
            Light::Point { .. } | Light::Beam { .. } => None,
        })
        .collect();
    let normal = receiver.normal();
    let mut photon = 0;
    estimate(count, || {
        photon += 1;
        let Some(emitted) = lights.emit(&mut stream(1000 + photon)) else {
            return 0.0;
        };
        assert!((emitted.ray.direction.length() - 1.0).abs() < 1e-12);
        let Some(hit) = receiver.nearest(&emitted.ray) else {
            return 0.0;
        };
        let way = emitted.ray.until(hit.t);
        let free = shapes.iter().all(|shape| {
            shape
                .nearest(&way, &Solver::Bernstein, &mut Work::default())
                .is_none()
        });
        let arrives = free && emitted.ray.direction.dot(normal) < 0.0;
        if arrives { emitted.flux.x } else { 0.0 }
    })
}

/// The same flux by next-event estimation at uniform points of the receiver.
fn lit_flux(lights: &Lights, receiver: &Quad, count: usize) -> Estimate {
    let mut numbers = stream(2);
    estimate(count, || {
        let at = numbers.uniform2();
        let point = receiver.corner + at[0] * receiver.edge_u + at[1] * receiver.edge_v;
        let u = numbers.uniform2();
        let each = lights.all().iter().map(|light| {
            light.illuminate(point, u).map_or(0.0, |incident| {
                incident.weight.x * receiver.normal().dot(incident.direction).max(0.0)
            })
        });
        receiver.area() * each.sum::<f64>()
    })
}

/// The receiver has its normal along +y: edge_u × edge_v.
fn receiver(x: f64, y: f64, z: f64, size: f64) -> Quad {
    quad(
        v(x - size, y, z + size),
        v(2.0 * size, 0.0, 0.0),
        v(0.0, 0.0, -2.0 * size),
    )
}

#[test]
fn photons_and_lit_points_tell_of_the_same_light() {
    let shell = sphere(DVec3::ZERO, 3.0);
    let sphere = sphere(v(0.2, 1.0, -0.3), 0.6);
    let disc = disc(v(0.5, 1.5, 0.0), v(0.6, -0.8, 0.0), 0.7);
    let kinds = [
        ("quad", area(Emitter::Quad(lamp_quad()), Side::Front)),
        (
            "quad, both sides",
            area(Emitter::Quad(lamp_quad()), Side::Both),
        ),
        ("disc", area(Emitter::Disc(disc), Side::Front)),
        ("sphere", area(Emitter::Sphere(sphere), Side::Front)),
        (
            "sphere from inside",
            area(Emitter::Sphere(shell), Side::Back),
        ),
        (
            "sphere of two sides, from inside",
            area(Emitter::Sphere(shell), Side::Both),
        ),
        ("point", point_light(v(0.3, 1.0, 0.1), Rgb::ONE)),
        (
            "beam",
            beam(v(1.0, 4.0, 0.0), v(-0.28, -0.96, 0.0), 1.4, Rgb::ONE),
        ),
    ];
    for (what, light) in kinds {
        let lights = Lights::new(vec![light]);
        let target = receiver(0.0, 0.0, 0.0, 0.9);
        let photons = photon_flux(&lights, &target, 400_000);
        let lit = lit_flux(&lights, &target, 400_000);
        let error = (photons.error.powi(2) + lit.error.powi(2)).sqrt();
        assert!(
            (photons.mean - lit.mean).abs() < SIGMAS * error,
            "{what}: {photons:?} against {lit:?}"
        );
        assert!(
            error < 0.02 * lit.mean,
            "{what}: too noisy: {photons:?} {lit:?}"
        );
    }
}

#[test]
fn many_lights_share_photons_by_power_and_lose_none() {
    let point = |intensity: f64| point_light(v(0.0, 1.0, 0.0), Rgb::new(intensity, 0.0, 0.0));
    let lights = Lights::new(vec![
        point(0.0),
        point(1.0),
        point(0.0),
        point(3.0),
        point(1e-6),
        point(0.0),
    ]);
    let expected = [0.0, 0.25, 0.0, 0.75, 0.0, 0.0];
    for (index, expected) in expected.into_iter().enumerate() {
        assert!(
            (lights.probability(index) - expected).abs() < 1e-6,
            "light {index}"
        );
    }
    let total: f64 = (0..6).map(|index| lights.probability(index)).sum();
    assert!((total - 1.0).abs() < 1e-15);
    let mut counts = [0; 6];
    let mut numbers = stream(3);
    let n = 100_000;
    for _ in 0..n {
        counts[lights.choose(numbers.uniform()).unwrap()] += 1;
    }
    let deviation = (f64::from(n) * 0.25 * 0.75).sqrt();
    assert!(
        (f64::from(counts[1]) - 0.25 * f64::from(n)).abs() < SIGMAS * deviation,
        "{counts:?}"
    );
    assert_eq!((counts[0], counts[2], counts[5]), (0, 0, 0));
    // The largest number below 1 must not reach a light without power.
    assert_eq!(lights.choose(1.0 - 0.5_f64.powi(53)), Some(4));
    assert_eq!(lights.choose(0.0), Some(1));

    // The sum over all photons is the sum over all lights, also for lights of very different power.
    let beam = beam(v(0.0, 2.0, 0.0), DVec3::NEG_Y, 0.5, Rgb::splat(2.0));
    let mixed = Lights::new(vec![
        point(1e-3),
        beam,
        area(Emitter::Quad(lamp_quad()), Side::Front),
    ]);
    let target = receiver(0.0, 0.0, 0.0, 0.9);
    let (photons, lit) = (
        photon_flux(&mixed, &target, 400_000),
        lit_flux(&mixed, &target, 400_000),
    );
    let error = (photons.error.powi(2) + lit.error.powi(2)).sqrt();
    assert!(
        (photons.mean - lit.mean).abs() < SIGMAS * error,
        "{photons:?} {lit:?}"
    );
}

/// A dim green lamp beside a red one of 10¹⁷ times its power: half of all photons are green, and carry its power. Of lamps that are alike in
/// colour even the dimmest is drawn, exactly as often as its probability says, wherever it is listed.
#[test]
fn no_light_is_too_weak_to_be_drawn() {
    let point = |intensity: Rgb| point_light(v(0.0, 1.0, 0.0), intensity);
    let [green, red] = [Rgb::new(0.0, 1.0, 0.0), Rgb::new(1e17, 0.0, 0.0)];
    for intensities in [[green, red], [red, green]] {
        let lights = Lights::new(intensities.map(point).to_vec());
        assert_eq!([0, 1].map(|light| lights.probability(light)), [0.5; 2]);
        let mut numbers = stream(5);
        let n = 4000;
        let fluxes = (0..n).filter_map(|_| lights.emit(&mut numbers));
        let mean = fluxes.map(|photon| photon.flux).sum::<Rgb>() / f64::from(n);
        // Six standard errors of half of the photons.
        assert!(
            (mean / lights.power() - 1.0)
                .with_z(0.0)
                .abs()
                .max_element()
                < 6.0 / 4000_f64.sqrt()
        );
    }
    let grain = 0.5_f64.powi(53);
    for powers in [
        [1e-30, 1.0, 1e-30],
        [1.0, 1e-30, 1e-30],
        [1e-30, 1e-30, 1.0],
    ] {
        let lights = Lights::new(powers.map(|power| point(Rgb::splat(power))).to_vec());
        let mut below = 0.0;
        for light in 0..3 {
            let probability = lights.probability(light);
            assert!(probability >= grain);
            assert_eq!(lights.choose(below), Some(light));
            below += probability;
            assert_eq!(lights.choose(below - grain), Some(light));
        }
        assert_eq!(below, 1.0);
    }
}

#[test]
fn dark_lights_emit_nothing() {
    assert!(Lights::new(Vec::new()).dark());
    let dark = Lights::new(vec![point_light(DVec3::ZERO, Rgb::ZERO)]);
    assert!(dark.dark());
    assert!(dark.emit(&mut stream(4)).is_none());
    assert!(dark.choose(0.5).is_none());
    assert_eq!(dark.power(), Rgb::ZERO);
    assert_eq!(dark.probability(0), 0.0);
}

/// The way to a lamp ends before the lamp, and only just: whatever the distance, the lamp never shadows itself, and a thing
/// that stands a thousandth before it does.
#[test]
fn a_lamp_never_shadows_itself() {
    let sphere = sphere(v(1.0, 20.0, 3.0), 0.3);
    let disc = disc(v(1.0, 20.0, 3.0), v(0.6, -0.8, 0.0), 0.3);
    let mut quad = lamp_quad();
    quad.corner += v(0.1, 0.3, 7.7);
    for surface in [
        Emitter::Sphere(sphere),
        Emitter::Disc(disc),
        Emitter::Quad(quad),
    ] {
        let light = area(surface, Side::Both);
        let mut numbers = stream(5);
        for step in 0..60_000 {
            let scale = [1.0, 30.0, 1e3, 1e5, 1e8][step % 5];
            let mut coordinate = || numbers.range(-scale, scale);
            let point = v(coordinate(), coordinate(), coordinate());
            let u = numbers.uniform2();
            let Some(incident) = light.illuminate(point, u) else {
                continue;
            };
            let cos = match surface {
                Emitter::Sphere(_) => 1.0,
                Emitter::Disc(disc) => disc.normal.dot(incident.direction).abs(),
                Emitter::Quad(quad) => quad.normal().dot(incident.direction).abs(),
            };
            let way = Ray::new(point, incident.direction);
            let met = shape(&surface).nearest(
                &way.until(incident.reach),
                &Solver::Bernstein,
                &mut Work::default(),
            );
            assert!(met.is_none(), "from {point}: {incident:?} meets {met:?}");
            let size = 1.0 + scale / 1e8 * 1e3;
            assert!(
                cos < 1e-3 || incident.distance - incident.reach < 1e-3 * size,
                "{incident:?}"
            );
        }
    }
}
