//! A picture in memory.

use crate::render::film::Film;
use crate::render::settings::Settings;
use crate::scene::{Rgb, Scene};
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
    /// The picture of a film: rounded to f32, with the variance of the mean and the number of samples of each pixel.
    pub fn of_film(film: &Film) -> Self {
        let size = film.size();
        let pixels = film.pixels();
        Self {
            width: size.width as usize,
            height: size.height as usize,
            rgb: pixels.iter().map(|pixel| single(pixel.mean())).collect(),
            variance: Some(
                pixels
                    .iter()
                    .map(|pixel| single(pixel.variance_of_mean()))
                    .collect(),
            ),
            samples: Some(pixels.iter().map(|pixel| pixel.count() as f32).collect()),
            attributes: BTreeMap::new(),
        }
    }

    /// Notes in the header what decides the bytes: `settings` (JSON), `scene_hash`, `seed`, `solver`, `passes` done and
    /// `program_version`; never threads, paths or times.
    #[must_use]
    pub fn described(mut self, scene: &Scene, settings: &Settings, passes: u64) -> Self {
        let settings_json =
            serde_json::to_string(settings).expect("settings are plain numbers and words");
        for (name, text) in [
            ("settings", settings_json),
            ("scene_hash", scene.hash.clone()),
            ("seed", settings.seed.to_string()),
            ("solver", format!("{:?}", scene.solver)),
            ("passes", passes.to_string()),
            (
                "program_version",
                concat!("photolathe ", env!("CARGO_PKG_VERSION")).to_owned(),
            ),
        ] {
            self.attributes.insert(name.to_owned(), text);
        }
        self
    }

    /// BLAKE3 hash of size and radiance bits, hexadecimal: equal for two pictures exactly when every pixel is.
    pub fn digest(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(self.width as u64).to_le_bytes());
        hasher.update(&(self.height as u64).to_le_bytes());
        for value in self.rgb.as_flattened() {
            hasher.update(&value.to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

fn single(rgb: Rgb) -> [f32; 3] {
    rgb.to_array().map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FilmSize;

    #[test]
    fn a_film_becomes_its_means_variances_and_counts() {
        let mut film = Film::new(FilmSize {
            width: 2,
            height: 1,
        });
        film.pixels_mut()[1].add(Rgb::new(1.0, 2.0, 3.0));
        film.pixels_mut()[1].add(Rgb::new(3.0, 2.0, 3.0));
        let picture = Picture::of_film(&film);
        assert_eq!((picture.width, picture.height), (2, 1));
        assert_eq!(picture.rgb, [[0.0; 3], [2.0, 2.0, 3.0]]);
        assert_eq!(picture.variance.unwrap()[1], [1.0, 0.0, 0.0]);
        assert_eq!(picture.samples.unwrap(), [0.0, 2.0]);
    }

    #[test]
    fn the_digest_sees_one_bit_and_the_shape() {
        let picture = Picture {
            width: 2,
            height: 1,
            rgb: vec![[1.0; 3]; 2],
            ..Picture::default()
        };
        let mut changed = picture.clone();
        changed.rgb[1][2] = f32::from_bits(1.0_f32.to_bits() + 1);
        let turned = Picture {
            width: 1,
            height: 2,
            ..picture.clone()
        };
        assert_ne!(picture.digest(), changed.digest());
        assert_ne!(picture.digest(), turned.digest());
    }
}
