//! What a scene file or a command line may say about rendering.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Largest magnitude of a number in a scene file or on a command line. Areas of areas and fluxes made from such numbers stay finite.
pub const LARGEST: f64 = 1e60;

/// Most threads: more would only exhaust the machine.
pub const MOST_THREADS: u16 = 1024;

/// How light is transported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Recursive reflection and refraction with direct light (Whitted 1980).
    Whitted,
    /// Path tracing with next-event estimation (Kajiya 1986).
    Path,
    /// Progressive photon mapping, fixed hit points (Hachisuka, Ogaki and Jensen 2008).
    Ppm,
    /// Stochastic progressive photon mapping, new camera samples each pass (Hachisuka and Jensen 2009).
    Sppm,
    /// Probabilistic progressive photon mapping, one global radius (Knaus and Zwicker 2011).
    Pppm,
}

impl Integrator {
    /// Whether it gathers photons.
    pub fn by_photons(self) -> bool {
        matches!(self, Self::Ppm | Self::Sppm | Self::Pppm)
    }
}

/// How the gather radius shrinks from pass to pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// By each hit point's own photon count: r'² = r² (N + αM)/(N + M).
    Local,
    /// One schedule for all: r'² = r² (i + α)/(i + 1).
    Global,
    /// Never.
    Constant,
    /// r' = 0.95 r every pass, whatever alpha: shrinks so fast that the variance of the mean grows again. A negative control.
    Geometric,
    /// The same radii, but flux divided by r₁ r instead of r²: the picture dims pass by pass. A negative control.
    GeometricAsCoded,
}

impl Rule {
    /// Whether radii depend on the photons found: then every pass needs all passes before it.
    pub fn looks_at_photons(self) -> bool {
        self == Self::Local
    }
}

/// How a photon counts by its distance from the hit point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Kernel {
    /// All alike within the radius.
    Disc,
    /// Falling with the square of the distance: 2 (1 − d²/r²).
    Epanechnikov,
    /// 6 (1 − d²/r²)(1 − 2 d²/r²), without second moment: bias ~ r⁴ on smooth parts; may read below 0.
    FourthOrder,
}

/// Name of an index for gathering photons. The picture does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum IndexName {
    /// Every photon against every hit point (slow).
    Linear,
    /// A kd-tree over the hit points, split at the widest axis.
    Kdtree,
    /// A kd-tree over the hit points, axes in turn as in the original.
    KdtreeCycling,
    /// A grid over the photons.
    Grid,
    /// A tree of sixteen-wide nodes over the hit points.
    #[default]
    Wide,
    /// A tree of sixteen-wide nodes over the photons.
    WidePhotons,
}

/// Antialiasing of the `whitted` renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Antialias {
    /// One ray through each pixel's centre.
    None,
    /// Pixels whose path hash differs from a neighbour's are resampled.
    PathHash,
    /// Every pixel is resampled.
    Uniform,
    /// Pixels whose colour differs from a neighbour's by more than the threshold are resampled (Whitted 1980).
    Contrast,
    /// Every pixel 2×2; pixels whose four samples deviate by more than the threshold are resampled.
    Variance,
}

/// What enters the path hash; each takes in all that stands before it, but for `original`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Hash {
    /// Specular events and their objects alone, in 32 bits, as the course project had it: blind to diffuse objects.
    Original,
    /// All hits: object, piece, side, event, depth.
    Objects,
    /// And which lights are visible from the diffuse hits (of an area light, its middle).
    Shadow,
    /// And the texel or checker cell at the diffuse hits.
    Texture,
}

impl Hash {
    /// Whether lights and patterns enter.
    pub fn sees_shading(self) -> bool {
        matches!(self, Self::Shadow | Self::Texture)
    }
}

/// How a pixel is resampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
pub enum Resampling {
    /// At the centres of 2×2 cells.
    #[serde(rename = "2x2")]
    #[value(name = "2x2")]
    Two,
    /// At the centres of 3×3 cells.
    #[serde(rename = "3x3")]
    #[value(name = "3x3")]
    Three,
    /// At the centres of 4×4 cells.
    #[serde(rename = "4x4")]
    #[value(name = "4x4")]
    Four,
    /// At four of the centres of 4×4 cells, and at the other twelve where these and the middle differ.
    #[serde(rename = "adaptive")]
    #[value(name = "adaptive")]
    Adaptive,
}

