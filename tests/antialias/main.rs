//! Path-hash antialiasing: what the hash tells apart, and what the mask does with it.

mod cases;
mod patterns;

use glam::DVec2;
use photolathe::numeric::rng::mix;
use photolathe::numeric::work::Work;
use photolathe::render::antialias::fingerprint::{Event, Met, PathHash};
use photolathe::render::antialias::mask;
use photolathe::render::antialias::pattern::{Place, grid};
use photolathe::render::driver::render_unwatched;
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::render::whitted::Whitted;
use photolathe::scene::options::{Antialias, Integrator, RenderTable};
use photolathe::scene::{Scene, file};
use std::collections::HashMap;
use std::path::Path;

type Recorded = Vec<(Event, Option<Met>)>;
type Hasher = fn(&Recorded) -> u64;

fn ours(path: &Recorded) -> u64 {
    let mut hash = PathHash::default();
    for (depth, &(event, met)) in path.iter().enumerate() {
        hash.vertex(event, depth as u32, met);
    }
    hash.value()
}

/// The original's: 32 bits from 0, times 17 for reflection and 19 for refraction, diffuse hits left out.
fn original(path: &Recorded) -> u64 {
    let mut hash = 0_u32;
    for pair in path.windows(2) {
        let id = pair[0].1.map_or(235, |met| met.object as u32 + 1);
        let factor = if pair[1].0 == Event::Refract { 19 } else { 17 };
        hash = hash.wrapping_mul(factor).wrapping_add(id);
    }
    u64::from(hash)
}

/// Every path of up to `depth` specular events over a few objects, pieces and sides.
fn paths(depth: usize) -> Vec<Recorded> {
    let mut places: Vec<Option<Met>> = vec![None];
    for object in 0..4 {
        for piece in 0..3 {
            for front in [false, true] {
                places.push(Some(Met {
                    object,
                    piece,
                    front,
                }));
            }
        }
    }
    let mut all: Vec<Recorded> = places
        .iter()
        .map(|&met| vec![(Event::Camera, met)])
        .collect();
    let mut last = all.clone();
    for _ in 0..depth {
        let mut longer = Vec::new();
        for path in last
            .iter()
            .filter(|path| path.last().is_some_and(|vertex| vertex.1.is_some()))
        {
            for event in [Event::Mirror, Event::Reflect, Event::Refract] {
                for &met in &places {
                    longer.push(path.iter().copied().chain([(event, met)]).collect());
                }
            }
        }
        all.extend_from_slice(&longer);
        last = longer;
    }
    all
}

fn tells_all_paths_apart(hash: Hasher) -> bool {
    let paths = paths(2);
    assert!(paths.len() > 130_000, "{} paths", paths.len());
    let mut seen = HashMap::new();
    paths
        .iter()
        .all(|path| seen.insert(hash(path), path).is_none())
}

#[test]
fn different_paths_have_different_hashes() {
    assert!(tells_all_paths_apart(ours));
    assert!(!tells_all_paths_apart(original));
}

/// Glass sends its path both ways: a mirror seen in the reflection, or behind it, is the same list of vertices but for depth.
#[test]
fn the_depth_of_a_vertex_counts() {
    let met = |object| {
        Some(Met {
            object,
            piece: 0,
            front: true,
        })
    };
    let tree = |last_depth| {
        let mut hash = PathHash::default();
        hash.vertex(Event::Camera, 0, met(0));
        hash.vertex(Event::Reflect, 1, met(1));
        hash.vertex(Event::Mirror, last_depth, met(2));
        hash.value()
    };
    let values: Vec<u64> = (0..300).map(tree).collect();
    for (depth, value) in values.iter().enumerate() {
        assert!(!values[..depth].contains(value), "depth {depth}");
    }
}

