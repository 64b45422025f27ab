//! Balls by sixteens in f32, with bounds that leave a doubt rather than err: most queries are decided at half the width of f64.

use super::boxes::{Packet, WIDTH};
use crate::numeric::simd::Lanes;
use glam::DVec3;

/// Up to sixteen balls, seen from an origin. Places without a ball cover nothing for certain and anything perhaps.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Rough {
    center: [[f32; WIDTH]; 3],
    /// Rounded squares of distances up to here are covered,
    inside: [f32; WIDTH],
    /// those above this are not.
    outside: [f32; WIDTH],
}

impl Rough {
    /// Of centres and squared radii.
    ///
    /// With the unit u = 2⁻²⁴ of f32, D = |q − c| and C the distance of c from the origin: the coordinates of q and c from the origin
    /// are rounded by u each, and |q − origin| ≤ C + D, so their difference is off by at most 2 u C + 2 u D and a little; the squares
    /// and their sum add 1.5 u D. Where squares underflow, less than 2⁻⁷³ is added to D. So 8 u (r + C) + 2⁻⁷⁰ on both sides of r is
    /// more than all of these and the rounding of the bounds themselves, and leaves 2 u r, beside which the rounding of the exact
    /// predicate, some 2⁻⁵¹ r, is nothing.
    pub(super) fn of(centers: &[DVec3], radii_squared: &[f64], origin: DVec3) -> Self {
        const UNIT: f64 = 0.5 * f32::EPSILON as f64;
        const UNDERFLOW: f64 = f64::from_bits((1023 - 70) << 52);
        /// Squares of what is below do not overflow.
        const MOST: f64 = (1_u64 << 60) as f64;
        let mut rough = Self {
            center: [[0.0; WIDTH]; 3],
            inside: [-1.0; WIDTH],
            outside: [f32::INFINITY; WIDTH],
        };
        for (i, (&center, radius_squared)) in centers.iter().zip(radii_squared).enumerate() {
            let from_origin = center - origin;
            let (far, radius) = (from_origin.length(), radius_squared.sqrt());
            // Others leave every query in doubt. Not with a NaN in place of the square: their centres are left at the origin.
            if far.max(radius) > MOST {
                continue;
            }
            let doubt = 8.0 * UNIT * (radius + far) + UNDERFLOW;
            let (less, more) = (radius - doubt, radius + doubt);
            for axis in 0..3 {
                rough.center[axis][i] = from_origin[axis] as f32;
            }
            if less > 0.0 {
                rough.inside[i] = (less * less) as f32;
            }
            rough.outside[i] = (more * more) as f32;
        }
        rough
    }

    /// Writes the places of the queries of a packet from the same origin that ball `i` covers, which count from `first`, to the
    /// front of `out`, and returns how many; or nothing, where f32 leaves a doubt.
    #[inline(always)]
    pub(super) fn covered<L: Lanes>(
        &self,
        i: usize,
        Packet([x, y, z]): &Packet,
        first: u32,
        out: &mut [u32; WIDTH],
        lanes: L,
    ) -> Option<usize> {
        let i = i % WIDTH;
        let mut squares = [0.0; WIDTH];
        for k in 0..WIDTH {
            let x = x[k] - self.center[0][i];
            let y = y[k] - self.center[1][i];
            let z = z[k] - self.center[2][i];
            squares[k] = x * x + y * y + z * z;
        }
        let surely = lanes.places_at_most(&squares, self.inside[i], first, out);
        let perhaps = lanes.at_most(&squares, self.outside[i]);
        (surely == perhaps).then_some(surely.count_ones() as usize)
    }
}
