//! The plots of `dose`.

use super::conclusion::{DEPTHS, Dose, Doses, between, relative_bias};
use crate::lab::claim::Estimate;
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::statistics::student_quantile;

pub(super) fn dose_plot(starts: &Doses, tolerance: &Doses, offset: &Doses) -> Plot {
    let named = [
        ("newton, 1 to 100 starts", starts),
        ("newton, tolerance", tolerance),
        ("bernstein, offset", offset),
    ];
    let measured = named.map(|(name, doses)| {
        let points = doses.all();
        let points = points.iter().filter(|dose| dose.faults > 0.0);
        Series::scattered(
            name,
            points.map(|dose| (dose.fault_rate(), dose.flip_share())),
        )
    });
    let all = starts.all();
    let queries = all.iter().map(|dose| dose.queries).sum::<f64>()
        / all.iter().map(|dose| dose.paths).sum::<f64>();
    let law = [1e-5, 0.2].map(|rate| (rate, rate * queries));
    let law = Series::predicted(format!("predicted: {queries:.2} queries a path"), law);
    Plot::new(
        "A fault is a flip: paths that go elsewhere against wrong answers",
        Axis::log("faults per query"),
        Axis::log("flips per path"),
        [law].into_iter().chain(measured),
    )
}

pub(super) fn depth_plot(starts: &[Dose]) -> Plot {
    let classes = (0..DEPTHS.len()).map(|depth| {
        let count = |dose: &Dose| {
            (
                dose.parameter,
                dose.by_depth[depth] as u64,
                dose.paths as u64,
            )
        };
        let seen = starts.iter().filter(|dose| dose.by_depth[depth] > 0.0);
        let name = format!("after {} specular events", DEPTHS[depth]);
        Series::shares(name, seen.map(count))
    });
    Plot::new(
        "Where paths go elsewhere: Newton's method",
        Axis::log("starts per piece"),
        Axis::log("flips per path"),
        classes.collect::<Vec<_>>(),
    )
}

/// Signed bias with 95 % intervals against the share of flips.
pub(super) fn bias_plot(named: &[(&str, &Doses)]) -> Plot {
    let series = named.iter().map(|(name, doses)| {
        let mut points: Vec<(f64, Estimate)> = (doses.all().iter())
            .map(|dose| {
                let at = dose.parameter;
                let bias = |doses: &[Dose]| relative_bias(&between(doses, at, at));
                (dose.flip_share(), doses.over_replicates(bias))
            })
            .filter(|point| point.0 > 0.0)
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let percent = |value: f64| 100.0 * value;
        Series::measured(*name, points.iter().map(|(x, e)| (*x, percent(e.value)))).with_intervals(
            points.iter().map(|(_, e)| {
                let half = student_quantile(0.975, e.freedom) * e.standard_error;
                (percent(e.value - half), percent(e.value + half))
            }),
        )
    });
    Plot::new(
        "The picture's bias against the paths that went elsewhere (bars: 95 %)",
        Axis::log("flips per path"),
        Axis::linear("bias of the mean radiance (%)"),
        series.collect::<Vec<_>>(),
    )
}

pub(super) fn error_plot(tolerance: &Doses, offset: &Doses) -> Plot {
    let shares = |name: &str, doses: &Doses| {
        let all = doses.all();
        let seen = all.iter().filter(|dose| dose.flips > 0.0);
        let count = |dose: &Dose| (dose.parameter, dose.flips as u64, dose.paths as u64);
        Series::shares(name, seen.map(count))
    };
    let root = [1e-8, 1e-1].map(|x: f64| (x, 0.6 * x.sqrt()));
    let line = [1e-3, 1e-1].map(|x| (x, 1.5 * x));
    Plot::new(
        "Errors too small to be faults flip paths as their root: long paths amplify them",
        Axis::log("offset (world units), or Newton's relative tolerance"),
        Axis::log("flips per path"),
        [
            Series::predicted("expected: ~ ε", line),
            Series::predicted("found: ~ √ε", root),
            shares("bernstein, offset ε", offset),
            shares("newton, tolerance ε", tolerance),
        ],
    )
}

pub(super) fn flat_plot(flat: &Doses) -> Plot {
    let all = flat.all();
    let shares = |name: &str, pick: &dyn Fn(&Dose) -> f64| {
        let seen = all.iter().filter(|dose| pick(dose) > 0.0);
        let count = |dose: &Dose| (dose.parameter, pick(dose) as u64, dose.paths as u64);
        Series::shares(name, seen.map(count))
    };
    let ends = [8.0, 1024.0];
    Plot::new(
        "A profile of straight pieces: finer pieces cure first flips, not those of long paths",
        Axis::log("straight pieces for each curved one, n"),
        Axis::log("flips per path"),
        [
            Series::predicted("expected: ~ 1/n", ends.map(|n| (n, 0.16 / n))),
            Series::predicted(
                "found: ~ n^-.4",
                ends.map(|n| (n, 0.2 * libm::pow(n, -0.4))),
            ),
            shares("all", &|dose| dose.flips),
            shares("before the first specular event", &|dose| dose.by_depth[0]),
            shares("after three or more", &|dose| dose.by_depth[3]),
        ],
    )
}
