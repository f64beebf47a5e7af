//! The budget limits the memory and time that a file or a message can use.
//!
//! Readers of untrusted files and messages check the budget before they start work. [`read`] limits the bytes of a
//! file, and [`Limit::check`] limits the work that those bytes cause. [`ALL`] lists the limits, and `docs/limits.md`
//! explains them. The environment variable `MARATHON_LIMITS` raises them:
//! `MARATHON_LIMITS=memory=8GB,recording_seconds=7200`.

use std::env::VarError;
use std::fmt;
use std::io::{self, Read};
use std::path::Path;
use std::sync::OnceLock;

use crate::hint;

/// The environment variable that raises limits.
pub const VARIABLE: &str = "MARATHON_LIMITS";

/// The unit of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Bytes of a file or of memory.
    Bytes,
    /// Seconds of motion, video or waiting.
    Seconds,
    /// Number of things, with their plural noun.
    Count(&'static str),
}

/// A limit on one property of a file or a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Its name in [`VARIABLE`] and in errors.
    pub name: &'static str,
    /// Description for the documentation.
    pub what: &'static str,
    /// Unit of `default`.
    pub unit: Unit,
    /// The limit unless [`VARIABLE`] sets another.
    pub default: u64,
}

const fn bytes(name: &'static str, default: u64, what: &'static str) -> Limit {
    Limit { name, what, unit: Unit::Bytes, default }
}

const fn seconds(name: &'static str, default: u64, what: &'static str) -> Limit {
    Limit { name, what, unit: Unit::Seconds, default }
}

const MB: u64 = 1_000_000;
const GB: u64 = 1_000_000_000;

/// Memory for one file or message.
pub const MEMORY: Limit = bytes("memory", 2 * GB, "Memory that one file or message may ask for");
/// Memory for all agents of a batch or environment.
pub const AGENTS_MEMORY: Limit = bytes("agents_memory", 16 * GB, "Memory of all agents of a batch or environment");
/// A model file, and each file that it includes or uses as a mesh, texture or height field.
pub const MODEL_FILE: Limit = bytes("model_file", 64 * MB, "Size of a model file and of each file that it names");
/// A policy or checkpoint file.
pub const POLICY_FILE: Limit = bytes("policy_file", GB, "Size of a policy or checkpoint file");
/// A motion clip.
pub const CLIP_FILE: Limit = bytes("clip_file", 64 * MB, "Size of a clip file");
/// A recording: BVH, glTF or DeepMimic.
pub const RECORDING_FILE: Limit = bytes("recording_file", 512 * MB, "Size of a recording file (BVH, glTF, DeepMimic)");
/// Length of a recording or of a clip.
pub const RECORDING_SECONDS: Limit = seconds("recording_seconds", 3600, "Duration of a recording or clip");
/// A game replay.
pub const REPLAY_FILE: Limit = bytes("replay_file", 512 * MB, "Size of a game replay file");
/// A skin or picture that the game loads.
pub const SKIN_FILE: Limit = bytes("skin_file", 512 * MB, "Size of a skin file");
/// A demonstration file.
pub const DEMONSTRATION_FILE: Limit = bytes("demonstration_file", GB, "Size of a demonstration file");
/// A table or log of a run: CSV, JSON, TensorBoard events.
pub const TABLE_FILE: Limit =
    bytes("table_file", 256 * MB, "Size of a table, log or record of a run (CSV, JSON, events)");
/// A configuration or mapping file.
pub const CONFIG_FILE: Limit = bytes("config_file", MB, "Size of a configuration, mapping or settings file");
/// Length of a video or of scripted play.
pub const VIDEO_SECONDS: Limit = seconds("video_seconds", 3600, "Duration of a video or of scripted play");

/// Every limit, in the order of the documentation.
pub const ALL: &[Limit] = &[
    MEMORY,
    AGENTS_MEMORY,
    MODEL_FILE,
    POLICY_FILE,
    CLIP_FILE,
    RECORDING_FILE,
    RECORDING_SECONDS,
    REPLAY_FILE,
    SKIN_FILE,
    DEMONSTRATION_FILE,
    TABLE_FILE,
    CONFIG_FILE,
    VIDEO_SECONDS,
];

