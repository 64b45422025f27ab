//! The film: per pixel the mean and the second moment of its samples, in f64.

use crate::scene::{FilmSize, Rgb};

/// Running statistics of one pixel (Welford 1962).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    count: f64,
    mean: Rgb,
    squares: Rgb,
    bad: u32,
}

impl Pixel {
    /// Adds a sample. A NaN or infinite one is counted as bad and otherwise left out.
    pub fn add(&mut self, sample: Rgb) {
        if !sample.is_finite() {
            self.bad += 1;
            return;
        }
        self.count += 1.0;
        let before = sample - self.mean;
        self.mean += before / self.count;
        self.squares += before * (sample - self.mean);
    }

    /// Number of samples.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Mean of the samples; 0 without any.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// Estimated variance of the mean; 0 with fewer than two samples.
    pub fn variance_of_mean(&self) -> Rgb {
        if self.count < 2.0 {
            Rgb::ZERO
        } else {
            self.squares / ((self.count - 1.0) * self.count)
        }
    }
}

/// A picture in the making; row 0 is the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: FilmSize,
    pixels: Vec<Pixel>,
}

impl Film {
    /// A film without samples.
    pub fn new(size: FilmSize) -> Self {
        Self {
            size,
            pixels: vec![Pixel::default(); size.width as usize * size.height as usize],
        }
    }

    /// Size in pixels.
    pub fn size(&self) -> FilmSize {
        self.size
    }

    /// The pixels, row by row from the top.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// The pixels, for adding samples.
    pub fn pixels_mut(&mut self) -> &mut [Pixel] {
        &mut self.pixels
    }

    /// Number of samples that were NaN or infinite.
    pub fn bad_samples(&self) -> u64 {
        self.pixels.iter().map(|pixel| u64::from(pixel.bad)).sum()
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> Rgb {
        self.pixels.iter().map(Pixel::mean).sum::<Rgb>() / self.pixels.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance_of_the_mean_are_those_of_the_samples() {
        let mut pixel = Pixel::default();
        for x in [1.0, 2.0, 4.0, 9.0] {
            pixel.add(Rgb::new(x, 2.0 * x, 0.0));
        }
        assert_eq!(pixel.mean(), Rgb::new(4.0, 8.0, 0.0));
        let variance = pixel.variance_of_mean();
        assert!((variance.x - 38.0 / 3.0 / 4.0).abs() < 1e-14);
        assert!((variance.y - 4.0 * 38.0 / 3.0 / 4.0).abs() < 1e-13);
    }

    #[test]
    fn a_sample_that_is_not_finite_is_counted_and_left_out() {
        let mut film = Film::new(FilmSize {
            width: 1,
            height: 1,
        });
        film.pixels_mut()[0].add(Rgb::ONE);
        film.pixels_mut()[0].add(Rgb::new(f64::NAN, 0.0, 0.0));
        film.pixels_mut()[0].add(Rgb::new(0.0, f64::INFINITY, 0.0));
        assert_eq!(film.bad_samples(), 2);
        assert_eq!(film.pixels()[0].mean(), Rgb::ONE);
    }
}
