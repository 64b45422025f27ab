//! A picture in memory.

use crate::render::film::Film;
use std::collections::BTreeMap;

/// Linear RGB with optional statistics, as stored in an EXR file. Row 0 is the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Radiance.
    pub rgb: Vec<[f32; 3]>,
    /// Variance of the mean.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Samples per pixel.
    pub samples: Option<Vec<f32>>,
    /// Text attributes of the header.
    pub attributes: BTreeMap<String, String>,
}

impl Picture {
    /// The picture of a film.
    pub fn of_film(film: &Film) -> Self {
        let _ = film;
        todo!()
    }
}
