//! Why do the failures of random restarts fall as a power of their number?

use super::cup::random_ray;
use super::newton_seeds::{LAW, LAW_FROM, POLICIES, SAME_SHEET};
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::newton::{NewtonSettings, StartPolicy};
use crate::geometry::revolution::{Placement, Revolution, Solver};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, grid, values,
};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::statistics::survival_exponent;
use crate::numeric::work::Work;
use std::collections::BTreeMap;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "basins",
    question: "Why do the failures of Newton's method fall as a power of its starts: how is the share of starts that reach the right \
               crossing distributed over rays?",
    prediction: "Of rays with share p, (1-p)^k fail after k starts. If P(p < x) ~ x^β near 0, failures fall as k^-β: so β = 1.9, \
                 the exponent of newton_seeds, and the shares, measured one start at a time, predict the failures at every k.",
    method: "Rays at the cup as in newton_seeds. A start is a round, one on every piece: p is the share of rounds whose nearest crossing \
             is the ray's (the Bernstein solver's, which newton_seeds and solvers check). Each ray gets rounds of fresh seeds until \
             8 were right, or 1600 were made (inverse sampling, Haldane 1945). The unbiased estimate of (1-p)^k is the share of \
             the orders of these outcomes that begin with k wrong rounds. Failures at k are those of the solver itself, with k \
             starts of another seed. β is the maximum-likelihood exponent of the survival of rays with fewer than 8 right rounds, \
             from 34 rounds on: there it looks at the shares that decide failures at 10 starts. Stratified starts are not independent: their p predicts only what independent ones would do.",
    columns: &[
        "policy",
        "starts",
        "right",
        "rays",
        "failed_1",
        "failed_3",
        "failed_10",
        "failed_30",
        "failed_100",
        "failed_200",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [2.6, 65.0, 870.0],
    plan: |_| grid([("policy", values(POLICIES.map(|(name, _)| name)))]),
    execute,
    conclude,
};

/// Right rounds after which a ray's share is known well enough.
const ENOUGH: u32 = 8;
/// Most rounds of a ray.
const MOST: u32 = 1600;
/// Numbers of starts at which the solver itself is asked, as the columns say.
const ASKED: [u32; 6] = [1, 3, 10, 30, 100, 200];
/// Policies whose starts are independent of each other.
const INDEPENDENT: [&str; 2] = ["random-u", "solve-height"];
/// The policy whose starts are not.
const STRATIFIED: &str = "stratified";
/// Rounds in which fewer than [`ENOUGH`] are right for as many rays' shares as none of one start: (8 + β)/(1 + β) at β = 1.9.
const ROUNDS: f64 = (ENOUGH as f64 - LAW.0) / (1.0 - LAW.0);
/// Margin of the difference of the two exponents.
const SAME_LAW: f64 = 0.3;

fn settings(policy: StartPolicy, starts: u32, seed: u64) -> Solver {
    Solver::Newton(NewtonSettings {
        starts,
        policy,
        seed,
        ..NewtonSettings::default()
    })
}

/// A ray with its true t at the surface, to be asked by Newton's method.
struct Trial<'a> {
    surface: &'a Revolution,
    policy: StartPolicy,
    ray: Ray,
    t: f64,
}

