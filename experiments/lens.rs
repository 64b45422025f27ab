//! Does the thin lens blur as its closed forms say, is its plane of focus a plane, and how does the noise of each sampler fall?

mod conclusion;
mod noise;
mod optics;
mod pictures;

use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, Value, grid, values,
};
use crate::numeric::rng::{Purpose, Stream};
use glam::DVec2;
use optics::{CAMERA, FILM, FOCUS, Lens, at_depth, original, thin, through_the_center};
use serde::Deserialize;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "lens",
    question: "Does the thin lens blur as its closed forms say, off the axis too, and how does the noise of each sampler fall?",
    prediction: "What lies at distance s is blurred over a disc of radius c = a |s − s_f|/s on the plane of focus (a: radius of the lens, \
                 s_f: distance of focus). A straight edge has the profile ½ + (x √(1 − x²) + asin x)/π, x = distance/c. All rays of a film \
                 point meet in one point of the plane of focus. The original's lens, whose origins lie on a sphere's shell and whose \
                 directions stay, is sharp nowhere. With n samples of the lens the error falls as n^−1/2 (independent); at an edge as \
                 n^−3/4, of a smooth integrand as n^−1 (stratified), or between that and n^−3/2 (Sobol).",
    method: "Pictures by `path` of luminous bodies, without any other light. Blur: second moment of the picture of a disc, less that \
             of the disc itself (radius c/2 on the plane of focus) and of a pixel; the picture is the convolution of both discs, so \
             nothing is left out. Edge: tilted by 20°, every pixel's count against its binomial law by chi-square, and the width of \
             the profile by its first moment, which is c²/8. Plane of focus: rays of the camera itself, without a scene. Noise: rows of 64 \
             pixels so short that only the lens is sampled, before a half plane at a random place and tilt, and before a matte plane under a \
             point light; the root mean square over the pixels against quadrature, and the slope of its logarithm over the levels of \
             each replicate.",
    columns: &[
        "part",
        "subject",
        "sampler",
        "depth",
        "samples",
        "replicate",
        "place",
        "predicted",
        "measured",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [4.0, 34.0, 200.0],
    plan,
    execute,
    conclude,
};

/// Depths before and behind the plane of focus, up to ten times its distance.
const DEPTHS: [f64; 8] = [1.5, 2.5, 4.0, 5.0, 7.5, 10.0, 20.0, 60.0];
/// The samplers, by their names on the command line.
const SAMPLERS: [&str; 3] = ["independent", "stratified", "sobol"];
/// Lens points for each film point.
const LENS_POINTS: u32 = 1000;

fn plan(_: Effort) -> Vec<Run> {
    let part = |part, subjects: &[&str], samplers: &[&str], depths: &[f64]| {
        grid([
            ("part", values([part])),
            ("subject", values(subjects.iter().copied())),
            ("sampler", values(samplers.iter().copied())),
            ("depth", values(depths.iter().copied())),
        ])
    };
    let lenses = ["thin lens", "original"];
    let none = ["independent"];
    let edge = [pictures::EDGE_DEPTH];
    [
        part("blur", &lenses, &none, &DEPTHS),
        part("edge", &["thin lens"], &none, &edge),
        part("focus", &lenses, &none, &[FOCUS]),
        part("noise", &["edge", "smooth"], &SAMPLERS, &edge),
        part("mean", &["edge"], &SAMPLERS, &edge),
    ]
    .concat()
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let ours = run.text("subject") == "thin lens";
    match run.text("part").as_str() {
        "blur" if ours => pictures::spots(run, effort, seed),
        "blur" => Ok(spread(run, original, seed)),
        "focus" => Ok(sharpness(run, if ours { thin } else { original }, seed)),
        "edge" => pictures::edges(run, effort, seed),
        _ => noise::rows(run, effort, seed),
    }
}

/// A row: the run's parameters, then these.
fn row(
    run: &Run,
    (samples, replicate): (u32, u32),
    place: f64,
    predicted: f64,
    measured: f64,
) -> Vec<Value> {
    run.row(
        [
            values([samples, replicate]),
            values([place, predicted, measured]),
        ]
        .concat(),
    )
}

fn lens_points(seed: u64, index: u64) -> impl Iterator<Item = [f64; 2]> {
    let mut stream = Stream::new(seed, Purpose::Experiment, index);
    (0..LENS_POINTS).map(move |_| stream.uniform2())
}

/// Radius of the disc with the second moment of where the rays of the film's middle cross a depth, on the plane of focus.
fn spread(run: &Run, lens: Lens, seed: u64) -> Outcome {
    let depth = run.number("depth");
    let film = 0.5 * FILM;
    let middle = at_depth(&CAMERA, &through_the_center(&CAMERA, film), depth);
    let square = |point| {
        let ray = lens(&CAMERA, film, point);
        (at_depth(&CAMERA, &ray, depth) - middle).length_squared()
    };
    let sum: f64 = lens_points(seed, 0).map(square).sum();
    let radius = (2.0 * sum / f64::from(LENS_POINTS)).sqrt() * FOCUS / depth;
    let found = row(run, (LENS_POINTS, 0), 0.0, optics::blur(depth), radius);
    Outcome {
        rows: vec![found],
        ..Outcome::default()
    }
}

/// Of film points all over the film: the farthest from their common point that their rays cross the plane of focus.
fn sharpness(run: &Run, lens: Lens, seed: u64) -> Outcome {
    let (columns, rows) = (9, 7);
    // Four roundings of each coordinate, which are as large as the way there.
    let predicted = 16.0 * f64::EPSILON * (FOCUS + CAMERA.eye.length());
    let worst = |number: u32| {
        let part = DVec2::new(
            f64::from(number % columns) / f64::from(columns - 1),
            f64::from(number / columns) / f64::from(rows - 1),
        );
        let film = part * FILM;
        let focus = at_depth(&CAMERA, &through_the_center(&CAMERA, film), FOCUS);
        let off = |point| (at_depth(&CAMERA, &lens(&CAMERA, film, point), FOCUS) - focus).length();
        let worst = lens_points(seed, u64::from(number))
            .map(off)
            .fold(0.0, f64::max);
        let from_axis = (film - 0.5 * FILM).length() / FILM.y;
        row(run, (LENS_POINTS, number), from_axis, predicted, worst)
    };
    Outcome {
        rows: (0..columns * rows).map(worst).collect(),
        ..Outcome::default()
    }
}

/// A row of the table.
#[derive(Clone, Debug, Deserialize)]
struct Row {
    part: String,
    subject: String,
    sampler: String,
    depth: f64,
    samples: f64,
    replicate: u32,
    place: f64,
    predicted: f64,
    measured: f64,
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    conclusion::conclude(&table.read::<Row>(), effort)
}
