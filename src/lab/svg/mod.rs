//! Plots as SVG text. Colours of axes and texts follow the page (light or dark); series differ in colour and in mark.

mod front;
mod legend;
mod marks;

use super::axis::Span;
use super::plot::{Plot, Series, Style};
use marks::mark;
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

const WIDTH: u32 = 440;
const HEIGHT: u32 = 340;
const TEXT: i32 = 17;
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

/// A place in pixels.
type Place = (i32, i32);
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plane<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<Span, Span>>;
type Drawn = Result<(), String>;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Look {
    style: Style,
    colour: RGBColor,
    dash: (i32, i32),
    /// Number of its mark.
    mark: usize,
}

/// Draws a plot. Points that its scales cannot show are left out; a plot without any says so.
///
/// A prediction (dashed) has the colour of the measured series before it, which it belongs to, or of the ink if there is none.
pub fn draw(plot: &Plot) -> Result<String, String> {
    let mut svg = String::new();
    let looks = looks(&plot.series);
    let legend = legend::Legend::of(plot, &looks);
    let size = (WIDTH, HEIGHT + legend.height());
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let (top, chart) = root.split_vertically(legend.height());
        legend
            .draw(&top)
            .and_then(|()| draw_chart(&chart, plot, &looks))
            .and_then(|()| root.present().map_err(|error| error.to_string()))?;
    }
    Ok(themed(&svg, &plot.title))
}

/// Lets the page's style decide about ink, and names the picture for screen readers. Inside a page SVG needs no name space.
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
    .replace(" xmlns=\"http://www.w3.org/2000/svg\"", "")
    .replace("stroke=\"#000000\"", "stroke=\"currentColor\"")
    .replace("fill=\"#000000\"", "fill=\"currentColor\"")
}

fn looks(series: &[Series]) -> Vec<Look> {
    let (mut measured, mut predictions) = (0, 0);
    let mut colour = INK;
    let look = |one: &Series| {
        if one.style == Style::Prediction {
            predictions += 1;
        } else {
            colour = COLOURS[measured % COLOURS.len()];
            (measured, predictions) = (measured + 1, 0);
        }
        Look {
            style: one.style,
            colour,
            dash: DASHES[predictions.clamp(1, DASHES.len()) - 1],
            mark: measured.saturating_sub(1),
        }
    };
    series.iter().map(look).collect()
}

fn text<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> String {
    error.to_string()
}

fn write(area: &Area, words: &str, place: Place, size: i32) -> Drawn {
    let style = ("sans-serif", size).into_font().color(&INK);
    area.draw(&Text::new(words.to_owned(), place, style))
        .map_err(text)
}

/// The line of a series, if it has one.
fn line(area: &Area, places: Vec<Place>, look: Look) -> Drawn {
    let stroke = look.colour.stroke_width(2);
    match look.style {
        Style::Marks => Ok(()),
        Style::Line => area.draw(&PathElement::new(places, stroke)).map_err(text),
        Style::Prediction => {
            let (dash, gap) = look.dash;
            area.draw(&DashedPathElement::new(places, dash, gap, stroke))
                .map_err(text)
        }
    }
}

fn spans(plot: &Plot) -> Option<(Span, Span)> {
    let points = || plot.series.iter().flat_map(|series| &series.points);
    let ends = plot.series.iter().flat_map(|series| &series.intervals);
    let ys = points().map(|point| point.1);
    let ys = ys.chain(ends.flat_map(|&(low, high)| [low, high]));
    Span::of(points().map(|point| point.0), plot.x.scale).zip(Span::of(ys, plot.y.scale))
}

