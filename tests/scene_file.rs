//! What the scene file promises: every key works, and every violation is one error that names its place and what was expected.

use glam::{DVec2, DVec3};
use photolathe::geometry::revolution::Solver;
use photolathe::geometry::revolution::newton::{NewtonSettings, StartPolicy};
use photolathe::geometry::shape::Shape;
use photolathe::scene::Scene;
use photolathe::scene::file::{MAX_FILE_BYTES, Override, load, parse};
use photolathe::scene::light::Light;
use photolathe::scene::material::{Emission, Pattern, Side};
use photolathe::scene::options::{
    Antialias, IndexName, Integrator, Kernel, Rule, Sampler, SolverName,
};
use proptest::prelude::*;
use std::path::Path;

const BASE: &str = "[camera]
eye = [0, 0, 5]
target = [0, 0, 0]
vertical_fov_deg = 30
[film]
width = 4
height = 3
[material.m]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[material.glass]
dielectric = { ior = 1.5 }
[material.lamp]
emission = { radiance = [1, 1, 1] }
";

fn read(text: &str) -> Result<Scene, String> {
    parse(text, "x.toml", Path::new("."), &[]).map_err(|error| error.to_string())
}

fn overridden(text: &str, overrides: &[(&str, &str)]) -> Result<Scene, String> {
    let overrides: Vec<Override> = overrides
        .iter()
        .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
        .collect();
    parse(text, "x.toml", Path::new("."), &overrides).map_err(|error| error.to_string())
}

/// Asserts that `marked`, without its mark ¦, is refused with `message` at the place of the mark.
fn refused(marked: &str, message: &str) {
    let (before, after) = marked.split_once('¦').expect("a mark");
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    let expected = format!("x.toml:{line}:{column}: {message}");
    let found = read(&format!("{before}{after}"));
    assert_eq!(found.map(|_| ()), Err(expected), "in\n{marked}");
}

#[test]
fn every_violation_is_one_error_at_its_word() {
    let text = include_str!("data/refused_scenes.txt");
    let mut cases = 0;
    for case in text.split("\n\n").skip(2) {
        let Some((scene, message)) = case.split_once("\n=> ") else {
            assert!(
                case.starts_with("## "),
                "neither a case nor a heading: {case}"
            );
            continue;
        };
        match scene.strip_prefix("(whole)\n") {
            Some(whole) => refused(whole, message.trim_end()),
            None => refused(&format!("{BASE}{scene}\n"), message.trim_end()),
        }
        cases += 1;
    }
    assert!(cases >= 130, "{cases} cases");
}

/// The rules of single values: the text of the file after [`BASE`], and the message.
const EVERYTHING: &str = include_str!("data/everything.toml");

