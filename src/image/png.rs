//! PNG for the eye: 8 bits, the sRGB curve, a stated exposure, no tone curve.

use super::ImageError;
use super::file::write_atomically;
use super::picture::Picture;
use crate::scene::texture::linear_to_srgb;
use std::path::Path;

/// Writes a picture, whole or not at all; `exposure` is a factor on radiance.
pub fn write(picture: &Picture, exposure: f64, path: &Path) -> Result<(), ImageError> {
    let bytes = encode(picture, exposure).map_err(|reason| ImageError::bad(path, reason))?;
    write_atomically(path, &bytes).map_err(|reason| ImageError::File {
        path: path.to_owned(),
        reason,
    })
}

/// The bytes of the PNG file of a picture: radiance times `exposure`, clamped to [0, 1], sRGB curve, rounded to 8 bits. A text
/// chunk states the exposure. NaN is drawn black.
pub fn encode(picture: &Picture, exposure: f64) -> Result<Vec<u8>, String> {
    let bytes: Vec<u8> = picture
        .rgb
        .as_flattened()
        .iter()
        .map(|&x| srgb_byte(exposure * f64::from(x)))
        .collect();
    let note = format!("sRGB of radiance x {exposure}, clamped, no tone curve");
    encode_bytes(picture.width, picture.height, &bytes, &note)
}

/// The bytes of a PNG file of sRGB bytes (RGB by row) with a `Description`.
pub fn encode_bytes(
    width: usize,
    height: usize,
    rgb: &[u8],
    description: &str,
) -> Result<Vec<u8>, String> {
    let side = |n: usize| u32::try_from(n).map_err(|_| format!("{n} pixels are too many for PNG"));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side(width)?, side(height)?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let write = |error: png::EncodingError| error.to_string();
    encoder
        .add_text_chunk("Description".to_owned(), description.to_owned())
        .map_err(write)?;
    let mut writer = encoder.write_header().map_err(write)?;
    writer.write_image_data(rgb).map_err(write)?;
    writer.finish().map_err(write)?;
    Ok(bytes)
}

/// The sRGB byte of linear `x` (IEC 61966-2-1), clamped to [0, 1]; 0 for NaN.
pub fn srgb_byte(x: f64) -> u8 {
    let x = if x > 0.0 { x.min(1.0) } else { 0.0 };
    (255.0 * linear_to_srgb(x) + 0.5).floor() as u8
}

/// The bytes of a file as a `data:` address, for pages without neighbours.
pub fn data_uri(png: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:image/png;base64,");
    for group in png.chunks(3) {
        let word = group
            .iter()
            .fold(0_u32, |word, &byte| word << 8 | u32::from(byte))
            << (8 * (3 - group.len()));
        for place in 0..4 {
            let letter = ALPHABET[(word >> (18 - 6 * place) & 63) as usize];
            text.push(if place <= group.len() {
                letter as char
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of IEC 61966-2-1: both branches, their joint.
    #[test]
    fn the_curve_is_that_of_srgb() {
        for (linear, byte) in [
            (0.0, 0),
            (0.001, 3),
            (0.003_130_8, 10),
            (0.18, 118),
            (0.215, 128),
            (0.5, 188),
            (1.0, 255),
        ] {
            assert_eq!(srgb_byte(linear), byte, "{linear}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        assert_eq!(srgb_byte(f64::NAN), 0);
        assert_eq!(srgb_byte(-1.0), 0);
        assert_eq!(srgb_byte(f64::INFINITY), 255);
    }

    #[test]
    fn base64_is_that_of_rfc_4648() {
        for (plain, text) in [
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            let uri = data_uri(plain.as_bytes());
            assert_eq!(uri.strip_prefix("data:image/png;base64,"), Some(text));
        }
    }

    #[test]
    fn the_file_names_its_exposure_and_holds_its_pixels() {
        let picture = Picture {
            width: 2,
            height: 1,
            rgb: vec![[0.0, 0.25, 1.0], [9.0, 0.5, 0.0]],
            ..Picture::default()
        };
        let bytes = encode(&picture, 2.0).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [0, 188, 255, 255, 255, 0]);
        let text = &reader.info().uncompressed_latin1_text[0];
        assert!(text.text.contains("radiance x 2,"), "{}", text.text);
    }
}
