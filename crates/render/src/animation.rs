//! Animated GIF with one palette for the whole video.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use color_quant::NeuQuant;
use marathon_physics::budget;

use crate::atomic::Pending;
use crate::error::RenderError;
use crate::image::{Image, same_size};

/// Frames that determine the palette. Later frames show the same floor, sky and character.
const STUDY: usize = 24;
/// Number of pixels that the quantizer learns from. Vivid ones are sampled ten times as often.
const LESSONS: usize = 120_000;
/// Difference between the largest and the smallest channel above which a pixel is vivid.
const VIVID: u8 = 50;
/// Palette entries for colors; one more is "as before".
const COLORS: usize = 255;
const UNCHANGED: u8 = 255;
/// Largest ordered-dither offset in 8-bit steps: enough to hide bands in the sky, and small enough to compress well.
const DITHER: i32 = 3;
/// Browsers slow a GIF down to 10 frames per second when its delays are under 2 hundredths of a second.
const FPS: [f64; 2] = [0.1, 50.0];

/// Writes an animated GIF frame by frame; loops forever when played.
pub struct GifWriter {
    pending: Pending,
    fps: f64,
    waiting: Vec<Image>,
    stage: Stage,
    count: usize,
    size: [usize; 2],
}

enum Stage {
    /// Collects frames for the palette. The file is still empty.
    Studying(File),
    /// Writes frames. A [`Video`] is large, so it lives on the heap.
    Writing(Box<Video>),
}

struct Video {
    encoder: gif::Encoder<BufWriter<File>>,
    palette: Palette,
    previous: Vec<u8>,
}

