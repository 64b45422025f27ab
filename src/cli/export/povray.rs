//! `scene.pov` for POV-Ray 3.7.
use super::Export;
use crate::scene::Scene;
pub(super) fn export(_scene: &Scene, _mesh_error: f64) -> anyhow::Result<Export> { anyhow::bail!("not yet") }
