//! The order of balls in a wide tree: neighbours side by side, in runs of sixteen, of sixteen runs, and so on.

use super::boxes::WIDTH;
use crate::index::both;
use glam::DVec3;

/// Runs with at least this many balls are worth a task of their own.
const PARALLEL: usize = 4096;

/// A centre, to within rounding: the order decides about speed only.
#[derive(Clone, Copy)]
struct Mark {
    center: [f32; 3],
    item: u32,
}

/// Place → ball. Halves the set at the median of its widest axis again and again, at multiples of the largest power of sixteen
/// below it, so that all nodes but the last of a level are full.
pub(super) fn order(centers: &[DVec3]) -> Vec<u32> {
    let mut marks: Vec<Mark> = (0..)
        .zip(centers)
        .map(|(item, center)| Mark {
            center: center.as_vec3().to_array(),
            item,
        })
        .collect();
    let mut run = WIDTH;
    while run * WIDTH < marks.len() {
        run *= WIDTH;
    }
    arrange(&mut marks, run);
    marks.into_iter().map(|mark| mark.item).collect()
}

/// Arranges a set in runs of `run` balls, each arranged in the same way.
fn arrange(marks: &mut [Mark], mut run: usize) {
    while marks.len() <= run {
        if run == WIDTH {
            return;
        }
        run /= WIDTH;
    }
    let middle = marks.len().div_ceil(run).div_ceil(2) * run;
    let axis = widest(marks);
    marks.select_nth_unstable_by(middle, |a, b| {
        let by_center = a.center[axis].total_cmp(&b.center[axis]);
        by_center.then(a.item.cmp(&b.item))
    });
    let parallel = marks.len() >= PARALLEL;
    let (left, right) = marks.split_at_mut(middle);
    both(parallel, || arrange(left, run), || arrange(right, run));
}

fn widest(marks: &[Mark]) -> usize {
    let mut least = [f32::INFINITY; 3];
    let mut most = [f32::NEG_INFINITY; 3];
    for mark in marks {
        for axis in 0..3 {
            least[axis] = least[axis].min(mark.center[axis]);
            most[axis] = most[axis].max(mark.center[axis]);
        }
    }
    let size: [f32; 3] = std::array::from_fn(|axis| most[axis] - least[axis]);
    (0..3).fold(
        0,
        |best, axis| if size[axis] > size[best] { axis } else { best },
    )
}
