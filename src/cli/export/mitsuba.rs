//! `scene.xml` for Mitsuba 3.

use super::mesh::Mesh;
use super::{Export, extent, number};
use crate::geometry::planar::{Disc, Plane, Quad, tangents};
use crate::geometry::shape::Shape;
use crate::geometry::sphere::Sphere;
use crate::image::exr;
use crate::image::picture::Picture;
use crate::numeric::work::Work;
use crate::scene::light::Light;
use crate::scene::material::{Emission, Material, Pattern, Side};
use crate::scene::texture::Texture;
use crate::scene::{Object, Rgb, Scene};
use anyhow::{Context, bail};
use glam::{DVec2, DVec3};
use std::fmt::Write as _;
use std::sync::Arc;

/// Half the side of the square that stands for a plane, in diagonals of the box of everything else.
const PLANE_FACTOR: f64 = 1000.0;

/// Distance of the two faces of what emits on both sides, in sizes of the object.
const FACES_APART: f64 = 1e-4;

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

/// Where texture coordinates of Mitsuba's shape stand against ours: ours = scale × theirs + offset.
#[derive(Clone, Copy, Debug)]
struct Coordinates {
    scale: DVec2,
    offset: DVec2,
}

impl Coordinates {
    /// The same.
    const OURS: Self = Self {
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
    };
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
            let distance = camera.focus_distance();
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

/// The two faces of what emits on both sides: the front moved forward, the back backward.
fn faces_apart(shape: &Shape) -> [Shape; 2] {
    let moved = |way: f64| match shape {
        Shape::Quad(quad) => {
            let size = quad.edge_u.length().max(quad.edge_v.length());
            let corner = quad.corner + 0.5 * way * FACES_APART * size * quad.normal();
            Shape::Quad(Quad { corner, ..*quad })
        }
        Shape::Disc(disc) => {
            let center = disc.center + way * FACES_APART * disc.radius * disc.normal;
            Shape::Disc(Disc { center, ..*disc })
        }
        Shape::Sphere(sphere) => {
            let radius = sphere.radius * (1.0 + way * FACES_APART);
            Shape::Sphere(Sphere { radius, ..*sphere })
        }
        Shape::Plane(_) | Shape::Revolution(_) => shape.clone(),
    };
    [moved(1.0), moved(-1.0)]
}

/// A weight of the mirror that leaves both parts at most 1, in proportion to the greatest of each where that is possible.
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

fn is_rectangle(quad: &Quad) -> bool {
    let across = quad.edge_u.normalize().dot(quad.edge_v.normalize());
    // What 32 bits cannot tell from a right angle.
    across.abs() <= f64::from(f32::EPSILON)
}

/// Their rectangle is [−1, 1]² with (u, v) = (0, 0) at (−1, −1).
fn rectangle_place(quad: &Quad) -> (&'static str, String, Coordinates) {
    let (half_u, half_v) = (0.5 * quad.edge_u, 0.5 * quad.edge_v);
    let center = quad.corner + half_u + half_v;
    let columns = [half_u, half_v, quad.normal(), center];
    ("rectangle", to_world(columns), Coordinates::OURS)
}

/// Their poles are on the z axis, u runs from x to y, and v from the pole at +z: so z, x, y are our y, z, x, and v is 1 − t.
fn sphere_place(sphere: &Sphere) -> (&'static str, String, Coordinates) {
    let r = sphere.radius;
    let columns = [r * DVec3::Z, r * DVec3::X, r * DVec3::Y, sphere.center];
    let coordinates = Coordinates {
        scale: DVec2::new(1.0, -1.0),
        offset: DVec2::new(0.0, 1.0),
    };
    ("sphere", to_world(columns), coordinates)
}

fn disc_place(disc: &Disc) -> (&'static str, String, Coordinates) {
    let (s_axis, t_axis) = tangents(disc.normal);
    let columns = [
        disc.radius * s_axis,
        disc.radius * t_axis,
        disc.normal,
        disc.center,
    ];
    ("disk", to_world(columns), Coordinates::OURS)
}

fn diffuse(reflectance: &str) -> String {
    format!("<bsdf type=\"diffuse\">{reflectance}</bsdf>")
}

/// A mirror that reflects all of this share at every angle.
fn conductor(reflectance: Rgb) -> String {
    let share = rgb("specular_reflectance", reflectance);
    format!("<bsdf type=\"conductor\"><string name=\"material\" value=\"none\"/>{share}</bsdf>")
}

fn to_world(columns: [DVec3; 4]) -> String {
    let rows = (0..3).map(|i| columns.map(|column| number(column[i])).join(" "));
    let rows: Vec<String> = rows.collect();
    format!(
        "<transform name=\"to_world\"><matrix value=\"{} 0 0 0 1\"/></transform>",
        rows.join(" ")
    )
}

/// From their texture coordinates to ours, times the repetitions.
fn to_uv(coordinates: Coordinates, repeat: DVec2) -> String {
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

fn float(name: &str, x: f64) -> String {
    format!("<float name=\"{name}\" value=\"{}\"/>", number(x))
}

fn rgb(name: &str, color: Rgb) -> String {
    format!("<rgb name=\"{name}\" value=\"{}\"/>", list(color))
}

fn list(v: DVec3) -> String {
    v.to_array().map(number).join(", ")
}

/// Text that may stand in an XML comment: no control characters, no two hyphens in a row, none at the end.
fn comment(text: &str) -> String {
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
