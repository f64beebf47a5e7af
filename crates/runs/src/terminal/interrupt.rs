//! Ctrl-C: the first asks the program to stop, the second ends it at once. SIGTERM and SIGHUP do the same, but SIGHUP stays
//! ignored if the program was started that way, as by `nohup`.
//!
//! Files are written under temporary names and renamed, so even the second Ctrl-C leaves no half-written file.

use super::console::note;
use crate::error::RunError;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Exit code after an interruption.
const EXIT_CODE: i32 = 130;

/// From now on, the first Ctrl-C prints `message` and makes [`requested`] true.
///
/// # Errors
/// If the system does not report Ctrl-C.
pub fn install(message: &'static str) -> Result<(), RunError> {
    let handler = move || {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            note("\naborted");
            std::process::exit(EXIT_CODE);
        }
        note(format!("\n{message} (Ctrl-C again: abort at once)"));
    };
    listen(handler)
}

/// Calls `handler` at every Ctrl-C and SIGTERM, and at every SIGHUP unless it is ignored.
///
/// # Errors
/// If the system does not report Ctrl-C.
pub fn listen(handler: impl Fn() + Send + 'static) -> Result<(), RunError> {
    let ignored = hangups_are_ignored();
    let set = ctrlc::set_handler(handler);
    if ignored {
        ignore_hangups();
    }
    set.map_err(|e| RunError::Signal(format!("cannot listen for Ctrl-C: {e}")))
}

#[cfg(unix)]
fn hangups_are_ignored() -> bool {
    // SAFETY: all bits zero are an action, and without a new one the call only writes the old one
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(libc::SIGHUP, std::ptr::null(), &mut action) == 0 && action.sa_sigaction == libc::SIG_IGN
    }
}

#[cfg(unix)]
fn ignore_hangups() {
    // SAFETY: ignoring a signal runs nothing
    unsafe { libc::signal(libc::SIGHUP, libc::SIG_IGN) };
}

#[cfg(not(unix))]
fn hangups_are_ignored() -> bool {
    false
}

#[cfg(not(unix))]
fn ignore_hangups() {}

/// Whether the user has asked the program to stop.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}