/// An amount above a limit, or an invalid value of [`VARIABLE`].
#[derive(Clone, Debug, PartialEq)]
pub struct OverBudget(String);

impl fmt::Display for OverBudget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for OverBudget {}

impl From<OverBudget> for io::Error {
    fn from(error: OverBudget) -> Self {
        io::Error::other(error)
    }
}

impl Limit {
    /// The default with its unit, such as "2 GB".
    pub fn default_text(&self) -> String {
        self.unit.text(self.default as f64)
    }

    /// The limit: the default, or the value in [`VARIABLE`].
    ///
    /// # Errors
    /// If [`VARIABLE`] is invalid.
    pub fn most(&self) -> Result<u64, OverBudget> {
        static RAISED: OnceLock<Result<Vec<(String, u64)>, OverBudget>> = OnceLock::new();
        let raised = RAISED.get_or_init(|| match std::env::var(VARIABLE) {
            Ok(text) => parse(&text),
            Err(VarError::NotPresent) => Ok(Vec::new()),
            Err(VarError::NotUnicode(text)) => Err(OverBudget(format!("{VARIABLE}: found {text:?}, expected UTF-8"))),
        });
        let raised = raised.as_ref().map_err(Clone::clone)?;
        Ok(raised.iter().rev().find(|(name, _)| name == self.name).map_or(self.default, |(_, most)| *most))
    }

    /// Checks an amount against the limit. NaN is above every limit.
    ///
    /// # Errors
    /// If the amount is above the limit. The error text continues a sentence about the file or element: "asks for 64
    /// GB; the limit 'memory' is 2 GB ...".
    pub fn check(&self, asked: f64) -> Result<(), OverBudget> {
        let most = self.most()?;
        if asked <= most as f64 {
            return Ok(());
        }
        let (asked, most) = (self.unit.text(asked), self.unit.text(most as f64));
        let (name, unit) = (self.name, self.unit.example());
        Err(OverBudget(format!(
            "asks for {asked}; the limit '{name}' is {most}; set {VARIABLE}={name}={unit} to raise it"
        )))
    }
}

impl Unit {
    fn text(self, amount: f64) -> String {
        match self {
            Unit::Bytes => {
                let (scale, unit) = match amount {
                    a if a >= 1e9 => (1e9, "GB"),
                    a if a >= 1e6 => (1e6, "MB"),
                    a if a >= 1e3 => (1e3, "kB"),
                    _ => (1.0, "bytes"),
                };
                format!("{} {unit}", short(amount / scale))
            }
            Unit::Seconds => format!("{} s", short(amount)),
            Unit::Count(things) => format!("{} {things}", short(amount)),
        }
    }

    fn example(self) -> &'static str {
        match self {
            Unit::Bytes => "<SIZE>, for example 8GB,",
            Unit::Seconds => "<SECONDS>",
            Unit::Count(_) => "<COUNT>",
        }
    }
}

/// Formats three significant digits, or all digits of a whole number below a million.
fn short(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e6 {
        format!("{x}")
    } else if x.abs() < 1e6 {
        let digits = if x.abs() < 10.0 { 2 } else { 1 };
        format!("{x:.digits$}")
    } else {
        format!("{x:.2e}")
    }
}

/// Reads a regular file within the limit. Devices and pipes are refused, because they have no size and may never end.
///
/// # Errors
/// If the file is too large, is not a regular file, or cannot be read.
pub fn read(path: &Path, limit: &Limit) -> io::Result<Vec<u8>> {
    let facts = std::fs::metadata(path)?;
    if !facts.is_file() {
        let found = if facts.is_dir() { "a folder" } else { "a device, pipe or socket" };
        return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("found {found}, expected a regular file")));
    }
    let size = facts.len();
    limit.check(size as f64)?;
    let most = limit.most()?;
    let mut bytes = Vec::new();
    // the file may grow while it is read
    std::fs::File::open(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    limit.check(bytes.len() as f64)?;
    Ok(bytes)
}

