//! Common parts of charts: size, colors, fonts, axis labels, and writing.

use crate::error::RunError;
use crate::text::short;
use marathon_learn::write_atomic;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::path::Path;
use std::sync::Once;

/// Size of the picture, pixels.
pub const SIZE: [u32; 2] = [960, 640];
/// Factor by which charts are drawn larger and then averaged: plotters does not smooth thick lines.
pub const SCALE: u32 = 2;

/// Color of text.
pub const INK: RGBColor = RGBColor(38, 44, 52);
/// Color of secondary text.
pub const FAINT: RGBColor = RGBColor(112, 120, 130);
/// Color of the grid.
pub const GRID: RGBColor = RGBColor(228, 232, 237);

const FAMILY: &str = "Roboto";
const REGULAR: &[u8] = include_bytes!("../../assets/fonts/Roboto-Regular-subset.ttf");
const MEDIUM: &[u8] = include_bytes!("../../assets/fonts/Roboto-Medium-subset.ttf");

/// An error while drawing.
pub type DrawError = Box<dyn std::error::Error>;

/// Registers the fonts, once.
pub fn register_fonts() {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        for (style, font) in [(FontStyle::Normal, REGULAR), (FontStyle::Bold, MEDIUM)] {
            // an invalid font would show as an error when text is drawn
            let _ = register_font(FAMILY, style, font);
        }
    });
}

/// `2500000` as `2.5 M`.
pub fn axis_steps(x: f64) -> String {
    if x == 0.0 {
        return "0 steps".into();
    }
    let text = short(x);
    match text.split_once(' ') {
        Some((number, unit)) if number.contains('.') => {
            format!("{} {unit}", number.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    }
}

/// A number of an axis.
pub fn axis_number(y: f64) -> String {
    match y.abs() {
        a if a >= 99_950.0 => short(y),
        a if a < 1e-12 => "0".into(),
        a if a >= 10.0 => format!("{y:.0}"),
        a if a >= 1.0 => format!("{y:.1}"),
        _ => format!("{y:.2}"),
    }
}

/// Converts pixels of the picture to pixels of the enlarged one.
pub fn at(x: u32, y: u32) -> (i32, i32) {
    ((x * SCALE) as i32, (y * SCALE) as i32)
}

/// A text style.
pub fn style(size: u32, color: RGBColor, weight: FontStyle) -> TextStyle<'static> {
    (FAMILY, size * SCALE, weight).into_font().color(&color)
}

/// Averages squares with sides of `SCALE` pixels.
pub fn reduce(rgb: &[u8]) -> Vec<u8> {
    let (side, [width, height]) = (SCALE as usize, SIZE.map(|side| side as usize));
    let mut out = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let square = (0..side * side).map(|i| {
                    let (row, column) = (y * side + i / side, x * side + i % side);
                    u32::from(rgb[3 * (row * width * side + column) + channel])
                });
                out.push((square.sum::<u32>() / (SCALE * SCALE)) as u8);
            }
        }
    }
    out
}

/// Writes a picture of [`SIZE`].
///
/// # Errors
/// If the file cannot be written.
pub fn write_png(path: &Path, rgb: &[u8]) -> Result<(), RunError> {
    let refused = |e: png::EncodingError| RunError::Draw { path: path.into(), reason: e.to_string() };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0], SIZE[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(rgb).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(write_atomic(path, &bytes)?)
}
