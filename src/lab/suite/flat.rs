//! Certain crossings of planes, quads, discs and spheres: the shapes as they are stored, without rounding.

use crate::geometry::planar::{Disc, Plane, Quad};
use crate::geometry::ray::Ray;
use crate::geometry::sphere::Sphere;
use crate::numeric::exact::{Dyadic, bracket, sign};
use glam::DVec3;

/// A parameter t, the floats next to it, and its multiplicity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Time {
    pub(super) t: f64,
    pub(super) bracket: [f64; 2],
    pub(super) multiplicity: u32,
}

type Vector = [Dyadic; 3];

fn exactly(v: DVec3) -> Vector {
    v.to_array().map(Dyadic::from_f64)
}

fn plus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|i| a[i].plus(&b[i]))
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|i| a[i].plus(&b[i].negated()))
}

fn scaled(a: &Vector, by: &Dyadic) -> Vector {
    [0, 1, 2].map(|i| a[i].times(by))
}

fn dot(a: &Vector, b: &Vector) -> Dyadic {
    let [x, y, z] = [0, 1, 2].map(|i| a[i].times(&b[i]));
    x.plus(&y).plus(&z)
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    let minor = |i: usize, j: usize| a[i].times(&b[j]).plus(&a[j].times(&b[i]).negated());
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Sign of a − b.
fn compare(a: &Dyadic, b: &Dyadic) -> i32 {
    sign(&a.plus(&b.negated()).mantissa)
}

/// Where a line meets a plane: t = rise / slope with slope > 0, and slope · (point − anchor).
struct Meeting {
    time: Time,
    from_anchor: Vector,
    slope: Dyadic,
}

/// The crossing of a ray with the plane through `anchor`, if it is in the open range; none within or beside the plane.
fn meet_plane(ray: &Ray, anchor: DVec3, normal: &Vector) -> Option<Meeting> {
    let (origin, direction) = (exactly(ray.origin), exactly(ray.direction));
    let (mut slope, mut rise) = (
        dot(&direction, normal),
        dot(&minus(&exactly(anchor), &origin), normal),
    );
    match sign(&slope.mantissa) {
        0 => return None,
        s if s < 0 => (slope, rise) = (slope.negated(), rise.negated()),
        _ => {}
    }
    let above = |limit: &Dyadic| compare(&rise, &slope.times(limit));
    if !in_range(ray, above) {
        return None;
    }
    let t = rise.over(&slope);
    let from_origin = minus(&origin, &exactly(anchor));
    Some(Meeting {
        time: Time {
            t,
            bracket: bracket(t, above),
            multiplicity: 1,
        },
        from_anchor: plus(&scaled(&from_origin, &slope), &scaled(&direction, &rise)),
        slope,
    })
}

/// Whether t is in the ray's open range, by the sign of t − limit.
fn in_range(ray: &Ray, sign_above: impl Fn(&Dyadic) -> i32) -> bool {
    let side = |limit: f64| {
        limit
            .is_finite()
            .then(|| sign_above(&Dyadic::from_f64(limit)))
    };
    side(ray.t_min).is_none_or(|s| s > 0) && side(ray.t_max).is_none_or(|s| s < 0)
}

pub(super) fn plane(plane: &Plane, ray: &Ray) -> Vec<Time> {
    let met = meet_plane(ray, plane.point, &exactly(plane.normal));
    met.map(|met| met.time).into_iter().collect()
}

pub(super) fn quad(quad: &Quad, ray: &Ray) -> Vec<Time> {
    let (u, v) = (exactly(quad.edge_u), exactly(quad.edge_v));
    let across = cross(&u, &v);
    let met = meet_plane(ray, quad.corner, &across);
    let inside = |met: &Meeting| {
        // Coordinates times slope |across|².
        let whole = met.slope.times(&dot(&across, &across));
        let coordinates = [
            dot(&cross(&met.from_anchor, &v), &across),
            dot(&cross(&u, &met.from_anchor), &across),
        ];
        coordinates
            .iter()
            .all(|c| sign(&c.mantissa) >= 0 && compare(c, &whole) <= 0)
    };
    met.filter(inside).map(|met| met.time).into_iter().collect()
}

pub(super) fn disc(disc: &Disc, ray: &Ray) -> Vec<Time> {
    let met = meet_plane(ray, disc.center, &exactly(disc.normal));
    let inside = |met: &Meeting| {
        let reach = met.slope.times(&Dyadic::from_f64(disc.radius));
        compare(
            &dot(&met.from_anchor, &met.from_anchor),
            &reach.times(&reach),
        ) <= 0
    };
    met.filter(inside).map(|met| met.time).into_iter().collect()
}

/// The roots of a t² + 2 b t + c.
pub(super) fn sphere(sphere: &Sphere, ray: &Ray) -> Vec<Time> {
    let direction = exactly(ray.direction);
    let offset = minus(&exactly(ray.origin), &exactly(sphere.center));
    let radius = Dyadic::from_f64(sphere.radius);
    let a = dot(&direction, &direction);
    let b = dot(&offset, &direction);
    let c = dot(&offset, &offset).plus(&radius.times(&radius).negated());
    let discriminant = b.times(&b).plus(&a.times(&c).negated());
    let branches: &[i32] = match sign(&discriminant.mantissa) {
        0 => &[0],
        s if s > 0 => &[-1, 1],
        _ => &[],
    };
    let time = |&branch: &i32| {
        // Sign of root − limit: by the sign of the quadratic there, and by the side of its vertex.
        let above = |limit: &Dyadic| {
            let half_slope = a.times(limit).plus(&b);
            let value = half_slope.plus(&b).times(limit).plus(&c);
            let vertex = -sign(&half_slope.mantissa);
            match (branch, sign(&value.mantissa)) {
                (0, _) => vertex,
                (_, s) if s < 0 => branch,
                (_, 0) if vertex == -branch => 0,
                (_, 0) => branch,
                _ => vertex,
            }
        };
        let t = root(branch, &a, &b, &c, &discriminant);
        in_range(ray, above).then(|| Time {
            t,
            bracket: bracket(t, above),
            multiplicity: if branch == 0 { 2 } else { 1 },
        })
    };
    branches.iter().filter_map(time).collect()
}

/// (−b ± √Δ)/a without cancellation.
fn root(branch: i32, a: &Dyadic, b: &Dyadic, c: &Dyadic, discriminant: &Dyadic) -> f64 {
    let distance = discriminant.sqrt();
    let far_branch = if sign(&b.mantissa) < 0 { 1 } else { -1 };
    let far = if far_branch > 0 {
        distance.plus(&b.negated())
    } else {
        distance.plus(b).negated()
    };
    if branch == 0 {
        b.negated().over(a)
    } else if branch == far_branch {
        far.over(a)
    } else {
        c.over(&far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    fn random(s: &mut Stream) -> DVec3 {
        DVec3::new(s.range(-3.0, 3.0), s.range(-3.0, 3.0), s.range(-3.0, 3.0))
    }

    fn nearest(times: &[Time]) -> Option<f64> {
        times.iter().map(|time| time.t).reduce(f64::min)
    }

    #[test]
    fn the_flat_shapes_and_the_sphere_agree_with_rounded_arithmetic() {
        let mut hits = 0;
        for index in 0..2000 {
            let mut s = Stream::new(1, Purpose::Test, index);
            let ray = Ray::new(random(&mut s), random(&mut s));
            let [a, b, c] = [0; 3].map(|_| random(&mut s));
            let radius = s.range(0.5, 3.0);
            let normal = b.normalize();
            let flat = (
                Quad::new(a, b, c),
                Disc {
                    center: a,
                    normal,
                    radius,
                },
            );
            let ball = Sphere { center: a, radius };
            let level = Plane { point: a, normal };
            for (exact, rounded) in [
                (quad(&flat.0, &ray), flat.0.nearest(&ray)),
                (disc(&flat.1, &ray), flat.1.nearest(&ray)),
                (sphere(&ball, &ray), ball.nearest(&ray)),
                (plane(&level, &ray), level.nearest(&ray)),
            ] {
                assert_eq!(nearest(&exact).is_some(), rounded.is_some(), "{index}");
                if let (Some(t), Some(crossing)) = (nearest(&exact), rounded) {
                    assert!((t - crossing.t).abs() < 1e-9 * (1.0 + t), "{index}");
                    hits += 1;
                }
                for time in exact {
                    let [low, high] = time.bracket;
                    assert!(low <= time.t && time.t <= high && high <= low.next_up());
                }
            }
        }
        assert!(hits > 1500, "{hits}");
    }

    #[test]
    fn a_sphere_touched_is_one_time_and_borders_belong_to_flat_shapes() {
        let ball = Sphere {
            center: DVec3::ZERO,
            radius: 1.5,
        };
        let ray = Ray::new(DVec3::new(1.5, -2.0, 0.0), DVec3::Y);
        let met = sphere(&ball, &ray);
        assert_eq!(
            (met.len(), met[0].bracket, met[0].multiplicity),
            (1, [2.0, 2.0], 2)
        );
        let off = Ray::new(DVec3::new(1.5_f64.next_up(), -2.0, 0.0), DVec3::Y);
        assert!(sphere(&ball, &off).is_empty());
        let tile = Quad::new(DVec3::ZERO, DVec3::X, DVec3::Z);
        let down = |x: f64| Ray::new(DVec3::new(x, 1.0, 0.5), -DVec3::Y);
        assert_eq!(quad(&tile, &down(1.0)).len(), 1);
        assert!(quad(&tile, &down(1.0_f64.next_up())).is_empty());
        assert!(quad(&tile, &down(0.5).until(1.0)).is_empty());
    }
}
