//! New picture against golden: identical, equivalent or different.

use crate::image::ImageError;
use crate::image::metrics::{self, Block, blocks, same_size};
use crate::image::picture::Picture;
use crate::numeric::statistics::{
    Moments, holm_smallest, normal_quantile, student, student_quantile, two_sided_normal,
    two_sided_student,
};

/// Level of the tests of one golden: the chance that a re-render of the same expectation, with other bits, is called different.
pub const LEVEL: f64 = 1e-4;
/// Side of the blocks that are compared, in pixels.
const BLOCK: usize = 8;
/// Pixels are stored as f32: differences of this share of the mean are rounding.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;
/// The three-way verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoldenVerdict {
    /// Every pixel has the same bits.
    Identical,
    /// Bits differ, statistics show no difference.
    Equivalent,
    /// They show one, or there is nothing random that could excuse it.
    Different,
}

impl GoldenVerdict {
    /// The word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Equivalent => "equivalent",
            Self::Different => "different",
        }
    }
}

/// What a check found.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The verdict.
    pub verdict: GoldenVerdict,
    /// p of "no difference" over the two families of tests, corrected for both; 1 if identical, 0 if nothing is random.
    pub p: f64,
    /// p of the picture's mean, corrected for the channels; as `p` where no statistics were made.
    pub p_mean: f64,
    /// p of the blocks, corrected for their number; as `p` where no statistics were made.
    pub p_blocks: f64,
    /// Smallest relative change of the picture's mean that would have been called different with 90 % probability.
    pub detectable: f64,
    /// Largest difference of a value.
    pub max: f64,
}

/// Compares a new picture with a golden. Where `deterministic`, every bit counts; elsewhere differences within the noise, plus
/// a relative `margin`, are equivalent.
///
/// Two families of tests share [`LEVEL`]: the mean of the picture by its paired 8×8-block differences (Student's t, or z
/// where a picture has one block only), and each block by the variances that the pictures carry (z, Holm). The block test takes
/// the two pictures as independent, which errs towards "equivalent" when they share random numbers; the paired one does not.
pub fn judge(
    new: &Picture,
    golden: &Picture,
    deterministic: bool,
    margin: f64,
) -> Result<Check, ImageError> {
    same_size(new, golden)?;
    let flat = new.rgb.as_flattened().iter().zip(golden.rgb.as_flattened());
    let max = flat.fold(0.0, |max: f64, (a, b)| {
        let difference = f64::from((a - b).abs());
        if difference.is_nan() {
            f64::INFINITY
        } else {
            max.max(difference)
        }
    });
    if new.digest() == golden.digest() {
        return Ok(Check {
            verdict: GoldenVerdict::Identical,
            p: 1.0,
            p_mean: 1.0,
            p_blocks: 1.0,
            detectable: 0.0,
            max,
        });
    }
    let random =
        !deterministic && new.variance.is_some() && golden.variance.is_some() && max.is_finite();
    let (p_mean, p_blocks, detectable) = if random {
        statistics(new, golden, margin)
    } else {
        (0.0, 0.0, 0.0)
    };
    let p = holm_smallest(&[p_blocks, p_mean]);
    let verdict = if p >= LEVEL {
        GoldenVerdict::Equivalent
    } else {
        GoldenVerdict::Different
    };
    Ok(Check {
        verdict,
        p,
        p_mean,
        p_blocks,
        detectable,
        max,
    })
}

/// p of the mean, p of the blocks, and the detectable relative change of the mean.
fn statistics(new: &Picture, golden: &Picture, margin: f64) -> (f64, f64, f64) {
    let pairs: Vec<(Block, Block)> = blocks(new, BLOCK)
        .into_iter()
        .zip(blocks(golden, BLOCK))
        .collect();
    let mut p_values = Vec::new();
    for (a, b) in &pairs {
        for c in 0..3 {
            let noise = (a.variance[c] + b.variance[c]).sqrt() + ROUNDING * b.mean[c].abs();
            p_values.push(two_sided_normal(
                beyond(a.mean[c] - b.mean[c], margin * b.mean[c].abs())
                    / noise.max(f64::MIN_POSITIVE),
            ));
        }
    }
    let by_block = holm_smallest(&p_values);
    let mut by_mean = Vec::new();
    let mut detectable = 0.0_f64;
    for (c, &mean) in metrics::mean(golden).iter().enumerate() {
        let paired = Moments::of(pairs.iter().map(|(a, b)| a.mean[c] - b.mean[c]));
        let slack = margin * mean.abs() + ROUNDING * mean.abs();
        let error = paired.standard_error();
        if paired.count() < 2 || error == 0.0 {
            continue;
        }
        let test = student(&paired, 0.0);
        by_mean.push(two_sided_student(
            beyond(paired.mean(), slack) / error,
            test.freedom,
        ));
        let reach = student_quantile(1.0 - LEVEL / 12.0, test.freedom) + normal_quantile(0.9);
        detectable = detectable.max((slack + reach * error) / mean.abs().max(f64::MIN_POSITIVE));
    }
    (holm_smallest(&by_mean), by_block, detectable)
}

