//! Goldens: pictures that must not change unnoticed.
//!
//! A golden is NAME.toml (scene, overrides, component, digest, reason) with NAME.exr beside it. A check renders the scene anew
//! and says *identical* (the same digest of the pixels), *equivalent* (bits differ, statistics show no difference) or
//! *different*. `golden/regression/` holds what this program draws; `golden/reference/` holds independent truth (a closed form,
//! another renderer) and is never accepted from our own output.

use crate::image::file::write_atomically;
use crate::image::metrics::{self, Block, blocks, same_size};
use crate::image::picture::Picture;
use crate::image::{ImageError, exr};
use crate::numeric::statistics::{
    Moments, holm_smallest, normal_quantile, student, student_quantile, two_sided_normal,
    two_sided_student,
};
use crate::render::driver::render_unwatched;
use crate::render::settings::Settings;
use crate::scene::file::{Override, load};
use crate::scene::options::Integrator;
use anyhow::{Context as _, bail, ensure};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Level of the tests of one golden: the chance that a re-render of the same expectation, with other bits, is called different.
pub const LEVEL: f64 = 1e-4;
/// Side of the blocks that are compared, in pixels.
const BLOCK: usize = 8;
/// Pixels are stored as f32: differences of this share of the mean are rounding.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;
/// Name of the directory of independent truth.
const REFERENCE: &str = "reference";

/// The .toml of a golden.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Golden {
    /// Scene file, relative to the golden's directory.
    pub scene: PathBuf,
    /// Overrides, as `film.width=64`.
    #[serde(default)]
    pub set: Vec<String>,
    /// The component whose faults it would show.
    pub component: String,
    /// Relative error of the golden itself (say, of another renderer's mesh); 0 for our own.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub margin: f64,
    /// Digest of its pixels; absent until it is accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Why it was accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks for a reference"
)]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// The three-way verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoldenVerdict {
    /// Every pixel has the same bits.
    Identical,
    /// Bits differ, statistics show no difference.
    Equivalent,
    /// They show one, or there is nothing random that could excuse it.
    Different,
}

impl GoldenVerdict {
    /// The word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Equivalent => "equivalent",
            Self::Different => "different",
        }
    }
}

/// What a check found.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The verdict.
    pub verdict: GoldenVerdict,
    /// p of "no difference" over the whole picture and all blocks; 1 if identical, 0 if nothing is random.
    pub p: f64,
    /// Smallest relative change of the picture's mean that would have been called different with 90 % probability.
    pub detectable: f64,
    /// Largest difference of a value.
    pub max: f64,
}

/// The check of one golden.
#[derive(Debug)]
pub struct Outcome {
    /// Its name.
    pub name: String,
    /// The component it guards; empty if its .toml cannot be read.
    pub component: String,
    /// What was found, or why nothing could be.
    pub check: anyhow::Result<Check>,
    /// The new picture, if it could be rendered.
    pub picture: Option<Picture>,
    /// Seconds.
    pub seconds: f64,
}

/// Checks every golden of a directory, in the order of their names. An absent directory holds none.
pub fn check_all(directory: &Path) -> Vec<Outcome> {
    names(directory)
        .iter()
        .map(|name| check(directory, name))
        .collect()
}

/// Names of the goldens of a directory, sorted.
pub fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let tomls = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"));
    let mut names: Vec<String> = tomls
        .filter_map(|path| Some(path.file_stem()?.to_string_lossy().into_owned()))
        .collect();
    names.sort();
    names
}

/// Renders one golden anew and compares.
pub fn check(directory: &Path, name: &str) -> Outcome {
    let start = Instant::now();
    let mut outcome = Outcome {
        name: name.to_owned(),
        component: String::new(),
        check: Err(anyhow::anyhow!("not checked")),
        picture: None,
        seconds: 0.0,
    };
    outcome.check = fill(directory, name, &mut outcome);
    outcome.seconds = start.elapsed().as_secs_f64();
    outcome
}

fn fill(directory: &Path, name: &str, outcome: &mut Outcome) -> anyhow::Result<Check> {
    let golden = read(directory, name)?;
    outcome.component.clone_from(&golden.component);
    let path = directory.join(format!("{name}.exr"));
    let digest = golden
        .digest
        .as_deref()
        .with_context(|| format!("{name} was never accepted"))?;
    let stored = exr::read(&path)?;
    ensure!(
        stored.digest() == digest,
        "{} is not the picture that was accepted",
        path.display()
    );
    let (picture, integrator) = draw(directory, &golden)?;
    let picture = outcome.picture.insert(picture);
    Ok(judge(
        picture,
        &stored,
        integrator == Integrator::Whitted,
        golden.margin,
    )?)
}

