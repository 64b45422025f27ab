//! Joined shards and killed sweeps give the table of an unbroken run; two runs are told apart where they differ.

use photolathe::image::picture::Picture;
use photolathe::lab::claim::{Claim, Estimate, Subject, Verdict};
use photolathe::lab::contrast::Contrast;
use photolathe::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Timing};
use photolathe::lab::join::{Choice, Side, join};
use photolathe::lab::page::number;
use photolathe::lab::plot::{Plot, Series};
use photolathe::lab::report::{Report, Section};
use photolathe::lab::runner::{RunOptions, Shard, run_experiment};
use photolathe::lab::versus::{Agreement, Versus, agreement, pairs};
use photolathe::numeric::rng::{Purpose, Stream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};
use std::time::{Duration, Instant};

const RUNS: i64 = 60;
/// Names, to the child process, where to put its results.
const CHILD: &str = "PHOTOLATHE_TEST_CHILD_OUT";

const TOY: Experiment = Experiment {
    name: "toy",
    question: "Is the mean of uniform numbers one half?",
    prediction: "It is.",
    method: "One number a run.",
    columns: &["index", "value", "render_s"],
    timing: Timing::Untimed,
    cpu_seconds: [1.0, 10.0, 100.0],
    plan: |_| (0..RUNS).map(|i| Run::new([("index", i.into())])).collect(),
    execute: |run, _, seed| {
        let start = Instant::now();
        std::thread::sleep(Duration::from_millis(4));
        let value = Stream::new(seed, Purpose::Experiment, 0).uniform();
        let time = start.elapsed().as_secs_f64();
        let row = vec![run.integer("index").into(), value.into(), time.into()];
        Ok(Outcome {
            rows: vec![row],
            ..Outcome::default()
        })
    },
    conclude: |table, effort| {
        let values = table.numbers("value");
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let claim = Claim::null(subject(effort), estimate(mean, 0.037), 0.5, 1.0);
        Conclusion {
            claims: vec![claim],
            ..Conclusion::default()
        }
    },
};

fn subject(effort: Effort) -> Subject<'static> {
    Subject {
        experiment: "toy",
        claim: "half",
        statement: "the mean is one half",
        decided_at: Effort::Smoke,
        effort,
    }
}

fn estimate(value: f64, standard_error: f64) -> Estimate {
    Estimate {
        value,
        standard_error,
        freedom: RUNS as f64 - 1.0,
        n: RUNS as u64,
    }
}

fn run(out: &Path, seed: u64, shard: &str) {
    let options = RunOptions {
        effort: Effort::Smoke,
        seed,
        threads: Some(4),
        out: out.to_owned(),
        shard: shard.parse::<Shard>().unwrap(),
    };
    run_experiment(&TOY, &options, &|_, _| ()).unwrap();
}

/// The joined table of these directories as CSV, with its times set to nothing.
fn timeless(side: &Side) -> Vec<u8> {
    let mut table = side.joined[0].finished.table.clone();
    for row in &mut table.rows {
        row[2] = 0.0.into();
    }
    table.to_csv()
}

fn joined(directories: &[PathBuf]) -> anyhow::Result<Side<'static>> {
    join(directories, &[&TOY], Choice::default())
}

