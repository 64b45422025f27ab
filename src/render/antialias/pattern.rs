//! Places of samples within a pixel.

use glam::DVec2;

/// A place within a pixel, and the number that its random numbers are keyed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// From the pixel's upper left corner, in pixels.
    pub offset: DVec2,
    /// Unlike that of any other place.
    pub number: u64,
}

/// Centres of the cells of a 3×3 grid, row by row; the fifth is the centre of the pixel.
const THIRDS: [f64; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];

/// Places of the 3×3 grid come first, those of the other grids after them, then those within its cells.
const CELLS: u64 = 64;

/// The centre of the pixel: the fifth place of the 3×3 grid.
pub const CENTER: Place = Place {
    offset: DVec2::splat(0.5),
    number: 4,
};

/// The grid of 3×3, row by row.
pub fn thirds() -> [Place; 9] {
    std::array::from_fn(|place| Place {
        offset: DVec2::new(THIRDS[place % 3], THIRDS[place / 3]),
        number: place as u64,
    })
}

/// The grid of side×side cells' centres, row by row; `side` from 1 to 7.
pub fn grid(side: usize) -> Vec<Place> {
    if side == 3 {
        return thirds().to_vec();
    }
    let along = |cell: usize| (cell as f64 + 0.5) / side as f64;
    let place = |cell: usize| Place {
        offset: DVec2::new(along(cell % side), along(cell / side)),
        number: (side * side + cell) as u64 + 8,
    };
    (0..side * side).map(place).collect()
}

/// The 3×3 grid within a cell of the 3×3 grid. Its fifth place is the cell's own.
pub fn within(cell: usize) -> [Place; 9] {
    let center = thirds()[cell];
    thirds().map(|place| {
        if place.number == CENTER.number {
            return center;
        }
        Place {
            offset: center.offset + (place.offset - CENTER.offset) / 3.0,
            number: CELLS + 9 * cell as u64 + place.number,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_grid_has_the_pixels_centre_for_its_mean_and_numbers_of_its_own() {
        for side in 1..=5 {
            let grid = grid(side);
            let mean: DVec2 =
                grid.iter().map(|place| place.offset).sum::<DVec2>() / grid.len() as f64;
            assert!((mean - 0.5).length() < 1e-15, "{side}");
            let numbers: HashSet<u64> = grid.iter().map(|place| place.number).collect();
            assert_eq!(numbers.len(), side * side);
            assert!(numbers.iter().all(|&number| number < CELLS));
        }
    }

    #[test]
    fn the_cells_grids_together_are_the_grid_of_nine() {
        let all: Vec<Place> = (0..9).flat_map(within).collect();
        let numbers: HashSet<u64> = all.iter().map(|place| place.number).collect();
        assert_eq!(numbers.len(), 81);
        for x in 0..9 {
            for y in 0..9 {
                let expected = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / 9.0;
                let near = |place: &&Place| (place.offset - expected).length() < 1e-15;
                assert_eq!(all.iter().filter(near).count(), 1);
            }
        }
    }
}
