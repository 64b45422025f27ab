//! Pictures as reflectance.

use super::Rgb;
use glam::DVec2;

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

impl Texture {
    /// Bilinear lookup between texel centres; the picture repeats in both directions; t = 0 is the bottom edge.
    pub fn at(&self, st: DVec2) -> Rgb {
        let _ = st;
        todo!()
    }
}
