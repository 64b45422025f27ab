//! What `render` draws and says of scenes at the limit: a picture and a clear remark, exit code 0, never a NaN.

use photolathe::image::exr;
use serde_json::Value;
use std::process::Command;

const BASE: &str = r#"
[camera]
eye = [0, 1, 4]
target = [0, 0.5, 0]
vertical_fov_deg = 40
[film]
width = 8
height = 6
[material.grey]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[material.glass]
dielectric = { ior = 1.5, absorption = [0.1, 0.2, 0.3] }
[material.bulb]
emission = { radiance = [5, 5, 5] }
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "grey"
[[sphere]]
name = "ball"
center = [0, 1, 0]
radius = 0.5
material = "glass"
"#;
const WITHIN: &str = "[[point_light]]\nposition = [0, 1, 0.1]\nintensity = [1, 1, 1]\n";
const ABOVE: &str = "[[point_light]]\nposition = [0, 3, 1]\nintensity = [1, 1, 1]\n";
const DARK: &str = "[[point_light]]\nposition = [0, 3, 1]\nintensity = [0, 0, 0]\n";
const BULB: &str =
    "[[sphere]]\nname = \"bulb\"\ncenter = [0, 1, 0]\nradius = 0.1\nmaterial = \"bulb\"\n";

/// What `render` left: the largest value of the picture, and what it said on stderr.
struct Left {
    brightest: f32,
    said: String,
    stats: Value,
}

fn render(more: &str, arguments: &[&str]) -> Left {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).display().to_string();
    let [scene, picture, stats] = ["scene.toml", "picture.exr", "stats.json"].map(file);
    std::fs::write(&scene, format!("{BASE}{more}")).expect("the scene is written");
    let base = [
        "render", &scene, "-o", &picture, "--stats", &stats, "--passes", "3",
    ];
    let done = Command::new(env!("CARGO_BIN_EXE_photolathe"))
        .args([&base[..], arguments].concat())
        .output()
        .expect("the program starts");
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}");
    let pixels = exr::read(picture.as_ref()).expect("a picture").rgb;
    assert_eq!(pixels.len(), 48);
    assert!(
        pixels
            .iter()
            .flatten()
            .all(|value| value.is_finite() && *value >= 0.0)
    );
    let stats = std::fs::read_to_string(stats).expect("counters");
    let stats: Value = serde_json::from_str(&stats).expect("JSON");
    assert_eq!(stats["bad_samples"], 0);
    Left {
        brightest: pixels.iter().flatten().copied().fold(0.0, f32::max),
        said,
        stats,
    }
}

const METHODS: [&str; 3] = ["ppm", "sppm", "pppm"];

#[test]
fn p1_no_photons_give_a_picture_and_a_remark() {
    for method in METHODS {
        let left = render(ABOVE, &["--integrator", method, "--photons", "0"]);
        assert_eq!(left.brightest, 0.0);
        assert!(left.said.contains("no photons are sent"), "{}", left.said);
        assert_eq!(left.stats["estimated_noise"], Value::Null);
    }
}

#[test]
fn p13_scenes_without_light_give_a_black_picture_and_a_remark() {
    for method in [&METHODS[..], &["path"]].concat() {
        for light in ["", DARK] {
            let left = render(light, &["--integrator", method]);
            assert_eq!(left.brightest, 0.0);
            assert!(
                left.said.contains("the scene has no light"),
                "{}",
                left.said
            );
        }
    }
}

#[test]
fn p11_a_light_inside_glass_lights_the_floor_by_photons_and_is_remarked_on() {
    for method in METHODS {
        for (light, named) in [(WITHIN, "point light"), (BULB, "lamp \"bulb\"")] {
            let left = render(light, &["--integrator", method, "--photons", "20000"]);
            assert!(left.brightest > 0.0);
            let said = &left.said;
            assert!(
                said.contains(named) && said.contains("inside the glass of \"ball\""),
                "{said}"
            );
        }
    }
    let left = render(WITHIN, &["--integrator", "path"]);
    assert!(left.said.contains("use ppm, sppm or pppm"), "{}", left.said);
}

#[test]
fn photon_maps_have_no_use_for_a_sampler_and_say_so() {
    for (method, said) in [
        ("ppm", true),
        ("sppm", true),
        ("pppm", true),
        ("path", false),
    ] {
        let left = render(ABOVE, &["--integrator", method, "--sampler", "sobol"]);
        let note = left.said.contains("--sampler has no meaning");
        assert_eq!(note, said, "{method}: {}", left.said);
    }
}

/// Also that a usual scene gets no remark.
#[test]
fn a_render_says_how_far_it_may_be_from_the_truth() {
    for method in METHODS {
        let left = render(ABOVE, &["--integrator", method]);
        assert!(left.said.contains("estimated error"), "{}", left.said);
        assert!(!left.said.contains("light") && !left.said.contains("photons"));
        let fixed = left
            .said
            .contains("beside the noise of 4 fixed camera samples a pixel");
        assert_eq!(fixed, method == "ppm", "{}", left.said);
        let noise = left.stats["estimated_noise"].as_f64().expect("a number");
        let bias = left.stats["estimated_bias"].as_f64().expect("a number");
        assert!(noise > 0.0 && noise < 1.0 && (0.0..1.0).contains(&bias));
    }
    let left = render(ABOVE, &["--integrator", "path"]);
    assert!(!left.said.contains("estimated error"));
    assert_eq!(left.stats["estimated_noise"], Value::Null);
}
