//! What `photolathe export` writes says the same scene, and the programs it is for draw the same picture.

use glam::DVec3;
use photolathe::cli::export::mesh::Mesh;
use photolathe::geometry::planar::{Disc, Quad};
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::revolution::{Placement, Revolution};
use photolathe::image::exr;
use photolathe::image::picture::Picture;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Every kind of shape and of texture coordinates, a mirror and a lathe with a negative control radius, under a point light.
/// Names try to break out of the comments they are written into.
const SCENE: &str = r#"
title = "a --> <b> & \"c\" --"

[camera]
eye = [0.5, 3, 9]
target = [0, 1, 0]
vertical_fov_deg = 42

[film]
width = 48
height = 32

[material.floor]
diffuse = { checker = [[0.8, 0.7, 0.6], [0.1, 0.2, 0.3]], repeat = [0.25, 0.5] }
[material.ball]
diffuse = { checker = [[0.9, 0.1, 0.1], [0.1, 0.1, 0.9]], repeat = [3, 2] }
[material.leaning]
diffuse = { checker = [[0.9, 0.9, 0.1], [0.1, 0.5, 0.1]], repeat = [1.5, 1] }
[material.picture]
diffuse = { texture = 'MATERIALS/stripes.png', repeat = [1, 1] }
mirror = { reflectance = [0.06, 0.05, 0.02] }
[material.rug]
diffuse = { texture = 'MATERIALS/waves.png', repeat = [1, 2] }
[material.clay]
diffuse = { reflectance = [0.6, 0.5, 0.4] }
mirror = { reflectance = [0.2, 0.3, 0.2] }
[material.chrome]
mirror = { reflectance = [0.9, 0.8, 0.7] }

[[revolution]]
name = "cup --> out"
material = "clay"
profile = [
  [[0, 0.04], [1.1, 0.04], [1.2, 0], [2, 0]],
  [[2, 0], [2.2, 0], [2, 0.1], [1.9, 0.15]],
  [[1.9, 0.15], [1.73, 0.23], [0.4, -0.2], [0.2, 0.4]],
  [[0.2, 0.4], [-0.1, 1.3], [3.8, 1.4], [3.8, 2]],
  [[3.8, 2], [3.8, 2.2], [3.6, 2.2], [3.6, 2]],
  [[3.6, 2], [3.6, 1.9], [0.25, 1.3], [0, 1.3]],
]
translate = [-2.2, 0.4, 1]
rotate = { axis = [1, 0, 1], deg = 25 }
scale = 0.4
[[sphere]]
center = [0.6, 1, 1]
radius = 1
material = "ball"
[[sphere]]
center = [3, 1, -0.5]
radius = 1
material = "chrome"
[[quad]]
corner = [-4, 0, -3]
edge_u = [4, 0, 0]
edge_v = [0, 3, -0.2]
material = "picture"
[[quad]]
corner = [0.5, 0, -3]
edge_u = [3, 0, 0]
edge_v = [1, 3, 0]
material = "leaning"
[[plane]]
point = [0.3, 0, 0.2]
normal = [0, 1, 0]
material = "floor"
[[disc]]
center = [1.5, 0.01, 3]
normal = [0, 1, 0]
radius = 1.2
material = "rug"
[[point_light]]
position = [2, 6, 6]
intensity = [120, 120, 120]
"#;

fn run(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_photolathe"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

/// The scene in a new folder.
fn folder_with(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let materials = Path::new(env!("CARGO_MANIFEST_DIR")).join("materials");
    let text = scene.replace("MATERIALS", &materials.display().to_string());
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    folder
}

fn export(folder: &Path, to: &str, more: &[&str]) -> Output {
    let arguments = [&["export", "scene.toml", "--to", to, "-o", to], more].concat();
    let output = run(&arguments, folder);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    output
}

/// What is wrong with an XML text as far as nesting, quotes and comments go.
fn fault_of_xml(text: &str) -> Option<String> {
    let mut open = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        if rest[..start].contains('>') {
            return Some(format!("a stray > in {:?}", &rest[..start]));
        }
        rest = &rest[start + 1..];
        if let Some(comment) = rest.strip_prefix("!--") {
            let end = comment.find("--")?;
            if !comment[end..].starts_with("-->") {
                return Some(format!("two hyphens in the comment {:?}", &comment[..end]));
            }
            rest = &comment[end + 3..];
            continue;
        }
        let Some(end) = rest.find('>') else {
            return Some("a tag without end".to_owned());
        };
        let tag = &rest[..end];
        rest = &rest[end + 1..];
        if !tag.matches('"').count().is_multiple_of(2) || tag.contains('<') {
            return Some(format!("bad quotes in {tag:?}"));
        }
        if let Some(name) = tag.strip_prefix('/') {
            if open.pop() != Some(name.to_owned()) {
                return Some(format!("</{name}> closes another element"));
            }
        } else if !tag.ends_with('/') && !tag.starts_with('?') {
            open.push(tag.split(' ').next().unwrap_or("").to_owned());
        }
    }
    (!open.is_empty()).then(|| format!("left open: {open:?}"))
}

