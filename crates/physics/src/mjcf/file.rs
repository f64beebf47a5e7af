//! Files that a model names.

use crate::budget::{self, MODEL_FILE};
use std::path::{Component, Path, PathBuf};

/// Reads a file that the model refers to, given its path relative to the model.
pub(crate) type ReadFile<'a> = dyn Fn(&str) -> Result<Vec<u8>, FileError> + 'a;

/// Why a file cannot be read.
pub(crate) struct FileError {
    pub reason: String,
    /// There is no such file.
    pub missing: bool,
}

/// The bytes of a file within the budget. As in MuJoCo, folders that a `..` leaves again need not exist.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    let is_missing = |e: &std::io::Error| e.kind() == std::io::ErrorKind::NotFound;
    let bytes = match budget::read(path, &MODEL_FILE) {
        Err(e) if path.components().any(|part| part == Component::ParentDir) => {
            budget::read(&shortened(path), &MODEL_FILE).map_err(|_| e)
        }
        bytes => bytes,
    };
    bytes.map_err(|e| FileError { missing: is_missing(&e), reason: e.to_string() })
}

/// A path without the folders that it enters and leaves again.
fn shortened(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        let inside = matches!(out.components().next_back(), Some(Component::Normal(_)));
        if part == Component::ParentDir && inside {
            out.pop();
        } else {
            out.push(part);
        }
    }
    out
}

/// The bytes of a file that is not on a disk.
pub(crate) fn resolved(bytes: Result<Vec<u8>, String>) -> Result<Vec<u8>, FileError> {
    bytes.map_err(|reason| FileError { reason, missing: true })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_that_are_left_again_need_not_exist() {
        let short = |path: &str| shortened(Path::new(path)).to_string_lossy().replace('\\', "/");
        assert_eq!(short("a/b/../../c/d.obj"), "c/d.obj");
        assert_eq!(short("../../a/./../d.obj"), "../../d.obj");
        assert_eq!(short("/a/../b.obj"), "/b.obj");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert!(read(&folder.join("nowhere/../Cargo.toml")).is_ok());
        assert!(read(&folder.join("nowhere/Cargo.toml")).is_err_and(|e| e.missing));
    }
}
