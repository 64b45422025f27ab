//! Materials.

use super::Rgb;
use super::texture::Texture;
use crate::geometry::hit::Hit;
use glam::DVec2;
use std::sync::Arc;

/// What a surface does with light. A material with nothing set is black.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the scene file.
    pub name: String,
    /// Diffuse reflection on both sides.
    pub diffuse: Option<Pattern>,
    /// Mirror reflection on both sides.
    pub mirror: Option<Rgb>,
    /// Smooth dielectric; stands alone.
    pub dielectric: Option<Dielectric>,
    /// Emission.
    pub emission: Option<Emission>,
}

/// A reflectance over texture coordinates.
#[derive(Clone, Debug)]
pub enum Pattern {
    /// The same everywhere.
    Constant(Rgb),
    /// Checkerboard; `repeat` counts pairs of cells per unit of (s, t); colour 0 at the origin.
    Checker {
        /// The two reflectances.
        colors: [Rgb; 2],
        /// Pairs of cells per unit.
        repeat: DVec2,
    },
    /// Picture; `repeat` counts copies per unit of (s, t).
    Texture {
        /// The picture.
        texture: Arc<Texture>,
        /// Copies per unit.
        repeat: DVec2,
    },
}

impl Pattern {
    /// The reflectance at a hit.
    pub fn on(&self, hit: &Hit) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            _ => self.at(hit.st()),
        }
    }

    /// The reflectance at texture coordinates `st`.
    pub fn at(&self, st: DVec2) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            Self::Checker { colors, repeat } => {
                let cell = (2.0 * st * *repeat).floor();
                colors[(cell.x + cell.y).rem_euclid(2.0) as usize]
            }
            Self::Texture { texture, repeat } => texture.at(st * *repeat),
        }
    }

    /// The checker cell or the texel that holds `st`; the same number everywhere on a constant.
    pub fn cell(&self, st: DVec2) -> [i64; 2] {
        let cells = match self {
            Self::Constant(_) => return [0; 2],
            Self::Checker { repeat, .. } => 2.0 * *repeat,
            Self::Texture { texture, repeat } => {
                *repeat * DVec2::new(texture.width as f64, texture.height as f64)
            }
        };
        let cell = (st * cells).floor();
        [cell.x as i64, cell.y as i64]
    }
}

/// Smooth interface between vacuum outside and a medium inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction inside, > 0.
    pub ior: f64,
    /// Absorption per unit length inside, ≥ 0.
    pub absorption: Rgb,
}

/// Emitted radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance.
    pub radiance: Rgb,
    /// The sides that emit.
    pub side: Side,
}

/// Sides of a surface; the front is the normal's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The normal's side.
    Front,
    /// The other side.
    Back,
    /// Both sides.
    Both,
}

impl Emission {
    /// Radiance towards a viewer whose direction has this cosine with the normal.
    pub fn towards(&self, cos: f64) -> Rgb {
        let seen = match self.side {
            Side::Front => cos > 0.0,
            Side::Back => cos < 0.0,
            Side::Both => cos != 0.0,
        };
        if seen { self.radiance } else { Rgb::ZERO }
    }

    /// Number of sides that emit.
    pub fn sides(&self) -> f64 {
        if self.side == Side::Both { 2.0 } else { 1.0 }
    }
}
