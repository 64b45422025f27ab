//! The `[render]` and `[solver]` tables.

use super::build::optional;
use super::error::SceneError;
use super::table::{Field, Range, Table};
use crate::geometry::bounds::Bounding;
use crate::geometry::revolution::Solver;
use crate::geometry::revolution::clipping::ClippingSettings;
use crate::geometry::revolution::newton::{NewtonSettings, StartPolicy};
use crate::scene::options::{MOST_THREADS, RenderTable, SolverName};
use clap::ValueEnum;

/// Most starts and most iterations of Newton's method: far more than helps, few enough to end.
const MOST_STEPS: u64 = 1_000_000;

/// The `[render]` table; empty if absent.
pub(super) fn render(root: &Table) -> Result<RenderTable, SceneError> {
    let known = [
        "integrator",
        "spp",
        "sampler",
        "passes",
        "time",
        "photons",
        "alpha",
        "radius",
        "rule",
        "index",
        "kernel",
        "aa",
        "hash",
        "pattern",
        "threshold",
        "solver",
        "threads",
        "seed",
        "max_depth",
        "aov",
    ];
    let Some(field) = root.get("render") else {
        return Ok(RenderTable::default());
    };
    let table = field.table("[render]", &known)?;
    let word32 = u64::from(u32::MAX);
    let integer = |key, low, high| {
        table
            .get(key)
            .map(|field| field.integer(low, high))
            .transpose()
    };
    let number = |key, range| table.get(key).map(|field| field.number(range)).transpose();
    Ok(RenderTable {
        integrator: choice(&table, "integrator")?,
        spp: integer("spp", 1, word32)?.map(|spp| spp as u32),
        sampler: choice(&table, "sampler")?,
        passes: integer("passes", 1, u64::MAX)?,
        time: number("time", Range::Positive)?,
        photons: integer("photons", 0, u64::MAX)?,
        alpha: number("alpha", Range::PositiveShare)?,
        radius: number("radius", Range::Positive)?,
        rule: choice(&table, "rule")?,
        index: choice(&table, "index")?,
        kernel: choice(&table, "kernel")?,
        aa: choice(&table, "aa")?,
        hash: choice(&table, "hash")?,
        pattern: choice(&table, "pattern")?,
        threshold: number("threshold", Range::Positive)?,
        solver: choice(&table, "solver")?,
        threads: integer("threads", 1, MOST_THREADS.into())?.map(|threads| threads as usize),
        seed: integer("seed", 0, u64::MAX)?,
        max_depth: integer("max_depth", 0, word32)?.map(|depth| depth as u32),
        aov: choices(&table, "aov")?,
    })
}

/// The solver in force. The `[solver]` table holds the parameters of `newton` and `clipping` and the bounding volume; it is checked
/// whichever solver is named.
pub(super) fn solver(root: &Table, name: Option<SolverName>) -> Result<Solver, SceneError> {
    let table = solver_table(root)?;
    let newton = newton(table.as_ref())?;
    let clipping = clipping(table.as_ref())?;
    Ok(match name.unwrap_or(SolverName::Bernstein) {
        SolverName::Bernstein => Solver::Bernstein,
        SolverName::Newton => Solver::Newton(newton),
        SolverName::Clipping => Solver::Clipping(clipping),
        SolverName::Exact => Solver::Exact,
    })
}

fn solver_table<'a>(root: &Table<'a>) -> Result<Option<Table<'a>>, SceneError> {
    let known = [
        "starts",
        "iterations",
        "damping",
        "tolerance",
        "policy",
        "seed",
        "bounds",
    ];
    let field = root.get("solver");
    field
        .map(|field| field.table("[solver]", &known))
        .transpose()
}

/// The bounding volume of every surface of revolution, `bounds` in `[solver]`.
pub(super) fn bounding(root: &Table) -> Result<Bounding, SceneError> {
    let table = solver_table(root)?;
    let field = table.as_ref().and_then(|table| table.get("bounds"));
    field.map_or(Ok(Bounding::default()), |field| {
        Ok(Bounding::ALL[field.word(&Bounding::NAMES)?])
    })
}

fn newton(table: Option<&Table>) -> Result<NewtonSettings, SceneError> {
    let Some(table) = table else {
        return Ok(NewtonSettings::default());
    };
    let count = |field: &Field| Ok(field.integer(1, MOST_STEPS)? as u32);
    let policy = optional(table, "policy", NewtonSettings::default().policy, policy)?;
    let default = match policy {
        StartPolicy::Original => NewtonSettings::original(),
        _ => NewtonSettings::default(),
    };
    Ok(NewtonSettings {
        policy,
        starts: optional(table, "starts", default.starts, count)?,
        iterations: optional(table, "iterations", default.iterations, count)?,
        damping: optional(table, "damping", default.damping, |field| {
            field.number(Range::PositiveShare)
        })?,
        tolerance: tolerance(table, default.tolerance)?,
        seed: optional(table, "seed", default.seed, |field| {
            field.integer(0, u64::MAX)
        })?,
    })
}

fn clipping(table: Option<&Table>) -> Result<ClippingSettings, SceneError> {
    let default = ClippingSettings::default();
    let Some(table) = table else {
        return Ok(default);
    };
    Ok(ClippingSettings {
        tolerance: tolerance(table, default.tolerance)?,
    })
}

fn tolerance(table: &Table, default: f64) -> Result<f64, SceneError> {
    optional(table, "tolerance", default, |field| {
        field.number(Range::Positive)
    })
}

fn policy(field: &Field) -> Result<StartPolicy, SceneError> {
    Ok(
        match field.word(&["random-u", "solve-height", "stratified", "original"])? {
            0 => StartPolicy::RandomU,
            1 => StartPolicy::SolveHeight,
            2 => StartPolicy::Stratified,
            _ => StartPolicy::Original,
        },
    )
}

/// A value of an enum by its command-line name.
fn choice<T: ValueEnum>(table: &Table, key: &str) -> Result<Option<T>, SceneError> {
    table.get(key).map(|field| chosen(&field)).transpose()
}

/// A list of such values, which may be empty.
fn choices<T: ValueEnum>(table: &Table, key: &str) -> Result<Option<Vec<T>>, SceneError> {
    let Some(field) = table.get(key) else {
        return Ok(None);
    };
    let items = field.list("a list of words")?;
    items.iter().map(chosen).collect::<Result<_, _>>().map(Some)
}

fn chosen<T: ValueEnum>(field: &Field) -> Result<T, SceneError> {
    let values = T::value_variants();
    let names: Vec<String> = values
        .iter()
        .filter_map(|value| Some(value.to_possible_value()?.get_name().to_owned()))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Ok(values[field.word(&names)?].clone())
}
