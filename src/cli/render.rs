//! `photolathe render`: a scene in, pictures and statistics out.

use super::parse_override;
use super::pictures;
use super::remarks;
use super::resources;
use super::watch::viewers::Viewers;
use super::watch::{self, live, tev};
use crate::image::exr;
use crate::image::file::write_atomically;
use crate::image::part::Part;
use crate::image::picture::{Origin, Picture};
use crate::render::driver::Outcome;
use crate::render::photon::error::{Errors, Summary};
use crate::render::settings::Settings;
use crate::scene::options::{
    Antialias, Aov, Hash, IndexName, Integrator, Kernel, LARGEST, MOST_THREADS, RenderTable,
    Resampling, Rule, Sampler, SolverName,
};
use crate::scene::{Rgb, Scene, file};
use anyhow::{Context, bail};
use clap::Args;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Render a scene to EXR and PNG.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  photolathe render scenes/cup.toml                                 ppm as the scene says, out/cup.exr and out/cup.png
  photolathe render scenes/cup.toml --integrator path --spp 256 -o cup.exr
  photolathe render scenes/box.toml --time 30 -o box.png            as many passes as fit into 30 seconds
  photolathe render scenes/box.toml --reference truth.exr           the error after every pass, as CSV on stdout
  photolathe render scenes/box.toml --integrator pppm --pass-range 0..32 -o a.part    some passes, for `merge`
  photolathe render scenes/cup.toml --integrator sppm --time 60 --live 8080    watch it at http://127.0.0.1:8080/
  photolathe render scenes/cup.toml --aov depth,normal,object                  with channels for denoisers

