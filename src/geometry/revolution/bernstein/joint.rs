//! Roots within rounding of a joint of two pieces.
//!
//! Such a root belongs to one of the two, and either answer is as good. Both pieces compute the value at the joint from the same
//! numbers, so its computed sign, right or wrong, gives the root to exactly one of them, provided that f runs through the joint:
//! that it is monotone on both sides, in the same direction, up to a value of certain sign. Where it turns back near the joint, or
//! where the profile ends, the sign matters, and only exact arithmetic knows it.

use super::isolate::{Bracket, Brackets, isolate_more};
use super::{Padded, Undecided};
use crate::numeric::polynomial::split;
use crate::numeric::simd::Portable;

/// A polynomial next to an end where its value is in doubt.
struct End {
    /// It is monotone up to this parameter, counted from the end.
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
        let size = c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let error = error + 9.0 * f64::EPSILON * size;
        [0.5, 0.125, 0.031_25, 0.007_812_5]
            .into_iter()
            .find_map(|share| {
                let (near, rest) = split(c, share);
                let rises = near.windows(2).all(|pair| pair[1] - pair[0] > 2.0 * error);
                let falls = near.windows(2).all(|pair| pair[0] - pair[1] > 2.0 * error);
                let certain = rises && near[6] > error || falls && near[6] < -error;
                certain.then_some(Self {
                    share,
                    positive: rises,
                    rest,
                    error,
                })
            })
    }
}

/// A bracket for each root of a piece whose value at one end or both is in doubt. `neighbour` gives the coefficients of the
/// piece that shares the start (0) or the end (1).
#[cold]
pub(super) fn isolate_at_joint(
    c: &Padded,
    error: f64,
    neighbour: impl Fn(usize) -> Option<Padded>,
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
        let here = End::new(&own, error).ok_or(Undecided)?;
        let [other @ .., _] = neighbour(side).ok_or(Undecided)?;
        let there = End::new(&turn(other, side == 0), error).ok_or(Undecided)?;
        if here.positive == there.positive {
            return Err(Undecided);
        }
        let [low, high] = range;
        let length = here.share * (high - low);
        let cut = if side == 0 {
            low + length
        } else {
            high - length
        };
        let part = if side == 0 { [low, cut] } else { [cut, high] };
        // Zero counts as positive, on both sides of the joint.
        if (own[0] >= 0.0) != here.positive {
            found.push(Bracket {
                low: part[0],
                high: part[1],
                guess: 0.5 * (part[0] + part[1]),
                falls: here.positive == (side == 1),
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
