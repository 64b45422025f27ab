//! Scenes for `path` whose radiance at a point is a closed form, and the formulas.

use crate::experiments::fresnel::closed_face;
use crate::lab::rendering::{Set, scene_of};
use crate::scene::Scene;
use glam::DVec3;
use std::f64::consts::PI;

/// The scenes, each of several points.
pub(super) const SCENES: [&str; 5] = ["disc", "polygon", "walls", "slab", "water"];

/// One scene at one setting.
pub(super) struct Case {
    /// The setting in words, unique in the scene.
    pub(super) point: String,
    /// The scene's text.
    text: &'static str,
    sets: Vec<Set<'static>>,
    /// Radiance in closed form.
    pub(super) predicted: f64,
    /// Standard deviation of one path over the mean, as measured: it sets the number of samples.
    pub(super) noise: f64,
}

impl Case {
    fn new(point: impl Into<String>, text: &'static str, predicted: f64, noise: f64) -> Self {
        Self {
            point: point.into(),
            text,
            sets: Vec::new(),
            predicted,
            noise,
        }
    }

    fn with(mut self, key: &'static str, value: impl Into<toml::Value>) -> Self {
        self.sets.push((key, value.into()));
        self
    }

    /// The camera at a point, looking at another.
    fn seen(self, eye: DVec3, target: DVec3) -> Self {
        self.with("camera.eye", eye.to_array().to_vec())
            .with("camera.target", target.to_array().to_vec())
    }

    /// The scene with this many samples a pixel.
    pub(super) fn scene(&self, spp: u32) -> anyhow::Result<Scene> {
        let mut sets = self.sets.clone();
        sets.push(("render.spp", spp.into()));
        scene_of(self.text, "analytic", &sets)
    }
}

/// The cases of a scene.
pub(super) fn of(scene: &str) -> Vec<Case> {
    match scene {
        "disc" => disc(),
        "polygon" => polygon(),
        "walls" => walls(),
        "slab" => slab(),
        "water" => water(),
        _ => Vec::new(),
    }
}

/// Looks straight down at a point of the floor y = 0.
fn at_floor(case: Case, point: DVec3) -> Case {
    case.seen(point + 0.5 * DVec3::Y, point)
}

/// E/π below a disc of radius 1 at height 1, at distance d from its axis (view factor of a parallel element; Howell's catalogue B-12).
fn below_disc(d: f64) -> f64 {
    let (square, sum) = (d * d, 2.0 + d * d);
    0.5 * (1.0 - square / (sum * sum - 4.0 * square).sqrt())
}

fn disc() -> Vec<Case> {
    let text = include_str!("disc.toml");
    let of =
        |(point, d, noise)| at_floor(Case::new(point, text, below_disc(d), noise), d * DVec3::X);
    [("axis", 0.0, 0.415), ("below the rim", 1.0, 0.719)]
        .map(of)
        .into()
}

/// The part of a polygon above the plane y = 0 (Sutherland and Hodgman 1974).
fn above_floor(corners: &[DVec3]) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (index, &a) in corners.iter().enumerate() {
        let b = corners[(index + 1) % corners.len()];
        if a.y >= 0.0 {
            kept.push(a);
        }
        if (a.y >= 0.0) != (b.y >= 0.0) {
            kept.push(a + a.y / (a.y - b.y) * (b - a));
        }
    }
    kept
}

/// E/π at a point of the floor for a polygon of radiance 1: ½ Σ Θ_i Γ_i·n over its edges (Lambert 1760).
fn below_polygon(corners: &[DVec3], point: DVec3) -> f64 {
    let corners: Vec<DVec3> = corners.iter().map(|&corner| corner - point).collect();
    let towards: Vec<DVec3> = above_floor(&corners)
        .into_iter()
        .map(DVec3::normalize)
        .collect();
    let edge = |(index, &a): (usize, &DVec3)| {
        let b = towards[(index + 1) % towards.len()];
        let across = a.cross(b);
        libm::atan2(across.length(), a.dot(b)) * across.normalize().y
    };
    let sum: f64 = towards.iter().enumerate().map(edge).sum();
    0.5 * sum.abs() / PI
}

