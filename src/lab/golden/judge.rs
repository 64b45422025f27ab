//! New picture against golden: identical, equivalent or different.
//!
//! Pixels of one picture are not independent (photons are shared, a caustic falls on many), so they are never taken as a sample.
//! Independent are replicates: pictures of the same subject under other seeds. A golden keeps the means of its own replicates. The
//! new program draws the same ones, and Student's t judges the *differences in pairs*, new less stored, of the whole picture and of
//! each block. The pairs are independent of each other whatever the two of a pair have in common. Where the random numbers still
//! mean the same, the noise of a pair cancels and small changes are seen. Where they do not, the pair is two independent
//! pictures and the test is merely coarser. If nothing but the draws has changed, the differences are symmetric about 0, and on
//! symmetric heavy tails Student's t errs towards "no difference" (Efron 1969, Benjamini 1983).

use super::replicates::BLOCK;
use crate::image::ImageError;
use crate::image::metrics::{Block, blocks, same_size};
use crate::image::picture::Picture;
use crate::numeric::statistics::{
    Moments, holm_smallest, normal_quantile, student_quantile, two_sided_normal, two_sided_student,
};

/// Level of the tests of one golden: the chance that a picture of the same expectation, with other bits, is called different.
pub const LEVEL: f64 = 1e-4;
/// Pictures and means are stored as f32: differences of this share of a mean are rounding.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;
/// From here on Student's t is the normal distribution, to a thousandth of its p at the levels used here.
const NEARLY_NORMAL: f64 = 1e6;
/// The chance at which an effect counts as detectable.
const POWER: f64 = 0.9;

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
    /// Replicates that were compared; 0 if the bits alone decided.
    pub replicates: usize,
    /// p of "no difference" over the two families of tests, corrected for both; 1 if identical, 0 if nothing is random.
    pub p: f64,
    /// p of the picture's mean, corrected for the channels; as `p` where no statistics were made.
    pub p_mean: f64,
    /// p of the blocks, corrected for their number; as `p` where no statistics were made.
    pub p_blocks: f64,
    /// Smallest change of the picture's mean, as a share of it, that would have been called different with 90 % probability.
    pub detectable: f64,
    /// The same of the mean of a block, as a share of the block's or the picture's mean, whichever is greater: of the block where
    /// it is largest.
    pub detectable_block: f64,
    /// Largest difference of a value of the one picture.
    pub max: f64,
}

/// Compares bit by bit: identical or different.
///
/// # Errors
/// The pictures differ in size.
pub(super) fn by_bits(new: &Picture, golden: &Picture) -> Result<Check, ImageError> {
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
    let (verdict, p) = if new.digest() == golden.digest() {
        (GoldenVerdict::Identical, 1.0)
    } else {
        (GoldenVerdict::Different, 0.0)
    };
    Ok(Check {
        verdict,
        replicates: 0,
        p,
        p_mean: p,
        p_blocks: p,
        detectable: 0.0,
        detectable_block: 0.0,
        max,
    })
}

impl Check {
    /// What the replicates say about bits that differ: `fresh` of the new program, `stored` those of the golden under the same
    /// seeds. Both are tables of one size.
    pub(super) fn by_replicates(self, fresh: &Picture, stored: &Picture) -> Self {
        self.judged(fresh, |row, column, c| Expected {
            mean: f64::from(stored.rgb[row * stored.width + column][c]),
            variance: 0.0,
            margin: 0.0,
        })
    }

    /// What they say where the golden is independent truth, given once: a picture, known up to its variance (if it has one; its
    /// pixels are taken as independent) and to a relative `margin`.
    pub(super) fn by_truth(self, fresh: &Picture, truth: &Picture, margin: f64) -> Self {
        let mut columns = blocks(truth, truth.width.max(truth.height));
        columns.extend(blocks(truth, BLOCK));
        self.judged(fresh, |_, column, c| {
            let Block { mean, variance } = columns[column];
            Expected {
                mean: mean[c],
                variance: variance[c],
                margin,
            }
        })
    }

