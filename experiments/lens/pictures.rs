//! Pictures through the lens, and what is read from them.

use super::optics::{APERTURE, FOCUS, blur, over_pixel, share};
use super::row;
use crate::lab::experiment::{Effort, Outcome, Run};
use crate::lab::rendering::on_one_thread;
use crate::numeric::rng::mix;
use crate::numeric::work::Work;
use crate::render::driver::render_unwatched;
use crate::render::film::Film;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::file;
use glam::DVec2;
use std::path::Path;

const SPOT: &str = include_str!("spot.toml");
const EDGE: &str = include_str!("edge.toml");

/// Pixels along the spot's film.
const SPOT_SIDE: u32 = 64;
/// Half the width of the spot's film in radii of blur: the disc's own radius is half of one.
const SPOT_REACH: f64 = 1.6;
/// Radius of the disc in radii of blur, both on the plane of focus.
const SPOT_DISC: f64 = 0.5;

/// Depth of the edge.
pub(super) const EDGE_DEPTH: f64 = 9.0;
/// Pixels along the edge's film.
pub(super) const EDGE_PIXELS: u32 = 64;
/// Half the width of the edge's film in radii of blur.
const EDGE_REACH: f64 = 1.1;
/// Angle of the edge's normal to the row of pixels, degrees: no special position to pixels and lens.
const EDGE_TILT: f64 = 20.0;

/// A scene of this experiment with these values.
pub(super) fn scene(text: &str, sets: &[(&str, String)]) -> anyhow::Result<Scene> {
    let sets: Vec<_> = sets
        .iter()
        .map(|(key, value)| ((*key).to_owned(), value.clone()))
        .collect();
    Ok(file::parse(text, "lens", Path::new(""), &sets)?)
}

/// Field of view, degrees, under which this length on the plane of focus is seen.
pub(super) fn field_of_view(length: f64) -> String {
    let angle = 2.0 * libm::atan(0.5 * length / FOCUS);
    format!("{:?}", angle.to_degrees())
}

/// The film of a scene under these settings, on one thread.
pub(super) fn picture(scene: &Scene, settings: &Settings, work: &mut Work) -> anyhow::Result<Film> {
    let (outcome, _) = on_one_thread(|| Ok(render_unwatched(scene, settings)?))?;
    *work += outcome.work;
    Ok(outcome.film)
}

pub(super) fn settings(scene: &Scene, spp: u32, seed: u64) -> Settings {
    Settings {
        spp,
        seed,
        threads: Some(1),
        ..Settings::resolve(&scene.render)
    }
}

/// Replicates of each picture: so many that Student's law at the level of a claim is not much wider than the normal law.
const REPLICATES: u32 = 32;

/// The radius of blur as the picture of a small luminous disc tells it.
pub(super) fn spots(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let depth = run.number("depth");
    let radius = blur(depth);
    let disc = SPOT_DISC * radius;
    let scene = scene(
        SPOT,
        &[
            (
                "camera.vertical_fov_deg",
                field_of_view(2.0 * SPOT_REACH * radius),
            ),
            ("camera.lens_radius", format!("{APERTURE:?}")),
            ("camera.focus_distance", format!("{FOCUS:?}")),
            ("film.width", SPOT_SIDE.to_string()),
            ("film.height", SPOT_SIDE.to_string()),
            ("disc.0.center", format!("[0.0, 0.0, {:?}]", -depth)),
            ("disc.0.radius", format!("{:?}", disc * depth / FOCUS)),
        ],
    )?;
    let pixel = 2.0 * SPOT_REACH * radius / f64::from(SPOT_SIDE);
    let spp = effort.of([4, 30, 120]);
    let mut outcome = Outcome::default();
    for replicate in 0..REPLICATES {
        let settings = settings(&scene, spp, mix(&[seed, u64::from(replicate)]));
        let film = picture(&scene, &settings, &mut outcome.work)?;
        // Moments of independent parts add up: those of both discs (ρ²/2 each) and of the pixel (Sheppard).
        let square = pixel * pixel * second_moment(&film) - 0.5 * disc * disc - pixel * pixel / 6.0;
        let measured = (2.0 * square).sqrt();
        outcome
            .rows
            .push(row(run, (spp, replicate), 0.0, radius, measured));
    }
    Ok(outcome)
}

/// Mean squared distance of a picture's light from the film's middle, in pixels.
fn second_moment(film: &Film) -> f64 {
    let width = film.size().width as usize;
    let middle = DVec2::new(f64::from(film.size().width), f64::from(film.size().height)) * 0.5;
    let (mut light, mut moment) = (0.0, 0.0);
    for (index, pixel) in film.pixels().iter().enumerate() {
        let center = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        let radiance = pixel.mean().x;
        light += radiance;
        moment += radiance * (center - middle).length_squared();
    }
    moment / light
}

/// The scene of the edge, and what each pixel of its row should see: distance from the edge in radii of blur, and share.
pub(super) struct Edge {
    pub(super) scene: Scene,
    pub(super) pixels: Vec<(f64, f64)>,
}

/// The edge with its normal at `tilt` degrees to the row, seen `offset` radii of blur from the row's middle, the row being `reach`
/// radii long to each side.
pub(super) fn edge(tilt: f64, offset: f64, reach: f64) -> anyhow::Result<Edge> {
    let (sin, cos) = libm::sincos(tilt.to_radians());
    let normal = DVec2::new(cos, sin);
    let radius = blur(EDGE_DEPTH);
    let pixel = 2.0 * reach / f64::from(EDGE_PIXELS);
    // Far more than the view is wide.
    let half = 10.0;
    let middle = -offset * radius * EDGE_DEPTH / FOCUS * normal;
    let corner = middle - half * normal.perp();
    let vector = |v: DVec2, z: f64| format!("[{:?}, {:?}, {z:?}]", v.x, v.y);
    let scene = scene(
        EDGE,
        &[
            ("camera.vertical_fov_deg", field_of_view(pixel * radius)),
            ("camera.lens_radius", format!("{APERTURE:?}")),
            ("camera.focus_distance", format!("{FOCUS:?}")),
            ("film.width", EDGE_PIXELS.to_string()),
            ("quad.0.corner", vector(corner, -EDGE_DEPTH)),
            ("quad.0.edge_u", vector(2.0 * half * normal, 0.0)),
            ("quad.0.edge_v", vector(2.0 * half * normal.perp(), 0.0)),
        ],
    )?;
    let pixels = (0..EDGE_PIXELS).map(|index| {
        let center = DVec2::new((f64::from(index) + 0.5) * pixel - reach, 0.0);
        let distance = |p: DVec2| p.dot(normal) + offset;
        (
            distance(center),
            over_pixel(center, pixel, |p| share(distance(p))),
        )
    });
    let pixels = pixels.collect();
    Ok(Edge { scene, pixels })
}

/// The profile of a straight edge: a row for each pixel that it may or may not cover.
pub(super) fn edges(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let edge = edge(EDGE_TILT, 0.0, EDGE_REACH)?;
    let spp = effort.of([1000, 10_000, 40_000]);
    let mut outcome = Outcome::default();
    for replicate in 0..REPLICATES {
        let settings = settings(&edge.scene, spp, mix(&[seed, u64::from(replicate)]));
        let film = picture(&edge.scene, &settings, &mut outcome.work)?;
        for (&(place, predicted), pixel) in edge.pixels.iter().zip(film.pixels()) {
            let measured = pixel.mean().x;
            outcome
                .rows
                .push(row(run, (spp, replicate), place, predicted, measured));
        }
    }
    Ok(outcome)
}
