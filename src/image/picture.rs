//! A picture in memory.

use crate::render::features::{Channel, Features};
use crate::render::film::Film;
use crate::render::settings::Settings;
use crate::scene::{Rgb, Scene};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
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
    /// Feature channels. They are written to files but not read from them.
    pub features: Vec<Channel>,
    /// Text attributes of the header.
    pub attributes: BTreeMap<String, String>,
}

/// What decides a picture, besides the number of passes done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Name and version of the program.
    pub program_version: String,
    /// Fingerprint of the program's sources. It says whether passes fit together, and is not in pictures: where other code changes no
    /// result, it changes no byte.
    pub program_source: String,
    /// Hash of the scene, [`Scene::hash`].
    pub scene_hash: String,
    /// Solver with its parameters.
    pub solver: String,
    /// Settings.
    pub settings: Settings,
}

impl Origin {
    /// The origin of the pictures that this program makes of a scene.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        Self {
            program_version: concat!("photolathe ", env!("CARGO_PKG_VERSION")).to_owned(),
            program_source: env!("PHOTOLATHE_SOURCE").to_owned(),
            scene_hash: scene.hash.clone(),
            solver: format!("{:?}", scene.solver),
            settings: settings.clone(),
        }
    }

    /// The first difference in words, the number of passes planned aside; `None` if a pass of one is a pass of the other.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let words = |origin: &Self| -> Vec<(String, String)> {
            let mut words = vec![
                ("program_version".to_owned(), origin.program_version.clone()),
                ("program_source".to_owned(), origin.program_source.clone()),
                ("scene_hash".to_owned(), origin.scene_hash.clone()),
                ("solver".to_owned(), origin.solver.clone()),
            ];
            let settings = serde_json::to_value(&origin.settings);
            if let Ok(serde_json::Value::Object(settings)) = settings {
                let decisive = settings.into_iter().filter(|(name, _)| name != "passes");
                words.extend(decisive.map(|(name, value)| (name, value.to_string())));
            }
            words
        };
        let mut pairs = words(self).into_iter().zip(words(other));
        let ((name, mine), (_, theirs)) = pairs.find(|(mine, theirs)| mine != theirs)?;
        Some(format!("{name} differs: {mine} against {theirs}"))
    }
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
            ..Self::default()
        }
    }

    /// The colours of a film alone, as [`Self::of_film`] has them.
    pub fn colours_of(film: &Film) -> Self {
        let size = film.size();
        let pixels = film.pixels().par_iter();
        Self {
            width: size.width as usize,
            height: size.height as usize,
            rgb: pixels.map(|pixel| single(pixel.mean())).collect(),
            ..Self::default()
        }
    }

    /// The picture with these features.
    #[must_use]
    pub fn with_features(self, features: Option<&Features>) -> Self {
        Self {
            features: features.map_or(Vec::new(), Features::channels),
            ..self
        }
    }

    /// Notes in the header what decides the bytes: the origin's words but for the fingerprint of the sources, `settings` as JSON, the
    /// `seed` and the `passes` done; never threads, paths or times.
    #[must_use]
    pub fn described(mut self, origin: &Origin, passes: u64) -> Self {
        let settings =
            serde_json::to_string(&origin.settings).expect("settings are plain numbers and words");
        for (name, text) in [
            ("settings", settings),
            ("scene_hash", origin.scene_hash.clone()),
            ("seed", origin.settings.seed.to_string()),
            ("solver", origin.solver.clone()),
            ("passes", passes.to_string()),
            ("program_version", origin.program_version.clone()),
        ] {
            self.attributes.insert(name.to_owned(), text);
        }
        self
    }

    /// Number of pixels with a colour that is not finite: beyond what an f32 holds.
    pub fn infinite(&self) -> usize {
        let infinite = |rgb: &&[f32; 3]| !rgb.iter().all(|value| value.is_finite());
        self.rgb.iter().filter(infinite).count()
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
