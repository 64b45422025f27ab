//! `scene.pov` for POV-Ray 3.7.
//!
//! POV-Ray shades a diffuse surface of pigment p under a light of colour c with p c cos θ, without the 1/π of a reflectance: our
//! intensity I is its colour I/π. Its light fades with 2/(1 + (d/d₀)^2), which is 2 d₀²/d² up to a share (d₀/d)²: the colour is
//! divided by 2 d₀², with d₀ far below every distance of the scene. What is here was measured on POV-Ray 3.7.

mod lathe;
mod texture;

use super::mesh::Mesh;
use super::{Export, extent, focus_distance, number};
use crate::geometry::planar::tangents;
use crate::geometry::revolution::Revolution;
use crate::geometry::shape::Shape;
use crate::scene::light::{Emitter, Light};
use crate::scene::material::{Emission, Material, Pattern, Side};
use crate::scene::{Object, Rgb, Scene};
use anyhow::{Context, bail};
use glam::DVec3;
use std::f64::consts::PI;
use std::fmt::Write as _;
use texture::Textures;

/// Distance below which light does not fade as the inverse square, in diagonals of the scene: (1e-4)² of a share at a
/// hundredth of the diagonal.
const FADE_DISTANCE: f64 = 1e-6;

/// Points of an area light along each side.
const LIGHT_SIDE: u32 = 9;

/// Objects smaller than this are met by POV-Ray's absolute tolerances.
const SMALL: f64 = 0.05;

/// The scene for POV-Ray; `mesh_error` is the greatest error of meshes as a share of the object's size.
///
/// # Errors
/// What POV-Ray cannot say, named with its object or material.
pub(super) fn export(scene: &Scene, mesh_error: f64) -> anyhow::Result<Export> {
    let bounds = extent(scene);
    let mut writer = Writer {
        scene,
        mesh_error,
        fade: FADE_DISTANCE * (bounds.max - bounds.min).length(),
        body: String::new(),
        export: Export::default(),
        textures: Textures::default(),
    };
    writer.export.note(
        "POV-Ray shows direct light, mirrors and refraction, no light from surface to surface and no caustics: compare with --integrator whitted",
    );
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
    /// d₀ of the lights.
    fade: f64,
    body: String,
    export: Export,
    textures: Textures,
}

