//! Profiles with the traits that upset a solver, each made in one place.

use super::profile::{Piece, Profile};
use crate::numeric::rng::Stream;

/// A profile of known traits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Specimen {
    /// The cup: horizontal tangents on the axis, a negative control radius, turns of radius and height, a small kink.
    Cup,
    /// The hourglass: flat caps, sharp rims.
    Hourglass,
    /// A closed can of radius 1 whose wall has this thickness.
    ThinWall(f64),
    /// A closed ring whose outline crosses itself once.
    Loop,
    /// A wall with a cusp: r′ = h′ = 0 inside the piece.
    Cusp,
    /// A wall of radius 1 whose height runs up, back and up again: three sheets in one place.
    Fold,
    /// A wave that turns back in radius and in height without retracing itself.
    Wave,
    /// A chain with an axis segment, a point, a flat disc, an upright wall, a cone, and repeated control points.
    Degenerate,
    /// Radii from negative to positive: the surface of |r|, with a double cone's tip on the axis.
    BothSigns,
    /// A surface that touches the axis in a point between its ends.
    Neck,
}

impl Specimen {
    /// One of each kind, walls of 1e-3, 1e-6 and 1e-9 among them.
    pub const ALL: [Self; 12] = [
        Self::Cup,
        Self::Hourglass,
        Self::ThinWall(1e-3),
        Self::ThinWall(1e-6),
        Self::ThinWall(1e-9),
        Self::Loop,
        Self::Cusp,
        Self::Fold,
        Self::Wave,
        Self::Degenerate,
        Self::BothSigns,
        Self::Neck,
    ];

    /// A name for tables.
    pub fn name(&self) -> String {
        match self {
            Self::Cup => "cup".to_owned(),
            Self::Hourglass => "hourglass".to_owned(),
            Self::ThinWall(thickness) => format!("thin-wall-{thickness:e}"),
            Self::Loop => "loop".to_owned(),
            Self::Cusp => "cusp".to_owned(),
            Self::Fold => "fold".to_owned(),
            Self::Wave => "wave".to_owned(),
            Self::Degenerate => "degenerate".to_owned(),
            Self::BothSigns => "both-signs".to_owned(),
            Self::Neck => "neck".to_owned(),
        }
    }

    /// The profile.
    pub fn profile(&self) -> Profile {
        let pieces = match *self {
            Self::Cup => return Profile::cup(),
            Self::Hourglass => return Profile::hourglass(),
            Self::ThinWall(thickness) => thin_wall(thickness),
            Self::Loop => vec![
                piece([1.0, 4.0, 0.0, 3.0], [0.0, 2.0, 2.0, 0.0]),
                line([3.0, 0.0], [1.0, 0.0]),
            ],
            Self::Cusp => vec![piece([1.0, 2.0, 1.0, 2.0], [0.0, 1.0, 1.0, 0.0])],
            Self::Fold => vec![piece([1.0; 4], [0.0, 3.0, -2.0, 1.0])],
            Self::Wave => vec![
                piece([2.0, 3.5, 0.5, 2.0], [0.0, 1.0, 2.0, 3.0]),
                piece([2.0, 2.5, 3.0, 3.5], [3.0, 4.5, 1.5, 3.0]),
            ],
            Self::Degenerate => degenerate(),
            Self::BothSigns => vec![piece([-3.0, -1.0, 1.0, 3.0], [0.0, 1.0, 2.0, 3.0])],
            Self::Neck => vec![piece([3.0, -1.0, -1.0, 3.0], [0.0, 1.0, 2.0, 3.0])],
        };
        chain(pieces)
    }
}

/// A random chain of one to four pieces with control values biased to trouble: equal, zero, negative, almost equal. It may cross
/// or retrace itself, leave and meet the axis, stand still.
pub fn random_profile(s: &mut Stream) -> Profile {
    let count = 1 + (4.0 * s.uniform()) as usize;
    let mut last = [control(s).abs(), control(s)];
    let pieces = (0..count).map(|_| {
        let [a, b, c] = [0; 3].map(|_| [control(s), control(s)]);
        let piece = Piece::new([last, a, b, c]);
        last = c;
        piece
    });
    let pieces = pieces.collect();
    chain(pieces)
}

