//! Bounding cylinder, normal, sphere, the start of the next ray, and the search of points.

use super::{Fault, Trial, compare};
use crate::experiments::cup::random_ray;
use crate::geometry::bounds::Cylinder;
use crate::geometry::hit::{Crossing, Hit};
use crate::geometry::planar::Disc;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Placement, Revolution, Solver, exact};
use crate::geometry::sphere::Sphere;
use crate::index::kdtree::{KdTree, Split};
use crate::index::{BallIndex, Balls};
use crate::numeric::rng::Stream;
use crate::numeric::work::Work;
use glam::DVec3;
use std::f64::consts::TAU;

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "discriminant ≤ 0 is a miss",
        number: "M9",
        component: "bounding cylinder",
        quantity: "share of crossings kept, rays parallel to the axis",
        hides_where: "rays that are not parallel to the axis",
        property: "no crossing of the exact solver is culled",
        examine: |trial| {
            let cup = Profile::cup();
            let count = trial.samples / 200;
            let kept = |f: Interval, parallel: bool| kept(trial, f, &cup, parallel, count);
            compare(
                tight as Interval,
                by_discriminant,
                |f| kept(f, true),
                |f| kept(f, false),
                |f| kept(f, true) == 1.0 && kept(f, false) == 1.0,
            )
        },
    },
    Fault {
        name: "greatest r for greatest |r|",
        number: "M10",
        component: "bounding cylinder",
        quantity: "share of crossings kept, profile of negative radii",
        hides_where: "profiles without negative radii",
        property: "no crossing of the exact solver is culled",
        examine: |trial| {
            let count = trial.samples / 200;
            compare(
                tight as Interval,
                by_greatest_radius,
                |f| kept(trial, f, &waist(), false, count),
                |f| kept(trial, f, &Profile::cup(), false, count),
                |f| kept(trial, f, &waist(), false, count) == 1.0,
            )
        },
    },
    Fault {
        name: "S_u × S_θ after the axis was turned",
        number: "2.13",
        component: "surface of revolution",
        quantity: "share of first hits of a solid whose normal faces the ray",
        hides_where: "|cos| between normal and ray",
        property: "a ray from outside meets the outside first",
        examine: |trial| {
            let share = |f: Normal| {
                mean_over_hits(trial, |s, ray, c| {
                    f64::from(u8::from(f(s, ray, c).dot(ray.direction) < 0.0))
                })
            };
            let cosine = |f: Normal| {
                mean_over_hits(trial, |s, ray, c| f(s, ray, c).dot(ray.direction).abs())
            };
            compare(outward as Normal, cross_of_tangents, share, cosine, |f| {
                share(f) == 1.0
            })
        },
    },
    Fault {
        name: "discriminant > eps",
        number: "M29",
        component: "sphere",
        quantity: "share of rays through a sphere of radius 1e-4 that meet it",
        hides_where: "rays that pass well inside a sphere of radius 1",
        property: "rays at (1 − 2⁻ᵏ) of the radius meet spheres of every size",
        examine: |_| {
            let through = |f: Meets, radius: f64| {
                let met = (0..50).filter(|&k| f(radius, f64::from(k) / 50.0));
                met.count() as f64 / 50.0
            };
            compare(
                sphere as Meets,
                with_a_cut_off,
                |f| through(f, 1e-4),
                |f| through(f, 1.0),
                |f| {
                    [1e-8, 1e-4, 1.0, 1e8]
                        .iter()
                        .all(|&radius| (1..50).all(|k| f(radius, 1.0 - libm::scalbn(1.0, -k))))
                },
            )
        },
    },
    Fault {
        name: "offset within the tolerance",
        number: "M28",
        component: "leaving a surface",
        quantity: "share of rays that meet the sheet they leave, Newton's hits",
        hides_where: "hits of a disc, which have almost no error",
        property: "no ray meets the sheet that it leaves",
        examine: |trial| {
            compare(
                leave as Leave,
                by_half_the_tolerance,
                |f| self_hits(trial, f),
                self_hits_of_a_disc,
                |f| self_hits(trial, f) == 0.0,
            )
        },
    },
    Fault {
        name: "strict < at the radius",
        number: "M12",
        component: "kd-tree",
        quantity: "points of the integer plane found within 5",
        hides_where: "radii that no distance equals, such as 5.05",
        property: "a ball holds its border: all points with x² + z² ≤ r², r = 1 … 25",
        examine: |_| {
            let found = |f: Search, r: f64| f(&lattice(), r).len() as f64;
            compare(
                by_tree as Search,
                strictly,
                |f| found(f, 5.0),
                |f| found(f, 5.05),
                |f| (1..=25).all(|r| f(&lattice(), f64::from(r)) == within(f64::from(r))),
            )
        },
    },
];

