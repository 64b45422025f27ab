//! Aiming photons at what bends or mirrors light.
//!
//! A caustic is drawn by those few photons that leave the lamp towards a small piece of glass. So some photons are sent there on
//! purpose. The direction of a photon comes from the mixture
//!
//! ```text
//! p(ω) = (1 − a) p₀(ω) + (a/K) Σ_k [ω meets ball k]/Ω_k
//! ```
//!
//! with p₀ the light's own law, and K balls around specular objects that the start of the photon can see, each under the solid
//! angle Ω_k. The photon carries p₀/p of its flux: the balance heuristic for one sample (Veach and Guibas 1995), unbiased whatever the
//! balls hold. A photon aimed well carries little, and none carries more than 1/(1 − a): no sparks. The balls share evenly, because a
//! caustic is the brighter and the smaller the smaller the ball is.

use super::light::cone_of_sphere;
use super::material::Material;
use super::sampling::{cosine_density, cosine_hemisphere, uniform_cone, uniform_sphere};
use super::{Object, Rgb};
use crate::geometry::shape::Shape;
use crate::geometry::sphere::Sphere;
use crate::numeric::rng::Numbers;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Balls seen under a smaller sine are not aimed at: rounding of directions, 2⁻⁵³, must be nothing beside them.
const LEAST_SINE: f64 = 1.0 / (1_u64 << 40) as f64;

/// Balls whose cones are kept.
const KEPT: usize = 4;

/// Share of aimed photons, a. What no ball shows gets fewer photons, so its noise grows by 1/√(1 − a) at most: 12 %. With a fifth the
/// caustic of the hourglass scene has a tenth less error than with a tenth (`time_to_error`); three tenths gain nothing more.
pub const AIMED: f64 = 0.2;

/// What photons are aimed at. Nothing by default.
#[derive(Clone, Debug, Default)]
pub struct Aim {
    balls: Vec<Sphere>,
}

/// How a light sends its photons from one place.
#[derive(Clone, Copy, Debug)]
pub(super) enum Law {
    /// Evenly.
    Isotropic,
    /// By the cosine to this unit normal.
    Cosine(DVec3),
}

impl Law {
    /// A direction by this law.
    fn draw(self, u: [f64; 2]) -> DVec3 {
        match self {
            Self::Isotropic => uniform_sphere(u),
            Self::Cosine(normal) => cosine_hemisphere(normal, u),
        }
    }

    /// Density per solid angle of a direction.
    fn density(self, direction: DVec3) -> f64 {
        match self {
            Self::Isotropic => 0.25 / PI,
            Self::Cosine(normal) => cosine_density(normal.dot(direction)),
        }
    }

    /// 1 − cosine of the half angle under which a place sees a ball; `None` if none of the light goes there, or some in every
    /// direction.
    fn cone(self, from: DVec3, ball: &Sphere) -> Option<f64> {
        let to_center = ball.center - from;
        let before = match self {
            Self::Isotropic => true,
            Self::Cosine(normal) => to_center.dot(normal) > -ball.radius,
        };
        let least = LEAST_SINE * LEAST_SINE * to_center.length_squared();
        if before && ball.radius * ball.radius >= least {
            cone_of_sphere(ball, from)
        } else {
            None
        }
    }
}

impl Aim {
    /// At what is glass or mirror, without diffuse reflection, and round: flat things focus nothing.
    pub fn at(objects: &[Object], materials: &[Material]) -> Self {
        let specular = |material: &Material| {
            let mirror = material.mirror.is_some_and(|share| share != Rgb::ZERO);
            material.dielectric.is_some() || mirror && material.diffuse.is_none()
        };
        let ball = |object: &Object| match &object.shape {
            Shape::Sphere(sphere) => Some(*sphere),
            Shape::Revolution(revolution) => Some(revolution.bounding_sphere()),
            Shape::Quad(_) | Shape::Plane(_) | Shape::Disc(_) => None,
        };
        let aimed = objects
            .iter()
            .filter(|object| specular(&materials[object.material]));
        Self {
            balls: aimed.filter_map(ball).collect(),
        }
    }

    /// A direction from a place, and p₀/p. Draws from `stream` only if there is something to aim at.
    pub(super) fn direct(
        &self,
        from: DVec3,
        law: Law,
        u: [f64; 2],
        stream: &mut impl Numbers,
    ) -> (DVec3, f64) {
        // Cones are worked out once, but for those of many balls.
        let mut kept = [None; KEPT];
        for (cone, ball) in kept.iter_mut().zip(&self.balls) {
            *cone = law.cone(from, ball);
        }
        let cone = |(number, ball): (usize, &Sphere)| match kept.get(number) {
            Some(&cone) => cone,
            None => law.cone(from, ball),
        };
        let balls = || self.balls.iter().enumerate();
        let seen = || balls().filter_map(|ball| Some((ball.0, ball.1, cone(ball)?)));
        let count = seen().count() as f64;
        if count == 0.0 {
            return (law.draw(u), 1.0);
        }
        // In the lowest part of its range the number also says at which ball.
        let choice = stream.uniform() * count / AIMED;
        let chosen = if choice < count {
            seen().nth(choice as usize)
        } else {
            None
        };
        let direction = match chosen {
            Some((_, ball, cone)) => uniform_cone((ball.center - from).normalize(), cone, u),
            None => law.draw(u),
        };
        let own = law.density(direction);
        if own == 0.0 {
            return (direction, 0.0);
        }
        let met = seen().filter(|(number, ball, _)| {
            // A direction on the rim may miss the ball that it was drawn for.
            let meant = chosen.is_some_and(|(chosen, ..)| chosen == *number);
            meant || meets(ball, from, direction)
        });
        let aimed = met.map(|(.., cone)| 1.0 / (TAU * cone)).sum::<f64>() / count;
        (direction, own / ((1.0 - AIMED) * own + AIMED * aimed))
    }
}

/// Whether a ray from outside a ball meets it. By the cross product: it loses no digits of small balls.
fn meets(ball: &Sphere, from: DVec3, direction: DVec3) -> bool {
    let to_center = ball.center - from;
    let past = to_center.cross(direction).length_squared();
    to_center.dot(direction) > 0.0 && past <= ball.radius * ball.radius
}
