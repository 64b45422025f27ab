//! Textures on the bodies of a scene: seams, poles, borders, and a file that claims too much.

use super::{claim, grey, png, six};
use glam::{DVec2, DVec3};
use photolathe::geometry::ray::Ray;
use photolathe::numeric::work::Work;
use photolathe::scene::Scene;
use photolathe::scene::file;
use photolathe::scene::texture::{Texture, linear_to_srgb};
use std::process::Command;

/// The same in a scene: one error that names the file's place in it, exit code 2, and no more memory than the program itself takes.
#[test]
fn a_scene_with_a_huge_texture_is_refused_in_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("huge.png"), claim(100_000, 100_000)).unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, ON_SHAPES.replace("TEXTURE", "huge.png")).unwrap();
    // A gigabyte of addresses: the texels of the claim would be 120.
    let program = format!(
        "ulimit -v 1000000; exec {:?} render {:?} -o {:?}",
        env!("CARGO_BIN_EXE_photolathe"),
        scene,
        folder.path().join("out.exr"),
    );
    let done = Command::new("sh").args(["-c", &program]).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(
        said.contains("expected a PNG file that can be a texture"),
        "{said}"
    );
    assert_eq!(said.trim().lines().count(), 1, "{said}");
    assert!(!folder.path().join("out.exr").exists());
}

/// A globe, a wall, a disc and a lathed tube with the same picture.
const ON_SHAPES: &str = r#"
[camera]
eye = [0, 0, 9]
target = [0, 0, 0]
vertical_fov_deg = 30
[film]
width = 4
height = 4
[material.picture]
diffuse = { texture = "TEXTURE", repeat = [1, 1] }
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "picture"
[[revolution]]
material = "picture"
profile = [[[1, -1], [1, -0.3333333333333333], [1, 0.3333333333333333], [1, 1]]]
translate = [4, 0, 0]
[[quad]]
corner = [-5, -1, 0]
edge_u = [2, 0, 0]
edge_v = [0, 2, 0]
material = "picture"
[[disc]]
center = [-8, 0, 0]
normal = [0, 0, 1]
radius = 1
material = "picture"
"#;

/// Textured scene and the colour that a ray finds.
struct Shapes(Scene);

impl Shapes {
    fn new(texture: &Texture, repeat: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let picture = image::ImageBuffer::<image::Rgb<u16>, Vec<u16>>::from_fn(
            texture.width as u32,
            texture.height as u32,
            |x, y| {
                let texel = texture.texels[(y as usize) * texture.width + x as usize];
                image::Rgb(texel.map(|v| (65535.0 * linear_to_srgb(f64::from(v))).round() as u16))
            },
        );
        std::fs::write(folder.path().join("a.png"), png(picture)).unwrap();
        let text = ON_SHAPES
            .replace("TEXTURE", "a.png")
            .replace("[1, 1]", repeat);
        Self(file::parse(&text, "scene", folder.path(), &[]).unwrap())
    }

    /// Texture coordinates and colour of what a ray meets.
    fn met(&self, origin: DVec3, direction: DVec3) -> (DVec2, f64) {
        let ray = Ray::new(origin, direction);
        let hit = self
            .0
            .intersect(&ray, &mut Work::default())
            .expect("a surface");
        assert!(hit.st().is_finite());
        let pattern = self.0.material(&hit).diffuse.as_ref().unwrap();
        (hit.st(), pattern.at(hit.st()).x)
    }

    fn colour(&self, origin: DVec3, direction: DVec3) -> f64 {
        self.met(origin, direction).1
    }

    /// Towards the axis of globe or tube from the azimuth θ (from +z towards +x) at a height.
    fn around(&self, center: DVec3, theta: f64, height: f64) -> f64 {
        let out = DVec3::new(libm::sin(theta), 0.0, libm::cos(theta));
        self.colour(center + height * DVec3::Y + 3.0 * out, -out)
    }
}

/// Across θ = 0 the picture goes on from its last column to its first, on the globe and on a surface of revolution.
#[test]
fn no_seam_shows_where_a_picture_closes_around_a_body() {
    let shapes = Shapes::new(&six(), "[1, 1]");
    let tiny = 1e-9;
    for center in [DVec3::ZERO, 4.0 * DVec3::X] {
        for height in [-0.4, 0.1, 0.5] {
            let [before, at, after] = [-tiny, 0.0, tiny].map(|t| shapes.around(center, t, height));
            assert!((before - at).abs() < 1e-7 && (after - at).abs() < 1e-7);
        }
        // At the middle of the lower row of texels: half of the last column and half of the first.
        let height = if center == DVec3::ZERO {
            -0.5_f64.sqrt()
        } else {
            -0.5
        };
        let found = shapes.around(center, 0.0, height);
        assert!((found - 0.5 * (1.0 + 0.125)).abs() < 1e-4, "{found}");
        // A sixth of a turn on is the middle of the first column.
        let found = shapes.around(center, std::f64::consts::TAU / 6.0, height);
        assert!((found - 0.125).abs() < 1e-4, "{found}");
    }
}

/// At a pole every azimuth comes together: the colour is finite and one of those around it; as the picture repeats upwards too, a pole
/// has half of the top row and half of the bottom row.
#[test]
fn a_pole_has_a_colour_of_those_around_it() {
    let texture = six();
    let shapes = Shapes::new(&texture, "[1, 1]");
    for up in [1.0, -1.0] {
        let pole = shapes.colour(3.0 * up * DVec3::Y, -up * DVec3::Y);
        let around: Vec<f64> = (0..60)
            .map(|step| {
                let angle = f64::from(step) / 60.0 * std::f64::consts::TAU;
                let off = 1e-9 * DVec3::new(libm::sin(angle), 0.0, libm::cos(angle));
                shapes.colour(off + 3.0 * up * DVec3::Y, -up * DVec3::Y)
            })
            .collect();
        assert!(
            around.iter().any(|colour| (colour - pole).abs() < 1e-7),
            "{pole}"
        );
        for (step, &colour) in around.iter().enumerate() {
            let expected = grey(&texture, step as f64 / 60.0, 0.0);
            assert!((colour - expected).abs() < 1e-4, "{step}: {colour}");
        }
    }
}

/// The borders of a quad, met to the last bit, and the outermost points of a disc: the picture goes on from its other side, and `repeat`
/// shows it so many times.
#[test]
fn borders_of_quads_and_discs_join_as_the_picture_repeats() {
    let texture = six();
    for (repeat, times) in [("[1, 1]", DVec2::ONE), ("[3, 2]", DVec2::new(3.0, 2.0))] {
        let shapes = Shapes::new(&texture, repeat);
        for (s, t) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, 1.0),
            (1.0, 1.0),
            (0.25, 1.0),
            (1.0, 0.75),
            (0.4, 0.3),
        ] {
            let expected = grey(&texture, s * times.x, t * times.y);
            let found = shapes.colour(DVec3::new(-5.0 + 2.0 * s, -1.0 + 2.0 * t, 3.0), -DVec3::Z);
            assert!(
                (found - expected).abs() < 1e-4,
                "({s}, {t}): {found} for {expected}"
            );
        }
        // The rim of the disc touches the borders of its square.
        for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let (st, found) = shapes.met(DVec3::new(x - 8.0, y, 3.0), -DVec3::Z);
            assert_eq!((st - 0.5).abs().max_element(), 0.5, "({x}, {y}): {st}");
            let expected = grey(&texture, st.x * times.x, st.y * times.y);
            assert!((found - expected).abs() < 1e-4, "({x}, {y})");
        }
    }
}
