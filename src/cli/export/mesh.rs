//! Triangles for renderers without surfaces of revolution, with a bound of the geometric error.
//!
//! The profile is replaced by chords and the circle by a regular polygon. With the greatest second derivative M of a piece and
//! chords over parameter steps of 1/n, the curve is within M/(8 n²) of its chords (the error of linear interpolation), and
//! turning about the axis keeps that distance. The chords sweep frusta of cones; between two meridians of the N-gon a frustum is
//! replaced by the plane trapezoid of its four corners, which is within the sagitta R (1 − cos(π/N)) of it. The mesh is within
//! the sum of both, and the surface within the same sum of the mesh. Rounding the vertices to 32 bits adds at most half a unit
//! in the last place of each coordinate.

use crate::geometry::planar::{Disc, Quad, tangents};
use crate::geometry::profile::Piece;
use crate::geometry::revolution::Revolution;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Most vertices of a mesh: a file of 256 MiB.
pub const MAX_VERTICES: usize = 1 << 23;

/// A corner of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Place in the world.
    pub point: DVec3,
    /// Unit normal of the true surface there.
    pub normal: DVec3,
    /// Texture coordinates.
    pub st: DVec2,
}

/// Triangles, counter-clockwise seen from the normals' side.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<Vertex>,
    /// Indices of vertices, three a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// No point of the mesh is farther than this from the surface, nor any of the surface from the mesh, world units; with
    /// the rounding of the vertices to 32 bits.
    pub error: f64,
}

/// Why a mesh cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "its mesh would have more than {MAX_VERTICES} vertices: expected a larger --mesh-error or fewer pieces"
)]
pub struct TooFine;

impl Mesh {
    /// The mesh of a surface of revolution; its error before rounding is at most `share` of the object's size, the greater of
    /// the diameter and the height of its bounding cylinder. Pieces that lie on the axis have no surface and give no triangle.
    ///
    /// # Errors
    /// A mesh of more than [`MAX_VERTICES`].
    pub fn of_revolution(shape: &Revolution, share: f64) -> Result<Self, TooFine> {
        let cylinder = shape.cylinder();
        let size = (2.0 * cylinder.radius).max(cylinder.top - cylinder.bottom);
        let half = 0.5 * share * size;
        let sides = sides_of_circle(cylinder.radius, half);
        let mut strips = Vec::new();
        let pieces = shape.profile().pieces();
        let mut rows = 0_usize;
        for (index, piece) in pieces.iter().enumerate() {
            if piece.on_axis() {
                continue;
            }
            let steps = (bend(piece) / (8.0 * half)).sqrt().ceil().max(1.0);
            if steps * sides as f64 > MAX_VERTICES as f64 {
                return Err(TooFine);
            }
            for strip in strips_of(piece, steps as usize) {
                rows += strip.len();
                strips.push((index, strip));
            }
            if rows.saturating_mul(sides + 1) > MAX_VERTICES {
                return Err(TooFine);
            }
        }
        let mut mesh = Self {
            vertices: Vec::with_capacity(rows * (sides + 1)),
            triangles: Vec::new(),
            error: shape.placement().scale * (half + sagitta(cylinder.radius, sides)),
        };
        for (index, strip) in strips {
            mesh.add_strip(shape, index, &strip, sides);
        }
        mesh.count_rounding();
        Ok(mesh)
    }

    /// The mesh of a disc, a regular polygon in it; its error before rounding is at most `share` of the diameter.
    pub fn of_disc(disc: &Disc, share: f64) -> Self {
        let sides = sides_of_circle(disc.radius, 2.0 * share * disc.radius);
        let (s_axis, t_axis) = tangents(disc.normal);
        let vertex = |x: f64, y: f64| Vertex {
            point: disc.center + disc.radius * (x * s_axis + y * t_axis),
            normal: disc.normal,
            st: DVec2::new(0.5 + 0.5 * x, 0.5 + 0.5 * y),
        };
        let mut vertices = vec![vertex(0.0, 0.0)];
        vertices.extend((0..sides).map(|side| {
            let angle = TAU * side as f64 / sides as f64;
            vertex(libm::cos(angle), libm::sin(angle))
        }));
        let triangles = (0..sides).map(|side| {
            let next = (side + 1) % sides;
            [0, side as u32 + 1, next as u32 + 1]
        });
        let mut mesh = Self {
            vertices,
            triangles: triangles.collect(),
            error: sagitta(disc.radius, sides),
        };
        mesh.count_rounding();
        mesh
    }

