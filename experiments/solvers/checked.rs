//! Many more rays than the oracle could answer.

use super::roster::checked;
use super::{SCENES, Tally, asked};
use crate::geometry::bounds::Cylinder;
use crate::geometry::hit::Crossing;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::clipping::ClippingSettings;
use crate::geometry::revolution::{Placement, Revolution, Solver, exact};
use crate::geometry::shape::Shape;
use crate::geometry::specimens::{Specimen, random_profile};
use crate::lab::experiment::Effort;
use crate::lab::families::{Family, Target, Unfit};
use crate::lab::rendering::scene;
use crate::numeric::rng::{Purpose, Stream, mix};
use crate::numeric::work::Work;
use clap::ValueEnum;
use std::ops::Range;

/// Rays of every family but the random one, over all profiles that it fits; of the random profiles; and of the scenes.
const OF_A_FAMILY: [u64; 3] = [2000, 1_000_000, 10_000_000];
/// Random rays of each of the two profiles of rendered scenes; all profiles together make up ten million at standard effort and a
/// thousand million at full.
const RANDOM: [u64; 3] = [10_000, 5_000_000, 500_000_000];

/// Rays of a random profile.
const OF_A_PROFILE: u64 = 200;
/// Random profiles tried for one that a family fits: twenty families find one nearly always, the others hardly or never.
const TRIES: u64 = 16;
/// Into so many parts the rays at random profiles are divided among the families.
const PARTS: u64 = 19;
/// Rays answered together.
const CHUNK: u64 = 10_000;

/// Where the rays begin in a family's streams: other rays than those that every solver answers.
const FIRST: u64 = 1 << 40;

/// A cylinder around a piece is wider by this share of the coordinates than the piece's control points.
const WIDER: f64 = 1e-6;

/// Hits this near to each other are the same, in units of the coordinates' size.
const SAME: f64 = 1e-12;

/// Rays of a family at one of our profiles.
pub(super) fn rays(specimen: Specimen, family: Family, effort: Effort) -> u64 {
    let scene = matches!(specimen, Specimen::Cup | Specimen::Hourglass);
    if scene && family == Family::Random {
        return effort.of(RANDOM);
    }
    let fitting = Specimen::ALL.into_iter().filter(|specimen| {
        let surface = Revolution::new(specimen.profile(), Placement::identity());
        Target::new(&surface).fits(family).is_ok()
    });
    let shares: u64 = fitting.map(|specimen| share(specimen, family)).sum();
    (effort.of(OF_A_FAMILY) * share(specimen, family)).div_ceil(shares)
}

/// Share of a profile in the rays of a family. The sheets of the fold touch: to make a ray that leaves them takes 1.5 ms of exact tests.
fn share(specimen: Specimen, family: Family) -> u64 {
    match (specimen, family) {
        (Specimen::Fold, Family::Leaving) => 1,
        _ => 20,
    }
}

/// The default solver's batches against Bezier clipping, which shares no code with them but the profile; the oracle decides where the
/// two differ.
pub(super) fn check(
    target: &Target,
    surface: &Revolution,
    family: Family,
    count: u64,
    seed: u64,
) -> anyhow::Result<Tally> {
    let mut tally = Tally::new(checked());
    let ray = |index| target.ray(family, &mut family.stream(seed, FIRST + index));
    send(&mut tally, surface, 0..count, &ray)?;
    Ok(tally)
}

/// The same for random profiles, as many rays of each family, on profiles that it fits, if such are found.
pub(super) fn check_random(effort: Effort, seed: u64) -> anyhow::Result<Vec<(Family, Tally)>> {
    let families = Family::value_variants();
    let count = effort.of(OF_A_FAMILY).div_ceil(PARTS);
    let of_family = |&family: &Family| {
        let mut tally = Tally::new(checked());
        for first in (0..count).step_by(OF_A_PROFILE as usize) {
            let key = mix(&[seed, family as u64, first]);
            let surface = |attempt| {
                let stream = &mut Stream::new(key, Purpose::Experiment, FIRST + attempt);
                Revolution::new(random_profile(stream), Placement::identity())
            };
            let fits = |surface: &Revolution| Target::new(surface).fits(family).is_ok();
            if let Some(surface) = (0..TRIES).map(surface).find(fits) {
                let target = Target::new(&surface);
                let ray = |index| target.ray(family, &mut family.stream(seed, FIRST + index));
                let indices = first..count.min(first + OF_A_PROFILE);
                send(&mut tally, &surface, indices, &ray)?;
            }
        }
        Ok((family, tally))
    };
    let tallies: anyhow::Result<Vec<(Family, Tally)>> = families.iter().map(of_family).collect();
    // Some families fit too few profiles to find any here.
    Ok(tallies?
        .into_iter()
        .filter(|(_, tally)| tally.rays > 0)
        .collect())
}

