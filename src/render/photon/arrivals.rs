//! Photons as they lie at diffuse surfaces: 16 bytes each, and 24 for the point.
//!
//! The point stays in f64, because the gather radius is compared exactly. The flux is kept in f32 in units of the light's whole
//! power: a photon's share of it is near 1, and a rounding of 6·10⁻⁸ of a photon, without sign, is far below the noise of any sum of
//! them; sums are made in f64. The normal of a flat object is looked up by object and side. Other normals are kept in full, beside.

use super::bounce::Face;
use super::parts::joined;
use crate::geometry::shape::Shape;
use crate::scene::{Rgb, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// A photon stored at a diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Flux (W) it brings, if it stood for all the light alone: divide by the number of photons emitted.
    pub flux: Rgb,
    /// Unit normal on the side from which it came.
    pub normal: DVec3,
    /// Object it lies on.
    pub object: u32,
    /// Scattering events before.
    pub events: u32,
}

/// What a mark of 32 bits cannot say.
#[derive(Clone, Copy, Debug)]
struct Full {
    normal: DVec3,
    object: u32,
    events: u32,
}

#[derive(Clone, Copy, Debug)]
struct Packed {
    /// In units of the light's power.
    flux: [f32; 3],
    /// Of a flat surface: events in the low [`EVENT_BITS`], above them the side and then the object. With the bit [`FULL`]: a
    /// place in the list of full ones.
    mark: u32,
}

/// One side of a flat object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surface(u32);

/// Bytes of a photon on a flat surface, but for its point.
pub(super) const BYTES: usize = size_of::<Packed>();

const FULL: u32 = 1 << 31;
const EVENT_BITS: u32 = 8;

/// Photons in order, without their points.
#[derive(Clone, Debug)]
pub struct Arrivals {
    packed: Vec<Packed>,
    full: Vec<Full>,
    /// Normal of each object that is flat.
    flat: Arc<[Option<DVec3>]>,
    unit: Rgb,
}

impl Default for Arrivals {
    fn default() -> Self {
        Self {
            packed: Vec::new(),
            full: Vec::new(),
            flat: Arc::new([]),
            unit: Rgb::ONE,
        }
    }
}

impl Arrivals {
    /// None yet, of the lights and objects of a scene.
    pub fn of(scene: &Scene) -> Self {
        let flat = |shape: &Shape| shape.flat().map(|(_, normal)| normal);
        let power = scene.lights.power();
        let used = |power: f64| if power > 0.0 { power } else { 1.0 };
        Self {
            flat: scene.objects.iter().map(|o| flat(&o.shape)).collect(),
            unit: power.map(used),
            ..Self::default()
        }
    }

    /// None yet, of the same lights and objects.
    #[must_use]
    pub fn emptied(&self) -> Self {
        Self {
            flat: self.flat.clone(),
            unit: self.unit,
            ..Self::default()
        }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.packed.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.packed.is_empty()
    }

    /// Adds a photon.
    pub fn push(&mut self, arrival: &Arrival) {
        let mark = self.mark(arrival).unwrap_or_else(|| {
            self.full.push(Full {
                normal: arrival.normal,
                object: arrival.object,
                events: arrival.events,
            });
            FULL | (self.full.len() - 1) as u32
        });
        let flux = arrival.flux / self.unit;
        self.packed.push(Packed {
            flux: flux.to_array().map(|share| share as f32),
            mark,
        });
    }

    /// Adds a photon on a face of an object.
    #[inline]
    pub(super) fn push_flat(&mut self, flux: Rgb, object: u32, face: &Face, events: u32) {
        if object >= FULL >> (EVENT_BITS + 1) || events >= 1 << EVENT_BITS {
            return self.push(&Arrival {
                flux,
                normal: face.facing(),
                object,
                events,
            });
        }
        let side = (object << 1 | u32::from(face.is_back())) << EVENT_BITS;
        self.packed.push(Packed {
            flux: (flux / self.unit).to_array().map(|share| share as f32),
            mark: side | events,
        });
    }

    /// The mark that says all of a photon but its flux, if one can.
    fn mark(&self, arrival: &Arrival) -> Option<u32> {
        let flat = (*self.flat.get(arrival.object as usize)?)?;
        let back = arrival.normal != flat;
        let fits = arrival.object < FULL >> (EVENT_BITS + 1) && arrival.events < 1 << EVENT_BITS;
        let side = (arrival.object << 1 | u32::from(back)) << EVENT_BITS;
        (fits && (!back || arrival.normal == -flat)).then_some(side | arrival.events)
    }

    /// The photon of a number.
    ///
    /// # Panics
    /// If there are not so many.
    #[inline]
    pub fn get(&self, number: usize) -> Arrival {
        let Packed { flux, mark } = self.packed[number];
        let flux = DVec3::from_array(flux.map(f64::from)) * self.unit;
        let flat = if mark & FULL == 0 {
            let object = mark >> (EVENT_BITS + 1);
            self.flat[object as usize].map(|normal| (object, normal))
        } else {
            None
        };
        match flat {
            Some((object, normal)) => Arrival {
                flux,
                normal: if mark >> EVENT_BITS & 1 == 0 {
                    normal
                } else {
                    -normal
                },
                object,
                events: mark & ((1 << EVENT_BITS) - 1),
            },
            None => {
                let Full {
                    normal,
                    object,
                    events,
                } = self.full[(mark & !FULL) as usize];
                Arrival {
                    flux,
                    normal,
                    object,
                    events,
                }
            }
        }
    }

