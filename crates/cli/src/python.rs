//! The Python that others' programs run in.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Names the Python to use.
pub const VARIABLE: &str = "MARATHON_PYTHON";
/// Last characters of a process's complaints that are worth showing.
const COMPLAINT: usize = 2000;

/// The Python that the user names, else that of the virtual environment at hand, else the system's.
pub fn find() -> PathBuf {
    if let Some(named) = env::var_os(VARIABLE).filter(|name| !name.is_empty()) {
        return named.into();
    }
    let inside = if cfg!(windows) { ".venv/Scripts/python.exe" } else { ".venv/bin/python" };
    let here = env::current_dir().unwrap_or_default();
    let root = here.ancestors().find(|folder| folder.join(".git").exists());
    let venv = [Some(here.as_path()), root].into_iter().flatten().map(|folder: &Path| folder.join(inside));
    let found = venv.into_iter().find(|python| python.exists());
    found.unwrap_or_else(|| if cfg!(windows) { "python".into() } else { "python3".into() })
}

/// A Python that runs a script of ours and is talked to through pipes.
pub fn command(python: &Path, script: &str) -> Command {
    let mut command = Command::new(python);
    // a folder called like a package in the working directory is not the package
    command.args(["-c", script]).env("PYTHONSAFEPATH", "1");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The end of what a process complained of.
pub fn complaint(text: &str) -> &str {
    let text = text.trim();
    let from = text.char_indices().rev().nth(COMPLAINT).map_or(0, |(i, _)| i);
    &text[from..]
}
