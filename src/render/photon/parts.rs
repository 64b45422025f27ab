//! Lists made in parts by many tasks, joined in their order by all threads.

use rayon::prelude::*;

/// Items that one thread moves at least.
const LEAST: usize = 1 << 12;

/// The items of all parts in order, each made of the number of its part and what stands there.
pub(super) fn joined<T, U, F>(parts: &[&[T]], make: F) -> Vec<U>
where
    T: Copy + Sync,
    U: Send,
    F: Fn(usize, T) -> U + Sync,
{
    let mut count = 0;
    let ends: Vec<usize> = parts
        .iter()
        .map(|part| {
            count += part.len();
            count
        })
        .collect();
    // Each run of items remembers its part and where that begins.
    let items = (0..count).into_par_iter().with_min_len(LEAST);
    let made = items.map_init(
        || (0, 0..0),
        |(part, places), item| {
            if !places.contains(&item) {
                *part = ends.partition_point(|&end| end <= item);
                *places = ends[*part] - parts[*part].len()..ends[*part];
            }
            make(*part, parts[*part][item - places.start])
        },
    );
    made.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_any_size_join_in_their_order() {
        let sizes = [0, 1, 5000, 0, 0, 20_000, 3, 0];
        let parts: Vec<Vec<u32>> = sizes
            .iter()
            .map(|&size| (0..size).map(|i| 7 * i).collect())
            .collect();
        let slices: Vec<&[u32]> = parts.iter().map(Vec::as_slice).collect();
        let expected: Vec<(usize, u32)> = (parts.iter().enumerate())
            .flat_map(|(part, items)| items.iter().map(move |&item| (part, item)))
            .collect();
        assert_eq!(joined(&slices, |part, item| (part, item)), expected);
        assert_eq!(joined(&[], |_, item: u32| item), Vec::<u32>::new());
    }
}
