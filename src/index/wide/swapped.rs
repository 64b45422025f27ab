//! The wide tree the other way round: over the queries, asked by each ball. Nothing is built before a join, so it pays where balls
//! move between joins or are few.

use super::boxes::{Bounds, Boxes, Packets, WIDTH, bytes, levels};
use super::rough::Rough;
use super::{middle, restore};
use crate::index::{Answers, BallIndex, Balls, IndexError, ball_box, scan, sum};
use crate::numeric::simd::{Kernel, Lanes, Vectors};
use crate::numeric::work::Work;
use glam::DVec3;
use rayon::prelude::*;

/// Balls of one task: a multiple of sixteen.
const CHUNK: usize = 256;

/// Balls that ask.
#[derive(Clone, Debug)]
pub struct Swapped {
    balls: Balls,
    vectors: Vectors,
}

/// A tree over queries.
struct QueryTree<'a> {
    packets: Packets<'a>,
    /// Boxes of the packets by sixteens, and so on to the root.
    levels: Vec<Vec<Boxes>>,
}

impl Swapped {
    /// Takes the balls.
    pub fn new(balls: Balls) -> Self {
        Self::with(balls, Vectors::best())
    }

    /// The same with a choice of vector instructions, which changes the speed and nothing else.
    pub fn with(balls: Balls, vectors: Vectors) -> Self {
        Self { balls, vectors }
    }

    /// Bytes that a join with these queries holds for them.
    pub fn bytes(queries: &[DVec3]) -> usize {
        QueryTree::new(queries, DVec3::ZERO).bytes()
    }

    /// Gives the balls new squared radii.
    ///
    /// # Errors
    /// As [`Balls::new`].
    pub fn set_radii_squared(&mut self, radii_squared: &[f64]) -> Result<(), IndexError> {
        self.balls.set_radii_squared(radii_squared)
    }
}

impl<'a> QueryTree<'a> {
    fn new(queries: &'a [DVec3], origin: DVec3) -> Self {
        let packets = Packets::compact(queries, origin);
        Self {
            levels: levels(packets.bounds.len(), |packet| packets.bounds[packet]),
            packets,
        }
    }

    fn bytes(&self) -> usize {
        bytes(&self.levels) + self.packets.bytes()
    }
}

impl BallIndex for Swapped {
    /// A scan of all balls: there is no structure over them.
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
        scan(&self.balls, query, work, found);
    }

    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T> {
        Answers::blank(self.balls.len())
    }

    /// As [`super::WideTree`] in cost, without a build, if balls come in an order in which neighbours are near each other.
    fn join_onto<T, G>(
        &self,
        answers: &mut Answers<'_, T>,
        queries: &[DVec3],
        gather: &G,
        work: &mut Work,
    ) where
        T: Copy + Default + Send + Sync,
        G: Fn(usize, &[u32], &mut T) + Sync,
    {
        let origin = middle(self.balls.centers());
        let tree = QueryTree::new(queries, origin);
        let answers = &mut answers.values[..self.balls.len()];
        let chunks = answers.par_chunks_mut(CHUNK).enumerate();
        let works = chunks.map_init(Vec::new, |hits, (chunk, out)| {
            self.vectors.run(Ask {
                tree: &tree,
                balls: &self.balls,
                first: chunk * CHUNK,
                origin,
                out,
                gather,
                hits,
            })
        });
        *work += works.reduce(Work::default, sum);
    }
}

/// Gathers at some balls.
struct Ask<'a, T, G> {
    tree: &'a QueryTree<'a>,
    balls: &'a Balls,
    first: usize,
    origin: DVec3,
    out: &'a mut [T],
    gather: &'a G,
    hits: &'a mut Vec<u32>,
}

impl<T, G> Kernel for Ask<'_, T, G>
where
    G: Fn(usize, &[u32], &mut T),
{
    type Output = Work;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Work {
        let mut work = Work::default();
        let packets = &self.tree.packets;
        let mut open = Vec::new();
        let mut rough = Rough::of(&[], &[], self.origin);
        for (item, answer) in (self.first..).zip(self.out) {
            let Balls {
                centers,
                radii_squared,
            } = self.balls;
            if item % WIDTH == 0 {
                let sixteen = item..centers.len().min(item + WIDTH);
                let radii_squared = &radii_squared[sixteen.clone()];
                rough = Rough::of(&centers[sixteen], radii_squared, self.origin);
            }
            let (center, radius_squared) = (centers[item], radii_squared[item]);
            let (least, most) = ball_box(center, radius_squared);
            let bounds = Bounds::around(least, most);
            let top = self.tree.levels.len();
            open.clear();
            open.extend((top > 0).then(|| (top - 1, 0)));
            let mut count = 0;
            while let Some((level, node)) = open.pop() {
                work.index_visits += 1;
                let mut met = self.tree.levels[level][node].overlaps(&bounds, lanes);
                if level > 0 {
                    // The last first: they come off in order.
                    while met != 0 {
                        let last = met.ilog2();
                        met ^= 1 << last;
                        open.push((level - 1, node * WIDTH + last as usize));
                    }
                    continue;
                }
                while met != 0 {
                    let packet = node * WIDTH + met.trailing_zeros() as usize;
                    met &= met - 1;
                    work.index_tests += WIDTH as u64;
                    if self.hits.len() < count + WIDTH {
                        self.hits.resize(2 * (count + WIDTH), 0);
                    }
                    if let Some(out) = self.hits[count..].first_chunk_mut() {
                        let exact = || (center, radius_squared);
                        count += packets.covered(packet, (&rough, item), exact, out, lanes);
                    }
                }
            }
            if count > 0 {
                let hits = &mut self.hits[..count];
                restore(packets.order.as_deref(), hits);
                (self.gather)(item, hits, answer);
            }
        }
        work
    }
}
