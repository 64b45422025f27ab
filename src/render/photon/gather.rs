//! Gathering: which photons count at a hit point, and what they are worth there.

use super::arrivals::{Arrival, Arrivals, Surface};
use super::camera::HitPoint;
use super::error::bias_weight;
use crate::scene::Rgb;
use glam::DVec3;
use std::f64::consts::PI;

/// What a hit point gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gathered {
    /// Sum of the flux of the photons, as [`Arrival::flux`].
    pub flux: Rgb,
    /// The same, each times [`bias_weight`].
    pub bias_flux: Rgb,
    /// Number of photons.
    pub photons: u64,
}

/// Whether a photon within the radius counts at a hit point: same object, same side of it, and not too many events in all.
///
/// "Same side" compares the normals on the sides of arrival: at a thin wall the two sheets face apart, so neither light from
/// behind nor light on the other sheet of the same object counts.
pub fn accepts(hit_point: &HitPoint, photon: &Arrival, max_depth: Option<u32>) -> bool {
    hit_point.object == photon.object
        && hit_point.normal.dot(photon.normal) > 0.0
        && max_depth.is_none_or(|most| {
            u64::from(hit_point.events) + u64::from(photon.events) < u64::from(most)
        })
}

/// What gathering asks of a hit point again and again.
#[derive(Clone, Copy, Debug)]
pub(super) struct Site {
    /// Where.
    pub(super) point: DVec3,
    /// Square of the radius.
    pub(super) radius_squared: f64,
    /// The flat surface it lies on, if it does.
    surface: Surface,
    /// Photons with fewer events count.
    most_events: u32,
}

impl Site {
    /// The site of a hit point.
    pub(super) fn of(
        hit_point: &HitPoint,
        radius_squared: f64,
        arrivals: &Arrivals,
        max_depth: Option<u32>,
    ) -> Self {
        Self {
            point: hit_point.point,
            radius_squared,
            surface: arrivals.surface(hit_point.object, hit_point.normal),
            most_events: max_depth.map_or(u32::MAX, |most| most.saturating_sub(hit_point.events)),
        }
    }

    /// See [`gather`]. `accepts` says whether a photon counts that does not lie on a flat surface.
    #[inline]
    pub(super) fn gather(
        &self,
        within: &[u32],
        arrivals: &Arrivals,
        gathered: &mut Gathered,
        accepts: impl Fn(&Arrival) -> bool,
        look: impl Fn(u32) -> (f64, Option<f64>),
    ) {
        let mut sum = *gathered;
        for &photon in within {
            let flux = match arrivals.lies_on(photon, self.surface) {
                Some(false) => continue,
                // On flat surfaces, the most common, one comparison stands for those of objects and normals.
                Some(true) => {
                    let (flux, events) = arrivals.on_flat(photon);
                    if events >= self.most_events {
                        continue;
                    }
                    flux
                }
                None => {
                    let arrival = arrivals.get(photon as usize);
                    if !accepts(&arrival) {
                        continue;
                    }
                    arrival.flux
                }
            };
            let (weight, share) = look(photon);
            sum.flux += flux * weight;
            if let Some(share) = share {
                sum.bias_flux += flux * bias_weight(share);
            }
            sum.photons += 1;
        }
        *gathered = sum;
    }
}

/// Adds to what a hit point has gathered, in their order, the photons that it accepts of those within its radius: the flux of each
/// times its weight. `look` gives a photon's weight and, where the bias is to be estimated, its d²/r².
pub fn gather(
    hit_point: &HitPoint,
    within: &[u32],
    arrivals: &Arrivals,
    max_depth: Option<u32>,
    mut gathered: Gathered,
    look: impl Fn(u32) -> (f64, Option<f64>),
) -> Gathered {
    let site = Site::of(hit_point, 0.0, arrivals, max_depth);
    let accepts = |photon: &Arrival| accepts(hit_point, photon, max_depth);
    site.gather(within, arrivals, &mut gathered, accepts, look);
    gathered
}

/// The radiance that a hit point adds to its pixel in a pass of `emitted` photons: weight × flux / (π r² photons).
///
/// The running mean of this over the passes equals τ/(π r² photons) of the progressive form (Hachisuka, Ogaki and Jensen 2008),
/// whatever the rule by which r shrinks: there τ is scaled with r², here every pass is divided by its own r².
pub fn radiance(
    hit_point: &HitPoint,
    gathered: &Gathered,
    radius_squared: f64,
    emitted: f64,
) -> Rgb {
    per_area(hit_point, gathered, gathered.flux, radius_squared, emitted)
}

/// The estimated bias of [`radiance`]: see [`error`](super::error).
pub fn bias(hit_point: &HitPoint, gathered: &Gathered, radius_squared: f64, emitted: f64) -> Rgb {
    let flux = gathered.bias_flux;
    per_area(hit_point, gathered, flux, radius_squared, emitted)
}

fn per_area(
    hit_point: &HitPoint,
    gathered: &Gathered,
    flux: Rgb,
    radius_squared: f64,
    emitted: f64,
) -> Rgb {
    if gathered.photons == 0 {
        return Rgb::ZERO;
    }
    hit_point.weight * flux / (PI * radius_squared * emitted)
}
