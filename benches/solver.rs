//! Time of one ray against a surface of revolution, by solver, family and instruction set, alone and in batches; and of a whole
//! picture of the cup by solver.

#[path = "../tests/solver/aim.rs"]
mod aim;

use aim::{all_rays, rays};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use photolathe::experiments::solvers::library::Library;
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::bernstein::Prepared;
use photolathe::geometry::revolution::clipping::ClippingSettings;
use photolathe::geometry::revolution::newton::NewtonSettings;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::lab::families::Family;
use photolathe::numeric::simd::Vectors;
use photolathe::numeric::work::Work;
use photolathe::render::driver::render_unwatched;
use photolathe::render::settings::Settings;
use photolathe::scene::Scene;
use photolathe::scene::file::load;
use photolathe::scene::options::{Antialias, Integrator, RenderTable};
use std::hint::black_box;
use std::path::Path;

/// Every family is a benchmark of the default solver; the others see random rays only.
fn solvers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("nearest");
    group.sample_size(20);
    for (name, profile) in [("cup", Profile::cup()), ("hourglass", Profile::hourglass())] {
        let shape = Revolution::new(profile, Placement::identity());
        for (family, _) in all_rays(&shape, 1) {
            let rays = rays(&shape, family, 1_000);
            alone(
                &mut group,
                &format!("{name}/bernstein/{family:?}"),
                &shape,
                &Solver::Bernstein,
                &rays,
            );
            together(
                &mut group,
                &format!("{name}/bernstein-batch/{family:?}"),
                &shape,
                &rays,
            );
        }
        let clipping = Solver::Clipping(ClippingSettings::default());
        let newton = Solver::Newton(NewtonSettings::default());
        for (label, solver, count) in [
            ("clipping", clipping, 1_000),
            ("newton30", newton, 20),
            ("exact", Solver::Exact, 20),
        ] {
            let rays = rays(&shape, Family::Random, count);
            alone(
                &mut group,
                &format!("{name}/{label}/Random"),
                &shape,
                &solver,
                &rays,
            );
        }
        rival(&mut group, &format!("{name}/polycool/Random"), &shape);
        sets(&mut group, name, &shape);
    }
    group.finish();
}

/// The time reported per element is that of one ray.
fn alone(
    group: &mut BenchmarkGroup<'_, WallTime>,
    label: &str,
    shape: &Revolution,
    solver: &Solver,
    rays: &[Ray],
) {
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function(label, |bencher| {
        bencher.iter(|| {
            let mut work = Work::default();
            for ray in rays {
                black_box(shape.nearest(black_box(ray), solver, &mut work));
            }
        });
    });
}

fn together(
    group: &mut BenchmarkGroup<'_, WallTime>,
    label: &str,
    shape: &Revolution,
    rays: &[Ray],
) {
    let mut found = vec![None; rays.len()];
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function(label, |bencher| {
        bencher.iter(|| {
            let mut work = Work::default();
            let rays = black_box(rays);
            shape.nearest_many(rays, &Solver::Bernstein, &mut found, &mut work);
            black_box(&found);
        });
    });
}

fn rival(group: &mut BenchmarkGroup<'_, WallTime>, label: &str, shape: &Revolution) {
    let library = Library::new(shape.profile(), 1e-14);
    let rays = rays(shape, Family::Random, 1_000);
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function(label, |bencher| {
        bencher.iter(|| {
            for ray in &rays {
                black_box(library.nearest(black_box(ray)));
            }
        });
    });
}

/// What the instruction sets buy, with the same bits.
fn sets(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, shape: &Revolution) {
    let rays = rays(shape, Family::Random, 1_000);
    let mut found = vec![None; rays.len()];
    for vectors in Vectors::all() {
        let prepared = Prepared::new(shape.profile()).with_vectors(vectors);
        group.bench_function(format!("{name}/{vectors}/Random"), |bencher| {
            bencher.iter(|| {
                let mut work = Work::default();
                for ray in &rays {
                    let _ = black_box(prepared.nearest(black_box(ray), &mut work));
                }
            });
        });
        group.bench_function(format!("{name}/{vectors}-batch/Random"), |bencher| {
            bencher.iter(|| {
                let (mut work, mut undecided) = (Work::default(), Vec::new());
                prepared.nearest_many(black_box(&rays), &mut found, &mut undecided, &mut work);
                black_box(&found);
            });
        });
    }
}

/// What the solver does to a whole picture: the cup at 48 × 36, one thread.
fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("frame");
    group.sample_size(10);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cup.toml");
    let small = [("film.width", "48"), ("film.height", "36")];
    let small = small.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scene = load(&path, &small).expect("the cup");
    let settings = Settings::resolve(&RenderTable {
        integrator: Some(Integrator::Whitted),
        aa: Some(Antialias::None),
        threads: Some(1),
        ..RenderTable::default()
    });
    let newton = Solver::Newton(NewtonSettings {
        starts: 30,
        ..NewtonSettings::default()
    });
    for (label, solver) in [("bernstein", Solver::Bernstein), ("newton30", newton)] {
        let scene = Scene {
            solver,
            ..scene.clone()
        };
        group.bench_function(label, |bencher| {
            bencher.iter(|| render_unwatched(black_box(&scene), &settings));
        });
    }
    group.finish();
}

criterion_group!(benches, solvers, frames);
criterion_main!(benches);
