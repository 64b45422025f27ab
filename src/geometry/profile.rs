//! Piecewise cubic Bezier profiles (radius, height).

use crate::numeric::polynomial::{cubic, derivative, integral, product};

/// One cubic: the control radii and heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Control radii; any sign.
    pub radius: [f64; 4],
    /// Control heights.
    pub height: [f64; 4],
}

/// A point of a piece with its first derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// r(u); may be negative.
    pub radius: f64,
    /// h(u).
    pub height: f64,
    /// dr/du.
    pub radius_slope: f64,
    /// dh/du.
    pub height_slope: f64,
}

impl Piece {
    /// A piece from its control points (radius, height).
    pub fn new(points: [[f64; 2]; 4]) -> Self {
        Self {
            radius: points.map(|point| point[0]),
            height: points.map(|point| point[1]),
        }
    }

    /// The control point `i`, (radius, height).
    pub fn point(&self, i: usize) -> [f64; 2] {
        [self.radius[i], self.height[i]]
    }

    /// Point and derivative at `u` in [0, 1]; the ends are exact.
    #[inline]
    pub fn at(&self, u: f64) -> Station {
        let (radius, radius_slope) = cubic(&self.radius, u);
        let (height, height_slope) = cubic(&self.height, u);
        Station {
            radius,
            height,
            radius_slope,
            height_slope,
        }
    }

    /// A direction of the curve at `u` that is not zero unless the piece is a single point.
    ///
    /// It is dP/du where that is more than rounding noise. At an end of zero speed (repeated control points) it is the limit of
    /// the unit tangent from inside the piece: towards the first other control point, or from the last one. At a cusp inside,
    /// where the unit tangent flips, it is the limit from above (d²P/du²).
    pub fn tangent(&self, u: f64) -> [f64; 2] {
        let station = self.at(u);
        let tangent = [station.radius_slope, station.height_slope];
        let size = self.control_speed();
        // Each slope is a sum of three products of control differences: below this it is all rounding.
        if tangent[0].abs().max(tangent[1].abs()) > 32.0 * f64::EPSILON * size {
            return tangent;
        }
        let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|i| self.point(i));
        let minus = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let bend = |i: usize| {
            let (a, b, c) = (self.point(i), self.point(i + 1), self.point(i + 2));
            minus(minus(c, b), minus(b, a))
        };
        let candidates = if u <= 0.0 {
            [minus(p1, p0), minus(p2, p0), minus(p3, p0)]
        } else if u >= 1.0 {
            [minus(p3, p2), minus(p3, p1), minus(p3, p0)]
        } else {
            let (first, last) = (bend(0), bend(1));
            let second = [0, 1].map(|k| (1.0 - u) * first[k] + u * last[k]);
            [second, minus(last, first), minus(p3, p0)]
        };
        let moves = |v: &[f64; 2]| v[0].abs().max(v[1].abs()) > 32.0 * f64::EPSILON * size;
        candidates.into_iter().find(moves).unwrap_or(tangent)
    }

    /// Greatest control difference of either coordinate: the scale of the derivative.
    fn control_speed(&self) -> f64 {
        let greatest = |c: &[f64; 4]| {
            c.windows(2)
                .map(|pair| (pair[1] - pair[0]).abs())
                .fold(0.0, f64::max)
        };
        greatest(&self.radius).max(greatest(&self.height))
    }

    /// Whether the whole piece lies on the axis: a segment or a point, not a surface.
    pub fn on_axis(&self) -> bool {
        self.radius == [0.0; 4]
    }

    /// Whether the piece is a flat disc or annulus: all heights equal.
    pub fn is_flat(&self) -> bool {
        self.height.iter().all(|&h| h == self.height[0])
    }

    /// ∫ r² dh over the piece: the revolved volume under it, divided by π.
    fn volume_over_pi(&self) -> f64 {
        let squared = product(&self.radius, &self.radius);
        integral(&product(&squared, &derivative(&self.height)))
    }
}

