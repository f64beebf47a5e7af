//! One way to write a film or a picture: the file's extension decides.

use std::path::{Path, PathBuf};

use crate::animation::GifWriter;
use crate::error::RenderError;
use crate::image::{Image, strip};
use crate::mp4::Mp4Writer;

/// What a file name asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A still picture or a strip.
    Png,
    /// An animation that every browser and chat shows.
    Gif,
    /// A film; needs `ffmpeg`.
    Mp4,
}

impl Format {
    const ALL: [(&'static str, Format); 3] = [("png", Format::Png), ("gif", Format::Gif), ("mp4", Format::Mp4)];

    /// The format of a path by its extension, in either case.
    ///
    /// # Errors
    /// [`RenderError::Extension`], with the nearest valid one.
    pub fn of(path: impl AsRef<Path>) -> Result<Self, RenderError> {
        let path = path.as_ref();
        let found = path.extension().map(|text| text.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        if let Some((_, format)) = Self::ALL.iter().find(|(name, _)| *name == found) {
            return Ok(*format);
        }
        // most letters in common; png, the first, when there are none
        let shared = |name: &str| name.chars().filter(|&c| found.contains(c)).count();
        let mut nearest = Self::ALL[0].0;
        for (name, _) in Self::ALL {
            if shared(name) > shared(nearest) {
                nearest = name;
            }
        }
        Err(RenderError::Extension { path: path.to_path_buf(), found, nearest })
    }
}

/// Takes frames and writes a `.png` strip, a `.gif` or an `.mp4`.
pub struct Recorder {
    sink: Sink,
}

enum Sink {
    Png { path: PathBuf, columns: usize, frames: Vec<Image> },
    Gif(GifWriter),
    Mp4(Mp4Writer),
}

impl Recorder {
    /// Opens a file. `fps` is for films; `columns` is how many frames of a `.png` strip share a row.
    ///
    /// # Errors
    /// [`RenderError::Extension`], [`RenderError::Fps`], [`RenderError::NoFfmpeg`], [`RenderError::Io`].
    pub fn create(path: impl AsRef<Path>, fps: f64, columns: usize) -> Result<Self, RenderError> {
        let path = path.as_ref();
        let sink = match Format::of(path)? {
            Format::Png => Sink::Png { path: path.to_path_buf(), columns, frames: Vec::new() },
            Format::Gif => Sink::Gif(GifWriter::create(path, fps)?),
            Format::Mp4 => Sink::Mp4(Mp4Writer::create(path, fps)?),
        };
        Ok(Self { sink })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// [`RenderError::FrameSize`] and the format's own.
    pub fn push(&mut self, frame: &Image) -> Result<(), RenderError> {
        match &mut self.sink {
            Sink::Png { frames, .. } => {
                frames.push(frame.clone());
                Ok(())
            }
            Sink::Gif(writer) => writer.push(frame),
            Sink::Mp4(writer) => writer.push(frame),
        }
    }

    /// Completes the file; without this nothing is left of it.
    ///
    /// # Errors
    /// [`RenderError::NoFrames`], [`RenderError::Io`] and the format's own.
    pub fn finish(self) -> Result<(), RenderError> {
        match self.sink {
            Sink::Png { path, columns, frames } => match frames.is_empty() {
                true => Err(RenderError::NoFrames { what: path.display().to_string() }),
                false => strip(&frames, columns)?.save_png(path),
            },
            Sink::Gif(writer) => writer.finish(),
            Sink::Mp4(writer) => writer.finish(),
        }
    }
}
