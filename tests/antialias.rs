//! Path-hash antialiasing: what the hash tells apart, and what the mask does with it.

use glam::DVec2;
use photolathe::numeric::rng::mix;
use photolathe::numeric::work::Work;
use photolathe::render::antialias::fingerprint::{Event, Fingerprint, Met, PathHash};
use photolathe::render::antialias::mask::mask;
use photolathe::render::antialias::pattern::{CENTER, Place, ROOKS, grid};
use photolathe::render::driver::render_unwatched;
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::render::whitted::Whitted;
use photolathe::scene::options::{Antialias, Hash, Integrator, RenderTable, Resampling};
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

fn marked(scene: &Scene, hash: Hash) -> Vec<bool> {
    let settings = Settings {
        hash,
        ..settings(Antialias::PathHash)
    };
    let mut whitted = Whitted::new(scene, &settings);
    whitted.pass(0, &mut Film::new(scene.film));
    whitted.resampled().expect("a mask").to_vec()
}

/// The hashes behind the centres.
fn fingerprints(scene: &Scene, hash: Hash) -> Vec<Fingerprint> {
    let settings = Settings {
        hash,
        ..settings(Antialias::PathHash)
    };
    let whitted = Whitted::new(scene, &settings);
    let pixels = (scene.film.width * scene.film.height) as usize;
    let behind = |pixel| whitted.fingerprint(pixel, CENTER.offset, &mut Work::default());
    (0..pixels).map(behind).collect()
}

/// All paths of up to six specular events over three places and the background: more than two million.
#[test]
fn two_million_paths_have_as_many_hashes() {
    fn extend(hash: PathHash, depth: u32, seen: &mut Vec<u64>) {
        let events: &[Event] = if depth == 0 {
            &[Event::Camera]
        } else {
            &[Event::Mirror, Event::Reflect, Event::Refract]
        };
        for &event in events {
            for place in 0..4_usize {
                let met = place.checked_sub(1).map(|object| Met {
                    object,
                    piece: 0,
                    front: true,
                });
                let mut longer = hash;
                longer.vertex(event, depth, met);
                seen.push(longer.value());
                if met.is_some() && depth < 6 {
                    extend(longer, depth + 1, seen);
                }
            }
        }
    }
    let mut seen = Vec::new();
    extend(PathHash::default(), 0, &mut seen);
    let paths = seen.len();
    assert!(paths > 2_000_000, "{paths}");
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), paths, "no two of them share a hash");
}

/// A1, as the original had it: its hash is the same on both sides of an edge between diffuse objects, ours is not.
#[test]
fn the_original_hash_does_not_see_where_diffuse_objects_meet() {
    let scene = scene(&[]);
    let width = scene.film.width as usize;
    let hits = objects_behind_centres(&scene);
    let prints = fingerprints(&scene, Hash::Original);
    // Red ball, floor and wall; the others have specular events.
    let diffuse = |pixel: usize| matches!(hits[pixel], Some(0 | 3 | 4));
    let mut edges = 0;
    for right in (1..hits.len()).filter(|right| right % width != 0) {
        let left = right - 1;
        if diffuse(left) && diffuse(right) && hits[left] != hits[right] {
            edges += 1;
            let [a, b] = [left, right].map(|pixel| prints[pixel]);
            assert_eq!(a.value(Hash::Original), b.value(Hash::Original));
            assert_ne!(a.value(Hash::Objects), b.value(Hash::Objects));
        }
    }
    assert!(edges > 20, "{edges}");
}

/// A2: an object smaller than a pixel is found where a centre meets it: a disc of radius ρ at a random place with probability πρ².
#[test]
fn a_disc_within_a_pixel_is_found_with_the_share_of_its_area() {
    for radius in [0.1, 0.3, 0.5] {
        // A pixel is 2 tan(½°)·10/20 wide at the disc's distance.
        let pixel = libm::tan(0.5_f64.to_radians());
        let text = format!(
            "[camera]\neye = [0, 0, 10]\ntarget = [0, 0, 0]\nvertical_fov_deg = 1\n[film]\nwidth = 20\nheight = 20\n\
             [material.m]\ndiffuse = {{ reflectance = [1, 1, 1] }}\n[[disc]]\nnormal = [0, 0, 1]\nmaterial = \"m\"\n\
             center = [{x:?}, {y:?}, 0]\nradius = {r:?}\n",
            x = 0.5 * pixel,
            y = -0.5 * pixel,
            r = radius * pixel,
        );
        let scene = file::parse(&text, "disc", Path::new("."), &[]).expect("a scene");
        let settings = settings(Antialias::PathHash);
        let whitted = Whitted::new(&scene, &settings);
        // The disc stands at the middle of the pixel in column and row 10. A centre at any other place of the pixel is as
        // good as a disc moved the other way.
        let steps = 200;
        let at = |step: usize| (step as f64 + 0.5) / steps as f64;
        let met = |x: usize, y: usize| {
            let offset = DVec2::new(at(x), at(y));
            whitted.fingerprint(10 * 20 + 10, offset, &mut Work::default())
        };
        let miss = met(0, 0);
        let found = (0..steps * steps)
            .filter(|place| met(place % steps, place / steps) != miss)
            .count();
        let share = found as f64 / (steps * steps) as f64;
        let expected = std::f64::consts::PI * radius * radius;
        // The lattice counts an area to within about its boundary times a fifth of a step.
        assert!(
            (share - expected).abs() < 0.003,
            "{radius}: {share} for {expected}"
        );
    }
}

