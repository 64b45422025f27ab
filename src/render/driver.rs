//! The driver: passes in order, threads, progress, limits.

use super::film::Film;
use super::settings::Settings;
use crate::numeric::work::Work;
use crate::scene::Scene;

/// Why a picture cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The integrator and the scene do not go together.
    #[error("{0}")]
    Unsupported(String),
}

/// Where a render stands after a pass.
#[derive(Debug)]
pub struct Progress<'a> {
    /// Passes done.
    pub done: u64,
    /// Passes planned; `u64::MAX` if only time limits the run.
    pub planned: u64,
    /// Seconds since the start.
    pub seconds: f64,
    /// Work so far.
    pub work: Work,
    /// The picture so far.
    pub film: &'a Film,
}

/// Whether to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Stop after this pass.
    Stop,
}

/// A finished (or stopped) render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The picture.
    pub film: Film,
    /// Work done.
    pub work: Work,
    /// Passes done.
    pub passes: u64,
    /// Seconds of each named phase.
    pub phases: Vec<(&'static str, f64)>,
}

/// Renders; `monitor` is called after every pass and may stop the run.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    monitor: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Outcome, RenderError> {
    let _ = (scene, settings, monitor);
    todo!()
}