/// The same for rays by which camera paths of a scene leave its surfaces of revolution, in the frames of these.
pub(super) fn check_scene(
    name: &str,
    effort: Effort,
    seed: u64,
) -> anyhow::Result<Vec<(Family, Tally)>> {
    let scene = scene(name, &[])?;
    let count = effort.of(OF_A_FAMILY) / SCENES.len() as u64;
    let family = Family::Secondary;
    let mut tally = Tally::new(checked());
    let shapes = scene
        .objects
        .iter()
        .filter_map(|object| match &object.shape {
            Shape::Revolution(shape) => Some(shape),
            _ => None,
        });
    let targets: Vec<_> = Target::all_of(&scene).into_iter().zip(shapes).collect();
    let each = count.div_ceil(targets.len() as u64);
    for (first, (target, shape)) in (0..).step_by(each as usize).zip(&targets) {
        let surface = Revolution::new(shape.profile().clone(), Placement::identity());
        let ray = |index| {
            let ray = target.ray(family, &mut family.stream(seed, FIRST + index))?;
            Ok(shape.placement().ray_to_local(&ray))
        };
        send(&mut tally, &surface, first..first + each, &ray)?;
    }
    Ok(vec![(family, tally)])
}

/// Answers the rays with these numbers.
fn send(
    tally: &mut Tally,
    surface: &Revolution,
    indices: Range<u64>,
    ray: &dyn Fn(u64) -> Result<Ray, Unfit>,
) -> anyhow::Result<()> {
    let rival = Solver::Clipping(ClippingSettings::default());
    let hulls: Vec<Cylinder> = surface.profile().pieces().iter().map(hull).collect();
    for start in indices.clone().step_by(CHUNK as usize) {
        let rays = (start..indices.end.min(start + CHUNK)).map(ray);
        let rays: Vec<Ray> = rays.collect::<Result<_, _>>()?;
        let answers = tally.time(surface, &rays);
        for (ray, answer) in rays.iter().zip(answers) {
            let other = surface.nearest(ray, &rival, &mut Work::default());
            if agree(surface, ray, answer, other) {
                tally.true_hits += u64::from(answer.is_some());
            } else {
                let near = |piece| hulls[piece as usize].interval(ray).is_some();
                let truths = exact::crossings_among(surface.profile(), ray, near);
                let before = tally.failures();
                tally.judge(&asked(surface, ray, &truths), answer);
                if before == 0 && tally.failures() > 0 {
                    tell(surface.profile(), ray, answer, &truths);
                }
            }
        }
    }
    Ok(())
}

/// Tells the first failure of a kind, for whoever is to look into it.
fn tell(profile: &Profile, ray: &Ray, answer: Option<f64>, truths: &[Crossing]) {
    eprintln!(
        "solvers: t = {answer:?} is wrong: the crossings are {truths:?}\n  {ray:?}\n  {profile:?}"
    );
}

/// A cylinder well around a piece: a ray that misses it cannot meet the piece, and spares the oracle the question.
fn hull(piece: &Piece) -> Cylinder {
    let fold = |values: [f64; 4], by: fn(f64, f64) -> f64| values.into_iter().fold(f64::NAN, by);
    let radius = fold(piece.radius.map(f64::abs), f64::max);
    let (bottom, top) = (fold(piece.height, f64::min), fold(piece.height, f64::max));
    let slack = WIDER * (radius + bottom.abs().max(top.abs()));
    Cylinder {
        radius: radius + slack,
        bottom: bottom - slack,
        top: top + slack,
    }
}

