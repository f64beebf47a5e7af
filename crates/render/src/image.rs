//! An 8-bit RGB picture: text, strips and PNG files.

use std::io::{BufWriter, Write};
use std::path::Path;

use crate::atomic::Pending;
use crate::error::RenderError;
use crate::font;

/// Largest side of an image, pixels.
pub const MAX_SIDE: usize = 16384;

/// An sRGB picture, rows from top to bottom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// Corner of a caption.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corner {
    /// Top left.
    TopLeft,
    /// Top right.
    TopRight,
    /// Bottom left.
    BottomLeft,
    /// Bottom right.
    BottomRight,
}

impl Image {
    /// Creates a picture of one color.
    ///
    /// # Errors
    /// [`RenderError::Size`] unless both sides are in `1..=MAX_SIDE`.
    pub fn new(width: usize, height: usize, color: [u8; 3]) -> Result<Self, RenderError> {
        check_size(width, height)?;
        Ok(Self { width, height, rgb: color.repeat(width * height) })
    }

    /// Creates a black picture of a checked size.
    pub(crate) fn black(width: usize, height: usize) -> Self {
        Self { width, height, rgb: vec![0; 3 * width * height] }
    }

    /// Creates a picture from pixels that were drawn elsewhere: `height * width * 3` bytes, red, green and blue, row by
    /// row.
    ///
    /// # Errors
    /// [`RenderError::Size`] unless both sides are in `1..=MAX_SIDE` and there are as many bytes as pixels need.
    pub fn from_rgb(width: usize, height: usize, rgb: Vec<u8>) -> Result<Self, RenderError> {
        let mut image = Self::new(width, height, [0; 3])?;
        if rgb.len() != image.rgb.len() {
            return Err(RenderError::Size { width, height: rgb.len() / (3 * width), max: MAX_SIDE });
        }
        image.rgb = rgb;
        Ok(image)
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// `height * width * 3` bytes: red, green, blue of each pixel, row by row.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    pub(crate) fn rgb_mut(&mut self) -> &mut [u8] {
        &mut self.rgb
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside the picture.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) of a {}x{} image", self.width, self.height);
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// Writes one line of ASCII with its top left corner at `(x, y)`; a dot of the 5x7 font is `scale` pixels wide.
    ///
    /// Text outside the picture is cut off.
    pub fn text(&mut self, x: i64, y: i64, scale: usize, color: [u8; 3], text: &str) {
        let scale = scale.max(1);
        for (place, character) in text.chars().enumerate() {
            for (column, bits) in font::glyph(character).iter().enumerate() {
                for row in (0..font::HEIGHT).filter(|row| bits >> row & 1 == 1) {
                    let left = x + ((place * font::ADVANCE + column) * scale) as i64;
                    self.fill(left, y + (row * scale) as i64, scale, scale, color, 255);
                }
            }
        }
    }

    /// Writes lines on a dark translucent panel in a corner. The text size depends on the picture's height, or on the
    /// width of narrow pictures.
    pub fn caption<S: AsRef<str>>(&mut self, corner: Corner, lines: &[S]) {
        let longest = lines.iter().map(|line| line.as_ref().chars().count()).max().unwrap_or(0);
        if longest == 0 {
            return;
        }
        let room = self.width / (longest * font::ADVANCE + 8).max(1);
        let scale = (self.height / 180).min(room).max(1);
        let pad = 3 * scale;
        let leading = (font::HEIGHT + 3) * scale;
        let width = (longest * font::ADVANCE - 1) * scale + 2 * pad;
        let height = lines.len() * leading - 3 * scale + 2 * pad;

        let margin = 4 * scale as i64;
        let (right, bottom) = ((self.width as i64) - width as i64, (self.height as i64) - height as i64);
        let (x, y) = match corner {
            Corner::TopLeft => (margin, margin),
            Corner::TopRight => (right - margin, margin),
            Corner::BottomLeft => (margin, bottom - margin),
            Corner::BottomRight => (right - margin, bottom - margin),
        };
        self.fill(x, y, width, height, [22, 28, 36], 165);
        for (i, line) in lines.iter().enumerate() {
            let top = y + (pad + i * leading) as i64;
            self.text(x + pad as i64, top, scale, [244, 246, 248], line.as_ref());
        }
    }

    /// Blends a rectangle over the picture, clipped to it.
    fn fill(&mut self, x: i64, y: i64, width: usize, height: usize, color: [u8; 3], alpha: u32) {
        let clip = |from: i64, size: usize, side: usize| {
            let to = (from + size as i64).clamp(0, side as i64) as usize;
            (from.clamp(0, side as i64) as usize, to)
        };
        let (x0, x1) = clip(x, width, self.width);
        let (y0, y1) = clip(y, height, self.height);
        for row in y0..y1 {
            let line = &mut self.rgb[3 * (row * self.width + x0)..3 * (row * self.width + x1)];
            for pixel in line.chunks_exact_mut(3) {
                for (old, &new) in pixel.iter_mut().zip(&color) {
                    *old = ((u32::from(*old) * (255 - alpha) + u32::from(new) * alpha + 127) / 255) as u8;
                }
            }
        }
    }

