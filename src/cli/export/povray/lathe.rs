//! Control points that POV-Ray's `lathe` accepts, and meshes in its language.

use super::super::mesh::Mesh;
use crate::geometry::profile::{Piece, Profile};
use glam::DVec3;
use std::fmt::Write as _;

/// Halvings of a piece whose control radii are negative: what is left is a 2⁻²⁴ of it.
const MOST_HALVINGS: u32 = 24;

/// The profile as pieces without negative control radii, which POV-Ray refuses, and the greatest distance by which a control
/// point had to be moved for that.
///
/// A piece whose radius stays positive is halved by de Casteljau's rule, which keeps the curve, until its control radii are
/// positive too; where r < 0 the surface is that of |r|, and all signs turn. Only around a change of sign is something moved: what
/// is left of the negative after all halvings is set to zero. Pieces on the axis have no surface and are left out.
pub(super) fn control_points(profile: &Profile) -> (Vec<[[f64; 2]; 4]>, f64) {
    let mut points = Vec::new();
    let mut moved: f64 = 0.0;
    for piece in profile.pieces().iter().filter(|piece| !piece.on_axis()) {
        let mut rest = vec![(*piece, MOST_HALVINGS)];
        while let Some((piece, halvings)) = rest.pop() {
            let negative = piece.radius.iter().any(|&r| r < 0.0);
            let positive = piece.radius.iter().any(|&r| r > 0.0);
            let ready = match (negative, positive) {
                (true, true) if halvings > 0 => {
                    let [first, second] = halves(&piece);
                    rest.extend([(second, halvings - 1), (first, halvings - 1)]);
                    continue;
                }
                (true, true) => {
                    let lowest = piece.radius.iter().fold(0.0_f64, |low, &r| low.min(r));
                    moved = moved.max(-lowest);
                    Piece {
                        radius: piece.radius.map(|r| r.max(0.0)),
                        ..piece
                    }
                }
                (true, false) => Piece {
                    radius: piece.radius.map(f64::abs),
                    ..piece
                },
                (false, _) => piece,
            };
            points.push([0, 1, 2, 3].map(|i| ready.point(i)));
        }
    }
    (points, moved)
}

/// Both halves of a piece.
fn halves(piece: &Piece) -> [Piece; 2] {
    let (low_radius, high_radius) = halve(&piece.radius);
    let (low_height, high_height) = halve(&piece.height);
    let half = |radius, height| Piece { radius, height };
    [half(low_radius, low_height), half(high_radius, high_height)]
}

fn halve(c: &[f64; 4]) -> ([f64; 4], [f64; 4]) {
    let middle = |a: f64, b: f64| 0.5 * (a + b);
    let (a, b, d) = (middle(c[0], c[1]), middle(c[1], c[2]), middle(c[2], c[3]));
    let (e, f) = (middle(a, b), middle(b, d));
    let center = middle(e, f);
    ([c[0], a, e, center], [center, f, d, c[3]])
}

/// The lists of a `mesh2`.
pub(super) fn mesh_text(mesh: &Mesh) -> String {
    let count = mesh.vertices.len();
    let triple = |v: DVec3| {
        let [x, y, z] = v.to_array().map(|x| x as f32);
        format!("<{x:?},{y:?},{z:?}>")
    };
    let mut text = String::new();
    let mut list = |name: &str, items: &mut dyn Iterator<Item = String>, count: usize| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{name} {{ {count}");
        for item in items {
            text.push_str(",\n");
            text.push_str(&item);
        }
        text.push_str(" }\n");
    };
    let vertices = || mesh.vertices.iter();
    list(
        "vertex_vectors",
        &mut vertices().map(|v| triple(v.point)),
        count,
    );
    list(
        "normal_vectors",
        &mut vertices().map(|v| triple(v.normal)),
        count,
    );
    let st = |v: &super::super::mesh::Vertex| format!("<{:?},{:?}>", v.st.x as f32, v.st.y as f32);
    list("uv_vectors", &mut vertices().map(st), count);
    let triangle = |[a, b, c]: &[u32; 3]| format!("<{a},{b},{c}>");
    let mut triangles = mesh.triangles.iter().map(triangle);
    list("face_indices", &mut triangles, mesh.triangles.len());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Greatest distance of points of the exported pieces from the profile, |r| for r, by dense sampling of it.
    fn farthest(profile: &Profile, points: &[[[f64; 2]; 4]]) -> f64 {
        let curve: Vec<[f64; 2]> = (profile.pieces().iter())
            .flat_map(|piece| (0..=4096).map(|i| piece.at(f64::from(i) / 4096.0)))
            .map(|station| [station.radius.abs(), station.height])
            .collect();
        let nearest = |r: f64, h: f64| {
            let distance = |p: &[f64; 2]| libm::hypot(p[0] - r, p[1] - h);
            curve.iter().map(distance).fold(f64::INFINITY, f64::min)
        };
        let pieces = points.iter().map(|points| Piece::new(*points));
        pieces
            .flat_map(|piece| [0.0, 0.3, 0.5, 0.8, 1.0].map(|u| piece.at(u)))
            .map(|station| nearest(station.radius, station.height))
            .fold(0.0, f64::max)
    }

    #[test]
    fn negative_control_radii_go_and_the_curve_stays() {
        let crossing = Piece::new([[-1.0, 0.0], [1.0, 0.5], [2.0, 1.0], [1.0, 1.5]]);
        let crossing = Profile::new(vec![crossing]).expect("a profile");
        for (profile, cut) in [(Profile::cup(), false), (crossing, true)] {
            let (points, moved) = control_points(&profile);
            assert!(points.as_flattened().iter().all(|p| p[0] >= 0.0));
            assert_eq!(moved > 0.0, cut);
            assert!(moved < 1e-6, "{moved}");
            // Half a step of the sampling, at speeds of at most 12.
            assert!(farthest(&profile, &points) < 12.0 / 8192.0);
            assert!(points.windows(2).all(|pair| {
                let (end, start) = (pair[0][3], pair[1][0]);
                (end[0] - start[0]).abs() <= moved && end[1] == start[1]
            }));
        }
    }
}
