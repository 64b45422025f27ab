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
    vectors: Vectors,
}

impl Packet {
    /// A packet of rays.
    ///
    /// # Panics
    /// If there are more than [`WIDTH`].
    pub fn new(rays: &[Ray]) -> Self {
        let zero = [0.0; WIDTH];
        let mut packet = Self {
            origin: [zero; 3],
            direction: [zero; 3],
            t_min: zero,
            t_max: [f64::NEG_INFINITY; WIDTH],
            object: [NONE; WIDTH],
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
        }
        packet
    }

    /// Looks for nearer crossings with a shape, which `object` stands for: to the bit those of [`Shape::nearest`].
    ///
    /// # Panics
    /// If the shape is a surface of revolution: these take their rays by themselves.
    pub fn meet(&mut self, shape: &Shape, object: usize) {
        self.vectors.run(Meet {
            shape,
            object: object as u64,
            packet: self,
        });
    }

    /// Object and parameter of the nearest crossing of a ray.
    pub fn nearest(&self, lane: usize) -> Option<(usize, f64)> {
        (self.object[lane] != NONE).then(|| (self.object[lane] as usize, self.t_max[lane]))
    }

    /// Keeps what is nearer: parameter, and whether it counts but for the range.
    #[inline(always)]
    fn keep(&mut self, object: u64, meet: impl Fn(&Ray) -> (f64, bool)) {
        for lane in 0..WIDTH {
            let vector = |c: &[Column; 3]| DVec3::new(c[0][lane], c[1][lane], c[2][lane]);
            let ray = Ray {
                origin: vector(&self.origin),
                direction: vector(&self.direction),
                t_min: self.t_min[lane],
                t_max: self.t_max[lane],
            };
            let (t, counts) = meet(&ray);
            // Bitwise: a branch would keep the lanes apart.
            let met = counts & (ray.t_min < t) & (t < ray.t_max);
            self.t_max[lane] = if met { t } else { ray.t_max };
            self.object[lane] = if met { object } else { self.object[lane] };
        }
    }
}

struct Meet<'a> {
    shape: &'a Shape,
    object: u64,
    packet: &'a mut Packet,
}

impl Kernel for Meet<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self {
            shape,
            object,
            packet,
        } = self;
        match shape {
            Shape::Quad(quad) => packet.keep(object, |ray| quad.meet(ray)),
            Shape::Plane(plane) => packet.keep(object, |ray| plane.meet(ray)),
            Shape::Disc(disc) => packet.keep(object, |ray| disc.meet(ray)),
            Shape::Sphere(sphere) => {
                // The near root counts before the far one, as it does for a ray alone.
                packet.keep(object, |ray| {
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