fn agree(surface: &Revolution, ray: &Ray, answer: Option<f64>, other: Option<Crossing>) -> bool {
    match (answer, other) {
        (None, None) => true,
        (Some(t), Some(other)) => {
            let (radius, height) = surface.profile().control_size();
            let speed = ray.direction.length();
            let scale = (ray.origin.length() + t.abs() * speed).max(radius + height);
            (t - other.t).abs() * speed <= SAME * scale
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn answers_agree_if_they_are_the_same_hit_or_both_none() {
        let cup = Revolution::new(Profile::cup(), Placement::identity());
        let ray = Ray::new(DVec3::new(9.0, 1.0, 0.0), -DVec3::X);
        let crossing = |t| {
            Some(Crossing {
                t,
                piece: 3,
                u: 0.5,
            })
        };
        assert!(agree(&cup, &ray, None, None));
        assert!(agree(&cup, &ray, Some(6.0), crossing(6.0 + 1e-12)));
        assert!(!agree(&cup, &ray, Some(6.0), crossing(6.0 + 1e-10)));
        assert!(!agree(&cup, &ray, Some(6.0), None));
        assert!(!agree(&cup, &ray, None, crossing(6.0)));
    }

    #[test]
    fn every_family_gets_the_rays_that_are_promised() {
        for (effort, random, others) in [
            (Effort::Standard, 10_000_000, 1_000_000),
            (Effort::Full, 1_000_000_000, 10_000_000),
        ] {
            for &family in Family::value_variants() {
                let fits = |specimen: &Specimen| {
                    let surface = Revolution::new(specimen.profile(), Placement::identity());
                    Target::new(&surface).fits(family).is_ok()
                };
                let specimens = Specimen::ALL.into_iter().filter(fits);
                let sum: u64 = specimens.map(|s| rays(s, family, effort)).sum();
                let least = match family {
                    Family::Random => random,
                    // These are in scenes alone.
                    Family::Secondary => 0,
                    _ => others,
                };
                assert!(sum >= least, "{}: {sum}", family.name());
            }
        }
    }

    #[test]
    fn random_profiles_and_scenes_give_rays_and_no_failures() {
        let mut all = check_random(Effort::Smoke, 3).expect("profiles");
        let rays: u64 = all.iter().map(|(_, tally)| tally.rays).sum();
        assert!(
            rays >= OF_A_FAMILY[0],
            "{} families, {rays} rays",
            all.len()
        );
        for name in SCENES {
            let tallies = check_scene(name, Effort::Smoke, 3).expect("a scene");
            assert!(tallies.iter().all(|(_, tally)| tally.rays >= 600));
            all.extend(tallies);
        }
        for (family, tally) in all {
            let failures = tally.failures();
            assert_eq!(failures, 0, "{}", family.name());
            assert!(tally.true_hits <= tally.rays);
        }
    }

    #[test]
    fn a_ray_that_meets_a_piece_meets_its_hull() {
        for specimen in Specimen::ALL {
            let surface = Revolution::new(specimen.profile(), Placement::identity());
            let target = Target::new(&surface);
            for &family in Family::value_variants() {
                for index in 0..50 {
                    let Ok(ray) = target.ray(family, &mut family.stream(5, index)) else {
                        break;
                    };
                    for crossing in exact::crossings(surface.profile(), &ray) {
                        let piece = &surface.profile().pieces()[crossing.piece as usize];
                        assert!(hull(piece).interval(&ray).is_some(), "{}", family.name());
                    }
                }
            }
        }
    }

    /// Level rays are what clipping fails at; all rays are counted whoever decides, and hits as often as the default solver has them.
    #[test]
    fn every_ray_is_counted_whoever_decides() {
        let cup = Revolution::new(Profile::cup(), Placement::identity());
        let target = Target::new(&cup);
        for family in [Family::Random, Family::Horizontal] {
            let tally = check(&target, &cup, family, 500, 3).expect("rays");
            let hits = (0..500).filter(|index| {
                let stream = &mut family.stream(3, FIRST + index);
                let ray = target.ray(family, stream).expect("a ray");
                let found = cup.nearest(&ray, &Solver::Bernstein, &mut Work::default());
                found.is_some()
            });
            assert_eq!(tally.true_hits, hits.count() as u64);
            assert_eq!(tally.failures(), 0);
        }
    }
}
