//! Pictures survive their files, bad files are errors, and the metrics are what their definitions say.

use photolathe::image::metrics::{blocks, compare};
use photolathe::image::picture::Picture;
use photolathe::image::{exr, file, png};
use photolathe::numeric::rng::{Purpose, Stream};
use std::path::Path;

/// A picture of every kind of value, with statistics and attributes.
fn sample(width: usize, height: usize, seed: u64) -> Picture {
    let mut stream = Stream::new(seed, Purpose::Test, 0);
    let count = width * height;
    let mut pixels = |scale: f64| -> Vec<[f32; 3]> {
        (0..count)
            .map(|_| [0; 3].map(|_| (scale * stream.uniform()) as f32))
            .collect()
    };
    let mut rgb = pixels(3.0);
    rgb[0] = [0.0, -0.0, f32::MIN_POSITIVE / 2.0];
    let attributes = (0..12).map(|i| (format!("note{i}"), format!("{{\"value\": {i}}}")));
    Picture {
        width,
        height,
        variance: Some(pixels(0.01)),
        samples: Some(vec![16.0; count]),
        rgb,
        attributes: attributes.collect(),
        features: Vec::new(),
    }
}

#[test]
fn a_picture_survives_its_file_bit_by_bit() {
    for (width, height) in [(1, 1), (1, 37), (37, 1), (33, 50)] {
        let mut picture = sample(width, height, 1);
        picture.rgb[0][1] = f32::NAN;
        let back = exr::decode(&exr::encode(&picture).unwrap()).unwrap();
        let bits = |p: &Picture| -> Vec<u32> {
            p.rgb.as_flattened().iter().map(|x| x.to_bits()).collect()
        };
        assert_eq!(bits(&back), bits(&picture));
        assert_eq!(back.variance, picture.variance);
        assert_eq!(back.samples, picture.samples);
        for (name, text) in &picture.attributes {
            assert_eq!(back.attributes.get(name), Some(text));
        }
    }
}

/// The codec keeps attributes in a hash map, whose order differs from map to map: 20 tries of 12 attributes.
#[test]
fn equal_pictures_give_equal_bytes() {
    let first = exr::encode(&sample(40, 40, 2)).unwrap();
    for _ in 0..20 {
        assert_eq!(exr::encode(&sample(40, 40, 2)).unwrap(), first);
    }
}

#[test]
fn the_header_stays_readable_by_the_plain_codec() {
    use ::exr::prelude::*;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let picture = sample(20, 40, 3);
    photolathe::image::exr::write(&picture, &path).unwrap();
    let image = read_all_flat_layers_from_file(&path).unwrap();
    let layer = &image.layer_data[0];
    let names: Vec<String> = layer
        .channel_data
        .list
        .iter()
        .map(|c| c.name.to_string())
        .collect();
    assert_eq!(
        names,
        [
            "B",
            "G",
            "R",
            "samples",
            "variance.B",
            "variance.G",
            "variance.R"
        ]
    );
    assert_eq!(layer.encoding.compression, Compression::ZIP16);
    assert_eq!(layer.encoding.blocks, Blocks::ScanLines);
}

