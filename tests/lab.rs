//! The laboratory: nothing but the plan and the seed decides a table, and verdicts are what their rules say.

use photolathe::lab::claim::{Claim, Comparison, Doubt, Estimate, Subject, Verdict};
use photolathe::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Timing};
use photolathe::lab::runner::{Finished, RunOptions, Shard, run_experiment};
use photolathe::lab::table::is_time_column;
use photolathe::numeric::rng::{Purpose, Stream};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

fn subject(claim: &str, effort: Effort) -> Subject<'_> {
    Subject {
        experiment: "toy",
        claim,
        statement: "the mean of uniform numbers is one half",
        decided_at: Effort::Smoke,
        effort,
    }
}

const TOY: Experiment = Experiment {
    name: "toy",
    question: "Is the mean of uniform numbers one half?",
    prediction: "It is.",
    method: "Means of n numbers.",
    columns: &["n", "kind", "mean", "render_s"],
    timing: Timing::Untimed,
    cpu_seconds: [1.0, 10.0, 100.0],
    plan: |_| {
        let grid = [10_i64, 100, 1000]
            .into_iter()
            .flat_map(|n| ["a", "b"].map(|kind| (n, kind)));
        grid.map(|(n, kind)| Run::new([("n", n.into()), ("kind", kind.into())]))
            .collect()
    },
    execute: |run, _, seed| {
        let n = run.integer("n");
        let mut stream = Stream::new(seed, Purpose::Experiment, 0);
        let mean = (0..n).map(|_| stream.uniform()).sum::<f64>() / n as f64;
        let time = std::time::Instant::now().elapsed().as_secs_f64();
        let row = vec![
            n.into(),
            run.value("kind").clone(),
            mean.into(),
            time.into(),
        ];
        Ok(Outcome {
            rows: vec![row],
            ..Outcome::default()
        })
    },
    conclude: |table, effort| {
        let last = *table.numbers("mean").last().unwrap();
        let estimate = Estimate {
            value: last,
            standard_error: (1.0 / 12.0 / 1000.0_f64).sqrt(),
            freedom: f64::INFINITY,
            n: 1000,
        };
        Conclusion {
            claims: vec![Claim::equivalent(
                subject("half", effort),
                estimate,
                0.5,
                0.1,
            )],
            ..Conclusion::default()
        }
    },
};

fn options(out: &Path) -> RunOptions {
    RunOptions {
        effort: Effort::Smoke,
        seed: 7,
        threads: Some(2),
        out: out.to_owned(),
        shard: Shard::WHOLE,
    }
}

fn run(experiment: &Experiment, options: &RunOptions) -> Finished {
    run_experiment(experiment, options, &|_, _| ()).unwrap()
}

