//! Near-perpendicular rays, by branches.
//!
//! Where |d_y| is small against the rest, f(u) is almost −A (h − y₀)²: its roots come in pairs too near to be told apart. With s the
//! signed horizontal distance from the point nearest to the axis, y₀ the height there, k = d_y/√A and ρ the distance from the axis,
//! each branch σ = ±1 has the equation
//!
//! ```text
//! e(u) = h(u) − y₀ − σ k √(r(u)² − ρ²) = 0,        s = σ √(r² − ρ²)
//! ```
//!
//! The ray's heights inside the surface are the narrow band y₀ ± k √(R² − ρ²). On a part of the piece where h is monotone and crosses
//! the whole band, each branch has exactly one root if r > ρ there, and none if r < ρ. Anything else is undecided.

use super::line::Line;
use super::{PreparedPiece, Root, Undecided};
use crate::numeric::polynomial::cubic;

/// The roots of one piece: at most six, unless two at a joint are reported twice.
#[derive(Default)]
pub(super) struct Roots {
    roots: [Option<Root>; 8],
    len: usize,
}

impl Roots {
    pub(super) fn push(&mut self, root: Root) {
        if let Some(slot) = self.roots.get_mut(self.len) {
            *slot = Some(root);
            self.len += 1;
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Root> {
        self.roots.iter().flatten()
    }
}

/// The ray seen from above.
struct Branches<'a> {
    line: &'a Line,
    /// Height at the point nearest to the axis.
    middle: f64,
    /// k = d_y/√A.
    slope: f64,
    /// ρ².
    distance_squared: f64,
    /// Half the height of the band.
    band: f64,
    /// Bound of the error of r² − ρ².
    error: f64,
}

/// Collects the roots of one piece.
pub(super) fn solve(
    line: &Line,
    piece: &PreparedPiece,
    steps: &mut u64,
    roots: &mut Roots,
) -> Result<(), Undecided> {
    let [size, height] = line.size;
    let distance_squared = line.aim.axis_distance_squared();
    let distance = distance_squared.sqrt();
    // The distance itself is off by some roundings of the reach.
    let rounding = 8.0 * f64::EPSILON * line.aim.reach;
    let error = 16.0 * f64::EPSILON * (size * size + distance_squared)
        + rounding * (2.0 * distance + rounding);
    if size * size - distance_squared < -error {
        return Ok(());
    }
    let drop = line.aim.closest() * line.aim.d.y;
    let slope = line.aim.d.y / line.aim.across.sqrt();
    // The rounding of y₀, of h(u) and of the centring.
    let noise = f64::EPSILON * (8.0 * (line.aim.reach + drop.abs()) + 16.0 * height);
    let branches = Branches {
        line,
        middle: line.aim.o.y + drop,
        slope,
        distance_squared,
        band: slope.abs() * (size * size - distance_squared + error).sqrt() + noise,
        error,
    };
    for part in piece.breaks.windows(2).filter(|part| part[0] < part[1]) {
        branches.solve_part(piece, [part[0], part[1]], steps, roots)?;
    }
    Ok(())
}

impl Branches<'_> {
    fn solve_part(
        &self,
        piece: &PreparedPiece,
        part: [f64; 2],
        steps: &mut u64,
        roots: &mut Roots,
    ) -> Result<(), Undecided> {
        let ends = part.map(|u| cubic(&piece.curve.height, u).0);
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let (below, above) = (self.middle - self.band, self.middle + self.band);
        if high < below || low > above {
            return Ok(());
        }
        if !(low < below && above < high) {
            return Err(Undecided);
        }
        let u = self.crossing(piece, part, ends[1] > ends[0], steps);
        let slope = cubic(&piece.curve.height, u).1.abs();
        // |h′| changes by less than half of itself within twice the band, so the band is crossed within `reach`.
        let steep = 4.0 * self.band * piece.bend < slope * slope;
        if !steep {
            return Err(Undecided);
        }
        let reach = 2.0 * self.band / slope + 4.0 * f64::EPSILON;
        let margin = piece.spread * reach + self.error;
        let half_chord = self.half_chord_squared(piece, u);
        if half_chord < -margin {
            return Ok(());
        }
        let least = half_chord - margin;
        // e′ = h′ − σ k (r²)′/(2 √(r² − ρ²)) keeps the sign of h′, which is at least half of `slope`.
        let monotone = self.slope.abs() * piece.spread < 0.8 * slope * least.max(0.0).sqrt();
        if !monotone {
            return Err(Undecided);
        }
        for side in [-1.0, 1.0] {
            roots.push(self.branch(piece, u, side, steps));
        }
        Ok(())
    }

    fn half_chord_squared(&self, piece: &PreparedPiece, u: f64) -> f64 {
        let r = cubic(&piece.curve.radius, u).0;
        r * r - self.distance_squared
    }

    /// The u of a monotone part where h is y₀.
    fn crossing(&self, piece: &PreparedPiece, part: [f64; 2], rises: bool, steps: &mut u64) -> f64 {
        let [mut low, mut high] = part;
        let mut u = 0.5 * (low + high);
        for _ in 0..100 {
            *steps += 1;
            let (h, slope) = cubic(&piece.curve.height, u);
            if (h < self.middle) == rises {
                low = u;
            } else {
                high = u;
            }
            let next = u - (h - self.middle) / slope;
            if next >= low && next <= high {
                if (next - u).abs() < 1e-9 {
                    return next;
                }
                u = next;
            } else {
                u = 0.5 * (low + high);
                let width = high - low;
                if width < f64::EPSILON {
                    return u;
                }
            }
        }
        u
    }

    /// Newton's method on one branch, from the root for k = 0; the caller has made sure that e is monotone nearby.
    fn branch(&self, piece: &PreparedPiece, start: f64, side: f64, steps: &mut u64) -> Root {
        let mut u = start;
        let mut half = 0.0;
        for _ in 0..8 {
            *steps += 1;
            let (r, r_slope) = cubic(&piece.curve.radius, u);
            let (h, h_slope) = cubic(&piece.curve.height, u);
            half = (r * r - self.distance_squared).max(0.0).sqrt();
            let value = h - self.middle - side * self.slope * half;
            let step = value / (h_slope - side * self.slope * r * r_slope / half);
            u = (u - step).clamp(0.0, 1.0);
            if step.abs() < 1e-9 {
                break;
            }
        }
        let t = self.line.aim.closest() + side * half / self.line.aim.across.sqrt();
        self.line.aim.polish(&piece.curve, u, t)
    }
}
