//! Goldens: pictures that must not change unnoticed.
//!
//! A golden is NAME.toml (scene, overrides, component, digests, reason) with NAME.exr beside it and, where its picture depends on
//! the seed, NAME.replicates.exr: block means under other seeds. A check renders the scene anew and says *identical* (the same
//! digest of the pixels), *equivalent* (bits differ, and replicates show no difference) or *different*. `golden/regression/` holds what this program draws; `golden/reference/` holds independent truth (a closed form,
//! another renderer) and is never accepted from our own output.

mod judge;
pub mod page;
mod replicates;

pub use judge::{Check, GoldenVerdict, LEVEL};
pub use replicates::REPLICATES;

use crate::image::exr;
use crate::image::file::write_atomically;
use crate::image::picture::Picture;
use anyhow::{Context as _, ensure};
use judge::by_bits;
use replicates::Subject;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

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
    /// Digest of the table of its replicates; absent if its picture does not depend on the seed, and for independent truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replicates: Option<String>,
    /// Why it was accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
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
    /// What it is a picture of: its .toml, if that can be read.
    pub golden: Option<Golden>,
    /// The new picture, if it could be rendered.
    pub picture: Option<Picture>,
    /// The accepted picture, if it could be read and is the one that was accepted.
    pub stored: Option<Picture>,
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
        golden: None,
        picture: None,
        stored: None,
        seconds: 0.0,
    };
    outcome.check = fill(directory, name, &mut outcome);
    outcome.seconds = start.elapsed().as_secs_f64();
    outcome
}

fn fill(directory: &Path, name: &str, outcome: &mut Outcome) -> anyhow::Result<Check> {
    let golden = outcome.golden.insert(read(directory, name)?).clone();
    outcome.component.clone_from(&golden.component);
    let digest = golden
        .digest
        .as_deref()
        .with_context(|| format!("{name} was never accepted"))?;
    let stored = outcome
        .stored
        .insert(accepted(&directory.join(format!("{name}.exr")), digest)?);
    let subject = Subject::load(directory, &golden)?;
    let picture = outcome.picture.insert(subject.draw()?);
    let check = by_bits(picture, stored)?;
    if check.verdict == GoldenVerdict::Identical {
        return Ok(check);
    }
    if is_independent(directory) {
        let fresh = subject.replicates()?.table;
        return Ok(check.by_truth(&fresh, stored, golden.margin));
    }
    let Some(digest) = &golden.replicates else {
        return Ok(check);
    };
    let path = replicates_of(directory, name);
    let stored = accepted(&path, digest)?;
    let fresh = subject.replicates()?.table;
    ensure!(
        (stored.width, stored.height) == (fresh.width, fresh.height),
        "{} has {} replicates of {} blocks instead of {} of {}",
        path.display(),
        stored.height,
        stored.width.saturating_sub(1),
        fresh.height,
        fresh.width - 1
    );
    Ok(check.by_replicates(&fresh, &stored))
}

fn replicates_of(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.replicates.exr"))
}

/// Reads a picture that must have this digest.
fn accepted(path: &Path, digest: &str) -> anyhow::Result<Picture> {
    let stored = exr::read(path)?;
    let found = stored.digest();
    ensure!(
        found == digest,
        "{} is not the picture that was accepted: its digest is {found}",
        path.display()
    );
    Ok(stored)
}

/// Whether a directory holds independent truth, which is never accepted from our own output.
pub fn is_independent(directory: &Path) -> bool {
    directory
        .file_name()
        .is_some_and(|folder| folder == REFERENCE)
}

/// Renders a golden and stores it, and its replicates if its picture depends on the seed, with the reason. Refused in a directory of
/// independent truth.
pub fn accept(directory: &Path, name: &str, reason: &str) -> anyhow::Result<Golden> {
    ensure!(
        !is_independent(directory),
        "{name} is in {}: independent truth is never accepted from our own output",
        directory.display()
    );
    ensure!(
        !reason.trim().is_empty(),
        "a golden is accepted for a reason; say it with --reason"
    );
    let mut golden = read(directory, name)?;
    let subject = Subject::load(directory, &golden)?;
    let picture = subject.draw()?;
    let replicates = Some(subject.replicates()?).filter(|replicates| replicates.random);
    exr::write(&picture, &directory.join(format!("{name}.exr")))?;
    let path = replicates_of(directory, name);
    match &replicates {
        Some(replicates) => exr::write(&replicates.table, &path)?,
        None if path.exists() => std::fs::remove_file(&path)?,
        None => {}
    }
    golden.digest = Some(picture.digest());
    golden.replicates = replicates.map(|replicates| replicates.table.digest());
    golden.reason = Some(reason.trim().to_owned());
    write(directory, name, &golden)?;
    Ok(golden)
}

/// Writes a .toml anew; the comment at its top stays.
fn write(directory: &Path, name: &str, golden: &Golden) -> anyhow::Result<()> {
    let path = directory.join(format!("{name}.toml"));
    let old = std::fs::read_to_string(&path)?;
    let comment: String = old
        .lines()
        .take_while(|line| line.starts_with('#'))
        .flat_map(|line| [line, "\n"])
        .collect();
    let text = comment + &toml::to_string_pretty(golden)?;
    write_atomically(&path, text.as_bytes())?;
    Ok(())
}

