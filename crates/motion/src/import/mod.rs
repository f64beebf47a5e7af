//! Readers of motion capture formats: bytes in, an [`Animation`] out.

mod bvh;
mod deepmimic;

pub use bvh::bvh;
pub use deepmimic::deepmimic;

use crate::error::MotionError;
use crate::skeleton::Animation;
use std::path::Path;

/// Reads a file of any known format, by the ending of its name: `.bvh` is Biovision's, `.txt` and `.json` are DeepMimic's.
///
/// # Errors
/// If the ending is another one, or the file is malformed.
pub fn any(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "bvh" => bvh(path, bytes),
        "txt" | "json" => deepmimic(path, bytes),
        _ => Err(MotionError::Unsupported {
            path: path.into(),
            feature: format!("a recording with the ending {ending:?}"),
            instead: "expected .bvh, or .txt or .json of DeepMimic".into(),
        }),
    }
}
