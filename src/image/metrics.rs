//! Differences between two pictures, in f64 on linear radiance. The second picture is the reference.

use super::ImageError;
use super::picture::Picture;
use crate::numeric::statistics::{holm_smallest, ks_uniform, two_sided_normal};
use serde::Serialize;

/// Side of the blocks over which p-values are taken, in pixels.
pub const BLOCK: usize = 16;

/// Added to the squared reference in the relative error, so that black pixels count but do not rule.
const RELATIVE_FLOOR: f64 = 0.01;

/// How far picture a is from the reference b. Scalars are means over all pixels and the three channels. What is not finite
/// (because a pixel is not, or because `psnr` has no error to measure) is written as `null`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width of both, in pixels.
    pub width: usize,
    /// Height of both, in pixels.
    pub height: usize,
    /// Mean of (a − b)².
    pub mse: f64,
    /// Root of `mse`.
    pub rmse: f64,
    /// Mean of (a − b)²/(b² + 0.01).
    pub relmse: f64,
    /// 10 log₁₀(1/mse): the peak is 1. Infinite (`null` in JSON) when nothing differs.
    pub psnr: f64,
    /// Largest |a − b|.
    pub max: f64,
    /// Whether every value of R, G, B has the same bits.
    pub identical: bool,
    /// Mean of a per channel.
    pub mean_a: [f64; 3],
    /// Mean of b per channel.
    pub mean_b: [f64; 3],
    /// `mean_a` − `mean_b`.
    pub bias: [f64; 3],
    /// Pixels that are NaN or infinite in a or b.
    pub not_finite: usize,
    /// What the variances say, if both pictures carry them.
    #[serde(flatten)]
    pub p_values: Option<PValues>,
}

/// Tests of "the two pictures have the same expectation". They assume that pixels are independent, which holds for `path` and
/// not for photon maps, where neighbours share photons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PValues {
    /// Standard error of `bias` per channel.
    pub bias_se: [f64; 3],
    /// z of `bias` per channel.
    pub z: [f64; 3],
    /// Two-sided p of `z`.
    pub p_mean: [f64; 3],
    /// Smallest p over the 16×16-pixel blocks and channels, corrected for their number (Holm 1979).
    pub p_blocks: f64,
    /// p of the blocks' p-values being uniform (Kolmogorov-Smirnov): small also when the pictures agree too well.
    pub p_uniform: f64,
    /// Number of block p-values.
    pub blocks: usize,
}

/// Mean of one block of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Mean per channel.
    pub mean: [f64; 3],
    /// Variance of that mean, were pixels independent; 0 if the picture carries no variance.
    pub variance: [f64; 3],
}

/// Compares `a` with the reference `b`.
pub fn compare(a: &Picture, b: &Picture) -> Result<Comparison, ImageError> {
    same_size(a, b)?;
    let (mut square, mut relative, mut max) = (0.0, 0.0, 0.0_f64);
    let values = a.rgb.as_flattened().iter().zip(b.rgb.as_flattened());
    for (&x, &y) in values.clone() {
        let (x, y) = (f64::from(x), f64::from(y));
        let error = (x - y) * (x - y);
        square += error;
        relative += error / (y * y + RELATIVE_FLOOR);
        max = max.max((x - y).abs());
    }
    let count = a.rgb.as_flattened().len() as f64;
    let mse = square / count;
    let (mean_a, mean_b) = (mean(a), mean(b));
    Ok(Comparison {
        width: a.width,
        height: a.height,
        mse,
        rmse: mse.sqrt(),
        relmse: relative / count,
        psnr: -10.0 * libm::log10(mse),
        // The maximum of floats drops NaN, the sum of squares keeps it.
        max: if square.is_nan() { f64::NAN } else { max },
        identical: values.into_iter().all(|(x, y)| x.to_bits() == y.to_bits()),
        mean_a,
        mean_b,
        bias: std::array::from_fn(|c| mean_a[c] - mean_b[c]),
        not_finite: not_finite(a, b),
        p_values: p_values(a, b),
    })
}

/// Error unless both pictures have the same size.
pub fn same_size(a: &Picture, b: &Picture) -> Result<(), ImageError> {
    if (a.width, a.height) == (b.width, b.height) {
        return Ok(());
    }
    Err(ImageError::Sizes {
        a_width: a.width,
        a_height: a.height,
        b_width: b.width,
        b_height: b.height,
    })
}

/// Mean of each channel.
pub fn mean(picture: &Picture) -> [f64; 3] {
    mean_of(&picture.rgb)
}

fn mean_of(pixels: &[[f32; 3]]) -> [f64; 3] {
    let count = pixels.len() as f64;
    std::array::from_fn(|c| pixels.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>() / count)
}

fn not_finite(a: &Picture, b: &Picture) -> usize {
    let finite = |pixel: &[f32; 3]| pixel.iter().all(|x| x.is_finite());
    let pairs = a.rgb.iter().zip(&b.rgb);
    pairs.filter(|(x, y)| !finite(x) || !finite(y)).count()
}

/// Means over blocks of `side` × `side` pixels, row by row from the top; blocks at the right and lower border may be smaller.
pub fn blocks(picture: &Picture, side: usize) -> Vec<Block> {
    let mut all = Vec::new();
    for top in (0..picture.height).step_by(side) {
        for left in (0..picture.width).step_by(side) {
            all.push(block(picture, left, top, side));
        }
    }
    all
}

fn block(picture: &Picture, left: usize, top: usize, side: usize) -> Block {
    let right = (left + side).min(picture.width);
    let bottom = (top + side).min(picture.height);
    let rows = (top..bottom).map(|y| y * picture.width + left..y * picture.width + right);
    let gather = |pixels: &[[f32; 3]]| {
        let part: Vec<[f32; 3]> = rows.clone().flat_map(|row| pixels[row].to_vec()).collect();
        mean_of(&part)
    };
    let count = ((right - left) * (bottom - top)) as f64;
    let variance = picture.variance.as_deref().map_or([0.0; 3], gather);
    Block {
        mean: gather(&picture.rgb),
        variance: variance.map(|v| v / count),
    }
}

fn p_values(a: &Picture, b: &Picture) -> Option<PValues> {
    if a.variance.is_none() || b.variance.is_none() {
        return None;
    }
    let whole = a.width.max(a.height);
    let total = z_of(&block(a, 0, 0, whole), &block(b, 0, 0, whole));
    let each: Vec<f64> = blocks(a, BLOCK)
        .iter()
        .zip(&blocks(b, BLOCK))
        .flat_map(|(x, y)| z_of(x, y).map(|(_, z)| two_sided_normal(z)))
        .collect();
    let z = total.map(|(_, z)| z);
    Some(PValues {
        bias_se: total.map(|(se, _)| se),
        z,
        p_mean: z.map(two_sided_normal),
        p_blocks: holm_smallest(&each),
        p_uniform: ks_uniform(&each).p,
        blocks: each.len(),
    })
}

/// Standard error and z of the difference of two means, per channel. Without any variance a difference is infinitely
/// significant, and equality is none.
fn z_of(x: &Block, y: &Block) -> [(f64, f64); 3] {
    std::array::from_fn(|c| {
        let difference = x.mean[c] - y.mean[c];
        let error = (x.variance[c] + y.variance[c]).sqrt();
        let z = if difference == 0.0 {
            0.0
        } else {
            difference / error
        };
        (error, z)
    })
}
