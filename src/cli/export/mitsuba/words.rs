//! The elements that the scene is made of.

use super::super::number;
use super::place::Coordinates;
use crate::scene::Rgb;
use glam::{DVec2, DVec3};

pub(super) fn diffuse(reflectance: &str) -> String {
    format!("<bsdf type=\"diffuse\">{reflectance}</bsdf>")
}

/// A mirror that reflects all of this share at every angle.
pub(super) fn conductor(reflectance: Rgb) -> String {
    let share = rgb("specular_reflectance", reflectance);
    format!("<bsdf type=\"conductor\"><string name=\"material\" value=\"none\"/>{share}</bsdf>")
}

pub(super) fn to_world(columns: [DVec3; 4]) -> String {
    let rows = (0..3).map(|i| columns.map(|column| number(column[i])).join(" "));
    let rows: Vec<String> = rows.collect();
    format!(
        "<transform name=\"to_world\"><matrix value=\"{} 0 0 0 1\"/></transform>",
        rows.join(" ")
    )
}

/// From their texture coordinates to ours, times the repetitions.
pub(super) fn to_uv(coordinates: Coordinates, repeat: DVec2) -> String {
    let scale = coordinates.scale * repeat;
    let offset = coordinates.offset * repeat;
    format!(
        "<transform name=\"to_uv\"><scale x=\"{}\" y=\"{}\"/><translate x=\"{}\" y=\"{}\"/></transform>",
        number(scale.x),
        number(scale.y),
        number(offset.x),
        number(offset.y)
    )
}

pub(super) fn float(name: &str, x: f64) -> String {
    format!("<float name=\"{name}\" value=\"{}\"/>", number(x))
}

pub(super) fn rgb(name: &str, color: Rgb) -> String {
    format!("<rgb name=\"{name}\" value=\"{}\"/>", list(color))
}

pub(super) fn list(v: DVec3) -> String {
    v.to_array().map(number).join(", ")
}

/// Text that may stand in an XML comment: no control characters, no two hyphens in a row, none at the end.
pub(super) fn comment(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars() {
        if c == '-' && safe.ends_with('-') {
            safe.push(' ');
        }
        safe.push(if c.is_control() { ' ' } else { c });
    }
    if safe.ends_with('-') {
        safe.push(' ');
    }
    safe
}
