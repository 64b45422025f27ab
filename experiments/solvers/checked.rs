//! Many more rays than the oracle could answer.

use super::roster::checked;
use super::{Tally, asked};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::clipping::ClippingSettings;
use crate::geometry::revolution::{Revolution, Solver};
use crate::geometry::specimens::Specimen;
use crate::lab::experiment::Effort;
use crate::lab::families::{Family, Target};
use crate::numeric::work::Work;

/// Rays of a family; the two profiles of rendered scenes get more of them.
pub(super) fn rays(specimen: Specimen, family: Family, effort: Effort) -> u64 {
    let scene = matches!(specimen, Specimen::Cup | Specimen::Hourglass);
    effort.of(match (scene, family) {
        (true, Family::Random) => [10_000, 5_000_000, 500_000_000],
        (true, _) => [200, 40_000, 5_000_000],
        (false, _) => [100, 10_000, 1_000_000],
    })
}

/// Rays answered together.
const CHUNK: u64 = 10_000;

/// Where the rays begin in a family's streams: other rays than those that every solver answers.
const FIRST: u64 = 1 << 40;

/// Hits this near to each other are the same, in units of the coordinates' size.
const SAME: f64 = 1e-12;

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
    let rival = Solver::Clipping(ClippingSettings::default());
    for start in (0..count).step_by(CHUNK as usize) {
        let indices = start..count.min(start + CHUNK);
        let ray = |index| target.ray(family, &mut family.stream(seed, FIRST + index));
        let rays: Vec<Ray> = indices.map(ray).collect::<Result<_, _>>()?;
        let answers = tally.time(surface, &rays);
        for (ray, answer) in rays.iter().zip(answers) {
            let other = surface.nearest(ray, &rival, &mut Work::default());
            if agree(surface, ray, answer, other) {
                tally.true_hits += u64::from(answer.is_some());
            } else {
                tally.judge(&asked(surface, ray).0, answer);
            }
        }
    }
    Ok(tally)
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
    use crate::geometry::profile::Profile;
    use crate::geometry::revolution::Placement;
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
            assert_eq!(tally.miss + tally.phantom + tally.wrong, 0);
        }
    }
}
