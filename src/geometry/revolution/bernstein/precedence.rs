//! Which pieces a ray meets only after another one, whatever the ray.
//!
//! Let a ray that is not level have exactly one crossing with piece X, inside its range. As it climbs (rays that descend see the
//! profile upside down) it meets no other piece Z before that
//!
//! 1. if no height of Z lies below X's greatest. If that height is common to both, neither crosses it: X is monotone in height, and the
//!    sign of f at the ends of X is certain; or X is flat, and what Z has at that height is the joint with X alone.
//! 2. if X and Z are monotone in height, Z begins no lower than X, and at every height that they share X lies farther from the axis than
//!    Z, where the ray *enters* X: f(X) rises along it. Before the crossing the ray is outside of X, so outside of Z, too.
//! 3. likewise if X lies nearer to the axis than Z, and the ray *leaves* X: before, it is inside of X, so inside of Z, too.
//!
//! The first holds after any crossing with X, where the sign of f at its ends is certain; the others take the only one. Such pieces need
//! not be solved: [`Later`] names them.

use super::{PreparedPiece, Slope};
use crate::numeric::polynomial::cubic;

/// Pieces looked at together, by rank. A piece is left out for those of its own group or an earlier one only, so that rays alone and in
/// lanes leave out the same ones.
pub(super) const GROUP: usize = 8;

/// Sets of pieces that are met only after one, as bits of their ranks (of the first 64).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Later {
    /// After any crossing.
    pub(super) always: u64,
    /// After the only crossing, where f rises with u (0) or falls (1).
    once: [u64; 2],
}

impl Later {
    pub(super) const NONE: Self = Self {
        always: 0,
        once: [0; 2],
    };

    /// The pieces met after the only crossing.
    #[inline(always)]
    pub(super) fn than(&self, falls: bool) -> u64 {
        // No branch: nobody can foresee it.
        self.once[usize::from(falls)]
    }
}

/// Fills in what comes later than each piece.
pub(super) fn find(pieces: &mut [PreparedPiece]) {
    for place in 0..pieces.len() {
        let found = [true, false].map(|climbs| later(pieces, place, climbs));
        let piece = &mut pieces[place];
        piece.later = found;
        piece.looks_back = found.iter().zip(piece.ranks).any(|(later, rank)| {
            let least = (later.once[0] | later.once[1]).trailing_zeros();
            (least as usize) < rank
        });
    }
}

fn later(pieces: &[PreparedPiece], place: usize, climbs: bool) -> Later {
    let piece = &pieces[place];
    let direction = usize::from(!climbs);
    let mut later = Later::NONE;
    // f is positive inside: it falls along a ray that leaves.
    let rises = (piece.slope == Slope::Rises) == climbs;
    for (other_place, other) in pieces.iter().enumerate() {
        let rank = other.ranks[direction];
        let own = piece.ranks[direction];
        if other_place == place || rank >= 64 || rank / GROUP < own / GROUP {
            continue;
        }
        let joined = piece.neighbours.contains(&Some(other_place));
        let follows = follows(piece, other, climbs, joined);
        let (enters, leaves) = if first(other, climbs) >= first(piece, climbs) {
            (encloses(piece, other), encloses(other, piece))
        } else {
            (false, false)
        };
        let [rising, falling] = if rises {
            [enters, leaves]
        } else {
            [leaves, enters]
        };
        let bit = |set: bool| u64::from(set) << rank;
        later.always |= bit(follows);
        later.once[0] |= bit(follows || rising);
        later.once[1] |= bit(follows || falling);
    }
    later
}

/// The height at which rays first come to a piece, counted along them.
fn first(piece: &PreparedPiece, climbs: bool) -> f64 {
    if climbs { piece.bottom } else { -piece.top }
}

fn last(piece: &PreparedPiece, climbs: bool) -> f64 {
    -first(piece, !climbs)
}

/// Whether every height of `other` comes after those of `piece`, but for a joint.
fn follows(piece: &PreparedPiece, other: &PreparedPiece, climbs: bool, joined: bool) -> bool {
    let (end, start) = (last(piece, climbs), first(other, climbs));
    let clear = if piece.flat {
        joined && !other.flat && other.slope != Slope::Turns
    } else {
        piece.slope != Slope::Turns
    };
    start > end || start == end && clear
}

/// Parts into which the heights that two pieces share are cut to compare radii.
const SLICES: u32 = 64;

