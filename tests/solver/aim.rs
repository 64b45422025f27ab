//! Rays of the lab's families for the tests of solvers.

use clap::ValueEnum as _;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::Revolution;
use photolathe::lab::families::{Family, Target};

const SEED: u64 = 31;

/// The first rays of a family, as many as asked for, or none if the family does not fit the surface.
pub(crate) fn rays(shape: &Revolution, family: Family, count: u64) -> Vec<Ray> {
    aimed(&Target::new(shape), family, 0..count)
}

/// Some rays of every family that fits the surface, with their family.
pub(crate) fn all_rays(shape: &Revolution, count: u64) -> Vec<(Family, Ray)> {
    let target = Target::new(shape);
    let of = |family| {
        let rays = aimed(&target, family, 0..count);
        rays.into_iter().map(move |ray| (family, ray))
    };
    Family::value_variants()
        .iter()
        .copied()
        .flat_map(of)
        .collect()
}

fn aimed(target: &Target, family: Family, indices: std::ops::Range<u64>) -> Vec<Ray> {
    let ray = |index| target.ray(family, &mut family.stream(SEED, index)).ok();
    indices.map_while(ray).collect()
}