/// How far a difference is beyond a margin.
fn beyond(difference: f64, margin: f64) -> f64 {
    (difference.abs() - margin).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    const SIDE: usize = 48;

    /// Pixels of mean 1 (times `gain`) and variance 0.01: sums of twelve uniform numbers.
    fn noisy(seed: u64, gain: f64) -> Picture {
        let mut stream = Stream::new(seed, Purpose::Test, 3);
        let mut noise = || (0..12).map(|_| stream.uniform()).sum::<f64>() - 6.0;
        Picture {
            width: SIDE,
            height: SIDE,
            rgb: (0..SIDE * SIDE)
                .map(|_| [0; 3].map(|_| (gain * (1.0 + 0.1 * noise())) as f32))
                .collect(),
            variance: Some(vec![[0.01; 3]; SIDE * SIDE]),
            ..Picture::default()
        }
    }

    fn verdict(new: &Picture, golden: &Picture) -> GoldenVerdict {
        judge(new, golden, false, 0.0).unwrap().verdict
    }

    #[test]
    fn the_same_pixels_are_identical_whatever_their_statistics() {
        let golden = noisy(1, 1.0);
        let new = Picture {
            variance: None,
            ..golden.clone()
        };
        assert_eq!(verdict(&new, &golden), GoldenVerdict::Identical);
    }

    /// 300 pairs at level 1e-4: more than 2 false alarms have probability 4e-6.
    #[test]
    fn other_noise_of_the_same_expectation_is_equivalent() {
        let alarms = (0..300).filter(|&i| {
            verdict(&noisy(2 * i, 1.0), &noisy(2 * i + 1, 1.0)) != GoldenVerdict::Equivalent
        });
        assert!(alarms.count() <= 2);
    }

    #[test]
    fn a_change_of_the_detectable_size_is_seen_in_other_noise() {
        let check = judge(&noisy(1, 1.0), &noisy(2, 1.0), false, 0.0).unwrap();
        assert!(
            (0.005..0.03).contains(&check.detectable),
            "{}",
            check.detectable
        );
        let seen = (0..50).filter(|&i| {
            verdict(
                &noisy(2 * i, 1.0 + check.detectable),
                &noisy(2 * i + 1, 1.0),
            ) == GoldenVerdict::Different
        });
        assert!(seen.count() >= 35);
    }

    #[test]
    fn in_the_same_noise_far_smaller_changes_are_seen() {
        assert_eq!(
            verdict(&noisy(5, 1.0001), &noisy(5, 1.0)),
            GoldenVerdict::Different
        );
        let mut rounded = noisy(5, 1.0);
        for value in rounded.rgb.as_flattened_mut() {
            *value = f32::from_bits(value.to_bits() + 1);
        }
        assert_eq!(verdict(&rounded, &noisy(5, 1.0)), GoldenVerdict::Equivalent);
    }

    #[test]
    fn a_local_change_that_keeps_the_mean_is_seen() {
        let mut moved = noisy(7, 1.0);
        for y in 0..16 {
            for x in 0..8 {
                moved.rgb[y * SIDE + x].iter_mut().for_each(|v| *v += 0.2);
                moved.rgb[y * SIDE + x + 8]
                    .iter_mut()
                    .for_each(|v| *v -= 0.2);
            }
        }
        assert_eq!(verdict(&moved, &noisy(8, 1.0)), GoldenVerdict::Different);
    }

    #[test]
    fn where_nothing_is_random_one_bit_is_a_difference() {
        let golden = noisy(9, 1.0);
        let mut new = golden.clone();
        new.rgb[5][1] = f32::from_bits(new.rgb[5][1].to_bits() + 1);
        let check = judge(&new, &golden, true, 0.0).unwrap();
        assert_eq!((check.verdict, check.p), (GoldenVerdict::Different, 0.0));
        new.rgb[5][1] = f32::NAN;
        assert_eq!(verdict(&new, &golden), GoldenVerdict::Different);
        assert!(judge(&Picture::default(), &golden, false, 0.0).is_err());
    }

    #[test]
    fn a_margin_forgives_the_goldens_own_error_and_no_more() {
        let judged = |gain: f64| {
            judge(&noisy(3, gain), &noisy(3, 1.0), false, 0.01)
                .unwrap()
                .verdict
        };
        assert_eq!(judged(1.009), GoldenVerdict::Equivalent);
        assert_eq!(judged(1.03), GoldenVerdict::Different);
    }
}
