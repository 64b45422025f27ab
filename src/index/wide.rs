//! A tree of sixteen-wide nodes over balls, asked by packets of sixteen neighbouring queries.
//!
//! Balls stand in runs of sixteen (leaves), those in runs of sixteen (nodes), and so on up to one root; no node is stored but the
//! boxes of what is below it, in f32 rounded outward, each ball's inflated by its own radius. Queries are taken along a Hilbert
//! curve, sixteen at a time with a box around them. A join hands packets down from the root to the children that their boxes
//! meet; at a leaf, packets that meet a ball's box are tested against the ball in f32 with bounds of its rounding, and where that
//! leaves a doubt in f64, by the predicate of all indices. So boxes and f32 decide about speed only. Packets of rays go back to
//! Wald et al. (2001), wide trees to Ernst and Greiner (2008).

mod boxes;
mod build;
mod leaf;
mod rough;
pub mod swapped;

use super::{Answers, BallIndex, Balls, IndexError, ball_box, check_radii, covers, sum};
use crate::numeric::simd::{Kernel, Lanes, Vectors};
use crate::numeric::work::Work;
use boxes::{Bounds, Boxes, Packets, WIDTH};
use glam::DVec3;
use leaf::Leaf;
use rayon::prelude::*;
use rough::Rough;

/// From this level on, children are worth tasks of their own: 256 balls each.
const PARALLEL: usize = 2;
/// Items that one thread copies at least.
const LEAST: usize = 1 << 12;

/// The tree. Building and asking it are deterministic; neither depends on the number of threads or the vector instructions.
#[derive(Clone, Debug)]
pub struct WideTree {
    /// Boxes of the balls of each leaf, of the leaves of each node above, and so on to the root. Empty without balls.
    levels: Vec<Vec<Boxes>>,
    /// The balls of each leaf, from [`middle`].
    rough: Vec<Rough>,
    /// Centres and squared radii in tree order.
    centers: Vec<DVec3>,
    radii_squared: Vec<f64>,
    /// Ball of each place in tree order, and place of each ball.
    order: Vec<u32>,
    places: Vec<u32>,
    vectors: Vectors,
}

/// Packets for each of sixteen children.
type Lists = [Vec<u32>; WIDTH];

/// Memory that is used again from node to node.
#[derive(Default)]
struct Scratch {
    /// Lists for the children of a node, from level 1 on.
    lists: [Lists; PARALLEL - 1],
    leaf: leaf::Scratch,
}

/// A join under way.
struct Join<'a, G> {
    tree: &'a WideTree,
    queries: Packets<'a>,
    gather: &'a G,
}

impl WideTree {
    /// Builds the tree in O(n log n).
    pub fn new(balls: &Balls) -> Self {
        Self::with(balls, Vectors::best())
    }

    /// The same with a choice of vector instructions, which changes the speed and nothing else.
    pub fn with(balls: &Balls, vectors: Vectors) -> Self {
        let order = build::order(&balls.centers);
        let in_order = || {
            order
                .par_iter()
                .with_min_len(LEAST)
                .map(|&item| item as usize)
        };
        let mut places = vec![0; order.len()];
        for (place, &item) in (0..).zip(&order) {
            places[item as usize] = place;
        }
        let mut tree = Self {
            levels: Vec::new(),
            rough: Vec::new(),
            centers: in_order().map(|item| balls.centers[item]).collect(),
            radii_squared: in_order().map(|item| balls.radii_squared[item]).collect(),
            order,
            places,
            vectors,
        };
        tree.fit();
        tree
    }

    /// Gives the balls new squared radii (in the order of the balls) and refits the boxes: much cheaper than a new tree.
    ///
    /// # Errors
    /// As [`Balls::new`].
    pub fn set_radii_squared(&mut self, radii_squared: &[f64]) -> Result<(), IndexError> {
        check_radii(self.order.len(), radii_squared)?;
        for (radius, &item) in self.radii_squared.iter_mut().zip(&self.order) {
            *radius = radii_squared[item as usize];
        }
        self.fit();
        Ok(())
    }

    /// Bytes that the tree holds.
    pub fn bytes(&self) -> usize {
        boxes::bytes(&self.levels)
            + size_of_val(&*self.rough)
            + size_of_val(&*self.centers)
            + size_of_val(&*self.radii_squared)
            + size_of_val(&*self.order)
            + size_of_val(&*self.places)
    }

    /// What depends on the radii.
    fn fit(&mut self) {
        let ball = |place: usize| {
            let (least, most) = ball_box(self.centers[place], self.radii_squared[place]);
            Bounds::around(least, most)
        };
        self.levels = boxes::levels(self.order.len(), ball);
        let origin = middle(&self.centers);
        let leaves = self.centers.par_chunks(WIDTH);
        let leaves = leaves.zip(self.radii_squared.par_chunks(WIDTH));
        self.rough = leaves
            .with_min_len(LEAST / WIDTH)
            .map(|(centers, radii_squared)| Rough::of(centers, radii_squared, origin))
            .collect();
    }
}

