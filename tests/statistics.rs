//! The statistics give the values of SciPy 1.17 (or of the named source) and raise the alarms they promise, no more and no fewer.

use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::statistics::*;

fn close(ours: f64, theirs: f64, relative: f64) {
    let scale = theirs.abs().max(f64::MIN_POSITIVE);
    assert!(
        (ours - theirs).abs() <= relative * scale,
        "{ours} against {theirs}"
    );
}

const A: [f64; 10] = [19.8, 20.4, 19.6, 17.8, 18.5, 18.9, 18.3, 18.9, 19.5, 22.0];
const B: [f64; 20] = [
    28.2, 26.6, 20.1, 23.3, 25.2, 22.1, 17.7, 27.6, 20.6, 13.7, 23.2, 17.5, 20.6, 18.0, 23.9, 21.6,
    24.3, 20.4, 24.0, 13.2,
];

#[test]
fn tails_of_the_normal_and_of_students_t_are_right_far_out() {
    for (z, p) in [
        (0.5, 0.617_075_077_451_973_8),
        (-1.96, 0.049_995_790_296_440_87),
        (6.0, 1.973_175_290_075_389e-9),
        (20.0, 5.507_248_237_212_311e-89),
    ] {
        close(two_sided_normal(z), p, 1e-12);
    }
    for (t, freedom, p) in [
        (0.3, 1.0, 0.814_452_841_844_515_4),
        (-2.0, 3.5, 0.126_138_522_575_913_43),
        (5.0, 10.0, 0.000_537_333_602_756_452_7),
        (12.0, 7.0, 6.358_310_378_185_098e-6),
        (8.0, 200.0, 9.879_200_909_330_596e-14),
    ] {
        close(two_sided_student(t, freedom), p, 1e-9);
    }
}

#[test]
fn quantiles_are_those_of_scipy() {
    for (p, freedom, t) in [
        (0.975, 1.0, 12.706_204_736_174_694),
        (0.975, 7.0, 2.364_624_251_592_784),
        (0.999_999_5, 30.0, 6.119_075_620_413_732),
        (0.6, 2.5, 0.281_459_512_748_547_7),
    ] {
        close(student_quantile(p, freedom), t, 1e-8);
    }
    close(normal_quantile(0.975), 1.959_963_984_540_054, 1e-12);
    close(normal_quantile(1.0 - 5e-7), 4.891_638_475_714_78, 1e-9);
    assert!(student_quantile(0.9, 0.0).is_nan());
}

/// The two samples of Welch's test in the literature on it (t = −2.22, 24.5 degrees of freedom, p = .036).
#[test]
fn t_tests_are_those_of_scipy() {
    let (a, b) = (Moments::of(A), Moments::of(B));
    let test = welch(&a, &b);
    close(test.statistic, -2.219_240_915_823_623_3, 1e-12);
    close(test.freedom, 24.496_223_124_201_244, 1e-12);
    close(test.p, 0.035_972_271_029_796_92, 1e-10);
    let test = student(&a, 19.0);
    close(test.statistic, 0.972_002_834_361_550_8, 1e-11);
    close(test.p, 0.356_446_332_904_976_3, 1e-10);
    close(test.freedom, 9.0, 0.0);
    assert!(welch(&a, &Moments::of([1.0])).p.is_nan());
}

/// z of a known error has the normal's tail, and its sign says on which side of the prediction the estimate lies.
#[test]
fn the_z_test_counts_standard_errors() {
    let test = z_test(3.04, 0.5, 4.02);
    close(test.statistic, -1.96, 1e-12);
    close(test.p, 0.049_995_790_296_440_87, 1e-10);
    assert!(test.freedom.is_infinite());
}

#[test]
fn chi_square_is_that_of_scipy() {
    let test = chi_square(&[43, 52, 54, 40], &[47.25; 4], 0);
    close(test.statistic, 2.936_507_936_507_936_5, 1e-12);
    close(test.p, 0.401_518_352_725_928_3, 1e-10);
    close(test.freedom, 3.0, 0.0);
    close(
        chi_square(&[5, 30, 15], &[10.0, 20.0, 20.0], 1).p,
        0.003_096_020_549_959_022,
        1e-9,
    );
    // Totals may differ: 2²/10 + 3²/10, and e⁻ˣ/² is the tail of two degrees of freedom.
    let test = chi_square(&[12, 7, 10], &[10.0; 3], 0);
    close(test.statistic, 1.3, 1e-12);
    close(test.p, libm::exp(-0.65), 1e-10);
    assert!(chi_square(&[5, 3], &[8.0], 0).p.is_nan());
    assert!(chi_square(&[5, 3], &[8.0, 0.0], 0).p.is_nan());
    assert!(chi_square(&[5], &[5.0], 0).p.is_nan());
}

