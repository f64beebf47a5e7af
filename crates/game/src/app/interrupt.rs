//! Ctrl-C and SIGTERM: the first ends the game as its last key would, with what has been recorded saved; the second ends it at once.

use bevy::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a program that Ctrl-C has ended.
pub const CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Listens from now on.
pub fn listen() {
    let handler = || {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            std::process::exit(CODE.into());
        }
    };
    // without it a signal ends the process, as it does any other
    if let Err(error) = ctrlc::try_set_handler(handler) {
        warn!("Ctrl-C will end the game without saving recordings: {error}");
    }
}

/// Whether the game is to end.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Ends the game when it is to.
pub fn obey(mut exit: MessageWriter<AppExit>) {
    if requested() {
        exit.write(AppExit::from_code(CODE));
    }
}