fn brute_force_mask(hashes: &[u64], width: usize) -> Vec<bool> {
    let height = hashes.len() / width;
    let at = |x: usize, y: usize| hashes[y * width + x];
    let differs = |x: usize, y: usize| {
        let mut neighbours = Vec::new();
        if x > 0 {
            neighbours.push(at(x - 1, y));
        }
        if x + 1 < width {
            neighbours.push(at(x + 1, y));
        }
        if y > 0 {
            neighbours.push(at(x, y - 1));
        }
        if y + 1 < height {
            neighbours.push(at(x, y + 1));
        }
        neighbours.into_iter().any(|other| other != at(x, y))
    };
    (0..hashes.len())
        .map(|index| differs(index % width, index / width))
        .collect()
}

/// The pixels whose hash differs from that of a neighbour.
fn mask(hashes: &[u64], width: usize) -> Vec<bool> {
    mask::mask(hashes.len(), width, |a, b| hashes[a] != hashes[b])
}

#[test]
fn the_mask_is_that_of_the_four_neighbours() {
    for (case, (width, height)) in [(1, 1), (1, 9), (9, 1), (2, 2), (7, 5), (16, 16), (31, 3)]
        .into_iter()
        .enumerate()
    {
        for colours in [1, 2, 5] {
            let hashes: Vec<u64> = (0..width * height)
                .map(|i| mix(&[case as u64, colours, i as u64]) % colours)
                .collect();
            assert_eq!(
                mask(&hashes, width),
                brute_force_mask(&hashes, width),
                "{width}x{height}"
            );
            if colours == 1 {
                assert!(
                    mask(&hashes, width).iter().all(|&marked| !marked),
                    "a uniform picture has no edge"
                );
            }
        }
    }
    let checkers: Vec<u64> = (0..64).map(|i| (i % 8 + i / 8) % 2).collect();
    assert!(
        mask(&checkers, 8).iter().all(|&marked| marked),
        "a checkerboard of pixels is all edges"
    );
}

/// A sphere of each kind before a wall, on a floor that meets the wall: every kind of edge.
const SCENE: &str = r#"
[camera]
eye = [0, 1, 8]
target = [0, 0.8, 0]
vertical_fov_deg = 30
[film]
width = 40
height = 32
[material.grey]
diffuse = { reflectance = [0.6, 0.6, 0.6] }
[material.red]
diffuse = { reflectance = [0.8, 0.2, 0.2] }
[material.chrome]
mirror = { reflectance = [0.9, 0.9, 0.9] }
[material.glass]
dielectric = { ior = 1.5 }
[[sphere]]
name = "red"
center = [-1.2, 0.6, 0]
radius = 0.6
material = "red"
[[sphere]]
center = [0.1, 0.5, 0]
radius = 0.5
material = "chrome"
[[sphere]]
center = [1.2, 0.5, 0.5]
radius = 0.5
material = "glass"
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "grey"
[[quad]]
corner = [-3, 0, -2]
edge_u = [6, 0, 0]
edge_v = [0, 2, 0]
material = "grey"
[[point_light]]
position = [2, 5, 6]
intensity = [40, 40, 40]
"#;

fn scene(overrides: &[(&str, &str)]) -> Scene {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|&(key, value)| (key.to_owned(), value.to_owned()))
        .collect();
    file::parse(SCENE, "scene", Path::new("."), &overrides).expect("the scene is valid")
}

fn settings(aa: Antialias) -> Settings {
    Settings::resolve(&RenderTable {
        integrator: Some(Integrator::Whitted),
        aa: Some(aa),
        ..RenderTable::default()
    })
}

fn render(scene: &Scene, aa: Antialias) -> Film {
    render_unwatched(scene, &settings(aa))
        .expect("whitted renders every scene")
        .film
}

fn resampled(scene: &Scene) -> Vec<bool> {
    let settings = settings(Antialias::PathHash);
    let mut whitted = Whitted::new(scene, &settings);
    whitted.pass(0, &mut Film::new(scene.film));
    whitted
        .resampled()
        .expect("the first pass finds the mask")
        .to_vec()
}

