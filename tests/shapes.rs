//! Sphere, quad, plane and disc against closed forms, on easy and hard rays.

use glam::DVec3;
use photolathe::geometry::hit::Side;
use photolathe::geometry::planar::{Disc, Plane, Quad, tangents};
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::geometry::shape::Shape;
use photolathe::geometry::sphere::Sphere;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;
use photolathe::scene::Scene;
use photolathe::scene::file::parse;
use photolathe::scene::sampling::uniform_sphere;
use std::path::Path;

fn unit_sphere() -> Sphere {
    Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
    }
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    Ray::new(DVec3::from_array(origin), DVec3::from_array(direction))
}

#[test]
fn a_sphere_is_met_where_a_planted_point_says() {
    let mut stream = Stream::new(1, Purpose::Test, 0);
    for _ in 0..20_000 {
        let center = DVec3::from_array([0; 3].map(|_| stream.range(-5.0, 5.0)));
        let sphere = Sphere {
            center,
            radius: libm::exp(stream.range(-3.0, 3.0)),
        };
        let outward = uniform_sphere(stream.uniform2());
        let mut direction = uniform_sphere(stream.uniform2());
        if direction.dot(outward) > 0.0 {
            direction = -direction;
        }
        let distance = libm::exp(stream.range(-2.0, 8.0));
        let planted = center + sphere.radius * outward;
        let from = Ray::new(planted - distance * direction, direction);
        let hit = sphere
            .nearest(&from)
            .map(|crossing| sphere.hit(&from, crossing));
        let hit = hit.expect("a ray aimed at a point of the sphere meets it");
        // The start is rounded at its own size, and a rounding across the ray is magnified by 1/cosine along it.
        let size = from.origin.length() + distance + sphere.radius;
        let tolerance = 16.0 * f64::EPSILON * size / outward.dot(direction).abs();
        assert!(
            hit.t <= distance + tolerance,
            "{} against {distance}",
            hit.t
        );
        assert!(
            (hit.t - distance).abs() <= tolerance,
            "{} against {distance}",
            hit.t
        );
        assert!(((hit.point - center).length() - sphere.radius).abs() <= hit.error);
        assert!((hit.normal.length() - 1.0).abs() < 1e-15);
    }
}

#[test]
fn a_tangent_ray_touches_a_sphere_once() {
    let touching = ray([1.0, 0.0, -3.0], [0.0, 0.0, 2.0]);
    let crossings = unit_sphere().crossings(&touching);
    assert_eq!(crossings.iter().map(|c| c.t).collect::<Vec<_>>(), [1.5]);
    let beside = ray([1.0_f64.next_up(), 0.0, -3.0], [0.0, 0.0, 2.0]);
    assert!(unit_sphere().nearest(&beside).is_none());
    let within = ray([1.0_f64.next_down(), 0.0, -3.0], [0.0, 0.0, 2.0]);
    assert_eq!(unit_sphere().crossings(&within).len(), 2);
}

#[test]
fn a_sphere_far_away_loses_no_digits() {
    for distance in [1e4, 1e8] {
        let far = ray([0.5, 0.0, -distance], [0.0, 0.0, 1.0]);
        let t = unit_sphere().nearest(&far).expect("the ray goes through").t;
        let expected = distance - 0.75_f64.sqrt();
        assert!(
            (t - expected).abs() <= 2.0 * f64::EPSILON * distance,
            "{t} against {expected}"
        );
    }
}

#[test]
fn directions_of_any_length_meet_the_same_points() {
    for length in [1e-300, 1e-20, 1.0, 1e20, 1e300] {
        let along = ray([0.25, 0.5, -4.0], [0.0, 0.0, length]);
        let t = unit_sphere()
            .nearest(&along)
            .expect("the ray goes through")
            .t;
        let expected = (4.0 - (1.0_f64 - 0.25 - 0.0625).sqrt()) / length;
        assert!(
            (t / expected - 1.0).abs() < 1e-15,
            "{length}: {t} against {expected}"
        );
    }
}

