//! A leaf of the tree: sixteen balls and the packets that came down to it.

use super::boxes::WIDTH;
use super::{Join, restore};
use crate::numeric::simd::{Kernel, Lanes};
use crate::numeric::work::Work;
use std::ops::Range;

/// Pairs of packets and balls of a leaf from which on they are tested before more are listed.
const MANY: usize = 1 << 12;

/// Memory of a leaf.
#[derive(Default)]
pub(super) struct Scratch {
    /// Of sixteen packets of the leaf's list, those that meet the box of each ball.
    met: Vec<[u32; WIDTH]>,
    /// Packets, by their place in the leaf's list, and balls whose boxes meet: place × 16 + ball.
    pairs: Vec<u32>,
    hits: Vec<u32>,
}

/// Gathers at the balls of a leaf.
pub(super) struct Leaf<'a, T, G> {
    pub(super) join: &'a Join<'a, G>,
    pub(super) node: usize,
    pub(super) packets: &'a [u32],
    pub(super) out: &'a mut [T],
    pub(super) scratch: &'a mut Scratch,
}

impl<T, G> Kernel for Leaf<'_, T, G>
where
    T: Copy + Default + Send + Sync,
    G: Fn(usize, &[u32], &mut T) + Sync,
{
    type Output = Work;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> Work {
        let mut work = Work {
            index_visits: self.packets.len() as u64,
            ..Work::default()
        };
        self.meet(lanes);
        let mut first = 0;
        while first < self.out.len() {
            let (next, pairs) = self.list(first, lanes);
            work.index_tests += (pairs * WIDTH) as u64;
            let ends = self.test(pairs, lanes);
            self.hand_over(first..next, &ends);
            first = next;
        }
        work
    }
}

// In steps, each a loop without branches that depend on the data: their mispredictions would cost more than the work.
impl<T, G> Leaf<'_, T, G>
where
    T: Copy + Default + Send + Sync,
    G: Fn(usize, &[u32], &mut T) + Sync,
{
    /// Asks the box of each packet for the balls whose boxes it meets.
    #[inline(always)]
    fn meet<L: Lanes>(&mut self, lanes: L) {
        let Join { tree, queries, .. } = self.join;
        let boxes = &tree.levels[0][self.node];
        self.scratch.met.clear();
        for packets in self.packets.chunks(WIDTH) {
            let mut met = [0; WIDTH];
            for (i, &packet) in packets.iter().enumerate() {
                let balls = boxes.overlaps(&queries.bounds[packet as usize], lanes);
                for (ball, met) in met.iter_mut().enumerate() {
                    *met |= (balls >> ball & 1) << i;
                }
            }
            self.scratch.met.push(met);
        }
    }

    /// Lists the pairs of balls from `first` on, ball by ball, until they are many. Returns the first ball left, and how many pairs.
    #[inline(always)]
    fn list<L: Lanes>(&mut self, first: usize, lanes: L) -> (usize, usize) {
        let Scratch { met, pairs, .. } = &mut *self.scratch;
        let (mut ball, mut count) = (first, 0);
        while ball < self.out.len() && count < MANY {
            grow(pairs, count + (met.len() + 1) * WIDTH);
            for (sixteen, met) in met.iter().enumerate() {
                if let Some(out) = pairs[count..].first_chunk_mut::<WIDTH>() {
                    lanes.places(met[ball], (sixteen * WIDTH) as u32, out);
                    for pair in out {
                        *pair = *pair << 4 | ball as u32;
                    }
                }
                count += met[ball].count_ones() as usize;
            }
            ball += 1;
        }
        (ball, count)
    }

    /// Writes the places of the queries that the balls of the first pairs cover, one after the other. Returns where those of each
    /// ball end.
    #[inline(always)]
    fn test<L: Lanes>(&mut self, pairs: usize, lanes: L) -> [usize; WIDTH] {
        let Join { tree, queries, .. } = self.join;
        let rough = &tree.rough[self.node];
        let Scratch {
            pairs: all, hits, ..
        } = &mut *self.scratch;
        grow(hits, (pairs + 1) * WIDTH);
        let hits = &mut hits[..];
        let hits = &mut hits[..];
        let mut ends = [0; WIDTH];
        let mut count = 0;
        for &pair in &all[..pairs] {
            let ball = pair as usize % WIDTH;
            let packet = self.packets[pair as usize / WIDTH] as usize;
            let exact = || {
                let place = self.node * WIDTH + ball;
                (tree.centers[place], tree.radii_squared[place])
            };
            if let Some(out) = hits[count..].first_chunk_mut() {
                count += queries.covered(packet, (rough, ball), exact, out, lanes);
            }
            ends[ball] = count;
        }
        ends
    }

    /// Gathers at some balls.
    #[inline(always)]
    fn hand_over(&mut self, balls: Range<usize>, ends: &[usize; WIDTH]) {
        let Join {
            tree,
            queries,
            gather,
        } = self.join;
        let mut start = 0;
        for ball in balls {
            // That of a ball without pairs is 0.
            let end = ends[ball].max(start);
            if end > start {
                let hits = &mut self.scratch.hits[start..end];
                restore(queries.order.as_deref(), hits);
                let number = tree.order[self.node * WIDTH + ball] as usize;
                gather(number, hits, &mut self.out[ball]);
            }
            start = end;
        }
    }
}

/// Makes room for so many.
#[inline(always)]
fn grow(list: &mut Vec<u32>, most: usize) {
    if list.len() < most {
        list.resize(most, 0);
    }
}
