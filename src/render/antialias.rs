//! Path-hash antialiasing: a pixel whose path differs from a neighbour's holds an edge and is sampled more.
//!
//! The hash stands for the whole tree of hits behind a pixel's centre: each hit's object, piece and side, and the event that
//! led there. What it cannot see: edges of shadows and textures, and objects smaller than a pixel that no centre meets.

/// A 64-bit hash of a path under construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathHash(u64);

/// What led to a vertex of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Event {
    /// The camera.
    Camera = 1,
    /// Mirror reflection.
    Mirror = 2,
    /// Reflection at a dielectric.
    Reflect = 3,
    /// Refraction.
    Refract = 4,
}

impl Default for PathHash {
    fn default() -> Self {
        Self(0x6C62_272E_07BB_0142)
    }
}

impl PathHash {
    /// Adds a vertex: the event that led there, the depth, and what was met (`None`: the background).
    pub fn vertex(&mut self, event: Event, depth: u32, met: Option<Met>) {
        let place = met.map_or(0, |met| 1 + (met.object as u64) * 2 + u64::from(met.front));
        let piece = met.map_or(0, |met| u64::from(met.piece));
        self.0 =
            crate::numeric::rng::mix(&[self.0, event as u64 | u64::from(depth) << 8, place, piece]);
    }

    /// The hash so far.
    pub fn value(self) -> u64 {
        self.0
    }
}

/// What a path met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Met {
    /// Object.
    pub object: usize,
    /// Piece of its profile.
    pub piece: u32,
    /// Whether the normal's side was met.
    pub front: bool,
}

/// The pixels to be resampled: those whose hash differs from that of a neighbour above, below, left or right.
///
/// `hashes` holds rows of `width`. The mask is symmetric: of two differing neighbours both are marked.
pub fn mask(hashes: &[u64], width: usize) -> Vec<bool> {
    let mut mask = vec![false; hashes.len()];
    for (index, &hash) in hashes.iter().enumerate() {
        let right = (index + 1) % width != 0 && hashes[index + 1] != hash;
        let below = index + width < hashes.len() && hashes[index + width] != hash;
        if right {
            mask[index] = true;
            mask[index + 1] = true;
        }
        if below {
            mask[index] = true;
            mask[index + width] = true;
        }
    }
    mask
}

/// Places of the 3×3 samples within a pixel, row by row; the fifth is the centre, where the pixel's one sample lies otherwise.
pub const GRID: [[f64; 2]; 9] = {
    const A: f64 = 1.0 / 6.0;
    const B: f64 = 0.5;
    const C: f64 = 5.0 / 6.0;
    [
        [A, A],
        [B, A],
        [C, A],
        [A, B],
        [B, B],
        [C, B],
        [A, C],
        [B, C],
        [C, C],
    ]
};

/// Index of the centre in [`GRID`].
pub const CENTER: usize = 4;
