//! The intersectors whose error is the dose: a family and one parameter.

use crate::geometry::profile::{Piece, Profile};
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Revolution, Solver};
use crate::geometry::shape::Shape;
use crate::scene::Scene;

/// A family of intersectors, each with a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    /// Bernstein isolation, judged against exact arithmetic; the truth of all other families. No parameter.
    Bernstein,
    /// Newton's method; the parameter is the number of starts per piece.
    Starts,
    /// Newton's method with 30 starts; the parameter is its relative tolerance.
    Tolerance,
    /// Bernstein isolation with one offset of next rays for all; the parameter is the offset in world units.
    Offset,
    /// Bernstein isolation of a profile of straight pieces; the parameter is their number for each curved one.
    Flat,
}

impl Family {
    /// All of them, in the order of the table.
    pub(super) const ALL: [Self; 5] = [
        Self::Bernstein,
        Self::Starts,
        Self::Tolerance,
        Self::Offset,
        Self::Flat,
    ];

    /// The name in the table.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Bernstein => "bernstein",
            Self::Starts => "newton_starts",
            Self::Tolerance => "newton_tolerance",
            Self::Offset => "offset",
            Self::Flat => "flat",
        }
    }

    /// The family of a name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }

    /// The doses.
    pub(super) fn parameters(self) -> &'static [f64] {
        match self {
            Self::Bernstein => &[0.0],
            Self::Starts => &[1.0, 3.0, 10.0, 30.0, 100.0],
            Self::Tolerance => &[1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-12],
            Self::Offset => &[
                0.0, 1e-15, 1e-14, 1e-12, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1,
            ],
            Self::Flat => &[8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0, 1024.0],
        }
    }
}

/// An intersector under test: the scene that asks it, and where next rays start.
pub(super) struct Method {
    pub(super) scene: Scene,
    /// `None`: by the certified bound.
    pub(super) offset: Option<f64>,
    /// Pieces for each one of the true profile.
    pub(super) fineness: u32,
}

/// Newton's rays start this many accepted residuals off the surface; below two they meet the sheet they leave (experiment `eps`).
const OFFSET_IN_RESIDUALS: f64 = 4.0;

impl Method {
    /// The method of a family's parameter, in a scene whose object `cup` is the surface of revolution.
    pub(super) fn new(family: Family, parameter: f64, truth: &Scene, cup: usize) -> Self {
        let mut method = Self {
            scene: truth.clone(),
            offset: None,
            fineness: 1,
        };
        let mut newton = NewtonSettings::default();
        match family {
            Family::Bernstein => {
                method.scene.solver = Solver::Bernstein;
                return method;
            }
            Family::Offset => {
                method.offset = Some(parameter);
                return method;
            }
            Family::Flat => {
                method.fineness = parameter as u32;
                flatten(&mut method.scene.objects[cup].shape, method.fineness);
                return method;
            }
            Family::Starts => newton.starts = parameter as u32,
            Family::Tolerance => newton.tolerance = parameter,
        }
        method.scene.solver = Solver::Newton(newton);
        if let Shape::Revolution(cup) = &truth.objects[cup].shape {
            let (radius, height) = cup.profile().control_size();
            method.offset = Some(OFFSET_IN_RESIDUALS * newton.tolerance * (radius + height));
        }
        method
    }
}

impl Method {
    /// Whether points of the true surface lie off this one's, so that rays that leave them cannot be judged.
    pub(super) fn moves_the_surface(&self) -> bool {
        self.fineness > 1
    }
}

/// Replaces each piece of a surface of revolution by `n` straight ones between points of it at equal steps of u.
fn flatten(shape: &mut Shape, n: u32) {
    let Shape::Revolution(surface) = shape else {
        return;
    };
    let pieces = surface.profile().pieces().iter().flat_map(|piece| {
        let point = move |i: u32| {
            let station = piece.at(f64::from(i) / f64::from(n));
            [station.radius, station.height]
        };
        (0..n).map(move |i| straight(point(i), point(i + 1)))
    });
    if let Ok(profile) = Profile::new(pieces.collect()) {
        *surface = Revolution::new(profile, *surface.placement());
    }
}

/// A straight piece of constant speed, as a cubic.
fn straight(from: [f64; 2], to: [f64; 2]) -> Piece {
    let mix = |w: f64| [0, 1].map(|k| (1.0 - w) * from[k] + w * to[k]);
    Piece::new([from, mix(1.0 / 3.0), mix(2.0 / 3.0), to])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::revolution::Placement;

    /// The greatest distance of a flattened cup's pieces from the cup falls with the square of n.
    #[test]
    fn straight_pieces_approach_the_curve_as_the_square_of_their_length() {
        let cup = Profile::cup();
        let gap = |n: u32| {
            let mut shape = Shape::Revolution(Revolution::new(cup.clone(), Placement::identity()));
            flatten(&mut shape, n);
            let Shape::Revolution(flat) = &shape else {
                panic!("a revolution stays one");
            };
            assert_eq!(flat.profile().pieces().len(), 6 * n as usize);
            let middles = flat
                .profile()
                .pieces()
                .iter()
                .enumerate()
                .map(|(i, piece)| {
                    let (whole, part) = (i / n as usize, i % n as usize);
                    let u = (part as f64 + 0.5) / f64::from(n);
                    let (a, b) = (cup.pieces()[whole].at(u), piece.at(0.5));
                    libm::hypot(a.radius - b.radius, a.height - b.height)
                });
            middles.fold(0.0, f64::max)
        };
        let ratio = gap(16) / gap(64);
        assert!((15.0..17.0).contains(&ratio), "{ratio}");
    }
}
