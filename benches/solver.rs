//! Time of one ray against a surface of revolution, by solver.

#[path = "../tests/solver/rays.rs"]
mod rays;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::newton::NewtonSettings;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::numeric::work::Work;
use std::hint::black_box;

/// Every family is a benchmark of the default solver; the slow solvers see random rays only.
fn solvers(criterion: &mut Criterion) {
    for (name, profile) in [("cup", Profile::cup()), ("hourglass", Profile::hourglass())] {
        let shape = Revolution::new(profile, Placement::identity());
        for family in rays::FAMILIES {
            let label = format!("{name}/bernstein/{family:?}");
            measure(criterion, &label, &shape, family, &Solver::Bernstein, 1_000);
        }
        let newton = Solver::Newton(NewtonSettings::default());
        for (label, solver) in [("newton30", newton), ("exact", Solver::Exact)] {
            let label = format!("{name}/{label}/Random");
            measure(criterion, &label, &shape, rays::Family::Random, &solver, 20);
        }
    }
}

/// The time reported per element is that of one ray.
fn measure(
    criterion: &mut Criterion,
    label: &str,
    shape: &Revolution,
    family: rays::Family,
    solver: &Solver,
    count: u64,
) {
    let rays: Vec<Ray> = (0..count)
        .map(|i| rays::ray(shape.profile(), family, i))
        .collect();
    let mut group = criterion.benchmark_group("nearest");
    group
        .throughput(Throughput::Elements(count))
        .sample_size(20);
    group.bench_function(label, |bencher| {
        bencher.iter(|| {
            let mut work = Work::default();
            for ray in &rays {
                black_box(shape.nearest(black_box(ray), solver, &mut work));
            }
        });
    });
    group.finish();
}

criterion_group!(benches, solvers);
criterion_main!(benches);
