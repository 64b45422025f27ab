//! Patterns of samples, and the thresholds that ask for them.

use super::{scene, settings};
use photolathe::numeric::work::Work;
use photolathe::render::antialias::pattern::{CENTER, ROOKS, grid};
use photolathe::render::driver::render_unwatched;
use photolathe::render::film::Film;
use photolathe::render::settings::Settings;
use photolathe::render::whitted::Whitted;
use photolathe::scene::options::{Antialias, Hash, Resampling};

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