/// Exact p-values of SciPy; ours is the corrected limit, good to a few per cent.
#[test]
fn kolmogorov_smirnov_is_near_the_exact_one() {
    let x = [0.05, 0.12, 0.33, 0.41, 0.48, 0.52, 0.77, 0.81, 0.86, 0.99];
    let test = ks_uniform(&x);
    close(test.statistic, 0.17, 1e-12);
    close(test.p, 0.889_930_243_104_627_5, 0.03);
    let test = kolmogorov_smirnov(&x, |x| x * x);
    close(test.statistic, 0.3296, 1e-12);
    close(test.p, 0.181_087_253_894_143_26, 0.05);
    let skewed: Vec<f64> = (0..100)
        .map(|i| libm::pow((f64::from(i) + 0.5) / 100.0, 1.4))
        .collect();
    close(ks_uniform(&skewed).p, 0.068_279_024_972_541_78, 0.03);
    assert!(ks_uniform(&[0.1, f64::NAN, 0.5]).p.is_nan());
    // A sample as even as it can be: D = 1/(2n), where Kolmogorov's series of 100 terms would still swing.
    let even: Vec<f64> = (0..1000).map(|i| (f64::from(i) + 0.5) / 1000.0).collect();
    let test = ks_uniform(&even);
    close(test.statistic, 0.0005, 1e-12);
    assert_eq!(test.p, 1.0);
    assert!(test.freedom.is_infinite());
}

/// The lower end for 1 of 10⁶ is the closed form 1 − (1 − 5e-7)^(1/10⁶); SciPy stops its search at 1e-12.
#[test]
fn exact_intervals_are_those_of_scipy() {
    for (hits, trials, confidence, low, high) in [
        (0, 10, 0.95, 0.0, 0.308_497_107_818_762_94),
        (
            3,
            20,
            0.95,
            0.032_070_937_185_544_77,
            0.378_926_826_545_295_64,
        ),
        (10, 10, 0.99, 0.588_704_018_652_474_6, 1.0),
        (
            84,
            100_000,
            0.95,
            0.000_670_070_507_541_410_8,
            0.001_039_873_157_697_760_2,
        ),
        (
            1,
            1_000_000,
            0.999_999,
            5.000_001_25e-13,
            1.742_207_206_756_983_8e-5,
        ),
    ] {
        let interval = binomial_interval(hits, trials, confidence);
        close(interval.0, low, 1e-8);
        close(interval.1, high, 1e-8);
    }
    assert_eq!(binomial_interval(0, 0, 0.95), (0.0, 1.0));
    for (count, confidence, low, high) in [
        (0, 0.95, 0.0, 3.688_879_454_113_935_4),
        (1, 0.95, 0.025_317_807_984_289_897, 5.571_643_390_938_898),
        (10, 0.99, 3.716_922_131_467_116, 21.397_827_499_654_273),
        (1234, 0.95, 1_166.101_718_517_549_2, 1_304.820_370_528_922_5),
    ] {
        let interval = poisson_interval(count, confidence);
        close(interval.0, low, 1e-8);
        close(interval.1, high, 1e-8);
    }
}

/// 1 − .05^(1/n): Clopper and Pearson's one-sided bound, near 3/n (rule of three) for large n.
/// For no hit the interval ends at 1 − .025^(1/n), for all hits it starts at .025^(1/n). Logarithms of Γ(10⁹), about 2·10¹⁰, are
/// rounded to 4·10⁻⁶, which moves a limit by about 10⁻⁶ of itself.
#[test]
fn intervals_of_rates_end_for_millions_of_trials() {
    for n in [1, 10, 8_000_000, 1_000_000_000_u64] {
        let end = -libm::expm1(libm::log(0.025) / n as f64);
        close(binomial_interval(0, n, 0.95).1, end, 2e-6);
        close(binomial_interval(n, n, 0.95).0, 1.0 - end, 1e-7);
    }
    // Poisson's limit of one hit: (.0253178, 5.5716434)/n.
    let (low, high) = binomial_interval(1, 1_000_000_000, 0.95);
    close(low, 0.025_317_8e-9, 1e-5);
    close(high, 5.571_643_4e-9, 1e-5);
}

