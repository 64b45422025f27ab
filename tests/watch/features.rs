//! Feature channels: closed forms, the samples they are means of, and what they must not change.

use super::support::{Folder, MIXED, rendered, scene_of};
use ::exr::prelude::{FlatSamples, read_first_flat_layer_from_file};
use glam::{DVec2, DVec3};
use photolathe::image::exr;
use photolathe::numeric::work::Work;
use photolathe::render::antialias::mask::mask;
use photolathe::render::driver::Outcome;
use photolathe::render::features::{Channel, Values};
use photolathe::render::settings::Settings;
use photolathe::render::whitted::Whitted;
use photolathe::scene::Scene;
use photolathe::scene::options::{Antialias, Aov, Hash, Integrator, RenderTable, Resampling, Rule};

const ALL: [Aov; 6] = [
    Aov::Depth,
    Aov::Normal,
    Aov::Object,
    Aov::PathHash,
    Aov::Radius,
    Aov::Photons,
];
const INTEGRATORS: [Integrator; 5] = [
    Integrator::Whitted,
    Integrator::Path,
    Integrator::Ppm,
    Integrator::Sppm,
    Integrator::Pppm,
];

fn settings(integrator: Integrator) -> Settings {
    Settings::resolve(&RenderTable {
        integrator: Some(integrator),
        spp: Some(3),
        passes: Some(4),
        photons: Some(300),
        aov: Some(ALL.to_vec()),
        ..RenderTable::default()
    })
}

fn channels(outcome: &Outcome) -> Vec<Channel> {
    let features = outcome.features.as_ref();
    features.expect("features were asked for").channels()
}

fn floats(channels: &[Channel], name: &str) -> Vec<f32> {
    match channels.iter().find(|channel| channel.name == name) {
        Some(Channel {
            values: Values::Float(values),
            ..
        }) => values.clone(),
        other => panic!("{name} is {other:?}"),
    }
}

/// What a ray through a pixel's centre sees of a unit sphere about the origin and the plane y = −1: depth along −z from `eye`, and the
/// normal.
fn sphere_over_plane(eye: DVec3, direction: DVec3) -> Option<(f64, DVec3, f32)> {
    let toward = eye.dot(direction);
    let discriminant = toward * toward - (eye.length_squared() - 1.0);
    if discriminant >= 0.0 {
        let point = eye - (toward + discriminant.sqrt()) * direction;
        return Some((eye.z - point.z, point, 0.0));
    }
    let t = -(1.0 + eye.y) / direction.y;
    (t > 0.0).then_some((eye.z - (eye.z + t * direction.z), DVec3::Y, 1.0))
}

#[test]
fn depth_normal_and_object_are_the_closed_forms_of_a_sphere_over_a_plane() {
    let scene = scene_of(
        r#"
[camera]
eye = [0, 0.5, 5]
target = [0, 0.5, 0]
vertical_fov_deg = 50
[film]
width = 33
height = 25
[material.grey]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "grey"
[[plane]]
point = [0, -1, 0]
normal = [0, 1, 0]
material = "grey"
"#,
        "",
    );
    let mut settings = settings(Integrator::Whitted);
    settings.aa = Antialias::None;
    let outcome = rendered(&scene, &settings);
    let channels = channels(&outcome);
    let [depth, x, y, z, object] =
        ["Z", "N.X", "N.Y", "N.Z", "object"].map(|name| floats(&channels, name));
    let mut kinds = [0; 3];
    for pixel in 0..33 * 25 {
        let film = DVec2::new((pixel % 33) as f64 + 0.5, (pixel / 33) as f64 + 0.5);
        let ray = scene.camera.ray(film, DVec2::new(33.0, 25.0), [0.5; 2]);
        let normal = DVec3::new(x[pixel].into(), y[pixel].into(), z[pixel].into());
        match sphere_over_plane(ray.origin, ray.direction) {
            Some((expected, expected_normal, of)) => {
                let depth = f64::from(depth[pixel]);
                assert!(
                    (depth / expected - 1.0).abs() < 1e-6,
                    "{pixel}: {depth} {expected}"
                );
                // Near the silhouette the sphere's normal turns fast.
                assert!((normal - expected_normal).length() < 1e-6, "{pixel}");
                assert_eq!(object[pixel], of);
                kinds[of as usize] += 1;
            }
            None => {
                assert_eq!(depth[pixel], f32::INFINITY);
                assert_eq!((normal, object[pixel]), (DVec3::ZERO, -1.0));
                kinds[2] += 1;
            }
        }
    }
    assert!(kinds.iter().all(|&pixels| pixels > 50), "{kinds:?}");
}

