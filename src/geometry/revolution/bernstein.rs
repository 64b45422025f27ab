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
//! 1e-13 (relative) of a tangency, of a joint, of the axis at a cap, of an end of its range, or with two crossings as near to each other. A ray that runs inside a flat piece,
//! along a generator of a cone or inside a cylinder's wall does not hit that piece; pieces on the axis are not surfaces.

mod batch;
mod certainty;
mod isolate;
mod joint;
mod level;
mod line;
mod order;
mod precedence;
mod queue;
mod refine;
mod solve;

use super::super::bounds::{Cylinder, cubic_range};
use super::super::hit::Crossing;
use super::super::profile::{Piece, Profile};
use super::super::ray::Ray;
use crate::numeric::polynomial::{cubic_extrema, elevate, product};
use crate::numeric::simd::{Portable, Vectors};
use crate::numeric::work::Work;
use batch::Many;
pub use certainty::Certainty;
use isolate::has_one_sign;
use line::{Line, halves};
use precedence::Later;
use solve::{All, Nearest};

/// The f64 solver cannot tell hit from miss, or one side of the range's end from the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Undecided;

/// The nearest crossing of a ray, if it is known.
pub type Answer = Result<Option<Crossing>, Undecided>;

/// A profile made ready: scaled by a power of two to the size 1, centred in height, with the coefficients that no ray changes.
#[derive(Clone, Debug)]
pub struct Prepared {
    pieces: Vec<PreparedPiece>,
    /// Places in `pieces` by rising lower end, flat ones first, the order of meeting for rays that climb.
    rising: Vec<usize>,
    /// Places in `pieces` by falling upper end, for rays that descend.
    falling: Vec<usize>,
    /// Height that is 0 after centring.
    middle: f64,
    /// Lengths are divided by 2 to this power.
    exponent: i64,
    /// The product of both is 2 to minus that power.
    shrink: [f64; 2],
    /// Greatest control radius after scaling.
    radius: f64,
    /// Greatest control height after centring and scaling.
    height: f64,
    /// Greatest radius and least and greatest height of the surface, and whether rays that pass them by are culled.
    cylinder: Cylinder,
    culls: bool,
    /// The instructions to use.
    vectors: Vectors,
}

/// Seven Bernstein coefficients, the last one twice: an even count suits vector registers.
type Padded = [f64; 8];

/// One piece, scaled and centred.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct PreparedPiece {
    radius_squared: Padded,
    height_squared: Padded,
    height_raised: Padded,
    curve: Cubics,
    bottom: f64,
    top: f64,
    /// Greatest radius.
    widest: f64,
    index: u32,
    flat: bool,
    slope: Slope,
    /// Places in the orders of rays that climb and that descend.
    ranks: [usize; 2],
    /// What rays that climb (0) and that descend (1) meet only after this piece.
    later: [Later; 2],
    /// Whether anything in `later` has a lower rank than the piece.
    looks_back: bool,
    /// Places of the pieces that share the start and the end.
    neighbours: [Option<usize>; 2],
    /// Whether the start and the end lie on the axis, with h′ = 0 and r′ ≠ 0, as the middle of a cap does.
    tips: [bool; 2],
    /// Parameters 0, the extrema of h, 1, the last one repeated.
    breaks: [f64; 4],
    /// Bound of |h″|.
    bend: f64,
    /// Bound of |(r²)′|.
    spread: f64,
}

/// How the heights of a piece run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slope {
    /// They never fall.
    Rises,
    /// They never rise.
    Falls,
    /// Their control values do both.
    Turns,
}

/// r and h in Bernstein form, for values exact at the ends, and as powers of u, for quick ones.
#[derive(Clone, Debug)]
struct Cubics {
    radius: [f64; 4],
    height: [f64; 4],
    radius_powers: [f64; 4],
    height_powers: [f64; 4],
}

/// A root: the curve there, and the ray's parameter in scaled units.
#[derive(Clone, Copy, Debug)]
struct Root {
    u: f64,
    t: f64,
    /// Bound of the error of `t`.
    tolerance: f64,
}

