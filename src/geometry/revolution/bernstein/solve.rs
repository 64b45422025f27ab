//! One ray against all pieces.

use super::isolate::{
    ALL, Bracket, Brackets, Sight, Site, changes_once, isolate, isolate_each, look, sight,
};
use super::joint::{Beyond, isolate_at_joint};
use super::line::Line;
use super::order::{Leader, in_order};
use super::precedence::GROUP;
use super::refine::{STEPS, find, refine, refine_more, search};
use super::{Answer, Padded, Prepared, PreparedPiece, Root, Slope, Undecided, level};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::cubic;
use crate::numeric::simd::{Kernel, Lanes, Portable};
use crate::numeric::work::Work;

/// See [`Prepared::nearest`].
pub(super) struct Nearest<'a> {
    pub(super) prepared: &'a Prepared,
    pub(super) ray: &'a Ray,
    pub(super) work: &'a mut Work,
}

impl Kernel for Nearest<'_> {
    type Output = Answer;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Answer {
        let Self {
            prepared,
            ray,
            work,
        } = self;
        let (line, fine) = Line::new(prepared, ray);
        if !fine {
            return Err(Undecided);
        }
        if prepared.misses(&line, work) {
            return Ok(None);
        }
        let mut leader = Leader::NONE;
        let mut add = |piece: &PreparedPiece, root: Root| {
            let inside = line.times.has(&root)?;
            if inside {
                leader.add(piece.index, &root);
            }
            Ok(inside)
        };
        if line.is_nearly_level() {
            line.solve_level(prepared, work, &mut add)?;
        } else {
            line.brackets(lanes, prepared, Wanted::Nearest, &mut |place, bracket| {
                let piece = &prepared.pieces[place];
                let root = line.root(&prepared.pieces, piece, bracket, work)?;
                Ok(add(piece, root)?.then(|| line.after(&root)))
            })?;
        }
        leader.crossing(&line.times)
    }
}

/// See [`Prepared::crossings`].
pub(super) struct All<'a> {
    pub(super) prepared: &'a Prepared,
    pub(super) ray: &'a Ray,
    pub(super) work: &'a mut Work,
}

impl Kernel for All<'_> {
    type Output = Result<Vec<Crossing>, Undecided>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Self::Output {
        let Self {
            prepared,
            ray,
            work,
        } = self;
        let (line, fine) = Line::new(prepared, ray);
        if !fine {
            return Err(Undecided);
        }
        if prepared.misses(&line, work) {
            return Ok(Vec::new());
        }
        let mut found = Vec::new();
        let mut add = |piece: &PreparedPiece, root: Root| {
            let inside = line.times.has(&root)?;
            if inside {
                found.push((piece.index, root));
            }
            Ok(inside)
        };
        if line.is_nearly_level() {
            line.solve_level(prepared, work, &mut add)?;
        } else {
            line.brackets(lanes, prepared, Wanted::All, &mut |place, bracket| {
                let piece = &prepared.pieces[place];
                add(piece, line.root(&prepared.pieces, piece, bracket, work)?)?;
                Ok(None)
            })?;
        }
        in_order(found, &line.times)
    }
}

impl Prepared {
    /// Whether the cylinder culls the ray, which is counted.
    #[inline(always)]
    pub(super) fn misses(&self, line: &Line, work: &mut Work) -> bool {
        self.culls && count(line.outside, work)
    }
}

/// Counts a ray as culled by the cylinder or as passed on to the solver.
#[inline(always)]
pub(super) fn count(culled: bool, work: &mut Work) -> bool {
    work.bounds_tests += 1;
    work.bounds_culled += u64::from(culled);
    work.solver_calls += u64::from(!culled);
    culled
}

/// Which crossings of a ray are asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    Nearest,
    All,
}

/// The coefficients of a group of pieces, each row in one line of the cache.
#[repr(C, align(64))]
struct Rows([Padded; GROUP]);