fn polygon() -> Vec<Case> {
    let text = include_str!("polygon.toml");
    let flat = [[-0.75, 1.0, -1.0], [1.5, 0.0, 0.0], [0.0, 0.0, 2.0]];
    let upright = [[1.0, -0.25, -1.0], [0.0, 1.25, 0.0], [0.0, 0.0, 2.0]];
    let slanting = [[-1.0, -0.25, -1.0], [1.5, 1.25, 0.0], [0.0, 0.0, 2.0]];
    let of = |(name, lamp, point, noise): (&str, [[f64; 3]; 3], DVec3, f64)| {
        let [corner, u, v] = lamp.map(DVec3::from_array);
        let corners = [corner, corner + u, corner + u + v, corner + v];
        let case = Case::new(name, text, below_polygon(&corners, point), noise);
        let keys = ["quad.0.corner", "quad.0.edge_u", "quad.0.edge_v"];
        let case = keys
            .into_iter()
            .zip(lamp)
            .fold(case, |case, (key, vector)| case.with(key, vector.to_vec()));
        at_floor(case, point)
    };
    [
        ("below the middle", flat, DVec3::ZERO, 0.432),
        ("beside", flat, DVec3::new(1.5, 0.0, 0.5), 0.794),
        ("upright, cut by the horizon", upright, DVec3::ZERO, 0.742),
        (
            "slanting, cut by the horizon",
            slanting,
            DVec3::new(1.0, 0.0, 0.5),
            1.006,
        ),
    ]
    .map(of)
    .into()
}

/// Parallel plates, and a ball in a concentric sphere; both files have these reflectances and emissions.
fn walls() -> Vec<Case> {
    let ([rho, other_rho], [e, other_e]) = ([0.5, 0.8], [1.0, 0.25]);
    let between = 1.0 - rho * other_rho;
    let plates = include_str!("plates.toml");
    let lower = Case::new("lower plate", plates, (e + rho * other_e) / between, 0.462);
    let upper = Case::new(
        "upper plate",
        plates,
        (other_e + other_rho * e) / between,
        0.486,
    );
    // The ball of radius ½ fills a quarter of what the sphere of radius 1 sees.
    let share = 0.25;
    let shell = (other_e + other_rho * share * e)
        / (1.0 - other_rho * (1.0 - share) - other_rho * share * rho);
    let ball = Case::new(
        "ball in a sphere",
        include_str!("shells.toml"),
        e + rho * shell,
        0.445,
    );
    vec![
        lower,
        upper.with("camera.target", vec![0.0, 1.0, 0.0]),
        ball,
    ]
}

/// The slab of scenes/slab.toml, of thickness 1, from y = 0 to 1, before a lamp of radiance 1.
fn slab() -> Vec<Case> {
    let text = include_str!("../../scenes/slab.toml");
    let of = |(point, ior, absorption, degrees, noise): (&str, f64, f64, f64, f64)| {
        let angle = degrees.to_radians();
        // No total reflection comes from outside, so there always is a refracted ray.
        let (f, refraction) = closed_face(ior, angle).unwrap_or((f64::NAN, f64::NAN));
        let tau = libm::exp(-absorption / libm::cos(refraction));
        let through = (1.0 - f) * (1.0 - f) * tau / (1.0 - f * f * tau * tau);
        let case = Case::new(point, text, through, noise);
        let target = DVec3::new(0.3, 1.0, 0.2);
        case.seen(
            target + DVec3::new(-3.0 * libm::tan(angle), 3.0, 0.0),
            target,
        )
        .with("camera.vertical_fov_deg", 0.001)
        .with("film.width", i64::from(super::SIDE))
        .with("film.height", i64::from(super::SIDE))
        .with("material.glass.dielectric.ior", ior)
        .with("material.glass.dielectric.absorption", vec![absorption; 3])
    };
    [
        ("index 1.5", 1.5, 0.0, 0.0, 0.287),
        ("index 1.3", 1.3, 0.0, 0.0, 0.185),
        ("absorption 0.5", 1.5, 0.5, 0.0, 0.29),
        ("60 degrees", 1.5, 0.0, 60.0, 0.441),
    ]
    .map(of)
    .into()
}

