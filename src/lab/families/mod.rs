//! Families of rays, easy and hard, for any placed surface of revolution.
//!
//! A ray is a function of surface, family and a keyed [`Stream`]. It is made in the profile's own frame and then placed; what a
//! family says exactly (d_y = 0, through a joint's circle) holds exactly where that change of frame is exact: always for a
//! surface that is neither moved nor turned nor scaled.

mod aim;
mod features;
mod secondary;

use crate::geometry::ray::Ray;
use crate::geometry::revolution::{Revolution, Solver};
use crate::geometry::shape::Shape;
use crate::numeric::rng::{Purpose, Stream, mix};
use crate::numeric::work::Work;
use crate::scene::Scene;
use aim::{inside, level, pick, quarter, sign, small, sphere};
use clap::ValueEnum;
use features::Features;
use glam::DVec3;
use std::f64::consts::TAU;

/// A kind of ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Family {
    /// From 3 sizes away to a uniform point of the bounding cylinder
    Random,
    /// From a uniform point of the bounding cylinder in any direction
    Inside,
    /// Perpendicular to the axis: d_y = 0
    Horizontal,
    /// |d_y| from 1e-1 to 1e-300, log-uniform
    NearHorizontal,
    /// Perpendicular to the axis, at exactly the height of a joint or an end
    HorizontalJoints,
    /// Along the axis (one in four) or parallel to it
    Axis,
    /// Past the axis at 1e-3 to 1e-16 sizes, parallel to it, tilted by as little, or in any direction
    NearAxis,
    /// Aimed at the circle of a joint or an end; every other ray meets it exactly at t = 1
    Joints,
    /// The same for joints at which the profile has a corner
    Kinks,
    /// Aimed at the points in which the profile ends on the axis
    Caps,
    /// From 1e6 sizes away
    Far,
    /// From 1e-8 to 1e8 sizes before a point of the surface (log-uniform), in any direction
    Scales,
    /// Random rays with directions of length 1e-20 to 1e20, log-uniform
    Directions,
    /// From a crossing of a random ray as a renderer leaves it, in any direction
    Leaving,
    /// Tangent to the surface, then moved off it to either side by 1e-3 to 1e-16 sizes, or by 1 to 4 ulps (one in four)
    Grazes,
    /// Tangent to a joint's circle in its own plane, exactly; or tangent anywhere, up to rounding
    Tangents,
    /// In a plane that holds the axis
    Meridian,
    /// Through the gap between two nearly parallel sheets closer than 2 % of the size, from outside and from within the gap
    ThinWalls,
    /// Aimed at a circle in which the surface crosses itself
    Loops,
    /// Aimed at a point inside a piece at which the profile stands still
    Cusps,
    /// Aimed at a point inside a piece at which radius or height turns back: level, upright, or in any direction
    Folds,
    /// Aimed at pieces that are points, on the axis, flat, or upright, and at ends of zero speed; also within their planes
    Degenerate,
    /// Rays by which random camera paths of the scene leave the surface: reflected, refracted, scattered
    Secondary,
}

/// Why a family has no rays for a surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("family `{}` does not fit this surface: {reason}", family.name())]
pub struct Unfit {
    family: Family,
    reason: &'static str,
}

impl Family {
    /// The name used on command lines and in tables.
    pub fn name(self) -> String {
        self.to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// The family of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::value_variants()
            .iter()
            .copied()
            .find(|family| family.name() == name)
    }

    /// How its rays are made, in one line.
    pub fn recipe(self) -> String {
        self.to_possible_value()
            .and_then(|value| value.get_help().map(ToString::to_string))
            .unwrap_or_default()
    }

    /// The stream of ray `index`.
    pub fn stream(self, seed: u64, index: u64) -> Stream {
        let index = mix(&[self as u64, index]);
        Stream::new(seed, Purpose::Experiment, index)
    }
}

