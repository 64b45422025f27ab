//! OpenEXR in and out.
//!
//! Written: scanlines, ZIP, float32 linear `R`, `G`, `B`, with `variance.R`, `variance.G`, `variance.B` (of the mean) and
//! `samples` where the picture has them, feature channels (float32, or uint32 for bits), and its text attributes. Equal pictures give equal bytes: blocks are compressed one
//! after the other, and the header's attributes, which the codec keeps in a hash map, are put in the order of their names.
//!
//! Read: any flat scanline or tiled file whose first layer has `R`, `G` and `B` in half, float or integer samples without
//! subsampling. Alpha and other channels are left out, and the position of the data window is ignored.

use super::ImageError;
use super::file::write_atomically;
use super::picture::Picture;
use crate::render::features::{Channel, Values};
use crate::scene::MAX_PIXELS;
use ::exr::meta::MetaData;
use ::exr::meta::attribute::AttributeValue;
use ::exr::prelude::*;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// A flat pixel of a compressed file may cost almost nothing. No codec of the format shrinks more than about a thousand
/// times; a header that claims more than this factor, and a floor for tiny files, is refused before memory is taken for it.
const MAX_COMPRESSION: u64 = 4096;
const FLOOR_BYTES: u64 = 1 << 20;
const MAX_CHANNELS: usize = 1024;
const MAX_ATTRIBUTE_BYTES: usize = 1 << 20;

/// Writes a picture, whole or not at all.
pub fn write(picture: &Picture, path: &Path) -> std::result::Result<(), ImageError> {
    let bytes = encode(picture).map_err(|reason| ImageError::bad(path, reason))?;
    write_atomically(path, &bytes).map_err(|reason| ImageError::File {
        path: path.to_owned(),
        reason,
    })
}

/// Reads a picture.
pub fn read(path: &Path) -> std::result::Result<Picture, ImageError> {
    let bytes = std::fs::read(path).map_err(|reason| ImageError::File {
        path: path.to_owned(),
        reason,
    })?;
    decode(&bytes).map_err(|reason| ImageError::bad(path, reason))
}

/// The bytes of the EXR file of a picture.
///
/// Fails if the picture is empty, if its vectors do not fit its size, or if an attribute is not Latin-1 text below 1 MiB.
pub fn encode(picture: &Picture) -> std::result::Result<Vec<u8>, String> {
    let size = Vec2(picture.width, picture.height);
    let count = picture.width * picture.height;
    let fits = picture.rgb.len() == count
        && picture.variance.as_ref().is_none_or(|v| v.len() == count)
        && picture.samples.as_ref().is_none_or(|v| v.len() == count)
        && (picture.features.iter()).all(|feature| feature.values.len() == count);
    if count == 0 || !fits {
        return Err("the picture has no pixels, or not as many as its size says".to_owned());
    }
    let channel = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
    let mut channels = SmallVec::new();
    for (index, name) in ["R", "G", "B"].iter().enumerate() {
        channels.push(channel(name, plane(&picture.rgb, index)));
        if let Some(variance) = &picture.variance {
            channels.push(channel(&format!("variance.{name}"), plane(variance, index)));
        }
    }
    if let Some(samples) = &picture.samples {
        channels.push(channel("samples", samples.clone()));
    }
    for Channel { name, values } in &picture.features {
        let samples = match values {
            Values::Float(values) => FlatSamples::F32(values.clone()),
            Values::Whole(values) => FlatSamples::U32(values.clone()),
        };
        channels.push(AnyChannel::new(*name, samples));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(channels),
    );
    let mut image = Image::from_layer(layer);
    for (name, value) in &picture.attributes {
        let text = |text: &str| {
            Text::new_or_none(text)
                .filter(|_| text.len() <= MAX_ATTRIBUTE_BYTES)
                .ok_or_else(|| format!("attribute {name:?} is not Latin-1 text below 1 MiB"))
        };
        let value = AttributeValue::Text(text(value)?);
        image.attributes.other.insert(text(name)?, value);
    }
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|error| error.to_string())?;
    let mut bytes = bytes.into_inner();
    sort_header(&mut bytes).ok_or("the codec wrote a header that cannot be read back")?;
    Ok(bytes)
}

