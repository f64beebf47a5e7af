//! Errors of configuration files.

use marathon_physics::hint::{did_you_mean, nearest};
use std::fmt;
use std::path::{Path, PathBuf};

/// A key of a configuration file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: PathBuf,
    /// Line of the key, counted from 1; 0 where there are no lines.
    pub line: usize,
    /// Names of the sections and the key, joined by dots.
    pub key: String,
}

impl Place {
    /// A place without lines.
    pub(super) fn of(file: &str, key: &str) -> Self {
        Place { file: file.into(), line: 0, key: key.into() }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.file.display(), self.key),
            line => write!(f, "{}:{line}: {}", self.file.display(), self.key),
        }
    }
}

/// Why a configuration file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file is not YAML, or uses what no configuration needs.
    #[error("{}:{line}:{column}: {problem}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// The problem, and the expected contents.
        problem: String,
    },
    /// A key that neither ML-Agents nor Marathon knows.
    #[error("{place}: unknown key{}", suggestion(nearest, known))]
    UnknownKey {
        /// The key.
        place: Place,
        /// The known key closest to it, if one is close.
        nearest: Option<String>,
        /// All keys that may stand there, comma separated.
        known: String,
    },
    /// A value of the wrong kind or out of range.
    #[error("{place}: found {found}, expected {expected}")]
    Value {
        /// The key.
        place: Place,
        /// Its value.
        found: String,
        /// Values that the key accepts.
        expected: String,
    },
    /// A feature of ML-Agents that Marathon does not have.
    #[error("{place}: {feature} is not supported; found {found}, expected {expected}")]
    Unsupported {
        /// The key that asks for it.
        place: Place,
        /// The feature.
        feature: &'static str,
        /// The value.
        found: String,
        /// A change that makes the file usable.
        expected: String,
    },
    /// The file says nothing about an agent.
    #[error("{}: nothing about agent {agent}; the file has {names}; expected one of {accepted}, or {default}{}", path.display(), did_you_mean(nearest.as_ref()))]
    NoSuchBehavior {
        /// The file.
        path: PathBuf,
        /// The agent asked for.
        agent: String,
        /// The name in the file closest to the agent's, if one is close.
        nearest: Option<String>,
        /// Names in the file.
        names: String,
        /// Names under which the agent is looked for.
        accepted: String,
        /// Name of the section that serves all agents.
        default: &'static str,
    },
    /// The values do not go together.
    #[error("{}: {source}", path.display())]
    Combination {
        /// The file.
        path: PathBuf,
        /// The trainer's complaint.
        source: marathon_learn::Error,
    },
}

fn suggestion(nearest: &Option<String>, known: &str) -> String {
    match nearest {
        Some(_) => did_you_mean(nearest.as_ref()),
        None => format!("; expected one of {known}"),
    }
}

impl ConfigError {
    pub(super) fn syntax(path: &Path, line: usize, column: usize, problem: impl Into<String>) -> Self {
        ConfigError::Syntax { path: path.into(), line, column, problem: problem.into() }
    }
    pub(super) fn value(place: Place, found: impl Into<String>, expected: impl Into<String>) -> Self {
        ConfigError::Value { place, found: found.into(), expected: expected.into() }
    }
    pub(super) fn unknown(place: Place, key: &str, known: &[&str]) -> Self {
        let nearest = nearest(key, known.iter().copied()).map(Into::into);
        ConfigError::UnknownKey { place, nearest, known: known.join(", ") }
    }
}

/// A message of the parser on one line. It may quote characters of the file.
pub(super) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { c.escape_debug().to_string() } else { c.to_string() }).collect()
}

/// A text of a file as messages show it: on one line, and not too long.
pub(super) fn shown(text: &str) -> String {
    const MOST: usize = 60;
    let mut line: String = text.chars().take(MOST).flat_map(|c| c.escape_debug()).collect();
    if text.chars().nth(MOST).is_some() {
        line.push_str("...");
    }
    line
}
