//! Charts that compare runs: lines over steps or over time, or bars.

use super::canvas::{
    DrawError, FAINT, GRID, INK, SCALE, SIZE, at, axis_number, axis_steps, reduce, register_fonts, style, write_png,
};
use crate::error::RunError;
use plotters::prelude::*;
use plotters::style::FontStyle;
use std::path::Path;

/// Colors of lines and bars that color-blind people can distinguish (Okabe and Ito).
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
    RGBColor(178, 160, 0),
];

/// Height of the names of bars, and mean width of a letter in them, pixels.
const NAMES: u32 = 76;
const LETTER: f64 = 6.4;
/// Height of a line's name, pixels. Names are set in two columns.
const LINE_NAME: u32 = 20;

/// A chart.
pub enum Chart {
    /// Lines over agent-steps: the quantity, and each line's name and points.
    Lines(&'static str, Vec<(String, Vec<(f64, f64)>)>),
    /// Lines over seconds: the quantity, and each line's name and points.
    Times(&'static str, Vec<(String, Vec<(f64, f64)>)>),
    /// Bars: the quantity, and each bar's name and height.
    Bars(&'static str, Vec<(String, f64)>),
}

impl Chart {
    /// Writes the picture.
    ///
    /// # Errors
    /// If it cannot be drawn or written.
    pub fn draw(&self, path: &Path) -> Result<(), RunError> {
        let rgb = self.picture().map_err(|e| RunError::Draw { path: path.into(), reason: e.to_string() })?;
        write_png(path, &rgb)
    }

    fn picture(&self) -> Result<Vec<u8>, DrawError> {
        // one function: the parts of a picture in order
        register_fonts();
        let [width, height] = SIZE.map(|side| side * SCALE);
        let mut rgb = vec![0; 3 * (width * height) as usize];
        {
            let root = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
            root.fill(&WHITE)?;
            let (label, ends, low, high) = match self {
                Chart::Lines(label, lines) | Chart::Times(label, lines) => {
                    let points = || lines.iter().flat_map(|(_, points)| points);
                    let end = points().map(|p| p.0).fold(1.0, f64::max);
                    let low = points().map(|p| p.1).fold(0.0, f64::min);
                    (label, 0.0..end, low, points().map(|p| p.1).fold(0.0, f64::max))
                }
                Chart::Bars(label, bars) => {
                    (label, 0.0..bars.len() as f64, 0.0, bars.iter().map(|b| b.1).fold(0.0, f64::max))
                }
            };
            root.draw_text(label, &style(18, INK, FontStyle::Bold), at(24, 18))?;
            let room = 0.08 * (high - low).max(1e-6);
            let bottom = if low < 0.0 { low - room } else { 0.0 };
            let names = match self {
                Chart::Lines(_, lines) | Chart::Times(_, lines) => LINE_NAME * lines.len().div_ceil(2) as u32,
                Chart::Bars(..) => 0,
            };
            let mut chart = ChartBuilder::on(&root)
                .margin_left(14 * SCALE)
                .margin_right(32 * SCALE)
                .margin_top(60 * SCALE)
                .margin_bottom((10 + names) * SCALE)
                .x_label_area_size(if let Chart::Bars(..) = self { NAMES } else { 28 } * SCALE)
                .y_label_area_size(64 * SCALE)
                .build_cartesian_2d(ends, bottom..high + room)?;
            let timed = matches!(self, Chart::Times(..));
            let of_y = |y: &f64| axis_number(*y);
            let of_x = |x: &f64| if timed { format!("{} s", axis_number(*x)) } else { axis_steps(*x) };
            let mut mesh = chart.configure_mesh();
            mesh.disable_x_mesh()
                .bold_line_style(GRID.stroke_width(SCALE))
                .light_line_style(TRANSPARENT)
                .axis_style(FAINT.stroke_width(SCALE))
                .label_style(style(13, FAINT, FontStyle::Normal))
                .y_labels(7)
                .y_label_formatter(&of_y);
            match self {
                Chart::Lines(_, lines) | Chart::Times(_, lines) => {
                    mesh.x_labels(9).x_label_formatter(&of_x).draw()?;
                    for (i, (name, points)) in lines.iter().enumerate() {
                        let color = COLORS[i % COLORS.len()];
                        let (points, stroke) = (points.iter().copied(), color.stroke_width(2 * SCALE));
                        // further lines reuse the colors, with dashes
                        let name = if i < COLORS.len() {
                            chart.draw_series(LineSeries::new(points, stroke))?;
                            name.clone()
                        } else {
                            chart.draw_series(DashedLineSeries::new(points, 9 * SCALE, 6 * SCALE, stroke))?;
                            format!("{name} (dashed)")
                        };
                        // the names below the chart
                        let (column, row) = (i as u32 % 2, i as u32 / 2);
                        let place = at(78 + column * (SIZE[0] - 110) / 2, SIZE[1] - 8 - names + LINE_NAME * row);
                        root.draw_text(&name, &style(14, color, FontStyle::Bold), place)?;
                    }
                }
                Chart::Bars(_, bars) => {
                    mesh.x_labels(0).draw()?;
                    for (i, (name, y)) in bars.iter().enumerate() {
                        let (left, color) = (i as f64, COLORS[i % COLORS.len()]);
                        let corners = [(left + 0.2, 0.0), (left + 0.8, *y)];
                        chart.draw_series(std::iter::once(Rectangle::new(corners, color.filled())))?;
                        let (text, label) = (style(14, INK, FontStyle::Normal), crate::text::short(*y));
                        chart.draw_series(std::iter::once(Text::new(label, (left + 0.2, *y + 0.4 * room), text)))?;
                        // the name below, wrapped to the available width
                        let (x, y) = chart.backend_coord(&(left + 0.06, bottom));
                        let letters = (0.9 * (SIZE[0] - 110) as f64 / (LETTER * bars.len() as f64)) as usize;
                        for (n, line) in wrapped(name, letters).into_iter().enumerate() {
                            let place = (x, y + ((6 + 15 * n as u32) * SCALE) as i32);
                            root.draw_text(&line, &style(12, INK, FontStyle::Normal), place)?;
                        }
                    }
                }
            }
            root.present()?;
        }
        Ok(reduce(&rgb))
    }
}

/// Wraps a text to lines of `letters` letters, without breaking words.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut().filter(|line| line.len() + 1 + word.len() <= letters) {
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.into()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_wrapped_at_words() {
        assert_eq!(wrapped("two processes that play", 13), ["two processes", "that play"]);
        assert_eq!(wrapped("unbreakable", 3), ["unbreakable"]);
    }

    #[test]
    fn charts_of_little_are_drawn_too() {
        let folder = tempfile::tempdir().unwrap();
        let lines = vec![("a".to_string(), vec![(0.0, 1.0), (10.0, -3.0)]), ("b".into(), Vec::new())];
        for (i, chart) in
            [Chart::Lines("y", lines), Chart::Lines("y", Vec::new()), Chart::Bars("z", vec![("c".into(), 0.0)])]
                .iter()
                .enumerate()
        {
            let path = folder.path().join(format!("{i}.png"));
            chart.draw(&path).unwrap();
            assert!(std::fs::metadata(path).unwrap().len() > 1000);
        }
    }
}
