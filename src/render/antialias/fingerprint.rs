//! What a camera path met, as hashes.

use crate::numeric::rng::mix;
use crate::scene::options::Hash;

/// A 64-bit hash of a path under construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathHash(u64);

/// What led to a vertex of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Event {
    /// The camera.
    Camera = 1,
    /// Mirror reflection.
    Mirror = 2,
    /// Reflection at a dielectric.
    Reflect = 3,
    /// Refraction.
    Refract = 4,
}

impl Default for PathHash {
    fn default() -> Self {
        Self(0x6C62_272E_07BB_0142)
    }
}

impl PathHash {
    /// Adds a vertex: the event that led there, the depth, and what was met (`None`: the background).
    pub fn vertex(&mut self, event: Event, depth: u32, met: Option<Met>) {
        let place = met.map_or(0, |met| 1 + (met.object as u64) * 2 + u64::from(met.front));
        let piece = met.map_or(0, |met| u64::from(met.piece));
        self.0 = mix(&[self.0, event as u64 | u64::from(depth) << 8, place, piece]);
    }

    /// The hash so far.
    pub fn value(self) -> u64 {
        self.0
    }
}

/// What a path met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Met {
    /// Object.
    pub object: usize,
    /// Piece of its profile.
    pub piece: u32,
    /// Whether the normal's side was met.
    pub front: bool,
}

/// Hashes of everything that a pixel may be compared by, made along one walk of its path.
///
/// The walk is the whole tree of hits that chance has no part in, reflections first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fingerprint {
    objects: PathHash,
    original: Original,
    /// The first hit alone: two samples that differ here straddle a silhouette.
    pub first: u64,
    /// Which lights are visible from the diffuse hits.
    pub shadow: u64,
    /// The texels or checker cells of the diffuse hits.
    pub texture: u64,
}

/// A vertex of a path, for its fingerprint.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// What led there.
    pub event: Event,
    /// Events before it.
    pub depth: u32,
    /// What was met.
    pub met: Option<Met>,
    /// The object at which the event before it happened.
    pub left: Option<usize>,
    /// Whether what was met emits light.
    pub emits: bool,
}

impl Fingerprint {
    /// Adds a vertex.
    pub fn vertex(&mut self, vertex: &Vertex) {
        self.objects.vertex(vertex.event, vertex.depth, vertex.met);
        self.original.vertex(vertex);
        if vertex.event == Event::Camera {
            self.first = self.objects.value();
        }
    }

    /// Adds whether the next light is visible from the diffuse hit last added.
    pub fn light(&mut self, visible: bool) {
        self.shadow = mix(&[self.shadow, self.objects.value(), u64::from(visible)]);
    }

    /// Adds the cell of the pattern at the diffuse hit last added.
    pub fn cell(&mut self, cell: [i64; 2]) {
        let [column, row] = cell.map(|place| place as u64);
        self.texture = mix(&[self.texture, self.objects.value(), column, row]);
    }

    /// The hash that enters the comparison of neighbours.
    pub fn value(&self, hash: Hash) -> u64 {
        match hash {
            Hash::Original => u64::from(self.original.0),
            Hash::Objects => self.objects.value(),
            Hash::Shadow => mix(&[self.objects.value(), self.shadow]),
            Hash::Texture => mix(&[self.objects.value(), self.shadow, self.texture]),
        }
    }
}

/// The hash of the course project this testbed grew out of: specular events and the objects at which they happen, nothing of
/// diffuse hits; 32 bits from 0, so that reflection and refraction at the first object are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Original(u32);

impl Original {
    fn vertex(&mut self, vertex: &Vertex) {
        let id = |object: usize| mix(&[object as u64]) as u32 >> 1;
        let factor = if vertex.event == Event::Refract {
            19
        } else {
            17
        };
        if let Some(object) = vertex.left {
            self.fold(factor, id(object));
        }
        match vertex.met {
            None => self.fold(17, 235),
            Some(met) if vertex.emits => self.fold(17, id(met.object)),
            Some(_) => {}
        }
    }

    fn fold(&mut self, factor: u32, id: u32) {
        self.0 = self.0.wrapping_mul(factor).wrapping_add(id);
    }
}
