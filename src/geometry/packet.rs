//! Many rays against shapes that need no solver, each ray in a lane of the vector registers.

use super::ray::Ray;
use super::shape::Shape;
use crate::numeric::simd::{Kernel, Lanes, Vectors};
use glam::DVec3;

/// Rays of a packet: some full vector registers, few enough for the nearest cache.
pub const WIDTH: usize = 64;

/// One number for each ray.
type Column = [f64; WIDTH];

/// The object of a ray that has met none.
const NONE: u64 = u64::MAX;

/// Up to [`WIDTH`] rays, and the nearest crossing of each so far.
#[derive(Clone, Debug)]
pub struct Packet {
    origin: [Column; 3],
    direction: [Column; 3],
    t_min: Column,
    /// End of the range, or of what is left of it before the nearest crossing; −∞ for a ray that is not valid.
    t_max: Column,
    object: [u64; WIDTH],
    /// The object before the latest, where both are met at the same parameter.
    tied: [u64; WIDTH],
    vectors: Vectors,
}

impl Packet {
    /// A packet of rays. Which object a ray has `met` before, at the end of its range, is asked by the ray's number.
    ///
    /// # Panics
    /// If there are more than [`WIDTH`].
    pub fn new(rays: &[Ray], met: impl Fn(usize) -> Option<usize>) -> Self {
        let zero = [0.0; WIDTH];
        let mut packet = Self {
            origin: [zero; 3],
            direction: [zero; 3],
            t_min: zero,
            t_max: [f64::NEG_INFINITY; WIDTH],
            object: [NONE; WIDTH],
            tied: [NONE; WIDTH],
            vectors: Vectors::best(),
        };
        for (lane, ray) in rays.iter().enumerate() {
            for axis in 0..3 {
                packet.origin[axis][lane] = ray.origin[axis];
                packet.direction[axis][lane] = ray.direction[axis];
            }
            packet.t_min[lane] = ray.t_min;
            if ray.is_valid() {
                packet.t_max[lane] = ray.t_max;
            }
            if let Some(object) = met(lane) {
                packet.object[lane] = object as u64;
            }
        }
        packet
    }

    /// Looks for nearer crossings with a shape, which `object` stands for: to the bit those of [`Shape::nearest`]. Where another object is
    /// met at the same parameter that one stays.
    ///
    /// # Panics
    /// If the shape is a surface of revolution: these take their rays by themselves.
    pub fn meet(&mut self, shape: &Shape, object: usize) {
        self.look(shape, object, false);
    }

    /// As [`Self::meet`], but where another object is met at the same parameter, `wins` decides: of the number of the ray, that object and
    /// the parameter.
    pub fn meet_or_tie(
        &mut self,
        shape: &Shape,
        object: usize,
        wins: impl Fn(usize, usize, f64) -> bool,
    ) {
        self.look(shape, object, true);
        for lane in 0..WIDTH {
            let other = self.tied[lane];
            if other != NONE && !wins(lane, other as usize, self.t_max[lane]) {
                self.object[lane] = other;
            }
        }
    }

    fn look(&mut self, shape: &Shape, object: usize, ties: bool) {
        self.vectors.run(Meet {
            shape,
            object: object as u64,
            ties,
            packet: self,
        });
    }

    /// Object and parameter of the nearest crossing of a ray, of those met before included.
    pub fn nearest(&self, lane: usize) -> Option<(usize, f64)> {
        (self.object[lane] != NONE).then(|| (self.object[lane] as usize, self.t_max[lane]))
    }

    /// Keeps what is nearer, or as near where that `ties`: parameter, and whether it counts but for the range.
    #[inline(always)]
    fn keep(&mut self, object: u64, ties: bool, meet: impl Fn(&Ray) -> (f64, bool)) {
        for lane in 0..WIDTH {
            let vector = |c: &[Column; 3]| DVec3::new(c[0][lane], c[1][lane], c[2][lane]);
            let (so_far, before) = (self.t_max[lane], self.object[lane]);
            // Bitwise here and below: a branch would keep the lanes apart.
            let ties = ties & (before != NONE);
            let ray = Ray {
                origin: vector(&self.origin),
                direction: vector(&self.direction),
                t_min: self.t_min[lane],
                t_max: if ties { so_far.next_up() } else { so_far },
            };
            let (t, counts) = meet(&ray);
            let met = counts & (ray.t_min < t) & (t < ray.t_max);
            self.tied[lane] = if met & (t == so_far) { before } else { NONE };
            self.t_max[lane] = if met { t } else { so_far };
            self.object[lane] = if met { object } else { before };
        }
    }
}

struct Meet<'a> {
    shape: &'a Shape,
    object: u64,
    ties: bool,
    packet: &'a mut Packet,
}

