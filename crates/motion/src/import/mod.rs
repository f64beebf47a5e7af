//! Readers of motion capture formats: bytes in, an [`Animation`] out.

mod bvh;
mod deepmimic;
mod glb;

pub use bvh::bvh;
pub use deepmimic::deepmimic;
pub use glb::glb;

use crate::error::MotionError;
use crate::skeleton::Animation;
use std::path::Path;

/// Meters of the units in use: meter, centimeter, inch, and CMU's unit, an inch over 0.45.
const UNITS: [f64; 4] = [1.0, 0.01, 0.0254, 0.0254 / 0.45];
/// A figure's rest pose from the lowest to the highest joint, m. The head's top is no joint in all files.
const HEIGHT: f64 = 1.65;

/// Reads a file of any known format, by the ending of its name: `.bvh` is Biovision's, `.glb` is glTF's, `.txt` and `.json` are DeepMimic's.
///
/// # Errors
/// If the ending is another one, or the file is malformed.
pub fn any(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "bvh" => bvh(path, bytes),
        "glb" => glb(path, bytes),
        "txt" | "json" => deepmimic(path, bytes),
        _ => Err(MotionError::Unsupported {
            path: path.into(),
            feature: format!("a recording with the ending {ending:?}"),
            instead: "expected .bvh, .glb, or .txt or .json of DeepMimic".into(),
        }),
    }
}

/// The unit, m, in which a figure of this height is nearest to a person's.
fn unit(height: f64) -> f64 {
    let off = |unit: f64| libm::log(unit * height / HEIGHT).abs();
    UNITS.into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(1.0)
}
