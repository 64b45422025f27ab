//! The samplers. Properties are functions over an implementation: the project's samplers pass, and wrong ones fail.

use photolathe::numeric::rng::{Purpose, Stream, mix};
use photolathe::render::driver::render_unwatched;
use photolathe::render::settings::Settings;
use photolathe::scene::file;
use photolathe::scene::options::{Antialias, Integrator, RenderTable, Sampler};
use photolathe::scene::sampler::{Draws, Source};
use std::path::Path;

const SAMPLERS: [Sampler; 3] = [Sampler::Independent, Sampler::Stratified, Sampler::Sobol];

/// One of the pairs of a sample: seed, samples planned, pixel, sample, number of the pair.
type Pairs = dyn Fn(u64, u32, u64, u64, usize) -> [f64; 2];

fn draws(sampler: Sampler, seed: u64, planned: u32, pixel: u64, sample: u64) -> Draws {
    Source::new(sampler, seed, planned).draws(sample, |sample| sample * 1000 + pixel)
}

fn ours(sampler: Sampler) -> Box<Pairs> {
    Box::new(move |seed, planned, pixel, sample, number| {
        let mut draws = draws(sampler, seed, planned, pixel, sample);
        (0..number).for_each(|_| {
            draws.uniform2();
        });
        draws.uniform2()
    })
}

/// Pearson's statistic of counts that should be even, in standard deviations from its mean: 8×8 cells and more make it nearly normal,
/// so 6 is beyond one false alarm in 10⁷.
fn unevenness(counts: &[u32]) -> f64 {
    let n: u32 = counts.iter().sum();
    let expected = f64::from(n) / counts.len() as f64;
    let freedom = counts.len() as f64 - 1.0;
    let square = |&count: &u32| (f64::from(count) - expected).powi(2) / expected;
    let statistic: f64 = counts.iter().map(square).sum();
    (statistic - freedom) / (2.0 * freedom).sqrt()
}

/// Over scramblings, any one sample is uniform: both numbers of a pair together, and numbers of different pairs. 20 000 scramblings in
/// 64 cells: it can see cells that are off by 20 %.
fn one_sample_is_uniform(pairs: &Pairs) -> bool {
    [(1, 0), (3, 1), (7, 6), (16, 5), (64, 40)]
        .into_iter()
        .all(|(planned, sample)| {
            let (mut within, mut across) = ([0_u32; 64], [0_u32; 64]);
            for seed in 0..20_000 {
                let first = pairs(seed, planned, 3, sample, 0);
                let second = pairs(seed, planned, 3, sample, 1);
                let cell = |x: f64, y: f64| (8.0 * x) as usize * 8 + (8.0 * y) as usize;
                within[cell(first[0], first[1])] += 1;
                across[cell(first[0], second[0])] += 1;
            }
            unevenness(&within).abs() < 6.0 && unevenness(&across).abs() < 6.0
        })
}

/// Every aligned block of 2^m samples has exactly one point in each box of area 2^−m whose sides are powers of two.
fn every_block_is_a_net(pairs: &Pairs) -> bool {
    (0..12).all(|trial| {
        (0..=8).all(|m: u32| {
            let block = trial % 3;
            let points: Vec<[f64; 2]> = (block << m..(block + 1) << m)
                .map(|sample| pairs(trial, 1000, trial, sample, (trial % 2) as usize))
                .collect();
            (0..=m).all(|k| {
                let [columns, rows] = [k, m - k].map(|bits| f64::from(1 << bits));
                let mut seen = vec![false; 1 << m];
                for [x, y] in &points {
                    seen[((columns * x).floor() * rows + (rows * y).floor()) as usize] = true;
                }
                seen.into_iter().all(|seen| seen)
            })
        })
    })
}

/// Of n planned samples no two lie in one cell of the grid of columns × rows, the most nearly square with at least n cells.
fn no_two_samples_share_a_cell(pairs: &Pairs) -> bool {
    [1_u32, 2, 3, 4, 7, 12, 16, 31, 100].into_iter().all(|n| {
        let columns = f64::from(n).sqrt().round();
        let rows = (f64::from(n) / columns).ceil();
        (0..20).all(|pixel| {
            let mut cells: Vec<_> = (0..u64::from(n))
                .map(|sample| {
                    let [x, y] = pairs(1, n, pixel, sample, 1);
                    ((columns * x) as u32, (rows * y) as u32)
                })
                .collect();
            cells.sort_unstable();
            cells.dedup();
            cells.len() == n as usize
        })
    })
}