/// More than the rounding of heights and radii, which are below 2.
const MARGIN: f64 = 1e-12;

/// Whether `outer` is certainly farther from the axis than `inner` at every height that they share, and there are such heights. A
/// `false` says nothing.
fn encloses(outer: &PreparedPiece, inner: &PreparedPiece) -> bool {
    let is_monotone = |piece: &PreparedPiece| !piece.flat && piece.slope != Slope::Turns;
    let low = outer.bottom.max(inner.bottom);
    let high = outer.top.min(inner.top);
    if !(is_monotone(outer) && is_monotone(inner) && low < high) {
        return false;
    }
    let height = |slice: u32| low + (high - low) * (f64::from(slice) / f64::from(SLICES));
    (0..SLICES).all(|slice| {
        let heights = [height(slice) - MARGIN, height(slice + 1) + MARGIN];
        let [least, _] = radii(outer, heights);
        let [_, most] = radii(inner, heights);
        least > most + MARGIN
    })
}

/// Bounds of |r| on the part of a monotone piece between two heights, from the control values of that part.
fn radii(piece: &PreparedPiece, [low, high]: [f64; 2]) -> [f64; 2] {
    let rises = piece.slope == Slope::Rises;
    let [start, end] = if rises { [low, high] } else { [high, low] };
    let before = |u: f64, height: f64| (cubic(&piece.curve.height, u).0 < height) == rises;
    let (mut u, mut v) = ([0.0, 1.0], [0.0, 1.0]);
    for _ in 0..53 {
        for (range, height) in [(&mut u, start), (&mut v, end)] {
            let middle = 0.5 * (range[0] + range[1]);
            range[usize::from(!before(middle, height))] = middle;
        }
    }
    let control = part(&piece.curve.radius, u[0], v[1]);
    let least = control.into_iter().fold(f64::INFINITY, f64::min);
    let most = control.into_iter().fold(f64::NEG_INFINITY, f64::max);
    [least.max(-most).max(0.0), most.max(-least)]
}

/// Control values of a cubic between two parameters, by blossoming (Ramshaw 1987).
fn part(c: &[f64; 4], u: f64, v: f64) -> [f64; 4] {
    let blossom = |parameters: [f64; 3]| {
        let mut c = *c;
        for (step, s) in parameters.into_iter().enumerate() {
            for i in 0..3 - step {
                c[i] = (1.0 - s) * c[i] + s * c[i + 1];
            }
        }
        c[0]
    };
    [[u, u, u], [u, u, v], [u, v, v], [v, v, v]].map(blossom)
}

#[cfg(test)]
mod tests {
    use super::super::super::exact;
    use super::super::Prepared;
    use super::super::isolate::{ALL, changes_once};
    use super::super::line::Line;
    use super::*;
    use crate::geometry::profile::Profile;
    use crate::geometry::ray::Ray;
    use crate::geometry::specimens::{Specimen, line, piece, random_profile};
    use crate::numeric::rng::{Purpose, Stream};
    use crate::numeric::simd::{Lanes, Portable};
    use glam::DVec3;

    /// Whether exactly one crossing with a piece is certain, and if so, whether f falls with u there.
    fn only_crossing(line: &Line, piece: &PreparedPiece) -> Option<bool> {
        let (positive, negative) = Portable.beyond(&line.coefficients(piece), line.error);
        let (positive, negative) = (positive & ALL, negative & ALL);
        let once = changes_once(positive.into(), negative.into()) && line.holds(piece);
        once.then_some(positive & 1 != 0)
    }

    /// A ray through the neighbourhood of the profile's outline.
    fn ray(profile: &Profile, s: &mut Stream) -> Ray {
        let mut point = |reach: f64| DVec3::from_array([0; 3].map(|_| s.range(-reach, reach)));
        let (towards, from) = (point(1.5), point(8.0));
        let count = profile.pieces().len();
        let piece = &profile.pieces()[s.range(0.0, count as f64) as usize % count];
        let station = piece.at(s.uniform());
        let target = DVec3::new(station.radius, station.height, 0.0) + 0.3 * towards;
        Ray::new(from, target - from)
    }

