//! A profile as a drawing: lines, dots and labels, written as SVG or PNG.

use crate::geometry::profile::{Piece, Profile};
use image::{ImageFormat, Rgb, RgbImage};
use std::fmt::Write as _;
use std::io::Cursor;

/// Longer side of the drawing, in pixels.
const SIZE: f64 = 760.0;
const MARGIN: f64 = 44.0;
/// Straight steps along a piece.
const STEPS: usize = 96;

const AXIS: Color = [150, 150, 150];
const POLYGON: Color = [170, 170, 170];
const MIRRORED: Color = [214, 214, 222];
const JOINT: Color = [20, 20, 20];
const PIECES: [Color; 2] = [[31, 104, 178], [200, 92, 32]];

type Color = [u8; 3];
type Point = [f64; 2];

/// A drawing in pixels, y down.
#[derive(Debug)]
pub(super) struct Drawing {
    width: f64,
    height: f64,
    title: String,
    lines: Vec<Line>,
    dots: Vec<Dot>,
    labels: Vec<(Point, String)>,
}

#[derive(Debug)]
struct Line {
    points: Vec<Point>,
    color: Color,
    width: f64,
}

#[derive(Debug)]
struct Dot {
    at: Point,
    radius: f64,
    color: Color,
}

/// From (radius, height) to pixels.
#[derive(Clone, Copy, Debug)]
struct Frame {
    left: f64,
    top: f64,
    scale: f64,
}

impl Frame {
    fn place(&self, [radius, height]: Point) -> Point {
        [
            MARGIN + (radius - self.left) * self.scale,
            MARGIN + (self.top - height) * self.scale,
        ]
    }
}

/// Draws the profile to the right of its axis, faintly mirrored to the left, with the control polygon, the joints, and at the
/// middle of each piece a tick on the side of the normal.
pub(super) fn of_profile(profile: &Profile, name: &str) -> Drawing {
    let points = || {
        profile
            .pieces()
            .iter()
            .flat_map(|piece| (0..4).map(|i| piece.point(i)))
    };
    let reach = points().fold(0.0, |reach: f64, p| reach.max(p[0].abs()));
    let (low, high) = points().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
        (low.min(p[1]), high.max(p[1]))
    });
    let extent = (2.0 * reach).max(high - low).max(1e-300);
    let frame = Frame {
        left: -reach,
        top: high,
        scale: SIZE / extent,
    };
    let mut drawing = Drawing {
        width: 2.0 * MARGIN + 2.0 * reach * frame.scale,
        height: 2.0 * MARGIN + (high - low) * frame.scale,
        title: format!("profile of {name}: {} pieces", profile.pieces().len()),
        lines: Vec::new(),
        dots: Vec::new(),
        labels: Vec::new(),
    };
    let beyond = 0.5 * MARGIN / frame.scale;
    drawing.line(
        &frame,
        &[[0.0, low - beyond], [0.0, high + beyond]],
        AXIS,
        1.0,
    );
    for (number, piece) in profile.pieces().iter().enumerate() {
        drawing.piece(&frame, piece, number);
    }
    drawing
}

impl Drawing {
    fn line(&mut self, frame: &Frame, points: &[Point], color: Color, width: f64) {
        self.lines.push(Line {
            points: points.iter().map(|&point| frame.place(point)).collect(),
            color,
            width,
        });
    }

