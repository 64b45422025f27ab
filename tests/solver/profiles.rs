//! Random profiles with every trait that upsets a solver.

use photolathe::geometry::profile::{Piece, Profile};
use photolathe::numeric::rng::{Purpose, Stream};

/// One to four cubics that join: loops, cusps, folds, negative radii, flat and upright parts, ends on the axis, repeated control
/// points, closed chains, and sizes from 1e-3 to 1e3. Half of the profiles have control values that are multiples of 1/4, so
/// that tangencies and common points are exact.
pub(crate) fn random_profile(index: u64) -> Profile {
    let mut s = Stream::new(21, Purpose::Test, index);
    let coarse = s.uniform() < 0.5;
    let scale = if coarse {
        1.0
    } else {
        libm::exp10(s.range(-3.0, 3.0))
    };
    let count = 1 + (4.0 * s.uniform()) as usize;
    let mut pieces: Vec<Piece> = Vec::new();
    let mut start = point(&mut s, coarse);
    for _ in 0..count {
        let mut points = [start, [0.0; 2], [0.0; 2], [0.0; 2]];
        for p in &mut points[1..] {
            *p = point(&mut s, coarse);
        }
        match (10.0 * s.uniform()) as u32 {
            0 => points = points.map(|p| [p[0], start[1]]),
            1 => points = points.map(|p| [start[0], p[1]]),
            2 => points[1] = points[0],
            3 => points[2] = points[3],
            4 => points[3][0] = 0.0,
            5 => points[2] = points[1],
            _ => {}
        }
        start = points[3];
        pieces.push(Piece::new(points));
    }
    if s.uniform() < 0.3 {
        let first = pieces[0].point(0);
        if let Some(last) = pieces.last_mut() {
            (last.radius[3], last.height[3]) = (first[0], first[1]);
        }
    }
    for piece in &mut pieces {
        piece.radius = piece.radius.map(|r| r * scale);
        piece.height = piece.height.map(|h| h * scale);
    }
    Profile::new(pieces).expect("the pieces join")
}

fn point(s: &mut Stream, coarse: bool) -> [f64; 2] {
    let least = if s.uniform() < 0.3 { -2.0 } else { 0.0 };
    let raw = [s.range(least, 2.0), s.range(-2.0, 2.0)];
    if coarse {
        raw.map(|x| (4.0 * x).round() / 4.0)
    } else {
        raw
    }
}
