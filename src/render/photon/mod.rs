//! Progressive photon mapping: photon passes over hit points.

use super::driver::RenderError;
use super::film::Film;
use super::settings::Settings;
use crate::numeric::work::Work;
use crate::scene::Scene;

/// A progressive photon mapper between passes.
pub struct PhotonMapper<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
}

impl<'a> PhotonMapper<'a> {
    /// Prepares the first pass.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Result<Self, RenderError> {
        Ok(Self { scene, settings })
    }

    /// One pass: emits photons, gathers at the hit points, adds one sample to every pixel of `film`.
    pub fn pass(&mut self, pass: u64, film: &mut Film, phases: &mut Phases) -> Work {
        let _ = (pass, film, phases, self.scene, self.settings);
        todo!()
    }
}

/// Seconds spent in each phase of the passes so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phases {
    /// Camera paths and hit points.
    pub camera: f64,
    /// Photon tracing.
    pub trace: f64,
    /// Building the index.
    pub build: f64,
    /// Gathering.
    pub gather: f64,
}

impl Phases {
    /// The phases with their names.
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("camera", self.camera),
            ("trace", self.trace),
            ("build", self.build),
            ("gather", self.gather),
        ]
    }
}
