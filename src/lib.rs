//! photolathe: how right, and how fast, is each algorithm of a small photon-mapping ray tracer?
//!
//! Data flows one way, and a room may use only the rooms above it:
//!
//! ```text
//! numeric     keyed random numbers, Bernstein polynomials, exact dyadic arithmetic, statistics, work counters
//! geometry    ray, crossing, hit, profile, bounds, sphere, planar shapes, the surface of revolution and its solvers
//! scene       camera, material, texture, light, the TOML file; an immutable `Scene`
//! index       point indices for fixed-radius search (linear, kd-tree)
//! render      film, whitted, path, photon, path-hash antialiasing, the driver
//! image       EXR and PNG in and out, error metrics
//! lab         claim, sweep, golden, report
//! experiments one file per question
//! cli         arguments and exit codes
//! ```
//!
//! World units are abstract, radiance is linear RGB in W/(m² sr), the frame is right-handed with y up, and a ray is
//! `o + t d` with `d` of any length.

pub mod cli;
#[path = "../experiments/mod.rs"]
pub mod experiments;
pub mod geometry;
pub mod image;
pub mod index;
pub mod lab;
pub mod numeric;
pub mod render;
pub mod scene;
