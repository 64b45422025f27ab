//! What does a photon pass cost, in time and memory, as its parts grow?

use crate::lab::claim::Claim;
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, Value};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::scene;
use crate::numeric::clock::ProcessClock;
use crate::numeric::statistics::{Moments, fit_line};
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::options::{Integrator, RenderTable};
use crate::scene::{Scene, file};
use rayon::prelude::*;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "scaling",
    question: "What does a photon pass cost, in time and memory, with photons, pixels, objects and threads?",
    prediction: "CPU time in proportion to photons (slope 1) where pixels are few; a batch of photons bounds the memory, so that only hit \
                 points need more; every ray asks every object; two threads take half of the time on the wall, but for what must be \
                 done in order.",
    method: "Passes of `pppm` over the hourglass, and over rooms of many small spheres; CPU seconds of the process by phase (runs have \
             the machine to themselves), the first pass left out. Of equal passes the least time counts, as what else the machine does \
             only adds: such claims have no interval, and repeated runs differ. But a machine may be slow for minutes: in a replicate \
             of the sweep of photons all their numbers take turns, each replicate has a slope of its own, and the median of the slopes counts, with order statistics \
             that hold it in 98 % of runs. Nothing is taken off a pass: what does not \
             grow with the photons is 1 % of the shortest and bends the slope by less than .005. Bytes are counted: what the mapper holds at the fullest moment \
             (not the film). Threads take turns on the same passes: two threads, one alone, and one beside another that does a pass of its own \
             (`renders` 2). As a core may be slower when the other one works, the claim compares with the last: that is what two cores can give at all. The \
             median of such pairs counts, and the interval goes \
             from the lower to the upper quartile (with 18 pairs it holds the true median in 97 % of runs).",
    columns: &[
        "sweep",
        "threads",
        "renders",
        "photons",
        "pixels",
        "objects",
        "replicate",
        "hit_points",
        "segments",
        "stored",
        "bytes",
        "cpu_s",
        "wall_s",
        "camera_s",
        "trace_s",
        "build_s",
        "gather_s",
    ],
    timing: Timing::WholeMachine,
    cpu_seconds: [1.0, 140.0, 1000.0],
    plan,
    execute,
    conclude,
};

const PHOTONS: &str = "photons";
const PIXELS: &str = "pixels";
const OBJECTS: &str = "objects";
const THREADS: &str = "threads";

/// The pass that the speed goal names.
const GOAL: (i64, i64) = (100_000, 256);
/// CPU seconds that it may take, on one core of some 3 GHz.
const GOAL_SECONDS: f64 = 0.15;
/// Numbers of photons in the sweep of them, each twice the one before.
const LEVELS: i64 = 5;
/// Comparisons of one and two threads a replicate.
const PAIRS: i64 = 3;
/// Bytes a hit point and a stored photon.
const GOAL_BYTES: [f64; 2] = [300.0, 40.0];

fn plan(effort: Effort) -> Vec<Run> {
    let run = |sweep: &str, photons: i64, side: i64, objects: i64, replicate: i64| {
        Run::new([
            ("sweep", sweep.into()),
            ("photons", photons.into()),
            ("side", side.into()),
            ("objects", objects.into()),
            ("replicate", replicate.into()),
        ])
    };
    let mut runs = Vec::new();
    // Replicates outside, so that a slow minute of the machine spoils one of each and not all of one.
    for replicate in 0..effort.of([2, 20, 20]) {
        let fewest = effort.of([2_000, 50_000, 100_000]);
        runs.push(run(PHOTONS, fewest, 32, 0, replicate));
    }
    for replicate in 0..effort.of([2, 6, 12]) {
        for side in effort.of([[32, 64, 96], [64, 128, 256], [64, 256, 512]]) {
            runs.push(run(
                PIXELS,
                GOAL.0 / effort.of([10, 1, 1]),
                side,
                0,
                replicate,
            ));
        }
        for objects in effort.of([[1, 8, 64], [1, 16, 256], [1, 32, 1024]]) {
            runs.push(run(
                OBJECTS,
                effort.of([1_000, 10_000, 20_000]),
                32,
                objects,
                replicate,
            ));
        }
        for pair in 0..PAIRS {
            runs.push(run(
                THREADS,
                GOAL.0 / effort.of([10, 1, 1]),
                GOAL.1 / effort.of([4, 1, 1]),
                0,
                PAIRS * replicate + pair,
            ));
        }
    }
    runs
}