impl Trial<'_> {
    fn right(&self, starts: u32, seed: u64, work: &mut Work) -> bool {
        let solver = settings(self.policy, starts, seed);
        let found = self.surface.nearest(&self.ray, &solver, work);
        found.is_some_and(|found| (found.t - self.t).abs() <= SAME_SHEET)
    }

    /// Rounds made, and how many of them were right.
    fn rounds(&self, work: &mut Work) -> (u32, u32) {
        let mut right = 0;
        for round in 1..=MOST {
            right += u32::from(self.right(1, u64::from(round), work));
            if right == ENOUGH {
                return (round, right);
            }
        }
        (MOST, right)
    }

    /// How many of [`ASKED`] fail: the first ones, as more starts begin with the same ones.
    fn failures(&self, work: &mut Work) -> usize {
        let right = |&starts: &u32| self.right(starts, 0, work);
        ASKED.iter().position(right).unwrap_or(ASKED.len())
    }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let name = run.text("policy");
    let policy = POLICIES.iter().find(|(known, _)| *known == name);
    let &(_, policy) = policy.ok_or_else(|| anyhow::anyhow!("no policy {name}"))?;
    let surface = Revolution::new(Profile::cup(), Placement::identity());
    let mut counts: BTreeMap<(u32, u32), [u64; 1 + ASKED.len()]> = BTreeMap::new();
    let mut work = Work::default();
    for index in 0..effort.of([30_000, 800_000, 10_000_000]) {
        let ray = random_ray(&mut Stream::new(seed, Purpose::Experiment, index));
        if let Some(truth) = surface.nearest(&ray, &Solver::Bernstein, &mut work) {
            let trial = Trial {
                surface: &surface,
                policy,
                ray,
                t: truth.t,
            };
            let count = counts.entry(trial.rounds(&mut work)).or_default();
            for counted in &mut count[..=trial.failures(&mut work)] {
                *counted += 1;
            }
        }
    }
    let row = |((starts, right), count): (&(u32, u32), &[u64; 1 + ASKED.len()])| {
        run.row([values([*starts, *right]), values(*count)].concat())
    };
    Ok(Outcome {
        rows: counts.iter().map(row).collect(),
        work,
    })
}

/// Rays with the same outcome of their rounds.
struct Count {
    starts: f64,
    right: f64,
    rays: f64,
    /// How many of them the solver failed, at each of [`ASKED`].
    failed: [f64; ASKED.len()],
}

impl Count {
    /// Unbiased estimate of (1 − p)^k, for k ≤ [`MOST`]: of all orders of the outcomes the share that begins with k wrong ones.
    fn all_wrong(&self, k: f64) -> f64 {
        // Where the eighth right round ended the search, it is the last in every order.
        let fixed = f64::from(u8::from(self.stopped()));
        let (free, right) = (self.starts - fixed, self.right - fixed);
        let factor = |i| ((free - k - f64::from(i)) / (free - f64::from(i))).max(0.0);
        (0..right as u32).map(factor).product()
    }

    fn stopped(&self) -> bool {
        self.right == f64::from(ENOUGH)
    }

    /// Unbiased estimate of p.
    fn share(&self) -> f64 {
        let fixed = f64::from(u8::from(self.stopped()));
        (self.right - fixed) / (self.starts - fixed)
    }
}

fn counts(table: &Table, policy: &str) -> Vec<Count> {
    let of_policy = table.filter("policy", &policy.into());
    let columns: [&str; 9] = std::array::from_fn(|i| EXPERIMENT.columns[i + 1]);
    let count = |[starts, right, rays, failed @ ..]: [f64; 9]| Count {
        starts,
        right,
        rays,
        failed,
    };
    of_policy.select(columns).into_iter().map(count).collect()
}

/// How many rays satisfy this.
fn rays(counts: &[Count], holds: impl Fn(&Count) -> bool) -> u64 {
    let of = counts.iter().filter(|count| holds(count));
    of.map(|count| count.rays).sum::<f64>() as u64
}

/// Rays that the solver failed at `ASKED[at]` starts.
fn failed(counts: &[Count], at: usize) -> f64 {
    counts.iter().map(|count| count.failed[at]).sum()
}

/// Rays expected to fail after k independent starts.
fn predicted(counts: &[Count], k: f64) -> f64 {
    let of = counts.iter().map(|count| count.rays * count.all_wrong(k));
    of.sum()
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let random = counts(table, INDEPENDENT[0]);
    let mut claims = Vec::new();
    for policy in INDEPENDENT {
        let counts = counts(table, policy);
        for (starts, least) in [(3, Effort::Smoke), (30, Effort::Standard)] {
            let name = format!("shares predict failures ({policy}, {starts} starts)");
            let statement = format!(
                "Measured over predicted failures at {starts} starts: the mean of (1-p)^{starts} over the rays ({policy})."
            );
            let subject = EXPERIMENT.subject(&name, &statement, least, effort);
            claims.push(Claim::null(subject, ratio(&counts, starts), 1.0, 0.5));
        }
    }
    claims.extend([
        law(&random, effort),
        one_law(&random, effort),
        stratified(table, effort),
    ]);
    Conclusion {
        claims,
        plots: vec![shares_plot(table), failures_plot(table)],
        ..Conclusion::default()
    }
}

