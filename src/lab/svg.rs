//! Plots as SVG text. Colours of axes and texts follow the page (light or dark); series differ in colour and in mark.

use super::axis::{Span, shows};
use super::plot::{Plot, Series};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

const WIDTH: u32 = 520;
const HEIGHT: u32 = 360;
const LEGEND_LINE: i32 = 20;
const TEXT: i32 = 15;
/// Characters of a name that fit half the width.
const SHORT_NAME: usize = 26;
const INK: RGBColor = RGBColor(0, 0, 0);

/// Okabe and Ito's colours (2008), those that stand out on white and on black.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Lengths of dash and gap of the first, second and third prediction that belong to one series.
const DASHES: [(i32, i32); 3] = [(6, 4), (2, 4), (12, 4)];

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Look {
    colour: RGBColor,
    dash: (i32, i32),
}

/// Draws a plot. Points that its scales cannot show are left out; a plot without any says so.
///
/// A prediction (dashed) has the colour of the series before it, which it belongs to.
pub fn draw(plot: &Plot) -> Result<String, String> {
    let mut svg = String::new();
    let columns = legend_columns(&plot.series);
    let lines = plot.series.len().div_ceil(columns);
    let legend_height = LEGEND_LINE * lines as i32 + 6;
    let size = (WIDTH, HEIGHT + legend_height as u32);
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let (legend, chart) = root.split_vertically(legend_height);
        let looks = looks(&plot.series);
        draw_legend(&legend, &plot.series, &looks)
            .and_then(|()| draw_chart(&chart, plot, &looks))
            .and_then(|()| root.present().map_err(|error| error.to_string()))?;
    }
    Ok(themed(&svg, &plot.title))
}

/// Lets the page's style decide about ink, and names the picture for screen readers.
fn themed(svg: &str, title: &str) -> String {
    let title = title
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;");
    svg.replacen(
        "<svg ",
        &format!("<svg role=\"img\" aria-label=\"{title}\" "),
        1,
    )
    .replace("stroke=\"#000000\"", "stroke=\"currentColor\"")
    .replace("fill=\"#000000\"", "fill=\"currentColor\"")
}

fn looks(series: &[Series]) -> Vec<Look> {
    let (mut measured, mut predictions) = (0, 0);
    let mut colour = INK;
    let look = |one: &Series| {
        if one.predicted {
            predictions += 1;
        } else {
            colour = COLOURS[measured % COLOURS.len()];
            (measured, predictions) = (measured + 1, 0);
        }
        let dash = DASHES[predictions.clamp(1, DASHES.len()) - 1];
        Look { colour, dash }
    };
    series.iter().map(look).collect()
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), String>;

fn text<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> String {
    error.to_string()
}

/// Two columns where several short names allow it.
fn legend_columns(series: &[Series]) -> usize {
    let short = series
        .iter()
        .all(|one| one.name.chars().count() <= SHORT_NAME);
    if short && series.len() > 2 { 2 } else { 1 }
}

fn draw_legend(area: &Area, series: &[Series], looks: &[Look]) -> Drawn {
    let columns = legend_columns(series);
    for (index, (one, look)) in series.iter().zip(looks).enumerate() {
        let left = (index % columns) as i32 * WIDTH as i32 / columns as i32;
        let y = LEGEND_LINE * (index / columns) as i32 + LEGEND_LINE / 2 + 3;
        let ends = [(left + 16, y), (left + 46, y)];
        if one.predicted {
            area.draw(&DashedPathElement::new(
                ends,
                look.dash.0,
                look.dash.1,
                look.colour.stroke_width(2),
            ))
            .map_err(text)?;
        } else {
            area.draw(&PathElement::new(ends, look.colour.stroke_width(2)))
                .map_err(text)?;
            mark(area, (left + 31, y), index, look.colour)?;
        }
        let style = ("sans-serif", TEXT).into_font().color(&INK);
        area.draw(&Text::new(
            one.name.clone(),
            (left + 54, y - TEXT / 2),
            style,
        ))
        .map_err(text)?;
    }
    Ok(())
}

