//! The order of roots along a ray, as far as their tolerances tell it.

use super::line::Times;
use super::{Answer, Root, Undecided};
use crate::geometry::hit::Crossing;

/// The nearest of the roots named so far. Whichever order they are named in, the answer is the same, but that of roots of one piece at the
/// same t the first counts.
#[derive(Clone, Copy)]
pub(super) struct Leader {
    root: Root,
    piece: u32,
    /// The least t that a root may have, its piece, and the least that one of any other piece may have.
    least: f64,
    of: u32,
    others: f64,
}

impl Leader {
    /// No root yet.
    pub(super) const NONE: Self = Self {
        root: Root {
            u: 0.0,
            t: f64::INFINITY,
            tolerance: 0.0,
        },
        piece: u32::MAX,
        least: f64::INFINITY,
        of: u32::MAX,
        others: f64::INFINITY,
    };

    #[inline(always)]
    pub(super) fn add(&mut self, piece: u32, root: &Root) {
        let earliest = root.t - root.tolerance;
        if earliest < self.least {
            if piece != self.of {
                self.others = self.least;
            }
            (self.least, self.of) = (earliest, piece);
        } else if piece != self.of && earliest < self.others {
            self.others = earliest;
        }
        if root.t < self.root.t {
            self.root = *root;
            self.piece = piece;
        }
    }

    /// The nearest crossing, if none of another piece may be as near. Sheets of one piece that turns back may lie in one another: of two
    /// nearer to each other than their tolerances either is the answer.
    #[inline(always)]
    pub(super) fn crossing(&self, times: &Times) -> Answer {
        let Root { u, t, tolerance } = self.root;
        if t == f64::INFINITY {
            return Ok(None);
        }
        let rival = if self.of == self.piece {
            self.others
        } else {
            self.least
        };
        if rival <= t + tolerance {
            return Err(Undecided);
        }
        times.crossing(self.piece, t, u).map(Some)
    }
}

/// All crossings in order, if the tolerances of no two of different pieces meet.
pub(super) fn in_order(
    mut roots: Vec<(u32, Root)>,
    times: &Times,
) -> Result<Vec<Crossing>, Undecided> {
    roots.sort_by(|(_, a), (_, b)| a.t.total_cmp(&b.t));
    let crossings = roots.iter().enumerate().map(|(place, (piece, root))| {
        let earliest = root.t - root.tolerance;
        let meets = |(other, before): &(u32, Root)| {
            other != piece && before.t + before.tolerance >= earliest
        };
        if roots[..place].iter().any(meets) {
            return Err(Undecided);
        }
        times.crossing(*piece, root.t, root.u)
    });
    crossings.collect()
}
