//! `curve.png`: return and speed over steps.

use super::canvas::{
    DrawError, FAINT, GRID, INK, SCALE, SIZE, at, axis_number, axis_steps, reduce, register_fonts, style, write_png,
};
use super::csv::History;
use crate::error::RunError;
use crate::folder::RunFolder;
use crate::run_file::RunFile;
use crate::text::{duration, short, thousands};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::FontStyle;

/// Maximum number of points per line. Longer runs are averaged in bins.
const POINTS: usize = 400;

/// Largest number that an axis can show.
const LARGEST: f64 = 1e15;

const RETURN: RGBColor = RGBColor(32, 99, 178);
const SPEED: RGBColor = RGBColor(206, 92, 24);

/// A line of the picture: raw points, and their running mean.
struct Series {
    raw: Vec<(f64, f64)>,
    smooth: Vec<(f64, f64)>,
}

/// Draws the curve of a run from its rows. Without an ended episode the curve is empty.
///
/// # Errors
/// If the picture cannot be written.
pub fn draw(folder: &RunFolder, run: &RunFile, history: &History) -> Result<(), RunError> {
    let path = folder.curve();
    let png = picture(history, run).map_err(|e| RunError::Draw { path: path.clone(), reason: e.to_string() })?;
    write_png(&path, &png)
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

fn picture(history: &History, run: &RunFile) -> Result<Vec<u8>, DrawError> {
    register_fonts();
    let last = |name| history.column(name).last().copied().flatten().unwrap_or(0.0);
    let (steps, wall, cpu) = (last("steps"), last("wall_seconds"), last("cpu_seconds"));

    let [width, height] = SIZE.map(|side| side * SCALE);
    let mut rgb = vec![0; 3 * (width * height) as usize];
    {
        let root = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let title = style(22, INK, FontStyle::Bold);
        root.draw_text(&run.agent, &title, at(24, 18))?;
        let rate = if cpu > 0.0 { steps / cpu } else { 0.0 };
        let facts = format!(
            "{} steps in {}  \u{b7}  {} of processor time, {} steps per processor second  \u{b7}  {} agents, seed {}",
            thousands(steps as u64),
            duration(wall),
            duration(cpu),
            short(rate),
            run.config.run.agents,
            run.config.run.seed
        );
        root.draw_text(&facts, &style(14, FAINT, FontStyle::Normal), at(24, 48))?;

        let (_, below) = root.split_vertically((72 * SCALE) as i32);
        let panels = below.split_evenly((2, 1));
        let steps = history.column("steps");
        let lines = [("return_mean", "return per episode", RETURN), ("speed_mean", "speed, m/s", SPEED)];
        for (panel, (name, label, color)) in panels.iter().zip(lines) {
            panel_of(panel, label, color, &Series::new(&steps, &history.column(name)))?;
        }
        root.present()?;
    }
    Ok(reduce(&rgb))
}

/// Draws one panel: a faint line of the iterations' means, a strong one of their running mean.
fn panel_of(area: &Area<'_>, label: &str, color: RGBColor, series: &Series) -> Result<(), DrawError> {
    let span = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let end = series.raw.last().map_or(1.0, |p| p.0).max(1.0);
    let (low, high) = span(&mut series.raw.iter().map(|p| p.1));
    let (low, high) = if low <= high { (low.min(0.0), high.max(0.0)) } else { (0.0, 1.0) };
    let room = 0.06 * (high - low).max(1e-6);
    let bottom = if low < 0.0 { low - room } else { 0.0 };

    let mut chart = ChartBuilder::on(area)
        .margin_left(14 * SCALE)
        .margin_right(32 * SCALE)
        .margin_top(26 * SCALE)
        .margin_bottom(6 * SCALE)
        .x_label_area_size(28 * SCALE)
        .y_label_area_size(54 * SCALE)
        .build_cartesian_2d(0.0..end, bottom..high + room)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .bold_line_style(GRID.stroke_width(SCALE))
        .light_line_style(TRANSPARENT)
        .axis_style(FAINT.stroke_width(SCALE))
        .label_style(style(13, FAINT, FontStyle::Normal))
        .x_labels(9)
        .y_labels(6)
        .x_label_formatter(&|x| axis_steps(*x))
        .y_label_formatter(&|y| axis_number(*y))
        .draw()?;
    chart.draw_series(LineSeries::new(series.raw.iter().copied(), color.mix(0.3).stroke_width(SCALE)))?;
    chart.draw_series(LineSeries::new(series.smooth.iter().copied(), color.stroke_width(5 * SCALE / 2)))?;
    area.draw_text(label, &style(15, color, FontStyle::Bold), at(24, 4))?;
    if let Some((x, y)) = series.smooth.last() {
        chart.draw_series(std::iter::once(Circle::new((*x, *y), 4 * SCALE, color.filled())))?;
    }
    Ok(())
}

impl Series {
    fn new(steps: &[Option<f64>], values: &[Option<f64>]) -> Self {
        let known: Vec<(f64, f64)> = steps.iter().zip(values).filter_map(|(x, y)| Some(((*x)?, (*y)?))).collect();
        // tables may contain numbers that an axis cannot show
        let known: Vec<_> = known.into_iter().filter(|(x, y)| x.abs() <= LARGEST && y.abs() <= LARGEST).collect();
        let bin = known.len().div_ceil(POINTS).max(1);
        let raw: Vec<(f64, f64)> = known
            .chunks(bin)
            .map(|part| {
                let n = part.len() as f64;
                (part.iter().map(|p| p.0).sum::<f64>() / n, part.iter().map(|p| p.1).sum::<f64>() / n)
            })
            .collect();
        // centered mean over 1/50 of the run
        let reach = raw.len() / 100;
        let smooth = (0..raw.len())
            .map(|i| {
                // symmetric windows, or the ends would be biased inward
                let reach = reach.min(i).min(raw.len() - 1 - i);
                let near = &raw[i - reach..=i + reach];
                (raw[i].0, near.iter().map(|p| p.1).sum::<f64>() / near.len() as f64)
            })
            .collect();
        Self { raw, smooth }
    }
}
