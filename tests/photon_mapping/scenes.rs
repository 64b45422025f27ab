//! Scenes and readings that the claims share.

use glam::DVec3;
use photolathe::geometry::planar::{Plane, Quad};
use photolathe::geometry::revolution::Solver;
use photolathe::geometry::shape::Shape;
use photolathe::geometry::sphere::Sphere;
use photolathe::render::film::Film;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::aim::Aim;
use photolathe::scene::camera::{Camera, CameraDescription};
use photolathe::scene::light::{Emitter, Light, Lights};
use photolathe::scene::material::{Dielectric, Emission, Material, Pattern, Side};
use photolathe::scene::options::{Integrator, RenderTable};
use photolathe::scene::{FilmSize, Object, Rgb, Scene};

/// First radius of most claims.
pub(crate) const RADIUS: f64 = 0.3;

pub(crate) fn plain() -> Material {
    Material {
        name: String::new(),
        diffuse: None,
        mirror: None,
        dielectric: None,
        emission: None,
    }
}

pub(crate) fn diffuse(reflectance: f64) -> Material {
    Material {
        diffuse: Some(Pattern::Constant(Rgb::splat(reflectance))),
        ..plain()
    }
}

pub(crate) fn glass(ior: f64, absorption: f64) -> Material {
    Material {
        dielectric: Some(Dielectric {
            ior,
            absorption: Rgb::splat(absorption),
        }),
        ..plain()
    }
}

pub(crate) fn glowing(radiance: f64, side: Side, material: Material) -> Material {
    Material {
        emission: Some(Emission {
            radiance: Rgb::splat(radiance),
            side,
        }),
        ..material
    }
}

pub(crate) fn camera(eye: DVec3, target: DVec3, fov: f64) -> Camera {
    let up = if (target - eye).normalize().y.abs() > 0.99 {
        DVec3::Z
    } else {
        DVec3::Y
    };
    Camera::new(&CameraDescription {
        eye,
        target,
        up,
        vertical_fov_deg: fov,
        lens_radius: 0.0,
        focus_distance: 1.0,
    })
}

pub(crate) fn scene(
    size: u32,
    camera: Camera,
    things: Vec<(Shape, Material)>,
    mut lights: Vec<Light>,
) -> Scene {
    let mut objects = Vec::new();
    let mut materials = Vec::new();
    for (index, (shape, material)) in things.into_iter().enumerate() {
        let object = Object {
            name: format!("object {index}"),
            bounds: shape.bounds(),
            shape,
            material: index,
        };
        if let (Some(emission), Some(surface)) = (material.emission, Emitter::of(&object)) {
            lights.push(Light::Area {
                object: index,
                surface,
                emission,
            });
        }
        objects.push(object);
        materials.push(material);
    }
    Scene {
        title: String::new(),
        background: Rgb::ZERO,
        camera,
        film: FilmSize {
            width: size,
            height: size,
        },
        lights: Lights::new(lights).aimed(Aim::at(&objects, &materials)),
        materials,
        objects,
        solver: Solver::Bernstein,
        render: RenderTable::default(),
        hash: String::new(),
    }
}

pub(crate) fn sphere(center: DVec3, radius: f64) -> Shape {
    Shape::Sphere(Sphere { center, radius })
}

pub(crate) fn quad(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Shape {
    Shape::Quad(Quad::new(corner, edge_u, edge_v))
}

pub(crate) fn floor() -> Shape {
    Shape::Plane(Plane {
        point: DVec3::ZERO,
        normal: DVec3::Y,
    })
}

pub(crate) fn point_light(position: DVec3, intensity: f64) -> Light {
    Light::Point {
        position,
        intensity: Rgb::splat(intensity),
    }
}

/// Point light of intensity 1 at height 1 over a plane, seen at the point straight below.
pub(crate) fn nadir(reflectance: f64) -> Scene {
    scene(
        1,
        camera(0.5 * DVec3::Y, DVec3::ZERO, 1e-6),
        vec![(floor(), diffuse(reflectance))],
        vec![point_light(DVec3::Y, 1.0)],
    )
}

/// The inside of a unit sphere.
pub(crate) fn room(wall: Material, inside: Vec<(Shape, Material)>, lights: Vec<Light>) -> Scene {
    let mut things = vec![(sphere(DVec3::ZERO, 1.0), wall)];
    things.extend(inside);
    let from = DVec3::new(0.1, -0.2, 0.5);
    scene(
        4,
        camera(from, DVec3::new(0.0, 0.1, -0.6), 70.0),
        things,
        lights,
    )
}

/// A box open to the front with a lamp, a glass ball, a mirror ball and a floor that is diffuse and mirror.
pub(crate) fn full_box(size: u32) -> Scene {
    let wall = |corner, u, v| quad(corner, u, v);
    let (x, y, z) = (2.0 * DVec3::X, 2.0 * DVec3::Y, 2.0 * DVec3::Z);
    let corner = DVec3::new(-1.0, 0.0, -1.0);
    let tiles = Material {
        mirror: Some(Rgb::splat(0.2)),
        ..diffuse(0.6)
    };
    let mirror = Material {
        mirror: Some(Rgb::new(0.9, 0.8, 0.7)),
        ..plain()
    };
    let lamp = quad(DVec3::new(-0.3, 1.99, -0.3), 0.6 * DVec3::X, 0.6 * DVec3::Z);
    scene(
        size,
        camera(DVec3::new(0.0, 1.0, 4.0), DVec3::new(0.0, 1.0, 0.0), 35.0),
        vec![
            (wall(corner, z, x), tiles),
            (wall(corner + y, x, z), diffuse(0.7)),
            (wall(corner, x, y), diffuse(0.5)),
            (wall(corner, y, z), diffuse(0.4)),
            (wall(corner + x, z, y), diffuse(0.3)),
            (lamp, glowing(20.0, Side::Front, diffuse(0.1))),
            (sphere(DVec3::new(-0.4, 0.4, 0.2), 0.39), glass(1.5, 0.3)),
            (sphere(DVec3::new(0.45, 0.4, -0.3), 0.39), mirror),
        ],
        vec![point_light(DVec3::new(-0.4, 0.4, 0.2), 0.2)],
    )
}

pub(crate) fn settings(integrator: Integrator, photons: u64, radius: f64) -> Settings {
    Settings::resolve(&RenderTable {
        integrator: Some(integrator),
        photons: Some(photons),
        radius: Some(radius),
        ..RenderTable::default()
    })
}

/// The mean over the film of each pass.
pub(crate) fn pass_means(scene: &Scene, settings: &Settings, passes: u64) -> Vec<f64> {
    let mut mapper = PhotonMapper::new(scene, settings).expect("a scene for photons");
    (0..passes)
        .map(|pass| {
            let mut film = Film::new(scene.film);
            mapper.pass(pass, &mut film, &mut Phases::default());
            assert_eq!(film.bad_samples(), 0);
            film.mean().x
        })
        .collect()
}

pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// Checks a mean within six standard errors, which must be at most a sixth of `effect` (relative): the effect it can see.
pub(crate) fn assert_mean(values: &[f64], expected: f64, effect: f64) {
    let (mean, error) = mean_and_error(values);
    assert!(
        6.0 * error <= effect * expected,
        "blind: error {error} of {mean}"
    );
    assert!(
        (mean - expected).abs() <= 6.0 * error,
        "{mean} ± {error} against {expected}"
    );
}
