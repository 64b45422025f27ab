//! Textures and patterns: decoding, bilinear lookup, seams, and the cells of a checker.

mod shapes;

use glam::{DVec2, DVec3};
use image::{DynamicImage, ImageFormat};
use photolathe::scene::material::Pattern;
use photolathe::scene::texture::{Texture, TextureError, srgb_to_linear};
use proptest::prelude::*;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

fn png(picture: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .into()
        .write_to(&mut bytes, ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

/// A 3 × 2 texture of distinct dyadic greys; the first row is the top.
fn six() -> Texture {
    Texture {
        width: 3,
        height: 2,
        texels: [0.0, 0.25, 0.5, 0.125, 0.375, 1.0]
            .map(|v| [v, v, v])
            .to_vec(),
    }
}

fn grey(texture: &Texture, s: f64, t: f64) -> f64 {
    let value = texture.at(DVec2::new(s, t));
    assert_eq!(value, DVec3::splat(value.x));
    value.x
}

#[test]
fn the_curve_is_that_of_srgb() {
    assert_eq!(srgb_to_linear(0.0), 0.0);
    assert_eq!(srgb_to_linear(1.0), 1.0);
    // Reference values of the standard's formulas to 12 digits, computed apart.
    for (encoded, linear) in [
        (1.0 / 255.0, 0.000_303_526_983_549),
        (10.0 / 255.0, 0.003_035_269_835_488),
        (11.0 / 255.0, 0.003_346_535_763_899),
        (188.0 / 255.0, 0.502_886_458_033),
        (0.5, 0.214_041_140_482),
    ] {
        assert!(
            (srgb_to_linear(encoded) - linear).abs() < 1e-12,
            "{encoded}"
        );
    }
    let values: Vec<f64> = (0..=255)
        .map(|v| srgb_to_linear(f64::from(v) / 255.0))
        .collect();
    assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn a_texel_centre_gives_the_texel_and_the_bottom_row_is_first() {
    let texture = six();
    for (row_from_bottom, row) in [[0.125, 0.375, 1.0], [0.0, 0.25, 0.5]].iter().enumerate() {
        for (column, &expected) in row.iter().enumerate() {
            let (s, t) = (
                (column as f64 + 0.5) / 3.0,
                (row_from_bottom as f64 + 0.5) / 2.0,
            );
            assert!((grey(&texture, s, t) - expected).abs() < 1e-15);
        }
    }
}

#[test]
fn between_centres_the_lookup_is_linear() {
    let texture = six();
    // Half way between two columns, two rows, and four texels.
    assert!((grey(&texture, 1.0 / 3.0, 0.25) - 0.25).abs() < 1e-15);
    assert!((grey(&texture, 0.5, 0.5) - 0.3125).abs() < 1e-15);
    assert!((grey(&texture, 2.0 / 3.0, 0.5) - 0.25 * (0.25 + 0.5 + 0.375 + 1.0)).abs() < 1e-15);
    // A gradient is reproduced exactly where it does not wrap.
    let ramp = Texture {
        width: 64,
        height: 1,
        texels: (0..64).map(|i| [i as f32 / 64.0; 3]).collect(),
    };
    for step in 0..=252 {
        let s = (2.0 + f64::from(step)) / 256.0;
        assert_eq!(grey(&ramp, s, 0.3), s - 0.5 / 64.0);
    }
}

#[test]
fn the_seam_joins_the_last_texel_to_the_first() {
    let texture = six();
    for s in [0.0, 1.0, -1.0, 7.0] {
        assert!(
            (grey(&texture, s, 0.25) - 0.5 * (1.0 + 0.125)).abs() < 1e-15,
            "at {s}"
        );
    }
    for t in [0.0, 1.0, -3.0] {
        assert!(
            (grey(&texture, 0.5, t) - 0.5 * (0.25 + 0.375)).abs() < 1e-15,
            "at {t}"
        );
    }
    // Continuous across it, from both sides.
    for tiny in [1e-9, -1e-9] {
        assert!((grey(&texture, tiny, 0.25) - grey(&texture, 0.0, 0.25)).abs() < 1e-8);
    }
    // A coordinate that rounds to a whole turn.
    assert!((grey(&texture, -1e-20, 0.25) - grey(&texture, 0.0, 0.25)).abs() < 1e-15);
    assert!((grey(&texture, 1e300, -1e300) - grey(&texture, 0.0, 0.0)).abs() < 1e-15);
}

#[test]
fn one_texel_is_the_same_everywhere() {
    let texture = Texture {
        width: 1,
        height: 1,
        texels: vec![[0.3, 0.6, 0.9]],
    };
    let expected = DVec3::new(f64::from(0.3_f32), f64::from(0.6_f32), f64::from(0.9_f32));
    for s in [-0.3, 0.0, 0.5, 0.999] {
        assert_eq!(texture.at(DVec2::new(s, 1.7 * s)), expected);
    }
}

#[test]
fn every_kind_of_opaque_png_is_read_alike() {
    let value = 0x80_u8;
    let wide = 0x8080_u16;
    let linear = srgb_to_linear(128.0 / 255.0) as f32;
    let pictures = [
        png(image::GrayImage::from_pixel(2, 3, image::Luma([value]))),
        png(image::GrayAlphaImage::from_pixel(
            2,
            3,
            image::LumaA([value, 255]),
        )),
        png(image::RgbImage::from_pixel(2, 3, image::Rgb([value; 3]))),
        png(image::RgbaImage::from_pixel(
            2,
            3,
            image::Rgba([value, value, value, 255]),
        )),
        png(image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(
            2,
            3,
            image::Luma([wide]),
        )),
        png(image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(
            2,
            3,
            image::Rgb([wide; 3]),
        )),
        png(image::ImageBuffer::<image::Rgba<u16>, _>::from_pixel(
            2,
            3,
            image::Rgba([wide, wide, wide, u16::MAX]),
        )),
    ];
    for bytes in pictures {
        let texture = Texture::from_png(&bytes).unwrap();
        assert_eq!((texture.width, texture.height), (2, 3));
        assert_eq!(texture.texels, vec![[linear; 3]; 6]);
    }
}

#[test]
fn sixteen_bits_keep_their_digits_and_rows_their_order() {
    let picture = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(1, 2, |_, y| {
        image::Luma([1000 + y as u16])
    });
    let texture = Texture::from_png(&png(picture)).unwrap();
    let texel = |v: f64| [srgb_to_linear(v / 65535.0) as f32; 3];
    assert_eq!(texture.texels, [texel(1000.0), texel(1001.0)]);
    assert!(texture.texels[0] != texture.texels[1]);
}

/// Written by hand, as pictures of fewer than 8 bits and palettes have no type in `image`.
fn plain_png(
    kind: png::ColorType,
    depth: png::BitDepth,
    data: &[u8],
    transparency: Option<Vec<u8>>,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(kind);
    encoder.set_depth(depth);
    if kind == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 128, 0]);
    }
    if let Some(transparency) = transparency {
        encoder.set_trns(transparency);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn few_bits_and_palettes_are_read_and_their_transparency_is_refused() {
    use png::{BitDepth, ColorType};
    let orange = [1.0, srgb_to_linear(128.0 / 255.0) as f32, 0.0];
    for (depth, data) in [
        (BitDepth::One, 0b0100_0000),
        (BitDepth::Two, 0b0001_0000),
        (BitDepth::Four, 0b0000_0001),
    ] {
        let palette = plain_png(ColorType::Indexed, depth, &[data], None);
        let texture = Texture::from_png(&palette).unwrap();
        assert_eq!(texture.texels, [[0.0; 3], orange]);
        let holed = plain_png(ColorType::Indexed, depth, &[data], Some(vec![255, 7]));
        assert_eq!(
            Texture::from_png(&holed).unwrap_err(),
            TextureError::Transparent
        );
        // Grey takes the whole range: the greatest value is white.
        let white = data | data << 1 | data << 2 | data << 3;
        let white = match depth {
            BitDepth::One => 0b0100_0000,
            BitDepth::Two => 0b0011_0000,
            _ => white,
        };
        let grey = plain_png(ColorType::Grayscale, depth, &[white], None);
        let texture = Texture::from_png(&grey).unwrap();
        assert_eq!(texture.texels, [[0.0; 3], [1.0; 3]]);
    }
    let wide = [0, 0, 255, 255, 255, 255, 255, 254];
    let nearly = plain_png(ColorType::GrayscaleAlpha, BitDepth::Sixteen, &wide, None);
    assert_eq!(
        Texture::from_png(&nearly).unwrap_err(),
        TextureError::Transparent
    );
}

#[test]
fn transparency_is_refused() {
    let one_hole = |x, y| image::Rgba([9, 9, 9, if (x, y) == (1, 1) { 254 } else { 255 }]);
    let found = Texture::from_png(&png(image::RgbaImage::from_fn(4, 4, one_hole)));
    assert_eq!(found.unwrap_err(), TextureError::Transparent);
}

/// CRC-32 of the PNG specification, for headers that no encoder would write.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xEDB8_8320 * (crc & 1))
        })
    })
}

