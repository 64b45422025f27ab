//! Fixed-radius search by every index: N hit points on walls, 10⁵ photons, half of them in a disc of 1 % of the area, radii such that a photon
//! meets about 20 hit points, equal or log-uniform over a factor 30. And a whole photon pass over a box.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use photolathe::geometry::planar::Quad;
use photolathe::geometry::revolution::Solver;
use photolathe::geometry::shape::Shape;
use photolathe::geometry::sphere::Sphere;
use photolathe::index::choice::Index;
use photolathe::index::{BallIndex, Balls, curve};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;
use photolathe::render::film::Film;
use photolathe::render::photon::{Phases, PhotonMapper};
use photolathe::render::settings::Settings;
use photolathe::scene::camera::{Camera, CameraDescription};
use photolathe::scene::light::{Emitter, Light, Lights};
use photolathe::scene::material::{Dielectric, Emission, Material, Pattern, Side};
use photolathe::scene::options::{IndexName, Integrator, RenderTable};
use photolathe::scene::{FilmSize, Object, Rgb, Scene};
use std::f64::consts::PI;
use std::hint::black_box;

const QUERIES: usize = 100_000;
const RESULTS_PER_QUERY: f64 = 20.0;

/// A point of one of three walls of the unit cube.
fn on_walls(stream: &mut Stream) -> DVec3 {
    let [a, b] = stream.uniform2();
    match (3.0 * stream.uniform()) as u32 {
        0 => DVec3::new(0.0, a, b),
        1 => DVec3::new(a, 0.0, b),
        _ => DVec3::new(a, b, 0.0),
    }
}

fn hit_points(n: usize, logarithmic: bool) -> Balls {
    let mut stream = Stream::new(1, Purpose::Experiment, 0);
    let centers = (0..n).map(|_| on_walls(&mut stream)).collect();
    // Radii r s with s from 1 to 30 have mean square r² (30² − 1)/(2 ln 30).
    let mean_square = if logarithmic {
        899.0 / (2.0 * libm::log(30.0))
    } else {
        1.0
    };
    let square = 3.0 * RESULTS_PER_QUERY / (PI * n as f64 * mean_square);
    let radii_squared = (0..n)
        .map(|_| {
            let scale = if logarithmic {
                libm::pow(30.0, stream.uniform())
            } else {
                1.0
            };
            square * scale * scale
        })
        .collect();
    Balls::new(centers, radii_squared).expect("valid balls")
}

fn photons() -> Vec<DVec3> {
    let mut stream = Stream::new(1, Purpose::Experiment, 1);
    let radius = (0.03 / PI).sqrt();
    (0..QUERIES)
        .map(|i| {
            if i % 2 == 0 {
                return on_walls(&mut stream);
            }
            let [u, angle] = stream.uniform2();
            let r = radius * u.sqrt();
            let angle = 2.0 * PI * angle;
            DVec3::new(0.5 + r * libm::cos(angle), 0.0, 0.5 + r * libm::sin(angle))
        })
        .collect()
}

fn count(index: &impl BallIndex, queries: &[DVec3]) -> u64 {
    let counts = index.join(
        queries,
        &|_, hits: &[u32]| hits.len() as u64,
        &mut Work::default(),
    );
    counts.in_order().into_iter().sum()
}

const INDICES: [IndexName; 5] = [
    IndexName::Kdtree,
    IndexName::KdtreeCycling,
    IndexName::Grid,
    IndexName::Wide,
    IndexName::WidePhotons,
];

fn search(criterion: &mut Criterion) {
    let queries = photons();
    let along: Vec<DVec3> = curve::order(&queries)
        .into_iter()
        .map(|query| queries[query as usize])
        .collect();
    for (name, logarithmic) in [("equal", false), ("log", true)] {
        let mut group = criterion.benchmark_group(format!("search/{name}"));
        group.sample_size(10);
        for n in [10_000, 100_000] {
            let balls = hit_points(n, logarithmic);
            for kind in INDICES {
                let index = Index::new(kind, balls.clone());
                let bench = |text: &str| BenchmarkId::new(format!("{kind:?} {text}"), n);
                group.throughput(Throughput::Elements(count(&index, &along)));
                group.bench_with_input(bench("join"), &index, |b, index| {
                    b.iter(|| count(index, black_box(&along)));
                });
                group.throughput(Throughput::Elements(n as u64));
                group.bench_with_input(bench("build"), &balls, |b, balls| {
                    b.iter(|| Index::new(kind, black_box(balls).clone()));
                });
            }
        }
        // The scan of all queries takes minutes: a hundredth of them.
        let few: Vec<DVec3> = queries.iter().copied().step_by(100).collect();
        let linear = Index::new(IndexName::Linear, hit_points(10_000, logarithmic));
        group.throughput(Throughput::Elements(count(&linear, &few)));
        let id = BenchmarkId::new("Linear join", 10_000);
        group.bench_with_input(id, &linear, |b, linear| {
            b.iter(|| count(linear, black_box(&few)));
        });
        group.finish();
    }
    let mut group = criterion.benchmark_group("search/order");
    group.throughput(Throughput::Elements(QUERIES as u64));
    group.bench_function("curve", |b| b.iter(|| curve::order(black_box(&queries))));
    group.finish();
}

