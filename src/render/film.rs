//! The film: per pixel the mean of its samples and the variance of that.
//!
//! Samples and their squares are added up by [`Sums`], which do not depend on order: passes may be rendered apart and joined in
//! any way, and give the bits of an unbroken render.

use crate::numeric::sum::{Sums, two_product, two_sum};
use crate::scene::{FilmSize, Rgb};

/// A variance below this share of the mean square is the rounding of squares: none is reported. Its root, 2⁻²⁴, is the rounding
/// of a pixel in a picture.
const NO_SPREAD: f64 = 1.0 / (1_u64 << 48) as f64;

/// Statistics of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    /// Of the samples, then of their squares, by channel.
    sums: Sums<6>,
    count: u64,
    bad: u32,
}

impl Pixel {
    /// Number of bytes of a pixel in a file.
    pub const BYTES: usize = Sums::<6>::BYTES + 12;

    /// Adds a sample. A NaN or infinite one is counted as bad and otherwise left out.
    pub fn add(&mut self, sample: Rgb) {
        if !sample.is_finite() {
            self.bad += 1;
            return;
        }
        self.count += 1;
        for (channel, x) in sample.to_array().into_iter().enumerate() {
            self.sums.add(channel, x);
            self.sums.add(3 + channel, (x * x).min(f64::MAX));
        }
    }

    /// Adds the samples of another part.
    pub fn join(&mut self, other: &Self) {
        self.sums.join(&other.sums);
        self.count += other.count;
        self.bad += other.bad;
    }

    /// Number of samples.
    pub fn count(&self) -> f64 {
        self.count as f64
    }

    /// Mean of the samples; 0 without any.
    pub fn mean(&self) -> Rgb {
        if self.count == 0 {
            return Rgb::ZERO;
        }
        let n = self.count();
        self.by_channel(|channel| {
            let (sum, rest) = self.sums.value(channel);
            let mean = sum / n;
            // One step of long division, so that the mean of equal samples is each of them.
            let (product, product_rest) = two_product(mean, n);
            let correction = ((sum - product) - product_rest + rest) / n;
            if correction.is_finite() {
                mean + correction
            } else {
                mean
            }
        })
    }

    /// Estimated variance of the mean, (n Σx² − (Σx)²)/(n² (n − 1)); 0 with fewer than two samples, infinite where it is out of
    /// range.
    pub fn variance_of_mean(&self) -> Rgb {
        if self.count < 2 {
            return Rgb::ZERO;
        }
        let n = self.count();
        self.by_channel(|channel| {
            let (sum, rest) = self.sums.value(channel);
            let (squares, squares_rest) = self.sums.value(3 + channel);
            // Both are twice as long as a double, so nothing cancels but what is equal.
            let (all, all_rest) = two_product(n, squares);
            let (square, square_rest) = two_product(sum, sum);
            let (spread, spread_rest) = two_sum(all, -square);
            let rests = n.mul_add(squares_rest, all_rest) - (2.0 * sum).mul_add(rest, square_rest);
            let spread = spread + (spread_rest + rests);
            if !spread.is_finite() {
                f64::INFINITY
            } else if spread < NO_SPREAD * all {
                0.0
            } else {
                spread / (n * n * (n - 1.0))
            }
        })
    }

    fn by_channel(&self, value: impl Fn(usize) -> f64) -> Rgb {
        Rgb::from_array(std::array::from_fn(value))
    }

    /// The pixel as bytes, appended to a file.
    pub fn write(&self, out: &mut Vec<u8>) {
        self.sums.write(out);
        out.extend(self.count.to_le_bytes());
        out.extend(self.bad.to_le_bytes());
    }

    /// The pixel of [`Self::BYTES`] bytes; `None` if they are none.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (sums, rest) = bytes.split_at_checked(Sums::<6>::BYTES)?;
        let (count, bad) = rest.split_at_checked(8)?;
        Some(Self {
            sums: Sums::read(sums)?,
            count: u64::from_le_bytes(count.try_into().ok()?),
            bad: u32::from_le_bytes(bad.try_into().ok()?),
        })
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

    /// Adds the samples of another part.
    ///
    /// # Panics
    /// If it is of another size.
    pub fn join(&mut self, other: &Self) {
        assert_eq!(
            self.size, other.size,
            "parts of one picture are of one size"
        );
        for (pixel, more) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.join(more);
        }
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
    use crate::numeric::rng::{Purpose, Stream};
    use crate::numeric::statistics::Moments;
    use crate::scene::MAX_PIXELS;

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

    /// The estimate is that of Welford's recurrence, for noise beside a large and a small mean, and 0 for a constant.
    #[test]
    fn the_variance_keeps_its_digits() {
        let mut stream = Stream::new(4, Purpose::Test, 0);
        for (mean, spread) in [(0.0, 1.0), (1e6, 1.0), (1e-20, 1e-21), (-3e100, 1e98)] {
            let samples: Vec<f64> = (0..500).map(|_| mean + spread * stream.uniform()).collect();
            let mut pixel = Pixel::default();
            samples.iter().for_each(|&x| pixel.add(Rgb::splat(x)));
            let moments = Moments::of(samples);
            let (got, expected) = (pixel.variance_of_mean().y, moments.variance() / 500.0);
            assert!((got / expected - 1.0).abs() < 1e-3, "{got} {expected}");
            assert!((pixel.mean().z - moments.mean()).abs() <= 1e-15 * moments.mean().abs());
        }
        for constant in [0.1, 1.0 / 3.0, 1e200, 5e-324] {
            let mut pixel = Pixel::default();
            (0..7).for_each(|_| pixel.add(Rgb::splat(constant)));
            assert_eq!(pixel.mean(), Rgb::splat(constant));
            assert!(constant > 1e100 || pixel.variance_of_mean() == Rgb::ZERO);
        }
    }

    #[test]
    fn parts_join_to_the_bits_of_the_whole_and_come_back_from_bytes() {
        let mut stream = Stream::new(5, Purpose::Test, 0);
        let samples: Vec<Rgb> = (0..40)
            .map(|_| Rgb::splat(libm::exp(stream.range(-30.0, 30.0))))
            .chain([Rgb::NAN])
            .collect();
        let of = |samples: &[Rgb]| {
            let mut pixel = Pixel::default();
            samples.iter().for_each(|&sample| pixel.add(sample));
            pixel
        };
        let whole = of(&samples);
        for at in 0..=samples.len() {
            let mut bytes = Vec::new();
            of(&samples[at..]).write(&mut bytes);
            assert_eq!(bytes.len(), Pixel::BYTES);
            let mut pixel = Pixel::read(&bytes).expect("a pixel");
            pixel.join(&of(&samples[..at]));
            assert_eq!(pixel, whole);
            assert!(Pixel::read(&bytes[1..]).is_none() && Pixel::read(&[]).is_none());
        }
    }

    #[test]
    fn the_largest_film_takes_twelve_gigabytes() {
        let bytes = MAX_PIXELS * size_of::<Pixel>() as u64;
        assert!((11.5e9..12.5e9).contains(&(bytes as f64)), "{bytes}");
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