fn draw_chart(area: &Area, plot: &Plot, looks: &[Look]) -> Drawn {
    let Some((x, y)) = spans(plot) else {
        return write(area, "nothing to show on these scales", (20, 20), TEXT);
    };
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(18)
        .x_label_area_size(48)
        .y_label_area_size(76)
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
    let flat = plane.strip_coord_spec();
    for (series, &look) in plot.series.iter().zip(looks) {
        draw_intervals(plane, plot, series, look.colour)?;
        let shown = series.points.iter().filter(|at| has_place(plot, at));
        let places: Vec<Place> = shown.map(|&at| local(plane, at)).collect();
        line(&flat, places.clone(), look)?;
        if look.style != Style::Prediction {
            for place in places {
                mark(&flat, place, look)?;
            }
        }
    }
    front::draw(plane, plot)
}

fn has_place(plot: &Plot, at: &(f64, f64)) -> bool {
    plot.x.scale.shows(at.0) && plot.y.scale.shows(at.1)
}

/// Where a point is, counted from the corner of the plane.
fn local(plane: &Plane, at: (f64, f64)) -> Place {
    let (corner, place) = (plane.get_base_pixel(), plane.map_coordinate(&at));
    (place.0 - corner.0, place.1 - corner.1)
}

fn draw_intervals(plane: &Plane, plot: &Plot, series: &Series, colour: RGBColor) -> Drawn {
    let flat = plane.strip_coord_spec();
    for (&(x_value, _), &(low, high)) in series.points.iter().zip(&series.intervals) {
        if !has_place(plot, &(x_value, high)) {
            continue;
        }
        // An interval that reaches 0 on a logarithmic scale goes down to the edge.
        let low = if plot.y.scale.shows(low) {
            low
        } else {
            plane.get_y_range().start
        };
        let (x, low) = local(plane, (x_value, low));
        let (_, high) = local(plane, (x_value, high));
        for ends in [
            [(x, low), (x, high)],
            [(x - 3, low), (x + 3, low)],
            [(x - 3, high), (x + 3, high)],
        ] {
            flat.draw(&PathElement::new(ends, colour.stroke_width(1)))
                .map_err(text)?;
        }
    }
    Ok(())
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
        assert!(!svg.contains("Pareto") && !svg.contains("http"));
    }

    #[test]
    fn series_differ_in_mark_too_and_predictions_share_the_colour_of_theirs() {
        let one = |predicted| match predicted {
            true => Series::predicted("", []),
            false => Series::measured("", []),
        };
        let looks = looks(&[one(true), one(false), one(true), one(true), one(false)]);
        assert_eq!(looks[0].colour, INK);
        assert_eq!(
            (looks[2].colour, looks[3].colour),
            (looks[1].colour, looks[1].colour)
        );
        assert_ne!(looks[2].dash, looks[3].dash);
        assert_ne!(looks[4].colour, looks[1].colour);
        assert_ne!(looks[4].mark, looks[1].mark);
    }

    #[test]
    fn points_off_the_scale_are_left_out() {
        let svg = draw(&plot(vec![(0.0, 1.0), (f64::NAN, 2.0), (3.0, -1.0)])).unwrap();
        assert!(svg.contains("</svg>"));
        let svg = draw(&plot(Vec::new())).unwrap();
        assert!(svg.contains("nothing to show"));
        assert!(draw(&plot(vec![(2.0, 2.0)])).unwrap().contains("</svg>"));
    }

    #[test]
    fn a_plot_of_speed_and_error_marks_its_front_and_names_its_points() {
        let fast = Series::measured("fast", [(1.0, 0.1), (2.0, 0.01)]).with_labels(["few", "many"]);
        let slow = Series::measured("slow", [(4.0, 0.05)]).with_labels(["beaten"]);
        let svg = draw(&Plot::speed_error("t", "time (s)", "error", [fast, slow])).unwrap();
        for word in ["Pareto front", "few", "many", "beaten", "time (s)"] {
            assert!(svg.contains(word), "{word}");
        }
        assert_eq!(
            svg.matches("r=\"8\"").count(),
            3,
            "one in the legend: {svg}"
        );
    }
}