impl Line {
    /// Names the brackets of a ray that is not nearly level, in the order of meeting, as (place in `pieces`, bracket). Where the nearest
    /// is `wanted`, pieces that the ray is certain to meet later than another are left out.
    ///
    /// `take` answers with a height once it knows that the ray has a crossing no later: the search ends there.
    #[inline(always)]
    pub(super) fn brackets(
        &self,
        lanes: impl Lanes,
        prepared: &Prepared,
        wanted: Wanted,
        take: &mut impl FnMut(usize, &Bracket) -> Result<Option<f64>, Undecided>,
    ) -> Result<(), Undecided> {
        let nearest = wanted == Wanted::Nearest;
        let climbs = self.climbs();
        let direction = usize::from(!climbs);
        let mut end = self.end();
        let mut found = Brackets::new();
        let mut later = 0_u64;
        for (first, order) in (0..).step_by(GROUP).zip(prepared.order(self).chunks(GROUP)) {
            let here = |ranks: u64| ranks.checked_shr(first).unwrap_or(0) as u32;
            let mut c = Rows([[0.0; 8]; GROUP]);
            let mut signs = [(0, 0); GROUP];
            let mut waiting = 0_u32;
            for (i, (&place, c)) in order.iter().zip(&mut c.0).enumerate() {
                let piece = &prepared.pieces[place];
                *c = self.coefficients(piece);
                let (positive, negative) = lanes.beyond(c, self.error);
                let (positive, negative) = (positive & ALL, negative & ALL);
                let idle = (positive == ALL) | (negative == ALL) | self.misses_heights(piece);
                waiting |= u32::from(!idle) << i;
                signs[i] = (positive, negative);
                if nearest && piece.looks_back {
                    let once = changes_once(positive.into(), negative.into());
                    let left_out = piece.later[direction].than(positive & 1 != 0);
                    later |= left_out * u64::from(once & self.holds(piece));
                }
            }
            waiting &= !here(later);
            while waiting != 0 {
                let i = waiting.trailing_zeros() as usize % GROUP;
                waiting &= waiting - 1;
                let piece = &prepared.pieces[order[i]];
                if self.meets_after(piece, end) {
                    return Ok(());
                }
                let certain = nearest && self.holds(piece);
                let backwards = (piece.slope == Slope::Rises) != climbs;
                let (positive, negative) = signs[i];
                found.clear();
                match sight(|k| c.0[i][k], positive, negative, [0.0, 1.0]) {
                    Sight::None => continue,
                    Sight::One(bracket) => {
                        found.push(bracket)?;
                        let left_out = piece.later[direction].than(bracket.falls());
                        later |= left_out * u64::from(certain);
                        waiting &= !here(later);
                    }
                    Sight::Many => {
                        let all = !certain || piece.slope == Slope::Turns;
                        let range = [0.0, 1.0];
                        isolate_each(lanes, &c.0[i], range, self.error, backwards, |bracket| {
                            found.push(bracket)?;
                            Ok(all)
                        })?;
                        let left_out = piece.later[direction].always;
                        later |= left_out * u64::from(certain & !found.as_slice().is_empty());
                        waiting &= !here(later);
                    }
                    Sight::Doubtful => {
                        found = self.isolate_doubtful(&c.0[i], &prepared.pieces, piece)?;
                        if backwards {
                            found.reverse();
                        }
                    }
                }
                for bracket in found.as_slice() {
                    if let Some(height) = take(order[i], bracket)? {
                        end = self.sooner(end, height);
                        // The other brackets lie later along the ray.
                        if piece.slope != Slope::Turns {
                            break;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// The root in a bracket, for a ray that is not nearly level.
    #[inline(always)]
    fn root(
        &self,
        pieces: &[PreparedPiece],
        piece: &PreparedPiece,
        bracket: &Bracket,
        work: &mut Work,
    ) -> Result<Root, Undecided> {
        let steps = &mut work.solver_iterations;
        if let Site::Tip = bracket.site {
            return Ok(self.tip_root(&piece.curve, bracket, steps));
        }
        *steps += STEPS;
        let refined = refine(&piece.curve, &self.aim, bracket);
        let root = if refined.sure {
            refined.root
        } else {
            refine_more(&piece.curve, &self.aim, bracket, &refined, steps)
        };
        match bracket.site {
            Site::Joint(side) => self.at_joint(pieces, piece, side, root),
            _ => Ok(root),
        }
    }

    /// A root at a joint may truly lie on the neighbour, whose tolerance then counts too; where that is not small, neither piece's t
    /// stands for the other's.
    #[cold]
    #[inline(never)]
    fn at_joint(
        &self,
        pieces: &[PreparedPiece],
        piece: &PreparedPiece,
        side: usize,
        mut root: Root,
    ) -> Result<Root, Undecided> {
        let next = &pieces[piece.neighbours[side].ok_or(Undecided)?].curve;
        let (there, _) = self.aim.newton(next, [1.0, 0.0][side], root.t);
        root.tolerance += there.tolerance + (there.t - root.t).abs();
        // A NaN is not small.
        let small = root.tolerance <= 1e-13 * (self.aim.reach + 4.0 * root.t.abs() + 1.0);
        small.then_some(root).ok_or(Undecided)
    }

    #[cold]
    #[inline(never)]
    fn isolate_doubtful(
        &self,
        c: &Padded,
        pieces: &[PreparedPiece],
        piece: &PreparedPiece,
    ) -> Result<Brackets, Undecided> {
        isolate_at_joint(c, self.error, |side| match piece.neighbours[side] {
            Some(place) => Beyond::Piece(self.coefficients(&pieces[place])),
            None if piece.tips[side] => Beyond::Axis,
            None => Beyond::Nothing,
        })
    }

    /// Reports the roots of a nearly level ray.
    #[inline(never)]
    fn solve_level(
        &self,
        prepared: &Prepared,
        work: &mut Work,
        found: &mut impl FnMut(&PreparedPiece, Root) -> Result<bool, Undecided>,
    ) -> Result<(), Undecided> {
        let steps = &mut work.solver_iterations;
        for piece in &prepared.pieces {
            if piece.flat {
                self.solve_flat(piece, steps, found)?;
                continue;
            }
            let mut roots = level::Roots::default();
            if level::solve(self, piece, steps, &mut roots).is_ok() {
                for root in roots.iter() {
                    found(piece, *root)?;
                }
                continue;
            }
            if self.is_level() {
                return Err(Undecided);
            }
            let c = self.coefficients(piece);
            let brackets = match look(Portable, &c, [0.0, 1.0], self.error) {
                Sight::None => continue,
                // A neighbour is solved by other arithmetic, which need not take what this piece would give away: it is none here.
                Sight::Doubtful => isolate_at_joint(&c, self.error, |side| {
                    let alone = piece.neighbours[side].is_none();
                    if alone && piece.tips[side] {
                        Beyond::Axis
                    } else {
                        Beyond::Nothing
                    }
                })?,
                _ => isolate(Portable, &c, [0.0, 1.0], self.error)?,
            };
            for bracket in brackets.as_slice() {
                let root = match bracket.site {
                    Site::Tip => self.tip_root(&piece.curve, bracket, steps),
                    _ => find(&piece.curve, &self.aim, bracket, steps),
                };
                found(piece, root)?;
            }
        }
        Ok(())
    }

    /// A flat piece and a nearly level ray: t is known, and r² = |o + t d|² in the plane remains. A ray in the plane has no hit.
    fn solve_flat(
        &self,
        piece: &PreparedPiece,
        steps: &mut u64,
        found: &mut impl FnMut(&PreparedPiece, Root) -> Result<bool, Undecided>,
    ) -> Result<(), Undecided> {
        let curve = &piece.curve;
        let height = curve.height[0];
        let Some((t, distance, error)) = self.plane(height) else {
            return Ok(());
        };
        let square = distance * distance;
        let c = piece.radius_squared.map(|r2| r2 - square);
        for bracket in isolate(Portable, &c, [0.0, 1.0], error)?.as_slice() {
            let u = search(bracket, steps, |u| {
                let (r, slope) = cubic(&curve.radius, u);
                (r * r - square, 2.0 * r * slope)
            });
            found(piece, self.flat_root(u, t))?;
        }
        Ok(())
    }
}