/// The CSV of a directory without its time columns.
fn timeless_csv(out: &Path) -> String {
    let mut reader = csv::Reader::from_path(out.join("toy.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let lines = std::iter::once(header.clone()).chain(reader.records().map(Result::unwrap));
    let kept = |line: csv::StringRecord| {
        let cells = header
            .iter()
            .zip(line.iter())
            .filter(|(name, _)| !is_time_column(name));
        cells
            .map(|(_, cell)| cell.to_owned())
            .collect::<Vec<_>>()
            .join(",")
            + "\n"
    };
    lines.map(kept).collect()
}

#[test]
fn threads_shards_and_order_do_not_change_the_table() {
    let whole = tempfile::tempdir().unwrap();
    let finished = run(&TOY, &options(whole.path()));
    assert_eq!((finished.missing, finished.reused), (0, 0));
    assert_eq!(finished.conclusion.claims[0].verdict, Verdict::Pass);
    let expected = timeless_csv(whole.path());
    assert_eq!(expected.lines().count(), 7);
    let means = finished.table.numbers("mean");
    assert_ne!(
        means[0], means[1],
        "runs of different names share random numbers"
    );
    let parts = tempfile::tempdir().unwrap();
    for (position, index) in [3, 1, 2].into_iter().enumerate() {
        let shard = Shard { index, count: 3 };
        let threads = Some(1 + position);
        let finished = run(
            &TOY,
            &RunOptions {
                shard,
                threads,
                ..options(parts.path())
            },
        );
        assert_eq!(finished.missing, 4 - 2 * position);
        assert_eq!(finished.conclusion.claims.len(), position / 2);
        assert_eq!(parts.path().join("toy.claims.json").exists(), position == 2);
    }
    assert_eq!(timeless_csv(parts.path()), expected);
}

#[test]
fn another_seed_gives_another_table() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(&TOY, &options(a.path()));
    run(
        &TOY,
        &RunOptions {
            seed: 8,
            ..options(b.path())
        },
    );
    assert_ne!(timeless_csv(a.path()), timeless_csv(b.path()));
}

#[test]
fn a_finished_run_is_never_run_again_and_a_lost_one_is() {
    static CALLS: AtomicUsize = AtomicUsize::new(0);
    let counted = Experiment {
        execute: |run, effort, seed| {
            CALLS.fetch_add(1, SeqCst);
            (TOY.execute)(run, effort, seed)
        },
        ..TOY
    };
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    run(&counted, &options(out));
    let expected = std::fs::read(out.join("toy.csv")).unwrap();
    assert_eq!(CALLS.load(SeqCst), 6);
    assert_eq!(run(&counted, &options(out)).reused, 6);
    assert_eq!(CALLS.load(SeqCst), 6);
    assert_eq!(std::fs::read(out.join("toy.csv")).unwrap(), expected);
    // An interrupted sweep: one record lost, one cut short, one of other settings.
    let mut records: Vec<_> = std::fs::read_dir(out.join("toy.records"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    records.sort();
    std::fs::remove_file(&records[0]).unwrap();
    let text = std::fs::read_to_string(&records[1]).unwrap();
    std::fs::write(&records[1], &text[..text.len() / 2]).unwrap();
    let text = std::fs::read_to_string(&records[2]).unwrap();
    std::fs::write(
        &records[2],
        text.replace("\"source\":\"", "\"source\":\"other"),
    )
    .unwrap();
    let before = timeless_csv(out);
    run(&counted, &options(out));
    assert_eq!(CALLS.load(SeqCst), 9);
    assert_eq!(timeless_csv(out), before);
    run(
        &counted,
        &RunOptions {
            effort: Effort::Standard,
            ..options(out)
        },
    );
    assert_eq!(CALLS.load(SeqCst), 15);
}

/// The most runs at once of an experiment whose runs sleep, on so many threads.
fn most_at_once(timing: Timing, threads: usize) -> usize {
    static NOW: AtomicUsize = AtomicUsize::new(0);
    static MOST: AtomicUsize = AtomicUsize::new(0);
    let sleeping = Experiment {
        timing,
        execute: |run, effort, seed| {
            MOST.fetch_max(NOW.fetch_add(1, SeqCst) + 1, SeqCst);
            std::thread::sleep(std::time::Duration::from_millis(20));
            NOW.fetch_sub(1, SeqCst);
            (TOY.execute)(run, effort, seed)
        },
        ..TOY
    };
    MOST.store(0, SeqCst);
    let directory = tempfile::tempdir().unwrap();
    let threads = Some(threads);
    let options = options(directory.path());
    run(&sleeping, &RunOptions { threads, ..options });
    MOST.load(SeqCst)
}

#[test]
fn runs_share_the_machine_only_as_their_clock_allows() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    assert_eq!(most_at_once(Timing::WholeMachine, 6), 1);
    assert_eq!(most_at_once(Timing::OwnThread, 1), 1);
    assert!(most_at_once(Timing::OwnThread, 6) <= cores);
    assert!(most_at_once(Timing::Untimed, 6) > 1);
}

#[test]
fn a_bad_run_is_an_error_that_names_it_and_costs_no_other() {
    let bad = Experiment {
        execute: |run, effort, seed| {
            anyhow::ensure!(
                run.text("kind") != "b" || run.integer("n") != 100,
                "the lamp broke"
            );
            (TOY.execute)(run, effort, seed)
        },
        ..TOY
    };
    let directory = tempfile::tempdir().unwrap();
    let error = run_experiment(&bad, &options(directory.path()), &|_, _| ()).unwrap_err();
    assert_eq!(
        format!("{error:#}"),
        "toy, run \"n=100 kind=b\": the lamp broke"
    );
    assert_eq!(
        std::fs::read_dir(directory.path().join("toy.records"))
            .unwrap()
            .count(),
        5
    );

    let narrow = Experiment {
        columns: &["n"],
        ..TOY
    };
    let fresh = tempfile::tempdir().unwrap();
    let error = run_experiment(&narrow, &options(fresh.path()), &|_, _| ()).unwrap_err();
    assert!(
        error
            .to_string()
            .ends_with("a row of 4 values for 1 columns")
    );
    let twice = Experiment {
        plan: |_| vec![Run::new([("n", 1_i64.into())]); 2],
        ..TOY
    };
    let error = run_experiment(&twice, &options(directory.path()), &|_, _| ()).unwrap_err();
    assert!(error.to_string().contains("same name"));
}

#[test]
fn shards_are_read_and_nonsense_is_refused() {
    assert_eq!("2/3".parse(), Ok(Shard { index: 2, count: 3 }));
    for text in [
        "0/3",
        "4/3",
        "1/0",
        "1",
        "a/b",
        "-1/2",
        "1/99999999999999999999999",
    ] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
}

fn estimate(value: f64, standard_error: f64) -> Estimate {
    Estimate {
        value,
        standard_error,
        freedom: f64::INFINITY,
        n: 100,
    }
}

#[test]
fn exact_claims_fail_at_the_first_failure() {
    let exact = |failures, n| Claim::exact(subject("none", Effort::Smoke), failures, n);
    let pass = exact(0, 1000);
    assert_eq!(pass.verdict, Verdict::Pass);
    assert!((pass.ci_high - 2.99e-3).abs() < 1e-5 && pass.detectable == pass.ci_high);
    assert_eq!(exact(1, 1_000_000).verdict, Verdict::Fail);
    assert_eq!(exact(0, 0).verdict, Verdict::Inconclusive);
}

#[test]
fn equivalence_is_proved_refuted_or_left_open() {
    let verdict = |value, error| {
        Claim::equivalent(
            subject("margin", Effort::Smoke),
            estimate(value, error),
            1.0,
            0.01,
        )
        .verdict
    };
    assert_eq!(verdict(1.0, 0.001), Verdict::Pass);
    assert_eq!(verdict(1.007, 0.001), Verdict::Pass);
    assert_eq!(verdict(1.009, 0.001), Verdict::Inconclusive);
    assert_eq!(verdict(1.02, 0.001), Verdict::Fail);
    assert_eq!(verdict(1.0, 0.01), Verdict::Inconclusive);
    assert_eq!(verdict(f64::NAN, 0.001), Verdict::Inconclusive);
    assert_eq!(verdict(1.0, f64::NAN), Verdict::Inconclusive);
}

#[test]
fn laws_and_nulls_need_their_precision() {
    let law = |value, error| {
        Claim::law(
            subject("slope", Effort::Smoke),
            estimate(value, error),
            -1.0,
            0.05,
        )
        .verdict
    };
    assert_eq!(law(-1.01, 0.01), Verdict::Pass);
    assert_eq!(law(-0.9, 0.01), Verdict::Fail);
    assert_eq!(law(-1.0, 0.03), Verdict::Inconclusive);
    let null = |value, error| {
        Claim::null(
            subject("null", Effort::Smoke),
            estimate(value, error),
            0.0,
            0.1,
        )
        .verdict
    };
    assert_eq!(null(0.01, 0.01), Verdict::Pass);
    assert_eq!(null(0.09, 0.01), Verdict::Fail);
    assert_eq!(null(0.0, 0.05), Verdict::Inconclusive);
}

/// Of `n` differences one is `worst` standard errors of .1 from 0, the others 0; `allowed` is taken off each.
fn family(worst: f64, n: usize, allowed: f64, needed: f64) -> Claim {
    let at = |value: f64| Comparison {
        difference: estimate(value, 0.1),
        allowed,
    };
    let mut all = vec![at(0.0); n];
    all[n / 2] = at(0.1 * worst);
    Claim::family(subject("blocks", Effort::Smoke), &all, needed)
}

#[test]
fn a_family_is_judged_by_its_worst_corrected_for_their_number() {
    // p = 2·10⁻⁹ at six standard errors.
    assert_eq!(family(6.0, 1, 0.0, 9.0).verdict, Verdict::Fail);
    let many = family(-6.0, 100, 0.0, 9.0);
    assert_eq!((many.verdict, many.doubt), (Verdict::Pass, Doubt::Second));
    assert_eq!(family(7.0, 100, 0.0, 9.0).verdict, Verdict::Fail);
    assert_eq!(family(4.9, 100, 0.0, 9.0).doubt, Doubt::First);
    assert_eq!(family(3.0, 100, 0.0, 9.0).doubt, Doubt::None);
    // Shown is the worst, with an interval for it alone, and what the level over their number would have seen.
    assert_eq!((many.predicted, many.n), (0.0, 100));
    assert!((many.measured + 0.6).abs() < 1e-15);
    assert!((many.ci_high - many.ci_low - 0.392).abs() < 1e-3);
    assert!(
        (many.detectable - 0.1 * (6.605 + 1.28)).abs() < 2e-3,
        "{}",
        many.detectable
    );
    // Known differences are taken off, and widen what is seen.
    let known = family(7.0, 100, 0.2, 9.0);
    assert_eq!((known.verdict, known.doubt), (Verdict::Pass, Doubt::First));
    assert!((known.detectable - many.detectable - 0.2).abs() < 1e-12);
    assert_eq!(family(0.0, 100, 0.0, 0.5).verdict, Verdict::Inconclusive);
    assert_eq!(
        family(f64::NAN, 100, 0.0, 9.0).verdict,
        Verdict::Inconclusive
    );
    let of = |all: &[Comparison]| Claim::family(subject("few", Effort::Smoke), all, 9.0);
    assert_eq!(of(&[]).verdict, Verdict::Inconclusive);
    let exact = |value: f64| Comparison {
        difference: estimate(value, 0.0),
        allowed: 0.01,
    };
    assert_eq!(of(&[exact(0.01), exact(-0.005)]).verdict, Verdict::Pass);
    assert_eq!(of(&[exact(0.0), exact(-0.02)]).verdict, Verdict::Fail);
}

/// 5000 families of 20 normal differences each: the first look rejects one in a thousand (at most 17 of them, 6 sigma).
#[test]
fn families_keep_their_rate_of_doubt() {
    let mut stream = Stream::new(23, Purpose::Test, 0);
    let mut normal = || {
        let [a, b] = stream.uniform2();
        (-2.0 * libm::log1p(-a)).sqrt() * libm::cos(std::f64::consts::TAU * b)
    };
    let mut doubtful = 0;
    for _ in 0..5000 {
        let all: Vec<Comparison> = (0..20)
            .map(|_| Comparison {
                difference: estimate(normal(), 1.0),
                allowed: 0.0,
            })
            .collect();
        let claim = Claim::family(subject("normal", Effort::Smoke), &all, 99.0);
        doubtful += usize::from(claim.doubt != Doubt::None);
    }
    assert!((1..=17).contains(&doubtful), "{doubtful}");
}

#[test]
fn ranges_contain_touch_or_miss_the_interval() {
    let range = |low, high| {
        Claim::in_range(
            subject("rate", Effort::Smoke),
            0.5 * (low + high),
            (low, high),
            10,
            (1.0, 2.0),
        )
        .verdict
    };
    assert_eq!(range(1.1, 1.9), Verdict::Pass);
    assert_eq!(range(0.9, 1.9), Verdict::Inconclusive);
    assert_eq!(range(2.1, 2.2), Verdict::Fail);
    assert_eq!(range(0.8, 0.9), Verdict::Fail);
}

/// Four standard errors raise doubt at .001; a second look rejects beyond 4.6, though one look alone would only beyond 5.9.
#[test]
fn a_second_look_rejects_at_its_own_level() {
    let look = |value| Claim::null(subject("n", Effort::Smoke), estimate(value, 1.0), 0.0, 9.0);
    let verdict = |second: Option<&Claim>| look(4.0).looked_at_again(second).verdict;
    assert_eq!(look(4.0).doubt, Doubt::First);
    assert_eq!([None, Some(&look(4.0))].map(verdict), [Verdict::Pass; 2]);
    assert_eq!(verdict(Some(&look(5.0))), Verdict::Fail);
}

#[test]
fn below_its_effort_a_claim_is_not_run_and_fails_nothing() {
    let late = Subject {
        decided_at: Effort::Standard,
        ..subject("late", Effort::Smoke)
    };
    let claim = Claim::exact(late, 3, 10);
    assert_eq!(claim.verdict, Verdict::NotRun);
    assert!(!claim.fails_the_run());
    let effort = Effort::Full;
    let decided = Claim::exact(Subject { effort, ..late }, 3, 10);
    assert!(decided.fails_the_run());
    let json = serde_json::to_string(&claim).unwrap();
    assert!(json.contains("\"verdict\":\"not run\"") && json.contains("\"effort\":\"standard\""));
}

/// A true prediction, 20 000 times: no null or law claim fails (level 1e-8), and 1 % errors of 10 standard errors always do; a
/// deviation of exactly the margin is "proved" equivalent in 1 % of cases (6 sigma: at most 290 of 20 000, at least 110).
#[test]
fn claims_keep_their_false_alarm_rates() {
    let mut stream = Stream::new(21, Purpose::Test, 0);
    let mut normal = || {
        let [a, b] = stream.uniform2();
        (-2.0 * libm::log1p(-a)).sqrt() * libm::cos(std::f64::consts::TAU * b)
    };
    let (mut alarms, mut missed, mut false_proofs) = (0, 0, 0);
    for _ in 0..20_000 {
        let noise = normal();
        let at = |value: f64| estimate(value + noise, 1.0);
        let smoke = |claim| subject(claim, Effort::Smoke);
        alarms += usize::from(Claim::null(smoke("n"), at(0.0), 0.0, 8.0).verdict == Verdict::Fail);
        alarms += usize::from(Claim::law(smoke("l"), at(0.0), 0.0, 2.0).verdict == Verdict::Fail);
        alarms +=
            usize::from(Claim::equivalent(smoke("e"), at(0.0), 0.0, 10.0).verdict != Verdict::Pass);
        missed += usize::from(Claim::null(smoke("n"), at(11.0), 0.0, 8.0).verdict != Verdict::Fail);
        false_proofs += usize::from(
            Claim::equivalent(smoke("e"), at(10.0), 0.0, 10.0).verdict == Verdict::Pass,
        );
    }
    assert_eq!((alarms, missed), (0, 0));
    assert!((110..=290).contains(&false_proofs), "{false_proofs}");
}
