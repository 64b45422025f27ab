//! Rays, shapes and where they meet.

pub mod bounds;
pub mod hit;
pub mod packet;
pub mod planar;
pub mod profile;
pub mod ray;
pub mod revolution;
pub mod shape;
pub mod specimens;
pub mod sphere;
