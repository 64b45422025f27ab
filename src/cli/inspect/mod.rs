//! `photolathe inspect`: what the program understood of a scene.

mod drawing;

use super::parse_override;
use crate::geometry::bounds::Aabb;
use crate::geometry::profile::Solid;
use crate::geometry::revolution::{Revolution, Solver};
use crate::geometry::shape::Shape;
use crate::image::file::write_atomically;
use crate::render::settings::Settings;
use crate::scene::light::Light;
use crate::scene::material::{Material, Pattern, Side};
use crate::scene::{Object, Rgb, Scene, file};
use anyhow::{Context, bail};
use clap::Args;
use glam::DVec3;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Show what the program understood of a scene, and draw a profile.
#[derive(Debug, Args)]
#[command(after_help = "\
The text goes to standard output: title, film, camera, the parameters in force, lights with their power, materials, and objects
with bounds, volume and closedness. With -o the profile of a surface of revolution is drawn: its pieces, their control polygon,
joints, and the side of its normals. SVG has labels, PNG only the lines.")]
pub struct InspectArgs {
    /// Scene file.
    pub scene: PathBuf,
    /// Where to draw the profile: .svg or .png.
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The surface of revolution to draw (default: the first).
    #[arg(long, value_name = "NAME", requires = "out")]
    pub profile: Option<String>,
    /// Change a key of the scene file, as in --set film.width=64.
    #[arg(long, value_name = "KEY=VALUE", value_parser = parse_override)]
    pub set: Vec<(String, String)>,
}