/// A PNG that claims a size and holds next to nothing.
fn claim(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        let body = [kind, data].concat();
        bytes.extend((data.len() as u32).to_be_bytes());
        bytes.extend(&body);
        bytes.extend(crc(&body).to_be_bytes());
    };
    let header = [
        &width.to_be_bytes()[..],
        &height.to_be_bytes(),
        &[8, 2, 0, 0, 0],
    ]
    .concat();
    chunk(b"IHDR", &header);
    chunk(b"IDAT", &[0x78, 0x9c, 0x03, 0x00, 0x00, 0x00, 0x00, 0x01]);
    chunk(b"IEND", &[]);
    bytes
}

#[test]
fn huge_claims_are_refused_before_anything_is_allocated() {
    let found = Texture::from_png(&claim(8192, 8192)).unwrap_err();
    assert_eq!(
        found,
        TextureError::TooLarge {
            width: 8192,
            height: 8192
        }
    );
    for (width, height) in [
        (8193, 1),
        (1, 8193),
        (100_000, 100_000),
        (u32::MAX, u32::MAX),
        (0, 5),
        (5, 0),
        (4000, 4000),
    ] {
        let found = Texture::from_png(&claim(width, height)).unwrap_err();
        assert!(
            matches!(found, TextureError::Undecodable(_)),
            "{width} × {height}: {found}"
        );
    }
}

