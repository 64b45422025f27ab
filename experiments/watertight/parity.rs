//! All crossings of a ray against the sides of its points.

use super::Tally;
use crate::geometry::hit::Crossing;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::membership::{Membership, membership};
use crate::geometry::revolution::{Placement, Revolution, Solver, exact};
use crate::geometry::specimens::random_profile;
use crate::lab::families::{Family, Target};
use crate::numeric::rng::{Purpose, Stream, mix};

/// Rays of a random profile.
const RAYS_OF_A_PROFILE: u64 = 1000;
/// A crossing of the exact solver farther than this share of the sizes at work is another one. The nearest roots that the two
/// could exchange are tangencies, where t is uncertain by the square root of a rounding.
const SAME: f64 = 1e-6;
/// Rays that are sent.
const FAMILIES: [Family; 3] = [Family::Random, Family::Inside, Family::NearHorizontal];

/// Sends this many rays at a closed surface.
pub(super) fn run(surface: &Revolution, count: u64, seed: u64) -> Tally {
    let mut tally = Tally::default();
    send(surface, 0..count, seed, &mut tally);
    tally
}

/// Sends this many rays at random closed profiles.
pub(super) fn run_random(count: u64, seed: u64) -> Tally {
    let mut tally = Tally::default();
    let mut first = 0;
    while first < count {
        let key = mix(&[seed, first]);
        let mut stream = Stream::new(key, Purpose::Experiment, 0);
        let profile = closed(&random_profile(&mut stream));
        let surface = Revolution::new(profile, Placement::identity());
        let last = count.min(first + RAYS_OF_A_PROFILE);
        send(&surface, first..last, seed, &mut tally);
        first = last;
    }
    tally
}

/// The profile with level discs from its ends to the axis.
fn closed(open: &Profile) -> Profile {
    let flat = |from: f64, to: f64, height: f64| {
        let radius = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|w| (1.0 - w) * from + w * to);
        Piece {
            radius,
            height: [height; 4],
        }
    };
    let pieces = open.pieces();
    let ([r0, h0], [r1, h1]) = (pieces[0].point(0), pieces[pieces.len() - 1].point(3));
    let whole = [&[flat(0.0, r0, h0)], pieces, &[flat(r1, 0.0, h1)]].concat();
    // The pieces join by their making.
    Profile::new(whole).unwrap_or_else(|_| Profile::cup())
}

fn send(surface: &Revolution, indices: std::ops::Range<u64>, seed: u64, tally: &mut Tally) {
    let target = Target::new(surface);
    for index in indices {
        let mut stream = Stream::new(seed, Purpose::Experiment, index);
        let family = FAMILIES[index as usize % FAMILIES.len()];
        tally.rays += 1;
        if let Ok(ray) = target.ray(family, &mut stream) {
            check(surface, &ray, stream.uniform(), tally);
        }
    }
}

/// Compares the crossings of a ray with the sides of its origin and of the point at this share of its way past the surface.
fn check(surface: &Revolution, ray: &Ray, share: f64, tally: &mut Tally) {
    let found = surface.crossings(ray, &Solver::Bernstein, &mut tally.work);
    let nearest = surface.nearest(ray, &Solver::Bernstein, &mut tally.work);
    let local = surface.placement().ray_to_local(ray);
    let (low, high) = surface.cylinder().interval(&local).unwrap_or((0.0, 1.0));
    let middle = (1.0 - share) * low.max(0.0) + share * high.max(0.0);
    tally.bounces += found.len() as u64;
    let before = |limit: f64| found.iter().filter(|crossing| crossing.t < limit).count();
    let behind_all = membership(surface.profile(), local.origin);
    let alternate = is_side(behind_all, found.len())
        && is_side(
            membership(surface.profile(), local.at(middle)),
            found.len() - before(middle),
        );
    if !alternate || nearest.map(|crossing| crossing.t) != found.first().map(|first| first.t) {
        ask_the_oracle(surface, &local, &found, nearest, tally);
    }
}

/// Whether a point with this many crossings between it and the outside is where it should be.
fn is_side(side: Membership, crossings: usize) -> bool {
    side == Membership::On || (side == Membership::Inside) == (crossings % 2 == 1)
}

fn ask_the_oracle(
    surface: &Revolution,
    local: &Ray,
    found: &[Crossing],
    nearest: Option<Crossing>,
    tally: &mut Tally,
) {
    let truth = exact::crossings(surface.profile(), local);
    let (radius, height) = surface.profile().control_size();
    let reach = local.origin.length() + radius + height;
    let same = |a: &Crossing, b: &Crossing| {
        let speed = local.direction.length();
        (a.t - b.t).abs() * speed <= SAME * (reach + b.t.abs() * speed)
    };
    let wrong = match (nearest, truth.first()) {
        (Some(ours), Some(first)) => !same(&ours, first),
        (ours, first) => ours.is_some() != first.is_some(),
    };
    let others = found.iter().zip(&truth).filter(|(a, b)| !same(a, b));
    tally.self_hits += found.len().saturating_sub(truth.len()) as u64;
    tally.escapes_missed += truth.len().saturating_sub(found.len()) as u64;
    if found.len() == truth.len() {
        tally.leaks += others.count() as u64 + u64::from(wrong);
    }
}