fn material(diffuse: f64) -> Material {
    Material {
        name: String::new(),
        diffuse: Some(Pattern::Constant(Rgb::splat(diffuse))),
        mirror: None,
        dielectric: None,
        emission: None,
    }
}

/// A box of side 2 with a lamp, a glass ball and a diffuse ball.
fn a_box() -> Scene {
    let (x, y, z) = (2.0 * DVec3::X, 2.0 * DVec3::Y, 2.0 * DVec3::Z);
    let corner = DVec3::new(-1.0, 0.0, -1.0);
    let quad = |corner, edge_u, edge_v| Shape::Quad(Quad::new(corner, edge_u, edge_v));
    let ball = |x, z| {
        Shape::Sphere(Sphere {
            center: DVec3::new(x, 0.4, z),
            radius: 0.39,
        })
    };
    let lamp = Material {
        emission: Some(Emission {
            radiance: Rgb::splat(20.0),
            side: Side::Front,
        }),
        ..material(0.1)
    };
    let glass = Material {
        dielectric: Some(Dielectric {
            ior: 1.5,
            absorption: Rgb::ZERO,
        }),
        diffuse: None,
        ..material(0.0)
    };
    let things = [
        (quad(corner, z, x), material(0.7)),
        (quad(corner + y, x, z), material(0.7)),
        (quad(corner, x, y), material(0.7)),
        (quad(corner, y, z), material(0.5)),
        (quad(corner + x, z, y), material(0.5)),
        (quad(DVec3::new(-0.3, 1.99, -0.3), 0.3 * x, 0.3 * z), lamp),
        (ball(-0.4, 0.2), glass),
        (ball(0.45, -0.3), material(0.6)),
    ];
    let (mut objects, mut materials, mut lights) = (Vec::new(), Vec::new(), Vec::new());
    for (index, (shape, material)) in things.into_iter().enumerate() {
        let object = Object {
            name: index.to_string(),
            bounds: shape.bounds(),
            shape,
            material: index,
        };
        if let (Some(emission), Some(surface)) = (material.emission, Emitter::of(&object)) {
            lights.push(Light::Area {
                object: index,
                surface,
                emission,
            });
        }
        objects.push(object);
        materials.push(material);
    }
    Scene {
        title: String::new(),
        background: Rgb::ZERO,
        camera: Camera::new(&CameraDescription {
            eye: DVec3::new(0.0, 1.0, 4.2),
            target: DVec3::new(0.0, 1.0, 0.0),
            up: DVec3::Y,
            vertical_fov_deg: 35.0,
            lens_radius: 0.0,
            focus_distance: 4.0,
        }),
        film: FilmSize {
            width: 256,
            height: 256,
        },
        materials,
        objects,
        lights: Lights::new(lights),
        solver: Solver::Bernstein,
        render: RenderTable::default(),
        hash: String::new(),
    }
}

/// 256 × 256 pixels, 10⁵ photon paths a pass, one thread.
fn pass(criterion: &mut Criterion) {
    let scene = a_box();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let mut group = criterion.benchmark_group("pass");
    group.sample_size(10);
    for integrator in [Integrator::Ppm, Integrator::Pppm] {
        let settings = Settings::resolve(&RenderTable {
            integrator: Some(integrator),
            ..RenderTable::default()
        });
        let mut film = Film::new(scene.film);
        let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
        let (mut number, mut phases) = (0, Phases::default());
        let mut work = Work::default();
        group.bench_function(format!("{integrator:?} 256² 100k"), |b| {
            b.iter(|| {
                let done = pool.install(|| mapper.pass(number, &mut film, &mut phases));
                number += 1;
                work += done;
            });
        });
        let passes = number as f64;
        eprintln!(
            "{integrator:?}: ms a pass: camera {:.1}, trace {:.1}, build {:.1}, gather {:.1}; {:.2} segments, {:.2} gathered a path",
            1e3 * phases.camera / passes,
            1e3 * phases.trace / passes,
            1e3 * phases.build / passes,
            1e3 * phases.gather / passes,
            work.photon_segments as f64 / work.photon_paths as f64,
            work.photons_gathered as f64 / work.photon_paths as f64,
        );
    }
    group.finish();
}

criterion_group!(benches, search, pass);
criterion_main!(benches);