/// Settings of every renderer, and of every way in which `whitted` samples a pixel.
fn every_way() -> Vec<Settings> {
    let mut ways: Vec<Settings> = INTEGRATORS.map(settings).to_vec();
    for aa in [
        Antialias::None,
        Antialias::PathHash,
        Antialias::Uniform,
        Antialias::Contrast,
        Antialias::Variance,
    ] {
        for pattern in [
            Resampling::Two,
            Resampling::Three,
            Resampling::Four,
            Resampling::Adaptive,
        ] {
            ways.push(Settings {
                aa,
                pattern,
                ..settings(Integrator::Whitted)
            });
        }
    }
    ways
}

/// A lamp of radiance 1 that faces the camera, before nothing: the share of a pixel's samples that meet it is its colour, and its
/// normal's mean. They agree to the bit of a float only if both are made of the same samples.
#[test]
fn normals_are_means_over_the_very_samples_of_the_colours() {
    let lamp = MIXED.split("[[quad]]").collect::<Vec<_>>();
    let text = format!("{}[[quad]]{}", lamp[0], lamp[2]);
    for lens in ["", "lens_radius = 0.3\nfocus_distance = 4"] {
        let scene = scene_of(&text, lens);
        for settings in every_way() {
            let outcome = rendered(&scene, &settings);
            let shares = floats(&channels(&outcome), "N.Z");
            let mut between = 0;
            for (pixel, share) in outcome.film.pixels().iter().zip(shares) {
                let colour = pixel.mean().x as f32;
                assert!(
                    (colour - share).abs() < 1e-6,
                    "{colour} {share} {settings:?}"
                );
                between += usize::from(share > 0.0 && share < 1.0);
            }
            let sharp = lens.is_empty() && settings.aa == Antialias::None;
            let sharp = sharp && settings.integrator == Integrator::Whitted;
            assert!(sharp || between > 2, "{between} {settings:?}");
        }
    }
}

#[test]
fn features_change_no_bit_of_the_colours_and_threads_none_of_the_features() {
    for lens in ["", "lens_radius = 0.2\nfocus_distance = 4"] {
        let scene = scene_of(MIXED, lens);
        for with in every_way() {
            let without = Settings {
                aov: Vec::new(),
                ..with.clone()
            };
            let plain = rendered(&scene, &without);
            assert!(plain.features.is_none());
            let mut seen: Option<Vec<Channel>> = None;
            for threads in [1, 3] {
                let outcome = rendered(
                    &scene,
                    &Settings {
                        threads: Some(threads),
                        ..with.clone()
                    },
                );
                assert!(outcome.film == plain.film, "{with:?}");
                let channels = channels(&outcome);
                assert!(seen.as_ref().is_none_or(|before| *before == channels));
                seen = Some(channels);
            }
        }
    }
}

fn hashes(channels: &[Channel]) -> Vec<u64> {
    let half = |name: &str| match channels.iter().find(|channel| channel.name == name) {
        Some(Channel {
            values: Values::Whole(values),
            ..
        }) => values.clone(),
        other => panic!("{name} is {other:?}"),
    };
    let halves = half("path_hash.high")
        .into_iter()
        .zip(half("path_hash.low"));
    halves
        .map(|(high, low)| u64::from(high) << 32 | u64::from(low))
        .collect()
}