#[test]
fn broken_xml_would_be_seen() {
    assert_eq!(
        fault_of_xml("<?xml?><a><b c=\"d\"/><!-- e - f --></a>"),
        None
    );
    for broken in [
        "<a><b></a></b>",
        "<a>",
        "<a b=\"c/>",
        "<!-- a -- b -->",
        "<a> > </a>",
    ] {
        assert!(fault_of_xml(broken).is_some(), "{broken}");
    }
}

#[test]
fn the_mitsuba_scene_is_well_formed_and_names_what_differs() {
    let folder = folder_with(SCENE);
    let said = String::from_utf8(export(folder.path(), "mitsuba", &[]).stderr).unwrap();
    let text = fs::read_to_string(folder.path().join("mitsuba/scene.xml")).unwrap();
    assert_eq!(fault_of_xml(&text), None);
    for difference in ["the plane ends", "within"] {
        assert!(
            said.contains(difference) && text.contains(difference),
            "{difference}"
        );
    }
    // A checker of 3 by 2 pairs on a ball, whose v runs the other way.
    assert!(text.contains("<scale x=\"3.0\" y=\"-2.0\"/><translate x=\"0.0\" y=\"2.0\"/>"));
    assert!(text.contains("<float name=\"fov\" value=\"42.0\"/>"));
    for name in text
        .split('"')
        .filter(|word| word.ends_with(".ply") || word.ends_with(".exr"))
    {
        assert!(folder.path().join("mitsuba").join(name).is_file(), "{name}");
    }
}

#[test]
fn what_cannot_be_said_is_an_error_and_nothing_is_written() {
    let beam = "\n[[beam]]\ncenter = [0, 5, 0]\ndirection = [0, -1, 0]\nradius = 1.0\nirradiance = [1, 1, 1]\n";
    let blend = "\n[material.odd]\ndiffuse = { reflectance = [0.9, 0, 0] }\nmirror = { reflectance = [0, 0.9, 0] }\n\
                 [[sphere]]\ncenter = [0, 9, 0]\nradius = 1\nmaterial = \"odd\"\n";
    for (more, word) in [(beam, "beam"), (blend, "material odd")] {
        let folder = folder_with(&(SCENE.to_owned() + more));
        let output = run(
            &["export", "scene.toml", "--to", "mitsuba", "-o", "out"],
            folder.path(),
        );
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(word), "{said}");
        assert!(!folder.path().join("out").exists());
    }
}

/// A vase whose radius passes through zero twice, open at both ends.
fn crossing_profile() -> Profile {
    let pieces = [
        [[-1.0, 0.0], [1.0, 0.5], [2.0, 1.0], [1.0, 1.5]],
        [[1.0, 1.5], [0.0, 2.0], [-2.0, 2.5], [0.5, 3.0]],
    ];
    Profile::new(pieces.map(Piece::new).to_vec()).unwrap()
}