/// Why a list of pieces is not a profile.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProfileError {
    /// No piece.
    #[error("a profile needs at least one piece")]
    Empty,
    /// A control value that is NaN or infinite.
    #[error("control point {point} of piece {piece} is not finite")]
    NotFinite {
        /// Index of the piece.
        piece: usize,
        /// Index of the control point.
        point: usize,
    },
    /// The end of a piece is not the start of the next.
    #[error(
        "piece {piece} starts at {start:?}, but the piece before it ends at {end:?}; pieces must join exactly"
    )]
    Gap {
        /// Index of the piece that starts elsewhere.
        piece: usize,
        /// Where it starts.
        start: [f64; 2],
        /// Where the piece before it ends.
        end: [f64; 2],
    },
}

/// A chain of cubics that join exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    pieces: Vec<Piece>,
}

impl Profile {
    /// A profile of these pieces, in order.
    ///
    /// # Errors
    /// No piece, a control value that is not finite, or a piece that does not start exactly where the one before it ends.
    pub fn new(pieces: Vec<Piece>) -> Result<Self, ProfileError> {
        if pieces.is_empty() {
            return Err(ProfileError::Empty);
        }
        for (index, piece) in pieces.iter().enumerate() {
            let finite = |i: &usize| piece.point(*i).iter().all(|x| x.is_finite());
            if let Some(point) = (0..4).find(|i| !finite(i)) {
                return Err(ProfileError::NotFinite {
                    piece: index,
                    point,
                });
            }
        }
        for (index, pair) in pieces.windows(2).enumerate() {
            let (end, start) = (pair[0].point(3), pair[1].point(0));
            if end != start {
                return Err(ProfileError::Gap {
                    piece: index + 1,
                    start,
                    end,
                });
            }
        }
        Ok(Self { pieces })
    }

    /// The wine cup of the original program: six pieces, a closed solid, with most of the traits that upset a solver: it touches
    /// the axis with horizontal tangents, has a negative control radius, radii and heights that turn back, and one small kink.
    pub fn cup() -> Self {
        let points = [
            [[0.0, 0.04], [1.1, 0.04], [1.2, 0.0], [2.0, 0.0]],
            [[2.0, 0.0], [2.2, 0.0], [2.0, 0.1], [1.9, 0.15]],
            [[1.9, 0.15], [1.73, 0.23], [0.4, -0.2], [0.2, 0.4]],
            [[0.2, 0.4], [-0.1, 1.3], [3.8, 1.4], [3.8, 2.0]],
            [[3.8, 2.0], [3.8, 2.2], [3.6, 2.2], [3.6, 2.0]],
            [[3.6, 2.0], [3.6, 1.9], [0.25, 1.3], [0.0, 1.3]],
        ];
        Self {
            pieces: points.map(Piece::new).to_vec(),
        }
    }

    /// An hourglass of height 2 and radius 0.15 to 0.8, closed by two flat caps: six pieces, the first and last the caps.
    pub fn hourglass() -> Self {
        let (third, two_thirds) = (0.266_666_666_666_666_66, 0.533_333_333_333_333_3);
        let points = [
            [[0.0, -1.0], [third, -1.0], [two_thirds, -1.0], [0.8, -1.0]],
            [[0.8, -1.0], [0.8, -0.8], [0.7, -0.57], [0.55, -0.45]],
            [[0.55, -0.45], [0.4, -0.33], [0.15, -0.15], [0.15, 0.0]],
            [[0.15, 0.0], [0.15, 0.15], [0.4, 0.33], [0.55, 0.45]],
            [[0.55, 0.45], [0.7, 0.57], [0.8, 0.8], [0.8, 1.0]],
            [[0.8, 1.0], [two_thirds, 1.0], [third, 1.0], [0.0, 1.0]],
        ];
        Self {
            pieces: points.map(Piece::new).to_vec(),
        }
    }