#[test]
fn shards_of_several_directories_join_to_the_unbroken_table() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    run(&at("whole"), 7, "1/1");
    let whole = joined(&[at("whole")]).unwrap();
    assert!(whole.joined[0].missing.is_empty());
    assert_eq!(whole.joined[0].finished.table.rows.len(), RUNS as usize);
    for shard in ["2/3", "1/3"] {
        run(&at(&shard[..1]), 7, shard);
    }
    let part = joined(&[at("2"), at("1")]).unwrap();
    let names: Vec<String> = (0..RUNS / 3)
        .map(|i| format!("index={}", 3 * i + 2))
        .collect();
    assert_eq!(part.joined[0].missing, names);
    assert!(part.joined[0].finished.conclusion.claims.is_empty());

    run(&at("3"), 7, "3/3");
    // A directory given twice, and a whole run beside its shards, agree with themselves.
    let side = joined(&[at("3"), at("1"), at("2"), at("2"), at("whole")]).unwrap();
    assert!(side.joined[0].missing.is_empty());
    let shards = joined(&[at("3"), at("1"), at("2")]).unwrap();
    assert_eq!(timeless(&shards), timeless(&whole));
    assert_eq!(
        shards.joined[0].finished.conclusion.claims,
        whole.joined[0].finished.conclusion.claims
    );
    // The CSV that `write` makes has the bytes of the runner's, times aside: here, those of the same records.
    whole.joined[0].finished.write(&TOY, &at("copy")).unwrap();
    let bytes = |name: &str| std::fs::read(at(name).join("toy.csv")).unwrap();
    assert_eq!(bytes("copy"), bytes("whole"));
}

#[test]
fn runs_that_do_not_belong_together_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    let refusal = |directories: &[PathBuf]| format!("{:#}", joined(directories).unwrap_err());
    assert!(refusal(&[at("absent")]).contains("no finished runs"));
    run(&at("a"), 1, "1/2");
    run(&at("b"), 2, "2/2");
    let text = refusal(&[at("a"), at("b")]);
    assert!(text.contains("seed 1") && text.contains("seed 2"), "{text}");
    let choice = Choice {
        seed: Some(2),
        ..Choice::default()
    };
    let side = join(&[at("a"), at("b")], &[&TOY], choice).unwrap();
    assert_eq!(side.joined[0].missing.len(), RUNS as usize / 2);
    // The same run with another result: the promise of equal bytes is broken somewhere.
    run(&at("c"), 1, "1/2");
    let record = std::fs::read_dir(at("c").join("toy.records"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let text = std::fs::read_to_string(&record).unwrap();
    let (before, after) = text.split_once("\"rows\":[[").unwrap();
    let (index, rest) = after.split_once(',').unwrap();
    let (_, rest) = rest.split_once(',').unwrap();
    std::fs::write(&record, format!("{before}\"rows\":[[{index},0.125,{rest}")).unwrap();
    assert!(refusal(&[at("a"), at("c")]).contains("different results of the same run"));
    std::fs::write(at("c").join("toy.csv"), "index,other,render_s\n").unwrap();
    assert!(refusal(&[at("c")]).contains("another version"));
}

/// Does nothing on its own: `a_killed_sweep_continues_to_the_unbroken_table` runs it in a process that it kills.
#[test]
fn child() {
    if let Some(out) = std::env::var_os(CHILD) {
        run(Path::new(&out), 7, "1/1");
    }
}

#[test]
fn a_killed_sweep_continues_to_the_unbroken_table() {
    let root = tempfile::tempdir().unwrap();
    let (whole, killed) = (root.path().join("whole"), root.path().join("killed"));
    run(&whole, 7, "1/1");
    let mut moments = Stream::new(5, Purpose::Test, 0);
    let mut cut = 0;
    for _ in 0..10 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child"])
            .env(CHILD, &killed)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_secs_f64(0.002 + 0.03 * moments.uniform()));
        child.kill().unwrap();
        child.wait().unwrap();
        let records = std::fs::read_dir(killed.join("toy.records"));
        let count = records.map_or(0, |records| {
            let names = records.map(|entry| entry.unwrap().file_name());
            names
                .filter(|name| name.to_string_lossy().ends_with(".json"))
                .count()
        });
        cut += usize::from((1..RUNS as usize).contains(&count));
    }
    assert!(cut > 0, "no kill came in the middle of the sweep");
    run(&killed, 7, "1/1");
    let (whole, killed) = (joined(&[whole]).unwrap(), joined(&[killed]).unwrap());
    assert!(killed.joined[0].missing.is_empty());
    assert_eq!(timeless(&killed), timeless(&whole));
}

