//! Output that outlives its reader: `marathon train ... | head` must not lose a run because nobody reads on.

use serde::Serialize;
use std::io::{Write, stderr, stdout};

/// Prints text for the user, or a command's result, on stdout.
pub fn say(text: impl AsRef<str>) {
    let _ = writeln!(stdout(), "{}", text.as_ref());
}

/// Prints what is not a result on stderr: progress, notes, errors.
pub fn note(text: impl AsRef<str>) {
    let _ = writeln!(stderr(), "{}", text.as_ref());
}

/// Prints the one JSON object of `--json`.
pub fn print_json(document: &impl Serialize) {
    say(serde_json::to_string_pretty(document).expect("documents are plain data"));
}