The same scene, settings, seed and number of passes give the same bytes on any number of threads.
Ctrl-C ends the pass and writes the picture; a second Ctrl-C stops at once.")]
pub struct RenderArgs {
    /// Scene file.
    pub scene: PathBuf,
    /// Where to write, .exr or .png by extension; may be repeated (default: out/SCENE.exr and out/SCENE.png).
    #[arg(short, long = "out", value_name = "OUT")]
    pub out: Vec<PathBuf>,
    /// How light is transported.
    #[arg(long, value_enum)]
    pub integrator: Option<Integrator>,
    /// Samples per pixel: all for path and whitted, hit-point samples for ppm, samples a pass for sppm and pppm.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// How the random numbers of path's and whitted's samples are spread over pixel, lens, lights and directions (whitted: lens and lights;
    /// its places in the pixel are the pattern's). The variance in the picture takes samples as independent: a bound, if they are not.
    #[arg(long, value_enum)]
    pub sampler: Option<Sampler>,
    /// Photon passes.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    pub passes: Option<u64>,
    /// Only these passes, the first being 0, into a file that `merge` joins with the others: for photon mapping by a rule that does
    /// not look at photons.
    #[arg(long, value_name = "A..B", value_parser = pass_range)]
    pub pass_range: Option<Range<u64>>,
    /// Start no further pass after this many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    pub time: Option<f64>,
    /// Photons per pass.
    #[arg(long)]
    pub photons: Option<u64>,
    /// Share of new photons kept when the radius shrinks, in (0, 1].
    #[arg(long, value_parser = share)]
    pub alpha: Option<f64>,
    /// First gather radius in world units (default: 1.5 times the side of a pixel at the length of each camera path).
    #[arg(long, value_parser = positive)]
    pub radius: Option<f64>,
    /// How the radius shrinks.
    #[arg(long, value_enum)]
    pub rule: Option<Rule>,
    /// How photons are found at hit points; never changes a byte.
    #[arg(long, value_enum)]
    pub index: Option<IndexName>,
    /// How photons count by their distance.
    #[arg(long, value_enum)]
    pub kernel: Option<Kernel>,
    /// Antialiasing of whitted.
    #[arg(long, value_enum)]
    pub aa: Option<Antialias>,
    /// What enters the path hash.
    #[arg(long, value_enum)]
    pub hash: Option<Hash>,
    /// How antialiasing resamples.
    #[arg(long, value_enum)]
    pub pattern: Option<Resampling>,
    /// Least difference of sRGB colours, summed over channels, that is resampled: by contrast (default .3), by variance (default .1),
    /// and by the path hash where hashes differ (default 0: whatever differs).
    #[arg(long, value_parser = positive)]
    pub threshold: Option<f64>,
    /// How surfaces of revolution are solved.
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Threads (default: all cores); never changes a byte.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)))]
    pub threads: Option<u16>,
    /// Seed of all random numbers.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Most scattering events of a path (default: unlimited).
    #[arg(long)]
    pub max_depth: Option<u32>,
    /// Feature channels in the EXR, separated by commas; they change no bit of the colours. Depth and normal are means over the pixel's
    /// samples: Z, the distance from the lens along the view axis, of those that meet something (inf if none does), and N.X, N.Y, N.Z, in
    /// world space on the side seen, 0 counted for those that meet nothing. Of the pixel's centre: object, its number as `inspect` lists
    /// it (-1: none), and path_hash.high and .low, the hash (--hash) that antialiasing compares. Of photon mapping: radius, the latest,
    /// and photons gathered in all passes (both 0 where nothing gathers).
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAME,...")]
    pub aov: Vec<Aov>,
    /// Change a key of the scene file or the solver, as in --set film.width=64 or --set solver.starts=30.
    #[arg(long, value_name = "KEY=VALUE", value_parser = parse_override)]
    pub set: Vec<(String, String)>,
    /// Write counters and times as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Print the error against this picture after every pass, as CSV on stdout.
    #[arg(long, value_name = "REF.exr")]
    pub reference: Option<PathBuf>,
    /// Stop when relmse against the reference is at most this.
    #[arg(long, value_name = "RELMSE", requires = "reference", value_parser = positive)]
    pub target_error: Option<f64>,
    /// Serve a page that shows the picture while it is made, read-only, until the render ends: PORT alone means 127.0.0.1, which no
    /// other machine can reach; port 0 takes a free one, which stderr names. A slow or stalled browser does not hold the render up.
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = live::address)]
    pub live: Option<String>,
    /// Send the picture to the tev viewer about once a second and at the end (without a port: 14158). If tev does not listen or goes
    /// away, the render goes on.
    #[arg(long, value_name = "HOST:PORT", value_parser = tev::address)]
    pub tev: Option<String>,
    /// Factor on radiance for PNG and the live page: pixel = sRGB(exposure × radiance).
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub exposure: f64,
}

/// Most passes of a render that is made in parts: radii are computed pass after pass, and the last must be reached soon.
const MOST_PASSES: u64 = 1 << 30;

fn pass_range(text: &str) -> Result<Range<u64>, String> {
    let ends = text.split_once("..");
    match ends.map(|(start, end)| (start.parse(), end.parse())) {
        Some((Ok(start), Ok(end))) if start < end && end <= MOST_PASSES => Ok(start..end),
        _ => Err(format!(
            "expected two whole numbers as in 0..32, the first less than the second, which is at most {MOST_PASSES}"
        )),
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= LARGEST => Ok(value),
        _ => Err(format!("expected a number > 0 and at most {LARGEST:e}")),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err("expected a number in (0, 1]".to_owned()),
    }
}

impl RenderArgs {
    fn table(&self) -> RenderTable {
        RenderTable {
            integrator: self.integrator,
            spp: self.spp,
            sampler: self.sampler,
            passes: self.passes,
            time: self.time,
            photons: self.photons,
            alpha: self.alpha,
            radius: self.radius,
            rule: self.rule,
            index: self.index,
            kernel: self.kernel,
            aa: self.aa,
            hash: self.hash,
            pattern: self.pattern,
            threshold: self.threshold,
            solver: self.solver,
            threads: self.threads.map(usize::from),
            seed: self.seed,
            max_depth: self.max_depth,
            aov: (!self.aov.is_empty()).then(|| self.aov.clone()),
        }
    }