/// A closed room with a lamp and so many small diffuse spheres on a grid.
fn room_of_spheres(objects: i64) -> anyhow::Result<Scene> {
    let mut text = include_str!("scaling/room.toml").to_owned();
    let side = (1..)
        .find(|side| side * side * side >= objects)
        .unwrap_or(1);
    for number in 0..objects {
        let place = [number % side, number / side % side, number / (side * side)];
        let [x, y, z] = place.map(|i| 1.6 * (i as f64 + 0.5) / side as f64 - 0.8);
        let radius = 0.4 / side as f64;
        write!(
            text,
            "\n[[sphere]]\nname = \"sphere {number}\"\ncenter = [{x}, {y}, {z}]\nradius = {radius}\nmaterial = \"white\"\n"
        )?;
    }
    Ok(file::parse(&text, "room", Path::new(""), &[])?)
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let side = run.integer("side");
    let mut subject = match run.integer("objects") {
        0 => scene("hourglass", &[])?,
        objects => room_of_spheres(objects)?,
    };
    (subject.film.width, subject.film.height) = (side as u32, side as u32);
    let photons = run.integer("photons");
    // What takes turns: photons, threads, and renders at once. After the first turn, which only warms the caches, so many.
    let (players, turns): (Vec<(i64, usize, usize)>, _) = match run.text("sweep").as_str() {
        PHOTONS => {
            let players = (0..LEVELS).map(|level| (photons << level, 1, 1));
            (players.collect(), effort.of([1, 2, 4]))
        }
        THREADS => {
            let players =
                [(1, 1), (2, 1), (1, 2)].map(|(threads, at_once)| (photons, threads, at_once));
            (players.into(), effort.of([1, 4, 8]))
        }
        _ => (vec![(photons, 1, 1)], effort.of([1, 4, 8])),
    };
    let settings = |&(photons, ..): &(i64, usize, usize)| {
        Settings::resolve(&RenderTable {
            integrator: Some(Integrator::Pppm),
            photons: Some(photons as u64),
            seed: Some(seed),
            ..RenderTable::default()
        })
    };
    let settings: Vec<Settings> = players.iter().map(settings).collect();
    let mut courses = Vec::new();
    for ((_, threads, at_once), settings) in players.into_iter().zip(&settings) {
        courses.push(Course::new(&subject, settings, threads, at_once)?);
    }
    for pass in 0..=turns {
        for course in &mut courses {
            course.pass(pass);
        }
    }
    let objects = subject.objects.len() as i64;
    let row = |course: &Course| {
        let parameters = [
            run.value("sweep").clone(),
            (course.threads as i64).into(),
            (course.renders.len() as i64).into(),
            course.photons.into(),
            (side * side).into(),
            objects.into(),
            run.value("replicate").clone(),
        ];
        parameters.into_iter().chain(course.row()).collect()
    };
    let mut work = Work::default();
    courses.iter().for_each(|course| work += course.work);
    Ok(Outcome {
        rows: courses.iter().map(row).collect(),
        work,
    })
}

/// A render with threads of its own.
struct Render<'a> {
    pool: rayon::ThreadPool,
    mapper: PhotonMapper<'a>,
    film: Film,
}

impl<'a> Render<'a> {
    fn new(subject: &'a Scene, settings: &'a Settings, threads: usize) -> anyhow::Result<Self> {
        Ok(Self {
            pool: rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()?,
            mapper: PhotonMapper::new(subject, settings)?,
            film: Film::new(subject.film),
        })
    }

    /// Does a pass: work, wall seconds, and CPU seconds of the process by phase.
    fn pass(&mut self, pass: u64) -> (Work, f64, Phases) {
        let Self { pool, mapper, film } = self;
        let mut phases = Phases::default();
        let wall = Instant::now();
        let work = pool.install(|| mapper.pass(pass, film, &mut phases));
        (work, wall.elapsed().as_secs_f64(), phases)
    }
}