/// Measured over predicted failures. Both numbers are of the same rays, so if starts are independent their difference has
/// expectation 0 for every ray, and its squares its variance.
fn ratio(counts: &[Count], starts: u32) -> Estimate {
    let at = ASKED.iter().position(|&k| k == starts).unwrap_or(0);
    let k = f64::from(starts);
    let expected = predicted(counts, k);
    let squares = counts.iter().map(|count| {
        let (wrong, failed) = (count.all_wrong(k), count.failed[at]);
        failed * (1.0 - wrong) * (1.0 - wrong) + (count.rays - failed) * wrong * wrong
    });
    let error = squares.sum::<f64>().sqrt() / expected;
    let hits = rays(counts, |_| true);
    Estimate::known(failed(counts, at) / expected, error, hits)
}

fn stratified(table: &Table, effort: Effort) -> Claim {
    let statement = "Stratified starts fail less often than independent ones of the same shares: measured over predicted failures at 10 \
                     starts are .4 to .9.";
    let subject = EXPERIMENT.subject(
        "stratified starts help",
        statement,
        Effort::Standard,
        effort,
    );
    let estimate = ratio(&counts(table, STRATIFIED), 10);
    let half = 2.0 * estimate.standard_error;
    let interval = (estimate.value - half, estimate.value + half);
    Claim::in_range(subject, estimate.value, interval, estimate.n, (0.4, 0.9))
}

/// Exponent −β of P(p < x) ~ x^β with its standard error, and the number of rays that it rests on, over the shares that decide the
/// failures at [`LAW_FROM`] starts and more.
///
/// The rays with fewer than m right rounds of n fall as n^-β, like those without any of k. Their mean n p is (m + β) β/(β + 1), and
/// β is the mean k p of the failures: both look at the same shares if n is [`ROUNDS`] times k.
fn exponent_of_shares(counts: &[Count]) -> (f64, f64, u64) {
    let levels = ASKED.iter().map(|&k| f64::from(k));
    let levels = levels.filter(|&k| k >= LAW_FROM).map(|k| {
        let rounds = ROUNDS * k;
        let short = |count: &Count| count.starts > rounds || !count.stopped();
        (rounds, rays(counts, short) as f64)
    });
    exponent(&levels.collect::<Vec<_>>())
}

/// Exponent of the solver's failures.
fn exponent_of_failures(counts: &[Count]) -> (f64, f64, u64) {
    let levels = ASKED.iter().enumerate();
    let levels = levels.map(|(at, &k)| (f64::from(k), failed(counts, at)));
    exponent(
        &levels
            .filter(|level| level.0 >= LAW_FROM)
            .collect::<Vec<_>>(),
    )
}

fn exponent(levels: &[(f64, f64)]) -> (f64, f64, u64) {
    let (value, error) = survival_exponent(levels).unwrap_or((f64::NAN, f64::NAN));
    (
        value,
        error,
        levels.first().map_or(0, |first| first.1 as u64),
    )
}

fn law(counts: &[Count], effort: Effort) -> Claim {
    let statement =
        "The share of rays with p < x falls as x^β with β within .4 of 1.9 (shown: -β; random-u).";
    let subject = EXPERIMENT.subject("law of shares", statement, Effort::Standard, effort);
    let (value, error, n) = exponent_of_shares(counts);
    Claim::equivalent(subject, Estimate::known(value, error, n), LAW.0, LAW.1)
}

