//! The photons of a pass, traced in batches.

use super::trace::{self, Photons};
use crate::render::settings::Settings;
use crate::scene::Scene;

/// Photon paths traced and gathered at a time, so that the memory of a pass does not grow with their number. It does with their length: a
/// path leaves a photon at every diffuse surface that it meets, and only absorption and `max_depth` end it.
const BATCH: u64 = 50_000;

/// The photons of a pass, batch by batch.
#[derive(Clone, Copy)]
pub(super) struct Batches<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    /// Index of the first photon.
    first: u64,
}

impl<'a> Batches<'a> {
    pub(super) fn new(scene: &'a Scene, settings: &'a Settings, pass: u64) -> Self {
        Self {
            scene,
            settings,
            first: pass.wrapping_mul(settings.photons),
        }
    }

    /// Traces a batch; `None` after the last.
    pub(super) fn trace(&self, batch: u64) -> Option<Photons> {
        let Settings {
            photons,
            seed,
            max_depth,
            ..
        } = *self.settings;
        let before = batch
            .checked_mul(BATCH)
            .filter(|&before| before < photons)?;
        let (start, count) = (self.first.wrapping_add(before), BATCH.min(photons - before));
        Some(trace::trace(self.scene, seed, start, count, max_depth))
    }
}
