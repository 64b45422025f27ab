//! Counts of work: what a run did, independent of the machine's speed.

use serde::Serialize;
use std::ops::AddAssign;

macro_rules! work {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        /// Counters of the work done; every counter is a sum, so parts join by `+=` in any order.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct Work { $($(#[$doc])* pub $name: u64),* }

        impl AddAssign for Work {
            fn add_assign(&mut self, other: Self) { $(self.$name += other.$name;)* }
        }
    };
}

work! {
    /// Rays that start at the camera.
    camera_rays,
    /// Rays of reflection, refraction and diffuse scattering on camera paths.
    scattered_rays,
    /// Visibility tests towards lights.
    shadow_rays,
    /// Photons emitted.
    photon_paths,
    /// Straight parts of photon paths traced.
    photon_segments,
    /// Photons stored at diffuse surfaces.
    photons_stored,
    /// Rays tested against one shape (the test of a bounding volume included).
    surface_tests,
    /// Primitive bounding volumes of revolution surfaces tested.
    bounds_tests,
    /// Rays that a revolution surface's bounding volume kept from its solver.
    bounds_culled,
    /// Rays that passed a revolution surface's bounding volume.
    solver_calls,
    /// Newton or bracketing steps inside the solver of revolution surfaces.
    solver_iterations,
    /// Rays that the Bernstein solver could not decide in f64 and gave to the exact one.
    solver_fallbacks,
    /// Starts of next rays that the bound of the hit's error did not prove right: a probe decided.
    starts_tested,
    /// Starts of next rays that could not be proven to lie on the right side of the surface.
    unseparated,
    /// Nodes (or leaves) of the point index visited.
    index_visits,
    /// Points of the index tested against a query.
    index_tests,
    /// Photons that contributed to a hit point.
    photons_gathered,
}
