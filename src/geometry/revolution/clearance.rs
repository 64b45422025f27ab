//! Where the standard offset from the surface is certain to be right, worked out once for a surface.
//!
//! A parameter is *clear* if, within `reach` of the profile there, the profile is one single arc whose direction hardly turns. In
//! three dimensions the surface is then one nearly flat sheet within that distance: points of one meridian are never farther from
//! a revolved curve than from the curve itself, and the arc is farther than `reach` from the axis.

use crate::geometry::profile::{Piece, Profile};

/// Cells of a piece are halved this often: what stays in doubt next to a joint is at least a thousandth of a piece.
const DEPTH: u32 = 10;
/// Halvings of another arc before it counts as near.
const ARC_DEPTH: u32 = 8;
/// A chord shorter than this part of the profile has lost too many digits for its direction to be trusted.
const LEAST_CHORD: f64 = 1e-9;

/// The parameters of each piece that are not certainly clear.
#[derive(Clone, Debug)]
pub(super) struct Clearance {
    doubtful: Vec<Vec<[f64; 2]>>,
}

impl Clearance {
    /// Searches a profile; `reach` in the profile's own units, at least some hundred roundings of its size.
    pub(super) fn new(profile: &Profile, reach: f64) -> Self {
        let whole: Vec<Arc> = profile.pieces().iter().map(Arc::of).collect();
        let (radius, height) = profile.control_size();
        let search = |index: usize| {
            let mut search = Search {
                whole: &whole,
                index,
                reach,
                least_chord: LEAST_CHORD * (radius + height),
                doubtful: Vec::new(),
            };
            let others: Vec<usize> = (0..whole.len())
                .filter(|&other| other != index && !profile.pieces()[other].on_axis())
                .collect();
            search.visit([0.0, 1.0], &others, 0);
            search.doubtful
        };
        Self {
            doubtful: (0..whole.len()).map(search).collect(),
        }
    }

    /// Whether the profile is certainly clear there.
    #[inline]
    pub(super) fn holds(&self, piece: u32, u: f64) -> bool {
        let inside = |&[low, high]: &[f64; 2]| low <= u && u <= high;
        !self.doubtful[piece as usize].iter().any(inside)
    }
}

/// The search along one piece.
struct Search<'a> {
    whole: &'a [Arc],
    index: usize,
    reach: f64,
    least_chord: f64,
    doubtful: Vec<[f64; 2]>,
}

impl Search<'_> {
    /// Halves until clear or deep enough; `others` are the pieces that may come near.
    fn visit(&mut self, cell: [f64; 2], others: &[usize], depth: u32) {
        let [low, high] = cell;
        let own = &self.whole[self.index];
        let bounds = own.between(cell).bounds();
        let near: Vec<usize> = (others.iter().copied())
            .filter(|&other| !self.is_far(&bounds, &self.whole[other], ARC_DEPTH))
            .collect();
        if near.is_empty() && self.is_clear(own, cell, &bounds) {
            return;
        }
        if depth < DEPTH {
            let middle = 0.5 * (low + high);
            self.visit([low, middle], &near, depth + 1);
            self.visit([middle, high], &near, depth + 1);
        } else {
            match self.doubtful.last_mut() {
                Some(last) if last[1] == low => last[1] = high,
                _ => self.doubtful.push(cell),
            }
        }
    }

    /// Whether the piece itself is one flat arc around the cell, off the axis, and far from the cell elsewhere.
    fn is_clear(&self, own: &Arc, [low, high]: [f64; 2], bounds: &Bounds) -> bool {
        let width = high - low;
        let (before, after) = (low - width, high + width);
        before >= 0.0
            && after <= 1.0
            && own.between([before, after]).is_flat(self.least_chord)
            && bounds.radius[0] > self.reach
            && self.is_far(bounds, &own.between([0.0, before]), ARC_DEPTH)
            && self.is_far(bounds, &own.between([after, 1.0]), ARC_DEPTH)
    }

    /// Whether every point of an arc is certainly farther than the reach.
    fn is_far(&self, from: &Bounds, arc: &Arc, depth: u32) -> bool {
        from.distance(&arc.bounds()) > self.reach
            || depth > 0
                && [[0.0, 0.5], [0.5, 1.0]]
                    .iter()
                    .all(|&half| self.is_far(from, &arc.between(half), depth - 1))
    }
}

/// Control radii and heights of a part of a piece.
#[derive(Clone, Copy)]
pub(super) struct Arc {
    radius: [f64; 4],
    height: [f64; 4],
}

impl Arc {
    pub(super) fn of(piece: &Piece) -> Self {
        Self {
            radius: piece.radius,
            height: piece.height,
        }
    }

    /// The part between two parameters, by blossoming.
    pub(super) fn between(&self, [a, b]: [f64; 2]) -> Self {
        Self {
            radius: blossom(&self.radius, a, b),
            height: blossom(&self.height, a, b),
        }
    }

