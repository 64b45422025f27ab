//! Replicates of a golden: its picture drawn again under other seeds, kept as means of blocks.

use super::Golden;
use crate::image::metrics::{blocks, mean};
use crate::image::picture::Picture;
use crate::numeric::rng::mix;
use crate::render::driver::render_unwatched;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::file::{Override, load};
use anyhow::{Context as _, ensure};
use std::path::Path;

/// Replicates of each golden: as many as keep the check of all of them, if all differ, under a minute on two cores.
pub const REPLICATES: usize = 32;
/// Side of the blocks that are compared, in pixels.
pub(super) const BLOCK: usize = 8;

/// What a golden is a picture of.
pub(super) struct Subject {
    scene: Scene,
    settings: Settings,
}

/// The replicates of a subject.
pub(super) struct Replicates {
    /// A table in the form of a picture: row i holds replicate i, its mean first, then those of its blocks, row by row from the
    /// top. Stored like that, as float32.
    pub(super) table: Picture,
    /// Whether any two of them differ.
    pub(super) random: bool,
}

impl Subject {
    /// Reads the scene of a golden.
    pub(super) fn load(directory: &Path, golden: &Golden) -> anyhow::Result<Self> {
        let pair = |text: &String| -> anyhow::Result<Override> {
            let (key, value) = text
                .split_once('=')
                .with_context(|| format!("{text:?} is not key=value"))?;
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        };
        let overrides: Vec<Override> = golden.set.iter().map(pair).collect::<Result<_, _>>()?;
        let scene = load(&directory.join(&golden.scene), &overrides)?;
        let settings = Settings::resolve(&scene.render);
        Ok(Self { scene, settings })
    }

    /// The picture of the golden.
    pub(super) fn draw(&self) -> anyhow::Result<Picture> {
        self.draw_with(&self.settings)
    }

    /// Draws the replicates. The seed of each is a function of the golden's own and its number, so the same program draws the same.
    pub(super) fn replicates(&self) -> anyhow::Result<Replicates> {
        let mut first: Option<Picture> = None;
        let mut table = Picture::default();
        let mut random = false;
        for replicate in 0..REPLICATES {
            let settings = Settings {
                seed: mix(&[self.settings.seed, replicate as u64]),
                ..self.settings.clone()
            };
            let picture = self.draw_with(&settings)?;
            let row = means(&picture);
            (table.width, table.height) = (row.len(), replicate + 1);
            table.rgb.extend(row);
            random |= first.get_or_insert_with(|| picture.clone()).rgb != picture.rgb;
        }
        Ok(Replicates { table, random })
    }

    fn draw_with(&self, settings: &Settings) -> anyhow::Result<Picture> {
        let outcome = render_unwatched(&self.scene, settings)?;
        let bad = outcome.film.bad_samples();
        ensure!(bad == 0, "{bad} samples were NaN or infinite");
        Ok(Picture::of_film(&outcome.film).described(&self.scene, settings, outcome.passes))
    }
}

/// Mean of the picture, then of its blocks.
fn means(picture: &Picture) -> Vec<[f32; 3]> {
    let blocks = blocks(picture, BLOCK);
    std::iter::once(mean(picture))
        .chain(blocks.iter().map(|block| block.mean))
        .map(|rgb| rgb.map(|x| x as f32))
        .collect()
}
