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

/// The centre of the pixel: the fifth place of the 3×3 grid.
pub const CENTER: Place = Place {
    offset: DVec2::splat(0.5),
    number: 4,
};

/// The grid of side×side cells' centres, row by row; `side` from 1 to 7.
pub fn grid(side: usize) -> Vec<Place> {
    if side == 3 {
        let place = |place: usize| Place {
            offset: DVec2::new(THIRDS[place % 3], THIRDS[place / 3]),
            number: place as u64,
        };
        return (0..9).map(place).collect();
    }
    let along = |cell: usize| (cell as f64 + 0.5) / side as f64;
    let place = |cell: usize| Place {
        offset: DVec2::new(along(cell % side), along(cell / side)),
        number: (side * side + cell) as u64 + 8,
    };
    (0..side * side).map(place).collect()
}

/// Four of the sixteen places of [`grid`]`(4)`, no two in a row or a column: the first look of adaptive resampling.
pub const ROOKS: [usize; 4] = [1, 7, 8, 14];

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
        }
    }

    #[test]
    fn the_first_look_has_one_place_in_each_row_and_column_about_the_centre() {
        let places = ROOKS.map(|place| grid(4)[place].offset);
        for along in [0, 1] {
            let mut steps = places.map(|place| place[along]);
            steps.sort_by(f64::total_cmp);
            assert_eq!(steps, [0.125, 0.375, 0.625, 0.875]);
        }
        let mean = places.iter().sum::<DVec2>() / 4.0;
        assert_eq!(mean, DVec2::splat(0.5));
    }
}
