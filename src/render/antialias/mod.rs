//! Antialiasing by a second look at some pixels: which of them, and where within them.
//!
//! *Path hash*: a pixel whose path differs from a neighbour's holds an edge. What enters the hash is a choice ([`Hash`]); what
//! it leaves out is not found, and neither are objects smaller than a pixel that no centre meets. *Contrast* and *variance* are
//! the baselines that look at colours instead.
//!
//! [`Hash`]: crate::scene::options::Hash

pub mod fingerprint;
pub mod mask;
pub mod pattern;
