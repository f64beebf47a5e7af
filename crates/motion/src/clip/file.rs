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
//! | `fit` | distance from the recording, if known: mean distance of the bodies, m, and mean angle, rad |
//! | `checksum` | checksum of all other values, independent of formatting |

use super::{About, Clip, Cycle, Nearness};
use crate::error::MotionError;
use crate::layout::{JointKind, Layout};
use crate::limits;
use fnv::FnvHasher;
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::hash::Hasher;
use std::path::Path;

/// The version of written files.
const VERSION: u64 = 1;

/// The contents of a file before validation.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    motion: u64,
    name: String,
    model: String,
    source: String,
    license: String,
    #[serde(default)]
    fit: Option<[f64; 2]>,
    #[serde(default)]
    checksum: Option<String>,
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
    /// Reads the bytes of a `.motion` file. The path is for messages.
    ///
    /// # Errors
    /// If the file is malformed, or its checksum is missing or wrong. The message names the line, the entry or the
    /// frame.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, MotionError> {
        Self::read(path, limits::read_json(path, bytes)?, true, true)
    }

    /// Reads the text of a `.motion` file that is part of the program, which needs no limits.
    ///
    /// # Errors
    /// As [`Clip::parse`], without the limits.
    pub fn shipped(path: &Path, text: &'static str) -> Result<Self, MotionError> {
        let file = serde_json::from_str(text).map_err(|error| MotionError::json(path, &error))?;
        Self::read(path, file, true, false)
    }

    /// Reads the bytes of a `.motion` file without requiring a checksum. An existing checksum must be correct.
    ///
    /// # Errors
    /// As [`Clip::parse`].
    pub fn parse_without_checksum(path: &Path, bytes: &[u8]) -> Result<Self, MotionError> {
        Self::read(path, limits::read_json(path, bytes)?, false, true)
    }

    fn read(path: &Path, file: Document, strict: bool, limited: bool) -> Result<Self, MotionError> {
        if file.motion != VERSION {
            return Err(MotionError::value(path, "motion", file.motion, format!("version {VERSION} of the format")));
        }
        let command = format!("`marathon motion import {} --out NEW.motion` writes one", path.display());
        let sum = file.sum();
        match &file.checksum {
            Some(found) if *found != sum => {
                let expected = format!(
                    "{sum}: the file is damaged or was edited; if you edited it, remove this entry, and {command}"
                );
                return Err(MotionError::value(path, "checksum", found.escape_debug(), expected));
            }
            None if strict => {
                return Err(MotionError::value(path, "checksum", "nothing", format!("a checksum; {command}")));
            }
            _ => {}
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
        let fit = file.fit.map(|[position, rotation]| Nearness { position, rotation });
        if let Some(Nearness { position, rotation }) = fit.filter(|fit| !(fit.position >= 0.0 && fit.rotation >= 0.0)) {
            return Err(MotionError::value(path, "fit", format!("[{position}, {rotation}]"), "two positive numbers"));
        }
        let about = About { name: file.name, model: file.model, source: file.source, license: file.license, fit };
        if limited {
            limits::check_seconds(path, file.frames.len() as f64 * file.dt)?;
        }
        Clip::new(path, about, Layout::new(file.joints), file.dt, cycle, &file.frames)
    }

    /// The bytes of a `.motion` file. Reading them gives the same clip, to the last bit.
    pub fn to_bytes(&self) -> Vec<u8> {
        let text = |text: &str| serde_json::to_string(text).expect("texts can be written");
        let About { name, model, source, license, .. } = &self.about;
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
        if let Some(Nearness { position, rotation }) = self.about.fit {
            let _ = writeln!(out, "  \"fit\": [{position}, {rotation}],");
        }
        let _ = writeln!(out, "  \"checksum\": \"{}\",", self.sum());
        let frames = (0..self.frames()).map(|i| {
            let numbers: Vec<String> = self.frame(i).iter().map(f64::to_string).collect();
            format!("    [{}]", numbers.join(", "))
        });
        let _ = writeln!(out, "  \"frames\": [\n{}\n  ]\n}}", joined(frames));
        out.into_bytes()
    }
}

impl Document {
    fn sum(&self) -> String {
        let mut sum = Checksum::default();
        [&self.name, &self.model, &self.source, &self.license].into_iter().for_each(|text| sum.text(text));
        sum.text(if self.r#loop == Loop::Wrap { "wrap" } else { "none" });
        sum.numbers(self.cycle.as_ref().map_or(&[], |cycle| cycle));
        sum.numbers(&[self.dt]);
        sum.numbers(self.fit.as_ref().map_or(&[], |fit| fit));
        self.joints.iter().for_each(|(name, kind)| sum.joint(name, *kind));
        self.frames.iter().for_each(|frame| sum.numbers(frame));
        sum.hex()
    }
}

impl Clip {
    /// The checksum in the output of [`Clip::to_bytes`].
    fn sum(&self) -> String {
        let About { name, model, source, license, fit } = &self.about;
        let mut sum = Checksum::default();
        [name, model, source, license].into_iter().for_each(|text| sum.text(text));
        sum.text(if self.cycle.is_some() { "wrap" } else { "none" });
        sum.numbers(&self.cycle.map_or(vec![], |Cycle { pos: [x, y], yaw }| vec![x, y, yaw]));
        sum.numbers(&[self.dt]);
        sum.numbers(&fit.map_or(vec![], |fit| vec![fit.position, fit.rotation]));
        self.layout.joints().for_each(|(name, kind)| sum.joint(name, kind));
        (0..self.frames()).for_each(|i| sum.numbers(self.frame(i)));
        sum.hex()
    }
}

/// FNV-1a hash of values. The length of each value is hashed before it, so that different documents hash different
/// bytes.
#[derive(Default)]
struct Checksum(FnvHasher);

impl Checksum {
    fn bytes(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
    }

    fn text(&mut self, text: &str) {
        self.bytes(&(text.len() as u64).to_le_bytes());
        self.bytes(text.as_bytes());
    }

    fn joint(&mut self, name: &str, kind: JointKind) {
        self.text(name);
        self.bytes(&[kind as u8]);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.bytes(&(numbers.len() as u64).to_le_bytes());
        numbers.iter().for_each(|number| self.bytes(&number.to_bits().to_le_bytes()));
    }

    fn hex(&self) -> String {
        format!("{:016x}", self.0.finish())
    }
}

fn joined(lines: impl Iterator<Item = String>) -> String {
    lines.collect::<Vec<_>>().join(",\n")
}