/// Passes of one render, or of several at once, each on so many threads, with the least time that any pass took: what the machine adds
/// is never less than nothing.
struct Course<'a> {
    photons: u64,
    threads: usize,
    renders: Vec<Render<'a>>,
    work: Work,
    segments: u64,
    stored: u64,
    /// CPU and wall seconds of a render, then its phases: means of all at once.
    least: [f64; 6],
}

impl<'a> Course<'a> {
    fn new(
        subject: &'a Scene,
        settings: &'a Settings,
        threads: usize,
        at_once: usize,
    ) -> anyhow::Result<Self> {
        let renders = (0..at_once).map(|_| Render::new(subject, settings, threads));
        Ok(Self {
            photons: settings.photons,
            threads,
            renders: renders.collect::<anyhow::Result<_>>()?,
            work: Work::default(),
            segments: 0,
            stored: 0,
            least: [f64::INFINITY; 6],
        })
    }

    fn pass(&mut self, pass: u64) {
        let clock = ProcessClock::start();
        let done: Vec<(Work, f64, Phases)> = match self.renders.as_mut_slice() {
            [alone] => vec![alone.pass(pass)],
            several => several
                .par_iter_mut()
                .map(|render| render.pass(pass))
                .collect(),
        };
        // The clock of the process counts what all renders take.
        let share = 1.0 / done.len() as f64;
        let mut times = [share * clock.seconds(), 0.0, 0.0, 0.0, 0.0, 0.0];
        for (work, wall, phases) in done {
            times[1] += share * wall;
            let Phases {
                camera,
                trace,
                build,
                gather,
            } = phases;
            for (time, phase) in times[2..].iter_mut().zip([camera, trace, build, gather]) {
                *time += share * share * phase;
            }
            self.work += work;
            self.segments = work.photon_segments;
            self.stored = work.photons_stored;
        }
        if pass > 0 {
            for (least, time) in self.least.iter_mut().zip(times) {
                *least = least.min(time);
            }
        }
    }

    fn row(&self) -> impl Iterator<Item = Value> {
        let mapper = |value: fn(&PhotonMapper) -> usize| {
            self.renders
                .first()
                .map_or(0, |render| value(&render.mapper))
        };
        let counts = [
            mapper(|mapper| mapper.hit_points().len()),
            self.segments as usize,
            self.stored as usize,
            mapper(|mapper| mapper.peak_bytes()),
        ];
        let counts = counts.map(|count| (count as i64).into());
        counts.into_iter().chain(self.least.map(Into::into))
    }
}

