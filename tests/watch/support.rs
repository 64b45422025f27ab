//! Scenes, and the command.

use photolathe::render::driver::{Outcome, render_unwatched};
use photolathe::render::settings::Settings;
use photolathe::scene::{self, Scene};
use std::path::PathBuf;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A grey floor, a glass ball and a lamp that faces the camera, seen by a pinhole unless `camera` says more. Corners see nothing.
pub(super) const MIXED: &str = r#"
[camera]
eye = [0, 1, 6]
target = [0, 1, 0]
vertical_fov_deg = 45
LENS
[film]
width = 24
height = 18
[material.grey]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[material.glass]
dielectric = { ior = 1.5 }
[material.lamp]
emission = { radiance = [1, 1, 1] }
[[quad]]
name = "floor"
corner = [-2, 0, 2]
edge_u = [4, 0, 0]
edge_v = [0, 0, -4]
material = "grey"
[[sphere]]
name = "ball"
center = [-0.7, 1, 0]
radius = 0.6
material = "glass"
[[quad]]
name = "lamp"
corner = [0.6, 0.4, 0]
edge_u = [1.1, 0.3, 0]
edge_v = [-0.3, 1.1, 0]
material = "lamp"
"#;

/// The scene of this text, with `lens` put into its camera.
pub(super) fn scene_of(text: &str, lens: &str) -> Scene {
    let folder = Folder::new(&text.replace("LENS", lens));
    scene::file::load(&folder.path("scene.toml"), &[]).expect("a valid scene")
}

/// Renders.
pub(super) fn rendered(scene: &Scene, settings: &Settings) -> Outcome {
    render_unwatched(scene, settings).expect("a picture")
}

/// A folder with a scene.
pub(super) struct Folder(TempDir);

impl Folder {
    /// With this scene in it.
    pub(super) fn new(scene: &str) -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        std::fs::write(folder.path("scene.toml"), scene.replace("LENS", ""))
            .expect("the scene is written");
        folder
    }

    /// A file in it.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// `photolathe` in this folder.
    pub(super) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_photolathe"));
        command.args(arguments).current_dir(self.0.path());
        command
    }

    /// What it says, with its exit code.
    pub(super) fn run(&self, arguments: &[&str]) -> (Option<i32>, String) {
        let Output { status, stderr, .. } = self
            .command(arguments)
            .output()
            .expect("the program starts");
        (status.code(), String::from_utf8_lossy(&stderr).into_owned())
    }
}
