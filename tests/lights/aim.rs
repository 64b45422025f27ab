//! Aimed photons are the light's own, with other weights.
//!
//! Fixed seeds. Tests of whole laws fail beyond eight standard deviations of chi-square with 288 degrees of freedom, a false alarm
//! below 1e-9; photons taken at another worth fail them.

use crate::support::{
    Estimate, SIGMAS, area, beam, disc, estimate, point_light, quad, sphere, stream, v,
};
use glam::DVec3;
use photolathe::geometry::planar::tangents;
use photolathe::geometry::shape::Shape;
use photolathe::geometry::sphere::Sphere;
use photolathe::scene::aim::{AIMED, Aim};
use photolathe::scene::light::{EmittedPhoton, Emitter, Light, Lights};
use photolathe::scene::material::{Dielectric, Material, Pattern, Side};
use photolathe::scene::{Object, Rgb};
use std::f64::consts::{PI, TAU};

fn material() -> Material {
    Material {
        name: String::new(),
        diffuse: None,
        mirror: None,
        dielectric: None,
        emission: None,
    }
}

fn glass() -> Material {
    let absorption = Rgb::ZERO;
    Material {
        dielectric: Some(Dielectric {
            ior: 1.5,
            absorption,
        }),
        ..material()
    }
}

fn object(shape: Shape) -> Object {
    Object {
        name: String::new(),
        bounds: shape.bounds(),
        shape,
        material: 0,
    }
}

fn aimed_at(light: Light, balls: &[Sphere]) -> Lights {
    let objects: Vec<Object> = balls.iter().map(|&b| object(Shape::Sphere(b))).collect();
    Lights::new(vec![light]).aimed(Aim::at(&objects, &[glass()]))
}

fn photons(lights: &Lights, count: u64) -> impl Iterator<Item = EmittedPhoton> {
    (0..count).map(|i| lights.emit(&mut stream(7000 + i)).expect("light"))
}

/// A ball to one side, a distant small one, two that overlap, one around the lamp and one that its plane cuts.
fn balls() -> [Sphere; 6] {
    [
        sphere(v(1.0, -1.0, 0.3), 0.5),
        sphere(v(-30.0, -50.0, 10.0), 3.0),
        sphere(v(0.0, -2.0, 0.0), 0.6),
        sphere(v(0.3, -2.5, 0.1), 0.9),
        sphere(v(0.0, 0.1, 0.0), 3.0),
        sphere(v(2.5, 0.1, -2.5), 0.7),
    ]
}

/// Bins of equal power over the directions of a light: by the square of the cosine or the cosine, and by the azimuth.
fn bin(normal: Option<DVec3>, direction: DVec3) -> usize {
    let axis = normal.unwrap_or(DVec3::Y);
    let (s, t) = tangents(axis);
    let cos = direction.dot(axis);
    let height = match normal {
        Some(_) => cos * cos,
        None => 0.5 + 0.5 * cos,
    };
    let turn = libm::atan2(direction.dot(t), direction.dot(s)) / TAU + 0.5;
    let cell = |x: f64, cells: usize| ((x * cells as f64) as usize).min(cells - 1);
    cell(height, 12) * 24 + cell(turn, 24)
}

/// Whether every bin has its share of the power, by chi-square. The variance of a bin is taken as the sum of squares of what is in it, a
/// little too large, so the test is on the safe side.
fn same_law(lights: &Lights, normal: Option<DVec3>, worth: impl Fn(&EmittedPhoton) -> f64) -> bool {
    let count = 400_000;
    let (mut sums, mut squares) = (vec![0.0; 12 * 24], vec![0.0; 12 * 24]);
    for photon in photons(lights, count) {
        let bin = bin(normal, photon.ray.direction);
        sums[bin] += worth(&photon);
        squares[bin] += worth(&photon) * worth(&photon);
    }
    let expected = count as f64 / sums.len() as f64;
    let deviations = sums.iter().zip(&squares);
    let statistic: f64 = deviations
        .map(|(sum, square)| (sum - expected) * (sum - expected) / square)
        .sum();
    let freedom = sums.len() as f64;
    statistic < freedom + 8.0 * (2.0 * freedom).sqrt()
}

#[test]
fn aimed_photons_keep_the_lights_own_law_of_directions() {
    let lamp = quad(v(-0.2, 0.0, -0.2), v(0.4, 0.0, 0.0), v(0.0, 0.0, 0.4));
    let down = lamp.normal();
    assert!(down == DVec3::NEG_Y);
    let round = disc(DVec3::ZERO, v(0.6, -0.8, 0.0), 0.1);
    let kinds = [
        (point_light(DVec3::ZERO, Rgb::ONE), None),
        (area(Emitter::Quad(lamp), Side::Front), Some(down)),
        (area(Emitter::Disc(round), Side::Front), Some(round.normal)),
    ];
    for (light, normal) in kinds {
        let lights = aimed_at(light.clone(), &balls());
        assert!(
            same_law(&lights, normal, |photon| photon.worth),
            "{light:?}"
        );
        assert!(!same_law(&lights, normal, |_| 1.0), "blind");
        assert!(
            !same_law(&lights, normal, |photon| photon.worth.max(0.5)),
            "blind"
        );
    }
}