/// A3: edges of shadows and of checker cells are found by the hashes that take them in, and by those alone.
#[test]
fn shadows_and_textures_are_found_by_the_hashes_that_see_them() {
    let checker = "{ checker = [[0.8, 0.8, 0.8], [0.2, 0.2, 0.2]], repeat = [0.7, 0.7] }";
    let scene = scene(&[("material.grey.diffuse", checker)]);
    let width = scene.film.width as usize;
    let prints = fingerprints(&scene, Hash::Texture);
    let [objects, shadow, texture] =
        [Hash::Objects, Hash::Shadow, Hash::Texture].map(|hash| marked(&scene, hash));
    let (mut shadows, mut cells) = (0, 0);
    for right in (1..prints.len()).filter(|right| right % width != 0) {
        let left = right - 1;
        let [a, b] = [left, right].map(|pixel| prints[pixel]);
        if a.value(Hash::Objects) != b.value(Hash::Objects) {
            continue;
        }
        // Elsewhere a neighbour above or below may differ.
        let alone = !objects[left] || !objects[right];
        if a.shadow != b.shadow {
            shadows += usize::from(alone);
            assert!(shadow[left] && shadow[right] && texture[left] && texture[right]);
        } else if a.texture != b.texture {
            cells += usize::from(alone);
            assert!(texture[left] && texture[right]);
        }
    }
    assert!(shadows > 10 && cells > 40, "{shadows} {cells}");
    assert!(
        objects
            .iter()
            .zip(&shadow)
            .all(|(&less, &more)| !less || more)
    );
}

/// A4: an edge seen in a mirror is found where the path may be long enough to see it.
#[test]
fn an_edge_in_a_mirror_is_found_up_to_the_greatest_depth() {
    let mirrored = |depth: u32| {
        let scene = scene(&[]);
        let hits = objects_behind_centres(&scene);
        let settings = Settings {
            max_depth: Some(depth),
            ..settings(Antialias::PathHash)
        };
        let mut whitted = Whitted::new(&scene, &settings);
        whitted.pass(0, &mut Film::new(scene.film));
        let mask = whitted.resampled().expect("a mask");
        let width = scene.film.width as usize;
        let inner = |pixel: usize| {
            let around = [pixel - width, pixel - 1, pixel, pixel + 1, pixel + width];
            around.iter().all(|&pixel| hits[pixel] == Some(1))
        };
        (width..hits.len() - width)
            .filter(|&pixel| inner(pixel) && mask[pixel])
            .count()
    };
    assert_eq!(mirrored(0), 0, "without reflections the ball is one thing");
    assert!(mirrored(1) > 5, "{}", mirrored(1));
}

/// A6: where a solver takes a wrong root, its path differs from its neighbours': the mask is a detector of holes.
#[test]
fn holes_of_newton_are_marked() {
    let text = include_str!("../scenes/hard/bundle.toml");
    let small = |solver: &[(&str, &str)]| {
        let sets: Vec<_> = [("film.width", "96"), ("film.height", "96")]
            .iter()
            .chain(solver)
            .map(|&(key, value)| (key.to_owned(), value.to_owned()))
            .collect();
        file::parse(text, "bundle", Path::new("scenes/hard"), &sets).expect("a scene")
    };
    let newton = small(&[("render.solver", "\"newton\""), ("solver.starts", "3")]);
    let [right, wrong] = [&small(&[]), &newton].map(objects_behind_centres);
    let mask = marked(&newton, Hash::Objects);
    let hole = |pixel: &usize| {
        // Alone among neighbours that are right and alike.
        let around = [pixel - 96, pixel - 1, pixel + 1, pixel + 96];
        wrong[*pixel] != right[*pixel]
            && around
                .iter()
                .all(|&other| wrong[other] == right[other] && right[other] == right[*pixel])
    };
    let holes: Vec<usize> = (96..96 * 95).filter(hole).collect();
    assert!(holes.len() > 3, "{} holes", holes.len());
    assert!(holes.iter().all(|&pixel| mask[pixel]));
}