/// How the random numbers of a pixel's camera samples are spread, by `path` and `whitted`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Not at all: every sample by itself.
    #[default]
    Independent,
    /// Each number, or pair, in a cell of its own of a grid.
    Stratified,
    /// By Sobol's sequence with Owen's scrambling.
    Sobol,
}

/// A feature beside the colours of a picture, written to EXR files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum Aov {
    /// Distance from the plane of the lens along the view axis.
    Depth,
    /// Unit normal in world space, on the side seen.
    Normal,
    /// Number of the object behind the pixel's centre.
    Object,
    /// Hash of the path behind the pixel's centre, as antialiasing compares it.
    PathHash,
    /// Gather radius, of photon mapping.
    Radius,
    /// Photons gathered, of photon mapping.
    Photons,
}

impl Aov {
    /// Whether only photon mapping has it.
    pub fn needs_photons(self) -> bool {
        matches!(self, Self::Radius | Self::Photons)
    }
}

/// Name of a solver for surfaces of revolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Bernstein isolation of the degree-6 polynomial.
    Bernstein,
    /// Newton in three variables from many starts.
    Newton,
    /// Bezier clipping in f64, without exact arithmetic where it cannot decide.
    Clipping,
    /// Exact arithmetic (slow).
    Exact,
}

/// The `[render]` table, and the flags of the same names. Absent keys are `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderTable {
    /// Integrator.
    pub integrator: Option<Integrator>,
    /// Samples per pixel, ≥ 1.
    pub spp: Option<u32>,
    /// How the random numbers of camera samples are spread.
    pub sampler: Option<Sampler>,
    /// Photon passes, ≥ 1.
    pub passes: Option<u64>,
    /// Seconds after which no further pass starts, > 0.
    pub time: Option<f64>,
    /// Photons per pass, ≥ 0.
    pub photons: Option<u64>,
    /// Share of new photons kept, in (0, 1].
    pub alpha: Option<f64>,
    /// First gather radius in world units, > 0.
    pub radius: Option<f64>,
    /// Radius rule.
    pub rule: Option<Rule>,
    /// Index over hit points or photons.
    pub index: Option<IndexName>,
    /// Kernel.
    pub kernel: Option<Kernel>,
    /// Antialiasing of `whitted`.
    pub aa: Option<Antialias>,
    /// What enters the path hash.
    pub hash: Option<Hash>,
    /// How antialiasing resamples.
    pub pattern: Option<Resampling>,
    /// Least difference that is resampled, > 0.
    pub threshold: Option<f64>,
    /// Solver.
    pub solver: Option<SolverName>,
    /// Threads, ≥ 1.
    pub threads: Option<usize>,
    /// Seed of all random numbers.
    pub seed: Option<u64>,
    /// Most scattering events of a path, ≥ 0; unlimited if absent.
    pub max_depth: Option<u32>,
    /// Feature channels of EXR files.
    pub aov: Option<Vec<Aov>>,
}

impl RenderTable {
    /// These values, and where absent those of `base`.
    #[must_use]
    pub fn or(self, base: &Self) -> Self {
        Self {
            integrator: self.integrator.or(base.integrator),
            spp: self.spp.or(base.spp),
            sampler: self.sampler.or(base.sampler),
            passes: self.passes.or(base.passes),
            time: self.time.or(base.time),
            photons: self.photons.or(base.photons),
            alpha: self.alpha.or(base.alpha),
            radius: self.radius.or(base.radius),
            rule: self.rule.or(base.rule),
            index: self.index.or(base.index),
            kernel: self.kernel.or(base.kernel),
            aa: self.aa.or(base.aa),
            hash: self.hash.or(base.hash),
            pattern: self.pattern.or(base.pattern),
            threshold: self.threshold.or(base.threshold),
            solver: self.solver.or(base.solver),
            threads: self.threads.or(base.threads),
            seed: self.seed.or(base.seed),
            max_depth: self.max_depth.or(base.max_depth),
            aov: self.aov.or_else(|| base.aov.clone()),
        }
    }
}