/// Point light: the solid angle of the ball. A tiny lamp: cosine × (R/d)², exact above its horizon. Of equal photons only as many as the
/// ball's share would be there: with the aimed ones the error is a third.
#[test]
fn aimed_photons_bring_a_ball_exactly_its_share_of_the_flux() {
    let ball = sphere(v(0.9, -2.0, -0.3), 0.25);
    let (distance, sine) = {
        let distance = ball.center.length();
        (distance, ball.radius / distance)
    };
    let tiny = disc(DVec3::ZERO, DVec3::NEG_Y, 1e-7);
    let cases = [
        (
            point_light(DVec3::ZERO, Rgb::ONE),
            0.5 * (1.0 - (1.0 - sine * sine).sqrt()),
        ),
        (
            area(Emitter::Disc(tiny), Side::Front),
            2.0 / distance * sine * sine,
        ),
    ];
    let share = |lights: &Lights| {
        let mut all = photons(lights, 200_000);
        estimate(200_000, || {
            let photon = all.next().expect("a photon");
            let meets = ball.nearest(&photon.ray).is_some();
            if meets { photon.worth } else { 0.0 }
        })
    };
    for (light, expected) in cases {
        let aimed = share(&aimed_at(light.clone(), &[ball]));
        let error = |estimate: &Estimate| (estimate.mean - expected).abs() / estimate.error;
        assert!(error(&aimed) < SIGMAS, "{aimed:?} {expected}");
        let unaimed = share(&Lights::new(vec![light]));
        assert!(error(&unaimed) < SIGMAS, "{unaimed:?} {expected}");
        assert!(aimed.error < 0.4 * unaimed.error, "{aimed:?} {unaimed:?}");
    }
}

#[test]
fn aiming_changes_neither_the_power_nor_where_photons_start() {
    let lamp = quad(v(-0.2, 0.0, -0.2), v(0.4, 0.0, 0.0), v(0.0, 0.0, 0.4));
    let globe = sphere(v(0.0, 0.5, 0.0), 0.3);
    for light in [
        point_light(v(0.0, 0.2, 0.0), Rgb::ONE),
        area(Emitter::Quad(lamp), Side::Both),
        area(Emitter::Sphere(globe), Side::Front),
    ] {
        let lights = aimed_at(light.clone(), &balls());
        let plain = Lights::new(vec![light]);
        let mut pairs = photons(&lights, 200_000).zip(photons(&plain, 200_000));
        let worth = estimate(200_000, || {
            let (aimed, unaimed) = pairs.next().expect("a pair");
            assert_eq!(aimed.ray.origin, unaimed.ray.origin);
            let flux = aimed.worth * unaimed.flux;
            assert!((aimed.flux - flux).abs().max_element() <= 1e-15 * unaimed.flux.max_element());
            assert!((0.0..1.0 / (1.0 - AIMED) + 1e-15).contains(&aimed.worth));
            aimed.worth
        });
        assert!((worth.mean - 1.0).abs() < SIGMAS * worth.error, "{worth:?}");
        assert!(worth.error < 0.005);
    }
}

#[test]
fn nothing_is_drawn_where_there_is_nothing_to_aim_at() {
    let lamp = quad(v(-0.2, 0.0, -0.2), v(0.4, 0.0, 0.0), v(0.0, 0.0, 0.4));
    let up = [sphere(v(0.0, 1.0, 0.0), 0.9), sphere(DVec3::ZERO, 1.0)];
    let below = [sphere(v(0.0, -2.0, 0.0), 0.5)];
    let invisible = [sphere(v(0.0, -1e9, 0.0), 1e-9)];
    let same = |light: Light, balls: &[Sphere]| {
        let plain = Lights::new(vec![light.clone()]);
        photons(&plain, 500).eq(photons(&aimed_at(light, balls), 500))
    };
    // Behind the lamp or around it; too small to be met but by rounding; a beam has one direction only.
    assert!(same(area(Emitter::Quad(lamp), Side::Front), &up));
    assert!(same(area(Emitter::Quad(lamp), Side::Front), &invisible));
    assert!(same(beam(DVec3::Y, DVec3::NEG_Y, 1.0, Rgb::ONE), &below));
    assert!(!same(area(Emitter::Quad(lamp), Side::Front), &below));
    // Cut by the lamp's plane, its centre behind: what is before it is worth aiming at.
    let cut = [sphere(v(1.5, 0.1, 0.0), 0.5)];
    assert!(!same(area(Emitter::Quad(lamp), Side::Front), &cut));

    // What is flat, diffuse, or a mirror with a diffuse part is no target; a mirror ball is.
    let diffuse = Some(Pattern::Constant(Rgb::splat(0.5)));
    let mirror = Some(Rgb::splat(0.5));
    let flat = object(Shape::Disc(disc(v(0.0, -1.0, 0.0), DVec3::Y, 0.5)));
    let round = object(Shape::Sphere(below[0]));
    let point = || Lights::new(vec![point_light(DVec3::ZERO, Rgb::ONE)]);
    let kinds = [
        (&flat, glass(), true),
        (&round, material(), true),
        (
            &round,
            Material {
                mirror: Some(Rgb::ZERO),
                ..material()
            },
            true,
        ),
        (
            &round,
            Material {
                diffuse,
                mirror,
                ..material()
            },
            true,
        ),
        (
            &round,
            Material {
                mirror,
                ..material()
            },
            false,
        ),
    ];
    for (object, material, expected) in kinds {
        let aim = Aim::at(std::slice::from_ref(object), &[material]);
        let lights = point().aimed(aim);
        assert_eq!(photons(&lights, 100).eq(photons(&point(), 100)), expected);
    }
    assert!((point().power().x - 4.0 * PI).abs() < 1e-12);
}