    /// The two triangles of a parallelogram: exact but for rounding.
    pub fn of_quad(quad: &Quad) -> Self {
        let vertex = |s: f64, t: f64| Vertex {
            point: quad.corner + s * quad.edge_u + t * quad.edge_v,
            normal: quad.normal(),
            st: DVec2::new(s, t),
        };
        let mut mesh = Self {
            vertices: vec![
                vertex(0.0, 0.0),
                vertex(1.0, 0.0),
                vertex(1.0, 1.0),
                vertex(0.0, 1.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            error: 0.0,
        };
        mesh.count_rounding();
        mesh
    }

    /// The rows of one strip, turned, and the triangles between them.
    fn add_strip(&mut self, shape: &Revolution, index: usize, strip: &[Row], sides: usize) {
        let placement = shape.placement();
        let pieces = shape.profile().pieces().len() as f64;
        let first = self.vertices.len() as u32;
        for row in strip {
            let [radius_slope, height_slope] = row.tangent;
            let along = libm::hypot(radius_slope, height_slope);
            let (out, up) = if along > 0.0 {
                (height_slope / along, -radius_slope / along)
            } else {
                (0.0, 1.0)
            };
            for side in 0..=sides {
                // The last column stands exactly on the first: the mesh has no slit.
                let angle = TAU * (side % sides) as f64 / sides as f64;
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                let local = DVec3::new(row.radius * sin, row.height, row.radius * cos);
                let normal = DVec3::new(out * sin, up, out * cos);
                self.vertices.push(Vertex {
                    point: placement.point_to_world(local),
                    normal: placement.rotation * normal,
                    st: DVec2::new(side as f64 / sides as f64, (index as f64 + row.u) / pieces),
                });
            }
        }
        let columns = sides as u32 + 1;
        for (below, rows) in strip.windows(2).enumerate() {
            let low = first + below as u32 * columns;
            for column in low..low + sides as u32 {
                let high = column + columns;
                if rows[0].radius > 0.0 {
                    self.triangles.push([column, column + 1, high + 1]);
                }
                if rows[1].radius > 0.0 {
                    self.triangles.push([column, high + 1, high]);
                }
            }
        }
    }

    /// Adds what the rounding of the vertices to 32 bits may move them.
    fn count_rounding(&mut self) {
        let half_ulp = 0.5 * f64::from(f32::EPSILON);
        let size = self
            .vertices
            .iter()
            .fold(0.0, |size: f64, vertex| size.max(vertex.point.length()));
        self.error += half_ulp * size;
    }

    /// The bytes of a binary PLY file: 32-bit `x y z nx ny nz u v` a vertex.
    pub fn ply(&self) -> Vec<u8> {
        let header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
             property float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\n\
             property float u\nproperty float v\n\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.vertices.len(),
            self.triangles.len()
        );
        let mut bytes = header.into_bytes();
        for vertex in &self.vertices {
            let numbers = vertex
                .point
                .to_array()
                .into_iter()
                .chain(vertex.normal.to_array())
                .chain(vertex.st.to_array());
            for x in numbers {
                bytes.extend((x as f32).to_le_bytes());
            }
        }
        for triangle in &self.triangles {
            bytes.push(3);
            for index in triangle {
                bytes.extend(index.to_le_bytes());
            }
        }
        bytes
    }
}

/// A circle of the mesh.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Parameter in the piece.
    u: f64,
    /// |r(u)|, zero exactly on the axis.
    radius: f64,
    /// h(u).
    height: f64,
    /// Direction of (|r|, h) at u, from inside the strip.
    tangent: [f64; 2],
}

/// The rows of a piece at `steps` equal steps of u, cut where the radius changes its sign: no chord crosses the axis, so that
/// |r| is as near to the chords of |r| as r to its own.
fn strips_of(piece: &Piece, steps: usize) -> Vec<Vec<Row>> {
    let radius = |u: f64| piece.at(u).radius;
    let row = |u: f64, on_axis: bool, sign: f64| {
        let station = piece.at(u);
        let [radius_slope, height_slope] = piece.tangent(u);
        Row {
            u,
            radius: if on_axis { 0.0 } else { station.radius.abs() },
            height: station.height,
            tangent: [sign * radius_slope, height_slope],
        }
    };
    let mut strips = Vec::new();
    // The places of one strip, and the sign of the radius there once it is known.
    let mut places: Vec<(f64, bool)> = Vec::new();
    let mut sign = 0.0;
    let mut finish = |places: &mut Vec<(f64, bool)>, sign: f64| {
        let sign = if sign < 0.0 { -1.0 } else { 1.0 };
        let rows: Vec<Row> = places
            .drain(..)
            .map(|(u, axis)| row(u, axis, sign))
            .collect();
        if rows.len() > 1 {
            strips.push(rows);
        }
    };
    for step in 0..=steps {
        let u = step as f64 / steps as f64;
        let here = radius(u);
        if here == 0.0 {
            places.push((u, true));
            finish(&mut places, sign);
            places.push((u, true));
            sign = 0.0;
            continue;
        }
        if sign * here < 0.0 {
            let before = places.last().map_or(0.0, |place| place.0);
            let root = crossing_of_axis(radius, before, u);
            places.push((root, true));
            finish(&mut places, sign);
            places.push((root, true));
        }
        sign = here.signum();
        places.push((u, false));
    }
    finish(&mut places, sign);
    strips
}

/// A sign change of the radius between two parameters, by bisection to the last bit.
fn crossing_of_axis(radius: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let start = radius(low).signum();
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if radius(middle).signum() == start {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// A bound of |P″| on the piece: six times the greatest second difference of its control points.
fn bend(piece: &Piece) -> f64 {
    let second = |c: &[f64; 4], i: usize| c[i + 2] - 2.0 * c[i + 1] + c[i];
    let length = |i: usize| libm::hypot(second(&piece.radius, i), second(&piece.height, i));
    6.0 * length(0).max(length(1))
}

/// Sides of the regular polygon whose sagitta is at most `error`; at least 16.
fn sides_of_circle(radius: f64, error: f64) -> usize {
    if error >= radius {
        return 16;
    }
    // More than the limit of vertices is refused by the caller, or far below any sensible share.
    let sides = PI / libm::acos(1.0 - error / radius);
    sides.ceil().clamp(16.0, MAX_VERTICES as f64) as usize
}

/// Greatest distance of a circle from its inscribed regular polygon.
fn sagitta(radius: f64, sides: usize) -> f64 {
    // 1 − cos x as 2 sin²(x/2): no digits are lost for many sides.
    let sin = libm::sin(0.5 * PI / sides as f64);
    2.0 * radius * sin * sin
}
