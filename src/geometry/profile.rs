//! Piecewise cubic Bezier profiles (radius, height).

/// One cubic: the control radii and heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Control radii; any sign.
    pub radius: [f64; 4],
    /// Control heights.
    pub height: [f64; 4],
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
    pub fn new(pieces: Vec<Piece>) -> Result<Self, ProfileError> {
        let _ = pieces;
        todo!()
    }

    /// The pieces, in order.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Whether the revolved profile is a closed surface (both ends on the axis, or the end joins the start) whose normals
    /// point outward.
    pub fn solid(&self) -> Solid {
        todo!()
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