impl BallIndex for WideTree {
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
        let bounds = Bounds::around(query, query);
        let top = self.levels.len();
        let mut open = if top > 0 { vec![(top - 1, 0)] } else { vec![] };
        while let Some((level, node)) = open.pop() {
            work.index_visits += 1;
            let mut met = self.vectors.run(Meet(&self.levels[level][node], &bounds));
            while met != 0 {
                let child = node * WIDTH + met.trailing_zeros() as usize;
                met &= met - 1;
                if level > 0 {
                    open.push((level - 1, child));
                    continue;
                }
                work.index_tests += 1;
                if covers(self.centers[child], self.radii_squared[child], query) {
                    found(self.order[child] as usize);
                }
            }
        }
    }

    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T> {
        let all = self.order.par_iter().with_min_len(LEAST);
        Answers {
            values: all.map(|_| T::default()).collect(),
            places: Some(&self.places),
        }
    }

    /// About 2 ns a result where a query has 20 and queries come along a curve ([`order`](crate::index::curve::order), 1.6 ns a result
    /// more); if they do not, they are sorted here and every list is sorted back: about 15. Memory: 14 bytes a query, and the answers.
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
        let join = Join {
            tree: self,
            queries: Packets::compact(queries, middle(&self.centers)),
            gather,
        };
        let in_tree_order = &mut answers.values[..self.order.len()];
        if let Some(top) = self.levels.len().checked_sub(1) {
            let packets: Vec<u32> = (0..join.queries.bounds.len() as u32).collect();
            let scratch = &mut Scratch::default();
            *work += join.descend(top, 0, &packets, in_tree_order, scratch);
        }
    }
}

impl<G> Join<'_, G> {
    /// Hands packets down to a node's children. `out` has the places of the balls below the node.
    fn descend<T>(
        &self,
        level: usize,
        node: usize,
        packets: &[u32],
        out: &mut [T],
        scratch: &mut Scratch,
    ) -> Work
    where
        T: Copy + Default + Send + Sync,
        G: Fn(usize, &[u32], &mut T) + Sync,
    {
        if packets.is_empty() {
            return Work::default();
        }
        if level == 0 {
            return self.tree.vectors.run(Leaf {
                join: self,
                node,
                packets,
                out,
                scratch: &mut scratch.leaf,
            });
        }
        let mut work = Work {
            index_visits: packets.len() as u64,
            ..Work::default()
        };
        let mut lists = match scratch.lists.get_mut(level - 1) {
            Some(lists) => std::mem::take(lists),
            None => Lists::default(),
        };
        self.tree.vectors.run(Spread {
            boxes: &self.tree.levels[level][node],
            bounds: &self.queries.bounds,
            packets,
            lists: &mut lists,
        });
        let below = WIDTH.pow(level as u32);
        let children = lists.par_iter().zip(out.par_chunks_mut(below)).enumerate();
        if level >= PARALLEL {
            let works = children.map_init(Scratch::default, |scratch, (child, (packets, out))| {
                self.descend(level - 1, node * WIDTH + child, packets, out, scratch)
            });
            work += works.reduce(Work::default, sum);
        } else {
            for (child, (packets, out)) in lists.iter().zip(out.chunks_mut(below)).enumerate() {
                work += self.descend(level - 1, node * WIDTH + child, packets, out, scratch);
            }
            scratch.lists[level - 1] = lists;
        }
        work
    }
}

/// Which boxes of a node meet a box.
struct Meet<'a>(&'a Boxes, &'a Bounds);

impl Kernel for Meet<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> u32 {
        self.0.overlaps(self.1, lanes)
    }
}

/// Lists for each box of a node the packets that meet it.
struct Spread<'a> {
    boxes: &'a Boxes,
    bounds: &'a [Bounds],
    packets: &'a [u32],
    lists: &'a mut Lists,
}

impl Kernel for Spread<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        self.lists.iter_mut().for_each(Vec::clear);
        for &packet in self.packets {
            let mut met = self.boxes.overlaps(&self.bounds[packet as usize], lanes);
            while met != 0 {
                self.lists[met.trailing_zeros() as usize & (WIDTH - 1)].push(packet);
                met &= met - 1;
            }
        }
    }
}

/// The centre in the middle of a list: with a scene far from the origin of coordinates, an origin within it.
fn middle(centers: &[DVec3]) -> DVec3 {
    centers.get(centers.len() / 2).copied().unwrap_or_default()
}

/// Turns places into queries in rising order, if the queries were put in another order.
#[inline(always)]
fn restore(order: Option<&[u32]>, hits: &mut [u32]) {
    if let Some(order) = order {
        hits.iter_mut().for_each(|hit| *hit = order[*hit as usize]);
        hits.sort_unstable();
    }
}
