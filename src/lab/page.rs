//! Pages: self-contained HTML from templates, without network or neighbours.

use super::contrast::{Contrast, ContrastView};
use crate::image::metrics::Comparison;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

const STYLE: &str = include_str!("templates/style.css");
const CONTRAST: &str = include_str!("templates/contrast.html");
const SCRIPT: &str = include_str!("templates/contrast.js");

/// Fills a template; every value is escaped unless the template says it is safe.
pub fn fill(template: &str, values: impl Serialize) -> Result<String, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_global("style", STYLE);
    environment.add_global("script", SCRIPT);
    environment.add_global("version", env!("CARGO_PKG_VERSION"));
    environment.add_template("contrast.html", CONTRAST)?;
    environment.render_str(template, minijinja::value::Serde(values))
}

/// A number for people: five digits without trailing zeros, in exponent form where plain digits would be long.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if !x.is_finite() {
        if x.is_nan() {
            "–".to_owned()
        } else {
            format!("{}∞", if x < 0.0 { "−" } else { "" })
        }
    } else if x == x.trunc() && size < 1e6 {
        format!("{x:.0}").replace('-', "−")
    } else if (1e-3..1e5).contains(&size) {
        let digits = (4 - libm::log10(size).floor() as i32).clamp(0, 8) as usize;
        let text = format!("{x:.digits$}").replace('-', "−");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    } else {
        format!("{x:.3e}").replace('-', "−")
    }
}

/// The same in ASCII, for terminals.
pub fn ascii_number(x: f64) -> String {
    number(x)
        .replace('−', "-")
        .replace('∞', "inf")
        .replace('–', "-")
}

#[derive(Serialize)]
struct ComparisonPage {
    name_a: String,
    name_b: String,
    identical: bool,
    pictures: ContrastView,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    name: &'static str,
    texts: Vec<String>,
    note: &'static str,
}

/// The page of `compare`: both pictures, and how far they are apart.
pub fn comparison(pictures: &Contrast, c: &Comparison) -> anyhow::Result<String> {
    let mut rows = Vec::new();
    let mut row = |name, values: &[f64], note| {
        let mut texts: Vec<String> = values.iter().map(|&x| number(x)).collect();
        texts.resize(3, String::new());
        rows.push(Row { name, texts, note });
    };
    row("mse", &[c.mse], "mean of (a − b)²");
    row("rmse", &[c.rmse], "");
    row("relmse", &[c.relmse], "mean of (a − b)²/(b² + .01)");
    row("psnr", &[c.psnr], "dB, peak 1");
    row("max", &[c.max], "largest |a − b|");
    row("mean a", &c.mean_a, "red, green, blue");
    row("mean b", &c.mean_b, "");
    row("bias", &c.bias, "mean a − mean b");
    row(
        "not finite",
        &[c.not_finite as f64],
        "pixels that are NaN or infinite",
    );
    if let Some(p) = &c.p_values {
        row("bias se", &p.bias_se, "standard error of the bias");
        row("z", &p.z, "bias in standard errors");
        row("p of the mean", &p.p_mean, "two-sided");
        row(
            "p of blocks",
            &[p.p_blocks],
            "smallest over 16×16-pixel blocks, corrected (Holm)",
        );
        row(
            "p of uniformity",
            &[p.p_uniform],
            "of the blocks' p-values (Kolmogorov-Smirnov)",
        );
    }
    let page = ComparisonPage {
        name_a: pictures.a.0.clone(),
        name_b: pictures.b.0.clone(),
        identical: c.identical,
        pictures: pictures.view()?,
        rows,
    };
    Ok(fill(include_str!("templates/comparison.html"), page)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_sign() {
        for (x, text) in [
            (0.0, "0"),
            (3.0, "3"),
            (-2.5, "−2.5"),
            (5.000_000_1, "5"),
            (12_300.2, "12300"),
            (0.012_345_6, "0.012346"),
            (123.456_78, "123.46"),
            (1.5e-7, "1.500e−7"),
            (f64::INFINITY, "∞"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn text_is_escaped() {
        let text = fill("{{ a }}", std::collections::BTreeMap::from([("a", "<b>")])).unwrap();
        assert_eq!(text, "&lt;b&gt;");
    }
}
