//! A general root finder as a rival: polycool (of the kurbo project) on the same degree-6 polynomial, as a user would set it up.
//!
//! f(u) = δ (r² − ρ²) − α (h − y₀)² with α = A/(A + d_y²), δ = d_y²/(A + d_y²), A = d_x² + d_z²; ρ is the line's distance from the axis
//! and y₀ its height there. Coefficients are taken about that point, which loses nothing for far origins.

use crate::geometry::bounds::Cylinder;
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use polycool::Poly;

/// A profile in the power basis, for the general root finder.
pub struct Library {
    pieces: Vec<Powers>,
    cylinder: Cylinder,
    /// Accuracy in u that is asked of the root finder.
    accuracy: f64,
}

/// Coefficients by rising power of u: of h, r, h² and r².
struct Powers {
    height: [f64; 4],
    radius: [f64; 4],
    height_squared: [f64; 7],
    radius_squared: [f64; 7],
}

/// A line by its point nearest to the axis.
struct Approach {
    /// t there, or of the origin for a line parallel to the axis.
    t: f64,
    height: f64,
    distance_squared: f64,
    across: f64,
    along: f64,
}

impl Library {
    /// Prepares a profile.
    pub fn new(profile: &Profile, accuracy: f64) -> Self {
        let pieces = profile.pieces().iter().map(|piece| {
            let (height, radius) = (powers(piece.height), powers(piece.radius));
            Powers {
                height_squared: square(&height),
                radius_squared: square(&radius),
                height,
                radius,
            }
        });
        Self {
            pieces: pieces.collect(),
            cylinder: Cylinder::of(profile),
            accuracy,
        }
    }

    /// t of the nearest crossing that it finds in the ray's range.
    pub fn nearest(&self, ray: &Ray) -> Option<f64> {
        let (low, high) = self.cylinder.interval(ray)?;
        if high <= ray.t_min || low >= ray.t_max {
            return None;
        }
        let line = Approach::of(ray);
        let mut nearest: Option<f64> = None;
        for piece in &self.pieces {
            for u in line
                .polynomial(piece)
                .roots_between(0.0, 1.0, self.accuracy)
            {
                let t = line.time(piece, u, ray);
                if ray.contains(t) && nearest.is_none_or(|found| t < found) {
                    nearest = Some(t);
                }
            }
        }
        nearest
    }
}

impl Approach {
    fn of(ray: &Ray) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        let across = d.x * d.x + d.z * d.z;
        let along = d.y * d.y;
        if across == 0.0 {
            return Self {
                t: 0.0,
                height: o.y,
                distance_squared: o.x * o.x + o.z * o.z,
                across,
                along,
            };
        }
        let t = -(o.x * d.x + o.z * d.z) / across;
        let cross = o.x * d.z - o.z * d.x;
        Self {
            t,
            height: o.y + t * d.y,
            distance_squared: cross * cross / across,
            across,
            along,
        }
    }

    fn polynomial(&self, piece: &Powers) -> Poly<7> {
        let both = self.across + self.along;
        let (a, d) = (self.across / both, self.along / both);
        let mut c: [f64; 7] =
            std::array::from_fn(|i| d * piece.radius_squared[i] - a * piece.height_squared[i]);
        for (c, h) in c.iter_mut().zip(piece.height) {
            *c += 2.0 * a * self.height * h;
        }
        c[0] -= d * self.distance_squared + a * self.height * self.height;
        Poly::new(c)
    }

    /// t of a root, by the better-conditioned of the two formulas.
    fn time(&self, piece: &Powers, u: f64, ray: &Ray) -> f64 {
        let height = value(&piece.height, u);
        if self.along >= 0.01 * self.across {
            return (height - ray.origin.y) / ray.direction.y;
        }
        let radius = value(&piece.radius, u);
        let half = (radius * radius - self.distance_squared).max(0.0) / self.across;
        let side = (height - self.height) * ray.direction.y;
        self.t + half.sqrt() * if side < 0.0 { -1.0 } else { 1.0 }
    }
}

fn value(c: &[f64; 4], u: f64) -> f64 {
    c[0] + u * (c[1] + u * (c[2] + u * c[3]))
}

/// A cubic's coefficients by power, from its control values.
fn powers([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [
        a,
        3.0 * (b - a),
        3.0 * (a - 2.0 * b + c),
        d - a + 3.0 * (b - c),
    ]
}

fn square(c: &[f64; 4]) -> [f64; 7] {
    let mut product = [0.0; 7];
    for (i, a) in c.iter().enumerate() {
        for (j, b) in c.iter().enumerate() {
            product[i + j] += a * b;
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::specimens::Specimen;
    use glam::DVec3;

    /// A paraboloid h = r²/4 met at r = 1 and r = 3 by the ray through both points.
    #[test]
    fn the_library_finds_planted_points() {
        let bowl = crate::geometry::profile::Piece {
            radius: [0.0, 4.0 / 3.0, 8.0 / 3.0, 4.0],
            height: [0.0, 0.0, 4.0 / 3.0, 4.0],
        };
        let bowl = Profile::new(vec![bowl]).expect("one piece");
        let (near, far) = (DVec3::new(1.0, 0.25, 0.0), DVec3::new(-3.0, 2.25, 0.0));
        let ray = Ray::new(2.0 * near - far, far - near);
        let found = Library::new(&bowl, 1e-14).nearest(&ray);
        assert!(found.is_some_and(|t| (t - 1.0).abs() < 1e-12), "{found:?}");
        let miss = Ray::new(DVec3::new(9.0, -1.0, 0.0), DVec3::new(1.0, 0.2, 0.0));
        assert_eq!(Library::new(&bowl, 1e-14).nearest(&miss), None);
    }

    #[test]
    fn rays_along_the_axis_need_no_approach() {
        let library = Library::new(&Specimen::Hourglass.profile(), 1e-14);
        let down = Ray::new(DVec3::new(0.1, 10.0, 0.0), DVec3::NEG_Y);
        assert!(library.nearest(&down).is_some());
    }
}
