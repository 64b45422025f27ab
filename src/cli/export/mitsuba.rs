//! `scene.xml` for Mitsuba 3.

mod place;
mod words;

use super::mesh::Mesh;
use super::{Export, extent, focus_distance, number};
use crate::geometry::planar::{Plane, tangents};
use crate::geometry::shape::Shape;
use crate::image::exr;
use crate::image::picture::Picture;
use crate::numeric::work::Work;
use crate::scene::light::Light;
use crate::scene::material::{Emission, Material, Pattern, Side};
use crate::scene::texture::Texture;
use crate::scene::{Object, Rgb, Scene};
use anyhow::{Context, bail};
use glam::DVec2;
use place::{
    Coordinates, FACES_APART, disc_place, faces_apart, is_rectangle, rectangle_place, sphere_place,
};
use std::fmt::Write as _;
use std::sync::Arc;
use words::{comment, conductor, diffuse, float, list, rgb, to_uv, to_world};

/// Half the side of the square that stands for a plane, in diagonals of the box of everything else.
const PLANE_FACTOR: f64 = 1000.0;

/// The scene for Mitsuba 3; `mesh_error` is the greatest error of meshes as a share of the object's size.
///
/// # Errors
/// What Mitsuba cannot say, named with its object or material.
pub(super) fn export(scene: &Scene, mesh_error: f64) -> anyhow::Result<Export> {
    let mut writer = Writer {
        scene,
        mesh_error,
        size: (extent(scene).max - extent(scene).min).length(),
        body: String::new(),
        export: Export::default(),
        textures: Vec::new(),
    };
    writer.frame()?;
    for light in scene.lights.all() {
        writer.light(light)?;
    }
    for (index, object) in scene.objects.iter().enumerate() {
        writer.object(index, object)?;
    }
    Ok(writer.finish())
}

struct Writer<'a> {
    scene: &'a Scene,
    mesh_error: f64,
    /// Diagonal of the box of everything that has a place.
    size: f64,
    body: String,
    export: Export,
    /// Textures written so far, with the factor on their texels; their names are their places.
    textures: Vec<(Arc<Texture>, f64)>,
}

