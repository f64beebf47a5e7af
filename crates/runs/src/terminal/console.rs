//! Output that outlives its reader: when the reader of `marathon train ... | head` exits, the run continues. If stdout loses a
//! result for another reason, such as a full disk, the program ends with an error.

use crate::error::RunError;
use crate::text::{printable, printable_json};
use serde::Serialize;
use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::path::Path;
use std::sync::Mutex;

/// The first error of stdout.
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

/// Prints progress, notes and errors on stderr.
pub fn note(text: impl AsRef<str>) {
    let _ = writeln!(stderr(), "{}", printable(text.as_ref()));
}

/// Prints notes for the user on stderr.
pub fn notes(all: impl IntoIterator<Item = String>) {
    all.into_iter().for_each(|text| note(format!("note: {text}")));
}

/// Prints the one JSON object of `--json`.
pub fn print_json(document: &impl Serialize) {
    match serde_json::to_string_pretty(document) {
        Ok(json) => put(&printable_json(&json)),
        Err(error) => written(Err(error.into())),
    }
}

/// Keeps the first error of stdout for [`flush`]. A closed pipe is no error.
pub(super) fn written(result: io::Result<()>) {
    if let Err(error) = result
        && error.kind() != ErrorKind::BrokenPipe
    {
        LOST.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error);
    }
}

/// Flushes stdout and returns its first error.
pub(super) fn flush() -> Result<(), RunError> {
    written(stdout().flush());
    match LOST.lock().unwrap_or_else(|e| e.into_inner()).take() {
        None => Ok(()),
        Some(error) => Err(RunError::io(Path::new("stdout"), "write")(error)),
    }
}