#[test]
fn no_failures_bound_the_rate_by_three_over_n() {
    close(zero_failures_bound(10, 0.95), 0.258_865_550_893_052_3, 1e-9);
    close(zero_failures_bound(1_000_000_000, 0.95), 2.995_732e-9, 1e-5);
    close(
        zero_failures_bound(100, 0.95),
        binomial_interval(0, 100, 0.9).1,
        1e-8,
    );
    close(zero_failures_bound(0, 0.95), 1.0, 0.0);
}

#[test]
fn fitted_lines_are_those_of_scipy() {
    let y = [1.1, 2.9, 5.2, 6.8, 9.3, 10.9];
    let weights = [1.0, 2.0, 1.0, 4.0, 0.5, 1.0];
    let points = |w: &dyn Fn(usize) -> f64| -> Vec<(f64, f64, f64)> {
        y.iter()
            .enumerate()
            .map(|(i, &y)| (i as f64, y, w(i)))
            .collect()
    };
    let fit = fit_line(&points(&|_| 3.0)).unwrap();
    close(fit.slope, 1.994_285_714_285_714_2, 1e-12);
    close(fit.intercept, 1.047_619_047_619_048_3, 1e-12);
    close(fit.slope_error, 0.052_476_104_053_165_336, 1e-10);
    close(fit.intercept_error, 0.158_879_295_018_222_84, 1e-10);
    let interval = fit.slope_interval(0.95);
    close(interval.0, 1.848_588_692_047_453_2, 1e-9);
    close(interval.1, 2.139_982_736_523_975, 1e-9);
    let fit = fit_line(&points(&|i| weights[i])).unwrap();
    close(fit.slope, 1.972_752_04, 1e-8);
    close(fit.slope_error, 0.054_106_06, 1e-6);
    close(fit.intercept_error, 0.152_024_92, 1e-6);
    // Three points leave one degree of freedom: residuals −1/6, 1/3, −1/6 about y = 7/6 + 3x/2 (by hand).
    let fit = fit_line(&[(0.0, 1.0, 2.0), (1.0, 3.0, 2.0), (2.0, 4.0, 2.0)]).unwrap();
    close(fit.slope, 1.5, 1e-12);
    close(fit.intercept, 7.0 / 6.0, 1e-12);
    close(fit.freedom, 1.0, 0.0);
    close(fit.slope_error, (1.0_f64 / 12.0).sqrt(), 1e-12);
    close(fit.intercept_error, (5.0_f64 / 36.0).sqrt(), 1e-12);
    assert!(fit_line(&[(0.0, 1.0, 1.0), (1.0, 2.0, 1.0)]).is_none());
    assert!(fit_line(&[(1.0, 1.0, 1.0); 5]).is_none());
    assert!(fit_line(&[(0.0, 1.0, 1.0), (1.0, f64::NAN, 1.0), (2.0, 0.0, 1.0)]).is_none());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(fit_line(&[(0.0, 1.0, 1.0), (1.0, 2.0, bad), (2.0, 4.0, 1.0)]).is_none());
    }
    let at_infinity = [(0.0, 1.0, 1.0), (f64::INFINITY, 2.0, 1.0), (2.0, 4.0, 1.0)];
    assert!(fit_line(&at_infinity).is_none());
}

/// Covariance of the means of the first 1, 2, 4, … values of one run: 1/max(n, m).
fn nested() -> (Vec<f64>, Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let levels = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0_f64];
    let covariance = levels.map(|n| levels.map(|m| 1.0 / n.max(m)).to_vec());
    let design = levels.map(|n| vec![1.0, libm::log(n)]);
    (levels.to_vec(), covariance.to_vec(), design.to_vec())
}

/// β = (Xᵀ Σ⁻¹ X)⁻¹ Xᵀ Σ⁻¹ y by NumPy.
#[test]
fn generalised_fits_are_those_of_numpy() {
    let (_, covariance, design) = nested();
    let values = [2.1, 1.3, 0.9, -0.2, -0.8, -1.7];
    let fit = fit_generalised(&design, &values, &covariance).unwrap();
    close(fit.coefficients[0], 2.364_516_129_032_253_4, 1e-12);
    close(fit.coefficients[1], -1.172_771_452_593_607, 1e-12);
    close(fit.errors[0], 0.659_147_788_019_964_7, 1e-12);
    close(fit.errors[1], 0.183_222_453_415_443_24, 1e-12);
    close(fit.chi_square, 2.309_677_419_354_836, 1e-12);
    close(fit.freedom, 4.0, 0.0);
}

