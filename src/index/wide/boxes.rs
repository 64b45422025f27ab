//! Boxes by sixteens, in f32 rounded outward, and packets of sixteen queries.

use super::rough::Rough;
use crate::index::{covers, curve};
use crate::numeric::simd::Lanes;
use glam::DVec3;
use rayon::prelude::*;

/// Boxes of a node, queries of a packet.
pub(super) const WIDTH: usize = 16;

/// Packets that are looked at to tell whether queries come along a curve.
const SAMPLES: usize = 256;

/// A box that contains what it was made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) least: [f32; 3],
    pub(super) most: [f32; 3],
}

/// Sixteen boxes, a coordinate at a time. A box of NaN is empty.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Boxes {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
}

/// Sixteen queries, a coordinate at a time, from the origin of their packets and to within rounding. Places without a query hold
/// NaN, which no ball covers.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Packet(pub(super) [[f32; WIDTH]; 3]);

/// The largest f32 that is at most `x`.
fn below(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x {
        near.next_down()
    } else {
        near
    }
}

/// The least f32 that is at least `x`.
fn above(x: f64) -> f32 {
    -below(-x)
}

impl Bounds {
    /// Around the box from `least` to `most`, rounded outward.
    pub(super) fn around(least: DVec3, most: DVec3) -> Self {
        Self {
            least: least.to_array().map(below),
            most: most.to_array().map(above),
        }
    }
}

impl Boxes {
    /// Sixteen empty boxes.
    pub(super) const EMPTY: Self = Self {
        low: [[f32::NAN; WIDTH]; 3],
        high: [[f32::NAN; WIDTH]; 3],
    };

    pub(super) fn set(&mut self, place: usize, bounds: &Bounds) {
        for axis in 0..3 {
            self.low[axis][place] = bounds.least[axis];
            self.high[axis][place] = bounds.most[axis];
        }
    }

    /// The box around all that are not empty.
    pub(super) fn union(&self) -> Bounds {
        // `min` and `max` pass over NaN.
        Bounds {
            least: self.low.map(|low| low.into_iter().fold(f32::NAN, f32::min)),
            most: self
                .high
                .map(|high| high.into_iter().fold(f32::NAN, f32::max)),
        }
    }

    /// Which of them meet the other box.
    #[inline(always)]
    pub(super) fn overlaps<L: Lanes>(&self, other: &Bounds, lanes: L) -> u32 {
        lanes.overlaps(&self.low, &self.high, other.least, other.most)
    }
}

impl Packet {
    /// Up to sixteen queries, and a box around them.
    fn of(queries: impl Iterator<Item = DVec3>, origin: DVec3) -> (Self, Bounds) {
        let mut packet = Self([[f32::NAN; WIDTH]; 3]);
        // A query with a NaN, which no ball covers, leaves a box that holds the others.
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (place, query) in queries.take(WIDTH).enumerate() {
            let from_origin = query - origin;
            for axis in 0..3 {
                packet.0[axis][place] = from_origin[axis] as f32;
            }
            least = least.min(query);
            most = most.max(query);
        }
        (packet, Bounds::around(least, most))
    }
}

/// The queries of a join in packets of sixteen.
pub(super) struct Packets<'a> {
    queries: &'a [DVec3],
    /// Query of each place in packets, if the queries did not come along a curve.
    pub(super) order: Option<Vec<u32>>,
    packets: Vec<Packet>,
    pub(super) bounds: Vec<Bounds>,
}

impl<'a> Packets<'a> {
    /// Of all queries, seen from an origin; those that do not come along a curve are put so.
    pub(super) fn compact(queries: &'a [DVec3], origin: DVec3) -> Self {
        let packets = Self::new(queries, None, origin);
        if packets.are_compact() {
            return packets;
        }
        drop(packets);
        Self::new(queries, Some(curve::order(queries)), origin)
    }

