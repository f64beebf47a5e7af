//! Errors of the trainer.

use marathon_physics::budget::OverBudget;
use std::path::{Path, PathBuf};

/// Limit on the characters of a file's contents in a message.
const MOST_SHOWN: usize = 300;

/// An error of the trainer. The text says where it occurred, what was found and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A configuration value is out of range.
    #[error("configuration: {field} is {found}, expected {expected}")]
    Config {
        /// Name of the field, with its sections.
        field: String,
        /// Its value.
        found: String,
        /// Valid values, with the nearest one if there is one.
        expected: String,
    },
    /// The instruction set is not one that networks run on, or not there.
    #[error("instruction set {0} cannot train networks on this processor; use {1}")]
    Isa(&'static str, &'static str),
    /// A run needs more memory than is available.
    #[error("this run needs about {gigabytes:.1} GB of memory, more than is available; {less} need less")]
    Memory {
        /// Memory that the run needs, GB.
        gigabytes: f64,
        /// Settings that need less.
        less: String,
    },
    /// Training led to parameters that are not finite.
    #[error(
        "training has diverged: {count} of {parameters} parameters are not finite after {steps} steps; a smaller learning rate \
         ({rates}) keeps them finite"
    )]
    Diverged {
        /// Number of parameters that are not finite.
        count: usize,
        /// Number of all parameters.
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
        /// The attempted action.
        action: &'static str,
        /// Its cause.
        source: std::io::Error,
    },
    /// A file has wrong contents.
    #[error("{}: {place}: found {found}, expected {expected}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Place in the file.
        place: String,
        /// Contents at that place.
        found: String,
        /// Valid contents.
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
    /// A policy or checkpoint does not belong here.
    #[error("{what} is for {found}, expected {expected}")]
    Mismatch {
        /// Item that does not fit.
        what: String,
        /// Its purpose.
        found: String,
        /// Its use here.
        expected: String,
    },
}

impl Error {
    /// Converts a configuration error into one of the file that holds the configuration under `key`.
    pub fn in_file(self, path: &Path, key: &str) -> Self {
        match self {
            Error::Config { field, found, expected } => Error::file(path, format!("{key}.{field}"), found, expected),
            other => other,
        }
    }
    /// Converts a mismatch into an error of the file that holds the item.
    pub fn of_file(self, path: &Path) -> Self {
        match self {
            Error::Mismatch { what, found, expected } => Error::file(path, what, found, expected),
            other => other,
        }
    }
    /// The same error of a field in a section.
    pub(crate) fn within(self, section: &str) -> Self {
        match self {
            Error::Config { field, found, expected } => {
                Error::Config { field: format!("{section}.{field}"), found, expected }
            }
            other => other,
        }
    }
    pub(crate) fn config(field: impl Into<String>, found: impl ToString, expected: impl ToString) -> Self {
        Error::Config { field: field.into(), found: found.to_string(), expected: expected.to_string() }
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