impl Writer<'_> {
    /// Integrator, camera, film and background.
    fn frame(&mut self) -> anyhow::Result<()> {
        let scene = self.scene;
        let absorbs = |material: &Material| {
            material
                .dielectric
                .is_some_and(|glass| glass.absorption != Rgb::ZERO)
        };
        let mut work = Work::default();
        let around_eye = scene.medium_at(scene.camera.eye(), &mut work);
        if let Some(object) = around_eye
            && absorbs(&scene.materials[scene.objects[object].material])
        {
            let name = &scene.objects[object].name;
            bail!("the camera stands inside {name}, which absorbs: the export cannot say so");
        }
        let integrator = if scene.materials.iter().any(absorbs) {
            self.export.note(
                "absorption is written as a homogeneous medium of albedo 0 for the integrator volpath: the same mean, more noise",
            );
            "volpath"
        } else {
            "path"
        };
        // Their depth counts segments, ours scattering events between them.
        let depth = scene
            .render
            .max_depth
            .map_or(-1, |depth| i64::from(depth) + 1);
        writeln!(
            self.body,
            "  <default name=\"spp\" value=\"64\"/>\n  \
             <integrator type=\"{integrator}\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>"
        )?;
        self.camera()?;
        if scene.background != Rgb::ZERO {
            let radiance = rgb("radiance", scene.background);
            writeln!(
                self.body,
                "  <emitter type=\"constant\">{radiance}</emitter>"
            )?;
        }
        Ok(())
    }

    fn camera(&mut self) -> anyhow::Result<()> {
        let camera = &self.scene.camera;
        let film = self.scene.film;
        let [_, up, forward] = camera.frame();
        let fov = 2.0 * libm::atan(camera.tan_half_fov()).to_degrees();
        let lens = if camera.lens_radius() > 0.0 {
            "thinlens"
        } else {
            "perspective"
        };
        let out = &mut self.body;
        writeln!(out, "  <sensor type=\"{lens}\">")?;
        writeln!(out, "    <string name=\"fov_axis\" value=\"y\"/>")?;
        writeln!(out, "    {}", float("fov", fov))?;
        // Nothing nearer or farther than these is seen: they must not matter.
        writeln!(out, "    {}", float("near_clip", 1e-5 * self.size))?;
        writeln!(
            out,
            "    {}",
            float("far_clip", 10.0 * PLANE_FACTOR * self.size)
        )?;
        if camera.lens_radius() > 0.0 {
            writeln!(
                out,
                "    {}",
                float("aperture_radius", camera.lens_radius())
            )?;
            let distance = focus_distance(self.scene);
            writeln!(out, "    {}", float("focus_distance", distance))?;
        }
        writeln!(
            out,
            "    <transform name=\"to_world\"><lookat origin=\"{}\" target=\"{}\" up=\"{}\"/></transform>",
            list(camera.eye()),
            list(camera.eye() + forward),
            list(up)
        )?;
        writeln!(
            out,
            "    <sampler type=\"independent\"><integer name=\"sample_count\" value=\"$spp\"/></sampler>\n    \
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/><integer name=\"height\" value=\"{}\"/>\
             <rfilter type=\"box\"/><string name=\"pixel_format\" value=\"rgb\"/>\
             <string name=\"component_format\" value=\"float32\"/></film>\n  </sensor>",
            film.width, film.height
        )?;
        Ok(())
    }

    fn light(&mut self, light: &Light) -> anyhow::Result<()> {
        match light {
            Light::Point {
                position,
                intensity,
            } => {
                writeln!(
                    self.body,
                    "  <emitter type=\"point\"><point name=\"position\" value=\"{}\"/>{}</emitter>",
                    list(*position),
                    rgb("intensity", *intensity)
                )?;
                Ok(())
            }
            Light::Beam { .. } => bail!(
                "a beam of finite width is no emitter that Mitsuba's path tracer can find: expected point or area lights"
            ),
            Light::Area { .. } => Ok(()),
        }
    }

    fn object(&mut self, index: usize, object: &Object) -> anyhow::Result<()> {
        let material = &self.scene.materials[object.material];
        writeln!(self.body, "\n  <!-- {} -->", comment(&object.name))?;
        if matches!(object.shape, Shape::Sphere(_))
            && material
                .emission
                .is_some_and(|emission| emission.side != Side::Front)
        {
            // Measured with 3.9.1 in the furnace: emitter or BSDF sampling alone give 1.5, both together 1.51.
            self.export.note(format!(
                "{}: Mitsuba 3.9 counts the reflected light of a ball that shines inward about 2 % too high",
                object.name
            ));
        }
        match material.emission {
            Some(emission) if emission.side == Side::Both => {
                self.export.note(format!(
                    "{}: it emits on both sides, and is written as two faces {} of its size apart",
                    object.name,
                    number(FACES_APART)
                ));
                let [front, back] = faces_apart(&object.shape);
                for (shape, side) in [(front, Side::Front), (back, Side::Back)] {
                    let one_sided = Some(Emission { side, ..emission });
                    self.shape(index, object, &shape, material, one_sided)?;
                }
                Ok(())
            }
            emission => self.shape(index, object, &object.shape, material, emission),
        }
    }

    /// One shape with its material.
    fn shape(
        &mut self,
        index: usize,
        object: &Object,
        shape: &Shape,
        material: &Material,
        emission: Option<Emission>,
    ) -> anyhow::Result<()> {
        let patterned = matches!(
            material.diffuse,
            Some(Pattern::Checker { .. } | Pattern::Texture { .. })
        );
        let (kind, place, coordinates) = match shape {
            Shape::Revolution(revolution) => {
                let mesh = Mesh::of_revolution(revolution, self.mesh_error)
                    .with_context(|| object.name.clone())?;
                self.mesh(index, object, &mesh)
            }
            Shape::Sphere(sphere) => sphere_place(sphere),
            Shape::Quad(quad) if is_rectangle(quad) => rectangle_place(quad),
            Shape::Quad(quad) => self.mesh(index, object, &Mesh::of_quad(quad)),
            Shape::Plane(plane) => self.plane_place(object, plane),
            Shape::Disc(disc) if patterned => {
                self.mesh(index, object, &Mesh::of_disc(disc, self.mesh_error))
            }
            Shape::Disc(disc) => disc_place(disc),
        };
        let scattering = self.scattering(material, coordinates)?;
        let out = &mut self.body;
        writeln!(out, "  <shape type=\"{kind}\">\n    {place}")?;
        if let Some(emission) = emission {
            if emission.side == Side::Back {
                writeln!(out, "    <boolean name=\"flip_normals\" value=\"true\"/>")?;
            }
            let radiance = rgb("radiance", emission.radiance);
            writeln!(out, "    <emitter type=\"area\">{radiance}</emitter>")?;
        }
        writeln!(out, "    {scattering}")?;
        if let Some(glass) = material.dielectric
            && glass.absorption != Rgb::ZERO
        {
            let density = rgb("sigma_t", glass.absorption);
            writeln!(
                out,
                "    <medium type=\"homogeneous\" name=\"interior\">{density}{}</medium>",
                rgb("albedo", Rgb::ZERO)
            )?;
        }
        writeln!(out, "  </shape>")?;
        Ok(())
    }

    fn mesh(
        &mut self,
        index: usize,
        object: &Object,
        mesh: &Mesh,
    ) -> (&'static str, String, Coordinates) {
        let name = format!("object-{index}.ply");
        self.export.note(format!(
            "{}: a mesh of {} triangles in {name}, within {:.3e} of the true surface",
            object.name,
            mesh.triangles.len(),
            mesh.error
        ));
        let place = format!("<string name=\"filename\" value=\"{name}\"/>");
        self.export.files.push((name, mesh.ply()));
        // Mitsuba's PLY reader keeps u and v as they are.
        ("ply", place, Coordinates::OURS)
    }

    fn plane_place(
        &mut self,
        object: &Object,
        plane: &Plane,
    ) -> (&'static str, String, Coordinates) {
        let half = PLANE_FACTOR * self.size;
        self.export.note(format!(
            "{}: the plane ends {} from its point, {PLANE_FACTOR} diagonals of the rest",
            object.name,
            number(half)
        ));
        let (s_axis, t_axis) = tangents(plane.normal);
        let columns = [half * s_axis, half * t_axis, plane.normal, plane.point];
        let coordinates = Coordinates {
            scale: DVec2::splat(2.0 * half),
            offset: DVec2::splat(-half),
        };
        ("rectangle", to_world(columns), coordinates)
    }

    /// The BSDF of a material.
    fn scattering(
        &mut self,
        material: &Material,
        coordinates: Coordinates,
    ) -> anyhow::Result<String> {
        if let Some(glass) = material.dielectric {
            let outside = float("ext_ior", 1.0);
            let inside = float("int_ior", glass.ior);
            return Ok(format!(
                "<bsdf type=\"dielectric\">{inside}{outside}</bsdf>"
            ));
        }
        let one_sided = match (&material.diffuse, material.mirror) {
            (None, None) => diffuse(&rgb("reflectance", Rgb::ZERO)),
            (Some(pattern), None) => diffuse(&self.pattern(pattern, 1.0, coordinates)?),
            (None, Some(mirror)) => conductor(mirror),
            (Some(pattern), Some(mirror)) => {
                let weight = blend(pattern, mirror).with_context(|| {
                    format!(
                        "material {}: Mitsuba blends diffuse and mirror by one weight w for all channels, \
                         diffuse/(1 − w) and mirror/w at most 1: no such w exists",
                        material.name
                    )
                })?;
                // A part of weight 0 is black.
                let share = |weight: f64| if weight > 0.0 { 1.0 / weight } else { 0.0 };
                let below = self.pattern(pattern, share(1.0 - weight), coordinates)?;
                format!(
                    "<bsdf type=\"blendbsdf\">{}{}{}</bsdf>",
                    float("weight", weight),
                    diffuse(&below),
                    conductor(share(weight) * mirror)
                )
            }
        };
        Ok(format!("<bsdf type=\"twosided\">{one_sided}</bsdf>"))
    }

    /// The reflectance of a pattern times `factor`.
    fn pattern(
        &mut self,
        pattern: &Pattern,
        factor: f64,
        coordinates: Coordinates,
    ) -> anyhow::Result<String> {
        Ok(match pattern {
            Pattern::Constant(color) => rgb("reflectance", factor * *color),
            Pattern::Checker { colors, repeat } => format!(
                "<texture type=\"checkerboard\" name=\"reflectance\">{}{}{}</texture>",
                rgb("color0", factor * colors[0]),
                rgb("color1", factor * colors[1]),
                to_uv(coordinates, *repeat)
            ),
            Pattern::Texture { texture, repeat } => format!(
                "<texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"{}\"/>\
                 <boolean name=\"raw\" value=\"true\"/><string name=\"filter_type\" value=\"bilinear\"/>\
                 <string name=\"wrap_mode\" value=\"repeat\"/>{}</texture>",
                self.texture(texture, factor)?,
                // Their v runs down from the top row of a picture.
                to_uv(coordinates, *repeat * DVec2::new(1.0, -1.0))
            ),
        })
    }

    /// The name of the file of a texture, linear values times `factor`.
    fn texture(&mut self, texture: &Arc<Texture>, factor: f64) -> anyhow::Result<String> {
        let known =
            |(other, by): &(Arc<Texture>, f64)| Arc::ptr_eq(other, texture) && *by == factor;
        let known = self.textures.iter().position(known);
        let index = known.unwrap_or(self.textures.len());
        let name = format!("texture-{index}.exr");
        if known.is_none() {
            let scaled = |texel: &[f32; 3]| texel.map(|x| (factor * f64::from(x)) as f32);
            let picture = Picture {
                width: texture.width,
                height: texture.height,
                rgb: texture.texels.iter().map(scaled).collect(),
                ..Picture::default()
            };
            let bytes = exr::encode(&picture).map_err(anyhow::Error::msg)?;
            self.export.files.push((name.clone(), bytes));
            self.textures.push((Arc::clone(texture), factor));
        }
        Ok(name)
    }

    /// The whole export, with its notes at the top of the file.
    fn finish(mut self) -> Export {
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!--\n");
        let title = comment(&self.scene.title);
        text += &format!("  {title}, written by photolathe for Mitsuba 3.\n");
        text += "  Use an rgb variant (llvm_ad_rgb, scalar_rgb): colours are linear RGB as is, pixels are linear radiance.\n";
        for note in &self.export.notes {
            text += &format!("  Note: {}.\n", comment(note));
        }
        text += "-->\n<scene version=\"3.0.0\">\n";
        text += &self.body;
        text += "</scene>\n";
        self.export
            .files
            .push(("scene.xml".to_owned(), text.into_bytes()));
        self.export
    }
}

/// A weight of the mirror that leaves both parts at most 1: its greatest channel against that of the diffuse part. `None` if
/// there is no such weight.
fn blend(pattern: &Pattern, mirror: Rgb) -> Option<f64> {
    let below = match pattern {
        Pattern::Constant(color) => *color,
        Pattern::Checker { colors, .. } => colors[0].max(colors[1]),
        Pattern::Texture { texture, .. } => texture.largest(),
    }
    .max_element();
    let above = mirror.max_element();
    let sum = above + below;
    if sum == 0.0 {
        return Some(0.0);
    }
    (sum <= 1.0).then_some(above / sum)
}
