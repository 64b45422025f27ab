//! Renders as experiments make them: a scene of the working directory, the seed of the run, one thread, CPU time.

use crate::image::picture::Picture;
use crate::numeric::clock::ThreadClock;
use crate::numeric::work::Work;
use crate::render::driver::render_unwatched;
use crate::render::film::Film;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::file::{load, parse};
use anyhow::{Context as _, ensure};
use std::path::Path;

/// A key of the scene file with its value, as of `--set`.
pub type Set<'a> = (&'a str, toml::Value);

/// The scene `scenes/NAME.toml` of the working directory with these values.
pub fn scene(name: &str, sets: &[Set]) -> anyhow::Result<Scene> {
    let path = Path::new("scenes").join(format!("{name}.toml"));
    ensure!(
        path.exists(),
        "{} is not here: start in the directory of the project, where scenes/ is",
        path.display()
    );
    Ok(load(&path, &overrides(sets))?)
}

/// The scene of this text, which needs no file, with these values; errors name it so.
pub fn scene_of(text: &str, name: &str, sets: &[Set]) -> anyhow::Result<Scene> {
    Ok(parse(text, name, Path::new(""), &overrides(sets))?)
}

fn overrides(sets: &[Set]) -> Vec<(String, String)> {
    let pair = |(key, value): &Set| ((*key).to_owned(), value.to_string());
    sets.iter().map(pair).collect()
}

/// What a render gave.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The film.
    pub film: Film,
    /// Work done.
    pub work: Work,
    /// CPU seconds.
    pub seconds: f64,
}

impl Rendered {
    /// Mean radiance over pixels and channels.
    pub fn mean(&self) -> f64 {
        self.film.mean().element_sum() / 3.0
    }

    /// The picture.
    pub fn picture(&self) -> Picture {
        Picture::of_film(&self.film)
    }
}

/// Renders [`scene`] on one thread with this seed.
pub fn render(name: &str, sets: &[Set], seed: u64) -> anyhow::Result<Rendered> {
    render_scene(&scene(name, sets)?, seed)
}

/// Renders a scene on one thread with this seed.
pub fn render_scene(scene: &Scene, seed: u64) -> anyhow::Result<Rendered> {
    let settings = Settings {
        seed,
        threads: Some(1),
        ..Settings::resolve(&scene.render)
    };
    let outcome = render_unwatched(scene, &settings)?;
    Ok(Rendered {
        film: outcome.film,
        work: outcome.work,
        seconds: outcome.thread_seconds,
    })
}

/// Does work that may split itself, on one thread of its own, and gives its CPU seconds too.
pub fn on_one_thread<T: Send>(
    work: impl FnOnce() -> anyhow::Result<T> + Send,
) -> anyhow::Result<(T, f64)> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.context("cannot start a thread")?.install(|| {
        let clock = ThreadClock::start();
        let result = work()?;
        Ok((result, clock.seconds()))
    })
}
