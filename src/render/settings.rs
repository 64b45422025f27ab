//! Resolved settings of a render.

use crate::scene::options::{
    Antialias, Aov, Hash, IndexName, Integrator, Kernel, RenderTable, Resampling, Rule, Sampler,
};
use serde::{Deserialize, Serialize};

/// Everything that decides the bytes of a picture besides the scene, and the limits of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Integrator.
    pub integrator: Integrator,
    /// Samples per pixel: all of them for `path` and `whitted`, fixed hit-point samples for `ppm`.
    pub spp: u32,
    /// How the random numbers of camera samples are spread, by `path` and `whitted`.
    pub sampler: Sampler,
    /// Photon passes.
    pub passes: u64,
    /// Photons per pass.
    pub photons: u64,
    /// Share of new photons kept by a shrinking radius.
    pub alpha: f64,
    /// First gather radius; `None` takes it from the pixel footprint.
    pub radius: Option<f64>,
    /// Radius rule.
    pub rule: Rule,
    /// Kernel.
    pub kernel: Kernel,
    /// Antialiasing of `whitted`.
    pub aa: Antialias,
    /// What enters the path hash.
    pub hash: Hash,
    /// How antialiasing resamples.
    pub pattern: Resampling,
    /// Least difference that is resampled: for `contrast`, and for `path-hash` where hashes differ, of two neighbours' sRGB values,
    /// summed over channels (of one sample each: the noise of a lens or a lamp enters, which a hash alone is free of); for `variance`
    /// of the standard deviation of a pixel's four samples, in the same measure.
    pub threshold: f64,
    /// Seed.
    pub seed: u64,
    /// Most scattering events; unlimited if `None`.
    pub max_depth: Option<u32>,
    /// Threads; all cores if `None`. Never changes a byte.
    #[serde(skip)]
    pub threads: Option<usize>,
    /// Index for gathering photons. Never changes a byte.
    #[serde(skip)]
    pub index: IndexName,
    /// Whether photon mapping estimates its error as it goes: the places of photons must then be read at every hit point. Never changes
    /// a byte.
    #[serde(skip)]
    pub estimate_errors: bool,
    /// Seconds after which no further pass starts.
    #[serde(skip)]
    pub time: Option<f64>,
    /// Features to find beside the colours, each once. Never changes a bit of these.
    #[serde(skip)]
    pub aov: Vec<Aov>,
}

impl Settings {
    /// Whether a pass is a function of its number alone, so that passes may be rendered apart: photon mapping under a rule that
    /// does not look at photons.
    pub fn passes_are_independent(&self) -> bool {
        self.integrator.by_photons() && !self.rule.looks_at_photons()
    }

    /// The settings of a table, with defaults where it is silent.
    ///
    /// Defaults: `ppm` with 4 camera samples, 64 passes of 100 000 photons, α = 2/3; `path` with 64 samples; `whitted` with
    /// one and path-hash antialiasing (3×3, by objects; thresholds: hash 0, contrast .3, variance .1); the disc as kernel. With `time`
    /// alone, passes and samples are unlimited.
    pub fn resolve(table: &RenderTable) -> Self {
        let integrator = table.integrator.unwrap_or(Integrator::Ppm);
        let timed = table.time.is_some();
        let spp = match integrator {
            Integrator::Path if timed => u32::MAX,
            Integrator::Path => 64,
            Integrator::Ppm => 4,
            Integrator::Whitted | Integrator::Sppm | Integrator::Pppm => 1,
        };
        let rule = match integrator {
            Integrator::Pppm => Rule::Global,
            _ => Rule::Local,
        };
        let aa = table.aa.unwrap_or(Antialias::PathHash);
        let mut aov = table.aov.clone().unwrap_or_default();
        aov.sort_unstable();
        aov.dedup();
        Self {
            integrator,
            spp: table.spp.unwrap_or(spp),
            sampler: table.sampler.unwrap_or_default(),
            passes: table.passes.unwrap_or(if timed { u64::MAX } else { 64 }),
            photons: table.photons.unwrap_or(100_000),
            alpha: table.alpha.unwrap_or(2.0 / 3.0),
            radius: table.radius,
            rule: table.rule.unwrap_or(rule),
            aa,
            hash: table.hash.unwrap_or(Hash::Objects),
            pattern: table.pattern.unwrap_or(Resampling::Three),
            threshold: table.threshold.unwrap_or(match aa {
                Antialias::Variance => 0.1,
                Antialias::Contrast => 0.3,
                Antialias::None | Antialias::PathHash | Antialias::Uniform => 0.0,
            }),
            kernel: table.kernel.unwrap_or(Kernel::Disc),
            seed: table.seed.unwrap_or(0),
            max_depth: table.max_depth,
            threads: table.threads,
            index: table.index.unwrap_or_default(),
            estimate_errors: false,
            time: table.time,
            aov,
        }
    }
}