#[test]
fn one_sample_of_any_sampler_is_uniform_over_the_seeds() {
    for sampler in SAMPLERS {
        assert!(one_sample_is_uniform(&ours(sampler)), "{sampler:?}");
    }
    // Without scrambling, samples stand at fixed places.
    let fixed =
        |_, planned, pixel, sample, number| ours(Sampler::Sobol)(0, planned, pixel, sample, number);
    assert!(!one_sample_is_uniform(&fixed));
    // One order and jitter for all pairs: the first says what the second is.
    let repeated = |seed, planned, pixel, sample, _| {
        ours(Sampler::Stratified)(seed, planned, pixel, sample, 0)
    };
    assert!(!one_sample_is_uniform(&repeated));
}

#[test]
fn pairs_of_sobols_points_are_nets_in_every_aligned_block() {
    assert!(every_block_is_a_net(&ours(Sampler::Sobol)));
    assert!(!every_block_is_a_net(&ours(Sampler::Independent)));
    assert!(!every_block_is_a_net(&ours(Sampler::Stratified)));
    // Each number evenly spread by itself, with nothing between the two.
    let padded = |seed, planned, pixel, sample, number| {
        let at = |seed| ours(Sampler::Sobol)(seed, planned, pixel, sample, number);
        [at(seed)[0], at(seed + 99)[1]]
    };
    assert!(!every_block_is_a_net(&padded));
}

#[test]
fn stratified_samples_have_cells_of_their_own() {
    assert!(no_two_samples_share_a_cell(&ours(Sampler::Stratified)));
    assert!(!no_two_samples_share_a_cell(&ours(Sampler::Independent)));
    assert!(!no_two_samples_share_a_cell(&ours(Sampler::Sobol)));
}

/// Single numbers: n samples in n cells, by strata for any n and by Sobol's points for powers of two; also after other draws.
#[test]
fn single_numbers_fall_into_cells_of_their_own() {
    let spread = |sampler, n: u32| {
        (0..20).all(|pixel| {
            let mut cells: Vec<u32> = (0..u64::from(n))
                .map(|sample| {
                    let mut draws = draws(sampler, 2, n, pixel, sample);
                    draws.uniform2();
                    draws.uniform();
                    (f64::from(n) * draws.uniform()) as u32
                })
                .collect();
            cells.sort_unstable();
            cells == (0..n).collect::<Vec<_>>()
        })
    };
    assert!(
        [1, 2, 5, 7, 16, 60]
            .iter()
            .all(|&n| spread(Sampler::Stratified, n))
    );
    assert!([1, 2, 16, 64].iter().all(|&n| spread(Sampler::Sobol, n)));
    assert!(!spread(Sampler::Independent, 16));
}

#[test]
fn the_first_samples_of_a_longer_run_are_those_of_a_short_one() {
    for sampler in [Sampler::Independent, Sampler::Sobol] {
        for (pixel, sample) in [(0, 0), (5, 3), (7, 15)] {
            let of = |planned| ours(sampler)(4, planned, pixel, sample, 2);
            assert_eq!(of(16), of(1000), "{sampler:?}");
            assert_eq!(of(16), of(u32::MAX), "{sampler:?}");
        }
    }
    // Strata are those of the plan: the samples of an interrupted run are the first of the whole one, for any plan.
    let distinct = (0..16).filter(|&sample| {
        let of = |planned| ours(Sampler::Stratified)(4, planned, 0, sample, 0);
        of(16) != of(1000)
    });
    assert_eq!(distinct.count(), 16);
}