/// One run that "measures" its prediction 0, off by what `shift` says of its seed, with a standard error of 1.
fn shifted(shift: fn(&Run, Effort, u64) -> anyhow::Result<Outcome>) -> Experiment {
    Experiment {
        columns: &["shift"],
        plan: |_| vec![Run::new([("index", 0_i64.into())])],
        execute: shift,
        conclude: |table, effort| {
            let estimate = Estimate {
                freedom: f64::INFINITY,
                ..estimate(table.numbers("shift")[0], 1.0)
            };
            Conclusion {
                claims: vec![Claim::null(subject(effort), estimate, 0.0, 10.0)],
                ..Conclusion::default()
            }
        },
        ..TOY
    }
}

fn shift_by(shift: f64) -> anyhow::Result<Outcome> {
    Ok(Outcome {
        rows: vec![vec![shift.into()]],
        ..Outcome::default()
    })
}

/// Standard errors of the two looks: .001 is at 3.29, 4e-6 at 4.61, 4e-9 at 5.88.
#[test]
fn fresh_random_numbers_decide_where_the_first_look_rejects() {
    static FIRST: AtomicU64 = AtomicU64::new(0);
    let once = shifted(|_, _, seed| {
        // The first seed seen is the first look's.
        let first = FIRST.compare_exchange(0, seed, SeqCst, SeqCst);
        let is_first = first.map_or_else(|known| known == seed, |_| true);
        shift_by(if is_first { 5.0 } else { 0.5 })
    });
    let cases = [
        (shifted(|_, _, _| shift_by(3.2)), Verdict::Pass, false),
        (shifted(|_, _, _| shift_by(3.4)), Verdict::Pass, true),
        (shifted(|_, _, _| shift_by(4.3)), Verdict::Pass, true),
        (shifted(|_, _, _| shift_by(4.7)), Verdict::Fail, true),
        (once, Verdict::Pass, true),
    ];
    for (experiment, verdict, twice) in cases {
        let root = tempfile::tempdir().unwrap();
        let options = RunOptions {
            effort: Effort::Smoke,
            seed: 3,
            threads: Some(1),
            out: root.path().to_owned(),
            shard: Shard::WHOLE,
        };
        let finished = run_experiment(&experiment, &options, &|_, _| ()).unwrap();
        let claim = &finished.conclusion.claims[0];
        assert_eq!(claim.verdict, verdict);
        assert_eq!(claim.statement.contains("Second look"), twice);
        assert_eq!(root.path().join("second").exists(), twice);
        let written = std::fs::read_to_string(root.path().join("toy.claims.json")).unwrap();
        assert_eq!(written.contains("Second look"), twice);
        let again = [root.path().to_owned()];
        let side = join(&again, &[&experiment], Choice::default()).unwrap();
        assert_eq!(
            side.joined[0].finished.conclusion.claims,
            finished.conclusion.claims
        );
        // Without the second look's records the first stands alone, at 4e-9.
        if twice {
            std::fs::remove_dir_all(root.path().join("second")).unwrap();
            let side = join(&again, &[&experiment], Choice::default()).unwrap();
            let claim = &side.joined[0].finished.conclusion.claims[0];
            assert_eq!(claim.verdict, Verdict::Pass);
            assert!(claim.statement.contains("no second"));
        }
    }
}

#[test]
fn two_measurements_differ_beyond_their_intervals_and_only_there() {
    let claim = |value| Claim::null(subject(Effort::Smoke), estimate(value, 0.01), 0.5, 1.0);
    // 59 degrees of freedom: 6.8 standard errors each at level 4e-9.
    let far = 7.0 * 0.01 * 2.0_f64.sqrt();
    assert_eq!(agreement(&claim(0.5), &claim(0.5)), Agreement::Same);
    for sign in [-1.0, 1.0] {
        let other = claim(0.5 + sign * far);
        assert_eq!(agreement(&claim(0.5), &other), Agreement::Different);
        let other = claim(0.5 + sign * 0.9 * far);
        assert_eq!(agreement(&claim(0.5), &other), Agreement::Same);
    }
    let moved = Claim {
        predicted: 0.6,
        ..claim(0.5)
    };
    let single = Claim { n: 1, ..claim(0.6) };
    for other in [moved, single, claim(f64::NAN)] {
        assert_eq!(agreement(&claim(0.5), &other), Agreement::NotComparable);
    }
}

