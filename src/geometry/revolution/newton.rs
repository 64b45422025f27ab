//! Newton's method in (t, u, θ) from many starts: the original's solver, an object of study.

use crate::geometry::hit::Crossing;
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;

/// Parameters of the Newton solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Number of starts per piece.
    pub starts: u32,
    /// Where the starts lie.
    pub policy: StartPolicy,
    /// Most steps from one start.
    pub iterations: u32,
    /// Length of a step as a share of Newton's, in (0, 1].
    pub damping: f64,
    /// A root is accepted when max |F| is at most this times the size of the problem.
    pub tolerance: f64,
    /// Seed of the starts.
    pub seed: u64,
}

/// How a start is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartPolicy {
    /// The report's: a random height in the bounding cylinder gives t and θ where the ray meets the disc there; u is random.
    RandomU,
    /// A random height as above, and u a solution of h(u) = height.
    SolveHeight,
    /// Heights and u stratified over the starts.
    Stratified,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            starts: 30,
            policy: StartPolicy::RandomU,
            iterations: 20,
            damping: 1.0,
            tolerance: 1e-10,
            seed: 0,
        }
    }
}

/// Every crossing found inside the open range of a ray in the profile's own frame, by rising t.
pub fn crossings(
    _profile: &Profile,
    _settings: &NewtonSettings,
    _ray: &Ray,
    _work: &mut Work,
) -> Vec<Crossing> {
    todo!()
}
