//! From a document to a scene: the top level, camera, film and lights.

use super::document::Node;
use super::error::{SceneError, Source};
use super::material::Textures;
use super::table::{Field, Range, Table};
use super::{material, objects, parameters};
use crate::scene::aim::Aim;
use crate::scene::camera::{Camera, CameraDescription};
use crate::scene::light::{Emitter, Light, Lights};
use crate::scene::material::Material;
use crate::scene::{FilmSize, MAX_PIXELS, Object, Rgb, Scene};
use glam::DVec3;
use std::path::Path;

const TOP_LEVEL: [&str; 14] = [
    "title",
    "background",
    "camera",
    "film",
    "render",
    "solver",
    "material",
    "revolution",
    "sphere",
    "quad",
    "plane",
    "disc",
    "point_light",
    "beam",
];

/// Least distance of focus of an open lens as a share of the eye's largest coordinate: rays keep 32 bits of their directions.
const LEAST_FOCUS: f64 = 1.0 / (1_u64 << 20) as f64;

/// Smallest sine of the angle between `up` and the view axis: below it the picture's x axis would be made of rounding.
const LEAST_SINE_OF_UP: f64 = 1e-9;

/// Validates the document and builds its scene.
pub(super) fn scene(
    source: &Source,
    document: &Node,
    directory: &Path,
) -> Result<Scene, SceneError> {
    let root = Table::root(source, document, &TOP_LEVEL)?;
    let title = match root.get("title") {
        Some(title) => title.string("a string")?.to_owned(),
        None => String::new(),
    };
    let background = optional(&root, "background", Rgb::ZERO, |field| {
        field.color(Range::NotNegative)
    })?;
    let camera = camera(&root.require("camera", "a table [camera]")?)?;
    let film = film(&root.require("film", "a table [film]")?)?;
    let render = parameters::render(&root)?;
    let solver = parameters::solver(&root, render.solver)?;
    let mut textures = Textures::new(directory);
    let materials = material::materials(&root, &mut textures)?;
    let bounding = parameters::bounding(&root)?;
    let mut objects = objects::objects(&root, &materials)?;
    for object in &mut objects {
        object.shape = object.shape.clone().bounded_by(bounding);
    }
    let lights = lights(&root, &materials, &objects)?;
    Ok(Scene {
        title,
        background,
        camera,
        film,
        materials,
        objects,
        lights,
        solver,
        render,
        hash: hash(source, &textures),
    })
}

/// The value of an optional key, or its default.
pub(super) fn optional<T>(
    table: &Table,
    key: &str,
    default: T,
    read: impl FnOnce(&Field) -> Result<T, SceneError>,
) -> Result<T, SceneError> {
    table.get(key).map_or(Ok(default), |field| read(&field))
}

/// Every table of a list `[[kind]]`, with all its keys known.
pub(super) fn tables<'a>(
    root: &Table<'a>,
    kind: &str,
    known: &[&str],
) -> Result<Vec<Table<'a>>, SceneError> {
    let header = format!("[[{kind}]]");
    let Some(field) = root.get(kind) else {
        return Ok(Vec::new());
    };
    field
        .list(&format!("a list of tables {header}"))?
        .iter()
        .map(|item| item.table(&header, known))
        .collect()
}

fn camera(field: &Field) -> Result<Camera, SceneError> {
    let known = [
        "eye",
        "target",
        "up",
        "vertical_fov_deg",
        "lens_radius",
        "focus_distance",
    ];
    let table = field.table("[camera]", &known)?;
    let eye = table.require("eye", "a point [x, y, z]")?.point()?;
    let target_field = table.require("target", "a point [x, y, z]")?;
    let target = target_field.point()?;
    let view = target - eye;
    let Some(forward) = view.try_normalize() else {
        return Err(target_field.expected("a point away from eye"));
    };
    let up = optional(&table, "up", DVec3::Y, |field| field.direction())?;
    if forward.cross(up).length() < LEAST_SINE_OF_UP {
        let at_fault = table.get("up").unwrap_or(target_field);
        return Err(at_fault.expected("up not parallel to the view axis, target - eye"));
    }
    let fov = table
        .require("vertical_fov_deg", "a number > 0 and < 180")?
        .number(Range::Below(180.0))?;
    let lens_radius = optional(&table, "lens_radius", 0.0, |field| {
        field.number(Range::NotNegative)
    })?;
    let focus_distance = optional(&table, "focus_distance", view.length(), |field| {
        field.distance()
    })?;
    let least = LEAST_FOCUS * eye.abs().max_element();
    if lens_radius > 0.0 && focus_distance < least {
        let at_fault = table.get("focus_distance").unwrap_or(target_field);
        return Err(at_fault.expected(&format!(
            "a focus at a distance of at least {least:e}: nearer, it is lost in the rounding of the eye's place"
        )));
    }
    Ok(Camera::new(&CameraDescription {
        eye,
        target,
        up,
        vertical_fov_deg: fov,
        lens_radius,
        focus_distance,
    }))
}

fn film(field: &Field) -> Result<FilmSize, SceneError> {
    let table = field.table("[film]", &["width", "height"])?;
    let largest = u64::from(u32::MAX);
    let expected = "a number of pixels";
    let width_field = table.require("width", expected)?;
    let height_field = table.require("height", expected)?;
    let (width, height) = (
        width_field.integer(1, largest)?,
        height_field.integer(1, largest)?,
    );
    let pixels = width * height;
    if pixels > MAX_PIXELS {
        let at_fault = if height_field.overridden() && !width_field.overridden() {
            height_field
        } else {
            width_field
        };
        return Err(at_fault.expected(&format!(
            "a film of at most {MAX_PIXELS} pixels; {width} × {height} is {pixels}"
        )));
    }
    Ok(FilmSize {
        width: width as u32,
        height: height as u32,
    })
}

fn lights(root: &Table, materials: &[Material], objects: &[Object]) -> Result<Lights, SceneError> {
    let mut lights = Vec::new();
    for table in tables(root, "point_light", &["position", "intensity"])? {
        lights.push(Light::Point {
            position: table.require("position", "a point [x, y, z]")?.point()?,
            intensity: table
                .require("intensity", "a colour [red, green, blue]")?
                .color(Range::NotNegative)?,
        });
    }
    for table in tables(
        root,
        "beam",
        &["center", "direction", "radius", "irradiance"],
    )? {
        lights.push(Light::Beam {
            center: table.require("center", "a point [x, y, z]")?.point()?,
            direction: table
                .require("direction", "a direction [x, y, z]")?
                .direction()?,
            radius: table
                .require("radius", "a number > 0")?
                .number(Range::Positive)?,
            irradiance: table
                .require("irradiance", "a colour [red, green, blue]")?
                .color(Range::NotNegative)?,
        });
    }
    for (index, object) in objects.iter().enumerate() {
        let emission = materials[object.material].emission;
        if let (Some(emission), Some(surface)) = (emission, Emitter::of(object)) {
            lights.push(Light::Area {
                object: index,
                surface,
                emission,
            });
        }
    }
    Ok(Lights::new(lights).aimed(Aim::at(objects, materials)))
}

/// BLAKE3 over the text, the overrides and the digests of the textures, each with its length in front.
fn hash(source: &Source, textures: &Textures) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    add(source.text.as_bytes());
    for (key, value) in source.overrides {
        add(key.as_bytes());
        add(value.as_bytes());
    }
    for digest in textures.digests() {
        add(digest.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}
