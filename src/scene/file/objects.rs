//! The tables of objects.

use super::build::{optional, tables};
use super::error::SceneError;
use super::table::{Field, Range, Table};
use crate::geometry::planar::{Disc, Plane, Quad};
use crate::geometry::profile::{Piece, Profile, ProfileError, Solid};
use crate::geometry::revolution::{Placement, Revolution};
use crate::geometry::shape::Shape;
use crate::geometry::sphere::Sphere;
use crate::scene::Object;
use crate::scene::material::Material;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// The kinds of objects, in the order in which a scene lists them, with their keys besides `name` and `material`.
const KINDS: [(&str, &[&str], ReadShape); 5] = [
    (
        "revolution",
        &[
            "name",
            "material",
            "profile",
            "translate",
            "rotate",
            "scale",
        ],
        revolution,
    ),
    ("sphere", &["name", "material", "center", "radius"], sphere),
    (
        "quad",
        &["name", "material", "corner", "edge_u", "edge_v"],
        quad,
    ),
    ("plane", &["name", "material", "point", "normal"], plane),
    (
        "disc",
        &["name", "material", "center", "normal", "radius"],
        disc,
    ),
];

type ReadShape = fn(&Table) -> Result<Shape, SceneError>;

/// Sine of the smallest angle between the edges of a quad: below it the quad's normal would be made of rounding.
const LEAST_SINE_OF_EDGES: f64 = 1e-9;

/// Most names listed in a message.
const MOST_NAMES: usize = 40;

const POINT: &str = "a point [x, y, z]";
const DIRECTION: &str = "a direction [x, y, z]";

/// All objects: revolutions, spheres, quads, planes, discs, each kind in the order of the file.
pub(super) fn objects(root: &Table, materials: &[Material]) -> Result<Vec<Object>, SceneError> {
    let by_name: BTreeMap<&str, usize> = materials
        .iter()
        .enumerate()
        .map(|(index, material)| (material.name.as_str(), index))
        .collect();
    let mut objects = Vec::new();
    let mut names = BTreeSet::new();
    for (kind, known, read) in KINDS {
        for (number, table) in tables(root, kind, known)?.iter().enumerate() {
            let default = format!("{kind}[{number}]");
            let name = optional(table, "name", default, |field| {
                Ok(field.string("a string")?.to_owned())
            })?;
            if !names.insert(name.clone()) {
                let expected = "a name that no other object has";
                return Err(table.get("name").map_or_else(
                    || table.error(&format!("{name}: expected {expected}")),
                    |field| field.expected(expected),
                ));
            }
            let shape = read(table)?;
            let material = material(table, materials, &by_name, &shape)?;
            let bounds = shape.bounds();
            objects.push(Object {
                name,
                shape,
                material,
                bounds,
            });
        }
    }
    Ok(objects)
}

/// Index of the object's material, which must suit the shape.
fn material(
    table: &Table,
    materials: &[Material],
    by_name: &BTreeMap<&str, usize>,
    shape: &Shape,
) -> Result<usize, SceneError> {
    let field = table.require("material", "the name of a material")?;
    let name = field.string("the name of a material")?;
    let Some(&index) = by_name.get(name) else {
        let names: Vec<&str> = materials
            .iter()
            .map(|material| material.name.as_str())
            .take(MOST_NAMES)
            .collect();
        let known = super::table::one_of(&names);
        return Err(field.expected(&format!("the name of a material: {known}")));
    };
    if materials[index].dielectric.is_some() {
        require_solid(table, &field, shape)?;
    }
    if materials[index].emission.is_some()
        && matches!(shape, Shape::Revolution(_) | Shape::Plane(_))
    {
        return Err(
            field.expected("a material without emission: only quads, discs and spheres emit")
        );
    }
    Ok(index)
}

/// A dielectric must fill a closed solid whose normals point outward.
fn require_solid(table: &Table, material: &Field, shape: &Shape) -> Result<(), SceneError> {
    match shape {
        Shape::Sphere(_) => Ok(()),
        Shape::Quad(_) | Shape::Plane(_) | Shape::Disc(_) => {
            Err(material
                .expected("a material that is no dielectric: a flat shape encloses nothing"))
        }
        Shape::Revolution(revolution) => {
            let profile = table.require("profile", PROFILE)?;
            match revolution.profile().solid() {
                Solid::Outward => Ok(()),
                Solid::Inward => Err(profile.expected(
                    "outward normals around a dielectric: the solid runs the wrong way, so reverse its pieces and points",
                )),
                Solid::Open => Err(profile.expected(
                    "a closed solid for a dielectric: both ends on the axis, or the last point on the first",
                )),
            }
        }
    }
}