    /// Greatest distance, in either coordinate, of a control point from a point.
    pub(super) fn distance_from(&self, [radius, height]: [f64; 2]) -> f64 {
        let farthest = |values: &[f64; 4], from: f64| {
            values
                .iter()
                .fold(0.0, |far: f64, value| far.max((value - from).abs()))
        };
        farthest(&self.radius, radius).max(farthest(&self.height, height))
    }

    fn bounds(&self) -> Bounds {
        let range = |values: &[f64; 4]| {
            let low = values.iter().fold(f64::INFINITY, |low, &x| low.min(x));
            let high = values
                .iter()
                .fold(f64::NEG_INFINITY, |high, &x| high.max(x));
            [low, high]
        };
        // The surface is that of |r|.
        let radius = match range(&self.radius) {
            [low, high] if low >= 0.0 => [low, high],
            [low, high] if high <= 0.0 => [-high, -low],
            [low, high] => [0.0, high.max(-low)],
        };
        Bounds {
            radius,
            height: range(&self.height),
        }
    }

    /// Whether every tangent is within 27° of the chord and none is much shorter than it.
    fn is_flat(&self, least_chord: f64) -> bool {
        let (r, h) = (&self.radius, &self.height);
        let chord = [r[3] - r[0], h[3] - h[0]];
        let square = chord[0] * chord[0] + chord[1] * chord[1];
        square > least_chord * least_chord
            && (0..3).all(|i| {
                let step = [r[i + 1] - r[i], h[i + 1] - h[i]];
                let along = step[0] * chord[0] + step[1] * chord[1];
                let across = step[0] * chord[1] - step[1] * chord[0];
                along > 2.0 * across.abs() && along > 0.05 * square
            })
    }
}

/// Control values of a cubic between two parameters.
fn blossom(c: &[f64; 4], a: f64, b: f64) -> [f64; 4] {
    let mix = |u: f64, x: f64, y: f64| (1.0 - u) * x + u * y;
    let value = |s: f64, t: f64, u: f64| {
        let [p, q, r] = [0, 1, 2].map(|i| mix(s, c[i], c[i + 1]));
        mix(u, mix(t, p, q), mix(t, q, r))
    };
    [
        value(a, a, a),
        value(a, a, b),
        value(a, b, b),
        value(b, b, b),
    ]
}

/// Ranges of |r| and of h.
struct Bounds {
    radius: [f64; 2],
    height: [f64; 2],
}

impl Bounds {
    /// A lower bound of the distance, up to rounding.
    fn distance(&self, other: &Self) -> f64 {
        let gap = |a: [f64; 2], b: [f64; 2]| (a[0] - b[1]).max(b[0] - a[1]);
        gap(self.radius, other.radius).max(gap(self.height, other.height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share_in_doubt(profile: &Profile, reach: f64) -> f64 {
        let doubtful = Clearance::new(profile, reach).doubtful;
        let lengths = doubtful.iter().flatten().map(|[low, high]| high - low);
        lengths.sum::<f64>() / profile.pieces().len() as f64
    }

    #[test]
    fn ordinary_cups_are_clear_but_for_the_neighbourhood_of_joints() {
        for profile in [Profile::cup(), Profile::hourglass()] {
            let share = share_in_doubt(&profile, 1e-12);
            assert!(share > 0.0 && share < 0.006, "{share}");
        }
    }

    /// A wall 1e-9 thick: clear for a reach below that, not above.
    #[test]
    fn a_wall_thinner_than_the_reach_is_in_doubt() {
        let thin = 1.0 + 1e-9;
        let line = |from: [f64; 2], to: [f64; 2]| {
            let mix = |w: f64| [0, 1].map(|k| (1.0 - w) * from[k] + w * to[k]);
            Piece::new([from, mix(1.0 / 3.0), mix(2.0 / 3.0), to])
        };
        let corners = [[1.0, 0.0], [thin, 0.0], [thin, 1.0], [1.0, 1.0]];
        let pieces = (0..4).map(|i| line(corners[i], corners[(i + 1) % 4]));
        let ring = Profile::new(pieces.collect()).unwrap();
        let narrow = Clearance::new(&ring, 1e-10);
        let wide = Clearance::new(&ring, 2e-9);
        assert!(narrow.holds(1, 0.5) && narrow.holds(3, 0.5));
        assert!(!wide.holds(1, 0.5) && !wide.holds(3, 0.5));
    }

    #[test]
    fn joints_cusps_and_the_axis_are_in_doubt() {
        let cup = Clearance::new(&Profile::cup(), 1e-12);
        for (piece, u) in [(0, 0.0), (1, 0.0), (1, 1.0), (5, 1.0)] {
            assert!(!cup.holds(piece, u));
        }
        let cusp = Piece::new([[1.0, 0.0], [2.0, 1.0], [1.0, 1.0], [2.0, 0.0]]);
        let cusp = Clearance::new(&Profile::new(vec![cusp]).unwrap(), 1e-12);
        assert!(!cusp.holds(0, 0.5) && cusp.holds(0, 0.25));
    }
}