/// A9: a checker with cells of one pixel marks everything, at no more than ten times the camera rays.
#[test]
fn a_checker_of_pixels_marks_all_at_a_bounded_cost() {
    let text = "[camera]\neye = [0, 0, 10]\ntarget = [0, 0, 0]\nvertical_fov_deg = 53.13010235415598\n\
                [film]\nwidth = 20\nheight = 20\n[material.m]\n\
                diffuse = { checker = [[1, 1, 1], [0, 0, 0]], repeat = [1, 1] }\n\
                [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nmaterial = \"m\"\n\
                [[point_light]]\nposition = [0, 0, 30]\nintensity = [900, 900, 900]\n";
    let scene = file::parse(text, "checker", Path::new("."), &[]).expect("a scene");
    let settings = Settings {
        hash: Hash::Texture,
        ..settings(Antialias::PathHash)
    };
    let mut whitted = Whitted::new(&scene, &settings);
    let work = whitted.pass(0, &mut Film::new(scene.film));
    assert!(whitted.resampled().expect("a mask").iter().all(|&m| m));
    assert!(work.camera_rays <= 10 * 400, "{}", work.camera_rays);
}

/// Where all is resampled, the count of samples is the pattern's.
#[test]
fn every_pattern_has_its_number_of_samples() {
    let scene = scene(&[]);
    for (pattern, count) in [
        (Resampling::Two, 4.0),
        (Resampling::Three, 9.0),
        (Resampling::Four, 16.0),
    ] {
        let settings = Settings {
            pattern,
            ..settings(Antialias::Uniform)
        };
        let film = render_unwatched(&scene, &settings).expect("a picture").film;
        assert!(film.pixels().iter().all(|pixel| pixel.count() == count));
    }
}

/// Repeated hashing: four samples where they and the centre have one path, all sixteen elsewhere; nearly the picture of sixteen
/// everywhere.
#[test]
fn repeated_hashing_spends_its_samples_where_paths_differ() {
    let scene = scene(&[]);
    let film = |pattern, aa| {
        let settings = Settings {
            pattern,
            hash: Hash::Shadow,
            ..settings(aa)
        };
        render_unwatched(&scene, &settings).expect("a picture").film
    };
    let four = film(Resampling::Four, Antialias::PathHash);
    let adaptive = film(Resampling::Adaptive, Antialias::PathHash);
    let settings = settings(Antialias::None);
    let whitted = Whitted::new(&scene, &settings);
    let (mut few, mut many) = (0, 0);
    for (index, (pixel, all)) in adaptive.pixels().iter().zip(four.pixels()).enumerate() {
        match pixel.count() {
            1.0 => assert_eq!(pixel, all, "not marked"),
            4.0 => few += 1,
            16.0 => {
                many += 1;
                let gap = (pixel.mean() - all.mean()).abs().max_element();
                assert!(gap < 1e-12, "the same sixteen places, {gap} at {index}");
            }
            other => panic!("{other} samples"),
        }
        let at = |offset| whitted.fingerprint(index, offset, &mut Work::default());
        let center = at(CENTER.offset).value(Hash::Objects);
        let rooks = ROOKS.map(|place| at(grid(4)[place].offset).value(Hash::Objects));
        if pixel.count() == 4.0 {
            assert_eq!(rooks, [center; 4]);
        }
    }
    assert!(few > 30 && many > 100, "{few} {many}");
}

/// Contrast marks by colour, so a shadow's edge is found without a hash; a threshold beyond white against black marks nothing.
#[test]
fn contrast_marks_by_colour() {
    let scene = scene(&[]);
    let count = |aa, threshold| {
        let settings = Settings {
            threshold,
            ..settings(aa)
        };
        let mut whitted = Whitted::new(&scene, &settings);
        whitted.pass(0, &mut Film::new(scene.film));
        let mask = whitted.resampled().expect("a mask");
        mask.iter().filter(|&&marked| marked).count()
    };
    for aa in [Antialias::Contrast, Antialias::Variance] {
        let counts = [0.02, 0.2, 3.1].map(|threshold| count(aa, threshold));
        assert!(counts[0] > counts[1] && counts[1] > 20, "{counts:?}");
        assert_eq!(counts[2], 0, "three channels differ by 1 each at most");
    }
}
