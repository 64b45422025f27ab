//! Where and with what a run was made.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The machine and the program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor, or its architecture.
    pub cpu: String,
    /// Processors that this process may use.
    pub cores: usize,
    /// Operating system.
    pub os: String,
    /// Version of the program.
    pub version: String,
    /// Git commit of the working directory, if it is one; uncommitted changes do not show.
    pub commit: Option<String>,
}

impl Machine {
    /// This machine.
    pub fn here() -> Self {
        Self {
            cpu: cpu().unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            os: std::env::consts::OS.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: commit(Path::new(".")),
        }
    }
}

fn cpu() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The commit that HEAD of the repository at `directory` names.
fn commit(directory: &Path) -> Option<String> {
    let git = directory.join(".git");
    let git = match std::fs::read_to_string(&git) {
        // A linked work tree: a file that says where.
        Ok(text) => directory.join(text.strip_prefix("gitdir:")?.trim()),
        Err(_) => git,
    };
    let head = std::fs::read_to_string(git.join("HEAD")).ok()?;
    let Some(name) = head.trim().strip_prefix("ref: ") else {
        return Some(head.trim().to_owned());
    };
    let common = std::fs::read_to_string(git.join("commondir"));
    let roots: Vec<PathBuf> = std::iter::once(git.clone())
        .chain(common.ok().map(|text| git.join(text.trim())))
        .collect();
    roots
        .iter()
        .find_map(|root| loose(root, name).or_else(|| packed(root, name)))
}

fn loose(root: &Path, name: &str) -> Option<String> {
    Some(
        std::fs::read_to_string(root.join(name))
            .ok()?
            .trim()
            .to_owned(),
    )
}

fn packed(root: &Path, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(root.join("packed-refs")).ok()?;
    let line = text
        .lines()
        .find(|line| line.split_once(' ').is_some_and(|(_, found)| found == name))?;
    Some(line.split_once(' ')?.0.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commit_is_found_loose_packed_and_detached() {
        let directory = tempfile::tempdir().unwrap();
        let git = directory.path().join(".git");
        assert_eq!(commit(directory.path()), None);
        std::fs::create_dir_all(git.join("refs/heads")).unwrap();
        let write = |name: &str, text: &str| std::fs::write(git.join(name), text).unwrap();
        write("HEAD", "0123\n");
        assert_eq!(commit(directory.path()).as_deref(), Some("0123"));
        write("HEAD", "ref: refs/heads/main\n");
        write(
            "packed-refs",
            "# pack-refs\n4567 refs/heads/main\n89ab refs/tags/x\n",
        );
        assert_eq!(commit(directory.path()).as_deref(), Some("4567"));
        write("refs/heads/main", "cdef\n");
        assert_eq!(commit(directory.path()).as_deref(), Some("cdef"));
    }
}
