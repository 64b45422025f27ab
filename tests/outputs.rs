//! What the command writes, and what it says where it cannot.

use std::process::Command;
use tempfile::TempDir;

/// A lamp that fills the picture, and a floor that nothing sees.
const SCENE: &str = r#"
background = [0, 0, 0]
[camera]
eye = [0, 0, 1]
target = [0, 0, 0]
vertical_fov_deg = 40
[film]
width = 4
height = 3
[material.lamp]
emission = { radiance = [2, 2, 2] }
[material.grey]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[[quad]]
corner = [-2, -2, 0]
edge_u = [4, 0, 0]
edge_v = [0, 4, 0]
material = "lamp"
[[plane]]
point = [0, -9, 0]
normal = [0, 1, 0]
material = "grey"
"#;

/// A folder with the scene, where the program works.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("scene.toml"), SCENE).expect("the scene is written");
        Self(folder)
    }

    /// Exit code and what is said on stderr, for words without blanks.
    fn run(&self, words: &str) -> (Option<i32>, String) {
        let done = Command::new(env!("CARGO_BIN_EXE_photolathe"))
            .args(words.split_whitespace())
            .current_dir(self.0.path())
            .output()
            .expect("the program starts");
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        (done.status.code(), said)
    }

    fn has(&self, name: &str) -> bool {
        self.0.path().join(name).exists()
    }
}

/// A name that no file can have, though its directory takes files: this shows at the last moment.
fn endless(extension: &str) -> String {
    format!("{}.{extension}", "x".repeat(300))
}

#[test]
fn a_finished_render_is_kept_though_another_file_cannot_be_written() {
    let place = Place::new();
    let render = "render scene.toml --integrator path --spp 1";
    let (code, said) = place.run(&format!("{render} -o a.exr --stats {}", endless("json")));
    assert_eq!(code, Some(2), "{said}");
    assert!(place.has("a.exr") && said.contains("xxx.json"), "{said}");

    let (one, other) = (endless("exr"), endless("png"));
    let (code, said) = place.run(&format!(
        "{render} -o {one} -o b.exr -o {other} --stats b.json"
    ));
    assert_eq!(code, Some(2), "{said}");
    assert!(place.has("b.exr") && place.has("b.json"), "{said}");
    assert!(
        said.contains("xxx.exr") && said.contains("xxx.png"),
        "{said}"
    );
}

#[test]
fn files_that_cannot_be_written_are_refused_before_the_first_pass() {
    let place = Place::new();
    let render = "render scene.toml --integrator path --spp 1 -o a.exr";
    for more in [
        "-o scene.toml/below-a-file.png",
        "--stats scene.toml/below-a-file.json",
        "--stats .",
    ] {
        let (code, said) = place.run(&format!("{render} {more}"));
        assert_eq!(code, Some(2), "{said}");
        assert!(!place.has("a.exr"), "{more}: {said}");
    }
    let part = "render scene.toml --integrator pppm --pass-range 0..1 -o scene.toml/a.part";
    let (code, said) = place.run(part);
    assert_eq!(code, Some(2), "{said}");
    assert!(!said.contains("estimated error"), "{said}");
    let left = std::fs::read_dir(place.0.path()).expect("a folder").count();
    assert_eq!(left, 1, "only the scene");
}

/// By `render` and by `merge`; the largest number that fits is written without a word.
#[test]
fn a_picture_with_infinite_pixels_is_written_but_told() {
    let place = Place::new();
    let lamp = |radiance: &str| format!("--set material.lamp.emission.radiance=[{radiance},1,1]");
    for (radiance, expected) in [("1e40", Some(2)), ("3.4e38", Some(0))] {
        let lamp = lamp(radiance);
        let common = format!("render scene.toml --photons 0 --passes 2 {lamp}");
        let told = |(code, said): (Option<i32>, String)| {
            assert_eq!(code, expected, "{said}");
            assert_eq!(said.contains("12 pixels"), expected == Some(2), "{said}");
        };
        told(place.run(&format!("{common} --integrator path --spp 2 -o a.exr")));
        told(place.run(&format!("{common} --integrator pppm -o b.exr -o b.png")));
        let (code, said) = place.run(&format!(
            "{common} --integrator pppm --pass-range 0..2 -o c.part"
        ));
        assert_eq!(code, Some(0), "{said}");
        told(place.run("merge c.part -o c.exr"));
        for name in ["a.exr", "b.exr", "b.png", "c.exr"] {
            assert!(place.has(name));
            std::fs::remove_file(place.0.path().join(name)).expect("a file");
        }
    }
}

#[test]
fn a_file_that_cannot_be_read_or_written_is_told_once() {
    let place = Place::new();
    let long = endless("exr");
    for command in [
        "compare absent.exr absent.exr".to_owned(),
        "merge absent.part -o a.exr".to_owned(),
        "render scene.toml --reference absent.exr".to_owned(),
        "render scene.toml --stats scene.toml/below".to_owned(),
        format!("render scene.toml --integrator path --spp 1 -o {long}"),
    ] {
        let (code, said) = place.run(&command);
        assert_eq!(code, Some(2), "{said}");
        assert_eq!(said.matches("os error").count(), 1, "{said}");
    }
}

#[test]
fn flags_have_the_limits_of_the_file() {
    let place = Place::new();
    let render = "render scene.toml --integrator pppm --photons 0 --passes 1 -o a.exr";
    for (key, most, beyond) in [
        ("radius", "1e60", "1e61"),
        ("threshold", "1e60", "1e200"),
        ("time", "1e60", "inf"),
        ("threads", "1", "1025"),
    ] {
        for (value, expected) in [(most, Some(0)), (beyond, Some(2))] {
            for set in [
                format!("--{key} {value}"),
                format!("--set render.{key}={value}"),
            ] {
                let (code, said) = place.run(&format!("{render} {set}"));
                assert_eq!(code, expected, "{set}: {said}");
            }
        }
    }
}

#[test]
fn a_background_that_photons_cannot_start_from_is_told_with_its_place() {
    let place = Place::new();
    let expected = "expected [0, 0, 0] for photon mapping";
    let white = SCENE.replace("background = [0, 0, 0]", "background = [1, 1, 1]");
    std::fs::write(place.0.path().join("white.toml"), white).expect("the scene is written");
    for (words, told) in [
        ("white.toml", "white.toml:2:14: background = [1, 1, 1]: "),
        (
            "scene.toml --set background=[0,0,1]",
            "--set background=[0,0,1]: ",
        ),
    ] {
        let (code, said) = place.run(&format!("render {words} --integrator sppm -o a.exr"));
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(&format!("{told}{expected}")), "{said}");
        let (code, said) = place.run(&format!(
            "render {words} --integrator path --spp 1 -o a.exr"
        ));
        assert_eq!(code, Some(0), "{said}");
    }
}