    /// Copies `other` with its top left corner at `(x, y)`; it must fit.
    fn paste(&mut self, other: &Image, x: usize, y: usize) {
        for row in 0..other.height {
            let from = &other.rgb[3 * row * other.width..3 * (row + 1) * other.width];
            let at = 3 * ((y + row) * self.width + x);
            self.rgb[at..at + from.len()].copy_from_slice(from);
        }
    }

    /// Cuts out the middle columns, at most `width` of them: for strips of upright gaits.
    pub fn crop_width(&self, width: usize) -> Image {
        let width = width.clamp(1, self.width);
        let left = (self.width - width) / 2;
        let rows = self.rgb.chunks_exact(3 * self.width);
        let rgb = rows.flat_map(|row| row[3 * left..3 * (left + width)].iter().copied()).collect();
        Image { width, height: self.height, rgb }
    }

    /// Writes a PNG file completely or not at all.
    ///
    /// # Errors
    /// [`RenderError::Io`] and [`RenderError::Encode`], with the path.
    pub fn save_png(&self, path: impl AsRef<Path>) -> Result<(), RenderError> {
        let path = path.as_ref();
        let (mut pending, file) = Pending::create(path)?;
        let mut sink = BufWriter::new(file);

        let refused = |error: png::EncodingError| match error {
            png::EncodingError::IoError(source) => RenderError::io(path, "cannot write")(source),
            other => RenderError::Encode { path: path.to_path_buf(), reason: other.to_string() },
        };
        let mut encoder = png::Encoder::new(&mut sink, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(refused)?;
        writer.write_image_data(&self.rgb).map_err(refused)?;
        writer.finish().map_err(refused)?;

        sink.flush().map_err(RenderError::io(path, "cannot write"))?;
        drop(sink);
        pending.commit()
    }
}

/// Puts frames side by side, `columns` to a row, with thin separators: a gait at a glance.
///
/// # Errors
/// [`RenderError::NoFrames`], [`RenderError::FrameSize`] when sizes differ, [`RenderError::Size`] when the result would
/// be too large.
pub fn strip(frames: &[Image], columns: usize) -> Result<Image, RenderError> {
    let first = frames.first().ok_or_else(|| RenderError::NoFrames { what: "strip".into() })?;
    for (index, frame) in frames.iter().enumerate() {
        same_size(index, frame, [first.width, first.height])?;
    }
    let columns = columns.clamp(1, frames.len());
    let gap = gap(first.height);
    let [width, height] = strip_size([first.width, first.height], frames.len(), columns)?;
    let mut out = Image::new(width, height, [246, 248, 250])?;
    for (i, frame) in frames.iter().enumerate() {
        out.paste(frame, (i % columns) * (first.width + gap), (i / columns) * (first.height + gap));
    }
    Ok(out)
}

/// Width and height of a [`strip`] with this number of frames, pixels.
///
/// # Errors
/// [`RenderError::Size`] if it would be too large.
pub fn strip_size([width, height]: [usize; 2], frames: usize, columns: usize) -> Result<[usize; 2], RenderError> {
    check_size(width, height)?;
    let (columns, gap) = (columns.clamp(1, frames.max(1)), gap(height));
    let side = |count: usize, size: usize| count.max(1).saturating_mul(size + gap) - gap;
    let size = [side(columns, width), side(frames.div_ceil(columns), height)];
    check_size(size[0], size[1])?;
    Ok(size)
}

/// Pixels between the frames of a strip.
fn gap(height: usize) -> usize {
    (height / 180).max(1)
}

/// Checks that a picture can have this size.
pub(crate) fn check_size(width: usize, height: usize) -> Result<(), RenderError> {
    let fits = |side: usize| (1..=MAX_SIDE).contains(&side);
    if fits(width) && fits(height) { Ok(()) } else { Err(RenderError::Size { width, height, max: MAX_SIDE }) }
}

/// Checks that a frame has the size of the first one.
pub(crate) fn same_size(index: usize, frame: &Image, expected: [usize; 2]) -> Result<(), RenderError> {
    let found = [frame.width, frame.height];
    if found == expected { Ok(()) } else { Err(RenderError::FrameSize { index, found, expected }) }
}

/// Time, distance and speed in fixed columns, for a [caption](Image::caption): ` 3.20 s   10.4 m   3.3 m/s`.
pub fn status_line(seconds: f64, meters: f64, meters_per_second: f64) -> String {
    format!("{seconds:5.2} s {meters:6.1} m {meters_per_second:5.1} m/s")
}
