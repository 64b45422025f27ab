//! The hard cases A1 to A9, and what each hash takes in.

use super::{SCENE, objects_behind_centres, scene, settings};
use glam::DVec2;
use photolathe::numeric::work::Work;
use photolathe::render::antialias::fingerprint::{Event, Fingerprint, Met, PathHash};
use photolathe::render::antialias::pattern::CENTER;
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::render::whitted::Whitted;
use photolathe::scene::options::{Antialias, Hash};
use photolathe::scene::{Scene, file};
use std::path::Path;

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

/// A5: what chance decides (a place on a lamp, on the lens) does not reach the hash: every seed marks the same pixels.
#[test]
fn the_mask_does_not_depend_on_chance() {
    let lamp = "[material.lamp]\nemission = { radiance = [9, 9, 9] }\n[[disc]]\ncenter = [1, 4, 3]\nnormal = [0, -1, 0]\n\
                radius = 1.5\nmaterial = \"lamp\"\n";
    let text = SCENE.to_owned() + lamp;
    let open = [("camera.lens_radius".to_owned(), "0.2".to_owned())];
    let scene = file::parse(&text, "scene", Path::new("."), &open).expect("a scene");
    for hash in [Hash::Original, Hash::Objects, Hash::Shadow, Hash::Texture] {
        let mask = |seed: u64| {
            let settings = Settings {
                hash,
                seed,
                ..settings(Antialias::PathHash)
            };
            let mut whitted = Whitted::new(&scene, &settings);
            whitted.pass(0, &mut Film::new(scene.film));
            whitted.resampled().expect("a mask").to_vec()
        };
        let first = mask(0);
        assert!(first.iter().any(|&m| m) && !first.iter().all(|&m| m));
        assert!((1..6).all(|seed| mask(seed) == first), "{hash:?}");
    }
}

/// A8: a cup's rim before its own wall is one object with itself; pieces and sides tell the sheets apart, so every place where the
/// sheet behind the centre changes is marked. (Two sheets of one piece that show the same side are one to the hash.)
#[test]
fn sheets_of_one_object_are_told_apart_by_piece_and_side() {
    let text = include_str!("../../scenes/hard/cup.toml");
    let sets = [
        ("film.width", "96"),
        ("film.height", "72"),
        ("camera.eye", "[0, 5, 9]"),
    ]
    .map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scene = file::parse(text, "cup", Path::new("scenes/hard"), &sets).expect("a scene");
    let mask = marked(&scene, Hash::Objects);
    let extent = DVec2::new(96.0, 72.0);
    let sheet = |pixel: usize| {
        let centre = DVec2::new((pixel % 96) as f64 + 0.5, (pixel / 96) as f64 + 0.5);
        let ray = scene.camera.ray(centre, extent, [0.5, 0.5]);
        let hit = scene.intersect(&ray, &mut Work::default())?;
        Some((hit.piece, hit.side_met(ray.direction), hit.t))
    };
    let sheets: Vec<_> = (0..mask.len()).map(sheet).collect();
    let mut jumps = 0;
    for upper in 0..mask.len() - 96 {
        let pair = sheets[upper].zip(sheets[upper + 96]);
        let jump = pair.filter(|((a, side_a, _), (b, side_b, _))| (a, side_a) != (b, side_b));
        if let Some(((.., t), (.., u))) = jump {
            // Not a joint of smooth pieces but one sheet before another.
            jumps += usize::from((t - u).abs() > 0.5);
            assert!(mask[upper] && mask[upper + 96], "below pixel {upper}");
        }
    }
    assert!(jumps > 20, "{jumps}");
}

/// A6: where a solver takes a wrong root, its path differs from its neighbours': the mask is a detector of holes.
#[test]
fn holes_of_newton_are_marked() {
    let text = include_str!("../../scenes/hard/bundle.toml");
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
