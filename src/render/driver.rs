//! The driver: passes in order, threads, progress, limits.

use super::features::Features;
use super::film::Film;
use super::path::PathTracer;
use super::photon::error::Errors;
use super::photon::{Phases, PhotonMapper};
use super::settings::Settings;
use super::whitted::Whitted;
use crate::numeric::clock::{ProcessClock, ThreadClock};
use crate::numeric::work::Work;
use crate::scene::Scene;
use crate::scene::options::Integrator;
use std::time::Instant;

/// Why a picture cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The integrator and the scene do not go together.
    #[error("{0}")]
    Unsupported(String),
    /// The threads could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(String),
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
    /// Its estimated errors, by photon mapping if the settings ask for them.
    pub errors: Option<&'a Errors>,
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
    /// Its features, where the settings ask for some.
    pub features: Option<Features>,
    /// Its estimated errors, by photon mapping if the settings ask for them.
    pub errors: Option<Errors>,
    /// Work done.
    pub work: Work,
    /// Passes done.
    pub passes: u64,
    /// CPU seconds of the process in each named phase.
    pub phases: Vec<(&'static str, f64)>,
    /// CPU seconds of the thread that makes the passes: of the whole render where the settings ask for one thread.
    pub thread_seconds: f64,
}

/// Renders; `monitor` is called after every pass and may stop the run.
///
/// The picture depends on the scene, the settings and the number of passes done, never on threads or time.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    monitor: &mut (dyn FnMut(&Progress) -> Control + Send),
) -> Result<Outcome, RenderError> {
    render_from(0, scene, settings, monitor)
}

/// The same without the passes before `first`, for settings under which a pass depends on no other
/// ([`Settings::passes_are_independent`]). Passes planned and done are counted from `first` on.
pub fn render_from(
    first: u64,
    scene: &Scene,
    settings: &Settings,
    monitor: &mut (dyn FnMut(&Progress) -> Control + Send),
) -> Result<Outcome, RenderError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(settings.threads.unwrap_or(0))
        .build()
        .map_err(|error| RenderError::Threads(error.to_string()))?
        .install(|| run(first, scene, settings, monitor))
}

/// Renders without watching.
pub fn render_unwatched(scene: &Scene, settings: &Settings) -> Result<Outcome, RenderError> {
    render(scene, settings, &mut |_| Control::Continue)
}

enum Engine<'a> {
    Whitted(Whitted<'a>),
    Path(PathTracer<'a>),
    Photon(Box<PhotonMapper<'a>>),
}

impl<'a> Engine<'a> {
    fn new(scene: &'a Scene, settings: &'a Settings) -> Result<Self, RenderError> {
        Ok(match settings.integrator {
            Integrator::Whitted => Self::Whitted(Whitted::new(scene, settings)),
            Integrator::Path => Self::Path(PathTracer::new(scene, settings)),
            Integrator::Ppm | Integrator::Sppm | Integrator::Pppm => {
                Self::Photon(Box::new(PhotonMapper::new(scene, settings)?))
            }
        })
    }

    /// Tells the features of the pass just made.
    fn tell(&self, pass: u64, features: &mut Features, phases: &mut Phases) -> Work {
        timed(&mut phases.camera, || match self {
            Self::Whitted(whitted) => whitted.tell(pass, features),
            Self::Path(path) => path.tell(pass, features),
            Self::Photon(mapper) => mapper.tell(pass, features),
        })
    }

    fn planned(&self, settings: &Settings) -> u64 {
        match self {
            Self::Whitted(_) | Self::Path(_) if settings.spp == u32::MAX => u64::MAX,
            Self::Whitted(_) | Self::Path(_) => u64::from(settings.spp),
            Self::Photon(_) => settings.passes,
        }
    }

    fn pass(&mut self, pass: u64, film: &mut Film, phases: &mut Phases) -> Work {
        match self {
            Self::Whitted(whitted) => timed(&mut phases.camera, || whitted.pass(pass, film)),
            Self::Path(path) => timed(&mut phases.camera, || path.pass(pass, film)),
            Self::Photon(mapper) => mapper.pass(pass, film, phases),
        }
    }

    fn errors(&self) -> Option<&Errors> {
        match self {
            Self::Whitted(_) | Self::Path(_) => None,
            Self::Photon(mapper) => mapper.errors(),
        }
    }
}

fn run(
    first: u64,
    scene: &Scene,
    settings: &Settings,
    monitor: &mut (dyn FnMut(&Progress) -> Control + Send),
) -> Result<Outcome, RenderError> {
    let start = Instant::now();
    let clock = ThreadClock::start();
    let mut engine = Engine::new(scene, settings)?;
    let planned = engine.planned(settings).saturating_sub(first);
    let mut film = Film::new(scene.film);
    let mut work = Work::default();
    let mut phases = Phases::default();
    let mut features = timed(&mut phases.camera, || {
        Features::new(scene, settings, &mut work)
    });
    let mut done = 0;
    while done < planned {
        work += engine.pass(first + done, &mut film, &mut phases);
        if let Some(features) = &mut features {
            work += engine.tell(first + done, features, &mut phases);
        }
        done += 1;
        let seconds = start.elapsed().as_secs_f64();
        let progress = Progress {
            done,
            planned,
            seconds,
            work,
            film: &film,
            errors: engine.errors(),
        };
        let out_of_time = settings.time.is_some_and(|limit| seconds >= limit);
        if monitor(&progress) == Control::Stop || out_of_time {
            break;
        }
    }
    Ok(Outcome {
        film,
        features,
        errors: engine.errors().cloned(),
        work,
        passes: done,
        phases: phases.named(),
        thread_seconds: clock.seconds(),
    })
}

/// Runs `work` and adds its CPU seconds to `phase`.
pub(crate) fn timed<T>(phase: &mut f64, work: impl FnOnce() -> T) -> T {
    let clock = ProcessClock::start();
    let result = work();
    *phase += clock.seconds();
    result
}
