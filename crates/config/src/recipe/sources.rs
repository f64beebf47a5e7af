//! Policies that a stage uses: those of earlier stages, and files.

use crate::error::{ConfigError, shown};
use crate::section::Entry;
use marathon_physics::hint::{did_you_mean, nearest};

/// Endings of policy files.
const ENDINGS: [&str; 2] = [".safetensors", ".onnx"];
/// Ending of a name that means all policies that a stage has kept.
const KEPT: &str = "/policies";

/// A policy that a stage uses.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The policy of an earlier stage, by its index.
    Stage(usize),
    /// All policies that an earlier stage has kept.
    Kept(usize),
    /// A policy file or the folder of a run, from the folder of the recipe.
    File(String),
}

impl Source {
    /// Reads a name. `kept`: whether it may mean all policies of a stage.
    pub(super) fn read(entry: &Entry<'_>, earlier: &[&str], kept: bool) -> Result<Self, ConfigError> {
        let text = entry.word_of_any_kind("a stage or a policy file")?;
        let stage = |name: &str| earlier.iter().position(|known| *known == name);
        if let Some(i) = stage(&text) {
            return Ok(Source::Stage(i));
        }
        if let Some(i) = text.strip_suffix(KEPT).and_then(stage) {
            return match kept {
                true => Ok(Source::Kept(i)),
                false => entry.wrong("one policy; only 'average' takes all policies of a stage"),
            };
        }
        if ENDINGS.iter().any(|ending| text.ends_with(ending)) || text.contains(['/', '\\']) {
            return Ok(Source::File(text));
        }
        let near = did_you_mean(nearest(&text, earlier.iter().copied()));
        let known =
            if earlier.is_empty() { String::new() } else { format!("an earlier stage ({}) or ", earlier.join(", ")) };
        let found = format!("'{}'", shown(&text));
        Err(ConfigError::value(entry.place.clone(), found, format!("{known}a file with the ending .safetensors{near}")))
    }

    /// The stage that it is from.
    pub fn stage(&self) -> Option<usize> {
        match self {
            Source::Stage(i) | Source::Kept(i) => Some(*i),
            Source::File(_) => None,
        }
    }
}
