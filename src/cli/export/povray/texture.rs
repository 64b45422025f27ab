//! Pigments and finishes.

use super::super::{Export, number};
use super::{color, matrix};
use crate::geometry::planar::tangents;
use crate::geometry::shape::Shape;
use crate::image::png;
use crate::scene::Rgb;
use crate::scene::material::{Material, Pattern};
use crate::scene::texture::{Texture, srgb_to_linear};
use anyhow::bail;
use glam::DVec2;
use std::sync::Arc;

/// The pictures written so far; their names are their places.
#[derive(Debug, Default)]
pub(super) struct Textures(Vec<Arc<Texture>>);

impl Textures {
    /// `texture { … }` of a material, without glass; `glow` is the radiance of a side that emits.
    pub(super) fn texture(
        &mut self,
        shape: &Shape,
        material: &Material,
        glow: Option<Rgb>,
        export: &mut Export,
    ) -> anyhow::Result<String> {
        let reflection = material.mirror.map_or(String::new(), |mirror| {
            format!(" reflection {{ {} }}", color(mirror))
        });
        let (pigment, finish) = match (&material.diffuse, glow) {
            (None, None) => ("rgb 0".to_owned(), String::new()),
            (Some(pattern), None) => (
                self.pigment(shape, pattern, export)?,
                " diffuse 1".to_owned(),
            ),
            (None, Some(glow)) => (color(glow), " emission 1".to_owned()),
            (Some(Pattern::Constant(below)), Some(glow)) => {
                // Their emission is a factor on the pigment.
                let factor = |i: usize| {
                    if glow[i] == 0.0 {
                        0.0
                    } else {
                        glow[i] / below[i]
                    }
                };
                let factor = Rgb::new(factor(0), factor(1), factor(2));
                if !factor.is_finite() {
                    bail!(
                        "POV-Ray cannot say emission in a channel that reflects nothing, beside others that do"
                    );
                }
                (
                    color(*below),
                    format!(" diffuse 1 emission {}", color(factor)),
                )
            }
            (Some(_), Some(_)) => {
                bail!("POV-Ray cannot say emission beside a checker or a texture")
            }
        };
        Ok(format!(
            "texture {{ pigment {{ {pigment} }} finish {{{finish}{reflection} }} }}"
        ))
    }

    fn pigment(
        &mut self,
        shape: &Shape,
        pattern: &Pattern,
        export: &mut Export,
    ) -> anyhow::Result<String> {
        // From the pattern's own unit to texture coordinates. A checker is one of cubes: the surface lies in their middle.
        let (words, scale) = match pattern {
            Pattern::Constant(reflectance) => return Ok(color(*reflectance)),
            Pattern::Checker { colors, repeat } => (
                format!(
                    "checker {} {} translate <0, 0, -0.5>",
                    color(colors[0]),
                    color(colors[1])
                ),
                DVec2::ONE / (2.0 * *repeat),
            ),
            Pattern::Texture { texture, repeat } => (
                format!(
                    "image_map {{ png \"{}\" gamma srgb interpolate 2 }}",
                    self.picture(texture, export)?
                ),
                DVec2::ONE / *repeat,
            ),
        };
        let words = format!(
            "{words} scale <{}, {}, 1>",
            number(scale.x),
            number(scale.y)
        );
        Ok(match shape {
            // Their u of a sphere is a quarter less our s.
            Shape::Sphere(_) => {
                format!(
                    "uv_mapping {words} warp {{ repeat x }} scale <-1, 1, 1> translate <0.25, 0, 0>"
                )
            }
            Shape::Revolution(_) => format!("uv_mapping {words}"),
            Shape::Quad(quad) => {
                let axes = [quad.edge_u, quad.edge_v, quad.normal(), quad.corner];
                format!("{words} {}", matrix(axes))
            }
            Shape::Plane(plane) => {
                let (s_axis, t_axis) = tangents(plane.normal);
                let axes = [s_axis, t_axis, plane.normal, plane.point];
                format!("{words} {}", matrix(axes))
            }
            Shape::Disc(disc) => {
                let (s_axis, t_axis) = tangents(disc.normal);
                let (s_axis, t_axis) = (2.0 * disc.radius * s_axis, 2.0 * disc.radius * t_axis);
                let corner = disc.center - 0.5 * (s_axis + t_axis);
                format!("{words} {}", matrix([s_axis, t_axis, disc.normal, corner]))
            }
        })
    }

    /// The name of the PNG file of a picture.
    fn picture(&mut self, texture: &Arc<Texture>, export: &mut Export) -> anyhow::Result<String> {
        let known = self.0.iter().position(|other| Arc::ptr_eq(other, texture));
        let name = format!("texture-{}.png", known.unwrap_or(self.0.len()));
        if known.is_some() {
            return Ok(name);
        }
        let values = texture.texels.as_flattened();
        let bytes: Vec<u8> = values
            .iter()
            .map(|&x| png::srgb_byte(f64::from(x)))
            .collect();
        let same = |(&x, &byte): (&f32, &u8)| srgb_to_linear(f64::from(byte) / 255.0) as f32 == x;
        if !values.iter().zip(&bytes).all(same) {
            export.note(format!("{name}: 16 bits a channel were rounded to 8"));
        }
        let file = png::encode_bytes(texture.width, texture.height, &bytes, "a texture")
            .map_err(anyhow::Error::msg)?;
        export.files.push((name.clone(), file));
        self.0.push(Arc::clone(texture));
        Ok(name)
    }
}
