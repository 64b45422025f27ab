//! Indices for fixed-radius search over points with radii of their own.