#[test]
fn every_key_of_a_good_file_arrives() {
    let scene = read(EVERYTHING).unwrap();
    assert_eq!(scene.title, "all of it");
    assert_eq!(scene.background, DVec3::new(0.1, 0.2, 0.3));
    assert_eq!((scene.film.width, scene.film.height), (7, 9));
    assert_eq!(scene.camera.eye(), DVec3::new(0.0, 0.0, 5.0));
    assert_eq!(scene.camera.lens_radius(), 0.25);
    let through_focus = [[0.1, 0.2], [0.9, 0.4]].map(|lens| {
        let ray = scene
            .camera
            .ray(DVec2::new(3.5, 4.5), DVec2::new(7.0, 9.0), lens);
        ray.at(-7.0 / ray.direction.z)
    });
    assert!(
        through_focus
            .iter()
            .all(|point| (*point - DVec3::new(0.0, 0.0, -2.0)).length() < 1e-13)
    );

    let render = &scene.render;
    assert_eq!(render.integrator, Some(Integrator::Sppm));
    assert_eq!(
        (render.spp, render.passes, render.photons),
        (Some(3), Some(4), Some(0))
    );
    assert_eq!(
        (render.time, render.alpha, render.radius),
        (Some(1.5), Some(0.5), Some(0.1))
    );
    assert_eq!(
        (render.rule, render.aa, render.index),
        (
            Some(Rule::Global),
            Some(Antialias::Uniform),
            Some(IndexName::KdtreeCycling)
        )
    );
    assert_eq!(render.kernel, Some(Kernel::FourthOrder));
    assert_eq!(render.sampler, Some(Sampler::Sobol));
    assert_eq!(render.solver, Some(SolverName::Newton));
    assert_eq!(
        (render.threads, render.seed, render.max_depth),
        (Some(2), Some(42), Some(0))
    );
    let newton = NewtonSettings {
        starts: 11,
        policy: StartPolicy::Stratified,
        iterations: 12,
        damping: 0.7,
        tolerance: 1e-7,
        seed: 5,
    };
    assert_eq!(scene.solver, Solver::Newton(newton));

    let [board, glass, lamp, wood] = &scene.materials[..] else {
        panic!("four materials");
    };
    let Some(Pattern::Checker { colors, repeat }) = &board.diffuse else {
        panic!("a checker");
    };
    assert_eq!(colors[1], DVec3::new(0.2, 0.2, 0.25));
    assert_eq!(*repeat, DVec2::new(4.0, 2.0));
    assert_eq!(board.mirror, Some(DVec3::new(0.1, 0.1, 0.2)));
    let dielectric = glass.dielectric.unwrap();
    assert_eq!(
        (dielectric.ior, dielectric.absorption),
        (2.0, DVec3::new(0.0, 1.0, 2.0))
    );
    let emission = Emission {
        radiance: DVec3::splat(10.0),
        side: Side::Both,
    };
    assert_eq!(lamp.emission, Some(emission));
    let Some(Pattern::Texture { texture, repeat }) = &wood.diffuse else {
        panic!("a texture");
    };
    assert_eq!((texture.width, texture.height), (256, 256));
    assert_eq!(*repeat, DVec2::new(3.0, 1.0));

    let names: Vec<&str> = scene
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    assert_eq!(
        names,
        ["revolution[0]", "ball", "quad[0]", "plane[0]", "disc[0]"]
    );
    assert_eq!(
        scene
            .objects
            .iter()
            .map(|object| object.material)
            .collect::<Vec<_>>(),
        [1, 1, 0, 3, 2]
    );
    assert!(scene.objects[3].bounds.is_none());
    let Shape::Disc(disc) = &scene.objects[4].shape else {
        panic!("a disc");
    };
    assert_eq!(disc.normal, DVec3::NEG_Y);
    // The axis +y of the profile turns to -x, is scaled by 2, and stands at the translation.
    let bounds = scene.objects[0].bounds.unwrap();
    let along = [bounds.min.x + 5.0, bounds.max.x - 1.0];
    assert!(along.iter().all(|error| error.abs() < 1e-6), "{bounds:?}");

    let [
        Light::Point { intensity, .. },
        Light::Beam {
            direction,
            irradiance,
            ..
        },
        Light::Area { object, .. },
    ] = scene.lights.all()
    else {
        panic!("a point, a beam and a lamp");
    };
    assert_eq!(*intensity, DVec3::new(4.0, 5.0, 6.0));
    assert_eq!(*direction, DVec3::NEG_Y);
    assert_eq!(*irradiance, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(*object, 4);
}

#[test]
fn silent_files_get_the_defaults() {
    let scene = read(BASE).unwrap();
    assert_eq!(scene.title, "");
    assert_eq!(scene.background, DVec3::ZERO);
    assert_eq!(scene.camera.lens_radius(), 0.0);
    assert_eq!(scene.solver, Solver::Bernstein);
    assert!(scene.lights.dark());
}

#[test]
fn overrides_reach_every_kind_of_key() {
    let scene = overridden(
        EVERYTHING,
        &[
            ("film.width", "64"),
            ("title", "a bare string"),
            ("sphere.0.radius", "2"),
            ("material.board.diffuse.checker.1", "[0.5, 0, 0]"),
            ("material.lamp.diffuse.reflectance", "[1,0,0]"),
            (
                "material.\"new one\"",
                "{ mirror = { reflectance = [1, 1, 1] } }",
            ),
            ("quad.0.material", "new one"),
            ("revolution.0.profile.1.3", "[0, 4]"),
            ("solver.starts", "99"),
            ("render.solver", "exact"),
            ("camera.focus_distance", "3.5"),
            ("camera.focus_distance", "4.5"),
        ],
    )
    .unwrap();
    assert_eq!(scene.film.width, 64);
    assert_eq!(scene.title, "a bare string");
    assert_eq!(scene.solver, Solver::Exact);
    let Shape::Sphere(sphere) = &scene.objects[1].shape else {
        panic!("a sphere");
    };
    assert_eq!(sphere.radius, 2.0);
    assert_eq!(
        scene.materials[scene.objects[2].material].mirror,
        Some(DVec3::ONE)
    );
    let Shape::Revolution(revolution) = &scene.objects[0].shape else {
        panic!("a revolution");
    };
    assert_eq!(revolution.profile().pieces()[1].height[3], 4.0);
    let newton = overridden(EVERYTHING, &[("solver.starts", "99")]).unwrap();
    assert!(matches!(newton.solver, Solver::Newton(settings) if settings.starts == 99));
    let render = overridden(BASE, &[("render.integrator", "path")])
        .unwrap()
        .render;
    assert_eq!(render.integrator, Some(Integrator::Path));
}

#[test]
fn an_override_that_breaks_is_named() {
    for (key, value, message) in [
        (
            "film.width",
            "0",
            "expected an integer from 1 to 4294967295",
        ),
        (
            "film.width",
            "wide",
            "expected an integer from 1 to 4294967295",
        ),
        (
            "film.widht",
            "3",
            "widht: unknown key in [film]: expected width or height",
        ),
        (
            "camera.eye",
            "[0, nan, 0]",
            "eye[1] = nan: expected a finite number",
        ),
        ("sphere.4.radius", "1", "4: expected an index from 0 to 0"),
        (
            "sphere.first.radius",
            "1",
            "first: expected an index from 0 to 0",
        ),
        (
            "sphere.0.radius.x",
            "1",
            "x: expected nothing: what stands before it is neither a table nor a list",
        ),
        (
            "camera.target",
            "[0, 0, 5]",
            "expected a point away from eye",
        ),
        (
            "quad.0.material",
            "oak",
            "expected the name of a material: one of board, glass, lamp, wood",
        ),
        (
            "",
            "1",
            "expected a path like film.width or sphere.0.radius before the =",
        ),
        (
            "film.",
            "1",
            "expected a path like film.width or sphere.0.radius before the =",
        ),
        (
            "a=1\nb",
            "1",
            "expected a path like film.width or sphere.0.radius before the =",
        ),
    ] {
        let found = overridden(EVERYTHING, &[(key, value)]).unwrap_err();
        assert_eq!(found, format!("--set {key}={value}: {message}"));
    }
    // Here the value at fault is the table in the file that now holds two kinds.
    let found = overridden(
        EVERYTHING,
        &[("material.wood.diffuse.reflectance", "[1, 1, 1]")],
    )
    .unwrap_err();
    assert!(found.starts_with("x.toml:47:11: diffuse = {"), "{found}");
    assert!(
        found.ends_with("expected exactly one of reflectance, texture, checker (after --set material.wood.diffuse.reflectance=[1, 1, 1])"),
        "{found}"
    );
}

#[test]
fn the_file_by_itself_must_be_valid_before_overrides() {
    let broken = BASE.replace("width = 4", "width = 0");
    let found = overridden(&broken, &[("film.width", "4")]).unwrap_err();
    assert!(found.starts_with("x.toml:6:9: width = 0:"), "{found}");
}

#[test]
fn two_overrides_may_pass_through_a_state_that_alone_is_wrong() {
    let swapped = overridden(
        BASE,
        &[("camera.target", "[0, 0, 5]"), ("camera.eye", "[0, 0, 0]")],
    );
    assert_eq!(swapped.unwrap().camera.eye(), DVec3::ZERO);
}

#[test]
fn the_hash_follows_text_overrides_and_texture_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let png = directory.path().join("a.png");
    let text = format!("{BASE}[material.t]\ndiffuse = {{ texture = \"a.png\" }}\n");
    let hash = |text: &str, overrides: &[Override]| {
        parse(text, "x.toml", directory.path(), overrides)
            .unwrap()
            .hash
    };
    std::fs::copy("materials/wood.png", &png).unwrap();
    let first = hash(&text, &[]);
    assert_eq!(first, hash(&text, &[]));
    assert_ne!(first, hash(&format!("{text}# more\n"), &[]));
    assert_ne!(first, hash(&text, &[("film.width".into(), "5".into())]));
    std::fs::copy("materials/tiles.png", &png).unwrap();
    assert_ne!(first, hash(&text, &[]));
    std::fs::write(&png, b"not a picture").unwrap();
    let found = parse(&text, "x.toml", directory.path(), &[])
        .unwrap_err()
        .to_string();
    assert!(
        found.starts_with(
            "x.toml:15:23: texture = \"a.png\": expected a PNG file that can be a texture"
        ),
        "{found}"
    );
}