#[test]
fn a_checker_cell_of_colour_0_holds_the_origin() {
    let checker = Pattern::Checker {
        colors: [DVec3::X, DVec3::Y],
        repeat: DVec2::new(2.0, 1.0),
    };
    // Along s a cell is ¼ wide, along t ½.
    for (s, t, expected) in [
        (0.0, 0.0, DVec3::X),
        (0.1, 0.4, DVec3::X),
        (0.3, 0.4, DVec3::Y),
        (0.3, 0.6, DVec3::X),
        (0.6, 0.1, DVec3::X),
        (-0.1, 0.1, DVec3::Y),
        (-0.1, -0.1, DVec3::X),
        (0.25, 0.0, DVec3::Y),
        (1.0, 1.0, DVec3::X),
    ] {
        assert_eq!(checker.at(DVec2::new(s, t)), expected, "({s}, {t})");
    }
}

#[test]
fn a_texture_repeats_by_its_count() {
    let texture = Arc::new(six());
    let pattern = Pattern::Texture {
        texture: Arc::clone(&texture),
        repeat: DVec2::new(2.0, 4.0),
    };
    let st = DVec2::new(0.3, 0.9);
    assert_eq!(pattern.at(st), texture.at(st * DVec2::new(2.0, 4.0)));
    assert!((pattern.at(st) - pattern.at(st + DVec2::new(0.5, 0.25))).length() < 1e-14);
}

/// The rule by which the reference pictures of scene `box` were made: colour 0 where ⌊4 (x + 1)⌋ + ⌊4 (1 - z)⌋ is even.
#[test]
fn the_floor_of_the_box_has_the_phase_of_its_reference() {
    use photolathe::geometry::ray::Ray;
    use photolathe::numeric::rng::{Purpose, Stream};
    use photolathe::numeric::work::Work;
    let scene = photolathe::scene::file::load(Path::new("scenes/box.toml"), &[]).unwrap();
    let mut stream = Stream::new(1, Purpose::Test, 0);
    for _ in 0..2000 {
        let (x, z) = (stream.range(-1.0, 1.0), stream.range(-1.0, 1.0));
        let ray = Ray::new(DVec3::new(x, -1.5, z), DVec3::Y);
        let hit = scene.intersect(&ray, &mut Work::default()).unwrap();
        assert_eq!(scene.objects[hit.object].name, "floor");
        let even = ((4.0 * (x + 1.0)).floor() + (4.0 * (1.0 - z)).floor()) % 2.0 == 0.0;
        let expected = if even {
            DVec3::splat(0.8)
        } else {
            DVec3::new(0.2, 0.2, 0.25)
        };
        assert_eq!(
            scene.material(&hit).diffuse.as_ref().unwrap().at(hit.st()),
            expected,
            "({x}, {z})"
        );
    }
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 2000,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    /// A constant picture gives its constant, bit for bit, anywhere.
    #[test]
    fn a_constant_picture_is_constant(s in -1e6..1e6_f64, t in -1e6..1e6_f64, v in 0.0..1.0_f32, w in 1..9_usize, h in 1..9_usize) {
        let texture = Texture { width: w, height: h, texels: vec![[v; 3]; w * h] };
        prop_assert_eq!(texture.at(DVec2::new(s, t)), DVec3::splat(f64::from(v)));
    }

    /// No lookup leaves the range of the texels.
    #[test]
    fn a_lookup_stays_among_its_texels(s in -5.0..5.0_f64, t in -5.0..5.0_f64, values in prop::collection::vec(0.0..1.0_f32, 12)) {
        let texture = Texture { width: 4, height: 3, texels: values.iter().map(|&v| [v; 3]).collect() };
        let value = texture.at(DVec2::new(s, t)).x;
        let low = values.iter().copied().fold(f32::INFINITY, f32::min);
        prop_assert!(value >= f64::from(low) && value <= texture.largest().x, "{}", value);
    }

    /// Damaged files are refused or read, without a panic.
    #[test]
    fn damaged_pictures_never_panic(at in 0..400_usize, with in any::<u8>(), cut in 0..500_usize) {
        let mut bytes = png(image::RgbImage::from_fn(8, 8, |x, y| image::Rgb([x as u8 * 31, y as u8 * 29, 77])));
        let length = bytes.len();
        bytes[at % length] ^= with;
        bytes.truncate(length.saturating_sub(cut.saturating_sub(300)));
        if let Ok(texture) = Texture::from_png(&bytes) {
            prop_assert_eq!(texture.texels.len(), texture.width * texture.height);
        }
    }
}
