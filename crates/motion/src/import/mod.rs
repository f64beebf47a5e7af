//! Readers of motion capture formats: bytes in, an [`Animation`] out.

mod bvh;
mod deepmimic;
mod gltf;
mod raw;
mod upright;

pub use bvh::bvh;
pub use deepmimic::deepmimic;
pub use gltf::glb;
pub use upright::Up;

use crate::error::MotionError;
use crate::skeleton::Animation;
use std::collections::BTreeMap;
use std::path::Path;

/// Meters of the units in use: meter, centimeter, inch, and CMU's unit, an inch over 0.45.
const UNITS: [f64; 4] = [1.0, 0.01, 0.0254, 0.0254 / 0.45];
/// Height of a person from the ankles to the head's joint, m. Not all files have a joint at the top of the head.
const HEIGHT: f64 = 1.65;

/// Reads a file next to the recording by its name.
pub type Beside<'a> = &'a dyn Fn(&str) -> Result<Vec<u8>, String>;

/// Settings for reading a recording.
#[derive(Clone, Default)]
pub struct Reading<'a> {
    /// The file's axis that points up. With `None`, it is found from the motion.
    pub up: Option<Up>,
    /// Height of the floor in the file, m. With `None`, it is found from the contacts.
    pub floor: Option<f64>,
    /// Name or index of the animation. With `None`, the first one is read.
    pub animation: Option<String>,
    /// Maps the file's joint names to names that [`Mapping`](crate::Mapping)'s general names recognize.
    pub known_as: BTreeMap<String, String>,
    /// Reads the files next to a `.gltf` file. With `None`, such files are refused.
    pub beside: Option<Beside<'a>>,
}

/// The result of reading a recording.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The motion.
    pub animation: Animation,
    /// Notes on properties found from the motion and on ignored parts, one sentence each.
    pub notes: Vec<String>,
}

/// File endings that [`any`] reads.
pub const ENDINGS: [&str; 7] = ["bvh", "glb", "gltf", "vrm", "vrma", "txt", "json"];

/// Reads a file of any supported format with the default settings.
///
/// # Errors
/// As [`read`].
pub fn any(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    Ok(read(path, bytes, &Reading::default())?.animation)
}

/// Reads a file of any supported format. The ending selects the format: `.bvh` for Biovision, `.glb`, `.gltf`, `.vrm`
/// and `.vrma` for glTF, `.txt` and `.json` for DeepMimic.
///
/// # Errors
/// If the ending is unknown, the file is malformed, or it has no such animation.
pub fn read(path: &Path, bytes: &[u8], reading: &Reading) -> Result<Recording, MotionError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if let Some(floor) = reading.floor.filter(|floor| !(floor.abs() <= 1e4)) {
        return Err(MotionError::value(path, "floor", floor, "a height from -10000 to 10000 m"));
    }
    match ending.as_str() {
        "bvh" | "txt" | "json" if reading.animation.is_some() => {
            let expected = "no name of an animation: only glTF files have several";
            Err(MotionError::value(
                path,
                "animation",
                format!("{:?}", reading.animation.as_deref().unwrap_or("")),
                expected,
            ))
        }
        "bvh" => bvh::read(path, bytes, reading),
        "glb" | "gltf" | "vrm" | "vrma" => gltf::read(path, bytes, reading),
        "txt" | "json" => deepmimic::read(path, bytes, reading),
        _ => Err(MotionError::Unsupported {
            path: path.into(),
            feature: format!("a recording with the ending {ending:?}"),
            instead:
                "expected .bvh, .glb, .gltf, .vrm, .vrma, or .txt or .json of DeepMimic; Blender writes .fbx as .glb"
                    .into(),
        }),
    }
}

/// The unit, m, in which a figure of this height is nearest to a person's.
fn unit(height: f64) -> f64 {
    let off = |unit: f64| libm::log(unit * height / HEIGHT).abs();
    UNITS.into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(1.0)
}
