//! What the plots show, for a paper (SVG) and for further work (CSV). Pixels are the window's matter.

use crate::intent::Format;
use crate::model::Model;
use crate::plots::axis::{USUAL_COUNT, number, reach, steps};
use crate::plots::contact_ribbon;
use crate::plots::over_time::{stroke, traces};
use crate::scope::signal::Quantity;
use crate::scope::{Scope, While};
use crate::theme::Palette;
use egui::{Color32, ColorImage, Pos2, Rect};
use haptic_ipc::SAMPLE_COLUMNS;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// Size of one plot in the picture, px.
const PLOT: (f64, f64) = (800.0, 220.0);
/// Room for the numbers and names at its left, right, top and bottom, px.
const MARGINS: (f64, f64, f64, f64) = (70.0, 20.0, 34.0, 40.0);
const RIBBON: f64 = 8.0;

/// Every sample that is seen, every column, as CSV.
#[must_use]
pub fn csv(model: &Model) -> String {
    let scope = model.scope();
    let seen = scope.seen();
    let mut text = SAMPLE_COLUMNS.join(",");
    text.push('\n');
    for sample in scope.tape().within(seen.from_s, seen.to_s) {
        let object = sample.to_object();
        let cells = object.values().map(|value| match value {
            serde_json::Value::String(word) => word.clone(),
            number => number.to_string(),
        });
        text.push_str(&cells.collect::<Vec<_>>().join(","));
        text.push('\n');
    }
    text
}

/// The plots over time as they are seen, in the colours for a white page.
#[must_use]
pub fn svg(model: &Model) -> String {
    let scope = model.scope();
    let seen = scope.seen();
    let quantities: Vec<Quantity> = scope.quantities().collect();
    let (left, right, top, bottom) = MARGINS;
    let (width, each) = (left + PLOT.0 + right, top + PLOT.1);
    let height = quantities.iter().map(|_| each).sum::<f64>() + bottom;
    let mut drawing = Drawing::new(width, height);
    let mut y = 0.0;
    for (place, quantity) in quantities.iter().enumerate() {
        if place == 0 {
            drawing.ribbon(scope, &seen, RIBBON / 2.0);
        }
        y += top;
        drawing.plot(scope, &seen, *quantity, y, place + 1 == quantities.len());
        y += PLOT.1;
    }
    drawing.end()
}

/// An SVG that grows. Writing to a `String` cannot fail.
struct Drawing {
    text: String,
}

impl Drawing {
    fn new(width: f64, height: f64) -> Self {
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        Self { text }
    }

    fn end(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        self.text.write_fmt(element).unwrap_or(());
        self.text.push('\n');
    }

    fn ribbon(&mut self, scope: &Scope, seen: &While, y: f64) {
        let palette = Palette::for_paper();
        let samples = scope.tape().within(seen.from_s, seen.to_s);
        for run in contact_ribbon::runs(samples.map(|sample| (sample.t_s, sample.contact != 0))) {
            let [from, to] = [run.from, run.to].map(|t_s| across(t_s - seen.zero_s, seen));
            let (color, what) = if run.slides {
                (palette.sliding, "sliding")
            } else {
                (palette.stuck, "stuck")
            };
            let (color, width) = (hex(color), to - from);
            self.add(format_args!(
                "<rect x=\"{from:.2}\" y=\"{y}\" width=\"{width:.2}\" height=\"{RIBBON}\" fill=\"{color}\"><title>{what}</title></rect>"
            ));
        }
    }

