//! How the error of a pixel falls with its samples, for each sampler.
//!
//! The film is a row so short that its pixels are points next to their blur: chance is in the place on the lens alone. There the theory
//! is known: with jittered strata or a scrambled net in two dimensions the error at an edge falls as n^−3/4, as only the cells that the
//! edge cuts err; where the integrand is smooth as n^−1 (strata) and as n^−3/2, a logarithm aside (nets; Owen 1997). The map from the square to the
//! lens has kinks along the diagonals of the square, as any such map has somewhere; the cells on them err more, and leave a net between
//! n^−1 and n^−3/2.

use super::optics::{FOCUS, over_disc};
use super::pictures::{edge, field_of_view, picture, scene, settings};
use super::row;
use crate::lab::experiment::{Effort, Outcome, Run};
use crate::numeric::rng::{Purpose, Stream, mix};
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::options::Sampler;
use clap::ValueEnum;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

const SMOOTH: &str = include_str!("smooth.toml");

/// Radius of the lens before the smooth plane.
const WIDE: f64 = 1.0;
/// Depth of that plane and of its light, and the plane's reflectance.
const PLANE: f64 = 9.0;
const LIGHT: f64 = 8.0;
const REFLECTANCE: f64 = 0.5;
/// Half the length of the row: of the edge's in radii of blur, of the plane's on the plane of focus.
const REACH: f64 = 0.002;
/// Farthest middle of the row from the edge, in radii of blur.
const MOST_OFFSET: f64 = 0.7;
/// Pixels of the row of the plane.
const PIXELS: u32 = 64;

/// Samples of each pixel: at least six levels where slopes are decided.
pub(super) fn levels(effort: Effort) -> Vec<u32> {
    let most = effort.of([256, 4096, 4096]);
    let fours = std::iter::successors(Some(4_u32), |n| Some(4 * n));
    fours.take_while(|&n| n <= most).collect()
}

/// Number of samples that is neither a power of two nor a product of near equals.
pub(super) const ODD: u32 = 7;

/// Scenes with a tilt, an offset or a light of their own.
fn replicates(effort: Effort) -> u32 {
    effort.of([12, 24, 96])
}

/// The same for means, which cost little.
const REPLICATES_OF_MEANS: u32 = 64;

/// A scene with what each pixel of its row should see.
type Known = (Scene, Vec<f64>);

/// A half plane, tilted and shifted at random.
fn random_edge(stream: &mut Stream) -> anyhow::Result<Known> {
    let tilt = stream.range(0.0, 360.0);
    let offset = stream.range(-MOST_OFFSET, MOST_OFFSET);
    let edge = edge(tilt, offset, REACH)?;
    let shares = edge.pixels.into_iter().map(|(_, share)| share).collect();
    Ok((edge.scene, shares))
}

/// A plane under a point light above a random place.
fn random_plane(stream: &mut Stream) -> anyhow::Result<Known> {
    let foot = DVec2::new(stream.range(-1.0, 1.0), stream.range(-1.0, 1.0));
    let pixel = 2.0 * REACH / f64::from(PIXELS);
    let scene = scene(
        SMOOTH,
        &[
            ("camera.vertical_fov_deg", field_of_view(pixel)),
            ("camera.lens_radius", format!("{WIDE:?}")),
            ("camera.focus_distance", format!("{FOCUS:?}")),
            ("film.width", PIXELS.to_string()),
            ("plane.0.point", format!("[0.0, 0.0, {:?}]", -PLANE)),
            (
                "point_light.0.position",
                format!("[{:?}, {:?}, {:?}]", foot.x, foot.y, -LIGHT),
            ),
        ],
    )?;
    // Radiance of a point of the plane, per radiance of a light of intensity 1.
    let seen = |at: DVec2| {
        let to_light = DVec3::new(foot.x - at.x, foot.y - at.y, PLANE - LIGHT);
        REFLECTANCE / PI * to_light.z / libm::pow(to_light.length_squared(), 1.5)
    };
    let blur = WIDE * (PLANE - FOCUS) / FOCUS;
    // A pixel is so small that its middle stands for it: what it leaves out is ~ 1e-9.
    let mean = |index: u32| {
        let center = DVec2::new((f64::from(index) + 0.5) * pixel - REACH, 0.0);
        over_disc(center * PLANE / FOCUS, blur, seen)
    };
    Ok((scene, (0..PIXELS).map(mean).collect()))
}

/// The sampler of a run.
fn sampler(run: &Run) -> anyhow::Result<Sampler> {
    Sampler::from_str(&run.text("sampler"), false).map_err(anyhow::Error::msg)
}

/// Rows of root mean square errors (part `noise`), or of means and what they should be (part `mean`).
pub(super) fn rows(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let sampler = sampler(run)?;
    let of_means = run.text("part") == "mean";
    let (levels, replicates) = if of_means {
        (vec![ODD], REPLICATES_OF_MEANS)
    } else {
        (levels(effort), replicates(effort))
    };
    let mut outcome = Outcome::default();
    for replicate in 0..replicates {
        let mut stream = Stream::new(seed, Purpose::Experiment, u64::from(replicate));
        let (scene, known) = match run.text("subject").as_str() {
            "edge" => random_edge(&mut stream)?,
            _ => random_plane(&mut stream)?,
        };
        for &n in &levels {
            let key = mix(&[seed, u64::from(replicate), u64::from(n)]);
            let settings = Settings {
                sampler,
                ..settings(&scene, n, key)
            };
            let film = picture(&scene, &settings, &mut outcome.work)?;
            let pixels = film.pixels().iter().map(|pixel| pixel.mean().x);
            let count = known.len() as f64;
            let mean = known.iter().sum::<f64>() / count;
            let (predicted, measured) = if of_means {
                (mean, pixels.sum::<f64>() / count)
            } else {
                let squares = pixels.zip(&known).map(|(a, b)| (a - b) * (a - b));
                (0.0, (squares.sum::<f64>() / count).sqrt() / mean)
            };
            let found = row(run, (n, replicate), 0.0, predicted, measured);
            outcome.rows.push(found);
        }
    }
    Ok(outcome)
}
