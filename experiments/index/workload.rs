//! The work: hit points that a camera sees in a box with a ball and an hourglass, and photons, half of them in a caustic.

use crate::index::wide::WideTree;
use crate::index::{BallIndex, Balls, curve};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use glam::DVec3;
use std::f64::consts::PI;

/// Hit points that a photon meets in the mean.
pub(super) const RESULTS_PER_QUERY: f64 = 20.0;
/// Greatest radius over the least, if they are not equal.
const RADIUS_RANGE: f64 = 30.0;
/// Share of the photons in the disc, and its share of the area of walls and ball.
const CAUSTIC: f64 = 0.5;
const CAUSTIC_AREA: f64 = 0.01;
/// Queries by which the scale of the radii is found.
const TRIAL: usize = 20_000;

const BALL: (DVec3, f64) = (DVec3::new(0.7, 0.2, 0.6), 0.2);
/// x² + z² − y²/4 = 0.05² about this point: the hourglass.
const WAIST: (DVec3, f64) = (DVec3::new(0.3, 0.4, 0.6), 0.05);
const EYE: DVec3 = DVec3::new(0.5, 0.5, 0.02);

/// Points with squared radii such that a query meets [`RESULTS_PER_QUERY`] in the mean, in the order of the pixels.
pub(super) fn hit_points(
    n: usize,
    equal: bool,
    queries: &[DVec3],
    seed: u64,
) -> anyhow::Result<Balls> {
    let mut stream = Stream::new(seed, Purpose::Experiment, 0);
    let side = (n as f64).sqrt().ceil() as usize;
    let centers: Vec<DVec3> = (0..n)
        .map(|pixel| {
            let [a, b] = stream.uniform2();
            let (column, row) = ((pixel % side) as f64 + a, (pixel / side) as f64 + b);
            let film = 2.0 / side as f64 * DVec3::new(column, row, 0.0) - DVec3::new(1.0, 1.0, 0.0);
            first_hit(EYE, film + DVec3::Z)
        })
        .collect();
    let relative: Vec<f64> = (0..n)
        .map(|_| {
            let radius = if equal {
                1.0
            } else {
                libm::pow(RADIUS_RANGE, stream.uniform())
            };
            radius * radius
        })
        .collect();
    let step = queries.len().div_ceil(TRIAL);
    let trial: Vec<DVec3> = queries.iter().copied().step_by(step).collect();
    let mean_square = relative.iter().sum::<f64>() / n as f64;
    // On a flat surface the number of results is proportional to the scale: four corrections see to the rest.
    let mut scale = RESULTS_PER_QUERY / (n as f64 * mean_square);
    let squares = |scale: f64| relative.iter().map(|square| scale * square).collect();
    let mut tree = WideTree::new(&Balls::new(centers.clone(), squares(scale))?);
    for _ in 0..4 {
        tree.set_radii_squared(&squares(scale))?;
        let counts = tree.join(&trial, &|_, hits| hits.len() as u64, &mut Work::default());
        let found = counts.in_order().into_iter().sum::<u64>() as f64 / trial.len() as f64;
        scale *= RESULTS_PER_QUERY / found.max(0.1);
    }
    Ok(Balls::new(centers, squares(scale))?)
}

/// Photons on the walls and the ball, and in a disc on the floor, in random order.
pub(super) fn photons(count: usize, seed: u64) -> Vec<DVec3> {
    let mut stream = Stream::new(seed, Purpose::Experiment, 1);
    let ball_area = 4.0 * PI * BALL.1 * BALL.1;
    let area = 6.0 + ball_area;
    let disc = (CAUSTIC_AREA * area / PI).sqrt();
    (0..count)
        .map(|_| {
            let [choice, a] = stream.uniform2();
            let [b, c] = stream.uniform2();
            if choice < CAUSTIC {
                let (radius, angle) = (disc * a.sqrt(), 2.0 * PI * b);
                return DVec3::new(
                    0.6 + radius * libm::cos(angle),
                    0.0,
                    0.35 + radius * libm::sin(angle),
                );
            }
            if c * area < ball_area {
                let (height, angle) = (2.0 * a - 1.0, 2.0 * PI * b);
                let across = (1.0 - height * height).sqrt();
                let [sine, cosine] = [libm::sin(angle), libm::cos(angle)];
                return BALL.0 + BALL.1 * DVec3::new(across * cosine, height, across * sine);
            }
            let wall = (6.0 * (c * area - ball_area) / 6.0) as usize % 6;
            let mut point = [a, b, (wall / 3) as f64];
            point.rotate_right(wall % 3);
            DVec3::from_array(point)
        })
        .collect()
}

/// Puts the queries along the curve, into memory that may have been used before.
pub(super) fn along_curve(queries: &[DVec3], sorted: &mut Vec<DVec3>) {
    let order = curve::order(queries);
    sorted.clear();
    sorted.extend(order.iter().map(|&query| queries[query as usize]));
}

/// The nearest point of ball, hourglass and walls from inside the unit box.
fn first_hit(origin: DVec3, direction: DVec3) -> DVec3 {
    let from_ball = origin - BALL.0;
    let ball = nearest_root(
        direction.length_squared(),
        from_ball.dot(direction),
        from_ball.length_squared() - BALL.1 * BALL.1,
    );
    let from_waist = origin - WAIST.0;
    let shape = DVec3::new(1.0, -0.25, 1.0);
    let waist = nearest_root(
        (shape * direction).dot(direction),
        (shape * from_waist).dot(direction),
        (shape * from_waist).dot(from_waist) - WAIST.1 * WAIST.1,
    );
    let wall = |axis: usize| {
        let end = if direction[axis] > 0.0 { 1.0 } else { 0.0 };
        (end - origin[axis]) / direction[axis]
    };
    let wall = (0..3).map(wall).fold(f64::INFINITY, f64::min);
    let point = origin + ball.min(waist).min(wall) * direction;
    point.clamp(DVec3::ZERO, DVec3::ONE)
}

/// The least t > 0 with a t² + 2 b t + c = 0, or ∞.
fn nearest_root(a: f64, b: f64, c: f64) -> f64 {
    let root = (b * b - a * c).max(0.0).sqrt();
    if b * b < a * c {
        return f64::INFINITY;
    }
    let roots = [(-b - root) / a, (-b + root) / a];
    roots
        .into_iter()
        .filter(|&t| t > 0.0)
        .fold(f64::INFINITY, f64::min)
}