impl Writer<'_> {
    /// Settings, camera and background. The camera is given by its three vectors in our own right-handed frame: coordinates
    /// stay as they are.
    fn frame(&mut self) -> anyhow::Result<()> {
        let scene = self.scene;
        let camera = &scene.camera;
        let [right, up, forward] = camera.frame();
        let aspect = f64::from(scene.film.width) / f64::from(scene.film.height);
        let out = &mut self.body;
        writeln!(
            out,
            "#version 3.7;\nglobal_settings {{ assumed_gamma 1 max_trace_level 20 adc_bailout 1e-4 }}\n\
             #default {{ finish {{ ambient 0 emission 0 diffuse 0 specular 0 phong 0 }} }}\n"
        )?;
        writeln!(
            out,
            "camera {{\n  location {}\n  direction {}\n  right {}\n  up {}",
            vector(camera.eye()),
            vector(0.5 / camera.tan_half_fov() * forward),
            vector(aspect * right),
            vector(up)
        )?;
        if camera.lens_radius() > 0.0 {
            // Measured: points of the lens lie within a quarter of the `aperture`.
            writeln!(
                out,
                "  aperture {} focal_point {} blur_samples 200 variance 0 confidence 0.99",
                number(4.0 * camera.lens_radius()),
                vector(camera.eye() + focus_distance(scene) * forward)
            )?;
            self.export
                .note("the lens is sampled at 200 fixed points a pixel");
        }
        writeln!(self.body, "}}")?;
        if scene.background != Rgb::ZERO {
            writeln!(self.body, "background {{ {} }}", color(scene.background))?;
            self.export
                .note("the background is seen, but lights nothing");
        }
        Ok(())
    }

    fn light(&mut self, light: &Light) -> anyhow::Result<()> {
        match light {
            Light::Point {
                position,
                intensity,
            } => self.source(*position, *intensity, ""),
            Light::Beam {
                center,
                direction,
                radius,
                irradiance,
            } => {
                writeln!(
                    self.body,
                    "light_source {{ {} {} cylinder parallel point_at {} radius {r} falloff {r} tightness 0 }}",
                    vector(*center),
                    color(*irradiance / PI),
                    vector(*center + *direction),
                    r = number(*radius)
                )?;
                Ok(())
            }
            Light::Area {
                object,
                surface,
                emission,
            } => self.area_light(&self.scene.objects[*object].name, surface, emission),
        }
    }

    /// A source of this intensity along its axis, with further words.
    fn source(&mut self, place: DVec3, intensity: Rgb, words: &str) -> anyhow::Result<()> {
        let fade = self.fade;
        writeln!(
            self.body,
            "light_source {{ {} {} fade_distance {} fade_power 2{words} }}",
            vector(place),
            color(intensity / (2.0 * PI * fade * fade)),
            number(fade)
        )?;
        Ok(())
    }

    /// A grid of sources over the emitter. Flat ones radiate with the cosine (a spotlight of tightness 1 and 90 degrees), a ball
    /// as the disc of its outline that faces the lit point.
    fn area_light(
        &mut self,
        name: &str,
        surface: &Emitter,
        emission: &Emission,
    ) -> anyhow::Result<()> {
        self.export.note(format!(
            "area lights are grids of {LIGHT_SIDE} x {LIGHT_SIDE} points, and the objects that emit cast no shadow"
        ));
        // Their grid reaches from border to border; ours stands in the middles of equal cells.
        let inner = f64::from(LIGHT_SIDE - 1) / f64::from(LIGHT_SIDE);
        let grid = |a: DVec3, b: DVec3, words: &str| {
            format!(
                " area_light {} {} {LIGHT_SIDE} {LIGHT_SIDE}{words} area_illumination on",
                vector(inner * a),
                vector(inner * b)
            )
        };
        let (center, normal, words) = match surface {
            Emitter::Quad(quad) => {
                let center = quad.corner + 0.5 * (quad.edge_u + quad.edge_v);
                (center, quad.normal(), grid(quad.edge_u, quad.edge_v, ""))
            }
            Emitter::Disc(disc) => {
                let (s_axis, t_axis) = tangents(disc.normal);
                let words = grid(
                    2.0 * disc.radius * s_axis,
                    2.0 * disc.radius * t_axis,
                    " circular",
                );
                (disc.center, disc.normal, words)
            }
            Emitter::Sphere(sphere) => {
                if emission.side != Side::Front {
                    bail!("{name}: POV-Ray has no light that shines from a ball inward");
                }
                let width = 2.0 * sphere.radius;
                let words = grid(width * DVec3::X, width * DVec3::Y, " circular orient");
                let intensity = PI * sphere.radius * sphere.radius * emission.radiance;
                return self.source(sphere.center, intensity, &words);
            }
        };
        let faces: &[f64] = match emission.side {
            Side::Front => &[1.0],
            Side::Back => &[-1.0],
            Side::Both => &[1.0, -1.0],
        };
        for face in faces {
            let ahead = vector(center + *face * normal);
            let cosine =
                format!(" spotlight point_at {ahead} radius 90 falloff 90 tightness 1{words}");
            self.source(center, surface.area() * emission.radiance, &cosine)?;
        }
        Ok(())
    }

    fn object(&mut self, index: usize, object: &Object) -> anyhow::Result<()> {
        let material = &self.scene.materials[object.material];
        let bounds = object.bounds.map(|bounds| bounds.max - bounds.min);
        if bounds.is_some_and(|size| size.max_element() < SMALL) {
            self.export.note(format!(
                "{}: smaller than {SMALL}, where POV-Ray's absolute tolerances begin to show",
                object.name
            ));
        }
        let shape = self
            .shape(index, object, material)
            .with_context(|| object.name.clone())?;
        writeln!(self.body, "\n// {}", line(&object.name))?;
        if let Some(glass) = material.dielectric {
            let absorption = self.absorption(glass.absorption);
            writeln!(
                self.body,
                "{shape}\n  pigment {{ rgbt 1 }} finish {{ reflection {{ 0 1 fresnel on }} conserve_energy }}\n  \
                 interior {{ ior {}{absorption} }} no_shadow }}",
                number(glass.ior)
            )?;
            // The glass lets straight shadow rays through; a black twin that nothing else sees stops them, as ours does.
            writeln!(
                self.body,
                "{shape} pigment {{ rgb 0 }} no_image no_reflection }}"
            )?;
            return Ok(());
        }
        let look = self.look(object, material)?;
        writeln!(self.body, "{shape}\n  {look} }}")?;
        Ok(())
    }

    /// Beer's law in their words: exp(−(1 − fade_color) d / fade_distance).
    fn absorption(&mut self, absorption: Rgb) -> String {
        let most = absorption.max_element();
        if most == 0.0 {
            return String::new();
        }
        self.export.note(
            "POV-Ray does not absorb along rays that were reflected inside a solid: glass with absorption is a little too bright",
        );
        format!(
            " fade_distance {} fade_power 1001 fade_color {}",
            number(1.0 / most),
            color(Rgb::ONE - absorption / most)
        )
    }

    /// The words that open an object, without its material and its closing brace.
    fn shape(
        &mut self,
        index: usize,
        object: &Object,
        material: &Material,
    ) -> anyhow::Result<String> {
        Ok(match &object.shape {
            Shape::Revolution(revolution) => {
                if matches!(
                    material.diffuse,
                    Some(Pattern::Checker { .. } | Pattern::Texture { .. })
                ) {
                    self.mesh(index, object, revolution)?
                } else {
                    self.lathe(object, revolution)
                }
            }
            Shape::Sphere(sphere) => format!(
                "sphere {{ {}, {}",
                vector(sphere.center),
                number(sphere.radius)
            ),
            Shape::Plane(plane) => {
                let distance = plane.normal.dot(plane.point);
                format!("plane {{ {}, {}", vector(plane.normal), number(distance))
            }
            Shape::Disc(disc) => format!(
                "disc {{ {}, {}, {}",
                vector(disc.center),
                vector(disc.normal),
                number(disc.radius)
            ),
            // Of their flat shapes only the disc knows its sides by its normal: one cut down to the parallelogram.
            Shape::Quad(quad) => {
                let center = quad.corner + 0.5 * (quad.edge_u + quad.edge_v);
                let reach = (quad.edge_u + quad.edge_v)
                    .length()
                    .max((quad.edge_u - quad.edge_v).length());
                format!(
                    "disc {{ {}, {}, {}\n  clipped_by {{ box {{ <0, 0, -1>, <1, 1, 1> {} }} }}",
                    vector(center),
                    vector(quad.normal()),
                    number(0.51 * reach),
                    matrix([quad.edge_u, quad.edge_v, reach * quad.normal(), quad.corner])
                )
            }
        })
    }

    fn lathe(&mut self, object: &Object, revolution: &Revolution) -> String {
        let (points, moved) = lathe::control_points(revolution.profile());
        if moved > 0.0 {
            self.export.note(format!(
                "{}: its radius changes sign; the curve was cut there, and moved by at most {:.1e}",
                object.name,
                moved * revolution.placement().scale
            ));
        }
        let pairs: Vec<String> = points
            .iter()
            .map(|piece| {
                let point = |p: &[f64; 2]| format!("<{}, {}>", number(p[0]), number(p[1]));
                piece.iter().map(point).collect::<Vec<_>>().join(" ")
            })
            .collect();
        let placement = revolution.placement();
        let axes = [
            placement.scale * placement.rotation.x_axis,
            placement.scale * placement.rotation.y_axis,
            placement.scale * placement.rotation.z_axis,
            placement.translate,
        ];
        format!(
            "lathe {{ bezier_spline {},\n  {}\n  {}",
            4 * points.len(),
            pairs.join(",\n  "),
            matrix(axes)
        )
    }

    /// A surface of revolution with our texture coordinates, which their lathe has not.
    fn mesh(
        &mut self,
        index: usize,
        object: &Object,
        revolution: &Revolution,
    ) -> anyhow::Result<String> {
        let mesh = Mesh::of_revolution(revolution, self.mesh_error)?;
        let name = format!("object-{index}.inc");
        self.export.note(format!(
            "{}: its lathe has no texture coordinates as ours; a mesh of {} triangles in {name}, within {:.3e} of the true surface",
            object.name,
            mesh.triangles.len(),
            mesh.error
        ));
        let text = lathe::mesh_text(&mesh);
        self.export.files.push((name.clone(), text.into_bytes()));
        Ok(format!("mesh2 {{ #include \"{name}\""))
    }

    /// The textures of an object.
    fn look(&mut self, object: &Object, material: &Material) -> anyhow::Result<String> {
        let plain = self
            .textures
            .texture(&object.shape, material, None, &mut self.export)?;
        let Some(emission) = material.emission else {
            return Ok(plain);
        };
        let bright = self
            .textures
            .texture(
                &object.shape,
                material,
                Some(emission.radiance),
                &mut self.export,
            )
            .with_context(|| format!("material {}", material.name))?;
        Ok(match emission.side {
            Side::Front => format!("{bright}\n  interior_{plain} no_shadow"),
            Side::Back => format!("{plain}\n  interior_{bright} no_shadow"),
            Side::Both => format!("{bright} no_shadow"),
        })
    }

    /// The whole export, with its notes at the top of the file.
    fn finish(mut self) -> Export {
        let mut text = format!(
            "// {}, written by photolathe for POV-Ray 3.7: colours and pixels are linear RGB.\n",
            line(&self.scene.title)
        );
        for note in &self.export.notes {
            text += &format!("// Note: {}.\n", line(note));
        }
        text += &self.body;
        let film = self.scene.film;
        let settings = format!(
            "; povray scene.ini, in this folder: writes scene.exr, linear radiance\n\
             Input_File_Name=scene.pov\nOutput_File_Name=scene.exr\nOutput_File_Type=E\nDisplay=off\n\
             Width={}\nHeight={}\nAntialias=on\nSampling_Method=1\nAntialias_Depth=4\nAntialias_Threshold=0\nJitter=off\n",
            film.width, film.height
        );
        self.export.files.extend([
            ("scene.ini".to_owned(), settings.into_bytes()),
            ("scene.pov".to_owned(), text.into_bytes()),
        ]);
        self.export
    }
}

fn vector(v: DVec3) -> String {
    format!("<{}>", v.to_array().map(number).join(", "))
}

fn color(color: Rgb) -> String {
    format!("rgb {}", vector(color))
}

/// Their matrix lists the images of the axes and of the origin.
fn matrix(columns: [DVec3; 4]) -> String {
    let numbers = columns.map(|column| column.to_array().map(number).join(", "));
    format!("matrix <{}>", numbers.join(", "))
}

/// Text that stays on its line.
fn line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