    /// The photons in order.
    pub fn iter(&self) -> impl Iterator<Item = Arrival> + '_ {
        (0..self.len()).map(|number| self.get(number))
    }

    /// Lists of the same lights and objects, one after the other.
    pub(super) fn join(&self, lists: &[&Self]) -> Self {
        let mut before = Vec::with_capacity(lists.len());
        let mut full = Vec::new();
        for list in lists {
            before.push(full.len() as u32);
            full.extend_from_slice(&list.full);
        }
        let moved = |part: usize, packed: Packed| match packed.mark & FULL {
            0 => packed,
            _ => Packed {
                mark: packed.mark + before[part],
                ..packed
            },
        };
        let packed: Vec<&[Packed]> = lists.iter().map(|list| &*list.packed).collect();
        Self {
            packed: joined(&packed, moved),
            full,
            ..self.emptied()
        }
    }

    /// Puts at each place the photon that `order` names for it.
    pub(super) fn reorder(&mut self, order: &[u32]) {
        self.packed = order
            .par_iter()
            .with_min_len(1 << 12)
            .map(|&from| self.packed[from as usize])
            .collect();
    }

    /// The mark, without its events, of photons on the side of a flat object to which this unit vector points; none if the object is
    /// not flat.
    pub(super) fn surface(&self, object: u32, towards: DVec3) -> Surface {
        let facing = self.flat.get(object as usize).copied().flatten();
        let along = facing.map_or(0.0, |normal| normal.dot(towards));
        let side = object << 1 | u32::from(along < 0.0);
        Surface(if along == 0.0 { FULL } else { side })
    }

    /// Whether a photon lies on a flat surface, and on this one; `None` if only its normal can tell.
    #[inline(always)]
    pub(super) fn lies_on(&self, photon: u32, surface: Surface) -> Option<bool> {
        let mark = self.packed[photon as usize].mark;
        (mark & FULL == 0).then_some(mark >> EVENT_BITS == surface.0)
    }

    /// Flux (W) and events of a photon that lies on a flat surface.
    #[inline(always)]
    pub(super) fn on_flat(&self, photon: u32) -> (Rgb, u32) {
        let Packed { flux, mark } = self.packed[photon as usize];
        let flux = DVec3::from_array(flux.map(f64::from)) * self.unit;
        (flux, mark & ((1 << EVENT_BITS) - 1))
    }
}

/// Photons whose fluxes are kept in watts.
impl FromIterator<Arrival> for Arrivals {
    fn from_iter<I: IntoIterator<Item = Arrival>>(photons: I) -> Self {
        let mut arrivals = Self::default();
        for photon in photons {
            arrivals.push(&photon);
        }
        arrivals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_floors() -> Arrivals {
        Arrivals {
            flat: [Some(DVec3::Y), None, Some(DVec3::Y)].into(),
            unit: Rgb::new(3.0, 0.7, 1e300),
            ..Arrivals::default()
        }
    }

    fn photons() -> Vec<Arrival> {
        let tilted = DVec3::new(0.6, 0.8, 0.0);
        let on = |object, normal, events| Arrival {
            flux: Rgb::new(3.0, 0.7 * 0.25, 0.0),
            normal,
            object,
            events,
        };
        vec![
            on(0, DVec3::Y, 0),
            on(0, DVec3::NEG_Y, 3),
            on(1, tilted, 2),
            on(2, DVec3::Y, 255),
            on(2, DVec3::NEG_Y, 256),
            on(1, -tilted, 70_000),
            // Beyond the objects known, and beyond what a mark can hold.
            on(1 << 30, DVec3::Y, 1),
        ]
    }

    #[test]
    fn photons_come_back_as_they_were() {
        let mut arrivals = two_floors();
        for photon in &photons() {
            arrivals.push(photon);
        }
        assert_eq!(arrivals.iter().collect::<Vec<_>>(), photons());
        let plain: Arrivals = arrivals.iter().collect();
        for (got, photon) in plain.iter().zip(photons()) {
            let error = (got.flux - photon.flux).abs().max_element();
            assert!(error < 1e-7 && got.normal == photon.normal);
        }
    }

    #[test]
    fn joined_and_reordered_lists_keep_every_photon_whole() {
        let mut parts = vec![two_floors(); 3];
        for (number, photon) in photons().iter().enumerate() {
            parts[number / 3].push(photon);
        }
        let parts: Vec<&Arrivals> = parts.iter().collect();
        let mut joined = two_floors().join(&parts);
        assert_eq!(joined.iter().collect::<Vec<_>>(), photons());
        joined.reorder(&[6, 5, 4, 3, 2, 1, 0]);
        let backwards: Vec<Arrival> = photons().into_iter().rev().collect();
        assert_eq!(joined.iter().collect::<Vec<_>>(), backwards);
    }

    /// Light of 1e300 W overflows nothing, and a photon is sixteen bytes.
    #[test]
    fn flux_is_kept_in_units_of_the_power_in_few_bytes() {
        let mut arrivals = two_floors();
        let photon = Arrival {
            flux: Rgb::new(3.0, 0.7, 1e300) / 3.0,
            ..photons()[0]
        };
        arrivals.push(&photon);
        let got = arrivals.get(0).flux;
        assert!(((got - photon.flux) / photon.flux).abs().max_element() < 6e-8);
        assert_eq!(BYTES, 16);
    }
}