/// A surface made ready to be aimed at.
#[derive(Clone, Debug)]
pub struct Target<'a> {
    shape: &'a Revolution,
    scene: Option<(&'a Scene, usize)>,
    features: Features,
}

/// Random rays tried for one that meets the surface.
const TRIES: usize = 256;

impl<'a> Target<'a> {
    /// A surface by itself; it has no secondary rays.
    pub fn new(shape: &'a Revolution) -> Self {
        Self {
            shape,
            scene: None,
            features: Features::of(shape.profile()),
        }
    }

    /// The surfaces of revolution of a scene, in its order.
    pub fn all_of(scene: &'a Scene) -> Vec<Self> {
        let objects = scene.objects.iter().enumerate();
        objects
            .filter_map(|(index, object)| match &object.shape {
                Shape::Revolution(shape) => Some(Self {
                    scene: Some((scene, index)),
                    ..Self::new(shape)
                }),
                _ => None,
            })
            .collect()
    }

    /// Whether the family has rays for this surface.
    ///
    /// # Errors
    /// Says what the surface lacks.
    pub fn fits(&self, family: Family) -> Result<(), Unfit> {
        self.ray(family, &mut family.stream(0, 0)).map(drop)
    }

    /// A ray of the family, in the world, with the range (0, ∞).
    ///
    /// # Errors
    /// The family does not fit this surface.
    pub fn ray(&self, family: Family, s: &mut Stream) -> Result<Ray, Unfit> {
        let ray = match family {
            Family::Leaving => self.leaving(s),
            Family::Secondary => self
                .scene
                .and_then(|(scene, object)| secondary::ray(scene, object, s)),
            _ if needs_frame(family) && !self.keeps_axes() => None,
            _ => self.local(family, s).map(|ray| self.placed(&ray)),
        };
        ray.ok_or_else(|| Unfit {
            family,
            reason: self.lack(family),
        })
    }

