//! Who takes part, and how each is asked.

use super::library::Library;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::bernstein::Prepared;
use crate::geometry::revolution::clipping::ClippingSettings;
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Revolution, Solver, exact};
use crate::lab::families::Family;
use crate::numeric::simd::Vectors;
use crate::numeric::work::Work;

/// A way to find the nearest crossing.
pub(super) struct Contestant {
    /// Name in the table.
    pub(super) name: &'static str,
    /// Starts of Newton's method for each piece; 0 for other methods.
    pub(super) starts: u32,
    /// Share of the coordinates' size by which a crossing may be off: ten times what the method is asked for, so that only
    /// other crossings count as wrong.
    pub(super) tolerance: f64,
    way: Way,
}

enum Way {
    Ours(Solver),
    /// The default solver on all rays at once.
    Batch,
    Library(Library),
    /// The default solver without one of its ingredients, alone or on all rays at once.
    Without(Box<Prepared>, Company),
}

/// Whether rays are answered one at a time.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Company {
    Alone,
    Batch,
}

/// The certified solvers are held to rounding.
const ROUNDING: f64 = 1e-13;

/// Everybody that takes part with rays of a family. The tallest and the smallest numbers of starts are for random rays alone: they
/// draw a law that `newton_seeds` measures in full.
pub(super) fn contestants(surface: &Revolution, family: Family) -> Vec<Contestant> {
    let ours = |name, starts, tolerance, solver| Contestant {
        name,
        starts,
        tolerance,
        way: Way::Ours(solver),
    };
    let library = |name, accuracy: f64| Contestant {
        name,
        starts: 0,
        tolerance: (10.0 * accuracy).max(1e-9),
        way: Way::Library(Library::new(surface.profile(), accuracy)),
    };
    let clipping = ClippingSettings::default();
    let mut all = vec![
        ours(BERNSTEIN, 0, ROUNDING, Solver::Bernstein),
        ours(EXACT, 0, ROUNDING, Solver::Exact),
        ours("clipping", 0, 1e-9, Solver::Clipping(clipping)),
        library(LIBRARY, 1e-14),
        library("polycool-default", 6e-7),
    ];
    all.insert(1, batch(BATCH));
    let starts: &[u32] = match family {
        Family::Random => &[3, 10, 30, 100],
        _ => &[30],
    };
    for &starts in starts {
        let settings = NewtonSettings {
            starts,
            ..NewtonSettings::default()
        };
        all.push(ours(NEWTON, starts, 1e-9, Solver::Newton(settings)));
    }
    if family == Family::Random {
        all.extend(ablation(surface));
    }
    let original = NewtonSettings::original();
    all.push(ours(
        "newton-original",
        original.starts,
        1e-6,
        Solver::Newton(original),
    ));
    all
}

/// The default solver on many rays at once.
fn batch(name: &'static str) -> Contestant {
    Contestant {
        name,
        starts: 0,
        tolerance: ROUNDING,
        way: Way::Batch,
    }
}

/// The default solver where another one's answers stand for the truth.
pub(super) fn checked() -> Contestant {
    batch(CHECKED)
}

/// The default solver without its vector instructions, and without its bounding test.
fn ablation(surface: &Revolution) -> [Contestant; 3] {
    let prepared = || Prepared::new(surface.profile());
    let portable = || prepared().with_vectors(Vectors::portable());
    let unbounded = prepared().culling(false);
    let without = |name, prepared, company| Contestant {
        name,
        starts: 0,
        tolerance: ROUNDING,
        way: Way::Without(Box::new(prepared), company),
    };
    [
        without(PORTABLE, portable(), Company::Alone),
        without(BATCH_PORTABLE, portable(), Company::Batch),
        without(BATCH_UNBOUNDED, unbounded, Company::Batch),
    ]
}

/// The default solver, a ray at a time.
pub(super) const BERNSTEIN: &str = "bernstein";
/// The same in batches.
pub(super) const BATCH: &str = "bernstein-batch";
/// The same, on more rays, checked by another solver.
pub(super) const CHECKED: &str = "bernstein-checked";
/// A ray at a time, with the instructions that every processor of the kind has.
pub(super) const PORTABLE: &str = "bernstein-portable";
/// The same in batches.
pub(super) const BATCH_PORTABLE: &str = "bernstein-batch-portable";
/// In batches, without the test of the bounding cylinder.
pub(super) const BATCH_UNBOUNDED: &str = "bernstein-batch-unbounded";
/// All by exact arithmetic: the default solver without its filter.
pub(super) const EXACT: &str = "exact";
/// Newton's method from random starts.
pub(super) const NEWTON: &str = "newton";
/// The general root finder at its best accuracy.
pub(super) const LIBRARY: &str = "polycool";

impl Contestant {
    /// t of the nearest crossing of each ray.
    pub(super) fn answer(
        &self,
        surface: &Revolution,
        rays: &[Ray],
        work: &mut Work,
    ) -> Vec<Option<f64>> {
        match &self.way {
            Way::Ours(solver) => (rays.iter())
                .map(|ray| surface.nearest(ray, solver, work).map(|c| c.t))
                .collect(),
            Way::Batch => {
                let mut found = vec![None; rays.len()];
                surface.nearest_many(rays, &Solver::Bernstein, &mut found, work);
                found.iter().map(|found| found.map(|c| c.t)).collect()
            }
            Way::Library(library) => rays.iter().map(|ray| library.nearest(ray)).collect(),
            Way::Without(prepared, company) => without(prepared, *company, surface, rays, work),
        }
    }
}

/// What a prepared profile answers, with the exact solver for what it cannot decide.
fn without(
    prepared: &Prepared,
    company: Company,
    surface: &Revolution,
    rays: &[Ray],
    work: &mut Work,
) -> Vec<Option<f64>> {
    let exactly = |ray| exact::crossings(surface.profile(), ray).first().copied();
    let mut found = vec![None; rays.len()];
    if company == Company::Alone {
        for (ray, found) in rays.iter().zip(&mut found) {
            *found = prepared.nearest(ray, work).unwrap_or_else(|_| exactly(ray));
        }
    } else {
        let mut undecided = Vec::new();
        prepared.nearest_many(rays, &mut found, &mut undecided, work);
        for number in undecided {
            found[number] = exactly(&rays[number]);
        }
    }
    found.iter().map(|found| found.map(|c| c.t)).collect()
}
