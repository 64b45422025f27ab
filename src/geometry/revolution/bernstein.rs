//! Roots of the degree-6 polynomial, isolated in Bernstein form: the default solver.
//!
//! Eliminating θ and t from o + t d = S(u, θ) leaves, with q(u) = q₀ + h(u) (d_x, d_z) and
//! q₀ = (o_x d_y − o_y d_x, o_z d_y − o_y d_z),
//!
//! ```text
//! f(u) = d_y² r(u)² − |q(u)|²          (degree 6 for a cubic piece; positive inside the tube that the ray's own height sees)
//! fᵢ   = D R2ᵢ − A H2ᵢ − 2 B Hᵢ − K,    D = d_y², A = d_x² + d_z², B = q₀·(d_x, d_z), K = |q₀|²
//! ```
//!
//! where R2, H2, H are the Bernstein coefficients of r², h², h (van Wijk 1984; Toth 1985 for the use of sign certainty). The sign
//! changes of fᵢ bound the number of roots; subdivision isolates them, bracketed Newton steps on the factored f refine them.
//! Near-perpendicular rays make f almost a square, whose two roots drown in rounding: the module `level` solves them by branches.
//! Flat pieces reduce to r(u)² = ρ² at the known t.
//!
//! **What is certain.** Every decision (is there a root, is it in the range) compares a value with a bound of its rounding error.
//! Where the bound is the greater, the solver says [`Undecided`] and the caller asks the exact solver; that takes a ray within some
//! 1e-13 (relative) of a tangency, of a joint, of the axis at a cap, or of an end of its range. A ray that runs inside a flat piece,
//! along a generator of a cone or inside a cylinder's wall does not hit that piece; pieces on the axis are not surfaces.

mod isolate;
mod joint;
mod level;
mod line;

use super::super::bounds::cubic_range;
use super::super::hit::Crossing;
use super::super::profile::{Piece, Profile};
use super::super::ray::Ray;
use crate::numeric::polynomial::{cubic, cubic_extrema, elevate, product};
use crate::numeric::work::Work;
use isolate::{Bracket, isolate, refine};
use joint::isolate_at_joint;
use line::Line;

/// The f64 solver cannot tell hit from miss, or one side of the range's end from the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Undecided;

/// A profile made ready: scaled by a power of two to the size 1, centred in height, with the coefficients that no ray changes.
#[derive(Clone, Debug)]
pub struct Prepared {
    pieces: Vec<PreparedPiece>,
    /// Places in `pieces` by rising lower end, the order of meeting for rays that climb.
    rising: Vec<usize>,
    /// Places in `pieces` by falling upper end, for rays that descend.
    falling: Vec<usize>,
    /// Height that is 0 after centring.
    middle: f64,
    /// Lengths are divided by 2 to this power.
    exponent: i32,
    /// Greatest control radius after scaling.
    radius: f64,
    /// Greatest control height after centring and scaling.
    height: f64,
}

/// Seven Bernstein coefficients, the last one twice: an even count suits vector registers.
type Padded = [f64; 8];

/// One piece, scaled and centred.
#[derive(Clone, Debug)]
struct PreparedPiece {
    index: u32,
    radius: [f64; 4],
    height: [f64; 4],
    radius_squared: Padded,
    height_squared: Padded,
    height_raised: Padded,
    bottom: f64,
    top: f64,
    flat: bool,
    /// Places of the pieces that share the start and the end.
    neighbours: [Option<usize>; 2],
    /// Parameters 0, the extrema of h, 1.
    breaks: Vec<f64>,
    /// Bound of |h″|.
    bend: f64,
    /// Bound of |(r²)′|.
    spread: f64,
}

/// A root: the curve there, and the ray's parameter in scaled units.
#[derive(Clone, Copy)]
struct Root {
    u: f64,
    t: f64,
    /// Bound of the error of `t`.
    tolerance: f64,
    height: f64,
}

impl Prepared {
    /// Prepares a profile.
    pub fn new(profile: &Profile) -> Self {
        let heights = || profile.pieces().iter().flat_map(|piece| piece.height);
        let low = heights().fold(f64::INFINITY, f64::min);
        let high = heights().fold(f64::NEG_INFINITY, f64::max);
        let middle = 0.5 * low + 0.5 * high;
        let (radius, _) = profile.control_size();
        let exponent = line::exponent(radius.max(high - middle));
        let scaled = |x: f64| libm::scalbn(x, -exponent);
        let mut pieces: Vec<PreparedPiece> = (0..)
            .zip(profile.pieces())
            .filter(|(_, piece)| !piece.on_axis())
            .map(|(index, piece)| {
                let centred = Piece {
                    radius: piece.radius.map(scaled),
                    height: piece.height.map(|h| scaled(h - middle)),
                };
                PreparedPiece::new(index, piece.is_flat(), &centred)
            })
            .collect();
        link(&mut pieces);
        let order = |key: &dyn Fn(&PreparedPiece) -> f64| {
            let mut order: Vec<usize> = (0..pieces.len()).collect();
            order.sort_by(|&a, &b| key(&pieces[a]).total_cmp(&key(&pieces[b])));
            order
        };
        Self {
            rising: order(&|piece| piece.bottom),
            falling: order(&|piece| -piece.top),
            middle,
            exponent,
            radius: scaled(radius),
            height: scaled(high - middle).max(scaled(middle - low)),
            pieces,
        }
    }