/// The part of a ray inside the bounding cylinder of a profile.
type Interval = fn(&Profile, &Ray) -> Option<(f64, f64)>;
type Normal = fn(&Revolution, &Ray, Crossing) -> DVec3;
/// Whether a sphere of this radius is met by a ray at this share of the radius from its centre.
type Meets = fn(f64, f64) -> bool;
type Leave = fn(&Hit, DVec3) -> Ray;
/// Points within a radius of the origin, in rising order.
type Search = fn(&[DVec3], f64) -> Vec<usize>;

fn tight(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    Cylinder::of(profile).interval(ray)
}

/// a t² + b t + c = 0 of the wall; only two different roots count.
fn by_discriminant(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let (o, d) = (ray.origin, ray.direction);
    let radius = Cylinder::of(profile).radius;
    let a = d.x * d.x + d.z * d.z;
    let b = 2.0 * (o.x * d.x + o.z * d.z);
    let c = o.x * o.x + o.z * o.z - radius * radius;
    tight(profile, ray).filter(|_| b * b - 4.0 * a * c > 0.0)
}

fn by_greatest_radius(profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let radii = profile.pieces().iter().flat_map(|piece| piece.radius);
    let cylinder = Cylinder {
        radius: radii.fold(0.0, f64::max),
        ..Cylinder::of(profile)
    };
    cylinder.interval(ray)
}

/// A curve that reaches −2.125 between ends of .5.
fn waist() -> Profile {
    let piece = Piece {
        radius: [0.5, -3.0, -3.0, 0.5],
        height: [0.0, 0.7, 1.4, 2.1],
    };
    Profile::new(vec![piece]).expect("one piece joins")
}

/// Share of the exact crossings of random rays that an interval holds.
fn kept(trial: &Trial, interval: Interval, profile: &Profile, parallel: bool, count: u64) -> f64 {
    let (mut kept, mut all) = (0, 0);
    for index in 0..count {
        let mut ray = random_ray(&mut trial.stream(index));
        if parallel {
            ray = Ray::new(0.3 * ray.origin.with_y(-20.0), DVec3::Y);
        }
        let span = interval(profile, &ray);
        let holds = |t: f64| span.is_some_and(|(low, high)| low <= t && t <= high);
        let crossings = exact::crossings(profile, &ray);
        kept += crossings.iter().filter(|c| holds(c.t)).count();
        all += crossings.len();
    }
    kept as f64 / all as f64
}

fn cup() -> Revolution {
    Revolution::new(Profile::cup(), Placement::identity())
}

fn outward(surface: &Revolution, ray: &Ray, crossing: Crossing) -> DVec3 {
    surface.hit(ray, crossing).normal
}

fn cross_of_tangents(surface: &Revolution, ray: &Ray, crossing: Crossing) -> DVec3 {
    let (sin, cos) = libm::sincos(surface.hit(ray, crossing).theta());
    let at = surface.profile().pieces()[crossing.piece as usize].at(crossing.u);
    let along_u = DVec3::new(
        at.radius_slope * sin,
        at.height_slope,
        at.radius_slope * cos,
    );
    let along_theta = at.radius * DVec3::new(cos, 0.0, -sin);
    along_u.cross(along_theta).normalize()
}

/// Mean of a value over the first hits of random rays with the cup.
fn mean_over_hits(trial: &Trial, value: impl Fn(&Revolution, &Ray, Crossing) -> f64) -> f64 {
    let cup = cup();
    let (mut sum, mut count) = (0.0, 0.0);
    for index in 0..trial.samples / 10 {
        let ray = random_ray(&mut trial.stream(index));
        if let Some(crossing) = cup.nearest(&ray, &Solver::Bernstein, &mut Work::default()) {
            sum += value(&cup, &ray, crossing);
            count += 1.0;
        }
    }
    sum / count
}

fn aimed(radius: f64, share: f64) -> (Sphere, Ray) {
    let sphere = Sphere {
        center: DVec3::ZERO,
        radius,
    };
    let origin = DVec3::new(share * radius, 0.0, -3.0 * radius);
    (sphere, Ray::new(origin, DVec3::Z))
}

fn sphere(radius: f64, share: f64) -> bool {
    let (sphere, ray) = aimed(radius, share);
    sphere.nearest(&ray).is_some()
}