#[test]
fn files_that_are_no_text_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.toml");
    let message = || load(&path, &[]).unwrap_err().to_string();
    assert!(
        message().ends_with("expected a readable scene file"),
        "{}",
        message()
    );
    std::fs::write(&path, b"title = 1\nb = \"\xff\"").unwrap();
    assert!(
        message().ends_with("x.toml:2:6: byte 0xff: expected UTF-8 text"),
        "{}",
        message()
    );
    std::fs::File::create(&path)
        .unwrap()
        .set_len(MAX_FILE_BYTES + 1)
        .unwrap();
    assert!(
        message().ends_with("expected a scene file of at most 16777216 bytes"),
        "{}",
        message()
    );
    let error = load(directory.path(), &[]).unwrap_err().to_string();
    assert!(error.ends_with("expected a readable scene file"), "{error}");
}

/// Nesting is limited where it is read, so that no depth of it exhausts the stack.
#[test]
fn deep_nesting_is_refused() {
    for deep in [
        format!("x = {}1{}", "[".repeat(100_000), "]".repeat(100_000)),
        format!("x = {}1{}", "{a = ".repeat(100_000), "}".repeat(100_000)),
        format!("{}a = 1", "a.".repeat(100_000)),
        format!("[{}a]\nb = 1", "a.".repeat(100_000)),
    ] {
        assert!(read(&deep).unwrap_err().starts_with("x.toml:1:"));
        let path = format!("{}a", "a.".repeat(100_000));
        assert!(
            overridden(BASE, &[(&path, "1")])
                .unwrap_err()
                .starts_with("--set ")
        );
        assert!(overridden(BASE, &[("title", &deep)]).is_ok());
    }
}