/// Distance of a point (radius, height) from the profile: dense points of it, and the chords between them, which are nearer
/// to the curve than a millionth.
fn distance_from_profile(curve: &[[f64; 2]], radius: f64, height: f64) -> f64 {
    let to_segment = |pair: &[[f64; 2]]| {
        let (a, b) = (pair[0], pair[1]);
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let (px, py) = (radius - a[0], height - a[1]);
        let length = x * x + y * y;
        let along = if length > 0.0 {
            ((px * x + py * y) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        libm::hypot(px - along * x, py - along * y)
    };
    curve
        .windows(2)
        .map(to_segment)
        .fold(f64::INFINITY, f64::min)
}

/// Whether corners, edge middles and centres of the triangles are within the stated error of the surface, the triangles are
/// turned as the normals say, and every edge inside the profile is shared (no slits).
fn mesh_is_right(shape: &Revolution, mesh: &Mesh) -> Result<(), String> {
    let placement = shape.placement();
    let curve: Vec<[f64; 2]> = (shape.profile().pieces().iter())
        .flat_map(|piece| (0..=1000).map(|i| piece.at(f64::from(i) / 1000.0)))
        .map(|station| [station.radius.abs(), station.height])
        .collect();
    let step = (mesh.triangles.len() / 1500).max(1);
    for triangle in mesh.triangles.iter().step_by(step) {
        let corners = triangle.map(|i| mesh.vertices[i as usize]);
        let [a, b, c] = corners.map(|vertex| vertex.point);
        for point in [
            a,
            0.5 * (a + b),
            0.5 * (b + c),
            0.5 * (c + a),
            (a + b + c) / 3.0,
        ] {
            let local =
                placement.rotation.transpose() * (point - placement.translate) / placement.scale;
            let radius = libm::hypot(local.x, local.z);
            let distance = placement.scale * distance_from_profile(&curve, radius, local.y);
            if distance > mesh.error + 1e-6 {
                return Err(format!("a point at {distance}, stated {}", mesh.error));
            }
        }
        let facing = (b - a).cross(c - a);
        let normals: DVec3 = corners.iter().map(|vertex| vertex.normal).sum();
        let turned = normals.dot(facing) <= 0.0;
        if turned {
            return Err("a triangle that looks away from its normal".to_owned());
        }
    }
    Ok(())
}

/// The volume of a closed mesh by the divergence theorem.
fn volume(mesh: &Mesh) -> f64 {
    let of_triangle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize].point);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(of_triangle).sum()
}

fn placed(profile: Profile) -> Revolution {
    let placement = Placement::new(
        DVec3::new(1.0, -2.0, 0.5),
        DVec3::new(1.0, 2.0, 3.0),
        40.0,
        1.5,
    );
    Revolution::new(profile, placement)
}

#[test]
fn a_mesh_is_within_its_stated_error_and_wrong_ones_are_seen() {
    for profile in [Profile::cup(), Profile::hourglass(), crossing_profile()] {
        for share in [1e-2, 1e-3] {
            let shape = placed(profile.clone());
            let mesh = Mesh::of_revolution(&shape, share).unwrap();
            assert_eq!(mesh_is_right(&shape, &mesh), Ok(()));
            let mut boastful = mesh.clone();
            boastful.error *= 0.1;
            assert!(mesh_is_right(&shape, &boastful).is_err());
            let mut turned = mesh.clone();
            turned
                .triangles
                .iter_mut()
                .for_each(|triangle| triangle.swap(0, 1));
            assert!(mesh_is_right(&shape, &turned).is_err());
        }
    }
}

#[test]
fn a_mesh_of_a_solid_is_closed_and_holds_its_volume() {
    for profile in [Profile::cup(), Profile::hourglass()] {
        let scale: f64 = 1.5;
        let truth = profile.volume() * scale.powi(3);
        let shape = placed(profile);
        let mesh = Mesh::of_revolution(&shape, 1e-4).unwrap();
        let off = volume(&mesh) / truth - 1.0;
        // Inscribed, hence too small, by about twice the relative error of a radius.
        assert!((-2e-2..1e-3).contains(&off), "{off}");
    }
}

#[test]
fn a_mesh_without_bounds_is_refused() {
    assert!(Mesh::of_revolution(&placed(Profile::cup()), 1e-9).is_err());
}

#[test]
fn meshes_of_flat_shapes_have_our_texture_coordinates() {
    let quad = Quad::new(
        DVec3::new(1.0, 2.0, 3.0),
        DVec3::X,
        DVec3::new(0.5, 0.0, 2.0),
    );
    let disc = Disc {
        center: DVec3::new(0.0, 1.0, 0.0),
        normal: DVec3::Y,
        radius: 2.0,
    };
    for vertex in Mesh::of_quad(&quad).vertices {
        let expected = quad.corner + vertex.st.x * quad.edge_u + vertex.st.y * quad.edge_v;
        assert!((vertex.point - expected).length() < 1e-15);
    }
    // For a normal along +y, s runs along +x and t along −z.
    for vertex in Mesh::of_disc(&disc, 1e-3).vertices {
        let from = vertex.st - 0.5;
        let expected = disc.center + 4.0 * (from.x * DVec3::X - from.y * DVec3::Z);
        assert!((vertex.point - expected).length() < 1e-14);
    }
}

