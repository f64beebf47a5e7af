//! The log of a player. Python gives it no terminal, but a file.

use crate::error::PlayerError;
use std::fmt;
use std::fs::File;
use std::io::{Write, stderr};
use std::path::Path;
use std::sync::Arc;

/// Limit on the length of an external text in the log, characters.
const SHOWN: usize = 100;

/// Makes an external text safe for a terminal: removes control characters and shortens it.
pub(crate) fn shown(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN).flat_map(char::escape_debug).collect();
    if text.chars().nth(SHOWN).is_some() {
        shown.push_str("...");
    }
    shown
}

/// A log on stderr or in a file. Copies write to the same one.
#[derive(Clone, Debug)]
pub struct Log(Option<Arc<File>>);

impl Log {
    /// Logs to stderr.
    pub fn to_stderr() -> Self {
        Log(None)
    }

    /// Logs to a file, which is overwritten.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn to_file(path: &Path) -> Result<Self, PlayerError> {
        match File::create(path) {
            Ok(file) => Ok(Log(Some(Arc::new(file)))),
            Err(source) => Err(PlayerError::Log { path: path.into(), source }),
        }
    }

    /// Writes a line. Errors are ignored: training must not end because of a log.
    pub fn line(&self, text: fmt::Arguments<'_>) {
        let line = format!("marathon-player: {text}\n");
        let _ = match &self.0 {
            Some(file) => (&**file).write_all(line.as_bytes()),
            None => stderr().write_all(line.as_bytes()),
        };
    }
}