    fn plot(&mut self, scope: &Scope, seen: &While, quantity: Quantity, y: f64, has_time: bool) {
        let traces = traces(scope, quantity, seen, PLOT.0 * 2.0);
        let values = traces
            .iter()
            .flat_map(|trace| trace.points.iter().map(|[_, value]| *value));
        let (low, high) = reach(values, quantity.smallest_span());
        let down = |value: f64| y + PLOT.1 * (high - value) / (high - low);
        let (left, (width, height)) = (MARGINS.0, PLOT);
        let (name, unit) = (quantity.name(), quantity.unit());
        for (value, text) in marks(low, high) {
            let (y, x) = (down(value), left - 6.0);
            self.add(format_args!(
                "<path d=\"M{left} {y:.2}h{width}\" stroke=\"#ddd\"/><text x=\"{x}\" y=\"{y:.2}\" text-anchor=\"end\" dominant-baseline=\"middle\">{text}</text>"
            ));
        }
        let foot = y + height;
        for (value, text) in marks(seen.from_s - seen.zero_s, seen.to_s - seen.zero_s) {
            let x = across(value, seen);
            self.add(format_args!("<path d=\"M{x:.2} {y}v{height}\" stroke=\"#ddd\"/>"));
            if has_time {
                let below = foot + 16.0;
                self.add(format_args!(
                    "<text x=\"{x:.2}\" y=\"{below}\" text-anchor=\"middle\">{text}</text>"
                ));
            }
        }
        self.add(format_args!(
            "<rect x=\"{left}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#888\"/>"
        ));
        let mut x = left + 8.0;
        for trace in &traces {
            let (color, stroke_width) = stroke(Palette::for_paper(), trace.signal);
            let color = hex(color);
            let points = within_edges(&trace.points, seen);
            let points = points
                .iter()
                .map(|[t_s, value]| format!("{:.2},{:.2}", across(*t_s, seen), down(*value)));
            let points = points.collect::<Vec<_>>().join(" ");
            self.add(format_args!(
                "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"{stroke_width}\" stroke-linejoin=\"round\" points=\"{points}\"/>"
            ));
            let (title, y) = (trace.signal.name(), y - 4.0);
            let x_text = x + 22.0;
            self.add(format_args!(
                "<path d=\"M{x} {}h16\" stroke=\"{color}\" stroke-width=\"{stroke_width}\"/><text x=\"{x_text}\" y=\"{y}\">{title}</text>",
                y - 4.0
            ));
            x += 150.0;
        }
        let middle = y + height / 2.0;
        self.add(format_args!(
            "<text transform=\"translate(16 {middle}) rotate(-90)\" text-anchor=\"middle\">{name} ({unit})</text>"
        ));
        if has_time {
            let (x, below) = (left + width / 2.0, foot + 34.0);
            self.add(format_args!(
                "<text x=\"{x}\" y=\"{below}\" text-anchor=\"middle\">Time (s)</text>"
            ));
        }
    }
}

/// A line that ends at the edges of what is seen: its neighbours beyond them are moved along it. Not every program that reads the
/// picture can clip.
fn within_edges(points: &[[f64; 2]], seen: &While) -> Vec<[f64; 2]> {
    let edges = [seen.from_s - seen.zero_s, seen.to_s - seen.zero_s];
    let mut cut = points.to_vec();
    let moved = |outer: [f64; 2], inner: [f64; 2], edge: f64| {
        let share = (edge - inner[0]) / (outer[0] - inner[0]);
        [edge, inner[1] + share * (outer[1] - inner[1])]
    };
    if let [first, second, ..] = *points
        && first[0] < edges[0]
    {
        cut[0] = moved(first, second, edges[0]);
    }
    if let [.., before, last] = *points
        && last[0] > edges[1]
    {
        cut[points.len() - 1] = moved(last, before, edges[1]);
    }
    cut
}

/// Where a time of the axis lies, px.
fn across(t_s: f64, seen: &While) -> f64 {
    MARGINS.0 + PLOT.0 * (t_s - (seen.from_s - seen.zero_s)) / (seen.to_s - seen.from_s)
}

/// The numbers of an axis.
fn marks(low: f64, high: f64) -> Vec<(f64, String)> {
    let [_, step, _] = steps((low, high), USUAL_COUNT);
    let mut marks = Vec::new();
    let mut mark = (low / step).ceil() * step;
    while mark <= high {
        marks.push((mark, number(mark, (low, high))));
        mark += step;
    }
    marks
}

fn hex(color: Color32) -> String {
    format!("#{:02x}{:02x}{:02x}", color.r(), color.g(), color.b())
}

/// A part of the window's pixels as a PNG; the whole where the part is none of it.
///
/// # Errors
/// What the encoder says.
pub fn png(pixels: &ColorImage, part: Rect, pixels_per_point: f32) -> Result<Vec<u8>, String> {
    let whole = Rect::from_min_size(Pos2::ZERO, vec2_of(pixels.size));
    let seen = whole.intersect(part * pixels_per_point);
    let seen = if seen.is_positive() { seen } else { whole };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within the picture's size"
    )]
    let [left, top, right, bottom] =
        [seen.left(), seen.top(), seen.right(), seen.bottom()].map(|edge| edge.round() as usize);
    let rows = pixels.pixels.chunks(pixels.size[0].max(1)).skip(top).take(bottom - top);
    let bytes: Vec<u8> = rows
        .flat_map(|row| {
            row[left..right]
                .iter()
                .flat_map(|pixel| [pixel.r(), pixel.g(), pixel.b()])
        })
        .collect();
    let [width, height] = [right - left, bottom - top].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    let mut content = Vec::new();
    let mut encoder = png::Encoder::new(&mut content, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let failed = |error: png::EncodingError| format!("cannot encode the picture: {error}");
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&bytes).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(content)
}