    /// The nearest crossing inside the range of a ray in the profile's own frame. `interval` holds every crossing of the ray.
    ///
    /// # Errors
    /// [`Undecided`]: ask the exact solver.
    pub fn nearest(
        &self,
        ray: &Ray,
        interval: (f64, f64),
        work: &mut Work,
    ) -> Result<Option<Crossing>, Undecided> {
        let line = Line::new(self, ray, interval)?;
        let mut best: Option<(u32, Root)> = None;
        let mut steps = 0;
        for &place in self.order(&line) {
            let piece = &self.pieces[place];
            if best.is_some_and(|(_, root)| line.meets_later(piece, &root)) {
                break;
            }
            if line.misses_heights(piece) {
                continue;
            }
            line.solve(&self.pieces, place, &mut steps, &mut |root| {
                if line.in_range(&root)? && best.is_none_or(|(_, found)| root.t < found.t) {
                    best = Some((piece.index, root));
                }
                Ok(())
            })?;
        }
        work.solver_iterations += steps;
        Ok(best.map(|(piece, root)| line.crossing(piece, &root)))
    }

    /// Every crossing inside the range, by rising t; otherwise as [`Prepared::nearest`].
    ///
    /// # Errors
    /// [`Undecided`]: ask the exact solver.
    pub fn crossings(
        &self,
        ray: &Ray,
        interval: (f64, f64),
        work: &mut Work,
    ) -> Result<Vec<Crossing>, Undecided> {
        let line = Line::new(self, ray, interval)?;
        let mut found = Vec::new();
        let mut steps = 0;
        for (place, piece) in self.pieces.iter().enumerate() {
            if line.misses_heights(piece) {
                continue;
            }
            line.solve(&self.pieces, place, &mut steps, &mut |root| {
                if line.in_range(&root)? {
                    found.push(line.crossing(piece.index, &root));
                }
                Ok(())
            })?;
        }
        work.solver_iterations += steps;
        found.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.piece.cmp(&b.piece)));
        Ok(found)
    }

    fn order(&self, line: &Line) -> &[usize] {
        if line.climbs() {
            &self.rising
        } else {
            &self.falling
        }
    }
}

impl PreparedPiece {
    fn new(index: u32, flat: bool, piece: &Piece) -> Self {
        let raised = |c: &[f64]| {
            let mut padded = [c[c.len() - 1]; 8];
            padded[..7].copy_from_slice(&elevate(c, 6));
            padded
        };
        let (bottom, top) = cubic_range(&piece.height);
        let mut breaks = vec![0.0];
        breaks.extend(cubic_extrema(&piece.height));
        breaks.push(1.0);
        let [h0, h1, h2, h3] = piece.height;
        let bend = 6.0 * (h2 - 2.0 * h1 + h0).abs().max((h3 - 2.0 * h2 + h1).abs());
        let size = piece.radius.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
        let steps = piece.radius.windows(2).map(|w| (w[1] - w[0]).abs());
        Self {
            index,
            radius: piece.radius,
            height: piece.height,
            radius_squared: raised(&product(&piece.radius, &piece.radius)),
            height_squared: raised(&product(&piece.height, &piece.height)),
            height_raised: raised(&piece.height),
            bottom,
            top,
            flat,
            neighbours: [None; 2],
            breaks,
            bend,
            spread: 6.0 * size * steps.fold(0.0, f64::max),
        }
    }
}

/// Joins each piece with those that start where it ends.
fn link(pieces: &mut [PreparedPiece]) {
    for from in 0..pieces.len() {
        let to = (from + 1) % pieces.len();
        let (a, b) = (&pieces[from], &pieces[to]);
        let meet = a.radius[3] == b.radius[0] && a.height[3] == b.height[0];
        // Consecutive in the profile too: a piece on the axis, which is not here, may lie between them.
        if meet && (a.index + 1 == b.index || to == 0) {
            pieces[from].neighbours[1] = Some(to);
            pieces[to].neighbours[0] = Some(from);
        }
    }
}

impl Line {
    /// Reports every root of the ray with one piece, wherever in t it lies.
    #[inline]
    fn solve(
        &self,
        pieces: &[PreparedPiece],
        place: usize,
        steps: &mut u64,
        found: &mut impl FnMut(Root) -> Result<(), Undecided>,
    ) -> Result<(), Undecided> {
        let piece = &pieces[place];
        if piece.flat {
            return self.solve_flat(piece, steps, found);
        }
        if self.is_nearly_level() {
            let mut roots = level::Roots::default();
            if level::solve(self, piece, steps, &mut roots).is_ok() {
                return roots.iter().try_for_each(|root| found(*root));
            }
        }
        if self.is_level() {
            return Err(Undecided);
        }
        let c = self.coefficients(piece);
        let mut report = |bracket: Bracket| {
            let u = refine(&bracket, steps, |u| self.value(piece, u));
            found(self.root_at(piece, u))
        };
        if c[0].abs() <= self.error || c[6].abs() <= self.error {
            return isolate_at_joint(&c, self.error, &mut report, |side| {
                let neighbour = &pieces[piece.neighbours[side]?];
                (!neighbour.flat).then(|| self.coefficients(neighbour))
            });
        }
        isolate(&c, self.error, &mut report)
    }

    /// A flat piece: t is known, and r² = |o + t d|² in the plane remains. A ray in the plane has no hit.
    fn solve_flat(
        &self,
        piece: &PreparedPiece,
        steps: &mut u64,
        found: &mut impl FnMut(Root) -> Result<(), Undecided>,
    ) -> Result<(), Undecided> {
        let height = piece.height[0];
        let Some((t, distance, error)) = self.plane(height) else {
            return Ok(());
        };
        let square = distance * distance;
        let c = piece.radius_squared.map(|r2| r2 - square);
        isolate(&c, error, &mut |bracket: Bracket| {
            let u = refine(&bracket, steps, |u| {
                let (r, slope) = cubic(&piece.radius, u);
                (r * r - square, 2.0 * r * slope)
            });
            found(self.flat_root(u, t, height))
        })
    }
}
