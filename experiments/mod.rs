//! One readable file per question, with its prediction.

pub mod agreement;
pub mod analytic;
pub mod antialias;
pub mod basins;
pub mod bounds;
pub mod caustic;
pub mod coverage;
pub mod cup;
pub mod dose;
pub mod eps;
pub mod formula_audit;
pub mod fresnel;
pub mod grazing;
pub mod index;
pub mod integrators;
pub mod lens;
pub mod newton_seeds;
pub mod photons;
pub mod radius;
pub mod regularity;
pub mod scaling;
pub mod solvers;
pub mod time_to_error;
pub mod watertight;

use crate::lab::experiment::Experiment;

/// All experiments, in the order of the page.
pub const ALL: &[Experiment] = &[
    solvers::EXPERIMENT,
    newton_seeds::EXPERIMENT,
    grazing::EXPERIMENT,
    basins::EXPERIMENT,
    bounds::EXPERIMENT,
    eps::EXPERIMENT,
    watertight::EXPERIMENT,
    dose::EXPERIMENT,
    photons::EXPERIMENT,
    antialias::EXPERIMENT,
    lens::EXPERIMENT,
    scaling::EXPERIMENT,
    time_to_error::EXPERIMENT,
    fresnel::EXPERIMENT,
    radius::EXPERIMENT,
    regularity::EXPERIMENT,
    index::EXPERIMENT,
    analytic::EXPERIMENT,
    caustic::EXPERIMENT,
    coverage::EXPERIMENT,
    agreement::EXPERIMENT,
    integrators::EXPERIMENT,
    formula_audit::EXPERIMENT,
];