#[test]
fn outside_the_mask_pixels_have_one_sample_and_inside_all_nine() {
    let scene = scene(&[]);
    let mask = resampled(&scene);
    let (none, hashed, uniform) = (
        render(&scene, Antialias::None),
        render(&scene, Antialias::PathHash),
        render(&scene, Antialias::Uniform),
    );
    assert!(mask.iter().any(|&marked| marked) && mask.iter().any(|&marked| !marked));
    for (index, &marked) in mask.iter().enumerate() {
        let expected = if marked { &uniform } else { &none };
        assert_eq!(
            hashed.pixels()[index],
            expected.pixels()[index],
            "pixel {index}, marked: {marked}"
        );
    }
}

/// The original's hash left diffuse hits out, so it could not see where two diffuse objects meet.
#[test]
fn the_edge_between_two_diffuse_objects_is_found() {
    let scene = scene(&[]);
    let mask = resampled(&scene);
    let hits = objects_behind_centres(&scene);
    let width = scene.film.width as usize;
    let mut edges = 0;
    for index in 0..hits.len() {
        if index % width + 1 < width && hits[index] != hits[index + 1] {
            edges += 1;
            assert!(
                mask[index] && mask[index + 1],
                "an edge right of pixel {index}"
            );
        }
    }
    assert!(edges > 60, "{edges} edges");
}

fn objects_behind_centres(scene: &Scene) -> Vec<Option<usize>> {
    let (width, height) = (scene.film.width, scene.film.height);
    let extent = DVec2::new(f64::from(width), f64::from(height));
    let mut work = Work::default();
    let mut hits = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let ray = scene.camera.ray(centre, extent, [0.5, 0.5]);
            hits.push(scene.intersect(&ray, &mut work).map(|hit| hit.object));
        }
    }
    hits
}

#[test]
fn noise_of_the_lens_does_not_reach_the_hash() {
    let open = scene(&[("camera.lens_radius", "0.3")]);
    assert_eq!(
        resampled(&open),
        resampled(&scene(&[])),
        "the mask is that of the pinhole"
    );
}

#[test]
fn one_pixel_and_one_row_are_pictures_too() {
    for (width, height) in [("1", "1"), ("17", "1"), ("1", "13")] {
        let small = scene(&[("film.width", width), ("film.height", height)]);
        let film = render(&small, Antialias::PathHash);
        assert!(film.pixels().iter().all(|pixel| pixel.count() >= 1.0));
    }
}

/// A straight edge along the pixel grid at a random place: one sample a pixel is wrong by ½ at most (RMS 1/√12 = 0.2887), nine
/// by 1/6 (RMS 0.0962). Here the exact errors for the project's grid, over 3000 places of the edge.
#[test]
fn nine_samples_cut_the_error_of_a_straight_edge_to_a_third() {
    let places = 3000;
    let (mut one, mut nine) = ((0.0_f64, 0.0), (0.0_f64, 0.0));
    for k in 0..places {
        let edge = (f64::from(k) + 0.5) / f64::from(places);
        let covered = |places: &[Place]| {
            let inside = |place: &&Place| place.offset.x < edge;
            places.iter().filter(inside).count() as f64 / places.len() as f64
        };
        for (error, worst) in [
            (covered(&grid(1)) - edge, &mut one),
            (covered(&grid(3)) - edge, &mut nine),
        ] {
            worst.0 = worst.0.max(error.abs());
            worst.1 += error * error / f64::from(places);
        }
    }
    assert!((one.0 - 0.5).abs() < 1e-3 && (nine.0 - 1.0 / 6.0).abs() < 1e-3);
    assert!((one.1.sqrt() - 0.2887).abs() < 1e-3 && (nine.1.sqrt() - 0.0962).abs() < 1e-3);
}
