//! Replicates of a golden: its picture drawn again under other seeds, kept as means of blocks.

use super::Golden;
use crate::image::metrics::{blocks, mean};
use crate::image::picture::{Origin, Picture};
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
        Ok(Picture::of_film(&outcome.film)
            .described(&Origin::of(&self.scene, settings), outcome.passes))
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

#[cfg(test)]
mod tests {
    use super::super::judge::by_bits;
    use super::super::{GoldenVerdict, LEVEL};
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};
    use crate::numeric::statistics::{holm_smallest, two_sided_normal};
    use crate::scene::file::parse;
    use std::sync::OnceLock;

    /// A photon map: a ball and its shadow, with so few photons that many blocks get only some.
    const SCENE: &str = "\
        [camera]\neye = [0, 3, 6]\ntarget = [0, 0, 0]\nvertical_fov_deg = 40\n[film]\nwidth = 24\nheight = 24\n\
        [render]\nintegrator = \"ppm\"\nspp = 1\npasses = 2\nphotons = 300\n\
        [material.wall]\ndiffuse = { reflectance = [0.5, 0.5, 0.5] }\n\
        [[sphere]]\ncenter = [0, 1, 0]\nradius = 1\nmaterial = \"wall\"\n\
        [[disc]]\ncenter = [0, 0, 0]\nnormal = [0, 1, 0]\nradius = 3\nmaterial = \"wall\"\n\
        [[point_light]]\nposition = [2, 3, 1]\nintensity = [20, 20, 20]\n";
    const POOL: usize = 320;
    const JUDGEMENTS: u64 = 200;

    type Judge = fn(&[&Picture], &[&Picture]) -> GoldenVerdict;

    fn subject() -> Subject {
        let scene = parse(SCENE, "scene", Path::new(""), &[]).unwrap();
        let settings = Settings::resolve(&scene.render);
        Subject { scene, settings }
    }

    fn across_replicates(new: &[&Picture], stored: &[&Picture]) -> GoldenVerdict {
        let table = |pictures: &[&Picture]| {
            let rows: Vec<_> = pictures.iter().map(|picture| means(picture)).collect();
            Picture {
                width: rows[0].len(),
                height: rows.len(),
                rgb: rows.concat(),
                ..Picture::default()
            }
        };
        let check = by_bits(new[0], stored[0]).unwrap();
        check.by_replicates(&table(new), &table(stored)).verdict
    }

    /// Wrong for photon maps: z of each block, its variance taken from the pixels of one picture.
    fn across_pixels(new: &[&Picture], stored: &[&Picture]) -> GoldenVerdict {
        let pairs = blocks(new[0], BLOCK)
            .into_iter()
            .zip(blocks(stored[0], BLOCK));
        let p: Vec<f64> = pairs
            .flat_map(|(a, b)| {
                [0, 1, 2].map(|c| {
                    let error = (a.variance[c] + b.variance[c])
                        .sqrt()
                        .max(f64::MIN_POSITIVE);
                    two_sided_normal((a.mean[c] - b.mean[c]) / error)
                })
            })
            .collect();
        if holm_smallest(&p) >= LEVEL {
            GoldenVerdict::Equivalent
        } else {
            GoldenVerdict::Different
        }
    }

    fn pool() -> Vec<Picture> {
        let subject = subject();
        let draw = |seed: usize| {
            let settings = Settings {
                seed: seed as u64,
                ..subject.settings.clone()
            };
            subject.draw_with(&settings).unwrap()
        };
        (0..POOL).map(draw).collect()
    }

    /// How often pictures of one program under other seeds are called different: disjoint random draws from one pool.
    fn false_alarms(judge: Judge) -> usize {
        static DRAWN: OnceLock<Vec<Picture>> = OnceLock::new();
        let pool = DRAWN.get_or_init(pool);
        let alarm = |judgement: &u64| {
            let mut stream = Stream::new(*judgement, Purpose::Test, 0);
            let mut order: Vec<&Picture> = pool.iter().collect();
            for i in 0..2 * REPLICATES {
                order.swap(i, i + stream.next_u64() as usize % (POOL - i));
            }
            let (new, rest) = order.split_at(REPLICATES);
            judge(new, &rest[..REPLICATES]) != GoldenVerdict::Equivalent
        };
        (0..JUDGEMENTS).filter(alarm).count()
    }

    /// 200 judgements at level 1e-4: more than one false alarm has probability 2e-4; there is none.
    #[test]
    fn other_seeds_of_a_photon_map_are_equivalent() {
        assert_eq!(false_alarms(across_replicates), 0);
    }

    #[test]
    fn a_judge_that_takes_pixels_as_independent_raises_false_alarms() {
        let alarms = false_alarms(across_pixels);
        // Level 1e-4: even two would be too many.
        assert!(alarms > 3, "{alarms}");
    }

    #[test]
    fn replicates_differ_from_each_other_and_are_drawn_again_to_the_bit() {
        let [one, two] = [0, 1].map(|_| subject().replicates().unwrap());
        assert!(one.random);
        assert_eq!(one.table, two.table);
        assert_eq!((one.table.width, one.table.height), (10, REPLICATES));
        let mut rows: Vec<_> = one.table.rgb.chunks(10).collect();
        rows.sort_unstable_by(|a, b| a[0][0].total_cmp(&b[0][0]));
        rows.dedup();
        assert_eq!(rows.len(), REPLICATES);
    }
}
