//! Limits on the contents of files, checked before work starts.

use crate::error::MotionError;
use marathon_physics::budget::{MEMORY, OverBudget, RECORDING_SECONDS};
use serde::de::DeserializeOwned;
use std::path::Path;

fn over(path: &Path, what: &str) -> impl FnOnce(OverBudget) -> MotionError {
    move |error| MotionError::Budget { path: path.into(), problem: format!("{what} {error}") }
}

/// Checks the length of a motion, s.
pub(crate) fn check_seconds(path: &Path, seconds: f64) -> Result<(), MotionError> {
    RECORDING_SECONDS.check(seconds).map_err(over(path, "the motion"))
}

/// Checks the number of frames, with `numbers` numbers each. Edits keep about three copies.
pub(crate) fn check_frames(path: &Path, frames: f64, numbers: usize) -> Result<(), MotionError> {
    check_memory(path, frames * numbers as f64 * 24.0)
}

/// Checks the memory of a motion, bytes.
pub(crate) fn check_memory(path: &Path, bytes: f64) -> Result<(), MotionError> {
    MEMORY.check(bytes).map_err(over(path, "the motion"))
}

/// Reads a JSON document within the limits, with or without the byte order mark that some programs write first.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, MotionError> {
    check_json(path, bytes)?;
    let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    serde_json::from_slice(json).map_err(|error| MotionError::json(path, &error))
}

/// Checks the memory for a JSON document of rows of numbers. Each bracket may start a row, and each comma may add a
/// number.
fn check_json(path: &Path, bytes: &[u8]) -> Result<(), MotionError> {
    let (rows, numbers) = bytes.iter().fold((0usize, 0usize), |(rows, numbers), byte| match byte {
        b'[' => (rows + 1, numbers),
        b',' => (rows, numbers + 1),
        _ => (rows, numbers),
    });
    check_memory(path, 64.0 * rows as f64 + 16.0 * numbers as f64)
}