#[test]
fn every_scene_of_the_repository_loads() {
    let mut count = 0;
    let entries = ["scenes", "scenes/hard"].map(|folder| std::fs::read_dir(folder).unwrap());
    let paths = entries
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    for path in paths.filter(|path| path.is_file()) {
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# "), "{path:?} opens with a comment");
        assert!(
            text.contains("Known answer"),
            "{path:?} states what is known"
        );
        let scene = load(&path, &[]).unwrap();
        assert!(!scene.lights.dark(), "{path:?} is lit");
        count += 1;
    }
    assert!(count >= 17);
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    /// Damage to a good file is read as another good file, or refused at a line and column; it never panics.
    #[test]
    fn damaged_files_never_panic(
        at in 0..EVERYTHING.len(),
        cut in 0..12_usize,
        put in "[-\\[\\]{}=.,\"#0-9a-z\n é\u{0}]{0,6}",
    ) {
        let good = &EVERYTHING.replace("texture = \"materials/wood.png\"", "reflectance = [1, 1, 1]");
        let at = at.min(good.len());
        let start = (0..=at).rev().find(|&i| good.is_char_boundary(i)).unwrap_or(0);
        let end = (start + cut).min(good.len());
        let damaged = format!("{}{put}{}", &good[..start], &good[end..]);
        if let Err(message) = read(&damaged) {
            let mut parts = message.splitn(4, ':');
            prop_assert_eq!(parts.next(), Some("x.toml"));
            let line: usize = parts.next().unwrap().parse().unwrap();
            let column: usize = parts.next().unwrap().parse().unwrap();
            prop_assert!(line >= 1 && line <= damaged.lines().count() + 1 && column >= 1, "{}", message);
            prop_assert!(message.contains("expected") || message.contains("invalid"), "{}", message);
        }
    }

    /// Overrides of any text never panic, and one that is refused is named.
    #[test]
    fn strange_overrides_never_panic(key in "[a-z0-9.\"_ =\n]{0,12}|(camera|film|sphere|material)\\.[a-z0-9.]{0,8}", value in "\\PC{0,16}") {
        if let Err(message) = overridden(EVERYTHING, &[(&key, &value)]) {
            prop_assert!(message.starts_with("--set ") || message.starts_with("x.toml:"), "{}", message);
        }
    }
}