    fn judged(
        mut self,
        fresh: &Picture,
        expected: impl Fn(usize, usize, usize) -> Expected,
    ) -> Self {
        let compare = |column: usize, c: usize| Comparison::of(fresh, column, c, &expected);
        let mean = [0, 1, 2].map(|c| compare(0, c));
        let blocks: Vec<Comparison> = (1..fresh.width)
            .flat_map(|column| [0, 1, 2].map(|c| compare(column, c)))
            .collect();
        self.p_mean = holm_smallest(&mean.each_ref().map(Comparison::p));
        self.p_blocks = holm_smallest(&blocks.iter().map(Comparison::p).collect::<Vec<_>>());
        self.p = holm_smallest(&[self.p_mean, self.p_blocks]);
        // Holm's smallest p at the level is Bonferroni's: two families, their members, two tails.
        let tail = |members: usize| LEVEL / (2 * members * 2) as f64;
        let share = |comparison: &Comparison, c: usize, tail: f64| {
            let scale = mean[c].level.abs().max(comparison.level.abs());
            comparison.detectable(tail) / scale.max(f64::MIN_POSITIVE)
        };
        let of_mean = mean.iter().zip(0..3).map(|(m, c)| share(m, c, tail(3)));
        self.detectable = of_mean.fold(0.0, f64::max);
        let by_channel = blocks.iter().zip((0..3).cycle());
        let of_blocks = by_channel.map(|(b, c)| share(b, c, tail(blocks.len())));
        self.detectable_block = of_blocks.fold(0.0, f64::max);
        self.replicates = fresh.height;
        self.verdict = if self.p >= LEVEL {
            GoldenVerdict::Equivalent
        } else {
            GoldenVerdict::Different
        };
        self
    }
}

/// What a replicate's mean is compared with.
struct Expected {
    mean: f64,
    /// Variance that it has in common for all replicates.
    variance: f64,
    /// Relative difference that is forgiven.
    margin: f64,
}

/// The mean of a picture or block, in one channel, over the replicates.
struct Comparison {
    /// New less expected.
    differences: Moments,
    /// Mean of the expected.
    level: f64,
    /// Difference that is forgiven.
    slack: f64,
    /// Variance of the expected that all replicates have in common.
    common: f64,
}

impl Comparison {
    fn of(
        fresh: &Picture,
        column: usize,
        channel: usize,
        expected: impl Fn(usize, usize, usize) -> Expected,
    ) -> Self {
        let (mut differences, mut level) = (Moments::default(), Moments::default());
        let (mut margin, mut common) = (0.0, 0.0);
        for row in 0..fresh.height {
            let one = expected(row, column, channel);
            differences.add(f64::from(fresh.rgb[row * fresh.width + column][channel]) - one.mean);
            level.add(one.mean);
            (margin, common) = (one.margin, one.variance);
        }
        Self {
            differences,
            level: level.mean(),
            slack: (margin + ROUNDING) * level.mean().abs(),
            common,
        }
    }

    /// Two-sided p of a difference of at most the slack. Where nothing varies (a block without light), any difference beyond it
    /// has p 0 and none has p 1.
    fn p(&self) -> f64 {
        let difference = self.differences.mean().abs();
        let error = self.error();
        if !difference.is_finite() || !error.is_finite() {
            return 0.0;
        }
        if difference <= self.slack {
            return 1.0;
        }
        if error == 0.0 {
            return 0.0;
        }
        let t = (difference - self.slack) / error;
        match self.freedom() {
            freedom if freedom < NEARLY_NORMAL => two_sided_student(t, freedom),
            _ => two_sided_normal(t),
        }
    }

    fn error(&self) -> f64 {
        let own = self.differences.standard_error();
        (own * own + self.common).sqrt()
    }

    /// Of Welch and Satterthwaite; the common variance is known.
    fn freedom(&self) -> f64 {
        let own = self.differences.standard_error();
        let share = self.error() / own;
        (self.differences.count() as f64 - 1.0) * (share * share) * (share * share)
    }

