//! Where a player says what it does: Python gives it no terminal, but a file.

use crate::error::PlayerError;
use std::fmt;
use std::fs::File;
use std::io::{Write, stderr};
use std::path::Path;
use std::sync::Arc;

/// Limit on the length of an external text in the log, characters.
const SHOWN: usize = 100;

/// An external text made safe for a terminal: without control characters, and shortened.
pub(crate) fn shown(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN).flat_map(char::escape_debug).collect();
    if text.chars().nth(SHOWN).is_some() {
        shown.push_str("...");
    }
    shown
}

/// A log file, or the standard error. Copies write to the same.
#[derive(Clone, Debug)]
pub struct Log(Option<Arc<File>>);

impl Log {
    /// To the standard error.
    pub fn to_stderr() -> Self {
        Log(None)
    }

    /// To a file, which is begun anew.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn to_file(path: &Path) -> Result<Self, PlayerError> {
        match File::create(path) {
            Ok(file) => Ok(Log(Some(Arc::new(file)))),
            Err(source) => Err(PlayerError::Log { path: path.into(), source }),
        }
    }

    /// Writes a line. A log that cannot be written is no reason to end a training.
    pub fn line(&self, text: fmt::Arguments<'_>) {
        let line = format!("marathon-player: {text}\n");
        let _ = match &self.0 {
            Some(file) => (&**file).write_all(line.as_bytes()),
            None => stderr().write_all(line.as_bytes()),
        };
    }
}