/// With independent values of known variance the general fit is the weighted one, and its errors are those that the weights say.
#[test]
fn a_generalised_fit_without_covariances_is_the_weighted_one() {
    let (levels, _, design) = nested();
    let values = [2.1, 1.3, 0.9, -0.2, -0.8, -1.7];
    let variances = [1.0, 0.5, 2.0, 0.25, 1.5, 3.0];
    let diagonal: Vec<Vec<f64>> = (0..6)
        .map(|i| {
            (0..6)
                .map(|j| if i == j { variances[i] } else { 0.0 })
                .collect()
        })
        .collect();
    let points: Vec<_> = (0..6)
        .map(|i| (libm::log(levels[i]), values[i], 1.0 / variances[i]))
        .collect();
    let general = fit_generalised(&design, &values, &diagonal).unwrap();
    let line = fit_line(&points).unwrap();
    close(general.coefficients[1], line.slope, 1e-12);
    close(general.coefficients[0], line.intercept, 1e-12);
    let scatter = (general.chi_square / general.freedom).sqrt();
    close(general.errors[1] * scatter, line.slope_error, 1e-12);
}

#[test]
fn an_impossible_generalised_fit_is_refused() {
    let (_, covariance, design) = nested();
    let values = [1.0; 6];
    let twice: Vec<Vec<f64>> = design
        .iter()
        .map(|row| vec![row[1], 2.0 * row[1]])
        .collect();
    assert!(fit_generalised(&twice, &values, &covariance).is_none());
    assert!(fit_generalised(&design, &values[1..], &covariance).is_none());
    assert!(fit_generalised(&design[..1], &values[..1], &covariance[..1]).is_none());
    assert!(fit_generalised(&[], &[], &[]).is_none());
    assert!(fit_generalised(&design, &[f64::NAN; 6], &covariance).is_none());
    let mut indefinite = covariance;
    indefinite[0][1] = 5.0;
    indefinite[1][0] = 5.0;
    assert!(fit_generalised(&design, &values, &indefinite).is_none());
}

/// Holm 1979 on p = .01, .04, .03, .005: corrected .03, .06, .06, .02.
#[test]
fn holms_correction_is_the_published_one() {
    for (ours, theirs) in holm(&[0.01, 0.04, 0.03, 0.005])
        .into_iter()
        .zip([0.03, 0.06, 0.06, 0.02])
    {
        close(ours, theirs, 1e-12);
    }
    close(holm_smallest(&[0.01, 0.04, 0.03, 0.005]), 0.02, 1e-12);
    assert_eq!(holm(&[0.9, 0.5, 0.7]), [1.0; 3]);
    assert_eq!(holm(&[0.6, f64::NAN, 0.1])[0], 1.0);
    assert!(holm(&[0.6, f64::NAN, 0.1])[1].is_nan());
    close(holm_smallest(&[0.4, 0.5, 0.6]), 1.0, 0.0);
    assert!(holm_smallest(&[0.5, f64::NAN]).is_nan());
    close(holm_smallest(&[]), 1.0, 0.0);
}

/// Independent standard normals (Box and Muller 1958).
struct Normals(Stream);

impl Normals {
    fn next(&mut self) -> f64 {
        let [a, b] = self.0.uniform2();
        (-2.0 * libm::log1p(-a)).sqrt() * libm::cos(std::f64::consts::TAU * b)
    }

    fn moments(&mut self, n: u64, scale: f64) -> Moments {
        Moments::of((0..n).map(|_| scale * self.next()))
    }
}

/// Share of false alarms among `runs` experiments without effect, at 5 %, within 6 standard errors (false alarm 2e-9 each); with
/// 4000 runs this sees a rate off by .021. `draw` gives a p-value.
fn false_alarms_are_five_per_cent(name: &str, mut draw: impl FnMut(&mut Normals) -> f64) {
    const RUNS: u64 = 4000;
    let mut normals = Normals(Stream::new(11, Purpose::Test, name.len() as u64));
    let alarms = (0..RUNS).filter(|_| draw(&mut normals) < 0.05).count() as f64;
    let slack = 6.0 * (RUNS as f64 * 0.05 * 0.95).sqrt();
    let expected = 0.05 * RUNS as f64;
    assert!(
        (alarms - expected).abs() < slack,
        "{name}: {alarms} alarms, {expected} expected"
    );
}