    /// The `--set` pairs, and `--solver` as one of them.
    fn overrides(&self) -> Vec<(String, String)> {
        let solver = self
            .solver
            .and_then(|solver| clap::ValueEnum::to_possible_value(&solver));
        let named = solver.map(|value| ("render.solver".to_owned(), value.get_name().to_owned()));
        self.set.iter().cloned().chain(named).collect()
    }

    fn outputs(&self) -> anyhow::Result<Vec<PathBuf>> {
        if let Some(range) = &self.pass_range {
            return self.output_of_part(range);
        }
        if self.out.is_empty() {
            let base = self.default_output()?;
            return Ok(vec![base.with_extension("exr"), base.with_extension("png")]);
        }
        pictures::check_names(&self.out)?;
        Ok(self.out.clone())
    }

    fn output_of_part(&self, range: &Range<u64>) -> anyhow::Result<Vec<PathBuf>> {
        match &self.out[..] {
            [] => {
                let extension = format!("{}-{}.part", range.start, range.end);
                Ok(vec![self.default_output()?.with_extension(extension)])
            }
            [path] if !pictures::is_picture(path) => Ok(vec![path.clone()]),
            _ => bail!(
                "--pass-range writes one part, not pictures: expected one -o with a name that does not end in .exr or .png"
            ),
        }
    }

    fn default_output(&self) -> anyhow::Result<PathBuf> {
        let stem = self
            .scene
            .file_stem()
            .context("the scene needs a file name")?;
        Ok(Path::new("out").join(stem))
    }

    /// The settings, with the passes of `--pass-range` as the planned ones.
    fn settings(&self, scene: &Scene) -> anyhow::Result<Settings> {
        let mut settings = Settings {
            estimate_errors: true,
            ..Settings::resolve(&self.table().or(&scene.render))
        };
        if settings.integrator.by_photons() && scene.background != Rgb::ZERO {
            let expected = "[0, 0, 0] for photon mapping, as no photon can start from a background";
            return Err(file::unfit(&self.scene, &self.overrides(), "background", expected).into());
        }
        if let Some(range) = &self.pass_range {
            if !settings.passes_are_independent() {
                bail!(
                    "--pass-range needs photon mapping by a rule that does not look at photons (--integrator pppm, or ppm or sppm \
                     with --rule global, constant or geometric): by {:?} with rule {:?} passes cannot be made apart",
                    settings.integrator,
                    settings.rule
                );
            }
            if let Some(passes) = self.passes.filter(|&passes| passes < range.end) {
                bail!(
                    "--pass-range {}..{} goes beyond --passes {passes}",
                    range.start,
                    range.end
                );
            }
            if !settings.aov.is_empty() {
                bail!(
                    "--pass-range writes sums of colours, without feature channels: expected no --aov (nor render.aov in the scene)"
                );
            }
            settings.passes = range.end;
        }
        Ok(settings)
    }
}

/// Runs `render`.
pub fn run(args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let start = Instant::now();
    let outputs = args.outputs()?;
    let scene = file::load(&args.scene, &args.overrides())?;
    let settings = args.settings(&scene)?;
    let remarks = remarks::on(&scene, &settings);
    let unwritten = remarks::unwritten(&settings, &outputs);
    let ignored = remarks::ignored(args, &settings);
    for note in ignored.iter().chain(&unwritten).chain(&remarks) {
        eprintln!("photolathe: {note}");
    }
    let reference = args
        .reference
        .as_deref()
        .map(|path| open_reference(path, &scene))
        .transpose()?;
    let files = outputs.iter().chain(&args.stats);
    pictures::check_places(files.map(PathBuf::as_path))?;
    let mut viewers = Viewers::open(args, &scene, &settings)?;

    let render_start = Instant::now();
    let outcome = watch::render(args, &scene, &settings, reference.as_ref(), &mut viewers)?;
    viewers.last(&outcome);
    let render_s = render_start.elapsed().as_secs_f64();
    let stats = statistics(&outcome, &settings, start.elapsed().as_secs_f64(), render_s);
    if let Some(summary) = outcome.errors.as_ref().and_then(Errors::summary) {
        eprintln!("photolathe: {}", estimated(summary, &settings));
    }
    let unseparated = outcome.work.unseparated;
    if unseparated > 0 {
        eprintln!(
            "photolathe: {unseparated} rays left points where rounding does not separate the two sides of a surface (a wall \
             thinner than the rounding of its place): they may have passed through it"
        );
    }
    // The pictures first: they are what the time was spent on.
    let written = write(args, &scene, settings, outcome, &outputs);
    let counted = args.stats.as_deref().map_or(Ok(()), |path| {
        write_atomically(path, format!("{stats:#}\n").as_bytes())
            .with_context(|| path.display().to_string())
    });
    pictures::all([written, counted])?;
    viewers.close();
    Ok(ExitCode::SUCCESS)
}