#[test]
fn the_range_of_a_ray_is_open() {
    let through = ray([0.0, 0.0, -3.0], [0.0, 0.0, 1.0]);
    let sphere = unit_sphere();
    assert_eq!(sphere.nearest(&through).map(|c| c.t), Some(2.0));
    assert_eq!(
        sphere
            .nearest(&Ray {
                t_min: 2.0,
                ..through
            })
            .map(|c| c.t),
        Some(4.0)
    );
    assert_eq!(sphere.nearest(&through.until(2.0)), None);
    assert_eq!(
        sphere.nearest(&Ray {
            t_min: 4.0,
            ..through
        }),
        None
    );
    let floor = Plane {
        point: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let down = ray([0.0, 2.0, 0.0], [0.0, -1.0, 0.0]);
    assert!(floor.nearest(&down).is_some());
    assert!(floor.nearest(&down.until(2.0)).is_none());
    assert!(floor.nearest(&Ray { t_min: 2.0, ..down }).is_none());
}

#[test]
fn a_ray_that_leaves_a_hit_never_meets_the_same_sheet_again() {
    let mut stream = Stream::new(2, Purpose::Test, 0);
    for _ in 0..20_000 {
        let center = DVec3::from_array([0; 3].map(|_| stream.range(-1.0, 1.0)))
            * libm::exp(stream.range(-9.0, 9.0));
        let radius = libm::exp(stream.range(-9.0, 9.0));
        let sphere = Sphere { center, radius };
        let outward = uniform_sphere(stream.uniform2());
        let start = center + 3.0 * radius * outward;
        let arriving = Ray::new(
            start,
            (center + 0.9 * radius * uniform_sphere(stream.uniform2()) - start).normalize(),
        );
        let Some(crossing) = sphere.nearest(&arriving) else {
            continue;
        };
        let hit = sphere.hit(&arriving, crossing);
        let next = uniform_sphere(stream.uniform2());
        let outside = if next.dot(hit.normal) < 0.0 {
            -next
        } else {
            next
        };
        assert_eq!(
            sphere.nearest(&Ray::new(hit.beside(Side::Front), outside)),
            None,
            "a ray outwards from a sphere is free"
        );
        let inside = sphere
            .nearest(&Ray::new(hit.beside(Side::Back), -outside))
            .expect("a ray inwards meets the far wall");
        let chord = 2.0 * radius * outside.dot(hit.normal);
        let slack = 64.0 * f64::EPSILON * (radius + center.length()) / outside.dot(hit.normal);
        assert!(
            (inside.t - chord).abs() <= slack,
            "{} against {chord}",
            inside.t
        );
    }
}

#[test]
fn a_quad_knows_its_border_and_its_coordinates() {
    let quad = Quad::new(
        DVec3::new(1.0, 2.0, 3.0),
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(1.0, 0.0, -4.0),
    );
    assert_eq!(quad.normal(), DVec3::Y);
    assert_eq!(quad.area(), 8.0);
    for (s, t, inside) in [
        (0.25, 0.75, true),
        (0.0, 0.0, true),
        (1.0, 1.0, true),
        (1.0 + 1e-9, 0.5, false),
        (0.5, -1e-9, false),
        (-1e-9, 0.5, false),
        (0.5, 1.0 + 1e-9, false),
    ] {
        let above = quad.corner + s * quad.edge_u + t * quad.edge_v + 5.0 * DVec3::Y;
        let down = Ray::new(above, -DVec3::Y);
        let crossing = quad.nearest(&down);
        assert_eq!(crossing.is_some(), inside, "({s}, {t})");
        if let Some(crossing) = crossing {
            let hit = quad.hit(&down, crossing);
            assert!((hit.st().x - s).abs() < 1e-15 && (hit.st().y - t).abs() < 1e-15);
            assert_eq!(hit.t, 5.0);
        }
    }
}

#[test]
fn a_disc_ends_at_its_radius() {
    let disc = Disc {
        center: DVec3::new(0.0, 1.0, 0.0),
        normal: DVec3::Y,
        radius: 2.0,
    };
    assert!(
        disc.nearest(&ray([2.0, 3.0, 0.0], [0.0, -1.0, 0.0]))
            .is_some()
    );
    assert!(
        disc.nearest(&ray([2.0_f64.next_up(), 3.0, 0.0], [0.0, -1.0, 0.0]))
            .is_none()
    );
    let down = ray([0.0, 3.0, 0.0], [0.0, -2.0, 0.0]);
    let hit = disc.hit(&down, disc.nearest(&down).expect("through the centre"));
    assert_eq!((hit.t, hit.st().x, hit.st().y), (1.0, 0.5, 0.5));
    let bounds = disc.bounds();
    assert_eq!(bounds.min, DVec3::new(-2.0, 1.0, -2.0));
    assert_eq!(bounds.max, DVec3::new(2.0, 1.0, 2.0));
}

#[test]
fn every_shape_is_asked_counted_and_bounded_as_itself() {
    let quad = Quad::new(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y);
    let plane = Plane {
        point: DVec3::ZERO,
        normal: DVec3::Z,
    };
    let disc = Disc {
        center: DVec3::ZERO,
        normal: DVec3::Z,
        radius: 1.0,
    };
    let cup = Revolution::new(Profile::cup(), Placement::identity());
    let through = ray([0.1, 0.2, 9.0], [0.0, 0.0, -1.0]);
    let mut work = Work::default();
    for (shape, ts, bounds) in [
        (
            Shape::Sphere(unit_sphere()),
            unit_sphere().crossings(&through),
            Some(unit_sphere().bounds()),
        ),
        (
            Shape::Quad(quad),
            quad.nearest(&through).into_iter().collect(),
            Some(quad.bounds()),
        ),
        (
            Shape::Plane(plane),
            plane.nearest(&through).into_iter().collect(),
            None,
        ),
        (
            Shape::Disc(disc),
            disc.nearest(&through).into_iter().collect(),
            Some(disc.bounds()),
        ),
        (
            Shape::Revolution(cup.clone()),
            cup.crossings(&through, &Solver::Exact, &mut Work::default()),
            Some(cup.bounds()),
        ),
    ] {
        let before = work.surface_tests;
        let nearest = shape.nearest(&through, &Solver::Exact, &mut work);
        let all = shape.crossings(&through, &Solver::Exact, &mut work);
        assert_eq!(work.surface_tests, before + 2);
        assert!(!ts.is_empty());
        assert_eq!((nearest, all), (ts.first().copied(), ts));
        assert_eq!(shape.bounds(), bounds);
    }
}

#[test]
fn a_ray_within_a_flat_shape_or_beside_it_has_no_hit() {
    let floor = Plane {
        point: DVec3::ZERO,
        normal: DVec3::Y,
    };
    assert_eq!(floor.nearest(&ray([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])), None);
    assert_eq!(floor.nearest(&ray([0.0, 1.0, 0.0], [1.0, 0.0, 0.0])), None);
    assert_eq!(floor.nearest(&ray([0.0, 1.0, 0.0], [1.0, 1.0, 0.0])), None);
}

#[test]
fn rays_that_are_not_finite_or_have_no_direction_meet_nothing() {
    let good = ray([0.0, 0.0, -3.0], [0.0, 0.0, 1.0]);
    let bad = [
        Ray {
            origin: DVec3::new(f64::NAN, 0.0, 0.0),
            ..good
        },
        Ray {
            origin: DVec3::new(0.0, f64::INFINITY, 0.0),
            ..good
        },
        Ray {
            direction: DVec3::ZERO,
            ..good
        },
        Ray {
            direction: DVec3::new(0.0, f64::NAN, 1.0),
            ..good
        },
        Ray {
            direction: DVec3::new(0.0, 0.0, f64::INFINITY),
            ..good
        },
        Ray {
            t_min: 5.0,
            t_max: 1.0,
            ..good
        },
        Ray {
            t_min: f64::NAN,
            ..good
        },
        Ray {
            t_max: f64::NAN,
            ..good
        },
    ];
    let quad = Quad::new(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y);
    let plane = Plane {
        point: DVec3::ZERO,
        normal: DVec3::Z,
    };
    let disc = Disc {
        center: DVec3::ZERO,
        normal: DVec3::Z,
        radius: 1.0,
    };
    assert!(
        quad.nearest(&good).is_some()
            && plane.nearest(&good).is_some()
            && disc.nearest(&good).is_some()
    );
    for ray in bad {
        assert_eq!(unit_sphere().nearest(&ray), None, "{ray:?}");
        assert_eq!(quad.nearest(&ray), None, "{ray:?}");
        assert_eq!(plane.nearest(&ray), None, "{ray:?}");
        assert_eq!(disc.nearest(&ray), None, "{ray:?}");
    }
}

#[test]
fn tangents_make_a_right_handed_frame() {
    let mut stream = Stream::new(4, Purpose::Test, 0);
    for _ in 0..1000 {
        let normal = uniform_sphere(stream.uniform2());
        let (s, t) = tangents(normal);
        assert!((s.cross(t) - normal).length() < 1e-14);
        assert!(s.dot(t).abs() < 1e-15 && (s.length() - 1.0).abs() < 1e-15);
    }
    assert_eq!(tangents(DVec3::Y), (DVec3::X, -DVec3::Z));
    assert_eq!(tangents(DVec3::Z), (DVec3::X, DVec3::Y));
}

/// A scene of materials and objects.
fn scene(objects: &str) -> Scene {
    let view = "[camera]\neye = [0, 0, 9]\ntarget = [0, 0, 0]\nvertical_fov_deg = 30\n[film]\nwidth = 1\nheight = 1\n";
    parse(&(view.to_owned() + objects), "scene", Path::new("."), &[]).expect("a scene")
}

fn spheres(radii: &[f64]) -> Scene {
    let sphere = |radius| {
        format!("[[sphere]]\ncenter = [0, 0, 0]\nradius = {radius}\nmaterial = \"glass\"\n")
    };
    let glass = "[material.glass]\ndielectric = { ior = 1.5 }\n".to_owned();
    scene(&(glass + &radii.iter().map(sphere).collect::<String>()))
}

#[test]
fn hits_at_one_place_come_in_the_order_of_their_objects() {
    let scene = spheres(&[1.0, 1.0, 0.5, 1.0]);
    let through = ray([0.0, 0.0, 9.0], [0.0, 0.0, -1.0]);
    let hits = scene.intersect_all(&through, &mut Work::default());
    let objects: Vec<usize> = hits.iter().map(|hit| hit.object).collect();
    assert_eq!(objects, [0, 1, 3, 2, 2, 0, 1, 3]);
    let first = scene.intersect(&through, &mut Work::default());
    assert_eq!(first.expect("a sphere").object, 0);
}

/// Lamps of two kinds let into a ceiling of three kinds, listed before and after it, whatever the size of the quads: the lamp is met,
/// alone or in lanes, from the side to which it shines; from the other, the ceiling.
#[test]
fn a_lamp_is_met_before_the_ceiling_that_it_lies_in() {
    const ROOM: &str = r#"
[material.wall]
diffuse = { reflectance = [0.5, 0.5, 0.5] }
[material.lamp]
emission = { radiance = [1, 1, 1] }
[[revolution]]
profile = [[[0, 1.7], [0.3, 1.7], [0.6, 1.7], [0.9, 1.7]]]
material = "wall"
[[quad]]
corner = [-0.3, 1.7, -0.3]
edge_u = [0.7, 0, 0]
edge_v = [0, 0, 0.7]
material = "lamp"
[[quad]]
corner = [-3.1, 1.7, -3.3]
edge_u = [0, 0, 7.3]
edge_v = [6.7, 0, 0]
material = "wall"
[[plane]]
point = [0.1, 1.7, 0.9]
normal = [0, 1, 0]
material = "wall"
[[disc]]
center = [0.1, 1.7, 0.9]
normal = [0, -1, 0]
radius = 0.45
material = "lamp"
"#;
    let scene = scene(ROOM);
    let rays: Vec<Ray> = (0..2000)
        .map(|index| {
            let mut stream = Stream::new(6, Purpose::Test, index);
            let mut level = |size: f64| stream.range(-size, size);
            let above = if index % 3 == 0 { 3.3 } else { -0.9 };
            let from = DVec3::new(level(2.0), above, level(2.0));
            let towards = DVec3::new(
                level(0.3) + 0.1,
                1.7,
                level(0.3) + [0.1, 0.9][index as usize % 2],
            );
            Ray::new(from, towards - from)
        })
        .collect();
    let together = scene.intersect_many(&rays, &mut Work::default());
    let mut lit = 0;
    for (ray, hit) in rays.iter().zip(together) {
        let hit = hit.expect("the plane has no end");
        let place = hit.point;
        let on_quad = (place.x - 0.05).abs().max((place.z - 0.05).abs()) < 0.35;
        let on_disc = (place - DVec3::new(0.1, 1.7, 0.9)).length() < 0.45;
        let lamp = scene.material(&hit).emission.is_some();
        let below = ray.origin.y < 1.7;
        assert_eq!(lamp, below && (on_quad || on_disc), "{ray:?}");
        assert_eq!(scene.intersect(ray, &mut Work::default()), Some(hit));
        let all = scene.intersect_all(ray, &mut Work::default());
        assert_eq!(scene.material(&all[0]).emission.is_some(), lamp);
        lit += u32::from(lamp);
    }
    assert!(lit > 600, "{lit}");
}

#[test]
fn a_point_in_nested_glass_is_in_the_innermost() {
    for (radii, innermost) in [([1.0, 3.0, 2.0], 0), ([3.0, 2.0, 1.0], 2)] {
        let scene = spheres(&radii);
        let medium = |x| scene.medium_at(DVec3::new(x, 0.0, 0.0), &mut Work::default());
        assert_eq!(medium(0.5), Some(innermost));
        assert_eq!(medium(2.5), radii.iter().position(|&radius| radius == 3.0));
        assert_eq!(medium(3.5), None);
    }
}

/// Inside, a start may come out on the far side; outside, there is room however small the ball.
#[test]
fn only_the_inside_of_a_ball_may_be_too_thin_to_start_in() {
    let ball = Shape::Sphere(Sphere {
        center: DVec3::new(1e6, 0.0, 0.0),
        radius: 1e-9,
    });
    let towards = ray([1e6, 0.0, 5.0], [0.0, 0.0, -1.0]);
    let crossing = ball.nearest(&towards, &Solver::Bernstein, &mut Work::default());
    let hit = ball.hit(&towards, crossing.expect("through the centre"));
    for (side, unseparated) in [(Side::Front, 0), (Side::Back, 1)] {
        let mut work = Work::default();
        ball.leave(&hit, side, DVec3::Z, &mut work);
        assert_eq!(work.unseparated, unseparated, "{side:?}");
    }
}