impl Prepared {
    /// Prepares a profile.
    pub fn new(profile: &Profile) -> Self {
        let heights = || profile.pieces().iter().flat_map(|piece| piece.height);
        let low = heights().fold(f64::INFINITY, f64::min);
        let high = heights().fold(f64::NEG_INFINITY, f64::max);
        let middle = 0.5 * low + 0.5 * high;
        let (radius, _) = profile.control_size();
        let exponent = match radius.max(high - middle) {
            0.0 => 0,
            size => libm::ilogb(size),
        };
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
        link(&mut pieces, profile);
        let cylinder = Cylinder {
            radius: pieces
                .iter()
                .fold(0.0, |most, piece| piece.widest.max(most)),
            bottom: pieces
                .iter()
                .fold(f64::INFINITY, |least, piece| piece.bottom.min(least)),
            top: pieces
                .iter()
                .fold(f64::NEG_INFINITY, |most, piece| piece.top.max(most)),
        };
        let order = |key: &dyn Fn(&PreparedPiece) -> f64| {
            let mut order: Vec<usize> = (0..pieces.len()).collect();
            order.sort_by(|&a, &b| {
                let by_height = key(&pieces[a]).total_cmp(&key(&pieces[b]));
                by_height.then(pieces[b].flat.cmp(&pieces[a].flat))
            });
            order
        };
        let (rising, falling) = (order(&|piece| piece.bottom), order(&|piece| -piece.top));
        for (rank, (&up, &down)) in rising.iter().zip(&falling).enumerate() {
            pieces[up].ranks[0] = rank;
            pieces[down].ranks[1] = rank;
        }
        precedence::find(&mut pieces);
        Self {
            rising,
            falling,
            middle,
            exponent: exponent.into(),
            shrink: halves((-exponent).into()),
            radius: scaled(radius),
            height: scaled(high - middle).max(scaled(middle - low)),
            cylinder,
            culls: true,
            vectors: Vectors::best(),
            pieces,
        }
    }

    /// The nearest crossing inside the range of a ray in the profile's own frame. The ray must be valid.
    ///
    /// # Errors
    /// [`Undecided`]: ask the exact solver.
    #[inline]
    pub fn nearest(&self, ray: &Ray, work: &mut Work) -> Answer {
        self.vectors.run(Nearest {
            prepared: self,
            ray,
            work,
        })
    }

    /// As [`Prepared::nearest`] for each ray, to the bit, with several rays in the lanes of vector registers. `found` is as long as
    /// `rays`; the numbers of the undecided rays are appended to `undecided`. Rays that are not valid find nothing.
    pub fn nearest_many(
        &self,
        rays: &[Ray],
        found: &mut [Option<Crossing>],
        undecided: &mut Vec<usize>,
        work: &mut Work,
    ) {
        self.vectors.run(Many {
            prepared: self,
            rays,
            found,
            undecided,
            work,
        });
    }

    /// Whether the tight cylinder culls rays here, and is counted, or the caller has done so.
    pub fn culls(&self) -> bool {
        self.culls
    }

    /// The same with or without culling.
    #[must_use]
    pub fn culling(self, culls: bool) -> Self {
        Self { culls, ..self }
    }

    /// The same with these instructions instead of the best.
    #[must_use]
    pub fn with_vectors(self, vectors: Vectors) -> Self {
        Self { vectors, ..self }
    }

    /// Every crossing inside the range, by rising t; otherwise as [`Prepared::nearest`].
    ///
    /// # Errors
    /// [`Undecided`]: ask the exact solver.
    pub fn crossings(&self, ray: &Ray, work: &mut Work) -> Result<Vec<Crossing>, Undecided> {
        self.vectors.run(All {
            prepared: self,
            ray,
            work,
        })
    }

    /// The numbers of the pieces that the line through a ray may meet: no other has a crossing. Pieces on the axis are not told.
    pub fn suspects(&self, ray: &Ray) -> Vec<u32> {
        let (line, fine) = Line::new(self, ray);
        let may_meet = |piece: &&PreparedPiece| {
            !(fine && has_one_sign(Portable, &line.coefficients(piece), line.error))
        };
        let suspects = self.pieces.iter().filter(may_meet);
        suspects.map(|piece| piece.index).collect()
    }

