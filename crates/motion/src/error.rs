//! Errors of motions, mappings, and their models.

use std::path::{Path, PathBuf};

/// Reason why a motion cannot be read or used. Every message names the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// The text does not follow its format.
    #[error("{}:{line}:{column}: {problem}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// The found and the expected text.
        problem: String,
    },
    /// An entry of the file has an invalid value.
    #[error("{}: {key}: found {found}, expected {expected}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Name of the entry.
        key: String,
        /// Its value.
        found: String,
        /// Valid values.
        expected: String,
    },
    /// A frame is invalid.
    #[error("{}: frame {frame}: {problem}", path.display())]
    Frame {
        /// The file.
        path: PathBuf,
        /// The frame, counted from 0.
        frame: usize,
        /// The found and the expected contents.
        problem: String,
    },
    /// The motion does not fit the model.
    #[error("{}: not a motion of the model {model}: {problem}", path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// Name of the model.
        model: String,
        /// The difference.
        problem: String,
    },
    /// The file exceeds a limit.
    #[error("{}: {problem}", path.display())]
    Budget {
        /// The file.
        path: PathBuf,
        /// The part of the file, the amount, the limit, and how to raise it.
        problem: String,
    },
    /// The file has something that is not supported.
    #[error("{}: {feature} is not supported; {instead}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The feature.
        feature: String,
        /// How to make the file usable.
        instead: String,
    },
}

impl MotionError {
    pub(crate) fn value(path: &Path, key: &str, found: impl ToString, expected: impl ToString) -> Self {
        Self::Value { path: path.into(), key: key.into(), found: found.to_string(), expected: expected.to_string() }
    }

    pub(crate) fn frame(path: &Path, frame: usize, problem: impl ToString) -> Self {
        Self::Frame { path: path.into(), frame, problem: problem.to_string() }
    }

    pub(crate) fn model(path: &Path, model: &str, problem: impl ToString) -> Self {
        Self::Model { path: path.into(), model: model.into(), problem: problem.to_string() }
    }

    /// Converts an error of `serde_json`, whose text ends with the position. The position has its own fields here.
    pub(crate) fn json(path: &Path, error: &serde_json::Error) -> Self {
        let text = error.to_string();
        let problem = text.split(" at line ").next().unwrap_or(&text).to_string();
        Self::Syntax { path: path.into(), line: error.line(), column: error.column(), problem }
    }
}
