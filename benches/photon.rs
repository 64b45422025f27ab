//! Photon tracing, camera paths, and a whole pass of the default photon map over the hourglass, on one thread and on two.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use photolathe::render::film::Film;
use photolathe::render::photon::camera::{Sampling, view};
use photolathe::render::photon::trace::trace;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::file::load;
use photolathe::scene::options::{Integrator, RenderTable};
use std::hint::black_box;
use std::path::Path;

const PHOTONS: u64 = 100_000;

fn passes(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hourglass.toml");
    let scene = load(&path, &[]).expect("the scene is valid");
    let settings = Settings::resolve(&RenderTable {
        integrator: Some(Integrator::Pppm),
        photons: Some(PHOTONS),
        ..RenderTable::default()
    });
    let mut group = criterion.benchmark_group("hourglass");
    group.sample_size(20);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads can be started");
        group.throughput(Throughput::Elements(PHOTONS));
        group.bench_function(format!("trace/{threads}"), |bencher| {
            pool.install(|| bencher.iter(|| black_box(trace(&scene, 1, 0, PHOTONS, None))));
        });
        group.bench_function(format!("pass/{threads}"), |bencher| {
            let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
            let (mut film, mut pass) = (Film::new(scene.film), 0);
            pool.install(|| {
                bencher.iter(|| {
                    mapper.pass(pass, &mut film, &mut Phases::default());
                    pass += 1;
                });
            });
        });
        let sampling = Sampling {
            spp: 1,
            seed: 1,
            pass: 0,
            radius: None,
            max_depth: None,
            split: false,
        };
        group.throughput(Throughput::Elements(256 * 256));
        group.bench_function(format!("camera/{threads}"), |bencher| {
            pool.install(|| bencher.iter(|| black_box(view(&scene, &sampling))));
        });
    }
    group.finish();
}

criterion_group!(benches, passes);
criterion_main!(benches);
