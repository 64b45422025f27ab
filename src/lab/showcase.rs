//! The pictures of the verification page: the cup and the gallery, small.

use super::experiment::Effort;
use super::report::Shown;
use crate::image::picture::Picture;
use crate::image::{exr, png};
use crate::render::driver::{Control, render};
use crate::render::settings::Settings;
use crate::scene::file::load;
use anyhow::{Context as _, ensure};
use std::path::Path;

/// A scene of the page.
#[derive(Clone, Copy, Debug)]
pub struct Showpiece {
    /// Name of the scene and of its files.
    pub name: &'static str,
    caption: &'static str,
    size: (u32, u32),
}

/// The scenes of the page.
pub const SHOWPIECES: [Showpiece; 2] = [
    Showpiece {
        name: "cup",
        caption: "The cup of glass by progressive photon mapping",
        size: (240, 180),
    },
    Showpiece {
        name: "gallery",
        caption: "The gallery: textures, glass and mirrors by progressive photon mapping",
        size: (320, 180),
    },
];

impl Showpiece {
    /// Renders the scene `scenes/NAME.toml` of the working directory, and writes OUT/NAME.exr and OUT/NAME.png. `tell` hears passes
    /// done and planned.
    pub fn draw(
        &self,
        effort: Effort,
        threads: Option<usize>,
        out: &Path,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> anyhow::Result<Shown> {
        let path = Path::new("scenes").join(format!("{}.toml", self.name));
        ensure!(
            path.exists(),
            "{} is not here: start in the directory of the project, where scenes/ is",
            path.display()
        );
        let (passes, photons) = match effort {
            Effort::Smoke => (8, 40_000),
            Effort::Standard => (64, 100_000),
            Effort::Full => (512, 200_000),
        };
        let sets = [
            ("film.width", self.size.0.to_string()),
            ("film.height", self.size.1.to_string()),
            ("render.integrator", "\"ppm\"".to_owned()),
            ("render.passes", passes.to_string()),
            ("render.photons", photons.to_string()),
        ];
        let overrides: Vec<(String, String)> = sets
            .iter()
            .map(|(key, value)| ((*key).to_owned(), value.clone()))
            .collect();
        let scene = load(&path, &overrides)?;
        let settings = Settings {
            threads,
            ..Settings::resolve(&scene.render)
        };
        let outcome = render(&scene, &settings, &mut |progress| {
            tell(progress.done as usize, progress.planned as usize);
            Control::Continue
        })
        .with_context(|| path.display().to_string())?;
        let picture = Picture::of_film(&outcome.film).described(&scene, &settings, outcome.passes);
        exr::write(&picture, &out.join(format!("{}.exr", self.name)))?;
        png::write(&picture, 1.0, &out.join(format!("{}.png", self.name)))?;
        let words: Vec<String> = sets
            .iter()
            .map(|(key, value)| format!("--set {key}={}", value.trim_matches('"')))
            .collect();
        Ok(Shown {
            name: self.name.to_owned(),
            uri: png::data_uri(&png::encode(&picture, 1.0).map_err(anyhow::Error::msg)?),
            caption: format!("{}, {passes} passes of {photons} photons", self.caption),
            command: format!("photolathe render {} {}", path.display(), words.join(" ")),
        })
    }
}
