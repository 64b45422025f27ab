//! The surface of revolution of a piecewise cubic Bezier profile about its local +y axis.

pub mod bernstein;
pub mod exact;
pub mod newton;

use super::bounds::Aabb;
use super::hit::{Crossing, Hit};
use super::profile::Profile;
use super::ray::Ray;
use crate::numeric::work::Work;
use glam::{DMat3, DVec3};
use newton::NewtonSettings;

/// How to solve ray = surface of revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// Roots of the degree-6 polynomial, isolated in Bernstein form: the default.
    Bernstein,
    /// Newton's method in (t, u, θ) from many starts: the original's method, an object of study.
    Newton(NewtonSettings),
    /// Exact arithmetic: slow, the oracle.
    Exact,
}

/// Where the surface stands: scale, then rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Translation.
    pub translate: DVec3,
    /// Rotation (orthonormal).
    pub rotation: DMat3,
    /// Uniform scale, > 0.
    pub scale: f64,
}

/// A placed surface of revolution.
#[derive(Clone, Debug)]
pub struct Revolution {
    profile: Profile,
    placement: Placement,
}

impl Revolution {
    /// Revolves and places a profile.
    pub fn new(profile: Profile, placement: Placement) -> Self {
        Self { profile, placement }
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The placement.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// The nearest crossing inside the ray's open range.
    pub fn nearest(&self, _ray: &Ray, _solver: &Solver, _work: &mut Work) -> Option<Crossing> {
        todo!()
    }

    /// Every crossing inside the ray's open range, by rising t.
    pub fn crossings(&self, _ray: &Ray, _solver: &Solver, _work: &mut Work) -> Vec<Crossing> {
        todo!()
    }

    /// The full hit of a crossing.
    pub fn hit(&self, _ray: &Ray, _crossing: Crossing) -> Hit {
        todo!()
    }

    /// World bounds.
    pub fn bounds(&self) -> Aabb {
        todo!()
    }
}
