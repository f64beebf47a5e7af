//! Output that outlives its reader: `marathon train ... | head` must not lose a run because nobody reads on. A result that
//! stdout does not take for another reason, such as a full disk, is an error.

use crate::error::CliError;
use marathon_runs::text::{printable, printable_json};
use serde::Serialize;
use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::path::Path;
use std::sync::Mutex;

/// Why something is missing on stdout, the first time.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints text for the user, or a command's result, on stdout. The text may contain parts of files. Control characters
/// in it are escaped, so that the terminal does not run them.
pub fn say(text: impl AsRef<str>) {
    put(&printable(text.as_ref()));
}

fn put(text: &str) {
    let mut out = stdout().lock();
    written(writeln!(out, "{text}").and_then(|()| out.flush()));
}

/// Prints what is not a result on stderr: progress, notes, errors.
pub fn note(text: impl AsRef<str>) {
    let _ = writeln!(stderr(), "{}", printable(text.as_ref()));
}

/// Prints the one JSON object of `--json`.
pub fn print_json(document: &impl Serialize) {
    match serde_json::to_string_pretty(document) {
        Ok(json) => put(&printable_json(&json)),
        Err(error) => written(Err(error.into())),
    }
}

/// Takes note of what became of something written to stdout.
pub fn written(result: io::Result<()>) {
    if let Err(error) = result
        && error.kind() != ErrorKind::BrokenPipe
    {
        LOST.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error);
    }
}

/// The error of a program whose output was lost.
///
/// # Errors
/// If stdout has not taken something.
pub fn finish() -> Result<(), CliError> {
    written(stdout().flush());
    match LOST.lock().unwrap_or_else(|e| e.into_inner()).take() {
        None => Ok(()),
        Some(error) => Err(CliError::io(Path::new("stdout"), "write")(error)),
    }
}
