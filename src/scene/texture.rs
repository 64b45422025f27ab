//! Pictures as reflectance.
//!
//! PNG values are taken as sRGB (IEC 61966-2-1) whatever the file's gamma or profile chunks say, and decoded to linear.

use super::Rgb;
use glam::DVec2;
use image::{ColorType, DynamicImage, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Most bytes of a PNG file.
pub const MAX_PNG_BYTES: u64 = 64 << 20;

/// Most texels along a side.
pub const MAX_SIDE: u32 = 8192;

/// Most texels: 192 MiB in memory.
pub const MAX_TEXELS: u64 = 1 << 24;

/// A picture of linear reflectances; row 0 is the top.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Width in texels, ≥ 1.
    pub width: usize,
    /// Height in texels, ≥ 1.
    pub height: usize,
    /// Linear RGB texels, row by row from the top.
    pub texels: Vec<[f32; 3]>,
}

/// Why a file is not a texture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TextureError {
    /// Not a PNG that can be decoded within the limits.
    #[error("{0}")]
    Undecodable(String),
    /// More texels than [`MAX_TEXELS`].
    #[error("{width} × {height} texels, more than {MAX_TEXELS}")]
    TooLarge {
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
    },
    /// Some texel is not opaque: reflectance has no meaning for transparency.
    #[error("it has transparent texels")]
    Transparent,
}

impl Texture {
    /// Decodes a PNG file: grey or RGB or palette, 8 or 16 bits a channel; an alpha channel must be opaque everywhere.
    ///
    /// # Errors
    /// What is not such a file, or too large; a file that claims a huge size is refused before its texels are allocated.
    pub fn from_png(bytes: &[u8]) -> Result<Self, TextureError> {
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        limits.max_alloc = Some(16 * MAX_TEXELS);
        let undecodable =
            |error: &dyn std::fmt::Display| TextureError::Undecodable(error.to_string());
        let reader = || {
            let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
            reader.limits(limits.clone());
            reader
        };
        let (width, height) = reader()
            .into_dimensions()
            .map_err(|error| undecodable(&error))?;
        if u64::from(width) * u64::from(height) > MAX_TEXELS {
            return Err(TextureError::TooLarge { width, height });
        }
        let picture = reader().decode().map_err(|error| undecodable(&error))?;
        Self::from_picture(&picture)
    }

    fn from_picture(picture: &DynamicImage) -> Result<Self, TextureError> {
        let alpha = picture.color().has_alpha();
        let eight_bits = matches!(
            picture.color(),
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8
        );
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let texels = if eight_bits {
            let decoded: Vec<f32> = (0..=u8::MAX)
                .map(|v| srgb_to_linear(f64::from(v) / 255.0) as f32)
                .collect();
            let opaque = !alpha || picture.to_rgba8().pixels().all(|pixel| pixel[3] == u8::MAX);
            let texel = |pixel: &image::Rgb<u8>| pixel.0.map(|v| decoded[usize::from(v)]);
            opaque.then(|| picture.to_rgb8().pixels().map(texel).collect())
        } else {
            let opaque = !alpha
                || picture
                    .to_rgba16()
                    .pixels()
                    .all(|pixel| pixel[3] == u16::MAX);
            let texel = |pixel: &image::Rgb<u16>| {
                pixel
                    .0
                    .map(|v| srgb_to_linear(f64::from(v) / 65535.0) as f32)
            };
            opaque.then(|| picture.to_rgb16().pixels().map(texel).collect())
        };
        Ok(Self {
            width,
            height,
            texels: texels.ok_or(TextureError::Transparent)?,
        })
    }

    /// Bilinear lookup between texel centres; the picture repeats in both directions; t = 0 is the bottom edge.
    ///
    /// The centre of the texel in column i and row j from the bottom is at ((i + ½)/width, (j + ½)/height). Where four texels
    /// agree the answer is exactly theirs.
    pub fn at(&self, st: DVec2) -> Rgb {
        let (left, right, x) = neighbours(st.x, self.width);
        let (below, above, y) = neighbours(st.y, self.height);
        let low = lerp(self.texel(left, below), self.texel(right, below), x);
        let high = lerp(self.texel(left, above), self.texel(right, above), x);
        lerp(low, high, y)
    }

    /// The texel in this column and row from the bottom.
    fn texel(&self, column: usize, row: usize) -> Rgb {
        let [r, g, b] = self.texels[(self.height - 1 - row) * self.width + column];
        Rgb::new(f64::from(r), f64::from(g), f64::from(b))
    }

    /// The largest value of each channel over the picture.
    pub fn largest(&self) -> Rgb {
        let channels = |a: [f32; 3], b: &[f32; 3]| [a[0].max(b[0]), a[1].max(b[1]), a[2].max(b[2])];
        let [r, g, b] = self.texels.iter().fold([0.0; 3], channels);
        Rgb::new(f64::from(r), f64::from(g), f64::from(b))
    }
}

/// The texels on both sides of a coordinate, and how far it is from the first to the second.
fn neighbours(coordinate: f64, count: usize) -> (usize, usize, f64) {
    let turn = coordinate - coordinate.floor();
    let place = turn * count as f64 - 0.5;
    let first = place.floor();
    let share = place - first;
    // First is in -1 ..= count, as turn may round to 1.
    let first = (first + count as f64) as usize % count;
    (first, (first + 1) % count, share)
}

fn lerp(a: Rgb, b: Rgb, share: f64) -> Rgb {
    a + share * (b - a)
}

/// The sRGB curve (IEC 61966-2-1): encoded value in [0, 1] to linear.
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        libm::pow((encoded + 0.055) / 1.055, 2.4)
    }
}

/// The inverse of [`srgb_to_linear`].
pub fn linear_to_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    }
}