/// Beyond 2¹⁶ samples Sobol's points begin anew, scrambled otherwise; beyond the plan, strata do.
#[test]
fn rounds_follow_each_other_without_repeating() {
    for (sampler, planned, length) in [
        (Sampler::Sobol, 100, 1 << 16),
        (Sampler::Stratified, 9, 9),
        (Sampler::Stratified, u32::MAX, 64),
    ] {
        let of = |sample| ours(sampler)(8, planned, 1, sample, 0);
        assert!((0..9).all(|sample| of(sample) != of(sample + length)));
        let far = of(u64::from(u32::MAX) - 1);
        assert!(far.iter().all(|x| (0.0..1.0).contains(x)));
    }
}

/// Independent numbers are the keyed stream itself, as they always were.
#[test]
fn independent_draws_are_the_stream_of_the_sample() {
    let mut draws = draws(Sampler::Independent, 11, 64, 5, 2);
    let mut stream = Stream::new(11, Purpose::Camera, 2005);
    for _ in 0..10 {
        assert_eq!(draws.uniform(), stream.uniform());
        assert_eq!(draws.uniform2(), stream.uniform2());
    }
}

/// The mean error of n samples over the root mean square error of one replicate, and that error itself, over scramblings.
fn errors(sampler: Sampler, n: u32, integrand: fn([f64; 2]) -> f64, exact: f64) -> (f64, f64) {
    let scramblings = 2000;
    let (mut sum, mut squares) = (0.0, 0.0);
    for pixel in 0..scramblings {
        let values = (0..u64::from(n)).map(|sample| {
            let mut draws = draws(sampler, 21 + pixel / 1000, n, pixel % 1000, sample);
            integrand(draws.uniform2())
        });
        let off = values.sum::<f64>() / f64::from(n) - exact;
        sum += off;
        squares += off * off;
    }
    let count = scramblings as f64;
    let rms = (squares / count).sqrt();
    (sum / count / (rms / count.sqrt()), rms)
}

/// ∫∫ e^(x + y) over the square is (e − 1)²; a disc of radius ½ has area π/4. Means of any number of samples are right within 6
/// standard errors of 2000 scramblings.
#[test]
fn means_are_unbiased_for_any_number_of_samples() {
    let e = std::f64::consts::E;
    for sampler in SAMPLERS {
        for n in [1, 2, 3, 7, 12, 16, 50] {
            let (off, _) = errors(sampler, n, |[x, y]| libm::exp(x + y), (e - 1.0) * (e - 1.0));
            assert!(off.abs() < 6.0, "{sampler:?}, {n}: {off}");
            let disc = |[x, y]: [f64; 2]| {
                let inside = (x - 0.5).powi(2) + (y - 0.5).powi(2) < 0.25;
                f64::from(u8::from(inside))
            };
            let (off, _) = errors(sampler, n, disc, std::f64::consts::FRAC_PI_4);
            assert!(off.abs() < 6.0, "{sampler:?}, {n}: {off}");
        }
    }
}

/// Of 64 samples of a smooth function. Owen (1997): a scrambled net is never much worse than independent samples; here it is far better.
#[test]
fn strata_and_nets_have_less_error() {
    let e = std::f64::consts::E;
    let rms = |sampler, n| errors(sampler, n, |[x, y]| libm::exp(x + y), (e - 1.0) * (e - 1.0)).1;
    let [independent, stratified, sobol] = SAMPLERS.map(|sampler| rms(sampler, 64));
    assert!(
        stratified < 0.25 * independent,
        "{stratified} {independent}"
    );
    assert!(sobol < 0.25 * stratified, "{sobol} {stratified}");
    let [independent, stratified, sobol] = SAMPLERS.map(|sampler| rms(sampler, 7));
    assert!(stratified < 0.8 * independent && sobol < 0.8 * independent);
}

/// A ball, a floor and a lamp before an open lens.
const SCENE: &str = r#"
[camera]
eye = [0, 1, 5]
target = [0, 0.8, 0]
vertical_fov_deg = 40
lens_radius = 0.1
focus_distance = 3
[film]
width = 12
height = 9
[material.matte]
diffuse = { reflectance = [0.6, 0.5, 0.4] }
[material.glass]
dielectric = { ior = 1.5, absorption = [0, 0, 0] }
[material.lamp]
emission = { radiance = [6, 6, 6] }
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "matte"
[[sphere]]
center = [0.3, 0.6, 0]
radius = 0.6
material = "glass"
[[disc]]
center = [0, 3, 1]
normal = [0, -1, 0]
radius = 0.8
material = "lamp"
"#;