fn least(seconds: &[f64]) -> f64 {
    seconds.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Slope of CPU time against photons, of the logarithms.
fn slope(rows: &Table) -> f64 {
    let points = rows.select(["photons", "cpu_s"]);
    let logs: Vec<_> = (points.iter())
        .map(|&[photons, seconds]| (libm::log(photons), libm::log(seconds), 1.0))
        .collect();
    fit_line(&logs).map_or(f64::NAN, |fit| fit.slope)
}

/// The median of some values, and the order statistics 1.2 √n places from it, between which the true one lies with 98 % (2.4 standard
/// deviations of a binomial number).
fn median(mut values: Vec<f64>) -> (f64, (f64, f64)) {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let at = |place: usize| values.get(place).copied().unwrap_or(f64::NAN);
    let aside = (0.5 * n as f64 - 1.2 * (n as f64).sqrt()).max(0.0) as usize;
    let middle = 0.5 * (at(n.saturating_sub(1) / 2) + at(n / 2));
    (middle, (at(aside), at(n.saturating_sub(1 + aside))))
}

/// Rows of a sweep.
fn sweep(table: &Table, name: &str) -> Table {
    table.filter("sweep", &name.into())
}

/// How many times as fast two threads are as one, by replicate: one alone (`renders` 1), or beside another (2).
fn gains(table: &Table, renders: i64) -> Vec<f64> {
    let threads = sweep(table, THREADS);
    let walls = |threads_used: i64, renders: i64| {
        let part = threads.filter("threads", &threads_used.into());
        part.filter("renders", &renders.into()).numbers("wall_s")
    };
    let (one, two) = (walls(1, renders), walls(2, 1));
    one.iter().zip(&two).map(|(one, two)| one / two).collect()
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let standard =
        |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Standard, effort);
    let photons = sweep(table, PHOTONS);
    let slopes: Vec<f64> = (photons.distinct("replicate").iter())
        .map(|replicate| slope(&photons.filter("replicate", replicate)))
        .collect();
    let replicates = slopes.len() as u64;
    let (slope, slope_interval) = median(slopes);
    let mut gains = gains(table, 2);
    gains.sort_by(f64::total_cmp);
    let [lower, gain, upper] = [1, 2, 3].map(|quarter| {
        let place = gains.len() * quarter / 4;
        gains.get(place).copied().unwrap_or(f64::NAN)
    });
    let pixels = sweep(table, PIXELS);
    let goal = pixels.filter("pixels", &(GOAL.1 * GOAL.1).into());
    let seconds = goal.numbers("cpu_s");
    let rows = table.select(["hit_points", "stored", "bytes"]);
    let large = rows
        .iter()
        .filter(|[hits, stored, _]| *hits >= 1e4 && *stored >= 1e5);
    let over = large
        .clone()
        .filter(|[hits, stored, bytes]| *bytes > GOAL_BYTES[0] * hits + GOAL_BYTES[1] * stored);
    let claims = vec![
        Claim::in_range(
            standard(
                "linear in photons",
                "CPU time of a pass grows as the photons do: slope 1.00 ± 0.05 of the logarithms.",
            ),
            slope,
            slope_interval,
            replicates,
            (0.95, 1.05),
        ),
        Claim::in_range(
            standard(
                "two threads",
                "Two threads make a pass at least 1.8 times as fast as one that another works beside (wall time, in turns on the same passes).",
            ),
            gain,
            (lower, upper),
            gains.len() as u64,
            (1.8, 2.2),
        ),
        Claim::in_range(
            standard(
                "a pass in 0.15 s",
                "A pass of 100 000 photon paths over the hourglass at 256 × 256 takes at most 0.15 CPU seconds.",
            ),
            least(&seconds),
            (least(&seconds), least(&seconds)),
            seconds.len() as u64,
            (0.0, GOAL_SECONDS),
        ),
        Claim::exact(
            standard(
                "memory",
                "No pass of 10 000 hit points and 100 000 stored photons or more holds over 300 bytes a hit point and 40 a stored photon.",
            ),
            over.count() as u64,
            large.count() as u64,
        ),
    ];
    Conclusion {
        claims,
        plots: plots(table),
        ..Conclusion::default()
    }
}

fn plots(table: &Table) -> Vec<Plot> {
    let [alone, beside] = [1, 2].map(|renders| {
        let gains = gains(table, renders);
        (0_u32..).map(f64::from).zip(gains).collect::<Vec<_>>()
    });
    let mut plots = phases(table);
    plots.push(Plot::new(
        "Two threads against one: wall time, in turns",
        Axis::linear("comparison"),
        Axis::linear("times as fast"),
        [
            Series::scattered("as one alone", alone),
            Series::scattered("as one beside another", beside),
        ],
    ));
    plots
}

fn phases(table: &Table) -> Vec<Plot> {
    let phases = ["cpu_s", "camera_s", "trace_s", "build_s", "gather_s"];
    [
        (
            PHOTONS,
            "photons",
            "Time of a pass against its photons (32 × 32 pixels)",
            "photons",
        ),
        (
            PIXELS,
            "pixels",
            "Time of a pass against its pixels",
            "pixels",
        ),
        (
            OBJECTS,
            "objects",
            "Time of a pass against the objects of the scene",
            "objects",
        ),
    ]
    .map(|(name, column, title, label)| {
        let part = sweep(table, name);
        let series = phases.map(|phase| {
            let at = |value: Value| {
                let times = Moments::of(part.filter(column, &value).numbers(phase));
                (value.number().unwrap_or(f64::NAN), times.mean())
            };
            Series::measured(
                phase.trim_end_matches("_s"),
                part.distinct(column).into_iter().map(at),
            )
        });
        Plot::new(title, Axis::log(label), Axis::log("CPU time (s)"), series)
    })
    .into()
}