fn one_law(counts: &[Count], effort: Effort) -> Claim {
    let statement = "The exponent of failures less that of the shares is 0 within .3: they are one law (random-u).";
    let subject = EXPERIMENT.subject("one law", statement, Effort::Standard, effort);
    let (shares, failures) = (exponent_of_shares(counts), exponent_of_failures(counts));
    // The same rays give both, which makes the true error smaller.
    let error = libm::hypot(shares.1, failures.1);
    let estimate = Estimate::known(failures.0 - shares.0, error, failures.2);
    Claim::equivalent(subject, estimate, 0.0, SAME_LAW)
}

/// The law of newton_seeds, .084 % at 30 starts, as one of shares: ∫ (1 − p)^k c β p^(β−1) dp = c Γ(β + 1) k^-β.
fn law_of_shares(x: f64) -> f64 {
    let beta = -LAW.0;
    8.4e-4 * libm::pow(30.0 * x, beta) / libm::tgamma(beta + 1.0)
}

fn shares_plot(table: &Table) -> Plot {
    let tenths = || (0..=20).map(|i| libm::exp10(-0.125 * f64::from(i)));
    let policies = INDEPENDENT.map(|policy| {
        let counts = counts(table, policy);
        let hits = rays(&counts, |_| true);
        let below = tenths().map(|x| (x, rays(&counts, |count| count.share() <= x), hits));
        Series::shares(policy, below.filter(|below| below.1 > 0))
    });
    let law = tenths().map(|x| (x, law_of_shares(x)));
    let law = Series::predicted(
        "predicted from newton_seeds: x^1.9",
        law.filter(|at| at.1 <= 1.0),
    );
    Plot::new(
        "Few rays have small basins, and their number falls as a power",
        Axis::log("share of starts that are right, estimated (x)"),
        Axis::log("share of hits with at most x"),
        [law].into_iter().chain(policies),
    )
}