/// Compares a new picture with a golden. Where `deterministic`, every bit counts; elsewhere differences within the noise, plus
/// a relative `margin`, are equivalent.
///
/// Two families of tests share [`LEVEL`]: the mean of the picture by its paired 8×8-block differences (Student's t, or z
/// where a picture has one block only), and each block by the variances that the pictures carry (z, Holm). The block test takes
/// the two pictures as independent, which errs towards "equivalent" when they share random numbers; the paired one does not.
pub fn judge(
    new: &Picture,
    golden: &Picture,
    deterministic: bool,
    margin: f64,
) -> Result<Check, ImageError> {
    same_size(new, golden)?;
    let flat = new.rgb.as_flattened().iter().zip(golden.rgb.as_flattened());
    let max = flat.fold(0.0, |max: f64, (a, b)| {
        let difference = f64::from((a - b).abs());
        if difference.is_nan() {
            f64::INFINITY
        } else {
            max.max(difference)
        }
    });
    if new.digest() == golden.digest() {
        return Ok(Check {
            verdict: GoldenVerdict::Identical,
            p: 1.0,
            detectable: 0.0,
            max,
        });
    }
    let random =
        !deterministic && new.variance.is_some() && golden.variance.is_some() && max.is_finite();
    let (p, detectable) = if random {
        statistics(new, golden, margin)
    } else {
        (0.0, 0.0)
    };
    let verdict = if p >= LEVEL {
        GoldenVerdict::Equivalent
    } else {
        GoldenVerdict::Different
    };
    Ok(Check {
        verdict,
        p,
        detectable,
        max,
    })
}

/// p over both families, and the detectable relative change of the mean.
fn statistics(new: &Picture, golden: &Picture, margin: f64) -> (f64, f64) {
    let pairs: Vec<(Block, Block)> = blocks(new, BLOCK)
        .into_iter()
        .zip(blocks(golden, BLOCK))
        .collect();
    let mut p_values = Vec::new();
    for (a, b) in &pairs {
        for c in 0..3 {
            let noise = (a.variance[c] + b.variance[c]).sqrt() + ROUNDING * b.mean[c].abs();
            p_values.push(two_sided_normal(
                beyond(a.mean[c] - b.mean[c], margin * b.mean[c].abs())
                    / noise.max(f64::MIN_POSITIVE),
            ));
        }
    }
    let by_block = holm_smallest(&p_values);
    let mut by_mean = Vec::new();
    let mut detectable = 0.0_f64;
    let means = metrics::mean(golden);
    for c in 0..3 {
        let paired = Moments::of(pairs.iter().map(|(a, b)| a.mean[c] - b.mean[c]));
        let slack = margin * means[c].abs() + ROUNDING * means[c].abs();
        let error = paired.standard_error();
        if paired.count() < 2 || error == 0.0 {
            continue;
        }
        let test = student(&paired, 0.0);
        by_mean.push(two_sided_student(
            beyond(paired.mean(), slack) / error,
            test.freedom,
        ));
        let reach = student_quantile(1.0 - LEVEL / 12.0, test.freedom) + normal_quantile(0.9);
        detectable =
            detectable.max((slack + reach * error) / means[c].abs().max(f64::MIN_POSITIVE));
    }
    let p = holm_smallest(&[by_block, holm_smallest(&by_mean)]);
    (p, detectable)
}

/// How far a difference is beyond a margin.
fn beyond(difference: f64, margin: f64) -> f64 {
    (difference.abs() - margin).max(0.0)
}

/// Renders a golden and stores it with the reason. Refused in a directory of independent truth.
pub fn accept(directory: &Path, name: &str, reason: &str) -> anyhow::Result<String> {
    ensure!(
        directory
            .file_name()
            .is_none_or(|folder| folder != REFERENCE),
        "{name} is in {}: independent truth is never accepted from our own output",
        directory.display()
    );
    ensure!(
        !reason.trim().is_empty(),
        "a golden is accepted for a reason; say it with --reason"
    );
    let mut golden = read(directory, name)?;
    let (picture, _) = draw(directory, &golden)?;
    let digest = picture.digest();
    exr::write(&picture, &directory.join(format!("{name}.exr")))?;
    golden.digest = Some(digest.clone());
    golden.reason = Some(reason.trim().to_owned());
    let path = directory.join(format!("{name}.toml"));
    let old = std::fs::read_to_string(&path)?;
    let comment: String = old
        .lines()
        .take_while(|line| line.starts_with('#'))
        .flat_map(|line| [line, "\n"])
        .collect();
    write_atomically(
        &path,
        (comment + &toml::to_string_pretty(&golden)?).as_bytes(),
    )?;
    Ok(digest)
}

fn read(directory: &Path, name: &str) -> anyhow::Result<Golden> {
    let path = directory.join(format!("{name}.toml"));
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    toml::from_str(&text).with_context(|| path.display().to_string())
}

fn draw(directory: &Path, golden: &Golden) -> anyhow::Result<(Picture, Integrator)> {
    let pair = |text: &String| -> anyhow::Result<Override> {
        let (key, value) = text
            .split_once('=')
            .with_context(|| format!("{text:?} is not key=value"))?;
        Ok((key.trim().to_owned(), value.trim().to_owned()))
    };
    let overrides: Vec<Override> = golden.set.iter().map(pair).collect::<Result<_, _>>()?;
    let scene = load(&directory.join(&golden.scene), &overrides)?;
    let settings = Settings::resolve(&scene.render);
    let outcome = render_unwatched(&scene, &settings)?;
    let bad = outcome.film.bad_samples();
    if bad > 0 {
        bail!("{bad} samples were NaN or infinite");
    }
    Ok((
        Picture::of_film(&outcome.film).described(&scene, &settings, outcome.passes),
        settings.integrator,
    ))
}