/// Runs `inspect`.
pub fn run(args: &InspectArgs) -> anyhow::Result<ExitCode> {
    let scene = file::load(&args.scene, &args.set)?;
    let drawn = args
        .out
        .as_ref()
        .map(|path| Ok::<_, anyhow::Error>((path, drawn_profile(&scene, args)?)))
        .transpose()?;
    let text = describe(&scene)?;
    std::io::stdout().lock().write_all(text.as_bytes())?;
    if let Some((path, (name, revolution))) = drawn {
        let extension = path.extension().and_then(|extension| extension.to_str());
        let drawing = drawing::of_profile(revolution.profile(), name);
        let bytes = match extension {
            Some("svg") => drawing.svg().into_bytes(),
            Some("png") => drawing.png()?,
            _ => bail!(
                "{}: expected a name that ends in .svg or .png",
                path.display()
            ),
        };
        write_atomically(path, &bytes).with_context(|| path.display().to_string())?;
        eprintln!("photolathe: profile of {name} drawn in {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

fn drawn_profile<'a>(
    scene: &'a Scene,
    args: &InspectArgs,
) -> anyhow::Result<(&'a str, &'a Revolution)> {
    let mut names = Vec::new();
    for object in &scene.objects {
        if let Shape::Revolution(revolution) = &object.shape {
            if args
                .profile
                .as_ref()
                .is_none_or(|name| *name == object.name)
            {
                return Ok((&object.name, revolution));
            }
            names.push(object.name.as_str());
        }
    }
    match &args.profile {
        Some(name) if !names.is_empty() => bail!(
            "--profile {name}: expected the name of a surface of revolution: {}",
            names.join(", ")
        ),
        _ => bail!("--out: the scene has no surface of revolution to draw"),
    }
}

/// The whole text.
fn describe(scene: &Scene) -> anyhow::Result<String> {
    let mut text = String::new();
    writeln!(text, "title       {}", scene.title)?;
    writeln!(text, "hash        {}", scene.hash)?;
    let film = scene.film;
    let pixels = u64::from(film.width) * u64::from(film.height);
    writeln!(
        text,
        "film        {} × {}, {pixels} pixels",
        film.width, film.height
    )?;
    writeln!(text, "background  {}", triple(scene.background))?;
    camera(&mut text, scene)?;
    parameters(&mut text, scene)?;
    lights(&mut text, scene)?;
    writeln!(text, "\nmaterials")?;
    for material in &scene.materials {
        writeln!(text, "  {}: {}", material.name, material_words(material))?;
    }
    writeln!(text, "\nobjects")?;
    for (index, object) in scene.objects.iter().enumerate() {
        describe_object(&mut text, scene, index, object)?;
    }
    Ok(text)
}

fn camera(text: &mut String, scene: &Scene) -> std::fmt::Result {
    let camera = &scene.camera;
    let size = glam::DVec2::new(f64::from(scene.film.width), f64::from(scene.film.height));
    let centre = camera.ray(0.5 * size, size, [0.5, 0.5]);
    let fov = 2.0 * libm::atan(0.5 * size.y * camera.pixel_size(scene.film.height));
    writeln!(text, "\ncamera")?;
    writeln!(text, "  eye {}", triple(camera.eye()))?;
    writeln!(text, "  view axis {}", triple(centre.direction))?;
    writeln!(
        text,
        "  vertical field of view {} degrees",
        short(fov.to_degrees())
    )?;
    match camera.lens_radius() {
        0.0 => writeln!(text, "  pinhole"),
        radius => writeln!(
            text,
            "  thin lens of radius {}, in focus at distance {}",
            short(radius),
            short(camera.focus_distance())
        ),
    }
}

fn parameters(text: &mut String, scene: &Scene) -> anyhow::Result<()> {
    let settings = Settings::resolve(&scene.render);
    writeln!(text, "\nparameters in force")?;
    if let serde_json::Value::Object(values) = serde_json::to_value(&settings)? {
        for (key, value) in values.iter().filter(|(_, value)| !value.is_null()) {
            writeln!(text, "  {key} = {value}")?;
        }
    }
    match &scene.solver {
        Solver::Bernstein => writeln!(text, "  solver = \"bernstein\"")?,
        Solver::Exact => writeln!(text, "  solver = \"exact\"")?,
        Solver::Clipping(clipping) => writeln!(text, "  solver = \"clipping\", {clipping:?}")?,
        Solver::Newton(newton) => writeln!(text, "  solver = \"newton\", {newton:?}")?,
    }
    Ok(())
}

fn lights(text: &mut String, scene: &Scene) -> std::fmt::Result {
    writeln!(
        text,
        "\nlights, total power {} W",
        triple(scene.lights.power())
    )?;
    for (index, light) in scene.lights.all().iter().enumerate() {
        let words = match light {
            Light::Point {
                position,
                intensity,
            } => {
                format!(
                    "point light at {}, intensity {}",
                    triple(*position),
                    triple(*intensity)
                )
            }
            Light::Beam {
                center,
                direction,
                radius,
                irradiance,
            } => format!(
                "beam through {} along {}, radius {}, irradiance {}",
                triple(*center),
                triple(*direction),
                short(*radius),
                triple(*irradiance)
            ),
            Light::Area { object, .. } => format!("object {}", scene.objects[*object].name),
        };
        let share = 100.0 * scene.lights.probability(index);
        writeln!(
            text,
            "  {words}: {} W, {} % of the photons",
            triple(light.power()),
            short(share)
        )?;
    }
    Ok(())
}

fn material_words(material: &Material) -> String {
    let mut words = Vec::new();
    match &material.diffuse {
        Some(Pattern::Constant(color)) => words.push(format!("diffuse {}", triple(*color))),
        Some(Pattern::Checker { colors, repeat }) => words.push(format!(
            "diffuse checker {} {}, repeat [{}, {}]",
            triple(colors[0]),
            triple(colors[1]),
            repeat.x,
            repeat.y
        )),
        Some(Pattern::Texture { texture, repeat }) => words.push(format!(
            "diffuse texture of {} × {} texels, largest {}, repeat [{}, {}]",
            texture.width,
            texture.height,
            triple(texture.largest()),
            repeat.x,
            repeat.y
        )),
        None => {}
    }
    if let Some(mirror) = material.mirror {
        words.push(format!("mirror {}", triple(mirror)));
    }
    if let Some(glass) = material.dielectric {
        let absorption = triple(glass.absorption);
        words.push(format!(
            "dielectric of index {}, absorption {absorption}",
            glass.ior
        ));
    }
    if let Some(emission) = material.emission {
        let side = match emission.side {
            Side::Front => "front",
            Side::Back => "back",
            Side::Both => "both sides",
        };
        words.push(format!("emission {}, {side}", triple(emission.radiance)));
    }
    words.join("; ")
}

fn describe_object(
    text: &mut String,
    scene: &Scene,
    index: usize,
    object: &Object,
) -> std::fmt::Result {
    let kind = match &object.shape {
        Shape::Revolution(_) => "revolution",
        Shape::Sphere(_) => "sphere",
        Shape::Quad(_) => "quad",
        Shape::Plane(_) => "plane",
        Shape::Disc(_) => "disc",
    };
    let material = &scene.materials[object.material].name;
    writeln!(text, "  {index} {}: {kind} of {material}", object.name)?;
    match object.bounds {
        Some(Aabb { min, max }) => {
            writeln!(text, "      bounds {} to {}", triple(min), triple(max))?;
        }
        None => writeln!(text, "      no bounds")?,
    }
    match &object.shape {
        Shape::Revolution(revolution) => describe_revolution(text, revolution),
        Shape::Sphere(sphere) => {
            let volume = 4.0 / 3.0 * std::f64::consts::PI * sphere.radius.powi(3);
            writeln!(
                text,
                "      closed, normals outward, volume {}",
                short(volume)
            )
        }
        Shape::Quad(quad) => {
            writeln!(
                text,
                "      normal {}, area {}",
                triple(quad.normal()),
                short(quad.area())
            )
        }
        Shape::Plane(plane) => writeln!(text, "      normal {}", triple(plane.normal)),
        Shape::Disc(disc) => {
            let area = std::f64::consts::PI * disc.radius * disc.radius;
            writeln!(
                text,
                "      normal {}, area {}",
                triple(disc.normal),
                short(area)
            )
        }
    }
}

fn describe_revolution(text: &mut String, revolution: &Revolution) -> std::fmt::Result {
    let profile = revolution.profile();
    let cylinder = revolution.cylinder();
    let placement = revolution.placement();
    let volume = profile.volume() * placement.scale.powi(3);
    let closed = match profile.solid() {
        Solid::Outward => format!("closed, normals outward, volume {}", short(volume)),
        Solid::Inward => format!("closed, normals inward, volume {}", short(-volume)),
        Solid::Open => "open".to_owned(),
    };
    writeln!(text, "      {closed}")?;
    writeln!(
        text,
        "      {} pieces in the cylinder of radius {}, height {} to {}, of its own frame",
        profile.pieces().len(),
        short(cylinder.radius),
        short(cylinder.bottom),
        short(cylinder.top)
    )?;
    writeln!(
        text,
        "      scale {}, axis {}, translated by {}",
        short(placement.scale),
        triple(placement.rotation * DVec3::Y),
        triple(placement.translate)
    )
}

/// A number to 6 digits, without trailing zeros.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-4..1e7).contains(&x.abs()) {
        return format!("{x:.5e}");
    }
    let fixed = format!("{x:.6}");
    let trimmed = fixed.trim_end_matches('0').trim_end_matches('.');
    if trimmed == "-0" {
        "0".to_owned()
    } else {
        trimmed.to_owned()
    }
}

