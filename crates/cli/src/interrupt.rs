//! Ctrl-C: the first asks, the second ends the program at once.
//!
//! Files are written under temporary names and renamed, so even the second leaves none half-written.

use crate::console::note;
use crate::error::CliError;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Exit code after an interruption.
const EXIT_CODE: i32 = 130;

/// From now on, the first Ctrl-C (or SIGTERM) prints `message` and makes [`requested`] true.
///
/// # Errors
/// If the system refuses.
pub fn install(message: &'static str) -> Result<(), CliError> {
    let handler = move || {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            note("\naborted");
            std::process::exit(EXIT_CODE);
        }
        note(format!("\n{message} (Ctrl-C again: abort at once)"));
    };
    ctrlc::set_handler(handler).map_err(|e| CliError::Usage(format!("cannot listen for Ctrl-C: {e}")))
}

/// Whether the user wants to stop.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}