fn draw_chart(area: &Area, plot: &Plot, looks: &[Look]) -> Drawn {
    let xs = || {
        plot.series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p.0))
    };
    let ys = || {
        let points = plot
            .series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p.1));
        points.chain(
            plot.series
                .iter()
                .flat_map(|s| s.intervals.iter().flat_map(|i| [i.0, i.1])),
        )
    };
    let spans = Span::of(xs(), plot.x.scale).zip(Span::of(ys(), plot.y.scale));
    let Some((x, y)) = spans else {
        let style = ("sans-serif", TEXT).into_font().color(&INK);
        return area
            .draw(&Text::new(
                "nothing to show on these scales",
                (20, 20),
                style,
            ))
            .map_err(text);
    };
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(18)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(x, y)
        .map_err(text)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_labels(6)
        .y_labels(6)
        .x_desc(&plot.x.label)
        .y_desc(&plot.y.label)
        .axis_style(INK.stroke_width(1))
        .label_style(("sans-serif", TEXT))
        .axis_desc_style(("sans-serif", TEXT))
        .draw()
        .map_err(text)?;
    let plane = chart.plotting_area();
    for (index, (series, &look)) in plot.series.iter().zip(looks).enumerate() {
        let shown: Vec<(f64, f64)> = series
            .points
            .iter()
            .copied()
            .filter(|p| shows(plot.x.scale, p.0) && shows(plot.y.scale, p.1))
            .collect();
        let places: Vec<(i32, i32)> = shown.iter().map(|p| plane.map_coordinate(p)).collect();
        draw_intervals(plane, plot, series, look.colour)?;
        let corner = plane.get_base_pixel();
        let local: Vec<(i32, i32)> = places
            .iter()
            .map(|p| (p.0 - corner.0, p.1 - corner.1))
            .collect();
        let flat = plane.strip_coord_spec();
        if series.predicted {
            flat.draw(&DashedPathElement::new(
                local,
                look.dash.0,
                look.dash.1,
                look.colour.stroke_width(2),
            ))
            .map_err(text)?;
        } else {
            flat.draw(&PathElement::new(
                local.clone(),
                look.colour.stroke_width(2),
            ))
            .map_err(text)?;
            for &place in &local {
                mark(&flat, place, index, look.colour)?;
            }
        }
    }
    Ok(())
}

fn draw_intervals(
    plane: &DrawingArea<SVGBackend, Cartesian2d<Span, Span>>,
    plot: &Plot,
    series: &Series,
    colour: RGBColor,
) -> Drawn {
    let flat = plane.strip_coord_spec();
    for (&(x_value, _), &(low, high)) in series.points.iter().zip(&series.intervals) {
        if !shows(plot.x.scale, x_value) || !shows(plot.y.scale, high) {
            continue;
        }
        // An interval that reaches 0 on a logarithmic scale goes down to the edge.
        let low = if shows(plot.y.scale, low) {
            low
        } else {
            plane.get_y_range().start
        };
        let (x, low) = plane.map_coordinate(&(x_value, low));
        let (_, high) = plane.map_coordinate(&(x_value, high));
        let corner = plane.get_base_pixel();
        let at = |x: i32, y: i32| (x - corner.0, y - corner.1);
        for line in [
            [at(x, low), at(x, high)],
            [at(x - 3, low), at(x + 3, low)],
            [at(x - 3, high), at(x + 3, high)],
        ] {
            flat.draw(&PathElement::new(line, colour.stroke_width(1)))
                .map_err(text)?;
        }
    }
    Ok(())
}

/// A mark of its own shape for each series, so that colour is not needed to tell them apart.
fn mark(area: &Area, (x, y): (i32, i32), series: usize, colour: RGBColor) -> Drawn {
    let fill = colour.filled();
    match series % 4 {
        0 => area.draw(&Circle::new((x, y), 4, fill)),
        1 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], fill)),
        2 => area.draw(&Polygon::new(
            [(x, y - 5), (x - 5, y + 4), (x + 5, y + 4)],
            fill,
        )),
        _ => area.draw(&Polygon::new(
            [(x, y - 5), (x - 5, y), (x, y + 5), (x + 5, y)],
            fill,
        )),
    }
    .map_err(text)
}

#[cfg(test)]
mod tests {
    use super::super::plot::Axis;
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot {
        let intervals = points.iter().map(|p| (p.1 * 0.5, p.1 * 2.0));
        Plot::new(
            "Error falls with \"work\" & time",
            Axis::log("rays"),
            Axis::log("error (W)"),
            [
                Series::measured("measured", points.clone()).with_intervals(intervals),
                Series::predicted("theory", points.clone()),
            ],
        )
    }

    #[test]
    fn a_plot_has_its_texts_and_follows_the_pages_ink() {
        let svg = draw(&plot(vec![(1.0, 1.0), (100.0, 0.1), (1000.0, 0.03)])).unwrap();
        for word in [
            "rays",
            "error (W)",
            "measured",
            "theory",
            "10",
            "&quot;work&quot; &amp; time",
        ] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(!svg.contains("#000000") && svg.contains("currentColor"));
    }

    #[test]
    fn predictions_share_the_colour_of_their_series_and_differ_in_dashes() {
        let one = |predicted| Series {
            predicted,
            ..Series::measured("", [])
        };
        let looks = looks(&[one(true), one(false), one(true), one(true), one(false)]);
        assert_eq!(looks[0].colour, INK);
        assert_eq!(
            (looks[2].colour, looks[3].colour),
            (looks[1].colour, looks[1].colour)
        );
        assert_ne!(looks[2].dash, looks[3].dash);
        assert_ne!(looks[4].colour, looks[1].colour);
    }

    #[test]
    fn points_off_the_scale_are_left_out() {
        let svg = draw(&plot(vec![(0.0, 1.0), (f64::NAN, 2.0), (3.0, -1.0)])).unwrap();
        assert!(svg.contains("</svg>"));
        let svg = draw(&plot(Vec::new())).unwrap();
        assert!(svg.contains("nothing to show"));
        assert!(draw(&plot(vec![(2.0, 2.0)])).unwrap().contains("</svg>"));
    }
}