fn read(directory: &Path, name: &str) -> anyhow::Result<Golden> {
    let path = directory.join(format!("{name}.toml"));
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    toml::from_str(&text).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "\
        [camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\nvertical_fov_deg = 30\n[film]\nwidth = 12\nheight = 12\n\
        [render]\nintegrator = \"path\"\nspp = 4\n[material.wall]\ndiffuse = { reflectance = [0.5, 0.5, 0.5] }\n\
        [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"wall\"\n\
        [[point_light]]\nposition = [2, 3, 5]\nintensity = [20, 20, 20]\n";
    const TOML: &str = "# Why this scene.\nscene = \"scene.toml\"\nset = [\"film.width=16\"]\ncomponent = \"path\"\n";

    fn directory(kind: &str) -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join(kind);
        std::fs::create_dir(&path).unwrap();
        std::fs::write(
            path.join("ball.toml"),
            TOML.replace("scene.toml", "../scene.toml"),
        )
        .unwrap();
        std::fs::write(root.path().join("scene.toml"), SCENE).unwrap();
        (root, path)
    }

    #[test]
    fn a_golden_is_accepted_with_its_reason_and_then_guards_its_picture() {
        let (root, path) = directory("regression");
        let check_ball = || check_all(&path).remove(0).check;
        assert!(
            check_ball()
                .unwrap_err()
                .to_string()
                .contains("never accepted")
        );
        assert!(accept(&path, "ball", " ").is_err());
        accept(&path, "ball", "first picture").unwrap();
        let text = std::fs::read_to_string(path.join("ball.toml")).unwrap();
        assert!(
            text.starts_with("# Why this scene.\n") && text.contains("first picture"),
            "{text}"
        );
        assert_eq!(check_ball().unwrap().verdict, GoldenVerdict::Identical);

        let set = |from: &str, to: &str| {
            let scene = SCENE.replace(from, to);
            assert_ne!(scene, SCENE);
            std::fs::write(root.path().join("scene.toml"), scene).unwrap();
            check_ball().unwrap()
        };
        let other_seed = set("spp = 4", "spp = 4\nseed = 5");
        assert_eq!(other_seed.verdict, GoldenVerdict::Equivalent);
        assert_eq!(other_seed.replicates, REPLICATES);
        // Far below what other random numbers would show: the pairs share theirs.
        let brighter = set("0.5, 0.5, 0.5", "0.5005, 0.5005, 0.5005");
        assert_eq!(brighter.verdict, GoldenVerdict::Different);
        assert!(brighter.detectable < 0.001 && other_seed.detectable > 0.001);
        std::fs::write(root.path().join("scene.toml"), "nonsense").unwrap();
        assert!(check_ball().is_err());
    }

    #[test]
    fn a_stored_picture_or_table_that_was_not_accepted_is_refused() {
        let (root, path) = directory("regression");
        accept(&path, "ball", "first picture").unwrap();
        let other_seed = SCENE.replace("spp = 4", "spp = 4\nseed = 5");
        std::fs::write(root.path().join("scene.toml"), other_seed).unwrap();
        let refused = || check_all(&path).remove(0).check.unwrap_err().to_string();
        let spoil = |name: &str, spoil: &dyn Fn(&mut Picture)| {
            let mut picture = exr::read(&path.join(name)).unwrap();
            spoil(&mut picture);
            exr::write(&picture, &path.join(name)).unwrap();
            picture.digest()
        };
        let digest = spoil("ball.replicates.exr", &|table| {
            table.height -= 1;
            table.rgb.truncate(table.width * table.height);
        });
        assert!(refused().contains("not the picture that was accepted"));
        let mut golden = read(&path, "ball").unwrap();
        golden.replicates = Some(digest);
        write(&path, "ball", &golden).unwrap();
        assert!(refused().contains("has 31 replicates of 4 blocks instead of 32 of 4"));
        std::fs::remove_file(path.join("ball.replicates.exr")).unwrap();
        assert!(refused().contains("ball.replicates.exr"));
        spoil("ball.exr", &|picture| picture.rgb[0][0] += 1.0);
        assert!(refused().contains("not the picture that was accepted"));
    }

    /// A point light leaves nothing to chance; a wider lamp does.
    #[test]
    fn where_nothing_is_random_no_replicates_are_kept_and_every_bit_counts() {
        let (root, path) = directory("regression");
        let table = path.join("ball.replicates.exr");
        assert!(
            accept(&path, "ball", "random")
                .unwrap()
                .replicates
                .is_some()
        );
        assert!(table.exists());
        let whitted = SCENE.replace("\"path\"", "\"whitted\"");
        std::fs::write(root.path().join("scene.toml"), &whitted).unwrap();
        let golden = accept(&path, "ball", "whitted").unwrap();
        assert_eq!(golden.replicates, None);
        assert!(!table.exists());
        let moved = whitted.replace("[2, 3, 5]", "[2, 3, 5.000001]");
        std::fs::write(root.path().join("scene.toml"), moved).unwrap();
        let check = check_all(&path).remove(0).check.unwrap();
        assert_eq!(check.verdict, GoldenVerdict::Different);
        assert_eq!(check.replicates, 0);
    }

    #[test]
    fn independent_truth_is_never_accepted_from_our_own_output() {
        let (_root, path) = directory("reference");
        assert!(
            accept(&path, "ball", "looks good")
                .unwrap_err()
                .to_string()
                .contains("never accepted")
        );
        assert!(!path.join("ball.exr").exists());
    }
}
