//! Patterns of samples, and the thresholds that ask for them.

use super::{scene, settings};
use photolathe::numeric::work::Work;
use photolathe::render::antialias::fingerprint::Fingerprint;
use photolathe::render::antialias::mask::contrast;
use photolathe::render::antialias::pattern::{CENTER, ROOKS, grid};
use photolathe::render::driver::render_unwatched;
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::render::whitted::Whitted;
use photolathe::scene::options::{Antialias, Hash, Resampling};
use photolathe::scene::{Rgb, Scene, file};
use std::collections::HashSet;
use std::path::Path;

/// Where all is resampled, the count of samples is the pattern's.
#[test]
fn every_pattern_has_its_number_of_samples() {
    let scene = scene(&[]);
    for (pattern, count) in [
        (Resampling::Two, 4.0),
        (Resampling::Three, 9.0),
        (Resampling::Four, 16.0),
    ] {
        let settings = Settings {
            pattern,
            ..settings(Antialias::Uniform)
        };
        let film = render_unwatched(&scene, &settings).expect("a picture").film;
        assert!(film.pixels().iter().all(|pixel| pixel.count() == count));
    }
}

/// Repeated hashing: four samples where they and the centre have one path, all sixteen elsewhere; nearly the picture of sixteen
/// everywhere.
#[test]
fn repeated_hashing_spends_its_samples_where_paths_differ() {
    let scene = scene(&[]);
    let film = |pattern, aa| {
        let settings = Settings {
            pattern,
            hash: Hash::Shadow,
            ..settings(aa)
        };
        render_unwatched(&scene, &settings).expect("a picture").film
    };
    let four = film(Resampling::Four, Antialias::PathHash);
    let adaptive = film(Resampling::Adaptive, Antialias::PathHash);
    let settings = settings(Antialias::None);
    let whitted = Whitted::new(&scene, &settings);
    let (mut few, mut many) = (0, 0);
    for (index, (pixel, all)) in adaptive.pixels().iter().zip(four.pixels()).enumerate() {
        match pixel.count() {
            1.0 => assert_eq!(pixel, all, "not marked"),
            4.0 => few += 1,
            16.0 => {
                many += 1;
                let gap = (pixel.mean() - all.mean()).abs().max_element();
                assert!(gap < 1e-12, "the same sixteen places, {gap} at {index}");
            }
            other => panic!("{other} samples"),
        }
        let at = |offset| whitted.fingerprint(index, offset, &mut Work::default());
        let center = at(CENTER.offset).value(Hash::Objects);
        let rooks = ROOKS.map(|place| at(grid(4)[place].offset).value(Hash::Objects));
        if pixel.count() == 4.0 {
            assert_eq!(rooks, [center; 4]);
        }
    }
    assert!(few > 30 && many > 100, "{few} {many}");
}

/// With a threshold the hash marks what differs in hash and in colour: the pairs of neighbours that contrast would mark, too.
#[test]
fn a_threshold_leaves_edges_that_no_one_sees() {
    let scene = scene(&[]);
    let mask = |aa, threshold| {
        let settings = Settings {
            threshold,
            hash: Hash::Texture,
            ..settings(aa)
        };
        let mut whitted = Whitted::new(&scene, &settings);
        whitted.pass(0, &mut Film::new(scene.film));
        whitted.resampled().expect("a mask").to_vec()
    };
    let count = |mask: &[bool]| mask.iter().filter(|&&marked| marked).count();
    let all = mask(Antialias::PathHash, 0.0);
    let mut last = count(&all);
    for threshold in [0.02, 0.2, 1.0] {
        let seen = mask(Antialias::PathHash, threshold);
        let contrast = mask(Antialias::Contrast, threshold);
        for ((&seen, &hashed), &contrast) in seen.iter().zip(&all).zip(&contrast) {
            assert!(!seen || (hashed && contrast));
        }
        assert!(count(&seen) < last, "{threshold}");
        last = count(&seen);
    }
    assert!(last > 0);
    assert_eq!(count(&mask(Antialias::PathHash, 3.1)), 0);
}