fn number(table: &Table, key: &str, range: Range) -> Result<f64, SceneError> {
    table.require(key, &range.to_string())?.number(range)
}

fn point(table: &Table, key: &str) -> Result<DVec3, SceneError> {
    table.require(key, POINT)?.point()
}

fn sphere(table: &Table) -> Result<Shape, SceneError> {
    Ok(Shape::Sphere(Sphere {
        center: point(table, "center")?,
        radius: number(table, "radius", Range::Positive)?,
    }))
}

fn plane(table: &Table) -> Result<Shape, SceneError> {
    Ok(Shape::Plane(Plane {
        point: point(table, "point")?,
        normal: table.require("normal", DIRECTION)?.direction()?,
    }))
}

fn disc(table: &Table) -> Result<Shape, SceneError> {
    Ok(Shape::Disc(Disc {
        center: point(table, "center")?,
        normal: table.require("normal", DIRECTION)?.direction()?,
        radius: number(table, "radius", Range::Positive)?,
    }))
}

fn quad(table: &Table) -> Result<Shape, SceneError> {
    let edge = |key: &str| -> Result<(DVec3, DVec3), SceneError> {
        let field = table.require(key, "a vector [x, y, z]")?;
        Ok((field.point()?, field.direction()?))
    };
    let (edge_u, along_u) = edge("edge_u")?;
    let (edge_v, along_v) = edge("edge_v")?;
    let area = edge_u.cross(edge_v).length_squared();
    if along_u.cross(along_v).length() < LEAST_SINE_OF_EDGES || area < f64::MIN_POSITIVE {
        return Err(table
            .require("edge_v", "a vector [x, y, z]")?
            .expected("an edge not parallel to edge_u, with some area between them"));
    }
    let corner = point(table, "corner")?;
    Ok(Shape::Quad(Quad::new(corner, edge_u, edge_v)))
}

const PROFILE: &str = "a list of pieces of 4 control points [radius, height]";

fn revolution(table: &Table) -> Result<Shape, SceneError> {
    let profile = profile(&table.require("profile", PROFILE)?)?;
    let translate = optional(table, "translate", DVec3::ZERO, |field| field.point())?;
    let (axis, degrees) = optional(table, "rotate", (DVec3::Y, 0.0), |field| {
        let rotate = field.table("rotate", &["axis", "deg"])?;
        let axis = rotate.require("axis", DIRECTION)?.direction()?;
        Ok((axis, number(&rotate, "deg", Range::Any)?))
    })?;
    let scale = optional(table, "scale", 1.0, |field| field.number(Range::Positive))?;
    let placement = Placement::new(translate, axis, degrees, scale);
    Ok(Shape::Revolution(Revolution::new(profile, placement)))
}

fn profile(field: &Field) -> Result<Profile, SceneError> {
    let pieces = field.list(PROFILE)?;
    let control = pieces.iter().map(piece).collect::<Result<Vec<_>, _>>()?;
    Profile::new(control).map_err(|error| match error {
        ProfileError::Empty => field.expected("at least one piece of 4 control points"),
        ProfileError::NotFinite { piece, .. } => pieces[piece].expected("finite numbers"),
        ProfileError::Gap { piece, end, .. } => pieces[piece].expected(&format!(
            "a piece that starts where the one before it ends, at [{}, {}]",
            end[0], end[1]
        )),
    })
}

fn piece(field: &Field) -> Result<Piece, SceneError> {
    let points: [Field; 4] = field.items("a piece of 4 control points [radius, height]")?;
    let mut piece = Piece {
        radius: [0.0; 4],
        height: [0.0; 4],
    };
    for (index, point) in points.iter().enumerate() {
        let [radius, height] = point.items("a control point [radius, height]")?;
        piece.radius[index] = radius.number(Range::Any)?;
        piece.height[index] = height.number(Range::Any)?;
    }
    Ok(piece)
}
