//! Ctrl-C and SIGTERM. The first one quits like the quit key, and recordings are saved. The second one ends the process
//! at once.

use bevy::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a program that Ctrl-C ended.
pub const CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Starts to listen for the signals.
pub fn listen() {
    let handler = || {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            std::process::exit(CODE.into());
        }
    };
    // a shell starts background jobs with Ctrl-C ignored, which counts as a handler: take its place
    if let Err(error) = ctrlc::set_handler(handler) {
        warn!("Ctrl-C will end the game without saving recordings: {error}");
    }
}

/// Whether the game should quit.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Quits the game after a signal.
pub fn quit(mut exit: MessageWriter<AppExit>) {
    if requested() {
        exit.write(AppExit::from_code(CODE));
    }
}