    fn new(queries: &'a [DVec3], order: Option<Vec<u32>>, origin: DVec3) -> Self {
        let blank = Bounds {
            least: [f32::NAN; 3],
            most: [f32::NAN; 3],
        };
        let count = queries.len();
        let mut bounds = vec![blank; count.div_ceil(WIDTH)];
        let packets = bounds
            .par_iter_mut()
            .with_min_len(256)
            .enumerate()
            .map(|(packet, bounds)| {
                let places = packet * WIDTH..count.min((packet + 1) * WIDTH);
                let (packet, around) = match &order {
                    None => Packet::of(queries[places].iter().copied(), origin),
                    Some(order) => {
                        let queries = order[places].iter().map(|&query| queries[query as usize]);
                        Packet::of(queries, origin)
                    }
                };
                *bounds = around;
                packet
            })
            .collect();
        Self {
            queries,
            order,
            packets,
            bounds,
        }
    }

    /// Writes the places of the queries of a packet that a ball, `i` of `rough`, covers to the front of `out`, and returns how many.
    #[inline(always)]
    pub(super) fn covered<L: Lanes>(
        &self,
        packet: usize,
        (rough, i): (&Rough, usize),
        exact: impl Fn() -> (DVec3, f64),
        out: &mut [u32; WIDTH],
        lanes: L,
    ) -> usize {
        let first = (packet * WIDTH) as u32;
        match rough.covered(i, &self.packets[packet], first, out, lanes) {
            Some(count) => count,
            None => self.covered_exactly(packet, exact(), out),
        }
    }

    /// The same by the predicate of all indices.
    #[cold]
    #[inline(never)]
    fn covered_exactly(
        &self,
        packet: usize,
        (center, radius_squared): (DVec3, f64),
        out: &mut [u32; WIDTH],
    ) -> usize {
        let mut count = 0;
        for place in packet * WIDTH..self.queries.len().min((packet + 1) * WIDTH) {
            let query = match &self.order {
                None => place,
                Some(order) => order[place] as usize,
            };
            if covers(center, radius_squared, self.queries[query]) {
                out[count] = place as u32;
                count += 1;
            }
        }
        count
    }

    /// Bytes that they hold.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.packets)
            + size_of_val(&*self.bounds)
            + self.order.as_deref().map_or(0, size_of_val)
    }

    /// Whether packets are mostly small: the median size of some is at most a quarter of the median distance between them. For
    /// queries in random order both are about the same.
    fn are_compact(&self) -> bool {
        let some: Vec<&Bounds> = (0..SAMPLES)
            .filter_map(|i| self.bounds.get(i * self.bounds.len() / SAMPLES))
            .collect();
        let next = some.iter().cycle().skip(some.len() / 2);
        let apart = some
            .iter()
            .zip(next)
            .map(|(a, b)| distance(a.least, b.least));
        let size = some
            .iter()
            .map(|bounds| distance(bounds.least, bounds.most));
        4.0 * median(size.collect()) <= median(apart.collect())
    }
}

/// Largest difference of coordinates.
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let axes = a.into_iter().zip(b).map(|(a, b)| (a - b).abs());
    axes.fold(0.0, f32::max)
}

/// The upper median; 0 of none.
fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Boxes of `count` items by sixteens, of these by sixteens, and so on to the root. Empty without items.
pub(super) fn levels(count: usize, bounds: impl Fn(usize) -> Bounds + Sync) -> Vec<Vec<Boxes>> {
    let mut levels = Vec::new();
    if count > 0 {
        levels.push(by_sixteens(count, bounds));
    }
    while let Some(below) = levels.last().filter(|level: &&Vec<Boxes>| level.len() > 1) {
        let above = by_sixteens(below.len(), |node| below[node].union());
        levels.push(above);
    }
    levels
}

/// Bytes of some levels.
pub(super) fn bytes(levels: &[Vec<Boxes>]) -> usize {
    levels.iter().map(|level| size_of_val(&**level)).sum()
}

/// Nodes over `count` boxes.
fn by_sixteens(count: usize, bounds: impl Fn(usize) -> Bounds + Sync) -> Vec<Boxes> {
    (0..count.div_ceil(WIDTH))
        .into_par_iter()
        .with_min_len(256)
        .map(|node| {
            let mut boxes = Boxes::EMPTY;
            for (slot, child) in (node * WIDTH..count.min((node + 1) * WIDTH)).enumerate() {
                boxes.set(slot, &bounds(child));
            }
            boxes
        })
        .collect()
}