/// The pixels that antialiasing resamples are those whose hash in the file differs from a neighbour's.
#[test]
fn path_hashes_are_those_that_antialiasing_compares() {
    for lens in ["", "lens_radius = 0.2\nfocus_distance = 4"] {
        let scene = scene_of(MIXED, lens);
        for hash in [Hash::Original, Hash::Objects, Hash::Shadow, Hash::Texture] {
            let settings = Settings {
                hash,
                ..settings(Integrator::Whitted)
            };
            let outcome = rendered(&scene, &settings);
            let found = hashes(&channels(&outcome));
            let marked = mask(found.len(), 24, |a, b| found[a] != found[b]);
            let resampled: Vec<bool> = outcome
                .film
                .pixels()
                .iter()
                .map(|pixel| pixel.count() > 3.0)
                .collect();
            assert_eq!(marked, resampled, "{hash:?}");
            assert!(marked.contains(&true) && marked.contains(&false));
            for integrator in INTEGRATORS {
                let other = Settings {
                    integrator,
                    ..settings.clone()
                };
                assert_eq!(hashes(&channels(&rendered(&scene, &other))), found);
            }
        }
    }
    // All 64 bits.
    let scene = scene_of(MIXED, "");
    let settings = settings(Integrator::Path);
    let found = hashes(&channels(&rendered(&scene, &settings)));
    let whitted = Whitted::new(&scene, &settings);
    for (pixel, hash) in found.into_iter().enumerate() {
        let middle = DVec2::splat(0.5);
        let print = whitted.fingerprint(pixel, middle, &mut Work::default());
        assert_eq!(print.value(settings.hash), hash);
    }
}

fn with_photons(integrator: Integrator, rule: Rule) -> (Scene, Settings) {
    let text = MIXED.replace("center = [-0.7", "center = [-70");
    let settings = Settings {
        rule,
        radius: Some(0.3),
        ..settings(integrator)
    };
    (scene_of(&text, ""), settings)
}

#[test]
fn radius_and_photons_are_those_of_the_last_and_of_all_passes() {
    for integrator in [Integrator::Ppm, Integrator::Sppm, Integrator::Pppm] {
        // r² shrinks by (i + α)/(i + 1) after pass i = 1, 2, 3.
        let mut shrinks = vec![1.0];
        for i in 1..4 {
            let i = f64::from(i);
            shrinks.push(shrinks[shrinks.len() - 1] * (i + 2.0 / 3.0) / (i + 1.0));
        }
        for (rule, shrinks) in [(Rule::Constant, vec![1.0]), (Rule::Global, shrinks)] {
            let (scene, settings) = with_photons(integrator, rule);
            let outcome = rendered(&scene, &settings);
            let channels = channels(&outcome);
            let radii = floats(&channels, "radius");
            let object = floats(&channels, "object");
            let counts = floats(&channels, "photons");
            let gathered: f64 = counts.iter().copied().map(f64::from).sum();
            assert_eq!(gathered, outcome.work.photons_gathered as f64);
            assert!(gathered > 500.0, "{gathered}");
            let mut on_floor = 0;
            for (pixel, &radius) in radii.iter().enumerate() {
                let is =
                    |shrink: &f64| (f64::from(radius) / (0.3 * shrink.sqrt()) - 1.0).abs() < 1e-6;
                // At edges the last pass may have had no hit point, but an earlier one; samples that stay always have theirs.
                let last = &shrinks[shrinks.len() - 1..];
                let possible = match integrator {
                    Integrator::Ppm => last,
                    _ => &shrinks[..],
                };
                assert!(radius == 0.0 || possible.iter().any(is), "{radius}");
                assert!(counts[pixel] == 0.0 || radius > 0.0);
                on_floor += usize::from(object[pixel] == 1.0 && last.iter().any(is));
            }
            assert!(on_floor > 30, "{on_floor}");
        }
    }
}

