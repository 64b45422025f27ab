//! `photolathe rays`: a suite of rays with certified answers.

use crate::image::file::stream_atomically;
use crate::lab::families::Family;
use crate::lab::progress::Progress;
use crate::lab::suite::{COLUMNS, Suite};
use crate::scene::file;
use anyhow::{Context, bail};
use clap::{Args, ValueEnum as _};
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Rays handed to the threads at a time.
const BATCH: u64 = 1 << 10;

/// Write rays with certified answers, by which any program can be graded.
#[derive(Debug, Args)]
#[command(after_help = after_help())]
pub struct RaysArgs {
    /// Scene file; it must hold a surface of revolution.
    pub scene: PathBuf,
    /// A family below, or `all` for every one that fits the scene.
    #[arg(long, value_name = "NAME", value_parser = parse_choice)]
    pub family: Choice,
    /// Rays of each family.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub count: u64,
    /// Seed of the rays.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Where to write; standard output if absent.
    #[arg(short, long, value_name = "RAYS.csv")]
    pub out: Option<PathBuf>,
    /// Threads (default: all cores); never changes the output.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
}

/// What `--family` asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// One family.
    One(Family),
    /// Every family that fits.
    All,
}

fn parse_choice(text: &str) -> Result<Choice, String> {
    if text == "all" {
        return Ok(Choice::All);
    }
    Family::named(text).map(Choice::One).ok_or_else(|| {
        let names: Vec<String> = Family::value_variants().iter().map(|f| f.name()).collect();
        format!("expected all, or one of {}", names.join(", "))
    })
}

fn after_help() -> String {
    let families: String = Family::value_variants()
        .iter()
        .map(|family| format!("  {:17} {}\n", family.name(), family.recipe()))
        .collect();
    format!(
        "\
The rays go to another program (`photolathe intersect`, POV-Ray, a mesh ...), its answers to `photolathe grade`:
  photolathe rays scenes/hard/cup.toml --family all --count 1000 --seed 1 -o rays.csv
  photolathe intersect scenes/hard/cup.toml --rays rays.csv -o theirs.csv
  photolathe grade rays.csv theirs.csv --html grade.html

Families (a size is the greater of radius and height of the surface's bounding cylinder):
{families}
Rays aim at the surfaces of revolution, in turn. The answers are those of the whole scene, whose other objects may stand in the way.

Columns: ray (number), family, ox,oy,oz,dx,dy,dz,tmin,tmax as `intersect` reads them, and the truth:
  true_hit          0 or 1, decided in exact arithmetic on the scene's numbers as stored; a tangency is a hit
  true_t            the nearest crossing, rounded; true_t_low and true_t_high are the floats between which it lies
  true_object, true_piece, true_u   where; as `intersect` tells
  multiplicity      of the root: 1, or 2 and more at a tangency and on the axis
  cosine            |n.d|/|d|: an error e of position moves t by e/(|d| cosine)
  second_t          the next crossing, to tell a wrong root; blank if there is none
  scale             size of the coordinates that enter: |o| + t|d|, at least the reach of the scene
  margin            the least displacement of the ray, of those tried from 1e-15 to 1e-2 scale, that changes the answer; inf if none
  suite             version, hash of the scene, seed"
    )
}

/// Runs `rays`.
pub fn run(args: &RaysArgs) -> anyhow::Result<ExitCode> {
    let scene = file::load(&args.scene, &[])?;
    let name = args.scene.display();
    let suite = Suite::new(&scene, args.seed).with_context(|| {
        format!("{name}: no surface of revolution to aim at: expected a [[revolution]]")
    })?;
    let families = families(&suite, args.family).with_context(|| name.to_string())?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0).into())
        .build()?;
    let write = |out: &mut dyn Write| write_all(&suite, &families, args.count, &pool, out);
    match &args.out {
        None => write(&mut io::BufWriter::new(io::stdout().lock()))?,
        Some(path) => stream_atomically(path, |file| write(&mut io::BufWriter::new(file)))
            .with_context(|| path.display().to_string())?,
    }
    Ok(ExitCode::SUCCESS)
}

fn families(suite: &Suite, choice: Choice) -> anyhow::Result<Vec<Family>> {
    let wanted = match choice {
        Choice::One(family) => {
            suite.fits(family)?;
            return Ok(vec![family]);
        }
        Choice::All => Family::value_variants(),
    };
    let mut fitting = Vec::new();
    for &family in wanted {
        match suite.fits(family) {
            Ok(()) => fitting.push(family),
            Err(unfit) => eprintln!("photolathe: {unfit}"),
        }
    }
    if fitting.is_empty() {
        bail!("no family fits the scene");
    }
    Ok(fitting)
}

fn write_all(
    suite: &Suite,
    families: &[Family],
    count: u64,
    pool: &rayon::ThreadPool,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    writeln!(out, "{COLUMNS}")?;
    for (place, &family) in (0..).zip(families) {
        let name = family.name();
        let progress = Progress::start(&name);
        for start in (0..count).step_by(BATCH as usize) {
            let line = |index| suite.line(place * count + index, family, index);
            let end = count.min(start + BATCH);
            let lines: Result<Vec<String>, _> =
                pool.install(|| (start..end).into_par_iter().map(line).collect());
            for line in lines? {
                out.write_all(line.as_bytes())?;
            }
            progress.tell(end as usize, count as usize);
        }
        progress.end(&format!("{count} rays"));
    }
    out.flush()?;
    Ok(())
}