    /// An upright wall, a disc on it, and from there a wall that ends lower: within the first, bulging below it; or outside of it, with
    /// negative radii.
    fn walls() -> [Profile; 2] {
        let within = piece([1.0, 0.5, 5.0, 1.0], [2.0, 1.0, 0.0, -1.0]);
        let outside = piece([-3.0; 4], [2.0, 1.5, 1.0, 0.5]);
        [within, outside].map(|other| {
            let disc = line([2.0, 2.0], [other.radius[0], 2.0]);
            let wall = piece([2.0; 4], [1.0, 1.25, 1.75, 2.0]);
            Profile::new(vec![wall, disc, other]).expect("a chain")
        })
    }

    /// By the exact solver. Planted: `encloses` and `follows` always true, `rises` turned around, where Z begins left out of
    /// account, r for |r|.
    #[test]
    fn what_is_left_out_is_met_later() {
        let mut s = Stream::new(41, Purpose::Test, 0);
        let specimens = Specimen::ALL.iter().map(Specimen::profile);
        let profiles: Vec<Profile> = specimens
            .chain(walls())
            .chain((0..60).map(|_| random_profile(&mut s)))
            .collect();
        let mut compared = [0; 2];
        for profile in &profiles {
            let prepared = Prepared::new(profile);
            for _ in 0..300 {
                let ray = ray(profile, &mut s);
                let (line, fine) = Line::new(&prepared, &ray);
                if !fine || line.is_nearly_level() {
                    continue;
                }
                let crossings = exact::crossings(profile, &ray);
                let direction = usize::from(!line.climbs());
                for piece in &prepared.pieces {
                    let Some(falls) = only_crossing(&line, piece) else {
                        continue;
                    };
                    let own = crossings.iter().find(|c| c.piece == piece.index);
                    let own = own.expect("the only crossing").t;
                    let later = &piece.later[direction];
                    for other in &prepared.pieces {
                        let is_in = |ranks: u64| ranks >> other.ranks[direction] & 1 != 0;
                        if !is_in(later.than(falls)) {
                            continue;
                        }
                        for crossing in crossings.iter().filter(|c| c.piece == other.index) {
                            assert!(crossing.t >= own, "{} {}", piece.index, other.index);
                            compared[usize::from(is_in(later.always))] += 1;
                        }
                    }
                }
            }
        }
        assert!(compared[0] > 300 && compared[1] > 1000, "{compared:?}");
    }

    /// Places of the pieces that come later than piece `place` for rays that climb (`direction` 0) or descend.
    fn later_than(prepared: &Prepared, place: usize, direction: usize, falls: bool) -> Vec<usize> {
        let later = prepared.pieces[place].later[direction].than(falls);
        (0..prepared.pieces.len())
            .filter(|&other| later >> prepared.pieces[other].ranks[direction] & 1 != 0)
            .collect()
    }

    /// Caps, and four walls from the bottom to the top, one above the other.
    #[test]
    fn the_pieces_of_the_hourglass_are_met_in_their_order() {
        let hourglass = Prepared::new(&Profile::hourglass());
        for place in 0..6 {
            for falls in [false, true] {
                let above: Vec<usize> = (place + 1..6).collect();
                let below: Vec<usize> = (0..place).collect();
                assert_eq!(later_than(&hourglass, place, 0, falls), above);
                assert_eq!(later_than(&hourglass, place, 1, falls), below);
            }
        }
    }

    /// Piece 3 is the outside, which rises, piece 5 the inside, which falls, from the same height; piece 4 is the rim. What goes into the
    /// cup's wall from outside meets the inside later; what goes into it from inside meets the outside later.
    #[test]
    fn the_wall_of_the_cup_is_met_from_either_side() {
        let cup = Prepared::new(&Profile::cup());
        assert_eq!(later_than(&cup, 3, 0, false), [4, 5]);
        assert_eq!(later_than(&cup, 3, 0, true), [4]);
        assert_eq!(later_than(&cup, 3, 1, true), [0, 1, 2, 5]);
        assert_eq!(later_than(&cup, 3, 1, false), [0, 1, 2]);
        // The inside begins higher than the outside: before, the ray may have left.
        assert_eq!(later_than(&cup, 5, 0, false), [4]);
        assert_eq!(later_than(&cup, 5, 1, true), [0, 1, 2, 3]);
        assert_eq!(later_than(&cup, 5, 1, false), [0, 1, 2]);
        let looks_back: Vec<usize> = (0..6).filter(|&i| cup.pieces[i].looks_back).collect();
        assert_eq!(looks_back, [5]);
    }
}