fn triple(v: Rgb) -> String {
    format!("[{}, {}, {}]", short(v.x), short(v.y), short(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn described(scene: &str) -> String {
        describe(&file::load(Path::new(scene), &[]).expect("the scene loads"))
            .expect("it is described")
    }

    #[test]
    fn the_cup_is_understood_as_a_closed_solid() {
        let text = described("scenes/cup.toml");
        for part in [
            "film        512 × 384, 196608 pixels",
            "solver = \"bernstein\"",
            "glass: dielectric of index 1.5, absorption [0.05, 0.01, 0.02]",
            "0 cup: revolution of glass\n      bounds [-3.8, 0.001, -3.8] to [3.8, 2.151, 3.8]\n      closed, normals outward",
            "6 pieces in the cylinder of radius 3.8, height 0 to 2.15",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }

    #[test]
    fn volumes_and_openness_are_stated() {
        // π r² h of the slab, which is a cylinder.
        assert!(
            described("scenes/slab.toml").contains("closed, normals outward, volume 314.159265\n")
        );
        assert!(
            described("scenes/gallery.toml")
                .contains("1 vase: revolution of stripes\n      bounds")
        );
        assert!(described("scenes/gallery.toml").contains("      open\n"));
        let text = described("scenes/point_over_plane.toml");
        assert!(
            text.contains("no bounds") && text.contains("100 % of the photons"),
            "{text}"
        );
    }

    #[test]
    fn a_profile_is_drawn_in_both_formats() {
        let drawing = drawing::of_profile(&crate::geometry::profile::Profile::cup(), "a<b");
        let svg = drawing.svg();
        // The axis, and per piece its curve, the mirrored curve, the polygon and the tick.
        assert_eq!(svg.matches("<polyline").count(), 1 + 4 * 6);
        assert_eq!(svg.matches("<circle").count(), 4 * 6);
        assert!(svg.contains("profile of a&lt;b: 6 pieces") && svg.ends_with("</svg>\n"));
        let png = image::load_from_memory(&drawing.png().expect("the PNG is written"))
            .expect("it is read");
        assert!(
            png.to_rgb8().pixels().any(|pixel| pixel.0 == [20, 20, 20]),
            "a joint"
        );
    }

    #[test]
    fn numbers_are_short_but_not_rounded_away() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (2.5, "2.5"),
            (100.0, "100"),
            (1e-9, "1.00000e-9"),
            (-3e8, "-3.00000e8"),
        ] {
            assert_eq!(short(x), text);
        }
    }
}