    /// Difference that a test of this probability per tail sees with the chance [`POWER`].
    fn detectable(&self, tail: f64) -> f64 {
        let error = self.error();
        if error == 0.0 {
            return self.slack;
        }
        let quantile = match self.freedom() {
            freedom if freedom < NEARLY_NORMAL => student_quantile(1.0 - tail, freedom),
            _ => normal_quantile(1.0 - tail),
        };
        self.slack + (quantile + normal_quantile(POWER)) * error
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::golden::replicates::REPLICATES;
    use crate::numeric::rng::{Purpose, Stream};

    const BLOCKS: usize = 36;

    /// Tables of replicates whose blocks have mean 1 and the noise given; the last block is dark.
    fn table(seed: u64, noise: impl Fn(&mut Stream) -> f64) -> Picture {
        let mut stream = Stream::new(seed, Purpose::Test, 3);
        let mut rgb = Vec::new();
        for _ in 0..REPLICATES {
            let mut row: Vec<[f32; 3]> = (0..BLOCKS)
                .map(|_| [0; 3].map(|_| (1.0 + noise(&mut stream)) as f32))
                .collect();
            row[BLOCKS - 1] = [0.0; 3];
            let mean = [0, 1, 2].map(|c| row.iter().map(|b| b[c]).sum::<f32>() / BLOCKS as f32);
            rgb.push(mean);
            rgb.extend(row);
        }
        Picture {
            width: BLOCKS + 1,
            height: REPLICATES,
            rgb,
            ..Picture::default()
        }
    }

    fn bell(stream: &mut Stream) -> f64 {
        0.1 * ((0..12).map(|_| stream.uniform()).sum::<f64>() - 6.0)
    }

    /// Nearly always nothing, one time in fifty a lot: a block that few photons find.
    fn rare(stream: &mut Stream) -> f64 {
        if stream.uniform() < 0.02 { 30.0 } else { 0.0 }
    }

    /// Pareto, of infinite variance.
    fn heavy(stream: &mut Stream) -> f64 {
        libm::pow(1.0 - stream.uniform(), -1.0 / 1.5)
    }

    fn scaled(table: &Picture, gain: f64) -> Picture {
        let mut scaled = table.clone();
        for value in scaled.rgb.as_flattened_mut() {
            *value = (f64::from(*value) * gain) as f32;
        }
        scaled
    }

    fn bits_differ() -> Check {
        let mut golden = Picture {
            width: 1,
            height: 1,
            rgb: vec![[1.0; 3]],
            ..Picture::default()
        };
        let new = golden.clone();
        golden.rgb[0][1] = 1.5;
        by_bits(&new, &golden).unwrap()
    }

    fn judge(fresh: &Picture, stored: &Picture) -> Check {
        bits_differ().by_replicates(fresh, stored)
    }

    #[test]
    fn the_same_pixels_are_identical_and_one_bit_is_a_difference() {
        let golden = table(1, bell);
        let check = by_bits(&golden, &golden).unwrap();
        assert_eq!((check.verdict, check.p), (GoldenVerdict::Identical, 1.0));
        let mut new = golden.clone();
        new.rgb[5][1] = f32::from_bits(new.rgb[5][1].to_bits() + 1);
        let check = by_bits(&new, &golden).unwrap();
        assert_eq!((check.verdict, check.p), (GoldenVerdict::Different, 0.0));
        new.rgb[5][1] = f32::NAN;
        assert_eq!(by_bits(&new, &golden).unwrap().max, f64::INFINITY);
        assert!(by_bits(&Picture::default(), &golden).is_err());
    }

    /// 300 judgements of each kind of noise at level 1e-4: more than 2 false alarms have probability 4e-6.
    #[test]
    fn other_replicates_of_the_same_expectation_are_equivalent() {
        for noise in [bell, rare, heavy] {
            let alarms = (0..300).filter(|&i| {
                let check = judge(&table(2 * i, noise), &table(2 * i + 1, noise));
                check.verdict != GoldenVerdict::Equivalent
            });
            assert!(alarms.count() <= 2);
        }
    }

    /// 200 judgements of a change in one channel. At the detectable size (the largest of three estimates, so the chance is about
    /// .97) fewer than 170 have probability 1e-13; at half of it (.06) more than 40 have 1e-11.
    #[test]
    fn a_change_of_the_detectable_size_is_mostly_seen_and_half_of_it_seldom() {
        let reach = judge(&table(1, bell), &table(2, bell)).detectable;
        assert!((0.005..0.05).contains(&reach), "{reach}");
        let seen = |change: f64| {
            let different = |&i: &u64| {
                let mut new = table(2 * i, bell);
                for rgb in &mut new.rgb {
                    rgb[0] *= (1.0 + change) as f32;
                }
                judge(&new, &table(2 * i + 1, bell)).verdict == GoldenVerdict::Different
            };
            (0..200).filter(different).count()
        };
        let (whole, half) = (seen(reach), seen(0.5 * reach));
        assert!(whole >= 170 && half <= 40, "{whole} {half}");
    }

    #[test]
    fn where_the_noise_of_a_pair_is_common_far_smaller_changes_are_seen() {
        let golden = table(5, bell);
        let changed = judge(&scaled(&golden, 1.0001), &golden);
        assert_eq!(changed.verdict, GoldenVerdict::Different);
        assert!(changed.detectable < 1e-4, "{}", changed.detectable);
        let mut rounded = golden.clone();
        let lit = |value: &&mut f32| **value > 0.0;
        for value in rounded.rgb.as_flattened_mut().iter_mut().filter(lit) {
            *value = f32::from_bits(value.to_bits() + 1);
        }
        assert_eq!(judge(&rounded, &golden).verdict, GoldenVerdict::Equivalent);
    }

    #[test]
    fn a_change_of_one_block_that_the_mean_hides_is_seen() {
        let mut moved = table(7, bell);
        for row in moved.rgb.chunks_mut(BLOCKS + 1) {
            row[4][0] += 0.3;
            row[5][0] -= 0.3;
        }
        let check = judge(&moved, &table(8, bell));
        assert_eq!(check.verdict, GoldenVerdict::Different);
        assert!(check.p_mean > 0.01 && check.p_blocks < LEVEL, "{check:?}");
        // Two families share the level.
        assert_eq!(check.p, (2.0 * check.p_blocks).min(1.0));
        assert!(check.detectable_block < 0.3);
        assert!(check.detectable_block > check.detectable);
    }

    #[test]
    fn light_where_there_was_none_is_a_difference_and_darkness_is_none() {
        let golden = table(9, bell);
        let mut lit = golden.clone();
        for row in lit.rgb.chunks_mut(BLOCKS + 1) {
            row[BLOCKS][2] = 1e-20;
        }
        let check = judge(&lit, &golden);
        assert_eq!((check.verdict, check.p), (GoldenVerdict::Different, 0.0));
        let dark = scaled(&golden, 0.0);
        let check = judge(&dark, &dark);
        assert_eq!((check.verdict, check.p), (GoldenVerdict::Equivalent, 1.0));
        assert_eq!((check.detectable, check.detectable_block), (0.0, 0.0));
    }

    #[test]
    fn what_is_not_finite_is_a_difference() {
        let golden = table(10, bell);
        for bad in [f32::NAN, f32::INFINITY] {
            let mut new = golden.clone();
            new.rgb[3][0] = bad;
            let check = judge(&new, &golden);
            assert_eq!((check.verdict, check.p), (GoldenVerdict::Different, 0.0));
        }
    }

    /// One pixel of truth 1: the table has its mean and its one block.
    fn against_truth(gain: f64, variance: f32, margin: f64) -> GoldenVerdict {
        let truth = Picture {
            width: 1,
            height: 1,
            rgb: vec![[1.0; 3]],
            variance: Some(vec![[variance; 3]]),
            ..Picture::default()
        };
        let mut fresh = table(11, bell);
        fresh.rgb = fresh
            .rgb
            .chunks(BLOCKS + 1)
            .flat_map(|row| [row[0]; 2])
            .map(|rgb| rgb.map(|x| ((f64::from(x) * BLOCKS as f64 / 35.0) * gain) as f32))
            .collect();
        fresh.width = 2;
        bits_differ().by_truth(&fresh, &truth, margin).verdict
    }

    #[test]
    fn truth_is_met_within_the_noise_its_own_error_and_its_margin_and_no_further() {
        use GoldenVerdict::{Different, Equivalent};
        assert_eq!(against_truth(1.0, 0.0, 0.0), Equivalent);
        assert_eq!(against_truth(1.05, 0.0, 0.0), Different);
        assert_eq!(against_truth(1.05, 0.02 * 0.02, 0.0), Equivalent);
        assert_eq!(against_truth(1.05, 0.0, 0.05), Equivalent);
        assert_eq!(against_truth(1.1, 0.0, 0.05), Different);
    }
}