/// Contrast marks by colour, so a shadow's edge is found without a hash; a threshold beyond white against black marks nothing.
#[test]
fn contrast_marks_by_colour() {
    let scene = scene(&[]);
    let count = |aa, threshold| {
        let settings = Settings {
            threshold,
            ..settings(aa)
        };
        let mut whitted = Whitted::new(&scene, &settings);
        whitted.pass(0, &mut Film::new(scene.film));
        let mask = whitted.resampled().expect("a mask");
        mask.iter().filter(|&&marked| marked).count()
    };
    for aa in [Antialias::Contrast, Antialias::Variance] {
        let counts = [0.02, 0.2, 3.1].map(|threshold| count(aa, threshold));
        assert!(counts[0] > counts[1] && counts[1] > 20, "{counts:?}");
        assert_eq!(counts[2], 0, "three channels differ by 1 each at most");
    }
}

/// A black scene of one pixel, seen along −z from afar, with a lamp of radiance 1 on some of it: x and y run from 0 to 1 over the pixel.
fn lit(lamp: &str, aa: &str) -> Scene {
    let text = format!(
        "[camera]\neye = [0.5, 0.5, 1000]\ntarget = [0.5, 0.5, 0]\nvertical_fov_deg = {}\n\
         [film]\nwidth = 1\nheight = 1\n[render]\nintegrator = \"whitted\"\naa = \"{aa}\"\n\
         [material.lamp]\nemission = {{ radiance = [1, 1, 1], side = \"both\" }}\n{lamp}material = \"lamp\"\n",
        2.0 * libm::atan(0.0005).to_degrees()
    );
    file::parse(&text, "scene", Path::new("."), &[]).expect("a scene")
}

/// Two samples of four are white: their distances from the mean are 3 (1 − s) and 3 s, s = .7354 the sRGB value of ½. Over n − 1 = 3
/// that is a deviation of 1.914; over n it would be 1.658.
#[test]
fn the_deviation_of_a_pixels_samples_is_that_of_statistics() {
    let half = "[[quad]]\ncorner = [0, 0, 0]\nedge_u = [0.5, 0, 0]\nedge_v = [0, 1, 0]\n";
    let scene = lit(half, "variance");
    for (threshold, marked) in [(1.9, true), (1.93, false)] {
        let settings = Settings {
            threshold,
            ..Settings::resolve(&scene.render)
        };
        let mut whitted = Whitted::new(&scene, &settings);
        whitted.pass(0, &mut Film::new(scene.film));
        assert_eq!(whitted.resampled(), Some(&[marked][..]), "{threshold}");
    }
}

#[test]
fn what_is_brighter_than_white_looks_white_and_what_is_below_black_black() {
    let [bright, dark] = [Rgb::new(5.0, 1.0, 80.0), Rgb::new(-3.0, 0.0, -0.1)];
    assert_eq!(contrast(bright, Rgb::ONE), 0.0);
    assert_eq!(contrast(dark, Rgb::ZERO), 0.0);
    assert!((contrast(bright, dark) - 3.0).abs() < 1e-12);
}

/// A disc over the centre that none of the first four looks meets: they agree with each other, and not with the centre.
#[test]
fn adaptive_resampling_compares_its_looks_with_the_centre() {
    let disc = "[[disc]]\ncenter = [0.5, 0.5, 0]\nnormal = [0, 0, 1]\nradius = 0.2\n";
    let scene = lit(disc, "uniform");
    let settings = Settings {
        pattern: Resampling::Adaptive,
        ..Settings::resolve(&scene.render)
    };
    let film = render_unwatched(&scene, &settings).expect("a picture").film;
    assert_eq!(film.pixels()[0].count(), 16.0);
}

#[test]
fn cells_are_told_apart_by_column_and_row() {
    let mut seen = HashSet::new();
    for column in -4..4 {
        for row in -4..4 {
            let mut print = Fingerprint::default();
            print.cell([column, row]);
            assert!(seen.insert(print.value(Hash::Texture)), "{column} {row}");
        }
    }
}
