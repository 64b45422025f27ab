//! Dots on a logarithmic scale, a row for each name.

use std::fmt::Write as _;

/// Dots of one kind: a name, a colour and a shape for the legend, and a value for each row.
pub(super) struct Dots {
    pub(super) name: &'static str,
    pub(super) values: Vec<Option<f64>>,
}

const LABEL: f64 = 150.0;
const WIDTH: f64 = 620.0;
const ROW: f64 = 20.0;
const TOP: f64 = 30.0;
/// Okabe and Ito's colours (2008).
const COLOURS: [&str; 3] = ["#d55e00", "#0072b2", "#009e73"];

/// Draws the rows. Values that are absent or not above zero have no dot; a scale is drawn from the least decade to the greatest.
pub(super) fn svg(title: &str, unit: &str, rows: &[String], kinds: &[Dots]) -> String {
    let shown = kinds.iter().flat_map(|kind| kind.values.iter().flatten());
    let logs = shown.filter(|v| **v > 0.0).map(|v| libm::log10(*v));
    let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let (low, high) = match low <= high {
        true => (low.floor(), high.ceil().max(low.floor() + 1.0)),
        false => (-1.0, 0.0),
    };
    let x = |value: f64| LABEL + (WIDTH - LABEL - 20.0) * (libm::log10(value) - low) / (high - low);
    let y = |row: usize| TOP + ROW * (row as f64 + 0.7);
    let bottom = TOP + ROW * rows.len() as f64 + 10.0;
    let mut out = format!(
        "<svg viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"{}\" font-family=\"sans-serif\" font-size=\"13\">",
        bottom + 42.0,
        escaped(title)
    );
    let step = ((high - low) / 8.0).ceil().max(1.0);
    let mut decade = low;
    while decade <= high {
        let at = x(libm::exp10(decade));
        put(
            &mut out,
            format_args!(
                "<path d=\"M{at:.1} {TOP}V{bottom:.1}\" stroke=\"currentColor\" stroke-opacity=\".2\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">1e{decade}</text>",
                bottom + 16.0
            ),
        );
        decade += step;
    }
    put(
        &mut out,
        format_args!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            0.5 * (LABEL + WIDTH),
            bottom + 36.0,
            escaped(unit)
        ),
    );
    for (row, name) in rows.iter().enumerate() {
        put(
            &mut out,
            format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LABEL - 12.0,
                y(row) + 4.0,
                escaped(name)
            ),
        );
    }
    for (index, kind) in kinds.iter().enumerate() {
        let legend = LABEL + 150.0 * index as f64;
        mark(&mut out, index, legend, 12.0);
        put(
            &mut out,
            format_args!(
                "<text x=\"{:.1}\" y=\"16\">{}</text>",
                legend + 10.0,
                kind.name
            ),
        );
        for (row, value) in kind.values.iter().enumerate() {
            if let Some(value) = value.filter(|v| *v > 0.0) {
                mark(&mut out, index, x(value), y(row));
            }
        }
    }
    out + "</svg>"
}

fn put(out: &mut String, text: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = out.write_fmt(text);
}

/// Each kind has its own shape, so that colour is not needed to tell them apart.
fn mark(out: &mut String, kind: usize, x: f64, y: f64) {
    let colour = COLOURS[kind % COLOURS.len()];
    let path = match kind {
        0 => "m0-5a5 5 0 1 0 .01 0z",
        1 => "m-4-4h8v8h-8z",
        _ => "m0-5l5 9h-10z",
    };
    put(
        out,
        format_args!("<path fill=\"{colour}\" d=\"M{x:.1} {y:.1}{path}\"/>"),
    );
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