impl Kernel for Meet<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self {
            shape,
            object,
            ties,
            packet,
        } = self;
        match shape {
            Shape::Quad(quad) => packet.keep(object, ties, |ray| quad.meet(ray)),
            Shape::Plane(plane) => packet.keep(object, ties, |ray| plane.meet(ray)),
            Shape::Disc(disc) => packet.keep(object, ties, |ray| disc.meet(ray)),
            Shape::Sphere(sphere) => {
                // The near root counts before the far one, as it does for a ray alone.
                packet.keep(object, ties, |ray| {
                    let (near, far, met) = sphere.meet(ray);
                    (if ray.contains(near) { near } else { far }, met)
                });
            }
            Shape::Revolution(_) => {
                unreachable!("surfaces of revolution take their rays by themselves")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::hit::Crossing;
    use crate::geometry::planar::{Disc, Plane, Quad};
    use crate::geometry::revolution::Solver;
    use crate::geometry::sphere::Sphere;
    use crate::numeric::rng::{Purpose, Stream};
    use crate::numeric::work::Work;

    fn shapes() -> Vec<Shape> {
        let center = DVec3::new(0.2, -0.1, 0.3);
        vec![
            Shape::Sphere(Sphere {
                center,
                radius: 0.8,
            }),
            Shape::Quad(Quad::new(
                DVec3::new(-1.0, -0.5, -1.0),
                DVec3::new(2.0, 0.1, 0.0),
                DVec3::new(0.3, 0.0, 2.0),
            )),
            Shape::Plane(Plane {
                point: -DVec3::Y,
                normal: DVec3::Y,
            }),
            Shape::Disc(Disc {
                center,
                normal: DVec3::new(0.6, 0.8, 0.0),
                radius: 0.9,
            }),
            // The same again: of crossings at the same parameter the first object's counts, unless this one wins ties.
            Shape::Plane(Plane {
                point: -DVec3::Y,
                normal: DVec3::Y,
            }),
        ]
    }

    /// Rays from inside, outside and on the surfaces, along axes and edges, with ranges of all kinds, and some that are none.
    fn rays() -> Vec<Ray> {
        let mut stream = Stream::new(8, Purpose::Test, 0);
        let mut random = |size: f64| DVec3::from_array([0; 3].map(|_| stream.range(-size, size)));
        let mut rays: Vec<Ray> = (0..4000)
            .map(|_| Ray::new(random(2.0), random(1.0)))
            .collect();
        for (number, ray) in rays.iter_mut().enumerate() {
            match number % 11 {
                0 => ray.t_max = 1.0,
                1 => ray.t_min = -3.0,
                2 => ray.direction *= 1e-200,
                3 => ray.direction.y = 0.0,
                4 => ray.origin = DVec3::new(0.2, 0.7, 0.3),
                5 => ray.direction = DVec3::NEG_Y,
                _ => {}
            }
        }
        let bad = Ray::new(DVec3::ZERO, DVec3::Y);
        rays.extend([
            Ray::new(DVec3::NAN, DVec3::Y),
            Ray::new(DVec3::ZERO, DVec3::ZERO),
            Ray::new(DVec3::ZERO, DVec3::INFINITY),
            bad.until(-1.0),
            bad.until(f64::NAN),
        ]);
        rays
    }

    /// Ties are won by `winner`, but not against `loser`.
    fn alone(shapes: &[Shape], [winner, loser]: [usize; 2], ray: &Ray) -> Option<(usize, u64)> {
        let (mut rest, mut nearest) = (*ray, None);
        for (object, shape) in shapes.iter().enumerate() {
            let wins = nearest.is_some_and(|(before, _)| before != loser) && object == winner;
            let range = if wins {
                rest.until(rest.t_max.next_up())
            } else {
                rest
            };
            let found = shape.nearest(&range, &Solver::Bernstein, &mut Work::default());
            if let Some(Crossing { t, .. }) = found {
                rest.t_max = t;
                nearest = Some((object, t.to_bits()));
            }
        }
        nearest
    }

    #[test]
    fn rays_in_lanes_meet_what_they_meet_alone_to_the_bit() {
        let shapes = shapes();
        let (mut met, mut won) = (0, 0);
        let winners = [[9, 9], [2, 9], [4, 9], [4, 2]];
        let each = |vectors| winners.map(|winner| (vectors, winner));
        for (vectors, winner) in Vectors::all().flat_map(each) {
            // A last packet that is not full.
            for rays in rays().chunks(WIDTH) {
                let mut packet = Packet {
                    vectors,
                    ..Packet::new(rays, |_| None)
                };
                for (object, shape) in shapes.iter().enumerate() {
                    if object == winner[0] {
                        packet.meet_or_tie(shape, object, |_, before, _| before != winner[1]);
                    } else {
                        packet.meet(shape, object);
                    }
                }
                for (lane, ray) in rays.iter().enumerate() {
                    let found = packet
                        .nearest(lane)
                        .map(|(object, t)| (object, t.to_bits()));
                    assert_eq!(found, alone(&shapes, winner, ray), "{vectors}: {ray:?}");
                    met += u32::from(found.is_some());
                    won += u32::from(found.is_some_and(|(object, _)| object == 4));
                }
                assert!((rays.len()..WIDTH).all(|lane| packet.nearest(lane).is_none()));
            }
        }
        assert!(met > 2000 && won > 200, "{met} {won}");
    }
}
