//! The difference of two pictures as a picture.

use crate::image::picture::Picture;
use crate::image::png::encode_bytes;

/// Share of the pixels that fit the colour scale; the rest saturates, so that single bright pixels do not hide the others.
const SHOWN: f64 = 0.99;

/// Colours of the ends of the scale (Okabe and Ito 2008): told apart by colour-blind readers.
const DARKER: [f64; 3] = [0.0, 114.0, 178.0];
const BRIGHTER: [f64; 3] = [213.0, 94.0, 0.0];

/// A map of a − b, averaged over the channels of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    width: usize,
    height: usize,
    values: Vec<f64>,
    /// Radiance that the ends of the colour scale stand for; 0 if nothing differs.
    pub scale: f64,
}

impl Difference {
    /// The difference of two pictures of equal size.
    pub fn of(a: &Picture, b: &Picture) -> Self {
        let mean = |p: &[f32; 3]| p.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0;
        let values: Vec<f64> = a
            .rgb
            .iter()
            .zip(&b.rgb)
            .map(|(x, y)| mean(x) - mean(y))
            .collect();
        let mut sizes: Vec<f64> = values
            .iter()
            .map(|v| v.abs())
            .filter(|v| v.is_finite())
            .collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let last = sizes.len().saturating_sub(1);
        let at = |share: f64| {
            sizes
                .get((share * last as f64) as usize)
                .copied()
                .unwrap_or(0.0)
        };
        let scale = if at(SHOWN) > 0.0 { at(SHOWN) } else { at(1.0) };
        Self {
            width: a.width,
            height: a.height,
            values,
            scale,
        }
    }

    /// PNG: white where equal, blue where a is darker, orange where it is brighter, black where a pixel is not finite.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let bytes: Vec<u8> = self.values.iter().flat_map(|&v| self.colour(v)).collect();
        let note = format!("a - b, mean of channels; full colour is {:e}", self.scale);
        encode_bytes(self.width, self.height, &bytes, &note)
    }

    fn colour(&self, value: f64) -> [u8; 3] {
        if !value.is_finite() {
            return [0; 3];
        }
        let share = if self.scale > 0.0 {
            (value.abs() / self.scale).min(1.0)
        } else {
            0.0
        };
        let end = if value < 0.0 { DARKER } else { BRIGHTER };
        end.map(|channel| (255.0 + share * (channel - 255.0) + 0.5) as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sign_is_colour_and_equality_is_white() {
        let picture = |values: [f32; 3]| Picture {
            width: 3,
            height: 1,
            rgb: values.map(|v| [v; 3]).to_vec(),
            ..Picture::default()
        };
        let map = Difference::of(&picture([1.0, 2.0, 3.0]), &picture([1.0, 1.0, 4.0]));
        assert_eq!(map.colour(map.values[0]), [255; 3]);
        assert_eq!(map.colour(map.values[1]), [213, 94, 0]);
        assert_eq!(map.colour(map.values[2]), [0, 114, 178]);
        assert_eq!(map.colour(f64::NAN), [0; 3]);
    }
}