fn failures_plot(table: &Table) -> Plot {
    let measured = POLICIES.map(|(policy, _)| {
        let counts = counts(table, policy);
        let hits = rays(&counts, |_| true);
        let asked = ASKED.iter().enumerate();
        let failed = asked.map(|(at, &k)| (f64::from(k), failed(&counts, at) as u64, hits));
        Series::shares(policy, failed.filter(|failed| failed.1 > 0))
    });
    let from_shares = INDEPENDENT.map(|policy| {
        let counts = counts(table, policy);
        let hits = rays(&counts, |_| true) as f64;
        let starts = ASKED.into_iter().chain([2, 5, 20, 50, 400]).map(f64::from);
        let mut points: Vec<_> = starts.map(|k| (k, predicted(&counts, k) / hits)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series::predicted(format!("predicted by the shares: {policy}"), points)
    });
    Plot::new(
        "The shares of single starts predict the failures of any number of independent ones",
        Axis::log("starts per piece"),
        Axis::log("share of hits missed or wrong"),
        from_shares.into_iter().chain(measured),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::table::Value;

    fn count(starts: u32, right: u32) -> Count {
        Count {
            starts: f64::from(starts),
            right: f64::from(right),
            rays: 1.0,
            failed: [0.0; ASKED.len()],
        }
    }

    fn choose(n: u32, k: u32) -> f64 {
        (0..k)
            .map(|i| f64::from(n - i) / f64::from(k - i))
            .product()
    }

    /// The expectation of an estimate over all outcomes of a ray of share p.
    fn expectation(p: f64, estimate: impl Fn(&Count) -> f64) -> f64 {
        let power = |x: f64, n: u32| libm::pow(x, f64::from(n));
        let stopped = (ENOUGH..=MOST).map(|n| {
            let orders = choose(n - 1, ENOUGH - 1);
            orders * power(p, ENOUGH) * power(1.0 - p, n - ENOUGH) * estimate(&count(n, ENOUGH))
        });
        let others = (0..ENOUGH).map(|right| {
            let orders = choose(MOST, right);
            orders * power(p, right) * power(1.0 - p, MOST - right) * estimate(&count(MOST, right))
        });
        stopped.sum::<f64>() + others.sum::<f64>()
    }

    #[test]
    fn the_estimates_are_unbiased() {
        for p in [0.7, 0.1, 0.004, 1e-4] {
            for k in [1.0, 3.0, 30.0, 200.0, 1600.0] {
                let expected = libm::pow(1.0 - p, k);
                let found = expectation(p, |count| count.all_wrong(k));
                assert!(
                    (found - expected).abs() < 1e-9 * expected.max(1e-3),
                    "{p} {k}: {found}"
                );
            }
        }
        let plain = |count: &Count| libm::pow(1.0 - count.right / count.starts, 30.0);
        assert!((expectation(0.1, plain) / libm::pow(0.9, 30.0) - 1.0).abs() > 0.01);
        assert!((expectation(0.1, Count::share) - 0.1).abs() < 1e-9);
    }

    /// The rows of rays whose shares follow P(p < x) = x^β, and of a solver whose starts are right `skill` times as often.
    fn planted(policy: &str, beta: f64, skill: f64) -> Vec<Vec<Value>> {
        let mut rows: BTreeMap<(u32, u32), [u64; 7]> = BTreeMap::new();
        for index in 0..200_000 {
            let mut s = Stream::new(7, Purpose::Test, index);
            let p = libm::pow(s.uniform(), 1.0 / beta);
            let (mut starts, mut right) = (0, 0);
            while starts < MOST && right < ENOUGH {
                starts += 1;
                right += u32::from(s.uniform() < p);
            }
            let first = libm::log(s.uniform()) / libm::log1p(-(p * skill).min(1.0 - 1e-9));
            let failures = ASKED.iter().filter(|&&k| f64::from(k) < first).count();
            for counted in &mut rows.entry((starts, right)).or_default()[..=failures] {
                *counted += 1;
            }
        }
        let row = |((starts, right), count): (&(u32, u32), &[u64; 7])| {
            let counts = [values([*starts, *right]), values(*count)].concat();
            [vec![policy.into()], counts].concat()
        };
        rows.iter().map(row).collect()
    }

    /// Verdicts on shares of an exponent, of a skill of the independent starts, and one of the stratified starts.
    fn verdicts(beta: f64, skill: f64, stratified: f64) -> Vec<Verdict> {
        let independent = INDEPENDENT.map(|policy| planted(policy, beta, skill));
        let rows = [independent.concat(), planted(STRATIFIED, beta, stratified)].concat();
        let claims = conclude(&EXPERIMENT.table(rows), Effort::Standard).claims;
        claims.iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn wrong_distributions_fail_the_claims() {
        use Verdict::{Fail, Pass};
        assert_eq!(verdicts(1.9, 1.0, 1.25), [Pass; 7]);
        assert_eq!(verdicts(1.1, 1.0, 1.4)[4..], [Fail, Pass, Pass]);
        let unskilled = verdicts(1.9, 0.5, 1.0);
        assert_eq!(unskilled[..4], [Fail; 4]);
        assert_eq!(unskilled[4..], [Pass, Pass, Fail]);
    }

    /// Failures that fall exponentially are another law than that of the shares.
    #[test]
    fn another_law_of_failures_fails_the_claim() {
        let mut table = EXPERIMENT.table(planted(INDEPENDENT[0], 1.9, 1.0));
        let last = table.column("failed_200");
        for row in &mut table.rows {
            for column in &mut row[last - 2..=last] {
                *column = 0_u64.into();
            }
        }
        for row in table.rows.iter_mut().take(2) {
            row[last - 2] = 20_u64.into();
        }
        let claims = conclude(&table, Effort::Standard).claims;
        assert_eq!(claims[5].verdict, Verdict::Fail);
    }

    #[test]
    fn nothing_is_concluded_of_no_rays() {
        let claims = conclude(&EXPERIMENT.table(Vec::new()), Effort::Standard).claims;
        assert!(claims.iter().all(Claim::fails_the_run));
    }
}
