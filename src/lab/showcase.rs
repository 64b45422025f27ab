//! The pictures of the verification page: the cup and the gallery, small, by two integrators.

use super::contrast::Contrast;
use super::experiment::Effort;
use super::rendering::{Set, scene};
use crate::image::picture::{Origin, Picture};
use crate::image::{exr, png};
use crate::render::driver::{Control, render};
use crate::render::settings::Settings;
use anyhow::Context as _;
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
        caption: "The cup of glass",
        size: (240, 180),
    },
    Showpiece {
        name: "gallery",
        caption: "The gallery: textures, glass and mirrors",
        size: (320, 180),
    },
];

/// CPU seconds of all pictures at smoke, standard and full effort: the first estimated from whole runs, the others scaled by samples and photons.
pub const CPU_SECONDS: [f64; 3] = [16.0, 160.0, 2500.0];

/// Hears passes done and planned.
type Tell<'a> = &'a (dyn Fn(usize, usize) + Sync);

impl Showpiece {
    /// Renders the scene `scenes/NAME.toml` of the working directory by photon mapping and by path tracing, and writes
    /// OUT/NAME.exr and OUT/NAME.png of the first, OUT/NAME.path.exr and OUT/NAME.path.png of the second.
    pub fn draw(
        &self,
        effort: Effort,
        threads: Option<usize>,
        out: &Path,
        tell: Tell,
    ) -> anyhow::Result<Contrast> {
        let (passes, photons, spp) = effort.of([
            (8_u32, 40_000_u32, 32_u32),
            (64, 100_000, 256),
            (512, 200_000, 4_096),
        ]);
        let ppm = [
            ("render.integrator", "ppm".into()),
            ("render.passes", passes.into()),
            ("render.photons", photons.into()),
        ];
        let path = [
            ("render.integrator", "path".into()),
            ("render.spp", spp.into()),
        ];
        let draw = |sets: &[Set], file: &str| self.one(sets, threads, &out.join(file), tell);
        let (mapped, map) = draw(&ppm, self.name)?;
        let (traced, trace) = draw(&path, &format!("{}.path", self.name))?;
        let ppm = format!("ppm, {passes} passes of {photons} photons");
        let path = format!("path, {spp} samples a pixel");
        Ok(Contrast {
            caption: self.caption.to_owned(),
            a: (ppm, mapped),
            b: (path, traced),
            commands: vec![map, trace],
        })
    }

    /// Renders one picture to FILE.exr and FILE.png, and tells the command that does it too.
    fn one(
        &self,
        sets: &[Set],
        threads: Option<usize>,
        file: &Path,
        tell: Tell,
    ) -> anyhow::Result<(Picture, String)> {
        let (width, height) = self.size;
        let size = [("film.width", width.into()), ("film.height", height.into())];
        let sets = [&size, sets].concat();
        let scene = scene(self.name, &sets)?;
        let settings = Settings {
            threads,
            ..Settings::resolve(&scene.render)
        };
        let outcome = render(&scene, &settings, &mut |progress| {
            tell(progress.done as usize, progress.planned as usize);
            Control::Continue
        })
        .with_context(|| self.name.to_owned())?;
        let picture = Picture::of_film(&outcome.film)
            .described(&Origin::of(&scene, &settings), outcome.passes);
        let with = |ending: &str| format!("{}.{ending}", file.display());
        exr::write(&picture, Path::new(&with("exr")))?;
        png::write(&picture, 1.0, Path::new(&with("png")))?;
        let words = sets.iter().map(|(key, value)| match value.as_str() {
            Some(word) => format!(" --set {key}={word}"),
            None => format!(" --set {key}={value}"),
        });
        let command = format!(
            "photolathe render scenes/{name}.toml{} -o {name}.png",
            words.collect::<String>(),
            name = self.name
        );
        Ok((picture, command))
    }
}
