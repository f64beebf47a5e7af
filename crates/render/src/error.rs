//! Errors on the way from `qpos` to a file.

use std::path::{Path, PathBuf};

use marathon_physics::budget::OverBudget;

/// An error of this crate. Errors of a file name its path.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The length of a `qpos` is wrong, usually because it belongs to another model.
    #[error("agent {agent}: qpos has {found} values, expected {expected} for model '{model}'")]
    QposLength {
        /// Index of the agent in the frame.
        agent: usize,
        /// Name of the model.
        model: String,
        /// Length given.
        found: usize,
        /// Length of the model's `qpos`.
        expected: usize,
    },
    /// A NaN or infinity in a `qpos`.
    #[error("agent {agent}: qpos[{index}] is {value}, expected a finite number")]
    NotFinite {
        /// Index of the agent in the frame.
        agent: usize,
        /// Index in its `qpos`.
        index: usize,
        /// The value found.
        value: f64,
    },
    /// A width or height that no output format here can hold.
    #[error("image size {width}x{height} is out of range: each side must be 1 to {max}")]
    Size {
        /// Requested width, pixels.
        width: usize,
        /// Requested height, pixels.
        height: usize,
        /// Largest side.
        max: usize,
    },
    /// A frame whose size differs from the first one's.
    #[error("frame {index} is {found:?} pixels, expected {expected:?} like the first one")]
    FrameSize {
        /// Index of the frame.
        index: usize,
        /// Its width and height.
        found: [usize; 2],
        /// Width and height of the first frame.
        expected: [usize; 2],
    },
    /// A strip or video without frames.
    #[error("{what}: no frames")]
    NoFrames {
        /// The strip or the path of the file.
        what: String,
    },
    /// A file name whose extension is not a supported format.
    #[error("{}: unknown extension '{found}', expected png, gif or mp4; did you mean '{nearest}'?", path.display())]
    Extension {
        /// The path given.
        path: PathBuf,
        /// Its extension, possibly empty.
        found: String,
        /// The most similar valid extension.
        nearest: &'static str,
    },
    /// A frame rate that the format does not support.
    #[error("{}: {fps} frames per second is out of range, expected {min} to {max}", path.display())]
    Fps {
        /// File to be written.
        path: PathBuf,
        /// The requested rate.
        fps: f64,
        /// Lowest rate.
        min: f64,
        /// Highest rate.
        max: f64,
    },
    /// A video that exceeds the memory or time budget.
    #[error("{}: {what} {source}", path.display())]
    Budget {
        /// The output file.
        path: PathBuf,
        /// The part that exceeds the limit.
        what: &'static str,
        /// The limit.
        source: OverBudget,
    },
    /// A file could not be created, written or renamed.
    #[error("{}: {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The attempted action.
        action: &'static str,
        /// Its cause.
        source: std::io::Error,
    },
    /// The PNG or GIF encoder refused.
    #[error("{}: cannot encode: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The encoder's message.
        reason: String,
    },
    /// There is no `ffmpeg`.
    #[error(
        "{}: writing mp4 needs the program '{program}', which was not found: install ffmpeg \
         (apt install ffmpeg, brew install ffmpeg, winget install ffmpeg) or write a .gif instead",
        path.display()
    )]
    NoFfmpeg {
        /// File to be written.
        path: PathBuf,
        /// The program's name.
        program: String,
    },
    /// `ffmpeg` ended with an error.
    #[error("{}: '{program}' failed ({status}): {stderr}", path.display())]
    Ffmpeg {
        /// File to be written.
        path: PathBuf,
        /// The program run.
        program: String,
        /// How it exited.
        status: String,
        /// The end of its stderr output.
        stderr: String,
    },
}

impl RenderError {
    /// Wraps an I/O error with the file and what was being done to it.
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, action, source }
    }
}