    #[inline(always)]
    fn order(&self, line: &Line) -> &[usize] {
        if line.climbs() {
            &self.rising
        } else {
            &self.falling
        }
    }
}

/// The coefficients of 1, u, u², u³.
fn powers([a, b, c, d]: &[f64; 4]) -> [f64; 4] {
    [
        *a,
        3.0 * (b - a),
        3.0 * ((c - b) - (b - a)),
        (d - c) - 2.0 * (c - b) + (b - a),
    ]
}

impl PreparedPiece {
    fn new(index: u32, flat: bool, piece: &Piece) -> Self {
        let raised = |c: &[f64]| {
            let mut padded = [c[c.len() - 1]; 8];
            padded[..7].copy_from_slice(&elevate(c, 6));
            padded
        };
        let slope = if piece.height.is_sorted() {
            Slope::Rises
        } else if piece.height.is_sorted_by(|a, b| a >= b) {
            Slope::Falls
        } else {
            Slope::Turns
        };
        let [h0, h1, h2, h3] = piece.height;
        let (bottom, top) = match slope {
            Slope::Rises => (h0, h3),
            Slope::Falls => (h3, h0),
            Slope::Turns => cubic_range(&piece.height),
        };
        let (inner, outer) = cubic_range(&piece.radius);
        let mut breaks = [1.0; 4];
        breaks[0] = 0.0;
        for (place, u) in breaks[1..3].iter_mut().zip(cubic_extrema(&piece.height)) {
            *place = u;
        }
        let bend = 6.0 * (h2 - 2.0 * h1 + h0).abs().max((h3 - 2.0 * h2 + h1).abs());
        let size = piece.radius.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
        let steps = piece.radius.windows(2).map(|w| (w[1] - w[0]).abs());
        Self {
            index,
            curve: Cubics {
                radius: piece.radius,
                height: piece.height,
                radius_powers: powers(&piece.radius),
                height_powers: powers(&piece.height),
            },
            radius_squared: raised(&product(&piece.radius, &piece.radius)),
            height_squared: raised(&product(&piece.height, &piece.height)),
            height_raised: raised(&piece.height),
            bottom,
            top,
            widest: inner.abs().max(outer.abs()),
            flat,
            slope,
            ranks: [0; 2],
            later: [Later::NONE; 2],
            looks_back: false,
            neighbours: [None; 2],
            tips: [[0, 1], [3, 2]].map(|[end, next]| {
                let (r, h) = (&piece.radius, &piece.height);
                r[end] == 0.0 && r[next] != 0.0 && h[end] == h[next]
            }),
            breaks,
            bend,
            spread: 6.0 * size * steps.fold(0.0, f64::max),
        }
    }
}

/// Joins each piece with those that start where it ends. What meets another end on the axis is no tip: the two may share a crossing.
fn link(pieces: &mut [PreparedPiece], profile: &Profile) {
    for from in 0..pieces.len() {
        let to = (from + 1) % pieces.len();
        let (a, b) = (&pieces[from], &pieces[to]);
        let (end, start) = (
            &profile.pieces()[a.index as usize],
            &profile.pieces()[b.index as usize],
        );
        let meet = end.radius[3] == start.radius[0] && end.height[3] == start.height[0];
        // Consecutive in the profile too: a piece on the axis, which is not here, may lie between them.
        if meet && (a.index + 1 == b.index || to == 0) {
            pieces[from].neighbours[1] = Some(to);
            pieces[to].neighbours[0] = Some(from);
        }
    }
    let ends: Vec<f64> = (pieces.iter())
        .flat_map(|piece| [0, 3].map(|end| (piece.curve.radius[end], piece.curve.height[end])))
        .filter_map(|(radius, height)| (radius == 0.0).then_some(height))
        .collect();
    for piece in pieces {
        for (tip, end) in piece.tips.iter_mut().zip([0, 3]) {
            let height = piece.curve.height[end];
            *tip &= ends.iter().filter(|&&other| other == height).count() == 1;
        }
    }
}