/// Writes the pictures, or the part that `--pass-range` asks for.
fn write(
    args: &RenderArgs,
    scene: &Scene,
    settings: Settings,
    outcome: Outcome,
    outputs: &[PathBuf],
) -> anyhow::Result<()> {
    let origin = Origin::of(scene, &settings);
    let film = match &args.pass_range {
        None => {
            let picture = Picture::of_film(&outcome.film)
                .with_features(outcome.features.as_ref())
                .described(&origin, outcome.passes);
            pictures::write(&picture, args.exposure, outputs)?;
            pictures::check_colours(&picture)?;
            outcome.film
        }
        Some(range) => {
            // Less than asked for if time ran out.
            let passes = range.start..range.start + outcome.passes;
            let part = Part {
                origin,
                passes,
                film: outcome.film,
            };
            for path in outputs {
                part.write(path)?;
                let Range { start, end } = part.passes;
                eprintln!(
                    "photolathe: wrote passes {start}..{end} to {}",
                    path.display()
                );
            }
            part.film
        }
    };
    pictures::check_samples(&film)
}

fn open_reference(path: &Path, scene: &Scene) -> anyhow::Result<Picture> {
    let reference = exr::read(path)?;
    let (width, height) = (scene.film.width as usize, scene.film.height as usize);
    if (reference.width, reference.height) != (width, height) {
        bail!(
            "{}: the reference has {}x{} pixels: expected {width}x{height} as the film",
            path.display(),
            reference.width,
            reference.height
        );
    }
    Ok(reference)
}

fn estimated(summary: Summary, settings: &Settings) -> String {
    // Samples that stay show no spread over the passes.
    let beside = match (settings.integrator, settings.spp) {
        (Integrator::Ppm, 1) => " beside the noise of 1 fixed camera sample a pixel".to_owned(),
        (Integrator::Ppm, spp) => {
            format!(" beside the noise of {spp} fixed camera samples a pixel")
        }
        _ => String::new(),
    };
    format!(
        "estimated error {:.2} % of the mean radiance{beside} (root mean square over pixels; noise {:.2} %, bias of the radius {:.2} %)",
        100.0 * summary.total(),
        100.0 * summary.noise,
        100.0 * summary.bias
    )
}

fn statistics(
    outcome: &Outcome,
    settings: &Settings,
    wall_s: f64,
    render_s: f64,
) -> serde_json::Value {
    let phases: serde_json::Map<_, _> = outcome
        .phases
        .iter()
        .map(|&(name, seconds)| (name.to_owned(), seconds.into()))
        .collect();
    let used = resources::used();
    let error = outcome.errors.as_ref().and_then(Errors::summary);
    serde_json::json!({
        "wall_s": wall_s,
        "cpu_s": used.cpu_s,
        "render_s": render_s,
        "threads": settings.threads.unwrap_or_else(rayon::current_num_threads),
        "seed": settings.seed,
        "passes": outcome.passes,
        "peak_bytes": used.peak_bytes,
        "bad_samples": outcome.film.bad_samples(),
        "estimated_noise": error.map(|summary| summary.noise),
        "estimated_bias": error.map(|summary| summary.bias),
        "phases": phases,
        "counters": outcome.work,
    })
}