    fn piece(&mut self, frame: &Frame, piece: &Piece, number: usize) {
        let color = PIECES[number % PIECES.len()];
        let stations: Vec<Point> = (0..=STEPS)
            .map(|step| piece.at(step as f64 / STEPS as f64))
            .map(|station| [station.radius, station.height])
            .collect();
        let mirrored: Vec<Point> = stations.iter().map(|[r, h]| [-r, *h]).collect();
        let control: Vec<Point> = (0..4).map(|i| piece.point(i)).collect();
        self.line(frame, &mirrored, MIRRORED, 2.0);
        self.line(frame, &control, POLYGON, 1.0);
        self.line(frame, &stations, color, 2.5);
        for (index, &point) in control.iter().enumerate() {
            let joint = index == 0 || index == 3;
            self.dots.push(Dot {
                at: frame.place(point),
                radius: if joint { 4.0 } else { 2.5 },
                color: if joint { JOINT } else { POLYGON },
            });
        }
        // The normal of the curve is (h′, -r′): outward where it runs upward. Pixels run down.
        let middle = piece.at(0.5);
        let [along_r, along_h] = piece.tangent(0.5);
        let speed = (along_r * along_r + along_h * along_h)
            .sqrt()
            .max(f64::MIN_POSITIVE);
        let from = frame.place([middle.radius, middle.height]);
        let offset = |length: f64| {
            [
                from[0] + length * along_h / speed,
                from[1] + length * along_r / speed,
            ]
        };
        self.lines.push(Line {
            points: vec![from, offset(14.0)],
            color,
            width: 1.5,
        });
        self.labels.push((offset(24.0), number.to_string()));
    }

    /// The drawing as SVG.
    pub(super) fn svg(&self) -> String {
        let (w, h) = (self.width, self.height);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w:.0}\" height=\"{h:.0}\" viewBox=\"0 0 {w:.1} {h:.1}\" \
             font-family=\"sans-serif\" font-size=\"13\">\n<title>{0}</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text x=\"10\" y=\"18\">{0}</text>\n",
            escape(&self.title)
        );
        for line in &self.lines {
            let points: Vec<String> = line
                .points
                .iter()
                .map(|[x, y]| format!("{x:.2},{y:.2}"))
                .collect();
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"/>",
                points.join(" "),
                hex(line.color),
                line.width
            );
        }
        for Dot {
            at: [x, y],
            radius,
            color,
        } in &self.dots
        {
            let _ = writeln!(
                text,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"{}\"/>",
                hex(*color)
            );
        }
        for ([x, y], label) in &self.labels {
            let _ = writeln!(
                text,
                "<text x=\"{x:.2}\" y=\"{:.2}\" text-anchor=\"middle\">{}</text>",
                y + 4.5,
                escape(label)
            );
        }
        text + "</svg>\n"
    }

    /// The lines and dots as PNG, without labels.
    pub(super) fn png(&self) -> image::ImageResult<Vec<u8>> {
        let mut picture = RgbImage::from_pixel(
            self.width.ceil() as u32,
            self.height.ceil() as u32,
            Rgb([255; 3]),
        );
        for line in &self.lines {
            for ends in line.points.windows(2) {
                paint(&mut picture, ends[0], ends[1], 0.5 * line.width, line.color);
            }
        }
        for dot in &self.dots {
            paint(&mut picture, dot.at, dot.at, dot.radius, dot.color);
        }
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png)?;
        Ok(bytes.into_inner())
    }
}

/// Paints the pixels within `radius` of a segment, softly at the border.
fn paint(picture: &mut RgbImage, a: Point, b: Point, radius: f64, color: Color) {
    let reach = radius + 1.0;
    let range = |axis: usize, size: u32| {
        let low = (a[axis].min(b[axis]) - reach).max(0.0) as u32;
        let high = (a[axis].max(b[axis]) + reach + 1.0).clamp(0.0, f64::from(size)) as u32;
        low..high
    };
    for y in range(1, picture.height()) {
        for x in range(0, picture.width()) {
            let distance = distance_to_segment([f64::from(x) + 0.5, f64::from(y) + 0.5], a, b);
            let cover = (radius + 0.5 - distance).clamp(0.0, 1.0);
            let pixel = picture.get_pixel_mut(x, y);
            for (value, ink) in pixel.0.iter_mut().zip(color) {
                *value = (f64::from(*value) * (1.0 - cover) + f64::from(ink) * cover).round() as u8;
            }
        }
    }
}

fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (along, from) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length_squared = along[0] * along[0] + along[1] * along[1];
    let share = if length_squared > 0.0 {
        ((from[0] * along[0] + from[1] * along[1]) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (dx, dy) = (from[0] - share * along[0], from[1] - share * along[1]);
    (dx * dx + dy * dy).sqrt()
}

fn hex([r, g, b]: Color) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