#[test]
fn the_file_has_the_channels_of_the_names_and_is_compared_as_any_other() {
    let folder = Folder::new(MIXED);
    let render = |more: &[&str]| {
        let base = [
            "render",
            "scene.toml",
            "--integrator",
            "sppm",
            "--passes",
            "2",
            "--photons",
            "500",
        ];
        folder.run(&[&base[..], more].concat())
    };
    let asked = "--aov=photons,depth,normal,object,path_hash,radius,depth";
    let (code, said) = render(&[asked, "-o", "with.exr"]);
    assert_eq!(code, Some(0), "{said}");
    let (code, said) = render(&["-o", "plain.exr"]);
    assert_eq!(code, Some(0), "{said}");
    let names = |name: &str| -> Vec<(String, bool)> {
        let image = read_first_flat_layer_from_file(folder.path(name)).expect("a picture");
        let list = image.layer_data.channel_data.list;
        let whole = |samples: &FlatSamples| matches!(samples, FlatSamples::U32(_));
        list.iter()
            .map(|channel| (channel.name.to_string(), whole(&channel.sample_data)))
            .collect()
    };
    let floats = ["B", "G", "N.X", "N.Y", "N.Z", "R", "Z", "object"].map(|name| (name, false));
    let bits = [("path_hash.high", true), ("path_hash.low", true)];
    let rest = [
        "photons",
        "radius",
        "samples",
        "variance.B",
        "variance.G",
        "variance.R",
    ]
    .map(|name| (name, false));
    let all = floats.into_iter().chain(bits).chain(rest);
    let all: Vec<(String, bool)> = all.map(|(name, whole)| (name.to_owned(), whole)).collect();
    assert_eq!(names("with.exr"), all);
    let [with, plain] =
        ["with.exr", "plain.exr"].map(|name| exr::read(&folder.path(name)).unwrap());
    assert_eq!(with, plain);
    let compared = folder
        .command(&["compare", "with.exr", "plain.exr"])
        .output()
        .unwrap();
    assert!(compared.status.success());
    assert!(String::from_utf8_lossy(&compared.stdout).contains("\"identical\": true"));
}

#[test]
fn what_cannot_be_written_is_said_and_what_is_not_known_refused() {
    let folder = Folder::new(MIXED);
    let render = |more: &[&str]| {
        let base = ["render", "scene.toml", "--spp", "1", "--passes", "1"];
        folder.run(&[&base[..], more].concat())
    };
    let (code, said) = render(&["--aov", "depth,colour", "-o", "a.exr"]);
    assert_eq!(code, Some(2));
    assert!(
        said.contains("colour") && said.contains("path_hash"),
        "{said}"
    );
    let (code, said) = render(&["--set", "render.aov=[\"depth\", \"colour\"]", "-o", "a.exr"]);
    assert_eq!(code, Some(2));
    assert!(
        said.contains("colour") && said.contains("path_hash"),
        "{said}"
    );
    let part = ["--integrator", "pppm", "--pass-range", "0..1"];
    let (code, said) = render(&[&part[..], &["--aov", "depth"]].concat());
    assert_eq!(code, Some(2));
    assert!(
        said.contains("--aov") && said.lines().count() == 1,
        "{said}"
    );
    let (code, said) = render(&[
        "--integrator",
        "path",
        "--aov",
        "depth,radius",
        "-o",
        "a.exr",
    ]);
    assert_eq!(code, Some(0));
    assert!(
        said.contains("radius") && said.contains("left out"),
        "{said}"
    );
    let (code, said) = render(&["--integrator", "path", "--aov", "depth", "-o", "a.png"]);
    assert_eq!(code, Some(0));
    assert!(said.contains(".exr"), "{said}");
    let (code, said) = render(&[
        "--integrator",
        "path",
        "--set",
        "render.aov=[\"object\"]",
        "-o",
        "b.exr",
    ]);
    assert_eq!(code, Some(0), "{said}");
    let image = read_first_flat_layer_from_file(folder.path("b.exr")).expect("a picture");
    let list = image.layer_data.channel_data.list;
    assert!(
        list.iter()
            .any(|channel| channel.name.to_string() == "object")
    );
}

/// A wall is seen from behind and a ball from within: the side that is seen has the normal.
#[test]
fn normals_are_those_of_the_side_that_is_seen() {
    let scene = |thing: &str| {
        let text = format!(
            "[camera]\neye = [0, 0, 2]\ntarget = [0, 0, 0]\nvertical_fov_deg = 1\n[film]\nwidth = 3\nheight = 3\n\
             [material.grey]\ndiffuse = {{ reflectance = [0.5, 0.5, 0.5] }}\n{thing}\nmaterial = \"grey\"\n"
        );
        scene_of(&text, "")
    };
    let disc = |z: i32| format!("[[disc]]\ncenter = [0, 0, 0]\nnormal = [0, 0, {z}]\nradius = 1");
    let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 3".to_owned();
    for thing in [disc(1), disc(-1), ball] {
        let outcome = rendered(&scene(&thing), &settings(Integrator::Path));
        let z = floats(&channels(&outcome), "N.Z");
        assert!(z.iter().all(|z| (z - 1.0).abs() < 1e-3), "{thing} {z:?}");
    }
}
