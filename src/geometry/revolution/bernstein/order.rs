//! The order of roots along a ray, as far as their tolerances tell it.

use super::line::Times;
use super::{Answer, Root, Undecided};
use crate::geometry::hit::Crossing;

/// The nearest of the roots named so far.
#[derive(Clone, Copy)]
pub(super) struct Leader {
    root: Root,
    piece: u32,
    /// The least t that another may have.
    rival: f64,
}

impl Leader {
    /// No root yet.
    pub(super) const NONE: Self = Self {
        root: Root {
            u: 0.0,
            t: f64::INFINITY,
            tolerance: 0.0,
        },
        piece: 0,
        rival: f64::INFINITY,
    };

    #[inline(always)]
    pub(super) fn add(&mut self, piece: u32, root: &Root) {
        let leads = root.t < self.root.t;
        let beaten = if leads { &self.root } else { root };
        let rival = beaten.t - beaten.tolerance;
        self.rival = if rival < self.rival {
            rival
        } else {
            self.rival
        };
        if leads {
            self.root = *root;
            self.piece = piece;
        }
    }

    /// The nearest crossing, if no other may be as near.
    #[inline(always)]
    pub(super) fn crossing(&self, times: &Times) -> Answer {
        let Root { u, t, tolerance } = self.root;
        if t == f64::INFINITY {
            return Ok(None);
        }
        if self.rival <= t + tolerance {
            return Err(Undecided);
        }
        times.crossing(self.piece, t, u).map(Some)
    }
}

/// All crossings in order, if the tolerances of no two meet.
pub(super) fn in_order(
    mut roots: Vec<(u32, Root)>,
    times: &Times,
) -> Result<Vec<Crossing>, Undecided> {
    roots.sort_by(|(_, a), (_, b)| a.t.total_cmp(&b.t));
    let mut latest = f64::NEG_INFINITY;
    let crossings = roots.iter().map(|(piece, root)| {
        if root.t - root.tolerance <= latest {
            return Err(Undecided);
        }
        latest = latest.max(root.t + root.tolerance);
        times.crossing(*piece, root.t, root.u)
    });
    crossings.collect()
}
