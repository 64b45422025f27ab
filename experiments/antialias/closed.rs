//! Pictures with closed forms: a straight edge, and a disc within a pixel.

use super::{Method, Picture, render, row};
use crate::lab::experiment::{Effort, Outcome};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use crate::scene::options::{Antialias, Hash, Resampling};
use crate::scene::{Scene, file};
use std::path::Path;

/// Places of the edge within a pixel, equally spaced.
const PLACES: u32 = 360;

/// A film of `side` pixels along a side that shows the plane z = 0 in units of pixels, x from 0 and y from 0 upward, both ways.
fn film(side: u32, objects: &str) -> anyhow::Result<Scene> {
    let half = f64::from(side) / 2.0;
    // From so far away that a pixel is a pixel everywhere: 2 tan(½ fov) · distance is the film's height.
    let fov = 2.0 * libm::atan(half / 100.0).to_degrees();
    let text = format!(
        "[camera]\neye = [{half:?}, {half:?}, 100]\ntarget = [{half:?}, {half:?}, 0]\nvertical_fov_deg = {fov:?}\n\
         [film]\nwidth = {side}\nheight = {side}\n[material.lamp]\nemission = {{ radiance = [1, 1, 1] }}\n{objects}"
    );
    Ok(file::parse(&text, "closed form", Path::new(""), &[])?)
}

fn method(aa: Antialias, pattern: Resampling) -> Method {
    let hash = (aa == Antialias::PathHash).then_some(Hash::Objects);
    Method {
        aa,
        hash,
        pattern,
        threshold: None,
    }
}

/// A bright half-plane whose straight edge runs along the pixels, at places spread evenly over one pixel; the error is that of
/// the pixels on the edge.
pub(super) fn edge(seed: u64) -> anyhow::Result<Outcome> {
    let mut rows = Vec::new();
    let mut work = Work::default();
    for method in [
        method(Antialias::None, Resampling::Three),
        method(Antialias::Uniform, Resampling::Two),
        method(Antialias::Uniform, Resampling::Three),
        method(Antialias::Uniform, Resampling::Four),
        method(Antialias::PathHash, Resampling::Three),
        method(Antialias::PathHash, Resampling::Adaptive),
    ] {
        let (mut squares, mut total) = (0.0, Total::default());
        for place in 0..PLACES {
            let share = (f64::from(place) + 0.5) / f64::from(PLACES);
            let quad = format!(
                "[[quad]]\ncorner = [-9, -9, 0]\nedge_u = [{:?}, 0, 0]\nedge_v = [0, 30, 0]\nmaterial = \"lamp\"\n",
                11.0 + share
            );
            let picture = render(&film(5, &quad)?, &method, seed);
            let off = picture.film.pixels()[2 * 5 + 2].mean().x - share;
            squares += off * off / f64::from(PLACES);
            total.add(&picture);
        }
        work += total.work;
        rows.push(total.row(&method, "edge", squares.sqrt(), f64::NAN));
    }
    Ok(Outcome { rows, work })
}

/// A bright disc of a radius of so many pixels somewhere in the middle pixel of five by five: its recall is how often it is found.
pub(super) fn disc(name: &str, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let radius: f64 = name.trim_start_matches("disc ").parse()?;
    let method = method(Antialias::PathHash, Resampling::Three);
    let count = discs(effort);
    let (mut found, mut squares, mut total) = (0_u32, 0.0, Total::default());
    for index in 0..count {
        let mut stream = Stream::new(seed, Purpose::Experiment, index);
        let [x, y] = stream.uniform2();
        let disc = format!(
            "[[disc]]\ncenter = [{:?}, {:?}, 0]\nnormal = [0, 0, 1]\nradius = {radius:?}\nmaterial = \"lamp\"\n",
            2.0 + x,
            2.0 + y
        );
        let picture = render(&film(5, &disc)?, &method, seed);
        found += u32::from(picture.resampled.iter().any(|&marked| marked));
        let sum: f64 = picture.film.pixels().iter().map(|p| p.mean().x).sum();
        let off = sum - std::f64::consts::PI * radius * radius;
        squares += off * off / count as f64;
        total.add(&picture);
    }
    let share = f64::from(found) / count as f64;
    let row = total.row(&method, name, squares.sqrt(), share);
    Ok(Outcome::of_row(row, total.work))
}

/// Number of discs.
pub(super) fn discs(effort: Effort) -> u64 {
    effort.of([3_000, 100_000, 1_000_000])
}

/// Work and time of many small pictures.
#[derive(Default)]
struct Total {
    work: Work,
    seconds: f64,
}

impl Total {
    fn add(&mut self, picture: &Picture) {
        self.work += picture.work;
        self.seconds += picture.seconds;
    }

    fn row(
        &self,
        method: &Method,
        scene: &str,
        rmse: f64,
        found: f64,
    ) -> Vec<crate::lab::experiment::Value> {
        let rest = [f64::NAN; 3];
        let [shadow, texture, reflection] = rest;
        let rays = self.work.camera_rays + self.work.scattered_rays + self.work.shadow_rays;
        row(
            method,
            scene,
            (rays, self.seconds),
            rmse,
            [found, shadow, texture, reflection],
            f64::NAN,
        )
    }
}
