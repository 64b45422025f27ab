//! What a render should say beforehand of a scene that will look odd though nothing is wrong.

use crate::numeric::work::Work;
use crate::render::settings::Settings;
use crate::scene::light::{Emitter, Light};
use crate::scene::options::Integrator;
use crate::scene::{Rgb, Scene};
use glam::DVec3;

/// Remarks on rendering the scene with these settings.
pub(super) fn on(scene: &Scene, settings: &Settings) -> Vec<String> {
    let by_photons = match settings.integrator {
        Integrator::Ppm | Integrator::Sppm | Integrator::Pppm => true,
        Integrator::Path | Integrator::Whitted => false,
    };
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
