//! A kd-tree over balls (Bentley 1975; for photon maps Jensen 2001, for hit points Hachisuka, Ogaki and Jensen 2008).
//!
//! Every inner node splits its centres at the median of one axis, ties by index: left and right differ by at most one ball
//! whatever the data, so the depth is bounded even if all centres are equal. Every node holds the box of its balls (centres
//! inflated by their own radii), and a query descends where the box contains it. The boxes are rounded outward, so no
//! borderline result is lost.

mod check;

use super::{Answers, BallIndex, Balls, IndexError, ball_box, both, check_radii, covers};
use crate::numeric::work::Work;
use glam::DVec3;

/// Most balls of a leaf.
pub const LEAF: usize = 16;
/// Subtrees with at least this many balls are worth a task of their own.
const PARALLEL: usize = 2048;

/// The axis at which a node splits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// x, y, z in turn with depth, as in the original.
    Cycle,
    /// The axis on which the centres spread most: better on walls, where a whole axis is constant.
    Widest,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Box of the balls below.
    min: DVec3,
    max: DVec3,
    /// Range of balls in tree order.
    start: u32,
    end: u32,
    /// Steps to the right child in the node list; 0 for a leaf. The left child is the next node.
    right: u32,
}

/// The tree. Building it and asking it are deterministic; neither depends on the number of threads.
#[derive(Clone, Debug)]
pub struct KdTree {
    nodes: Vec<Node>,
    /// Centres and squared radii in tree order.
    centers: Vec<DVec3>,
    radii_squared: Vec<f64>,
    /// Ball of each place in tree order.
    order: Vec<u32>,
}

/// A query on its way down the tree.
#[derive(Clone, Copy)]
struct Query {
    point: DVec3,
    index: u32,
}

impl Split {
    fn axis(self, centers: &[DVec3], order: &[u32], depth: usize) -> usize {
        match self {
            Self::Cycle => depth % 3,
            Self::Widest => {
                let (min, max) = extent(order.iter().map(|&item| centers[item as usize]));
                widest(max - min)
            }
        }
    }
}

/// Axis of the largest component; the first of equals.
fn widest(size: DVec3) -> usize {
    if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    }
}

fn extent(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), point| (min.min(point), max.max(point)),
    )
}

impl KdTree {
    /// Builds the tree in O(n log n).
    pub fn new(balls: &Balls, split: Split) -> Self {
        Self::with_axis(balls, &|centers, order, depth| {
            split.axis(centers, order, depth)
        })
    }

    fn with_axis(balls: &Balls, axis: &(impl Fn(&[DVec3], &[u32], usize) -> usize + Sync)) -> Self {
        let blank = Node {
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
            start: 0,
            end: 0,
            right: 0,
        };
        let mut order: Vec<u32> = (0..balls.len() as u32).collect();
        let mut nodes = vec![blank; node_count(balls.len()).0];
        divide(&balls.centers, &mut order, 0, &mut nodes, 0, axis);
        let mut tree = Self {
            nodes,
            centers: order.iter().map(|&i| balls.centers[i as usize]).collect(),
            radii_squared: order
                .iter()
                .map(|&i| balls.radii_squared[i as usize])
                .collect(),
            order,
        };
        tree.fit_boxes();
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
        self.fit_boxes();
        Ok(())
    }

    /// Bytes that the tree holds.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.centers)
            + size_of_val(&*self.radii_squared)
            + size_of_val(&*self.order)
    }

    /// Levels of the tree: 1 for a single leaf.
    pub fn depth(&self) -> usize {
        self.depth_below(0)
    }

    fn depth_below(&self, node: usize) -> usize {
        match self.children(node) {
            None => 1,
            Some([left, right]) => 1 + self.depth_below(left).max(self.depth_below(right)),
        }
    }

    fn children(&self, node: usize) -> Option<[usize; 2]> {
        let right = self.nodes[node].right as usize;
        (right > 0).then_some([node + 1, node + right])
    }

    fn range(&self, node: usize) -> std::ops::Range<usize> {
        self.nodes[node].start as usize..self.nodes[node].end as usize
    }

    /// Children stand behind their parents, so one sweep from the back fits every box.
    fn fit_boxes(&mut self) {
        for node in (0..self.nodes.len()).rev() {
            let (min, max) = match self.children(node) {
                Some(children) => {
                    let [a, b] = children.map(|child| self.nodes[child]);
                    (a.min.min(b.min), a.max.max(b.max))
                }
                None => self.range(node).fold(
                    (DVec3::INFINITY, DVec3::NEG_INFINITY),
                    |(min, max), place| {
                        let (low, high) = ball_box(self.centers[place], self.radii_squared[place]);
                        (min.min(low), max.max(high))
                    },
                ),
            };
            self.nodes[node].min = min;
            self.nodes[node].max = max;
        }
    }

    fn join_below<T, G>(&self, node: usize, queries: &[Query], out: &mut [T], gather: &G) -> Work
    where
        T: Copy + Default + Send + Sync,
        G: Fn(usize, &[u32], &mut T) + Sync,
    {
        let mut work = Work {
            index_visits: queries.len() as u64,
            ..Work::default()
        };
        let inside = inside(queries, &self.nodes[node]);
        let queries = inside.as_deref().unwrap_or(queries);
        if queries.is_empty() {
            return work;
        }
        let Some([left, right]) = self.children(node) else {
            work.index_tests = (queries.len() * out.len()) as u64;
            self.join_leaf(node, queries, out, gather);
            return work;
        };
        let parallel = out.len() >= PARALLEL;
        let (out_left, out_right) = out.split_at_mut(self.range(left).len());
        let go_left = || self.join_below(left, queries, out_left, gather);
        let go_right = || self.join_below(right, queries, out_right, gather);
        let (a, b) = both(parallel, go_left, go_right);
        work += a;
        work += b;
        work
    }

    fn join_leaf<T, G>(&self, node: usize, queries: &[Query], out: &mut [T], gather: &G)
    where
        G: Fn(usize, &[u32], &mut T),
    {
        let mut covered = vec![0; queries.len()];
        for (place, answer) in self.range(node).zip(out) {
            let (center, radius_squared) = (self.centers[place], self.radii_squared[place]);
            let mut count = 0;
            for query in queries {
                // Written always and kept if covered: half of the tests fail at random, and a branch would be mispredicted.
                covered[count] = query.index;
                count += usize::from(covers(center, radius_squared, query.point));
            }
            if count > 0 {
                gather(self.order[place] as usize, &covered[..count], answer);
            }
        }
    }
}

