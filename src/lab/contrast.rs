//! Two pictures of the same thing, to be looked at against each other.

use crate::image::picture::Picture;

/// A pair of pictures of equal size, each with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Contrast {
    /// What one should see.
    pub caption: String,
    /// The picture.
    pub a: (String, Picture),
    /// What it is held against.
    pub b: (String, Picture),
}