fn vec2_of([width, height]: [usize; 2]) -> egui::Vec2 {
    #[expect(
        clippy::cast_precision_loss,
        reason = "a window has fewer pixels than an f32 has digits"
    )]
    let size = egui::vec2(width as f32, height as f32);
    size
}

/// Writes an export into `folder` under a name that nothing has yet, and gives the file.
///
/// # Errors
/// Why it could not be written, naming the folder or the file.
pub fn write(folder: &Path, format: Format, content: &[u8]) -> Result<PathBuf, String> {
    let (path, mut file) = first_free(folder, "haptic-plot", format.extension())?;
    let written = file.write_all(content);
    written.map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(path)
}

/// Makes a file in `folder` whose name nothing has yet.
pub(crate) fn first_free(folder: &Path, name: &str, extension: &str) -> Result<(PathBuf, File), String> {
    for number in 1..10_000 {
        let path = folder.join(format!("{name}-{number}.{extension}"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(format!("cannot write {}: {error}", path.display())),
        }
    }
    Err(format!(
        "{} has 9999 files of this kind already: move them away",
        folder.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scope::tape::tests::at;
    use crate::update::Update;
    use haptic_ipc::{Event, SamplesEvent};

    fn with_samples() -> Model {
        let rows = (0..2000).map(|i| {
            let mut row = at(f64::from(i) * 1e-3);
            row.coupling_force_n = if i == 1500 { 42.0 } else { 0.0 };
            row
        });
        let batch = SamplesEvent {
            seq: 0,
            dropped: 0,
            rows: rows.collect(),
        };
        let mut model = Model::new();
        model.apply(Update::Event(Event::Samples(batch)));
        model
    }

    #[test]
    fn the_table_holds_every_sample_that_is_seen() {
        let mut model = with_samples();
        model.scope_mut().zoom(5.0, 0.0);
        let text = csv(&model);
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some(SAMPLE_COLUMNS.join(",").as_str()));
        let times: Vec<f64> = lines
            .map(|line| {
                line.split(',')
                    .nth(1)
                    .and_then(|cell| cell.parse().ok())
                    .expect("a time")
            })
            .collect();
        assert_eq!(times.last(), Some(&1.999));
        assert!(times.len() >= 999 && times[0] > 0.99, "a second of two is seen");
        assert!(text.contains(",42.0,"));
    }

    #[test]
    fn the_picture_has_every_plot_its_units_and_the_spike() {
        let text = svg(&with_samples());
        for part in [
            "Force (N)",
            "Position (mm)",
            "Velocity (mm/s)",
            "Time (s)",
            "Coupling force",
            ">40<",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert_eq!(text.matches("<polyline").count(), 6);
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }

    #[test]
    fn a_line_ends_at_the_edges_of_the_picture() {
        let seen = While {
            zero_s: 10.0,
            from_s: 10.5,
            to_s: 12.5,
        };
        let line = [[0.0, 0.0], [1.0, 10.0], [2.0, 10.0], [3.0, 0.0]];
        assert_eq!(
            within_edges(&line, &seen),
            [[0.5, 5.0], [1.0, 10.0], [2.0, 10.0], [2.5, 5.0]]
        );
        assert_eq!(within_edges(&line[1..3], &seen), line[1..3], "nothing lies beyond them");
    }

    #[test]
    fn the_pixels_of_the_plots_are_cut_out() {
        let pixels = (0..50u8).map(Color32::from_gray).collect();
        let image = ColorImage::new([10, 5], pixels);
        let part = Rect::from_min_max(Pos2::new(1.0, 1.0), Pos2::new(4.0, 2.0));
        let content = png(&image, part, 2.0).expect("encoded");
        let mut reader = png::Decoder::new(std::io::Cursor::new(content))
            .read_info()
            .expect("a PNG");
        let mut decoded = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut decoded).expect("a frame");
        assert_eq!((reader.info().width, reader.info().height), (6, 2));
        assert_eq!(decoded[0..6], [22, 22, 22, 23, 23, 23]);
        assert!(png(&image, Rect::NOTHING, 1.0).is_ok());
    }

    #[test]
    fn an_export_overwrites_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = write(folder.path(), Format::Csv, b"1").expect("written");
        let second = write(folder.path(), Format::Csv, b"2").expect("written");
        assert_ne!(first, second);
        assert_eq!(std::fs::read(first).expect("there"), b"1");
        let missing = folder.path().join("none");
        let error = write(&missing, Format::Svg, b"").expect_err("no such folder");
        assert!(error.contains("none/haptic-plot-1.svg"), "{error}");
    }
}