#[test]
fn half_float_files_with_alpha_are_read() {
    use ::exr::prelude::*;
    let values =
        |scale: f32| FlatSamples::F16((0..6).map(|i| f16::from_f32(scale * i as f32)).collect());
    let channels = ["R", "G", "B", "A"].map(|name| AnyChannel::new(name, values(0.5)));
    let image = Image::from_channels((3, 2), AnyChannels::sort(SmallVec::from_iter(channels)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    let picture = photolathe::image::exr::decode(&bytes.into_inner()).unwrap();
    assert_eq!((picture.width, picture.height), (3, 2));
    assert_eq!(picture.rgb[5], [2.5; 3]);
    assert!(picture.variance.is_none() && picture.samples.is_none());
}

/// 4000 files with a damaged byte and every shorter file: each gives a picture or an error, never a panic.
#[test]
fn damaged_files_are_errors() {
    let good = exr::encode(&sample(20, 20, 4)).unwrap();
    let mut stream = Stream::new(5, Purpose::Test, 1);
    for _ in 0..4000 {
        let mut bytes = good.clone();
        // Half of the damage in the header, which decides about memory.
        let reach = if stream.uniform() < 0.5 {
            900
        } else {
            bytes.len()
        };
        let at = (stream.uniform() * reach as f64) as usize;
        bytes[at] = stream.next_u64() as u8;
        let _ = exr::decode(&bytes);
    }
    for length in (0..good.len()).step_by(7) {
        assert!(exr::decode(&good[..length]).is_err());
    }
}

#[test]
fn a_header_that_claims_too_much_is_refused_before_memory_is_taken() {
    let mut bytes = exr::encode(&sample(4, 4, 6)).unwrap();
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    for (right, bottom) in [
        (8000_i32, 8000_i32),
        (100_000, 100_000),
        (i32::MAX - 1, i32::MAX - 1),
        (-5, 3),
    ] {
        bytes[at + 8..at + 12].copy_from_slice(&right.to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&bottom.to_le_bytes());
        let reason = exr::decode(&bytes).unwrap_err();
        assert!(!reason.is_empty());
    }
}

#[test]
fn a_missing_or_foreign_file_is_named_in_the_error() {
    let directory = tempfile::tempdir().unwrap();
    let absent = directory.path().join("absent.exr");
    assert!(
        exr::read(&absent)
            .unwrap_err()
            .to_string()
            .contains("absent.exr")
    );
    let foreign = directory.path().join("foreign.exr");
    file::write_atomically(&foreign, b"not an image").unwrap();
    let message = exr::read(&foreign).unwrap_err().to_string();
    assert!(
        message.contains("foreign.exr") && message.contains("EXR"),
        "{message}"
    );
    let unwritable = foreign.join("below-a-file.exr");
    assert!(exr::write(&sample(2, 2, 0), &unwritable).is_err());
}

#[test]
fn no_temporary_file_is_left() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("deep/a.png");
    png::write(&sample(3, 3, 0), 1.0, &path).unwrap();
    let names: Vec<_> = std::fs::read_dir(path.parent().unwrap()).unwrap().collect();
    assert_eq!(names.len(), 1);
}

fn grey(values: &[f32], variance: Option<f32>) -> Picture {
    Picture {
        width: values.len(),
        height: 1,
        rgb: values.iter().map(|&v| [v, v, v]).collect(),
        variance: variance.map(|v| vec![[v; 3]; values.len()]),
        ..Picture::default()
    }
}

#[test]
fn the_metrics_are_their_definitions() {
    let c = compare(&grey(&[1.0, 2.0], None), &grey(&[1.5, 2.0], None)).unwrap();
    assert!((c.mse - 0.125).abs() < 1e-15);
    assert!((c.rmse - 0.125_f64.sqrt()).abs() < 1e-15);
    assert!((c.relmse - 0.25 / 2.26 / 2.0).abs() < 1e-15);
    assert!((c.psnr - 9.030_899_869_919_436).abs() < 1e-12);
    assert!((c.max - 0.5).abs() < 1e-15);
    assert_eq!(c.bias, [-0.25; 3]);
    assert!(!c.identical && c.p_values.is_none());
}

#[test]
fn identical_means_the_same_bits() {
    let c = compare(&grey(&[1.0, 0.0], None), &grey(&[1.0, 0.0], None)).unwrap();
    assert!(c.identical && c.psnr.is_infinite());
    let c = compare(&grey(&[1.0, 0.0], None), &grey(&[1.0, -0.0], None)).unwrap();
    assert!(!c.identical && c.mse == 0.0);
}

#[test]
fn a_pixel_that_is_not_a_number_cannot_hide() {
    let c = compare(&grey(&[f32::NAN, 0.0], None), &grey(&[1.0, 0.0], None)).unwrap();
    assert_eq!(c.not_finite, 1);
    assert!(c.mse.is_nan() && c.max.is_nan());
    let json = serde_json::to_value(&c).unwrap();
    assert!(json["mse"].is_null());
}

#[test]
fn different_sizes_cannot_be_compared() {
    let error = compare(&grey(&[1.0], None), &grey(&[1.0, 2.0], None)).unwrap_err();
    assert_eq!(error.to_string(), "sizes differ: 1 x 1 against 2 x 1");
}

#[test]
fn block_means_join_to_the_mean() {
    let picture = sample(40, 21, 9);
    let all = blocks(&picture, 16);
    assert_eq!(all.len(), 3 * 2);
    let weights = [16.0, 16.0, 8.0]
        .map(|w| w * 16.0)
        .into_iter()
        .chain([16.0, 16.0, 8.0].map(|w| w * 5.0));
    let sum: f64 = all.iter().zip(weights).map(|(b, w)| b.mean[1] * w).sum();
    assert!((sum / 840.0 - photolathe::image::metrics::mean(&picture)[1]).abs() < 1e-12);
}

#[derive(clap::Parser)]
struct CompareCommand {
    #[command(flatten)]
    args: photolathe::cli::compare::Args,
}

#[test]
fn compare_writes_a_page_and_a_map_that_need_nothing_else() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    exr::write(&sample(20, 10, 1), path("a.exr").as_ref()).unwrap();
    exr::write(&sample(20, 10, 2), path("b.exr").as_ref()).unwrap();
    exr::write(&sample(10, 20, 2), path("turned.exr").as_ref()).unwrap();
    let compare = |b: &str| {
        let words = [
            "compare",
            &path("a.exr"),
            &path(b),
            "--html",
            &path("c.html"),
            "--diff",
            &path("d.png"),
        ];
        photolathe::cli::compare::run(<CompareCommand as clap::Parser>::parse_from(words).args)
    };
    assert_eq!(compare("b.exr").unwrap(), std::process::ExitCode::SUCCESS);
    let page = std::fs::read_to_string(path("c.html")).unwrap();
    // Both pictures and the map of their difference, each embedded once.
    assert!(page.contains("relmse") && page.matches("data:image/png;base64,").count() == 3);
    assert!(!page.contains("http") && !page.contains("src=\"/") && !page.contains("url("));
    assert!(
        std::fs::read(path("d.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
    assert!(
        compare("turned.exr")
            .unwrap_err()
            .root_cause()
            .to_string()
            .contains("sizes differ")
    );
    assert!(compare("absent.exr").is_err());
}

/// Pictures of the same expectation: 64 × 64 normal-like pixels (sum of 12 uniforms) of known variance.
fn noisy(seed: u64, shift: f64) -> Picture {
    let count = 64 * 64;
    let mut stream = Stream::new(seed, Purpose::Test, 7);
    let mut noise = || (0..12).map(|_| stream.uniform()).sum::<f64>() - 6.0;
    Picture {
        width: 64,
        height: 64,
        rgb: (0..count)
            .map(|_| [0; 3].map(|_| (2.0 + shift + 0.1 * noise()) as f32))
            .collect(),
        variance: Some(vec![[0.01; 3]; count]),
        ..Picture::default()
    }
}

/// Over 200 pairs, p-values below 1 % come up about 1 % of the time (6 sigma: at most 2 + 6·√2 → 10 of 200, for three channels
/// 24 of 600), and a shift of 6 standard errors of the mean is always seen.
#[test]
fn p_values_of_pictures_hold_their_level_and_see_a_shift() {
    let (mut means, mut block, mut uniform) = (0, 0, 0);
    for pair in 0..200 {
        let p = compare(&noisy(2 * pair, 0.0), &noisy(2 * pair + 1, 0.0))
            .unwrap()
            .p_values
            .unwrap();
        means += p.p_mean.iter().filter(|&&p| p < 0.01).count();
        block += usize::from(p.p_blocks < 0.01);
        uniform += usize::from(p.p_uniform < 0.01);
    }
    assert!(
        means <= 24 && block <= 10 && uniform <= 10,
        "{means} {block} {uniform}"
    );
    let standard_error = (0.02 / 4096.0_f64).sqrt();
    let seen = compare(&noisy(1, 6.0 * standard_error), &noisy(2, 0.0))
        .unwrap()
        .p_values
        .unwrap();
    assert!(seen.p_mean.iter().all(|&p| p < 0.001), "{seen:?}");
}

/// The program's exit code and what it says, for words without blanks.
fn photolathe(command: &str) -> (Option<i32>, String) {
    let done = std::process::Command::new(env!("CARGO_BIN_EXE_photolathe"))
        .args(command.split_whitespace())
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts");
    (
        done.status.code(),
        String::from_utf8_lossy(&done.stderr).into_owned(),
    )
}

/// Renders a small hourglass.
fn render(more: &str) -> (Option<i32>, String) {
    photolathe(&format!(
        "render scenes/hourglass.toml --photons 400 --set film.width=12 --set film.height=12 {more}"
    ))
}

#[test]
fn parts_of_a_render_join_to_its_bytes_for_any_split() {
    let folder = tempfile::tempdir().unwrap();
    let name = |file: &str| folder.path().join(file).display().to_string();
    for method in [
        "--integrator pppm --kernel fourth-order",
        "--integrator ppm --rule constant",
        "--integrator sppm --rule geometric-as-coded",
    ] {
        let whole = name("whole.exr");
        let done = render(&format!("{method} --passes 7 --threads 2 -o {whole}"));
        assert_eq!(done.0, Some(0), "{}", done.1);
        for split in [&[0, 7][..], &[0, 1, 7], &[0, 2, 3, 7], &[0, 5, 6, 7]] {
            let mut parts = Vec::new();
            for ends in split.windows(2) {
                let part = name(&format!("{}.part", ends[0]));
                let range = format!("--pass-range {}..{}", ends[0], ends[1]);
                let done = render(&format!("{method} {range} --threads 1 -o {part}"));
                assert_eq!(done.0, Some(0), "{}", done.1);
                parts.insert(0, part);
            }
            let joined = name("joined.exr");
            let done = photolathe(&format!("merge {} -o {joined}", parts.join(" ")));
            assert_eq!(done.0, Some(0), "{}", done.1);
            assert!(std::fs::read(&joined).unwrap() == std::fs::read(&whole).unwrap());
        }
    }
}

#[test]
fn what_cannot_be_split_or_joined_is_refused_with_one_error() {
    let folder = tempfile::tempdir().unwrap();
    let name = |file: &str| folder.path().join(file).display().to_string();
    let refused = |done: (Option<i32>, String), words: &str| {
        assert_eq!(done.0, Some(2), "{}", done.1);
        assert!(done.1.contains(words), "{}", done.1);
    };
    let part = name("part");
    for method in ["--integrator sppm", "--integrator path", "--rule local"] {
        let done = render(&format!("{method} --pass-range 0..2 -o {part}"));
        refused(done, "passes cannot be made apart");
    }
    for range in ["2..2", "3..1", "1", "a..b", "0..99999999999"] {
        let done = render(&format!("--integrator pppm --pass-range {range} -o {part}"));
        refused(done, "expected two whole numbers");
    }
    let done = render("--integrator pppm --pass-range 0..2 -o part.exr");
    refused(done, "does not end in .exr or .png");
    let done = render("--integrator pppm --pass-range 0..9 --passes 8 -o part");
    refused(done, "goes beyond --passes 8");
    assert!(!Path::new(&part).exists());

    let made = |range: &str, more: &str| {
        let part = name(&format!("{range}{}.part", more.replace(' ', "_")));
        let done = render(&format!(
            "--integrator pppm --pass-range {range} {more} -o {part}"
        ));
        assert_eq!(done.0, Some(0), "{}", done.1);
        part
    };
    let (first, last) = (made("0..1", ""), made("2..3", ""));
    let out = name("out.exr");
    let merge = |parts: &[&str]| photolathe(&format!("merge {} -o {out}", parts.join(" ")));
    refused(merge(&[&first, &last]), "passes 1..2 are missing");
    refused(merge(&[&last]), "passes 0..2 are missing");
    refused(merge(&[&first, &first]), "both hold pass 0");
    for (setting, words) in [
        ("--seed 1", "seed differs: 1 against 0"),
        ("--alpha 0.5", "alpha differs: 0.5"),
        ("--max-depth 9", "max_depth differs: 9 against null"),
        ("--set film.width=13", "size differs"),
        ("--set camera.vertical_fov_deg=31", "scene_hash differs"),
    ] {
        refused(merge(&[&first, &made("1..2", setting)]), words);
    }
    let bytes = std::fs::read(&first).unwrap();
    for (wrong, words) in [
        (&bytes[..bytes.len() / 2], "incomplete or damaged"),
        (&bytes[..20], "incomplete or damaged"),
        (&b"magic"[..], "not a part"),
        (&[], "not a part"),
    ] {
        std::fs::write(&part, wrong).unwrap();
        refused(merge(&[&part, &first]), words);
    }
    refused(merge(&["scenes/hourglass.toml"]), "not a part");
    refused(merge(&["nowhere"]), "nowhere");
    assert!(!Path::new(&out).exists());
}
