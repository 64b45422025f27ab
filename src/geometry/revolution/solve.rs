//! Asking the chosen solver.

use super::bernstein::{Certainty, Undecided};
use super::{Revolution, Solver, clipping, exact, newton};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use std::borrow::Cow;

impl Revolution {
    /// The nearest crossing inside the ray's open range.
    pub fn nearest(&self, ray: &Ray, solver: &Solver, work: &mut Work) -> Option<Crossing> {
        if *solver == Solver::Bernstein && self.prepared.culls() {
            let turned;
            let local = if self.in_place {
                ray
            } else {
                turned = self.placement.ray_to_local(ray);
                &turned
            };
            let answer = self.prepared.nearest(local, work);
            return answer.unwrap_or_else(|Undecided| self.exactly(local, work).first().copied());
        }
        let local = &self.enter(ray, work)?;
        match solver {
            Solver::Bernstein => self
                .prepared
                .nearest(local, work)
                .unwrap_or_else(|Undecided| self.exactly(local, work).first().copied()),
            Solver::Newton(settings) => newton::crossings(&self.profile, settings, local, work)
                .first()
                .copied(),
            Solver::Clipping(settings) => clipping::crossings(&self.profile, settings, local, work)
                .first()
                .copied(),
            Solver::Exact => exact::crossings(&self.profile, local).first().copied(),
        }
    }

    /// The nearest crossing of each ray, to the bit as [`Revolution::nearest`] gives it. The default solver behind its own bounding
    /// cylinder takes several rays at a time.
    ///
    /// # Panics
    /// If `found` is shorter than `rays`.
    pub fn nearest_many(
        &self,
        rays: &[Ray],
        solver: &Solver,
        found: &mut [Option<Crossing>],
        work: &mut Work,
    ) {
        let found = &mut found[..rays.len()];
        if *solver != Solver::Bernstein || !self.prepared.culls() {
            for (ray, found) in rays.iter().zip(found) {
                *found = self.nearest(ray, solver, work);
            }
            return;
        }
        let local: Cow<'_, [Ray]> = if self.in_place {
            rays.into()
        } else {
            let local = |ray| self.placement.ray_to_local(ray);
            rays.iter().map(local).collect()
        };
        let mut undecided = Vec::new();
        self.prepared
            .nearest_many(&local, found, &mut undecided, work);
        for number in undecided {
            found[number] = self.exactly(&local[number], work).first().copied();
        }
    }

    /// Every crossing inside the ray's open range, by rising t.
    pub fn crossings(&self, ray: &Ray, solver: &Solver, work: &mut Work) -> Vec<Crossing> {
        if *solver == Solver::Bernstein && self.prepared.culls() {
            let local = &self.placement.ray_to_local(ray);
            let answer = self.prepared.crossings(local, work);
            return answer.unwrap_or_else(|Undecided| self.exactly(local, work));
        }
        let Some(local) = &self.enter(ray, work) else {
            return Vec::new();
        };
        match solver {
            Solver::Bernstein => self
                .prepared
                .crossings(local, work)
                .unwrap_or_else(|Undecided| self.exactly(local, work)),
            Solver::Newton(settings) => newton::crossings(&self.profile, settings, local, work),
            Solver::Clipping(settings) => clipping::crossings(&self.profile, settings, local, work),
            Solver::Exact => exact::crossings(&self.profile, local),
        }
    }

    /// Bounds of the errors of a crossing that any solver found for this ray.
    ///
    /// Not counted: the rounding of the ray's way into the profile's frame, where the surface is placed elsewhere.
    pub fn certainty(&self, ray: &Ray, crossing: &Crossing) -> Certainty {
        let local = self.placement.ray_to_local(ray);
        self.prepared.certainty(&local, crossing)
    }

    /// What the f64 solver could not decide.
    #[cold]
    fn exactly(&self, local: &Ray, work: &mut Work) -> Vec<Crossing> {
        let met = |(low, high)| !(high <= local.t_min || low >= local.t_max);
        if !local.is_valid() || !self.cylinder.interval(local).is_some_and(met) {
            return Vec::new();
        }
        work.solver_fallbacks += 1;
        let suspects = self.prepared.suspects(local);
        exact::crossings_among(&self.profile, local, |piece| suspects.contains(&piece))
    }

    /// The ray in the profile's frame, if it may meet the surface's bounding volume.
    #[inline]
    fn enter(&self, ray: &Ray, work: &mut Work) -> Option<Ray> {
        if !ray.is_valid() {
            return None;
        }
        let local = self.placement.ray_to_local(ray);
        work.bounds_tests += self.volume.tests();
        let met = self.volume.interval(&local);
        let met = met.filter(|&(low, high)| !(high <= ray.t_min || low >= ray.t_max));
        if met.is_none() || !local.is_valid() {
            work.bounds_culled += 1;
            return None;
        }
        work.solver_calls += 1;
        Some(local)
    }
}
