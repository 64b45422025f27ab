//! Parts of a render: the sums of some of its passes in a file of their own, to be joined into the picture of all.
//!
//! As sums do not depend on order or splits ([`crate::numeric::sum`]), any parts that hold every pass once give the bits of an
//! unbroken render. A part file describes itself:
//!
//! ```text
//! photolathe part 2⏎
//! length of the header, 8 bytes, little-endian
//! header, JSON: what decides the picture, the passes first..end, width, height
//! pixels, row by row from the top, 168 bytes each: limbs and places of six sums, samples, bad samples
//! BLAKE3 of all before, 32 bytes
//! ```

use super::ImageError;
use super::file::write_atomically;
use super::picture::Origin;
use crate::render::film::{Film, Pixel};
use crate::scene::{FilmSize, MAX_PIXELS};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::Path;

const MAGIC: &[u8] = b"photolathe part 2\n";
const CHECKSUM: usize = blake3::OUT_LEN;

/// Some passes of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What decides the picture besides the passes done.
    pub origin: Origin,
    /// The passes.
    pub passes: Range<u64>,
    /// Their samples.
    pub film: Film,
}

#[derive(Serialize, Deserialize)]
struct Header {
    origin: Origin,
    passes: Range<u64>,
    width: u32,
    height: u32,
}

impl Part {
    /// Writes the part, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        write_atomically(path, &self.encode()).map_err(|reason| ImageError::File {
            path: path.to_owned(),
            reason,
        })
    }

    /// Reads a part.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path).map_err(|reason| ImageError::File {
            path: path.to_owned(),
            reason,
        })?;
        Self::decode(&bytes).map_err(|reason| ImageError::bad(path, reason))
    }

    fn encode(&self) -> Vec<u8> {
        let size = self.film.size();
        let header = Header {
            origin: self.origin.clone(),
            passes: self.passes.clone(),
            width: size.width,
            height: size.height,
        };
        let header = serde_json::to_vec(&header).expect("a header is plain numbers and words");
        let mut bytes = MAGIC.to_vec();
        bytes.extend((header.len() as u64).to_le_bytes());
        bytes.extend(header);
        for pixel in self.film.pixels() {
            pixel.write(&mut bytes);
        }
        let checksum = blake3::hash(&bytes);
        bytes.extend(checksum.as_bytes());
        bytes
    }

    fn decode(bytes: &[u8]) -> Result<Self, String> {
        if !bytes.starts_with(MAGIC) {
            return Err(
                "not a part of a render, or one of another version of the format".to_owned(),
            );
        }
        let broken = || "the part is incomplete or damaged: its checksum is not that of its bytes";
        let end = bytes.len().checked_sub(CHECKSUM).ok_or_else(broken)?;
        let (bytes, checksum) = bytes.split_at(end);
        if blake3::hash(bytes).as_bytes() != checksum {
            return Err(broken().to_owned());
        }
        Self::decode_whole(&bytes[MAGIC.len()..]).ok_or_else(|| "not a readable part".to_owned())
    }

    fn decode_whole(bytes: &[u8]) -> Option<Self> {
        let (length, rest) = bytes.split_at_checked(8)?;
        let length = u64::from_le_bytes(length.try_into().ok()?);
        let (header, pixels) = rest.split_at_checked(usize::try_from(length).ok()?)?;
        let header: Header = serde_json::from_slice(header).ok()?;
        let count = u64::from(header.width) * u64::from(header.height);
        let fits = (1..=MAX_PIXELS).contains(&count)
            && pixels.len() as u64 == count * Pixel::BYTES as u64
            && !header.passes.is_empty();
        if !fits {
            return None;
        }
        let mut film = Film::new(FilmSize {
            width: header.width,
            height: header.height,
        });
        let read = pixels.chunks_exact(Pixel::BYTES).map(Pixel::read);
        for (pixel, read) in film.pixels_mut().iter_mut().zip(read) {
            *pixel = read?;
        }
        Some(Self {
            origin: header.origin,
            passes: header.passes,
            film,
        })
    }
}

/// Parts joined one by one.
#[derive(Debug, Default)]
pub struct Merged {
    whole: Option<Part>,
    /// The passes of each part, with its name.
    joined: Vec<(Range<u64>, String)>,
}

impl Merged {
    /// Adds a part; `name` is what errors call it.
    ///
    /// # Errors
    /// If it belongs to another picture than those before.
    pub fn add(&mut self, part: Part, name: &str) -> Result<(), String> {
        self.joined.push((part.passes.clone(), name.to_owned()));
        let Some(whole) = &mut self.whole else {
            self.whole = Some(part);
            return Ok(());
        };
        let difference = if part.film.size() != whole.film.size() {
            Some("the size differs".to_owned())
        } else {
            part.origin.difference(&whole.origin)
        };
        if let Some(difference) = difference {
            let first = &self.joined[0].1;
            return Err(format!(
                "{name} and {first} are not parts of one picture: {difference}"
            ));
        }
        whole.film.join(&part.film);
        Ok(())
    }

