//! A common writer for videos and pictures. The file's extension selects the format.

use std::path::{Path, PathBuf};

use crate::animation::GifWriter;
use crate::error::RenderError;
use crate::image::{Image, strip};
use crate::mp4::Mp4Writer;

/// Format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A still picture or a strip.
    Png,
    /// An animation for browsers and chats.
    Gif,
    /// A video. It needs `ffmpeg`.
    Mp4,
}

impl Format {
    const ALL: [(&'static str, Format); 3] = [("png", Format::Png), ("gif", Format::Gif), ("mp4", Format::Mp4)];

    /// The format of a path by its extension, in upper or lower case.
    ///
    /// # Errors
    /// [`RenderError::Extension`], with the nearest valid extension.
    pub fn of(path: impl AsRef<Path>) -> Result<Self, RenderError> {
        let path = path.as_ref();
        let found = path.extension().map(|text| text.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        if let Some((_, format)) = Self::ALL.iter().find(|(name, _)| *name == found) {
            return Ok(*format);
        }
        // the extension with the most letters in common; png, the first, without any
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

/// Writes frames to a `.png` strip, a `.gif` or an `.mp4`.
pub struct Recorder {
    sink: Sink,
}

enum Sink {
    Png { path: PathBuf, columns: usize, frames: Vec<Image> },
    Gif(GifWriter),
    Mp4(Mp4Writer),
}

impl Recorder {
    /// Creates a file. `fps` is for videos; `columns` is the number of frames per row of a `.png` strip.
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

    /// Completes the file. Without this call, no file is left.
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