    /// What a surface lacks for which the family has no ray.
    fn lack(&self, family: Family) -> &'static str {
        match family {
            Family::Kinks => "its joints have no corner",
            Family::Caps => "it has no end on the axis",
            Family::ThinWalls => "no two sheets are parallel and closer than 2 % of its size",
            Family::Loops => "its profile does not cross itself",
            Family::Cusps => "its profile stands still nowhere inside a piece",
            Family::Folds => "neither radius nor height turns back inside a piece",
            Family::Degenerate => {
                "no piece is a point, on the axis, flat, upright, or at rest at an end"
            }
            Family::Secondary if self.scene.is_none() => "it stands in no scene",
            Family::Secondary => "no camera path of the scene meets it and goes on",
            Family::Leaving => "no random ray meets it",
            _ => "it is turned by other than quarter turns, so that its frame is rounded",
        }
    }

    /// Whether the rotation only exchanges axes.
    fn keeps_axes(&self) -> bool {
        let entries = self.shape.placement().rotation.to_cols_array();
        entries.iter().all(|x| x.abs() == 1.0 || *x == 0.0)
    }

    fn placed(&self, ray: &Ray) -> Ray {
        let placement = self.shape.placement();
        Ray::new(
            placement.point_to_world(ray.origin),
            placement.rotation * ray.direction,
        )
    }

    fn leaving(&self, s: &mut Stream) -> Option<Ray> {
        for _ in 0..TRIES {
            let ray = self.placed(&self.features.random(s));
            let found = self
                .shape
                .crossings(&ray, &Solver::Bernstein, &mut Work::default());
            let (choice, direction) = (s.uniform(), sphere(s));
            if !found.is_empty() {
                let crossing = found[pick(found.len(), choice)];
                let hit = self.shape.hit(&ray, crossing);
                let side = hit.side_met(-direction);
                let mut work = Work::default();
                return Some(self.shape.leave(&hit, side, direction, &mut work));
            }
        }
        None
    }

    /// A ray in the profile's own frame.
    fn local(&self, family: Family, s: &mut Stream) -> Option<Ray> {
        let features = &self.features;
        let size = features.size;
        let ray = match family {
            Family::Random | Family::Leaving | Family::Secondary => features.random(s),
            Family::Inside => Ray::new(inside(&features.cylinder, s), sphere(s)),
            Family::Horizontal | Family::NearHorizontal => {
                let target = inside(&features.cylinder, s);
                let mut direction = level(s);
                if family == Family::NearHorizontal {
                    direction.y = small(s, -300.0, -1.0);
                }
                Ray::new(target - 3.0 * size * direction, direction)
            }
            Family::HorizontalJoints => {
                let [_, height] = *features.one_of(&features.joints, s)?;
                let target = inside(&features.cylinder, s);
                let direction = level(s);
                let mut origin = target - 3.0 * size * direction;
                origin.y = height;
                Ray::new(origin, direction)
            }
            Family::Axis | Family::NearAxis => self.along_axis(family, s),
            Family::Joints => features.at_circle(*features.one_of(&features.joints, s)?, s),
            Family::Kinks => features.at_circle(*features.one_of(&features.kinks, s)?, s),
            Family::Caps => features.at_circle(*features.one_of(&features.caps, s)?, s),
            Family::Far => {
                let target = inside(&features.cylinder, s);
                towards(target, 1e6 * size, s)
            }
            Family::Scales => {
                let distance = size * libm::exp10(s.range(-8.0, 8.0));
                let (point, _) = features.on_surface(s);
                towards(point, distance, s)
            }
            Family::Directions => {
                let length = libm::exp10(s.range(-20.0, 20.0));
                let ray = features.random(s);
                Ray::new(ray.origin, length * ray.direction)
            }
            Family::Grazes => features.graze(s),
            Family::Tangents => features.tangent(s)?,
            Family::Meridian => {
                let outward = level(s);
                let (sin, cos) = libm::sincos(TAU * s.uniform());
                let direction = cos * outward + sin * DVec3::Y;
                let height = inside(&features.cylinder, s).y;
                Ray::new(DVec3::Y * height - 3.0 * size * direction, direction)
            }
            Family::ThinWalls => features.through_wall(s)?,
            Family::Loops => features.at_circle(*features.one_of(&features.loops, s)?, s),
            Family::Cusps => features.at_circle(*features.one_of(&features.cusps, s)?, s),
            Family::Folds => features.along(*features.one_of(&features.turns, s)?, s),
            Family::Degenerate => features.along(*features.one_of(&features.degenerate, s)?, s),
        };
        Some(ray)
    }

    fn along_axis(&self, family: Family, s: &mut Stream) -> Ray {
        let features = &self.features;
        let size = features.size;
        let upright = DVec3::new(0.0, sign(s), 0.0);
        let target = inside(&features.cylinder, s);
        if family == Family::Axis {
            let on_axis = s.uniform() < 0.25;
            let through = if on_axis { DVec3::Y * target.y } else { target };
            return Ray::new(through - 3.0 * size * upright, upright);
        }
        let aside = size * small(s, -16.0, -3.0) * quarter(s);
        let close = DVec3::Y * target.y + aside;
        let direction = match s.uniform() {
            x if x < 0.4 => upright,
            x if x < 0.7 => upright + small(s, -16.0, -3.0) * quarter(s),
            _ => sphere(s),
        };
        Ray::new(close - 3.0 * size * direction, direction)
    }
}

/// Whether what the family promises is lost by rounding a rotation.
fn needs_frame(family: Family) -> bool {
    matches!(
        family,
        Family::Horizontal | Family::HorizontalJoints | Family::Axis
    )
}

/// A ray of unit direction that comes from any side and passes the target after this distance.
fn towards(target: DVec3, distance: f64, s: &mut Stream) -> Ray {
    let origin = target - distance * sphere(s);
    let path = target - origin;
    // Closer than the rounding of the coordinates there is no path left.
    let direction = path.try_normalize().unwrap_or(DVec3::X);
    Ray::new(origin, direction)
}