/// Snell's window. The last point is .003 degrees beyond the critical angle.
fn water() -> Vec<Case> {
    let (ior, bed) = (1.333, 0.25);
    let of = |(degrees, noise): (f64, f64)| {
        let angle = degrees.to_radians();
        let f = closed_face(1.0 / ior, angle).map_or(1.0, |(f, _)| f);
        let seen = ior * ior * (1.0 - f) + bed * f;
        let eye = DVec3::new(3.0, -1.0, 0.0);
        Case::new(
            format!("{degrees} degrees"),
            include_str!("water.toml"),
            seen,
            noise,
        )
        .seen(eye, DVec3::new(eye.x + libm::tan(angle), 0.0, 0.0))
    };
    [(0.0, 0.123), (30.0, 0.138), (45.0, 0.336), (48.61, 0.0)]
        .map(of)
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance of 1 over π of the whole hemisphere, of a half, and of a square above (.199825 is the share between two unit
    /// squares at distance 1; a point below the middle sees 4 corners: Howell's catalogue B-4).
    #[test]
    fn lamberts_sum_knows_the_horizon() {
        let wide = |y: f64, z: f64| DVec3::new(1e9, y, z);
        let wall = [
            wide(-1e12, -1e12),
            wide(1e12, -1e12),
            wide(1e12, 1e12),
            wide(-1e12, 1e12),
        ];
        assert!((below_polygon(&wall, DVec3::ZERO) - 0.5).abs() < 2e-3);
        let up = |x: f64, z: f64| DVec3::new(x, 1.0, z);
        let square = [up(-1.0, -1.0), up(1.0, -1.0), up(1.0, 1.0), up(-1.0, 1.0)];
        let slant = 0.5_f64.sqrt();
        let closed = 4.0 / PI * slant * libm::atan(slant);
        assert!((below_polygon(&square, DVec3::ZERO) - closed).abs() < 1e-15);
        let below = square.map(|corner| corner - 2.0 * DVec3::Y);
        assert_eq!(below_polygon(&below, DVec3::ZERO), 0.0);
        // Two halves of a lamp, one of which the horizon cuts away.
        let cut = [
            [1.0, -0.5, 0.0],
            [1.0, 1.0, 0.0],
            [1.0, 1.0, 1.0],
            [1.0, -0.5, 1.0],
        ];
        let kept = [
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [1.0, 1.0, 1.0],
            [1.0, 0.0, 1.0],
        ];
        let [cut, kept] = [cut, kept]
            .map(|quad| below_polygon(&quad.map(DVec3::from_array), DVec3::new(0.2, 0.0, 0.3)));
        assert!((cut - kept).abs() < 1e-15 && kept > 0.01);
    }

    #[test]
    fn below_the_middle_of_a_disc_is_the_well_known_form() {
        assert!((below_disc(0.0) - 0.5).abs() < 1e-15);
        // Far away the lamp is small: A cos² θ/(π d²).
        let d = 1e3_f64;
        assert!((below_disc(d) * d.powi(4) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn every_case_is_a_scene() {
        for scene in SCENES {
            let cases = of(scene);
            assert!(cases.len() > 1, "{scene}");
            for case in cases {
                assert!(case.predicted > 0.0, "{scene}, {}", case.point);
                assert!(case.scene(1).is_ok(), "{scene}, {}", case.point);
            }
        }
    }
}
