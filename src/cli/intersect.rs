//! `photolathe intersect`: rays in, hits out.

use super::parse_override;
use crate::geometry::hit::Hit;
use crate::geometry::ray::Ray;
use crate::image::file::stream_atomically;
use crate::numeric::work::Work;
use crate::scene::options::SolverName;
use crate::scene::{Scene, file};
use anyhow::{Context, bail};
use clap::Args;
use glam::DVec3;
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Rays handed to the threads at a time.
const BATCH: usize = 1 << 14;

/// Rays that one thread takes at a time.
const TOGETHER: usize = 1 << 9;

/// Intersect a list of rays with a scene.
#[derive(Debug, Args)]
#[command(after_help = "\
The input has a header with the columns ox,oy,oz,dx,dy,dz and optionally tmin,tmax (default 0 and inf); other columns are
ignored. The output has one row per ray: hit,t,object,piece,u,theta,nx,ny,nz, where hit is 0 or 1 and the rest is blank on a
miss. Numbers are printed so that they parse back to the same bits. A ray that is not finite, has no direction or an empty
range meets nothing.

With --all there is one row per crossing, by rising t, with the ray's number (from 0) in a column `ray` in front.
piece, u and theta (radians) describe surfaces of revolution; for a sphere piece is 0 and u the height from 0 to 1, for flat
shapes piece and theta are 0 and u is the texture coordinate s.")]
pub struct IntersectArgs {
    /// Scene file.
    pub scene: PathBuf,
    /// CSV of rays; - reads standard input.
    #[arg(long, value_name = "IN.csv")]
    pub rays: PathBuf,
    /// Where to write; standard output if absent.
    #[arg(short, long, value_name = "OUT.csv")]
    pub out: Option<PathBuf>,
    /// How surfaces of revolution are solved.
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Every crossing instead of the nearest.
    #[arg(long)]
    pub all: bool,
    /// Change a key of the scene file or the solver, as in --set solver.starts=30.
    #[arg(long, value_name = "KEY=VALUE", value_parser = parse_override)]
    pub set: Vec<(String, String)>,
    /// Threads (default: all cores); never changes the output.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
}

/// Runs `intersect`.
pub fn run(args: &IntersectArgs) -> anyhow::Result<ExitCode> {
    let mut overrides = args.set.clone();
    if let Some(solver) = args.solver {
        let name =
            clap::ValueEnum::to_possible_value(&solver).context("every solver has a name")?;
        overrides.push(("render.solver".to_owned(), name.get_name().to_owned()));
    }
    let scene = file::load(&args.scene, &overrides)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0).into())
        .build()?;
    match &args.out {
        None => intersect_all(
            &scene,
            args,
            &pool,
            &mut io::BufWriter::new(io::stdout().lock()),
        )?,
        Some(path) => stream_atomically(path, |file| {
            intersect_all(&scene, args, &pool, &mut io::BufWriter::new(file))
        })
        .with_context(|| path.display().to_string())?,
    }
    Ok(ExitCode::SUCCESS)
}

fn intersect_all(
    scene: &Scene,
    args: &IntersectArgs,
    pool: &rayon::ThreadPool,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    let mut rays = RayReader::open(&args.rays)?;
    writeln!(
        out,
        "{}hit,t,object,piece,u,theta,nx,ny,nz",
        if args.all { "ray," } else { "" }
    )?;
    let mut number = 0;
    let mut invalid = 0_u64;
    loop {
        let batch = rays.batch()?;
        if batch.is_empty() {
            break;
        }
        invalid += batch.iter().filter(|ray| !ray.is_valid()).count() as u64;
        let answer = |(index, rays): (usize, &[Ray])| {
            if args.all {
                all_rows(scene, number + index * TOGETHER, rays)
            } else {
                rows(scene, rays)
            }
        };
        let texts: Vec<String> =
            pool.install(|| batch.par_chunks(TOGETHER).enumerate().map(answer).collect());
        for text in texts {
            out.write_all(text.as_bytes())?;
        }
        number += batch.len();
    }
    out.flush()?;
    if invalid > 0 {
        eprintln!(
            "photolathe: {invalid} of {number} rays are not finite, without direction or of empty range: no hit"
        );
    }
    Ok(())
}