fn plane(pixels: &[[f32; 3]], index: usize) -> Vec<f32> {
    pixels.iter().map(|pixel| pixel[index]).collect()
}

/// Puts the attributes of a single-part header in the order of their names. Each is `name 0 type 0 length value`; the header
/// starts after magic number and version (8 bytes) and ends with an empty name. Its length, and so every offset of the file,
/// stays. `None` if the bytes are not such a header.
fn sort_header(bytes: &mut [u8]) -> Option<()> {
    const START: usize = 8;
    let text_end = |from: usize| Some(from + bytes.get(from..)?.iter().position(|&b| b == 0)?);
    let mut attributes = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let name_end = text_end(at)?;
        let type_end = text_end(name_end + 1)?;
        let length = bytes.get(type_end + 1..type_end + 5)?;
        let length = u32::from_le_bytes(length.try_into().ok()?) as usize;
        let end = type_end + 5 + length;
        attributes.push((bytes.get(at..name_end)?, bytes.get(at..end)?));
        at = end;
    }
    attributes.sort_unstable();
    let sorted: Vec<u8> = attributes
        .iter()
        .flat_map(|(_, all)| *all)
        .copied()
        .collect();
    bytes[START..at].copy_from_slice(&sorted);
    Some(())
}

/// The picture in the bytes of an EXR file. Never allocates more than about 4096 times the length of `bytes`.
pub fn decode(bytes: &[u8]) -> std::result::Result<Picture, String> {
    check_claims(bytes)?;
    let image = read_first_layer(bytes)?;
    let layer = image.layer_data;
    let (width, height) = (layer.size.0, layer.size.1);
    let mut planes: BTreeMap<String, Vec<f32>> = BTreeMap::new();
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        if channel.sampling == Vec2(1, 1) && is_ours(&name) {
            planes.insert(name, channel.sample_data.values_as_f32().collect());
        }
    }
    let mut rgb_of = |prefix: &str| {
        let mut next = |name: &str| planes.remove(&format!("{prefix}{name}"));
        let (red, green, blue) = (next("R")?, next("G")?, next("B")?);
        let pixels = red.into_iter().zip(green).zip(blue);
        Some(pixels.map(|((r, g), b)| [r, g, b]).collect::<Vec<_>>())
    };
    let rgb = rgb_of("").ok_or("no full-size channels R, G and B in the first layer")?;
    let variance = rgb_of("variance.");
    let samples = planes.remove("samples");
    let attributes = image
        .attributes
        .other
        .into_iter()
        .chain(layer.attributes.other)
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            _ => None,
        })
        .collect();
    Ok(Picture {
        width,
        height,
        rgb,
        variance,
        samples,
        features: Vec::new(),
        attributes,
    })
}

fn is_ours(name: &str) -> bool {
    let colour = name.strip_prefix("variance.").unwrap_or(name);
    matches!(colour, "R" | "G" | "B") || name == "samples"
}

fn read_first_layer(
    bytes: &[u8],
) -> std::result::Result<Image<Layer<AnyChannels<FlatSamples>>>, String> {
    ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())
}

/// Refuses a header that asks for more memory than its file can fill.
fn check_claims(bytes: &[u8]) -> std::result::Result<(), String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| format!("not a readable EXR file: {error}"))?;
    let budget = (bytes.len() as u64)
        .saturating_mul(MAX_COMPRESSION)
        .saturating_add(FLOOR_BYTES);
    for header in &meta.headers {
        let pixels = (header.layer_size.0 as u64).saturating_mul(header.layer_size.1 as u64);
        let channels = header.channels.list.len();
        if pixels > MAX_PIXELS || channels > MAX_CHANNELS {
            return Err(format!(
                "{} x {} pixels in {channels} channels are more than this program reads ({MAX_PIXELS} pixels, {MAX_CHANNELS} channels)",
                header.layer_size.0, header.layer_size.1,
            ));
        }
        if pixels * 4 * channels as u64 > budget {
            return Err(format!(
                "the header claims {} x {} pixels, far more than {} bytes of file can hold",
                header.layer_size.0,
                header.layer_size.1,
                bytes.len(),
            ));
        }
    }
    Ok(())
}
