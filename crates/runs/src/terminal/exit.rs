//! The end of a program: errors on stderr, with `--json` also on stdout, and the exit code.

use super::console::{self, note, print_json};
use std::fmt::Display;

/// Prints the error that ends a program. With `json`, stdout also gets it as an object.
pub fn failed(error: &impl Display, json: bool) {
    note(format!("error: {error}"));
    if json {
        print_json(&serde_json::json!({ "error": error.to_string() }));
    }
}

/// Prints clap's answer to a command line that it does not run: help on stdout with exit code 0, an error on stderr with exit
/// code 2. With `json`, stdout gets the error as an object. Returns the exit code.
pub fn refused(answer: &clap::Error, json: bool) -> u8 {
    let printed = answer.print();
    if !answer.use_stderr() {
        console::written(printed);
    } else if json {
        let text = answer.render().to_string();
        let text = text.trim().trim_start_matches("error: ");
        print_json(&serde_json::json!({ "error": text }));
    }
    answer.exit_code() as u8
}

/// Returns the exit code of a program that ends with `code`. If stdout has lost output, prints the reason, and success becomes
/// failure.
pub fn finish(code: u8) -> u8 {
    match console::flush() {
        Ok(()) => code,
        Err(error) => {
            note(format!("error: {error}"));
            code.max(1)
        }
    }
}
