//! Which pixels are sampled more.

use crate::scene::Rgb;
use crate::scene::texture::linear_to_srgb;

/// The pixels of rows of `width`, `count` in all, that differ from a neighbour above, below, left or right.
///
/// The mask is symmetric: of two differing neighbours both are marked. `differ` gets two indices.
pub fn mask(count: usize, width: usize, differ: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let mut mask = vec![false; count];
    for index in 0..count {
        let right = (index + 1) % width != 0 && differ(index, index + 1);
        let below = index + width < count && differ(index, index + width);
        if right {
            mask[index] = true;
            mask[index + 1] = true;
        }
        if below {
            mask[index] = true;
            mask[index + width] = true;
        }
    }
    mask
}

/// How different two radiances look: the sum over channels of the difference of their sRGB values, each within [0, 1]. The
/// measure of contrast thresholds (Whitted 1980; method 1 of POV-Ray).
pub fn contrast(a: Rgb, b: Rgb) -> f64 {
    let shown = |color: Rgb| color.map(|value| linear_to_srgb(value.clamp(0.0, 1.0)));
    (shown(a) - shown(b)).abs().element_sum()
}
