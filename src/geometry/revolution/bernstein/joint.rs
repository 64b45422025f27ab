//! Roots within rounding of a joint of two pieces.
//!
//! Such a root belongs to one of the two, and where both tell t as well, either answer is as good. Both pieces compute the value at the joint from the same
//! numbers, so its computed sign, right or wrong, gives the root to exactly one of them, provided that f runs through the joint:
//! that it is monotone on both sides, in the same direction, up to a value of certain sign. Where it turns back near the joint, or
//! where the profile ends, the sign matters, and only exact arithmetic knows it.
//!
//! In the middle of a cap the profile ends on the axis. There r = 0, so f = −|q|² ≤ 0 however near the ray passes; and where f = 0,
//! f′ = 2 D r r′ − 2 (q·d) h′ is 0 too. If f is certainly convex up to a value of certain sign, it has one root before that if the
//! value is positive, and none if it is negative.

use super::isolate::{Bracket, Brackets, Site, isolate_more};
use super::line::{Line, clamped};
use super::refine::search;
use super::{Cubics, Padded, Root, Undecided};
use crate::numeric::polynomial::{cubic, split};
use crate::numeric::simd::Portable;

/// What lies beyond an end of a piece.
pub(super) enum Beyond {
    /// A piece with these coefficients.
    Piece(Padded),
    /// The same surface: the end is the middle of a cap.
    Axis,
    Nothing,
}

/// A polynomial next to an end where its value is in doubt.
struct End {
    /// It is monotone, or at a tip convex, up to this parameter, counted from the end.
    share: f64,
    /// Whether it is certainly positive there; otherwise it is certainly negative.
    positive: bool,
    /// The rest, beginning at `share`.
    rest: [f64; 7],
    error: f64,
}

impl End {
    /// The longest of four parts next to the start on which the polynomial is certainly monotone.
    fn new(c: &[f64; 7], error: f64) -> Option<Self> {
        Self::find(c, error, |near, error| {
            let rises = near.windows(2).all(|pair| pair[1] - pair[0] > 2.0 * error);
            let falls = near.windows(2).all(|pair| pair[0] - pair[1] > 2.0 * error);
            rises && near[6] > error || falls && near[6] < -error
        })
    }

    /// The longest part on which it is certainly convex.
    fn at_tip(c: &[f64; 7], error: f64) -> Option<Self> {
        Self::find(c, error, |near, error| {
            let bend = |c: &[f64]| (c[2] - c[1]) - (c[1] - c[0]);
            near.windows(3).all(|three| bend(three) > 4.0 * error) && near[6].abs() > error
        })
    }

    fn find(c: &[f64; 7], error: f64, certain: impl Fn(&[f64; 7], f64) -> bool) -> Option<Self> {
        let size = c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let error = error + 9.0 * f64::EPSILON * size;
        [0.5, 0.125, 0.031_25, 0.007_812_5]
            .into_iter()
            .find_map(|share| {
                let (near, rest) = split(c, share);
                certain(&near, error).then_some(Self {
                    share,
                    positive: near[6] > 0.0,
                    rest,
                    error,
                })
            })
    }
}

/// A bracket for each root of a piece whose value at one end or both is in doubt. `beyond` tells what lies beyond the start (0) or
/// the end (1).
#[cold]
pub(super) fn isolate_at_joint(
    c: &Padded,
    error: f64,
    beyond: impl Fn(usize) -> Beyond,
) -> Result<Brackets, Undecided> {
    let mut found = Brackets::new();
    let [mut c @ .., _] = *c;
    let mut error = error;
    let mut range = [0.0, 1.0];
    for side in [0, 1] {
        // Seen from the doubtful end, so that both sides are alike.
        let turn = |mut c: [f64; 7], turned: bool| {
            if turned {
                c.reverse();
            }
            c
        };
        let own = turn(c, side == 1);
        if own[0].abs() > error {
            continue;
        }
        let (here, site) = match beyond(side) {
            Beyond::Piece([other @ .., _]) => {
                let here = End::new(&own, error).ok_or(Undecided)?;
                let there = End::new(&turn(other, side == 0), error).ok_or(Undecided)?;
                if here.positive == there.positive {
                    return Err(Undecided);
                }
                (here, Site::Joint(side))
            }
            Beyond::Axis => (End::at_tip(&own, error).ok_or(Undecided)?, Site::Tip),
            Beyond::Nothing => return Err(Undecided),
        };
        let [low, high] = range;
        let length = here.share * (high - low);
        let cut = if side == 0 {
            low + length
        } else {
            high - length
        };
        let part = if side == 0 { [low, cut] } else { [cut, high] };
        // Zero counts as positive, on both sides of the joint, but not in the middle of a cap.
        let starts_positive = matches!(site, Site::Joint(_)) && own[0] >= 0.0;
        if starts_positive != here.positive {
            found.push(Bracket {
                low: part[0],
                high: part[1],
                place: 3.0,
                sides: [
                    0.0,
                    if here.positive == (side == 1) {
                        -1.0
                    } else {
                        1.0
                    },
                ],
                bends: [0.0; 2],
                site,
            })?;
        }
        range[side] = cut;
        c = turn(here.rest, side == 1);
        error = here.error;
    }
    let c = std::array::from_fn(|i| c[i.min(6)]);
    isolate_more(Portable, &c, range, error, &mut found)?;
    found.sort();
    Ok(found)
}

impl Line {
    /// The root next to the middle of a cap. As f has another as far beyond the end, |d_y| |r| − |q|, whose root is simple, stands for it;
    /// the cap is level there, so its height gives t.
    #[cold]
    pub(super) fn tip_root(&self, curve: &Cubics, bracket: &Bracket, steps: &mut u64) -> Root {
        let (o, d, q) = (self.aim.o, self.aim.d, self.aim.q);
        let value = |u: f64| {
            let (r, r_slope) = cubic(&curve.radius, u);
            let (h, h_slope) = cubic(&curve.height, u);
            let (qx, qz) = (q[0] + h * d.x, q[1] + h * d.z);
            let length = (qx * qx + qz * qz).sqrt();
            let drift = (qx * d.x + qz * d.z) * h_slope / length;
            let drift = if length > 0.0 { drift } else { 0.0 };
            let slope = d.y.abs() * (r_slope * r.signum()) - drift;
            (d.y.abs() * r.abs() - length, slope)
        };
        let u = search(bracket, steps, value);
        let (rest, slope) = value(u);
        let u = clamped(u - rest / slope, bracket.low, bracket.high);
        let (h, h_slope) = cubic(&curve.height, u);
        let mut root = self.flat_root(u, (h - o.y) / d.y);
        // The rounding of q moves u, and with it the height.
        root.tolerance *= 1.0 + 2.0 * (h_slope / slope).abs();
        root
    }
}
