//! What can go wrong.

use marathon_physics::budget::OverBudget;
use std::path::{Path, PathBuf};

/// Limit on the characters of a file's contents in a message.
const MOST_SHOWN: usize = 300;

/// An error of the trainer; the text says where, what was found and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A configuration value is out of range.
    #[error("configuration: {field} is {found}, expected {expected}")]
    Config {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        found: String,
        /// What would do, with the nearest valid choice where there is one.
        expected: String,
    },
    /// A setting by its name is none, or of the wrong kind.
    #[error("configuration: {place}: {why}")]
    Settings {
        /// The setting.
        place: String,
        /// What is wrong with it.
        why: String,
    },
    /// The instruction set is not one that networks run on, or not there.
    #[error("instruction set {0} cannot train networks on this processor; use {1}")]
    Isa(&'static str, &'static str),
    /// A run needs more memory than there is.
    #[error("this run needs about {gigabytes:.1} GB of memory, more than can be had; {less} need less")]
    Memory {
        /// What it needs.
        gigabytes: f64,
        /// What would need less.
        less: String,
    },
    /// Learning has led to parameters that are not finite.
    #[error(
        "training has diverged: {count} of {parameters} parameters are not finite after {steps} steps; a smaller learning rate \
         ({rates}) keeps them finite"
    )]
    Diverged {
        /// Parameters that are not finite.
        count: usize,
        /// All parameters.
        parameters: usize,
        /// Agent-steps done.
        steps: u64,
        /// Learning rates, as configured.
        rates: String,
    },
    /// A file cannot be read or written.
    #[error("{}: {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {place}: found {found}, expected {expected}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// A file's contents exceed a limit.
    #[error("{}: {place} {error}", path.display())]
    Budget {
        /// The file.
        path: PathBuf,
        /// The part of the file that exceeds the limit.
        place: String,
        /// The amount and the limit.
        error: OverBudget,
    },
    /// A policy or checkpoint belongs to something else.
    #[error("{what} is for {found}, expected {expected}")]
    Mismatch {
        /// What does not fit.
        what: String,
        /// What it is for.
        found: String,
        /// What it is used for.
        expected: String,
    },
}

impl Error {
    /// The same error as one of a file: what is wrong with a configuration is wrong in the file that holds it, under `key`.
    pub fn in_file(self, path: &Path, key: &str) -> Self {
        match self {
            Error::Config { field, found, expected } => Error::file(path, format!("{key}.{field}"), found, expected),
            other => other,
        }
    }
    /// What does not fit, as an error of the file that holds it.
    pub fn of_file(self, path: &Path) -> Self {
        match self {
            Error::Mismatch { what, found, expected } => Error::file(path, what, found, expected),
            other => other,
        }
    }
    pub(crate) fn config(field: &'static str, found: impl ToString, expected: impl ToString) -> Self {
        Error::Config { field, found: found.to_string(), expected: expected.to_string() }
    }
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Error::Io { path: path.into(), action, source }
    }
    pub(crate) fn file(path: &Path, place: impl ToString, found: impl ToString, expected: impl ToString) -> Self {
        let expected = expected.to_string();
        Error::File { path: path.into(), place: short(place.to_string()), found: short(found.to_string()), expected }
    }
    /// Creates the error for file contents that exceed a limit.
    pub(crate) fn budget(path: &Path, place: &str, error: OverBudget) -> Self {
        Error::Budget { path: path.into(), place: place.into(), error }
    }
}

/// Shortens a text from a file for a message.
fn short(text: String) -> String {
    match text.char_indices().nth(MOST_SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}
