//! What must be true of a tree, checked against the rule by which it claims to be built.

use super::{KdTree, LEAF, Node, Split, ball_box, extent, widest};

impl KdTree {
    /// Checks the structure against the rule by which it claims to be built: every ball in exactly one leaf, boxes that contain
    /// all below them, centres left and right of each split in order along the rule's axis, leaves of at most [`LEAF`] balls and
    /// a depth of at most ⌈log₂(n + 1)⌉ + 1. The message names the first fault.
    pub fn check(&self, split: Split) -> Result<(), String> {
        let mut seen = vec![false; self.order.len()];
        for &item in &self.order {
            if std::mem::replace(&mut seen[item as usize], true) {
                return Err(format!("ball {item} stands in the tree twice"));
            }
        }
        let n = self.order.len();
        let limit = (n + 1).next_power_of_two().trailing_zeros() as usize + 1;
        if self.depth() > limit {
            return Err(format!("depth {} with {n} balls", self.depth()));
        }
        self.check_below(0, 0, split)
    }

    fn check_below(&self, node: usize, depth: usize, split: Split) -> Result<(), String> {
        let Node { min, max, .. } = self.nodes[node];
        for place in self.range(node) {
            let (low, high) = ball_box(self.centers[place], self.radii_squared[place]);
            if low.cmplt(min).any() || high.cmpgt(max).any() {
                return Err(format!("a ball sticks out of the box of node {node}"));
            }
        }
        let Some([left, right]) = self.children(node) else {
            return if self.range(node).len() > LEAF {
                Err(format!("leaf {node} is too large"))
            } else {
                Ok(())
            };
        };
        let axis = match split {
            Split::Cycle => depth % 3,
            Split::Widest => {
                let (low, high) = extent(self.range(node).map(|place| self.centers[place]));
                widest(high - low)
            }
        };
        let along = |place: usize| self.centers[place][axis];
        let highest = self
            .range(left)
            .map(along)
            .fold(f64::NEG_INFINITY, f64::max);
        let lowest = self.range(right).map(along).fold(f64::INFINITY, f64::min);
        if highest > lowest {
            return Err(format!(
                "node {node} at depth {depth} does not split on axis {axis}"
            ));
        }
        self.check_below(left, depth + 1, split)?;
        self.check_below(right, depth + 1, split)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{contains, node_count};
    use super::*;
    use crate::index::Balls;
    use crate::numeric::rng::{Purpose, Stream};
    use glam::DVec3;

    fn scattered(n: usize) -> Balls {
        let mut stream = Stream::new(7, Purpose::Test, 0);
        let centers = (0..n)
            .map(|_| DVec3::from_array(std::array::from_fn(|_| stream.uniform())))
            .collect();
        Balls::new(centers, vec![0.01; n]).expect("valid balls")
    }

    #[test]
    fn a_tree_built_by_its_rule_passes_the_check_and_any_other_axis_fails_it() {
        for n in [0, 1, 16, 17, 33, 1000, 5000] {
            for split in [Split::Cycle, Split::Widest] {
                KdTree::new(&scattered(n), split)
                    .check(split)
                    .expect("own tree");
            }
        }
        // A fall-through switch once split every level on z; results stay right because of the boxes.
        let mutant = KdTree::with_axis(&scattered(1000), &|_, _, _| 2);
        assert!(mutant.check(Split::Cycle).is_err());
        assert!(mutant.check(Split::Widest).is_err());
    }

    #[test]
    fn the_check_sees_a_box_that_is_too_small() {
        let mut tree = KdTree::new(&scattered(100), Split::Widest);
        let leaf = (0..tree.nodes.len())
            .find(|&node| tree.children(node).is_none())
            .expect("a leaf");
        tree.nodes[leaf].max.x = tree.nodes[leaf].max.x.next_down();
        assert!(tree.check(Split::Widest).is_err());
    }

    #[test]
    fn the_check_refuses_a_tree_that_is_deeper_than_its_bound() {
        let blank = KdTree::new(&Balls::default(), Split::Cycle).nodes[0];
        // A chain: each left child is empty, the last right child holds the only ball, whose bound is two levels.
        let chain = |levels: u32| {
            let mut tree = KdTree::new(&scattered(1), Split::Cycle);
            let leaf = tree.nodes[0];
            let inner = Node { right: 2, ..leaf };
            tree.nodes.clear();
            for _ in 1..levels {
                tree.nodes.extend([inner, blank]);
            }
            tree.nodes.push(leaf);
            tree
        };
        assert_eq!([1, 2, 3].map(|levels| chain(levels).depth()), [1, 2, 3]);
        assert_eq!(
            [1, 2, 3].map(|levels| chain(levels).check(Split::Cycle).is_ok()),
            [true, true, false]
        );
    }

    #[test]
    fn the_check_refuses_a_leaf_that_is_too_large() {
        let tree = |n| {
            let mut tree = KdTree::new(&scattered(n), Split::Cycle);
            tree.nodes.truncate(1);
            tree.nodes[0].right = 0;
            tree
        };
        assert!(tree(LEAF).check(Split::Cycle).is_ok());
        assert!(tree(LEAF + 1).check(Split::Cycle).is_err());
    }

    #[test]
    fn the_widest_axis_is_that_of_the_greatest_extent_and_the_first_of_equals() {
        for (size, axis) in [
            ([3.0, 2.0, 1.0], 0),
            ([3.0, 1.0, 2.0], 0),
            ([2.0, 3.0, 1.0], 1),
            ([1.0, 3.0, 2.0], 1),
            ([2.0, 1.0, 3.0], 2),
            ([1.0, 2.0, 3.0], 2),
            ([2.0, 2.0, 1.0], 0),
            ([2.0, 1.0, 2.0], 0),
            ([1.0, 2.0, 2.0], 1),
            ([1.0, 1.0, 1.0], 0),
        ] {
            assert_eq!(widest(DVec3::from_array(size)), axis, "{size:?}");
        }
    }

    /// A looser box would give the same answers with more work.
    #[test]
    fn a_box_holds_its_border_and_nothing_beyond() {
        let (min, max) = (DVec3::new(-1.0, -2.0, -3.0), DVec3::new(1.0, 2.0, 3.0));
        let middle = DVec3::new(0.5, 0.5, 0.5);
        assert!(contains(min, max, middle));
        for axis in 0..3 {
            for (bound, beyond) in [(min, min[axis].next_down()), (max, max[axis].next_up())] {
                let mut point = middle;
                point[axis] = bound[axis];
                assert!(contains(min, max, point), "{point}");
                point[axis] = beyond;
                assert!(!contains(min, max, point), "{point}");
            }
        }
    }

    #[test]
    fn the_box_of_a_ball_is_larger_by_roundings_only() {
        for (center, radius) in [(0.0, 1.0), (7.0, 0.25), (-1e9, 3e4), (0.0, 1e-150)] {
            let (min, max) = ball_box(DVec3::splat(center), radius * radius);
            let slack = 16.0 * f64::EPSILON * (radius + center.abs()) + 1e-160;
            for axis in 0..3 {
                let (low, high) = (center - radius - min[axis], max[axis] - center - radius);
                assert!(low >= 0.0 && low <= slack, "{low} at {center} ± {radius}");
                assert!(
                    high >= 0.0 && high <= slack,
                    "{high} at {center} ± {radius}"
                );
            }
        }
    }

    #[test]
    fn the_number_of_nodes_is_foreseen() {
        fn count(n: usize) -> usize {
            if n <= LEAF {
                1
            } else {
                1 + count(n / 2) + count(n - n / 2)
            }
        }
        for n in 0..3000 {
            assert_eq!(node_count(n), (count(n), count(n + 1)), "{n}");
        }
    }
}
