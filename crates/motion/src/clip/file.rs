//! The file format: JSON with one frame per line.
//!
//! | entry | meaning |
//! |---|---|
//! | `motion` | version of the format, 1 |
//! | `name`, `model`, `source`, `license` | [`About`] |
//! | `loop` | `"wrap"` or `"none"` |
//! | `cycle` | `[x, y, yaw]` of a looping clip, m and rad: [`Cycle`] |
//! | `dt` | seconds between frames |
//! | `joints` | name and kind of each joint in the order of `qpos`: `free`, `ball`, `slide` or `hinge` |
//! | `frames` | `qpos` of each frame |

use super::{About, Clip, Cycle};
use crate::error::MotionError;
use crate::layout::{JointKind, Layout};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::Path;

/// The version that is written.
const VERSION: u64 = 1;

/// A file before it is checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    motion: u64,
    name: String,
    model: String,
    source: String,
    license: String,
    r#loop: Loop,
    #[serde(default)]
    cycle: Option<[f64; 3]>,
    dt: f64,
    joints: Vec<(String, JointKind)>,
    frames: Vec<Vec<f64>>,
}

#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Loop {
    Wrap,
    None,
}

impl Clip {
    /// Reads the bytes of a `.motion` file; the path is for messages.
    ///
    /// # Errors
    /// If the file is malformed: the message names the line, the entry or the frame.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, MotionError> {
        let file: Document = serde_json::from_slice(bytes).map_err(|error| MotionError::json(path, &error))?;
        if file.motion != VERSION {
            return Err(MotionError::value(path, "motion", file.motion, format!("version {VERSION} of the format")));
        }
        let cycle = match (file.r#loop, file.cycle) {
            (Loop::Wrap, Some([x, y, yaw])) => Some(Cycle { pos: [x, y], yaw }),
            (Loop::None, None) => None,
            (Loop::Wrap, None) => return Err(MotionError::value(path, "cycle", "nothing", "[x, y, yaw] of a cycle")),
            (Loop::None, Some(_)) => {
                return Err(MotionError::value(path, "cycle", "a cycle", "none, since the motion does not loop"));
            }
        };
        if file.joints.is_empty() {
            return Err(MotionError::value(path, "joints", "none", "one or more"));
        }
        let about = About { name: file.name, model: file.model, source: file.source, license: file.license };
        Clip::new(path, about, Layout::new(file.joints), file.dt, cycle, &file.frames)
    }

    /// The bytes of a `.motion` file. Reading them gives this clip again, to the last bit.
    pub fn to_bytes(&self) -> Vec<u8> {
        let text = |text: &str| serde_json::to_string(text).expect("texts can be written");
        let About { name, model, source, license } = &self.about;
        let mut out = format!("{{\n  \"motion\": {VERSION},\n");
        for (key, value) in [("name", name), ("model", model), ("source", source), ("license", license)] {
            let _ = writeln!(out, "  \"{key}\": {},", text(value));
        }
        match self.cycle {
            Some(Cycle { pos: [x, y], yaw }) => {
                let _ = writeln!(out, "  \"loop\": \"wrap\",\n  \"cycle\": [{x}, {y}, {yaw}],");
            }
            None => out.push_str("  \"loop\": \"none\",\n"),
        }
        let kind = |kind: JointKind| serde_json::to_string(&kind).expect("kinds can be written");
        let joints = self.layout.joints().map(|(name, of)| format!("    [{}, {}]", text(name), kind(of)));
        let _ = writeln!(out, "  \"dt\": {},\n  \"joints\": [\n{}\n  ],", self.dt, joined(joints));
        let frames = (0..self.frames()).map(|i| {
            let numbers: Vec<String> = self.frame(i).iter().map(f64::to_string).collect();
            format!("    [{}]", numbers.join(", "))
        });
        let _ = writeln!(out, "  \"frames\": [\n{}\n  ]\n}}", joined(frames));
        out.into_bytes()
    }
}

fn joined(lines: impl Iterator<Item = String>) -> String {
    lines.collect::<Vec<_>>().join(",\n")
}
