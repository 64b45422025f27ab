//! `photolathe export`: the scene for an independent renderer.

pub mod mesh;
mod mitsuba;
mod povray;

use super::parse_override;
use crate::geometry::bounds::Aabb;
use crate::image::file::write_atomically;
use crate::scene::light::Light;
use crate::scene::{Scene, file};
use anyhow::Context;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;

/// Write a scene for Mitsuba or POV-Ray.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  photolathe export scenes/hourglass.toml --to mitsuba -o out/hourglass
  mitsuba -m llvm_ad_rgb -D spp=256 out/hourglass/scene.xml      or scalar_rgb; writes scene.exr, linear radiance as ours
  photolathe export scenes/cup.toml --to povray -o out/cup
  cd out/cup && povray scene.ini                                 writes scene.exr, linear radiance as ours

mitsuba  scene.xml for Mitsuba 3, rgb variants, with textures (EXR) and meshes (PLY) beside it: the full light transport of
         `--integrator path`. Surfaces of revolution become meshes with the true normals; the bound of their geometric error
         is stated in the file.
povray   scene.pov for POV-Ray 3.7 with textures (PNG) beside it: the direct light of `--integrator whitted`. Surfaces of
         revolution become `lathe { bezier_spline }`, the same curve.

What the other program cannot say exactly is named once on stderr and at the top of the file; what it cannot say at all is an
error (exit code 2), and nothing is written.")]
pub struct ExportArgs {
    /// Scene file.
    pub scene: PathBuf,
    /// The program that shall read it.
    #[arg(long, value_enum)]
    pub to: Program,
    /// Folder to write into; made if it is absent.
    #[arg(short, long = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Change a key of the scene file, as in --set film.width=64.
    #[arg(long, value_name = "KEY=VALUE", value_parser = parse_override)]
    pub set: Vec<(String, String)>,
    /// Greatest geometric error of meshes, as a share of the object's size, 1e-6 to 0.1.
    #[arg(long, value_name = "SHARE", default_value_t = 1e-4, value_parser = mesh_error)]
    pub mesh_error: f64,
}

/// The programs that scenes can be written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Program {
    /// Mitsuba 3.
    Mitsuba,
    /// POV-Ray 3.7.
    Povray,
}

fn mesh_error(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (1e-6..=0.1).contains(&share) => Ok(share),
        _ => Err("expected a number from 1e-6 to 0.1".to_owned()),
    }
}

/// Runs `export`.
pub fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let scene = file::load(&args.scene, &args.set)?;
    let export = match args.to {
        Program::Mitsuba => mitsuba::export(&scene, args.mesh_error),
        Program::Povray => povray::export(&scene, args.mesh_error),
    }
    .with_context(|| args.scene.display().to_string())?;
    for (name, bytes) in &export.files {
        let path = args.out.join(name);
        write_atomically(&path, bytes).with_context(|| path.display().to_string())?;
    }
    for note in &export.notes {
        eprintln!("photolathe: {note}");
    }
    let names: Vec<&str> = export.files.iter().map(|(name, _)| name.as_str()).collect();
    eprintln!(
        "photolathe: wrote {} in {}",
        names.join(", "),
        args.out.display()
    );
    Ok(ExitCode::SUCCESS)
}

/// What an exporter made: nothing is written before all of it exists.
#[derive(Debug, Default)]
struct Export {
    /// Names and bytes, the scene's own file last: who finds it finds what it names.
    files: Vec<(String, Vec<u8>)>,
    /// What differs from our scene, one sentence each.
    notes: Vec<String>,
}

impl Export {
    /// Notes a difference once.
    fn note(&mut self, text: impl Into<String>) {
        let text = text.into();
        if !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }
}

/// A distance of focus that other programs take in place of an infinite one, in sizes of the scene: what it changes of a blur, a
/// ten-millionth, is a rounding of their float32.
const AT_INFINITY: f64 = 1e7;

/// The distance of focus, finite.
fn focus_distance(scene: &Scene) -> f64 {
    let extent = extent(scene);
    let far = AT_INFINITY * (extent.max - extent.min).length();
    match scene.camera.focus_distance() {
        f64::INFINITY => far,
        distance => distance,
    }
}

/// The box of everything that has a place: objects with bounds, the points of planes, lights and the camera.
fn extent(scene: &Scene) -> Aabb {
    use crate::geometry::shape::Shape;
    let eye = scene.camera.eye();
    let mut bounds = Aabb { min: eye, max: eye };
    let mut add = |min: glam::DVec3, max: glam::DVec3| {
        bounds.min = bounds.min.min(min);
        bounds.max = bounds.max.max(max);
    };
    for object in &scene.objects {
        match (&object.shape, object.bounds) {
            (Shape::Plane(plane), _) => add(plane.point, plane.point),
            (_, Some(own)) => add(own.min, own.max),
            (_, None) => {}
        }
    }
    for light in scene.lights.all() {
        match light {
            Light::Point { position, .. } => add(*position, *position),
            Light::Beam { center, .. } => add(*center, *center),
            Light::Area { .. } => {}
        }
    }
    bounds
}

/// A number that the other program reads as the same one.
fn number(x: f64) -> String {
    // Negative zero is a sign without meaning there.
    format!("{:?}", x + 0.0)
}
