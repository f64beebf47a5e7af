//! Files that a model names.

use crate::budget::{self, MODEL_FILE};
use std::path::Path;

/// Reads a file that the model refers to, given its path relative to the model.
pub(crate) type ReadFile<'a> = dyn Fn(&str) -> Result<Vec<u8>, FileError> + 'a;

/// Why a file cannot be read.
pub(crate) struct FileError {
    pub reason: String,
    /// There is no such file.
    pub missing: bool,
}

/// The bytes of a file within the budget.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    budget::read(path, &MODEL_FILE)
        .map_err(|e| FileError { missing: e.kind() == std::io::ErrorKind::NotFound, reason: e.to_string() })
}

/// The bytes of a file that is not on a disk.
pub(crate) fn resolved(bytes: Result<Vec<u8>, String>) -> Result<Vec<u8>, FileError> {
    bytes.map_err(|reason| FileError { reason, missing: true })
}