    /// The pieces, in order.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Whether the revolved profile is a closed surface (both ends on the axis, or the end joins the start) whose normals
    /// point outward.
    ///
    /// The sign is that of the revolved volume π ∫ r² dh, positive where a profile runs upward on the outside. A profile that
    /// encloses no volume is open. Not promised: that the profile does not cut itself.
    pub fn solid(&self) -> Solid {
        let (Some(first), Some(last)) = (self.pieces.first(), self.pieces.last()) else {
            return Solid::Open;
        };
        let capped = first.radius[0] == 0.0 && last.radius[3] == 0.0;
        let ring = first.point(0) == last.point(3);
        let volume = self.volume();
        if !(capped || ring) || volume == 0.0 {
            Solid::Open
        } else if volume > 0.0 {
            Solid::Outward
        } else {
            Solid::Inward
        }
    }

    /// The volume that the revolved profile encloses, π ∫ r² dh: negative for inward normals, and what its two end discs would
    /// close off for an open profile.
    pub fn volume(&self) -> f64 {
        std::f64::consts::PI * self.pieces.iter().map(Piece::volume_over_pi).sum::<f64>()
    }

    /// Greatest magnitudes of the control radii and of the control heights: they bound the curve.
    pub fn control_size(&self) -> (f64, f64) {
        let greatest = |values: [f64; 4], so_far: f64| {
            values
                .into_iter()
                .fold(so_far, |size, value| size.max(value.abs()))
        };
        self.pieces.iter().fold((0.0, 0.0), |(r, h), piece| {
            (greatest(piece.radius, r), greatest(piece.height, h))
        })
    }
}