/// The output rows of the nearest hits, each with its line end.
fn rows(scene: &Scene, rays: &[Ray]) -> String {
    let hits = scene.intersect_many(rays, &mut Work::default());
    let text = |hit: &Option<Hit>| match hit {
        Some(hit) => row(scene, hit) + "\n",
        None => "0,,,,,,,,\n".to_owned(),
    };
    hits.iter().map(text).collect()
}

/// The output rows of all hits of rays that are numbered from `first`.
fn all_rows(scene: &Scene, first: usize, rays: &[Ray]) -> String {
    let mut work = Work::default();
    let mut text = String::new();
    for (number, ray) in (first..).zip(rays) {
        for hit in scene.intersect_all(ray, &mut work) {
            text += &format!("{number},{}\n", row(scene, &hit));
        }
    }
    text
}

fn row(scene: &Scene, hit: &Hit) -> String {
    let name = &scene.objects[hit.object].name;
    let name = if name.contains([',', '"', '\n']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.clone()
    };
    let DVec3 { x, y, z } = hit.normal;
    format!(
        "1,{:?},{name},{},{:?},{:?},{x:?},{y:?},{z:?}",
        hit.t,
        hit.piece,
        hit.u,
        hit.theta()
    )
}

/// Reads rays from CSV, a batch at a time.
struct RayReader {
    name: String,
    reader: csv::Reader<Box<dyn io::Read>>,
    columns: [Option<usize>; COLUMNS.len()],
    record: csv::StringRecord,
}

const COLUMNS: [&str; 8] = ["ox", "oy", "oz", "dx", "dy", "dz", "tmin", "tmax"];
const REQUIRED: usize = 6;

impl RayReader {
    fn open(path: &Path) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        let input: Box<dyn io::Read> = if name == "-" {
            Box::new(io::stdin())
        } else {
            Box::new(
                std::fs::File::open(path)
                    .with_context(|| format!("{name}: cannot open the rays"))?,
            )
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(input);
        let headers = reader
            .headers()
            .with_context(|| format!("{name}: cannot read the header"))?
            .clone();
        let columns = COLUMNS.map(|column| headers.iter().position(|header| header == column));
        if let Some(missing) = (0..REQUIRED).find(|&index| columns[index].is_none()) {
            bail!(
                "{name}:1:1: column `{}` is missing: expected a header with ox,oy,oz,dx,dy,dz and optionally tmin,tmax",
                COLUMNS[missing]
            );
        }
        Ok(Self {
            name,
            reader,
            columns,
            record: csv::StringRecord::new(),
        })
    }

    fn batch(&mut self) -> anyhow::Result<Vec<Ray>> {
        let mut batch = Vec::new();
        while batch.len() < BATCH {
            if !self
                .reader
                .read_record(&mut self.record)
                .with_context(|| self.name.clone())?
            {
                break;
            }
            let [ox, oy, oz, dx, dy, dz] = std::array::from_fn(|index| self.number(index, None));
            let [t_min, t_max] = [
                self.number(6, Some(0.0)),
                self.number(7, Some(f64::INFINITY)),
            ];
            let origin = DVec3::new(ox?, oy?, oz?);
            let direction = DVec3::new(dx?, dy?, dz?);
            batch.push(Ray {
                origin,
                direction,
                t_min: t_min?,
                t_max: t_max?,
            });
        }
        Ok(batch)
    }

    fn number(&self, column: usize, default: Option<f64>) -> anyhow::Result<f64> {
        let field = self.columns[column].map(|index| (index, self.record.get(index).unwrap_or("")));
        match (field, default) {
            (None | Some((_, "")), Some(default)) => Ok(default),
            (Some((index, text)), _) => text.parse().map_err(|_| {
                let line = self.record.position().map_or(0, csv::Position::line);
                anyhow::anyhow!(
                    "{}:{line}: field {} (`{}`) is `{text}`: expected a number",
                    self.name,
                    index + 1,
                    COLUMNS[column]
                )
            }),
            (None, None) => bail!("column `{}` is missing", COLUMNS[column]),
        }
    }
}
