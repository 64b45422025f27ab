//! Pictures from scenes.

pub mod antialias;
pub mod driver;
pub mod features;
pub mod film;
pub mod path;
pub mod photon;
pub mod scatter;
pub mod settings;
pub mod whitted;
