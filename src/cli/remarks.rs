//! What a render should say beforehand: of a scene that will look odd though nothing is wrong, and of flags without effect.

use super::pictures;
use super::render::RenderArgs;
use crate::numeric::work::Work;
use crate::render::settings::Settings;
use crate::scene::light::{Emitter, Light};
use crate::scene::options::{Antialias, Aov, Integrator, Resampling};
use crate::scene::{Rgb, Scene};
use clap::ValueEnum;
use glam::DVec3;
use std::path::PathBuf;

/// Remarks on rendering the scene with these settings.
pub(super) fn on(scene: &Scene, settings: &Settings) -> Vec<String> {
    let by_photons = settings.integrator.by_photons();
    let mut remarks = Vec::new();
    if scene.lights.dark() && scene.background == Rgb::ZERO {
        remarks.push("the scene has no light of any power: the picture will be black".to_owned());
    } else if by_photons && settings.photons == 0 {
        let remark =
            "no photons are sent: only lamps seen directly, in mirrors or through glass will show";
        remarks.push(remark.to_owned());
    }
    let lights = scene.lights.all().iter();
    remarks.extend(lights.filter_map(|light| inside_glass(scene, light, by_photons)));
    remarks
}

fn inside_glass(scene: &Scene, light: &Light, by_photons: bool) -> Option<String> {
    let glass = scene.medium_at(place(light), &mut Work::default())?;
    let name = |object: usize| &scene.objects[object].name;
    let subject = match light {
        Light::Point { position, .. } => format!("the point light at {position}"),
        Light::Beam { center, .. } => format!("the beam from {center}"),
        Light::Area { object, .. } => format!("the lamp {:?}", name(*object)),
    };
    let inside = format!("{subject} lies inside the glass of {:?}", name(glass));
    Some(match light {
        _ if by_photons => format!("{inside}: its photons start there, and leave by refraction"),
        Light::Area { .. } => {
            format!("{inside}: no ray from outside can be aimed at it, so it is noisy")
        }
        Light::Point { .. } | Light::Beam { .. } => {
            format!("{inside}: no ray from outside can meet it, so use ppm, sppm or pppm")
        }
    })
}

/// Where the light is: any one place of it.
fn place(light: &Light) -> DVec3 {
    match light {
        Light::Point { position, .. } => *position,
        Light::Beam { center, .. } => *center,
        Light::Area { surface, .. } => match surface {
            Emitter::Quad(quad) => quad.corner + 0.5 * (quad.edge_u + quad.edge_v),
            Emitter::Disc(disc) => disc.center,
            Emitter::Sphere(sphere) => sphere.center + sphere.radius * DVec3::Y,
        },
    }
}

/// Flags that the integrator in force has no use for.
pub(super) fn ignored(args: &RenderArgs, settings: &Settings) -> Vec<String> {
    let integrator = settings.integrator;
    let photon = integrator.by_photons();
    let whitted = integrator == Integrator::Whitted;
    let flags = [
        ("--sampler", args.sampler.is_some(), !photon),
        ("--passes", args.passes.is_some(), photon),
        ("--photons", args.photons.is_some(), photon),
        ("--alpha", args.alpha.is_some(), photon),
        ("--radius", args.radius.is_some(), photon),
        ("--rule", args.rule.is_some(), photon),
        ("--aa", args.aa.is_some(), whitted),
        ("--hash", args.hash.is_some(), whitted),
        ("--pattern", args.pattern.is_some(), whitted),
        ("--threshold", args.threshold.is_some(), whitted),
        ("--index", args.index.is_some(), photon),
        ("--kernel", args.kernel.is_some(), photon),
    ];
    let unused = flags.into_iter().filter(|&(_, given, used)| given && !used);
    let mut notes: Vec<String> = unused
        .map(|(flag, ..)| format!("{flag} has no meaning for this integrator and is ignored"))
        .collect();
    if whitted {
        notes.extend(ignored_by_antialiasing(args, settings));
    }
    notes
}

/// Feature channels that are asked for but will not be in any file.
pub(super) fn unwritten(settings: &Settings, outputs: &[PathBuf]) -> Vec<String> {
    let mut notes = Vec::new();
    let missing = |aov: &&Aov| aov.needs_photons() && !settings.integrator.by_photons();
    for aov in settings.aov.iter().filter(missing) {
        let name = aov.to_possible_value();
        let name = name.as_ref().map_or("", |value| value.get_name());
        notes.push(format!(
            "only photon mapping has the feature {name}: it is left out"
        ));
    }
    if !settings.aov.is_empty() && !outputs.iter().any(|path| pictures::is(path, "exr")) {
        notes.push("feature channels are written to .exr alone, and none is asked for".to_owned());
    }
    notes
}

/// Flags of `whitted` that the antialiasing in force has no use for.
fn ignored_by_antialiasing(args: &RenderArgs, settings: &Settings) -> Vec<String> {
    let adaptive = settings.pattern == Resampling::Adaptive;
    let (hash, pattern, threshold) = match settings.aa {
        Antialias::None => (false, false, false),
        Antialias::PathHash => (true, true, true),
        Antialias::Uniform => (adaptive, true, adaptive),
        Antialias::Contrast | Antialias::Variance => (false, true, true),
    };
    let flags = [
        ("--hash", args.hash.is_some(), hash),
        ("--pattern", args.pattern.is_some(), pattern),
        ("--threshold", args.threshold.is_some(), threshold),
    ];
    let unused = flags.into_iter().filter(|&(_, given, used)| given && !used);
    unused
        .map(|(flag, ..)| format!("{flag} has no meaning with this antialiasing and is ignored"))
        .collect()
}