/// Reads a text file like [`read`].
///
/// # Errors
/// Like [`read`], and if the bytes are not UTF-8.
pub fn read_to_string(path: &Path, limit: &Limit) -> io::Result<String> {
    String::from_utf8(read(path, limit)?).map_err(|e| {
        let place = e.utf8_error().valid_up_to();
        io::Error::new(io::ErrorKind::InvalidData, format!("byte {place} is not UTF-8 text"))
    })
}

/// Name and value of every limit that the text of [`VARIABLE`] sets.
fn parse(text: &str) -> Result<Vec<(String, u64)>, OverBudget> {
    let bad = |found: &str, expected: String| OverBudget(format!("{VARIABLE}: found '{found}', expected {expected}"));
    let mut raised = Vec::new();
    for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        let (name, value) =
            part.split_once('=').ok_or_else(|| bad(part, "NAME=VALUE, for example memory=8GB".into()))?;
        let (name, value) = (name.trim(), value.trim());
        let limit = ALL.iter().find(|limit| limit.name == name).ok_or_else(|| {
            let names: Vec<&str> = ALL.iter().map(|limit| limit.name).collect();
            bad(name, format!("the name of a limit{}", hint::among(name, &names)))
        })?;
        let amount = amount(value, limit.unit).ok_or_else(|| {
            let example = if limit.unit == Unit::Bytes { "500MB or 8GB" } else { "7200" };
            bad(value, format!("a positive number for {name}, for example {example}"))
        })?;
        raised.push((name.to_owned(), amount));
    }
    Ok(raised)
}

fn amount(value: &str, unit: Unit) -> Option<u64> {
    let digits = value.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let scale = match (value[digits.len()..].to_ascii_lowercase().as_str(), unit) {
        ("", _) => 1.0,
        ("k" | "kb", Unit::Bytes) => 1e3,
        ("m" | "mb", Unit::Bytes) => 1e6,
        ("g" | "gb", Unit::Bytes) => 1e9,
        ("t" | "tb", Unit::Bytes) => 1e12,
        ("s", Unit::Seconds) => 1.0,
        _ => return None,
    };
    let amount = digits.trim().parse::<f64>().ok()? * scale;
    (1.0..=1e18).contains(&amount).then_some(amount as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_limit_and_how_to_raise_it() {
        assert_eq!(MEMORY.check(2e9), Ok(()));
        let error = MEMORY.check(6.4e10).unwrap_err().to_string();
        assert_eq!(
            error,
            "asks for 64 GB; the limit 'memory' is 2 GB; set MARATHON_LIMITS=memory=<SIZE>, for example 8GB, to raise it"
        );
        assert!(MEMORY.check(f64::NAN).is_err() && MEMORY.check(f64::INFINITY).is_err());
        let error = RECORDING_SECONDS.check(1e300).unwrap_err().to_string();
        assert!(error.starts_with("asks for 1.00e300 s; the limit 'recording_seconds' is 3600 s"), "{error}");
    }

    #[test]
    fn the_variable_raises_limits_by_name() {
        let raised = parse("memory=8GB, recording_seconds=7200,model_file=1.5m").unwrap();
        let expected = [("memory", 8_000_000_000), ("recording_seconds", 7200), ("model_file", 1_500_000)];
        assert_eq!(raised, expected.map(|(name, most)| (name.to_owned(), most)));
        for (text, expected) in [
            ("memory", "found 'memory', expected NAME=VALUE"),
            ("memry=8GB", "did you mean 'memory'?"),
            ("memory=lots", "found 'lots', expected a positive number for memory, for example 500MB or 8GB"),
            ("recording_seconds=1GB", "for example 7200"),
            ("memory=-1", "found '-1'"),
            ("memory=nan", "found 'nan'"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.starts_with("MARATHON_LIMITS: ") && error.contains(expected), "{error}");
        }
    }

    #[test]
    fn every_limit_has_a_name_of_its_own() {
        let mut names: Vec<&str> = ALL.iter().map(|limit| limit.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), ALL.len());
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_folders_are_not_read() {
        for (path, found) in [("/dev/zero", "a device, pipe or socket"), ("/", "a folder")] {
            let error = read(Path::new(path), &MODEL_FILE).unwrap_err().to_string();
            assert_eq!(error, format!("found {found}, expected a regular file"));
        }
    }
}
