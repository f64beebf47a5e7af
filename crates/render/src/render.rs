//! Rendering: one ray per pixel, and more at edges.

use std::sync::LazyLock;

use glam::DVec3;

use crate::camera::Camera;
use crate::error::RenderError;
use crate::image::{Image, check_size};
use crate::palette::{Encoder, tone};
use crate::scene::Frame;
use crate::view::{FIRST_PLANE, SKY_ID, Sample, View};

/// Smoothing of edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Antialias {
    /// One ray per pixel.
    Off,
    /// One ray per pixel, and 16 in pixels where an object or a shadow ends. The default.
    Adaptive,
    /// A square of this many rays per side in every pixel, at most 8.
    Grid(usize),
}

/// Turns frames into images. The same frame gives the same bytes on any number of threads.
#[derive(Clone, Debug)]
pub struct Renderer {
    width: usize,
    height: usize,
    /// Smoothing of edges.
    pub antialias: Antialias,
    /// Threads to use; 0 means all cores.
    pub threads: usize,
}

/// Rays per side of an edge pixel.
const EDGE_RAYS: usize = 4;
/// Rows handed to a thread at a time.
const BAND: usize = 8;

impl Renderer {
    /// A renderer for pictures of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`RenderError::Size`] unless both sides are in `1..=MAX_SIDE`.
    pub fn new(width: usize, height: usize) -> Result<Self, RenderError> {
        check_size(width, height)?;
        Ok(Self { width, height, antialias: Antialias::Adaptive, threads: 0 })
    }

    /// Width of the pictures, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the pictures, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Draws `frame` as `camera` sees it.
    pub fn render(&self, frame: &Frame, camera: &Camera) -> Image {
        let (width, height) = (self.width, self.height);
        let view = View::new(frame, camera, [width, height]);
        static ENCODER: LazyLock<Encoder> = LazyLock::new(Encoder::new);
        let encoder = &*ENCODER;
        let threads = marathon_physics::threads(self.threads);

        // first pass: one ray through the middle of each pixel, or all rays of a grid
        let side = if let Antialias::Grid(side) = self.antialias { side.clamp(1, 8) } else { 1 };
        let nothing = Sample { color: DVec3::ZERO, id: SKY_ID, sun: 1.0 };
        let mut samples = vec![nothing; width * height];
        in_bands(&mut samples, width, threads, |y, row| {
            for (x, sample) in row.iter_mut().enumerate() {
                *sample = pixel(&view, x, y, side);
            }
        });

        // second pass: more rays where a neighbor shows something else
        let refine = self.antialias == Antialias::Adaptive;
        let mut image = Image::black(width, height);
        in_bands(image.rgb_mut(), 3 * width, threads, |y, row| {
            for (x, out) in row.chunks_exact_mut(3).enumerate() {
                let mut color = samples[y * width + x].color;
                if refine && is_edge(&samples, [width, height], x, y) {
                    color = pixel(&view, x, y, EDGE_RAYS).color;
                }
                out.copy_from_slice(&encoder.encode(color));
            }
        });
        image
    }
}

/// Mean of `side * side` rays in a pixel. Each ray is tone-mapped separately so that bright edges stay smooth.
fn pixel(view: &View, x: usize, y: usize, side: usize) -> Sample {
    let share = 1.0 / side as f64;
    let mut mean = Sample { color: DVec3::ZERO, id: SKY_ID, sun: 1.0 };
    for i in 0..side * side {
        let at = |pixel: usize, k: usize| pixel as f64 + (k as f64 + 0.5) * share;
        let sample = view.sample(at(x, i % side), at(y, i / side), share);
        mean.color += share * share * tone(sample.color);
        (mean.id, mean.sun) = (sample.id, sample.sun);
    }
    mean
}

/// Whether a pixel differs from a neighbor in the visible object, in shadow, or, on a solid, much in brightness.
fn is_edge(samples: &[Sample], size: [usize; 2], x: usize, y: usize) -> bool {
    let [width, height] = size;
    let here = &samples[y * width + x];
    let differs = |x: usize, y: usize| {
        let there = &samples[y * width + x];
        let solid = here.id > FIRST_PLANE && there.id > FIRST_PLANE;
        here.id != there.id
            || (here.sun - there.sun).abs() > 0.2
            || (solid && (here.color - there.color).abs().max_element() > 0.08)
    };
    (x > 0 && differs(x - 1, y))
        || (x + 1 < width && differs(x + 1, y))
        || (y > 0 && differs(x, y - 1))
        || (y + 1 < height && differs(x, y + 1))
}

/// Calls `work(row index, row)` for all rows of `data` on several threads, which take bands in turn.
fn in_bands<T: Send>(data: &mut [T], row: usize, threads: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    let rows = data.len() / row;
    let threads = threads.clamp(1, rows.div_ceil(BAND));
    let mut shares: Vec<Vec<(usize, &mut [T])>> = (0..threads).map(|_| Vec::new()).collect();
    for (i, band) in data.chunks_mut(row * BAND).enumerate() {
        shares[i % threads].push((i * BAND, band));
    }
    let run = |share: Vec<(usize, &mut [T])>| {
        for (first, band) in share {
            for (i, line) in band.chunks_exact_mut(row).enumerate() {
                work(first + i, line);
            }
        }
    };
    std::thread::scope(|scope| {
        let own = shares.pop();
        for share in shares {
            scope.spawn(|| run(share));
        }
        own.into_iter().for_each(run);
    });
}
