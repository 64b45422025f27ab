//! The exact oracle: the degree-6 polynomial in dyadic rationals.

use crate::geometry::hit::Crossing;
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;

/// Every crossing inside the open range of a ray in the profile's own frame, by rising t; a tangency counts once, a point
/// shared by two pieces once.
pub fn crossings(_profile: &Profile, _ray: &Ray) -> Vec<Crossing> {
    todo!()
}
