//! The program as the user called it, and the spelling of options and commands in errors.

use marathon_runs::text::word;
use marathon_runs::{Flags, Spelling};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

static PROGRAM: OnceLock<String> = OnceLock::new();
static CALLED: OnceLock<PathBuf> = OnceLock::new();

/// Stores the name that the user called the program by.
pub fn set_name(called: Option<&OsString>) {
    if let Some(called) = called {
        CALLED.get_or_init(|| called.into());
    }
    let called = called.map(|name| name.to_string_lossy()).unwrap_or_default();
    // the shell found a bare name and will find it again
    PROGRAM.get_or_init(|| if called.is_empty() { "marathon".into() } else { word(&called) });
}

/// The program as the user called it, so that a printed command can be pasted into the same shell.
pub fn name() -> String {
    PROGRAM.get().cloned().unwrap_or_else(|| "marathon".into())
}

/// The file that starts this program again: this executable, or the called name if another program includes the command, as
/// the Python package does.
pub fn file() -> PathBuf {
    let own = std::env::current_exe().ok().filter(|file| file.file_stem().is_some_and(|stem| stem == "marathon"));
    own.or_else(|| CALLED.get().cloned()).unwrap_or_else(|| "marathon".into())
}

/// The command that continues a run.
pub fn resume_command(folder: &Path) -> String {
    spelled(|flags| flags.resume(folder))
}

/// A text whose options and commands are spelled as on this command line.
pub fn spelled(text: impl FnOnce(&dyn Spelling) -> String) -> String {
    text(&Flags(&name()))
}