fn control(s: &mut Stream) -> f64 {
    match s.uniform() {
        x if x < 0.5 => s.range(-1.0, 3.0),
        x if x < 0.75 => 0.25 * s.range(-4.0, 12.0).floor(),
        x if x < 0.87 => 0.0,
        _ => s.range(0.0, 4.0).floor() + libm::exp10(-2.0 * s.range(1.0, 9.0)),
    }
}

/// The pieces above all join: the profile exists.
fn chain(pieces: Vec<Piece>) -> Profile {
    Profile::new(pieces).unwrap_or_else(|_| Profile::cup())
}

/// A piece from control radii and heights.
pub fn piece(radius: [f64; 4], height: [f64; 4]) -> Piece {
    Piece { radius, height }
}

/// A straight piece between two points (radius, height). Its control points are exact where the ends differ by multiples of 3 units
/// of their last places.
pub fn line(from: [f64; 2], to: [f64; 2]) -> Piece {
    let mix = |i: usize, w: f64| from[i] + w * (to[i] - from[i]) / 3.0;
    Piece::new([
        from,
        [mix(0, 1.0), mix(1, 1.0)],
        [mix(0, 2.0), mix(1, 2.0)],
        to,
    ])
}

/// Outside up, over the rim, inside down, floor: a solid with outward normals.
fn thin_wall(thickness: f64) -> Vec<Piece> {
    let inner = 1.0 - thickness;
    let floor = thickness - 1.5;
    vec![
        line([0.0, -1.5], [1.0, -1.5]),
        line([1.0, -1.5], [1.0, 1.5]),
        line([1.0, 1.5], [inner, 1.5]),
        line([inner, 1.5], [inner, floor]),
        line([inner, floor], [0.0, floor]),
    ]
}

fn degenerate() -> Vec<Piece> {
    vec![
        piece([0.0; 4], [-3.0, -2.0, -1.0, 0.0]),
        line([0.0, 0.0], [1.5, 0.0]),
        Piece::new([[1.5, 0.0]; 4]),
        line([1.5, 0.0], [1.5, 3.0]),
        line([1.5, 3.0], [3.0, 4.5]),
        Piece::new([[3.0, 4.5], [3.0, 4.5], [2.0, 5.0], [2.0, 6.0]]),
        Piece::new([[2.0, 6.0], [2.0, 6.0], [0.0, 7.0], [0.0, 7.0]]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Purpose;

    /// A chain that did not join would be replaced by the cup.
    #[test]
    fn every_specimen_is_its_own_chain() {
        for specimen in &Specimen::ALL[1..] {
            assert_ne!(specimen.profile(), Profile::cup(), "{}", specimen.name());
        }
        for index in 0..200 {
            let profile = random_profile(&mut Stream::new(1, Purpose::Test, index));
            assert_ne!(profile, Profile::cup(), "{index}");
        }
    }

    #[test]
    fn random_profiles_hold_the_values_that_upset_solvers() {
        let mut values = Vec::new();
        for index in 0..200 {
            let profile = random_profile(&mut Stream::new(1, Purpose::Test, index));
            values.extend(profile.pieces().iter().flat_map(|p| [p.radius, p.height]));
        }
        let share = |of: &dyn Fn(f64) -> bool| {
            let all = values.iter().flatten();
            all.clone().filter(|&&x| of(x)).count() as f64 / all.count() as f64
        };
        let just_above = |x: f64| (1e-19..=1e-2).contains(&(x - x.floor()));
        assert!(share(&|x| x == 0.0) > 0.05);
        assert!(share(&|x| x < 0.0) > 0.1);
        assert!(share(&|x| x != 0.0 && x == (4.0 * x).floor() / 4.0) > 0.1);
        assert!(share(&|x| x > 1.0 && just_above(x)) > 0.03);
        assert!(share(&|x| x < 0.1 && x > 0.0 && just_above(x)) > 0.01);
    }

    #[test]
    fn a_thin_wall_is_a_solid_of_that_thickness() {
        let volume = Specimen::ThinWall(1e-3).profile().volume();
        let expected = std::f64::consts::PI * (3.0 - (1.0 - 1e-3_f64).powi(2) * (3.0 - 1e-3));
        assert!((volume - expected).abs() < 1e-12);
    }
}