#[test]
fn every_test_raises_the_false_alarms_it_promises() {
    false_alarms_are_five_per_cent("z", |n| z_test(3.0 + 0.5 * n.next(), 0.5, 3.0).p);
    false_alarms_are_five_per_cent("student", |n| student(&n.moments(5, 1.0), 0.0).p);
    false_alarms_are_five_per_cent("welch", |n| {
        welch(&n.moments(6, 1.0), &n.moments(12, 3.0)).p
    });
    false_alarms_are_five_per_cent("kolmogorov", |n| {
        let sample: Vec<f64> = (0..20).map(|_| n.0.uniform()).collect();
        ks_uniform(&sample).p
    });
    false_alarms_are_five_per_cent("chi square", |n| {
        let mut counts = [0; 8];
        (0..400).for_each(|_| counts[(8.0 * n.0.uniform()) as usize] += 1);
        chi_square(&counts, &[50.0; 8], 0).p
    });
    false_alarms_are_five_per_cent("holm's family", |n| {
        let family: Vec<f64> = (0..10).map(|_| n.0.uniform()).collect();
        holm_smallest(&family)
    });
    false_alarms_are_five_per_cent("the slope of a fit", |n| {
        let points: Vec<_> = (0..6)
            .map(|i| (f64::from(i), 2.0 * f64::from(i) + n.next(), 1.0))
            .collect();
        let fit = fit_line(&points).unwrap();
        two_sided_student((fit.slope - 2.0) / fit.slope_error, fit.freedom)
    });
    let (levels, covariance, design) = nested();
    let running_means = |n: &mut Normals| -> Vec<f64> {
        let (mut sum, mut done) = (0.0, 0.0);
        let until = |&level: &f64| {
            while done < level {
                sum += n.next();
                done += 1.0;
            }
            sum / level
        };
        levels.iter().map(until).collect()
    };
    let slope = |n: &mut Normals| {
        let fit = fit_generalised(&design, &running_means(n), &covariance).unwrap();
        (fit.coefficients[1], fit.errors[1], fit.chi_square)
    };
    false_alarms_are_five_per_cent("the slope of a generalised fit", |n| {
        let (slope, error, _) = slope(n);
        z_test(slope, error, 0.0).p
    });
    false_alarms_are_five_per_cent("student over fits of replicates", |n| {
        student(&Moments::of((0..6).map(|_| slope(n).0)), 0.0).p
    });
    // The 95 % point of χ² with 4 degrees of freedom (published tables): beyond it 5 %.
    false_alarms_are_five_per_cent("the residual of a generalised fit", |n| {
        if slope(n).2 > 9.487_729 { 0.0 } else { 1.0 }
    });
}

/// Exact intervals cover at least as often as they say: 2000 draws each, at most 5 % + 6 standard errors of misses.
#[test]
fn exact_intervals_cover_the_truth() {
    let limit = 2000.0 * 0.05 + 6.0 * (2000.0_f64 * 0.05 * 0.95).sqrt();
    let mut stream = Stream::new(12, Purpose::Test, 0);
    for rate in [0.003, 0.2, 0.9] {
        let missed = (0..2000).filter(|_| {
            let hits = (0..100).filter(|_| stream.uniform() < rate).count() as u64;
            let (low, high) = binomial_interval(hits, 100, 0.95);
            !(low..=high).contains(&rate)
        });
        assert!((missed.count() as f64) < limit, "rate {rate}");
    }
    let missed = (0..2000).filter(|_| {
        // A Poisson count of mean 4: arrivals of a unit-rate process before time 4.
        let (mut time, mut count) = (0.0, 0);
        loop {
            time -= libm::log1p(-stream.uniform());
            if time > 4.0 {
                break;
            }
            count += 1;
        }
        let (low, high) = poisson_interval(count, 0.95);
        !(low..=high).contains(&4.0)
    });
    assert!((missed.count() as f64) < limit);
}

/// A mean off by one standard error of 10 is seen at 5 % with power about .81 (SciPy, noncentral t, n = 10, effect 1).
#[test]
fn the_t_test_has_its_power() {
    let mut normals = Normals(Stream::new(13, Purpose::Test, 0));
    let seen = (0..4000)
        .filter(|_| student(&normals.moments(10, 1.0), 1.0).p < 0.05)
        .count();
    close(seen as f64 / 4000.0, 0.803, 0.05);
}