    /// The whole: the first n passes of the render, each of them once.
    ///
    /// # Errors
    /// If passes are missing or there twice, or if there is no part.
    pub fn finish(mut self) -> Result<Part, String> {
        let Some(mut whole) = self.whole else {
            return Err("there are no parts to join".to_owned());
        };
        self.joined.sort_by_key(|(passes, _)| passes.start);
        let (mut end, mut before) = (0, None);
        for (passes, name) in &self.joined {
            let Range { start, end: last } = *passes;
            if start > end {
                return Err(format!(
                    "passes {end}..{start} are missing: {name} holds {start}..{last}"
                ));
            }
            if let Some(before) = before.filter(|_| start < end) {
                return Err(format!(
                    "{before} and {name} both hold pass {start}: each pass counts once"
                ));
            }
            (end, before) = (last, Some(name));
        }
        whole.passes = 0..end;
        whole.origin.settings.passes = end;
        Ok(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::picture::Picture;
    use crate::render::settings::Settings;
    use crate::scene::Rgb;
    use crate::scene::options::RenderTable;

    fn part(passes: Range<u64>, seed: u64) -> Part {
        let mut film = Film::new(FilmSize {
            width: 2,
            height: 1,
        });
        for pass in passes.clone() {
            film.pixels_mut()[0].add(Rgb::splat(0.1 + pass as f64));
        }
        let settings = Settings::resolve(&RenderTable {
            seed: Some(seed),
            ..RenderTable::default()
        });
        Part {
            origin: Origin {
                program_version: "1".to_owned(),
                program_source: "f00d".to_owned(),
                scene_hash: "abc".to_owned(),
                solver: "S".to_owned(),
                settings,
            },
            passes,
            film,
        }
    }

    fn merged(parts: &[Part]) -> Result<Part, String> {
        let mut merged = Merged::default();
        for (index, part) in parts.iter().enumerate() {
            merged.add(part.clone(), &format!("part {index}"))?;
        }
        merged.finish()
    }

    #[test]
    fn a_part_comes_back_from_its_bytes_and_not_one_byte_may_differ() {
        let part = part(3..7, 1);
        let bytes = part.encode();
        assert_eq!(Part::decode(&bytes).as_ref(), Ok(&part));
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1;
            assert!(Part::decode(&wrong).is_err() && Part::decode(&bytes[..at]).is_err());
        }
        // Lies with a right checksum.
        let sealed = |body: &[u8]| [body, blake3::hash(body).as_bytes()].concat();
        let body = &bytes[..bytes.len() - CHECKSUM];
        assert!(Part::decode(&sealed(body)).is_ok());
        assert!(Part::decode(&sealed(&body[..body.len() - 1])).is_err());
        assert!(Part::decode(&sealed(MAGIC)).is_err());
        let huge = [MAGIC, &u64::MAX.to_le_bytes(), b"{}"].concat();
        assert!(Part::decode(&sealed(&huge)).is_err());
    }

    #[test]
    fn parts_in_any_order_give_the_whole() {
        let whole = merged(&[part(0..9, 1)]).expect("a whole");
        assert_eq!(whole.origin.settings.passes, 9);
        let split = merged(&[part(4..9, 1), part(0..1, 1), part(1..4, 1)]);
        assert_eq!(split.as_ref(), Ok(&whole));
        assert_eq!(split.map(|part| part.passes), Ok(0..9));
    }

    #[test]
    fn a_part_names_the_sources_of_its_program_and_a_picture_does_not() {
        let part = part(0..1, 1);
        let fingerprint = |bytes: &[u8]| bytes.windows(4).any(|four| four == b"f00d");
        assert!(fingerprint(&part.encode()));
        let picture = Picture::of_film(&part.film).described(&part.origin, 1);
        assert!(
            picture
                .attributes
                .values()
                .all(|text| !text.contains("f00d"))
        );
    }

    #[test]
    fn gaps_overlaps_and_strangers_are_refused() {
        let refused = |parts: &[Part], words: &str| {
            let fault = merged(parts).expect_err("refused");
            assert!(fault.contains(words), "{fault}");
        };
        refused(&[], "no parts");
        refused(&[part(1..4, 1)], "passes 0..1 are missing");
        refused(&[part(0..2, 1), part(3..4, 1)], "passes 2..3 are missing");
        refused(
            &[part(0..3, 1), part(2..4, 1)],
            "part 0 and part 1 both hold pass 2",
        );
        refused(&[part(0..3, 1), part(0..3, 1)], "both hold pass 0");
        refused(&[part(0..3, 1), part(3..4, 2)], "seed differs: 2 against 1");
        let mut other = part(3..4, 1);
        other.origin.scene_hash = "abd".to_owned();
        refused(&[part(0..3, 1), other], "scene_hash differs");
        let mut other = part(3..4, 1);
        other.origin.program_source = "beef".to_owned();
        refused(
            &[part(0..3, 1), other],
            "program_source differs: beef against f00d",
        );
        let mut other = part(3..4, 1);
        other.origin.settings.passes = 5;
        assert!(merged(&[part(0..3, 1), other]).is_ok());
    }
}
