//! Pictures in files, and differences between pictures.

pub mod picture;