/// What a revolved profile encloses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solid {
    /// Closed, normals outward.
    Outward,
    /// Closed, normals inward.
    Inward,
    /// Not closed.
    Open,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(from: [f64; 2], to: [f64; 2]) -> Piece {
        let mix = |w: f64| [0, 1].map(|k| (1.0 - w) * from[k] + w * to[k]);
        Piece::new([from, mix(1.0 / 3.0), mix(2.0 / 3.0), to])
    }

    #[test]
    fn a_bad_list_of_pieces_is_refused_with_its_place() {
        assert_eq!(Profile::new(Vec::new()), Err(ProfileError::Empty));
        let mut broken = line([0.0, 0.0], [1.0, 0.0]);
        broken.height[2] = f64::NAN;
        assert_eq!(
            Profile::new(vec![broken]),
            Err(ProfileError::NotFinite { piece: 0, point: 2 })
        );
        let gap = Profile::new(vec![
            line([0.0, 0.0], [1.0, 0.0]),
            line([1.0, 1e-300], [1.0, 1.0]),
        ]);
        assert!(matches!(gap, Err(ProfileError::Gap { piece: 1, .. })));
    }

    #[test]
    fn the_reference_profiles_are_outward_solids_and_reversal_turns_them() {
        for profile in [Profile::cup(), Profile::hourglass()] {
            assert_eq!(
                Profile::new(profile.pieces().to_vec()).as_ref(),
                Ok(&profile)
            );
            assert_eq!(profile.solid(), Solid::Outward);
            let mut pieces = profile.pieces().to_vec();
            pieces.reverse();
            for piece in &mut pieces {
                piece.radius.reverse();
                piece.height.reverse();
            }
            let reversed = Profile::new(pieces).map(|p| p.solid());
            assert_eq!(reversed, Ok(Solid::Inward));
        }
    }

    #[test]
    fn a_tube_is_open_and_a_ring_is_closed() {
        let tube = Profile::new(vec![line([1.0, 0.0], [1.0, 2.0])]);
        assert_eq!(tube.map(|p| p.solid()), Ok(Solid::Open));
        let corners = [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]];
        let ring = (0..4)
            .map(|i| line(corners[i], corners[(i + 1) % 4]))
            .collect();
        assert_eq!(Profile::new(ring).map(|p| p.solid()), Ok(Solid::Outward));
    }

    #[test]
    fn a_profile_with_one_end_on_the_axis_or_without_volume_is_open() {
        let open = |points: &[[f64; 2]]| {
            let pieces = points.windows(2).map(|pair| line(pair[0], pair[1]));
            Profile::new(pieces.collect()).map(|p| p.solid()) == Ok(Solid::Open)
        };
        assert!(open(&[[0.0, 0.0], [1.0, 1.0]]));
        assert!(open(&[[1.0, 1.0], [0.0, 2.0]]));
        assert!(open(&[[0.0, 1.0], [1.0, 1.0], [0.0, 1.0]]));
        assert!(!open(&[[0.0, 0.0], [1.0, 1.0], [0.0, 2.0]]));
    }

    #[test]
    fn the_volume_of_a_cylinder_and_a_cone_is_known() {
        let wall = line([2.0, 0.0], [2.0, 3.0]).volume_over_pi();
        let cone = line([0.0, 0.0], [1.0, 3.0]).volume_over_pi();
        assert!((wall - 12.0).abs() < 1e-13 && (cone - 1.0).abs() < 1e-13);
        let tube = Profile {
            pieces: vec![line([2.0, 0.0], [2.0, 3.0])],
        };
        assert!((tube.volume() - 12.0 * std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn a_tangent_is_never_zero_on_a_curve() {
        let start = Piece::new([[1.0, 0.0], [1.0, 0.0], [2.0, 1.0], [2.0, 2.0]]);
        assert_eq!(start.tangent(0.0), [1.0, 1.0]);
        let end = Piece::new([[1.0, 0.0], [1.0, 1.0], [2.0, 2.0], [2.0, 2.0]]);
        assert_eq!(end.tangent(1.0), [1.0, 1.0]);
        let start = Piece::new([[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 3.0]]);
        assert_eq!(start.tangent(0.0), [1.0, 3.0]);
        let end = Piece::new([[1.0, 0.0], [2.0, 3.0], [2.0, 3.0], [2.0, 3.0]]);
        assert_eq!(end.tangent(1.0), [1.0, 3.0]);
        // P′ = 0 at ½ and at ¼; there d²P/du² is six times the answer.
        let cusp = Piece::new([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]);
        assert_eq!(cusp.tangent(0.5), [0.0, -1.0]);
        let cusp = Piece::new([[0.0, 0.0], [1.0, 1.0], [0.0, -1.0], [-3.0, 2.0]]);
        assert_eq!(cusp.tangent(0.25), [-2.0, -1.0]);
        assert_eq!(Piece::new([[1.0, 2.0]; 4]).tangent(0.3), [0.0, 0.0]);
    }

    /// 32 ε times the greatest control difference, 3, is still noise; the next number is a direction.
    #[test]
    fn a_tangent_of_rounding_noise_gives_way_to_the_next_control_point() {
        let noise = 96.0 * f64::EPSILON;
        let upward = |first: f64, second: f64| Piece {
            radius: [0.0, first, second, 0.0],
            height: [0.0, 0.0, 0.0, 3.0],
        };
        assert_eq!(upward(noise / 3.0, 0.0).tangent(0.0), [0.0, 3.0]);
        assert_eq!(upward(noise, 0.0).tangent(0.0), [3.0 * noise, 0.0]);
        assert_eq!(upward(0.0, noise).tangent(0.0), [0.0, 3.0]);
        assert_eq!(upward(0.0, 2.0 * noise).tangent(0.0), [2.0 * noise, 0.0]);
    }

    #[test]
    fn pieces_on_the_axis_and_flat_ones_are_told_from_the_others() {
        let axis = line([0.0, 1.0], [0.0, 2.0]);
        let cap = line([0.0, 1.0], [2.0, 1.0]);
        let wall = line([2.0, 1.0], [2.0, 2.0]);
        assert_eq!(
            [axis, cap, wall].map(|piece| piece.on_axis()),
            [true, false, false]
        );
        assert_eq!(
            [axis, cap, wall].map(|piece| piece.is_flat()),
            [false, true, false]
        );
        let mut bump = cap;
        bump.height[2] = 1.5;
        assert!(!bump.is_flat());
    }

    #[test]
    fn control_sizes_are_the_greatest_magnitudes() {
        assert_eq!(Profile::cup().control_size(), (3.8, 2.2));
        let below = Profile {
            pieces: vec![line([-2.0, 1.0], [1.0, -3.0])],
        };
        assert_eq!(below.control_size(), (2.0, 3.0));
    }
}