/// Our picture of the scene in a folder.
fn ours(folder: &Path, arguments: &[&str]) -> Picture {
    let output = run(
        &[&["render", "scene.toml", "-o", "ours.exr"], arguments].concat(),
        folder,
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    exr::read(&folder.join("ours.exr")).unwrap()
}

/// Means of square blocks that differ by more than `share` of ours and a floor of that share of 0.2, beside the noise: six
/// standard errors of the difference, with theirs taken to be as large as ours.
fn different_blocks(theirs: &Picture, ours: &Picture, side: usize, share: f64) -> Vec<String> {
    assert_eq!((theirs.width, theirs.height), (ours.width, ours.height));
    let variance = ours.variance.as_ref().unwrap();
    let (columns, rows) = (ours.width / side, ours.height / side);
    let count = (side * side) as f64;
    let mut found = Vec::new();
    for block in 0..columns * rows {
        let (left, top) = (side * (block % columns), side * (block / columns));
        let place = |i: usize| (top + i / side) * ours.width + left + i % side;
        for channel in 0..3 {
            let value = |of: &[[f32; 3]], i: usize| f64::from(of[place(i)][channel]);
            let mean =
                |of: &[[f32; 3]]| (0..side * side).map(|i| value(of, i)).sum::<f64>() / count;
            let (a, b) = (mean(&theirs.rgb), mean(&ours.rgb));
            let noise = 6.0 * (2.0 * mean(variance) / count).sqrt();
            let off = (a - b).abs();
            if off.is_nan() || off > noise + share * (b + 0.2) {
                let place = format!("block {left},{top} channel {channel}");
                found.push(format!("{place}: {a} for {b}, noise {noise}"));
            }
        }
    }
    found
}

/// The picture that a program wrote, or `None` with a word on stderr where it is not installed.
fn drawn_by(program: &str, probe: &[&str], arguments: &[&str], folder: &Path) -> Option<PathBuf> {
    let start = |arguments: &[&str]| {
        Command::new(program)
            .args(arguments)
            .current_dir(folder)
            .output()
    };
    if !start(probe).is_ok_and(|output| output.status.success()) {
        eprintln!(
            "skipped: {program} {} fails, it is not installed",
            probe.join(" ")
        );
        return None;
    }
    let output = start(arguments).unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(folder.join("scene.exr"))
}

/// 72 block means; sees 1 % in a block where the noise of 128 samples a pixel allows it.
#[test]
fn mitsuba_draws_the_same_picture() {
    let folder = folder_with(SCENE);
    export(folder.path(), "mitsuba", &["--set", "render.max_depth=3"]);
    let script = "import mitsuba as mi; mi.set_variant('scalar_rgb'); \
                  mi.util.write_bitmap('scene.exr', mi.render(mi.load_file('scene.xml'), spp=128), write_async=False)";
    let place = folder.path().join("mitsuba");
    let Some(path) = drawn_by(
        "python3",
        &["-c", "import mitsuba"],
        &["-c", script],
        &place,
    ) else {
        return;
    };
    let theirs = exr::read(&path).unwrap();
    let ours = ours(
        folder.path(),
        &["--integrator", "path", "--max-depth", "3", "--spp", "128"],
    );
    let found = different_blocks(&theirs, &ours, 8, 0.003);
    assert!(found.is_empty(), "{found:#?}");
}

/// One ray through the centre of each pixel on both sides, so that edges agree too. Theirs keeps 11 bits of a number.
#[test]
fn pov_ray_draws_the_same_picture() {
    let folder = folder_with(SCENE);
    let size = ["--set", "film.width=192", "--set", "film.height=128"];
    export(folder.path(), "povray", &size);
    let place = folder.path().join("povray");
    let arguments = ["scene.ini", "Antialias=off"];
    let Some(path) = drawn_by("povray", &["--version"], &arguments, &place) else {
        return;
    };
    let theirs = exr::read(&path).unwrap();
    let direct = ["--integrator", "whitted", "--aa", "none", "--spp", "1"];
    let ours = ours(folder.path(), &[&direct[..], &size].concat());
    let found = different_blocks(&theirs, &ours, 16, 0.005);
    assert!(found.is_empty(), "{found:#?}");
}