impl BallIndex for KdTree {
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            work.index_visits += 1;
            let Node { min, max, .. } = self.nodes[node];
            if !contains(min, max, query) {
                continue;
            }
            if let Some([left, right]) = self.children(node) {
                open.extend([right, left]);
                continue;
            }
            for place in self.range(node) {
                work.index_tests += 1;
                if covers(self.centers[place], self.radii_squared[place], query) {
                    found(self.order[place] as usize);
                }
            }
        }
    }

    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T> {
        Answers::blank(self.order.len())
    }

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
        let queries: Vec<Query> = (0..)
            .zip(queries)
            .map(|(index, &point)| Query { point, index })
            .collect();
        let places = || self.order.iter().map(|&item| item as usize);
        let mut in_tree_order: Vec<T> = places().map(|item| answers.values[item]).collect();
        *work += self.join_below(0, &queries, &mut in_tree_order, gather);
        for (item, answer) in places().zip(in_tree_order) {
            answers.values[item] = answer;
        }
    }
}

/// Orders `order` into a subtree and fills its nodes; boxes come later.
fn divide(
    centers: &[DVec3],
    order: &mut [u32],
    start: usize,
    nodes: &mut [Node],
    depth: usize,
    axis: &(impl Fn(&[DVec3], &[u32], usize) -> usize + Sync),
) {
    let Some((node, below)) = nodes.split_first_mut() else {
        return;
    };
    node.start = start as u32;
    node.end = (start + order.len()) as u32;
    if order.len() <= LEAF {
        return;
    }
    let along = axis(centers, order, depth);
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&a, &b| {
        let [x, y] = [a, b].map(|item| centers[item as usize][along]);
        x.total_cmp(&y).then(a.cmp(&b))
    });
    let parallel = order.len() >= PARALLEL;
    let (left, right) = order.split_at_mut(middle);
    let (left_nodes, right_nodes) = below.split_at_mut(node_count(middle).0);
    node.right = 1 + left_nodes.len() as u32;
    let go_left = || divide(centers, left, start, left_nodes, depth + 1, axis);
    let go_right = || divide(centers, right, start + middle, right_nodes, depth + 1, axis);
    both(parallel, go_left, go_right);
}

/// Nodes of trees over n and over n + 1 balls: below a node with n balls stand ⌊n/2⌋ and ⌈n/2⌉.
fn node_count(n: usize) -> (usize, usize) {
    if n < LEAF {
        return (1, 1);
    }
    if n == LEAF {
        return (1, 1 + 2);
    }
    let (half, half_and_one) = node_count(n / 2);
    let (even, odd) = (1 + 2 * half, 1 + half + half_and_one);
    if n.is_multiple_of(2) {
        (even, odd)
    } else {
        (odd, 1 + 2 * half_and_one)
    }
}

fn contains(min: DVec3, max: DVec3, point: DVec3) -> bool {
    // Bitwise: the outcomes are hard to predict one by one.
    (point.x >= min.x)
        & (point.x <= max.x)
        & (point.y >= min.y)
        & (point.y <= max.y)
        & (point.z >= min.z)
        & (point.z <= max.z)
}

/// The queries inside the node's box, in order; `None` if all are.
fn inside(queries: &[Query], node: &Node) -> Option<Vec<Query>> {
    let first_outside = queries
        .iter()
        .position(|query| !contains(node.min, node.max, query.point))?;
    let mut kept = queries.to_vec();
    let mut count = first_outside;
    for query in &queries[first_outside + 1..] {
        kept[count] = *query;
        count += usize::from(contains(node.min, node.max, query.point));
    }
    kept.truncate(count);
    Some(kept)
}