impl GifWriter {
    /// Starts a video. The file appears under its name only at [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`RenderError::Fps`] unless `fps` is in 0.1..=50, [`RenderError::Io`].
    pub fn create(path: impl AsRef<Path>, fps: f64) -> Result<Self, RenderError> {
        let path = path.as_ref();
        let [min, max] = FPS;
        if !(min..=max).contains(&fps) {
            return Err(RenderError::Fps { path: path.to_path_buf(), fps, min, max });
        }
        let (pending, file) = Pending::create(path)?;
        Ok(Self { pending, fps, waiting: Vec::new(), stage: Stage::Studying(file), count: 0, size: [0; 2] })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// [`RenderError::FrameSize`], [`RenderError::Budget`], [`RenderError::Io`], [`RenderError::Encode`].
    pub fn push(&mut self, frame: &Image) -> Result<(), RenderError> {
        if self.count + self.waiting.len() == 0 {
            self.size = [frame.width(), frame.height()];
            let bytes = (STUDY * frame.rgb().len()) as f64;
            budget::MEMORY.check(bytes).map_err(|source| RenderError::Budget {
                path: self.pending.path().to_path_buf(),
                what: "a GIF of this size",
                source,
            })?;
        }
        same_size(self.count + self.waiting.len(), frame, self.size)?;
        if let Stage::Studying(_) = self.stage {
            self.waiting.push(frame.clone());
            return if self.waiting.len() == STUDY { self.start() } else { Ok(()) };
        }
        self.write(frame)
    }

    /// Ends the video and gives the file its name.
    ///
    /// # Errors
    /// [`RenderError::NoFrames`], [`RenderError::Io`], [`RenderError::Encode`].
    pub fn finish(mut self) -> Result<(), RenderError> {
        if self.count + self.waiting.len() == 0 {
            return Err(RenderError::NoFrames { what: self.pending.path().display().to_string() });
        }
        self.start()?;
        let Stage::Writing(video) = self.stage else { return Ok(()) };
        let mut sink = video.encoder.into_inner().map_err(|error| refused(&self.pending, error))?;
        sink.flush().map_err(RenderError::io(self.pending.path(), "cannot write"))?;
        drop(sink);
        self.pending.commit()
    }

    /// Fixes the palette and writes the frames collected so far.
    fn start(&mut self) -> Result<(), RenderError> {
        let Stage::Studying(file) = &self.stage else { return Ok(()) };
        let file = file.try_clone().map_err(RenderError::io(self.pending.path(), "cannot write"))?;
        let palette = Palette::learn(&self.waiting);

        let side = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        let [width, height] = self.size.map(side);
        let mut encoder = gif::Encoder::new(BufWriter::new(file), width, height, &palette.table)
            .map_err(|error| refused(&self.pending, error))?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(|error| refused(&self.pending, error))?;
        self.stage = Stage::Writing(Box::new(Video { encoder, palette, previous: Vec::new() }));
        for frame in std::mem::take(&mut self.waiting) {
            self.write(&frame)?;
        }
        Ok(())
    }

    fn write(&mut self, image: &Image) -> Result<(), RenderError> {
        let delay = self.delay();
        let Stage::Writing(video) = &mut self.stage else { return Ok(()) };
        let indices = video.palette.map(image);
        let changed = match video.previous.is_empty() {
            true => Some([0, 0, image.width(), image.height()]),
            false => changed_area(&video.previous, &indices, image.width()),
        };
        // a GIF needs a frame for time to pass, even without changes
        let [left, top, right, bottom] = changed.unwrap_or([0, 0, 1, 1]);

        let mut buffer = Vec::with_capacity((right - left) * (bottom - top));
        for y in top..bottom {
            let row = y * image.width() + left..y * image.width() + right;
            match video.previous.get(row.clone()) {
                Some(old) => {
                    let pairs = indices[row].iter().zip(old);
                    buffer.extend(pairs.map(|(&new, &old)| if new == old { UNCHANGED } else { new }));
                }
                None => buffer.extend_from_slice(&indices[row]),
            }
        }
        let frame = gif::Frame {
            delay,
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            transparent: Some(UNCHANGED),
            buffer: buffer.into(),
            ..gif::Frame::default()
        };
        video.encoder.write_frame(&frame).map_err(|error| refused(&self.pending, error))?;
        video.previous = indices;
        self.count += 1;
        Ok(())
    }

    /// Duration of the next frame in hundredths of a second. Rounding errors do not add up over the video.
    fn delay(&self) -> u16 {
        let end_of = |frames: usize| (100.0 * frames as f64 / self.fps).round();
        (end_of(self.count + 1) - end_of(self.count)) as u16
    }
}

fn refused(pending: &Pending, error: gif::EncodingError) -> RenderError {
    match error {
        gif::EncodingError::Io(source) => RenderError::io(pending.path(), "cannot write")(source),
        other => RenderError::Encode { path: pending.path().to_path_buf(), reason: other.to_string() },
    }
}

/// Left, top, right, bottom of the changed area. `None` without changes.
fn changed_area(old: &[u8], new: &[u8], width: usize) -> Option<[usize; 4]> {
    let mut area: Option<[usize; 4]> = None;
    for (y, (a, b)) in old.chunks_exact(width).zip(new.chunks_exact(width)).enumerate() {
        let Some(first) = (0..width).find(|&x| a[x] != b[x]) else { continue };
        let last = (first..width).rev().find(|&x| a[x] != b[x]).unwrap_or(first) + 1;
        let [left, top, right, _] = area.unwrap_or([first, y, last, y + 1]);
        area = Some([left.min(first), top, right.max(last), y + 1]);
    }
    area
}

/// 255 colors, and the nearest of them for any color.
struct Palette {
    quantizer: NeuQuant,
    /// 256 RGB entries, the last unused.
    table: Vec<u8>,
    /// Index by color at 6 bits per channel, computed on first use.
    nearest: Vec<Option<u8>>,
}

impl Palette {
    fn learn(frames: &[Image]) -> Self {
        // every frame contributes pixels from a grid that shifts from frame to frame
        let pixels: usize = frames.iter().map(|frame| frame.rgb().len() / 3).sum();
        let step = pixels.div_ceil(LESSONS).max(1);
        let mut lessons = Vec::with_capacity(4 * (pixels / step + frames.len()));
        for (i, frame) in frames.iter().enumerate() {
            for (k, pixel) in frame.rgb().chunks_exact(3).enumerate() {
                // the character is small but colorful, and its shades matter more than the floor's
                let (low, high) = pixel.iter().fold((255_u8, 0_u8), |(low, high), &c| (c.min(low), c.max(high)));
                let vivid = high - low > VIVID;
                let stride = if vivid { (step / 10).max(1) } else { step };
                if k % stride == i % stride {
                    lessons.extend_from_slice(pixel);
                    lessons.push(255);
                }
            }
        }
        // the quantizer walks its samples in strides and needs a minimum number
        while lessons.len() < 4 * 1024 {
            lessons.extend_from_within(..);
        }
        let quantizer = NeuQuant::new(3, COLORS, &lessons);
        let mut table = quantizer.color_map_rgb();
        table.resize(3 * (COLORS + 1), 0);
        Self { quantizer, table, nearest: vec![None; 1 << 18] }
    }

    /// Palette indices of a picture, with ordered dither fixed to the screen so that it does not flicker.
    fn map(&mut self, image: &Image) -> Vec<u8> {
        let width = image.width();
        let pixel = |(i, rgb): (usize, &[u8])| {
            let offset = dither(i % width, i / width);
            let channel = |c: u8| (i32::from(c) + offset).clamp(0, 255) as u8;
            self.index([channel(rgb[0]), channel(rgb[1]), channel(rgb[2])])
        };
        image.rgb().chunks_exact(3).enumerate().map(pixel).collect()
    }

    fn index(&mut self, rgb: [u8; 3]) -> u8 {
        // 6 bits per channel: the rounding is below what 255 colors can show
        let key = rgb.iter().fold(0, |key, &c| key << 6 | usize::from(c >> 2));
        *self.nearest[key].get_or_insert_with(|| {
            let [r, g, b] = rgb.map(|c| c & !3 | 2);
            self.quantizer.index_of(&[r, g, b, 255]).min(COLORS - 1) as u8
        })
    }
}

/// A 4x4 Bayer matrix scaled to `-DITHER..=DITHER`.
fn dither(x: usize, y: usize) -> i32 {
    const BAYER: [[i32; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    (BAYER[y % 4][x % 4] * (2 * DITHER + 1)) / 16 - DITHER
}
