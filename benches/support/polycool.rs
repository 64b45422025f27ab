//! A rival: the same polynomial and the same t, with the roots by polycool (kurbo's solver).

use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use polycool::Poly;

/// The pieces' r², h² and h in powers of u.
pub(crate) struct Powers(Vec<[[f64; 7]; 3]>);

/// Accuracy asked of the roots.
const ACCURACY: f64 = 1e-14;

impl Powers {
    pub(crate) fn new(profile: &Profile) -> Self {
        let pieces = profile.pieces().iter().map(|piece| {
            let (r, h) = (powers(&piece.radius), powers(&piece.height));
            let mut raised = [0.0; 7];
            raised[..4].copy_from_slice(&h);
            [square(&r), square(&h), raised]
        });
        Self(pieces.collect())
    }

    /// The least t in the range of a ray that is not level.
    pub(crate) fn nearest(&self, ray: &Ray) -> Option<f64> {
        let (o, d) = (ray.origin, ray.direction);
        let q = [o.x * d.y - o.y * d.x, o.z * d.y - o.y * d.z];
        let (along, across) = (d.y * d.y, d.x * d.x + d.z * d.z);
        let twice_b = 2.0 * (q[0] * d.x + q[1] * d.z);
        let k = q[0] * q[0] + q[1] * q[1];
        let mut nearest = None;
        for [r2, h2, h] in &self.0 {
            let mut f: [f64; 7] =
                std::array::from_fn(|i| along * r2[i] - across * h2[i] - twice_b * h[i]);
            f[0] -= k;
            for u in Poly::new(f).roots_between(0.0, 1.0, ACCURACY) {
                let height = h[0] + u * (h[1] + u * (h[2] + u * h[3]));
                let t = (height - o.y) / d.y;
                if ray.contains(t) && nearest.is_none_or(|least| t < least) {
                    nearest = Some(t);
                }
            }
        }
        nearest
    }
}

/// The coefficients of 1, u, u², u³.
fn powers([a, b, c, d]: &[f64; 4]) -> [f64; 4] {
    [
        *a,
        3.0 * (b - a),
        3.0 * (c - 2.0 * b + a),
        d - 3.0 * c + 3.0 * b - a,
    ]
}

fn square(p: &[f64; 4]) -> [f64; 7] {
    let mut square = [0.0; 7];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in p.iter().enumerate() {
            square[i + j] += a * b;
        }
    }
    square
}