/// The original's cut-off of the discriminant.
fn with_a_cut_off(radius: f64, share: f64) -> bool {
    let (_, ray) = aimed(radius, share);
    let b = ray.origin.dot(ray.direction);
    b * b - ray.origin.length_squared() + radius * radius > 1e-7
}

fn leave(hit: &Hit, direction: DVec3) -> Ray {
    Ray::new(hit.beside(hit.side_met(-direction)), direction)
}

fn by_half_the_tolerance(hit: &Hit, direction: DVec3) -> Ray {
    let side = hit.normal.dot(direction).signum();
    Ray::new(hit.offset(0.5 * side), direction)
}

/// Tolerance of the Newton solver whose hits are left; damped as the original's, it stops not far below.
const TOLERANCE: f64 = 1e-6;
const DAMPING: f64 = 0.7;

/// A direction on a random side of a normal, at a cosine of .05 or more, and that cosine.
fn departure(normal: DVec3, stream: &mut Stream) -> (DVec3, f64) {
    let side = (stream.uniform() - 0.5).signum();
    let cosine = stream.range(0.05, 1.0);
    let (sin, cos) = libm::sincos(TAU * stream.uniform());
    let (s, t) = normal.any_orthonormal_pair();
    let across = (1.0 - cosine * cosine).sqrt();
    (
        side * cosine * normal + across * (cos * s + sin * t),
        cosine,
    )
}

/// Share of rays that meet the sheet they leave, nearer than eight tolerances over the cosine (as in experiment `eps`).
fn self_hits(trial: &Trial, leave: Leave) -> f64 {
    let cup = cup();
    let (radius, height) = cup.profile().control_size();
    let error = TOLERANCE * (radius + height);
    let solver = Solver::Newton(NewtonSettings {
        tolerance: TOLERANCE,
        damping: DAMPING,
        ..NewtonSettings::default()
    });
    let (mut hits, mut count) = (0.0, 0.0);
    for index in 0..trial.samples / 50 {
        let mut stream = trial.stream(index);
        let ray = random_ray(&mut stream);
        let Some(crossing) = cup.nearest(&ray, &solver, &mut Work::default()) else {
            continue;
        };
        let hit = Hit {
            error,
            ..cup.hit(&ray, crossing)
        };
        let (direction, cosine) = departure(hit.normal, &mut stream);
        let next = leave(&hit, direction).until(8.0 * error / cosine);
        let met = cup.nearest(&next, &solver, &mut Work::default());
        hits += f64::from(u8::from(met.is_some_and(|c| c.piece == hit.piece)));
        count += 1.0;
    }
    hits / count
}

fn self_hits_of_a_disc(leave: Leave) -> f64 {
    let disc = Disc {
        center: DVec3::ZERO,
        normal: DVec3::Y,
        radius: 2.0,
    };
    let (mut hits, count) = (0.0, 50);
    for k in 1..=count {
        let x = f64::from(k) / 60.0;
        let down = Ray::new(DVec3::new(x, 1.0, 0.0), DVec3::NEG_Y);
        let Some(crossing) = disc.nearest(&down) else {
            return f64::NAN;
        };
        let next = leave(&disc.hit(&down, crossing), DVec3::new(0.6, 0.8, 0.0));
        hits += f64::from(u8::from(disc.nearest(&next).is_some()));
    }
    hits / f64::from(count)
}

/// The points (x, 0, z) with whole |x|, |z| ≤ 25.
fn lattice() -> Vec<DVec3> {
    let range = || (-25..=25).map(f64::from);
    range()
        .flat_map(|x| range().map(move |z| DVec3::new(x, 0.0, z)))
        .collect()
}

/// Whole numbers below 2⁵³: exact.
fn within(radius: f64) -> Vec<usize> {
    let lattice = lattice();
    (0..lattice.len())
        .filter(|&i| lattice[i].length_squared() <= radius * radius)
        .collect()
}

fn by_tree(points: &[DVec3], radius: f64) -> Vec<usize> {
    let radii_squared = vec![radius * radius; points.len()];
    let balls = Balls::new(points.to_vec(), radii_squared).expect("finite points");
    let mut found = Vec::new();
    KdTree::new(&balls, Split::Widest).visit(DVec3::ZERO, &mut Work::default(), &mut |item| {
        found.push(item);
    });
    found.sort_unstable();
    found
}

fn strictly(points: &[DVec3], radius: f64) -> Vec<usize> {
    (0..points.len())
        .filter(|&i| points[i].length_squared() < radius * radius)
        .collect()
}
