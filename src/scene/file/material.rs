//! The `[material.*]` tables and the textures they name.

use super::build::optional;
use super::error::SceneError;
use super::table::{Field, Range, Table};
use crate::scene::Rgb;
use crate::scene::material::{Dielectric, Emission, Material, Pattern, Side};
use crate::scene::texture::{MAX_PNG_BYTES, Texture};
use glam::DVec2;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The textures read so far: each file once.
#[derive(Debug)]
pub(super) struct Textures<'a> {
    directory: &'a Path,
    read: BTreeMap<PathBuf, Arc<Texture>>,
    digests: Vec<blake3::Hash>,
}

impl<'a> Textures<'a> {
    /// No textures yet; relative paths will start at `directory`.
    pub(super) fn new(directory: &'a Path) -> Self {
        Self {
            directory,
            read: BTreeMap::new(),
            digests: Vec::new(),
        }
    }

    /// Digests of the files, in the order of their first use.
    pub(super) fn digests(&self) -> &[blake3::Hash] {
        &self.digests
    }

    fn load(&mut self, field: &Field) -> Result<Arc<Texture>, SceneError> {
        let path = self.directory.join(field.string("the path of a PNG file")?);
        if let Some(texture) = self.read.get(&path) {
            return Ok(Arc::clone(texture));
        }
        let mut bytes = Vec::new();
        File::open(&path)
            .and_then(|file| file.take(MAX_PNG_BYTES + 1).read_to_end(&mut bytes))
            .map_err(|error| {
                field.expected(&format!(
                    "the path of a readable PNG file ({})",
                    error.kind()
                ))
            })?;
        let texture = Texture::from_png(&bytes).map_err(|error| {
            field.expected(&format!("a PNG file that can be a texture ({error})"))
        })?;
        self.digests.push(blake3::hash(&bytes));
        let texture = Arc::new(texture);
        self.read.insert(path, Arc::clone(&texture));
        Ok(texture)
    }
}

/// All materials, in the order of the file.
pub(super) fn materials(
    root: &Table,
    textures: &mut Textures,
) -> Result<Vec<Material>, SceneError> {
    let Some(field) = root.get("material") else {
        return Ok(Vec::new());
    };
    field
        .table("[material]", &[])?
        .fields()
        .map(|(name, field)| material(name, &field, textures))
        .collect()
}

fn material(name: &str, field: &Field, textures: &mut Textures) -> Result<Material, SceneError> {
    let known = ["diffuse", "mirror", "dielectric", "emission"];
    let header = format!("[material.{name}]");
    let table = field.table(&header, &known)?;
    if !known.iter().any(|key| table.get(key).is_some()) {
        return Err(
            table.error("nothing set: expected one of diffuse, mirror, dielectric, emission")
        );
    }
    if let Some(dielectric) = table.get("dielectric")
        && let Some(other) = known
            .iter()
            .find(|&&key| key != "dielectric" && table.get(key).is_some())
    {
        return Err(dielectric.expected(&format!("a dielectric alone, without {other}")));
    }
    let read = |key: &str| table.get(key);
    let material = Material {
        name: name.to_owned(),
        diffuse: read("diffuse")
            .map(|field| diffuse(&field, textures))
            .transpose()?,
        mirror: read("mirror").map(|field| mirror(&field)).transpose()?,
        dielectric: read("dielectric")
            .map(|field| dielectric(&field))
            .transpose()?,
        emission: read("emission").map(|field| emission(&field)).transpose()?,
    };
    if let (Some(pattern), Some(mirror), Some(field)) =
        (&material.diffuse, material.mirror, table.get("mirror"))
        && (largest(pattern) + mirror).max_element() > 1.0
    {
        return Err(field.expected("diffuse and mirror that add to at most 1 in every channel"));
    }
    Ok(material)
}

fn diffuse(field: &Field, textures: &mut Textures) -> Result<Pattern, SceneError> {
    let kinds = ["reflectance", "texture", "checker"];
    let known = ["reflectance", "texture", "checker", "repeat"];
    let table = field.table("diffuse", &known)?;
    let given: Vec<&str> = kinds
        .into_iter()
        .filter(|key| table.get(key).is_some())
        .collect();
    let [kind] = given[..] else {
        return Err(field.expected("exactly one of reflectance, texture, checker"));
    };
    let value = table.require(kind, kind)?;
    let repeat = optional(&table, "repeat", DVec2::ONE, repeat)?;
    match kind {
        "reflectance" => {
            if let Some(repeat) = table.get("repeat") {
                return Err(repeat.expected("repeat only beside texture or checker"));
            }
            Ok(Pattern::Constant(value.color(Range::Share)?))
        }
        "texture" => Ok(Pattern::Texture {
            texture: textures.load(&value)?,
            repeat,
        }),
        _ => {
            let [first, second] = value.items("two colours [[r, g, b], [r, g, b]]")?;
            Ok(Pattern::Checker {
                colors: [first.color(Range::Share)?, second.color(Range::Share)?],
                repeat,
            })
        }
    }
}

fn repeat(field: &Field) -> Result<DVec2, SceneError> {
    let [s, t] = field.items("two numbers [s, t] > 0")?;
    Ok(DVec2::new(
        s.number(Range::Positive)?,
        t.number(Range::Positive)?,
    ))
}

fn mirror(field: &Field) -> Result<Rgb, SceneError> {
    field
        .table("mirror", &["reflectance"])?
        .require("reflectance", "a colour [red, green, blue]")?
        .color(Range::Share)
}

fn dielectric(field: &Field) -> Result<Dielectric, SceneError> {
    let table = field.table("dielectric", &["ior", "absorption"])?;
    Ok(Dielectric {
        ior: table
            .require("ior", "a number > 0")?
            .number(Range::Positive)?,
        absorption: optional(&table, "absorption", Rgb::ZERO, |field| {
            field.color(Range::NotNegative)
        })?,
    })
}

fn emission(field: &Field) -> Result<Emission, SceneError> {
    let table = field.table("emission", &["radiance", "side"])?;
    Ok(Emission {
        radiance: table
            .require("radiance", "a colour [red, green, blue]")?
            .color(Range::NotNegative)?,
        side: optional(&table, "side", Side::Front, |field| {
            Ok(match field.word(&["front", "back", "both"])? {
                0 => Side::Front,
                1 => Side::Back,
                _ => Side::Both,
            })
        })?,
    })
}

/// The largest reflectance anywhere, per channel.
fn largest(pattern: &Pattern) -> Rgb {
    match pattern {
        Pattern::Constant(color) => *color,
        Pattern::Checker { colors, .. } => colors[0].max(colors[1]),
        Pattern::Texture { texture, .. } => texture.largest(),
    }
}