#[test]
fn two_runs_are_paired_claim_by_claim() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    run(&at("a"), 1, "1/1");
    run(&at("b"), 2, "1/1");
    run(&at("c"), 2, "1/2");
    let [a, b, c] = ["a", "b", "c"].map(|name| joined(&[at(name)]).unwrap());
    let found = pairs(&a, &b);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].agreement, Agreement::Same);
    assert_eq!(found[0].b.as_ref().unwrap().verdict, Verdict::Pass);
    for found in [pairs(&a, &c), pairs(&c, &a)] {
        assert_eq!(found[0].agreement, Agreement::NotComparable);
        assert!(found[0].a.is_none() || found[0].b.is_none());
    }
}

/// An experiment with a pair of pictures and a plot of speed against error.
fn seen() -> Experiment {
    Experiment {
        conclude: |table, effort| {
            let picture = |value: f32| Picture {
                width: 2,
                height: 1,
                rgb: vec![[value; 3]; 2],
                ..Picture::default()
            };
            let method = |name, points: [(f64, f64); 2]| {
                Series::measured(name, points).with_labels(["coarse", "fine"])
            };
            Conclusion {
                plots: vec![Plot::speed_error(
                    "cost",
                    "CPU time (s)",
                    "error",
                    [
                        method("quick", [(1.0, 0.5), (2.0, 0.25)]),
                        method("slow", [(3.0, 0.5), (4.0, 0.125)]),
                    ],
                )],
                pictures: vec![Contrast {
                    caption: "a pair".to_owned(),
                    a: ("ours".to_owned(), picture(0.5)),
                    b: ("theirs".to_owned(), picture(0.25)),
                    commands: Vec::new(),
                }],
                ..(TOY.conclude)(table, effort)
            }
        },
        ..TOY
    }
}

#[test]
fn the_page_shows_two_runs_pairs_of_pictures_and_fronts_without_a_network() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    run(&at("a"), 1, "1/1");
    run(&at("b"), 2, "1/1");
    let experiment = seen();
    let side = |name: &str| join(&[at(name)], &[&experiment], Choice::default()).unwrap();
    let (mut a, b) = (side("a"), side("b"));
    let against = Versus::new(&a, &b, &pairs(&a, &b));
    let finished = a.joined.remove(0).finished;
    let measured = b.joined[0].finished.conclusion.claims[0].measured;
    let page = Report {
        effort: Effort::Smoke,
        seed: 1,
        command: "photolathe report a --against b".to_owned(),
        seconds: 1.0,
        machines: a.machines.clone(),
        other_claims: Vec::new(),
        pictures: Vec::new(),
        sections: vec![Section {
            experiment: &experiment,
            result: Ok(finished),
            command: "cargo run --release --bin toy".to_owned(),
        }],
        against: Some(against),
    };
    let html = page.html().unwrap();
    for word in [
        "1 claims in two runs: 0 different, 0 not comparable, 1 the same",
        "60 of 60 rows differ",
        &number(measured),
        "a pair",
        "alt=\"A: ours\"",
        "alt=\"B: theirs\"",
        "+0.25",
        "quick at coarse, fine; slow at fine.",
        "cargo run --release --bin toy",
        "<script>",
    ] {
        assert!(html.contains(word), "{word}");
    }
    for outside in [
        "http:", "https:", "//cdn", "@import", "url(", "<link", "src=\"/",
    ] {
        assert!(
            !html.contains(outside),
            "{outside}: the page needs a network"
        );
    }
    assert_eq!(
        html.matches("src=\"").count(),
        html.matches("src=\"data:image/png").count()
    );
    assert!(html.find("id=\"claims\"").unwrap() < html.find("id=\"toy\"").unwrap());
}