/// The film's means and the mean over pixels of the variance that it states, of the mean.
fn rendered(settings: &Settings) -> (Vec<[u64; 3]>, f64) {
    rendered_of(SCENE, settings)
}

fn rendered_of(text: &str, settings: &Settings) -> (Vec<[u64; 3]>, f64) {
    let scene = file::parse(text, "samplers", Path::new(""), &[]).expect("valid");
    let film = render_unwatched(&scene, settings).expect("it renders").film;
    let bits = |pixel: &photolathe::render::film::Pixel| pixel.mean().to_array().map(f64::to_bits);
    let stated = film.pixels().iter().map(|pixel| pixel.variance_of_mean().x);
    let stated = stated.sum::<f64>() / film.pixels().len() as f64;
    (film.pixels().iter().map(bits).collect(), stated)
}

fn settings(integrator: Integrator, sampler: Sampler, spp: u32, seed: u64) -> Settings {
    Settings::resolve(&RenderTable {
        integrator: Some(integrator),
        sampler: Some(sampler),
        spp: Some(spp),
        seed: Some(seed),
        threads: Some(1),
        ..RenderTable::default()
    })
}

#[test]
fn bytes_do_not_depend_on_threads_with_any_sampler() {
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let pictures = SAMPLERS.map(|sampler| {
            let of = |threads| {
                rendered(&Settings {
                    threads: Some(threads),
                    ..settings(integrator, sampler, 5, 9)
                })
            };
            let one = of(1);
            assert_eq!(one, of(2), "{integrator:?}, {sampler:?}");
            assert_eq!(one, of(3), "{integrator:?}, {sampler:?}");
            one.0
        });
        // The samplers are honoured, and whatever is drawn, no two are the same.
        assert_ne!(pictures[0], pictures[1]);
        assert_ne!(pictures[0], pictures[2]);
        assert_ne!(pictures[1], pictures[2]);
    }
}

/// Variance of the mean of a pixel over 40 seeds, averaged over the film, and what the films state of it.
fn variance(integrator: Integrator, sampler: Sampler, spp: u32) -> (f64, f64) {
    let seeds = 40;
    // The lamp in glass, seldom and bright, would hide the rest.
    let matte = SCENE.replace("material = \"glass\"", "material = \"matte\"");
    let films: Vec<_> = (0..seeds)
        .map(|seed| {
            let settings = Settings {
                // A pattern's places differ by more than chance.
                aa: Antialias::None,
                ..settings(integrator, sampler, spp, mix(&[seed]))
            };
            rendered_of(&matte, &settings)
        })
        .collect();
    let pixels = films[0].0.len();
    let of_pixel = |pixel: usize| {
        let values = films.iter().map(|film| f64::from_bits(film.0[pixel][0]));
        photolathe::numeric::statistics::Moments::of(values).variance()
    };
    let found = (0..pixels).map(of_pixel).sum::<f64>() / pixels as f64;
    let stated = films.iter().map(|film| film.1).sum::<f64>() / seeds as f64;
    (found, stated)
}

/// What `variance` of a picture means: the spread of the samples over their number. That is the variance of the mean of independent
/// samples (here within 25 %, which 40 seeds × 108 pixels tell), and too much for spread ones, never too little.
#[test]
fn the_stated_variance_is_right_for_independent_samples_and_a_bound_for_spread_ones() {
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let [independent, stratified, sobol] =
            SAMPLERS.map(|sampler| variance(integrator, sampler, 16));
        let ratio = |(found, stated): (f64, f64)| found / stated;
        assert!(
            (0.75..1.33).contains(&ratio(independent)),
            "{integrator:?}: {independent:?}"
        );
        assert!(ratio(stratified) < 0.9, "{integrator:?}: {stratified:?}");
        assert!(ratio(sobol) < 0.9, "{integrator:?}: {sobol:?}");
        // The gain is real, in pixels, lens and lights together.
        assert!(
            stratified.0 < 0.8 * independent.0,
            "{stratified:?} {independent:?}"
        );
        assert!(sobol.0 < 0.8 * independent.0, "{sobol:?} {independent:?}");
    }
}
