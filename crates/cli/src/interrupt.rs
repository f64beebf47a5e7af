//! Ctrl-C: the first asks, the second ends the program at once. A signal that the program was started to ignore, as by
//! `nohup`, stays ignored.
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
    listen(handler)
}

/// Calls `handler` at every Ctrl-C, SIGTERM and SIGHUP that is not ignored.
///
/// # Errors
/// If the system refuses.
pub fn listen(handler: impl Fn() + Send + 'static) -> Result<(), CliError> {
    let ignored = ignored::now();
    let set = ctrlc::set_handler(handler);
    ignored::again(&ignored);
    set.map_err(|e| CliError::Process(format!("cannot listen for Ctrl-C: {e}")))
}

#[cfg(unix)]
mod ignored {
    use libc::c_int;

    /// Those that the handler takes over.
    const TAKEN: [c_int; 3] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP];

    /// Signals that are ignored.
    pub fn now() -> Vec<c_int> {
        let is_ignored = |signal: &c_int| {
            // SAFETY: all bits zero are an action, and without a new one the call only writes the old one
            unsafe {
                let mut action: libc::sigaction = std::mem::zeroed();
                libc::sigaction(*signal, std::ptr::null(), &mut action) == 0 && action.sa_sigaction == libc::SIG_IGN
            }
        };
        TAKEN.into_iter().filter(is_ignored).collect()
    }

    /// Ignores signals.
    pub fn again(signals: &[c_int]) {
        for signal in signals {
            // SAFETY: ignoring a signal runs nothing
            unsafe { libc::signal(*signal, libc::SIG_IGN) };
        }
    }
}

#[cfg(not(unix))]
mod ignored {
    pub fn now() {}
    pub fn again((): &()) {}
}

/// Whether the user wants to stop.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}
