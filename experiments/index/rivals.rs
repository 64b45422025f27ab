//! kiddo, the fastest k-d tree library known to us for this work, in the two ways in which it can be asked.

use crate::index::Balls;
use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// A tree over points. It knows one radius for each query.
pub(super) struct Kiddo(ImmutableKdTree<f64, 3>);

impl Kiddo {
    /// Builds the tree.
    pub(super) fn new(points: &[DVec3]) -> anyhow::Result<Self> {
        let points: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
        let tree = ImmutableKdTree::new_from_slice(&points);
        tree.map(Self)
            .map_err(|fault| anyhow::anyhow!("kiddo: {fault:?}"))
    }

    /// Queries met by each ball, from a tree over the centres: asks with the greatest radius, then compares with each ball's own.
    pub(super) fn over_hit_points(&self, balls: &Balls, queries: &[DVec3]) -> Vec<u32> {
        let greatest = balls.radii_squared().iter().copied().fold(0.0, f64::max);
        let mut counts = vec![0; balls.len()];
        for query in queries {
            let query = query.to_array();
            let within = self
                .0
                .query(&query)
                .within::<SquaredEuclidean<f64>>(greatest);
            within.unsorted().visit(|found| {
                let ball = found.item as usize;
                counts[ball] += u32::from(found.distance <= balls.radii_squared()[ball]);
            });
        }
        counts
    }

    /// The same from a tree over the queries: asks with each ball's radius.
    pub(super) fn over_photons(&self, balls: &Balls) -> Vec<u32> {
        let balls = balls.centers().iter().zip(balls.radii_squared());
        let count = |(center, &square): (&DVec3, &f64)| {
            let mut count = 0;
            let center = center.to_array();
            let within = self
                .0
                .query(&center)
                .within::<SquaredEuclidean<f64>>(square);
            within.unsorted().visit(|_| count += 1);
            count
        };
        balls.map(count).collect()
    }
}
